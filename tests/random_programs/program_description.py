"""What a random program is: processes, nodes, callbacks and what they do, without a word of Python."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum


@dataclass(frozen=True, slots=True)
class Fixed:
    """A number."""

    number: int


@dataclass(frozen=True, slots=True)
class Runs:
    """How often this callback has begun."""


@dataclass(frozen=True, slots=True)
class Heard:
    """The number in the message, request or response that this callback was called with."""


@dataclass(frozen=True, slots=True)
class Kept:
    """The number in a variable of the node."""

    slot: int


Value = Fixed | Runs | Heard | Kept


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish a number on a topic."""

    topic: str
    value: Value


@dataclass(frozen=True, slots=True)
class Say:
    """Log the name of the callback and a number."""

    value: Value


@dataclass(frozen=True, slots=True)
class Write:
    """Print the name of the callback and a number."""

    value: Value


@dataclass(frozen=True, slots=True)
class Nap:
    """Sleep, and so keep the thread busy."""

    ms: int


@dataclass(frozen=True, slots=True)
class Keep:
    """Set a variable of the node, or add to it."""

    slot: int
    value: Value
    adds: bool


@dataclass(frozen=True, slots=True)
class Cancel:
    """Cancel a timer of the node."""

    timer: str


@dataclass(frozen=True, slots=True)
class Reset:
    """Reset a timer of the node."""

    timer: str


@dataclass(frozen=True, slots=True)
class Pace:
    """Change the period of a timer of the node; the call that is due keeps its time."""

    timer: str
    period_ms: int


@dataclass(frozen=True, slots=True)
class Ask:
    """Call a service without waiting; `then` runs with the number in the response."""

    client: str
    value: Value
    then: tuple[Statement, ...]


class Ending(Enum):
    """How a program ends itself."""

    RAISE = "raise"
    EXIT = "exit"
    EXIT_WELL = "exit well"
    SHUTDOWN = "shutdown"
    LEAVE_AT_ONCE = "leave at once"


@dataclass(frozen=True, slots=True)
class End:
    """End the program."""

    how: Ending


@dataclass(frozen=True, slots=True)
class Every:
    """Do something each so many runs of the callback."""

    runs: int
    then: tuple[Statement, ...]


Statement = Publish | Say | Write | Nap | Keep | Cancel | Reset | Pace | Ask | End | Every


@dataclass(frozen=True, slots=True)
class Timer:
    """A timer with its callback."""

    name: str
    period_ms: int
    body: tuple[Statement, ...]
    starts: bool = True


@dataclass(frozen=True, slots=True)
class Subscription:
    """A subscription with its callback and the depth of its queue."""

    name: str
    topic: str
    depth: int
    body: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Server:
    """A service; it answers with a number after its body."""

    name: str
    service: str
    body: tuple[Statement, ...]
    answer: Value


@dataclass(frozen=True, slots=True)
class Client:
    """A client of a service."""

    name: str
    service: str


@dataclass(frozen=True, slots=True)
class Node:
    """A node; its entities are created in the order of these fields."""

    name: str
    slots: int
    timers: tuple[Timer, ...]
    subscriptions: tuple[Subscription, ...]
    servers: tuple[Server, ...] = ()
    clients: tuple[Client, ...] = ()


class Spinning(Enum):
    """How the main thread of a process runs its callbacks."""

    SPIN = "rclpy.spin"
    EXECUTOR = "a SingleThreadedExecutor"
    ONCE = "spin_once in a loop"


@dataclass(frozen=True, slots=True)
class Process:
    """One process.

    Attributes:
        nodes: Its nodes, in the order of their creation.
        spinning: How it runs their callbacks.
        timeout_ms: For `ONCE`, the time-out of each call.
        turns: For `ONCE`, how often it is called before the program returns; 0 for ever.
    """

    nodes: tuple[Node, ...]
    spinning: Spinning
    timeout_ms: int = 0
    turns: int = 0


@dataclass(frozen=True, slots=True)
class Program:
    """The processes of one scenario, in the order of their start."""

    processes: tuple[Process, ...]
    duration_ms: int
