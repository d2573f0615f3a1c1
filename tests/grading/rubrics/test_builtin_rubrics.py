"""The rubrics that come with the grader hold the criteria and points that are promised, and editors can check them."""

from __future__ import annotations

import json
import re
from collections.abc import Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from places import ROOT
from ruamel.yaml import YAML

from grader.grading.judging.checks import CHECKS
from grader.grading.model.exercise import Exercise
from grader.grading.model.rubric_files import rubrics_in
from grader.grading.rubrics.builtin import builtin_headers, builtin_rubrics, headers_in
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.loader import read_rubric
from grader.grading.rubrics.schema import rubric_schema, schema_text
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import shortest
from grader.runtime.shipped import shipped
from grader.runtime.stimuli.recorded import RecordedStream

RUBRICS = ROOT / "rubrics"

POINTS = {
    "velocity_publisher": {
        "publishes_twist": 6,
        "rate": 10,
        "linear_velocity": 5,
        "angular_velocity": 5,
        "logging": 4,
    },
    "odom_subscriber": {"subscribes_odom": 6, "logs_position": 10, "log_period": 6, "waits_gracefully": 8},
    "two_node_communication": {
        "temperature_rate": 6,
        "temperature_range": 6,
        "logs_fan_speed": 5,
        "fan_on_above_25": 7,
        "fan_off_at_or_below_25": 7,
        "runs_together": 5,
        "bidirectional_graph": 4,
    },
    "joint_publisher": {"publishes_float64": 6, "rate": 10, "angle": 9, "log_every_10th": 5},
    "joint_subscriber": {"subscribes_joint_commands": 6, "logs_radians": 8, "logs_degrees": 8, "waits_gracefully": 8},
    "battery_service": {
        "offers_service": 3,
        "answers_many_clients": 3,
        "response_text": 4,
        "drains_half_percent": 5,
        "starts_again_at_100": 3,
        "waits_for_service": 4,
        "asks_five_times": 3,
        "goes_on_above_20": 3,
        "aborts_at_or_below_20": 3,
        "no_go_when_refused": 2,
        "no_go_when_puzzled": 2,
        "no_go_when_deserted": 1,
        "runs_together": 4,
    },
}
PROJECTS = ("joint_publisher", "joint_subscriber", "battery_service")


@cache
def exercise(name: str) -> Exercise:
    return read_rubric(builtin_rubrics()[name])


@pytest.fixture(scope="module")
def schema() -> dict[str, Any]:
    return rubric_schema()


def test_the_criteria_and_points_are_the_promised_ones() -> None:
    """Ids, points and order are fixed: other programs read them."""
    got = {name: {c.id: c.points for c in read_rubric(path).criteria} for name, path in builtin_rubrics().items()}
    assert got == POINTS
    assert [list(criteria) for criteria in got.values()] == [list(criteria) for criteria in POINTS.values()]
    assert list(got) == list(POINTS)
    assert sum(sum(criteria.values()) for name, criteria in got.items() if name not in PROJECTS) == 100
    assert sum(sum(got[name].values()) for name in PROJECTS) == 100
    assert [name for name in got if exercise(name).by_request] == list(PROJECTS)


def test_the_header_of_a_rubric_is_what_the_whole_of_it_says() -> None:
    """The scenarios need not be read to know what a rubric is about."""
    for header in builtin_headers():
        whole = read_rubric(header.path)
        assert (header.id, header.number, header.by_request) == (whole.id, whole.number, whole.by_request)


@pytest.mark.parametrize("name", list(POINTS))
def test_every_lost_criterion_has_something_to_say(name: str) -> None:
    """Each criterion has a short title and a hint of one line."""
    for criterion in exercise(name).criteria:
        assert 0 < len(criterion.title) <= 50
        assert 0 < len(criterion.hint) <= 110


def test_odometry_comes_late_and_goes_early() -> None:
    """Exercise 2 is observed for 26 s: at least 5 s of silence, 15 s of odometry and 3 s of silence.

    In 3 s, each timer of a second sees twice that the last message is older than a second.
    """
    (scenario,) = exercise("odom_subscriber").scenarios
    (stream,) = scenario.stimuli
    assert isinstance(stream, RecordedStream)
    assert shortest(stream.start_ns) == 5 * NS_PER_S
    assert shortest(stream.duration_ns) == 15 * NS_PER_S
    assert isinstance(scenario.span.duration_ns, int)
    assert scenario.span.duration_ns - stream.course_ns() >= 3 * NS_PER_S


def test_every_scripted_number_is_held_for_its_whole_time() -> None:
    """No scripted value of exercise 3 is cut off by the end of its scenario."""
    for scenario in exercise("two_node_communication").scenarios:
        for stream in scenario.stimuli:
            assert stream.course_ns() <= shortest(scenario.span.duration_ns)


def test_the_shipped_schema_is_up_to_date() -> None:
    """`python -m grader.grading.rubrics.schema > rubrics/rubric.schema.json` was run after the last change."""
    assert (RUBRICS / "rubric.schema.json").read_text(encoding="utf-8") == schema_text()


