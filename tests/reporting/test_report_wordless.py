"""Sentences without numbers: words stand for what was measured, and no digit of any script is left."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.reporting.audience import without_numbers


@pytest.mark.parametrize(
    ("text", "left"),
    [
        ("/cmd_vel: 10.00 Hz, expected 20 ± 1 Hz over 0.0 to 10.0 s", "/cmd_vel: a rate, expected a rate over a time"),
        ("t = 3.200 s: 31.4 °C is above 30 °C", "t = a time: a temperature is above a temperature"),
        ("linear = (0.5, 0, -1e-05) m/s", "linear = (numbers) m/s"),
        ("angular.z is -0.1 rad/s", "angular.z is an angular speed"),
        ("answered in 3 of 8 cases.", "answered in a number of a number cases."),
        ("velocity_publisher.py:31: ValueError: 0x1F", "velocity_publisher.py: ValueError: a number"),
        ("std_msgs/msg/Float32MultiArray on /cmd_vel2", "std_msgs/msg/Float32MultiArray on /cmd_vel…"),
        ("create_timer(0.05, self.tick)", "create_timer(a number, self.tick)"),
        ("got nan and -inf", "got numbers"),
        ("no message in 10.0 s, expected 200", "no message in a time, expected a number"),
        ("no subscription; the nearest is /odometry", "no subscription; the nearest is /odometry"),
        ("", ""),
    ],
)
def test_what_is_left_of_a_sentence(text: str, left: str) -> None:
    """Units say what kind of number it was; message types keep the bits in their names."""
    assert without_numbers(text) == left


@given(st.text(st.characters(categories=["N", "L", "P", "S", "Zs"]), max_size=80))
def test_no_digit_of_any_script_is_left(text: str) -> None:
    """Also not in names that a program made up to carry one."""
    assert not [sign for sign in without_numbers(text) if sign.isnumeric()]


@pytest.mark.parametrize("text", ["pkg_31/msg/T31", "a/msg/T31", "a/msg/Int3132", "31.py", "x.py:31", "٣١ a³ Ⅷ ½ 一"])
def test_a_program_cannot_smuggle_a_number_in_a_name(text: str) -> None:
    """Only the sizes of types are kept, and none of these is one."""
    assert not [sign for sign in without_numbers(text) if sign.isnumeric()]
