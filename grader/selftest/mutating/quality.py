"""Operators that ask for another quality of service."""

from __future__ import annotations

from collections.abc import Iterator

from grader.selftest.mutating.program import Change, Program, argument, called, expression

_SENSOR = ("qos_profile_sensor_data", "from rclpy.qos import qos_profile_sensor_data")
_LATCHED = (
    "QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)",
    "from rclpy.qos import DurabilityPolicy, QoSProfile",
)


def best_effort(program: Program) -> Iterator[Change]:
    """A publisher or subscription for sensor data, where messages may get lost."""
    yield from _with_profile(program, "best effort", _SENSOR)


def transient_local(program: Program) -> Iterator[Change]:
    """A publisher or subscription that expects late joiners to be served."""
    yield from _with_profile(program, "transient local", _LATCHED)


def _with_profile(program: Program, word: str, profile: tuple[str, str]) -> Iterator[Change]:
    text, line = profile
    for call in program.calls("create_publisher", "create_subscription"):
        arg = argument(call, "qos_profile")
        if arg is not None:
            edits = ((arg.value, expression(text)), *program.importing(line))
            yield Change(call, f"{called(call).removeprefix('create_')} {word}", edits)
