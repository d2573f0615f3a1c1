"""The example exercises: each reference gets full points, and each wrong submission loses what its folder says."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from _pytest.mark import ParameterSet
from archive import outcomes
from click.testing import CliRunner
from grading import grade_until_decided
from ruamel.yaml import YAML

from grader.app.request import GradeRequest
from grader.cli import main
from grader.rubrics.loader import read_rubric

ROOT = Path(__file__).resolve().parent.parent
EXAMPLES = sorted(path.parent.name for path in (ROOT / "examples").glob("*/README.md"))
#: The place of the first submission of an example that is left to the nightly run.
NIGHTLY_FROM = 2


def rubric(name: str) -> Path:
    """Return the rubric of an example."""
    return ROOT / "examples" / name / f"{name}.yaml"


@cache
def expected(name: str) -> dict[str, dict[str, str]]:
    """Return what each wrong submission of an example loses: criteria that are not met, with their outcomes."""
    found: Any = YAML(typ="safe").load((ROOT / "examples" / name / "expected.yaml").read_text(encoding="utf-8"))
    return dict(found)


def submissions() -> Iterator[ParameterSet]:
    """Yield each example with each of its submissions; the second mistake and further ones are more of the same."""
    for name in EXAMPLES:
        for place, folder in enumerate(["reference", *(f"wrong/{wrong}" for wrong in expected(name))]):
            marks = [pytest.mark.nightly] if place >= NIGHTLY_FROM else []
            yield pytest.param(name, folder, id=f"{name}-{folder}", marks=marks)


@pytest.mark.ros
@pytest.mark.parametrize(("name", "folder"), list(submissions()))
def test_a_submission_gets_what_it_is_worth(name: str, folder: str) -> None:
    """On the virtual clock, and without a fault of the grader."""
    submission = ROOT / "examples" / name / folder
    report = grade_until_decided(GradeRequest(str(submission), rubrics=(rubric(name),), clock="virtual"))
    told = {v.id: v.reason for exercise in report.exercises for v in exercise.verdicts}
    assert outcomes(report) == ({} if folder == "reference" else expected(name)[folder.removeprefix("wrong/")]), told
    assert (report.score == report.max_score) == (folder == "reference")


@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_is_whole(name: str) -> None:
    """A rubric without mistakes, three wrong submissions, and a page that says how to grade it."""
    folder = ROOT / "examples" / name
    checked = CliRunner().invoke(main.app, ["rubric", "check", str(rubric(name))])
    assert (checked.exit_code, len(checked.output.splitlines())) == (0, 1), checked.output
    exercise = read_rubric(rubric(name))
    assert exercise.id == name
    wrong = sorted(path.name for path in (folder / "wrong").iterdir())
    assert wrong == sorted(expected(name))
    assert len(wrong) >= 3
    known = {criterion.id for criterion in exercise.criteria}
    assert all(lost and set(lost) <= known for lost in expected(name).values())
    page = (folder / "README.md").read_text(encoding="utf-8")
    assert f"\n    grade examples/{name}/reference --rubric examples/{name}/{name}.yaml\n" in page
    assert [line for line in page.splitlines() if line.startswith("## ")] == ["## Grade it", "## What it shows"]
    for file in exercise.files:
        assert (folder / "reference" / file).is_file()
