"""Unpacks an archive in memory, within limits and by rules of our own; nothing is written."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from grader.model.errors import SubmissionError
from grader.reading.archive_members import FEWER, FILE, FOLDER, HAND_IN_ZIP, REPACK, Member, UnusableArchiveError
from grader.reading.collected import (
    MAX_DEPTH,
    MAX_ENTRIES,
    MAX_FILE_BYTES,
    MAX_FILES,
    MAX_TOTAL_BYTES,
    Collected,
    LeftOut,
)
from grader.reading.member_names import collision, folders_of, generated_folders, objection, passed_over
from grader.reading.quoting import shown
from grader.reading.tar_members import BLOCK, is_tar, tar_members, unpacked
from grader.reading.zip_members import zip_members

#: Largest archive.
MAX_ARCHIVE_BYTES = 64 << 20

#: Most that compressed tar archives unpack to, headers and files that are left out included.
MAX_UNPACKED_BYTES = 64 << 20

#: Most bytes that one byte of an archive may become, once more than `RATIO_FREE_BYTES` have come of it.
MAX_RATIO = 200
RATIO_FREE_BYTES = 4 << 20
_RATIO = f"{MAX_RATIO} times the size of the archive"

#: Bytes of a file that tell what kind of archive it is.
HEAD_BYTES = BLOCK

#: What archives are called; what is in them decides.
ARCHIVE_SUFFIXES = (".zip", ".tar", ".gz", ".tgz", ".bz2", ".tbz2", ".xz", ".txz", ".zst", ".7z", ".rar")

_MAGIC = {
    b"PK\x03\x04": "zip",
    b"PK\x05\x06": "zip",
    b"\x1f\x8b": "gzip",
    b"BZh": "bzip2",
    b"\xfd7zXZ\x00": "xz",
    b"PK\x07\x08": "split zip",
    b"7z\xbc\xaf\x27\x1c": "7z",
    b"Rar!\x1a\x07": "rar",
    b"\x28\xb5\x2f\xfd": "zstd",
    b"LZIP": "lzip",
}
_READABLE = ("zip", "tar", "gzip", "bzip2", "xz")


def archive_kind(head: bytes) -> str | None:
    """Return what kind of archive or compressed file begins like this, or None.

    Args:
        head: The first `HEAD_BYTES` of a file, or all of a shorter one.

    Returns:
        `zip`, `tar`, `gzip`, `bzip2` or `xz`, which can be read, or the name of another kind, which cannot.
    """
    for magic, kind in _MAGIC.items():
        if head.startswith(magic):
            return kind
    return "tar" if is_tar(head) else None


def collect_archive(data: bytes, *, where: str) -> Collected:
    """Return the files that an archive holds.

    What a folder would be copied without is left out in the same way, so the same files give the same result packed or
    not.

    Args:
        data: The whole archive, at most `MAX_ARCHIVE_BYTES`.
        where: The archive as messages show it.

    Raises:
        SubmissionError: It cannot be read, exceeds a limit, or holds a link, a device, or a name that some system
            could not keep or would keep elsewhere.
    """
    if len(data) > MAX_ARCHIVE_BYTES:
        raise SubmissionError(f"{where}: expected at most {MAX_ARCHIVE_BYTES >> 20} MiB, found more", FEWER)
    try:
        left = LeftOut()
        members = _without_generated(_wanted(_members(data)), left)
        files = tuple(_contents(members, len(data), left))
    except UnusableArchiveError as error:
        raise SubmissionError(f"{where}: {error.problem}", error.hint) from None
    return Collected(files, left.notes())


def _members(data: bytes) -> list[Member]:
    kind = archive_kind(data[:HEAD_BYTES])
    if kind is None:
        raise UnusableArchiveError("expected a zip or tar archive, found another kind of file", HAND_IN_ZIP)
    if kind not in _READABLE:
        raise UnusableArchiveError(f"expected a zip or tar archive, found {kind}, which cannot be read", HAND_IN_ZIP)
    if kind == "zip":
        return zip_members(data, most=MAX_ENTRIES)
    if kind != "tar":
        allowed = _allowed(len(data))
        limit = _RATIO if allowed < MAX_UNPACKED_BYTES else f"{MAX_UNPACKED_BYTES >> 20} MiB unpacked"
        data = unpacked(data, kind, most=min(MAX_UNPACKED_BYTES, allowed), limit=limit)
        if not is_tar(data[:HEAD_BYTES]):
            raise UnusableArchiveError(
                f"expected a tar archive inside the {kind}, found another kind of file", HAND_IN_ZIP
            )
    return tar_members(data, most=MAX_ENTRIES)


def _allowed(packed: int) -> int:
    return max(RATIO_FREE_BYTES, packed * MAX_RATIO)


def _wanted(members: Sequence[Member]) -> Iterator[tuple[str, Member]]:
    """Yield the files that are the student's, with clean names; raises for what no archive may hold."""
    for member in members:
        name = _relative(member)
        if not name:  # the top itself
            continue
        problem = objection(name)
        if problem:
            raise UnusableArchiveError(f"expected plain relative names, found {problem}: {shown(member.name)}")
        if passed_over(name if member.kind != FOLDER else f"{name}/x"):
            continue
        if member.kind == FOLDER:
            continue
        if member.kind != FILE:
            hint = "replace it by the file itself" if member.kind == "a link" else REPACK
            raise UnusableArchiveError(f"expected plain files, found {member.kind}: {shown(member.name)}", hint)
        yield name, member


