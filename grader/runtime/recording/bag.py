"""Reads rosbag2 recordings: the messages of one topic, and what every reader of a recording needs."""

from __future__ import annotations

import math
import os
import stat
import tempfile
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import MISSING, fields
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RecordingError
from grader.runtime.model.quantities import seconds
from grader.runtime.model.releases import DEFAULT
from grader.runtime.model.scenario import BAG_COMPRESSED, BAG_ENDINGS
from grader.runtime.stimuli.recorded import Recording, TimedMessage

if TYPE_CHECKING:
    from rosbags.typesys.store import Typestore

#: The most elements of an array that are kept for judging: more than a laser scan has, fewer than an image.
MOST_ELEMENTS = 10_000
#: A field that is not kept for judging: such matrices hold several times as many numbers as the rest of a message. No
#: check asks for them, and all would pass through each plan and each trace.
_NOT_KEPT = "covariance"

#: What makes a folder with recorded files one recording.
METADATA = "metadata.yaml"
_CDR_LITTLE_ENDIAN = b"\x00\x01"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ROS_1_MAGIC = b"#ROSBAG V"
_SQLITE_MAGIC = b"SQLite format 3\x00"
#: How many bytes at the beginning of a file tell what it is: the magic of SQLite, then its page size in two bytes,
#: where 1 means 65536.
HEAD_BYTES = 18
#: Characters with a meaning in an SQLite URI. rosbags puts the path into one without escaping it.
_ADDRESS_CHARACTERS = frozenset("?#%")

_HINT_SOURCE = "name a rosbag2 folder, or a .mcap or .db3 file, as `ros2 bag record` writes it"
HINT_ROS_1 = "convert it with `rosbags-convert --src FILE.bag --dst FOLDER`"
HINT_DAMAGED = "copy or record it again; a recorder that was killed leaves a file that `ros2 bag reindex` may fix"

_Raw = tuple[int, bytes]
_T = TypeVar("_T")
#: Returns the definition of a message type as in .msg files, those of nested types included; None if unknown.
Define = Callable[[str], "str | None"]


@dataclass(frozen=True, slots=True)
class BagMinimum:
    """The fewest messages and the shortest time that a recording has to have."""

    messages: int = 1
    span_ns: int = 0


def read_bag(
    path: Path, topic: str, type_: str, *, least: BagMinimum | None = None, define: Define | None = None
) -> Recording:
    """Read the messages of a topic, without writing any file next to the recording.

    Args:
        path: A rosbag2 folder, a folder with one storage file and no metadata, or a single .mcap or .db3 file.
        topic: The topic to read, if it has messages of the type; otherwise the one that has most of them is read.
        type_: Type of the messages.
        least: How long the recording has to be; by default one message suffices.
        define: Looks up types that do not come with ROS 2.

    Raises:
        RecordingError: The recording is missing, unreadable, damaged or too short, or has no messages of the type.
    """
    least = least or BagMinimum()
    source = _source(path)
    with _plainly_named(source) as plain:
        found, raw = _read(path, plain, topic, type_)
    if len(raw) < least.messages:
        raise _too_short(path, found, f"at least {_count(least.messages)}, found {len(raw) or 'none'}")
    raw.sort(key=lambda item: item[0])
    span_ns = raw[-1][0] - raw[0][0]
    if span_ns < least.span_ns:
        raise _too_short(path, found, f"at least {seconds(least.span_ns):g} s, found {seconds(span_ns):.2f} s")
    return Recording(found, type_, tuple(_decoded(path, found, type_, raw, define)), began_ns=raw[0][0])


def topics_in(path: Path) -> Mapping[str, str]:
    """Return the topics of a recording with their types; raises RecordingError if it cannot be read."""
    source = _source(path)
    with _plainly_named(source) as plain:
        return {topic: type_ for topic, type_, _ in opened_bag(path, plain, _topics)}


