"""What a client wrote after each response: its calls as episodes, told apart by what the response said."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from enum import Enum
from itertools import pairwise

from grader.core.trace import LogRecord, Response, Trace
from grader.judging.output import written
from grader.judging.paths import NoSuchField, at_path, number_at, text_at
from grader.judging.printed import Output, number_in, shape_of
from grader.judging.services import calls_of
from grader.judging.values import JITTER_NS

_COMPLAINTS = ("WARN", "ERROR", "FATAL")


class Kind(str, Enum):
    """What a response said."""

    GOOD = "good"  # a number above the limit
    LOW = "low"  # a number at or below it
    FAILED = "failed"  # no success
    UNREADABLE = "unreadable"  # no number in it
    UNANSWERED = "unanswered"  # there was none


@dataclass(frozen=True, slots=True)
class Reading:
    """How responses are read.

    Attributes:
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value that says whether the number counts; empty if there is none.
        pattern: What finds the number in a text; None for its first one.
        threshold: Numbers above it are good.
    """

    field: str
    success: str
    pattern: str | None
    threshold: float


@dataclass(frozen=True, slots=True)
class Episode:
    """One call, and the time up to the next one.

    Attributes:
        place: Number of the call, from 1.
        kind: What the response said.
        number: The number in it, if there is one.
        text: The text it was read from; empty if the field is a number.
        asked_ns: When the request came.
        start_ns: When the response came, or the request if none did.
        stop_ns: When the next request came, or the recording ended.
        until_ns: The same, less the clock's jitter.
        outputs: What was written in [start_ns, stop_ns], in order; both ends widened by the clock's jitter.
        awaiting: What was written between the request and its response, in order.
    """

    place: int
    kind: Kind
    number: float | None
    text: str
    asked_ns: int
    start_ns: int
    stop_ns: int
    until_ns: int
    outputs: tuple[Output, ...]
    awaiting: tuple[Output, ...]

    @property
    def sure(self) -> tuple[Output, ...]:
        """What cannot belong to the call before or after: what came from the response on, before the next request."""
        return tuple(o for o in self.outputs if self.start_ns <= o.t_ns < self.until_ns)

    @property
    def shapes(self) -> frozenset[str]:
        """The shapes of what was written."""
        return frozenset(shape_of(o.text) for o in self.outputs)


def episodes_of(trace: Trace, process: str, service: str, reading: Reading) -> tuple[Episode, ...]:
    """Return the calls of a student's client, each with what the process wrote after it."""
    calls = calls_of(trace, service, "student")
    stops = [*(b.request.t_ns for _, b in pairwise(calls)), trace.stop_ns]
    outputs = sorted(written(trace, process), key=lambda o: o.t_ns)
    jitter_ns = JITTER_NS[trace.clock]
    found = []
    for place, (call, stop_ns) in enumerate(zip(calls, stops, strict=False), 1):
        kind, number, text = _read(call.response, reading)
        asked_ns = call.request.t_ns
        start_ns = asked_ns if call.response is None else call.response.t_ns
        until_ns = stop_ns if place == len(calls) else stop_ns - jitter_ns
        during = tuple(o for o in outputs if start_ns - jitter_ns <= o.t_ns <= stop_ns + jitter_ns)
        before = tuple(o for o in outputs if asked_ns <= o.t_ns < start_ns)
        found.append(Episode(place, kind, number, text, asked_ns, start_ns, stop_ns, until_ns, during, before))
    return tuple(found)


def complaints(outputs: Sequence[Output]) -> list[LogRecord]:
    """Return the records of severity WARN or higher."""
    return [o for o in outputs if isinstance(o, LogRecord) and o.severity in _COMPLAINTS]


def _read(response: Response | None, reading: Reading) -> tuple[Kind, float | None, str]:
    if response is None:
        return Kind.UNANSWERED, None, ""
    text = text_at(response.value, reading.field)
    number = number_in(text, reading.pattern) if text is not None else number_at(response.value, reading.field)
    if reading.success and not _succeeded(response, reading.success):
        return Kind.FAILED, number, text or ""
    if number is None or not math.isfinite(number):
        return Kind.UNREADABLE, None, text or ""
    return (Kind.GOOD if number > reading.threshold else Kind.LOW), number, text or ""


def _succeeded(response: Response, path: str) -> bool:
    try:
        return bool(at_path(response.value, path))
    except NoSuchField:
        return False


def shapes_before(trace: Trace, process: str, service: str, *, cautious: bool) -> frozenset[str]:
    """Return the shapes of what a process wrote before its first response.

    Args:
        trace: What was observed.
        process: File name of the client.
        service: Service name as on the wire.
        cautious: Whether what came at the instant of a response without delay may have come before it.
    """
    first = next((c for c in calls_of(trace, service, "student") if c.response is not None), None)
    if first is None or first.response is None:
        return frozenset()
    until_ns = first.response.t_ns + (cautious and first.response.t_ns == first.request.t_ns)
    return frozenset(shape_of(o.text) for o in written(trace, process) if o.t_ns < until_ns)
