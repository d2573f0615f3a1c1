"""Reads checks and stimuli as dataclasses: pydantic models from their annotations, manuals from their docstrings."""

from __future__ import annotations

import dataclasses
import inspect
import re
import types
from collections.abc import Mapping
from functools import lru_cache, partial
from typing import Annotated, Any, ClassVar, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from pydantic import AfterValidator, Field, create_model
from pydantic.config import JsonDict

from grader.grading.model.exercise import measure_of, roles_of
from grader.grading.model.measures import COMBINES, Combine, Measure, Scale
from grader.grading.rubrics.drawing import (
    Calls,
    CallsOrNever,
    Clients,
    DrawnNumber,
    DrawnText,
    DrawnWhole,
    DrawnYesNo,
    Either,
    FieldName,
    Fields,
    MessageCases,
    MessageCasesOrNone,
    NumberCases,
    SomeLongTime,
    SomeTime,
    TimeOrNever,
)
from grader.grading.rubrics.types import (
    ActionType,
    BagBytes,
    BagPattern,
    Choice,
    Duration,
    FieldFormulaText,
    FieldNumber,
    FormulaText,
    Frequency,
    LongDuration,
    MessageType,
    PatternText,
    ProgramName,
    Quantity,
    Real,
    RecordingPath,
    ServiceType,
    Shape,
    Share,
    Text,
    Topic,
    Whole,
    YesNo,
    plain_value,
    wrong,
)
from grader.grading.rubrics.units import format_quantity
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import DurationNs, FieldOf, Hertz, Kind, Least, Unit, seconds
from grader.runtime.model.scenario import FieldSpec
from grader.runtime.model.worlds import WallMap
from grader.runtime.stimuli import Simulated

T = TypeVar("T")

#: Prefix of dynamic fields, so that a check may have a parameter `copy` or `json` without hiding pydantic's own.
_PREFIX = "p_"

_BY_ANNOTATION: tuple[tuple[object, object], ...] = (
    (DurationNs, Duration),
    (Hertz, Frequency),
    (float, Real),
    (int, Whole),
    (bool, YesNo),
)

_BY_KIND: Mapping[str, object] = {
    "topic": Topic,
    "message type": MessageType,
    "service type": ServiceType,
    "action type": ActionType,
    "field number": FieldNumber,
    "share": Share,
    "formula": FormulaText,
    "formula of fields": FieldFormulaText,
    "pattern": PatternText,
    "recording": RecordingPath,
    "bag": BagPattern,
    "size of a bag": BagBytes,
    "field name": FieldName,
    "time": SomeTime,
    "time above 0": SomeLongTime,
    "fixed time above 0": LongDuration,
    "fixed time above 0, or nothing": TimeOrNever,
    "count": Calls,
    "count, or nothing": CallsOrNever,
    "clients": Clients,
    "numbers": NumberCases,
    "messages": MessageCases,
    "messages, or none": MessageCasesOrNone,
    "fields": Fields,
}

#: Types whose definitions name themselves: Python looks that name up in the module of the class that uses them.
_RECURSIVE = {"FieldSpec": FieldSpec}

#: A name, and its meaning on the same line and the lines below that are indented further.
_PARAMETER = re.compile(r"^ {4}(\w+): (.*(?:\n(?: {8}.*| *$))*)", re.MULTILINE)
_HEADING = "Attributes:"
#: The keys of a check that measures a number, besides its own parameters.
_SCALE = ("full", "none", "combine")
#: The form of a number of a measure by its unit.
_BY_UNIT: Mapping[str, object] = {"s": Duration, "Hz": Frequency}


