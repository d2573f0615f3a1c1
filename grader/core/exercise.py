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
    """The kinds of problems that checks find; diagnosis and the page of a class tell problems apart by them."""

    ABSENT = "absent"  # there is no such publisher, subscription, server, node or parameter
    OTHER_NAME = "other_name"  # there is one of another name
    OTHER_TYPE = "other_type"  # there is one of another type
    SILENT = "silent"  # it is there, and sends nothing
    TOO_FEW = "too_few"  # fewer messages, requests or responses than asked for
    TOO_MANY = "too_many"  # more of them
    TOO_LATE = "too_late"  # what is asked for comes, but late
    WRONG_RATE = "wrong_rate"  # the time between messages, requests or logs is wrong
    RATE_CHANGES = "rate_changes"  # the rate is right on average, but not to the end
    BURSTS = "bursts"  # several messages come at once
    STOPPED = "stopped"  # messages came, and then no more
    NO_MESSAGE = "no_message"  # none ever came
    NO_FIELD = "no_field"  # the type of the messages has no such field
    NO_NUMBER = "no_number"  # the type of the messages has no number in it
    WRONG_VALUE = "wrong_value"  # a value is another than asked for
    NOT_RANDOM = "not_random"  # the values follow a pattern
    CONSTANT = "constant"  # the values are all the same
    NEVER_CHANGES = "never_changes"  # the answer cannot change, because the input stays on one side of the threshold
    WRONG_ANSWER = "wrong_answer"  # an answer does not fit its input, or one of the two is never given
    NO_ANSWER = "no_answer"  # an input or a request is never answered
    REFUSED = "refused"  # a goal or a transition is refused
    BEHIND = "behind"  # each answer fits an earlier input
    CONTRADICTION = "contradiction"  # two answers come at one instant
    KEPT_APART = "kept_apart"  # types or QoS keep publisher and subscription from talking to each other
    NO_EDGE = "no_edge"  # two processes are not joined in the graph
    COUNT_START = "count_start"  # a count starts at another number
    ONE_PER_MESSAGE = "one_per_message"  # there is a log for every message
    NO_NODE = "no_node"  # a program writes, but has no node
    NOT_LOGGED = "not_logged"  # nothing is logged, or not all of it
    PRINTED = "printed"  # it is printed instead of logged
    AMONG_OTHERS = "among_others"  # the right values are logged among so many others that they show nothing
    ERRORS_LOGGED = "errors_logged"  # records say that something failed
    ENDED = "ended"  # a program ends by itself too early
    STILL_RUNNING = "still_running"  # a program does not end when it is stopped


@dataclass(frozen=True, slots=True)
class Problem:
    """One problem.

    Attributes:
        kind: What is wrong.
        topics: The topics that it is about, where a check looks at several.
        detail: What tells problems of this kind apart, e.g. `swapped` for wrong positions; empty if nothing does.
        start: The number that a count starts at; None for problems of other kinds; no report shows this.
    """

    kind: ProblemKind
    topics: tuple[str, ...] = ()
    detail: str = ""
    start: int | None = None


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
    """What a student sees of one criterion.

    Attributes:
        shows: How much.
        until: The last day on which that holds, as `2026-12-01`, after which all is shown; `due_date` or `published`
            for what only a platform knows; empty for ever.
    """

    shows: Shows = Shows.ALL
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
    """The values of one exercise for one student.

    Attributes:
        student: Whose they are, as staff wrote it; empty for nobody's.
        values: Name and value, in the order of the rubric.
    """

    student: str
    values: tuple[tuple[str, Value], ...]

    @property
    def said(self) -> str:
        """The values, each with its name."""
        return ", ".join(f"{name.replace('_', ' ')} {written(value)}" for name, value in self.values)


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of all exercises for one student.

    Attributes:
        student: Whose they are.
        values: Exercise id -> name -> value.
    """

    student: str
    values: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)


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
    """What a check found in a trace.

    Attributes:
        credit: Share of the points earned, in [0, 1].
        reason: One sentence in the form `where: what was found, what was expected`; no markup.
        evidence: Plain JSON values behind the reason; keys in a fixed order.
        location: Place in the student's file, if the trace names one.
        hint: One thing to do; empty if nothing is very likely right.
        blocked_by: Id of the criterion without which this question cannot be asked; credit is then 0.
        problem: What is wrong, where a check tells several problems apart.
    """

    credit: Fraction
    reason: str
    evidence: Mapping[str, Any] = field(default_factory=dict)
    location: Location | None = None
    hint: str = ""
    blocked_by: str | None = None
    problem: Problem | None = None


class Check(Protocol):
    """A typed question about a trace: a frozen dataclass whose fields are the rubric's parameters."""

    def judge(self, trace: Trace) -> Finding:
        """Return what the trace says; pure, and never raises for anything a student can do."""
        ...


@runtime_checkable
class SourceCheck(Protocol):
    """A check that also reads the text of the students' files."""

    def judge_sources(self, trace: Trace, sources: Mapping[str, str]) -> Finding:
        """Return what the files, by their wanted names, and the trace say; as pure as `judge`."""
        ...


@dataclass(frozen=True, slots=True)
class Criterion:
    """One row of a rubric.

    Attributes:
        id: Unique within the exercise, fixed for ever.
        title: What a reader sees.
        points: Above 0.
        scenario: Id of the scenario whose trace is judged.
        check: The question.
        needs: Ids of criteria that must be met or partly met for this one to make sense.
        hint: What to tell a student who did not meet it, if the check has nothing better.
        chapter: Which part of the text asks for it, e.g. `Exercise 1, acceptance criterion 2`; empty if none does.
        feedback: How much of its result a student is shown.
        check_name: What the rubric calls its check; says nothing that the check does not.
    """

    id: str
    title: str
    points: Fraction
    scenario: str
    check: Check
    needs: tuple[str, ...] = ()
    hint: str = ""
    chapter: str = ""
    feedback: Feedback = OPEN
    check_name: str = field(default="", compare=False)


@dataclass(frozen=True, slots=True)
class Exercise:
    """One rubric file.

    Attributes:
        id: Unique, e.g. `velocity_publisher`.
        number: Number in the chapter, as text.
        title: What a reader sees.
        required: Whether the chapter requires it.
        files: File names a submission must hold, in order.
        scenarios: What is recorded, in order.
        criteria: What is judged, in order.
        digest: `sha256:` over the bytes of the rubric file and of the checks of its own.
        by_request: Whether it is graded only where somebody asks for it.
        variant: The values that differ from student to student, as they are in here; None if none do.
    """

    id: str
    number: str
    title: str
    required: bool
    files: tuple[str, ...]
    scenarios: tuple[Scenario, ...]
    criteria: tuple[Criterion, ...]
    digest: str
    by_request: bool = False
    variant: Variant | None = None
