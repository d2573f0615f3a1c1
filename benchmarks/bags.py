"""Measures what a recording that students hand in costs: processor time and memory, of copying and of reading it.

Usage: python benchmarks/bags.py [MEGABYTES]
       The recording has ten minutes of odometry at 20 Hz, which is judged, of a scan at 10 Hz, and camera images that
       make up the rest of its size, in MCAP and in SQLite.
"""

from __future__ import annotations

import resource
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_typestore

from grader.grading.submissions.bag_traces import UnreadableBag, bag_trace
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.scenario import HandedInBag, Scenario, Span
from grader.runtime.recording.bag import read_bag

STORE = get_typestore(Stores.ROS2_JAZZY)
LASTS_S = 600
FORMATS = {"mcap": StoragePlugin.MCAP, "db3": StoragePlugin.SQLITE3}


def odometry() -> list[bytes]:
    """Return the messages of a robot that drives, as a rubric plays them."""
    bag = Path(__file__).resolve().parent.parent / "rubrics" / "exercise_2" / "odometry"
    return [message.cdr for message in read_bag(bag, "/odom", "nav_msgs/msg/Odometry").messages]


def scan() -> bytes:
    """Return a scan of 360 ranges."""
    time, header = STORE.types["builtin_interfaces/msg/Time"], STORE.types["std_msgs/msg/Header"]
    numbers = dict.fromkeys(
        ("angle_min", "angle_max", "angle_increment", "time_increment", "scan_time", "range_min", "range_max"), 0.5
    )
    ranges = np.linspace(0.2, 3.5, 360, dtype=np.float32)
    stamped: Any = header(stamp=time(sec=1, nanosec=0), frame_id="laser")
    kind: Any = STORE.types["sensor_msgs/msg/LaserScan"]
    message = kind(header=stamped, **numbers, ranges=ranges, intensities=ranges)
    return bytes(STORE.serialize_cdr(message, "sensor_msgs/msg/LaserScan"))


def write(folder: Path, plugin: StoragePlugin, size_bytes: int) -> None:
    """Write the recording."""
    driven, seen = odometry(), scan()
    image_bytes = max(64, size_bytes // (LASTS_S * 10) - 2 * len(driven[0]) - len(seen))
    random = np.random.default_rng(1)
    with Writer(folder, version=9, storage_plugin=plugin) as writer:
        topics = {
            name: writer.add_connection(name, type_, typestore=STORE)
            for name, type_ in (
                ("/odom", "nav_msgs/msg/Odometry"),
                ("/scan", "sensor_msgs/msg/LaserScan"),
                ("/image", "sensor_msgs/msg/CompressedImage"),
            )
        }
        for number in range(LASTS_S * 20):
            t_ns = 1_700_000_000 * NS_PER_S + number * NS_PER_S // 20
            writer.write(topics["/odom"], t_ns, driven[number % len(driven)])
            if number % 2 == 0:
                writer.write(topics["/scan"], t_ns, seen)
                writer.write(topics["/image"], t_ns, b"\0\1\0\0" + random.bytes(image_bytes))


def copied(submission: str, into: str) -> None:
    """Copy a submission, and print what that costs."""
    staged = stage_submission(submission, ["*"], Path(into))
    used = resource.getrusage(resource.RUSAGE_SELF)
    print(f"copied {used.ru_utime + used.ru_stime:.1f} s, {peak_mib(resource.RUSAGE_SELF):.0f} MiB; ", end="")
    assert staged.files["*"].found


def read(root: str, topics: tuple[str, ...]) -> None:
    """Read a recording that was copied, and print what that costs this process and the contained one."""
    scenario = Scenario("drive", (), Span(0), handed_in=HandedInBag("*", topics, size_bytes=512 * MIB))
    before = resource.getrusage(resource.RUSAGE_SELF)
    trace = bag_trace(Path(root), "bag", scenario)
    if isinstance(trace, UnreadableBag):
        sys.exit(trace.problem)
    own, theirs = resource.getrusage(resource.RUSAGE_SELF), resource.getrusage(resource.RUSAGE_CHILDREN)
    own_s = own.ru_utime + own.ru_stime - before.ru_utime - before.ru_stime
    print(
        f"read {theirs.ru_utime + theirs.ru_stime:.1f} s, {peak_mib(resource.RUSAGE_CHILDREN):.0f} MiB; "
        f"taken over {own_s:.1f} s, {peak_mib(resource.RUSAGE_SELF):.0f} MiB; {len(trace.observations)} messages"
    )


def peak_mib(whose: int) -> float:
    """Return the most memory of this process, or of its children."""
    return resource.getrusage(whose).ru_maxrss / 1024


def main() -> None:
    """Write a recording in each format; copy and read it, each in a process of its own."""
    if sys.argv[1:2] == ["copy"]:
        copied(sys.argv[2], sys.argv[3])
    elif sys.argv[1:2] == ["read"]:
        read(sys.argv[2], tuple(sys.argv[3:]))
    else:
        megabytes = int(sys.argv[1]) if len(sys.argv) > 1 else 200
        for name, plugin in FORMATS.items():
            for topics in (("/odom",), ("/odom", "/scan")):
                with tempfile.TemporaryDirectory() as folder, tempfile.TemporaryDirectory() as into:
                    write(Path(folder, "bag"), plugin, megabytes * 1_000_000)
                    size_bytes = sum(file.stat().st_size for file in Path(folder, "bag").iterdir())
                    print(f"{name}, {size_bytes / 1e6:.0f} MB, {' '.join(topics)}: ", end="", flush=True)
                    again = [sys.executable, __file__]
                    subprocess.run([*again, "copy", folder, into], check=True)
                    subprocess.run([*again, "read", into, *topics], check=True)


if __name__ == "__main__":
    main()
