"""Definitions of messages, services and actions: found in a folder, read strictly, and nothing of them executed.

The grammar is that of ROS 2's .msg, .srv and .action files (https://docs.ros.org/en/jazzy/Concepts/Basic/About-Interfaces.html),
with the names and values that `rosidl_adapter` accepts.
"""

from __future__ import annotations

import difflib
import hashlib
import keyword
import math
import re
import sys
from collections.abc import Collection, Iterable, Iterator
from functools import cache
from pathlib import Path

from grader.runtime.compiled import compiled, state_in, state_of_package
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError
from grader.runtime.model.wording import printable

#: The packages that come with the grader.
SHIPPED = Path(__file__).with_name("shipped")
KINDS = ("msg", "srv", "action")
# What the sections of a definition are called after its name.
SECTIONS = {"msg": ("",), "srv": ("_Request", "_Response"), "action": ("_Goal", "_Result", "_Feedback")}
INTEGERS = {f"{sign}int{bits}": (bits, sign == "") for sign in ("", "u") for bits in (8, 16, 32, 64)}
PRIMITIVES = ("bool", "byte", "char", "float32", "float64", *INTEGERS, "string", "wstring")
# More than any course needs, and little enough to be built in seconds.
MAXIMUM_DEFINITIONS = 300
#: Of one definition.
MAXIMUM_BYTES = 64 * 1024
MAXIMUM_FIELDS = 500
MAXIMUM_ELEMENTS = 1_000_000
MAXIMUM_DEPTH = 40
#: Characters of a package's name and of the name of a type in lower case, `my_type`, which names of files begin with:
#: ROS's generators and Python append up to 50, and a file name has 255 at most.
MAXIMUM_PACKAGE_NAME = 100
MAXIMUM_TYPE_NAME = 200
#: Characters of the name of a field or constant: the most that DDS allows a member.
MAXIMUM_MEMBER_NAME = 255
#: Digits of a number that may be below 2**31.
_MOST_DIGITS = 12
#: Characters of a name or text that is shown.
_SHOWN = 60

_PACKAGE_NAME = re.compile(r"(?!.*__)(?!.*_\Z)[a-z][a-z0-9_]*", re.ASCII)
_TYPE_NAME = re.compile(r"[A-Z][A-Za-z0-9]*", re.ASCII)
_CONSTANT_NAME = re.compile(r"[A-Z](?:[A-Z0-9]|_(?=[A-Z0-9]))*", re.ASCII)
_TYPE = re.compile(
    r"(?P<base>[^\[\]<>=\s]+?)(?:<=(?P<bound>[0-9]+))?(?P<array>\[(?:(?P<limit><=)?(?P<size>[0-9]+))?\])?", re.ASCII
)
_FIX_TYPE = "write a type such as float64, string<=10, geometry_msgs/Point or int32[4]"


class DefinitionError(GraderError):
    """A definition cannot be used; whoever wrote it has to act.

    Attributes:
        package: Name of the package.
        file: File in the package, `msg/Foo.msg`; empty if it is the package itself.
        line: Number of the line, or 0.
        problem: What is wrong, as part of a sentence.
        fix: What to write instead.
    """

    def __init__(self, package: str, file: str, line: int, problem: str, fix: str) -> None:
        place = printable(f"{package}/{file}" if file else package, 3 * _SHOWN)
        super().__init__(f"{place}{f', line {line}' if line else ''}: {problem}", fix)
        self.package = package
        self.file = file
        self.line = line
        self.problem = problem
        self.fix = fix


@dataclass(frozen=True)
class DefinitionFile:
    """One file: its kind (`msg`, `srv` or `action`), the name of the type, and the text."""

    kind: str
    name: str
    text: str


@dataclass(frozen=True)
class InterfacePackage:
    """A package of definitions, in the order of their kinds and names."""

    name: str
    definitions: tuple[DefinitionFile, ...]


@dataclass(frozen=True)
class FieldType:
    """The type of a field or constant.

    Attributes:
        base: A primitive of .msg files, or a message's full name, `geometry_msgs/msg/Point`.
        string_bound: The greatest length of a string, if there is one.
        array: "" for one value, "fixed", "bounded" or "unbounded".
        size: The length of a fixed array, or the greatest of a bounded one.
    """

    base: str
    string_bound: int | None = None
    array: str = ""
    size: int = 0

    @property
    def primitive(self) -> bool:
        """Whether neither the type nor that of its elements is a message."""
        return "/" not in self.base


Value = bool | int | float | str


@dataclass(frozen=True)
class FieldOrConstant:
    """A field with its default value, or a constant with its value."""

    type: FieldType
    name: str
    value: Value | tuple[Value, ...] | None
    line: int


