"""Messages to CDR bytes and back: for each generated message class, functions compiled from its SLOT_TYPES.

The format is that of Fast CDR's plain XCDR1 (OMG DDS-XTypes 1.3, 7.4.1): each primitive is aligned to its size, counted
from the start of the body; a string is its length with the final zero as uint32, its bytes and the zero; a wide string
is the number of its UTF-16 units and each unit as uint32; a sequence is its length as uint32 and its elements. A
structure without fields is one zero byte.
"""

from __future__ import annotations

import array
import functools
import re
import struct
import sys
from collections.abc import Callable
from dataclasses import dataclass
from importlib import import_module
from typing import Any

from rosidl_parser import definition

# How struct, array and numpy name the IDL's types.
_CODES = {
    "boolean": "?", "octet": "c", "float": "f", "double": "d", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H",
    "int32": "i", "uint32": "I", "int64": "q", "uint64": "Q",
}  # fmt: skip
# A message of more primitives than this is encoded by a function of its own where others hold it.
_INLINE = 48
# Fast DDS reserves memory for the longest message of a type with a bound; from here on it does so for each message.
_LONGEST = 2**20


class MalformedMessageError(ValueError):
    """Received bytes are not a message of the type."""


@dataclass(frozen=True)
class Codec:
    """The functions for one message class.

    Attributes:
        message_class: The generated class.
        encode: Appends a message to a bytearray whose start is that of the body; raises what is wrong with a value.
        decode: Takes a body and an offset; gives the message and the offset of its end. Raises MalformedMessageError.
        decode_swapped: The same for a body in the other byte order.
        maximum_size: Bytes of the longest body, or None if it has no bound or one above a mebibyte.
    """

    message_class: Any
    encode: Callable[[Any, bytearray], None]
    decode: Callable[[bytes, int], tuple[Any, int]]
    decode_swapped: Callable[[bytes, int], tuple[Any, int]]
    maximum_size: int | None

    def to_bytes(self, message: Any) -> bytes:
        """The body of a message, without encapsulation header."""
        body = bytearray()
        self.encode(message, body)
        return bytes(body)

    def from_bytes(self, body: bytes, *, little_endian: bool = True) -> Any:
        """The message of a body; raises MalformedMessageError. Bytes behind it are ignored, as Fast CDR does."""
        native = little_endian == (sys.byteorder == "little")
        try:
            return (self.decode if native else self.decode_swapped)(body, 0)[0]
        except (struct.error, IndexError) as error:
            name = self.message_class.__name__
            raise MalformedMessageError(f"{len(body)} bytes are not a message of type {name}: {error}") from None


_codecs: dict[Any, Codec] = {}


def codec_of(message_class: Any) -> Codec:
    """The codec of a generated message class, compiled once."""
    if message_class not in _codecs:
        native, other = ("<", ">") if sys.byteorder == "little" else (">", "<")
        encode, decode = _Compiler(message_class, native).compile()
        _, swapped = _Compiler(message_class, other).compile()
        _codecs[message_class] = Codec(message_class, encode, decode, swapped, _bound(message_class))
    return _codecs[message_class]


def _bound(message_class: Any) -> int | None:
    length = _length(message_class, 0)
    return length if length is not None and length <= _LONGEST else None


def class_of(type_: definition.NamespacedType) -> Any:
    """The generated class that a type names."""
    package = ".".join(type_.namespaces)
    found = getattr(import_module(package), type_.name, None)
    if found is None:  # goals, results and feedback, which the package does not export
        stem = type_.name.rsplit("_", 1)[0]
        stem = re.sub("([a-z0-9])([A-Z])", r"\1_\2", re.sub("(.)([A-Z][a-z]+)", r"\1_\2", stem)).lower()
        found = getattr(import_module(f"{package}._{stem}"), type_.name)
    return found


def fields_of(message_class: Any) -> list[tuple[str, Any]]:
    """The names and types of the fields of a generated class."""
    return list(zip(message_class.get_fields_and_field_types(), message_class.SLOT_TYPES, strict=False))


def _weight(type_: Any) -> int:
    """How many values a field holds without counting arrays, to bound the code that is written for it."""
    if isinstance(type_, definition.AbstractNestedType):
        return 1 + _weight(type_.value_type)
    if isinstance(type_, definition.NamespacedType):
        return _weight_of(class_of(type_))
    return 1


@functools.cache
def _weight_of(message_class: Any) -> int:
    return sum(_weight(type_) for _, type_ in fields_of(message_class)) or 1


def _aligned(offset: int, size: int) -> int:
    return offset + -offset % size


