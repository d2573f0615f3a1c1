"""Renders one student's values of an exercise, as part of a task sheet and as JSON."""

from __future__ import annotations

import json

from grader.core.exercise import Exercise, Variant, written
from grader.reporting.escape import json_value, markdown, markdown_code

SCHEMA = "grader/variant/v1"


def render_sheet(exercise: Exercise) -> str:
    """Return the values as a Markdown table, or a sentence if the exercise is the same for everybody."""
    title = f"## Exercise {markdown(exercise.number)}: {markdown(exercise.title)}\n"
    variant = exercise.variant
    if variant is None:
        return f"{title}\nThis exercise is the same for everybody.\n"
    rows = [f"| {markdown(_spaced(name))} | {markdown_code(written(value))} |" for name, value in variant.values]
    whose = f"\nThe values of {markdown(variant.student)}:\n"
    return "\n".join([title + whose, "| | |", "|:--|:--|", *rows]) + "\n"


def sheet_to_json(exercise: Exercise) -> str:
    """Return the values as JSON text."""
    variant = exercise.variant or Variant("", ())
    data = {
        "schema": SCHEMA,
        "exercise": exercise.id,
        "student": json_value(variant.student),
        "values": {name: json_value(value) for name, value in variant.values},
        "rubric": exercise.digest,
    }
    return json.dumps(data, indent=2, allow_nan=False) + "\n"


def _spaced(name: str) -> str:
    return name.replace("_", " ")