@dataclass(frozen=True)
class Section:
    """A message, or one of the parts of a service or action."""

    fields: tuple[FieldOrConstant, ...]
    constants: tuple[FieldOrConstant, ...]


@dataclass(frozen=True)
class Interface:
    """A definition that has been read: one section for a message, two for a service, three for an action."""

    package: str
    definition: DefinitionFile
    sections: tuple[Section, ...]

    @property
    def name(self) -> str:
        """The full name, `my_interfaces/msg/Foo`."""
        return f"{self.package}/{self.definition.kind}/{self.definition.name}"

    @property
    def file(self) -> str:
        """The file in the package."""
        return _file(self.definition)

    def members(self) -> Iterator[FieldOrConstant]:
        """All fields, of all sections."""
        for section in self.sections:
            yield from section.fields


def _quoted(text: str) -> str:
    return f"'{printable(text, _SHOWN)}'"


def _file(definition: DefinitionFile) -> str:
    return f"{definition.kind}/{definition.name}.{definition.kind}"


def files_in(folders: Iterable[Path]) -> list[Path]:
    """The files of all packages in some folders, sorted: definitions and manifests."""
    patterns = (*(f"*.{kind}" for kind in KINDS), "package.xml")
    found = {path for folder in folders for pattern in patterns for path in folder.rglob(pattern)}
    return sorted(path for path in found if path.is_file())


def find_packages(folder: Path) -> tuple[InterfacePackage, ...]:
    """The packages of definitions in a folder, itself included, by name.

    A package is a folder with files `msg/*.msg`, `srv/*.srv` or `action/*.action`; its name is that of its package.xml,
    or else of the folder. Links that lead out of the folder are left alone. Raises DefinitionError for names and files
    that cannot be read.
    """
    root = folder.resolve()
    homes = sorted(
        {path.parent.parent for kind in KINDS for path in root.rglob(f"{kind}/*.{kind}") if _counts(path, root)}
    )
    found: dict[str, InterfacePackage] = {}
    for home in homes:
        package = InterfacePackage(_package_name(home), tuple(_definitions(home, root)))
        if package.name in found and found[package.name] != package:
            raise DefinitionError(
                package.name, "", 0, "two folders define this package differently", "keep one of them"
            )
        found[package.name] = package
    return tuple(found[name] for name in sorted(found))


@cache
def shipped_packages() -> tuple[InterfacePackage, ...]:
    """The packages that come with the grader: those that courses use and no wheel holds, as ROS 2 Jazzy has them."""
    return compiled("interface_packages", state_in(SHIPPED) + state_of_package(), lambda: find_packages(SHIPPED))


def _counts(path: Path, root: Path) -> bool:
    """Whether a file is a source: not hidden, and not below `root` in a folder that colcon made or ignores."""
    inner = path.relative_to(root)
    return (
        _is_inside(path, root)
        and not any(part.startswith(".") for part in inner.parts)
        and not any((root / folder / "COLCON_IGNORE").exists() for folder in inner.parents if folder.name)
    )


def _is_inside(path: Path, root: Path) -> bool:
    return path.is_file() and path.resolve().is_relative_to(root)


def _package_name(home: Path) -> str:
    name = home.name
    described = home / "package.xml"
    if described.is_file() and not described.is_symlink() and described.stat().st_size <= MAXIMUM_BYTES:
        text = described.read_text(encoding="utf-8", errors="replace")
        if "<!ENTITY" in text:
            raise DefinitionError(name, "package.xml", 0, "it declares entities", "leave them out")
        import xml.etree.ElementTree as ET  # noqa: PLC0415 - most runs read no manifest

        try:
            name = (ET.fromstring(text).findtext("name") or name).strip()  # noqa: S314 - without entities
        except ET.ParseError as error:
            raise DefinitionError(name, "package.xml", error.position[0], "it is not XML", "correct it") from None
        except (ValueError, LookupError):  # an encoding that expat does not know
            problem = "it is in an unknown encoding"
            raise DefinitionError(name, "package.xml", 0, problem, "save it as UTF-8") from None
    if not _PACKAGE_NAME.fullmatch(name):
        problem = f"{_quoted(name)} is not a valid package name"
        raise DefinitionError(name, "", 0, problem, "use lower-case letters, digits and single underscores")
    if len(name) > MAXIMUM_PACKAGE_NAME:
        problem = f"{_quoted(name)} has more than {MAXIMUM_PACKAGE_NAME} characters"
        raise DefinitionError(name, "", 0, problem, "choose a shorter name")
    if name in sys.stdlib_module_names or keyword.iskeyword(name):
        raise DefinitionError(name, "", 0, "Python has a module or word of this name", "choose another name")
    return name


