"""The command `grade observe`: runs nodes and says what they do."""

from __future__ import annotations

from pathlib import Path

import click

from grader.cli.options import PATH, inputs_options, print_result, shown_progress
from grader.cli.run_options import run_options
from grader.grading.model.grading_options import OBSERVE, GradingOptions
from grader.runtime.model.errors import ALL_MET


@click.command(name="observe")
@click.argument("files", metavar="PROGRAM...", nargs=-1, required=True, type=PATH)
@click.option("--duration", type=click.FloatRange(0.1, 600), default=10.0, show_default=True, help="Seconds observed.")
@run_options(OBSERVE)
@inputs_options
@click.option(
    "--launch-argument",
    "launch_arguments",
    metavar="NAME:=VALUE",
    multiple=True,
    help="An argument for the launch files among them, as `ros2 launch` takes it; repeatable.",
)
@click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else on standard output.")
def command(  # noqa: PLR0913  one parameter an option
    *,
    files: tuple[Path, ...],
    duration: float,
    options: GradingOptions,
    sent: tuple[str, ...],
    simulations: tuple[str, ...],
    launch_arguments: tuple[str, ...],
    as_json: bool,
) -> int:
    """Run nodes together, without a rubric, and say what they do.

    A PROGRAM is a .py file, a launch file, a package or workspace with all its executables, or one of these as
    FOLDER/NAME or FOLDER/PACKAGE/NAME.
    Shows nodes, topics with types, rates and values, services, parameters, log records, faults and the graph.
    """
    from grader.grading.app import observe
    from grader.grading.app.inputs import read_launch_arguments, read_sent, read_simulations
    from grader.grading.reporting.observed import render_summary, summary_to_json

    request = observe.ObserveRequest(
        files,
        round(duration * 1e9),
        options.bags,
        options.clock,
        options.isolation,
        options.interfaces,
        read_simulations(simulations),
        read_sent(sent),
        read_launch_arguments(launch_arguments, files),
    )
    with shown_progress(wanted=True) as progress:
        summary = observe.observe_programs(request, progress)
    print_result(lambda: summary_to_json(summary), lambda _: render_summary(summary), as_json=as_json)
    return ALL_MET
