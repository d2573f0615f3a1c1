"""Skeletons of rubrics: what is asked of a reference that did this or that, and that the reference meets all of it."""

from __future__ import annotations

import json
import math
import random
import subprocess
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from places import GRADE, ROOT
from ruamel.yaml import YAML

from grader.cli import main
from grader.course.authoring.checking import check_rubric
from grader.course.authoring.questions import Seen, questions
from grader.course.authoring.skeleton import Draft, DraftCriterion, DraftQuantity, DraftStimulus, as_id, rubric_text
from grader.course.authoring.starting import stimuli_for
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.trace import Offer
from grader.testing import TraceBuilder

FLOAT = "std_msgs/msg/Float32"
POSE = "geometry_msgs/msg/PoseStamped"
TRIGGER = "std_srvs/srv/Trigger"


def asked(builder: TraceBuilder, alone: TraceBuilder | None = None) -> dict[str, tuple[str, dict[str, Any]]]:
    """Return check and parameters of each row for what a builder's node did."""
    trace = builder.trace()
    seen = Seen(alone.trace() if alone else trace, trace, ("pump.py",), 9.0)
    return {row.id: (row.check, dict(row.parameters)) for row in questions(seen)}


def pump(**changes: Any) -> TraceBuilder:
    return TraceBuilder("pump.py", "/pump", **changes)


def test_a_steady_topic_is_asked_for_its_rate_and_its_constant_fields() -> None:
    """With the measured rate, 5 % of it for all points and 10 % for half of them."""
    value = {"header": {"stamp": {"sec": 5, "nanosec": 1}}, "pose": {"position": {"x": 0.5, "y": 0.0}}}
    rows = asked(pump().messages("/goal", POSE, value, rate_hz=20))
    assert rows["publishes_goal"] == ("publishes", {"topic": "/goal", "type": POSE})
    check, parameters = rows["goal_rate"]
    assert check == "topic_rate"
    assert {k: getattr(v, "text", v) for k, v in parameters.items()} == {
        "topic": "/goal",
        "rate": "20 Hz",
        "tolerance": "1 Hz",
        "partly_tolerance": "2 Hz",
        "window": "9 s",
    }
    values = {"pose.position.x": 0.5, "pose.position.y": 0.0}
    assert rows["goal_values"] == ("field_values", {"topic": "/goal", "values": values})


@pytest.mark.parametrize(
    ("low", "high", "bounds"),
    [(20.3, 29.8, (20, 30)), (-0.99, 0.98, (-1, 1)), (12360.1, 12361.9, (12360, 12362)), (0.12, 0.18, (0.12, 0.18))],
)
def test_a_field_that_varies_is_asked_for_a_round_range(low: float, high: float, bounds: tuple[float, float]) -> None:
    """As round as the range is wide, and never narrower than what was seen."""
    draw = random.Random(3)
    numbers = [low, high, *(draw.uniform(low, high) for _ in range(50))]
    rows = asked(pump().messages("/level", FLOAT, lambda n: {"data": numbers[n % 52]}, rate_hz=10))
    check, parameters = rows["level_data_random"]
    assert (check, parameters["low"], parameters["high"]) == ("random_in_range", *map(pytest.approx, bounds))
    assert parameters["low"] <= low
    assert parameters["high"] >= high


def test_a_text_that_never_changes_is_asked_for() -> None:
    """By its path; one that changes or is empty is not."""
    frames = pump().messages("/goal", POSE, {"header": {"frame_id": "map"}, "note": ""}, rate_hz=10)
    assert asked(frames)["goal_texts"] == ("field_equal", {"topic": "/goal", "fields": {"header.frame_id": "map"}})
    assert "goal_texts" not in asked(pump().messages("/goal", POSE, lambda n: {"note": f"{n}"}, rate_hz=10))


def test_bursts_and_single_messages_have_no_rate() -> None:
    """No number is made up for what has none."""
    builder = pump()
    for t_s in (0.1, 0.11, 0.12, 4.0, 4.01, 9.0):
        builder.message(t_s, "/level", FLOAT, {"data": 1.0})
    assert "level_rate" not in asked(builder)
    assert "level_rate" not in asked(pump().message(1.0, "/level", FLOAT, {"data": 1.0}))


def test_an_answer_is_asked_for_no_rate() -> None:
    """What is published only when something comes in has the stimulus's rate, not one of its own."""
    silent = pump().subscription("/level", FLOAT)
    driven = pump().subscription("/level", FLOAT).messages("/alarm", FLOAT, {"data": 1.0}, rate_hz=5)
    rows = asked(driven.delivery(0.1, "/level", FLOAT, {"data": 3.0}), alone=silent)
    assert "alarm_rate" not in rows
    check, parameters = rows["alarm_reaction"]
    assert (check, parameters["input"], parameters["output"]) == ("reaction", "/level", "/alarm")
    assert rows["subscribes_level"] == ("subscribes", {"topic": "/level", "type": FLOAT})


