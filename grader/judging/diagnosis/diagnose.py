"""Goes through the verdicts that lost points and adds what very likely caused them; outcomes and points stay."""

from __future__ import annotations

import logging
from collections.abc import Mapping
from dataclasses import dataclass, field, replace

from grader.core.exercise import Check, Criterion, Exercise, Outcome, ProblemKind
from grader.core.report import Verdict
from grader.core.submission import Submission
from grader.core.trace import Fault, Trace
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.rate import TopicRate
from grader.judging.checks.sensor import RandomInRange
from grader.judging.checks.together import AnswersTogether
from grader.judging.diagnosis.callbacks import CALLBACKS
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.comparisons import COMPARISONS
from grader.judging.diagnosis.construction import CONSTRUCTION
from grader.judging.diagnosis.crashes import CRASHES
from grader.judging.diagnosis.endings import ENDINGS
from grader.judging.diagnosis.fan import FAN
from grader.judging.diagnosis.fields import FIELDS
from grader.judging.diagnosis.files import FILES
from grader.judging.diagnosis.formulas import FORMULAS
from grader.judging.diagnosis.imports import IMPORTS
from grader.judging.diagnosis.lateness import LATENESS
from grader.judging.diagnosis.logs import LOGS
from grader.judging.diagnosis.positions import POSITIONS
from grader.judging.diagnosis.rates import RATES
from grader.judging.diagnosis.sensor import SENSOR
from grader.judging.diagnosis.services import SERVICES
from grader.judging.diagnosis.silence import SILENCE
from grader.judging.diagnosis.syntax import SYNTAX
from grader.judging.diagnosis.waiting import WAITING
from grader.judging.findings import FAULT_KEY
from grader.judging.source import Source, read

#: Every cause there is; the first that applies is named.
CAUSES: tuple[Cause, ...] = (
    *SYNTAX,
    *IMPORTS,
    *CALLBACKS,
    *CONSTRUCTION,
    *CRASHES,
    *ENDINGS,
    *SILENCE,
    *WAITING,
    *RATES,
    *FIELDS,
    *FORMULAS,
    *FILES,
    *LOGS,
    *POSITIONS,
    *SENSOR,
    *LATENESS,
    *COMPARISONS,
    *FAN,
    *SERVICES,
)
_LOST = (Outcome.NOT_MET, Outcome.PARTLY)
_LOG = logging.getLogger(__name__)
#: Evidence key that holds the id of the cause.
CAUSE_KEY = "diagnosis"


def diagnose(
    verdicts: tuple[Verdict, ...],
    exercise: Exercise,
    traces: Mapping[str, Trace],
    submission: Submission,
    sources: Mapping[str, str],
) -> tuple[Verdict, ...]:
    """Return the verdicts with a place and one hint wherever a cause is very likely.

    Args:
        verdicts: In rubric order; outcomes, points and reasons are returned as they are.
        exercise: What was asked.
        traces: Scenario id -> what was recorded.
        submission: Says under which path each wanted file was found.
        sources: Wanted file name -> its text.
    """
    asked = {c.scenario for v, c in zip(verdicts, exercise.criteria, strict=True) if v.outcome in _LOST}
    if not asked:
        return verdicts
    # only these, because parsing a file takes longer than judging it
    names = dict.fromkeys(p for s in exercise.scenarios if s.id in asked for p in s.processes if p in sources)
    read_ = {name: read(submission.files[name].found or name, sources[name]) for name in names}
    said = _Said(exercise)
    return tuple(said.on(v, c, traces, read_) for v, c in zip(verdicts, exercise.criteria, strict=True))


def clue_for(case: Case) -> tuple[str, Clue] | None:
    """Return the first cause that applies to a case, its id and its clue; None if nothing is very likely.

    A cause that raises is logged and passed over: a mistake of ours must not keep a student from a report.
    """
    for cause in CAUSES:
        try:
            clue = cause.applies(case)
        except Exception:
            _LOG.exception("the cause %s failed on the criterion %s", cause.id, case.criterion.id)
            continue
        if clue is not None:
            return cause.id, clue
    return None


@dataclass(slots=True)
class _Said:
    """Remembers which cause was named with which criterion, so that none is named twice."""

    exercise: Exercise
    owner: dict[str, str] = field(default_factory=dict)
    lost: dict[str, Check] = field(default_factory=dict)

    def on(
        self, verdict: Verdict, criterion: Criterion, traces: Mapping[str, Trace], sources: Mapping[str, Source]
    ) -> Verdict:
        """Return the verdict with what is known about its cause."""
        trace = traces.get(criterion.scenario)
        if verdict.outcome not in _LOST or trace is None or trace.harness_problem:
            return verdict
        found = clue_for(self._case(verdict, criterion, trace, sources))
        earlier = "" if found is not None else self._follows(criterion.check, verdict)
        if verdict.outcome is Outcome.NOT_MET:
            self.lost[criterion.id] = criterion.check
        if found is None:
            return _same_as(earlier, verdict) if earlier else verdict
        id_, clue = found
        key = clue.key or f"{id_}:{clue.location}"
        earlier = self.owner.setdefault(key, criterion.id)
        evidence = {**verdict.evidence, CAUSE_KEY: id_}
        placed = replace(verdict, hint=clue.hint, location=clue.location or verdict.location, evidence=evidence)
        return placed if earlier == criterion.id else _same_as(earlier, placed)

    def _case(self, verdict: Verdict, criterion: Criterion, trace: Trace, sources: Mapping[str, Source]) -> Case:
        scenario = next(s for s in self.exercise.scenarios if s.id == criterion.scenario)
        own = {name: sources[name] for name in scenario.processes if name in sources}
        siblings = tuple(c.check for c in self.exercise.criteria if c is not criterion)
        return Case(criterion, verdict, trace, own, _fault_of(verdict, trace), siblings)

    def _follows(self, check: Check, verdict: Verdict) -> str:
        """Return the criterion whose loss explains that two nodes do not work together; empty if none surely does."""
        problem = verdict.problem
        if not isinstance(check, AnswersTogether) or problem is None:
            return ""
        quiet = problem.kind in (ProblemKind.STOPPED, ProblemKind.NO_MESSAGE)
        fixed = problem.kind is ProblemKind.NEVER_CHANGES
        stopped = problem.kind is ProblemKind.STOPPED and check.input in problem.topics
        answered = problem.kind is ProblemKind.WRONG_ANSWER or (quiet and check.output in problem.topics)
        for id_, other in self.lost.items():
            controller = isinstance(other, ThresholdResponse) and other.output == check.output
            sensor = isinstance(other, RandomInRange) and other.topic == check.input
            pace = isinstance(other, TopicRate) and other.topic == check.input
            if (controller and answered) or (sensor and fixed) or (pace and stopped):
                return id_
        return ""


def _same_as(criterion: str, verdict: Verdict) -> Verdict:
    hint = f"this has the same cause as {criterion}: mend that first"
    return replace(verdict, hint=hint, same_cause_as=criterion)


def _fault_of(verdict: Verdict, trace: Trace) -> Fault | None:
    """Return the fault of the trace that a verdict rests on."""
    known = verdict.evidence.get(FAULT_KEY)
    if not isinstance(known, Mapping):
        return None
    wanted = (known["process"], known["text"], known["line"])
    return next((f for f in trace.faults() if (f.process, f.text, f.line) == wanted), None)
