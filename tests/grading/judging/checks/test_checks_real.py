"""Every check is tried on golden traces and on real nodes, and these are the real runs."""

from functools import lru_cache
from pathlib import Path

import pytest
from places import ROOT, TESTS

from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.run_check import check_name
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric

REAL = TESTS / "real_checks"
NODES = TESTS / "service_nodes"
#: Rubrics that are asked of real nodes, here or in the tests of whole submissions.
RUBRICS = [p for p in (*builtin_rubrics().values(), *REAL.glob("*.yaml")) if ".selftest." not in p.name]
RUBRICS += [p.parent / f"{p.parent.name}.yaml" for p in (ROOT / "examples").glob("*/README.md")]


@lru_cache
def asked_in(rubric: Path) -> list[str]:
    """Return the names of the checks that a rubric asks, in its order."""
    return [check_name(criterion) for criterion in read_rubric(rubric).criteria]


@pytest.mark.parametrize("name", CHECKS)
def test_every_check_has_golden_traces_and_a_real_run(name: str) -> None:
    """A test of its own on traces, and a rubric that asks it of real nodes."""
    tests = (p.read_text(encoding="utf-8") for p in Path(__file__).parent.glob("test_*.py"))
    assert any(CHECKS[name].__name__ in text for text in tests)
    assert any(name in asked_in(rubric) for rubric in RUBRICS)


def outcomes(folder: Path, rubric: str) -> tuple[list[tuple[str, str]], dict[str, str]]:
    """Grade a folder and return the outcome of each criterion by its check's name, with its reason."""
    report = grade_once(GradeRequest(str(folder), rubrics=(REAL / rubric,), clock="virtual"), lambda _: None)
    verdicts = report.exercises[0].verdicts
    told = {v.id: v.reason for v in verdicts}
    return [(name, v.outcome.value) for name, v in zip(asked_in(REAL / rubric), verdicts, strict=True)], told


@pytest.mark.breadth(1, 2)
@pytest.mark.ros
@pytest.mark.parametrize(
    ("folder", "rubric"), [(REAL / "right", "guide.yaml"), (NODES, "living.yaml"), (NODES, "counting.yaml")]
)
def test_a_real_node_that_does_it_right_meets_every_check(folder: Path, rubric: str) -> None:
    """Topics, logs, reactions, parameters, policies, actions, lifecycles, ends: recorded and judged."""
    pytest.importorskip("test_msgs")
    found, told = outcomes(folder, rubric)
    assert {outcome for _, outcome in found} == {"met"}, told


@pytest.mark.long
@pytest.mark.ros
def test_a_real_node_that_does_it_wrong_meets_none() -> None:
    """But that it lives; what it does after Ctrl-C is a question of its own."""
    found, told = outcomes(REAL / "astray", "guide.yaml")
    assert [name for name, outcome in found if outcome != "not_met"] == ["no_fault"], told
