"""Unpacks class downloads of platforms, and interprets the names of their submissions."""

from __future__ import annotations

import hashlib
import json
import os.path
import re
import secrets
import shutil
from collections import Counter
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from grader.grading.submissions.archives import (
    ARCHIVE_SUFFIXES,
    FILE,
    FOLDER,
    HEAD_BYTES,
    Member,
    UnusableArchiveError,
    archive_kind,
    is_tar,
    tar_members,
    unpacked,
    zip_members,
)
from grader.grading.submissions.collected import (
    USUAL,
    SubmissionLimits,
    collisions,
    is_gradable,
    is_skipped,
    may_be_left_out,
    name_problem,
    why_skipped,
)
from grader.runtime.files import write_whole
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, HarnessError
from grader.runtime.model.limits import MAX_ARCHIVE_BYTES
from grader.runtime.model.wording import listed, printable

#: Groups that a pattern may have; with `file`, several files of one student form one submission.
GROUPS = ("name", "user", "email", "id", "late", "file")
#: The layouts that can be requested.
FOLDERS, AUTO = "folders", "auto"
GITHUB, CLASSROOM50 = "github-classroom", "classroom50"
MOODLE, CANVAS = "moodle", "canvas"

PATTERNS: Mapping[str, str] = {
    MOODLE: r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)(?:_(?P<file>.*))?",
    CANVAS: r"(?P<name>[^_]+)_(?:(?P<late>LATE)_)?(?P<id>\d+)_\d+_(?P<file>.+)",
}
# The folder of a participant ends where Moodle's own words end, whatever the participant is called.
_MOODLE_FOLDER = re.compile(r"(?P<name>.+)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)_?", re.DOTALL)
# A file whose name can be read in two ways, because a display name or the student's file has the platform's own words.
_DOUBTFUL: Mapping[str, re.Pattern[str]] = {
    MOODLE: re.compile(r"(?:.*_)?\d+_assignsubmission_(?:file|onlinetext)_.*", re.DOTALL),
    CANVAS: re.compile(r"\d+_.+", re.DOTALL),
}
# Canvas appends a number to the name of a resubmitted file.
_HANDED_IN_AGAIN = re.compile(r"-\d+(?=\.[^.]+$)")
_FOLDER_OF_CLONES = re.compile(r"(?P<slug>.+)-submissions(?:-.*)?")


@dataclass(frozen=True, slots=True)
class Named:
    """The information in the name of a folder or file in a download."""

    identity: Mapping[str, str]  # group -> matched text
    file: str = ""  # original name of the student's file; empty if this is the complete submission
    late: bool = False  # whether the platform marked it as late
    recognised: bool = True  # whether the name fits the layout
    doubtful: bool = False  # whether it can also be read as the name of another student's file


@dataclass(frozen=True, slots=True)
class DownloadLayout:
    """How the entries of one download are named."""

    name: str  # one of the layouts above, or `pattern`
    # Regular expression for names; None if the name identifies the student by itself
    pattern: re.Pattern[str] | None = None
    prefix: str = ""  # prefix of the user name in the names of cloned repositories

    def read(self, label: str) -> Named:
        """Interpret the name of a folder, or of a file including its suffix."""
        if self.name == FOLDERS:
            return Named({})
        if self.pattern is None:
            known = bool(self.prefix) and label.startswith(self.prefix) and len(label) > len(self.prefix)
            return Named({"user": label[len(self.prefix) :]} if known else {}, recognised=known)
        folder = _MOODLE_FOLDER.fullmatch(label) if self.name == MOODLE else None
        match = folder or self.pattern.fullmatch(label)
        if match is None:
            return Named({}, recognised=False)
        groups = {key: value for key, value in match.groupdict().items() if value}
        file = groups.pop("file", "")
        doubtful = self.name in _DOUBTFUL and _DOUBTFUL[self.name].fullmatch(file) is not None
        identity = {key: value for key, value in groups.items() if key != "late"}
        return Named(identity, file, late="late" in groups, doubtful=doubtful)

    def original_names(self, files: Sequence[str], wanted: Collection[str]) -> list[tuple[str, ...]]:
        """Return the names that each file of one student had before the platform changed them.

        Canvas appends a number to a file that was handed in again, but students number their files, too. It is removed
        where no other file of the student has the name without it; a wanted name stays. A file that programs may open
        by either name gets both.
        """
        if self.name != CANVAS:
            return [(file,) for file in files]
        plain = [file if file in wanted else _HANDED_IN_AGAIN.sub("", file) for file in files]
        taken = Counter([*files, *(short for short, file in zip(plain, files, strict=True) if short != file)])
        return [
            (file,) if taken[short] > 1 or short == file else (short,) if is_gradable(short) else (file, short)
            for short, file in zip(plain, files, strict=True)
        ]


