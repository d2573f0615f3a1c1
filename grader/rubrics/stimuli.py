"""The stimuli of a rubric file: their shapes as pydantic models, and the stimuli that a scenario holds."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TYPE_CHECKING, Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag

from grader.core.quantities import NS_PER_S
from grader.core.scenario import (
    ActionGoal,
    Between,
    FieldSpec,
    JustAbove,
    JustBelow,
    MessageStream,
    NumberSpec,
    NumberStream,
    OdometryStream,
    ServiceCalls,
    ServiceServer,
    Stimulus,
)
from grader.rubrics.check_parameters import Choice, Shape
from grader.rubrics.drawing import (
    DrawnCountShape,
    Fields,
    FieldValue,
    LowHigh,
    SomeLongTime,
    SomeTime,
    cases_model,
    cases_of,
    count_of,
    drawn_or_not,
    field_of,
    fields_of,
    time_of,
)
from grader.rubrics.types import (
    ActionType,
    LongDuration,
    MessageType,
    Real,
    ServiceType,
    Text,
    Topic,
    Whole,
    YesNo,
    wrong,
)

#: Default of the keys of a choice that were not chosen; not a value that a rubric can write.
ABSENT: Any = None
#: Most clients that call at once, and most calls of each.
CLIENTS, CALLS = 20, 1_000


class DrawnShape(Choice):
    """A number that depends on the seed or on the student's message type."""

    between: LowHigh = ABSENT
    just_above: Real = ABSENT
    just_below: Real = ABSENT


def _kind_of_number(value: object) -> str:
    return "drawn" if isinstance(value, dict) else "written"


NumberShape = Annotated[
    Annotated[Real, Tag("written")] | Annotated[DrawnShape, Tag("drawn")], Discriminator(_kind_of_number)
]


def _count_to(most: int) -> AfterValidator:
    def check(count: int) -> int:
        if not 1 <= count <= most:
            raise wrong(f"a whole number from 1 to {most:,}")
        return count

    return AfterValidator(check)


def _drawn_to(most: int) -> AfterValidator:
    def check(drawn: DrawnCountShape) -> DrawnCountShape:
        if not 1 <= drawn.between[0] < drawn.between[1] <= most:
            raise wrong(f"two whole numbers from 1 to {most:,}, the lower one first")
        return drawn

    return AfterValidator(check)


Calls = Annotated[
    Annotated[Whole, _count_to(CALLS), Tag("<fixed>")] | Annotated[DrawnCountShape, _drawn_to(CALLS), Tag("<drawn>")],
    Discriminator(drawn_or_not),
]
Clients = Annotated[Whole, _count_to(CLIENTS)]


if TYPE_CHECKING:
    NumberCase = Any  # made at run time; pydantic reads those below
    FieldsCase = Any
else:
    NumberCase = cases_model(NumberShape, "Numbers")
    FieldsCase = cases_model(Fields, "Messages")


class NumbersShape(Shape):
    """A stimulus: numbers published on a topic, each held for a while."""

    topic: Topic
    type: MessageType
    values: tuple[NumberCase, ...] = Field(min_length=1)
    period: LongDuration
    hold: SomeLongTime
    start: SomeTime = 0


class OdometryShape(Shape):
    """A stimulus: the recorded odometry."""

    topic: Topic
    start: SomeTime = 0
    duration: SomeLongTime


class MessagesShape(Shape):
    """A stimulus: messages of one type, one a period; fields left out keep their defaults."""

    topic: Topic
    type: MessageType
    values: tuple[FieldsCase, ...] = Field(min_length=1)
    period: LongDuration = NS_PER_S
    start: SomeTime = 0
    repeats: Calls = 1
    stop: LongDuration | None = None
    best_effort: YesNo = False
    latched: YesNo = False


class ServerShape(Shape):
    """A stimulus: a server that answers the student's client; without responses it never answers."""

    service: Topic
    type: ServiceType
    responses: tuple[FieldsCase, ...]
    start: SomeTime = 0
    stop: LongDuration | None = None
    delay: SomeTime = 0
    cycle: YesNo = False
    answers: Calls | None = None


class CallsShape(Shape):
    """A stimulus: clients that call the student's server; a call waits for the server to be there."""

    service: Topic
    type: ServiceType
    requests: tuple[FieldsCase, ...] = Field(default=({},), min_length=1)
    calls: Calls = 1
    clients: Clients = 1
    period: LongDuration = NS_PER_S
    start: SomeTime = 0


class ParameterShape(Shape):
    """A stimulus: one parameter of the student's node is set, or asked for; without a node the only one."""

    node: Topic | None = None
    name: Text
    set: FieldValue | None = None
    start: SomeTime = 0


class TransitionShape(Shape):
    """A stimulus: the student's lifecycle node is asked for a transition; without a node the only one."""

    node: Topic | None = None
    to: Literal["configure", "activate", "deactivate", "cleanup", "shutdown"]
    start: SomeTime = 0


class StateShape(Shape):
    """A stimulus: the student's lifecycle node is asked for its state; without a node the only one."""

    node: Topic | None = None
    start: SomeTime = 0


class GoalShape(Shape):
    """A stimulus: a goal for the student's action server, which may be cancelled after a while."""

    action: Topic
    type: ActionType
    goal: Fields = Field(default={})
    start: SomeTime = 0
    cancel_after: LongDuration | None = None