@functools.cache
def _length(message_class: Any, residue: int) -> int | None:
    """The greatest length of a message that begins at a residue modulo 8; None if there is no limit."""
    end: int | None = residue if fields_of(message_class) else residue + 1
    for _, type_ in fields_of(message_class):
        end = _field_end(type_, end)
    return None if end is None else end - residue


def _field_end(type_: Any, end: int | None) -> int | None:
    """Where the longest field ends that begins at an offset."""
    if end is None or isinstance(type_, definition.UnboundedSequence):
        return None
    if isinstance(type_, definition.AbstractNestedType):
        bounded = isinstance(type_, definition.BoundedSequence)
        start, count = (_aligned(end, 4) + 4, type_.maximum_size) if bounded else (end, type_.size)
        return _repeated_end(type_.value_type, start, count)
    if isinstance(type_, definition.NamespacedType):
        length = _length(class_of(type_), end % 8)
        return None if length is None else end + length
    if isinstance(type_, definition.AbstractGenericString):
        if not type_.has_maximum_size():
            return None
        wide = isinstance(type_, definition.AbstractWString)
        return _aligned(end, 4) + 4 + int(type_.maximum_size * 4 if wide else type_.maximum_size + 1)
    size = struct.calcsize("=" + _CODES[type_.typename])
    return _aligned(end, size) + size


def _repeated_end(type_: Any, end: int, count: int) -> int | None:
    """Where the last of some elements ends. Eight of them begin as all others do, modulo 8."""
    ends = [end]
    for _ in range(min(count, 16)):
        following = _field_end(type_, ends[-1])
        if following is None:
            return None
        ends.append(following)
    if count <= 16:
        return ends[-1]
    start = 16 - next(period for period in range(1, 17) if (ends[16] - ends[16 - period]) % 8 == 0)
    period, gain = 16 - start, ends[16] - ends[start]
    rounds, left = divmod(count - start, period)
    return ends[start + left] + rounds * gain


def _bad(what: str) -> None:
    raise struct.error(what)


def _string(body: bytes, offset: int, count: int) -> str:
    if count > len(body) - offset:
        _bad(f"a string of {count} bytes at {offset}")
    return body[offset : offset + count].partition(b"\0")[0].decode("utf-8", "replace")


def _wstring(body: bytes, offset: int, count: int, order: str) -> str:
    """A string whose UTF-16 units take four bytes each."""
    if count * 4 > len(body) - offset:
        _bad(f"a wide string of {count} characters at {offset}")
    units = struct.unpack_from(f"{order}{count}I", body, offset)
    return struct.pack(f"<{count}H", *(unit & 0xFFFF for unit in units)).decode("utf-16-le", "replace")


def _wide_text(value: str, order: str) -> bytes:
    encoded = str.encode(value, "utf-16-le")
    count = len(encoded) // 2
    return struct.pack(f"{order}{count}I", *struct.unpack(f"<{count}H", encoded))


def _text(value: str) -> bytes:
    """A string as the C message holds it: up to its first zero."""
    return str.encode(value).partition(b"\0")[0] + b"\0"


def _array(code: str, value: Any, count: int | None, limit: int | None) -> bytes:
    """The bytes of a numeric field: an array, or whatever was put in its place."""
    values = value if isinstance(value, array.array) and value.typecode == code else array.array(code, list(value))
    _check_length(len(values), count, limit)
    return values.tobytes()


def _numbers(code: str, value: Any, count: int) -> bytes:
    """The bytes of a numeric field of fixed length: a numpy array, or whatever was put in its place."""
    import numpy as np  # noqa: PLC0415 - only messages with such fields need it

    values = np.ascontiguousarray(value, dtype=code)
    _check_length(values.size, count, None)
    return values.tobytes()


def _check_length(length: int, count: int | None, limit: int | None) -> None:
    if count is not None and length != count:
        raise ValueError(f"a field of {count} elements holds {length}")
    if limit is not None and length > limit:
        raise ValueError(f"a field of at most {limit} elements holds {length}")


def _array_from(code: str, body: bytes, offset: int, count: int, order: str) -> Any:
    size = struct.calcsize("=" + code)
    if count * size > len(body) - offset:
        _bad(f"{count} elements at {offset}")
    values = array.array(code)
    values.frombytes(body[offset : offset + count * size])
    if (order == "<") != (sys.byteorder == "little"):
        values.byteswap()
    return values


def _numbers_from(code: str, body: bytes, offset: int, count: int, order: str) -> Any:
    import numpy as np  # noqa: PLC0415 - as above

    size = struct.calcsize("=" + code)
    if count * size > len(body) - offset:
        _bad(f"{count} elements at {offset}")
    return np.frombuffer(body, dtype=order + code, count=count, offset=offset).astype(code)


