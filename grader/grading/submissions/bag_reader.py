"""Reads a recording that a student has handed in, as a process of its own that can do nothing else.

Usage: python -m grader.grading.submissions.bag_reader LIMITS < REQUEST > ANSWER. What it reads was made by students, so
the process gives up all privileges, files and networks first; its memory, processor time and output are limited
(LIMITS, as for `confine`).

The request is a JSON object of `scenario`, an id; `bag`, the name in messages; `files`, each a name, the descriptor of
the open file and its size; `topics`, those to read, none for all; `given`, those whose messages are deliveries;
`definitions` by type; `messages`, `message_bytes` and `traffic_bytes`, as in `Limits`; `size_bytes`, which is also the
most that compressed files may unpack to; and `duration_ns`. The answer is a JSON object of either `problem` and `hint`,
or `trace`, as `trace_to_json` writes it, and `cut`, what was not read: pairs of one of the words in `bag_words` and a
topic, which may be empty.

The parsers are those of rosbags: SQLite, MCAP, YAML, zstd, definitions of messages, and decoders that are generated
from these.
"""

from __future__ import annotations

import gc
import hashlib
import io
import json
import os
import re
import resource
import signal
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import field
from pathlib import Path, PurePosixPath
from typing import Any, BinaryIO, NoReturn

import numpy as np

from grader.grading.submissions.bag_words import (
    LARGE,
    LONGEST_NAME,
    ODD_NAME,
    SMALLER,
    TOO_LONG,
    TOO_MANY,
    TOO_MUCH,
    UNDEFINED,
)
from grader.runtime.contained import confine
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RecordingError
from grader.runtime.model.quantities import size
from grader.runtime.model.releases import DEFAULT
from grader.runtime.model.scenario import BAG_COMPRESSED, is_bag_file
from grader.runtime.model.trace import AssessedTrace, BagContents, ClockKind, Delivery, Message
from grader.runtime.recording.bag import (
    HEAD_BYTES,
    HINT_DAMAGED,
    METADATA,
    message_fields,
    one_line,
    opened_bag,
    refuse_cut,
    refuse_empty,
    refuse_ros_1,
)
from grader.runtime.recording.codec import observation_to_json, trace_to_json

#: YAML of this size takes ten seconds; rosbag2 writes some kilobytes.
_MOST_METADATA = 256 << 10
#: The most topics that are told: a robot has some hundreds at most.
_MOST_TOPICS = 500
_TOPIC = re.compile(r"(?:/[A-Za-z_][A-Za-z0-9_]*)+")
_TYPE = re.compile(r"[a-z][a-z0-9_]*/msg/[A-Za-z][A-Za-z0-9_]*")
#: A time of a message in JSON; inside of a text, quotes would have a backslash.
_STAMP = re.compile(r'"stamp": \{"sec": -?[0-9]+, "nanosec": [0-9]+\}')
#: Times of recordings are nanoseconds in 63 bits.
_MOST_NS = 2**63 - 1
#: Seconds of processor time that are left to tell that the others are used up.
_TO_TELL_S = 2


class SlowReadingError(BaseException):
    """The processor time is used up; no parser catches this."""


def main(limits: Mapping[str, Any]) -> int:
    """Read what standard input asks for, and write the answer to standard output."""
    asked = json.loads(sys.stdin.buffer.read())
    _load_parsers()
    gc.disable()  # there are few cycles
    signal.signal(signal.SIGXCPU, _too_slow)
    confine(limits)
    _, hard = resource.getrlimit(resource.RLIMIT_CPU)
    resource.setrlimit(resource.RLIMIT_CPU, (max(1, hard - _TO_TELL_S), hard))
    for part in bag_answer(asked):
        sys.stdout.buffer.write(part)
    sys.stdout.buffer.flush()
    return 0


