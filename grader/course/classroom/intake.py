"""Finds the submissions of a class in folders and downloads, and gives each a unique safe name."""

from __future__ import annotations

import filecmp
import hashlib
import itertools
import os
import re
import shutil
import unicodedata
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import field
from functools import partial
from pathlib import Path

from grader.course.classroom.downloads import (
    AUTO,
    FOLDERS,
    MOODLE,
    PATTERNS,
    DownloadLayout,
    Named,
    download_layout,
    unpack_download,
    write_without_content,
)
from grader.grading.submissions.collected import (
    ARCHIVE_SUFFIXES,
    USUAL,
    SubmissionLimits,
    is_gradable,
    is_skipped_file,
    is_skipped_folder,
    limits_for,
    name_problem,
    why_skipped,
)
from grader.grading.submissions.submission import read_start
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, HarnessError, SubmissionError
from grader.runtime.model.wording import printable

#: Longest name, in bytes of UTF-8, not counting the suffix that makes it unique.
MAX_BYTES = 80
_RESERVED = re.compile(r"(con|prn|aux|nul|com\d|lpt\d)(\..*)?")
_KEPT = frozenset("._@+-")


def safe_name(text: str) -> str:
    """Make text usable as one path component on any system: letters, digits and `._@+-`, lower case, never empty."""
    plain = unicodedata.normalize("NFKC", text).casefold()
    slug = "".join(c if c.isalnum() or c in _KEPT else "-" for c in unicodedata.normalize("NFC", plain))
    slug = re.sub(r"-{2,}", "-", slug).strip("-. ")
    slug = slug.encode("utf-8", "ignore")[:MAX_BYTES].decode("utf-8", "ignore").strip("-. ")
    if not slug or _RESERVED.fullmatch(slug):
        return f"{slug or 'unnamed'}-{_mark(text)}"
    return slug


def distinct_names(wishes: Sequence[tuple[str, str]]) -> list[str]:
    """Return a unique safe name for each wish, independent of their order.

    A wish is the preferred name and a unique text, such as the path in the download. If several wish for the same name,
    each gets a suffix derived from its unique text.
    """
    names = [safe_name(wish) for wish, _ in wishes]
    count = Counter(names)
    return [name if count[name] == 1 else f"{name}-{_mark(own)}" for name, (_, own) in zip(names, wishes, strict=True)]


def _mark(text: str) -> str:
    return hashlib.sha256(text.encode("utf-8", "surrogatepass")).hexdigest()[:6]


#: What makes a folder one with the results of a class.
_OF_RESULTS = ("class.yaml", "students", "assets")
_TWO_WAYS = "its name can be read in two ways, so it is in nobody's submission"


@dataclass(frozen=True, slots=True)
class HandedInEntry:
    """One submission of a class."""

    name: str  # unique and safe in paths; also the name of its results folder
    label: str  # its name in the source
    path: Path  # the folder or file to grade
    # What its name tells about the student: `user`, `id`, `email`, `name`
    identity: Mapping[str, str] = field(default_factory=dict)
    late: bool = False  # whether the platform marked it as late
    recognised: bool = True  # whether its name fits the layout
    problem: str = ""  # why it cannot be graded at all; empty if it can
    # The name without the suffix that makes it unique: that which it has in a class without others of this name
    base: str = ""
    layout: str = FOLDERS  # of the download that it is in; one of those in `downloads`


@dataclass(frozen=True, slots=True)
class Intake:
    """The submissions found in the sources."""

    entries: tuple[HandedInEntry, ...]  # the submissions, ordered by name
    layouts: tuple[tuple[str, str], ...]  # each source with its layout, as text
    strays: tuple[str, ...] = ()  # entries that are not submissions, with the reason; one line each


_FOLDERS = DownloadLayout(FOLDERS)


@dataclass(slots=True)
class _Found:
    """A submission before it gets its unique name; it may consist of several files."""

    own: str
    label: str
    wish: str
    path: Path
    named: Named
    problem: str = ""
    layout: DownloadLayout = _FOLDERS
    files: list[tuple[str, Path]] = field(default_factory=list)


_ByStudent = dict[tuple[str, ...], _Found]


def take_in(
    sources: Sequence[Path], results: Path, *, layout: str = AUTO, pattern: str = "", wanted: Collection[str] = ()
) -> Intake:
    """Find all submissions in folders and downloads, which are unpacked in the results folder.

    A regular expression for names overrides the layout. Wanted are the names of the files that exercises ask for.
    Raises ClassError if a source cannot be used, or has no submissions.
    """
    found: list[_Found] = []
    strays: list[str] = []
    layouts: list[tuple[str, str]] = []
    sources = list(_each_once(sources, strays))
    called = distinct_names([(source.resolve().name, str(source)) for source in sources])
    for source, own in zip(sources, called, strict=True):
        top, refused = _opened(source, results / "unpacked" / own, strays, limits_for(wanted))
        children = [child for child in _children(top, strays) if child.resolve() != results.resolve()]
        used = _layout(children, top, layout, pattern)
        here = _submissions(children, own, used, strays)
        for name, problem in refused.items():
            _refuse(here, top / name, own, used, problem)
        layouts.append((str(source), used.name))
        found += here.values()
        if not here:
            hint = "name the folder that holds one folder or archive for each student"
            raise ClassError(f"{source}: expected submissions, found none", hint)
    names = distinct_names([(one.wish, one.own) for one in found])
    entries = [_entry(one, name, results, wanted, strays) for one, name in zip(found, names, strict=True)]
    return Intake(tuple(sorted(entries, key=lambda entry: entry.name)), tuple(layouts), tuple(strays))


