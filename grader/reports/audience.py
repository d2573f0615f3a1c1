"""A report as its reader may see it: what a rubric withholds from students is taken out before rendering."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from grader.model.exercise import Location, Outcome
from grader.model.feedback import DUE_DATE, OPEN, PUBLISHED, Shows, strictest
from grader.model.figure import Chart, Excerpt, Figure
from grader.model.report import NOT_JUDGED, ExerciseReport, Report, ReportedFault, Reproduction, Verdict
from grader.model.variant import variant_notes
from grader.reports.readers import Readers
from grader.reports.wording import points
from grader.reports.wordless import without_numbers

_WHEN = {DUE_DATE: " before the due date", PUBLISHED: " before grades are published"}
_HIDDEN = "a criterion that is not shown"
_OUTCOME_ONLY = "the reason is not shown"
_LEFT_OUT = "pictures, the graph and whatever else would show more than the criteria do are left out"
_CLOCK = "the reason is not shown"


def told(report: Report, readers: Readers) -> Report:
    """Return what a run may tell besides its reports, such as scores on a line or an exit code."""
    return for_student(report, readers.day) if readers.only_students else report


def withholds(report: Report, day: str) -> bool:
    """Return whether the rubric keeps anything of a report from a student on a day."""
    return any(_strictest(exercise, day) is not Shows.ALL for exercise in report.exercises)


def for_student(report: Report, day: str) -> Report:
    """Return a report without what its rubrics withhold from a student on a day.

    A criterion that is not shown counts in no sum: a score with it would tell what it came to. Where anything is left
    out, so is what would give the whole report again.
    """
    if not withholds(report, day):
        return report
    exercises = [_exercise(exercise, day) for exercise in report.exercises]
    kept = tuple(exercise for exercise in exercises if exercise.verdicts)
    ids = {exercise.id for exercise in kept}
    unshown = [
        f"exercise {exercise.number} is not shown: {note}"
        for index, exercise in enumerate(exercises)
        if not exercise.verdicts
        for note in _unshown(report.exercises[index], day)
    ]
    return replace(
        report,
        exercises=kept,
        seed=None,
        notes=(*report.notes, *unshown),
        reproduce=Reproduction(),
        pending=tuple(id_ for id_ in report.pending if id_ in ids),
    )


def shows(exercise: ExerciseReport, criterion: str, day: str) -> Shows:
    """Return how much of a criterion's result a student sees on a day."""
    return exercise.feedback.get(criterion, OPEN).on(day)


def _strictest(exercise: ExerciseReport, day: str) -> Shows:
    return strictest(tuple(shows(exercise, verdict.id, day) for verdict in exercise.verdicts))


def _exercise(exercise: ExerciseReport, day: str) -> ExerciseReport:
    shown = {verdict.id: shows(exercise, verdict.id, day) for verdict in exercise.verdicts}
    worst = strictest(tuple(shown.values()))
    if worst is Shows.ALL:
        return exercise
    verdicts = tuple(_verdict(v, shown) for v in exercise.verdicts if shown[v.id] is not Shows.NOTHING)
    faults = _faults(exercise, shown)
    return replace(
        exercise,
        clock_reason=_said(exercise.clock_reason, worst, otherwise=_CLOCK),
        verdicts=verdicts,
        faults=faults,
        notes=(*variant_notes(exercise.variant), *_unshown(exercise, day), *_notes(exercise, worst), _LEFT_OUT),
        graph=None,
        figures=tuple(figure for figure in exercise.figures if _is_open(figure, exercise, shown)),
        excerpts=_excerpts(exercise, verdicts, faults, shown),
        expected={id_: text for id_, text in exercise.expected.items() if shown.get(id_) is Shows.ALL},
    )


def _verdict(verdict: Verdict, shown: Mapping[str, Shows]) -> Verdict:
    """Return a verdict with as much as is shown of it; a criterion that is not shown has no name either."""
    if shown[verdict.id] is Shows.OUTCOME:
        return replace(
            verdict, reason=_OUTCOME_ONLY, hint="", location=None, evidence={}, blocked_by="", same_cause_as=""
        )
    verdict = _without_hidden(verdict, shown)
    if shown[verdict.id] is Shows.ALL:
        return verdict
    # What is not judged has no numbers of its own, and the ids in it have to stay what they are.
    said = verdict.reason if verdict.outcome is Outcome.BLOCKED else without_numbers(verdict.reason)
    return replace(verdict, reason=said, hint=_hint(verdict.hint), evidence={})


