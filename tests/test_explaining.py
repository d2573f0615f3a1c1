"""Explanations of criteria and checks: complete, in the words of rubric and manual, with help for mistyped names."""

from __future__ import annotations

import json
from dataclasses import dataclass
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from grader.app import explain as explaining
from grader.app import grade as session
from grader.app.explain import explain
from grader.app.request import GradeRequest
from grader.cli import main
from grader.core.errors import GraderError
from grader.core.exercise import Exercise
from grader.core.report import CheckExplanation, CriterionExplanation
from grader.judging.checks import CHECKS
from grader.rubrics.builtin import builtin_rubrics
from grader.rubrics.check_parameters import manual_of
from grader.rubrics.loader import read_rubric

CRITERIA = [(e.id, c.id) for path in builtin_rubrics().values() for e in [read_rubric(path)] for c in e.criteria]


@pytest.fixture(autouse=True)
def _read_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Every test explains the same rubrics, and reading them takes longer than all the rest."""
    monkeypatch.setattr(explaining, "read_exercises", _read)


def _read(request: GradeRequest, *, recorded: bool) -> list[Exercise]:
    if request.rubrics not in _READ:
        _READ[request.rubrics] = session.read_exercises(request, recorded=recorded)
    return _READ[request.rubrics]


_READ: dict[tuple[Path, ...], list[Exercise]] = {}


def grade(*words: str) -> Result:
    return CliRunner().invoke(main.app, ["explain", *words])


@pytest.mark.parametrize(("exercise", "criterion"), CRITERIA, ids=[c for _, c in CRITERIA])
def test_every_criterion_is_explained(exercise: str, criterion: str) -> None:
    """What is asked, how it is measured, every parameter's value and meaning, and where the chapter asks for it."""
    (found,) = explain(f"{exercise}/{criterion}")
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
    found = explain(name)[0]
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
    found = {p.name: (p.value, p.required) for p in explain("log_period")[0].parameters if p.name != "topic"}
    assert found["tolerance"] == ("0.1", False)
    (check,) = explain("topic_rate")
    assert {p.name: p.required for p in check.parameters} == {
        "topic": True,
        "rate": True,
        "tolerance": True,
        "window": False,
        "partly_tolerance": False,
        "after_discovery": False,
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
        explain(typed)
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
        for e in _read(GradeRequest("", every=True), recorded=True)
        for c in e.criteria
        if not any(line.split() == [c.id, *c.title.split()] for line in lines)
    ] == []
    rows = json.loads(grade("--json").output)["explanations"]
    assert {row["kind"] for row in rows} == {"criterion", "check"}
    assert len(rows) > len(CHECKS)
