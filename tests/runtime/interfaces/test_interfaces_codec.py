"""The bytes of messages: those that compiled type supports make, for all installed types, and hostile ones."""

import contextlib
import random
import struct
import sys
import types
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rclpy.serialization import deserialize_message, serialize_message
from rosidl_parser import definition
from samples import filled, installed_packages, message_classes
from std_msgs.msg import Float64MultiArray
from test_msgs import msg

from grader.runtime.interfaces.runtime.codec import MalformedMessageError, class_of, codec_of, fields_of

# The parser of ROS's generators, which generated classes load, uses a deprecated module.
pytestmark = pytest.mark.filterwarnings("ignore:module 'sre_:DeprecationWarning")
HEADER = b"\x00\x01\x00\x00"
CLASSES = [getattr(msg, name) for name in dir(msg) if hasattr(getattr(msg, name), "SLOT_TYPES")]


@pytest.mark.breadth(6, 21)
@pytest.mark.parametrize("package", installed_packages())
def test_bytes_are_those_of_the_compiled_type_support(package: str) -> None:
    chance = random.Random(package)
    for message_class in message_classes(package):
        codec = codec_of(message_class)
        for message in (message_class(), filled(message_class, chance), filled(message_class, chance)):
            body = codec.to_bytes(message)
            compiled = serialize_message(message)
            assert deserialize_message(HEADER + body, message_class) == message
            assert codec.from_bytes(compiled[4:]) == message
            # The compiled one leaves what lies between values as it was in memory, and rounds the size up.
            assert codec.to_bytes(codec.from_bytes(compiled[4:])) == body
            assert _packed(message) == b"".join(_parts(message_class, body))
            assert len(body) <= len(compiled) - 4
            assert codec.maximum_size is None or len(body) <= codec.maximum_size


def _packed(message: Any) -> bytes:
    """The values of a message one after the other, without padding; written apart from the codec."""
    made = b""
    for name, type_ in fields_of(type(message)):
        values = getattr(message, name)
        if isinstance(type_, definition.AbstractNestedType):
            made += b"" if isinstance(type_, definition.Array) else struct.pack("<I", len(values))
            type_ = type_.value_type  # noqa: PLW2901
        else:
            values = [values]
        for value in values:
            if isinstance(type_, definition.NamespacedType):
                made += _packed(value)
            elif isinstance(type_, definition.AbstractWString):
                units = value.encode("utf-16-le")
                made += struct.pack("<I", len(units) // 2) + b"".join(
                    units[n : n + 2] + b"\0\0" for n in range(0, len(units), 2)
                )
            elif isinstance(type_, definition.AbstractGenericString):
                made += struct.pack("<I", len(value.encode()) + 1) + value.encode() + b"\0"
            else:
                made += _primitive(type_.typename, value)
    return made if fields_of(type(message)) else b"\0"


