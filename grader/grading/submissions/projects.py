"""Finds the ROS packages of a submission; a process of its own reads their files, and every answer of it is checked."""

from __future__ import annotations

import json
import os
import posixpath
import re
import stat
import subprocess
import tempfile
from collections.abc import Callable, Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from grader.grading.submissions.collected import name_problem
from grader.runtime.contained import run_contained
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import MAX_FILES, MAX_NAME_BYTES, MAX_PATH_BYTES
from grader.runtime.model.projects import Project
from grader.runtime.model.wording import first_of
from grader.runtime.programs.executables import CMAKE_LISTS, files_below, project_folders

MODULE = "grader.grading.submissions.project_reader"
#: The files of a package that are read.
FILES = ("package.xml", "setup.py", "setup.cfg", "pyproject.toml", CMAKE_LISTS)
#: The one to name if the process ended while it read a package.
_COSTLIEST_FIRST = ("setup.py", CMAKE_LISTS, "pyproject.toml", "setup.cfg")
#: Larger files are not read, in bytes: those of real packages have some thousands.
MOST_BYTES = 256 << 10
#: Limits of the process that reads: memory and output in bytes, processor time in seconds. The files of a real package
#: take it a tenth of a second, most of it for its own start.
MEMORY_BYTES, OUTPUT_BYTES, PROCESSOR_S = 320 << 20, 8 << 20, 10
#: The most packages of a submission, and bytes of all their files together: courses hand in a handful.
MOST_PACKAGES, TOTAL_BYTES = 50, 4 << 20
#: The most files setup.cfg of Python packages in a CMake package that are read.
MOST_CONFIGURATIONS = 10
#: The most console scripts and pairs in data_files of a package, and the longest name of a package or a script.
MOST_SCRIPTS, MOST_PAIRS, NAME_CHARACTERS = 100, 1_000, 100
_NAME = re.compile(r"[A-Za-z0-9_-]{1,100}")
_SCRIPT = re.compile(r"[A-Za-z0-9_.-]{1,100}")
_MODULE = re.compile(r"(?:[^\W\d]\w*\.)*[^\W\d]\w*")
_COSTLY = "not read, because that would take too much memory or time"
_PROBLEMS = {
    "invalid": "not valid, so what is declared there is not used",
    "too costly": _COSTLY,
    "unread": _COSTLY,
    "large": f"not read, because of more than {MOST_BYTES >> 10} KiB",
    "names": "names of files or programs that no package can have are left out",
}


def told_by_process(asked: bytes, output_bytes: int = OUTPUT_BYTES) -> bytes:
    """Return what the process that reads says of some packages, in lines of JSON; `project_reader` has the formats.

    Raises:
        HarnessError: The process cannot be started, or the machine is too busy for it.
    """
    limits = {"memory": MEMORY_BYTES, "output": output_bytes, "processor": PROCESSOR_S}
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as out:
        given.write(asked)
        given.seek(0)
        try:
            run_contained(MODULE, limits, given, out)
        except subprocess.TimeoutExpired:
            raise HarnessError("project files: the machine was too busy to read them", "try again later") from None
        except OSError as error:
            raise HarnessError(f"project files: they cannot be read: {error.strerror}", "free some memory") from None
        out.seek(0)
        return out.read(output_bytes)