def _load_parsers() -> None:
    """Load what a confined process could not, by reading something of each kind."""
    import apsw  # noqa: PLC0415 - only where something is read
    import rosbags.rosbag2  # noqa: F401, PLC0415
    import ruamel.yaml  # noqa: PLC0415
    import zstandard  # noqa: F401, PLC0415
    from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore  # noqa: PLC0415

    apsw.connection_hooks.append(_in_memory)
    apsw.Connection(":memory:").close()
    ruamel.yaml.YAML(typ="safe").load("a: [1]")
    get_typestore(Stores[DEFAULT.messages])
    store = get_typestore(Stores.EMPTY)
    store.register(get_types_from_idl("module a { module msg { struct B { double x; }; }; };"))
    store.register(get_types_from_msg("float64[] x\nstring text", "a/msg/C"))
    one: Any = store.types["a/msg/C"]
    store.deserialize_cdr(store.serialize_cdr(one(np.zeros(1), ""), "a/msg/C"), "a/msg/C")


def _in_memory(connection: Any) -> None:
    """Make SQLite sort in memory, because it can open no temporary file, and trust nothing in the schema."""
    connection.pragma("temp_store", 2)
    connection.pragma("trusted_schema", 0)


def _too_slow(*_: object) -> NoReturn:
    raise SlowReadingError


def bag_answer(asked: Mapping[str, Any]) -> Iterator[bytes]:
    """Yield the parts of the answer; reading any recording, however strange, raises nothing."""
    name = asked["bag"]
    try:
        yield from _read(asked)
    except RecordingError as error:
        if isinstance(error.__cause__, MemoryError):
            yield _problem(f"{one_line(name)}: reading it takes too much memory", SMALLER)
        else:
            yield _problem(error.message, error.hint)
    except MemoryError:
        yield _problem(f"{one_line(name)}: reading it takes too much memory", SMALLER)
    except SlowReadingError:
        yield _problem(f"{one_line(name)}: reading it takes too long", SMALLER)
    except Exception as error:  # whatever is read was made by others
        yield _problem(
            f"{one_line(name)}: expected a recording, found something else ({one_line(error)})", HINT_DAMAGED
        )


def _problem(problem: str, hint: str) -> bytes:
    return json.dumps({"problem": problem, "hint": hint}).encode()


class _OpenFile(io.RawIOBase):
    """An open file from its beginning, whatever others have read of it."""

    def __init__(self, descriptor: int, size_bytes: int) -> None:
        super().__init__()
        self._descriptor, self._size, self._at = descriptor, size_bytes, 0

    def readable(self) -> bool:
        return True

    def seekable(self) -> bool:
        return True

    def seek(self, offset: int, whence: int = os.SEEK_SET) -> int:
        start = {os.SEEK_SET: 0, os.SEEK_CUR: self._at, os.SEEK_END: self._size}[whence]
        if start + offset < 0:
            raise OSError("a place before the beginning of the file")
        self._at = start + offset
        return self._at

    def readinto(self, buffer: Any) -> int:
        data = os.pread(self._descriptor, len(buffer), self._at) if self._at < self._size else b""
        buffer[: len(data)] = data
        self._at += len(data)
        return len(data)


@dataclass(frozen=True, slots=True)
class _GivenFile:
    """A file of the recording: an open one, or content that was unpacked."""

    size: int
    descriptor: int = -1
    content: bytes = b""

    def open(self) -> BinaryIO:
        if self.descriptor < 0:
            return io.BytesIO(self.content)
        return io.BufferedReader(_OpenFile(self.descriptor, self.size))


class _Place:
    """A file or folder of the recording with what rosbags uses of a path; `name` is empty for the folder."""

    def __init__(self, files: Mapping[str, _GivenFile], name: str = "") -> None:
        self._files, self.name = files, name
        self.suffix, self.stem = PurePosixPath(name).suffix, PurePosixPath(name).stem

    def __truediv__(self, name: object) -> _Place:
        return _Place(self._files, str(name))

    def __str__(self) -> str:
        # It is a part of an address for SQLite, and of messages.
        return "".join(c if c.isalnum() or c in "._-" else "_" for c in self.name) or "recording"

    def exists(self) -> bool:
        return not self.name or self.name in self._files

    def is_dir(self) -> bool:
        return not self.name

    def open(self, _: str = "rb") -> BinaryIO:
        return self._files[self.name].open()

    def read_text(self) -> str:
        return self.open().read().decode()

    def stat(self) -> os.stat_result:
        return os.stat_result((0o100444, 0, 0, 1, 0, 0, self._files[self.name].size, 0, 0, 0))


