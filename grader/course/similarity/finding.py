"""Finds similar submissions, ignoring handed-out code and code that many students write."""

from __future__ import annotations

import hashlib
import tempfile
from collections import Counter, defaultdict
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from itertools import combinations
from pathlib import Path

from grader.course.similarity.library import (
    FILE_LIMIT_S,
    PIECE,
    ComparedProgram,
    Handed,
    Likeness,
    Pair,
    Print,
    SameMessages,
    SameText,
    Side,
    Similar,
    TooSlow,
    make_print,
    overlap_of,
)
from grader.grading.submissions.collected import Collected
from grader.grading.submissions.source_encodings import UNUSUAL, USUAL, encoding_of
from grader.grading.submissions.submission import collect_submission
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, GraderError

#: Largest file that is compared, since nobody writes more for an exercise, and most bytes of a submission.
MAX_BYTES = 64 << 10
MAX_ALL_BYTES = 2 * MAX_BYTES


def read_compared(path: Path) -> tuple[tuple[ComparedProgram, ...], tuple[str, ...]]:
    """Read a submission's Python files, and list those that cannot be compared; a bad submission raises nothing."""
    try:
        with tempfile.TemporaryDirectory() as nothing:  # nothing is written
            return programs_of(collect_submission(str(path), (), Path(nothing)))
    except (GraderError, OSError, MemoryError, RecursionError):
        return (), ("it cannot be read",)


def read_templates(folders: Iterable[Path]) -> tuple[ComparedProgram, ...]:
    """Read the Python files that were handed out; raises ClassError for a folder without any."""
    given: list[ComparedProgram] = []
    for folder in folders:
        programs, _ = read_compared(folder)
        if not programs:
            raise ClassError(f"{folder}: expected a folder with the Python files that students were given, found none")
        given += programs
    return tuple(given)


def programs_of(collected: Collected) -> tuple[tuple[ComparedProgram, ...], tuple[str, ...]]:
    """Split collected files into programs to compare, and sentences about those that cannot be compared."""
    programs, passed_over, left = [], [], MAX_ALL_BYTES
    for name, content in sorted(collected.files):
        if not name.casefold().endswith(".py"):
            continue
        why = _objection(content, left)
        if why:
            passed_over.append(f"{name}: {why}")
            continue
        left -= len(content)
        programs.append(ComparedProgram(name, decoded_text(content), hashlib.sha256(content).hexdigest()))
    return tuple(programs), tuple(passed_over)


def decoded_text(content: bytes) -> str:
    """Decode a Python file in its declared encoding, if that takes linear time; invalid bytes become U+FFFD."""
    encoding = encoding_of(content)
    text = content.decode(encoding if encoding in USUAL | UNUSUAL else "utf-8", "replace")
    return text.removeprefix("\ufeff").replace("\r\n", "\n").replace("\r", "\n")


def _objection(content: bytes, left: int) -> str:
    if len(content) > MAX_BYTES:
        return f"more than {MAX_BYTES >> 10} KiB"
    if len(content) > left:
        return f"the submission has more than {MAX_ALL_BYTES >> 10} KiB of Python"
    return "not text" if b"\0" in content else ""


#: Two files are listed if the first share of one file's own code is in the other, at least the second share of the
#: other's own code is in the first, and they have at least this many characters in common. Chosen with independently
#: written programs and disguised copies of them; the documentation for instructors has the figures. Two obvious
#: solutions for the gaps of the first exercise's template have 134 characters in common.
THRESHOLD, LEAST_SHARE, LEAST_OVERLAP = 0.65, 0.4, 140
#: Code is common if more than this share of the class, and more than this number of students, have it. In a large class
#: what more than a hundred have is common too: no group that copied is larger, and pairs grow with the square of it.
COMMON_SHARE, COMMON_LEAST, COMMON_MOST = 0.1, 4, 100


@dataclass(slots=True)
class _File:
    """A file that is compared, with its owner and its fingerprint."""

    owner: int
    program: ComparedProgram
    print: Print


def find_similar(handed: Sequence[Handed], given: Sequence[ComparedProgram], limit_s: float = FILE_LIMIT_S) -> Similar:
    """Find the similar submissions of a class; a file that takes more processor time than the limit is left out."""
    as_given = {program.digest for program in given}
    kept = [replace(h, programs=tuple(p for p in h.programs if p.digest not in as_given)) for h in handed]
    files, kept = _prints(kept, limit_s)
    common_from = min(COMMON_MOST, max(COMMON_LEAST, int(COMMON_SHARE * len(handed))))
    _remove_common_pieces(files, given, common_from)
    return Similar(
        handed=tuple(kept),
        pairs=tuple(_pairs(kept, files)),
        same=tuple(_same(kept)),
        given=tuple((h, p.name) for h in handed for p in h.programs if p.digest in as_given),
        common_from=common_from,
        threshold=THRESHOLD,
        least_share=LEAST_SHARE,
        given_files=tuple(program.name for program in given),
        messages=tuple(_same_messages(kept)),
    )


def _prints(handed: Sequence[Handed], limit_s: float) -> tuple[list[_File], list[Handed]]:
    """Return the files to compare, and the submissions with a sentence on each file that cannot be compared."""
    files, noted = [], []
    for owner, one in enumerate(handed):
        slow = []
        for program in one.programs:
            made = _print(program, limit_s)
            if made is None:
                slow.append(f"{program.name}: reading its tokens takes too long")
            else:
                files.append(_File(owner, program, made))
        noted.append(replace(one, passed_over=(*one.passed_over, *slow)))
    return files, noted