def check_places(sources: Sequence[Path], results: Path) -> None:
    """Raise ClassError if results would be written among submissions, or submissions are read from the results."""
    place = results.resolve()
    for source in sources:
        top = source.resolve()
        if not source.is_dir():
            continue
        if top == place or (top in place.parents and place.parent != top):
            hint = f"name a folder beside the submissions, for example -o {printable(str(source), 200)}-results"
            raise ClassError(f"{results}: expected a folder for results, found that it is among the submissions", hint)
        if any(top.is_relative_to(place / name) for name in ("students", "unpacked", "assets")):
            hint = "name the folder or the download that the submissions come from"
            raise ClassError(f"{source}: expected submissions, found a part of the results", hint)


def _each_once(sources: Sequence[Path], strays: list[str]) -> Iterator[Path]:
    """Yield each source once; the same folder again, and the same download under another name, become strays."""
    kept: list[Path] = []
    for source in sources:
        same = next((other for other in kept if _is_same(source, other)), None)
        if same is None:
            kept.append(source)
            yield source
        else:
            which = "" if str(same) == str(source) else f", first as {printable(str(same), 200)}"
            strays.append(f"{printable(str(source), 200)}: given twice{which}, so it is counted once")


def _is_same(source: Path, other: Path) -> bool:
    if source.resolve() == other.resolve():
        return True
    if not source.is_file() or not other.is_file():
        return False
    try:
        return filecmp.cmp(source, other, shallow=False)
    except OSError:  # what cannot be read is reported when it is opened
        return False


def _opened(source: Path, into: Path, strays: list[str], limits: SubmissionLimits) -> tuple[Path, Mapping[str, str]]:
    """Return the folder with the submissions of a source, and the entries that were refused."""
    if source.is_dir():
        return source, {}
    if not source.is_file():
        raise ClassError(f"{source}: expected a folder of submissions or a download, found nothing there")
    unpacked = unpack_download(source, into, limits)
    strays += [f"{source}: {stray}" for stray in unpacked.strays]
    return unpacked.folder, unpacked.refused


def _layout(children: Sequence[Path], top: Path, wanted: str, pattern: str) -> DownloadLayout:
    """Determine the layout of a folder; plain files count only if there are no folders or archives."""
    names = [child.name for child in children if child.is_dir() or _is_archive(child)]
    return download_layout(wanted, pattern, top.resolve().name, names or [child.name for child in children])


def _submissions(children: Sequence[Path], own: str, layout: DownloadLayout, strays: list[str]) -> _ByStudent:
    found: _ByStudent = {}
    doubtful: list[tuple[tuple[str, ...], _Found]] = []
    for child in children:
        if child.is_symlink():
            strays.append(f"{printable(str(child), 200)}: a link, which is not followed")
            continue
        named, label = _read(layout, child)
        if not child.is_dir() and not _is_archive(child) and not named.file:
            strays.append(f"{printable(str(child), 200)}: neither a folder nor an archive")
            continue
        key, one = _student(child.name, named, layout), _found(child, label, own, named, layout)
        if named.doubtful:
            doubtful.append((key, one))
        else:
            _add(found, key, one)
    certain = set(found)
    for key, one in doubtful:
        if layout.name == MOODLE or key in certain:
            strays.append(f"{printable(str(one.path), 200)}: {_TWO_WAYS}")
        else:
            _add(found, key, one)
    return found


def _add(found: _ByStudent, key: tuple[str, ...], new: _Found) -> None:
    """Add a submission, or another file of the same student: they form one submission."""
    one = found.setdefault(key, new)
    if one is not new:
        one.files = [*(one.files or [(one.named.file, one.path)]), (new.named.file, new.path)]


def _read(layout: DownloadLayout, child: Path) -> tuple[Named, str]:
    """Interpret a name with or without an archive suffix; also return it without the suffix."""
    whole = layout.read(child.name)
    label = child.name if child.is_dir() else _stem(child.name)
    if whole.recognised and (whole.file or child.is_dir()):
        return whole, label
    return layout.read(label), label


def _student(name: str, named: Named, layout: DownloadLayout) -> tuple[str, ...]:
    """Return a key for the student: the identity if a platform stores single files, otherwise the name."""
    who = tuple(f"{key}={value}" for key, value in sorted(named.identity.items()))
    return who if who and (named.file or layout.name in PATTERNS) else ("", name)


