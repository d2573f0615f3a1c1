"""Reads a student's submission: stages a copy, and maps its files to processes."""

from __future__ import annotations

import difflib
import os
import re
import stat
import unicodedata
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path, PurePosixPath
from types import MappingProxyType

from grader.grading.submissions.bag_files import find_bag
from grader.grading.submissions.collected import Collected, limits_for
from grader.grading.submissions.contents import SubmissionContents, read_contents
from grader.grading.submissions.projects import read_projects
from grader.grading.submissions.staging import collect_folder, read_start, write_files
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.limits import MAX_FILE_BYTES
from grader.runtime.model.projects import ExaminedPackage, Project
from grader.runtime.model.scenario import is_bag_file, is_bag_pattern, wants_bag
from grader.runtime.model.submission import EXPORT_NOTEBOOK, StudentFile, Submission, is_notebook
from grader.runtime.model.wording import first_of, listed, printable
from grader.runtime.programs.executables import Executable, executables, find_executables

__all__ = [
    "collect_submission",
    "every_file",
    "not_there",
    "read_projects",
    "read_start",
    "stage_collected",
    "stage_submission",
    "write_files",
]

#: Names at least this similar are shown as a possible misspelling.
SIMILARITY = 0.8

#: Files named in a hint about a submission without any.
_MOST_WANTED = 4

#: Misspelt names shown for one file.
MAX_SIMILAR = 3

#: Other Python files shown for a missing one, and the likeness of names from which one of them is probably meant.
MAX_CANDIDATES, LIKELY = 12, 0.6
#: Files of packages that are not nodes.
_NO_NODES = ("__init__.py", "setup.py", "conftest.py")

_EXPECTED = "a folder, a .py file or an archive"
_EXPECTED_WITH_BAGS = "a folder, a recording, a .py file or an archive"

# Suffixes that browsers, editors and file managers add to a name: `x(1).py`, `x - Copy.py`, `x.py.txt`; and notebooks.
_EXTENSIONS = re.compile(r"(?:\.(?:txt|bak|orig|old|save|py|ipynb))+$")
_COPY_MARK = re.compile(r"[\s_-]*(?:\(\d+\)|copy|copia|kopie)\s*\d*$")


def stage_submission(
    path: str, wanted: Sequence[str], into: Path, meant: Mapping[str, str] = MappingProxyType({})
) -> Submission:
    """Copy a submission and find the wanted files in it.

    Args:
        path: A folder, an archive, or one .py file or wanted file, as the user typed it. If a folder or archive holds
            neither but one archive, that archive is used: learning platforms deliver uploads this way.
        wanted: File names of all exercises being graded, and patterns of recordings; a missing file has the names that
            look like it.
        into: Empty folder that receives the copy.
        meant: Wanted file name -> the path inside the submission that is meant, where several files may have the name.

    Raises:
        SubmissionError: There is no such path, it is not a folder, archive or .py file, it holds no .py file and
            no wanted one although no recording is wanted, a limit is exceeded, or an archive cannot be used.
        HarnessError: The copy cannot be written, or no process can be started that reads project files.
    """
    return stage_collected(collect_submission(path, wanted, into), path, wanted, into, meant)


def collect_submission(path: str, wanted: Sequence[str], into: Path) -> Collected:
    """Read a submission without writing anything; arguments and errors are those of `stage_submission`."""
    where = printable(path, 500)
    source = Path(path)
    if stat.S_ISDIR(_mode(path, where)):
        return _with_work(collect_folder(source, into=into, where=where, limits=limits_for(wanted)), wanted, where)
    return _collect_file(source, wanted, where)


def every_file(path: str, into: Path, wanted: Sequence[str] = ()) -> Collected:
    """Read all files of a submission; without a .py file or a wanted one, those of the only archive in it.

    Errors are those of `stage_submission`, but for a missing .py file.
    """
    where, source, limits = printable(path, 500), Path(path), limits_for(wanted)
    if stat.S_ISDIR(_mode(path, where)):
        collected = collect_folder(source, into=into, where=where, limits=limits)
    else:
        collected = _every_file_of(source, wanted, where)
    if _has_work([name for name, _ in collected.files], wanted):
        return collected
    from grader.grading.submissions.archives import collect_archive  # noqa: PLC0415 - as below

    archives = _archives(collected)
    if len(archives) != 1:
        return collected
    name, packed = archives[0]
    return collect_archive(packed, where=f"{where}/{printable(name)}", limits=limits)


