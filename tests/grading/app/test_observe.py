"""Looking at nodes without a rubric: the summary of a trace, its text and its JSON, and one real run."""

import json
import subprocess
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, cast

import jsonschema
import pytest
from places import GRADE, REPORTED, ROOT, TESTS
from tiers import each, more

from grader.grading.app import observe as observing
from grader.grading.app.inputs import read_simulations
from grader.grading.app.observe import ObserveRequest, observe_programs
from grader.grading.app.programs import find_targets, stage
from grader.grading.judging.summary import summarise
from grader.grading.model.report import Summary
from grader.grading.reporting.observed import render_summary, summary_to_json, without_libraries
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.limits import MAX_FILE_BYTES
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    Offer,
    OutputLine,
    ServiceEnd,
)
from grader.runtime.sandbox.bubblewrap import ROOT_NAME, USER_NAME
from grader.runtime.session import Job

SCHEMA = json.loads((ROOT / "grader/grading/reporting/observation.schema.json").read_text(encoding="utf-8"))

FLOAT = "std_msgs/msg/Float32"


def quiet(title: str) -> None:
    """Tell nobody what is done now."""


def an_end(kind: str, topic: str = "/t", node: str = "/a") -> Endpoint:
    return Endpoint(kind, topic, FLOAT, node, 0, "reliable", "volatile")


def a_trace(*observations: Observation, stop_s: int = 10) -> AssessedTrace:
    return AssessedTrace("observed", ClockKind.VIRTUAL, stop_s * NS_PER_S, tuple(observations))


SERVED = (("client", "/a"), ("service", "/b"))


def messages(count: int, period_ms: int = 100, value: Callable[[int], object] = float) -> list[Message]:
    return [Message(n * period_ms * NS_PER_MS, "/t", FLOAT, {"data": value(n)}) for n in range(count)]


def test_a_topic_is_described_by_its_pace_and_its_values() -> None:
    """There are n - 1 gaps between n messages; numbers go by their dotted names, NaN is left out."""
    odd = Message(NS_PER_S, "/t", FLOAT, {"data": float("nan"), "deep": {"x": 1, "flag": True, "list": [5]}})
    graph = GraphSnapshot(0, ("/a",), (an_end("publisher"),))
    (topic,) = summarise(a_trace(graph, *messages(10), odd), ["a.py"], "none").topics
    assert topic.pace is not None
    assert (topic.messages, topic.first_s, topic.pace.rate_hz) == (11, 0.0, pytest.approx(10.0))
    assert (topic.pace.min_s, topic.pace.max_s) == (pytest.approx(0.1), pytest.approx(0.1))
    assert topic.ranges == {"data": (0.0, 9.0), "deep.x": (1.0, 1.0), "deep.list[]": (5.0, 5.0)}
    assert topic.lengths == {"deep.list": (1, 1)}


def test_texts_and_arrays_are_described() -> None:
    """A text by its first different values, an array by its size and its elements; what is empty comes last."""
    said = [
        Message(
            n * NS_PER_S, "/t", FLOAT, {"none": [], "words": f"w{n}", "ids": ["l", "r"], "zero": 0, "xs": [n] * (1 + n)}
        )
        for n in range(5)
    ]
    graph = GraphSnapshot(0, ("/a",), (an_end("publisher"),))
    text = render_summary(summarise(a_trace(graph, *said), ["a.py"], "none"))
    assert [line.strip() for line in text.splitlines() if line.startswith("    ")][2:] == [
        'words: "w0", "w1", "w2" and 2 more',
        'ids[]: "l", "r"',
        "ids: 2 elements",
        "xs: 1 to 5 elements, 0 to 4",
        "none: 0 elements",
        "zero: 0",
    ]
    whole = json.loads(summary_to_json(summarise(a_trace(graph, *said), ["a.py"], "none")))
    jsonschema.validate(whole, SCHEMA)
    told = whole["topics"][0]
    assert told["texts"]["words"] == {"values": ["w0", "w1", "w2", "w3", "w4"], "different": 5}
    assert told["lengths"]["xs"] == [1, 5]


def test_booleans_are_described() -> None:
    """By their different values, in order of appearance, also those of arrays; JSON has them, too."""
    said = [
        Message(n * NS_PER_S, "/t", FLOAT, {"data": n > 1, "on": True, "deep": {"off": False}, "all": [False, n > 2]})
        for n in range(4)
    ]
    summary = summarise(a_trace(GraphSnapshot(0, ("/a",), (an_end("publisher"),)), *said), ["a.py"], "none")
    text = render_summary(summary)
    assert [line.strip() for line in text.splitlines() if line.startswith("    ")][2:] == [
        "data: false, true",
        "on: true",
        "deep.off: false",
        "all: 2 elements, false, true",
    ]
    (told,) = json.loads(summary_to_json(summary))["topics"]
    assert told["flags"] == {"data": [False, True], "on": [True], "deep.off": [False], "all[]": [False, True]}


