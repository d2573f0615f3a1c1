"""Spoilt programs with what was recorded of them: the cause that is named, the line, and the words of the hint."""

from __future__ import annotations

import json
import re
import tokenize
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from archive import recordings
from diagnosis_samples import (
    LAUNCH_SLIPS,
    RECORDINGS,
    RIGHT,
    crashed,
    exercise_of,
    line_of,
    lost,
    report,
    rows,
    spoilt,
    submission_to,
)
from places import ROOT
from sample_folders import folders_in
from tables import read_table
from tiers import each, more

from grader.grading.judging.diagnosis import CAUSE_KEY, RULES, cases_of, diagnose, rules_of
from grader.grading.judging.diagnosis.rules import FIRST, Case, Rule, rules_in_order
from grader.grading.judging.judge_run import undiagnosed
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport, Verdict
from grader.grading.rubrics.builtin import builtin_exercises
from grader.runtime.model.trace import AssessedTrace, Start, StartWay

HERE = Path(__file__).parent
#: The rules of the grader, and of the exercises that come with it.
EVERY: list[Any] = [*RULES, *(rule for exercise in builtin_exercises() for rule in exercise.hints)]
Row = Mapping[str, Any]
CRASHES = rows("crashes.yaml")
BEHAVIOURS = rows("behaviours.yaml")
SLIPS = rows("slips.yaml")
EXAMPLE_SLIPS = [read_table(path) for path in sorted((ROOT / "examples").glob("*/slips.yaml"))]
ENDED = [row for row in SLIPS if "fault" in row]


def explained(row: Row, traces: Mapping[str, AssessedTrace]) -> ExerciseReport:
    return report(row["file"], traces, texts_of(row))


def texts_of(row: Row) -> dict[str, str]:
    """Return the right files of the exercise of a row, with its spoilt one among them."""
    texts = {name: RIGHT[name] for name in exercise_of(row["file"]).files}
    return {**texts, row["file"]: spoilt(row["file"], row["change"])}


def crash_traces(row: Row) -> dict[str, AssessedTrace]:
    scenarios = exercise_of(row["file"]).scenarios
    starts = (Start(row["file"], row["file"], StartWay.SCRIPT, hidden=tuple(row["fault"].get("hidden", ()))),)
    rec = crashed(row["file"], row["fault"])
    return {s.id: rec.trace(s.id, starts=starts) for s in scenarios if row["file"] in s.processes}


def behaviour_traces(row: Row) -> dict[str, AssessedTrace]:
    ((name, arguments),) = row["recording"].items()
    scenario, build = RECORDINGS[name]
    if name.startswith("logging") and not arguments.get("printed"):
        arguments = {**arguments, "line": line_of(spoilt(row["file"], row["change"]), "get_logger().info(")}
    return {scenario: build(**arguments).trace(scenario)}


def said(row: Row, verdict: Verdict) -> tuple[str, str, str]:
    """The cause, the code at the place, and the hint."""
    text = spoilt(row["file"], row["change"]).splitlines()
    at = ""
    if verdict.location is not None and verdict.location.file == row["file"] and verdict.location.line:
        at = text[verdict.location.line - 1].strip()
    return verdict.evidence["diagnosis"], at, verdict.hint


@pytest.mark.parametrize("row", CRASHES, ids=[r["name"] for r in CRASHES])
def test_a_fault_is_traced_to_its_cause(row: Row) -> None:
    """At the line that has to change, in the words of the student's own code."""
    found = lost(explained(row, crash_traces(row)))
    assert said(row, found[0]) == (row["cause"], row["at"], row["hint"])


@pytest.mark.parametrize("row", ENDED, ids=[r["name"] for r in ENDED])
def test_a_slip_that_ends_the_program_is_traced_to_its_cause(row: Row) -> None:
    """From what was recorded of it, without running it again."""
    found = next(v for v in explained(row, crash_traces(row)).verdicts if "diagnosis" in v.evidence)
    assert said(row, found) == (row["cause"], row["at"] if "where" not in row else "", row["hint"])


