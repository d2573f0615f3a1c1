"""Loops that pause after their work are as slow as on a real clock, those that sleep until a deadline lose nothing."""

import textwrap
from collections.abc import Callable
from dataclasses import replace
from itertools import pairwise
from pathlib import Path

import pytest
from tiers import NIGHTLY, but

from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.session import AUTO, VIRTUAL, RecordingSession
from grader.runtime.supervisor.next_recording import CHARGED_NOTE, DRIFTS

pytest.importorskip("rclpy")

from computing import library_call
from hostile import planned

from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.supervisor.supervisor import Job
from grader.runtime.worker.virtual_runner import BUSY, OUTSIDE

pytestmark = pytest.mark.ros

BEFORE = """
import asyncio, collections, ctypes, logging, queue, select, selectors, socket, threading, time
import hashlib
import rclpy
from rclpy.duration import Duration
from rclpy.executors import MultiThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import Header

rclpy.init()
node = Node("pace")
publisher = node.create_publisher(Header, "/pace", 10)

def work():
    {work}

def publish():
    publisher.publish(Header())
    work()

def in_thread(loop):
    threading.Thread(target=loop, daemon=True).start()
    rclpy.spin(node)
"""
#: Pauses of 50 ms that are counted from the end of the work, however the program reads clocks.
RELATIVE = {
    "stamp": "message = Header()\n message.stamp = node.get_clock().now().to_msg()\n publish()\n time.sleep(0.05)",
    "look": "publish()\n time.time()\n time.sleep(0.05)",
    "two_looks": "publish()\n time.sleep(0.05 - (time.time() - time.time()))",
    "adds_nothing": "publish()\n time.sleep(0.05 + 0 * time.monotonic())",
    "logging": "publish()\n logging.info('x')\n time.sleep(0.05)",
    "event": "publish()\n time.perf_counter()\n threading.Event().wait(0.05)",
    "condition": "publish()\n one = threading.Condition()\n with one:\n  time.time()\n  one.wait(timeout=0.05)",
    "queue": "publish()\n try:\n  queue.Queue().get(timeout=0.05)\n except queue.Empty:\n  pass",
    "select": "publish()\n time.time()\n select.select([], [], [], 0.05)",
    "selector": "publish()\n time.time()\n one = selectors.SelectSelector()\n one.select(0.05)",
    "spin_once": "publish()\n time.time()\n rclpy.spin_once(node, timeout_sec=0.05)",
    "sleep_for": "publish()\n node.get_clock().sleep_for(Duration(seconds=0.05))",
    "from_now": "publish()\n clock = node.get_clock()\n clock.sleep_until(clock.now() + Duration(seconds=0.05))",
    "polls": "publish()\n began = time.time()\n while time.time() - began < 0.05:\n  pass",
    "small_steps": "publish()\n began = time.time()\n while time.time() - began < 0.05:\n  time.sleep(0.001)",
    "in_c": "publisher.publish(Header())\n ctypes.CDLL(None).usleep(20_000)\n time.time()\n time.sleep(0.05)",
}
RELATIVE = {name: f"while True:\n {body}" for name, body in RELATIVE.items()}
RELATIVE["asyncio"] = """
async def main():
    while True:
        publish()
        await asyncio.sleep(0.05)
asyncio.run(main())
"""
RELATIVE["thread"] = """
def run():
    while True:
        publish()
        node.get_clock().now()
        time.sleep(0.05)
in_thread(run)
"""
RELATIVE["callback"] = """
def tick():
    publish()
    time.time()
    time.sleep(0.05)
node.create_timer(0.001, tick)
executor = MultiThreadedExecutor()
executor.add_node(node)
executor.spin()
"""
RELATIVE["reset_timer"] = """
def tick():
    timer.cancel()
    publish()
    node.get_clock().now()
    timer.reset()
timer = node.create_timer(0.05, tick)
rclpy.spin(node)
"""
#: The same work, and messages at fixed moments, of which a program knows the next one.
UNTIL = {
    "deadline": "due = time.time()\nwhile True:\n publish()\n due += 0.05\n time.sleep(max(0, due - time.time()))",
    "rest": "while True:\n began = time.time()\n publish()\n time.sleep(max(0, 0.05 - (time.time() - began)))",
    "whole": "while True:\n publish()\n time.sleep(0.05 - time.time() % 0.05)",
    "small_steps": (
        "due = time.time()\nwhile True:\n publish()\n due += 0.05\n while time.time() < due:\n  time.sleep(0.001)"
    ),
    "polls": "due = time.time()\nwhile True:\n publish()\n due += 0.05\n while time.time() < due:\n  pass",
    "event": (
        "due = time.time()\nstop = threading.Event()\nwhile True:\n publish()\n due += 0.05\n"
        " stop.wait(max(0, due - time.time()))"
    ),
    "spin_once": (
        "due = time.time()\nwhile True:\n publish()\n due += 0.05\n"
        " while time.time() < due:\n  rclpy.spin_once(node, timeout_sec=max(0, due - time.time()))"
    ),
    "sleep_until": (
        "due = node.get_clock().now()\nwhile True:\n publish()\n due += Duration(seconds=0.05)\n"
        " node.get_clock().sleep_until(due)"
    ),
    "timer": "node.create_timer(0.05, publish)\nrclpy.spin(node)",
    "rate": "rate = node.create_rate(20)\ndef run():\n while True:\n  publish()\n  rate.sleep()\nin_thread(run)",
    "call_at": """
async def main():
    loop = asyncio.get_running_loop()
    def tick(due):
        publish()
        loop.call_at(due + 0.05, tick, due + 0.05)
    tick(loop.time())
    await asyncio.sleep(60)
asyncio.run(main())
""",
}
Record = Callable[..., AssessedTrace]


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Record:
    tmp_path.chmod(0o755)

    def run_one(program: str, *, clock: str = AUTO, work: float = 0.02, charged: float | None = None) -> AssessedTrace:
        whole = BEFORE.replace("{work}", library_call(work).partition("\n")[2]) + textwrap.dedent(program)
        plan = planned(tmp_path / "s", whole, duration_ns=3 * NS_PER_S, first_message_on="/pace")
        if charged is not None:  # this recording alone, whatever it shows
            alone = Job("pace", replace(plan, charged=charged))
            (trace,) = session.recorder.each([alone], lambda step: None)
            return trace
        return session.record({"": Job("pace", plan)}, clock, lambda step: None)[""]

    return run_one


