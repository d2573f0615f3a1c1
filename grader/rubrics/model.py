"""The shape of a rubric file as pydantic models."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Annotated, Any, Literal

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler, create_model
from pydantic_core import CoreSchema, core_schema

from grader.core.limits import Limits
from grader.core.quantities import KIB, MIB, NS_PER_S, Unit
from grader.rubrics.check_parameters import Choice, Shape, choice_model
from grader.rubrics.drawing import SomeLongTime
from grader.rubrics.feedback import FeedbackField
from grader.rubrics.stimuli import StimulusShape
from grader.rubrics.types import (
    CheckFile,
    Id,
    LongDuration,
    Number,
    Points,
    PythonFile,
    Size,
    Text,
    Topic,
    Whole,
    YesNo,
    wrong,
)
from grader.rubrics.units import format_quantity
from grader.rubrics.variants import VariantsField

#: The limits where a rubric sets no others.
USUAL = Limits()


@dataclass(frozen=True, slots=True)
class Least:
    """Marks a limit with the least that it may be: below, a node that does nothing would reach it."""

    value: int
    unit: Unit | None = None

    def __get_pydantic_core_schema__(self, source: object, handler: GetCoreSchemaHandler) -> CoreSchema:
        """Check the number after its type and unit."""
        return core_schema.no_info_after_validator_function(self._check, handler(source))

    def __get_pydantic_json_schema__(self, schema: CoreSchema, handler: GetJsonSchemaHandler) -> dict[str, Any]:
        """Describe the least to editors, which cannot compare quantities."""
        described = dict(handler(schema))
        return described if self.unit else {**described, "minimum": self.value}

    def _check(self, value: int) -> int:
        if value < self.value:
            least = format_quantity(self.value, self.unit) if self.unit else f"{self.value}"
            raise wrong(f"at least {least}, which a node that does nothing needs")
        return value


def _says(words: str) -> Any:
    return Field(description=words)


class LimitsShape(Shape):
    """What each student process may use with everything it starts, and how much of what it does is looked at."""

    memory: Annotated[Size, Least(128 * MIB, Unit("B")), _says("memory filled, as in 512 MiB")] = USUAL.memory_bytes
    processor_time: Annotated[LongDuration, Least(10 * NS_PER_S, Unit("s")), _says("of all threads together")] = (
        USUAL.processor_ns
    )
    processes: Annotated[Whole, Least(32), _says("processes and threads")] = USUAL.processes
    output: Annotated[Size, Least(KIB, Unit("B")), _says("kept of each output stream")] = USUAL.output_bytes
    lines: Annotated[Whole, Least(1), _says("log records and lines that are kept")] = USUAL.lines
    open_files: Annotated[Whole, Least(64), _says("descriptors of one process")] = USUAL.open_files
    file_size: Annotated[Size, Least(KIB, Unit("B")), _says("of one file")] = USUAL.file_bytes
    scratch: Annotated[Size, Least(MIB, Unit("B")), _says("of all files in a folder")] = USUAL.scratch_bytes
    real_time: Annotated[LongDuration, Least(10 * NS_PER_S, Unit("s")), _says("of one scenario, on either clock")] = (
        USUAL.wall_ns
    )
    messages: Annotated[Whole, Least(1), _says("on one topic")] = USUAL.messages
    message_size: Annotated[Size, Least(64, Unit("B")), _says("of a message that is read")] = USUAL.message_bytes
    traffic: Annotated[Size, Least(KIB, Unit("B")), _says("of all messages that are kept")] = USUAL.traffic_bytes
    participants: Annotated[Whole, Least(1), _says("DDS participants of the scenario")] = USUAL.participants


def limits_of(shape: LimitsShape) -> Limits:
    """Return the limits that a rubric sets, with the usual ones for what it does not name."""
    return Limits(
        memory_bytes=shape.memory,
        processor_ns=shape.processor_time,
        processes=shape.processes,
        output_bytes=shape.output,
        lines=shape.lines,
        open_files=shape.open_files,
        file_bytes=shape.file_size,
        scratch_bytes=shape.scratch,
        wall_ns=shape.real_time,
        messages=shape.messages,
        message_bytes=shape.message_size,
        traffic_bytes=shape.traffic,
        participants=shape.participants,
    )


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
