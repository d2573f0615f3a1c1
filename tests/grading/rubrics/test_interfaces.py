"""What a rubric says about message, service and action types is checked against those that are installed."""

from __future__ import annotations

import random
from pathlib import Path

import pytest
from click.testing import CliRunner

from grader.cli import main
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.interfaces import Interfaces
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.message_classes import built, message_class, plain_fields
from grader.runtime.model.errors import RubricError
from grader.runtime.ros_installation import find_ros
from grader.runtime.stimuli.drawing import drawn_fields
from grader.runtime.stimuli.messages import MessageStream

GOOD = """\
schema: grader/rubric/v1
exercise: {id: stop, number: 9, title: Stop}
files: [stopper.py]
scenarios:
  - id: alone
    processes: [stopper.py]
    observe: {duration: 10 s}
    stimuli:
      - messages:
          topic: /scan
          type: sensor_msgs/msg/LaserScan
          values:
            - {range_max: 12, ranges: [1.0, .inf], header: {frame_id: laser}}
            - any_order:
                - {ranges: [0.2, .nan]}
                - in_order: [{ranges: [{between: [0.1, 0.3]}]}, {ranges: []}]
      - calls: {service: /switch, type: std_srvs/srv/SetBool, requests: [{data: true}]}
      - goal: {action: /count, type: test_msgs/action/Fibonacci, goal: {order: 5}}
criteria:
  - id: drives
    title: Drives
    points: 5
    scenario: alone
    check: {publishes: {topic: /cmd_vel, type: geometry_msgs/msg/Twist}}
  - id: speed
    title: Speed
    points: 5
    scenario: alone
    check: {field_values: {topic: /cmd_vel, values: {linear.x: 0.2, angular.z: .nan}}}
  - id: stops
    title: Stops
    points: 5
    scenario: alone
    check:
      reaction:
        input: /scan
        output: /cmd_vel
        cases: [{when: {"ranges[0]": {high: 0.5}, ranges.1: .inf}, then: {linear.x: 0}, copies: {linear.y: range_max}}]
  - id: answers
    title: Answers
    points: 5
    scenario: alone
    check: {service_response: {service: /switch, fields: {success: true}}}
  - id: counts
    title: Counts
    points: 5
    scenario: alone
    check: {action_feedback: {action: /count, grows: sequence}}
  - id: level
    title: Level
    points: 5
    scenario: alone
    check: {field_in_range: {topic: /level, field: data, low: 0, high: .inf}}
  - id: turns
    title: Turns
    points: 5
    scenario: alone
    check:
      reaction:
        input: /scan
        output: /cmd_vel
        cases:
          - when: {range_max: 12}
            formulas: {angular.z: "2 - ranges[1] * range_min"}
  - id: asks
    title: Asks
    points: 5
    scenario: alone
    check: {sends_goals: {action: /count, goals: [{order: 3}, {order: 4}], every: {order: {low: 1}}}}
"""

#: What an author may write by mistake: old text, new text, line and column, what was expected, and the hint.
MISTAKES = [
    ("LaserScan", "LazerScan", "11:17", "a message type of sensor_msgs", "`sensor_msgs/msg/LaserScan`?"),
    ("sensor_msgs", "sensor_mgs", "11:17", "an installed package", "`sensor_msgs`?"),
    ("sensor_msgs", "turtle_race", "11:17", "an installed package", "install turtle_race"),
    ("std_srvs/srv/SetBool", "std_srvs/srv/Setbool", "17:41", "a service type of std_srvs", "`std_srvs/srv/SetBool`?"),
    ("{range_max", "{rangemax", "13:16", "a field of sensor_msgs/msg/LaserScan", "`range_max`?"),
    ("frame_id", "frame", "13:61", "a field of std_msgs/msg/Header (`stamp` or `frame_id`)", "`frame_id`?"),
    ("[{ranges: [{between", "[{rages: [{between", "16:31", "a field of sensor_msgs/msg/LaserScan", "`ranges`?"),
    ("range_max: 12", "range_max: far", "13:27", "a number for `range_max`", ""),
    ("range_max: 12", "range_max: {x: 1}", "13:27", "a number for `range_max`, found a mapping with `x`", ""),
    ("[0.2, .nan]", "0.2", "15:28", "a list of numbers for `ranges`", ""),
    ("{data: true}", "{data: 1}", "17:81", "true or false for `data`", ""),
    ("{order: 5}", "{oder: 5}", "18:73", "a field of test_msgs/action/Fibonacci_Goal (`order`)", "`order`?"),
    ("{linear.x: 0.2", "{linaer.x: 0.2", "29:54", "a field of geometry_msgs/msg/Twist", "`linear.x`?"),
    ("{linear.x: 0.2", "{linear: 0.2", "29:54", "a field with a value (`linear.x`", ""),
    ('"ranges[0]"', "ranges.first", "38:25", "an index such as `ranges[0]`", ""),
    ("then: {linear.x", "then: {linear.x.y", "38:75", "no field below `x`, which is a number", "`linear.y`?"),
    (": range_max}", ": range_mx}", "38:108", "a field of sensor_msgs/msg/LaserScan", "`range_max`?"),
    ("{success: true}", "{succes: true}", "43:59", "a field of std_srvs/srv/SetBool_Response", "`success`?"),
    ("sequence}", "sequnce}", "48:54", "a field of test_msgs/action/Fibonacci_Feedback", "`sequence`?"),
    ("field: data", "field: dta", "53:52", "a field of an installed message type", "`data`?"),
    ("{angular.z: ", "{angular.w: ", "64:24", "a field of geometry_msgs/msg/Vector3", ""),
    ("* range_min", "* range_mim", "64:35", "a field of sensor_msgs/msg/LaserScan", "`range_min`?"),
    ("test_msgs/action/Fibonacci", "test_msgs/action/Fibonaci", "18:38", "an action type of test_msgs", "Fibonacci`?"),
    ("{order: 4}", "{oder: 4}", "69:64", "a field of test_msgs/action/Fibonacci_Goal (`order`)", "`order`?"),
    ("every: {order", "every: {oder", "69:84", "a field of test_msgs/action/Fibonacci_Goal (`order`)", "`order`?"),
    ("* range_min", "* range_min[0]", "64:35", "no field below `range_min`, which is a number", ""),
]


