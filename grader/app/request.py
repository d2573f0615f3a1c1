"""A request to grade a submission, as JSON in evidence, and as the command that reproduces its result."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.app.seeds import PRACTICE, SeedKey
from grader.core.dataclass import dataclass
from grader.core.exercise import Drawn, Exercise
from grader.core.limits import TIME_BUDGET_S
from grader.core.report import JsonObject, Reproduction
from grader.rubrics.draws import Draw, Recorded

if TYPE_CHECKING:
    from grader.execution.bag import Odometry
    from grader.submissions.collected import Collected


@dataclass(frozen=True, slots=True)
class GradeRequest:
    """What to grade, and how."""

    submission: str  # path as the user typed it
    # Exercises to grade, by id, number or file; empty for all exercises of the rubrics, except built-in ones that are
    # only graded by request.
    exercises: tuple[str, ...] = ()
    every: bool = False  # whether to grade exactly the exercises that the submission has a file for
    rubrics: tuple[Path, ...] = ()  # rubric files; empty for the built-in ones
    seed: int | None = None  # seed of all drawn values; None derives it from the submission and the seed key
    seed_key: SeedKey = PRACTICE  # the key to derive the seed with
    odom_bag: Path | None = None  # an /odom recording to play instead of the built-in one
    clock: str = "auto"  # `virtual`, `wall` or `auto`
    isolation: str = "auto"  # `auto`, `none` or the name of a tier
    time_budget_s: float = TIME_BUDGET_S  # real time that all recordings together may take
    # Most scenarios recorded in parallel; None for one per processor. Does not affect the result.
    workers: int | None = None
    spot_checks: float = 0.0  # share of submissions, from 0 to 1, that are also recorded on the wall clock
    # The files of the submission if they were read before, perhaps on another machine; None to read them now
    collected: Collected | None = None
    # Evidence of the same submission, graded under the same conditions by perhaps another rubric; its recordings of
    # unchanged exercises are used instead of a run. None to record everything.
    recordings: Path | None = None
    student: str = ""  # id of the student whose variant is graded; empty if nothing varies
    variant_key: Path | None = None  # file with the course key, as the user typed it; None if not given
    interfaces: tuple[Path, ...] = ()  # folders with interface packages for the whole class
    draw: Draw | None = None  # supplies variant values; if None, rubrics with variants are refused


def reproduction(
    request: GradeRequest, exercises: Sequence[Exercise], odometry: Odometry | None, seed: int
) -> Reproduction:
    """Return the command that reproduces a report, with digests of all that it reads besides the submission."""
    return Reproduction(
        command=command_words(request, seed),
        rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises),
        recording="" if odometry is None else recording_digest(odometry),
    )


def command_words(request: GradeRequest, seed: int) -> tuple[str, ...]:
    """Return the words of the command, with the seed and every option that affects the result."""
    words = ["grade", _unambiguous_path(request.submission)]
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
    for folder in request.interfaces:
        words += ["--interfaces", str(folder)]
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
    """Return `sha256:` over the topic, times and bytes of a recording; independent of the storage format."""
    digest = hashlib.sha256(f"{odometry.topic}\n".encode())
    for message in odometry.messages:
        digest.update(f"{message.t_ns} {len(message.cdr)}\n".encode() + message.cdr)
    return f"sha256:{digest.hexdigest()}"


def _unambiguous_path(path: str) -> str:
    """Return a path that cannot be mistaken for an option or a subcommand."""
    return path if os.sep in path or path in (".", "..") else os.path.join(".", path)  # noqa: PTH118  a bare ./


def request_to_json(request: GradeRequest, exercises: Sequence[Exercise] = ()) -> JsonObject:
    """Convert to JSON what reproduces a report besides path, seed and rubrics, and add the variant values."""
    return {
        "exercises": list(request.exercises),
        "odom_bag": None if request.odom_bag is None else str(request.odom_bag),
        "clock": request.clock,
        "isolation": request.isolation,
        "student": request.student,
        "variant_key": None if request.variant_key is None else str(request.variant_key),
        **({"interfaces": [str(folder) for folder in request.interfaces]} if request.interfaces else {}),
        "variants": {e.id: dict(e.variant.values) for e in exercises if e.variant is not None},
    }


def request_of(data: dict[str, Any], *, submission: str, seed: int, rubrics: tuple[Path, ...]) -> GradeRequest:
    """Return the request that would record a kept run again and judge it by these rubrics."""
    bag, key, student = data.get("odom_bag"), data.get("variant_key"), str(data.get("student", ""))
    return GradeRequest(
        submission=submission,
        exercises=tuple(str(id_) for id_ in data.get("exercises", ())),
        rubrics=rubrics,
        seed=seed,
        odom_bag=Path(str(bag)) if bag is not None else None,
        clock=str(data.get("clock", "auto")),
        isolation=str(data.get("isolation", "auto")),
        student=student,
        variant_key=None if key is None else Path(str(key)),
        interfaces=tuple(Path(str(folder)) for folder in data.get("interfaces", ())),
        draw=Recorded(Drawn(student, data.get("variants", {}))),
    )