@pytest.mark.parametrize("row", BEHAVIOURS, ids=[r["name"] for r in BEHAVIOURS])
def test_wrong_behaviour_is_traced_to_its_cause(row: Row) -> None:
    """At the line that has to change, for the criterion that lost its points."""
    found = {v.id: v for v in lost(explained(row, behaviour_traces(row)))}
    assert row["criterion"] in found
    assert said(row, found[row["criterion"]]) == (row["cause"], row["at"], row["hint"])


def traces_of(row: Row) -> dict[str, AssessedTrace]:
    """Return the recordings of a row of either table."""
    return crash_traces(row) if "fault" in row else behaviour_traces(row)


@pytest.mark.long
def test_diagnosis_changes_neither_outcomes_nor_points_nor_reasons() -> None:
    """With the sources and without them, the same is earned for the same reason."""

    def earned(found: ExerciseReport) -> list[tuple[Any, ...]]:
        return [(v.id, v.outcome, v.score, v.reason) for v in found.verdicts]

    pairs = ((row, traces_of(row)) for row in (*CRASHES, *BEHAVIOURS))
    changed = [
        row["name"]
        for row, traces in pairs
        if earned(explained(row, traces)) != earned(report(row["file"], traces, None))
    ]
    assert changed == []


def repeats(row: Row) -> bool:
    """Return whether a cause is explained twice, or a reference leads nowhere."""
    first, *others = lost(explained(row, traces_of(row)))
    own = [v.hint for v in (first, *others) if not v.same_cause_as]
    leads_nowhere = any(v.same_cause_as not in v.hint for v in others)
    return len(own) != len(set(own)) or bool(first.same_cause_as) or leads_nowhere


def test_a_cause_is_explained_once() -> None:
    """A second criterion with the same cause refers to the first."""
    assert [row["name"] for row in (*CRASHES, *BEHAVIOURS) if repeats(row)] == []


def diagnosed(
    row: Row, traces: Mapping[str, AssessedTrace], *, reasons: bool = True, more: tuple[Rule, ...] = ()
) -> list[Verdict]:
    """Return the verdicts of a row as reports have them, looked for without any reason, or with more rules before."""
    exercise, texts = exercise_of(row["file"]), texts_of(row)
    given = (exercise, traces, submission_to(exercise), texts)
    verdicts, facts = undiagnosed(*given)
    verdicts = verdicts if reasons else tuple(replace(v, reason="") for v in verdicts)
    return [*diagnose(verdicts, cases_of(verdicts, *given, facts), (*more, *rules_of(exercise)), [])]


@pytest.mark.parametrize("step", [6, *more([1])])
def test_no_cause_is_found_in_the_words_of_a_reason(step: int) -> None:
    """Without any reason the hints and places are the same: each sixth row by default, each in the long tier."""
    rows = [(row, traces_of(row)) for row in (*CRASHES, *BEHAVIOURS)[::step]]
    known = [[replace(v, reason="") for v in explained(row, traces).verdicts] for row, traces in rows]
    found = [diagnosed(row, traces, reasons=False) for row, traces in rows]
    assert [row["name"] for (row, _), a, b in zip(rows, known, found, strict=True) if a != b] == []


def test_a_rule_that_fails_is_logged_and_passed_over(caplog: pytest.LogCaptureFixture) -> None:
    """The others are looked for all the same; elsewhere in these tests the log makes the test fail."""

    def fails(case: Case) -> None:
        raise ValueError(case.criterion.id)

    row = CRASHES[0]
    usual = explained(row, crash_traces(row))
    assert diagnosed(row, crash_traces(row), more=(Rule("fails", fails, fault=None),)) == [*usual.verdicts]
    assert caplog.messages[0] == f"the rule fails failed on the criterion {lost(usual)[0].id}"


