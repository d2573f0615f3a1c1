"""The checks of exercise 2: positions that a process logs while odometry is played, and how often it logs them.

A log shows a position with any wording: the texts are grouped by their wording, and in each group the two numbers are
chosen that agree most often with the x and y that were current. The last part finds what the texts show instead.
"""

from __future__ import annotations

import math
import re
import statistics
from bisect import bisect_left, bisect_right
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import combinations, pairwise
from typing import ClassVar

from grader.api import (
    NS_PER_S,
    Band,
    Chart,
    ClockKind,
    Delivery,
    DurationNs,
    Fault,
    Finding,
    HarnessError,
    LogRecord,
    Look,
    OutputLine,
    Panel,
    Point,
    Problem,
    ProblemKind,
    Roles,
    Series,
    Tone,
    Trace,
    delivered,
    met,
    not_met,
    number_at,
    partly,
    printed_lines,
    seconds,
    student_records,
    within,
)
from grader.api.unstable import (
    JITTER_NS,
    NS_PER_MS,
    LogPaceFacts,
    Printed,
    WrongLogFacts,
    chance,
    clean,
    counted,
    fault_hint,
    fault_sentence,
    faulted,
    first_fault,
    gaps_panel,
    moment,
    number,
    only_printed,
    per_trace,
    printed_numbers,
    quote,
    readings,
    segments,
    series,
    span,
    template_of,
    time_chart,
    written,
)

#: Paths of the two numbers in a message.
X = "pose.pose.position.x"
Y = "pose.pose.position.y"
_LOGGER_HINT = "write the position through the node's logger: self.get_logger().info(...)"
_DECIMALS_HINT = "keep a decimal or two: f'x={x:.2f}, y={y:.2f}'"
#: Positions in whole metres are coarse where this share of the path's extent is less than a metre.
_COARSE = 0.05
_TIMER_HINT = "log from a timer of that period, or give the logger throttle_duration_sec"
#: Longest gap between two logs, and longest wait at both ends of the stream, in periods.
_LONGEST_GAP = 2.2
#: Minimum share of messages with a log for the logs to count as one per message.
_ONE_A_MESSAGE = 0.8
_MOST_IN_EVIDENCE = 60


def _track(trace: Trace, process: str, topic: str) -> Track | Finding:
    """Return the odometry played; if a fault ended the recording before it, a finding about the fault."""
    track = track_of(trace, topic)
    if track is not None:
        return track
    fault = first_fault(trace, process)
    if fault is None:
        raise HarnessError(f"{topic}: nothing was played on it")
    return _ended_early(fault)


def _ended_early(fault: Fault) -> Finding:
    reason = f"{fault_sentence(fault)}; nothing could be logged after it"
    return not_met(reason, hint=fault_hint(fault), fault=fault, blocked_by="waits_gracefully")


@dataclass(frozen=True, slots=True)
class LogsPosition:
    """A process logs the (x, y) of the odometry that is played, with any wording, to the precision that it prints.

    A logged pair must show a pose that was current when it was written: the newest one, or one replaced less than half
    a second before. Positions that are printed instead of logged give half the points, and so do positions without
    decimals, unless the path is longer than 20 m.

    Attributes:
        process: File name of the student process.
        topic: Topic of the odometry.
    """

    roles: ClassVar[Roles] = Roles(logs=("topic",), given=("topic",))
    process: str
    topic: str

    @property
    def expected(self) -> str:
        text = f"{self.process} logs the x and y that {self.topic} had at that moment"
        return f"{text}; half the points if only printed, or without decimals"

    def judge(self, trace: Trace) -> Finding:
        track = _track(trace, self.process, self.topic)
        if isinstance(track, Finding):
            return track
        logged = logged_positions(trace, self.process, track)
        if self._shows(trace, logged):
            return self._coarse(logged, track) or met(self._right(logged), _evidence(logged))
        printed = printed_positions(trace, self.process, track)
        if self._shows(trace, printed):
            return only_printed(f"{self._right(printed)}, printed and not logged", _evidence(printed), _LOGGER_HINT)
        chosen = logged if logged.groups or not printed.groups else printed
        return self._explain(trace, track, chosen)

    def _shows(self, trace: Trace, found: Analysis) -> bool:
        """Return whether the position is logged; `log_period` judges how often, unless a fault cut it short."""
        lived = first_fault(trace, self.process) is None
        return found.met or (lived and bool(found.right) and not found.wrong)

    def _coarse(self, found: Analysis, track: Track) -> Finding | None:
        """Return half credit for positions in metres without decimals, if the path is short for that; else None."""
        shown = [
            (e, pair) for g in found.groups for e in g.entries if e.right for pair in _hits(e, g.pairs, track, position)
        ]
        steps = [min(n.step for n in _pair(e, pair)) for e, pair in shown]
        # what can be read in another way, such as -2,51 with a decimal comma, may have decimals
        plain = all(sum(map(bool, readings(e.text))) == 1 for e in found.right)
        if not steps or not plain or min(steps) < max(1.0, _COARSE * max(track.spans)):
            return None
        first = found.right[0]
        pose = track.pose(track.current(first.t_ns).stop - 1)
        reason = f"{self.process}: the positions agree with {self.topic}, but have no decimals: "
        reason += f"at {moment(first.t_ns)} the log says '{quote(first.text, 80)}' at {_exact(pose)}"
        facts = WrongLogFacts("whole", len(found.right), (X, Y))
        problem = Problem(ProblemKind.WRONG_VALUE, detail="whole")
        return partly(reason, _evidence(found), hint=_DECIMALS_HINT, problem=problem, facts=facts)

    def _right(self, found: Analysis) -> str:
        first = found.right[0]
        reason = f"{self.process}: {counted(len(found.times_ns), 'position')} that agree with {self.topic}"
        return f"{reason}, the first at {moment(first.t_ns)}: {quote(first.text, 80)}"

    def _explain(self, trace: Trace, track: Track, found: Analysis) -> Finding:
        fault = first_fault(trace, self.process)
        if fault is not None and fault.t_ns < track.times_ns[0]:
            return _ended_early(fault)
        cause = cause_of(found, track)
        evidence = _evidence(found) | {"cause": cause.name}
        facts = WrongLogFacts(cause.name, len(found.right), (X, Y), absent=cause.name == "no_pair")
        if fault is not None and cause.name in ("no_pair", "few"):
            return faulted(fault, cause.sentence if found.right else "no position was logged before it", evidence)
        if not found.groups and not any(o.t_ns >= track.times_ns[0] for o in written(trace, self.process)):
            during = span(track.stop_ns - track.start_ns)
            reason = f"{self.process}: nothing was logged while {self.topic} was played for {during}"
            silent = replace(facts, cause="nothing", absent=True)
            return not_met(reason, evidence | {"cause": "nothing"}, problem=ProblemKind.NOT_LOGGED, facts=silent)
        problem = Problem(ProblemKind.WRONG_VALUE, detail=cause.name)
        return not_met(f"{self.process}: {cause.sentence}", evidence, hint=cause.hint, problem=problem, facts=facts)

    def drawing(self, trace: Trace) -> Chart | None:
        """Return the driven path with the logged positions on it, or None without odometry."""
        track = track_of(trace, self.topic)
        if track is None:
            return None
        logged = logged_positions(trace, self.process, track)
        printed = Analysis() if logged.right else printed_positions(trace, self.process, track)
        pairs = _pairs(printed if printed.right else logged)
        shown = [pair for pair in pairs if _near(pair.point, track)]
        poses = track.poses
        path = [(p.x, p.y) for p in poses]
        lines = [series(f"path on {self.topic}", path, tone=Tone.FAINT, texts=[moment(p.t_ns) for p in poses])]
        lines += _dots("logged, agrees", [p for p in shown if p.right], Tone.GOOD)
        lines += _dots("logged, does not agree", [p for p in shown if not p.right], Tone.BAD)
        return Chart(
            id=f"path {self.topic}",
            title=f"The path on {self.topic} and the logged positions",
            about=_describe_path(self.topic, track, pairs, len(pairs) - len(shown)),
            criteria=(),
            x_title="x",
            x_unit="m",
            panels=(Panel("y", "m", tuple(lines)),),
            square=True,
        )


