"""The JSON Schema of rubric files, which editors use to complete and check them.

`python -m grader.grading.rubrics.schema` prints the shipped schema.
"""

from __future__ import annotations

import json
import sys
from collections.abc import Mapping
from typing import Any

from pydantic.json_schema import JsonSchemaValue

from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.model import rubric_model
from grader.grading.rubrics.variants import REFERENCE

#: The identifier of the schema, the same in every version that reads `grader/rubric/v1`.
ID = "urn:rclpy-grader:rubric:v1"
#: The name of the file that rubrics refer to in their first line, for editors.
FILE = "rubric.schema.json"
#: What only a rubric can lack that names tests.
_OF_CHECKS = ("scenarios", "criteria")
_SCALARS = frozenset({"string", "number", "integer", "boolean"})
_VARIANT = "VariantReference"
_REFERS = {"$ref": f"#/$defs/{_VARIANT}"}
_REFERENCE = {
    "type": "object",
    "description": "The value that one of `variants` has for the student who is graded.",
    "properties": {REFERENCE: {"type": "string"}},
    "required": [REFERENCE],
    "additionalProperties": False,
}
#: Definitions in which nothing varies, and those in which only some keys do.
_FIXED = frozenset({"ExerciseShape", "FeedbackShape", "LimitsShape", "VariantShape", "Check", "StimulusShape"})
_FREE = {"Criterion": ("title", "hint"), "ScenarioShape": ("shutdown",)}


def rubric_schema(checks: Mapping[str, type] | None = None) -> JsonSchemaValue:
    """Return the JSON Schema (2020-12) of rubric files."""
    usable = known_checks() if checks is None else checks
    schema = rubric_model(tuple(usable.items())).model_json_schema(by_alias=True)
    tidy = _tidy(schema)
    tidy["required"] = [key for key in tidy["required"] if key not in _OF_CHECKS]
    tidy["anyOf"] = [{"required": [*_OF_CHECKS]}, {"required": ["pytest"]}]
    tidy["$defs"] = {name: _varying(name, node) for name, node in tidy["$defs"].items()} | {_VARIANT: _REFERENCE}
    return {"$schema": "https://json-schema.org/draft/2020-12/schema", "$id": ID, **tidy}


def schema_text(checks: Mapping[str, type] | None = None) -> str:
    """Return the schema as text; that of the built-in checks is shipped."""
    return json.dumps(rubric_schema(checks), indent=2, ensure_ascii=False) + "\n"


def _varying(name: str, node: JsonSchemaValue) -> JsonSchemaValue:
    """Return the definition of a mapping whose values may be variants."""
    if name in _FIXED:
        return node
    if "properties" not in node:
        return _or_variant(node)
    kept = _FREE.get(name, tuple(node["properties"]))
    free = {key: _or_variant(value) if key in kept else value for key, value in node["properties"].items()}
    return {**node, "properties": free}


def _or_variant(node: JsonSchemaValue) -> JsonSchemaValue:
    """Return a schema of values that also accepts a variant."""
    for word in ("anyOf", "oneOf"):
        if word in node:
            rest = {key: value for key, value in node.items() if key != word}
            options = [_inside(option) for option in node[word]]
            # One mapping may match several: the fields of a message, something drawn, a variant.
            return {**rest, "anyOf": [*options, _REFERS] if any(map(_is_scalar, node[word])) else options}
    return {"anyOf": [node, _REFERS]} if _is_scalar(node) else _inside(node)


def _inside(node: JsonSchemaValue) -> JsonSchemaValue:
    """Return a schema of a list or mapping whose values may be variants."""
    found = dict(node)
    for word in ("items", "additionalProperties"):
        if isinstance(node.get(word), dict):
            found[word] = _or_variant(node[word])
    if "prefixItems" in node:
        found["prefixItems"] = [_or_variant(item) for item in node["prefixItems"]]
    return found


def _is_scalar(node: JsonSchemaValue) -> bool:
    options = [*node.get("anyOf", ()), *node.get("oneOf", ())]
    if options:
        return any(map(_is_scalar, options))
    kinds = node.get("type", ())
    return bool({kinds} & _SCALARS if isinstance(kinds, str) else set(kinds) & _SCALARS)


def _tidy(node: object, *, names: bool = False) -> Any:
    """Remove titles and defaults that describe Python; `names` tells that the keys are names, not schema keywords."""
    if isinstance(node, list):
        return [_tidy(item) for item in node]
    if not isinstance(node, dict):
        return node
    kept = node if names else {key: value for key, value in node.items() if not _misleads(key, value, node)}
    return {key: _tidy(value, names=not names and key in ("properties", "$defs")) for key, value in kept.items()}


def _misleads(key: str, value: object, node: JsonSchemaValue) -> bool:
    """Return whether a schema entry describes Python instead of the rubric."""
    if key == "title":
        return isinstance(value, str)
    # A default in nanoseconds is not a text with a unit.
    return key == "default" and (value is None or (node.get("type") == "string" and not isinstance(value, str)))


if __name__ == "__main__":
    sys.stdout.write(schema_text())
