"""Summarises what the nodes of a trace did, without judging it."""

from __future__ import annotations

import itertools
import math
import re
import statistics
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import TypeVar

from grader.grading.judging.diagnosis import hint_for, placed_in
from grader.grading.judging.diagnosis.silence import taken_from_executor
from grader.grading.judging.installation import EXTRAS, INTERFACES, lacking_package
from grader.grading.judging.judge_run import notes_on_unheard, same_names, unserved, unusual_starts
from grader.grading.judging.simulations import unheard_by_simulations
from grader.grading.judging.source import read_source
from grader.grading.judging.values import as_number, published, student_endpoints
from grader.grading.model.report import Pace, Summary, TopicSummary
from grader.runtime.model.extras import pip_install
from grader.runtime.model.quantities import NS_PER_S, seconds
from grader.runtime.model.trace import AssessedTrace, Fault, FaultKind, LogRecord, Message, Offer, Trace

#: The different values of a text field that a summary names, and the elements of an array that it looks at: enough for
#: a laser scan, and quick for an image.
MOST_TEXTS, MOST_ELEMENTS = 100, 2_000
#: What rclpy logs of an action's execute callback that raises, whose traceback it prints, or sets no state of the goal.
_RAISED, _NO_STATE = "Error raised in execute callback: ", "Goal state not set, assuming aborted."
#: So many of them are looked at, each among all that its program has written.
MOST_CAUGHT = 20
_TRACEBACK = "Traceback (most recent call last):"
_FRAME = re.compile(r'\s+File "([^"]+)", line (\d+), in (\S+)')


def summarise(
    trace: AssessedTrace,
    processes: Sequence[str],
    isolation: str,
    sources: Mapping[str, str] = MappingProxyType({}),
    served: Iterable[str] = (),
) -> Summary:
    """Return a summary of what the nodes of a trace did.

    Args:
        trace: The recording.
        processes: The names of the programs.
        isolation: The sandbox tier.
        sources: The text of files by path, for hints: those that the programs are, and those that faults name.
        served: The services that simulations offer.
    """
    graphs = trace.graphs()
    caught = _caught(trace)
    faults = (*trace.faults(), *caught)
    seen = (
        *unusual_starts(trace),
        *same_names(trace),
        *notes_on_unheard(trace),
        *unserved(trace, served),
        *_stateless(trace),
        *unheard_by_simulations(trace),
        *_taken(trace, sources),
    )
    notes = (*seen, *trace.notes, *(one.sentence for one in trace.newer))
    names = {e.topic for g in graphs for e in g.endpoints}
    return Summary(
        processes=tuple(processes),
        clock=trace.clock,
        clock_reason=trace.clock_reason,
        duration_s=seconds(trace.stop_ns),
        nodes=tuple(sorted({node for g in graphs for node in g.nodes})),
        topics=tuple(_topic(trace, name) for name in sorted(names)),
        offers=tuple(o for o in trace.observations if isinstance(o, Offer)),
        records=trace.records(),
        lines=trace.lines(),
        faults=faults,
        notes=tuple(dict.fromkeys(placed_in(notes, sources))),
        starts=trace.starts,
        hints=tuple(_hint(fault, trace, sources) for fault in faults),
        # of those of equal size the last, whose parts have all been matched
        graph=max(reversed(graphs), key=lambda g: len(g.endpoints) + len(g.services) + len(g.nodes), default=None),
        isolation=isolation,
    )


def _caught(trace: Trace) -> tuple[Fault, ...]:
    """Return the exceptions of actions' execute callbacks, which end no program: rclpy logs and prints them."""
    found: dict[tuple[str, str, str, int], Fault] = {}
    raised = (record for record in trace.records() if _is_of_action(record, _RAISED))
    for record in itertools.islice(raised, MOST_CAUGHT):
        printed = [o.text for o in trace.lines() if o.process == record.process and o.stream == "stderr"]
        said = record.text.removeprefix(_RAISED).split("\n")[0]
        for place in (n for n, text in enumerate(printed) if text == _TRACEBACK):
            block = list(itertools.takewhile(lambda text: text.startswith(" "), printed[place + 1 :]))
            last = next(iter(printed[place + 1 + len(block) :]), "")
            frames = [match for text in block if (match := _FRAME.match(text)) and not match[1].startswith("/")]
            if not last.endswith(said) or not frames:
                continue
            file, line = frames[-1][1], int(frames[-1][2])
            chain = tuple(f"{match[1]}:{match[2]} in {match[3]}" for match in frames)
            fault = Fault(record.t_ns, record.process, FaultKind.EXCEPTION, last, file, line, chain)
            found.setdefault((record.process, last, file, line), fault)
            break
    return tuple(found.values())


