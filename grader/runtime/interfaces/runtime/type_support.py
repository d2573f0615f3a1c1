"""Type support for generated message classes without compiled code: what rclpy, rcl and rmw_fastrtps ask of a type.

To rclpy and rcl a message is an opaque `void *`. Here it is the address of a Python object, a `_Message`, which holds
the message's body in CDR. rclpy gets addresses of functions of Python's C API that have the signature it expects: these
pass an exception on, which a callback of ctypes cannot.

`cdr_serialize`, `cdr_deserialize` and the functions for sizes are called while Fast DDS holds a lock. If they ran
Python code, the interpreter could switch to another thread there, and that thread could wait for the same lock without
ever letting the first go on. So they are made of functions written in C only (operator, functools.partial, map,
ctypes); messages are encoded before and decoded afterwards.

The structures are those of rosidl_runtime_c and rosidl_typesupport_fastrtps_cpp of ROS 2 Jazzy.
"""

from __future__ import annotations

import ctypes
import functools
import itertools
import json
import operator
import struct
import sys
from collections.abc import Callable, Iterator, Mapping
from ctypes import POINTER, c_bool, c_char_p, c_int, c_size_t, c_uint8, c_uint32, c_uint64, c_void_p, py_object
from importlib import import_module
from pathlib import Path
from typing import Any

from rosidl_parser import definition

from .codec import Codec, class_of, codec_of, fields_of

_IDENTIFIER = b"rosidl_typesupport_fastrtps_c"
_INTROSPECTION = b"rosidl_typesupport_introspection_c"


class _MessageTypeSupport(ctypes.Structure):
    _fields_ = (
        ("identifier", c_char_p), ("data", c_void_p), ("func", c_void_p), ("get_type_hash", c_void_p),
        ("get_type_description", c_void_p), ("get_sources", c_void_p),
    )  # fmt: skip


class _ServiceTypeSupport(ctypes.Structure):
    _fields_ = (
        ("identifier", c_char_p), ("data", c_void_p), ("func", c_void_p), ("request", c_void_p), ("response", c_void_p),
        ("event", c_void_p), ("create_event", c_void_p), ("destroy_event", c_void_p), ("get_type_hash", c_void_p),
        ("get_type_description", c_void_p), ("get_sources", c_void_p),
    )  # fmt: skip


class _ActionTypeSupport(ctypes.Structure):
    _fields_ = (
        ("goal", c_void_p), ("result", c_void_p), ("cancel", c_void_p), ("feedback", c_void_p), ("status", c_void_p),
        ("get_type_hash", c_void_p), ("get_type_description", c_void_p), ("get_sources", c_void_p),
    )  # fmt: skip


class _MessageCallbacks(ctypes.Structure):
    _fields_ = (
        ("namespace", c_char_p), ("name", c_char_p), ("cdr_serialize", c_void_p), ("cdr_deserialize", c_void_p),
        ("get_serialized_size", c_void_p), ("max_serialized_size", c_void_p), ("key_callbacks", c_void_p),
    )  # fmt: skip


class _ServiceCallbacks(ctypes.Structure):
    _fields_ = (("namespace", c_char_p), ("name", c_char_p), ("request", c_void_p), ("response", c_void_p))


class _Member(ctypes.Structure):
    """rosidl_typesupport_introspection_c__MessageMember; what comes last in it concerns messages in C's memory."""

    _fields_ = (
        ("name", c_char_p), ("type_id", c_uint8), ("string_upper_bound", c_size_t), ("members", c_void_p),
        ("is_key", c_bool), ("is_array", c_bool), ("array_size", c_size_t), ("is_upper_bound", c_bool),
        ("offset", c_uint32), ("unused", c_void_p * 7),
    )  # fmt: skip


class _Members(ctypes.Structure):
    _fields_ = (
        ("namespace", c_char_p), ("name", c_char_p), ("count", c_uint32), ("size_of", c_size_t), ("has_key", c_bool),
        ("members", c_void_p), ("init", c_void_p), ("fini", c_void_p),
    )  # fmt: skip


class _TypeHash(ctypes.Structure):
    _fields_ = (("version", c_uint8), ("value", c_uint8 * 32))


