"""Exercises: what a rubric file says, as values; and the contract between a trace and a check."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from typing import Any, Protocol, runtime_checkable

from grader.core.scenario import Scenario
from grader.core.trace import Trace


class ProblemKind(Enum):
    """The kinds of problems that diagnosis tells apart; a check names one only where a diagnosis needs it."""

    BURSTS = "bursts"  # several messages come at once
    STOPPED = "stopped"  # messages came, and then no more
    NO_MESSAGE = "no_message"  # none ever came
    NO_NUMBER = "no_number"  # the type of the messages has no number in it
    CONSTANT = "constant"  # the values are all the same
    NEVER_CHANGES = "never_changes"  # the answer cannot change, because the input stays on one side of the threshold
    WRONG_ANSWER = "wrong_answer"  # an answer does not fit its input, or one of the two is never given
    KEPT_APART = "kept_apart"  # types or QoS keep publisher and subscription from talking to each other
    NO_EDGE = "no_edge"  # two processes are not joined in the graph
    COUNT_START = "count_start"  # a count starts at another number
    ONE_PER_MESSAGE = "one_per_message"  # there is a log for every message


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem."""

    kind: ProblemKind
    topics: tuple[str, ...] = ()  # the topics that it is about, where a check looks at several
    start: int | None = None  # the number that a count starts at; None for problems of other kinds


#: What `until` may name besides a date; only a platform knows when it comes.
DUE_DATE, PUBLISHED = "due_date", "published"
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


class Audience(str, Enum):
    """Who reads a report."""

    STUDENT = "student"
    INSTRUCTOR = "instructor"


class Shows(str, Enum):
    """How much of a criterion's result a student sees, from everything to nothing."""

    ALL = "all"
    WITHOUT_NUMBERS = "reason_without_numbers"
    OUTCOME = "outcome_only"
    NOTHING = "nothing"


#: From the most open to the closest.
ORDER = tuple(Shows)


@dataclass(frozen=True, slots=True)
class Feedback:
    """What a student sees of one criterion."""

    shows: Shows = Shows.ALL  # how much
    # The last day on which that holds, as `2026-12-01`, after which all is shown; `due_date` or `published` for what
    # only a platform knows; empty for ever.
    until: str = ""

    def on(self, day: str) -> Shows:
        """Return how much is shown on a day, written as `2026-12-01`."""
        over = _DATE.fullmatch(self.until) is not None and day > self.until
        return Shows.ALL if over else self.shows


#: Where a rubric says nothing else.
OPEN = Feedback()


def strictest(shown: tuple[Shows, ...]) -> Shows:
    """Return the closest of several; all is shown of none."""
    return max(shown, key=ORDER.index, default=Shows.ALL)


#: What may stand in a rubric in the place of a variant.
Value = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Variant:
    """The values of one exercise for one student."""

    student: str  # whose they are, as staff wrote it; empty for nobody's
    values: tuple[tuple[str, Value], ...]  # name and value, in the order of the rubric

    @property
    def said(self) -> str:
        """The values, each with its name."""
        return ", ".join(f"{name.replace('_', ' ')} {written(value)}" for name, value in self.values)


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of all exercises for one student."""

    student: str  # whose they are
    values: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)  # exercise id -> name -> value


def variant_notes(variant: Variant | None) -> tuple[str, ...]:
    """Return what a report says of the variant that was graded; nothing if nothing varies."""
    return () if variant is None else (f"graded by the variant of {variant.student}: {variant.said}",)


def written(value: Value) -> str:
    """Return a value as a rubric writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)


def exercise_name(number: str) -> str:
    """Return what an exercise is called by its number: `Exercise 1`, but `Project 1` if the number says so itself."""
    return f"Exercise {number}" if number[:1].isdigit() else number


class Outcome(str, Enum):
    """What judging a criterion came to."""

    MET = "met"
    PARTLY = "partly"
    NOT_MET = "not_met"
    BLOCKED = "blocked"
    UNDECIDED = "undecided"


@dataclass(frozen=True, slots=True)
class Location:
    """A place in a student's file; lines count from 1."""

    file: str
    line: int


@dataclass(frozen=True, slots=True)
class Finding:
    """What a check found in a trace."""

    credit: Fraction  # share of the points earned, in [0, 1]
    reason: str  # one sentence in the form `where: what was found, what was expected`; no markup
    # Plain JSON values behind the reason; keys in a fixed order
    evidence: Mapping[str, Any] = field(default_factory=dict)
    location: Location | None = None  # place in the student's file, if the trace names one
    hint: str = ""  # one thing to do; empty if nothing is very likely right
    blocked_by: str | None = None  # id of the criterion without which this question cannot be asked; credit is then 0
    problem: Problem | None = None  # what is wrong, where diagnosis can say more about it; no report shows this


class Check(Protocol):
    """A typed question about a trace: a frozen dataclass whose fields are the rubric's parameters."""

    def judge(self, trace: Trace) -> Finding:
        """Return what the trace says; pure, and never raises for anything a student can do."""


@runtime_checkable
class SourceCheck(Protocol):
    """A check that also reads the text of the students' files."""

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        """Return what the files, by their wanted names, and the trace say; as pure as `judge`."""


@dataclass(frozen=True, slots=True)
class Criterion:
    """One row of a rubric."""

    id: str  # unique within the exercise, fixed for ever
    title: str  # what a reader sees
    points: Fraction  # above 0
    scenario: str  # id of the scenario whose trace is judged
    check: Check  # the question
    needs: tuple[str, ...] = ()  # ids of criteria that must be met or partly met for this one to make sense
    hint: str = ""  # what to tell a student who did not meet it, if the check has nothing better
    # Which part of the text asks for it, e.g. `Exercise 1, acceptance criterion 2`; empty if none does.
    chapter: str = ""
    feedback: Feedback = OPEN  # how much of its result a student is shown
    # What the rubric calls its check; says nothing that the check does not
    check_name: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Exercise:
    """One rubric file."""

    id: str  # unique, e.g. `velocity_publisher`
    number: str  # number in the chapter, as text
    title: str  # what a reader sees
    required: bool  # whether the chapter requires it
    files: tuple[str, ...]  # file names a submission must hold, in order
    scenarios: tuple[Scenario, ...]  # what is recorded, in order
    criteria: tuple[Criterion, ...]  # what is judged, in order
    digest: str  # `sha256:` over the bytes of the rubric file and of the checks of its own
    by_request: bool = False  # whether it is graded only where somebody asks for it
    # The values that differ from student to student, as they are in here; None if none do
    variant: Variant | None = None
