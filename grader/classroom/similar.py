"""Compares the submissions of a class, and writes the pages of those that are alike; no score depends on it."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from grader.classroom.gradebook import Row
from grader.classroom.intake import HandedInEntry
from grader.classroom.store import Store
from grader.reporting.class_page.contents import PageLink
from grader.similarity.finding import find_similar, read_programs
from grader.similarity.library import ComparedProgram, Handed, Similar
from grader.similarity.pages import MOST_PAGES, OVERVIEW, page_name, render_overview, render_pair, render_table

FOLDER, TABLE = "similarity", "similarity.csv"
_TITLE = "Similar submissions"


@dataclass(frozen=True, slots=True)
class Compared:
    """What came of comparing a class: a sentence for the summary, the files to open, and the link to the page."""

    remark: str
    files: tuple[Path, ...]
    link: PageLink


def compare_class(
    entries: Sequence[HandedInEntry], rows: Sequence[Row], given: Sequence[ComparedProgram], store: Store
) -> Compared:
    """Compare all submissions, and write what was found.

    Args:
        entries: The submissions.
        rows: How they stand.
        given: The files that everybody was given.
        store: Receives the pages.

    Raises:
        HarnessError: They cannot be written.
    """
    standing = {row.name: row for row in rows}
    handed = [_handed(entry, standing.get(entry.name)) for entry in entries]
    similar = find_similar(_told_apart(handed), given)
    pages = [page_name(rank) for rank in range(min(MOST_PAGES, len(similar.pairs)))]
    for rank, name in enumerate(pages):
        store.write(f"{FOLDER}/{name}", render_pair(similar, rank).encode())
    table = store.write(TABLE, render_table(similar).encode())
    overview = store.write(f"{FOLDER}/{OVERVIEW}", render_overview(similar).encode())
    for old in (store.folder / FOLDER).glob("pair-*.html"):
        if old.name not in pages:
            old.unlink(missing_ok=True)
    found = _counted(similar)
    return Compared(f"similar submissions: {found}", (table, overview), _link(found))


def link_of_before(store: Store) -> tuple[PageLink, ...]:
    """Return the link to what an earlier run found, if one did."""
    return (_link("of an earlier run"),) if (store.folder / FOLDER / OVERVIEW).is_file() else ()


def _link(note: str) -> PageLink:
    return PageLink(_TITLE, f"{FOLDER}/{OVERVIEW}", note)


def _handed(entry: HandedInEntry, row: Row | None) -> Handed:
    programs, passed_over = ((), ()) if entry.problem else read_programs(entry.path)
    return Handed(
        name=entry.name,
        label=entry.label if row is None else row.shown_name,
        programs=programs,
        passed_over=("it cannot be used",) if entry.problem else passed_over,
        own=() if row is None else row.twin_of,
        reported=row is not None and row.report is not None,
    )


def _told_apart(handed: Sequence[Handed]) -> list[Handed]:
    """Return the submissions; people of the same name are called by that of the submission too."""
    count = Counter(one.label for one in handed)
    return [replace(one, label=f"{one.label} ({one.name})") if count[one.label] > 1 else one for one in handed]


def _counted(similar: Similar) -> str:
    pairs = f"{len(similar.pairs)} pair{'' if len(similar.pairs) == 1 else 's'}"
    same = len(similar.same)
    return f"{pairs}, {same} file{'' if same == 1 else 's'} handed in by several" if same else pairs