def _evidence(found: Analysis) -> dict[str, object]:
    entries = found.right or found.wrong or tuple(e for g in found.groups for e in g.entries)
    return {
        "right": len(found.right),
        "wrong": len(found.wrong),
        "times_s": [seconds(t) for t in found.times_ns[:_MOST_IN_EVIDENCE]],
        "first_texts": [quote(e.text) for e in entries[:3]],
        "first_wrong": quote(found.wrong[0].text) if found.wrong else "",
    }


@dataclass(frozen=True, slots=True)
class LogPeriod:
    """A process logs positions with a period while odometry is played, and not one for every message.

    The position logs are judged; if none is right, or something else is played, the most frequent log with a number.

    Attributes:
        process: File name of the student process.
        topic: Topic of the odometry.
        period: Average time expected from one log to the next.
        tolerance: Largest difference of the average, as a share of the period; the edge is inside.
    """

    roles: ClassVar[Roles] = Roles(given=("topic",))
    process: str
    topic: str
    period: DurationNs
    tolerance: float = 0.1

    @property
    def expected(self) -> str:
        share = number(100 * self.tolerance)
        return f"one log every {number(seconds(self.period))} s ± {share} % on average while {self.topic} is played"

    def judge(self, trace: Trace) -> Finding:
        track = _track(trace, self.process, self.topic)
        if isinstance(track, Finding):
            return not_met(track.reason, track.evidence, blocked_by="logs_position", problem=track.problem)
        times = [t for t in self.log_times(trace, track) if track.start_ns <= t < track.stop_ns]
        if not times:
            reason = f"{self.process}: nothing with a number was logged while {self.topic} was played"
            none = LogPaceFacts(0, 0.0, seconds(self.period))
            return not_met(reason, blocked_by="logs_position", problem=ProblemKind.NOT_LOGGED, facts=none)
        average_ns = (times[-1] - times[0]) / (len(times) - 1) if len(times) > 1 else 0.0
        evidence = {
            "logs": len(times),
            "average_period_s": average_ns / 1e9,
            "times_s": [seconds(t) for t in times[:_MOST_IN_EVIDENCE]],
            "stream_s": [seconds(track.start_ns), seconds(track.stop_ns)],
        }
        found = self._judged(trace, track, times, average_ns, evidence)
        return replace(found, facts=LogPaceFacts(len(times), average_ns / 1e9, seconds(self.period)))

    def _judged(
        self, trace: Trace, track: Track, times: Sequence[int], average_ns: float, evidence: dict[str, object]
    ) -> Finding:
        wanted = f"expected one every {span(self.period)} ± {number(100 * self.tolerance)} %"
        if len(times) == 1:
            only = f"{self.process}: 1 log in {span(track.stop_ns - track.start_ns)}, at {moment(times[0])}; {wanted}"
            return not_met(
                only, evidence, hint=_TIMER_HINT, fault=first_fault(trace, self.process), problem=ProblemKind.TOO_FEW
            )
        average = f"{self.process}: {len(times)} logs, one every {average_ns / 1e9:.3f} s on average"
        if not within(average_ns, self.period, self.tolerance * self.period):
            return self._off(track, times, f"{average}; {wanted}", wanted, evidence)
        gap = self._long_gap(track, times)
        if gap is None:
            return met(f"{average}; {wanted}", evidence)
        fault = first_fault(trace, self.process)
        ended = f"; {fault_sentence(fault)}" if fault else ""
        reason = f"{average}, but none from {span(gap[0])} to {span(gap[1])}{ended}; {wanted}"
        return not_met(reason, evidence, fault=fault, problem=ProblemKind.STOPPED)

    def _off(
        self, track: Track, times: Sequence[int], reason: str, wanted: str, evidence: dict[str, object]
    ) -> Finding:
        """Return a finding that the average is wrong, with `reason`, or that each message is logged."""
        played = sum(track.start_ns <= t < track.stop_ns for t in track.times_ns)
        if len(times) < _ONE_A_MESSAGE * played:
            return not_met(reason, evidence, hint=_TIMER_HINT, problem=ProblemKind.WRONG_RATE)
        rate = len(times) / seconds(track.stop_ns - track.start_ns)
        each = f"{self.process}: {rate:.0f} logs a second: one for every message; {wanted}"
        return not_met(each, evidence, hint=_TIMER_HINT, problem=ProblemKind.ONE_PER_MESSAGE)

    def _long_gap(self, track: Track, times: Sequence[int]) -> tuple[int, int] | None:
        ends = [track.start_ns, *times, track.stop_ns]
        gaps = pairwise(ends)
        return next(((a, b) for a, b in gaps if b - a > _LONGEST_GAP * self.period + track.jitter_ns), None)

    def log_times(self, trace: Trace, track: Track) -> tuple[int, ...]:
        """Return when positions, or the most similar texts, were logged, also outside the stream."""
        logged = logged_positions(trace, self.process, track)
        if logged.right:
            return logged.times_ns
        printed = printed_positions(trace, self.process, track)
        if printed.right:
            return printed.times_ns
        for outputs in (student_records(trace, self.process), printed_lines(trace, self.process)):
            during = [o for o in outputs if track.start_ns <= o.t_ns < track.stop_ns]
            groups = grouped(blocks(during, trace.clock))
            if groups:  # of equally frequent templates, the one with two numbers
                commonest = max(groups, key=lambda group: (len(group.entries), bool(group.pairs)))
                return tuple(dict.fromkeys(e.t_ns for e in commonest.entries))
        return ()

    def drawing(self, trace: Trace) -> Chart | None:
        """Return when positions were logged, on the grid of the period; None if there was nothing to log."""
        track = track_of(trace, self.topic)
        if track is None:
            return None
        times = self.log_times(trace, track)
        if not times:
            return None
        period_s = seconds(self.period)
        dots = series("log", [(seconds(t), 0.0) for t in times], look=Look.DOTS)
        share = self.tolerance * period_s
        label = f"{number(period_s)} s ± {number(100 * self.tolerance)} % on average"
        return time_chart(
            trace,
            f"period {self.topic}",
            f"When {'numbers' if math.isnan(track.pose(0).x) else 'positions'} were logged",
            _describe_period(times, self),
            Panel("logs", "", (dots,), lanes=("log",), grid=(seconds(times[0]), period_s)),
            gaps_panel("log", times, bands=(Band(period_s - share, period_s + share, label),)),
        )