def download_layout(wanted: str, pattern: str, place: str, labels: Sequence[str]) -> DownloadLayout:
    """Determine the layout of a download from the names in its top folder, `place`.

    A regular expression of the user overrides the layout that is wanted; raises ClassError if it cannot be used.
    """
    if pattern:
        return DownloadLayout("pattern", _compiled(pattern))
    if wanted in PATTERNS:
        return DownloadLayout(wanted, re.compile(PATTERNS[wanted], re.DOTALL))
    if wanted in (GITHUB, CLASSROOM50):
        return DownloadLayout(wanted, prefix=_slug(place, labels) or _common(labels))
    if wanted == FOLDERS:
        return DownloadLayout(FOLDERS)
    for name in (MOODLE, CANVAS):
        layout = download_layout(name, "", place, labels)
        if labels and sum(layout.read(label).recognised for label in labels) * 2 > len(labels):
            return layout
    slug = _slug(place, labels)
    return DownloadLayout(GITHUB, prefix=slug) if slug else DownloadLayout(FOLDERS)


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        compiled = re.compile(pattern, re.DOTALL)
    except re.error as error:
        where = f"--pattern, column {(error.pos or 0) + 1}"
        raise ClassError(f"{where}: expected a regular expression, found {printable(pattern)}: {error.msg}") from None
    odd = [group for group in compiled.groupindex if group not in GROUPS]
    if odd or not compiled.groupindex:
        found = f"the group {odd[0]}" if odd else "no named group"
        hint = r"for example --pattern '(?P<name>.+)_(?P<id>\d+)'"
        raise ClassError(f"--pattern: expected groups named {listed(GROUPS)}, found {found}", hint)
    return compiled


def _slug(place: str, labels: Sequence[str]) -> str:
    """Return `hello-` for a folder `hello-submissions` in which every name has this prefix."""
    match = _FOLDER_OF_CLONES.fullmatch(place)
    prefix = f"{match['slug']}-" if match else ""
    return prefix if prefix and labels and all(label.startswith(prefix) for label in labels) else ""


def _common(labels: Sequence[str]) -> str:
    """Return the common prefix of all names, up to its last hyphen."""
    if len(labels) < 2:
        return ""
    shared = os.path.commonprefix(list(labels))
    return shared[: shared.rfind("-") + 1]


#: Largest download, its largest unpacked size (on disk; in memory for a compressed tar), and most entries.
MAX_DOWNLOAD_BYTES = 1 << 30
#: A zip archive is unpacked to the disk, member by member.
MAX_UNPACKED_BYTES = 4 << 30
#: A compressed tar archive is unpacked in memory.
MAX_TAR_BYTES = 2 << 30
MAX_ENTRIES = 300_000
#: Largest unpacked size of one student's part; grading checks its own limits later.
MAX_PART_BYTES = 2 * MAX_ARCHIVE_BYTES

_READABLE = ("zip", "tar", "gzip", "bzip2", "xz")


@dataclass(slots=True)
class Unpacked:
    """An unpacked download."""

    folder: Path  # the folder with the submissions, below a folder around all of them if there is one
    refused: dict[str, str] = field(default_factory=dict)  # name of a folder or file in it -> why it was not unpacked
    strays: list[str] = field(default_factory=list)  # entries that belong to no submission, with the reason