def stage_collected(
    collected: Collected, path: str, wanted: Sequence[str], into: Path, meant: Mapping[str, str] = MappingProxyType({})
) -> Submission:
    """Write files that were read, here or on another machine, and find the wanted ones; raises HarnessError."""
    digest = write_files(collected, into)
    likely = {name for one in wanted for last in [one.rpartition("/")[2]] for name in (last, f"{last}.py")}
    # without wanted files, it is staged for its digest alone
    contents = read_contents(into, likely | set(meant.values())) if wanted else SubmissionContents((), {}, ())
    projects, programs = contents.projects, executables(into, contents.projects)

    def found(name: str) -> StudentFile:
        if "/" in name and name not in meant:
            return _look_for_executable(name, into, projects, programs, collected.files, wanted)
        if is_bag_pattern(name):
            return find_bag(name, [file for file, _ in collected.files], collected.too_large)
        return _look_for(name, collected.files, wanted, programs, meant.get(name, ""))

    files = {name: found(name) for name in wanted}
    several = tuple(note for file in files.values() for note in _notes_on(file))
    packages: tuple[ExaminedPackage, ...] = ()
    if projects:
        # Most submissions have no package, and do not wait for it to be imported.
        from grader.grading.submissions.installing import examined_packages  # noqa: PLC0415

        packages = examined_packages(projects, (name for name, _ in collected.files), contents.programs)
    return Submission(
        name=_name(Path(path)),
        path=path,
        root=into,
        digest=digest,
        files=files,
        notes=(*several, *_unrunnable(files.values(), projects), *collected.notes, *contents.notes),
        projects=_meant_first(projects, files.values()),
        packages=packages,
        programs=contents.programs,
    )


def _meant_first(projects: Sequence[Project], files: Iterable[StudentFile]) -> tuple[Project, ...]:
    """Return the packages; of several with one name, that of a file that runs comes first, because the first counts."""
    found = [file.found for file in files if file.found]
    own = [p for p in projects if any(not p.folder or name.startswith(f"{p.folder}/") for name in found)]
    return (*own, *(project for project in projects if project not in own))


