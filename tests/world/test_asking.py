"""Goals, parameters, simulations, packages and launch files in stepped runs, with real nodes."""

import importlib.util
import shutil
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest
from places import ROOT, TESTS
from std_srvs.srv import SetBool
from test_msgs.action import Fibonacci, NestedMessage

from grader.api import Moment, Output, Simulation
from grader.runtime.model.errors import HarnessError, SubmissionError
from grader.world.errors import ParameterRejected, StepTimeout, WrongType
from grader.world.opening import Worlds
from grader.world.world import World

pytestmark = pytest.mark.ros


@pytest.fixture
def fibonacci_server(tmp_path: Path) -> Path:
    """The server of the example, with an action that the test's process has as well."""
    text = (ROOT / "examples/fibonacci/reference/fibonacci_server.py").read_text(encoding="utf-8")
    file = tmp_path / "fibonacci_server.py"
    file.write_text(text.replace("example_interfaces.action", "test_msgs.action"), encoding="utf-8")
    return file


def test_a_goal_has_feedback_and_a_result(ros: World, fibonacci_server: Path) -> None:
    """A number every half second; the feedback of one goal is not that of another."""
    ros.run(fibonacci_server)
    for order, numbers in ((4, [0, 1, 1, 2, 3]), (3, [0, 1, 1, 2])):
        began = ros.now
        outcome = ros.send_goal("/fibonacci", Fibonacci.Goal(order=order))
        assert (outcome.accepted, outcome.status, list(outcome.result.sequence)) == (True, 4, numbers)
        assert [list(one.message.sequence) for one in outcome.feedback] == [numbers[: n + 3] for n in range(order - 1)]
        assert ros.now - began == pytest.approx(0.5 * (order - 1), abs=1e-4)


def test_what_rclpy_stamps_itself_makes_no_pause_longer(ros: World, tmp_path: Path) -> None:
    """A node that looks at no clock sleeps exactly as long as it says, and so does its own clock."""
    (tmp_path / "server.py").write_text(
        "import time\nimport rclpy\nfrom rclpy.action import ActionServer\nfrom rclpy.duration import Duration\n"
        "from test_msgs.action import Fibonacci\nrclpy.init()\nnode = rclpy.create_node('server')\n"
        "def execute(goal):\n"
        "    for number in range(4):\n"
        "        goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))\n"
        "        node.get_clock().sleep_for(Duration(seconds=0.25)) if number % 2 else time.sleep(0.5)\n"
        "    goal.succeed()\n"
        "    return Fibonacci.Result()\n"
        "server = ActionServer(node, Fibonacci, 'count', execute)\nrclpy.spin(node)\n"
    )
    ros.run(tmp_path / "server.py")
    outcome = ros.send_goal("/count", Fibonacci.Goal())
    assert [one.t for one in outcome.feedback] == [0.0, 0.5, 0.75, 1.25]


def test_a_goal_of_another_type_is_an_error(ros: World, fibonacci_server: Path) -> None:
    """No server would ever answer it."""
    ros.run(fibonacci_server)
    words = (
        "/fibonacci: /fibonacci_server offers test_msgs/action/Fibonacci, the test uses test_msgs/action/NestedMessage"
    )
    with pytest.raises(WrongType, match=words):
        ros.send_goal("/fibonacci", NestedMessage.Goal())


def test_a_goal_may_be_cancelled_or_refused(ros: World, fibonacci_server: Path) -> None:
    """Both are outcomes, not errors."""
    ros.run(fibonacci_server)
    cancelled = ros.send_goal("fibonacci", Fibonacci.Goal(order=100), cancel_after=2.2)
    assert (cancelled.status, 2.2 <= ros.now < 3.0) == (5, True)
    refused = ros.send_goal("/fibonacci", Fibonacci.Goal(order=-1))
    assert (refused.accepted, refused.result) == (False, None)


def test_a_goal_without_a_result_says_why(ros: World, fibonacci_server: Path) -> None:
    """Nobody offers the action, or it takes longer."""
    with pytest.raises(StepTimeout, match="nobody offers the action /fibonacci"):
        ros.send_goal("/fibonacci", Fibonacci.Goal(order=4), timeout=1.0)
    ros.run(fibonacci_server)
    with pytest.raises(StepTimeout, match="it has accepted the goal"):
        ros.send_goal("/fibonacci", Fibonacci.Goal(order=50), timeout=1.0)


def test_a_parameter_is_set_while_a_node_runs(ros: World) -> None:
    """As with `ros2 param set`; a value that the node refuses, or does not know, fails."""
    ros.run(ROOT / "examples/parameters/reference/greeter.py", parameters={"period": 0.5})
    ros.advance(2.0)
    ros.set_parameter("/greeter", "name", "you")
    ros.set_parameter("greeter", "period", 0.25)
    ros.advance(1.0)
    assert [m.data for m in ros.messages("/greeting")] == ["Hello world!"] * 4 + ["Hello you!"] * 4
    with pytest.raises(ParameterRejected, match=r"/greeter: period = -1\.0 was not accepted: a period is above 0"):
        ros.set_parameter("/greeter", "period", -1.0)
    with pytest.raises(ParameterRejected):
        ros.set_parameter("/greeter", "nmae", "you")
    with pytest.raises(StepTimeout):
        ros.set_parameter("/greter", "name", "you", timeout=1.0)