def _definitions(home: Path, root: Path) -> Iterator[DefinitionFile]:
    for kind in KINDS:
        for path in sorted((home / kind).glob(f"*.{kind}")):
            if not _is_inside(path, root):
                continue
            if path.stat().st_size > MAXIMUM_BYTES:
                problem = f"it has more than {MAXIMUM_BYTES} bytes"
                raise DefinitionError(home.name, f"{kind}/{path.name}", 0, problem, "shorten it")
            try:
                text = path.read_text(encoding="utf-8")
            except UnicodeDecodeError:
                raise DefinitionError(
                    home.name, f"{kind}/{path.name}", 0, "it is not UTF-8", "save it as UTF-8"
                ) from None
            yield DefinitionFile(kind, path.stem, text)


def digest(packages: Collection[InterfacePackage]) -> str:
    """A hexadecimal SHA-256 of what is defined, the order of the packages aside."""
    made = hashlib.sha256()
    for package in sorted(packages, key=lambda package: package.name):
        for definition in package.definitions:
            for part in (package.name, definition.kind, definition.name, definition.text):
                encoded = part.encode("utf-8", "surrogatepass")  # a file name need not be valid text
                made.update(len(encoded).to_bytes(8, "little") + encoded)
    return made.hexdigest()


def read_definitions(packages: Collection[InterfacePackage], installed: Collection[str]) -> tuple[Interface, ...]:
    """Read the definitions of packages that belong together.

    Args:
        packages: The packages.
        installed: Full names of the messages that other packages provide, `std_msgs/msg/Header`.

    Raises:
        DefinitionError: For the first definition that is wrong or too large, or refers to itself or an unknown type.
    """
    definitions = [(package.name, definition) for package in packages for definition in package.definitions]
    if len(definitions) > MAXIMUM_DEFINITIONS:
        problem = f"{len(definitions)} definitions are more than {MAXIMUM_DEFINITIONS}"
        raise DefinitionError(definitions[0][0], "", 0, problem, "leave out those that are not needed")
    interfaces = tuple(read_definition(package, definition) for package, definition in definitions)
    own = {interface.name: interface for interface in interfaces}
    files: dict[str, str] = {}
    for name, interface in own.items():
        other = files.setdefault(name.lower(), name)
        if other != name:
            problem = f"its name differs from that of {other.rpartition('/')[2]} only in upper and lower case"
            raise DefinitionError(interface.package, interface.file, 0, problem, "rename one of them")
    for interface in interfaces:
        for member in interface.members():
            if not member.type.primitive and member.type.base not in own and member.type.base not in installed:
                raise _unknown_type(interface, member, (*own, *installed))
    _check_sizes(own)
    return interfaces


def _unknown_type(interface: Interface, member: FieldOrConstant, known: Collection[str]) -> DefinitionError:
    messages = [name for name in known if "/msg/" in name]
    near = difflib.get_close_matches(member.type.base, messages, n=1, cutoff=0.75)
    local = member.type.base.startswith(f"{interface.package}/")
    same = [name for name in messages if name.rsplit("/", 1)[1] == member.type.base.rsplit("/", 1)[1]]
    bare = [name for name in PRIMITIVES if name == member.type.base.rsplit("/", 1)[1].lower()]
    if local and (same or bare):
        near = same[:1] or bare
    fix = f"did you mean {near[0].replace('/msg/', '/')}?" if near else "bring the package that defines it"
    problem = f"no message {printable(member.type.base.replace('/msg/', '/'), _SHOWN)} is known"
    return DefinitionError(interface.package, interface.file, member.line, problem, fix)


def _check_sizes(own: dict[str, Interface]) -> None:
    """Refuse messages that contain themselves, and those that a program could not even create."""
    sizes: dict[str, int] = {}
    path: list[str] = []

    def size(interface: Interface) -> int:
        name = interface.name
        if name in path:
            raise DefinitionError(interface.package, interface.file, 0, "it contains itself", "refer to it by a number")
        if name not in sizes:
            path.append(name)
            if len(path) > MAXIMUM_DEPTH:
                problem = f"messages are nested more than {MAXIMUM_DEPTH} deep"
                raise DefinitionError(interface.package, interface.file, 0, problem, "nest them less")
            total = 1
            for member in interface.members():
                inner = own.get(member.type.base)
                each = size(inner) if inner else 1 if member.type.primitive else 50
                if member.type.array == "fixed" or not member.type.array:
                    total += each * (member.type.size or 1)
                if total > MAXIMUM_ELEMENTS:
                    problem = f"it holds more than {MAXIMUM_ELEMENTS} values"
                    raise DefinitionError(interface.package, interface.file, member.line, problem, "use shorter arrays")
            path.pop()
            sizes[name] = total
        return sizes[name]

    for interface in own.values():
        size(interface)


