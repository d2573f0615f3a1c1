"""The grader's own node: watches the graph, takes every message that students' nodes publish, publishes stimuli.

Apart from the sandbox self-test, it is the only module of the grader's own processes that uses rclpy. The node has no
services, parameters, callbacks or executor: the runner takes messages by polling.
"""

from __future__ import annotations

import contextlib
import secrets
import threading
import time
from collections import Counter
from collections.abc import Callable, Collection, Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

from rclpy.context import Context
from rclpy.impl.implementation_singleton import rclpy_implementation
from rclpy.node import Node
from rclpy.parameter import Parameter
from rclpy.qos import DurabilityPolicy, HistoryPolicy, LivelinessPolicy, QoSProfile, ReliabilityPolicy
from rclpy.serialization import deserialize_message, serialize_message

from grader.runtime.host.originals import unread_bytes, wait_until
from grader.runtime.message_classes import message_class, plain_fields
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, size
from grader.runtime.model.trace import Endpoint, GraphSnapshot
from grader.runtime.padding import without_padding
from grader.runtime.worker import farewell
from grader.runtime.worker.claims import BACKGROUND_TYPES
from grader.runtime.worker.console import TEXT_CHARACTERS, Logged
from grader.runtime.worker.core import Taken, in_order
from grader.runtime.worker.ros_names import ask_for_all, asked
from grader.runtime.worker.service_ends import ServiceEnds

LOG_TYPE = "rcl_interfaces/msg/Log"
PARAMETER_EVENTS = "/parameter_events"
BACKGROUND = frozenset({"/rosout", PARAMETER_EVENTS})
#: So many bytes at the beginning of an endpoint's GUID are those of its participant.
PREFIX_BYTES = 12
#: When a message was sent and when it arrived, as `take_message` names what the middleware says. Its threads receive
#: messages whatever the grader itself is busy with.
TIMESTAMPS = ("source_timestamp", "received_timestamp")
#: Queue depth, enough for everything that can be published between two polls.
DEPTH = 5000
#: The most messages of a topic, and bytes of all topics, that one poll takes; the rest is left for the next poll.
AT_ONCE, AT_ONCE_BYTES = 1000, 4 * MIB
#: How many topics the notes at the end name, and how long a name may be.
MOST_TOPICS, NAME_CHARACTERS = 20, 200
#: A QoS duration of at least this means infinite.
INFINITE_NS = 9_000_000_000_000_000_000
#: How long, in real time, to wait for messages of a process that died, and how many polls in a row must find nothing.
REST_S, QUIET_LOOKS, QUIET_PAUSE_S = 0.5, 4, 0.005
#: rclpy's name for a node whose endpoints are known, but whose name is not known yet or no longer.
UNKNOWN_NODE = "_NODE_NAME_UNKNOWN_"
#: The most participants of the grader, and how long to wait for the name of a new one.
PARTICIPANTS, NAME_S = 8, 2.0


