"""Lets a program that stops at `breakpoint()` talk to the terminal of whoever runs its test."""

from __future__ import annotations

import contextlib
import errno
import importlib.util
import os
import pdb
import socket
import sys
from collections.abc import Callable, Iterator, Mapping
from types import FrameType
from typing import Any, TextIO

#: Modules of which a debugger with threads of its own needs the real functions, in the order of their imports.
REAL = ("_thread", "time", "select", "_queue", "threading", "queue")
#: How many programs of a test may wait for a debugger, each at a port of its own.
MOST_PORTS = 20


def let_stop(told: Mapping[str, Any], program: str) -> None:
    """Let `breakpoint()` and the module `pdb` reach whoever runs the test.

    Args:
        told: `terminal`, the path of its device, and empty for none; and for debuggers that attach themselves, `port`,
            the first one to listen at, and `folder`, that of the package debugpy.
        program: What the program is called.
    """
    reading, writing = (
        os.open(told["terminal"] or os.devnull, way | os.O_NOCTTY) for way in (os.O_RDONLY, os.O_WRONLY)
    )
    reads = os.fdopen(reading, encoding="utf-8", errors="replace")
    writes = os.fdopen(writing, "w", encoding="utf-8", buffering=1)
    if told["terminal"]:
        _debug_at(reads, writes, program)
    if "port" in told:
        _attach_at(told["port"], told["folder"], lambda text: print(f"\n{program} {text}", file=writes))


def _debug_at(reads: TextIO, writes: TextIO, program: str) -> None:
    """Let all debuggers of the module `pdb` read from a terminal and write to it.

    The standard streams of a program are not a terminal: its output is recorded, and it has no input. Other processes
    use the terminal as well, so it does not become that of this process, and Ctrl-C there reaches only whoever runs
    the test.
    """

    class Debugger(pdb.Pdb):
        def __init__(self, *arguments: Any, **named: Any) -> None:
            # The stop signal is for the program, which would otherwise enter the debugger with it.
            super().__init__(*arguments, **{**named, "stdin": reads, "stdout": writes, "nosigint": True})

        def set_trace(self, frame: FrameType | None = None, *arguments: Any, **named: Any) -> None:
            self.message(f"\n{program} has stopped, and virtual time with it; c continues")
            super().set_trace(frame or sys._getframe().f_back, *arguments, **named)

    pdb.Pdb = Debugger  # type: ignore[misc]


def _attach_at(port: int, path: str, say: Callable[[str], None]) -> None:
    """Let a program wait, at its first breakpoint, until a debugger has attached itself at a port, as VS Code does.

    Args:
        port: The first port to try, 0 for any; the program takes the next one that nobody listens at.
        path: The folder of the package debugpy.
        say: Tells whoever runs the test.
    """
    attached: list[Any] = []

    def stop(*_: object, **__: object) -> None:
        if not attached:
            attached.append(_listening(port, path, say))
        attached[0].breakpoint()

    sys.breakpointhook = stop


def _listening(port: int, path: str, say: Callable[[str], None]) -> Any:
    """Return the package debugpy, once a debugger has attached itself."""
    sys.path.append(path)
    try:
        with _real_modules():
            import debugpy
            import debugpy.server.api
    finally:
        sys.path.remove(path)
    # without its adapter, which would be a process of its own
    _, number = debugpy.listen(("127.0.0.1", _free_port(port)), in_process_debug_adapter=True)
    say(f"waits for a debugger at 127.0.0.1:{number}, and virtual time with it")
    debugpy.wait_for_client()
    return debugpy


def _free_port(first: int) -> int:
    """Return the first port that nobody listens at; 0, for any, stays 0."""
    for number in range(first, first + MOST_PORTS):
        with socket.socket() as probe, contextlib.suppress(OSError):
            probe.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
            probe.bind(("127.0.0.1", number))
            return number
    raise OSError(errno.EADDRINUSE, f"no port from {first} to {first + MOST_PORTS - 1} is free")


@contextlib.contextmanager
def _real_modules() -> Iterator[None]:
    """Let imports find copies of the modules that virtual time has changed, as Python made them."""
    kept = {name: sys.modules.get(name) for name in REAL}
    try:
        for name in REAL:
            own = kept[name]
            spec = importlib.util.find_spec(name) if own is None else own.__spec__
            assert spec is not None
            assert spec.loader is not None
            sys.modules[name] = copy = importlib.util.module_from_spec(spec)
            spec.loader.exec_module(copy)
        yield
    finally:
        for name, module in kept.items():
            if module is None:
                sys.modules.pop(name, None)
            else:
                sys.modules[name] = module
