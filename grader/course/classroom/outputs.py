"""Output for the whole class: page, gradebook, platform files, JSON, and the summary on the terminal."""

from __future__ import annotations

import statistics
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import field
from fractions import Fraction
from pathlib import Path

from grader.course.class_page.contents import PageLink
from grader.course.class_page.render import class_assets, render_class
from grader.course.classroom.class_page import RunOfClass, class_page
from grader.course.classroom.gradebook import (
    Gradebook,
    Row,
    Status,
    decision_line,
    points_text,
    render_gradebook,
    row_remarks,
)
from grader.course.classroom.platforms import (
    Export,
    export_canvas,
    export_gradescope,
    export_moodle,
    feedback,
    withheld,
)
from grader.course.classroom.roster import Table, read_table
from grader.grading.model.report import JsonObject
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.json_report import json_text
from grader.grading.reporting.rejudged import ReportChange, change_summary
from grader.runtime.model.dataclass import dataclass

PAGE, GRADEBOOK, CLASS, ASSETS = "index.html", "gradebook.csv", "batch.json", "assets"
#: What a run that graded again changed.
CHANGES = "changes.csv"
SCHEMA = "grader/batch/v1"
#: Most names in one line of the summary.
_MOST = 10
#: Suffixes of files that people open.
_OPENED = (".csv", ".html")
#: Statuses without a line of their own in the summary.
_UNREMARKABLE = {Status.GRADED, Status.MISSING, Status.EXCUSED}


@dataclass(frozen=True, slots=True)
class Platforms:
    """The platforms to export scores to."""

    canvas: str = ""  # number of the assignment in Canvas; empty for no export to Canvas
    canvas_gradebook: Table | None = None  # the gradebook exported from Canvas; None if the roster has the Canvas ids
    moodle: Table | None = None  # the users exported from Moodle; None for no export to Moodle
    gradescope: bool = False  # whether to export to Gradescope


def platforms(canvas: str, canvas_gradebook: Path | None, moodle: Path | None, *, gradescope: bool) -> Platforms:
    """Read the tables for the requested platforms; raises ClassError for an unusable table."""
    return Platforms(
        canvas,
        None if canvas_gradebook is None else read_table(canvas_gradebook),
        None if moodle is None else read_table(moodle),
        gradescope,
    )


def exports(book: Gradebook, wanted: Platforms, results: Mapping[str, str]) -> dict[str, Export]:
    """Return platform -> its export; raises ClassError if a platform would reject it."""
    made: dict[str, Export] = {}
    if wanted.canvas:
        made["canvas"] = export_canvas(book, wanted.canvas, wanted.canvas_gradebook)
    if wanted.moodle is not None:
        made["moodle"] = export_moodle(book, wanted.moodle)
    if wanted.gradescope:
        made["gradescope"] = export_gradescope(book, results)
    return made


def reveals(book: Gradebook) -> str:
    """Return a warning if exported scores reveal what students may not see; empty if they do not."""
    hidden = withheld(book)
    if not hidden:
        return ""
    criteria = "a criterion" if len(hidden) == 1 else f"{len(hidden)} criteria"
    first = ", ".join(hidden[:_MOST])
    return (
        f"the exported grades include {criteria} that the rubric hides from students ({first}): "
        "students can compute the result from the grade; import the grades once they may see it"
    )


def class_files(
    book: Gradebook,
    made: Mapping[str, Export],
    run: RunOfClass,
    *,
    links: Sequence[PageLink] = (),
    standalone: bool = False,
) -> dict[str, bytes]:
    """Return name -> content of all files for the class, relative to the results folder; the page is last.

    A standalone page includes its scripts, instead of sharing them with the reports.
    """
    files = {GRADEBOOK: render_gradebook(book).encode()}
    for export in made.values():
        files.update({name: text.encode() for name, text in export.files.items()})
    if not standalone:
        files.update({f"{ASSETS}/{name}": data for name, data in class_assets().items()})
    files[PAGE] = render_class(class_page(book, run, links), assets=None if standalone else ASSETS).encode()
    return files


