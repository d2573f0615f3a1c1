"""What never comes is waited for in full a few times, then only briefly, whatever it is."""

from collections.abc import Callable
from typing import NoReturn

import pytest

pytest.importorskip("rclpy")

from grader.runtime import patience
from grader.runtime.host import originals
from grader.runtime.patience import BRIEF_S, LOSSES, MOST_BUSY, SETTLE_S, Patience


@pytest.fixture
def waited(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """Collect how long was to be waited; nothing is waited for."""
    found: list[float] = []

    def wait_until(condition: Callable[[], bool], seconds: float, *, pause_s: float) -> bool:
        found.append(seconds)
        return condition()

    monkeypatch.setattr(patience, "wait_until", wait_until)
    monkeypatch.setattr("os.getloadavg", lambda: (0.0, 0.0, 0.0))
    return found


def test_what_comes_costs_no_patience(waited: list[float]) -> None:
    """However often."""
    mine = Patience()
    assert all(mine.wait(lambda: True) for _ in range(10 * LOSSES))
    assert set(waited) == {SETTLE_S}


@pytest.mark.rule(14)
def test_after_some_losses_waits_are_brief(waited: list[float]) -> None:
    """Also for what is waited for elsewhere and told here; what then comes still counts."""
    mine = Patience()
    for _ in range(LOSSES - 1):
        assert not mine.wait(lambda: False)
    mine.lose()
    assert mine.wait_s == BRIEF_S
    assert mine.wait(lambda: True)
    assert waited == [*[SETTLE_S] * (LOSSES - 1), BRIEF_S]


@pytest.mark.parametrize(("load", "times"), [(0.1, 1.0), (6.0, 3.0), (100.0, MOST_BUSY)])
def test_a_busy_machine_gets_more_time(
    waited: list[float], monkeypatch: pytest.MonkeyPatch, load: float, times: float
) -> None:
    """In proportion to how long everything takes there; an impatient recording stays impatient."""
    monkeypatch.setattr("os.getloadavg", lambda: (load, 0.0, 0.0))
    monkeypatch.setattr("os.cpu_count", lambda: 2)
    mine = Patience()
    assert mine.wait_s == times * SETTLE_S
    for _ in range(LOSSES):
        mine.lose()
    assert mine.wait_s == BRIEF_S


def test_a_system_that_tells_no_load_is_taken_for_a_quiet_one(monkeypatch: pytest.MonkeyPatch) -> None:
    """Not all containers show it."""

    def refuse() -> NoReturn:
        raise OSError

    monkeypatch.setattr("os.getloadavg", refuse)
    assert Patience().wait_s == SETTLE_S


def test_time_without_a_processor_hardly_counts(monkeypatch: pytest.MonkeyPatch) -> None:
    """A machine that runs a process once a second lets it look a hundred times within five seconds, not five times."""
    now, looks = 0.0, 0

    def sleep(_: float) -> None:
        nonlocal now
        now += 1.0

    def comes() -> bool:
        nonlocal looks
        looks += 1
        return looks > 100

    monkeypatch.setattr(originals, "perf_counter", lambda: now)
    monkeypatch.setattr(originals, "sleep", sleep)
    assert originals.wait_until(comes, 5.0)
    assert not originals.wait_until(lambda: False, 5.0)
