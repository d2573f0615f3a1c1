"""Explanations: what a criterion or a check asks, in the words of its rubric and its manual."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction


@dataclass(frozen=True, slots=True)
class Parameter:
    """One parameter of a check.

    Attributes:
        name: As in rubrics.
        value: As a rubric writes it; empty where there is none.
        meaning: What the manual says of it.
        required: Whether a rubric has to give it.
    """

    name: str
    value: str
    meaning: str
    required: bool = False


@dataclass(frozen=True, slots=True)
class CheckExplanation:
    """What a check asks of a recording, whatever rubric uses it.

    Attributes:
        name: As in rubrics.
        asks: What it asks, in one sentence or two.
        details: How it measures that; may be empty.
        parameters: In order, with their defaults.
        used_by: Criteria that ask it, as `exercise/criterion`.
    """

    name: str
    asks: str
    details: str
    parameters: tuple[Parameter, ...]
    used_by: tuple[str, ...]


@dataclass(frozen=True, slots=True)
class CriterionExplanation:
    """What a criterion asks of a submission.

    Attributes:
        id: Criterion id.
        title: Criterion title.
        exercise: Number, title and id of its exercise.
        points: Points to be had.
        chapter: Which part of the chapter asks for it; empty if none does.
        needs: Criteria that must be met first.
        hint: What its rubric tells a student who did not meet it.
        situation: What runs, for how long, and what is published meanwhile.
        check: Name of the check.
        asks: What the check asks.
        details: How the check measures that.
        parameters: With the values of the rubric.
    """

    id: str
    title: str
    exercise: str
    points: Fraction
    chapter: str
    needs: tuple[str, ...]
    hint: str
    situation: str
    check: str
    asks: str
    details: str
    parameters: tuple[Parameter, ...]