def test_what_nobody_offers_is_named() -> None:
    """A service by its name, an action by its own; not what a node, a simulation or any node of the name offers."""
    ends = [
        ServiceEnd("client", "/fibonacci/_action/send_goal", "t/action/F_SendGoal", "/a"),
        ServiceEnd("client", "/fibonacci/_action/get_result", "t/action/F_GetResult", "/a"),
        ServiceEnd("client", "/lonely", "std_srvs/srv/Trigger", "/a"),
        ServiceEnd("client", "/met", "std_srvs/srv/Trigger", "/a"),
        ServiceEnd("service", "/met", "std_srvs/srv/Trigger", "/b"),
        ServiceEnd("client", "/simulated", "std_srvs/srv/Trigger", "/a"),
        ServiceEnd("client", "/b/get_parameters", "rcl_interfaces/srv/GetParameters", "/a"),
        ServiceEnd("client", "/c/get_parameters", "rcl_interfaces/srv/GetParameters", "/a"),
    ]
    trace = a_trace(GraphSnapshot(0, ("/a", "/b"), (), tuple(ends)))
    notes = summarise(trace, ["a.py"], "none", {}, ["/simulated"]).notes
    assert [note for note in notes if "nobody offers" in note] == [
        "/a waits for the action /fibonacci, which nobody offers",
        "/a waits for the service /lonely, which nobody offers",
        "/a waits for the service /c/get_parameters, which nobody offers",
    ]


def test_whole_numbers_are_shown_in_full() -> None:
    """The seconds of a stamp differ in their last digits."""
    graph = GraphSnapshot(0, ("/a",), (an_end("publisher"),))
    text = render_summary(summarise(a_trace(graph, *messages(3, value=lambda n: 1767225600 + n)), ["a.py"], "none"))
    assert "data: 1767225600 to 1767225602\n" in text


def test_the_graph_with_the_most_parts_is_drawn() -> None:
    """Services count as well, and of equal ones the last."""
    ends = tuple(ServiceEnd(kind, "/go", "std_srvs/srv/Trigger", node) for kind, node in SERVED)
    graphs = (GraphSnapshot(0, (), ()), GraphSnapshot(1, ("/a", "/b"), (), ends), GraphSnapshot(2, (), ()))
    assert "Graph:\n  /a ┄┄/go┄┄▶ /b\n" in render_summary(summarise(a_trace(*graphs), ["a.py"], "none"))


@pytest.mark.parametrize("count", [0, 1])
def test_too_few_messages_have_no_pace(count: int) -> None:
    """No division by nothing; also not for messages of one instant."""
    graph = GraphSnapshot(0, ("/a",), (an_end("publisher"),))
    (topic,) = summarise(a_trace(graph, *messages(count)), ["a.py"], "none").topics
    assert (topic.pace, topic.messages) == (None, count)
    (topic,) = summarise(a_trace(graph, *messages(5, period_ms=0)), ["a.py"], "none").topics
    assert topic.pace is None


def test_the_text_says_what_was_seen() -> None:
    """Nodes, topics, who is at which end, services and parameters, records; long lists are cut and counted."""
    ends = (an_end("publisher"), an_end("subscription", node="/b"))
    records = [LogRecord(n, "a.py", "INFO", "a", f"line {n}") for n in range(20)]
    offers = [Offer(0, "a.py", "service", "/go", "std_srvs/srv/Trigger"), Offer(0, "a.py", "parameter", "/a:x", "1.5")]
    trace = a_trace(GraphSnapshot(0, ("/a", "/b"), ends), *offers, *messages(3), *records)
    text = render_summary(summarise(trace, ["a.py"], "none"))
    for line in (
        "a.py: 10.0 s on the virtual clock",
        "published by /a (reliable, volatile)",
        "subscribed by /b (reliable, volatile)",
        "3 messages, the first at t = 0.000 s; average rate: 10.000 Hz",
        "data: 0 to 2",
        "service /go [std_srvs/srv/Trigger]",
        "parameter /a:x = 1.5",
        "/a ──/t──▶ /b",
        "[INFO] [a]: line 0",
        "and 8 more (--json shows them)",
    ):
        assert line in text


def test_a_program_that_ends_in_peace_has_no_fault() -> None:
    """A client that is done ends with exit code 0; any other end is a fault."""
    done = Fault(NS_PER_S, "client.py", FaultKind.EXITED, "exited with code 0", exit_code=0)
    text = render_summary(summarise(a_trace(done), ["client.py"], "none"))
    assert "Ended:\n  t = 1.000 s client.py: exited with code 0\n" in text
    assert "Faults" not in text
    failed = replace(done, text="exited with code 3", exit_code=3)
    text = render_summary(summarise(a_trace(done, failed), ["client.py"], "none"))
    assert "Faults:\n  t = 1.000 s client.py: exited with code 3\n" in text


def test_hostile_text_stays_text() -> None:
    """Nothing a node says can steer the terminal, and the JSON stays valid UTF-8."""
    record = LogRecord(0, "a.py", "INFO", "a", "\x1b[2J\u202e\udcff")
    summary = summarise(a_trace(record), ["a.py"], "none")
    assert not set("\x1b\u202e\udcff") & set(render_summary(summary))
    told = json.loads(summary_to_json(summary).encode())
    assert told["records"][0]["severity"] == "INFO"
    jsonschema.validate(told, SCHEMA)


def test_what_is_printed_for_programs_follows_its_schema() -> None:
    """With faults, hints, offers and output; and a key that the schema lacks would be found."""
    failed = Fault(NS_PER_S, "client.py", FaultKind.EXITED, "exited with code 3", exit_code=3)
    found = (failed, Offer(0, "a.py", "parameter", "/a:rate", "1.0"), OutputLine(0, "a.py", "stdout", "text"))
    told = json.loads(summary_to_json(summarise(a_trace(*found), ["a.py"], "none")))
    jsonschema.validate(told, SCHEMA)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate({**told, "extra": 1}, SCHEMA)


