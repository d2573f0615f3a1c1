"""Reads the project files of ROS packages, in the contained process that can do nothing else.

Of each package it tells `name` (null if none is given), `scripts`, `data_files` (null if not known), `programs` that
are installed as they are, each with its file and whether it is made executable, names of programs that CMake builds as
`built`, `imported` folders, `unread`, whether there may be other programs, `problems`, pairs of a file and one of
`PROBLEMS`, and, for what a build leaves out, `manifest`, as `manifests` says it, `setup`, what is passed to setup() as
far as all of it is known, `script_folders` of setup.cfg for `install` and `develop`, and of CMakeLists.txt
`cmake_name`, `missing` files, and `no_launch`, whether it certainly installs no launch file.

No code of a student is imported or run: setup.py is only parsed.
"""

from __future__ import annotations

import ast
import codecs
import configparser
import posixpath
import re
import tomllib
from collections.abc import Callable, Iterator, Sequence
from typing import Any, TypeVar

from grader.grading.submissions.cmake_files import Contents, contents_of
from grader.grading.submissions.manifests import manifest_description
from grader.grading.submissions.setup_files import LimitError, given_to_setup

#: Why a file was not read: it is not valid in its format, or reading it would take too much.
INVALID, TOO_COSTLY = "invalid", "too costly"
PROBLEMS = (INVALID, TOO_COSTLY)
CMAKE = "CMakeLists.txt"
#: How much of a package.xml is searched for its name.
NAME_BYTES = 1 << 16
#: Encodings that a setup.py may declare, besides UTF-8; once confined, the process cannot load others.
ENCODINGS = ("ascii", "latin-1", "iso8859-15", "cp1252", "utf-8-sig")
Value = TypeVar("Value")


def load_parsers() -> None:
    """Load what a confined process could not."""
    for name in ENCODINGS:
        codecs.lookup(name)


def project_description(files: dict[str, bytes], names: Sequence[str]) -> dict[str, Any]:
    """Return what the project files of a package say.

    Args:
        files: Content by name; a file that is not there is missing.
        names: The paths of all files below the package's folder.
    """
    problems: list[tuple[str, str]] = []

    def read(file: str, how: Callable[[bytes], Value], nothing: Value) -> Value:
        if file not in files:
            return nothing
        try:
            return how(files[file])
        except (LimitError, MemoryError, RecursionError):
            problems.append((file, TOO_COSTLY))
        except (SyntaxError, configparser.Error, LookupError, OverflowError, TypeError, ValueError):
            problems.append((file, INVALID))
        return nothing

    nothing: dict[str, Any] = {}
    none: list[str] = []
    given, sure = read("setup.py", lambda content: given_to_setup(ast.parse(content), names), (nothing, False))
    lines = [
        *_scripts_of_setup(given),
        *read("pyproject.toml", _scripts_of_pyproject, none),
        *read("setup.cfg", _scripts_of_configuration, none),
    ]
    name = read("package.xml", _name_in_manifest, None) or given.get("name")
    name = name if isinstance(name, str) else None
    unread = Contents(unread=CMAKE in files)
    by_cmake = read(CMAKE, lambda text: contents_of(text.decode("utf-8-sig", "replace"), name or "", names), unread)
    for file in by_cmake.configurations:
        lines += read(file, _scripts_of_configuration, none)
    data_files = _data_files(given.get("data_files"))
    return {
        "name": name,
        "scripts": [script for line in lines if (script := _script(line)) is not None],
        "data_files": data_files,
        "programs": [
            *_programs_of_setup(given, data_files or (), name or ""),
            *((one.name, one.file, one.runs) for one in by_cmake.installed),
        ],
        "built": by_cmake.built,
        "imported": by_cmake.imported,
        "unread": by_cmake.unread,
        "problems": problems,
        "manifest": read("package.xml", manifest_description, None),
        "setup": _setup(given, files.get("setup.cfg", b"")) if given and sure else None,
        "script_folders": read("setup.cfg", _script_folders, None),
        "cmake_name": by_cmake.project,
        "missing": by_cmake.missing,
        "no_launch": by_cmake.no_launch,
        "not_scripts": [line for line in map(str.strip, _scripts_of_setup(given)) if line and _script(line) is None],
    }


