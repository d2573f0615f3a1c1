"""The command `grade explain`: what a criterion or a check asks, and which part of the chapter asks for it."""

from __future__ import annotations

from pathlib import Path

import click

from grader.app.exit_codes import ALL_MET
from grader.cli.options import PATH
from grader.reporting.delivery import show


@click.command(name="explain")
@click.argument("name", metavar="CRITERION")
@click.option("--rubric", "rubrics", type=PATH, multiple=True, help="Look in this rubric; repeatable.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def command(*, name: str, rubrics: tuple[Path, ...], as_json: bool) -> int:
    """Explain a CRITERION, or a check by its name.

    Says what is asked, in which situation and with which tolerance it is measured, and which part of the chapter asks
    for it.
    """
    from grader.app.explain import explain  # noqa: PLC0415  the rest of the grader, which --help does not need
    from grader.reporting.explained import explanations_to_json, render_explanations  # noqa: PLC0415

    found = explain(name, rubrics)
    if as_json:
        show(lambda _: explanations_to_json(found), for_people=False)
    else:
        show(lambda layout: render_explanations(found, width=layout.width), for_people=True)
    return ALL_MET
