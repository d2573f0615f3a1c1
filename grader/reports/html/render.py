"""The report as HTML: one page, rendered from a template that escapes everything it is given."""

from __future__ import annotations

from collections.abc import Iterable
from fractions import Fraction
from functools import cache

from jinja2 import Environment
from markupsafe import Markup

from grader.model.exercise import Location, Outcome, exercise_name
from grader.model.figure import Excerpt, Figure
from grader.model.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.model.trace import ClockKind
from grader.reports import wording
from grader.reports.escape import script_json, shown
from grader.reports.html.bundle import bundle
from grader.reports.html.environment import page_environment
from grader.reports.html.payload import figure_values

_CIRCUMFERENCE = 100
_LINE_LIMIT = 160


def render_html(report: Report, *, assets: str | None = None) -> str:
    """Return a report as an HTML page that loads nothing from anywhere.

    Args:
        report: What is shown; all its text is taken for hostile.
        assets: Where the page finds the files of `shared_assets`, relative to itself, e.g. `../assets`; None puts them
            into the page, which then stands alone.
    """
    page = _templates().get_template("report.html")
    figures = {figure.id: figure_values(figure) for e in report.exercises for figure in e.figures}
    return page.render(
        report=report,
        bundle=bundle(),
        assets=assets,
        figures=Markup(script_json(figures)),  # noqa: S704  the function exists to make it safe in a script element
        embedded=Markup,
        clock_wall=ClockKind.WALL,
        command=" ".join(wording.command(report)),
    )


@cache
def _templates() -> Environment:
    templates = page_environment("grader.reports.html")
    templates.filters["exercise_name"] = exercise_name
    templates.globals |= {
        "wording": wording,
        "outcome_word": _outcome_word,
        "open_at_first": _open_at_first,
        "percent": _percent,
        "excerpt_at": _excerpt_at,
        "excerpts_left": _excerpts_left,
        "figures_for": _figures_for,
        "code_line": _code_line,
        "segments": _segments,
    }
    return templates


def _outcome_word(outcome: Outcome) -> str:
    return wording.OUTCOME_WORDS[outcome]


def _open_at_first(verdict: Verdict) -> bool:
    """Return whether a criterion is shown unfolded: what cost points is what people look for."""
    return verdict.outcome in (Outcome.NOT_MET, Outcome.PARTLY, Outcome.UNDECIDED)


def _percent(score: Fraction, max_score: Fraction) -> float:
    return round(float(_CIRCUMFERENCE * score / max_score), 2) if max_score else 0.0


def _excerpt_at(exercise: ExerciseReport, place: Location | None) -> Excerpt | None:
    if place is None:
        return None
    return next((e for e in exercise.excerpts if (e.file, e.line) == (place.file, place.line)), None)


def _excerpts_left(exercise: ExerciseReport, fault: ReportedFault) -> list[Excerpt]:
    """Return the source around a fault, unless a criterion shows it already."""
    shown_above = {verdict.location for verdict in exercise.verdicts}
    place = Location(fault.file, fault.line)
    excerpt = _excerpt_at(exercise, place)
    return [excerpt] if excerpt and place not in shown_above else []


def _figures_for(exercise: ExerciseReport, criterion: str) -> list[Figure]:
    return [figure for figure in exercise.figures if criterion in figure.criteria]


def _code_line(line: str) -> str:
    return shown(line, limit=_LINE_LIMIT)


def _segments(verdicts: Iterable[Verdict]) -> list[tuple[float, float, str]]:
    """Return where each criterion begins on a strip as long as all their points, how long it is, and its outcome."""
    parts, start = [], Fraction(0)
    for verdict in verdicts:
        parts.append((float(start), float(verdict.max_score), verdict.outcome.value))
        start += verdict.max_score
    return parts
