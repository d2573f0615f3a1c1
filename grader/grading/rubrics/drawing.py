"""Shapes of stimuli in a rubric file: fields, times and cases, which may be drawn from the seed."""

from __future__ import annotations

import difflib
from collections.abc import Callable, Mapping
from types import GenericAlias
from typing import TYPE_CHECKING, Annotated, Any, ClassVar, Literal, Self, TypeVar, Union

from pydantic import AfterValidator, BeforeValidator, Discriminator, Field, Strict, Tag, create_model, model_validator
from typing_extensions import TypeAliasType

from grader.grading.rubrics.types import (
    Choice,
    Duration,
    FieldNumber,
    LongDuration,
    MatchingText,
    Real,
    Shape,
    Text,
    Topic,
    Whole,
    YesNo,
    must,
    plain_value,
    wrong,
)
from grader.runtime.model.limits import MAX_CALLS, MAX_CASES, MAX_CLIENTS
from grader.runtime.model.scenario import (
    AnyOrder,
    Between,
    Choose,
    CountBetween,
    FieldSpec,
    InOrder,
    JustAbove,
    JustBelow,
    SomeOf,
    TimeBetween,
    Written,
)
from grader.runtime.stimuli import ServiceCalls

#: Maximum number of decimals with which a text shows a drawn number.
DECIMALS = 9


def _rising(low_high: tuple[float, float]) -> bool:
    return low_high[0] < low_high[1]


FieldName = Annotated[str, MatchingText("[a-z][A-Za-z0-9_]*", "the name of a field such as data", "data")]
LowHigh = Annotated[tuple[Real, Real], must(_rising, "two numbers, the lower one first")]
Option = Annotated[str, Strict()] | YesNo | Whole | FieldNumber


class DrawnFieldShape(Shape):
    """A value that is drawn from the seed: a number, one of several values, or a text with a number in it."""

    between: LowHigh | None = None
    choose: tuple[Option, ...] | None = Field(default=None, min_length=1)
    text: Text | None = None
    decimals: Annotated[Whole, must(lambda n: 0 <= n <= DECIMALS, f"a number of decimals from 0 to {DECIMALS}")] = 1

    @model_validator(mode="after")
    def _one_kind(self) -> Self:
        given = self.model_fields_set
        if ("between" in given) == ("choose" in given):
            raise wrong("exactly one of between and choose")
        if "choose" in given and given & {"text", "decimals"}:
            raise wrong("`text` and `decimals` beside `between` only")
        if "decimals" in given and self.text is None:
            raise wrong("`decimals` beside `text` only")
        if self.text is not None and self.text.count("{}") != 1:
            raise wrong("a text that holds {} once, where the number goes")
        return self

    def built(self) -> Between | Choose | Written:
        """Return the draw as a scenario holds it."""
        if self.choose is not None:
            return Choose(self.choose)
        between = Between(*(self.between or (0.0, 1.0)))
        return between if self.text is None else Written(self.text, between, self.decimals)


def _kind(value: object) -> str:
    """Return the tag of a value; tags are not names of fields, so that error places stay right."""
    if isinstance(value, Mapping):
        return "<drawn>" if value.keys() & {"between", "choose"} else "<parts>"
    kinds = {list: "<list>", tuple: "<list>", str: "<text>", bool: "<bool>", int: "<whole>"}
    return kinds.get(type(value), "<number>")


if TYPE_CHECKING:
    # pydantic reads the one below
    FieldValue = DrawnFieldShape | dict[str, "FieldValue"] | tuple["FieldValue", ...] | str | float
else:
    FieldValue = TypeAliasType(
        "FieldValue",
        Annotated[
            Annotated[DrawnFieldShape, Tag("<drawn>")]
            | Annotated[dict[FieldName, "FieldValue"], Tag("<parts>")]
            | Annotated[tuple["FieldValue", ...], Tag("<list>")]
            | Annotated[str, Strict(), Tag("<text>")]
            | Annotated[YesNo, Tag("<bool>")]
            | Annotated[Whole, Tag("<whole>")]
            | Annotated[FieldNumber, Tag("<number>")],
            Discriminator(_kind),
        ],
    )
Fields = dict[FieldName, FieldValue]


_TWO = "two of them, the lower one first"
_TWO_COUNTS = f"two whole numbers from 0 to {MAX_CASES:,}, the lower one first"


class _Drawn(Shape):
    """Two limits between which the seed draws a value, as a class of the core holds them."""

    made: ClassVar[type]
    between: tuple[Any, Any]

    def built(self) -> Any:
        """Return the draw as a scenario holds it."""
        return self.made(*self.between)


class DrawnTimeShape(_Drawn):
    """A time that is drawn from the seed."""

    made = TimeBetween
    between: Annotated[tuple[Duration, Duration], must(_rising, _TWO)]


