"""Service calls: requests with their responses, and calls about parameters."""

from __future__ import annotations

from collections.abc import Mapping

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.trace import ClockKind, Request, Response, Trace

#: Accepted delay on clocks where the machine's load shows.
LATENESS_NS = {ClockKind.VIRTUAL: NS_PER_MS, ClockKind.WALL: 250 * NS_PER_MS}


@dataclass(frozen=True, slots=True)
class Call:
    """A service call; without a response if none came."""

    request: Request
    response: Response | None


def calls_of(trace: Trace, service: str, asker: str) -> tuple[Call, ...]:
    """Return the calls of a service by `grader` or `student` in order, each with its response."""
    answerer = "grader" if asker == "student" else "student"
    responses: dict[int, Response] = {}
    for response in trace.responses(service, answerer):
        if response.t_ns < trace.stop_ns:
            responses.setdefault(response.number, response)
    asked = [r for r in trace.requests(service, asker) if r.t_ns < trace.stop_ns]
    return tuple(Call(r, responses.get(r.number)) for r in asked)


#: Numbers of action_msgs/msg/GoalStatus.
_STATUSES = dict(enumerate(("accepted", "executing", "canceling", "succeeded", "canceled", "aborted"), 1))


def status_of(result: Response) -> str:
    """Return the status with which a goal ended, by the response to the request for its result."""
    status = result.value.get("status")
    return _STATUSES.get(status, f"status {status}") if isinstance(status, int) else "without a status"


#: A decoded parameter.
ParameterValue = str | float | bool | list[str | float | bool] | None
#: Types of rcl_interfaces/msg/ParameterValue, whose numbers begin at 1; each has a field such as `bool_value`.
_SINGLE = ("bool", "integer", "double", "string")
_TYPES = (*_SINGLE, "byte_array", *(f"{name}_array" for name in _SINGLE))


@dataclass(frozen=True, slots=True)
class ReportedParameter:
    """A parameter as a node reported it.

    Attributes:
        type: `bool`, `integer`, `double`, `string` or one of these with `_array`; empty if the node lacks the
            parameter.
    """

    t_ns: int
    node: str
    type: str
    value: ParameterValue


@dataclass(frozen=True, slots=True)
class ParameterSetting:
    """An attempt to set a parameter.

    Attributes:
        t_ns: Time of the response, or of the request without one.
        taken: Whether the node accepted the value.
        why: The node's reason if it did not.
    """

    t_ns: int
    value: ParameterValue
    answered: bool
    taken: bool
    why: str


def calls_of_node(trace: Trace, node: str | None, service: str) -> list[Call]:
    """Return the grader's calls of a service that each node has, such as `get_parameters`, of one node or all."""
    asked = (r.service for r in trace.of(Request) if r.sender == "grader" and r.service.endswith(f"/{service}"))
    names = [name for name in dict.fromkeys(asked) if node in (None, name.rpartition("/")[0])]
    return [call for name in names for call in calls_of(trace, name, "grader")]


def asked_for(trace: Trace, name: str, node: str | None = None) -> list[Call]:
    """Return the calls that asked for a parameter."""
    return [c for c in calls_of_node(trace, node, "get_parameters") if name in _list(c.request.value, "names")]


def reported_parameter(call: Call, name: str) -> ReportedParameter | None:
    """Return a parameter as a response reported it; None without a response."""
    if call.response is None:
        return None
    node = call.request.service.rpartition("/")[0]
    values = _list(call.response.value, "values")
    place = _list(call.request.value, "names").index(name)
    found = values[place] if place < len(values) else None
    type_, value = _typed(found)
    return ReportedParameter(call.response.t_ns, node, type_, value)


def settings(trace: Trace, name: str, node: str | None = None) -> list[ParameterSetting]:
    """Return the attempts to set a parameter, in order."""
    found = []
    for call in calls_of_node(trace, node, "set_parameters"):
        for place, parameter in enumerate(_list(call.request.value, "parameters")):
            if isinstance(parameter, Mapping) and parameter.get("name") == name:
                found.append(_set(call, place, parameter))
    return sorted(found, key=lambda s: s.t_ns)


def _set(call: Call, place: int, parameter: Mapping[str, object]) -> ParameterSetting:
    value = _typed(parameter.get("value"))[1]
    if call.response is None:
        return ParameterSetting(call.request.t_ns, value, answered=False, taken=False, why="")
    results = _list(call.response.value, "results")
    result = results[place] if place < len(results) else {}
    taken = isinstance(result, Mapping) and result.get("successful") is True
    why = str(result.get("reason", "")) if isinstance(result, Mapping) else ""
    return ParameterSetting(call.response.t_ns, value, answered=True, taken=taken, why=why)


def _typed(value: object) -> tuple[str, ParameterValue]:
    if not isinstance(value, Mapping):
        return "", None
    number = value.get("type")
    name = _TYPES[number - 1] if isinstance(number, int) and 1 <= number <= len(_TYPES) else ""
    return name, value.get(f"{name}_value")


def _list(value: Mapping[str, object], name: str) -> list[object]:
    found = value.get(name)
    return list(found) if isinstance(found, (list, tuple)) else []
