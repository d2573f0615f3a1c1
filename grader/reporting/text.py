"""The report as text for a student in a terminal."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from rich.cells import cell_len
from rich.text import Text

from grader.core.exercise import Outcome
from grader.core.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.core.trace import ClockKind
from grader.reporting import wording
from grader.reporting.escape import shown
from grader.reporting.graph import draw_graph
from grader.reporting.page import Page
from grader.reporting.wording import MOST_FAULTS, MOST_NOTES, OUTCOME_WORDS, points

_STYLES = {
    Outcome.MET: "green",
    Outcome.PARTLY: "yellow",
    Outcome.NOT_MET: "bold red",
    Outcome.BLOCKED: "dim",
    Outcome.UNDECIDED: "bold magenta",
}
_WORD_WIDTH = max(len(word) for word in OUTCOME_WORDS.values())
_DETAIL = " " * 6
# Ends a line of a command that continues on the next one.
_GOES_ON = " \\"


def render_text(report: Report, *, width: int, colour: bool) -> str:
    """Return a report, all of whose text is treated as hostile, as text of at least 20 columns.

    Colours are ANSI sequences; the text is the same without.
    """
    page = Page(width=width, colour=colour)
    _head(page, report)
    for exercise in report.exercises:
        page.blank()
        _exercise(page, exercise)
    page.blank()
    _foot(page, report)
    return page.text()


def _head(page: Page, report: Report) -> None:
    full = report.final and report.score == report.max_score
    page.put(wording.headline(report), style="bold green" if full else "bold")
    for warning in wording.warnings(report):
        page.put(warning, style="bold magenta")
    page.put(wording.summary(report))
    page.put(wording.run_line(report), style="dim")
    if any(verdict.outcome is Outcome.BLOCKED for exercise in report.exercises for verdict in exercise.verdicts):
        page.put("Blocked criteria are judged once what they need is met.")
    _notes(page, report.notes, indent="")


def _exercise(page: Page, exercise: ExerciseReport) -> None:
    full = exercise.score == exercise.max_score
    page.put(wording.exercise_line(exercise), style="bold green" if full else "bold")
    shares = [f"{points(verdict.score)}/{points(verdict.max_score)}" for verdict in exercise.verdicts]
    column = max((len(share) for share in shares), default=0)
    for verdict, share in zip(exercise.verdicts, shares, strict=True):
        _verdict(page, verdict, share.rjust(column))
    for fault in exercise.faults[:MOST_FAULTS]:
        _fault(page, fault)
    _more(page, len(exercise.faults) - MOST_FAULTS, "faults")
    _graph(page, exercise)
    if exercise.clock is ClockKind.WALL:
        page.put(f"judged on the wall clock: {shown(exercise.clock_reason)}", prefix="  note: ")
    _notes(page, exercise.notes, indent="  ")


def _verdict(page: Page, verdict: Verdict, share: str) -> None:
    blocked = verdict.outcome is Outcome.BLOCKED
    word = f"  {OUTCOME_WORDS[verdict.outcome].ljust(_WORD_WIDTH)}"
    prefix = Text.assemble((word, _STYLES[verdict.outcome]), (f"  {share}  ", "dim" if blocked else ""))
    title = shown(verdict.title)
    if blocked:
        page.put(f"{title}: {shown(wording.reason(verdict))}", prefix=prefix, style="dim")
        return
    if verdict.outcome is Outcome.MET:
        page.put(title, prefix=prefix)
        return
    # "needs ..." of a blocked criterion refers to this id.
    page.put(Text.assemble((title, "bold"), (f" ({verdict.id})", "dim")), prefix=prefix)
    _details(page, verdict)


def _details(page: Page, verdict: Verdict) -> None:
    reason = shown(verdict.reason)
    page.put(reason, prefix=_DETAIL)
    if verdict.hint:
        page.put(shown(verdict.hint), prefix=Text.assemble(_DETAIL, ("hint: ", "cyan")), style="cyan")
    if verdict.location is None:
        return
    place = wording.place(verdict.location.file, verdict.location.line)
    if place not in reason:
        page.put(place, prefix=f"{_DETAIL}at ", style="bold")


def _fault(page: Page, fault: ReportedFault) -> None:
    page.put(wording.happened(fault), prefix=Text.assemble(("  fault: ", "red")))
    page.put(shown(fault.text), prefix=_DETAIL, style="red")
    for frame in wording.frames(fault.frames):
        page.put(frame, prefix=f"{_DETAIL}  ", style="dim")


def _graph(page: Page, exercise: ExerciseReport) -> None:
    # With a single node, the drawing adds nothing to the criteria.
    if exercise.graph is None or len(exercise.graph.nodes) < 2:
        return
    page.put("  Live ROS graph:")
    for line in draw_graph(exercise.graph, width=page.width - 4):
        page.put(line.lstrip(), prefix=" " * (4 + len(line) - len(line.lstrip())))


def _notes(page: Page, notes: Sequence[str], *, indent: str) -> None:
    for note in notes[:MOST_NOTES]:
        page.put(shown(note), prefix=f"{indent}note: ")
    _more(page, len(notes) - MOST_NOTES, "notes", indent=indent)


def _more(page: Page, count: int, what: str, *, indent: str = "  ") -> None:
    if count > 0:
        page.put(f"and {count} more {what}; all are in the JSON report", prefix=indent)


def _foot(page: Page, report: Report) -> None:
    for name, value in wording.reproduction(report):
        loud = name == "isolation" and wording.ran_without_sandbox(report)
        page.put(value, prefix=_row(name), style="bold red" if loud else "dim")
    prefix = _row("reproduce")
    for line in _command_lines(wording.command(report), page.width - prefix.cell_len):
        page.put(line, prefix=prefix)
        prefix = Text(" " * prefix.cell_len)


def _row(name: str) -> Text:
    return Text.assemble((f"{name.ljust(9)}  ", "dim"))


def _command_lines(words: Sequence[str], width: int) -> Iterator[str]:
    """Yield the lines of a command that can be copied, however many it takes."""
    line = ""
    for word in words:
        if line and cell_len(f"{line} {word}{_GOES_ON}") > width:
            yield line + _GOES_ON
            line = ""
        line = f"{line} {word}".lstrip()
    if line:
        yield line
