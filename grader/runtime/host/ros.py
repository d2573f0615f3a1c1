"""Makes rclpy use virtual time: its clocks, its wait sets, and the messages it publishes and takes.

Every spin variant of rclpy blocks in one place, `WaitSet.wait`. The replacement polls, and if nothing is ready, the
green thread pauses.
"""

from __future__ import annotations

import contextlib
import functools
import inspect
import itertools
import os
import signal
import sys
import weakref
from collections import Counter
from collections.abc import Callable, Iterator
from types import CodeType, FrameType, SimpleNamespace
from typing import Any

import rclpy.client
import rclpy.clock
import rclpy.context
import rclpy.executors
import rclpy.impl.rcutils_logger
import rclpy.node
import rclpy.publisher
import rclpy.service
import rclpy.subscription
import rclpy.task
import rclpy.time_source
import rclpy.utilities
from rclpy.clock import Clock, ClockChange, ClockType, JumpHandle, JumpThreshold, ROSClock, TimeJump
from rclpy.duration import Duration
from rclpy.event_handler import QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import LivelinessPolicy
from rclpy.time import Time

from .actions import Counted, install_actions
from .clock import VirtualClock
from .events import ALIVE
from .ledger import BACKGROUND, ENDS_OF_TOPICS, REAL_WAIT_SET, Ledger, asks_for_best, finite_ns, service_name
from .node_parts import context_of, full_name_of
from .order import ReadyOrder
from .protocol import Note
from .scheduler import Scheduler

#: The kinds of entities in a wait set, in the order of the counts that it is made with.
GUARD = "guard_condition"
KINDS = ("subscription", GUARD, "timer", "client", "service")
#: The most places in the code that are remembered for their log records.
CALLERS = 2000
#: The signals at which rclpy shuts down its contexts, with the options that enable this.
SHUTTING_DOWN = {
    signal.SIGINT: (_rclpy.SignalHandlerOptions.ALL, _rclpy.SignalHandlerOptions.SIGINT),
    signal.SIGTERM: (_rclpy.SignalHandlerOptions.ALL, _rclpy.SignalHandlerOptions.SIGTERM),
}
#: Kind of endpoint -> the events that the middleware times on the real clock; the numbers of the two kinds overlap.
TIMED_EVENTS = {
    "publisher": (
        QoSPublisherEventType.RCL_PUBLISHER_LIVELINESS_LOST,
        QoSPublisherEventType.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
    ),
    "subscription": (QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,),
}
#: The event of a subscription that the middleware times if its publishers have to show by themselves that they live.
LEASED_EVENT = QoSSubscriptionEventType.RCL_SUBSCRIPTION_LIVELINESS_CHANGED
#: The methods with which nodes query the whole graph.
GRAPH_LOOKS = (
    *("count_clients", "count_publishers", "count_services", "count_subscribers"),
    *("get_node_names", "get_node_names_and_namespaces", "get_node_names_and_namespaces_with_enclaves"),
    *("get_fully_qualified_node_names", "get_topic_names_and_types", "get_service_names_and_types"),
    *("get_publisher_names_and_types_by_node", "get_subscriber_names_and_types_by_node"),
    *("get_service_names_and_types_by_node", "get_client_names_and_types_by_node"),
    *("get_publishers_info_by_topic", "get_subscriptions_info_by_topic"),
)
#: Those behind the functions of rclpy.action that list the actions of the graph.
ACTION_LOOKS = (
    *("get_action_names_and_types", "get_action_client_names_and_types_by_node"),
    "get_action_server_names_and_types_by_node",
)


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
            except _rclpy.InvalidHandle:
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


#: The methods by which servers and clients of actions tell what a wait set found ready.
ACTION_READY = {cls: cls.is_ready for cls in (_rclpy.ActionServer, _rclpy.ActionClient)}
_WATCH_JUMPS = Clock.create_jump_callback
#: Checks whether a task has ended, without counting as a look, which would let time pass.
_DONE = rclpy.task.Future.done
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


