"""What was recorded of every test submission, judged again without a node: every outcome, text and byte."""

from __future__ import annotations

from pathlib import Path

import pytest
from archive import charted, judged, outcomes, outdated, read_archive, recordings, told, write_archive
from sample_folders import expected, golden, golden_charts

from grader.grading.reporting.html.render import render_html
from grader.grading.reporting.json_report import dumps

AGAIN = "python tests/recorded/record.py"


def test_every_submission_is_recorded() -> None:
    """A new folder is recorded before it can be compared with anything."""
    missing = set(expected()) - set(recordings())
    assert not missing, f"{AGAIN} {' '.join(sorted(missing))}"
    assert set(recordings()) == set(expected())


@pytest.mark.breadth(45, 600)
@pytest.mark.parametrize("folder", expected())
def test_a_recording_is_judged_as_ever(folder: str) -> None:
    """The outcome of every criterion, what the student reads, and the whole report."""
    recorded = recordings()[folder]
    assert not outdated(recorded), f"{AGAIN} {folder}"
    report = judged(recorded)
    assert outcomes(report) == expected()[folder]["expected"]
    assert told(report) == golden().get(folder, {})
    assert dumps(report) == recorded.report.decode(), f"if the new report is the better one: {AGAIN} --judge"


@pytest.mark.parametrize("folder", golden_charts())
def test_a_recording_is_drawn_as_ever(folder: str) -> None:
    """What each chart shows, and twice the same page, byte for byte."""
    report = judged(recordings()[folder])
    assert charted(report) == golden_charts()[folder], f"if the new charts are the better ones: {AGAIN} --judge"
    assert render_html(report) == render_html(judged(recordings()[folder]))


@pytest.mark.long
def test_the_archive_is_written_as_it_was_read(tmp_path: Path) -> None:
    """The same recordings, the same bytes."""
    some = {folder: one for folder, one in recordings().items() if folder.startswith("broken/")}
    for name in ("one", "two"):
        write_archive(some, tmp_path / name)
    assert (tmp_path / "one").read_bytes() == (tmp_path / "two").read_bytes()
    assert read_archive(tmp_path / "one") == some
