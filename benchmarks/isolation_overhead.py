"""Measures how long one node takes to start in each sandbox that holds here, as a ratio against none, in one run.

Usage: python benchmarks/isolation_overhead.py [ROUNDS]      ROUNDS (15): starts in each tier, taking turns

From the worker's decision to start a process until its node exists; the median of all rounds. Run it as root and as an
ordinary user: the tiers differ. The tier `landlock` is measured also where the network is open to it.
"""

from __future__ import annotations

import contextlib
import json
import os
import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.limits import Limits
from grader.runtime.recording.codec import from_json, to_json
from grader.runtime.ros_installation import PythonRuntime, RosInstallation, find_ros
from grader.runtime.sandbox.choose import Machine, choose_isolation
from grader.runtime.sandbox.environment import quick_discovery, runtime_environment
from grader.runtime.sandbox.protocol import StudentProcess
from grader.runtime.sandbox.tiers import HOST, ISOLATING, isolation_from_name

NODE = """
import rclpy, os
rclpy.init()
node = rclpy.create_node("started")
os.write(1, b"up")
os._exit(0)
"""


def inside(request: dict[str, object]) -> None:
    """Start one node for every line on standard input, as the worker of a tier, and print the seconds it took."""
    isolation = isolation_from_name(str(request["isolation"]))
    runtime = from_json(PythonRuntime, request["runtime"])
    for _ in sys.stdin:
        begun = time.perf_counter()
        process = StudentProcess(
            runtime=runtime,
            host_folder=HOST,
            submission=Path(str(request["submission"])),
            arguments=("-s", "-u", "-B", "-c", NODE),
            environment={"ROS_DOMAIN_ID": "87", **quick_discovery(isolation.host_seen_at, runtime)},
            pass_fds=(),
        )
        command = isolation.student_command(process, Limits())
        with subprocess.Popen(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.PIPE,
            start_new_session=True,
        ) as student:
            for descriptor in command.opened_fds:
                os.close(descriptor)
            answer = student.stdout.read(2) if student.stdout else b""
            print(time.perf_counter() - begun if answer == b"up" else "failed", flush=True)


@contextlib.contextmanager
def worker(name: str, ros: RosInstallation, submission: str) -> Iterator[subprocess.Popen[str]]:
    """Start the worker of a tier."""
    request = {"isolation": name, "runtime": to_json(ros.runtime), "submission": submission}
    argv = (str(ros.runtime.executable), "-s", "-B", str(Path(__file__).resolve()), "inside", json.dumps(request))
    paths = [*map(str, ros.runtime.python_paths), str(HOST.parents[1])]
    environment = {**runtime_environment(ros.runtime), "PYTHONPATH": ":".join(paths), "HOME": submission}
    command = isolation_from_name(name).worker_command(argv, environment, ())
    with subprocess.Popen(
        command.argv,
        env=dict(command.environment),
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        text=True,
        start_new_session=True,
    ) as process:
        try:
            yield process
        finally:
            process.kill()


def started(process: subprocess.Popen[str]) -> float:
    """Let a worker start one node and return the seconds it took."""
    assert process.stdin is not None
    assert process.stdout is not None
    process.stdin.write("go\n")
    process.stdin.flush()
    return float(process.stdout.readline())


def holding(ros: RosInstallation) -> list[str]:
    """Return the tiers that hold here, and none."""
    names = []
    for name in (*ISOLATING, "none"):
        with contextlib.suppress(EnvironmentFault):
            choose_isolation(name, Machine(ros))
            names.append(name)
    return names


def main() -> None:
    """Print one line for each tier."""
    rounds = int(sys.argv[1]) if len(sys.argv) > 1 else 15
    ros = find_ros()
    with contextlib.ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory(prefix="grade-overhead-"))
        Path(folder).chmod(0o755)
        workers = {name: stack.enter_context(worker(name, ros, folder)) for name in holding(ros)}
        took: dict[str, list[float]] = {name: [] for name in workers}
        for process in workers.values():
            started(process)  # reading from disk for the first time does not count as overhead
        for _ in range(rounds):
            for name, process in workers.items():
                took[name].append(started(process))
    without = statistics.median(took["none"])
    print(f"one node start, {rounds} rounds, user {os.geteuid()}, medians")
    for name, seconds in took.items():
        median = statistics.median(seconds)
        spread = f"{min(seconds) * 1e3:.0f} to {max(seconds) * 1e3:.0f}"
        print(f"  {name:<16} {median * 1e3:5.0f} ms ({spread} ms)   {median / without:.2f} of none")


if __name__ == "__main__":
    if sys.argv[1:2] == ["inside"]:
        inside(json.loads(sys.argv[2]))
    else:
        main()
