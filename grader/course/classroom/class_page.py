"""Builds the contents of the class page, without absolute paths of this machine."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path, PurePath

from grader.course.class_page.class_links import ClassLinks
from grader.course.class_page.contents import (
    ClassPage,
    Listing,
    PageEntry,
    PageLink,
    RowTone,
    RunFacts,
    StudentRow,
)
from grader.course.class_page.render import REPORT_PAGE, result_link
from grader.course.classroom.gradebook import (
    Gradebook,
    Row,
    Status,
    decision_line,
    exactly,
    report_exercises,
    row_remarks,
)
from grader.course.classroom.roster import Person
from grader.course.classroom.store import Conditions
from grader.course.classroom.watching import clock_time
from grader.grading.reporting.json_report import ReportData
from grader.runtime.model.checkup import NO_SANDBOX
from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class RunOfClass:
    """One run of the command over a class."""

    conditions: Conditions  # what the results depend on
    title: str = ""
    written: str = ""  # when the run ended, as text
    jobs: int = 1  # submissions graded in parallel
    took_s: float = 0.0  # how long grading took
    graded: int = 0  # number of submissions graded in this run
    kept: int = 0  # number of submissions that already had results
    stopped: bool = False  # whether the run was stopped before all submissions were graded
    folders: tuple[str, ...] = ()  # absolute paths of this machine, to be removed from the page


def title_of(sources: Sequence[Path]) -> str:
    """Make the title of a class from the names of its sources, without their parent folders."""
    return ", ".join(source.resolve().name for source in sources)


def folder_spellings(paths: Sequence[Path]) -> tuple[str, ...]:
    """Return the spellings of folders that messages may contain, the longest first."""
    found = {str(path) for path in paths} | {str(path.resolve()) for path in paths}
    return tuple(sorted((folder for folder in found if folder.startswith("/")), key=lambda f: (-len(f), f)))


_MIB = 1 << 20


def run_facts(book: Gradebook, run: RunOfClass) -> RunFacts:
    """Build the header of the page."""
    reports = [row.report for row in book.rows if row.report is not None]
    counts = [f"{book.count(status)} {status.value}" for status in Status if book.count(status)]
    now = "" if run.stopped else f"graded now: {run.graded}, done before: {run.kept}"
    parts = [", ".join(counts), now, f"took {clock_time(run.took_s)}", run.written]
    line = "; ".join(part for part in parts if part)
    return RunFacts(line, tuple(_rows(book, run, reports)), tuple(_warnings(run, reports)))


def _rows(book: Gradebook, run: RunOfClass, reports: Sequence[ReportData]) -> Iterator[tuple[str, str]]:
    conditions, options = run.conditions, run.conditions.options
    seed = options.seed
    yield "grader", _counted(_versions(report) for report in reports) or conditions.grader
    yield "rubrics", ", ".join(f"{id_} {digest}" for id_, digest in conditions.rubrics)
    if conditions.recording:
        yield "recording", conditions.recording
    yield "clock", _clock(options.clock, reports)
    yield "isolation", f"requested: {options.isolation}; {_counted(_isolation(r) for r in reports) or 'nothing ran'}"
    yield (
        "seed",
        f"{seed} for all submissions" if seed is not None else "from the seed key and the submitted files",
    )
    yield "jobs", str(run.jobs)
    yield "cost", _cost(book)
    yield "sources", ", ".join(f"{PurePath(source).name or source} ({layout})" for source, layout in book.layouts)


def _warnings(run: RunOfClass, reports: Sequence[ReportData]) -> Iterator[str]:
    if run.stopped:
        yield "This run was stopped before everybody was graded; run the same command again to continue."
    bare = sum(_isolation(report) == NO_SANDBOX for report in reports)
    if bare:
        yield f"No isolation: {bare} of {len(reports)} submissions ran without a sandbox."


def _versions(report: ReportData) -> str:
    made = report.get("environment", {})
    names = ("grader", "rclpy", "ros_distro", "rmw", "python")
    return ", ".join(f"{name} {made[name]}" for name in names if made.get(name))


def _isolation(report: ReportData) -> str:
    return str(report.get("environment", {}).get("isolation", ""))


def _clock(asked: str, reports: Sequence[ReportData]) -> str:
    on_wall = sum(any(e.get("clock") == "wall" for e in report["exercises"]) for report in reports)
    return f"requested: {asked}; partly or wholly on the wall clock: {on_wall} of {len(reports)}"


def _cost(book: Gradebook) -> str:
    used = [row.result for row in book.rows if row.result is not None]
    processor = sum(status.usage.get("processor_s", 0.0) for status in used)
    peak = max((status.usage.get("peak_bytes", 0.0) for status in used), default=0.0)
    return f"{processor:.1f} s of processor time in all, at most {peak / _MIB:.0f} MiB in one process of the grader"


def _counted(texts: Iterable[str]) -> str:
    """Join the distinct texts; if there are several, with a count for each."""
    counts = Counter(text for text in texts if text)
    if len(counts) <= 1:
        return next(iter(counts), "")
    return "; ".join(f"{text} ({count})" for text, count in sorted(counts.items()))


_TONES = {
    Status.GRADED: RowTone.FINE,
    Status.UNDECIDED: RowTone.OURS,
    Status.FAILED: RowTone.OURS,
    Status.REFUSED: RowTone.THEIRS,
    Status.NOT_RUN: RowTone.NOTHING,
    Status.MISSING: RowTone.NOTHING,
    Status.EXCUSED: RowTone.NOTHING,
}
_NOT_GRADED = (Status.REFUSED, Status.FAILED, Status.NOT_RUN)
# A path with three or more parts in a problem is a path of this machine; ROS names are shorter.
_PATH = re.compile(r"(?<![\w.])/(?:[^/\s:'\"`]+/){2,}([^/\s:'\"`]+)")
_ENDED = {"exited": "ended by itself", "killed": "was killed", "hung": "did not return"}


def class_page(book: Gradebook, run: RunOfClass, links: Sequence[PageLink] = ()) -> ClassPage:
    """Build the page of a class, with links to other pages in the results folder."""
    rows = rows_in_order(book.rows)
    students = tuple(_student(row, run) for row in rows)
    listings = [listing for listing in _listings(book, rows, run) if listing.entries]
    return ClassPage(run.title, run_facts(book, run), students, tuple(listings), tuple(links))


def rows_in_order(rows: Iterable[Row]) -> list[Row]:
    """Return the rows in the order of the class page: by surname, then by the rest of the name."""
    return sorted(rows, key=lambda row: (*_sort_key(row), row.name))


def _sort_key(row: Row) -> tuple[str, str]:
    name, person = _name(row), row.person
    return person.sort_key if person is not None and person.name == name else Person(name).sort_key


def links_between(book: Gradebook) -> dict[str, ClassLinks]:
    """Return name of an entry -> the links of its page to the class page and to its neighbours on that page."""
    rows = [row for row in rows_in_order(book.rows) if row.report is not None]
    pages = [(f"../{result_link(row.name, REPORT_PAGE).removeprefix('students/')}", _name(row)) for row in rows]
    neighbours = [None, *pages, None]
    return {
        row.name: ClassLinks("../../index.html", k + 1, len(rows), neighbours[k], neighbours[k + 2])
        for k, row in enumerate(rows)
    }


def _student(row: Row, run: RunOfClass) -> StudentRow:
    adjusted = row.adjusted
    return StudentRow(
        folder=row.name,
        name=_name(row),
        also=tuple(dict.fromkeys(text for text in _also(row) if text and text != _name(row))),
        status=row.standing,
        tone=_TONES[row.status],
        raw=None if row.report is None else exactly(row.report["score"]),
        max_score=row.max_score,
        final=adjusted.score,
        adjustments=tuple(line for line in [decision_line(row)] if line),
        remarks=tuple(without_folders(text, run.folders) for text in row_remarks(row)),
        report=row.report,
        counts=not adjusted.ignored,
    )


def _name(row: Row) -> str:
    """Return the display name of a row; an email address known only from a file name is not used."""
    person = row.person
    unsure = person is not None and person.row is None and person.name == person.email
    return row.label if unsure else row.shown_name


def _also(row: Row) -> Iterator[str]:
    yield row.name
    if row.person is not None:
        yield from (row.person.user, row.person.id, row.person.email if row.person.row is not None else "")


def _listings(book: Gradebook, rows: Sequence[Row], run: RunOfClass) -> Iterator[Listing]:
    """Yield all lists, including empty ones."""
    undecided = [(k, row) for k, row in enumerate(rows) if row.status is Status.UNDECIDED]
    yield Listing(
        "rubric-mistakes",
        "Mistakes in the rubric",
        "They leave criteria undecided. Correct the rubric and run the same command again.",
        tuple(
            PageEntry(f"{mistake} (submissions: {len(concerned)})", rows.index(concerned[0]))
            for mistake, concerned in book.author_mistakes.items()
        ),
    )
    yield Listing(
        "undecided",
        "Undecided",
        "Each entry says why it is not final. The same command with --rerun undecided grades these again.",
        tuple(entry for k, row in undecided for entry in _undecided(k, row, run)),
    )
    yield Listing(
        "not-graded",
        "Not graded",
        "These have no report. Students have to fix refused submissions; --rerun failed grades the failed ones again.",
        tuple(
            PageEntry(f"{row.standing}{_problem(row, run)}", k)
            for k, row in enumerate(rows)
            if row.status in _NOT_GRADED
        ),
    )
    yield Listing(
        "faults",
        "Crashed or ended early",
        "Programs that raised an exception, hung, or ended too early.",
        tuple(entry for k, row in enumerate(rows) for entry in _faults(k, row)),
    )
    yield from _roster(book, rows, run)


def _roster(book: Gradebook, rows: Sequence[Row], run: RunOfClass) -> Iterator[Listing]:
    matching = book.matching
    place = {row.name: k for k, row in enumerate(rows) if row.name}

    def named(names: Sequence[str], text: str) -> tuple[PageEntry, ...]:
        return tuple(PageEntry(text, place.get(name)) for name in names)

    twins = tuple(PageEntry(" = ".join(names), place.get(names[0])) for names in matching.duplicates)
    missing, excused = (
        tuple(PageEntry(status.value, k) for k, row in enumerate(rows) if row.status is status)
        for status in (Status.MISSING, Status.EXCUSED)
    )
    outdated = [row.name for row in rows if row.outdated]
    yield Listing(
        "unmatched",
        "Not on the roster",
        "These submissions match nobody on the roster, or more than one person.",
        named(matching.unmatched, "matches nobody") + named(matching.ambiguous, "matches several people"),
    )
    yield Listing(
        "duplicates",
        "Several submissions",
        "All of them are graded; name those to ignore in the file of adjustments.",
        twins,
    )
    yield Listing("missing", "Nothing handed in", "People on the roster without a submission.", missing)
    yield Listing("excused", "Excused", "People without a submission who do not count, by a decision.", excused)
    yield Listing(
        "outdated",
        "Outdated results",
        "The files or the rubric have changed since these were graded.",
        named(outdated, "graded before"),
    )
    yield Listing(
        "strays", "Not submissions", "Files and folders in the sources that were left out.", _texts(book.strays, run)
    )
    yield Listing(
        "foreign",
        "Results without a submission",
        "Results of earlier runs whose submissions are not in the sources.",
        _texts(book.foreign, run),
    )
    yield Listing("remarks", "Remarks", "Other notes on this run.", _texts(book.remarks, run))


def _texts(texts: Sequence[str], run: RunOfClass) -> tuple[PageEntry, ...]:
    return tuple(PageEntry(without_folders(text, run.folders)) for text in texts)


def _undecided(index: int, row: Row, run: RunOfClass) -> Iterator[PageEntry]:
    for exercise in report_exercises(row.report):
        if why := exercise.get("unchecked"):
            yield PageEntry(f"{exercise['title']}: {without_folders(why, run.folders)}", index)
        for criterion in exercise["criteria"]:
            if criterion["outcome"] == "undecided":
                reason = without_folders(str(criterion["reason"]), run.folders)
                yield PageEntry(f"{criterion['title']}: {reason}", index, f"{exercise['id']}-{criterion['id']}")


def _problem(row: Row, run: RunOfClass) -> str:
    hint = row.result.hint if row.result is not None else ""
    parts = [without_folders(text, run.folders) for text in (row.problem, hint and f"hint: {hint}") if text]
    return f": {'; '.join(parts)}" if parts else ""


def _faults(index: int, row: Row) -> Iterator[PageEntry]:
    for exercise in report_exercises(row.report):
        for fault in exercise.get("faults", ()):
            where = f"{fault['file']}:{fault['line']}" if fault["line"] else fault["file"] or "a node"
            what = _ENDED.get(fault["kind"], str(fault["kind"]).replace("_", " "))
            when = f" at t = {fault['t_s']:.3f} s" if fault["t_s"] else ""
            text = str(fault["text"]).strip().rsplit("\n", 1)[-1]
            yield PageEntry(f"{where}: {what}{when}: {text}", index, str(exercise["id"]))


def without_folders(text: str, folders: Sequence[str]) -> str:
    """Make paths in a sentence relative to the folders of the class, longest first; cut others to their last part."""
    for folder in folders:
        text = text.replace(f"{folder}/", "").replace(folder, folder.rsplit("/", 1)[-1])
    return _PATH.sub(r"\1", text)
