"""What is compared and what comes of it: plain values, all text in them still as it came."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

#: Line numbers, from 1 on, in order.
Lines = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Program:
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
    programs: tuple[Program, ...]
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

    program: Program
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
class Same:
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
    same: tuple[Same, ...] = ()
    given: tuple[tuple[Handed, str], ...] = ()
    common_from: int = 0
    threshold: float = 0.0
    least_share: float = 0.0
    given_files: tuple[str, ...] = ()
