"""Says what a random program must do, and when: a model of rclpy's executors and of DDS on SimPy.

It reads the description of a program, never its text, and shares no code with the grader. Computing takes no time. What
happens in one instant follows rclpy where rclpy promises an order, and ARCHITECTURE.md ("What happens at one instant")
where it does not: processes run one at a time, the first one of the program that has anything to do.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import simpy
from program_description import (
    Ask,
    Cancel,
    Client,
    End,
    Ending,
    Every,
    Fixed,
    Heard,
    Keep,
    Nap,
    Node,
    Pace,
    Process,
    Program,
    Publish,
    Reset,
    Runs,
    Say,
    Server,
    Spinning,
    Statement,
    Subscription,
    Timer,
    Value,
    Write,
)

NS_PER_MS = 1_000_000
#: Steps of a SimPy process.
Steps = Generator[simpy.Event, Any, Any]
#: The priority of what the process that runs still has to do at an instant, and of the first process's next turn.
CONTINUING, TURNS = 1, 10
#: How late a pause ends in a program that has looked at a clock. Every node has.
LATE_NS = 1_000
#: How much later each further look at a clock is within an instant, and how often rclpy looks while it makes a node: it
#: stamps the events of two parameters.
LOOK_NS, LOOKS_OF_A_NODE = 1_000, 2
#: Every so many messages of a process in a row, all others take what has arrived before the next one is sent.
FLUSH = 8


@dataclass(frozen=True, slots=True)
class Ended:
    """How a process ends: a kind of fault and its text."""

    kind: str
    text: str


@dataclass(slots=True)
class Expected:
    """What a program must do: numbers by topic, texts by process for its log and its output, ends by process."""

    topics: dict[str, list[tuple[int, int]]] = field(default_factory=dict)
    logs: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    lines: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    ends: dict[int, tuple[int, Ended]] = field(default_factory=dict)


class Leave(BaseException):
    """Unwinds a process that ends."""

    def __init__(self, ended: Ended, *, caught: bool) -> None:
        self.ended, self.caught = ended, caught


ENDINGS = {
    Ending.RAISE: Ended("exception", "RuntimeError: no more"),
    Ending.EXIT: Ended("exited", "exited with code 3"),
    Ending.EXIT_WELL: Ended("exited", "exited with code 0"),
    Ending.LEAVE_AT_ONCE: Ended("exited", "exited with code 4"),
}


@dataclass(eq=False, slots=True)
class Queue:
    """The receiving end of a subscription, server or client."""

    owner: Any
    process: ProcessModel
    messages: deque[Any]

    def put(self, message: Any) -> None:
        self.messages.append(message)
        self.process.turn_at(self.process.world.now)


class World:
    """All processes, what connects them, and what is expected of them."""

    def __init__(self, program: Program) -> None:
        self.environment = simpy.Environment(initial_time=0)
        self.expected = Expected()
        self.subscribed: dict[str, list[Queue]] = {}
        self.served: dict[str, list[Queue]] = {}
        self.processes = [ProcessModel(self, number, process) for number, process in enumerate(program.processes)]
        for process in self.processes:
            process.begin()

    @property
    def now(self) -> int:
        """The time in nanoseconds since the start."""
        return int(self.environment.now)

    def schedule(self, t_ns: int, priority: int, call: Callable[[], None]) -> None:
        """Call something at a time; of one time, what has the lowest priority first."""
        event = simpy.Event(self.environment)
        event._ok, event._value = True, None
        event.callbacks.append(lambda _: call())
        self.environment.schedule(event, priority=priority, delay=t_ns - self.now)  # type: ignore[arg-type]


class ProcessModel:
    """One process: its threads run until all of them wait, then it is another process's turn."""

    def __init__(self, world: World, number: int, process: Process) -> None:
        self.world, self.number, self.process = world, number, process
        self.alarms: list[tuple[int, int, simpy.Event]] = []
        self.numbers = count()
        self.ok, self.ended, self.sent, self.shown = True, False, 0, -LOOK_NS
        self.turns: set[int] = set()

    def begin(self) -> None:
        """Start the main thread, in the order of the processes."""
        self.world.schedule(0, TURNS + self.number, lambda: self.start(self.main()))

    def start(self, steps: Steps) -> None:
        """Run a thread."""
        self.world.environment.process(self.guarded(steps))

    def guarded(self, steps: Steps) -> Steps:
        """Run the main thread until it ends, and note how."""
        try:
            yield from steps
            self.end(Ended("exited", "exited with code 0"))
        except Leave as leave:
            self.end(leave.ended)

    def end(self, ended: Ended) -> None:
        self.ended, self.ok = True, False
        self.world.expected.ends[self.number] = self.world.now, ended
        for queues in (*self.world.subscribed.values(), *self.world.served.values()):
            queues[:] = [queue for queue in queues if queue.process is not self]

    def turn_at(self, t_ns: int) -> None:
        """Ask for a turn at a time."""
        if t_ns not in self.turns:
            self.turns.add(t_ns)
            self.world.schedule(t_ns, TURNS + self.number, lambda: self.take_turn(t_ns))

    def take_turn(self, t_ns: int) -> None:
        """Wake every thread whose time has come."""
        self.turns.discard(t_ns)
        news, self.news = self.news, None
        while self.alarms and self.alarms[0][0] <= self.world.now:
            event = heapq.heappop(self.alarms)[2]
            if not event.triggered:
                event.succeed()
        if news is not None and not news.triggered:
            news.succeed()

    news: simpy.Event | None = None

    def pause(self, t_ns: int) -> Steps:
        """Wait until a time."""
        event = simpy.Event(self.world.environment)
        heapq.heappush(self.alarms, (t_ns, next(self.numbers), event))
        self.turn_at(t_ns)
        yield event

    def look(self) -> int:
        """Return the time that a look at a clock shows."""
        self.shown = max(self.world.now, self.shown + LOOK_NS)
        return self.shown

    def end_of(self, pause_ns: int) -> int:
        """Return when a pause ends: it is counted from the time that was shown last."""
        return max(self.world.now, self.shown) + pause_ns + LATE_NS

    def await_news(self, t_ns: int | None) -> simpy.Event:
        """Return an event for the process's next turn, at the latest at a time."""
        if self.news is None:
            self.news = simpy.Event(self.world.environment)
        if t_ns is not None:
            self.turn_at(t_ns)
        return self.news

    def send(self, deliver: Callable[[], None]) -> Steps:
        """Send a message, after the others have taken what came before if there were many."""
        self.sent += 1
        if self.sent >= FLUSH:
            self.sent = 0
            yield from self.pause(self.world.now)
        deliver()

    def main(self) -> Steps:
        """Do what the main function of the file does."""
        nodes = [NodeModel(self, node) for node in self.process.nodes]
        spinning = self.process.spinning
        executor = Executor(self, nodes if spinning is Spinning.EXECUTOR else nodes[:1])
        if spinning is Spinning.ONCE:
            turns = self.process.turns
            while self.ok:
                yield from executor.spin_once(self.process.timeout_ms * NS_PER_MS)
                turns -= 1
                if turns == 0:
                    break
        else:
            while self.ok:
                yield from executor.spin_once(None)
        self.write("main 0")

    def say(self, text: str) -> None:
        self.world.expected.logs.setdefault(self.number, []).append((self.world.now, text))

    def write(self, text: str) -> None:
        self.world.expected.lines.setdefault(self.number, []).append((self.world.now, text))


