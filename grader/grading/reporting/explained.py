"""Renders explanations of criteria, checks and hint rules, and the values of one student's variant."""

from __future__ import annotations

import json
import textwrap
from collections.abc import Iterator, Sequence
from dataclasses import asdict

from grader.grading.model.exercise import Exercise, Variant, written_value
from grader.grading.model.report import (
    CheckExplanation,
    CheckParameter,
    CriterionExplanation,
    RuleExplanation,
    RuleTrial,
)
from grader.grading.reporting.escape import json_value, markdown, markdown_code, shown

EXPLANATION_SCHEMA = "grader/explanation/v1"
RULES_SCHEMA = "grader/rules/v1"
_LABEL = 12
#: Widest column of parameters with their values.
_VALUE = 32

SHEET_SCHEMA = "grader/variant/v1"


def render_explanations(found: Sequence[CriterionExplanation | CheckExplanation], *, width: int) -> str:
    """Return explanations as text, one below another, no line longer than `width` if words allow it."""
    parts = [_criterion(e, width) if isinstance(e, CriterionExplanation) else _check(e, width) for e in found]
    return "\n\n".join("\n".join(lines) for lines in parts) + "\n"


def explanations_to_json(found: Sequence[CriterionExplanation | CheckExplanation]) -> str:
    """Return explanations as JSON text."""
    rows = [
        {"kind": "criterion", **asdict(e), "points": float(e.points)}
        if isinstance(e, CriterionExplanation)
        else {"kind": "check", **asdict(e)}
        for e in found
    ]
    return json.dumps({"schema": EXPLANATION_SCHEMA, "explanations": rows}, indent=2) + "\n"


def render_rules(found: Sequence[RuleExplanation], *, width: int) -> str:
    """Return hint rules as text: priority, name, what they explain, and the mistake that they look for."""
    lines: list[str] = []
    for rule in found:
        where = f" ({shown(rule.file)})" if rule.file else ""
        lines += _wrapped(f"{rule.priority:>6}  ", f"{shown(rule.name)}{where}: {_explains(rule)}", width, after=10)
        lines += _wrapped(" " * 10, shown(rule.about), width, after=10) if rule.about else []
    return "\n".join([*lines, "", "The rule with the lowest number is tried first, and the first that applies wins.\n"])


def _explains(rule: RuleExplanation) -> str:
    parts = [", ".join(map(shown, rule.checks)) or "any check"]
    parts += [f"problem {rule.problem}"] if rule.problem else []
    parts += ["after a fault"] if rule.fault else []
    parts += ["with or without a fault"] if rule.fault is None else []
    return "; ".join(parts)


def render_trials(found: Sequence[RuleTrial], *, width: int) -> str:
    """Return the rules that apply to a recording as text, by criterion; reports show the first of each."""
    lines: list[str] = []
    for trial in found:
        words = f"{trial.outcome.replace('_', ' ')}. {shown(trial.reason, limit=2000)}"
        lines += _wrapped("", f"{shown(trial.criterion)}: {words}", width, after=2)
        for name, priority, place, hint in trial.rules:
            where = f"{shown(place)}: " if place else ""
            lines += _wrapped(f"{priority:>6}  {shown(name)}: ", f"{where}{shown(hint, limit=2000)}", width, after=10)
        lines += [] if trial.rules else ["        no rule applies"]
        if trial.silent:
            silent = ", ".join(map(shown, trial.silent))
            lines += _wrapped(
                "        ", f"of the rubric's own rules, asked and without a result: {silent}", width, after=10
            )
        lines.append("")
    return "\n".join(lines) if found else "No criterion lost points, so no rule is tried.\n"


def rules_to_json(found: Sequence[RuleExplanation] | Sequence[RuleTrial]) -> str:
    """Return hint rules, or their trial on a recording, as JSON text."""
    return json.dumps({"schema": RULES_SCHEMA, "rules": [asdict(one) for one in found]}, indent=2) + "\n"


def list_checks(found: Sequence[CriterionExplanation | CheckExplanation], *, width: int) -> str:
    """Return the checks among the explanations as a list: name and purpose."""
    checks = [e for e in found if isinstance(e, CheckExplanation)]
    column = max((len(e.name) for e in checks), default=0) + 2
    lines = (line for e in checks for line in _wrapped(f"{e.name:<{column}}", shown(e.asks), width, after=column))
    return "\n".join(lines) + "\n"


