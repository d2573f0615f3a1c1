"""What goes on while a test lets time pass: calls, goals, restarts, recordings; with real nodes."""

import math
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import Int32
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci

from grader.runtime.model.errors import RecordingError, SubmissionError
from grader.runtime.served_actions import GoalAborted, GoalRejected
from grader.world.errors import ProgramFailed, StepTimeout
from grader.world.opening import Worlds
from grader.world.started import Program
from grader.world.world import World

pytestmark = pytest.mark.ros

Write = Callable[..., str]
HEAD = """
import time
import rclpy
from rclpy.action import ActionClient, ActionServer, CancelResponse
from std_msgs.msg import Int32, String
from std_srvs.srv import SetBool, Trigger
from test_msgs.action import Fibonacci

rclpy.init()
node = rclpy.create_node("node")
say = node.get_logger().info
"""
SLOW = """
def answer(request, response):
    time.sleep(2.0)
    response.success = True
    return response

node.create_service(Trigger, "/slow", answer)
"""
TICKING = """
counts = node.create_publisher(Int32, "/count", 10)
looks, slowly = node.create_client(Trigger, "/look"), ActionClient(node, Fibonacci, "/slowly")

def tick():
    counts.publish(Int32())
    looks.call_async(Trigger.Request())
    slowly.send_goal_async(Fibonacci.Goal())

node.create_timer(1.0, tick)
rclpy.spin(node)
"""
COUNTING = """
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor

def execute(goal):
    for number in range(goal.request.order):
        if goal.is_cancel_requested:
            goal.canceled()
            return Fibonacci.Result(sequence=[number])
        goal.publish_feedback(Fibonacci.Feedback(sequence=[number]))
        time.sleep(1.0)
    goal.succeed()
    return Fibonacci.Result()

group = ReentrantCallbackGroup()
server = ActionServer(node, Fibonacci, "/count", execute, callback_group=group,
                      cancel_callback=lambda _: CancelResponse.ACCEPT)
rclpy.spin(node, MultiThreadedExecutor(4))
"""


@pytest.fixture
def write(tmp_path: Path) -> Write:
    """Write a program with a node, and return its path."""

    def written(text: str, name: str = "node.py") -> str:
        path = tmp_path / name
        path.write_text(f"{HEAD}{text}\nrclpy.spin(node)\n", encoding="utf-8")
        return str(path)

    return written


def test_a_call_goes_on_while_the_test_does_something_else(ros: World, write: Write) -> None:
    """Its response is there when the server has given it; who waits for one that never comes is told why."""
    ros.run(write(SLOW))
    call = ros.call_async("/slow", Trigger.Request())
    assert (call.done, call.response) == (False, None)
    ros.advance(1.999)
    assert not call.done
    ros.advance(0.001)
    assert (call.done, call.response.success, call.service) == (True, True, "/slow")
    assert ros.call_async("/slow", Trigger.Request()).wait(timeout=5.0).success
    assert ros.now == 4.0
    with pytest.raises(StepTimeout, match="nobody offers /missing"):
        ros.call_async("/missing", Trigger.Request()).wait(timeout=1.0)


def test_goals_go_on_beside_each_other_and_are_cancelled(ros: World, write: Write) -> None:
    """Two goals at once, of which one is cancelled when the test wants it."""
    ros.run(write(COUNTING))
    first, second = (ros.send_goal_async("/count", Fibonacci.Goal(order=order)) for order in (9, 3))
    assert first.accepted is None
    ros.advance(1.5)
    assert (first.accepted, first.done, first.outcome) == (True, False, None)
    assert [[list(one.message.sequence) for one in goal.feedback] for goal in (first, second)] == [[[0], [1]]] * 2
    first.cancel()
    ros.advance(0.5)
    assert first.outcome is not None
    assert (first.outcome.status, list(first.outcome.result.sequence)) == (5, [2])
    assert (second.wait().status, ros.now) == (4, 3.0)


