"""What a host tells of messages that were announced and did not come."""

from __future__ import annotations

import importlib
from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("rclpy", reason="needs rclpy")
pytestmark = pytest.mark.ros

HOST = str(Path(__file__).resolve().parents[2] / "grader/student_host")


class Subscription:
    """As much of a subscription as the ledger asks for."""

    def __init__(self, topic: Any) -> None:
        self.topic_name = topic
        self.qos_profile = type("Qos", (), {"depth": 1})()


@pytest.fixture
def ledger(monkeypatch: pytest.MonkeyPatch) -> Any:
    """A ledger of a process to which nothing ever comes."""
    monkeypatch.syspath_prepend(HOST)
    import launcher  # type: ignore[import-not-found]

    launcher.load_package()
    module = importlib.import_module("_grader_host.ledger")
    monkeypatch.setattr(module, "_valid", lambda _: True)
    monkeypatch.setattr(module, "_await_ready", lambda receiver, context: False)
    monkeypatch.setattr(module.Ledger, "_context", lambda _: object())
    return module.Ledger()


def announce(ledger: Any, subscription: Any, count: int = 1) -> None:
    """Tell that something is on its way to a subscription, and wait for it."""
    ledger._expected[subscription] = count
    ledger.await_arrivals([subscription])


def test_what_does_not_come_is_told(ledger: Any) -> None:
    """It may matter, and nobody can do anything about it but say so."""
    heard = Subscription("/odom")
    ledger.add("subscription", heard)
    announce(ledger, heard, 2)
    assert dict(ledger.lost) == {"/odom": 2}


def test_what_a_subscription_misses_that_took_the_place_of_another_is_not_told(ledger: Any) -> None:
    """`wait_for_message` in a loop makes a new one for every message: each has to be found first."""
    first, second = Subscription("/odom"), Subscription("/odom")
    for subscription in (first, second):
        ledger.add("subscription", subscription)
    announce(ledger, second)
    assert not ledger.lost
    assert not ledger.expects_anything()
