"""The commands `grade rubric check`, `schema` and `explain`: what authors are told about their rubrics."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result
from places import ROOT

from grader.cli import main
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.schema import schema_text

EXAMPLES = ROOT / "examples"
GOOD = """\
schema: grader/rubric/v1
exercise: {id: pump, number: 7, title: A pump}
files: [pump.py]
scenarios:
  - id: alone
    processes: [pump.py]
    observe: {duration: 5 s}
criteria:
  - id: flows
    title: Publishes the flow
    points: 10
    scenario: alone
    check:
      publishes: {topic: /flow, type: std_msgs/msg/Float32}
    hint: publish it
"""
RATE = """\
  - id: rate
    title: At 5 Hz
    points: 2.5
    scenario: alone
    check:
      topic_rate: {topic: /flow, rate: 5 Hz, tolerance: 1 Hz, window: 10 s}
"""


def rubric(*words: Path | str) -> Result:
    return CliRunner().invoke(main.app, ["rubric", *map(str, words)])


def written(folder: Path, text: str, name: str = "r.yaml") -> Path:
    (folder / name).write_text(text, encoding="utf-8")
    return folder / name


def test_a_good_rubric_is_summed_up(tmp_path: Path) -> None:
    """One line on standard output, no warning, exit code 0."""
    path = written(tmp_path, GOOD)
    done = rubric("check", path)
    assert (done.exit_code, done.stderr) == (0, "")
    assert done.stdout == f"{path}: pump: 1 scenario, 1 criterion, 10 points\n"


def test_a_scenario_with_draws_counts_once(tmp_path: Path) -> None:
    """However often it is recorded."""
    path = written(tmp_path, GOOD.replace("processes:", "draws: 3\n    processes:"))
    assert rubric("check", path).stdout == f"{path}: pump: 1 scenario, 1 criterion, 10 points\n"


def test_every_mistake_is_told_and_the_other_files_are_checked_too(tmp_path: Path) -> None:
    """Line and column of each, however many there are; exit code 2, and the good rubric is still summed up."""
    many = GOOD.replace("points: 10", "points: -1") + "".join(f"key{n}: 1\n" for n in range(20))
    bad, good = written(tmp_path, many, "bad.yaml"), written(tmp_path, GOOD)
    done = rubric("check", bad, good)
    assert done.exit_code == 2
    assert f"error: {bad}:11:13: expected points above 0, found `-1`\n" in done.stderr
    assert all(f"found `key{n}`" in done.stderr for n in range(20))
    assert done.stdout.startswith(str(good))


@pytest.mark.parametrize(
    ("old", "new", "place", "told"),
    [
        ("    hint: publish it\n", "", "9:9", "flows has no hint"),
        ("points: 10", "points: 11", "8:1", "the points add up to 11"),
        (
            "criteria:",
            "  - {id: idle, processes: [pump.py], observe: {duration: 1 s}}\ncriteria:",
            "8:10",
            "idle is recorded, but no",
        ),
        ("files: [pump.py]", "files: [pump.py, spare.py]", "3:18", "spare.py is in `files`, but no scenario runs it"),
        ("", RATE.replace("2.5", "5"), "21:71", "window is 10 s, but alone is observed for 5 s only"),
    ],
)
def test_what_is_odd_is_a_warning_with_its_place(tmp_path: Path, old: str, new: str, place: str, told: str) -> None:
    """Exit code 0 all the same."""
    path = written(tmp_path, GOOD.replace(old, new, 1) if old else GOOD + new)
    done = rubric("check", path)
    assert done.exit_code == 0
    assert any(line.startswith(f"warning: {path}:{place}: ") and told in line for line in done.stderr.splitlines())


DRIVEN = GOOD.replace(
    "    observe: {duration: 5 s}\n",
    """\
    observe: {duration: 5 s}
    stimuli:
      - simulation: {differential_drive: {}}
      - messages: {topic: /goal, type: geometry_msgs/msg/Point, values: [{}], start: 1 s}
      - server: {service: /fill, type: std_srvs/srv/Trigger, responses: [{}]}