def read_projects(
    root: Path, tell: Callable[[bytes], bytes] = told_by_process
) -> tuple[tuple[Project, ...], tuple[str, ...]]:
    """Return the packages of a submission, outermost first, and notes on what could not be read.

    A submission without packages costs nothing. Whatever a file holds, it costs at most what the limits say, and
    becomes a note.

    Args:
        root: The staged submission.
        tell: Reads the files of the packages; whatever it says is checked.

    Raises:
        HarnessError: The files cannot be read, or the machine is too busy for it.
    """
    folders = project_folders(root)
    if not folders:
        return (), ()
    problems: dict[tuple[str, str], None] = {}
    asked, left = [], TOTAL_BYTES
    for folder in folders[:MOST_PACKAGES]:
        files = {}
        for name in FILES:
            content = _content(folder / name, min(MOST_BYTES, left))
            if content is None:
                problems["large", _relative(folder / name, root)] = None
            elif content:
                files[name] = content.decode("latin-1")
                left -= len(content)
        lists = CMAKE_LISTS in files or b"glob" in _bytes(files, "setup.py")
        names = [*islice(files_below(folder), MAX_FILES)] if lists else []
        if b"SCRIPTS_DESTINATION" in _bytes(files, CMAKE_LISTS):  # the console scripts of a Python package in this one
            below = [name for name in names if name.endswith("/setup.cfg")][:MOST_CONFIGURATIONS]
            contents = {name: _content(folder / name, min(MOST_BYTES, left)) for name in below}
            files |= {name: content.decode("latin-1") for name, content in contents.items() if content}
        asked.append({"files": files, "names": names})
    found = []
    answers = _answers(tell(json.dumps(asked).encode()))
    for number, folder in enumerate(folders[:MOST_PACKAGES]):
        place = _relative(folder, root)
        first = next((name for name in _COSTLIEST_FIRST if name in asked[number]["files"]), "package.xml")
        answer = answers[number] if number < len(answers) else {"problems": [[first, "unread"]]}
        project, wrong = _checked(answer, place, folder.name)
        found.append(_with_programs(project, answer, folder))
        for file, problem in wrong:
            problems[problem, posixpath.join(place, file)] = None
    notes = list(_notes(problems))
    if len(folders) > MOST_PACKAGES:
        notes.append(f"only the first {MOST_PACKAGES} packages were read, of {len(folders)}")
    return tuple(found), tuple(notes)


def _bytes(files: Mapping[str, str], name: str) -> bytes:
    return files.get(name, "").encode("latin-1")


def _relative(path: Path, root: Path) -> str:
    relative = path.relative_to(root).as_posix()
    return "" if relative == "." else relative


