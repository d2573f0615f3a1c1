"""Starts a file with nothing of the grader in its process, and watches that process from outside."""

from __future__ import annotations

import contextlib
import os
import signal
import socket
from collections.abc import Sequence
from pathlib import Path, PurePosixPath

from grader.runtime.host.packages import ENTRY_POINT, import_folders, layout_of, start_of
from grader.runtime.host.protocol import Answer, Exited, Report, Stop
from grader.runtime.model.limits import Limits
from grader.runtime.model.submission import Beginning
from grader.runtime.model.trace import LogRecord, OutputLine
from grader.runtime.plan import PlannedStart
from grader.runtime.sandbox.protocol import Command
from grader.runtime.worker.console import last_traceback
from grader.runtime.worker.student_process import NodeProcess


def bare_arguments(  # noqa: PLR0913  what is known of a file
    here: Path,
    root: str,
    file: str,
    begins: Beginning | None,
    given: PlannedStart | None = None,
    scripts: Sequence[Sequence[str]] = (),
    *,
    installed: bool = False,
    imported: Sequence[str] = (),
) -> tuple[str, ...]:
    """Return the Python arguments that run a file as its author would.

    A file in a package is started as `ros2 run` starts it. If a file starts nothing by itself, the command calls its
    main() or spins its only node, as in virtual time.

    Args:
        here: The staged submission.
        root: The path at which the process sees the submission.
        file: The file, relative to `root`.
        begins: What it starts, as a contained process has read; None if that is not known.
        given: What it is started with; None for its file alone.
        scripts: Name, module and function of each console script of its package.
        installed: Whether the file is installed as it is and run as a script.
        imported: The folders of installed Python packages, relative to `root`.
    """
    given = given or PlannedStart(file)
    path = f"{root}/{file}"
    setup = _with_parameter_files(given)
    plain = (*given.arguments, *(("--ros-args", *given.ros_arguments) if given.ros_arguments else ()))
    beside = str(PurePosixPath(path).parent)
    script = f"runpy.run_path({path!r}, run_name='__main__')"
    if begins is None:
        return _by_import(script, [beside], path, setup, plain) if setup else ("-u", path, *plain)
    layout = layout_of(str(here), file, installed=installed)
    start = start_of(str(here), file, layout, begins.offers_main, given.executable, scripts)
    own = [str(here / folder) for folder in imported]
    packages = import_folders(str(here), layout.module, layout.base)
    folders = [f for f in dict.fromkeys((start.base, layout.base, *packages, *own)) if f]
    seen = [root + folder.removeprefix(str(here)) for folder in folders]
    if layout.module and not layout.base:  # its package is the submission's own folder
        seen.append(str(PurePosixPath(root).parent))
    if start.function:
        called = f"importlib.import_module({start.module!r}).{start.function}()"
        return _by_import(f"sys.exit({called})" if start.way == ENTRY_POINT else called, seen, path, setup, plain)
    module = start.module or PurePosixPath(file).stem
    seen = seen if start.module else list(dict.fromkeys([beside, *(seen if layout.package is not None else ())]))
    if run := _help(begins, module):
        return _by_import(run, seen, path, setup, plain)
    if start.module:
        return _by_import(
            f"runpy.run_module({module!r}, run_name='__main__', alter_sys=True)", seen, path, setup, plain
        )
    return _by_import(script, seen, path, setup, plain) if setup or len(seen) > 1 else ("-u", path, *plain)


def _help(begins: Beginning, module: str) -> str:
    """Return code that starts a file which starts nothing by itself; empty if that is not needed or not possible."""
    if begins.starts:
        return ""
    if begins.main:
        return f"importlib.import_module({module!r}).main()"
    if not begins.node:
        return ""
    return f"import rclpy; rclpy.init(); rclpy.spin(importlib.import_module({module!r}).{begins.node}())"


