"""The members of archives of every kind, and the error for an archive that cannot be used."""

from __future__ import annotations

from collections.abc import Callable

from grader.runtime.model.dataclass import dataclass

FILE, FOLDER, LINK = "a file", "a folder", "a link"

REPACK = "pack the folder again with your system's own zip and hand that in"
FEWER = "pack only your own .py files"


@dataclass(frozen=True, slots=True)
class Member:
    """A member of an archive, not yet unpacked."""

    name: str  # name in the archive, with `/` between the parts and none at the end; may be hostile
    kind: str  # `FILE`, `FOLDER`, or words for anything else, such as `a link`
    size: int
    read: Callable[[int], bytes]


class UnusableArchiveError(Exception):
    """An archive cannot be used; the caller adds its name."""

    def __init__(self, problem: str, hint: str = REPACK) -> None:
        super().__init__(problem)
        self.problem = problem
        self.hint = hint
