"""Traces as JSON values and back; reading checks every shape, because a trace crosses a line that is not trusted."""

from __future__ import annotations

import base64
import math
import re
from collections.abc import Callable, Mapping
from typing import Any, TypeAlias

from grader.core.errors import HarnessError
from grader.core.trace import (
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Start,
    StartWay,
    Trace,
)

FORMAT = "grader/trace/v1"
#: Exit code, signal and Python version of a fault, as `Fault` has them.
FaultDetails: TypeAlias = tuple[int | None, str, tuple[int, int] | None]
# The words of faults in recordings that lack these details.
_EXITED = re.compile(r"exited with code (-?\d{1,9})")
_KILLED = re.compile(r"ended by (SIG[A-Z0-9]+|signal \d+)")
_PYTHON = re.compile(r"\(read by Python (\d{1,3})\.(\d{1,3})\)")
SPECIAL = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}


def trace_to_json(trace: Trace) -> dict[str, Any]:
    """Return a trace as plain JSON values; NaN and infinities become `{"float": "nan"}`."""
    return {
        "format": FORMAT,
        "scenario": trace.scenario,
        "clock": trace.clock.value,
        "clock_reason": trace.clock_reason,
        "stop_ns": trace.stop_ns,
        "notes": list(trace.notes),
        "harness_problem": trace.harness_problem,
        **({"starts": list(map(_start_to_json, trace.starts))} if trace.starts else {}),
        "observations": [observation_to_json(o) for o in trace.observations],
    }


def _start_to_json(start: Start) -> list[Any]:
    return [start.process, start.file, start.way.value, start.target, list(start.hidden)]


def observation_to_json(observation: Observation) -> list[Any]:
    """Return one observation as `[kind, field, ...]` in the order of its fields."""
    if isinstance(observation, (Message, Delivery)):
        kind = "message" if isinstance(observation, Message) else "delivery"
        cdr = base64.b64encode(observation.cdr).decode()
        return [kind, observation.t_ns, observation.topic, observation.type, plain(observation.value), cdr]
    if isinstance(observation, GraphSnapshot):
        ends = [[getattr(e, name) for name in Endpoint.__slots__] for e in observation.endpoints]
        services = [[getattr(e, name) for name in ServiceEnd.__slots__] for e in observation.services]
        return ["graph", observation.t_ns, list(observation.nodes), ends, *([services] if services else [])]
    if isinstance(observation, (Request, Response)):
        kind = "request" if isinstance(observation, Request) else "response"
        *fields, value, cdr = (getattr(observation, name) for name in Request.__slots__)
        return [kind, *fields, plain(value), base64.b64encode(cdr).decode()]
    if isinstance(observation, Fault):
        fields = [getattr(observation, name) for name in Fault.__slots__]
        python = list(observation.python) if observation.python else None
        details = [observation.exit_code, observation.signal, python]
        return ["fault", *fields[:2], observation.kind.value, *fields[3:6], list(observation.frames), details]
    kinds = {LogRecord: "log", OutputLine: "line", Offer: "offer", Mark: "mark"}
    return [kinds[type(observation)], *(getattr(observation, name) for name in type(observation).__slots__)]


def plain(value: Any) -> Any:
    """Return message fields as strict JSON values."""
    if isinstance(value, float) and not math.isfinite(value):
        return {"float": str(value)}
    if isinstance(value, Mapping):
        return {name: plain(field) for name, field in value.items()}
    return [plain(field) for field in value] if isinstance(value, (list, tuple)) else value


def lively(value: Any) -> Any:
    """Return what `plain` was given."""
    if isinstance(value, dict):
        if value.keys() == {"float"} and isinstance(value["float"], str):
            return SPECIAL[value["float"]]
        return {name: lively(field) for name, field in value.items()}
    return [lively(field) for field in value] if isinstance(value, list) else value


def trace_from_json(data: Any) -> Trace:
    """Return the trace that JSON values hold; raises HarnessError if they hold none."""
    try:
        if data["format"] != FORMAT:
            raise HarnessError(f"trace: expected format {FORMAT}, found {str(data['format'])[:40]}")
        return Trace(
            scenario=_text(data["scenario"]),
            clock=ClockKind(data["clock"]),
            stop_ns=_whole(data["stop_ns"]),
            observations=tuple(observation_from_json(o) for o in _list(data["observations"])),
            clock_reason=_text(data["clock_reason"]),
            notes=tuple(map(_text, _list(data["notes"]))),
            harness_problem=_text(data["harness_problem"]),
            starts=tuple(map(_start, _list(data.get("starts", [])))),
            reached=tuple(map(_text, _list(data.get("reached", [])))),
        )
    except (KeyError, TypeError, ValueError, IndexError, RecursionError) as error:
        raise HarnessError(f"trace: expected {FORMAT}, found something else ({type(error).__name__})") from error


def observation_from_json(data: list[Any]) -> Observation:
    """Return one observation; raises ValueError, TypeError, KeyError or IndexError for anything else."""
    kind, *fields = data
    return READERS[kind](fields)