@pytest.mark.ros
def test_nodes_are_observed_for_real() -> None:
    """Both reference nodes of exercise 3 run together; what they do comes out as JSON and as text."""
    files = [str(ROOT / "reference_solutions" / name) for name in ("temperature_sensor.py", "fan_controller.py")]
    command = [GRADE, "observe", *files, "--duration", "5"]
    told = json.loads(subprocess.run([*command, "--json"], check=True, capture_output=True).stdout)
    assert told["nodes"] == ["/fan_controller", "/temperature_sensor"]
    assert [(t["name"], round(t["rate_hz"], 6)) for t in told["topics"]] == [("/fan_speed", 5.0), ("/temperature", 5.0)]
    assert told["faults"] == []
    text = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    assert "/temperature_sensor ──/temperature──▶ /fan_controller" in text


@pytest.mark.long
@pytest.mark.ros
def test_a_file_of_a_package_may_import_the_package(tmp_path: Path) -> None:
    """As `ros2 run` lets it: by the name of the package, from wherever in it the file is."""
    inner = tmp_path / "ws" / "src" / "two" / "two"
    inner.mkdir(parents=True)
    (inner.parent / "package.xml").write_text("<package><name>two</name></package>")
    (inner / "__init__.py").touch()
    (inner / "words.py").write_text("TEXT = 'from the package'\n")
    node = inner / "speaker.py"
    node.write_text(
        "import rclpy\nfrom two.words import TEXT\n\n\ndef main():\n"
        "    rclpy.init()\n    node = rclpy.create_node('speaker')\n    node.get_logger().info(TEXT)\n"
        "    rclpy.spin(node)\n\n\nif __name__ == '__main__':\n    main()\n"
    )
    summary = observe_programs(ObserveRequest((node,), NS_PER_S, clock="virtual"), lambda _: None)
    assert ([r.text for r in summary.records], summary.faults) == (["from the package"], ())


@pytest.mark.ros
def test_a_traceback_begins_with_the_program(tmp_path: Path) -> None:
    """As `python3 FILE` prints it, also where a module of the program fails while it is imported."""
    file = tmp_path / "node.py"
    for text, first in (("import rclpy\n1 / 0\n", "node.py"), ("import rclpy\nimport other\n", "node.py")):
        file.write_text(text)
        (tmp_path / "other.py").write_text("{}['x']\n")
        lines = [
            o.text for o in observe_programs(ObserveRequest((file,), NS_PER_S, clock="virtual"), lambda _: None).lines
        ]
        assert lines[:2] == ["Traceback (most recent call last):", f'  File "{first}", line 2, in <module>']
        assert not any("grader" in line for line in lines)


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
def test_a_class_that_needs_arguments_is_not_started(tmp_path: Path, clock: str) -> None:
    """It is for other modules: `python3 FILE` does nothing, and nothing is the student's fault."""
    file = tmp_path / "relay.py"
    file.write_text(
        "from rclpy.node import Node\nclass Relay(Node):\n"
        "    def __init__(self, robot):\n        super().__init__(f'relay_{robot}')\n"
    )
    summary = observe_programs(ObserveRequest((file,), NS_PER_S, clock=clock), lambda _: None)
    assert [fault.text for fault in summary.faults] == ["exited with code 0"]
    assert [note.split(",")[0] for note in summary.notes] == ["relay.py: nothing starts Relay"]


def a_package(folder: Path, name: str, **files: str) -> None:
    """Write a Python package with an entry point for each module; a name may have `__` for a folder."""
    scripts = ", ".join(f"'{n.replace('__', '_')} = {name}.{n.replace('__', '.')}:main'" for n in files)
    inner = folder / name / name
    inner.mkdir(parents=True)
    (inner.parent / "package.xml").write_text(f"<package><name>{name}</name></package>")
    (inner.parent / "setup.py").write_text(
        f"from setuptools import setup\nsetup(name='{name}', entry_points={{'console_scripts': [{scripts}]}})\n"
    )
    for module, text in files.items():
        path = inner / f"{module.replace('__', '/')}.py"
        path.parent.mkdir(exist_ok=True)
        (path.parent / "__init__.py").touch()
        (inner / "__init__.py").touch()
        path.write_text(text)


LOGS = "import rclpy\n{}\ndef main():\n    rclpy.init()\n    rclpy.create_node('n').get_logger().info({})\n"


@pytest.mark.breadth(1, 3)
@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize("above", each(["src/repository", "src", "anything"], 3))
@pytest.mark.parametrize("target", each(["two/two/speaker.py", "two/speaker", "two/launch/all.launch.py"], 3))
def test_the_packages_beside_one_are_there(tmp_path: Path, above: str, target: str) -> None:
    """As in a workspace that is built, whatever its folder is called and whatever is named."""
    a_package(tmp_path / above, "one", words="TEXT = 'from the other package'\n")
    a_package(tmp_path / above, "two", speaker=LOGS.format("from one.words import TEXT", "TEXT"))
    launch = tmp_path / above / "two" / "launch" / "all.launch.py"
    launch.parent.mkdir()
    launch.write_text(
        "from launch import LaunchDescription\nfrom launch_ros.actions import Node\n"
        "def generate_launch_description():\n"
        "    return LaunchDescription([Node(package='two', executable='speaker')])\n"
    )
    summary = observe_programs(ObserveRequest((tmp_path / above / target,), NS_PER_S, clock="virtual"), lambda _: None)
    assert [r.text for r in summary.records] == ["from the other package"]


def test_a_module_is_staged_with_the_folder_of_its_package(tmp_path: Path) -> None:
    """A Python package without package.xml: what is told names the folder, and modules above are found."""
    for folder in ("talk", "talk/core"):
        (tmp_path / "more" / folder).mkdir(parents=True)
        (tmp_path / "more" / folder / "__init__.py").touch()
    file = tmp_path / "more" / "talk" / "core" / "say.py"
    file.write_text("from ..words import WORD\n")
    (tmp_path / "more" / "talk" / "words.py").write_text("WORD = 1\n")
    (tmp_path / "more" / "beside.py").touch()
    submission = stage(find_targets((file,)).targets, tmp_path)
    assert submission.files["say.py"].found == "talk/core/say.py"
    names = {path.relative_to(submission.root).as_posix() for path in Path(submission.root).rglob("*.py")}
    assert names == {"talk/__init__.py", "talk/words.py", "talk/core/__init__.py", "talk/core/say.py"}