def _with_parameter_files(given: PlannedStart) -> str:
    """Return code that writes the parameter files and adds them to the command line; usually empty."""
    if not given.parameter_files:
        return ""
    return f"""
import os, sys
sys.argv += {["--ros-args"] if not given.ros_arguments else []!r}
for _number, (_name, _text) in enumerate({given.copied_files!r}, 1):
    _path = os.path.join(os.environ["HOME"], f"parameters_{{os.getpid()}}_{{_number}}", _name)
    os.makedirs(os.path.dirname(_path), exist_ok=True)
    open(_path, "w", encoding="utf-8").write(_text)
    sys.argv += ["--params-file", _path]
"""


def _by_import(
    run: str, folders: Sequence[str], path: str, setup: str, arguments: Sequence[str] = ()
) -> tuple[str, ...]:
    beside = str(PurePosixPath(path).parent)
    behind = "" if beside in folders else f"; sys.path.append({beside!r})"
    begin = f"import importlib, runpy, sys; sys.path[:1] = {list(folders)!r}; sys.argv[0] = {path!r}{behind}"
    return ("-u", "-c", f"{setup}{begin}; {run}", *arguments)


#: Name of the sandbox process, which starts the student's.
SANDBOX = "bwrap"
#: Maximum number of sandbox processes around the student's.
DEEP = 8
INTERRUPTED = 128 + signal.SIGINT


class BareProcess(NodeProcess):
    """A process without a connection to the grader: it runs at once, is watched, and is stopped by a signal."""

    @classmethod
    def begin(cls, name: str, root: str, command: Command, limits: Limits) -> BareProcess:
        """Start the process."""
        ours, unused_end = socket.socketpair()
        student = cls.start(name, root, command, ours, limits)
        assert isinstance(student, cls)
        student.unused_end = unused_end
        return student

    #: The other end of the socket pair, which no process uses.
    unused_end: socket.socket | None = None
    _told_end = False

    def tell(self, answer: Answer) -> None:
        """Send SIGINT if the answer is to stop; drop any other answer, since no host would read it."""
        if isinstance(answer, Stop) and not self._has_ended():
            with contextlib.suppress(OSError):
                os.kill(self._program(), signal.SIGINT)

    def reports(self) -> list[Report | None]:
        """Report the end of the process once; None stands for an end by a signal or a limit."""
        if self._told_end or not self._has_ended():
            return []
        self._told_end = True
        self.drain()
        code = self.process.wait()
        if self.stopped or not (0 <= code <= 128 or code in (INTERRUPTED, -signal.SIGINT)):
            return [None]
        fault = last_traceback(self._last.decode("utf-8", "backslashreplace"), self.root) if code == 1 else None
        return [Exited(code=INTERRUPTED if code == -signal.SIGINT else code, fault=fault)]

    def close(self) -> None:
        """Close the file descriptors of a process that has ended."""
        super().close()
        if self.unused_end is not None:
            self.unused_end.close()

    def _has_ended(self) -> bool:
        return self.process.poll() is not None

    def _parsed(self, t_ns: int, stream: str, text: str) -> list[LogRecord | OutputLine]:
        """Return the output as lines; log records are parsed from them at the end of the run."""
        return [*self._lines(t_ns, stream, text)]

    def _program(self) -> int:
        """Return the pid of the student's program, inside of the sandbox's own processes."""
        pid = self.process.pid
        for _ in range(DEEP):
            children = _children(pid)
            if _name(pid) != SANDBOX or not children:
                break
            pid = children[0]
        return pid


def _children(pid: int) -> list[int]:
    try:
        return [int(child) for child in Path(f"/proc/{pid}/task/{pid}/children").read_text(encoding="ascii").split()]
    except (OSError, ValueError):
        return []


def _name(pid: int) -> str:
    try:
        return Path(f"/proc/{pid}/comm").read_text(encoding="utf-8", errors="replace").strip()
    except OSError:
        return ""
