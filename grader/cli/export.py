"""The command `grade export`: packs the grader for platforms that run it themselves."""

from __future__ import annotations

from pathlib import Path

import click

from grader.cli.completion import complete_exercise
from grader.cli.options import PATH, RUBRIC, complain, print_for_programs, write_file
from grader.runtime.model.checkup import NO_SANDBOX, TIERS
from grader.runtime.model.errors import ALL_MET

_exercises = click.option(
    "--exercise",
    "exercises",
    metavar="ID",
    multiple=True,
    shell_complete=complete_exercise,
    help="Grade only this exercise; repeatable.",
)
_rubrics = click.option("--rubric", "rubrics", type=RUBRIC, multiple=True, help="Use this rubric; repeatable.")
_tiers = click.Choice(("auto", *TIERS))


@click.group(name="export")
def command() -> None:
    """Pack the grader for Gradescope, Classroom 50 or GitHub Actions."""


@command.command(name="gradescope")
@click.argument("target", metavar="ZIP", type=PATH)
@_exercises
@_rubrics
@click.option(
    "--isolation",
    type=_tiers,
    default="landlock",
    show_default=True,
    help="The sandbox in Gradescope's container, which allows no namespaces but is used for one submission only.",
)
@click.option("--seed-key", type=PATH, metavar="FILE", help="Put this key into the ZIP; drawn values follow from it.")
def _gradescope(
    target: Path, exercises: tuple[str, ...], rubrics: tuple[Path, ...], isolation: str, seed_key: Path | None
) -> int:
    """Write an autograder ZIP that Gradescope takes as it is."""
    from grader.course.packaging import Chosen, gradescope

    if isolation == NO_SANDBOX:
        complain("without a sandbox a student's program can write its own result")
    write_file(target, gradescope(Chosen(tuple(dict.fromkeys(exercises)), rubrics, isolation), seed_key), parents=True)
    return ALL_MET


@command.command(name="classroom50")
@click.argument("target", metavar="FOLDER", type=PATH)
@_exercises
@_rubrics
@click.option("--isolation", type=_tiers, default="auto", show_default=True, help="The sandbox on the runner.")
def _classroom50(target: Path, exercises: tuple[str, ...], rubrics: tuple[Path, ...], isolation: str) -> int:
    """Write the FOLDER of an assignment's autograder for Classroom 50."""
    from grader.course.packaging import Chosen, classroom50

    for name, content in classroom50(Chosen(tuple(dict.fromkeys(exercises)), rubrics, isolation)).items():
        write_file(target / name, content, parents=True)
    return ALL_MET


@command.command(name="workflow")
@click.argument("action", metavar="OWNER/NAME@COMMIT")
def _workflow(action: str) -> int:
    """Print the workflow for students' repositories that grades with your copy of the grader."""
    from grader.course.packaging import workflow

    print_for_programs(workflow(action))
    return ALL_MET


@command.command(name="constraints")
def _constraints() -> int:
    """Print the versions of all that the grader needs here, as constraints for pip."""
    from grader.course.packaging import pins

    print_for_programs(pins())
    return ALL_MET