#: A logged pair farther away than this many path sizes is mentioned, not drawn: it would shrink the path to a dot.
_FAR = 2.0


@dataclass(frozen=True, slots=True)
class _LoggedPair:
    """A pair of numbers that was logged as a position."""

    point: Point
    text: str
    right: bool


def _pairs(found: Analysis) -> list[_LoggedPair]:
    """Return the pairs of the position templates; without any, those of the most frequent template with two numbers."""
    right = [g for g in found.groups if g.pair is not None and g.right]
    rest = [g for g in found.groups if g.pair is not None]
    chosen = right or sorted(rest, key=lambda g: -len(g.entries))[:1]
    return [
        _LoggedPair((e.numbers[g.pair[0]].value, e.numbers[g.pair[1]].value), f"{moment(e.t_ns)}: {e.text}", e.right)
        for g in chosen
        if g.pair is not None
        for e in g.entries
    ]


def _near(point: Point, track: Track) -> bool:
    for value, path in zip(point, (X, Y), strict=True):
        values = [p.at(path) for p in track.poses]
        low, high = min(values), max(values)
        room = _FAR * max(high - low, 1.0)
        if not low - room <= value <= high + room:  # NaN loses
            return False
    return True


def _dots(name: str, pairs: Sequence[_LoggedPair], tone: Tone) -> list[Series]:
    if not pairs:
        return []
    return [series(name, [p.point for p in pairs], look=Look.DOTS, tone=tone, texts=[p.text for p in pairs])]


def _describe_path(topic: str, track: Track, pairs: Sequence[_LoggedPair], hidden: int) -> str:
    right = sum(p.right for p in pairs)
    first, last = track.pose(0), track.pose(len(track.deliveries) - 1)
    text = f"{topic} was played for {span(track.stop_ns - track.start_ns)}, from {_place(first.at(X), first.at(Y))} to "
    text += f"{_place(last.at(X), last.at(Y))}. "
    if not pairs:
        return f"{text}No pair of numbers was logged."
    text += f"{right} of {counted(len(pairs), 'logged pair')} of numbers agree with it."
    return f"{text} {hidden} too far away to be drawn." if hidden else text


