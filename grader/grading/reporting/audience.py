"""Removes from a report what its rubric withholds from students, before rendering."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from typing import Any

from grader.grading.model.chart import Chart, Excerpt, Figure
from grader.grading.model.exercise import (
    DUE_DATE,
    OPEN,
    PUBLISHED,
    Audience,
    Location,
    Outcome,
    ProblemKind,
    Shows,
    strictest,
    variant_notes,
)
from grader.grading.model.report import NOT_JUDGED, ExerciseReport, Report, ReportedFault, Reproduction, Verdict
from grader.grading.reporting.wording import points
from grader.runtime.model.dataclass import dataclass

# Bit counts are part of a type's name; a student's program might have chosen any other digits.
_KEPT = re.compile(r"\b[a-z_]+/(?:msg|srv|action)/[A-Za-z]+(?:8|16|32|64)?(?:MultiArray)?(?!\w)")
_LINE = re.compile(r"(\.py):[0-9]+")
_WORD = re.compile(r"[^\W_]+")
_WORDS_FOR_VALUES = ("nan", "inf", "infinity")
#: What a problem is called where its numbers are withheld, as a whole sentence.
_SAID: Mapping[ProblemKind, str] = {
    ProblemKind.ABSENT: "what the task asks for is not in the ROS graph",
    ProblemKind.OTHER_NAME: "there is one, but under another name",
    ProblemKind.OTHER_TYPE: "the type is wrong",
    ProblemKind.SILENT: "it exists, but sends nothing",
    ProblemKind.TOO_FEW: "there are too few",
    ProblemKind.TOO_MANY: "there are too many",
    ProblemKind.TOO_EARLY: "it is sent before any subscription can discover the publisher",
    ProblemKind.TOO_LATE: "it arrives too late",
    ProblemKind.WRONG_RATE: "the rate is wrong",
    ProblemKind.RATE_CHANGES: "the rate is right on average, but it changes",
    ProblemKind.BURSTS: "the messages come in bursts",
    ProblemKind.STOPPED: "it stopped before the end",
    ProblemKind.NO_MESSAGE: "no message arrived",
    ProblemKind.NO_FIELD: "the message type has no such field",
    ProblemKind.NO_NUMBER: "the messages hold no number",
    ProblemKind.WRONG_VALUE: "a value is wrong",
    ProblemKind.NOT_RANDOM: "the values are not random: they follow a pattern",
    ProblemKind.CONSTANT: "the values never change",
    ProblemKind.NEVER_CHANGES: "the answer never changes, because the input stays on one side of the threshold",
    ProblemKind.WRONG_ANSWER: "an answer does not fit its input",
    ProblemKind.NO_ANSWER: "something is never answered",
    ProblemKind.REFUSED: "a request is refused",
    ProblemKind.BEHIND: "each answer fits an earlier input",
    ProblemKind.CONTRADICTION: "two different answers arrive at the same time",
    ProblemKind.KEPT_APART: "types or QoS of publisher and subscription do not match",
    ProblemKind.NO_EDGE: "the two programs are not connected",
    ProblemKind.COUNT_START: "the count starts at the wrong number",
    ProblemKind.ONE_PER_MESSAGE: "every message is logged",
    ProblemKind.NO_NODE: "the program has no node",
    ProblemKind.NOT_LOGGED: "not everything that the task asks for is logged",
    ProblemKind.PRINTED: "the output is printed, not logged",
    ProblemKind.AMONG_OTHERS: "the right values are logged among so many others that they prove nothing",
    ProblemKind.ERRORS_LOGGED: "errors are logged",
    ProblemKind.ENDED: "a program ends too early",
    ProblemKind.STILL_RUNNING: "a program does not end when it is stopped",
}
_NOT_AS_ASKED = "this is not what the task asks for"
_HAPPENED = {
    "syntax_error": "cannot be compiled",
    "exception": "raised an exception",
    "exited": "ended by itself",
    "hung": "did not return",
    "killed": "was killed",
}
#: Keys of evidence that say where something was found.
_PLACES = ("topic", "service", "node", "process")


def numberless(text: str) -> str:
    """Return a text without the lines of Python files, if no other number is in it; empty if there is one.

    Digits in the names of message types are not numbers; digits of every script, and words for values, are.
    """
    text = _LINE.sub(r"\1", text)
    rest = _KEPT.sub("", text)
    values = any(word.casefold() in _WORDS_FOR_VALUES for word in _WORD.findall(rest))
    return "" if values or any(sign.isnumeric() for sign in rest) else text


def _said(verdict: Verdict) -> str:
    """Return a verdict's reason if it has no numbers, else a sentence that says what kind of problem it is."""
    if plain := numberless(verdict.reason):
        return plain
    fault = verdict.evidence.get("fault")
    if isinstance(fault, Mapping):
        return _fault_said(fault)
    said = _NOT_AS_ASKED if verdict.problem is None else _SAID[verdict.problem.kind]
    if verdict.problem is not None and verdict.problem.kind is ProblemKind.WRONG_VALUE:
        said = _wrong_fields(verdict.evidence) or said
    places = (str(verdict.evidence.get(key) or "") for key in _PLACES)
    where = next((plain for place in places if (plain := numberless(place))), "")
    return f"{where}: {said}" if where else said


