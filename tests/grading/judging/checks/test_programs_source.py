"""What a file uses and avoids, by its text: aliases, callbacks, and what cannot be read."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path

import pytest
from tracing import Recording

from grader.grading.judging.checks.programs import SourceAvoids, SourceUses
from grader.grading.judging.findings import FAULT_KEY
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Criterion, Exercise, Location, Outcome
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import FaultKind

NODE = "rclpy.node.Node"
USES = SourceUses("node.py", (NODE,), ("create_timer", "rclpy.spin"))
SLEEPS = SourceAvoids("node.py", ("time.sleep",), "callbacks")

PLAIN = """
import rclpy
from rclpy.node import Node

class Talker(Node):
    def __init__(self):
        super().__init__('talker')
        self.timer = self.create_timer(0.1, self.tick)

    def tick(self):
        pass

def main():
    rclpy.init()
    rclpy.spin(Talker())
"""


def judged(check: SourceUses | SourceAvoids, text: str) -> tuple[Fraction, str]:
    finding = check.judge_sources(Recording().trace(), {"node.py": text})
    return finding.credit, finding.reason


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("from rclpy.node import Node", "from rclpy.node import Node as Base").replace("(Node)", "(Base)"),
        PLAIN.replace("from rclpy.node import Node", "import rclpy.node").replace("(Node)", "(rclpy.node.Node)"),
        PLAIN.replace("from rclpy.node import Node", "import rclpy.node as rn").replace("(Node)", "(rn.Node)"),
        PLAIN.replace("from rclpy.node import Node", "from rclpy.node import *"),
        PLAIN.replace("from rclpy.node import Node", "from rclpy import node").replace("(Node)", "(node.Node)"),
        PLAIN.replace("rclpy.spin(", "spin(").replace("import rclpy\n", "import rclpy\nfrom rclpy import spin\n"),
        PLAIN.replace("class Talker(Node)", "class Base(Node):\n    pass\n\nclass Talker(Base)"),
        PLAIN.replace("self.timer = self.create_timer", "super().create_timer"),
        "\ufeff" + PLAIN.replace("\n", "\r\n"),
    ],
)
def test_what_is_used_is_found_under_any_name(text: str) -> None:
    """Imports, aliases, classes between, byte order marks."""
    credit, reason = judged(USES, text)
    assert credit == 1, reason
    assert "node.py: class " in reason


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (PLAIN.replace("self.create_timer(", "print("), "expected a call of create_timer, found none"),
        (PLAIN.replace("(Node)", ""), "expected a class that derives from rclpy.node.Node, found none"),
        (PLAIN.replace("from rclpy.node import Node", "from mine import Node"), "a class that derives from"),
        (PLAIN.replace("rclpy.spin(", "self.spin("), "expected a call of rclpy.spin"),
        (PLAIN.replace("rclpy.spin(", "# rclpy.spin("), "expected a call of rclpy.spin"),
        (PLAIN.replace("self.create_timer(0.1, self.tick)", "self.create_timer"), "a call of create_timer"),
        ("", "a class that derives from rclpy.node.Node and a call of create_timer and a call of rclpy.spin"),
    ],
)
def test_what_is_not_used_is_named(text: str, said: str) -> None:
    """A comment is no call, and a name without brackets neither."""
    credit, reason = judged(USES, text)
    assert credit == 0
    assert said in reason


TICK = "    def tick(self):\n        "


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (
            PLAIN.replace(TICK, TICK + "time.sleep(1)\n        ").replace("import rclpy\n", "import rclpy, time\n"),
            ":11: ",
        ),
        (
            PLAIN.replace(TICK, TICK + "t.sleep(1)\n        ").replace("import rclpy\n", "import rclpy, time as t\n"),
            ":11",
        ),
        (
            PLAIN.replace(TICK, TICK + "pause(1)\n        ").replace(
                "import rclpy\n", "import rclpy\nfrom time import sleep as pause\n"
            ),
            ":12: time.sleep in a callback",
        ),
        (
            PLAIN.replace(TICK, TICK + "self.wait()\n        ").replace(
                "def main", "    def wait(self):\n        import time\n        time.sleep(1)\n\ndef main"
            ),
            "time.sleep in a callback",
        ),
        (
            PLAIN.replace("self.tick)", "lambda: time.sleep(1))").replace("import rclpy\n", "import rclpy, time\n"),
            ":8: ",
        ),
        (
            PLAIN.replace("self.tick)", "callback=functools.partial(self.tick, 1))")
            .replace(TICK, TICK + "time.sleep(1)\n        ")
            .replace("import rclpy\n", "import rclpy, time, functools\n"),
            ":11: ",
        ),
    ],
)
def test_a_sleep_in_a_callback_is_found(text: str, said: str) -> None:
    """Under any name, in what the callback calls, in a lambda, or handed over wrapped."""
    credit, reason = judged(SLEEPS, text)
    assert credit == 0, reason
    assert said in reason
    assert judged(SourceAvoids("node.py", ("sleep",)), text)[0] == 0


@pytest.mark.parametrize(
    "text",
    [
        PLAIN,
        PLAIN.replace("rclpy.init()", "rclpy.init()\n    time.sleep(1)").replace(
            "import rclpy\n", "import rclpy, time\n"
        ),
        PLAIN.replace(TICK, TICK + "self.sleep(1)\n        "),
        PLAIN.replace(TICK, TICK + "time.sleeping = time.sleep\n        "),
    ],
)
def test_a_sleep_elsewhere_is_none_in_a_callback(text: str) -> None:
    """In main, of another kind, or only named."""
    assert judged(SLEEPS, text)[0] == 1


def test_globals_can_be_forbidden() -> None:
    """Only if the rubric sets it."""
    text = PLAIN.replace(TICK, TICK + "global count\n        ")
    finding = SourceAvoids("node.py", globals=True).judge_sources(Recording().trace(), {"node.py": text})
    assert (finding.credit, finding.location) == (0, Location("node.py", 11))
    assert "node.py:11: global count" in finding.reason
    assert judged(SourceAvoids("node.py"), text)[0] == 1
    assert judged(SourceAvoids("node.py", globals=True), PLAIN)[0] == 1


def test_what_cannot_be_read_is_the_students_only_with_a_syntax_error() -> None:
    """A file that was not kept, or is endless, leaves the question undecided."""
    for check in (USES, SLEEPS):
        broken = Recording().fault(0.0, FaultKind.SYNTAX_ERROR, "SyntaxError: invalid syntax", 3)
        finding = check.judge_sources(broken.trace(), {"node.py": "def (:"})
        assert (finding.credit, FAULT_KEY in finding.evidence) == (0, True)
        for sources in ({}, {"node.py": "x = 1\n" * 50_000}):
            with pytest.raises(HarnessError):
                check.judge_sources(Recording().trace(), sources)
        with pytest.raises(HarnessError):
            check.judge(Recording().trace())


def test_an_exercise_hands_over_the_files() -> None:
    """The place is that of the file in the submission; without texts it is unknown."""
    text = PLAIN.replace(TICK, TICK + "time.sleep(1)\n        ").replace("import rclpy\n", "import rclpy, time\n")
    row = Criterion("calm", "Calm", Fraction(5), "alone", SLEEPS)
    scenario = Scenario("alone", ("node.py",), Span(NS_PER_S))
    exercise = Exercise("e", "1", "E", True, ("node.py",), (scenario,), (row,), "sha256:0")
    files = {"node.py": StudentFile("node.py", "src/node.py")}
    submission = Submission("s", "s", Path("s"), "sha256:1", files)
    traces = {"alone": Recording().trace()}
    (verdict,) = judge_exercise(exercise, traces, submission, {"node.py": text}).verdicts
    assert (verdict.outcome, verdict.location) == (Outcome.NOT_MET, Location("src/node.py", 11))
    (verdict,) = judge_exercise(exercise, traces, submission).verdicts
    assert verdict.outcome is Outcome.UNDECIDED
