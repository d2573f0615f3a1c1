"""Writes reports atomically to files, and to standard output."""

from __future__ import annotations

import errno
import os
import shutil
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from dataclasses import replace
from pathlib import Path
from typing import TextIO

from grader.grading.model.report import Report
from grader.grading.reporting.audience import ANYBODY, Readers
from grader.grading.reporting.escape import encoded
from grader.grading.reporting.formats import FORMATS, PageLayout, check_surroundings, known, rendered
from grader.runtime.files import beside, is_special, link_target, write_whole
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError


def check_writable(path: Path) -> None:
    """Raise OSError if a report cannot be written to a path; what is there is not changed."""
    target = link_target(path)
    if is_special(target):
        return
    if target.is_dir():
        raise IsADirectoryError(errno.EISDIR, os.strerror(errno.EISDIR), str(path))
    if target.exists() and not os.access(target, os.W_OK):
        raise PermissionError(errno.EACCES, os.strerror(errno.EACCES), str(path))
    descriptor, probe = beside(target)
    os.close(descriptor)
    probe.unlink()


_FILE_WIDTH = 100
# Longer lines are hard to read, however wide the terminal is; programs that read them ask for more with COLUMNS.
_WIDEST = 120


@dataclass(frozen=True, slots=True)
class Output:
    """A report to deliver; without a path it goes to standard output."""

    format: str
    path: Path | None = None
    verbose: bool = False  # whether a text shows everything
    evidence: Path | None = None  # the folder of the kept evidence, which a page names; None if none is kept


def prepared_outputs(outputs: Sequence[Output], *, verbose: bool = False) -> tuple[Output, ...]:
    """Return all reports to deliver, files first, after checking that each can be written.

    If nothing goes to standard output, the text report is added. Texts show everything if `verbose`. Raises
    GraderError if a file cannot be written, two reports have the same destination, or the environment lacks a value
    that a format needs.
    """
    for output in outputs:
        check_surroundings(output.format)
    printed = [output for output in outputs if output.path is None]
    if len(printed) > 1:
        raise GraderError("standard output: expected one report, found more", "write the others to files")
    files = [output for output in outputs if output.path is not None]
    _refuse_twins([output.path for output in files if output.path is not None])
    for output in files:
        _check(output)
    return tuple(replace(output, verbose=verbose) for output in (*files, *(printed or [Output("text")])))


def deliver(report: Report, outputs: Sequence[Output], readers: Readers = ANYBODY) -> None:
    """Deliver every report, also after one of them failed; then raise the first GraderError.

    If a format of another package cannot print the report, its text goes to standard error: no mark is lost.
    """
    problems = [(output, problem) for output in outputs if (problem := _delivered(report, output, readers))]
    if any(output.path is None and output.format not in FORMATS for output, _ in problems):
        text = Output("text", verbose=any(output.verbose for output in outputs))
        with suppress(OSError):
            write_report(report, text, readers, sys.stderr)
    if problems:
        raise problems[0][1]


def early_delivery(outputs: Sequence[Output], readers: Readers = ANYBODY) -> Callable[[Report], None] | None:
    """Return a writer of partial reports, for files whose platform may end the run early; None without any.

    A report that cannot be written is ignored: delivery of the final one will raise the error.
    """
    files = [output for output in outputs if output.path is not None and known(output.format).written_early]

    def write(report: Report) -> None:
        with suppress(GraderError):
            deliver(report, files, readers)

    return write if files else None


def show(render: Callable[[PageLayout], str], *, for_people: bool, stream: TextIO | None = None) -> None:
    """Print text on standard output, or another stream, for its width and colour. A closed pipe is not an error.

    For people, characters that the terminal's encoding lacks are replaced; programs read UTF-8.
    """
    stream = stream or sys.stdout
    if stream is not None:
        columns = shutil.get_terminal_size().columns
        width = columns if os.environ.get("COLUMNS") == str(columns) else min(columns, _WIDEST)
        layout = PageLayout(width, _coloured(stream))
        _print(encoded(render(layout), stream.encoding if for_people else "utf-8"), stream)


def _refuse_twins(paths: Sequence[Path]) -> None:
    targets = [os.path.realpath(path) for path in paths]
    for path, target in zip(paths, targets, strict=True):
        if targets.count(target) > 1:
            raise GraderError(f"{path}: expected one report, found more", "give each report its own file")


def _check(output: Output) -> None:
    assert output.path is not None
    try:
        check_writable(output.path)
    except OSError as error:
        raise _unwritable(output, error) from error


def _delivered(report: Report, output: Output, readers: Readers) -> GraderError | None:
    try:
        write_report(report, output, readers)
    except OSError as error:
        return _unwritable(output, error)
    except GraderError as error:  # of a format of another package
        return error
    return None


def _unwritable(output: Output, error: OSError) -> GraderError:
    where = output.path or "standard output"
    return GraderError(f"{where}: the {output.format} report cannot be written: {error.strerror or error}")


def write_report(report: Report, output: Output, readers: Readers, stream: TextIO | None = None) -> None:
    """Write a report to its file, or to a stream, standard output if None; raises OSError if that fails."""
    if output.path is not None:
        recordings = os.path.relpath(output.evidence, output.path.parent) if output.evidence else ""
        layout = PageLayout(_FILE_WIDTH, colour=False, verbose=output.verbose, recordings=recordings)
        write_whole(output.path, rendered(output.format, report, layout, readers).encode("utf-8"))
        return

    def render(layout: PageLayout) -> str:
        return rendered(output.format, report, replace(layout, verbose=output.verbose), readers)

    show(render, for_people=output.format == "text", stream=stream)


def _coloured(stream: TextIO) -> bool:
    if os.environ.get("NO_COLOR"):
        return False
    if os.environ.get("FORCE_COLOR"):
        return True
    return stream.isatty() and os.environ.get("TERM") != "dumb"


def _print(data: bytes, stream: TextIO) -> None:
    try:
        stream.buffer.write(data)
        stream.flush()
    except OSError as error:
        # Prevent a second failure when Python flushes the buffer at exit.
        nowhere = os.open(os.devnull, os.O_WRONLY)
        os.dup2(nowhere, stream.fileno())
        os.close(nowhere)
        # A closed pipe, as after `head`, is not an error.
        if not isinstance(error, BrokenPipeError):
            raise