def _wrong_fields(evidence: Mapping[str, Any]) -> str:
    """Return which fields are wrong; empty if the evidence does not tell."""
    found = evidence.get("found")
    names = list(found) if isinstance(found, Mapping) else [str(evidence.get("field") or "")]
    fields = [plain for name in names if (plain := numberless(name))]
    return f"{' and '.join(fields)} {'is' if len(fields) == 1 else 'are'} not what the task asks for" if fields else ""


def _fault_said(fault: Mapping[str, Any]) -> str:
    where = numberless(str(fault.get("file") or fault.get("process") or "")) or "the program"
    what = _HAPPENED.get(str(fault.get("kind")), "failed")
    text = numberless(str(fault.get("text") or ""))
    return f"{where} {what}: {text}" if text else f"{where} {what}"


@dataclass(frozen=True, slots=True)
class Readers:
    """Who reads the reports of a run, and on which day."""

    # Who reads all of them; None for students if a platform shows the format to them, else instructors
    audience: Audience | None = None
    day: str = ""  # day, as `2026-12-01`, that dates in a rubric are compared with; empty for before all dates

    def of(self, usual: Audience) -> Audience:
        """Return who reads a format, given its usual audience."""
        return self.audience or usual

    @property
    def only_students(self) -> bool:
        """Whether instructors get nothing from the run, so that the exit code must not reveal more either."""
        return self.audience is Audience.STUDENT


#: No audience is given, so each format has its usual one.
ANYBODY = Readers()


_WHEN = {DUE_DATE: " before the due date", PUBLISHED: " before grades are published"}
_HIDDEN = "a criterion that is not shown"
_NO_REASON = "the reason is not shown"
_NO_MESSAGE = "the message is not shown, because it holds numbers"
_LEFT_OUT = "charts, the graph and other details are left out, because they would show what is withheld"


def told(report: Report, readers: Readers) -> Report:
    """Return the report that a run may reveal in other ways, such as a score line or an exit code."""
    return for_student(report, readers.day) if readers.only_students else report


def withholds(report: Report, day: str) -> bool:
    """Return whether the rubric withholds anything in a report from a student on a day."""
    return any(_strictest(exercise, day) is not Shows.ALL for exercise in report.exercises)


def for_student(report: Report, day: str) -> Report:
    """Return a report without what its rubrics withhold from a student on a day.

    A hidden criterion is left out of every sum: a score that included it would reveal its result. If anything is
    withheld, so is the information that would reproduce the whole report.
    """
    if not withholds(report, day):
        return report
    exercises = [_exercise(exercise, day) for exercise in report.exercises]
    kept = tuple(exercise for exercise in exercises if exercise.verdicts)
    ids = {exercise.id for exercise in kept}
    unshown = [
        f"exercise {exercise.number} is not shown: {note}"
        for index, exercise in enumerate(exercises)
        if not exercise.verdicts
        for note in _unshown(report.exercises[index], day)
    ]
    return replace(
        report,
        exercises=kept,
        seed=None,
        notes=(*report.notes, *unshown),
        reproduce=Reproduction(),
        pending=tuple(id_ for id_ in report.pending if id_ in ids),
    )


def shows(exercise: ExerciseReport, criterion: str, day: str) -> Shows:
    """Return how much of a criterion's result a student sees on a day."""
    return exercise.feedback.get(criterion, OPEN).on(day)


def _strictest(exercise: ExerciseReport, day: str) -> Shows:
    return strictest(tuple(shows(exercise, verdict.id, day) for verdict in exercise.verdicts))


def _exercise(exercise: ExerciseReport, day: str) -> ExerciseReport:
    shown = {verdict.id: shows(exercise, verdict.id, day) for verdict in exercise.verdicts}
    worst = strictest(tuple(shown.values()))
    if worst is Shows.ALL:
        return exercise
    verdicts = tuple(_verdict(v, shown) for v in exercise.verdicts if shown[v.id] is not Shows.NOTHING)
    faults = _faults(exercise, shown)
    return replace(
        exercise,
        clock_reason=_clock_reason(exercise, worst),
        verdicts=verdicts,
        faults=faults,
        notes=(*variant_notes(exercise.variant), *_unshown(exercise, day), *_notes(exercise, worst), _LEFT_OUT),
        graph=None,
        figures=tuple(figure for figure in exercise.figures if _is_open(figure, exercise, shown)),
        excerpts=_excerpts(exercise, verdicts, faults, shown),
        sources=(),
        expected={id_: text for id_, text in exercise.expected.items() if shown.get(id_) is Shows.ALL},
    )


