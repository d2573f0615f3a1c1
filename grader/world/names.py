"""Completes the names of topics, services, actions and nodes that a test uses."""

from __future__ import annotations


def absolute_name(name: str) -> str:
    """Return a name with the slash that it begins with; a test lies in no namespace.

    Raises:
        TypeError: It is not text.
        ValueError: It begins with `~`, for which a program puts the name of its node: a test has none.
    """
    if not isinstance(name, str):
        raise TypeError(f"expected the name of a topic, service, action or node, found {name!r}")
    if name.startswith("~"):
        example = f"/NODE/{name.lstrip('~/')}"
        raise ValueError(f"{name}: expected a full name, such as {example}: a test has no node that ~ could stand for")
    return name if name.startswith("/") else f"/{name}"
