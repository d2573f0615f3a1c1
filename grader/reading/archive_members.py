"""What the readers of archive formats have in common: a member, and why an archive cannot be used."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

FILE, FOLDER = "a file", "a folder"

REPACK = "pack the folder again with your system's own zip and hand that in"
HAND_IN_ZIP = "pack the folder with your .py files as a zip"
FEWER = "pack only your own .py files"


@dataclass(frozen=True, slots=True)
class Member:
    """One member of an archive, not yet unpacked.

    Attributes:
        name: As the archive has it, with `/` between the parts and none at the end; may be hostile.
        kind: `FILE`, `FOLDER`, or the words for what else it is, such as `a link`.
        size: Bytes it claims to have.
        read: Unpacks it and returns at most so many bytes of it.
    """

    name: str
    kind: str
    size: int
    read: Callable[[int], bytes]


class UnusableArchiveError(Exception):
    """An archive cannot be used; whoever reads it adds which one it is.

    Args:
        problem: What was expected and what was found.
        hint: One thing to do.
    """

    def __init__(self, problem: str, hint: str = REPACK) -> None:
        super().__init__(problem)
        self.problem = problem
        self.hint = hint
