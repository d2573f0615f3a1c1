"""Draws random programs, in which nothing depends on what rclpy leaves open.

What sends to whom has no circle: a callback that something on one channel starts sends on later channels only. Topics
come before services.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

from hypothesis import strategies as st
from program_description import (
    LAST_NAP_MS,
    Ask,
    Await,
    CallAndWait,
    Cancel,
    Client,
    End,
    Ending,
    Every,
    Fixed,
    Group,
    Heard,
    Keep,
    Kept,
    Loop,
    Nap,
    Node,
    Pace,
    Parameter,
    Process,
    Program,
    Publish,
    Reset,
    Runs,
    Say,
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

TOPICS, SERVICES = "abcd", "pq"
#: Short ones that coincide, and ones that do not.
PERIODS = (50, 100, 100, 125, 200, 250, 300, 470)
NAPS = (7, 30, 50, 100, 120, 260)
DURATION_MS = 2000
SLOTS = 2


#: Ends that work in a callback whose spin waits for something else as well, in the threads of a pool, and in the main
#: thread beside another one.
HARD_ENDS = (Ending.RAISE, Ending.EXIT, Ending.EXIT_WELL, Ending.LEAVE_AT_ONCE)
ENDS_OF_POOL = (Ending.EXIT, Ending.LEAVE_AT_ONCE)
MAIN_ENDS = HARD_ENDS


@dataclass(frozen=True, slots=True)
class Room:
    """What the callbacks of one group, or a loop, may use, so that no two threads use the same.

    Attributes:
        topics: Where they publish.
        slots: The variables that they use.
        timers: The timers that they control.
        clients: The clients that they ask with.
        ends: How they may end the program.
        shared: Whether other threads run beside them, so that what is done with an answer may only be logged.
        awaits: Whether they may be coroutines.
        waits: Whether they may wait in the main thread while another one spins.
    """

    topics: str
    slots: tuple[int, ...]
    timers: tuple[str, ...]
    clients: tuple[Client, ...]
    ends: tuple[Ending, ...] = tuple(Ending)
    shared: bool = False
    awaits: bool = True
    waits: bool = False

    def values(self, *, heard: bool) -> st.SearchStrategy[Value]:
        """Draw a value; with a number that was heard only where there is one."""
        return st.one_of(
            st.integers(-3, 9).map(Fixed),
            st.just(Runs()),
            *([st.just(Heard())] if heard else []),
            *([st.sampled_from(self.slots).map(Kept)] if self.slots else []),
            *([] if self.shared else [st.just(Parameter())]),
        )

    def statements(
        self, channels: str, *, heard: bool, deep: bool = True, rate: bool = False
    ) -> st.SearchStrategy[tuple[Statement, ...]]:
        """Draw what a callback does; it sends on these channels only."""
        value = self.values(heard=heard)
        kinds: list[st.SearchStrategy[Statement]] = [
            st.builds(Say, value),
            st.builds(Write, value),
            st.builds(Nap, st.sampled_from(NAPS)),
        ]
        if self.slots:
            kinds += [st.builds(Keep, st.sampled_from(self.slots), value, st.booleans())]
        if topics := [c for c in channels if c in self.topics]:
            kinds += [st.builds(Publish, st.sampled_from(topics), value)] * 3
        if self.timers:
            timers = st.sampled_from(self.timers)
            kinds += [st.builds(Cancel, timers), st.builds(Reset, timers)]
            kinds += [st.builds(Pace, timers, st.sampled_from(PERIODS))]
        if not self.shared:
            kinds += [st.builds(SetParameter, value)]
        if rate:
            kinds += [st.just(SleepRate())] * 2
        if deep:
            kinds += self.questions(channels, value)
            inner = self.statements(channels, heard=heard, deep=False)
            kinds += [st.builds(Every, st.integers(2, 5), inner)]
            if self.ends:
                before = (Nap(LAST_NAP_MS),) if self.waits else ()
                ends = st.sampled_from(self.ends).map(lambda how: (*before, End(how)))
                kinds += [st.builds(lambda n, i, e: Every(n, i + e), st.integers(3, 9), inner, ends)]
        return st.lists(st.one_of(kinds), max_size=4 if deep else 2).map(tuple)

    def questions(self, channels: str, value: st.SearchStrategy[Value]) -> list[st.SearchStrategy[Statement]]:
        """Return what draws a call of each service, and what is done with the answer."""
        found: list[st.SearchStrategy[Statement]] = []
        for client in self.clients:
            if client.service not in channels:
                continue
            later = "" if self.shared else channels[channels.index(client.service) + 1 :]
            then = replace(self, topics="", slots=(), timers=(), shared=True) if self.shared else self
            found += [st.builds(Ask, st.just(client.name), value, then.statements(later, heard=True, deep=False))]
            if self.awaits:
                found += [st.builds(Await, st.just(client.name), value)]
            if self.waits:
                found += [st.builds(CallAndWait, st.just(client.name), value)]
        return found


def after(channel: str) -> str:
    """Return the channels that a callback may send on that something on a channel starts."""
    everything = TOPICS + SERVICES
    return everything[everything.index(channel) + 1 :]


@st.composite
def nodes(draw: st.DrawFn, number: int, taken: Taken, spinning: Spinning) -> tuple[Node, Loop | None]:
    """Draw a node, and what the main thread does beside a thread that spins; no service has two servers."""
    several = spinning is Spinning.MULTI
    groups = tuple(draw(st.lists(st.sampled_from(Group), min_size=int(several), max_size=2)))
    timers = [(f"t{number}{n}", draw(st.integers(0, len(groups)))) for n in range(draw(st.integers(0, 3)))]
    topics = draw(st.lists(st.sampled_from(TOPICS), max_size=2))
    services = [s for s in draw(st.lists(st.sampled_from(SERVICES), max_size=1)) if s not in taken.served]
    taken.served |= set(services)
    wanted = draw(
        st.lists(st.sampled_from(SERVICES), min_size=int(spinning is Spinning.UNTIL), max_size=2, unique=True)
    )
    asked = [s for s in wanted if s not in taken.asked or not taken.several]
    taken.asked |= set(asked)
    clients = [Client(f"c{number}{n}", s, draw(st.integers(0, len(groups)))) for n, s in enumerate(asked)]
    ends = {Spinning.THREAD: (), Spinning.MULTI: ENDS_OF_POOL, Spinning.UNTIL: HARD_ENDS}.get(spinning, tuple(Ending))
    rooms = [Room(TOPICS, tuple(range(SLOTS)), tuple(name for name, _ in timers), tuple(clients), ends)]
    beside = Room("", (), (), ())
    kinds = (Group.EXCLUSIVE, *groups)
    if several:
        owners = [draw(st.integers(0, len(groups))) for _ in (*TOPICS, *clients)]
        rooms = [
            Room(
                "".join(t for t, owner in zip(TOPICS, owners, strict=False) if owner == group),
                (group,),
                # Callbacks that overlap could change a timer at the instant at which it is due.
                tuple(name for name, its in timers if its == group and kinds[group] is Group.EXCLUSIVE),
                tuple(c for c, owner in zip(clients, owners[len(TOPICS) :], strict=True) if owner == group),
                ends,
                shared=True,
                awaits=kinds[group] is Group.EXCLUSIVE,
            )
            for group in range(len(kinds))
        ]
    elif spinning is Spinning.THREAD:
        owners = [draw(st.booleans()) for _ in (*TOPICS, *clients)]
        own, others = (
            (
                "".join(t for t, owner in zip(TOPICS, owners, strict=False) if owner is side),
                tuple(c for c, owner in zip(clients, owners[len(TOPICS) :], strict=True) if owner is side),
            )
            for side in (True, False)
        )
        rooms = [Room(others[0], (0,), rooms[0].timers, others[1], (), shared=True)]
        beside = Room(own[0], (1,), (), own[1], MAIN_ENDS, shared=True, awaits=False, waits=True)
    room = rooms if several else rooms * (len(groups) + 1)

    def callback(group: int, channels: str, *, heard: bool = True) -> tuple[Statement, ...]:
        return draw(room[group].statements(channels, heard=heard))

    of = [draw(st.integers(0, len(groups))) for _ in (*topics, *services)]
    node = Node(
        name=f"n{number}",
        slots=SLOTS + 1,
        timers=tuple(
            Timer(
                name,
                draw(st.sampled_from(PERIODS)),
                callback(group, TOPICS + SERVICES, heard=False),
                starts=draw(st.sampled_from((True, True, True, False))),
                group=group,
            )
            for name, group in timers
        ),
        subscriptions=tuple(
            Subscription(
                f"s{number}{n}", topic, draw(st.sampled_from((1, 2, 10))), callback(of[n], after(topic)), of[n]
            )
            for n, topic in enumerate(topics)
        ),
        servers=tuple(
            Server(
                f"v{number}{n}",
                service,
                callback(group, after(service)),
                draw(room[group].values(heard=True)),
                group,
            )
            for n, (service, group) in enumerate(zip(services, of[len(topics) :], strict=True))
        ),
        clients=tuple(clients),
        groups=groups,
    )
    if spinning is not Spinning.THREAD:
        return node, None
    rate = draw(st.sampled_from((0, 50, 100, 250)))
    body = draw(beside.statements(TOPICS + SERVICES, heard=True, rate=bool(rate)))
    pause: Statement = SleepRate() if rate else Nap(draw(st.sampled_from(NAPS)))
    return node, Loop("m", draw(st.sampled_from((3, 12, 100))), (*body, pause), rate)


@dataclass(slots=True)
class Taken:
    """What other nodes of the program have already.

    Attributes:
        served: The services that have a server.
        asked: The services that have a client.
        several: Whether any process has several threads, so that the order of requests at one instant is open.
    """

    served: set[str]
    asked: set[str]
    several: bool


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """Draw a program; only its first process may have several threads, so that nothing runs between their messages."""
    made: list[Process] = []
    taken = Taken(set(), set(), several=False)
    number = 0
    for place in range(draw(st.integers(1, 3))):
        threaded = (Spinning.THREAD, Spinning.MULTI)
        spinning = draw(st.sampled_from([kind for kind in Spinning if place == 0 or kind not in threaded]))
        taken.several |= spinning in threaded
        own: list[Node] = []
        loop = None
        for _ in range(draw(st.integers(1, 2)) if spinning is Spinning.EXECUTOR else 1):
            node, loop = draw(nodes(number, taken, spinning))
            number += 1
            own.append(node)
        if spinning is Spinning.UNTIL and not own[0].clients:
            spinning = Spinning.SPIN
        turns = {Spinning.ONCE: (0, 3, 12), Spinning.UNTIL: (1, 5)}.get(spinning, (0,))
        made.append(
            Process(
                tuple(own),
                spinning,
                timeout_ms=draw(st.sampled_from((10, 50, 100, 333))) if spinning is Spinning.ONCE else 0,
                turns=draw(st.sampled_from(turns)),
                loop=loop,
                threads=draw(st.integers(2, 4)) if spinning is Spinning.MULTI else 0,
            )
        )
    return Program(tuple(made), DURATION_MS)
