"""Collects the interface packages that a run gets besides the installed ones, and has them built."""

from __future__ import annotations

import hashlib
import json
import os
import shutil
import sys
import sysconfig
import tempfile
import time
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import replace
from functools import cache
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING

from grader.runtime.interfaces.build import BuiltInterfaces, build
from grader.runtime.interfaces.definitions import InterfacePackage, digest, files_in, find_packages, shipped_packages
from grader.runtime.interfaces.program import needed
from grader.runtime.lending import LENDABLE, LENT, Lent, copied, lent_to
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault, RubricError
from grader.runtime.model.limits import MAX_NAME_BYTES
from grader.runtime.model.packages import BroughtPackage, DescribedPackage
from grader.runtime.model.submission import Submission
from grader.runtime.model.wording import listed, printable
from grader.runtime.ros_installation import RosInstallation, find_ros
from grader.runtime.shipped import PACKAGE
from grader.runtime.supervisor.confined_build import Build, build_confined, told_of
from grader.runtime.supervisor.real_time_budget import FOREVER_S
from grader.runtime.temp_dirs import kept_interfaces, make_room

if TYPE_CHECKING:
    from grader.runtime.session import RecordingSession

__all__ = [
    "FOREVER_S",
    "InterfacePackage",
    "Provided",
    "built_from",
    "course_packages",
    "is_brought",
    "modules_named",
    "offered_digest",
    "provide",
    "type_folders",
    "unbuilt",
]

#: Who brings a package; where several bring one of the same name, the first one counts.
RUBRIC, CLASS, GRADER, SUBMISSION = "rubric", "class", "grader", "submission"
_WORDS = {RUBRIC: "the rubric", CLASS: "--interfaces", GRADER: "the grader", SUBMISSION: "the submission"}
#: What was reported of a build, beside its folder.
_TOLD = "told.json"
#: A larger Python file is not searched for the names of packages.
_MOST_BYTES = 1 << 20


@dataclass(frozen=True, slots=True)
class OfferedPackage:
    """A package that is not installed, and who brings it."""

    package: InterfacePackage
    origin: str  # one of the above


@dataclass(frozen=True, slots=True)
class Provided:
    """The interface packages of a run that are not installed."""

    packages: tuple[BroughtPackage, ...] = ()  # sorted by name
    builds: tuple[Path, ...] = ()  # what was built, the first one first
    offered: str = ""  # digest of all packages of rubrics and class, used or not; empty if there are none
    notes: tuple[str, ...] = ()  # sentences for whoever runs the grader
    problems: tuple[str, ...] = ()  # sentences for the student, about packages of the submission
    lent: tuple[Path, ...] = ()  # the folder of the other Python packages of ROS that the run gets, if it gets any
    spent_s: float = 0.0  # real time that the build of the submission's packages took
    own_builds: int = 0  # how many of the builds, at the end, are of packages that the submission brings

    @property
    def trusted(self) -> tuple[Path, ...]:
        """Where the modules of packages are that the submission does not bring."""
        trusted = self.builds[: len(self.builds) - self.own_builds]
        return tuple(BuiltInterfaces(prefix, ()).python for prefix in trusted)

    @property
    def shares(self) -> tuple[Path, ...]:
        """Where all descriptions of types are, the first one first."""
        return tuple(BuiltInterfaces(prefix, ()).share for prefix in self.builds)

    @property
    def folders(self) -> tuple[Path, ...]:
        """Where all modules are, the first one first."""
        return (*(BuiltInterfaces(prefix, ()).python for prefix in self.builds), *self.lent)


def is_package_installed(name: str, ros: RosInstallation) -> bool:
    """Return whether ROS or Python has a package of this name, so that nobody can bring one."""
    if len(os.fsencode(name)) > MAX_NAME_BYTES or "/" in name or "\0" in name:
        return False  # no folder can have it
    folders = (*ros.runtime.python_paths, *(Path(sysconfig.get_path(kind)) for kind in ("purelib", "platlib")))
    modules = any((folder / name).is_dir() or (folder / f"{name}.py").is_file() for folder in folders)
    return modules or name in sys.stdlib_module_names or any((folder / name).is_dir() for folder in ros.share)


