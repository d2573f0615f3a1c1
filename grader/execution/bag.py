"""Reads wheel odometry from a rosbag2 recording, the built-in one or an instructor's."""

from __future__ import annotations

import hashlib
import math
import os
import stat
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from operator import attrgetter
from pathlib import Path
from typing import Any

from grader.core.dataclass import dataclass
from grader.core.errors import RecordingError
from grader.core.quantities import NS_PER_S, seconds
from grader.core.releases import DEFAULT
from grader.core.scenario import TimedMessage

TYPE = "nav_msgs/msg/Odometry"
USUAL_TOPIC = "/odom"
LEAST_MESSAGES = 20
LEAST_DURATION_NS = 5 * NS_PER_S

_STORAGE = (".mcap", ".db3")
_CDR_LITTLE_ENDIAN = b"\x00\x01"
_ZSTD_MAGIC = b"\x28\xb5\x2f\xfd"
_ROS_1_MAGIC = b"#ROSBAG V"
_SQLITE_MAGIC = b"SQLite format 3\x00"
_SQLITE_HEAD = 18  # the magic, then the page size in two bytes, where 1 means 65536
#: Characters with a meaning in an SQLite URI. rosbags puts the path into one without escaping it.
_ADDRESS_CHARACTERS = frozenset("?#%")

_HINT_SOURCE = "name a rosbag2 folder, or a .mcap or .db3 file, as `ros2 bag record /odom` writes it"
_HINT_DAMAGED = "copy or record it again; a recorder that was killed leaves a file that `ros2 bag reindex` may fix"

_Raw = tuple[int, bytes]


@dataclass(frozen=True, slots=True)
class Odometry:
    """A recording of odometry.

    Attributes:
        topic: Absolute name of the recorded topic.
        messages: In order of receive time, which starts at 0 and strictly increases.
    """

    topic: str
    messages: tuple[TimedMessage, ...]


def read_odometry(path: Path) -> Odometry:
    """Read the odometry in a recording, without writing any file next to it.

    Args:
        path: A rosbag2 folder, a folder with one storage file and no metadata, or a single .mcap or .db3 file.

    Raises:
        RecordingError: The recording is missing, unreadable or damaged, or has too little odometry to play.
    """
    source = _source(path)
    with _plainly_named(source) as plain:
        topic, raw = _read(path, plain)
    if len(raw) < LEAST_MESSAGES:
        raise _unfit(path, topic, f"at least {LEAST_MESSAGES} messages, found {len(raw)}")
    raw.sort(key=lambda item: item[0])
    span_ns = raw[-1][0] - raw[0][0]
    if span_ns < LEAST_DURATION_NS:
        raise _unfit(path, topic, f"at least {seconds(LEAST_DURATION_NS):g} s, found {seconds(span_ns):.2f} s")
    return Odometry(topic, tuple(_decoded(path, topic, raw)))


def window(odometry: Odometry, *, duration_ns: int, seed: int) -> tuple[TimedMessage, ...]:
    """Cut a window out of a recording, with times counted from its first message.

    Args:
        odometry: The recording.
        duration_ns: Minimum time from first to last message of the window; a shorter recording is returned whole.
        seed: Determines where the window starts.
    """
    messages = odometry.messages
    latest_ns = messages[-1].t_ns - duration_ns
    starts = max(1, sum(m.t_ns <= latest_ns for m in messages))
    drawn = hashlib.sha256(f"odometry window {seed}".encode()).digest()
    first = int.from_bytes(drawn[:8], "big") % starts
    start_ns = messages[first].t_ns
    stop = next((i for i, m in enumerate(messages) if m.t_ns >= start_ns + duration_ns), len(messages) - 1)
    return tuple(TimedMessage(m.t_ns - start_ns, m.cdr, m.value) for m in messages[first : stop + 1])