def _elements(body: bytes, offset: int, count: int) -> int:
    """A count of elements, each of which takes at least one byte."""
    if count > len(body) - offset:
        _bad(f"{count} elements at {offset}")
    return count


def _boolean(value: int) -> bool:
    if value > 1:
        _bad(f"a boolean of {value}")
    return value == 1


class _Run:
    """Consecutive primitives, packed by one struct for each offset modulo 8 that they may begin at."""

    def __init__(self) -> None:
        self.codes: list[str] = []
        self.values: list[str] = []

    def structs(self, order: str) -> tuple[struct.Struct, ...]:
        return tuple(struct.Struct(order + self._padded(start)) for start in range(8))

    def _padded(self, start: int) -> str:
        text, offset = "", start
        for code in self.codes:
            size = struct.calcsize("=" + code)
            padding = -offset % size
            text += "x" * padding + code
            offset += padding + size
        return text


class _Compiler:
    """Writes and compiles the two functions of one class for one byte order."""

    def __init__(self, message_class: Any, order: str) -> None:
        self._class = message_class
        self._order = order
        self._names: dict[str, Any] = {
            "array_bytes": _array, "number_bytes": _numbers, "text": _text, "wide_text": _wide_text,
            "check_length": _check_length, "string": _string,
            "wstring": _wstring, "array_from": _array_from, "numbers_from": _numbers_from, "elements": _elements,
            "boolean": _boolean, "pad": tuple(bytes(-offset % 8) for offset in range(8)), "new": object.__new__,
        }  # fmt: skip
        self._lines: list[str] = []
        self._indent = 1
        self._run = _Run()
        self._made: list[str] = []
        self._count = 0

    def compile(self) -> tuple[Any, Any]:
        """The functions encode(message, body) and decode(body, offset)."""
        self._encode_fields("m", self._class)
        self._flush_packed()
        encoder = ["def encode(m, b):", "  pass", *self._lines]
        self._lines = []
        result = self._decode_class(self._class)
        self._flush_unpacked()
        self._make()
        decoder = ["def decode(d, o):", *self._lines, f"  return {result}, o"]
        source = "\n".join((*encoder, *decoder))
        # The text holds names of fields, which are identifiers, and nothing else of a definition.
        exec(compile(source, f"<codec of {self._class.__name__}>", "exec"), self._names)  # noqa: S102
        return self._names["encode"], self._names["decode"]

    def _line(self, text: str) -> None:
        self._lines.append("  " * self._indent + text)

    def _name(self, value: Any = None) -> str:
        self._count += 1
        name = f"v{self._count}"
        if value is not None:
            self._names[name] = value
        return name

    # Encoding: `m` is the message, `b` the body so far.

    def _pack(self, code: str, value: str) -> None:
        self._run.codes.append(code)
        self._run.values.append(value)

    def _flush_packed(self) -> None:
        if self._run.codes:
            packers = self._name(tuple(each.pack for each in self._run.structs(self._order)))
            self._line(f"b += {packers}[len(b) & 7]({', '.join(self._run.values)})")
            self._run = _Run()

    def _encode_fields(self, message: str, message_class: Any) -> None:
        fields = fields_of(message_class)
        if not fields:
            self._pack("B", "0")
        for name, type_ in fields:
            self._encode(f"{message}._{name}", type_)

    def _encode(self, value: str, type_: Any) -> None:
        if isinstance(type_, definition.AbstractNestedType):
            self._encode_several(value, type_)
        elif isinstance(type_, definition.NamespacedType):
            self._encode_message(value, class_of(type_))
        elif isinstance(type_, definition.AbstractGenericString):
            text = self._name()
            if isinstance(type_, definition.AbstractWString):
                self._line(f"{text} = wide_text({value}, {self._order!r})")
                self._pack("I", f"len({text}) // 4")
            else:
                self._line(f"{text} = text({value})")
                self._pack("I", f"len({text})")
            self._flush_packed()
            self._line(f"b += {text}")
        elif type_.typename == "boolean":
            self._pack("?", f"{value} is True")
        else:
            self._pack(_CODES[type_.typename], value)

    def _encode_message(self, value: str, message_class: Any) -> None:
        if _weight_of(message_class) <= _INLINE:
            self._encode_fields(value, message_class)
        else:
            self._flush_packed()
            self._line(f"{self._name(codec_of(message_class).encode)}({value}, b)")

    def _encode_several(self, value: str, type_: Any) -> None:
        count = type_.size if isinstance(type_, definition.Array) else None
        limit = type_.maximum_size if isinstance(type_, definition.BoundedSequence) else None
        code = _numeric_code(type_.value_type)
        if code:
            data = self._name()
            if count is None:
                self._line(f"{data} = array_bytes({code!r}, {value}, None, {limit})")
                size = struct.calcsize("=" + code)
                self._pack("I", f"len({data}) // {size}")
            else:
                self._line(f"{data} = number_bytes({code!r}, {value}, {count})")
            self._flush_packed()
            if struct.calcsize("=" + code) > (1 if count is not None else 4):
                self._line(f"if {data}: b += pad[len(b) & 7][:-len(b) % {struct.calcsize('=' + code)}]")
            self._line(f"b += {data}")
            return
        if count is None:
            self._pack("I", f"len({value})")
        if count is not None or limit is not None:
            self._line(f"check_length(len({value}), {count}, {limit})")
        self._flush_packed()
        element = self._name()
        self._line(f"for {element} in {value}:")
        self._indent += 1
        self._encode(element, type_.value_type)
        self._flush_packed()
        self._indent -= 1

    # Decoding: `d` is the body, `o` the offset.

    def _unpack(self, code: str) -> str:
        name = self._name()
        self._run.codes.append(code)
        self._run.values.append(name)
        return name

    def _flush_unpacked(self) -> None:
        if self._run.codes:
            structs = self._run.structs(self._order)
            readers = self._name(tuple((each.unpack_from, each.size) for each in structs))
            read, size = self._name(), self._name()
            self._line(f"{read}, {size} = {readers}[o & 7]")
            self._line(f"{', '.join(self._run.values)}, = {read}(d, o)")
            self._line(f"o += {size}")
            self._run = _Run()

    def _make(self) -> None:
        for line in self._made:
            self._line(line)
        self._made = []

    def _decode_class(self, message_class: Any) -> str:
        fields = fields_of(message_class)
        if not fields:
            self._unpack("B")
        values = [(name, self._decode(type_)) for name, type_ in fields]
        message = self._name()
        self._made.append(f"{message} = new({self._name(message_class)})")
        if "_check_fields" in message_class.__slots__:
            checked = getattr(sys.modules[message_class.__module__], "ros_python_check_fields", "") == "1"
            self._made.append(f"{message}._check_fields = {checked}")
        self._made += [f"{message}._{name} = {value}" for name, value in values]
        return message

    def _decode(self, type_: Any) -> str:
        if isinstance(type_, definition.AbstractNestedType):
            return self._decode_several(type_)
        if isinstance(type_, definition.NamespacedType):
            return self._decode_message(class_of(type_))
        if isinstance(type_, definition.AbstractGenericString):
            count, value = self._unpack("I"), self._name()
            self._flush_unpacked()
            if isinstance(type_, definition.AbstractWString):
                self._line(f"{value} = wstring(d, o, {count}, {self._order!r})")
                self._line(f"o += {count} * 4")
            else:
                self._line(f"{value} = string(d, o, {count})")
                self._line(f"o += {count}")
            return value
        if type_.typename == "boolean":
            value, raw = self._name(), self._unpack("B")
            self._made.append(f"{value} = boolean({raw})")
            return value
        return self._unpack(_CODES[type_.typename])

    def _decode_message(self, message_class: Any) -> str:
        if _weight_of(message_class) <= _INLINE:
            return self._decode_class(message_class)
        self._flush_unpacked()
        codec, message = codec_of(message_class), self._name()
        native = (self._order == "<") == (sys.byteorder == "little")
        self._line(f"{message}, o = {self._name(codec.decode if native else codec.decode_swapped)}(d, o)")
        return message

    def _decode_several(self, type_: Any) -> str:
        count = str(type_.size) if isinstance(type_, definition.Array) else self._unpack("I")
        self._flush_unpacked()
        code, value = _numeric_code(type_.value_type), self._name()
        if code:
            size = struct.calcsize("=" + code)
            if size > (1 if isinstance(type_, definition.Array) else 4):
                self._line(f"if {count}: o += -o % {size}")
            read = "numbers_from" if isinstance(type_, definition.Array) else "array_from"
            self._line(f"{value} = {read}({code!r}, d, o, {count}, {self._order!r})")
            self._line(f"o += {count} * {size}")
            return value
        if not isinstance(type_, definition.Array):
            self._line(f"elements(d, o, {count})")
        outer, self._made = self._made, []
        self._line(f"{value} = []")
        self._line(f"for _ in range({count}):")
        self._indent += 1
        element = self._decode(type_.value_type)
        self._flush_unpacked()
        self._make()
        self._line(f"{value}.append({element})")
        self._indent -= 1
        self._made = outer
        return value


def _numeric_code(type_: Any) -> str | None:
    """How array and numpy name the elements of a field that they hold."""
    if isinstance(type_, definition.BasicType) and type_.typename not in {"boolean", "octet"}:
        return _CODES[type_.typename]
    return None
