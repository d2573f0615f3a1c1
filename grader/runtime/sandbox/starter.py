"""Starts students' processes by forking a process that has imported rclpy already, instead of executing Python."""

from __future__ import annotations

import contextlib
import json
import os
import signal
import socket
import subprocess
from collections.abc import Mapping
from contextlib import ExitStack
from pathlib import Path
from typing import IO, Any

from grader.runtime.ros_installation import PythonRuntime
from grader.runtime.sandbox import start
from grader.runtime.sandbox.environment import quick_discovery, student_environment
from grader.runtime.sandbox.protocol import Placeholder, PreparedSandbox, StudentProcess
from grader.runtime.sandbox.starter_process import StarterProcess, execute

#: Seconds until the starter has imported rclpy, and until a sandbox is ready or a process has been forked.
READY_S, FORKED_S = 60.0, 20.0
MODULE = "starter.py"
#: Forks of one process have the same hashes of strings, and so the same order of sets. No seed of Python's could give a
#: fork other ones: Python reads it once, at its start. A program that may use the order of a set is executed instead.
HASH_SEED = "0"
KILLED = -signal.SIGKILL


class StartedProcess:
    """A process that a starter has forked, with the interface of `subprocess.Popen` that the worker uses."""

    stdout: IO[bytes]
    stderr: IO[bytes]

    def __init__(
        self,
        placeholder: subprocess.Popen[bytes] | None,
        control: socket.socket,
        stdout: IO[bytes],
        stderr: IO[bytes],
    ) -> None:
        self._placeholder = placeholder
        self._control = control
        self.stdout, self.stderr = stdout, stderr
        self.returncode: int | None = None
        self._received = b""
        told = self._next(FORKED_S)
        if "pid" not in told:
            raise OSError("the process was not started")
        self.pid: int = told["pid"]

    @property
    def roots(self) -> tuple[int, ...]:
        """The process, and the first process of its sandbox, if it has one: that adopts its orphans."""
        return (self.pid,) if self._placeholder is None else (self.pid, self._placeholder.pid)

    def poll(self) -> int | None:
        """Return the exit code, or the signal as a negative number; None if the process is running."""
        if self.returncode is None:
            with contextlib.suppress(subprocess.TimeoutExpired):
                self.wait(0.0)
        return self.returncode

    def wait(self, timeout: float | None = None) -> int:
        """Wait for the end and return the exit code; raises subprocess.TimeoutExpired."""
        if self.returncode is None:
            try:
                self.returncode = int(self._next(timeout).get("code", KILLED))
            except (TimeoutError, BlockingIOError) as error:
                raise subprocess.TimeoutExpired("student", timeout or 0.0) from error
        return self.returncode

    def _next(self, timeout: float | None) -> dict[str, Any]:
        """Return the starter's next message; empty if the starter or its fork is gone."""
        self._control.settimeout(timeout)
        while b"\n" not in self._received:  # both messages may come at once
            try:
                received = self._control.recv(100)
            except ConnectionError:
                return {}
            if not received:
                return {}
            self._received += received
        line, _, self._received = self._received.partition(b"\n")
        told: dict[str, Any] = json.loads(line)
        return told

    def close(self) -> None:
        """End what is left of the process and its sandbox."""
        self._control.close()
        if self._placeholder is not None:
            _end(self._placeholder)


def starter_command(clock: str, runtime: PythonRuntime, host_folder: str, users: int = 1) -> dict[str, Any]:
    """Return the arguments of `execute` for a starter that so many processes use; see `Starter`."""
    nothing = StudentProcess(runtime, Path(host_folder), Path("/"), (), {"PYTHONHASHSEED": HASH_SEED}, ())
    return {
        "argv": [str(runtime.executable), "-s", "-u", "-B", "-X", "utf8", f"{host_folder}/{MODULE}"],
        "told": {
            "clock": clock,
            "users": users,
            "python_paths": [str(path) for path in runtime.python_paths],
            "sandbox": start.__file__,
        },
        "environment": {
            **student_environment(nothing, Path("/nonexistent")),
            **quick_discovery(host_folder, runtime),
        },
    }


