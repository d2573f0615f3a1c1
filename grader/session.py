"""One submission graded from end to end: the visible list of stages."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

from grader.model.report import Report


@dataclass(frozen=True, slots=True)
class Request:
    """What is to be graded, and how.

    Attributes:
        submission: Path as the user typed it.
        exercises: Exercise ids to grade; empty for all of the rubrics.
        rubrics: Rubric files; empty for the built-in ones.
        seed: Seed of every drawn value; None derives it from the submission.
        odom_bag: An /odom recording to play instead of the project's own.
        clock: `virtual`, `wall` or `auto`.
        isolation: `auto` or `none`.
    """

    submission: str
    exercises: tuple[str, ...] = ()
    rubrics: tuple[Path, ...] = ()
    seed: int | None = None
    odom_bag: Path | None = None
    clock: str = "auto"
    isolation: str = "auto"


class Progress(Protocol):
    """Hears what is being done, in a short phrase such as `exercise 1: alone`."""

    def __call__(self, step: str) -> None:
        """Take note of the step that begins."""
        ...


def grade(request: Request, progress: Progress) -> Report:
    """Grade one submission.

    Raises:
        GraderError: Something that grading needs cannot be used; its class says who must act.
    """
    raise NotImplementedError
