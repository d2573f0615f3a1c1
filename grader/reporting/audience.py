"""Removes from a report what its rubric withholds from students, before rendering."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from grader.core.chart import Chart, Excerpt, Figure
from grader.core.dataclass import dataclass
from grader.core.exercise import DUE_DATE, OPEN, PUBLISHED, Audience, Location, Outcome, Shows, strictest, variant_notes
from grader.core.report import NOT_JUDGED, ExerciseReport, Report, ReportedFault, Reproduction, Verdict
from grader.reporting.wording import points

#: Unit after a number -> word that replaces both.
_UNITS = {
    "Hz": "a rate",
    "s": "a time",
    "ms": "a time",
    "m/s": "a speed",
    "rad/s": "an angular speed",
    "m": "a distance",
    "rad": "an angle",
    "°C": "a temperature",
    "%": "a share",
}
_NUMBER = "a number"
# Bit counts are part of a type's name; a student's program might have chosen any other digits.
_KEPT = re.compile(r"\b[a-z_]+/(?:msg|srv|action)/[A-Za-z]+(?:8|16|32|64)?(?:MultiArray)?(?!\w)")
_LINE = re.compile(r"(\.py):[0-9]+")
# Separators of words.
_WORD = re.compile(r"[^\s(),;:=\[\]{}<>|\"'`/±*\u00d7\u2018-\u201f]+")
_SIGNS = "+-\N{MINUS SIGN}"
_WORDS_FOR_VALUES = ("nan", "inf", "infinity")
_ONE = rf"(?:{_NUMBER}|{'|'.join(sorted(set(_UNITS.values()), key=len, reverse=True))})"
_ROW = re.compile(rf"{_ONE}(?:(?: ?[±/*,\u00d7] ?|:| to | and | or ){_ONE})+")
_WITH_UNIT = re.compile(rf"{_NUMBER} ?({'|'.join(sorted(map(re.escape, _UNITS), key=len, reverse=True))})(?![\w/])")


def without_numbers(text: str) -> str:
    """Return a sentence in which words replace the numbers.

    Names of message types stay whole, and places in Python files lose their line. Any other word with digits is cut
    before the first digit.
    """
    text = _LINE.sub(r"\1", text)
    parts, end = [], 0
    for kept in _KEPT.finditer(text):
        parts += [_worded(text[end : kept.start()]), kept.group()]
        end = kept.end()
    return "".join([*parts, _worded(text[end:])])


def _worded(text: str) -> str:
    plain = _WORD.sub(lambda match: _word(match.group()), text)
    return _ROW.sub(_row, _WITH_UNIT.sub(lambda match: _UNITS[match[1]], plain))


def _row(match: re.Match[str]) -> str:
    """Return the replacement for several numbers in a row: that of the last one, if it has a unit."""
    last = next((word for word in _UNITS.values() if match.group().endswith(f" {word}")), "")
    return last or "numbers"


def _word(word: str) -> str:
    """Return a word unchanged if it has no digit of any script."""
    if word.strip(f"{_SIGNS}.").casefold() in _WORDS_FOR_VALUES:
        return _NUMBER
    first = next((n for n, sign in enumerate(word) if sign.isnumeric()), -1)
    if first < 0:
        return word
    before = word[:first].strip(f"{_SIGNS}±~≈.#")
    after = "." if word.endswith(".") else ""
    return f"{before}…{after}" if before else f"{_NUMBER}{after}"


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
_LEFT_OUT = "pictures, the graph and whatever else would show more than the criteria do are left out"


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
    said = verdict.reason if verdict.outcome is Outcome.BLOCKED else without_numbers(verdict.reason)
    brief = without_numbers(verdict.brief)
    return replace(verdict, reason=said, hint=_hint(verdict.hint), evidence={}, problem=None, brief=brief)


def _without_hidden(verdict: Verdict, shown: Mapping[str, Shows]) -> Verdict:
    """Return a verdict that names no hidden criterion; a missing file may be named."""
    if shown.get(verdict.blocked_by) is Shows.NOTHING:
        reason = verdict.reason if verdict.missing_file else f"{NOT_JUDGED}needs {_HIDDEN}"
        verdict = replace(verdict, reason=reason, blocked_by="")
    if shown.get(verdict.same_cause_as) is Shows.NOTHING:
        verdict = replace(verdict, hint=f"this has the same cause as {_HIDDEN}", same_cause_as="")
    return verdict


def _hint(hint: str) -> str:
    """Return the parts of a hint without numbers: most others would give the answer away."""
    return "; ".join(part for part in hint.split("; ") if without_numbers(part) == part)


def _clock_reason(exercise: ExerciseReport, worst: Shows) -> str:
    """Return why the wall clock was used, as visible as the exercise's most restricted criterion."""
    if worst is Shows.WITHOUT_NUMBERS or not exercise.clock_reason:
        return without_numbers(exercise.clock_reason)
    return _NO_REASON


def _notes(exercise: ExerciseReport, worst: Shows) -> list[str]:
    """Return the notes of the run; the variant is not secret, because the student's task sheet has it."""
    notes = [note for note in exercise.notes if note not in variant_notes(exercise.variant)]
    return [without_numbers(note) for note in notes] if worst is Shows.WITHOUT_NUMBERS else []


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
            kept.append(replace(fault, text=without_numbers(fault.text), t_ns=0))
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