def unpack_download(archive: Path, into: Path, limits: SubmissionLimits = USUAL) -> Unpacked:
    """Unpack a zip or tar file into a folder of the grader, unless it was unpacked before; a note is kept beside it.

    The limits are those of each submission in it.

    Raises ClassError if the archive cannot be read, HarnessError if the copy cannot be written.
    """
    data = _read(archive)
    note = into.with_name(f".{into.name}.json")
    # Of a rubric that asks for recordings, more is unpacked.
    digest = f"{hashlib.sha256(data).hexdigest()} {limits.bag_bytes}"
    known = _known(note, digest, into) if into.is_dir() else None
    if known is not None:
        return known
    try:
        into.parent.mkdir(parents=True, exist_ok=True)
        for unfinished in into.parent.glob(f".{into.name}.*.tmp"):
            shutil.rmtree(unfinished, ignore_errors=True)
        fresh = into.with_name(f".{into.name}.{secrets.token_hex(4)}.tmp")
        found = _unpack(_members(archive, data), fresh, limits)
        note.unlink(missing_ok=True)
        shutil.rmtree(into, ignore_errors=True)
        fresh.rename(into)
        inner = found.folder.relative_to(fresh).as_posix()
        kept = {"digest": digest, "inner": inner, "refused": found.refused, "strays": found.strays}
        write_whole(note, json.dumps(kept).encode())
    except OSError as error:
        raise HarnessError(f"{into}: the download cannot be unpacked: {error.strerror}", "free some space") from None
    return Unpacked(into / inner, found.refused, found.strays)


def _read(archive: Path) -> bytes:
    try:
        if archive.stat().st_size > MAX_DOWNLOAD_BYTES:
            hint = "unpack it yourself and name the folder"
            raise ClassError(f"{archive}: expected at most {MAX_DOWNLOAD_BYTES >> 30} GiB, found more", hint)
        return archive.read_bytes()
    except OSError as error:
        raise ClassError(f"{archive}: the download cannot be read: {error.strerror}") from None


def _known(note: Path, digest: str, into: Path) -> Unpacked | None:
    """Return the earlier result if the same download was unpacked before."""
    try:
        kept = json.loads(note.read_bytes())
        found = Unpacked(into / kept["inner"], dict(kept["refused"]), list(kept["strays"]))
        return found if kept["digest"] == digest else None
    except (OSError, ValueError, KeyError, TypeError):
        return None


def _members(archive: Path, data: bytes) -> list[Member]:
    kind = archive_kind(data[:HEAD_BYTES])
    try:
        if kind not in _READABLE:
            raise UnusableArchiveError(f"expected a zip or tar archive, found {kind or 'another kind of file'}")
        if kind == "zip":
            return zip_members(data, most=MAX_ENTRIES)
        if kind != "tar":
            limit = f"{MAX_TAR_BYTES >> 30} GiB unpacked"
            data = unpacked(data, kind, most=MAX_TAR_BYTES, limit=limit)
            if not is_tar(data[:HEAD_BYTES]):
                raise UnusableArchiveError(f"expected a tar archive inside the {kind}, found another kind of file")
        return tar_members(data, most=MAX_ENTRIES)
    except UnusableArchiveError as error:
        raise ClassError(f"{archive}: {error.problem}", "download it again, or name the unpacked folder") from None


def _unpack(members: Iterable[Member], into: Path, limits: SubmissionLimits) -> Unpacked:
    """Write the acceptable entries; each student's part completely or not at all."""
    named = [(member.name.removeprefix("./"), member) for member in members]
    around = _around(name for name, member in named if member.kind == FILE)
    top = into / around
    top.mkdir(parents=True)
    found = Unpacked(top)
    by_part: dict[str, list[tuple[str, Member]]] = {}
    overlooked: dict[str, str] = {}
    for whole, member in named:
        name = whole.removeprefix(around)
        part, below, _ = name.partition("/")
        if name in ("", ".") or f"{whole}/" == around:
            continue
        if name_problem(part) or not whole.startswith(around):
            found.strays.append(f"{printable(whole)} ({name_problem(part) or 'beside the folder of all others'})")
        elif name_problem(name) or not is_skipped(name if member.kind != FOLDER else f"{name}/x"):
            by_part.setdefault(part, []).append((name, member))
        elif why_skipped(part, is_folder=bool(below) or member.kind == FOLDER):
            overlooked[part] = why_skipped(part, is_folder=bool(below) or member.kind == FOLDER)
    found.strays += [f"{printable(part)}: {why}, so it is not graded" for part, why in overlooked.items()]
    left = MAX_UNPACKED_BYTES
    for part, inside in by_part.items():
        kept, reasons = _storable(inside)
        found.strays += reasons
        problem, size = _write_part(kept, top, left, limits)
        left -= size
        if problem:
            found.refused[part] = problem
            _remove(top / part)
    return found


