"""Recordings that students hand in: what a rubric can say of them, and the message and place of each mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.course.authoring.checking import check_rubric
from grader.grading.app.explain import explain_name
from grader.grading.app.interfaces import known_interfaces
from grader.grading.judging.checks import CHECKS, NOT_IN_BAGS
from grader.grading.model.exercise import Exercise
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.scenario import HandedInBag, Scenario, Span

PUBLISHES = "publishes: {topic: /odom, type: nav_msgs/msg/Odometry}"
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: square, number: 1, title: A square}
scenarios:
  - id: drive
    handed_in: HANDED_IN
criteria:
  - {id: odometry, title: Odometry, points: 5, hint: Record it., scenario: drive, check: {CHECK}}
"""
MIXED = """\
schema: grader/rubric/v1
exercise: {id: square, number: 1, title: A square}
files: [square.py]
scenarios:
  - id: drive
    handed_in: {bag: "*.mcap"}
  - id: alone
    processes: [square.py]
    observe: {duration: 2 s}
criteria:
  - id: odometry
    title: Odometry
    points: 4
    scenario: drive
    check: {publishes: {topic: /odom, type: nav_msgs/msg/Odometry}}
  - id: goal
    title: Goal
    points: 3
    scenario: drive
    check: {reaches_goal: {topic: /pose, goals: /goal, fields: {x: x}, within: 5 s, tolerance: 0.1}}
  - id: speed
    title: Speed
    points: 3
    scenario: alone
    check: {publishes: {topic: /cmd_vel, type: geometry_msgs/msg/Twist}}
"""


def rubric(folder: Path, handed_in: str = '{bag: "*.mcap"}', check: str = PUBLISHES, text: str = RUBRIC) -> Path:
    path = folder / "r.yaml"
    path.write_text(text.replace("HANDED_IN", handed_in).replace("CHECK", check), encoding="utf-8")
    return path


def scenario_of(exercise: Exercise) -> Scenario:
    return exercise.scenarios[0]


def test_a_rubric_may_ask_for_nothing_but_a_recording(tmp_path: Path) -> None:
    exercise = read_rubric(rubric(tmp_path))
    assert scenario_of(exercise) == Scenario("drive", (), Span(0), handed_in=HandedInBag("*.mcap", ("/odom",)))
    assert (exercise.files, exercise.wanted) == ((), ("*.mcap",))


def test_limits_and_topics_are_the_rubrics_to_choose(tmp_path: Path) -> None:
    handed_in = "{bag: square, topics: [/odom, /tf], size: 64 MiB, duration: 2 min}"
    asked = scenario_of(read_rubric(rubric(tmp_path, handed_in))).handed_in
    assert asked == HandedInBag("square", ("/odom", "/tf"), 64 * MIB, 120 * NS_PER_S)


def test_without_topics_those_are_read_that_checks_name(tmp_path: Path) -> None:
    """Of a check that reads what the grader publishes in a run, the recording gives these messages."""
    scenario = scenario_of(read_rubric(rubric(tmp_path, text=MIXED)))
    assert scenario.handed_in is not None
    assert scenario.handed_in.topics == ("/odom", "/pose", "/goal")
    assert scenario.given == ("/pose", "/goal")
    assert scenario_of(read_rubric(rubric(tmp_path, check="transform: {parent: odom, child: base}"))).handed_in == (
        HandedInBag("*.mcap", ("/tf", "/tf_static"))
    )


