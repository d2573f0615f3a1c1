"""Converts traces, plans and runtimes to plain JSON values, with only the standard library.

A worker can import little besides ROS and its own part of this package. The supervisor reads and checks a worker's
answers in `grader.runtime.recording.packed`.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Mapping
from dataclasses import asdict, fields, is_dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from grader.runtime.model.scenario import Planned
from grader.runtime.model.trace import (
    AssessedTrace,
    Delivery,
    Fault,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
    Start,
    Tested,
)
from grader.runtime.stimuli import PLANNED

FORMAT = "grader/trace/v1"
#: The fields of a trace that are always written, and those that evidence does not include.
HEAD = ("scenario", "clock", "clock_reason", "stop_ns", "notes", "harness_problem")
ASIDE = frozenset({"reached", "incomplete", "may_drift"})
#: The tag of each kind of observation.
TAGS: Mapping[type, str] = {
    Message: "message",
    Delivery: "delivery",
    Request: "request",
    Response: "response",
    LogRecord: "log",
    OutputLine: "line",
    GraphSnapshot: "graph",
    Fault: "fault",
    Offer: "offer",
    Mark: "mark",
}
#: The key that says of which kind a planned stimulus is.
_KIND = "is"
_SCALARS = frozenset({str, int, bool, type(None)})
#: The number of trailing fields of a fault that are written as one list.
_DETAILS = 3
#: The number of trailing fields of the end of a service that are written as one list, and its usual value.
_QOS, _USUAL_QOS = 2, ["reliable", "volatile"]
#: Index of the endpoints in the row of a snapshot of the graph.
_ENDPOINTS = 3


def trace_to_json(trace: AssessedTrace, *, aside: bool = False) -> dict[str, Any]:
    """Convert a trace to plain JSON values; NaN and infinities become `{"float": "nan"}`.

    A field of a trace is written if it is not as usual. With `aside`, what evidence does not include is written too: a
    supervisor has to know it.
    """
    data: dict[str, Any] = {"format": FORMAT}
    for name, usual in _fields_of_trace():
        value = getattr(trace, name)
        if name in HEAD or (value != usual and (aside or name not in ASIDE)):
            data[name] = _WRITERS.get(name, plain)(value)
    return {**data, "observations": [observation_to_json(o) for o in trace.observations]}


@lru_cache(maxsize=1)
def _fields_of_trace() -> tuple[tuple[str, Any], ...]:
    """Return the fields of a trace but its observations, with their usual values; those of `HEAD` come first."""
    usual = {
        field.name: field.default for field in fields(AssessedTrace) if field.init and field.name != "observations"
    }
    return tuple({**{name: usual[name] for name in HEAD}, **usual}.items())


def _tested_to_json(tested: Tested) -> dict[str, Any]:
    fault = None if tested.fault is None else observation_to_json(tested.fault)
    found = {"reason": tested.reason, "hint": tested.hint, "missing": list(tested.missing)}
    return {"passed": tested.passed, **found, **({"fault": fault} if fault else {})}


def _start_to_json(start: Start) -> list[Any]:
    """Convert how a process was started; what it was given on the command line follows in a list, if there is any."""
    *row, arguments, launched_by = plain(start)
    return [*row, [arguments, launched_by]] if arguments or launched_by else row


def observation_to_json(observation: Observation) -> list[Any]:
    """Convert one observation to `[kind, field, ...]`, in the order of its fields."""
    row = [TAGS[type(observation)], *plain(observation)]
    if isinstance(observation, Fault):
        return [*row[:-_DETAILS], row[-_DETAILS:]]
    if isinstance(observation, Message):
        return without_last(row, False)  # noqa: FBT003 - the value
    if isinstance(observation, GraphSnapshot):
        row[_ENDPOINTS] = [without_last(end, 0) for end in row[_ENDPOINTS]]
        row[-1] = [without_last([*end[:-_QOS], end[-_QOS:]], _USUAL_QOS) for end in row[-1]]
        return without_last(row, [])
    return row


def without_last(row: list[Any], usual: Any) -> list[Any]:
    """Leave out the last field if it has the value that readers take for a missing one."""
    return row[:-1] if row[-1] == usual else row


#: How fields of a trace are written that `plain` would write in another way.
_WRITERS: Mapping[str, Callable[[Any], Any]] = {
    "starts": lambda starts: [_start_to_json(start) for start in starts],
    "author_mistake": asdict,
    "tested": _tested_to_json,
}


def plain(value: Any) -> Any:  # noqa: PLR0911 - one for each kind of value
    """Convert message fields, and any other value in a trace, to strict JSON values."""
    kind: Any = type(value)
    if kind in _SCALARS:
        return value
    if kind is float or isinstance(value, float):
        return value if math.isfinite(value) else {"float": str(value)}
    if (names := _field_names(kind)) is not None:
        return [plain(getattr(value, name)) for name in names]
    if kind is dict or isinstance(value, Mapping):
        return {name: plain(field) for name, field in value.items()}
    if isinstance(value, (list, tuple)):
        return [plain(field) for field in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return value.value if isinstance(value, Enum) else value


@lru_cache(maxsize=256)
def _field_names(kind: Any) -> tuple[str, ...] | None:
    """Return the names of a dataclass's fields; None for any other type."""
    return tuple(field.name for field in fields(kind)) if is_dataclass(kind) else None


def to_json(value: Any) -> Any:
    """Convert a dataclass to plain JSON values by field name; `from_json` reads them back."""
    kind: Any = type(value)
    if (names := _field_names(kind)) is not None:
        tag = {_KIND: kind.__name__} if isinstance(value, Planned) else {}
        return tag | {name: to_json(getattr(value, name)) for name in names}
    if isinstance(value, tuple):
        return [to_json(item) for item in value]
    if isinstance(value, bytes):
        return base64.b64encode(value).decode()
    return str(value) if isinstance(value, Path) else value


def from_json(kind: Any, data: Any) -> Any:
    """Rebuild a value of a type from the output of `to_json`; the sender must be trusted."""
    if isinstance(kind, type) and issubclass(kind, Planned):
        kind, data = PLANNED[data[_KIND]], {name: value for name, value in data.items() if name != _KIND}
    if hasattr(kind, "__dataclass_fields__"):
        return kind(**{name: from_json(_hints(kind)[name], value) for name, value in data.items()})
    if get_origin(kind) is tuple:
        kinds = get_args(kind)
        return tuple(map(from_json, kinds[:1] * len(data) if kinds[1:] == (...,) else kinds, data))
    if kind is bytes:
        return base64.b64decode(data)
    return kind(data) if kind in (float, Path) else data


@lru_cache(maxsize=32)
def _hints(kind: Any) -> Mapping[str, Any]:
    return get_type_hints(kind)
