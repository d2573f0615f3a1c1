"""Shapes of the stimuli in a rubric file, including those that a scenario holds as service calls."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag

from grader.core.scenario import Between, FieldSpec, JustAbove, JustBelow, ServiceCalls
from grader.rubrics.drawing import (
    DrawnCountShape,
    Fields,
    FieldValue,
    LowHigh,
    SomeTime,
    cases_model,
    drawn_or_not,
    list_of,
)
from grader.rubrics.types import Choice, LongDuration, Real, Shape, Text, Topic, Whole, build, must

#: Default of keys that were not chosen in a choice; not a value that a rubric can contain.
ABSENT: Any = None
#: Maximum number of concurrent clients, and of calls of each.
CLIENTS, CALLS = 20, 1_000


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


NumberShape = Annotated[
    Annotated[Real, Tag("<fixed>")] | Annotated[DrawnShape, Tag("<drawn>")], Discriminator(drawn_or_not)
]


def _count_to(most: int) -> AfterValidator:
    return must(lambda count: 1 <= count <= most, f"a whole number from 1 to {most:,}")


_DRAWN_CALLS = must(
    lambda drawn: 1 <= drawn.between[0] < drawn.between[1] <= CALLS,
    f"two whole numbers from 1 to {CALLS:,}, the lower one first",
)
Calls = Annotated[
    Annotated[Whole, _count_to(CALLS), Tag("<fixed>")] | Annotated[DrawnCountShape, _DRAWN_CALLS, Tag("<drawn>")],
    Discriminator(drawn_or_not),
]
Clients = Annotated[Whole, _count_to(CLIENTS)]
_NEVER = AfterValidator(lambda value: value or 0)
TimeOrNever = Annotated[LongDuration | None, _NEVER]
CallsOrNever = Annotated[Calls | None, _NEVER]
NumberCases: Any = Annotated[list_of(cases_model(NumberShape, "Numbers")), Field(min_length=1)]
MessageCasesOrNone: Any = list_of(cases_model(Fields, "Messages"))
MessageCases: Any = Annotated[MessageCasesOrNone, Field(min_length=1)]


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
        wanted: Mapping[str, FieldSpec] = {"name": self.name, "value": _parameter_value(build(self.set))}
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
    return ServiceCalls(f"{shape.node or '~'}/{service}", kind, (request,), start_ns=build(shape.start))


#: Name and number of each type in rcl_interfaces/msg/ParameterValue; the first element decides that of a list.
_PARAMETER_FIELDS: tuple[tuple[type, str, int, int], ...] = (
    (bool, "bool", 1, 6),
    (int, "integer", 2, 7),
    (float, "double", 3, 8),
    (str, "string", 4, 9),
)


def _parameter_value(value: Any) -> Mapping[str, FieldSpec]:
    several = isinstance(value, tuple)
    first = value[0] if several and value else value
    for kind, name, number, list_number in _PARAMETER_FIELDS:
        if isinstance(first, kind):
            field = f"{name}_array_value" if several else f"{name}_value"
            return {"type": list_number if several else number, field: value}
    drawn_text = not isinstance(first, Between)
    return {"type": 4 if drawn_text else 3, "string_value" if drawn_text else "double_value": value}
