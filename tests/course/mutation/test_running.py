"""Self-tests as they are run: what is chosen without nodes, and the whole with real nodes."""

from __future__ import annotations

import json
import sys
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner

from grader.cli.main import app
from grader.course.mutation.operators.program import Candidate
from grader.course.mutation.running import SelftestOptions, _sampled, _sources, _without_recordings, selftest
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import RubricError

#: Mutants of each of our rubrics in this test; `grade selftest rubrics/*/` by hand runs them all. Of a rubric with
#: many scenarios fewer are tried, for each is recorded in most of them.
SAMPLE, SAMPLE_OF_MANY, MANY = 4, 3, 4
#: The rubric that is not left to the nightly run.
USUAL = ("velocity_publisher",)


def candidates() -> list[Candidate]:
    """Return twenty changed programs of four operators."""
    return [Candidate(f"a.py:{n}:{n % 4}:x", "a.py", str(n % 4), "") for n in range(20)]


def test_a_sample_is_spread_over_the_operators() -> None:
    """One of each kind comes before a second of any, in the order of the whole."""
    sample = _sampled(candidates(), 6, 0)
    assert len(sample) == 6
    assert {candidate.operator for candidate in sample} == {"0", "1", "2", "3"}
    assert sample == sorted(sample, key=candidates().index)


def test_a_sample_repeats() -> None:
    """The same seed draws the same mutants, another one others."""
    assert _sampled(candidates(), 6, 1) == _sampled(candidates(), 6, 1)
    assert _sampled(candidates(), 6, 1) != _sampled(candidates(), 6, 2)
    assert _sampled(candidates(), None, 1) == candidates()


def test_a_rubric_without_a_reference_is_refused(tmp_path: Path) -> None:
    """Before anything is started."""
    rubric = tmp_path / "mine.yaml"
    rubric.write_bytes(builtin_rubrics()["velocity_publisher"].read_bytes())
    with pytest.raises(RubricError, match="expected a reference solution") as error:
        next(selftest([rubric], SelftestOptions(), lambda step: None))
    assert "mine.selftest.yaml" in error.value.hint


def test_a_reference_that_cannot_be_read_is_refused(tmp_path: Path) -> None:
    """With its place; nothing has been run by then."""
    (tmp_path / "velocity_publisher.py").write_text("a = 1\nb = (\n", encoding="utf-8")
    exercise = read_rubric(builtin_rubrics()["velocity_publisher"])
    (tmp_path / "staged").mkdir()
    reference = stage_submission(str(tmp_path), exercise.files, tmp_path / "staged")
    with pytest.raises(RubricError, match=r"velocity_publisher.py:\d+: expected a program that libcst can read"):
        _sources(reference, exercise)
    with pytest.raises(RubricError, match=r"expected fan_controller.py of velocity_publisher in it, found none"):
        _sources(reference, replace(exercise, files=("fan_controller.py",)))


def graded(*arguments: Path | str | int) -> tuple[int, Any]:
    """Return the exit code of `grade selftest`, and what it printed as JSON."""
    result = CliRunner().invoke(app, ["selftest", *map(str, arguments), "--json", "--no-progress"])
    return result.exit_code, json.loads(result.stdout) if result.stdout.startswith("{") else result.output


def test_without_libcst_the_command_says_what_to_install(monkeypatch: pytest.MonkeyPatch) -> None:
    """It comes with an extra, for authors only."""
    monkeypatch.setitem(sys.modules, "libcst", None)
    code, said = graded("any.yaml")
    assert code == 2
    assert "expected the package libcst of the extra 'authors', found none" in said
    assert f"{sys.executable} -m pip install 'libcst<2,>=1.8.4'" in said


def test_notes_are_no_rubrics() -> None:
    """A pattern of the shell may name them beside their rubric, but not alone."""
    notes = builtin_rubrics()["velocity_publisher"].with_name("selftest.yaml")
    code, said = graded(notes)
    assert code == 2
    assert "name rubric.yaml" in said


