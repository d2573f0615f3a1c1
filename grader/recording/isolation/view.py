"""Which folders, links and parents make a set of paths visible in an otherwise empty file system."""

from __future__ import annotations

import os
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path, PurePath

MOST_LINKS = 40  # what the kernel allows in one path


@dataclass(frozen=True, slots=True)
class View:
    """A minimal view of the machine's files.

    Attributes:
        bound: Real files and folders, sorted, none inside another.
        links: Symbolic links on the way to them, (where, target), sorted, none inside a bound folder.
    """

    bound: tuple[Path, ...]
    links: tuple[tuple[Path, str], ...]

    def parents(self) -> tuple[Path, ...]:
        """Return the folders above the bound paths and links, outermost first."""
        return parents_of((*self.bound, *(where for where, _ in self.links)))


def view_of(paths: Iterable[Path]) -> View:
    """Return a view in which every path that exists can be opened under its own name.

    Args:
        paths: Absolute paths. Links are followed one by one, so that a virtual environment whose interpreter is a link
            to a link still finds its way; a path that does not exist is left out.
    """
    real: set[Path] = set()
    links: dict[Path, str] = {}
    for path in paths:
        target, on_the_way = _follow(path)
        if target is not None:
            real.add(target)
            links.update(on_the_way)
    bound = tuple(path for path in sorted(real) if not any(parent in real for parent in path.parents))
    return View(bound, tuple((where, links[where]) for where in sorted(links) if not _is_inside(where, bound)))


def parents_of(paths: Iterable[Path]) -> tuple[Path, ...]:
    """Return every folder above the paths except the root, outermost first."""
    return tuple(sorted({parent for path in paths for parent in path.parents if parent != Path("/")}))


def _is_inside(path: Path, folders: Iterable[Path]) -> bool:
    return any(folder in path.parents for folder in folders)


def _follow(path: Path) -> tuple[Path | None, dict[Path, str]]:
    """Walk a path part by part and note each link passed; None if it leads nowhere."""
    links: dict[Path, str] = {}
    done, to_do = Path("/"), list(PurePath(os.path.normpath(path)).parts[1:])
    passed = 0
    while to_do:
        step = done / to_do.pop(0)
        if step.name == "..":
            done = done.parent
        elif step.is_symlink():
            passed += 1
            if passed > MOST_LINKS:
                return None, {}
            target = os.readlink(step)  # noqa: PTH115 -- Path.readlink drops a leading "./"
            links[step] = target
            to_do[:0] = [part for part in PurePath(target).parts if part != "/"]
            done = Path("/") if target.startswith("/") else done
        elif step.exists():
            done = step
        else:
            return None, {}
    return done, links
