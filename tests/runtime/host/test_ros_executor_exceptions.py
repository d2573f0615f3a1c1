"""When an exception in a callback of a `MultiThreadedExecutor` surfaces: at once, with the next callback, or never.

The executor looks whether callbacks have failed right after it has handed one to a thread. A callback that writes
nothing has ended by then if its thread is new; one that logs has not. `CAUGHT` is where `spin` raised, with the time in
tenths of a second.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import pytest

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import LogRecord, OutputLine, Trace
from grader.runtime.plan import Plan

pytest.importorskip("rclpy")

from hostile import planned
from side_by_side import rows_of

pytestmark = pytest.mark.ros

PROGRAM = """
import threading, time, rclpy
from rclpy.action import ActionClient, ActionServer
from rclpy.callback_groups import ReentrantCallbackGroup
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.task import Future
from std_msgs.msg import String
from std_srvs.srv import Trigger
from test_msgs.action import Fibonacci as Action

rclpy.init()
node, group = Node("node"), ReentrantCallbackGroup()
executor = MultiThreadedExecutor(4)
executor.add_node(node)
began = time.monotonic()

def fails(*arguments):
    {writes}
    raise KeyError("missing")

def once(what):
    timer = node.create_timer(0.5, lambda: (timer.cancel(), what()), group)

{entity}
threading.Timer(2.6, lambda: (print("end", flush=True), rclpy.try_shutdown())).start()
try:
    {spin}
except KeyError:
    print("CAUGHT", round((time.monotonic() - began) * 10), flush=True)
"""
WRITES = {"nothing": "pass", "log": "node.get_logger().info('here')", "print": "print('here', flush=True)"}
SERVER = "node.create_service(Trigger, 'ask', fails, callback_group=group)\n"
CLIENT = "client = node.create_client(Trigger, 'ask', callback_group=group)\n"
ACTION = "client = ActionClient(node, Action, 'act', callback_group=group)\n"
ACTS = "once(lambda: client.send_goal_async(Action.Goal()))"
#: What fails, and what the program says if the callback writes nothing, and if it writes `here` first.
ENTITIES = {
    "timer": ("node.create_timer(0.5, fails)", "CAUGHT 5", "here here CAUGHT 10"),
    "timer beside another": (
        "node.create_timer(0.5, fails, group); node.create_timer(0.7, lambda: None, group)",
        "CAUGHT 5",
        "here CAUGHT 7",
    ),
    "subscription": (
        "out = node.create_publisher(String, 't', 10); node.create_subscription(String, 't', fails, 10)\n"
        "node.create_timer(0.5, lambda: out.publish(String(data='x')))",
        "CAUGHT 5",
        "here CAUGHT 10",
    ),
    "service": (SERVER + CLIENT + "once(lambda: client.call_async(Trigger.Request()))", "CAUGHT 5", "here"),
    "callback of an answer": (
        SERVER.replace("fails", "lambda a, b: b")
        + CLIENT
        + "once(lambda: client.call_async(Trigger.Request()).add_done_callback(fails))",
        "",
        "here",
    ),
    "goal": (
        f"ActionServer(node, Action, 'act', print, goal_callback=fails, callback_group=group); {ACTION}{ACTS}",
        "CAUGHT 5",
        "here",
    ),
    "parameter": (
        "node.declare_parameter('p', 1); node.add_on_set_parameters_callback(fails)\n"
        "node.create_timer(0.5, lambda: node.set_parameters([Parameter('p', value=2)]))",
        "CAUGHT 5",
        "here here CAUGHT 10",
    ),
    "guard condition": (
        "made = node.create_guard_condition(fails); threading.Timer(0.5, made.trigger).start()",
        "CAUGHT 5",
        "here",
    ),
    "task": ("once(lambda: executor.create_task(fails))", "CAUGHT 5", "here"),
}
SPINS = {
    "spin": "executor.spin()",
    "spin_once": "while rclpy.ok(): executor.spin_once()",
    "spin_once with a time-out": "while rclpy.ok(): executor.spin_once(timeout_sec=0.13)",
    "spin_until_future_complete": "executor.spin_until_future_complete(Future(), timeout_sec=3.0)",
}
CASES = [
    pytest.param(
        *names,
        marks=[] if names in {("timer", "log", "spin"), ("service", "log", "spin_once")} else pytest.mark.nightly,
    )
    for names in itertools.product(ENTITIES, WRITES, SPINS)
]


def said(trace: Trace) -> str:
    """Return what a program said until its end, sorted by the time."""
    found = [o for o in trace.observations if isinstance(o, (LogRecord, OutputLine)) and o.process == "a.py"]
    words = sorted((o.t_ns, not isinstance(o, LogRecord) and o.text != "here", o.text) for o in found)
    told = [text for _, _, text in words if text.startswith(("here", "CAUGHT", "end"))]
    return " ".join(told[: told.index("end")])


def plan(folder: Path, entity: str, writes: str, spin: str) -> Plan:
    program = PROGRAM.format(entity=ENTITIES[entity][0], writes=WRITES[writes], spin=SPINS[spin])
    return planned(folder, program, duration_ns=4 * NS_PER_S)


@rows_of(plan)
@pytest.mark.parametrize(("entity", "writes", "spin"), CASES)
def test_an_exception_surfaces_as_on_a_real_clock(trace: Trace, entity: str, writes: str, spin: str) -> None:
    """What each says was counted with plain Python on an idle machine, where it is what comes most often."""
    _, silent, loud = ENTITIES[entity]
    assert said(trace) == (silent if writes == "nothing" else loud)