def _place(x: float, y: float) -> str:
    return f"({x:.2f}, {y:.2f}) m"


def _describe_period(times: Sequence[int], check: LogPeriod) -> str:
    wanted = f"Expected: one every {number(seconds(check.period))} s ± {number(100 * check.tolerance)} % on average."
    if len(times) < 2:
        return f"One log, at {moment(times[0])}. {wanted}"
    average = (times[-1] - times[0]) / (len(times) - 1) / NS_PER_S
    gaps = [seconds(b - a) for a, b in pairwise(times)]
    return (
        f"{len(times)} logs from {moment(times[0])} to {moment(times[-1])}, one every {average:.3f} s on average, "
        f"intervals from {min(gaps):.3f} to {max(gaps):.3f} s. The grid starts at the first log. {wanted}"
    )


# --- logs and the odometry that was current ---

#: How long a pose stays acceptable after the next one arrived: a slow loop may read from a queue.
STALE_NS = 500 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class Pose:
    """One odometry message: when it was delivered, its position, and all its fields."""

    t_ns: int
    x: float
    y: float
    fields: Mapping[str, object]

    @classmethod
    def of(cls, delivery: Delivery) -> Pose:
        """Return the pose in a message."""
        fields = delivery.value
        try:
            position = fields["pose"]["pose"]["position"]
            x, y = position["x"], position["y"]
        except (KeyError, TypeError):
            x = y = None
        if type(x) is float and type(y) is float:  # the common case, and there are many
            return cls(delivery.t_ns, x, y, fields)
        return cls(delivery.t_ns, _number(fields, X), _number(fields, Y), fields)

    def at(self, path: str) -> float:
        """Return a number of the message; NaN, which matches nothing, if the path does not exist."""
        if path == X:
            return self.x
        return self.y if path == Y else _number(self.fields, path)


@dataclass(frozen=True, slots=True, eq=False)
class Track:
    """The odometry played on a topic, in order, and the start and end of the stream; compared by identity."""

    deliveries: tuple[Delivery, ...]
    times_ns: tuple[int, ...]
    start_ns: int
    stop_ns: int
    jitter_ns: int
    _spans: list[tuple[float, float]] = field(default_factory=list, init=False, repr=False)
    _made: dict[int, Pose] = field(default_factory=dict, init=False, repr=False)

    def current(self, t_ns: int) -> range:
        """Return the indices of the poses that a log written at `t_ns` may show; empty before the first."""
        stop = bisect_right(self.times_ns, t_ns + self.jitter_ns)
        start = bisect_left(self.times_ns, t_ns - STALE_NS) - 1
        return range(max(0, min(start, stop - 1)), stop)

    def pose(self, index: int) -> Pose:
        """Return a pose; poses are created on first use, because half of them are never needed."""
        pose = self._made.get(index)
        if pose is None:
            pose = self._made[index] = Pose.of(self.deliveries[index])
        return pose

    @property
    def poses(self) -> tuple[Pose, ...]:
        """All poses."""
        return tuple(map(self.pose, range(len(self.deliveries))))

    @property
    def moves(self) -> bool:
        """Whether the poses differ by more than a centimetre."""
        return bool(self.times_ns) and max(self.spans) > 0.01

    @property
    def spans(self) -> tuple[float, float]:
        """Extent of the poses in x and y, metres; at least a centimetre each, to avoid division by zero."""
        if not self._spans:
            xs, ys = [p.x for p in self.poses], [p.y for p in self.poses]
            self._spans.append((max(max(xs) - min(xs), 0.01), max(max(ys) - min(ys), 0.01)))
        return self._spans[0]


@per_trace
def track_of(trace: Trace, topic: str) -> Track | None:
    """Return the odometry played on a topic, or None if there was none."""
    played = delivered(trace, topic)
    if not played:
        return None
    times = tuple(d.t_ns for d in played)
    starts, stops = trace.marks("stream_starts", topic), trace.marks("stream_stops", topic)
    start_ns = min(starts[0].t_ns, times[0]) if starts else times[0]
    stop_ns = stops[-1].t_ns if stops else times[-1] + (times[-1] - times[0]) // max(1, len(times) - 1)
    return Track(played, times, start_ns, min(stop_ns, trace.stop_ns), JITTER_NS[trace.clock])


def _number(fields: Mapping[str, object], path: str) -> float:
    found = number_at(fields, path)
    return math.nan if found is None else found


#: Output written within this time is one block; in virtual time, output of exactly one instant.
_BLOCK_NS = {ClockKind.VIRTUAL: 0, ClockKind.WALL: 10 * NS_PER_MS}
Wanted = Callable[[Pose], tuple[float, float]]


@dataclass(frozen=True, slots=True)
class Text:
    """A text that a process wrote at one instant."""

    t_ns: int
    text: str


@dataclass(frozen=True, slots=True)
class Entry:
    """One parsed text of a group; `right` if its pair shows a current pose."""

    t_ns: int
    text: str
    numbers: tuple[Printed, ...]
    right: bool = False


@dataclass(frozen=True, slots=True)
class Group:
    """All texts of one template, and the index pair that shows a current pose most often.

    `pair` is None if the texts hold fewer than two numbers.
    """

    pairs: tuple[Pair, ...]
    entries: tuple[Entry, ...]
    pair: Pair | None = None

    @property
    def right(self) -> int:
        """Number of texts that show a current pose."""
        return sum(e.right for e in self.entries)

    @property
    def share(self) -> float:
        """Share of the texts that show a current pose."""
        return self.right / len(self.entries)


def position(pose: Pose) -> tuple[float, float]:
    """Return the expected numbers: x and y."""
    return pose.x, pose.y


