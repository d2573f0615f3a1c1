"""The tier `none`: processes without walls, for machines on which none can be built."""

from __future__ import annotations

import json
import secrets
import sys
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import grader
from grader.model.errors import HarnessError
from grader.recording.isolation.environment import dds_profile, distro_of, student_environment
from grader.recording.isolation.protocol import Command, Limits, StudentProcess

NAME = "none"
START = Path(__file__).with_name("plain_start.py")


@dataclass(frozen=True, slots=True)
class Plain:
    """No isolation: students' processes see what the caller sees.

    They still have an exact environment, a working directory that is thrown away, and limits; not on the number of
    processes, which the kernel would count over all of the user's.

    Attributes:
        why: Why there are no walls, one line for a warning; empty if they were not wanted.
    """

    why: str = ""

    @property
    def name(self) -> str:
        """Short name that reports show."""
        return NAME

    @property
    def submission_seen_at(self) -> str:
        """Empty: the submission is seen where it lies."""
        return ""

    @property
    def host_seen_at(self) -> str:
        """Where the `host` package lies."""
        return str(Path(grader.__file__).resolve().parent / "host")

    def worker_command(self, argv: Sequence[str], environment: Mapping[str, str], pass_fds: tuple[int, ...]) -> Command:
        """Return the command that starts the worker, in a session of its own; it is killed when the caller dies."""
        start = _start("/", made=False, limits={})
        return Command((*start, *argv), {**environment, **_loopback_only(environment)}, tuple(pass_fds))

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process.

        Raises:
            HarnessError: No ROS domain was given: on a shared network nodes of different runs would talk.
        """
        if "ROS_DOMAIN_ID" not in process.environment:
            raise HarnessError("isolation none: expected ROS_DOMAIN_ID for a student's process, found none")
        folder = Path(tempfile.gettempdir()) / f"grade-student-{secrets.token_hex(8)}"
        start = _start(str(folder), made=True, limits=_by_resource(limits))
        environment = student_environment(process, folder / "home")
        environment |= _loopback_only(environment)
        argv = (*start, str(process.runtime.executable), *process.arguments)
        return Command(argv, environment, tuple(process.pass_fds))


def _loopback_only(environment: Mapping[str, str]) -> dict[str, str]:
    """Keep Fast DDS to the loopback address, on both sides: there is no network of its own here."""
    return dds_profile(Path(__file__).parent, "loopback", distro_of(environment))


def _start(folder: str, *, made: bool, limits: Mapping[str, int]) -> tuple[str, ...]:
    request = json.dumps({"folder": folder, "made": made, "limits": dict(limits)})
    return (sys.executable, "-I", "-S", str(START), request)


def _by_resource(limits: Limits) -> dict[str, int]:
    return {
        "RLIMIT_AS": limits.address_space_bytes,
        "RLIMIT_NOFILE": limits.open_files,
        "RLIMIT_FSIZE": limits.file_bytes,
        "RLIMIT_CORE": 0,
        "RLIMIT_CPU": limits.processor_s,
    }
