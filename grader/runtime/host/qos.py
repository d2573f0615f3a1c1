"""The QoS of endpoints, as far as it decides who is matched and what a late counterpart still gets."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any

from rclpy.qos import (
    DeadlineBestAvailable,
    DurabilityPolicy,
    LivelinessLeaseDurationeBestAvailable,
    LivelinessPolicy,
    QoSProfile,
    ReliabilityPolicy,
)

from .protocol import EndQos

#: A QoS duration of at least this means infinite.
INFINITE_NS = 9_000_000_000_000_000_000


def described_qos(qos: Any, kind: str) -> EndQos:
    """Describe the QoS of a publisher or subscription, as far as it decides who is matched."""
    writes = kind == "publisher"
    # a service that asks for what is best gets the usual
    reliable = qos.reliability in (ReliabilityPolicy.RELIABLE, ReliabilityPolicy.BEST_AVAILABLE)
    latched = qos.durability == DurabilityPolicy.TRANSIENT_LOCAL
    # the defaults of DDS: a writer is reliable and transient local, a reader is neither
    if qos.reliability in (ReliabilityPolicy.SYSTEM_DEFAULT, ReliabilityPolicy.UNKNOWN):
        reliable = writes
    if qos.durability in (DurabilityPolicy.SYSTEM_DEFAULT, DurabilityPolicy.UNKNOWN):
        latched = writes
    return EndQos(
        reliable,
        latched,
        finite_ns(qos.deadline),
        manual=qos.liveliness == LivelinessPolicy.MANUAL_BY_TOPIC,
        lease_ns=finite_ns(qos.liveliness_lease_duration),
    )


def finite_ns(duration: Any) -> int:
    """Return a QoS duration in nanoseconds; 0 for an infinite one, which means that none is set."""
    nanoseconds = int(duration.nanoseconds)
    return nanoseconds if 0 < nanoseconds < INFINITE_NS else 0


def is_latched(publisher: Any) -> bool:
    """Return whether who discovers a publisher later gets its last messages as well."""
    return described_qos(publisher.qos_profile, "publisher").latched


def asks_for_best(values: Iterable[Any]) -> bool:
    """Return whether one of some arguments is a QoS profile that depends on the endpoints that exist already."""
    profiles = [value for value in values if isinstance(value, QoSProfile)]
    return any(
        profile.reliability == ReliabilityPolicy.BEST_AVAILABLE
        or profile.durability == DurabilityPolicy.BEST_AVAILABLE
        or profile.liveliness == LivelinessPolicy.BEST_AVAILABLE
        or profile.deadline == DeadlineBestAvailable
        or profile.liveliness_lease_duration == LivelinessLeaseDurationeBestAvailable
        for profile in profiles
    )
