"""Replaces locks, threads and selectors by ones that block in virtual time, before the student's imports.

Everything in `threading`, `queue` and `concurrent.futures` is built on the plain lock, on starting a thread and on
joining it, so replacing these three is enough. A released lock goes to the thread that has waited longest.
"""

import _queue
import _thread
import concurrent.futures.thread
import functools
import operator
import queue
import select
import selectors
import threading
from collections import deque
from collections.abc import Callable
from typing import Any

from . import originals
from .clock import VirtualClock
from .outside import any_outside
from .protocol import FaultReport
from .replaced import as_builtin, without_own_frames
from .scheduler import GreenThread, Scheduler

NS_PER_S = 1_000_000_000


class Timeouts:
    """Converts the timeouts of Python's functions, in seconds or None, to virtual deadlines."""

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock

    def deadline_ns(self, seconds: float | None) -> int | None:
        """Return the deadline of a timeout; None, if the timeout is None or negative, means to wait forever."""
        # The work before it first: a time-out is counted from the moment at which the program asks for it.
        self._clock.charge()
        if seconds is None or seconds < 0:
            return None
        return self._clock.end_of(round(seconds * NS_PER_S))

    def over(self, deadline_ns: int | None) -> bool:
        """Return whether a deadline has passed."""
        return deadline_ns is not None and self._clock.now_ns >= deadline_ns


def lock_type(scheduler: Scheduler, clock: VirtualClock) -> Any:
    """Create the class that replaces `threading.Lock`."""
    timeouts = Timeouts(clock)

    class VirtualLock:
        """A lock whose waiters are parked green threads.

        No real lock guards its own fields: one green thread runs at a time, and another one only takes its turn where
        this one calls the scheduler.
        """

        __slots__ = ("__weakref__", "_locked", "_waiters")

        def __init__(self, *arguments: Any, **named: Any) -> None:
            if arguments or named:
                originals.allocate_lock(*arguments, **named)  # raises
            self._locked = False
            self._waiters: deque[GreenThread] = deque()

        def acquire(self, *arguments: Any, **named: Any) -> bool:
            blocking, timeout = True, -1
            if arguments or named:
                originals.allocate_lock().acquire(*arguments, **named)  # raises for what it does not take
                blocking = arguments[0] if arguments else named.get("blocking", True)
                timeout = arguments[1] if len(arguments) > 1 else named.get("timeout", -1)
            if not self._locked:
                self._locked = True
                return True
            if not blocking:
                clock.idle_look()
                return False
            deadline_ns = timeouts.deadline_ns(timeout)
            if not self._locked:  # it was released in the time that was charged
                self._locked = True
                return True
            return self._wait(deadline_ns)

        def _wait(self, deadline_ns: int | None) -> bool:
            green_thread = scheduler.mine()
            if green_thread is None:
                return self._wait_from_outside()
            self._waiters.append(green_thread)
            try:
                # Whoever releases the lock takes this thread out of the waiters, and hands the lock over without
                # unlocking it.
                while green_thread in self._waiters and not timeouts.over(deadline_ns):
                    scheduler.pause(deadline_ns)
            except BaseException:
                self._leave(green_thread)
                raise
            if green_thread in self._waiters:
                self._waiters.remove(green_thread)
                return False
            return True

        def _leave(self, green_thread: GreenThread) -> None:
            """Stop waiting; if the lock was handed over at the same moment, pass it on."""
            if green_thread in self._waiters:
                self._waiters.remove(green_thread)
            else:
                self.release()

        # A thread that a C library has started is not scheduled here, and waits in real time.
        def _wait_from_outside(self) -> bool:
            while self._locked:
                originals.sleep(0.001)
            self._locked = True
            return True

        def release(self) -> None:
            if not self._locked:
                raise RuntimeError("release unlocked lock")
            # Handed over, not unlocked: otherwise a thread that comes by could take it before those that wait.
            if self._waiters:
                scheduler.wake(self._waiters.popleft())
            else:
                self._locked = False

        def locked(self) -> bool:
            clock.idle_look()
            return self._locked

        def _is_owned(self) -> bool:
            """Tell a Condition whether the lock is held; its default, trying to acquire, would count as a look."""
            return self._locked

        def __init_subclass__(cls) -> None:
            raise TypeError("type '_thread.lock' is not an acceptable base type")

        def __reduce_ex__(self, protocol: Any) -> Any:
            raise TypeError("cannot pickle '_thread.lock' object")

        def __repr__(self) -> str:
            return f"<{'locked' if self._locked else 'unlocked'} _thread.lock object at {id(self):#x}>"

        def _at_fork_reinit(self) -> None:
            self._locked = False
            self._waiters.clear()

        def __enter__(self) -> bool:
            return self.acquire()

        def __exit__(self, *_: object) -> None:
            self.release()

        acquire_lock, release_lock, locked_lock = acquire, release, locked

    VirtualLock.__doc__ = type(originals.allocate_lock()).__doc__
    VirtualLock.__module__, VirtualLock.__name__, VirtualLock.__qualname__ = "_thread", "lock", "lock"
    return VirtualLock