def packages_in(folders: Iterable[Path]) -> list[InterfacePackage]:
    """Return the packages in some folders of an author; raises DefinitionError with file and line."""
    found: list[InterfacePackage] = []
    for folder in folders:
        here = find_packages(folder)
        if not here:
            where = printable(str(folder), 500)
            text = f"{where}: expected an interface package, found no folder with msg, srv or action in it"
            raise RubricError(text, "a package has its files in folders msg, srv and action")
        found += here
    return found


def offers(rubric: Iterable[Path], course: Iterable[Path], ros: RosInstallation) -> list[OfferedPackage]:
    """Return the packages in the folders of rubrics and of the class that are not installed.

    Raises DefinitionError, and RubricError for a package that several bring in different versions.
    """
    found: dict[str, OfferedPackage] = {}
    for origin, folders in ((RUBRIC, rubric), (CLASS, course)):
        for package in packages_in(dict.fromkeys(folders)):
            known = found.setdefault(package.name, OfferedPackage(package, origin)).package
            if digest([known]) != digest([package]):
                text = f"interfaces: expected one package {package.name}, found two with other definitions"
                raise RubricError(text, "give one of them another name")
    return [offer for offer in found.values() if not is_package_installed(offer.package.name, ros)]


def _digest(packages: Sequence[InterfacePackage]) -> str:
    return f"sha256:{digest(packages)}"


def built_packages(packages: Sequence[InterfacePackage], ros: RosInstallation) -> BuiltInterfaces:
    """Build packages, unless that was done before; raises DefinitionError with file and line."""
    return build(packages, kept_interfaces() or _own_temporary(), ros.share)


@cache
def _own_temporary() -> Path:
    _folders.append(tempfile.TemporaryDirectory(prefix="grade-interfaces-"))
    return Path(_folders[-1].name)


#: Temporary folders of this process, removed at its end.
_folders: list[tempfile.TemporaryDirectory[str]] = []


@dataclass(frozen=True, slots=True)
class TypeFolders:
    """The `share` folders with the types that nodes can use, besides those of authors."""

    installed: tuple[Path, ...]
    shipped: tuple[Path, ...]  # of what ships with the grader and is not installed


def type_folders() -> TypeFolders | None:
    """Return where the descriptions of types are; None without ROS."""
    try:
        ros = find_ros()
    except EnvironmentFault:
        return None
    ready = _ready(ros)
    return TypeFolders(tuple(ros.share), (built_packages(ready, ros).share,) if ready else ())


def built_from(folders: Iterable[Path], course: Iterable[Path] = ()) -> BuiltInterfaces | None:
    """Build the packages in the folders of rubrics, which may use those of a course; None if all are installed.

    Raises EnvironmentFault without ROS, DefinitionError with file and line.
    """
    ros = find_ros()
    own = [offer.package for offer in offers(folders, (), ros)]
    return built_packages(needed(own, [*_of_class(course, ros), *_ready(ros)]), ros) if own else None


def _ready(ros: RosInstallation) -> list[InterfacePackage]:
    return [package for package in shipped_packages() if not is_package_installed(package.name, ros)]


def _of_class(course: Iterable[Path], ros: RosInstallation) -> list[InterfacePackage]:
    return [offer.package for offer in offers((), course, ros)]


def unbuilt(workspace: Path) -> tuple[InterfacePackage, ...]:
    """Return the packages in a workspace of one's own that nobody has installed; raises DefinitionError."""
    ros = find_ros(workspaces=True)
    return tuple(package for package in find_packages(workspace) if not is_package_installed(package.name, ros))


def is_brought(name: str) -> bool:
    """Return whether the grader brings a package of this name, which is used where none is installed."""
    return name in LENDABLE or name in {package.name for package in shipped_packages()}


