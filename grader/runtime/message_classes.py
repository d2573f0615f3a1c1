"""Finds the classes of message and service types, and converts between messages and plain values."""

from __future__ import annotations

import importlib
import os
import re
import sys
from collections.abc import Mapping
from functools import cache
from pathlib import Path
from typing import Any

from grader.runtime.model.errors import HarnessError

TYPE_NAME = re.compile(r"([a-z][a-z0-9_]*)/(msg|srv|action)/([A-Z][A-Za-z0-9]*)(_[A-Z][A-Za-z]*)?")
#: Where a prefix lists its packages: a file for each (ament's resource index, REP 122).
INDEX = "share/ament_index/resource_index/packages"
#: How far above a folder of modules its prefix may be: `PREFIX/lib/python3.11/site-packages`, `PREFIX/local/lib/...`.
_DEEPEST = 4
#: The services and topics of an action, as they are named on the wire.
ACTION_PARTS = {"_SendGoal": "SendGoalService", "_GetResult": "GetResultService", "_FeedbackMessage": "FeedbackMessage"}


def message_class(interface: str) -> Any:
    """Return the class of a message type, or None if it is not installed."""
    return interface_class(interface, "msg")


def interface_class(interface: str, kind: str) -> Any:
    """Return the class of a type, or None if it is not installed.

    Args:
        interface: e.g. `std_srvs/srv/Trigger` or `test_msgs/action/Fibonacci_SendGoal`.
        kind: `msg`, `srv` or `action`; the parts of actions are messages and services.
    """
    match = TYPE_NAME.fullmatch(interface)
    if match is None:
        return None
    package, namespace, name, part = match.groups()
    asked = kind if part is None else "action"
    if namespace != asked or (part is not None and kind != ("msg" if part == "_FeedbackMessage" else "srv")):
        return None
    if not is_indexed(package):
        return None
    try:
        found = getattr(importlib.import_module(f"{package}.{namespace}"), name, None)
    except ImportError:
        return None
    return found if part is None or found is None else getattr(found.Impl, ACTION_PARTS.get(part, ""), None)


def is_indexed(package: str) -> bool:
    """Return whether the index of installed packages has a package; names in a graph must not choose what is imported.

    It is looked for in the prefixes of AMENT_PREFIX_PATH, and in those that hold the folders of `sys.path`.
    """
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(":")
    folders = (*(Path(prefix, INDEX) for prefix in prefixes if prefix), *filter(None, map(_index_above, sys.path)))
    return any((folder / package).is_file() for folder in folders)


@cache
def _index_above(folder: str) -> Path | None:
    """Return the index in the prefix that a folder of modules is in; None if there is none."""
    above = list(Path(folder).parents)[:_DEEPEST]
    return next((prefix / INDEX for prefix in above if (prefix / INDEX).is_dir()), None)


def wanted_class(interface: str, kind: str, where: str) -> Any:
    """Return the class of a type that a rubric needs; raises HarnessError if it is not installed."""
    found = interface_class(interface, kind)
    if found is None:
        package = interface.partition("/")[0]
        raise HarnessError(f"{where}: expected the type {interface} on this machine, found none: install {package}")
    return found


def plain_fields(message: Any) -> Any:
    """Convert a message to plain values, nested by field name."""
    if hasattr(message, "get_fields_and_field_types"):
        return {name: plain_fields(getattr(message, name)) for name in message.get_fields_and_field_types()}
    if isinstance(message, (bool, int, float, str)):
        return message
    if isinstance(message, bytes):
        return list(message)
    if hasattr(message, "tolist"):
        return message.tolist()
    return [plain_fields(item) for item in message]