def reentrant_lock_type() -> Any:
    """Create the class that replaces the reentrant lock in C: the one in Python, which shows itself as that does."""
    in_python: Any = threading._PyRLock  # type: ignore[attr-defined]

    class RLock(in_python):  # type: ignore[misc]
        def __init__(self, *_: object, **__: object) -> None:
            super().__init__()

        def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
            return bool(super().acquire(blocking, timeout))

        __enter__ = acquire

        def __repr__(self) -> str:
            state, owner = "locked" if self._block._is_owned() else "unlocked", self._owner or 0
            return f"<{state} {_name_of(type(self))} object owner={owner} count={self._count} at {id(self):#x}>"

        def __reduce_ex__(self, protocol: Any) -> Any:
            raise TypeError(f"cannot pickle '{_name_of(type(self))}' object")

    RLock.__doc__ = _thread.RLock.__doc__
    RLock.__module__, RLock.__qualname__ = "_thread", "RLock"
    return RLock


def simple_queue_type() -> Any:
    """Create the class that replaces the simple queue in C: the one in Python, which shows itself as that does."""

    class SimpleQueue(queue._PySimpleQueue):  # type: ignore[name-defined,misc]
        def __reduce_ex__(self, protocol: Any) -> Any:
            raise TypeError(f"cannot pickle '{_name_of(type(self))}' object")

    SimpleQueue.__doc__ = queue.SimpleQueue.__doc__
    SimpleQueue.__module__, SimpleQueue.__qualname__ = "_queue", "SimpleQueue"
    return SimpleQueue


def _name_of(cls: type) -> str:
    return f"{cls.__module__}.{cls.__qualname__}"


def install_locks(scheduler: Scheduler, clock: VirtualClock) -> None:
    """Make every lock that is created from now on virtual."""
    virtual = lock_type(scheduler, clock)
    _thread.LockType = virtual  # type: ignore[misc]
    if hasattr(_thread, "lock"):  # Python 3.13 and later
        _thread.lock = virtual
    # A function in C before Python 3.13.
    made = as_builtin(virtual, originals.allocate_lock)
    threading.Lock = made if threading.Lock is originals.allocate_lock else virtual
    _thread.allocate = as_builtin(virtual, _thread.allocate)
    _thread.allocate_lock = threading._allocate_lock = made  # type: ignore[attr-defined]
    # The reentrant lock and the queue in C block for real; those in Python are built on the plain lock.
    reentrant = reentrant_lock_type()
    threading._CRLock = _thread.RLock = reentrant  # type: ignore[attr-defined,misc]
    queue.SimpleQueue = _queue.SimpleQueue = simple_queue_type()  # type: ignore[misc]
    # Made when the module was imported, before locks were virtual.
    concurrent.futures.thread._global_shutdown_lock = virtual()


def report_threads(describe: Callable[[BaseException], FaultReport], report: Callable[[FaultReport], None]) -> None:
    """Describe each exception that ends a thread, and report it once Python has printed it.

    The grader reads what was written whenever it hears of something: the other way round, chance would decide how much
    of the text is recorded before the fault.
    """

    def excepthook(args: Any) -> None:
        kind, error, _, thread = args
        if error is None or issubclass(kind, SystemExit):
            threading.__excepthook__(args)
            return
        fault = describe(error)  # while its traceback tells whether it is the grader's
        try:
            shown = without_own_frames(error)
            threading.__excepthook__(threading.ExceptHookArgs((kind, shown, shown.__traceback__, thread)))
        finally:
            report(fault)

    threading.excepthook = excepthook