""",
)
#: A check of each kind that waits for something, written right.
WAITS = {
    "subscribes: {topic: /odom, type: nav_msgs/msg/Odometry}": "/odom",
    "stays_in_range: {topic: /odom, field: pose.pose.position.x, low: -1}": "/odom",
    "waits_gracefully: {process: pump.py, topic: /goal, silence: 1 s}": "/goal",
    "logs_position: {process: pump.py, topic: /odom}": "/odom",
    "log_period: {process: pump.py, topic: /odom, period: 1 s}": "/odom",
    "logs_received: {process: pump.py, topic: /goal, field: x}": "/goal",
    "reaches_goal: {topic: /odom, goals: /goal, fields: {pose.pose.position.x: x}, tolerance: 1, within: 1 s}": "/odom",
    "logs_response: {service: /fill, process: pump.py, field: message}": "/fill",
    "service_calls: {service: /fill, calls: 2}": "/fill",
    "reaction: {input: /goal, output: /flow, cases: [{when: {x: 0}, then: {data: 0}}], within: 1 s}": "/goal",
    "threshold_response: {input: /odom, input_field: twist.twist.linear.x, output: /flow, threshold: 1, above: 1,"
    " otherwise: 0, side: above}": "/odom",
    "reacts_to_responses: {service: /fill, process: pump.py, threshold: 2}": "/fill",
}


def waiting(check: str, rubric: str = DRIVEN) -> str:
    return rubric + f"  - {{id: waits, title: Waits, points: 5, scenario: alone, hint: none, check: {{{check}}}}}\n"


@pytest.mark.parametrize("check", WAITS)
def test_what_a_check_waits_for_and_nobody_does_is_odd(tmp_path: Path, check: str) -> None:
    """A letter too many, with the name that was meant; nothing is odd about the right name."""
    right = rubric("check", written(tmp_path, waiting(check)))
    assert (right.exit_code, right.stderr) == (0, ""), right.stderr
    name = WAITS[check]
    wrong = rubric("check", written(tmp_path, waiting(check.replace(name, f"{name}m"))))
    verb = "uses" if name == "/fill" else "publishes on"
    assert f": no stimulus of alone {verb} {name}m: did you mean {name}?\n" in wrong.stderr
    assert wrong.exit_code == 0


def test_another_program_may_publish_what_one_listens_to(tmp_path: Path) -> None:
    """Nor is it odd that a program answers what it has published itself."""
    two = waiting("subscribes: {topic: /level, type: std_msgs/msg/Float32}", GOOD)
    two = two.replace("[pump.py]", "[pump.py, tank.py]")
    assert rubric("check", written(tmp_path, two)).stderr == ""
    own = waiting("latency: {input: /flow, output: /level, within: 1 s}", GOOD)
    assert rubric("check", written(tmp_path, own)).stderr == ""
    other = waiting("latency: {input: /flaw, output: /level, within: 1 s}", GOOD)
    assert "no stimulus of alone publishes on /flaw\n" in rubric("check", written(tmp_path, other)).stderr


def test_a_misspelt_topic_of_a_stimulus_is_odd(tmp_path: Path) -> None:
    """If a check names almost the same; a topic that no check names is ordinary."""
    text = GOOD.replace("topic: /flow", "topic: /cmd_vel").replace(
        "    observe: {duration: 5 s}\n",
        "    observe: {duration: 5 s}\n    stimuli:\n      - simulation: {differential_drive: {commands: /cmd_vell}}\n",
    )
    found = rubric("check", written(tmp_path, text)).stderr
    assert "9:9: no criterion uses /cmd_vell: did you mean /cmd_vel?\n" in found
    assert rubric("check", written(tmp_path, text.replace("/cmd_vell", "/cmd_vel"))).stderr == ""


def test_the_rubrics_that_come_with_the_grader_are_not_odd() -> None:
    """No warning in any of them."""
    examples = [page.parent / f"{page.parent.name}.yaml" for page in EXAMPLES.glob("*/README.md")]
    done = rubric("check", *builtin_rubrics().values(), *examples)
    assert (done.exit_code, done.stderr) == (0, "")


def test_the_schema_is_the_one_that_is_shipped() -> None:
    """What editors read, and nothing else."""
    assert rubric("schema").stdout == schema_text()


def test_every_criterion_of_a_file_is_explained(tmp_path: Path) -> None:
    """What it asks and with which values; also for programs."""
    path = written(tmp_path, GOOD + RATE)
    done = rubric("explain", path)
    assert done.exit_code == 0
    for line in ("flows: Publishes the flow", "rate: At 5 Hz", "    rate: 5 Hz ", "pump.py observed for 5 s"):
        assert line in done.stdout
    rows = json.loads(rubric("explain", path, "--json").stdout)["explanations"]
    assert [(r["kind"], r["id"], r["points"]) for r in rows] == [("criterion", "flows", 10), ("criterion", "rate", 2.5)]


def test_all_checks_are_listed() -> None:
    """Each begins a line with its name."""
    starts = {line.split(" ")[0] for line in rubric("explain", "--checks").stdout.splitlines()}
    assert set(known_checks()) <= starts
