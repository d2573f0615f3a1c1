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
from decided import grade_until_decided
from places import ROOT
from tables import read_table
from tiers import LONG, NIGHTLY

from grader.cli import main
from grader.grading.app.request import GradeRequest
from grader.grading.judging.diagnosis import CAUSE_KEY
from grader.grading.model.report import Report
from grader.grading.rubrics.loader import read_rubric

EXAMPLES = sorted(path.parent.name for path in (ROOT / "examples").glob("*/README.md"))
#: The place of the first submission of an example that is left to the nightly run.
NIGHTLY_FROM = 2


def rubric(name: str) -> Path:
    """Return the rubric of an example."""
    return ROOT / "examples" / name / f"{name}.yaml"


@cache
def listed(name: str) -> dict[str, dict[str, Any]]:
    """Return what is expected of each wrong submission of an example, as its file has it."""
    found: Any = read_table(ROOT / "examples" / name / "expected.yaml")
    return dict(found)


def expected(name: str) -> dict[str, dict[str, str]]:
    """Return what each wrong submission of an example loses: criteria that are not met, with their outcomes."""
    lost = {wrong: rows.items() for wrong, rows in listed(name).items()}
    return {
        wrong: {id_: row if isinstance(row, str) else next(iter(row)) for id_, row in rows}
        for wrong, rows in lost.items()
    }


def causes(name: str, wrong: str) -> dict[str, tuple[str, str]]:
    """Return the hint rule that each criterion gets, and the code of the line that it names."""
    rows = {id_: row for id_, row in listed(name)[wrong].items() if not isinstance(row, str)}
    return {id_: next(iter(named.items())) for id_, row in rows.items() for named in row.values()}


def named_causes(report: Report, submission: Path) -> dict[str, tuple[str, str]]:
    """Return the hint rules of a rubric's own that a report names, with the code of the line."""
    found = {}
    for verdict in (v for exercise in report.exercises for v in exercise.verdicts):
        place = verdict.location
        if CAUSE_KEY in verdict.evidence and place is not None:
            line = (submission / place.file).read_text(encoding="utf-8").splitlines()[place.line - 1]
            found[verdict.id] = (str(verdict.evidence[CAUSE_KEY]), line.strip())
    return found


def submissions() -> Iterator[ParameterSet]:
    """Yield each example with each of its submissions; the second mistake and further ones are more of the same."""
    for number, name in enumerate(EXAMPLES):
        for place, folder in enumerate(["reference", *(f"wrong/{wrong}" for wrong in expected(name))]):
            marks = NIGHTLY if place >= NIGHTLY_FROM else LONG if place or number % 3 else ()
            yield pytest.param(name, folder, id=f"{name}-{folder}", marks=marks)


@pytest.mark.breadth(1, 3)
@pytest.mark.ros
@pytest.mark.parametrize(("name", "folder"), list(submissions()))
def test_a_submission_gets_what_it_is_worth(name: str, folder: str) -> None:
    """On the virtual clock, and without a fault of the grader."""
    submission = ROOT / "examples" / name / folder
    report = grade_until_decided(GradeRequest(str(submission), rubrics=(rubric(name),), clock="virtual"))
    told = {v.id: v.reason for exercise in report.exercises for v in exercise.verdicts}
    assert outcomes(report) == ({} if folder == "reference" else expected(name)[folder.removeprefix("wrong/")]), told
    assert (report.score == report.max_score) == (folder == "reference")
    wrong = folder.removeprefix("wrong/")
    hinted = {} if folder == "reference" else causes(name, wrong)
    own = listed_rules(name)
    assert {id_: cause for id_, cause in named_causes(report, submission).items() if cause[0] in own} == hinted


@pytest.mark.ros
def test_the_simulation_of_an_author_runs_where_submissions_do() -> None:
    """In the sandbox, where little of the grader is: its file imports the public interface."""
    submission = ROOT / "examples" / "obstacle_stop" / "reference"
    report = grade_until_decided(GradeRequest(str(submission), rubrics=(rubric("obstacle_stop"),), clock="virtual"))
    assert outcomes(report) == {}


def listed_rules(name: str) -> set[str]:
    """Return the hint rules of an example's own."""
    return {rule.id for rule in read_rubric(rubric(name)).hints}


def test_every_rule_of_an_example_names_a_mistake() -> None:
    """Of one of its wrong submissions, or a slip of `slips.yaml`."""
    told = {name: {rule for wrong in listed(name) for rule, _ in causes(name, wrong).values()} for name in EXAMPLES}
    for path in (ROOT / "examples").glob("*/slips.yaml"):
        told[path.parent.name] |= {row["cause"] for row in read_table(path)} & listed_rules(path.parent.name)
    assert told == {name: listed_rules(name) for name in EXAMPLES}
    assert sum(map(len, told.values())) >= 7


@pytest.mark.breadth(3, 8)
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
