"""Turns what a check measured into a share of the points, where a rubric has `full` and `none`; pure."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grader.grading.judging.charts import series
from grader.grading.model.chart import Level, Look, Panel
from grader.grading.model.exercise import Criterion, Finding, measure_of
from grader.grading.model.measures import MEASURED_KEY, Measure, Scale
from grader.grading.model.wording import first_few
from grader.runtime.model.quantities import seconds

#: Most numbers that the evidence repeats.
_MOST_NUMBERS = 20


def in_proportion(criterion: Criterion, finding: Finding) -> Finding:
    """Return the finding on one recording with the share of the points for its numbers; as it is without numbers."""
    measure, scale = measure_of(criterion.check), criterion.scale
    if measure is None or scale is None or not (readings := finding.readings):
        return finding
    values = [reading.value for reading in readings]
    value = scale.combined(values)
    which = "" if len(values) == 1 else f" ({_words(scale)} of {len(values)})"
    said = f"{measure.name} {_written(measure, scale, value)}{which}; {_limits(measure, scale)}"
    evidence = dict(finding.evidence) | {MEASURED_KEY: _told(measure, scale, value, values)}
    reason = f"{finding.reason}; {said}" if finding.reason else said
    return replace(finding, credit=scale.share(value), reason=reason, brief=said, evidence=evidence, measured=value)


def over_draws(criterion: Criterion, findings: Sequence[Finding]) -> tuple[int, Finding]:
    """Return the finding on all draws of a scenario, and the place of the draw that it shows: the first of the worst.

    Args:
        criterion: The criterion; without a scale, it is worth what its worst draw is.
        findings: One for each draw, with its share of the points.
    """
    place = min(range(len(findings)), key=lambda k: findings[k].credit)
    worst, total = findings[place], len(findings)
    where = f"draw {place + 1} of {total}"
    measure, scale = measure_of(criterion.check), criterion.scale
    # With no number at all, there is nothing to combine: the worst draw says why.
    if measure is None or scale is None or not any(finding.readings for finding in findings):
        return place, replace(worst, reason=worst.reason if worst.credit == 1 else f"{where}: {worst.reason}")
    # A draw without a number, such as one in which the program crashed, counts as `none`.
    values = [one.readings[0].value if one.readings else scale.none for one in findings]
    value = scale.combined(values)
    each = first_few([_written(measure, scale, one) for one in values], 6)
    said = f"{measure.name} {_written(measure, scale, value)}, {_words(scale)} of {total} draws ({each}); "
    said += _limits(measure, scale)
    share = scale.share(value)
    evidence = dict(worst.evidence) | {MEASURED_KEY: _told(measure, scale, value, values)}
    reason = said if share == 1 else f"{said}; {where}: {worst.reason}"
    return place, replace(worst, credit=share, reason=reason, brief=said, evidence=evidence, measured=value)


def measure_panel(measure: Measure, scale: Scale, finding: Finding) -> Panel | None:
    """Return a panel with the numbers that a check found in a recording and the limits; None if it found none."""
    readings = finding.readings
    if not readings:
        return None
    value = scale.combined([reading.value for reading in readings])
    levels = (Level(scale.full, "full points"), Level(scale.none, "no points"), Level(value, measure.written(value)))
    points = [(seconds(reading.t_ns), reading.value) for reading in readings]
    dots = (series(measure.name, points, look=Look.DOTS),) if len(readings) > 1 else ()
    return Panel(measure.name, measure.unit, dots, levels=levels)


def _words(scale: Scale) -> str:
    extreme = "the largest" if scale.less_is_better else "the smallest"
    return extreme if scale.combine == "worst" else f"the {scale.combine}"


def _written(measure: Measure, scale: Scale, value: float) -> str:
    """Return a combined number with its unit; one at `none` stands for all that are worse, which the words then say."""
    written = measure.written(value)
    if scale.share(value) > 0:
        return written
    return f"{written} or {'more' if scale.less_is_better else 'less'}"


def _limits(measure: Measure, scale: Scale) -> str:
    return f"full points for {measure.written(scale.full)}, none for {measure.written(scale.none)}"


def _told(measure: Measure, scale: Scale, value: float, values: Sequence[float]) -> dict[str, object]:
    return {
        "name": measure.name,
        "unit": measure.unit,
        "number": _rounded(value),
        "full": scale.full,
        "none": scale.none,
        "combine": scale.combine,
        "share": float(scale.share(value)),
        "count": len(values),
        # infinity and NaN are no JSON
        "numbers": [_rounded(scale.combined([one])) for one in values[:_MOST_NUMBERS]],
    }


def _rounded(value: float) -> float:
    """Return a number without the last bits of a float, which say nothing to a reader."""
    return float(f"{value:.9g}")
