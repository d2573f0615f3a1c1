"""A request to grade a submission, as JSON in evidence, and as the command that reproduces its result."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.app.seeds import PRACTICE, SeedKey
from grader.core.dataclass import dataclass
from grader.core.exercise import Drawn, Exercise
from grader.core.limits import TIME_BUDGET_S
from grader.core.report import JsonObject, Reproduction
from grader.core.scenario import ODOMETRY
from grader.rubrics.draws import Draw, Recorded

if TYPE_CHECKING:
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
    # Recordings to play instead of those of the rubrics: `(name, path)`, where the name is a topic or a message type
    bags: tuple[tuple[str, Path], ...] = ()
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


def reproduction(request: GradeRequest, exercises: Sequence[Exercise], played: str, seed: int) -> Reproduction:
    """Return the command that reproduces a report, with digests of all that it reads besides the submission.

    `played` is the digest of the recordings that are played.
    """
    return Reproduction(
        command=command_words(request, seed),
        rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises),
        recording=played,
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
    for name, path in request.bags:
        words += ["--odom-bag", str(path)] if name == ODOMETRY else ["--recording", f"{name}={path}"]
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


def _unambiguous_path(path: str) -> str:
    """Return a path that cannot be mistaken for an option or a subcommand."""
    return path if os.sep in path or path in (".", "..") else os.path.join(".", path)  # noqa: PTH118  a bare ./


def request_to_json(request: GradeRequest, exercises: Sequence[Exercise] = ()) -> JsonObject:
    """Convert to JSON what reproduces a report besides path, seed and rubrics, and add the variant values."""
    bags = dict(request.bags)
    return {
        "exercises": list(request.exercises),
        "odom_bag": str(bags.pop(ODOMETRY)) if ODOMETRY in bags else None,
        **({"recordings": {name: str(path) for name, path in bags.items()}} if bags else {}),
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
    bags = {**({ODOMETRY: bag} if bag is not None else {}), **data.get("recordings", {})}
    return GradeRequest(
        submission=submission,
        exercises=tuple(str(id_) for id_ in data.get("exercises", ())),
        rubrics=rubrics,
        seed=seed,
        bags=tuple((str(name), Path(str(path))) for name, path in bags.items()),
        clock=str(data.get("clock", "auto")),
        isolation=str(data.get("isolation", "auto")),
        student=student,
        variant_key=None if key is None else Path(str(key)),
        interfaces=tuple(Path(str(folder)) for folder in data.get("interfaces", ())),
        draw=Recorded(Drawn(student, data.get("variants", {}))),
    )
