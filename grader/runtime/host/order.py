"""Draws which of several callbacks that become ready at one instant an executor finds first."""

import random
from collections.abc import Callable, Iterable

from .protocol import MOST_DONE


class ReadyOrder:
    """Decides what one look of an executor finds.

    If one look finds several callbacks ready, rclpy runs timers first, then subscriptions, clients and services. What
    becomes ready at one instant of virtual time would become ready within microseconds, in any order, and the look
    would find what came first. What was ready before is found by every look, in the order of rclpy.

    Args:
        now_ns: Returns the virtual time.

    Attributes:
        did: What the program has done since the last report, in order; as in `Progress`.
        drew: Whether a look since then has found less than all that was ready.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._seed = ""
        self._draw: random.Random | None = None
        self.did: list[str] = []
        self.drew = False
        #: What was waited for, and was not ready, at this instant or until then; the addresses of handles.
        self._waited_for: set[int] = set()
        self._at_ns = 0

    def begin(self, seed: str) -> None:
        """Draw from a seed from now on, where a step says so."""
        self._seed = seed

    def step(self, name: str | None) -> None:
        """Begin a step of the run: its name, from which its draws follow; None if every look finds all in it.

        Each step draws for itself, so that what one draws does not depend on whether an earlier one has drawn.
        """
        drawn = self._seed and name is not None
        self._draw = random.Random(f"{self._seed}/ready/{name}") if drawn else None  # noqa: S311 - it has to repeat

    @property
    def is_drawn(self) -> bool:
        """Whether anything may be drawn in this run; otherwise every look finds all that is ready."""
        return bool(self._seed)

    def note(self, what: Callable[[], str]) -> None:
        """Note something that the program does, for the next report: a text that is made only where order is drawn."""
        if self._seed and len(self.did) < MOST_DONE:
            self.did.append(what())

    def told(self) -> tuple[list[str], bool]:
        """Return what was noted since the last call, and whether a look since then has found less than was ready."""
        told = self.did, self.drew
        self.did, self.drew = [], False
        return told

    def wait_for(self, entities: Iterable[int]) -> None:
        """Note that an executor has waited for entities until now, none of which was ready before."""
        if self._at_ns != self._now_ns():
            self._at_ns = self._now_ns()
            self._waited_for.clear()
        self._waited_for.update(entities)

    def hidden(self, ready: list[int]) -> set[int]:
        """Return which of the entities that are ready the look does not find yet."""
        new = [one for one in ready if one in self._waited_for] if self._at_ns == self._now_ns() else []
        if self._draw is None or not new or len(ready) == 1:
            return set()
        # beside what was ready before, the look finds one that came in time, or none
        found = {self._draw.choice(new)} if len(new) == len(ready) or self._draw.getrandbits(1) else set()
        self.drew |= len(new) > len(found)
        return {*new} - found
