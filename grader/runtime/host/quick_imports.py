"""Imports packages without those of their imports that no node uses, as if these were not installed."""

from __future__ import annotations

import importlib
import sys
from typing import Any

#: Package -> a module that it imports if it can, and works without: the generator of message classes, which imports two
#: parsers, and a plugin for tests. Either takes as long as a fifth of what a node needs.
NEEDLESS = {"rosidl_generator_py": "rosidl_generator_py.generate_py_impl", "time_machine": "pytest"}


def import_without_needless(package: str) -> Any:
    """Import a package of `NEEDLESS`, and return it; what it does without can still be imported afterwards."""
    needless = NEEDLESS[package]
    modules: dict[str, Any] = sys.modules
    if needless in modules:
        return importlib.import_module(package)
    modules[needless] = None  # Python then says that there is no such module
    try:
        return importlib.import_module(package)
    finally:
        del modules[needless]