@pytest.fixture(scope="module")
def interfaces() -> Interfaces:
    """Return the types of the ROS installation that nodes use."""
    return Interfaces(find_ros().share)


@pytest.mark.breadth(5, 20)
@pytest.mark.parametrize(("old", "new", "place", "expected", "hint"), MISTAKES, ids=[new for _, new, *_ in MISTAKES])
def test_a_mistake_about_a_type_is_told_before_anything_runs(
    tmp_path: Path, interfaces: Interfaces, old: str, new: str, place: str, expected: str, hint: str
) -> None:
    """With its place and, if one is near, what was probably meant; exit code 2, and no student's file is started."""
    path = tmp_path / "r.yaml"
    path.write_text(GOOD)
    read_rubric(path, interfaces=interfaces)
    path.write_text(GOOD.replace(old, new, 1))
    read_rubric(path)  # what nobody will run needs no types
    with pytest.raises(RubricError) as caught:
        read_rubric(path, interfaces=interfaces)
    assert f"r.yaml:{place}: expected {expected}" in caught.value.message
    assert hint in caught.value.hint
    assert len(caught.value.message.splitlines()) == 1
    with pytest.raises(RubricError):
        read_exercises(GradeRequest(str(tmp_path), rubrics=(path,)))
    assert CliRunner().invoke(main.app, ["rubric", "check", str(path)]).exit_code == 2


@pytest.mark.parametrize("path", builtin_rubrics().values(), ids=builtin_rubrics())
def test_the_rubrics_that_come_with_the_grader_name_installed_types(path: Path, interfaces: Interfaces) -> None:
    """They are not checked when they are used, so they are checked here."""
    read_rubric(path, interfaces=interfaces)


def test_an_index_must_be_within_a_fixed_array(interfaces: Interfaces) -> None:
    """A covariance has 36 elements; a sequence has as many as it has."""
    assert interfaces.at_path("nav_msgs/msg/Odometry", "pose.covariance[36]") == (
        "expected an index below 36, the length of `covariance`"
    )
    assert not isinstance(interfaces.at_path("nav_msgs/msg/Odometry", "pose.covariance[35]"), str)
    assert not isinstance(interfaces.at_path("nav_msgs/msg/Path", "poses[100].pose.position.x"), str)


