"""The command `grade upload`: puts the marks of a graded class into Canvas or Moodle."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeVar

import click

from grader.cli.options import PATH, complain, print_result
from grader.runtime.model.errors import ALL_MET, INTERRUPTED, NOT_ALL_MET
from grader.runtime.model.extras import require

if TYPE_CHECKING:
    from grader.course.classroom.uploading.marks import Platform

_Command = TypeVar("_Command", bound=Callable[..., object])


@click.group(name="upload")
def command() -> None:
    """Put scores and feedback of a class that `grade batch` graded into Canvas or Moodle."""


def _options(function: _Command) -> _Command:
    number = click.IntRange(min=1)
    for decorate in reversed(
        (
            click.argument("results", metavar="RESULTS", type=PATH),
            click.option("--url", required=True, metavar="URL", help="Address of the platform, with https."),
            click.option("--course", required=True, type=number, metavar="N", help="Number of the course."),
            click.option("--assignment", required=True, type=number, metavar="N", help="Number in its address."),
            click.option(
                "--token-file", type=PATH, metavar="FILE", help="The access token, if not in the environment."
            ),
            click.option("--send", is_flag=True, help="Send; without it, only show what would be sent."),
            click.option("--scores-only", is_flag=True, help="Send no feedback."),
            click.option("--skip-unknown", is_flag=True, help="Send even if some people are not on the platform."),
        )
    ):
        function = decorate(function)
    return function


@command.command(name="canvas")
@_options
def _canvas(**given: Any) -> int:
    """Upload the class in RESULTS to an assignment in Canvas; CANVAS_TOKEN holds the access token.

    Exit codes: 0 every mark is there or would be sent, 1 somebody is left out, 2 something cannot be used or reached.
    """
    require("grade upload", "canvasapi", "upload")
    from grader.course.classroom.uploading.canvas import TOKEN, Canvas

    return _upload(Canvas, TOKEN, **given)


@command.command(name="moodle")
@_options
def _moodle(**given: Any) -> int:
    """Upload the class in RESULTS to an assignment in Moodle; MOODLE_TOKEN holds the access token.

    Exit codes: 0 every mark is there or would be sent, 1 somebody is left out, 2 something cannot be used or reached.
    """
    require("grade upload", "requests", "upload")
    from grader.course.classroom.uploading.moodle import TOKEN, Moodle

    return _upload(Moodle, TOKEN, **given)


def _upload(  # noqa: PLR0913  one parameter an option
    connect: Callable[[str, str, int, int], Platform],
    variable: str,
    *,
    results: Path,
    url: str,
    course: int,
    assignment: int,
    token_file: Path | None,
    send: bool,
    scores_only: bool,
    skip_unknown: bool,
) -> int:
    from grader.course.classroom.store import open_store
    from grader.course.classroom.uploading import marks
    from grader.course.classroom.uploading.web import platform_address, token_of
    from grader.course.classroom.uploading.wording import render_comparison, render_sent
    from grader.runtime.model.errors import ClassError

    address, token = platform_address(url), token_of(variable, token_file)
    known = marks.read_marks(results)
    with open_store(results):  # no other process grades or uploads meanwhile
        platform = connect(address, token, course, assignment)
        found = marks.compare(known, platform, with_feedback=not scores_only)
        _show(render_comparison(known, platform, found))
        if known.withheld:
            criteria = ", ".join(known.withheld)
            complain(
                f"the scores include criteria that the rubric hides from students: {criteria}; they reveal the results"
            )
        left_out = bool(found.unknown or known.left_out)
        needed = sum(change.needed for change in found.changes)
        if found.unknown and not skip_unknown and send:
            hint = "correct the roster and run `grade batch` again, or leave them out with --skip-unknown"
            raise ClassError(f"nothing was sent: {len(found.unknown)} people are not on the platform", hint)
        if not send:
            complain(f"nothing was sent; --send sends {needed} marks", kind="note")
            return NOT_ALL_MET if left_out else ALL_MET
        try:
            sent = marks.send_marks(found.changes, platform, lambda line: complain(line, kind="sent"))
        except KeyboardInterrupt:
            complain("interrupted: run the same command again to send the rest", kind="note")
            return INTERRUPTED
    _show(render_sent(sent))
    return NOT_ALL_MET if left_out or sent.refused or sent.wrong else ALL_MET


def _show(text: str) -> None:
    print_result(lambda: text, lambda _: text, as_json=False)
