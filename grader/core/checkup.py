"""Results of checking this machine: the properties of its sandboxes, and fixes for what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from grader.core.limits import Limits

#: Property names, in the order of reports, and what each one means for a student's process.
PROPERTIES = {
    "fs_read": "reads no file but its own and what Python and ROS need",
    "fs_write": "writes to its scratch folders only",
    "procs": "reads nothing of other processes",
    "signals": "stops, traces and limits no other process",
    "net_egress": "sends nothing beyond this machine's loopback",
    "vsock": "opens no socket to the hypervisor",
    "shm": "shares no memory with the grader",
    "mem": "is stopped at its memory limit",
    "pids": "is stopped at its limit of processes",
    "cpu": "is stopped at its limit of processor time",
    "dds_private": "exchanges ROS messages with the grader and nobody else",
}
#: The properties that a tier must have before `auto` runs code in it.
REQUIRED = ("fs_read", "fs_write", "procs", "net_egress", "shm")
#: Tier names, strongest first, and the letter of each.
TIERS = {"bubblewrap-root": "A2", "bubblewrap": "A1", "bubblewrap-flat": "B", "landlock": "C", "none": "D"}
#: The name of the tier without isolation.
NO_SANDBOX = "none"


@dataclass(frozen=True, slots=True)
class Property:
    """One property of a tier.

    Attributes:
        name: One of `PROPERTIES`.
        holds: Whether the self-test confirmed it.
        mechanism: What provides it, e.g. `mount namespace`; `none` if nothing does.
        found: What the self-test found instead, or a qualification; one line, may be empty.
    """

    name: str
    holds: bool
    mechanism: str
    found: str = ""

    def __str__(self) -> str:
        """Return the property as reports show it."""
        if self.holds:
            return f"{self.name} by {self.mechanism}"
        return f"{self.name} NOT CONTAINED" + (f" ({self.found})" if self.found else "")


@dataclass(frozen=True, slots=True)
class TierReport:
    """The result of testing one tier on this machine, for this user.

    Attributes:
        name: Tier name, a key of `TIERS`.
        tier: Its letter: `A2`, `A1`, `B`, `C` or `D`.
        usable: Whether a student's node runs in it and it has all `REQUIRED` properties.
        why: Why it is not usable, one line; empty if it is.
        properties: In the order of `PROPERTIES`; empty if no process could be started in it.
        remedy: The one command or action that fixes the problem; empty if there is none.
    """

    name: str
    tier: str
    usable: bool
    why: str
    properties: tuple[Property, ...] = ()
    remedy: str = ""


def missing(properties: Sequence[Property]) -> tuple[Property, ...]:
    """Return the required properties that do not hold."""
    return tuple(found for found in properties if found.name in REQUIRED and not found.holds)


def described(isolation: str, properties: Sequence[Property]) -> str:
    """Format the tier and each property with its mechanism on one line; exactly `none` without a sandbox."""
    if isolation == NO_SANDBOX or not properties:
        return isolation
    letter = TIERS.get(isolation)
    return f"{isolation}{f' ({letter})' if letter else ''}: {'; '.join(map(str, properties))}"


def summarised(isolation: str, properties: Sequence[Property]) -> str:
    """Format the tier and how much it contains, short enough for one line of a terminal."""
    if isolation == NO_SANDBOX:
        return "NONE: no sandbox around the student's code"
    open_ones = [found.name for found in properties if not found.holds]
    if not properties:
        return isolation
    if open_ones:
        return f"{isolation}, NOT contained: {', '.join(open_ones)}"
    return f"{isolation}, all {len(properties)} properties contained"


@dataclass(frozen=True, slots=True)
class Fact:
    """One fact about this machine.

    Attributes:
        name: Its name, e.g. `kernel`.
        value: Its value, one line.
        fits: Whether it is sufficient for grading.
        remedy: The command or action that fixes it; empty if no fix is needed or known.
    """

    name: str
    value: str
    fits: bool = True
    remedy: str = ""


@dataclass(frozen=True, slots=True)
class Exchange:
    """A trial node that published over real DDS.

    Attributes:
        tier: The tier of isolation it ran in.
        expected: Messages it published.
        arrived: Messages that the grader received.
        took_s: Seconds from the start to the result.
        problem: Why it could not be tried; empty if it could.
    """

    tier: str
    expected: int
    arrived: int
    took_s: float
    problem: str = ""

    @property
    def succeeded(self) -> bool:
        """Whether all messages arrived."""
        return not self.problem and self.arrived == self.expected


@dataclass(frozen=True, slots=True)
class Checkup:
    """The result of checking this machine.

    Attributes:
        facts: Software and hardware.
        exchange: A test exchange of messages, or None without ROS.
        tiers: Every tier, strongest first; empty without ROS.
        used: The tier that grading would use; empty if it would refuse.
        remedy: The one command or action that makes a tier work; empty if one does, or none is known.
        limits: The default limits of students' processes.
    """

    facts: tuple[Fact, ...]
    exchange: Exchange | None
    tiers: tuple[TierReport, ...]
    used: str
    remedy: str
    limits: Limits

    @property
    def safe(self) -> bool:
        """Whether untrusted programs can be graded here."""
        return bool(self.used) and not self.problems

    @property
    def problems(self) -> tuple[Fact, ...]:
        """The problems that make grading unsafe, each with its fix, the most urgent first."""
        found = [fact for fact in self.facts if not fact.fits]
        if self.tiers and not self.used:
            found.append(Fact("sandbox", "none holds on this machine", fits=False, remedy=self.remedy))
        if self.exchange is not None and not self.exchange.succeeded:
            value = self.exchange.problem or (
                f"{self.exchange.arrived} of {self.exchange.expected} messages of a trial node arrived"
            )
            found.append(Fact("DDS exchange", value, fits=False))
        return tuple(found)