def _content(path: Path, most: int) -> bytes | None:
    """Return the bytes of a plain file, empty if there is none; None if there are more than allowed."""
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return b""
            content = file.read(most + 1)
    except OSError:
        return b""
    return content if len(content) <= most else None


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without blocking on a pipe."""
    return os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC)


def _answers(told: bytes) -> list[dict[str, Any]]:
    """Return what the process said of each package, as far as it came."""
    found = []
    for line in told.split(b"\n")[:-1]:
        try:
            answer = json.loads(line)
        except (ValueError, RecursionError):
            break
        if not isinstance(answer, dict):
            break
        found.append(answer)
    return found


def _checked(answer: Mapping[str, Any], place: str, folder_name: str) -> tuple[Project, list[tuple[str, str]]]:
    """Return a package as the process reported it, with every name checked, and its problems as file and code."""
    told = [
        (file, problem)
        for file, problem in _pairs(answer.get("problems"))
        if file in FILES and isinstance(problem, str) and problem in _PROBLEMS
    ]
    name = answer.get("name")
    if not isinstance(name, str) or not _NAME.fullmatch(name):
        told += [("setup.py", "names")] if name is not None else []
        name = folder_name[:NAME_CHARACTERS]
    given = answer.get("scripts")
    rows = given if isinstance(given, list) else []
    scripts = [tuple(row) for row in rows[:MOST_SCRIPTS] if _is_script(row)]
    files, dropped = _data_files(answer.get("data_files"))
    told += [("setup.py", "names")] if dropped or len(scripts) < len(rows) else []
    return Project(place, name, tuple(scripts), files), told


#: The most of a program that is read to find out what runs it, and how much of all programs of a package is looked at.
_START_BYTES, MOST_PROGRAMS = 256, 500


def _with_programs(project: Project, answer: Mapping[str, Any], folder: Path) -> Project:
    """Return a package with the programs that are installed as they are, as the process reported them, each checked."""
    rows = answer.get("programs")
    found: dict[str, dict[str, str]] = {"programs": {}, "unrunnable": {}}
    foreign = [name for name in _strings(answer.get("built")) if _SCRIPT.fullmatch(name)]
    for row in rows[:MOST_PROGRAMS] if isinstance(rows, list) else ():
        if not isinstance(row, list) or len(row) != 3 or not all(isinstance(part, str) for part in row):
            continue
        name, file, runs = row[0], _normal(row[1]), row[2]
        if not file or _SCRIPT.fullmatch(name) is None or name in (".", ".."):
            continue
        first = _first_line(folder / file)
        if first.startswith("#!") and "python" not in first:
            foreign.append(name)
        elif file.endswith(".py") or first.startswith("#!"):
            # permissions do not survive every archive, so that a first line which names an interpreter stands for them
            executable = runs == "yes" or (runs == "source" and first.startswith("#!"))
            found["programs" if executable else "unrunnable"].setdefault(name, file)
        elif runs == "yes":
            foreign.append(name)
    imported = [normal for path in _strings(answer.get("imported")) if (normal := _normal(path or "."))]
    return replace(
        project,
        programs=tuple(found["programs"].items())[:MOST_SCRIPTS],
        unrunnable=tuple(found["unrunnable"].items())[:MOST_SCRIPTS],
        foreign=tuple(dict.fromkeys(foreign))[:MOST_SCRIPTS],
        imported=tuple(dict.fromkeys(path for path in imported if path != "."))[:MOST_SCRIPTS],
        unread=answer.get("unread", (folder / CMAKE_LISTS).is_file()) is True,
        by_cmake=(folder / CMAKE_LISTS).is_file(),
    )


def _first_line(path: Path) -> str:
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return ""
            return file.read(_START_BYTES).partition(b"\n")[0].decode("latin-1")
    except OSError:
        return ""


def _strings(value: Any) -> list[str]:
    return [one for one in value[:MOST_PAIRS] if isinstance(one, str)] if isinstance(value, list) else []


def _pairs(value: Any) -> Iterator[tuple[Any, Any]]:
    for pair in value[:MOST_PAIRS] if isinstance(value, list) else ():
        if isinstance(pair, list) and len(pair) == 2:
            yield pair[0], pair[1]


def _is_script(row: Any) -> bool:
    """Return whether a value is the name, module and function of a console script that can exist."""
    if not isinstance(row, list) or len(row) != 3 or not all(isinstance(part, str) for part in row):
        return False
    name = row[0]
    dotted = all(_MODULE.fullmatch(text) and len(text) <= MAX_NAME_BYTES and _is_path(text) for text in row[1:])
    return dotted and _SCRIPT.fullmatch(name) is not None and name not in (".", "..")


def _is_path(path: str) -> bool:
    """Return whether a path is relative, leads nowhere else, and can exist on any system."""
    try:
        path.encode()
    except UnicodeEncodeError:  # half of a surrogate pair
        return False
    return len(path) <= MAX_PATH_BYTES and not name_problem(path)


def _data_files(given: Any) -> tuple[tuple[tuple[str, tuple[str, ...]], ...] | None, bool]:
    """Return data_files with the paths that can exist, each normalized, and whether others were dropped."""
    if not isinstance(given, list):
        return None, False
    found, dropped, left = [], len(given) > MOST_PAIRS, MAX_FILES
    for target, files in _pairs(given):
        if not isinstance(target, str) or not isinstance(files, list):
            return None, dropped
        into, names = _normal(target), [_normal(file) for file in files[:left] if isinstance(file, str)]
        kept = tuple(name for name in names if name and name != ".")
        dropped = dropped or not into or len(kept) < len(files)
        left -= len(kept)
        if into:
            found.append((into, kept))
    return tuple(found), dropped


def _normal(path: str) -> str:
    """Return a path without empty parts; empty if it is not one that can exist below a folder."""
    normal = posixpath.normpath(path) if path else ""
    return normal if normal and _is_path("x" if normal == "." else normal) else ""


def _notes(problems: Mapping[tuple[str, str], None]) -> Iterator[str]:
    """Yield a sentence for each kind of problem, with the files that have it."""
    for words in dict.fromkeys(_PROBLEMS.values()):
        files = sorted({file for problem, file in problems if _PROBLEMS[problem] == words})
        if files:
            yield f"{first_of(files)}: {words}"