def read_definition(package: str, definition: DefinitionFile) -> Interface:
    """Read one definition; types of other files are not looked up. Raises DefinitionError."""
    file = _file(definition)
    if not _TYPE_NAME.fullmatch(definition.name):
        problem = f"{_quoted(definition.name)} is not a valid type name"
        raise DefinitionError(
            package, file, 0, problem, "begin with an upper-case letter, then only letters and digits"
        )
    if len(definition.name) + sum(c.isupper() for c in definition.name) > MAXIMUM_TYPE_NAME:
        problem = f"the name {_quoted(definition.name)} is too long for the files that are made of it"
        raise DefinitionError(package, file, 0, problem, "choose a shorter name")
    sections: list[list[tuple[int, str]]] = [[]]
    for number, line in enumerate(definition.text.replace("\t", " ").splitlines(), start=1):
        if line.rstrip() == "---" and definition.kind != "msg":
            sections.append([])
        else:
            sections[-1].append((number, line.partition("#")[0].strip()))
    wanted = len(SECTIONS[definition.kind])
    if len(sections) != wanted:
        problem = f"it has {len(sections) - 1} lines '---'"
        raise DefinitionError(package, file, 0, problem, f"write {wanted - 1} between its {wanted} parts")
    return Interface(package, definition, tuple(_Reader(package, file).section(section) for section in sections))


