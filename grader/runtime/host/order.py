"""Draws which of several callbacks that become ready at one instant an executor finds first."""

import random
from collections.abc import Callable, Iterable


class ReadyOrder:
    """Decides what one look of an executor finds.

    If one look finds several callbacks ready, rclpy runs timers first, then subscriptions, clients and services. What
    becomes ready at one instant of virtual time would become ready within microseconds, in any order, and the look
    would find what came first. What was ready before is found by every look, in the order of rclpy.

    Args:
        now_ns: Returns the virtual time.
    """

    def __init__(self, now_ns: Callable[[], int]) -> None:
        self._now_ns = now_ns
        self._draw: random.Random | None = None
        #: What was waited for, and was not ready, at this instant or until then; the addresses of handles.
        self._waited_for: set[int] = set()
        self._at_ns = 0

    def begin(self, seed: str) -> None:
        """Draw from a seed from now on."""
        self._draw = random.Random(f"{seed}/ready")  # noqa: S311 - it has to repeat

    @property
    def is_drawn(self) -> bool:
        """Whether anything is drawn; otherwise every look finds all that is ready."""
        return self._draw is not None

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
        return {*new} - found
