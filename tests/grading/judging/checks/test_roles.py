"""Which parameters of a check name a topic that should speak or be heard: hint rules know it by the roles alone."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from check_instances import INSTANCES
from tracing import FLOAT32, Recording

from grader.grading.judging.checks import CHECKS
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Criterion, Exercise, Outcome, roles_of, texts_under
from grader.grading.model.report import Verdict
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission

FILE = "talker.py"
SOURCE = """\
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32


class Talker(Node):
    def __init__(self):
        super().__init__('talker')
        self.pub = self.create_publisher(Float32, '/elsewhere', 10)
        self.create_timer(0.1, self.tick)
        self.create_subscription(Float32, '/temperature', self.heard, 10)

    def heard(self, msg):
        self.get_logger().info(f'heard {msg.data}')

    def tick(self):
        self.pub.publish(Float32(data=1.0))
"""
#: Why a check of a topic declares neither a topic that should speak nor one that should be heard or is given.
WITHOUT = {
    "bidirectional_graph": "it looks at endpoints; the problem NO_EDGE tells rules which topics",
    "qos": "it looks at endpoints; which end depends on `kind`, and an endpoint may be silent",
    "topic_names": "it looks at endpoints, of several topics at once",
    "silence": "no message may come",
}
#: Why a check misses something else of the talker first.
NOT_ASKED = {"lifecycle_states": "no transition was requested", "parameter_takes_effect": "no parameter was set"}
SPEAKING = {name: check for name, check in INSTANCES.items() if name in CHECKS and roles_of(CHECKS[name]).speaks}


def test_every_check_of_a_topic_says_what_it_is() -> None:
    """A topic that should speak, that should be heard, or that the grader publishes; or there is a reason why not."""
    silent = {name for name, check in INSTANCES.items() if hasattr(check, "subscribes")}  # its topics are tuples
    for name, kind in CHECKS.items():
        roles, check = roles_of(kind), INSTANCES[name]
        declared = texts_under(check, *roles.speaks, *roles.hears, *roles.given, *roles.logs)
        if texts_under(check, *roles.topics) and not declared:
            silent.add(name)
    assert silent == WITHOUT.keys()


def judged(name: str) -> Verdict:
    """Judge the talker, which publishes on another topic, by one check."""
    rec = Recording(10.0, process=FILE).endpoint("publisher", "/elsewhere", FLOAT32, "/talker")
    rec.endpoint("subscription", "/temperature", FLOAT32, "/talker")
    for tick in range(1, 90):
        rec.deliver(tick / 10, "/temperature", {"data": 20.0 + tick % 10}, FLOAT32)
        rec.message(tick / 10, "/elsewhere", {"data": 1.0}, FLOAT32)
    criterion = Criterion("it", "", Fraction(1), "alone", SPEAKING[name])
    scenario = Scenario("alone", (FILE,), Span(10 * NS_PER_S))
    exercise = Exercise("talking", "1", "", False, (FILE,), (scenario,), (criterion,), "sha256:1")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    return judge_exercise(exercise, {"alone": rec.trace()}, submission, {FILE: SOURCE}).verdicts[0]


@pytest.mark.parametrize("name", sorted(SPEAKING.keys() - NOT_ASKED.keys()))
def test_a_silent_topic_gets_a_hint_with_its_line(name: str) -> None:
    """Whichever check misses the messages: the publisher of the other topic is named."""
    verdict = judged(name)
    assert verdict.outcome is not Outcome.MET
    (topic,) = texts_under(SPEAKING[name], *roles_of(CHECKS[name]).speaks)
    assert f"'/elsewhere', 10) publishes on /elsewhere: the task asks for {topic}" in verdict.hint
    assert verdict.location is not None
    assert verdict.location.line == 9