def _stateless(trace: Trace) -> Iterator[str]:
    """Yield a note for each program whose action ends goals without a state, where no exception is the cause."""
    ends: dict[str, list[bool]] = {}
    for record in trace.records():
        if _is_of_action(record, _NO_STATE) or _is_of_action(record, _RAISED):
            ends.setdefault(record.process, []).append(record.text.startswith(_NO_STATE))
    for process, kinds in ends.items():
        # each exception is followed by a goal without a state
        if kinds.count(True) > kinds.count(False):
            yield f"{process}: an action ends without goal_handle.succeed(), so its goal counts as aborted"


def _taken(trace: Trace, sources: Mapping[str, str]) -> Iterator[str]:
    """Yield a note for each node that is taken from its executor, where a topic is without messages."""
    if all(published(trace, end.topic) for end in student_endpoints(trace, "publisher")):
        return
    for file, text in sources.items():
        clue = taken_from_executor(read_source(file, text))
        if clue is not None and clue.location is not None:
            yield f"{file}:{clue.location.line}: {clue.hint}"


def _is_of_action(record: LogRecord, text: str) -> bool:
    return record.logger.endswith(".action_server") and record.text.startswith(text)


def _hint(fault: Fault, trace: Trace, sources: Mapping[str, str]) -> str:
    """Return what to do about a fault. A program that ends with code 0 is done: nothing has to be done about it."""
    if fault.exit_code == 0:
        return ""
    started_as = next((start.file for start in trace.starts if start.process == fault.process), fault.process)
    text = sources.get(fault.file or started_as, "")
    lack = lacking_package(replace(trace, observations=(fault,)), [fault.process], {fault.process: text})
    missing = fault.said(r"^RuntimeError: Required launch argument '(\w{1,80})' was not provided")
    if missing is not None:
        return f"give it a value: --launch-argument {missing[1]}:=VALUE"
    if lack is None:
        return hint_for(fault, trace, text)
    if lack.name in EXTRAS:
        return f"{lack.name} is not installed here: {pip_install(EXTRAS[lack.name])} brings it"
    if lack.name.endswith(INTERFACES):
        return f"{lack.name} is not installed here: give the folder with its definitions as --interfaces"
    kind = "part" if "." in lack.name else "package"
    return f"{lack.name} is a {kind} of ROS 2 that is not installed here: the program may be right where it is"


def _topic(trace: Trace, name: str) -> TopicSummary:
    messages = trace.messages(name)
    contents = _Contents()
    for message in messages:
        contents.add(message.value)
    publishers, subscriptions = trace.endpoints("publisher", name), trace.endpoints("subscription", name)
    return TopicSummary(
        name=name,
        types=tuple(dict.fromkeys(e.type for e in (*publishers, *subscriptions))),
        publishers=publishers,
        subscriptions=subscriptions,
        messages=len(messages),
        first_s=seconds(messages[0].t_ns) if messages else None,
        pace=_pace(messages),
        ranges=contents.ranges,
        texts={path: (tuple(itertools.islice(seen, MOST_TEXTS)), len(seen)) for path, seen in contents.texts.items()},
        lengths=contents.lengths,
        flags={path: tuple(seen) for path, seen in contents.flags.items()},
    )


def _pace(messages: Sequence[Message]) -> Pace | None:
    times = [m.t_ns for m in messages]
    if len(times) < 2 or times[-1] == times[0]:
        return None
    gaps = [(later - earlier) / NS_PER_S for earlier, later in itertools.pairwise(times)]
    # n - 1 gaps, not n: counting messages overstates a short window
    return Pace(len(gaps) * NS_PER_S / (times[-1] - times[0]), min(gaps), max(gaps), statistics.pstdev(gaps))


class _Contents:
    """What the fields of a topic's messages held."""

    def __init__(self) -> None:
        self.ranges: dict[str, tuple[float, float]] = {}
        self.texts: dict[str, dict[str, None]] = {}
        self.lengths: dict[str, tuple[int, int]] = {}
        self.flags: dict[str, dict[bool, None]] = {}

    def add(self, value: Mapping[str, object], prefix: str = "") -> None:
        """Take the fields of one message, or of a part of it."""
        for name, inner in value.items():
            self._add(f"{prefix}{name}", inner)

    def _add(self, path: str, inner: object) -> None:
        if isinstance(inner, Mapping):
            self.add(inner, f"{path}.")
        elif isinstance(inner, (list, tuple)):
            self.lengths[path] = _wider(self.lengths.get(path), len(inner))
            for element in inner[:MOST_ELEMENTS]:
                self._add(f"{path}[]", element)
        elif isinstance(inner, bool):
            self.flags.setdefault(path, {})[inner] = None
        elif isinstance(inner, str):
            self.texts.setdefault(path, {})[inner] = None
        elif (number := as_number(inner)) is not None and math.isfinite(number):
            self.ranges[path] = _wider(self.ranges.get(path), number)


Ordered = TypeVar("Ordered", int, float)


def _wider(known: tuple[Ordered, Ordered] | None, value: Ordered) -> tuple[Ordered, Ordered]:
    """Return the least and the greatest value, with one more."""
    return (value, value) if known is None else (min(known[0], value), max(known[1], value))
