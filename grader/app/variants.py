"""Variants drawn from a course key: the same key and student give the same values, and nothing else is kept."""

from __future__ import annotations

import hashlib
import hmac
import unicodedata
from dataclasses import dataclass
from pathlib import Path

from grader.app.seeds import read_key
from grader.core.errors import VariantError
from grader.core.exercise import Drawn, Exercise, Value
from grader.rubrics.loader import read_rubric
from grader.rubrics.variants import VariantOptions
from grader.submissions.collected import shown

#: Longest id of a student.
MOST_ID = 200
_SCHEME = "grader/variant/v1"
_TAKEN_BYTES = 16


@dataclass(frozen=True, slots=True)
class ByKey:
    """Draws from a course key.

    Attributes:
        key: The key.
        student: Whose values are drawn; case, surrounding blanks and ways to encode a letter make no difference.
    """

    key: bytes
    student: str

    def value(self, exercise: str, options: VariantOptions) -> Value | None:
        """Return the value that HMAC-SHA256 picks for exercise, variant and student."""
        text = "\n".join((_SCHEME, exercise, options.name, folded(self.student)))
        digest = hmac.new(self.key, text.encode(), hashlib.sha256).digest()
        # 128 bits make the first values likelier than the last by no more than one in 2 to the 114.
        return options.value(int.from_bytes(digest[:_TAKEN_BYTES], "big") % options.count)


def folded(student: str) -> str:
    """Return the id of a student so that it is always written in one way."""
    return unicodedata.normalize("NFKC", student).strip().casefold()


def by_key(path: Path, student: str) -> ByKey:
    """Return what draws a student's values; raises GraderError for a key or an id that cannot be used."""
    return ByKey(read_key(path, "course key"), checked(student))


def checked(student: str) -> str:
    """Return the id of a student without blanks around it; raises VariantError for one that is none."""
    plain = student.strip()
    if not folded(plain) or len(plain) > MOST_ID or not plain.isprintable():
        text = f"expected the id of a student, up to {MOST_ID} signs on one line, found `{shown(student)}`"
        raise VariantError(f"--student: {text}")
    return plain


def sheet(path: Path, key: Path, student: str) -> Exercise:
    """Return the exercise of a rubric as one student has it; raises GraderError for what cannot be used."""
    return read_rubric(path, draw=by_key(key, student))


def drawn(exercises: list[Exercise], student: str) -> Drawn | None:
    """Return the values that exercises were read with; None if nothing in them varies."""
    values = {e.id: dict(e.variant.values) for e in exercises if e.variant is not None}
    return Drawn(student, values) if values else None
