"""What gives a report again: the command, and digests of all that it read besides the submission."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence

from grader.app.request import GradeRequest
from grader.core.exercise import Exercise
from grader.core.limits import TIME_BUDGET_S
from grader.core.report import Reproduction
from grader.execution.bag import Odometry


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
