"""Replaces what else of rclpy differs between runs or takes long: the order of sets, places that log, one executor."""

from __future__ import annotations

import functools
import inspect
import itertools
import sys
import weakref
from collections.abc import Callable
from types import CodeType, SimpleNamespace
from typing import Any

import rclpy.clock
import rclpy.impl.rcutils_logger
import rclpy.node
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

#: The most places in the code that are remembered for their log records.
CALLERS = 2000


def install_order() -> None:
    """Give sets of nodes and of clocks the same order in each run: their hashes are addresses otherwise.

    An executor keeps its nodes in a set, whose order decides whose callback runs first at one instant, and a node with
    simulated time the clocks that it sets.
    """
    known: dict[int, tuple[int, weakref.ref[Any]]] = {}
    numbers = itertools.count(1)

    def numbered(thing: Any) -> int:
        """Return a number by the order in which things are first put into a set."""
        key = id(thing)
        if key not in known:
            known[key] = next(numbers), weakref.ref(thing, lambda _: known.pop(key, None))
        return known[key][0]

    for kind in (rclpy.node.Node, rclpy.clock.Clock):
        kind.__hash__ = numbered


def install_callers() -> None:
    """Remember, for each place in the code, what rclpy finds out about the caller of a log record.

    Of a frame, rclpy needs the file alone, but asks for lines of the source as well, for which `inspect` searches
    through all modules.
    """
    loggers = rclpy.impl.rcutils_logger
    files_only = functools.partial(inspect.getframeinfo, context=0)
    loggers.inspect = SimpleNamespace(**{**vars(inspect), "getframeinfo": files_only})
    look = loggers.CallerId.__new__
    loggers_own: dict[int, CodeType] = {}
    known: dict[tuple[int, int, int], tuple[CodeType, Any]] = {}  # a code's id is its own as long as it is kept

    def caller(cls: type[Any], given: Any = None) -> Any:
        if given is not None:
            return look(cls, given)
        log: Any = sys._getframe(1)
        frame = log
        while id(frame.f_code) in loggers_own:
            frame = frame.f_back
        place = id(frame.f_code), frame.f_lasti, len(loggers._internal_callers)
        if place in known:
            return known[place][1]
        outside = loggers._find_caller(log)
        while log is not outside:
            loggers_own[id(log.f_code)] = log.f_code
            log = log.f_back
        found = look(cls, outside)
        if len(known) < CALLERS:
            known[id(outside.f_code), outside.f_lasti, len(loggers._internal_callers)] = outside.f_code, found
        return found

    loggers.CallerId.__new__ = caller


def replace_log(wrap: Callable[[Callable[..., Any]], Callable[..., Any]]) -> None:
    """Wrap the one function through which every logger writes."""
    _rclpy.rclpy_logging_rcutils_log = wrap(_rclpy.rclpy_logging_rcutils_log)


def install_events_executor(give_up: Callable[[], None]) -> None:
    """Call `give_up` before the program makes an executor that waits in C++, where no time can be replaced."""
    make = getattr(_rclpy, "EventsExecutor", None)
    if make is None:  # not in this release
        return

    def making(*args: Any, **kwargs: Any) -> Any:
        give_up()
        return make(*args, **kwargs)

    _rclpy.EventsExecutor = making
