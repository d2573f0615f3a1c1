"""Converts every observation of a trace to a message on a topic, for tools that read rosbag2."""

from __future__ import annotations

import base64
import json
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

from grader.core.quantities import NS_PER_S
from grader.core.releases import DEFAULT
from grader.core.trace import (
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
)
from grader.execution.codec import observation_to_json, plain, to_json

#: Deepest nesting of a message that is built from its fields.
DEPTH = 8
_ZERO: Mapping[str, Any] = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}


class Unknown(ValueError):  # noqa: N818 - named after what the type or the bytes are
    """A message has a type without a known definition, or its bytes do not match the type."""


@dataclass(frozen=True, slots=True)
class Definition:
    """The definition of a message type: its text, including nested types, and its hash."""

    text: str
    digest: str


@lru_cache(maxsize=1)
def _store() -> Any:
    return get_typestore(Stores[DEFAULT.messages])


@lru_cache(maxsize=256)
def definition(interface: str) -> Definition:
    """Return the definition of a message type; raises Unknown if it is not one of ROS's common types."""
    if interface not in _store().fielddefs:
        raise Unknown(interface)
    text, _ = _store().generate_msgdef(interface, ros_version=2)
    return Definition(text, _store().hash_rihs01(interface))


def check_readable(interface: str, cdr: bytes) -> None:
    """Check that other tools can decode a message; raises Unknown if they cannot."""
    definition(interface)
    try:
        _store().deserialize_cdr(cdr, interface)
    except Exception as error:  # a malformed message may fail anywhere in the generated decoder
        raise Unknown(interface) from error


def encode(interface: str, value: Mapping[str, Any]) -> bytes:
    """Serialize a message with these fields, all others zero, as CDR; raises Unknown if they do not fit the type."""
    definition(interface)
    try:
        return bytes(_store().serialize_cdr(_built(interface, value), interface))
    except Exception as error:  # values that a message cannot hold fail anywhere in the generated encoder
        raise Unknown(interface) from error


def _built(interface: str, value: Mapping[str, Any], depth: int = 0) -> Any:
    _, fields = _store().fielddefs[interface]
    if depth > DEPTH or not value.keys() <= {name for name, _ in fields}:
        raise Unknown(interface)
    return _store().types[interface](**{name: _field(kind, value.get(name), depth) for name, kind in fields})


def _field(kind: tuple[Nodetype, Any], value: Any, depth: int) -> Any:
    node, detail = kind
    if node == Nodetype.NAME:
        return _built(detail, {} if value is None else value, depth + 1)
    if node != Nodetype.BASE:
        raise Unknown(str(detail))
    return _ZERO.get(detail[0], 0) if value is None else value


STRING = "std_msgs/msg/String"
LOG = "rcl_interfaces/msg/Log"
ROSOUT = "/rosout"
#: Topics for observations other than ROS messages, as JSON.
OUTPUT, GRAPH, FAULTS, OFFERS, MARKS, CALLS = (
    f"/grader/{name}" for name in ("output", "graph", "faults", "offers", "marks", "calls")
)
#: Messages that cannot be decoded, or whose type has no known definition.
UNDECODED = "/grader/undecoded"
#: Information about the whole recording, once at its beginning.
RUN = "/grader/run"
_LEVELS = {"DEBUG": 10, "INFO": 20, "WARN": 30, "ERROR": 40, "FATAL": 50}
_TOPICS = {
    OutputLine: OUTPUT,
    GraphSnapshot: GRAPH,
    Fault: FAULTS,
    Offer: OFFERS,
    Mark: MARKS,
    Request: CALLS,
    Response: CALLS,
}
_MOST_NS = 2**63 - 1


@dataclass(frozen=True, slots=True)
class Shown:
    """One message of a recording."""

    t_ns: int  # virtual receive time, from 0
    topic: str  # its topic, or one of the grader's own topics
    type: str
    publisher: str  # `student` or `grader`
    cdr: bytes
    exact: bool = False  # whether `cdr` is exactly what was sent, as in the trace


def shown(observations: tuple[Observation, ...]) -> Iterator[Shown]:
    """Yield one message for each observation, in order."""
    for observation in observations:
        if isinstance(observation, (Message, Delivery)):
            yield _message(observation)
        elif isinstance(observation, LogRecord):
            yield _log(observation)
        else:
            yield said(observation.t_ns, _TOPICS[type(observation)], _fields(observation))


def said(t_ns: int, topic: str, value: Any) -> Shown:
    """Convert a JSON value to a message on one of the grader's own topics."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Shown(_clamped(t_ns), topic, STRING, "grader", encode(STRING, {"data": text}))


def _message(message: Message | Delivery) -> Shown:
    publisher = "student" if isinstance(message, Message) else "grader"
    t_ns = _clamped(message.t_ns)
    try:
        _check_name(message.topic)
        if message.cdr:
            check_readable(message.type, message.cdr)
            return Shown(t_ns, message.topic, message.type, publisher, message.cdr, exact=True)
        if not message.value:
            raise Unknown(message.type)  # its content was not kept; zeros would pass for it
        return Shown(t_ns, message.topic, message.type, publisher, encode(message.type, message.value))
    except Unknown:
        value = {
            "publisher": publisher,
            "topic": message.topic,
            "type": message.type,
            "value": plain(message.value),
            "cdr": base64.b64encode(message.cdr).decode(),
        }
        return said(t_ns, UNDECODED, value)


def _check_name(topic: str) -> None:
    """Raise Unknown for an invalid ROS topic, or one that looks like the grader's own."""
    plain_name = topic.isascii() and topic.isprintable() and topic.startswith("/") and len(topic) < 256
    if not plain_name or topic == ROSOUT or topic.startswith("/grader/"):
        raise Unknown(topic)


def _log(record: LogRecord) -> Shown:
    t_ns = _clamped(record.t_ns)
    value = {
        "stamp": {"sec": min(t_ns // NS_PER_S, 2**31 - 1), "nanosec": t_ns % NS_PER_S},
        "level": _LEVELS.get(record.severity, 0),
        "name": _text(record.logger),
        "msg": _text(record.text),
        "file": _text(record.file or record.process),
        "line": min(max(0, record.line), 2**32 - 1),
    }
    return Shown(t_ns, ROSOUT, LOG, "student", encode(LOG, value))


def _fields(observation: Observation) -> dict[str, Any]:
    """Convert an observation to a dictionary by field name, without its time."""
    _, _, *values = observation_to_json(observation)
    fields = dict(zip(type(observation).__slots__[1:], values, strict=False))
    if isinstance(observation, GraphSnapshot):
        fields |= {"endpoints": to_json(observation.endpoints), "services": to_json(observation.services)}
    if isinstance(observation, (Request, Response)):
        fields = {"what": type(observation).__name__.lower(), **fields}
    return fields


def _text(text: str) -> str:
    """Replace what some readers of CDR strings reject: lone surrogates and NUL."""
    return text.encode("utf-8", "replace").decode().replace("\0", "\ufffd")


def _clamped(t_ns: int) -> int:
    return min(max(0, t_ns), _MOST_NS)
