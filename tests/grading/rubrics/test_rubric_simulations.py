"""Simulations in a rubric: their parameters are read strictly, and an author's mistake is told before anything runs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

import pytest

from grader.course.packaging import Chosen, classroom50
from grader.grading.app.interfaces import known_interfaces
from grader.grading.rubrics.loader import read_rubric, side_files
from grader.grading.rubrics.schema import rubric_schema
from grader.runtime.model.errors import RubricError
from grader.runtime.model.scenario import Between, Choose, FieldSpec, Scenario
from grader.runtime.stimuli.simulation import Simulated

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: follow, number: "1", title: Follow}
files: [follow.py]
simulations: [world.py]
scenarios:
  - id: alone
    processes: [follow.py]
    observe: {duration: 5 s}
    stimuli:
      - simulation: {echo: {gain: 2.0}}
criteria:
  - id: lives
    title: Lives
    points: 1
    scenario: alone
    hint: none
    check: {no_fault: {}}
"""
WORLD = """\
from dataclasses import dataclass, field

from grader.runtime.simulation import Simulation


@dataclass
class Echo(Simulation):
    \"\"\"Says again what it hears.

    Attributes:
        gain: What numbers are multiplied by.
    \"\"\"

    gain: float = 1.0
    count: int = 1
    loud: bool = False
    voice: str = "low"
    _heard: int = field(default=0, init=False)

    def publishes(self):
        return {"/echo": "std_msgs/msg/Float32"}

    def hears(self):
        return {"/said": "std_msgs/msg/Float32"}

    def step(self, now):
        yield "/echo", {"data": self.gain}


SIMULATIONS = {"echo": Echo}
"""


def written(folder: Path, rubric: str = RUBRIC, world: str = WORLD) -> Path:
    (folder / "world.py").write_text(world, encoding="utf-8")
    (folder / "follow.yaml").write_text(rubric, encoding="utf-8")
    return folder / "follow.yaml"


def scenario(folder: Path, rubric: str = RUBRIC, world: str = WORLD) -> Scenario:
    (found,) = read_rubric(written(folder, rubric, world)).scenarios
    return found


def refusal(folder: Path, rubric: str = RUBRIC, world: str = WORLD) -> str:
    with pytest.raises(RubricError) as error:
        read_rubric(written(folder, rubric, world))
    return f"{error.value.message} {error.value.hint}"


def with_parameters(text: str) -> str:
    return RUBRIC.replace("{gain: 2.0}", text)


def test_a_simulation_of_ones_own_is_a_stimulus_with_the_text_of_its_file(tmp_path: Path) -> None:
    """Every parameter may be drawn; those left out keep their defaults."""
    drawn = "{gain: {between: [0.5, 1.5]}, count: {between: [1, 3]}, loud: {choose: [true, false]}, voice: high}"
    (stimulus,) = scenario(tmp_path, with_parameters(drawn)).stimuli
    parameters: Mapping[str, FieldSpec] = {
        "gain": Between(0.5, 1.5),
        "count": Between(1, 3),
        "loud": Choose((True, False)),
        "voice": "high",
    }
    assert stimulus == Simulated("echo", parameters, "world.py", WORLD.encode())


def test_a_built_in_simulation_needs_no_file(tmp_path: Path) -> None:
    """And its durations have units."""
    text = "- simulation: {differential_drive: {period: 20 ms, odometry: /odometry}}"
    rubric = RUBRIC.replace("simulations: [world.py]\n", "").replace("- simulation: {echo: {gain: 2.0}}", text)
    (stimulus,) = scenario(tmp_path, rubric).stimuli
    assert stimulus == Simulated("differential_drive", {"period": 20_000_000, "odometry": "/odometry"})