def test_a_line_of_a_log_is_waited_for(ros: World, write: Write) -> None:
    """What is there already counts; the time-out names the program, and says what came instead."""
    texts = 'node.create_timer(1.0, lambda: say("tick"))\nprint("begun", flush=True)'
    program = ros.run(write(texts))
    assert ros.wait_for_log("^beg", 1.0).text == "begun"
    assert (ros.wait_for_log("tick", 2.0, program=program).t_ns, ros.now) == (1_000_000_000, 1.0)
    with pytest.raises(StepTimeout, match=r"node\.py has not logged or written 'tock'"):
        ros.wait_for_log("tock", 2.0, program=program)


def test_a_program_is_started_again_as_it_was_started(ros: World, write: Write) -> None:
    """With its parameters, whether it was stopped, was killed, or has ended."""
    program = write('say(str(node.declare_parameter("n", 0).value))\nnode.create_timer(3.0, lambda: 1 / 0)')
    first = ros.run(program, parameters={"n": 7})
    second = ros.restart(first)
    second.kill()
    third = ros.restart(second)
    assert [log.text for one in (first, second, third) for log in one.logs] == ["7"] * 3
    assert ([one.running for one in ros.programs], third.name) == ([False, False, True], "node.py (3)")
    assert first.exit_code == 130


def test_parameter_files_lie_beside_the_test(ros_session: Worlds, write: Write, tmp_path: Path) -> None:
    """Several, and values beside them: what comes last counts."""
    names = ("a", "b", "c.d")
    declared = 'node.declare_parameters("", [("a", 0), ("b", 0), ("c.d", 0.0)])\n'
    write(f"{declared}say(str([node.get_parameter(n).value for n in {names}]))")
    (tmp_path / "one.yaml").write_text("node:\n  ros__parameters: {a: 1, b: 1, c: {d: 1.5}}\n")
    with ros_session.open(tmp_path) as ros:
        programs = [
            ros.run("node.py", parameters="one.yaml"),
            ros.run("node.py", parameters=[Path("one.yaml"), {"b": 2, "c.d": 2.0}]),
            ros.run("node.py", parameters=[{"b": 2}, "one.yaml"]),
            ros.run("node.py", parameters=[{"b": 2}, {"a": 3}]),
        ]
        said = [program.logs[-1].text for program in programs]
        assert said == ["[1, 1, 1.5]", "[1, 2, 2.0]", "[1, 1, 1.5]", "[3, 2, 0.0]"]
        with pytest.raises(SubmissionError, match=r"two\.yaml: expected a parameter file, found none"):
            ros.run("node.py", parameters="two.yaml")
        (tmp_path / "two.yaml").write_text("node:\n  a: 1\n")
        with pytest.raises(ProgramFailed, match=r"/two\.yaml'\. Error: .* at line 2,"):
            ros.run("node.py", parameters="two.yaml")
    with ros_session.open(tmp_path) as ros:
        ros.run("node.py", parameters=["one.yaml", {"ab": 1}])
        told = [text.partition(";")[0] for text in ros.remarks]
        assert told == ["node.py: the parameter ab was given, but no node of it declares that"]


