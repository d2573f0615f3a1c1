"""Translates pydantic's validation errors into mistakes, in the words and with the places of a rubric."""

from __future__ import annotations

import difflib
import json
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any, get_args

from pydantic import BaseModel, ValidationError
from pydantic_core import ErrorDetails

from grader.grading.rubrics.yaml_tree import Mistake, TreePath, YamlSyntaxError, YamlTree, nearest_position, read_yaml
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import listed, printable

__all__ = [
    "Mistake",
    "TreePath",
    "YamlSyntaxError",
    "YamlTree",
    "found",
    "mistakes_of",
    "nearest_hint",
    "read_yaml",
]

#: pydantic's kind of error -> what was expected.
_EXPECTED: Mapping[str, str] = {
    "string_type": "text",
    "int_type": "a whole number",
    "int_from_float": "a whole number",
    "float_type": "a number",
    "finite_number": "a finite number",
    "bool_type": "true or false",
    "tuple_type": "a list",
    "list_type": "a list",
    "dict_type": "a mapping (`key: value`)",
    "mapping_type": "a mapping (`key: value`)",
    "model_type": "a mapping (`key: value`)",
    "model_attributes_type": "a mapping (`key: value`)",
    "too_short": "a list with at least one entry",
}


def nearest_hint(word: str, known: Iterable[str]) -> str:
    """Return a hint with the known word nearest to an unknown one; empty if none is near."""
    by_folded = {name.casefold(): name for name in known}
    near = difflib.get_close_matches(word.casefold(), list(by_folded), n=1, cutoff=0.6)
    return f"did you mean `{by_folded[near[0]]}`?" if near else ""


def found(value: object) -> str:
    """Return a value of a YAML file in the form that messages show."""
    if value is None or value in ("", [], {}):
        return "nothing"
    if isinstance(value, dict):
        return f"a mapping with {listed([f'`{printable(str(key), 30)}`' for key in list(value)[:3]], 'and')}"
    if isinstance(value, list):
        return f"a list of {len(value)}"
    if isinstance(value, str):
        return f"`{printable(value, 60)}`"
    return f"`{json.dumps(value)}`" if isinstance(value, (bool, int, float)) else f"`{printable(str(value), 60)}`"


def mistakes_of(error: ValidationError, tree: YamlTree, model: type[BaseModel]) -> list[Mistake]:
    """Return every validation error as a mistake with its place."""
    errors = error.errors(include_url=False)
    return [_mistake(one, tree, model) for one in errors if not _follows_from_another(one, errors)]


def _follows_from_another(one: ErrorDetails, errors: Sequence[ErrorDetails]) -> bool:
    """Return whether an error follows from another one: a misspelt key, a list cut short."""
    *parent, name = one["loc"] or ("",)
    if one["type"] == "missing":
        unknown = [e["loc"][-1] for e in errors if e["type"] == "extra_forbidden" and [*e["loc"][:-1]] == parent]
        return bool(difflib.get_close_matches(str(name), [str(u) for u in unknown], n=1, cutoff=0.6))
    return one["type"] == "too_short" and bool(one["input"])


def _mistake(one: ErrorDetails, tree: YamlTree, model: type[BaseModel]) -> Mistake:
    path, where = nearest_position(tree.values, one["loc"])
    kind, name = one["type"], str(one["loc"][-1]) if one["loc"] else ""
    if kind == "lacking":
        kind, name = "missing", one["ctx"]["key"]
    if kind == "missing":
        return where.mistake(f"expected the key `{name}`{_inside(path)}, found none")
    if kind == "extra_forbidden":
        keys = _keys(model, path[:-1])
        expected = listed([f"`{key}`" for key in keys]) if keys else "no such key"
        text = f"expected {expected}{_inside(path[:-1])}, found `{printable(name)}`"
        return tree.keys.get(path, where).mistake(text, nearest_hint(name, keys))
    if kind == "literal_error":
        options = str(one["ctx"]["expected"]).replace("'", "`")
        return where.mistake(f"expected {options}, found {found(one['input'])}")
    context = one.get("ctx", {}) if kind == "rubric" else {}
    expected = context.get("expected") or _EXPECTED.get(kind) or f"something else ({one['msg'].lower()})"
    return where.mistake(f"expected {expected}, found {found(one['input'])}", context.get("hint", ""))


def _inside(path: TreePath) -> str:
    names = [part for part in path if isinstance(part, str)]
    return f" in `{printable(names[-1], 40)}`" if names else ""


def _keys(model: type[BaseModel], path: TreePath) -> list[str]:
    """Return the keys that a mapping at a path may have."""
    inside: object = model
    for part in path:
        inside = _step(inside, part)
    shape = _shape_in(inside)
    return [info.alias or name for name, info in shape.model_fields.items()] if shape else []


def _step(annotation: object, part: str | int) -> object:
    if isinstance(part, int):
        return _first(annotation, lambda inner: getattr(inner, "__origin__", None) is tuple) or annotation
    named = _first(annotation, lambda inner: getattr(inner, "__origin__", None) is dict)
    if named is not None:
        return get_args(named)[1]
    shape = _shape_in(annotation)
    fields = shape.model_fields.items() if shape else ()
    return next((info.annotation for name, info in fields if (info.alias or name) == part), object)


def _shape_in(annotation: object) -> type[BaseModel] | None:
    shape: type[BaseModel] | None = _first(annotation, lambda a: isinstance(a, type) and issubclass(a, BaseModel))
    return shape


def _first(annotation: object, wanted: Callable[[object], bool]) -> Any:
    """Return the first matching part of an annotation, searching from the outside in."""
    if wanted(annotation):
        return annotation
    annotation = getattr(annotation, "__value__", annotation)  # an alias of a type
    return next((hit for inner in get_args(annotation) if (hit := _first(inner, wanted))), None)


def refused_file(path: Path, mistakes: Iterable[Mistake]) -> RubricError:
    """Return the error with the mistakes of a file, in their order, each once, and the first hint."""
    where, ordered = printable(str(path), 500), sorted(set(mistakes))
    lines = [f"{where}:{one.line}:{one.column}: {one.text}" for one in ordered]
    return RubricError("\n".join(lines), next((one.hint for one in ordered if one.hint), ""))
