"""The plugin in runs of pytest of its own: options, markers, failures and what they leave."""

import re
import shutil
from pathlib import Path

import pytest
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from tiers import each

import grader

NODES = Path(__file__).parent / "nodes"

pytestmark = pytest.mark.ros


@pytest.fixture
def suite(pytester: pytest.Pytester) -> pytest.Pytester:
    """A folder with the nodes of the tests."""
    shutil.copytree(NODES, pytester.path, dirs_exist_ok=True)
    return pytester


def run(suite: pytest.Pytester, test: str, *arguments: str) -> pytest.RunResult:
    """Run a file of tests in a process of its own, where warnings are errors."""
    suite.makepyfile(test_it=test)
    return suite.runpytest_subprocess("-p", "grader.pytest_plugin", "-W", "error", "-p", "no:cacheprovider", *arguments)


FAILS = """
from std_msgs.msg import String

def test_a_right_answer(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="a"))
    ros.advance(1.0)
    assert ros.messages("/out")[-1].data == "a"

def test_a_wrong_answer(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="a"), rate=2)
    ros.advance(3.0)
    assert ros.messages("/out")[-1].data == "b"

def test_a_program_that_fails(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="fail"))
    ros.advance(1.0)
"""


def test_a_failure_leaves_its_recording_and_a_page(suite: pytest.Pytester) -> None:
    """Their paths are in the failure, and in the file for JUnit; the traceback ends in the test."""
    result = run(suite, FAILS, "--junitxml=junit.xml", f"--basetemp={suite.path}/kept")
    result.assert_outcomes(passed=1, failed=2)
    text = result.stdout.str()
    assert "grader/world" not in text
    assert 'echo.py", line 20, in on_text' in text
    assert "ValueError: asked to fail" in text
    recordings = [Path(found) for found in re.findall(r"^(/\S+/recording\.mcap)$", text, re.MULTILINE)]
    assert [path.parent.name for path in recordings] == ["test_a_wrong_answer0", "test_a_program_that_fails0"]
    with recordings[0].open("rb") as recording:
        decoded = make_reader(recording, decoder_factories=[DecoderFactory()]).iter_decoded_messages(["/in", "/out"])
        messages = [(channel.topic, message.data) for _, channel, _, message in decoded]
    assert messages == [(topic, "a") for _ in range(7) for topic in ("/in", "/out")]
    page = (recordings[0].parent / "run.html").read_text(encoding="utf-8")
    assert "test_a_wrong_answer" in page
    assert "heard a" in page
    assert str(recordings[1]) in (suite.path / "junit.xml").read_text(encoding="utf-8")
    assert not [*(suite.path / "kept").glob("test_a_right_answer*/*")]


MISSING = """
import pytest
from std_msgs.msg import String
from std_srvs.srv import Trigger

def test_it(ros):
    ros.run("ehco.py")

def test_a_class(ros):
    ros.publish("/in", String)

def test_a_block(ros):
    with ros.expects_failure():
        ros.advance(1.0)

def test_a_function_of_the_test(ros):
    def answer(request):
        return request.missing
    ros.serve("/allowed", Trigger, answer)
    ros.run("switch.py")
    ros.call("/enable", __import__("std_srvs.srv").srv.SetBool.Request())

@pytest.fixture
def echo(ros_session, request):
    with ros_session.open(request.path.parent) as ros:
        yield ros

def test_a_world_of_a_fixture(echo):
    echo.publish("/in", String())
    echo.advance(-1)
"""


@pytest.mark.long
def test_a_mistake_in_a_test_is_shown_at_its_line_with_a_hint(suite: pytest.Pytester) -> None:
    """A file that is not there, or an object of a wrong class; nothing of the grader's own code is shown."""
    text = run(suite, MISSING).stdout.str()
    for line, error in (
        ('ros.publish("/in", String)', "TypeError: /in: expected a message, found the class String; write String()"),
        ("with ros.expects_failure():", "AssertionError: expected that a program fails, but none did"),
        ("return request.missing", "AttributeError: 'Trigger_Request' object has no attribute 'missing'"),
        ("echo.advance(-1)", "ValueError: expected seconds to advance, found -1: time does not go back"),
    ):
        assert f">       {line}" in text
        assert f"E       {error}" in text
    assert str(Path(grader.__file__).parent) not in text
    assert "contextlib.py" not in text
    whole = run(suite, MISSING, "--full-trace", "-k", "class").stdout.str()
    assert str(Path(grader.__file__).parent) in whole
    assert '>       ros.run("ehco.py")' in text
    assert "SubmissionError: ehco.py: expected a file, found none" in text
    assert "hint: did you mean echo.py?" in text
    assert "grader/world" not in text


