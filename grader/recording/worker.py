"""The trusted worker: runs plans one after another in a network of its own, and answers each with a trace.

Usage: python -m grader.recording.worker JSON, with an object of `isolation`, `runtime` and `line` (a descriptor).
A plan is a JSON line on the descriptor, the answer a JSON line with `trace` or `problem`.
"""

from __future__ import annotations

import json
import os
import socket
import sys
import time
import traceback
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from grader.model.errors import HarnessError
from grader.model.trace import Trace
from grader.recording.codec import trace_to_json
from grader.recording.guard import Guard
from grader.recording.isolation.environment import quick_discovery
from grader.recording.isolation.protocol import Isolation, PythonRuntime, StudentProcess, runtime_from_json
from grader.recording.isolation.tiers import isolation_from_name
from grader.recording.plan import Plan, plan_from_json
from grader.recording.student import LOG_FORMAT, Student

#: A run on the wall clock whose reference slipped is repeated so often before the scenario is undecided.
WALL_TRIES = 3
#: Processor seconds that a node may use until it first blocks, its imports included, and between two such moments.
START_CPU_S = 10.0
WAKE_UP_CPU_S = 5.0
#: Real seconds that a node may wait for something that is neither ROS nor time, such as a keyboard.
BLOCKED_S = 5.0


class Worker:
    """Starts students' processes and conducts them.

    Args:
        isolation: The tier that student processes are started in.
        runtime: Interpreter and ROS.
    """

    def __init__(self, isolation: Isolation, runtime: PythonRuntime) -> None:
        self._isolation = isolation
        self._runtime = runtime

    def run(self, plan: Plan, domain: int) -> dict[str, Any]:
        """Run one plan and return its trace as JSON values."""
        tries = WALL_TRIES if plan.clock == "wall" else 1
        deadline_ns = time.monotonic_ns() + plan.limits.wall_ns
        trace = self._record(plan, domain)
        for _ in range(tries - 1):
            if not trace.harness_problem or time.monotonic_ns() > deadline_ns:
                break
            trace = self._record(plan, domain)
        return trace_to_json(trace)

    def _record(self, plan: Plan, domain: int) -> Trace:
        students: list[Student] = []
        with ExitStack() as stack:
            stack.callback(stop, students)
            for name, file in plan.processes:
                students.append(self._start(plan, name, file, domain))
            # rclpy takes long to import: the students' processes start meanwhile.
            from grader.recording.conductor import Conductor  # noqa: PLC0415
            from grader.recording.observer import Observer  # noqa: PLC0415
            from grader.recording.wall import WallConductor  # noqa: PLC0415

            observer = Observer(domain, plan.limits)
            stack.callback(observer.close)
            guard = stack.enter_context(Guard(students, plan.limits))
            for student in students:
                _await_ready(student)
            conductor = WallConductor if plan.clock == "wall" else Conductor
            return guard.reviewed(conductor(plan, students, observer).run())

    def _start(self, plan: Plan, name: str, file: str, domain: int) -> Student:
        ours, theirs = socket.socketpair()
        root = self._isolation.submission_seen_at or plan.root
        request = {
            "fd": theirs.fileno(),
            "root": root,
            "file": file,
            "seed": plan.host_seed,
            "clock": plan.clock,
            "log_format": LOG_FORMAT,
            "python_paths": [str(p) for p in self._runtime.python_paths],
            "limits": {"start_cpu_s": START_CPU_S, "wake_up_cpu_s": WAKE_UP_CPU_S, "blocked_s": BLOCKED_S},
        }
        launcher = f"{self._isolation.host_seen_at}/launcher.py"
        command = self._isolation.student_command(
            StudentProcess(
                runtime=self._runtime,
                host_folder=Path(__file__).resolve().parents[1] / "host",
                submission=Path(plan.root),
                arguments=("-s", "-u", "-B", "-X", "utf8", launcher, json.dumps(request)),
                environment={
                    "ROS_DOMAIN_ID": str(domain),
                    "RCUTILS_COLORIZED_OUTPUT": "0",
                    **quick_discovery(self._isolation.host_seen_at, self._runtime),
                    "PYTHONHASHSEED": str(int(plan.host_seed[:8], 16)),
                },
                pass_fds=(theirs.fileno(),),
            ),
            plan.limits,
        )
        try:
            return Student.start(name, root, command, ours, plan.limits)
        except OSError:
            ours.close()
            raise
        finally:
            theirs.close()


def _await_ready(student: Student) -> None:
    """Wait until a process is about to run its file; until then nothing of the student's has run."""
    if not student.is_ready():
        raise RuntimeError(f"a student's process did not start: {student.stopped or _last_words(student)}")


def _last_words(student: Student) -> str:
    student.drain()
    words = [getattr(line, "text", "") for line in student.output(0, final=True)]
    return " | ".join(words[-3:])[:500] or "no output"


def stop(students: list[Student]) -> None:
    """Send the stop signal to every process that still runs, give it a moment, end it."""
    for student in students:
        if not student.ended:
            student.tell({"stop": True})
    for student in students:
        student.kill()
        student.close()


def main() -> None:
    """Serve plans until the supervisor hangs up."""
    request = json.loads(sys.argv[1])
    line = socket.socket(fileno=request["line"])
    worker = Worker(isolation_from_name(request["isolation"]), runtime_from_json(request["runtime"]))
    commands, answers = line.makefile("r"), line.makefile("w")
    for command in commands:
        data = json.loads(command)
        try:
            answer: dict[str, Any] = {"trace": worker.run(plan_from_json(data["plan"]), data["domain"])}
        except HarnessError as error:
            answer = {"problem": error.message}
        except Exception:
            answer = {"problem": traceback.format_exc()[-4000:]}
        answers.write(json.dumps(answer) + "\n")
        answers.flush()


if __name__ == "__main__":
    os.chdir("/")
    main()
