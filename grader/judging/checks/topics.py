"""Checks on what a topic carries: its type, its fields, and who listens."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grader.core.exercise import Finding
from grader.core.quantities import SLACK, seconds, within
from grader.core.trace import Endpoint, Message, Trace
from grader.judging.findings import met, not_met
from grader.judging.silence import explain_no_message, explain_no_subscription, student_endpoints
from grader.judging.values import field, leaves, published
from grader.judging.wording import counted, moment, number, quote


@dataclass(frozen=True, slots=True)
class Publishes:
    """At least one message of a type is published on a topic; QoS, depth and the way the name is written are free.

    Attributes:
        topic: Topic name as on the wire, e.g. `/cmd_vel`.
        type: Message type, e.g. `geometry_msgs/msg/Twist`.
    """

    topic: str
    type: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for one message or more."""
        messages = [m for m in published(trace, self.topic) if m.type == self.type]
        if not messages:
            return explain_no_message(trace, self.topic, self.type)
        reason = f"{self.topic}: {counted(len(messages), 'message')} of type {self.type}"
        reason += f", the first at {moment(messages[0].t_ns)}"
        evidence = {"topic": self.topic, "type": self.type, "messages": len(messages)}
        return met(reason, evidence | {"first_s": seconds(messages[0].t_ns)})


@dataclass(frozen=True, slots=True)
class Subscribes:
    """A subscription that a RELIABLE and VOLATILE publisher of a type on a topic would reach.

    Attributes:
        topic: Topic name as on the wire, e.g. `/odom`.
        type: Message type, e.g. `nav_msgs/msg/Odometry`.
    """

    topic: str
    type: str

    def judge(self, trace: Trace) -> Finding:
        """Return full credit for one fitting subscription or more."""
        mine = [e for e in student_endpoints(trace, "subscription") if (e.topic, e.type) == (self.topic, self.type)]
        if not mine:
            return explain_no_subscription(trace, self.topic, self.type)
        fitting = [e for e in mine if not _demand(e)]
        chosen = (fitting or mine)[0]
        evidence = {
            "topic": self.topic,
            "type": self.type,
            "node": chosen.node,
            "reliability": chosen.reliability,
            "durability": chosen.durability,
        }
        if fitting:
            return met(f"{self.topic}: {quote(chosen.node)} subscribes with type {self.type}", evidence)
        reason = (
            f"{self.topic}: the subscription of {quote(chosen.node)} asks for {_demand(chosen)}: no message arrives"
        )
        return not_met(reason, evidence, hint="subscribe with the default durability: pass the queue depth 10 as QoS")


def _demand(subscription: Endpoint) -> str:
    """Return what a subscription asks for that an ordinary publisher does not offer; empty if nothing."""
    if subscription.durability == "transient_local":
        return "transient_local durability, which a volatile publisher does not offer"
    if subscription.deadline_ns:
        return (
            f"a deadline of {number(seconds(subscription.deadline_ns))} s, which a publisher without one does not offer"
        )
    if subscription.liveliness == "manual_by_topic":
        return "manual_by_topic liveliness, which a publisher with automatic liveliness does not offer"
    return ""


@dataclass(frozen=True, slots=True)
class FieldValues:
    """Every message on a topic holds the same given numbers.

    Attributes:
        topic: Topic name as on the wire.
        values: Number expected by field path, e.g. `linear.x: 0.5`; fields not named are free.
        tolerance: Largest difference, unit of the field.
    """

    topic: str
    values: Mapping[str, float]
    tolerance: float = 1e-6

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if no message differs; the reason names the first that does."""
        messages = published(trace, self.topic)
        if not messages:
            return explain_no_message(trace, self.topic)
        wrong = self._differing(messages)
        if wrong:
            return self._differs(wrong, len(messages))
        wanted = ", ".join(f"{path} = {number(want)}" for path, want in self.values.items())
        reason = f"{self.topic}: {wanted} in {counted(len(messages), 'message')}"
        return met(reason, {"topic": self.topic, "values": dict(self.values), "messages": len(messages), "wrong": 0})

    def _differing(self, messages: Sequence[Message]) -> list[Message]:
        """Return the messages with a wrong field; one that equals a right one before it is right."""
        wrong = []
        right: tuple[str, Mapping[str, Any]] | None = None
        for message in messages:
            content = (message.type, message.value)
            if content == right:
                continue
            if self._wrong_fields(message):
                wrong.append(message)
            else:
                right = content
        return wrong

    def _wrong_fields(self, message: Message) -> dict[str, float | None]:
        got = {path: field(message.value, path) for path in self.values}
        return {p: g for p, g in got.items() if g is None or not within(g, self.values[p], self.tolerance)}

    def _differs(self, wrong: list[Message], total: int) -> Finding:
        first = wrong[0]
        fields = self._wrong_fields(first)
        missing = [path for path, got in fields.items() if got is None]
        evidence = {
            "topic": self.topic,
            "values": dict(self.values),
            "messages": total,
            "wrong": len(wrong),
            "first_wrong_s": seconds(first.t_ns),
            "found": {path: got for path, got in fields.items() if got is not None},
        }
        where = f"{moment(first.t_ns)}, {self.topic}"
        if missing:
            return not_met(f"{where}: {quote(first.type)} has no field {missing[0]}", evidence)
        found = ", ".join(f"{p} is {number(g)}" for p, g in fields.items() if g is not None)
        wanted = ", ".join(number(self.values[p]) for p in fields)
        share = f"in all {total} messages" if len(wrong) == total else f"in {len(wrong)} of {total} messages"
        reason = f"{where}: {found}, expected {wanted}; wrong {'in the only message' if total == 1 else share}"
        return not_met(reason, evidence, hint=self._hint(first))

    def _hint(self, message: Message) -> str:
        """Return what is very likely the slip in a message: place, sign or unit; empty if nothing is."""
        got = {p: g for p, g in self._wrong_fields(message).items() if g is not None}
        for path, value in got.items():
            want = self.values[path]
            if abs(want) <= self.tolerance:
                continue
            hint = self._misplaced(message, path, want) or _sign_or_unit(path, value, want)
            if hint:
                return hint
        stray = next((p for p, g in got.items() if within(self.values[p], 0.0, SLACK) and not within(g, 0.0, 1e-6)), "")
        return f"leave {stray} at 0.0" if stray and len(got) == 1 else ""

    def _misplaced(self, message: Message, path: str, want: float) -> str:
        for other, value in leaves(message.value).items():
            free = other not in self.values or not within(value, self.values[other], self.tolerance)
            if other != path and free and within(value, want, self.tolerance):
                return f"{number(want)} is in {quote(other)}; it belongs in {path}"
        return ""


def _sign_or_unit(path: str, got: float, want: float) -> str:
    """Return a hint for a value that is right but for its sign or its unit."""
    if got == 0.0 or not math.isfinite(got):
        return ""
    ratio = got / want
    if math.isclose(ratio, -1.0, rel_tol=1e-6):
        return f"the sign of {path} is the wrong way round"
    angular = "angular" in path
    if angular and (
        math.isclose(abs(ratio), 180 / math.pi, rel_tol=0.01) or math.isclose(abs(ratio), math.pi / 180, rel_tol=0.01)
    ):
        return f"{path} is in rad/s; {number(got)} looks like a conversion between degrees and radians"
    factors = {1000.0: "mm/s", 100.0: "cm/s", 3.6: "km/h"}
    unit = next((u for f, u in factors.items() if math.isclose(ratio, f, rel_tol=1e-3)), "")
    return f"{path} is in m/s; {number(got)} looks like {unit}" if unit and not angular else ""