DISTURBED = """
import pytest
from std_msgs.msg import String

@pytest.mark.ros(seed=3, lose={"/in": 0.25}, delay={"in": (0.01, 0.03)})
def test_what_is_lost_and_late(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="x"), rate=10)
    ros.advance(40.05)
    times = [one.t for one in ros.received("/out")]
    late = [round(t * 1000) % 100 for t in times]
    assert 220 < len(times) < 380
    assert min(late) >= 10 and max(late) <= 30 and len(set(late)) > 10
    with open("told.txt", "a") as told:
        told.write(repr(times) + "\\n")
"""


@pytest.mark.long
def test_losses_and_delays_follow_from_the_seed(suite: pytest.Pytester) -> None:
    """The same seed loses the same messages, another one others."""
    for seed in ((), (), ("--ros-seed", "4")):
        run(suite, DISTURBED, *seed).assert_outcomes(passed=1)
    first, second, other = (suite.path / "told.txt").read_text(encoding="utf-8").splitlines()
    assert first == second
    assert first != other


WIDE = """
import pytest
from std_msgs.msg import String

@pytest.fixture(scope="module")
def robot(ros_session, request):
    with ros_session.open(request.path.parent) as world:
        world.run("echo.py")
        yield world

@pytest.mark.parametrize("text", ["a", "b"])
def test_one_world_for_all(robot, ros, text):
    assert ros.nodes() == []
    robot.publish("/in", String(data=text))
    robot.advance(1.0)
    assert [m.data for m in robot.messages("/out")][-1] == text

def test_time_has_passed(robot):
    assert robot.now == 2.0
"""


@pytest.mark.nightly
def test_a_wider_scope_and_several_processes(suite: pytest.Pytester) -> None:
    """One world for a module, beside those of single tests; with xdist as well."""
    run(suite, WIDE).assert_outcomes(passed=3)
    run(suite, FAILS, "-n", "2").assert_outcomes(passed=1, failed=2)


WITHOUT_BUBBLEWRAP = """
import shutil

which = shutil.which
shutil.which = lambda name, *where, **more: None if name == "bwrap" else which(name, *where, **more)
"""
SHARED = """
import os
from pathlib import Path
from std_msgs.msg import String

def test_it(ros):
    where = ros.run("where.py")
    assert where.output == f"{Path(__file__).parent}/where.py {os.getcwd()}\\n"
    ros.run("echo.py")
    ros.publish("/in", String(data="a"), rate=10)
    ros.advance(2.0)
    assert len(ros.messages("/out")) == 21
"""


@pytest.mark.nightly
def test_without_bubblewrap_the_network_is_shared_and_that_is_said(suite: pytest.Pytester) -> None:
    """The nodes run all the same, where they lie."""
    suite.makeconftest(WITHOUT_BUBBLEWRAP)
    (suite.path / "where.py").write_text("import os\nprint(__file__, os.getcwd())\n", encoding="utf-8")
    for arguments in ((), ("-n", "1")):
        result = run(suite, SHARED, *arguments)
        result.assert_outcomes(passed=1)
        result.stdout.fnmatch_lines(
            ["ros: the nodes shared the network of this machine (sandbox: expected the program bwrap, found none)"]
        )


UNSUITABLE = """
import pytest

def test_it(ros):
    with open("sub.py", "w") as program:
        program.write("import subprocess\\nsubprocess.run(['true'])\\n")
    ros.run("sub.py")

def test_although_it_expects_a_failure(ros):
    with ros.expects_failure():
        ros.run("sub.py")
"""


@pytest.mark.long
def test_what_virtual_time_does_not_suit_fails_once(suite: pytest.Pytester) -> None:
    """A program that starts another process is told with its line; no test passes with it."""
    result = run(suite, UNSUITABLE)
    result.assert_outcomes(failed=1, passed=1, errors=1)
    result.stdout.fnmatch_lines(
        [
            "E *ProgramFailed: sub.py was stopped at t = 0.000 s",
            "E *sub.py?, line 2, in <module>",
            "E * starts another process, which runs in real time",
        ]
    )
    text = "virtual time does not suit these programs: *: sub.py:2 starts another process, which runs in real time"
    result.stdout.fnmatch_lines([text])