@pytest.mark.ros
def test_an_import_from_above_a_package_is_told_with_its_folder(tmp_path: Path) -> None:
    """Of a file `__init__.py` there are many."""
    (tmp_path / "talk").mkdir()
    (tmp_path / "talk" / "__init__.py").write_text("from ..words import WORD\n")
    (tmp_path / "talk" / "say.py").touch()
    (fault,) = observe_programs(
        ObserveRequest((tmp_path / "talk" / "say.py",), NS_PER_S, clock="virtual"), quiet
    ).faults
    assert (fault.file, fault.line) == ("talk/__init__.py", 1)
    assert fault.text.startswith("ImportError: attempted relative import beyond top-level package")


HIDES = """import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32
from std_srvs.srv import Trigger

class Battery(Node):
    def __init__(self):
        super().__init__("battery")
        self.declare_parameter("charge", 85.0)
        self.out = self.create_publisher(Float32, "charge", 10)
        self.heard = self.create_subscription(Float32, "charge", self.hear, 10)
        self.served = self.create_service(Trigger, "ask", self.tell)
        self.out.publish(Float32(data=self.get_parameter("charge").value))
        self._parameters, self._publishers = ["mine"], {"mine": 1}

    def hear(self, msg):
        self.get_logger().info(f"heard {msg.data}")

    def tell(self, request, response):
        return response

    def context(self): return "mine"
    publishers = get_name = get_namespace = get_fully_qualified_name = context

if __name__ == "__main__":
    rclpy.init()
    rclpy.spin(Battery())
"""


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", "wall"])
def test_a_class_may_hide_what_rclpy_does_not_need(tmp_path: Path, clock: str) -> None:
    """It works in plain Python, so the host must not need the hidden names either."""
    (tmp_path / "battery.py").write_text(HIDES)
    summary = observe_programs(ObserveRequest((tmp_path / "battery.py",), NS_PER_S, clock=clock), quiet)
    assert (summary.faults, [r.text for r in summary.records]) == ((), ["heard 85.0"])
    assert summary.nodes == ("/battery",)


LOOKS = """import os, sys
import rclpy
from rclpy.utilities import remove_ros_args
def main():
    rclpy.init()
    node = rclpy.create_node("looks")
    words = node.declare_parameter("words", "").value
    for place in (*remove_ros_args(sys.argv)[1:], words):
        node.get_logger().info(str(os.path.exists(place)))
    with open(os.path.join(sys.argv[1], "..", "..", "log.csv"), "w") as file:
        node.get_logger().info(f"wrote {file.write('one')} beside")
"""
FINDS = """import os
from ament_index_python.packages import get_package_prefix, get_package_share_directory
from launch import LaunchDescription
from launch.substitutions import PathJoinSubstitution
from launch_ros.actions import Node
from launch_ros.substitutions import FindPackagePrefix, FindPackageShare

def generate_launch_description():
    share = get_package_share_directory("finds")
    return LaunchDescription([Node(package="finds", executable="looks", arguments=[
        get_package_prefix("finds"),
        os.path.join(get_package_prefix("finds"), "..", ".."),
        PathJoinSubstitution([FindPackagePrefix("finds"), "share", "finds"]),
        PathJoinSubstitution([FindPackageShare("finds"), "package.xml"]),
        os.path.join(share, "nothing"),
    ], parameters=[{"words": os.path.join(share, "package.xml")}])])
"""


@pytest.mark.ros
def test_a_node_finds_the_folders_that_its_launch_file_has_found(tmp_path: Path) -> None:
    """They are given to it as arguments and parameters; the workspace above them can be written to, as after colcon."""
    a_package(tmp_path, "finds", looks=LOOKS)
    setup = tmp_path / "finds" / "setup.py"
    setup.write_text(setup.read_text().replace("setup(", 'setup(data_files=[("share/finds", ["package.xml"])], ', 1))
    (tmp_path / "finds" / "finds.launch.py").write_text(FINDS)
    summary = observe_programs(
        ObserveRequest((tmp_path / "finds" / "finds.launch.py",), NS_PER_S, clock="virtual"), quiet
    )
    if summary.isolation not in (ROOT_NAME, USER_NAME):
        pytest.skip("processes have no view of files of their own here")
    assert [r.text for r in summary.records] == [*["True"] * 4, "False", "True", "wrote 3 beside"]


SAYS = """import rclpy
from talk_interfaces.msg import Say

def main():
    rclpy.init()
    node = rclpy.create_node("talker")
    out = node.create_publisher(Say, "say", 10)
    node.create_timer(0.5, lambda: out.publish(Say(text="hi")))
    rclpy.spin(node)
"""


def an_interface_package(folder: Path) -> None:
    (folder / "msg").mkdir(parents=True)
    (folder / "msg" / "Say.msg").write_text("string text\n")
    (folder / "package.xml").write_text(
        f"<package><name>{folder.name}</name><member_of_group>rosidl_interface_packages</member_of_group></package>"
    )
    (folder / "CMakeLists.txt").write_text('rosidl_generate_interfaces(${PROJECT_NAME} "msg/Say.msg")\n')


