"""Who reads the reports of a run, and when."""

from __future__ import annotations

from dataclasses import dataclass

from grader.model.feedback import Audience


@dataclass(frozen=True, slots=True)
class Readers:
    """Who reads the reports of a run, and when.

    Attributes:
        audience: Who reads all of them; None for students where a platform shows a format to them, else instructors.
        day: The day, as `2026-12-01`, by which dates in a rubric are over or not; before all of them if it is empty.
    """

    audience: Audience | None = None
    day: str = ""

    def of(self, usual: Audience) -> Audience:
        """Return who reads a format that is usually read by some."""
        return self.audience or usual

    @property
    def only_students(self) -> bool:
        """Whether nothing of the run is for instructors, so that not even an exit code may tell more."""
        return self.audience is Audience.STUDENT


#: Nobody is named, so formats say who reads them.
ANYBODY = Readers()
