"""Parameters of students' nodes, as they were asked for and set through the services that every node has."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from grader.core.trace import Request, Trace
from grader.judging.services import Call, calls_of

#: Number of a type -> the field of rcl_interfaces/msg/ParameterValue that holds it, and what it is called.
_TYPES: Mapping[int, tuple[str, str]] = {
    1: ("bool_value", "bool"),
    2: ("integer_value", "integer"),
    3: ("double_value", "double"),
    4: ("string_value", "string"),
    5: ("byte_array_value", "byte_array"),
    6: ("bool_array_value", "bool_array"),
    7: ("integer_array_value", "integer_array"),
    8: ("double_array_value", "double_array"),
    9: ("string_array_value", "string_array"),
}


@dataclass(frozen=True, slots=True)
class Got:
    """One parameter as a node told it.

    Attributes:
        t_ns: When it did.
        node: The node's fully qualified name.
        type: `bool`, `integer`, `double`, `string` or one of these with `_array`; empty if it has no such parameter.
        value: What it holds.
    """

    t_ns: int
    node: str
    type: str
    value: Any


@dataclass(frozen=True, slots=True)
class Set:
    """One try to set a parameter.

    Attributes:
        t_ns: When the node answered, or was asked if it did not.
        node: The node's fully qualified name.
        value: What it should hold then.
        answered: Whether there was an answer.
        taken: Whether the node took it.
        why: What it said where it did not.
    """

    t_ns: int
    node: str
    value: Any
    answered: bool
    taken: bool
    why: str


def _calls(trace: Trace, node: str | None, service: str) -> list[Call]:
    """Return the grader's calls of a node's own service; of every node if none is named."""
    asked = (r.service for r in trace.of(Request) if r.sender == "grader" and r.service.endswith(f"/{service}"))
    names = [name for name in dict.fromkeys(asked) if node in (None, name.rpartition("/")[0])]
    return [call for name in names for call in calls_of(trace, name, "grader")]


def asked_for(trace: Trace, name: str, node: str | None = None) -> list[Call]:
    """Return the calls in which a parameter was asked for."""
    return [c for c in _calls(trace, node, "get_parameters") if name in _list(c.request.value, "names")]


def got(call: Call, name: str) -> Got | None:
    """Return what a node told of a parameter; None if it did not answer."""
    if call.response is None:
        return None
    node = call.request.service.rpartition("/")[0]
    values = _list(call.response.value, "values")
    place = _list(call.request.value, "names").index(name)
    found = values[place] if place < len(values) else None
    type_, value = _typed(found)
    return Got(call.response.t_ns, node, type_, value)


def settings(trace: Trace, name: str, node: str | None = None) -> list[Set]:
    """Return the tries to set a parameter, in order."""
    found = []
    for call in _calls(trace, node, "set_parameters"):
        for place, parameter in enumerate(_list(call.request.value, "parameters")):
            if isinstance(parameter, Mapping) and parameter.get("name") == name:
                found.append(_set(call, place, parameter))
    return sorted(found, key=lambda s: s.t_ns)


def _set(call: Call, place: int, parameter: Mapping[str, Any]) -> Set:
    node = call.request.service.rpartition("/")[0]
    value = _typed(parameter.get("value"))[1]
    if call.response is None:
        return Set(call.request.t_ns, node, value, answered=False, taken=False, why="")
    results = _list(call.response.value, "results")
    result = results[place] if place < len(results) else {}
    taken = isinstance(result, Mapping) and result.get("successful") is True
    why = str(result.get("reason", "")) if isinstance(result, Mapping) else ""
    return Set(call.response.t_ns, node, value, answered=True, taken=taken, why=why)


def _typed(value: object) -> tuple[str, Any]:
    if not isinstance(value, Mapping):
        return "", None
    number = value.get("type")
    field, name = _TYPES.get(number, ("", "")) if isinstance(number, int) else ("", "")
    return name, value.get(field)


def _list(value: Mapping[str, Any], name: str) -> list[Any]:
    found = value.get(name)
    return list(found) if isinstance(found, (list, tuple)) else []
