"""A session whose students' processes are executed, as where no process can enter a sandbox, and not forked."""

from __future__ import annotations

import contextlib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import fields, replace

from grader.core.errors import EnvironmentFault
from grader.execution.domains import private_domains
from grader.execution.recording_session import RecordingSession
from grader.execution.sandbox.bubblewrap import Bubblewrap
from grader.execution.sandbox.protocol import Command, WorkerView
from grader.execution.supervisor import Recorder

#: A worker is told the name of its tier and finds out itself what the kernel can do; this one finds an old kernel.
OLD_KERNEL = """
import os, sys
os.chdir("/")
del sys.argv[1]
from grader.execution.sandbox import bubblewrap
bubblewrap.ENTERABLE = (1000,)
from grader.execution.worker_main import main
main()
"""


class ExecutedBubblewrap(Bubblewrap):
    """A tier of bubblewrap on a kernel before Linux 5.8."""

    __slots__ = ()

    def worker_command(
        self,
        argv: Sequence[str],
        environment: Mapping[str, str],
        pass_fds: tuple[int, ...],
        view: WorkerView | None = None,
    ) -> Command:
        """Return the command that starts the trusted worker; see `Bubblewrap.worker_command`."""
        *python, option, module, request = argv
        assert option == "-m"
        return super().worker_command([*python, "-c", OLD_KERNEL, module, request], environment, pass_fds, view)


@contextlib.contextmanager
def executing(session: RecordingSession, workers: int) -> Iterator[RecordingSession]:
    """Open a session in the folder and the tier of another one, in which every student's process is executed.

    Raises EnvironmentFault if processes of that tier are executed anyway.
    """
    usual = session.isolation
    if not isinstance(usual, Bubblewrap) or not usual.can_enter:
        raise EnvironmentFault(f"isolation {usual.name}: expected a tier whose processes are forked, found none")
    same = {field.name: getattr(usual, field.name) for field in fields(usual)}
    tier = ExecutedBubblewrap(**{**same, "can_enter": False})
    runtime, domains = session.ros.runtime, private_domains()
    with Recorder(tier, runtime, domains, scratch=session.folder, workers=workers) as recorder:
        yield replace(session, isolation=tier, recorder=recorder)
