"""Converts traces, plans and runtimes to plain JSON values, with only the standard library.

A worker can import little besides ROS and its own part of this package. The supervisor reads and checks a worker's
answers in `grader.runtime.recording.packed`.
"""

from __future__ import annotations

import base64
import math
from collections.abc import Mapping
from dataclasses import asdict, fields, is_dataclass
from enum import Enum
from functools import lru_cache
from pathlib import Path
from typing import Any, get_args, get_origin, get_type_hints

from grader.runtime.model.scenario import Planned
from grader.runtime.model.trace import (
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
    Trace,
)
from grader.runtime.stimuli import PLANNED

FORMAT = "grader/trace/v1"
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


def trace_to_json(trace: Trace) -> dict[str, Any]:
    """Convert a trace to plain JSON values; NaN and infinities become `{"float": "nan"}`."""
    return {
        "format": FORMAT,
        "scenario": trace.scenario,
        "clock": trace.clock.value,
        "clock_reason": trace.clock_reason,
        "stop_ns": trace.stop_ns,
        "notes": list(trace.notes),
        "harness_problem": trace.harness_problem,
        **({"starts": [_start_to_json(start) for start in trace.starts]} if trace.starts else {}),
        **({"suspected": True} if trace.suspected else {}),
        **({"most_starved_ns": trace.most_starved_ns} if trace.most_starved_ns else {}),
        **({"all_starved_ns": trace.all_starved_ns} if trace.all_starved_ns else {}),
        **({"unchecked": trace.unchecked} if trace.unchecked else {}),
        **({"left_out": list(trace.left_out)} if trace.left_out else {}),
        **({"unstarted": [list(one) for one in trace.unstarted]} if trace.unstarted else {}),
        **({"written": [plain(file) for file in trace.written]} if trace.written else {}),
        **({"other_numpy": plain(trace.other_numpy)} if trace.other_numpy is not None else {}),
        **({"newer": [plain(one) for one in trace.newer]} if trace.newer else {}),
        **({"author_mistake": asdict(trace.author_mistake)} if trace.author_mistake is not None else {}),
        **({"tested": _tested_to_json(trace.tested)} if trace.tested is not None else {}),
        "observations": [observation_to_json(o) for o in trace.observations],
    }


def beside_trace(trace: Trace) -> dict[str, Any]:
    """Convert what the format of evidence does not include, and a supervisor has to know."""
    return {"reached": list(trace.reached), "incomplete": trace.incomplete, "may_drift": trace.may_drift}


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