class StimulusShape(Choice):
    """Something that the grader does to the student's nodes."""

    numbers: NumbersShape = ABSENT
    odometry: OdometryShape = ABSENT
    messages: MessagesShape = ABSENT
    server: ServerShape = ABSENT
    calls: CallsShape = ABSENT
    parameter: ParameterShape = ABSENT
    transition: TransitionShape = ABSENT
    state: StateShape = ABSENT
    goal: GoalShape = ABSENT


def stimulus_of(shape: StimulusShape) -> Stimulus:
    """Return the stimulus that a rubric describes."""
    kind, parameters = shape.chosen
    return _MAKERS[kind](parameters)


def _odometry(shape: OdometryShape) -> Stimulus:
    return OdometryStream(topic=shape.topic, start_ns=time_of(shape.start), duration_ns=time_of(shape.duration))


def _numbers(shape: NumbersShape) -> Stimulus:
    return NumberStream(
        topic=shape.topic,
        type=shape.type,
        values=cases_of(shape.values, _number),
        period_ns=shape.period,
        hold_ns=time_of(shape.hold),
        start_ns=time_of(shape.start),
    )


def _number(value: float | DrawnShape) -> NumberSpec:
    if not isinstance(value, DrawnShape):
        return float(value)
    kind, _ = value.chosen
    if kind == "between":
        return Between(*value.between)
    return JustAbove(value.just_above) if kind == "just_above" else JustBelow(value.just_below)


def _messages(shape: MessagesShape) -> Stimulus:
    return MessageStream(
        topic=shape.topic,
        type=shape.type,
        values=cases_of(shape.values, fields_of),
        period_ns=shape.period,
        start_ns=time_of(shape.start),
        repeats=count_of(shape.repeats),
        stop_ns=shape.stop or 0,
        best_effort=shape.best_effort,
        latched=shape.latched,
    )


def _server(shape: ServerShape) -> Stimulus:
    return ServiceServer(
        service=shape.service,
        type=shape.type,
        responses=cases_of(shape.responses, fields_of),
        start_ns=time_of(shape.start),
        stop_ns=shape.stop or 0,
        delay_ns=time_of(shape.delay),
        cycle=shape.cycle,
        answers=count_of(shape.answers or 0),
    )


def _calls(shape: CallsShape) -> Stimulus:
    return ServiceCalls(
        service=shape.service,
        type=shape.type,
        requests=cases_of(shape.requests, fields_of),
        calls=count_of(shape.calls),
        clients=shape.clients,
        period_ns=shape.period,
        start_ns=time_of(shape.start),
    )


#: What a parameter's value is called, and its number, in rcl_interfaces/msg/ParameterValue; of a list, by its first.
_PARAMETER_FIELDS: tuple[tuple[type, str, int, int], ...] = (
    (bool, "bool", 1, 6),
    (int, "integer", 2, 7),
    (float, "double", 3, 8),
    (str, "string", 4, 9),
)


def _parameter(shape: ParameterShape) -> Stimulus:
    node = shape.node or "~"
    if "set" not in shape.model_fields_set or shape.set is None:
        asked: Mapping[str, FieldSpec] = {"names": (shape.name,)}
        kind = "rcl_interfaces/srv/GetParameters"
        return ServiceCalls(f"{node}/get_parameters", kind, (asked,), start_ns=time_of(shape.start))
    wanted: Mapping[str, FieldSpec] = {"name": shape.name, "value": _parameter_value(field_of(shape.set))}
    kind = "rcl_interfaces/srv/SetParameters"
    return ServiceCalls(f"{node}/set_parameters", kind, ({"parameters": (wanted,)},), start_ns=time_of(shape.start))


def _parameter_value(value: Any) -> Mapping[str, FieldSpec]:
    several = isinstance(value, tuple)
    first = value[0] if several and value else value
    for kind, name, number, list_number in _PARAMETER_FIELDS:
        if isinstance(first, kind):
            field = f"{name}_array_value" if several else f"{name}_value"
            return {"type": list_number if several else number, field: value}
    drawn_text = not isinstance(first, Between)
    return {"type": 4 if drawn_text else 3, "string_value" if drawn_text else "double_value": value}


def _transition(shape: TransitionShape) -> Stimulus:
    # without a number the label counts; the numbers of shutdown differ from state to state
    asked: Mapping[str, FieldSpec] = {"transition": {"id": 0, "label": shape.to}}
    kind = "lifecycle_msgs/srv/ChangeState"
    return ServiceCalls(f"{shape.node or '~'}/change_state", kind, (asked,), start_ns=time_of(shape.start))


def _state(shape: StateShape) -> Stimulus:
    return ServiceCalls(
        f"{shape.node or '~'}/get_state", "lifecycle_msgs/srv/GetState", ({},), start_ns=time_of(shape.start)
    )


def _goal(shape: GoalShape) -> Stimulus:
    goal = fields_of(shape.goal)
    return ActionGoal(
        shape.action, shape.type, goal, start_ns=time_of(shape.start), cancel_after_ns=shape.cancel_after or 0
    )


_MAKERS: Mapping[str, Callable[[Any], Stimulus]] = {
    "numbers": _numbers,
    "odometry": _odometry,
    "messages": _messages,
    "server": _server,
    "calls": _calls,
    "parameter": _parameter,
    "transition": _transition,
    "state": _state,
    "goal": _goal,
}
