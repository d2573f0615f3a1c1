"""What a test sees of programs that it steps through virtual time, with real nodes."""

import os
import re
import select
import signal
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from geometry_msgs.msg import Twist
from rclpy.qos import DurabilityPolicy, QoSProfile, ReliabilityPolicy
from sensor_msgs.msg import LaserScan
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci

from grader.runtime.model.errors import HarnessError, SubmissionError
from grader.runtime.simulation import Simulation
from grader.world.errors import NoMessage, ProgramFailed, StepTimeout, WrongType
from grader.world.opening import Worlds
from grader.world.world import World

pytestmark = pytest.mark.ros

Write = Callable[..., str]


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a program, and return its path."""

    def written(text: str, name: str = "node.py") -> str:
        path = tmp_path / name
        path.write_text(text, encoding="utf-8")
        return str(path)

    return written


TICKER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32

class Ticker(Node):
    def __init__(self):
        super().__init__("ticker")
        self.n = 0
        self.ticks = self.create_publisher(Int32, "/ticks", 10)
        self.create_timer(1.0, self.tick)

    def tick(self):
        self.n += 1
        self.ticks.publish(Int32(data=self.n))

rclpy.init()
rclpy.spin(Ticker())
"""


def test_a_step_includes_what_happens_at_its_end(ros: World, write: Write) -> None:
    """Who waits for a second expects the timer of that second, and it comes once."""
    ros.run(write(TICKER))
    ros.advance(0.999)
    assert ros.messages("/ticks") == []
    ros.advance(0.001)
    assert [(one.t, one.message.data) for one in ros.received("/ticks")] == [(1.0, 1)]
    ros.settle()
    ros.advance(0)
    assert len(ros.messages("/ticks")) == 1
    for _ in range(7):
        ros.advance(0.5)
    assert ros.now == 4.5
    assert [one.t for one in ros.received("/ticks")] == [1.0, 2.0, 3.0, 4.0]


def test_many_small_steps_are_one_large_step(ros_session: Worlds, write: Write) -> None:
    """How a test divides time changes nothing that the programs do."""
    seen = []
    for step in (10.0, 0.5, 0.07):
        with ros_session.open() as ros:
            ros.run(write(TICKER, "ticker.py"))
            ros.run(Path(__file__).parent / "nodes" / "obstacle_stop.py")
            while ros.now < 10.0:
                ros.advance(min(step, 10.0 - ros.now))
            seen.append([(m.t_ns, m.topic, m.cdr) for m in ros.trace().messages()])
    assert len(seen[0]) == 210
    assert seen[0] == seen[1] == seen[2]


def test_a_program_that_is_started_late_lives_in_the_same_time(ros: World) -> None:
    """Programs may be started at any time; what was published before, they have not heard."""
    ros.publish("/in", String(data="before"))
    ros.advance(3.0)
    echo = ros.run("nodes/echo.py", name="late", namespace="/robot")
    assert ros.nodes() == ["/robot/late"]
    ros.publish("/in", String(data="after"))
    ros.settle()
    assert [(one.t, one.message.data) for one in ros.received("/out")] == [(3.0, "after")]
    assert [(log.t_ns, log.severity, log.text) for log in echo.logs] == [(3_000_000_000, "INFO", "heard after")]


def test_two_programs_of_one_file_and_their_output(ros: World, write: Write) -> None:
    """Each has its own arguments, environment, parameters and output."""
    text = (
        "import os, sys, rclpy\nrclpy.init()\nnode = rclpy.create_node('one')\n"
        "node.declare_parameters('', [('x', 0.0), ('names', ['']), ('on', False)])\n"
        "print(sys.argv[1], os.environ['COLOUR'], [node.get_parameter(n).value for n in ('x', 'names', 'on')])\n"
        "print('to stderr', file=sys.stderr)\nsys.exit(int(sys.argv[1]))\n"
    )
    path = write(text)
    first = ros.run(path, arguments=["3"], env={"COLOUR": "red"}, parameters={"x": 1e-6, "names": ["a", "b"]})
    second = ros.run(path, arguments=["0"], env={"COLOUR": "blue"}, parameters={"x": 2.0, "on": True})
    assert first.output == "3 red [1e-06, ['a', 'b'], False]\nto stderr\n"
    assert second.output == "0 blue [2.0, [''], True]\nto stderr\n"
    assert (first.exit_code, second.exit_code, first.running) == (3, 0, False)
    assert [program.name for program in ros.programs] == ["node.py", "node.py (2)"]


