"""The tier `none`: processes without walls, for machines on which none can be built."""

from __future__ import annotations

import secrets
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.execution.sandbox.environment import student_environment
from grader.execution.sandbox.protocol import Command, Limits, StudentProcess, WorkerView
from grader.execution.sandbox.starting import (
    HOST,
    by_resource,
    loopback_only,
    require_domain,
    start_command,
    worker_on_shared_network,
)

NAME = "none"


@dataclass(frozen=True, slots=True)
class Plain:
    """No isolation: students' processes see what the caller sees.

    They still have an exact environment, a working directory that is thrown away, and limits; not on the number of
    processes, which the kernel would count over all of the user's.
    """

    @property
    def name(self) -> str:
        """Short name that reports show."""
        return NAME

    @property
    def shares_network(self) -> bool:
        """The caller's network is used: domains have to be reserved."""
        return True

    @property
    def submission_seen_at(self) -> str:
        """Empty: the submission is seen where it lies."""
        return ""

    @property
    def host_seen_at(self) -> str:
        """Where the `host` package lies."""
        return str(HOST)

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
        """Return the command that starts a student's process.

        Raises:
            HarnessError: No ROS domain was given: on a shared network nodes of different runs would talk.
        """
        require_domain(process, NAME)
        folder = Path(tempfile.gettempdir()) / f"grade-student-{secrets.token_hex(8)}"
        start = start_command(str(folder), made=True, limits=by_resource(limits))
        environment = student_environment(process, folder / "home")
        environment |= loopback_only(environment)
        argv = (*start, str(process.runtime.executable), *process.arguments)
        return Command(argv, environment, tuple(process.pass_fds))
