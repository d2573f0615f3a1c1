"""Compares what two recordings of a plan hold besides what checks judge, in virtual time and on the wall clock; pure.

Values, rates and texts that a rubric asks for are judged by its checks: see `grader.grading.judging.beginnings`. What
is
compared here is whatever the programs do, whether a criterion asks for it or not.
The recording on the wall clock is shorter, misses messages sent before discovery, and comes from a shared machine.
Differences that this, chance or the time of day can explain are ignored: rates and counts have wide bands, varying
numbers are not compared, and events near an edge of the window are left out.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from enum import Enum
from itertools import pairwise

from grader.grading.judging.findings import faults_before_stop
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, NS_PER_S, seconds, within
from grader.runtime.model.trace import ClockKind, Delivery, Fault, GraphSnapshot, Message, Request, Response, Trace

#: Rates and counts agree within this share, plus the absolute number below.
SHARE, COUNT = 0.3, 4
#: Fewer messages or records than this are not compared.
FEW = 4
#: Events closer to an edge of the window than this may fall on its other side.
EDGE_NS = 2 * NS_PER_S
#: Constant numbers agree within this share of them, plus the absolute difference below.
NUMBER_SHARE, NUMBER_SLACK = 0.3, 0.01
#: Share of messages that may differ from all others: a program's first or last message.
ODD_SHARE = 0.2
#: How long a value must be held before the program's answer is compared, and how long before the next value.
HELD_NS, BEFORE_NEXT_NS = NS_PER_S, 50 * NS_PER_MS
#: Values whose ends differ by at most this are the same one.
SAME_NS = 300 * NS_PER_MS
#: More distinct numbers than this are not a decision.
DECISIONS = 3
#: Fields with these names hold the time.
CLOCK_FIELDS = frozenset({"stamp", "sec", "nanosec", "time", "duration"})
#: Maximum number of fields of a message that are compared.
FIELDS = 64


class Aspect(str, Enum):
    """The aspect in which two recordings differ."""

    CRITERION = "criterion"
    SILENT = "silent"
    RATE = "rate"
    VALUE = "value"
    CONSTANT = "constant"
    ANSWER = "answer"
    LOGS = "logs"
    ENDPOINT = "endpoint"
    LIMIT = "limit"
    CALLS = "calls"
    END = "end"


@dataclass(frozen=True, slots=True)
class ClockDifference:
    """A difference between what a program did on two clocks: a rate in Hz, a number, a count or a word on each.

    Attributes:
        name: Topic, field, service or file, or the title of a criterion.
        virtual: Result in virtual time: a rate in Hz, a number, a count, a word.
        wall: Result on the wall clock.
        by_load: Whether a busy machine can cause it. It makes nodes late, slow or silent. It adds no endpoint, topic
            or type of message, and no message says the same wrong number all the time because of it.
    """

    aspect: Aspect
    name: str
    virtual: float | str
    wall: float | str
    by_load: bool = True


@dataclass(frozen=True, slots=True)
class _Window:
    """The part of a recording that both recordings cover."""

    trace: Trace
    start_ns: int
    stop_ns: int

    def holds(self, t_ns: int) -> bool:
        return self.start_ns <= t_ns < self.stop_ns

    def messages(self, topic: str) -> list[Message]:
        return [m for m in self.trace.messages(topic) if self.holds(m.t_ns)]


def differences(virtual: Trace, wall: Trace, first_message_on: str = "") -> tuple[ClockDifference, ...]:
    """Return the differences between two recordings, the most obvious first; empty if they agree.

    Args:
        virtual: The whole recording in virtual time.
        wall: The beginning of the same plan on the wall clock, from a machine that kept up.
        first_message_on: Topic whose first message starts the observation; empty if it starts at once.
    """
    span_ns = wall.stop_ns - observation_start(wall, first_message_on)
    windows = [
        _Window(t, start, start + span_ns)
        for t in (virtual, wall)
        for start in [observation_start(t, first_message_on)]
    ]
    pair = (windows[0], windows[1])
    ends = tuple(_ends(*pair))
    found = (*_traffic(*pair), *_answers(*pair), *_exchanges(*pair), *_logs(*pair), *_endpoints(*pair), *ends)
    return (*found, *_limits(virtual, wall))


def observation_start(trace: Trace, first_message_on: str) -> int:
    """Return when the observation starts: with the first message on a topic, or at once if there is none."""
    messages = trace.messages(first_message_on) if first_message_on else ()
    return messages[0].t_ns if messages else 0


def sentence(difference: ClockDifference, clock: ClockKind) -> str:
    """Return a sentence about a difference for the report's reason of a clock, given the first recording's clock."""
    name = difference.name[:200]
    first, second = (_shown(value, difference.aspect) for value in (difference.virtual, difference.wall))
    where = ("in virtual time", "on the wall clock")
    if clock is ClockKind.WALL:
        where = ("beside the grader's own code", "without it")
    if difference.aspect is Aspect.CRITERION:
        what = f'"{name}" was {first} {where[0]} and {second} {where[1]}'
    elif difference.aspect is Aspect.CONSTANT:
        what = f"{name} varied {where[0]} and was always {second} {where[1]}"
    else:
        what = f"{name} {_WORDS[difference.aspect][0]}{first} {where[0]} and {second} {where[1]}"
        what += " for the same input" if difference.aspect is Aspect.ANSWER else ""
    return f"the node behaved differently {where[1]}: {what}"


#: Text between the name of what differs and the two results, and the unit of a result.
_WORDS = {
    Aspect.CRITERION: ("", ""),
    Aspect.SILENT: ("had ", " messages"),
    Aspect.RATE: ("had ", " Hz"),
    Aspect.VALUE: ("was ", ""),
    Aspect.CONSTANT: ("", ""),
    Aspect.ANSWER: ("was ", ""),
    Aspect.LOGS: ("logged ", " records"),
    Aspect.ENDPOINT: ("was ", ""),
    Aspect.LIMIT: ("was ", ""),
    Aspect.CALLS: ("had ", " messages"),
    Aspect.END: ("", ""),
}


def _shown(value: float | str, aspect: Aspect) -> str:
    if isinstance(value, str):
        return value
    digits = ".1f" if aspect is Aspect.RATE else ".6g"
    return f"{value:{digits}}{_WORDS[aspect][1]}"


# --- topics ---


def _traffic(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    for topic in sorted({m.topic for m in (*virtual.trace.messages(), *wall.trace.messages())}):
        before, after = virtual.messages(topic), wall.messages(topic)
        lasting = any(m.t_ns >= virtual.start_ns + EDGE_NS for m in before)
        if len(before) >= FEW and lasting and not after:
            yield ClockDifference(Aspect.SILENT, topic, len(before), 0)
        elif len(after) >= FEW and not virtual.trace.messages(topic):
            yield ClockDifference(Aspect.SILENT, topic, 0, len(after), by_load=False)
        elif differ_in_count(len(before), len(after)) or _differ_in_rate(before, after):
            yield ClockDifference(Aspect.RATE, topic, *_rates(virtual, wall, before, after))
        elif min(len(before), len(after)) >= FEW:
            yield from _values(topic, before, after)


def differ_in_count(one: int, other: int) -> bool:
    """Return whether two counts differ by more than chance, jitter and a late start explain."""
    return abs(one - other) > COUNT + SHARE * max(one, other)


def _differ_in_rate(before: Sequence[Message], after: Sequence[Message]) -> bool:
    if min(len(before), len(after)) < 2 * FEW:
        return False
    one, other = _rate(before), _rate(after)
    return _is_regular(before) and abs(one - other) > SHARE * max(one, other)


def _is_regular(messages: Sequence[Message]) -> bool:
    """Return whether messages come from a timer; messages that follow input or chance have no rate to compare."""
    gaps = [after.t_ns - before.t_ns for before, after in pairwise(messages)]
    mean = sum(gaps) / len(gaps)
    return all(abs(gap - mean) <= SHARE * mean for gap in gaps)


def _rate(messages: Sequence[Message]) -> float:
    span_ns = messages[-1].t_ns - messages[0].t_ns
    return (len(messages) - 1) / seconds(span_ns) if span_ns > 0 else float("inf")


def _rates(virtual: _Window, wall: _Window, before: Sequence[Message], after: Sequence[Message]) -> tuple[float, float]:
    """Return both rates over the whole window, including pauses."""
    return tuple(  # type: ignore[return-value]
        len(found) / max(seconds(window.stop_ns - window.start_ns), 1e-9)
        for window, found in ((virtual, before), (wall, after))
    )


def _values(topic: str, before: Sequence[Message], after: Sequence[Message]) -> Iterator[ClockDifference]:
    one, other = _columns(before), _columns(after)
    for path in sorted(one.keys() & other.keys()):
        first, second = one[path], other[path]
        if len(set(first)) == 1:
            odd = [value for value in second if not _alike(first[0], value)]
            if len(odd) > ODD_SHARE * len(second) + 1:
                # A node may publish how late it is, which is another number each time.
                always = len(second) >= 2 * FEW and len(set(second)) == 1
                yield ClockDifference(Aspect.VALUE, f"{topic} {path}", first[0], odd[0], by_load=not always)
                return
        elif len(set(second)) == 1 and len(second) >= 2 * FEW and len(set(first[: len(second)])) > DECISIONS:
            yield ClockDifference(Aspect.CONSTANT, f"{topic} {path}", "", second[0], by_load=False)
            return


def _alike(want: float, got: float) -> bool:
    same = want == got or (want != want and got != got)  # noqa: PLR0124 - NaN
    return same or within(got, want, NUMBER_SHARE * abs(want) + NUMBER_SLACK)


def _columns(messages: Sequence[Message]) -> dict[str, list[float]]:
    """Return the numbers of each field that is in every message, by field path."""
    columns: dict[str, list[float]] = {}
    for message in messages:
        for path, number in _numbers(message.value):
            columns.setdefault(path, []).append(number)
    return {path: column for path, column in columns.items() if len(column) == len(messages)}


def _numbers(value: Mapping[str, object], above: str = "") -> list[tuple[str, float]]:
    found: list[tuple[str, float]] = []
    for name, part in value.items():
        if name in CLOCK_FIELDS or len(found) >= FIELDS:
            continue
        if isinstance(part, Mapping):
            found += _numbers(part, f"{above}{name}.")
        elif isinstance(part, (int, float)):
            found.append((f"{above}{name}", float(part)))
    return found[:FIELDS]


# --- answers to stimuli ---


def _answers(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    inputs = sorted({d.topic for d in virtual.trace.of(Delivery)})
    outputs = sorted({m.topic for m in virtual.trace.messages()})
    for output in outputs if inputs else ():
        numbers_sent = {number for m in virtual.trace.messages(output) for _, number in _numbers(m.value)}
        for given in inputs if len(numbers_sent) <= DECISIONS else ():
            pairs = _paired(_decided(virtual, given, output), _decided(wall, given, output))
            wrong = [(one, other) for one, other in pairs if not _alike(one, other)]
            if wrong:
                known = any(_alike(number, wrong[0][1]) for number in numbers_sent)  # a late answer is a known one
                yield ClockDifference(Aspect.ANSWER, output, *wrong[0], by_load=known)
                return


def _paired(before: Sequence[_Decision], after: Sequence[_Decision]) -> Iterator[tuple[float, float]]:
    """Yield the decisions on both clocks for the same value, which ends at the same time in both recordings.

    The first value may be sent with another type until the program's own type is known.
    """
    for one in before:
        for other in after:
            if abs(one.stop_ns - other.stop_ns) < SAME_NS and one.given == other.given:
                yield one.answer, other.answer


@dataclass(frozen=True, slots=True)
class _Decision:
    """The last answer published while a value was held, and when the value ended, since the start of the window."""

    stop_ns: int
    given: Mapping[str, object]
    answer: float


def _decided(window: _Window, given: str, output: str) -> list[_Decision]:
    """Return the program's answer to each value, if the value was held and the answer was stable long enough."""
    messages = window.trace.messages(output)
    found: list[_Decision] = []
    for start_ns, stop_ns, value in _held(window, given):
        if stop_ns - start_ns < HELD_NS:
            continue
        late_ns = start_ns + (stop_ns - start_ns) // 2
        settled = {n for m in messages if late_ns <= m.t_ns < stop_ns for _, n in _numbers(m.value)[:1]}
        before = [n for m in messages if start_ns <= m.t_ns < late_ns for _, n in _numbers(m.value)[:1]]
        if len(settled) == 1 or (not settled and before):
            answer = settled.pop() if settled else before[-1]
            found.append(_Decision(stop_ns - window.start_ns, value, answer))
    return found


