"""What stands in a program in place of functions of Python and rclpy looks and fails as these do."""

import subprocess
import sys
import textwrap
from collections.abc import Callable
from pathlib import Path

import pytest
from hostile import printed
from tiers import more

from grader.runtime.model.trace import AssessedTrace, Fault, FaultKind
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import record

from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

CLOCKS = pytest.mark.parametrize("clock", ["virtual", *more(["wall"])])
#: Prints which functions of a program's usual modules cannot be pickled, as `multiprocessing` has to.
PICKLING = """
import importlib, pickle
for name in "time select signal os socket queue random selectors".split():
    module = importlib.import_module(name)
    for each, value in sorted(vars(module).items()):
        try:
            callable(value) and pickle.dumps(value)
        except Exception:
            print(name, each, flush=True)
print("all tried", flush=True)
"""
#: Calls the methods of rclpy's classes for what is no instance of them, and prints how that ends.
UNBOUND = """
import inspect, threading
import rclpy, rclpy.action, rclpy.guard_condition, rclpy.timer
rclpy.init()
classes = [rclpy.node.Node, rclpy.publisher.Publisher, rclpy.subscription.Subscription, rclpy.client.Client]
classes += [rclpy.service.Service, rclpy.timer.Timer, rclpy.timer.Rate, rclpy.executors.Executor]
classes += [rclpy.executors.SingleThreadedExecutor, rclpy.executors.MultiThreadedExecutor, rclpy.task.Future]
classes += [rclpy.context.Context, rclpy.action.ActionClient, rclpy.action.ActionServer]
classes += [rclpy.guard_condition.GuardCondition]
for cls in classes:
    for name in sorted(dir(cls)):
        function = getattr(cls, name)
        if not inspect.isfunction(function) or name.startswith("_") and name != "__init__":
            continue
        for arguments in ((), ("talker",), ("talker", "y", "z")):
            try:
                said = type(function(*arguments)).__name__
            except Exception as error:
                said = f"{type(error).__name__}: {error}"
            print(cls.__name__, name, len(arguments), said[:300], flush=True)
print("all tried", flush=True)
"""


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    tmp_path.chmod(0o755)

    def run_one(program: str, clock: str = "virtual") -> AssessedTrace:
        trace = record(session, tmp_path / "s", textwrap.dedent(program), clock=clock, duration_ns=4 * NS_PER_S)
        assert trace.harness_problem == ""
        return trace

    return run_one


def plainly(program: str) -> list[str]:
    """What a program prints without the grader."""
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    return done.stdout.splitlines()


@pytest.mark.long
@CLOCKS
def test_what_is_replaced_can_be_pickled_as_before(run: Callable[..., AssessedTrace], clock: str) -> None:
    """A program may hand `time.sleep` to another process."""
    found = printed(run(PICKLING, clock))
    assert set(found) <= set(plainly(PICKLING))
    assert found[-1] == "all tried"


@CLOCKS
def test_a_method_without_its_object_fails_as_before(run: Callable[..., AssessedTrace], clock: str) -> None:
    """A program may call `Node.__init__("talker")` where it means `super()`."""
    assert printed(run(UNBOUND, clock)) == plainly(UNBOUND)


def test_such_a_program_is_at_fault_itself(run: Callable[..., AssessedTrace]) -> None:
    """Nothing in it counts as a fault of the grader."""
    fault = run("from rclpy.node import Node\nNode.__init__('talker')").of(Fault)[0]
    assert fault.kind is FaultKind.EXCEPTION
    assert "missing 1 required positional argument: 'node_name'" in fault.text


#: Takes messages in place of their classes, which rclpy accepts where nothing is sent.
INSTANCES = """
import time, rclpy
from rclpy.node import Node
from std_msgs.msg import String
rclpy.init()
node = Node("taking")
node.create_subscription(String(), "/word", lambda m: print("got", m.data, flush=True), 10)
wrong, right = (node.create_publisher(kind, "/word", 10) for kind in (String(), String))
try:
    wrong.publish(String(data="wrong"))
except TypeError as error:
    print(str(error)[:21], flush=True)
time.sleep(0.5)
right.publish(String(data="right"))
rclpy.spin_once(node, timeout_sec=1.0)
"""


@CLOCKS
def test_a_message_in_place_of_its_class_serves_as_before(run: Callable[..., AssessedTrace], clock: str) -> None:
    """To subscribe, not to publish."""
    trace = run(INSTANCES, clock)
    assert printed(trace) == plainly(INSTANCES)
    assert [message.value["data"] for message in trace.messages("/word")] == ["right"]