@pytest.mark.breadth(0, 2)
@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize(
    ("package", "beside"), [("src", "src"), ("PYTHON", "CPP"), ("src/repository/packages", "src/repository/packages")]
)
@pytest.mark.parametrize("heavy", [False, True])
def test_a_message_package_is_found_wherever_it_lies(tmp_path: Path, package: str, beside: str, heavy: bool) -> None:
    """Also in a workspace that is too large to be copied, of which only what is needed is taken."""
    a_package(tmp_path / package, "talk_py", talker=SAYS)
    an_interface_package(tmp_path / beside / "talk_interfaces")
    if heavy:
        a_package(tmp_path / package, "meshes")
        for number in range(8):
            with (tmp_path / package / "meshes" / f"{number}.stl").open("wb") as mesh:
                mesh.truncate(MAX_FILE_BYTES - 1)
    summary = observe_programs(
        ObserveRequest((tmp_path / package / "talk_py" / "talker",), NS_PER_S, clock="virtual"), quiet
    )
    assert summary.faults == ()
    assert [topic.texts["text"][0] for topic in summary.topics] == [("hi",)]
    taken = "the workspace is too large to be copied: taken are the packages talk_interfaces, talk_py"
    assert (taken in summary.notes) is heavy


@pytest.mark.ros
@pytest.mark.parametrize(("named", "ignored"), [("src/talk_py/talker", "talk_interfaces"), ("", "src/talk_interfaces")])
def test_a_package_that_colcon_ignores_is_named(tmp_path: Path, named: str, ignored: str) -> None:
    """With the file that is the reason, and no package of another name."""
    a_package(tmp_path / "src", "talk_py", talker=SAYS)
    for name in ("talk_interfaces", "unused_interfaces"):
        an_interface_package(tmp_path / "src" / name)
        (tmp_path / "src" / name / "COLCON_IGNORE").touch()
    summary = observe_programs(ObserveRequest((tmp_path / named,), NS_PER_S, clock="virtual"), quiet)
    said = f"the package talk_interfaces was left out, as colcon does: there is a file {ignored}/COLCON_IGNORE"
    assert [note for note in summary.notes if "COLCON_IGNORE" in note] == [said]
    assert not any("rcl_interfaces" in hint for hint in summary.hints)


WAITS = """import rclpy
from std_srvs.srv import Trigger
rclpy.init()
node = rclpy.create_node("waiter", namespace="ns")
node.declare_parameter("speed", 1.5)
node.create_service(Trigger, "/reset", lambda request, response: response)
client = node.create_client(Trigger, "/nobody")
rclpy.spin(node)
"""


@pytest.mark.long
@pytest.mark.ros
def test_both_clocks_show_services_clients_and_parameters(tmp_path: Path) -> None:
    """The same ones."""
    (tmp_path / "waits.py").write_text(WAITS)
    requests = [ObserveRequest((tmp_path / "waits.py",), 2 * NS_PER_S, clock=clock) for clock in ("virtual", "wall")]
    virtual, wall = ({(o.kind, o.name, o.detail) for o in observe_programs(one, quiet).offers} for one in requests)
    assert (
        virtual
        == wall
        == {
            ("service", "/reset", "std_srvs/srv/Trigger"),
            ("client", "/nobody", "std_srvs/srv/Trigger"),
            ("parameter", "/ns/waiter:speed", "1.5"),
        }
    )


NEEDS = """from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

def generate_launch_description():
    node = Node(package="student", executable="waits", name=LaunchConfiguration("kind"))
    return LaunchDescription([DeclareLaunchArgument("kind"), node])
"""


@pytest.mark.long
@pytest.mark.ros
def test_a_built_in_simulation_brings_its_types(tmp_path: Path) -> None:
    """Although no program names the package turtlesim."""
    (tmp_path / "waits.py").write_text(WAITS.replace("/nobody", "/clear"))
    simulations = read_simulations(["turtle"])
    request = ObserveRequest((tmp_path / "waits.py",), NS_PER_S, clock="virtual", simulations=simulations)
    assert observe_programs(request, quiet).nodes == ("/ns/waiter",)


class Recorder:
    """A session that records in virtual time alone."""

    def __init__(self, problem: str) -> None:
        self.problem, self.clocks = problem, list[str]()

    def record(self, jobs: Mapping[str, Job], clock: str, progress: object) -> dict[str, AssessedTrace]:
        """Return a trace for each job."""
        self.clocks.append(clock)
        return {key: replace(a_trace(), harness_problem=self.problem, clock_reason="it works") for key in jobs}


@pytest.mark.parametrize("problem", ["", "no worker can be started"])
def test_where_the_machine_is_too_busy_for_the_wall_clock_virtual_time_is_shown(problem: str) -> None:
    """With the reason, and what it may hide; nothing is judged by a summary."""
    session, scenario = Recorder(problem), Scenario("observed", ("a.py",), Span(NS_PER_S))
    held_up = replace(a_trace(), clock=ClockKind.WALL, clock_reason="a.py: it works", harness_problem="too busy")
    job = Job("observing", cast("Any", None))
    found = observing._in_virtual_time(cast("Any", session), scenario, job, held_up, quiet)
    assert session.clocks == ["virtual"]
    assert found == held_up if problem else found.clock is ClockKind.VIRTUAL
    assert problem or found.notes == (f"{observing._TOO_BUSY} clock: a.py: it works",)
    assert problem or not found.clock_reason  # it is in the note