def modules_named(sources: Iterable[bytes], own: Sequence[InterfacePackage]) -> tuple[Path, ...]:
    """Return where the modules of packages are, those given and those of the grader that own programs name.

    Args:
        sources: The text of the programs, which need no sandbox.
        own: Message packages that lie beside them; nothing that is installed is replaced.

    Raises:
        DefinitionError: A definition cannot be used; it has file and line.
    """
    ros = find_ros(workspaces=True)
    taken = {package.name for package in own}
    ready = [p for p in shipped_packages() if p.name not in taken and not is_package_installed(p.name, ros)]
    names = {*(package.name for package in ready), *LENDABLE}
    mentioned = _named_in(sources, names)
    lent = lent_to(mentioned, lambda name: is_package_installed(name, ros))
    mentioned |= _named_in([lent.text], names)
    used = needed([*own, *(package for package in ready if package.name in mentioned)], ready)
    found = [built_packages(used, ros).python] if used else []
    return (*found, LENT) if lent.names else tuple(found)


def course_packages(course: tuple[Path, ...], *, ready: bool = True) -> list[DescribedPackage]:
    """Build the packages of a course, and describe them and, if asked, those that ship with the grader.

    Raises EnvironmentFault without ROS, DefinitionError with file and line.
    """
    ros = find_ros()
    given = [(package, CLASS) for package in packages_in(dict.fromkeys(course))]
    given += [(package, GRADER) for package in shipped_packages() if ready]
    lacking = [package for package, _ in given if not is_package_installed(package.name, ros)]
    found = []
    for package, origin in given:
        place = str(built_packages(needed([package], lacking), ros).python) if package in lacking else ""
        types = tuple(sorted(f"{package.name}/{d.kind}/{d.name}" for d in package.definitions))
        found.append(DescribedPackage(package.name, origin, _digest([package]), types, place))
    return found


def offered_digest(course: Iterable[Path], rubric: Iterable[Path]) -> str:
    """Return the digest of all packages in the folders of a class and of rubrics; empty if there are none."""
    packages = packages_in(dict.fromkeys((*rubric, *course)))
    return _digest(packages) if packages else ""


def provide(  # noqa: PLR0913 - who brings packages, and who needs them
    session: RecordingSession,
    submission: Submission,
    *,
    course: Sequence[Path] = (),
    rubric: Sequence[Path] = (),
    text: bytes = b"",
    budget_s: float = FOREVER_S,
    build_own: Callable[..., Build] = build_confined,
) -> Provided:
    """Build what a run needs: the packages of rubrics and class, those of the grader that it names, and a submission's.

    Args:
        session: Its sandbox and limits hold for the packages of the submission.
        submission: The staged submission.
        course: The folders of the class.
        rubric: The folders of rubrics.
        text: Names types that the run uses besides those that the programs name.
        budget_s: Real time that may be spent on the packages of the submission.
        build_own: Builds them; see `build_confined`.
    """
    ros, root = session.ros, submission.root
    given = offers(rubric, course, ros)
    taken = {offer.package.name for offer in given}
    ready = [p for p in shipped_packages() if p.name not in taken and not is_package_installed(p.name, ros)]
    texts = chain([text], _programs(root))
    names = {*(package.name for package in ready), *LENDABLE}
    mentioned = _named_in(texts, names)
    lent = lent_to(mentioned, lambda name: is_package_installed(name, ros))
    mentioned |= _named_in([lent.text], names)
    named = [package for package in ready if package.name in mentioned]
    used = needed([*(offer.package for offer in given), *named], ready)
    given += [OfferedPackage(package, GRADER) for package in used if package.name not in taken]
    brought = [BroughtPackage(offer.package.name, offer.origin, _digest([offer.package])) for offer in given]
    builds = [_copied(built_packages(used, ros).prefix, session.folder)] if used else []
    others = [*used, *(package for package in ready if package not in used)]
    given_builds = len(builds)
    own = _of_submission(session, submission, others, budget_s, build_own)
    try:
        builds += [_copied(folder, root.parent) for folder in own.builds]
    except OSError:  # another run has made room in the meantime
        shutil.rmtree(root.parent / "interfaces", ignore_errors=True)
        again = _of_submission(session, submission, others, budget_s - own.spent_s, build_own)
        own = replace(again, spent_s=own.spent_s + again.spent_s)
        builds += [_copied(folder, root.parent) for folder in own.builds]
    packages = tuple(sorted([*brought, *own.packages], key=lambda package: package.name))
    offered = offered_digest(course, rubric)
    lent_at = (copied(lent.names, session.folder),) if lent.names else ()
    notes = tuple(_notes(packages, lent))
    own_builds = len(builds) - given_builds
    return Provided(packages, tuple(builds), offered, notes, own.problems, lent_at, own.spent_s, own_builds)


