"""Message definitions and their encoding, without ROS: what tools need to read a recording anywhere."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from rosbags.interfaces import Nodetype
from rosbags.typesys import Stores, get_typestore

#: Deepest nesting of a message that is built from its fields.
DEPTH = 8
_ZERO: Mapping[str, Any] = {"string": "", "bool": False, "float32": 0.0, "float64": 0.0}


class Unknown(ValueError):  # noqa: N818 - named after what the type or the bytes are
    """A message of a type that has no definition here, or bytes that are no message of it."""


@dataclass(frozen=True, slots=True)
class Definition:
    """How messages of a type are laid out: the text of its definition, parts included, and its hash."""

    text: str
    digest: str


@lru_cache(maxsize=1)
def _store() -> Any:
    return get_typestore(Stores.ROS2_JAZZY)


@lru_cache(maxsize=256)
def definition(interface: str) -> Definition:
    """Return the definition of a message type; raises Unknown for one that is none of ROS's common types."""
    if interface not in _store().fielddefs:
        raise Unknown(interface)
    text, _ = _store().generate_msgdef(interface, ros_version=2)
    return Definition(text, _store().hash_rihs01(interface))


def check_readable(interface: str, cdr: bytes) -> None:
    """Make sure that other tools can decode a message; raises Unknown if they cannot."""
    definition(interface)
    try:
        _store().deserialize_cdr(cdr, interface)
    except Exception as error:  # a malformed message may fail anywhere in the generated decoder
        raise Unknown(interface) from error


def encode(interface: str, value: Mapping[str, Any]) -> bytes:
    """Return a message with these fields, all others zero, as CDR; raises Unknown if they do not fit the type."""
    definition(interface)
    try:
        return bytes(_store().serialize_cdr(_built(interface, value), interface))
    except Exception as error:  # values that a message cannot hold fail anywhere in the generated encoder
        raise Unknown(interface) from error


def _built(interface: str, value: Mapping[str, Any], depth: int = 0) -> Any:
    _, fields = _store().fielddefs[interface]
    if depth > DEPTH or not value.keys() <= {name for name, _ in fields}:
        raise Unknown(interface)
    return _store().types[interface](**{name: _field(kind, value.get(name), depth) for name, kind in fields})


def _field(kind: tuple[Nodetype, Any], value: Any, depth: int) -> Any:
    node, detail = kind
    if node == Nodetype.NAME:
        return _built(detail, {} if value is None else value, depth + 1)
    if node != Nodetype.BASE:
        raise Unknown(str(detail))
    return _ZERO.get(detail[0], 0) if value is None else value