@pytest.mark.parametrize("path", rubrics_in(RUBRICS), ids=lambda path: path.parent.name)
def test_each_rubric_names_the_schema_and_fits_it(path: Path, schema: Mapping[str, Any]) -> None:
    """An editor that knows JSON Schema finds nothing wrong."""
    text = path.read_text(encoding="utf-8")
    assert text.startswith("# yaml-language-server: $schema=../rubric.schema.json\n")
    jsonschema.Draft202012Validator(schema).validate(YAML(typ="safe", pure=True).load(text))


def test_the_schema_knows_every_check_and_parameter(schema: Mapping[str, Any]) -> None:
    """Editors complete the checks with their parameters, and mark what is missing or unknown."""
    jsonschema.Draft202012Validator.check_schema(schema)
    check = schema["$defs"]["Check"]
    assert set(check["properties"]) == set(known_checks())
    assert (check["minProperties"], check["maxProperties"]) == (1, 1)
    rate = schema["$defs"][CHECKS["topic_rate"].__name__]
    assert set(rate["required"]) == {"topic", "rate", "tolerance"}
    assert "partly_tolerance" in rate["properties"]
    assert rate["additionalProperties"] is False


@pytest.mark.parametrize(
    ("old", "new"),
    [
        ("rate: 20 Hz", "rate: 20"),
        ("points: 6", "points: 0"),
        ("topic_rate:", "topic_rat:"),
        ("title: Logs", "titel: Logs"),
    ],
)
def test_the_schema_refuses_what_the_reader_refuses(old: str, new: str, schema: Mapping[str, Any]) -> None:
    """An editor marks a missing unit, points of 0, an unknown check and an unknown key."""
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8").replace(old, new, 1)
    data = YAML(typ="safe", pure=True).load(text)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.Draft202012Validator(schema).validate(data)


def defaults_in(node: Any) -> Iterator[Any]:
    if isinstance(node, dict):
        if "default" in node and "type" in node:
            yield node["default"], node
        for value in node.values():
            yield from defaults_in(value)
    elif isinstance(node, list):
        for value in node:
            yield from defaults_in(value)


def test_every_default_in_the_schema_could_be_written(schema: Mapping[str, Any]) -> None:
    """An editor never completes nanoseconds where `60 s` belongs."""
    found = list(defaults_in(schema))
    assert found
    for default, node in found:
        jsonschema.Draft202012Validator({"$defs": schema["$defs"], **node}).validate(default)


def test_the_schema_is_plain_json(schema: Mapping[str, Any]) -> None:
    """The text of the schema reads back as the schema."""
    assert json.loads(schema_text()) == schema


def test_rubrics_are_found_in_a_wheel_and_ordered_by_number(tmp_path: Path) -> None:
    """Beside the package's code, exercise 2 before exercise 10."""
    rubrics = tmp_path / "grader" / "shipped" / "rubrics"
    rubrics.mkdir(parents=True)
    text = (RUBRICS / "exercise_1" / "rubric.yaml").read_text(encoding="utf-8")
    for number, name in (("10", "a"), ("2", "c"), ("P1", "b")):
        changed = text.replace('number: "1"', f'number: "{number}"').replace("id: velocity_publisher", f"id: {name}")
        (rubrics / name).mkdir()
        (rubrics / name / "rubric.yaml").write_text(changed, encoding="utf-8")
    headers = headers_in(shipped("rubrics", tmp_path / "grader"))
    assert [(header.id, header.path) for header in headers] == [
        (name, rubrics / name / "rubric.yaml") for name in "cab"
    ]


def test_every_criterion_says_which_part_of_the_chapter_asks_for_it() -> None:
    """By the exercise's number and that of the criterion or task there; by the project's, and a name in its listing."""
    for path in builtin_rubrics().values():
        exercise = read_rubric(path)
        task = rf"Exercise {exercise.number}, (acceptance criterion|task) \d"
        begin = rf"Part 2, {exercise.number}, \w" if exercise.id in PROJECTS else task
        assert [c.id for c in exercise.criteria if not re.match(begin, c.chapter)] == []


_ROW = re.compile(r"^\| `(\w+)` \| ([0-9.]+) \|", re.MULTILINE)


@pytest.mark.parametrize("path", rubrics_in(RUBRICS), ids=lambda path: path.parent.name)
def test_each_exercise_is_described(path: Path) -> None:
    """Its README has its number, its files, and the criteria with their points, in order."""
    text, described = path.with_name("README.md").read_text(encoding="utf-8"), read_rubric(path)
    assert [(id_, float(points)) for id_, points in _ROW.findall(text)] == [
        (c.id, float(c.points)) for c in described.criteria
    ]
    assert f"{sum(c.points for c in described.criteria)} points" in text
    assert all(f"`{file}`" in text for file in described.files)


def test_what_students_read_is_described_in_other_words() -> None:
    """No six words in a row of a README are those of the chapter."""
    chapter = RUBRICS.parents[1] / "shared" / "chapter_1_2.txt"
    if not chapter.exists():
        pytest.skip("the text of the chapter is not here")
    theirs = _runs(chapter.read_text(encoding="utf-8"))
    ours = {path.parent.name: _runs(path.read_text(encoding="utf-8")) & theirs for path in RUBRICS.glob("*/README.md")}
    assert {name: shared for name, shared in ours.items() if shared} == {}


def _runs(text: str) -> set[tuple[str, ...]]:
    words = re.findall(r"\w+", text.casefold())
    return {tuple(words[n : n + 6]) for n in range(len(words) - 5)}
