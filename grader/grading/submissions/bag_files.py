"""Finds the recording of a submission that a rubric asks for, by the names of files alone."""

from __future__ import annotations

import fnmatch
from collections.abc import Iterable, Iterator, Sequence
from pathlib import PurePosixPath

from grader.grading.submissions.bag_words import SMALLER
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import BAG_COMPRESSED, is_bag_file
from grader.runtime.model.submission import StudentFile
from grader.runtime.model.wording import first_of, listed, printable
from grader.runtime.recording.bag import HINT_ROS_1, METADATA

#: What to hand in, for a student who has handed in none.
_ONE = "hand in one recording{}, as `ros2 bag record{}` makes it: its folder, or its {} file"
#: How a pattern ends that one kind of storage alone fits, and the name that `ros2 bag record` has for this kind.
_STORAGES = {".mcap": "mcap", ".db3": "sqlite3"}
#: The most other recordings that a missing one is told with.
_MOST_OTHERS = 12


@dataclass(frozen=True, slots=True)
class FoundBag:
    """A recording of a submission.

    Attributes:
        path: Its folder, or its only file, relative to the submission; `.` for the submission itself.
        files: The paths of its files, `metadata.yaml` first if it has one.
    """

    path: str
    files: tuple[str, ...]

    @property
    def shown(self) -> str:
        """What messages call it: its path, or the name of a file if the submission itself is the recording."""
        return self.path if self.path != "." else self.files[-1]

    @property
    def names(self) -> Iterator[str]:
        """The names that a pattern may stand for: those of its folder and of its files."""
        for name in (PurePosixPath(file).name for file in self.files if is_bag_file(file)):
            yield from (name, name.removesuffix(BAG_COMPRESSED))
        yield PurePosixPath(self.path).name


def bags_in(files: Iterable[str]) -> tuple[FoundBag, ...]:
    """Return the recordings among some paths, sorted: folders with a metadata.yaml, and single files elsewhere."""
    by_folder: dict[str, list[str]] = {}
    for file in sorted(files):
        by_folder.setdefault(str(PurePosixPath(file).parent), []).append(file)
    found = []
    for folder, inside in by_folder.items():
        recorded = [file for file in inside if is_bag_file(file)]
        metadata = [file for file in inside if PurePosixPath(file).name == METADATA]
        if recorded and metadata:
            found.append(FoundBag(folder, (*metadata, *recorded)))
        else:
            found += [FoundBag(file, (file,)) for file in recorded]
    return tuple(sorted(found, key=lambda bag: bag.path))


def find_bag(pattern: str, files: Sequence[str], too_large: Sequence[str] = ()) -> StudentFile:
    """Return the recording that a pattern stands for; the file has a problem if there is none, or several.

    Args:
        pattern: The name of a file or folder, where `*` stands for any characters; capitals do not matter.
        files: The paths of the submission.
        too_large: Those of recordings that were not copied.
    """
    bags = bags_in(files)
    fitting = [bag for bag in bags if _fits(pattern, bag)]
    if len(fitting) == 1:
        return StudentFile(pattern, fitting[0].path)
    if fitting:
        names = listed([printable(bag.shown, 80) for bag in fitting[:_MOST_OTHERS]], "and")
        problem = f"expected one recording, found {len(fitting)}: {names}"
        return StudentFile(pattern, None, problem=problem, hint="hand in the one that is to be graded, and no other")
    dropped = [file for bag in bags_in(too_large) if _fits(pattern, bag) for file in bag.files]
    if dropped:
        return StudentFile(pattern, None, problem=f"{first_of(dropped)} is too large to be read", hint=SMALLER)
    if not bags and (old := [file for file in files if file.casefold().endswith(".bag")]):
        return StudentFile(pattern, None, problem=f"{first_of(old)} is a recording of ROS 1", hint=HINT_ROS_1)
    others = tuple(bag.shown for bag in bags[:_MOST_OTHERS])
    return StudentFile(pattern, None, candidates=others, hint=_hint(pattern))


def _hint(pattern: str) -> str:
    """Return what to hand in, for a student who has handed in no recording that fits."""
    named = "" if pattern == "*" else f" named {pattern}"
    for ending, storage in _STORAGES.items():
        if pattern.casefold().endswith(ending):
            return _ONE.format(named, f" --storage {storage}", ending)
    return _ONE.format(named, "", ".mcap or .db3")


def _fits(pattern: str, bag: FoundBag) -> bool:
    return any(fnmatch.fnmatchcase(name.casefold(), pattern.casefold()) for name in bag.names)
