"""What the grader publishes: schedules in order, numbers in the student's type."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from scripted import FLOAT, MS, numbers, plan

from grader.runtime.message_classes import number_message, numeric_field
from grader.runtime.stimuli.events import Appear, Disappear
from grader.runtime.stimuli.numbers import PublishNumber
from grader.runtime.stimuli.recorded import PlannedRecording, PublishRecorded


def test_numbers_follow_each_other_in_their_period() -> None:
    """Each as often as it is held; the publisher is there from the start and stays."""
    due = plan(stimuli=(numbers((20.0, 0), (30.0, 0), start_ms=500, period_ms=200, repeats=2),)).events()
    assert due == [
        Appear(0, "/temperature", FLOAT),
        PublishNumber(500 * MS, "/temperature", (20.0, 0)),
        PublishNumber(700 * MS, "/temperature", (20.0, 0)),
        PublishNumber(900 * MS, "/temperature", (30.0, 0)),
        PublishNumber(1100 * MS, "/temperature", (30.0, 0)),
    ]


def test_streams_are_merged_by_time_and_keep_their_order() -> None:
    """At one instant, the one named first goes first; a publisher appears before it publishes."""
    recording = PlannedRecording("/odom", "nav_msgs/msg/Odometry", 500 * MS, 501 * MS, ((500 * MS, b"", {}),))
    streams = (numbers((1.0, 0), topic="/a", start_ms=500), numbers((2.0, 0), topic="/b", start_ms=500))
    due = plan(stimuli=(*streams, recording)).events()
    assert due == [
        Appear(0, "/a", FLOAT),
        Appear(0, "/b", FLOAT),
        PublishNumber(500 * MS, "/a", (1.0, 0)),
        PublishNumber(500 * MS, "/b", (2.0, 0)),
        Appear(500 * MS, "/odom", "nav_msgs/msg/Odometry", fixed=True),
        PublishRecorded(500 * MS, "/odom", b"", {}),
        Disappear(501 * MS, "/odom"),
    ]


@pytest.mark.parametrize(
    ("interface", "field"),
    [
        (FLOAT, ("data", False)),
        ("std_msgs/msg/Float64", ("data", False)),
        ("sensor_msgs/msg/Temperature", ("temperature", False)),
        ("sensor_msgs/msg/FluidPressure", ("fluid_pressure", False)),
        ("sensor_msgs/msg/Range", None),
        ("geometry_msgs/msg/Point", None),
        ("builtin_interfaces/msg/Time", None),
        *((f"std_msgs/msg/{sign}Int{bits}", ("data", True)) for sign in ("", "U") for bits in (8, 16, 32, 64)),
        ("std_msgs/msg/String", None),
        ("std_msgs/msg/Bool", None),
        ("std_msgs/msg/Char", ("data", True)),
        ("std_msgs/msg/Byte", None),
        ("std_msgs/msg/Empty", None),
        ("std_msgs/msg/Int32MultiArray", None),
        ("sensor_msgs/msg/Image", None),
        ("geometry_msgs/msg/Twist", None),
        ("nav_msgs/msg/Odometry", None),
        ("no_such_msgs/msg/Thing", None),
        ("std_msgs/msg/NoSuchThing", None),
        ("std_msgs/Float32", None),
        ("../std_msgs/msg/Float32", None),
        ("os.path/msg/Float32", None),
        ("", None),
    ],
)
def test_types_that_carry_a_number(interface: str, field: tuple[str, bool] | None) -> None:
    """Any numeric type of std_msgs, and what a sensor measures if that is one number; nothing outside packages."""
    assert numeric_field(interface) == field


@pytest.mark.parametrize(
    ("interface", "number", "value"),
    [
        (FLOAT, (25.0, 0), 25.0),
        ("std_msgs/msg/Float64", (25.0, 1), 25.001),
        ("std_msgs/msg/Float64", (25.0, -1), 24.999),
        ("std_msgs/msg/Int32", (25.0, 1), 26),
        ("std_msgs/msg/Int32", (25.0, -1), 24),
        ("std_msgs/msg/UInt8", (100.0, 0), 100),
        ("std_msgs/msg/Int64", (27.6, 0), 28),
    ],
)
def test_a_number_in_a_type(interface: str, number: tuple[float, int], value: float) -> None:
    """Exactly the limit where it is asked for, and just beside it in the type's own steps."""
    message, fields = number_message(interface, number)
    assert fields == {"data": value}
    assert message.data == value


def test_a_step_above_the_limit_is_above_it_in_every_type() -> None:
    """Also in single precision, where a thousandth must not round away."""
    for interface in (FLOAT, "std_msgs/msg/Float64", "sensor_msgs/msg/Temperature"):
        (above,) = number_message(interface, (25.0, 1))[1].values()
        (below,) = number_message(interface, (25.0, -1))[1].values()
        assert below < 25.0 < above


def test_a_type_without_a_number_cannot_carry_one() -> None:
    """The caller asks first."""
    with pytest.raises(ValueError, match="String"):
        number_message("std_msgs/msg/String", (1.0, 0))
