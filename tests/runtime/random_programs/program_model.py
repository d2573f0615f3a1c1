"""Says what a random program must do, and when: a model of rclpy's executors and of DDS on SimPy.

It reads the description of a program, never its text, and shares no code with the grader. Computing takes no time. What
happens in one instant follows rclpy where rclpy promises an order, and docs/explanation/rules.md ("What happens at one
instant") where it does not: processes run one at a time, the first one of the program that has anything to do.
"""

from __future__ import annotations

import heapq
from collections import deque
from collections.abc import Callable, Generator, Iterator
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import count
from typing import Any

import simpy
from action_model import ClientModel, ServerModel
from model_parts import (
    NS_PER_MS,
    SUSPENDED,
    Ended,
    Entity,
    FutureModel,
    GroupModel,
    Leave,
    Queue,
    Resting,
    ReturnedError,
    Scope,
    Steps,
    Task,
    TimerModel,
    TimeUpError,
    nothing,
)
from program_description import (
    FIRST_NAP_MS,
    LAST_NAP_MS,
    Ask,
    Await,
    CallAndWait,
    Cancel,
    CancelGoal,
    Client,
    End,
    Ending,
    Every,
    Feedback,
    Fixed,
    Group,
    Heard,
    Keep,
    Kept,
    Nap,
    Node,
    Pace,
    Parameter,
    Process,
    Program,
    Publish,
    Reset,
    Rest,
    Runs,
    Say,
    SendGoal,
    Server,
    SetParameter,
    SleepRate,
    Spinning,
    Statement,
    Subscription,
    Timer,
    Value,
    Write,
)

#: Who goes on first at an instant: in the process that runs, a thread that has let others go on after it has written
#: something, but after those that another thread has started or woken, which have SimPy's usual priority; then an
#: executor that looks for work, and a thread whose pause has ended. Then it is the next turn of the first process.
USUAL, LAST, LOOKING, DUE, TURNS = 1, 2, 3, 4, 10
#: How late a pause ends in a program that has looked at a clock, as the event loop of asyncio does. rclpy, which stamps
#: events of parameters and goals, has not.
LATE_NS = 1_000
#: Every so many messages of a process in a row, all others take what has arrived before the next one is sent.
FLUSH = 8


@dataclass(slots=True)
class Expected:
    """What a program must do: numbers by topic, texts by process for its log and its output, ends by process."""

    topics: dict[str, list[tuple[int, Any]]] = field(default_factory=dict)
    logs: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    lines: dict[int, list[tuple[int, str]]] = field(default_factory=dict)
    ends: dict[int, tuple[int, Ended]] = field(default_factory=dict)


ENDINGS = {
    Ending.RAISE: Ended("exception", "RuntimeError: no more"),
    Ending.EXIT: Ended("exited", "exited with code 3"),
    Ending.EXIT_WELL: Ended("exited", "exited with code 0"),
    Ending.LEAVE_AT_ONCE: Ended("exited", "exited with code 4"),
}


class World:
    """All processes, what connects them, and what is expected of them."""

    def __init__(self, program: Program) -> None:
        self.environment = simpy.Environment(initial_time=0)
        #: The priorities of the events that have one of their own.
        self.priorities: dict[simpy.Event, int] = {}
        self.expected = Expected()
        self.subscribed: dict[str, list[Queue]] = {}
        self.served: dict[str, list[Queue]] = {}
        self.asked: dict[str, list[Queue]] = {}
        #: Those of actions, by the action and what they receive.
        self.acting: dict[tuple[str, str], list[Queue]] = {}
        self.processes = [ProcessModel(self, number, process) for number, process in enumerate(program.processes)]
        for process in self.processes:
            process.begin()

    @property
    def now(self) -> int:
        """The time in nanoseconds since the start."""
        return int(self.environment.now)

    def schedule(self, t_ns: int, priority: int, call: Callable[[], object]) -> None:
        """Call something at a time; of one time, what has the lowest priority first."""

        def happen(_: simpy.Event) -> None:
            call()

        event = simpy.Event(self.environment)
        event.callbacks.append(happen)
        self.succeed(event, priority, t_ns - self.now)

    def succeed(self, event: simpy.Event, priority: int, delay_ns: int = 0) -> None:
        """Let an event happen with a priority, which SimPy's own method does not take."""
        event._ok, event._value = True, None
        self.priorities[event] = priority
        self.environment.schedule(event, priority=priority, delay=delay_ns)  # type: ignore[arg-type]