def test_a_program_runs_where_it_lies_and_starts_in_the_working_directory(ros: World, write: Write) -> None:
    """It finds its neighbours, and files as the test itself does."""
    write("WORD = 'beside'\n", "neighbour.py")
    program = ros.run(write("import os, neighbour\nprint(neighbour.WORD, __file__, os.getcwd())\n"))
    assert program.output.split() == ["beside", write("", "empty.py").replace("empty", "node"), str(Path.cwd())]


def test_a_later_stream_replaces_an_earlier_one(ros: World) -> None:
    """A list is sent one after the other; the last message goes on until the stream is stopped."""
    ros.run("nodes/echo.py")
    ros.publish("in", [String(data="a"), String(data="b")], rate=2)
    ros.advance(1.4)
    ros.publish("/in", String(data="c"), rate=10)
    ros.advance(0.1)
    ros.stop_publishing("/in")
    ros.advance(5.0)
    ros.publish("/in", String(data="d"))
    ros.advance(1.0)
    assert [(one.t, one.message.data) for one in ros.received("/out")] == [
        (0.0, "a"),
        (0.5, "b"),
        (1.0, "b"),
        (1.4, "c"),
        (1.5, "c"),
        (6.5, "d"),
    ]


def test_an_exception_fails_the_next_step_with_the_programs_traceback(ros: World) -> None:
    """The traceback names the program's own lines; afterwards the program has ended."""
    echo = ros.run("nodes/echo.py")
    ros.publish("/in", String(data="fail"))
    with pytest.raises(ProgramFailed) as failed:
        ros.advance(1.0)
    text = str(failed.value)
    assert text.startswith("echo.py raised an exception at t = 0.000 s\nTraceback (most recent call last):\n")
    assert f'File "{Path(__file__).parent}/nodes/echo.py", line ' in text
    assert 'raise ValueError("asked to fail")' in text
    assert text.endswith("ValueError: asked to fail")
    assert (echo.running, echo.exit_code) == (False, 1)
    ros.advance(1.0)  # it is told once


def test_a_failure_may_be_expected(ros: World, write: Write) -> None:
    """It has to come, and to be the one that was meant."""
    ros.run("nodes/echo.py")
    ros.publish("/in", String(data="fail"))
    with ros.expects_failure("asked to") as failure:
        ros.advance(1.0)
    assert failure.program is ros.programs[0]
    assert failure.text == "ValueError: asked to fail"
    with pytest.raises(AssertionError, match="expected that a program fails"), ros.expects_failure():
        ros.advance(1.0)
    with pytest.raises(AssertionError, match="matches 'other'"), ros.expects_failure("other"):
        ros.run(write("raise KeyError('this')\n"))


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("def f(:\n", "could not be compiled at t = 0.000 s"),
        ("import os\nos.abort()\n", "was ended at t = 0.000 s\nended by SIGABRT"),
        ("import no_such_module_at_all\n", "ModuleNotFoundError: No module named 'no_such_module_at_all'"),
    ],
)
def test_what_fails_at_once_fails_the_start(ros: World, write: Write, text: str, message: str) -> None:
    """A program that does not come up is told where it is started."""
    with pytest.raises(ProgramFailed, match=re.escape(message)):
        ros.run(write(text))


def test_a_kill_is_no_failure_of_the_program(ros: World) -> None:
    """The test wanted it; the exit code is that of the signal."""
    echo = ros.run("nodes/echo.py")
    echo.kill()
    echo.kill()
    assert (echo.running, echo.exit_code) == (False, 137)
    ros.advance(1.0)
    ros.run("nodes/echo.py")
    ros.publish("/in", String(data="x"))
    ros.advance(1.0)
    assert [m.data for m in ros.messages("/out")] == ["x"]


