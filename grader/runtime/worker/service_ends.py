"""The service servers and clients of the grader's own node.

They have no executor and no callbacks: the runner takes requests and responses by polling.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any

from grader.runtime.message_classes import interface_class
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import ServiceEnd
from grader.runtime.worker.claims import BACKGROUND_TYPES
from grader.runtime.worker.ros_names import asked

#: The most requests that one poll takes.
AT_ONCE = 1000


@dataclass(frozen=True, slots=True)
class Arrived:
    """A request or a response that was received.

    Attributes:
        service: Absolute name of the service.
        sent_ns: When it was sent, by the middleware's clock; used only to sort.
        message: The request or response.
        header: The header of a request, which its response needs; None for a response.
        client: The number of the grader's client that a response is for; 0 for a request.
        sequence: Sequence number of the request, given by that client.
    """

    service: str
    sent_ns: int
    message: Any
    header: Any = None
    client: int = 0
    sequence: int = 0


class ServiceEnds:
    """The service servers and clients of one node.

    Args:
        node: The grader's node.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._servers: dict[str, Any] = {}
        self._clients: dict[str, dict[int, Any]] = {}

    def add_server(self, service: str, interface: str) -> None:
        """Create a server."""
        self._servers[service] = self._node.create_service(interface_class(interface, "srv"), service, _nothing)

    def remove_server(self, service: str) -> None:
        """Destroy a server."""
        self._node.destroy_service(self._servers.pop(service))

    def add_client(self, service: str, interface: str, number: int) -> None:
        """Create a client with a number."""
        client = self._node.create_client(interface_class(interface, "srv"), service)
        self._clients.setdefault(service, {})[number] = client

    def ends(self) -> tuple[list[Any], list[Any]]:
        """Return all servers and all clients."""
        clients = [client for numbered in self._clients.values() for client in numbered.values()]
        return list(self._servers.values()), clients

    def is_matched(self, service: str) -> bool:
        """Return whether every client of a service is matched with a server."""
        return all(client.service_is_ready() for client in self._clients.get(service, {}).values())

    def ask(self, service: str, number: int, request: Any) -> int:
        """Send a request, and return its sequence number."""
        client = self._clients[service][number]
        with client.handle:
            return int(client.handle.send_request(request))

    def answer(self, service: str, header: Any, response: Any) -> None:
        """Send the response to a request."""
        self._servers[service].send_response(response, header)

    def take_requests(self, service: str) -> list[Arrived]:
        """Take the requests that a server has received since the last call."""
        server = self._servers[service]
        found = []
        with server.handle:
            for _ in range(AT_ONCE):
                taken = _taken(server.handle.service_take_request, server.srv_type.Request)
                if taken is None:
                    continue
                request, header = taken
                if request is None:
                    break
                found.append(Arrived(service, header.source_timestamp, request, header=header))
        return found

    def take_responses(self, service: str) -> list[Arrived]:
        """Take the responses that the clients of a service have received since the last call."""
        found = []
        for number, client in self._clients.get(service, {}).items():
            with client.handle:
                # responses to other clients are taken as None, hence more attempts than the queue has entries
                for _ in range(2 * client.qos_profile.depth):
                    taken = _taken(client.handle.take_response, client.srv_type.Response)
                    header, response = taken or (None, None)
                    if header is not None:
                        sequence = header.request_id.sequence_number
                        found.append(Arrived(service, header.source_timestamp, response, None, number, sequence))
        return found

    def with_qos(self, ends: tuple[ServiceEnd, ...], words: Callable[[Any], tuple[str, str]]) -> tuple[ServiceEnd, ...]:
        """Return servers and clients with the QoS of their requests, as the middleware's topics have it.

        The parts of actions, whose names are hidden, stay as they are.

        Args:
            ends: The servers and clients.
            words: Returns reliability and durability of a QoS profile, as traces name them.
        """
        known: dict[tuple[str, str, str], tuple[str, str]] = {}
        for service in {end.service for end in ends if "/_" not in end.service}:
            for kind, look in (
                ("service", self._node.get_subscriptions_info_by_topic),
                ("client", self._node.get_publishers_info_by_topic),
            ):
                nobody: list[Any] = []
                for info in asked(look, f"rq{service}Request", True, nothing=nobody):  # noqa: FBT003 - rclpy's
                    node = f"{info.node_namespace.rstrip('/')}/{info.node_name}"
                    known[kind, service, node] = words(info.qos_profile)
        usual = ("reliable", "volatile")
        return tuple(
            replace(end, reliability=qos[0], durability=qos[1])
            for end in ends
            for qos in (known.get((end.kind, end.service, end.node), usual),)
        )

    def graph(self, nodes: list[tuple[str, str]]) -> tuple[ServiceEnd, ...]:
        """Return the servers and clients of some nodes, sorted, without the servers that every node has.

        Args:
            nodes: Name and namespace of each node.
        """
        found = []
        looks = (
            ("service", self._node.get_service_names_and_types_by_node),
            ("client", self._node.get_client_names_and_types_by_node),
        )
        nothing: list[tuple[str, list[str]]] = []
        for name, space in nodes:
            for kind, look in looks:
                found += [
                    ServiceEnd(kind, service, interface, f"{space.rstrip('/')}/{name}")
                    for service, interfaces in asked(look, name, space, nothing=nothing)
                    for interface in interfaces
                    if kind == "client" or not interface.startswith(BACKGROUND_TYPES)
                ]
        return tuple(sorted(set(found), key=lambda end: (end.kind, end.service, end.type, end.node)))


def _taken(take: Any, kind: Any) -> Any:
    """Return what a function of rclpy takes; None for bytes that are not what the type says.

    Compiled type supports drop such bytes. Those of packages that were built here are in Python, and rclpy raises an
    error for them that is no RCLError.
    """
    try:
        return take(kind)
    except RuntimeError as error:
        if type(error) is not RuntimeError:
            raise
        return None


def _nothing(request: object, response: object) -> object:
    """Do nothing: requests are polled, but rclpy requires a callback."""
    del request
    return response