def test_the_schema_explains_each_parameter() -> None:
    """Also one that a base class explains."""
    shapes = rubric_schema()["$defs"]
    meanings = {k: v.get("description") for k, v in shapes["DifferentialDriveSimulation"]["properties"].items()}
    assert meanings["x"] == "Start position, in m."
    assert meanings["max_speed"] == "Largest speed, forward or backward, in m/s."


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("{gain: 2.0}", "{gian: 2.0}", "10:29: expected `gain`, `count`, `loud` or `voice` in `echo`, found `gian`"),
        ("{gain: 2.0}", "{gain: much}", "10:35: expected a number"),
        ("{gain: 2.0}", "{gain: {choose: [low, high]}}", "expected numbers to draw from"),
        ("{gain: 2.0}", "{count: {between: [0.5, 1.5]}}", "expected whole numbers to draw from"),
        ("{gain: 2.0}", "{count: {choose: [1.5]}}", "expected whole numbers to draw from"),
        ("{gain: 2.0}", "{loud: {between: [0, 1]}}", "expected true and false to draw from"),
        ("{gain: 2.0}", "{voice: {between: [0, 1]}}", "expected texts to draw from"),
        ("{gain: 2.0}", "{_heard: 1}", "expected `gain`, `count`, `loud` or `voice`"),
        ("{echo:", "{ehco:", "10:22: expected"),
        ("[world.py]", "[word.py]", "simulations: word.py: expected a file beside the rubric, found nothing there"),
        ("[world.py]", "[../world.py]", "4:15: expected a Python file in the rubric's folder"),
        (
            "    stimuli:\n",
            "    stimuli:\n      - messages: {topic: /echo, type: std_msgs/msg/String, values: [{}]}\n",
            "11:22: expected topics and services that no other stimulus has, found `/echo` again",
        ),
        (
            "    stimuli:\n",
            "    stimuli:\n      - simulation: {echo: {}}\n",
            "11:22: expected topics and services that no other stimulus has, found `/echo` again",
        ),
    ],
)
def test_a_mistake_in_the_rubric_is_told_with_its_place(tmp_path: Path, old: str, new: str, told: str) -> None:
    """Names, types, and topics that somebody else publishes on."""
    assert told in refusal(tmp_path, RUBRIC.replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("SIMULATIONS = {", "SIMULATIONS = [", "world.py:30: expected a file that can be imported, found SyntaxError"),
        ('SIMULATIONS = {"echo": Echo}', "", "expected a table SIMULATIONS"),
        ('{"echo": Echo}', '{"turtle": Echo}', "expected a new name, found `turtle`, which is taken"),
        ('{"echo": Echo}', '{"echo": Simulation}', "expected a dataclass, found another class"),
        ('{"echo": Echo}', '{"echo": dataclass}', "expected a class derived from grader.api.Simulation"),
        ("count: int = 1", "count: bytes = b''", "no rubric syntax for a parameter annotated"),
        ("self.gain}", "1 / (self.gain - 2)}", "world.py:27: the simulation `echo` failed: ZeroDivisionError"),
        ("    _heard", "    period: int = 5\n    _heard", "has a period of 5 ns, expected at least 1 ms"),
        ('yield "/echo"', 'yield "/ecko"', "publishes ('/ecko', {'data': 2.0})"),
        ('yield "/echo", {"data": self.gain}', 'return "/echo"', "publishes /, expected one of its topics"),
        ('yield "/echo", {"data": self.gain}', "return 5", "world.py"),
        (
            'return {"/echo": "std_msgs/msg/Float32"}',
            "return None",
            "world.py:20: the simulation `echo` failed: TypeErr",
        ),
    ],
)
def test_a_mistake_in_the_file_is_told_before_anything_runs(tmp_path: Path, old: str, new: str, told: str) -> None:
    """The first steps of each simulation are tried when the rubric is read."""
    assert told in refusal(tmp_path, world=WORLD.replace(old, new))


def test_the_file_belongs_to_the_rubric(tmp_path: Path) -> None:
    """Its digest covers it, and packages for platforms hold it; one that is also a file of checks counts once."""
    path = written(tmp_path)
    before = read_rubric(path).digest
    assert [file.name for file in side_files(path)] == ["world.py"]
    assert classroom50(Chosen(rubrics=(path,)))["rubrics/1/world.py"] == WORLD.encode()
    written(tmp_path, world=WORLD.replace("1.0", "1.5"))
    assert read_rubric(path).digest != before


@pytest.mark.parametrize(
    ("fields", "told"),
    [
        ('{"data": "a0"}', "what it publishes on /echo has `a0` in `data`, expected a number"),
        ('{"data": [1.0]}', "in `data`, expected a number"),
        ('{"data": True}', "in `data`, expected a number"),
        ('{"data": {"x": 1}}', "in `data`, expected a number"),
    ],
)
def test_a_value_that_does_not_fit_its_field_is_told(tmp_path: Path, fields: str, told: str) -> None:
    """Before a student's file runs; where types are known."""
    known = known_interfaces()
    if known is None:
        pytest.skip("needs the descriptions of message types, which no ROS here has")
    path = written(tmp_path, world=WORLD.replace('{"data": self.gain}', fields))
    with pytest.raises(RubricError) as error:
        read_rubric(path, interfaces=known)
    assert told in error.value.message


@pytest.mark.parametrize(
    ("type_", "fields", "told"),
    [
        ("std_msgs/msg/Int8", '{"data": 128}', "has `128` in `data`, expected an integer from -128 to 127"),
        ("std_msgs/msg/UInt8MultiArray", '{"data": [1, 2.5]}', "`2.5` in `data`, expected an integer from 0 to 255"),
        (
            "geometry_msgs/msg/PoseWithCovariance",
            '{"covariance": [0.0]}',
            "a list of 1 in `covariance`, expected a list",
        ),
    ],
)
def test_a_number_or_a_count_outside_of_its_field_is_told(tmp_path: Path, type_: str, fields: str, told: str) -> None:
    """As for the values that a rubric writes."""
    world = WORLD.replace("std_msgs/msg/Float32", type_).replace('{"data": self.gain}', fields)
    with pytest.raises(RubricError) as error:
        read_rubric(written(tmp_path, world=world), interfaces=known_interfaces())
    assert told in error.value.message


def test_numbers_in_lists_and_nested_messages_fit(tmp_path: Path) -> None:
    """As a scanner publishes them."""
    world = WORLD.replace("std_msgs/msg/Float32", "sensor_msgs/msg/LaserScan")
    good = '{"header": {"frame_id": "laser"}, "angle_min": -1, "ranges": [1.0, float("inf"), 2]}'
    path = written(tmp_path, world=world.replace('{"data": self.gain}', good))
    assert read_rubric(path, interfaces=known_interfaces()).id == "follow"
    for wrong, told in (('"angle_min": "a0"', "`a0` in `angle_min`"), ('"ranges": [1.0, "far"]', "`far` in `ranges`")):
        bad = good.replace('"angle_min": -1', wrong) if "angle" in wrong else '{"ranges": [1.0, "far"]}'
        path = written(tmp_path, world=world.replace('{"data": self.gain}', bad))
        if known_interfaces() is not None:
            with pytest.raises(RubricError, match=told):
                read_rubric(path, interfaces=known_interfaces())
