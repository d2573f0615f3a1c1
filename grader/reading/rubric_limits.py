"""The `limits` of a rubric file: their shape as a pydantic model, and the limits they come to."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from pydantic import Field, GetCoreSchemaHandler, GetJsonSchemaHandler
from pydantic_core import CoreSchema, core_schema

from grader.model.limits import Limits
from grader.model.quantities import KIB, MIB, NS_PER_S, Unit
from grader.reading.check_parameters import Shape
from grader.reading.rubric_types import LongDuration, Size, Whole, wrong
from grader.reading.units import format_quantity

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
