"""Small tools that the makers of figures share."""

from __future__ import annotations

from collections.abc import Sequence

from grader.core.chart import Look, Moment, Point, Series, Tone
from grader.core.quantities import seconds
from grader.core.trace import LogRecord, OutputLine, Trace
from grader.judging.positions.numbers import clean
from grader.judging.wording import quote

#: Most points of a series: more than a screen has columns are not seen, and a flood must not swell a report.
MOST_POINTS = 1200
#: Most points that carry a text.
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
    """Return a series with no more points than can be seen; the extremes of each stretch stay."""
    most = min(most, MOST_TEXTS) if texts else most
    kept = kept_indices([y for _, y in points], most)
    said = tuple(quote(texts[k], _TEXT_LENGTH) for k in kept) if texts else ()
    return Series(name, tuple(points[k] for k in kept), look, tone, said)


def kept_indices(values: Sequence[float], most: int) -> list[int]:
    """Return the indices of at most about `most` values, first, last and the extremes of each stretch among them."""
    if len(values) <= most:
        return list(range(len(values)))
    stretch = -(-2 * len(values) // most)
    kept = {0, len(values) - 1}
    for start in range(0, len(values), stretch):
        part = range(start, min(start + stretch, len(values)))
        kept |= {min(part, key=values.__getitem__), max(part, key=values.__getitem__)}
    return sorted(kept)


def written_in_lane(name: str, items: Sequence[LogRecord | OutputLine], lane: int, tone: Tone) -> Series:
    """Return what was written as dots in a row of its own, each with its text."""
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
    """Return a topic's name as a title: `/fan_speed` is `fan speed`."""
    return quote(topic.strip("/").replace("/", " ").replace("_", " "), 40) or topic