class _String(ctypes.Structure):
    _fields_ = (("data", c_char_p), ("size", c_size_t), ("capacity", c_size_t))


class _Sequence(ctypes.Structure):
    _fields_ = (("data", c_void_p), ("size", c_size_t), ("capacity", c_size_t))


class _FieldType(ctypes.Structure):
    _fields_ = (
        ("type_id", c_uint8), ("capacity", c_uint64), ("string_capacity", c_uint64), ("nested_type_name", _String),
    )  # fmt: skip


class _Field(ctypes.Structure):
    _fields_ = (("name", _String), ("type", _FieldType), ("default_value", _String))


class _IndividualTypeDescription(ctypes.Structure):
    _fields_ = (("type_name", _String), ("fields", _Sequence))


class _TypeDescription(ctypes.Structure):
    _fields_ = (("type_description", _IndividualTypeDescription), ("referenced", _Sequence))


class _TypeSource(ctypes.Structure):
    _fields_ = (("type_name", _String), ("encoding", _String), ("raw_file_contents", _String))


class _EventInfo(ctypes.Structure):
    _fields_ = (
        ("event_type", c_uint8), ("stamp_sec", c_int), ("stamp_nanosec", c_uint32), ("client_gid", c_uint8 * 16),
        ("sequence_number", ctypes.c_int64),
    )  # fmt: skip


# C keeps the addresses of what is made here for as long as the process lives.
_kept: list[Any] = []


def _keep(value: Any) -> int:
    """The address of a structure or callback, which is kept for good."""
    _kept.append(value)
    if isinstance(value, ctypes.Structure | ctypes.Array):
        return ctypes.addressof(value)
    return ctypes.cast(value, c_void_p).value or 0


def _library(name: str) -> ctypes.CDLL:
    """A library of ROS that rclpy has loaded."""
    import_module("rclpy._rclpy_pybind11")
    return ctypes.PyDLL(name)


def _function(library: ctypes.CDLL, name: str, result: Any, **parameters: Any) -> Any:
    """A C function that keeps the interpreter's lock; its parameters can be given by name."""
    prototype = ctypes.PYFUNCTYPE(result, *parameters.values())
    return prototype((name, library), tuple((1, parameter) for parameter in parameters))


def _c_api(name: str) -> int:
    return ctypes.cast(getattr(ctypes.pythonapi, name), c_void_p).value or 0


class _Step(functools.partial):  # type: ignore[type-arg]
    """A call that takes what stands before it: `value + step` is `step(value)`, without Python code."""

    __radd__ = functools.partial.__call__


class _Message(_Step):
    """What rcl takes for a message. As a call it reads or writes the body: `cdr + message`, `message(cdr)`."""

    codec: Codec
    received: list[tuple[int, bytes]]
    size: int

    def __rmatmul__(self, message: Any) -> Any:
        """Take the values of a Python message: convert_from_py."""
        self.put(self.codec.to_bytes(message))
        return _SUCCESS

    def __invert__(self) -> Any:
        """A new Python message: convert_to_py."""
        return self.value()

    def put(self, body: bytes) -> None:
        kept = {"codec": self.codec, "received": [(_NATIVE_ORDER, body)], "size": len(body)}
        self.__setstate__((_fast_cdr().write, (), {"data": body, "size": len(body)}, kept))  # type: ignore[attr-defined]

    def value(self) -> Any:
        if not self.received:
            return self.codec.message_class()
        order, body = self.received[-1]
        return self.codec.from_bytes(body, little_endian=order == 1)


# C++ takes the lowest byte of the address of this object for "true".
_SUCCESS = next(made for made in [object() for _ in range(64)] if id(made) & 0xFF)
_TRUE = _Step(operator.not_)  # after a step that gives None
_NATIVE_ORDER = int(sys.byteorder == "little")  # as Cdr::endianness() tells it