def test_a_program_may_take_virtual_time_to_stop(ros: World, write: Write) -> None:
    """It is still running after Ctrl-C, and ends in a later step; a second Ctrl-C changes nothing."""
    text = (
        "import time, rclpy\nrclpy.init()\nnode = rclpy.create_node('slow')\n"
        "try:\n    rclpy.spin(node)\nexcept BaseException:\n    time.sleep(2.0)\n    print('done')\n"
    )
    slow = ros.run(write(text))
    ros.advance(1.0)
    slow.interrupt()
    slow.interrupt()
    assert slow.running
    ros.advance(1.9)
    assert slow.running
    ros.wait_until(lambda: not slow.running, timeout=1.0)
    assert (ros.now, slow.exit_code, slow.output) == (pytest.approx(3.0), 0, "done\n")


def test_a_served_function_answers_while_time_stands_still(ros: World) -> None:
    """A program asks the test, and the test asks the program, both in the middle of a call."""
    asked = []

    def allowed(request: Trigger.Request) -> Trigger.Response:
        asked.append((ros.now, type(request)))
        return Trigger.Response(success=True, message="go ahead")

    ros.run("nodes/switch.py", parameters={"step": 5})
    ros.serve("/allowed", Trigger, allowed)
    ros.advance(1.0)
    response = ros.call("/enable", SetBool.Request(data=True))
    assert (response.success, response.message) == (True, "go ahead")
    assert asked == [(1.0, Trigger.Request)]
    ros.advance(0.35)
    assert [m.data for m in ros.messages("/count")] == [5, 10, 15]
    ros.serve("/allowed", Trigger, lambda _: Trigger.Response(success=False, message="no"))
    assert ros.call("/enable", SetBool.Request(data=True)).message == "no"


def broken(request: Trigger.Request) -> Trigger.Response:
    """Raise an error."""
    raise LookupError("broken")


def test_what_a_served_function_raises_fails_the_step(ros: World) -> None:
    """The error is the function's own; a program that gets no response waits for it."""
    ros.run("nodes/switch.py")
    ros.serve("/allowed", Trigger, broken)
    with pytest.raises(LookupError, match="broken"):
        ros.call("/enable", SetBool.Request(data=True))
    ros.advance(1.0)


@pytest.mark.parametrize(
    ("function", "error", "words"),
    [
        (lambda ros: True, TypeError, "/allowed: expected a Trigger.Response from its function, found bool"),
        (lambda ros: ros.advance(1.0), RuntimeError, "cannot let time pass"),
        (lambda ros: ros.publish("/in", String()), RuntimeError, "cannot let time pass or act"),
    ],
)
def test_a_served_function_only_answers(
    ros: World, function: Callable[[World], object], error: type[Exception], words: str
) -> None:
    """It returns a response, and does nothing that would need another step."""
    ros.run("nodes/switch.py")
    ros.serve("/allowed", Trigger, lambda _: function(ros))
    with pytest.raises(error, match=re.escape(words)):
        ros.call("/enable", SetBool.Request(data=True))


def test_a_call_without_an_answer_says_why(ros: World) -> None:
    """No server at all, one of a similar name, and one that does not answer."""
    ros.run("nodes/switch.py")
    with pytest.raises(StepTimeout) as timeout:
        ros.call("/enabel", SetBool.Request(data=True), timeout=2.0)
    text = str(timeout.value)
    assert text.startswith("/enabel did not answer within 2.0 s (t = 0.000 s to t = 2.000 s)")
    assert "the service:\n  nobody offers /enabel\n  hint: did you mean /enable?" in text
    with pytest.raises(StepTimeout, match="/enable has a server, which has not answered") as timeout:
        ros.call("/enable", SetBool.Request(data=True), timeout=2.0)
    assert "/switch has a client of /allowed, which nobody offers" in str(timeout.value)


