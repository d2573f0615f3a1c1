"""Replaces sleeps and clocks of the standard library, and the methods that programs poll while they wait."""

import concurrent.futures
import functools
import operator
import queue
import sys
import threading
import time
from collections.abc import Callable
from types import FrameType
from typing import Any, SupportsIndex

from . import originals
from .clock import VirtualClock
from .quick_imports import import_without_needless
from .scheduler import Scheduler

NS_PER_S = 1_000_000_000
#: Python sleeps no longer than some 9.2e9 s, and says so.
LONGEST_SLEEP_S = 1e10
#: Top-level packages that look at clocks for themselves -> whether the program may pace itself by it.
LIBRARIES = {"asyncio": True, "logging": False}
#: Monotonic system clocks.
STEADY = frozenset({time.CLOCK_MONOTONIC, time.CLOCK_MONOTONIC_RAW, time.CLOCK_BOOTTIME})


def look(clock: VirtualClock) -> int:
    """Return the time to whoever called a clock function of the standard library."""
    frame = sys._getframe(2)
    while frame.f_back is not None and frame.f_globals.get("__name__") == "time_machine":
        frame = frame.f_back
    if frame.f_back is not None and frame.f_code.co_name == "time" and _package(frame) == "asyncio":
        frame = frame.f_back  # `loop.time()`, which programs call as well
    package = _package(frame)
    return clock.look(paces=LIBRARIES.get(package, True), shown=package not in LIBRARIES)


def _package(frame: FrameType) -> str:
    return str(frame.f_globals.get("__name__")).partition(".")[0]


def install_sleep_and_clocks(scheduler: Scheduler, clock: VirtualClock) -> None:
    """Make `time.sleep` and the monotonic clocks of the standard library virtual."""

    def sleep(*arguments: float | SupportsIndex, **named: Any) -> None:
        if len(arguments) != 1 or named:
            originals.sleep(*arguments, **named)  # raises
        seconds = arguments[0]
        if not isinstance(seconds, float) and hasattr(type(seconds), "__index__"):
            seconds = operator.index(seconds)
        if not isinstance(seconds, (int, float)) or not 0 <= seconds <= LONGEST_SLEEP_S:
            originals.sleep(seconds)  # raises, as this version of Python does
            return
        end_ns = clock.end_of(round(seconds * NS_PER_S))
        if end_ns <= clock.now_ns:
            clock.idle_look(20)
            scheduler.pause(clock.now_ns)
        while clock.now_ns < end_ns:
            scheduler.pause(end_ns)

    def steady(original: Callable[[], float], divisor: float | None) -> Callable[[], float]:
        def now(*arguments: Any, **named: Any) -> float:
            if arguments or named:
                original(*arguments, **named)  # raises
            now_ns = look(clock) - clock.steady_ns
            return now_ns if divisor is None else now_ns / divisor

        return now

    time.sleep = sleep
    for name in ("monotonic", "perf_counter"):
        setattr(time, name, steady(getattr(time, name), NS_PER_S))
        setattr(time, f"{name}_ns", steady(getattr(time, f"{name}_ns"), None))

    def look_unseen() -> float:
        """Replace the clock in libraries, whose looks do not show how the program paces itself."""
        return (clock.look(paces=False, shown=False) - clock.steady_ns) / NS_PER_S

    threading._time = look_unseen  # type: ignore[attr-defined]
    queue.time = look_unseen  # type: ignore[attr-defined]


def install_wall_time(clock: VirtualClock) -> None:
    """Make `time.time`, `datetime.now` and related functions virtual, however they were imported."""
    time_machine = import_without_needless("time_machine")

    traveller = time_machine.travel(clock.now_ns / NS_PER_S, tick=False).start()
    kind = type(traveller)
    traveller.__class__ = type(
        "VirtualTraveller",
        (kind,),
        {"time_ns": lambda self: look(clock), "time": lambda self: look(clock) / NS_PER_S},
    )
    # After time_machine, which expects the original C functions here.

    def read(original: Callable[..., float], steady: Callable[[], float]) -> Callable[..., float]:
        def get(*kind: Any, **named: Any) -> float:
            if len(kind) == 1 and not named and isinstance(kind[0], int) and kind[0] in STEADY:
                return steady()
            return original(*kind, **named)

        return get

    time.clock_gettime_ns = read(time.clock_gettime_ns, time.monotonic_ns)  # type: ignore[assignment]
    time.clock_gettime = read(time.clock_gettime, time.monotonic)


def install_thread_looks(clock: VirtualClock) -> None:
    """Let time pass for programs that only poll whether another thread has done something."""
    fruitless: dict[tuple[Any, str], object] = {
        (threading.Event, "is_set"): False,
        (threading.Thread, "is_alive"): True,
        (concurrent.futures.Future, "done"): False,
        (queue.Queue, "empty"): True,
        (queue.Queue, "full"): True,
        (queue.Queue, "qsize"): 0,
    }
    for (cls, name), nothing in fruitless.items():
        setattr(cls, name, _looking(getattr(cls, name), nothing, clock))
    get = queue.Queue.get

    @functools.wraps(get)
    def looking_get(self: Any, block: bool = True, timeout: float | None = None) -> Any:
        try:
            return get(self, block, timeout)
        except queue.Empty:
            clock.idle_look()
            raise

    queue.Queue.get = looking_get  # type: ignore[method-assign]


def _looking(original: Callable[[Any], Any], nothing: object, clock: VirtualClock) -> Callable[[Any], Any]:
    @functools.wraps(original)
    def looked_at(self: Any) -> Any:
        found = original(self)
        if found == nothing:
            clock.idle_look()
        return found

    return looked_at