INT8, INT32 = "an integer from -128 to 127", "an integer from -2,147,483,648 to 2,147,483,647"
#: A type of test_msgs, the fields of a message of it, the column of what it cannot hold, and what it is told.
VALUES = [
    ("BasicTypes", "int32_value: 1.5", 29, f"{INT32} for `int32_value`, found `1.5`"),
    ("BasicTypes", "int32_value: 99999999999", 29, f"{INT32} for `int32_value`, found `99999999999`"),
    ("BasicTypes", "int32_value: .nan", 29, f"{INT32} for `int32_value`, found `NaN`"),
    ("BasicTypes", "int32_value: true", 29, f"{INT32} for `int32_value`, found `true`"),
    ("BasicTypes", "int32_value: {between: [1, 2.5]}", 43, f"{INT32} for `int32_value`, found `2.5`"),
    ("BasicTypes", "int8_value: {choose: [1, 128]}", 41, f"{INT8} for `int8_value`, found `128`"),
    ("BasicTypes", "int8_value: {between: [1, 2], text: '{}'}", 52, f"{INT8} for `int8_value`, found `{{}}`"),
    ("BasicTypes", "int8_value: -129", 28, f"{INT8} for `int8_value`, found `-129`"),
    ("BasicTypes", "uint8_value: -1", 29, "an integer from 0 to 255 for `uint8_value`, found `-1`"),
    ("BasicTypes", "char_value: 256", 28, "an integer from 0 to 255 for `char_value`, found `256`"),
    ("BasicTypes", "byte_value: 256", 28, "an integer from 0 to 255 for `byte_value`, found `256`"),
    ("BasicTypes", "byte_value: a", 28, "an integer from 0 to 255 for `byte_value`, found `a`"),
    ("BasicTypes", "uint64_value: 18446744073709551616", 30, "an integer from 0 to 18,446,744,073,709,551,615"),
    ("BasicTypes", "bool_value: 1", 28, "true or false for `bool_value`, found `1`"),
    ("BasicTypes", "float64_value: true", 31, "a number for `float64_value`, found `true`"),
    ("BasicTypes", "float32_value: 1.0e+39", 31, "a number from -3.402823466e+38 to 3.402823466e+38"),
    ("Arrays", "int8_values: [1, 2]", 29, "a list of 3 numbers for `int8_values`, found a list of 2"),
    ("Arrays", "byte_values: [1, 2, 3.5]", 36, "an integer from 0 to 255 for `byte_values`, found `3.5`"),
    ("BoundedSequences", "bool_values: [true, true, true, true]", 29, "a list of at most 3 booleans for `bool_values`"),
    ("Strings", f"bounded_string_value: {'a' * 23}", 38, "text of at most 22 characters"),
]
#: Messages whose fields hold just what they may.
FITTING = [
    ("BasicTypes", "int32_value: 2.0, int8_value: -128, uint8_value: 255, char_value: 255, byte_value: 255"),
    ("BasicTypes", "uint64_value: 18446744073709551615, float64_value: 1, float32_value: -.inf"),
    (
        "BasicTypes",
        "float32_value: {between: [1, 2.5]}, int64_value: {between: [1.0, 3]}, bool_value: {choose: [true]}",
    ),
    ("Arrays", "int8_values: [1, 2, 3], byte_values: [0, 1, 255]"),
    ("BoundedSequences", "bool_values: [true, true, true], int8_values: []"),
    ("Strings", f"bounded_string_value: {'a' * 22}, string_value: {{between: [1, 2], text: 'at {{}} m'}}"),
]


def with_message(folder: Path, type_: str, message: str) -> Path:
    """Return a rubric that sends a message of test_msgs, which is in line 13."""
    text = GOOD.replace("sensor_msgs/msg/LaserScan", f"test_msgs/msg/{type_}").partition("            - any_order")[0]
    start, _, _ = text.partition("            - {range_max")
    path = folder / "r.yaml"
    criteria = GOOD[GOOD.index("criteria:") : GOOD.index("  - id: speed")]
    path.write_text(f"{start}            - {{{message}}}\n{criteria}")
    return path


@pytest.mark.parametrize(("type_", "message", "column", "expected"), VALUES, ids=[one for _, one, *_ in VALUES])
def test_a_value_that_the_type_cannot_hold_is_told(
    tmp_path: Path, interfaces: Interfaces, type_: str, message: str, column: int, expected: str
) -> None:
    """With its range: else the submission would be suspected when it is recorded."""
    path = with_message(tmp_path, type_, message)
    with pytest.raises(RubricError) as caught:
        read_rubric(path, interfaces=interfaces)
    assert f"r.yaml:13:{column}: expected {expected}" in caught.value.message


@pytest.mark.parametrize(("type_", "message"), FITTING, ids=[one for _, one in FITTING])
def test_a_value_that_the_type_holds_is_accepted(
    tmp_path: Path, interfaces: Interfaces, type_: str, message: str
) -> None:
    """A message is made of it as it is in a recording."""
    (scenario,) = read_rubric(with_message(tmp_path, type_, message), interfaces=interfaces).scenarios
    (stimulus,) = scenario.stimuli
    assert isinstance(stimulus, MessageStream)
    drawn = drawn_fields(stimulus.values[0], random.Random(1))  # type: ignore[arg-type]
    made = built(message_class(f"test_msgs/msg/{type_}"), drawn, "here")
    assert plain_fields(made).keys() >= drawn.keys()


@pytest.mark.parametrize("content", [b"", b"{}", b'{"type_description_msg": 3}', b"\xff"])
def test_a_damaged_description_is_no_description(tmp_path: Path, content: bytes) -> None:
    """The author is told that the type is missing, and nothing else breaks."""
    folder = tmp_path / "odd_msgs" / "msg"
    folder.mkdir(parents=True)
    (folder / "Odd.json").write_bytes(content)
    assert Interfaces([tmp_path]).fields("odd_msgs/msg/Odd") is None
