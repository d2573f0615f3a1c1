"""The marks of a graded class, each for one account of a platform, and what would change there."""

from __future__ import annotations

import html
import json
import re
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Protocol

import msgspec

from grader.course.classroom.roster import fold_handle, spellings
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, GraderError

#: The file of a results folder that marks are read from.
CLASS = "batch.json"
#: Two scores that differ by less are the same; platforms store them with five decimals.
_SAME = 1e-4


@dataclass(frozen=True, slots=True)
class StudentMark:
    """What one person of the class gets."""

    name: str  # of the person, as the gradebook has it; hostile
    score: float  # final points, after the instructor's decisions
    feedback: str  # one line for the student; hostile
    ids: Mapping[str, str]  # kind of id (`canvas`, `id`, `username`, `email`) -> its value, without empty ones


@dataclass(frozen=True, slots=True)
class Marks:
    """The marks of a class."""

    marks: tuple[StudentMark, ...]
    max_score: float | None  # maximum points; None if the reports differ
    left_out: tuple[str, ...]  # who handed something in but has no mark to upload, and why; one line each
    withheld: tuple[str, ...] = ()  # criteria that the scores count, but that the rubric hides from students


class _Student(msgspec.Struct):
    name: str | None
    person: str | None
    status: str
    score: float | None
    max_score: float | None
    exported: bool
    platform_ids: dict[str, str]
    feedback: str | None
    remarks: list[str] = []


class _Class(msgspec.Struct):
    schema: str
    students: list[_Student]
    withheld: list[str] = []


def read_marks(results: Path) -> Marks:
    """Read the marks that `grade batch` wrote into its results folder; raises ClassError if there are none."""
    path = results / CLASS
    again = "run `grade batch` on the class again: it keeps what is graded and writes the file"
    try:
        read = msgspec.json.decode(path.read_bytes(), type=_Class)
    except OSError as error:
        raise ClassError(f"{path}: expected the results of a class, found: {error.strerror}", again) from None
    except (msgspec.MsgspecError, RecursionError, UnicodeDecodeError) as error:
        raise ClassError(f"{path}: expected the results of a class by this version: {error}", again) from None
    marks, left_out = [], []
    for student in read.students:
        if student.exported and student.score is not None:
            name = student.person or student.name or ""
            marks.append(StudentMark(name, student.score, student.feedback or "", student.platform_ids))
        elif student.name is not None:
            why = f"no score: {student.status}" if student.score is None else "; ".join(student.remarks)
            left_out.append(f"{student.name}: {why}")
    maxima = {student.max_score for student in read.students if student.max_score is not None}
    return Marks(tuple(marks), maxima.pop() if len(maxima) == 1 else None, tuple(left_out), tuple(read.withheld))


@dataclass(frozen=True, slots=True)
class Account:
    """A student of the course on the platform."""

    key: int  # number of the account, which marks are sent to
    name: str
    ids: Mapping[str, str]  # as for a mark


class PlatformError(GraderError):
    """The platform refuses or cannot be reached; nothing more can be sent."""


class RefusedMarkError(Exception):
    """The platform refuses the mark of one person; others may be sent."""


class Platform(Protocol):
    """An assignment on a platform. Every method raises PlatformError if the platform does not answer as documented."""

    title: str  # names course and assignment to people
    max_score: float | None  # points of the assignment; None if it has none

    def accounts(self) -> Sequence[Account]:
        """Return the students of the course."""
        ...

    def scores(self) -> Mapping[int, float]:
        """Return the scores that the assignment has now, by the number of the account."""
        ...

    def comments(self, account: int) -> Sequence[str]:
        """Return the feedback that a student already has."""
        ...

    def send(self, account: int, score: float, feedback: str) -> None:
        """Set score and feedback; an empty feedback leaves what is there. Raises RefusedMarkError."""
        ...


@dataclass(frozen=True, slots=True)
class Change:
    """A mark and what it would change on the platform."""

    mark: StudentMark
    account: int
    before: float | None  # the score on the platform; None if there is none
    feedback: str  # the feedback to send; empty if the student already has it
    by_name: bool  # whether only the name tells whose account it is

    @property
    def needed(self) -> bool:
        """Whether the platform lacks anything."""
        return bool(self.feedback) or not same(self.before, self.mark.score)


@dataclass(frozen=True, slots=True)
class PlatformComparison:
    """The marks of a class against what the platform has."""

    changes: tuple[Change, ...]  # everybody with an account, changed or not
    unknown: tuple[str, ...]  # who has no account for sure, and why; one line each


