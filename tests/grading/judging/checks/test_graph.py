"""The live graph of two nodes that talk in both directions."""

from __future__ import annotations

import pytest
from nodes import graph
from tracing import FLOAT64, Recording

from grader.grading.judging.checks.graph import BidirectionalGraph

CHECK = BidirectionalGraph("/temperature", "/fan_speed")


def test_both_directions_between_two_processes_are_met() -> None:
    """The edges are in the evidence, node, topic, node."""
    finding = CHECK.judge(graph().trace())
    assert finding.credit == 1
    assert finding.evidence["edges"] == [
        ["/temperature_sensor", "/temperature", "/fan_controller"],
        ["/fan_controller", "/fan_speed", "/temperature_sensor"],
    ]


@pytest.mark.parametrize(
    ("left_out", "said"),
    [
        ((0,), "/temperature: /fan_controller subscribes to it, nothing publishes it"),
        ((1,), "/fan_speed: /fan_controller publishes it, nothing subscribes to it"),
        ((2,), "/temperature: /temperature_sensor publishes it, nothing subscribes to it"),
        ((3,), "/fan_speed: /temperature_sensor subscribes to it, nothing publishes it"),
        ((1, 3), "/fan_speed: nothing publishes it and nothing subscribes to it"),
    ],
)
def test_the_missing_edge_is_named(left_out: tuple[int, ...], said: str) -> None:
    """Which topic, which side, and that the other direction is there."""
    finding = CHECK.judge(graph(*left_out).trace())
    assert finding.credit == 0
    assert said in finding.reason
    assert "one direction only" in finding.reason
    assert len(finding.evidence["edges"]) == 1


def test_one_process_with_everything_is_no_conversation() -> None:
    """Two participants are needed; the grader's own does not count."""
    for controller in (1, -1):
        finding = CHECK.judge(graph(controller=controller).trace())
        assert finding.credit == 0


def test_types_must_agree() -> None:
    """The types of both ends are named."""
    finding = CHECK.judge(graph(back_type=FLOAT64).trace())
    assert finding.credit == 0
    assert "/fan_controller publishes std_msgs/msg/Float32, /temperature_sensor subscribes std_msgs/msg/Float64" in (
        finding.reason
    )
    assert "same message type" in finding.hint


def test_both_directions_must_be_there_at_once() -> None:
    """One edge early and the other late are no conversation."""
    whole = graph()
    rec = Recording().snapshot(1.0, [whole.ends[0], whole.ends[2]]).snapshot(2.0, [whole.ends[1], whole.ends[3]])
    finding = CHECK.judge(rec.trace())
    assert finding.credit == 0
    assert finding.reason.endswith("every edge is there, but not between the same two processes at once")


def test_a_crash_is_the_reason_for_a_missing_edge() -> None:
    """The fault is named with its line; a graph seen before it counts."""
    finding = CHECK.judge(graph(2, 3).crashed(0.0, "ImportError: no", 3, "fan_controller.py").trace())
    assert "fan_controller.py:3: ImportError: no" in finding.reason
    assert CHECK.judge(graph().crashed(5.0).trace()).credit == 1


def test_an_empty_graph_is_explained() -> None:
    """Nothing at all."""
    assert CHECK.judge(Recording().trace()).credit == 0
