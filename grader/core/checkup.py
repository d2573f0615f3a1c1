"""What this machine can do for grading: properties of sandboxes, and what fixes what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from grader.core.limits import Limits

#: Property names, in the order of reports, and what each one says of a student's process.
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
#: What a tier must contain before `auto` runs anybody's code in it.
REQUIRED = ("fs_read", "fs_write", "procs", "net_egress", "shm")
#: Tier names, strongest first, and the letter of each.
TIERS = {"bubblewrap-root": "A2", "bubblewrap": "A1", "bubblewrap-flat": "B", "landlock": "C", "none": "D"}
#: The name of the tier without walls.
NO_WALLS = "none"


@dataclass(frozen=True, slots=True)
class Property:
    """One thing that a tier holds back, or does not.

    Attributes:
        name: One of `PROPERTIES`.
        holds: Whether the self-test saw it hold.
        mechanism: What gives it, e.g. `mount namespace`; `none` if nothing does.
        found: What the self-test saw where it does not hold, or what qualifies it; one line, may be empty.
    """

    name: str
    holds: bool
    mechanism: str
    found: str = ""

    def __str__(self) -> str:
        """Return the property as a report names it."""
        if self.holds:
            return f"{self.name} by {self.mechanism}"
        return f"{self.name} NOT CONTAINED" + (f" ({self.found})" if self.found else "")


@dataclass(frozen=True, slots=True)
class TierReport:
    """What one tier of isolation is worth on this machine, for this user.

    Attributes:
        name: Tier name, a key of `TIERS`.
        tier: Its letter: `A2`, `A1`, `B`, `C` or `D`.
        usable: Whether a student's node runs in it and everything `REQUIRED` is contained.
        why: Why it is not usable, one line; empty if it is.
        properties: In the order of `PROPERTIES`; empty if no process could be started in it.
        remedy: The one command or action that mends what is missing; empty if there is none.
    """

    name: str
    tier: str
    usable: bool
    why: str
    properties: tuple[Property, ...] = ()
    remedy: str = ""


def missing(properties: Sequence[Property]) -> tuple[Property, ...]:
    """Return what is required and does not hold."""
    return tuple(found for found in properties if found.name in REQUIRED and not found.holds)


def described(isolation: str, properties: Sequence[Property]) -> str:
    """Return the tier and each property with its mechanism in one line; exactly `none` without walls."""
    if isolation == NO_WALLS or not properties:
        return isolation
    letter = TIERS.get(isolation)
    return f"{isolation}{f' ({letter})' if letter else ''}: {'; '.join(map(str, properties))}"


def summarised(isolation: str, properties: Sequence[Property]) -> str:
    """Return the tier and how much it contains, short enough for a line of a terminal."""
    if isolation == NO_WALLS:
        return "NONE: no walls around the student's code"
    open_ones = [found.name for found in properties if not found.holds]
    if not properties:
        return isolation
    if open_ones:
        return f"{isolation}, NOT contained: {', '.join(open_ones)}"
    return f"{isolation}, all {len(properties)} properties contained"


@dataclass(frozen=True, slots=True)
class Fact:
    """One thing about this machine.

    Attributes:
        name: What it is, e.g. `kernel`.
        value: What was found, one line.
        fits: Whether grading can do with it.
        remedy: The command or action that mends it; empty if nothing has to be mended or none is known.
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
        took_s: Seconds from nothing to the result.
        problem: Why it could not be tried; empty if it could.
    """

    tier: str
    expected: int
    arrived: int
    took_s: float
    problem: str = ""

    @property
    def succeeded(self) -> bool:
        """Whether everything arrived."""
        return not self.problem and self.arrived == self.expected


@dataclass(frozen=True, slots=True)
class Checkup:
    """What this machine can do.

    Attributes:
        facts: Software and hardware.
        exchange: One exchange of messages, or None if there is no ROS to try it with.
        tiers: Every tier of isolation, strongest first; empty if there is no ROS to try them with.
        used: The tier that grading would use; empty if it would refuse.
        remedy: The one command or action that makes a tier hold; empty if one does, or none is known.
        limits: What a student's processes may use where a rubric says nothing else.
    """

    facts: tuple[Fact, ...]
    exchange: Exchange | None
    tiers: tuple[TierReport, ...]
    used: str
    remedy: str
    limits: Limits

    @property
    def safe(self) -> bool:
        """Whether strangers' programs can be graded here."""
        return bool(self.used) and not self.problems

    @property
    def problems(self) -> tuple[Fact, ...]:
        """What keeps grading from being safe, each with what mends it, the most urgent first."""
        found = [fact for fact in self.facts if not fact.fits]
        if self.tiers and not self.used:
            found.append(Fact("sandbox", "none holds on this machine", fits=False, remedy=self.remedy))
        if self.exchange is not None and not self.exchange.succeeded:
            value = self.exchange.problem or (
                f"{self.exchange.arrived} of {self.exchange.expected} messages of a trial node arrived"
            )
            found.append(Fact("DDS exchange", value, fits=False))
        return tuple(found)
