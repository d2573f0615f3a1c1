"""Scalars of a rubric file as pydantic types: names, quantities with units, points, formulas and patterns."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterator
from fractions import Fraction
from functools import partial
from typing import Annotated, Any, Self

from annotated_types import GroupedMetadata
from pydantic import (
    AfterValidator,
    AllowInfNan,
    BaseModel,
    BeforeValidator,
    ConfigDict,
    PlainValidator,
    Strict,
    WithJsonSchema,
    model_validator,
)
from pydantic_core import PydanticCustomError

from grader.grading.judging.series import FormulaError, curve
from grader.grading.rubrics.units import QuantityError, parse_quantity, quantity_example, quantity_pattern
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import MAX_BAG_BYTES
from grader.runtime.model.quantities import Unit, size
from grader.runtime.model.wording import listed


def wrong(expected: str, hint: str = "") -> PydanticCustomError:
    """Return an error that states what was expected at a place in a rubric."""
    return PydanticCustomError("rubric", "{expected}", {"expected": expected, "hint": hint})


def lacking(key: str) -> PydanticCustomError:
    """Return an error about a key that a mapping lacks."""
    return PydanticCustomError("lacking", "{key}", {"key": key})


def must(holds: Callable[[Any], bool], expected: str) -> AfterValidator:
    """Return a validator that rejects the values for which `holds` is false."""

    def check(value: Any) -> Any:
        if not holds(value):
            raise wrong(expected)
        return value

    return AfterValidator(check)


class Shape(BaseModel):
    """A mapping with fixed keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, loc_by_alias=True, protected_namespaces=(), defer_build=True)

    def built(self) -> Any:
        """Return the value for an exercise that the mapping stands for."""
        raise NotImplementedError


