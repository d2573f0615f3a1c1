"""The servers and clients of the grader's own node; requests and responses are taken and sent by hand.

There is no executor and there are no callbacks: what has come is taken when the conductor asks for it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from grader.core.trace import ServiceEnd
from grader.execution.interfaces import interface_class

#: Types of the services that every node has.
BACKGROUND_TYPES = ("rcl_interfaces/", "type_description_interfaces/")


#: Requests that are taken at once at most.
AT_ONCE = 1000


@dataclass(frozen=True, slots=True)
class Arrived:
    """A request or a response that came.

    Attributes:
        service: Absolute name.
        sent_ns: When its sender sent it, by the middleware's clock; tells what came first, and nothing else.
        message: It.
        header: What a response to it needs; None for a response.
        client: Which of the grader's clients it is for; 0 for a request.
        sequence: That client's number of the request.
    """

    service: str
    sent_ns: int
    message: Any
    header: Any = None
    client: int = 0
    sequence: int = 0


class ServiceEnds:
    """The servers and clients of one node.

    Args:
        node: The grader's.
    """

    def __init__(self, node: Any) -> None:
        self._node = node
        self._servers: dict[str, Any] = {}
        self._clients: dict[str, dict[int, Any]] = {}

    def serve(self, service: str, interface: str) -> None:
        """Let a server appear."""
        self._servers[service] = self._node.create_service(interface_class(interface, "srv"), service, _nothing)

    def dismiss(self, service: str) -> None:
        """Let a server disappear."""
        self._node.destroy_service(self._servers.pop(service))

    def meet(self, service: str, interface: str, number: int) -> None:
        """Let a client appear, by the number it is called by."""
        client = self._node.create_client(interface_class(interface, "srv"), service)
        self._clients.setdefault(service, {})[number] = client

    def met(self, service: str) -> bool:
        """Return whether every client of a service has a server."""
        return all(client.service_is_ready() for client in self._clients.get(service, {}).values())

    def ask(self, service: str, number: int, request: Any) -> int:
        """Send a request, and return the number that its client gives it."""
        client = self._clients[service][number]
        with client.handle:
            return int(client.handle.send_request(request))

    def answer(self, service: str, header: Any, response: Any) -> None:
        """Send the response to a request."""
        self._servers[service].send_response(response, header)

    def take_requests(self, service: str) -> list[Arrived]:
        """Return the requests that have come to a server since the last time."""
        server = self._servers[service]
        found = []
        with server.handle:
            for _ in range(AT_ONCE):
                request, header = server.handle.service_take_request(server.srv_type.Request)
                if request is None:
                    break
                found.append(Arrived(service, header.source_timestamp, request, header=header))
        return found

    def take_responses(self, service: str) -> list[Arrived]:
        """Return the responses that have come to the clients of a service since the last time."""
        found = []
        for number, client in self._clients.get(service, {}).items():
            with client.handle:
                # what others were answered comes as well, and is taken as nothing: only so many may lie there
                for _ in range(2 * client.qos_profile.depth):
                    header, response = client.handle.take_response(client.srv_type.Response)
                    if header is not None:
                        sequence = header.request_id.sequence_number
                        found.append(Arrived(service, header.source_timestamp, response, None, number, sequence))
        return found

    def graph(self, nodes: list[tuple[str, str]]) -> tuple[ServiceEnd, ...]:
        """Return the servers and clients of some nodes, sorted, without those that every node has.

        Args:
            nodes: Name and namespace of each.
        """
        found = []
        looks = (
            ("service", self._node.get_service_names_and_types_by_node),
            ("client", self._node.get_client_names_and_types_by_node),
        )
        for name, space in nodes:
            for kind, look in looks:
                found += [
                    ServiceEnd(kind, service, interface, f"{space.rstrip('/')}/{name}")
                    for service, interfaces in _looked(look, name, space)
                    for interface in interfaces
                    if not interface.startswith(BACKGROUND_TYPES)
                ]
        return tuple(sorted(set(found), key=lambda end: (end.kind, end.service, end.type, end.node)))


def _looked(look: Any, name: str, space: str) -> list[tuple[str, list[str]]]:
    try:
        found: list[tuple[str, list[str]]] = look(name, space)
    except Exception:  # the node has gone meanwhile: rclpy raises an exception of its own, which moves about
        return []
    return found


def _nothing(request: object, response: object) -> object:
    """Stand for a callback; requests are taken by hand."""
    del request
    return response
