"""Steps a node through ten virtual seconds repeatedly, as tests do, and says how long one such test takes.

Usage: python benchmarks/stepped_tests.py [TESTS]

30 tests unless told otherwise. Each has a world of its own, starts a node with a timer of 20 Hz, publishes scans with
10 Hz, lets ten seconds pass, and looks at the last command. The first test is told apart: it starts a worker.
"""

from __future__ import annotations

import os
import statistics
import sys
import time
from pathlib import Path

from sensor_msgs.msg import LaserScan

from grader.runtime.usage import families, usage
from grader.world.opening import Worlds, open_worlds

NODES = Path(__file__).resolve().parent.parent / "tests" / "world" / "nodes"


def one_test(worlds: Worlds) -> None:
    """Do what a short test does."""
    with worlds.open() as ros:
        ros.run("obstacle_stop.py", parameters={"distance": 0.5})
        ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=10)
        ros.advance(10.0)
        assert ros.messages("/cmd_vel")[-1].linear.x == 0.2
        assert len(ros.messages("/cmd_vel")) == 200


def used_s() -> float:
    """Return the processor time of this process and of all that it has started, in seconds."""
    return usage(families([os.getpid()])[os.getpid()]).processor_ns / 1e9


def main() -> None:
    """Measure, and print one line for each figure."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 30
    began = time.perf_counter()
    with open_worlds(NODES) as worlds:
        one_test(worlds)
        print(f"first test, with the start of a worker: {time.perf_counter() - began:.3f} s")
        times, before_s = [], used_s()
        for _ in range(count):
            began = time.perf_counter()
            one_test(worlds)
            times.append(time.perf_counter() - began)
        processor_s = (used_s() - before_s) / count
    load = os.getloadavg()[0]
    print(f"each of {count} more: {min(times):.3f} s at least, {statistics.median(times):.3f} s in the median")
    print(f"{processor_s:.3f} s of a processor each; load of this machine: {load:.1f} on {os.cpu_count()} processors")


if __name__ == "__main__":
    main()
