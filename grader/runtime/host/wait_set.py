"""The wait set that blocks in virtual time: every spin variant of rclpy waits in it."""

from __future__ import annotations

import functools
import weakref
from collections.abc import Callable
from typing import Any, ClassVar, NamedTuple

import rclpy.executors
import rclpy.task
from rclpy.guard_condition import GuardCondition
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from .clock import VirtualClock
from .inbox import REAL_WAIT_SET
from .order import ReadyOrder
from .ros_state import RosState
from .scheduler import Scheduler

#: The kinds of entities in a wait set, in the order of the counts that it is made with.
GUARD = "guard_condition"
KINDS = ("subscription", GUARD, "timer", "client", "service")
#: Checks whether a task has ended, without counting as a look, which would let time pass: `looks` replaces it later.
_DONE = rclpy.task.Future.done
#: The methods by which servers and clients of actions tell what a wait set found ready.
ACTION_READY = {cls: cls.is_ready for cls in (_rclpy.ActionServer, _rclpy.ActionClient)}


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


class WaitSurroundings(NamedTuple):
    """What every wait of this process depends on."""

    scheduler: Scheduler
    clock: VirtualClock
    ros: RosState
    wake_ups: WakeUps
    order: ReadyOrder
    settle: Callable[[], None]


class VirtualWaitSet(REAL_WAIT_SET):  # type: ignore[misc]
    """A wait set that blocks in virtual time.

    It polls the real one. If nothing is ready, its green thread pauses until something may be: other threads run, and
    when none can, the process asks the grader for the next moment. rclpy has to see no difference, so the real wait set
    answers for everything that the middleware has. Two of its answers are changed: a subscription is ready whose
    messages the host has taken ahead of time, and what a drawn order lets come later is not ready yet.
    """

    #: rclpy makes each wait set and knows only its counts, so that all have this from their class.
    around: ClassVar[WaitSurroundings]

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
        self._included = self.around.ros.inbox.included
        #: Servers and clients of actions, with what their `is_ready` returned after the last poll.
        self._actions: dict[Any, Any] = {}
        #: The subscriptions that had messages taken ahead of time at the last poll.
        self._kept: list[int] = []
        #: What is ready, but not found by this look.
        self._hidden: set[int] = set()

    # What is in the set. `rcl_wait` removes whatever is not ready, and an executor builds a new set after each wait. A
    # wait here polls many times, so it remembers what was added, and how.

    def clear_entities(self) -> None:
        """Empty the set."""
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
        """Add a subscription, by its handle."""
        self._receivers.append(entity.pointer)
        return self._add(REAL_WAIT_SET.add_subscription, entity)

    def add_client(self, entity: Any) -> Any:
        """Add a client, by its handle."""
        self._receivers.append(entity.pointer)
        return self._add(REAL_WAIT_SET.add_client, entity)

    def add_service(self, entity: Any) -> Any:
        """Add a server, by its handle."""
        self._receivers.append(entity.pointer)
        return self._add(REAL_WAIT_SET.add_service, entity)

    def add_timer(self, entity: Any) -> Any:
        """Add a timer, by its handle."""
        self._timers.append(entity)
        return self._add(REAL_WAIT_SET.add_timer, entity)

    def add_guard_condition(self, entity: Any) -> Any:
        """Add a guard condition, by its handle."""
        self._guards.append(entity)
        return self._add(REAL_WAIT_SET.add_guard_condition, entity)

    def add_event(self, entity: Any) -> Any:
        """Add an event, by its handle."""
        self._event_handles.append(entity)
        return self._add(REAL_WAIT_SET.add_event, entity)

    def add_action(self, add: Callable[[Any, Any], Any], handle: Any) -> None:
        """Add what a server or client of an action waits for; `add` is its own method for that."""
        self._actions[handle] = None
        self._added.append((lambda wait_set, end: add(end, wait_set), handle))
        add(handle, self)

    def _fill(self) -> None:
        """Add all entities again."""
        super().clear_entities()
        for add, entity in self._added:
            add(self, entity)

    def _is_whole(self) -> bool:
        """Return whether all entities are known; those of other waitables are not."""
        # Each server or client of an action was noted once, and has taken a place for each of its queues and timers.
        parts = sum(sum(handle.get_num_entities()) - 1 for handle in self._actions)
        return bool(len(self._added) + parts == self._capacity)

    # What is ready.

    def _poll(self) -> None:
        """Look, without waiting, what is ready; all else is removed."""
        super().wait(0)
        self._kept = self._find_kept()
        for handle in self._actions:
            self._actions[handle] = ACTION_READY[type(handle)](handle, self)

    def ready_of_action(self, handle: Any) -> Any:
        """Return what a server or client of an action found ready at the last poll; None if it is not in the set.

        It notes its places in the latest set that it was added to, of which the inbox makes some of its own.
        """
        found = self._actions.get(handle)
        return found if found is None or id(handle) not in self._hidden else tuple(False for _ in found)

    def is_ready(self, kind: str, index: int) -> Any:
        """Return whether an event is ready, by its index in the set."""
        handle = self._event_handles[index] if kind == "event" and index < len(self._event_handles) else None
        # The host takes events of discovery out of the middleware, which then says that there is none.
        kept = handle is not None and self.around.ros.events.keeps(handle)
        return self.around.ros.events.is_ready(handle) if kept else super().is_ready(kind, index)

    def get_ready_entities(self, kind: str) -> Any:
        """Return the addresses of the handles that are ready, of one kind."""
        ready = super().get_ready_entities(kind)
        ready = [*ready, *(p for p in self._kept if p not in ready)] if kind == "subscription" else ready
        return [p for p in ready if p not in self._hidden] if self._hidden else ready

    def _find_kept(self) -> list[int]:
        """Return the subscriptions in this set that have messages taken ahead of time."""
        inbox = self.around.ros.inbox
        if not inbox.keeps_anything():
            return []
        known = self.around.ros.endpoints.handles()
        return [p for p in self._receivers if p in known and inbox.kept(known[p])]

    def _ready(self, *, guards: list[int]) -> bool:
        """Return whether anything is ready; of guard conditions, whether any of these is."""
        ready = REAL_WAIT_SET.get_ready_entities
        return (
            bool(guards)
            or any(ready(self, kind) for kind in self._kinds)
            or bool(self._kept)
            or any(self.is_ready("event", number) for number in range(self._events))
        )

    def _finds_anything(self, timeout_ns: int) -> bool:
        """Return whether this poll ends the wait."""
        around = self.around
        guards = REAL_WAIT_SET.get_ready_entities(self, GUARD)
        # Who only polls, with a time-out of 0, is told of each guard condition, as without the grader.
        news = around.wake_ups.news(guards, self._guards) if guards and timeout_ns else guards
        if self._ready(guards=news):
            if around.order.is_drawn:
                self._hide()
            around.scheduler.progress()
            return True
        if guards:
            around.scheduler.progress()
        return False

    # What a drawn order hides.

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
        self._hidden = self.around.order.hidden([one for one in awaited if one in ready])
        self.around.order.wait_for(one for one in awaited if one not in ready)

    # Waiting.

    def _expects(self) -> bool:
        """Wait, in real time, for announced messages of what is in this set; return whether any can be taken now."""
        ros = self.around.ros
        if not ros.inbox.expects_anything():
            return False
        known = ros.endpoints.handles()
        receivers = [known[p] for p in self._receivers if p in known]
        acting = [end for end in ros.endpoints.actions() if end.handle in self._actions]
        return ros.inbox.await_arrivals([*receivers, *(r for end in acting for r in end.receivers.values())])

    def _next_timer_ns(self) -> int | None:
        waits = [timer.time_until_next_call() for timer in self._timers if timer]
        return min((self.around.clock.now_ns + max(0, wait) for wait in waits if wait is not None), default=None)

    def _pause(self, deadline_ns: int | None) -> None:
        """Let others run, and time pass, until a timer of this set is due or a deadline has come."""
        around = self.around
        wakes = [t for t in (deadline_ns, self._next_timer_ns()) if t is not None]
        # Who waits takes what is announced at once; for others the inbox would take it ahead of time.
        around.ros.inbox.awaited.update(self._receivers)
        try:
            # The middleware makes entities ready without telling the scheduler, so this thread polls at each chance.
            around.scheduler.pause(min(wakes, default=None), polls=True)
        finally:
            around.ros.inbox.awaited.subtract(self._receivers)
        if around.order.is_drawn:
            around.order.wait_for(self._awaited())

    def wait(self, timeout_ns: int) -> None:
        """Block until something is ready, or a time-out in nanoseconds has passed; none if it is negative."""
        around = self.around
        around.clock.charge()
        deadline_ns = None if timeout_ns < 0 else around.clock.end_of(timeout_ns)
        if around.order.is_drawn:
            self._hidden = set()
            if around.ros.outbox.sent:
                # Others may react before the next callback runs, and what is sent to oneself arrives.
                around.settle()
            self._expects()
        if self._actions:
            # The inbox may have looked for messages since they were added, with wait sets of its own. A server or
            # client of an action remembers its places in the latest set alone.
            self._fill()
        while True:
            self._poll()
            if self._finds_anything(timeout_ns):
                return
            if not self._expects():
                if deadline_ns is not None and around.clock.now_ns >= deadline_ns:
                    # A program that does nothing but this, as with `spin_once(timeout_sec=0)` in a loop, only waits for
                    # time to pass. It looks at no clock by which that could be told.
                    around.clock.idle_look(50)
                    return
                self._pause(deadline_ns)
            if not self._is_whole() or self._included != around.ros.inbox.included:
                # Other waitables add their entities without these methods, and a service that was left out so far is
                # waited for from now on: the executor has to build the set anew, which it does after each wait.
                return
            self._fill()


def install_wait_sets(
    scheduler: Scheduler, clock: VirtualClock, ros: RosState, order: ReadyOrder, settle: Callable[[], None]
) -> None:
    """Replace rclpy's wait set."""
    wake_ups = WakeUps()
    wake_ups.install()
    VirtualWaitSet.around = WaitSurroundings(scheduler, clock, ros, wake_ups, order, settle)
    _rclpy.WaitSet = VirtualWaitSet
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
