"""Writes one scenario's recording as an MCAP file for rosbag2, and reads the trace for judging from it.

Every observation becomes a message on a topic, for tools that read rosbag2; the trace itself is an attachment.
"""

from __future__ import annotations

import base64
import io
import json
import textwrap
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import field
from functools import lru_cache
from typing import Any

import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore
from ruamel.yaml import YAML

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.limits import MAX_TRACE_BYTES
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.releases import DEFAULT
from grader.runtime.model.submission import Definition
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
)
from grader.runtime.recording.codec import observation_to_json, plain, to_json
from grader.runtime.recording.packed import pack_trace, unpack_exactly, unpack_trace

#: The attachment with everything that judging reads.
TRACE = "trace.json.zst"
#: The name of an attachment with a file that a program wrote begins so.
WRITTEN = "written"
#: Name of the metadata record about the run.
FACTS = "grader"
#: Version of rosbag2's metadata format in Jazzy.
ROSBAG2_VERSION = 9
_LIBRARY = "rclpy-grader evidence v1"
_Key = tuple[str, str, str]
#: Deepest nesting of a message that is built from its fields.
DEPTH = 8
_ZERO: Mapping[str, Any] = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}


class UnknownType(ValueError):  # noqa: N818 - named after what the type or the bytes are
    """A message has a type without a known definition, or its bytes do not match the type."""


@lru_cache(maxsize=1)
def _store() -> Any:
    return get_typestore(Stores[DEFAULT.messages])


def definition(interface: str, brought: Mapping[str, Definition]) -> Definition:
    """Return the definition of a message type; raises Unknown unless it is brought or one of ROS's common types."""
    return brought[interface] if interface in brought else _common(interface)


@lru_cache(maxsize=256)
def _common(interface: str) -> Definition:
    if interface not in _store().fielddefs:
        raise UnknownType(interface)
    text, _ = _store().generate_msgdef(interface, ros_version=2)
    return Definition(text, _store().hash_rihs01(interface))


def check_readable(message: Message | Delivery, brought: Mapping[str, Definition]) -> None:
    """Check that other tools can decode a message; raises Unknown if they cannot.

    For a brought type that is left to the worker, which keeps no value of a malformed message: the definition may be a
    student's, and a decoder of this process would be code that is generated from it.
    """
    interface = message.type
    if interface in brought:
        if not message.value:
            raise UnknownType(interface)
        return
    _common(interface)
    try:
        _store().deserialize_cdr(message.cdr, interface)
    except Exception as error:  # a malformed message may fail anywhere in the generated decoder
        raise UnknownType(interface) from error


def encode(interface: str, value: Mapping[str, Any]) -> bytes:
    """Serialize a message with these fields, all others zero, as CDR; raises Unknown if they do not fit the type."""
    _common(interface)
    try:
        return bytes(_store().serialize_cdr(_built(interface, value), interface))
    except Exception as error:  # values that a message cannot hold fail anywhere in the generated encoder
        raise UnknownType(interface) from error


def _built(interface: str, value: Mapping[str, Any], depth: int = 0) -> Any:
    _, fields = _store().fielddefs[interface]
    if depth > DEPTH or not value.keys() <= {name for name, _ in fields}:
        raise UnknownType(interface)
    return _store().types[interface](**{name: _field(kind, value.get(name), depth) for name, kind in fields})


def _field(kind: tuple[Nodetype, Any], value: Any, depth: int) -> Any:
    node, detail = kind
    if node == Nodetype.NAME:
        return _built(detail, {} if value is None else value, depth + 1)
    if node != Nodetype.BASE:
        raise UnknownType(str(detail))
    return _ZERO.get(detail[0], 0) if value is None else value


STRING = "std_msgs/msg/String"
LOG = "rcl_interfaces/msg/Log"
ROSOUT = "/rosout"
#: Topics for observations other than ROS messages, as JSON.
OUTPUT, GRAPH, FAULTS, OFFERS, MARKS, CALLS = (
    f"/grader/{name}" for name in ("output", "graph", "faults", "offers", "marks", "calls")
)
#: What the topics of the recording itself begin with, beside those of the nodes.
OWN = "/grader/"
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
#: MCAP has 64 bits for a time, and rosbag2 reads them as a signed number.
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


