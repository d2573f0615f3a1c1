"""What a random program is: processes, nodes, callbacks and what they do, without a word of Python."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

#: What a main thread that sends something does first, so that all processes have started by then.
FIRST_NAP_MS = 20
#: Numbers in goals, feedback and results are kept this small, as the action's type has no more than 32 bits for them.
MOST_IN_ACTION = 999
#: What a status of a goal counts in the number that its client is told in the end.
OF_STATUS = 1000
#: What a goal that is being cancelled counts in the number that its client is told.
OF_CANCELLING = 10
#: What a main thread beside another one does before the program ends, so that this is not an instant at which the other
#: one has something to do.
LAST_NAP_MS = 7


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


@dataclass(frozen=True, slots=True)
class Parameter:
    """The number in the parameter of the node."""


Value = Fixed | Runs | Heard | Kept | Parameter


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


@dataclass(frozen=True, slots=True)
class Await:
    """Call a service in a coroutine, and go on when the response is there; then `Heard` is the number in it."""

    client: str
    value: Value


@dataclass(frozen=True, slots=True)
class SendGoal:
    """Send a goal without waiting, and ask for its result once it is accepted.

    Attributes:
        client: The client of the action.
        value: The number in the goal; servers reject negative ones.
        hears: Runs with the number in each feedback; None for a goal without a callback for it.
        answered: Runs with 1 if the goal was accepted, else 0.
        finished: Runs with the number in the result, plus 1000 for each step of the status.
    """

    client: str
    value: Value
    hears: tuple[Statement, ...] | None
    answered: tuple[Statement, ...]
    finished: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class CancelGoal:
    """Ask to cancel the last goal of a client that was accepted, if any.

    `then` runs with the return code, plus 10 if the server cancels the goal.
    """

    client: str
    then: tuple[Statement, ...]


@dataclass(frozen=True, slots=True)
class Feedback:
    """In the execute callback of an action: publish a number as feedback."""

    value: Value


@dataclass(frozen=True, slots=True)
class SetParameter:
    """Set the parameter of the node; its callback refuses negative numbers, and logs the others."""

    value: Value


@dataclass(frozen=True, slots=True)
class CallAndWait:
    """In the main thread while another one spins: call a service and wait for the response; then as for `Await`."""

    client: str
    value: Value


@dataclass(frozen=True, slots=True)
class SleepRate:
    """In the main thread while another one spins: sleep on the rate of the loop."""


@dataclass(frozen=True, slots=True)
class Rest:
    """In a coroutine of asyncio: sleep, and let the other coroutine go on."""

    ms: int


class Ending(Enum):
    """How a program ends itself; after a shutdown, the callback returns."""

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


Statement = (
    Publish
    | Say
    | Write
    | Nap
    | Keep
    | Cancel
    | Reset
    | Pace
    | Ask
    | Await
    | SendGoal
    | CancelGoal
    | Feedback
    | SetParameter
    | CallAndWait
    | SleepRate
    | Rest
    | End
    | Every
)


@dataclass(frozen=True, slots=True)
class Timer:
    """A timer with its callback; of the groups of the node, 0 is the one that it has without being told."""

    name: str
    period_ms: int
    body: tuple[Statement, ...]
    starts: bool = True
    group: int = 0


@dataclass(frozen=True, slots=True)
class Subscription:
    """A subscription with its callback and the depth of its queue."""

    name: str
    topic: str
    depth: int
    body: tuple[Statement, ...]
    group: int = 0


@dataclass(frozen=True, slots=True)
class Server:
    """A service; it answers with a number after its body."""

    name: str
    service: str
    body: tuple[Statement, ...]
    answer: Value
    group: int = 0


@dataclass(frozen=True, slots=True)
class Client:
    """A client of a service."""

    name: str
    service: str
    group: int = 0


class Finish(Enum):
    """What an execute callback does with its goal in the end."""

    SUCCEED = "succeed"
    ABORT = "abort"
    CANCEL = "cancel if that was asked for, else succeed"
    FORGET = "nothing, so that rclpy aborts it"


@dataclass(frozen=True, slots=True)
class ActionServer:
    """The server of an action; its execute callback returns a number after its body. `cancels` accepts to cancel."""

    name: str
    action: str
    body: tuple[Statement, ...]
    answer: Value
    finish: Finish
    cancels: bool
    group: int = 0


@dataclass(frozen=True, slots=True)
class ActionClient:
    """A client of an action."""

    name: str
    action: str
    group: int = 0


class Group(Enum):
    """A kind of callback group."""

    EXCLUSIVE = "MutuallyExclusiveCallbackGroup"
    REENTRANT = "ReentrantCallbackGroup"


@dataclass(frozen=True, slots=True)
class Node:
    """A node; its entities are created in the order of these fields. `groups` are those beside its own, from 1."""

    name: str
    slots: int
    timers: tuple[Timer, ...]
    subscriptions: tuple[Subscription, ...]
    servers: tuple[Server, ...] = ()
    clients: tuple[Client, ...] = ()
    groups: tuple[Group, ...] = ()
    action_servers: tuple[ActionServer, ...] = ()
    action_clients: tuple[ActionClient, ...] = ()


class Spinning(Enum):
    """How a process runs its callbacks."""

    SPIN = "rclpy.spin"
    EXECUTOR = "a SingleThreadedExecutor"
    ONCE = "spin_once in a loop"
    THREAD = "an executor in a thread, and a loop in the main thread"
    UNTIL = "spin_until_future_complete for one call after the other"
    MULTI = "a MultiThreadedExecutor"
    ASYNCIO = "spin_once and a pause in a coroutine of asyncio, and a loop in another one"


@dataclass(frozen=True, slots=True)
class Loop:
    """What the main thread or a coroutine does for so many turns, in the first node, beside what spins."""

    name: str
    turns: int
    body: tuple[Statement, ...]
    rate_ms: int = 0


@dataclass(frozen=True, slots=True)
class Process:
    """One process.

    Attributes:
        nodes: Its nodes, in the order of their creation.
        spinning: How it runs their callbacks.
        timeout_ms: For `ONCE`, the time-out of each call; for `ASYNCIO`, the pause after each call, which never blocks.
        turns: For `ONCE`, how often it is called before the program returns, 0 for ever; for `UNTIL`, how many calls.
        loop: For `THREAD`, what the main thread does; for `ASYNCIO`, what the second coroutine does.
        threads: For `MULTI`, how many threads the executor has.
    """

    nodes: tuple[Node, ...]
    spinning: Spinning
    timeout_ms: int = 0
    turns: int = 0
    loop: Loop | None = None
    threads: int = 0


@dataclass(frozen=True, slots=True)
class Program:
    """The processes of one scenario, in the order of their start."""

    processes: tuple[Process, ...]
    duration_ms: int
