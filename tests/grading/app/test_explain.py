"""Explanations of criteria and checks: complete, in the words of rubric and manual, with help for mistyped names."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from kept_runs import kept_run, velocity_run, velocity_trace
from places import ROOT

from grader.cli import main
from grader.grading.app.explain import explain_name
from grader.grading.app.grade import read_exercises
from grader.grading.app.hint_rules import explain_rules, try_rules
from grader.grading.app.request import GradeRequest
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.diagnosis import RULES
from grader.grading.model.report import CheckExplanation, CriterionExplanation
from grader.grading.rubrics.builtin import builtin_exercises, builtin_rubrics
from grader.grading.rubrics.check_parameters import manual_of
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import GraderError

CRITERIA = [(e.id, c.id) for e in builtin_exercises() for c in e.criteria]


def grade(*words: str) -> Result:
    return CliRunner().invoke(main.app, ["explain", *words])


@pytest.mark.parametrize(("exercise", "criterion"), CRITERIA, ids=[c for _, c in CRITERIA])
def test_every_criterion_is_explained(exercise: str, criterion: str) -> None:
    """What is asked, how it is measured, every parameter's value and meaning, and where the chapter asks for it."""
    (found,) = explain_name(f"{exercise}/{criterion}")
    assert isinstance(found, CriterionExplanation)
    assert found.asks
    assert found.situation
    assert found.chapter.startswith(("Exercise ", "Part "))
    assert all(p.value and p.meaning for p in found.parameters)
    shown = grade(criterion)
    assert shown.exit_code == 0
    assert found.chapter in shown.output
    assert max(map(len, shown.output.splitlines())) <= 120


@pytest.mark.parametrize("name", CHECKS)
def test_every_check_is_explained(name: str) -> None:
    """Its manual holds a sentence, and one for each parameter; who uses it is told."""
    found = explain_name(name)[0]
    assert found.asks.endswith(".")
    assert all(parameter.meaning for parameter in found.parameters)
    assert grade(name).exit_code == 0


def test_the_tolerance_is_that_of_the_rubric(tmp_path: Path) -> None:
    """With its unit, and from the rubric that is named."""
    assert "tolerance: 1 Hz" in grade("rate").output
    text = next(iter(builtin_rubrics().values())).read_text(encoding="utf-8")
    (tmp_path / "mine.yaml").write_text(text.replace("tolerance: 1 Hz", "tolerance: 1.5 Hz"), encoding="utf-8")
    assert "tolerance: 1.5 Hz" in grade("rate", "--rubric", str(tmp_path / "mine.yaml")).output


def test_a_check_shows_what_a_rubric_has_to_give() -> None:
    """Parameters with a default show it, the others that there is none."""
    found = {p.name: (p.value, p.required) for p in explain_name("log_period")[0].parameters if p.name != "topic"}
    assert found["tolerance"] == ("0.1", False)
    (check,) = explain_name("topic_rate")
    assert {p.name: p.required for p in check.parameters} == {
        "topic": True,
        "rate": True,
        "tolerance": True,
        "window": False,
        "partly_tolerance": False,
        "after_discovery": False,
        "full": False,
        "none": False,
        "combine": False,
    }
    assert isinstance(check, CheckExplanation)
    assert check.used_by == (
        "velocity_publisher/rate",
        "two_node_communication/temperature_rate",
        "joint_publisher/rate",
    )


@pytest.mark.parametrize(
    ("typed", "offered"),
    [
        ("rte", "rate"),
        ("log_periode", "log_period"),
        ("fan_on", "fan_on_above_25"),
        ("Rate", "rate"),
        ("xyzzy", "publishes"),
    ],
)
def test_an_unknown_name_is_answered_with_the_nearest(typed: str, offered: str) -> None:
    """Exit code 2; where nothing is near, all names are told."""
    with pytest.raises(GraderError) as error:
        explain_name(typed)
    assert offered in error.value.hint
    assert grade(typed).exit_code == 2


def test_programs_can_read_it() -> None:
    """The same, as JSON and nothing else."""
    found = json.loads(grade("rate", "--json").stdout)
    row, of_a_project = found["explanations"]
    assert of_a_project["exercise"].endswith("(joint_publisher)")
    assert (row["kind"], row["id"], row["points"], row["check"]) == ("criterion", "rate", 10, "topic_rate")


@dataclass(frozen=True)
class Manual:
    """One sentence.

    More of it.

    And more.

    Attributes:
        first: What it is,
            on two lines.
        second: Another.

    Returns:
        nothing: of ours.
    """

    first: int
    second: int


def test_a_manual_is_read_from_the_docstring() -> None:
    """Paragraphs become lines; only attributes become parameters."""
    manual = manual_of(Manual)
    assert (manual.summary, manual.details) == ("One sentence.", "More of it.\nAnd more.")
    assert manual.parameters["first"] == "What it is, on two lines."
    assert manual.parameters["second"] == "Another."
    assert manual_of(type("Bare", (), {})).summary == ""