def _relative(member: Member) -> str:
    """Return a member's name without the `./` that `tar -c .` writes; empty for the top of the archive."""
    name = member.name
    while name.startswith("./"):
        name = name[2:]
    return "" if name == "." and member.kind == FOLDER else name


def _without_generated(named: Iterator[tuple[str, Member]], left: LeftOut) -> list[tuple[str, Member]]:
    """Leave out what tools made, then hold the rest to the limits that need no unpacking."""
    every = list(named)
    generated = generated_folders(name for name, _ in every)
    kept = []
    for name, member in every:
        folder = next((folder for folder in folders_of(name) if folder in generated), None)
        if folder is None:
            kept.append((name, member))
        else:
            left.add(f"it holds {generated[folder]}, so a tool made it", folder)
    if len(kept) > MAX_FILES:
        raise UnusableArchiveError(f"expected at most {MAX_FILES} files, found more", FEWER)
    if any(name.count("/") > MAX_DEPTH for name, _ in kept):
        raise UnusableArchiveError(f"expected at most {MAX_DEPTH} folders inside each other, found more", FEWER)
    twins = collision([name for name, _ in kept])
    if twins is not None:
        found = f"found {shown(twins[0])} and {shown(twins[1])}" if twins[0] != twins[1] else f"found {shown(twins[0])}"
        raise UnusableArchiveError(f"expected different names, {found}{' twice' if twins[0] == twins[1] else ''}")
    return kept


def _contents(members: Sequence[tuple[str, Member]], packed: int, left: LeftOut) -> Iterator[tuple[str, bytes]]:
    """Unpack, counting what really comes and not what was promised."""
    total = 0
    for name, member in members:
        content = member.read(MAX_FILE_BYTES + 1) if member.size <= MAX_FILE_BYTES else None
        if content is None or len(content) > MAX_FILE_BYTES:
            left.add(f"larger than {MAX_FILE_BYTES >> 20} MiB", name)
            continue
        if len(content) != member.size:  # another program would see another file
            raise UnusableArchiveError("expected a whole archive, found a damaged or incomplete one")
        total += len(content)
        if total > MAX_TOTAL_BYTES:
            raise UnusableArchiveError(f"expected at most {MAX_TOTAL_BYTES >> 20} MiB in all, found more", FEWER)
        if total > _allowed(packed):
            raise UnusableArchiveError(f"expected at most {_RATIO}, found more", FEWER)
        yield name, content
