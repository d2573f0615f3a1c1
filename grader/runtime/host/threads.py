"""Replaces locks, threads and selectors by ones that block in virtual time, before the student's imports.

Everything in `threading`, `queue` and `concurrent.futures` is built on the plain lock, on starting a thread and on
joining it, so replacing these three is enough. A released lock goes to the thread that has waited longest.
"""

import _thread
import concurrent.futures.thread
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
from .replaced import without_own_frames
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


def lock_type(scheduler: Scheduler, clock: VirtualClock) -> type:
    """Create the class that replaces `threading.Lock`."""
    timeouts = Timeouts(clock)

    class VirtualLock:
        """A lock whose waiters are parked green threads."""

        __slots__ = ("__weakref__", "_locked", "_waiters")

        def __init__(self) -> None:
            self._locked = False
            self._waiters: deque[GreenThread] = deque()

        def acquire(self, blocking: bool = True, timeout: float = -1) -> bool:
            if not blocking and timeout != -1:
                raise ValueError("can't specify a timeout for a non-blocking call")
            if timeout < 0 and timeout != -1:
                raise ValueError("timeout value must be a non-negative number")
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

    VirtualLock.__module__, VirtualLock.__name__, VirtualLock.__qualname__ = "_thread", "lock", "lock"
    return VirtualLock


def install_locks(scheduler: Scheduler, clock: VirtualClock) -> None:
    """Make every lock that is created from now on virtual."""
    virtual = lock_type(scheduler, clock)
    threading.Lock = virtual  # type: ignore[assignment]
    threading._allocate_lock = virtual  # type: ignore[attr-defined]
    # The reentrant lock and the queue in C block for real; those in Python are built on the plain lock.
    threading._CRLock = None  # type: ignore[attr-defined]
    threading.RLock = threading._PyRLock  # type: ignore[attr-defined]
    _thread.allocate_lock = virtual
    _thread.RLock = threading._PyRLock  # type: ignore[attr-defined,misc]
    queue.SimpleQueue = queue._PySimpleQueue  # type: ignore[attr-defined,misc]
    # Made when the module was imported, before locks were virtual.
    concurrent.futures.thread._global_shutdown_lock = virtual()


def report_threads(
    describe: Callable[[BaseException], dict[str, Any]], report: Callable[[dict[str, Any]], None]
) -> None:
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
    describe: Callable[[BaseException], dict[str, Any]],
    report: Callable[[dict[str, Any]], None],
) -> None:
    """Make every thread that is started from now on a green thread, and joining one a virtual wait.

    Args:
        scheduler: Runs the threads.
        clock: Provides deadlines.
        describe: As for `VirtualTime.install`.
        report: As for `VirtualTime.install`.
    """

    def start_new_thread(function: Callable[..., Any], args: tuple[Any, ...] = (), kwargs: Any = None) -> int:
        run = scheduler.start(function, tuple(args), kwargs or {})
        return originals.start_new_thread(run, ())

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

    def bootstrap_inner(self: threading.Thread) -> None:
        try:
            run_thread(self)
        finally:
            self._grader_finished = True  # type: ignore[attr-defined]
            for green_thread in getattr(self, "_grader_joiners", ()):
                scheduler.wake(green_thread)

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
        if selector is not None:
            _replace_select(selector, virtual)

    select_now = select.select

    def virtual_select(read: Any, write: Any, error: Any, timeout: float | None = None, /) -> Any:
        descriptors = [d if isinstance(d, int) else d.fileno() for d in (*read, *write, *error)]
        return virtual(lambda: select_now(read, write, error, 0), timeout, lambda ready: not any(ready), descriptors)

    select.select = virtual_select


def _replace_select(selector: Any, virtual: Callable[..., Any]) -> None:
    select_now = selector.select

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
