"""The files of a submission before they are written, and which names are allowed or skipped."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field, replace
from itertools import chain

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import (
    MAX_ARCHIVE_BYTES,
    MAX_BAG_BYTES,
    MAX_DEPTH,
    MAX_ENTRIES,
    MAX_FILE_BYTES,
    MAX_FILES,
    MAX_NAME_BYTES,
    MAX_PATH_BYTES,
    MAX_TOTAL_BYTES,
)
from grader.runtime.model.scenario import is_bag_file, wants_bag
from grader.runtime.model.wording import first_of, printable

#: Suffixes of archives; their content decides the kind.
ARCHIVE_SUFFIXES = (".zip", ".tar", ".gz", ".tgz", ".bz2", ".tbz2", ".xz", ".txz", ".zst", ".7z", ".rar")

#: A folder with one of these files was made by a tool: a virtual environment, or the output of `colcon build`.
GENERATED_MARKERS = ("pyvenv.cfg", "COLCON_IGNORE")


_BY_SYSTEMS = frozenset({"__pycache__", "__MACOSX"})
_SKIPPED_FOLDERS = _BY_SYSTEMS | {"venv", "node_modules"}
# Files that file managers create in every folder; macOS puts `._x` beside every file x of an archive.
#: The page that `grade --open` writes into the current folder, which may be that of the submission.
PAGE_NAME = "grade-report.html"
_SKIPPED_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini", PAGE_NAME})
_DRIVE = re.compile(r"[A-Za-z]:")
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³])\s*(\..*)?")
# Windows drops these at the end of a name, so that two names become one; other systems keep them.
_ENDS_ODDLY = re.compile(r"[ .]\Z")
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")

#: What no member of an archive may be called: programs that unpack it would not agree on where it lies.
_LEADING_ELSEWHERE: dict[str, Callable[[str], object]] = {
    "an absolute name": lambda path: path.startswith("/") or _DRIVE.match(path),
    "a name that leads out of the archive": lambda path: ".." in path.split("/"),
    "a name with a control character": lambda path: "\0" in path,
    "a name with an empty part": lambda path: not {"", "."}.isdisjoint(path.split("/")),
    "a name with a backslash": lambda path: "\\" in path,
}
#: What some system cannot keep. macOS calls the icon of a folder `Icon` and a carriage return.
_ODD: dict[str, Callable[[str], object]] = {
    "a name with a control character": _CONTROLS.search,
    "a name with a part that ends in a space or a dot": lambda path: any(map(_ENDS_ODDLY.search, path.split("/"))),
    "a name that Windows keeps for a device": lambda path: any(map(_RESERVED.fullmatch, path.split("/"))),
    "a name that is too long": lambda path: _bytes(path) > MAX_PATH_BYTES or _longest_part(path) > MAX_NAME_BYTES,
}


@dataclass(frozen=True, slots=True)
class SubmissionLimits:
    """The most that a submission may hold, as a folder or an archive; `grader.runtime.model.limits` has the reasons."""

    files: int = MAX_FILES
    entries: int = MAX_ENTRIES
    depth: int = MAX_DEPTH
    file_bytes: int = MAX_FILE_BYTES  # a larger file is left out with a note
    total_bytes: int = MAX_TOTAL_BYTES
    archive_bytes: int = MAX_ARCHIVE_BYTES
    bag_bytes: int = 0  # how much of recordings is read, besides all other files; 0 if nobody asks for any

    def most_of(self, name: str) -> int:
        """Return the most bytes of a file; a larger one is left out with a note."""
        return max(self.file_bytes, self.bag_bytes) if is_bag_file(name) else self.file_bytes

    @property
    def whole_bytes(self) -> int:
        """The most bytes of all files together."""
        return self.total_bytes + self.bag_bytes

    @property
    def packed_bytes(self) -> int:
        """The most bytes of an archive."""
        return self.archive_bytes + self.bag_bytes


#: The limits of every submission.
USUAL = SubmissionLimits()
#: Those of a submission that may have recordings.
_WITH_BAGS = replace(USUAL, bag_bytes=MAX_BAG_BYTES)


def limits_for(wanted: Iterable[str]) -> SubmissionLimits:
    """Return the limits of a submission that is to have these files."""
    return _WITH_BAGS if wants_bag(wanted) else USUAL


def is_skipped_folder(name: str) -> bool:
    """Return whether a folder of this name is skipped: caches, environments, version control."""
    return name in _SKIPPED_FOLDERS or name.startswith(".")


def is_skipped_file(name: str) -> bool:
    """Return whether an operating system or the grader created a file of this name."""
    return name in _SKIPPED_FILES or name.startswith("._")


def why_skipped(name: str, *, is_folder: bool) -> str:
    """Return why a submission of this name would be skipped, as a phrase.

    Empty if it would not be, or if a system or interpreter created it: then nobody expects it to be found.
    """
    if is_skipped_file(name) or (is_folder and name in _BY_SYSTEMS):
        return ""
    if name.startswith("."):
        return "its name begins with a dot"
    return "its name is that of a tool's folder" if is_folder and is_skipped_folder(name) else ""


def is_skipped(path: str) -> bool:
    """Return whether a relative path, with `/`, is or lies in something that is skipped."""
    *folders, name = path.split("/")
    return is_skipped_file(name) or any(map(is_skipped_folder, folders))


def generated_folders(paths: Iterable[str]) -> dict[str, str]:
    """Return the folders made by a tool, as path -> marker file; never the top folder."""
    found: dict[str, str] = {}
    for path in paths:
        folder, _, name = path.rpartition("/")
        if folder and name in GENERATED_MARKERS:
            known = found.get(folder, name)
            found[folder] = min(known, name, key=GENERATED_MARKERS.index)
    return found


def folders_of(path: str) -> Iterator[str]:
    """Yield the parent folders of a path, the outermost first."""
    at = path.find("/")
    while at >= 0:
        yield path[:at]
        at = path.find("/", at + 1)


def name_problem(path: str) -> str:
    """Describe what is wrong with the name of an archive member, as a phrase; empty if nothing is."""
    wrong = _LEADING_ELSEWHERE.items(), _ODD.items()
    return next((phrase for phrase, is_wrong in chain(*wrong) if is_wrong(path)), "")


def may_be_left_out(path: str) -> bool:
    """Return whether an archive member whose name is wrong may be left out: it is nothing that may be graded.

    A name that means another place to some program that unpacks it refuses the archive, whatever the member is.
    """
    return not (any(is_wrong(path) for is_wrong in _LEADING_ELSEWHERE.values()) or is_gradable(path))


def is_gradable(name: str) -> bool:
    """Return whether a file may hold what is graded: a program, or an archive of some, as Windows would name it."""
    return name.casefold().rstrip(" .").endswith((".py", *ARCHIVE_SUFFIXES))


def collisions(files: Sequence[str]) -> Iterator[tuple[int, str, str]]:
    """Yield the index of each name that cannot exist beside an earlier one on some system, and the two that collide.

    These are duplicate names, names that differ only in case or in Unicode composition, and a file where another path
    needs a folder.
    """
    kept: dict[str, tuple[str, bool]] = {}
    for index, path in enumerate(files):
        if _folded(path) in kept:
            yield index, kept[_folded(path)][0], path
            continue
        for folder in folders_of(path):
            other, is_file = kept.setdefault(_folded(folder), (folder, False))
            if is_file or other != folder:
                yield index, other, folder
                break
        else:
            kept[_folded(path)] = (path, True)


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _bytes(name: str) -> int:
    return len(os.fsencode(name))


def _longest_part(path: str) -> int:
    return max(map(_bytes, path.split("/")))


@dataclass(frozen=True, slots=True)
class Collected:
    """Files that were read, not yet written."""

    # Relative POSIX path and content; every path stays inside, and paths are unique
    files: tuple[tuple[str, bytes], ...]
    notes: tuple[str, ...] = ()  # sentences about skipped files
    too_large: tuple[str, ...] = ()  # the paths of recordings that were skipped for their size


def largest_of(files: Iterable[tuple[str, bytes]]) -> str:
    """Describe the largest of some files, for somebody who has handed in too much."""
    name, content = max(files, key=lambda file: len(file[1]))
    return f"the largest file is {printable(name, 80)}, {len(content) / (1 << 20):.1f} MiB"


@dataclass(slots=True)
class LeftOut:
    """Names of skipped files and folders, by reason."""

    by_reason: dict[str, dict[str, None]] = field(default_factory=dict)
    too_large: dict[str, None] = field(default_factory=dict)  # recordings

    def add(self, reason: str, relative: str) -> None:
        """Record a skipped path once."""
        self.by_reason.setdefault(reason, {})[relative] = None

    def add_large(self, relative: str, most: int) -> None:
        """Record a file that was skipped because it has more than `most` bytes."""
        self.add(f"larger than {most >> 20} MiB", relative)
        if is_bag_file(relative):
            self.too_large[relative] = None

    def notes(self) -> tuple[str, ...]:
        """Return one sentence per reason, in an order that does not depend on the file system."""
        items = sorted(self.by_reason.items())
        return tuple(f"not copied: {first_of(sorted(names, key=os.fsencode))} ({reason})" for reason, names in items)