def load_corridor() -> type[Simulation]:
    """Load the simulation of an example."""
    spec = importlib.util.spec_from_file_location("corridor", ROOT / "examples/obstacle_stop/corridor.py")
    assert spec is not None
    assert spec.loader is not None
    module = sys.modules["corridor"] = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    found: type[Simulation] = module.Corridor
    return found


def test_a_simulated_robot_drives_by_what_a_node_says(ros: World) -> None:
    """Its state is in the test's process: the robot stops half a metre before the wall, and goes on when it opens."""
    ros.run(ROOT / "examples/obstacle_stop/reference/obstacle_stop.py")
    robot = ros.simulate(load_corridor()(wall=2.0, opens=20_000_000_000))  # type: ignore[call-arg]
    ros.advance(15.0)
    assert robot.x == pytest.approx(1.5, abs=0.2)  # type: ignore[attr-defined]
    ros.wait_until(lambda: robot.x > 2.5, timeout=20.0)  # type: ignore[attr-defined]
    assert ros.now > 20.0


@dataclass
class Door(Simulation):
    """Offers /allowed, and counts how often it is asked."""

    opened: int = 0

    def serves(self) -> dict[str, str]:
        """Return its service."""
        return {"/allowed": "std_srvs/srv/Trigger"}

    def on_request(self, now: Moment, service: str, request: object) -> dict[str, object]:
        """Agree."""
        self.opened += 1
        return {"success": True, "message": f"{service} at {now.t_s:g} s"}


@dataclass
class Broken(Simulation):
    """Fails in its third step."""

    steps: int = 0

    def step(self, now: Moment) -> list[Output]:
        """Count."""
        self.steps += 1
        if self.steps == 3:
            raise RuntimeError("third step")
        return []


def test_a_simulation_may_offer_services_and_fail(ros: World) -> None:
    """What it raises is raised where time passes; a built-in one has a name."""
    ros.run("nodes/switch.py")
    door = ros.simulate(Door())
    assert ros.call("/enable", SetBool.Request(data=True)).message == "/allowed at 0 s"
    assert door.opened == 1  # type: ignore[attr-defined]
    ros.simulate(Broken())
    with pytest.raises(RuntimeError, match="third step"):
        ros.advance(1.0)


LAUNCH = """\
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([Node(package='{}', executable='talker')])
"""


@pytest.fixture
def workspace(tmp_path: Path) -> Path:
    """A copy of a workspace with a package, and a folder of tests in it."""
    root = tmp_path / "workspace"
    shutil.copytree(TESTS / "packages/workspace", root)
    (root / "src/robot/test").mkdir()
    return root / "src/robot/test"


def test_an_executable_of_the_package_beside_a_test(ros_session: Worlds, workspace: Path) -> None:
    """Named as for `ros2 run`; a slip is answered with the name that was meant."""
    with ros_session.open(workspace) as ros:
        ros.run("robot/talker", parameters={"rate": 10.0})
        listener = ros.run("robot/listener")
        ros.advance(1.0)
        assert ros.rate("/chatter") == pytest.approx(10)
        assert [program.name for program in ros.programs] == ["robot/talker", "robot/listener"]
        assert len(listener.logs) == len(ros.messages("/chatter"))
        with pytest.raises(SubmissionError) as wrong:
            ros.run("robot/taker")
        assert "did you mean robot/talker?" in wrong.value.hint


def test_a_launch_file_starts_its_nodes(ros_session: Worlds, workspace: Path) -> None:
    """With its arguments, names, namespaces and remappings, twice if need be."""
    with ros_session.open(workspace) as ros:
        launched = ros.launch("../launch/robot.launch.py", arguments={"rate": 5.0})
        ros.advance(2.0)
        assert [program.name for program in launched.programs] == ["robot/talker", "robot/listener"]
        assert ros.nodes() == ["/ears/listener", "/speaker"]
        assert ros.rate("/talk") == pytest.approx(5)
        again = ros.launch("robot/listener.launch.py")
        assert [program.name for program in again.programs] == ["robot/listener (2)"]
        with pytest.raises(SubmissionError) as wrong:
            ros.launch("robot/listner.launch.py")
        assert wrong.value.hint == "did you mean robot/listener.launch.py?"
        with pytest.raises(SubmissionError) as wrong:
            ros.launch("robto/listener.launch.py")
        assert wrong.value.hint == "did you mean robot/listener.launch.py?"


