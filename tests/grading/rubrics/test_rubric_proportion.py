"""Credit in proportion in rubrics: what can be written, each mistake with its place, and the examples of pages."""

from __future__ import annotations

import re
from pathlib import Path

import pytest
from click.testing import CliRunner
from places import ROOT
from ruamel.yaml import YAML

from grader.cli import main
from grader.grading.app.explain import explain_name
from grader.grading.model.measures import Scale
from grader.grading.model.report import CheckExplanation
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: rates, number: 1, title: Rates}
files: [node.py]
scenarios:
  - {id: alone, processes: [node.py], observe: {duration: 2 s}DRAWS}
criteria:
  - id: gaps
    title: Gaps
    points: 5
    scenario: alone
    check:
      CHECK
    hint: publish from a timer
"""
PERIOD = "period: {topic: /a, %s}"


def rubric(folder: Path, check: str, draws: str = "") -> Path:
    """Write a rubric with a check."""
    path = folder / "r.yaml"
    path.write_text(RUBRIC.replace("CHECK", check).replace("DRAWS", draws), encoding="utf-8")
    return path


@pytest.mark.parametrize(
    ("check", "scale"),
    [
        (PERIOD % "full: 200 ms, none: 1 s", Scale(0.2, 1.0, "worst")),
        (PERIOD % "full: 0 s, none: 1 s, combine: mean", Scale(0.0, 1.0, "mean")),
        ("topic_rate: {topic: /a, rate: 10 Hz, tolerance: 1 Hz, full: 0.1 Hz, none: 5 Hz}", Scale(0.1, 5.0)),
        ("silence: {topic: /a, full: 0, none: 12, combine: median}", Scale(0.0, 12.0, "median")),
        (PERIOD % "largest: 1 s", None),
    ],
)
def test_limits_are_read_in_the_unit_of_the_measure(tmp_path: Path, check: str, scale: Scale | None) -> None:
    """Times with a unit, and other numbers without."""
    (criterion,) = read_rubric(rubric(tmp_path, check)).criteria
    assert criterion.scale == scale


@pytest.mark.parametrize(
    ("check", "message"),
    [
        (
            PERIOD % "full: 1 s, none: 200 ms",
            "12:44: expected a `none` above `full`, because less is better: time between two messages, found none: 2",
        ),
        (PERIOD % "full: 1 s, none: 1 s", "12:44: expected a `none` that differs from `full`, found none: 1 s"),
        (PERIOD % "full: 1 s", "12:33: expected `full` and `none` together, found full: 1 s"),
        (PERIOD % "combine: mean", "12:36: expected `full` and `none` together, found combine: mean"),
        (PERIOD % "full: 1, none: 2 s", "expected a duration with its unit, such as `10 s`, found `1`"),
        (PERIOD % "full: -1, none: 2 s", "expected a duration of at least 0, found `-1`"),
        (PERIOD % "full: 1 s, none: .inf", "expected a duration such as `10 s`, found `Infinity`"),
        (PERIOD % "full: 1 s, none: .nan", "expected a duration such as `10 s`, found `NaN`"),
        (PERIOD % "full: 1 s, none: 2 s, combine: best", "12:58: expected `worst`, `mean` or `median`, found `best`"),
        ("silence: {topic: /a, full: 0 s, none: 1}", "expected a number, found `0 s`"),
        ("qos: {topic: /a, end: publisher, reliability: reliable, full: 0, none: 1}", "found `full`"),
    ],
)
def test_a_mistake_is_told_with_its_place(tmp_path: Path, check: str, message: str) -> None:
    """Limits on the wrong side, of another unit, alone, and of a check that measures nothing."""
    with pytest.raises(RubricError) as raised:
        read_rubric(rubric(tmp_path, check))
    assert message in raised.value.message


def test_rubric_check_tells_it_too(tmp_path: Path) -> None:
    """With an exit code for scripts."""
    path = rubric(tmp_path, PERIOD % "full: 1 s, none: 200 ms")
    done = CliRunner().invoke(main.app, ["rubric", "check", str(path)])
    assert done.exit_code == 2
    assert "because less is better" in done.output


def test_each_draw_is_a_recording_of_its_own(tmp_path: Path) -> None:
    """After all others, so that what was drawn for these stays."""
    exercise = read_rubric(rubric(tmp_path, PERIOD % "full: 1 s, none: 2 s", ", draws: 3"))
    assert [s.id for s in exercise.scenarios] == ["alone", "alone_draw_2", "alone_draw_3"]
    assert exercise.draws == {"alone": ("alone_draw_2", "alone_draw_3")}
    assert exercise.recordings_of(exercise.criteria[0]) == ("alone", "alone_draw_2", "alone_draw_3")
    done = CliRunner().invoke(main.app, ["rubric", "check", str(tmp_path / "r.yaml")])
    assert (done.exit_code, len(done.output.splitlines())) == (0, 1), done.output


@pytest.mark.parametrize("draws", ["0", "21", "2.5", "many", "true"])
def test_an_odd_number_of_draws_is_refused(tmp_path: Path, draws: str) -> None:
    """From 1 to 20."""
    with pytest.raises(RubricError, match="expected a whole number"):
        read_rubric(rubric(tmp_path, PERIOD % "largest: 1 s", f", draws: {draws}"))


def test_no_scenario_has_the_name_of_a_draw(tmp_path: Path) -> None:
    """The two would share a recording."""
    path = rubric(tmp_path, PERIOD % "largest: 1 s", ", draws: 2")
    again = "  - {id: alone_draw_2, processes: [node.py], observe: {duration: 2 s}}\ncriteria:"
    path.write_text(path.read_text(encoding="utf-8").replace("criteria:", again), encoding="utf-8")
    with pytest.raises(RubricError, match="expected another id, found `alone_draw_2`, the name of a further draw"):
        read_rubric(path)


def test_the_example_of_the_page_can_be_used(tmp_path: Path) -> None:
    """In the rubric of the example that it belongs to."""
    page = (ROOT / "docs" / "reference" / "rubric.md").read_text(encoding="utf-8")
    part = page.partition("## Credit in proportion")[2]
    (block,) = re.findall(r"```yaml\n(.*?)```", part.partition("## Grammar")[0], re.DOTALL)
    text = (ROOT / "examples" / "go_to_goal" / "go_to_goal.yaml").read_text(encoding="utf-8")
    (tmp_path / "r.yaml").write_text(text + block, encoding="utf-8")
    exercise = read_rubric(tmp_path / "r.yaml")
    assert exercise.criteria[-1].scale == Scale(6.0, 18.0, "mean")
    assert YAML(typ="safe").load(block)[0]["id"] == "quick"


def test_explain_says_what_is_measured(tmp_path: Path) -> None:
    """Of a check and of a criterion."""
    path = rubric(tmp_path, PERIOD % "full: 200 ms, none: 1 s")
    (check,) = explain_name("period")
    assert isinstance(check, CheckExplanation)
    told = {p.name: (p.value, p.meaning) for p in check.parameters}
    assert told["full"] == (
        "none",
        "The time between two messages in s that earns full points; numbers up to `none` earn a share in proportion.",
    )
    (criterion,) = explain_name("rates/gaps", (path,))
    written = {p.name: p.value for p in criterion.parameters}
    assert (written["full"], written["none"], written["combine"]) == ("0.2 s", "1 s", "worst")
