"""The command `grade selftest`: grade a rubric with mutants of its reference solution."""

from __future__ import annotations

from pathlib import Path

import click

from grader.app.exit_codes import ALL_MET, NOT_ALL_MET
from grader.app.progress import shown_progress
from grader.cli.options import PATH, require
from grader.core.checkup import TIERS
from grader.reporting.delivery import show


@click.command(name="selftest")
@click.argument("rubrics", metavar="RUBRIC...", nargs=-1, required=True, type=PATH)
@click.option("--reference", type=PATH, metavar="FOLDER", help="A right solution; by default what the notes name.")
@click.option("--template", type=PATH, metavar="FOLDER", help="What students start from; by default as above.")
@click.option("--jobs", type=click.IntRange(min=1), metavar="N", help="Scenarios at a time; by default one a core.")
@click.option("--only", default="", metavar="PATTERN", help="Only mutants and variants of this id; * is anything.")
@click.option("--sample", type=click.IntRange(min=1), metavar="N", help="Only N mutants a rubric, of many kinds.")
@click.option("--seed", type=click.IntRange(min=0), metavar="N", help="Draw the sample and all values from N.")
@click.option("--clock", type=click.Choice(["virtual", "wall", "auto"]), default="auto", help="As for grading.")
@click.option("--isolation", type=click.Choice(["auto", *TIERS]), default="auto", help="As for grading.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
@click.option("--no-progress", is_flag=True, help="Say nothing while testing.")
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
    as_json: bool,
    no_progress: bool,
) -> int:
    """Test RUBRIC with mistakes planted in its reference solution, and with correct variants of it.

    Notes in NAME.selftest.yaml beside NAME.yaml explain what may survive.

    Exit codes: 0 no unexplained survivor, every criterion noticed something and nothing right was marked down, 1 not,
    2 the command or something it was given cannot be used.
    """
    require("grade selftest", "libcst", "authors")
    from grader.mutation.running import SelftestOptions, selftest  # noqa: PLC0415  as above
    from grader.mutation.showing import render_results, results_to_json  # noqa: PLC0415  as above
    from grader.rubrics.loader import NOTES  # noqa: PLC0415  the rest of the grader, and libcst

    # A pattern of the shell names the notes as well.
    named = [path for path in rubrics if not path.name.endswith(NOTES)]
    if not named:
        raise click.BadParameter(f"expected rubrics, found notes only; name {rubrics[0].name.removesuffix(NOTES)}.yaml")
    options = SelftestOptions(reference, template, jobs, only, sample, seed, clock, isolation)
    with shown_progress(wanted=not no_progress) as progress:
        results = list(selftest(named, options, progress))
    if as_json:
        show(lambda _: results_to_json(results), for_people=False)
    else:
        show(lambda page: render_results(results, width=page.width, colour=page.colour), for_people=True)
    return ALL_MET if all(result.passed for result in results) else NOT_ALL_MET
