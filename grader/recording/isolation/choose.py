"""Chooses the tier of isolation by trying it, not by looking at versions."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from grader.model.containment import NO_WALLS, PROPERTIES, REQUIRED, TIERS, Property, TierReport
from grader.model.errors import EnvironmentFault
from grader.recording.isolation import landlock, selftest
from grader.recording.isolation.mechanisms import NOTHING
from grader.recording.isolation.memory import Memory
from grader.recording.isolation.protocol import Isolation
from grader.recording.isolation.remedies import remedy_for
from grader.recording.isolation.tiers import WALLED, isolation_from_name
from grader.recording.isolation.trial import NO_EXCHANGE
from grader.recording.ros_installation import RosInstallation

__all__ = ["AUTO", "Choice", "choose_isolation", "inspect_tiers", "isolation_from_name"]

AUTO = "auto"


@dataclass(frozen=True, slots=True)
class Choice:
    """The tier to record in.

    Attributes:
        isolation: The tier.
        containment: What it was seen to hold back; empty without walls.
    """

    isolation: Isolation
    containment: tuple[Property, ...] = ()


def choose_isolation(wanted: str, ros: RosInstallation) -> Choice:
    """Return the isolation to record in.

    Args:
        wanted: `auto` for the strongest tier that contains what is required; `none` for no walls; or the name of a
            tier, which must keep what it promises.
        ros: What students' processes will run with.

    Raises:
        EnvironmentFault: The tier asked for does not exist or does not hold here, or none does, with what mends it.
    """
    if wanted == NO_WALLS:
        return Choice(isolation_from_name(wanted))
    if wanted != AUTO:
        return _named(wanted, ros)
    tried: list[TierReport] = []
    for name in WALLED:
        tried.append(inspect_tier(name, ros))
        if tried[-1].usable:
            return Choice(isolation_from_name(name), tried[-1].properties)
    raise _refusal(tried)


def inspect_tiers(ros: RosInstallation) -> tuple[TierReport, ...]:
    """Try every tier anew and return what each is worth here, strongest first; the one without walls comes last."""
    open_ones = tuple(Property(name, holds=False, mechanism=NOTHING) for name in PROPERTIES)
    nothing = TierReport(NO_WALLS, TIERS[NO_WALLS], usable=False, why="it contains nothing", properties=open_ones)
    return (*(inspect_tier(name, ros, afresh=True) for name in WALLED), nothing)


def inspect_tier(name: str, ros: RosInstallation, *, afresh: bool = False) -> TierReport:
    """Return what one tier is worth here, from the last self-test if nothing that matters has changed since.

    Args:
        name: Tier name.
        ros: What students' processes will run with.
        afresh: Whether to test it in any case.
    """
    try:
        isolation = isolation_from_name(name)
    except EnvironmentFault as fault:
        return TierReport(name, TIERS[name], usable=False, why=fault.message, remedy=fault.hint)
    memory = Memory.of(name, ros)
    remembered = None if afresh else memory.recall()
    if remembered is not None:
        return remembered
    report = selftest.inspect(isolation, ros)
    if _kept(report):
        memory.keep(report)
        return report
    return TierReport(name, report.tier, report.usable, report.why, report.properties, remedy_for(report))


def _named(wanted: str, ros: RosInstallation) -> Choice:
    isolation = isolation_from_name(wanted)
    report = inspect_tier(wanted, ros)
    if not _kept(report):
        raise EnvironmentFault(f"isolation {wanted}: expected a sandbox that holds, found: {report.why}", report.remedy)
    return Choice(isolation, report.properties)


def _kept(report: TierReport) -> bool:
    """Return whether a tier keeps what it promises: Landlock promises nothing about a network that it was given."""
    promised = [name for name in REQUIRED if report.name != landlock.NAME or name != "net_egress"]
    broken = [found for found in report.properties if found.name in promised and not found.holds]
    return bool(report.properties) and not broken and NO_EXCHANGE not in report.why


def _refusal(tried: Sequence[TierReport]) -> EnvironmentFault:
    found = "; ".join(f"{report.name}: {report.why}" for report in tried if "expected root" not in report.why)
    remedies = [report.remedy for report in tried if report.remedy]
    hint = remedies[0] if remedies else "look at what each tier lacks: grade doctor"
    wanted = ", ".join(REQUIRED)
    return EnvironmentFault(f"isolation: expected a sandbox that contains {wanted}, found none ({found})", hint)
