"""Files that ship with the grader: rubrics, templates and integrations."""

from __future__ import annotations

import difflib
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from grader.core.errors import RubricError
from grader.rubrics.loader import NOTES
from grader.rubrics.yaml_tree import read_yaml
from grader.submissions.collected import shown


def shipped(name: str) -> Path:
    """Return a shipped folder: `rubrics`, `student_template` or `integrations`."""
    package = Path(__file__).resolve().parent.parent
    inside = package / "shipped" / name
    return inside if inside.is_dir() else package.parent / name


def builtin_odometry() -> Path:
    """Return the project's own /odom recording."""
    return shipped("rubrics") / "odometry"


@dataclass(frozen=True, slots=True)
class Header:
    """The header of a built-in rubric, without its scenarios; see Exercise."""

    path: Path
    id: str
    number: str
    by_request: bool


def builtin_rubrics() -> Mapping[str, Path]:
    """Return the built-in rubrics as exercise id -> YAML file, ordered by number; raises RubricError without any."""
    return {header.id: header.path for header in builtin_headers()}


def builtin_headers() -> tuple[Header, ...]:
    """Return the headers of the built-in rubrics, ordered by exercise number; raises RubricError without any."""
    folder = shipped("rubrics")
    paths = [path for path in sorted(folder.glob("*.yaml")) if not path.name.endswith(NOTES)]
    if not paths:
        raise RubricError(f"{shown(str(folder), 500)}: expected the built-in rubrics, found none", "install again")
    return tuple(sorted(map(_header, paths), key=lambda header: _number_order(header.number)))


def _header(path: Path) -> Header:
    """Read the header of a built-in rubric, without validating the rest."""
    above, _, _ = path.read_text(encoding="utf-8").partition("\nscenarios:")
    tree: Any = read_yaml(above).data
    exercise = tree["exercise"]
    return Header(path, exercise["id"], str(exercise["number"]), exercise.get("by_request", False))


def _number_order(number: str) -> list[tuple[int, str]]:
    """Return a sort key that puts 2 before 10 and numbers before words."""
    return [(int(part), "") if part.isdigit() else (1 << 62, part) for part in re.findall(r"[0-9]+|[^0-9]+", number)]


def require_exercises(wanted: Sequence[str], known: Sequence[str]) -> None:
    """Raise RubricError for the first unknown exercise, with the most similar known name."""
    for exercise in wanted:
        if exercise not in known:
            nearest = difflib.get_close_matches(exercise, known, n=1, cutoff=0.3)
            hint = f"did you mean {nearest[0]}" if nearest else f"known are {', '.join(known)}"
            raise RubricError(f"--exercise {exercise}: expected one of {', '.join(known)}, found {exercise}", hint)
