"""Builds commands that go through `start.py`, which sandboxes and limits a process without namespaces."""

from __future__ import annotations

import functools
import json
import platform
import secrets
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.core.errors import EnvironmentFault, HarnessError
from grader.core.limits import Limits
from grader.execution.sandbox import seccomp
from grader.execution.sandbox.environment import PACKAGE, dds_profile, distro_of, student_environment
from grader.execution.sandbox.exposure import (
    STUDENT_GROUP,
    closed_folders,
    make_readable,
    secrets_within,
    some_user,
    view_of,
)
from grader.execution.sandbox.protocol import Command, StudentProcess
from grader.execution.sandbox.seccomp import flat_filter
from grader.execution.sandbox.start import landlock_version

HERE = Path(__file__).parent
HOST = PACKAGE / "student_host"
DEVICES = ("/dev/null", "/dev/zero", "/dev/full", "/dev/random", "/dev/urandom")
#: The first Landlock version that restricts signals.
WITH_SIGNALS = 6


@dataclass(frozen=True, slots=True)
class Ground:
    """The surroundings of a sandboxed process."""

    scratch: Path  # the folder in which its own folder is created; any user may enter it
    loopback: bool  # whether to restrict Fast DDS to the loopback address, because the network is shared
    as_root: bool  # whether this process is root; the student's then runs as another user


def start_command(
    folder: str, *, made: bool = False, limits: Mapping[str, int] | None = None, **further: object
) -> tuple[str, ...]:
    """Return the beginning of a command line; the program and its arguments follow. See `start.py`."""
    request = {"folder": folder, "made": made, "scratch": 0, "limits": dict(limits or {})}
    request |= {"user": None, "processes": 0, "walls": None, **further}
    return (sys.executable, "-I", "-S", str(HERE / "start.py"), json.dumps(request))


def by_resource(limits: Limits) -> dict[str, int]:
    """Return the limits that hold for each process alone, by their names in `resource`."""
    return {
        "RLIMIT_AS": limits.address_space_bytes,
        "RLIMIT_NOFILE": limits.open_files,
        "RLIMIT_FSIZE": limits.file_bytes,
        "RLIMIT_CORE": 0,
        "RLIMIT_CPU": limits.processor_s,
    }


def loopback_only(environment: Mapping[str, str]) -> dict[str, str]:
    """Keep Fast DDS to the loopback address, on both sides: there is no network of one's own."""
    return dds_profile(HERE, "loopback", distro_of(environment))


def worker_on_shared_network(argv: Sequence[str], environment: Mapping[str, str], pass_fds: tuple[int, ...]) -> Command:
    """Return the command of a worker without a network of its own, in its own session; it is killed with the caller."""
    return Command((*start_command("/"), *argv), {**environment, **loopback_only(environment)}, tuple(pass_fds))


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


def sandboxed_command(process: StudentProcess, limits: Limits, ground: Ground) -> Command:
    """Return the command of a student's process behind Landlock and a filter, in the caller's own namespaces.

    As root the process becomes another user, and the staged copy is made readable by everyone.
    """
    if ground.as_root:
        make_readable(process.submission)
    folder = ground.scratch / f"grade-student-{secrets.token_hex(8)}"
    environment = student_environment(process, folder / "home")
    environment |= loopback_only(environment) if ground.loopback else {}
    # Without RLIMIT_RTPRIO a privileged parent's would hold.
    start = start_command(
        str(folder),
        made=True,
        scratch=limits.scratch_bytes,
        limits={**by_resource(limits), "RLIMIT_RTPRIO": 0, "RLIMIT_MSGQUEUE": 0},
        processes=limits.processes,
        user=[some_user(), STUDENT_GROUP] if ground.as_root else None,
        walls=_walls(process, ground),
    )
    return Command((*start, str(process.runtime.executable), *process.arguments), environment, tuple(process.pass_fds))


def _walls(process: StudentProcess, ground: Ground) -> dict[str, object]:
    bound = view_of((*process.runtime.read_paths, process.runtime.executable)).bound
    host = (process.host_folder,) if process.host_folder else ()
    own = (process.submission, *host, *(HERE.glob("loopback*.xml") if ground.loopback else ()))
    return {
        "read": [str(path) for path in (*bound, *own)],
        "hidden": [str(path) for path in secrets_within(bound, process.runtime)],
        "devices": DEVICES,
        "tcp": not ground.loopback,
        "reach": ground.as_root and bool(closed_folders((*bound, *own, process.runtime.executable))),
        "filter": flat_filter(signals=_version() < WITH_SIGNALS).hex(),
    }


@functools.cache
def _version() -> int:
    return landlock_version()
