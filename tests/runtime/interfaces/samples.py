"""Messages with random values, and installations of which some packages are taken out."""

import importlib
import random
import string
import sys
from pathlib import Path
from typing import Any

from rosidl_parser import definition

from grader.runtime.interfaces.runtime.codec import class_of, fields_of

SHARE = Path(sys.prefix) / "share"
LETTERS = string.ascii_letters + "äß€漢😀 "


def installed_packages() -> list[str]:
    """The installed packages that define messages, services or actions."""
    kinds = ("msg", "srv", "action")
    return sorted({path.parts[-3] for kind in kinds for path in SHARE.glob(f"*/{kind}/*.json")})


def share_without(folder: Path, *packages: str) -> Path:
    """A share folder like the installed one, without some packages."""
    folder.mkdir()
    for entry in SHARE.iterdir():
        if entry.name not in packages:
            (folder / entry.name).symlink_to(entry)
    return folder


def message_classes(package: str) -> list[Any]:
    """All generated message classes of a package, those of its services and actions included."""
    found = []
    for path in sorted((SHARE / package).glob("*/*.json")):
        kind = path.parent.name
        made = getattr(importlib.import_module(f"{package}.{kind}"), path.stem)
        module = sys.modules[made.__module__]
        found += [each for each in vars(module).values() if hasattr(each, "SLOT_TYPES")]
    return found


def filled(message_class: Any, chance: random.Random, depth: int = 0) -> Any:
    """A message with random values in all its fields."""
    message = message_class()
    for name, type_ in fields_of(message_class):
        setattr(message, name, _value(type_, chance, depth))
    return message


def _value(type_: Any, chance: random.Random, depth: int) -> Any:
    if isinstance(type_, definition.AbstractNestedType):
        if isinstance(type_, definition.Array):
            count = type_.size
        else:
            count = chance.randrange(min(getattr(type_, "maximum_size", 4), 4 if depth < 2 else 1) + 1)
        return [_value(type_.value_type, chance, depth + 1) for _ in range(count)]
    if isinstance(type_, definition.NamespacedType):
        return filled(class_of(type_), chance, depth + 1)
    if isinstance(type_, definition.AbstractGenericString):
        longest = type_.maximum_size if type_.has_maximum_size() else 12
        return "".join(chance.choices(LETTERS, k=chance.randrange(longest + 1)))
    return _primitive(type_.typename, chance)


def _primitive(typename: str, chance: random.Random) -> Any:
    if typename == "boolean":
        return chance.random() < 0.5
    if typename == "octet":
        return bytes([chance.randrange(256)])
    if typename in {"float", "double"}:
        return chance.choice([0.0, -1.5, 2.0**-20, float(chance.randrange(-(10**6), 10**6))])
    bits = int(typename.lstrip("uint"))
    return chance.randrange(2**bits) - (0 if typename.startswith("u") else 2 ** (bits - 1))
