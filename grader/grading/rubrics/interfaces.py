"""The installed message, service and action types, and the mistakes of a rubric about them and their fields."""

from __future__ import annotations

import math
import re
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import fields, is_dataclass
from functools import cached_property
from pathlib import Path
from types import UnionType
from typing import Annotated, Any, Union, get_args, get_origin, get_type_hints

import msgspec

from grader.grading.judging.series import curve
from grader.grading.rubrics.mistakes import found, nearest_hint
from grader.grading.rubrics.model import RubricShape
from grader.grading.rubrics.simulations import Offered, offered, simulated_in
from grader.grading.rubrics.types import plain_value
from grader.grading.rubrics.yaml_tree import Mistake, Position, TreePath, YamlTree
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import FieldOf, counted
from grader.runtime.model.scenario import Stimulus
from grader.runtime.model.submission import Definition
from grader.runtime.model.wording import listed, printable

#: Numbers of type_description_interfaces/msg/FieldType: a nested message, integers, floating-point numbers, and so on.
#: Arrays add 48, bounded sequences 96 and unbounded ones 144.
_NESTED, _NUMBERS, _BOOLEAN, _TEXTS = 1, (*range(2, 14), 16), 15, range(17, 23)
_ARRAY, _SEQUENCE = 48, 96
_BOUNDED, _UNBOUNDED = _SEQUENCE, 144
_BOUNDED_TEXTS = (21, 22)
_FLOAT32, _BYTE = 10, 16
#: The names of these types in .msg files; a char is an uint8 there.
_PRIMITIVES: Mapping[int, str] = {
    2: "int8",
    3: "uint8",
    4: "int16",
    5: "uint16",
    6: "int32",
    7: "uint32",
    8: "int64",
    9: "uint64",
    10: "float32",
    11: "float64",
    12: "float64",
    13: "uint8",
    14: "wstring",
    15: "bool",
    16: "byte",
    **{number: "wstring" if number % 2 == 0 else "string" for number in range(17, 23)},
}
#: The greatest number that the classes of messages take for a float32, apart from an infinite one.
_GREATEST_FLOAT32 = 3.402823466e38
#: What separates the definitions of nested types from each other in the text of a message type.
_RULE = "=" * 80
_KINDS = {"msg": "message", "srv": "service", "action": "action"}
#: Values of simulated messages whose types are known before they are published.
_PLAIN = (bool, int, float, str, list, tuple, Mapping)
_ORDERS = ("any_order", "in_order", "some_of")
#: Builds the interface packages in some folders, and returns the folders with their type descriptions.
Build = Callable[[Sequence[Path]], Sequence[Path]]
_INDEX = re.compile(r"\[([0-9]+)\]")


class _FieldType(msgspec.Struct):
    type_id: int
    capacity: int = 0
    string_capacity: int = 0
    nested_type_name: str = ""


