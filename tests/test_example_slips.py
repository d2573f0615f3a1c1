"""Slips of students who begin with the template of an example: the first hint names the line and what to do."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from tables import read_table
from tiers import LONG, NIGHTLY

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.grading.judging.diagnosis import CAUSE_KEY
from grader.grading.model.exercise import Outcome
from grader.runtime.session import RecordingSession, open_session

TABLES = {path.parent.name: read_table(path) for path in sorted((ROOT / "examples").glob("*/slips.yaml"))}


@pytest.fixture(scope="module")
def session() -> Iterator[RecordingSession]:
    """Workers for all submissions."""
    with open_session("auto", 2, lambda _: None) as opened:
        yield opened


def reference(name: str) -> Path:
    """Return the one file of the reference of an example."""
    (file,) = (ROOT / "examples" / name / "reference").glob("*.py")
    return file


def spoilt_reference(name: str, row: dict[str, Any]) -> str:
    """Return the reference of an example with the change of a slip."""
    text = reference(name).read_text(encoding="utf-8")
    for old, new in row["change"]:
        assert old in text, (name, row["slip"], old)
        text = text.replace(old, new)
    return text


def rows() -> Iterator[Any]:
    """Yield the slips of all examples, of which a later tier takes most."""
    for name, table in TABLES.items():
        for place, row in enumerate(table):
            yield pytest.param(name, row, id=f"{name}-{row['slip']}", marks=NIGHTLY if place else LONG)


def test_there_are_ten_slips_of_each_example_or_more() -> None:
    """Each changes the reference, and says what is told first."""
    assert sorted(TABLES) == ["emergency_brake", "goal_client", "wall_follower"]
    for name, table in TABLES.items():
        assert len({row["slip"] for row in table}) == len(table) >= 10
        assert all(spoilt_reference(name, row) != reference(name).read_text(encoding="utf-8") for row in table)
        assert all(row["at"] and row["at"] in spoilt_reference(name, row) for row in table)


@pytest.mark.ros
@pytest.mark.parametrize(("name", "row"), list(rows()))
def test_the_first_hint_names_line_and_action(
    session: RecordingSession, tmp_path: Path, name: str, row: dict[str, Any]
) -> None:
    """By the rule that the table names."""
    text = spoilt_reference(name, row)
    (tmp_path / reference(name).name).write_text(text, encoding="utf-8")
    rubric = ROOT / "examples" / name / f"{name}.yaml"
    request = GradeRequest(submission=str(tmp_path), rubrics=(rubric,), seed=42)
    report = grade_in(session, request, lambda _: None, pictures=False)
    lost = (v for exercise in report.exercises for v in exercise.verdicts if not v.same_cause_as)
    first = next(v for v in lost if v.outcome in (Outcome.NOT_MET, Outcome.PARTLY))
    assert first.location is not None
    found = {
        "criterion": first.id,
        "cause": first.evidence.get(CAUSE_KEY),
        "at": text.splitlines()[first.location.line - 1].strip(),
        "hint": first.hint,
    }
    assert found == {key: row[key] for key in found}
