"""The mark of a submission that counts, with the decisions behind it: kept beside its report, shown to its student."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from fractions import Fraction
from typing import Any

import msgspec

from grader.course.classroom.adjustments import Adjusted, CriterionDecision
from grader.course.classroom.gradebook import Row, days, exactly, points_text, report_exercises
from grader.grading.model.exercise import Outcome
from grader.grading.reporting.escape import json_value
from grader.grading.reporting.html.final_mark import CriterionMark, FinalMark, ScoreShown
from grader.grading.reporting.json_report import CriterionData, ReportData
from grader.runtime.model.dataclass import dataclass

#: The file beside the report of a submission; for instructors, because it holds what a rubric withholds.
MARK = "mark.json"
SCHEMA = "grader/batch-mark/v1"
_INCOMPLETE = "The mark in the gradebook also counts criteria that are not shown here."


@dataclass(frozen=True, slots=True)
class KeptMark:
    """The mark of one submission, and the points that it was made from."""

    student: str  # the student's name; hostile
    adjusted: Adjusted
    max_score: Fraction | None = None  # None without a report
    points: Mapping[str, Fraction] = field(default_factory=dict)  # `exercise/criterion` -> points as graded
    schema: str = SCHEMA  # version of this format


def kept_mark(row: Row) -> KeptMark:
    """Return the mark of a row."""
    points = {id_: exactly(criterion["score"]) for id_, criterion in criteria_of(row.report)}
    return KeptMark(row.shown_name, row.adjusted, row.max_score, points)


def dump_mark(mark: KeptMark) -> bytes:
    """Encode a mark as JSON; invalid text in names is replaced."""
    encoded = msgspec.json.encode(json_value(msgspec.to_builtins(mark, enc_hook=str)))
    return msgspec.json.format(encoded) + b"\n"


def load_mark(data: bytes) -> KeptMark | None:
    """Decode a mark; None for invalid data or another version."""
    try:
        mark = msgspec.json.decode(data, type=KeptMark, dec_hook=_fraction)
    except (msgspec.MsgspecError, RecursionError, ValueError, ZeroDivisionError):
        return None
    return mark if mark.schema == SCHEMA else None


def _fraction(type_: type, value: Any) -> Any:
    return type_(value)


def mark_fits(mark: KeptMark, report: ReportData) -> bool:
    """Return whether a mark was made from the points of a report, of which criteria may be left out."""
    return all(mark.points.get(id_) == exactly(criterion["score"]) for id_, criterion in criteria_of(report))


def shown_mark(mark: KeptMark, report: ReportData | None) -> FinalMark:
    """Return what a page shows of a mark: for a report without some criteria, nothing that would reveal them."""
    if report is None:
        phrase = "" if mark.adjusted.score is None else f"final mark {points_text(mark.adjusted.score)} points"
        return FinalMark(mark.student, phrase, tuple(_on_the_whole(mark.adjusted, totals=True)))
    criteria = dict(criteria_of(report))
    everything = set(criteria) == set(mark.points)
    decided = {id_: _criterion(criterion, mark.adjusted.criteria.get(id_)) for id_, criterion in criteria.items()}
    exercises = {
        exercise["id"]: (
            sum((decided[f"{exercise['id']}/{c['id']}"].score for c in exercise["criteria"]), Fraction(0)),
            exactly(exercise["max_score"]),
        )
        for exercise in report["exercises"]
    }
    return FinalMark(
        student=mark.student,
        decisions=tuple(_on_the_whole(mark.adjusted, totals=everything)),
        score=_score(mark.adjusted, report, decided, everything=everything),
        exercises=exercises,
        criteria=decided,
    )


def _score(
    adjusted: Adjusted, report: ReportData, decided: Mapping[str, CriterionMark], *, everything: bool
) -> ScoreShown:
    raw = exactly(report["score"])
    score = sum((criterion.score for criterion in decided.values()), Fraction(0))
    if everything and adjusted.score is not None:
        score = adjusted.score
    outcomes = tuple(Outcome(criterion["outcome"]) for _, criterion in criteria_of(report))
    final = bool(report["final"]) or (everything and adjusted.score is not None)
    remark = "" if everything else _INCOMPLETE
    return ScoreShown(score, exactly(report["max_score"]), outcomes, final, None if score == raw else raw, remark)


def _criterion(found: CriterionData, decided: CriterionDecision | None) -> CriterionMark:
    raw, of = exactly(found["score"]), exactly(found["max_score"])
    if decided is None:
        return CriterionMark(raw, of)
    if decided.score is None:
        return CriterionMark(raw, of, comment=decided.comment)
    said = f"{points_text(decided.score)} of {points_text(of)} points instead of {points_text(raw)}: {decided.reason}"
    return CriterionMark(decided.score, of, said, decided.comment)


def decisions(row: Row) -> list[str]:
    """Explain to the student what was decided, beside what the grader had found, in a sentence each."""
    return [*_on_criteria(row), *_on_the_whole(row.adjusted, totals=True)]


def _on_criteria(row: Row) -> Iterator[str]:
    """Yield title and decision of each criterion that a student may see."""
    for id_, criterion in criteria_of(row.handed_back):
        decided = row.adjusted.criteria.get(id_)
        if decided is None:
            continue
        mark = _criterion(criterion, decided)
        points = mark.decision or f"{points_text(mark.score)} of {points_text(mark.max_score)} points"
        yield f"{criterion['title']}: {points}." + (f" Comment: {mark.comment}." if mark.comment else "")


def _on_the_whole(adjusted: Adjusted, *, totals: bool) -> Iterator[str]:
    """Yield each decision about the whole submission as a sentence.

    Without totals, the whole score is left out, because hidden criteria could be computed from it.
    """
    for old, new in adjusted.rename.items():
        yield f"{old} was renamed to {new} before grading."
    if adjusted.ignored:
        yield f"This submission does not count: {adjusted.reason}."
    elif totals:
        yield from _on_the_score(adjusted)
    if adjusted.comment:
        yield f"Comment: {adjusted.comment}"


def _on_the_score(adjusted: Adjusted) -> Iterator[str]:
    if adjusted.override is not None:
        raw = f" instead of {points_text(adjusted.marked)}" if adjusted.marked is not None else ""
        yield f"The score was set to {points_text(adjusted.override)}{raw}: {adjusted.reason}."
    elif adjusted.penalty:
        less = f"less {points_text(adjusted.penalty)} for {days(adjusted.days_late)} late"
        yield f"{points_text(adjusted.marked)} points, {less}."
    if adjusted.bonus or adjusted.bonus_lost:
        given = f"A bonus of {points_text(adjusted.bonus + adjusted.bonus_lost)} points"
        counted = f", of which {points_text(adjusted.bonus)} count up to the maximum" if adjusted.bonus_lost else ""
        yield f"{given}{counted}: {adjusted.reason}."


def criteria_of(report: ReportData | None) -> Iterator[tuple[str, CriterionData]]:
    """Yield `exercise/criterion` and the criterion, in the order of the report."""
    for exercise in report_exercises(report):
        for criterion in exercise["criteria"]:
            yield f"{exercise['id']}/{criterion['id']}", criterion
