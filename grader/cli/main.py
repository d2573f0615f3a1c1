"""The command line: subcommands, output and exit codes."""

from __future__ import annotations

import atexit
import gc
import os
import signal
import sys
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import replace
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

import grader
from grader.cli.completion import complete_file
from grader.cli.options import (
    PATH,
    audience_options,
    complain,
    drawn_by,
    drawn_with,
    parse_percent,
    readers,
    shown_progress,
)
from grader.cli.outputs import outputs_option
from grader.cli.run_options import run_options
from grader.grading.model.grading_options import GRADE, GradingOptions
from grader.grading.reporting.formats import EVIDENCE, known
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import (
    ALL_MET,
    INTERRUPTED,
    UNDECIDED,
    UNUSABLE,
    GraderError,
    HarnessError,
    RubricError,
)

if TYPE_CHECKING:
    from contextlib import AbstractContextManager
    from fractions import Fraction
    from typing import Protocol

    from click.shell_completion import CompletionItem

    from grader.grading.app.keeping import EvidenceWriter
    from grader.grading.app.request import GradeRequest
    from grader.grading.model.exercise import Exercise
    from grader.grading.model.report import Report
    from grader.grading.model.run import Run
    from grader.grading.reporting.audience import Readers
    from grader.grading.reporting.delivery import Output
    from grader.runtime.session import RecordingSession

    Progress = Callable[[str], None]

    class _Start(Protocol):
        """What opens sessions and grades in them: the module `grader.grading.app.start`, or what stands in for it."""

        def opened_early(
            self, submission: str, rubrics: Sequence[Path], isolation: str, progress: Progress, /
        ) -> AbstractContextManager[RecordingSession | None]: ...

        def opened(self, request: GradeRequest, progress: Progress, /) -> AbstractContextManager[RecordingSession]: ...

        def grade_once(  # noqa: PLR0913  as in that module
            self,
            request: GradeRequest,
            progress: Progress,
            on_recorded: Callable[[Run, Sequence[Exercise]], None] | None,
            on_partial_report: Callable[[Report], None] | None,
            /,
            *,
            pictures: bool,
            session: RecordingSession | None,
        ) -> Report: ...


_EPILOG = (
    "Exit codes: 0 all criteria met (or the share of --min-score reached), 1 not, 2 the command or something it was "
    "given cannot be used, or a rubric has a mistake, 3 undecided through no fault of the student, 130 interrupted."
)
#: Garbage is collected after so many new objects: imports make many and no garbage.
COLLECT_AFTER = 200_000
# Names of the subcommands, and of their modules.
_SUBCOMMANDS = (
    "batch",
    "completion",
    "doctor",
    "explain",
    "export",
    "interfaces",
    "observe",
    "rejudge",
    "rubric",
    "selftest",
    "upload",
    "verify",
)
# Internal name of the default command; it cannot clash, because a process argument cannot contain a NUL.
_DEFAULT = "\0"


def _start() -> _Start:
    from grader.grading.app import start

    return start


def _saves(submission: Path) -> Iterator[bool]:
    from grader.cli.interactive import saves

    return saves(submission)


@dataclass(frozen=True, slots=True)
class Invocation:
    """What the command `grade` is given besides its arguments, as the object of its context."""

    started: float  # since when the user waits, as `time.monotonic` counts
    start: Callable[[], _Start] = _start  # imports what opens sessions and grades
    saves: Callable[[Path], Iterator[bool]] = _saves  # see `interactive.saves`