def test_without_a_name_all_of_them_are_listed() -> None:
    """Criteria by exercise, then checks; the JSON has everything about them."""
    done = grade()
    assert done.exit_code == 0
    lines = done.output.splitlines()
    assert [name for name in CHECKS if not any(line.startswith(f"  {name} ") for line in lines)] == []
    assert [
        c.id
        for e in read_exercises(GradeRequest("", every=True), recorded=True)
        for c in e.criteria
        if not any(line.split() == [c.id, *c.title.split()] for line in lines)
    ] == []
    rows = json.loads(grade("--json").output)["explanations"]
    assert {row["kind"] for row in rows} == {"criterion", "check"}
    assert len(rows) > len(CHECKS)


def test_rules_are_listed_in_their_order() -> None:
    """With what they explain; those of a rubric stand among the others."""
    rubric = ROOT / "examples" / "fibonacci" / "fibonacci.yaml"
    found = explain_rules((rubric,))
    assert [r.priority for r in found] == sorted(r.priority for r in found)
    assert {r.name for r in found} == {*(r.id for r in RULES), *(r.id for r in read_rubric(rubric).hints)}
    own = {r.name: r for r in found if r.file}
    assert own["last_number_cut_off"].checks == ("fibonacci_results",)
    assert own["deaf_loop"].about == "The loop that computes does not look whether somebody cancels."
    shown = grade("--rules", "--rubric", str(rubric)).output
    assert "100  deaf_loop (hints.py): action_result" in shown
    assert max(map(len, shown.splitlines())) <= 120
    assert json.loads(grade("--rules", "--json").output)["schema"] == "grader/rules/v1"


def test_the_rules_for_one_check_are_listed() -> None:
    """A rule without checks explains any."""
    found = explain_rules(name="topic_rate")
    assert all(not r.checks or "topic_rate" in r.checks for r in found)
    assert {"topic_rate"} < {name for r in found for name in r.checks or ("",)} | {"topic_rate", ""}
    assert [r.name for r in explain_rules(name="slow_timer")] == ["slow_timer"]
    refused = grade("--rules", "slow_timr")
    assert refused.exit_code == 2
    assert "slow_timr: expected the name of a hint rule or of a check, found neither" in refused.output
    assert "slow_timer" in refused.output


def test_rules_are_asked_about_a_kept_recording(tmp_path: Path) -> None:
    """All that apply are told, in their order; a report shows the first."""
    source = """\
class Velocity(Node):
    def __init__(self):
        super().__init__("velocity")
        self.out = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.1, self.tick)

    def tick(self):
        self.out.publish(Twist())
"""
    report = kept_run(tmp_path / "kept", velocity_run(velocity_trace(rate_hz=10), source=source))
    trials = try_rules(tmp_path / "kept")
    lost = [v for v in report.exercises[0].verdicts if v.outcome.value in ("not_met", "partly")]
    assert [t.criterion for t in trials] == [f"velocity_publisher/{v.id}" for v in lost]
    first = {t.criterion.partition("/")[2]: t.rules[0] for t in trials if t.rules}
    assert first
    assert {id_: rule[0] for id_, rule in first.items()} == {
        v.id: v.evidence["diagnosis"] for v in lost if "diagnosis" in v.evidence
    }
    shown = grade("--rules", "--on", str(tmp_path / "kept"))
    assert shown.exit_code == 0
    assert all(f"{t.criterion}: not met." in shown.output for t in trials if t.outcome == "not_met")
    told = json.loads(grade("--rules", "--on", str(tmp_path / "kept"), "--json").output)["rules"]
    assert [row["criterion"] for row in told] == [t.criterion for t in trials]


OWN_HINTS = """from grader.api import hint_rule


@hint_rule("topic_rate")
def finds_nothing(case):
    return None


@hint_rule("topic_rate", fault=True)
def not_asked(case):
    return None


@hint_rule("field_in_range")
def of_another_check(case):
    return None
"""


def test_an_authors_rule_that_finds_nothing_is_named(tmp_path: Path) -> None:
    """Else nobody sees whether it was asked: an error in it looks like a condition that does not hold."""
    (tmp_path / "hints.py").write_text(OWN_HINTS)
    rubric = tmp_path / "rubric.yaml"
    text = (ROOT / "rubrics" / "exercise_1" / "rubric.yaml").read_text()
    rubric.write_text(text.replace("criteria:", "hints: [hints.py]\ncriteria:"))
    kept_run(tmp_path / "kept", velocity_run(velocity_trace(rate_hz=10), source="import rclpy\n"))
    trials = {one.criterion: one.silent for one in try_rules(tmp_path / "kept", (rubric,))}
    assert trials["velocity_publisher/rate"] == ("finds_nothing",)
    shown = grade("--rules", "--rubric", str(rubric), "--on", str(tmp_path / "kept")).output
    assert "of the rubric's own rules, asked and without a result: finds_nothing\n" in shown


@pytest.mark.parametrize(
    ("words", "told"),
    [
        (["--on", "kept"], "--on needs --rules"),
        (["--rules", "topic_rate", "--on", "kept"], "--on needs --rules, and no NAME"),
        (["--rules", "--on", "nothing_there"], "nothing_there"),
    ],
)
def test_a_trial_needs_rules_and_a_recording(words: list[str], told: str) -> None:
    """Anything else is refused."""
    refused = grade(*words)
    assert refused.exit_code == 2
    assert told in refused.output
