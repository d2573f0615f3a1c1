"""Starts students' processes: imports rclpy once, and for each process forks itself into a sandbox.

Usage: starter.py JSON, with an object of `line`, the descriptor of a socket; `clock`, empty to import nothing and to
execute each process's command; `users`, how many processes wait until it is ready; `python_paths`; and `sandbox`, the
path of the module that sandboxes a process. Each message on the socket has these descriptors: the request, the standard
streams of the process, its connection to the grader, and a socket for its pid and its exit code.

This process has seen no plan, seed, path or file of any submission: a request is read by the fork that it is for.
"""

from __future__ import annotations

import contextlib
import fcntl
import gc
import importlib
import importlib.util
import json
import os
import select
import signal
import socket
import sys
from typing import Any

FROM_LAUNCHER = "launcher.py"
#: Descriptors of a message, in this order.
REQUEST, INPUT, OUTPUT, ERRORS, CONNECTION, CONTROL = range(6)
#: The number of the connection to the grader in a student's process.
CONNECTED = 3
#: The number of the pidfd of its parent, until it is sandboxed.
PARENT = 4


def load(path: str, name: str) -> Any:
    """Load a module from a file."""
    spec = importlib.util.spec_from_file_location(name, path)
    if spec is None or spec.loader is None:
        raise ImportError(path)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def main() -> None:
    """Prepare what all processes have in common, and start one for each message."""
    gc.disable()  # imports make many objects, and no garbage
    told = json.loads(sys.argv[1])
    sys.path[:1] = told["python_paths"]
    line = socket.socket(fileno=told["line"])
    program = load(os.path.join(os.path.dirname(os.path.abspath(__file__)), FROM_LAUNCHER), "_launcher").load_package()
    sandbox = load(told["sandbox"], "_sandbox")
    host = program.Host(told["clock"]) if told["clock"] else None
    if host is not None:
        host.install_ros()
        program.warm_up()
    gc.collect()
    gc.freeze()
    gc.enable()
    signal.signal(signal.SIGCHLD, reap)
    for _ in range(told["users"]):
        line.send(b"ready")
    while True:
        data, descriptors, _, _ = socket.recv_fds(line, 1, CONTROL + 1)
        if not data:
            return
        parent = os.getpid()
        if not os.fork():
            with contextlib.suppress(BaseException):
                signal.signal(signal.SIGCHLD, signal.SIG_DFL)
                line.close()
                attend(descriptors, parent, sandbox, program, host)
            os._exit(1)
        for descriptor in descriptors:
            os.close(descriptor)


def reap(*_: object) -> None:
    """Wait for the children that have ended."""
    with contextlib.suppress(ChildProcessError):
        while os.waitpid(-1, os.WNOHANG)[0]:
            pass


def attend(descriptors: list[int], parent: int, sandbox: Any, program: Any, host: Any) -> None:
    """Start one student's process, report its pid and exit code, and kill it when the grader closes the socket."""
    sandbox.die_with(parent)
    with open(descriptors[REQUEST], "rb") as source:
        request: dict[str, Any] = json.load(source)
    control = socket.socket(fileno=descriptors[CONTROL])
    if request["enter"]:
        sandbox.enter(*request["enter"])
    own = os.pidfd_open(os.getpid())
    child = os.fork()
    if not child:
        try:
            control.close()
            become(request, [*descriptors[INPUT:CONTROL], own], sandbox, program, host)
        except BaseException as error:  # the grader shows it if the process never reports
            os.write(2, f"{type(error).__name__}: {error}\n".encode())
        os._exit(1)
    for descriptor in (0, 1, 2, *descriptors[INPUT:CONTROL]):
        os.close(descriptor)
    control.sendall(json.dumps({"pid": child}).encode() + b"\n")
    process = os.pidfd_open(child)
    poller = select.poll()
    poller.register(process, select.POLLIN)
    poller.register(control, select.POLLHUP)
    if any(found == process for found, _ in poller.poll()):
        # The pid stays taken until the grader needs it no more.
        ended = os.waitid(os.P_PID, child, os.WEXITED | os.WNOWAIT)
        code = 0 if ended is None else ended.si_status if ended.si_code == os.CLD_EXITED else -ended.si_status
        with contextlib.suppress(OSError):
            control.sendall(json.dumps({"code": code}).encode() + b"\n")
            control.recv(1)
    with contextlib.suppress(OSError):
        os.killpg(child, signal.SIGKILL)
    with contextlib.suppress(OSError):
        os.kill(child, signal.SIGKILL)
    os.waitpid(child, 0)  # so that its processor time counts
    os._exit(0)


def become(request: dict[str, Any], descriptors: list[int], sandbox: Any, program: Any, host: Any) -> None:
    """Turn this process into a student's; never returns.

    Raises an exception before any of the student's code has run if a part of that fails.

    Args:
        request: What to become.
        descriptors: The standard streams, the connection to the grader, and a pidfd of the parent.
        sandbox: The module that sandboxes this process.
        program: The module that runs programs.
        host: The host of a program; None to execute the command.
    """
    os.setsid()
    # First to numbers beyond, because one of them may have a number that another one gets.
    for number, descriptor in enumerate([fcntl.fcntl(d, fcntl.F_DUPFD_CLOEXEC, PARENT + 1) for d in descriptors]):
        os.dup2(descriptor, number, inheritable=number != PARENT)
    first = PARENT + 1
    if program.KEPT is not None:
        os.closerange(first, program.KEPT)
        first = program.KEPT + 1
    os.closerange(first, os.sysconf("SC_OPEN_MAX"))
    os.environ.clear()
    os.environ.update(request["environment"])
    sandbox.make_memory_private()
    sandbox.prepare(request["restrictions"])
    # From here on the kernel ends this process with its parent, which may have ended before.
    if sandbox.select([PARENT], [], [], 0)[0]:
        raise OSError("the process that waits for this one has ended")
    os.close(PARENT)
    if host is None or program.hides_modules(request["program"]):
        os.execv(request["command"][0], request["command"])  # noqa: S606 - becoming the program is the purpose
    program.keep_interfaces(request["program"])
    program.run({**request["program"], "fd": CONNECTED}, host)


if __name__ == "__main__":
    main()
