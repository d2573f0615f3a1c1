"""The nodes, endpoints, contexts and actions of this process, and the claims that tell the grader of them."""

from __future__ import annotations

import contextlib
import weakref
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import QoSProfile

from . import originals
from .action_ends import ActionEnd, type_name
from .events import Events
from .node_parts import context_of, declared_by, ends_of, full_name_of, handle_of, name_of, seen_by
from .protocol import Claim
from .qos import described_qos

#: Topics that every node has; they are not counted.
BACKGROUND = frozenset({"/rosout", "/parameter_events"})
BACKGROUND_PARAMETERS = frozenset({"use_sim_time", "start_type_description_service"})
BACKGROUND_SERVICES = ("rcl_interfaces/", "type_description_interfaces/")
#: How long, in real time, contexts may take to shut down at a signal.
SHUTDOWN_S = 1.0
#: The kinds of endpoints of topics.
ENDS_OF_TOPICS = ("publisher", "subscription")
TRANSITION_EVENT = "lifecycle_msgs/msg/TransitionEvent"
#: Checks whether a context is valid, without counting as a look, which would let time pass.
_CONTEXT_OK = Context.ok


class Endpoints:
    """What of ROS exists in this process, oldest first.

    Every reference is weak: what the program does not hold any more is freed as it would be without the grader.

    Args:
        events: The events of discovery; those of endpoints in other ROS domains are left to the middleware.
    """

    def __init__(self, events: Events) -> None:
        self._events = events
        self._endpoints: dict[str, list[weakref.ref[Any]]] = {
            kind: [] for kind in ("publisher", "subscription", "client", "service")
        }
        self._nodes: list[weakref.ref[Any]] = []
        self.contexts: list[weakref.ref[Any]] = []
        self._actions: list[ActionEnd] = []
        #: The topics on which the state machines of lifecycle nodes publish transitions.
        self.transitions: weakref.WeakKeyDictionary[Any, str] = weakref.WeakKeyDictionary()
        #: A number for each publisher and subscription, from 1, by which the grader tells those of one topic apart.
        self.numbers: weakref.WeakKeyDictionary[Any, int] = weakref.WeakKeyDictionary()
        self._last_number = 0
        #: The QoS of endpoints that took what was best when they were created.
        self._resolved: weakref.WeakKeyDictionary[Any, QoSProfile] = weakref.WeakKeyDictionary()
        #: The ids of the handles in other ROS domains, which nobody can reach, at the last report of endpoints.
        self._elsewhere: set[int] = set()
        #: Whether the grader has to be told of them before the process goes on.
        self.changed = False
        #: Whether an endpoint or node was removed since the last report. A report must be sent before anything new is
        #: created, or the grader could take the old endpoint in the graph for the new one.
        self.removed = False

    def add(self, kind: str, endpoint: Any) -> None:
        """Register a new endpoint."""
        self._endpoints[kind].append(weakref.ref(endpoint, self._collected))
        if kind in ENDS_OF_TOPICS:
            self._last_number += 1
            self.numbers[endpoint] = self._last_number
        self.changed = True

    def resolve(self, node: Any, kind: str, endpoint: Any) -> None:
        """Look up the QoS of a new publisher or subscription of a node that asked for what is best."""
        known = seen_by(node, kind, endpoint.topic_name)
        mine = [one for one in known if (one.node_name, one.node_namespace) == name_of(node)]
        if mine:  # the middleware numbers the endpoints of a process
            newest = max(mine, key=lambda one: one.endpoint_gid[12:15])
            self._resolved[endpoint] = newest.qos_profile

    def add_node(self, node: Any) -> None:
        """Register a new node and its context."""
        self._nodes.append(weakref.ref(node, self._collected))
        self.contexts.append(weakref.ref(context_of(node)))
        self.changed = True

    def add_action(self, end: ActionEnd) -> None:
        """Register a new action server or client."""
        self._actions.append(end)
        self.changed = True

    def remove(self) -> None:
        """Note that an endpoint or node has left the graph, or is about to."""
        self.changed = self.removed = True

    def _collected(self, reference: weakref.ref[Any]) -> None:
        """Note that an endpoint or a node was freed without being destroyed."""
        del reference
        self.remove()

    def forget_action(self, end: ActionEnd) -> None:
        """Forget the server or client of an action that is being destroyed, or was freed."""
        if end in self._actions:
            self._actions.remove(end)
            self.remove()

    def alive(self, kind: str) -> list[Any]:
        """Return the endpoints of a kind that still exist, oldest first."""
        found = [(r, endpoint) for r in self._endpoints[kind] if (endpoint := r()) is not None and is_valid(endpoint)]
        self._endpoints[kind] = [reference for reference, _ in found]
        return [endpoint for _, endpoint in found]

    def nodes(self) -> list[Any]:
        """Return the nodes that still exist, oldest first."""
        alive = (reference() for reference in self._nodes)
        return [node for node in alive if node is not None and _is_valid(handle_of(node))]

    def action(self, handle: Any) -> ActionEnd | None:
        """Return the action server or client that a handle belongs to, if it still exists."""
        return next((end for end in self._actions if end.handle is handle), None)

    def actions(self) -> list[ActionEnd]:
        """Return the action servers and clients that still exist, oldest first."""
        return list(self._actions)

    def context(self) -> Any:
        """Return the newest context that is not shut down, or None."""
        contexts = (reference() for reference in reversed(self.contexts))
        return next((context for context in contexts if context is not None and context.ok()), None)

    def newest_node(self) -> Any:
        """Return the newest node that can query the graph, or None."""
        return next((node for node in reversed(self.nodes()) if _CONTEXT_OK(context_of(node))), None)

    def receivers(self, channel: str) -> list[Any]:
        """Return what receives the messages of a channel, such as `topic /x`: subscriptions, servers, or clients."""
        actions = [r for end in self._actions for r in end.receivers.values() if r.channel == channel]
        if actions:
            return actions
        kind, _, name = channel.partition(" ")
        if kind == "topic":
            return [s for s in self.alive("subscription") if s.topic_name == name]
        return [e for e in self.alive("service" if kind == "request" else "client") if service_name(e) == name]

    def handles(self) -> dict[int, Any]:
        """Return the receivers by the address of their handles, as a wait set knows them."""
        return {
            endpoint.handle.pointer: endpoint
            for kind in ("subscription", "client", "service")
            for endpoint in self.alive(kind)
        }

    def served(self) -> set[str]:
        """Return the services of the program's servers, without those that every node has."""
        servers = [s for s in self.alive("service") if not is_background(s) and not self.is_elsewhere(s.handle)]
        of_actions = (name for end in self._actions if end.kind == "service" for name in end.services())
        return {*map(service_name, servers), *of_actions}

    def claims(self, domain: int) -> list[Claim]:
        """Return the claims: a description of everything in a ROS domain."""
        self.changed = self.removed = False
        claims: list[Claim] = []
        existing = self.nodes()
        seen = [node for node in existing if is_in(domain, node)]
        elsewhere = [end.handle for node in existing if node not in seen for end in ends_of(node)]
        self._elsewhere = set(map(id, elsewhere))
        for handle in elsewhere:
            self._events.leave_alone(handle)
        for kind in ENDS_OF_TOPICS:
            for endpoint in self.alive(kind):
                if endpoint.topic_name in BACKGROUND or self.is_elsewhere(endpoint.handle):
                    continue
                qos = described_qos(self._resolved.get(endpoint, endpoint.qos_profile), kind)
                interface = type_name(endpoint.msg_type)
                claims.append(Claim(kind, endpoint.topic_name, interface, self.numbers[endpoint], qos))
        claims += [
            Claim(
                kind,
                service_name(endpoint),
                type_name(endpoint.srv_type),
                sends=described_qos(endpoint.qos_profile, "publisher"),
                takes=described_qos(endpoint.qos_profile, "subscription"),
            )
            for kind in ("client", "service")
            for endpoint in self.alive(kind)
            if (kind == "client" or not is_background(endpoint)) and not self.is_elsewhere(endpoint.handle)
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

    def await_shutdown(self) -> None:
        """Wait, in real time, until rclpy has shut down its contexts after a signal; some may not be shut down."""
        contexts = [context for reference in self.contexts if (context := reference()) is not None]
        originals.wait_until(lambda: not any(map(_CONTEXT_OK, contexts)), SHUTDOWN_S)


def is_background(endpoint: Any) -> bool:
    """Return whether a service, or a client's, is of a type that every node serves."""
    return type_name(endpoint.srv_type).startswith(BACKGROUND_SERVICES)


def is_in(domain: int, node: Any) -> bool:
    """Return whether a node is in a ROS domain; True if it is being destroyed, or its context was shut down."""
    with contextlib.suppress(Exception):
        return bool(context_of(node).get_domain_id() == domain)
    return True


def is_valid(endpoint: Any) -> bool:
    """Return whether an endpoint was not destroyed."""
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
