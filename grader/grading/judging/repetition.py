"""Compares two recordings of the same plan event by event, and names the first difference and its kind; pure."""

from __future__ import annotations

import ast
import re
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from itertools import zip_longest

from grader.grading.judging.source import Source, argument, literal_text, read_source
from grader.grading.model.exercise import Location
from grader.grading.model.verification import Cause, Difference, DifferenceKind, RecordingFact
from grader.runtime.model.trace import AssessedTrace, Fault, GraphSnapshot, LogRecord, Observation, OutputLine

#: What can be compared by `==` and hashed.
_Key = tuple[object, ...]
#: How Python shows the address of an object.
_ADDRESS = re.compile(r"0x[0-9a-f]{6,}")
#: Longest text of a fact, in characters.
_MOST_CHARACTERS = 300
_PROCESSOR_TIME = (
    "process_time",
    "process_time_ns",
    "thread_time",
    "thread_time_ns",
    "getrusage",
    "times",
)
_FILE_TIME = ("getmtime", "getctime", "getatime", "stat", "lstat", "fstat")
#: Calls of functions that ask the kernel past the virtual clock, and folders whose files do.
_PAST_THE_CLOCK = ("CDLL", "clock_gettime", "clock_gettime_ns", *_FILE_TIME)
_KERNEL_FILES = ("/proc/", "/sys/", "/dev/urandom", "/dev/random")


def is_comparable(trace: AssessedTrace) -> bool:
    """Return whether a recording should repeat: it is one in virtual time, which suits its programs."""
    return not trace.clock_reason


def events(trace: AssessedTrace) -> tuple[Observation, ...]:
    """Return what the programs did, in order: everything but the ROS graph, which is what the grader saw of it."""
    return tuple(o for o in trace.observations if not isinstance(o, GraphSnapshot))


def first_difference(first: AssessedTrace, other: AssessedTrace, sources: Mapping[str, str]) -> Difference | None:
    """Return the first difference between two recordings of a plan; None if they are the same.

    What the programs did comes before what only the grader saw. Two recordings of which neither is comparable have no
    difference.

    Args:
        first: The recording to compare with.
        other: The recording under another condition.
        sources: Wanted file name -> its text, to find lines and causes.
    """
    if is_comparable(first) != is_comparable(other):
        return Difference(
            DifferenceKind.CLOCK, 0, RecordingFact("clock", _clock(first)), RecordingFact("clock", _clock(other))
        )
    if not is_comparable(first):
        return None
    found = _first_event(events(first), events(other), sources)
    if found is not None:
        return found
    for kind, name, value in _FACTS:
        if value(first) != value(other):
            sides = RecordingFact(name, _shortened(value(first))), RecordingFact(name, _shortened(value(other)))
            return Difference(kind, 0, sides[0], sides[1])
    return _first_snapshot(first.graphs(), other.graphs())


#: What belongs to a recording besides its events. Notes tell what the grader met with, and suspicions only what it saw;
#: files that a program wrote are lost if it does not report them in time when it is told to stop.
_FACTS: tuple[tuple[DifferenceKind, str, Callable[[AssessedTrace], object]], ...] = (
    (DifferenceKind.TIME, "end", lambda trace: trace.stop_ns),
    (DifferenceKind.CONTENT, "starts", lambda trace: trace.starts),
    (DifferenceKind.CONTENT, "left out", lambda trace: trace.left_out),
    (DifferenceKind.CONTENT, "not started", lambda trace: trace.unstarted),
    (DifferenceKind.CONTENT, "newer Python", lambda trace: trace.newer),
    (DifferenceKind.CONTENT, "result of the test", lambda trace: trace.tested),
    (DifferenceKind.CONTENT, "pictures of simulations", lambda trace: trace.drawn),
    (DifferenceKind.GRADER, "written files", lambda trace: trace.written),
    (DifferenceKind.GRADER, "notes", lambda trace: trace.notes),
    (DifferenceKind.GRADER, "suspicious actions", lambda trace: trace.reached),
)


def _clock(trace: AssessedTrace) -> str:
    return f"the wall clock: {trace.clock_reason}" if trace.clock_reason else "virtual time"


def _shortened(value: object) -> str:
    text = repr(value)
    return text if len(text) <= _MOST_CHARACTERS else f"{text[:_MOST_CHARACTERS]}..."