def _source(path: Path) -> Path:
    """Find the folder or file that rosbags should open for the path that was given."""
    try:
        return _source_in(path) if stat.S_ISDIR(path.stat().st_mode) else _source_file(path)
    except (FileNotFoundError, NotADirectoryError) as error:
        raise RecordingError(
            f"{_line(path)}: expected a recording, found no such file or folder", _HINT_SOURCE
        ) from error
    except PermissionError as error:
        denied = Path(error.filename or path)
        raise RecordingError(
            f"{_line(path)}: expected a recording that may be read, found no permission for {_line(denied.name)}",
            "let the user who grades read the folder and its files",
        ) from error
    except (OSError, ValueError) as error:
        raise RecordingError(f"{_line(path)}: cannot be opened ({_line(error)})", _HINT_SOURCE) from error


def _source_in(folder: Path) -> Path:
    entries = sorted(folder.iterdir())
    storages = [e for e in entries if e.suffix in _STORAGE or e.suffixes[-1:] == [".zstd"]]
    for storage in storages:
        _probe(storage)
    if (folder / "metadata.yaml").exists():
        _probe(folder / "metadata.yaml")
        return folder
    bare = [s for s in storages if s.suffix in _STORAGE]
    if len(bare) == 1:
        return _source_file(bare[0])
    if bare:
        names = ", ".join(_line(b.name) for b in bare)
        raise RecordingError(
            f"{_line(folder)}: expected metadata.yaml or a single recording, found {names}", "name one of these files"
        )
    if any(e.suffix == ".bag" for e in entries):
        raise _ros_1(folder)
    found = "compressed files without their metadata.yaml" if storages else "no .mcap or .db3 file"
    raise RecordingError(f"{_line(folder)}: expected a rosbag2 recording, found {found}", _HINT_SOURCE)


def _source_file(path: Path) -> Path:
    if not path.is_file():
        raise RecordingError(f"{_line(path)}: expected a recording, found neither a file nor a folder", _HINT_SOURCE)
    head = _probe(path)
    if path.suffix == ".bag" or head.startswith(_ROS_1_MAGIC):
        raise _ros_1(path)
    if path.name == "metadata.yaml":
        return _source_in(path.parent)
    if path.suffix not in _STORAGE:
        found = f"the ending {_line(path.suffix)}" if path.suffix else "no ending"
        raise RecordingError(f"{_line(path)}: expected a .mcap or .db3 file, found {found}", _HINT_SOURCE)
    if not head:
        raise RecordingError(f"{_line(path)}: expected a recording, found an empty file", _HINT_DAMAGED)
    return path


def _probe(path: Path) -> bytes:
    """Return the first bytes of a file after checking that it is readable and, for SQLite, not truncated.

    Raises:
        OSError: The file cannot be read.
        RecordingError: The last page of an SQLite file is cut off; SQLite itself would read zeros there.
    """
    with path.open("rb") as file:
        head = file.read(_SQLITE_HEAD)
        size = file.seek(0, os.SEEK_END)
    page_size = int.from_bytes(head[16:18], "big") if head.startswith(_SQLITE_MAGIC) else 0
    if size % max(1, page_size):
        raise RecordingError(
            f"{_line(path)}: expected a complete rosbag2 recording, found a damaged one (cut after {size} bytes)",
            _HINT_DAMAGED,
        )
    return head


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


def _read(path: Path, source: Path) -> tuple[str, list[_Raw]]:
    """Return the odometry topic of a source, and its messages as (receive time, bytes)."""
    from rosbags.rosbag2 import Reader  # takes 60 ms, which runs without odometry save  # noqa: PLC0415

    try:
        with Reader(source) as reader:
            topics = [(c.topic, c.msgtype, c.msgcount) for c in reader.connections]
            topic = _odometry_topic(topics)
            chosen = [c for c in reader.connections if c.topic == topic and c.msgtype == TYPE]
            raw = [(t_ns, bytes(data)) for _, t_ns, data in reader.messages(chosen)] if chosen else []
    except Exception as error:  # damaged bytes make the parsers of rosbags raise nearly anything
        problem = _line(error, source=source)
        raise RecordingError(
            f"{_line(path)}: expected a complete rosbag2 recording, found a damaged one ({problem})", _HINT_DAMAGED
        ) from error
    if topic is None:
        types = ", ".join(sorted({_line(msgtype) for _, msgtype, _ in topics})) or "no topics at all"
        raise RecordingError(
            f"{_line(path)}: expected a topic of type {TYPE}, found {types}", "record it with `ros2 bag record /odom`"
        )
    return topic, raw


