"""Feedback: how much of a criterion's result a student is shown, and until when."""

from __future__ import annotations

import re
from dataclasses import dataclass
from enum import Enum

#: What `until` may name besides a date; only a platform knows when it comes.
DUE_DATE, PUBLISHED = "due_date", "published"
_DATE = re.compile(r"[0-9]{4}-[0-9]{2}-[0-9]{2}")


class Audience(str, Enum):
    """Who reads a report."""

    STUDENT = "student"
    INSTRUCTOR = "instructor"


class Shows(str, Enum):
    """How much of a criterion's result a student sees, from everything to nothing."""

    ALL = "all"
    WITHOUT_NUMBERS = "reason_without_numbers"
    OUTCOME = "outcome_only"
    NOTHING = "nothing"


#: From the most open to the closest.
ORDER = tuple(Shows)


@dataclass(frozen=True, slots=True)
class Feedback:
    """What a student sees of one criterion.

    Attributes:
        shows: How much.
        until: The last day on which that holds, as `2026-12-01`, after which all is shown; `due_date` or `published`
            for what only a platform knows; empty for ever.
    """

    shows: Shows = Shows.ALL
    until: str = ""

    def on(self, day: str) -> Shows:
        """Return how much is shown on a day, written as `2026-12-01`."""
        over = _DATE.fullmatch(self.until) is not None and day > self.until
        return Shows.ALL if over else self.shows


#: Where a rubric says nothing else.
OPEN = Feedback()


def strictest(shown: tuple[Shows, ...]) -> Shows:
    """Return the closest of several; all is shown of none."""
    return max(shown, key=ORDER.index, default=Shows.ALL)
