"""Claims, which are the endpoints and parameters that processes report: whether they are valid, and who hears whom."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from typing import Any

from grader.runtime.model.trace import keeps_within
from grader.runtime.worker.ros_names import is_name, is_node_name

#: The most messages that are believed to be sent between two reports.
COUNT = 1_000_000
#: Prefixes of the types of services that every node has.
BACKGROUND_TYPES = ("rcl_interfaces/", "type_description_interfaces/")
#: Valid types and parameters; anything else that a process reports as a name is never shown.
_TYPE = re.compile(r"[A-Za-z0-9_]+(?:/[A-Za-z0-9_]+){1,2}")
_PARAMETER = re.compile(r"[^\s]{1,150}")


def counts(data: Any) -> dict[str, int]:
    """Return the number of messages by channel, without entries that are not valid channels or counts."""
    if not isinstance(data, dict):
        return {}
    channels = {name: count for name, count in data.items() if is_name(str(name).partition(" ")[2])}
    return {str(name): min(count, COUNT) for name, count in channels.items() if isinstance(count, int) and count > 0}


def is_claim(claim: Any) -> bool:
    """Return whether a value is a complete description of an endpoint or a parameter."""
    if not isinstance(claim, dict) or not all(isinstance(claim.get(k), str) for k in ("kind", "name", "type")):
        return False
    kind, name = claim["kind"], claim["name"]
    if kind == "parameter":
        node, _, parameter = name.partition(":")
        return is_node_name(node) and _PARAMETER.fullmatch(parameter) is not None
    if not (is_node_name if kind == "node" else is_name)(name) or (
        kind != "node" and _TYPE.fullmatch(claim["type"]) is None
    ):
        return False
    ends = kind in ("publisher", "subscription")
    bools = all(isinstance(claim.get(k), bool) for k in ("reliable", "latched", "manual"))
    return not ends or (bools and isinstance(claim.get("deadline_ns"), int))


def readers_of(claims: Iterable[dict[str, Any]], topic: str) -> list[dict[str, Any]]:
    """Return the subscriptions to a topic."""
    return [c for c in claims if c["kind"] == "subscription" and c["name"] == topic]


def claims_of(claims: Iterable[dict[str, Any]], kind: str, name: str) -> list[dict[str, Any]]:
    """Return the endpoints of a kind and name; every node has some services."""
    # The services of parameters and of types come with a node, and hosts do not report them one by one.
    node = name.rpartition("/")[0] if kind == "service" else ""
    return [c for c in claims if (c["kind"], c["name"]) in ((kind, name), ("node", node))]


#: The QoS of an endpoint that asks for nothing special; what a claim leaves out is as here.
ORDINARY = {"reliable": True, "latched": False, "deadline_ns": 0, "manual": False, "lease_ns": 0}
#: The end of a service of a process that says nothing about its QoS, and each of the grader's.
ORDINARY_END: Mapping[str, Any] = {}


def fits(writer: Mapping[str, Any], reader: Mapping[str, Any]) -> bool:
    """Return whether the QoS that a writer offers satisfies that of a reader: the policies of `unmet_policy`."""
    offer, wish = {**ORDINARY, **writer}, {**ORDINARY, **reader}
    return (
        (offer["reliable"] or not wish["reliable"])
        and (offer["latched"] or not wish["latched"])
        and keeps_within(offer["deadline_ns"], wish["deadline_ns"])
        and (offer["manual"] or not wish["manual"])
        and keeps_within(offer["lease_ns"], wish["lease_ns"])
    )


def meets(writer: Mapping[str, Any], reader: Mapping[str, Any]) -> bool:
    """Return whether a publisher and a subscription have the same topic and type, so that only QoS keeps them apart."""
    return (writer["name"], writer["type"]) == (reader["name"], reader["type"])


def compatible(writer: Mapping[str, Any], reader: Mapping[str, Any]) -> bool:
    """Return whether the messages of a publisher reach a subscription."""
    return meets(writer, reader) and fits(writer, reader)


def passes(sender: Mapping[str, Any], receiver: Mapping[str, Any]) -> bool:
    """Return whether what one end of a service sends reaches the other; without QoS, an end is an ordinary one."""
    return fits(sender.get("sends", ORDINARY), receiver.get("takes", ORDINARY))


def answers(server: Mapping[str, Any], client: Mapping[str, Any]) -> bool:
    """Return whether requests and responses pass between a server and a client, so that they see each other."""
    return passes(client, server) and passes(server, client)


def serves(claim: dict[str, Any], service: str, interface: str) -> bool:
    """Return whether a claim provides a service: as its server, or as a node, for services that every node has."""
    if claim["kind"] == "node":
        return interface.startswith(BACKGROUND_TYPES) and claim["name"] == service.rpartition("/")[0]
    return (claim["kind"], claim["name"], claim["type"]) == ("service", service, interface)


#: The channels on which endpoints receive.
CHANNELS = {"subscription": "topic", "service": "request", "client": "response"}
