"""Parts of charts over time: series of a bounded size, rows of dots, logs and service calls, moments and faults."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import field
from itertools import pairwise

from grader.grading.judging.logs.outputs import printed_lines
from grader.grading.judging.texts import clean
from grader.grading.model.chart import Band, Chart, Level, Look, Panel, Point, Series, Stretch, Tone, VerticalLine
from grader.grading.model.measures import Reading
from grader.grading.model.wording import first_few, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import seconds, within
from grader.runtime.model.trace import LogRecord, OutputLine, Request, Response, Trace, offered_as

#: Maximum number of points of a series: a screen shows no more, and a flood must not enlarge the report.
MOST_POINTS = 1200
#: Maximum number of points with a text.
MOST_TEXTS = 400
_TEXT_LENGTH = 160
#: Numbers beyond this are not drawn: the axis would show nothing else, and a browser cannot compute its ends.
_LARGEST = 1e100
_COMPLAINTS = ("WARN", "ERROR", "FATAL")
_TONES = {"DEBUG": Tone.FAINT, "INFO": Tone.MAIN, "WARN": Tone.WARNING, "ERROR": Tone.BAD, "FATAL": Tone.BAD}


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
    labels = tuple(quote(texts[k], _TEXT_LENGTH) for k in kept) if texts else ()
    return Series(name, tuple(_drawable(points[k]) for k in kept), look, tone, labels)


def _drawable(point: Point) -> Point:
    return point if -_LARGEST <= point[1] <= _LARGEST else (point[0], math.nan)


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


def points_of(values: Iterable[Reading]) -> list[Point]:
    """Return numbers as points over time, in seconds."""
    return [(seconds(r.t_ns), r.value) for r in values]


def expected_series(values: Sequence[Reading], look: Look = Look.STEP) -> Series:
    """Return the numbers that were expected, each from its time to that of the next unless another look is given."""
    return series("expected", points_of(values), look=look, tone=Tone.FAINT)


def compared_panels(
    title: str, compared: Sequence[tuple[int, float | None, float]], tolerance: float, where: str
) -> tuple[tuple[Panel, str], ...]:
    """Return a panel with numbers beside the expected ones, for `Drawing.panels`; none without numbers.

    Args:
        title: Title of the vertical axis.
        compared: For each number its time in nanoseconds, the number or None, and the expected one.
        tolerance: Largest difference of a right one.
        where: What the numbers are in, for the sentence.
    """
    if not compared:
        return ()
    rows = [expected_series([Reading(t_ns, wanted) for t_ns, _, wanted in compared])]
    read = [(t_ns, got, within(got, wanted, tolerance)) for t_ns, got, wanted in compared if got is not None]
    for name, tone, right in (("right", Tone.GOOD, True), ("wrong", Tone.BAD, False)):
        some = [(seconds(t_ns), got) for t_ns, got, fits in read if fits is right]
        rows += [series(name, some, look=Look.DOTS, tone=tone)] if some else []
    wrong = len(compared) - sum(fits for *_, fits in read)
    said = f"Numbers in {where}: {first_few([number(got) for _, got, _ in read], 6)}; {wrong} of {len(compared)} wrong."
    return ((Panel(title, "", tuple(rows)), said),)


def drawn_case(start_ns: int, stop_ns: int, label: str, tone: Tone = Tone.FAINT) -> Stretch:
    """Return one of the cases that a check distinguishes, for `Drawing.cases`: a marked stretch of time."""
    return Stretch(seconds(start_ns), seconds(stop_ns), label, tone)


#: What both sides of a call are named, by the sender of an observation.
SIDES = {"grader": "grader", "student": "student"}


@dataclass(slots=True)
class Lanes:
    """Rows of dots, from the top."""

    names: list[str] = field(default_factory=list)
    rows: list[Series] = field(default_factory=list)
    sides: Mapping[str, str] = field(default_factory=lambda: SIDES)  # what both sides of a call are named

    def add(self, name: str) -> None:
        """Begin another row."""
        self.names.append(name)

    def dots(self, name: str, events: Iterable[tuple[int, str]], tone: Tone = Tone.MAIN) -> None:
        """Put events into the last row, each with its time in nanoseconds and its text."""
        found = list(events)
        if found:
            lane = float(len(self.names) - 1)
            points, texts = [(seconds(t_ns), lane) for t_ns, _ in found], [text for _, text in found]
            shown = texts if any(texts) else ()
            self.rows.append(series(name, points, look=Look.DOTS, tone=tone, texts=shown))

    def write(self, name: str, output: Iterable[LogRecord | OutputLine], tone: Tone = Tone.MAIN) -> None:
        """Put output into the last row."""
        self.dots(name, ((o.t_ns, clean(o.text)) for o in output), tone)

    def logs(self, trace: Trace, process: str, *, apart: bool = False) -> None:
        """Add a row with what a process logged, and another one if it printed anything.

        Args:
            trace: What was recorded.
            process: File name of the student process.
            apart: Whether records of severity WARN or higher have a row of their own.
        """
        records = [r for r in trace.records(process) if r.t_ns <= trace.stop_ns]
        self.add(f"{process}: logged")
        for severity, tone in _TONES.items():
            some = [r for r in records if r.severity == severity]
            if apart and some and severity in _COMPLAINTS:
                self.add(f"{process}: {severity}")
            self.write(severity, some, tone)
        lines = printed_lines(trace, process)
        if lines:
            self.add(f"{process}: printed")
            self.write("printed", lines, Tone.SECOND)

    def exchanges(self, exchanges: Iterable[Request | Response]) -> None:
        """Put requests and responses into the last row, each with its content."""
        sent = list(exchanges)
        for name, kind, tone in (("request", Request, Tone.SECOND), ("response", Response, Tone.MAIN)):
            some = [o for o in sent if isinstance(o, kind)]
            told = ((o.t_ns, f"{name} {o.number} of the {self.sides[o.sender]}: {dict(o.value)}") for o in some)
            self.dots(name, told, tone)

    def panel(self, title: str = "") -> Panel:
        """Return the rows as a panel."""
        return Panel(title, "", tuple(self.rows), lanes=tuple(self.names))


def gaps_panel(
    title: str, times_ns: Sequence[int], *, bands: Sequence[Band] = (), levels: Sequence[Level] = (), unit: str = "s"
) -> Panel:
    """Return the time from each event to the next, in seconds or milliseconds."""
    scale = 1e-6 if unit == "ms" else 1e-9
    points = [(seconds(b), (b - a) * scale) for a, b in pairwise(times_ns)]
    dots = series(f"since the previous {title}", points, look=Look.DOTS, tone=Tone.SECOND)
    return Panel("interval", unit, (dots,), tuple(bands), tuple(levels))


#: Name of a mark -> what follows its detail in charts.
_SAID_OF_MARKS = {
    "stream_starts": " begins",
    "stream_stops": " ends",
    "server_starts": ": server appears",
    "server_stops": ": server disappears",
    "process_starts": " starts",
    "exited": " ends",
}
#: Maximum number of faults, and of cases, that a chart shows.
_MOST_FAULTS, MOST_CASES = 5, 60


def marked_moments(trace: Trace) -> list[VerticalLine]:
    """Return when streams, servers and processes began and ended; of an action it is its server that takes goals."""
    marks = [(m, said) for name, said in _SAID_OF_MARKS.items() for m in trace.marks(name)]
    told = [(m, offered_as(m.detail), said) for m, said in marks]
    return [VerticalLine(seconds(m.t_ns), f"{offered[1]}{said}") for m, offered, said in told if offered]


def time_chart(trace: Trace, id_: str, title: str, about: str, *panels: Panel, cases: Sequence[Stretch] = ()) -> Chart:
    """Return a chart over time, with what began and ended in a trace, and its faults."""
    faults = [f for f in trace.faults() if f.t_ns <= trace.stop_ns]
    moments = marked_moments(trace)
    moments += [VerticalLine(seconds(f.t_ns), f.kind.value.replace("_", " "), Tone.BAD) for f in faults[:_MOST_FAULTS]]
    shown, until_s = tuple(cases[:MOST_CASES]), seconds(trace.stop_ns)
    return Chart(id_, title, about, (), "time", "s", panels, tuple(moments), shown, until_s=until_s)
