"""Slips of students, graded with real nodes: the hint is the expected one, and obeying it gets them further."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from diagnosis_samples import RIGHT, exercise_of, rows, rubric_of, spoilt
from tiers import each

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.grading.judging.diagnosis import CAUSE_KEY
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Report, Verdict
from grader.runtime.session import RecordingSession, open_session

SLIPS = rows("slips.yaml")
TABLES = [*SLIPS, *rows("crashes.yaml"), *rows("behaviours.yaml")]
#: One of so many is graded before a change lands.
_SAMPLE = 30
#: And of these, by default, one of so many.
_SHORT = 8
_LOST = (Outcome.NOT_MET, Outcome.PARTLY)


@pytest.fixture(scope="module")
def session() -> Iterator[RecordingSession]:
    """Workers for all submissions."""
    with open_session("auto", 2, lambda _: None) as opened:
        yield opened


def graded(session: RecordingSession, folder: Path, file: str, text: str) -> Report:
    """Grade a program, with right ones for the other files of its exercise."""
    exercise = exercise_of(file)
    for name in exercise.files:
        if name in RIGHT:
            (folder / name).write_text(text if name == file else RIGHT[name], encoding="utf-8")
    request = GradeRequest(submission=str(folder), rubrics=(rubric_of(file),), seed=42)
    return grade_in(session, request, lambda _: None, pictures=False)


def first(report: Report) -> Verdict | None:
    """The first criterion that lost points by a cause of its own."""
    verdicts = (v for e in report.exercises for v in e.verdicts if v.outcome in _LOST and not v.same_cause_as)
    return next(verdicts, None)


def obeyed(row: dict[str, Any], text: str) -> str | None:
    """The program of somebody who obeys the hint; None if it names no edit, or leads back to the right program."""
    if row.get("edit", "undo") == "undo":
        return None
    for old, new in row["edit"]:
        assert old in text, (row["name"], old)
        text = text.replace(old, new)
    return text


def check_hint(session: RecordingSession, folder: Path, row: dict[str, Any]) -> None:
    """The criterion, the cause, the line and the hint are the expected ones."""
    text = spoilt(row["file"], row["change"])
    verdict = first(graded(session, folder, row["file"], text))
    assert verdict is not None
    where = verdict.location
    lines = {row["file"]: text}.get(where.file, RIGHT.get(where.file, "")).splitlines() if where is not None else []
    at = lines[where.line - 1].strip() if where is not None and where.line else ""
    found = {"criterion": verdict.id, "cause": verdict.evidence.get(CAUSE_KEY, ""), "at": at, "hint": verdict.hint}
    assert found == {key: row[key] for key in found}


def check_obeyed(session: RecordingSession, folder: Path, row: dict[str, Any]) -> None:
    """Who obeys the hint gets all points, or another hint, or the same for another line."""
    text = obeyed(row, spoilt(row["file"], row["change"]))
    assert text is not None
    verdict = first(graded(session, folder, row["file"], text))
    if verdict is not None:
        assert verdict.hint
        line = verdict.location.line if verdict.location is not None else 0
        at = text.splitlines()[line - 1].strip() if line else ""
        assert (verdict.hint, at) != (row["hint"], row["at"])


#: Those whose edit does not lead back to the right program at once.
EDITED = [row for row in TABLES if isinstance(row.get("edit"), list)]


def test_an_edit_changes_the_program() -> None:
    """It fits the spoilt program; one that leads back to the right program is called `undo`."""
    for row in TABLES:
        edit = row.get("edit")
        assert edit != "undo" or row["change"], row["name"]
        if edit not in (None, "undo"):
            assert obeyed(row, spoilt(row["file"], row["change"])) != RIGHT[row["file"]], row["name"]


@pytest.mark.breadth(1, 4)
@pytest.mark.ros
@pytest.mark.parametrize("row", each(SLIPS[::_SAMPLE], _SHORT), ids=lambda row: row["name"])
def test_a_slip_gets_its_hint(session: RecordingSession, tmp_path: Path, row: dict[str, Any]) -> None:
    """A sample of all."""
    check_hint(session, tmp_path, row)


@pytest.mark.breadth(1, 4)
@pytest.mark.ros
@pytest.mark.parametrize("row", each(EDITED[:: _SAMPLE // 3], _SHORT), ids=lambda row: row["name"])
def test_a_hint_that_is_obeyed_gets_further(session: RecordingSession, tmp_path: Path, row: dict[str, Any]) -> None:
    """A sample of all."""
    check_obeyed(session, tmp_path, row)


@pytest.mark.nightly
@pytest.mark.ros
def test_every_slip_gets_its_hint(session: RecordingSession, tmp_path: Path) -> None:
    """All of them; what differs is listed."""
    wrong: dict[str, str] = {}
    for row in SLIPS:
        folder = tmp_path / row["name"]
        folder.mkdir()
        try:
            check_hint(session, folder, row)
        except AssertionError as error:
            wrong[row["name"]] = str(error)
    assert wrong == {}


@pytest.mark.nightly
@pytest.mark.ros
def test_every_hint_that_is_obeyed_gets_further(session: RecordingSession, tmp_path: Path) -> None:
    """All that do not lead back to the right program at once."""
    wrong: dict[str, str] = {}
    for number, row in enumerate(EDITED):
        folder = tmp_path / str(number)
        folder.mkdir()
        try:
            check_obeyed(session, folder, row)
        except AssertionError as error:
            wrong[row["name"]] = str(error)
    assert wrong == {}
