"""Runs the student's threads one at a time and in a fixed order, and detects when all of them are blocked.

Each thread is a green thread. It switches to another one only where the original program would block: in a sleep, a
lock, a wait set or a selector; and at the first text that it writes after another thread has started or woken it. This
makes programs with threads repeatable. When no thread can run, time has to advance: the thread that blocked last asks
the grader.
"""

from collections import deque
from collections.abc import Callable
from typing import Any

from . import originals


class GreenThread:
    """One thread of the student's program, and what it waits for."""

    __slots__ = ("deadline_ns", "gate", "is_new", "native", "parked", "polled_in", "polls")

    def __init__(self) -> None:
        # A real lock that its thread waits for until it is its turn. It begins locked; whoever hands on opens it, and
        # the thread that passes has locked it again.
        self.gate = originals.allocate_lock()
        self.gate.acquire()
        self.parked = False
        self.deadline_ns: int | None = None
        self.polls = False
        self.polled_in = -1
        self.native = 0
        #: Whether another thread has started or woken it, and it has neither blocked nor written anything since.
        self.is_new = False


class Scheduler:
    """Switches between green threads.

    Args:
        now_ns: Returns the virtual time.
        ask_for_time: Called when no thread can run, with the earliest deadline or None; returns when time has advanced
            or something has happened.
    """

    def __init__(self, now_ns: Callable[[], int], ask_for_time: Callable[[int | None], None]) -> None:
        self._now_ns = now_ns
        self._ask_for_time = ask_for_time
        self._green_threads: dict[int, GreenThread] = {}
        self._parked: list[GreenThread] = []
        self._runnable: deque[GreenThread] = deque()
        #: Those that let all others go on first, after they have written something.
        self._last: deque[GreenThread] = deque()
        self._round = 0
        self.current = self._main = self._adopt()
        self._others_ran = False

    def _adopt(self) -> GreenThread:
        """Register the calling thread as a green thread that runs."""
        green_thread = GreenThread()
        green_thread.native = originals.get_native_id()
        self._green_threads[originals.get_ident()] = green_thread
        return green_thread

    def mine(self) -> GreenThread | None:
        """Return the green thread of the calling thread, or None if it is not one of the student's threads."""
        return self._green_threads.get(originals.get_ident())

    def running_thread(self) -> int | None:
        """Return the identifier of the thread that runs."""
        return next(
            (ident for ident, green_thread in self._green_threads.items() if green_thread is self.current), None
        )

    def running_native_thread(self) -> int:
        """Return the native id of the thread that runs."""
        return self.current.native

    def has_others(self) -> bool:
        """Return whether the program has more than one thread."""
        return len(self._green_threads) > 1

    def others_ran(self) -> bool:
        """Return whether another thread than the first has run since the last time that this was asked."""
        others, self._others_ran = self._others_ran, self.current is not self._main
        return others

    def progress(self) -> None:
        """Note that something happened that may have made a wait set ready."""
        self._round += 1

    def pause(self, deadline_ns: int | None = None, *, polls: bool = False) -> None:
        """Block the calling thread until its deadline, until `wake`, or, if it polls, until anything happens.

        Args:
            deadline_ns: Latest virtual time at which to continue.
            polls: Whether to continue after anything happens, to poll again.
        """
        green_thread = self.mine()
        if green_thread is None:  # a C library has started it: it is not scheduled here, and asks again soon
            originals.sleep(0.001)
            return
        green_thread.deadline_ns, green_thread.polls, green_thread.polled_in, green_thread.parked = (
            deadline_ns,
            polls,
            self._round,
            True,
        )
        green_thread.is_new = False
        self._parked.append(green_thread)
        try:
            self._hand_on(green_thread)
        except BaseException:
            if green_thread.parked:  # a signal handler raised while this thread chose the next one: it continues
                self._parked.remove(green_thread)
                green_thread.parked = False
            raise

    def wake(self, green_thread: GreenThread) -> None:
        """Make a parked thread runnable."""
        if green_thread.parked:
            self._parked.remove(green_thread)
            green_thread.parked = False
            green_thread.is_new = not self.current.is_new  # `Thread.start` waits until the new thread wakes it
            self._runnable.append(green_thread)
            self._round += 1

    def wrote(self) -> None:
        """Let the other threads go on until they block, after one that they have started or woken has written a text.

        In CPython a thread holds the interpreter's lock until it blocks, writes or has run for 5 ms. Where the one that
        woke it waits for the lock, it gets it while the text is written, and is mostly far ahead by then.
        """
        green_thread = self.current
        if green_thread.is_new and self.mine() is green_thread:
            green_thread.is_new = False
            if self._runnable:
                self._last.append(green_thread)
                self._hand_on(green_thread)

    def start(self, body: Callable[..., Any], args: tuple[Any, ...], kwargs: dict[str, Any]) -> Callable[[], None]:
        """Register a new green thread at once, and return the function that its OS thread must run."""
        green_thread = GreenThread()
        green_thread.is_new = True
        self._runnable.append(green_thread)
        self._round += 1

        def run() -> None:
            green_thread.gate.acquire()
            self._green_threads[originals.get_ident()] = green_thread
            green_thread.native = originals.get_native_id()
            try:
                body(*args, **kwargs)
            finally:
                self._end(green_thread)

        return run

    def _end(self, green_thread: GreenThread) -> None:
        self._green_threads.pop(originals.get_ident(), None)
        self._round += 1
        following = self._choose()
        self.current = following
        following.gate.release()

    def _hand_on(self, green_thread: GreenThread) -> None:
        following = self._choose()
        if following is green_thread:
            return
        # From the release on, the other thread runs: `current` has to be right before it, and nothing of the program's
        # may be touched between the release and the wait.
        self.current, self._others_ran = following, True
        following.gate.release()
        try:
            green_thread.gate.acquire()
        except BaseException:
            # A signal handler raised in the main thread while it was parked: it has to wait for its turn.
            self.wake(green_thread)
            green_thread.gate.acquire()
            raise

    def _choose(self) -> GreenThread:
        """Choose the thread that runs next; if none can, let time advance until one can."""
        while True:
            if waiting := self._runnable or self._last:
                self._round += 1
                return waiting.popleft()
            green_thread = self._poller()
            if green_thread is None and (green_thread := self._due()) is not None:
                self._round += 1
            if green_thread is not None:
                self._parked.remove(green_thread)
                green_thread.parked = False
                return green_thread
            self._ask_for_time(min((s.deadline_ns for s in self._parked if s.deadline_ns is not None), default=None))
            self._round += 1

    def _poller(self) -> GreenThread | None:
        return next((s for s in self._parked if s.polls and s.polled_in != self._round), None)

    def _due(self) -> GreenThread | None:
        now_ns = self._now_ns()
        due = [s for s in self._parked if s.deadline_ns is not None and s.deadline_ns <= now_ns]
        return min(due, key=lambda s: s.deadline_ns or 0, default=None)
