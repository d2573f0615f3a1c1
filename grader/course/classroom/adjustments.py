"""Reads an instructor's adjustments from a YAML file: late days, scores, comments, renamed files, what to ignore."""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field, replace
from fractions import Fraction
from pathlib import Path
from typing import Annotated

from pydantic import BaseModel, ConfigDict, Field, StringConstraints, ValidationError

from grader.grading.rubrics.mistakes import (
    Mistake,
    TreePath,
    YamlSyntaxError,
    YamlTree,
    mistakes_of,
    nearest_hint,
    read_yaml,
)
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError
from grader.runtime.model.wording import listed, printable

#: A file of some thousand students with reasons has less.
MAX_BYTES = 1 << 20
_AMOUNT = re.compile(r"(\d{1,6}(?:\.\d{1,6})?)\s*(%|points?)")
#: A number as people write it in this file: other forms that YAML reads as numbers are too easily misread.
_NUMBER = r"\d{1,6}(?:\.\d{1,6})?"
# What people write behind a number.
_UNITS = r"%.*|/.*|p(?:oin)?ts?|d(?:ays?)?|h(?:ours?)?"
#: The keys of numbers, for the whole submission and for a criterion.
_NUMBERS, _CRITERION_NUMBERS = ("days_late", "score", "bonus"), ("score",)
_HOURS_A_DAY = 24
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
    bonus: Fraction = Fraction(0)  # points on top of the score, after the late penalty
    reason: str = ""
    # Name of a file as it was handed in -> the name that it is graded under
    rename: Mapping[str, str] = field(default_factory=dict)
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
    path: Path | None = field(default=None, compare=False)  # the file; None if there is none

    @property
    def count(self) -> int:
        """How many students the file decides about."""
        return len(self.students)


@dataclass(frozen=True, slots=True)
class Adjusted:
    """A score after adjustments, together with the raw score."""

    raw: Fraction | None = None  # the grader's points; None if there are none or they are not final
    score: Fraction | None = None  # the score that counts; None for no score
    days_late: Fraction = Fraction(0)
    penalty: Fraction = Fraction(0)  # points deducted for late days
    override: Fraction | None = None  # the score set by the instructor; None if not set
    bonus: Fraction = Fraction(0)  # points added by the instructor that count
    bonus_lost: Fraction = Fraction(0)  # points added by the instructor that do not count: the maximum is reached
    reason: str = ""  # the reason for the change, or for ignoring the submission
    ignored: bool = False  # whether the submission does not count
    comment: str = ""  # on the whole submission, for the student
    # `exercise/criterion` -> the decision about it, for criteria of the report
    criteria: Mapping[str, CriterionDecision] = field(default_factory=dict)
    marked: Fraction | None = None  # points after decisions about criteria, before late days; None if there are none
    rename: Mapping[str, str] = field(default_factory=dict)  # files that were renamed, as in the decision

    @property
    def changed(self) -> bool:
        """Whether a decision changes the score."""
        given = self.override is not None or self.penalty > 0 or self.bonus > 0
        return self.ignored or given or self.marked != self.raw


