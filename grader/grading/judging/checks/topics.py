"""Checks on the content of topics: types, fields, subscriptions, and transforms between frames."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar

from grader.grading.judging.charts import gaps_panel
from grader.grading.judging.checks.fields import EqualFields
from grader.grading.judging.findings import (
    explain_fault,
    explain_no_message,
    explain_no_subscription,
    met,
    not_met,
    request_said,
)
from grader.grading.judging.plots import Drawing, Plot, value_panels
from grader.grading.judging.values import (
    FieldRule,
    equals,
    number_at,
    numbers_by_path,
    published,
    student_endpoints,
    text_at,
)
from grader.grading.model.chart import Level
from grader.grading.model.exercise import NODE_GRAPH, Finding, ProblemKind, Roles
from grader.grading.model.wording import first_few, moment, number, numbers, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import SLACK, FieldNumber, FieldOf, Hertz, counted, seconds, within
from grader.runtime.model.trace import Message, Trace, unusual_request


@dataclass(frozen=True, slots=True)
class Publishes:
    """At least one message of a type is published on a topic; QoS, depth and the way the name is written are free.

    Attributes:
        topic: Topic name as on the wire, e.g. `/cmd_vel`.
        type: Message type, e.g. `geometry_msgs/msg/Twist`.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    topic: str
    type: str
    after_discovery: bool = False

    @property
    def expected(self) -> str:
        return f"at least one {self.type} message on {self.topic}"

    def judge(self, trace: Trace) -> Finding:
        messages = [m for m in published(trace, self.topic, self.after_discovery) if m.type == self.type]
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
        topic: Topic name as on the wire, e.g. `/scan`.
        type: Message type, e.g. `sensor_msgs/msg/LaserScan`.
    """

    drawing: ClassVar[str] = NODE_GRAPH
    roles: ClassVar[Roles] = Roles(hears=("topic",))
    topic: str
    type: str

    @property
    def expected(self) -> str:
        return f"a subscription to {self.topic} with type {self.type} that an ordinary publisher can reach"

    def judge(self, trace: Trace) -> Finding:
        mine = [e for e in student_endpoints(trace, "subscription") if (e.topic, e.type) == (self.topic, self.type)]
        if not mine:
            return explain_no_subscription(trace, self.topic, self.type)
        # One that fits suffices: a node may have others for other purposes.
        fitting = [e for e in mine if unusual_request(e) is None]
        chosen = (fitting or mine)[0]
        evidence = {
            "topic": self.topic,
            "type": self.type,
            "node": chosen.node,
            "reliability": chosen.reliability,
            "durability": chosen.durability,
        }
        unmet = unusual_request(chosen)
        if unmet is None:
            return met(f"{self.topic}: {quote(chosen.node)} subscribes with type {self.type}", evidence)
        reason = f"{self.topic}: the subscription of {quote(chosen.node)} asks for {request_said(unmet)}"
        hint = f"subscribe with the default {unmet.policy.replace('_', ' ')}: pass the queue depth 10 as QoS"
        return not_met(f"{reason}: no message arrives", evidence, hint=hint, problem=ProblemKind.KEPT_APART)


@dataclass(frozen=True, slots=True)
class FieldValues(EqualFields):
    """Every message on a topic holds the given numbers.

    Attributes:
        topic: Topic name as on the wire.
        values: Number expected by field path, e.g. `linear.x: 0.5`; fields not named are free.
        tolerance: Largest difference, unit of the field.
        after_discovery: Whether messages do not count that are sent as soon as the publisher is created, before anybody
            can have discovered it.
    """

    topic: str
    values: Annotated[Mapping[str, FieldNumber], FieldOf("topic")]
    tolerance: float = 1e-6
    after_discovery: bool = False

    @property
    def rules(self) -> dict[str, FieldRule]:
        """What is expected by field path."""
        return {path: FieldRule(equals=want, tolerance=self.tolerance) for path, want in self.values.items()}

    def slip(self, first: Message, paths: Sequence[str]) -> str:
        """Return the very likely slip in a message: field, sign or unit; empty if there is none."""
        got = {p: g for p in paths if (g := number_at(first.value, p)) is not None}
        for path, value in got.items():
            want = self.values[path]
            # Zero in another field proves nothing: most fields of a message are zero.
            if abs(want) <= self.tolerance:
                continue
            # A value in another field first: with it, sign and unit of this one mean nothing.
            hint = self._misplaced(first, path, want) or _sign_or_unit(path, value, want)
            if hint:
                return hint
        # If several fields differ, one that should be zero is a symptom of the others.
        stray = next((p for p, g in got.items() if within(self.values[p], 0.0, SLACK) and not within(g, 0.0, 1e-6)), "")
        return f"leave {stray} at 0.0" if stray and len(got) == 1 else ""

    def _misplaced(self, message: Message, path: str, want: float) -> str:
        for other, value in numbers_by_path(message.value).items():
            free = other not in self.values or not equals(value, self.values[other], self.tolerance)
            if other != path and free and equals(value, want, self.tolerance):
                return f"{number(want)} is in {quote(other)}; it belongs in {path}"
        return ""


def _sign_or_unit(path: str, got: float, want: float) -> str:
    """Return a hint for a value that has the wrong sign or unit; empty otherwise."""
    if got == 0.0 or not math.isfinite(got):
        return ""
    ratio = got / want
    if math.isclose(ratio, -1.0, rel_tol=1e-6):
        return f"the sign of {path} is inverted"
    if "angular" in path and (
        # 1 %, because programs convert with 3.14 or 57; no other unit is near.
        math.isclose(abs(ratio), 180 / math.pi, rel_tol=0.01) or math.isclose(abs(ratio), math.pi / 180, rel_tol=0.01)
    ):
        return f"{path} is in rad/s; {number(got)} looks like a conversion between degrees and radians"
    if "linear" not in path:
        return ""
    # Other factors are rarely units, and a hint that is wrong costs more time than none.
    factors = {1000.0: "mm/s", 100.0: "cm/s", 3.6: "km/h"}
    unit = next((u for f, u in factors.items() if math.isclose(ratio, f, rel_tol=1e-3)), "")
    return f"{path} is in m/s; {number(got)} looks like {unit}" if unit else ""


_AXES = ("x", "y", "z")
_QUATERNION = ("x", "y", "z", "w")
_PARTS = (("translation", _AXES), ("rotation", _QUATERNION))


@dataclass(frozen=True, slots=True)
class _Found:
    """One transform of a message."""

    t_ns: int
    value: Mapping[str, object]

    @property
    def frames(self) -> tuple[str, str]:
        parent, child = text_at(self.value, "header.frame_id"), text_at(self.value, "child_frame_id")
        # tf2 refuses a leading slash today, and older code still writes it; the frame meant is the same.
        return (parent or "").lstrip("/"), (child or "").lstrip("/")

    def numbers(self, part: str, names: tuple[str, ...]) -> list[float]:
        found = [number_at(self.value, f"transform.{part}.{name}") for name in names]
        return [math.nan if f is None else f for f in found]


@dataclass(frozen=True, slots=True)
class Transform:
    """The transform from a parent frame to a child frame is published, with the given translation and rotation.

    Every published one must be right. A quaternion and its negative are the same rotation.

    Attributes:
        parent: Parent frame of the transform, e.g. `map`.
        child: Child frame of the transform, e.g. `base_link`.
        static: Whether it must be on `/tf_static`, or on `/tf`; either if left out.
        translation: Expected metres along `x`, `y` and `z`; those left out are free.
        rotation: Expected quaternion `x`, `y`, `z` and `w`; those left out are 0. Free if left out entirely.
        tolerance: Largest difference of each number.
        rate: Expected rate; free if left out.
        rate_tolerance: Largest difference of the rate.
        after_discovery: Whether transforms do not count that are sent as soon as the publisher is created, before
            anybody can have discovered it.
    """

    parent: str
    child: str
    static: bool | None = None
    translation: Mapping[str, float] | None = None
    rotation: Mapping[str, float] | None = None
    tolerance: float = 1e-3
    rate: Hertz | None = None
    rate_tolerance: Hertz = 1.0
    after_discovery: bool = False

    @property
    def expected(self) -> str:
        rate = "" if self.rate is None else f" at {number(self.rate)} ± {number(self.rate_tolerance)} Hz"
        return f"the transform {self.parent} → {self.child} on {' or '.join(self.topics)}{rate}"

    @property
    def topics(self) -> tuple[str, ...]:
        return {True: ("/tf_static",), False: ("/tf",), None: ("/tf", "/tf_static")}[self.static]

    def judge(self, trace: Trace) -> Finding:
        sent = [m for topic in self.topics for m in published(trace, topic, self.after_discovery)]
        found = [_Found(m.t_ns, t) for m in sent for t in _transforms(m)]
        wanted = (self.parent.lstrip("/"), self.child.lstrip("/"))
        mine = sorted((f for f in found if f.frames == wanted), key=lambda f: f.t_ns)
        if not mine:
            return self._absent(trace, found)
        evidence = {"transforms": len(mine), "first_s": seconds(mine[0].t_ns), "last_s": seconds(mine[-1].t_ns)}
        for one in mine:
            flaw = self._flaw(one)
            if flaw:
                reason = f"{moment(one.t_ns)}, {self.parent} → {self.child}: {flaw}"
                return not_met(reason, evidence | {"first_wrong_s": seconds(one.t_ns)}, problem=ProblemKind.WRONG_VALUE)
        pace = self._pace_flaw(mine)
        text = f"{self.parent} → {self.child}: {counted(len(mine), 'transform')}"
        if not pace:
            return met(text, evidence)
        # A node that crashed stops sending, which is why the rate is wrong.
        return explain_fault(trace, f"{text}, {pace}", evidence, last=True) or not_met(
            f"{text}, {pace}", evidence, problem=ProblemKind.WRONG_RATE
        )

    def _flaw(self, one: _Found) -> str:
        got = one.numbers("translation", _AXES)
        for name, value in zip(_AXES, got, strict=True):
            wanted = (self.translation or {}).get(name)
            if wanted is not None and not within(value, wanted, self.tolerance):
                return f"translation {name} is {number(value)} m, expected {number(wanted)} m"
        if self.rotation is None:
            return ""
        asked = [self.rotation.get(name, 0.0) for name in _QUATERNION]
        turned = one.numbers("rotation", _QUATERNION)
        # As a whole: with a sign for each number, other rotations would pass too.
        same = any(all(within(g, s * w, self.tolerance) for g, w in zip(turned, asked, strict=True)) for s in (1, -1))
        return "" if same else f"rotation is ({numbers(turned)}), expected ({numbers(asked)}) as x, y, z, w"

    def _pace_flaw(self, mine: list[_Found]) -> str:
        if self.rate is None:
            return ""
        length = seconds(mine[-1].t_ns - mine[0].t_ns)
        rate = (len(mine) - 1) / length if length else 0.0
        if within(rate, self.rate, self.rate_tolerance):
            return ""
        return f"{rate:.3f} Hz, expected {number(self.rate)} ± {number(self.rate_tolerance)} Hz"

    def _absent(self, trace: Trace, found: list[_Found]) -> Finding:
        if not found:
            other = {"/tf": "/tf_static", "/tf_static": "/tf"}.get(self.topics[0]) if self.static is not None else None
            if other and published(trace, other):
                reason = f"{self.topics[0]}: no transform; there are some on {other}"
                return not_met(reason, hint=f"publish it on {self.topics[0]}", problem=ProblemKind.OTHER_NAME)
            return explain_no_message(trace, self.topics[0])
        pairs = list(dict.fromkeys(f"{quote(p, 30)} → {quote(c, 30)}" for p, c in (f.frames for f in found)))
        reason = f"no transform {self.parent} → {self.child}; found {first_few(pairs)}"
        swapped = any(f.frames == (self.child.lstrip("/"), self.parent.lstrip("/")) for f in found)
        hint = f"header.frame_id is the parent, {self.parent}, and child_frame_id is {self.child}" if swapped else ""
        return not_met(reason, {"found": pairs[:20]}, hint=hint, problem=ProblemKind.OTHER_NAME)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the numbers of the transform, and the time from each to the next if a rate is expected."""
        pair = (self.parent.lstrip("/"), self.child.lstrip("/"))
        topics = [t for t in self.topics if published(trace, t)]
        found = [_Found(m.t_ns, t) for topic in topics for m in published(trace, topic) for t in _transforms(m)]
        mine = sorted((f for f in found if f.frames == pair), key=lambda f: f.t_ns)
        if not mine:
            frames = ("transforms[0].header.frame_id", "transforms[0].child_frame_id")
            return Drawing(tuple(Plot(topic, frames) for topic in topics))
        rules = {f"translation.{name}": FieldRule(equals=v) for name, v in (self.translation or {}).items()}
        if self.rotation is not None:
            rules |= {f"rotation.{name}": FieldRule(equals=self.rotation.get(name, 0.0)) for name in _QUATERNION}
        fields = tuple(f"{part}.{n}" for part, names in _PARTS for n in names)
        timed = [(f.t_ns, _part(f.value)) for f in mine]
        said = f"{counted(len(mine), 'transform')} {self.parent} → {self.child}"
        panels = value_panels(Plot(" and ".join(topics), fields, rules), timed, said)
        if self.rate is not None:
            level = Level(1 / self.rate, f"{number(1 / self.rate)} s")
            panels.append((gaps_panel("transform", [f.t_ns for f in mine], levels=(level,)), ""))
        return Drawing(panels=tuple(panels), title=f"The transform {self.parent} → {self.child}")


def _part(value: Mapping[str, object]) -> Mapping[str, object]:
    found = value.get("transform")
    return found if isinstance(found, Mapping) else {}


def _transforms(message: Message) -> list[Mapping[str, object]]:
    found = message.value.get("transforms")
    return [t for t in found if isinstance(t, Mapping)] if isinstance(found, (list, tuple)) else []
