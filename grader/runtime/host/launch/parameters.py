"""The parameters of nodes: what a launch file gives as one, and as the YAML that rcl reads."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Iterator, Mapping
from typing import Any

from .context import Context, Substitution, text_of, word_for


class ParameterValue:
    """The value of a parameter with its type."""

    def __init__(self, value: Any, *, value_type: Any = None) -> None:
        self.value, self.type = value, value_type


class ParameterFile:
    """A parameter file."""

    def __init__(self, param_file: Any, *, allow_substs: Any = False) -> None:
        self.path, self.allow_substs = param_file, allow_substs


class Parameter:
    """One parameter by name and value."""

    def __init__(self, name: Any, value: Any, *, value_type: Any = None, **_: Any) -> None:
        self.name, self.value = name, ParameterValue(value, value_type=value_type) if value_type else value


def flattened(parameters: Mapping[Any, Any], context: Context, prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield name and value of each parameter; the names of nested ones are joined by dots."""
    for key, value in parameters.items():
        name = prefix + text_of(key, context)
        if isinstance(value, Mapping):
            yield from flattened(value, context, f"{name}.")
        else:
            yield name, evaluated_parameter(value, context)


def evaluated_parameter(value: Any, context: Context) -> Any:  # noqa: PLR0911 - one for each kind of value
    """Return the value of a parameter; the text of a substitution is read as YAML, as launch_ros does."""
    if isinstance(value, ParameterValue):
        inner = value.value
        text = text_of(inner, context) if isinstance(inner, (str, Substitution)) else None
        if text is None or value.type is None:
            return evaluated_parameter(inner, context)
        return text if value.type is str else value.type(_loaded(text)) if value.type in (int, float) else _loaded(text)
    if isinstance(value, Substitution):
        return _loaded(value.perform(context))
    if isinstance(value, (list, tuple)) and any(isinstance(item, (Substitution, ParameterValue)) for item in value):
        if all(isinstance(item, (str, Substitution)) for item in value):
            return _loaded(text_of(value, context))
        return [evaluated_parameter(item, context) for item in value]
    if isinstance(value, os.PathLike):
        return os.fspath(value)
    return list(value) if isinstance(value, tuple) else value


def _loaded(text: str) -> Any:
    import yaml  # comes with rclpy

    return yaml.safe_load(text)


def yaml_text(value: Any) -> str:
    """Return a value as YAML that rcl reads with the same type."""
    if isinstance(value, bool):
        return word_for(value)
    if isinstance(value, float) and not math.isfinite(value):
        return ".nan" if math.isnan(value) else ".inf" if value > 0 else "-.inf"
    if isinstance(value, (int, float)):
        return repr(value)
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, list):
        if {type(item) for item in value} == {int, float}:
            value = [float(item) for item in value]
        return f"[{', '.join(yaml_text(item) for item in value)}]"
    raise TypeError(f"expected the value of a parameter, found {type(value).__name__}")


def read_parameter_file(path: str) -> str:
    """Return the text of a parameter file, at most its first MiB."""
    with open(path, encoding="utf-8", errors="replace") as file:
        return file.read(1 << 20)
