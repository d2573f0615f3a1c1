"""The Python files of a submission as the contained process reads them: texts, trees, names that reach internals."""

from __future__ import annotations

import posixpath
import zipfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import Any

from grader.grading.submissions.answers import (
    COSTLY,
    DEEP,
    ERROR_CHARACTERS,
    HASHES,
    LONG,
    LONG_FILE,
    MOST_NAMES,
    NAME_CHARACTERS,
    UNREADABLE,
)
from grader.grading.submissions.contained_reader import Asked, ReaderAnswer, Tell, read_within, told_by_process
from grader.runtime.model.limits import MAX_PROGRAM_BYTES, MAX_SOURCE_BYTES
from grader.runtime.model.scenario import is_launch_file
from grader.runtime.model.submission import Beginning, CompileError, ReadProgram, SourceText, Submission
from grader.runtime.model.wording import first_of

__all__ = ["COMPILED", "HASHES", "LONG_FILE", "UNREADABLE", "Programs", "read_programs", "read_reaches", "read_sources"]

#: Suffixes of modules that Python imports without their source, and of archives that it imports from.
COMPILED = (".so", ".pyc", ".pyo", ".pth", ".zip", ".egg", ".whl", ".pyz")
#: Documents that are archives inside. A program that puts one on `sys.path` is noticed when it imports from it.
_DOCUMENTS = frozenset((".docx", ".xlsx", ".pptx", ".odt", ".ods", ".odp", ".jar", ".npz", ".epub"))
#: Why programs are not examined, and what follows. They run as others do.
_REASONS = {
    LONG: "too long to be examined",
    DEEP: "nested too deeply to be examined",
    COSTLY: "not examined, as that would take too much memory or time",
}
_CONSEQUENCE = "hints do not name its lines, and spot checks also run it on the wall clock"
#: What stands for a program of which the process said nothing.
_UNTOLD = ReadProgram(reaches=(LONG_FILE,))


class Programs:
    """The Python files of a submission, which the process is asked to read.

    Args:
        root: The staged submission.
        likely: The paths or names of files that are probably run: their texts and trees are always told.
    """

    def __init__(self, root: Path, likely: Iterable[str] = ()) -> None:
        self._root = root
        self._likely = frozenset(likely)
        self._asked: list[str] = []
        self._found: dict[str, ReadProgram] = {}
        self._problems: dict[tuple[str, str], None] = {}

    def ask(self, asked: Asked) -> None:
        """Add the programs to the files that are asked for."""
        left = MAX_PROGRAM_BYTES
        files = ((path.relative_to(self._root).as_posix(), path) for path in self._root.rglob("*") if path.is_file())
        wanted = {path: file for path, file in files if file.suffix == ".py" or self._is_likely(path)}
        for path in sorted(wanted, key=lambda path: (not self._is_likely(path), path)):
            content = read_within(wanted[path], min(MAX_SOURCE_BYTES, left))
            if content is None:
                self._problems[LONG, path] = None
                self._found[path] = _UNTOLD
                continue
            left -= len(content)
            self._asked.append(path)
            asked.programs.append((path, asked.add(content)))
        asked.likely = [path for path in self._asked if self._is_likely(path)]

    def _is_likely(self, path: str) -> bool:
        return path in self._likely or posixpath.basename(path) in self._likely

    def told(self, answer: ReaderAnswer) -> tuple[dict[str, ReadProgram], tuple[str, ...]]:
        """Return the programs by path as the process says what they hold, and notes on those that it does not."""
        found, problems = dict(self._found), dict(self._problems)
        for path, read, problem in _programs(answer, self._asked):
            in_python = path.endswith(".py") or not is_launch_file(path)
            # Only its text is of use: it was read as Python.
            program = read if in_python else ReadProgram(read.text, told=read.told)
            found[path] = program
            if problem:
                problems[problem, path] = None
        return found, tuple(_notes(problems))


def _programs(answer: ReaderAnswer, asked: Sequence[str]) -> Iterator[tuple[str, ReadProgram, str]]:
    """Yield what the process says of each program, checked, and why one was not examined; empty if it was."""
    left = dict.fromkeys(asked)
    while left and (row := answer.row()) is not None:
        path, text, tree = row.get("path"), answer.part(row.get("text", 0)), answer.part(row.get("tree", 0))
        if not isinstance(path, str) or path not in left or text is None or tree is None:
            break
        del left[path]
        problem = row.get("problem")
        yield path, _checked(row, text, tree), problem if isinstance(problem, str) and problem in _REASONS else ""
    yield from ((path, _UNTOLD, COSTLY) for path in left)


def _checked(row: Mapping[str, Any], text: bytes, tree: bytes) -> ReadProgram:
    reaches, error = row.get("reaches"), row.get("error")
    names = [name for name in reaches if isinstance(name, str)] if isinstance(reaches, list) else [LONG_FILE]
    read = None
    if "text" in row:
        try:
            read = SourceText(text.decode(), tree if "tree" in row else None)
        except UnicodeDecodeError:
            read = None
    return ReadProgram(
        read,
        inert=row.get("inert") is True,
        begins=_begins(row.get("begins")),
        error=_error(error),
        reaches=tuple(name[:NAME_CHARACTERS] for name in names[: 2 * MOST_NAMES]),
        told="text" in row or row.get("untold") is not True,
    )


