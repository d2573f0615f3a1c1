"""The seam between recording and sandboxes: what every isolation tier offers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from grader.core.limits import Limits
from grader.execution.ros_installation import PythonRuntime

__all__ = [
    "Command",
    "Isolation",
    "Limits",
    "StudentProcess",
    "WorkerView",
]


@dataclass(frozen=True, slots=True)
class StudentProcess:
    """One student process to be started.

    Attributes:
        runtime: Interpreter and ROS.
        host_folder: The folder of the `host` package, the only part of the grader that the process may read; None if it
            is to read nothing of the grader.
        submission: The staged copy; seen read-only by the process at `submission_seen_at`.
        arguments: Interpreter arguments, e.g. `("-I", "-u", "/grader_host/host/launcher.py")`; paths as the process
            sees them.
        environment: Variables beyond those of the sandbox and the runtime.
        pass_fds: Descriptors the process inherits besides 0, 1 and 2, same numbers inside.
    """

    runtime: PythonRuntime
    host_folder: Path | None
    submission: Path
    arguments: tuple[str, ...]
    environment: Mapping[str, str]
    pass_fds: tuple[int, ...]


@dataclass(frozen=True, slots=True)
class WorkerView:
    """What the trusted worker needs to see of this machine's files.

    Attributes:
        read: Absolute files and folders, read-only; one that does not exist is left out.
        hidden: Folders within them that it does not need.
        own: Files and folders, read-only, that it needs all the same of what is hidden.
        write: Folders that it may write to; what students' processes are to see of a submission lies in one.
    """

    read: tuple[Path, ...]
    hidden: tuple[Path, ...]
    own: tuple[Path, ...]
    write: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class Command:
    """A process ready for `subprocess.Popen`, once: what `opened_fds` lists is read by the start and then of no use.

    Start it with `start_new_session=True`, so that Ctrl-C in the terminal reaches the grader and nobody else, and from
    a thread that outlives it: the process dies with the thread that started it.

    Attributes:
        argv: Full argument list.
        environment: The whole environment of the launched program.
        pass_fds: Descriptors to be inherited.
        opened_fds: Descriptors that the isolation opened for this start; the caller closes them afterwards.
    """

    argv: tuple[str, ...]
    environment: Mapping[str, str]
    pass_fds: tuple[int, ...]
    opened_fds: tuple[int, ...] = ()


class Isolation(Protocol):
    """One tier of isolation. Instances are plain values that survive a trip through JSON by their `name`."""

    @property
    def name(self) -> str:
        """Short name that reports show, e.g. `bubblewrap-root`."""
        ...

    @property
    def shares_network(self) -> bool:
        """Whether the worker's network is the caller's, where other graders and nodes may be."""
        ...

    @property
    def submission_seen_at(self) -> str:
        """Absolute folder at which a student process sees its submission; empty if it sees it where it lies."""
        ...

    @property
    def host_seen_at(self) -> str:
        """Absolute folder at which a student process sees the `host` package; `launcher.py` lies in it."""
        ...

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker.

        Args:
            argv: Program and arguments.
            environment: Its whole environment.
            pass_fds: Descriptors it inherits.
            view: The files it sees, where the tier can hide any; None for all.
        """
        ...

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student process from inside the worker, sharing only its network."""
        ...