def _first_event(
    first: Sequence[Observation], other: Sequence[Observation], sources: Mapping[str, str]
) -> Difference | None:
    for index, (one, two) in enumerate(zip_longest(first, other)):
        if _key(one) != _key(two):
            kind = _kind(first, other, index)
            trees = {name: read_source(name, text) for name, text in sources.items()}
            process, place = _place(one or two, trees)
            cause = _cause(one, two, trees.get(process))
            return Difference(kind, index + 1, one, two, process, place.file, place.line, cause)
    return None


def _first_snapshot(first: Sequence[GraphSnapshot], other: Sequence[GraphSnapshot]) -> Difference | None:
    for index, (one, two) in enumerate(zip_longest(first, other)):
        if one != two:
            return Difference(DifferenceKind.GRADER, index + 1, one, two)
    return None


def _key(observation: Observation | None) -> _Key:
    """Return all that is compared of an event: its bytes instead of its fields, where they are known."""
    return () if observation is None else (observation.t_ns, *_what(observation))


def _what(observation: Observation) -> _Key:
    """Return what is compared of an event besides its time."""
    fields: dict[str, object] = {name: getattr(observation, name) for name in type(observation).__dataclass_fields__}
    del fields["t_ns"]
    value = fields.pop("value", None)
    # NaN differs from itself, and its text does not.
    told = () if value is None or fields["cdr"] else (repr(value),)
    return (type(observation).__name__, *fields.values(), *told)


def _kind(first: Sequence[Observation], other: Sequence[Observation], index: int) -> DifferenceKind:
    """Return the kind of the first difference, which is at an index."""
    rest, others = first[index:], other[index:]
    if not rest or not others:
        return DifferenceKind.CONTENT
    if _what(rest[0]) == _what(others[0]):
        return DifferenceKind.TIME
    at_once = [Counter(map(_key, _at_instant(side))) for side in (rest, others)]
    swapped = _key(rest[0]) in at_once[1] and _key(others[0]) in at_once[0]
    return (
        DifferenceKind.ORDER
        if swapped or Counter(map(_what, rest)) == Counter(map(_what, others))
        else DifferenceKind.CONTENT
    )


def _at_instant(rest: Sequence[Observation]) -> Iterator[Observation]:
    """Yield the events at the instant of the first one."""
    for event in rest:
        if event.t_ns != rest[0].t_ns:
            return
        yield event


def _place(event: Observation | None, sources: Mapping[str, Source]) -> tuple[str, Location]:
    """Return the process that an event is of, and the place in its file; empty if they are not known."""
    process = getattr(event, "process", "")
    if isinstance(event, (LogRecord, Fault)):
        return process, Location(event.file, event.line)
    topic = getattr(event, "topic", "")
    created = [(name, call, source) for name, source in sources.items() for call in _publishers(source, topic)]
    if topic and len(created) == 1:
        name, call, source = created[0]
        published = list(source.calls("publish"))
        return name, source.place(published[0] if len(published) == 1 else call)
    return process, Location("", 0)


def _publishers(source: Source, topic: str) -> Iterator[ast.Call]:
    for call in source.calls("create_publisher"):
        named = literal_text(argument(call, 1, "topic"))
        if named is not None and topic.endswith(f"/{named.lstrip('/')}"):
            yield call


def _cause(one: Observation | None, two: Observation | None, source: Source | None) -> Cause:
    """Return what the text of a program suggests as the cause."""
    if isinstance(one, (LogRecord, OutputLine)) and isinstance(two, type(one)):
        masked = [_ADDRESS.sub("", record.text) for record in (one, two)]
        if one.text != two.text and masked[0] == masked[1]:
            return Cause.ADDRESS
    if source is None:
        return Cause.UNKNOWN
    if any(isinstance(call.func, ast.Name) for call in source.calls("id", "hash")):
        return Cause.ADDRESS
    if any(source.calls(*_PROCESSOR_TIME)):
        return Cause.PROCESSOR_TIME
    texts = (literal_text(node) or "" for node in source.all(ast.Constant))
    if any(source.calls(*_PAST_THE_CLOCK)) or any(word in text for text in texts for word in _KERNEL_FILES):
        return Cause.KERNEL
    return Cause.UNKNOWN
