"""Finds the ROS packages of a submission; a contained process reads their files, and every answer of it is checked."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import Any

from grader.grading.submissions.collected import name_problem
from grader.grading.submissions.contained_reader import (
    Asked,
    ReaderAnswer,
    Tell,
    beginning_of_file,
    read_within,
    told_by_process,
)
from grader.runtime.model.limits import MAX_FILES, MAX_NAME_BYTES, MAX_PATH_BYTES
from grader.runtime.model.projects import PackageBuild, PackageManifest, Project, SetupCall
from grader.runtime.model.wording import first_of
from grader.runtime.programs.executables import CMAKE_LISTS, files_below, project_folders

#: The files of a package that are read.
FILES = ("package.xml", "setup.py", "setup.cfg", "pyproject.toml", CMAKE_LISTS)
#: The one to name if the process ended while it read a package.
_COSTLIEST_FIRST = ("setup.py", CMAKE_LISTS, "pyproject.toml", "setup.cfg")
#: Larger files are not read, in bytes: those of real packages have some thousands.
MOST_BYTES = 256 << 10
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


def read_projects(root: Path, tell: Tell = told_by_process) -> tuple[tuple[Project, ...], tuple[str, ...]]:
    """Return the packages of a submission, outermost first, and notes on what could not be read.

    A submission without packages costs nothing. Whatever a file holds, it costs at most what the limits say, and
    becomes a note.

    Args:
        root: The staged submission.
        tell: Reads the files of the packages; whatever it says is checked.

    Raises:
        HarnessError: The files cannot be read, or the machine is too busy for it.
    """
    packages, asked = Packages(root), Asked()
    if not packages.folders:
        return (), ()
    packages.ask(asked)
    return packages.told(ReaderAnswer(tell(asked.input())))


class Packages:
    """The packages of a submission, whose files the process is asked to read.

    Args:
        root: The staged submission.
    """

    def __init__(self, root: Path) -> None:
        self.folders = project_folders(root)
        self._root = root
        self._left = TOTAL_BYTES
        self._numbers: dict[Path, int] = {}  # file -> the number of its content; packages may lie in each other
        self._files: list[dict[str, int]] = []
        self._problems: dict[tuple[str, str], None] = {}

    def ask(self, asked: Asked) -> None:
        """Add the files of the packages to those that are asked for."""
        names: dict[str, None] = {}
        for folder in self.folders[:MOST_PACKAGES]:
            contents = {name: self._added(folder / name, asked) for name in FILES}
            cmake, setup = contents[CMAKE_LISTS], contents["setup.py"]
            lists = bool(cmake) or b"glob" in setup or b"find_" in setup
            below = [*islice(files_below(folder), MAX_FILES)] if lists else []
            place = _relative(folder, self._root)
            names |= dict.fromkeys(posixpath.join(place, name) for name in below)
            if b"SCRIPTS_DESTINATION" in cmake:  # the console scripts of a Python package in this one
                inner = [name for name in below if name.endswith("/setup.cfg")][:MOST_CONFIGURATIONS]
                contents |= {name: self._added(folder / name, asked) for name in inner}
            files = {name: self._numbers[folder / name] for name, content in contents.items() if content}
            self._files.append(files)
            asked.packages.append({"folder": place, "files": files, "lists": lists})
        asked.names = names

    def _added(self, path: Path, asked: Asked) -> bytes:
        """Return the content of a file, empty if it is not there or too large; it is read and counted once."""
        if path in self._numbers:
            return asked.content(self._numbers[path])
        content = read_within(path, min(MOST_BYTES, self._left))
        if content is None:
            self._problems["large", _relative(path, self._root)] = None
        if content:
            self._left -= len(content)
            self._numbers[path] = asked.add(content)
        return content or b""

    def told(self, answer: ReaderAnswer) -> tuple[tuple[Project, ...], tuple[str, ...]]:
        """Return the packages as the process says what their files hold, and notes."""
        found, problems = [], dict(self._problems)
        ended = False
        for number, folder in enumerate(self.folders[:MOST_PACKAGES]):
            place = _relative(folder, self._root)
            row = None if ended else answer.row()
            ended = row is None
            first = next((name for name in _COSTLIEST_FIRST if name in self._files[number]), "package.xml")
            told: Mapping[str, Any] = {"problems": [[first, "unread"]]} if row is None else row
            project, wrong = _checked(told, place, folder.name)
            found.append(_with_programs(project, told, folder))
            for file, problem in wrong:
                problems[problem, posixpath.join(place, file)] = None
        notes = list(_notes(problems))
        if len(self.folders) > MOST_PACKAGES:
            notes.append(f"only the first {MOST_PACKAGES} packages were read, of {len(self.folders)}")
        return tuple(found), tuple(notes)


def _relative(path: Path, root: Path) -> str:
    relative = path.relative_to(root).as_posix()
    return "" if relative == "." else relative


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
        first = beginning_of_file(folder / file, _START_BYTES)
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
        build=_build(answer),
    )


#: The most characters of a name or a problem in what is told of a build.
_TOLD_CHARACTERS = 200


def _build(answer: Mapping[str, Any]) -> PackageBuild:
    """Return what the process reported on the build of a package, each part checked."""
    folders = _strings(answer.get("script_folders"))
    return PackageBuild(
        manifest=_manifest(answer.get("manifest")),
        setup=_setup_call(answer.get("setup")),
        script_folders=(_short(folders[0]), _short(folders[1])) if len(folders) == 2 else None,
        cmake_name=next(iter(_strings([answer.get("cmake_name")])), "")[:_TOLD_CHARACTERS],
        missing=tuple(path for text in _strings(answer.get("missing")) if (path := _normal(text))),
        no_launch=answer.get("no_launch") is True,
        not_scripts=tuple(_short(line) for line in _strings(answer.get("not_scripts")) if not line.startswith("#")),
    )


def _manifest(told: Any) -> PackageManifest | None:
    if not isinstance(told, dict):
        return None
    problem = _strings(told.get("problem"))
    names = [
        [name for name in _strings(told.get(key)) if _NAME.fullmatch(name)] for key in ("dependencies", "build_types")
    ]
    code = (_short(problem[0]), _short(problem[1])) if len(problem) == 2 else None
    return PackageManifest(code, tuple(names[0]), tuple(names[1]))


def _setup_call(told: Any) -> SetupCall | None:
    if not isinstance(told, dict):
        return None
    name, packages = told.get("name"), told.get("packages")
    known = [one for one in _strings(packages) if _MODULE.fullmatch(one) and _is_path(one)]
    folders = [pair for pair in _pairs(told.get("folders")) if all(isinstance(part, str) for part in pair)]
    placed = [(of, _normal(folder or ".")) for of, folder in folders if _is_path(of or "x")]
    whole = isinstance(packages, list) and len(known) == len(packages) and all(folder for _, folder in placed)
    return SetupCall(
        _short(name) if isinstance(name, str) else "",
        tuple(known) if whole and len(placed) == len(folders) else None,
        tuple(placed),
        told.get("installs_files") is not False,
    )


def _short(text: str) -> str:
    return text[:_TOLD_CHARACTERS].encode("utf-8", "replace").decode()


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
