"""Packs traces for judging: the codec's JSON, with placeholders for message bytes that the recording contains."""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import fields, replace
from functools import partial
from typing import Any, TypeAlias, Union, get_args, get_origin, get_type_hints

import msgspec

from grader.runtime.model.errors import EvidenceError, HarnessError
from grader.runtime.model.trace import (
    AssessedTrace,
    BagContents,
    Delivery,
    Endpoint,
    Fault,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    NewerPython,
    Observation,
    Offer,
    OtherNumpy,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Start,
    Tested,
    WrittenFile,
)
from grader.runtime.model.worlds import Sketch
from grader.runtime.recording.codec import FORMAT, HEAD, TAGS, trace_to_json

#: Shorter values take less memory as dicts; a longer one may contain a number that no decoder accepts.
_SHORTEST, _LONGEST = 64, 4_000
_OPENING = ord("{")
_decode = msgspec.json.Decoder(dict[str, Any]).decode


class Fields(Mapping[str, Any]):
    """A JSON object in ASCII that is decoded on each access, because most of a trace is never read."""

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


#: A text with more lists and objects than this may be nested deeper than Python's limit of recursion, which the exact
#: way refuses; from Python 3.12 on, decoding alone refuses only what is nested much deeper.
_MANY_OPENINGS = 500


def _openings(text: bytes) -> int:
    return text.count(b"[") + text.count(b"{")


def decoded_fields(text: msgspec.Raw) -> Mapping[str, Any]:
    """Decode the fields of a JSON object.

    Raises MsgspecError if the text is not an object, and RecursionError if it is nested too deeply.
    """
    if len(text) > _MANY_OPENINGS and _openings(bytes(text)) > _MANY_OPENINGS:
        _lively(fields := _decode(text))
        return fields
    lazy = _SHORTEST < len(text) <= _LONGEST and memoryview(text)[0] == _OPENING
    return Fields(text) if lazy else _decode(text)


#: Exit code, signal and Python version of a fault, as `Fault` has them.
_FaultDetails: TypeAlias = tuple[int | None, str, tuple[int, int] | None]
#: The last field of a message, which is left out if it is false.
_EARLY = ("before_discovery", bool, False)
_SPECIAL = {"nan": math.nan, "inf": math.inf, "-inf": -math.inf}
#: Placeholder for bytes that are a message of the recording.
THERE = "*"
#: Index of the bytes in packed messages, and in packed requests and responses.
_CDR = 5
_PLACES = {"message": _CDR, "delivery": _CDR, "request": 8, "response": 8}
_ODD_NUMBER = b'{"float":'


def _lively(value: Any) -> Any:
    """Undo `plain` for the fields of a message."""
    if isinstance(value, dict):
        if value.keys() == {"float"} and isinstance(value["float"], str):
            return _SPECIAL[value["float"]]
        return {name: _lively(field) for name, field in value.items()}
    return [_lively(field) for field in value] if isinstance(value, list) else value


def _row_of(kind: type, *left_out: str, last: tuple[Any, ...] = (), **others: Any) -> Any:
    """Create the struct that validates a packed dataclass: a list of its fields, after its tag if it has one.

    Fields are left out that are not written, or written in another way; others are written as another type. The last
    one is name and type of a field at the end, with its default if it is left out when it has that.
    """
    hints = {**get_type_hints(kind), **others}
    fields_ = [(field.name, hints[field.name]) for field in fields(kind) if field.name not in left_out]
    return msgspec.defstruct(
        kind.__name__,
        [*fields_, *([last] if last else [])],
        array_like=True,
        forbid_unknown_fields=True,
        tag=TAGS.get(kind),
        tag_field="is" if kind in TAGS else None,
    )


#: A start; what it was given on the command line follows in a list, if there is any.
_START = _row_of(Start, "arguments", "launched_by", last=("given", tuple[str, str], ("", "")))


#: The end of a service; its QoS follows in a list, if it is not the usual one.
_SERVICE_END = _row_of(ServiceEnd, "reliability", "durability", last=("qos", tuple[str, str], ("reliable", "volatile")))


def _start(row: Any) -> Start:
    *values, given = msgspec.structs.astuple(row)
    return Start(*values, *given)


def _trace_row(rows: Iterable[Any]) -> Any:
    """Create the struct that validates the output of `trace_to_json`, with these structs for observations."""
    observations: Any = list[Union[tuple(rows)]]  # type: ignore[misc]  # noqa: UP007
    written: list[Any] = [("format", str), ("observations", observations)]
    written += [(name, _written_as(hint)) for name, hint in _HINTS.items() if name in HEAD]
    usual = {field.name: field.default for field in fields(AssessedTrace)}
    written += [(name, _written_as(hint), usual[name]) for name, hint in _HINTS.items() if name not in HEAD]
    return msgspec.defstruct("Trace", written)


