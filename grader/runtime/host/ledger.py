"""Counts the messages that this process has sent and still expects, and lists its endpoints.

The counts only tell the grader when an instant is settled; no verdict depends on them.
"""

from __future__ import annotations

import contextlib
import functools
import math
import weakref
from collections import Counter, deque
from collections.abc import Callable, Iterable, Mapping, Sequence
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import (
    DeadlineBestAvailable,
    DurabilityPolicy,
    LivelinessLeaseDurationeBestAvailable,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from . import originals
from .action_ends import HAS_SERVER, ActionEnd, Receiver, type_name
from .events import ALIVE, Events
from .node_parts import context_of, declared_by, ends_of, full_name_of, handle_of, name_of, seen_by
from .protocol import Claim, Counterparts, EndQos

#: Topics that every node has; they are not counted.
BACKGROUND = frozenset({"/rosout", "/parameter_events"})
#: After so many messages in a row, the next one waits until they have arrived, so that no queue overflows.
MESSAGES_PER_FLUSH = 8
#: A QoS duration of at least this means infinite.
INFINITE_NS = 9_000_000_000_000_000_000
BACKGROUND_PARAMETERS = frozenset({"use_sim_time", "start_type_description_service"})
BACKGROUND_SERVICES = ("rcl_interfaces/", "type_description_interfaces/")
#: How long, in real time, to wait for an announced message before it counts as lost.
ARRIVAL_S = 1.0
#: When nothing more has come for so long, in real time, the newest of several messages has arrived: the middleware
#: delivers them some microseconds apart.
QUIET_S = 0.01
#: How long one wait of rclpy for such a message takes at most.
ONE_WAIT_NS = 10_000_000
#: How long, in real time, to wait until a counterpart has disappeared.
DEPARTURE_S = 0.5
#: A publisher that was created before so much work has been discovered, although virtual time stands still: where other
#: nodes run already, this takes some milliseconds.
DISCOVERED_NS = 200_000_000
#: How long, in real time, contexts may take to shut down at a signal.
SHUTDOWN_S = 1.0
#: Checks whether a context is valid, without counting as a look, which would let time pass.
_CONTEXT_OK = Context.ok


#: The kinds of endpoints of topics.
ENDS_OF_TOPICS = ("publisher", "subscription")
TRANSITION_EVENT = "lifecycle_msgs/msg/TransitionEvent"
REAL_WAIT_SET: Any = _rclpy.WaitSet


def await_ready(receiver: Any, context: Any, within_s: float = ARRIVAL_S) -> bool:
    """Wait, in real time, until one message can be taken from a receiver."""
    if isinstance(receiver, Receiver):
        return receiver.is_ready_within(within_s, REAL_WAIT_SET, context)
    kind = (
        "subscription"
        if hasattr(receiver, "topic_name")
        else "client"
        if hasattr(receiver, "call_async")
        else "service"
    )
    with context.handle, receiver.handle:
        wait_set = REAL_WAIT_SET(kind == "subscription", 0, 0, kind == "client", kind == "service", 0, context.handle)

        def is_ready() -> bool:
            wait_set.clear_entities()
            getattr(wait_set, f"add_{kind}")(receiver.handle)
            wait_set.wait(ONE_WAIT_NS)
            return receiver.handle.pointer in wait_set.get_ready_entities(kind)

        return originals.wait_until(is_ready, within_s, pause_s=0)


class Ledger:
    """The endpoints of one process and the traffic on them.

    Args:
        await_ready: Waits for a message; see `await_ready`.
        pause: Lets some seconds of real time pass.
    """

    def __init__(
        self, await_ready: Callable[..., bool] = await_ready, pause: Callable[[float], None] = originals.sleep
    ) -> None:
        self._await_ready = await_ready
        self._pause = pause
        self.sent: Counter[str] = Counter()
        #: How many of them were sent before anybody could have discovered their publisher.
        self.early: Counter[str] = Counter()
        #: For each publisher that was created since the program last waited, how much it had worked then.
        self._fresh: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        #: The services that every node has, as long as nobody has called them: waiting for them would take a third of
        #: an executor's time. How many are waited for by now; a wait set that was made before lacks the latest.
        self._left_out: weakref.WeakSet[Any] = weakref.WeakSet()
        self.included = 0
        self._expected: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._kept: weakref.WeakKeyDictionary[Any, deque[Any]] = weakref.WeakKeyDictionary()
        self._heard_on: set[str] = set()
        self._successors: weakref.WeakSet[Any] = weakref.WeakSet()
        self._endpoints: dict[str, list[weakref.ref[Any]]] = {
            kind: [] for kind in ("publisher", "subscription", "client", "service")
        }
        self.changed = False
        #: Whether the program queries the graph; if so, its view has to match the grader's.
        self.sees_graph = False
        #: Whether an endpoint or node was removed since the last report. A report must be sent before anything new is
        #: created, or the grader could take the old endpoint in the graph for the new one.
        self.removed = False
        #: How many messages were sent since `must_settle` last said so.
        self._in_a_row = 0
        #: Handles that have sent messages which may not have arrived yet; they are kept alive until then.
        self._sending: dict[int, Any] = {}
        #: Counterparts, by kind and topic, that the grader does not know and that stayed when their end was awaited.
        self._strangers: dict[tuple[str, str], int] = {}
        #: The ids of the handles in other ROS domains, which nobody can reach, at the last report of endpoints.
        self._elsewhere: set[int] = set()
        self.lost: Counter[str] = Counter()
        #: How many wait sets wait for a receiver now, by the address of its handle: its messages are read at once.
        self.awaited: Counter[int] = Counter()
        self.contexts: list[weakref.ref[Any]] = []
        self._nodes: list[weakref.ref[Any]] = []
        self._actions: list[ActionEnd] = []
        #: A number for each publisher and subscription, from 1, by which the grader tells those of one topic apart.
        self.numbers: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._last_number = 0
        #: The QoS of endpoints that took what was best when they were created.
        self._resolved: weakref.WeakKeyDictionary[Any, QoSProfile] = weakref.WeakKeyDictionary()
        self.events = Events()
        #: Whether the program waits for an event that only the middleware can time, as has turned out.
        self.is_timed = False
        #: The topics on which the state machines of lifecycle nodes publish transitions.
        self.transitions: weakref.WeakKeyDictionary[Any, str] = weakref.WeakKeyDictionary()

    def add(self, kind: str, endpoint: Any) -> None:
        """Register a new endpoint."""
        self._endpoints[kind].append(weakref.ref(endpoint, self._collected))
        if kind in ENDS_OF_TOPICS:
            self._last_number += 1
            self.numbers[endpoint] = self._last_number
        if kind == "subscription":
            if endpoint.topic_name in self._heard_on:
                self._successors.add(endpoint)
            self._heard_on.add(endpoint.topic_name)
        if kind == "service" and _is_background(endpoint):
            endpoint._executor_event = True  # executors leave it out, until a request is announced
            self._left_out.add(endpoint)
        self.changed = True

    def _include(self, receiver: Any) -> None:
        """Let executors wait for a service that they have left out so far."""
        if receiver in self._left_out:
            self._left_out.remove(receiver)
            receiver._executor_event = False
            self.included += 1

    def resolve(self, node: Any, kind: str, endpoint: Any) -> None:
        """Look up the QoS of a new publisher or subscription of a node that asked for what is best."""
        known = seen_by(node, kind, endpoint.topic_name)
        mine = [one for one in known if (one.node_name, one.node_namespace) == name_of(node)]
        if mine:  # the middleware numbers the endpoints of a process
            newest = max(mine, key=lambda one: one.endpoint_gid[12:15])
            self._resolved[endpoint] = newest.qos_profile

    def forget(self, endpoint: Any) -> None:
        """Discard the expected messages of an endpoint that is being destroyed."""
        self._expected.pop(endpoint, None)
        self._kept.pop(endpoint, None)
        self.remove()

    def remove(self) -> None:
        """Note that an endpoint or node has left the graph, or is about to."""
        self.changed = self.removed = True

    def _collected(self, reference: weakref.ref[Any]) -> None:
        """Note that an endpoint or a node was freed without being destroyed."""
        del reference
        self.remove()

    def note_created(self, publisher: Any, work_ns: int) -> None:
        """Note a new publisher, unless who discovers it later gets its messages as well."""
        if not is_latched(publisher):
            self._fresh[publisher.handle] = work_ns

    def note_waited(self) -> None:
        """Note that the program waits, or knows of the graph: whoever is there has discovered its publishers."""
        self._fresh.clear()

    def must_settle(self) -> bool:
        """Count a message that is about to be sent, and return whether the grader has to know something before it."""
        self._in_a_row += 1
        if not self.changed and self._in_a_row < MESSAGES_PER_FLUSH:
            return False
        self._in_a_row = 0
        return True

    def note_sent(self, channel: str, handle: Any, work_ns: int) -> None:
        """Count one message, and keep its sender alive until the message has arrived.

        Args:
            channel: Where it is sent.
            handle: The handle of its sender.
            work_ns: How much processor time the program has used so far.
        """
        self.sent[channel] += 1
        if handle in self._fresh and work_ns - self._fresh[handle] < DISCOVERED_NS:
            self.early[channel] += 1
        self._sending[id(handle)] = handle

    @property
    def sending(self) -> bool:
        """Whether a sent message may not have arrived yet."""
        return bool(self._sending)

    @property
    def sending_and_removed(self) -> bool:
        """Whether an endpoint or node was removed while a sent message may not have arrived yet."""
        return self.removed and bool(self._sending)

    def settled(self) -> None:
        """Note that everything sent has arrived."""
        self._sending.clear()

    def add_action(self, end: ActionEnd) -> None:
        """Register a new action server or client."""
        self._actions.append(end)
        self.changed = True

    def action(self, handle: Any) -> ActionEnd | None:
        """Return the action server or client that a handle belongs to, if it still exists."""
        return next((end for end in self._actions if end.handle is handle), None)

    def actions(self) -> list[ActionEnd]:
        """Return the action servers and clients that still exist, oldest first."""
        return list(self._actions)

    def forget_action(self, end: ActionEnd) -> None:
        """Discard the expected messages of an action server or client that is being destroyed, or was freed."""
        if end in self._actions:
            self._actions.remove(end)
            for receiver in end.receivers.values():
                self._expected.pop(receiver, None)
            self.remove()

    def alive(self, kind: str) -> list[Any]:
        """Return the endpoints of a kind that still exist, oldest first."""
        found = [(r, endpoint) for r in self._endpoints[kind] if (endpoint := r()) is not None and _valid(endpoint)]
        self._endpoints[kind] = [reference for reference, _ in found]
        return [endpoint for _, endpoint in found]

    def claims(self, domain: int) -> list[Claim]:
        """Return the claims: a description of everything in a ROS domain."""
        self.changed = self.removed = False
        claims: list[Claim] = []
        existing = self.nodes()
        seen = [node for node in existing if is_in(domain, node)]
        elsewhere = [end.handle for node in existing if node not in seen for end in ends_of(node)]
        self._elsewhere = set(map(id, elsewhere))
        for handle in elsewhere:
            self.events.leave_alone(handle)
        for kind in ENDS_OF_TOPICS:
            for endpoint in self.alive(kind):
                if endpoint.topic_name in BACKGROUND or self.is_elsewhere(endpoint.handle):
                    continue
                qos = _qos(self._resolved.get(endpoint, endpoint.qos_profile), kind)
                interface = type_name(endpoint.msg_type)
                claims.append(Claim(kind, endpoint.topic_name, interface, self.numbers[endpoint], qos))
        claims += [
            Claim(
                kind,
                service_name(endpoint),
                type_name(endpoint.srv_type),
                sends=_qos(endpoint.qos_profile, "publisher"),
                takes=_qos(endpoint.qos_profile, "subscription"),
            )
            for kind in ("client", "service")
            for endpoint in self.alive(kind)
            if (kind == "client" or not _is_background(endpoint)) and not self.is_elsewhere(endpoint.handle)
        ]
        claims += [claim for end in self._actions for claim in end.claims()]
        nodes = [full_name_of(node) for node in seen]
        claims += [Claim("node", name, "") for name in nodes]
        claims += [
            Claim("publisher", topic, TRANSITION_EVENT)  # of a lifecycle state machine: no rclpy publisher
            for topic in self.transitions.values()
            if topic.rpartition("/")[0] in nodes
        ]
        return claims + [claim for node in seen for claim in parameters_of(node)]

    def is_elsewhere(self, handle: Any) -> bool:
        """Return whether an endpoint's handle is in another ROS domain than the grader."""
        return id(handle) in self._elsewhere

    def nodes(self) -> list[Any]:
        """Return the nodes that still exist, oldest first."""
        alive = (reference() for reference in self._nodes)
        return [node for node in alive if node is not None and _is_valid(handle_of(node))]

    def add_node(self, node: Any) -> None:
        """Register a new node and its context."""
        self._nodes.append(weakref.ref(node, self._collected))
        self.contexts.append(weakref.ref(context_of(node)))
        self.changed = True

    def expect(self, arrivals: Mapping[str, int]) -> None:
        """Add messages that the grader has announced, and wait until they have arrived."""
        overflows = False
        for channel, count in arrivals.items():
            for receiver in self._receivers(channel):
                of_action = isinstance(receiver, Receiver)
                if not of_action:
                    self._include(receiver)
                depth = receiver.depth if of_action else _depth(receiver)
                before = self._expected.get(receiver, 0)
                if of_action or not channel.startswith("topic "):
                    # What the queue has dropped never comes. Of a status only the last counts.
                    self._expected[receiver] = min(before + count, depth)
                    overflows |= before + count > depth > 1
                    continue
                expected = before + min(count, depth)
                self._expected[receiver] = expected
                # If older messages were left unread, readiness does not show that the newest has arrived.
                unread = expected > 1 or depth == 1 or self.kept(receiver)
                if unread and not self.awaited[receiver.handle.pointer]:
                    self._keep_all(receiver, more=before + count > depth)
        self.await_arrivals(list(self._expected))
        if overflows:
            self._pause(QUIET_S)  # or which requests are dropped would depend on when the newest arrive

    def _keep_all(self, subscription: Any, *, more: bool) -> None:
        """Take all expected messages of a subscription that no wait set reads, and keep as many as its queue holds.

        Args:
            subscription: The subscription.
            more: Whether more were sent than its queue holds. How many of them the middleware has dropped cannot be
                known, so an older one may be there while the newest is still on its way: none may come for a while.
        """
        kept = self._kept.setdefault(subscription, deque(maxlen=_depth(subscription)))

        def take() -> None:
            with subscription.handle:
                found = subscription.handle.take_message(subscription.msg_type, subscription.raw)
            if found is not None:
                kept.append(found)

        while self._expected.get(subscription, 0) > 0 and self.await_arrivals([subscription]):
            take()
            self._expected[subscription] -= 1
        context = self._context() if more else None
        while context is not None and _valid(subscription) and self._await_ready(subscription, context, QUIET_S):
            take()

    def kept(self, subscription: Any) -> deque[Any]:
        """Return the messages that were taken for a subscription ahead of time, oldest first."""
        return self._kept.get(subscription) or deque()

    def took(self, receiver: Any) -> None:
        """Note that one message was taken from a subscription, client or service."""
        # negative if a message is taken before it was announced, as a node's own messages are
        self._expected[receiver] = self._expected.get(receiver, 0) - 1

    def await_arrivals(self, receivers: list[Any]) -> bool:
        """Wait, in real time, until everything expected by some receivers can be taken; return whether any can be."""
        arrived = False
        context = self._context()
        for receiver in receivers:
            if self._expected.get(receiver, 0) <= 0 or not _valid(receiver) or context is None:
                continue
            if self._await_ready(receiver, context):
                arrived = True
            else:
                # a subscription that replaced another may have missed messages in between, as in any ROS system
                if receiver not in self._successors:
                    self.lost[_channel(receiver)] += self._expected[receiver]
                self._expected[receiver] = 0
        return arrived

    def keeps_anything(self) -> bool:
        """Return whether any message was taken ahead of time and is still kept."""
        return len(self._kept) > 0 and any(self._kept.values())

    def may_be_pushed_out(self, subscription: Any) -> bool:
        """Return whether this process has sent messages, not announced yet, after others that are kept."""
        return bool(self.kept(subscription)) and self.sent[f"topic {subscription.topic_name}"] > 0

    def expects_anything(self) -> bool:
        """Return whether any message is expected."""
        return len(self._expected) > 0 and any(count > 0 for count in self._expected.values())

    def _context(self) -> Any:
        contexts = (reference() for reference in reversed(self.contexts))
        return next((context for context in contexts if context is not None and context.ok()), None)

    def await_shutdown(self) -> None:
        """Wait, in real time, until rclpy has shut down its contexts after a signal; some may not be shut down."""
        contexts = [context for reference in self.contexts if (context := reference()) is not None]
        originals.wait_until(lambda: not any(map(_CONTEXT_OK, contexts)), SHUTDOWN_S)

    def handles(self) -> dict[int, Any]:
        """Return the receivers by the address of their handles, as a wait set knows them."""
        return {
            endpoint.handle.pointer: endpoint
            for kind in ("subscription", "client", "service")
            for endpoint in self.alive(kind)
        }

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
        self.events.tell()
        for endpoint in self.alive("subscription") if expected.alive else ():
            counts = expected.alive.get(str(self.numbers[endpoint]))
            if counts:
                self.events.live(endpoint.handle, *counts)
            elif counts is not None:
                self.is_timed |= self.events.has(endpoint.handle, ALIVE)
        return untold

    def _untold(self, refused: dict[int, int]) -> list[str]:
        """Take the events of all endpoints; return the names of those that the middleware still has to tell of some.

        Args:
            refused: Number of an endpoint -> how many counterparts have been kept apart from it by their QoS.
        """
        return [
            f"{kind} {endpoint.topic_name}"
            for kind in ENDS_OF_TOPICS
            for endpoint in self.alive(kind)
            if not self.events.has_all(
                endpoint.handle, matches=_matches(kind, endpoint), refused=refused.get(self.numbers[endpoint], 0)
            )
        ]

    def _surplus(self, expected: Counterparts) -> dict[tuple[str, str], int]:
        """Count the counterparts, by kind and name, that neither the grader expects nor an earlier wait has found.

        A server that still sees a client that has left sends its response, which wakes all other clients.
        """
        over: Counter[tuple[str, str]] = Counter()
        for kind in ENDS_OF_TOPICS:
            for endpoint in self.alive(kind):
                if endpoint.topic_name not in BACKGROUND:
                    over[kind, endpoint.topic_name] += _matches(kind, endpoint) or 0
        for kind, name in over:
            over[kind, name] -= sum(getattr(expected, kind).get(name, ()))
        services = expected.service
        for name in self._served():
            over["service", name] = (self._clients_of(name) or 0) - max(services.get(name, ()), default=0)
        return {key: count for key, count in over.items() if count > self._strangers.get(key, 0)}

    def _served(self) -> set[str]:
        """Return the services of the program's servers, without those that every node has."""
        servers = [s for s in self.alive("service") if not _is_background(s) and not self.is_elsewhere(s.handle)]
        of_actions = (name for end in self._actions if end.kind == "service" for name in end.services())
        return {*map(service_name, servers), *of_actions}

    def await_absence(self, services: Sequence[str], wait_s: float) -> None:
        """Wait, in real time, until clients see that the servers of some services are gone."""
        clients = [client for client in self.alive("client") if service_name(client) in services]
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
        for kind in self._endpoints:
            names: Mapping[str, Sequence[int]] = getattr(expected, kind)
            found: dict[str, list[float]] = {}
            for endpoint in self.alive(kind) if names else ():
                name = endpoint.topic_name if kind in ENDS_OF_TOPICS else service_name(endpoint)
                if name in names:
                    has = self._clients_of(name) if kind == "service" else _matches(kind, endpoint)
                    found.setdefault(name, []).append(math.inf if has is None else has)
            for end in self._actions if names and kind == "client" else ():
                if end.kind == kind and names.keys() & set(end.services()):
                    served = _asked(functools.partial(HAS_SERVER, end.handle))
                    found.setdefault(end.services()[0], []).append(math.inf if served is None else served)
            for end in self._actions if names and kind == "service" else ():
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
        node = self._node()
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
        node = self._node()
        if node is None:
            return None
        handle = handle_of(node)
        with handle:
            return ask(handle)

    def _node(self) -> Any:
        """Return the newest node that can query the graph, or None."""
        return next((node for node in reversed(self.nodes()) if _CONTEXT_OK(context_of(node))), None)

    def _receivers(self, channel: str) -> list[Any]:
        actions = [r for end in self._actions for r in end.receivers.values() if r.channel == channel]
        if actions:
            return actions
        kind, _, name = channel.partition(" ")
        if kind == "topic":
            return [s for s in self.alive("subscription") if s.topic_name == name]
        return [e for e in self.alive("service" if kind == "request" else "client") if service_name(e) == name]


def _is_background(endpoint: Any) -> bool:
    """Return whether a service, or a client's, is of a type that every node serves."""
    return type_name(endpoint.srv_type).startswith(BACKGROUND_SERVICES)


def is_in(domain: int, node: Any) -> bool:
    """Return whether a node is in a ROS domain; True if it is being destroyed, or its context was shut down."""
    with contextlib.suppress(Exception):
        return bool(context_of(node).get_domain_id() == domain)
    return True


def _valid(endpoint: Any) -> bool:
    return _is_valid(endpoint.handle)


def _is_valid(handle: Any) -> bool:
    try:
        with handle:
            return True
    except _rclpy.InvalidHandle:
        return False


def parameters_of(node: Any) -> list[Claim]:
    """Return the parameters that a node has declared, without those that every node has."""
    own = full_name_of(node)
    return [
        Claim("parameter", f"{own}:{name}", repr(parameter.value)[:200])
        for name, parameter in sorted(declared_by(node).items())
        if name not in BACKGROUND_PARAMETERS
    ]


def service_name(endpoint: Any) -> str:
    """Return the resolved name of a service or client."""
    with endpoint.handle:
        name = endpoint.handle.service_name if hasattr(endpoint.handle, "service_name") else endpoint.handle.name
    return str(name)


def _channel(receiver: Any) -> str:
    return str(receiver.topic_name) if hasattr(receiver, "topic_name") else service_name(receiver)


def is_latched(publisher: Any) -> bool:
    """Return whether who discovers a publisher later gets its last messages as well."""
    return _qos(publisher.qos_profile, "publisher").latched


def asks_for_best(values: Iterable[Any]) -> bool:
    """Return whether one of some arguments is a QoS profile that depends on the endpoints that exist already."""
    profiles = [value for value in values if isinstance(value, QoSProfile)]
    return any(
        profile.reliability == ReliabilityPolicy.BEST_AVAILABLE
        or profile.durability == DurabilityPolicy.BEST_AVAILABLE
        or profile.liveliness == LivelinessPolicy.BEST_AVAILABLE
        or profile.deadline == DeadlineBestAvailable
        or profile.liveliness_lease_duration == LivelinessLeaseDurationeBestAvailable
        for profile in profiles
    )


def _qos(qos: Any, kind: str) -> EndQos:
    """Describe the QoS of a publisher or subscription, as far as it decides who is matched."""
    writes = kind == "publisher"
    # a service that asks for what is best gets the usual
    reliable = qos.reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_AVAILABLE)
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    # the defaults of DDS: a writer is reliable and transient local, a reader is neither
    if qos.reliability in (ReliabilityPolicy.SYSTEM_DEFAULT, ReliabilityPolicy.UNKNOWN):
        reliable = writes
    if qos.durability in (DurabilityPolicy.SYSTEM_DEFAULT, DurabilityPolicy.UNKNOWN):
        latched = writes
    return EndQos(
        reliable,
        latched,
        finite_ns(qos.deadline),
        manual=qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC,
        lease_ns=finite_ns(qos.liveliness_lease_duration),
    )


def finite_ns(duration: Any) -> int:
    """Return a QoS duration in nanoseconds; 0 for an infinite one, which means that none is set."""
    nanoseconds = int(duration.nanoseconds)
    return nanoseconds if 0 < nanoseconds < INFINITE_NS else 0


def _depth(receiver: Any) -> int:
    depth = getattr(receiver.qos_profile, "depth", 1)
    return max(1, int(depth))


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
