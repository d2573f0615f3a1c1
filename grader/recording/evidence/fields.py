"""The fields of a packed message: left as the JSON that they are until somebody looks at them."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from typing import Any

import msgspec

#: Shorter values take less as the dict they are; a longer one may hold a number that no decoder takes.
_SHORTEST, _LONGEST = 64, 4_000
_OPENING = ord("{")
_decode = msgspec.json.Decoder(dict[str, Any]).decode


class Fields(Mapping[str, Any]):
    """A mapping that is decoded again whenever something is looked up: most of a trace is never looked at.

    Args:
        text: A JSON object in ASCII, its syntax checked.
    """

    __slots__ = ("_text",)

    def __init__(self, text: msgspec.Raw) -> None:
        self._text = text

    def __getitem__(self, name: str) -> Any:
        return self._decoded()[name]

    def __iter__(self) -> Iterator[str]:
        return iter(self._decoded())

    def __len__(self) -> int:
        return len(self._decoded())

    def __eq__(self, other: object) -> bool:
        if isinstance(other, Fields):
            return self._text == other._text or self._decoded() == other._decoded()
        return self._decoded() == other

    __hash__ = None  # type: ignore[assignment]  # like any mapping that may hold a list

    def _decoded(self) -> dict[str, Any]:
        try:
            return _decode(self._text)
        except (msgspec.MsgspecError, UnicodeDecodeError):  # numbers and texts that only the exact way takes
            fields: dict[str, Any] = json.loads(bytes(self._text))
            return fields


def fields_of(text: msgspec.Raw) -> Mapping[str, Any]:
    """Return the fields that a JSON text holds; raises MsgspecError if it holds no object."""
    lazy = _SHORTEST < len(text) <= _LONGEST and memoryview(text)[0] == _OPENING
    return Fields(text) if lazy else _decode(text)
