"""Submissions: a student's files, staged so that they can be run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from pathlib import Path

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import Project


@dataclass(frozen=True, slots=True)
class StudentFile:
    """One file of the submission that an exercise asks for."""

    wanted: str  # file name the exercise asks for, e.g. `velocity_publisher.py`
    found: str | None  # path inside the submission, POSIX form and relative, or None if there is none
    similar: tuple[str, ...] = ()  # names in the submission that look like a misspelling of `wanted`, nearest first
    others: tuple[str, ...] = ()  # further files of the wanted name that were not taken, relative paths
    # If it is missing: other .py files in the submission that no exercise asks for, likeliest first
    candidates: tuple[str, ...] = ()
    likely: bool = False  # whether the first candidate resembles it, by its name or its text
    executable: str = ""  # name of the entry point that runs the file, if it was found by one
    problem: str = ""  # why there is none, if more is known than that


@dataclass(frozen=True, slots=True)
class Submission:
    """A student's files, staged so that they can be run."""

    name: str  # name shown in reports
    path: str  # where it came from, as the user typed it
    root: Path  # the staged copy that runs, read-only by convention
    digest: str  # `sha256:` and 64 hex digits over relative names and contents of all staged files
    files: Mapping[str, StudentFile] = field(default_factory=dict)  # wanted file name -> the file that was found for it
    notes: tuple[str, ...] = ()  # sentences about the files that readers must know
    projects: tuple[Project, ...] = ()  # its ROS packages, outermost first


@dataclass(frozen=True, slots=True)
class Definition:
    """The definition of a message type: its text, including nested types, and its hash, which starts with `RIHS01_`."""

    text: str
    digest: str


#: What to do with a notebook that was handed in.
EXPORT_NOTEBOOK = "export it as a Python script (File > Save and Export Notebook As > Executable Script)"


def is_notebook(file: str) -> bool:
    """Return whether a file is a Jupyter notebook, by its name."""
    return file.casefold().endswith(".ipynb")
