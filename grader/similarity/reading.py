"""Which files of a submission are compared: Python files that are text and not huge; nothing of them is run."""

from __future__ import annotations

import hashlib
import io
import tempfile
import tokenize
from collections.abc import Iterable
from pathlib import Path

from grader.model.errors import ClassError, GraderError
from grader.reading.collected import Collected
from grader.reading.submission import collect_submission
from grader.similarity.contents import Program

#: A larger file is not one that somebody wrote for an exercise; all of a submission together may be twice that.
MAX_BYTES = 64 << 10
MAX_ALL_BYTES = 2 * MAX_BYTES


def read_programs(path: Path) -> tuple[tuple[Program, ...], tuple[str, ...]]:
    """Return the Python files of a submission, and what cannot be compared and why; it never raises for a student.

    Args:
        path: A folder, an archive or one file.
    """
    try:
        with tempfile.TemporaryDirectory() as nothing:  # nothing is written
            return programs_of(collect_submission(str(path), (), Path(nothing)))
    except (GraderError, OSError, MemoryError, RecursionError):
        return (), ("it cannot be read",)


def read_given(folders: Iterable[Path]) -> tuple[Program, ...]:
    """Return the Python files that everybody was given; raises ClassError for a folder without any."""
    given: list[Program] = []
    for folder in folders:
        programs, _ = read_programs(folder)
        if not programs:
            raise ClassError(f"{folder}: expected a folder with the Python files that students were given, found none")
        given += programs
    return tuple(given)


def programs_of(collected: Collected) -> tuple[tuple[Program, ...], tuple[str, ...]]:
    """Return what of the files that were read can be compared, and what cannot and why."""
    programs, passed_over, room = [], [], MAX_ALL_BYTES
    for name, content in sorted(collected.files):
        if not name.casefold().endswith(".py"):
            continue
        why = _objection(content, room)
        if why:
            passed_over.append(f"{name}: {why}")
            continue
        room -= len(content)
        programs.append(Program(name, text_of(content), hashlib.sha256(content).hexdigest()))
    return tuple(programs), tuple(passed_over)


def text_of(content: bytes) -> str:
    """Return the text of a Python file in its own encoding; what is wrong in it becomes U+FFFD."""
    try:
        encoding, _ = tokenize.detect_encoding(io.BytesIO(content).readline)
        text = content.decode(encoding, "replace")
    except (SyntaxError, LookupError, ValueError):
        text = content.decode("utf-8", "replace")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def _objection(content: bytes, room: int) -> str:
    if len(content) > MAX_BYTES:
        return f"more than {MAX_BYTES >> 10} KiB"
    if len(content) > room:
        return f"the submission has more than {MAX_ALL_BYTES >> 10} KiB of Python"
    return "not text" if b"\0" in content else ""
