"""The report as GitHub Markdown, for a step summary, a release or a comment."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import LIMIT, markdown, markdown_block, markdown_code
from grader.grading.reporting.graph import draw_mermaid
from grader.runtime.model.dataclass import dataclass

#: GitHub drops a step summary of 1024 KiB or more entirely; the rest is left for other output of the step.
MOST_BYTES = 1000 * 1024
_SIGNS = {
    Outcome.MET: "✅",
    Outcome.PARTLY: "🟡",
    Outcome.NOT_MET: "❌",
    Outcome.BLOCKED: "⏸️",
    Outcome.UNDECIDED: "❔",
}
_EXPLAINED = (Outcome.PARTLY, Outcome.NOT_MET, Outcome.UNDECIDED)
_LEFT_OUT = (
    "> [!NOTE]\n> Details are left out, because GitHub drops reports that are too long; the JSON report has them.\n"
)


@dataclass(frozen=True, slots=True)
class Detail:
    """How much a report shows; the first entry of `DETAILS` that fits is used."""

    faults: int = wording.MOST_FAULTS
    notes: int = wording.MOST_NOTES
    frames: bool = True
    graph: bool = True
    text: int = LIMIT
    explanations: bool = True
    criteria: bool = True
    exercises: bool = True


_ALL = Detail()
_SHORT = Detail(faults=3, notes=5, frames=False, graph=False)
_SHORTER = replace(_SHORT, faults=0, notes=0, text=150)
#: From everything to the score alone; the least useful detail is dropped first.
DETAILS = (
    _ALL,
    replace(_ALL, frames=False),
    replace(_ALL, frames=False, graph=False),
    _SHORT,
    _SHORTER,
    replace(_SHORTER, explanations=False),
    replace(_SHORTER, explanations=False, criteria=False),
    replace(_SHORTER, exercises=False),
)


def render_markdown(report: Report, *, limit: int = MOST_BYTES) -> str:
    """Return a report as Markdown of at most `limit` bytes; details are dropped to stay below it."""
    text = _rendered(report, _ALL)
    for detail in DETAILS[1:]:
        if len(text.encode()) <= limit:
            break
        text = _rendered(report, detail)
    return text


def _rendered(report: Report, detail: Detail) -> str:
    parts = _head(report, detail)
    if detail.exercises:
        parts += [part for exercise in report.exercises for part in _exercise(exercise, detail)]
    return "\n".join([*parts, *_foot(report)])


def _head(report: Report, detail: Detail) -> list[str]:
    lines = [f"# {markdown(report.name, limit=wording.NAME_LIMIT)}: {wording.score_line(report)}\n"]
    lines += [f"> [!WARNING]\n> {markdown(warning)}\n" for warning in wording.warnings(report)]
    if wording.ran_without_sandbox(report):
        lines.append(f"> [!CAUTION]\n> isolation: {markdown(wording.isolation(report))}\n")
    lines += [f"**{markdown(wording.summary(report))}**\n", f"{markdown(wording.run_line(report))}\n"]
    lines += [_LEFT_OUT] if detail != _ALL else []
    return lines + _notes(wording.relevant_notes(report), detail)


def _exercise(exercise: ExerciseReport, detail: Detail) -> list[str]:
    parts = [f"## {markdown(wording.exercise_line(exercise))}\n"]
    if detail.criteria:
        parts.append(_table(exercise))
    if detail.explanations:
        parts += [_explanation(v, detail) for v in exercise.verdicts if v.outcome in _EXPLAINED]
    parts += [_fault(fault, detail) for fault in exercise.faults[: detail.faults]]
    parts += _more(len(exercise.faults) - detail.faults, "faults")
    drawing = draw_mermaid(exercise.graph) if detail.graph and exercise.graph is not None else ""
    if drawing:
        parts.append(f"Live ROS graph:\n\n```mermaid\n{drawing}\n```\n")
    if exercise.clock_reason:
        parts.append(f"- note: judged on the wall clock: {markdown(exercise.clock_reason, limit=detail.text)}\n")
    return parts + _notes(exercise.notes, detail)


def _table(exercise: ExerciseReport) -> str:
    rows = ["| | Points | Criterion |", "|:--|--:|:--|", *map(_row, exercise.verdicts)]
    return "\n".join(rows) + "\n"


def _row(verdict: Verdict) -> str:
    outcome = f"{_SIGNS[verdict.outcome]} {wording.OUTCOME_WORDS[verdict.outcome]}"
    share = f"{wording.points(verdict.score)}/{wording.points(verdict.max_score)}"
    needs = f": {markdown(wording.reason(verdict))}" if verdict.outcome is Outcome.BLOCKED else ""
    return f"| {outcome} | {share} | {markdown(verdict.title)}{needs} |"


def _explanation(verdict: Verdict, detail: Detail) -> str:
    where = verdict.location
    lines = [
        f"- **{markdown(verdict.title)}** ({markdown_code(verdict.id)}): {markdown(verdict.reason, limit=detail.text)}"
    ]
    if verdict.hint:
        lines.append(f"  - hint: {markdown(verdict.hint, limit=detail.text)}")
    if where is not None:
        lines.append(f"  - at {markdown_code(wording.place(where.file, where.line))}")
    return "\n".join(lines) + "\n"


def _fault(fault: ReportedFault, detail: Detail) -> str:
    item = f"- fault: {markdown(wording.happened(fault))}: {markdown_code(fault.text, limit=detail.text)}\n"
    if not (detail.frames and fault.frames):
        return item
    block = markdown_block("\n".join(wording.frames(fault.frames)))
    return item + "\n" + "\n".join(f"  {line}" for line in block.split("\n")) + "\n"


def _notes(notes: Sequence[str], detail: Detail) -> list[str]:
    shown_ones = [f"- note: {markdown(note, limit=detail.text)}\n" for note in notes[: detail.notes]]
    return shown_ones + _more(len(notes) - detail.notes, "notes")


def _more(count: int, what: str) -> list[str]:
    return [f"- and {count} more {what}; all are in the JSON report\n"] if count > 0 else []


def _foot(report: Report) -> list[str]:
    rows = [f"- {name}: {markdown_code(value)}" for name, value in wording.reproduction_lines(report)]
    command = " ".join(wording.reproducing_command(report))
    again = ["\nTo reproduce this report:\n", markdown_block(command, limit=len(command) + 1) + "\n"] if command else []
    return ["---\n", *rows, *again]
