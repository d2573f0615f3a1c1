"""What the model of a random program is made of: queues, timers, callback groups, futures, tasks and how they end."""

from __future__ import annotations

from collections import deque
from collections.abc import Callable, Generator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import simpy
from program_description import Ending, Group

if TYPE_CHECKING:
    from program_model import Executor, ProcessModel, World

NS_PER_MS = 1_000_000
#: Steps of a SimPy process.
Steps = Generator[simpy.Event, Any, Any]
#: What a coroutine yields when it waits for a future.
SUSPENDED = object()


@dataclass(frozen=True, slots=True)
class Ended:
    """How a process ends: a kind of fault and its text."""

    kind: str
    text: str


class Leave(BaseException):
    """Unwinds a process that ends."""

    def __init__(self, ended: Ended, how: Ending) -> None:
        self.ended, self.how = ended, how


class ReturnedError(Exception):
    """A callback returns before its end."""


class TimeUpError(Exception):
    """An executor has waited long enough."""


@dataclass(eq=False, slots=True)
class Queue:
    """The receiving end of a subscription, server or client."""

    owner: Any
    process: ProcessModel
    messages: deque[Any]

    def put(self, message: Any) -> None:
        self.messages.append(message)
        self.process.turn_at(self.process.world.now)


class TimerModel:
    """A timer of rcl."""

    def __init__(self, world: World, period_ms: int, *, starts: bool = True) -> None:
        self.world = world
        self.period = period_ms * NS_PER_MS
        self.next = world.now + self.period
        self.cancelled = not starts

    def is_ready(self) -> bool:
        return not self.cancelled and self.next <= self.world.now

    def call(self) -> None:
        """Move on by a period, and beyond what has been missed. In rcl 9.2, that includes a call that is due now."""
        self.next += self.period
        behind = self.world.now - self.next
        if behind >= 0:
            self.next += (behind // self.period + 1) * self.period

    def reset(self) -> None:
        self.next, self.cancelled = self.world.now + self.period, False


class GroupModel:
    """A callback group: an exclusive one runs one callback at a time."""

    def __init__(self, kind: Group) -> None:
        self.kind, self.active = kind, 0

    @property
    def is_free(self) -> bool:
        return self.kind is Group.REENTRANT or not self.active


class FutureModel:
    """What a call of a service will be answered with.

    Args:
        executor: Whose tasks the callbacks become.
        callbacks: What is done with the answer first. A client forgets the request.
    """

    def __init__(self, executor: Executor | None = None, callbacks: list[Callable[[], Steps]] | None = None) -> None:
        self.executor = executor
        self.done, self.value = False, 0
        self.callbacks: list[Callable[[], Steps]] = [nothing] if callbacks is None else callbacks

    def set(self, executor: Executor, value: int) -> None:
        self.done, self.value = True, value
        for callback in self.callbacks:
            executor.add_task(Task(callback()))


def nothing() -> Steps:
    """Do nothing, as a task."""
    return
    yield


@dataclass(frozen=True, slots=True)
class Resting:
    """What a coroutine of asyncio yields when it sleeps."""

    until_ns: int


@dataclass(eq=False, slots=True)
class Task:
    """A callback or coroutine that an executor runs, perhaps in several parts."""

    steps: Steps
    done: bool = False
    running: bool = False

    def advance(self) -> Steps:
        """Run it until it has ended or waits for a future."""
        if self.done or self.running:
            return
        self.running = True
        for event in self.steps:
            if event is SUSPENDED:
                self.running = False
                return
            yield event
        self.done, self.running = True, False


@dataclass(eq=False, slots=True)
class Entity:
    """What an executor waits for.

    Attributes:
        group: Its callback group.
        is_ready: Whether there is anything to do.
        take: Takes what there is to do, and returns how it is done.
        claimed: Whether an executor is about to take it.
    """

    group: GroupModel
    is_ready: Callable[[], bool]
    take: Callable[[], Steps]
    is_timer: bool = False
    claimed: bool = False

    def can_run(self) -> bool:
        return not self.claimed and self.group.is_free


@dataclass(slots=True)
class Scope:
    """The callback that runs: its name, what it logs under, and the number that it was called with."""

    name: str
    label: str
    heard: int = 0
    #: Of an execute callback.
    goal: Any = None
