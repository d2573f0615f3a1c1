"""Adds the very likely cause to verdicts that lost points; outcomes and points stay."""

from __future__ import annotations

import ast
import logging
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from grader.grading.judging.diagnosis import (
    actions,
    attributes,
    callbacks,
    crashes,
    formulas,
    kept,
    launch_mistakes,
    loading,
    logs,
    misuse,
    rates,
    scans,
    scopes,
    services,
    silence,
    simulated,
    values,
)
from grader.grading.judging.diagnosis.rules import Case, Clue, Rule, clue_flaw, rules_in_order
from grader.grading.judging.diagnosis.wiring import bare_statements
from grader.grading.judging.findings import FAULT_KEY, fault_evidence, fault_hint, fault_sentence
from grader.grading.judging.source import Source, argument, chain, first_line, last_name, literal_text, read_source
from grader.grading.model.exercise import Criterion, Exercise, Finding, Location, Outcome
from grader.grading.model.report import Verdict
from grader.grading.model.wording import quote
from grader.runtime.model.author_files import AuthorMistake, error_words, line_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace, Fault, Trace, main_not_called, same_node_name

#: Modules of rules; each rule says itself where it stands among all.
_MODULES = (
    simulated,
    scans,
    kept,
    launch_mistakes,
    loading,
    scopes,
    services,
    actions,
    callbacks,
    crashes,
    attributes,
    misuse,
    silence,
    rates,
    values,
    formulas,
    logs,
)
#: All rules of the grader in the order of their priorities; the first that applies wins.
RULES: tuple[Rule, ...] = rules_in_order(item for m in _MODULES for item in vars(m).values() if isinstance(item, Rule))
_LOST = (Outcome.NOT_MET, Outcome.PARTLY)
_LOG = logging.getLogger(__name__)
#: Evidence key for the id of the cause.
CAUSE_KEY = "diagnosis"


def cases_of(  # noqa: PLR0913  what was found, and everything that may explain it
    verdicts: tuple[Verdict, ...],
    exercise: Exercise,
    traces: Mapping[str, AssessedTrace],
    submission: Submission,
    sources: Mapping[str, str],
    facts: Mapping[str, object],
) -> tuple[Case | None, ...]:
    """Return what rules are asked about each verdict, in rubric order; None where nothing was lost.

    Args:
        verdicts: The verdicts.
        exercise: Their exercise.
        traces: Scenario id -> trace.
        submission: Tells which files were found.
        sources: Wanted file name -> its text.
        facts: Criterion id -> what its check hands to rules.
    """
    asked = {c.scenario for v, c in zip(verdicts, exercise.criteria, strict=True) if v.outcome in _LOST}
    # only these, because parsing a file takes longer than judging it
    names = dict.fromkeys(p for s in exercise.scenarios if s.id in asked for p in s.processes if p in sources)
    read_ = {name: read_source(submission.files[name].found or name, sources[name]) for name in names}
    lost: dict[str, Criterion] = {}
    cases: list[Case | None] = []
    for verdict, criterion in zip(verdicts, exercise.criteria, strict=True):
        assessed = traces.get(criterion.scenario)
        if verdict.outcome not in _LOST or assessed is None or assessed.harness_problem:
            cases.append(None)
            continue
        trace = assessed.recorded
        scenario = next(s for s in exercise.scenarios if s.id == criterion.scenario)
        own = {name: read_[name] for name in scenario.processes if name in read_}
        others = tuple(c for c in exercise.criteria if c is not criterion)
        fault, known = fault_of(verdict, trace), facts.get(criterion.id)
        cases.append(Case(criterion, verdict, trace, own, fault, others, known, dict(lost)))
        if verdict.outcome is Outcome.NOT_MET:
            lost[criterion.id] = criterion
    return tuple(cases)


def diagnose(
    verdicts: tuple[Verdict, ...],
    cases: Sequence[Case | None],
    rules: Sequence[Rule],
    mistakes: list[AuthorMistake],
) -> tuple[Verdict, ...]:
    """Return the verdicts, in rubric order, with a place and one hint wherever a cause is very likely.

    Args:
        verdicts: The verdicts.
        cases: What rules are asked about each; see `cases_of`.
        rules: The rules in their order; see `rules_of`.
        mistakes: Mistakes in the exercise's own rules are appended here.
    """
    owner: dict[str, str] = {}
    return tuple(
        verdict if case is None else _explained(verdict, clue_for(case, rules, mistakes), owner)
        for verdict, case in zip(verdicts, cases, strict=True)
    )


def _explained(verdict: Verdict, found: tuple[str, Clue] | None, owner: dict[str, str]) -> Verdict:
    """Return a verdict with its cause, if known; `owner` holds the criterion with which each one was reported."""
    if found is None:
        return verdict
    id_, clue = found
    if clue.same_as:
        return _same_as(clue.same_as, verdict)
    earlier = owner.setdefault(clue.key or f"{id_}:{clue.location}", verdict.id)
    evidence = {**verdict.evidence, CAUSE_KEY: id_}
    placed = replace(verdict, hint=clue.hint, location=clue.location or verdict.location, evidence=evidence)
    return placed if earlier == verdict.id else _same_as(earlier, placed)


def rules_of(exercise: Exercise) -> tuple[Rule, ...]:
    """Return the rules that are asked about an exercise in their order; of equal ones, its own come first."""
    own = [rule for rule in exercise.hints if isinstance(rule, Rule)]
    return rules_in_order((*own, *RULES)) if own else RULES


def clue_for(
    case: Case, rules: Sequence[Rule] | None = None, mistakes: list[AuthorMistake] | None = None
) -> tuple[str, Clue] | None:
    """Return id and clue of the first rule that applies to a case; None if no cause is very likely."""
    return next(((rule.id, clue) for rule, clue in clues_for(case, RULES if rules is None else rules, mistakes)), None)