def test_a_check_of_ones_own_may_read_every_topic(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(
        "from dataclasses import dataclass\n\nfrom grader.api import Finding, Trace, met\n\n\n"
        "@dataclass(frozen=True)\nclass Turns:\n    '''It turns.'''\n\n"
        "    def judge(self, trace: Trace) -> Finding:\n        return met('yes')\n\n\n"
        "CHECKS = {'turns': Turns}\n"
    )
    text = RUBRIC.replace("scenarios:", "checks: [own.py]\nscenarios:")
    asked = scenario_of(read_rubric(rubric(tmp_path, check="turns: {}", text=text))).handed_in
    assert asked is not None
    assert asked.topics == ()


def test_scenarios_that_run_and_recordings_share_a_rubric(tmp_path: Path) -> None:
    exercise = read_rubric(rubric(tmp_path, text=MIXED))
    assert exercise.wanted == ("square.py", "*.mcap")
    assert [scenario.wanted for scenario in exercise.scenarios] == [("*.mcap",), ("square.py",)]


@pytest.mark.parametrize(
    ("handed_in", "message"),
    [
        ("{}", "r.yaml:5:16: expected the key `bag` in `handed_in`, found none"),
        ("{bag: bags/x.mcap}", "r.yaml:5:22: expected the name of a recording such as *.mcap or square, without"),
        ("{bag: square.py}", "r.yaml:5:22: expected the name of a recording"),
        ("{bag: '[ab].mcap'}", "r.yaml:5:22: expected the name of a recording"),
        ("{bag: '*', topics: odom}", "r.yaml:5:35: expected a list, found `odom`"),
        ("{bag: '*', topics: [odom]}", "r.yaml:5:36: expected an absolute topic name such as /cmd_vel"),
        ("{bag: '*', size: 1 GiB}", "r.yaml:5:33: expected at most 512 MiB"),
        ("{bag: '*', size: 100}", "r.yaml:5:33: expected a size with its unit"),
        ("{bag: '*', duration: 0 s}", "r.yaml:5:37: expected more than 0 s"),
        (
            "{bag: '*', file: x}",
            "r.yaml:5:27: expected `bag`, `topics`, `size` or `duration`",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place(tmp_path: Path, handed_in: str, message: str) -> None:
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric(tmp_path, handed_in))
    assert message in refused.value.message


@pytest.mark.parametrize(
    "key", ["observe: {duration: 1 s}", "processes: [a.py]", "draws: 3", "stimuli: []", "shutdown: 1 s"]
)
def test_what_only_a_run_has_is_refused_beside_it(tmp_path: Path, key: str) -> None:
    name = key.partition(":")[0]
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric(tmp_path, text=RUBRIC.replace("criteria:", f"    {key}\ncriteria:")))
    text = f"r.yaml:6:5: expected nothing but `handed_in` for a recording that students hand in, found `{name}`"
    assert text in refused.value.message


@pytest.mark.parametrize("name", ["processes", "observe"])
def test_a_scenario_that_runs_still_needs_its_keys(tmp_path: Path, name: str) -> None:
    lines = [line for line in MIXED.splitlines() if not line.strip().startswith(name)]
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric(tmp_path, text="\n".join(lines)))
    assert f"expected the key `{name}` in `scenarios`, found none" in refused.value.message


def test_only_recordings_need_no_files(tmp_path: Path) -> None:
    with pytest.raises(RubricError, match="expected the key `files`, found none"):
        read_rubric(rubric(tmp_path, text=MIXED.replace("files: [square.py]\n", "")))


@pytest.mark.parametrize(
    ("name", "check", "lacks"),
    [
        ("subscribes", "{topic: /odom, type: nav_msgs/msg/Odometry}", "the graph of nodes"),
        ("qos", "{topic: /odom, kind: publisher, reliability: reliable}", "the graph of nodes"),
        ("uses_logger", "{process: square.py}", "what programs log"),
        ("no_fault", "{}", "how programs end"),
        ("service_available", "{service: /stop, type: std_srvs/srv/Trigger}", "calls of services"),
    ],
)
def test_a_check_of_what_no_recording_holds_is_refused_with_its_place(
    tmp_path: Path, name: str, check: str, lacks: str
) -> None:
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric(tmp_path, check=f"{name}: {check}"))
    assert f"r.yaml:7:91: expected a check of messages, found `{name}`: no recording holds {lacks}" in (
        refused.value.message
    )


def test_every_check_is_known_to_suit_a_recording_or_not() -> None:
    """A new check belongs to one of the two."""
    suits = {
        *("publishes", "topic_rate", "field_values", "random_in_range", "field_function", "reaction", "period"),
        *("latency", "silence", "field_equal", "field_in_range", "field_monotone", "transform", "reaches_goal"),
        "stays_in_range",
    }
    assert set(CHECKS) - set(NOT_IN_BAGS) == suits
    assert set(NOT_IN_BAGS) <= set(CHECKS)


def test_a_type_that_only_the_recording_defines_is_no_mistake(tmp_path: Path) -> None:
    check = "publishes: {topic: /wheels, type: robo_msgs/msg/Wheels}"
    field = "field_equal: {topic: /wheels, fields: {left: 1}}"
    interfaces = known_interfaces()
    assert interfaces is not None
    read_rubric(rubric(tmp_path, check=check), interfaces=interfaces)
    read_rubric(rubric(tmp_path, check=field), interfaces=interfaces)
    both = RUBRIC + f"  - {{id: left, title: Left, points: 5, hint: x, scenario: drive, check: {{{field}}}}}\n"
    with pytest.raises(RubricError, match="expected a field of"):
        read_rubric(
            rubric(tmp_path, check=check.replace("robo_msgs/msg/Wheels", "std_msgs/msg/Int32"), text=both),
            interfaces=interfaces,
        )


def test_a_check_of_the_rubric_warns_of_nothing(tmp_path: Path) -> None:
    checked = check_rubric(
        rubric(tmp_path, check="topic_rate: {topic: /odom, rate: 5 Hz, tolerance: 1 Hz, window: 9 s}")
    )
    assert checked.warnings == ()
    assert checked.summary.endswith("square: 1 scenario, 1 criterion, 5 points")


def test_grade_explain_says_what_is_handed_in(tmp_path: Path) -> None:
    (told,) = explain_name("odometry", (rubric(tmp_path),))
    assert "the student hands in a recording named *.mcap, of which the first 600 s of /odom are read" in repr(told)
