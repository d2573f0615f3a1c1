"""Names inside a submission: which are passed over, and which an archive may not hold."""

from __future__ import annotations

import os
import re
import unicodedata
from collections.abc import Callable, Iterable, Iterator

#: A folder that holds one of these was made by a tool: a virtual environment, or what `colcon build` left behind.
GENERATED_MARKERS = ("pyvenv.cfg", "COLCON_IGNORE")

#: Longest path inside a submission: the system refuses longer ones once the staging folder stands before it.
MAX_PATH_BYTES = 2_000

#: Longest name of one file or folder that Linux can hold.
MAX_NAME_BYTES = 255

_BY_SYSTEMS = frozenset({"__pycache__", "__MACOSX"})
_SKIPPED_FOLDERS = _BY_SYSTEMS | {"venv", "node_modules"}
# What file managers leave in every folder; `._x` is what macOS puts beside every file x in an archive.
_SKIPPED_FILES = frozenset({".DS_Store", "Thumbs.db", "desktop.ini"})
_DRIVE = re.compile(r"[A-Za-z]:")
_RESERVED = re.compile(r"(?i)(con|prn|aux|nul|conin\$|conout\$|(com|lpt)[0-9¹²³])\s*(\..*)?")
# Windows drops these, so that two names become one; other systems keep them.
_ENDS_ODDLY = re.compile(r"[ .]\Z")
_CONTROLS = re.compile("[\x00-\x1f\x7f-\x9f\u2028\u2029]")

_OBJECTIONS: dict[str, Callable[[str], object]] = {
    "an absolute name": lambda path: path.startswith("/") or _DRIVE.match(path),
    "a name that leads out of the archive": lambda path: ".." in path.split("/"),
    "a name with a control character": _CONTROLS.search,
    "a name with an empty part": lambda path: not {"", "."}.isdisjoint(path.split("/")),
    "a name with a backslash": lambda path: "\\" in path,
    "a name with a part that ends in a blank or a dot": lambda path: any(map(_ENDS_ODDLY.search, path.split("/"))),
    "a name that Windows keeps for a device": lambda path: any(map(_RESERVED.fullmatch, path.split("/"))),
    "a name that is too long": lambda path: _bytes(path) > MAX_PATH_BYTES or _longest_part(path) > MAX_NAME_BYTES,
}


def passed_over_folder(name: str) -> bool:
    """Return whether a folder of this name is no work of the student: caches, environments, version control."""
    return name in _SKIPPED_FOLDERS or name.startswith(".")


def passed_over_file(name: str) -> bool:
    """Return whether a file of this name was put there by an operating system."""
    return name in _SKIPPED_FILES or name.startswith("._")


def unnoticed(name: str, *, is_folder: bool) -> str:
    """Return why a submission of this name would be passed over, as a phrase.

    Empty if it would not be, or if a system or interpreter has put it there: then nobody looks for it.
    """
    if passed_over_file(name) or (is_folder and name in _BY_SYSTEMS):
        return ""
    if name.startswith("."):
        return "its name begins with a dot"
    return "its name is that of a tool's folder" if is_folder and passed_over_folder(name) else ""


def passed_over(path: str) -> bool:
    """Return whether a path, relative and with `/`, is or lies in something that is passed over."""
    *folders, name = path.split("/")
    return passed_over_file(name) or any(map(passed_over_folder, folders))


def generated_folders(paths: Iterable[str]) -> dict[str, str]:
    """Return the folders made by a tool, as path -> marker; never the whole submission."""
    found: dict[str, str] = {}
    for path in paths:
        folder, _, name = path.rpartition("/")
        if folder and name in GENERATED_MARKERS:
            known = found.get(folder, name)
            found[folder] = min(known, name, key=GENERATED_MARKERS.index)
    return found


def folders_of(path: str) -> Iterator[str]:
    """Yield the folders that a path lies in, the outermost first."""
    at = path.find("/")
    while at >= 0:
        yield path[:at]
        at = path.find("/", at + 1)


def objection(path: str) -> str:
    """Return what is wrong with the name of a member of an archive, as a phrase; empty if nothing is."""
    return next((phrase for phrase, is_wrong in _OBJECTIONS.items() if is_wrong(path)), "")


def collision(files: Iterable[str]) -> tuple[str, str] | None:
    """Return two names of which some system could keep only one, or None.

    Two files of one name, names that differ only in case or in how letters are composed, and a file where another
    needs a folder.
    """
    kept: dict[str, tuple[str, bool]] = {}
    for path in files:
        if _folded(path) in kept:
            return kept[_folded(path)][0], path
        kept[_folded(path)] = (path, True)
        for folder in folders_of(path):
            other, is_file = kept.setdefault(_folded(folder), (folder, False))
            if is_file or other != folder:
                return other, folder
    return None


def _folded(name: str) -> str:
    return unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())


def _bytes(name: str) -> int:
    return len(os.fsencode(name))


def _longest_part(path: str) -> int:
    return max(map(_bytes, path.split("/")))