class _Parameters(Shape):
    """The fields of a frozen dataclass."""

    made: ClassVar[type]

    @property
    def scale(self) -> Scale | None:
        """What the rubric gives for what a check measures; None if it gives no share for a number."""
        given = {key: getattr(self, _PREFIX + key) for key in _SCALE if _PREFIX + key in self.model_fields_set}
        measure = measure_of(self.made)
        if measure is None or not {"full", "none"} <= set(given):
            return None
        full, none = (seconds(given[key]) if measure.unit == "s" else float(given[key]) for key in ("full", "none"))
        return Scale(full, none, given.get("combine", COMBINES[0]))

    def scale_flaw(self) -> tuple[str, str] | None:
        """Return the key at which the scale is wrong, and what was expected; None if nothing is."""
        given = [key for key in _SCALE if _PREFIX + key in self.model_fields_set]
        measure, scale = measure_of(self.made), self.scale
        if measure is None or not given:
            return None
        if scale is None:
            return given[0], "`full` and `none` together"
        flaw = scale.flaw(measure)
        return ("none", flaw) if flaw else None

    def built(self) -> object:
        """Return the dataclass, with defaults for what is left out; raises ValueError if it rejects the values."""
        fields = [f.name for f in dataclasses.fields(self.made) if self._is_given(f)]
        return self.made(**{name: plain_value(getattr(self, _PREFIX + name)) for name in fields})

    def _is_given(self, field: dataclasses.Field[object]) -> bool:
        return _is_required(field) or _PREFIX + field.name in self.model_fields_set


def choice_model(name: str, summary: str, options: Mapping[str, Any]) -> type[Choice]:
    """Return the model of a mapping with one key, which selects the dataclass or shape of its value."""
    shapes = {k: cls if issubclass(cls, Shape) else _parameters(cls) for k, cls in options.items()}
    fields: dict[str, Any] = {f"{_PREFIX}{key}": (shapes[key], Field(default=None, alias=key)) for key in options}
    return create_model(name, __base__=Choice, __doc__=summary, **fields)


@lru_cache(maxsize=256)
def _parameters(cls: type) -> type[Shape]:
    """Return the model of a check; its fields have the same names in rubrics as in Python."""
    hints = get_type_hints(cls, localns=_RECURSIVE, include_extras=True)
    forms = _forms(cls)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        default = ... if _is_required(field) else None
        accepted = _accepted(hints[field.name], forms.get(field.name, Text))
        fields[f"{_PREFIX}{field.name}"] = (accepted, Field(default, alias=field.name))
    measure = measure_of(cls)
    return _model(cls, cls.__name__, fields | (_scale_fields(measure, fields) if measure else {}))


def _scale_fields(measure: Measure, others: Mapping[str, object]) -> dict[str, Any]:
    """Return the keys by which a rubric gives a share of the points for a number."""
    taken = next((key for key in _SCALE if _PREFIX + key in others), None)
    if taken is not None:
        raise TypeError(f"a check that measures something has no parameter `{taken}` of its own")
    form: Any = _BY_UNIT.get(measure.unit, Real)
    default = ... if measure.required else None
    texts = scale_meanings(measure)
    return {
        **{f"{_PREFIX}{k}": (form, Field(default, alias=k, description=texts[k])) for k in ("full", "none")},
        f"{_PREFIX}combine": (Combine, Field(None, alias="combine", description=texts["combine"])),
    }


def scale_meanings(measure: Measure) -> dict[str, str]:
    """Return what the keys of a check that measures something mean, by their names."""
    name = f"{measure.name} in {measure.unit}" if measure.unit else measure.name
    return {
        "full": f"The {name} that earns full points; numbers up to `none` earn a share in proportion.",
        "none": f"The {name} that earns no points.",
        "combine": "How several numbers, and several draws, become one: `worst`, `mean` or `median`.",
    }


def _forms(kind: type) -> dict[str, object]:
    """Return the required form of text parameters by their name, beyond being text."""
    roles = roles_of(kind)
    topics = (*roles.topics, *roles.hears, *roles.speaks, *roles.logs, *roles.given)
    services = (*roles.services, *roles.serves, *roles.calls)
    names = dict.fromkeys((*topics, *services, *roles.actions), Topic)
    return {**names, roles.type: MessageType, roles.process: ProgramName}


class _SimulationParameters(Shape):
    """The parameters of a simulation, each of which may be drawn from the seed."""

    made: ClassVar[type]
    name: ClassVar[str]
    path: ClassVar[str]
    content: ClassVar[bytes]
    maps: ClassVar[tuple[tuple[str, WallMap], ...]]

    def built(self) -> Simulated:
        """Return the stimulus, with the parameters that are given."""
        return Simulated(self.name, _given(self), self.path, self.content, maps=self.maps)