def _found(path: Path, label: str, own: str, named: Named, layout: DownloadLayout) -> _Found:
    wish = "-".join(named.identity.values()) or label
    files = [(named.file, path)] if named.file else []
    label = wish if named.file else label
    return _Found(f"{own}/{path.name}", label, wish, path, named, layout=layout, files=files)


def _refuse(found: _ByStudent, path: Path, own: str, layout: DownloadLayout, problem: str) -> None:
    """Refuse a whole submission because a part of it was not unpacked."""
    named = layout.read(path.name)
    one = found.setdefault(_student(path.name, named, layout), _found(path, path.name, own, named, layout))
    one.problem = problem


def _entry(one: _Found, name: str, results: Path, wanted: Collection[str], strays: list[str]) -> HandedInEntry:
    path, problem = one.path, one.problem
    if one.files and not problem:
        path = results / "unpacked" / "together" / name
        path, problem = _put_together(one, path, wanted, strays)
    named = one.named
    return HandedInEntry(
        name,
        one.label,
        path,
        named.identity,
        named.late,
        named.recognised,
        problem,
        safe_name(one.wish),
        one.layout.name,
    )


def _put_together(one: _Found, into: Path, wanted: Collection[str], strays: list[str]) -> tuple[Path, str]:
    """Copy the files of one student into a folder under their original names.

    Returns what is graded, which is a single archive itself, and the problem, if any.
    """
    given = one.layout.original_names([name for name, _ in one.files], wanted)
    copy = partial(_copy, limits=limits_for(wanted))
    try:
        shutil.rmtree(into, ignore_errors=True)
        into.mkdir(parents=True)
        for names, (_, path) in zip(given, one.files, strict=True):
            if path.is_dir():
                shutil.copytree(path, into, symlinks=True, dirs_exist_ok=True, copy_function=copy)
            for name in names if not path.is_dir() else ():
                wrong = name_problem(name)
                if wrong:
                    strays.append(f"{printable(str(path), 200)}: {wrong}, so it is left out of its submission")
                else:
                    (into / name).parent.mkdir(parents=True, exist_ok=True)
                    copy(str(path), str(into / name))
        only = next(iter(into.iterdir()), into) if len(one.files) == 1 else into
        return only if _is_archive(only) else into, ""
    except SubmissionError as error:
        return into, error.message
    except shutil.Error:
        return into, "expected plain files, found something that cannot be copied"
    except OSError as error:
        raise HarnessError(f"{into}: the submission cannot be copied: {error.strerror}", "free some space") from None


def _copy(source: str, target: str, limits: SubmissionLimits = USUAL) -> str:
    """Copy a file of a student, without the content of one that is too large to be graded.

    Of two files of one name, a different program is a SubmissionError; of any other kind, both are kept.
    """
    path, wish = Path(source), Path(target)
    size = path.stat().st_size
    most = limits.packed_bytes if _is_archive(path) else limits.most_of(path.name)
    content = read_start(path, most, where=printable(source, 200)) if size <= most else None
    same = content is not None and wish.is_file() and wish.read_bytes() == content
    if wish.exists() and not same:
        if is_gradable(wish.name):
            raise SubmissionError(
                f"expected files with different names, found two different ones named {printable(wish.name)}"
            )
        numbers = (wish.with_name(f"{wish.stem} ({number}){wish.suffix}") for number in itertools.count(2))
        wish = next(path for path in numbers if not path.exists())
    if content is None:
        write_without_content(wish, most)
    elif not same:
        wish.write_bytes(content)
    return str(wish)


def _children(folder: Path, strays: list[str]) -> Iterator[Path]:
    """Yield the entries of a folder ordered by name, without files that operating systems and tools create.

    Skipped entries that may be a student's work become strays.
    """
    try:
        names = sorted(os.listdir(folder), key=os.fsencode)  # noqa: PTH208  names, in the order of their bytes
    except OSError as error:
        raise ClassError(f"{folder}: the folder cannot be read: {error.strerror}") from None
    for name in names:
        path = folder / name
        is_folder = path.is_dir()
        why = why_skipped(name, is_folder=is_folder)
        if is_folder and all((path / inside).exists() for inside in _OF_RESULTS):
            strays.append(f"{printable(str(path), 200)}: the results of a class, so it is not graded")
        elif why:
            strays.append(f"{printable(str(path), 200)}: {why}, so it is not graded")
        elif not (is_skipped_folder(name) if is_folder else is_skipped_file(name)):
            yield path


def _is_archive(path: Path) -> bool:
    return path.is_file() and path.name.casefold().endswith(ARCHIVE_SUFFIXES)


def _stem(name: str) -> str:
    """Remove all archive suffixes from a file name."""
    stem = name
    while True:
        ending = next((end for end in ARCHIVE_SUFFIXES if stem.casefold().endswith(end) and len(stem) > len(end)), "")
        if not ending:
            return stem
        stem = stem[: -len(ending)]
