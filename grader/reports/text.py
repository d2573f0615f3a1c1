"""The report for people: what a student reads in a terminal."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from fractions import Fraction

from rich.text import Text

from grader.model.containment import NO_WALLS, summarised
from grader.model.exercise import Outcome
from grader.model.quantities import seconds
from grader.model.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.model.trace import ClockKind
from grader.reports.escape import shown
from grader.reports.graph import draw_graph
from grader.reports.page import Page

# Words carry the outcome, so that nothing is lost without colour.
_WORDS = {
    Outcome.MET: "met",
    Outcome.PARTLY: "partly",
    Outcome.NOT_MET: "not met",
    Outcome.BLOCKED: "blocked",
    Outcome.UNDECIDED: "undecided",
}
_STYLES = {
    Outcome.MET: "green",
    Outcome.PARTLY: "yellow",
    Outcome.NOT_MET: "bold red",
    Outcome.BLOCKED: "dim",
    Outcome.UNDECIDED: "bold magenta",
}
_WORD_WIDTH = max(len(word) for word in _WORDS.values())
_WHAT_HAPPENED = {
    "syntax_error": "could not be compiled",
    "exception": "raised an exception",
    "exited": "ended by itself",
    "hung": "did not come back",
    "killed": "was ended",
}
_NAME_LIMIT = 100
_MOST_FAULTS = 10
_MOST_NOTES = 20
# The first frames say where it began, the last where it broke; a deep recursion repeats itself between.
_FIRST_FRAMES, _LAST_FRAMES = 3, 5
_DETAIL = " " * 6


def render_text(report: Report, *, width: int, colour: bool) -> str:
    """Return a report as text.

    Args:
        report: What is shown; all its text is taken for hostile.
        width: Columns of the page; at least 20 are used.
        colour: Whether to colour with ANSI sequences; without, the text is the same.
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
    score = f"{_points(report.score)} of {_points(report.max_score)} points"
    page.put(f"{shown(report.name, limit=_NAME_LIMIT)}: {score}", style="bold green" if full else "bold")
    verdicts = [verdict for exercise in report.exercises for verdict in exercise.verdicts]
    undecided = [verdict for verdict in verdicts if verdict.outcome is Outcome.UNDECIDED]
    if undecided:
        page.put(_not_final(undecided), style="bold magenta")
    page.put(_summary(verdicts, final=report.final))
    if any(verdict.outcome is Outcome.BLOCKED for verdict in verdicts):
        page.put("Blocked criteria are judged once what they need is met.")
    _notes(page, report.notes, indent="")


def _not_final(undecided: Sequence[Verdict]) -> str:
    count = len(undecided)
    criteria = "1 criterion is" if count == 1 else f"{count} criteria are"
    open_points = _points(sum((v.max_score for v in undecided), Fraction(0)))
    return (
        f"This score is not final: {criteria} undecided through no fault of the student, "
        f"{open_points} points are still open. Grade again."
    )


def _summary(verdicts: Sequence[Verdict], *, final: bool) -> str:
    counts = Counter(verdict.outcome for verdict in verdicts)
    parts = [f"{counts[outcome]} {word}" for outcome, word in _WORDS.items() if counts[outcome]]
    judged = [f"{counts[Outcome.MET]} of {len(verdicts)} criteria met", *parts[bool(counts[Outcome.MET]) :]]
    return f"{'Final' if final else 'So far'}: {', '.join(judged)}."


def _exercise(page: Page, exercise: ExerciseReport) -> None:
    optional = "" if exercise.required else ", optional"
    title = f"Exercise {shown(exercise.number, limit=_NAME_LIMIT)}: {shown(exercise.title, limit=_NAME_LIMIT)}"
    score = f"{_points(exercise.score)} of {_points(exercise.max_score)} points"
    full = exercise.score == exercise.max_score
    page.put(f"{title} ({score}{optional})", style="bold green" if full else "bold")
    points = [f"{_points(verdict.score)}/{_points(verdict.max_score)}" for verdict in exercise.verdicts]
    column = max((len(text) for text in points), default=0)
    for verdict, text in zip(exercise.verdicts, points, strict=True):
        _verdict(page, verdict, text.rjust(column))
    for fault in exercise.faults[:_MOST_FAULTS]:
        _fault(page, fault)
    _more(page, len(exercise.faults) - _MOST_FAULTS, "faults")
    _graph(page, exercise)
    if exercise.clock is ClockKind.WALL:
        page.put(f"judged on the wall clock: {shown(exercise.clock_reason)}", prefix="  note: ")
    _notes(page, exercise.notes, indent="  ")