def _trace_of(row: Any, makers: Mapping[type, Callable[[Any], Observation]]) -> AssessedTrace:
    """Build a trace from a struct, with these functions for observations."""
    values = {name: _made(hint, getattr(row, name)) for name, hint in _HINTS.items()}
    return AssessedTrace(observations=tuple([makers[type(one)](one) for one in row.observations]), **values)


def _part_of(hint: Any) -> Any:
    """Return the one of `_PARTS` in the type of a field; None if there is none."""
    return next((one for one in (hint, *get_args(hint)) if one in _PARTS), None)


def _written_as(hint: Any) -> Any:
    """Return the type that a field of a trace is written as."""
    if (part := _part_of(hint)) is None:
        return hint
    row: Any = _PARTS[part][0]
    return tuple[row, ...] if get_origin(hint) is tuple else row | None


def _made(hint: Any, value: Any) -> Any:
    """Return the value of a field of a trace from what was written."""
    if (part := _part_of(hint)) is None or value is None:
        return value
    make = _PARTS[part][1]
    return tuple(map(make, value)) if get_origin(hint) is tuple else make(value)


def trace_from_json(data: Any) -> AssessedTrace:
    """Build a trace from JSON values; raises HarnessError if they are not valid."""
    try:
        if data["format"] != FORMAT:
            raise HarnessError(f"trace: expected format {FORMAT}, found {str(data['format'])[:40]}")
        return _trace_of(msgspec.convert(data, _TRACE), _EXACT_MAKERS)
    except (KeyError, TypeError, ValueError, IndexError, RecursionError) as error:
        raise HarnessError(f"trace: expected {FORMAT}, found something else ({type(error).__name__})") from error


def observations_from_json(rows: Any) -> list[Observation]:
    """Build observations from their JSON values; raises HarnessError if they are not valid."""
    try:
        return [_EXACT_MAKERS[type(row)](row) for row in msgspec.convert(rows, _OBSERVATIONS)]
    except (KeyError, TypeError, ValueError) as error:
        raise HarnessError(f"trace: expected observations, found something else ({type(error).__name__})") from error


def _same(kind: Callable[..., Any], row: Any) -> Any:
    return kind(*msgspec.structs.astuple(row))


def _carrying(kind: Any, row: Any) -> Any:
    values = {name: getattr(row, name) for name in kind.__slots__}
    values["value"], values["cdr"] = _lively(row.value), base64.b64decode(row.cdr, validate=True)
    return kind(**values)


def _graph(row: Any) -> GraphSnapshot:
    ends = tuple(_same(Endpoint, end) for end in row.endpoints)
    return GraphSnapshot(row.t_ns, row.nodes, ends, tuple(map(_service_end, row.services)))


def _service_end(row: Any) -> ServiceEnd:
    *values, qos = msgspec.structs.astuple(row)
    return ServiceEnd(*values, *qos)


def _fault(row: Any) -> Fault:
    *values, details = msgspec.structs.astuple(row)
    return Fault(*values, *details)


def _without_bytes(kind: type[Message] | type[Delivery]) -> Callable[[Any], Observation]:
    blank = kind.__new__
    # the __init__ of a frozen dataclass takes twice as long, and there may be thousands of messages
    t_ns, topic, type_, value, cdr, *early = (getattr(kind, name).__set__ for name in kind.__slots__)

    def make(row: Any) -> Observation:
        made = blank(kind)
        t_ns(made, row.t_ns)
        topic(made, row.topic)
        type_(made, row.type)
        value(made, decoded_fields(row.value))
        cdr(made, b"")
        for before_discovery in early:  # of messages of students' nodes
            before_discovery(made, row.before_discovery)
        return made

    return make


def _exchange(kind: type[Request] | type[Response]) -> Callable[[Any], Observation]:
    return lambda row: kind(row.t_ns, row.service, row.type, row.number, row.sender, row.client, row.value)


