"""Name, final mark and an instructor's decisions, put into a finished page of a student; also the page of a refusal."""

from __future__ import annotations

from markupsafe import Markup

from grader.core.dataclass import dataclass
from grader.reporting.html.assets import bundle, fill, page_template


@dataclass(frozen=True, slots=True)
class FinalMark:
    """What a class knows of a student's mark besides the report."""

    student: str  # the student's name
    score: str = ""  # the mark that counts, as a phrase; empty if there is none, or not for students
    decisions: tuple[str, ...] = ()  # what an instructor decided, a sentence each


def with_final_mark(page: str, mark: FinalMark) -> str:
    """Return a page with this mark in its header, in place of any earlier one; its texts may be hostile."""
    return fill(page, "final-mark", mark=mark)


def render_refusal(mark: FinalMark, problem: str, hint: str) -> str:
    """Return the page of a student whose submission cannot be used, which makes no network requests."""
    style = Markup(bundle().style)  # noqa: S704  our own style sheet
    made = page_template("refusal").render(mark=mark, problem=problem, hint=hint, style=style)
    return with_final_mark(made, mark)
