"""A request to grade a submission, as JSON in evidence, and as the command that reproduces its result."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import field, replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from grader.grading.app.seeds import PRACTICE, SeedKey
from grader.grading.model.exercise import Drawn, Exercise
from grader.grading.model.grading_options import GradingOptions, option_words, options_of_json, options_to_json, values
from grader.grading.model.report import JsonObject, Reproduction
from grader.grading.rubrics.draws import Draw, Recorded
from grader.runtime.model.dataclass import dataclass

if TYPE_CHECKING:
    from grader.grading.submissions.collected import Collected


@dataclass(frozen=True, slots=True)
class GradeRequest(GradingOptions):
    """What to grade, and how: the options of the run, and what is known of the submission."""

    submission: str  # path as the user typed it
    seed_key: SeedKey = field(default=PRACTICE, kw_only=True)  # the key to derive the seed with
    # Most scenarios recorded in parallel; None for one per processor. Does not affect the result.
    workers: int | None = field(default=None, kw_only=True)
    # The files of the submission if they were read before, perhaps on another machine; None to read them now
    collected: Collected | None = field(default=None, kw_only=True)
    # Evidence of the same submission, graded under the same conditions by perhaps another rubric; its recordings of
    # unchanged exercises are used instead of a run. None to record everything.
    recordings: Path | None = field(default=None, kw_only=True)
    # Supplies variant values; if None, rubrics with variants are refused
    draw: Draw | None = field(default=None, kw_only=True)


def request_for(submission: str, options: GradingOptions, **known: Any) -> GradeRequest:
    """Return the request to grade a submission with these options; `known` are the other fields."""
    return GradeRequest(submission, **values(options), **known)


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
    return ("grade", _unambiguous_path(request.submission), *option_words(replace(request, seed=seed)))


def _unambiguous_path(path: str) -> str:
    """Return a path that cannot be mistaken for an option or a subcommand."""
    return path if os.sep in path or path in (".", "..") else os.path.join(".", path)  # noqa: PTH118  a bare ./


def request_to_json(request: GradeRequest, exercises: Sequence[Exercise] = ()) -> JsonObject:
    """Convert to JSON what reproduces a report besides path, seed and rubrics, and add the variant values."""
    return {
        **options_to_json(request),
        "variants": {e.id: dict(e.variant.values) for e in exercises if e.variant is not None},
    }


def request_of(data: dict[str, Any], *, submission: str, seed: int, rubrics: tuple[Path, ...]) -> GradeRequest:
    """Return the request that would record a kept run again and judge it by these rubrics."""
    asked = options_of_json(data, GradeRequest(submission, rubrics=rubrics, seed=seed))
    return replace(asked, draw=Recorded(Drawn(asked.student, data.get("variants", {}))))