def _begins(told: Any) -> Beginning | None:
    if not isinstance(told, list) or len(told) != 4:
        return None
    *facts, node = told
    if not all(isinstance(fact, bool) for fact in facts) or not isinstance(node, str):
        return None
    starts, main, offers_main = facts
    return Beginning(starts, main, offers_main, node if node.isidentifier() else "")


def _error(told: Any) -> CompileError | None:
    if not isinstance(told, list) or len(told) != 3:
        return None
    type_, message, line = told
    if not isinstance(type_, str) or not type_.isidentifier() or not isinstance(message, str):
        return None
    line = line if type(line) is int and 0 <= line < 1 << 31 else None
    return CompileError(type_[:NAME_CHARACTERS], message[:ERROR_CHARACTERS], line)


def _notes(problems: Mapping[tuple[str, str], None]) -> Iterator[str]:
    """Yield a sentence for each reason why programs were not examined, with their paths."""
    for problem, reason in _REASONS.items():
        files = sorted(path for why, path in problems if why == problem)
        if files:
            yield f"{first_of(files)}: {reason}; {_CONSEQUENCE}"


def read_programs(
    root: Path, likely: Iterable[str] = (), tell: Tell = told_by_process
) -> tuple[dict[str, ReadProgram], tuple[str, ...]]:
    """Return the Python files of a staged submission by path, and notes on those that were not examined.

    Raises:
        HarnessError: The process cannot be started, or the machine is too busy for it.
    """
    programs, asked = Programs(root, likely), Asked()
    programs.ask(asked)
    return programs.told(ReaderAnswer(tell(asked.input()))) if asked.programs else programs.told(ReaderAnswer(b""))


def read_sources(submission: Submission, tell: Tell = told_by_process) -> dict[str, SourceText]:
    """Return wanted file name -> text of the staged files that were found and that Python can decode."""
    found = {wanted: file.found for wanted, file in submission.files.items() if file.found is not None}
    texts = read_files(submission, found.values(), tell)
    return {wanted: texts[path] for wanted, path in found.items() if path in texts}


def read_files(submission: Submission, paths: Iterable[str], tell: Tell = told_by_process) -> dict[str, SourceText]:
    """Return the texts of staged files by path, of those that are there and that Python can decode.

    Most were read when the submission was staged.
    """
    named = dict.fromkeys(paths)
    known = {path: program for path in named if (program := submission.programs.get(path)) is not None and program.told}
    missing = [path for path in named if path not in known and (submission.root / path).is_file()]
    if missing:
        asked = Asked(likely=missing)
        contents = {path: read_within(submission.root / path, MAX_SOURCE_BYTES) for path in missing}
        kept = {path: content for path, content in contents.items() if content is not None}
        asked.programs += [(path, asked.add(content)) for path, content in kept.items()]
        answer = ReaderAnswer(tell(asked.input()) if kept else b"")
        known |= {path: program for path, program, _ in _programs(answer, list(kept))}
    return {path: program.text for path, program in known.items() if program.text is not None}


def read_texts(texts: Mapping[str, str], tell: Tell = told_by_process) -> dict[str, SourceText]:
    """Return texts that were decoded before, such as those of evidence, with trees that are read when one is needed."""
    trees: dict[str, bytes | None] = {}

    def tree_of(name: str) -> bytes | None:
        if not trees:
            asked = Asked(likely=list(texts), decoded=True)
            asked.programs += [(one, asked.add(text.encode("utf-8", "replace"))) for one, text in texts.items()]
            trees.update(dict.fromkeys(texts))
            for one, program, _ in _programs(ReaderAnswer(tell(asked.input())), list(texts)):
                trees[one] = program.text.tree if program.text is not None else None
        return trees[name]

    return {name: SourceText(text, partial(tree_of, name)) for name, text in texts.items()}


def read_reaches(root: Path, programs: Mapping[str, ReadProgram] | None = None) -> tuple[str, ...]:
    """Return the names by which the files of a staged submission reach into their process, without duplicates.

    A module that is not text, or has more text than is read, counts as reaching, and so does an archive that modules
    could be imported from, whatever its name.

    Args:
        root: The staged submission.
        programs: What was found in its Python files, by path; they are read now if it is None.
    """
    known = read_programs(root)[0] if programs is None else programs
    found: list[str] = []
    for path in sorted(path for path in root.rglob("*") if path.is_file()):
        if path.suffix.lower() in COMPILED:
            found.append(f"a {path.suffix.lower()} file")
        elif path.suffix.lower() not in _DOCUMENTS and zipfile.is_zipfile(path):
            found.append("an archive")
        elif path.suffix == ".py":
            found += known.get(path.relative_to(root).as_posix(), _UNTOLD).reaches
    return tuple(dict.fromkeys(found))