def test_services_logs_and_calls_are_asked_for() -> None:
    """Each with what was seen of it."""
    builder = pump().server("/empty", TRIGGER).client("/fill", TRIGGER).log(1, "pumping")
    builder.call(2, "/fill", TRIGGER, {}, {}, by_student=True).call(3, "/fill", TRIGGER, {}, {}, by_student=True)
    rows = asked(builder)
    assert rows["offers_empty"] == ("service_available", {"service": "/empty", "type": TRIGGER})
    assert rows["calls_fill"] == ("service_calls", {"service": "/fill", "calls": 2})
    assert rows["pump_logs"] == ("uses_logger", {"process": "pump.py"})


def test_parameters_are_asked_for_their_defaults() -> None:
    """Read as a node tells them; lists have no value in the rubric, and what every node has is left out."""
    told = {"speed": "1.5", "mode": "'fast'", "on": "True", "limits": "[1, 2]", "use_sim_time": "True", "odd": "nan"}
    builder = pump().add(*(Offer(0, "pump.py", "parameter", f"/pump:{name}", text) for name, text in told.items()))
    rows = {name: parameters.get("value") for name, (_, parameters) in asked(builder).items()}
    assert rows == {
        "parameter_speed": 1.5,
        "parameter_mode": "fast",
        "parameter_on": True,
        "parameter_limits": None,
        "parameter_odd": None,
    }
    stimuli = [s.parameters["name"] for s in stimuli_for(builder.trace(), 10) if s.kind == "parameter"]
    assert stimuli == ["speed", "mode", "on", "limits", "odd"]


def test_nan_is_asked_for_nothing() -> None:
    """There is no number to ask for."""
    rows = asked(pump().messages("/level", FLOAT, {"data": math.nan}, rate_hz=10))
    assert set(rows) == {"publishes_level", "level_rate"}


def test_who_waits_for_somebody_is_given_something() -> None:
    """Numbers, the recorded odometry or messages by type; calls and servers; nothing where a node speaks."""
    builder = pump().subscription("/level", FLOAT).subscription("/odom", "nav_msgs/msg/Odometry")
    builder.subscription("/goal", POSE).subscription("/own", FLOAT).publisher("/own", FLOAT)
    builder.server("/empty", TRIGGER).client("/fill", TRIGGER)
    kinds = {s.parameters.get("topic") or s.parameters["service"]: s.kind for s in stimuli_for(builder.trace(), 10)}
    assert kinds == {
        "/level": "numbers",
        "/odom": "recorded",
        "/goal": "messages",
        "/empty": "calls",
        "/fill": "server",
    }


def test_the_text_can_be_read_whatever_files_are_called(tmp_path: Path) -> None:
    """Names with quotation marks, braces and line breaks stay names; comments stay comments."""
    name = 'a "b", {c}: #d.py'
    row = DraftCriterion(
        "logs", 'Logs: "all" #1', "uses_logger", {"process": name}, "log\nit: {now}", comment="x\ny: z"
    )
    given = DraftStimulus(
        "numbers", {"topic": "/a", "type": FLOAT, "values": [1, -0.5], "period": DraftQuantity("1 s")}
    )
    draft = Draft("e", (name,), 5.0, stimuli=(given,), criteria=(row,), remarks=("a\nb: c",))
    data = YAML(typ="safe", pure=True).load(rubric_text(draft, [(row, "why\nnot: {")]))
    assert data["files"] == [name]
    (criterion,) = data["criteria"]
    assert (criterion["title"], criterion["check"]) == ('Logs: "all" #1', {"uses_logger": {"process": name}})
    assert data["scenarios"][0]["stimuli"] == [{"numbers": {**given.parameters, "period": "1 s"}}]


@pytest.mark.parametrize(
    ("text", "id_"), [("/cmd_vel", "cmd_vel"), ("MyNode", "my_node"), ("3D-scan", "x_3_d_scan"), ("é", "x")]
)
def test_an_id_is_made_of_anything(text: str, id_: str) -> None:
    """Small letters, digits and `_`, a letter first."""
    assert as_id(text) == id_


def test_nothing_is_written_over(tmp_path: Path) -> None:
    """A rubric that took an afternoon is not replaced by a skeleton; nothing is run."""
    (tmp_path / "r.yaml").write_text("mine")
    done = CliRunner().invoke(main.app, ["rubric", "new", "a.py", "-o", str(tmp_path / "r.yaml")])
    assert done.exit_code == 2
    assert "expected a new file, found an existing one" in done.stderr
    assert (tmp_path / "r.yaml").read_text() == "mine"


