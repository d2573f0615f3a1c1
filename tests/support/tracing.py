"""Builds traces for tests from a few calls; times in seconds."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

from grader.runtime.model.quantities import nanoseconds
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
)
from grader.runtime.worker.ending import exited

TWIST = "geometry_msgs/msg/Twist"
ODOMETRY = "nav_msgs/msg/Odometry"
FLOAT32 = "std_msgs/msg/Float32"
FLOAT64 = "std_msgs/msg/Float64"
TRIGGER = "std_srvs/srv/Trigger"
_PHASE = {Mark: 0, Delivery: 1, GraphSnapshot: 2}


@dataclass
class Recording:
    """Collects observations and makes a trace of them, sorted as a recording is."""

    stop_s: float = 10.0
    clock: ClockKind = ClockKind.VIRTUAL
    process: str = "node.py"
    items: list[Observation] = field(default_factory=list)
    ends: list[Endpoint] = field(default_factory=list)
    services: list[ServiceEnd] = field(default_factory=list)

    def add(self, *observations: Observation) -> Recording:
        self.items.extend(observations)
        return self

    def message(self, t_s: float, topic: str, value: Mapping[str, Any], type_: str = FLOAT32) -> Recording:
        return self.add(Message(nanoseconds(t_s), topic, type_, value))

    def number(self, t_s: float, topic: str, value: float, type_: str = FLOAT32) -> Recording:
        return self.message(t_s, topic, {"data": value}, type_)

    def deliver(self, t_s: float, topic: str, value: Mapping[str, Any], type_: str = FLOAT32) -> Recording:
        return self.add(Delivery(nanoseconds(t_s), topic, type_, value))

    def log(
        self,
        t_s: float,
        text: str,
        severity: str = "INFO",
        process: str | None = None,
        line: int = 0,
        logger: str = "node",
    ) -> Recording:
        who = process or self.process
        return self.add(LogRecord(nanoseconds(t_s), who, severity, logger, text, who if line else "", line))

    def line(self, t_s: float, text: str, stream: str = "stdout", process: str | None = None) -> Recording:
        return self.add(OutputLine(nanoseconds(t_s), process or self.process, stream, text))

    def fault(
        self,
        t_s: float,
        kind: FaultKind,
        text: str,
        line: int = 0,
        process: str | None = None,
        frames: tuple[str, ...] = (),
        **details: Any,
    ) -> Recording:
        """Add a fault; details are those of `Fault`, such as `exit_code`."""
        who = process or self.process
        file = who if line else ""
        return self.add(Fault(nanoseconds(t_s), who, kind, text, file, line, frames, **details))

    def exited(self, t_s: float, code: int = 0, process: str | None = None) -> Recording:
        return self.add(exited(process or self.process, nanoseconds(t_s), code))

    def crashed(
        self, t_s: float, text: str = "ValueError: no", line: int = 12, process: str | None = None
    ) -> Recording:
        return self.fault(t_s, FaultKind.EXCEPTION, text, line, process)

    def endpoint(
        self,
        kind: str,
        topic: str,
        type_: str = FLOAT32,
        node: str = "/node",
        participant: int = 1,
        reliability: str = "reliable",
        durability: str = "volatile",
        t_s: float = 0.0,
        **policies: Any,
    ) -> Recording:
        """Add an endpoint and the snapshot that shows it; `policies` are further ones, such as `deadline_ns`."""
        self.ends.append(Endpoint(kind, topic, type_, node, participant, reliability, durability, 10, **policies))
        return self.snapshot(t_s, self.ends)

    def snapshot(self, t_s: float, ends: Sequence[Endpoint]) -> Recording:
        nodes = tuple(sorted({e.node for e in ends}))
        return self.add(GraphSnapshot(nanoseconds(t_s), nodes, tuple(ends), tuple(self.services)))

    def service(
        self, kind: str, service: str, type_: str = TRIGGER, node: str = "/node", t_s: float = 0.0, **policies: str
    ) -> Recording:
        """Add a server or a client to the graph, and the snapshot that shows it; `policies` are those of its QoS."""
        self.services.append(ServiceEnd(kind, service, type_, node, **policies))
        return self.snapshot(t_s, self.ends)

    def request(
        self,
        t_s: float,
        service: str,
        number: int,
        sender: str = "grader",
        value: Mapping[str, Any] | None = None,
        type_: str = TRIGGER,
        client: int = 1,
    ) -> Recording:
        """Add a request; its client is 0 where a student asks."""
        who = client if sender == "grader" else 0
        return self.add(Request(nanoseconds(t_s), service, type_, number, sender, who, value or {}))

    def response(
        self,
        t_s: float,
        service: str,
        number: int,
        value: Mapping[str, Any],
        sender: str = "student",
        type_: str = TRIGGER,
        client: int = 1,
    ) -> Recording:
        """Add the response to the request of that number."""
        who = client if sender == "student" else 0
        return self.add(Response(nanoseconds(t_s), service, type_, number, sender, who, value))

    def mark(self, t_s: float, name: str, detail: str) -> Recording:
        return self.add(Mark(nanoseconds(t_s), name, detail))

    def trace(self, scenario: str = "alone", **rest: Any) -> AssessedTrace:
        ordered = sorted(self.items, key=lambda o: (o.t_ns, _PHASE.get(type(o), 3)))
        return AssessedTrace(scenario, self.clock, nanoseconds(self.stop_s), tuple(ordered), **rest)


def twist(linear: Sequence[float] = (0.5, 0, 0), angular: Sequence[float] = (0, 0, 0.1)) -> dict[str, Any]:
    return {"linear": dict(zip("xyz", linear, strict=True)), "angular": dict(zip("xyz", angular, strict=True))}


def velocity(
    rate: float = 20.0, stop_s: float = 10.05, start_s: float = 0.05, topic: str = "/cmd_vel", **value: Any
) -> Recording:
    """A velocity publisher at a rate, with one log record."""
    rec = Recording(stop_s, process="velocity_publisher.py").endpoint("publisher", topic, TWIST, "/velocity_publisher")
    for k in range(math.ceil((stop_s - start_s) * rate - 1e-9)):
        rec.message(start_s + k / rate, topic, twist(**value), TWIST)
    return rec


def odometry_value(x: float, y: float, heading: float, speed: float, turn: float) -> dict[str, Any]:
    half = heading / 2
    orientation = {"x": 0.0, "y": 0.0, "z": math.sin(half), "w": math.cos(half)}
    return {
        "pose": {"pose": {"position": {"x": x, "y": y, "z": 0.0}, "orientation": orientation}},
        "twist": {
            "twist": {"linear": {"x": speed, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": turn}},
        },
    }


def drive(t_s: float) -> tuple[float, float, float, float, float]:
    """Where the robot of the tests is: x, y, heading, speed and turn rate, all of them always changing."""
    x = 2.31 * math.cos(0.31 * t_s + 0.4) - 0.2
    y = 1.87 * math.sin(0.43 * t_s - 2.1) + 0.3
    return x, y, 0.21 * t_s - 1.3, 0.35 + 0.1 * math.sin(0.7 * t_s), 0.21 + 0.05 * math.cos(t_s)


ODOM_TIMES = [5.0 + k / 26.8 + 0.002 * math.sin(7 * k) * (k > 0) for k in range(int(16 * 26.8))]


def driving(standing: bool = False) -> Recording:
    """Exercise 2's scenario without a node: silence for 5 s, 16 s of odometry, 3 s of silence."""
    rec = Recording(24.0, process="odom_subscriber.py")
    rec.endpoint("subscription", "/odom", ODOMETRY, "/odom_subscriber")
    rec.mark(5.0, "stream_starts", "/odom").mark(21.0, "stream_stops", "/odom")
    for t in ODOM_TIMES:
        rec.deliver(t, "/odom", odometry_value(*drive(5.0 if standing else t)), ODOMETRY)
    return rec