def _verdict(page: Page, verdict: Verdict, points: str) -> None:
    blocked = verdict.outcome is Outcome.BLOCKED
    word = f"  {_WORDS[verdict.outcome].ljust(_WORD_WIDTH)}"
    prefix = Text.assemble((word, _STYLES[verdict.outcome]), (f"  {points}  ", "dim" if blocked else ""))
    title = shown(verdict.title)
    if blocked:
        page.put(f"{title}: {shown(verdict.reason).removeprefix('not judged: ')}", prefix=prefix, style="dim")
        return
    if verdict.outcome is Outcome.MET:
        page.put(title, prefix=prefix)
        return
    # The id is what "needs ..." of a blocked criterion refers to.
    page.put(Text.assemble((title, "bold"), (f" ({verdict.id})", "dim")), prefix=prefix)
    _details(page, verdict)


def _details(page: Page, verdict: Verdict) -> None:
    reason = shown(verdict.reason)
    page.put(reason, prefix=_DETAIL)
    if verdict.hint:
        page.put(shown(verdict.hint), prefix=Text.assemble(_DETAIL, ("hint: ", "cyan")), style="cyan")
    if verdict.location is None:
        return
    place = _place(verdict.location.file, verdict.location.line)
    if place not in reason:
        page.put(place, prefix=f"{_DETAIL}at ", style="bold")


def _fault(page: Page, fault: ReportedFault) -> None:
    happened = _WHAT_HAPPENED.get(fault.kind, shown(fault.kind))
    place = _place(fault.file, fault.line) or "the node"
    when = f" at t = {seconds(fault.t_ns):.3f} s" if fault.t_ns else ""
    page.put(
        f"{place} {happened}{when} (scenario {shown(fault.scenario, limit=_NAME_LIMIT)})",
        prefix=Text.assemble(("  fault: ", "red")),
    )
    page.put(shown(fault.text), prefix=_DETAIL, style="red")
    for frame in _frames(fault.frames):
        page.put(frame, prefix=f"{_DETAIL}  ", style="dim")


def _frames(frames: Sequence[str]) -> list[str]:
    left_out = len(frames) - _FIRST_FRAMES - _LAST_FRAMES
    if left_out <= 1:
        return [shown(frame) for frame in frames]
    first, last = frames[:_FIRST_FRAMES], frames[-_LAST_FRAMES:]
    return [*map(shown, first), f"({left_out} more calls)", *map(shown, last)]


def _graph(page: Page, exercise: ExerciseReport) -> None:
    # With a single node the drawing would say no more than the criteria do.
    if exercise.graph is None or len(exercise.graph.nodes) < 2:
        return
    page.put("  Live ROS graph:")
    for line in draw_graph(exercise.graph, width=page.width - 4):
        page.put(line.lstrip(), prefix=" " * (4 + len(line) - len(line.lstrip())))


def _notes(page: Page, notes: Sequence[str], *, indent: str) -> None:
    for note in notes[:_MOST_NOTES]:
        page.put(shown(note), prefix=f"{indent}note: ")
    _more(page, len(notes) - _MOST_NOTES, "notes", indent=indent)


def _more(page: Page, count: int, what: str, *, indent: str = "  ") -> None:
    if count > 0:
        page.put(f"and {count} more {what}; all are in the JSON report", prefix=indent)


def _foot(page: Page, report: Report) -> None:
    made_with = report.environment
    walls = [exercise.number for exercise in report.exercises if exercise.clock is ClockKind.WALL]
    versions = (
        f"grader {made_with.grader}, rclpy {made_with.rclpy} ({made_with.ros_distro}), "
        f"{made_with.rmw}, Python {made_with.python}"
    )
    rows = (
        ("seed", f"{report.seed} (--seed {report.seed} repeats this run)"),
        ("versions", versions),
        ("isolation", summarised(made_with.isolation, made_with.containment)),
        ("clock", f"virtual, but the wall clock in exercise {', '.join(walls)}" if walls else "virtual"),
        ("duration", f"{report.duration_s:.1f} s"),
    )
    for name, value in rows:
        loud = name == "isolation" and made_with.isolation == NO_WALLS
        page.put(
            shown(value),
            prefix=Text.assemble((f"{name.ljust(9)}  ", "dim")),
            style="bold red" if loud else "dim",
        )


def _place(file: str, line: int) -> str:
    return f"{shown(file)}:{line}" if line else shown(file)


def _points(points: Fraction) -> str:
    """Return points with two digits at most, and none where they would be zero."""
    return f"{float(points):.2f}".rstrip("0").rstrip(".")