def _setup(given: dict[str, Any], configuration: bytes) -> dict[str, Any] | None:
    """Return name, Python packages and their folders, of what is passed to setup(); what is not known is null."""
    name, packages, folders = given.get("name"), given.get("packages"), given.get("package_dir", {})
    if "cmdclass" in given or "options" in given:  # these may do anything
        return None
    known = isinstance(packages, list) and all(isinstance(one, str) for one in packages)
    placed = isinstance(folders, dict) and all(isinstance(one, str) for one in folders.values())
    return {
        "name": name if isinstance(name, str) else "",
        "packages": packages if known and placed else None,
        "folders": list(folders.items()) if placed else [],
        "installs_files": "data_files" in given or b"data_files" in configuration,
    }


def _script_folders(content: bytes) -> list[str]:
    """Return where setup.cfg has scripts installed by `install` and by `develop`; setuptools takes - for _."""
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(content.decode())
    return [
        next((text for name in names if (text := parser.get(section, name, fallback=""))), "")
        for section, names in (
            ("install", ("install_scripts", "install-scripts")),
            ("develop", ("script_dir", "script-dir")),
        )
    ]


def _name_in_manifest(content: bytes) -> str | None:
    found = re.search(rb"<name>\s*([A-Za-z0-9_-]+)\s*</name>", content[:NAME_BYTES])
    return found[1].decode() if found is not None else None


def _data_files(given: Any) -> list[tuple[str, list[str]]] | None:
    """Return the folders below the prefix and the files that setup.py installs to them; None if that is not known."""
    if not isinstance(given, list):
        return None
    found: list[tuple[str, list[str]]] = []
    for pair in given:
        target, files = pair if isinstance(pair, list) and len(pair) == 2 else (None, None)
        if not isinstance(target, str) or not isinstance(files, list) or not all(isinstance(f, str) for f in files):
            return None
        found.append((target, files))
    return found


def _programs_of_setup(
    given: dict[str, Any], data_files: Sequence[tuple[str, list[str]]], name: str
) -> Iterator[tuple[str, str, str]]:
    """Yield what setup.py installs as programs without an entry point: `scripts`, and data_files in their folder."""
    scripts = given.get("scripts")
    for file in scripts if isinstance(scripts, list) else ():
        if isinstance(file, str):
            yield posixpath.basename(file), file, "yes"
    for target, files in data_files:
        if f"{posixpath.normpath(target)}/".startswith(f"lib/{name}/"):
            yield from ((posixpath.basename(file), file, "source") for file in files)


def _script(line: str) -> tuple[str, str, str] | None:
    """Parse `name = module:function`."""
    name, equals, target = (part.strip() for part in line.partition("="))
    module, colon, function = (part.strip() for part in target.partition("[")[0].partition(":"))
    parts = [*module.split("."), *function.split(".")]
    return (name, module, function) if equals and colon and all(part.isidentifier() for part in parts) else None


def _scripts_of_configuration(content: bytes) -> list[str]:
    parser = configparser.ConfigParser(interpolation=None)
    parser.read_string(content.decode())
    return parser.get("options.entry_points", "console_scripts", fallback="").splitlines()


def _scripts_of_pyproject(content: bytes) -> list[str]:
    project = tomllib.loads(content.decode()).get("project")
    scripts = project.get("scripts") if isinstance(project, dict) else None
    given = scripts.items() if isinstance(scripts, dict) else ()
    return [f"{name} = {target}" for name, target in given if isinstance(target, str)]


def _scripts_of_setup(values: dict[str, Any]) -> list[str]:
    given = values.get("entry_points")
    scripts = given.get("console_scripts") if isinstance(given, dict) else _ini_scripts(given)
    scripts = scripts.splitlines() if isinstance(scripts, str) else scripts
    return [s for s in scripts if isinstance(s, str)] if isinstance(scripts, list) else []


def _ini_scripts(text: Any) -> list[str]:
    """Parse the console scripts of entry points that are given as one INI text."""
    lines = text.splitlines() if isinstance(text, str) else []
    section, found = "", []
    for line in map(str.strip, lines):
        if line.startswith("["):
            section = line.strip("[] ")
        elif section == "console_scripts":
            found.append(line)
    return found
