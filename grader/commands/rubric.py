"""The commands `grade rubric ...`: what authors of rubrics need."""

from __future__ import annotations

from pathlib import Path

import click

from grader.model.errors import RubricError
from grader.options import ALL_MET, PATH, UNUSABLE
from grader.reports.delivery import show
from grader.reports.escape import shown


@click.group(name="rubric")
def command() -> None:
    """Write, check and explain rubrics."""


@command.command(name="check")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
def _check(*, files: tuple[Path, ...]) -> int:
    """Say whether rubrics can be used, with line and column of every mistake, and what is odd about them.

    Exit code 2 if one of them cannot be used; what is merely odd is a warning.
    """
    from grader.authoring.checking import check_rubric, complaints  # noqa: PLC0415  reading, which --help does not need

    code = ALL_MET
    for path in files:
        try:
            checked = check_rubric(path)
        except RubricError as error:
            code = UNUSABLE
            for line in complaints(error):
                click.echo(shown(line), err=True)
            continue
        for warning in checked.warnings:
            click.echo(f"warning: {shown(warning)}", err=True)
        click.echo(shown(checked.summary))
    return code


@command.command(name="schema")
@click.argument("rubric", metavar="[FILE]", required=False, type=PATH)
def _schema(*, rubric: Path | None) -> int:
    """Print the JSON Schema of rubrics, with which editors complete and check them.

    That for a rubric FILE knows the checks of its own as well.
    """
    from grader.judging.checks import CHECKS  # noqa: PLC0415  as above
    from grader.reading.rubric_file import own_checks  # noqa: PLC0415
    from grader.reading.rubric_schema import schema_text  # noqa: PLC0415

    text = schema_text({**CHECKS, **({} if rubric is None else own_checks(rubric))})
    show(lambda _: text, for_people=False)
    return ALL_MET


@command.command(name="explain")
@click.argument("files", metavar="[FILE]...", nargs=-1, type=PATH)
@click.option("--checks", "checks", is_flag=True, help="List the checks that rubrics can use, one line each.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def _explain(*, files: tuple[Path, ...], checks: bool, as_json: bool) -> int:
    """Explain what each criterion of rubrics asks, in which situation, and how it is measured.

    Without a FILE the rubrics that come with the grader are explained.
    """
    from grader.explaining import explain_checks, explain_rubrics  # noqa: PLC0415  as above
    from grader.reports.explained import (  # noqa: PLC0415  as above
        explanations_to_json,
        list_checks,
        render_explanations,
    )

    found = explain_checks(files) if checks else explain_rubrics(files)
    if as_json:
        show(lambda _: explanations_to_json(found), for_people=False)
    elif checks:
        show(lambda layout: list_checks(found, width=layout.width), for_people=True)
    else:
        show(lambda layout: render_explanations(found, width=layout.width), for_people=True)
    return ALL_MET