def _held(window: _Window, topic: str) -> list[tuple[int, int, Mapping[str, object]]]:
    """Return start, end and content of each value of a stimulus, inside the window."""
    spans: list[tuple[int, int, Mapping[str, object]]] = []
    for delivery in window.trace.deliveries(topic):
        if not window.holds(delivery.t_ns):
            continue
        if not spans or delivery.value != spans[-1][2]:
            spans.append((delivery.t_ns, delivery.t_ns, delivery.value))
        spans[-1] = (spans[-1][0], delivery.t_ns, delivery.value)
    return [(start, stop - BEFORE_NEXT_NS, value) for start, stop, value in spans]


# --- services, logs, endpoints, ends ---


def _exchanges(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    for kind in (Request, Response):
        counts = [_sent(window, kind) for window in (virtual, wall)]
        for service in sorted(counts[0].keys() | counts[1].keys()):
            one, other = (count[service] for count in counts)
            if differ_in_count(one, other):
                yield ClockDifference(Aspect.CALLS, service, one, other)


def _sent(window: _Window, kind: type[Request] | type[Response]) -> Counter[str]:
    return Counter(o.service for o in window.trace.of(kind) if o.sender == "student" and window.holds(o.t_ns))


def _logs(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    for process in sorted({r.process for r in (*virtual.trace.records(), *wall.trace.records())}):
        one, other = (sum(w.holds(r.t_ns) for r in w.trace.records(process)) for w in (virtual, wall))
        if differ_in_count(one, other):
            yield ClockDifference(Aspect.LOGS, process, one, other)


def _endpoints(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    stop_ns = min(virtual.stop_ns, virtual.trace.stop_ns)
    early = [g for g in virtual.trace.graphs() if g.t_ns < stop_ns - EDGE_NS]
    lasting = {key for g in early for key in ends_in(g)}
    ever = {key for g in virtual.trace.graphs() for key in ends_in(g)}
    seen = {key for g in wall.trace.graphs() for key in ends_in(g)}
    for kind, name, type_ in sorted(lasting - seen):
        yield ClockDifference(Aspect.ENDPOINT, f"the {kind} of {name} [{type_}]", "there", "not there")
    for kind, name, type_ in sorted(seen - ever):
        what = f"the {kind} of {name} [{type_}]"
        yield ClockDifference(Aspect.ENDPOINT, what, "not there", "there", by_load=False)


def _limits(virtual: Trace, wall: Trace) -> Iterator[ClockDifference]:
    """Yield that only the second recording was cut off by what a program sent or wrote: little is left to compare."""
    ends = wall.marks("limit")
    if ends and not virtual.marks("limit"):
        found = f"cut off ({ends[0].detail})"
        yield ClockDifference(Aspect.LIMIT, "the recording", "complete", found, by_load=False)


def ends_in(graph: GraphSnapshot) -> Iterator[tuple[str, str, str]]:
    """Yield kind, name and type of what communicates in a graph: publishers, subscriptions, services and clients."""
    yield from ((e.kind, e.topic, e.type) for e in graph.endpoints)
    yield from ((s.kind, s.service, s.type) for s in graph.services)


def _ends(virtual: _Window, wall: _Window) -> Iterator[ClockDifference]:
    for process in sorted({f.process for w in (virtual, wall) for f in w.trace.faults()}):
        one, other = (_first(window, process) for window in (virtual, wall))
        if one is not None and one.t_ns < virtual.stop_ns - EDGE_NS and other is None:
            yield ClockDifference(Aspect.END, process, "failed", "kept running")
        elif other is not None and other.t_ns < wall.stop_ns and not faults_before_stop(virtual.trace, process):
            yield ClockDifference(Aspect.END, process, "kept running", "failed")


def _first(window: _Window, process: str) -> Fault | None:
    found = [f for f in faults_before_stop(window.trace, process) if f.t_ns <= window.stop_ns]
    return min(found, key=lambda f: f.t_ns, default=None)
