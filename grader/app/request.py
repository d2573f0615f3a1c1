"""What a user asks to be graded, and how."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from grader.app.seeds import PRACTICE, SeedKey
from grader.core.limits import TIME_BUDGET_S
from grader.rubrics.variants import Draw
from grader.submissions.collected import Collected


@dataclass(frozen=True, slots=True)
class GradeRequest:
    """What is to be graded, and how.

    Attributes:
        submission: Path as the user typed it.
        exercises: Exercise ids to grade; empty for all of the rubrics, of the built-in ones for those that are not
            only graded by request.
        every: Whether to grade every exercise of which the submission has a file, and no other.
        rubrics: Rubric files; empty for the built-in ones.
        seed: Seed of every drawn value; None derives it from the submission and the seed key.
        seed_key: The key for that.
        odom_bag: An /odom recording to play instead of the project's own.
        clock: `virtual`, `wall` or `auto`.
        isolation: `auto`, `none` or the name of a tier.
        time_budget_s: Real time that all recordings may take together.
        workers: Most scenarios recorded side by side; None leaves it to the machine's processors. Changes no result.
        collected: What was read of the submission before, perhaps elsewhere; None to read it now.
        student: Id of the student whose variants are graded; empty where nothing varies.
        variant_key: File with the course key, as the user typed it; None if nobody did.
        spot_checks: Share of submissions, from 0 to 1, that are drawn to be recorded on the wall clock as well.
        draw: What variants come to; None if nobody says, and then a rubric that has some is refused.
    """

    submission: str
    exercises: tuple[str, ...] = ()
    every: bool = False
    rubrics: tuple[Path, ...] = ()
    seed: int | None = None
    seed_key: SeedKey = PRACTICE
    odom_bag: Path | None = None
    clock: str = "auto"
    isolation: str = "auto"
    time_budget_s: float = TIME_BUDGET_S
    workers: int | None = None
    spot_checks: float = 0.0
    collected: Collected | None = None
    student: str = ""
    variant_key: Path | None = None
    draw: Draw | None = None
