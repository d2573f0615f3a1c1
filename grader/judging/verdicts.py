"""Turns answers into verdicts: what blocks what, how many points are earned, and what the student is told."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

from grader.core.exercise import Criterion, Exercise, Finding, Outcome
from grader.core.report import NOT_JUDGED, Verdict
from grader.core.submission import Submission
from grader.judging.asking import Answer, check_name
from grader.judging.findings import FAULT_KEY
from grader.judging.wording import listed, quote

_EARNED = (Outcome.MET, Outcome.PARTLY)
_SAID = {
    Outcome.NOT_MET: "not met",
    Outcome.BLOCKED: "not judged",
    Outcome.UNDECIDED: "undecided",
}


@dataclass(slots=True)
class Bench:
    """Goes through one exercise's answers in rubric order and remembers which causes were named already."""

    exercise: Exercise
    answers: Mapping[str, Answer]
    submission: Submission
    done: dict[str, Verdict] = field(default_factory=dict)
    missing_owner: dict[str, str] = field(default_factory=dict)
    fault_owner: dict[tuple[Any, ...], str] = field(default_factory=dict)

    def verdicts(self) -> tuple[Verdict, ...]:
        """Return one verdict for each criterion, in rubric order."""
        for criterion in self.exercise.criteria:
            self.done[criterion.id] = self._verdict(criterion)
        return tuple(self.done[c.id] for c in self.exercise.criteria)

    def _verdict(self, criterion: Criterion) -> Verdict:
        answer = self.answers[criterion.id]
        if answer.missing:
            return self._missing(criterion, answer.missing)
        needed = next((n for n in criterion.needs if self._outcome(n) not in _EARNED), None)
        known = answer.finding is not None
        # A question that could not be answered waits for what it needs, if that is known to be the student's to mend.
        if needed is not None and (known or self._outcome(needed) is not Outcome.UNDECIDED):
            return self._blocked(criterion, needed, self._outcome(needed))
        if answer.finding is None:
            evidence = {"error": answer.error} if answer.error else {}
            problem, hint = answer.problem, answer.hint
            return _without_points(criterion, Outcome.UNDECIDED, problem, hint=hint, evidence=evidence)
        return self._found(criterion, answer.finding)

    def _found(self, criterion: Criterion, finding: Finding) -> Verdict:
        if finding.credit > 0:
            return _earned(criterion, finding)
        blocker = self._blocker(criterion, finding)
        if blocker is not None:
            return self._blocked(criterion, blocker, self._outcome(blocker))
        cause = _fault_of(finding)
        owner = self.fault_owner.get(cause, "") if cause else ""
        if owner:
            return self._blocked(criterion, owner, Outcome.NOT_MET)
        if cause:
            self.fault_owner[cause] = criterion.id
        return _earned(criterion, finding)

    def _outcome(self, id_: str) -> Outcome:
        """Return what a criterion came to, or by its own finding will come to if it is still ahead."""
        if id_ in self.done:
            return self.done[id_].outcome
        answer = self.answers.get(id_)
        if answer is None:
            return Outcome.MET
        if answer.finding is None:
            return Outcome.NOT_MET if answer.missing else Outcome.UNDECIDED
        return _outcome_of(answer.finding)

    def _blocker(self, criterion: Criterion, finding: Finding) -> str | None:
        """Return the criterion that a finding waits for, unless that one is met, is unknown, or waits for this one."""
        if finding.blocked_by is None:
            return None
        target = self._named(criterion, finding.blocked_by)
        if target is None or target.id == criterion.id or self._outcome(target.id) in _EARNED:
            return None
        theirs = self.answers[target.id].finding
        back = self._named(target, theirs.blocked_by) if theirs is not None and theirs.blocked_by else None
        ahead = target.id not in self.done
        return None if ahead and back is not None and back.id == criterion.id else target.id

    def _named(self, criterion: Criterion, name: str) -> Criterion | None:
        """Return the criterion of that id, else the first whose check has that name, nearest scenarios first.

        These are the criterion's own, and then those in which the same processes run.
        """
        criteria = self.exercise.criteria
        by_id = next((c for c in criteria if c.id == name), None)
        named = [c for c in criteria if check_name(c) == name]
        same = [c for c in named if c.scenario == criterion.scenario]
        alike = [c for c in named if self._processes(c) == self._processes(criterion)]
        return by_id or next(iter([*same, *alike]), None)

    def _processes(self, criterion: Criterion) -> tuple[str, ...]:
        return next((s.processes for s in self.exercise.scenarios if s.id == criterion.scenario), ())

    def _blocked(self, criterion: Criterion, needed: str, outcome: Outcome) -> Verdict:
        reason = f"{NOT_JUDGED}needs {needed} ({_SAID.get(outcome, 'not met')})"
        kind = Outcome.UNDECIDED if outcome is Outcome.UNDECIDED else Outcome.BLOCKED
        return replace(_without_points(criterion, kind, reason), blocked_by=needed)

    def _missing(self, criterion: Criterion, files: tuple[str, ...]) -> Verdict:
        unnamed = next((f for f in files if f not in self.missing_owner), None)
        if unnamed is None:
            file = files[0]
            verdict = _without_points(criterion, Outcome.BLOCKED, f"{NOT_JUDGED}needs {file}, which is missing")
            return replace(verdict, blocked_by=self.missing_owner[file], missing_file=file)
        self.missing_owner[unnamed] = criterion.id
        similar = self.submission.files[unnamed].similar
        reason = f"{unnamed}: not in the submission"
        reason += f"; found {listed(similar)} instead" if similar else ""
        hint = f"rename {quote(similar[0], 80)} to {unnamed}" if similar else f"hand in a file named {unnamed}"
        evidence = {"missing": unnamed, "similar": list(similar)}
        return _without_points(criterion, Outcome.NOT_MET, reason, hint=hint, evidence=evidence)


def _outcome_of(finding: Finding) -> Outcome:
    if finding.credit == 1:
        return Outcome.MET
    return Outcome.PARTLY if finding.credit > 0 else Outcome.NOT_MET


def _earned(criterion: Criterion, finding: Finding) -> Verdict:
    outcome = _outcome_of(finding)
    # a fault is its own cause: what the rubric supposes is then beside the point
    supposed = "" if FAULT_KEY in finding.evidence else criterion.hint
    hint = "" if outcome is Outcome.MET else finding.hint or supposed
    return Verdict(
        id=criterion.id,
        title=criterion.title,
        outcome=outcome,
        score=finding.credit * criterion.points,
        max_score=criterion.points,
        reason=finding.reason,
        hint=hint,
        location=finding.location,
        evidence=finding.evidence,
        problem=finding.problem,
    )


def _without_points(
    criterion: Criterion, outcome: Outcome, reason: str, *, hint: str = "", evidence: Mapping[str, Any] | None = None
) -> Verdict:
    points = criterion.points
    known = evidence or {}
    return Verdict(criterion.id, criterion.title, outcome, Fraction(0), points, reason, hint=hint, evidence=known)


def _fault_of(finding: Finding) -> tuple[Any, ...] | None:
    """Return what makes a fault the same one in another scenario, or None if the finding rests on none."""
    fault = finding.evidence.get(FAULT_KEY)
    if not isinstance(fault, Mapping):
        return None
    return tuple(fault[key] for key in ("process", "kind", "text", "file", "line"))