#: For each kind of observation, the struct that validates it and the function that builds it.
_EXACT_ROWS: Mapping[type, Any] = {
    Message: _row_of(Message, _EARLY[0], last=_EARLY, value=dict[str, Any], cdr=str),
    **{kind: _row_of(kind, value=dict[str, Any], cdr=str) for kind in (Delivery, Request, Response)},
    **{kind: _row_of(kind) for kind in (LogRecord, OutputLine, Offer, Mark)},
    GraphSnapshot: _row_of(
        GraphSnapshot,
        "services",
        endpoints=tuple[_row_of(Endpoint, "lease_ns", last=("lease_ns", int, 0)), ...],  # type: ignore[misc]
        last=("services", tuple[_SERVICE_END, ...], ()),  # type: ignore[valid-type]
    ),
    Fault: _row_of(Fault, "exit_code", "signal", "python", last=("details", _FaultDetails)),
}
_EXACT_MAKERS: Mapping[type, Callable[[Any], Observation]] = {
    **{_EXACT_ROWS[kind]: partial(_carrying, kind) for kind in (Message, Delivery, Request, Response)},
    **{_EXACT_ROWS[kind]: partial(_same, kind) for kind in (LogRecord, OutputLine, Offer, Mark)},
    _EXACT_ROWS[GraphSnapshot]: _graph,
    _EXACT_ROWS[Fault]: _fault,
}
#: What a test has found; the fault is a row as among the observations.
_TESTED = msgspec.defstruct(
    "Tested",
    [
        ("passed", bool),
        ("reason", str),
        ("hint", str),
        ("missing", tuple[str, ...]),
        ("fault", _EXACT_ROWS[Fault] | None, None),
    ],
)


def _tested(row: Any) -> Tested:
    fault = None if row.fault is None else _fault(row.fault)
    return Tested(row.passed, row.reason, row.hint, fault, row.missing)


#: What fields of a trace hold besides plain values: the struct that validates it, and what makes it from that.
_PARTS: Mapping[Any, tuple[Any, Callable[[Any], Any]]] = {
    Start: (_START, _start),
    Tested: (_TESTED, _tested),
    **{
        kind: (_row_of(kind), partial(_same, kind))
        for kind in (WrittenFile, NewerPython, OtherNumpy, Sketch, BagContents)
    },
}
#: The types of the fields of a trace but its observations: memory, the wire and evidence follow from them.
_HINTS: Mapping[str, Any] = {
    field.name: get_type_hints(AssessedTrace)[field.name]
    for field in fields(AssessedTrace)
    if field.init and field.name != "observations"
}
_TRACE = _trace_row(_EXACT_ROWS.values())
_OBSERVATIONS = list[Union[tuple(_EXACT_ROWS.values())]]  # type: ignore[misc, valid-type]  # noqa: UP007
#: The fast variant keeps the fields of messages as JSON text.
_ROWS: Mapping[type, Any] = {
    **_EXACT_ROWS,
    Message: _row_of(Message, _EARLY[0], last=_EARLY, value=msgspec.Raw, cdr=str),
    Delivery: _row_of(Delivery, value=msgspec.Raw, cdr=str),
}
_MAKERS: Mapping[type, Callable[[Any], Observation]] = {
    **_EXACT_MAKERS,
    _ROWS[Message]: _without_bytes(Message),
    _ROWS[Delivery]: _without_bytes(Delivery),
    _ROWS[Request]: _exchange(Request),
    _ROWS[Response]: _exchange(Response),
}
_DECODER = msgspec.json.Decoder(_trace_row(_ROWS.values()))


def pack_trace(trace: AssessedTrace, there: Sequence[bool]) -> bytes:
    """Pack a trace as JSON; the same trace gives the same bytes.

    For each observation, `there` says whether the recording contains its bytes as a message.
    """
    data = trace_to_json(trace)
    for row, left_out in zip(data["observations"], there, strict=True):
        if left_out:
            row[_CDR] = THERE
    return json.dumps(data, allow_nan=False, separators=(",", ":")).encode()


def unpack_trace(data: bytes) -> AssessedTrace:
    """Unpack a trace without the bytes of messages, which judging does not read; raises EvidenceError if invalid."""
    if not data.isascii():
        return unpack_exactly(data, None)  # `pack` writes ASCII, and only of that the quick way checks every byte
    try:
        packed = _DECODER.decode(data)
        trace = _trace_of(packed, _MAKERS)
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError):
        return unpack_exactly(data, None)  # texts that no encoding holds, or damage: the codec tells which
    if packed.format != FORMAT:
        raise EvidenceError(f"trace: expected format {FORMAT}, found {packed.format[:40]}")
    if _ODD_NUMBER in data:
        return replace(trace, observations=tuple(map(_revived, trace.observations)))
    return trace


def unpack_exactly(data: bytes, cdrs: Sequence[bytes] | None) -> AssessedTrace:
    """Unpack a trace; raises EvidenceError if it is invalid, or does not match the recording.

    The bytes of the recording's messages are given one for each observation; None leaves them out.
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
    """Convert the NaN and infinities of an observation back to numbers."""
    if not isinstance(observation, (Message, Delivery, Request, Response)):
        return observation
    try:
        return replace(observation, value=_lively(dict(observation.value)))
    except KeyError as error:
        raise EvidenceError("trace: expected a number, found another word") from error