class CommandLine(click.Group):
    """Subcommands, and a default command that runs if the first argument is none of them.

    A subcommand that is only named is the `command` of its module in this folder, which is imported when it is used or
    described: importing all of them would take each command 4 ms.
    """

    def __init__(self, default: click.Command, names: Sequence[str] = (), **attributes: Any) -> None:
        super().__init__(**attributes)
        self.default = default
        self.names = names
        self.add_command(default, _DEFAULT)

    def list_commands(self, ctx: click.Context) -> list[str]:
        """Return the names of the subcommands."""
        return sorted({*super().list_commands(ctx), *self.names} - {_DEFAULT})

    def get_command(self, ctx: click.Context, cmd_name: str) -> click.Command | None:
        """Return the command of a name, or None."""
        if cmd_name in self.names and cmd_name not in self.commands:
            self.add_command(import_module(f"grader.cli.{cmd_name}").command, cmd_name)
        return super().get_command(ctx, cmd_name)

    def parse_args(self, ctx: click.Context, args: list[str]) -> list[str]:
        """Insert the default command unless the first argument is a subcommand."""
        if ctx.resilient_parsing and not args:
            return super().parse_args(ctx, args)  # a shell completes the first word
        return super().parse_args(ctx, args if args and args[0] in self.list_commands(ctx) else [_DEFAULT, *args])

    def shell_complete(self, ctx: click.Context, incomplete: str) -> list[CompletionItem[Any]]:
        """Complete the first word: what it may be for the default command, or a subcommand."""
        with self.default.make_context(None, [], parent=ctx, resilient_parsing=True) as default:
            first, word = (self.default if incomplete.startswith("-") else self.default.params[0]), incomplete
            return [*first.shell_complete(default, word), *super().shell_complete(ctx, incomplete)]

    def invoke(self, ctx: click.Context) -> None:
        """Run the command and exit with its code; errors are printed on standard error."""
        ctx.exit(_guarded(lambda: super(CommandLine, self).invoke(ctx)))

    def format_help(self, ctx: click.Context, formatter: click.HelpFormatter) -> None:
        """Describe the default command, then the others."""
        formatter.write_usage(ctx.command_path, "[OPTIONS] [SUBMISSION]")
        self.default.format_help_text(ctx, formatter)
        self.default.format_options(ctx, formatter)
        self.format_commands(ctx, formatter)
        self.default.format_epilog(ctx, formatter)


class _Default(click.Command):
    def get_help(self, ctx: click.Context) -> str:
        return ctx.parent.get_help() if ctx.parent else super().get_help(ctx)


@click.command(cls=_Default, epilog=_EPILOG, hidden=True)
@click.argument("submission", required=False, shell_complete=complete_file)
@run_options(GRADE)
@click.option("--seed-key", type=PATH, metavar="FILE", help="Draw values by this key and the files handed in.")
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON, and nothing else.")
@outputs_option("Write a report ({formats}), `-` is standard output; or keep evidence=FOLDER; repeatable.")
@click.option(
    "--min-score",
    type=float,
    metavar="P",
    callback=parse_percent,
    help="Exit with 0 if the score is at least P percent.",
)
@audience_options
@click.option("-v", "--verbose", is_flag=True, help="Print every reason, hint and call, the graph, and versions.")
@click.option("--watch", is_flag=True, help="Grade again whenever a .py file is saved, until Ctrl-C.")
@click.option("--open", "opens", is_flag=True, help="Write the HTML page and open it in a browser.")
@click.option("--no-progress", is_flag=True, help="Show no progress while grading.")
@click.version_option(grader.__version__, prog_name="grade", message="%(prog)s %(version)s")
def _command(
    *, submission: str | None, options: GradingOptions, watch: bool, no_progress: bool, **as_given: Any
) -> int:
    """Grade a SUBMISSION (a folder, an archive or a .py file) and explain the score.

    Without one, the current folder is graded if it holds exercise files. A folder with the name of a command is graded
    as ./NAME.
    """
    context = click.get_current_context()
    invocation = context.find_object(Invocation) or Invocation(time.monotonic())
    if submission is not None and (context.args or not os.path.exists(submission)):  # noqa: PTH110 - any name is valid
        _check_submission(submission, context.args)
    start = invocation.start()
    with ExitStack() as stack:
        session = None
        if submission is not None and not watch:  # before the rest is imported, which takes as long as a worker's start
            with shown_progress(wanted=not no_progress) as progress:
                early = start.opened_early(submission, options.rubrics, options.isolation, progress)
                session = stack.enter_context(early)
        given = {"options": options, "watch": watch, "no_progress": no_progress, **as_given}
        return _run_command(invocation, session, submission=submission, **given)