def list_all(found: Sequence[CriterionExplanation | CheckExplanation], *, width: int) -> str:
    """Return the criteria by exercise, each with its title, and then the checks with their purpose."""
    criteria = [e for e in found if isinstance(e, CriterionExplanation)]
    column = max((len(e.id) for e in criteria), default=0) + 4
    lines: list[str] = []
    for exercise in dict.fromkeys(e.exercise for e in criteria):
        lines += ["", shown(exercise)]
        for e in criteria:
            if e.exercise == exercise:
                lines += _wrapped(f"  {e.id:<{column - 2}}", shown(e.title), width, after=column)
    checks = textwrap.indent(list_checks(found, width=width - 2), "  ")
    return "\n".join([*lines[1:], "", "Checks that rubrics can use", checks, "`grade explain NAME` explains one.\n"])


def _criterion(e: CriterionExplanation, width: int) -> Iterator[str]:
    yield f"{e.id}: {shown(e.title)}"
    yield from _row("exercise", e.exercise, width)
    yield from _row("points", f"{float(e.points):g}", width)
    yield from _row("chapter", e.chapter or "none", width)
    if e.needs:
        yield from _row("needs", ", ".join(e.needs), width)
    yield from _row("situation", e.situation, width)
    yield from _row("asks", e.asks, width)
    yield from _row("measured", f"by the check {e.check}. {e.details}", width)
    yield from _parameters(e.parameters, width)
    if e.hint:
        yield from _row("hint", e.hint, width)


def _check(e: CheckExplanation, width: int) -> Iterator[str]:
    yield f"{e.name}: a check that rubrics can use"
    yield from _row("asks", e.asks, width)
    if e.details:
        yield from _row("measured", e.details, width)
    yield from _parameters(e.parameters, width)
    yield from _row("used by", ", ".join(e.used_by) or "no criterion here", width)


def _parameters(parameters: Sequence[CheckParameter], width: int) -> Iterator[str]:
    given = [f"{p.name}: {shown(p.value) or ('(to be given)' if p.required else '')}" for p in parameters]
    column = min(max(map(len, given), default=0), _VALUE) + 2
    if parameters:
        yield "  parameters"
    for parameter, text in zip(parameters, given, strict=True):
        start = f"    {text:<{column}}"
        if len(start) > column + 4:
            yield from _wrapped("    ", text, width, after=6)
            start = " " * (column + 4)
        yield from _wrapped(start, shown(parameter.meaning), width, after=column + 4)


def _row(label: str, text: str, width: int) -> Iterator[str]:
    for number, line in enumerate(text.split("\n")):
        yield from _wrapped(f"  {label if number == 0 else '':<{_LABEL}}", shown(line, limit=2000), width)


def _wrapped(start: str, text: str, width: int, *, after: int = _LABEL + 2) -> Iterator[str]:
    lines = textwrap.wrap(text.strip(), max(40, width), initial_indent=start, subsequent_indent=" " * after)
    yield from lines or [start.rstrip()]


def render_sheet(exercise: Exercise) -> str:
    """Return the values as a Markdown table, or a sentence if the exercise is the same for everybody."""
    title = f"## Exercise {markdown(exercise.number)}: {markdown(exercise.title)}\n"
    variant = exercise.variant
    if variant is None:
        return f"{title}\nThis exercise is the same for everybody.\n"
    rows = [
        f"| {markdown(name.replace('_', ' '))} | {markdown_code(written_value(value))} |"
        for name, value in variant.values
    ]
    whose = f"\nThe values of {markdown(variant.student)}:\n"
    return "\n".join([title + whose, "| | |", "|:--|:--|", *rows]) + "\n"


def sheet_to_json(exercise: Exercise) -> str:
    """Return the values as JSON text."""
    variant = exercise.variant or Variant("", ())
    data = {
        "schema": SHEET_SCHEMA,
        "exercise": exercise.id,
        "student": json_value(variant.student),
        "values": {name: json_value(value) for name, value in variant.values},
        "rubric": exercise.digest,
    }
    return json.dumps(data, indent=2, allow_nan=False) + "\n"
