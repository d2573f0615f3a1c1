"""Chooses the sandbox tier by testing it, not by comparing versions."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from dataclasses import replace

from grader.runtime.model.checkup import NO_SANDBOX, PROPERTIES, REQUIRED, TIERS, Fact, Property, TierReport, missing
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox import tiers
from grader.runtime.sandbox.bubblewrap import has_bubblewrap
from grader.runtime.sandbox.memory import Memory
from grader.runtime.sandbox.properties import NO_EXCHANGE, NOTHING, remedy_for
from grader.runtime.sandbox.protocol import Isolation
from grader.runtime.sandbox.tiers import ISOLATING, is_for_others, isolation_from_name

AUTO = "auto"
#: For programs of one's own: no sandbox, but a network of their own if bubblewrap can make one.
OWN_PROGRAMS = "own-programs"
#: Seconds that the trial of it may take; it takes 10 ms.
TRIED_S = 20.0
#: How much of the reason against each tier is shown if all tiers are refused.
MOST_CHARACTERS = 100


def _self_test(isolation: Isolation, ros: RosInstallation) -> TierReport:
    from grader.runtime.sandbox import selftest  # noqa: PLC0415 - most runs use the result of an earlier one

    return selftest.inspect(isolation, ros)


@dataclass(frozen=True, slots=True)
class Machine:
    """The machine and the user that a tier is chosen for."""

    ros: RosInstallation
    # Finds a tier by its name; raises EnvironmentFault if the machine lacks a part of it or it is for another user
    isolation: Callable[[str], Isolation] = isolation_from_name
    self_test: Callable[[Isolation, RosInstallation], TierReport] = _self_test
    is_for_others: Callable[[str], bool] = is_for_others


@dataclass(frozen=True, slots=True)
class TierChoice:
    """The tier to record in."""

    isolation: Isolation
    containment: tuple[Property, ...] = ()  # what the self-test found it to prevent; empty without a sandbox
    lacks: str = ""  # why own programs get no network of their own, in words; empty if they do


def _silent(step: str) -> None:
    """Ignore a progress message."""


def choose_isolation(wanted: str, machine: Machine, progress: Callable[[str], None] = _silent) -> TierChoice:
    """Choose the tier to record in; raises EnvironmentFault, with a fix as its hint, if it does not work here.

    Wanted is `auto` for the strongest tier that has all required properties, `none` for no sandbox, `own-programs` for
    a network of their own where that is possible, or the name of a tier, which must have the properties that it
    promises. When a sandbox is tested, `progress` gets the reason.
    """
    if wanted == NO_SANDBOX:
        return TierChoice(machine.isolation(wanted))
    if wanted == OWN_PROGRAMS:
        return for_own_programs(machine)
    if wanted != AUTO:
        return _named(wanted, machine, progress)
    tried: list[TierReport] = []
    for name in ISOLATING:
        tried.append(inspect_tier(name, machine, progress))
        if tried[-1].usable:
            return TierChoice(machine.isolation(name), tried[-1].properties)
    raise _refusal([report for report in tried if not machine.is_for_others(report.name)], tried)


def for_own_programs(machine: Machine) -> TierChoice:
    """Return what isolates the network of programs that need no sandbox, or nothing and why."""
    try:
        isolation = machine.isolation(tiers.OWN_NETWORK_NAME)
    except EnvironmentFault as fault:
        return TierChoice(machine.isolation(NO_SANDBOX), lacks=fault.message)
    command = isolation.worker_command(("/bin/true",), {}, ())
    try:
        done = subprocess.run(
            command.argv, env=dict(command.environment), capture_output=True, text=True, timeout=TRIED_S, check=False
        )
        why = "" if done.returncode == 0 else done.stderr.strip()[:MOST_CHARACTERS] or f"code {done.returncode}"
    except (OSError, subprocess.SubprocessError) as error:
        why = str(error)[:MOST_CHARACTERS]
    return TierChoice(isolation) if not why else TierChoice(machine.isolation(NO_SANDBOX), lacks=f"bubblewrap: {why}")


def inspect_tiers(machine: Machine) -> tuple[TierReport, ...]:
    """Test every tier and return the reports, strongest first; the tier without isolation comes last."""
    open_ones = tuple(Property(name, holds=False, mechanism=NOTHING) for name in PROPERTIES)
    nothing = TierReport(NO_SANDBOX, TIERS[NO_SANDBOX], usable=False, why="it contains nothing", properties=open_ones)
    return (*(inspect_tier(name, machine, afresh=True) for name in ISOLATING), nothing)


def sandbox_memory(machine: Machine) -> Fact:
    """Report whether a run would use the remembered result of a self-test, or why it would repeat it."""
    lapses = []
    for name in ISOLATING:
        memory = Memory.of(name, machine.ros)
        found = memory.recall()
        if found is not None and found.usable:
            return Fact("sandbox check", f"remembered for {name}: runs do not repeat it")
        if not machine.is_for_others(name):
            lapses.append(f"{name}: {memory.lapse() or 'it does not hold'}")
    return Fact("sandbox check", f"a run would repeat it; {lapses[0]}")


def inspect_tier(
    name: str, machine: Machine, progress: Callable[[str], None] = _silent, *, afresh: bool = False
) -> TierReport:
    """Return the report on one tier, from the last self-test if nothing relevant has changed since.

    When the tier is tested, `progress` gets the reason; `afresh` tests it in any case.
    """
    try:
        isolation = machine.isolation(name)
    except EnvironmentFault as fault:
        return TierReport(name, TIERS[name], usable=False, why=fault.message, remedy=fault.hint)
    memory = Memory.of(name, machine.ros)
    remembered = None if afresh else memory.recall()
    if remembered is not None:
        return remembered
    progress(f"trying the sandbox {name}{'' if afresh else f' ({memory.lapse()})'}")
    report = machine.self_test(isolation, machine.ros)
    if report.properties and not _kept(report):
        # The machine may have been busy: try once more.
        report = machine.self_test(isolation, machine.ros)
    report = replace(report, remedy=remedy_for(report))
    if _kept(report):
        # Only a success is kept: a failure may be due to a busy machine, or may soon be fixed.
        memory.keep(report)
    return report


def _named(wanted: str, machine: Machine, progress: Callable[[str], None]) -> TierChoice:
    isolation = machine.isolation(wanted)
    report = inspect_tier(wanted, machine, progress)
    if not _kept(report):
        raise EnvironmentFault(f"isolation {wanted}: expected a sandbox that holds, found: {report.why}", report.remedy)
    return TierChoice(isolation, report.properties)


def _kept(report: TierReport) -> bool:
    """Return whether a tier has the properties that it promises; Landlock does not promise network isolation."""
    promised = [name for name in REQUIRED if report.name != tiers.LANDLOCK_NAME or name != "net_egress"]
    broken = [found for found in report.properties if found.name in promised and not found.holds]
    return bool(report.properties) and not broken and NO_EXCHANGE not in report.why


def _refusal(mine: Sequence[TierReport], tried: Sequence[TierReport]) -> EnvironmentFault:
    found = "; ".join(f"{report.name}: {_shortly(report)}" for report in mine)
    # The remedy of a tier for another user comes last, because it requires the most.
    remedies = [report.remedy for report in (*mine, *tried) if report.remedy]
    hint = remedies[0] if remedies else "grade doctor says what each tier lacks"
    lacks, details = ("a sandbox that works", f" ({found})") if has_bubblewrap() else ("bubblewrap", "")
    text = f"isolation: this computer lacks {lacks}, which keeps your program from harming it; nothing was run{details}"
    return EnvironmentFault(text, hint)


def _shortly(report: TierReport) -> str:
    open_ones = [found.name for found in missing(report.properties)]
    return f"not contained: {', '.join(open_ones)}" if open_ones else report.why[:MOST_CHARACTERS]
