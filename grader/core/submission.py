"""Submissions, and runs: a recorded submission, which is the only input of judging."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path

from grader.core.report import Environment, Reproduction
from grader.core.trace import Trace


@dataclass(frozen=True, slots=True)
class StudentFile:
    """One file of the submission that an exercise asks for.

    Attributes:
        wanted: File name the exercise asks for, e.g. `velocity_publisher.py`.
        found: Path inside the submission, POSIX form and relative, or None if there is none.
        similar: Names in the submission that look like a misspelling of `wanted`, nearest first.
        others: Further files of the wanted name that were not taken, relative paths.
    """

    wanted: str
    found: str | None
    similar: tuple[str, ...] = ()
    others: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Submission:
    """A student's files, staged so that they can be run.

    Attributes:
        name: Name shown in reports.
        path: Where it came from, as the user typed it.
        root: The staged copy that runs, read-only by convention.
        digest: `sha256:` and 64 hex digits over relative names and contents of all staged files.
        files: Wanted file name -> the file that was found for it.
        notes: Sentences about the files that readers must know.
    """

    name: str
    path: str
    root: Path
    digest: str
    files: Mapping[str, StudentFile] = field(default_factory=dict)
    notes: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Run:
    """A submission with its recordings.

    Attributes:
        submission: The submission; judging never reads files in its `root`.
        traces: (exercise id, scenario id) -> trace; a scenario with a missing file has none.
        sources: Wanted file name -> its text, for finding the causes of lost points.
        environment: The software that it was recorded with.
        seed: Determines every drawn value.
        duration_s: Wall time of the run.
        notes: Sentences about the files and the machine that readers must know.
        reproduce: How to reproduce the recording and the report.
    """

    submission: Submission
    traces: Mapping[tuple[str, str], Trace]
    sources: Mapping[str, str]
    environment: Environment
    seed: int
    duration_s: float = 0.0
    notes: tuple[str, ...] = ()
    reproduce: Reproduction = field(default_factory=Reproduction)


def main_not_called(file: str, line: int = 0) -> str:
    """Return the note on a file in which nothing calls main().

    Args:
        file: Its path in the submission.
        line: The line of main, from 1; 0 leaves it out.
    """
    place = f"{file}:{line}" if line else file
    problem = f"{place}: nothing calls main(), so `python3 {file}` would do nothing"
    return f"{problem}; add: if __name__ == '__main__': main()"
