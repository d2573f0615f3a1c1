"""What is taken down of a scenario, and where that ends."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from hypothesis import given
from hypothesis import strategies as st

from grader.core.limits import Limits
from grader.core.quantities import MIB
from grader.core.trace import Endpoint, Fault, FaultKind, GraphSnapshot, Mark, Message, Offer
from grader.execution import trace_recorder as module
from grader.execution.observer import Taken
from grader.execution.trace_recorder import TraceRecorder

REST = "the rest was not looked at"


def taken(topic: str = "/cmd_vel", size: int = 10) -> Taken:
    return Taken(topic, "geometry_msgs/msg/Twist", bytes(size), {})


def graph(t_ns: int, nodes: int = 1, ends: int = 1) -> GraphSnapshot:
    return GraphSnapshot(
        t_ns,
        tuple(f"/n{n}" for n in range(nodes)),
        tuple(Endpoint("publisher", f"/t{n}", "x", "/n0", 0, "reliable", "volatile") for n in range(ends)),
    )


def marks(tape: TraceRecorder) -> list[tuple[int, str]]:
    return [(o.t_ns, o.detail) for o in tape.observations if isinstance(o, Mark)]


def test_messages_are_counted_on_each_topic():
    """Two topics below the limit together exceed nothing."""
    tape = TraceRecorder(Limits(messages=3))
    for n in range(3):
        tape.message(n, taken("/a"))
        tape.message(n, taken("/b"))
    assert not tape.full
    tape.message(7, taken("/b"))
    assert marks(tape) == [(7, f"more than 3 messages on /b: {REST}")]
    assert len([o for o in tape.observations if isinstance(o, Message)]) == 6


def test_the_size_of_all_messages_is_bounded():
    """Few large messages fill a trace as well."""
    tape = TraceRecorder(Limits(traffic_bytes=2 * MIB))
    for n in range(3):
        tape.message(n, taken(f"/t{n}", MIB))
    assert marks(tape) == [(2, f"more than 2 MiB of messages: {REST}")]


def test_nothing_follows_the_first_limit():
    """One mark, and no message after it."""
    tape = TraceRecorder(Limits(messages=1))
    for n in range(10):
        tape.message(n, taken())
    tape.stop(11, "another limit")
    assert len(tape.observations) == 2
    assert len(marks(tape)) == 1


def test_participants_are_bounded():
    """Each costs the grader's own node as much as a process."""
    tape = TraceRecorder(Limits(participants=2))
    assert tape.look(graph(1), participants=2)
    assert not tape.look(graph(2, nodes=2), participants=3)
    assert marks(tape) == [(2, f"more than 2 DDS participants: {REST}")]


@pytest.mark.parametrize("size", [{"nodes": module.ENDPOINTS + 1}, {"ends": module.ENDPOINTS + 1}])
def test_a_graph_beyond_all_measure_ends_the_recording(size):
    """It is not even kept."""
    tape = TraceRecorder(Limits())
    assert not tape.look(graph(5, **size), participants=1)
    assert "at once" in tape.full
    assert tape.graph == GraphSnapshot(0, (), ())


def test_a_graph_that_never_rests_ends_the_recording(monkeypatch):
    """Snapshots add up."""
    monkeypatch.setattr(module, "GRAPH_PARTS", 20)
    tape = TraceRecorder(Limits())
    for n in range(30):
        tape.look(graph(n, nodes=1 + n % 2), participants=1)
    assert "too often" in tape.full
    assert len([o for o in tape.observations if isinstance(o, GraphSnapshot)]) < 10


def test_a_graph_that_stays_the_same_is_taken_down_once():
    """Only changes are evidence."""
    tape = TraceRecorder(Limits())
    assert [tape.look(graph(n), participants=1) for n in range(3)] == [True, False, False]


def test_of_faults_and_offers_only_the_first_are_kept():
    """A thread that raises for ever fills no trace."""
    tape = TraceRecorder(Limits())
    for n in range(5000):
        tape.add(Fault(n, "a.py", FaultKind.EXCEPTION, "x"), Offer(n, "a.py", "service", f"/s{n}", "x"))
    kinds = [type(o) for o in tape.observations]
    assert (kinds.count(Fault), kinds.count(Offer)) == (module.FAULTS, module.OFFERS)


@given(st.lists(st.text(max_size=2000), max_size=300), st.lists(st.text(max_size=2000), max_size=100))
def test_notes_are_few_short_and_told_once(own, others):
    """The limit that ended the recording comes first."""
    tape = TraceRecorder(Limits())
    tape.note(*own)
    tape.stop(0, "enough")
    notes = tape.notes(others)
    assert notes[0] == f"enough: {REST}"
    assert len(notes) == len(set(notes)) <= module.NOTES
    assert all(len(note) <= module.NOTE_CHARACTERS for note in notes)


@pytest.mark.parametrize(("count", "at_ns", "floods"), [(101, 0, True), (100, 0, False), (1100, 10**9, False)])
def test_a_flood_is_told_by_the_time_it_is(count, at_ns, floods):
    """A burst is none, and neither is a thousand a second; topics are counted each for itself."""
    tape = TraceRecorder(Limits())
    for _ in range(count):
        tape.message(at_ns, taken("/a"))
        tape.message(at_ns, taken("/b"))
    assert tape.floods(at_ns) is floods
