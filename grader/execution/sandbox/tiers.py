"""The sandbox tiers: `bubblewrap-flat`, `landlock` and `none`, and every tier by its name."""

from __future__ import annotations

import os
import secrets
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from grader.core.checkup import TIERS
from grader.core.errors import EnvironmentFault
from grader.core.limits import Limits
from grader.execution.sandbox.bubblewrap import ROOT_NAME, USER_NAME, Bubblewrap
from grader.execution.sandbox.environment import student_environment
from grader.execution.sandbox.protocol import Command, Isolation, StudentProcess, WorkerView
from grader.execution.sandbox.starting import (
    HOST,
    Ground,
    by_resource,
    loopback_only,
    require_domain,
    require_landlock,
    sandboxed_command,
    start_command,
    worker_on_shared_network,
)

FLAT_NAME, LANDLOCK_NAME, PLAIN_NAME = "bubblewrap-flat", "landlock", "none"
#: The tiers that isolate anything, strongest first.
ISOLATING = (ROOT_NAME, USER_NAME, FLAT_NAME, LANDLOCK_NAME)
#: Where a submission is seen: where it lies, because the tiers in this module have no file view of their own.
IN_PLACE = ""
#: A worker's own memory file system, which disappears with it.
SCRATCH = Path("/dev/shm")  # noqa: S108


def isolation_from_name(name: str) -> Isolation:
    """Return a tier without testing whether it works.

    Raises EnvironmentFault if there is no such tier, it is for another user, or a part of it is missing.
    """
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


@dataclass(frozen=True, slots=True)
class FlatBubblewrap:
    """The tier `bubblewrap-flat`: bubblewrap around the worker; Landlock, seccomp and limits around each student in it.

    It is for systems that let bubblewrap create namespaces, but do not let it be nested, such as Ubuntu with its
    restriction of user namespaces.
    """

    name: ClassVar[str] = FLAT_NAME
    shares_network: ClassVar[bool] = False
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)
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

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process, from inside the worker."""
        return sandboxed_command(process, limits, Ground(SCRATCH, loopback=False, as_root=self.outer.as_root))


@dataclass(frozen=True, slots=True)
class Landlock:
    """The tier `landlock`: Landlock, seccomp, limits and another user, for containers that allow no namespaces.

    The network is the caller's: outgoing traffic is contained only if there is no interface but `lo`.
    """

    name: ClassVar[str] = LANDLOCK_NAME
    shares_network: ClassVar[bool] = True
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)
    as_root: bool  # whether this process is root; students then run as another user

    @classmethod
    def here(cls) -> Landlock:
        """Return the isolation for this machine; raises EnvironmentFault if its kernel or processor has none."""
        require_landlock()
        return cls(as_root=os.geteuid() == 0)

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
        return worker_on_shared_network(argv, environment, pass_fds)

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process; raises HarnessError without a ROS domain."""
        require_domain(process, LANDLOCK_NAME)
        ground = Ground(Path(tempfile.gettempdir()), loopback=True, as_root=self.as_root)
        return sandboxed_command(process, limits, ground)


@dataclass(frozen=True, slots=True)
class Plain:
    """The tier `none`: students' processes see everything that the caller sees.

    They still have a controlled environment, a temporary working directory and limits. The number of processes is not
    limited, because the kernel would count all processes of the user.
    """

    name: ClassVar[str] = PLAIN_NAME
    shares_network: ClassVar[bool] = True
    submission_seen_at: ClassVar[str] = IN_PLACE
    host_seen_at: ClassVar[str] = str(HOST)

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the worker, in a session of its own; it is killed when the caller dies."""
        del view
        return worker_on_shared_network(argv, environment, pass_fds)

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process; raises HarnessError without a ROS domain."""
        require_domain(process, PLAIN_NAME)
        folder = Path(tempfile.gettempdir()) / f"grade-student-{secrets.token_hex(8)}"
        start = start_command(str(folder), made=True, limits=by_resource(limits))
        environment = student_environment(process, folder / "home")
        environment |= loopback_only(environment)
        argv = (*start, str(process.runtime.executable), *process.arguments)
        return Command(argv, environment, tuple(process.pass_fds))