def test_a_message_that_has_not_come_says_why(ros: World) -> None:
    """A slip in a name is answered with the name that was meant; a condition that asks for it is only false."""
    ros.run("nodes/obstacle_stop.py")
    ros.advance(1.0)
    with pytest.raises(NoMessage, match=r"/cmd_vell: no program publishes on it\n  hint: did you mean /cmd_vel\?"):
        ros.messages("/cmd_vell")[-1]
    with pytest.raises(NoMessage, match="only 20 so far"):
        ros.received("/cmd_vel")[20]
    assert len(ros.messages("/cmd_vel")[3:5]) == 2
    with pytest.raises(StepTimeout) as timeout:
        ros.wait_until(lambda: ros.messages("/cmd_vell")[0], timeout=1.0)
    text = str(timeout.value)
    assert text.startswith("the condition did not hold within 1.0 s (t = 1.000 s to t = 2.000 s)\nit asks for:\n")
    assert "meanwhile:\n  /cmd_vel: 21 messages, the last at t = 2.000 s\n" in text
    assert "/obstacle_stop listens to /scan, where nobody publishes" in text


def test_a_silent_topic_says_who_could_speak_on_it(ros: World) -> None:
    """Nobody yet, a program that has not published, the test alone, or a simulation alone; nobody is called wrong."""
    with pytest.raises(NoMessage, match=r"^/cmd_vel: no program publishes on it$"):
        ros.messages("/cmd_vel")[-1]
    ros.run("nodes/obstacle_stop.py")
    with pytest.raises(NoMessage, match=r"^/cmd_vel: no message of /obstacle_stop yet at t = 0\.000 s: let time pass$"):
        ros.received("/cmd_vel")[-1]
    ros.publish("/scan", LaserScan(ranges=[2.0]), rate=10)
    ros.simulate("differential_drive")
    with pytest.raises(NoMessage, match=r"^/scan: only the test publishes on it; these are the messages of programs$"):
        ros.messages("/scan")[0]
    with pytest.raises(NoMessage, match=r"^/odom: only a simulation publishes on it"):
        ros.messages("/odom")[0]


def test_a_topic_without_a_subscription_is_told(ros: World) -> None:
    """Where somebody waits in vain, with the name that may be meant."""
    ros.run("nodes/echo.py")
    ros.publish("/inn", String(), rate=1)
    with pytest.raises(StepTimeout, match=r"/inn: no program subscribes to it; did you mean /in\?") as timeout:
        ros.wait_until(lambda: ros.messages("/out"), timeout=2.0)
    assert timeout.value.hint == "did you mean /in?"


class Other(Simulation):
    """Uses the topics of `echo.py` and the service of `switch.py`, with types of its own."""

    def __init__(self, **kinds: dict[str, str]) -> None:
        self.kinds = kinds

    def publishes(self) -> dict[str, str]:
        """Return what it publishes."""
        return self.kinds.get("publishes", {})

    def hears(self) -> dict[str, str]:
        """Return what it hears."""
        return self.kinds.get("hears", {})

    def serves(self) -> dict[str, str]:
        """Return what it serves."""
        return self.kinds.get("serves", {})


BEST_EFFORT = QoSProfile(depth=1, reliability=ReliabilityPolicy.BEST_EFFORT)
STRING, INT = "std_msgs/msg/String", "std_msgs/msg/Int32"
MISMATCHES: dict[str, tuple[Callable[[World], object], str]] = {
    "publish": (
        lambda ros: ros.publish("/in", Int32()),
        f"/in: the test publishes {INT}, /echo subscribes to {STRING}",
    ),
    "QoS": (
        lambda ros: ros.publish("/in", String(), qos=BEST_EFFORT),
        "/in: /echo asks for reliable, the test offers best_effort reliability: no message arrives",
    ),
    "serve": (
        lambda ros: ros.serve("/allowed", SetBool, lambda _: SetBool.Response()),
        "/allowed: the test serves std_srvs/srv/SetBool, /switch has a client of std_srvs/srv/Trigger",
    ),
    "call": (
        lambda ros: ros.call("/enable", Trigger.Request()),
        "/enable: /switch offers std_srvs/srv/SetBool, the test uses std_srvs/srv/Trigger",
    ),
    "simulation, publisher": (
        lambda ros: ros.simulate(Other(publishes={"/in": INT})),
        f"/in: the simulation publishes {INT}, /echo subscribes to {STRING}",
    ),
    "simulation, subscription": (
        lambda ros: ros.simulate(Other(hears={"/out": INT})),
        f"/out: the simulation hears {INT}, /echo publishes {STRING}",
    ),
    "simulation, service": (
        lambda ros: ros.simulate(Other(serves={"/allowed": "std_srvs/srv/SetBool"})),
        "/allowed: the simulation serves std_srvs/srv/SetBool, /switch has a client of std_srvs/srv/Trigger",
    ),
}


