"""Connections of a scenario: what can be written, and the message and place of each mistake."""

from __future__ import annotations

from pathlib import Path

import pytest

from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.scenario import Connection, TimeBetween
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.plan import PlannedConnection, Surroundings, plan_scenario

MS = 1_000_000
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: follower, number: 1, title: Follow}
files: [follower.py]
scenarios:
  - id: alone
    processes: [follower.py]
    observe: {duration: 2 s}
    stimuli:
      - messages: {topic: /target, type: std_msgs/msg/Float64, period: 100 ms, values: [{data: 1.5}], repeats: 10}
    connections:
CONNECTIONS
criteria:
  - {id: rate, title: A rate, points: 1, scenario: alone, check: {publishes: {topic: /a, type: std_msgs/msg/String}}}
"""


def rubric(folder: Path, *connections: str, text: str = RUBRIC) -> Path:
    """Write a rubric with some connections."""
    lines = "\n".join(f"      - {one}" for one in connections)
    path = folder / "r.yaml"
    path.write_text(text.replace("CONNECTIONS", lines), encoding="utf-8")
    return path


def test_delays_and_losses_are_read_and_planned(tmp_path: Path) -> None:
    """Each topic has draws of its own, which follow from the seed."""
    path = rubric(tmp_path, "{topic: /target, delay: {between: [0 s, 50 ms]}, lose: 0.25}")
    (scenario,) = read_rubric(path).scenarios
    submission = Submission("x", "x", tmp_path, "", {"follower.py": StudentFile("follower.py", "follower.py")})
    assert scenario.connections == (Connection("/target", TimeBetween(0, 50 * MS), 0.25),)
    plans = [plan_scenario("follower", scenario, submission, Surroundings(seed, "virtual")) for seed in (1, 1, 2)]
    first, same, other = (plan.connections for plan in plans)
    assert first == same != other
    assert first == (PlannedConnection("/target", (0, 50 * MS), 0.25, first[0].seed),)


@pytest.mark.parametrize(
    ("connections", "message"),
    [
        (["{topic: /targte, lose: 0.1}"], "expected a topic that a stimulus publishes on"),
        (["{topic: /target, lose: 1.1}"], "expected a share from 0 to 1, such as 0.2"),
        (["{topic: /target, lose: -0.1}"], "expected a share from 0 to 1, such as 0.2"),
        (["{topic: /target, lose: .nan}"], "expected"),
        (["{topic: /target}"], "expected a `delay`, or a share of messages to `lose`, found neither"),
        (["{topic: /target, delay: 0 s, lose: 0}"], "expected a `delay`, or a share of messages to `lose`"),
        (["{topic: /target, delay: 2 s}"], "expected a delay shorter than `observe`"),
        (["{topic: /target, delay: {between: [50 ms, 10 ms]}}"], "expected"),
        (["{topic: /target, lose: 0.1}", "{topic: /target, delay: 1 ms}"], "expected each topic in `connections` once"),
        (["{topic: /target, lost: 0.1}"], "expected `topic`, `delay` or `lose`"),
    ],
)
def test_mistakes_are_told_at_their_place(tmp_path: Path, connections: list[str], message: str) -> None:
    """With the line of the last connection."""
    with pytest.raises(RubricError) as refused:
        read_rubric(rubric(tmp_path, *connections))
    assert message in str(refused.value)
    assert f"r.yaml:{10 + len(connections)}:" in str(refused.value)


def test_a_drawn_observation_waits_for_the_last_message(tmp_path: Path) -> None:
    """The delay counts where an observation may not end before every case has come."""
    text = RUBRIC.replace("duration: 2 s", "duration: {between: [1040 ms, 2 s]}")
    read_rubric(rubric(tmp_path, "{topic: /target, delay: 40 ms}", text=text))
    with pytest.raises(RubricError, match="every case is played"):
        read_rubric(rubric(tmp_path, "{topic: /target, delay: 41 ms}", text=text))


def test_topics_of_a_simulation_are_known(tmp_path: Path) -> None:
    """They are those that it says it publishes on."""
    text = RUBRIC.replace("    connections:", "      - simulation: {turtle: {}}\n    connections:")
    (scenario,) = read_rubric(rubric(tmp_path, "{topic: /turtle1/pose, lose: 0.5}", text=text)).scenarios
    assert [one.topic for one in scenario.connections] == ["/turtle1/pose"]
    with pytest.raises(RubricError, match="found `/turtle1/posse`"):
        read_rubric(rubric(tmp_path, "{topic: /turtle1/posse, lose: 0.5}", text=text))