class _FastCdr:
    """The functions of Fast CDR in use, none of which throws, and where its objects hold what they do not tell."""

    def __init__(self) -> None:
        library = _library("libfastcdr.so.2")
        cdr = {"cdr": c_void_p}
        self.write = _function(
            library, "_ZN8eprosima7fastcdr3Cdr15serialize_arrayEPKcm", c_void_p, **cdr, data=c_char_p, size=c_size_t
        )
        self.position = _function(library, "_ZN8eprosima7fastcdr3Cdr20get_current_positionEv", c_void_p, **cdr)
        self.order = _function(library, "_ZNK8eprosima7fastcdr3Cdr10endiannessEv", c_uint8, **cdr)
        self._find_layout(library)

    def _find_layout(self, library: ctypes.CDLL) -> None:
        """Find in an object of our own where a Cdr refers to its buffer, and where this holds its address and size."""
        raw, buffer, cdr = (ctypes.create_string_buffer(size) for size in (96, 1024, 8192))
        raw_at, buffer_at, cdr_at = (ctypes.addressof(each) for each in (raw, buffer, cdr))
        _function(
            library, "_ZN8eprosima7fastcdr10FastBufferC1EPcm", None, buffer=c_void_p, data=c_void_p, size=c_size_t
        )(buffer_at, raw_at, len(raw))
        make = "_ZN8eprosima7fastcdr3CdrC1ERNS0_10FastBufferENS1_10EndiannessENS0_10CdrVersionE"
        _function(library, make, None, cdr=c_void_p, buffer=c_void_p, order=c_uint8, version=c_int)(
            cdr_at, buffer_at, _NATIVE_ORDER, 1
        )
        self._buffer_words, self._cdr_words = struct.Struct("NN"), struct.Struct("N")
        try:
            self._range_at = bytes(buffer).index(self._buffer_words.pack(raw_at, len(raw)))
            self._buffer_at = bytes(cdr).index(self._cdr_words.pack(buffer_at))
        except ValueError:
            raise ImportError("this version of Fast CDR is not known: its objects hold no buffer") from None
        if self._range_at % 8 or self._buffer_at % 8 or self.position(cdr_at) != raw_at:
            raise ImportError("this version of Fast CDR is not known: its objects hold their buffer elsewhere")

    def arrivals(self) -> tuple[_Step, Iterator[tuple[int, bytes]]]:
        """A step that takes a Cdr, and an iterator whose next value is its byte order and the rest of its buffer."""
        cdr = c_void_p()
        cdrs = itertools.repeat(cdr)
        addresses = map(operator.attrgetter("value"), cdrs)
        word = map(_copy, map(operator.add, addresses, itertools.repeat(self._buffer_at)), itertools.repeat(8))
        buffer = map(operator.itemgetter(0), map(self._cdr_words.unpack, word))
        words = map(_copy, map(operator.add, buffer, itertools.repeat(self._range_at)), itertools.repeat(16))
        end = map(sum, map(self._buffer_words.unpack, words))
        body = map(_copy, map(self.position, cdrs), map(operator.sub, end, map(self.position, cdrs)))
        return _Step(c_void_p.__init__, cdr), zip(map(self.order, cdrs), body, strict=False)


@functools.cache
def _fast_cdr() -> _FastCdr:
    return _FastCdr()


@functools.cache
def _arrivals() -> tuple[_Step, Iterator[tuple[int, bytes]]]:
    """One pair for all messages: no other thread runs between the step and the value that it leads to."""
    return _fast_cdr().arrivals()


_copy = _function(ctypes.pythonapi, "PyBytes_FromStringAndSize", py_object, data=c_void_p, size=c_size_t)
_fill = _function(ctypes.pythonapi, "memset", c_void_p, data=c_void_p, value=c_int, size=c_size_t)

# ctypes hands these to C; what they call is written in C.
_serialize = ctypes.CFUNCTYPE(c_bool, py_object, c_void_p)(functools.partial.__call__)
_deserialize = ctypes.CFUNCTYPE(c_bool, c_void_p, py_object)(operator.add)
_size = ctypes.CFUNCTYPE(c_uint32, py_object)(operator.attrgetter("size"))
_hashes: dict[int, int] = {}
_get_hash = ctypes.CFUNCTYPE(c_void_p, c_void_p)(_hashes.__getitem__)


def _new_message(codec: Codec) -> _Message:
    """A message that reads the body that a Cdr object stands at, from there to its end."""
    take, arrivals = _arrivals()
    received: list[tuple[int, bytes]] = []
    message = _Message(sum, (take, _Step(next, map(received.append, arrivals)), _TRUE))
    message.codec, message.received, message.size = codec, received, 0
    return message