def _given_files(asked: Mapping[str, Any]) -> dict[str, _GivenFile]:
    return {name: _GivenFile(size_bytes, descriptor) for name, descriptor, size_bytes in asked["files"]}


def _source(asked: Mapping[str, Any]) -> _Place:
    """Return what rosbags is to open; raises RecordingError for what is certainly no recording."""
    files = _given_files(asked)
    for name, file in files.items():
        if is_bag_file(name):
            head, path = file.open().read(HEAD_BYTES), Path(name)
            refuse_ros_1(path, head)
            refuse_empty(path, head)
            refuse_cut(path, head, file.size)
    if METADATA in files:
        return _Place(_unpacked(asked, files))
    (name,) = files
    if name.casefold().endswith(BAG_COMPRESSED):
        text = f"{one_line(name)}: expected the folder of a compressed recording, found the file alone"
        raise RecordingError(text, f"hand in its folder, with {METADATA}")
    plain = name.casefold()  # rosbags knows the endings in lower case
    return _Place({plain: files[name]}, plain)


def _unpacked(asked: Mapping[str, Any], files: dict[str, _GivenFile]) -> dict[str, _GivenFile]:
    """Return the files of a folder; compressed ones are unpacked in memory, and the metadata says that they are plain.

    rosbags would unpack them into files, which this process cannot make.
    """
    from ruamel.yaml import YAML  # noqa: PLC0415 - loaded already
    from ruamel.yaml.error import YAMLError  # noqa: PLC0415

    where = f"{one_line(asked['bag'])}/{METADATA}"
    if files[METADATA].size > _MOST_METADATA:
        raise RecordingError(f"{where}: expected at most {size(_MOST_METADATA)}, found more", HINT_DAMAGED)
    try:
        data = YAML(typ="safe").load(files[METADATA].open().read().decode())
        about = data["rosbag2_bagfile_information"]
        names = [PurePosixPath(name).name for name in about["relative_file_paths"]]
        compressed = str(about.get("compression_mode") or "").casefold() == "file"
    except (YAMLError, ValueError, LookupError, TypeError, AttributeError) as error:
        text = f"{where}: expected what rosbag2 writes, found something else ({one_line(error, limit=200)})"
        raise RecordingError(text, HINT_DAMAGED) from error
    if missing := [name for name in names if name not in files]:
        raise RecordingError(
            f"{where}: names {one_line(missing[0], limit=200)}, which was not handed in",
            "hand in the whole folder of the recording",
        )
    if not compressed:
        return files
    left, plain = asked["size_bytes"], {}
    for name in names:
        content = _without_compression(files[name].open(), left, name)
        left -= len(content)
        plain[PurePosixPath(name).stem] = _GivenFile(len(content), content=content)
    told = {**about, "relative_file_paths": list(plain), "compression_mode": "", "compression_format": ""}
    metadata = json.dumps({"rosbag2_bagfile_information": told}, default=str).encode()
    return {**plain, METADATA: _GivenFile(len(metadata), content=metadata)}


def _without_compression(packed: BinaryIO, most: int, name: str) -> bytes:
    """Return what a zstd file holds; raises RecordingError for more than `most` bytes."""
    import zstandard  # noqa: PLC0415 - loaded already

    content = bytearray()
    try:
        with zstandard.ZstdDecompressor().stream_reader(packed, read_across_frames=True) as stream:
            while block := stream.read(1 << 20):
                content += block
                if len(content) > most:
                    text = f"{one_line(name)}: expected at most {size(most)} when it is unpacked, found more"
                    raise RecordingError(text, SMALLER)
    except zstandard.ZstdError as error:
        text = f"{one_line(name)}: expected a file that zstd has compressed, found a damaged one ({one_line(error)})"
        raise RecordingError(text, HINT_DAMAGED) from error
    return bytes(content)