def adjust(  # noqa: PLR0913  each comes from a different source
    raw: Fraction | None,
    decision: Decision,
    rules: Adjustments,
    *,
    marked: Fraction | None = None,
    criteria: Mapping[str, CriterionDecision] | None = None,
    most: Fraction | None = None,
) -> Adjusted:
    """Apply a decision to a score. A started day counts in full, and the penalty never exceeds the points earned.

    With decisions about criteria, `marked` are the points that follow from them, which replace the raw ones. A bonus
    reaches `most` points at most; None stands for no limit.
    """
    penalty = Fraction(0)
    earned = marked if criteria else raw
    if earned is not None and rules.per_day is not None:
        days = -(-decision.days_late.numerator // decision.days_late.denominator)
        most = earned if rules.at_most is None else min(earned, rules.at_most.of(earned))
        penalty = min(most, days * rules.per_day.of(earned))
    score = decision.score if decision.score is not None else (None if earned is None else earned - penalty)
    bonus = Fraction(0)
    if score is not None and decision.bonus:
        bonus = decision.bonus if most is None else max(Fraction(0), min(decision.bonus, most - score))
        score += bonus
    return Adjusted(
        raw=raw,
        score=None if decision.ignore else score,
        days_late=decision.days_late,
        penalty=penalty,
        override=decision.score,
        bonus=bonus,
        bonus_lost=Fraction(0) if score is None else decision.bonus - bonus,
        rename=decision.rename,
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


_Points = Annotated[float, Field(ge=0, le=999_999, allow_inf_nan=False, strict=False)]
_FileName = Annotated[str, StringConstraints(strip_whitespace=True, min_length=1, max_length=200)]


class _Criterion(_Strict):
    score: _Points | None = None
    reason: _Reason | None = None
    comment: _Comment | None = None


class _Student(_Strict):
    days_late: Annotated[float, Field(ge=0, le=3650, allow_inf_nan=False, strict=False)] = 0.0
    score: _Points | None = None
    bonus: _Points | None = None
    reason: _Reason | None = None
    rename: dict[str, _FileName] = {}
    ignore: _Reason | None = None
    comment: _Comment | None = None
    criteria: dict[str, _Criterion] = {}


class _File(_Strict):
    late: _Late | None = None
    students: dict[str, _Student] = {}


def read_adjustments(path: Path) -> Adjustments:
    """Read an adjustments file; raises ClassError with the first mistake and its position."""
    tree = _tree(path)
    if misread := [*tree.mistakes, *_misread_numbers(tree)]:
        raise _refusal(path, misread)
    try:
        read = _File.model_validate(tree.data or {})
    except ValidationError as error:
        raise _refusal(path, mistakes_of(error, tree, _File)) from None
    mistakes = [*_without_reason(read, tree), *_contradictions(read, tree), *_unusable_names(read, tree)]
    if mistakes:
        raise _refusal(path, mistakes)
    students = {name: _decision(name, student, path, tree) for name, student in read.students.items()}
    return Adjustments(_amount("per_day", read), _amount("at_most", read), students, path)


def _misread_numbers(tree: YamlTree) -> Iterator[Mistake]:
    """Yield a mistake for each amount that is not written as a plain number, or as text with a unit where it needs one.

    The values are read as they are written: YAML takes `+5` for 5, and `0x10` for 16.
    """
    for path, text in tree.texts.items():
        match path:
            case ("students", _, str(key)) if key in _NUMBERS:
                pass
            case ("students", _, "criteria", _, str(key)) if key in _CRITERION_NUMBERS:
                pass
            case ("late", "per_day" | "at_most" as key) if not _AMOUNT.fullmatch(text.strip()):
                value = re.match(_NUMBER, text)
                hint = f"write `{value[0]} %` or `{value[0]} points`" if value else ""
                yield tree.at(path).mistake(f"expected `10 %` or `5 points`, found {_found(text)}", hint)
                continue
            case _:
                continue
        plain = text.strip().removeprefix("+") if key == "bonus" else text.strip()
        if not re.fullmatch(_NUMBER, plain):
            what = "a number of days" if key == "days_late" else "a number of points"
            expected = f"{what} without a sign" if plain.startswith("+") else what
            yield tree.at(path).mistake(f"expected {expected}, found {_found(text)}", _number_hint(path, plain))


def _found(text: str) -> str:
    return f"`{printable(text, 60)}`" if text.strip() else "nothing"


def _number_hint(path: TreePath, text: str) -> str:
    """Return what to write instead of a text that is not a plain number; empty if that is not clear."""
    key = str(path[-1])
    parts = re.fullmatch(rf"([+-]?)(\d{{1,6}},\d{{1,6}}|{_NUMBER})\s*({_UNITS})?", text, re.IGNORECASE)
    if parts is None:
        return ""
    sign, value, unit = parts[1], parts[2].replace(",", "."), (parts[3] or "").casefold()
    if sign == "+" and key == "score":
        whose = "" if len(path) == 3 else " of the student"
        return f"write `bonus: {value}`{whose} for points on top, or the points that count without a sign"
    if sign == "-":
        return "" if key == "days_late" else "write the `score` that remains"
    if unit.startswith("%") and key != "days_late":
        return "write points instead of a share"
    if unit.startswith("h") and key == "days_late":
        days = -(-Fraction(value) * 100 // _HOURS_A_DAY)
        return f"write days: `days_late: {float(days / 100):g}`"
    return f"write `{key}: {value}`"


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
    """Return a mistake for each score or bonus that was given without a reason."""
    whole = [
        tree.keys["students", name].mistake(f"expected a `reason` for the `{key}`, found none")
        for name, student in read.students.items()
        for key, value in (("score", student.score), ("bonus", student.bonus))
        if value is not None and not student.reason
    ]
    return whole + [
        tree.keys["students", name, "criteria", id_].mistake("expected a `reason` for the `score`, found none")
        for name, student in read.students.items()
        for id_, criterion in student.criteria.items()
        if criterion.score is not None and not criterion.reason
    ]


def _contradictions(read: _File, tree: YamlTree) -> Iterator[Mistake]:
    """Yield a mistake for each decision of which one part would make another part count for nothing."""
    for name, student in read.students.items():
        scored = [id_ for id_, criterion in student.criteria.items() if criterion.score is not None]
        given = [key for key in ("score", "bonus") if getattr(student, key) is not None]
        if student.ignore and (given or scored):
            text = f"expected `ignore` or a `{[*given, 'score'][0]}`, found both"
            yield tree.keys["students", name, "ignore"].mistake(text, "what is ignored has no score")
        elif len(given) > 1:
            text = "expected `score` or `bonus`, found both"
            yield tree.keys["students", name, "bonus"].mistake(text, "write the sum as `score`")
        elif student.score is not None and scored:
            text = f"expected a `score` for the whole or for criteria, found both (`{printable(scored[0], 60)}`)"
            yield tree.keys["students", name, "score"].mistake(text, "leave one out: the first replaces the others")


def _unusable_names(read: _File, tree: YamlTree) -> Iterator[Mistake]:
    """Yield a mistake for each file whose new name would be invalid, or would be that of another file."""
    for name, student in read.students.items():
        for old, new in student.rename.items():
            where = tree.at(("students", name, "rename", old))
            if "/" in new or "\\" in new or not new.casefold().endswith(".py"):
                yield where.mistake(f"expected the name of a .py file without a folder, found {_found(new)}")
            elif list(student.rename.values()).count(new) > 1:
                yield where.mistake(f"expected a different name for each file, found {_found(new)} twice")


def _amount(key: str, read: _File) -> Amount | None:
    """Return an amount that is known to be well written; None if there is none."""
    match = _AMOUNT.fullmatch((getattr(read.late, key) or "").strip()) if read.late is not None else None
    return None if match is None else Amount(Fraction(match[1]), match[2] == "%")


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
        bonus=Fraction(str(student.bonus or 0)),
        reason=student.reason or "",
        rename=student.rename,
        ignore=student.ignore or "",
        where=f"{path}:{place.line}:{place.column}",
        comment=student.comment or "",
        criteria=criteria,
    )


def with_criteria(
    adjustments: Adjustments,
    points: Mapping[str, Fraction],
    *,
    bonus: Fraction = Fraction(0),
    files: Sequence[str] = (),
) -> Adjustments:
    """Name criteria in full; raises ClassError for an unknown one, an unclear one, or too many points.

    The points to be had are given by `exercise/criterion`, those that rubrics allow on top as a sum. Files are the
    names of the files that exercises ask for: a file renamed to nearly one of them is refused.
    """
    students = {}
    most = sum(points.values(), bonus)
    for name, decision in adjustments.students.items():
        _refuse_excess(decision, most, bonus)
        for new in decision.rename.values():
            hint = "" if new in files else nearest_hint(new, files)
            if hint:
                raise ClassError(
                    f"{decision.where}: expected the name of a file that is asked for, found `{new}`", hint
                )
        criteria: dict[str, CriterionDecision] = {}
        for id_, found in decision.criteria.items():
            full = _full_id(id_, found, points)
            if full in criteria:
                raise ClassError(f"{found.where}: expected each criterion once, found `{full}` twice")
            if found.score is not None and found.score > points[full]:
                of = f"{float(points[full]):g}"
                raise ClassError(f"{found.where}: expected at most {of} points, found {float(found.score):g}")
            criteria[full] = found
        students[name] = replace(decision, criteria=criteria)
    return replace(adjustments, students=students)


def _refuse_excess(decision: Decision, most: Fraction, bonus: Fraction) -> None:
    """Raise ClassError for a score or bonus above what the rubrics allow."""
    if decision.score is not None and decision.score > most:
        limit = f"at most {float(most):g} points, "
        limit += f"{float(bonus):g} of them as a bonus" if bonus else "the maximum"
        hint = "" if bonus else "a rubric may allow more: `bonus: 5` under `exercise`"
        raise ClassError(f"{decision.where}: expected {limit}, found {float(decision.score):g}", hint)
    if decision.bonus > most:
        raise ClassError(f"{decision.where}: expected a bonus of at most {float(most):g} points, found more")


def _full_id(id_: str, found: CriterionDecision, points: Mapping[str, Fraction]) -> str:
    meant = [full for full in points if id_ in (full, full.split("/")[1])]
    if len(meant) == 1:
        return meant[0]
    if meant:
        raise ClassError(f"{found.where}: expected one criterion, found {len(meant)}: {listed(meant, 'and')}")
    known = [*points, *(full.split("/")[1] for full in points)]
    raise ClassError(
        f"{found.where}: expected a criterion of the rubrics, found `{printable(id_, 60)}`", nearest_hint(id_, known)
    )


def several_students(decision: Decision, name: str, found: Sequence[str]) -> ClassError:
    """Build the error for a decision that several students may be meant by."""
    text = f"{decision.where}: expected one student, found {len(found)} for `{printable(name, 60)}`"
    return ClassError(text, f"name one of the submissions: {listed([f'`{printable(one, 80)}`' for one in found])}")


def decided_twice(decision: Decision, name: str, submission: str, other: str) -> ClassError:
    """Build the error for two decisions about one submission."""
    text = f"{decision.where}: expected one decision about {printable(submission, 80)}, "
    text += f"found `{printable(name, 60)}` as well"
    return ClassError(text, f"put both under `{printable(other, 60)}`")


def unknown_student(decision: Decision, name: str, known: list[str]) -> ClassError:
    """Build the error for a decision about somebody who is not in the class."""
    message = f"{decision.where}: expected a submission or a person of the class, found `{name[:60]}`"
    return ClassError(message, nearest_hint(name, known))
