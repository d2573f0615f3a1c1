"""Draws random programs, in which nothing depends on what rclpy leaves open.

What sends to whom has no circle: a callback that something on one channel starts sends on later channels only. Topics
come before services; one action comes before both, one after. Nodes of a `MultiThreadedExecutor` have no actions: the
execute callbacks of several goals would share a name, a topic of feedback and one of states, and run at one instant. No
action has clients in two nodes.
"""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

from hypothesis import HealthCheck, Phase, given, seed, settings
from hypothesis import strategies as st
from program_description import (
    LAST_NAP_MS,
    ActionClient,
    ActionServer,
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
    Finish,
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

TOPICS, SERVICES = "abcd", "pq"
#: Those that come before topics, and so let execute callbacks send what they like, and those that come after services,
#: and so may be used by whatever a message or request starts.
EARLY_ACTIONS, LATE_ACTIONS = "x", "y"
#: All channels, in the order in which one may start what sends on another.
CHANNELS = EARLY_ACTIONS + TOPICS + SERVICES + LATE_ACTIONS
#: Short ones that coincide, and ones that do not.
PERIODS = (50, 100, 100, 125, 200, 250, 300, 470)
NAPS = (7, 30, 50, 100, 120, 260)
#: What a coroutine that polls sleeps between its turns.
PAUSES = (1, 5, 10, 20, 50)
DURATION_MS = 2000
SLOTS = 2
NUMBERS, FEW = st.integers(-3, 9), st.integers(2, 9)
#: How many statements a callback has, and one that is nested; and how many timers a node has.
MANY, SOME, TIMERS = (st.sampled_from(counts) for counts in ((0, 1, 2, 2, 3, 3, 4), (0, 1, 1, 2), (0, 1, 1, 2, 2, 3)))


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
        rests: Whether they run in a coroutine of asyncio.
        actors: The clients of actions that they send goals with.
        executes: Whether they are the execute callback of an action.
    """

    topics: str
    slots: tuple[int, ...]
    timers: tuple[str, ...]
    clients: tuple[Client, ...]
    ends: tuple[Ending, ...] = tuple(Ending)
    shared: bool = False
    awaits: bool = True
    waits: bool = False
    rests: bool = False
    actors: tuple[ActionClient, ...] = ()
    executes: bool = False

    def value(self, draw: st.DrawFn, *, heard: bool) -> Value:
        """Draw a value; with a number that was heard only where there is one."""
        kinds: list[type] = [Fixed, Runs, *([Heard] if heard else []), *([Kept] if self.slots else [])]
        kind = draw(st.sampled_from(kinds if self.shared else [*kinds, Parameter]))
        if kind is Fixed:
            return Fixed(draw(NUMBERS))
        made: Value = Kept(draw(st.sampled_from(self.slots))) if kind is Kept else kind()
        return made

    def statements(
        self, draw: st.DrawFn, channels: str, *, heard: bool, deep: bool = True, rate: bool = False
    ) -> tuple[Statement, ...]:
        """Draw what a callback does; it sends on these channels only."""
        topics = [c for c in channels if c in self.topics]
        asked = [client.name for client in self.clients if client.service in channels]
        kinds: list[type] = [Say, Write, Nap, *([Keep] if self.slots else []), *([Publish] * 3 if topics else [])]
        kinds += [Cancel, Reset, Pace] if self.timers else []
        kinds += [*([] if self.shared else [SetParameter]), *([SleepRate] * 2 if rate else [])]
        kinds += [Rest] * 2 if self.rests else []
        kinds += [Feedback] * 2 if self.executes else []
        acted = [client.name for client in self.actors if client.action in channels]
        if deep:
            kinds += [*([Ask] * 2 if asked else []), *([Await] * 2 if asked and self.awaits else [])]
            kinds += [*([SendGoal] * 5 if acted else []), *([CancelGoal] * 2 if acted else [])]
            kinds += [*([CallAndWait] * 4 if asked and self.waits else []), Every, *([End] if self.ends else [])]

        def nested() -> tuple[Statement, ...]:
            return self.statements(draw, channels, heard=heard, deep=False)

        def number() -> Value:
            return self.value(draw, heard=heard)

        def of(names: Sequence[Any]) -> Any:
            return draw(st.sampled_from(names))

        def ask() -> Ask:
            client = of(asked)
            return Ask(client, number(), self.then(draw, client, channels))

        def send_goal() -> SendGoal:
            client, then = of(acted), functools.partial(self.then, draw, channels=channels)
            return SendGoal(
                client,
                number(),
                then(client) if draw(st.booleans()) else None,
                then(client),
                then(client),
            )

        def cancel_goal() -> CancelGoal:
            client = of(acted)
            return CancelGoal(client, self.then(draw, client, channels))

        make: dict[type, Callable[[], Statement]] = {
            Say: lambda: Say(number()),
            Write: lambda: Write(number()),
            Nap: lambda: Nap(of(NAPS)),
            Keep: lambda: Keep(of(self.slots), number(), draw(st.booleans())),
            Publish: lambda: Publish(of(topics), number()),
            Cancel: lambda: Cancel(of(self.timers)),
            Reset: lambda: Reset(of(self.timers)),
            Pace: lambda: Pace(of(self.timers), of(PERIODS)),
            SetParameter: lambda: SetParameter(number()),
            SleepRate: SleepRate,
            Rest: lambda: Rest(of(NAPS)),
            Ask: ask,
            Await: lambda: Await(of(asked), number()),
            CallAndWait: lambda: CallAndWait(of(asked), number()),
            SendGoal: send_goal,
            CancelGoal: cancel_goal,
            Feedback: lambda: Feedback(number()),
            Every: lambda: Every(draw(FEW), nested()),
            End: lambda: Every(draw(FEW), (*nested(), *self.ending(draw))),
        }
        return tuple(make[of(kinds)]() for _ in range(draw(MANY if deep else SOME)))

    def ending(self, draw: st.DrawFn) -> tuple[Statement, ...]:
        """Draw an end of the program; in the main thread beside another one not at an instant of that one."""
        return (*((Nap(LAST_NAP_MS),) if self.waits else ()), End(draw(st.sampled_from(self.ends))))

    def then(self, draw: st.DrawFn, name: str, channels: str) -> tuple[Statement, ...]:
        """Draw what is done with an answer."""
        asked = {client.name: client.service for client in self.clients}
        acted = {client.name: client.action for client in self.actors}
        used = {**asked, **acted}[name]
        if self.shared:
            alone = replace(self, topics="", slots=(), timers=(), executes=False)
            return alone.statements(draw, "", heard=True, deep=False)
        alone = replace(self, rests=False, executes=False)
        return alone.statements(draw, channels[channels.index(used) + 1 :], heard=True, deep=False)


def after(channel: str) -> str:
    """Return the channels that a callback may send on that something on a channel starts."""
    return CHANNELS[CHANNELS.index(channel) + 1 :]


def acting(draw: st.DrawFn, number: int, taken: Taken, groups: int) -> tuple[list[str], list[ActionClient]]:
    """Draw the actions that a node has a server of, and its clients of actions; no action has two servers."""
    actions = EARLY_ACTIONS + LATE_ACTIONS
    served = [a for a in actions if a not in taken.acted and draw(st.booleans())]
    taken.acted |= set(served)
    others = [a for a in actions if a not in served and a not in taken.actors]
    wanted = draw(st.lists(st.sampled_from(others), max_size=2, unique=True)) if others else []
    taken.actors |= set(wanted)
    return served, [ActionClient(f"g{number}{n}", a, draw(st.integers(0, groups))) for n, a in enumerate(wanted)]


@st.composite
def nodes(draw: st.DrawFn, number: int, taken: Taken, spinning: Spinning) -> tuple[Node, Loop | None]:
    """Draw a node, and what the main thread does beside a thread that spins; no service has two servers."""
    several = spinning is Spinning.MULTI
    groups = tuple(draw(st.lists(st.sampled_from(Group), min_size=int(several), max_size=2)))
    timers = [(f"t{number}{n}", draw(st.integers(0, len(groups)))) for n in range(draw(TIMERS))]
    topics = draw(st.lists(st.sampled_from(TOPICS), max_size=2))
    services = [s for s in SERVICES if s not in taken.served and draw(st.booleans())]
    taken.served |= set(services)
    wanted = draw(
        st.lists(st.sampled_from(SERVICES), min_size=int(spinning is Spinning.UNTIL), max_size=2, unique=True)
    )
    asked = [s for s in wanted if s not in taken.asked or not taken.several]
    taken.asked |= set(asked)
    clients = [Client(f"c{number}{n}", s, draw(st.integers(0, len(groups)))) for n, s in enumerate(asked)]
    ends = {
        Spinning.THREAD: (),
        Spinning.MULTI: ENDS_OF_POOL,
        Spinning.UNTIL: HARD_ENDS,
        Spinning.ASYNCIO: HARD_ENDS,
    }.get(spinning, tuple(Ending))
    to_act, actors = ([], []) if several else acting(draw, number, taken, len(groups))
    timer_names = tuple(name for name, _ in timers)
    rooms = [Room(TOPICS, tuple(range(SLOTS)), timer_names, tuple(clients), ends, actors=tuple(actors))]
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
        rooms = [Room(others[0], (0,), rooms[0].timers, others[1], (), shared=True, actors=tuple(actors))]
        beside = Room(own[0], (1,), (), own[1], MAIN_ENDS, shared=True, awaits=False, waits=True)
    elif spinning is Spinning.ASYNCIO:
        beside = replace(rooms[0], awaits=False, rests=True)
    room = rooms if several else rooms * (len(groups) + 1)

    #: What an execute callback may do; after a shutdown, no state of a goal can be published.
    executing = replace(rooms[0], executes=True, ends=tuple(how for how in ends if how is not Ending.SHUTDOWN))

    def callback(group: int, channels: str, *, heard: bool = True, answers: bool = False) -> tuple[Statement, ...]:
        its = room[group]
        if answers:  # after a shutdown, no response can be sent
            its = replace(its, ends=tuple(how for how in its.ends if how is not Ending.SHUTDOWN))
        return its.statements(draw, channels, heard=heard)

    of = [draw(st.integers(0, len(groups))) for _ in (*topics, *services)]
    node = Node(
        name=f"n{number}",
        slots=SLOTS + 1,
        timers=tuple(
            Timer(
                name,
                draw(st.sampled_from(PERIODS)),
                callback(group, CHANNELS, heard=False),
                starts=draw(st.sampled_from((True, True, True, True, True, False))),
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
                callback(group, after(service), answers=True),
                room[group].value(draw, heard=True),
                group,
            )
            for n, (service, group) in enumerate(zip(services, of[len(topics) :], strict=True))
        ),
        clients=tuple(clients),
        groups=groups,
        action_servers=tuple(
            ActionServer(
                f"e{number}{n}",
                action,
                executing.statements(draw, after(action), heard=True),
                executing.value(draw, heard=True),
                draw(st.sampled_from(Finish)),
                draw(st.booleans()),
                draw(st.integers(0, len(groups))),
            )
            for n, action in enumerate(to_act)
        ),
        action_clients=tuple(actors),
    )
    if spinning is Spinning.ASYNCIO:
        body = beside.statements(draw, CHANNELS, heard=True)
        return node, Loop("m", draw(st.sampled_from((3, 12, 100))), (*body, Rest(draw(st.sampled_from(NAPS)))))
    if spinning is not Spinning.THREAD:
        return node, None
    rate = draw(st.sampled_from((0, 50, 100, 250)))
    body = beside.statements(draw, CHANNELS, heard=True, rate=bool(rate))
    pause: Statement = SleepRate() if rate else Nap(draw(st.sampled_from(NAPS)))
    return node, Loop("m", draw(st.sampled_from((3, 12, 100))), (*body, pause), rate)


@dataclass(slots=True)
class Taken:
    """What other nodes of the program have already.

    Attributes:
        served: The services that have a server.
        asked: The services that have a client.
        acted: The actions that have a server.
        actors: The actions that have a client.
        several: Whether any process has several threads, so that the order of requests at one instant is open.
    """

    served: set[str]
    asked: set[str]
    several: bool
    acted: set[str] = field(default_factory=set)
    actors: set[str] = field(default_factory=set)


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
        turns = draw(st.sampled_from({Spinning.ONCE: (0, 3, 12), Spinning.UNTIL: (1, 5)}.get(spinning, (0,))))
        timeouts = (10, 50, 100, 333) if turns else (0, 0, 50, 333)  # only one that goes on for ever may never block
        made.append(
            Process(
                tuple(own),
                spinning,
                timeout_ms=draw(
                    st.sampled_from({Spinning.ONCE: timeouts, Spinning.ASYNCIO: PAUSES}.get(spinning, (0,)))
                ),
                turns=turns,
                loop=loop,
                threads=draw(st.integers(2, 4)) if spinning is Spinning.MULTI else 0,
            )
        )
    return Program(tuple(made), DURATION_MS)


def drawn(part: int, count: int) -> list[Program]:
    """Draw so many programs, the same ones for each part."""
    found: list[Program] = []

    @seed(part)
    @settings(
        max_examples=count,
        database=None,
        deadline=None,
        phases=[Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    @given(programs())
    def draw(program: Program) -> None:
        found.append(program)

    draw()
    return found