@pytest.mark.parametrize("before", [True, False], ids=["programs first", "test first"])
@pytest.mark.parametrize("name", MISMATCHES)
def test_what_never_arrives_is_an_error(ros: World, name: str, before: bool) -> None:
    """At once, or as soon as the program is there; it is told once, and the test may go on."""
    act, words = MISMATCHES[name]
    first, second = (start_both, act) if before or name == "call" else (act, start_both)
    first(ros)
    with pytest.raises(WrongType, match=re.escape(words)):
        second(ros)
    ros.advance(1.0)


def start_both(ros: World) -> None:
    ros.run("nodes/echo.py")
    ros.run("nodes/switch.py")


def test_a_simulation_keeps_no_message_for_who_comes_later(ros: World, write: Write) -> None:
    """A subscription that asks for kept messages never gets one of it."""
    text = (
        "import rclpy\nfrom rclpy.qos import QoSProfile, DurabilityPolicy\nfrom std_msgs.msg import Int32\n"
        "rclpy.init()\nnode = rclpy.create_node('late')\n"
        "qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)\n"
        "node.create_subscription(Int32, '/in', print, qos)\nrclpy.spin(node)\n"
    )
    ros.run(write(text))
    with pytest.raises(WrongType, match="/in: /late asks for transient_local, the simulation offers volatile"):
        ros.simulate(Other(publishes={"/in": INT}))


def test_one_subscription_that_fits_is_enough(ros: World, write: Write) -> None:
    """Another node may use the name with another type."""
    ros.run("nodes/echo.py")
    ros.run(
        write(
            "import rclpy\nfrom std_msgs.msg import Int32\nrclpy.init()\nnode = rclpy.create_node('other')\n"
            "node.create_subscription(Int32, '/in', print, 10)\nrclpy.spin(node)\n"
        )
    )
    ros.publish("/in", String(data="on"))
    ros.advance(1.0)
    assert [m.data for m in ros.messages("/out")] == ["on"]


def test_a_latched_message_reaches_a_program_that_comes_later(ros: World, write: Write) -> None:
    """The QoS of a publisher is the test's to choose."""
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    ros.publish("/map", String(data="kept"), qos=latched)
    ros.advance(1.0)
    text = (
        "import rclpy\nfrom rclpy.qos import QoSProfile, DurabilityPolicy\nfrom std_msgs.msg import String\n"
        "rclpy.init()\nnode = rclpy.create_node('late')\n"
        "qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)\n"
        "node.create_subscription(String, '/map', lambda m: print(m.data), qos)\nrclpy.spin(node)\n"
    )
    late = ros.run(write(text))
    ros.advance(1.0)
    assert late.output == "kept\n"


def test_the_graph_is_that_of_the_programs(ros: World) -> None:
    """Nodes, topics and services, without what the test itself offers and what every node has."""
    ros.publish("/in", String())
    ros.serve("/own", Trigger, lambda _: Trigger.Response())
    ros.run("nodes/echo.py")
    switch = ros.run("nodes/switch.py")
    assert ros.nodes() == ["/echo", "/switch"]
    assert ros.topics() == {
        "/count": "std_msgs/msg/Int32",
        "/in": "std_msgs/msg/String",
        "/out": "std_msgs/msg/String",
    }
    assert ros.services() == {"/enable": "std_srvs/srv/SetBool"}
    assert {(e.kind, e.topic, e.node) for e in ros.graph().endpoints} >= {("publisher", "/out", "/echo")}
    switch.interrupt()
    ros.advance(1.0)
    assert ros.nodes() == ["/echo"]


