"""Makes the functions of this package that replace others look and fail as those do."""

from __future__ import annotations

import functools
import os
import sys
from collections.abc import Callable, Iterable, Iterator
from types import FunctionType
from typing import Any

_HOST = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
#: Modules whose functions are replaced, each before those that have a function from it.
MODULES = ("time", "select", "signal", "os", "socket", "threading", "queue", "random", "selectors", "_thread")


def _is_own(value: Any) -> bool:
    return isinstance(value, FunctionType) and value.__code__.co_filename.startswith(_HOST)


def rename_functions() -> None:
    """Name each function of this package that another module has as that module's own.

    `multiprocessing` pickles what it calls: a program may hand `time.sleep` to another process.
    """
    for module in filter(None, map(sys.modules.get, MODULES)):
        for name, value in vars(module).items():
            if _is_own(value) and getattr(sys.modules.get(value.__module__), value.__name__, None) is not value:
                value.__module__, value.__name__, value.__qualname__ = module.__name__, name, name


def guard_methods(modules: Iterable[str]) -> None:
    """Give each method of this package its name, and call the original one for objects of other classes.

    A program that calls `Node.__init__("talker")` gets the message of Python for it.

    Args:
        modules: Names of modules with classes whose methods are replaced; those that are not imported are ignored.
    """
    for cls in _classes(modules):
        for name, value in list(vars(cls).items()):
            if not _is_own(value):
                continue
            value.__name__, value.__qualname__, value.__module__ = name, f"{cls.__qualname__}.{name}", cls.__module__
            original = value
            while _is_own(original) and hasattr(original, "__wrapped__"):
                original = original.__wrapped__
            if not _is_own(original):
                setattr(cls, name, _guarded(cls, value, original))


def _classes(modules: Iterable[str]) -> Iterator[type]:
    for module in filter(None, map(sys.modules.get, modules)):
        yield from (c for c in vars(module).values() if isinstance(c, type) and c.__module__ == module.__name__)


def _guarded(cls: type, method: Callable[..., Any], original: Callable[..., Any]) -> Callable[..., Any]:
    @functools.wraps(original)
    def guarded(*arguments: Any, **named: Any) -> Any:
        if arguments and isinstance(arguments[0], cls):
            return method(*arguments, **named)
        return original(*arguments, **named)

    return guarded