def _maximum_size(codec: Codec) -> Any:
    """The callback max_serialized_size(char & bounds_info): whether there is a bound, and the bound."""
    bounded = codec.maximum_size is not None
    tell = _Step(_fill, value=int(bounded), size=1)
    steps = (tell, _Step(operator.mul, 0), _Step(operator.add, codec.maximum_size or 0))
    return ctypes.CFUNCTYPE(c_size_t, c_void_p)(functools.partial(sum, steps))


class Descriptions:
    """The type description file of one interface, and its definition."""

    def __init__(self, path: Path) -> None:
        content = json.loads(path.with_suffix(".json").read_text(encoding="utf-8"))
        message = content["type_description_msg"]
        every = (message["type_description"], *message["referenced_type_descriptions"])
        self.name: str = every[0]["type_name"]
        self.types: dict[str, dict[str, Any]] = {each["type_name"]: each for each in every}
        self.hashes: dict[str, str] = {each["type_name"]: each["hash_string"] for each in content["type_hashes"]}
        self._path = path

    def functions(self, type_name: str, address: int) -> tuple[Any, Any, Any]:
        """The callbacks for hash, description and sources of the type support at an address."""
        digest = _TypeHash(1, (c_uint8 * 32)(*bytes.fromhex(self.hashes[type_name].partition("_")[2])))
        _hashes[address] = _keep(digest)
        _texts[address] = functools.cache(lambda: _keep(self._description(type_name)))
        _sources[address] = functools.cache(lambda: _keep(self._sequence(_TypeSource, self._source())))
        return _keep(_get_hash), _keep(_get_description), _keep(_get_sources)

    def _description(self, type_name: str) -> _TypeDescription:
        found: set[str] = set()
        pending = [type_name]
        while pending:
            for field in self.types[pending.pop()]["fields"]:
                nested = field["type"]["nested_type_name"]
                if nested and nested not in found:
                    found.add(nested)
                    pending.append(nested)
        referenced = [self._individual(name) for name in sorted(found)]
        return _TypeDescription(self._individual(type_name), self._sequence(_IndividualTypeDescription, referenced))

    def _individual(self, type_name: str) -> _IndividualTypeDescription:
        fields = [
            _Field(
                _text(field["name"]),
                _FieldType(
                    field["type"]["type_id"], field["type"]["capacity"], field["type"]["string_capacity"],
                    _text(field["type"]["nested_type_name"]),
                ),
                _text(field["default_value"]),
            )
            for field in self.types[type_name]["fields"]
        ]  # fmt: skip
        return _IndividualTypeDescription(_text(type_name), self._sequence(_Field, fields))

    def _source(self) -> list[_TypeSource]:
        return [_TypeSource(_text(self.name), _text(self._path.suffix[1:]), _text(self._path.read_text("utf-8")))]

    @staticmethod
    def _sequence(element: Any, values: list[Any]) -> _Sequence:
        return _Sequence(_keep((element * len(values))(*values)) if values else None, len(values), len(values))


def _text(text: str) -> _String:
    encoded = text.encode()
    _kept.append(encoded)
    return _String(encoded, len(encoded), len(encoded) + 1)


_texts: dict[int, Callable[[], int]] = {}
_sources: dict[int, Callable[[], int]] = {}
_get_description = ctypes.CFUNCTYPE(c_void_p, c_void_p)(lambda address: _texts[address]())
_get_sources = ctypes.CFUNCTYPE(c_void_p, c_void_p)(lambda address: _sources[address]())


def _capsule(address: int) -> Any:
    new = ctypes.pythonapi.PyCapsule_New
    new.restype, new.argtypes = py_object, (c_void_p, c_char_p, c_void_p)
    return new(address, None, None)


def _address(capsule: Any) -> int:
    get = ctypes.pythonapi.PyCapsule_GetPointer
    get.restype, get.argtypes = c_void_p, (py_object, c_char_p)
    return int(get(capsule, None))


def _handle_function(name: str) -> int:
    return ctypes.cast(getattr(_library("librosidl_runtime_c.so"), name), c_void_p).value or 0


