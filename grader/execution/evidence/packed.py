"""Traces packed for judging: the JSON of the codec, with marks where the bytes of messages stand in the recording."""

from __future__ import annotations

import base64
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any

import msgspec

from grader.core.errors import EvidenceError, HarnessError
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
from grader.execution.codec import FORMAT, FaultDetails, details_from_text, lively, trace_from_json, trace_to_json

#: Shorter values take less as the dict they are; a longer one may hold a number that no decoder takes.
_SHORTEST, _LONGEST = 64, 4_000
_OPENING = ord("{")
_decode = msgspec.json.Decoder(dict[str, Any]).decode


class Fields(Mapping[str, Any]):
    """A mapping that is decoded again whenever something is looked up: most of a trace is never looked at.

    Args:
        text: A JSON object in ASCII, its syntax checked.
    """

    __slots__ = ("_text",)

    def __init__(self, text: msgspec.Raw) -> None:
        self._text = text

    def __getitem__(self, name: str) -> Any:
        return self._decoded()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._decoded())

    def __len__(self) -> int:
        return len(self._decoded())

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Fields):
            return self._text == other._text or self._decoded() == other._decoded()
        return self._decoded() == other

    __hash__ = None  # type: ignore[assignment]  # like any mapping that may hold a list

    def _decoded(self) -> dict[str, Any]:
        try:
            return _decode(self._text)
        except (msgspec.MsgspecError, UnicodeDecodeError):  # numbers and texts that only the exact way takes
            fields: dict[str, Any] = json.loads(bytes(self._text))
            return fields


def fields_of(text: msgspec.Raw) -> Mapping[str, Any]:
    """Return the fields that a JSON text holds; raises MsgspecError if it holds no object."""
    lazy = _SHORTEST < len(text) <= _LONGEST and memoryview(text)[0] == _OPENING
    return Fields(text) if lazy else _decode(text)


#: Stands for bytes that are a message of the recording itself.
THERE = "*"
#: Place of the bytes in what is packed of messages, and of requests and responses.
_CDR = 5
_PLACES = {"message": _CDR, "delivery": _CDR, "request": 8, "response": 8}
_ODD_NUMBER = b'{"float":'


class _Row(msgspec.Struct, array_like=True, forbid_unknown_fields=True, tag_field="is"):
    """One observation as it is written: its kind, then its fields in their order."""


class _Message(_Row, tag="message"):
    t_ns: int
    topic: str
    type: str
    value: msgspec.Raw
    cdr: str


class _Delivery(_Message, tag="delivery"):
    pass


class _Request(_Row, tag="request"):
    t_ns: int
    service: str
    type: str
    number: int
    sender: str
    client: int
    value: dict[str, Any]
    cdr: str


class _Response(_Request, tag="response"):
    pass


class _Log(_Row, tag="log"):
    t_ns: int
    process: str
    severity: str
    logger: str
    text: str
    file: str
    line: int


class _Line(_Row, tag="line"):
    t_ns: int
    process: str
    stream: str
    text: str


