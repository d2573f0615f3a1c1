"""Drafts: what goes into the skeleton of a rubric, before it is text."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True, slots=True)
class Quantity:
    """Text that is written as it is: a number with its unit."""

    text: str


@dataclass(frozen=True, slots=True)
class DraftStimulus:
    """Something that the grader is to do to the nodes.

    Attributes:
        kind: Its key in a rubric.
        parameters: Its parameters, in order.
        comment: What the author has to decide; empty for nothing.
    """

    kind: str
    parameters: Mapping[str, Any]
    comment: str = ""


@dataclass(frozen=True, slots=True)
class DraftCriterion:
    """A row that the rubric may have.

    Attributes:
        id: Its id.
        title: Its title.
        check: Name of its check.
        parameters: The check's parameters, in order.
        hint: What a student is told who misses it.
        needs: Id of the criterion without which it makes no sense; empty for none.
        comment: What the author has to decide; empty for nothing.
    """

    id: str
    title: str
    check: str
    parameters: Mapping[str, Any]
    hint: str
    needs: str = ""
    comment: str = ""


@dataclass(frozen=True, slots=True)
class Draft:
    """All that goes into a skeleton.

    Attributes:
        id: Id of the exercise.
        files: Files of the reference, each a process.
        duration_s: How long the scenario is observed.
        after: Topic whose first message starts the clock; empty for the start of the nodes.
        may_exit: Files that end by themselves.
        stimuli: What the grader does meanwhile.
        criteria: The rows.
        remarks: What else the author has to know, one sentence each.
    """

    id: str
    files: tuple[str, ...]
    duration_s: float
    after: str = ""
    may_exit: tuple[str, ...] = ()
    stimuli: tuple[DraftStimulus, ...] = ()
    criteria: tuple[DraftCriterion, ...] = ()
    remarks: tuple[str, ...] = ()


def as_id(text: str) -> str:
    """Return an id made of any text: small letters, digits and `_`, a letter first."""
    words = re.sub(r"[^a-z0-9]+", "_", re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", text).lower()).strip("_")
    return words if words[:1].isalpha() else f"x_{words}".rstrip("_")