def _mode(path: str, where: str) -> int:
    if not path:
        raise SubmissionError(f"expected {_EXPECTED}, found an empty path", "use . for this folder")
    try:
        return os.stat(path).st_mode  # noqa: PTH116 - a Path would change what was typed, e.g. `x.py/`
    except (FileNotFoundError, NotADirectoryError):
        raise not_there(path) from None
    except OSError as error:
        raise SubmissionError(f"{where}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise SubmissionError(f"{where}: expected a path, found one that no file can have") from None


def not_there(path: str, hint: str = "") -> SubmissionError:
    """Return the error for a path at which there is nothing."""
    text = f"{printable(path, 500)}: expected {_EXPECTED}, found nothing there"
    return SubmissionError(text, hint or "check the path, and the folder you are in")


def _collect_file(source: Path, wanted: Sequence[str], where: str) -> Collected:
    return _with_work(_every_file_of(source, wanted, where), wanted, where)


def _every_file_of(source: Path, wanted: Sequence[str], where: str) -> Collected:
    """Return a .py file, another one that is wanted, or the files of an archive."""
    if not source.is_file():
        raise SubmissionError(f"{where}: expected {_EXPECTED}, found a device, pipe or socket")
    # Most submissions are folders.
    from grader.grading.submissions.archives import (  # noqa: PLC0415
        ARCHIVE_SUFFIXES,
        HEAD_BYTES,
        archive_kind,
        collect_archive,
    )

    limits = limits_for(wanted)
    content = read_start(source, limits.packed_bytes + 1, where=where)
    if limits.bag_bytes and is_bag_file(source.name):
        if len(content) > limits.bag_bytes:
            raise SubmissionError(f"{where}: expected at most {limits.bag_bytes >> 20} MiB, found more")
        return Collected(((source.name, content),))
    kind = archive_kind(content[:HEAD_BYTES])
    # A program may look like an old tar archive, by chance or on purpose.
    is_program = source.suffix.casefold() == ".py" and kind in (None, "tar")
    if is_program or (kind is None and source.name in _file_names(wanted)):
        if len(content) > MAX_FILE_BYTES:
            raise SubmissionError(f"{where}: expected at most {MAX_FILE_BYTES >> 20} MiB, found more")
        return Collected(((source.name, content),))
    if kind is None and not source.name.casefold().endswith(ARCHIVE_SUFFIXES):
        expected = _EXPECTED_WITH_BAGS if limits.bag_bytes else _EXPECTED
        raise SubmissionError(f"{where}: expected {expected}, found another kind of file", _other_kind(source, wanted))
    return collect_archive(content, where=where, limits=limits)


def _archives(collected: Collected) -> list[tuple[str, bytes]]:
    from grader.grading.submissions.archives import ARCHIVE_SUFFIXES  # noqa: PLC0415 - as above

    return [(name, content) for name, content in collected.files if name.casefold().endswith(ARCHIVE_SUFFIXES)]


def _other_kind(source: Path, wanted: Sequence[str]) -> str:
    """Return a hint for a file that is neither a program nor an archive: a notebook, or a program of another name."""
    if is_notebook(source.name):
        return f"{printable(source.name)} is a notebook: {EXPORT_NOTEBOOK}"
    if any(_similar(name, [source.name], wanted) for name in wanted) or ".py" in source.suffixes:
        return f"rename {printable(source.name)} so that it ends in .py"
    return ""


def _with_work(collected: Collected, wanted: Sequence[str], where: str) -> Collected:
    """Return the files if .py files or wanted ones are among them, or else those of the only archive.

    Where a recording is wanted, a submission without any is graded: its criteria say what is missing.
    """
    if _has_work([name for name, _ in collected.files], wanted):
        return collected
    from grader.grading.submissions.archives import collect_archive  # noqa: PLC0415 - as above

    archives, bags = _archives(collected), wants_bag(wanted)
    if len(archives) != 1:
        if bags:
            return collected
        raise _no_python(collected, wanted, where)
    name, packed = archives[0]
    inside = f"{where.rstrip('/')}/{printable(name)}"
    inner = collect_archive(packed, where=inside, limits=limits_for(wanted))
    if not bags and not _has_work([name for name, _ in inner.files], wanted):
        raise _no_python(inner, wanted, inside)
    notes = (f"the contents of {printable(name)} were graded", *collected.notes, *inner.notes)
    return Collected(inner.files, notes, inner.too_large)


def _has_work(names: Sequence[str], wanted: Sequence[str]) -> bool:
    """Whether there is a .py file or a wanted file, such as a launch file in XML or a recording."""
    bags, others = wants_bag(wanted), _file_names(wanted)
    return _has_python(names) or any((bags and is_bag_file(n)) or n.rpartition("/")[2] in others for n in names)


def _file_names(wanted: Iterable[str]) -> set[str]:
    """Return the wanted files; `PACKAGE/NAME` is an executable, whose file may have any name."""
    return {name for name in wanted if "/" not in name}


def _has_python(names: Iterable[str]) -> bool:
    return any(name.casefold().endswith(".py") for name in names)


def _no_python(collected: Collected, wanted: Sequence[str], where: str) -> SubmissionError:
    names = [name for name, _ in collected.files]
    archives = [name for name, _ in _archives(collected)]
    similar = [name for want in wanted for name in _similar(want, names, wanted)]
    hint = ""
    notebooks = [name for name in names if is_notebook(name)]
    if notebooks:
        hint = f"{printable(notebooks[0])} is a notebook: {EXPORT_NOTEBOOK}"
    elif similar:
        hint = f"rename {printable(similar[0])} so that it ends in .py"
    elif archives:
        one = "put your .py files into one zip"
        hint = (
            f"{one}, not into several"
            if len(archives) > 1
            else f"{one}: {printable(archives[0])} is inside another one"
        )
    elif collected.notes:
        hint = collected.notes[0]
    elif wanted:
        hint = f"hand in {listed([printable(name) for name in wanted][:_MOST_WANTED])}"
    found = f"{len(archives)} archives" if len(archives) > 1 else first_of(names) if names else "none"
    return SubmissionError(f"{where}: expected at least one .py file, found {found}", hint)


def _name(source: Path) -> str:
    """Return the name that reports show: the last part of the path, also for `.` and `..`."""
    return source.name if source.name not in ("", "..") else source.resolve().name or "/"


def _look_for_executable(  # noqa: PLR0913  what a submission consists of
    wanted: str,
    root: Path,
    projects: Sequence[Project],
    programs: Sequence[Executable],
    files: Sequence[tuple[str, bytes]],
    all_wanted: Sequence[str],
) -> StudentFile:
    """Find `PACKAGE/NAME` among the programs of a submission; `*` stands for any package."""
    package, _, name = wanted.partition("/")
    named = find_executables(root, projects, package, name)
    found = [one for one in named if one.file is not None]
    if found:
        others = tuple(dict.fromkeys(one.file or "" for one in found[1:] if one.file != found[0].file))
        return StudentFile(wanted, found[0].file, others=others, executable=name)
    problem = named[0].problem if named else ""
    similar = difflib.get_close_matches(wanted, [one.words for one in programs], MAX_SIMILAR, SIMILARITY)
    rest = [one.words for one in programs if one.words not in similar]
    rest = rest or sorted((path for path, _ in files if _may_be_node(path, all_wanted)), key=_nearest_the_top)
    return StudentFile(wanted, None, tuple(similar), candidates=tuple(rest[:MAX_CANDIDATES]), problem=problem)


def _unrunnable(files: Iterable[StudentFile], projects: Sequence[Project]) -> Iterator[str]:
    """Yield a note for each executable that `ros2 run` starts only if its source is executable and was linked."""
    known = {f"{project.folder}/{file}".lstrip("/") for project in projects for _, file in project.unrunnable}
    for file in files:
        if "/" in file.wanted and file.found in known:
            problem = f"{printable(file.found or '')} is not installed as a program, so that `ros2 run` may not find it"
            yield f"{problem}; install it with install(PROGRAMS ...)"


def _notes_on(file: StudentFile) -> Iterator[str]:
    """Yield what readers must know about how a file was found."""
    if file.others:
        yield _several(file)
    if file.executable and "/" not in file.wanted:
        yield f"{file.wanted}: the graded executable is {file.executable}, in {printable(file.found or '')}"


def _look_for(
    wanted: str,
    files: Sequence[tuple[str, bytes]],
    all_wanted: Sequence[str],
    programs: Sequence[Executable],
    meant: str,
) -> StudentFile:
    names = [name for name, _ in files]
    if meant in names:
        return StudentFile(wanted, meant)
    exact = sorted((name for name in names if PurePosixPath(name).name == wanted), key=_nearest_the_top)
    if exact:
        return StudentFile(wanted, exact[0], others=tuple(exact[1:]))
    installed = [one for one in programs if wanted in (one.name, f"{one.name}.py") and one.file is not None]
    if len(installed) == 1:
        return StudentFile(wanted, installed[0].file, executable=installed[0].name)
    similar = tuple(_similar(wanted, names, all_wanted))
    others = {name: content for name, content in files if name not in similar and _may_be_node(name, all_wanted)}
    ranked = sorted((-_resemblance(name, others[name], wanted), _nearest_the_top(name), name) for name in others)
    candidates = tuple(name for _, _, name in ranked[:MAX_CANDIDATES])
    return StudentFile(wanted, None, similar=similar, candidates=candidates, likely=bool(ranked and -ranked[0][0] >= 1))


def _may_be_node(path: str, all_wanted: Sequence[str]) -> bool:
    name = PurePosixPath(path).name
    return name.casefold().endswith(".py") and name not in (*all_wanted, *_NO_NODES)


def _resemblance(path: str, content: bytes, wanted: str) -> float:
    """Return how much a Python file resembles a wanted one; from 1 on, it is probably meant."""
    plain, text = _plain(wanted), content.decode("utf-8", "replace")
    names_it = "rclpy" in text and plain in text.replace("_", "").casefold()
    likeness = difflib.SequenceMatcher(None, _plain(PurePosixPath(path).name), plain, autojunk=False).ratio()
    return likeness + ("rclpy" in text) * 0.1 + (names_it or likeness >= LIKELY)


def _nearest_the_top(relative: str) -> tuple[int, bytes]:
    return relative.count("/"), os.fsencode(relative)


def _several(file: StudentFile) -> str:
    return (
        f"{printable(file.found or '')} is graded, because it is nearest the top; not graded: {first_of(file.others)}"
    )


def _similar(wanted: str, files: Iterable[str], all_wanted: Sequence[str]) -> list[str]:
    """Return files whose name looks like a misspelling of a wanted name, nearest first."""
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
    """Return a file name without case, separators, copy marks and extensions."""
    stem = _EXTENSIONS.sub("", unicodedata.normalize("NFKC", name).casefold())
    return re.sub(r"[\W_]+", "", _COPY_MARK.sub("", stem))


def _likeness(one: str, other: str) -> float:
    matcher = difflib.SequenceMatcher(None, one, other, autojunk=False)
    if matcher.real_quick_ratio() < SIMILARITY or matcher.quick_ratio() < SIMILARITY:
        return 0.0
    return matcher.ratio()