def observation_messages(observations: tuple[Observation, ...], brought: Mapping[str, Definition]) -> Iterator[Shown]:
    """Yield one message for each observation, in order."""
    for observation in observations:
        if isinstance(observation, (Message, Delivery)):
            yield _message(observation, brought)
        elif isinstance(observation, LogRecord):
            yield _log(observation)
        else:
            yield said(observation.t_ns, _TOPICS[type(observation)], _fields(observation))


def said(t_ns: int, topic: str, value: Any) -> Shown:
    """Convert a JSON value to a message on one of the grader's own topics."""
    text = json.dumps(value, allow_nan=False, separators=(",", ":"))
    return Shown(_clamped(t_ns), topic, STRING, "grader", encode(STRING, {"data": text}))


def _message(message: Message | Delivery, brought: Mapping[str, Definition]) -> Shown:
    publisher = "student" if isinstance(message, Message) else "grader"
    t_ns = _clamped(message.t_ns)
    try:
        _check_name(message.topic)
        if message.cdr:
            check_readable(message, brought)
            return Shown(t_ns, message.topic, message.type, publisher, message.cdr, exact=True)
        if not message.value:
            raise UnknownType(message.type)  # its content was not kept; zeros would pass for it
        return Shown(t_ns, message.topic, message.type, publisher, encode(message.type, message.value))
    except UnknownType:
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
    if not plain_name or topic == ROSOUT or topic.startswith(OWN):
        raise UnknownType(topic)


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


@dataclass(slots=True)
class _Channels:
    """Registers topics and types with a writer as they appear, and counts messages."""

    writer: Writer
    brought: Mapping[str, Definition]
    ids: dict[_Key, int] = field(default_factory=dict)
    schemas: dict[str, int] = field(default_factory=dict)
    counts: Counter[_Key] = field(default_factory=Counter)

    def add(self, message: Shown) -> None:
        """Write one message."""
        key = (message.topic, message.type, message.publisher)
        if key not in self.ids:
            self.ids[key] = self._registered(*key)
        self.counts[key] += 1
        t_ns, sequence = message.t_ns, self.counts[key]
        self.writer.add_message(self.ids[key], t_ns, message.cdr, publish_time=t_ns, sequence=sequence)

    def _registered(self, topic: str, interface: str, publisher: str) -> int:
        known = definition(interface, self.brought)
        if interface not in self.schemas:
            self.schemas[interface] = self.writer.register_schema(interface, "ros2msg", known.text.encode())
        metadata = {"offered_qos_profiles": "", "topic_type_hash": known.digest, "publisher": publisher}
        return self.writer.register_channel(topic, "cdr", self.schemas[interface], metadata)


def recording_bytes(
    trace: AssessedTrace, facts: Mapping[str, str], name: str, brought: Mapping[str, Definition] | None = None
) -> tuple[bytes, bytes]:
    """Convert a trace to an MCAP file, and the `metadata.yaml` that makes its folder a rosbag2 recording.

    The same trace gives the same bytes. The facts are digests, seed and environment of the run; the name of the file is
    part of rosbag2's metadata. Brought are the definitions of message types that are not installed.
    """
    about, brought = _about(trace, facts), brought or {}
    messages = [said(0, RUN, about), *observation_messages(trace.observations, brought)]
    packed = pack_trace(trace, [message.exact for message in messages[1:]])
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library=_LIBRARY)
    channels = _Channels(writer, brought)
    for message in messages:
        channels.add(message)
    writer.add_attachment(0, 0, TRACE, "application/zstd", zstandard.compress(packed))
    for file in trace.written:
        name = f"{WRITTEN}/{file.process}/{file.name}"
        writer.add_attachment(0, 0, name, "application/octet-stream", base64.b64decode(file.content))
    writer.add_metadata(FACTS, {key: _fact(value) for key, value in about.items()})
    information = _yaml(_information(messages, channels, name, json.loads(facts["environment"])["ros_distro"]))
    writer.add_metadata("rosbag2", {"serialized_metadata": information})
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue(), f"rosbag2_bagfile_information:\n{textwrap.indent(information, '  ')}".encode()


def place_of_trace(recording: bytes) -> tuple[int, int]:
    """Return offset and size of the packed trace in a recording; raises EvidenceError if there is none."""
    with _reading():
        summary = make_reader(io.BytesIO(recording)).get_summary()
        index = next((i for i in (summary.attachment_indexes if summary else ()) if i.name == TRACE), None)
    if index is None:
        raise EvidenceError(f"expected a recording that holds {TRACE}, found none in it")
    # the attachment ends with its data and a checksum of four bytes
    return index.offset + index.length - 4 - index.data_size, index.data_size