class _Types:
    """Decodes messages by the definitions in the recording, else by those of ROS 2, else by those that were brought."""

    def __init__(self, where: str, brought: Mapping[str, str]) -> None:
        from rosbags.typesys import Stores, get_typestore  # noqa: PLC0415 - loaded already

        self._where, self._brought = where, brought
        self._common = get_typestore(Stores[DEFAULT.messages])
        self._stores: dict[object, Any] = {}

    def of(self, connection: Any) -> Any:
        """Return what decodes the messages of a connection; None if its type has no definition."""
        key = (connection.msgtype, connection.msgdef)
        if key not in self._stores:
            self._stores[key] = self._store(*key)
        return self._stores[key]

    def _store(self, type_: str, definition: Any) -> Any:
        from rosbags.interfaces import MessageDefinitionFormat  # noqa: PLC0415 - loaded already
        from rosbags.typesys import Stores, get_types_from_idl, get_types_from_msg, get_typestore  # noqa: PLC0415

        if definition.format is MessageDefinitionFormat.NONE or not definition.data:
            if type_ in self._common.types:
                return self._common
            if type_ not in self._brought:
                return None
            types = get_types_from_msg(self._brought[type_], type_)
            self._common.register({name: fields for name, fields in types.items() if name not in self._common.types})
            return self._common
        store = get_typestore(Stores.EMPTY)
        try:
            idl = definition.format is MessageDefinitionFormat.IDL
            store.register(get_types_from_idl(definition.data) if idl else get_types_from_msg(definition.data, type_))
        except MemoryError:
            raise
        except Exception as error:  # a strange definition may fail anywhere in the parser
            text = f"{one_line(self._where)}: expected a definition of {one_line(type_)}, found something else"
            raise RecordingError(text, HINT_DAMAGED) from error
        return store


@dataclass(slots=True)
class _Contents:
    """The digest of what a topic holds, and its different messages."""

    digest: Any = field(default_factory=hashlib.sha256)
    different: set[bytes] = field(default_factory=set)

    def add(self, content: bytes) -> None:
        one = hashlib.sha256(content).digest()
        self.digest.update(one)
        self.different.add(one)


@dataclass(slots=True)
class _Reading:
    """What was read of a recording so far."""

    asked: Mapping[str, Any]
    # Time of the recording, and the observation as JSON in two parts, between which its time belongs
    rows: list[tuple[int, str, str]] = field(default_factory=list)
    counts: Counter[str] = field(default_factory=Counter)
    contents: dict[str, _Contents] = field(default_factory=dict)
    kept_bytes: int = 0
    cut: dict[tuple[str, str], None] = field(default_factory=dict)

    def add(self, connection: Any, t_ns: int, data: bytes, types: _Types) -> bool:
        """Keep a message; return whether more may be read."""
        topic, type_, limits = connection.topic, connection.msgtype, self.asked
        if self.counts[topic] >= limits["messages"]:
            self.cut[TOO_MANY, topic] = None
            return False
        large = len(data) > limits["message_bytes"]
        self.kept_bytes += 0 if large else len(data)
        if self.kept_bytes > limits["traffic_bytes"]:
            self.cut[TOO_MUCH, topic] = None
            return False
        self.counts[topic] += 1
        value: Mapping[str, Any] = {}
        if large:
            self.cut[LARGE, topic] = None
        elif (store := types.of(connection)) is None:
            self.cut[UNDEFINED, topic] = None
        else:
            value = _decoded(self.asked["bag"], store, connection, self.counts[topic], data)
        kind = Delivery if topic in limits["given"] else Message
        row = observation_to_json(kind(0, topic, type_, value, b"" if large else data))
        tag, _, *names, fields, cdr = row[:6]
        text = json.dumps(fields)
        self.rows.append((t_ns, f"[{json.dumps(tag)}, ", f", {json.dumps(names)[1:-1]}, {text}, {json.dumps(cdr)}]"))
        # Without what says when it was stamped: recording again may change nothing else.
        self.contents.setdefault(topic, _Contents()).add(_STAMP.sub("", text).encode() if value else data)
        return True


