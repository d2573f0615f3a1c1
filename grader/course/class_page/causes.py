"""Finds the commonest causes of lost points: verdicts of a class, grouped by criterion and kind of cause."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from typing import Any

from grader.course.class_page.contents import LOST
from grader.grading.model.exercise import Outcome
from grader.grading.reporting.json_report import ReportData
from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, order=True, slots=True)
class CauseKind:
    """The kind of a cause: values of a report, never its sentences."""

    source: str  # `diagnosis`, `missing`, `fault` or `problem`, or `criterion` if none of them is known
    key: str = ""  # id of the diagnosis, name of the file, or kind of the fault or problem
    parts: tuple[str, ...] = ()  # type of the exception, or topics and detail of the problem

    @property
    def label(self) -> str:
        """A short description of the kind."""
        fixed = {"missing": "file missing", "criterion": "cause unknown"}
        named = self.key.replace("_", " ")
        return fixed.get(self.source) or (f"{named}: {', '.join(self.parts)}" if self.parts else named)


def kind_of(criterion: Mapping[str, Any]) -> CauseKind:
    """Return the kind of cause for which a criterion lost points.

    A diagnosis is the most reliable source; then a missing file, a fault, and the problem that the check found.
    """
    evidence = _mapping(criterion.get("evidence"))
    for source in ("diagnosis", "missing"):
        if isinstance(evidence.get(source), str) and evidence[source]:
            return CauseKind(source, evidence[source])
    fault = _mapping(evidence.get("fault"))
    if fault:
        exception = str(fault.get("exception") or "")
        return CauseKind("fault", str(fault.get("kind")), (exception,) if exception else ())
    return _problem_of(criterion)


def _problem_of(criterion: Mapping[str, Any]) -> CauseKind:
    """Return the problem that the check of a criterion found, if a report names one."""
    problem = _mapping(criterion.get("problem"))
    if not problem:
        return CauseKind("criterion")
    topics, detail = problem.get("topics"), problem.get("detail")
    parts = [*(topics if isinstance(topics, list) else ()), *([detail] if detail else ())]
    return CauseKind("problem", str(problem.get("kind")), tuple(map(str, parts)))


def _mapping(value: object) -> Mapping[str, Any]:
    return value if isinstance(value, Mapping) else {}


#: More forms of one cause than this are merged.
MOST_FORMS = 3


@dataclass(frozen=True, slots=True)
class Form:
    """One form in which a cause appears, as the report of one student has it."""

    student: int  # index of that student
    reason: str
    hint: str
    count: int  # number of students whose check found the same problem


@dataclass(frozen=True, slots=True)
class CommonCause:
    """A cause for which students of a class lost points."""

    exercise: str
    criterion: str  # id of the criterion that names it
    title: str  # title of that criterion
    kind: CauseKind
    students: tuple[int, ...]  # indices of the students, in order and without duplicates
    points: Fraction  # points lost to it in total, including those of blocked criteria
    forms: tuple[Form, ...]  # the commonest first


@dataclass(slots=True)
class _Cluster:
    title: str
    students: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    points: Fraction = Fraction(0)


def causes(reports: Sequence[tuple[int, ReportData]]) -> tuple[CommonCause, ...]:
    """Return all causes in reports, given with the index of the student, by number of students, then by points lost.

    A criterion that is blocked, or has the same cause as another, is counted with the one that names the cause.
    """
    clusters: dict[tuple[str, str, CauseKind], _Cluster] = {}
    for student, report in reports:
        for exercise in report["exercises"]:
            by_id = {criterion["id"]: criterion for criterion in exercise["criteria"]}
            for criterion, root in _roots(by_id):
                key = (str(exercise["id"]), str(root["id"]), kind_of(root))
                cluster = clusters.setdefault(key, _Cluster(str(root["title"])))
                cluster.students.setdefault(student, root)
                cluster.points += _lost(criterion)
    found = [
        CommonCause(*key[:2], cluster.title, key[2], tuple(cluster.students), cluster.points, _forms(cluster.students))
        for key, cluster in clusters.items()
    ]
    return tuple(sorted(found, key=lambda c: (-len(c.students), -c.points, c.exercise, c.criterion, c.kind)))


def _roots(by_id: Mapping[str, Mapping[str, Any]]) -> Iterator[tuple[Mapping[str, Any], Mapping[str, Any]]]:
    """Yield each criterion that lost points, with the criterion that names the cause."""
    for criterion in by_id.values():
        if criterion["outcome"] not in (*LOST, Outcome.BLOCKED.value):
            continue
        root, seen = criterion, {criterion["id"]}
        while (before := _before(root, by_id)) is not None and before["id"] not in seen:
            root = before
            seen.add(root["id"])
        # Points that depend on an undecided criterion are not lost.
        if root["outcome"] != Outcome.UNDECIDED.value:
            yield criterion, root


def _before(criterion: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Return the criterion that must be fixed before another one; None if there is none."""
    known = criterion.get("blocked_by") or criterion.get("same_cause_as")
    return by_id.get(known) if known else None


def _lost(criterion: Mapping[str, Any]) -> Fraction:
    return Fraction(str(criterion["max_score"])) - Fraction(str(criterion["score"]))


def _forms(students: Mapping[int, Mapping[str, Any]]) -> tuple[Form, ...]:
    """Return the commonest forms of a cause, each with the first student who has it."""
    problems = {student: _problem_of(root) for student, root in students.items()}
    forms = []
    for problem, count in Counter(problems.values()).most_common(MOST_FORMS):
        student = next(s for s, own in problems.items() if own == problem)
        root = students[student]
        forms.append(Form(student, str(root["reason"]), str(root["hint"] or ""), count))
    return tuple(forms)
