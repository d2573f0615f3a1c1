"""Draws how often a topic was published: the intervals, and the rate over time with the accepted band."""

from __future__ import annotations

from bisect import bisect_left
from collections.abc import Sequence
from itertools import pairwise

from grader.core.chart import Band, Chart, Level, Look, Panel, Point, Tone
from grader.core.quantities import NS_PER_MS, NS_PER_S, seconds
from grader.core.trace import Trace
from grader.judging.checks.rate import TopicRate
from grader.judging.figures.drawing import happenings, series
from grader.judging.values import published
from grader.judging.wording import counted, number

#: The rate at a moment is that of so much time before it, or of so many periods if they are longer.
_TRAILING_NS = NS_PER_S
_TRAILING_PERIODS = 4


def rate_chart(check: TopicRate, trace: Trace) -> Chart | None:
    """Return the picture of a rate, or None if fewer than two messages came."""
    times = sorted(m.t_ns for m in published(trace, check.topic))
    if len(times) < 2 or times[0] == times[-1]:
        return None
    inside = [t for t in times if check.window is None or t < times[0] + check.window]
    return Chart(
        id=f"rate {check.topic}",
        title=f"How often {check.topic} came",
        about=_about(check, inside),
        criteria=(),
        x_title="time",
        x_unit="s",
        panels=(_rate_panel(check, times), _interval_panel(check, times)),
        moments=happenings(trace),
    )


def _rate_panel(check: TopicRate, times: Sequence[int]) -> Panel:
    bands = [_band(check.rate, check.tolerance, "full points", Tone.GOOD)]
    if check.partly_tolerance is not None:
        bands.insert(0, _band(check.rate, check.partly_tolerance, "half the points", Tone.WARNING))
    points = _rates(times, max(_TRAILING_NS, round(_TRAILING_PERIODS * NS_PER_S / check.rate)))
    return Panel("rate over the last second", "Hz", (series("rate", points),), tuple(bands))


def _interval_panel(check: TopicRate, times: Sequence[int]) -> Panel:
    points = [(seconds(b), (b - a) / NS_PER_MS) for a, b in pairwise(times)]
    expected = Level(1000 / check.rate, f"{number(1000 / check.rate)} ms")
    dots = series("interval since the message before", points, look=Look.DOTS, tone=Tone.SECOND)
    return Panel("interval", "ms", (dots,), levels=(expected,))


def _band(rate: float, tolerance: float, label: str, tone: Tone) -> Band:
    return Band(rate - tolerance, rate + tolerance, f"{number(rate)} ± {number(tolerance)} Hz: {label}", tone)


def _rates(times: Sequence[int], trailing_ns: int) -> list[Point]:
    """Return the rate over the time before each message, once that much time has passed."""
    points = []
    for k, t in enumerate(times):
        first = bisect_left(times, t - trailing_ns)
        whole = t - times[0] >= trailing_ns or k == len(times) - 1
        if whole and t > times[first]:
            points.append((seconds(t), (k - first) * NS_PER_S / (t - times[first])))
    return points


def _about(check: TopicRate, times: Sequence[int]) -> str:
    gaps = [(b - a) / NS_PER_MS for a, b in pairwise(times)]
    if len(times) < 2 or times[-1] == times[0]:
        return f"{counted(len(times), 'message')} on {check.topic} in the window."
    average = (len(times) - 1) * NS_PER_S / (times[-1] - times[0])
    span_s = seconds(times[-1] - times[0])
    return (
        f"{counted(len(times), 'message')} on {check.topic} within {span_s:.1f} s, at {average:.3f} Hz on average; "
        f"single intervals from {min(gaps):.1f} to {max(gaps):.1f} ms. Accepted: {number(check.rate)} ± "
        f"{number(check.tolerance)} Hz over the whole window, not interval by interval."
    )