@pytest.mark.long
@pytest.mark.ros
@pytest.mark.parametrize(
    "rubric",
    [
        pytest.param(path, id=exercise, marks=[] if exercise in USUAL else pytest.mark.nightly)
        for exercise, path in builtin_rubrics().items()
    ],
)
def test_our_rubrics_notice_what_students_do_wrong(rubric: Any) -> None:
    """No survivor of the sample is unexplained, no variant is marked down, the template has its baseline."""
    sample = SAMPLE if len(read_rubric(rubric).scenarios) < MANY else SAMPLE_OF_MANY
    code, data = graded(rubric, "--sample", sample, "--seed", 7)
    (tested,) = data["rubrics"]
    assert [m["change"] for m in tested["mutants"] if m["fate"] == "survived" and not m["because"]] == []
    assert [v["id"] for v in tested["variants"] if v["fate"] != "survived" and not v["because"]] == []
    assert tested["template"]["score"] == tested["template_expected"]
    assert len(tested["mutants"]) == sample
    assert code == 0


HOLED = """\
schema: grader/rubric/v1
exercise: {id: holed, number: "1", title: Holed, required: true}
files: [velocity_publisher.py]
scenarios:
  - {id: alone, processes: [velocity_publisher.py], observe: {duration: 10 s}}
criteria:
  - id: publishes
    title: Publishes
    points: 1
    scenario: alone
    check: {publishes: {topic: /cmd_vel, type: geometry_msgs/msg/Twist}}
"""


@pytest.mark.long
@pytest.mark.ros
def test_a_hole_in_a_rubric_is_found(tmp_path: Path) -> None:
    """A rubric that asks for a publisher only lets ten times the period survive, and notices a misspelt topic."""
    rubric = tmp_path / "holed.yaml"
    rubric.write_text(HOLED, encoding="utf-8")
    reference = builtin_rubrics()["velocity_publisher"].parents[2] / "reference_solutions"
    code, data = graded(rubric, "--reference", reference, "--only", "*:period:*[*] 10")
    (tested,) = data["rubrics"]
    assert [(m["fate"], m["change"].split("=>")[1].strip()) for m in tested["mutants"]] == [
        ("survived", "self.create_timer((1 / RATE_HZ) * 10, self.send)"),
    ]
    assert (code, tested["passed"], tested["template"]) == (1, False, None)


BAGS = """\
schema: grader/rubric/v1
exercise: {id: square, number: 1, title: A square}
FILES
scenarios:
  - {id: drive, handed_in: {bag: "*.mcap"}}
SCENARIOS
criteria:
  - {id: odom, title: O, points: 5, scenario: drive, check: {publishes: {topic: /a, type: std_msgs/msg/String}}}
"""
RUNS = "  - {id: speed, title: S, points: 5, scenario: alone, needs: [odom], check: {no_fault: {process: a.py}}}\n"


def test_what_recordings_of_students_decide_is_left_out_with_the_reason(tmp_path: Path) -> None:
    path = tmp_path / "r.yaml"
    alone = "  - {id: alone, processes: [a.py], observe: {duration: 1 s}}"
    path.write_text(BAGS.replace("FILES", "files: [a.py]").replace("SCENARIOS", alone) + RUNS)
    exercise, left_out = _without_recordings(path, read_rubric(path))
    assert [(criterion.id, criterion.needs) for criterion in exercise.criteria] == [("speed", ())]
    assert [scenario.id for scenario in exercise.scenarios] == ["alone"]
    assert left_out == {"odom": "a recording that students hand in decides it, and no change of a program alters that"}


def test_a_rubric_of_recordings_alone_has_nothing_to_test(tmp_path: Path) -> None:
    path = tmp_path / "r.yaml"
    path.write_text(BAGS.replace("FILES\n", "").replace("SCENARIOS\n", ""))
    with pytest.raises(RubricError, match="found only some about recordings that students hand in") as refused:
        next(selftest([path], SelftestOptions(), lambda step: None))
    assert refused.value.hint == "no program can be changed to test these: grade a few recordings instead"
