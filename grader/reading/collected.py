"""What an intake collected before anything is written: contents by name, what was left out, and the limits."""

from __future__ import annotations

import os
from collections.abc import Sequence
from dataclasses import dataclass, field

from grader.reading.quoting import listed, shown

MAX_FILES = 2_000
MAX_TOTAL_BYTES = 50 << 20
MAX_FILE_BYTES = 8 << 20
MAX_DEPTH = 20

#: Entries of any kind that are looked at before a folder or an archive is taken for something else than a submission.
MAX_ENTRIES = 20_000


@dataclass(frozen=True, slots=True)
class Collected:
    """Files that were read, not yet written anywhere.

    Attributes:
        files: Relative POSIX path and content; every path stays inside, and no two are the same.
        notes: Sentences about what was left out.
    """

    files: tuple[tuple[str, bytes], ...]
    notes: tuple[str, ...] = ()


@dataclass(slots=True)
class LeftOut:
    """Names of what was left out, by the reason."""

    by_reason: dict[str, dict[str, None]] = field(default_factory=dict)

    def add(self, reason: str, relative: str) -> None:
        """Take note of a path that is left out, once."""
        self.by_reason.setdefault(reason, {})[relative] = None

    def notes(self) -> tuple[str, ...]:
        """Return one sentence per reason, in an order that does not depend on how the system lists folders."""
        return tuple(
            self._note(reason, sorted(names, key=os.fsencode)) for reason, names in sorted(self.by_reason.items())
        )

    @staticmethod
    def _note(reason: str, names: Sequence[str]) -> str:
        first = [shown(name) for name in names[:3]]
        more = [f"{len(names) - 3} more"] if len(names) > 3 else []
        return f"not copied: {listed([*first, *more], 'and')} ({reason})"
