"""A check that declares of which topic it judges the logs: the general rules explain it, and others wait for it."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from pathlib import Path
from typing import ClassVar

from tracing import Recording

from grader.api import NS_PER_S, Finding, Roles, Trace, met, not_met, printed_lines, student_records
from grader.api.unstable import WrongLogFacts, only_printed
from grader.grading.judging.checks.waiting import WaitsGracefully
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Check, Criterion, Exercise
from grader.grading.model.report import Verdict
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission

FILE = "listener.py"
TYPE = "std_msgs/msg/Float32"


@dataclass(frozen=True)
class _LogsLevel:
    """The check of an author: the level is in a log."""

    process: str = FILE
    topic: str = "/level"
    absent: bool = False

    def judge(self, trace: Trace) -> Finding:
        if any("1.5" in record.text for record in student_records(trace, self.process)):
            return met("it is logged")
        if any("1.5" in line.text for line in printed_lines(trace, self.process)):
            return only_printed("it is printed", None, "")
        return not_met("it is not logged", facts=WrongLogFacts("nothing", 0, ("data",), self.absent))


@dataclass(frozen=True)
class _Declared(_LogsLevel):
    roles: ClassVar[Roles] = Roles(logs=("topic",))


WAITS = WaitsGracefully(FILE, "/level", NS_PER_S)


def listening() -> Recording:
    rec = Recording(5.0, process=FILE).endpoint("subscription", "/level", TYPE, "/listener")
    return rec.deliver(2.0, "/level", {"data": 1.5}, TYPE)


def judged(rec: Recording, source: str, *checks: Check) -> list[Verdict]:
    """Judge checks in one scenario; return a verdict for each."""
    criteria = tuple(Criterion(f"c{k}", "", Fraction(1), "alone", check) for k, check in enumerate(checks))
    scenario = Scenario("alone", (FILE,), Span(5 * NS_PER_S))
    exercise = Exercise("levels", "1", "", False, (FILE,), (scenario,), criteria, "sha256:1")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    return list(judge_exercise(exercise, {"alone": rec.trace()}, submission, {FILE: source}).verdicts)


PRINTS = "def heard(msg):\n    print(f'level {msg.data}')\n"
HIDES = """\
import rclpy
node = rclpy.create_node('listener')
def heard(msg):
    node.get_logger().debug(f'level {msg.data}')
node.create_subscription(Float32, 'level', heard, 10)
rclpy.spin(node)
"""


def test_what_is_printed_instead_is_explained_by_the_general_rule() -> None:
    """With the line; without the role nobody knows that the check is about logs."""
    rec = listening().line(2.0, "level 1.5")
    (verdict,) = judged(rec, PRINTS, _Declared())
    assert verdict.hint == "print(f'level {msg.data}') does not log: write self.get_logger().info(...)"
    assert verdict.location is not None
    assert verdict.location.line == 2
    (verdict,) = judged(rec, PRINTS, _LogsLevel())
    assert verdict.hint == ""


def test_what_goes_into_a_file_is_no_log() -> None:
    """The rule is asked where the check says that no log holds anything like it."""
    source = f"{HIDES}open('levels.txt', 'w').write(str(node))\n".replace("debug", "info")
    rec = listening().log(0.5, "started")
    (verdict,) = judged(rec, source, _Declared(absent=True))
    assert "the grader does not see what goes into a file" in verdict.hint
    (verdict,) = judged(rec, source, _Declared())
    assert "into a file" not in verdict.hint


def test_a_log_of_the_fields_at_a_hidden_level_is_named() -> None:
    """The check says which fields; a record about something else is no reason."""
    rec = listening().log(0.5, "started")
    (verdict,) = judged(rec, HIDES, _Declared())
    assert "is not shown, because the default level is INFO" in verdict.hint
    (verdict,) = judged(rec, HIDES.replace("msg.data", "msg.other"), _Declared())
    assert "is not shown" not in verdict.hint


def test_waiting_without_a_sign_of_data_waits_for_that_check() -> None:
    """Whatever its name is; one about another topic, or one that declares nothing, blocks nothing."""
    rec = listening()
    assert judged(rec, "", _Declared(), WAITS)[1].blocked_by == "c0"
    assert judged(rec, "", _Declared(topic="/other"), WAITS)[1].blocked_by == ""
    assert judged(rec, "", _LogsLevel(), WAITS)[1].blocked_by == ""
