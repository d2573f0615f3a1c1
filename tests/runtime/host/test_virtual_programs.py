"""Programs with features of rclpy that no submission uses say the same on both clocks, at the same distances."""

import re
import textwrap
from pathlib import Path
from typing import Any

import pytest

from grader.runtime.model.trace import LogRecord, OutputLine, Trace
from grader.runtime.session import RecordingSession

pytest.importorskip("rclpy")

from hostile import record

from grader.runtime.model.quantities import NS_PER_S

pytestmark = pytest.mark.ros

BEFORE = """
import asyncio, sched, threading, time
import rclpy
from rclpy.callback_groups import MutuallyExclusiveCallbackGroup, ReentrantCallbackGroup
from rclpy.clock import Clock, ClockType
from rclpy.context import Context
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.parameter_client import AsyncParameterClient
from rclpy.parameter_event_handler import ParameterEventHandler
from rclpy.qos import DurabilityPolicy, QoSProfile
from rclpy.serialization import deserialize_message
from rclpy.task import Future
from rclpy.wait_for_message import wait_for_message
from std_msgs.msg import Int32
from std_srvs.srv import Trigger

def say(*words):
    print(*words, flush=True)
"""
#: Publishes 1, 2, 3 and so on every 300 ms, serves /count_up, and has a parameter.
OTHER = """
rclpy.init()
node, count, calls = Node("other"), 0, 0
node.declare_parameter("size", 3)
publisher = node.create_publisher(Int32, "/count", 10)

def publish():
    global count
    count += 1
    publisher.publish(Int32(data=count))

def answer(request, response):
    global calls
    calls += 1
    response.success, response.message = True, str(calls)
    return response

node.create_timer(0.3, publish)
node.create_service(Trigger, "/count_up", answer)
rclpy.spin(node)
"""
PROGRAMS = {
    "parameter_client": """
        client = AsyncParameterClient(node, "other")
        say(client.wait_for_services(2.0))
        for future in (client.get_parameters(["size"]), client.set_parameters([Parameter("size", value=9)])):
            rclpy.spin_until_future_complete(node, future)
            say(future.done())
    """,
    "parameter_events": """
        node.declare_parameter("size", 4)
        handler = ParameterEventHandler(node)
        kept = handler.add_parameter_callback("size", "node", lambda p: say("now", p.value.integer_value))
        node.create_timer(
            0.7, lambda: node.set_parameters([Parameter("size", value=node.get_parameter("size").value + 1)])
        )
        rclpy.spin(node)
    """,
    "wait_for_message": """
        for _ in range(3):
            said, message = wait_for_message(Int32, node, "/count", time_to_wait=2.0)
            say(said, bool(message.data))
        say(wait_for_message(Int32, node, "/none", time_to_wait=0.5)[0])
    """,
    "timers": """
        first = node.create_timer(0.5, lambda: (say("first"), first.cancel()))
        def second():
            say("second", first.is_canceled())
            first.reset()
        node.create_timer(0.8, second)
        third = node.create_timer(0.3, lambda: say("third"), autostart=False)
        node.create_timer(2.0, third.reset)
        rclpy.spin(node)
    """,
    "clocks": """
        steady = Clock(clock_type=ClockType.STEADY_TIME)
        node.create_timer(0.4, lambda: say("steady"), clock=steady)
        node.create_timer(0.7, lambda: say("system"), clock=Clock())
        rclpy.spin(node)
    """,
    "guard_condition": """
        condition = node.create_guard_condition(lambda: say("triggered"))
        def trigger():
            for _ in range(4):
                time.sleep(0.5)
                condition.trigger()
        threading.Thread(target=trigger, daemon=True).start()
        rclpy.spin(node)
    """,
    "asyncio": """
        node.create_subscription(Int32, "/count", lambda m: say("heard"), 10)
        async def spin():
            while rclpy.ok():
                rclpy.spin_once(node, timeout_sec=0)
                await asyncio.sleep(0.02)
        async def main():
            await asyncio.gather(spin(), asyncio.sleep(0.7))
        asyncio.run(main())
    """,
    "executors": """
        ended, ticks = Future(), 0
        def tick():
            global ticks
            ticks += 1
            say("tick")
            if ticks == 3:
                ended.set_result(5)
        node.create_timer(0.5, tick)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.spin_until_future_complete(ended, timeout_sec=1.2)
        say(ended.done())
        executor.spin_until_future_complete(ended)
        async def later():
            return "later"
        task = executor.create_task(later)
        executor.spin_until_future_complete(task)
        say(ended.result(), task.result())
    """,
    "two_executors": """
        other = Node("second")
        for each in (node, other):
            executor = SingleThreadedExecutor()
            executor.add_node(each)
            threading.Thread(target=executor.spin, daemon=True).start()
        client = node.create_client(Trigger, "/count_up")
        client.wait_for_service()  # a call before that would be lost on the wall clock
        other.create_timer(0.6, lambda: say("timer", client.call(Trigger.Request()).message))
        for _ in range(4):
            say("main", client.call(Trigger.Request()).message)
            time.sleep(0.5)
    """,
    "blocking_call": """
        client = node.create_client(Trigger, "/count_up", callback_group=MutuallyExclusiveCallbackGroup())
        node.create_timer(
            0.7, lambda: say(client.call(Trigger.Request()).message), callback_group=ReentrantCallbackGroup()
        )
        executor = MultiThreadedExecutor(4)
        executor.add_node(node)
        executor.spin()
    """,
    "deadlock": """
        client = node.create_client(Trigger, "/count_up")
        node.create_timer(0.5, lambda: (say("calling"), say(client.call(Trigger.Request()).message)))
        rclpy.spin(node)
    """,
    "coroutines_that_wait_for_each_other": """
        first, second = Future(), Future()
        async def wait_for(future, then):
            say(await future)
            if then is not None:
                then.set_result("second")
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.create_task(wait_for, first, second)
        executor.create_task(wait_for, second, None)  # asked before the other one, which it waits for
        node.create_timer(0.5, lambda: first.set_result("first") if not first.done() else say("later"))
        executor.spin()
    """,
    "coroutine_that_ends_a_spin": """
        first, ended = Future(), Future()
        async def wait():
            ended.set_result(await first)
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        executor.create_task(wait)
        node.create_timer(0.7, lambda: first.done() or first.set_result("first"))
        executor.spin_until_future_complete(ended)
        say(ended.result())
        executor.spin_once(timeout_sec=0)
        say("end")
    """,
    "work_from_another_thread": """
        executor = SingleThreadedExecutor()
        executor.add_node(node)
        other = Node("second")
        other.create_timer(0.4, lambda: say("timer of a node that was added"))
        def work():
            time.sleep(0.3)
            executor.create_task(say, "task")
            time.sleep(0.3)
            executor.add_node(other)
            time.sleep(1.4)
            executor.remove_node(other)
            say("removed")
        threading.Thread(target=work, daemon=True).start()
        executor.spin()
    """,
    "work_from_a_callback": """
        executor, made = SingleThreadedExecutor(), []
        executor.add_node(node)
        condition = node.create_guard_condition(lambda: say("condition"))
        def tick():
            say("tick", len(made))
            condition.trigger()
            executor.create_task(say, "task")
            made.append(node.create_timer(0.1, lambda: (say("once"), made[-1].cancel())))
        node.create_timer(0.6, tick)
        while rclpy.ok():
            executor.spin_once(timeout_sec=0.21)
            say("spun")
    """,
    "second_context": """
        context, ticks = Context(), 0
        rclpy.init(context=context)
        own = Node("own", context=context)
        executor = SingleThreadedExecutor(context=context)
        executor.add_node(own)
        def tick():
            global ticks
            ticks += 1
            say("tick", ticks)
            if ticks == 4:
                rclpy.shutdown(context=context)
        own.create_timer(0.5, tick)
        executor.spin()
        say("end")
    """,
    "standard_library": """
        threading.Thread(target=rclpy.spin, args=(node,), daemon=True).start()
        plan = sched.scheduler(time.monotonic, time.sleep)
        for delay in (0.4, 0.8):
            plan.enter(delay, 1, say, (delay,))
        plan.run()
        threading.Timer(0.3, say, ("timer",)).start()
        say(threading.Event().wait(0.6))
        rate = node.create_rate(5)
        for number in range(3):
            rate.sleep()
            say(number)
    """,
    "changing_subscriptions": """
        made = {}
        def second(message):
            say("second")
        def first(message):
            say("first")
            if "second" not in made:
                made["second"] = node.create_subscription(Int32, "/count", second, 10)
            else:
                node.destroy_subscription(made["first"])
        made["first"] = node.create_subscription(Int32, "/count", first, 10)
        rclpy.spin(node)
    """,
    "slow_reader": """
        heard = []
        def read(message):
            heard.append(message.data)
            say("behind", message.data - heard[0])
            time.sleep(0.85)
        node.create_subscription(Int32, "/count", read, 1)
        rclpy.spin(node)
    """,
    "late_reader": """
        qos = QoSProfile(depth=3, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        publisher = node.create_publisher(Int32, "/kept", qos)
        for number in range(5):
            publisher.publish(Int32(data=number))
        def read():
            timer.cancel()
            node.create_subscription(Int32, "/kept", lambda m: say("kept", m.data), qos)
        timer = node.create_timer(1.0, read)
        rclpy.spin(node)
    """,
    "raw_messages": """
        node.create_subscription(
            Int32, "/count", lambda raw: say(type(raw).__name__, deserialize_message(raw, Int32).data > 0), 10, raw=True
        )
        rclpy.spin(node)
    """,
}
#: How far the distances between two lines may differ.
TOLERANCE_S = 0.15


