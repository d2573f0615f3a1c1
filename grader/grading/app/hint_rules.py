"""Lists the hint rules for `grade explain --rules`, and asks them about a kept recording."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from grader.grading.app.explain import given_exercises, unknown_name
from grader.grading.app.rejudge import again, judgement
from grader.grading.evidence.store import open_evidence
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.diagnosis import rules_of
from grader.grading.judging.diagnosis.rules import Clue, Rule, rules_in_order
from grader.grading.judging.judge_run import tried_rules
from grader.grading.judging.run_check import check_name
from grader.grading.model.report import RuleExplanation, RuleTrial
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.errors import RubricError


def explain_rules(rubrics: tuple[Path, ...] = (), name: str = "") -> list[RuleExplanation]:
    """Explain the hint rules, with those of the rubrics, in the order in which they are asked.

    Args:
        rubrics: Rubric files; the built-in ones if empty.
        name: A rule, or a check; then only that rule, or those that explain the check, are returned. Empty for all.

    Raises:
        GraderError: There is no rule and no check of that name.
    """
    exercises = given_exercises(rubrics)
    rules = rules_in_order({rule: None for exercise in exercises for rule in rules_of(exercise)})
    names = {kind: known for known, kind in reversed(tuple(CHECKS.items()))}
    found = [_rule(rule, names) for rule in rules]
    if not name:
        return found
    checks = {*CHECKS, *(check_name(c) for e in exercises for c in e.criteria)}
    wanted = [r for r in found if r.name == name]
    if not wanted and name not in checks:
        raise unknown_name(
            name, [*(r.name for r in found), *checks], "expected the name of a hint rule or of a check, found neither"
        )
    return wanted or [r for r in found if not r.checks or name in r.checks]


def _rule(rule: Rule, names: Mapping[type, str]) -> RuleExplanation:
    checks = tuple(dict.fromkeys(c if isinstance(c, str) else names.get(c, c.__name__) for c in rule.checks))
    problem = "" if rule.problem is None else rule.problem.value
    file = rule.file.rsplit("/", 1)[-1]
    return RuleExplanation(rule.id, rule.priority, rule.about, checks, problem, rule.fault, file)


def try_rules(folder: Path, rubrics: tuple[Path, ...] = ()) -> list[RuleTrial]:
    """Ask the hint rules about a kept recording, and return all that apply to each criterion that lost points.

    Raises:
        EvidenceError: The recording cannot be used.
        RubricError: A rubric cannot be used, or one of its rules failed.
    """
    exercises, run = again(open_evidence(folder), judgement((), rubrics))
    mistakes: list[AuthorMistake] = []
    tried = [one for exercise in exercises for one in tried_rules(exercise, run, mistakes)]
    if mistakes:
        raise RubricError("\n".join(map(str, dict.fromkeys(mistakes))))
    return [
        RuleTrial(
            one.criterion,
            one.verdict.outcome.value,
            one.verdict.reason,
            tuple((rule.id, rule.priority, _place(clue), _hint(clue)) for rule, clue in one.clues),
            tuple(rule.id for rule in one.silent),
        )
        for one in tried
    ]


def _place(clue: Clue) -> str:
    return "" if clue.location is None else f"{clue.location.file}:{clue.location.line}"


def _hint(clue: Clue) -> str:
    return clue.hint or f"has the same cause as {clue.same_as}"
