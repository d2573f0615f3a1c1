"""What a rubric writes for the fields of planned messages: fixed values, and values drawn from the seed."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Annotated, Any

from pydantic import AfterValidator, Discriminator, Field, Strict, Tag, model_validator
from typing_extensions import Self, TypeAliasType

from grader.model.scenario import Between, Choose, FieldSpec, Written
from grader.reading.check_parameters import Shape
from grader.reading.rubric_types import Matching, Real, Text, Whole, YesNo, wrong

#: Most decimals that a text shows of a drawn number.
DECIMALS = 9


def rising(low_high: tuple[float, float]) -> tuple[float, float]:
    """Refuse two numbers that leave nothing to draw."""
    if not low_high[0] < low_high[1]:
        raise wrong("two numbers, the lower one first")
    return low_high


def _decimals(count: int) -> int:
    if not 0 <= count <= DECIMALS:
        raise wrong(f"a number of decimals from 0 to {DECIMALS}")
    return count


#: Unlike the numbers of checks, a field may be `.nan` or `.inf`: sensors send them.
FieldNumber = Annotated[float, Strict()]
FieldName = Annotated[str, Matching("[a-z][A-Za-z0-9_]*", "the name of a field such as data", "data")]
LowHigh = Annotated[tuple[Real, Real], AfterValidator(rising)]
Option = Annotated[str, Strict()] | YesNo | Whole | FieldNumber


class DrawnFieldShape(Shape):
    """A value that is drawn from the seed: a number, one of several values, or a text with a number in it."""

    between: LowHigh | None = None
    choose: tuple[Option, ...] | None = Field(default=None, min_length=1)
    text: Text | None = None
    decimals: Annotated[Whole, AfterValidator(_decimals)] = 1

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


def _kind(value: object) -> str:
    """Return the tag of what was written; tags are no names of fields, so that places stay right."""
    if isinstance(value, Mapping):
        return "<drawn>" if value.keys() & {"between", "choose"} else "<parts>"
    kinds = {list: "<list>", tuple: "<list>", str: "<text>", bool: "<bool>", int: "<whole>"}
    return kinds.get(type(value), "<number>")


if TYPE_CHECKING:
    FieldValue = Any  # an alias that holds itself is beyond the type checker; pydantic reads the one below
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


def fields_of(written: Mapping[str, Any]) -> Mapping[str, FieldSpec]:
    """Return the fields of one message as a scenario holds them."""
    return {name: field_of(value) for name, value in written.items()}


def field_of(value: Any) -> FieldSpec:
    """Return one field as a scenario holds it."""
    if isinstance(value, DrawnFieldShape):
        return _drawn(value)
    if isinstance(value, Mapping):
        return fields_of(value)
    return tuple(field_of(item) for item in value) if isinstance(value, tuple) else value


def _drawn(value: DrawnFieldShape) -> FieldSpec:
    if value.choose is not None:
        return Choose(value.choose)
    low, high = value.between or (0.0, 1.0)
    return Between(low, high) if value.text is None else Written(value.text, Between(low, high), value.decimals)
