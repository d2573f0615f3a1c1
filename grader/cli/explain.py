"""The command `grade explain`: explains criteria, checks and hint rules."""

from __future__ import annotations

from pathlib import Path

import click

from grader.cli.completion import complete_criterion
from grader.cli.options import PATH, RUBRIC, print_result
from grader.runtime.model.errors import ALL_MET


@click.command(name="explain")
@click.argument("name", metavar="[NAME]", required=False, shell_complete=complete_criterion)
@click.option("--rubric", "rubrics", type=RUBRIC, multiple=True, help="Look in this rubric; repeatable.")
@click.option("--rules", is_flag=True, help="List the hint rules by priority: all, or those for the check NAME.")
@click.option("--on", "evidence", metavar="EVIDENCE", type=PATH, help="Try the rules on this kept recording.")
@click.option("--json", "as_json", is_flag=True, help="Print JSON, and nothing else.")
def command(*, name: str | None, rubrics: tuple[Path, ...], rules: bool, evidence: Path | None, as_json: bool) -> int:
    """Explain the criterion or the check NAME; without a name, list all of them.

    Says what is asked, in which situation and with which tolerance it is measured, and which part of the chapter asks
    for it. With --rules, lists the rules that find hints; with --rules --on EVIDENCE, those that apply to a recording.
    """
    if evidence is not None and (not rules or name is not None):
        raise click.BadParameter("--on needs --rules, and no NAME: all rules are tried on the recording")
    if rules:
        return _explain_rules(name or "", rubrics, evidence, as_json=as_json)
    from grader.grading.app.explain import everything, explain_name
    from grader.grading.reporting.explained import explanations_to_json, list_all, render_explanations

    found = everything(rubrics) if name is None else explain_name(name, rubrics)
    render = list_all if name is None else render_explanations
    print_result(lambda: explanations_to_json(found), lambda page: render(found, width=page.width), as_json=as_json)
    return ALL_MET


def _explain_rules(name: str, rubrics: tuple[Path, ...], evidence: Path | None, *, as_json: bool) -> int:
    from grader.grading.app.hint_rules import explain_rules, try_rules
    from grader.grading.reporting.explained import render_rules, render_trials, rules_to_json

    if evidence is None:
        rules = explain_rules(rubrics, name)
        print_result(lambda: rules_to_json(rules), lambda page: render_rules(rules, width=page.width), as_json=as_json)
        return ALL_MET
    trials = try_rules(evidence, rubrics)
    print_result(lambda: rules_to_json(trials), lambda page: render_trials(trials, width=page.width), as_json=as_json)
    return ALL_MET
