"""Delivery: every format reaches its file or standard output, and partial reports only those that need them."""

from __future__ import annotations

import json
import os
from dataclasses import replace
from pathlib import Path

import pytest
from report_samples import hostile, middling, partial

from grader.grading.reporting.delivery import Output, deliver, early_delivery, prepared_outputs
from grader.grading.reporting.formats import FORMATS
from grader.grading.reporting.platforms.classroom50 import VARIABLES
from grader.runtime.model.errors import GraderError

HANDED_IN = {
    **dict.fromkeys(VARIABLES.values(), "x"),
    "ASSIGNMENT_TYPE": "group",
    "SUBMISSION_TAG": "submit/x",
    "COMMIT_DATETIME": "2026-01-31T10:00:00Z",
}


@pytest.fixture
def in_a_classroom(monkeypatch: pytest.MonkeyPatch) -> None:
    for name, value in HANDED_IN.items():
        monkeypatch.setenv(name, value)


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_is_written_to_its_file(in_a_classroom: None, tmp_path: Path, name: str) -> None:
    """Whole, in UTF-8, and for a hostile submission too."""
    path = tmp_path / "report"
    sample = replace(hostile(), path=str(tmp_path))
    deliver(sample, prepared_outputs([Output(name, path)])[:1])
    assert path.read_text(encoding="utf-8").strip()
    assert [p.name for p in tmp_path.iterdir()] == ["report"]


@pytest.mark.parametrize("name", FORMATS)
def test_every_format_can_be_printed(
    in_a_classroom: None, capfdbinary: pytest.CaptureFixture[bytes], name: str
) -> None:
    """`-o FORMAT=-` prints that one and nothing else; what programs read is in UTF-8 whatever the terminal speaks."""
    outputs = prepared_outputs([Output(name)])
    assert outputs == (Output(name),)
    deliver(replace(middling(), path="/nowhere/at/all.zip"), outputs)
    printed = capfdbinary.readouterr().out
    assert printed.decode("utf-8").strip()


def test_a_format_that_lacks_its_surroundings_is_refused_before_grading(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    """The command fails before the run if its result cannot be written."""
    for name in HANDED_IN:
        monkeypatch.delenv(name, raising=False)
    with pytest.raises(GraderError, match="classroom50: expected CLASSROOM, ASSIGNMENT"):
        prepared_outputs([Output("classroom50", tmp_path / "result.json")])


def test_only_platforms_that_end_runs_get_partial_reports(tmp_path: Path) -> None:
    """A file that others read is never a partial one."""
    others = [Output(name, tmp_path / name) for name, format_ in FORMATS.items() if not format_.written_early]
    assert early_delivery(others) is None
    assert early_delivery([Output("gradescope")]) is None  # what is printed cannot be taken back
    path = tmp_path / "results.json"
    write = early_delivery([Output("gradescope", path), Output("json", tmp_path / "r.json")])
    assert write is not None
    write(partial())
    assert json.loads(path.read_text())["extra_data"]["pending"] == ["odom_subscriber"]
    assert [p.name for p in tmp_path.iterdir()] == ["results.json"]


def test_the_whole_report_takes_the_place_of_the_partial_one(tmp_path: Path) -> None:
    """The last write wins."""
    path = tmp_path / "results.json"
    outputs = [Output("gradescope", path)]
    write = early_delivery(outputs)
    assert write is not None
    write(partial())
    deliver(middling(), outputs)
    assert json.loads(path.read_text())["extra_data"]["pending"] == []


def test_a_partial_report_that_cannot_be_written_ends_no_run(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The disk may have room again at the end; if not, the whole report says so."""

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    outputs = [Output("gradescope", tmp_path / "results.json")]
    write = early_delivery(outputs)
    assert write is not None
    write(partial())
    with pytest.raises(GraderError, match="No space left"):
        deliver(middling(), outputs)