class DrawnLongTimeShape(DrawnTimeShape):
    """A time above 0 that is drawn from the seed."""

    between: Annotated[tuple[LongDuration, LongDuration], must(_rising, _TWO)]


class DrawnCountShape(_Drawn):
    """A count that is drawn from the seed."""

    made = CountBetween
    between: Annotated[tuple[Whole, Whole], must(lambda pair: 0 <= pair[0] < pair[1] <= MAX_CASES, _TWO_COUNTS)]


def drawn_or_not(value: object) -> str:
    """Return the tag of a value; tags are not names of fields, so that error places stay right."""
    return "<drawn>" if isinstance(value, Mapping) else "<fixed>"


_Count = Annotated[Whole, must(lambda n: 0 <= n <= MAX_CASES, f"a whole number from 0 to {MAX_CASES:,}")]
_Fixed = TypeVar("_Fixed")
_Varying = TypeVar("_Varying")
#: A fixed value, or a mapping that says how it is drawn.
Either = Annotated[Annotated[_Fixed, Tag("<fixed>")] | Annotated[_Varying, Tag("<drawn>")], Discriminator(drawn_or_not)]
SomeTime = Either[Duration, DrawnTimeShape]
SomeLongTime = Either[LongDuration, DrawnLongTimeShape]
SomeCount = Either[_Count, DrawnCountShape]


class _CasesShape(Shape):
    """Cases with an order keyword, whose values are those of a class of the core, in order."""

    made: ClassVar[type]

    def built(self) -> object:
        """Return the cases as a scenario holds them."""
        return self.made(*(plain_value(getattr(self, name)) for name in type(self).model_fields))


class InOrderShape(_CasesShape):
    """Cases that follow each other as written, wherever among others they come."""

    made = InOrder
    in_order: object


class SomeOfShape(_CasesShape):
    """A number of cases, each one of those listed, drawn from the seed."""

    made = SomeOf
    some_of: object
    count: SomeCount


class AnyOrderShape(_CasesShape):
    """Cases that all come, in an order drawn from the seed."""

    made = AnyOrder
    any_order: object


_LISTS = ("any_order", "in_order", "some_of")


def _kind_of_case(value: object) -> str:
    """Return the tag of an entry in a list of cases."""
    found = [name for name in _LISTS if isinstance(value, Mapping) and name in value]
    return f"<{found[0]}>" if found else "<case>"


def _spelt(value: object) -> object:
    """Reject a misspelt order keyword: its content would be read as a case."""
    for key in value if isinstance(value, Mapping) else ():
        near = [] if key in _LISTS else difflib.get_close_matches(str(key), _LISTS, n=1, cutoff=0.85)
        if near:
            raise wrong("a case, `any_order`, `in_order` or `some_of`", f"did you mean `{near[0]}`?")
    return value


def cases_model(case: object, name: str) -> object:
    """Return the model of an entry in a list of cases: one case, or several with an order keyword."""
    listed = (list_of(case), Field(min_length=1))
    in_order = create_model(f"{name}InOrder", __base__=InOrderShape, __doc__=InOrderShape.__doc__, in_order=listed)
    some_of = create_model(f"Some{name}", __base__=SomeOfShape, __doc__=SomeOfShape.__doc__, some_of=listed)
    inner = {"<case>": case, "<in_order>": in_order, "<some_of>": some_of}
    mixed = (list_of(_one_of(inner)), Field(min_length=1))
    any_order = create_model(
        f"{name}InAnyOrder", __base__=AnyOrderShape, __doc__=AnyOrderShape.__doc__, any_order=mixed
    )
    return _one_of({**inner, "<any_order>": any_order})


def _one_of(kinds: Mapping[str, object]) -> object:
    tagged = tuple(Annotated[kind, Tag(tag)] for tag, kind in kinds.items())
    return Annotated[Union[tagged], Discriminator(_kind_of_case), BeforeValidator(_spelt)]  # noqa: UP007


def list_of(case: object) -> Any:
    """Return the type of a list of cases."""
    return GenericAlias(tuple, (case, ...))


#: Default of keys that were not chosen in a choice; not a value that a rubric can contain.
ABSENT: Any = None


class DrawnShape(Choice):
    """A number that depends on the seed or on the student's message type."""

    between: LowHigh = ABSENT
    just_above: Real = ABSENT
    just_below: Real = ABSENT

    def built(self) -> Between | JustAbove | JustBelow:
        """Return the draw as a scenario holds it."""
        kind, value = self.chosen
        if kind == "between":
            return Between(*value)
        return JustAbove(value) if kind == "just_above" else JustBelow(value)


NumberShape = Either[Real, DrawnShape]


def _count_to(most: int) -> AfterValidator:
    return must(lambda count: 1 <= count <= most, f"a whole number from 1 to {most:,}")


