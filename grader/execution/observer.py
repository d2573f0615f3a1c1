"""The grader's own node: sees the graph, takes every message the students' nodes publish, publishes stimuli.

The only module of the grader's own processes that uses rclpy. It has no services, no parameters and no callbacks, and
never waits for an executor: messages are taken when the conductor asks for them.
"""

from __future__ import annotations

import contextlib
import secrets
import time
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message

from grader.core.limits import Limits
from grader.core.quantities import MIB, size
from grader.core.trace import Endpoint, GraphSnapshot
from grader.execution.console import TEXT_CHARACTERS, Logged
from grader.execution.interfaces import message_class, plain_fields
from grader.execution.service_ends import BACKGROUND_TYPES, ServiceEnds

LOG_TYPE = "rcl_interfaces/msg/Log"
BACKGROUND = frozenset({"/rosout", "/parameter_events"})
#: Deep enough for everything that can be published between two looks.
DEPTH = 5000
#: What is taken at once at most; the rest is taken the next time.
AT_ONCE, AT_ONCE_BYTES = 1000, 4 * MIB
#: Topics whose trouble is told at the end, and how much of a name.
TOLD, NAME_CHARACTERS = 20, 200
#: Durations of QoS policies from here on mean for ever.
INFINITE_NS = 9_000_000_000_000_000_000
#: How long, in real time, what a process sent before it died is waited for, and how many looks must find nothing.
REST_S, QUIET_LOOKS, QUIET_PAUSE_S = 0.5, 4, 0.005
#: What rclpy calls a node whose endpoints are known but whose name is not yet, or not any more.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"


#: Participants of the grader's at most, and how long the name of a new one is waited for.
PARTICIPANTS, NAME_S = 8, 2.0


@dataclass(frozen=True, slots=True)
class Taken:
    """One message as it came: topic, type, bytes and decoded fields."""

    topic: str
    type: str
    cdr: bytes
    value: Mapping[str, Any]


