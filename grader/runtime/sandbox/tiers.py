"""The sandbox tiers: `bubblewrap-flat`, `landlock` and `none`, and every tier by its name.

The three have no namespaces around a student's process: `start.py` restricts it in those of the worker.
"""

from __future__ import annotations

import functools
import json
import os
import platform
import secrets
import sys
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import field
from pathlib import Path
from typing import ClassVar

from grader.runtime.model.checkup import TIERS
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault, HarnessError
from grader.runtime.model.limits import Limits
from grader.runtime.sandbox import seccomp
from grader.runtime.sandbox.bubblewrap import ROOT_NAME, USER_NAME, Bubblewrap
from grader.runtime.sandbox.environment import PACKAGE, on_loopback, student_environment
from grader.runtime.sandbox.exposure import (
    STUDENT_GROUP,
    closed_folders,
    make_readable,
    secrets_within,
    some_user,
    view_of,
)
from grader.runtime.sandbox.protocol import (
    Command,
    Isolation,
    PreparedSandbox,
    StudentProcess,
    WorkerView,
    by_resource,
    start_request,
)
from grader.runtime.sandbox.seccomp import flat_filter
from grader.runtime.sandbox.start import landlock_version

OWN_NETWORK_NAME = "own-network"
FLAT_NAME, LANDLOCK_NAME, PLAIN_NAME = "bubblewrap-flat", "landlock", "none"
#: The tiers that isolate anything, strongest first.
ISOLATING = (ROOT_NAME, USER_NAME, FLAT_NAME, LANDLOCK_NAME)
#: Where a submission is seen: where it lies, because the tiers in this module have no file view of their own.
IN_PLACE = ""
#: The copy of a submission in the folder of a process.
COPY = "submission"
#: A worker's own memory file system, which disappears with it.
SCRATCH = Path("/dev/shm")  # noqa: S108
HERE = Path(__file__).parent
HOST = PACKAGE / "runtime" / "host"
DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
#: What the worker's own bubblewrap puts there (`environment.account_files`).
ACCOUNT_FILES = ("/etc/passwd", "/etc/group", "/etc/hosts", "/etc/nsswitch.conf")
_version = functools.cache(landlock_version)
#: The first Landlock version that restricts signals.
WITH_SIGNALS = 6


def isolation_from_name(name: str) -> Isolation:
    """Return a tier without testing whether it works.

    Raises EnvironmentFault if there is no such tier, it is for another user, or a part of it is missing.
    """
    if name == OWN_NETWORK_NAME:
        return OwnNetwork(Bubblewrap.here())
    if name not in TIERS:
        raise EnvironmentFault(f"isolation: expected one of {', '.join(TIERS)}, found {name}")
    if name == LANDLOCK_NAME:
        return Landlock.here()
    if name == FLAT_NAME:
        return FlatBubblewrap.here()
    if name == PLAIN_NAME:
        return Plain()
    if is_for_others(name):
        wanted, fix = ("root", "run it with sudo") if name == ROOT_NAME else ("an ordinary user", "")
        raise EnvironmentFault(f"isolation {name}: expected {wanted}, found user {os.geteuid()}", fix)
    return Bubblewrap.here()


def is_for_others(name: str) -> bool:
    """Return whether a tier is for root and this user is not root, or the other way round."""
    as_root = os.geteuid() == 0
    return name == (USER_NAME if as_root else ROOT_NAME)


