"""The interface between recording and sandboxes, which every tier implements."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Protocol

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import KIB
from grader.runtime.ros_installation import PythonRuntime

#: The folder in the home of a process with what packages install, for launch files and those whom they start.
INSTALLED = "installed"


@dataclass(frozen=True, slots=True)
class StudentProcess:
    """One student process to start."""

    runtime: PythonRuntime  # interpreter and ROS
    # The folder of the host package, the only part of the grader that the process may read; None if the process may
    # read no part of the grader.
    host_folder: Path | None
    submission: Path  # the staged copy, which the process sees read-only at `submission_seen_at`
    # Interpreter arguments, e.g. `("-I", "-u", "/grader_host/host/launcher.py")`; paths as the process sees them.
    arguments: tuple[str, ...]
    environment: Mapping[str, str]  # variables beyond those of the sandbox and the runtime
    pass_fds: tuple[int, ...]  # descriptors that the process inherits besides 0, 1 and 2, with the same numbers
    # The folder whose files the process gets copies of that it may write to, and these files, relative to it
    beside: Path = Path()
    copied: tuple[str, ...] = ()
    # Whether the copies stand in for the submission; otherwise they are in the working directory
    writable: bool = False
    # The working directory, relative to a submission that may be written to, or absolute in tiers without a view of
    # files for each process; None for an empty folder of its own
    working: str | None = None
    # Where the process sees `host_folder` in tiers with a view of files for each; None for the usual place
    host_at: Path | None = None
    own: str = ""  # part of the name of its own folder, in tiers without a view of files for each process
    # The prefix that is also found below `INSTALLED` in its home, where a launch file was told that it is; None for a
    # process that no launch file has started. Tiers without a view of files for each process have it nowhere else.
    installed: Path | None = None


@dataclass(frozen=True, slots=True)
class WorkerView:
    """The files of this machine that the trusted worker can see."""

    read: tuple[Path, ...]  # absolute paths of files and folders, read-only; one that does not exist is left out
    hidden: tuple[Path, ...]  # folders within them that it does not need
    own: tuple[Path, ...]  # files and folders within the hidden ones that it does need, read-only
    # Folders that it may write to; the submission that students' processes see is in one of them
    write: tuple[Path, ...]


@dataclass(frozen=True, slots=True)
class Command:
    """The arguments of `subprocess.Popen` for one process; not reusable, because the start consumes `opened_fds`.

    Start it with `start_new_session=True`, so that Ctrl-C in the terminal reaches only the grader, and from a thread
    that outlives it: the kernel kills the process when the thread that started it ends.
    """

    argv: tuple[str, ...]  # complete list of arguments
    environment: Mapping[str, str]  # complete environment of the program
    pass_fds: tuple[int, ...]  # descriptors to inherit
    # Descriptors that the tier opened for this start; the caller closes them afterwards
    opened_fds: tuple[int, ...] = ()


@dataclass(frozen=True, slots=True)
class Placeholder:
    """A process in a sandbox that writes what it reads, and keeps the sandbox until it ends."""

    command: Command
    status_fd: int  # where bubblewrap writes the pid of its child as JSON


@dataclass(frozen=True, slots=True)
class PreparedSandbox:
    """A sandbox for a process that is forked: what it enters, and the restrictions that it then puts on itself."""

    restrictions: Mapping[str, object]  # the request of `start.prepare`
    environment: Mapping[str, str]  # the complete environment of the process
    placeholder: Placeholder | None = None  # its namespaces are entered; None to stay in those of the starter


def start_request(folder: str, **further: object) -> dict[str, object]:
    """Return the request of `start.prepare` that enters a folder, and puts further restrictions on the process."""
    nothing: dict[str, object] = {"made": False, "scratch": 0, "limits": {}, "user": None, "processes": 0}
    nothing |= {"beside": "", "copied": (), "into": "work", "working": "work"}
    return {"folder": folder, **nothing, "confinement": None, "filter": "", **further}


#: Signals and timers that wait to be delivered: the kernel counts them together for all processes of a user, so that
#: one process could take them from all others. A program that uses timers of this kind has one or two.
PENDING_SIGNALS = 256
#: Memory that may not be swapped out is counted in the same way; this was the kernel's default until Linux 5.16.
LOCKED_BYTES = 64 * KIB


def by_resource(limits: Limits) -> dict[str, int]:
    """Return the limits that hold for each process alone, by their names in `resource`."""
    return {
        "RLIMIT_AS": limits.address_space_bytes,
        "RLIMIT_NOFILE": limits.open_files,
        "RLIMIT_FSIZE": limits.file_bytes,
        "RLIMIT_CORE": 0,
        "RLIMIT_SIGPENDING": PENDING_SIGNALS,
        "RLIMIT_MEMLOCK": LOCKED_BYTES,
        "RLIMIT_MSGQUEUE": 0,
        "RLIMIT_RTPRIO": 0,  # or that of a privileged parent would hold
        "RLIMIT_CPU": limits.processor_s,
    }


class Isolation(Protocol):
    """One sandbox tier. A tier is sent to a worker by its `name`."""

    @property
    def name(self) -> str:
        """Short name for reports, e.g. `bubblewrap-root`."""

    @property
    def shares_network(self) -> bool:
        """Whether the worker uses the caller's network, where other graders and nodes may run."""

    @property
    def submission_seen_at(self) -> str:
        """Absolute folder at which a student process sees its submission; empty if that is the real path."""

    def submission_of(self, process: StudentProcess) -> str:
        """Return the absolute folder at which a process sees its submission, or its own copy of it."""

    @property
    def host_seen_at(self) -> str:
        """Absolute folder at which a student process sees the host package, with `launcher.py`."""

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker with this complete environment.

        It sees the files of the view, if the tier can hide files; None for all.
        """

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student process inside the worker, which shares only its network."""

    @property
    def can_fork(self) -> bool:
        """Whether a process can be forked into a sandbox of this tier, so that it need not be executed in it."""

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the sandbox that `student_command` builds, for a process that is forked into it."""
