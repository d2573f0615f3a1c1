"""Finds the commonest causes of lost points: verdicts of a class, grouped by criterion and kind of cause."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from fractions import Fraction
from typing import Any

from grader.core.exercise import Outcome
from grader.reporting.class_page.contents import LOST, ReportData

_VARYING = "#"
# Longest text examined; the kind of a longer text is recognisable from its beginning.
_MOST = 600
# The order matters: a quotation may contain anything, a place contains a number, and a call contains names.
_PATTERNS = (
    (re.compile(r"(?<!\w)'[^'\n]*'|\"[^\"\n]*\"|`[^`\n]*`"), "'…'"),
    (re.compile(r"(?<![\w.])[\w./-]+\.pyi?\b(?::\d+){0,2}"), "FILE"),
    (re.compile(r"\b[A-Za-z_][\w.]*\([^()\n]*(?:\)|…)"), "CALL"),
    (re.compile(r"(?<![\w/])/[A-Za-z_][\w/]*"), "/NAME"),
    (re.compile(r"\b[A-Za-z_]\w*(?:\.[A-Za-z_]\w*)+\b"), "NAME"),
    (
        re.compile(r"(?<![\w.])[-+]?(?:\d+(?:\.\d*)?|\.\d+)(?:e[-+]?\d+)?(?![\w.]*\d)|\b(?:nan|inf)\b", re.IGNORECASE),
        _VARYING,
    ),
    (re.compile(rf"{_VARYING}(?:(?:, | and | to | or ){_VARYING})+"), _VARYING),
    (re.compile(r"\s+"), " "),
)
#: Exceptions whose messages come from Python and describe what happened.
_OWN_WORDS = frozenset({"AttributeError", "ImportError", "IndexError", "ModuleNotFoundError", "NameError", "TypeError"})
_EXCEPTION = re.compile(r"(?P<type>[A-Za-z_][\w.]{0,80})(?::\s*(?P<text>.*))?", re.DOTALL)


@dataclass(frozen=True, order=True, slots=True)
class CauseKind:
    """The kind of a cause.

    Attributes:
        source: Where it is known from: `diagnosis`, `missing`, `fault` or `reason`.
        key: Equal for causes of the same kind.
    """

    source: str
    key: str

    @property
    def label(self) -> str:
        """A short description of the kind."""
        if self.source == "diagnosis":
            return self.key.replace("_", " ")
        return {"missing": "file missing", "fault": "fault"}.get(self.source, "as measured")


def kind_of(criterion: Mapping[str, Any]) -> CauseKind:
    """Return the kind of cause for which a criterion lost points.

    A diagnosis is the most reliable source; then a missing file, a fault, and finally the text of the reason.

    Args:
        criterion: A criterion of a JSON report.
    """
    evidence = criterion.get("evidence")
    evidence = evidence if isinstance(evidence, Mapping) else {}
    named, missing, fault = (evidence.get(key) for key in ("diagnosis", "missing", "fault"))
    if isinstance(named, str) and named:
        return CauseKind("diagnosis", named)
    if isinstance(missing, str) and missing:
        return CauseKind("missing", missing)
    if isinstance(fault, Mapping):
        return CauseKind("fault", f"{fault.get('kind')} {_exception(str(fault.get('text', '')))}")
    return CauseKind("reason", skeleton(str(criterion.get("reason", "")).split(";", 1)[0]))


def skeleton(text: str) -> str:
    """Return a sentence without the parts that differ between students.

    Placeholders replace numbers, lists of numbers, quotations, file names with lines, calls, attributes and topic
    names: `10.00 Hz` and `9.98 Hz` become equal, and so do `self.timer` and `self.clock_timer`.
    """
    found = text[:_MOST]
    for pattern, sign in _PATTERNS:
        found = pattern.sub(sign, found)
    return found.strip().casefold()


def _exception(text: str) -> str:
    """Return the type of an exception, with the message if Python wrote it: messages of students are too different."""
    match = _EXCEPTION.fullmatch(text[:_MOST].strip())
    if match is None:
        return skeleton(text.split("\n", 1)[0])
    own = match["type"] in _OWN_WORDS and match["text"]
    return f"{match['type']}: {skeleton(match['text'].split(chr(10), 1)[0])}" if own else match["type"]


#: More forms of one cause than this are merged.
MOST_FORMS = 3
# Sentences in older reports, which have no `blocked_by` and no `same_cause_as`.
_SAME = re.compile(r"this has the same cause as (?P<id>\S{1,200}): mend that first")
_NEEDS = re.compile(r"not judged: needs (?P<what>.{1,400}?)(?: \(.{1,40}\)|, which is missing)", re.DOTALL)


@dataclass(frozen=True, slots=True)
class Form:
    """One form in which a cause appears.

    Attributes:
        student: Index of a student whose report has this form.
        reason: The reason in that report.
        hint: The hint in that report; may be empty.
        count: Number of students with the same hint, apart from numbers and names.
    """

    student: int
    reason: str
    hint: str
    count: int


@dataclass(frozen=True, slots=True)
class CommonCause:
    """A cause for which students of a class lost points.

    Attributes:
        exercise: Id of the exercise.
        criterion: Id of the criterion that names it.
        title: Title of that criterion.
        kind: Kind of the cause.
        students: Indices of the students, in order and without duplicates.
        points: Points lost to it in total, including those of blocked criteria.
        forms: Forms in which it appears, the commonest first.
    """

    exercise: str
    criterion: str
    title: str
    kind: CauseKind
    students: tuple[int, ...]
    points: Fraction
    forms: tuple[Form, ...]


@dataclass(slots=True)
class _Cluster:
    title: str
    students: dict[int, Mapping[str, Any]] = field(default_factory=dict)
    points: Fraction = Fraction(0)


def causes(reports: Sequence[tuple[int, ReportData]]) -> tuple[CommonCause, ...]:
    """Return all causes, by number of students and then by points lost.

    A criterion that is blocked, or has the same cause as another, is counted with the one that names the cause.

    Args:
        reports: Student index and report, in the order of the students.
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
    return by_id.get(known) if known else _before_by_text(criterion, by_id)


def _before_by_text(criterion: Mapping[str, Any], by_id: Mapping[str, Mapping[str, Any]]) -> Mapping[str, Any] | None:
    """Return the criterion that an older report names only in its sentences."""
    if criterion["outcome"] == Outcome.BLOCKED.value:
        match = _NEEDS.fullmatch(str(criterion["reason"]))
        what = match["what"] if match else ""
        missing = (c for c in by_id.values() if (c.get("evidence") or {}).get("missing") == what)
        return by_id.get(what) or next(missing, None)
    match = _SAME.fullmatch(str(criterion["hint"] or ""))
    return by_id.get(match["id"]) if match else None


def _lost(criterion: Mapping[str, Any]) -> Fraction:
    return Fraction(str(criterion["max_score"])) - Fraction(str(criterion["score"]))


def _forms(students: Mapping[int, Mapping[str, Any]]) -> tuple[Form, ...]:
    """Return the commonest forms of a cause, each with the first student who has it."""
    shapes = {student: skeleton(str(root["hint"] or root["reason"])) for student, root in students.items()}
    forms = []
    for shape, count in Counter(shapes.values()).most_common(MOST_FORMS):
        student = next(s for s, own in shapes.items() if own == shape)
        root = students[student]
        forms.append(Form(student, str(root["reason"]), str(root["hint"] or ""), count))
    return tuple(forms)