class Observer:
    """A node in its own context, and a few more nodes if topics have several types.

    Args:
        domain: ROS domain to join.
        limits: Sets the largest message whose content is read.

    Attributes:
        unnamed: How many endpoints of the last graph have a node without a name, by kind, topic and type.
        crowded: Why not every topic can be read, as a phrase: one has more types than nodes could agree on. Empty
            otherwise.
    """

    def __init__(self, domain: int, limits: Limits) -> None:
        self._limits = limits
        self._domain = domain
        self.node = _make_node(domain)
        self._nodes = [self.node]
        self._names = {self.node.get_name()}
        self._readers: dict[tuple[str, str], Any] = {}
        self._left: list[Taken] = []
        self._writers: dict[str, Any] = {}
        self._participants: dict[bytes, int] = {}
        self._logs: Any = None
        self._woken = rclpy_implementation.GuardCondition(self.node.context.handle)
        self.services = ServiceEnds(self.node)
        self._broken: Counter[str] = Counter()
        self._large: Counter[str] = Counter()
        self.unnamed: Counter[tuple[str, str, str]] = Counter()
        self.crowded = ""

    def close(self) -> None:
        """Leave the graph."""
        for node in self._nodes:
            node.destroy_node()
            node.context.shutdown()

    def _make(self, create: Callable[[Node], Any]) -> Any:
        """Create an endpoint, in another node if its topic already has another type: a participant allows only one.

        Raises:
            RCLError: No node can create it.
        """
        for node in self._nodes:
            try:
                return create(node)
            except rclpy_implementation.RCLError:
                if len(self._nodes) >= PARTICIPANTS:
                    raise
        other = _make_node(self._domain)
        self._nodes.append(other)
        self._names.add(other.get_name())
        # Until its name is known, its endpoints would be taken for a student's.
        wait_until(lambda: other.get_name() in self.node.get_node_names(), NAME_S)
        return create(other)

    def graph(self, t_ns: int, *, services: bool = False, existing: Collection[str] | None = None) -> GraphSnapshot:
        """Return the live graph, sorted and without the grader's own node.

        An endpoint can be in the graph before or after the name of its node is; it is left out then.

        Args:
            t_ns: Time of the snapshot.
            services: Whether to include services, which takes longer.
            existing: See `students_nodes`.
        """
        names = self._names_in_graph(existing)
        nodes = sorted({_full_name(name, space) for name, space in names})
        offered = self.services.graph(sorted(set(names))) if services else ()
        looks = {
            "publisher": self.node.get_publishers_info_by_topic,
            "subscription": self.node.get_subscriptions_info_by_topic,
        }
        topics: list[tuple[str, list[str]]] = ask_for_all(self.node.get_topic_names_and_types)
        nobody: list[Any] = []
        ends = [
            self._endpoint(kind, topic, info)
            for topic, _ in sorted(topics)
            if topic not in BACKGROUND
            for kind, look in looks.items()
            for info in asked(look, topic, nothing=nobody)
        ]
        # An endpoint without the name of its node is in the next snapshot with it, and would count as two here.
        others = [e for e in ends if e.participant >= 0]
        self.unnamed = Counter((e.kind, e.topic, e.type) for e in others if UNKNOWN_NODE in e.node)
        students = [e for e in others if UNKNOWN_NODE not in e.node]
        return GraphSnapshot(t_ns, tuple(nodes), tuple(sorted(students, key=_endpoint_order)), offered)

    def with_qos(self, graph: GraphSnapshot) -> GraphSnapshot:
        """Return a graph with the QoS of its servers and clients, which takes longer to look up."""
        return replace(graph, services=self.services.with_qos(graph.services, _qos_words)) if graph.services else graph

    def participants(self) -> int:
        """Return how many participants with endpoints have appeared, without the grader's."""
        return len(self._participants)

    def _endpoint(self, kind: str, topic: str, info: Any) -> Endpoint:
        own = info.node_name in self._names
        # A process has a participant for each ROS context.
        prefix = bytes(info.endpoint_gid[:PREFIX_BYTES])
        number = -1 if own else self._participants.setdefault(prefix, len(self._participants))
        manual = info.qos_profile.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC
        reliability, durability = _qos_words(info.qos_profile)
        return Endpoint(
            kind=kind,
            topic=topic,
            type=info.topic_type,
            node=_full_name(info.node_name, info.node_namespace),
            participant=number,
            reliability=reliability,
            durability=durability,
            deadline_ns=_finite_ns(info.qos_profile.deadline),
            liveliness="manual_by_topic" if manual else "automatic",
            lease_ns=_finite_ns(info.qos_profile.liveliness_lease_duration),
        )

    def participants_of_nodes(self) -> dict[bytes, set[str]]:
        """Return the full names of the students' nodes of each participant, whether they have endpoints or not.

        Every node publishes the changes of its parameters.
        """
        found: dict[bytes, set[str]] = {}
        for info in self._publishing():
            if info.node_name not in self._names:
                node = _full_name(info.node_name, info.node_namespace)
                found.setdefault(bytes(info.endpoint_gid[:PREFIX_BYTES]), set()).add(node)
        return found

    def say_farewell(self, participants: Iterable[bytes]) -> None:
        """Tell everybody in the domain that some participants have left, by the beginning of their GUIDs."""
        farewell.say_for(participants, self._domain)

    def watch(self, endpoints: Iterable[Endpoint]) -> list[str]:
        """Subscribe to every topic that has a publisher; return the topics whose type is not installed.

        One subscription takes all messages of a topic and type: a reliable one, or one with best effort if any
        publisher has it. With two, the messages of a reliable publisher would be taken twice, and a best-effort
        publisher would hear of a subscription that asks for more.

        Args:
            endpoints: Endpoints of students' nodes.
        """
        unknown = []
        publishers = [end for end in endpoints if end.kind == "publisher"]
        best_effort = {(end.topic, end.type) for end in publishers if end.reliability != "reliable"}
        for key in dict.fromkeys((end.topic, end.type) for end in publishers):
            known = self._readers.get(key)
            if known is not None and (key not in best_effort or not _is_reliable(known)):
                continue
            topic, interface = key
            message = message_class(interface)
            if message is None:
                unknown.append(f"{topic} [{interface}]")
                continue
            reliability = ReliabilityPolicy.BEST_EFFORT if key in best_effort else ReliabilityPolicy.RELIABLE
            qos = QoSProfile(history=HistoryPolicy.KEEP_LAST, depth=DEPTH, reliability=reliability)
            try:
                self._readers[key] = self._make(_subscribing(message, topic, qos))
            except rclpy_implementation.RCLError:
                self.crowded = f"more than {PARTICIPANTS} types of messages on {topic[:NAME_CHARACTERS]}"
                continue
            if known is not None:
                # What has arrived at the old subscription is taken before it goes.
                self._left += self._taken(topic, interface, known, DEPTH, AT_ONCE_BYTES)[0]
                next(node for node in self._nodes if known in node.subscriptions).destroy_subscription(known)
        return unknown

    def reads(self, topic: str) -> bool:
        """Return whether this node subscribes to a topic."""
        return any(name == topic for name, _ in self._readers)

    def watching(self, topic: str, interface: str) -> list[bool]:
        """Return, for each subscription of this node to a topic and type, whether it is reliable."""
        reader = self._readers.get((topic, interface))
        return [] if reader is None else [_is_reliable(reader)]

    def publishes(self, topic: str) -> bool:
        """Return whether a stimulus is published on a topic now."""
        return topic in self._writers

    def students_nodes(self, existing: Collection[str] | None = None) -> list[str]:
        """Return the names of the students' nodes in the graph, including duplicates.

        Args:
            existing: The nodes that are known to exist. If given, others count only if they have a publisher, as every
                node has: rmw_fastrtps learns of a participant's nodes and of its end on two threads, and if the end
                comes first, the nodes return to the graph for good.
        """
        return [_full_name(*pair) for pair in self._names_in_graph(existing)]

    def _names_in_graph(self, existing: Collection[str] | None) -> list[tuple[str, str]]:
        known: list[tuple[str, str]] = ask_for_all(self.node.get_node_names_and_namespaces)
        pairs = [p for p in known if p[0] not in {*self._names, UNKNOWN_NODE}]
        return pairs if existing is None else self._without_gone(pairs, existing)

    def _without_gone(self, pairs: list[tuple[str, str]], existing: Collection[str] = ()) -> list[tuple[str, str]]:
        """Return the names of the nodes that exist, of those that rmw_fastrtps lists: as often as they publish."""
        publishing = Counter((info.node_name, info.node_namespace) for info in self._publishing())
        return [
            pair
            for pair, count in Counter(pairs).items()
            for _ in range(min(count, max(publishing[pair], int(_full_name(*pair) in existing))))
        ]

    def _publishing(self) -> list[Any]:
        """Return the publishers of changes of parameters: each node has one."""
        nobody: list[Any] = []
        found: list[Any] = asked(self.node.get_publishers_info_by_topic, PARAMETER_EVENTS, nothing=nobody)
        return found

    def has_namesakes(self) -> bool:
        """Return whether nodes of one name are listed, of which one may have gone: of one, the others hide the rest."""
        names: list[tuple[str, str]] = ask_for_all(self.node.get_node_names_and_namespaces)
        return len({*names}) < len(names)

    def ends_of(self, kind: str, service: str) -> int:
        """Return the number of servers (`service`) or clients (`client`) of a service, including the grader's own."""
        count = self.node.count_services if kind == "service" else self.node.count_clients
        return int(asked(count, service, nothing=0))

    def counts(self) -> dict[str, int]:
        """Count the endpoints and nodes in the graph by name, as any node sees them, including the grader's own.

        Nodes that have gone are left out, as the host leaves them out for programs: see `students_nodes`.
        """
        node = self.node
        known: list[tuple[str, str]] = ask_for_all(node.get_node_names_and_namespaces)
        nodes = self._without_gone(known)
        topics: list[tuple[str, list[str]]] = ask_for_all(node.get_topic_names_and_types)
        services: list[tuple[str, list[str]]] = ask_for_all(node.get_service_names_and_types)
        found = Counter(f"node {_full_name(*pair)}" for pair in nodes)
        for topic, _ in topics:
            if topic not in BACKGROUND:
                found[f"publisher {topic}"] = asked(node.count_publishers, topic, nothing=0)
                found[f"subscription {topic}"] = asked(node.count_subscribers, topic, nothing=0)
        for service, types in services:
            if not types[0].startswith(BACKGROUND_TYPES):
                found[f"service {service}"] = asked(node.count_services, service, nothing=0)
                found[f"client {service}"] = asked(node.count_clients, service, nothing=0)
        return {name: count for name, count in found.items() if count}

    def publishers_matched(self, topic: str, interface: str) -> int:
        """Return how many publishers are matched with the subscription for a topic and type."""
        reader = self._readers.get((topic, interface))
        return 0 if reader is None else int(reader.get_publisher_count())

    def wake(self) -> None:
        """End a wait for arrivals; called from another thread."""
        self._woken.trigger_guard_condition()

    def await_arrival(self, wait_ns: int) -> None:
        """Wait, in real time, until a message, a request or a response can be taken, or `wake` was called.

        Args:
            wait_ns: How long to wait at most.
        """
        readers = [*self._readers.values(), *([self._logs] if self._logs is not None else [])]
        servers, clients = self.services.ends()
        counts = len(readers), 1, 0, len(clients), len(servers), 0
        arrivals = rclpy_implementation.WaitSet(*counts, self.node.context.handle)
        arrivals.clear_entities()
        for reader in readers:
            arrivals.add_subscription(reader.handle)
        for client in clients:
            arrivals.add_client(client.handle)
        for server in servers:
            arrivals.add_service(server.handle)
        arrivals.add_guard_condition(self._woken)
        arrivals.wait(wait_ns)

    def take(self, at_once: int = AT_ONCE) -> list[Taken]:
        """Take the messages that have arrived since the last call, topic by topic, up to a limit.

        Args:
            at_once: The most messages to take from one topic.
        """
        taken, self._left = self._left, []
        left_bytes = AT_ONCE_BYTES
        # Sorted, because subscriptions are made in the order in which discovery happens to tell of publishers.
        for (topic, interface), reader in sorted(self._readers.items()):
            found, left_bytes = self._taken(topic, interface, reader, at_once, left_bytes)
            taken += found
        return taken

    def _taken(self, topic: str, interface: str, reader: Any, at_once: int, left_bytes: int) -> tuple[list[Taken], int]:
        """Take the messages of one subscription, up to a number and a size; return how many bytes are left."""
        taken: list[Taken] = []
        with reader.handle:
            while len(taken) < at_once and left_bytes > 0:
                found = reader.handle.take_message(reader.msg_type, True)  # noqa: FBT003
                if found is None:
                    break
                # The message that goes beyond is still taken: a single one may be larger than all that is allowed.
                left_bytes -= len(found[0])
                decoded = self._decoded(topic, interface, reader.msg_type, found[0])
                sent_ns, arrived_ns = (int(found[1].get(name, 0)) for name in TIMESTAMPS)
                taken.append(replace(decoded, sent_ns=sent_ns, arrived_ns=arrived_ns))
        return taken, left_bytes

    def take_rest(self) -> list[Taken]:
        """Take the messages that are still in transit from a process that died."""
        wait_until(lambda: not unread_bytes(), REST_S, pause_s=0.001)
        found: list[Taken] = []
        quiet = 0
        while quiet < QUIET_LOOKS:
            time.sleep(QUIET_PAUSE_S)
            wait_until(lambda: not other_threads_run(), REST_S)
            taken = self.take()
            found += taken
            quiet = 0 if taken else quiet + 1
            if len(found) > DEPTH:
                break
        return in_order(found)

    def subscribe_to_logs(self) -> None:
        """Subscribe to /rosout; its publishers are latched, so earlier log records arrive as well."""
        message = message_class(LOG_TYPE)
        qos = QoSProfile(depth=DEPTH, durability=DurabilityPolicy.TRANSIENT_LOCAL)
        self._logs = self._make(_subscribing(message, "/rosout", qos))

    def logs(self) -> list[Logged]:
        """Take the log records that have been published since the last call, without malformed ones."""
        found: list[Logged] = []
        with self._logs.handle:
            while len(found) < AT_ONCE and (taken := self._logs.handle.take_message(self._logs.msg_type, True)):  # noqa: FBT003
                with contextlib.suppress(Exception):  # whatever bytes a student's node sends
                    log = deserialize_message(taken[0], self._logs.msg_type)
                    at = log.stamp.sec, log.stamp.nanosec
                    arrived_ns = int(taken[1].get(TIMESTAMPS[1], 0))
                    found.append(Logged(*at, log.name, log.msg[:TEXT_CHARACTERS], log.file, log.line, arrived_ns))
        return found

    def _decoded(self, topic: str, interface: str, message: Any, cdr: bytes) -> Taken:
        if len(cdr) > self._limits.message_bytes:
            self._large[topic] += 1
            return Taken(topic, interface, b"", {})
        try:
            value = plain_fields(deserialize_message(cdr, message))
        except Exception:  # whatever bytes a student's node sends
            self._broken[topic] += 1
            return Taken(topic, interface, cdr, {})
        return Taken(topic, interface, without_padding(cdr, message), value)

    def notes(self) -> list[str]:
        """Return notes about messages whose content was not read."""
        large = f"larger than {size(self._limits.message_bytes)}"
        broken = "that are not what their type says"
        return [
            f"{topic[:NAME_CHARACTERS]}: the content of messages {what} was ignored ({count:,} in all)"
            for counts, what in ((self._large, large), (self._broken, broken))
            for topic, count in sorted(counts.items())[:MOST_TOPICS]
        ]

    def advertise(self, topic: str, interface: str, *, latched: bool, best_effort: bool = False) -> None:
        """Create the publisher of a stimulus."""
        message = message_class(interface)
        if message is None:
            raise ValueError(interface)
        durability = DurabilityPolicy.TRANSIENT_LOCAL if latched else DurabilityPolicy.VOLATILE
        reliability = ReliabilityPolicy.BEST_EFFORT if best_effort else ReliabilityPolicy.RELIABLE
        qos = QoSProfile(depth=100, reliability=reliability, durability=durability)
        self._writers[topic] = self._make(lambda node: node.create_publisher(message, topic, qos))

    def subscribers_matched(self, topic: str) -> int:
        """Return how many subscriptions are matched with the publisher of a stimulus."""
        return int(self._writers[topic].get_subscription_count())

    def publish(self, topic: str, message: Any) -> None:
        """Publish a message, as an object or as bytes, on the topic of a stimulus."""
        self._writers[topic].publish(message)

    def withdraw(self, topic: str) -> None:
        """Destroy the publisher of a stimulus."""
        writer = self._writers.pop(topic)
        next(node for node in self._nodes if writer in node.publishers).destroy_publisher(writer)


