"""Makes every clock of rclpy, and what waits on one, follow the virtual time."""

from __future__ import annotations

import contextlib
import functools
import sys
import weakref
from collections.abc import Callable, Iterator
from typing import Any

import rclpy.clock
import rclpy.executors
import rclpy.impl.rcutils_logger
import rclpy.utilities
from rclpy.clock import Clock, ClockChange, ClockType, JumpHandle, JumpThreshold, ROSClock, TimeJump
from rclpy.duration import Duration
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.time import Time

from .clock import VirtualClock
from .scheduler import Scheduler


class RosClocks:
    """Makes every clock of rclpy, whatever its type, a ROS clock whose time the grader sets.

    Clocks of nodes with `use_sim_time` are left to rclpy, which sets them by the messages on /clock.
    """

    def __init__(self, clock: VirtualClock) -> None:
        self._clock = clock
        self._made: weakref.WeakSet[Clock] = weakref.WeakSet()
        self._simulated: weakref.WeakSet[Clock] = weakref.WeakSet()
        self._told: weakref.WeakKeyDictionary[Clock, Time] = weakref.WeakKeyDictionary()
        #: The clock that a message on /clock, or the program, sets right now: it may jump.
        self._jumping: Clock | None = None
        self._on_change: weakref.WeakKeyDictionary[Clock, weakref.WeakSet[JumpHandle]] = weakref.WeakKeyDictionary()

    def new(self, cls: type[Clock] = Clock, *, clock_type: ClockType = ClockType.SYSTEM_TIME) -> Clock:
        """Replace `Clock.__new__`."""
        if not isinstance(clock_type, (ClockType, _rclpy.ClockType)):
            raise TypeError("Clock type must be a ClockType enum")
        if clock_type is ClockType.ROS_TIME and not issubclass(cls, ROSClock):
            cls = ROSClock
        made = object.__new__(cls)
        # Of the clocks of rcl, only one of ROS time can be set. Timers in C read it themselves, so that replacing `now`
        # would not be enough. A program that asks for the type is told the one that it wanted.
        made._Clock__clock = _rclpy.Clock(ClockType.ROS_TIME)
        made._clock_type = clock_type
        with made.handle:
            made.handle.set_ros_time_override_is_enabled(True)
            made.handle.set_ros_time_override(self._time()._time_handle)
        self._made.add(made)
        return made

    def move(self) -> None:
        """Set every clock to the virtual time, so that timers that are due become ready."""
        time = _RclTime(self._clock.now_ns, ClockType.ROS_TIME)
        for made in list(self._made):
            handle = made.handle
            try:
                with handle:
                    handle.set_ros_time_override(time)
            except _rclpy.InvalidHandle:  # destroyed by the program, and not freed yet
                continue

    def follows(self, clock: Clock) -> bool:
        """Return whether a clock follows the virtual time."""
        return clock in self._made

    def simulates(self, clock: Clock) -> bool:
        """Return whether messages on /clock set a clock."""
        return clock in self._simulated

    def simulate(self, clock: ROSClock, active: bool) -> None:
        """Replace `ROSClock._set_ros_time_is_active`; a clock that no message has set yet is at 0."""
        if active and clock in self._made:
            with self._changing(clock, ClockChange.ROS_TIME_ACTIVATED):
                self._made.discard(clock)
                self._simulated.add(clock)
                _set(clock, self._told.get(clock) or Time(clock_type=ClockType.ROS_TIME))
        elif not active and clock in self._simulated:
            with self._changing(clock, ClockChange.ROS_TIME_DEACTIVATED):
                self._simulated.discard(clock)
                self._made.add(clock)
                _set(clock, self._time())

    def tell(self, clock: ROSClock, time: Time) -> None:
        """Replace `ROSClock.set_ros_time_override`, which counts only while the clock is simulated."""
        self._told[clock] = time
        if clock in self._simulated:
            self._jumping = clock
            try:
                _set(clock, time)
            finally:
                self._jumping = None

    def watch_jumps(
        self, clock: Clock, threshold: JumpThreshold, *, pre_callback: Any = None, post_callback: Any = None
    ) -> JumpHandle:
        """Replace `Clock.create_jump_callback`: advancing virtual time is not a jump."""

        # rcl calls back whenever a clock that is set goes further than the threshold, and here each is set at each
        # instant. For whoever watches, only what /clock or the program sets is a jump.
        def told(callback: Any) -> Any:
            def call(*jump: Any) -> None:
                if self._jumping is clock:
                    callback(*jump)

            return call if callable(callback) else callback

        handle = _WATCH_JUMPS(clock, threshold, pre_callback=told(pre_callback), post_callback=told(post_callback))
        if threshold.on_clock_change:
            handle.grader_callbacks = (pre_callback, post_callback)
            self._on_change.setdefault(clock, weakref.WeakSet()).add(handle)
        return handle

    @contextlib.contextmanager
    def _changing(self, clock: Clock, change: ClockChange) -> Iterator[None]:
        """Tell those who watch a clock that /clock begins or ends to set it."""
        callbacks = [h.grader_callbacks for h in self._on_change.get(clock, ()) if h._clock is not None]
        for before, _ in callbacks:
            if before is not None:
                before()
        yield
        for _, after in callbacks:
            if after is not None:
                after(TimeJump(change, Duration()))

    def _time(self) -> Time:
        return Time(nanoseconds=self._clock.now_ns, clock_type=ClockType.ROS_TIME)


