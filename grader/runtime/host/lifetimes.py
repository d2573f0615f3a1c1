"""Notices when nodes, endpoints, contexts and the process itself begin and end."""

from __future__ import annotations

import contextlib
import functools
import os
import signal
import weakref
from collections.abc import Callable
from typing import Any

import rclpy.client
import rclpy.context
import rclpy.node
import rclpy.publisher
import rclpy.service
import rclpy.subscription
from rclpy.event_handler import QoSPublisherEventType, QoSSubscriptionEventType
from rclpy.impl.implementation_singleton import rclpy_implementation as _rclpy
from rclpy.qos import LivelinessPolicy

from .endpoints import ENDS_OF_TOPICS, Endpoints
from .events import ALIVE
from .node_parts import context_of, full_name_of
from .protocol import Note
from .qos import asks_for_best, finite_ns
from .ros_state import RosState, see_whole_graph

#: The signals at which rclpy shuts down its contexts, with the options that enable this.
SHUTTING_DOWN = {
    signal.SIGINT: (_rclpy.SignalHandlerOptions.ALL, _rclpy.SignalHandlerOptions.SIGINT),
    signal.SIGTERM: (_rclpy.SignalHandlerOptions.ALL, _rclpy.SignalHandlerOptions.SIGTERM),
}
#: Kind of endpoint -> the events that the middleware times on the real clock; the numbers of the two kinds overlap.
TIMED_EVENTS = {
    "publisher": (
        QoSPublisherEventType.RCL_PUBLISHER_LIVELINESS_LOST,
        QoSPublisherEventType.RCL_PUBLISHER_OFFERED_DEADLINE_MISSED,
    ),
    "subscription": (QoSSubscriptionEventType.RCL_SUBSCRIPTION_REQUESTED_DEADLINE_MISSED,),
}
#: The event of a subscription that the middleware times if its publishers have to show by themselves that they live.
LEASED_EVENT = QoSSubscriptionEventType.RCL_SUBSCRIPTION_LIVELINESS_CHANGED
#: Called with each node that was created.
ON_NODES: list[Callable[[Any], None]] = []
#: Weak references to every node that was created, oldest first; `entry` checks whether there was any.
MADE_NODES: list[weakref.ref[Any]] = []


def install_endpoints(
    ros: RosState, settle: Callable[[], None], leave: Callable[[], None], give_up: Callable[[], None]
) -> None:
    """Register every endpoint and node from now on; the functions are those of `install_traffic`."""
    kinds = {
        "publisher": rclpy.publisher.Publisher,
        "subscription": rclpy.subscription.Subscription,
        "client": rclpy.client.Client,
        "service": rclpy.service.Service,
    }
    for kind, cls in kinds.items():
        _register(ros, kind, cls, leave, give_up)
        _report_departures_first(ros, f"create_{kind}", settle)
    for kind in ENDS_OF_TOPICS:
        _settle_what_is_best(ros, kind, settle)
    note_nodes(ros.endpoints.add_node)
    _report_departures_first(ros, "__init__", settle)
    declare = rclpy.node.Node.declare_parameters

    def declared(self: Any, *args: Any, **kwargs: Any) -> Any:
        ros.endpoints.changed = True
        return declare(self, *args, **kwargs)

    rclpy.node.Node.declare_parameters = functools.wraps(declare)(declared)


def _register(ros: RosState, kind: str, cls: Any, leave: Callable[[], None], give_up: Callable[[], None]) -> None:
    make, destroy = cls.__init__, cls.destroy
    timed = TIMED_EVENTS.get(kind, ())

    def registered(self: Any, *args: Any, **kwargs: Any) -> None:
        make(self, *args, **kwargs)
        ros.endpoints.add(kind, self)
        ros.inbox.add(kind, self)
        kinds = [handler.event_type for handler in self.event_handlers] if timed else []
        # Without a lease, nothing is timed, and the middleware may tell of publishers that come and go.
        if kind == "subscription" and not _is_leased(self):
            ros.events.leave_alone(self.handle, ALIVE)
        # The middleware times deadlines and leases on the real clock, which nothing here can stop or replace.
        by_hand = kind == "subscription" and LEASED_EVENT in kinds and _is_leased(self) and _is_by_hand(self)
        if by_hand or any(event in timed for event in kinds):
            give_up()

    def destroyed(self: Any) -> None:
        # First: the middleware drops what a destroyed publisher has not delivered yet. In real time that would be a
        # matter of microseconds, and of chance.
        leave()
        ros.inbox.forget(self)
        ros.endpoints.remove()
        destroy(self)

    cls.__init__ = functools.wraps(make)(registered)
    cls.destroy = functools.wraps(destroy)(destroyed)


