"""Makes the trace of a scenario of a recording that a student has handed in, by a contained process that reads it."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import ExitStack
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TypeAlias

from grader.grading.submissions.bag_files import bags_in
from grader.grading.submissions.bag_words import (
    LARGE,
    LONGEST_NAME,
    ODD_NAME,
    SMALLER,
    TOO_LONG,
    TOO_MANY,
    TOO_MUCH,
    UNDEFINED,
)
from grader.runtime.contained import run_contained
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.limits import MAX_TRACE_BYTES
from grader.runtime.model.quantities import KIB, MIB, duration, size
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.trace import AssessedTrace, BagContents, ClockKind, Delivery, Message
from grader.runtime.model.wording import printable
from grader.runtime.recording.bag import HINT_DAMAGED
from grader.runtime.recording.packed import trace_from_json

MODULE = "grader.grading.submissions.bag_reader"
#: Processor time of the process in seconds. A recording of 200 MB takes it some seconds, one of many small messages on
#: topics that nobody asks for up to twenty.
PROCESSOR_S = 60
#: Memory of the process in bytes: what it needs without a recording, for messages as Python values, and for the
#: answer; beyond that, twice the size of the recording, which may be packed in one piece.
MEMORY_BYTES = 1024 * MIB
#: The most lists and objects in its answer, besides one for every eight bytes of messages: a time is the smallest
#: message in others. Each takes the grader about 250 bytes, and a recording of some kilobytes may unpack to millions.
MOST_NESTED = 1_000_000
_BYTES_OF_ONE = 8
#: The most characters of what the process says of a recording that it cannot read.
_MOST_CHARACTERS = 1_000


@dataclass(frozen=True, slots=True)
class UnreadableBag:
    """Why a recording that was handed in cannot be judged, and what to do about it."""

    problem: str
    hint: str


#: Asks the process, with limits as for `confine` and the descriptors of the files; returns its answer and exit code.
TellBag: TypeAlias = Callable[[bytes, Mapping[str, int], Sequence[int]], tuple[bytes, int]]


def told_by_bag_reader(asked: bytes, limits: Mapping[str, int], files: Sequence[int]) -> tuple[bytes, int]:
    """Return what the process says of a recording, and its exit code; `bag_reader` has the formats.

    Raises:
        OSError: The process cannot be started.
        subprocess.TimeoutExpired: The machine is too busy for it.
    """
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as out:
        given.write(asked)
        given.seek(0)
        code = run_contained(MODULE, limits, given, out, installed=True, files=files)
        out.seek(0)
        return out.read(limits["output"]), code


def bag_trace(
    root: Path,
    path: str,
    scenario: Scenario,
    definitions: Mapping[str, str] | None = None,
    tell: TellBag = told_by_bag_reader,
) -> AssessedTrace | UnreadableBag:
    """Return the trace of a scenario that a recording of a staged submission holds.

    Args:
        root: The staged submission.
        path: The recording in it.
        scenario: The scenario, which asks for one.
        definitions: Definitions by the names of types that do not come with ROS 2 and that the recording may lack.
        tell: Reads the recording; whatever it says is checked.

    Raises:
        HarnessError: The recording cannot be read for a reason that has nothing to do with it.
    """
    asked = scenario.handed_in
    assert asked is not None
    files = [file.relative_to(root).as_posix() for file in root.rglob("*") if file.is_file() and not file.is_symlink()]
    bag = next(found for found in bags_in(files) if found.path == path)
    shown = bag.shown
    where, whole = printable(shown), sum((root / file).stat().st_size for file in bag.files)
    if whole > asked.size_bytes:
        found = f"{whole / MIB:,.1f} MiB" if whole >= MIB else f"{whole / KIB:,.1f} KiB"
        return UnreadableBag(f"{where}: expected at most {size(asked.size_bytes)}, found {found}", SMALLER)
    limits = {"memory": MEMORY_BYTES + 2 * asked.size_bytes, "output": MAX_TRACE_BYTES, "processor": PROCESSOR_S}
    with ExitStack() as stack:
        try:
            opened = [(Path(file).name, *_opened(root / file, stack)) for file in bag.files]
            request = json.dumps(_request(scenario, shown, opened, definitions or {})).encode()
            answer, code = tell(request, limits, [descriptor for _, descriptor, _ in opened])
        except subprocess.TimeoutExpired:
            raise HarnessError(f"{where}: the machine was too busy to read it", "try again later") from None
        except OSError as error:
            raise HarnessError(f"{where}: it cannot be read: {error.strerror}", "free some memory") from None
    return _taken_apart(answer, code, scenario, shown)


def _opened(file: Path, stack: ExitStack) -> tuple[int, int]:
    """Return the descriptor of an open file, and its size."""
    descriptor = os.open(file, os.O_RDONLY | os.O_NOFOLLOW | os.O_CLOEXEC)
    stack.callback(os.close, descriptor)
    return descriptor, os.fstat(descriptor).st_size


def _request(
    scenario: Scenario, shown: str, opened: Sequence[tuple[str, int, int]], definitions: Mapping[str, str]
) -> dict[str, object]:
    """Return what the process is asked; `bag_reader` has the format."""
    asked, limits = scenario.handed_in, scenario.limits
    assert asked is not None
    return {
        "scenario": scenario.id,
        "bag": shown,
        "files": opened,
        "topics": asked.topics,
        "given": scenario.given,
        "definitions": dict(definitions),
        "messages": limits.messages,
        "message_bytes": limits.message_bytes,
        "traffic_bytes": limits.traffic_bytes,
        "size_bytes": asked.size_bytes,
        "duration_ns": asked.duration_ns,
    }


def _taken_apart(answer: bytes, code: int, scenario: Scenario, shown: str) -> AssessedTrace | UnreadableBag:
    """Return what the process said, as far as it is one of its answers."""
    where = printable(shown)
    if answer.count(b"{") + answer.count(b"[") > MOST_NESTED + scenario.limits.traffic_bytes // _BYTES_OF_ONE:
        return UnreadableBag(f"{where}: reading it takes too much memory", SMALLER)
    try:
        said = json.loads(answer)
        if "problem" in said:
            return UnreadableBag(*(printable(str(said[key]), _MOST_CHARACTERS) for key in ("problem", "hint")))
        trace = trace_from_json(said["trace"])
        if not _is_sound(trace):
            raise ValueError("no answer of the reader")
        notes = tuple(_notes([(str(kind), str(topic)) for kind, topic in said["cut"]], scenario, where))
    except (ValueError, LookupError, TypeError, AttributeError, RecursionError, HarnessError):
        if code == -signal.SIGKILL:
            return UnreadableBag(f"{where}: reading it takes too long or too much memory", SMALLER)
        return UnreadableBag(f"{where}: expected a recording, found something else", HINT_DAMAGED)
    # Whatever the process says, it says nothing of the grader.
    return AssessedTrace(
        scenario=scenario.id,
        clock=ClockKind.WALL,
        stop_ns=trace.stop_ns,
        observations=tuple(one for one in trace.observations if isinstance(one, (Message, Delivery))),
        notes=notes,
        bag=replace(trace.bag or BagContents(""), file=shown),
    )


def _is_sound(trace: AssessedTrace) -> bool:
    """Return whether a trace is as the reader makes it: names are names, messages have fields, and times count up."""
    bag = trace.bag or BagContents("")
    names = {name for topic, type_, _ in bag.topics for name in (topic, type_)} | {topic for topic, *_ in bag.contents}
    times = [0]
    for one in trace.observations:
        if isinstance(one, (Message, Delivery)):
            names |= {one.topic, one.type}
            times.append(one.t_ns)
            if not isinstance(one.value, Mapping):
                return False
    in_order = all(before <= after for before, after in pairwise([*times, trace.stop_ns - 1]))
    return in_order and all(name.isprintable() and 0 < len(name) <= LONGEST_NAME for name in names)


def _notes(cut: Iterable[tuple[str, str]], scenario: Scenario, where: str) -> Iterator[str]:
    """Yield what readers must know of what was not read."""
    limits, asked = scenario.limits, scenario.handed_in
    assert asked is not None
    rest = "what follows is not read"
    for kind, named in cut:
        topic = printable(named, 80)
        if kind == TOO_MANY:
            yield f"{where}: more than {limits.messages:,} messages on {topic}: {rest}"
        elif kind == TOO_MUCH:
            yield f"{where}: more than {size(limits.traffic_bytes)} of messages: {rest}"
        elif kind == TOO_LONG:
            yield f"{where}: longer than {duration(asked.duration_ns)}: {rest}"
        elif kind == UNDEFINED:
            yield f"{where}: the type of {topic} has no definition in it, so only the times of its messages are read"
        elif kind == LARGE:
            most = size(limits.message_bytes)
            yield f"{where}: messages on {topic} are larger than {most}, so only their times are read"
        elif kind == ODD_NAME:
            yield f"{where}: topics whose names or types ROS does not allow are left out"