def test_every_rule_is_shown_to_work() -> None:
    """By a row of a table, by a recorded submission, whose hints are compared too, or by a test of its own."""
    recorded = [json.loads(one.report)["exercises"] for one in recordings().values()]
    verdicts = [verdict for exercises in recorded for exercise in exercises for verdict in exercise["criteria"]]
    shown = {row["cause"] for row in (*CRASHES, *BEHAVIOURS, *SLIPS)} | {v["evidence"].get(CAUSE_KEY) for v in verdicts}
    shown |= {cause for _, _, _, cause in LAUNCH_SLIPS}
    shown |= {"unheard_by_simulation"}  # test_simulated.py
    shown |= {"other_action_type"}  # test_actions_of_clients.py
    shown |= {row["cause"] for table in EXAMPLE_SLIPS for row in table}  # tests/test_example_slips.py
    # it only names another criterion, so that reports do not name it
    shown |= {"follows" for v in verdicts if v.get("same_cause_as") and CAUSE_KEY not in v["evidence"]}
    assert {rule.id for rule in EVERY} - shown == set()


def test_the_rules_are_asked_in_the_order_that_is_written_down() -> None:
    """Wherever a rule is defined: its priority alone decides."""
    order = (HERE / "order.txt").read_text("utf-8").split()
    assert [rule.id for rule in rules_in_order(EVERY)] == [*order, "follows"]
    priorities = [rule.priority for rule in EVERY]
    assert len(set(priorities)) == len(priorities)
    # what does not pass between a node and the grader is told before all
    assert sorted(priorities)[2] >= 1000 > FIRST > sorted(priorities)[1]


def test_the_ids_of_rules_are_unique() -> None:
    """Reports name them."""
    ids = [rule.id for rule in EVERY]
    assert len(ids) == len(set(ids))


@pytest.mark.parametrize("file", sorted(RIGHT))
def test_a_right_program_that_does_right_is_left_alone(file: str) -> None:
    """No verdict is touched where nothing was lost."""
    given = {
        "velocity_publisher.py": ("paced", {"rate": 20}),
        "odom_subscriber.py": ("logging", {}),
        "temperature_sensor.py": ("sensing", {}),
        "fan_controller.py": ("answering", {}),
        "simple_publisher.py": ("swinging", {}),
        "battery_service_client.py": ("asking_once", {}),
        "battery_service_server.py": ("asking_once", {}),
        "greeter.py": ("greeting", {}),
    }[file]
    scenario, build = RECORDINGS[given[0]]
    traces = {scenario: build(**given[1]).trace(scenario)}
    texts = {name: RIGHT[name] for name in exercise_of(file).files}
    judged, plain = report(file, traces, texts), report(file, traces, None)
    right = [v for v in judged.verdicts if v.outcome is Outcome.MET]
    assert right
    assert all(v in plain.verdicts for v in right)


