"""The figures of an exercise: MAKERS is the table of which check is drawn how."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import replace
from types import MappingProxyType
from typing import Any

from grader.core.chart import Chart, Figure
from grader.core.exercise import Criterion, Exercise
from grader.core.report import ExerciseReport
from grader.core.submission import Submission
from grader.core.trace import Trace
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.graph import BidirectionalGraph
from grader.judging.checks.odometry import LogPeriod, LogsPosition
from grader.judging.checks.rate import TopicRate
from grader.judging.checks.sensor import LogsReceived, RandomInRange
from grader.judging.checks.together import AnswersTogether
from grader.judging.checks.topics import FieldValues
from grader.judging.figures.excerpts import excerpts_for
from grader.judging.figures.expectations import expectation
from grader.judging.figures.fields import field_chart
from grader.judging.figures.graphs import graph_figure
from grader.judging.figures.numbers import range_chart, received_chart, response_chart, together_chart
from grader.judging.figures.positions import path_chart, period_chart
from grader.judging.figures.rates import rate_chart
from grader.judging.figures.timeline import timeline_chart

#: Check -> what draws it from a trace; a check that is not here is told in words only.
MAKERS: Mapping[type, Callable[[Any, Trace], Chart | None]] = MappingProxyType(
    {
        TopicRate: rate_chart,
        FieldValues: field_chart,
        LogsPosition: path_chart,
        LogPeriod: period_chart,
        RandomInRange: range_chart,
        LogsReceived: received_chart,
        ThresholdResponse: response_chart,
        AnswersTogether: together_chart,
    }
)


def illustrated(
    report: ExerciseReport,
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str],
) -> ExerciseReport:
    """Return the report with what a reader wants to look at: figures, lines of the source, and what was expected.

    Args:
        report: What judging came to.
        exercise: What was asked.
        traces: Scenario id -> what was recorded.
        submission: Says which files were found.
        sources: Wanted file name -> its text.
    """
    return replace(
        report,
        figures=figures_of(exercise, traces),
        excerpts=excerpts_for(report, submission, sources),
        expected={c.id: phrase for c in exercise.criteria if (phrase := expectation(c.check))},
    )


def figures_of(exercise: Exercise, traces: Mapping[str, Trace]) -> tuple[Figure, ...]:
    """Return the pictures of an exercise in rubric order, then the graph, then a timeline of each scenario."""
    drawn = [chart for c in exercise.criteria for chart in _drawn(c, traces)]
    figures: list[Figure] = list(_merged(drawn))
    graph = graph_figure(exercise, traces)
    if graph is not None:
        graphs = tuple(c.id for c in exercise.criteria if isinstance(c.check, BidirectionalGraph))
        figures.append(replace(graph, criteria=graphs))
    figures += _timelines(exercise, traces)
    return tuple(replace(f, id=f"{exercise.id}-{number}") for number, f in enumerate(figures, 1))


def _drawn(criterion: Criterion, traces: Mapping[str, Trace]) -> Iterable[Chart]:
    maker, trace = MAKERS.get(type(criterion.check)), traces.get(criterion.scenario)
    try:
        chart = maker(criterion.check, trace) if maker and trace else None
    except Exception:  # a picture that cannot be drawn must not cost the report that it would be in
        chart = None
    if chart is not None:
        yield replace(chart, id=f"{criterion.scenario} {chart.id}", criteria=(criterion.id,))


def _merged(charts: Iterable[Chart]) -> Iterable[Chart]:
    """Join charts of one id: two questions about the same thing make one picture."""
    joined: dict[str, Chart] = {}
    for chart in charts:
        other = joined.get(chart.id)
        joined[chart.id] = chart if other is None else _joined(other, chart)
    return joined.values()


def _joined(one: Chart, other: Chart) -> Chart:
    return replace(
        one,
        about=" ".join(dict.fromkeys((one.about, other.about))),
        criteria=tuple(dict.fromkeys((*one.criteria, *other.criteria))),
        panels=tuple(dict.fromkeys((*one.panels, *other.panels))),
    )


def _timelines(exercise: Exercise, traces: Mapping[str, Trace]) -> Sequence[Chart]:
    recorded = [s for s in exercise.scenarios if s.id in traces]
    charts = []
    for scenario in recorded:
        chart = timeline_chart(traces[scenario.id], scenario.processes)
        title = f"{chart.title}: {scenario.id.replace('_', ' ')}" if len(recorded) > 1 else chart.title
        charts.append(replace(chart, title=title))
    return charts
