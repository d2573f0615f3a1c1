"""Finds out which programs a CMakeLists.txt installs for `ros2 run`, without running CMake.

Six commands are understood, each branch of a condition among them. What others do is not known: values of variables
that they name, and whether a loop or function installs programs.
"""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import field
from fnmatch import fnmatchcase
from itertools import pairwise

from grader.grading.submissions.setup_files import LimitError
from grader.runtime.model.dataclass import dataclass

#: The maximum length of a value, and how often variables in values of variables are replaced.
TEXT_CHARACTERS, DEPTH = 100_000, 20
#: The most files that are installed: far more than the programs of a package.
MOST_INSTALLED = 5_000
#: Stands for the folder of the CMakeLists.txt in paths, and for what is not known before CMake runs.
_SOURCE, _UNKNOWN = "/source", "\0"
_SOURCES = ("CMAKE_SOURCE_DIR", "CMAKE_CURRENT_SOURCE_DIR", "CMAKE_CURRENT_LIST_DIR", "PROJECT_SOURCE_DIR")
#: Variables that CMake and GNUInstallDirs set; where other folders are installed is of no account here.
_FIXED = {
    **dict.fromkeys(_SOURCES, _SOURCE),
    **dict.fromkeys(("CMAKE_INSTALL_INCLUDEDIR", "CMAKE_INSTALL_DATADIR", "CMAKE_INSTALL_BINDIR"), "other"),
    "CMAKE_INSTALL_PREFIX": "",
    "CMAKE_INSTALL_LIBDIR": "lib",
}
#: Commands after which there may be programs that were not found.
_INSTALLING = frozenset({"install", "ament_python_install_package", "add_executable", "add_subdirectory"})
_TOKEN = re.compile(
    r"(?P<space>[ \t\r\n]+|#\[(?P<c>=*)\[.*?\](?P=c)\]|#[^\n]*)"
    r"|(?P<open>\()|(?P<close>\))"
    r"|\[(?P<b>=*)\[\n?(?P<bracket>.*?)\](?P=b)\]"
    r'|"(?P<quoted>(?:[^"\\]|\\.)*)"'
    r'|(?P<plain>(?:[^\s()#"\\]|\\.)+)',
    re.DOTALL,
)
_REFERENCE = re.compile(r"\$\{([^${}]*)\}")
_ESCAPE = re.compile(r"\\(.)", re.DOTALL)
_MAY_RUN = frozenset({"OWNER_EXECUTE", "GROUP_EXECUTE", "WORLD_EXECUTE"})
#: What is between these commands runs as often as CMake decides.
_BLOCKS = {"foreach": "endforeach", "while": "endwhile", "function": "endfunction", "macro": "endmacro"}
#: Commands that install nothing but what is built of code and definitions.
_HARMLESS = frozenset(
    {
        *(
            "cmake_minimum_required",
            "if",
            "elseif",
            "else",
            "endif",
            "option",
            "message",
            "return",
            "add_compile_options",
        ),
        *("find_package", "find_library", "include_directories", "add_library", "set_target_properties"),
        *(
            "ament_package",
            "ament_target_dependencies",
            "ament_export_dependencies",
            "ament_lint_auto_find_test_dependencies",
        ),
        *("rosidl_generate_interfaces", "rosidl_get_typesupport_target", "rosidl_target_interfaces", "enable_testing"),
        *("add_definitions", "ament_add_gtest", "ament_add_pytest_test", "add_dependencies"),
    }
)
_HARMLESS_BEGINNINGS = ("target_", "ament_export_")
_KEYWORDS = frozenset(
    {
        *("DESTINATION", "RENAME", "COMPONENT", "TYPE", "PATTERN", "REGEX", "CONFIGURATIONS"),
        *("PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "USE_SOURCE_PERMISSIONS"),
        *("OPTIONAL", "EXCLUDE_FROM_ALL", "MESSAGE_NEVER", "FILES_MATCHING", "EXCLUDE"),
    }
)


@dataclass(frozen=True, slots=True)
class Installed:
    """A file that is installed where `ros2 run` looks for programs.

    Attributes:
        name: Its name there.
        file: Its path relative to the package.
        runs: `yes` if it is made executable, `no` if it is not, `source` if it keeps the permissions of its source.
    """

    name: str
    file: str
    runs: str


@dataclass(slots=True)
class Contents:
    """What a CMakeLists.txt installs.

    Attributes:
        installed: The files in the folder of the package's programs.
        built: The names of the programs that CMake builds.
        configurations: The setup.cfg files whose console scripts become programs, relative to the package.
        imported: The folders that hold installed Python packages, relative to the package.
        unread: Whether it may install programs that were not found.
        project: The name that it gives the project; empty if that is not known.
        missing: The files that it installs, whatever its conditions are, and that are not there.
        no_launch: Whether it certainly installs no launch file.
    """

    installed: list[Installed] = field(default_factory=list)
    built: list[str] = field(default_factory=list)
    configurations: list[str] = field(default_factory=list)
    imported: list[str] = field(default_factory=list)
    unread: bool = False
    project: str = ""
    missing: list[str] = field(default_factory=list)
    no_launch: bool = False


Command = tuple[str, list[tuple[str, bool]]]


def contents_of(text: str, package: str, names: Sequence[str]) -> Contents:
    """Return what a CMakeLists.txt installs.

    Args:
        text: The file.
        package: Name of the package.
        names: The paths of all files below its folder.

    Raises:
        LimitError: The file exceeds a limit.
        ValueError: It is not CMake.
    """
    reader = _Reader(package, names)
    reader.run(_commands(text))
    return reader.found


def _commands(text: str) -> Iterator[Command]:
    """Yield each command, in lower case, with its arguments and whether each is quoted."""
    name, depth = "", 0
    arguments: list[tuple[str, bool]] = []
    for kind, value in _tokens(text):
        if depth and kind in ("plain", "quoted"):
            arguments.append((value, kind == "quoted"))
        elif kind == "plain" and not name:
            name = value
        elif (kind == "open" and not name) or (kind == "close" and not depth) or kind in ("plain", "quoted"):
            raise ValueError("not CMake")
        else:
            depth += 1 if kind == "open" else -1
            if not depth:
                yield name.lower(), arguments
                name, arguments = "", []
    if name:
        raise ValueError("not CMake")


def _tokens(text: str) -> Iterator[tuple[str, str]]:
    """Yield kind and text of each token: `open`, `close`, `plain`, `quoted`."""
    at = 0
    while at < len(text):
        token = _TOKEN.match(text, at)
        if token is None:
            raise ValueError("not CMake")
        at = token.end()
        found = {kind: token[kind] for kind in ("open", "close", "plain", "quoted", "bracket")}
        kind = next((kind for kind, value in found.items() if value is not None), "")
        if kind:
            yield "quoted" if kind == "bracket" else kind, found[kind] or ""


class _Reader:
    """Evaluates commands in their order; of a condition every branch, because none of the conditions is known."""

    def __init__(self, package: str, names: Sequence[str]) -> None:
        self._package = package
        self._names = names
        self._values = {**_FIXED, "PROJECT_NAME": package}
        self._conditions = 0
        self.found = Contents(no_launch=True)

    def run(self, commands: Iterable[Command]) -> None:
        """Evaluate commands."""
        blocks: list[str] = []
        for name, raw in commands:
            self._conditions += (name == "if") - (name == "endif")
            # what is not understood may install anything, and so may a whole folder
            known = name in _COMMANDS or name in _HARMLESS or name.startswith(_HARMLESS_BEGINNINGS)
            self.found.no_launch &= known and not any("launch" in text or "GLOB" in text for text, _ in raw)
            if name in _BLOCKS:
                blocks.append(_BLOCKS[name])
            elif blocks and name == blocks[-1]:
                blocks.pop()
            elif blocks or name not in _COMMANDS:
                self._leave_out(name, raw)
            else:
                _COMMANDS[name](self, self._expanded(raw))
            if len(self.found.installed) > MOST_INSTALLED:
                raise LimitError
        if blocks:
            raise ValueError(f"expected {blocks[-1]}(), found the end")

    def _leave_out(self, name: str, raw: Sequence[tuple[str, bool]]) -> None:
        """Forget the variables that a command names; one that may install programs is not read."""
        here = raw[0][0] if raw else ""
        included = name == "include" and ("/" in here or here.endswith(".cmake"))
        self.found.unread |= included or name in _INSTALLING
        self._values |= {text: _UNKNOWN for text, _ in raw if text.isidentifier() and text not in _FIXED}

    def _expanded(self, raw: Sequence[tuple[str, bool]]) -> list[str]:
        """Return arguments with the values of variables; an unquoted one is split into its items."""
        found: list[str] = []
        for text, quoted in raw:
            value = self._filled(text)
            found += [value] if quoted else _split(value)
        return found

    def _filled(self, text: str) -> str:
        for _ in range(DEPTH):
            filled = _REFERENCE.sub(lambda name: self._values.get(name[1], _UNKNOWN), text)
            if len(filled) > TEXT_CHARACTERS:
                raise LimitError
            if filled == text:
                break
            text = filled
        text = _UNKNOWN if "$<" in text or "$ENV{" in text else text
        return _ESCAPE.sub(r"\1", text) if "\\" in text else text

    def set_value(self, arguments: list[str]) -> None:
        """Evaluate `set(NAME VALUE...)`."""
        values = arguments[1 : arguments.index("CACHE") if "CACHE" in arguments else None]
        if arguments:
            self._values[arguments[0]] = ";".join(value for value in values if value != "PARENT_SCOPE")

    def name_project(self, arguments: list[str]) -> None:
        """Evaluate `project(NAME ...)`."""
        self._values["PROJECT_NAME"] = name = "".join(arguments[:1])
        self.found.project = "" if _UNKNOWN in name else name

    def change_list(self, arguments: list[str]) -> None:
        """Evaluate `list(APPEND NAME ...)`; another change makes the list unknown."""
        kind, name = (*arguments[:2], "", "")[:2]
        known = _split(self._values.get(name, ""))
        self._values[name] = ";".join([*known, *arguments[2:]]) if kind == "APPEND" else _UNKNOWN

    def find_files(self, arguments: list[str]) -> None:
        """Evaluate `file(GLOB NAME PATTERN...)`, of patterns below the package; what others find is unknown."""
        kind, name = (*arguments[:2], "", "")[:2]
        patterns = [_path(word) for word in arguments[2:] if word != "CONFIGURE_DEPENDS"]
        if kind != "GLOB" or None in patterns or "RELATIVE" in patterns:
            self._values[name] = _UNKNOWN
            return
        wanted = [pattern.split("/") for pattern in patterns if pattern is not None]
        found = [name for pattern in wanted for name in sorted(self._names) if _globbed(name.split("/"), pattern)]
        self._values[name] = ";".join(f"{_SOURCE}/{name}" for name in found)

    def build(self, arguments: list[str]) -> None:
        """Evaluate `add_executable(NAME ...)`."""
        self.found.built += arguments[:1]
        self.found.unread |= _UNKNOWN in arguments[:1]

    def register(self, arguments: list[str]) -> None:
        """Evaluate `rclcpp_components_register_node(... EXECUTABLE NAME)`."""
        if "EXECUTABLE" in arguments:
            self.build(arguments[arguments.index("EXECUTABLE") + 1 :])

    def install_python(self, arguments: list[str]) -> None:
        """Evaluate `ament_python_install_package(NAME ...)`."""
        given = dict(pairwise(arguments[1:]))
        folder = _path(given.get("PACKAGE_DIR", "".join(arguments[:1])))
        if folder is None:
            return
        if folder.rpartition("/")[2] == arguments[0]:
            self.found.imported.append(folder.rpartition("/")[0])
        if self._is_for_programs(given.get("SCRIPTS_DESTINATION", "")):
            configuration = _path(given.get("SETUP_CFG", f"{folder}/setup.cfg"))
            if configuration:
                self.found.configurations.append(configuration)

    def install(self, arguments: list[str]) -> None:
        """Evaluate `install(PROGRAMS | FILES | DIRECTORY ...)`; which files of a folder patterns take is not known."""
        kind = "".join(arguments[:1])
        self.found.unread |= kind in ("CODE", "SCRIPT")
        if kind not in ("PROGRAMS", "FILES", "DIRECTORY"):
            return
        given = _by_keyword(arguments[1:])
        self._look_for(kind, given)
        target = "".join(given.get("DESTINATION", ())[:1])
        if not self._is_for_programs(target):
            self.found.unread |= _UNKNOWN in target
            return
        for path in map(_path, given[""]):
            if path is None or {"PATTERN", "REGEX"} & {*given}:
                self.found.unread = True
            elif kind == "DIRECTORY":
                kept = "source" if "USE_SOURCE_PERMISSIONS" in given else "no"
                runs = kept if _MAY_RUN.isdisjoint(given.get("FILE_PERMISSIONS", ())) else "yes"
                below = [name for name in self._names if not path or name.startswith(f"{path}/")]
                self.found.installed += [Installed(posixpath.basename(name), name, runs) for name in below]
            else:
                runs = "yes" if kind == "PROGRAMS" and "PERMISSIONS" not in given else "no"
                runs = runs if _MAY_RUN.isdisjoint(given.get("PERMISSIONS", ())) else "yes"
                name = "".join(given.get("RENAME", ())[:1]) or posixpath.basename(path)
                self.found.installed.append(Installed(name, path, runs))

    def _look_for(self, kind: str, given: Mapping[str, Sequence[str]]) -> None:
        """Note the files of an install() that are not there, and a folder that holds everything."""
        paths = [_path(text) for text in given[""]]
        self.found.no_launch &= None not in paths and "" not in paths
        if kind != "DIRECTORY" and not self._conditions and "OPTIONAL" not in given:
            self.found.missing += [path for path in paths if path and path not in self._names]

    def _is_for_programs(self, target: str) -> bool:
        """Return whether `ros2 run` looks for programs of the package in an installed folder."""
        normal = posixpath.normpath(target.lstrip("/")) if target else ""
        own = f"lib/{self._package}"
        return normal == own or normal.startswith(f"{own}/")


def _by_keyword(arguments: Sequence[str]) -> Mapping[str, Sequence[str]]:
    """Return what follows each keyword of an install(), and what is before all as that of an empty one."""
    into: list[str] = []
    given = {"": into}
    for word in arguments:
        if word in _KEYWORDS:
            into = given.setdefault(word, [])
        else:
            into.append(word)
    return given


def _split(value: str) -> list[str]:
    return [item for item in value.split(";") if item]


def _path(text: str) -> str | None:
    """Return a path relative to the package; None for one that is not known or leads out of it."""
    whole = posixpath.normpath(posixpath.join(_SOURCE, text))
    if _UNKNOWN in text or not (whole == _SOURCE or whole.startswith(f"{_SOURCE}/")):
        return None
    return whole[len(_SOURCE) + 1 :]


def _globbed(name: Sequence[str], pattern: Sequence[str]) -> bool:
    """Return whether the parts of a path match those of a pattern."""
    return len(name) == len(pattern) and all(map(fnmatchcase, name, pattern))


_COMMANDS: Mapping[str, Callable[[_Reader, list[str]], None]] = {
    "project": _Reader.name_project,
    "set": _Reader.set_value,
    "list": _Reader.change_list,
    "file": _Reader.find_files,
    "add_executable": _Reader.build,
    "ament_auto_add_executable": _Reader.build,
    "rclcpp_components_register_node": _Reader.register,
    "ament_python_install_package": _Reader.install_python,
    "install": _Reader.install,
}
