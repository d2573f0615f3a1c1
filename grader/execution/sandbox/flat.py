"""The tier `bubblewrap-flat`: one bubblewrap around the worker, and Landlock and a filter around each student in it.

For systems that let bubblewrap make namespaces, but nothing inside it: Ubuntu's restriction of user namespaces does.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.core.limits import Limits
from grader.execution.sandbox.bubblewrap import Bubblewrap
from grader.execution.sandbox.protocol import Command, StudentProcess, WorkerView
from grader.execution.sandbox.starting import HOST, Ground, require_walls, walled_command

NAME = "bubblewrap-flat"
#: The worker's own, and gone with it: nothing of it reaches a disk.
SCRATCH = Path("/dev/shm")  # noqa: S108


@dataclass(frozen=True, slots=True)
class FlatBubblewrap:
    """Namespaces around the worker, Landlock, seccomp and resource limits around its students.

    Attributes:
        outer: What surrounds the worker.
    """

    outer: Bubblewrap

    @classmethod
    def here(cls) -> FlatBubblewrap:
        """Return the isolation for this machine and user.

        Raises:
            EnvironmentFault: Bubblewrap is missing, or this kernel or processor has no Landlock.
        """
        require_walls()
        return cls(Bubblewrap.here())

    @property
    def name(self) -> str:
        """Short name that reports show."""
        return NAME

    @property
    def shares_network(self) -> bool:
        """Each worker has a network of its own."""
        return False

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
        """Return the command that starts the trusted worker; see `Bubblewrap.worker_command`."""
        return self.outer.worker_command(argv, environment, pass_fds, view)

    def student_command(self, process: StudentProcess, limits: Limits) -> Command:
        """Return the command that starts a student's process, from inside the worker."""
        return walled_command(process, limits, Ground(SCRATCH, loopback=False, as_root=self.outer.as_root))