def _check_submission(submission: str, others: Sequence[str]) -> None:
    """Raise an error with what was probably meant, if there are several submissions, or none and something like it."""
    from grader.cli.near_misses import meant_submission, too_many
    from grader.grading.submissions.submission import not_there

    if others:
        raise too_many(submission, others)
    hint = meant_submission(submission, _SUBCOMMANDS)
    if hint:
        raise not_there(submission, hint)


def _run_command(  # noqa: PLR0913  one parameter an option
    invocation: Invocation,
    session: RecordingSession | None,
    *,
    submission: str | None,
    options: GradingOptions,
    seed_key: Path | None,
    as_json: bool,
    outputs: tuple[Output, ...],
    min_score: Fraction | None,
    audience: str | None,
    as_of: str,
    verbose: bool,
    watch: bool,
    opens: bool,
    no_progress: bool,
) -> int:
    """Check the options, grade, and return the exit code."""
    from grader.cli import interactive
    from grader.grading.reporting.delivery import Output, prepared_outputs

    rendered = tuple(output for output in outputs if output.format != EVIDENCE)
    if watch and (as_json or rendered != outputs):
        raise click.BadParameter("--watch prints a report after each save: it excludes --json and evidence")
    pages = [output.path for output in rendered if output.format == "html" and output.path is not None]
    if opens and not pages:
        pages = [interactive.PAGE]
        rendered = (*rendered, Output("html", interactive.PAGE))
    wanted = prepared_outputs((*rendered, Output("json")) if as_json else rendered, verbose=verbose)
    for_whom = readers(audience, as_of)
    from grader.grading.app.request import request_for
    from grader.grading.app.seeds import PRACTICE

    key = drawn_with(options.seed, seed_key)
    submission = interactive.folder_at_hand(options.rubrics) if submission is None else submission
    if submission is None:
        return UNUSABLE
    request = request_for(
        submission, options, seed_key=key or PRACTICE, draw=drawn_by(options.student, options.variant_key)
    )
    folders = [output.path for output in outputs if output.format == EVIDENCE and output.path is not None]
    wanted = tuple(replace(output, evidence=next(iter(folders), None)) for output in wanted)
    writer = _evidence_writer(folders, request) if folders else None
    page = pages[0] if opens else None
    grading = _Grading(invocation, request, wanted, for_whom, writer, min_score, not no_progress, page)
    # A folder that does not exist cannot be watched; grading it says so.
    watched = watch and Path(request.submission).exists()
    return grading.each_save() if watched else grading.grade_and_deliver(invocation.started, session)


@dataclass(slots=True)
class _Grading:
    """Grades a submission, once or repeatedly, and delivers its reports."""

    invocation: Invocation
    request: GradeRequest
    outputs: Sequence[Output]
    readers: Readers
    writer: EvidenceWriter | None
    min_score: Fraction | None
    shows_progress: bool
    page: Path | None  # the page to open after the first report; None to open none

    def grade_and_deliver(self, started: float, session: RecordingSession | None = None) -> int:
        """Grade, in a session if one is given, and return the exit code; the user waits since `started`."""
        from grader.grading.model.report import report_exit_code
        from grader.grading.reporting.audience import told
        from grader.grading.reporting.delivery import deliver, early_delivery

        remember = self.writer.remember if self.writer is not None else None
        early = early_delivery(self.outputs, self.readers)
        pictures = any(known(output.format).illustrated for output in self.outputs)
        with shown_progress(wanted=self.shows_progress) as progress:
            progress("starting")
            start = self.invocation.start()
            report = start.grade_once(self.request, progress, remember, early, pictures=pictures, session=session)
        report = replace(report, duration_s=time.monotonic() - started)
        self._warn(report)
        deliver(report, self.outputs, self.readers)
        seen = told(report, self.readers)
        if self.writer is not None and seen is not report:
            complain("the evidence is not kept: it holds what the rubric withholds from students")
        elif self.writer is not None:
            self.writer.write(report)
        if self.page is not None:
            from grader.cli.interactive import open_page

            open_page(self.page)
            self.page = None

        return report_exit_code(seen, self.min_score)

    def each_save(self) -> int:
        """Grade now and after each save, in one session; return the exit code of the last time at Ctrl-C."""
        started, start = self.invocation.started, self.invocation.start()
        saved, code = self.invocation.saves(Path(self.request.submission)), ALL_MET
        next(saved)
        with ExitStack() as stack:
            with shown_progress(wanted=self.shows_progress) as progress:
                session = stack.enter_context(start.opened(self.request, progress))
            while True:
                code = _guarded(partial(self.grade_and_deliver, started, session))
                if code == INTERRUPTED:
                    return code
                click.echo("watching for the next save; Ctrl-C ends this", err=True)
                try:
                    next(saved)
                except KeyboardInterrupt:
                    return code
                started = time.monotonic()
                if sys.stdout is not None and sys.stdout.isatty():
                    click.clear()

    def _warn(self, report: Report) -> None:
        from grader.runtime.model.checkup import missing
        from grader.runtime.model.releases import TRIED

        for found in () if self.readers.only_students else missing(report.environment.containment):
            complain(f"sandbox {report.environment.isolation}: {found}")
        if report.environment.ros_distro not in TRIED:
            complain(f"this grader was never tested with ROS 2 {report.environment.ros_distro}")


