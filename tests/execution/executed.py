"""A session whose students' processes are all executed, as where none can be forked into a sandbox."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, cast

from grader.core.errors import EnvironmentFault
from grader.execution.domains import private_domains, shared_domains
from grader.execution.recording_session import RecordingSession
from grader.execution.sandbox.protocol import Command, Isolation, WorkerView
from grader.execution.supervisor import Recorder

#: A worker is told the name of its tier and finds out itself what it can do; this one finds that it cannot fork.
EXECUTING_WORKER = """
import os, sys
os.chdir("/")
del sys.argv[1]
from grader.execution.sandbox import bubblewrap, tiers
bubblewrap.ENTERABLE = (1000,)
tiers.InPlace.can_fork = False
from grader.execution.worker_main import main
main()
"""


class Executed:
    """A tier into which no process can be forked.

    Args:
        usual: The tier.
    """

    can_fork = False

    def __init__(self, usual: Isolation) -> None:
        self._usual = usual

    def __getattr__(self, name: str) -> Any:
        return getattr(self._usual, name)

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker; see `Isolation.worker_command`."""
        *python, option, module, request = argv
        assert option == "-m"
        argv = [*python, "-c", EXECUTING_WORKER, module, request]
        return self._usual.worker_command(argv, environment, pass_fds, view)


@contextlib.contextmanager
def executing(session: RecordingSession, workers: int) -> Iterator[RecordingSession]:
    """Open a session in the folder and the tier of another one, in which every student's process is executed.

    Raises EnvironmentFault if processes of that tier are executed anyway.
    """
    if not session.isolation.can_fork:
        raise EnvironmentFault(
            f"isolation {session.isolation.name}: expected a tier whose processes are forked, found none"
        )
    tier = cast("Isolation", Executed(session.isolation))
    runtime = session.ros.runtime
    domains = shared_domains() if tier.shares_network else private_domains()
    with Recorder(tier, runtime, domains, scratch=session.folder, workers=workers) as recorder:
        yield replace(session, isolation=tier, recorder=recorder)