def test_a_reason_for_another_clock_is_not_told_as_the_reason_for_virtual_time() -> None:
    """Where virtual time was asked for, the text says what it does not suit."""
    told = []
    for clock in ClockKind:
        trace = replace(a_trace(), clock=clock, clock_reason="a.py: it waits")
        told.append(render_summary(summarise(trace, ["a.py"], "none")).splitlines()[1])
    assert told == [
        "  note: virtual time does not suit what was observed: a.py: it waits",
        "  note: recorded on the wall clock: a.py: it waits",
    ]


ACTION = """class Count(Node):
    def execute(self, goal_handle):
        self.get_logger.info('counting')
"""
#: What rclpy prints of that.
PRINTED = """Traceback (most recent call last):
  File "/usr/lib/python3/rclpy/action/server.py", line 337, in _execute_goal
    execute_result = await await_or_execute(execute_callback, goal_handle)
  File "count.py", line 3, in execute
    self.get_logger.info('counting')
AttributeError: 'function' object has no attribute 'info'"""


def in_action(text: str, at_s: int = 1) -> LogRecord:
    """What rclpy logs of an action of count.py."""
    return LogRecord(at_s * NS_PER_S, "count.py", "ERROR", "count.action_server", text)


def test_a_note_is_told_once() -> None:
    """A launch file leaves out the same in one place several times, as in a loop."""
    trace = replace(a_trace(), notes=("left out", "held up", "left out"))
    assert summarise(trace, ["a.py"], "none").notes == ("left out", "held up")


def test_an_exception_in_an_action_is_told_with_what_to_do() -> None:
    """It ends no program: rclpy logs and prints it, as often as there are goals."""
    said = "Error raised in execute callback: 'function' object has no attribute 'info'"
    goal = "Goal state not set, assuming aborted. Goal ID: [1]"
    lines = [OutputLine(NS_PER_S, "count.py", "stderr", text) for text in PRINTED.split("\n")]
    summary = summarise(
        a_trace(in_action(said), *lines, in_action(goal), in_action(said, 2), *lines, in_action(goal, 2)),
        ["count.py"],
        "none",
        {"count.py": ACTION},
    )
    assert [(fault.text, fault.file, fault.line) for fault in summary.faults] == [
        (PRINTED.rsplit("\n", maxsplit=1)[-1], "count.py", 3)
    ]
    assert summary.hints == ("get_logger is a method, call it: self.get_logger().info(...)",)
    assert not [note for note in summary.notes if "succeed" in note]


def test_a_goal_without_a_state_is_told() -> None:
    """Only rclpy's warning tells it, and names no method."""
    goal = in_action("Goal state not set, assuming aborted. Goal ID: [1]")
    (note,) = summarise(a_trace(goal), ["count.py"], "none").notes
    assert note == "count.py: an action ends without goal_handle.succeed(), so its goal counts as aborted"
    other = replace(goal, logger="count")
    assert summarise(a_trace(other), ["count.py"], "none").notes == ()


def test_what_only_looks_like_an_exception_in_an_action_is_none() -> None:
    """Nothing is guessed without the traceback."""
    said = in_action("Error raised in execute callback: none")
    assert summarise(a_trace(said), ["count.py"], "none", {"count.py": ACTION}).faults == ()


@pytest.mark.ros
@pytest.mark.parametrize("fails", [True, False], ids=["fails", "starts a node"])
def test_what_a_launch_file_prints_is_shown(tmp_path: Path, *, fails: bool) -> None:
    """Whoever prints to find a mistake sees it, also in a line without an end; it is nothing that the node printed."""
    text = f"print('at the top')\n{NEEDS}".replace(
        "def generate_launch_description():\n",
        f"def generate_launch_description():\n    print('here', end='')\n    1 / {0 if fails else 1}\n",
    )
    (tmp_path / "waits.py").write_text(WAITS)
    (tmp_path / "needs.launch.py").write_text(text)
    arguments = () if fails else (("kind", "five"),)
    request = ObserveRequest((tmp_path / "needs.launch.py",), NS_PER_S, clock="virtual", launch_arguments=arguments)
    summary = observe_programs(request, quiet)
    assert [(line.process, line.text) for line in summary.lines] == [
        (f"needs.launch.py{'' if fails else ' (evaluation)'}", text) for text in ("at the top", "here")
    ]
    assert ["ZeroDivisionError" in fault.text for fault in summary.faults] == [True] * fails


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize("given", [(), (("kind", "five"),)])
def test_a_launch_file_gets_its_arguments(tmp_path: Path, given: tuple[tuple[str, str], ...]) -> None:
    """One that is missing is named, with the option that gives it."""
    (tmp_path / "waits.py").write_text(WAITS)
    (tmp_path / "needs.launch.py").write_text(NEEDS)
    request = ObserveRequest((tmp_path / "needs.launch.py",), NS_PER_S, clock="virtual", launch_arguments=given)
    summary = observe_programs(request, quiet)
    assert summary.nodes == (("/ns/five",) if given else ())
    assert summary.hints == (() if given else ("give it a value: --launch-argument kind:=VALUE",))


@pytest.mark.ros
@pytest.mark.parametrize("room", ["kitchen", *more(["hall"])])
def test_the_file_that_is_named_runs(tmp_path: Path, room: str) -> None:
    """A package may have two files of a name."""
    a_package(tmp_path, "rooms", hall__main=LOGS.format("", "'hall'"), kitchen__main=LOGS.format("", "'kitchen'"))
    file = tmp_path / "rooms" / "rooms" / room / "main.py"
    summary = observe_programs(ObserveRequest((file,), NS_PER_S, clock="virtual"), lambda _: None)
    assert [r.text for r in summary.records] == [room]
    assert [note for note in summary.notes if "not graded" in note] == []


