"""Writes one scenario's recording as an MCAP file for rosbag2, and reads the trace for judging from it."""

from __future__ import annotations

import io
import json
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Any

import zstandard
from mcap.reader import make_reader
from mcap.writer import CompressionType, Writer
from ruamel.yaml import YAML

from grader.core.errors import EvidenceError
from grader.core.trace import Trace
from grader.execution.evidence.packed import pack, unpack, unpack_exactly
from grader.execution.evidence.shown import RUN, Shown, definition, said, shown

#: The attachment with everything that judging reads.
TRACE = "trace.json.zst"
#: Name of the metadata record about the run.
FACTS = "grader"
#: Version of rosbag2's metadata format in Jazzy.
ROSBAG2_VERSION = 9
#: The grader never writes a longer trace.
MOST_BYTES = 256 << 20
_LIBRARY = "rclpy-grader evidence v1"
_Key = tuple[str, str, str]


@dataclass(slots=True)
class _Channels:
    """Registers topics and types with a writer as they appear, and counts messages."""

    writer: Writer
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
        known = definition(interface)
        if interface not in self.schemas:
            self.schemas[interface] = self.writer.register_schema(interface, "ros2msg", known.text.encode())
        metadata = {"offered_qos_profiles": "", "topic_type_hash": known.digest, "publisher": publisher}
        return self.writer.register_channel(topic, "cdr", self.schemas[interface], metadata)


def recording_bytes(trace: Trace, facts: Mapping[str, str], name: str) -> tuple[bytes, bytes]:
    """Convert a trace to an MCAP file, and the `metadata.yaml` that makes its folder a rosbag2 recording.

    The same trace gives the same bytes. The facts are digests, seed and environment of the run; the name of the file is
    part of rosbag2's metadata.
    """
    about = _about(trace, facts)
    messages = [said(0, RUN, about), *shown(trace.observations)]
    packed = pack(trace, [message.exact for message in messages[1:]])
    stream = io.BytesIO()
    writer = Writer(stream, compression=CompressionType.ZSTD)
    writer.start(profile="ros2", library=_LIBRARY)
    channels = _Channels(writer)
    for message in messages:
        channels.add(message)
    writer.add_attachment(0, 0, TRACE, "application/zstd", zstandard.compress(packed))
    writer.add_metadata(FACTS, {key: _fact(value) for key, value in about.items()})
    information = _information(messages, channels, name, json.loads(facts["environment"])["ros_distro"])
    writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(information)})
    writer.finish()  # type: ignore[no-untyped-call]
    return stream.getvalue(), _yaml({"rosbag2_bagfile_information": information}).encode()


def place_of_trace(recording: bytes) -> tuple[int, int]:
    """Return offset and size of the packed trace in a recording; raises EvidenceError if there is none."""
    with _reading():
        summary = make_reader(io.BytesIO(recording)).get_summary()
        index = next((i for i in (summary.attachment_indexes if summary else ()) if i.name == TRACE), None)
    if index is None:
        raise EvidenceError(f"expected a recording that holds {TRACE}, found none in it")
    # the attachment ends with its data and a checksum of four bytes
    return index.offset + index.length - 4 - index.data_size, index.data_size


def trace_at(recording: bytes, at: int, size: int) -> Trace:
    """Read the trace at an offset of a recording, without the bytes of messages, which judging does not read."""
    with _reading():
        data = _unpressed(recording[at : at + size])
    return unpack(data)


def trace_of(recording: bytes, *, wire: bool = False) -> Trace:
    """Read the trace of a recording; with `wire` it includes the bytes of messages, which takes longer."""
    data = packed_trace(recording)
    if not wire:
        return unpack(data)
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
    if not 0 <= size <= MOST_BYTES:
        raise EvidenceError(f"expected a trace of at most {MOST_BYTES >> 20} MiB, found {size} bytes")
    return _decompressor().decompress(packed)


@lru_cache(maxsize=1)
def _decompressor() -> zstandard.ZstdDecompressor:
    """Return a shared instance, because creating one takes longer than using it."""
    return zstandard.ZstdDecompressor()


def _about(trace: Trace, facts: Mapping[str, str]) -> dict[str, Any]:
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
        "topics_with_message_count": _topics(channels.counts),
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


def _topics(counts: Mapping[_Key, int]) -> list[dict[str, Any]]:
    """Return each topic with its type once, independent of the publisher."""
    sums: Counter[tuple[str, str]] = Counter()
    for (topic, interface, _), count in counts.items():
        sums[topic, interface] += count
    return [
        {
            "topic_metadata": {
                "name": topic,
                "type": interface,
                "serialization_format": "cdr",
                "offered_qos_profiles": [],
                "type_description_hash": definition(interface).digest,
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
