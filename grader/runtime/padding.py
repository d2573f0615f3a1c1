"""Sets the bytes between the fields of a serialized message to zero, because the middleware leaves them as they were.

Format: CDR with plain alignment (OMG DDS-XTypes 1.3, 7.4.1): a primitive starts at a multiple of its size, counted from
the end of the 4-byte header; strings and sequences start with their length in 4 bytes.
"""

from __future__ import annotations

import functools
import importlib
from typing import Any, Literal

from rosidl_parser.definition import AbstractSequence, AbstractString, AbstractWString, Array, BasicType

#: Sizes of the header of CDR and of the length before a sequence or text.
HEADER_BYTES, LENGTH_BYTES = 4, 4
#: Byte order by the second byte of the header.
_ORDERS: dict[int, Literal["big", "little"]] = {0: "big", 1: "little"}
SIZES = {
    **dict.fromkeys(("boolean", "octet", "char", "int8", "uint8"), 1),
    **dict.fromkeys(("int16", "uint16"), 2),
    **dict.fromkeys(("int32", "uint32", "float"), 4),
    **dict.fromkeys(("int64", "uint64", "double"), 8),
}


def without_padding(cdr: bytes, message: Any) -> bytes:
    """Return a serialized message with zeros between and after its fields, so that equal messages have equal bytes.

    Args:
        cdr: The serialized message.
        message: Its class.

    Returns:
        The bytes; unchanged if they end within a field.
    """
    try:
        walk = _Walk(cdr)
        walk.fields(message)
        walk.skip_to(len(walk.body))
    except (IndexError, KeyError):
        return cdr
    return bytes(cdr[:HEADER_BYTES]) + bytes(walk.body)


class _Walk:
    """Goes through the fields of one message and sets what lies between them to zero."""

    def __init__(self, cdr: bytes) -> None:
        self.body = bytearray(cdr[HEADER_BYTES:])
        self._order: Literal["big", "little"] = _ORDERS[cdr[1]]
        self._at = 0

    def fields(self, message: Any) -> None:
        """Skip the fields of a message class."""
        if not message.SLOT_TYPES:
            self.skip_to(self._at + 1)  # C has no empty structures
        for kind in message.SLOT_TYPES:
            self._field(kind)

    def _field(self, kind: Any) -> None:
        if isinstance(kind, BasicType):
            self._primitives(kind, 1)
        elif isinstance(kind, AbstractString):
            length = self._length()
            self._at += length
        elif isinstance(kind, AbstractWString):
            length = self._length()
            self._at += length * SIZES["uint32"]
        elif isinstance(kind, (Array, AbstractSequence)):
            count = kind.size if isinstance(kind, Array) else self._length()
            if isinstance(kind.value_type, BasicType):
                self._primitives(kind.value_type, count)
            else:
                for _ in range(count):
                    self._field(kind.value_type)
        else:
            self.fields(_structure(*kind.namespaces, kind.name))

    def _primitives(self, kind: BasicType, count: int) -> None:
        if count:
            size = SIZES[kind.typename]
            self._align(size)
            self._at += size * count

    def _length(self) -> int:
        self._align(LENGTH_BYTES)
        read = self.body[self._at : self._at + LENGTH_BYTES]
        self._at += LENGTH_BYTES
        if self._at > len(self.body):
            raise IndexError(self._at)
        return int.from_bytes(read, self._order)

    def _align(self, size: int) -> None:
        self.skip_to(self._at + -self._at % size)

    def skip_to(self, end: int) -> None:
        """Set the bytes from here to a position to zero, and go on there."""
        if not self._at <= end <= len(self.body):
            raise IndexError(end)
        self.body[self._at : end] = bytes(end - self._at)
        self._at = end


@functools.cache
def _structure(*path: str) -> Any:
    """Return a message class; the parts of services and actions, such as `Fibonacci_Feedback`, are attributes."""
    *package, name = path
    return functools.reduce(getattr, name.split("_"), importlib.import_module(".".join(package)))
