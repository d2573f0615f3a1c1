"""The parts of a rubric that are drawn from the seed: fields, times, counts, and the order of cases."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any, Union

from pydantic import BeforeValidator, Discriminator, Field, Strict, Tag, create_model, model_validator
from typing_extensions import Self, TypeAliasType

from grader.core.scenario import AnyOrder, Between, Choose, CountBetween, InOrder, SomeOf, TimeBetween, Written
from grader.rubrics.types import (
    Duration,
    LongDuration,
    MatchingText,
    Real,
    Shape,
    Text,
    Whole,
    YesNo,
    build,
    must,
    wrong,
)

#: Maximum number of decimals with which a text shows a drawn number.
DECIMALS = 9


def _rising(low_high: tuple[float, float]) -> bool:
    return low_high[0] < low_high[1]


#: Unlike the numbers of checks, a field may be `.nan` or `.inf`: sensors send them.
FieldNumber = Annotated[float, Strict()]
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
    FieldValue = Any  # the type checker does not support recursive aliases; pydantic reads the one below
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


#: Maximum number of cases in a list, and of repetitions of one case.
CASES = 1_000


_TWO = "two of them, the lower one first"
_TWO_COUNTS = f"two whole numbers from 0 to {CASES:,}, the lower one first"


class DrawnTimeShape(Shape):
    """A time that is drawn from the seed."""

    between: Annotated[tuple[Duration, Duration], must(_rising, _TWO)]

    def built(self) -> TimeBetween:
        """Return the time as a scenario holds it."""
        return TimeBetween(*self.between)


class DrawnLongTimeShape(DrawnTimeShape):
    """A time above 0 that is drawn from the seed."""

    between: Annotated[tuple[LongDuration, LongDuration], must(_rising, _TWO)]


class DrawnCountShape(Shape):
    """A count that is drawn from the seed."""

    between: Annotated[tuple[Whole, Whole], must(lambda pair: 0 <= pair[0] < pair[1] <= CASES, _TWO_COUNTS)]

    def built(self) -> CountBetween:
        """Return the count as a scenario holds it."""
        return CountBetween(*self.between)


def drawn_or_not(value: object) -> str:
    """Return the tag of a value; tags are not names of fields, so that error places stay right."""
    return "<drawn>" if isinstance(value, Mapping) else "<fixed>"


_Count = Annotated[Whole, must(lambda n: 0 <= n <= CASES, f"a whole number from 0 to {CASES:,}")]
SomeTime = Annotated[
    Annotated[Duration, Tag("<fixed>")] | Annotated[DrawnTimeShape, Tag("<drawn>")], Discriminator(drawn_or_not)
]
SomeLongTime = Annotated[
    Annotated[LongDuration, Tag("<fixed>")] | Annotated[DrawnLongTimeShape, Tag("<drawn>")],
    Discriminator(drawn_or_not),
]
SomeCount = Annotated[
    Annotated[_Count, Tag("<fixed>")] | Annotated[DrawnCountShape, Tag("<drawn>")], Discriminator(drawn_or_not)
]


class InOrderShape(Shape):
    """Cases that follow each other as written, wherever among others they come."""

    in_order: Any

    def built(self) -> InOrder:
        """Return the cases as a scenario holds them."""
        return InOrder(build(self.in_order))


class SomeOfShape(Shape):
    """A number of cases, each one of those listed, drawn from the seed."""

    some_of: Any
    count: SomeCount

    def built(self) -> SomeOf:
        """Return the cases as a scenario holds them."""
        return SomeOf(build(self.some_of), build(self.count))


class AnyOrderShape(Shape):
    """Cases that all come, in an order drawn from the seed."""

    any_order: Any

    def built(self) -> AnyOrder:
        """Return the cases as a scenario holds them."""
        return AnyOrder(build(self.any_order))


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


def cases_model(case: Any, name: str) -> Any:
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


def _one_of(kinds: Mapping[str, Any]) -> Any:
    tagged = tuple(Annotated[kind, Tag(tag)] for tag, kind in kinds.items())
    return Annotated[Union[tagged], Discriminator(_kind_of_case), BeforeValidator(_spelt)]  # noqa: UP007


def list_of(case: Any) -> Any:
    """Return the type of a list of cases."""
    return tuple[case, ...]