def rate_hz(trace: AssessedTrace) -> float:
    """The rate from the second message on: the first one comes when the program begins, which may be off its grid."""
    times = [m.t_ns for m in trace.messages("/pace")][1:]
    return (len(times) - 1) / (times[-1] - times[0]) * NS_PER_S


@pytest.mark.long
@pytest.mark.parametrize("name", but(("condition",), RELATIVE, NIGHTLY))
def test_a_loop_that_pauses_after_its_work_is_as_slow_as_it_is(run: Record, name: str) -> None:
    """40 ms of work and a pause of 50: 11 Hz, by the wall clock, or by the measured work if the machine is too busy.

    Of measured work at least half counts, which makes 14 Hz: with so much work, 16 also holds where it is done quicker
    than when its length was measured.
    """
    trace = run(RELATIVE[name], work=0.04)
    assert rate_hz(trace) < 16
    assert trace.clock is ClockKind.VIRTUAL or trace.clock_reason in (DRIFTS, BUSY, OUTSIDE)
    assert trace.clock is ClockKind.WALL or CHARGED_NOTE in trace.notes


@pytest.mark.long
@pytest.mark.parametrize("name", but(("deadline",), UNTIL, NIGHTLY))
def test_a_loop_that_sleeps_until_a_deadline_keeps_its_pace(run: Record, name: str) -> None:
    """It makes up for its work: it stays in virtual time, at exactly 20 Hz."""
    trace = run(UNTIL[name])
    assert (trace.clock, trace.clock_reason, trace.notes) == (ClockKind.VIRTUAL, "", ())
    assert f"{rate_hz(trace):.3f}" == "20.000"


@pytest.mark.long
def test_a_recording_in_virtual_time_is_the_same_each_time(run: Record) -> None:
    """To the microseconds that looks at clocks take."""
    program = """
    while True:
        message = Header()
        message.stamp = node.get_clock().now().to_msg()
        message.frame_id = f"{time.time() - time.time()} {time.perf_counter()} {node.get_clock().now().nanoseconds}"
        publisher.publish(message)
        node.get_logger().info(message.frame_id)
        rclpy.spin_once(node, timeout_sec=0.02)
        time.sleep(0.01)
    """
    first, second = (run(program, clock=VIRTUAL) for _ in range(2))
    assert first.observations == second.observations
    stamps = [m.value["stamp"] for m in first.messages("/pace")]
    assert len({(s["sec"], s["nanosec"]) for s in stamps}) == len(stamps) > 90


@pytest.mark.nightly
@pytest.mark.rule(23)
def test_time_passes_while_a_program_works_where_it_is_charged(run: Record) -> None:
    """The recording that decides: what a program publishes after its work comes later, and so does its next pause.

    It comes later by the processor time that the program tells: how fast a processor is depends on its other users.
    """
    program = """
    while True:
        began = time.thread_time()
        publish()
        publisher.publish(Header(frame_id=str(time.thread_time() - began)))
        time.sleep(0.05)
    """
    plain, charged = (run(program, charged=charged) for charged in (0.0, 1.0))
    for trace, least, most in ((plain, 0, 0.005), (charged, 0.75, 3)):
        published = [(m.t_ns / NS_PER_S, m.value["frame_id"]) for m in trace.messages("/pace")]
        worked = sorted((b - a) / float(told) for (a, _), (b, told) in pairwise(published) if told)
        assert least <= worked[len(worked) // 2] <= most
    assert (plain.clock_reason, plain.may_drift) == (BUSY, True)
