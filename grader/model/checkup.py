"""A checkup: what this machine can do for grading, and what mends what it cannot."""

from __future__ import annotations

from dataclasses import dataclass

from grader.model.containment import TierReport
from grader.model.limits import Limits


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
