"""Submissions: a student's files, staged so that they can be run."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import field
from pathlib import Path

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.projects import ExaminedPackage, Project


class SourceText(str):
    """The text of a student's file, with the syntax tree that a contained process made of it.

    Args:
        text: The text.
        tree: The tree as JSON, or what returns it; None if Python cannot parse the text, or it is too long or too deep
            to be examined.
    """

    __slots__ = ("_tree", "kept")

    def __new__(cls, text: str, tree: bytes | Callable[[], bytes | None] | None = None) -> SourceText:
        """Join a text and its tree."""
        made = super().__new__(cls, text)
        made._tree = tree
        made.kept = None
        return made

    _tree: bytes | Callable[[], bytes | None] | None
    kept: object  # what a reader has made of the tree

    @property
    def tree(self) -> bytes | None:
        """The tree as JSON; None if there is none."""
        return self._tree() if callable(self._tree) else self._tree

    def __reduce__(self) -> tuple[type, tuple[str, bytes | None]]:
        """Return what a copy in another process is made of."""
        return type(self), (str(self), self.tree)


@dataclass(frozen=True, slots=True)
class CompileError:
    """Why Python cannot compile a file, as its parser says it."""

    type: str
    message: str
    line: int | None


@dataclass(frozen=True, slots=True)
class Beginning:
    """What a Python file starts when it is run, and what it has that can be started in its place."""

    starts: bool = False  # whether a statement at its top level may run the program, as opposed to preparing it
    main: bool = False  # whether it defines main() at its top level
    offers_main: bool = False  # whether main() starts it: it needs no arguments, and nothing else starts the module
    node: str = ""  # its only class of a node, if that can be made without arguments


@dataclass(frozen=True, slots=True)
class ReadProgram:
    """What the contained process found in one Python file of a submission."""

    text: SourceText | None = None  # None if it cannot be decoded, or is too long
    inert: bool = False  # whether it holds only comments, texts and `pass`, so that running it does nothing
    begins: Beginning | None = None  # None if Python cannot parse it
    error: CompileError | None = None
    reaches: tuple[str, ...] = ()  # the names by which it reaches into its process, without duplicates
    told: bool = True  # whether its text is here, if it has any: not all are kept


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
    hint: str = ""  # what to do about that problem, if more is known than that


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
    packages: tuple[ExaminedPackage, ...] = ()  # the same, with what their build refuses or leaves out
    programs: Mapping[str, ReadProgram] = field(default_factory=dict)  # path inside the submission -> its Python file


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