def _message(fields: list[Any]) -> Message:
    t_ns, topic, kind, value, cdr = fields
    return Message(_whole(t_ns), _text(topic), _text(kind), lively(_mapping(value)), _bytes(cdr))


def _delivery(fields: list[Any]) -> Delivery:
    t_ns, topic, kind, value, cdr = fields
    return Delivery(_whole(t_ns), _text(topic), _text(kind), lively(_mapping(value)), _bytes(cdr))


def _log(fields: list[Any]) -> LogRecord:
    t_ns, *texts, line = fields
    process, severity, logger, text, file = map(_text, texts)
    return LogRecord(_whole(t_ns), process, severity, logger, text, file, _whole(line))


def _line(fields: list[Any]) -> OutputLine:
    t_ns, *texts = fields
    process, stream, text = map(_text, texts)
    return OutputLine(_whole(t_ns), process, stream, text)


def _graph(fields: list[Any]) -> GraphSnapshot:
    t_ns, nodes, ends, *rest = fields
    (services,) = rest or ([],)
    return GraphSnapshot(
        _whole(t_ns),
        tuple(map(_text, _list(nodes))),
        tuple(_endpoint(e) for e in _list(ends)),
        tuple(_service_end(e) for e in _list(services)),
    )


def _service_end(fields: list[Any]) -> ServiceEnd:
    kind, service, interface, node = map(_text, fields)
    return ServiceEnd(kind, service, interface, node)


def _exchange(of: type[Request] | type[Response], fields: list[Any]) -> Request | Response:
    t_ns, service, kind, number, sender, client, value, cdr = fields
    return of(
        _whole(t_ns),
        _text(service),
        _text(kind),
        _whole(number),
        _text(sender),
        _whole(client),
        lively(_mapping(value)),
        _bytes(cdr),
    )


def _endpoint(fields: list[Any]) -> Endpoint:
    kind, topic, interface, node, participant, reliability, durability, depth, deadline_ns, liveliness = fields
    return Endpoint(
        _text(kind),
        _text(topic),
        _text(interface),
        _text(node),
        _whole(participant),
        _text(reliability),
        _text(durability),
        _whole(depth),
        _whole(deadline_ns),
        _text(liveliness),
    )


def _fault(fields: list[Any]) -> Fault:
    t_ns, process, kind, text, file, line, frames, *rest = fields
    kind, text = FaultKind(kind), _text(text)
    details = _fault_details(*rest) if rest else details_from_text(kind, text)
    frames = tuple(map(_text, _list(frames)))
    return Fault(_whole(t_ns), _text(process), kind, text, _text(file), _whole(line), frames, *details)


def _fault_details(details: list[Any]) -> FaultDetails:
    exit_code, signal, python = _list(details)
    if python is not None:
        major, minor = map(_whole, _list(python))
        python = major, minor
    return exit_code if exit_code is None else _whole(exit_code), _text(signal), python


def details_from_text(kind: FaultKind, text: str) -> FaultDetails:
    """Return exit code, signal and Python version of a fault whose recording has only the text.

    Early recordings of version 1 tell these three only in the words of that time. Nothing else reads them from text.
    """
    exited = _EXITED.fullmatch(text) if kind is FaultKind.EXITED else None
    killed = _KILLED.fullmatch(text) if kind is FaultKind.KILLED else None
    version = _PYTHON.search(text) if kind is FaultKind.SYNTAX_ERROR else None
    return (
        int(exited[1]) if exited else None,
        killed[1] if killed else "",
        (int(version[1]), int(version[2])) if version else None,
    )


def _offer(fields: list[Any]) -> Offer:
    t_ns, *texts = fields
    process, kind, name, detail = map(_text, texts)
    return Offer(_whole(t_ns), process, kind, name, detail)


def _start(fields: list[Any]) -> Start:
    process, file, way, target, hidden = fields
    names = tuple(map(_text, _list(hidden)))
    return Start(_text(process), _text(file), StartWay(way), _text(target), names)


def _mark(fields: list[Any]) -> Mark:
    t_ns, name, detail = fields
    return Mark(_whole(t_ns), _text(name), _text(detail))


def _whole(value: Any) -> int:
    if type(value) is not int:
        raise TypeError(value)
    return value


def _text(value: Any) -> str:
    if type(value) is not str:
        raise TypeError(value)
    return value


def _bytes(value: Any) -> bytes:
    return base64.b64decode(_text(value), validate=True)


def _list(value: Any) -> list[Any]:
    if type(value) is not list:
        raise TypeError(value)
    return value


def _mapping(value: Any) -> dict[str, Any]:
    if type(value) is not dict:
        raise TypeError(value)
    return value


READERS: Mapping[str, Callable[[list[Any]], Observation]] = {
    "message": _message,
    "delivery": _delivery,
    "request": lambda fields: _exchange(Request, fields),
    "response": lambda fields: _exchange(Response, fields),
    "log": _log,
    "line": _line,
    "graph": _graph,
    "fault": _fault,
    "offer": _offer,
    "mark": _mark,
}
