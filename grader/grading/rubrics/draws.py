"""How the value of each variant is chosen: drawn for a student, the first one, or the one of an earlier run."""

from __future__ import annotations

from typing import Protocol

from grader.grading.model.exercise import Drawn, Value
from grader.runtime.model.dataclass import dataclass


class Options(Protocol):
    """The possible values of a variant."""

    @property
    def name(self) -> str:
        """Its name in the rubric."""
        ...

    @property
    def count(self) -> int:
        """How many values there are."""
        ...

    def value(self, index: int) -> Value:
        """Return the value with the given index, counted from 0."""
        ...


class Draw(Protocol):
    """Chooses the value of each variant for a student."""

    @property
    def student(self) -> str:
        """The student whose values these are."""
        ...

    def value(self, exercise: str, options: Options) -> Value | None:
        """Return the value of a variant; None if it is not known."""
        ...


@dataclass(frozen=True, slots=True)
class First:
    """The first value of each variant, for reading a rubric without a student."""

    student: str = ""

    def value(self, exercise: str, options: Options) -> Value | None:
        """Return the first value."""
        del exercise
        return options.value(0)


@dataclass(frozen=True, slots=True)
class Recorded:
    """The values used in an earlier run, for judging its recording."""

    drawn: Drawn

    @property
    def student(self) -> str:
        """The student whose values these are."""
        return self.drawn.student

    def value(self, exercise: str, options: Options) -> Value | None:
        """Return the recorded value."""
        return self.drawn.values.get(exercise, {}).get(options.name)
