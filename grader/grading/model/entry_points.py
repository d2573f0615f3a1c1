"""Finds what other packages add to the grader: entry points in their metadata, which are read when somebody asks."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import contextmanager
from typing import TYPE_CHECKING, TypeVar

from grader.runtime.model.errors import EnvironmentFault, GraderError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

#: The groups of entry points, and what an entry of each is called.
FORMATS, SCHEDULERS = "rclpy_grader.formats", "rclpy_grader.schedulers"
_CALLED = {FORMATS: "format", SCHEDULERS: "scheduler"}
#: What stands before the `=` in an option, and in lists of names.
NAME = re.compile(r"[a-z][a-z0-9_-]*")
_GRADER = "rclpy-grader"
_Kind = TypeVar("_Kind")


def registered_names(group: str) -> list[str]:
    """Return the names that installed packages register, in order; nothing of them is imported.

    Names that cannot be used are left out, and all if the metadata of a package cannot be read: `load` says why.
    """
    try:
        return sorted({entry.name for entry in _entries(group) if NAME.fullmatch(entry.name)})
    except EnvironmentFault:
        return []


def load_registered(group: str, name: str, kind: type[_Kind], expected: str) -> tuple[_Kind, str] | None:
    """Import what a package registers by a name, and return it with the words that name it in messages.

    Return None if no package registers the name. Raises EnvironmentFault, which names the package and the entry point,
    if two do, if it cannot be imported, or if it is not of the kind, which messages call `expected`.
    """
    found = {_package(entry): entry for entry in _entries(group) if entry.name == name}
    if not found:
        return None
    own = {package: entry for package, entry in found.items() if _is_own(package)}
    found = own or found  # names of the grader stay its own
    if len(found) > 1:
        problem = f"{name!r} of {group}: expected one package that registers it, found {' and '.join(sorted(found))}"
        raise EnvironmentFault(problem, "uninstall all but one of them")
    (package, entry), called = found.popitem(), _CALLED[group]
    where = f"the {called} {name!r} of {package}, entry point {entry.value!r} of {group}"
    with faults(f"{where}: cannot be imported", _remedy(package)):
        loaded = entry.load()
    if not isinstance(loaded, kind):
        problem = f"{where}: expected {expected}, found {type(loaded).__name__}"
        raise EnvironmentFault(problem, _remedy(package))
    return loaded, f"the {called} {name!r} of {package}"


def added(group: str) -> list[tuple[str, str]]:
    """Return what other packages than the grader register: names, and package and version of each; in order.

    Raises EnvironmentFault if the metadata of a package cannot be read.
    """
    found = {(entry.name, _package(entry)) for entry in _entries(group)}
    return sorted((name, package) for name, package in found if not _is_own(package))


def own(group: str) -> list[str]:
    """Return the names that the grader itself registers; raises as `added`."""
    return [entry.name for entry in _entries(group) if _is_own(_package(entry))]


@contextmanager
def faults(problem: str, hint: str) -> Iterator[None]:
    """Make an EnvironmentFault of whatever the code of another package raises, an exit included."""
    try:
        yield
    except (GraderError, KeyboardInterrupt, GeneratorExit):
        raise
    except BaseException as error:
        raise EnvironmentFault(f"{problem}: {_told(error)}", hint) from error


def _told(error: BaseException) -> str:
    try:
        return f"{type(error).__name__}: {error}".removesuffix(": ")
    except Exception:  # its own text may raise, too
        return type(error).__name__


def _entries(group: str) -> list[EntryPoint]:
    from importlib import metadata  # noqa: PLC0415  takes long, and is seldom needed

    problem = f"entry points of {group}: the metadata of an installed package cannot be read"
    with faults(problem, "pip check names what is broken"):
        return list(metadata.entry_points(group=group))


def _package(entry: EntryPoint) -> str:
    return "an unknown package" if entry.dist is None else f"{entry.dist.name} {entry.dist.version}"


def _is_own(package: str) -> bool:
    return package.partition(" ")[0] == _GRADER


def _remedy(package: str) -> str:
    return f"update {package.partition(' ')[0]}, or uninstall it"