class InPlace(ABC):
    """What the tiers have in common whose students' processes stay in the namespaces of the worker."""

    __slots__ = ()
    can_fork: ClassVar[bool] = True

    @abstractmethod
    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the restrictions of a student's process."""

    def submission_of(self, process: StudentProcess) -> str:
        """Return where a process sees its submission; see `Isolation.submission_of`."""
        return seen_in_place(process, self.scratch)

    @property
    @abstractmethod
    def scratch(self) -> Path:
        """The folder in which processes have folders of their own."""

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process, from inside the worker."""
        sandbox = self.prepared_sandbox(process, limits)
        argv = (*start_command(sandbox.restrictions), str(process.runtime.executable), *process.arguments)
        return Command(argv, sandbox.environment, tuple(process.pass_fds))


@dataclass(frozen=True, slots=True)
class FlatBubblewrap(InPlace):
    """The tier `bubblewrap-flat`: bubblewrap around the worker; Landlock, seccomp and limits around each student in it.

    It is for systems that let bubblewrap create namespaces, but do not let it be nested, such as Ubuntu with its
    restriction of user namespaces.
    """

    name: ClassVar[str] = FLAT_NAME
    shares_network: ClassVar[bool] = False
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)
    scratch: ClassVar[Path] = SCRATCH
    outer: Bubblewrap  # the bubblewrap around the worker

    @classmethod
    def here(cls) -> FlatBubblewrap:
        """Return the isolation for this machine and user; raises EnvironmentFault without bubblewrap or Landlock."""
        require_landlock()
        return cls(Bubblewrap.here())

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker; see `Bubblewrap.worker_command`."""
        return self.outer.worker_command(argv, environment, pass_fds, view)

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the restrictions of a student's process."""
        ground = Ground(SCRATCH, loopback=False, as_root=self.outer.as_root, landlock=_version())
        return confined(process, limits, ground)


class _OnSharedNetwork(InPlace):
    """What the tiers have in common that use the caller's network."""

    __slots__ = ()
    shares_network: ClassVar[bool] = True
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)

    @property
    def scratch(self) -> Path:
        """The folder in which processes have folders of their own."""
        return Path(tempfile.gettempdir())

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the worker, in a session of its own; it is killed when the caller dies.

        Nothing is hidden from it, because that would need namespaces.
        """
        del view
        environment = {**environment, **loopback_only(environment)}
        return Command((*start_command(start_request("/")), *argv), environment, tuple(pass_fds))


@dataclass(frozen=True, slots=True)
class Landlock(_OnSharedNetwork):
    """The tier `landlock`: Landlock, seccomp, limits and another user, for containers that allow no namespaces.

    The network is the caller's: outgoing traffic is contained only if there is no interface but `lo`.
    """

    name: ClassVar[str] = LANDLOCK_NAME
    as_root: bool  # whether this process is root; students then run as another user
    landlock: int = field(default_factory=_version)  # the version of it that the kernel has

    @classmethod
    def here(cls) -> Landlock:
        """Return the isolation for this machine; raises EnvironmentFault if its kernel or processor has none."""
        require_landlock()
        return cls(as_root=os.geteuid() == 0)

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the restrictions of a student's process; raises HarnessError without a ROS domain."""
        require_domain(process, LANDLOCK_NAME)
        ground = Ground(self.scratch, loopback=True, as_root=self.as_root, landlock=self.landlock)
        return confined(process, limits, ground)


@dataclass(frozen=True, slots=True)
class Plain(_OnSharedNetwork):
    """The tier `none`: students' processes see everything that the caller sees.

    They still have a controlled environment, a temporary working directory and limits. The number of processes is not
    limited, because the kernel would count all processes of the user.
    """

    name: ClassVar[str] = PLAIN_NAME

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the limits of a student's process; raises HarnessError without a ROS domain."""
        require_domain(process, PLAIN_NAME)
        folder = process_folder(self.scratch, process)
        environment = environment_in(process, folder)
        environment |= loopback_only(environment)
        request = start_request(str(folder), made=True, limits=by_resource(limits), **copies(process))
        return PreparedSandbox(request, environment)


