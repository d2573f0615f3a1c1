"""Transforms: frames, places, turns and rates."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.topics import Transform
from grader.grading.judging.findings import FAULT_KEY

TF = "tf2_msgs/msg/TFMessage"
HALF = math.sqrt(0.5)
CHECK = Transform(
    "base_link", "laser", False, {"x": 0.2, "z": 0.1}, {"z": HALF, "w": HALF}, rate=10.0, rate_tolerance=0.5
)


def transform(
    parent: str = "base_link",
    child: str = "laser",
    move: Sequence[float] = (0.2, 0.0, 0.1),
    turn: Sequence[float] = (0.0, 0.0, HALF, HALF),
) -> dict[str, Any]:
    return {
        "header": {"frame_id": parent},
        "child_frame_id": child,
        "transform": {
            "translation": dict(zip("xyz", move, strict=True)),
            "rotation": dict(zip("xyzw", turn, strict=True)),
        },
    }


def sent(rate: float = 10.0, topic: str = "/tf", count: int = 50, others: bool = False, **kw: Any) -> Recording:
    rec = Recording(10.0)
    for k in range(count):
        found = [transform("map", "odom")] * others + [transform(**kw)]
        rec.message(1 + k / rate, topic, {"transforms": found}, TF)
    return rec


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (sent(), 1, "base_link → laser: 50 transforms"),
        (sent(others=True), 1, "50 transforms"),
        (sent(turn=(0, 0, -HALF, -HALF)), 1, ""),
        (sent(move=(0.2009, 9.0, 0.1)), 1, ""),
        (sent(parent="/base_link"), 1, ""),
        (sent(move=(0.3, 0.0, 0.1)), 0, "t = 1.000 s, base_link → laser: translation x is 0.3 m, expected 0.2 m"),
        (sent(move=(0.2, 0.0, math.nan)), 0, "translation z is nan m"),
        (sent(turn=(0, 0, HALF, -HALF)), 0, "rotation is (0, 0, 0.707107, -0.707107), expected (0, 0, 0.707107, 0."),
        (sent(turn=(0, 0, 0, 1)), 0, "rotation is"),
        (sent(parent="laser", child="base_link"), 0, "found laser → base_link"),
        (sent(child="lidar"), 0, "no transform base_link → laser; found base_link → lidar"),
        (sent(rate=5.0, count=20), 0, "20 transforms, 5.000 Hz, expected 10 ± 0.5 Hz"),
        (sent(count=1), 0, "0.000 Hz"),
        (sent(topic="/tf_static"), 0, "/tf: no transform; there are some on /tf_static"),
        (Recording(), 0, "/tf: no publisher"),
        (Recording().message(1, "/tf", {"transforms": [3]}, TF), 0, ""),
    ],
)
def test_transforms(rec: Recording, credit: int, said: str) -> None:
    """Everything published has to be right."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_static_one_comes_once() -> None:
    """On either topic where that is free."""
    once = sent(count=1, topic="/tf_static")
    assert Transform("base_link", "laser", static=True).judge(once.trace()).credit == 1
    assert Transform("base_link", "laser").judge(once.trace()).credit == 1
    assert Transform("base_link", "laser", static=True).judge(sent().trace()).credit == 0


def test_frames_the_wrong_way_round_and_crashes_are_named() -> None:
    """The hint tells which is which."""
    finding = CHECK.judge(sent(parent="laser", child="base_link").trace())
    assert finding.hint == "header.frame_id is the parent, base_link, and child_frame_id is laser"
    assert FAULT_KEY in CHECK.judge(Recording().crashed(0.0).trace()).evidence
    assert FAULT_KEY in CHECK.judge(sent(count=1).crashed(1.05).trace()).evidence
