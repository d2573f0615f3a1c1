"""The shape of a rubric file as pydantic models."""

from __future__ import annotations

from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field, create_model

from grader.model.quantities import NS_PER_S
from grader.reading.check_parameters import Choice, Shape, choice_model
from grader.reading.feedback import FeedbackField
from grader.reading.rubric_drawing import SomeLongTime
from grader.reading.rubric_limits import LimitsShape
from grader.reading.rubric_stimuli import StimulusShape
from grader.reading.rubric_types import (
    CheckFile,
    Id,
    LongDuration,
    Number,
    Points,
    PythonFile,
    Text,
    Topic,
    YesNo,
)
from grader.reading.variants import VariantsField


class ExerciseShape(Shape):
    """What the exercise is called."""

    id: Id
    number: Number
    title: Text
    required: YesNo = True
    by_request: YesNo = False


class ObserveShape(Shape):
    """How long a scenario is observed."""

    duration: SomeLongTime
    after_first_message_on: Topic | None = None
    wait_at_most: LongDuration = 60 * NS_PER_S


class ScenarioShape(Shape):
    """One situation that is recorded once."""

    id: Id
    processes: tuple[PythonFile, ...] = Field(min_length=1)
    observe: ObserveShape
    stimuli: tuple[StimulusShape, ...] = ()
    start: dict[PythonFile, SomeLongTime] = Field(default={}, description="processes that start late")
    may_exit: Annotated[tuple[PythonFile, ...], Field(description="processes that are free to end by themselves")] = ()
    shutdown: Annotated[
        LongDuration | None, Field(description="how long they may take to end after Ctrl-C, which comes at the end")
    ] = None


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
    feedback: FeedbackField | None = None


class RubricShape(Shape):
    """A whole rubric file."""

    format: Literal["grader/rubric/v1"] = Field(alias="schema")
    exercise: ExerciseShape
    files: tuple[PythonFile, ...] = Field(min_length=1)
    checks: tuple[CheckFile, ...] = Field(default=(), description="files of checks of one's own, beside the rubric")
    limits: LimitsShape = Field(default_factory=LimitsShape)
    feedback: FeedbackField | None = None
    variants: VariantsField = Field(default_factory=dict)
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