@dataclass(frozen=True, slots=True)
class OwnNetwork(InPlace):
    """A network of one's own, and no sandbox: for the programs of whoever starts them.

    Processes see and change the same files as the caller, and start in the caller's working directory. Nodes outside
    neither hear nor disturb them.
    """

    name: ClassVar[str] = OWN_NETWORK_NAME
    shares_network: ClassVar[bool] = False
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)
    scratch: ClassVar[Path] = SCRATCH
    outer: Bubblewrap  # the bubblewrap around the worker

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the worker; it sees all files."""
        del view
        return self.outer.worker_command(argv, environment, pass_fds)

    def prepared_sandbox(self, process: StudentProcess, limits: Limits) -> PreparedSandbox:
        """Return the limits of a process."""
        folder = process_folder(self.scratch, process)
        request = start_request(str(folder), made=True, limits=by_resource(limits), **copies(process))
        return PreparedSandbox(request, environment_in(process, folder))


@dataclass(frozen=True, slots=True)
class Ground:
    """The surroundings of a sandboxed process."""

    scratch: Path  # the folder in which its own folder is created; any user may enter it
    loopback: bool  # whether to restrict Fast DDS to the loopback address, because the network is shared
    as_root: bool  # whether this process is root; the student's then runs as another user
    landlock: int  # the version of Landlock that the kernel has


def start_command(request: Mapping[str, object]) -> tuple[str, ...]:
    """Return the beginning of a command line; the program and its arguments follow. See `start.prepare`."""
    return (sys.executable, "-I", "-S", str(HERE / "start.py"), json.dumps(request))


def copies(process: StudentProcess) -> dict[str, object]:
    """Return what a request says about the files that the working directory gets copies of."""
    into = COPY if process.writable else "work"
    within = f"{into}/{process.working}".rstrip("/")
    working = "work" if process.working is None else process.working if process.working.startswith("/") else within
    return {"beside": str(process.beside), "copied": process.copied, "into": into, "working": working}


def environment_in(process: StudentProcess, folder: Path) -> dict[str, str]:
    """Return the environment of a process with a folder of its own."""
    return {**student_environment(process, folder / "home"), "PWD": str(folder / str(copies(process)["working"]))}


def process_folder(scratch: Path, process: StudentProcess) -> Path:
    """Return the folder of a process, which is created when it starts."""
    return scratch / f"grade-student-{process.own or secrets.token_hex(8)}"


def seen_in_place(process: StudentProcess, scratch: Path) -> str:
    """Return where a process sees its submission: its copy in its own folder, or where the submission lies."""
    return str(process_folder(scratch, process) / COPY) if process.writable else str(process.submission)


def loopback_only(environment: Mapping[str, str]) -> dict[str, str]:
    """Keep Fast DDS to the loopback address, on both sides: there is no network of one's own."""
    return on_loopback(HERE, environment)


def require_domain(process: StudentProcess, tier: str) -> None:
    """Raise HarnessError without a ROS domain: on a shared network nodes of different runs would talk."""
    if "ROS_DOMAIN_ID" not in process.environment:
        raise HarnessError(f"isolation {tier}: expected ROS_DOMAIN_ID for a student's process, found none")


def require_landlock() -> None:
    """Raise EnvironmentFault if this kernel has no Landlock or this processor is unknown to the filter."""
    if not seccomp.supports(platform.machine()):
        raise EnvironmentFault(f"sandbox: expected x86_64 or aarch64, found {platform.machine()}")
    if not _version():
        raise EnvironmentFault(
            "sandbox: expected a kernel with Landlock, found none",
            "start Linux 6.2 or newer with landlock in its lsm= list",
        )


def confined(process: StudentProcess, limits: Limits, ground: Ground) -> PreparedSandbox:
    """Return the restrictions of a student's process behind Landlock and a filter, in the caller's own namespaces.

    As root the process becomes another user, and the staged copy is made readable by everyone.
    """
    if ground.as_root:
        make_readable(process.submission)
    folder = process_folder(ground.scratch, process)
    environment = environment_in(process, folder)
    environment |= loopback_only(environment) if ground.loopback else {}
    request = start_request(
        str(folder),
        made=True,
        **copies(process),
        scratch=limits.scratch_bytes,
        limits=by_resource(limits),
        processes=limits.processes,
        user=[some_user(), STUDENT_GROUP] if ground.as_root else None,
        confinement=_confinement(process, ground),
        filter=flat_filter(signals=ground.landlock < WITH_SIGNALS).hex(),
    )
    return PreparedSandbox(request, environment)


def _confinement(process: StudentProcess, ground: Ground) -> dict[str, object]:
    bound = view_of((*process.runtime.read_paths, process.runtime.executable)).bound
    host = (process.host_folder,) if process.host_folder else ()
    own = (
        *(() if process.writable else (process.submission,)),
        *host,
        *(HERE.glob("loopback*.xml") if ground.loopback else ()),
    )
    return {
        "read": [str(path) for path in (*bound, *own, *(() if ground.loopback else ACCOUNT_FILES))],
        "hidden": [str(path) for path in secrets_within(bound, process.runtime.python_paths)],
        "devices": DEVICES,
        "tcp": not ground.loopback,
        "reach": ground.as_root and bool(closed_folders((*bound, *own, process.runtime.executable))),
    }