class TypeSupport:
    """The capsules of one package's types, by the names that generated code asks for."""

    def __init__(self, package: str, share: Path, types: Mapping[str, tuple[str, str, str]]) -> None:
        """Take the package's share folder and its types.

        Args:
            package: Name of the package.
            share: The folder of its definitions and type descriptions.
            types: By the ending of the names that are asked for, `msg__foo`: the interface, `msg/Foo`; the module
                of its classes, `_foo`; the class.
        """
        self._package = package
        self._share = share
        self._types = types
        self._made: dict[str, Any] = {}
        self._described: dict[str, Descriptions] = {}

    def __call__(self, name: str) -> Any:
        """The capsule of a name such as `type_support_msg__msg__foo`; as a module's `__getattr__`."""
        kind, _, ending = name.partition("__")
        if kind.startswith("_") or ending not in self._types:
            raise AttributeError(f"the type support of {self._package} has no {name!r}")
        if name not in self._made:
            self._add(kind, ending)
        return self._made[name]

    def _add(self, kind: str, ending: str) -> None:
        interface, module, class_name = self._types[ending]
        package = f"{self._package}.{interface.partition('/')[0]}"
        made = getattr(import_module(f"{package}.{module}"), class_name)
        type_name = f"{package.replace('.', '/')}/{class_name}"
        if interface not in self._described:
            self._described[interface] = Descriptions(self._share / f"{interface}.{interface.partition('/')[0]}")
        described = self._described[interface]
        if kind == "type_support_srv":
            self._made[f"type_support_srv__{ending}"] = _capsule(_service(type_name, made, described))
        elif kind == "type_support_action":
            self._made[f"type_support_action__{ending}"] = _capsule(_action(type_name, made, described))
        else:
            codec = codec_of(made)
            create = ctypes.CFUNCTYPE(py_object)(functools.partial(_new_message, codec))
            addresses = {
                "create_ros_message": _keep(create),
                "destroy_ros_message": _c_api("Py_DecRef"),
                "convert_from_py": _c_api("PyNumber_MatrixMultiply"),
                "convert_to_py": _c_api("PyNumber_Invert"),
                "type_support": _message(type_name, codec, described),
            }
            for name, address in addresses.items():
                self._made[f"{name}_msg__{ending}"] = _capsule(address)


def _message(type_name: str, codec: Codec, described: Descriptions) -> int:
    package, kind, name = type_name.split("/")
    callbacks = _MessageCallbacks(
        f"{package}::{kind}".encode(), name.encode(), _keep(_serialize), _keep(_deserialize), _keep(_size),
        _keep(_maximum_size(codec)), None,
    )  # fmt: skip
    handles: dict[bytes, int] = {}
    func = _handle_function_for(handles)
    support = _MessageTypeSupport(_IDENTIFIER, _keep(callbacks), func)
    members = _keep(_members(type_name, codec.message_class))
    introspection = _MessageTypeSupport(None, members, func)
    ctypes.cast(ctypes.byref(introspection), POINTER(c_void_p))[0] = _introspection_identifier()
    for identifier, each in ((_IDENTIFIER, support), (_INTROSPECTION, introspection)):
        address = handles[identifier] = _keep(each)
        each.get_type_hash, each.get_type_description, each.get_sources = described.functions(type_name, address)
    return handles[_IDENTIFIER]


def _service(type_name: str, made: Any, described: Descriptions) -> int:
    package, kind, name = type_name.split("/")
    request, response, event = (_support_of(each) for each in (made.Request, made.Response, made.Event))
    callbacks = _ServiceCallbacks(f"{package}::{kind}".encode(), name.encode(), request, response)
    create = _CREATE_EVENT(functools.partial(_new_event, made.Event))
    service = _ServiceTypeSupport(
        _IDENTIFIER, _keep(callbacks), _handle_function("get_service_typesupport_handle_function"), request,
        response, event, _keep(create), _keep(_destroy_event),
    )  # fmt: skip
    address = _keep(service)
    service.get_type_hash, service.get_type_description, service.get_sources = described.functions(type_name, address)
    return address


def _action(type_name: str, made: Any, described: Descriptions) -> int:
    goal, result, cancel = made.Impl.SendGoalService, made.Impl.GetResultService, made.Impl.CancelGoalService
    action = _ActionTypeSupport(
        *(_support_of(each) for each in (goal, result, cancel, made.Impl.FeedbackMessage, made.Impl.GoalStatusMessage))
    )
    address = _keep(action)
    action.get_type_hash, action.get_type_description, action.get_sources = described.functions(type_name, address)
    return address