@dataclass(frozen=True, slots=True)
class _Own:
    """What became of the packages in a submission."""

    packages: tuple[BroughtPackage, ...] = ()
    builds: tuple[Path, ...] = ()
    problems: tuple[str, ...] = ()
    spent_s: float = 0.0


def _of_submission(
    session: RecordingSession,
    submission: Submission,
    others: Sequence[InterfacePackage],
    budget_s: float,
    build_own: Callable[..., Build],
) -> _Own:
    """Build the packages in a submission, which may use others, but not replace them, in the sandbox of a session."""
    root = submission.root
    files = files_in([root])
    if not any(path.suffix != ".xml" for path in files):
        return _Own()
    key = hashlib.sha256(f"{digest(others)} {sys.version} {session.ros.distro}".encode())
    for source in sorted((PACKAGE / "runtime" / "interfaces").rglob("*.py")):
        key.update(source.read_bytes())
    for path in files:
        key.update(os.fsencode(f"{path.relative_to(root)}\0{path.stat().st_size}\0") + path.read_bytes())
    place = (kept_interfaces() or session.folder) / f"submitted-{key.hexdigest()}"
    kept = _kept_build(place)
    if kept is not None:
        return _own_from(kept, place)
    names = {folder.name for path in files for folder in path.parents} | {one.name for one in submission.projects}
    taken = {other.name for other in others} | {name for name in names if is_package_installed(name, session.ros)}
    started = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="build-", dir=place.parent, ignore_cleanup_errors=True) as fresh:
        into = Path(fresh, "whole")
        into.mkdir()
        told = build_own(session.isolation, session.ros, root, into, others=others, taken=taken, left_s=budget_s)
        spent_s = time.monotonic() - started
        if not told.packages:  # what was begun is of no use
            shutil.rmtree(into)
            into.mkdir()
        written = {"packages": dict(told.packages), "folder": told.folder, "problems": told.problems}
        (into / _TOLD).write_text(json.dumps(written), encoding="utf-8")
        if not told.lasting:
            return replace(_own_from(told, place), spent_s=spent_s)
        with suppress(OSError):  # another process was faster
            into.rename(place)
    make_room(place.parent, keep=place)
    return replace(_own_from(told, place), spent_s=spent_s)


def _kept_build(place: Path) -> Build | None:
    """Return what was built before; None if it was not, or if that was damaged since."""
    try:
        told = told_of(json.loads((place / _TOLD).read_text(encoding="utf-8")))
    except (OSError, ValueError):
        return None
    with suppress(OSError):
        os.utime(place)  # what is in use is not the oldest
    return told


def _own_from(told: Build, place: Path) -> _Own:
    found = tuple(BroughtPackage(name, SUBMISSION, told.packages[name]) for name in sorted(told.packages))
    return _Own(found, (place / told.folder,) if found else (), told.problems)


def _named_in(texts: Iterable[bytes], names: Iterable[str]) -> set[str]:
    """Return the names that are in any of the texts."""
    return {name for text in texts for name in names if name.encode() in text}


def _programs(root: Path) -> Iterator[bytes]:
    for path in sorted(root.rglob("*.py")):
        if path.is_file() and path.stat().st_size <= _MOST_BYTES:
            yield path.read_bytes()


def _copied(folder: Path, into: Path) -> Path:
    """Copy a built folder to where the worker may read it: it sees no kept folder, which holds those of others."""
    copy = into / "interfaces" / folder.name
    if not copy.exists():
        shutil.copytree(folder, copy)
    return copy


def _notes(packages: Iterable[BroughtPackage], lent: Lent) -> Iterator[str]:
    """Yield the notes on the packages of a run, in words."""
    by_origin: dict[str, list[str]] = {}
    for package in packages:
        by_origin.setdefault(package.origin, []).append(package.name)
    parts = [f"{listed(names, 'and')} of {_WORDS[origin]}" for origin, names in sorted(by_origin.items())]
    if parts:
        yield f"interface packages that are not installed: {'; '.join(parts)}"
    if lent.names:
        yield f"{listed(lent.names, 'and')}: not installed, the grader's own version was used"
