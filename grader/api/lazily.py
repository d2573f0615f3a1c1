"""Imports the names of a public module when they are first looked up."""

from __future__ import annotations

import importlib
from collections.abc import Mapping
from typing import Any


def homes(contents: Mapping[str, Mapping[str, str]]) -> dict[str, str]:
    """Return the module of each name in a table of contents, which lists names by topic and by module."""
    return {name: home for modules in contents.values() for home, names in modules.items() for name in names.split()}


def look_up(namespace: dict[str, Any], known: Mapping[str, str], name: str) -> Any:
    """Import a name and keep it in a module's namespace; raises AttributeError for one that is not known."""
    if name not in known:
        raise AttributeError(f"module {namespace['__name__']} has no attribute {name}")
    namespace[name] = getattr(importlib.import_module(known[name]), name)
    return namespace[name]
