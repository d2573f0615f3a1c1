"""Reads the files of a submitted folder, without changing it, and writes staged copies."""

from __future__ import annotations

import errno
import hashlib
import os
import stat
from collections.abc import Iterator
from itertools import islice
from pathlib import Path

from grader.grading.submissions.collected import (
    GENERATED_MARKERS,
    USUAL,
    Collected,
    LeftOut,
    SubmissionLimits,
    is_skipped_file,
    is_skipped_folder,
    largest_of,
)
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError, SubmissionError
from grader.runtime.model.limits import MAX_PATH_BYTES

_OPEN_FLAGS = os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK | os.O_CLOEXEC


def collect_folder(folder: Path, *, into: Path, where: str, limits: SubmissionLimits = USUAL) -> Collected:
    """Read the files of a student's folder, in the order of their names' bytes.

    Links, devices, sockets, pipes and unreadable files are left out with a note. `into`, the destination of the copy,
    is not part of the submission. Raises SubmissionError if the folder cannot be listed, or a limit is exceeded.
    """
    left = LeftOut()
    walk = _Walk(where=where, left=left, own=into.stat(), limits=limits)
    try:
        top = os.open(folder, os.O_RDONLY | os.O_DIRECTORY | os.O_CLOEXEC)
    except OSError as error:
        raise SubmissionError(f"{where}: the folder cannot be read: {error.strerror}") from None
    try:
        files = []
        total = 0
        for relative in sorted(walk.files(top), key=os.fsencode):
            content = _content(top, relative, left, limits.most_of(relative))
            if content is not None:
                total += len(content)
                files.append((relative, content))
                if total > limits.whole_bytes:
                    raise _too_much(where, f"{limits.whole_bytes >> 20} MiB in all", largest_of(files))
    finally:
        os.close(top)
    return Collected(tuple(files), left.notes(), tuple(left.too_large))


def read_start(file: Path, most: int, *, where: str) -> bytes:
    """Return at most `most` bytes from the start of a regular file, or of a link to one; raises SubmissionError."""
    try:
        with os.fdopen(os.open(file, _OPEN_FLAGS & ~os.O_NOFOLLOW), "rb") as opened:
            if not stat.S_ISREG(os.fstat(opened.fileno()).st_mode):
                raise SubmissionError(f"{where}: expected a plain file, found a device, pipe or socket")
            return opened.read(most)
    except OSError as error:
        raise SubmissionError(f"{where}: the file cannot be read: {error.strerror}") from None


def write_files(collected: Collected, into: Path) -> str:
    """Write the files that were read into an empty folder, readable by everybody, in the same layout.

    Returns their digest: `sha256:` and 64 hex digits over names and contents. Raises HarnessError.
    """
    digest = hashlib.sha256()
    for relative, content in sorted(collected.files, key=lambda file: os.fsencode(file[0])):
        _write(into / relative, content)
        # Lengths come first: without them, two different sets of files could produce the same bytes.
        for part in (os.fsencode(relative), content):
            digest.update(len(part).to_bytes(8, "big"))
            digest.update(part)
    return f"sha256:{digest.hexdigest()}"


@dataclass(slots=True)
class _Walk:
    """Lists a folder by file descriptors, because paths may be longer than the system allows."""

    where: str
    left: LeftOut
    own: os.stat_result
    limits: SubmissionLimits
    entries: int = 0
    found: int = 0

    def files(self, descriptor: int, prefix: str = "", depth: int = 0) -> Iterator[str]:
        """Yield the relative paths of regular files, in no particular order."""
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
            names = [entry.name for entry in islice(entries, self.limits.entries + 1 - self.entries)]
        self.entries += len(names)
        if self.entries > self.limits.entries:
            raise _too_much(self.where, f"{self.limits.entries} entries")
        return names

    def _file(self, relative: str, name: str) -> Iterator[str]:
        if is_skipped_file(name):
            return
        if len(os.fsencode(relative)) > MAX_PATH_BYTES:
            self.left.add("the path is too long", relative)
            return
        self.found += 1
        if self.found > self.limits.files:
            raise _too_much(self.where, f"{self.limits.files} files")
        yield relative

    def _folder(self, parent: int, name: str, relative: str, depth: int, info: os.stat_result) -> Iterator[str]:
        if is_skipped_folder(name) or os.path.samestat(info, self.own):
            return
        if depth > self.limits.depth:
            raise _too_much(self.where, f"{self.limits.depth} folders inside each other")
        try:
            descriptor = os.open(name, _OPEN_FLAGS | os.O_DIRECTORY, dir_fd=parent)
        except OSError as error:
            self.left.add(f"the folder cannot be read: {error.strerror}", relative)
            return
        try:
            marker = next((m for m in GENERATED_MARKERS if _holds(descriptor, m)), None)
            if marker is None:
                yield from self.files(descriptor, f"{relative}/", depth)
            else:
                self.left.add(f"it holds {marker}, so a tool made it", relative)
        finally:
            os.close(descriptor)


def _too_much(where: str, limit: str, remark: str = "") -> SubmissionError:
    hint = "name the folder that holds only your work"
    found = f"found more; {remark}" if remark else "found more"
    return SubmissionError(f"{where}: expected at most {limit}, {found}", hint)


def _holds(descriptor: int, name: str) -> bool:
    """Return whether a folder holds a file, or a link, of a name."""
    return os.access(name, os.F_OK, dir_fd=descriptor, follow_symlinks=False)


def _kind(mode: int) -> str:
    return "a link, which is not followed" if stat.S_ISLNK(mode) else "a device, pipe or socket, not a plain file"


def _content(top: int, relative: str, left: LeftOut, most: int) -> bytes | None:
    """Return the content of a file, or None and a note if it cannot or must not be read."""
    try:
        with os.fdopen(_opened(top, relative), "rb") as file:
            info = os.fstat(file.fileno())
            if not stat.S_ISREG(info.st_mode):
                left.add(_kind(info.st_mode), relative)
                return None
            content = file.read(most + 1) if info.st_size <= most else None
    except OSError as error:
        reason = _kind(stat.S_IFLNK) if error.errno == errno.ELOOP else f"it cannot be read: {error.strerror}"
        left.add(reason, relative)
        return None
    if content is None or len(content) > most:
        left.add_large(relative, most)
        return None
    return content


def _opened(top: int, relative: str) -> int:
    """Open a file below a folder without following links, including those created after the listing."""
    *folders, name = relative.split("/")
    here = os.dup(top)
    try:
        for folder in folders:
            inner = os.open(folder, _OPEN_FLAGS | os.O_DIRECTORY, dir_fd=here)
            os.close(here)
            here = inner
        return os.open(name, _OPEN_FLAGS, dir_fd=here)
    finally:
        os.close(here)


def _write(path: Path, content: bytes) -> None:
    """Write a staged file readable by everybody, whatever the umask: nodes run as another user."""
    try:
        missing = [parent for parent in path.parents if not parent.exists()]
        for parent in reversed(missing):
            parent.mkdir()
            parent.chmod(0o755)
        path.write_bytes(content)
        path.chmod(0o644)
    except OSError as error:
        raise HarnessError(f"the submission cannot be copied: {error.strerror}", "free some space") from None