def blocks(outputs: Iterable[LogRecord | OutputLine], clock: ClockKind) -> list[Text]:
    """Return the output of each instant as one text: three lines per message count as one."""
    joined: list[tuple[int, list[str]]] = []
    for output in outputs:
        if joined and output.t_ns - joined[-1][0] <= _BLOCK_NS[clock]:
            joined[-1][1].append(output.text)
        else:
            joined.append((output.t_ns, [output.text]))
    return [Text(t_ns, clean("\n".join(texts))) for t_ns, texts in joined]


def grouped(texts: Iterable[Text], reading: int = 0) -> list[Group]:
    """Return texts that hold a number, grouped by template in order of appearance.

    Args:
        texts: The texts.
        reading: Which of their readings to take; of a text that does not have it, the plainest.
    """
    pairs: dict[str, tuple[Pair, ...]] = {}
    members: dict[str, list[Entry]] = {}
    for text in texts:
        body = readings(text.text)[reading] or text.text
        numbers = printed_numbers(body)
        if not numbers:
            continue
        template = template_of(body, numbers)
        if template not in pairs:
            pairs[template] = candidate_pairs(body, numbers)
        members.setdefault(template, []).append(Entry(text.t_ns, text.text, numbers))
    return [Group(pairs[template], tuple(entries)) for template, entries in members.items()]


def matched(group: Group, track: Track, wanted: Wanted = position) -> Group:
    """Return the group with its best pair chosen and every text judged by that pair."""
    if not group.pairs:
        return group
    hits = [_hits(entry, group.pairs, track, wanted) for entry in group.entries]
    counts = {pair: sum(pair in h for h in hits) for pair in group.pairs}
    best = max(group.pairs, key=lambda pair: counts[pair])
    entries = tuple(Entry(e.t_ns, e.text, e.numbers, right=best in h) for e, h in zip(group.entries, hits, strict=True))
    return Group(group.pairs, entries, best)


def _hits(entry: Entry, pairs: Sequence[Pair], track: Track, wanted: Wanted) -> set[Pair]:
    """Return the pairs that show a current pose; both numbers must belong to the same pose."""
    current = track.current(entry.t_ns)
    newest = _among(entry, pairs, [wanted(track.pose(current[-1]))])
    # nearly every log shows the newest pose, and comparing with a dozen older ones takes long
    return newest if len(newest) == len(pairs) else _among(entry, pairs, [wanted(track.pose(k)) for k in current])


def _among(entry: Entry, pairs: Sequence[Pair], targets: Sequence[tuple[float, float]]) -> set[Pair]:
    wanted_first, wanted_second = [a for a, _ in targets], [b for _, b in targets]
    firsts = {i: _shown_by(entry.numbers[i], wanted_first) for i in {i for i, _ in pairs}}
    others = {j: _shown_by(entry.numbers[j], wanted_second) for j in {j for i, j in pairs if firsts[i]}}
    return {(i, j) for i, j in pairs if firsts[i] and firsts[i] & others[j]}


#: More than any number allows besides its last digit, in metres: what is farther away needs no closer look.
_BEYOND = 1e-3


def _shown_by(number: Printed, values: Sequence[float]) -> int:
    """Return a bit set of the values that the number shows."""
    far = number.step + _BEYOND
    if number.value < min(values) - far or number.value > max(values) + far:
        return 0
    bits = 0
    for place, value in enumerate(values):
        if number.shows(value):
            bits |= 1 << place
    return bits


#: Minimum share of right texts for a template to count as a position log.
_POSITION_SHARE = 0.5
#: Streams longer than this need more than one or two logs.
_LONG_STREAM_NS = 5 * NS_PER_S
_FEWEST_IN_LONG_STREAM = 3
#: Up to this many templates are normal for a program with several wordings; more suggest that it varies its text.
_FEW_WORDINGS = 3
#: Maximum share of right templates that chance may explain.
_LUCK = 0.3


@dataclass(frozen=True, slots=True)
class Analysis:
    """The position logs among the texts of one source.

    Attributes:
        groups: Every template with a number, matched.
        right: Texts that show a pose that was current, in order.
        wrong: Texts of the same templates that show none, in order.
        needed: Number of instants that need a right text.
        by_chance: Whether positions appear only because the texts hold so many numbers; then none counts as right.
    """

    groups: tuple[Group, ...] = ()
    right: tuple[Entry, ...] = ()
    wrong: tuple[Entry, ...] = ()
    needed: int = 1
    by_chance: bool = False

    @property
    def times_ns(self) -> tuple[int, ...]:
        """The instants at which a position was logged, right or wrong, without duplicates."""
        return tuple(sorted({e.t_ns for e in (*self.right, *self.wrong)}))

    @property
    def met(self) -> bool:
        """Whether every position log is right, and there are enough of them."""
        return not self.wrong and len({e.t_ns for e in self.right}) >= self.needed


