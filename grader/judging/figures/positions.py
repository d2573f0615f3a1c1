"""Draws the odometry that was played, the positions that were logged on it, and when they were logged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

from grader.core.chart import Band, Chart, Look, Panel, Point, Series, Tone
from grader.core.quantities import NS_PER_S, seconds
from grader.core.trace import Trace
from grader.judging.checks.odometry import LogPeriod, LogsPosition
from grader.judging.figures.drawing import happenings, series
from grader.judging.positions.analysis import Analysis, logged_positions, printed_positions
from grader.judging.positions.track import Track, X, Y, track_of
from grader.judging.wording import counted, moment, number, span

#: A logged pair further away than this many sizes of the path is told, not drawn: it would shrink the path to a dot.
_FAR = 2.0


@dataclass(frozen=True, slots=True)
class _Logged:
    """A pair of numbers that was logged as a position."""

    point: Point
    text: str
    right: bool


def path_chart(check: LogsPosition, trace: Trace) -> Chart | None:
    """Return the path that was driven with the logged positions on it, or None if nothing was played."""
    track = track_of(trace, check.topic)
    if track is None:
        return None
    logged = logged_positions(trace, check.process, track)
    printed = Analysis() if logged.right else printed_positions(trace, check.process, track)
    pairs = _pairs(printed if printed.right else logged)
    shown = [pair for pair in pairs if _near(pair.point, track)]
    poses = track.poses
    path = [(p.x, p.y) for p in poses]
    lines = [series(f"path on {check.topic}", path, tone=Tone.FAINT, texts=[moment(p.t_ns) for p in poses])]
    lines += _dots("logged, agrees", [p for p in shown if p.right], Tone.GOOD)
    lines += _dots("logged, does not agree", [p for p in shown if not p.right], Tone.BAD)
    return Chart(
        id=f"path {check.topic}",
        title=f"The path on {check.topic} and the logged positions",
        about=_about(check.topic, track, pairs, len(pairs) - len(shown)),
        criteria=(),
        x_title="x",
        x_unit="m",
        panels=(Panel("y", "m", tuple(lines)),),
        square=True,
    )


def period_chart(check: LogPeriod, trace: Trace) -> Chart | None:
    """Return when positions were logged, against the grid of the period; None if there was nothing to log."""
    track = track_of(trace, check.topic)
    if track is None:
        return None
    times = check.log_times(trace, track)
    if not times:
        return None
    period_s = seconds(check.period)
    dots = series("log", [(seconds(t), 0.0) for t in times], look=Look.DOTS)
    gaps = series("since the log before", [(seconds(b), seconds(b - a)) for a, b in pairwise(times)], look=Look.DOTS)
    share = check.tolerance * period_s
    label = f"{number(period_s)} s ± {number(100 * check.tolerance)} % on average"
    return Chart(
        id=f"period {check.topic}",
        title="When positions were logged",
        about=_when(times, check),
        criteria=(),
        x_title="time",
        x_unit="s",
        panels=(
            Panel("logs", "", (dots,), lanes=("log",), grid=(seconds(times[0]), period_s)),
            Panel("interval", "s", (gaps,), bands=(Band(period_s - share, period_s + share, label),)),
        ),
        moments=happenings(trace),
    )


def _pairs(found: Analysis) -> list[_Logged]:
    """Return the pairs of the templates that hold positions; where none does, of the commonest with two numbers."""
    right = [g for g in found.groups if g.pair is not None and g.right]
    rest = [g for g in found.groups if g.pair is not None]
    chosen = right or sorted(rest, key=lambda g: -len(g.entries))[:1]
    return [
        _Logged((e.numbers[g.pair[0]].value, e.numbers[g.pair[1]].value), f"{moment(e.t_ns)}: {e.text}", e.right)
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


def _dots(name: str, pairs: Sequence[_Logged], tone: Tone) -> list[Series]:
    if not pairs:
        return []
    return [series(name, [p.point for p in pairs], look=Look.DOTS, tone=tone, texts=[p.text for p in pairs])]


def _about(topic: str, track: Track, pairs: Sequence[_Logged], hidden: int) -> str:
    right = sum(p.right for p in pairs)
    first, last = track.pose(0), track.pose(len(track.deliveries) - 1)
    said = f"{topic} was played for {span(track.stop_ns - track.start_ns)}, from {_place(first.at(X), first.at(Y))} to "
    said += f"{_place(last.at(X), last.at(Y))}. "
    if not pairs:
        return f"{said}No pair of numbers was logged."
    said += f"{right} of {counted(len(pairs), 'logged pair')} of numbers agree with it."
    return f"{said} {hidden} too far away to be drawn." if hidden else said


def _place(x: float, y: float) -> str:
    return f"({x:.2f}, {y:.2f}) m"


def _when(times: Sequence[int], check: LogPeriod) -> str:
    wanted = f"Expected: one every {number(seconds(check.period))} s ± {number(100 * check.tolerance)} % on average."
    if len(times) < 2:
        return f"One log, at {moment(times[0])}. {wanted}"
    average = (times[-1] - times[0]) / (len(times) - 1) / NS_PER_S
    gaps = [seconds(b - a) for a, b in pairwise(times)]
    return (
        f"{len(times)} logs from {moment(times[0])} to {moment(times[-1])}, one every {average:.3f} s on average, "
        f"intervals from {min(gaps):.3f} to {max(gaps):.3f} s. The grid starts at the first log. {wanted}"
    )