class Field(msgspec.Struct):
    """A field of a type, as type description files hold it (REP 2016)."""

    name: str
    type: _FieldType

    @property
    def is_list(self) -> bool:
        """Whether it is an array or a sequence."""
        return self.type.type_id > _ARRAY

    @property
    def element(self) -> int:
        """The number of its type, or of the type of its elements."""
        return self.type.type_id % _ARRAY

    def item(self, name: str) -> Field:
        """Return an element of a list as a field with a name of its own."""
        return Field(name, _FieldType(self.element, 0, self.type.string_capacity, self.type.nested_type_name))

    @property
    def declaration(self) -> str:
        """The line of a .msg file that declares it."""
        of = self.type
        name = _PRIMITIVES.get(self.element) or of.nested_type_name.replace("/msg/", "/")
        bound = f"<={of.string_capacity}" if self.element in _BOUNDED_TEXTS else ""
        count = "<=" if _BOUNDED < of.type_id < _UNBOUNDED else ""
        size = f"[{count}{of.capacity or ''}]" if self.is_list else ""
        return f"{name}{bound}{size} {self.name}"

    @property
    def words(self) -> str:
        """What its value is, e.g. `a list of 3 numbers`, without the limits of numbers."""
        one, many = {_NESTED: ("a mapping", "mapping"), _BOOLEAN: ("true or false", "boolean")}.get(
            self.element, ("a number", "number") if self.element in _NUMBERS else ("text", "text")
        )
        if not self.is_list:
            return one
        most = "at most " if self.type.type_id > _SEQUENCE else ""
        return f"a list of {most}{counted(self.type.capacity, many)}" if self.type.capacity else f"a list of {many}s"

    @property
    def integers(self) -> range | None:
        """The integers that it holds; None if it is something else."""
        name = "uint8" if self.element == _BYTE else _PRIMITIVES.get(self.element, "")
        unsigned, is_integer, bits = name.partition("int")
        if self.is_list or not is_integer:
            return None
        return range(2 ** int(bits)) if unsigned else range(-(2 ** int(bits) // 2), 2 ** int(bits) // 2)

    def instead_of(self, value: object) -> str:
        """Return what it holds, instead of a value that it cannot hold: e.g. `an integer from 0 to 255`."""
        if (integers := self.integers) is not None:
            return f"an integer from {integers[0]:,} to {integers[-1]:,}"
        if self.element == _FLOAT32 and not self.is_list and isinstance(value, (int, float)):
            return f"a number from {-_GREATEST_FLOAT32} to {_GREATEST_FLOAT32}"
        if self.element in _BOUNDED_TEXTS and not self.is_list:
            return f"text of at most {counted(self.type.string_capacity, 'character')}"
        return self.words

    def holds_as_many(self, count: int) -> bool:
        """Return whether it is a list that may have so many elements."""
        most = self.type.capacity or count
        return self.is_list and (count <= most if self.type.type_id > _SEQUENCE else count == most)


class _Description(msgspec.Struct):
    type_name: str
    fields: list[Field]


class _Descriptions(msgspec.Struct):
    type_description: _Description
    referenced_type_descriptions: list[_Description]


class _Hash(msgspec.Struct):
    type_name: str
    hash_string: str


class _File(msgspec.Struct):
    type_description_msg: _Descriptions
    type_hashes: list[_Hash] = []


class Interfaces:
    """The types that nodes can use.

    Args:
        folders: The `share` folders of ROS installations; the first folder that has a package counts.
        shipped: Folders with the packages that ship with the grader; they count last.
        build: Builds the interface packages in some folders, and returns the folders to look in.
    """

    def __init__(self, folders: Sequence[Path], shipped: Sequence[Path] = (), build: Build | None = None) -> None:
        self._all = (folders, shipped, build)
        self._folders = (*folders, *shipped)
        self._types: dict[str, Mapping[str, Field] | None] = {}
        self._hashes: dict[str, str] = {}

    def including(self, folders: Sequence[Path]) -> Interfaces:
        """Return these types and those of the interface packages in some folders; raises RubricError."""
        known, shipped, build = self._all
        return Interfaces((*known, *build(folders)), shipped, build) if build is not None and folders else self

    def definition(self, type_: str) -> Definition | None:
        """Return the definition of a message type, without comments and constants; None if it is not known."""
        fields_ = self.fields(type_)
        if fields_ is None or type_ not in self._hashes:
            return None
        nested, waiting = dict.fromkeys([type_]), [type_]
        while waiting:
            for field in (self.fields(waiting.pop()) or {}).values():
                inner = field.type.nested_type_name
                if inner and inner not in nested:
                    nested[inner] = None
                    waiting.append(inner)
        texts = []
        for name in nested:
            header = "" if name == type_ else f"{_RULE}\nMSG: {name.replace('/msg/', '/')}\n"
            lines = [field.declaration for field in (self.fields(name) or {}).values()]
            texts.append(header + "".join(f"{line}\n" for line in lines))
        return Definition("".join(texts), self._hashes[type_])

    def fields(self, type_: str) -> Mapping[str, Field] | None:
        """Return the fields of a type such as `std_srvs/srv/Trigger_Request`, by name; None if it is not installed."""
        if type_ not in self._types:
            self._types[type_] = None
            package, kind, name = type_.split("/")
            path = Path(package, kind, f"{name.partition('_')[0]}.json")
            file = next((folder / path for folder in self._folders if (folder / package).is_dir()), None)
            if file is not None and file.is_file():
                self._read(file)
        return self._types[type_]

    def _read(self, file: Path) -> None:
        """Add the types that a type description file holds; one that cannot be read holds none."""
        try:
            data = msgspec.json.decode(file.read_bytes(), type=_File)
        except (OSError, msgspec.DecodeError):
            return
        read = data.type_description_msg
        self._hashes |= {known.type_name: known.hash_string for known in data.type_hashes}
        for one in (read.type_description, *read.referenced_type_descriptions):
            self._types[one.type_name] = {field.name: field for field in one.fields}

    @cached_property
    def names(self) -> tuple[str, ...]:
        """The installed types, without the parts of services and actions, sorted."""
        files = (file for folder in self._folders for kind in _KINDS for file in folder.glob(f"*/{kind}/*.json"))
        return tuple(sorted({f"{file.parts[-3]}/{file.parts[-2]}/{file.stem}" for file in files}))

    def of_kind(self, kind: str) -> list[str]:
        """Return the installed types of a kind: `msg`, `srv` or `action`."""
        return [name for name in self.names if name.split("/")[1] == kind]

    def unknown(self, type_: str, where: Position) -> Mistake | None:
        """Return a mistake if a type is not installed."""
        if self.fields(type_) is not None:
            return None
        package, kind, _ = type_.split("/")
        packages = {name.partition("/")[0] for name in self.names}
        if package not in packages:
            bring = f"install {package}, or bring its definitions with `interfaces:` or --interfaces FOLDER"
            hint = nearest_hint(package, packages) or bring
            return where.mistake(f"expected an installed package, found `{package}`", hint)
        known = [name for name in self.of_kind(kind) if name.startswith(f"{package}/")]
        hint = nearest_hint(type_, known) or (f"{package} has {listed([name.rpartition('/')[2] for name in known])}")
        article = "an" if kind == "action" else "a"
        return where.mistake(f"expected {article} {_KINDS[kind]} type of {package}, found `{printable(type_)}`", hint)

    def at_path(self, type_: str, path: str) -> Field | str:
        """Return the field at a path of a type, or the element of a list; a text with what is wrong if there is none.

        The path has list elements counted from 0: `ranges[0]` or `ranges.0`, `poses[2].position.x`.
        """
        here: Field | None = None
        for name in _INDEX.sub(r".\1", path).split("."):
            if here is not None and here.is_list:
                if not name.isdecimal():
                    return f"expected an index such as `{here.name}[0]`, because `{here.name}` is a list"
                if here.type.type_id < _SEQUENCE and int(name) >= here.type.capacity:
                    return f"expected an index below {here.type.capacity}, the length of `{here.name}`"
                here = here.item(f"{here.name}[{name}]")
                continue
            if here is not None and here.element != _NESTED:
                return f"expected no field below `{here.name}`, which is {here.words}"
            type_ = type_ if here is None else here.type.nested_type_name
            known = self.fields(type_) or {}
            if name not in known:
                return _no_field(type_, known)
            here = known[name]
        return here or "expected the path of a field"


def _no_field(type_: str, known: Iterable[str]) -> str:
    # a message without fields has one that no program sees
    names = [f"`{name}`" for name in known if name != "structure_needs_at_least_one_member"]
    return f"expected a field of {type_} ({listed(names)})" if names else f"expected no fields of {type_}"


def interface_mistakes(rubric: RubricShape, tree: YamlTree, interfaces: Interfaces) -> list[Mistake]:
    """Return the types that are not installed, and the fields and values that the types do not have."""
    checked = _Checked(rubric, tree, interfaces)
    return [*checked.in_scenarios(), *checked.in_criteria()]


@dataclass(frozen=True, slots=True)
class _Named:
    """A type that a rubric names, and where."""

    type: str
    where: Position


class _Checked:
    """A rubric whose types are looked up."""

    def __init__(self, rubric: RubricShape, tree: YamlTree, interfaces: Interfaces) -> None:
        self._tree = tree
        self._interfaces = interfaces
        self._stimuli = tuple(_stimuli(rubric))
        self._simulated = tuple(_simulated(rubric))
        checks = tuple(_checks(rubric))
        self._checks = tuple((path, check) for path, check, _ in checks)
        #: Type of each topic, service and action; a topic with numbers has the type that the student's node chooses.
        self._types: dict[str, set[str]] = {}
        self._free: set[str] = set()
        for named, on in (*self._of_stimuli(), *self._of_checks()):
            if interfaces.fields(named.type) is not None:
                self._types.setdefault(on, set()).add(named.type)
                if "/action/" in named.type:  # its feedback is a topic, which checks may read like any other
                    feedback = f"{named.type}_FeedbackMessage"
                    self._types.setdefault(f"{on}/_action/feedback", set()).add(feedback)
        #: A recording may bring the definitions of its types, so an unknown type in a check of one is right, and no
        #: field is looked up on a topic without a known type.
        self._checks = tuple(
            (path, check)
            for path, check, of_bag in checks
            if not (of_bag and (_is_unknown(check, interfaces) or _end_of(check) not in self._types))
        )

    def _of_stimuli(self) -> Iterator[tuple[_Named, str]]:
        for path, stimulus in self._stimuli:
            where = self._tree.values.get((*path, "type"))
            if where is None:
                continue
            on = _end_of(stimulus)
            if stimulus.follows_type:
                self._free.add(on)
            yield _Named(getattr(stimulus, "type", ""), where), on

        for path, offered_ in self._simulated:
            for on, type_ in offered_.ends():
                yield _Named(type_, self._tree.at_key(path)), on

    def _of_checks(self) -> Iterator[tuple[_Named, str]]:
        for path, check in self._checks:
            where, type_ = self._tree.values.get((*path, "type")), getattr(check, "type", None)
            if where is not None and isinstance(type_, str) and type_.count("/") == 2:
                yield _Named(type_, where), _end_of(check)

    def in_scenarios(self) -> Iterator[Mistake]:
        """Yield mistakes in the types and messages of stimuli."""
        for named, _ in self._of_stimuli():
            if unknown := self._interfaces.unknown(named.type, named.where):
                yield unknown
        for path, stimulus in self._stimuli:
            for key, _, part in stimulus.becomes.holds:
                type_ = f"{getattr(stimulus, 'type', '')}{part and f'_{part}'}"
                if (*path, key) in self._tree.values and self._interfaces.fields(type_) is not None:
                    raw = self._tree.raw((*path, key))
                    each = [((*path, key), raw)] if isinstance(raw, Mapping) else _cases(raw, (*path, key))
                    yield from (m for place, value in each for m in self._in_message(value, type_, place))

        for path, offered_ in self._simulated:
            for topic, value in offered_.outputs:
                wrong = self._wrong_output(value, {**offered_.publishes, **offered_.records}[topic], topic)
                if wrong:
                    yield self._tree.at_key(path).mistake(f"expected a simulation that runs, found that {wrong}")
                    break

    def _wrong_output(self, value: Mapping[str, Any], type_: str, where: str) -> str:
        """Describe the first field in a simulated message that its type has not, or cannot hold; empty if none."""
        known = self._interfaces.fields(type_)
        for name, inner in value.items() if known is not None else ():
            if name not in (known or {}):
                return f"what it publishes on {where} has a field `{printable(name)}`: {_no_field(type_, known or {})}"
            field = (known or {})[name]
            is_list = field.is_list and isinstance(inner, (list, tuple))
            if is_list and not field.holds_as_many(len(inner)):
                return f"what it publishes on {where} has {found(list(inner))} in `{name}`, expected {field.words}"
            for item in inner if is_list else [inner]:
                if field.element == _NESTED and isinstance(item, Mapping):
                    found_ = self._wrong_output(item, field.type.nested_type_name, f"{where} in `{name}`")
                    if found_:
                        return found_
                elif isinstance(item, Mapping) or (isinstance(item, _PLAIN) and not _fits(item, field.item(name))):
                    wanted = (field.item(name) if is_list else field).instead_of(item)
                    return f"what it publishes on {where} has {found(item)} in `{name}`, expected {wanted}"
        return ""

    def _in_message(self, value: Mapping[str, object], type_: str, path: TreePath) -> Iterator[Mistake]:
        known = self._interfaces.fields(type_) or {}
        for name, inner in value.items():
            if name not in known:
                text = f"{_no_field(type_, known)}, found `{printable(name)}`"
                yield self._tree.at_key((*path, name)).mistake(text, nearest_hint(name, known))
            else:
                yield from self._in_value(inner, known[name], (*path, name))

    def _in_value(self, value: object, field: Field, path: TreePath) -> Iterator[Mistake]:
        if isinstance(value, list) and field.holds_as_many(len(value)):
            for index, item in enumerate(value):
                yield from self._in_value(item, field.item(field.name), (*path, index))
        elif field.element == _NESTED and not field.is_list and isinstance(value, Mapping):
            yield from self._in_message(value, field.type.nested_type_name, path)
        elif isinstance(value, Mapping) and value.keys() & {"between", "choose"} and not field.is_list:  # a draw
            key = next(key for key in ("text", "choose", "between") if key in value)
            for index, item in enumerate([value[key]] if key == "text" else value[key]):
                yield from self._in_value(item, field, (*path, key) if key == "text" else (*path, key, index))
        elif not _fits(value, field):
            text = f"expected {field.instead_of(value)} for `{field.name}`, found {found(value)}"
            yield self._tree.at(path).mistake(text)

    def in_criteria(self) -> Iterator[Mistake]:
        """Yield mistakes in the types and field paths of checks."""
        for named, _ in self._of_checks():
            if unknown := self._interfaces.unknown(named.type, named.where):
                yield unknown
        for path, check in self._checks:
            for place, mark, value in _paths(check, path):
                if isinstance(value, Mapping):
                    for key, inner in value.items():
                        yield from self._at_path(key, check, mark, self._tree.at_key((*place, key)))
                        if mark.values:
                            for one in _named(inner, mark):
                                yield from self._at_path(one, check, FieldOf(mark.values), self._tree.at((*place, key)))
                elif isinstance(value, str) and place in self._tree.values and value != mark.unless:
                    for one in _named(value, mark):
                        yield from self._at_path(one, check, mark, self._tree.at(place))

    def _at_path(self, path: str, check: object, mark: FieldOf, where: Position) -> Iterator[Mistake]:
        on = getattr(check, mark.parameter, None)
        named = () if on in self._free else self._types.get(on or "", ())
        kind = {"action": "action", "service": "srv"}.get(mark.parameter, "msg")
        types = [f"{type_}{mark.part}" for type_ in named or self._interfaces.of_kind(kind)]
        answers = [self._interfaces.at_path(type_, path) for type_ in types]
        if any(isinstance(answer, Field) and (answer.is_list or answer.element != _NESTED) for answer in answers):
            return
        answer = answers[0] if named else f"expected a field of an installed {_KINDS[kind]} type"
        if isinstance(answer, Field):
            inside = [f"`{path}.{name}`" for name in self._interfaces.fields(answer.type.nested_type_name) or ()]
            yield where.mistake(f"expected a field with a value ({listed(inside)}), found `{printable(path)}`")
        else:
            known = [one for type_ in types for one in self._every_path(type_) if not path.startswith(one)]
            yield where.mistake(f"{answer}, found `{printable(path)}`", nearest_hint(path, known))

    def _every_path(self, type_: str, prefix: str = "") -> Iterator[str]:
        for name, field in (self._interfaces.fields(type_) or {}).items():
            if field.element == _NESTED and not field.is_list:
                yield from self._every_path(field.type.nested_type_name, f"{prefix}{name}.")
            else:
                yield f"{prefix}{name}"


def _stimuli(rubric: RubricShape) -> Iterator[tuple[TreePath, Stimulus]]:
    for index, scenario in enumerate(rubric.scenarios):
        for number, shape in enumerate(scenario.stimuli):
            yield ("scenarios", index, "stimuli", number, shape.chosen[0]), plain_value(shape)


def _simulated(rubric: RubricShape) -> Iterator[tuple[TreePath, Offered]]:
    for path, simulated in simulated_in(rubric):
        with suppress(HarnessError):  # reported where simulations are tried
            yield path, offered(simulated)


def _checks(rubric: RubricShape) -> Iterator[tuple[TreePath, Any, bool]]:
    """Yield the place of each check, the check, and whether it judges a recording that students hand in."""
    bags = {scenario.id for scenario in rubric.scenarios if scenario.handed_in is not None}
    for index, criterion in enumerate(rubric.criteria):
        name, parameters = criterion.check.chosen
        try:
            yield ("criteria", index, "check", name), plain_value(parameters), criterion.scenario in bags
        except ValueError:
            continue  # a mistake that is found where criteria are built


def _is_unknown(check: object, interfaces: Interfaces) -> bool:
    """Return whether a check names a type that is not installed."""
    type_ = getattr(check, "type", None)
    return isinstance(type_, str) and type_.count("/") == 2 and interfaces.fields(type_) is None


def _end_of(part: object) -> str:
    """Return the topic, service or action that a stimulus or a check is about; empty if none."""
    return next((getattr(part, name) for name in ("topic", "service", "action") if hasattr(part, name)), "")


def _cases(raw: Any, path: TreePath) -> Iterator[tuple[TreePath, Mapping[str, object]]]:
    """Yield each message of a list of cases, whose order may be drawn."""
    for index, item in enumerate(raw):
        order = next((name for name in _ORDERS if name in item), "")
        if order:
            yield from _cases(item[order], (*path, index, order))
        else:
            yield (*path, index), item


def _fits(value: object, field: Field) -> bool:
    """Return whether a field that is not a list may hold a value, as `message_classes.built` puts it into a message."""
    if field.is_list or field.element == _NESTED:
        return False
    if field.element in _NUMBERS:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and _is_in_range(value, field)
    if field.element == _BOOLEAN:
        return isinstance(value, bool)
    if field.element in _BOUNDED_TEXTS:
        return isinstance(value, str) and len(value) <= field.type.string_capacity
    return field.element not in _TEXTS or isinstance(value, str)


def _is_in_range(value: float, field: Field) -> bool:
    if (integers := field.integers) is not None:  # a message takes 2.0 as an integer
        return (isinstance(value, int) or value.is_integer()) and int(value) in integers
    greatest = _GREATEST_FLOAT32 if field.element == _FLOAT32 else sys.float_info.max
    return not greatest < abs(value) < math.inf


def _paths(part: object, path: TreePath) -> Iterator[tuple[TreePath, FieldOf, object]]:
    """Yield the parameters of a check that hold field paths: place, mark and value of each."""
    hints = get_type_hints(type(part), include_extras=True)
    for field in fields(part):  # type: ignore[arg-type]
        value, place = getattr(part, field.name), (*path, field.name)
        mark = _mark(hints[field.name])
        if mark is not None:
            yield place, mark, value
        elif isinstance(value, tuple):
            mark = next(filter(None, map(_mark, get_args(hints[field.name]))), None)
            for index, item in enumerate(value):
                if mark is not None:
                    yield (*place, index), mark, item
                elif is_dataclass(item):
                    yield from _paths(item, (*place, index))


def _named(value: str, mark: FieldOf) -> tuple[str, ...]:
    """Return the field paths in a value: itself, or those in a formula."""
    return curve(value, of_fields=True).names if mark.formula else (value,)


def _mark(annotation: Any) -> FieldOf | None:
    if get_origin(annotation) is Annotated:
        return next((mark for mark in annotation.__metadata__ if isinstance(mark, FieldOf)), None)
    if get_origin(annotation) in (Union, UnionType):
        return next((mark for inner in get_args(annotation) if (mark := _mark(inner)) is not None), None)
    return None
