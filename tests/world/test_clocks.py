"""What a test sees is the same on both clocks, as long as it asks for neither exact times nor an order."""

import re
import time
from collections.abc import Iterator, Mapping
from functools import partial
from itertools import pairwise
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from rclpy.qos import DurabilityPolicy, QoSProfile
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci
from tiers import more

from grader.api import Moment, Output, Simulation, open_world
from grader.runtime.model.trace import ClockKind
from grader.world.errors import ParameterRejected, ProgramFailed, StepTimeout
from grader.world.opening import Worlds
from grader.world.world import World

pytestmark = pytest.mark.ros

HERE = Path(__file__).parent
EXAMPLES = ROOT / "examples"
#: Long enough for the busiest machine; no test of this file that passes waits for it.
PATIENCE = 60.0


@pytest.fixture(params=["virtual", *more(["wall"])])
def clock(request: pytest.FixtureRequest) -> str:
    """The name of each clock."""
    return str(request.param)


@pytest.fixture
def ros(ros_session: Worlds, clock: str) -> Iterator[World]:
    """A world on each clock."""
    with ros_session.open(HERE, clock=clock) as world:
        yield world
    assert world.problem == ""


def test_messages_logs_and_the_graph(ros: World, clock: str) -> None:
    """A stream is answered message by message; the recording names its clock."""
    echo = ros.run("nodes/echo.py")
    assert (ros.nodes(), ros.topics()["/in"]) == (["/echo"], "std_msgs/msg/String")
    texts = [String(data=str(number)) for number in range(5)]
    ros.publish("/in", texts, rate=20)
    ros.wait_until(lambda: ros.messages("/out")[5], timeout=PATIENCE)
    assert [m.data for m in ros.messages("/out")][:6] == ["0", "1", "2", "3", "4", "4"]
    assert [log.text for log in echo.logs][:3] == ["heard 0", "heard 1", "heard 2"]
    times = [one.t for one in ros.received("/out")]
    assert times == sorted(times)
    ros.stop_publishing("/in")
    ros.settle()
    before = len(ros.messages("/out"))
    ros.advance(0.2)
    assert len(ros.messages("/out")) == before
    assert ros.trace().clock is ClockKind(clock)


def test_time_passes(ros: World) -> None:
    """Also where nothing runs; on the wall clock it passes for the test as well."""
    began = time.monotonic()
    before = ros.now
    ros.advance(0.3)
    assert ros.now - before >= 0.3
    assert ros.trace().clock is ClockKind.VIRTUAL or time.monotonic() - began >= 0.3
    with pytest.raises(StepTimeout, match="the condition did not hold"):
        ros.wait_until(lambda: ros.messages("/nothing"), timeout=0.3)
    assert ros.now - before >= 0.6


def test_services_and_parameters(ros: World) -> None:
    """The test serves what the node asks, calls what it offers, and sets its parameter."""
    asked = []

    def allow(request: Trigger.Request) -> Trigger.Response:
        asked.append(request)
        return Trigger.Response(success=True, message="you may")

    ros.run("nodes/switch.py")
    ros.serve("/allowed", Trigger, allow)
    assert ros.call("/enable", SetBool.Request(data=True), timeout=PATIENCE).message == "you may"
    assert len(asked) == 1
    ros.set_parameter("/switch", "step", 100, timeout=PATIENCE)
    ros.wait_until(lambda: ros.messages("/count")[-1].data > 200, timeout=PATIENCE)
    counts = [m.data for m in ros.messages("/count")]
    assert {after - before for before, after in pairwise(counts)} <= {1, 100}
    with pytest.raises(ParameterRejected):
        ros.set_parameter("/switch", "stpe", 1, timeout=PATIENCE)


def test_a_failure_and_ends(ros: World) -> None:
    """An exception fails the next step; Ctrl-C and a kill end a program."""
    ros.run("nodes/echo.py")
    ros.publish("/in", String(data="fail"))
    with pytest.raises(ProgramFailed, match="ValueError: asked to fail"):
        ros.wait_until(lambda: None, timeout=PATIENCE)
    robot = ros.run("nodes/obstacle_stop.py")
    robot.interrupt()
    assert (robot.running, robot.exit_code) == (False, 0)
    other = ros.run("nodes/obstacle_stop.py")
    other.kill()
    assert (other.running, other.exit_code) == (False, 128 + 9)


def test_a_latched_message_and_qos(ros: World, tmp_path: Path) -> None:
    """A message waits for a program that comes later, which reports what it hears."""
    latched = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)
    ros.publish("/map", String(data="kept"), qos=latched)
    (tmp_path / "late.py").write_text(
        "import rclpy\nfrom rclpy.qos import QoSProfile, DurabilityPolicy\nfrom std_msgs.msg import String\n"
        "rclpy.init()\nnode = rclpy.create_node('late')\n"
        "qos = QoSProfile(depth=1, durability=DurabilityPolicy.TRANSIENT_LOCAL)\n"
        "node.create_subscription(String, '/map', lambda m: print(m.data), qos)\nrclpy.spin(node)\n",
        encoding="utf-8",
    )
    late = ros.run(str(tmp_path / "late.py"))
    ros.wait_until(lambda: late.output == "kept\n", timeout=PATIENCE)


def test_what_does_not_fit_is_told(ros: World) -> None:
    """A slip in a name is explained, with a hint."""
    ros.run("nodes/echo.py")
    ros.publish("/on", String(), rate=10)
    with pytest.raises(StepTimeout, match="/echo listens to /in, where nobody publishes"):
        ros.wait_until(lambda: ros.messages("/out"), timeout=0.3)