def _without_hidden(verdict: Verdict, shown: Mapping[str, Shows]) -> Verdict:
    """Return a verdict that names no criterion that is not shown; a missing file may be named."""
    if shown.get(verdict.blocked_by) is Shows.NOTHING:
        reason = verdict.reason if verdict.missing_file else f"{NOT_JUDGED}needs {_HIDDEN}"
        verdict = replace(verdict, reason=reason, blocked_by="")
    if shown.get(verdict.same_cause_as) is Shows.NOTHING:
        verdict = replace(verdict, hint=f"this has the same cause as {_HIDDEN}", same_cause_as="")
    return verdict


def _hint(hint: str) -> str:
    """Return the parts of a hint that get along without numbers: most others would give the answer away."""
    return "; ".join(part for part in hint.split("; ") if without_numbers(part) == part)


def _said(text: str, worst: Shows, *, otherwise: str) -> str:
    """Return text of an exercise as a whole, fit for the closest of its criteria."""
    if not text:
        return ""
    return without_numbers(text) if worst is Shows.WITHOUT_NUMBERS else otherwise


def _notes(exercise: ExerciseReport, worst: Shows) -> list[str]:
    """Return the notes of the run; the variant is no secret, for it is on the student's own task sheet."""
    notes = [note for note in exercise.notes if note not in variant_notes(exercise.variant)]
    return [without_numbers(note) for note in notes] if worst is Shows.WITHOUT_NUMBERS else []


def _unshown(exercise: ExerciseReport, day: str) -> list[str]:
    """Return how many criteria are not shown at all, by the time until which that is so."""
    found: dict[str, list[Fraction]] = {}
    for verdict in exercise.verdicts:
        if shows(exercise, verdict.id, day) is Shows.NOTHING:
            found.setdefault(exercise.feedback[verdict.id].until, []).append(verdict.max_score)
    return [
        f"{len(each)} {'criterion' if len(each) == 1 else 'criteria'} with {points(sum(each, Fraction(0)))} points "
        f"{'is' if len(each) == 1 else 'are'} not shown{_when(until)}"
        for until, each in found.items()
    ]


def _when(until: str) -> str:
    return _WHEN.get(until, f" until {until} has passed" if until else "")


def _faults(exercise: ExerciseReport, shown: Mapping[str, Shows]) -> tuple[ReportedFault, ...]:
    """Return the faults: a program may tell in one whatever it was told in its scenario."""
    kept = []
    for fault in exercise.faults:
        worst = _of_scenario(fault.scenario, exercise, shown)
        if worst is Shows.ALL:
            kept.append(fault)
        elif worst is Shows.WITHOUT_NUMBERS:
            kept.append(replace(fault, text=without_numbers(fault.text), t_ns=0))
    return tuple(kept)


def _of_scenario(scenario: str, exercise: ExerciseReport, shown: Mapping[str, Shows]) -> Shows:
    """Return how much is shown of the closest criterion judged on a scenario; of all, if none is."""
    asked = tuple(shown[id_] for id_, where in exercise.situations.items() if where == scenario and id_ in shown)
    return strictest(asked or tuple(shown.values()))


def _is_open(figure: Figure, exercise: ExerciseReport, shown: Mapping[str, Shows]) -> bool:
    """Return whether a picture shows only scenarios of which all is shown; a graph may show any of them."""
    if not isinstance(figure, Chart) or not figure.criteria:
        return False
    scenarios = [exercise.situations.get(id_, "") for id_ in figure.criteria]
    return all(_of_scenario(scenario, exercise, shown) is Shows.ALL for scenario in scenarios)


def _excerpts(
    exercise: ExerciseReport,
    verdicts: Sequence[Verdict],
    faults: Sequence[ReportedFault],
    shown: Mapping[str, Shows],
) -> tuple[Excerpt, ...]:
    """Return the lines of the source that what is wholly shown points to."""
    places = {v.location for v in verdicts if shown[v.id] is Shows.ALL}
    places |= {Location(f.file, f.line) for f in faults if _of_scenario(f.scenario, exercise, shown) is Shows.ALL}
    return tuple(e for e in exercise.excerpts if Location(e.file, e.line) in places)
