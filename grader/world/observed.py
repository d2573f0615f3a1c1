"""Keeps what was observed of a stepped run, and finds in it what a test asks for: messages, texts, responses, ends."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Sequence
from typing import Any

from grader.runtime.message_classes import plain_fields
from grader.runtime.model.quantities import NS_PER_S, seconds
from grader.runtime.model.trace import (
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    Offer,
    OutputLine,
    Response,
)
from grader.runtime.serialization import message_type_name
from grader.world.asking import Received
from grader.world.errors import WrongType
from grader.world.golden import KeptMessage

#: Topics that every node has, which a recording is played without, and kept without.
EVERYWHERE = ("/rosout", "/parameter_events")


def compiled_match(match: str) -> re.Pattern[str]:
    """Return a regular expression; raises ValueError if it is invalid."""
    try:
        return re.compile(match)
    except re.error as error:
        problem = str(error)
    raise ValueError(f"expected a regular expression, found {match!r} ({problem}); re.escape takes a text as it is")


class Observed:
    """What was observed so far; it only grows.

    Args:
        read: Makes an object of its class from a message of a program.

    Attributes:
        everything: All observations, in the order in which they came.
        graph: Nodes, publishers, subscriptions, servers and clients of the programs as they are now.
    """

    def __init__(self, read: Callable[[Message], Any]) -> None:
        self.everything: list[Observation] = []
        self.graph = GraphSnapshot(0, (), ())
        self._read = read
        self._messages: dict[str, list[Message]] = {}
        self._objects: dict[str, list[Received]] = {}

    def add(self, observations: Iterable[Observation]) -> None:
        """Keep what was observed next."""
        for one in observations:
            self.everything.append(one)
            if isinstance(one, Message):
                self._messages.setdefault(one.topic, []).append(one)
            elif isinstance(one, GraphSnapshot):
                self.graph = one

    def received(self, topic: str, type: Any = None) -> list[Received]:  # noqa: A002 - as in rclpy
        """Return the messages of programs on a topic; raises WrongType if one is not of the type, if one is given."""
        known = self._objects.setdefault(topic, [])
        found = self._messages.get(topic, ())
        if type is not None:
            expected = message_type_name(type)
            other = next((one.type for one in found if one.type != expected), "")
            if other:
                raise WrongType(f"{topic}: expected messages of type {expected}, found {other}")
        for one in found[len(known) :]:
            known.append(Received(seconds(one.t_ns), self._read(one)))
        return known

    def kept_messages(self, topics: Sequence[str]) -> list[KeptMessage]:
        """Return the messages of programs on some topics as a kept recording has them; all topics if none is given."""
        return [
            KeptMessage(one.t_ns, topic, one.type, plain_fields(self._read(one)))
            for topic in topics or sorted(self._messages.keys() - {*EVERYWHERE})
            for one in self._messages.get(topic, ())
        ]

    def had_publisher(self, topic: str) -> bool:
        """Return whether a program has published on a topic, or had a publisher on it."""
        graphs = (one for one in self.everything if isinstance(one, GraphSnapshot))
        return topic in self._messages or any(graph.ends_of_topics("publisher", topic) for graph in graphs)

    def rate(self, topic: str, since_ns: int) -> float:
        """Return how many messages a second programs have published on a topic since a time; 0 for fewer than two."""
        times = [one.t_ns for one in self._messages.get(topic, ()) if one.t_ns >= since_ns]
        # n - 1 gaps, not n: counting messages overstates a short time
        return (len(times) - 1) * NS_PER_S / (times[-1] - times[0]) if times and times[-1] > times[0] else 0.0

    def texts(self, pattern: re.Pattern[str], process: str | None, since: int) -> list[LogRecord | OutputLine]:
        """Return the log records and lines of output in which a regular expression is found.

        Args:
            pattern: The regular expression.
            process: Whose texts they are; None for anybody's.
            since: How many observations have been searched already.
        """
        texts = (one for one in self.everything[since:] if isinstance(one, (LogRecord, OutputLine)))
        return [one for one in texts if process in (None, one.process) and pattern.search(one.text)]

    def response(self, since: int, service: str, client: int) -> Response | None:
        """Return the response of a program to a client of the test, among the observations from a number on."""
        found = (one for one in self.everything[since:] if isinstance(one, Response))
        return next((o for o in found if (o.service, o.sender, o.client) == (service, "student", client)), None)

    def topics(self) -> dict[str, str]:
        """Return the topics that programs publish on or subscribe to, with their types."""
        return {end.topic: end.type for end in sorted(self.graph.endpoints, key=lambda end: end.topic)}

    def offers_action(self, name: str) -> bool:
        """Return whether a program offers an action, or has said that it does."""
        service = f"{name}/_action/send_goal"
        offered = (one.name for one in self.everything if isinstance(one, Offer))
        return bool(self.graph.ends_of_services("service", service)) or service in offered
