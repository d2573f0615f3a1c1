"""Finds out which programs a CMakeLists.txt installs for `ros2 run`, without running CMake."""

from __future__ import annotations

import posixpath
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import field
from fnmatch import fnmatchcase
from itertools import pairwise

from grader.grading.submissions.setup_files import LimitError
from grader.runtime.model.dataclass import dataclass

#: The maximum length of a value, the maximum number of commands that are evaluated, and the deepest nesting of calls.
TEXT_CHARACTERS, STEPS, DEPTH = 100_000, 20_000, 20
#: The most files that are installed: far more than the programs of a package.
MOST_INSTALLED = 5_000
#: Stands for the folder of the CMakeLists.txt in paths, and for what is not known before CMake runs.
_SOURCE, _UNKNOWN = "/source", "\0"
_SOURCE_VARIABLES = ("CMAKE_SOURCE_DIR", "CMAKE_CURRENT_SOURCE_DIR", "CMAKE_CURRENT_LIST_DIR", "PROJECT_SOURCE_DIR")
_BUILD_VARIABLES = ("CMAKE_BINARY_DIR", "CMAKE_CURRENT_BINARY_DIR", "PROJECT_BINARY_DIR")
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
_OPENING = {"if": "endif", "foreach": "endforeach", "while": "endwhile", "function": "endfunction", "macro": "endmacro"}
#: The keywords of install() with a value, and those that begin a list.
_ONE, _LISTS = (
    frozenset({"DESTINATION", "RENAME", "COMPONENT", "TYPE", "PATTERN", "REGEX"}),
    frozenset({"PERMISSIONS", "FILE_PERMISSIONS", "DIRECTORY_PERMISSIONS", "CONFIGURATIONS"}),
)
_FLAGS = frozenset(
    {"OPTIONAL", "EXCLUDE_FROM_ALL", "USE_SOURCE_PERMISSIONS", "MESSAGE_NEVER", "FILES_MATCHING", "EXCLUDE"}
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
    """

    installed: list[Installed] = field(default_factory=list)
    built: list[str] = field(default_factory=list)
    configurations: list[str] = field(default_factory=list)
    imported: list[str] = field(default_factory=list)
    unread: bool = False


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
    reader.run(list(_commands(text)))
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
    """Evaluates commands; every branch of a condition, because none of the conditions is known."""

    def __init__(self, package: str, names: Sequence[str]) -> None:
        self._package = package
        self._names = names
        self._values = dict.fromkeys(_SOURCE_VARIABLES, _SOURCE) | dict.fromkeys(_BUILD_VARIABLES, _UNKNOWN)
        self._values |= {"CMAKE_INSTALL_PREFIX": "", "CMAKE_INSTALL_LIBDIR": "lib", "PROJECT_NAME": package}
        self._functions: dict[str, tuple[list[str], Sequence[Command]]] = {}
        self._steps = self._depth = 0
        self.found = Contents()

    def run(self, commands: Sequence[Command]) -> None:
        """Evaluate commands in order."""
        at = 0
        while at < len(commands):
            self._count_step()
            name, raw = commands[at]
            if name in ("foreach", "while", "function", "macro"):
                end = _end_of(commands, at)
                self._block(name, raw, commands[at + 1 : end])
                at = end
            elif name in self._functions:
                self._call(name, self._expanded(raw))
            elif name in _COMMANDS:
                _COMMANDS[name](self, self._expanded(raw))
            at += 1

    def _count_step(self) -> None:
        self._steps += 1
        if self._steps > STEPS or len(self.found.installed) > MOST_INSTALLED:
            raise LimitError

    def _block(self, kind: str, raw: list[tuple[str, bool]], body: Sequence[Command]) -> None:
        arguments = self._expanded(raw)
        if kind == "foreach":
            for item in self._items(arguments[1:]):
                self._count_step()
                self._values[arguments[0]] = item
                self.run(body)
        elif kind == "while":
            self.found.unread = self.found.unread or any(name == "install" for name, _ in body)
        elif arguments:
            self._functions[arguments[0].lower()] = (arguments[1:], body)

    def _items(self, arguments: list[str]) -> Iterator[str]:
        """Yield the values of a foreach()."""
        if arguments[:1] == ["RANGE"]:
            yield _UNKNOWN
            return
        lists = False
        for place, argument in enumerate(arguments):
            if place and argument in ("LISTS", "ITEMS") and arguments[0] == "IN":
                lists = argument == "LISTS"
            elif lists:
                yield from _split(self._values.get(argument, ""))
            elif place or argument != "IN":
                if argument in ("LISTS", "ITEMS") and not place:
                    continue
                yield argument

    def _call(self, name: str, arguments: list[str]) -> None:
        parameters, body = self._functions[name]
        self._depth += 1
        if self._depth > DEPTH:
            raise LimitError
        kept = dict(self._values)
        self._values |= dict(zip(parameters, arguments, strict=False))
        self._values |= {"ARGN": ";".join(arguments[len(parameters) :]), "ARGV": ";".join(arguments)}
        self._values |= {f"ARGV{place}": argument for place, argument in enumerate(arguments)}
        self.run(body)
        self._values = kept
        self._depth -= 1

    def _expanded(self, raw: Sequence[tuple[str, bool]]) -> list[str]:
        """Return arguments with the values of variables; an unquoted one is split into its items."""
        found: list[str] = []
        for text, quoted in raw:
            value = self._filled(text)
            found += [value] if quoted else _split(value)
        return found

    def _filled(self, text: str) -> str:
        for _ in range(DEPTH):
            filled = _REFERENCE.sub(lambda name: self._values.get(name[1], ""), text)
            if len(filled) > TEXT_CHARACTERS:
                raise LimitError
            if filled == text:
                break
            text = filled
        text = _UNKNOWN if "$<" in text or "$ENV{" in text else text
        return _ESCAPE.sub(r"\1", text) if "\\" in text else text

    def set_value(self, arguments: list[str]) -> None:
        """Evaluate `set(NAME VALUE...)`."""
        if not arguments:
            return
        values = arguments[1:]
        if "CACHE" in values:
            values = values[: values.index("CACHE")]
        self._values[arguments[0]] = ";".join(value for value in values if value != "PARENT_SCOPE")

    def remove_value(self, arguments: list[str]) -> None:
        """Evaluate `unset(NAME)`."""
        self._values.pop("".join(arguments[:1]), None)

    def name_project(self, arguments: list[str]) -> None:
        """Evaluate `project(NAME ...)`."""
        if arguments:
            self._values["PROJECT_NAME"] = self._values["CMAKE_PROJECT_NAME"] = arguments[0]

    def change_list(self, arguments: list[str]) -> None:
        """Evaluate `list(APPEND | PREPEND | REMOVE_ITEM NAME ...)`; another change makes the list unknown."""
        kind, name = (*arguments[:2], "", "")[:2]
        known = _split(self._values.get(name, ""))
        if kind == "APPEND":
            known += arguments[2:]
        elif kind in ("PREPEND", "INSERT"):
            known = arguments[2 if kind == "PREPEND" else 3 :] + known
        elif kind == "REMOVE_ITEM":
            known = [item for item in known if item not in arguments[2:]]
        elif kind in ("FILTER", "TRANSFORM", "SUBLIST", "POP_BACK", "POP_FRONT"):
            known = [_UNKNOWN]
        self._values[name] = ";".join(known)

    def find_files(self, arguments: list[str]) -> None:
        """Evaluate `file(GLOB NAME ...)` and `file(GLOB_RECURSE NAME ...)`."""
        if len(arguments) < 2 or arguments[0] not in ("GLOB", "GLOB_RECURSE"):
            return
        rest, patterns, relative = arguments[2:], [], ""
        while rest:
            word = rest.pop(0)
            if word == "LIST_DIRECTORIES" and rest:
                rest.pop(0)
            elif word == "RELATIVE" and rest:
                relative = rest.pop(0)
            elif word not in ("CONFIGURE_DEPENDS", "FOLLOW_SYMLINKS"):
                patterns.append(_path(word))
        found = []
        for pattern in patterns:
            if pattern is None:
                found.append(_UNKNOWN)
                continue
            folder, _, last = pattern.rpartition("/")
            recursive = arguments[0] == "GLOB_RECURSE"
            found += sorted(name for name in self._names if _globbed(name, folder, last, recursive=recursive))
        above = _path(relative) if relative else None
        paths = [f"{_SOURCE}/{name}" if name != _UNKNOWN else name for name in found]
        if above is not None:
            paths = [p if p == _UNKNOWN else posixpath.relpath(p, posixpath.join(_SOURCE, above)) for p in paths]
        self._values[arguments[1]] = ";".join(paths)

    def take_part(self, arguments: list[str]) -> None:
        """Evaluate `get_filename_component(NAME PATH PART)`."""
        if len(arguments) < 3:
            return
        name, path, part = arguments[:3]
        last = posixpath.basename(path)
        parts = {
            "NAME": last,
            "NAME_WE": last.partition(".")[0],
            "NAME_WLE": posixpath.splitext(last)[0],
            "DIRECTORY": posixpath.dirname(path),
            "PATH": posixpath.dirname(path),
            "EXT": "".join(last.partition(".")[1:]),
            "ABSOLUTE": posixpath.join(_SOURCE, path),
            "REALPATH": posixpath.join(_SOURCE, path),
        }
        self._values[name] = parts.get(part, _UNKNOWN) if _UNKNOWN not in path else _UNKNOWN

    def change_text(self, arguments: list[str]) -> None:
        """Evaluate `string(REPLACE OLD NEW NAME TEXT...)`; what another one makes is unknown."""
        if arguments[:1] == ["REPLACE"] and len(arguments) > 4 and arguments[1]:
            self._values[arguments[3]] = "".join(arguments[4:]).replace(arguments[1], arguments[2])
            return
        self._values |= {name: _UNKNOWN for name in arguments[1:] if name.isidentifier() and name != "PROJECT_NAME"}

    def build(self, arguments: list[str]) -> None:
        """Evaluate `add_executable(NAME ...)` or `rclcpp_components_register_node(... EXECUTABLE NAME)`."""
        if "EXECUTABLE" in arguments[:-1]:
            self.found.built.append(arguments[arguments.index("EXECUTABLE") + 1])
        elif arguments:
            self.found.built.append(arguments[0])
        self.found.unread = self.found.unread or any(_UNKNOWN in name for name in self.found.built[-1:])

    def register(self, arguments: list[str]) -> None:
        """Evaluate `rclcpp_components_register_node(LIBRARY ... EXECUTABLE NAME)`."""
        if "EXECUTABLE" in arguments:
            self.build(arguments)

    def include(self, arguments: list[str]) -> None:
        """Evaluate a command that reads another file, which may install more."""
        here = "".join(arguments[:1])
        self.found.unread = self.found.unread or "/" in here or here.endswith(".cmake") or _UNKNOWN in here

    def add_folder(self, _: list[str]) -> None:
        """Evaluate `add_subdirectory(FOLDER)`, whose own file is not read."""
        self.found.unread = True

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
        """Evaluate `install(PROGRAMS | FILES | DIRECTORY ...)`."""
        kind = "".join(arguments[:1])
        if kind in ("CODE", "SCRIPT"):
            self.found.unread = True
        if kind not in ("PROGRAMS", "FILES", "DIRECTORY"):
            return
        given = _Given.of(arguments[1:])
        target = given.value("DESTINATION")
        if _UNKNOWN in target:
            self.found.unread = True
        if not self._is_for_programs(target):
            return
        for source in given.sources:
            path = _path(source)
            if path is None:
                self.found.unread = True
            elif kind == "DIRECTORY":
                self._install_folder(path, given)
            else:
                runs = kind == "PROGRAMS" if "PERMISSIONS" not in given.lists else given.may_run("PERMISSIONS")
                name = given.value("RENAME") or path.rpartition("/")[2]
                self.found.installed.append(Installed(name, path, "yes" if runs else "no"))

    def _install_folder(self, folder: str, given: _Given) -> None:
        if any(kind == "REGEX" for kind, _, _ in given.matches):
            self.found.unread = True
        kept = "source" if "USE_SOURCE_PERMISSIONS" in given.flags else "no"
        runs = "yes" if given.may_run("FILE_PERMISSIONS") else kept
        for path in self._names:
            if folder and not path.startswith(f"{folder}/"):
                continue
            found = [match for match in given.matches if match[0] == "PATTERN" and _matches(path, match[1])]
            if any("EXCLUDE" in more for _, _, more in found) or ("FILES_MATCHING" in given.flags and not found):
                continue
            own = next((more for _, _, more in found if "PERMISSIONS" in more), None)
            executable = runs if own is None else "yes" if not _MAY_RUN.isdisjoint(own) else "no"
            self.found.installed.append(Installed(path.rpartition("/")[2], path, executable))

    def _is_for_programs(self, target: str) -> bool:
        """Return whether `ros2 run` looks for programs of the package in an installed folder."""
        normal = posixpath.normpath(target.lstrip("/")) if target else ""
        own = f"lib/{self._package}"
        return normal == own or normal.startswith(f"{own}/")


@dataclass(slots=True)
class _Given:
    """The arguments of an install()."""

    sources: list[str] = field(default_factory=list)
    values: dict[str, str] = field(default_factory=dict)
    lists: dict[str, list[str]] = field(default_factory=dict)
    flags: set[str] = field(default_factory=set)
    matches: list[tuple[str, str, list[str]]] = field(default_factory=list)  # `PATTERN`, the pattern, and what follows

    @classmethod
    def of(cls, arguments: Sequence[str]) -> _Given:
        """Sort arguments."""
        given = cls()
        into: list[str] | None = given.sources
        words = iter(arguments)
        for word in words:
            last = given.matches[-1][2] if given.matches else None
            if word in ("PATTERN", "REGEX"):
                given.matches.append((word, next(words, ""), []))
                into = None
            elif word in _ONE:
                given.values[word] = next(words, "")
                into = None
            elif word in _LISTS:
                into = given.lists.setdefault(word, []) if last is None or word != "PERMISSIONS" else last
                if into is last and last is not None:
                    last.append(word)
            elif word in _FLAGS:
                if word == "EXCLUDE" and last is not None:
                    last.append(word)
                else:
                    given.flags.add(word)
                into = None
            elif into is not None:
                into.append(word)
        return given

    def value(self, name: str) -> str:
        """Return the value of a keyword; empty if it is not given."""
        return self.values.get(name, "")

    def may_run(self, name: str) -> bool:
        """Return whether a list of permissions lets somebody execute the file."""
        return not _MAY_RUN.isdisjoint(self.lists.get(name, ()))


def _end_of(commands: Sequence[Command], begin: int) -> int:
    """Return the place of the command that ends a block."""
    opening, depth = commands[begin][0], 0
    for place in range(begin, len(commands)):
        name = commands[place][0]
        depth += (name == opening) - (name == _OPENING[opening])
        if not depth:
            return place
    raise ValueError(f"{opening}() without an end")


def _split(value: str) -> list[str]:
    return [item for item in value.split(";") if item]


def _path(text: str) -> str | None:
    """Return a path relative to the package; None for one that is not known or leads out of it."""
    whole = posixpath.normpath(posixpath.join(_SOURCE, text))
    if _UNKNOWN in text or not (whole == _SOURCE or whole.startswith(f"{_SOURCE}/")):
        return None
    return whole[len(_SOURCE) + 1 :]


def _globbed(name: str, folder: str, pattern: str, *, recursive: bool) -> bool:
    here, _, last = name.rpartition("/")
    inside = here == folder if not recursive else f"{here}/".startswith(f"{folder}/" if folder else "")
    if not recursive and not inside and "*" in folder:
        parts, wanted = here.split("/"), folder.split("/")
        inside = len(parts) == len(wanted) and all(map(fnmatchcase, parts, wanted))
    return inside and fnmatchcase(last, pattern)


def _matches(path: str, pattern: str) -> bool:
    """Return whether the end of a path matches a PATTERN of install(DIRECTORY), as a whole name or path."""
    parts, wanted = path.split("/"), pattern.split("/")
    return any(
        all(map(fnmatchcase, parts[at : at + len(wanted)], wanted)) and len(parts[at:]) >= len(wanted)
        for at in range(len(parts))
    )


_COMMANDS: Mapping[str, Callable[[_Reader, list[str]], None]] = {
    "set": _Reader.set_value,
    "unset": _Reader.remove_value,
    "project": _Reader.name_project,
    "list": _Reader.change_list,
    "file": _Reader.find_files,
    "get_filename_component": _Reader.take_part,
    "string": _Reader.change_text,
    "add_executable": _Reader.build,
    "ament_auto_add_executable": _Reader.build,
    "rclcpp_components_register_node": _Reader.register,
    "include": _Reader.include,
    "add_subdirectory": _Reader.add_folder,
    "ament_python_install_package": _Reader.install_python,
    "install": _Reader.install,
}