class _Reader:
    """Reads the lines of one file."""

    def __init__(self, package: str, file: str) -> None:
        self._package = package
        self._file = file
        self._line = 0

    def section(self, lines: list[tuple[int, str]]) -> Section:
        fields: dict[str, FieldOrConstant] = {}
        constants: dict[str, FieldOrConstant] = {}
        for self._line, text in lines:
            if not text:
                continue
            type_text, _, rest = text.partition(" ")
            type_ = self._type(type_text)
            rest = rest.lstrip()
            if not rest:
                raise self._error(f"{_quoted(text)} has no name", "write a type and a name on each line")
            if "=" in rest:
                member, members = self._constant(type_, rest), constants
            else:
                member, members = self._field(type_, rest), fields
            if len(member.name) > MAXIMUM_MEMBER_NAME:
                problem = f"the name {_quoted(member.name)} has more than {MAXIMUM_MEMBER_NAME} characters"
                raise self._error(problem, "choose a shorter name")
            if member.name in members:
                raise self._error(f"the name {member.name} is used twice", "choose another one")
            members[member.name] = member
            if len(fields) + len(constants) > MAXIMUM_FIELDS:
                raise self._error(f"there are more than {MAXIMUM_FIELDS} fields", "split the definition")
        return Section(tuple(fields.values()), tuple(constants.values()))

    def _error(self, problem: str, fix: str) -> DefinitionError:
        return DefinitionError(self._package, self._file, self._line, problem, fix)

    def _type(self, text: str) -> FieldType:
        match = _TYPE.fullmatch(text)
        if match is None:
            raise self._error(f"{_quoted(text)} is not a type", _FIX_TYPE)
        base, bound, size = match["base"], match["bound"], match["size"]
        if bound is not None and base not in {"string", "wstring"}:
            name = printable(base, _SHOWN)
            raise self._error(f"{name} cannot have a greatest length", f"write {name} or {name}[<={bound}]")
        for number in (bound, size):
            if number is not None and (len(number) > _MOST_DIGITS or not 0 < int(number) < 2**31):
                raise self._error(
                    f"a length of {printable(number, _SHOWN)} is not possible", "write a length from 1 on"
                )
        array = "" if not match["array"] else "unbounded" if size is None else "bounded" if match["limit"] else "fixed"
        return FieldType(self._base(base), int(bound) if bound else None, array, int(size or 0))

    def _base(self, base: str) -> str:
        if base in PRIMITIVES:
            return base
        package, _, name = base.rpartition("/")
        package = (package or self._package).removesuffix("/msg")
        if _PACKAGE_NAME.fullmatch(package) and _TYPE_NAME.fullmatch(name):
            return f"{package}/msg/{name}"
        near = difflib.get_close_matches(base, (*PRIMITIVES, "float64", "int32"), n=1, cutoff=0.6)
        usual = {"int": "int32", "float": "float32", "double": "float64", "boolean": "bool", "str": "string"}.get(base)
        fix = f"did you mean {usual or near[0]}?" if usual or near else _FIX_TYPE
        raise self._error(f"{_quoted(base)} is not a type", fix)

    def _field(self, type_: FieldType, rest: str) -> FieldOrConstant:
        name, _, default = rest.partition(" ")
        if not _PACKAGE_NAME.fullmatch(name):
            raise self._error(
                f"{_quoted(name)} is not a valid field name", "use lower-case letters, digits and single underscores"
            )
        if keyword.iskeyword(name):
            raise self._error(f"{_quoted(name)} is a word of Python", "choose another name")
        return FieldOrConstant(
            type_, name, self._default(type_, default.strip()) if default.strip() else None, self._line
        )

    def _constant(self, type_: FieldType, rest: str) -> FieldOrConstant:
        name, _, value = rest.partition("=")
        name = name.rstrip()
        if not _CONSTANT_NAME.fullmatch(name):
            raise self._error(
                f"{_quoted(name)} is not a valid constant name", "use upper-case letters, digits and single underscores"
            )
        if not type_.primitive or type_.array or type_.string_bound:
            raise self._error("a constant cannot have this type", "use a number, a bool or a string")
        return FieldOrConstant(type_, name, self._value(type_.base, value.strip(), None), self._line)

    def _default(self, type_: FieldType, text: str) -> Value | tuple[Value, ...]:
        if not type_.primitive:
            raise self._error("a message cannot have a default value", "leave it out")
        if not type_.array:
            return self._value(type_.base, text, type_.string_bound)
        if not (text.startswith("[") and text.endswith("]")):
            raise self._error(f"{_quoted(text)} is not a list", "write the default as [1, 2, 3]")
        parts = (
            self._strings(text[1:-1]) if "string" in type_.base else [each.strip() for each in text[1:-1].split(",")]
        )
        values = tuple(self._value(type_.base, part, type_.string_bound) for part in parts if parts != [""])
        if (type_.array == "fixed" and len(values) != type_.size) or (
            type_.array == "bounded" and len(values) > type_.size
        ):
            raise self._error(f"the default has {len(values)} elements", f"the type says {type_.size}")
        return values

    def _strings(self, text: str) -> list[str]:
        """The elements of a list of strings, with their quotes."""
        pattern = re.compile(r"""\s*("(?:\\.|[^"\\])*"|'(?:\\.|[^'\\])*'|[^,"']+?)\s*(?:,|\Z)""")
        parts, position = [], 0
        while position < len(text.rstrip()):
            match = pattern.match(text, position)
            if match is None:
                raise self._error(f"{_quoted(f'[{text}]')} is not a list of strings", 'write ["one", "two"]')
            parts.append(match[1])
            position = match.end()
        return parts

    def _value(self, base: str, text: str, bound: int | None) -> Value:
        if base == "bool":
            if text.lower() not in {"true", "false", "1", "0"}:
                raise self._error(f"{_quoted(text)} is not a bool", "write true or false")
            return text.lower() in {"true", "1"}
        if base in {"string", "wstring"}:
            return self._string(text, bound)
        if base in {"float32", "float64"}:
            return self._float(text)
        bits, signed = INTEGERS.get(base, (8, False))
        low, high = (-(2 ** (bits - 1)), 2 ** (bits - 1) - 1) if signed else (0, 2**bits - 1)
        try:
            number = int(text, 10 if text.lstrip("+-0").isdecimal() else 0) if len(text) < 80 else high + 1
        except ValueError:
            number = high + 1
        if not low <= number <= high:
            raise self._error(f"{_quoted(text)} is not of type {base}", f"write a whole number from {low} to {high}")
        return number

    def _float(self, text: str) -> float:
        try:
            number = float(text)
        except ValueError:
            number = math.nan
        if not math.isfinite(number):
            raise self._error(f"{_quoted(text)} is not a number", "write a number such as 0.5")
        return number

    def _string(self, text: str, bound: int | None) -> str:
        if text[:1] in {'"', "'"}:
            if len(text) < 2 or text[-1] != text[0]:
                raise self._error("the quotes of the string do not match", "close them")
            text = re.sub(r"\\([\"'])", r"\1", text[1:-1])
        try:
            value = text.encode("latin-1", "backslashreplace").decode("unicode_escape")
            value.encode()
        except UnicodeError:
            raise self._error("the string has an unknown escape", "write \\\\ for a backslash") from None
        if not value.isprintable():
            raise self._error("the string has control characters", "leave them out")
        if bound is not None and len(value) > bound:
            raise self._error(f"the default has {len(value)} characters", f"the type says {bound}")
        return value
