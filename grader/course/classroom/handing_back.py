"""Puts the marks of a class, with their decisions, into pages for students that were made from its recordings again."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path

from grader.course.classroom.final_marks import MARK, KeptMark, load_mark, mark_fits, shown_mark
from grader.course.classroom.store import RESULT
from grader.grading.reporting.escape import shown
from grader.grading.reporting.html.final_mark import with_final_mark
from grader.grading.reporting.json_report import ReportData
from grader.runtime.files import write_whole
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError

#: Most names in one line of a warning.
_MOST = 10


@dataclass(frozen=True, slots=True)
class HandedBack:
    """A page for a student."""

    name: str  # name of the submission; hostile
    evidence: Path  # folder of the recordings that it was made from
    page: Path  # the page, which is there
    report: ReportData  # what the student may see, as the page shows it


def add_marks(pages: list[HandedBack]) -> Iterator[str]:
    """Put the mark that counts into each page whose recordings belong to a class; yield warnings.

    Raises GraderError if a page cannot be written.
    """
    unmarked, unfit = [], []
    for each in pages:
        folder = each.evidence.resolve().parent
        mark = _mark(folder)
        if mark is not None and mark_fits(mark, each.report):
            _mark_page(each.page, mark, each.report)
        elif mark is not None:
            unfit.append(each.name)
        elif (folder / RESULT).is_file():
            unmarked.append(each.name)
    if unfit:
        yield (
            f"without the mark in the gradebook, which was made from other points: {_named(unfit)}; "
            "run `grade batch` with the same rubric first"
        )
    if unmarked:
        yield f"without the mark in the gradebook, which is not kept: {_named(unmarked)}; run `grade batch` again first"


def _mark(folder: Path) -> KeptMark | None:
    with suppress(OSError):
        return load_mark((folder / MARK).read_bytes())
    return None


def _mark_page(path: Path, mark: KeptMark, report: ReportData) -> None:
    try:
        page = path.read_text(encoding="utf-8")
        write_whole(path, with_final_mark(page, shown_mark(mark, report)).encode())
    except OSError as error:
        raise GraderError(f"{path}: the mark cannot be written into it: {error.strerror or error}") from error


def _named(names: list[str]) -> str:
    more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
    return ", ".join(shown(name, limit=80) for name in names[:_MOST]) + more
