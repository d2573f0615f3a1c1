"""What a host tells of messages that were announced and did not come, and waits for before it goes on."""

from __future__ import annotations

import importlib
import sys
import weakref
from typing import Any

import pytest
from places import ROOT

from grader.runtime.host.protocol import Counterparts

pytest.importorskip("rclpy", reason="needs rclpy")
from std_srvs.srv import Trigger

pytestmark = pytest.mark.ros

HOST = str(ROOT / "grader/runtime/host")


class Handle:
    """A handle that the middleware fills: each message comes at one look, and pushes out what was not taken."""

    pointer = 1

    def __init__(self, coming: list[str]) -> None:
        self.coming, self.there = coming, ""

    def __enter__(self) -> None:
        pass

    def __exit__(self, *_: object) -> None:
        pass

    def look(self) -> bool:
        """Let the next message come; return whether one is there."""
        self.there = self.coming.pop(0) if self.coming else self.there
        return bool(self.there)

    def take_message(self, *_: object) -> str:
        """Take the message that is there."""
        taken, self.there = self.there, ""
        return taken


class Subscription:
    """As much of a subscription as the inbox asks for."""

    msg_type, raw = None, False

    def __init__(self, topic: Any, *coming: str) -> None:
        self.topic_name = topic
        self.qos_profile = type("Qos", (), {"depth": 1})()
        self.handle = Handle([*coming])


class Context:
    """As much of a context as the inbox asks for."""

    def ok(self) -> bool:
        return True


@pytest.fixture
def waits() -> list[float]:
    """The waits for what may still come, in seconds; none of them takes any time."""
    return []


@pytest.fixture
def context() -> Context:
    """The context of all nodes."""
    return Context()


@pytest.fixture
def ros(monkeypatch: pytest.MonkeyPatch, waits: list[float], context: Context) -> Any:
    """The ROS side of a process to which only that comes which a test says."""
    monkeypatch.syspath_prepend(HOST)
    import launcher  # type: ignore[import-not-found]

    launcher.load_package()
    sys.modules["_grader_host.unseen"].IMPORTS.end()
    made = importlib.import_module("_grader_host.ros_state").new_ros_state(lambda _: None)
    made.endpoints.contexts.append(weakref.ref(context))
    inbox = sys.modules["_grader_host.inbox"].Inbox
    return made._replace(inbox=inbox(made.endpoints, lambda receiver, *_: receiver.handle.look(), waits.append))


def add(ros: Any, kind: str, endpoint: Any) -> None:
    """Create an endpoint."""
    ros.endpoints.add(kind, endpoint)
    ros.inbox.add(kind, endpoint)


def announce(inbox: Any, subscription: Any, count: int = 1) -> None:
    """Tell that something is on its way to a subscription, and wait for it."""
    inbox._expected[subscription] = count
    inbox.await_arrivals([subscription])


@pytest.mark.rule(11)
def test_what_does_not_come_is_told(ros: Any) -> None:
    """It may matter, and nobody can do anything about it but say so."""
    heard = Subscription("/odom")
    add(ros, "subscription", heard)
    announce(ros.inbox, heard, 2)
    assert dict(ros.inbox.lost) == {"/odom": 2}


def test_what_a_subscription_misses_that_took_the_place_of_another_is_not_told(ros: Any) -> None:
    """`wait_for_message` in a loop makes a new one for every message: each has to be found first."""
    first, second = Subscription("/odom"), Subscription("/odom")
    for subscription in (first, second):
        add(ros, "subscription", subscription)
    announce(ros.inbox, second)
    assert not ros.inbox.lost
    assert not ros.inbox.expects_anything()


@pytest.mark.rule(11)
def test_the_newest_of_several_messages_is_kept_however_late_it_comes(ros: Any) -> None:
    """How many messages a short queue has dropped cannot be known: the older one does not stand for both."""
    heard = Subscription("/odom", "older", "newest")
    add(ros, "subscription", heard)
    ros.inbox.expect({"topic /odom": 2})
    assert list(ros.inbox.kept(heard)) == ["newest"]
    assert not ros.inbox.lost


class Service:
    """As much of a service as the inbox asks for; the first request is there, and waits."""

    srv_type = Trigger

    def __init__(self, name: str) -> None:
        self.qos_profile = type("Qos", (), {"depth": 10})()
        self.handle = Handle(["first"])
        self.handle.name = name  # type: ignore[attr-defined]


@pytest.mark.rule(11)
def test_the_newest_of_more_requests_than_a_queue_holds_may_arrive_first(ros: Any, waits: list[float]) -> None:
    """Or the one that a server takes next would depend on which of them had already been dropped."""
    server = Service("/work")
    add(ros, "service", server)
    for _ in range(3):
        ros.inbox.expect({"request /work": 3})
    assert waits == []
    ros.inbox.expect({"request /work": 3})
    assert len(waits) == 1
    assert ros.inbox._expected[server] == 10  # what was dropped never comes
    ros.inbox.took(server)
    ros.inbox.expect({"request /work": 1})
    assert len(waits) == 1


@pytest.mark.parametrize(("seen", "expected"), [([2, 2, 2, 1], {"service": {"/q": [1]}}), ([1, 1, 0], {})])
def test_a_server_sees_no_client_that_has_left(
    ros: Any, monkeypatch: pytest.MonkeyPatch, seen: list[int], expected: dict[str, Any]
) -> None:
    """It would send it a response, which wakes the other clients."""
    monkeypatch.setattr(sys.modules["_grader_host.seen_graph"], "DEPARTURE_S", 600)
    server = Service("/q")
    add(ros, "service", server)
    last = seen[-1]
    monkeypatch.setattr(ros.graph, "_clients_of", lambda _: seen.pop(0) if seen else last)
    assert ros.graph.await_matches(Counterparts(**expected), 600) == []
    assert seen == []
