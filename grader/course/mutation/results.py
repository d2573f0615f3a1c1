"""The results of testing a rubric: reference, template, mutants and correct variants."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import field
from enum import Enum
from fractions import Fraction
from typing import Any

from grader.grading.model.exercise import Outcome
from grader.grading.model.measures import MEASURED_KEY
from grader.grading.model.report import ExerciseReport
from grader.runtime.model.dataclass import dataclass

#: Outcomes with which a criterion itself detects a mistake, rather than being blocked by another one.
_TURNED = (Outcome.NOT_MET, Outcome.PARTLY)


class Fate(str, Enum):
    """The fate of a mutant."""

    KILLED = "killed"
    SURVIVED = "survived"
    UNDECIDED = "undecided"  # the grader or the machine failed, which says nothing about the rubric


@dataclass(frozen=True, slots=True)
class TrialResult:
    """The result of grading a program by a rubric."""

    score: Fraction
    max_score: Fraction
    outcomes: Mapping[str, Outcome]  # criterion id -> outcome, in rubric order
    reasons: Mapping[str, str]  # criterion id -> reason, of criteria that are not fully met
    # Criterion id -> its number, limits and share, where the rubric gives a share of the points for a number
    measured: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)

    @property
    def full(self) -> bool:
        """Whether every criterion is met."""
        return all(outcome is Outcome.MET for outcome in self.outcomes.values())

    @property
    def turned(self) -> tuple[str, ...]:
        """The criteria that are not met or partly met, without blocked ones."""
        return tuple(id_ for id_, outcome in self.outcomes.items() if outcome in _TURNED)

    @property
    def fate(self) -> Fate:
        """The fate of a mutant with this result."""
        if any(outcome in (*_TURNED, Outcome.BLOCKED) for outcome in self.outcomes.values()):
            return Fate.KILLED
        return Fate.UNDECIDED if Outcome.UNDECIDED in self.outcomes.values() else Fate.SURVIVED


def result_of(report: ExerciseReport) -> TrialResult:
    """Extract the result of a program from its report."""
    return TrialResult(
        score=report.score,
        max_score=report.max_score,
        outcomes={verdict.id: verdict.outcome for verdict in report.verdicts},
        reasons={v.id: v.reason for v in report.verdicts if v.outcome is not Outcome.MET},
        measured={v.id: v.evidence[MEASURED_KEY] for v in report.verdicts if MEASURED_KEY in v.evidence},
    )


@dataclass(frozen=True, slots=True)
class Trial:
    """A mutant or correct variant that was run."""

    id: str  # stable, readable id: `FILE:LINE:operator:detail`, or `FILE:variant` for a variant
    file: str
    operator: str
    change: str  # the difference to the reference in one line
    result: TrialResult
    expected: tuple[str, ...] = ()  # criteria one of which should detect it, according to the notes; empty if not given
    because: str = ""  # the explanation in the notes of why a mutant survives or a variant loses points
    diff: str = ""  # the difference to the reference, as a unified diff without the names of the files

    @property
    def fate(self) -> Fate:
        """The fate of the mutant."""
        return self.result.fate

    @property
    def as_expected(self) -> bool:
        """Whether an expected criterion detected it; any criterion if none are expected."""
        return self.fate is Fate.KILLED and (not self.expected or bool(set(self.expected) & set(self.result.turned)))


@dataclass(frozen=True, slots=True)
class Nearest:
    """How near the best wrong program comes to the reference, by a criterion with a share of the points."""

    criterion: str  # its id
    name: str  # what is measured
    unit: str  # its unit; empty if there is none
    reference: float  # the number of the reference
    wrong: float | None  # that of the wrong program that loses least by this criterion; None if none loses by it
    share: float  # the share of the points that this one keeps
    trial: str  # its id; empty if there is none


@dataclass(frozen=True, slots=True)
class SelftestResult:
    """The result of testing one rubric."""

    rubric: str
    exercise: str
    criteria: tuple[str, ...]
    reference: TrialResult
    template: TrialResult | None
    baseline: Fraction | None
    mutants: tuple[Trial, ...]
    variants: tuple[Trial, ...]
    whole: bool = True  # whether all mutants were run
    idle: tuple[str, ...] = ()  # unused patterns of the notes, with their positions
    # Criterion id -> why it detects no mutant, according to the notes
    unturned: Mapping[str, str] = field(default_factory=dict)
    recordings: int = 0
    duration_s: float = 0.0

    @property
    def survivors(self) -> tuple[Trial, ...]:
        """Mutants that no criterion detected, and that the notes do not explain."""
        return tuple(trial for trial in self.mutants if trial.fate is Fate.SURVIVED and not trial.because)

    @property
    def marked_down(self) -> tuple[Trial, ...]:
        """Correct variants that lose points without an explanation in the notes."""
        return tuple(v for v in self.variants if v.fate is Fate.KILLED and not v.because)

    @property
    def undecided(self) -> tuple[Trial, ...]:
        """Mutants and variants without a result, because the grader or the machine failed."""
        return tuple(trial for trial in (*self.mutants, *self.variants) if trial.fate is Fate.UNDECIDED)

    @property
    def never_turned(self) -> tuple[str, ...]:
        """Criteria that detected no mutant, without an explanation; empty if only some mutants were run."""
        known = {*self.unturned, *(id_ for trial in self.mutants for id_ in trial.result.turned)}
        return tuple(id_ for id_ in self.criteria if id_ not in known) if self.whole else ()

    @property
    def nearest(self) -> tuple[Nearest, ...]:
        """How near the best wrong program comes, by each criterion that gives a share of the points for a number."""
        return tuple(self._nearest(id_, told) for id_, told in self.reference.measured.items())

    def _nearest(self, id_: str, told: Mapping[str, Any]) -> Nearest:
        wrong = [t for t in self.mutants if id_ in t.result.turned and id_ in t.result.measured]
        best = max(wrong, key=lambda trial: float(trial.result.measured[id_]["share"]), default=None)
        found = {} if best is None else best.result.measured[id_]
        share, trial = found.get("share", 0.0), "" if best is None else best.id
        return Nearest(id_, told["name"], told["unit"], told["number"], found.get("number"), share, trial)

    @property
    def template_fits(self) -> bool:
        """Whether the template has its expected score, if one is given."""
        return self.template is None or self.baseline is None or self.template.score == self.baseline

    @property
    def passed(self) -> bool:
        """Whether the test found no hole in the rubric."""
        faults = (self.survivors, self.marked_down, self.never_turned)
        return self.reference.full and self.template_fits and not any(faults)


#: Unchanged lines around a change.
_CONTEXT = 1


def unified_change(before: str, after: str) -> str:
    """Describe the difference of two sources as a unified diff, without the names of the files."""
    lines = difflib.unified_diff(before.splitlines(), after.splitlines(), n=_CONTEXT, lineterm="")
    return "\n".join(list(lines)[2:])


def one_line_change(before: str, after: str) -> str:
    """Describe the difference of two sources as `old lines => new lines`, without indentation."""
    old, new = before.splitlines(), after.splitlines()
    removed, added = [], []
    for kind, a, b, c, d in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind != "equal":
            removed += [line.strip() for line in old[a:b] if line.strip()]
            added += [line.strip() for line in new[c:d] if line.strip()]
    if sorted(removed) == sorted(added):
        return f"moved: {' ¶ '.join(removed)}"
    return f"{' ¶ '.join(removed) or '(nothing)'} => {' ¶ '.join(added) or '(nothing)'}"