@dataclass(frozen=True, slots=True)
class GradedNow:
    """What one run of the command graded."""

    judged: int = 0  # submissions judged again from kept recordings, without running anything
    run: int = 0  # submissions whose programs ran
    partly_run: int = 0  # those of them that ran only for the exercises that had to be recorded again
    not_replaced: tuple[str, ...] = ()  # names of submissions whose earlier, better result was kept


_NOTHING = GradedNow()


@dataclass(frozen=True, slots=True)
class Graded:
    """A class after grading."""

    book: Gradebook
    graded: int  # number of submissions graded in this run
    kept_before: int  # number of submissions that already had results
    now: GradedNow = _NOTHING  # how the submissions of this run were graded
    # Submissions with the same files as before that were graded again, compared with their report from before
    changes: tuple[ReportChange, ...] = ()
    files: tuple[Path, ...] = ()  # the files written for the whole class
    # Platform -> who is missing in its file, and why
    left_out: Mapping[str, tuple[str, ...]] = field(default_factory=dict)
    remarks: tuple[str, ...] = ()  # remarks about these files
    # Final marks that differ from those of the last run, as `NAME 28 -> 20`
    moved: tuple[str, ...] = ()
    links: tuple[PageLink, ...] = ()  # further pages in the results folder, linked from the class page


def render_graded(graded: Graded) -> str:
    """Summarise the class in a few lines: counts, scores, and everybody who needs attention."""
    book = graded.book
    lines = [f"graded now: {graded.graded}{_how(graded.now)}, done before: {graded.kept_before}"]
    lines += change_summary(graded.changes) if graded.changes else []
    lines += [f"{status.value}: {book.count(status)}" for status in Status if book.count(status)]
    lines += _scores(book)
    lines += _list("final marks that differ from the last run", graded.moved)
    lines += _decisions(book)
    lines += _lists(book, graded.now.not_replaced)
    lines += [f"not in {platform}: {line}" for platform, out in graded.left_out.items() for line in out]
    lines += [f"note: {remark}" for remark in graded.remarks]
    lines += [f"written: {shown(str(path), limit=300)}" for path in graded.files if path.suffix in _OPENED]
    return "\n".join(lines) + "\n"


def _how(now: GradedNow) -> str:
    """Tell how many were judged from recordings and how many run; empty if all were run."""
    if not now.judged and not now.partly_run:
        return ""
    partly = f", {now.partly_run} of them only for what changed" if now.partly_run else ""
    return f" ({now.judged} from kept recordings, {now.run} run{partly})"


def summary_json(graded: Graded) -> str:
    """Render the class as JSON."""
    book = graded.book
    matching, to_export = book.matching, book.to_export
    return json_text(
        {
            "schema": SCHEMA,
            "graded_now": graded.graded,
            "done_before": graded.kept_before,
            "judged_again": graded.now.judged,
            "run_now": graded.now.run,
            "not_replaced": list(graded.now.not_replaced),
            "moved": json_value(graded.moved),
            "counts": {status.value: book.count(status) for status in Status},
            "students": [_row(row, exported=any(row is each for each in to_export)) for row in book.rows],
            "unmatched": list(matching.unmatched),
            "ambiguous": list(matching.ambiguous),
            "duplicates": [list(names) for names in matching.duplicates],
            "strays": json_value(book.strays),
            "left_out": {platform: list(lines) for platform, lines in graded.left_out.items()},
            "remarks": json_value([*book.remarks, *graded.remarks]),
            "withheld": list(withheld(book)),
            "results_of_nobody": list(book.foreign),
            "layouts": [{"source": json_value(source), "layout": layout} for source, layout in book.layouts],
        }
    )