def test_a_wrong_option_of_the_marker_is_told(suite: pytest.Pytester) -> None:
    """It names what there is."""
    text = "import pytest\n@pytest.mark.ros(sede=1)\ndef test_it(ros): pass\n"
    result = run(suite, text)
    assert result.ret != 0
    result.stdout.fnmatch_lines(
        ["*@pytest.mark.ros: expected clock, seed, seeds, delay, lose, between by name, found sede"]
    )


CLOCKS = """
import pytest
from std_msgs.msg import String

def answers(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="a"), rate=20)
    ros.wait_until(lambda: ros.messages("/out")[2], timeout=60)
    return ros.trace().clock.value

def test_by_default(ros):
    assert answers(ros) == CLOCK

@pytest.mark.ros(clock="virtual")
def test_virtual(ros):
    assert answers(ros) == "virtual"

@pytest.mark.ros(clock="wall")
def test_wall(ros):
    assert answers(ros) == "wall"

@pytest.mark.ros(seeds=3)
def test_seeds(ros):
    assert answers(ros) == CLOCK

@pytest.mark.ros(lose={"/in": 1.0})
def test_it_fails(ros):
    ros.run("echo.py")
    ros.publish("/in", String(data="a"), rate=20)
    ros.wait_until(lambda: ros.messages("/out"), timeout=0.3)
"""


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize(
    ("arguments", "clock", "seeds"), each([((), "virtual", 3), (("--ros-clock", "wall"), "wall", 1)], 2)
)
def test_the_clock_is_an_option_and_a_marker(
    suite: pytest.Pytester, arguments: tuple[str, ...], clock: str, seeds: int
) -> None:
    """The marker wins; on the wall clock a test with several seeds runs once."""
    result = run(suite, CLOCKS.replace("CLOCK", repr(clock)), "-rf", *arguments)
    result.assert_outcomes(passed=3 + seeds, failed=1)
    repeating = "repeat it with" if clock == "virtual" else "the same delays and losses are drawn with"
    result.stdout.fnmatch_lines(["*StepTimeout: the condition did not hold*", f"seed 0: {repeating} --ros-seed 0"])


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("clock='real'", "*clock: expected virtual or wall, found 'real'"),
        ("clock='wall', seeds=3", "*seeds draws the order of what is ready, which the wall clock leaves to chance: *"),
    ],
)
def test_a_wrong_clock_is_told(suite: pytest.Pytester, options: str, words: str) -> None:
    """So is what it cannot do."""
    result = run(suite, f"import pytest\n@pytest.mark.ros({options})\ndef test_it(ros): pass\n")
    assert result.ret != 0
    result.stdout.fnmatch_lines([words])


BESIDE = """
from talk_words.msg import Say

def test_it(ros):
    ros.run("sayer.py")
    ros.advance(2.5)
    assert ros.messages("/say") == [Say(text="hi")] * 2
"""
SAYER = """
import rclpy
from talk_words.msg import Say

rclpy.init()
node = rclpy.create_node("sayer")
out = node.create_publisher(Say, "say", 10)
node.create_timer(1.0, lambda: out.publish(Say(text="hi")))
rclpy.spin(node)
"""


@pytest.mark.long
def test_a_message_package_beside_the_test_is_not_taken_for_a_folder(suite: pytest.Pytester) -> None:
    """Python would find its folder first, as a package without `__init__.py`, in which there is nothing to import."""
    package = suite.mkdir("talk_words")
    (package / "msg").mkdir()
    (package / "msg" / "Say.msg").write_text("string text\n", encoding="utf-8")
    (package / "package.xml").write_text(
        "<package format='3'><name>talk_words</name><member_of_group>rosidl_interface_packages</member_of_group>"
        "</package>",
        encoding="utf-8",
    )
    (suite.path / "sayer.py").write_text(SAYER, encoding="utf-8")
    run(suite, BESIDE).assert_outcomes(passed=1)


GIVEN = """
def test_that_passes(ros):
    remappings = {"/inn": "/words", "/out": "/said"}
    ros.run("echo.py", name="e", parameters={"deley": 1.0, "use_sim_time": False}, remappings=remappings)
    ros.advance(1.0)

def test_that_fails(ros):
    ros.run("echo.py", parameters={"e:nothing": 1}, remappings={"~/x": "y"})
    ros.advance(1.0)
    assert ros.now == 2.0

def test_a_launch_file(ros):
    ros.launch("given.launch.py")
    ros.advance(1.0)

def test_with_nothing_to_tell(ros):
    ros.run("echo.py", namespace="/a", remappings={"/in": "words", "/out": "~/said"})
    assert sorted(ros.topics()) == ["/a/echo/said", "/a/words"]
"""