def test_a_recording_is_played(ros_session: Worlds, write: Write, tmp_path: Path) -> None:
    """With the times between its messages, all topics or some, faster if need be; a topic that it lacks is an error."""
    write(
        'one, two = (node.create_publisher(Int32, t, 10) for t in ("/one", "/two"))\n'
        "node.create_timer(1.0, lambda: one.publish(Int32(data=1)))\n"
        "node.create_timer(1.5, lambda: two.publish(Int32(data=2)))",
        "talker.py",
    )
    write(
        'for t in ("/one", "/two"):\n    node.create_subscription(Int32, t, lambda m: say(str(m.data)), 10)',
        "listener.py",
    )
    with ros_session.open(tmp_path) as ros:
        ros.run("talker.py")
        ros.advance(3.5)
        ros.keep(tmp_path / "kept")
    with ros_session.open(tmp_path) as ros:
        listener = ros.run("listener.py")
        assert ros.play("kept/recording.mcap") == 2.0
        ros.advance(3.0)
        heard = [(log.t_ns / 1e9, log.text) for log in listener.logs]
        assert heard == [(0.0, "1"), (0.5, "2"), (1.0, "1"), (2.0, "1"), (2.0, "2")]
        assert ros.play("kept/recording.mcap", topics=["two"], rate=2.0) == 0.75
        ros.advance(1.0)
        assert [(log.t_ns / 1e9, log.text) for log in listener.logs][5:] == [(3.0, "2"), (3.75, "2")]
        with pytest.raises(RecordingError, match="expected the topic /on, found none"):
            ros.play("kept/recording.mcap", topics=["/on"])
        with pytest.raises(TypeError, match=r"play: expected a list of topics, such as \['/one'\], found '/one'"):
            ros.play("kept/recording.mcap", topics="/one")
        with pytest.raises(RecordingError, match="expected messages to play, found none"):
            ros.play("kept/recording.mcap", topics=[])
        for rate in (0, -1.0, math.nan, math.inf, "2"):
            with pytest.raises(ValueError, match="play: expected a rate above 0, found"):
                ros.play("kept/recording.mcap", rate=rate)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("use", "error", "says"),
    [
        (lambda ros: ros.advance(math.nan), ValueError, "advance: expected a number of seconds, found nan"),
        (lambda ros: ros.advance("1"), ValueError, "advance: expected a number of seconds, found '1'"),
        (lambda ros: ros.wait_until(bool, math.inf), ValueError, "timeout: expected a number of seconds, found inf"),
        (lambda ros: ros.publish("/a", Int32(), rate=math.nan), ValueError, "/a: expected a rate above 0, found nan"),
        (lambda ros: ros.publish("/a", Int32(), qos=10), TypeError, "qos: expected a QoSProfile, found 10"),
        (lambda ros: ros.restart("node.py"), TypeError, "expected what run or launch has returned, found 'node.py'"),
        (
            lambda ros: ros.wait_for_log("ready", 1.0, program="node.py"),
            TypeError,
            "expected what run or launch has returned, found 'node.py'",
        ),
        (
            lambda ros: ros.wait_for_log("speed (", 1.0),
            ValueError,
            r"expected a regular expression, found 'speed \(' \(.*\); re.escape takes a text as it is",
        ),
        (
            lambda ros: ros.call("/mine", Trigger.Request(), timeout=1.0),
            StepTimeout,
            "no program offers /mine, only the test does",
        ),
        (
            lambda ros: ros.send_goal("/ours", Fibonacci.Goal(), timeout=1.0),
            StepTimeout,
            "no program offers the action /ours, only the test does",
        ),
    ],
)
def test_what_makes_no_sense_is_told(
    ros: World, use: Callable[[World], Any], error: type[Exception], says: str
) -> None:
    """With what was expected; what is said of a service is true."""
    ros.serve("/mine", Trigger, lambda _: Trigger.Response())
    ros.serve_action("/ours", Fibonacci, [])
    with pytest.raises(error, match=says) as told:
        use(ros)
    assert told.value.__context__ is None


ASKING = """
from action_msgs.msg import GoalStatus

names = {getattr(GoalStatus, name): name[7:] for name in dir(GoalStatus) if name.startswith("STATUS_")}
client = ActionClient(node, Fibonacci, "/count")
handles = []

def accepted(future):
    handle = future.result()
    handles.append(handle)
    say(f"accepted {handle.accepted}")
    if handle.accepted:
        handle.get_result_async().add_done_callback(ended)

def ended(future):
    say(f"{names[future.result().status]} {list(future.result().result.sequence)}")

def send(order):
    goal = Fibonacci.Goal(order=order)
    client.send_goal_async(goal, lambda m: say(f"heard {list(m.feedback.sequence)}")).add_done_callback(accepted)

def ask(message):
    if message.data < 0:
        handles[-1].cancel_goal_async().add_done_callback(lambda f: say(f"cancels {len(f.result().goals_canceling)}"))
    else:
        send(message.data)

client.wait_for_server()
node.create_subscription(Int32, "/ask", ask, 10)
"""


def said(program: Program) -> list[tuple[float, str]]:
    """Return what a program has logged, with the seconds."""
    return [(log.t_ns / 1e9, log.text) for log in program.logs]


