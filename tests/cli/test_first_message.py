"""A rubric that counts only what is sent after discovery, with real nodes: grading, and its self-test."""

import json
from pathlib import Path

import pytest
from click.testing import CliRunner
from tiers import each

from grader.cli.main import app

pytest.importorskip("rclpy")

pytestmark = pytest.mark.ros

RUBRIC = """
schema: grader/rubric/v1
exercise: {id: talk, number: "1", title: Talk, required: true}
files: [talker.py]
scenarios:
  - id: alone
    processes: [talker.py]
    observe: {duration: 2 s}
criteria:
  - id: publishes
    title: Publishes
    points: 5
    scenario: alone
    check:
      publishes: {topic: /chatter, type: std_msgs/msg/String%s}
    hint: publish from a timer
"""
STRICT, USUAL = RUBRIC % ", after_discovery: true", RUBRIC % ""
TALKER = """
import rclpy
from rclpy.node import Node
from std_msgs.msg import String

class Talker(Node):
    def __init__(self):
        super().__init__('talker')
        self.publisher = self.create_publisher(String, 'chatter', 10)
        self.create_timer(0.5, self.tick)

    def tick(self):
        self.publisher.publish(String(data='hello'))

rclpy.init()
rclpy.spin(Talker())
"""
ONCE = TALKER.replace("self.create_timer(0.5, self.tick)", "self.tick()")


def graded(tmp_path: Path, rubric: str, program: str) -> tuple[float, str]:
    """Return the points of a program, and the report as text."""
    tmp_path.chmod(0o755)
    (tmp_path / "mine.yaml").write_text(rubric, encoding="utf-8")
    submission = tmp_path / "submission"
    submission.mkdir(exist_ok=True)
    (submission / "talker.py").write_text(program, encoding="utf-8")
    result = CliRunner().invoke(app, ["--rubric", str(tmp_path / "mine.yaml"), str(submission)])
    text = " ".join(result.output.split())
    return float(text.partition("submission: ")[2].partition(" of 5 points")[0]), text


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize(
    ("rubric", "program", "points", "noted"),
    each([(STRICT, ONCE, 0, True), (USUAL, ONCE, 5, True), (USUAL, TALKER, 5, False), (STRICT, TALKER, 5, False)], 4),
    ids=["strict once", "usual once", "usual right", "strict right"],
)
def test_a_message_without_a_listener_counts_if_the_rubric_says_so(
    tmp_path: Path, rubric: str, program: str, points: int, noted: bool
) -> None:
    """The note is there in either case, and a program with a timer gets none."""
    found, text = graded(tmp_path, rubric, program)
    assert found == points
    assert ("on a real system no subscription would have received it" in text) == noted
    assert ("before any subscription could discover it" in text) == (points == 0)


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize(("rubric", "survivors"), [(USUAL, 1), (STRICT, 0)], ids=["usual", "strict"])
def test_a_self_test_knows_it(tmp_path: Path, rubric: str, survivors: int) -> None:
    """A callback that is called once instead of by a timer survives where its message counts."""
    assert graded(tmp_path, rubric, TALKER)[0] == 5
    command = ["selftest", str(tmp_path / "mine.yaml"), "--reference", str(tmp_path / "submission")]
    result = CliRunner().invoke(app, [*command, "--only", "*:timer_once:*", "--json"])
    found = json.loads(result.stdout)
    assert json.dumps(found).count("timer_once") > 0
    assert (result.exit_code == 0) == (survivors == 0)
