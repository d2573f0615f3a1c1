"""The command `grade doctor`: says what this machine can do."""

from __future__ import annotations

import click

from grader.cli.options import print_result, shown_progress
from grader.runtime.model.errors import ALL_MET, UNUSABLE


@click.command(name="doctor")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def command(*, as_json: bool) -> int:
    """Say what this machine can do: ROS, an exchange of messages, sandboxes, limits, and how to fix what is missing.

    Exit codes: 0 if strangers' programs can be graded safely here, 2 if not.
    """
    from grader.grading.app.doctor import examine
    from grader.grading.reporting.doctor import checkup_to_json, render_checkup

    with shown_progress(wanted=True) as progress:
        checkup = examine(progress)
    print_result(
        lambda: checkup_to_json(checkup),
        lambda layout: render_checkup(checkup, width=layout.width, colour=layout.colour),
        as_json=as_json,
    )
    return ALL_MET if checkup.safe else UNUSABLE