# The numbers of types in rosidl_typesupport_introspection_c/field_types.h.
_MEMBER_TYPES = {
    "float": 1, "double": 2, "boolean": 6, "octet": 7, "uint8": 8, "int8": 9, "uint16": 10, "int16": 11, "uint32": 12,
    "int32": 13, "uint64": 14, "int64": 15,
}  # fmt: skip


def _members(type_name: str, made: Any) -> _Members:
    """The description of a class from which rmw_fastrtps makes the type object that it announces."""
    package, kind, name = type_name.split("/")
    members = [_member(*field) for field in fields_of(made)]
    if not members:
        members = [_Member(b"structure_needs_at_least_one_member", _MEMBER_TYPES["uint8"])]
    array = (_Member * len(members))(*members)
    return _Members(f"{package}__{kind}".encode(), name.encode(), len(members), members=_keep(array))


def _member(name: str, type_: Any) -> _Member:
    member = _Member(name.encode())
    if isinstance(type_, definition.AbstractNestedType):
        fixed = isinstance(type_, definition.Array)
        member.is_array, member.is_upper_bound = True, isinstance(type_, definition.BoundedSequence)
        member.array_size = type_.size if fixed else getattr(type_, "maximum_size", 0)
        type_ = type_.value_type
    if isinstance(type_, definition.NamespacedType):
        member.type_id, address = 18, _support_of(class_of(type_))
        support = _MessageTypeSupport.from_address(address)
        member.members = _HANDLE_FUNCTION(support.func)(address, _INTROSPECTION)
    elif isinstance(type_, definition.AbstractGenericString):
        member.type_id = 17 if isinstance(type_, definition.AbstractWString) else 16
        member.string_upper_bound = type_.maximum_size if type_.has_maximum_size() else 0
    else:
        member.type_id = _MEMBER_TYPES[type_.typename]
    return member


_HANDLE_FUNCTION = ctypes.CFUNCTYPE(c_void_p, c_void_p, c_char_p)


def _introspection_identifier() -> int:
    """The address of the identifier, which rmw_fastrtps compares."""
    library = _library("librosidl_typesupport_introspection_c.so")
    return c_void_p.in_dll(library, "rosidl_typesupport_introspection_c__identifier").value or 0


def _handle_function_for(handles: dict[bytes, int]) -> int:
    """The function `handle(type support, identifier)`: `type_support[identifier]`, without Python code."""
    handle = type("_Handle", (c_void_p,), {"__getitem__": handles.get})
    return _keep(ctypes.CFUNCTYPE(c_void_p, handle, c_char_p)(operator.getitem))


def _support_of(made: Any) -> int:
    """The address of the type support of a message or service class, of this package or of another."""
    metaclass = made.__class__
    if metaclass._TYPE_SUPPORT is None:  # noqa: SLF001 - as generated code does it
        metaclass.__import_type_support__()
    return _address(metaclass._TYPE_SUPPORT)  # noqa: SLF001


_CREATE_EVENT = ctypes.CFUNCTYPE(c_void_p, POINTER(_EventInfo), c_void_p, c_void_p, c_void_p)


def _new_event(event_class: Any, info: Any, _allocator: int, request: int | None, response: int | None) -> int:
    """The message that service introspection publishes; it holds a reference until it is destroyed."""
    event = event_class()
    told = info.contents
    event.info.event_type, event.info.sequence_number = told.event_type, told.sequence_number
    event.info.stamp.sec, event.info.stamp.nanosec = told.stamp_sec, told.stamp_nanosec
    event.info.client_gid[:] = list(told.client_gid)
    for field, message in (("request", request), ("response", response)):
        if message:
            getattr(event, field).append(ctypes.cast(message, py_object).value.value())
    made = _new_message(codec_of(event_class))
    made.put(made.codec.to_bytes(event))
    _events[id(made)] = made
    return id(made)


_events: dict[int, _Message] = {}
_destroy_event = ctypes.CFUNCTYPE(c_bool, c_void_p, c_void_p)(
    lambda event, _allocator: _events.pop(event, None) is not None
)