class WakeUps:
    """Tells which executors were woken since they last looked for work.

    An executor wakes itself after each callback. The wait after that returns at once, and the executor builds the same
    wait set again, although it has already seen everything that it was woken for.
    """

    def __init__(self) -> None:
        self._executors: weakref.WeakSet[Any] = weakref.WeakSet()
        self._woken: weakref.WeakSet[Any] = weakref.WeakSet()

    def install(self) -> None:
        """Notice when guard conditions are triggered, and when an executor begins to look for work."""
        trigger, look = GuardCondition.trigger, rclpy.executors.Executor._wait_for_ready_callbacks

        @functools.wraps(trigger)
        def triggered(guard: Any) -> None:
            self._woken.add(guard.handle)
            trigger(guard)

        @functools.wraps(look)
        def looking(executor: Any, *args: Any, **kwargs: Any) -> Any:
            self._executors.add(executor._guard.handle)
            # A coroutine may wait for one that is resumed after it, and then needs the wait that returns at once.
            if all(_DONE(task) for task, *_ in executor._tasks):
                self._woken.discard(executor._guard.handle)
            return look(executor, *args, **kwargs)

        GuardCondition.trigger = triggered
        rclpy.executors.Executor._wait_for_ready_callbacks = looking

    def news(self, ready: list[int], guards: list[Any]) -> list[int]:
        """Return which guard conditions are ready, by the addresses of their handles, for something not seen yet."""
        seen = {g.pointer for g in guards if g in self._executors and g not in self._woken}
        return [pointer for pointer in ready if pointer not in seen]


