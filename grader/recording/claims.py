"""What a process says of its endpoints and its traffic: untrusted values, checked, and which of them fit each other."""

from __future__ import annotations

import re
from typing import Any

from grader.recording.exchanges import PlannedMessages
from grader.recording.service_ends import BACKGROUND_TYPES
from grader.recording.student import Student

#: Nobody sends more messages than this between two reports.
COUNT = 1_000_000
#: Names and types as ROS has them; nothing else that a process calls a name is ever shown.
_NAME = re.compile(r"/[A-Za-z0-9_/]{0,299}")
_TYPE = re.compile(r"[A-Za-z0-9_]+(?:/[A-Za-z0-9_]+){1,2}")
_PARAMETER = re.compile(r"/[A-Za-z0-9_/]{0,150}:[^\s]{1,150}")


def is_name(name: Any) -> bool:
    """Return whether a value is the whole name of a topic, a service or a node."""
    return isinstance(name, str) and _NAME.fullmatch(name) is not None


def counts(data: Any) -> dict[str, int]:
    """Return numbers of messages by channel; what is no channel, or no number of them, is left out."""
    if not isinstance(data, dict):
        return {}
    channels = {name: count for name, count in data.items() if is_name(str(name).partition(" ")[2])}
    return {str(name): min(count, COUNT) for name, count in channels.items() if isinstance(count, int) and count > 0}


def is_claim(claim: Any) -> bool:
    """Return whether a value describes an endpoint, or a parameter, with everything that is asked of it."""
    if not isinstance(claim, dict) or not all(isinstance(claim.get(k), str) for k in ("kind", "name", "type")):
        return False
    kind, name = claim["kind"], claim["name"]
    if kind == "parameter":
        return _PARAMETER.fullmatch(name) is not None
    if not is_name(name) or (kind != "node" and _TYPE.fullmatch(claim["type"]) is None):
        return False
    ends = kind in ("publisher", "subscription")
    bools = all(isinstance(claim.get(k), bool) for k in ("reliable", "latched", "manual"))
    return not ends or (bools and isinstance(claim.get("deadline_ns"), int))


def readers_of(student: Student, topic: str) -> list[dict[str, Any]]:
    """Return the subscriptions that a process says it has on a topic."""
    return [c for c in student.claims if c["kind"] == "subscription" and c["name"] == topic]


def compatible(writer: dict[str, Any], reader: dict[str, Any]) -> bool:
    """Return whether a publisher's offer satisfies a subscription's request (reliability and durability)."""
    return (
        (writer["name"], writer["type"]) == (reader["name"], reader["type"])
        and (writer["reliable"] or not reader["reliable"])
        and (writer["latched"] or not reader["latched"])
        and (reader["deadline_ns"] == 0 or 0 < writer["deadline_ns"] <= reader["deadline_ns"])
        and (writer["manual"] or not reader["manual"])
    )


def offered(stream: PlannedMessages) -> dict[str, Any]:
    """Return the publisher of a stimulus of a fixed type as a process would claim it."""
    return {
        "name": stream.topic,
        "type": stream.type,
        "reliable": not stream.best_effort,
        "latched": stream.latched,
        "deadline_ns": 0,
        "manual": False,
    }


def serves(claim: dict[str, Any], service: str, interface: str) -> bool:
    """Return whether a claim means that a service is there: its server, or the node that every such service has."""
    if claim["kind"] == "node":
        return interface.startswith(BACKGROUND_TYPES) and claim["name"] == service.rpartition("/")[0]
    return (claim["kind"], claim["name"], claim["type"]) == ("service", service, interface)


def takes_ordinary(reader: dict[str, Any]) -> bool:
    """Return whether a subscription takes what a stimulus offers: no deadline, automatic liveliness."""
    return reader["deadline_ns"] == 0 and not reader["manual"]


def announce(arrivals: dict[str, int], channel: str, count: int) -> None:
    """Note that messages are on their way to somebody."""
    arrivals[channel] = arrivals.get(channel, 0) + count
