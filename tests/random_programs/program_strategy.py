"""Draws random programs, in which nothing depends on what rclpy leaves open.

What sends to whom has no circle: a callback that something on one channel starts sends on later channels only. Topics
come before services.
"""

from __future__ import annotations

from hypothesis import strategies as st
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
    Kept,
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

TOPICS, SERVICES = "abcd", "pq"
#: Short ones that coincide, and ones that do not.
PERIODS = (50, 100, 100, 125, 200, 250, 300, 470)
NAPS = (7, 30, 50, 100, 120, 260)
DURATION_MS = 2000
SLOTS = 2


def values(*, heard: bool) -> st.SearchStrategy[Value]:
    """Draw a value; with a number that was heard only where there is one."""
    return st.one_of(
        st.integers(-3, 9).map(Fixed),
        st.just(Runs()),
        *([st.just(Heard())] if heard else []),
        st.integers(0, SLOTS - 1).map(Kept),
    )


class Draw:
    """Draws what callbacks of one node do.

    Args:
        timers: The names of its timers.
        clients: Its clients.
        several: Whether the process has other callbacks that must go on while one of them sleeps.
    """

    def __init__(self, timers: tuple[str, ...], clients: tuple[Client, ...]) -> None:
        self.timers, self.clients = timers, clients

    def statements(self, channels: str, *, heard: bool, deep: bool) -> st.SearchStrategy[tuple[Statement, ...]]:
        """Draw what a callback does; it sends on these channels only."""
        value = values(heard=heard)
        kinds: list[st.SearchStrategy[Statement]] = [
            st.builds(Say, value),
            st.builds(Write, value),
            st.builds(Keep, st.integers(0, SLOTS - 1), value, st.booleans()),
            st.builds(Nap, st.sampled_from(NAPS)),
        ]
        if topics := [c for c in channels if c in TOPICS]:
            kinds += [st.builds(Publish, st.sampled_from(topics), value)] * 3
        if self.timers:
            timers = st.sampled_from(self.timers)
            kinds += [st.builds(Cancel, timers), st.builds(Reset, timers)]
            kinds += [st.builds(Pace, timers, st.sampled_from(PERIODS))]
        asked = [client for client in self.clients if client.service in channels]
        if asked and deep:
            kinds += [self.question(client, channels, value) for client in asked]
        if deep:
            inner = self.statements(channels, heard=heard, deep=False)
            ends = st.sampled_from(Ending).map(lambda how: (End(how),))
            kinds += [st.builds(Every, st.integers(2, 5), inner)]
            kinds += [st.builds(lambda n, i, e: Every(n, i + e), st.integers(3, 9), inner, ends)]
        return st.lists(st.one_of(kinds), max_size=4 if deep else 2).map(tuple)

    def question(self, client: Client, channels: str, value: st.SearchStrategy[Value]) -> st.SearchStrategy[Statement]:
        """Draw a call of a service, and what is done with the answer."""
        later = channels[channels.index(client.service) + 1 :]
        return st.builds(Ask, st.just(client.name), value, self.statements(later, heard=True, deep=False))


@st.composite
def nodes(draw: st.DrawFn, number: int, served: frozenset[str]) -> Node:
    """Draw a node; it serves no service that another one does."""
    everything = TOPICS + SERVICES
    timers = tuple(f"t{number}{n}" for n in range(draw(st.integers(0, 3))))
    topics = draw(st.lists(st.sampled_from(TOPICS), max_size=2))
    services = draw(st.lists(st.sampled_from(SERVICES), max_size=1).map(lambda s: [x for x in s if x not in served]))
    asked = draw(st.lists(st.sampled_from(SERVICES), max_size=2, unique=True))
    clients = tuple(Client(f"c{number}{n}", service) for n, service in enumerate(asked))
    does = Draw(timers, clients)

    def after(channel: str) -> st.SearchStrategy[tuple[Statement, ...]]:
        return does.statements(everything[everything.index(channel) + 1 :], heard=True, deep=True)

    return Node(
        name=f"n{number}",
        slots=SLOTS,
        timers=tuple(
            Timer(
                name,
                draw(st.sampled_from(PERIODS)),
                draw(does.statements(everything, heard=False, deep=True)),
                starts=draw(st.sampled_from((True, True, True, False))),
            )
            for name in timers
        ),
        subscriptions=tuple(
            Subscription(f"s{number}{n}", topic, draw(st.sampled_from((1, 2, 10))), draw(after(topic)))
            for n, topic in enumerate(topics)
        ),
        servers=tuple(
            Server(f"v{number}{n}", service, draw(after(service)), draw(values(heard=True)))
            for n, service in enumerate(services)
        ),
        clients=clients,
    )


@st.composite
def programs(draw: st.DrawFn) -> Program:
    """Draw a program."""
    made: list[Process] = []
    served: frozenset[str] = frozenset()
    number = 0
    for _ in range(draw(st.integers(1, 3))):
        spinning = draw(st.sampled_from(Spinning))
        own = []
        for _ in range(draw(st.integers(1, 2)) if spinning is Spinning.EXECUTOR else 1):
            node = draw(nodes(number, served))
            served |= {server.service for server in node.servers}
            number += 1
            own.append(node)
        once = spinning is Spinning.ONCE
        timeout = draw(st.sampled_from((10, 50, 100, 333))) if once else 0
        turns = draw(st.sampled_from((0, 3, 12))) if once else 0
        made.append(Process(tuple(own), spinning, timeout, turns))
    return Program(tuple(made), DURATION_MS)