def _odometry_topic(topics: Iterable[tuple[str, str, int]]) -> str | None:
    """Choose the topic to play: /odom if it has messages, else the one with most messages, else the first by name."""
    counts: dict[str, int] = {}
    for topic, msgtype, count in topics:
        if msgtype == TYPE:
            counts[topic] = counts.get(topic, 0) + count
    if counts.get(USUAL_TOPIC):
        return USUAL_TOPIC
    return min(counts, key=lambda topic: (-counts[topic], topic), default=None)


def _decoded(path: Path, topic: str, raw: Sequence[_Raw]) -> Iterator[TimedMessage]:
    """Yield the messages, with times counted from the first one; equal times are moved 1 ns apart."""
    from rosbags.typesys import Stores, get_typestore  # as heavy as the reader  # noqa: PLC0415

    store = get_typestore(Stores[DEFAULT.messages])
    start_ns, last_ns = raw[0][0], -1
    for number, (received_ns, data) in enumerate(raw, start=1):
        where = f"message {number} of {len(raw)} on {_line(topic)}"
        if data.startswith(_ZSTD_MAGIC):
            raise RecordingError(
                f"{_line(path)}: expected plain messages, found compressed ones",
                "name the folder that holds its metadata.yaml",
            )
        try:
            message = store.deserialize_cdr(data, TYPE)
            cdr = data if data.startswith(_CDR_LITTLE_ENDIAN) else bytes(store.serialize_cdr(message, TYPE))
        except Exception as error:  # as above: a malformed message may fail anywhere in the generated decoder
            raise RecordingError(
                f"{_line(path)}: expected {TYPE} in {where}, found other bytes ({_line(error)})", _HINT_DAMAGED
            ) from error
        value = _fields(message)
        if not all(map(math.isfinite, value["pose"]["pose"]["position"].values())):
            raise RecordingError(
                f"{_line(path)}: expected a position in {where}, found a number that is not finite",
                "play a recording whose robot knew where it was",
            )
        last_ns = max(received_ns - start_ns, last_ns + 1)
        yield TimedMessage(last_ns, cdr, value)


def _fields(message: object) -> dict[str, Any]:
    """Return the fields of an odometry message that checks read, named as in the message definition."""
    position = _numbers(message, "pose.pose.position", "xyz")
    orientation = _numbers(message, "pose.pose.orientation", "xyzw")
    linear = _numbers(message, "twist.twist.linear", "xyz")
    angular = _numbers(message, "twist.twist.angular", "xyz")
    return {
        "pose": {"pose": {"position": position, "orientation": orientation}},
        "twist": {"twist": {"linear": linear, "angular": angular}},
    }


def _numbers(message: object, part: str, names: str) -> Mapping[str, float]:
    holder = attrgetter(part)(message)
    return {name: float(getattr(holder, name)) for name in names}


def _ros_1(path: Path) -> RecordingError:
    return RecordingError(
        f"{_line(path)}: expected a rosbag2 recording, found a ROS 1 bag",
        "convert it with `rosbags-convert --src FILE.bag --dst FOLDER`",
    )


def _unfit(path: Path, topic: str, what: str) -> RecordingError:
    return RecordingError(
        f"{_line(path)}: expected odometry on {_line(topic)} of {what}", "record a longer drive, 15 s or more"
    )


def _line(text: object, *, source: Path | None = None, limit: int = 5000) -> str:
    """Turn foreign text into one printable line, without the path of a temporary source."""
    plain = str(text)
    if source is not None:
        plain = plain.replace(str(source), source.name)
    shown = "".join(c if c.isprintable() else " " for c in plain)
    line = " ".join(shown.split()) or type(text).__name__
    return line if len(line) <= limit else line[: limit - 1] + "…"