_WAIT = "        while not future.done():\n            time.sleep(0.1)\n        answer = future.result()\n"
_BLOCKS = [
    (
        "        answer = await self.client.call_async(Trigger.Request())\n",
        f"        future = self.client.call_async(Trigger.Request())\n{_WAIT}",
    )
]
_THREAD = ("    rclpy.spin(Mission())", "    Thread(target=rclpy.spin, args=(Mission(),)).start()")
#: A program, what it was seen to do, and a rule for a mistake that it only seems to make.
NEAR_MISSES: list[tuple[str, list[tuple[str, str]], str, dict[str, Any], str]] = [
    # the deadline is that of another endpoint
    (
        "odom_subscriber.py",
        [
            (
                "        self.sub = self",
                "        qos = QoSProfile(depth=10)\n"
                "        other = QoSProfile(depth=1, deadline=Duration(seconds=1))\n"
                "        self.out = self.create_publisher(String, '/x', other)\n        self.sub = self",
            ),
            ("self.callback, 10", "self.callback, qos"),
        ],
        "hearing",
        {},
        "stopped_listening",
    ),
    # something wakes the node as often as it is to publish
    (
        "velocity_publisher.py",
        [("rclpy.spin(node)", "while rclpy.ok():\n        rclpy.spin_once(node)")],
        "paced",
        {"rate": 10},
        "waits_to_spin",
    ),
    # the time between two messages is computed of each one, and the log waits for no time
    (
        "odom_subscriber.py",
        [
            ("        self.msg = None\n", "        self.msg = None\n        self.last = time.time()\n"),
            (
                "        self.msg = msg\n",
                "        now = time.time()\n        passed = now - self.last\n        self.last = now\n"
                "        if passed > 0:\n            self.get_logger().info(f'{msg.pose.pose.position.x} {passed}')\n",
            ),
        ],
        "logging_once",
        {},
        "time_moves_always",
    ),
    # one of the numbers in the formula is 0, and the counter counts
    (
        "simple_publisher.py",
        [
            ("m.data = math.sin(self.i * 0.1)", "phase = 0\n        m.data = math.sin(self.i * 0.1 + phase)"),
        ],
        "swinging",
        {"what": "zero"},
        "counter_never_changes",
    ),
    # what is stored elsewhere is read, and the counter counts
    (
        "simple_publisher.py",
        [("        self.i += 1\n", "        following = self.i + 1\n        self.i = following\n")],
        "swinging",
        {"what": "small_step"},
        "changed_in_a_copy",
    ),
    ("battery_service_client.py", [*_BLOCKS, _THREAD], "asking_once", {}, "future_never_done"),
    ("battery_service_client.py", [*_BLOCKS, _THREAD], "asking_once", {}, "result_too_early"),
    (
        "battery_service_client.py",
        [("await self.client.call_async(", "self.client.call("), _THREAD, ("self.create_timer(1.0, self.run)", "pass")],
        "asking_once",
        {},
        "synchronous_call",
    ),
    (
        "velocity_publisher.py",
        [("rclpy.init(args=args)", "rclpy.init(args=args, domain_id=None)")],
        "silent",
        {},
        "other_domain",
    ),
    (
        "velocity_publisher.py",
        [("rclpy.init(args=args)", "rclpy.init(args=args, domain_id=0)")],
        "silent",
        {},
        "other_domain",
    ),
    (
        "velocity_publisher.py",
        [("import rclpy\n", "import os\nimport rclpy\nos.environ['ROBOT_ID'] = '42'\n")],
        "silent",
        {},
        "other_domain",
    ),
    (
        "velocity_publisher.py",
        [("        self.timer", "        self.get_logger().set_level(LoggingSeverity.DEBUG)\n        self.timer")],
        "silent",
        {},
        "level_raised",
    ),
    (
        "velocity_publisher.py",
        [
            ("        msg = Twist()\n", "        msg = self.twist\n"),
            ("        self.timer", "        self.twist = Twist()\n        self.timer"),
        ],
        "moving",
        {"linear": [0, 0, 0]},
        "set_elsewhere",
    ),
    (
        "velocity_publisher.py",
        [
            (
                "        self.pub.publish(msg)",
                "        if self.stop:\n            msg.linear.x = 0.0\n        self.pub.publish(msg)",
            )
        ],
        "moving",
        {"linear": [0, 0, 0]},
        "set_elsewhere",
    ),
    (
        "velocity_publisher.py",
        [
            (
                "        self.pub.publish(msg)",
                "        if self.stop:\n            time.sleep(9.0)\n        self.pub.publish(msg)",
            )
        ],
        "paced",
        {"rate": 10},
        "callback_held_up",
    ),
    (
        "simple_publisher.py",
        [("        m = Float64()\n", "        m = Float64()\n        self.turn = 2 * math.pi\n")],
        "swinging",
        {"what": "from_one"},
        "needless_pi",
    ),
]


@pytest.mark.parametrize(
    ("file", "change", "name", "arguments", "cause"),
    NEAR_MISSES,
    ids=[f"{n[4]}-{k}" for k, n in enumerate(NEAR_MISSES)],
)
def test_a_near_miss_is_not_blamed(
    file: str, change: list[tuple[str, str]], name: str, arguments: dict[str, Any], cause: str
) -> None:
    """Another cause may be named, or none."""
    scenario, build = RECORDINGS[name]
    traces = {scenario: build(**arguments).trace(scenario)}
    verdicts = explained({"file": file, "change": change}, traces).verdicts
    assert any(v.outcome is not Outcome.MET for v in verdicts)
    assert cause not in [v.evidence.get(CAUSE_KEY) for v in verdicts]


