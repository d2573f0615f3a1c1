"""Imports numpy when something in it is first used: message classes import it, and a worker seldom needs it."""

from __future__ import annotations

import importlib
import sys
from types import ModuleType
from typing import Any


class LateNumpy(ModuleType):
    """Stands for numpy until one of its names is used, then holds all of them."""

    def __init__(self) -> None:
        super().__init__("numpy")

    def __getattr__(self, name: str) -> Any:
        if sys.modules.get("numpy") is self:
            del sys.modules["numpy"]
        self.__dict__.update(vars(importlib.import_module("numpy")))
        try:
            return self.__dict__[name]
        except KeyError:
            return getattr(sys.modules["numpy"], name)


def install() -> None:
    """Let the following imports of numpy in this process return at once."""
    sys.modules.setdefault("numpy", LateNumpy())


def load_numpy() -> None:
    """Import numpy now, because a recording on the wall clock must not wait for it."""
    importlib.import_module("numpy").ndarray  # noqa: B018 - using a name imports it