def _source(path: Path) -> Path:
    """Find the folder or file that rosbags should open for the path that was given."""
    try:
        return _source_in(path) if stat.S_ISDIR(path.stat().st_mode) else _source_file(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise RecordingError(
            f"{one_line(path)}: expected a recording, found no such file or folder", _HINT_SOURCE
        ) from error
    except PermissionError as error:
        denied = Path(error.filename or path)
        raise RecordingError(
            f"{one_line(path)}: expected a recording that may be read, found no permission for {one_line(denied.name)}",
            "let the user who grades read the folder and its files",
        ) from error
    except (OSError, ValueError) as error:
        raise RecordingError(f"{one_line(path)}: cannot be opened ({one_line(error)})", _HINT_SOURCE) from error


def _source_in(folder: Path) -> Path:
    entries = sorted(folder.iterdir())
    storages = [e for e in entries if e.suffix in (*BAG_ENDINGS, BAG_COMPRESSED)]
    for storage in storages:
        _probe(storage)
    if (folder / METADATA).exists():
        _probe(folder / METADATA)
        return folder
    bare = [s for s in storages if s.suffix in BAG_ENDINGS]
    if len(bare) == 1:
        return _source_file(bare[0])
    if bare:
        names = ", ".join(one_line(b.name) for b in bare)
        raise RecordingError(
            f"{one_line(folder)}: expected metadata.yaml or a single recording, found {names}",
            "name one of these files",
        )
    if any(e.suffix == ".bag" for e in entries):
        raise _ros_1(folder)
    found = "compressed files without their metadata.yaml" if storages else "no .mcap or .db3 file"
    raise RecordingError(f"{one_line(folder)}: expected a rosbag2 recording, found {found}", _HINT_SOURCE)


def _source_file(path: Path) -> Path:
    if not path.is_file():
        raise RecordingError(f"{one_line(path)}: expected a recording, found neither a file nor a folder", _HINT_SOURCE)
    head = _probe(path)
    refuse_ros_1(path, head)
    if path.name == METADATA:
        return _source_in(path.parent)
    if path.suffix not in BAG_ENDINGS:
        found = f"the ending {one_line(path.suffix)}" if path.suffix else "no ending"
        raise RecordingError(f"{one_line(path)}: expected a .mcap or .db3 file, found {found}", _HINT_SOURCE)
    refuse_empty(path, head)
    return path


def refuse_ros_1(path: Path, head: bytes) -> None:
    """Raise RecordingError for a recording of ROS 1, by its name and its first bytes."""
    if path.suffix == ".bag" or head.startswith(_ROS_1_MAGIC):
        raise _ros_1(path)


def refuse_empty(path: Path, head: bytes) -> None:
    """Raise RecordingError for an empty file, by its first bytes."""
    if not head:
        raise RecordingError(f"{one_line(path)}: expected a recording, found an empty file", HINT_DAMAGED)


def _probe(path: Path) -> bytes:
    """Return the first bytes of a file after checking that it is readable and, for SQLite, not truncated.

    Raises:
        OSError: The file cannot be read.
        RecordingError: The last page of an SQLite file is cut off; SQLite itself would read zeros there.
    """
    with path.open("rb") as file:
        head = file.read(HEAD_BYTES)
        size = file.seek(0, os.SEEK_END)
    refuse_cut(path, head, size)
    return head


def refuse_cut(path: Path, head: bytes, size: int) -> None:
    """Raise RecordingError for an SQLite file whose last page is cut off, by its first bytes and its size."""
    page_size = int.from_bytes(head[16:18], "big") if head.startswith(_SQLITE_MAGIC) else 0
    if size % max(1, page_size):
        raise RecordingError(
            f"{one_line(path)}: expected a complete rosbag2 recording, found a damaged one (cut after {size} bytes)",
            HINT_DAMAGED,
        )


@contextmanager
def _plainly_named(source: Path) -> Iterator[Path]:
    """Yield the source, or a symlink to it if SQLite would take its path for a URI with parameters."""
    if not _ADDRESS_CHARACTERS & set(str(source)):
        yield source
        return
    with tempfile.TemporaryDirectory(prefix="grade-bag-") as folder:
        link = Path(folder) / f"recording{source.suffix if source.is_file() else ''}"
        link.symlink_to(source.resolve())
        yield link


def opened_bag(path: Path, source: Any, read: Callable[[Any], _T]) -> _T:
    """Return what a function reads with the reader of rosbags; raises RecordingError if it fails.

    Args:
        path: The recording, as messages name it.
        source: What rosbags opens: a path, or what it uses like one.
        read: Reads; a RecordingError of its own is passed on.
    """
    from rosbags.rosbag2 import Reader  # takes 60 ms, which runs without a recording save  # noqa: PLC0415

    try:
        with Reader(source) as reader:
            return read(reader)
    except RecordingError:
        raise
    except Exception as error:  # damaged bytes make the parsers of rosbags raise nearly anything
        problem = one_line(error, source=source)
        raise RecordingError(
            f"{one_line(path)}: expected a complete rosbag2 recording, found a damaged one ({problem})", HINT_DAMAGED
        ) from error


def _topics(reader: Any) -> list[tuple[str, str, int]]:
    return [(c.topic, c.msgtype, c.msgcount) for c in reader.connections]


def _read(path: Path, source: Path, topic: str, type_: str) -> tuple[str, list[_Raw]]:
    """Return the topic to play from a source, and its messages as (receive time, bytes)."""

    def read(reader: Any) -> tuple[list[tuple[str, str, int]], str | None, list[_Raw]]:
        topics = _topics(reader)
        chosen = _chosen(topics, topic, type_)
        connections = [c for c in reader.connections if c.topic == chosen and c.msgtype == type_]
        raw = [(t_ns, bytes(data)) for _, t_ns, data in reader.messages(connections)] if connections else []
        return topics, chosen, raw

    topics, chosen, raw = opened_bag(path, source, read)
    if chosen is None:
        types = (
            ", ".join(sorted({f"{one_line(kind)} on {one_line(name)}" for name, kind, _ in topics}))
            or "no topics at all"
        )
        raise RecordingError(
            f"{one_line(path)}: expected a topic of type {type_}, found {types}",
            f"record it with `ros2 bag record {topic}`",
        )
    return chosen, raw


def _chosen(topics: Iterable[tuple[str, str, int]], wanted: str, type_: str) -> str | None:
    """Choose the topic to read: the wanted one if it has messages, else the one with most, else the first by name."""
    counts: dict[str, int] = {}
    for topic, msgtype, count in topics:
        if msgtype == type_:
            counts[topic] = counts.get(topic, 0) + count
    if counts.get(wanted):
        return wanted
    return min(counts, key=lambda topic: (-counts[topic], topic), default=None)


def _decoded(path: Path, topic: str, type_: str, raw: Sequence[_Raw], define: Define | None) -> Iterator[TimedMessage]:
    """Yield the messages, with times counted from the first one; equal times are moved 1 ns apart."""
    store = _types(path, type_, define)
    start_ns, last_ns = raw[0][0], -1
    for number, (received_ns, data) in enumerate(raw, start=1):
        where = f"message {number} of {len(raw)} on {one_line(topic)}"
        if data.startswith(_ZSTD_MAGIC):
            raise RecordingError(
                f"{one_line(path)}: expected plain messages, found compressed ones",
                "name the folder that holds its metadata.yaml",
            )
        try:
            message = store.deserialize_cdr(data, type_)
            cdr = data if data.startswith(_CDR_LITTLE_ENDIAN) else bytes(store.serialize_cdr(message, type_))
            value = message_fields(message)
        except Exception as error:  # as above: a malformed message may fail anywhere in the generated decoder
            raise RecordingError(
                f"{one_line(path)}: expected {type_} in {where}, found other bytes ({one_line(error)})", HINT_DAMAGED
            ) from error
        if not _has_finite_positions(value):
            raise RecordingError(
                f"{one_line(path)}: expected a position in {where}, found a number that is not finite",
                "play a recording in which every position is known",
            )
        last_ns = max(received_ns - start_ns, last_ns + 1)
        yield TimedMessage(last_ns, cdr, value)


def _types(path: Path, type_: str, define: Define | None) -> Typestore:
    """Return the types of the default release, and this one if it is another."""
    from rosbags.typesys import Stores, get_types_from_msg, get_typestore  # as heavy as the reader  # noqa: PLC0415

    store = get_typestore(Stores[DEFAULT.messages])
    if type_ not in store.types:
        definition = define(type_) if define is not None else None
        if definition is None:
            raise RecordingError(
                f"{one_line(path)}: expected messages of a known type, found {type_}, whose definition is missing",
                "bring it with `interfaces:` in the rubric or --interfaces FOLDER",
            )
        found = get_types_from_msg(definition, type_)
        store.register({name: fields for name, fields in found.items() if name not in store.types})
    return store


def message_fields(message: Any) -> Mapping[str, Any]:
    """Return the fields of a message as plain values, named as in its definition, without what nobody judges."""
    kind: type = type(message)
    plain = {name: _plain(getattr(message, name)) for name in _kept_fields(kind)}
    return {name: value for name, value in plain.items() if not isinstance(value, list) or len(value) <= MOST_ELEMENTS}


@lru_cache(maxsize=512)
def _kept_fields(kind: type) -> tuple[str, ...]:
    """Return the names of the fields that are kept of messages of a type: what has a default is a constant of it."""
    return tuple(one.name for one in fields(kind) if one.default is MISSING and one.name != _NOT_KEPT)


def _plain(value: Any) -> Any:
    if hasattr(value, "__dataclass_fields__"):
        return message_fields(value)
    if hasattr(value, "tolist"):
        return value.tolist()
    return [_plain(item) for item in value] if isinstance(value, (list, tuple)) else value


def _has_finite_positions(value: Mapping[str, Any]) -> bool:
    """Return whether every field `position` that is a point has finite coordinates; a distance may well be infinite."""
    for name, inner in value.items():
        if isinstance(inner, Mapping):
            numbers = [number for number in inner.values() if isinstance(number, float)]
            if (name == "position" and not all(map(math.isfinite, numbers))) or not _has_finite_positions(inner):
                return False
    return True


def _ros_1(path: Path) -> RecordingError:
    return RecordingError(f"{one_line(path)}: expected a rosbag2 recording, found a ROS 1 bag", HINT_ROS_1)


def _count(messages: int) -> str:
    return "1 message" if messages == 1 else f"{messages} messages"


def _too_short(path: Path, topic: str, what: str) -> RecordingError:
    return RecordingError(
        f"{one_line(path)}: expected a recording of {one_line(topic)} with {what}", "record it for longer"
    )


def one_line(text: object, *, source: Any = None, limit: int = 5000) -> str:
    """Turn foreign text into one printable line, without the path of a temporary source."""
    plain = str(text)
    if source is not None:
        plain = plain.replace(str(source), source.name)
    shown = "".join(c if c.isprintable() else " " for c in plain)
    line = " ".join(shown.split()) or type(text).__name__
    return line if len(line) <= limit else line[: limit - 1] + "…"
