"""What a user asks to be graded, and how."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from grader.app.seeds import PRACTICE, SeedKey
from grader.core.exercise import Exercise
from grader.core.limits import TIME_BUDGET_S
from grader.core.report import Reproduction
from grader.execution.bag import Odometry
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


def reproduction(
    request: GradeRequest, exercises: Sequence[Exercise], odometry: Odometry | None, seed: int
) -> Reproduction:
    """Return what gives a report again.

    Args:
        request: What was asked for.
        exercises: The exercises graded.
        odometry: The /odom recording that was played, if one was.
        seed: The seed used, also where none was asked for.
    """
    return Reproduction(
        command=command_words(request, seed),
        rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises),
        recording="" if odometry is None else recording_digest(odometry),
    )


def command_words(request: GradeRequest, seed: int) -> tuple[str, ...]:
    """Return the words of the command, with the seed used and every option that the result depends on."""
    words = ["grade", _plainly_a_path(request.submission)]
    for exercise in request.exercises:
        words += ["--exercise", exercise]
    if request.every:
        words.append("--all")
    for rubric in request.rubrics:
        words += ["--rubric", str(rubric)]
    words += ["--seed", str(seed)]
    if request.student:
        words += ["--student", request.student]
    if request.variant_key is not None:
        words += ["--variant-key", str(request.variant_key)]
    if request.odom_bag is not None:
        words += ["--odom-bag", str(request.odom_bag)]
    if request.clock != "auto":
        words += ["--clock", request.clock]
    if request.isolation != "auto":
        words += ["--isolation", request.isolation]
    if request.time_budget_s != TIME_BUDGET_S:
        words += ["--time-budget", f"{request.time_budget_s:g}"]
    if request.spot_checks:
        words += ["--spot-checks", f"{request.spot_checks:.6%}".rstrip("%").rstrip("0").rstrip(".") + "%"]
    return tuple(words)


def recording_digest(odometry: Odometry) -> str:
    """Return `sha256:` over the topic, times and bytes of a recording, however it is stored."""
    digest = hashlib.sha256(f"{odometry.topic}\n".encode())
    for message in odometry.messages:
        digest.update(f"{message.t_ns} {len(message.cdr)}\n".encode() + message.cdr)
    return f"sha256:{digest.hexdigest()}"


def _plainly_a_path(path: str) -> str:
    """Return a path that is taken neither for an option nor for the name of a command."""
    return path if os.sep in path or path in (".", "..") else os.path.join(".", path)  # noqa: PTH118  a bare ./