def _row(row: Row, *, exported: bool) -> JsonObject:
    person, adjusted = row.person, row.adjusted
    return {
        "name": row.name or None,
        "label": json_value(row.label),
        "person": None if person is None else json_value(person.name),
        "status": row.status.value,
        "score": json_value(adjusted.score),
        "raw_score": None if row.report is None else row.report["score"],
        "max_score": json_value(row.max_score),
        "days_late": json_value(adjusted.days_late),
        "penalty": json_value(adjusted.penalty),
        "override": json_value(adjusted.override),
        "bonus": json_value(adjusted.bonus) if adjusted.bonus else None,
        "reason": json_value(adjusted.reason) or None,
        "decision": json_value(decision_line(row)) or None,
        "problem": json_value(row.problem) or None,
        "remarks": json_value(row_remarks(row)),
        "outdated": row.outdated,
        "exported": exported,
        "platform_ids": {} if person is None else json_value(person.platform_ids),
        "feedback": json_value(feedback(row)) if exported else None,
    }


def _scores(book: Gradebook) -> Iterator[str]:
    rows = [(row.adjusted, row.max_score) for row in book.rows if row.max_score]
    raw = [adjusted.raw / most for adjusted, most in rows if adjusted.raw is not None]
    final = [adjusted.score / most for adjusted, most in rows if adjusted.score is not None]
    changed = any(row.adjusted.changed for row in book.rows)
    if raw:
        yield f"{'scores as graded' if changed else 'scores'}: {_spread(raw)}"
    if changed and final:
        yield f"final marks: {_spread(final)}"


def _spread(shares: Sequence[Fraction]) -> str:
    percent = [float(100 * share) for share in shares]
    full = sum(share >= 100 for share in percent)
    return (
        f"mean {statistics.fmean(percent):.1f} %, median {statistics.median(percent):.1f} %, "
        f"from {min(percent):.1f} to {max(percent):.1f} %, full: {full}"
    )


def _decisions(book: Gradebook) -> Iterator[str]:
    """Yield every decision that is applied, each in a line of its own: none may pass unseen."""
    decided = [(row, line) for row in book.rows if (line := decision_line(row))]
    if decided:
        yield f"decisions ({len(decided)}):"
    for row, line in decided:
        yield f"    {shown(row.distinct_name, limit=120)} {shown(line, limit=600)}"


def _lists(book: Gradebook, not_replaced: Sequence[str]) -> Iterator[str]:
    matching = book.matching
    twins = [" = ".join(names) for names in matching.duplicates]
    yield from _list("not on the roster", matching.unmatched)
    yield from _list("matches several people on the roster", matching.ambiguous)
    yield from _list("several submissions of one person", twins)
    for status in (Status.MISSING, Status.EXCUSED):
        yield from _list(status.value, [row.distinct_name for row in book.rows if row.status is status])
    yield from _list("not a submission", book.strays)
    yield from _list("results without a submission", book.foreign)
    yield from _list("a new attempt failed, the earlier result is kept", not_replaced)
    yield from _list("outdated results, of other files or another rubric", [r.name for r in book.rows if r.outdated])
    for row in book.rows:
        if row.status not in _UNREMARKABLE:
            yield f"{row.status.value}: {shown(row.name, limit=80)}: {shown(row.problem or _points(row), limit=300)}"
            if row.hint:
                yield f"    hint: {shown(row.hint, limit=300)}"
    yield from map(shown, book.remarks)


def _points(row: Row) -> str:
    score = None if row.report is None else row.report["score"]
    return f"{points_text(score)}/{points_text(row.max_score)} so far"


def _list(title: str, names: Sequence[str]) -> Iterator[str]:
    if names:
        first = ", ".join(shown(name, limit=120) for name in names[:_MOST])
        more = f" and {len(names) - _MOST} more" if len(names) > _MOST else ""
        yield f"{title} ({len(names)}): {first}{more}"