def said(trace: Trace) -> list[tuple[float, str]]:
    """Return what the first program wrote, with seconds since its first line."""
    found = [o for o in trace.observations if isinstance(o, (OutputLine, LogRecord)) and o.process == "a.py"]
    first = found[0].t_ns if found else 0
    return [((o.t_ns - first) / NS_PER_S, re.sub(r"0x[0-9a-f]+", "", o.text)) for o in found]


#: Programs that need each look of an executor, of which a host leaves some out: with `--long`. Others run every night.
EACH_LOOK = ("coroutines_that_wait_for_each_other", "coroutine_that_ends_a_spin")


@pytest.mark.parametrize(
    "program",
    [
        pytest.param(program, id=name, marks=pytest.mark.long if name in EACH_LOOK else pytest.mark.nightly)
        for name, program in PROGRAMS.items()
    ],
)
def test_a_program_says_the_same_on_both_clocks(session: RecordingSession, tmp_path: Path, program: str) -> None:
    """The same lines, at the same distances from the first one; the wall clock starts later and so ends earlier."""
    tmp_path.chmod(0o755)
    begin = BEFORE + "rclpy.init()\nnode = Node('node')\n"
    whole: Any = [begin + textwrap.dedent(program), BEFORE + OTHER]
    virtual, again, wall = (
        said(record(session, tmp_path / "s", *whole, clock=clock, duration_ns=4 * NS_PER_S))
        for clock in ("virtual", "virtual", "wall")
    )
    assert virtual == again
    assert virtual
    assert [text for _, text in wall] == [text for _, text in virtual[: len(wall)]]
    assert len(wall) >= len(virtual) / 2
    late = [
        (at, at_wall) for (at, _), (at_wall, _) in zip(virtual, wall, strict=False) if abs(at - at_wall) > TOLERANCE_S
    ]
    assert late == []
