"""Finds the submissions of a class in folders and downloads, and gives each a unique safe name."""

from __future__ import annotations

import hashlib
import os
import re
import shutil
import unicodedata
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from grader.course.classroom.downloads import AUTO, PATTERNS, DownloadLayout, Named, layout_of, unpack_download
from grader.grading.submissions.archives import ARCHIVE_SUFFIXES
from grader.grading.submissions.collected import is_skipped_file, is_skipped_folder, name_problem, why_skipped
from grader.grading.submissions.submission import read_start
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import ClassError, HarnessError, SubmissionError
from grader.runtime.model.wording import shown

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


#: Largest file of a student in a folder shared with other students' files.
MAX_FILE_BYTES = 64 << 20


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


@dataclass(frozen=True, slots=True)
class Intake:
    """The submissions found in the sources."""

    entries: tuple[HandedInEntry, ...]  # the submissions, ordered by name
    layouts: tuple[tuple[str, str], ...]  # each source with its layout, as text
    strays: tuple[str, ...] = ()  # entries that are not submissions, with the reason; one line each


@dataclass(slots=True)
class _Found:
    """A submission before it gets its unique name; it may consist of several files."""

    own: str
    label: str
    wish: str
    path: Path
    named: Named
    problem: str = ""
    files: list[tuple[str, Path]] = field(default_factory=list)


_ByStudent = dict[tuple[str, ...], _Found]


def take_in(sources: Sequence[Path], results: Path, *, layout: str = AUTO, pattern: str = "") -> Intake:
    """Find all submissions in folders and downloads, which are unpacked in the results folder.

    A regular expression for names overrides the layout. Raises ClassError if a source cannot be used, or has no
    submissions.
    """
    found: list[_Found] = []
    strays: list[str] = []
    layouts: list[tuple[str, str]] = []
    called = distinct_names([(source.resolve().name, str(source)) for source in sources])
    for source, own in zip(sources, called, strict=True):
        top, refused = _opened(source, results / "unpacked" / own, strays)
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
    entries = [_entry(one, name, results) for one, name in zip(found, names, strict=True)]
    return Intake(tuple(sorted(entries, key=lambda entry: entry.name)), tuple(layouts), tuple(strays))


def _opened(source: Path, into: Path, strays: list[str]) -> tuple[Path, Mapping[str, str]]:
    """Return the folder with the submissions of a source, and the entries that were refused."""
    if source.is_dir():
        return source, {}
    if not source.is_file():
        raise ClassError(f"{source}: expected a folder of submissions or a download, found nothing there")
    unpacked = unpack_download(source, into)
    strays += [f"{source}: {stray}" for stray in unpacked.strays]
    return unpacked.folder, unpacked.refused


def _layout(children: Sequence[Path], top: Path, wanted: str, pattern: str) -> DownloadLayout:
    """Determine the layout of a folder; plain files count only if there are no folders or archives."""
    names = [child.name for child in children if child.is_dir() or _is_archive(child)]
    return layout_of(wanted, pattern, top.resolve().name, names or [child.name for child in children])


def _submissions(children: Sequence[Path], own: str, layout: DownloadLayout, strays: list[str]) -> _ByStudent:
    found: _ByStudent = {}
    for child in children:
        if child.is_symlink():
            strays.append(f"{shown(str(child), 200)}: a link, which is not followed")
            continue
        named, label = _read(layout, child)
        if not child.is_dir() and not _is_archive(child) and not named.file:
            strays.append(f"{shown(str(child), 200)}: neither a folder nor an archive")
            continue
        key = _student(child.name, named, layout)
        one = found.setdefault(key, _found(child, label, own, named))
        if one.path != child:  # another file of the same student: they form one submission
            one.files = [*(one.files or [(one.named.file, one.path)]), (named.file, child)]
    return found


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


def _found(path: Path, label: str, own: str, named: Named) -> _Found:
    wish = "-".join(named.identity.values()) or label
    files = [(named.file, path)] if named.file else []
    return _Found(f"{own}/{path.name}", wish if named.file else label, wish, path, named, files=files)


def _refuse(found: _ByStudent, path: Path, own: str, layout: DownloadLayout, problem: str) -> None:
    """Refuse a whole submission because a part of it was not unpacked."""
    named = layout.read(path.name)
    one = found.setdefault(_student(path.name, named, layout), _found(path, path.name, own, named))
    one.problem = problem


def _entry(one: _Found, name: str, results: Path) -> HandedInEntry:
    path, problem = one.path, one.problem
    if one.files and not problem:
        path = results / "unpacked" / "together" / name
        problem = _put_together(one.files, path)
    named = one.named
    return HandedInEntry(
        name, one.label, path, named.identity, named.late, named.recognised, problem, safe_name(one.wish)
    )


def _put_together(files: Sequence[tuple[str, Path]], into: Path) -> str:
    """Copy the files of one student into a folder under their original names; return the problem, if any."""
    counted = Counter(name for name, _ in files if name)
    wrong = next((f"found {name_problem(name)}: {shown(name)}" for name, _ in files if name and name_problem(name)), "")
    twice = next((f"found {shown(name)} twice" for name, count in counted.items() if count > 1), "")
    if wrong or twice:
        return f"expected files with different plain names, {wrong or twice}"
    try:
        shutil.rmtree(into, ignore_errors=True)
        into.mkdir(parents=True)
        for name, path in files:
            if path.is_dir():
                shutil.copytree(path, into, symlinks=True, dirs_exist_ok=True)
            else:
                target = into / (name or path.name)
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(read_start(path, MAX_FILE_BYTES, where=shown(str(path), 200)))
    except SubmissionError as error:
        return error.message
    except shutil.Error:
        return "expected plain files, found something that cannot be copied"
    except OSError as error:
        raise HarnessError(f"{into}: the submission cannot be copied: {error.strerror}", "free some space") from None
    return ""


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
        if why:
            strays.append(f"{shown(str(path), 200)}: {why}, so it is not graded")
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