def _around(files: Iterable[str]) -> str:
    """Return the folder around all submissions of a download, with a slash; empty if there is none.

    A folder with several folders or archives, and no program directly in it, is not itself a submission.
    """
    paths = [name.split("/") for name in files if not is_skipped(name)]
    if not paths or len({path[0] for path in paths}) != 1 or name_problem(paths[0][0]):
        return ""
    inside = {path[1] for path in paths if len(path) > 2 or path[-1].casefold().endswith(ARCHIVE_SUFFIXES)}
    programs = any(len(path) == 2 and path[1].casefold().endswith(".py") for path in paths)
    return f"{paths[0][0]}/" if len(inside) > 1 and not programs and all(len(path) > 1 for path in paths) else ""


def _remove(path: Path) -> None:
    if path.is_dir():
        shutil.rmtree(path, ignore_errors=True)
    else:
        path.unlink(missing_ok=True)


def _write_part(inside: list[tuple[str, Member]], into: Path, left: int, limits: SubmissionLimits) -> tuple[str, int]:
    """Write the files of one student; return the problem, empty if there is none, and the number of bytes read."""
    problem = _name_problem(inside)
    if problem:
        return problem, 0
    total = 0
    for name, member in inside:
        if member.kind == FOLDER:
            (into / name).mkdir(parents=True, exist_ok=True)
            continue
        # As in a folder that is graded by itself: there a larger file is left out with a note.
        is_whole = "/" not in name and name.casefold().endswith(ARCHIVE_SUFFIXES)
        most = limits.packed_bytes if is_whole else limits.most_of(name)
        try:
            content = member.read(most + 1) if member.size <= most else None
        except UnusableArchiveError as error:
            return error.problem, total
        if content is None or len(content) > most:
            write_without_content(into / name, most)
            continue
        total += len(content)
        whole = min(MAX_PART_BYTES + limits.bag_bytes, left)
        if total > whole:
            limit = whole >> 20
            return f"expected at most {limit} MiB in all, found more with {printable(name)}", total
        (into / name).parent.mkdir(parents=True, exist_ok=True)
        (into / name).write_bytes(content)
    return "", total


def write_without_content(path: Path, most: int) -> None:
    """Write a file that is larger than `most` bytes and takes no room: nobody reads it, and a note will name it."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with path.open("wb") as file:
        file.truncate(most + 1)


def _storable(inside: Sequence[tuple[str, Member]]) -> tuple[list[tuple[str, Member]], list[str]]:
    """Return the files of one student without those that are not programs and have names that some system cannot keep.

    Also returns a reason for each that is left out.
    """
    kept = []
    why = "so it is left out of its submission"
    reasons = []
    for name, member in inside:
        problem = name_problem(name)
        if problem and member.kind == FILE and may_be_left_out(name):
            reasons.append(f"{printable(name, 200)}: {problem}, {why}")
        else:
            kept.append((name, member))
    files = [place for place, (_, member) in enumerate(kept) if member.kind == FILE]
    twins = {}
    for index, other, twin in collisions([kept[place][0] for place in files]):
        name = kept[files[index]][0]
        if name == twin and not is_gradable(name):
            twins[files[index]] = f"{printable(name, 200)}: something else is called {printable(other, 200)}, {why}"
    return [one for place, one in enumerate(kept) if place not in twins], [*reasons, *twins.values()]


def _name_problem(inside: Sequence[tuple[str, Member]]) -> str:
    for name, member in inside:
        problem = name_problem(name)
        if problem:
            return f"expected plain relative names, found {problem}: {printable(name)}"
        if member.kind not in (FILE, FOLDER):
            return f"expected plain files, found {member.kind}: {printable(name)}"
    twins = next(collisions([name for name, member in inside if member.kind == FILE]), None)
    return f"expected different names, found {printable(twins[1])} and {printable(twins[2])}" if twins else ""