def _primitive(typename: str, value: Any) -> bytes:
    if typename in {"octet", "boolean"}:
        return value if typename == "octet" else bytes([value])
    if typename in {"float", "double"}:
        return struct.pack("<f" if typename == "float" else "<d", value)
    return int(value).to_bytes(int(typename.lstrip("uint")) // 8, "little", signed=not typename.startswith("u"))


def _parts(message_class: Any, body: bytes) -> list[bytes]:
    """The parts of a body that hold values, where a walk over the types finds them."""
    parts: list[bytes] = []
    offset = 0

    def take(size: int, align: int) -> bytes:
        nonlocal offset
        offset += -offset % align
        parts.append(body[offset : offset + size])
        offset += size
        return parts[-1]

    def walk(type_: Any) -> None:
        if isinstance(type_, definition.AbstractNestedType):
            count = type_.size if isinstance(type_, definition.Array) else int.from_bytes(take(4, 4), "little")
            for _ in range(count):
                walk(type_.value_type)
        elif isinstance(type_, definition.NamespacedType):
            fields(class_of(type_))
        elif isinstance(type_, definition.AbstractGenericString):
            count = int.from_bytes(take(4, 4), "little")
            take(count * (4 if isinstance(type_, definition.AbstractWString) else 1), 1)
        else:
            sizes = {"octet": 1, "boolean": 1, "float": 4, "double": 8}
            size = sizes.get(type_.typename) or int(type_.typename.lstrip("uint")) // 8
            take(size, size)

    def fields(some: Any) -> None:
        for _, type_ in fields_of(some):
            walk(type_)
        if not fields_of(some):
            take(1, 1)

    fields(message_class)
    assert offset == len(body)
    return parts


@given(st.sampled_from(CLASSES), st.randoms(use_true_random=False), st.data())
def test_damaged_bytes_are_refused_or_give_a_message(
    message_class: Any, chance: random.Random, data: st.DataObject
) -> None:
    codec = codec_of(message_class)
    body = bytearray(codec.to_bytes(filled(message_class, chance)))
    for _ in range(data.draw(st.integers(0, 3))):
        body[data.draw(st.integers(0, len(body) - 1))] = data.draw(st.integers(0, 255))
    damaged = bytes(body[: data.draw(st.integers(0, len(body)))])
    for little_endian in (True, False):
        try:
            message = codec.from_bytes(damaged, little_endian=little_endian)
        except MalformedMessageError:
            continue
        assert type(message) is message_class


@given(st.sampled_from(CLASSES), st.binary(max_size=200))
def test_random_bytes_are_refused_or_give_a_message(message_class: Any, body: bytes) -> None:
    with contextlib.suppress(MalformedMessageError):
        assert type(codec_of(message_class).from_bytes(body)) is message_class


def test_a_count_beyond_the_bytes_reserves_no_memory() -> None:
    with pytest.raises(MalformedMessageError):
        codec_of(msg.UnboundedSequences).from_bytes(b"\xff" * 64)


def test_the_bound_of_long_arrays_is_that_of_its_elements_one_by_one() -> None:
    element = type(
        "Element", (), {"__slots__": [], "SLOT_TYPES": (definition.BasicType("int64"), definition.BasicType("int8"))}
    )
    element.get_fields_and_field_types = lambda: {"a": "int64", "b": "int8"}  # type: ignore[attr-defined]
    module = types.ModuleType("bounds_of_arrays.msg")
    module.Element = element  # type: ignore[attr-defined]
    sys.modules["bounds_of_arrays.msg"] = module
    nested = definition.NamespacedType(["bounds_of_arrays", "msg"], "Element")
    for count in (1, 15, 16, 17, 1000):
        whole = type(
            "Whole",
            (),
            {"__slots__": [], "SLOT_TYPES": (definition.BasicType("int8"), definition.Array(nested, count))},
        )
        whole.get_fields_and_field_types = lambda: {"a": "int8", "b": "Element[]"}  # type: ignore[attr-defined]

        end = 1
        for _ in range(count):
            end += -end % 8 + 9
        assert codec_of(whole).maximum_size == end


def test_the_other_byte_order_is_read() -> None:
    message = codec_of(msg.Builtins).from_bytes(struct.pack(">iIiI", 1, 2, -3, 4), little_endian=False)
    assert (message.duration_value.nanosec, message.time_value.sec) == (2, -3)
    floats = struct.pack(">I4x2d", 2, 0.5, -1.5)
    assert codec_of(Float64MultiArray).from_bytes(bytes(8) + floats, little_endian=False).data.tolist() == [0.5, -1.5]


@pytest.mark.parametrize(
    ("field", "value"),
    [("string_values", ["a", 5]), ("bool_values", 3), ("basic_types_values", [1]), ("alignment_check", "x")],
)
def test_wrong_values_raise(field: str, value: Any) -> None:
    message = msg.UnboundedSequences()
    setattr(message, f"_{field}", value)
    with pytest.raises((TypeError, AttributeError, struct.error)):
        codec_of(msg.UnboundedSequences).to_bytes(message)


def test_lists_that_have_grown_too_long_raise() -> None:
    message = msg.BoundedSequences()
    message.string_values = ["a"]
    message.string_values += ["b", "c", "d"]
    with pytest.raises(ValueError, match="at most 3"):
        codec_of(msg.BoundedSequences).to_bytes(message)


def test_a_text_ends_at_its_first_zero_as_in_c() -> None:
    message = msg.Strings(string_value="a\0b")
    assert codec_of(msg.Strings).from_bytes(codec_of(msg.Strings).to_bytes(message)).string_value == "a"
