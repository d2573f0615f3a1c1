"""Variants: values of a rubric that differ from student to student."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

#: What may stand in a rubric in the place of a variant.
Value = str | int | float | bool


@dataclass(frozen=True, slots=True)
class Variant:
    """The values of one exercise for one student.

    Attributes:
        student: Whose they are, as staff wrote it; empty for nobody's.
        values: Name and value, in the order of the rubric.
    """

    student: str
    values: tuple[tuple[str, Value], ...]

    @property
    def said(self) -> str:
        """The values, each with its name."""
        return ", ".join(f"{name.replace('_', ' ')} {written(value)}" for name, value in self.values)


@dataclass(frozen=True, slots=True)
class Drawn:
    """The values of all exercises for one student.

    Attributes:
        student: Whose they are.
        values: Exercise id -> name -> value.
    """

    student: str
    values: Mapping[str, Mapping[str, Value]] = field(default_factory=dict)


def variant_notes(variant: Variant | None) -> tuple[str, ...]:
    """Return what a report says of the variant that was graded; nothing if nothing varies."""
    return () if variant is None else (f"graded by the variant of {variant.student}: {variant.said}",)


def written(value: Value) -> str:
    """Return a value as a rubric writes it."""
    return str(value).lower() if isinstance(value, bool) else str(value)
