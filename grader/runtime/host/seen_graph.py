"""What this process sees of the ROS graph, and the waits until that is what the grader expects."""

from __future__ import annotations

import functools
import math
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from typing import Any

from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy

from . import originals
from .action_ends import HAS_SERVER
from .endpoints import BACKGROUND, BACKGROUND_SERVICES, ENDS_OF_TOPICS, Endpoints, service_name
from .events import ALIVE, Events
from .node_parts import handle_of
from .protocol import Counterparts

#: How long, in real time, to wait until a counterpart has disappeared.
DEPARTURE_S = 0.5


class SeenGraph:
    """The counterparts of this process's endpoints, and the graph, as its own middleware knows them.

    Discovery takes milliseconds of real time, at each process anew. Virtual time stands still until this process sees
    what the grader expects, so that what a program sends at an instant reaches the same counterparts in each run.

    Args:
        endpoints: The endpoints.
        events: The events of discovery, which the program may take once all are known.
    """

    def __init__(self, endpoints: Endpoints, events: Events) -> None:
        self._endpoints = endpoints
        self._events = events
        #: Whether the program queries the graph; if so, its view has to match the grader's.
        self.sees_graph = False
        #: Whether the program waits for an event that only the middleware can time, as has turned out.
        self.is_timed = False
        #: Counterparts, by kind and topic, that the grader does not know and that stayed when their end was awaited.
        self._strangers: dict[tuple[str, str], int] = {}

    def await_matches(self, expected: Counterparts, wait_s: float) -> list[str]:
        """Wait, in real time, until endpoints have the expected counterparts; return the names of those that do not.

        Args:
            expected: The counterparts.
            wait_s: Time-out in seconds.
        """
        matched = originals.wait_until(lambda: not self._unmatched(expected), wait_s)
        missing = [] if matched else self._unmatched(expected)
        # Endpoints also have to lose the counterparts that no longer exist.
        if not originals.wait_until(lambda: not self._surplus(expected), DEPARTURE_S):
            self._strangers.update(self._surplus(expected))
        return missing

    def await_events(self, expected: Counterparts, wait_s: float) -> list[str]:
        """Wait, in real time, until the middleware has reported all counterparts, and let the program know.

        Args:
            expected: The counterparts, as for `await_matches`.
            wait_s: Time-out in seconds.

        Returns:
            The names of the endpoints whose counterparts it has not all reported.
        """
        most = {int(number): count for number, count in expected.refused.items()}
        told = originals.wait_until(lambda: not self._untold(most), wait_s)
        untold = [] if told else self._untold(most)
        self._events.tell()
        for endpoint in self._endpoints.alive("subscription") if expected.alive else ():
            counts = expected.alive.get(str(self._endpoints.numbers[endpoint]))
            if counts:
                self._events.live(endpoint.handle, *counts)
            elif counts is not None:
                self.is_timed |= self._events.has(endpoint.handle, ALIVE)
        return untold

    def _untold(self, refused: dict[int, int]) -> list[str]:
        """Take the events of all endpoints; return the names of those that the middleware still has to tell of some.

        Args:
            refused: Number of an endpoint -> how many counterparts have been kept apart from it by their QoS.
        """
        return [
            f"{kind} {endpoint.topic_name}"
            for kind in ENDS_OF_TOPICS
            for endpoint in self._endpoints.alive(kind)
            if not self._events.has_all(
                endpoint.handle,
                matches=_matches(kind, endpoint),
                refused=refused.get(self._endpoints.numbers[endpoint], 0),
            )
        ]

    def _surplus(self, expected: Counterparts) -> dict[tuple[str, str], int]:
        """Count the counterparts, by kind and name, that neither the grader expects nor an earlier wait has found.

        A server that still sees a client that has left sends its response, which wakes all other clients.
        """
        over: Counter[tuple[str, str]] = Counter()
        for kind in ENDS_OF_TOPICS:
            for endpoint in self._endpoints.alive(kind):
                if endpoint.topic_name not in BACKGROUND:
                    over[kind, endpoint.topic_name] += _matches(kind, endpoint) or 0
        for kind, name in over:
            over[kind, name] -= sum(getattr(expected, kind).get(name, ()))
        services = expected.service
        for name in self._endpoints.served():
            over["service", name] = (self._clients_of(name) or 0) - max(services.get(name, ()), default=0)
        return {key: count for key, count in over.items() if count > self._strangers.get(key, 0)}

    def await_absence(self, services: Sequence[str], wait_s: float) -> None:
        """Wait, in real time, until clients see that the servers of some services are gone."""
        clients = [client for client in self._endpoints.alive("client") if service_name(client) in services]
        originals.wait_until(lambda: not any(_matches("client", client) for client in clients), wait_s)

    def _unmatched(self, expected: Counterparts) -> list[str]:
        missing = []
        if expected.graph is not None and self._graph() not in (None, expected.graph):
            missing.append("graph")
        missing += [
            f"client {service}"
            for service, count in expected.heard.items()
            if (servers := self._servers_of(service)) is not None and servers < count
        ]
        for kind in (*ENDS_OF_TOPICS, "client", "service"):
            names: Mapping[str, Sequence[int]] = getattr(expected, kind)
            found: dict[str, list[float]] = {}
            for endpoint in self._endpoints.alive(kind) if names else ():
                name = endpoint.topic_name if kind in ENDS_OF_TOPICS else service_name(endpoint)
                if name in names:
                    has = self._clients_of(name) if kind == "service" else _matches(kind, endpoint)
                    found.setdefault(name, []).append(math.inf if has is None else has)
            for end in self._endpoints.actions() if names and kind == "client" else ():
                if end.kind == kind and names.keys() & set(end.services()):
                    served = _asked(functools.partial(HAS_SERVER, end.handle))
                    found.setdefault(end.services()[0], []).append(math.inf if served is None else served)
            for end in self._endpoints.actions() if names and kind == "service" else ():
                for name in names.keys() & set(end.services()) if end.kind == kind else ():
                    asking = self._clients_of(name)
                    found.setdefault(name, []).append(math.inf if asking is None else asking)
            for name, matches in found.items():
                wanted = sorted(names[name], reverse=True)
                if any(has < want for has, want in zip(sorted(matches, reverse=True), wanted, strict=False)):
                    missing.append(f"{kind} {name}")
        return missing

    def _graph(self) -> dict[str, int] | None:
        """Count the graph as the newest node sees it, in the same way as the grader does; None without a node."""
        node = self._endpoints.newest_node()
        if node is None:
            return None
        handle = handle_of(node)
        with handle:
            found = Counter(
                f"node {space.rstrip('/')}/{name}" for name, space in handle.get_node_names_and_namespaces()
            )
            for topic, _ in _rclpy.rclpy_get_topic_names_and_types(handle, False):  # noqa: FBT003 - C++
                if topic not in BACKGROUND:
                    found[f"publisher {topic}"] = handle.get_count_publishers(topic)
                    found[f"subscription {topic}"] = handle.get_count_subscribers(topic)
            for service, types in _rclpy.rclpy_get_service_names_and_types(handle):
                if not types[0].startswith(BACKGROUND_SERVICES):
                    found[f"service {service}"] = handle.get_count_services(service)
                    found[f"client {service}"] = handle.get_count_clients(service)
        return {name: count for name, count in found.items() if count}

    def _clients_of(self, service: str) -> int | None:
        """Return how many clients of a service this process sees; None without a node to ask."""
        return self._ask_node(lambda handle: int(handle.get_count_clients(service)))

    def _servers_of(self, service: str) -> int | None:
        """Return how many receivers of a service's requests this process sees; None without a node to ask."""
        topic = f"rq{service}Request"
        return self._ask_node(lambda handle: len(_rclpy.rclpy_get_subscriptions_info_by_topic(handle, topic, True)))  # noqa: FBT003 - C++

    def _ask_node(self, ask: Callable[[Any], int]) -> int | None:
        node = self._endpoints.newest_node()
        if node is None:
            return None
        handle = handle_of(node)
        with handle:
            return ask(handle)


def _matches(kind: str, endpoint: Any) -> int | None:
    """Return how many counterparts an endpoint has; None if its context was shut down and it is not freed yet."""
    with endpoint.handle:
        if kind == "publisher":
            return _asked(endpoint.handle.get_subscription_count)
        if kind == "subscription":
            return _asked(endpoint.handle.get_publisher_count)
        return _asked(endpoint.handle.service_server_is_available)


def _asked(look: Callable[[], Any]) -> int | None:
    try:
        return int(look())
    except _rclpy.RCLError:
        return None