def _verdict(verdict: Verdict, shown: Mapping[str, Shows]) -> Verdict:
    """Return the visible part of a verdict; a hidden criterion has no name either."""
    if shown[verdict.id] is Shows.OUTCOME:
        return replace(
            verdict,
            reason=_NO_REASON,
            hint="",
            location=None,
            evidence={},
            blocked_by="",
            same_cause_as="",
            problem=None,
            brief="",
        )
    verdict = _without_hidden(verdict, shown)
    if shown[verdict.id] is Shows.ALL:
        return verdict
    # The text of a verdict that was not judged has no numbers of its own, and the ids in it must not change.
    said = verdict.reason if verdict.outcome is Outcome.BLOCKED else _said(verdict)
    brief = numberless(verdict.brief)
    return replace(verdict, reason=said, hint=_hint(verdict.hint), evidence={}, problem=None, brief=brief)


def _without_hidden(verdict: Verdict, shown: Mapping[str, Shows]) -> Verdict:
    """Return a verdict without the names of hidden criteria; a missing file may be named."""
    if shown.get(verdict.blocked_by) is Shows.NOTHING:
        reason = verdict.reason if verdict.missing_file else f"{NOT_JUDGED}needs {_HIDDEN}"
        verdict = replace(verdict, reason=reason, blocked_by="")
    if shown.get(verdict.same_cause_as) is Shows.NOTHING:
        verdict = replace(verdict, hint=f"this has the same cause as {_HIDDEN}", same_cause_as="")
    return verdict


def _hint(hint: str) -> str:
    """Return the parts of a hint without numbers: most others would give the answer away."""
    return "; ".join(part for part in hint.split("; ") if numberless(part) == part)


def _clock_reason(exercise: ExerciseReport, worst: Shows) -> str:
    """Return why the wall clock was used, as visible as the exercise's most restricted criterion."""
    if worst is Shows.WITHOUT_NUMBERS or not exercise.clock_reason:
        return numberless(exercise.clock_reason) or (_NO_REASON if exercise.clock_reason else "")
    return _NO_REASON


def _notes(exercise: ExerciseReport, worst: Shows) -> list[str]:
    """Return the notes of the run; the variant is not secret, because the student's task sheet has it."""
    notes = [note for note in exercise.notes if note not in variant_notes(exercise.variant)]
    return [plain for note in notes if (plain := numberless(note))] if worst is Shows.WITHOUT_NUMBERS else []


def _unshown(exercise: ExerciseReport, day: str) -> list[str]:
    """Return how many criteria are hidden completely, by the time until which they are."""
    found: dict[str, list[Fraction]] = {}
    for verdict in exercise.verdicts:
        if shows(exercise, verdict.id, day) is Shows.NOTHING:
            found.setdefault(exercise.feedback[verdict.id].until, []).append(verdict.max_score)
    return [
        f"{len(each)} {'criterion' if len(each) == 1 else 'criteria'} with {points(sum(each, Fraction(0)))} points "
        f"{'is' if len(each) == 1 else 'are'} not shown{_when(until)}"
        for until, each in found.items()
    ]


def _when(until: str) -> str:
    return _WHEN.get(until, f" until {until} has passed" if until else "")


def _faults(exercise: ExerciseReport, shown: Mapping[str, Shows]) -> tuple[ReportedFault, ...]:
    """Return the faults that may be shown: a fault's text can repeat whatever the program received in its scenario."""
    kept = []
    for fault in exercise.faults:
        worst = _of_scenario(fault.scenario, exercise, shown)
        if worst is Shows.ALL:
            kept.append(fault)
        elif worst is Shows.WITHOUT_NUMBERS:
            kept.append(replace(fault, text=numberless(fault.text) or _NO_MESSAGE, t_ns=0))
    return tuple(kept)


def _of_scenario(scenario: str, exercise: ExerciseReport, shown: Mapping[str, Shows]) -> Shows:
    """Return the strictest visibility of the criteria judged on a scenario; of all criteria, if there are none."""
    asked = tuple(shown[id_] for id_, where in exercise.situations.items() if where == scenario and id_ in shown)
    return strictest(asked or tuple(shown.values()))


def _is_open(figure: Figure, exercise: ExerciseReport, shown: Mapping[str, Shows]) -> bool:
    """Return whether a figure shows only fully visible scenarios; a graph may show any of them."""
    if not isinstance(figure, Chart) or not figure.criteria:
        return False
    scenarios = [exercise.situations.get(id_, "") for id_ in figure.criteria]
    return all(_of_scenario(scenario, exercise, shown) is Shows.ALL for scenario in scenarios)


def _excerpts(
    exercise: ExerciseReport,
    verdicts: Sequence[Verdict],
    faults: Sequence[ReportedFault],
    shown: Mapping[str, Shows],
) -> tuple[Excerpt, ...]:
    """Return the source lines that fully visible verdicts and faults point to."""
    places = {v.location for v in verdicts if shown[v.id] is Shows.ALL}
    places |= {Location(f.file, f.line) for f in faults if _of_scenario(f.scenario, exercise, shown) is Shows.ALL}
    return tuple(e for e in exercise.excerpts if Location(e.file, e.line) in places)
