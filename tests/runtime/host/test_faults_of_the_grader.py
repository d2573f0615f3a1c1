"""Whose an exception is: the program's own, or that of the grader's code in its process."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import record
from tiers import each

from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession

pytestmark = pytest.mark.ros

S = 1_000_000_000
Run = Callable[..., AssessedTrace]

#: Statements that raise, for the body of a callback, with what the program reads of it. Each ends in a function that
#: the grader puts in place of one of rclpy or of the standard library.
MISTAKES = {
    "time.sleep(-1)": "ValueError: sleep length must be non-negative",
    "time.sleep('1')": "TypeError: 'str' object cannot be interpreted as an integer",
    "threading.Lock().release()": "RuntimeError: release unlocked lock",
    "threading.Lock().acquire(timeout='x')": "TypeError",
    "threading.Lock().acquire(False, 1)": "ValueError: can't specify a timeout for a non-blocking call",
    "threading.Event().wait('x')": "TypeError",
    "queue.Queue().get(timeout=-1)": "ValueError: 'timeout' must be a non-negative number",
    "queue.Queue().get_nowait()": "_queue.Empty",
    "t = threading.Thread(target=print); t.start(); t.start()": "RuntimeError: threads can only be started once",
    "threading.current_thread().join()": "RuntimeError: cannot join current thread",
    "self.out.publish('hello')": "TypeError",
    "self.out.publish()": "TypeError",
    "self.destroy_publisher(self.out); self.out.publish(Twist())": "rclpy._rclpy_pybind11.InvalidHandle",
    "self.create_publisher(int, 'x', 10)": "AttributeError",
    "self.create_publisher(Twist)": "TypeError",
    "self.create_publisher(Twist, 'a b', 10)": "rclpy.exceptions.InvalidTopicNameException",
    "self.create_subscription(Twist, 'x', None, -1)": "ValueError",
    "self.create_timer('soon', print)": "ValueError",
    "self.create_client(Twist, 'x')": "RuntimeError: The service type provided is not valid",
    "self.create_client(Trigger, 'x').call_async(None)": "TypeError",
    "self.declare_parameter('a', 1); self.declare_parameter('a', 1)": "rclpy.exceptions.ParameterAlreadyDeclaredE",
    "self.get_clock().sleep_until(5)": "AttributeError",
    "self.get_clock().sleep_for(5)": "TypeError: unsupported operand type(s) for +: 'Time' and 'int'",
    "rclpy.clock.Clock(clock_type=7)": "TypeError: Clock type must be a ClockType enum",
    "self.count_publishers(None)": "rclpy._rclpy_pybind11.RCLError",
    "self.get_publishers_info_by_topic(5)": "",
    "os.kill(None, 0)": "TypeError",
    "os.listdir(3.5)": "TypeError",
    "pwd.getpwuid(54321)": "KeyError: 'getpwuid(): uid not found: 54321'",
    "pwd.getpwuid('x')": "TypeError",
    "socket.gethostbyname(5)": "TypeError",
    "importlib.import_module('no_such_module')": "ModuleNotFoundError: No module named 'no_such_module'",
    "class Half(rclpy.publisher.Publisher):\n    def __init__(self): pass\nHalf().publish(Twist())": "AttributeError",
    "time.sleep.seconds": "AttributeError: 'builtin_function_or_method' object has no attribute 'seconds'",
    "time.sleep.seconds = 1": "AttributeError: 'builtin_function_or_method' object has no attribute 'seconds'",
    "threading.Lock().release(1)": "TypeError",
    "threading.RLock().owner": "AttributeError",
    "queue.SimpleQueue().size()": "AttributeError",
    "queue.SimpleQueue().get(timeout='x')": "TypeError",
    "raise KeyError('mine')": "KeyError: 'mine'",
}
#: Raises each of the mistakes, and prints whose it is.
RAISING = """
import importlib, json, os, pwd, queue, socket, sys, threading, time
import rclpy, rclpy.clock
from geometry_msgs.msg import Twist
from rclpy.node import Node
from std_srvs.srv import Trigger
rclpy.init()
faults = sys.modules["_grader_host.faults"]
inside = lambda file: file == __file__
found = []
self = Node("driver")
for number, mistake in enumerate({mistakes!r}):
    if "self.out" in mistake:
        self.out = self.create_publisher(Twist, f"/out_{{number}}", 10)
    try:
        exec(compile(mistake, __file__, "exec"), {{**globals(), "self": self}})
        found.append(["nothing was raised", None])
    except Exception as error:
        found.append([faults.Describer().one_line(error), faults.graders_place(error, inside)])
text = json.dumps(found)
for begin in range(0, len(text), 1000):
    print(text[begin : begin + 1000])
"""
#: Breaks something that only the grader's code uses, as a mistake in that code would.
BREAKING = """
import sys
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
sys.modules["_grader_host.{module}"].{name} = {value}
rclpy.init()
node = Node("driver")
out = node.create_publisher(Twist, "/cmd_vel", 10)
node.create_timer(0.05, lambda: out.publish(Twist()))
rclpy.spin(node)
"""


@pytest.fixture
def run(one_worker: RecordingSession, tmp_path: Path) -> Run:
    def run_one(source: str, **fields: Any) -> AssessedTrace:
        return record(one_worker, tmp_path / "s", source, duration_ns=S, **fields)

    tmp_path.chmod(0o755)
    return run_one


def test_what_a_replaced_function_raises_is_the_program_s(run: Run) -> None:
    """A wrong argument, a destroyed handle, an empty queue: the same exception as without the grader."""
    trace = run(RAISING.format(mistakes=list(MISTAKES)))
    text = "".join(line.text for line in trace.lines() if line.stream == "stdout")
    assert text, trace.faults()
    for (mistake, expected), (raised, place) in zip(MISTAKES.items(), json.loads(text), strict=True):
        assert raised.startswith(expected), mistake
        assert raised != "nothing was raised", mistake
        assert place is None, (mistake, place)


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize(
    ("module", "name", "value", "where"),
    each(
        [
            ("endpoints", "BACKGROUND_PARAMETERS", "None", "endpoints.py"),  # TypeError: not iterable
            ("endpoints", "BACKGROUND_SERVICES", "5", "endpoints.py"),
            ("endpoints", "is_background", "lambda: None", "endpoints.py"),
            ("traffic", "BACKGROUND", "5", "traffic.py"),
            ("outbox", "MESSAGES_PER_FLUSH", "None", "outbox.py"),
            ("virtual", "MOST_MOVES", "{}", "virtual.py"),
        ],
        5,
    ),
)
def test_an_exception_of_the_grader_s_own_code_is_undecided(
    run: Run, module: str, name: str, value: str, where: str
) -> None:
    """It is no fault of the program, and says what a bug report needs."""
    trace = run(BREAKING.format(module=module, name=name, value=value))
    assert trace.harness_problem.startswith("the grader's own code failed in the process of a.py: ")
    assert f", {where} line " in trace.harness_problem
    assert trace.clock_reason == trace.harness_problem  # so `--clock auto` records it on the wall clock


@pytest.mark.long
def test_a_failure_in_virtual_time_is_recorded_on_the_wall_clock(one_worker: RecordingSession, tmp_path: Path) -> None:
    """Little of the grader's code runs there."""
    tmp_path.chmod(0o755)
    source = BREAKING.format(module="endpoints", name="BACKGROUND_PARAMETERS", value="None")
    trace = record(one_worker, tmp_path / "s", source, duration_ns=S, clock="wall", first_message_on="/cmd_vel")
    assert trace.harness_problem == ""
    assert trace.messages("/cmd_vel")
