"""The shape of a rubric file as pydantic models."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, create_model

from grader.model.quantities import NS_PER_S
from grader.reading.check_parameters import Choice, Shape, choice_model
from grader.reading.rubric_limits import LimitsShape
from grader.reading.rubric_types import (
    Duration,
    Id,
    LongDuration,
    MessageType,
    Number,
    Points,
    PythonFile,
    Real,
    Text,
    Topic,
    YesNo,
    wrong,
)

#: Default of the keys of a choice that were not chosen; not a value that a rubric can write.
ABSENT: Any = None


class ExerciseShape(Shape):
    """What the exercise is called."""

    id: Id
    number: Number
    title: Text
    required: YesNo = True
    by_request: YesNo = False


class ObserveShape(Shape):
    """How long a scenario is observed."""

    duration: LongDuration
    after_first_message_on: Topic | None = None
    wait_at_most: LongDuration = 60 * NS_PER_S


def _between(low_high: tuple[float, float]) -> tuple[float, float]:
    if not low_high[0] < low_high[1]:
        raise wrong("two numbers, the lower one first")
    return low_high


class DrawnShape(Choice):
    """A number that depends on the seed or on the student's message type."""

    between: Annotated[tuple[Real, Real], AfterValidator(_between)] = ABSENT
    just_above: Real = ABSENT
    just_below: Real = ABSENT


def _kind_of_number(value: object) -> str:
    return "drawn" if isinstance(value, dict) else "written"


NumberShape = Annotated[
    Annotated[Real, Tag("written")] | Annotated[DrawnShape, Tag("drawn")], Discriminator(_kind_of_number)
]


class NumbersShape(Shape):
    """A stimulus: numbers published on a topic, each held for a while."""

    topic: Topic
    type: MessageType
    values: tuple[NumberShape, ...] = Field(min_length=1)
    period: LongDuration
    hold: LongDuration
    start: Duration = 0


class OdometryShape(Shape):
    """A stimulus: the recorded odometry."""

    topic: Topic
    start: Duration = 0
    duration: LongDuration


class StimulusShape(Choice):
    """Something that the grader publishes."""

    numbers: NumbersShape = ABSENT
    odometry: OdometryShape = ABSENT


class ScenarioShape(Shape):
    """One situation that is recorded once."""

    id: Id
    processes: tuple[PythonFile, ...] = Field(min_length=1)
    observe: ObserveShape
    stimuli: tuple[StimulusShape, ...] = ()


class CriterionShape(Shape):
    """One row of a rubric; the model for a table of checks narrows `check`."""

    id: Id
    title: Text
    points: Points
    scenario: Id
    check: Choice
    needs: tuple[Id, ...] = ()
    hint: Text | None = None
    chapter: Text | None = None


class RubricShape(Shape):
    """A whole rubric file."""

    format: Literal["grader/rubric/v1"] = Field(alias="schema")
    exercise: ExerciseShape
    files: tuple[PythonFile, ...] = Field(min_length=1)
    limits: LimitsShape = Field(default_factory=LimitsShape)
    scenarios: tuple[ScenarioShape, ...] = Field(min_length=1)
    criteria: tuple[CriterionShape, ...] = Field(min_length=1)


@lru_cache(maxsize=8)
def rubric_model(checks: tuple[tuple[str, type], ...]) -> type[RubricShape]:
    """Return the model of a rubric file whose criteria use these checks.

    Args:
        checks: Pairs of a check's name and its frozen dataclass, in the order that messages list them.
    """
    check = choice_model("Check", "The question asked of the trace, by the check's name.", dict(checks))
    criterion: Any = create_model(
        "Criterion", __base__=CriterionShape, __doc__="One row of a rubric.", check=(check, ...)
    )
    criteria = (tuple[criterion, ...], Field(min_length=1))
    return create_model("Rubric", __base__=RubricShape, __doc__="A rubric of rclpy-grader.", criteria=criteria)