def built(message: Any, fields: Mapping[str, Any], where: str) -> Any:
    """Build a message from plain values; fields that are not given keep their defaults.

    Args:
        message: The class of the message.
        fields: Plain values, nested by name; an integer is accepted for a floating-point field.
        where: Prefix of error messages.

    Raises:
        HarnessError: The type has no such field, or the field does not accept the value.
    """
    made = message(check_fields=True)
    kinds = dict(zip(message.get_fields_and_field_types(), message.SLOT_TYPES, strict=True))
    for name, value in fields.items():
        if name not in kinds:
            known = ", ".join(kinds) or "no fields"
            raise HarnessError(f"{where}: expected a field of {_name(message)} ({known}), found `{name}`")
        try:
            part = type(getattr(made, name))
            setattr(made, name, _value(kinds[name], value, part, f"{where}, {name}"))
        except (AssertionError, ValueError, TypeError, OverflowError) as error:
            kind = message.get_fields_and_field_types()[name]
            text = f"{where}: expected a value of the type {kind} in `{name}`, found {str(value)[:80]!r}"
            raise HarnessError(text) from error
    return made


#: The types of fields that hold fractions.
_FRACTIONS = ("float", "double", "long double")


def _value(kind: Any, value: Any, part: Any, where: str) -> Any:
    """Convert a plain value for a field of a kind; `part` is the class of the field's current value."""
    if hasattr(kind, "value_type"):
        return _values_of(kind.value_type, value, part, where)
    if hasattr(kind, "namespaces"):
        if not isinstance(value, Mapping):
            raise TypeError(value)
        return built(part, value, where)
    typename = getattr(kind, "typename", "")
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        return value
    if typename in _FRACTIONS:
        return float(value)
    if typename == "octet":
        return bytes([int(value)])
    return int(value) if float(value).is_integer() else value


def _values_of(element: Any, value: Any, part: Any, where: str) -> list[Any]:
    """Convert a list of plain values for a field whose elements are of a kind."""
    if not isinstance(value, (list, tuple)):
        raise TypeError(value)
    if getattr(element, "typename", "") in _FRACTIONS and all(type(item) is float for item in value):
        return list(value)  # a scan has hundreds
    if hasattr(element, "namespaces"):
        part = getattr(importlib.import_module(".".join(element.namespaces)), element.name)
    return [_value(element, item, part, where) for item in value]


def _name(message: Any) -> str:
    return f"{message.__module__.split('.')[0]}/{message.__name__}"


#: The numeric types of fields, as the classes of messages name them.
_NUMBER = re.compile(r"float|double|u?int(8|16|32|64)")
#: The distance of "just above" from a limit for floating-point types; integers differ by 1. In
#: single precision, a limit of up to 32,767 and a number that is just above it are still different.
FRACTION_STEP = 0.001


def numeric_field(interface: str, field: str = "") -> tuple[str, bool] | None:
    """Return the numeric field of a message type, and whether it is an integer; None if there is none.

    Without a field, that is `data`, or else the only number apart from a variance, as in sensor_msgs/msg/FluidPressure.
    """
    message = message_class(interface)
    if message is None:
        return None
    kinds: Mapping[str, str] = message.get_fields_and_field_types()
    if field or "data" in kinds:
        known = [(field or "data", kinds.get(field or "data", ""))]
    else:
        known = [(name, kind) for name, kind in kinds.items() if name != "variance" and _NUMBER.fullmatch(kind)]
    if len(known) != 1 or not _NUMBER.fullmatch(known[0][1]):
        return None
    name, kind = known[0]
    return name, kind not in ("float", "double")


def number_message(interface: str, number: tuple[float, int], field: str = "") -> tuple[Any, Mapping[str, Any]]:
    """Build a message of a type from a planned number, and return it with its fields; integer types round.

    Raises:
        ValueError: The type has no numeric field.
    """
    found = numeric_field(interface, field)
    if found is None:
        raise ValueError(interface)
    name, whole = found
    value, side = number
    message = message_class(interface)()
    if whole:
        setattr(message, name, round(value) + side)
    else:
        setattr(message, name, float(value) + side * FRACTION_STEP)
    return message, {name: plain_fields(getattr(message, name))}
