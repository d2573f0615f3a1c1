"""Who hears whom, by the claims of processes, which are the endpoints and parameters that they report."""

from __future__ import annotations

from collections.abc import Iterable

from grader.runtime.host.protocol import Claim, EndQos
from grader.runtime.model.trace import keeps_within

#: Prefixes of the types of services that every node has.
BACKGROUND_TYPES = ("rcl_interfaces/", "type_description_interfaces/")


def readers_of(claims: Iterable[Claim], topic: str) -> list[Claim]:
    """Return the subscriptions to a topic."""
    return [c for c in claims if c.kind == "subscription" and c.name == topic]


def ends_of_kind(claims: Iterable[Claim], kind: str) -> list[Claim]:
    """Return the endpoints of a kind."""
    return [c for c in claims if c.kind == kind]


def claims_of(claims: Iterable[Claim], kind: str, name: str) -> list[Claim]:
    """Return the endpoints of a kind and name; every node has some services."""
    # The services of parameters and of types come with a node, and hosts do not report them one by one.
    node = name.rpartition("/")[0] if kind == "service" else ""
    return [c for c in claims if (c.kind, c.name) in ((kind, name), ("node", node))]


#: The end of a service of a process that says nothing about its QoS, and each of the grader's.
ORDINARY_END = Claim("", "", "")


def fits(offer: EndQos, wish: EndQos) -> bool:
    """Return whether the QoS that a writer offers satisfies that of a reader: the policies of `unmet_policy`."""
    return (
        (offer.reliable or not wish.reliable)
        and (offer.latched or not wish.latched)
        and keeps_within(offer.deadline_ns, wish.deadline_ns)
        and (offer.manual or not wish.manual)
        and keeps_within(offer.lease_ns, wish.lease_ns)
    )


def meets(writer: Claim, reader: Claim) -> bool:
    """Return whether a publisher and a subscription have the same topic and type, so that only QoS keeps them apart."""
    return (writer.name, writer.type) == (reader.name, reader.type)


def compatible(writer: Claim, reader: Claim) -> bool:
    """Return whether the messages of a publisher reach a subscription."""
    return meets(writer, reader) and fits(writer.qos, reader.qos)


def passes(sender: Claim, receiver: Claim) -> bool:
    """Return whether what one end of a service sends reaches the other."""
    return fits(sender.sends, receiver.takes)


def answers(server: Claim, client: Claim) -> bool:
    """Return whether requests and responses pass between a server and a client, so that they see each other."""
    return passes(client, server) and passes(server, client)


def serves(claim: Claim, service: str, interface: str) -> bool:
    """Return whether a claim provides a service: as its server, or as a node, for services that every node has."""
    if claim.kind == "node":
        return interface.startswith(BACKGROUND_TYPES) and claim.name == service.rpartition("/")[0]
    return (claim.kind, claim.name, claim.type) == ("service", service, interface)


#: The channels on which endpoints receive.
CHANNELS = {"subscription": "topic", "service": "request", "client": "response"}