_DRAWN_CALLS = must(
    lambda drawn: 1 <= drawn.between[0] < drawn.between[1] <= MAX_CALLS,
    f"two whole numbers from 1 to {MAX_CALLS:,}, the lower one first",
)
Calls = Either[Annotated[Whole, _count_to(MAX_CALLS)], Annotated[DrawnCountShape, _DRAWN_CALLS]]
Clients = Annotated[Whole, _count_to(MAX_CLIENTS)]
_NEVER = AfterValidator(lambda value: value or 0)
TimeOrNever = Annotated[LongDuration | None, _NEVER]
CallsOrNever = Annotated[Calls | None, _NEVER]
NumberCases: Any = Annotated[list_of(cases_model(NumberShape, "Numbers")), Field(min_length=1)]
MessageCasesOrNone: Any = list_of(cases_model(Fields, "Messages"))
MessageCases: Any = Annotated[MessageCasesOrNone, Field(min_length=1)]


def _is_number(value: object) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool)


def _drawn_as(holds: Callable[[DrawnFieldShape], bool], expected: str) -> Any:
    return Annotated[DrawnFieldShape, must(holds, expected)]


def _options(drawn: DrawnFieldShape, kind: type) -> bool:
    return all(type(option) is kind for option in drawn.choose or ())


#: What a parameter of a simulation is drawn from, by its type.
DrawnNumber = _drawn_as(
    lambda drawn: drawn.text is None and all(map(_is_number, drawn.choose or ())), "numbers to draw from"
)
DrawnWhole = _drawn_as(
    lambda drawn: drawn.text is None and _options(drawn, int) and all(n.is_integer() for n in drawn.between or ()),
    "whole numbers to draw from",
)
DrawnYesNo = _drawn_as(lambda drawn: drawn.between is None and _options(drawn, bool), "true and false to draw from")
DrawnText = _drawn_as(
    lambda drawn: (drawn.between is None or drawn.text is not None) and _options(drawn, str), "texts to draw from"
)


class ParameterShape(Shape):
    """A stimulus: sets or reads a parameter of the student's node; without `node`, of the only one."""

    node: Topic | None = None
    name: Text
    set: FieldValue | None = None
    start: SomeTime = 0

    def built(self) -> ServiceCalls:
        """Return the equivalent service call."""
        if self.set is None:
            return _call(self, "get_parameters", "rcl_interfaces/srv/GetParameters", {"names": (self.name,)})
        wanted: Mapping[str, FieldSpec] = {"name": self.name, "value": _parameter_value(plain_value(self.set))}
        return _call(self, "set_parameters", "rcl_interfaces/srv/SetParameters", {"parameters": (wanted,)})


class TransitionShape(Shape):
    """A stimulus: requests a transition of the student's lifecycle node; without `node`, of the only one."""

    node: Topic | None = None
    to: Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]
    start: SomeTime = 0

    def built(self) -> ServiceCalls:
        """Return the equivalent service call."""
        # without a number the label counts; the numbers of shutdown differ from state to state
        asked: Mapping[str, FieldSpec] = {"transition": {"id": 0, "label": self.to}}
        return _call(self, "change_state", "lifecycle_msgs/srv/ChangeState", asked)


class StateShape(Shape):
    """A stimulus: asks the student's lifecycle node for its state; without `node`, the only one."""

    node: Topic | None = None
    start: SomeTime = 0

    def built(self) -> ServiceCalls:
        """Return the equivalent service call."""
        return _call(self, "get_state", "lifecycle_msgs/srv/GetState", {})


def _call(
    shape: ParameterShape | TransitionShape | StateShape, service: str, kind: str, request: Mapping[str, FieldSpec]
) -> ServiceCalls:
    return ServiceCalls(f"{shape.node or '~'}/{service}", kind, (request,), start_ns=plain_value(shape.start))


#: Name and number of each type in rcl_interfaces/msg/ParameterValue; the first element decides that of a list.
_PARAMETER_FIELDS: tuple[tuple[type, str, int, int], ...] = (
    (bool, "bool", 1, 6),
    (int, "integer", 2, 7),
    (float, "double", 3, 8),
    (str, "string", 4, 9),
)


def _parameter_value(value: FieldSpec) -> Mapping[str, FieldSpec]:
    several = isinstance(value, tuple)
    first = value[0] if isinstance(value, tuple) and value else value
    for kind, name, number, list_number in _PARAMETER_FIELDS:
        if isinstance(first, kind):
            field = f"{name}_array_value" if several else f"{name}_value"
            return {"type": list_number if several else number, field: value}
    drawn_text = not isinstance(first, Between)
    return {"type": 4 if drawn_text else 3, "string_value" if drawn_text else "double_value": value}