def install_threads(
    scheduler: Scheduler,
    clock: VirtualClock,
    describe: Callable[[BaseException], FaultReport],
    report: Callable[[FaultReport], None],
) -> None:
    """Make every thread that is started from now on a green thread, and joining one a virtual wait.

    Args:
        scheduler: Runs the threads.
        clock: Provides deadlines.
        describe: As for `VirtualTime.install`.
        report: As for `VirtualTime.install`.
    """

    def start_new_thread(*arguments: Any) -> int:
        function, args, named = (*arguments, {})[:3] if len(arguments) > 1 else (None, (), {})
        if len(arguments) > 3 or not (callable(function) and isinstance(args, tuple) and isinstance(named, dict)):
            return originals.start_new_thread(*arguments)  # raises
        return originals.start_new_thread(scheduler.start(function, args, named), ())

    _thread.start_new_thread = start_new_thread
    _thread.start_new = start_new_thread
    # `threading` has looked the function up when it was imported.
    if hasattr(threading, "_start_new_thread"):
        threading._start_new_thread = start_new_thread
    else:  # Python 3.13 and later have joinable threads
        joinable = threading._start_joinable_thread  # type: ignore[attr-defined]

        def start_joinable_thread(function: Callable[[], Any], handle: Any = None, daemon: bool = True) -> Any:
            return joinable(scheduler.start(function, (), {}), handle=handle, daemon=daemon)

        threading._start_joinable_thread = start_joinable_thread  # type: ignore[attr-defined]

    run_thread = threading.Thread._bootstrap_inner  # type: ignore[attr-defined]
    join_thread = threading.Thread.join
    timeouts = Timeouts(clock)

    @functools.wraps(run_thread)
    def bootstrap_inner(self: threading.Thread) -> None:
        try:
            run_thread(self)
        finally:
            self._grader_finished = True  # type: ignore[attr-defined]
            for green_thread in getattr(self, "_grader_joiners", ()):
                scheduler.wake(green_thread)

    @functools.wraps(join_thread)
    def join(self: threading.Thread, timeout: float | None = None) -> None:
        if self is threading.current_thread() or not self._started.is_set():  # type: ignore[attr-defined]
            join_thread(self, timeout)  # raises as the original does
        green_thread = scheduler.mine()
        deadline_ns = timeouts.deadline_ns(None if timeout is None else max(timeout, 0))
        while green_thread is not None and not getattr(self, "_grader_finished", False):
            if timeouts.over(deadline_ns):
                return
            # In the thread itself, so that the list ends with it.
            joiners: list[GreenThread] = self.__dict__.setdefault("_grader_joiners", [])
            joiners.append(green_thread)
            try:
                scheduler.pause(deadline_ns)
            finally:
                joiners.remove(green_thread)
        join_thread(self)

    alive = threading.Thread.is_alive

    @functools.wraps(alive)
    def is_alive(self: threading.Thread) -> bool:
        # Its last Python code has run. Python calls it alive until the operating system has ended it too, in real time.
        if getattr(self, "_grader_finished", False):
            join_thread(self)
        return alive(self)

    threading.Thread._bootstrap_inner = bootstrap_inner  # type: ignore[attr-defined]
    threading.Thread.join = join  # type: ignore[method-assign]
    threading.Thread.is_alive = is_alive  # type: ignore[method-assign]

    report_threads(describe, report)


def install_selectors(scheduler: Scheduler, clock: VirtualClock, give_up: Callable[[], None]) -> None:
    """Make selectors poll file descriptors and block in virtual time.

    Args:
        scheduler: Blocks the calling thread.
        clock: Provides deadlines.
        give_up: Called if only another process can make a descriptor ready.
    """
    timeouts = Timeouts(clock)

    def virtual(
        poll: Callable[[], Any], timeout: float | None, empty: Callable[[Any], bool], descriptors: list[int]
    ) -> Any:
        deadline_ns = timeouts.deadline_ns(timeout)
        while True:
            ready = poll()
            if not empty(ready):
                # A descriptor that became ready may be what other selectors wait for too.
                scheduler.progress()
                clock.busy()
                return ready
            if timeouts.over(deadline_ns):
                clock.idle_look()
                return ready
            # Only now, when nothing is ready: a program may open what it never waits for.
            if any_outside(descriptors):
                give_up()
            scheduler.pause(deadline_ns, polls=True)

    for kind in ("SelectSelector", "PollSelector", "EpollSelector"):
        selector = getattr(selectors, kind, None)
        owner = next((cls for cls in getattr(selector, "__mro__", ()) if "select" in vars(cls)), None)
        if owner is not None:
            _replace_select(owner, virtual)

    select_now: Any = select.select

    def virtual_select(*arguments: Any, **named: Any) -> Any:
        lists: tuple[Any, ...] = arguments[:3]
        timeout: Any = arguments[3] if len(arguments) == 4 else None
        if hasattr(type(timeout), "__index__"):
            timeout = operator.index(timeout)
        refused = timeout is not None and not (isinstance(timeout, (int, float)) and timeout >= 0)
        if named or len(lists) < 3 or len(arguments) > 4 or refused:
            return select_now(*arguments, **named)  # raises
        try:
            descriptors = [d if isinstance(d, int) else d.fileno() for listed in lists for d in listed]
        except Exception:
            return select_now(*lists, 0)  # raises, or is asked what it makes of it
        return virtual(lambda: select_now(*lists, 0), timeout, lambda ready: not any(ready), descriptors)

    select.select = virtual_select


def _replace_select(selector: Any, virtual: Callable[..., Any]) -> None:
    select_now = selector.select

    @functools.wraps(select_now)
    def virtual_select(self: Any, timeout: float | None = None) -> Any:
        if timeout is not None and timeout < 0:
            timeout = 0
        return virtual(
            lambda: select_now(self, 0),
            timeout,
            lambda ready: not ready,
            [key.fd for key in (self.get_map() or {}).values()],
        )

    selector.select = virtual_select