WORKSPACE = TESTS / "packages" / "workspace"
ROBOT = WORKSPACE / "src" / "robot"
TARGETS = {
    "a workspace": (WORKSPACE, ("robot/talker", "robot/listener"), ("/listener", "/talker")),
    "a package": (ROBOT, ("robot/talker", "robot/listener"), ("/listener", "/talker")),
    "an executable": (ROBOT / "talker", ("robot/talker",), ("/talker",)),
    "a launch file": (
        ROBOT / "launch" / "robot.launch.py",
        ("robot.launch.py",),
        ("/ears/listener", "/speaker"),
    ),
}


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize(("path", "processes", "nodes"), each(TARGETS.values(), 3), ids=TARGETS)
def test_packages_are_observed(path: Path, processes: tuple[str, ...], nodes: tuple[str, ...]) -> None:
    """Every layout that is graded, and the text says what ran."""
    summary = observe_programs(ObserveRequest((path,), 2 * NS_PER_S, clock="virtual"), lambda _: None)
    assert (summary.processes, summary.nodes, summary.faults) == (processes, nodes, ())
    assert render_summary(summary).startswith(f"{', '.join(processes)}: 2.0 s on the virtual clock\n")


@pytest.mark.parametrize(
    ("path", "said"),
    [
        (ROBOT / "talkr", "expected an executable (robot/talker or robot/listener), found none"),
        (ROBOT / "launch", "expected a package or workspace with executables, found none"),
        (ROBOT / "config" / "talker.yaml", "expected a .py file, found none"),
    ],
)
def test_what_cannot_be_observed_is_told_what_is_there(path: Path, said: str) -> None:
    """Nothing is started."""
    with pytest.raises(SubmissionError) as raised:
        observe_programs(ObserveRequest((path,), NS_PER_S), lambda _: None)
    assert raised.value.message == f"{path}: {said}"


def test_a_file_that_is_none_is_one_line() -> None:
    """Exit code 2, the name and what to do; nothing is started."""
    done = subprocess.run([GRADE, "observe", "nope.py"], check=False, capture_output=True, text=True)
    assert done.returncode == 2
    assert done.stderr.splitlines()[0] == "error: nope.py: expected a .py file, found none"


CLOCKS = pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
TALKER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String


class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.pub = self.create_publisher(String, "said", 10)
        self.create_timer(0.2, self.tick)

    def tick(self):
        self.pub.publish({sent})


rclpy.init({given})
rclpy.spin(Talker())
"""

LACKING = {
    "rosbag2_py": "rosbag2_py is a package of ROS 2 that is not installed here: the program may be right where it is",
    "nav2_msgs": "nav2_msgs is not installed here: give the folder with its definitions as --interfaces",
}


def seen(folder: Path, clock: str = "virtual", **files: str) -> Summary:
    """Observe files for a second."""
    folder.chmod(0o755)
    for name, text in files.items():
        (folder / f"{name}.py").write_text(text)
    paths = tuple(folder / f"{name}.py" for name in files)
    return observe_programs(ObserveRequest(paths, NS_PER_S, clock=clock), lambda _: None)


@pytest.mark.ros
@CLOCKS
def test_a_fault_has_the_hint_of_the_report(tmp_path: Path, clock: str) -> None:
    """In the text and in JSON; the traceback shows the program's own lines."""
    summary = seen(tmp_path, clock, node=TALKER.format(sent='"hello"', given=""))
    text, told = render_summary(summary), json.loads(summary_to_json(summary))
    hint = "this publisher sends String objects, not str: create one, set its fields and publish it"
    assert f"    hint: {hint}\n" in text
    assert [fault["hint"] for fault in told["faults"]] == [hint]
    shown = [line for line in text.splitlines() if "stderr: " in line]
    assert 'File "node.py", line 14, in tick' in "".join(shown)
    assert any("calls in Python and ROS)" in line for line in shown)
    assert not any("site-packages" in line or "and 1" in line for line in shown)


SPUN_BY_HAND = TALKER.replace(
    "rclpy.spin(Talker())",
    """
node = Talker()
{executor} = rclpy.executors.SingleThreadedExecutor()
{executor}.add_node(node)
rclpy.spin_once(node, timeout_sec=0.01)
{executor}.spin()
""",
).replace("import rclpy\n", "import rclpy\nimport rclpy.executors\n")


@pytest.mark.ros
def test_why_an_executor_spins_nothing_is_told(tmp_path: Path) -> None:
    """Without a rubric nobody says that messages are missing, but a topic without any and this line are enough."""
    text = SPUN_BY_HAND.format(sent="String()", given="", executor="mine")
    summary = seen(tmp_path, node=text)
    line = 1 + text.splitlines().index("rclpy.spin_once(node, timeout_sec=0.01)")
    assert [topic.messages for topic in summary.topics] == [0]
    assert summary.notes == (
        f"node.py:{line}: rclpy.spin_once(node, timeout_sec=0.01) takes node from mine, which then has nothing to "
        "spin: write mine.spin_once(...)",
    )