def _print(program: ComparedProgram, limit_s: float) -> Print | None:
    try:
        return make_print(program.text, limit_s)
    except (TooSlow, MemoryError, RecursionError):
        return None


def _remove_common_pieces(files: Sequence[_File], given: Sequence[ComparedProgram], common_from: int) -> None:
    """Keep only each file's own pieces: not handed out, and shared by few others."""
    owners: dict[int, set[int]] = defaultdict(set)
    for file in files:
        for piece in file.print.pieces:
            owners[piece].add(file.owner)
    handed_out = {piece for program in given for piece in make_print(program.text).pieces}
    own = {piece for piece, who in owners.items() if len(who) <= common_from and piece not in handed_out}
    shared = {piece for piece in own if len(owners[piece]) > 1}
    for file in files:
        file.print.keep(shared, own)


def _pairs(handed: Sequence[Handed], files: Sequence[_File]) -> list[Pair]:
    found: dict[tuple[int, int], list[Likeness]] = defaultdict(list)
    for left, right in _candidates(handed, files):
        overlap = overlap_of(left.print, right.print)
        alike = max(overlap.shares) >= THRESHOLD and min(overlap.shares) >= LEAST_SHARE
        if alike and overlap.signs >= LEAST_OVERLAP:
            one = Side(left.program, overlap.shares[0], overlap.lines[0])
            other = Side(right.program, overlap.shares[1], overlap.lines[1])
            found[left.owner, right.owner].append(Likeness(one, other, overlap.signs))
    pairs = [Pair(handed[a], handed[b], tuple(_best(likenesses))) for (a, b), likenesses in found.items()]
    return sorted(pairs, key=lambda pair: (-pair.share, -pair.overlap, pair.left.name, pair.right.name))


def _best(likenesses: Sequence[Likeness]) -> Iterator[Likeness]:
    """Yield the most similar files first, each file only once, since files of one submission may be similar too."""
    left: set[str] = set()
    right: set[str] = set()
    for one in sorted(likenesses, key=lambda one: (-one.share, -one.overlap)):
        if one.left.program.name not in left and one.right.program.name not in right:
            left.add(one.left.program.name)
            right.add(one.right.program.name)
            yield one


def _candidates(handed: Sequence[Handed], files: Sequence[_File]) -> Iterator[tuple[_File, _File]]:
    """Yield pairs of files by different people with enough pieces in common to be compared."""
    holders: dict[int, list[int]] = defaultdict(list)
    for index, file in enumerate(files):
        for piece in file.print.fingerprint.hashes:
            holders[piece].append(index)
    counts: Counter[tuple[int, int]] = Counter()
    for indices in holders.values():
        counts.update(combinations(indices, 2))
    # One piece has as many signs as the next few begin with, so far fewer pieces may make the overlap.
    least = LEAST_OVERLAP // PIECE
    for (a, b), count in sorted(counts.items()):
        left, right = files[a], files[b]
        if count >= least and left.owner != right.owner and handed[right.owner].name not in handed[left.owner].own:
            yield left, right


def _are_several(holders: Iterable[Handed]) -> bool:
    """Return whether some of the submissions are by different people."""
    return any(b.name not in a.own for a, b in combinations(holders, 2))


def _same(handed: Sequence[Handed]) -> list[SameText]:
    """Return the files that several people handed in byte for byte, without empty ones."""
    holders: dict[str, list[tuple[Handed, ComparedProgram]]] = defaultdict(list)
    for one in handed:
        for digest, program in {program.digest: program for program in one.programs}.items():
            if program.text.strip():
                holders[digest].append((one, program))
    found = [
        SameText(
            file=who[0][1].name,
            holders=tuple(h for h, _ in who),
            whole=len({tuple(sorted(program.digest for program in h.programs)) for h, _ in who}) == 1,
        )
        for who in holders.values()
        if _are_several(h for h, _ in who)
    ]
    return sorted(found, key=lambda same: (-len(same.holders), same.file, same.holders[0].name))


#: Fewer different messages on a topic prove nothing: a robot that stands still, or a command that is repeated, gives
#: the same ones to everybody.
LEAST_DIFFERENT = 20


def _same_messages(handed: Sequence[Handed]) -> list[SameMessages]:
    """Return the recordings of several people that hold the same messages, whenever these were recorded."""
    holders: dict[tuple[str, str], dict[str, tuple[Handed, str]]] = defaultdict(dict)
    for one in handed:
        for held in one.recorded:
            if held.different >= LEAST_DIFFERENT:
                holders[held.topic, held.digest].setdefault(one.name, (one, held.file))
    topics: dict[tuple[tuple[str, str], ...], list[str]] = defaultdict(list)
    known: dict[tuple[tuple[str, str], ...], tuple[tuple[Handed, str], ...]] = {}
    for (topic, _), found in holders.items():
        who = tuple(found.values())
        if _are_several(one for one, _ in who):
            key = tuple((one.name, file) for one, file in who)
            known[key] = who
            topics[key].append(topic)
    same = [SameMessages(tuple(sorted(topics[key])), who) for key, who in known.items()]
    return sorted(same, key=lambda one: (-len(one.holders), one.topics, one.holders[0][0].name))
