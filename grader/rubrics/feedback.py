"""The `feedback` key of a rubric and of a criterion: its pydantic model, and the resulting policy."""

from __future__ import annotations

from datetime import date
from typing import Annotated, Any, Literal

from pydantic import AfterValidator, Discriminator, Field, Tag, WithJsonSchema, model_validator
from typing_extensions import Self

from grader.core.exercise import DUE_DATE, OPEN, ORDER, PUBLISHED, Feedback, Shows
from grader.rubrics.mistakes import nearest
from grader.rubrics.types import Shape, wrong
from grader.submissions.collected import listed

_EVENTS = (DUE_DATE, PUBLISHED)
_EXPECTED = f"a date such as 2026-12-01, {listed(_EVENTS)}"


def _shows(value: object) -> str:
    words = [shows.value for shows in ORDER]
    if not isinstance(value, str) or value not in words:
        raise wrong(listed(words), nearest(value, words) if isinstance(value, str) else "")
    return value


def _until(value: object) -> str:
    text = value if isinstance(value, str) else ""
    if text in _EVENTS:
        return text
    try:
        # Only this form is accepted: Python reads others too, but they do not sort.
        if date.fromisoformat(text).isoformat() != text:
            raise ValueError
    except ValueError:
        raise wrong(_EXPECTED) from None
    return text


_Words = Annotated[
    Any, AfterValidator(_shows), WithJsonSchema({"type": "string", "enum": [shows.value for shows in ORDER]})
]
_Until = Annotated[
    Any,
    AfterValidator(_until),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": f"^([0-9]{{4}}-[0-9]{{2}}-[0-9]{{2}}|{'|'.join(_EVENTS)})$",
            "examples": ["2026-12-01"],
        }
    ),
]


class FeedbackShape(Shape):
    """How much a student is shown, and the last day on which that holds."""

    show: _Words
    until: _Until = Field(default=None, description="afterwards all is shown; without, that never comes")

    @model_validator(mode="after")
    def _has_a_meaning(self) -> Self:
        if self.show == Shows.ALL.value and self.until:
            raise wrong("no `until` where all is shown")
        if self.until in _EVENTS and self.show != Shows.NOTHING.value:
            raise wrong(f"a date as `until` of {self.show}", "platforms show a result or hide it; only `nothing` waits")
        return self


def _kind(value: object) -> Literal["mapping", "word"]:
    return "mapping" if isinstance(value, dict) else "word"


#: Value of the key `feedback`.
FeedbackField = Annotated[
    Annotated[_Words, Tag("word")] | Annotated[FeedbackShape, Tag("mapping")], Discriminator(_kind)
]


def feedback_of(written: str | FeedbackShape | None, usual: Feedback = OPEN) -> Feedback:
    """Return the policy as written, or the usual one if none is."""
    if written is None:
        return usual
    if isinstance(written, FeedbackShape):
        return Feedback(Shows(written.show), written.until or "")
    return Feedback(Shows(written))
