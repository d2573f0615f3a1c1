"""Reads an instructor's adjustments from a YAML file: late days, changed scores, comments, ignored submissions."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import field, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from grader.core.dataclass import dataclass
from grader.core.errors import ClassError
from grader.rubrics.mistakes import mistakes_of, nearest
from grader.rubrics.yaml_tree import Mistake, YamlSyntaxError, YamlTree, read_yaml
from grader.submissions.collected import listed, shown

MAX_BYTES = 1 << 20
_AMOUNT = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%|points?)")
_Comment = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=1_000)]
_Reason = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=500)]


@dataclass(frozen=True, slots=True)
class Amount:
    """A number of points, or a percentage of the points earned."""

    value: Fraction
    percent: bool

    def of(self, earned: Fraction) -> Fraction:
        """Convert to points, given the points earned."""
        return earned * self.value / 100 if self.percent else self.value


@dataclass(frozen=True, slots=True)
class CriterionDecision:
    """The instructor's decision about one criterion of one submission."""

    score: Fraction | None = None  # replaces the grader's points; None to keep them
    reason: str = ""  # why the points were changed; empty if they were not
    comment: str = ""  # for the student; may be empty
    where: str = ""  # position in the file, for messages


@dataclass(frozen=True, slots=True)
class Decision:
    """The instructor's decision about one submission."""

    days_late: Fraction = Fraction(0)  # late days; a started day counts in full
    score: Fraction | None = None  # replaces the grader's score, whether late or not; None to keep it
    reason: str = ""
    ignore: str = ""  # why the submission does not count at all; empty if it counts
    where: str = ""  # position in the file, for messages
    comment: str = ""  # on the whole submission, for the student; may be empty
    # Id of a criterion, or `exercise/criterion` -> the decision about it
    criteria: Mapping[str, CriterionDecision] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Adjustments:
    """The contents of an adjustments file."""

    per_day: Amount | None = None  # penalty for each late day; None for no penalty
    at_most: Amount | None = None  # largest penalty for all late days together; None for all points earned
    # Name, user name, email address or number -> decision
    students: Mapping[str, Decision] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Adjusted:
    """A score after adjustments, together with the raw score."""

    raw: Fraction | None = None  # the grader's points; None if there are none or they are not final
    score: Fraction | None = None  # the score that counts; None for no score
    days_late: Fraction = Fraction(0)
    penalty: Fraction = Fraction(0)  # points deducted for late days
    override: Fraction | None = None  # the score set by the instructor; None if not set
    reason: str = ""  # the reason for the change, or for ignoring the submission
    ignored: bool = False  # whether the submission does not count
    comment: str = ""  # on the whole submission, for the student
    # `exercise/criterion` -> the decision about it, for criteria of the report
    criteria: Mapping[str, CriterionDecision] = field(default_factory=dict)
    marked: Fraction | None = None  # points after decisions about criteria, before late days; None if there are none

    @property
    def changed(self) -> bool:
        """Whether a decision changes the score."""
        return self.ignored or self.override is not None or self.penalty > 0 or self.marked != self.raw


