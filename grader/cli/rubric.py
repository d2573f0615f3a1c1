"""The commands `grade rubric ...`, for authors of rubrics."""

from __future__ import annotations

from pathlib import Path

import click

from grader.cli.options import (
    PATH,
    RUBRIC,
    complain,
    inputs_options,
    print_for_programs,
    print_result,
    shown_progress,
    write_file,
)
from grader.cli.run_options import run_option
from grader.grading.model.grading_options import BATCH, GRADE
from grader.runtime.model.errors import ALL_MET, UNUSABLE, GraderError, RubricError


@click.group(name="rubric")
def command() -> None:
    """Write, check and explain rubrics."""


@command.command(name="check")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=RUBRIC)
@run_option("interfaces", GRADE)
def _check(*, files: tuple[Path, ...], interfaces: tuple[Path, ...]) -> int:
    """Say whether rubrics can be used, with line and column of every mistake, and what is odd about them.

    Exit code 2 if one of them cannot be used; what is merely odd is a warning.
    """
    from grader.course.authoring.checking import check_rubric, complaints
    from grader.grading.reporting.escape import shown

    code = ALL_MET
    for path in files:
        try:
            checked = check_rubric(path, interfaces)
        except RubricError as error:
            code = UNUSABLE
            for line in complaints(error):
                click.echo(shown(line), err=True)
            continue
        for warning in checked.warnings:
            complain(warning)
        click.echo(shown(checked.summary))
    return code


@command.command(name="schema")
@click.argument("rubric", metavar="[FILE]", required=False, type=RUBRIC)
def _schema(*, rubric: Path | None) -> int:
    """Print the JSON Schema of rubrics, with which editors complete and check them.

    That for a rubric FILE knows the checks of its own as well.
    """
    from grader.grading.rubrics.exercise_checks import known_checks
    from grader.grading.rubrics.loader import own_checks
    from grader.grading.rubrics.schema import schema_text

    print_for_programs(schema_text({**known_checks(), **({} if rubric is None else own_checks(rubric))}))
    return ALL_MET


@command.command(name="variant")
@click.argument("rubric", metavar="FILE", type=RUBRIC)
@click.option("--variant-key", "key", type=PATH, metavar="FILE", required=True, help="The variant key.")
@click.option("--student", metavar="ID", required=True, help="The student, by the id on the roster.")
@click.option("--format", "format_", type=click.Choice(["markdown", "json"]), default="markdown", help="Output format.")
def _variant(*, rubric: Path, key: Path, student: str, format_: str) -> int:
    """Print the values that a rubric has for one student, for the task sheet."""
    from grader.grading.app.seeds import by_key
    from grader.grading.reporting.explained import render_sheet, sheet_to_json
    from grader.grading.rubrics.loader import read_rubric

    exercise = read_rubric(rubric, draw=by_key(key, student))
    print_for_programs(sheet_to_json(exercise) if format_ == "json" else render_sheet(exercise))
    return ALL_MET


@command.command(name="explain")
@click.argument("files", metavar="[FILE]...", nargs=-1, type=RUBRIC)
@click.option("--checks", "checks", is_flag=True, help="List the checks that rubrics can use, one line each.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def _explain(*, files: tuple[Path, ...], checks: bool, as_json: bool) -> int:
    """Explain what each criterion of rubrics asks, in which situation, and how it is measured.

    Without a FILE the rubrics that come with the grader are explained.
    """
    from grader.grading.app.explain import explain_checks, explain_rubrics
    from grader.grading.reporting.explained import explanations_to_json, list_checks, render_explanations

    found = explain_checks(files) if checks else explain_rubrics(files)
    render = list_checks if checks else render_explanations
    print_result(lambda: explanations_to_json(found), lambda page: render(found, width=page.width), as_json=as_json)
    return ALL_MET


@command.command(name="new")
@click.argument("files", metavar="FILE...", nargs=-1, required=True, type=PATH)
@click.option("-o", "--output", type=PATH, metavar="PATH", help="Write it there; by default it is printed.")
@click.option(
    "--id", "id_", default="", metavar="ID", help="Id of the exercise; by default from the name of the first file."
)
@inputs_options
@click.option("--duration", type=click.FloatRange(4, 600), default=10.0, show_default=True, help="Seconds observed.")
@run_option("clock", BATCH)
@run_option("isolation", BATCH)
def _new(  # noqa: PLR0913  one parameter an option
    *,
    files: tuple[Path, ...],
    output: Path | None,
    id_: str,
    sent: tuple[str, ...],
    simulations: tuple[str, ...],
    duration: float,
    clock: str,
    isolation: str,
) -> int:
    """Run the FILEs of a reference solution, and write a rubric that asks for what they do.

    It is a skeleton: comments tell what was seen, and what its author has to decide. The reference meets all of it.
    With -o, rubric.schema.json is written beside it, with which editors complete and check it.
    """
    from grader.course.authoring.starting import new_rubric
    from grader.grading.app.inputs import read_sent, read_simulations
    from grader.grading.app.observe import ObserveRequest
    from grader.grading.reporting.escape import shown
    from grader.grading.rubrics.schema import FILE, schema_text

    if output is not None and output.exists():
        raise GraderError(f"{output}: expected a new file, found an existing one", "name another, or remove it")
    with shown_progress(wanted=True) as progress:
        request = ObserveRequest(
            files, round(duration * 1e9), (), clock, isolation, (), read_simulations(simulations), read_sent(sent)
        )
        skeleton = new_rubric(request, progress, id_=id_, beside=output.parent if output is not None else Path())
    for remark in skeleton.remarks:
        complain(remark)
    if output is None:
        print_for_programs(skeleton.text)
    else:
        write_file(output, skeleton.text.encode())
        schema = output.with_name(FILE)
        if not schema.exists():
            write_file(schema, schema_text().encode())
        rows = "criterion" if skeleton.criteria == 1 else "criteria"
        click.echo(
            f"{shown(str(output))}: {skeleton.criteria} {rows}, all of them met; {skeleton.left_out} in comments"
        )
    return ALL_MET
