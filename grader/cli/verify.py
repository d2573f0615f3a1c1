"""The command `grade verify`: records submissions several times, and tells whether the recordings are the same."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from grader.cli.completion import complete_file
from grader.cli.options import (
    PATH,
    complain,
    drawn_by,
    drawn_with,
    print_result,
    shown_progress,
)
from grader.cli.run_options import run_options
from grader.grading.model.grading_options import VERIFY, GradingOptions
from grader.runtime.model.errors import ALL_MET, NOT_ALL_MET, UNDECIDED

if TYPE_CHECKING:
    from grader.grading.model.verification import Verification

_EPILOG = (
    "Exit codes: 0 all recordings that can be compared are the same, 1 some differ, 2 the command or something it was "
    "given cannot be used, 3 nothing could be compared, or the grader or the machine failed, 130 interrupted."
)


@click.command(name="verify", epilog=_EPILOG)
@click.argument("submissions", metavar="SUBMISSION...", nargs=-1, required=True, shell_complete=complete_file)
@run_options(VERIFY)
@click.option(
    "--evidence", type=PATH, metavar="FOLDER", help="Compare with this evidence too, and keep the result in it."
)
@click.option("--seed-key", type=PATH, metavar="FILE", help="Draw values by this key and the files handed in.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
@click.option("--no-progress", is_flag=True, help="Show no progress while recording.")
def command(  # noqa: PLR0913  one parameter an option
    *,
    submissions: tuple[str, ...],
    options: GradingOptions,
    evidence: Path | None,
    seed_key: Path | None,
    as_json: bool,
    no_progress: bool,
) -> int:
    """Record a SUBMISSION several times, and tell whether the same happens each time.

    After the first recording there are three: again with nothing changed; together, with another order of scenarios,
    one processor, another temporary folder, time zone and hash seed, and each program executed; and beside busy loops.
    They are compared event by event. The first difference is printed with its kind: time, order, content, clock, or
    only what the grader saw. Scenarios that the wall clock decides are named: they cannot be compared in this way.
    Nothing is judged.
    """
    if evidence is not None and len(submissions) != 1:
        raise click.BadParameter("--evidence is that of one submission: expected one SUBMISSION, found several")
    drawn = options.seed is not None or seed_key is not None or options.student
    if evidence is not None and (drawn or options.exercises or options.bags):
        raise click.BadParameter("--evidence says what was recorded, and with which seed: leave out the other options")
    key = drawn_with(options.seed, seed_key)
    draw = drawn_by(options.student, options.variant_key)
    from grader.grading.app.request import request_for
    from grader.grading.app.seeds import PRACTICE
    from grader.grading.app.verify import VerifyRequest, verify
    from grader.grading.reporting.verified import render_verification, verification_to_json

    how = request_for("", options, seed_key=key or PRACTICE, draw=draw)
    with shown_progress(wanted=not no_progress) as progress:
        found = verify(VerifyRequest(submissions, how, evidence), progress)
    if evidence is not None:
        _keep(found, evidence, verification_to_json(found))
    print_result(
        lambda: verification_to_json(found),
        lambda page: render_verification(found, width=page.width, colour=page.colour),
        as_json=as_json,
    )
    return verification_exit_code(found)


def verification_exit_code(found: Verification) -> int:
    """Return the exit code of the command for its result."""
    from grader.grading.model.verification import ConditionState

    return {ConditionState.SAME: ALL_MET, ConditionState.DIFFERENT: NOT_ALL_MET}.get(found.state, UNDECIDED)


def _keep(found: Verification, evidence: Path, text: str) -> None:
    """Add the result to the evidence."""
    from grader.grading.evidence.store import add_verification

    add_verification(evidence, text.encode())
    complain(f"{evidence} now says that the recordings are {found.state.value}", kind="kept")
