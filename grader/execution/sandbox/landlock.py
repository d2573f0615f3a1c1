"""The tier `landlock`: no namespaces, for containers that allow none; Landlock, a filter, limits and another user.

The network is the caller's: what leaves it is contained only where there is no interface but `lo`.
"""

from __future__ import annotations

import os
import tempfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.core.limits import Limits
from grader.execution.sandbox.protocol import Command, StudentProcess, WorkerView
from grader.execution.sandbox.starting import (
    HOST,
    Ground,
    require_domain,
    require_walls,
    walled_command,
    worker_on_shared_network,
)

NAME = "landlock"


@dataclass(frozen=True, slots=True)
class Landlock:
    """The walls that Landlock, seccomp and resource limits give in the namespaces that there are.

    Attributes:
        as_root: Whether this process is root: students then run as another user.
    """

    as_root: bool

    @classmethod
    def here(cls) -> Landlock:
        """Return the isolation for this machine; raises EnvironmentFault if its kernel or processor has none."""
        require_walls()
        return cls(as_root=os.geteuid() == 0)

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
        """Return the command that starts the worker, in a session of its own; it is killed when the caller dies.

        Nothing is hidden from it: that takes namespaces.
        """
        del view
        return worker_on_shared_network(argv, environment, pass_fds)

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process.

        Raises:
            HarnessError: No ROS domain was given: on a shared network nodes of different runs would talk.
        """
        require_domain(process, NAME)
        ground = Ground(Path(tempfile.gettempdir()), loopback=True, as_root=self.as_root)
        return walled_command(process, limits, ground)
