"""The JSON Schema of rubric files, which lets editors complete and check them.

`python -m grader.reading.rubric_schema` prints it as it is shipped.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

from grader.judging.checks import CHECKS
from grader.reading.rubric_model import rubric_model


def rubric_schema(checks: Mapping[str, type] = CHECKS) -> dict[str, Any]:
    """Return the JSON Schema (2020-12) of rubric files.

    Args:
        checks: The table of checks that rubrics may use.
    """
    schema = rubric_model(tuple(checks.items())).model_json_schema(by_alias=True)
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", **_tidy(schema)}


def schema_text(checks: Mapping[str, type] = CHECKS) -> str:
    """Return the schema as text; that of the grader's own checks is shipped."""
    return json.dumps(rubric_schema(checks), indent=2, ensure_ascii=False) + "\n"


def _tidy(node: Any, *, names: bool = False) -> Any:
    """Drop what speaks of Python only: generated titles, and defaults that a rubric could not write.

    Args:
        node: Part of a schema.
        names: Whether the keys of `node` are names that a rubric uses, such as `title`, and not words of the schema.
    """
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = node if names else {key: value for key, value in node.items() if not _misleads(key, value, node)}
    return {key: _tidy(value, names=not names and key in ("properties", "$defs")) for key, value in kept.items()}


def _misleads(key: str, value: object, node: dict[str, Any]) -> bool:
    """Return whether a word of the schema speaks of Python instead of what a rubric holds."""
    if key == "title":
        return isinstance(value, str)
    # A default of nanoseconds is no text with a unit.
    return key == "default" and (value is None or (node.get("type") == "string" and not isinstance(value, str)))


if __name__ == "__main__":
    sys.stdout.write(schema_text())