def adjust(
    raw: Fraction | None,
    decision: Decision,
    rules: Adjustments,
    *,
    marked: Fraction | None = None,
    criteria: Mapping[str, CriterionDecision] | None = None,
) -> Adjusted:
    """Apply a decision to a score. A started day counts in full, and the penalty never exceeds the points earned.

    With decisions about criteria, `marked` are the points that follow from them, which replace the raw ones.
    """
    penalty = Fraction(0)
    earned = marked if criteria else raw
    if earned is not None and rules.per_day is not None:
        days = -(-decision.days_late.numerator // decision.days_late.denominator)
        most = earned if rules.at_most is None else min(earned, rules.at_most.of(earned))
        penalty = min(most, days * rules.per_day.of(earned))
    score = decision.score if decision.score is not None else (None if earned is None else earned - penalty)
    return Adjusted(
        raw=raw,
        score=None if decision.ignore else score,
        days_late=decision.days_late,
        penalty=penalty,
        override=decision.score,
        reason=decision.ignore or decision.reason,
        ignored=bool(decision.ignore),
        comment=decision.comment,
        criteria=criteria or {},
        marked=earned,
    )


class _Strict(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True)


class _Late(_Strict):
    per_day: str
    at_most: str | None = None


class _Criterion(_Strict):
    score: Annotated[float, Field(ge=0, le=1_000_000, allow_inf_nan=False, strict=False)] | None = None
    reason: _Reason | None = None
    comment: _Comment | None = None


class _Student(_Strict):
    days_late: Annotated[float, Field(ge=0, le=3650, allow_inf_nan=False, strict=False)] = 0.0
    score: Annotated[float, Field(ge=0, le=1_000_000, allow_inf_nan=False, strict=False)] | None = None
    reason: _Reason | None = None
    ignore: _Reason | None = None
    comment: _Comment | None = None
    criteria: dict[str, _Criterion] = {}


class _File(_Strict):
    late: _Late | None = None
    students: dict[str, _Student] = {}


def read_adjustments(path: Path) -> Adjustments:
    """Read an adjustments file; raises ClassError with the first mistake and its position."""
    tree = _tree(path)
    try:
        read = _File.model_validate(tree.data or {})
    except ValidationError as error:
        raise _refusal(path, mistakes_of(error, tree, _File)) from None
    mistakes = [*tree.mistakes, *_without_reason(read, tree)]
    amounts = {key: _amount(key, read, tree, mistakes) for key in ("per_day", "at_most")}
    if mistakes:
        raise _refusal(path, mistakes)
    students = {name: _decision(name, student, path, tree) for name, student in read.students.items()}
    return Adjustments(amounts["per_day"], amounts["at_most"], students)


def _tree(path: Path) -> YamlTree:
    try:
        data = path.read_bytes()
        if len(data) > MAX_BYTES:
            raise ClassError(f"{path}: expected at most {MAX_BYTES >> 20} MiB, found more")
        return read_yaml(data.decode("utf-8-sig"))
    except OSError as error:
        raise ClassError(f"{path}: expected a YAML file, found none that can be read: {error.strerror}") from None
    except UnicodeDecodeError:
        raise ClassError(f"{path}: expected UTF-8, found another encoding") from None
    except YamlSyntaxError as error:
        raise _refusal(path, [error.mistake]) from None


def _refusal(path: Path, mistakes: list[Mistake]) -> ClassError:
    first, *others = sorted(mistakes)
    more = f" (and {len(others)} more)" if others else ""
    return ClassError(f"{path}:{first.line}:{first.column}: {first.text}{more}", first.hint)


def _without_reason(read: _File, tree: YamlTree) -> list[Mistake]:
    """Return a mistake for each score that was set without a reason."""
    whole = [
        tree.keys["students", name].mistake("expected a `reason` for the `score`, found none")
        for name, student in read.students.items()
        if student.score is not None and not student.reason
    ]
    return whole + [
        tree.keys["students", name, "criteria", id_].mistake("expected a `reason` for the `score`, found none")
        for name, student in read.students.items()
        for id_, criterion in student.criteria.items()
        if criterion.score is not None and not criterion.reason
    ]


def _amount(key: str, read: _File, tree: YamlTree, mistakes: list[Mistake]) -> Amount | None:
    text = None if read.late is None else getattr(read.late, key)
    if text is None:
        return None
    match = _AMOUNT.fullmatch(text.strip())
    if match is None:
        mistakes.append(tree.values["late", key].mistake(f"expected `10 %` or `5 points`, found `{text[:60]}`"))
        return None
    return Amount(Fraction(match[1]), match[2] == "%")


def _decision(name: str, student: _Student, path: Path, tree: YamlTree) -> Decision:
    place = tree.keys["students", name]
    criteria = {}
    for id_, found in student.criteria.items():
        key = tree.keys["students", name, "criteria", id_]
        score = None if found.score is None else Fraction(str(found.score))
        where = f"{path}:{key.line}:{key.column}"
        criteria[id_] = CriterionDecision(score, found.reason or "", found.comment or "", where)
    return Decision(
        days_late=Fraction(str(student.days_late)),
        score=None if student.score is None else Fraction(str(student.score)),
        reason=student.reason or "",
        ignore=student.ignore or "",
        where=f"{path}:{place.line}:{place.column}",
        comment=student.comment or "",
        criteria=criteria,
    )


def with_criteria(adjustments: Adjustments, points: Mapping[str, Fraction]) -> Adjustments:
    """Name criteria in full; raises ClassError for an unknown one, an unclear one, or too many points.

    The points to be had are given by `exercise/criterion`.
    """
    students = {}
    for name, decision in adjustments.students.items():
        criteria: dict[str, CriterionDecision] = {}
        for id_, found in decision.criteria.items():
            full = _full_id(id_, found, points)
            if full in criteria:
                raise ClassError(f"{found.where}: expected each criterion once, found `{full}` twice")
            if found.score is not None and found.score > points[full]:
                most = f"{float(points[full]):g}"
                raise ClassError(f"{found.where}: expected at most {most} points, found {float(found.score):g}")
            criteria[full] = found
        students[name] = replace(decision, criteria=criteria)
    return replace(adjustments, students=students)


def _full_id(id_: str, found: CriterionDecision, points: Mapping[str, Fraction]) -> str:
    meant = [full for full in points if id_ in (full, full.split("/")[1])]
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ClassError(f"{found.where}: expected one criterion, found {len(meant)}: {listed(meant, 'and')}")
    known = [*points, *(full.split("/")[1] for full in points)]
    raise ClassError(
        f"{found.where}: expected a criterion of the rubrics, found `{shown(id_, 60)}`", nearest(id_, known)
    )


def unknown_student(decision: Decision, name: str, known: list[str]) -> ClassError:
    """Build the error for a decision about somebody who is not in the class."""
    message = f"{decision.where}: expected a submission or a person of the class, found `{name[:60]}`"
    return ClassError(message, nearest(name, known))
