"""Asks the contained process what the files of a submission hold, and takes its answer apart."""

from __future__ import annotations

import json
import os
import stat
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Mapping
from dataclasses import field
from pathlib import Path
from typing import Any, TypeAlias

from grader.runtime.contained import run_contained
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError

MODULE = "grader.grading.submissions.submission_reader"
#: Limits of the process: memory and output in bytes, processor time in seconds. The files of a real submission take it
#: a tenth of a second, most of it for its own start. What it tells is 10 MiB of programs at most, and of projects
#: whatever fits.
MEMORY_BYTES, OUTPUT_BYTES, PROCESSOR_S = 320 << 20, 18 << 20, 20
#: Asks the process.
Tell: TypeAlias = Callable[[bytes], bytes]


def told_by_process(asked: bytes, output_bytes: int = OUTPUT_BYTES) -> bytes:
    """Return what the process says of some files; `submission_reader` has the formats.

    Raises:
        HarnessError: The process cannot be started, or the machine is too busy for it.
    """
    limits = {"memory": MEMORY_BYTES, "output": output_bytes, "processor": PROCESSOR_S}
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as out:
        given.write(asked)
        given.seek(0)
        try:
            run_contained(MODULE, limits, given, out)
        except subprocess.TimeoutExpired:
            raise HarnessError("submission: the machine was too busy to read its files", "try again later") from None
        except OSError as error:
            raise HarnessError(f"submission: its files cannot be read: {error.strerror}", "free some memory") from None
        out.seek(0)
        return out.read(output_bytes)


@dataclass(slots=True)
class Asked:
    """The files that the process is to read. Each is kept once, however many packages it is in."""

    packages: list[Mapping[str, object]] = field(default_factory=list)
    programs: list[tuple[str, int]] = field(default_factory=list)
    likely: list[str] = field(default_factory=list)
    decoded: bool = False
    names: Iterable[str] = ()
    _contents: list[bytes] = field(default_factory=list)

    def add(self, content: bytes) -> int:
        """Add a content, and return its number."""
        self._contents.append(content)
        return len(self._contents) - 1

    def content(self, number: int) -> bytes:
        """Return a content that was added."""
        return self._contents[number]

    def input(self) -> bytes:
        """Return the standard input of the process."""
        names = self.add(b"".join(os.fsencode(name) + b"\0" for name in self.names))
        told = {
            "sizes": [len(content) for content in self._contents],
            "packages": self.packages,
            "names": names,
            "programs": self.programs,
            "likely": self.likely,
            "decoded": self.decoded,
        }
        header = json.dumps(told).encode("ascii")
        return b"".join((*self._contents, header, len(header).to_bytes(8, "big")))


class ReaderAnswer:
    """What the process said, as far as it came.

    Args:
        told: Its output.
    """

    def __init__(self, told: bytes) -> None:
        self._told, self._at = told, 0

    def row(self) -> dict[str, Any] | None:
        """Return the next line, which is a JSON object; None at the end, and for anything else."""
        end = self._told.find(b"\n", self._at)
        if end < 0:
            return None
        line, self._at = self._told[self._at : end], end + 1
        try:
            found = json.loads(line)
        except (ValueError, RecursionError):
            return None
        return found if isinstance(found, dict) else None

    def part(self, size: object) -> bytes | None:
        """Return the next bytes; None if the size is invalid, or fewer came."""
        if type(size) is not int or not 0 <= size <= len(self._told) - self._at:
            return None
        self._at += size
        return self._told[self._at - size : self._at]


def read_within(path: Path, most: int) -> bytes | None:
    """Return the bytes of a plain file, empty if there is none; None if there are more than allowed."""
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return b""
            content = file.read(most + 1)
    except OSError:
        return b""
    return content if len(content) <= most else None


def beginning_of_file(path: Path, most: int) -> str:
    """Return the beginning of the first line of a plain file; empty if there is none."""
    try:
        with open(path, "rb", opener=_without_waiting) as file:
            if not stat.S_ISREG(os.fstat(file.fileno()).st_mode):
                return ""
            return file.read(most).partition(b"\n")[0].decode("latin-1")
    except OSError:
        return ""


def _without_waiting(path: str, flags: int) -> int:
    """Open a file without blocking on a pipe."""
    return os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC)
