"""Watches for audit events of the student's program that could manipulate the process: internals, processes, sockets.

It also notices the import of a module whose source was not read before the run: from an archive, without a source, or
written by the program. Nothing is forbidden. The grader is informed before the action continues, and runs the program
again as a bare process.
"""

from __future__ import annotations

import os
import sys
from types import FrameType
from typing import Any

from . import machine
from .link import Link
from .protocol import Reached

#: Prefixes of event names from https://docs.python.org/3/library/audit_events.html.
EVENTS = (
    *("gc.", "sys._", "sys.settrace", "sys.setprofile", "sys.addaudithook", "ctypes.", "object.__", "cpython."),
    *("subprocess.", "os.system", "os.fork", "os.posix_spawn", "os.exec", "os.spawn", "os.kill", "pty.", "mmap."),
    *("socket.__new__", "socket.connect", "socket.bind", "compile", "exec", "code.__new__", "function.__new__"),
    *("marshal.", "pickle.", "fcntl.", "resource.", "signal.", "builtins.breakpoint"),
)
#: Folders with information about processes and the machine.
FOLDERS = ("/proc", "/sys", "/dev/fd", "/dev/shm")  # noqa: S108 - looked for in what is opened
#: Events of opening files and listing folders.
LOOKS = ("open", "os.listdir", "os.scandir")
#: Modules of the standard library that generate code for class definitions, and the events that this raises.
MAKERS = ("collections/__init__.py", "dataclasses.py", "enum.py", "typing.py")
MAKING = ("compile", "exec", "sys._", "object.__", "function.__new__", "code.__new__")
#: The event of an import that runs the code of a module, and the name under which one is reported that was not read.
RUNS, UNREAD = "exec", "import of a module that was not read"
#: How many callers in the standard library are skipped to find the student's code.
CALLERS = 12
#: The most different events that are reported.
MOST = 20
#: The most names of events, and of files, of which is remembered what they are.
NAMES = 2000
#: Where code belongs to: to the student, to a module of the standard library that generates code or to another one, or
#: to nobody whose events count.
STUDENT, MAKER, LIBRARY, ELSEWHERE = "student", "maker", "library", "elsewhere"


class Watch:
    """Reports each kind of event once.

    Args:
        link: The connection to the grader.
        root: The submission's folder.
    """

    def __init__(self, link: Link, root: str) -> None:
        self._link = link
        self._root = os.path.join(root, "")
        self._library = os.path.dirname(os.__file__)
        self._packages = os.path.join(self._library, "site-packages")
        self._makers = frozenset(os.path.join(self._library, maker) for maker in MAKERS)
        self._matters: dict[str, bool] = {}
        self._places: dict[str, str] = {}
        self._told: set[str] = set()
        # Where installed modules are: what the program could import before it ran. The host imports its own ones late
        # where a module of the program hides one of Python.
        own = os.path.dirname(os.path.abspath(__file__))
        installed = (own, *(p for p in sys.path if p and not p.startswith(self._root[:-1])))
        self._installed = tuple(os.path.join(p, "") for p in installed)
        # In some tiers this folder is in /dev/shm.
        self._temporary = os.path.join(os.environ.get("TMPDIR") or machine.TEMPORARY, "")
        self._inside = False

    def install(self) -> None:
        """Install the audit hook, which cannot be removed."""
        sys.addaudithook(self._hear)

    def _hear(self, event: str, arguments: tuple[Any, ...]) -> None:
        # Looking at a frame raises audit events as well, so most calls end here.
        if self._inside:
            return
        matters = self._matters.get(event)
        if matters is None:
            matters = _remembered(self._matters, event, event in LOOKS or event.startswith(EVENTS))
        if not matters or (event in LOOKS and not self._looks_around(arguments)):
            return
        self._inside = True
        try:
            if event == RUNS and UNREAD not in self._told and self._is_unread(arguments, sys._getframe(1)):
                self._tell(UNREAD)
            if event not in self._told and len(self._told) < MOST and self._by_student(sys._getframe(1), event):
                self._tell(event)
        except Exception:  # noqa: S110 - an error here must not change what the program does
            pass
        finally:
            self._inside = False

    def _tell(self, what: str) -> None:
        if self._link.is_free():
            self._told.add(what)
            self._link.send(Reached(what))

    def _is_unread(self, arguments: tuple[Any, ...], frame: FrameType) -> bool:
        """Return whether an import runs code that comes neither from a source of the submission nor an installed one.

        The grader reads every source of a submission before it runs; a compiled module names the source that it had.
        """
        if not arguments or not frame.f_code.co_filename.startswith("<frozen"):
            return False
        file = getattr(arguments[0], "co_filename", "")
        # Of what importlib calls exec by, or makes and runs a compiled module by: those of numpy run text.
        given = frame.f_locals.get("args", ())
        names = given[1] if len(given) > 1 and isinstance(given[1], dict) else {}
        compiled = getattr(given[0], "__spec__", given[0]) if given else None
        origin = str(getattr(names.get("__spec__", compiled), "origin", None) or file)
        if file.startswith("<frozen") or origin.startswith((self._library, *self._installed)):
            return False
        return not (origin.startswith(self._root) and origin.endswith(".py") and os.path.isfile(origin))

    def _looks_around(self, arguments: tuple[Any, ...]) -> bool:
        """Return whether a file or folder that is opened tells about processes and the machine."""
        place = arguments[0] if arguments else None
        if type(place) is not str:
            return False
        place = os.path.normpath(place) if ".." in place else place
        return place == "/" or (place.startswith(FOLDERS) and not place.startswith(self._temporary))

    def _by_student(self, frame: FrameType | None, event: str) -> bool:
        for _ in range(CALLERS):
            if frame is None:
                return False
            file = frame.f_code.co_filename
            place = self._places.get(file) or _remembered(self._places, file, self._place(file))
            if place == STUDENT:
                return True
            if place == ELSEWHERE or (place == MAKER and event.startswith(MAKING)):
                return False
            frame = frame.f_back
        return False

    def _place(self, file: str) -> str:
        """Return where the code of a file belongs to."""
        if file.startswith(self._root) or (file.startswith("<") and not file.startswith("<frozen")):
            return STUDENT
        if file == machine.__file__:
            return LIBRARY  # a function of the standard library that the host has replaced
        if not file.startswith(("<frozen", self._library)) or file.startswith(self._packages):
            return ELSEWHERE
        if file.startswith("<frozen importlib"):
            return ELSEWHERE  # the event comes from importing a module
        return MAKER if file in self._makers else LIBRARY


def _remembered(known: dict[str, Any], name: str, found: Any) -> Any:
    """Return what was found of a name, and keep it unless the program invents names without end."""
    if len(known) < NAMES:
        known[name] = found
    return found
