"""Misspelt and misplaced names in launch files, each with the line to write instead."""

from __future__ import annotations

import pytest
from diagnosis_samples import LAUNCH_SLIPS

from grader.grading.judging.diagnosis import RULES, hint_for
from grader.grading.judging.diagnosis.launch_mistakes import NAMES, TAKES
from grader.runtime.host.launch import ros_names
from grader.runtime.model.trace import ClockKind, Fault, FaultKind, Trace

FILE = "robot.launch.py"


@pytest.mark.parametrize(("code", "text", "hint", "cause"), LAUNCH_SLIPS, ids=[text for _, text, _, _ in LAUNCH_SLIPS])
def test_a_misspelt_name_is_told_with_the_right_one(code: str, text: str, hint: str, cause: str) -> None:
    """As a Python error writes it."""
    fault = Fault(0, FILE, FaultKind.EXCEPTION, text, FILE, 1)
    trace = Trace("alone", ClockKind.VIRTUAL, 1, (fault,))
    assert hint_for(fault, trace, f"{code}\n") == hint
    (rule,) = (rule for rule in RULES if rule.id == cause)
    assert fault.said(rule.text)


def test_nothing_is_said_of_a_node_that_has_its_own_names() -> None:
    """Names of the launch packages mean nothing there."""
    fault = Fault(0, "node.py", FaultKind.EXCEPTION, "NameError: name 'Node' is not defined", "node.py", 1)
    trace = Trace("alone", ClockKind.VIRTUAL, 1, (fault,))
    assert hint_for(fault, trace, "x = Node('a')\n") == "the import is missing: from rclpy.node import Node"


def test_ros_has_every_name_that_is_advised() -> None:
    """The list for hints is a part of that by which launch files are evaluated."""
    for module, names in NAMES.items():
        assert all(ros_names.has(module, name) for name in names.split()), module
    for name, parameters in TAKES.items():
        module = next(module for module, names in NAMES.items() if name in names.split())
        signature = ros_names.signature(ros_names.key_of(module, name))
        assert signature is not None
        assert {*signature.parameters} == {*parameters.split()}, name
