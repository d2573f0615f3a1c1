"""Checks on logged positions: that they are right, how often they come, and what happens without odometry."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import pairwise
from typing import ClassVar

from grader.core.chart import Band, Chart, Look, Panel, Point, Series, Tone
from grader.core.dataclass import dataclass
from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Problem, ProblemKind, Roles
from grader.core.quantities import NS_PER_S, DurationNs, counted, seconds, within
from grader.core.trace import Fault, Trace
from grader.judging.charts import gaps_panel, series, time_chart
from grader.judging.facts import LogPaceFacts, WrongLogFacts
from grader.judging.findings import fault_hint, fault_sentence, faulted, first_fault, met, not_met, only_printed
from grader.judging.logs.outputs import printed_lines, student_records, written
from grader.judging.position_causes import cause_of
from grader.judging.position_logs import (
    Analysis,
    Track,
    X,
    Y,
    blocks,
    grouped,
    logged_positions,
    printed_positions,
    track_of,
)
from grader.judging.wording import moment, number, quote, span

_LOGGER_HINT = "write the position through the node's logger: self.get_logger().info(...)"
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
    a second before. Positions that are printed instead of logged give half the points.

    Attributes:
        process: File name of the student process.
        topic: Topic of the odometry.
    """

    roles: ClassVar[Roles] = Roles(logs=("topic",))
    process: str
    topic: str

    @property
    def expected(self) -> str:
        return f"{self.process} logs the x and y that {self.topic} had at that moment; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        track = _track(trace, self.process, self.topic)
        if isinstance(track, Finding):
            return track
        logged = logged_positions(trace, self.process, track)
        if self._shows(trace, logged):
            return met(self._right(logged), _evidence(logged))
        printed = printed_positions(trace, self.process, track)
        if self._shows(trace, printed):
            return only_printed(f"{self._right(printed)}, printed and not logged", _evidence(printed), _LOGGER_HINT)
        chosen = logged if logged.groups or not printed.groups else printed
        return self._explain(trace, track, chosen)

    def _shows(self, trace: Trace, found: Analysis) -> bool:
        """Return whether the position is logged; `log_period` judges how often, unless a fault cut it short."""
        lived = first_fault(trace, self.process) is None
        return found.met or (lived and bool(found.right) and not found.wrong)

    def _right(self, found: Analysis) -> str:
        first = found.right[0]
        reason = f"{self.process}: {counted(len(found.times_ns), 'position')} that agree with {self.topic}"
        return f"{reason}, the first at {moment(first.t_ns)}: {quote(first.text, 80)}"

    def _explain(self, trace: Trace, track: Track, found: Analysis) -> Finding:
        fault = first_fault(trace, self.process)
        if fault is not None and fault.t_ns < track.times_ns[0]:
            return _ended_early(fault)
        cause = cause_of(found, track)
        evidence, facts = _evidence(found) | {"cause": cause.name}, WrongLogFacts(cause.name, len(found.right), (X, Y))
        if fault is not None and cause.name in ("no_pair", "few"):
            return faulted(fault, cause.sentence if found.right else "no position was logged before it", evidence)
        if not found.groups and not any(o.t_ns >= track.times_ns[0] for o in written(trace, self.process)):
            during = span(track.stop_ns - track.start_ns)
            reason = f"{self.process}: nothing was logged while {self.topic} was played for {during}"
            silent = replace(facts, cause="nothing")
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

    The position logs are judged; if none is right, the most frequent log with a number.

    Attributes:
        process: File name of the student process.
        topic: Topic of the odometry.
        period: Average time expected from one log to the next.
        tolerance: Largest difference of the average, as a share of the period; the edge is inside.
    """

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
            "When positions were logged",
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
