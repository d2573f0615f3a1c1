"""Imports what loads the type supports of messages, without the generator of their classes, which no node uses."""

from __future__ import annotations

import importlib
import sys
from typing import Any

PACKAGE = "rosidl_generator_py"


def import_type_support_loader() -> None:
    """Import `rosidl_generator_py` as it is where its generator is not installed, which it allows for.

    The generator imports two parsers, which takes a tenth of the time of all imports of a node.
    """
    generator = f"{PACKAGE}.generate_py_impl"
    modules: dict[str, Any] = sys.modules
    if PACKAGE in modules or generator in modules:
        return
    modules[generator] = None
    try:
        importlib.import_module(PACKAGE)
    finally:
        del modules[generator]
