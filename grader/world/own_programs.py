"""Finds the programs of a test where they lie, with their packages, and with what they import that is not installed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from grader.runtime.plan import Plan, derive
from grader.runtime.programs.executables import package_of
from grader.runtime.session import RecordingSession
from grader.runtime.steps import LaunchFailedError
from grader.world.interfaces import let_import, modules_for
from grader.world.programs import Found, Runnable, find_launch_file, find_program


class OwnPrograms:
    """Programs that lie near a test.

    Args:
        session: Installs the shared files of their packages.
        near: Folders in which they are looked for.
        seed: What is drawn in their processes follows from it.
    """

    #: A launch file takes what it needs from where it lies.
    provided: tuple[tuple[str, str], ...] = ()

    def __init__(self, session: RecordingSession, near: Sequence[Path], seed: int) -> None:
        self._session = session
        self._near = near
        self._seed = seed

    def find(self, program: Runnable) -> Found:
        """Find a program; raises SubmissionError if there is none."""
        return find_program(program, self._near)

    def find_launch(self, file: str | Path) -> tuple[Found, tuple[tuple[str, str], ...]]:
        """Find a launch file, and return it with the name of each program that it may start, by the program's file."""
        return find_launch_file(file, self._near)

    def complete(self, plan: Plan, found: Found) -> Plan:
        """Return the plan of one start with its workspace, and with the packages that nobody has installed."""
        package = package_of(found.root / Path(found.file).parent) if found.projects else found.root
        installed = self._session.folder / f"installed_{derive(0, str(found.root))[:16]}"
        prefixes, _ = self._session.install_shares(found.root, found.projects, installed)
        return replace(
            plan,
            root=str(found.root),
            host_seed=derive(self._seed, "program", plan.starts[0].process),
            projects=found.projects,
            prefixes=prefixes,
            interfaces=tuple(dict.fromkeys((*plan.interfaces, *modules_near((package,))))),
        )

    def failure(self, file: str | Path, error: LaunchFailedError) -> Exception:
        """Return the error of a launch file that has raised an exception."""
        del file  # the message names it
        return error


def modules_near(folders: Sequence[Path]) -> tuple[str, ...]:
    """Return where packages are that programs of folders need and nobody has installed; a test may import them too."""
    found = tuple(str(path) for folder in folders for path in modules_for(folder))
    let_import(found)
    return found