def pose_at(t_s: float, standing: bool = False) -> tuple[float, float, float, float, float]:
    """The newest odometry at a time."""
    newest = max(t for t in ODOM_TIMES if t <= t_s + 1e-12)
    return drive(5.0 if standing else newest)


def position_logs(
    write: Callable[[float, float], str | Iterable[str]],
    times: Iterable[float] | None = None,
    printed: bool = False,
    standing: bool = False,
) -> Recording:
    """A node that writes the newest position, each text of one instant a record of its own."""
    rec = driving(standing)
    for t in times if times is not None else [6.0 + k for k in range(18)]:
        x, y, *_ = pose_at(t, standing)
        texts = write(x, y)
        for text in [texts] if isinstance(texts, str) else texts:
            if printed:
                for part in text.split("\n"):
                    rec.line(t, part)
            else:
                rec.log(t, text)
    return rec


FAN_VALUES = (21.7, 25.0, 25.001, 28.3, 24.999, 29.2, 25.0, 22.4)


def scripted(values: Sequence[float] = FAN_VALUES, topic: str = "/temperature", stop_s: float = 17.0) -> Recording:
    """Numbers held for 2 s each from 0.5 s on, sent every 200 ms."""
    rec = Recording(stop_s, process="fan_controller.py")
    for k in range(10 * len(values)):
        rec.deliver(0.5 + 0.2 * k, topic, {"data": values[k // 10]})
    return rec


def held_at(t_s: float, values: Sequence[float] = FAN_VALUES) -> float | None:
    """The newest scripted number at a time; None before the first."""
    k = math.floor((t_s - 0.5) / 0.2 + 1e-6)
    return None if k < 0 else values[min(k // 10, len(values) - 1)]