GIVEN_BY_LAUNCH = """
from launch import LaunchDescription
from launch_ros.actions import Node


def generate_launch_description():
    given = dict(parameters=[{"late": 1}], remappings=[("inn", "/words"), ("/out", "/said")])
    return LaunchDescription([Node(package="demo", executable="echo.py", **given)])
"""


def test_parameters_and_remappings_without_effect_are_told(suite: pytest.Pytester) -> None:
    """With the failure of a test, and as a warning of one that passes."""
    suite.makepyfile(test_it=GIVEN)
    suite.makefile(".launch.py", given=GIVEN_BY_LAUNCH)
    result = suite.runpytest_subprocess("-p", "grader.pytest_plugin", "-p", "no:cacheprovider")
    result.assert_outcomes(passed=3, failed=1, warnings=4)
    text = result.stdout.str()
    failure, _, warnings = text.partition("warnings summary")
    assert "echo.py: the parameter nothing was given, but no node of it declares that" in failure
    told = "echo.py: the remapping of ~/x to y matches no topic or service of its nodes; they have /in, /out"
    assert told in failure
    assert "echo.py: the parameter deley was given, but no node of it declares that" in warnings
    assert "echo.py: the parameter late was given, but no node of it declares that" in warnings
    assert "echo.py: the remapping of inn to /words matches no topic or service of its nodes; did you" in warnings
    told = "echo.py: the remapping of /inn to /words matches no topic or service of its nodes; did you mean /in?"
    assert told in warnings


def test_what_a_launch_file_has_and_was_not_started_is_told(suite: pytest.Pytester) -> None:
    """With the failure of a test, and as a warning of one that passes."""
    suite.makefile(
        ".launch.py",
        demo="""
from launch import LaunchDescription
from launch.actions import RegisterEventHandler
from launch.event_handlers import OnProcessExit
from launch_ros.actions import Node


def generate_launch_description():
    camera = Node(package="usb_cam", executable="usb_cam_node")
    after = RegisterEventHandler(OnProcessExit(target_action=camera, on_exit=print))
    return LaunchDescription([Node(package="demo", executable="echo.py"), camera, after])
""",
    )
    suite.makepyfile(
        test_it="def test_it(ros):\n    ros.launch('demo.launch.py')\n    ros.advance(1.0)\n"
        "def test_that(ros):\n    ros.launch('demo.launch.py')\n    assert ros.now == 1.0\n"
    )
    result = suite.runpytest_subprocess("-p", "grader.pytest_plugin", "-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, failed=1, warnings=2)
    failure, _, warning = result.stdout.str().partition("warnings summary")
    for text in (failure, warning):
        assert "the event handler OnProcessExit was left out: only lists of actions" in text
        assert "usb_cam/usb_cam_node was not started: the workspace has no package usb_cam" in text


IMPORTS_PLAINLY = """
def test_that_passes(ros):
    ros.run("talk/talker")
    ros.advance(1.0)
    assert ros.messages("/n")[-1].data == 3

def test_that_fails(ros):
    ros.run("talk/talker")
    assert ros.messages("/n")[-1].data == 3
"""

PACKAGE = {
    "package.xml": "<package format='3'><name>talk</name>"
    "<export><build_type>ament_python</build_type></export></package>",
    "setup.py": "from setuptools import setup\n"
    "setup(name='talk', packages=['talk'], entry_points={'console_scripts': ['talker = talk.talker:main']})\n",
    "talk/__init__.py": "",
    "talk/numbers_of_it.py": "NUMBER = 3\n",
    "talk/talker.py": """
import rclpy
from numbers_of_it import NUMBER
from std_msgs.msg import Int32


def main():
    rclpy.init()
    node = rclpy.create_node("talker")
    out = node.create_publisher(Int32, "n", 10)
    node.create_timer(0.5, lambda: out.publish(Int32(data=NUMBER)))
    rclpy.spin(node)
""",
}


def test_an_import_that_fails_once_the_package_is_installed_is_told(pytester: pytest.Pytester) -> None:
    """With the failure of a test, and as a warning of one that passes: `ros2 run` does not find the module."""
    for name, text in PACKAGE.items():
        path = pytester.path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(text, encoding="utf-8")
    pytester.makepyfile(test_it=IMPORTS_PLAINLY)
    result = pytester.runpytest_subprocess("-p", "grader.pytest_plugin", "-p", "no:cacheprovider")
    result.assert_outcomes(passed=1, failed=1, warnings=1)
    told = "import numbers_of_it finds numbers_of_it.py beside it with `python3` only, not with `ros2 run`"
    for text in result.stdout.str().split("warnings summary"):
        assert told in text
