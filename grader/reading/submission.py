"""Takes in what a student handed in: a staged copy, and which file of it belongs to which process."""

from __future__ import annotations

import difflib
import os
import re
import stat
import unicodedata
from collections.abc import Iterable, Sequence
from pathlib import Path, PurePosixPath

from grader.model.errors import SubmissionError
from grader.model.submission import StudentFile, Submission
from grader.reading.quoting import listed, shown
from grader.reading.staging import Staged, stage_file, stage_folder

#: Names at least this alike are shown as a possible misspelling.
SIMILARITY = 0.8

#: Misspelt names shown for one file.
MAX_SIMILAR = 3

_ARCHIVES = (".zip", ".tar", ".gz", ".tgz", ".bz2", ".xz", ".txz", ".zst", ".7z", ".rar")

# What browsers, editors and file managers put behind a name: `x(1).py`, `x - Copy.py`, `x.py.txt`.
_EXTENSIONS = re.compile(r"(?:\.(?:txt|bak|orig|old|save|py))+$")
_COPY_MARK = re.compile(r"[\s_-]*(?:\(\d+\)|copy|copia|kopie)\s*\d*$")


def stage_submission(path: str, wanted: Sequence[str], into: Path) -> Submission:
    """Copy a submission and find the wanted files in it.

    Args:
        path: A folder or one .py file, as the user typed it.
        wanted: File names of all exercises being graded.
        into: Empty folder of the caller's, which receives the copy.

    Returns:
        The submission; a file that is not there has `found` None and names that look like it.

    Raises:
        SubmissionError: No such path, not a folder or a .py file, no .py file inside, or a limit is exceeded.
        HarnessError: The copy cannot be written.
    """
    where = shown(path, 500)
    source = Path(path)
    if stat.S_ISDIR(_mode(path, where)):
        staged = stage_folder(source, into, where=where)
        _expect_python(staged, wanted, where)
    else:
        _expect_python_file(source, where)
        staged = stage_file(source, into, where=where)
    files = {name: _look_for(name, staged.files, wanted) for name in wanted}
    several = tuple(_several(file) for file in files.values() if file.others)
    return Submission(
        name=_name(source),
        path=path,
        root=into,
        digest=staged.digest,
        files=files,
        notes=(*several, *staged.notes),
    )


def _mode(path: str, where: str) -> int:
    if not path:
        raise SubmissionError("expected a folder or a .py file, found an empty path", "use . for this folder")
    try:
        return os.stat(path).st_mode  # noqa: PTH116 - a Path would change what was typed, e.g. `x.py/`
    except (FileNotFoundError, NotADirectoryError):
        text = f"{where}: expected a folder or a .py file, found nothing there"
        raise SubmissionError(text, "check the path, and the folder you are in") from None
    except OSError as error:
        raise SubmissionError(f"{where}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise SubmissionError(f"{where}: expected a path, found one that no file can have") from None


def _expect_python_file(source: Path, where: str) -> None:
    if not source.is_file():
        raise SubmissionError(f"{where}: expected a folder or a .py file, found a device, pipe or socket")
    if source.suffix.casefold() in _ARCHIVES:
        text = f"{where}: expected a folder or a .py file, found an archive, which this version cannot read"
        raise SubmissionError(text, "unpack it and name the folder")
    if source.suffix.casefold() != ".py":
        raise SubmissionError(f"{where}: expected a folder or a .py file, found another kind of file")


def _expect_python(staged: Staged, wanted: Sequence[str], where: str) -> None:
    if any(name.casefold().endswith(".py") for name in staged.files):
        return
    archives = [name for name in staged.files if name.casefold().endswith(_ARCHIVES)]
    similar = [name for want in wanted for name in _similar(want, staged.files, wanted)]
    hint = ""
    if similar:
        hint = f"rename {shown(similar[0])} so that it ends in .py"
    elif archives:
        hint = f"unpack {shown(archives[0])} and name the folder that holds your files"
    elif staged.notes:
        hint = staged.notes[0]
    raise SubmissionError(f"{where}: expected at least one .py file, found none", hint)


def _name(source: Path) -> str:
    """Return the name a report shows: the last part of the path, also for `.` and `..`."""
    return source.name if source.name not in ("", "..") else source.resolve().name or "/"


def _look_for(wanted: str, files: Iterable[str], all_wanted: Sequence[str]) -> StudentFile:
    files = list(files)
    exact = sorted((f for f in files if PurePosixPath(f).name == wanted), key=_nearest_the_top)
    if exact:
        return StudentFile(wanted, exact[0], others=tuple(exact[1:]))
    return StudentFile(wanted, None, similar=tuple(_similar(wanted, files, all_wanted)))


def _nearest_the_top(relative: str) -> tuple[int, bytes]:
    return relative.count("/"), os.fsencode(relative)


def _several(file: StudentFile) -> str:
    others = [shown(name) for name in file.others[:3]]
    more = [f"{len(file.others) - 3} more"] if len(file.others) > 3 else []
    return f"{shown(file.found or '')} is graded, nearest the top; not graded: {listed([*others, *more], 'and')}"


def _similar(wanted: str, files: Iterable[str], all_wanted: Sequence[str]) -> list[str]:
    """Return files that look like a misspelling of a wanted name, nearest first."""
    plain = _plain(wanted)
    ranked = []
    for relative in files:
        name = PurePosixPath(relative).name
        if name in all_wanted or len(name) > 2 * len(wanted) + 20 or not _may_be_python(name):
            continue
        likeness = _likeness(_plain(name), plain)
        if likeness >= SIMILARITY:
            ranked.append((-likeness, _nearest_the_top(relative), relative))
    return [relative for _, _, relative in sorted(ranked)[:MAX_SIMILAR]]


def _may_be_python(name: str) -> bool:
    folded = name.casefold()
    return "." not in folded or _EXTENSIONS.search(folded) is not None


def _plain(name: str) -> str:
    """Return a file name without what people vary: case, separators, copy marks, extensions."""
    stem = _EXTENSIONS.sub("", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "", _COPY_MARK.sub("", stem))


def _likeness(one: str, other: str) -> float:
    matcher = difflib.SequenceMatcher(None, one, other, autojunk=False)
    if matcher.real_quick_ratio() < SIMILARITY or matcher.quick_ratio() < SIMILARITY:
        return 0.0
    return matcher.ratio()
