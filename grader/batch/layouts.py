"""How platforms name what they let instructors download: one regular expression each."""

from __future__ import annotations

import os.path
import re
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from grader.model.errors import ClassError
from grader.reading.quoting import listed, shown

#: Groups that a pattern may have; `file` makes several files of one student one submission.
GROUPS = ("name", "user", "email", "id", "late", "file")
FOLDERS, AUTO = "folders", "auto"
GITHUB, CLASSROOM50 = "github-classroom", "classroom50"
MOODLE, CANVAS = "moodle", "canvas"

PATTERNS: Mapping[str, str] = {
    MOODLE: r"(?P<name>.+?)_(?P<id>\d+)_assignsubmission_(?:file|onlinetext)(?:_(?P<file>.*))?",
    CANVAS: r"(?P<name>[^_]+)_(?:(?P<late>LATE)_)?(?P<id>\d+)_\d+_(?P<file>.+)",
}
#: All layouts that can be named.
LAYOUTS = (AUTO, FOLDERS, GITHUB, CLASSROOM50, MOODLE, CANVAS)
# Canvas puts a number behind the name of a file that was handed in again.
_HANDED_IN_AGAIN = re.compile(r"-\d+(?=\.[^.]+$)")
_FOLDER_OF_CLONES = re.compile(r"(?P<slug>.+)-submissions(?:-.*)?")


@dataclass(frozen=True, slots=True)
class Named:
    """What the name of a folder or file in a download says.

    Attributes:
        identity: Group -> what it matched.
        file: Name that the student's file had; empty if this is the whole submission.
        late: Whether the platform says that it came late.
        recognised: Whether the layout knows such names.
    """

    identity: Mapping[str, str]
    file: str = ""
    late: bool = False
    recognised: bool = True


@dataclass(frozen=True, slots=True)
class Layout:
    """How the entries of one download are named.

    Attributes:
        name: One of `LAYOUTS`, or `pattern`.
        pattern: What a name looks like; None where a name is simply that of the student.
        prefix: What comes before the user's name in the names of clones.
    """

    name: str
    pattern: re.Pattern[str] | None = None
    prefix: str = ""

    def read(self, label: str) -> Named:
        """Return what the name of a folder, or of a file with its ending, says."""
        if self.name == FOLDERS:
            return Named({})
        if self.pattern is None:
            known = bool(self.prefix) and label.startswith(self.prefix) and len(label) > len(self.prefix)
            return Named({"user": label[len(self.prefix) :]} if known else {}, recognised=known)
        match = self.pattern.fullmatch(label)
        if match is None:
            return Named({}, recognised=False)
        groups = {key: value for key, value in match.groupdict().items() if value}
        file = groups.pop("file", "")
        if self.name == CANVAS:
            file = _HANDED_IN_AGAIN.sub("", file)
        return Named({k: v for k, v in groups.items() if k != "late"}, file, late="late" in groups)


def layout_of(wanted: str, pattern: str, place: str, labels: Sequence[str]) -> Layout:
    """Return the layout of a download.

    Args:
        wanted: One of `LAYOUTS`.
        pattern: A regular expression of the user's own; empty if there is none. It goes before `wanted`.
        place: Name of the folder that everything lies in.
        labels: Names in it.

    Raises:
        ClassError: The regular expression cannot be used.
    """
    if pattern:
        return Layout("pattern", _compiled(pattern))
    if wanted in PATTERNS:
        return Layout(wanted, re.compile(PATTERNS[wanted], re.DOTALL))
    if wanted in (GITHUB, CLASSROOM50):
        return Layout(wanted, prefix=_slug(place, labels) or _common(labels))
    if wanted == FOLDERS:
        return Layout(FOLDERS)
    for name in (MOODLE, CANVAS):
        layout = layout_of(name, "", place, labels)
        if labels and sum(layout.read(label).recognised for label in labels) * 2 > len(labels):
            return layout
    slug = _slug(place, labels)
    return Layout(GITHUB, prefix=slug) if slug else Layout(FOLDERS)


def _compiled(pattern: str) -> re.Pattern[str]:
    try:
        compiled = re.compile(pattern, re.DOTALL)
    except re.error as error:
        where = f"--pattern, column {(error.pos or 0) + 1}"
        raise ClassError(f"{where}: expected a regular expression, found {shown(pattern)}: {error.msg}") from None
    odd = [group for group in compiled.groupindex if group not in GROUPS]
    if odd or not compiled.groupindex:
        found = f"the group {odd[0]}" if odd else "no named group"
        hint = r"for example --pattern '(?P<name>.+)_(?P<id>\d+)'"
        raise ClassError(f"--pattern: expected groups named {listed(GROUPS)}, found {found}", hint)
    return compiled


def _slug(place: str, labels: Sequence[str]) -> str:
    """Return `hello-` for a folder `hello-submissions` in which every name begins like that."""
    match = _FOLDER_OF_CLONES.fullmatch(place)
    prefix = f"{match['slug']}-" if match else ""
    return prefix if prefix and labels and all(label.startswith(prefix) for label in labels) else ""


def _common(labels: Sequence[str]) -> str:
    """Return what all names begin with, up to a hyphen."""
    if len(labels) < 2:
        return ""
    shared = os.path.commonprefix(list(labels))
    return shared[: shared.rfind("-") + 1]