#: Rules that say what a program does wrong, whatever was recorded: a right program must never get them.
TEXTUAL = {rule.id for rule in EVERY} - {
    "hears_nobody",  # which topics were heard
    "guarded",  # which messages were heard, and that nothing followed
    "logs_held_up",  # that logs are late or missing
    "log_line",  # where a log is written
    "log_period",
    "late_timer",
    "only_when_told",
    "printed",
    "published_several_times",
    "loop_pace",
    "stopped_itself",
    "too_slow",
    "value_line",  # where the value is computed
    "wrong_axis",
    "wrong_level",
    "wrong_number",
    "wrong_topic",
}
OTHERWISE = [
    ("velocity_publisher.py", "paced", {"rate": 10}),
    ("velocity_publisher.py", "paced", {"rate": 400}),
    ("velocity_publisher.py", "silent", {}),
    ("velocity_publisher.py", "once", {}),
    ("velocity_publisher.py", "bursts", {"count": 2, "period": 0.05}),
    ("velocity_publisher.py", "stopped", {}),
    ("velocity_publisher.py", "moving", {"linear": [0, 0.5, 0]}),
    ("velocity_publisher.py", "moving", {"linear": [0, 0, 0], "angular": [0, 0, 0]}),
    ("odom_subscriber.py", "hearing", {}),
    ("odom_subscriber.py", "logging", {"what": "swapped"}),
    ("odom_subscriber.py", "logging", {"what": "zero"}),
    ("odom_subscriber.py", "logging", {"what": "unsigned"}),
    ("odom_subscriber.py", "logging_first", {}),
    ("odom_subscriber.py", "logging_once", {}),
    ("temperature_sensor.py", "sensing", {"what": "wide"}),
    ("temperature_sensor.py", "sensing", {"what": "constant"}),
    ("temperature_sensor.py", "fanned", {"what": "no number"}),
    ("temperature_sensor.py", "fanned", {"topic": ""}),
    ("fan_controller.py", "answering", {"rule": "from_25"}),
    ("fan_controller.py", "answering", {"rule": "inverted"}),
    ("fan_controller.py", "answering", {"rule": "one"}),
    ("fan_controller.py", "answering", {"rule": "only_on"}),
    ("fan_controller.py", "latching", {}),
    ("fan_controller.py", "mute", {}),
    ("simple_publisher.py", "swinging", {"what": "zero"}),
    ("simple_publisher.py", "swinging", {"what": "small_step"}),
    ("simple_publisher.py", "swinging", {"logs": "first_ten"}),
    ("battery_service_client.py", "asking_once", {}),
]


def right_programs(file: str) -> dict[str, str]:
    """The graded files of that name among the correct submissions."""
    found = sorted(path for folder in folders_in("correct", "threads") for path in folder.rglob(file))
    texts = {}
    for path in found:
        with tokenize.open(path) as lines:  # in the encoding that it declares
            texts[path.parent.name] = lines.read()
    return texts


@pytest.mark.breadth(2, 6)
@pytest.mark.slow
@pytest.mark.parametrize(("file", "name", "arguments"), each(OTHERWISE, 6))
def test_right_programs_are_not_blamed(file: str, name: str, arguments: dict[str, Any]) -> None:
    """Correct code is not called wrong, even if a recording shows a failure."""
    scenario, build = RECORDINGS[name]
    traces = {scenario: build(**arguments).trace(scenario)}
    programs = right_programs(file)
    assert len(programs) >= 5
    blamed: dict[str, set[Any]] = {}
    for folder, text in programs.items():
        texts = {**dict.fromkeys(exercise_of(file).files, ""), file: text}
        found = {v.evidence["diagnosis"] for v in lost(report(file, traces, texts))} & TEXTUAL
        blamed |= {folder: found} if found else {}
    assert blamed == {}


def test_the_exceptions_that_are_listed_are_those_that_rules_look_for() -> None:
    """Each names a rule that exists and whose pattern fits the message, or says why there is none."""
    patterns = {rule.id: rule.text for rule in RULES}
    for row in rows("exceptions.yaml"):
        if row["rule"] == "none":
            assert row["because"], row["message"]
            continue
        assert row["rule"] in patterns, row
        assert re.search(patterns[row["rule"]], row["message"]), row
