"""Messages that are late or lost on their way: a program that copes with that keeps its point, another one does not."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from rosbags.highlevel import AnyReader
from tiers import more

from grader.cli import main

pytestmark = pytest.mark.ros

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: follower, number: 1, title: Follow the target}
files: [follower.py]
scenarios:
  - id: bad_connection
    processes: [follower.py]
    observe: {duration: 10 s}
    stimuli:
      - messages:
          topic: /target
          type: std_msgs/msg/Float64
          period: 100 ms
          values: [{data: 1.5}]
          repeats: 100
    connections:
      - {topic: /target, delay: {between: [5 ms, 60 ms]}, lose: 0.4}
criteria:
  - id: steady
    title: Commands at 10 Hz, whatever arrives
    points: 1
    scenario: bad_connection
    check: {topic_rate: {topic: /command, rate: 10 Hz, tolerance: 0.5 Hz}}
"""
COPES = """
import rclpy
from std_msgs.msg import Float64

rclpy.init()
node = rclpy.create_node("follower")
target = [0.0]
commands = node.create_publisher(Float64, "/command", 10)
node.create_subscription(Float64, "/target", lambda message: target.append(message.data), 10)
node.create_timer(0.1, lambda: commands.publish(Float64(data=target[-1])))
rclpy.spin(node)
"""
ECHOES = """
import rclpy
from std_msgs.msg import Float64

rclpy.init()
node = rclpy.create_node("follower")
commands = node.create_publisher(Float64, "/command", 10)
node.create_subscription(Float64, "/target", commands.publish, 10)
rclpy.spin(node)
"""


def grade(folder: Path, program: str, name: str, rubric: str = RUBRIC, seed: int = 1) -> tuple[bytes, Path]:
    """Grade a program, and return the report and the folder of the evidence."""
    submission, report, evidence = folder / name, folder / f"{name}.json", folder / f"{name}_evidence"
    submission.mkdir()
    (submission / "follower.py").write_text(program, encoding="utf-8")
    (folder / "rubric.yaml").write_text(rubric, encoding="utf-8")
    words = [str(submission), "--rubric", str(folder / "rubric.yaml"), "--seed", str(seed)]
    done = CliRunner().invoke(
        main.app, [*words, "-o", f"json={report}", "-o", f"evidence={evidence}"], catch_exceptions=False
    )
    assert done.exit_code in (0, 1), done.output
    return report.read_bytes(), evidence


def arrivals(evidence: Path, topic: str = "/target") -> list[tuple[int, float]]:
    """Return the messages on a topic: milliseconds since the recording began, and the number."""
    (recording,) = [path for path in evidence.iterdir() if path.is_dir()]
    with AnyReader([recording]) as reader:
        chosen = [c for c in reader.connections if c.topic == topic]
        found = [(at, reader.deserialize(raw, c.msgtype).data) for c, at, raw in reader.messages(chosen)]
        return [((at - reader.start_time) // 1_000_000, data) for at, data in found]


@pytest.mark.nightly
def test_who_copes_with_lost_messages_keeps_the_point(tmp_path: Path) -> None:
    """The evidence holds what arrived; judged again it gives the same report. Another seed loses others."""
    copes, evidence = grade(tmp_path, COPES, "copes")
    echoes, other = grade(tmp_path, ECHOES, "echoes")
    scores = [json.loads(report)["score"] for report in (copes, echoes)]
    assert scores == [1, 0]
    for report, kept in ((copes, evidence), (echoes, other)):
        again = tmp_path / "again.json"
        words = ["rejudge", str(kept), "--verify", "--rubric", str(tmp_path / "rubric.yaml"), "-o", f"json={again}"]
        CliRunner().invoke(main.app, words, catch_exceptions=False)
        assert again.read_bytes() == report
    found = arrivals(evidence)
    assert 40 <= len(found) <= 80
    assert found == sorted(found)
    assert len({at % 100 for at, _ in found}) > 10
    _, same = grade(tmp_path, COPES, "same")
    assert arrivals(same) == found
    _, different = grade(tmp_path, COPES, "different", seed=2)
    assert arrivals(different) != found


@pytest.mark.long
def test_without_the_condition_both_keep_it(tmp_path: Path) -> None:
    """The echo loses its point by the losses alone."""
    perfect, _, rest = RUBRIC.partition("    connections:")
    rubric = perfect + rest[rest.index("criteria:") :]
    report, _ = grade(tmp_path, ECHOES, "echoes", rubric)
    assert json.loads(report)["score"] == 1


TWO_STREAMS = """\
    stimuli:
      - messages:
          {topic: /target, type: std_msgs/msg/Float64, start: 2 s, stop: 3 s,
           period: 200 ms, values: [{data: 1}], repeats: 4}
      - messages:
          {topic: /target, type: std_msgs/msg/Float64, period: 200 ms, start: 3100 ms, values: [{data: 2}], repeats: 4}
"""


@pytest.mark.parametrize(
    "delay", [*more([""]), "    connections: [{topic: /target, delay: 800 ms}]\n"], ids=["at once", "late"]
)
def test_a_publisher_leaves_after_its_last_message(tmp_path: Path, delay: str) -> None:
    """Also if another one follows on the topic before: every message arrives."""
    head, _, rest = RUBRIC.partition("    stimuli:")
    rubric = head.replace("10 s", "5 s") + TWO_STREAMS + delay + rest[rest.index("criteria:") :]
    _, evidence = grade(tmp_path, ECHOES, "echoes", rubric)
    for topic in ("/target", "/command"):
        assert [data for _, data in arrivals(evidence, topic)] == [1.0] * 4 + [2.0] * 4
