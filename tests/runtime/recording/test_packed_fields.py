"""Fields that are decoded when they are looked at are those that decoding everything at once would have given."""

from __future__ import annotations

import json
import math
from typing import Any

import msgspec
import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.trace import AssessedTrace, ClockKind, Message
from grader.runtime.recording.packed import Fields, decoded_fields, pack_trace, unpack_exactly, unpack_trace

TWIST = {"linear": {"x": 0.5, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.1}}
LONG = {"data": "x" * 80}
ANY = st.recursive(
    st.none() | st.booleans() | st.integers(-(2**80), 2**80) | st.floats() | st.text(),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=4), inner, max_size=4),
    max_leaves=12,
)


def trace(*values: dict[str, Any]) -> AssessedTrace:
    messages = tuple(Message(at, "/topic", "a_msgs/msg/Any", value) for at, value in enumerate(values))
    return AssessedTrace("alone", ClockKind.VIRTUAL, 10**10, messages)


def packed(value: str, beside: str = "{}") -> bytes:
    """Return a packed trace of two messages, one with the text of its fields given."""
    whole = pack_trace(trace({"marked": "here"}, {"marked": "beside"}), [False, False])
    return whole.replace(b'{"marked":"here"}', value.encode()).replace(b'{"marked":"beside"}', beside.encode())


def looked_at(data: bytes) -> Any:
    """Return the fields of the first message, every one decoded, or the refusal of the whole."""
    try:
        (first, *_) = unpack_trace(data).of(Message)
        return dict(first.value)
    except EvidenceError:
        return "refused"


def exactly(data: bytes) -> Any:
    try:
        return unpack_exactly(data, None).of(Message)[0].value
    except EvidenceError:
        return "refused"


def test_long_fields_are_left_as_they_are_and_short_ones_are_not() -> None:
    """What is worth it stays JSON until somebody looks."""
    long, short = unpack_trace(pack_trace(trace(TWIST, {"data": 1.5}), [False, False])).of(Message)
    assert isinstance(long.value, Fields)
    assert type(short.value) is dict
    assert long.value["linear"] == {"x": 0.5, "y": 0.0, "z": 0.0}
    assert list(long.value) == ["linear", "angular"]
    assert len(long.value) == 2
    assert long.value.get("nothing") is None


@given(st.dictionaries(st.text(max_size=8), ANY, max_size=6))
def test_quick_and_exact_way_read_the_same(value: dict[str, Any]) -> None:
    """Whatever a message holds, both ways of reading find it, or both refuse it."""
    data = pack_trace(trace({"fields": "f" * 70, **value}), [False])
    assert repr(looked_at(data)) == repr(exactly(data))


@pytest.mark.parametrize(
    "text",
    [
        '{"x": 1e999, "padding": "0000000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": "\\ud800", "padding": "0000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": 1, "x": 2, "padding": "00000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": é, "padding": "00000000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": "é", "padding": "00000000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": 01, "padding": "00000000000000000000000000000000000000000000000000000000000000000000"}',
        '{"x": [1, ], "padding": "000000000000000000000000000000000000000000000000000000000000000000"}',
        f'{{"x": {"9" * 60}, "padding": "0000000000000000000000000000000000000000000000000000000"}}',
        f'{{"x": {"9" * 6000}}}',
        f'{{"x": {"[" * 3000}{"]" * 3000}}}',
        '["a list of more than sixty-four characters, which is no mapping of fields at all"]',
        '{"x": {"float": "nan"}, "padding": "000000000000000000000000000000000000000000000000000000"}',
        '{"x": {"float": "nun"}, "padding": "000000000000000000000000000000000000000000000000000000"}',
        "[1]",
        '{"x": 1e999}',
    ],
)
def test_odd_fields_are_taken_or_refused_as_by_the_exact_way(text: str) -> None:
    """Leaving fields undecoded lets nothing pass that is refused otherwise, and refuses nothing that is taken."""
    assert repr(looked_at(packed(text))) == repr(exactly(packed(text)))


def test_odd_numbers_are_numbers_in_long_fields_too() -> None:
    """Not a number and infinity come back wherever they stand."""
    value = {**TWIST, "linear": {"x": math.nan, "y": math.inf, "z": 0.0}}
    (message,) = unpack_trace(pack_trace(trace(value), [False])).of(Message)
    assert math.isnan(message.value["linear"]["x"])
    assert message.value["linear"]["y"] == math.inf


def test_fields_are_equal_by_what_they_hold() -> None:
    """The order of the names and the white space make no difference, what is in them does."""
    one, other = Fields(raw('{"a":1,"b":2}')), Fields(raw('{ "b": 2, "a": 1 }'))
    assert one == other == {"a": 1, "b": 2}
    assert one != Fields(raw('{"a":1,"b":3}'))
    assert one != 3
    assert decoded_fields(raw(json.dumps(LONG))) == LONG


def raw(text: str) -> msgspec.Raw:
    return msgspec.Raw(text.encode())
