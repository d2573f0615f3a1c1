"""The command `grade rejudge`: judges kept evidence again without running anything."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING

import click

from grader.cli.completion import complete_exercise
from grader.cli.options import (
    PATH,
    RUBRIC,
    audience_options,
    complain,
    parse_percent,
    print_result,
    readers,
    write_file,
)
from grader.cli.outputs import outputs_option
from grader.grading.reporting.formats import EVIDENCE, FORMATS, known

if TYPE_CHECKING:
    from collections.abc import Sequence
    from fractions import Fraction

    from grader.grading.app.rejudge import Judgement, Wanted
    from grader.grading.reporting.audience import Readers
    from grader.grading.reporting.delivery import Output
    from grader.grading.reporting.json_report import ReportData

#: The format of pages, which show the mark that counts where students read them.
PAGE = "html"


@click.command(name="rejudge")
@click.argument("evidence", metavar="EVIDENCE...", nargs=-1, required=True, type=PATH)
@click.option(
    "--exercise",
    "exercises",
    metavar="ID",
    multiple=True,
    shell_complete=complete_exercise,
    help="Judge only this exercise; repeatable.",
)
@click.option("--rubric", "rubrics", type=RUBRIC, multiple=True, help="Use this rubric; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
@click.option("-v", "--verbose", is_flag=True, help="Write texts with every reason, hint and call, and the graph.")
@outputs_option("Write a report ({formats}); of a class, one file a submission in the folder PATH; repeatable.")
@click.option(
    "--min-score",
    type=float,
    metavar="P",
    callback=parse_percent,
    help="Exit with 0 if every score is at least P percent.",
)
@click.option(
    "--diff", "show_changes", is_flag=True, help="Print what changed since grading: in all, then dropped marks first."
)
@click.option("--csv", "table", type=PATH, metavar="FILE", help="Write the changes of --diff as a table, too.")
@click.option("--verify", is_flag=True, help="Verify that the recordings contain what is judged; slower.")
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Processes for a class; by default one a core.")
@audience_options
def command(  # noqa: PLR0913  one parameter an option
    *,
    evidence: tuple[Path, ...],
    exercises: tuple[str, ...],
    rubrics: tuple[Path, ...],
    as_json: bool,
    verbose: bool,
    outputs: tuple[Output, ...],
    min_score: Fraction | None,
    show_changes: bool,
    table: Path | None,
    verify: bool,
    jobs: int | None,
    audience: str | None,
    as_of: str,
) -> int:
    """Judge kept EVIDENCE again, of one submission or of a whole class, without running anything.

    EVIDENCE is a folder that `grade SUBMISSION -o evidence=FOLDER` kept, or one that holds many of them. The same
    rubric gives the same report; a changed one gives new scores.

    Exit codes are those of grading; 2 also where a part of a class had to be refused.
    """
    from grader.grading.app import rejudge
    from grader.grading.evidence.store import is_evidence
    from grader.grading.reporting.delivery import Output, prepared_outputs

    if any(output.format == EVIDENCE for output in outputs):
        raise click.BadParameter("evidence is kept while grading, not while judging again")
    for_whom = readers(audience, as_of)
    if show_changes and for_whom.only_students:
        raise click.BadParameter("--diff shows full reasons: it is for instructors")
    if table is not None and not show_changes:
        raise click.BadParameter("--csv needs --diff")
    how = rejudge.judgement(
        tuple(dict.fromkeys(exercises)),
        rubrics,
        pictures=any(known(output.format).illustrated for output in outputs),
        verify=verify,
    )
    one = len(evidence) == 1 and is_evidence(evidence[0])
    if one and not show_changes:
        reports = (*outputs, Output("json")) if as_json else outputs
        code = _one(evidence[0], how, prepared_outputs(reports, verbose=verbose), min_score, for_whom)
        return _confirmed(code, 1, verify=verify)
    wanted = rejudge.Wanted(
        tuple(replace(output, verbose=verbose) for output in outputs),
        reports=as_json and not show_changes,
        changes=show_changes,
        min_score=min_score,
        readers=for_whom,
    )
    return _class(evidence, how, wanted, as_json=as_json, jobs=jobs, table=table)


def _confirmed(code: int, count: int, *, verify: bool) -> int:
    """Say that recordings were verified, and return the exit code."""
    if verify and count:
        recordings = "recording shows" if count == 1 else "recordings show"
        complain(f"the {recordings} what was judged: {count} submission{'' if count == 1 else 's'}", kind="verified")
    return code


def _one(folder: Path, how: Judgement, outputs: Sequence[Output], min_score: Fraction | None, for_whom: Readers) -> int:
    """Judge one submission, and deliver its report as grading does."""
    from grader.grading.app import rejudge
    from grader.grading.evidence.store import open_evidence
    from grader.grading.model.report import report_exit_code
    from grader.grading.reporting.audience import told
    from grader.grading.reporting.delivery import deliver

    wanted = tuple(replace(output, evidence=folder) for output in outputs)
    report = rejudge.rejudge_evidence(open_evidence(folder), how)
    deliver(report, wanted, for_whom)
    if for_whom.only_students:
        pages = [output.path for output in wanted if output.format == PAGE and output.path is not None]
        if pages:
            from grader.grading.reporting.json_report import report_to_json

            data = report_to_json(told(report, for_whom))
            _add_marks([(report.name, folder, page, data) for page in pages])

    return report_exit_code(told(report, for_whom), min_score)


def _class(  # noqa: PLR0913  one parameter an option
    evidence: Sequence[Path], how: Judgement, wanted: Wanted, *, as_json: bool, jobs: int | None, table: Path | None
) -> int:
    """Judge many submissions, print their results, and write one file for each submission and format."""
    from grader.grading.app import rejudge
    from grader.grading.reporting.rejudged import (
        rejudged_to_json,
        render_changes,
        render_changes_table,
        render_rejudged,
    )

    if any(output.path is None for output in wanted.files):
        raise click.BadParameter("a class has many reports: expected FORMAT=FOLDER, found FORMAT=-")
    folders = [output.path for output in wanted.files if output.format == PAGE and output.path is not None]
    marked = bool(folders) and wanted.readers.only_students
    named = rejudge.named_evidence(evidence)
    results = rejudge.rejudge_class(named, how, replace(wanted, reports=wanted.reports or marked), jobs=jobs)
    judged = [(name, folder, result) for (name, folder), result in zip(named, results, strict=True) if result.report]
    if marked:
        suffix = FORMATS[PAGE].suffix
        _add_marks([(n, f, into / f"{n}{suffix}", json.loads(r.report)) for n, f, r in judged for into in folders])
    if table is not None:
        changes = [result.change for result in results if result.change is not None]
        if table.exists() and not any(each.criteria for each in changes):
            complain(f"{table} is left as it was: nothing changed", kind="note")
        else:
            write_file(table, render_changes_table(changes).encode())
    render = render_changes if wanted.changes else render_rejudged
    print_result(lambda: rejudged_to_json(results, changes=wanted.changes), lambda _: render(results), as_json=as_json)
    return _confirmed(rejudge.class_code(results), sum(not r.problem for r in results), verify=how.verify)


def _add_marks(pages: Sequence[tuple[str, Path, Path, ReportData]]) -> None:
    """Put the marks of a class into pages for students: name, evidence, page and report of each."""
    from grader.course.classroom.handing_back import HandedBack, add_marks

    complain(*add_marks([HandedBack(*page) for page in pages]))
