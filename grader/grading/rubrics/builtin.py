"""Rubrics that ship with the grader, which are also kept in a compiled form."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path, PurePath
from typing import Any

from grader.grading.model.exercise import Exercise
from grader.grading.model.rubric_files import rubrics_in
from grader.runtime.compiled import COMPILED, compiled, state_in, state_of_package
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import printable
from grader.runtime.shipped import shipped

#: The type of the messages in the recording that ships with the grader.
ODOMETRY = "nav_msgs/msg/Odometry"


def builtin_recording() -> Path:
    """Return the recording that the stimulus `recorded` plays without `bag`: a minute of a robot's odometry."""
    rubrics = shipped("rubrics")
    return next(rubrics.glob("*/odometry"), rubrics / "odometry")


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a built-in rubric, without its scenarios; see Exercise."""

    path: Path
    id: str
    number: str
    by_request: bool


@cache
def builtin_exercises() -> tuple[Exercise, ...]:
    """Return the built-in exercises, ordered by number; raises RubricError without any."""
    return exercises_in(shipped("rubrics"), COMPILED)


def exercises_in(rubrics: Path, forms: Path) -> tuple[Exercise, ...]:
    """Return the exercises of a folder of rubrics, ordered by number, of which another folder keeps a compiled form."""
    return compiled("rubrics", state_in(rubrics) + state_of_package(), lambda: _read_exercises(rubrics), forms)


def _read_exercises(rubrics: Path) -> tuple[Exercise, ...]:
    # Slow to import; the cached form does not need it.
    from grader.grading.rubrics.loader import read_rubric  # noqa: PLC0415

    return tuple(read_rubric(header.path) for header in headers_in(rubrics))


def builtin_rubrics() -> Mapping[str, Path]:
    """Return the built-in rubrics as exercise id -> YAML file, ordered by number; raises RubricError without any."""
    return {header.id: header.path for header in builtin_headers()}


def builtin_headers() -> tuple[Header, ...]:
    """Return the headers of the built-in rubrics, ordered by exercise number; raises RubricError without any."""
    return headers_in(shipped("rubrics"))


def headers_in(rubrics: Path) -> tuple[Header, ...]:
    """Return the headers of the rubrics in a folder, ordered by exercise number; raises RubricError without any."""
    paths = rubrics_in(rubrics)
    if not paths:
        raise RubricError(f"{printable(str(rubrics), 500)}: expected the built-in rubrics, found none", "install again")
    return tuple(sorted(map(_header, paths), key=lambda header: _number_order(header.number)))


def _header(path: Path) -> Header:
    """Read the header of a built-in rubric, without validating the rest."""
    from grader.grading.rubrics.yaml_tree import read_yaml  # noqa: PLC0415 - as above

    above, _, _ = path.read_text(encoding="utf-8").partition("\nscenarios:")
    tree: Any = read_yaml(above).data
    exercise = tree["exercise"]
    return Header(path, exercise["id"], str(exercise["number"]), exercise.get("by_request", False))


def _number_order(number: str) -> list[tuple[int, str]]:
    """Return a sort key that puts 2 before 10 and numbers before words."""
    return [(int(part), "") if part.isdigit() else (1 << 62, part) for part in re.findall(r"[0-9]+|[^0-9]+", number)]


def exercise_ids(names: Sequence[str], exercises: Sequence[Exercise]) -> tuple[str, ...]:
    """Return the ids of the exercises that names stand for, without repetitions.

    A name is an id, a number as `1` or `project 2`, or the name of a file that an exercise requires. Raises RubricError
    for the first one that is unknown, with the most similar id.
    """
    known = [exercise.id for exercise in exercises]
    found: list[str] = []
    for name in names:
        named = [name] if name in known else [exercise.id for exercise in exercises if _is_called(exercise, name)]
        if not named:
            nearest = difflib.get_close_matches(name, known, n=1, cutoff=0.3)
            expected = f"one of {', '.join(known)}; its number, or the name of a file"
            hint = f"did you mean {nearest[0]}" if nearest else "grade --exercise 1 grades the first exercise"
            raise RubricError(f"--exercise {name}: expected {expected}, found {name}", hint)
        found += named
    return tuple(dict.fromkeys(found))


def _is_called(exercise: Exercise, name: str) -> bool:
    plain = re.sub(r"[\s_-]+", " ", name.strip().casefold()).removeprefix("exercise ")
    return plain == exercise.number.casefold() or PurePath(name).name in exercise.files