@dataclass(slots=True)
class ThreadModel:
    """One thread: whether another one has started or woken it, and it has neither waited nor written anything since."""

    is_new: bool


class ProcessModel:
    """One process: its threads run until all of them wait, then it is another process's turn."""

    def __init__(self, world: World, number: int, process: Process) -> None:
        self.world, self.number, self.process = world, number, process
        self.alarms: list[tuple[int, int, simpy.Event]] = []
        self.numbers = count()
        self.ok, self.ended, self.sent = True, False, 0
        #: Whether it has left the graph, so that the middleware sends no response to its clients.
        self.has_left = False
        self.turns: set[int] = set()
        #: The thread that runs, how many others have been started or woken and have not gone on, and by which events:
        #: whether the thread that woke one had not just been woken itself.
        self.current: ThreadModel | None = None
        self.runnable, self.woken = 0, dict[simpy.Event, bool]()
        #: What the last thread waits for that lets others go on.
        self.lets_others_go_on: simpy.Event | None = None
        #: When it sent anything last.
        self.sent_at = -1
        #: What a thread waits for that lets the other processes run. No other thread of its process runs until then.
        self.settling: simpy.Event | None = None

    def begin(self) -> None:
        """Start the main thread, in the order of the processes."""
        self.world.schedule(0, TURNS + self.number, lambda: self.start(self.guarded(self.main()), is_new=False))

    def start(self, steps: Steps, *, is_new: bool = True) -> simpy.Event:
        """Start a thread, and return what the one that starts it waits for."""
        thread, started = ThreadModel(is_new), simpy.Event(self.world.environment)
        self.runnable += 1
        self.world.environment.process(self.run(thread, started, steps))
        return started

    def run(self, thread: ThreadModel, started: simpy.Event, steps: Steps) -> Steps:
        """Run a thread, but not while another one waits until the other processes have taken its messages."""
        self.runnable -= 1
        self.current = thread
        if thread.is_new:
            self.wake_thread(started)  # `Thread.start` waits for that
        for event in steps:
            if event is not self.lets_others_go_on and event is not self.settling:
                thread.is_new = False
            yield event
            while self.settling is not None and self.settling is not event:
                yield self.settling
                again = simpy.Event(self.world.environment)
                self.world.succeed(again, self.world.priorities.get(event, USUAL))
                yield again
            if event in self.woken:
                self.runnable -= 1
                thread.is_new = self.woken.pop(event)
            self.current = thread

    def wake_thread(self, event: simpy.Event) -> None:
        """Let another thread go on that waits for this one."""
        self.woken[event] = self.current is None or not self.current.is_new
        self.runnable += 1
        event.succeed()

    def let_others_go_on(self) -> Steps:
        """After the first text of a thread that another one has started or woken: let the others go on that can."""
        assert self.current is not None
        if self.current.is_new and self.runnable:
            self.lets_others_go_on = event = simpy.Event(self.world.environment)
            self.world.succeed(event, LAST)
            yield event
        self.current.is_new = False

    def guarded(self, steps: Steps) -> Steps:
        """Run the main thread until it ends, and note how."""
        try:
            yield from steps
            ended = Ended("exited", "exited with code 0")
        except Leave as leave:
            ended = leave.ended
        yield from self.leave()
        self.end(ended)

    def leave(self) -> Steps:
        """Let the others take what was sent at this instant, before its senders are gone."""
        if self.sent_at == self.world.now:
            yield from self.settle()

    def end(self, ended: Ended) -> None:
        """Note the end; no thread goes on."""
        if self.ended:
            return
        self.ended, self.ok, self.has_left = True, False, ended != ENDINGS[Ending.LEAVE_AT_ONCE]
        self.world.expected.ends[self.number] = self.world.now, ended
        world = self.world
        channels = (world.subscribed, world.served, world.asked, world.acting)
        for queues in (queues for channel in channels for queues in channel.values()):
            queues[:] = [queue for queue in queues if queue.process is not self]

    def turn_at(self, t_ns: int) -> None:
        """Ask for a turn at a time."""
        if t_ns not in self.turns:
            self.turns.add(t_ns)
            self.world.schedule(t_ns, TURNS + self.number, lambda: self.take_turn(t_ns))

    def take_turn(self, t_ns: int) -> None:
        """Wake every thread whose time has come."""
        self.turns.discard(t_ns)
        if self.ended:
            return
        news, self.news = self.news, None
        while self.alarms and self.alarms[0][0] <= self.world.now:
            event = heapq.heappop(self.alarms)[2]
            if not event.triggered:
                self.world.succeed(event, DUE)
        if news is not None and not news.triggered:
            self.world.succeed(news, LOOKING)

    news: simpy.Event | None = None

    def pause(self, t_ns: int) -> Steps:
        """Wait until a time."""
        event = simpy.Event(self.world.environment)
        heapq.heappush(self.alarms, (t_ns, next(self.numbers), event))
        self.turn_at(t_ns)
        yield event

    def wake(self) -> None:
        """Let an executor of another thread look for work again."""
        if self.news is not None and not self.news.triggered:
            self.world.succeed(self.news, LOOKING)
            self.news = None

    def end_of(self, pause_ns: int) -> int:
        """Return when a pause ends."""
        if not pause_ns:
            return self.world.now
        late_ns = LATE_NS if self.process.spinning is Spinning.ASYNCIO else 0
        return self.world.now + pause_ns + late_ns

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
            yield from self.settle()
        if not self.ended:
            self.sent_at = self.world.now
            deliver()

    def settle(self) -> Steps:
        """Let the other processes run at this instant, but no other thread of this one."""
        goes_on = self.settling = simpy.Event(self.world.environment)
        self.world.schedule(self.world.now, TURNS + self.number, goes_on.succeed)
        yield goes_on
        self.settling = None

    def main(self) -> Steps:
        """Do what the main function of the file does."""
        nodes = [NodeModel(self, node) for node in self.process.nodes]
        match self.process.spinning:
            case Spinning.ONCE:
                yield from self.in_turns(Executor(self, nodes[:1]))
            case Spinning.UNTIL:
                yield from self.until_answered(Executor(self, nodes[:1]), nodes[0])
            case Spinning.THREAD:
                yield from self.beside_a_thread(nodes)
            case Spinning.ASYNCIO:
                yield from self.in_coroutines(Executor(self, nodes), nodes[0])
            case Spinning.SPIN:
                yield from Executor(self, nodes[:1]).spin()
            case Spinning.EXECUTOR:
                yield from Executor(self, nodes).spin()
            case Spinning.MULTI:
                yield from PoolExecutor(self, nodes).spin()
        yield from self.write("main 0")

    def in_turns(self, executor: Executor) -> Steps:
        """Call spin_once, which adds the node to the executor and removes it again, and so wakes the executor twice.

        One that goes on for ever and never blocks lets time pass until there is something to do: it is the same as one
        that blocks.
        """
        turns = self.process.turns
        while self.ok:
            if turns:
                executor.wake()
            yield from executor.spin_once(self.process.timeout_ms * NS_PER_MS if turns else None)
            if turns == 1:
                break
            turns -= 1 if turns else 0

    def until_answered(self, executor: Executor, node: NodeModel) -> Steps:
        client = next(iter(node.clients))
        yield from self.pause(self.end_of(FIRST_NAP_MS * NS_PER_MS))
        for turn in range(self.process.turns):
            future = FutureModel(executor)
            future.callbacks.append(nothing)
            yield from node.request(client, turn, future)
            executor.wake()
            while self.ok and not future.done:
                future.callbacks.append(nothing)
                yield from executor.spin_once(None, future)
            if not future.done:
                raise AssertionError("a program that calls in turns has no other end")
            yield from self.write(f"until {future.value}")

    def beside_a_thread(self, nodes: list[NodeModel]) -> Steps:
        loop, node = self.process.loop, nodes[0]
        assert loop is not None
        if loop.rate_ms:
            node.add_rate(loop.rate_ms)
        yield self.start(Executor(self, nodes).spin())
        yield from self.pause(self.end_of(FIRST_NAP_MS * NS_PER_MS))
        scope = Scope(loop.name, loop.name)
        for turn in range(loop.turns):
            node.runs[loop.name] = turn + 1
            yield from node.run(loop.body, scope)
        yield from self.pause(self.end_of(LAST_NAP_MS * NS_PER_MS))

    def in_coroutines(self, executor: Executor, node: NodeModel) -> Steps:
        """Run the event loop of asyncio: coroutines in turn until all of them sleep, then the one that wakes first.

        An exception ends the loop three turns later, those of `gather`, of the coroutine that waits for it, and of the
        loop itself. The coroutines that are ready go on until then.
        """
        resting: list[tuple[int, int, Steps]] = []
        ready = deque([self.spin_and_rest(executor), self.work_and_rest(node)])
        left, failed, more = len(ready), None, 3
        while left and more:
            if failed is not None:
                more -= 1
            elif not ready and resting[0][0] > self.world.now:
                yield from self.pause(resting[0][0] + LATE_NS)
            while resting and resting[0][0] <= self.world.now:
                ready.append(heapq.heappop(resting)[2])
            for _ in range(len(ready)):
                steps = ready.popleft()
                try:
                    for event in steps:
                        if isinstance(event, Resting):
                            heapq.heappush(resting, (event.until_ns, next(self.numbers), steps))
                            break
                        yield event
                    else:
                        left -= 1
                except Leave as leave:
                    if leave.how is not Ending.RAISE:
                        raise
                    failed = leave
        if failed is not None:
            raise failed

    def rest(self, ms: int) -> Steps:
        """Let the event loop of asyncio go on for some time."""
        yield Resting(self.world.now + ms * NS_PER_MS)  # type: ignore[misc]

    def spin_and_rest(self, executor: Executor) -> Steps:
        while self.ok:
            executor.wake()
            yield from executor.spin_once(0)
            yield from self.rest(self.process.timeout_ms)

    def work_and_rest(self, node: NodeModel) -> Steps:
        loop = self.process.loop
        assert loop is not None
        yield from self.rest(FIRST_NAP_MS)
        scope = Scope(loop.name, loop.name)
        for turn in range(loop.turns):
            node.runs[loop.name] = turn + 1
            yield from node.run(loop.body, scope)

    def say(self, text: str) -> Steps:
        if not self.ended:
            self.world.expected.logs.setdefault(self.number, []).append((self.world.now, text))
        yield from self.let_others_go_on()

    def write(self, text: str) -> Steps:
        if not self.ended:
            self.world.expected.lines.setdefault(self.number, []).append((self.world.now, text))
        yield from self.let_others_go_on()