class Counter(Simulation):
    """Publishes how often it was stepped, and remembers what it heard of it."""

    period = 20_000_000

    def __init__(self) -> None:
        self.steps = 0
        self.heard: list[int] = []

    def publishes(self) -> dict[str, str]:
        """Return its topic."""
        return {"/in": "std_msgs/msg/String"}

    def hears(self) -> dict[str, str]:
        """Return what it hears."""
        return {"/out": "std_msgs/msg/String"}

    def step(self, now: Moment) -> list[Output]:
        """Count."""
        self.steps += 1
        return [("/in", {"data": str(self.steps)})]

    def on_message(self, now: Moment, topic: str, message: Mapping[str, Any]) -> list[Output]:
        """Remember."""
        self.heard.append(int(message["data"]))
        return []


def test_a_simulation_takes_part(ros: World) -> None:
    """What it publishes is answered, in its order."""
    ros.run("nodes/echo.py")
    counter = ros.simulate(Counter())
    ros.wait_until(lambda: len(counter.heard) >= 5, timeout=PATIENCE)  # type: ignore[attr-defined]
    heard = counter.heard  # type: ignore[attr-defined]
    assert heard == [*range(heard[0], heard[0] + len(heard))]


def test_an_action(ros: World, tmp_path: Path) -> None:
    """A goal has feedback and a result."""
    text = (EXAMPLES / "fibonacci/reference/fibonacci_server.py").read_text(encoding="utf-8")
    text = text.replace("example_interfaces.action", "test_msgs.action").replace("0.5", "0.05")
    server = tmp_path / "fibonacci_server.py"
    server.write_text(text, encoding="utf-8")
    ros.run(server)
    outcome = ros.send_goal("/fibonacci", Fibonacci.Goal(order=4), timeout=PATIENCE)
    assert (outcome.accepted, outcome.status, list(outcome.result.sequence)) == (True, 4, [0, 1, 1, 2, 3])
    assert len(outcome.feedback) == 3
    with pytest.raises(StepTimeout, match="nobody offers the action /fibonaci"):
        ros.send_goal("/fibonaci", Fibonacci.Goal(order=4), timeout=0.1)
    if ros.trace().clock is ClockKind.WALL:  # it knows the server from the graph, not from the program
        with pytest.raises(StepTimeout, match=r"it has (not answered|accepted) the goal"):
            ros.send_goal("/fibonacci", Fibonacci.Goal(order=600), timeout=0.1)


def has_come(ros: World, text: str) -> bool:
    """Return whether a text has been heard on /out."""
    return any(message.data == text for message in ros.messages("/out"))


def test_losses_and_delays(ros_session: Worlds, clock: str) -> None:
    """No message arrives before its delay is over, or at all if it is lost; the draws follow from the seed."""
    heard = []
    for _ in range(2):
        options = {"delay": {"/in": (0.05, 0.1)}, "lose": {"/in": 0.5}}
        with ros_session.open(HERE, clock=clock, seed=5, **options) as ros:  # type: ignore[arg-type]
            ros.run("nodes/echo.py")
            began = ros.now
            ros.publish("/in", [String(data=str(number)) for number in range(20)], rate=100)
            ros.wait_until(partial(has_come, ros, "19"), timeout=PATIENCE)
            assert ros.received("/out")[0].t - began >= 0.05
            numbers = [int(m.data) for m in ros.messages("/out")]
            heard.append([number for number in numbers if number < 19])
    assert heard[0] == heard[1]
    assert 0 < len(heard[0]) < 19
    assert heard[0] == sorted(set(heard[0]))


def test_what_a_simulation_sends_is_lost_as_well(ros_session: Worlds, clock: str) -> None:
    """It is on its way like what the test itself publishes."""
    with ros_session.open(HERE, clock=clock, lose={"in": 1.0}) as ros:
        ros.run("nodes/echo.py")
        counter = ros.simulate(Counter())
        ros.advance(0.2)
        assert counter.steps > 0  # type: ignore[attr-defined]
        assert ros.messages("/out") == []


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"lose": {"in": 1.5}}, "lose: /in: expected a share from 0 to 1, found 1.5"),
        ({"lose": {"/in": -1}}, "lose: /in: expected a share from 0 to 1, found -1"),
        ({"lose": {"/in": "all"}}, "lose: /in: expected a share from 0 to 1, found 'all'"),
        ({"delay": {"/in": (0.2, 0.1)}}, "delay: /in: expected the least and the most seconds, found (0.2, 0.1)"),
        ({"delay": {"/in": (-0.1, 0.1)}}, "delay: /in: expected the least and the most seconds, found (-0.1, 0.1)"),
        ({"delay": {"/in": 0.1}}, "delay: /in: expected the least and the most seconds, found 0.1"),
        ({"delay": {"/in": ("a", "b")}}, "delay: /in: expected the least and the most seconds, found ('a', 'b')"),
    ],
)
def test_an_absurd_connection_is_told(ros_session: Worlds, options: dict[str, object], words: str) -> None:
    """With the topic and what was expected."""
    with pytest.raises(ValueError, match=re.escape(words)), ros_session.open(HERE, **options):  # type: ignore[arg-type]
        pass


def test_a_clock_that_is_not_there(ros_session: Worlds) -> None:
    """It is told by name."""
    with (
        pytest.raises(ValueError, match="clock: expected virtual or wall, found 'real'"),
        ros_session.open(clock="real"),
    ):
        pass


def test_programs_run_on_between_two_calls() -> None:
    """On the wall clock a loop of the test's own sees what they do."""
    with open_world(HERE, clock="wall") as ros:
        ros.run("nodes/echo.py")
        ros.publish("/in", String(data="a"), rate=50)
        deadline = time.monotonic() + PATIENCE
        while len(ros.messages("/out")) < 3 and time.monotonic() < deadline:
            pass
        assert len(ros.messages("/out")) >= 3
