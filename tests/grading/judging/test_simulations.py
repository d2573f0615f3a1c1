"""What a node publishes for a simulation that does not hear it."""

from __future__ import annotations

import pytest

from grader.grading.judging.simulations import not_heard, unheard_by_simulations
from grader.testing import TraceBuilder

TWIST, STAMPED = "geometry_msgs/msg/Twist", "geometry_msgs/msg/TwistStamped"


def unheard(heard: list[str], *published: tuple[str, str]) -> list[tuple[str, str]]:
    """Return topic and type of the publishers that a simulation does not hear."""
    trace = TraceBuilder()
    for detail in heard:
        trace.mark(0, "simulation_hears", detail)
    for topic, type_ in published:
        trace.publisher(topic, type_)
    return [(one.end.topic, one.end.type) for one in not_heard(trace.trace())]


@pytest.mark.parametrize(
    ("heard", "published", "found"),
    [
        ([f"/cmd_vel {TWIST}"], [("/cmd_vel", TWIST)], []),
        ([f"/cmd_vel {TWIST}"], [("/cmd_vel", STAMPED)], [("/cmd_vel", STAMPED)]),
        ([f"/cmd_vel {TWIST}", f"/cmd_vel {STAMPED}"], [("/cmd_vel", STAMPED)], []),
        ([f"/cmd_vel {TWIST}"], [("/cmd_vel", STAMPED), ("/cmd_vel", TWIST)], []),
        ([f"/cmd_vel {TWIST}"], [("/robot/cmd_vel", TWIST)], [("/robot/cmd_vel", TWIST)]),
        ([f"/cmd_vel {TWIST}"], [("/drive", TWIST)], [("/drive", TWIST)]),
        ([f"/cmd_vel {TWIST}"], [("/left", TWIST), ("/right", TWIST)], []),
        ([f"/cmd_vel {TWIST}"], [("/chatter", "std_msgs/msg/String")], []),
        ([f"/a/cmd_vel {TWIST}", f"/b/cmd_vel {TWIST}"], [("/a/cmd_vel", TWIST)], []),
        ([], [("/cmd_vel", STAMPED)], []),
    ],
)
def test_the_publisher_is_found_that_was_meant(
    heard: list[str], published: list[tuple[str, str]], found: list[tuple[str, str]]
) -> None:
    """By its topic, or by its type where no other publisher could be meant; one of several is not guessed."""
    assert unheard(heard, *published) == found


def test_the_note_names_both_types() -> None:
    """So that nobody has to look for what the simulation takes."""
    trace = TraceBuilder()
    trace.mark(0, "simulation_hears", f"/cmd_vel {TWIST}")
    trace.publisher("/cmd_vel", STAMPED, node="/driver")
    (note,) = unheard_by_simulations(trace.trace())
    assert note == f"/driver publishes {STAMPED} on /cmd_vel; the simulation hears {TWIST} on /cmd_vel"
