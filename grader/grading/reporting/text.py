"""The report as text for a student in a terminal: what to fix first, a line for each criterion, details on request."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction

from rich.cells import cell_len
from rich.text import Text

from grader.grading.model.exercise import Location, Outcome, exercise_name
from grader.grading.model.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import shown
from grader.grading.reporting.graph import draw_graph
from grader.grading.reporting.page import Page
from grader.grading.reporting.wording import MOST_FAULTS, MOST_NOTES, OUTCOME_WORDS, points
from grader.runtime.model.trace import ClockKind

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


def render_text(report: Report, *, width: int, colour: bool, verbose: bool = False) -> str:
    """Return a report, all of whose text is treated as hostile, as text of at least 20 columns.

    Colours are ANSI sequences; the text is the same without. Only a verbose text shows every reason and hint in full,
    the calls that led to faults, the ROS graph, and how to reproduce the report.
    """
    page = Page(width=width, colour=colour)
    first = wording.first_to_fix(report)
    _head(page, report, verbose=verbose)
    if first is not None:
        _fix_first(page, *first)
    if verbose:
        for exercise in report.exercises:
            page.blank()
            _exercise(page, exercise)
        page.blank()
        _foot(page, report)
    else:
        _outlines(page, report.exercises, first[1] if first is not None else None)
        page.blank()
        _last_line(page, report)
    return page.text()


def _outlines(page: Page, exercises: Sequence[ExerciseReport], first: Verdict | None) -> None:
    """Write each exercise in short; of those that nothing was handed in for, only what is missing."""
    follows = False
    for exercise in exercises:
        missing = [v.missing_file for v in exercise.verdicts]
        absent = bool(missing) and all(missing)
        if not (absent and follows):
            page.blank()
        if absent:
            name = exercise_name(shown(exercise.number, limit=wording.NAME_LIMIT))
            files = " or ".join(map(shown, dict.fromkeys(missing)))
            page.put(f"{name}: no {files} yet (0 of {points(exercise.max_score)} points)", style="bold")
        else:
            _outline(page, exercise, first)
        follows = absent


def _head(page: Page, report: Report, *, verbose: bool) -> None:
    full = report.final and report.score == report.max_score
    page.put(wording.headline(report), style="bold green" if full else "bold")
    for warning in wording.warnings(report):
        page.put(warning, style="bold magenta")
    if verbose:
        page.put(wording.summary(report))


def _fix_first(page: Page, exercise: ExerciseReport, verdict: Verdict) -> None:
    page.put(Text.assemble((_cause(verdict), "bold")), prefix=Text.assemble(("Fix first: ", "bold red")), indent=2)
    where = verdict.location
    if where is not None:
        place = wording.place(where.file, where.line)
        code = _source_line(exercise, verdict)
        page.put(f"{place}: {shown(code)}" if code else f"at {place}", prefix="  ", style="bold")
    if verdict.hint:
        page.put(shown(verdict.hint), prefix=Text.assemble(("  hint: ", "cyan")), style="cyan")


def _source_line(exercise: ExerciseReport, verdict: Verdict) -> str:
    """Return the line of the source that a verdict points to; empty if it is not known."""
    found = (e.lines[e.line - e.first] for e in exercise.excerpts if Location(e.file, e.line) == verdict.location)
    return next(found, "").strip()


def _cause(verdict: Verdict) -> str:
    """Return why points were lost, in a few words if known; a fault elsewhere than the verdict comes with its place."""
    if not verdict.brief:
        return shown(wording.reason(verdict))
    fault = verdict.evidence.get("fault")
    if not isinstance(fault, Mapping):
        return shown(verdict.brief)
    place = Location(str(fault.get("file") or fault.get("process", "")), int(fault.get("line") or 0))
    known = place == verdict.location
    return shown(verdict.brief if known else f"{wording.place(place.file, max(place.line, 0))}: {verdict.brief}")


def _outline(page: Page, exercise: ExerciseReport, first: Verdict | None) -> None:
    """Write one line for each criterion, and one for all that are blocked."""
    full = exercise.score == exercise.max_score
    page.put(wording.exercise_line(exercise), style="bold green" if full else "bold")
    blocked = [verdict for verdict in exercise.verdicts if verdict.outcome is Outcome.BLOCKED]
    left = f"0/{points(sum((verdict.max_score for verdict in blocked), Fraction(0)))}"
    shares = [_share(verdict) for verdict in exercise.verdicts if verdict not in blocked]
    column = max(map(len, [*shares, *([left] if blocked else [])]), default=0)
    undecided: set[str] = set()
    for verdict in exercise.verdicts:
        if verdict in blocked:
            continue
        again = verdict.reason in undecided
        line = f"{shown(verdict.title)}: for the same reason" if again else _in_a_line(verdict, first)
        page.put(line, prefix=_prefix(verdict.outcome, _share(verdict).rjust(column)))
        if verdict.outcome is Outcome.UNDECIDED and verdict.hint and not again:
            undecided.add(verdict.reason)
            page.put(shown(verdict.hint), prefix=Text.assemble(_DETAIL, ("hint: ", "cyan")), style="cyan")
    if blocked:
        what = "the criterion that it needs is" if len(blocked) == 1 else "the criteria that they need are"
        page.put(
            f"{len(blocked)} more: judged once {what} met",
            prefix=_prefix(Outcome.BLOCKED, left.rjust(column)),
            style="dim",
        )
    for fault in _unexplained(exercise)[:MOST_FAULTS]:
        page.put(f"{wording.happened(fault)}: {shown(fault.text)}", prefix=Text.assemble(("  fault: ", "red")))
    _more(page, len(_unexplained(exercise)) - MOST_FAULTS, "faults")
    _notes(page, exercise.notes, indent="  ")


def _in_a_line(verdict: Verdict, first: Verdict | None) -> str:
    title = shown(verdict.title)
    if verdict.outcome is Outcome.MET:
        return title
    if verdict is first:
        return f"{title}: see above"
    if first is not None and verdict.same_cause_as == first.id:
        return f"{title}: same cause as above"
    where = verdict.location
    return f"{title}: {_cause(verdict)}{f' ({wording.place(where.file, where.line)})' if where else ''}"


def _unexplained(exercise: ExerciseReport) -> list[ReportedFault]:
    """Return the faults that no criterion names."""
    faults = [v.evidence.get("fault") for v in exercise.verdicts]
    known = {
        (f.get("file") or f.get("process"), f.get("line"), f.get("text")) for f in faults if isinstance(f, Mapping)
    }
    return [fault for fault in exercise.faults if (fault.file, fault.line, fault.text) not in known]


def _last_line(page: Page, report: Report) -> None:
    _notes(page, [n for n in report.notes if n not in report.staff_notes], indent="")
    if wording.ran_without_sandbox(report):
        page.put(wording.isolation(report), prefix=_row("isolation"), style="bold red")
    seed = "" if report.seed is None else f", seed {report.seed}"
    page.put(f"{wording.run_line(report)}{seed}; -v shows everything", style="dim")


def _share(verdict: Verdict) -> str:
    return f"{points(verdict.score)}/{points(verdict.max_score)}"


def _prefix(outcome: Outcome, share: str) -> Text:
    word = f"  {OUTCOME_WORDS[outcome].ljust(_WORD_WIDTH)}"
    return Text.assemble((word, _STYLES[outcome]), (f"  {share}  ", "dim" if outcome is Outcome.BLOCKED else ""))


def _exercise(page: Page, exercise: ExerciseReport) -> None:
    full = exercise.score == exercise.max_score
    page.put(wording.exercise_line(exercise), style="bold green" if full else "bold")
    column = max((len(_share(verdict)) for verdict in exercise.verdicts), default=0)
    for verdict in exercise.verdicts:
        _verdict(page, verdict, _share(verdict).rjust(column))
    for fault in exercise.faults:
        _fault(page, fault)
    _graph(page, exercise)
    if exercise.clock is ClockKind.WALL:
        page.put(f"judged on the wall clock: {shown(exercise.clock_reason)}", prefix="  note: ")
    _notes(page, exercise.notes, indent="  ", most=len(exercise.notes))


def _verdict(page: Page, verdict: Verdict, share: str) -> None:
    prefix, title = _prefix(verdict.outcome, share), shown(verdict.title)
    if verdict.outcome is Outcome.BLOCKED:
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


def _notes(page: Page, notes: Sequence[str], *, indent: str, most: int = MOST_NOTES) -> None:
    for note in notes[:most]:
        page.put(shown(note), prefix=f"{indent}note: ")
    _more(page, len(notes) - most, "notes", indent=indent)


def _more(page: Page, count: int, what: str, *, indent: str = "  ") -> None:
    if count > 0:
        page.put(f"and {count} more {what}; -v shows all", prefix=indent)


def _foot(page: Page, report: Report) -> None:
    notes = wording.relevant_notes(report)
    _notes(page, notes, indent="", most=len(notes))
    page.put(wording.run_line(report), style="dim")
    for name, value in wording.reproduction_lines(report):
        loud = name == "isolation" and wording.ran_without_sandbox(report)
        page.put(value, prefix=_row(name), style="bold red" if loud else "dim")
    prefix = _row("reproduce")
    for line in _command_lines(wording.reproducing_command(report), page.width - prefix.cell_len):
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
