"""Alarms, other processes and the network take real time: a program that waits for them is none for virtual time."""

from __future__ import annotations

import importlib.util
import signal
from collections.abc import Callable, Sequence
from typing import Any

import pytest
from places import ROOT

OUTSIDE = ROOT / "grader/runtime/host/outside.py"


@pytest.fixture
def given_up(monkeypatch: pytest.MonkeyPatch) -> list[Any]:
    """A list that grows whenever virtual time is given up; no alarm is really set."""
    monkeypatch.setattr(signal, "setitimer", lambda which, seconds, interval=0.0: (seconds, interval))
    monkeypatch.setattr(signal, "alarm", lambda seconds: seconds)
    spec = importlib.util.spec_from_file_location("outside_under_test", OUTSIDE)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    times = []
    module.install_alarms(lambda: times.append("given up"))
    return times


@pytest.mark.parametrize(
    "set_alarm",
    [lambda: signal.alarm(2), lambda: signal.setitimer(signal.ITIMER_REAL, 0.05, 0.05)],
    ids=["alarm", "setitimer"],
)
def test_an_alarm_in_real_time_gives_virtual_time_up(given_up: Sequence[Any], set_alarm: Callable[..., Any]) -> None:
    """A node that is paced by it would hear it once in a while only."""
    set_alarm()
    assert given_up == ["given up"]


def test_other_timers_do_no_harm(given_up: Sequence[Any]) -> None:
    """Clearing an alarm, and timers of processor time, change nothing and still do what they do."""
    assert signal.alarm(0) == 0
    assert signal.setitimer(signal.ITIMER_REAL, 0) == (0, 0.0)
    assert signal.setitimer(signal.ITIMER_PROF, 1.0) == (1.0, 0.0)
    assert given_up == []
