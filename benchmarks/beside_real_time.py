"""Runs five tests of nodes as launch_testing's are written, in real time, and the same five stepped, and compares.

Usage: python benchmarks/beside_real_time.py [ROUNDS] [LOOPS]

One round of the five, without load, unless told otherwise; with LOOPS, so many endless loops for each processor run
beside them. `launch_testing` itself has no wheel: the tests start a process, spin a node of their own, and wait, as its
tests do. Nodes and tests are those of docs/how-to/launch-testing.md. Printed are the time of a round and how many
tests failed, of each kind.
"""

from __future__ import annotations

import contextlib
import os
import re
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import rclpy
from rclpy.node import Node
from std_msgs.msg import Int32, String
from std_srvs.srv import Trigger

from grader.runtime.sandbox.environment import dds_profile
from grader.world.opening import Worlds, open_worlds
from grader.world.world import World

PAGE = Path(__file__).resolve().parent.parent / "docs" / "how-to" / "launch-testing.md"
_FILE = re.compile(r"^```python\n# (counter|shouter)\.py\n(.*?)^```", re.MULTILINE | re.DOTALL)
DOMAIN = 88


@contextlib.contextmanager
def started(program: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a program in real time, and end it at the end of the block."""
    process = subprocess.Popen([sys.executable, "-u", str(program)], stderr=subprocess.PIPE, text=True)
    try:
        yield process
    finally:
        process.kill()
        process.wait()


def spun(node: Node, seconds: float, until: Callable[[], bool] = lambda: False) -> bool:
    """Spin a node until a condition holds, at most so long; return whether it does."""
    end = time.time() + seconds
    while time.time() < end and not until():
        rclpy.spin_once(node, timeout_sec=0.1)
    return until()


def real_rate(node: Node, folder: Path) -> bool:
    """Count the messages of ten seconds, after two for discovery."""
    times: list[float] = []
    node.create_subscription(Int32, "/count", lambda _: times.append(time.time()), 10)
    with started(folder / "counter.py"):
        spun(node, 2.0)
        times.clear()
        spun(node, 10.0)
    return abs(len(times) / 10.0 - 10.0) <= 0.5


def real_reaction(node: Node, folder: Path) -> bool:
    """Send a text after two seconds for discovery, and wait for the answer."""
    received: list[Any] = []
    node.create_subscription(String, "/out", received.append, 10)
    publisher = node.create_publisher(String, "/in", 10)
    with started(folder / "shouter.py"):
        spun(node, 2.0)
        publisher.publish(String(data="hello"))
        return spun(node, 5.0, lambda: bool(received)) and received[0].data == "HELLO"


def real_service(node: Node, folder: Path) -> bool:
    """Wait for a service and call it."""
    client = node.create_client(Trigger, "/reset")
    with started(folder / "counter.py"):
        if not client.wait_for_service(timeout_sec=10.0):
            return False
        future = client.call_async(Trigger.Request())
        return spun(node, 10.0, future.done) and bool(future.result().success)


def real_log(node: Node, folder: Path) -> bool:
    """Call a service, and look for a line in what the process writes."""
    client = node.create_client(Trigger, "/reset")
    with started(folder / "counter.py") as process:
        if not client.wait_for_service(timeout_sec=10.0):
            return False
        spun(node, 10.0, client.call_async(Trigger.Request()).done)
        process.send_signal(signal.SIGINT)
        return "reset" in process.communicate(timeout=10.0)[1]


def real_end(node: Node, folder: Path) -> bool:
    """Interrupt a process after three seconds, and look at its exit code."""
    with started(folder / "counter.py") as process:
        spun(node, 3.0)
        process.send_signal(signal.SIGINT)
        return process.wait(timeout=10.0) == 0


def stepped_rate(ros: World) -> bool:
    """Count the messages of ten virtual seconds."""
    ros.run("counter.py")
    ros.advance(10.0)
    return ros.rate("/count") == 10.0


def stepped_reaction(ros: World) -> bool:
    """Send a text and look at the answer."""
    ros.run("shouter.py")
    ros.publish("/in", String(data="hello"))
    ros.settle()
    return [message.data for message in ros.messages("/out")] == ["HELLO"]


def stepped_service(ros: World) -> bool:
    """Call a service."""
    ros.run("counter.py")
    return bool(ros.call("/reset", Trigger.Request()).success)


def stepped_log(ros: World) -> bool:
    """Call a service and look at the log."""
    counter = ros.run("counter.py")
    ros.call("/reset", Trigger.Request())
    return [log.text for log in counter.logs] == ["reset"]


def stepped_end(ros: World) -> bool:
    """Interrupt a program after three virtual seconds, and look at its exit code."""
    counter = ros.run("counter.py")
    ros.advance(3.0)
    counter.interrupt()
    return counter.exit_code == 0


REAL = (real_rate, real_reaction, real_service, real_log, real_end)
STEPPED = (stepped_rate, stepped_reaction, stepped_service, stepped_log, stepped_end)


def in_real_time(folder: Path, failed: Counter[str]) -> None:
    """Run the five tests in real time."""
    for test in REAL:
        rclpy.init(domain_id=DOMAIN)
        node = rclpy.create_node("test")
        with contextlib.suppress(subprocess.TimeoutExpired):
            failed[test.__name__] += not test(node, folder)
        node.destroy_node()
        rclpy.shutdown()


def stepped(worlds: Worlds, failed: Counter[str]) -> None:
    """Run the five tests step by step."""
    for test in STEPPED:
        with worlds.open() as ros:
            failed[test.__name__] += not test(ros)


def main() -> None:
    """Compare, and print both."""
    rounds, loops = (int(sys.argv[n]) if len(sys.argv) > n else default for n, default in ((1, 1), (2, 0)))
    os.environ |= {"ROS_DOMAIN_ID": str(DOMAIN), "FASTDDS_BUILTIN_TRANSPORTS": "UDPv4"}
    os.environ |= dds_profile(Path(dds_profile.__code__.co_filename).parent, "loopback", "jazzy")
    busy = [subprocess.Popen([sys.executable, "-c", "while True: pass"]) for _ in range(loops * (os.cpu_count() or 1))]
    failed: Counter[str] = Counter()
    try:
        with tempfile.TemporaryDirectory() as name:
            folder = Path(name)
            for program, text in _FILE.findall(PAGE.read_text(encoding="utf-8")):
                (folder / f"{program}.py").write_text(text, encoding="utf-8")
            began = time.perf_counter()
            for _ in range(rounds):
                in_real_time(folder, failed)
            real_s = (time.perf_counter() - began) / rounds
            began = time.perf_counter()
            with open_worlds(folder) as worlds:
                for _ in range(rounds):
                    stepped(worlds, failed)
            stepped_s = (time.perf_counter() - began) / rounds
    finally:
        for process in busy:
            process.kill()
    print(f"{rounds} rounds of five tests, {loops} endless loops for each of {os.cpu_count()} processors")
    print(f"in real time: {real_s:.1f} s a round; stepped: {stepped_s:.2f} s a round; {real_s / stepped_s:.1f} times")
    print(f"failed: {', '.join(f'{name} {count}' for name, count in failed.items() if count) or 'none'}")


if __name__ == "__main__":
    main()