class _PartOfSimulation(Shape):
    """A part of a simulation, such as an obstacle; what it consists of may be drawn from the seed."""

    def built(self) -> Mapping[str, Any]:
        """Return what is given of it."""
        return _given(self)


def _given(shape: Shape) -> dict[str, Any]:
    """Return what a rubric gives, by name; what it leaves out is not there."""
    # Values are drawn in this order; that of the set of names is another one in each process.
    names = [name for name in type(shape).model_fields if name in shape.model_fields_set]
    return {name.removeprefix(_PREFIX): plain_value(getattr(shape, name)) for name in names}


def simulation_shape(
    name: str, kind: type, path: str = "", content: bytes = b"", maps: tuple[tuple[str, WallMap], ...] = ()
) -> type[Shape]:
    """Return the model of a simulation's parameters.

    Args:
        name: Its name in rubrics.
        kind: Its class, a dataclass.
        path: The author's file with the class; empty for a built-in one.
        content: The text of that file.
        maps: The maps of the rubric, by name.

    Raises:
        TypeError: A parameter has a type for which there is no rubric syntax.
    """
    model = create_model(
        f"{kind.__name__}Simulation", __base__=_SimulationParameters, __doc__=_summary(kind), **_drawable_fields(kind)
    )
    model.made, model.name, model.path, model.content, model.maps = kind, name, path, content, maps
    return model


def _summary(kind: type) -> str:
    return " ".join((kind.__doc__ or "").strip().split("\n\n")[0].split())


def _drawable_fields(kind: type) -> dict[str, Any]:
    """Return the fields of a model for a dataclass whose numbers, truth values and texts may be drawn."""
    hints, forms = get_type_hints(kind, include_extras=True), _forms(kind)
    fields: dict[str, Any] = {}
    # a parameter is explained where it is written, which may be a base class
    meanings = {k: words for base in reversed(kind.__mro__) for k, words in manual_of(base).parameters.items()}
    for field in dataclasses.fields(kind):
        if field.init:
            default = ... if _is_required(field) else None
            accepted = _drawable(hints[field.name], forms.get(field.name, Text))
            description = meanings.get(field.name)
            fields[f"{_PREFIX}{field.name}"] = (accepted, Field(default, alias=field.name, description=description))
    return fields


def _drawable(annotation: object, form: object) -> object:
    """Return the type that a rubric may hold for a parameter; a number, truth value or text may be drawn."""
    if get_origin(annotation) is tuple and get_args(annotation)[1:] == (...,):
        (part,) = get_args(annotation)[:1]
        if isinstance(part, type) and dataclasses.is_dataclass(part):
            return tuple[_part_of_simulation(part), ...]  # type: ignore[misc]
    if isinstance(annotation, type) and dataclasses.is_dataclass(annotation):
        raise TypeError(f"no rubric syntax for a parameter annotated {annotation!r}: write a tuple of them")
    accepted = _accepted(annotation, form)
    drawn = {float: DrawnNumber, int: DrawnWhole, bool: DrawnYesNo, str: DrawnText}
    known = next((shape for kind, shape in drawn.items() if annotation is kind), None)
    return accepted if known is None else Either[accepted, known]  # type: ignore[misc, valid-type]


@lru_cache(maxsize=64)
def _part_of_simulation(kind: type) -> type[Shape]:
    return create_model(kind.__name__, __base__=_PartOfSimulation, __doc__=_summary(kind), **_drawable_fields(kind))


