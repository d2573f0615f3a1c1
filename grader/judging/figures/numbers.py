"""Draws numbers on topics: drawn ones in their range, and answers under what they answer."""

from __future__ import annotations

from collections.abc import Sequence

from grader.core.chart import Band, Chart, Level, Look, Moment, Panel, Point, Series, Tone
from grader.core.quantities import seconds
from grader.core.trace import Trace
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.sensor import LogsReceived, RandomInRange
from grader.judging.checks.together import AnswersTogether
from grader.judging.figures.drawing import happenings, plain_topic, series, written_in_lane
from grader.judging.output import printed_lines, student_records
from grader.judging.values import Reading, delivered_numbers, held, published_numbers
from grader.judging.wording import counted, number, unit_of


def range_chart(check: RandomInRange, trace: Trace) -> Chart | None:
    """Return the numbers on a topic in the range that they may come from, or None without numbers."""
    values = published_numbers(trace, check.topic)
    if not values:
        return None
    unit = unit_of(check.topic).strip()
    got = [r.value for r in values]
    outside = sum(not check.low <= v <= check.high for v in got)
    about = f"{counted(len(got), 'value')} on {check.topic} from {number(min(got))} to {number(max(got))}"
    about += f"{unit_of(check.topic)}, {len(set(got))} of them different; {outside or 'none'} outside "
    label = f"{number(check.low)} to {number(check.high)}{unit_of(check.topic)}"
    dots = series(plain_topic(check.topic), _points(values), look=Look.LINE)
    band = Band(check.low, check.high, f"{label}: accepted")
    return _chart(
        f"range {check.topic}",
        f"Values on {check.topic}",
        f"{about}{label}.",
        (Panel(plain_topic(check.topic), unit, (dots,), bands=(band,)),),
        happenings(trace),
    )


def response_chart(check: ThresholdResponse, trace: Trace) -> Chart | None:
    """Return the numbers given to a controller and its answers under them, or None if nothing was given."""
    sent = delivered_numbers(trace, check.input)
    answers = published_numbers(trace, check.output)
    if not sent:
        return None
    asked = held(trace, check.input)
    expected = [Reading(h.start_ns, check.above if h.value > check.threshold else check.otherwise) for h in asked]
    expected += [Reading(trace.stop_ns, expected[-1].value)]
    about = f"{counted(len(asked), 'value')} on {check.input}, each held for a while "
    about += f"({', '.join(number(h.value) for h in asked)}{unit_of(check.input)}); "
    about += f"{counted(len(answers), 'answer')} on {check.output}{_which(answers)}."
    upper = _input_panel(check.input, sent, check.threshold, Look.STEP)
    lower = _answer_panel(check.output, answers, series("expected", _points(expected), look=Look.STEP, tone=Tone.FAINT))
    title = f"Answers on {check.output} to {check.input}"
    return _chart(f"response {check.input}", title, about, (upper, lower), happenings(trace))


def together_chart(check: AnswersTogether, trace: Trace) -> Chart | None:
    """Return what the student's two nodes said to each other, or None if the first was silent."""
    inputs = published_numbers(trace, check.input)
    answers = published_numbers(trace, check.output)
    if not inputs:
        return None
    above = sum(r.value > check.threshold for r in inputs)
    wanted = [Reading(r.t_ns, check.above if r.value > check.threshold else check.otherwise) for r in inputs]
    about = f"{counted(len(inputs), 'value')} on {check.input}, {above} above {number(check.threshold)}"
    about += f"{unit_of(check.input)}; {counted(len(answers), 'answer')} on {check.output}{_which(answers)}."
    upper = _input_panel(check.input, inputs, check.threshold, Look.LINE)
    lower = _answer_panel(check.output, answers, series("expected", _points(wanted), look=Look.STEP, tone=Tone.FAINT))
    title = f"{plain_topic(check.input).capitalize()} and {plain_topic(check.output)}, both nodes together"
    return _chart(f"together {check.input}", title, about, (upper, lower), happenings(trace))


def received_chart(check: LogsReceived, trace: Trace) -> Chart | None:
    """Return the numbers given to a node and what it wrote meanwhile, or None if nothing was given."""
    sent = delivered_numbers(trace, check.topic)
    if not sent:
        return None
    records, lines = student_records(trace, check.process), printed_lines(trace, check.process)
    lanes = ["logged"] + (["printed"] if lines else [])
    rows = [written_in_lane("log record", records, 0, Tone.SECOND)]
    rows += [written_in_lane("printed line", lines, 1, Tone.WARNING)] if lines else []
    given = series(f"published on {check.topic}", _points(sent), look=Look.STEP)
    distinct = list(dict.fromkeys(number(r.value) for r in sent))
    about = f"{counted(len(sent), 'message')} on {check.topic} ({', '.join(distinct[:8])}); meanwhile "
    about += f"{counted(len(records), 'log record')} and {counted(len(lines), 'printed line')}."
    return _chart(
        f"received {check.topic}",
        f"What came on {check.topic} and what was logged",
        about,
        (
            Panel(plain_topic(check.topic), unit_of(check.topic).strip(), (given,)),
            Panel("written", "", tuple(rows), lanes=tuple(lanes)),
        ),
        happenings(trace),
    )


def _chart(id_: str, title: str, about: str, panels: tuple[Panel, ...], moments: tuple[Moment, ...]) -> Chart:
    return Chart(id_, title, about, (), "time", "s", panels, moments)


def _input_panel(topic: str, values: Sequence[Reading], threshold: float, look: Look) -> Panel:
    level = Level(threshold, f"{number(threshold)}{unit_of(topic)}")
    name = plain_topic(topic)
    return Panel(name, unit_of(topic).strip(), (series(name, _points(values), look=look),), levels=(level,))


def _answer_panel(topic: str, answers: Sequence[Reading], expected: Series) -> Panel:
    name = plain_topic(topic)
    dots = series(name, _points(answers), look=Look.STEP, tone=Tone.SECOND)
    return Panel(name, unit_of(topic).strip(), (expected, dots))


def _which(answers: Sequence[Reading]) -> str:
    values = sorted({r.value for r in answers})
    if not values:
        return ""
    said = ", ".join(number(v) for v in values[:5]) + (" and others" if len(values) > 5 else "")
    return f", all of them {said}" if len(values) == 1 else f" ({said})"


def _points(values: Sequence[Reading]) -> list[Point]:
    return [(seconds(r.t_ns), r.value) for r in values]
