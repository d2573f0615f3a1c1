"""What never comes is waited for in full a few times, then only briefly, whatever it is."""

import pytest

pytest.importorskip("rclpy")

from grader.recording import patience
from grader.recording.patience import BRIEF_S, LOSSES, SETTLE_S, Patience


@pytest.fixture
def waited(monkeypatch) -> list[float]:
    """Collect how long was to be waited; nothing is waited for."""
    found: list[float] = []

    def wait_until(condition, seconds, *, pause_s):
        found.append(seconds)
        return condition()

    monkeypatch.setattr(patience, "wait_until", wait_until)
    return found


def test_what_comes_costs_no_patience(waited):
    """However often."""
    mine = Patience()
    assert all(mine.wait(lambda: True) for _ in range(10 * LOSSES))
    assert set(waited) == {SETTLE_S}


def test_after_some_losses_waits_are_brief(waited):
    """Also for what is waited for elsewhere and told here; what then comes still counts."""
    mine = Patience()
    for _ in range(LOSSES - 1):
        assert not mine.wait(lambda: False)
    mine.lose()
    assert mine.wait_s == BRIEF_S
    assert mine.wait(lambda: True)
    assert waited == [*[SETTLE_S] * (LOSSES - 1), BRIEF_S]
