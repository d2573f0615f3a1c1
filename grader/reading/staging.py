"""Copies what a student handed in to a place of our own, within limits; the student's folder is only read."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from grader.model.errors import HarnessError, SubmissionError
from grader.reading.quoting import listed, shown

MAX_FILES = 2_000
MAX_TOTAL_BYTES = 50 << 20
MAX_FILE_BYTES = 8 << 20
MAX_DEPTH = 20

#: Longest path inside a submission: the system refuses longer ones once the staging folder stands before it.
MAX_PATH_BYTES = 2_000

#: Entries of any kind that are looked at before a folder is taken for something else than a submission.
MAX_ENTRIES = 20_000

_SKIPPED_FOLDERS = frozenset({"__pycache__", "__MACOSX", "venv", "node_modules"})

#: A folder that holds one of these was made by a tool: a virtual environment, or what `colcon build` left behind.
_GENERATED_MARKERS = ("pyvenv.cfg", "COLCON_IGNORE")

_OPEN_FLAGS = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


@dataclass(slots=True)
class Staged:
    """What was copied.

    Attributes:
        files: Relative POSIX paths, sorted by their bytes.
        digest: `sha256:` and 64 hex digits over names and contents.
        notes: Sentences about what was not copied.
    """

    files: list[str]
    digest: str
    notes: tuple[str, ...]


@dataclass(slots=True)
class _Left:
    """Names of what was not copied, by the reason."""

    by_reason: dict[str, list[str]] = field(default_factory=dict)

    def add(self, reason: str, relative: str) -> None:
        self.by_reason.setdefault(reason, []).append(relative)

    def notes(self) -> tuple[str, ...]:
        """Return one sentence per reason, in an order that does not depend on how the system lists folders."""
        return tuple(
            self._note(reason, sorted(names, key=os.fsencode)) for reason, names in sorted(self.by_reason.items())
        )

    @staticmethod
    def _note(reason: str, names: Sequence[str]) -> str:
        first = [shown(name) for name in names[:3]]
        more = [f"{len(names) - 3} more"] if len(names) > 3 else []
        return f"not copied: {listed([*first, *more], 'and')} ({reason})"


def stage_folder(folder: Path, into: Path, *, where: str) -> Staged:
    """Copy the files of a folder.

    Args:
        folder: The student's folder; only read.
        into: Empty folder of the caller's; files arrive readable by everybody, in the same layout.
        where: The folder as messages show it.

    Returns:
        What was copied. Links, devices, sockets, pipes and unreadable files are left out with a note.

    Raises:
        SubmissionError: The folder cannot be listed, or a limit is exceeded.
        HarnessError: The copy cannot be written.
    """
    left = _Left()
    walk = _Walk(where=where, left=left, own=_identity(into.stat()))
    try:
        top = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise SubmissionError(f"{where}: the folder cannot be read: {error.strerror}") from None
    try:
        relatives = sorted(walk.files(top), key=os.fsencode)
    finally:
        os.close(top)
    return _copy_all([(relative, folder / relative) for relative in relatives], into, where, left)


def stage_file(file: Path, into: Path, *, where: str) -> Staged:
    """Copy one file, as a folder that holds only it.

    Args:
        file: The student's file; a link to one is followed, because it was named.
        into: Empty folder of the caller's.
        where: The file as messages show it.

    Raises:
        SubmissionError: The file cannot be read or is too large.
        HarnessError: The copy cannot be written.
    """
    left = _Left()
    staged = _copy_all([(file.name, file.resolve())], into, where, left)
    if not staged.files:
        raise SubmissionError(f"{where}: the file cannot be graded: {next(iter(left.by_reason))}")
    return staged


@dataclass(slots=True)
class _Walk:
    """Lists a folder; works on descriptors, because paths may be longer than the system takes."""

    where: str
    left: _Left
    own: tuple[int, int]
    entries: int = 0
    found: int = 0

    def files(self, descriptor: int, prefix: str = "", depth: int = 0) -> Iterator[str]:
        """Yield the relative paths of plain files, in no particular order."""
        for name in self._names(descriptor):
            relative = f"{prefix}{name}"
            try:
                info = os.stat(name, dir_fd=descriptor, follow_symlinks=False)
            except OSError as error:
                self.left.add(f"it cannot be read: {error.strerror}", relative)
                continue
            if stat.S_ISDIR(info.st_mode):
                yield from self._folder(descriptor, name, relative, depth + 1, info)
            elif stat.S_ISREG(info.st_mode):
                yield from self._file(relative, name)
            else:
                self.left.add(_kind(info.st_mode), relative)

    def _names(self, descriptor: int) -> list[str]:
        with os.scandir(descriptor) as entries:
            names = []
            for entry in entries:
                self.entries += 1
                if self.entries > MAX_ENTRIES:
                    raise _too_much(self.where, f"{MAX_ENTRIES} entries")
                names.append(entry.name)
        return names

    def _file(self, relative: str, name: str) -> Iterator[str]:
        if name.startswith("._"):  # what macOS puts beside every file in an archive
            return
        if len(os.fsencode(relative)) > MAX_PATH_BYTES:
            self.left.add("the path is too long", relative)
            return
        self.found += 1
        if self.found > MAX_FILES:
            raise _too_much(self.where, f"{MAX_FILES} files")
        yield relative

    def _folder(self, parent: int, name: str, relative: str, depth: int, info: os.stat_result) -> Iterator[str]:
        if name in _SKIPPED_FOLDERS or name.startswith(".") or _identity(info) == self.own:
            return
        if depth > MAX_DEPTH:
            raise _too_much(self.where, f"{MAX_DEPTH} folders inside each other")
        try:
            descriptor = os.open(name, _OPEN_FLAGS | os.O_DIRECTORY, dir_fd=parent)
        except OSError as error:
            self.left.add(f"the folder cannot be read: {error.strerror}", relative)
            return
        try:
            marker = next((m for m in _GENERATED_MARKERS if _exists(m, descriptor)), None)
            if marker is None:
                yield from self.files(descriptor, f"{relative}/", depth)
            else:
                self.left.add(f"it holds {marker}, so a tool made it", relative)
        finally:
            os.close(descriptor)


def _too_much(where: str, limit: str) -> SubmissionError:
    return SubmissionError(
        f"{where}: expected at most {limit}, found more", "name the folder that holds only your work"
    )


def _identity(info: os.stat_result) -> tuple[int, int]:
    return info.st_dev, info.st_ino


def _exists(name: str, descriptor: int) -> bool:
    try:
        os.stat(name, dir_fd=descriptor, follow_symlinks=False)
    except OSError:
        return False
    return True


def _kind(mode: int) -> str:
    return "a link, which is not followed" if stat.S_ISLNK(mode) else "a device, pipe or socket, not a plain file"


def _copy_all(sources: Sequence[tuple[str, Path]], into: Path, where: str, left: _Left) -> Staged:
    """Copy files, given as relative name and place, and digest them in the order given."""
    digest = hashlib.sha256()
    copied: list[str] = []
    total = 0
    for relative, source in sources:
        content = _content(source, relative, left)
        if content is None:
            continue
        total += len(content)
        if total > MAX_TOTAL_BYTES:
            raise _too_much(where, f"{MAX_TOTAL_BYTES >> 20} MiB in all")
        _write(into / relative, content)
        # Lengths first: without them, two different sets of files could give the same bytes.
        for part in (os.fsencode(relative), content):
            digest.update(len(part).to_bytes(8, "big"))
            digest.update(part)
        copied.append(relative)
    return Staged(copied, f"sha256:{digest.hexdigest()}", left.notes())


def _content(path: Path, relative: str, left: _Left) -> bytes | None:
    """Return what a file holds, or None and a note if it cannot or must not be read."""
    try:
        with os.fdopen(os.open(path, _OPEN_FLAGS), "rb") as file:
            info = os.fstat(file.fileno())
            if not stat.S_ISREG(info.st_mode):
                left.add(_kind(info.st_mode), relative)
                return None
            content = file.read(MAX_FILE_BYTES + 1) if info.st_size <= MAX_FILE_BYTES else None
    except OSError as error:
        reason = _kind(stat.S_IFLNK) if error.errno == errno.ELOOP else f"it cannot be read: {error.strerror}"
        left.add(reason, relative)
        return None
    if content is None or len(content) > MAX_FILE_BYTES:
        left.add(f"larger than {MAX_FILE_BYTES >> 20} MiB", relative)
        return None
    return content


def _write(path: Path, content: bytes) -> None:
    """Write a staged file that everybody may read, whatever the umask: nodes run as another user."""
    try:
        missing = [parent for parent in path.parents if not parent.exists()]
        for parent in reversed(missing):
            parent.mkdir()
            parent.chmod(0o755)
        path.write_bytes(content)
        path.chmod(0o644)
    except OSError as error:
        raise HarnessError(f"the submission cannot be copied: {error.strerror}", "free some space") from None
