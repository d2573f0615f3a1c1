"""The bytes between the fields of a serialized message are zero, whatever the middleware left there."""

from __future__ import annotations

from typing import Any

import pytest

pytest.importorskip("rclpy")

from lifecycle_msgs.msg import TransitionEvent
from rclpy.serialization import deserialize_message, serialize_message
from sensor_msgs.msg import JointState
from std_msgs.msg import Empty, Header, String
from test_msgs import message_fixtures, msg
from test_msgs.action import Fibonacci

from grader.runtime.padding import without_padding

# The first message imports lark, which imports a deprecated module.
pytestmark = pytest.mark.filterwarnings("ignore:module .sre_:DeprecationWarning")

FIXTURES = {
    name.removeprefix("get_msg_"): getattr(message_fixtures, name)
    for name in dir(message_fixtures)
    if name.startswith("get_msg_")
}


@pytest.mark.parametrize("messages", FIXTURES.values(), ids=FIXTURES)
def test_no_field_is_lost(messages: Any) -> None:
    """All kinds of fields: constants, strings, arrays, sequences, nested messages."""
    for message in messages():
        cdr = serialize_message(message)
        clean = without_padding(cdr, type(message))
        assert len(clean) == len(cdr)
        assert deserialize_message(clean, type(message)) == message


NAMED = JointState(header=Header(frame_id="abcd"), name=["a", "bcd"], position=[1.0, 2.0])
MOVED = TransitionEvent()
MOVED.start_state.label, MOVED.goal_state.label = "inactive", "active"


FEEDBACK = Fibonacci.Impl.FeedbackMessage(feedback=Fibonacci.Feedback(sequence=[1, 1, 2]))


@pytest.mark.parametrize("message", [NAMED, MOVED, FEEDBACK, Empty(), String(data="x"), msg.Nested(), msg.Arrays()])
def test_equal_messages_have_equal_bytes(message: Any) -> None:
    """Every byte that means nothing is the same: changing it changes nothing."""
    cdr = serialize_message(message)
    clean = without_padding(cdr, type(message))
    for at in range(4, len(cdr)):
        for other in (0x55, 0xAA):
            changed = bytearray(cdr)
            changed[at] = other
            try:
                same = deserialize_message(bytes(changed), type(message)) == message
            except Exception:  # a length that is too large
                continue
            if same and other != cdr[at] and clean[at] == 0:
                assert without_padding(bytes(changed), type(message)) == clean


@pytest.mark.parametrize("cut", [0, 1, 4, 6, 9, 20])
def test_a_message_that_is_cut_off_stays_as_it_is(cut: int) -> None:
    """Whatever bytes a student's node sends, reading ends at their end."""
    cdr = serialize_message(NAMED)[:cut]
    assert without_padding(cdr, JointState) == cdr
