"""Looks a rubric over for its author: whether it can be used, what it comes to, and what is odd about it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path

from grader.authoring.oddities import oddities
from grader.model.errors import RubricError
from grader.model.exercise import Exercise
from grader.reading.quoting import shown
from grader.reading.rubric_file import RubricMistakes, read_rubric
from grader.reading.variants import First
from grader.reading.yaml_tree import read_yaml


@dataclass(frozen=True, slots=True)
class Checked:
    """A rubric that can be used.

    Attributes:
        summary: What it comes to, on one line.
        warnings: What is odd, one line each, with line and column.
    """

    summary: str
    warnings: tuple[str, ...]


def check_rubric(path: Path) -> Checked:
    """Return what a rubric comes to.

    Raises:
        RubricError: It cannot be used; its message lists every mistake.
    """
    exercise = read_rubric(path, draw=First())
    where = shown(str(path), 500)
    odd = oddities(exercise, read_yaml(path.read_text(encoding="utf-8-sig")))
    return Checked(f"{where}: {_summary(exercise)}", tuple(f"{where}:{m.line}:{m.column}: {m.text}" for m in odd))


def complaints(error: RubricError) -> list[str]:
    """Return all that is wrong with a rubric, one line each, however much it is; remedies follow what they are for."""
    if not isinstance(error, RubricMistakes):
        hint = [f"hint: {error.hint}"] if error.hint else []
        return [*(f"error: {line}" for line in error.message.splitlines()), *hint]
    lines = []
    for mistake in error.mistakes:
        lines.append(f"error: {error.where}:{mistake.line}:{mistake.column}: {mistake.text}")
        lines += [f"hint: {mistake.hint}"] if mistake.hint else []
    return lines


def _summary(exercise: Exercise) -> str:
    points = sum((criterion.points for criterion in exercise.criteria), Fraction(0))
    parts = [_counted(len(exercise.scenarios), "scenario"), _counted(len(exercise.criteria), "criterion", "criteria")]
    return f"{exercise.id}: {', '.join(parts)}, {float(points):g} {'point' if points == 1 else 'points'}"


def _counted(count: int, one: str, many: str = "") -> str:
    return f"{count} {one}" if count == 1 else f"{count} {many or f'{one}s'}"