def test_a_launch_file_in_xml_is_found_by_its_package(ros_session: Worlds, workspace: Path) -> None:
    """As `ros2 launch` finds it, whatever language it is written in."""
    written = '<launch><node pkg="robot" exec="talker" name="speaker"/></launch>'
    (workspace.parent / "launch/talker.launch.xml").write_text(written, encoding="utf-8")
    setup = workspace.parent / "setup.py"
    setup.write_text(setup.read_text(encoding="utf-8").replace("*.launch.py", "*.launch.*"), encoding="utf-8")
    with ros_session.open(workspace) as ros:
        ros.launch("robot/talker.launch.xml")
        ros.advance(1.0)
        assert ros.nodes() == ["/speaker"]


def test_a_launch_file_beside_its_packages_finds_them(ros_session: Worlds, workspace: Path) -> None:
    """It lies at the top of the workspace, in no package; the test lies in one."""
    top = workspace.parents[2]
    (top / "all.launch.py").write_text(LAUNCH.format("robot"), encoding="utf-8")
    with ros_session.open(workspace) as ros:
        launched = ros.launch("../../../all.launch.py")
        assert [program.name for program in launched.programs] == ["robot/talker"]


def test_a_launch_file_does_not_find_what_colcon_leaves_out(ros_session: Worlds, workspace: Path) -> None:
    """It ends as in ROS, although another package has an executable of that name."""
    manifest = (workspace.parent / "package.xml").read_text(encoding="utf-8")
    for name in ("other", "third"):
        other = Path(shutil.copytree(workspace.parent, workspace.parents[1] / name))
        (other / "package.xml").write_text(manifest.replace("<name>robot<", f"<name>{name}<"), encoding="utf-8")
    (workspace.parents[1] / "other/COLCON_IGNORE").touch()
    (workspace / "ignored.launch.py").write_text(LAUNCH.format("other"), encoding="utf-8")
    (workspace / "lacking.launch.py").write_text(LAUNCH.format("elsewhere"), encoding="utf-8")
    with ros_session.open(workspace) as ros:
        told = r"ignored\.launch\.py:6: PackageNotFoundError: package .other. not found: .* other/COLCON_IGNORE"
        with pytest.raises(HarnessError, match=told):
            ros.launch("ignored.launch.py")
        told = r"elsewhere/talker was not started: the workspace has no package elsewhere"
        with pytest.raises(HarnessError, match=told):
            ros.launch("lacking.launch.py")


def test_a_launch_file_that_fails_is_told_with_its_line(ros_session: Worlds, tmp_path: Path) -> None:
    """So is one that starts nothing; the world goes on."""
    (tmp_path / "bad.launch.py").write_text("def generate_launch_description():\n    return missing\n")
    (tmp_path / "node.py").write_text("print('here')\n")
    with ros_session.open(tmp_path) as ros:
        with pytest.raises(HarnessError, match=r"bad\.launch\.py:2: NameError: name 'missing' is not defined"):
            ros.launch("bad.launch.py")
        with pytest.raises(SubmissionError, match="expected a launch file"):
            ros.launch("node.py")
        assert ros.run("node.py").output == "here\n"


def test_a_library_of_another_package_is_imported_from_its_sources(ros_session: Worlds, workspace: Path) -> None:
    """As after a build, so that no package of Python in a workspace has to be built for a test."""
    library = workspace.parents[1] / "speech"
    (library / "speech").mkdir(parents=True)
    manifest = (workspace.parent / "package.xml").read_text(encoding="utf-8")
    (library / "package.xml").write_text(manifest.replace("<name>robot<", "<name>speech<"), encoding="utf-8")
    (library / "setup.py").write_text("from setuptools import setup\nsetup(name='speech', packages=['speech'])\n")
    (library / "speech/__init__.py").write_text("")
    (library / "speech/words.py").write_text("def word(count):\n    return f'spoken {count}'\n")
    nodes = workspace.parent / "robot/nodes.py"
    written = nodes.read_text(encoding="utf-8")
    nodes.write_text(written.replace("from robot.words", "from speech.words"), encoding="utf-8")
    with ros_session.open(workspace) as ros:
        ros.run("robot/talker")
        ros.advance(1.0)
        assert ros.messages("/chatter")[-1].data == "none spoken 1"
    assert ros.remarks == []


def test_a_path_among_the_arguments_of_a_launch_file(
    ros_session: Worlds, workspace: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is relative to the working directory, as with `ros2 launch`."""
    (workspace / "own.launch.py").write_text(
        """
from launch import LaunchDescription
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node


def generate_launch_description():
    return LaunchDescription([Node(package="robot", executable="talker", parameters=[LaunchConfiguration("own")])])
""",
        encoding="utf-8",
    )
    (workspace.parent / "config/own.yaml").write_text("/**:\n  ros__parameters:\n    prefix: own\n", encoding="utf-8")
    monkeypatch.chdir(workspace.parent)
    with ros_session.open(workspace) as ros:
        ros.launch("own.launch.py", arguments={"own": "config/own.yaml"})
        ros.advance(1.0)
        assert ros.messages("/chatter")[-1].data.startswith("own ")
