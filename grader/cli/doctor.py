"""The command `grade doctor`: what this machine can do for grading."""

from __future__ import annotations

import click

from grader.app.exit_codes import ALL_MET, UNUSABLE
from grader.app.progress import shown_progress
from grader.reporting.delivery import show


@click.command(name="doctor")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def command(*, as_json: bool) -> int:
    """Say what this machine can do: ROS, an exchange of messages, sandboxes, limits, and what mends each lack.

    Exit codes: 0 if strangers' programs can be graded safely here, 2 if not.
    """
    from grader.app.doctor import examine  # noqa: PLC0415  the rest of the grader, which --help does not need
    from grader.reporting.doctor import checkup_to_json, render_checkup  # noqa: PLC0415

    with shown_progress(wanted=True) as progress:
        checkup = examine(progress)
    if as_json:
        show(lambda _: checkup_to_json(checkup), for_people=False)
    else:
        show(lambda layout: render_checkup(checkup, width=layout.width, colour=layout.colour), for_people=True)
    return ALL_MET if checkup.safe else UNUSABLE
