"""The parameters of a check in a rubric: pydantic models read off the check's dataclass, and back."""

from __future__ import annotations

import dataclasses
import types
from collections.abc import Mapping
from functools import lru_cache
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import BaseModel, ConfigDict, Field, create_model, model_validator
from typing_extensions import Self

from grader.core import exercise
from grader.core.quantities import DurationNs, Hertz
from grader.rubrics.types import (
    ActionType,
    Duration,
    FormulaText,
    Frequency,
    MessageType,
    PatternText,
    PythonFile,
    Real,
    ServiceType,
    Text,
    Topic,
    Whole,
    YesNo,
    wrong,
)
from grader.submissions.collected import listed

T = TypeVar("T")

#: Dynamic fields carry a prefix, so that a check may call a parameter `copy` or `json` without hiding pydantic's own.
_PREFIX = "p_"

#: What a parameter of a certain name has to look like, beyond being text.
_BY_NAME: Mapping[str, Any] = {
    **dict.fromkeys(
        ("topic", "input", "output", "forward", "back", "service", "action", "publishes", "subscribes"), Topic
    ),
    "type": MessageType,
    "process": PythonFile,
}

_BY_ANNOTATION: tuple[tuple[Any, Any], ...] = (
    (DurationNs, Duration),
    (Hertz, Frequency),
    (exercise.ServiceType, ServiceType),
    (exercise.ActionType, ActionType),
    (exercise.Formula, FormulaText),
    (exercise.Pattern, PatternText),
    (float, Real),
    (int, Whole),
    (bool, YesNo),
)


class Shape(BaseModel):
    """A mapping with fixed keys."""

    model_config = ConfigDict(extra="forbid", frozen=True, loc_by_alias=True, protected_namespaces=())


class Choice(Shape):
    """A mapping with exactly one of several keys: the kind of thing it is, and its parameters."""

    model_config = ConfigDict(json_schema_extra={"minProperties": 1, "maxProperties": 1})

    @model_validator(mode="after")
    def _exactly_one(self) -> Self:
        if len(self.model_fields_set) != 1:
            names = [info.alias or name for name, info in type(self).model_fields.items()]
            raise wrong(f"exactly one of {listed(names)}")
        return self

    @property
    def chosen(self) -> tuple[str, Any]:
        """The one key, as written, and its value."""
        (name,) = self.model_fields_set
        return type(self).model_fields[name].alias or name, getattr(self, name)


def choice_model(name: str, summary: str, options: Mapping[str, type]) -> type[Choice]:
    """Return the model of a mapping whose one key names a dataclass and whose value holds its parameters."""
    fields: dict[str, Any] = {
        f"{_PREFIX}{key}": (_parameters(cls), Field(default=None, alias=key)) for key, cls in options.items()
    }
    return create_model(name, __base__=Choice, __doc__=summary, **fields)


@lru_cache(maxsize=256)
def _parameters(cls: type) -> type[Shape]:
    """Return the model of a frozen dataclass's fields."""
    hints = get_type_hints(cls, include_extras=True)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        default = ... if _is_required(field) else None
        accepted = _accepted(hints[field.name], field.name)
        fields[f"{_PREFIX}{field.name}"] = (accepted, Field(default, alias=field.name))
    summary = (cls.__doc__ or "").strip().split("\n\n")[0]
    return create_model(cls.__name__, __base__=Shape, __doc__=" ".join(summary.split()), **fields)


def _is_required(field: dataclasses.Field[Any]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _accepted(annotation: object, name: str = "") -> object:
    """Return what a rubric may hold for a dataclass field: the field's annotation, made strict and given units."""
    if annotation is str:
        return _BY_NAME.get(name, Text)
    for known, accepted in _BY_ANNOTATION:
        if annotation == known:
            return accepted
    if isinstance(annotation, type) and dataclasses.is_dataclass(annotation):
        return _parameters(annotation)
    return _accepted_generic(annotation, name)


def _accepted_generic(annotation: object, name: str) -> object:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, types.UnionType):
        return Union[tuple(_accepted(a, name) for a in arguments)]  # noqa: UP007
    if origin is tuple:
        return tuple[tuple(a if a is ... else _accepted(a, name) for a in arguments)]  # type: ignore[misc]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, _accepted(arguments[1])]  # type: ignore[misc]
    if origin is Literal or annotation is type(None):
        return annotation
    raise TypeError(f"no rubric syntax for a parameter annotated {annotation!r}")


def build(cls: type[T], parameters: Shape) -> T:
    """Return the dataclass that a validated mapping describes; what the rubric leaves out keeps its default.

    Raises:
        ValueError: The dataclass itself refuses the values.
    """
    hints = get_type_hints(cls, include_extras=True)
    given = {
        name.removeprefix(_PREFIX): _built(hints[name.removeprefix(_PREFIX)], getattr(parameters, name))
        for name in type(parameters).model_fields
        if name in parameters.model_fields_set
    }
    return cls(**given)


def _built(annotation: object, value: object) -> object:
    if isinstance(value, Shape):
        classes = [a for a in (annotation, *get_args(annotation)) if dataclasses.is_dataclass(a)]
        return build(classes[0], value)  # type: ignore[arg-type]
    if isinstance(value, tuple):
        inner = get_args(_member(annotation, tuple))
        return tuple(_built(inner[0] if ... in inner else inner[i], item) for i, item in enumerate(value))
    if isinstance(value, dict):
        return {key: _built(get_args(_member(annotation, Mapping))[1], item) for key, item in value.items()}
    return value


def _member(annotation: object, kind: type) -> object:
    """Return an annotation, or that part of a union, whose values are of a kind."""
    parts = (annotation, *get_args(annotation))
    return next(p for p in parts if isinstance(get_origin(p), type) and issubclass(get_origin(p), kind))