@per_trace
def logged_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process wrote through its logger."""
    return _analysed(student_records(trace, process), track, trace.clock)


def printed_positions(trace: Trace, process: str, track: Track) -> Analysis:
    """Return the positions that a process printed."""
    return _analysed(printed_lines(trace, process), track, trace.clock)


def _analysed(outputs: Sequence[LogRecord | OutputLine], track: Track, clock: ClockKind) -> Analysis:
    """Return the best interpretation: text by text or block by block, in each reading that some text has."""
    during = [o for o in outputs if o.t_ns >= track.times_ns[0]]
    best = Analysis(needed=_needed(track))
    singly, together = [Text(o.t_ns, clean(o.text)) for o in during], blocks(during, clock)
    for texts in (singly, together) if len(together) < len(singly) else (singly,):
        bodies = zip(*(readings(t.text) for t in texts), strict=True)
        for reading in [k for k, some in enumerate(bodies) if any(some)] or [0]:
            found = _judged(texts, track, reading)
            if found.met:
                return found
            if (len(found.right), len(found.groups)) > (len(best.right), len(best.groups)) or not best.groups:
                best = found
    return best


def _judged(texts: Sequence[Text], track: Track, reading: int) -> Analysis:
    groups = tuple(matched(g, track) for g in grouped(texts, reading))
    chosen = [g for g in groups if g.right and g.share >= _POSITION_SHARE]
    if (
        chosen
        and track.moves
        and len(groups) > _FEW_WORDINGS
        and sum(_luck(g, track) for g in groups) > _LUCK * len(chosen)
    ):
        return Analysis(groups, needed=_needed(track), by_chance=True)
    entries = sorted((e for g in chosen for e in g.entries), key=lambda e: e.t_ns)
    settled_ns = track.times_ns[0] + STALE_NS
    right = tuple(e for e in entries if e.right)
    # a timer that fires before the first message arrives shows the node's initial values
    wrong = tuple(e for e in entries if not e.right and e.t_ns > settled_ns)
    return Analysis(groups, right, wrong, _needed(track))


def _luck(group: Group, track: Track) -> float:
    """Return how many pairs of a template are expected to show positions by chance, over all of its texts."""
    if not group.pairs:
        return 0.0
    first, second = group.pair or group.pairs[0]
    steps = [(e.numbers[first].step, e.numbers[second].step) for e in group.entries]
    both = chance(max(x for x, _ in steps), track.spans[0])
    both *= chance(max(y for _, y in steps), track.spans[1])
    told = {(e.numbers[first].value, e.numbers[second].value) for e in group.entries}
    return float(len(group.pairs) * both ** len(told))


def _needed(track: Track) -> int:
    return _FEWEST_IN_LONG_STREAM if track.stop_ns - track.start_ns > _LONG_STREAM_NS else 1


# --- which numbers of a text are x and y ---

#: Maximum number of numbers among which unlabelled pairs are searched.
_MOST_UNLABELLED = 20
_MOST_LABELLED_PAIRS = 60
#: Number of numbers after a list of labels that the list may refer to.
_MOST_AFTER_LIST = 6
_WORD = re.compile(r"[A-Z]+(?![a-zà-ɏ])|[A-ZÀ-ɏ]?[a-zà-ɏ]+|[A-Z]")
_LABELS = {
    **dict.fromkeys(("x", "px", "posx", "xpos", "coordx", "xcoord", "xx"), "x"),
    **dict.fromkeys(("y", "py", "posy", "ypos", "coordy", "ycoord", "yy"), "y"),
    **dict.fromkeys(("z", "pz", "posz", "zpos", "coordz", "zcoord"), "z"),
    "xy": "xy",
    "xyz": "xyz",
}
#: Words that may appear inside a list of labels such as `pos_x and pos_y (m)`.
_FILLERS = frozenset({"and", "e", "et", "und", "i", "ed", "pos", "position", "coord", "coordinate", "coords", "p"})
_FILLERS |= {"odom", "robot", "pose", "m", "meter", "meters", "metre", "metres", "msg", "axis", "eje", "axe"}
_FILLERS |= {"current", "the"}
Pair = tuple[int, int]
Assignment = list[str]


def candidate_pairs(text: str, numbers: Sequence[Printed]) -> tuple[Pair, ...]:
    """Return the index pairs that are (x, y) by their labels; without labels, all in order of appearance."""
    parts = segments(text, numbers)
    nearest = [(_labels_in(part) or [""])[-1] for part in parts[:-1]]
    ways = [_by_run(parts), nearest, _by_suffix(parts)]
    complete = [w for w in ways if "x" in w and "y" in w]
    plain = range(min(len(numbers), _MOST_UNLABELLED))
    if not complete:
        return tuple(combinations(plain, 2))
    pairs = [*(pair for way in complete for pair in _labelled_pairs(way)), *_listed_pairs(parts)]
    pairs = pairs[:_MOST_LABELLED_PAIRS]
    bare = [i for i in plain if not any(way[i] for way in complete)]
    return tuple(dict.fromkeys([*pairs, *combinations(bare, 2)]))


def _labels_in(segment: str) -> list[str]:
    return [label for word in _WORD.findall(segment) for label in _LABELS.get(word.lower(), "")]


def _last_run(segment: str) -> list[str]:
    """Return the last list of labels in a segment: `the x of (x, y) = ` gives x and y."""
    run: list[str] = []
    unbroken = False
    for word in _WORD.findall(segment):
        labels = list(_LABELS.get(word.lower(), ""))
        if labels:
            again = any(label in run[:-1] for label in labels)
            run = [*run, *labels] if unbroken and not again else labels
            unbroken = True
        elif word.lower() not in _FILLERS:
            unbroken = False
    return [label for i, label in enumerate(run) if i == 0 or run[i - 1] != label]


def _by_run(parts: list[str]) -> Assignment:
    """Assign each list of labels to the numbers that follow it, in order."""
    waiting: list[str] = []
    given: Assignment = []
    for part in parts[:-1]:
        waiting = _last_run(part) or waiting
        given.append(waiting[0] if waiting else "")
        waiting = waiting[1:]
    return given


def _listed_pairs(parts: list[str]) -> list[Pair]:
    """Return pairs in the order of a list of labels apart from its numbers: `(x, y) at 12 s: 1, 2`."""
    pairs: list[Pair] = []
    for here, part in enumerate(parts[:-1]):
        run = _last_run(part)
        if "x" not in run or "y" not in run:
            continue
        labelled = (k for k in range(here + 1, len(parts) - 1) if _labels_in(parts[k]))
        span = range(here, min(next(labelled, len(parts) - 1), here + _MOST_AFTER_LIST))
        forward = run.index("x") < run.index("y")
        pairs += [(i, j) if forward else (j, i) for i, j in combinations(span, 2)]
    return pairs


def _by_suffix(parts: list[str]) -> Assignment:
    """Assign to each number the first label after it, if there is no label before the first number."""
    if not parts or _labels_in(parts[0]) or not _labels_in(parts[-1]):
        return [""] * (len(parts) - 1)
    return [(_labels_in(part) or [""])[0] for part in parts[1:]]


def _labelled_pairs(given: Assignment) -> list[Pair]:
    pairs: list[Pair] = []
    xs = [i for i, label in enumerate(given) if label == "x"]
    ys = [i for i, label in enumerate(given) if label == "y"]
    for here, following in zip(xs, [*xs[1:], len(given)], strict=True):
        after = next((j for j in ys if here < j < following), None)
        before = next((j for j in reversed(ys) if j < here), None)
        partner = after if after is not None else before
        if partner is not None:
            pairs.append((here, partner))
    return pairs


# --- what wrong logs show instead ---

#: Minimum share of a template's texts that must show the same mistake for it to be reported.
_SURE = 0.8
#: Maximum number of a template's texts that are examined for a cause.
_SAMPLE = 40
#: In metres: who reads an example sees a difference of this size at once.
_SEEN_M = 0.1
#: Maximum number of a template's pairs that are compared with older poses.
_MOST_PAIRS = 12
_TWIST = "twist.twist.linear"
_TURN = "twist.twist.angular.z"
_TURNED = "pose.pose.orientation"
_POSITION_HINT = "the position is msg.pose.pose.position: log its x and its y"
_SWAP_HINT = "log msg.pose.pose.position.x as x and msg.pose.pose.position.y as y"


@dataclass(frozen=True, slots=True)
class Cause:
    """What the logs show instead of the position: a word for evidence, and a clause to follow a place and a colon."""

    name: str
    sentence: str
    hint: str = ""


@dataclass(frozen=True, slots=True)
class _Variant:
    name: str
    first: str
    second: str
    sentence: str
    hint: str = _POSITION_HINT
    signs: tuple[int, int] = (1, 1)
    absolute: bool = False

    def wanted(self) -> Wanted:
        def numbers_of(pose: Pose) -> tuple[float, float]:
            first, second = self.signs[0] * pose.at(self.first), self.signs[1] * pose.at(self.second)
            return (abs(first), abs(second)) if self.absolute else (first, second)

        return numbers_of


_SIGN_HINT = "log the position as it is, without a change of sign"
_VARIANTS = (
    _Variant("swapped", Y, X, "x and y are swapped", _SWAP_HINT),
    _Variant("sign", X, Y, "the sign of x is inverted", _SIGN_HINT, (-1, 1)),
    _Variant("sign", X, Y, "the sign of y is inverted", _SIGN_HINT, (1, -1)),
    _Variant("sign", X, Y, "the signs of x and y are inverted", _SIGN_HINT, (-1, -1)),
    _Variant("sign", X, Y, "x and y have lost their signs", _SIGN_HINT, absolute=True),
    _Variant("twist", f"{_TWIST}.x", f"{_TWIST}.y", "the logged values are the linear velocity (twist), not the pose"),
    _Variant("twist", f"{_TWIST}.x", _TURN, "the logged values are the velocities (twist), not the pose"),
    _Variant("orientation", f"{_TURNED}.x", f"{_TURNED}.y", "the logged values are x and y of the orientation"),
    _Variant("orientation", f"{_TURNED}.z", f"{_TURNED}.w", "the logged values are z and w of the orientation"),
    _Variant("no_y", X, "pose.pose.position.z", "the second value fits z of the position, not y", _SWAP_HINT),
    _Variant("no_x", Y, "pose.pose.position.z", "the values fit y and z of the position, not x and y", _SWAP_HINT),
)
_SINGLES = (
    ("only_x", X, "only x is logged, y is missing", "log y too: msg.pose.pose.position.y"),
    ("only_y", Y, "only y is logged, x is missing", "log x too: msg.pose.pose.position.x"),
)


def cause_of(analysis: Analysis, track: Track) -> Cause:
    """Return the cause that explains what the texts show, or at least where they first differ."""
    if analysis.by_chance:
        return _chance(analysis)
    sampled = [_sample(g) for g in analysis.groups]
    if analysis.right and analysis.wrong:  # a position log most of the time, so it shows nothing else
        return _first_difference(analysis, track)
    likely = _few(analysis) or _constant(sampled, track)
    if likely is None:
        likely = _variant(sampled, track) or _single(sampled, track) or _stale(sampled, track)
    return likely or _first_difference(analysis, track)


def _chance(analysis: Analysis) -> Cause:
    numbers = sum(len(e.numbers) for g in analysis.groups for e in g.entries)
    text = f"{counted(numbers, 'number')} in {counted(len(analysis.groups), 'sentence')} of different wording, "
    return Cause("chance", f"{text}some of which show the position by chance", _POSITION_HINT)


def _sample(group: Group) -> Group:
    step = max(1, len(group.entries) // _SAMPLE)
    return Group(group.pairs, group.entries[::step], group.pair)


def _few(analysis: Analysis) -> Cause | None:
    times = {e.t_ns for e in analysis.right}
    if not times or analysis.wrong:
        return None
    first = moment(min(times))
    found = f"the position is logged only once, at {first}" if len(times) == 1 else f"only {len(times)} position logs"
    hint = "log repeatedly: from a timer or a throttled callback"
    return Cause("few", f"{found}, expected one every second", hint)


def _variant(groups: Sequence[Group], track: Track) -> Cause | None:
    for variant in _VARIANTS:
        wanted = variant.wanted()
        sure = next((g for g in groups if g.pairs and _sure(matched(g, track, wanted))), None)
        if sure is not None:
            late = [e for e in sure.entries if e.t_ns > track.times_ns[0] + STALE_NS] or sure.entries
            first = next((e for e in late if _differs(track.pose(track.current(e.t_ns).stop - 1), wanted)), late[0])
            return Cause(variant.name, f"{variant.sentence}: {_difference(first, track)}", variant.hint)
    return None


def _differs(pose: Pose, wanted: Wanted) -> bool:
    """Return whether somebody sees that what is logged is not the position."""
    first, second = wanted(pose)
    return max(abs(first - pose.at(X)), abs(second - pose.at(Y))) > _SEEN_M


def _sure(group: Group) -> bool:
    return group.right >= 2 and group.share >= _SURE


def _single(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return a cause if only x or only y is logged, in groups whose numbers never show the other."""
    for name, path, sentence, hint in _SINGLES:
        for group in groups:
            places = range(min(len(e.numbers) for e in group.entries))
            if len(group.entries) >= 2 and any(_follows(group, place, path, track) for place in places):
                return Cause(name, sentence, hint)
    return None