def _decoded(where: str, store: Any, connection: Any, number: int, data: bytes) -> Mapping[str, Any]:
    try:
        return message_fields(store.deserialize_cdr(data, connection.msgtype))
    except MemoryError:
        raise
    except Exception as error:  # a malformed message may fail anywhere in the generated decoder
        text = f"{one_line(where)}: expected {connection.msgtype} in message {number} on {connection.topic}"
        raise RecordingError(f"{text}, found other bytes ({one_line(error, limit=200)})", HINT_DAMAGED) from error


def _read(asked: Mapping[str, Any]) -> Iterator[bytes]:
    """Yield the parts of the answer with the trace; raises RecordingError."""
    reading, source = _Reading(asked), _source(asked)
    topics, stop_ns = opened_bag(Path(asked["bag"]), source, lambda reader: _read_from(reader, reading))
    reading.rows.sort(key=lambda row: row[0])
    contents = tuple((t, len(one.different), one.digest.hexdigest()) for t, one in sorted(reading.contents.items()))
    bag = BagContents(asked["bag"], topics, contents)
    trace = AssessedTrace(asked["scenario"], ClockKind.WALL, stop_ns, (), bag=bag)
    head = json.dumps({"trace": trace_to_json(trace), "cut": list(reading.cut)})
    before, after = head.split('"observations": []')
    yield f'{before}"observations": ['.encode()
    for number, (t_ns, tag, others) in enumerate(reading.rows):
        yield f"{',' if number else ''}{tag}{t_ns - reading.rows[0][0]}{others}".encode()
    yield f"]{after}".encode()


def _read_from(reader: Any, reading: _Reading) -> tuple[tuple[tuple[str, str, int], ...], int]:
    """Read from the reader of rosbags; return its topics, and when the recording ends, counted from its first message.

    Raises RecordingError for messages that are none of ROS.
    """
    asked, where = reading.asked, one_line(reading.asked["bag"])
    named = [one for one in reader.connections if _is_named(one)]
    if len(named) < len(reader.connections):
        reading.cut[ODD_NAME, ""] = None
    for one in named:
        if one.ext.serialization_format != "cdr":
            found = one_line(one.ext.serialization_format, limit=40)
            text = f"{where}: expected messages in CDR, as rosbag2 writes them, found {found} on {one.topic}"
            raise RecordingError(text, "record it with `ros2 bag record`")
    counts: Counter[tuple[str, str]] = Counter()
    for one in named:
        counts[one.topic, one.msgtype] += max(0, int(one.msgcount))
    topics = tuple((topic, type_, count) for (topic, type_), count in sorted(counts.items())[:_MOST_TOPICS])
    wanted = [one for one in named if not asked["topics"] or one.topic in asked["topics"]]
    first_ns, types = -1, _Types(asked["bag"], asked["definitions"])
    for connection, t_ns, data in reader.messages(wanted) if wanted else ():
        if type(t_ns) is not int or not 0 <= t_ns <= _MOST_NS or not isinstance(data, (bytes, memoryview)):
            raise RecordingError(f"{where}: expected a message with its time, found something else", HINT_DAMAGED)
        first_ns = t_ns if first_ns < 0 else min(t_ns, first_ns)  # parts of a recording may overlap
        if t_ns - first_ns > asked["duration_ns"]:
            reading.cut[TOO_LONG, ""] = None
            break
        if not reading.add(connection, t_ns, bytes(data), types):
            break
    if not reading.rows:
        return topics, 1
    last_ns = max(t_ns for t_ns, _, _ in reading.rows) - first_ns
    ended = any(kind in (TOO_MANY, TOO_MUCH) for kind, _ in reading.cut)
    end_ns = 0 if ended or type(reader.end_time) is not int else reader.end_time - first_ns
    return topics, max(last_ns + 1, min(end_ns, asked["duration_ns"]))


def _is_named(connection: Any) -> bool:
    """Return whether topic and type are names that ROS allows."""
    topic, type_ = connection.topic, connection.msgtype
    return (
        isinstance(topic, str)
        and isinstance(type_, str)
        and max(len(topic), len(type_)) <= LONGEST_NAME
        and _TOPIC.fullmatch(topic) is not None
        and _TYPE.fullmatch(type_) is not None
    )


if __name__ == "__main__":
    os._exit(main(json.loads(sys.argv[1])))
