"""An overview of what a recording must not believe, invent or lose: one program each, graded for real.

The classes that these programs belong to have tests of their own, beside what keeps them out.
"""

from __future__ import annotations

import io
import tarfile
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from decided import grade_until_decided
from tables import read_table

from grader.course.classroom.intake import take_in
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import SeedKey
from grader.grading.reporting.json_report import report_to_json
from grader.grading.submissions.archives import collect_archive
from grader.runtime.model.errors import SubmissionError

HERE = Path(__file__).parent / "trust"
PROGRAMS = read_table(HERE / "programs.yaml")["programs"]
KEY = SeedKey(b"a key that no submission holds, of thirty-two bytes or more")


def everything(value: object) -> Iterator[str]:
    """Yield every text and number of a report."""
    if isinstance(value, dict):
        for inner in value.values():
            yield from everything(inner)
    elif isinstance(value, list):
        for inner in value:
            yield from everything(inner)
    else:
        yield str(value)


def test_every_program_is_listed() -> None:
    """No folder is forgotten, and none is expected that is not there."""
    assert {p["folder"] for p in PROGRAMS} == {path.name for path in HERE.iterdir() if path.is_dir()}


@pytest.mark.breadth(1, 1)
@pytest.mark.ros
@pytest.mark.parametrize(
    "program",
    [
        pytest.param(
            p, id=p["folder"], marks=[getattr(pytest.mark, tier) for tier in ("long", "nightly") if p.get(tier)]
        )
        for p in PROGRAMS
    ],
)
def test_a_program_gets_what_it_is_worth(program: Mapping[str, Any]) -> None:
    """What a process says about itself is no evidence, and nothing that it did is lost."""
    clock = program.get("decided", "auto")
    request = GradeRequest(str(HERE / program["folder"]), exercises=(program["exercise"],), seed_key=KEY, clock=clock)
    report = grade_until_decided(request)
    verdicts = [v for exercise in report.exercises for v in exercise.verdicts]
    found = {v.id: v.outcome.value for v in verdicts if v.outcome.value != "met"}
    assert found == program["expected"], {v.id: v.reason for v in verdicts}
    texts = list(everything(report_to_json(report)))
    for never in program.get("never", ()):
        assert not [text for text in texts if never in text]
    assert any(program.get("says", "") in v.reason for v in verdicts)


def test_a_folder_whose_name_begins_with_a_dot_is_told(tmp_path: Path) -> None:
    """Number 17: a class is never graded without a word about one of its folders."""
    for student in ("ada", ".bob"):
        (tmp_path / "class" / student).mkdir(parents=True)
        (tmp_path / "class" / student / "velocity_publisher.py").write_text("pass\n")
    intake = take_in([tmp_path / "class"], tmp_path / "results")
    assert [entry.label for entry in intake.entries] == ["ada"]
    assert [stray for stray in intake.strays if ".bob: its name begins with a dot" in stray]


@pytest.mark.parametrize("name", ["velocity_publisher.py ", "src /velocity_publisher.py"])
def test_a_name_that_ends_in_a_blank_is_refused(name: str) -> None:
    """Number 18: like other names that some system cannot keep."""
    packed = io.BytesIO()
    with tarfile.open(fileobj=packed, mode="w") as archive:
        archive.addfile(tarfile.TarInfo(name))
    with pytest.raises(SubmissionError, match="ends in a space"):
        collect_archive(packed.getvalue(), where="ada.tar")