_WATCH_JUMPS = Clock.create_jump_callback
_RclTime = type(Time()._time_handle)
_SYSTEM_CLOCK = _rclpy.Clock(_rclpy.ClockType.SYSTEM_TIME)


def system_ns() -> int:
    """Return the real system clock, which stamps messages, in nanoseconds since 1970."""
    return int(_SYSTEM_CLOCK.get_now().nanoseconds)


def _of_clock(clock: ROSClock, method: Callable[[ROSClock, Any], None], value: Any) -> None:
    method(clock, value)


def _watch_jumps(clock: Clock, clocks: RosClocks, threshold: JumpThreshold, **callbacks: Any) -> JumpHandle:
    return clocks.watch_jumps(clock, threshold, **callbacks)


def _set(clock: Clock, time: Time) -> None:
    with contextlib.suppress(_rclpy.InvalidHandle), clock.handle:
        clock.handle.set_ros_time_override(time._time_handle)


def install_clocks(clocks: RosClocks, scheduler: Scheduler, clock: VirtualClock) -> None:
    """Replace rclpy's clocks and the functions that sleep on them."""
    Clock.__new__ = staticmethod(clocks.new)
    ROSClock.__new__ = staticmethod(lambda cls: clocks.new(cls, clock_type=ClockType.ROS_TIME))
    ROSClock._set_ros_time_is_active = functools.partialmethod(_of_clock, clocks.simulate)
    ROSClock.set_ros_time_override = functools.partialmethod(_of_clock, clocks.tell)
    ROSClock.ros_time_is_active = property(clocks.simulates)
    Clock.create_jump_callback = functools.partialmethod(_watch_jumps, clocks)
    rclpy.impl.rcutils_logger.Throttle.params["throttle_time_source_type"] = Clock()

    timer = rclpy.executors.Timer

    def timeout(callback: Any, group: Any, period_ns: int, of: Clock, **rest: Any) -> Any:
        """Replace the timer that ends an executor's wait; the node's own timers are not changed."""
        # A time-out is a pause, and counts from the time that the program was shown last. A timer of rcl counts from
        # the instant, and would end the wait before the deadline that the program has in mind.
        return timer(callback, group, clock.end_of(period_ns) - clock.now_ns, of, **rest)

    rclpy.executors.Timer = timeout
    _count_periods(clock, timer)
    _know_timers(clock, timer)
    now = Clock.now

    def looked_at(self: Clock) -> Time:
        module = str(sys._getframe(1).f_globals.get("__name__"))
        # rclpy stamps its own messages. What a sleep of it is counted from, a program that looks may compare with.
        own = module.startswith("rclpy.")
        shown_ns = clock.look(paces=not own, shown=not own or (module == "rclpy.clock" and clock.was_looked_at))
        if not clocks.follows(self):
            return now(self)
        with self.handle:  # raises if it was destroyed
            return Time(nanoseconds=shown_ns, clock_type=self.clock_type)

    def sleep_until(self: Clock, until: Time, context: Any = None) -> bool:
        context = context or rclpy.utilities.get_default_context()
        if not context.ok():
            raise rclpy.exceptions.NotInitializedException
        if until.clock_type != self._clock_type:
            raise ValueError("until's clock type does not match this clock's type")
        if clocks.simulates(self):
            while clocks.simulates(self) and now(self) < until and context.ok():
                scheduler.pause(polls=True)
        else:
            clock.begin_pause()
            while clock.now_ns < until.nanoseconds and context.ok():
                scheduler.pause(until.nanoseconds)
        return bool(context.ok())

    Clock.now = looked_at
    Clock.sleep_until = sleep_until


def _count_periods(clock: VirtualClock, timer: Any) -> None:
    """Count the start of each pause, and of the period of each timer that is created or reset."""

    def counting(method: Callable[..., Any]) -> Callable[..., Any]:
        @functools.wraps(method)
        def counted(*args: Any, **kwargs: Any) -> Any:
            clock.count_pause()
            return method(*args, **kwargs)

        return counted

    for owner, name in ((timer, "__init__"), (timer, "reset"), (Clock, "sleep_for")):
        setattr(owner, name, counting(getattr(owner, name)))


def _know_timers(clock: VirtualClock, timer: Any) -> None:
    """Let the clock know when each timer is due."""
    make, made = timer.__init__, weakref.WeakSet[Any]()

    @functools.wraps(make)
    def known(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        made.add(self)

    def due_in() -> list[int]:
        found = []
        for one in list(made):
            with contextlib.suppress(_rclpy.InvalidHandle):
                found.append(one.time_until_next_call())
        return [wait for wait in found if wait is not None]

    timer.__init__ = known
    clock.timers_due_in_ns = due_in
