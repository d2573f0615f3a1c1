"""Reads the project files and programs of a staged submission, all by one contained process."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

from grader.grading.submissions.contained_reader import Asked, ReaderAnswer, Tell, told_by_process
from grader.grading.submissions.projects import Packages
from grader.grading.submissions.sources import Programs
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import Project
from grader.runtime.model.submission import ReadProgram


@dataclass(frozen=True, slots=True)
class SubmissionContents:
    """What the files of a submission hold."""

    projects: tuple[Project, ...]  # its packages, outermost first
    programs: Mapping[str, ReadProgram]  # its Python files by path
    notes: tuple[str, ...]  # on what could not be read


def read_contents(root: Path, likely: Iterable[str], tell: Tell = told_by_process) -> SubmissionContents:
    """Return what the files of a staged submission hold; whatever that is, it costs at most what the limits say.

    Args:
        root: The staged submission.
        likely: The paths or names of the files that are probably run.
        tell: Reads the files; whatever it says is checked.

    Raises:
        HarnessError: The files cannot be read, or the machine is too busy for it.
    """
    packages, programs, asked = Packages(root), Programs(root, likely), Asked()
    packages.ask(asked)
    programs.ask(asked)
    answer = ReaderAnswer(tell(asked.input()) if asked.packages or asked.programs else b"")
    projects, of_projects = packages.told(answer)
    found, of_programs = programs.told(answer)
    return SubmissionContents(projects, found, (*of_projects, *of_programs))