class Observer:
    """A node in a context of its own, and a few more where topics have several types.

    Args:
        domain: ROS domain to join.
        limits: How large a message may be whose content is read.
    """

    def __init__(self, domain: int, limits: Limits) -> None:
        self._limits = limits
        self._domain = domain
        self.node = _make_node(domain)
        self._nodes = [self.node]
        self._names = {self.node.get_name()}
        self._readers: dict[tuple[str, str, bool], Any] = {}
        self._writers: dict[str, Any] = {}
        self._participants: dict[bytes, int] = {}
        self._logs: Any = None
        self.services = ServiceEnds(self.node)
        self._broken: Counter[str] = Counter()
        self._large: Counter[str] = Counter()

    def close(self) -> None:
        """Leave the graph."""
        for node in self._nodes:
            node.destroy_node()
            node.context.shutdown()

    def _make(self, create: Callable[[Node], Any]) -> Any:
        """Make an endpoint, beside the others if its topic has another type there: a participant takes only one.

        Raises:
            RCLError: It cannot be made at all.
        """
        for node in self._nodes:
            try:
                return create(node)
            except rclpy_implementation.RCLError:  # noqa: PERF203 - the first one nearly always does
                if len(self._nodes) >= PARTICIPANTS:
                    raise
        other = _make_node(self._domain)
        self._nodes.append(other)
        self._names.add(other.get_name())
        # Until its name is known, its endpoints would be taken for a student's.
        wait_until(lambda: other.get_name() in self.node.get_node_names(), NAME_S)
        return create(other)

    def graph(self, t_ns: int, *, services: bool = False) -> GraphSnapshot:
        """Return the live graph without the grader's own node, everything sorted.

        An endpoint comes before the name of its node, and goes after it; without that name it is left out.

        Args:
            t_ns: What time it is.
            services: Whether to look at services as well, which costs something.
        """
        names = [
            pair for pair in self.node.get_node_names_and_namespaces() if pair[0] not in {*self._names, UNKNOWN_NODE}
        ]
        nodes = sorted({_full_name(name, space) for name, space in names})
        offered = self.services.graph(sorted(set(names))) if services else ()
        ends = []
        for topic, _ in sorted(self.node.get_topic_names_and_types(no_demangle=False)):
            if topic in BACKGROUND:
                continue
            ends += [self._endpoint("publisher", topic, info) for info in self.node.get_publishers_info_by_topic(topic)]
            ends += [
                self._endpoint("subscription", topic, info) for info in self.node.get_subscriptions_info_by_topic(topic)
            ]
        students = [e for e in ends if e.participant >= 0 and UNKNOWN_NODE not in e.node]
        return GraphSnapshot(t_ns, tuple(nodes), tuple(sorted(students, key=_endpoint_order)), offered)

    def participants(self) -> int:
        """Return how many participants with endpoints of their own have appeared, without the grader's."""
        return len(self._participants)

    def _endpoint(self, kind: str, topic: str, info: Any) -> Endpoint:
        own = info.node_name in self._names
        prefix = bytes(info.endpoint_gid[:12])
        number = -1 if own else self._participants.setdefault(prefix, len(self._participants))
        latched = info.qos_profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
        manual = info.qos_profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
        best_effort = info.qos_profile.reliability == ReliabilityPolicy.BEST_EFFORT
        return Endpoint(
            kind=kind,
            topic=topic,
            type=info.topic_type,
            node=_full_name(info.node_name, info.node_namespace),
            participant=number,
            reliability="best_effort" if best_effort else "reliable",
            durability="transient_local" if latched else "volatile",
            deadline_ns=_finite_ns(info.qos_profile.deadline),
            liveliness="manual_by_topic" if manual else "automatic",
        )

    def watch(self, graph: GraphSnapshot) -> list[str]:
        """Subscribe to every topic that a student's node publishes; return topics whose type is unknown here."""
        unknown = []
        for end in graph.endpoints:
            key = (end.topic, end.type, end.reliability == "reliable")
            if end.kind != "publisher" or key in self._readers:
                continue
            message = message_class(end.type)
            if message is None:
                unknown.append(f"{end.topic} [{end.type}]")
                continue
            reliability = ReliabilityPolicy.RELIABLE if key[2] else ReliabilityPolicy.BEST_EFFORT
            qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=DEPTH, reliability=reliability)
            self._readers[key] = self._make(_subscribing(message, end.topic, qos))
        return unknown

    def reads(self, topic: str) -> bool:
        """Return whether messages on a topic can be taken here."""
        return any(name == topic for name, _, _ in self._readers)

    def watching(self, topic: str, interface: str) -> list[bool]:
        """Return the subscriptions on a topic and type: for each, whether it asks for reliability."""
        return [reliable for name, kind, reliable in self._readers if (name, kind) == (topic, interface)]

    def publishes(self, topic: str) -> bool:
        """Return whether a stimulus is published on a topic now."""
        return topic in self._writers

    def students_nodes(self) -> list[str]:
        """Return the names of the students' nodes that are in the graph, each as often as it is there."""
        pairs = self.node.get_node_names_and_namespaces()
        return [_full_name(*pair) for pair in pairs if pair[0] not in {*self._names, UNKNOWN_NODE}]

    def ends_of(self, kind: str, service: str) -> int:
        """Return how many servers (`service`) or clients (`client`) of a service there are, with the grader's own."""
        count = self.node.count_services if kind == "service" else self.node.count_clients
        return int(count(service))

    def counts(self) -> dict[str, int]:
        """Return how many endpoints and nodes of each name any node sees in the graph now, with the grader's own."""
        found = Counter(f"node {_full_name(*pair)}" for pair in self.node.get_node_names_and_namespaces())
        for topic, _ in self.node.get_topic_names_and_types():
            if topic not in BACKGROUND:
                found[f"publisher {topic}"] = self.node.count_publishers(topic)
                found[f"subscription {topic}"] = self.node.count_subscribers(topic)
        for service, types in self.node.get_service_names_and_types():
            if not types[0].startswith(BACKGROUND_TYPES):
                found[f"service {service}"] = self.node.count_services(service)
                found[f"client {service}"] = self.node.count_clients(service)
        return {name: count for name, count in found.items() if count}

    def publishers_matched(self, topic: str, interface: str, *, reliable: bool) -> int:
        """Return how many publishers the subscription for a topic, type and reliability has."""
        reader = self._readers.get((topic, interface, reliable))
        return 0 if reader is None else int(reader.get_publisher_count())

    def take(self, at_once: int = AT_ONCE) -> list[Taken]:
        """Return the messages that have arrived since the last time, topic by topic; of a flood only the first ones.

        Args:
            at_once: How many of one topic at most.
        """
        taken: list[Taken] = []
        room = AT_ONCE_BYTES
        for (topic, interface, _), reader in sorted(self._readers.items()):
            with reader.handle:
                for _ in range(at_once):
                    if room <= 0 or (found := reader.handle.take_message(reader.msg_type, True)) is None:  # noqa: FBT003
                        break
                    room -= len(found[0])
                    taken.append(self._decoded(topic, interface, reader.msg_type, found[0]))
        return taken

    def take_rest(self) -> list[Taken]:
        """Return what is still on its way from a process that has ended without a word."""
        wait_until(lambda: not unread_bytes(), REST_S, pause_s=0.001)
        found: list[Taken] = []
        quiet = 0
        while quiet < QUIET_LOOKS:
            time.sleep(QUIET_PAUSE_S)
            taken = self.take()
            found += taken
            quiet = 0 if taken else quiet + 1
            if len(found) > DEPTH:
                break
        return found

    def hear_logs(self) -> None:
        """Subscribe to what the loggers of nodes publish; what came before is kept for those who come late."""
        message = message_class(LOG_TYPE)
        qos = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._logs = self._make(_subscribing(message, "/rosout", qos))

    def logs(self) -> list[Logged]:
        """Return the log records that have been published since the last time; broken ones are left out."""
        found: list[Logged] = []
        with self._logs.handle:
            while len(found) < AT_ONCE and (taken := self._logs.handle.take_message(self._logs.msg_type, True)):  # noqa: FBT003
                with contextlib.suppress(Exception):  # whatever bytes a student's node sends
                    log = deserialize_message(taken[0], self._logs.msg_type)
                    at = log.stamp.sec, log.stamp.nanosec
                    found.append(Logged(*at, log.name, log.msg[:TEXT_CHARACTERS], log.file, log.line))
        return found

    def _decoded(self, topic: str, interface: str, message: Any, cdr: bytes) -> Taken:
        if len(cdr) > self._limits.message_bytes:
            self._large[topic] += 1
            return Taken(topic, interface, b"", {})
        try:
            return Taken(topic, interface, cdr, plain_fields(deserialize_message(cdr, message)))
        except Exception:  # whatever bytes a student's node sends
            self._broken[topic] += 1
            return Taken(topic, interface, cdr, {})

    def notes(self) -> list[str]:
        """Return what readers must know of messages whose content was not read."""
        large = f"larger than {size(self._limits.message_bytes)}"
        broken = "that are not what their type says"
        return [
            f"{topic[:NAME_CHARACTERS]}: the content of messages {what} was not looked at ({count:,} in all)"
            for counts, what in ((self._large, large), (self._broken, broken))
            for topic, count in sorted(counts.items())[:TOLD]
        ]

    def advertise(self, topic: str, interface: str, *, latched: bool, best_effort: bool = False) -> None:
        """Create the publisher of a stimulus: reliable unless it is to be less, latched where a subscription asks."""
        message = message_class(interface)
        if message is None:
            raise ValueError(interface)
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        reliability = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
        qos = QoSProfile(depth=100, reliability=reliability, durability=durability)
        self._writers[topic] = self._make(lambda node: node.create_publisher(message, topic, qos))

    def subscribers_matched(self, topic: str) -> int:
        """Return how many subscriptions the publisher of a stimulus has."""
        return int(self._writers[topic].get_subscription_count())

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message object, or its bytes, on a stimulus's topic."""
        self._writers[topic].publish(message)

    def withdraw(self, topic: str) -> None:
        """Take the publisher of a stimulus out of the graph."""
        writer = self._writers.pop(topic)
        next(node for node in self._nodes if writer in node.publishers).destroy_publisher(writer)