class Starter:
    """One starter process, for one clock.

    Args:
        clock: `virtual` or `wall`.
        runtime: Interpreter and ROS.
        host_folder: Where students' processes see the host package; the same folder is there for the worker.
        executed: The process, if it has been executed before.
    """

    def __init__(
        self, clock: str, runtime: PythonRuntime, host_folder: str, executed: StarterProcess | None = None
    ) -> None:
        self._line, self._process = executed or execute(**starter_command(clock, runtime, host_folder))
        self._ready = False

    def start(
        self,
        sandbox: PreparedSandbox,
        program: Mapping[str, Any],
        command: tuple[str, ...],
        connection: socket.socket,
        stdin: int | None = None,
    ) -> StartedProcess:
        """Start a process in a sandbox.

        Args:
            sandbox: The sandbox.
            program: The request of `program.run`.
            command: The command that runs the program after a new start of Python, if it cannot run in a fork.
            connection: The process's end of its connection to the grader.
            stdin: Its standard input; None for an empty one.
        """
        with ExitStack() as ours, ExitStack() as theirs:
            placeholder: subprocess.Popen[bytes] | None = None
            inside: tuple[int, int] | None = None
            if sandbox.placeholder is not None:
                theirs.callback(os.close, sandbox.placeholder.status_fd)
                placeholder = _begun(sandbox.placeholder)
                ours.callback(_end, placeholder)
                inside = (_pid_inside(placeholder, sandbox.placeholder.status_fd), placeholder.pid)
            request = {
                "enter": inside,
                "environment": dict(sandbox.environment),
                "restrictions": dict(sandbox.restrictions),
                "program": dict(program),
                "command": list(command),
            }
            told = theirs.enter_context(os.fdopen(os.memfd_create("request"), "wb+", buffering=0))
            told.write(json.dumps(request).encode())
            told.seek(0)
            source = os.open(os.devnull, os.O_RDONLY) if stdin is None else os.dup(stdin)
            theirs.callback(os.close, source)
            outputs = []
            passed = [told.fileno(), source]
            for _ in range(2):
                reading, writing = os.pipe()
                outputs.append(ours.enter_context(os.fdopen(reading, "rb", buffering=0)))
                theirs.callback(os.close, writing)
                passed.append(writing)
            self._await_ready()
            control, its_end = socket.socketpair()
            ours.enter_context(control)
            theirs.enter_context(its_end)
            socket.send_fds(self._line, [b"1"], [*passed, connection.fileno(), its_end.fileno()])
            theirs.close()
            process = StartedProcess(placeholder, control, *outputs)
            ours.pop_all()
            return process

    def _await_ready(self) -> None:
        """Wait until the starter has imported what all processes need; raises OSError if it ends before."""
        if not self._ready:
            self._line.settimeout(READY_S)
            if self._line.recv(16) != b"ready":
                raise OSError("the starter has ended")
            self._ready = True

    def close(self) -> None:
        """End the starter and what it has started."""
        self._line.close()
        self._process.kill()
        self._process.wait()


def _begun(placeholder: Placeholder) -> subprocess.Popen[bytes]:
    """Start a placeholder."""
    try:
        return subprocess.Popen(
            placeholder.command.argv,
            env=dict(placeholder.command.environment),
            pass_fds=placeholder.command.pass_fds,
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            start_new_session=True,
            bufsize=0,
        )
    finally:
        for descriptor in placeholder.command.opened_fds:
            os.close(descriptor)


def _pid_inside(placeholder: subprocess.Popen[bytes], status_fd: int) -> int:
    """Return the pid of the first process in a sandbox once all of it is in place; raises OSError if it ends before."""
    assert placeholder.stdin is not None
    assert placeholder.stdout is not None
    status = b""
    while not status.endswith(b"\n"):
        received = os.read(status_fd, 4096)
        if not received:
            raise OSError("the sandbox was not built")
        status += received
    placeholder.stdin.write(b"1")
    if placeholder.stdout.read(1) != b"1":  # only the program in the sandbox answers
        raise OSError("the sandbox was not built")
    pid: int = json.loads(status.splitlines()[0])["child-pid"]
    return pid


def _end(placeholder: subprocess.Popen[bytes]) -> None:
    """End a placeholder and with it everything in its sandbox."""
    for pipe in (placeholder.stdin, placeholder.stdout):
        if pipe is not None:
            pipe.close()
    with contextlib.suppress(ProcessLookupError):
        os.killpg(placeholder.pid, signal.SIGKILL)
    placeholder.wait()
