"""Fields of messages, requests and responses by their paths, lists included: `transforms.0.header.frame_id`."""

from __future__ import annotations

from collections.abc import Mapping
from functools import lru_cache
from typing import Any

from grader.judging.values import as_number


class NoSuchField(KeyError):  # noqa: N818 - says what is missing, and never ends a run
    """A value has no field of that path."""


def at_path(value: Mapping[str, Any], path: str) -> Any:
    """Return what a value holds at a path; elements of lists are counted from 0.

    Raises:
        NoSuchField: There is nothing.
    """
    here: Any = value
    for name in _names(path):
        if isinstance(here, Mapping) and name in here:
            here = here[name]
        elif isinstance(here, (list, tuple)) and name.isdecimal() and len(name) < 9 and int(name) < len(here):
            here = here[int(name)]
        else:
            raise NoSuchField(path)
    return here


def number_at(value: Mapping[str, Any], path: str) -> float | None:
    """Return the number at a path, or None if there is none."""
    try:
        return as_number(at_path(value, path))
    except NoSuchField:
        return None


def text_at(value: Mapping[str, Any], path: str) -> str | None:
    """Return the text at a path, or None if there is none."""
    try:
        found = at_path(value, path)
    except NoSuchField:
        return None
    return found if isinstance(found, str) else None


@lru_cache(maxsize=256)
def _names(path: str) -> tuple[str, ...]:
    return tuple(path.split("."))
