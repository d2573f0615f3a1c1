"""Compares what programs published with a recording that a test keeps, and says where they first differ."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

from grader.grading.model.wording import moment, nearest, quote
from grader.runtime.model.quantities import is_number
from grader.world.errors import RecordingDiffers

#: What a difference shows of a value, in characters.
MOST_SHOWN = 80


class KeptMessage(NamedTuple):
    """A message in a kept recording."""

    t_ns: int  # since the test began
    topic: str
    type: str
    message: Any  # its fields as plain values


def kept_lines(messages: Sequence[KeptMessage]) -> str:
    """Return a recording as text, a line for each message, which version control compares line by line."""
    return "".join(json.dumps(one._asdict(), allow_nan=True) + "\n" for one in messages)


def read_kept(path: Path) -> list[KeptMessage]:
    """Read a recording; raises ValueError with file and line if it is not one."""
    found: list[KeptMessage] = []
    for number, line in enumerate(path.read_text(encoding="utf-8", errors="replace").splitlines(), 1):
        one = _kept_message(line)
        if one is None:
            shown = quote(line, 40) or "an empty line"
            text = f"{path}:{number}: expected a message of a kept recording, found {shown}"
            raise ValueError(f"{text}; pytest --ros-update writes the file anew")
        found.append(one)
    return found


def _kept_message(line: str) -> KeptMessage | None:
    """Return the message in a line; None if it holds none."""
    try:
        fields = json.loads(line)
    except ValueError:
        return None
    kinds = {"t_ns": int, "topic": str, "type": str, "message": dict}
    if not isinstance(fields, dict) or {name: type(value) for name, value in fields.items()} != kinds:
        return None
    return KeptMessage(**fields)


def write_kept(path: Path, messages: Sequence[KeptMessage]) -> None:
    """Write a recording, into a folder that is created if it is not there."""
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text(kept_lines(messages), encoding="utf-8")


def compare_with_kept(
    path: Path,
    now: Sequence[KeptMessage],
    topics: Sequence[str],
    tolerance: float | Mapping[str, float],
    late_ns: int | None,
) -> None:
    """Compare messages with a recording.

    Raises:
        RecordingDiffers: They differ, or there is no such recording.
        ValueError: The file is not a recording, or a tolerance is invalid.

    Args:
        path: The recording.
        now: The messages.
        topics: The topics that count; none for all.
        tolerance: What numbers may differ by; for all topics or by topic.
        late_ns: What times may differ by; None for anything.
    """
    __tracebackhide__ = True
    if not path.is_file():
        raise RecordingDiffers(f"{path}: expected a recording, found none; pytest --ros-update writes it")
    kept = [one for one in read_kept(path) if not topics or one.topic in topics]
    known = sorted({*topics, *(one.topic for one in (*kept, *now))})
    by_topic = tolerance if isinstance(tolerance, Mapping) else dict.fromkeys(known, tolerance)
    for name, allowed in by_topic.items():
        if name not in known:
            close = nearest(name, known)
            meant = f"; did you mean {close}?" if close else ""
            raise ValueError(f"tolerance: expected a topic of the recording, found {name}{meant}")
        refuse_no_tolerance("tolerance", allowed)
    if differs := difference_from_kept(kept, now, by_topic, late_ns):
        raise RecordingDiffers(f"{differs}; recorded in {path}, which pytest --ros-update renews")


def refuse_no_tolerance(what: str, value: Any) -> None:
    """Raise ValueError for what numbers cannot differ by."""
    if not is_number(value) or not value >= 0:
        raise ValueError(f"{what}: expected a number of at least 0, found {value!r}")


def difference_from_kept(
    kept: Sequence[KeptMessage], now: Sequence[KeptMessage], tolerance: Mapping[str, float], late_ns: int | None
) -> str:
    """Return where two recordings first differ, as a sentence; empty if they do not.

    Args:
        kept: The recording that is kept.
        now: The other one.
        tolerance: By topic, what numbers may differ by; exactly equal without.
        late_ns: What times may differ by; None for anything.
    """
    for topic in sorted({one.topic for one in (*kept, *now)}):
        expected, found = ([one for one in each if one.topic == topic] for each in (kept, now))
        for number, (one, other) in enumerate(zip(expected, found, strict=False), 1):
            place = f"{topic}, message {number}"
            if one.type != other.type:
                return f"{place}: expected {one.type}, found {other.type}"
            if late_ns is not None and abs(one.t_ns - other.t_ns) > late_ns:
                expected_at, found_at = _moments(one.t_ns, other.t_ns)
                return f"{place}: expected at {expected_at}, found at {found_at}"
            for field, wanted, got in _differences(one.message, other.message, tolerance.get(topic, 0.0), ""):
                what = f" of {field}" if field else ""
                return f"{place} ({moment(other.t_ns)}): expected{what} {_shown(wanted)}, found {_shown(got)}"
        if len(expected) != len(found):
            return f"{topic}: expected {len(expected)} messages, found {len(found)}"
    return ""


def _moments(one_ns: int, other_ns: int) -> tuple[str, str]:
    """Return two times that differ so that one sees that they do."""
    shown = moment(one_ns), moment(other_ns)
    return shown if shown[0] != shown[1] else (f"t = {one_ns:,} ns", f"t = {other_ns:,} ns")


def _differences(kept: Any, now: Any, tolerance: float, place: str) -> Iterator[tuple[str, Any, Any]]:
    """Yield each field that differs, with both values."""
    if isinstance(kept, dict) and isinstance(now, dict) and kept.keys() == now.keys():
        for name in kept:
            yield from _differences(kept[name], now[name], tolerance, f"{place}.{name}" if place else name)
    elif isinstance(kept, list) and isinstance(now, list) and len(kept) == len(now):
        for number, (one, other) in enumerate(zip(kept, now, strict=True)):
            yield from _differences(one, other, tolerance, f"{place}[{number}]")
    elif not _equal(kept, now, tolerance):
        yield place, kept, now


def _equal(kept: Any, now: Any, tolerance: float) -> bool:
    numbers = all(isinstance(one, (int, float)) and not isinstance(one, bool) for one in (kept, now))
    if not numbers or kept == now:
        return bool(kept == now)
    both_nan = math.isnan(kept) and math.isnan(now)
    return both_nan or abs(kept - now) <= tolerance


def _shown(value: Any) -> str:
    return quote(json.dumps(value), MOST_SHOWN)
