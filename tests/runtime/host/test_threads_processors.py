"""Programs with threads do the same on one processor and on all of this machine."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import pytest
from places import GRADE
from sample_folders import folder_of, folders_in
from verifying import differences, verified, written

pytestmark = [pytest.mark.ros, pytest.mark.skipif((os.cpu_count() or 1) < 2, reason="there is one processor only")]

WITH_THREADS = ("threading", "MultiThreadedExecutor", "ThreadPool")
EXECUTORS = ["MultiThreadedExecutor()", "MultiThreadedExecutor(num_threads=2)", "SingleThreadedExecutor()"]
#: What a node does, in its constructor. `say` logs, `group()` makes a reentrant callback group.
BODIES = {
    "sleeping callbacks": "[self.create_timer(0.2, lambda n=n: (time.sleep(0.15), self.say(n)), group()) "
    "for n in range(6)]",
    "more than four": "[self.create_timer(0.5, lambda n=n: (self.say(n), time.sleep(0.4)), group()) for n in range(9)]",
    "threads that publish": "[threading.Thread(target=self.work, args=(n,), daemon=True).start() for n in range(4)]",
    "a pool": "self.pool = ThreadPoolExecutor(); [self.pool.submit(self.work, n, 2) for n in range(12)]",
    "as many as processors": "[threading.Thread(target=self.work, args=(n, 2)).start() for n in range(os.cpu_count())]",
    "a queue": "q = queue.Queue(2); self.run(lambda: [q.put(n) for n in range(9)]); "
    "self.run(lambda: [self.say(q.get()) "
    "for _ in range(9)])",
    "a barrier": "b = threading.Barrier(3); [self.run(lambda n=n: (time.sleep(n / 10), b.wait(), self.say(n))) "
    "for n in range(3)]",
    "a condition": "c = threading.Condition(); self.run(lambda: [(c.acquire(), c.wait(), self.say('woken'), "
    "c.release()) for _ in range(3)]); self.create_timer(0.3, "
    "lambda: (c.acquire(), c.notify_all(), c.release()), group())",
    "its own service": "self.create_service(Trigger, 'own', lambda a, b: b, callback_group=group()); "
    "c = self.create_client(Trigger, 'own', callback_group=group()); "
    "self.create_timer(0.3, lambda: c.call_async(Trigger.Request()).add_done_callback(lambda f: self.say('answered')))",
    "timers of threading": "[threading.Timer(n / 10, self.say, (n,)).start() for n in range(8)]",
}
PROGRAM = """
import os, queue, threading, time
from concurrent.futures import ThreadPoolExecutor
import rclpy
from rclpy.callback_groups import ReentrantCallbackGroup as group
from rclpy.executors import MultiThreadedExecutor, SingleThreadedExecutor
from rclpy.node import Node
from std_msgs.msg import String
from std_srvs.srv import Trigger
class Threads(Node):
    def __init__(self):
        super().__init__("threads")
        self.out = self.create_publisher(String, "words", 10)
        {body}
    def say(self, what):
        self.get_logger().info(str(what))
        self.out.publish(String(data=str(what)))
    def run(self, what):
        threading.Thread(target=what, daemon=True).start()
    def work(self, number, times=9):
        for turn in range(times):
            time.sleep(0.1)
            self.say((number, turn))
rclpy.init()
executor = {executor}
executor.add_node(Threads())
executor.spin()
"""


def with_threads() -> list[str]:
    """Return the test submissions that use threads, as `correct/NAME`."""
    found = []
    for place in folders_in("broken", "correct", "threads", "wrong"):
        texts = [path.read_text(encoding="utf-8", errors="replace") for path in place.rglob("*.py")]
        if any(word in text for text in texts for word in WITH_THREADS):
            found.append(f"{place.parent.name}/{place.name}")
    return found


def sampled(cases: Sequence[str]) -> list[Any]:
    """Return parameters of a test, lists of cases: one in five runs with `--long`, the others with `--everything`."""
    shares = [(cases[::5], pytest.mark.long), *((cases[n::5], pytest.mark.nightly) for n in range(1, 5))]
    return [pytest.param(share, marks=mark, id=f"{n}/5") for n, (share, mark) in enumerate(shares, 1)]


@pytest.mark.nightly
@pytest.mark.parametrize("names", sampled([f"{body}, {executor}" for body in BODIES for executor in EXECUTORS]))
def test_what_a_program_does(open_folder: Path, names: list[str]) -> None:
    """Each message and each log record at the same time."""
    programs = {}
    for number, name in enumerate(names):
        body, _, executor = name.partition(", ")
        programs[str(number)] = PROGRAM.format(body=BODIES[body], executor=executor)
    code, found = verified(written(open_folder, programs), "--condition", "processors")
    assert (code, differences(found), found["not_comparable"]) == (0, {}, [])


@pytest.mark.nightly
@pytest.mark.parametrize("names", sampled(with_threads()))
def test_what_a_submission_does(names: list[str]) -> None:
    """So that outcomes, reasons, hints and charts are the same as well."""
    code, found = verified([str(folder_of(name)) for name in names], "--condition", "processors")
    assert (code, differences(found)) == (0, {})


@pytest.mark.long
def test_a_client_that_waits_in_a_callback(open_folder: Path) -> None:
    """With a single thread in its executor it would wait for ever; a machine with one processor would give it that."""
    program = open_folder / "threads.py"
    body = (
        "self.create_service(Trigger, 'own', lambda a, b: b, callback_group=group()); "
        "c = self.create_client(Trigger, 'own', callback_group=group()); "
        "self.create_timer(0.3, lambda: (c.call(Trigger.Request()), self.say('answered')), group())"
    )
    program.write_text(PROGRAM.format(body=body, executor=EXECUTORS[0]), encoding="utf-8")
    one = ["taskset", "-c", str(min(os.sched_getaffinity(0)))]
    command = [*one, GRADE, "observe", str(program), "--duration", "1", "--json"]
    done = subprocess.run(command, capture_output=True, text=True, check=False, timeout=500)
    assert [record["text"] for record in json.loads(done.stdout)["records"]] == ["answered"] * 3