class NodeModel:
    """A node's entities and variables, and what its callbacks do."""

    def __init__(self, process: ProcessModel, node: Node) -> None:
        self.process, self.world, self.node = process, process.world, node
        self.kept = [0] * max(1, node.slots)
        self.parameter = 0
        self.runs: dict[str, int] = {}
        self.groups = [GroupModel(Group.EXCLUSIVE), *map(GroupModel, node.groups)]
        self.timers = {t.name: TimerModel(self.world, t.period_ms, starts=t.starts) for t in node.timers}
        self.subscriptions = [self.queue(sub, sub.depth) for sub in node.subscriptions]
        self.servers = [self.queue(server, 10) for server in node.servers]
        self.clients = {client.name: self.queue(client, 10) for client in node.clients}
        for queue in self.subscriptions:
            self.world.subscribed.setdefault(queue.owner.topic, []).append(queue)
        for queue in self.servers:
            self.world.served.setdefault(queue.owner.service, []).append(queue)
        for queue in self.clients.values():
            self.world.asked.setdefault(queue.owner.service, []).append(queue)
        #: Servers and clients of actions: an executor goes through those of all nodes before anything else.
        self.action_servers = {server.name: ServerModel(self, server) for server in node.action_servers}
        self.action_clients = {client.name: ClientModel(self, client) for client in node.action_clients}
        self.waitables = [end.entity for end in (*self.action_servers.values(), *self.action_clients.values())]
        self.executor: Executor | None = None
        self.rate: TimerModel | None = None
        self.rate_set = False
        self.waiting: simpy.Event | None = None
        #: Timers, subscriptions, clients and servers: the order in which an executor goes through what is ready.
        self.entities = [
            *(self.timer_entity(timer) for timer in node.timers),
            *(self.entity(queue, self.take_message) for queue in self.subscriptions),
            *(self.entity(queue, self.take_response) for queue in self.clients.values()),
            *(self.entity(queue, self.take_request) for queue in self.servers),
        ]

    def queue(self, owner: Subscription | Server | Client, depth: int) -> Queue:
        return Queue(owner, self.process, deque(maxlen=depth))

    def timer_entity(self, timer: Timer) -> Entity:
        model = self.timers[timer.name]

        def take() -> Steps:
            model.call()
            return self.call(timer.name, timer.body)

        return Entity(self.groups[timer.group], model.is_ready, take, is_timer=True)

    def entity(self, queue: Queue, take: Callable[[Queue], Steps]) -> Entity:
        return Entity(self.groups[queue.owner.group], lambda: bool(queue.messages), lambda: take(queue))

    def add_rate(self, period_ms: int) -> None:
        """Add the timer of a rate, which is in a group of its own."""
        rate = TimerModel(self.world, period_ms)

        def take() -> Steps:
            rate.call()
            self.rate_set = True
            if self.waiting is not None:
                self.process.wake_thread(self.waiting)
                self.waiting = None
            return nothing()

        self.rate = rate
        self.entities.insert(len(self.timers), Entity(GroupModel(Group.REENTRANT), rate.is_ready, take, is_timer=True))

    def sleep_rate(self) -> Steps:
        """Wait for the rate, which may have been due while nobody was waiting."""
        if not self.rate_set:
            self.waiting = simpy.Event(self.world.environment)
            yield self.waiting
        self.rate_set = False

    def take_message(self, queue: Queue) -> Steps:
        return self.call(queue.owner.name, queue.owner.body, queue.messages.popleft())

    def take_response(self, queue: Queue) -> Steps:
        client, future, value = queue.messages.popleft()

        def steps() -> Steps:
            if client is queue:
                assert self.executor is not None
                future.set(self.executor, value)
            yield from nothing()

        return steps()

    def take_request(self, queue: Queue) -> Steps:
        value, client, future = queue.messages.popleft()
        server = queue.owner

        def steps() -> Steps:
            scope = Scope(server.name, server.name, value)
            yield from self.call(server.name, server.body, value, scope)
            answer = self.value(server.answer, scope)

            def deliver() -> None:
                # The middleware wakes every client of the service; those that have not asked find nothing.
                for each in () if client.process.has_left else self.world.asked.get(server.service, ()):
                    each.put((client, future, answer))

            yield from self.process.send(deliver)

        return steps()

    def value(self, value: Value, scope: Scope) -> int:
        match value:
            case Fixed(number):
                return number
            case Runs():
                return self.runs[scope.name]
            case Heard():
                return scope.heard
            case Kept(slot):
                return self.kept[slot]
            case Parameter():
                return self.parameter

    def call(self, name: str, body: tuple[Statement, ...], heard: int = 0, scope: Scope | None = None) -> Steps:
        """Run a callback."""
        self.runs[name] = self.runs.get(name, 0) + 1
        with suppress(ReturnedError):
            yield from self.run(body, scope or Scope(name, name, heard))

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
            case SleepRate():
                yield from self.sleep_rate()
            case Rest(ms):
                yield from self.process.rest(ms)
            case Every(runs, then):
                if self.runs[scope.name] % runs == 0:
                    yield from self.run(then, scope)
            case End(how):
                self.leave(how)
            case Ask() | Await() | CallAndWait():
                yield from self.ask(one, scope)
            case SendGoal(client, value):
                yield from self.action_clients[client].send_goal(one, scope, self.value(value, scope))
            case CancelGoal(client):
                yield from self.action_clients[client].cancel(one, scope)
            case Feedback(value):
                yield from self.action_servers[scope.name].feed(scope.goal, self.value(value, scope))
            case _:
                yield from self.do_at_once(one, scope)

    def do_at_once(self, one: Statement, scope: Scope) -> Steps:
        """Do one statement that takes no time and sends nothing."""
        match one:
            case Say(value):
                yield from self.process.say(f"{scope.label} {self.value(value, scope)}")
            case Write(value):
                yield from self.process.write(f"{scope.label} {self.value(value, scope)}")
            case Keep(slot, value, adds):
                self.kept[slot] = self.value(value, scope) + (self.kept[slot] if adds else 0)
            case SetParameter(value):
                yield from self.set_parameter(self.value(value, scope))
            case Cancel(timer):
                self.timers[timer].cancelled = True
            case Reset(timer):
                self.timers[timer].reset()
            case Pace(timer, period_ms):
                self.timers[timer].period = period_ms * NS_PER_MS
            case _:
                raise AssertionError(one)

    def set_parameter(self, number: int) -> Steps:
        """Ask the callback, and keep the number."""
        if number >= 0:
            yield from self.process.say(f"parameter {number}")
            self.parameter = number

    def publish(self, topic: str, number: int) -> None:
        self.world.expected.topics.setdefault(topic, []).append((self.world.now, number))
        for queue in self.world.subscribed.get(topic, ()):
            queue.put(number)

    def request(self, client: str, value: int, future: FutureModel) -> Steps:
        """Send a request to the server, if there is one."""
        queue = self.clients[client]

        def deliver() -> None:
            for server in self.world.served.get(queue.owner.service, ()):
                server.put((value, queue, future))

        yield from self.process.send(deliver)

    def ask(self, one: Ask | Await | CallAndWait, scope: Scope) -> Steps:
        """Call a service, and go on at once, when the coroutine is resumed, or when another thread has the response."""
        future = FutureModel()
        yield from self.request(one.client, self.value(one.value, scope), future)
        if isinstance(one, Ask):
            inner, then = Scope(scope.name, f"{scope.name}.{one.client}"), one.then

            def answered() -> Steps:
                inner.heard = future.value
                yield from self.run(then, inner)

            future.callbacks.append(answered)
            return
        if isinstance(one, Await):
            while not future.done:
                yield SUSPENDED  # type: ignore[misc]
        else:
            arrived = simpy.Event(self.world.environment)

            def unblock() -> Steps:
                self.process.wake_thread(arrived)
                yield from nothing()

            future.callbacks.append(unblock)
            yield arrived
        scope.heard = future.value

    def leave(self, how: Ending) -> None:
        if how is Ending.SHUTDOWN:
            self.process.ok = False
            raise ReturnedError
        raise Leave(ENDINGS[how], how)


