"""What a sandbox holds back: the properties of a tier of isolation, each with the mechanism that gives it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

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
