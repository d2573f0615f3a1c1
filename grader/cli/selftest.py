"""The command `grade selftest`: tests rubrics with planted mistakes."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from grader.cli.options import PATH, RUBRIC, complain, print_result, shown_progress, write_file
from grader.cli.run_options import run_option
from grader.grading.model.grading_options import BATCH
from grader.grading.model.rubric_files import notes_on, rubric_of
from grader.runtime.model.errors import ALL_MET, NOT_ALL_MET
from grader.runtime.model.extras import require

if TYPE_CHECKING:
    from grader.course.mutation.running import SelftestResult


@click.command(name="selftest")
@click.argument("rubrics", metavar="RUBRIC...", nargs=-1, required=True, type=RUBRIC)
@click.option(
    "--reference", type=PATH, metavar="FOLDER", help="A correct solution; by default the one that the notes name."
)
@click.option(
    "--template", type=PATH, metavar="FOLDER", help="The template that students start from; by default as above."
)
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Scenarios at a time; by default one a core.")
@click.option(
    "--only", default="", metavar="PATTERN", help="Only mutants and variants with this id; * matches anything."
)
@click.option(
    "--sample", type=click.IntRange(min=1), metavar="N", help="Only N mutants for each rubric, of many kinds."
)
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Draw the sample and all values from N.")
@run_option("clock", BATCH)
@run_option("isolation", BATCH)
@click.option("--write-notes", is_flag=True, help="Add what is not explained to the notes, with a reason to fill in.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
@click.option("--no-progress", is_flag=True, help="Show no progress while testing.")
def command(  # noqa: PLR0913  one parameter an option
    *,
    rubrics: tuple[Path, ...],
    reference: Path | None,
    template: Path | None,
    jobs: int | None,
    only: str,
    sample: int | None,
    seed: int | None,
    clock: str,
    isolation: str,
    write_notes: bool,
    as_json: bool,
    no_progress: bool,
) -> int:
    """Test RUBRIC with mistakes planted in its reference solution, and with correct variants of it.

    Notes in NAME.selftest.yaml beside NAME.yaml, or selftest.yaml beside rubric.yaml, explain what may survive.

    Exit codes: 0 every mistake was detected or explained, every criterion detected one, and no correct program lost a
    point, 1 not, 2 the command or one of its inputs cannot be used.
    """
    require("grade selftest", "libcst", "authors")
    from grader.course.mutation.running import SelftestOptions, selftest
    from grader.course.mutation.showing import render_selftest, selftest_to_json

    # A shell pattern such as mine/*.yaml matches the notes as well.
    named = [path for path in rubrics if rubric_of(path) is None]
    if not named:
        wanted = [rubric for path in rubrics if (rubric := rubric_of(path)) is not None]
        raise click.BadParameter(f"expected rubrics, found notes only; name {wanted[0].name}")
    options = SelftestOptions(reference, template, jobs, only, sample, seed, clock, isolation)
    with shown_progress(wanted=not no_progress) as progress:
        results = list(selftest(named, options, progress))
    print_result(
        lambda: selftest_to_json(results),
        lambda page: render_selftest(results, width=page.width, colour=page.colour),
        as_json=as_json,
    )
    if write_notes:
        for result in results:
            _add_notes(result, reference, template)
    elif not as_json and any(result.survivors or result.marked_down or result.never_turned for result in results):
        complain("--write-notes adds these to the notes, with a reason to fill in", kind="hint")
    return ALL_MET if all(result.passed for result in results) else NOT_ALL_MET


def _add_notes(result: SelftestResult, reference: Path | None, template: Path | None) -> None:
    from grader.course.mutation.writing import noted

    path = notes_on(Path(result.rubric))
    before = path.read_text(encoding="utf-8-sig") if path.exists() else None
    text, entries = noted(result, before, reference=reference, template=template)
    if entries:
        write_file(path, text.encode())
        what = "entry needs" if entries == 1 else "entries need"
        complain(f"{path}: {entries} {what} a reason after `because:`", kind="written")
