"""Options and helpers that several commands share."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, TypeVar

import click

from grader.grading.model.rubric_files import rubric_file
from grader.runtime.model.errors import GraderError

if TYPE_CHECKING:
    from fractions import Fraction

    from grader.grading.app.grade import Progress
    from grader.grading.app.seeds import ByKey, SeedKey
    from grader.grading.reporting.audience import Readers
    from grader.grading.reporting.formats import PageLayout


PATH = click.Path(path_type=Path)


class RubricPath(click.Path):
    """The path of a rubric's file, for which the folder of its exercise stands too."""

    def convert(self, value: str, param: click.Parameter | None, ctx: click.Context | None) -> Path:  # type: ignore[override]
        """Return the path of the file."""
        return rubric_file(Path(os.fsdecode(super().convert(value, param, ctx))))


RUBRIC = RubricPath(path_type=Path)
_Command = TypeVar("_Command", bound=Callable[..., object])


def audience_options(command: _Command) -> _Command:
    """Add the options `--audience` and `--as-of`."""
    day = click.option(
        "--as-of",
        metavar="DATE",
        callback=_parse_day,
        help="Show students what a rubric lets them see on this day, as 2026-12-01; by default today.",
    )
    audience = click.option(
        "--audience",
        type=click.Choice(["student", "instructor"]),
        help="Who reads all reports; by default students read those for platforms, and instructors the others.",
    )
    return audience(day(command))


def readers(audience: str | None, day: str) -> Readers:
    """Return the readers of the reports, from the values of `--audience` and `--as-of`."""
    from grader.grading.model.exercise import Audience
    from grader.grading.reporting.audience import Readers

    return Readers(None if audience is None else Audience(audience), day)


def drawn_by(student: str, key: Path | None) -> ByKey | None:
    """Return the source of a student's variant values; None if neither option is given."""
    if not student and key is None:
        return None
    if key is None or not student:
        raise click.BadParameter("--student and --variant-key need each other")
    from grader.grading.app.seeds import by_key

    return by_key(key, student)


def drawn_with(seed: int | None, path: Path | None) -> SeedKey | None:
    """Return the seed key from `--seed-key` or the environment; None if neither has one."""
    if seed is not None and path is not None:
        raise click.BadParameter("--seed and --seed-key exclude each other: a seed needs no key")
    from grader.grading.app.seeds import seed_key

    return seed_key(path)


def _parse_day(ctx: click.Context, param: click.Parameter, value: str | None) -> str:
    del ctx, param
    from datetime import date

    if value is None:
        return date.today().isoformat()  # noqa: DTZ011  the local date where it is graded
    try:
        if date.fromisoformat(value).isoformat() == value:
            return value
    except ValueError:
        pass
    raise click.BadParameter(f"expected a date such as 2026-12-01, found {value!r}")


def parse_percent(ctx: click.Context, param: click.Parameter, value: float | None) -> Fraction | None:
    """Parse the value of `--min-score P`; a click callback."""
    del ctx, param
    if value is None:
        return None
    if not 0 <= value <= 100:  # NaN loses
        raise click.BadParameter(f"expected 0 to 100, found {value}")
    from fractions import Fraction

    return Fraction(str(value))


def with_nearest(found: str, known: Sequence[str]) -> str:
    """End a message with the closest known name, or with all known names."""
    import difflib

    near = difflib.get_close_matches(found, known, n=1, cutoff=0.4)
    return f"; did you mean {near[0]}?" if near else f"; there are {', '.join(known)}"


def print_for_programs(text: str) -> None:
    """Print text in UTF-8, and nothing else, on standard output."""
    from grader.grading.reporting.delivery import show

    show(lambda _: text, for_people=False)


def print_result(to_json: Callable[[], str], render: Callable[[PageLayout], str], *, as_json: bool) -> None:
    """Print a result on standard output: as JSON, or as text rendered for its width and colour."""
    from grader.grading.reporting.delivery import show

    show((lambda _: to_json()) if as_json else render, for_people=not as_json)


_SIMULATION = "FILE.py:NAME"
_SIMULATION_HELP = "A simulation that takes part, or the name of a built-in one; {parameters} follow a =; repeatable."


def inputs_options(command: _Command) -> _Command:
    """Add `--send` and `--simulation`: what programs are given that run without a rubric."""
    sent = click.option(
        "--send", "sent", metavar="TOPIC={FIELD: VALUE}", multiple=True, help="A message to send to them; repeatable."
    )
    simulation = click.option("--simulation", "simulations", metavar=_SIMULATION, multiple=True, help=_SIMULATION_HELP)
    return sent(simulation(command))


def complain(*lines: str, kind: str = "warning") -> None:
    """Write lines of a warning, an error or a hint on standard error; they may hold foreign text."""
    from grader.grading.reporting.escape import shown

    for line in lines:
        click.echo(f"{kind}: {shown(line)}", err=True)


def write_file(path: Path, content: bytes, *, parents: bool = False) -> None:
    """Write a file atomically, and its folders if asked; raises GraderError if that fails."""
    from grader.runtime.files import write_whole

    try:
        if parents:
            path.parent.mkdir(parents=True, exist_ok=True)
        write_whole(path, content)
    except OSError as error:
        raise GraderError(f"{path}: it cannot be written: {error.strerror or error}") from error


@contextmanager
def shown_progress(*, wanted: bool) -> Iterator[Progress]:
    """Show the current step and how long it all has taken on a terminal, and erase it at the end.

    What draws it takes long to import, so that is done when there is a step to show. The first one must come from the
    caller's thread.
    """
    if not (wanted and sys.stderr is not None and sys.stderr.isatty()):
        yield lambda _: None
        return
    with ExitStack() as stack:
        shows: list[Progress] = []

        def show(step: str) -> None:
            if not shows:
                shows.append(stack.enter_context(_progress_bar()))
            shows[0](step)

        yield show


@contextmanager
def _progress_bar() -> Iterator[Progress]:
    from rich.console import Console
    from rich.progress import Progress as Bar
    from rich.progress import SpinnerColumn, TextColumn, TimeElapsedColumn

    from grader.grading.reporting.escape import shown

    columns = (SpinnerColumn(), TextColumn("{task.description}", markup=False), TimeElapsedColumn())
    with Bar(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task("starting")
        yield lambda step: bar.update(task, description=shown(step))