def part_model(cls: type, name: str, aliases: Mapping[str, str] | None = None, **usual: Any) -> type[Shape]:
    """Return the model of a dataclass that is part of a scenario; rubrics omit the units in field names.

    `aliases` holds rubric names of fields, where they differ, and `usual` the defaults that the JSON Schema shows,
    where they differ from those of the dataclass; a required field gets this default.
    """
    hints = get_type_hints(cls, localns=_RECURSIVE, include_extras=True)
    fields: dict[str, Any] = {}
    for field in dataclasses.fields(cls):
        key = (aliases or {}).get(field.name) or field.name.removesuffix("_ns").removesuffix("_bytes")
        default = usual.get(key, ... if _is_required(field) else field.default)
        words, least = _mark(hints[field.name], str), _mark(hints[field.name], Least)
        minimum: JsonDict | None = {"minimum": least.value} if least and not _mark(hints[field.name], Unit) else None
        info = Field(default, alias=key, description=words, json_schema_extra=minimum)
        fields[f"{_PREFIX}{field.name}"] = (_accepted(hints[field.name]), info)
    return _model(cls, name, fields)


def _model(cls: type, name: str, fields: dict[str, Any]) -> type[Shape]:
    summary = " ".join((cls.__doc__ or "").strip().split("\n\n")[0].split())
    model = create_model(name, __base__=_Parameters, __doc__=summary, **fields)
    model.made = cls
    return model


def _is_required(field: dataclasses.Field[object]) -> bool:
    return field.default is dataclasses.MISSING and field.default_factory is dataclasses.MISSING


def _accepted(annotation: object, form: object = Text) -> object:
    """Return the type that a rubric may hold for a dataclass field: its annotation, made strict and given units.

    A text has to have the form.
    """
    if kind := _mark(annotation, Kind):
        return _BY_KIND[kind.name]
    if _mark(annotation, FieldOf):
        annotation = get_args(annotation)[0]
    if get_origin(annotation) is Annotated and not (_mark(annotation, Unit) or _mark(annotation, Least)):
        annotation = get_args(annotation)[0]  # with a text alone, which describes it
    if annotation is str:
        return form
    for known, accepted in _BY_ANNOTATION:
        if annotation == known:
            return accepted
    if least := _mark(annotation, Least):
        unit = _mark(annotation, Unit)
        number = Annotated[int, Quantity(unit, above_zero=True)] if unit else Whole
        return Annotated[number, AfterValidator(partial(_at_least, least.value, unit))]
    if isinstance(annotation, type) and dataclasses.is_dataclass(annotation):
        return _parameters(annotation)
    return _accepted_generic(annotation, form)


def _accepted_generic(annotation: object, form: object) -> object:
    origin, arguments = get_origin(annotation), get_args(annotation)
    if origin in (Union, types.UnionType):
        return Union[tuple(_accepted(a, form) for a in arguments)]  # noqa: UP007
    if origin is tuple:
        return tuple[tuple(a if a is ... else _accepted(a, form) for a in arguments)]  # type: ignore[misc]
    if isinstance(origin, type) and issubclass(origin, Mapping):
        return dict[str, _accepted(arguments[1])]  # type: ignore[misc]
    if origin is Literal or annotation is type(None):
        return annotation
    raise TypeError(f"no rubric syntax for a parameter annotated {annotation!r}")


def _mark(annotation: object, kind: type[T]) -> T | None:
    """Return the mark of the given type in an annotation."""
    return next((mark for mark in getattr(annotation, "__metadata__", ()) if isinstance(mark, kind)), None)


def _at_least(least: int, unit: Unit | None, value: int) -> int:
    if value < least:
        words = format_quantity(least, unit) if unit else f"{least}"
        raise wrong(f"at least {words}, which even an idle node needs")
    return value


@dataclass(frozen=True, slots=True)
class Manual:
    """The first paragraph of a docstring, the others, one per line, and the meaning of each attribute."""

    summary: str
    details: str
    parameters: Mapping[str, str]


def manual_of(kind: type) -> Manual:
    """Return the manual of a class; empty if it has no docstring."""
    written = kind.__doc__ or ""
    # Without a docstring, a dataclass gets its signature as one.
    known = "" if written.startswith(f"{kind.__name__}(") else written
    text, _, attributes = inspect.cleandoc(known).partition(_HEADING)
    paragraphs = [" ".join(p.split()) for p in text.split("\n\n") if p.strip()]
    meanings = {name: " ".join(meaning.split()) for name, meaning in _PARAMETER.findall(attributes)}
    return Manual(paragraphs[0] if paragraphs else "", "\n".join(paragraphs[1:]), meanings)
