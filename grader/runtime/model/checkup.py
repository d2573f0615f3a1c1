"""Results of checking this machine: the properties of its sandboxes, and fixes for what is missing."""

from __future__ import annotations

from collections.abc import Sequence

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.limits import Limits

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
    """One property of a tier."""

    name: str  # one of `PROPERTIES`
    holds: bool  # whether the self-test confirmed it
    mechanism: str  # what provides it, e.g. `mount namespace`; `none` if nothing does.
    found: str = ""  # what the self-test found instead, or a qualification; one line, may be empty

    def __str__(self) -> str:
        """Return the property as reports show it."""
        if self.holds:
            return f"{self.name} by {self.mechanism}"
        return f"{self.name} NOT CONTAINED" + (f" ({self.found})" if self.found else "")


@dataclass(frozen=True, slots=True)
class TierReport:
    """The result of testing one tier on this machine, for this user."""

    name: str  # tier name, a key of `TIERS`
    tier: str  # its letter: `A2`, `A1`, `B`, `C` or `D`
    usable: bool  # whether a student's node runs in it and it has all `REQUIRED` properties
    why: str  # why it is not usable, one line; empty if it is
    properties: tuple[Property, ...] = ()  # in the order of `PROPERTIES`; empty if no process could be started in it
    remedy: str = ""  # the one command or action that fixes the problem; empty if there is none


def missing(properties: Sequence[Property]) -> tuple[Property, ...]:
    """Return the required properties that do not hold."""
    return tuple(found for found in properties if found.name in REQUIRED and not found.holds)


def isolation_line(isolation: str, properties: Sequence[Property]) -> str:
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
    """One fact about this machine."""

    name: str  # its name, e.g. `kernel`
    value: str  # its value, one line
    fits: bool = True  # whether it is sufficient for grading
    remedy: str = ""  # the command or action that fixes it; empty if no fix is needed or known


@dataclass(frozen=True, slots=True)
class Exchange:
    """A trial node that published over real DDS."""

    tier: str  # the tier of isolation it ran in
    expected: int  # messages it published
    arrived: int  # messages that the grader received
    took_s: float  # seconds from the start to the result
    problem: str = ""  # why it could not be tried; empty if it could

    @property
    def succeeded(self) -> bool:
        """Whether all messages arrived."""
        return not self.problem and self.arrived == self.expected


@dataclass(frozen=True, slots=True)
class Checkup:
    """The result of checking this machine."""

    facts: tuple[Fact, ...]  # software and hardware
    exchange: Exchange | None  # a test exchange of messages, or None without ROS
    tiers: tuple[TierReport, ...]  # every tier, strongest first; empty without ROS
    used: str  # the tier that grading would use; empty if it would refuse
    remedy: str  # the one command or action that makes a tier work; empty if one does, or none is known
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