class Executor:
    """A SingleThreadedExecutor of rclpy."""

    def __init__(self, process: ProcessModel, nodes: list[NodeModel]) -> None:
        self.process, self.world, self.nodes = process, process.world, nodes
        self.tasks: list[Task] = []
        self.looking: Iterator[simpy.Event | Task] | None = None
        self.condition: FutureModel | None = None
        self.guard = False
        for node in nodes:
            node.executor = self

    def spin(self) -> Steps:
        """Run callbacks until the context is shut down."""
        while self.process.ok:
            yield from self.spin_once(None)

    def add_task(self, task: Task) -> None:
        self.tasks.append(task)
        self.wake()

    def wake(self) -> None:
        self.guard = True
        self.process.wake()

    def spin_once(self, timeout_ns: int | None, condition: FutureModel | None = None) -> Steps:
        """Run one callback, or wait until the time-out or until a future is done."""
        while True:
            if self.looking is None or self.condition is not condition:
                self.looking, self.condition = self.look(timeout_ns, condition), condition
            try:
                found = next(self.looking)
                while isinstance(found, simpy.Event):
                    yield found
                    found = next(self.looking)
            except StopIteration:
                self.looking = None
                if condition is not None and condition.done:
                    return
                continue
            except TimeUpError:
                self.looking = None
                return
            yield from self.execute(found)
            return

    def execute(self, task: Task) -> Steps:
        yield from task.advance()

    def look(self, timeout_ns: int | None, condition: FutureModel | None) -> Iterator[simpy.Event | Task]:
        """Yield events to wait for, and what is ready: tasks first, then all that was ready at one look."""
        deadline = None if timeout_ns is None else self.process.end_of(timeout_ns)
        found = False
        while not found and not (condition is not None and condition.done):
            for task in reversed(list(self.tasks)):
                if not task.done and not task.running:
                    found = True
                    yield task
            self.tasks = [task for task in self.tasks if not task.done]
            while not (ready := self.ready()) and not self.guard and not self.is_over(deadline):
                yield self.process.await_news(self.next_moment(deadline))
            self.guard = False
            timed_out = self.is_over(deadline)
            for entity in ready:
                if (not entity.is_timer or entity.is_ready()) and entity.group.is_free:
                    found = True
                    yield self.claim(entity)
            if timed_out:
                raise TimeUpError

    def is_over(self, deadline: int | None) -> bool:
        return deadline is not None and self.world.now >= deadline

    def next_moment(self, deadline: int | None) -> int | None:
        timers = (t for n in self.nodes for t in (*n.timers.values(), n.rate) if t is not None and not t.cancelled)
        moments = [timer.next for timer in timers if timer.next > self.world.now]
        return min([*moments, *([deadline] if deadline is not None else [])], default=None)

    def ready(self) -> list[Entity]:
        """Return what is ready now, in the order of rclpy: waitables, then by node and by the kind of entity."""
        kinds = ([e for node in self.nodes for e in node.waitables], [e for node in self.nodes for e in node.entities])
        return [entity for entities in kinds for entity in entities if entity.can_run() and entity.is_ready()]

    def claim(self, entity: Entity) -> Task:
        """Make a task of what an entity has to do."""
        entity.claimed = True
        task = Task(self.handle(entity))
        self.tasks.append(task)
        return task

    def handle(self, entity: Entity) -> Steps:
        """Take what there is to do and do it, unless a callback of the same group has begun in between."""
        if not entity.group.is_free:
            entity.claimed = False
            self.wake()
            return
        entity.group.active += 1
        steps = entity.take()
        entity.claimed = False
        self.wake()
        try:
            yield from steps
        finally:
            entity.group.active -= 1
            self.wake()


