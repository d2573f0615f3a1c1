"""The option `-o FORMAT=PATH`, which knows the formats of other packages as well."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from grader.cli.completion import complete_output
from grader.cli.options import with_nearest
from grader.grading.reporting.formats import EVIDENCE, FORMATS, added_formats, format_of

if TYPE_CHECKING:
    from grader.grading.reporting.delivery import Output


class _OutputOption(click.Option):
    """Lists the formats where its help stands for `{formats}`; those of other packages are read for the help alone."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help."""
        record = super().get_help_record(ctx)
        if record is None:
            return None
        return record[0], record[1].replace("{formats}", ", ".join([*FORMATS, *added_formats()]))


def outputs_option(text: str) -> Callable[[Callable[..., Any]], Callable[..., Any]]:
    """Return the decorator that adds `-o` to a command, with this text as its help; the command gets `outputs`."""
    return click.option(
        "-o",
        "--output",
        "outputs",
        cls=_OutputOption,
        metavar="FORMAT=PATH",
        multiple=True,
        callback=parse_outputs,
        shell_complete=complete_output,
        help=text,
    )


def parse_outputs(ctx: click.Context, param: click.Parameter, values: tuple[str, ...]) -> tuple[Output, ...]:
    """Parse the values of `-o FORMAT=PATH`; a click callback."""
    del ctx, param
    return tuple(_parse_output(value) for value in values)


def _parse_output(value: str) -> Output:
    format_, equals, path = value.partition("=")
    if not equals or not path or not format_:
        from grader.cli.near_misses import output_meant

        meant = output_meant(value)
        likely = f"; did you mean {meant}" if meant else ""
        raise click.BadParameter(f"expected FORMAT=PATH, found {value!r}{likely}")
    if format_ != EVIDENCE and format_of(format_) is None:
        raise click.BadParameter(
            f"{format_!r} is not a format{with_nearest(format_, [*FORMATS, *added_formats(), EVIDENCE])}"
        )
    if format_ == EVIDENCE and path == "-":
        raise click.BadParameter("evidence is a folder: expected evidence=FOLDER, found evidence=-")
    from grader.grading.reporting.delivery import Output

    return Output(format_, None if path == "-" else Path(path))
