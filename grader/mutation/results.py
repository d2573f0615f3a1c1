"""What came of testing a rubric: of each mutant, of each correct variant, of the reference and the template."""

from __future__ import annotations

import difflib
from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import Enum
from fractions import Fraction

from grader.core.exercise import Outcome
from grader.core.report import ExerciseReport

#: Outcomes by which a criterion shows that something is wrong, and not only that something else was.
_TURNED = (Outcome.NOT_MET, Outcome.PARTLY)


class Fate(str, Enum):
    """What became of a mutant."""

    KILLED = "killed"
    SURVIVED = "survived"
    UNDECIDED = "undecided"  # the grader or the machine failed: it says nothing about the rubric


@dataclass(frozen=True, slots=True)
class ResultRank:
    """What a program is worth under a rubric.

    Attributes:
        score: Points earned.
        max_score: Points to be had.
        outcomes: Criterion id -> outcome, in rubric order.
        reasons: Criterion id -> reason, of those that are not met in full.
    """

    score: Fraction
    max_score: Fraction
    outcomes: Mapping[str, Outcome]
    reasons: Mapping[str, str]

    @property
    def full(self) -> bool:
        """Whether every criterion is met."""
        return all(outcome is Outcome.MET for outcome in self.outcomes.values())

    @property
    def decided(self) -> bool:
        """Whether nothing is undecided."""
        return Outcome.UNDECIDED not in self.outcomes.values()

    @property
    def turned(self) -> tuple[str, ...]:
        """The criteria that are not met, or partly, by themselves."""
        return tuple(id_ for id_, outcome in self.outcomes.items() if outcome in _TURNED)

    @property
    def fate(self) -> Fate:
        """What becomes of a mutant that is worth this."""
        if any(outcome in (*_TURNED, Outcome.BLOCKED) for outcome in self.outcomes.values()):
            return Fate.KILLED
        return Fate.SURVIVED if self.decided else Fate.UNDECIDED


def standing_of(report: ExerciseReport) -> ResultRank:
    """Return what a report says a program is worth."""
    return ResultRank(
        score=report.score,
        max_score=report.max_score,
        outcomes={verdict.id: verdict.outcome for verdict in report.verdicts},
        reasons={v.id: v.reason for v in report.verdicts if v.outcome is not Outcome.MET},
    )


@dataclass(frozen=True, slots=True)
class Trial:
    """One mutant, or one correct variant, that was run.

    Attributes:
        id: Stable and readable: `FILE:LINE:operator:detail`, of a variant `FILE:variant`.
        file: Name of the file that was changed.
        operator: What changed it.
        change: The change in one line.
        standing: What it is worth.
        expected: Criteria of which one should notice it, as the author says; empty if nothing is said.
        because: Why it may do what it does, as the author says: survive, or as a variant lose points.
    """

    id: str
    file: str
    operator: str
    change: str
    standing: ResultRank
    expected: tuple[str, ...] = ()
    because: str = ""

    @property
    def fate(self) -> Fate:
        """What became of it."""
        return self.standing.fate

    @property
    def as_expected(self) -> bool:
        """Whether a criterion noticed it that should, if anything is said about that."""
        return self.fate is Fate.KILLED and (not self.expected or bool(set(self.expected) & set(self.standing.turned)))


@dataclass(frozen=True, slots=True)
class SelftestResult:
    """What came of testing one rubric.

    Attributes:
        rubric: Path of its file, as named.
        exercise: Exercise id.
        criteria: Criterion ids, in rubric order.
        reference: What the reference solution is worth.
        template: What the template is worth; None if there is none.
        baseline: What the template should be worth; None if nobody said.
        mutants: In order of files, operators and lines.
        variants: Correct programs, in order.
        whole: Whether every mutant ran, and not only some.
        idle: Patterns of the author's that explain nothing, with their places.
        unturned: Criterion id -> why no mutant turns it, as the author says.
        recordings: How many scenarios were recorded.
        duration_s: Real time.
    """

    rubric: str
    exercise: str
    criteria: tuple[str, ...]
    reference: ResultRank
    template: ResultRank | None
    baseline: Fraction | None
    mutants: tuple[Trial, ...]
    variants: tuple[Trial, ...]
    whole: bool = True
    idle: tuple[str, ...] = field(default_factory=tuple)
    unturned: Mapping[str, str] = field(default_factory=dict)
    recordings: int = 0
    duration_s: float = 0.0

    @property
    def survivors(self) -> tuple[Trial, ...]:
        """Mutants that nobody noticed, and that nobody explained."""
        return tuple(trial for trial in self.mutants if trial.fate is Fate.SURVIVED and not trial.because)

    @property
    def marked_down(self) -> tuple[Trial, ...]:
        """Correct variants that lose points, and nobody explained why."""
        return tuple(v for v in self.variants if v.fate is Fate.KILLED and not v.because)

    @property
    def undecided(self) -> tuple[Trial, ...]:
        """Mutants and variants that say nothing, for the grader or the machine failed."""
        return tuple(trial for trial in (*self.mutants, *self.variants) if trial.fate is Fate.UNDECIDED)

    @property
    def never_turned(self) -> tuple[str, ...]:
        """Criteria that noticed no mutant at all, and nobody explained why; nothing is said if only some ran."""
        turned = {id_ for trial in self.mutants for id_ in trial.standing.turned}
        return (
            tuple(id_ for id_ in self.criteria if id_ not in turned and id_ not in self.unturned) if self.whole else ()
        )

    @property
    def template_fits(self) -> bool:
        """Whether the template is worth what it should be, as far as anybody said."""
        return self.template is None or self.baseline is None or self.template.score == self.baseline

    @property
    def passed(self) -> bool:
        """Whether the rubric has no hole that is known."""
        faults = (self.survivors, self.marked_down, self.never_turned)
        return self.reference.full and self.template_fits and not any(faults)


def one_line_change(before: str, after: str) -> str:
    """Return what differs between two sources as `old lines => new lines`, without indentation."""
    old, new = before.splitlines(), after.splitlines()
    removed, added = [], []
    for kind, a, b, c, d in difflib.SequenceMatcher(None, old, new, autojunk=False).get_opcodes():
        if kind != "equal":
            removed += [line.strip() for line in old[a:b] if line.strip()]
            added += [line.strip() for line in new[c:d] if line.strip()]
    if sorted(removed) == sorted(added):
        return f"moved: {' ¶ '.join(removed)}"
    return f"{' ¶ '.join(removed) or '(nothing)'} => {' ¶ '.join(added) or '(nothing)'}"
