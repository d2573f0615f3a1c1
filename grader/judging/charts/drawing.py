"""Helpers for making charts."""

from __future__ import annotations

from collections.abc import Sequence

from grader.core.chart import Chart, Level, Look, Moment, Panel, Point, Series, Tone
from grader.core.quantities import seconds
from grader.core.trace import LogRecord, OutputLine, Trace
from grader.judging.texts import clean
from grader.judging.values import Reading
from grader.judging.wording import number, quote, unit_of

#: Maximum number of points of a series: a screen shows no more, and a flood must not enlarge the report.
MOST_POINTS = 1200
#: Maximum number of points with a text.
MOST_TEXTS = 400
_TEXT_LENGTH = 160


def series(  # noqa: PLR0913  what a series consists of
    name: str,
    points: Sequence[Point],
    *,
    look: Look = Look.LINE,
    tone: Tone = Tone.MAIN,
    texts: Sequence[str] = (),
    most: int = MOST_POINTS,
) -> Series:
    """Return a series reduced to a visible number of points; the extremes of each stretch stay."""
    most = min(most, MOST_TEXTS) if texts else most
    kept = kept_indices([y for _, y in points], most)
    said = tuple(quote(texts[k], _TEXT_LENGTH) for k in kept) if texts else ()
    return Series(name, tuple(points[k] for k in kept), look, tone, said)


def kept_indices(values: Sequence[float], most: int) -> list[int]:
    """Return about `most` indices of values, including the first, the last and the extremes of each stretch."""
    if len(values) <= most:
        return list(range(len(values)))
    stretch = -(-2 * len(values) // most)
    kept = {0, len(values) - 1}
    for start in range(0, len(values), stretch):
        part = range(start, min(start + stretch, len(values)))
        kept |= {min(part, key=values.__getitem__), max(part, key=values.__getitem__)}
    return sorted(kept)


def written_in_lane(name: str, items: Sequence[LogRecord | OutputLine], lane: int, tone: Tone) -> Series:
    """Return output as dots in a lane of its own, each with its text."""
    points = [(seconds(o.t_ns), float(lane)) for o in items]
    return series(name, points, look=Look.DOTS, tone=tone, texts=[clean(o.text) for o in items])


def happenings(trace: Trace) -> tuple[Moment, ...]:
    """Return the faults of a trace and the ends of its streams as moments."""
    found = [Moment(seconds(m.t_ns), f"{m.detail} begins") for m in trace.marks("stream_starts")]
    found += [Moment(seconds(m.t_ns), f"{m.detail} ends") for m in trace.marks("stream_stops")]
    faults = [f for f in trace.faults() if f.t_ns <= trace.stop_ns]
    found += [Moment(seconds(f.t_ns), f.kind.value.replace("_", " "), Tone.BAD) for f in faults[:_MOST_FAULTS]]
    return tuple(found)


_MOST_FAULTS = 5


def plain_topic(topic: str) -> str:
    """Return a topic's name as a title: `/fan_speed` becomes `fan speed`."""
    return quote(topic.strip("/").replace("/", " ").replace("_", " "), 40) or topic


def time_chart(id_: str, title: str, about: str, panels: tuple[Panel, ...], moments: tuple[Moment, ...]) -> Chart:
    """Return a chart over time."""
    return Chart(id_, title, about, (), "time", "s", panels, moments)


def input_panel(topic: str, values: Sequence[Reading], threshold: float, look: Look) -> Panel:
    """Return a panel with the inputs of a controller and its threshold."""
    level = Level(threshold, f"{number(threshold)}{unit_of(topic)}")
    name = plain_topic(topic)
    return Panel(name, unit_of(topic).strip(), (series(name, points_of(values), look=look),), levels=(level,))


def answer_panel(topic: str, answers: Sequence[Reading], expected: Series) -> Panel:
    """Return a panel with a controller's answers and the expected ones."""
    name = plain_topic(topic)
    dots = series(name, points_of(answers), look=Look.STEP, tone=Tone.SECOND)
    return Panel(name, unit_of(topic).strip(), (expected, dots))


def which_answers(answers: Sequence[Reading]) -> str:
    """Return which answers occur, for text."""
    values = sorted({r.value for r in answers})
    if not values:
        return ""
    said = ", ".join(number(v) for v in values[:5]) + (" and others" if len(values) > 5 else "")
    return f", all of them {said}" if len(values) == 1 else f" ({said})"


def points_of(values: Sequence[Reading]) -> list[Point]:
    """Return numbers as points over time, in seconds."""
    return [(seconds(r.t_ns), r.value) for r in values]