def _evidence_writer(folders: Sequence[Path], request: GradeRequest) -> EvidenceWriter:
    from grader.grading.app.keeping import EvidenceWriter

    return EvidenceWriter(folders, request)


#: The command `grade`.
app = CommandLine(_command, _SUBCOMMANDS, name="grade", context_settings={"help_option_names": ["-h", "--help"]})
_command.context_settings = {**app.context_settings, "allow_extra_args": True}


def main() -> None:
    """Run the command line of this process, and exit."""
    gc.set_threshold(COLLECT_AFTER)
    if signal.getsignal(signal.SIGINT) is signal.default_int_handler:  # not for a job in the background of a shell
        signal.signal(signal.SIGINT, _interrupt_once)
    # The collections at the exit would look at all that was imported, to free memory that the kernel frees anyway
    atexit.register(gc.freeze)
    from grader.cli.interactive import process_start

    app(prog_name="grade", obj=Invocation(process_start()))


def _interrupt_once(*_: object) -> None:
    """End the command at Ctrl-C; a second one would break off what tidies up after the first."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    raise KeyboardInterrupt


def _guarded(run: Callable[[], object]) -> int:
    """Run a command and return its exit code, whether it succeeds or raises."""
    try:
        code = run()
    except click.exceptions.Exit:
        raise
    except click.exceptions.NoArgsIsHelpError as error:
        error.show()
        return UNUSABLE
    except click.ClickException as error:
        from grader.cli.near_misses import usage_hint

        known = usage_hint(error)
        message = error.message if known else error.format_message()
        context = error.ctx if isinstance(error, click.UsageError) else None
        path = context.command_path.partition(_DEFAULT)[0].strip() if context is not None else "grade"
        _fail(message.rstrip("."), hint=known or f"{path} --help lists the options")
        return UNUSABLE
    except GraderError as error:
        # A RubricError lists one mistake per line; in any other message a line break comes from a hostile name.
        lines = error.message.splitlines() if isinstance(error, RubricError) else [error.message]
        _fail(*lines, hint=error.hint)
        return UNDECIDED if isinstance(error, HarnessError) else UNUSABLE
    except (KeyboardInterrupt, click.Abort):
        click.echo("interrupted: no report was made", err=True)
        return INTERRUPTED
    except Exception as error:  # the last line of defence: a bug of the grader must not look like a low score
        if os.environ.get("GRADER_DEBUG") == "1":
            import traceback

            traceback.print_exc()
        _fail(f"the grader failed: {type(error).__name__}: {error}", hint="GRADER_DEBUG=1 shows where")
        return UNDECIDED
    return code if isinstance(code, int) else ALL_MET


def _fail(*lines: str, hint: str) -> None:
    complain(*lines, kind="error")
    complain(*filter(None, [hint]), kind="hint")
