"""Compares programs by k-grams of their tokens; the only module that uses the copydetect library."""

from __future__ import annotations

import io
import signal
import threading
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from types import FrameType
from typing import Any

from grader.runtime.model.dataclass import dataclass

#: Line numbers, starting at 1, in order.
Lines = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ComparedProgram:
    """One Python file: its path inside the submission, its text with line feeds, and the digest of its bytes."""

    name: str
    text: str
    digest: str


@dataclass(frozen=True, slots=True)
class ComparedTopic:
    """What a recording that was handed in holds on a topic."""

    file: str  # the recording, relative to the submission
    topic: str
    different: int  # how many different messages there are
    digest: str  # of all messages in their order, without the times at which they were recorded and stamped


@dataclass(frozen=True, slots=True)
class Handed:
    """The programs and recordings of one submission."""

    name: str
    label: str
    programs: tuple[ComparedProgram, ...]  # its Python files that can be compared
    passed_over: tuple[str, ...] = ()  # files that cannot be compared, and why; one sentence each
    own: tuple[str, ...] = ()  # names of other submissions by the same person, which are not compared with it
    reported: bool = False
    recorded: tuple[ComparedTopic, ...] = ()  # what was judged of the recordings that were handed in


@dataclass(frozen=True, slots=True)
class Side:
    """One file of a pair."""

    program: ComparedProgram
    # How much of its own code is in the other file too, 0 to 1; own is what is left without the given code and the
    # common code
    share: float
    alike: Lines  # lines whose code is also in the other file


@dataclass(frozen=True, slots=True)
class Likeness:
    """Two similar files; the overlap counts common characters, with all names shortened to one."""

    left: Side
    right: Side
    overlap: int

    @property
    def share(self) -> float:
        """The larger of the two shares, so that a copy with additions is found."""
        return max(self.left.share, self.right.share)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two similar submissions; `likenesses` is not empty and starts with the most similar files."""

    left: Handed
    right: Handed
    likenesses: tuple[Likeness, ...]

    @property
    def share(self) -> float:
        """The share of the most similar files."""
        return self.likenesses[0].share

    @property
    def overlap(self) -> int:
        """Common characters of all its files."""
        return sum(likeness.overlap for likeness in self.likenesses)


@dataclass(frozen=True, slots=True)
class SameText:
    """Submissions with the same file, byte for byte; `whole` if all of their files are the same."""

    file: str
    holders: tuple[Handed, ...]
    whole: bool = False


@dataclass(frozen=True, slots=True)
class SameMessages:
    """Submissions whose recordings hold the same messages on some topics, each with the name of its recording."""

    topics: tuple[str, ...]
    holders: tuple[tuple[Handed, str], ...]


@dataclass(frozen=True, slots=True)
class Similar:
    """The similar submissions of a class."""

    handed: Sequence[Handed]
    pairs: tuple[Pair, ...]  # similar pairs, the most similar first
    same: tuple[SameText, ...] = ()  # files handed in more than once, the most frequent first
    given: tuple[tuple[Handed, str], ...] = ()  # submission and name of each unchanged handed-out file
    common_from: int = 0  # code in more submissions than this is ignored as common
    threshold: float = 0.0
    least_share: float = 0.0
    given_files: tuple[str, ...] = ()
    messages: tuple[SameMessages, ...] = ()  # messages that several have recorded, those of most people first


#: Characters of a piece, with all names shortened to one.
PIECE = 25
#: Processor time for one file; a student's program takes less than a hundredth of it.
FILE_LIMIT_S = 5.0


class TooSlow(Exception):  # noqa: N818  reads well in except clauses
    """Reading a file took longer than for any real program."""


@dataclass(slots=True)
class Print:
    """The fingerprint of one file."""

    pieces: list[int]  # hash of the piece that begins at each character; comparable only within this process
    fingerprint: Any
    skipped: int  # number of leading empty lines, which the library skips

    def keep(self, shared: Collection[int], own: Collection[int]) -> None:
        """Count only the pieces in `own` as the file's own code, and compare only those of them in `shared`."""
        from copydetect.utils import get_token_coverage  # noqa: PLC0415  a heavy, optional library

        where: dict[int, list[int]] = {}
        for index, piece in enumerate(self.pieces):
            where.setdefault(piece, []).append(index)
        mine = {piece: places for piece, places in where.items() if piece in own}
        self.fingerprint.token_coverage = get_token_coverage(mine, PIECE, len(self.fingerprint.filtered_code))
        self.fingerprint.hash_idx = {piece: places for piece, places in mine.items() if piece in shared}
        self.fingerprint.hashes = set(self.fingerprint.hash_idx)


@dataclass(frozen=True, slots=True)
class Overlap:
    """The common code of two files: characters, the share of each file's own code, and the lines in each."""

    signs: int
    shares: tuple[float, float]
    lines: tuple[Lines, Lines]


def make_print(text: str, limit_s: float = FILE_LIMIT_S) -> Print:
    """Make the fingerprint of a program from its tokens, without running it; raises TooSlow if that takes too long."""
    import numpy as np  # noqa: PLC0415  comes with the library
    from copydetect import CodeFingerprint  # noqa: PLC0415  a heavy, optional library

    written = text.lstrip("\n")
    with _limited(limit_s):
        # All pieces are kept instead of a sample, because a sample would depend on the process.
        made = CodeFingerprint("program.py", PIECE, 1, language="python", fp=io.StringIO(written))
    pieces = [0] * max(0, len(made.filtered_code) - PIECE + 1)
    for piece, places in made.hash_idx.items():
        for place in places:
            pieces[place] = int(piece)
    made.hashes, made.hash_idx = set(), {}
    if len(made.offsets):  # those of class names are not summed up as all others are
        made.offsets[:, 1] = np.maximum.accumulate(made.offsets[:, 1])
    return Print(pieces, made, len(text) - len(written))


def overlap_of(left: Print, right: Print) -> Overlap:
    """Compare two files by the pieces that both keep."""
    from copydetect import compare_files  # noqa: PLC0415  a heavy, optional library

    signs, shares, slices = compare_files(left.fingerprint, right.fingerprint)
    if not signs:
        return Overlap(0, (0.0, 0.0), ((), ()))
    first, second = (min(1.0, float(share)) for share in shares)
    return Overlap(int(signs), (first, second), (_lines(left, slices[0]), _lines(right, slices[1])))


def _lines(file: Print, slices: Any) -> Lines:
    """Return the lines that slices of the text touch; a slice may end at an empty end of a line."""
    text = file.fingerprint.raw_code
    found: set[int] = set()
    for start, stop in zip(slices[0].tolist(), slices[1].tolist(), strict=True):
        piece = text[int(start) : int(stop)]
        inside = piece.strip()
        begin = int(start) + len(piece) - len(piece.lstrip())
        first = text.count("\n", 0, begin) + 1 + file.skipped
        found.update(range(first, first + inside.count("\n") + 1) if inside else ())
    return tuple(sorted(found))


@contextmanager
def _limited(seconds: float) -> Iterator[None]:
    """Raise TooSlow after some processor time of this process; works only in the main thread."""
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def stop(_signum: int, _frame: FrameType | None) -> None:
        raise TooSlow

    before = signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)
    try:
        yield
    finally:
        signal.setitimer(signal.ITIMER_PROF, 0)
        signal.signal(signal.SIGPROF, before)