def same(one: float | None, other: float | None) -> bool:
    """Return whether two scores are the same on a platform."""
    return one is not None and other is not None and abs(one - other) < _SAME


def compare(marks: Marks, platform: Platform, *, with_feedback: bool) -> PlatformComparison:
    """Find the account of everybody and what it lacks; only reads from the platform."""
    accounts, scores = platform.accounts(), platform.scores()
    found = [(mark, *_account_of(mark, accounts)) for mark in marks.marks]
    shared = Counter(account.key for _, account, _ in found if account is not None)
    changes, unknown = [], []
    for mark, account, why in found:
        if account is None or shared[account.key] > 1:
            unknown.append(
                f"{mark.name}: {why if account is None else 'several people of the class have this account'}"
            )
            continue
        before = scores.get(account.key)
        feedback = mark.feedback if with_feedback else ""
        # Feedback of students whose score differs has changed as well, because it names the score.
        if feedback and same(before, mark.score) and _plain(feedback) in map(_plain, platform.comments(account.key)):
            feedback = ""
        changes.append(Change(mark, account.key, before, feedback, by_name=bool(why)))
    return PlatformComparison(tuple(changes), tuple(unknown))


def _account_of(mark: StudentMark, accounts: Sequence[Account]) -> tuple[Account | None, str]:
    """Return the account of a person, and a reason if there is none for sure, or only the name tells it."""
    for kind, value in mark.ids.items():
        having = [account for account in accounts if fold_handle(account.ids.get(kind, "")) == fold_handle(value)]
        if len(having) == 1:
            return having[0], ""
        if having:
            return None, f"several accounts with this {kind}"
    names = set(spellings(mark.name))
    called = [account for account in accounts if names & set(spellings(account.name))]
    if len(called) == 1:
        return called[0], "found by name"
    known = ", ".join(mark.ids) or "name"
    return None, "several accounts of this name" if called else f"no student of the course with this {known} or name"


_TAG = re.compile(r"<[^<>]*>")


def _plain(text: str) -> str:
    """Reduce a comment to its words, because platforms return it as HTML or with other spaces."""
    return (
        " ".join(html.unescape(_TAG.sub(" ", text)).split()) if "<" in text or "&" in text else " ".join(text.split())
    )


@dataclass(frozen=True, slots=True)
class Sent:
    """What became of an upload."""

    sent: int
    refused: tuple[str, ...]  # whose mark the platform refused, and why
    wrong: tuple[str, ...]  # whose score is another than the one sent, as read back


def send_marks(changes: Iterable[Change], platform: Platform, tell: Callable[[str], None]) -> Sent:
    """Send what is needed, one person after the other, and read the scores back.

    Raises PlatformError with the number sent so far if the platform stops answering; the same upload then goes on.
    """
    wanted = [change for change in changes if change.needed]
    refused: list[str] = []
    sent: list[Change] = []
    for change in wanted:
        try:
            platform.send(change.account, change.mark.score, change.feedback)
        except RefusedMarkError as error:
            refused.append(f"{change.mark.name}: {error}")
            continue
        except PlatformError as error:
            text = f"{error.message}; {len(sent)} of {len(wanted)} marks were sent"
            raise PlatformError(text, "run the same command again to continue") from None
        sent.append(change)
        tell(f"{len(sent)}/{len(wanted)} {change.mark.name}")
    return Sent(len(sent), tuple(refused), tuple(_wrong(sent, platform.scores())) if sent else ())


def _wrong(sent: Iterable[Change], now: Mapping[int, float]) -> Iterator[str]:
    for change in sent:
        score = now.get(change.account)
        if not same(score, change.mark.score):
            there = "no score" if score is None else f"{score:g}"
            yield f"{change.mark.name}: sent {change.mark.score:g}, the platform has {there}"


def platform_words(data: bytes, limit: int = 200) -> str:
    """Return what a platform says in an error, from JSON of any shape or the text itself, in one short line."""
    try:
        found = json.loads(data)
    except (ValueError, RecursionError):
        found = data.decode("utf-8", "replace")
    return " ".join(_TAG.sub(" ", " ".join(_texts(found))).split())[:limit]


def _texts(found: object) -> Iterator[str]:
    if isinstance(found, str):
        yield found
    elif isinstance(found, Mapping):
        for name in ("message", "errors", "error"):
            yield from _texts(found.get(name))
    elif isinstance(found, list):
        for each in found:
            yield from _texts(each)
