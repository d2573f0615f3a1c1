"""Draws of what happens to messages on their way."""

from __future__ import annotations

from grader.runtime.plan import PlannedConnection
from grader.runtime.worker.transit import Transit

MS = 1_000_000


def arrivals(
    delay_ms: tuple[int, int] = (0, 0), lose: float = 0.0, seed: str = "1", count: int = 200
) -> list[int | None]:
    """Return when the messages of a stream of 1 kHz arrive, in nanoseconds."""
    low, high = delay_ms
    transit = Transit(PlannedConnection("/a", (low * MS, high * MS), lose, seed))
    return [transit.arrives_ns(number * MS) for number in range(count)]


def test_the_same_seed_loses_the_same_messages() -> None:
    """Whatever the delay is; another seed loses others."""
    lost = [[one is None for one in arrivals(delay, 0.3)] for delay in ((0, 0), (5, 5), (0, 100))]
    assert lost[0] == lost[1] == lost[2]
    assert 30 < sum(lost[0]) < 90
    assert [one is None for one in arrivals(lose=0.3, seed="2")] != lost[0]


def test_none_overtakes_another() -> None:
    """A message that would is held until the one before it has arrived."""
    found = [one for one in arrivals((0, 100)) if one is not None]
    assert len(found) == 200
    assert found == sorted(found)
    assert all(0 <= at - number * MS <= 100 * MS for number, at in enumerate(found))


def test_the_ends_of_the_scale() -> None:
    """Nothing is lost, or everything; a fixed delay is the same for all."""
    assert arrivals() == [number * MS for number in range(200)]
    assert arrivals((7, 7)) == [(number + 7) * MS for number in range(200)]
    assert arrivals(lose=1.0) == [None] * 200