def _is_leased(subscription: Any) -> bool:
    return finite_ns(subscription.qos_profile.liveliness_lease_duration) > 0


def _is_by_hand(subscription: Any) -> bool:
    """Return whether the publishers of a subscription have to show that they live with each message."""
    return bool(subscription.qos_profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC)


def _report_departures_first(ros: RosState, method: str, settle: Callable[[], None]) -> None:
    """Report what has left the graph before a method of nodes adds to it."""
    create = getattr(rclpy.node.Node, method)

    @functools.wraps(create)
    def created(self: Any, *args: Any, **kwargs: Any) -> Any:
        if ros.endpoints.removed:
            settle()
        return create(self, *args, **kwargs)

    setattr(rclpy.node.Node, method, created)


def _settle_what_is_best(ros: RosState, kind: str, settle: Callable[[], None]) -> None:
    """Let a node see the whole graph before it creates an endpoint whose QoS depends on the others of the topic."""
    create = getattr(rclpy.node.Node, f"create_{kind}")

    @functools.wraps(create)
    def created(self: Any, *args: Any, **kwargs: Any) -> Any:
        if not asks_for_best((*args, *kwargs.values())):
            return create(self, *args, **kwargs)
        see_whole_graph(ros, settle)
        endpoint = create(self, *args, **kwargs)
        ros.endpoints.resolve(self, kind, endpoint)
        return endpoint

    setattr(rclpy.node.Node, f"create_{kind}", created)


def note_nodes(note: Callable[[Any], None] = lambda _: None) -> None:
    """Register every node that is created from now on; `note` is called with each after its creation."""
    create = rclpy.node.Node.__init__

    def make_node(self: Any, *args: Any, **kwargs: Any) -> None:
        MADE_NODES.append(weakref.ref(self))
        create(self, *args, **kwargs)
        note(self)
        for also in ON_NODES:
            also(self)

    rclpy.node.Node.__init__ = functools.wraps(create)(make_node)


def note_other_domains(domain: Callable[[], int], tell: Callable[[Note], None]) -> None:
    """Report the first node in each ROS domain but the grader's, which sees nothing of it.

    Args:
        domain: Returns the grader's domain.
        tell: Sends a note.
    """
    told: set[int] = set()

    def note(node: Any) -> None:
        with contextlib.suppress(Exception):  # its context may be shut down
            found = context_of(node).get_domain_id()
            if found != domain() and found not in told:
                told.add(found)
                tell(Note("other_domain", node=full_name_of(node), domain=found))

    ON_NODES.append(note)


def install_departures(
    leave: Callable[[], None], depart: Callable[[], None], remove: Callable[[], None] = lambda: None
) -> None:
    """Call `leave` before a node or a context ends, `remove` before a node does, `depart` before the process does."""

    def leaving(owner: Any, name: str, *before: Callable[[], None]) -> None:
        go = getattr(owner, name)

        @functools.wraps(go)
        def gone(*args: Any, **kwargs: Any) -> Any:
            for each in before:
                each()
            return go(*args, **kwargs)

        setattr(owner, name, gone)

    leaving(rclpy.node.Node, "destroy_node", leave, remove)
    leaving(rclpy.context.Context, "shutdown", leave)
    leaving(rclpy.context.Context, "try_shutdown", leave)
    for owner, name in ((os, "_exit"), (os, "abort"), (os, "kill"), (os, "killpg"), (signal, "raise_signal")):
        leaving(owner, name, depart)


def install_own_signals(settle: Callable[[], None]) -> None:
    """Call `settle` after the program has sent itself a signal at which rclpy shuts down, in another thread."""

    def sending(owner: Any, name: str, mine: Callable[..., bool]) -> None:
        send = getattr(owner, name)

        @functools.wraps(send)
        def sent(*args: Any) -> Any:
            try:
                return send(*args)
            finally:
                if (
                    args
                    and mine(*args)
                    and _rclpy.get_current_signal_handlers_options() in SHUTTING_DOWN.get(args[-1], ())
                ):
                    settle()

        setattr(owner, name, sent)

    sending(os, "kill", lambda *args: args[0] == os.getpid())
    sending(signal, "raise_signal", lambda *_: True)


def leave_graph(endpoints: Endpoints) -> None:
    """Destroy all remaining nodes and contexts, as the interpreter does when it exits."""
    for end in list(endpoints.actions()):
        with contextlib.suppress(Exception):
            end.handle.destroy_when_not_in_use()
    for node in endpoints.nodes():
        with contextlib.suppress(Exception):
            node.destroy_node()
    for reference in endpoints.contexts:
        context = reference()
        with contextlib.suppress(Exception):
            if context is not None:
                context.try_shutdown()