class TimerModel:
    """A timer of rcl."""

    def __init__(self, world: World, timer: Timer) -> None:
        self.world, self.timer = world, timer
        self.period = timer.period_ms * NS_PER_MS
        self.next = world.now + self.period
        self.cancelled = not timer.starts

    @property
    def is_ready(self) -> bool:
        return not self.cancelled and self.next <= self.world.now

    def still_ready(self) -> bool:
        return self.is_ready

    def call(self) -> None:
        """Move on by a period, and beyond what has been missed."""
        self.next += self.period
        behind = self.world.now - self.next
        if behind > 0:
            self.next += -(-behind // self.period) * self.period

    def reset(self) -> None:
        self.next, self.cancelled = self.world.now + self.period, False


@dataclass(slots=True)
class Scope:
    """The callback that runs: its name, the number that it was called with."""

    name: str
    heard: int = 0


class NodeModel:
    """A node's entities and variables, and what its callbacks do."""

    def __init__(self, process: ProcessModel, node: Node) -> None:
        self.process, self.world, self.node = process, process.world, node
        for _ in range(LOOKS_OF_A_NODE):
            process.look()
        self.kept = [0] * max(1, node.slots)
        self.runs: dict[str, int] = {}
        self.timers = {timer.name: TimerModel(self.world, timer) for timer in node.timers}
        self.subscriptions = [self.queue(sub, sub.depth) for sub in node.subscriptions]
        self.servers = [self.queue(server, 10) for server in node.servers]
        self.clients = {client.name: self.queue(client, 10) for client in node.clients}
        self.pending: dict[int, Ask] = {}
        self.requests = count(1)
        for queue in self.subscriptions:
            self.world.subscribed.setdefault(queue.owner.topic, []).append(queue)
        for queue in self.servers:
            self.world.served.setdefault(queue.owner.service, []).append(queue)

    def queue(self, owner: Subscription | Server | Client, depth: int) -> Queue:
        return Queue(owner, self.process, deque(maxlen=depth))

    def value(self, value: Value, scope: Scope) -> int:
        if isinstance(value, Fixed):
            return value.number
        if isinstance(value, Runs):
            return self.runs[scope.name]
        return scope.heard if isinstance(value, Heard) else self.kept[value.slot]

    def call(self, name: str, body: tuple[Statement, ...], heard: int = 0) -> Steps:
        """Run a callback."""
        self.runs[name] = self.runs.get(name, 0) + 1
        yield from self.run(body, Scope(name, heard))

    def run(self, body: tuple[Statement, ...], scope: Scope) -> Steps:
        for one in body:
            yield from self.do(one, scope)

    def do(self, one: Statement, scope: Scope) -> Steps:
        """Do one statement."""
        match one:
            case Publish(topic, value):
                number = self.value(value, scope)
                yield from self.process.send(lambda: self.publish(topic, number))
            case Nap(ms):
                yield from self.process.pause(self.process.end_of(ms * NS_PER_MS))
            case Ask():
                yield from self.ask(one, scope)
            case Every(runs, then):
                if self.runs[scope.name] % runs == 0:
                    yield from self.run(then, scope)
            case End(how):
                self.leave(how)
            case _:
                self.do_at_once(one, scope)

    def do_at_once(self, one: Statement, scope: Scope) -> None:
        """Do one statement that neither waits nor sends."""
        match one:
            case Say(value):
                self.process.say(f"{scope.name} {self.value(value, scope)}")
            case Write(value):
                self.process.write(f"{scope.name} {self.value(value, scope)}")
            case Keep(slot, value, adds):
                self.kept[slot] = self.value(value, scope) + (self.kept[slot] if adds else 0)
            case Cancel(timer):
                self.timers[timer].cancelled = True
            case Reset(timer):
                self.timers[timer].reset()
            case Pace(timer, period_ms):
                self.timers[timer].period = period_ms * NS_PER_MS
            case _:
                raise AssertionError(one)

    def publish(self, topic: str, number: int) -> None:
        self.world.expected.topics.setdefault(topic, []).append((self.world.now, number))
        for queue in self.world.subscribed.get(topic, ()):
            queue.put(number)

    def ask(self, one: Ask, scope: Scope) -> Steps:
        number, value = next(self.requests), self.value(one.value, scope)
        client = self.clients[one.client]
        self.pending[number] = one

        def deliver() -> None:
            for server in self.world.served.get(client.owner.service, ()):
                server.put((value, client, number, scope.name))

        yield from self.process.send(deliver)

    def leave(self, how: Ending) -> None:
        if how is Ending.SHUTDOWN:
            self.process.ok = False
            return
        raise Leave(ENDINGS[how], caught=how is Ending.RAISE)


class TimeUpError(Exception):
    """An executor has waited long enough."""


#: Something to run: a callback of a node.
Work = Callable[[], Steps]


class Executor:
    """A SingleThreadedExecutor of rclpy."""

    def __init__(self, process: ProcessModel, nodes: list[NodeModel]) -> None:
        self.process, self.world, self.nodes = process, process.world, nodes
        self.tasks: list[Work] = []
        self.looking: Iterator[simpy.Event | Work] | None = None

    def spin_once(self, timeout_ns: int | None) -> Steps:
        """Run one callback, or wait until the time-out."""
        while True:
            if self.looking is None:
                self.looking = self.look(timeout_ns)
            try:
                found = next(self.looking)
                while isinstance(found, simpy.Event):
                    yield found
                    found = next(self.looking)
            except StopIteration:
                self.looking = None
                continue
            except TimeUpError:
                self.looking = None
                return
            yield from found()
            return

    def look(self, timeout_ns: int | None) -> Iterator[simpy.Event | Work]:
        """Yield events to wait for, and what is ready: tasks first, then all that was ready at one look."""
        deadline = None if timeout_ns is None else self.process.end_of(timeout_ns)
        found = False
        while not found:
            tasks, self.tasks = self.tasks, []
            for task in reversed(tasks):
                found = True
                yield task
            while not (ready := self.ready()) and not found and not (timed_out := self.over(deadline)):
                yield self.process.await_news(self.next_moment(deadline))
            timed_out = self.over(deadline)
            for is_still, work in ready:
                if is_still():
                    found = True
                    yield work
            if timed_out:
                raise TimeUpError

    def over(self, deadline: int | None) -> bool:
        return deadline is not None and self.world.now >= deadline

    def next_moment(self, deadline: int | None) -> int | None:
        moments = [t.next for node in self.nodes for t in node.timers.values() if not t.cancelled]
        return min([*moments, *([deadline] if deadline is not None else [])], default=None)

    def ready(self) -> list[tuple[Callable[[], bool], Work]]:
        """Return what is ready now, in the order of rclpy: by node, and of a node timers, subscriptions, clients."""
        found: list[tuple[Callable[[], bool], Work]] = []
        for node in self.nodes:
            found += [(t.still_ready, self.timer(node, t)) for t in node.timers.values() if t.is_ready]
            found += [(always, self.message(node, q)) for q in node.subscriptions if q.messages]
            found += [(always, self.response(node, q)) for q in node.clients.values() if q.messages]
            found += [(always, self.request(node, q)) for q in node.servers if q.messages]
        return found

    def timer(self, node: NodeModel, timer: TimerModel) -> Work:
        def work() -> Steps:
            timer.call()
            yield from node.call(timer.timer.name, timer.timer.body)

        return work

    def message(self, node: NodeModel, queue: Queue) -> Work:
        def work() -> Steps:
            yield from node.call(queue.owner.name, queue.owner.body, queue.messages.popleft())

        return work

    def response(self, node: NodeModel, queue: Queue) -> Work:
        """A response completes a future, whose callbacks become tasks."""

        def work() -> Steps:
            number, value, name = queue.messages.popleft()
            then = node.pending.pop(number).then
            self.tasks.append(lambda: node.run(then, Scope(name, value)))
            return
            yield

        return work

    def request(self, node: NodeModel, queue: Queue) -> Work:
        def work() -> Steps:
            value, client, number, name = queue.messages.popleft()
            server = queue.owner
            yield from node.call(server.name, server.body, value)
            answer = node.value(server.answer, Scope(server.name, value))
            yield from self.process.send(lambda: client.put((number, answer, name)))

        return work


def always() -> bool:
    """Return True: what was there stays there."""
    return True


def expected_of(program: Program) -> Expected:
    """Return what a program must do until its scenario ends."""
    world = World(program)
    world.environment.run(until=program.duration_ms * NS_PER_MS)
    return world.expected
