"""Gives the functions that replace others the names of those, under which a program pickles them and sees them."""

from __future__ import annotations

import os
import sys
from types import FunctionType

#: Modules whose functions are replaced, each before those that have a function from it.
MODULES = ["time", "select", "signal", "os", "socket", "threading", "queue", "random", "selectors", "_thread"]


def rename() -> None:
    """Name each function of this package that another module has as that module's own.

    `multiprocessing` pickles what it calls: a program may hand `time.sleep` to another process.
    """
    package = os.path.join(os.path.dirname(__file__), "")
    for module in filter(None, map(sys.modules.get, MODULES)):
        for name, value in vars(module).items():
            own = isinstance(value, FunctionType) and value.__code__.co_filename.startswith(package)
            if own and getattr(sys.modules.get(value.__module__), value.__name__, None) is not value:
                value.__module__, value.__name__, value.__qualname__ = module.__name__, name, name