def _make_node(domain: int) -> Node:
    """Return a node in a participant of its own, without services.

    It is called as the daemon of the `ros2` command is, which is in most graphs: no student's node can guess the name,
    or tell from it that it is being graded.
    """
    context = Context()
    context.init(domain_id=domain)
    return Node(
        f"_ros2cli_daemon_{domain}_{secrets.token_hex(16)}",
        context=context,
        use_global_arguments=False,
        enable_rosout=False,
        start_parameter_services=False,
        enable_logger_service=False,
        # The node would serve descriptions of types to everybody; students' nodes are served nothing.
        parameter_overrides=[Parameter("start_type_description_service", value=False)],
    )


def _subscribing(message: Any, topic: str, qos: QoSProfile) -> Callable[[Node], Any]:
    return lambda node: node.create_subscription(message, topic, _nothing, qos, raw=True)


def unread_bytes() -> int:
    """Return how much lies unread in the UDP sockets of this network, as /proc/net/udp says (proc(5))."""
    unread = 0
    for name in ("udp", "udp6"):
        with contextlib.suppress(OSError):
            rows = Path("/proc/net", name).read_text(encoding="ascii").splitlines()[1:]
            unread += sum(int(row.split()[4].partition(":")[2], 16) for row in rows)
    return unread


def size_of(message: Any) -> int:
    """Return how many bytes a message takes on the wire."""
    return len(serialize_message(message))


def wait_until(condition: Callable[[], bool], seconds: float, *, pause_s: float = 0.0003) -> bool:
    """Wait, in real time, until a condition holds; return whether it came to."""
    deadline = time.monotonic() + seconds
    while not condition():
        if time.monotonic() > deadline:
            return False
        time.sleep(pause_s)
    return True


def _finite_ns(duration: Any) -> int:
    """Return a QoS duration in nanoseconds; 0 for none, which DDS calls infinite."""
    nanoseconds = int(duration.nanoseconds)
    return nanoseconds if 0 < nanoseconds < INFINITE_NS else 0


def _full_name(name: str, space: str) -> str:
    return f"{space.rstrip('/')}/{name}"


def _endpoint_order(end: Endpoint) -> tuple[str, str, str, int]:
    return end.kind, end.topic, end.node, end.participant


def _nothing(_: object) -> None:
    """Stand for a callback; messages are taken by hand."""