def wait_set_type(  # noqa: PLR0913 - all that a wait depends on
    scheduler: Scheduler,
    clock: VirtualClock,
    ledger: Ledger,
    wake_ups: WakeUps,
    order: ReadyOrder,
    settle: Callable[[], None],
) -> type:
    """Create the class that replaces rclpy's wait set."""

    class VirtualWaitSet(REAL_WAIT_SET):  # type: ignore[misc]
        """A wait set that blocks in virtual time."""

        def __init__(self, *counts: Any) -> None:
            super().__init__(*counts)
            self._kinds = [kind for kind, count in zip(KINDS, counts, strict=False) if count and kind != GUARD]
            self._events = counts[5]
            self._capacity = sum(counts[:6])
            self._added: list[tuple[Callable[..., Any], Any]] = []
            self._timers: list[Any] = []
            self._guards: list[Any] = []
            self._receivers: list[int] = []
            self._event_handles: list[Any] = []
            self._included = ledger.included
            #: Servers and clients of actions, with what their `is_ready` returned after the last poll.
            self._actions: dict[Any, Any] = {}
            #: The subscriptions that had messages taken ahead of time at the last poll.
            self._kept: list[int] = []
            #: What is ready, but not found by this look.
            self._hidden: set[int] = set()

        def clear_entities(self) -> None:
            super().clear_entities()
            self._added.clear()
            self._timers.clear()
            self._guards.clear()
            self._receivers.clear()
            self._event_handles.clear()
            self._actions.clear()

        def _add(self, add: Callable[..., Any], entity: Any) -> Any:
            self._added.append((add, entity))
            return add(self, entity)

        def add_subscription(self, entity: Any) -> Any:
            self._receivers.append(entity.pointer)
            return self._add(REAL_WAIT_SET.add_subscription, entity)

        def add_client(self, entity: Any) -> Any:
            self._receivers.append(entity.pointer)
            return self._add(REAL_WAIT_SET.add_client, entity)

        def add_service(self, entity: Any) -> Any:
            self._receivers.append(entity.pointer)
            return self._add(REAL_WAIT_SET.add_service, entity)

        def add_timer(self, entity: Any) -> Any:
            self._timers.append(entity)
            return self._add(REAL_WAIT_SET.add_timer, entity)

        def add_guard_condition(self, entity: Any) -> Any:
            self._guards.append(entity)
            return self._add(REAL_WAIT_SET.add_guard_condition, entity)

        def add_event(self, entity: Any) -> Any:
            self._event_handles.append(entity)
            return self._add(REAL_WAIT_SET.add_event, entity)

        def add_action(self, add: Callable[[Any, Any], Any], handle: Any) -> None:
            """Add what a server or client of an action waits for; `add` is its own method for that."""
            self._actions[handle] = None
            self._added.append((lambda wait_set, end: add(end, wait_set), handle))
            add(handle, self)

        def ready_of_action(self, handle: Any) -> Any:
            """Return what a server or client of an action found ready at the last poll; None if it is not in the set.

            It notes its places in the latest set that it was added to, of which the ledger makes some of its own.
            """
            found = self._actions.get(handle)
            return found if found is None or id(handle) not in self._hidden else tuple(False for _ in found)

        def _poll(self) -> None:
            """Look, without waiting, what is ready; all else is removed."""
            super().wait(0)
            self._kept = self._find_kept()
            for handle in self._actions:
                self._actions[handle] = ACTION_READY[type(handle)](handle, self)

        def _fill(self) -> None:
            """Add all entities again."""
            super().clear_entities()
            for add, entity in self._added:
                add(self, entity)

        def _is_whole(self) -> bool:
            """Return whether all entities are known; those of other waitables are not."""
            parts = sum(sum(handle.get_num_entities()) - 1 for handle in self._actions)
            return bool(len(self._added) + parts == self._capacity)

        def is_ready(self, kind: str, index: int) -> Any:
            handle = self._event_handles[index] if kind == "event" and index < len(self._event_handles) else None
            kept = handle is not None and ledger.events.keeps(handle)
            return ledger.events.is_ready(handle) if kept else super().is_ready(kind, index)

        def get_ready_entities(self, kind: str) -> Any:
            ready = super().get_ready_entities(kind)
            ready = [*ready, *(p for p in self._kept if p not in ready)] if kind == "subscription" else ready
            return [p for p in ready if p not in self._hidden] if self._hidden else ready

        def _awaited(self) -> list[int]:
            """Return what an executor waits for whose order may be drawn: the addresses of handles, `id` of actions."""
            return [*(timer.pointer for timer in self._timers if timer), *self._receivers, *map(id, self._actions)]

        def _hide(self) -> None:
            """Draw what this look finds of all that is ready."""
            self._hidden = set()
            kinds = ("timer", "subscription", "client", "service")
            ready = {*(p for kind in kinds for p in self.get_ready_entities(kind))}
            ready |= {id(handle) for handle, found in self._actions.items() if any(found)}
            awaited = self._awaited()
            self._hidden = order.hidden([one for one in awaited if one in ready])
            order.wait_for(one for one in awaited if one not in ready)

        def _find_kept(self) -> list[int]:
            """Return the subscriptions in this set that have messages taken ahead of time."""
            if not ledger.keeps_anything():
                return []
            known = ledger.handles()
            return [p for p in self._receivers if p in known and ledger.kept(known[p])]

        def _ready(self, *, guards: list[int]) -> bool:
            """Return whether anything is ready; of guard conditions, whether any of these is."""
            ready = REAL_WAIT_SET.get_ready_entities
            return (
                bool(guards)
                or any(ready(self, kind) for kind in self._kinds)
                or bool(self._kept)
                or any(self.is_ready("event", number) for number in range(self._events))
            )

        def _expects(self) -> bool:
            if not ledger.expects_anything():
                return False
            known = ledger.handles()
            receivers = [known[p] for p in self._receivers if p in known]
            acting = [end for end in ledger.actions() if end.handle in self._actions]
            return ledger.await_arrivals([*receivers, *(r for end in acting for r in end.receivers.values())])

        def _next_timer_ns(self) -> int | None:
            waits = [timer.time_until_next_call() for timer in self._timers if timer]
            return min((clock.now_ns + max(0, wait) for wait in waits if wait is not None), default=None)

        def wait(self, timeout_ns: int) -> None:
            clock.charge()
            deadline_ns = None if timeout_ns < 0 else clock.end_of(timeout_ns)
            if order.is_drawn:
                self._hidden = set()
                if ledger.sent:
                    settle()  # others may react before the next callback runs, and what is sent to oneself arrives
                self._expects()
            if self._actions:
                self._fill()  # the ledger may have looked for messages since they were added
            while True:
                self._poll()
                guards = REAL_WAIT_SET.get_ready_entities(self, GUARD)
                news = wake_ups.news(guards, self._guards) if guards and timeout_ns else guards
                if self._ready(guards=news):
                    if order.is_drawn:
                        self._hide()
                    scheduler.progress()
                    return
                if guards:
                    scheduler.progress()
                if not self._expects():
                    if deadline_ns is not None and clock.now_ns >= deadline_ns:
                        clock.idle_look(50)
                        return
                    wakes = [t for t in (deadline_ns, self._next_timer_ns()) if t is not None]
                    ledger.awaited.update(self._receivers)
                    try:
                        scheduler.pause(min(wakes, default=None), polls=True)
                    finally:
                        ledger.awaited.subtract(self._receivers)
                    if order.is_drawn:
                        order.wait_for(self._awaited())
                if not self._is_whole() or self._included != ledger.included:
                    return  # other waitables add their entities without these methods: let the executor rebuild the set
                self._fill()

    return VirtualWaitSet