def answered(goal: Any) -> Any:
    """Count to the order of a goal, half a second for each number; refuse 0, abort at 5."""
    if goal.order == 0:
        raise GoalRejected
    for number in range(goal.order):
        yield Fibonacci.Feedback(sequence=[number])
        yield 0.5
        if number == 4:
            raise GoalAborted(Fibonacci.Result(sequence=[number]))
    return Fibonacci.Result(sequence=[goal.order])


def test_an_action_is_served_by_a_function(ros: World, write: Write) -> None:
    """It accepts, refuses, gives feedback and results, aborts and cancels. rclpy takes feedback before responses."""
    ros.serve_action("/count", Fibonacci, answered)
    asking = ros.run(write(ASKING))
    for order in (2, 0, 9):
        ros.publish("/ask", Int32(data=order))
        ros.advance(1.0)
    ros.advance(2.0)
    first = [(0.0, "heard [0]"), (0.0, "accepted True"), (0.5, "heard [1]"), (1.0, "SUCCEEDED [2]")]
    heard = [(2.0 + n / 2, f"heard [{n}]") for n in range(5)]
    third = [heard[0], (2.0, "accepted True"), *heard[1:], (4.5, "ABORTED [4]")]
    assert said(asking) == [*first, (1.0, "accepted False"), *third]
    ros.publish("/ask", Int32(data=4))
    ros.advance(0.7)
    ros.publish("/ask", Int32(data=-1))
    ros.advance(2.0)
    cancelled = [(5.7, "CANCELED []"), (5.7, "cancels 1")]  # the two responses come in either order
    begun = [(5.0, "heard [0]"), (5.0, "accepted True"), (5.5, "heard [1]")]
    then = said(asking)[len(first) + 1 + len(third) :]
    assert (then[:3], sorted(then[3:])) == (begun, cancelled)


def test_who_answers_sees_what_has_happened_by_then(ros: World, write: Write) -> None:
    """The functions of a service and of an action are called in the middle of a step, and look at that moment."""
    seen: list[tuple[float, int]] = []

    def look() -> None:
        seen.append((ros.now, len(ros.messages("/count"))))

    def trigger(request: Trigger.Request) -> Trigger.Response:
        del request
        look()
        return Trigger.Response()

    def slowly(goal: Fibonacci.Goal) -> Iterator[float]:
        del goal
        yield 0.5
        look()

    ros.serve("/look", Trigger, trigger)
    ros.serve_action("/slowly", Fibonacci, slowly)
    ros.run(write(TICKING))
    ros.advance(3.1)
    assert seen == [(1.0, 1), (1.5, 1), (2.0, 2), (2.5, 2), (3.0, 3)]
    assert [one.t for one in ros.received("/count")] == [1.0, 2.0, 3.0]


def test_an_action_is_served_by_a_list_of_steps(ros: World, write: Write) -> None:
    """Each goal goes through it, two of them beside each other; another list replaces it."""
    ros.serve_action("/count", Fibonacci, [1.0, Fibonacci.Feedback(sequence=[7]), 1.0, Fibonacci.Result(sequence=[8])])
    asking = ros.run(write(ASKING))
    ros.publish("/ask", Int32(data=1))
    ros.advance(0.5)
    ros.publish("/ask", Int32(data=1))
    ros.advance(3.0)
    ends = [(2.0, "SUCCEEDED [8]"), (2.5, "SUCCEEDED [8]")]
    assert said(asking) == [
        *((0.0, "accepted True"), (0.5, "accepted True"), (1.0, "heard [7]"), (1.5, "heard [7]")),
        *ends,
    ]
    ros.serve_action("/count", Fibonacci, [GoalRejected()])
    ros.publish("/ask", Int32(data=1))
    ros.settle()
    assert said(asking)[-1] == (3.5, "accepted False")
    ros.serve_action("/count", Fibonacci, ["wrong"])
    ros.publish("/ask", Int32(data=1))
    with pytest.raises(
        TypeError, match="/count: expected seconds, or a test_msgs/action/Fibonacci feedback, as a step"
    ):
        ros.settle()