class _End(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    kind: str
    topic: str
    type: str
    node: str
    participant: int
    reliability: str
    durability: str
    depth: int
    deadline_ns: int
    liveliness: str


class _Service(msgspec.Struct, array_like=True, forbid_unknown_fields=True):
    kind: str
    service: str
    type: str
    node: str


class _Graph(_Row, tag="graph"):
    t_ns: int
    nodes: list[str]
    endpoints: list[_End]
    services: list[_Service] = []


class _Fault(_Row, tag="fault"):
    t_ns: int
    process: str
    kind: FaultKind
    text: str
    file: str
    line: int
    frames: tuple[str, ...]
    details: FaultDetails | msgspec.UnsetType = msgspec.UNSET


class _Offer(_Row, tag="offer"):
    t_ns: int
    process: str
    kind: str
    name: str
    detail: str


class _Mark(_Row, tag="mark"):
    t_ns: int
    name: str
    detail: str


class _Packed(msgspec.Struct, forbid_unknown_fields=True):
    """A whole trace as it is written."""

    format: str
    scenario: str
    clock: ClockKind
    clock_reason: str
    stop_ns: int
    notes: tuple[str, ...]
    harness_problem: str
    observations: list[_Message | _Delivery | _Request | _Response | _Log | _Line | _Graph | _Fault | _Offer | _Mark]
    starts: list[tuple[str, str, StartWay, str, tuple[str, ...]]] = []


_DECODER = msgspec.json.Decoder(_Packed)
_fields = msgspec.structs.astuple


def _graph(row: _Graph) -> GraphSnapshot:
    services = tuple(ServiceEnd(*_fields(end)) for end in row.services)
    return GraphSnapshot(row.t_ns, tuple(row.nodes), tuple(Endpoint(*_fields(end)) for end in row.endpoints), services)


def _fault(row: _Fault) -> Fault:
    *fields, details = _fields(row)
    return Fault(*fields, *(details_from_text(row.kind, row.text) if details is msgspec.UNSET else details))


def _without_bytes(kind: type[Message] | type[Delivery]) -> Callable[[Any], Observation]:
    blank = kind.__new__
    # the __init__ of a frozen dataclass takes twice as long, and there are a thousand messages
    t_ns, topic, type_, value, cdr = (getattr(kind, name).__set__ for name in kind.__slots__)

    def make(row: _Message) -> Observation:
        made = blank(kind)
        t_ns(made, row.t_ns)
        topic(made, row.topic)
        type_(made, row.type)
        value(made, fields_of(row.value))
        cdr(made, b"")
        return made

    return make


def _exchange(kind: type[Request] | type[Response]) -> Callable[[Any], Observation]:
    return lambda row: kind(row.t_ns, row.service, row.type, row.number, row.sender, row.client, row.value)


_MAKERS: Mapping[type[_Row], Callable[[Any], Observation]] = {
    _Message: _without_bytes(Message),
    _Delivery: _without_bytes(Delivery),
    _Request: _exchange(Request),
    _Response: _exchange(Response),
    _Log: lambda row: LogRecord(*_fields(row)),
    _Line: lambda row: OutputLine(*_fields(row)),
    _Graph: _graph,
    _Fault: _fault,
    _Offer: lambda row: Offer(*_fields(row)),
    _Mark: lambda row: Mark(*_fields(row)),
}


def pack(trace: Trace, there: Sequence[bool]) -> bytes:
    """Return a trace as JSON; the same trace gives the same bytes.

    Args:
        trace: What was observed.
        there: For each observation, whether the recording has its bytes as a message of their own.
    """
    data = trace_to_json(trace)
    for row, left_out in zip(data["observations"], there, strict=True):
        if left_out:
            row[_CDR] = THERE
    return json.dumps(data, allow_nan=False, separators=(",", ":")).encode()


def unpack(data: bytes) -> Trace:
    """Return what `pack` was given, without the bytes of messages, which judging does not read.

    Raises:
        EvidenceError: This is no packed trace.
    """
    if not data.isascii():
        return unpack_exactly(data, None)  # `pack` writes ASCII, and only of that the quick way checks every byte
    try:
        packed = _DECODER.decode(data)
        observations = tuple([_MAKERS[type(row)](row) for row in packed.observations])
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return unpack_exactly(data, None)  # texts that no encoding holds, or damage: the codec tells which
    if packed.format != FORMAT:
        raise EvidenceError(f"trace: expected format {FORMAT}, found {packed.format[:40]}")
    if _ODD_NUMBER in data:
        observations = tuple(map(_revived, observations))
    return Trace(
        packed.scenario,
        packed.clock,
        packed.stop_ns,
        observations,
        packed.clock_reason,
        packed.notes,
        packed.harness_problem,
        tuple(Start(*start) for start in packed.starts),
    )


def unpack_exactly(data: bytes, cdrs: Sequence[bytes] | None) -> Trace:
    """Return what `pack` was given.

    Args:
        data: A packed trace.
        cdrs: The bytes of the recording's messages, one for each observation; None leaves all messages without.

    Raises:
        EvidenceError: This is no packed trace, or not that of the recording.
    """
    try:
        rows = json.loads(data)
        for index, row in enumerate(rows["observations"]):
            place = _PLACES.get(row[0])
            if place is not None:
                row[place] = _base64(row[place], cdrs, index)
        return trace_from_json(rows)
    except HarnessError as error:
        raise EvidenceError(error.message) from error
    except (KeyError, TypeError, ValueError, IndexError, RecursionError) as error:
        raise EvidenceError(f"trace: expected {FORMAT}, found something else ({type(error).__name__})") from error


def _base64(packed: str, cdrs: Sequence[bytes] | None, index: int) -> str:
    if cdrs is None:
        return ""
    return base64.b64encode(cdrs[index]).decode() if packed == THERE else packed


def _revived(observation: Observation) -> Observation:
    """Return an observation whose NaN and infinities are numbers again."""
    if not isinstance(observation, (Message, Delivery, Request, Response)):
        return observation
    try:
        return replace(observation, value=lively(dict(observation.value)))
    except KeyError as error:
        raise EvidenceError("trace: expected a number, found another word") from error
