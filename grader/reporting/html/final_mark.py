"""Name, final mark and an instructor's decisions, put into a finished page of a student; also the page of a refusal."""

from __future__ import annotations

import re
from dataclasses import dataclass

from markupsafe import Markup

from grader.reporting.html.assets import bundle, page_environment

# Every page holds this once, in its header and before any text of a student; all other text is escaped.
_PLACE = re.compile(r"<!--final-mark-->.*?<!--/final-mark-->", re.DOTALL)


@dataclass(frozen=True, slots=True)
class FinalMark:
    """What a class knows of a student's mark besides the report."""

    student: str  # the student's name
    score: str = ""  # the mark that counts, as a phrase; empty if there is none, or not for students
    decisions: tuple[str, ...] = ()  # what an instructor decided, a sentence each


def with_final_mark(page: str, mark: FinalMark) -> str:
    """Return a page with this mark in its header, in place of any earlier one; its texts may be hostile."""
    made = page_environment("grader.reporting.html").get_template("final_mark.html").render(mark=mark)
    return _PLACE.sub(lambda _: f"<!--final-mark-->{made}<!--/final-mark-->", page, count=1)


def render_refusal(mark: FinalMark, problem: str, hint: str) -> str:
    """Return the page of a student whose submission cannot be used, which makes no network requests."""
    page = page_environment("grader.reporting.html").get_template("refusal.html")
    made = page.render(mark=mark, problem=problem, hint=hint, style=Markup(bundle().style))  # noqa: S704  our own style sheet
    return with_final_mark(made, mark)