def trace_at(recording: bytes, at: int, size: int) -> AssessedTrace:
    """Read the trace at an offset of a recording, without the bytes of messages, which judging does not read."""
    with _reading():
        data = _unpressed(recording[at : at + size])
    return unpack_trace(data)


def trace_of(recording: bytes) -> AssessedTrace:
    """Read the trace of a recording with the bytes of its messages."""
    data = packed_trace(recording)
    with _reading():
        messages = make_reader(io.BytesIO(recording)).iter_messages(log_time_order=False)
        cdrs = [message.data for _, _, message in messages]
    return unpack_exactly(data, cdrs[1:])


def packed_trace(recording: bytes) -> bytes:
    """Return the packed trace of a recording; raises EvidenceError if there is none."""
    with _reading():
        attachments = make_reader(io.BytesIO(recording)).iter_attachments()
        packed = next((a.data for a in attachments if a.name == TRACE), None)
        if packed is None:
            raise EvidenceError(f"expected a recording that holds {TRACE}, found none in it")
        return _unpressed(packed)


@contextmanager
def _reading() -> Iterator[None]:
    """Convert any error that parsers raise for damaged bytes to an EvidenceError."""
    try:
        yield
    except EvidenceError:
        raise
    except Exception as error:  # damaged bytes make them raise nearly anything
        raise EvidenceError(f"expected a complete MCAP file, found a damaged one ({type(error).__name__})") from error


def _unpressed(packed: bytes) -> bytes:
    size = zstandard.frame_content_size(packed)
    if not 0 <= size <= MAX_TRACE_BYTES:
        raise EvidenceError(f"expected a trace of at most {MAX_TRACE_BYTES >> 20} MiB, found {size} bytes")
    return _decompressor().decompress(packed)


@lru_cache(maxsize=1)
def _decompressor() -> zstandard.ZstdDecompressor:
    """Return a shared instance, because creating one takes longer than using it."""
    return zstandard.ZstdDecompressor()


def _about(trace: AssessedTrace, facts: Mapping[str, str]) -> dict[str, Any]:
    """Return the information that readers need before the first message."""
    return {
        "scenario": trace.scenario,
        "clock": trace.clock.value,
        "clock_reason": trace.clock_reason,
        "stop_ns": trace.stop_ns,
        "notes": list(trace.notes),
        "harness_problem": trace.harness_problem,
        **facts,
    }


def _information(messages: Iterable[Shown], channels: _Channels, name: str, distro: str) -> dict[str, Any]:
    """Return rosbag2's metadata of a recording."""
    times = [message.t_ns for message in messages]
    return {
        "version": ROSBAG2_VERSION,
        "storage_identifier": "mcap",
        **_span(times),
        "topics_with_message_count": _topics(channels),
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [name],
        "files": [{"path": name, **_span(times)}],
        "custom_data": None,
        "ros_distro": distro,
    }


def _span(times: Sequence[int]) -> dict[str, Any]:
    return {
        "duration": {"nanoseconds": max(times) - min(times)},
        "starting_time": {"nanoseconds_since_epoch": min(times)},
        "message_count": len(times),
    }


def _topics(channels: _Channels) -> list[dict[str, Any]]:
    """Return each topic with its type once, independent of the publisher."""
    sums: Counter[tuple[str, str]] = Counter()
    for (topic, interface, _), count in channels.counts.items():
        sums[topic, interface] += count
    return [
        {
            "topic_metadata": {
                "name": topic,
                "type": interface,
                "serialization_format": "cdr",
                "offered_qos_profiles": [],
                "type_description_hash": definition(interface, channels.brought).digest,
            },
            "message_count": count,
        }
        for (topic, interface), count in sums.items()
    ]


def _yaml(value: Any) -> str:
    yaml = YAML(typ="safe")
    yaml.default_flow_style = False
    yaml.width = 1 << 16
    stream = io.StringIO()
    yaml.dump(value, stream)
    return stream.getvalue()


def _fact(value: Any) -> str:
    text = value if isinstance(value, str) else json.dumps(value, allow_nan=False)
    return text.encode("utf-8", "replace").decode()
