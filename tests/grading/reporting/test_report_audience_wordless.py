"""Reasons without numbers: a sentence that holds a number is replaced by a whole one, and no digit is left."""

from __future__ import annotations

import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import criterion, exercise, report

from grader.grading.model.exercise import Feedback, Outcome, Problem, ProblemKind, Shows
from grader.grading.reporting.audience import for_student, numberless


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/cmd_vel: 10.00 Hz, expected 20 ± 1 Hz over 0.0 to 10.0 s", ""),
        ("answered in 3 of 8 cases.", ""),
        ("velocity_publisher.py:31: ValueError: 0x1F", ""),
        ("pump.py:31: EOFError: EOF when reading a line", "pump.py: EOFError: EOF when reading a line"),
        ("std_msgs/msg/Float32MultiArray on /cmd_vel", "std_msgs/msg/Float32MultiArray on /cmd_vel"),
        ("std_msgs/msg/Float32MultiArray on /cmd_vel2", ""),
        ("got nan and -inf", ""),
        ("info about the nanny", "info about the nanny"),
        ("no subscription; the nearest is /odometry", "no subscription; the nearest is /odometry"),
        ("", ""),
    ],
)  # fmt: skip
def test_a_text_is_kept_whole_or_not_at_all(text: str, left: str) -> None:
    """Message types keep the bits in their names, and places in files lose their line."""
    assert numberless(text) == left


@given(st.text(st.characters(categories=["N", "L", "P", "S", "Zs"]), max_size=80))
def test_no_digit_of_any_script_is_left(text: str) -> None:
    """Also not in names that a program made up to carry one."""
    assert not [sign for sign in numberless(text) if sign.isnumeric()]


@pytest.mark.parametrize("text", ["pkg_31/msg/T31", "a/msg/T31", "a/msg/Int3132", "31.py", "x.py:31", "٣١ a³ Ⅷ ½ 一"])
def test_a_program_cannot_smuggle_a_number_in_a_name(text: str) -> None:
    """Only the sizes of types are kept, and none of these is one."""
    assert not [sign for sign in numberless(text) if sign.isnumeric()]


def seen(reason: str, **verdict: object) -> str:
    """Return the reason that a student sees without numbers."""
    one = criterion("c", "Criterion", 10, Outcome.NOT_MET, reason=reason, **verdict)
    whole = report(exercise("e", "1", "E", one, feedback={"c": Feedback(Shows.WITHOUT_NUMBERS)}))
    return for_student(whole, "2026-12-01").exercises[0].verdicts[0].reason


@pytest.mark.parametrize("kind", ProblemKind)
def test_every_kind_of_problem_has_a_sentence(kind: ProblemKind) -> None:
    """Without a number, and without a word in the place of one."""
    said = seen("/cmd_vel: 7357 of 7358", problem=Problem(kind), evidence={"topic": "/cmd_vel"})
    assert said.startswith("/cmd_vel: ")
    assert len(said.split()) > 3
    assert not re.search(r"\d|\ba (number|rate|time|speed|distance|angle|share)\b", said)


def test_a_fault_keeps_what_python_says_unless_it_holds_a_number() -> None:
    """The file is named either way."""
    fault = {"kind": "exception", "file": "pump.py", "line": 9, "text": "NameError: name 'x' is unknown"}
    assert seen("7357 s", evidence={"fault": fault}) == "pump.py raised an exception: NameError: name 'x' is unknown"
    assert seen("7357 s", evidence={"fault": {**fault, "text": "ValueError: 7357"}}) == "pump.py raised an exception"
    exited = {"kind": "exited", "file": "", "process": "pump.py", "text": ""}
    assert seen("pump.py exited after 1.0 s with code 1", evidence={"fault": exited}) == "pump.py ended by itself"


def test_an_unknown_problem_is_told_in_a_sentence_too() -> None:
    """As of a check of a rubric's own."""
    assert seen("7357 Pa") == "this is not what the task asks for"
    assert seen("the pump is off") == "the pump is off"


def test_wrong_fields_are_named() -> None:
    """Without their values; a name with a digit is not repeated."""
    wrong = Problem(ProblemKind.WRONG_VALUE)
    evidence = {"topic": "/cmd_vel", "found": {"linear.x": 0.25, "angular.z": 7357}}
    reason = "t = 0.050 s, /cmd_vel: linear.x is 0.25, expected 0.5; wrong in all 248 messages"
    assert (
        seen(reason, problem=wrong, evidence=evidence)
        == "/cmd_vel: linear.x and angular.z are not what the task asks for"
    )
    evidence = {"topic": "/cmd_vel2", "field": "message"}
    assert seen(reason, problem=wrong, evidence=evidence) == "message is not what the task asks for"
    assert seen(reason, problem=wrong, evidence={"found": {"a7": 1}}) == "a value is wrong"