def _follows(group: Group, place: int, path: str, track: Track) -> bool:
    """Return whether the number at an index nearly always shows a changing value of the current pose."""
    shown = [any(e.numbers[place].shows(track.pose(k).at(path)) for k in track.current(e.t_ns)) for e in group.entries]
    changes = len({e.numbers[place].value for e in group.entries}) > 1
    return changes and sum(shown) >= _SURE * len(shown)


def _constant(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return a cause if the same pair is logged all the time although the robot moved."""
    if not track.moves:
        return None
    for group in groups:
        for pair in group.pairs[:1] if group.pair is None else (group.pair,):
            shown = [_shown(e, pair) for e in group.entries]
            if len(shown) >= 3 and len(set(shown)) == 1 and max(n.step for n in _pair(group.entries[0], pair)) < 1:
                return _constant_cause(group.entries[0], pair, track)
    return None


def _constant_cause(entry: Entry, pair: Pair, track: Track) -> Cause:
    first, second = _pair(entry, pair)
    start = track.pose(0)
    text = f"the logged values never change: ({number(first.value)}, {number(second.value)})"
    if first.shows(start.at(X)) and second.shows(start.at(Y)):
        hint = "store the newest message in the callback, each time"
        return Cause("first_value", f"{text}, the position of the first message", hint)
    if first.value == 0.0 and second.value == 0.0:
        return Cause("constant", text, "assign msg.pose.pose.position.x and .y to what you log, in the callback")
    return Cause("constant", text, "log the position of the newest message")


def _stale(groups: Sequence[Group], track: Track) -> Cause | None:
    """Return by how much the logged poses lag, if each of them was current at some time."""
    for group in groups:
        for pair in group.pairs[:_MOST_PAIRS]:
            lags = [_lag_ns(e, pair, track) for e in group.entries]
            known = [lag for lag in lags if lag is not None]
            fine = all(n.step <= 0.1 for e in group.entries for n in _pair(e, pair))
            if fine and len(known) >= max(3, _SURE * len(lags)) and statistics.median(known) > STALE_NS:
                late = span(round(statistics.median(known)))
                hint = "process messages as they arrive: a slow loop or a long queue delays them"
                return Cause("stale", f"the logged positions are {late} old", hint)
    return None


def _lag_ns(entry: Entry, pair: Pair, track: Track) -> int | None:
    first, second = _pair(entry, pair)
    for k in reversed(range(track.current(entry.t_ns).stop)):
        pose = track.pose(k)
        if first.shows(pose.at(X)) and second.shows(pose.at(Y)):
            return entry.t_ns - pose.t_ns
    return None


def _first_difference(analysis: Analysis, track: Track) -> Cause:
    if analysis.wrong:
        total = len(analysis.wrong) + len(analysis.right)
        return Cause("wrong", f"{_difference(analysis.wrong[0], track)}; {len(analysis.wrong)} of {total} are wrong")
    paired = max((g for g in analysis.groups if g.pairs), key=lambda g: len(g.entries), default=None)
    if paired is not None:
        return Cause("wrong", _difference(paired.entries[0], track), _POSITION_HINT)
    hint = "log both numbers in one record: f'x={x:.2f}, y={y:.2f}'"
    return Cause("no_pair", "no log holds two numbers" if analysis.groups else "no log holds a number", hint)


def _difference(entry: Entry, track: Track) -> str:
    pose = track.pose(track.current(entry.t_ns).stop - 1)
    return f"at {moment(entry.t_ns)} the log says '{quote(entry.text, 80)}', the position was {_exact(pose)}"


def _exact(pose: Pose) -> str:
    return f"({pose.at(X):.3f}, {pose.at(Y):.3f}) m"


def _pair(entry: Entry, pair: Pair) -> tuple[Printed, Printed]:
    return entry.numbers[pair[0]], entry.numbers[pair[1]]


def _shown(entry: Entry, pair: Pair) -> tuple[float, float]:
    first, second = _pair(entry, pair)
    return first.value, second.value


CHECKS = {"logs_position": LogsPosition, "log_period": LogPeriod}