def install_wait_sets(
    scheduler: Scheduler, clock: VirtualClock, ledger: Ledger, order: ReadyOrder, settle: Callable[[], None]
) -> None:
    """Replace rclpy's wait set."""
    wake_ups = WakeUps()
    wake_ups.install()
    _rclpy.WaitSet = wait_set_type(scheduler, clock, ledger, wake_ups, order, settle)
    for cls in ACTION_READY:
        _install_action_waits(cls)


def _install_action_waits(cls: Any) -> None:
    """Let a virtual wait set know the servers or clients of actions in it, and tell what they found ready."""
    add, is_ready = cls.add_to_waitset, cls.is_ready

    @functools.wraps(add)
    def added(self: Any, wait_set: Any) -> None:
        if isinstance(wait_set, _rclpy.WaitSet):
            wait_set.add_action(add, self)
        else:
            add(self, wait_set)

    @functools.wraps(is_ready)
    def ready(self: Any, wait_set: Any) -> Any:
        found = wait_set.ready_of_action(self) if isinstance(wait_set, _rclpy.WaitSet) else None
        return is_ready(self, wait_set) if found is None else found

    cls.add_to_waitset, cls.is_ready = added, ready


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


def install_traffic(  # noqa: PLR0913 - all that the traffic depends on
    ledger: Ledger,
    clock: VirtualClock,
    settle: Callable[[], None],
    leave: Callable[[], None],
    depart: Callable[[], None],
    give_up: Callable[[], None],
    work_ns: Callable[[], int],
) -> None:
    """Count what is published and taken, and let the grader match every endpoint before it is used.

    Args:
        ledger: Keeps the counts.
        clock: Notified of every message.
        settle: Yields to the grader at the same instant.
        leave: The same, but returns only after all sent messages have arrived; called before a sender is destroyed.
        depart: The same, before the process may end at once.
        give_up: Called for an endpoint whose events the middleware times on the real clock.
        work_ns: Returns how much processor time the program has used.
    """
    ledger.events.install(BACKGROUND)
    _install_endpoints(ledger, settle, leave, give_up)
    install_departures(leave, depart, ledger.remove)

    def counted(name: str, handle: Any, send: Callable[[], Any]) -> Any:
        if name in BACKGROUND:
            return send()
        if ledger.must_settle():
            settle()
        if ledger.is_elsewhere(handle):
            return send()
        clock.busy_sending()
        early = ledger.early[name]
        ledger.note_sent(name, handle, work_ns())
        try:
            return send()
        except BaseException:
            ledger.sent[name] -= 1  # nothing was sent, e.g. because the context was shut down
            ledger.early[name] = early
            raise

    publish = rclpy.publisher.Publisher.publish
    call = rclpy.client.Client.call_async
    respond = rclpy.service.Service.send_response

    @functools.wraps(publish)
    def counted_publish(self: Any, msg: Any) -> Any:
        topic = self.topic_name
        if topic in BACKGROUND:
            return publish(self, msg)
        return counted(f"topic {topic}", self.handle, lambda: publish(self, msg))

    @functools.wraps(call)
    def counted_call(self: Any, request: Any) -> Any:
        return counted(f"request {self.service_name}", self.handle, lambda: call(self, request))

    @functools.wraps(respond)
    def counted_respond(self: Any, response: Any, header: Any) -> Any:
        return counted(f"response {service_name(self)}", self.handle, lambda: respond(self, response, header))

    make = rclpy.publisher.Publisher.__init__

    @functools.wraps(make)
    def made(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        ledger.note_created(self, work_ns())

    rclpy.publisher.Publisher.__init__ = made
    rclpy.publisher.Publisher.publish = counted_publish
    rclpy.client.Client.call_async = counted_call
    rclpy.service.Service.send_response = counted_respond
    _install_transitions(ledger, counted)
    install_actions(ledger, clock, counted, settle=settle, leave=leave)
    for name in ("_take_subscription", "_take_client", "_take_service"):
        setattr(rclpy.executors.Executor, name, _counting_take(name, ledger, clock, settle))


def _install_transitions(ledger: Ledger, counted: Counted) -> None:
    """Count what the state machines of lifecycle nodes publish, which rclpy's publishers do not see."""
    machines = _rclpy.LifecycleStateMachine
    make = machines.__init__

    def made(self: Any, node: Any, *services: bool) -> None:
        make(self, node, *services)
        # also without services, transitions are published
        topic = _rclpy.rclpy_resolve_name(node, "~/transition_event", False, False)  # noqa: FBT003 - C++
        ledger.transitions[self] = topic
        ledger.changed = True

    machines.__init__ = made
    for name in ("trigger_transition_by_id", "trigger_transition_by_label"):
        _count_transitions(machines, name, ledger, counted)


def _count_transitions(machines: Any, name: str, ledger: Ledger, counted: Counted) -> None:
    trigger = getattr(machines, name)

    def triggered(self: Any, transition: Any, telling: bool) -> Any:
        if not telling or self not in ledger.transitions:
            return trigger(self, transition, telling)
        return counted(f"topic {ledger.transitions[self]}", self, lambda: trigger(self, transition, telling))

    setattr(machines, name, triggered)


def _counting_take(name: str, ledger: Ledger, clock: VirtualClock, settle: Callable[[], None]) -> Callable[..., Any]:
    take = getattr(rclpy.executors.Executor, name)

    def counted_take(self: Any, receiver: Any) -> Any:
        clock.busy()
        if name == "_take_subscription" and ledger.may_be_pushed_out(receiver):
            settle()
        if name == "_take_subscription" and (kept := ledger.kept(receiver)):
            return _handing_over(receiver, kept.popleft(), clock)
        if name == "_take_subscription" and not _takes_message_only(receiver):
            taken = _taken_with_info(receiver, clock)
        else:
            taken = take(self, receiver)
        ledger.took(receiver)
        return taken

    return counted_take


def _takes_message_only(subscription: Any) -> bool:
    return bool(subscription._callback_type is rclpy.subscription.Subscription.CallbackType.MessageOnly)


def _taken_with_info(subscription: Any, clock: VirtualClock) -> Callable[[], Any] | None:
    """Take a message for a callback that also wants its times, as an executor does."""
    with contextlib.suppress(_rclpy.InvalidHandle), subscription.handle:
        found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
        if found is not None:
            return _handing_over(subscription, found, clock)
    return None


def _handing_over(subscription: Any, found: tuple[Any, Any], clock: VirtualClock) -> Callable[[], Any]:
    """Return the coroutine function that an executor runs for a message, as in rclpy itself."""
    arguments: tuple[Any, ...] = found[:1]
    if not _takes_message_only(subscription):
        info = found[1]
        times = {name: clock.at(info[name]) for name in ("source_timestamp", "received_timestamp") if name in info}
        arguments += ({**info, **times},)

    async def execute() -> None:
        await rclpy.executors.await_or_execute(subscription.callback, *arguments)

    return execute


def _install_endpoints(
    ledger: Ledger, settle: Callable[[], None], leave: Callable[[], None], give_up: Callable[[], None]
) -> None:
    kinds = {
        "publisher": rclpy.publisher.Publisher,
        "subscription": rclpy.subscription.Subscription,
        "client": rclpy.client.Client,
        "service": rclpy.service.Service,
    }
    for kind, cls in kinds.items():
        _register(ledger, kind, cls, leave, give_up)
        _report_departures_first(ledger, f"create_{kind}", settle)
    for kind in ENDS_OF_TOPICS:
        _settle_what_is_best(ledger, kind, settle)
    note_nodes(ledger.add_node)
    _report_departures_first(ledger, "__init__", settle)
    declare = rclpy.node.Node.declare_parameters

    def declared(self: Any, *args: Any, **kwargs: Any) -> Any:
        ledger.changed = True
        return declare(self, *args, **kwargs)

    rclpy.node.Node.declare_parameters = functools.wraps(declare)(declared)


def note_nodes(note: Callable[[Any], None] = lambda _: None) -> None:
    """Register every node that is created from now on; `note` is called with each after its creation."""
    create = rclpy.node.Node.__init__

    def make_node(self: Any, *args: Any, **kwargs: Any) -> None:
        MADE_NODES.append(weakref.ref(self))
        create(self, *args, **kwargs)
        note(self)
        for also in ON_NODES:
            also(self)

    rclpy.node.Node.__init__ = functools.wraps(create)(make_node)


def note_other_domains(domain: Callable[[], int], tell: Callable[[Note], None]) -> None:
    """Report the first node in each ROS domain but the grader's, which sees nothing of it.

    Args:
        domain: Returns the grader's domain.
        tell: Sends a note.
    """
    told: set[int] = set()

    def note(node: Any) -> None:
        with contextlib.suppress(Exception):  # its context may be shut down
            found = context_of(node).get_domain_id()
            if found != domain() and found not in told:
                told.add(found)
                tell(Note("other_domain", node=full_name_of(node), domain=found))

    ON_NODES.append(note)


def install_events_executor(give_up: Callable[[], None]) -> None:
    """Call `give_up` before the program makes an executor that waits in C++, where no time can be replaced."""
    make = getattr(_rclpy, "EventsExecutor", None)
    if make is None:  # not in this release
        return

    def making(*args: Any, **kwargs: Any) -> Any:
        give_up()
        return make(*args, **kwargs)

    _rclpy.EventsExecutor = making


def _report_departures_first(ledger: Ledger, method: str, settle: Callable[[], None]) -> None:
    """Report what has left the graph before a method of nodes adds to it."""
    create = getattr(rclpy.node.Node, method)

    @functools.wraps(create)
    def created(self: Any, *args: Any, **kwargs: Any) -> Any:
        if ledger.removed:
            settle()
        return create(self, *args, **kwargs)

    setattr(rclpy.node.Node, method, created)


def _settle_what_is_best(ledger: Ledger, kind: str, settle: Callable[[], None]) -> None:
    """Let a node see the whole graph before it creates an endpoint whose QoS depends on the others of the topic."""
    create = getattr(rclpy.node.Node, f"create_{kind}")

    @functools.wraps(create)
    def created(self: Any, *args: Any, **kwargs: Any) -> Any:
        if not asks_for_best((*args, *kwargs.values())):
            return create(self, *args, **kwargs)
        see_whole_graph(ledger, settle)
        endpoint = create(self, *args, **kwargs)
        ledger.resolve(self, kind, endpoint)
        return endpoint

    setattr(rclpy.node.Node, f"create_{kind}", created)


def see_whole_graph(ledger: Ledger, settle: Callable[[], None]) -> None:
    """Wait until this process sees the graph as the grader does, now and after each change from now on."""
    if not ledger.sees_graph:
        ledger.sees_graph = ledger.changed = True
    if ledger.changed:
        settle()
    ledger.note_waited()


def _note_found(ledger: Ledger, cls: Any, name: str) -> None:
    """Note that a program has found a server: on a real clock, this takes the time in which it is discovered itself."""
    look = getattr(cls, name)

    @functools.wraps(look)
    def looked(self: Any, *args: Any, **kwargs: Any) -> Any:
        found = look(self, *args, **kwargs)
        if found:
            ledger.note_waited()
        return found

    setattr(cls, name, looked)


def install_departures(
    leave: Callable[[], None], depart: Callable[[], None], remove: Callable[[], None] = lambda: None
) -> None:
    """Call `leave` before a node or a context ends, `remove` before a node does, `depart` before the process does."""

    def leaving(owner: Any, name: str, *before: Callable[[], None]) -> None:
        go = getattr(owner, name)

        @functools.wraps(go)
        def gone(*args: Any, **kwargs: Any) -> Any:
            for each in before:
                each()
            return go(*args, **kwargs)

        setattr(owner, name, gone)

    leaving(rclpy.node.Node, "destroy_node", leave, remove)
    leaving(rclpy.context.Context, "shutdown", leave)
    leaving(rclpy.context.Context, "try_shutdown", leave)
    for owner, name in ((os, "_exit"), (os, "abort"), (os, "kill"), (os, "killpg"), (signal, "raise_signal")):
        leaving(owner, name, depart)


def install_own_signals(settle: Callable[[], None]) -> None:
    """Call `settle` after the program has sent itself a signal at which rclpy shuts down, in another thread."""

    def sending(owner: Any, name: str, mine: Callable[..., bool]) -> None:
        send = getattr(owner, name)

        @functools.wraps(send)
        def sent(*args: Any) -> Any:
            try:
                return send(*args)
            finally:
                if (
                    args
                    and mine(*args)
                    and _rclpy.get_current_signal_handlers_options() in SHUTTING_DOWN.get(args[-1], ())
                ):
                    settle()

        setattr(owner, name, sent)

    sending(os, "kill", lambda *args: args[0] == os.getpid())
    sending(signal, "raise_signal", lambda *_: True)


def leave_graph(ledger: Ledger) -> None:
    """Destroy all remaining nodes and contexts, as the interpreter does when it exits."""
    for end in list(ledger.actions()):
        with contextlib.suppress(Exception):
            end.handle.destroy_when_not_in_use()
    for node in ledger.nodes():
        with contextlib.suppress(Exception):
            node.destroy_node()
    for reference in ledger.contexts:
        context = reference()
        with contextlib.suppress(Exception):
            if context is not None:
                context.try_shutdown()


def _register(ledger: Ledger, kind: str, cls: Any, leave: Callable[[], None], give_up: Callable[[], None]) -> None:
    make, destroy = cls.__init__, cls.destroy
    timed = TIMED_EVENTS.get(kind, ())

    def registered(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        ledger.add(kind, self)
        kinds = [handler.event_type for handler in self.event_handlers] if timed else []
        if kind == "subscription" and not _is_leased(self):
            ledger.events.leave_alone(self.handle, ALIVE)
        by_hand = kind == "subscription" and LEASED_EVENT in kinds and _is_leased(self) and _is_by_hand(self)
        if by_hand or any(event in timed for event in kinds):
            give_up()

    def destroyed(self: Any) -> None:
        leave()
        ledger.forget(self)
        destroy(self)

    cls.__init__ = functools.wraps(make)(registered)
    cls.destroy = functools.wraps(destroy)(destroyed)


def _is_leased(subscription: Any) -> bool:
    return finite_ns(subscription.qos_profile.liveliness_lease_duration) > 0


def _is_by_hand(subscription: Any) -> bool:
    """Return whether the publishers of a subscription have to show that they live with each message."""
    return bool(subscription.qos_profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC)


def install_looks(clock: VirtualClock, ledger: Ledger, settle: Callable[[], None]) -> None:
    """Let time pass for programs that only poll whether something has happened.

    A program that queries the graph has to see its state at that instant, independent of real-time races.

    Args:
        clock: Counts the looks.
        ledger: Knows whether the graph has changed.
        settle: Yields to the grader at the same instant.
    """

    def at_the_graph(*, whole: bool = False) -> None:
        if whole:
            see_whole_graph(ledger, settle)
        elif ledger.changed:
            settle()

    def looking(cls: Any, name: str, before: Callable[[], None]) -> None:
        original = getattr(cls, name)

        @functools.wraps(original)
        def looked_at(self: Any, *args: Any, **kwargs: Any) -> Any:
            before()
            clock.idle_look()
            return original(self, *args, **kwargs)

        setattr(cls, name, looked_at)

    looking(rclpy.context.Context, "ok", lambda: None)
    looking(rclpy.task.Future, "done", lambda: None)
    looked_at = rclpy.task.Future.done

    def done(self: Any) -> bool:
        caller: FrameType | None = sys._getframe(1)
        while caller is not None and caller.f_globals["__name__"].startswith(f"{__package__}."):
            caller = caller.f_back
        # An executor asks each of its tasks whenever it looks for work.
        by_executor = caller is not None and caller.f_globals is vars(rclpy.executors)
        return bool(_DONE(self) if by_executor else looked_at(self))

    rclpy.task.Task.done = functools.wraps(_DONE)(done)
    _note_ended_tasks(clock)
    looking(rclpy.client.Client, "service_is_ready", at_the_graph)
    _note_found(ledger, rclpy.client.Client, "service_is_ready")
    _install_counts(clock, at_the_graph)
    looking(_rclpy.ActionClient, "is_action_server_available", at_the_graph)
    _note_found(ledger, _rclpy.ActionClient, "is_action_server_available")
    for owner, names in ((rclpy.node.Node, GRAPH_LOOKS), (_rclpy.Node, ACTION_LOOKS)):
        for name in names:
            looking(owner, name, lambda: at_the_graph(whole=True))
    for name in ("get_node_names_and_namespaces", "get_node_names_and_namespaces_with_enclaves"):
        _leave_out_gone_nodes(name)


def _leave_out_gone_nodes(name: str) -> None:
    """Let a method that lists nodes leave out those that have gone.

    rmw_fastrtps learns of a participant's nodes and of its end on two threads. If the end comes first, the nodes return
    for good. Each node that exists publishes the changes of its parameters.
    """
    listed = getattr(_rclpy.Node, name)

    @functools.wraps(listed)
    def existing(self: Any) -> Any:
        publishers = _rclpy.rclpy_get_publishers_info_by_topic(self, "/parameter_events", False)  # noqa: FBT003 - C++
        left = Counter((one["node_name"], one["node_namespace"]) for one in publishers)
        return [found for found in listed(self) if left[found[:2]] > 0 and not left.subtract([found[:2]])]

    setattr(_rclpy.Node, name, existing)


def _note_ended_tasks(clock: VirtualClock) -> None:
    """Count the tasks that end, but not those of callbacks: a timer without a period never stops calling its own."""
    create, complete = rclpy.executors.Executor.create_task, rclpy.task.Task._complete_task
    created: weakref.WeakSet[Any] = weakref.WeakSet()

    @functools.wraps(create)
    def noted(self: Any, *args: Any, **kwargs: Any) -> Any:
        task = create(self, *args, **kwargs)
        created.add(task)
        return task

    @functools.wraps(complete)
    def completed(self: Any) -> None:
        if self in created:
            clock.end_task()
        complete(self)

    rclpy.executors.Executor.create_task = noted
    rclpy.task.Task._complete_task = completed


def _install_counts(clock: VirtualClock, before: Callable[[], None]) -> None:
    """Let an endpoint count no counterparts at the instant at which it is created: discovery takes milliseconds."""
    created_ns: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()

    def counting(cls: Any, name: str) -> None:
        make, count = cls.__init__, getattr(cls, name)

        @functools.wraps(make)
        def made(self: Any, *args: Any, **kwargs: Any) -> None:
            make(self, *args, **kwargs)
            created_ns[self] = clock.now_ns

        @functools.wraps(count)
        def counted(self: Any) -> Any:
            before()
            clock.idle_look()
            found = count(self)
            return 0 if created_ns.get(self) == clock.now_ns else found

        cls.__init__ = made
        setattr(cls, name, counted)

    counting(rclpy.publisher.Publisher, "get_subscription_count")
    counting(rclpy.subscription.Subscription, "get_publisher_count")


#: Called with each node that was created.
ON_NODES: list[Callable[[Any], None]] = []
#: Weak references to every node that was created, oldest first; `entry` checks whether there was any.
MADE_NODES: list[weakref.ref[Any]] = []
