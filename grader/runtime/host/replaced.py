"""Makes the functions of this package that replace others look and fail as those do."""

from __future__ import annotations

import contextlib
import functools
import importlib
import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator
from types import BuiltinFunctionType, FrameType, FunctionType, TracebackType
from typing import Any

_HOST = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
#: Modules whose functions are replaced, each before those that have a function from it.
MODULES = ("time", "select", "signal", "os", "socket", "threading", "queue", "random", "selectors", "_thread")
#: Their functions in C, before any is replaced.
_IN_C = {
    (module, name): value
    for module in MODULES
    for name, value in vars(importlib.import_module(module)).items()
    if isinstance(value, BuiltinFunctionType)
}


class _Builtin:
    """A function that shows of itself what a function in C does, and does not become a method in a class.

    Args:
        function: What a call calls, without a frame in between.
        original: The function in C, whose attributes it has.
    """

    # A slot, so that the type finds the function of each object.
    __slots__ = ("__call__", "__weakref__", "_original")

    def __init__(self, function: Callable[..., Any], original: Any) -> None:
        self.__call__ = function
        self._original = original

    def __getattribute__(self, name: str) -> Any:
        own = object.__getattribute__
        return own(self, name) if name == "__call__" else getattr(own(self, "_original"), name)

    def __repr__(self) -> str:
        return repr(object.__getattribute__(self, "_original"))

    def __sizeof__(self) -> int:
        return int(object.__getattribute__(self, "_original").__sizeof__())


_Builtin.__module__, _Builtin.__doc__ = "builtins", BuiltinFunctionType.__doc__
_Builtin.__name__ = _Builtin.__qualname__ = "builtin_function_or_method"


def as_builtin(function: Callable[..., Any], original: Any) -> Any:
    """Return a function that shows itself as another one, if that is one in C; otherwise it is returned as it is."""
    return _Builtin(function, original) if isinstance(original, BuiltinFunctionType) else function


def _is_own(value: Any) -> bool:
    return isinstance(value, FunctionType) and value.__code__.co_filename.startswith(_HOST)


def rename_functions() -> None:
    """Name each function of this package that another module has as that module's own.

    `multiprocessing` pickles what it calls: a program may hand `time.sleep` to another process. A class may have it as
    an attribute, `pause = time.sleep`, which a function in Python would be a method of.
    """
    made: dict[tuple[int, int], Any] = {}
    for module in filter(None, map(sys.modules.get, MODULES)):
        for name, value in list(vars(module).items()):
            if not _is_own(value):
                continue
            original = _IN_C.get((module.__name__, name))
            shown = None if original is None else _shown(value, original, made)
            if shown is not None:
                setattr(module, name, shown)
            elif getattr(sys.modules.get(value.__module__), value.__name__, None) is not value:
                value.__module__, value.__name__, value.__qualname__ = module.__name__, name, name


def _shown(value: Any, original: Any, made: dict[tuple[int, int], Any]) -> Any:
    """Return what shows a function of this package as the one in C that it replaces.

    None where another function stands in the module that the original is from, as for `queue.time`: it could not be
    pickled by the name of the original.

    Args:
        value: The function of this package.
        original: The function in C.
        made: What shows the pairs before, to which this one is added.
    """
    home, called = sys.modules[original.__module__], original.__name__
    there = getattr(home, called, None)
    shown = made.setdefault((id(value), id(original)), _Builtin(value, original))
    if there is original:  # in a module such as `posix`
        setattr(home, called, shown)
    return shown if any(there is each for each in (original, value, shown)) else None


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


def hide_frames() -> None:
    """Leave the frames of this package out of the stacks that `traceback` shows, and so `logging` and `asyncio`."""
    summary: Any = traceback.StackSummary
    extract = summary._extract_from_extended_frame_gen

    def extract_others(cls: Any, /, frames: Iterable[tuple[FrameType, Any]], **options: Any) -> Any:
        # Walked here: it begins a fixed number of frames above the one that asks for the first.
        walked = list(frames)
        others = [(frame, places) for frame, places in walked if not is_own_frame(frame)]
        return extract.__func__(cls, iter(others), **options)

    summary._extract_from_extended_frame_gen = classmethod(extract_others)


def is_own_frame(frame: FrameType) -> bool:
    """Return whether a frame runs code of this package."""
    return frame.f_code.co_filename.startswith(_HOST)


def without_own_frames(error: BaseException) -> BaseException:
    """Remove the frames of this package from the traceback of an exception, and of all that it is shown with."""
    pending: list[BaseException | None] = [error]
    seen: set[int] = set()
    while pending:
        one = pending.pop()
        if one is None or id(one) in seen:
            continue
        seen.add(id(one))
        shown = [step for step in _steps(one.__traceback__) if not is_own_frame(step.tb_frame)]
        rest: TracebackType | None = None
        for step in reversed(shown):
            rest = TracebackType(rest, step.tb_frame, step.tb_lasti, step.tb_lineno)
        BaseException.with_traceback(one, rest)  # an exception may refuse to have its attributes set
        with contextlib.suppress(Exception):  # or to have them looked at
            pending += [one.__cause__, one.__context__]
            if isinstance(one, BaseExceptionGroup):
                pending += one.exceptions
    return error


def _steps(step: TracebackType | None) -> Iterator[TracebackType]:
    while step is not None:
        yield step
        step = step.tb_next


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
