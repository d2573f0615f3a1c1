"""What never comes is waited for in full a few times, then only briefly, whatever it is."""

from collections.abc import Callable
from typing import NoReturn

import pytest

pytest.importorskip("rclpy")

from grader.runtime.host.originals import wait_until
from grader.runtime.patience import BRIEF_S, LOSSES, MOST_BUSY, SETTLE_S, Patience


class Waits:
    """Looks once at what is waited for, and keeps for how long it was to wait."""

    def __init__(self) -> None:
        self.seconds: list[float] = []

    def __call__(self, condition: Callable[[], bool], seconds: float, *, pause_s: float) -> bool:
        self.seconds.append(seconds)
        return condition()


@pytest.fixture
def quiet(monkeypatch: pytest.MonkeyPatch) -> None:
    """Let the machine have nothing else to do."""
    monkeypatch.setattr("os.getloadavg", lambda: (0.0, 0.0, 0.0))


@pytest.mark.usefixtures("quiet")
def test_what_comes_costs_no_patience() -> None:
    """However often."""
    waits = Waits()
    mine = Patience(wait=waits)
    assert all(mine.wait(lambda: True) for _ in range(10 * LOSSES))
    assert set(waits.seconds) == {SETTLE_S}


@pytest.mark.rule(14)
@pytest.mark.usefixtures("quiet")
def test_after_some_losses_waits_are_brief() -> None:
    """Also for what is waited for elsewhere and told here; what then comes still counts."""
    waits = Waits()
    mine = Patience(wait=waits)
    for _ in range(LOSSES - 1):
        assert not mine.wait(lambda: False)
    mine.lose()
    assert mine.wait_s == BRIEF_S
    assert mine.wait(lambda: True)
    assert waits.seconds == [*[SETTLE_S] * (LOSSES - 1), BRIEF_S]


@pytest.mark.parametrize(("load", "times"), [(0.1, 1.0), (6.0, 3.0), (100.0, MOST_BUSY)])
def test_a_busy_machine_gets_more_time(monkeypatch: pytest.MonkeyPatch, load: float, times: float) -> None:
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


def test_time_without_a_processor_hardly_counts() -> None:
    """A machine that runs a process once a second lets it look a hundred times within five seconds, not five times."""
    now, looks = 0.0, 0

    def pause(_: float) -> None:
        nonlocal now
        now += 1.0

    def comes() -> bool:
        nonlocal looks
        looks += 1
        return looks > 100

    assert wait_until(comes, 5.0, now_s=lambda: now, pause=pause)
    assert not wait_until(lambda: False, 5.0, now_s=lambda: now, pause=pause)