class PoolExecutor(Executor):
    """A MultiThreadedExecutor of rclpy: it hands what it finds to threads, in turn."""

    def __init__(self, process: ProcessModel, nodes: list[NodeModel]) -> None:
        super().__init__(process, nodes)
        self.submitted: deque[Task] = deque()
        self.idle: list[simpy.Event] = []
        self.started = 0

    def execute(self, task: Task) -> Steps:
        self.submitted.append(task)
        if self.idle:
            self.process.wake_thread(self.idle.pop())
        elif self.started < self.process.process.threads:
            self.started += 1
            yield self.process.start(self.work())

    def left_by(self, task: Task) -> Generator[simpy.Event, Any, Leave | None]:
        """Run a task, and return how it would end the program; of a thread of a pool, sys.exit ends the task only."""
        try:
            yield from task.advance()
        except Leave as leave:
            return leave
        return None

    def work(self) -> Steps:
        """Do what was submitted, one after the other, for ever."""
        while True:
            while self.submitted:
                left = yield from self.left_by(self.submitted.popleft())
                if left is not None and left.how is Ending.LEAVE_AT_ONCE:
                    yield from self.process.leave()
                    self.process.end(left.ended)
                    return
            event = simpy.Event(self.world.environment)
            self.idle.append(event)
            yield event


def expected_of(program: Program) -> Expected:
    """Return what a program must do until its scenario ends."""
    world = World(program)
    world.environment.run(until=program.duration_ms * NS_PER_MS)
    return world.expected
