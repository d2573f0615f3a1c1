"""Names and types that students' nodes choose never end the worker; ROS's own rules decide what is a name."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hostile import HOST_LINE
from hypothesis import given
from hypothesis import strategies as st
from tiers import NIGHTLY, each, more

pytest.importorskip("rclpy", reason="needs rclpy")

from hostile import hostile, record
from rclpy.impl.implementation_singleton import rclpy_implementation

from grader.runtime.host.protocol import LONGEST, LONGEST_NODE, Claim, is_name, is_node_name
from grader.runtime.message_classes import interface_class, message_class
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace
from grader.runtime.session import RecordingSession
from grader.runtime.worker.observer import PARTICIPANTS
from grader.runtime.worker.ros_names import ask_for_all, asked

REFUSED = [
    "",
    "/",
    "//a",
    "/a/",
    "/a//b",
    "/1",
    "/a/1b",
    "a",
    "/a-b",
    "/a b",
    "/~a",
    "/\u00e4",
    "/a\n",
    "/a\0",
    "/" + "a" * LONGEST_NODE,
]
ACCEPTED = ["/a", "/a/b", "/_a", "/a__b", "/a/_action/feedback", "/A9", "/" + "a" * (LONGEST - 1)]


@pytest.mark.parametrize("name", [*REFUSED, *ACCEPTED])
def test_names_are_those_that_ros_accepts(name: str) -> None:
    """Also two underscores in a row, which the middleware allows."""
    assert is_name(name) == (name in ACCEPTED)
    if name.isascii() and "\0" not in name:
        assert is_name(name) == (rclpy_implementation.rclpy_get_validation_error_for_full_topic_name(name) is None)
    assert not is_name("/" + "a" * LONGEST)


@given(st.text("/_aA19-~ ", max_size=12).map(lambda text: f"/{text}"))
def test_no_name_is_judged_otherwise_than_by_ros(name: str) -> None:
    """Whatever it is made of."""
    assert is_name(name) == (rclpy_implementation.rclpy_get_validation_error_for_full_topic_name(name) is None)
    assert is_node_name(name) == is_name(name)


@pytest.mark.parametrize("kind", ["publisher", "subscription", "service", "client", "node", "parameter"])
@pytest.mark.parametrize("name", [*REFUSED, None, 5, ["/a"], {}])
def test_claims_of_impossible_names_are_dropped(kind: str, name: object) -> None:
    """A process says which endpoints it has, and may say anything."""
    claim = {"kind": kind, "name": "/n:p" if kind == "parameter" else "/x", "type": "std_msgs/msg/Float32"}
    assert Claim.checked(claim)
    assert not Claim.checked({**claim, "name": name})


def test_a_question_that_is_refused_has_no_answer() -> None:
    """A name that breaks the rules is nobody's; a failure that no name explains stays one."""

    def refuse(*names: str) -> list[str]:
        raise RuntimeError(names)

    assert asked(refuse, "//a", nothing=["none"]) == ["none"]
    with pytest.raises(RuntimeError):
        ask_for_all(refuse)
    assert ask_for_all(lambda: [b"\xff".decode()]) == []


@pytest.mark.parametrize("name", ["antigravity/msg/Foo", "this/msg/Foo", "json/msg/Foo", "grader/msg/Foo", "a/msg/Foo"])
def test_a_type_in_the_graph_imports_no_module(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Only packages that the index of ROS knows are imported."""
    monkeypatch.setattr("importlib.import_module", None)
    assert message_class(name) is None


@pytest.mark.parametrize("name", ["std_msgs/msg/Float32", "geometry_msgs/msg/Twist"])
def test_installed_types_are_found(name: str) -> None:
    """As before."""
    assert message_class(name) is not None
    assert interface_class("std_srvs/srv/Trigger", "srv") is not None


@pytest.fixture
def run(session: RecordingSession, tmp_path: Path) -> Callable[..., AssessedTrace]:
    """Record programs together."""
    tmp_path.chmod(0o755)
    return lambda *programs, **fields: record(session, tmp_path / "s", *programs, **fields)


FORGED = ["//bad__name/", "/1", "/a//b", "/a/", "/" + "a" * 250]


@pytest.mark.breadth(1, 2)
@pytest.mark.ros
@pytest.mark.parametrize("name", each(FORGED, len(FORGED)))
@pytest.mark.parametrize("kind", ["client", *more(["service"], NIGHTLY)])
def test_a_forged_claim_costs_nobody_a_verdict(run: Callable[..., AssessedTrace], kind: str, name: str) -> None:
    """The recording goes on, and so does the right node beside it."""
    claim = {"kind": kind, "name": name, "type": "std_srvs/srv/Trigger"}
    report = json.dumps({"kind": "idle", "wake_ns": None, "endpoints": [claim]})
    later = f"if self.count == 20: line().sendall({report.encode()!r} + b'\\n')"
    trace = run(
        hostile(before=HOST_LINE, later=later), hostile().replace("/cmd_vel", "/other"), duration_ns=3 * NS_PER_S
    )
    assert trace.harness_problem == ""
    assert len(trace.messages("/other")) == 59


@pytest.mark.ros
def test_names_with_two_underscores_are_ordinary(run: Callable[..., AssessedTrace]) -> None:
    """A topic, a service and a node."""
    harm = """
        from std_srvs.srv import Trigger
        self.more = self.create_publisher(Twist, "/a__b", 10)
        self.create_service(Trigger, "/do__it", lambda request, response: response)
    """
    trace = run(hostile(harm=harm, later="self.more.publish(Twist())"), duration_ns=3 * NS_PER_S)
    assert (trace.harness_problem, trace.notes) == ("", ())
    assert len(trace.messages("/a__b")) == 59


def of_types(first: int, end: int) -> str:
    """Return a publisher with other types on its topic, each of a participant of its own, up to 5."""
    harm = f"""
        import std_msgs.msg as kinds
        names = "Bool Byte Char Empty Float32 Float64 Int16 Int32 Int64 Int8 String UInt8".split()[{first}:{end}]
        self.others = []
        for number, name in enumerate(names):
            context = rclpy.Context()
            rclpy.init(context=context)
            node = rclpy.create_node(f"other_{first}_{{number}}", context=context)
            self.others.append((node, node.create_publisher(getattr(kinds, name), "/cmd_vel", 10)))
    """
    return hostile(harm=harm)


@pytest.mark.nightly
@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
def test_too_many_types_on_a_topic_are_a_limit_of_the_node(run: Callable[..., AssessedTrace], clock: str) -> None:
    """Which is judged; no failure of the grader."""
    trace: Any = run(
        of_types(0, 5), of_types(5, 10), clock=clock, duration_ns=(3 if clock == "virtual" else 10) * NS_PER_S
    )
    assert trace.harness_problem == ""
    (mark,) = trace.marks("limit")
    assert mark.detail == f"more than {PARTICIPANTS} types of messages on /cmd_vel: the rest was ignored"