def test_two_worlds_do_not_hear_each_other(ros_session: Worlds) -> None:
    """Two may be open at the same time, each with its own nodes and its own time."""
    with ros_session.open(Path(__file__).parent) as one, ros_session.open(Path(__file__).parent) as other:
        one.run("nodes/echo.py")
        other.run("nodes/echo.py")
        one.publish("/in", String(data="one"))
        one.advance(1.0)
        other.advance(2.0)
        assert [m.data for m in one.messages("/out")] == ["one"]
        assert (other.messages("/out"), one.now, other.now) == ([], 1.0, 2.0)


def hears(ros: World) -> bool:
    """Return whether a program in a world answers."""
    ros.run("nodes/echo.py")
    ros.publish("/in", String(data="still here"))
    ros.settle()
    return [m.data for m in ros.messages("/out")] == ["still here"]


def kill_worker(ros: World) -> None:
    """Kill the worker of a world, with all that it has started, and wait until its end can be seen."""
    worker: Any = ros._run._worker
    os.killpg(worker._process.pid, signal.SIGKILL)
    select.select([worker._line], [], [])


def test_a_lost_worker_costs_one_world(ros_session: Worlds) -> None:
    """The next one has another worker, also if that was lost before."""
    here = Path(__file__).parent
    with ros_session.open(here) as ros:
        assert hears(ros)
        kill_worker(ros)
        with pytest.raises(HarnessError, match="worker: expected an answer, found none"):
            ros.advance(1.0)
        with pytest.raises(RuntimeError, match="the run has ended"):
            ros.advance(1.0)
    with ros_session.open(here) as ros:
        assert hears(ros)
    kill_worker(ros)
    with ros_session.open(here) as ros:
        assert hears(ros)


def test_control_c_in_the_middle_of_a_step_leaves_nothing_behind(ros_session: Worlds) -> None:
    """Nobody knows where the worker is then: it is ended, and the next world has another one."""

    def interrupted(request: Trigger.Request) -> Trigger.Response:
        raise KeyboardInterrupt

    here = Path(__file__).parent
    with ros_session.open(here) as ros:
        ros.run("nodes/switch.py")
        ros.serve("/allowed", Trigger, interrupted)
        with pytest.raises(KeyboardInterrupt):
            ros.call("/enable", SetBool.Request(data=True))
    with ros_session.open(here) as ros:
        assert hears(ros)


def test_rates_count_gaps(ros: World) -> None:
    """From the first to the last message, of all or of the last seconds; fewer than two have none."""
    ros.run("nodes/echo.py")
    assert ros.rate("/out") == 0.0
    ros.publish("/in", String(), rate=4)
    ros.advance(2.0)
    ros.publish("/in", String(), rate=8)
    ros.advance(2.0)
    assert ros.rate("/out", last=1.0) == pytest.approx(8)
    assert 4 < ros.rate("/out") < 8


def test_a_wrong_name_of_a_program_is_told(ros: World) -> None:
    """A file is compared with those that are there."""
    with pytest.raises(SubmissionError, match=r"ehco\.py: expected a file, found none") as wrong:
        ros.run("nodes/ehco.py")
    assert "looked in" in wrong.value.hint
    with pytest.raises(SubmissionError, match=r"obstacle/stop: expected an executable of a package, found none"):
        ros.run("obstacle/stop")


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        (("/in", String), TypeError, r"expected a message, found the class String; write String\(\)"),
        (("/in", "text"), TypeError, "expected a ROS message, found str"),
        (("/in", []), ValueError, "expected one message without a rate, found 0"),
    ],
)
def test_what_cannot_be_published_is_told(
    ros: World, arguments: tuple[object, ...], error: type[Exception], words: str
) -> None:
    """The message names the topic and what was expected."""
    with pytest.raises(error, match=words):
        ros.publish(*arguments)  # type: ignore[arg-type]
    with pytest.raises(ValueError, match="expected a rate above 0"):
        ros.publish("/in", Twist(), rate=0)
    with pytest.raises(ValueError, match="time does not go back"):
        ros.advance(-1.0)


