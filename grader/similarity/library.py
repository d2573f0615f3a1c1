"""Compares programs by k-grams of their tokens; the only module that knows the library which does it."""

from __future__ import annotations

import io
import signal
import threading
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from types import FrameType
from typing import Any

#: Line numbers, from 1 on, in order.
Lines = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class ComparedProgram:
    """One Python file.

    Attributes:
        name: Path inside the submission.
        text: Its text, lines ended by a line feed alone.
        digest: Of its bytes as they were handed in.
    """

    name: str
    text: str
    digest: str


@dataclass(frozen=True, slots=True)
class Handed:
    """The programs of one submission.

    Attributes:
        name: Name of the submission, different from all others.
        label: Who it is, for people.
        programs: Its Python files that can be compared.
        passed_over: What cannot be compared, and why; one sentence each.
        own: Names of other submissions of the same person, which are not compared with it.
        reported: Whether there is a report of it to look at.
    """

    name: str
    label: str
    programs: tuple[ComparedProgram, ...]
    passed_over: tuple[str, ...] = ()
    own: tuple[str, ...] = ()
    reported: bool = False


@dataclass(frozen=True, slots=True)
class Side:
    """One file of a pair.

    Attributes:
        program: The file.
        share: How much of its own code is in the other file too, 0 to 1; own is what is left without the given code and
            the common code.
        alike: Lines whose code is in the other file too.
    """

    program: ComparedProgram
    share: float
    alike: Lines


@dataclass(frozen=True, slots=True)
class Likeness:
    """Two files that are alike.

    Attributes:
        left: The file of the first submission.
        right: The file of the second.
        overlap: Signs that both have, with all names cut to one sign.
    """

    left: Side
    right: Side
    overlap: int

    @property
    def share(self) -> float:
        """The larger of the two shares: a copy that something was added to is one."""
        return max(self.left.share, self.right.share)


@dataclass(frozen=True, slots=True)
class Pair:
    """Two submissions that are alike; `likenesses` has the most alike files first, and at least one."""

    left: Handed
    right: Handed
    likenesses: tuple[Likeness, ...]

    @property
    def share(self) -> float:
        """The share of the files most alike."""
        return self.likenesses[0].share

    @property
    def overlap(self) -> int:
        """What all its files have in common."""
        return sum(likeness.overlap for likeness in self.likenesses)


@dataclass(frozen=True, slots=True)
class SameText:
    """Submissions that hold the same file, byte for byte.

    Attributes:
        file: A name of the file.
        holders: The submissions, in their order.
        whole: Whether they hold the same files altogether.
    """

    file: str
    holders: tuple[Handed, ...]
    whole: bool = False


@dataclass(frozen=True, slots=True)
class Similar:
    """What was found in a class.

    Attributes:
        handed: All submissions, in their order.
        pairs: The most alike first.
        same: Files handed in more than once, the most often first.
        given: Submission and name of each file that is given code as it is.
        common_from: In more submissions than this, code counts as what everybody writes.
        threshold: Share of one file from which on two files are listed.
        least_share: The share of the other that it takes besides.
        given_files: Names of the files of given code.
    """

    handed: Sequence[Handed]
    pairs: tuple[Pair, ...]
    same: tuple[SameText, ...] = ()
    given: tuple[tuple[Handed, str], ...] = ()
    common_from: int = 0
    threshold: float = 0.0
    least_share: float = 0.0
    given_files: tuple[str, ...] = ()


#: Signs that a piece must have to count, with all names cut to one sign.
PIECE = 25
#: Processor time for one file: hundreds of times what a program of a student takes.
FILE_LIMIT_S = 5.0


class TooSlow(Exception):  # noqa: N818  what it is
    """A file took longer than any program does."""


@dataclass(slots=True)
class Print:
    """What stands for one file in comparisons.

    Attributes:
        pieces: Digest of the piece that begins at each sign; equal in this process alone.
        fingerprint: The library's own value.
        skipped: Empty lines at the beginning, which the library leaves out.
    """

    pieces: list[int]
    fingerprint: Any
    skipped: int

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
    """What two files have in common: signs, the share of each one's own code, and the lines in each."""

    signs: int
    shares: tuple[float, float]
    lines: tuple[Lines, Lines]


def make_print(text: str) -> Print:
    """Return what stands for a program in comparisons; it is read by its tokens and never run.

    Raises:
        TooSlow: It takes longer than any program does.
    """
    import numpy as np  # noqa: PLC0415  comes with the library
    from copydetect import CodeFingerprint  # noqa: PLC0415  a heavy, optional library

    written = text.lstrip("\n")
    with _limited(FILE_LIMIT_S):
        # Every piece is kept, not a sample: which ones a sample has depends on the process.
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
    """Return what two files have in common, of the pieces that both were told to keep."""
    from copydetect import compare_files  # noqa: PLC0415  a heavy, optional library

    signs, shares, slices = compare_files(left.fingerprint, right.fingerprint)
    if not signs:
        return Overlap(0, (0.0, 0.0), ((), ()))
    first, second = (min(1.0, float(share)) for share in shares)
    return Overlap(int(signs), (first, second), (_lines(left, slices[0]), _lines(right, slices[1])))


def _lines(file: Print, slices: Any) -> Lines:
    """Return the lines that slices of the text touch; ends may lie in the empty end of a line."""
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
    """Raise TooSlow after so much processor time of this process; only the main thread can be stopped like this."""
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
