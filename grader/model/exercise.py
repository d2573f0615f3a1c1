"""Exercises: what a rubric file says, as values; and the contract between a trace and a check."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction
from typing import Any, Protocol, runtime_checkable

from grader.model.feedback import OPEN, Feedback
from grader.model.problem import Problem
from grader.model.scenario import Scenario
from grader.model.trace import Trace
from grader.model.variant import Variant


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
        problem: What is wrong, where diagnosis can say more about it; no report shows this.
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