THREADS = """
import threading
import rclpy
from rclpy.node import Node

rclpy.init()
for name in ("one", "two"):
    node = Node(name)
    node.create_timer(0.1, lambda: None)
    threading.Thread(target=rclpy.spin, args=(node,)).start()
"""
SYNCHRONISED = """
import message_filters
import rclpy
from rclpy.node import Node
from std_msgs.msg import Header
from sensor_msgs.msg import Image


class Both(Node):
    def __init__(self):
        super().__init__("both")
        ends = [message_filters.Subscriber(self, Image, name) for name in ("left", "right")]
        self.together = message_filters.TimeSynchronizer(ends, 5)
        self.together.registerCallback(self.arrived)
        self.pubs = [self.create_publisher(Image, name, 10) for name in ("left", "right")]
        self.create_timer(0.2, self.send)

    def send(self):
        for pub in self.pubs:
            pub.publish(Image(header=Header(frame_id="camera")))

    def arrived(self):
        self.get_logger().info("both")


rclpy.init()
rclpy.spin(Both())
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    ("text", "line"),
    [
        (THREADS, "    threading.Thread(target=rclpy.spin, args=(node,)).start()"),
        (SYNCHRONISED, "    def arrived(self):"),
    ],
    ids=["two threads spin", "a filter's callback"],
)
def test_a_hint_names_its_line_where_the_fault_names_another(tmp_path: Path, text: str, line: str) -> None:
    """An exception in rclpy names the line that spins, or none, and its cause lies elsewhere."""
    (hint,) = filter(None, seen(tmp_path, node=text).hints)
    assert hint.startswith(f"node.py:{1 + text.splitlines().index(line)}: ")


@pytest.mark.breadth(1, 1)
@pytest.mark.long
@pytest.mark.ros
@CLOCKS
@pytest.mark.parametrize(("package", "hint"), each(LACKING.items(), 2))
def test_a_package_that_is_not_installed_is_no_mistake(tmp_path: Path, clock: str, package: str, hint: str) -> None:
    """Of those that ROS has, and of interfaces."""
    assert seen(tmp_path, clock, node=f"import rclpy\nimport {package}\n").hints == (hint,)


@pytest.mark.breadth(1, 1)
@pytest.mark.long
@pytest.mark.ros
@CLOCKS
@pytest.mark.parametrize("given", ["domain_id=7", *more(["args=None"])])
def test_a_node_in_another_domain_is_told(tmp_path: Path, clock: str, given: str) -> None:
    """Instead of nothing at all."""
    before = "import os\nos.environ['ROS_DOMAIN_ID'] = '7'\n" if "domain" not in given else ""
    summary = seen(tmp_path, clock, node=before + TALKER.format(sent="String()", given=given))
    assert summary.nodes == ()
    assert summary.notes == (
        "node.py: the node /talker is in the ROS domain 7, where the grader does not see it; remove what sets "
        "domain_id or ROS_DOMAIN_ID",
    )


@pytest.mark.long
@pytest.mark.ros
@CLOCKS
def test_two_nodes_of_one_name_are_told_apart_by_a_note(tmp_path: Path, clock: str) -> None:
    """With the lines that give the name."""
    text = TALKER.format(sent="String()", given="")
    summary = seen(tmp_path, clock, one=text, two=text)
    said = "one.py:9 and two.py:9: two nodes have the name /talker, and ROS cannot tell them apart"
    assert [note.partition(": give")[0] for note in summary.notes] == [said]


EVENTS = "rclpy.experimental.events_executor.EventsExecutor()"
OUTSIDE = {
    "subprocess.run([sys.executable, '-c', ''])": "node.py:11 starts another process, which runs in real time",
    "signal.alarm(5)": "node.py:11 sets an alarm that rings in real time",
    **dict.fromkeys(
        (
            "open('/proc/uptime').close()",
            "open(b'/proc/uptime').close()",
            "os.close(os.open('/proc/uptime', os.O_RDONLY))",
            "pathlib.Path('/proc/uptime').read_text()",
        ),
        "node.py:11 reads a clock of the kernel, which shows real time",
    ),
    EVENTS: "node.py:11 makes an EventsExecutor, which waits in real time",
}


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize(("statement", "said"), each(OUTSIDE.items(), 4))
def test_the_note_on_the_wall_clock_names_the_line(tmp_path: Path, statement: str, said: str) -> None:
    """And what stands there."""
    text = (
        "import os\nimport pathlib\nimport signal, subprocess\nimport sys\nimport rclpy\n"
        "import rclpy.experimental.events_executor\n\n\ndef work():\n    rclpy.init()\n"
        f"    {statement}\n\n\nwork()\nrclpy.spin(rclpy.create_node('n'))\n"
    )
    summary = seen(tmp_path, "auto", node=text)
    reason = f"the node waits for something that is neither ROS nor time: {said}"
    assert (summary.clock, summary.clock_reason) == (ClockKind.WALL, reason)
    assert f"  note: recorded on the wall clock: {reason}\n" in render_summary(summary)
    assert summary.faults == () or "alarm" in statement  # whose signal ends the program


def test_output_that_only_looks_like_a_traceback_stays() -> None:
    """Lines of standard output, and text that is indented without a call before it."""
    texts = [
        ("stdout", '  File "/usr/lib/python3/a.py", line 1, in f'),
        ("stderr", "    indented"),
        ("stderr", '  File "/usr/lib/python3/a.py", line 1, in f'),
        ("stderr", "    g()"),
        ("stderr", "    ^^^"),
        ("stderr", "ValueError: x"),
    ]
    lines = [OutputLine(n, "a.py", stream, text) for n, (stream, text) in enumerate(texts)]
    assert [line.text for line in without_libraries(lines)] == [
        texts[0][1],
        texts[1][1],
        "  (1 call in Python and ROS)",
        "ValueError: x",
    ]


@pytest.mark.long
@pytest.mark.ros
@CLOCKS
def test_services_of_others_are_in_the_graph(clock: str) -> None:
    """Also of programs without a topic."""
    files = (REPORTED / "graph_server.py", REPORTED / "graph_asks.py")
    text = render_summary(observe_programs(ObserveRequest(files, 2 * NS_PER_S, clock=clock), lambda _: None))
    assert "Graph:\n  /asks ┄┄/ask┄┄▶ /server\n" in text