class Choice(Shape):
    """A mapping with exactly one of several keys: the kind of thing it is, and its parameters."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    @model_validator(mode="after")
    def _exactly_one(self) -> Self:
        if len(self.model_fields_set) != 1:
            names = [info.alias or name for name, info in type(self).model_fields.items()]
            raise wrong(f"exactly one of {listed(names)}")
        return self

    @property
    def chosen(self) -> tuple[str, Any]:
        """The one key, as written, and its value."""
        (name,) = self.model_fields_set
        return type(self).model_fields[name].alias or name, getattr(self, name)

    def built(self) -> Any:
        """Return the value for an exercise that the chosen key stands for."""
        return plain_value(self.chosen[1])


def plain_value(value: object) -> Any:
    """Return a validated value, and everything inside it, as values for an exercise."""
    if isinstance(value, Shape):
        return value.built()
    if isinstance(value, dict):
        return {key: plain_value(item) for key, item in value.items()}
    return tuple(map(plain_value, value)) if isinstance(value, tuple) else value


@dataclass(frozen=True, slots=True)
class MatchingText(GroupedMetadata):
    """Marks a text that must match a pattern, which means the same in Python and in JavaScript, as a whole."""

    pattern: str
    expected: str
    example: str

    def __iter__(self) -> Iterator[object]:
        yield Strict()
        yield must(lambda text: re.fullmatch(self.pattern, text) is not None, self.expected)
        yield WithJsonSchema({"type": "string", "pattern": f"^(?:{self.pattern})$", "examples": [self.example]})


@dataclass(frozen=True, slots=True)
class Quantity(GroupedMetadata):
    """Marks a number that is written with its unit; `above_zero` excludes 0."""

    unit: Unit
    above_zero: bool = False

    def __iter__(self) -> Iterator[object]:
        pattern, example = quantity_pattern(self.unit), quantity_example(self.unit)
        yield PlainValidator(self._read)
        yield WithJsonSchema({"type": "string", "pattern": pattern, "examples": [example]})

    def _read(self, value: object) -> int | float:
        try:
            is_text = isinstance(value, (int, float, str)) and not isinstance(value, bool)
            quantity = parse_quantity(str(value) if is_text else "", self.unit)
        except QuantityError as error:
            raise wrong(error.expected, error.hint) from None
        if self.above_zero and not quantity > 0:
            raise wrong(f"more than 0 {self.unit.symbol}")
        return quantity


_POINTS = re.compile(r"[0-9]{1,9}(?:\.[0-9]{1,9})?|[0-9]{1,9}/[1-9][0-9]{0,8}")


def read_points(value: object) -> Fraction:
    """Return points as a fraction; raises PydanticCustomError for anything else."""
    is_number = isinstance(value, (int, float, str)) and not isinstance(value, bool)
    text = str(value).replace(" ", "") if is_number else ""
    if text.startswith("-") or (_POINTS.fullmatch(text) and Fraction(text) == 0):
        raise wrong("points above 0")
    if not _POINTS.fullmatch(text):
        raise wrong("points such as 6, 2.5 or 1/3")
    return Fraction(text)


_FRACTION = {"type": "string", "pattern": r"^[0-9]+( */ *[1-9][0-9]*|\.[0-9]+)?$", "examples": ["1/3"]}
#: A whole, decimal or common fraction above 0, kept exactly.
Points = Annotated[
    Fraction,
    PlainValidator(read_points),
    WithJsonSchema({"anyOf": [{"type": "number", "exclusiveMinimum": 0}, _FRACTION]}),
]


def _as_text(value: object) -> object:
    return str(value) if isinstance(value, int) and not isinstance(value, bool) else value


_NAME = "[A-Za-z_][A-Za-z0-9_]*"

Text = Annotated[str, MatchingText(r"[\s\S]*\S[\s\S]*", "text that is not empty", "Publishes at 20 Hz")]
Id = Annotated[
    str, MatchingText("[a-z][a-z0-9_]*", "an id of lower-case letters, digits and _, starting with a letter", "rate")
]
Topic = Annotated[str, MatchingText(f"(?:/{_NAME})+", "an absolute topic name such as /cmd_vel", "/cmd_vel")]
MessageType = Annotated[
    str,
    MatchingText(f"[a-z][a-z0-9_]*/msg/{_NAME}", "a message type such as std_msgs/msg/Float32", "std_msgs/msg/Float32"),
]
ServiceType = Annotated[
    str,
    MatchingText(f"[a-z][a-z0-9_]*/srv/{_NAME}", "a service type such as std_srvs/srv/Trigger", "std_srvs/srv/Trigger"),
]
ActionType = Annotated[
    str,
    MatchingText(
        f"[a-z][a-z0-9_]*/action/{_NAME}", "an action type such as pkg/action/Move", "test_msgs/action/Fibonacci"
    ),
]
PythonFile = Annotated[
    str,
    MatchingText(r"[^/\\\x00-\x1f]+\.py", "a file name such as my_node.py, without folders", "my_node.py"),
]
#: A program that the student hands in: a file, or an executable that the entry points of a package name.
ProgramName = Annotated[
    str,
    MatchingText(
        r"[^/\\\x00-\x1f]+(?:\.py|launch\.(?:xml|ya?ml))|(?:\*|[A-Za-z][A-Za-z0-9_-]*)/[A-Za-z0-9_-][A-Za-z0-9_.-]*",
        "a file name such as my_node.py, without folders, or an executable such as my_package/talker",
        "my_node.py",
    ),
]
#: What the student hands in: programs and parameter files.
HandedIn = Annotated[
    str,
    MatchingText(
        r"[^/\\\x00-\x1f]+(?:\.(?:py|ya?ml)|launch\.xml)|(?:\*|[A-Za-z][A-Za-z0-9_-]*)/[A-Za-z0-9_-][A-Za-z0-9_.-]*",
        "a file name such as my_node.py, without folders, or an executable such as my_package/talker",
        "my_node.py",
    ),
]
#: A launch file or parameter file of the rubric's own, beside it.
PROVIDED_FILE = r"[A-Za-z0-9_][A-Za-z0-9_.-]*(?:[._]launch\.(?:py|xml)|\.ya?ml)"
PROVIDED_WORDS = "a launch file such as robot.launch.py or a YAML file, beside the rubric"
ProvidedFile = Annotated[str, MatchingText(PROVIDED_FILE, PROVIDED_WORDS, "robot.launch.py")]
#: A check file must be beside the rubric or below, and not hidden.
CHECK_FILE = r"(?:[A-Za-z0-9_][A-Za-z0-9_.-]*/)*[A-Za-z0-9_][A-Za-z0-9_.-]*\.py"
CheckFile = Annotated[
    str, MatchingText(CHECK_FILE, "a Python file in the rubric's folder such as my_checks.py", "my_checks.py")
]
#: A folder of interface packages, or a recording, under the same rules.
BESIDE = r"(?:[A-Za-z0-9_][A-Za-z0-9_.-]*/)*[A-Za-z0-9_][A-Za-z0-9_.-]*/?"
InterfaceFolder = Annotated[str, MatchingText(BESIDE, "a folder beside the rubric such as interfaces", "interfaces")]
RecordingPath = Annotated[
    str, MatchingText(f"(?:{BESIDE})?", "a recording beside the rubric such as bags/scan", "bags/scan")
]
#: The name of a recording that students hand in. It ends as no program and no parameter file does, so that the names of
#: wanted files tell which of them is one.
BagPattern = Annotated[
    str,
    MatchingText(
        r"(?!.*\.(?:py|ya?ml|xml)$)[^/\\\[\]\x00-\x1f]+",
        "the name of a recording such as *.mcap or square, without folders; * stands for any characters",
        "*.mcap",
    ),
]
#: A map as ROS's map_server reads it, under the same rules.
MAP_FILE = r"(?:[A-Za-z0-9_][A-Za-z0-9_.-]*/)*[A-Za-z0-9_][A-Za-z0-9_.-]*\.ya?ml"
MAP_WORDS = "the YAML file of a map in the rubric's folder such as maps/room.yaml"
MapFile = Annotated[str, MatchingText(MAP_FILE, MAP_WORDS, "maps/room.yaml")]
Number = Annotated[Text, BeforeValidator(_as_text)]
Real = Annotated[float, Strict(), AllowInfNan(allow_inf_nan=False)]
#: Unlike other numbers, a field may be `.nan` or `.inf`: sensors send them.
FieldNumber = Annotated[float, Strict()]
Whole = Annotated[int, Strict()]
YesNo = Annotated[bool, Strict()]
Share = Annotated[Real, must(lambda share: 0 <= share <= 1, "a share from 0 to 1, such as 0.2")]
Duration = Annotated[int, Quantity(Unit("s"))]
LongDuration = Annotated[int, Quantity(Unit("s"), above_zero=True)]
Frequency = Annotated[float, Quantity(Unit("Hz"))]
BagBytes = Annotated[
    int, Quantity(Unit("B"), above_zero=True), must(lambda b: b <= MAX_BAG_BYTES, f"at most {size(MAX_BAG_BYTES)}")
]

#: A longer pattern is not one that a reader of the rubric could follow.
_LONGEST_PATTERN = 400


def _formula(text: str, *, of_fields: bool = False) -> str:
    try:
        curve(text, of_fields=of_fields)
    except FormulaError as error:
        raise wrong(str(error)) from None
    return text


def _pattern(text: str) -> str:
    if not 0 < len(text) <= _LONGEST_PATTERN:
        raise wrong(f"a regular expression of at most {_LONGEST_PATTERN} characters")
    try:
        re.compile(text)
    except (re.error, RecursionError, OverflowError) as error:
        raise wrong("a regular expression of Python", str(error)) from None
    return text


_StrictText = Annotated[str, Strict()]
FormulaText = Annotated[
    _StrictText, AfterValidator(_formula), WithJsonSchema({"type": "string", "examples": ["sin(0.1 * n)"]})
]
FieldFormulaText = Annotated[
    _StrictText,
    AfterValidator(partial(_formula, of_fields=True)),
    WithJsonSchema({"type": "string", "examples": ["a + b"]}),
]
PatternText = Annotated[
    _StrictText,
    AfterValidator(_pattern),
    WithJsonSchema({"type": "string", "examples": ["[0-9]+"], "format": "regex"}),
]