def clues_for(
    case: Case, rules: Sequence[Rule], mistakes: list[AuthorMistake] | None = None
) -> Iterator[tuple[Rule, Clue]]:
    """Yield the rules that apply to a case, with their clues, in the order of the rules.

    A rule that raises is skipped, because a mistake in it must not prevent a report: a rule of a rubric's own is
    appended to `mistakes`, another one is logged.
    """
    for rule in rules:
        if case.trace.bag is not None and not rule.file:  # the grader's own explain programs that run
            continue
        try:
            clue = rule.clue(case)
            if rule.file and clue is not None and (wrong := clue_flaw(clue, case)):
                raise TypeError(wrong)
        except Exception as error:
            if not rule.file:
                _LOG.exception("the rule %s failed on the criterion %s", rule.id, case.criterion.id)
            elif mistakes is not None:
                mistakes.append(_mistake(rule, error))
            continue
        if clue is not None:
            yield rule, clue


def _mistake(rule: Rule, error: Exception) -> AuthorMistake:
    text = f"the rule {rule.id}: {type(error).__name__}: {quote(error_words(error))}"
    return AuthorMistake(rule.file.rsplit("/", 1)[-1], line_of(error, rule.file, 0), text)


def hint_for(fault: Fault, trace: Trace, text: str) -> str:
    """Return one thing to do about a fault without a rubric; empty if no cause is very likely.

    It begins with the line to look at where the fault itself names another line.

    Args:
        fault: The fault.
        trace: Its recording.
        text: The file in which it arose, or that its process runs; empty if that is not known.
    """
    reason = fault_sentence(fault)
    evidence = {FAULT_KEY: fault_evidence(fault)}
    verdict = Verdict("fault", "", Outcome.NOT_MET, Fraction(0), Fraction(1), reason, evidence=evidence)
    criterion = Criterion("fault", "", Fraction(1), trace.scenario, _Fault())
    sources = {fault.process: read_source(fault.file or fault.process, text)} if text else {}
    found = clue_for(Case(criterion, verdict, trace, sources, fault))
    if found is None:
        return fault_hint(fault)
    hint, place = found[1].hint, found[1].location
    if place is None or place == Location(fault.file, fault.line):
        return hint
    return f"{place.file}:{place.line}: {hint}"


@dataclass(frozen=True, slots=True)
class _Fault:
    """The check of a fault without a rubric."""

    def judge(self, trace: Trace) -> Finding:
        raise NotImplementedError("a fault is there already")


def _same_as(criterion: str, verdict: Verdict) -> Verdict:
    hint = f"this has the same cause as {criterion}: fix that first"
    return replace(verdict, hint=hint, same_cause_as=criterion)


def fault_of(verdict: Verdict, trace: Trace) -> Fault | None:
    """Return the fault of the trace that a verdict rests on."""
    known = verdict.evidence.get(FAULT_KEY)
    if not isinstance(known, Mapping):
        return None
    wanted = (known["process"], known["text"], known["line"])
    return next((f for f in trace.faults() if (f.process, f.text, f.line) == wanted), None)


def placed(notes: tuple[str, ...], submission: Submission, sources: Mapping[str, str]) -> tuple[str, ...]:
    """Return the notes; one that nothing calls main(), or that two nodes have one name, gets the lines to look at."""
    return placed_in(notes, {submission.files[name].found or name: text for name, text in sources.items()})


def placed_in(notes: tuple[str, ...], files: Mapping[str, str]) -> tuple[str, ...]:
    """Return notes as `placed` does, for the texts of files by their paths."""
    uncalled = {main_not_called(file): file for file in files}
    found = [_placed(uncalled[note], files[uncalled[note]]) if note in uncalled else note for note in notes]
    return tuple(_with_names(note, files) for note in found)


def _with_names(note: str, files: Mapping[str, str]) -> str:
    """Return a note that two nodes have one name with the places that give it."""
    places: list[str] = []
    for file, text in files.items():
        source = read_source(file, text)
        for call in (*source.calls("__init__"), *source.calls("create_node"), *source.calls("Node")):
            name = literal_text(argument(call, 0, "node_name"))
            if name is not None and note == same_node_name(f"/{name.strip('/')}"):
                places.append(f"{file}:{first_line(call)}")
    return f"{' and '.join(places)}: {note}" if places else note


def _placed(file: str, text: str) -> str:
    source = read_source(file, text)
    guard = _wrong_guard(source)
    if guard is not None:
        problem = f"{file}:{first_line(guard)}: 'if {source.code(guard.test, 60)}' is never true, so "
        return f"{problem}`python3 {file}` would do nothing; write: if __name__ == '__main__':"
    named = next((n for n in bare_statements(source) if chain(n) == "main"), None)
    if named is not None:
        problem = f"{file}:{first_line(named)}: main is named, not called, so `python3 {file}` would do nothing"
        return f"{problem}; write: main()"
    main = next(iter(source.functions("main")), None)
    return main_not_called(file, first_line(main) if main is not None else 0)


def _wrong_guard(source: Source) -> ast.If | None:
    """Return the top-level condition that was probably meant to be the `__main__` guard."""
    for node in source.all(ast.If):
        test = node.test
        if source.function_of(node) is not None or not isinstance(test, ast.Compare):
            continue
        sides = [test.left, *test.comparators]
        texts = [t for s in sides if (t := literal_text(s)) is not None]
        named = any(last_name(s) == "__name__" for s in sides)
        if (named and texts != ["__main__"]) or (not named and any("main" in t for t in texts)):
            return node
    return None