def _make_node(domain: int) -> Node:
    """Create a node in its own participant, without services.

    It is named like the daemon of the `ros2` command, which is in most graphs. A student's node can neither guess the
    name nor tell from it that it is being graded.
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
        # Otherwise the node would serve type descriptions to students' nodes.
        parameter_overrides=[Parameter("start_type_description_service", value=False)],
    )


def _subscribing(message: Any, topic: str, qos: QoSProfile) -> Callable[[Node], Any]:
    return lambda node: node.create_subscription(message, topic, _nothing, qos, raw=True)


def _qos_words(profile: Any) -> tuple[str, str]:
    """Return reliability and durability of a QoS profile, as traces name them."""
    best_effort = profile.reliability == ReliabilityPolicy.BEST_EFFORT
    latched = profile.durability == DurabilityPolicy.TRANSIENT_LOCAL
    return "best_effort" if best_effort else "reliable", "transient_local" if latched else "volatile"


def _is_reliable(reader: Any) -> bool:
    return bool(reader.qos_profile.reliability == ReliabilityPolicy.RELIABLE)


def other_threads_run() -> bool:
    """Return whether another thread of this process runs or waits for a processor, from /proc/self/task (proc(5)).

    The middleware's threads take messages out of the sockets; while one has work, a message may still be on its way.
    """
    own = threading.get_native_id()
    for task in Path("/proc/self/task").iterdir():
        with contextlib.suppress(OSError):  # the thread has ended
            state = (task / "stat").read_text(errors="replace").rpartition(")")[2].split()[0]
            if state == "R" and int(task.name) != own:
                return True
    return False


def size_of(message: Any) -> int:
    """Return the serialized size of a message in bytes."""
    return len(serialize_message(message))


def _finite_ns(duration: Any) -> int:
    """Return a QoS duration in nanoseconds; 0 for an infinite one, which means that none is set."""
    nanoseconds = int(duration.nanoseconds)
    return nanoseconds if 0 < nanoseconds < INFINITE_NS else 0


def _full_name(name: str, space: str) -> str:
    return f"{space.rstrip('/')}/{name}"


def _endpoint_order(end: Endpoint) -> tuple[str, str, str, int]:
    return end.kind, end.topic, end.node, end.participant


def _nothing(_: object) -> None:
    """Do nothing: messages are polled, but rclpy requires a callback."""
