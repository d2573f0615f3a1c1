"""The command `grade batch`: grades a whole class."""

from __future__ import annotations

import os
import shlex
from pathlib import Path
from typing import TYPE_CHECKING

import click

from grader.cli.options import (
    PATH,
    complain,
    drawn_with,
    print_result,
)
from grader.cli.remembered import ClassCommand, options_to_keep
from grader.cli.run_options import run_options
from grader.grading.model.grading_options import BATCH, ISOLATION, SANDBOXES, GradingOptions
from grader.runtime.model.errors import ALL_MET, INTERRUPTED, NOT_ALL_MET, UNDECIDED, UNUSABLE
from grader.runtime.model.extras import require

if TYPE_CHECKING:
    from grader.course.classroom.outputs import Graded

AUTO = SANDBOXES[0]
_LAYOUTS = ("auto", "folders", "github-classroom", "classroom50", "moodle", "canvas")
_RERUNS = ("changed", "failed", "undecided", "all")


@click.command(name="batch", cls=ClassCommand)
@click.argument("sources", metavar="SOURCE...", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", "results", metavar="RESULTS", required=True, type=PATH, help="Folder for the results.")
@click.option("--layout", type=click.Choice(_LAYOUTS), default="auto", help="How submissions are named.")
@click.option("--pattern", default="", metavar="REGEX", help="Names, with groups name, user, email, id, late, file.")
@click.option("--roster", type=PATH, metavar="CSV", help="The people of the class, as any platform exports them.")
@click.option(
    "--adjust",
    "adjustments",
    type=PATH,
    metavar="YAML",
    help="Late days, scores, comments; else RESULTS/adjust.yaml.",
)
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Submissions at a time; by default one a core.")
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Grade on the Dask cluster of this scheduler, or scheduler file; NAME=PLACE for one of another package.",
)
@click.option(
    "--rerun", type=click.Choice(_RERUNS), default="changed", help="Which submissions to grade again, besides new ones."
)
@run_options(BATCH)
@click.option("--seed-key", type=PATH, metavar="FILE", help="Draw values by this key, not by the one kept in RESULTS.")
@click.option(
    "--title", default="", metavar="TEXT", help="Title of the page of the class; else the names of the sources."
)
@click.option("--standalone", is_flag=True, help="Make each HTML report a single file that can be sent away.")
@click.option("--canvas", metavar="NUMBER", help="Write canvas.csv for the assignment of this number.")
@click.option("--canvas-gradebook", type=PATH, metavar="CSV", help="The gradebook that Canvas exported.")
@click.option("--moodle", type=PATH, metavar="CSV", help="Write moodle.csv for the users in this export of Moodle.")
@click.option("--gradescope", is_flag=True, help="Write gradescope.csv, and results.json for each submission.")
@click.option("--similarity", is_flag=True, help="List submissions that are alike; no score depends on it.")
@click.option(
    "--template",
    "templates",
    type=PATH,
    metavar="FOLDER",
    multiple=True,
    help="Files that students were given, ignored when comparing; repeatable; by default the project's own templates.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the class as JSON, and nothing else.")
@click.option("--no-progress", is_flag=True, help="Show no progress while grading.")
def command(  # noqa: PLR0913  one parameter an option
    *,
    sources: tuple[Path, ...],
    results: Path,
    layout: str,
    pattern: str,
    roster: Path | None,
    adjustments: Path | None,
    jobs: int | None,
    scheduler: str | None,
    rerun: str,
    options: GradingOptions,
    seed_key: Path | None,
    title: str,
    standalone: bool,
    canvas: str | None,
    canvas_gradebook: Path | None,
    moodle: Path | None,
    gradescope: bool,
    similarity: bool,
    templates: tuple[Path, ...],
    as_json: bool,
    no_progress: bool,
) -> int:
    """Grade a class: every submission in SOURCE, a folder of submissions or a bulk download.

    The same command goes on where it was stopped. Only what is new or changed is graded; `--rerun` adds what failed,
    what was undecided, or all. RESULTS/class.yaml keeps the options that change marks, pages or exported files,
    such as --adjust and --roster: they apply again unless given otherwise, and deleting its line leaves one out.

    Exit codes: 0 everybody was graded, 1 a submission cannot be used, 2 the command or something it was given cannot be
    used, or a rubric has a mistake, 3 something failed or was undecided through no fault of a student, 130 interrupted.
    """
    if similarity:
        require("--similarity", "copydetect", "similarity")
    from grader.course.classroom.class_run import ClassRequest, grade_class
    from grader.course.classroom.outputs import platforms, render_graded, summary_json
    from grader.course.classroom.schedulers import ThisMachine, opened_scheduler
    from grader.course.classroom.watching import shown_watcher
    from grader.course.similarity.finding import read_templates
    from grader.grading.app.request import request_for
    from grader.runtime.shipped import shipped

    if canvas_gradebook is not None and canvas is None:
        raise click.BadParameter("--canvas-gradebook needs --canvas with the assignment's number")
    if templates and not similarity:
        raise click.BadParameter("--template needs --similarity")
    ctx = click.get_current_context()
    sandbox = os.environ.get(ISOLATION, "")
    if options.isolation == AUTO and sandbox not in ("", AUTO):
        complain(f"{ISOLATION} is not read for a class: give --isolation {shlex.quote(sandbox)} instead", kind="note")
    course = ClassRequest(
        sources=sources,
        results=results,
        layout=layout,
        pattern=pattern,
        roster=roster,
        adjustments=adjustments,
        options=options_to_keep(ctx),
        grading=request_for("", options),
        jobs=jobs,
        rerun=rerun,
        runs_here=scheduler is None,
        seed_key=drawn_with(options.seed, seed_key),
        title=title,
        standalone=standalone,
        platforms=platforms(canvas or "", canvas_gradebook, moodle, gradescope=gradescope),
        given=read_templates(templates or (shipped("student_template"),)) if similarity else None,
    )
    here = ctx.find_object(ThisMachine) or ThisMachine()
    try:
        with (
            opened_scheduler(scheduler, jobs, complain, here) as make,
            shown_watcher(wanted=not no_progress) as watcher,
        ):
            graded = grade_class(course, watcher, complain, make)
    except KeyboardInterrupt:
        click.echo("interrupted: what was graded is kept; run the same command again to continue", err=True)
        return INTERRUPTED
    print_result(lambda: summary_json(graded), lambda _: render_graded(graded), as_json=as_json)
    for mistake, rows in graded.book.author_mistakes.items():
        count = "1 submission" if len(rows) == 1 else f"{len(rows)} submissions"
        complain(f"the rubric has a mistake: {mistake} ({count})", kind="error")
        complain("correct it, and run the same command again", kind="hint")
    return _code(graded)


def _code(graded: Graded) -> int:
    """Return the exit code: mistakes in a rubric come first, then what failed here, then unusable submissions."""
    from grader.course.classroom.class_run import Status

    if graded.book.author_mistakes:
        return UNUSABLE
    if any(graded.book.count(status) for status in (Status.FAILED, Status.UNDECIDED, Status.NOT_RUN)):
        return UNDECIDED
    return NOT_ALL_MET if graded.book.count(Status.REFUSED) else ALL_MET