WRONG_USES: list[tuple[Callable[[World], object], str]] = [
    (lambda ros: ros.publish("/a", Trigger.Request()), "/a: expected a ROS message, found Trigger_Request"),
    (lambda ros: ros.call("/a", String()), r"/a: expected a request such as Trigger\.Request\(\), found String"),
    (lambda ros: ros.call("/a", Trigger.Response()), "found Trigger_Response"),
    (lambda ros: ros.call("/a", Trigger.Request), "expected a request such as .*, found the class Trigger_Request"),
    (lambda ros: ros.call("/a", Trigger), "found the class Trigger"),
    (lambda ros: ros.call("/a", {"data": True}), "found dict"),
    (
        lambda ros: ros.send_goal("/a", Trigger.Request()),
        r"/a: expected a goal such as Fibonacci\.Goal\(\), found Trigger",
    ),
    (lambda ros: ros.send_goal("/a", Fibonacci.Result()), "found Fibonacci_Result"),
    (lambda ros: ros.serve("/a", String, lambda _: None), "expected the class of a ROS service, found String"),
    (lambda ros: ros.serve("/a", Fibonacci, lambda _: None), "expected the class of a ROS service, found Fibonacci"),
    (
        lambda ros: ros.serve("/on", SetBool, lambda _: None),
        "/on: expected std_srvs/srv/Trigger, as it is served already",
    ),
]


def test_a_wrong_use_is_told_and_leaves_the_world_usable(ros: World) -> None:
    """What is no message, request, goal or service is named, with what was expected."""
    ros.serve("/on", Trigger, lambda _: Trigger.Response())
    for use, words in WRONG_USES:
        with pytest.raises((TypeError, ValueError), match=words):
            use(ros)
    ros.run("nodes/echo.py")
    ros.publish("/in", String(data="on"))
    ros.settle()
    assert [m.data for m in ros.messages("/out")] == ["on"]


def test_requests_without_a_response_and_nodes_that_are_not_there_are_told(ros: World) -> None:
    """A timeout counts requests and responses; the service of a node is told by the node."""
    ros.run("nodes/switch.py")
    ros.run("nodes/echo.py")
    with pytest.raises(StepTimeout, match=r"meanwhile:\n  /enable: 1 request, no responses"):
        ros.call("/enable", SetBool.Request(data=True), timeout=1.0)
    with pytest.raises(StepTimeout, match=r"there is no node /ehco\n  hint: did you mean /echo\?"):
        ros.set_parameter("/ehco", "a", 1, timeout=1.0)


def test_a_type_that_is_not_installed_leaves_the_world_usable(ros: World) -> None:
    """What the worker refuses, it refuses without ending the run."""
    ros.run("nodes/echo.py")
    with pytest.raises((HarnessError, TypeError)):
        ros.serve("/x", String, lambda _: None)
    ros.publish("/in", String(data="on"))
    ros.advance(0.1)
    assert [m.data for m in ros.messages("/out")] == ["on"]


def test_a_log_may_be_waited_for_that_nobody_has_written(ros: World) -> None:
    """The last log of a silent program is awaited like the last message of a silent topic."""
    echo = ros.run("nodes/echo.py")
    with pytest.raises(StepTimeout, match=r"echo\.py has logged nothing"):
        ros.wait_until(lambda: echo.logs[-1].text == "done", timeout=0.1)


@pytest.mark.parametrize("seed", [None, 3])
def test_no_failure_at_the_start_is_missed(ros_session: Worlds, write: Write, seed: int | None) -> None:
    """With a seed, programs come up with the next step: at the end of a block, or of the test, at the latest."""
    bad = write("raise ValueError('at once')\n")
    with ros_session.open(seed=seed) as ros, ros.expects_failure("ValueError: at once") as failure:
        ros.run(bad)
    assert failure.program is not None
    with pytest.raises(ProgramFailed, match="ValueError: at once"), ros_session.open(seed=seed) as ros:
        ros.run(bad)
