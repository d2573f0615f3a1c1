"""Links from the page of one student to the page of the class and to its neighbours there, put into a finished page."""

from __future__ import annotations

from grader.grading.reporting.html.assets import fill
from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class ClassLinks:
    """Where the links of a student's page lead; addresses are relative to the page and percent-encoded."""

    back: str  # address of the class page
    number: int  # position of the student among those with a page, from 1
    count: int  # number of students with a page
    before: tuple[str, str] | None = None  # address and name of the student before; None for the first
    after: tuple[str, str] | None = None  # address and name of the student after; None for the last


def with_class_links(page: str, links: ClassLinks) -> str:
    """Return a page with these links in its header, in place of any earlier ones; names may be hostile."""
    return fill(page, "class-links", links=links)