@pytest.mark.long
@pytest.mark.ros
def test_the_reference_scores_full_under_its_skeleton(tmp_path: Path) -> None:
    """A node that publishes, listens and logs: seen, given numbers, asked, checked and graded for real."""
    reference = str(ROOT / "reference_solutions" / "temperature_sensor.py")
    rubric = tmp_path / "sensor.yaml"
    command = [GRADE, "rubric", "new", reference, "--id", "sensor", "-o", str(rubric)]
    subprocess.run(command, check=True, capture_output=True)
    assert check_rubric(rubric).warnings == ()
    asked_of = {(type(c.check).__name__, getattr(c.check, "topic", "")) for c in read_rubric(rubric).criteria}
    assert {("TopicRate", "/temperature"), ("RandomInRange", "/temperature"), ("Subscribes", "/fan_speed")} <= asked_of
    command = [GRADE, reference, "--rubric", str(rubric), "--seed", "5", "--json"]
    report = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    assert report["score"] == report["max_score"] >= 25


@pytest.mark.long
@pytest.mark.ros
def test_a_reference_that_fails_is_told(tmp_path: Path) -> None:
    """A rubric made of a traceback would ask for it."""
    (tmp_path / "pump.py").write_text("import rclpy\nrclpy.init()\nrclpy.create_node('pump')\nraise ValueError('no')\n")
    done = CliRunner().invoke(main.app, ["rubric", "new", str(tmp_path / "pump.py")])
    assert done.exit_code == 2
    assert "expected a reference that runs, found pump.py:4: ValueError: no" in done.stderr


def test_what_came_of_each_input_becomes_a_case() -> None:
    """What differs from the defaults in some answer is asked for in all; silence is a case too; repeats are none."""
    silent = pump().subscription("/say", "std_msgs/msg/String")
    driven = pump().subscription("/say", "std_msgs/msg/String")
    for t_s, word in ((1, "left"), (3, "sing"), (5, "stop"), (7, "left")):
        driven.delivery(t_s, "/say", "std_msgs/msg/String", {"data": word})
        if word != "sing":
            goal = {"header": {"frame_id": "map", "stamp": {"sec": t_s}}, "x": 2.0 if word == "left" else 0.0, "y": 0.0}
            driven.message(t_s + 0.1, "/goal", POSE, goal)
    _, parameters = asked(driven, alone=silent)["goal_reaction"]
    assert parameters["cases"] == [
        {"when": {"data": "left"}, "then": {"header.frame_id": "map", "x": 2.0}},
        {"when": {"data": "sing"}, "silent": True},
        {"when": {"data": "stop"}, "then": {"header.frame_id": "map", "x": 0.0}},
    ]


@pytest.mark.parametrize("text", ["say={data: a}", "/say", "/say={data: [}", "/say=5", "/say="])
def test_a_message_to_send_has_a_topic_and_fields(text: str) -> None:
    """Anything else is told before something runs."""
    done = CliRunner().invoke(main.app, ["rubric", "new", "a.py", "--send", text])
    assert done.exit_code == 2
    assert "expected TOPIC={field: value}, found something else" in done.stderr


def test_inputs_are_told_apart_by_what_differs_between_them() -> None:
    """By the element of a list if need be; what they have in common says nothing, and infinite ranges are ordinary."""
    silent = pump().subscription("/scan", "sensor_msgs/msg/LaserScan")
    driven = pump().subscription("/scan", "sensor_msgs/msg/LaserScan")
    for t_s, ranges in ((1, [2.0, math.inf]), (3, [2.0, 0.2])):
        driven.delivery(t_s, "/scan", "sensor_msgs/msg/LaserScan", {"range_max": 10.0, "ranges": ranges})
        driven.message(t_s + 0.1, "/goal", POSE, {"x": min(ranges), "y": 0.0})
    _, parameters = asked(driven, alone=silent)["goal_reaction"]
    assert parameters["cases"] == [
        {"when": {"ranges[1]": math.inf}, "then": {"x": 2.0}},
        {"when": {"ranges[1]": 0.2}, "then": {"x": 0.2}},
    ]


@pytest.mark.long
@pytest.mark.ros
def test_a_message_to_send_has_the_fields_of_its_type(tmp_path: Path) -> None:
    """The reference tells the type; a field that it has not is told like any mistake, and not as a failed run."""
    code = "import rclpy\nfrom std_msgs.msg import String\nrclpy.init()\nnode = rclpy.create_node('pump')\n"
    code += "node.create_subscription(String, '/say', print, 10)\nrclpy.spin(node)\n"
    (tmp_path / "pump.py").write_text(code)
    done = CliRunner().invoke(main.app, ["rubric", "new", str(tmp_path / "pump.py"), "--send", "/say={dat: hello}"])
    assert done.exit_code == 2
    assert "--send: expected a field of std_msgs/msg/String (`data`), found `dat`" in done.stderr
    assert "did you mean `data`?" in done.stderr
