"""What is taken down of a scenario, and where that ends."""

from __future__ import annotations

import pytest

pytest.importorskip("rclpy")

from hypothesis import given
from hypothesis import strategies as st

from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB
from grader.runtime.model.trace import Endpoint, Fault, FaultKind, GraphSnapshot, Mark, Message, Offer
from grader.runtime.worker import trace_recorder as module
from grader.runtime.worker.core import Taken
from grader.runtime.worker.trace_recorder import TraceRecorder

REST = "the rest was ignored"


def taken(topic: str = "/cmd_vel", size: int = 10) -> Taken:
    return Taken(topic, "geometry_msgs/msg/Twist", bytes(size), {})


def graph(t_ns: int, nodes: int = 1, ends: int = 1) -> GraphSnapshot:
    return GraphSnapshot(
        t_ns,
        tuple(f"/n{n}" for n in range(nodes)),
        tuple(Endpoint("publisher", f"/t{n}", "x", "/n0", 0, "reliable", "volatile") for n in range(ends)),
    )


def marks(recorder: TraceRecorder) -> list[tuple[int, str]]:
    return [(o.t_ns, o.detail) for o in recorder.observations if isinstance(o, Mark)]


def test_messages_are_counted_on_each_topic() -> None:
    """Two topics below the limit together exceed nothing."""
    recorder = TraceRecorder(Limits(messages=3))
    for n in range(3):
        recorder.message(n, taken("/a"))
        recorder.message(n, taken("/b"))
    assert not recorder.full
    recorder.message(7, taken("/b"))
    assert marks(recorder) == [(7, f"more than 3 messages on /b: {REST}")]
    assert len([o for o in recorder.observations if isinstance(o, Message)]) == 6


def test_the_size_of_all_messages_is_bounded() -> None:
    """Few large messages fill a trace as well."""
    recorder = TraceRecorder(Limits(traffic_bytes=2 * MIB))
    for n in range(3):
        recorder.message(n, taken(f"/t{n}", MIB))
    assert marks(recorder) == [(2, f"more than 2 MiB of messages: {REST}")]


def test_nothing_follows_the_first_limit() -> None:
    """One mark, and no message after it."""
    recorder = TraceRecorder(Limits(messages=1))
    for n in range(10):
        recorder.message(n, taken())
    recorder.stop(11, "another limit")
    assert len(recorder.observations) == 2
    assert len(marks(recorder)) == 1


def test_participants_are_bounded() -> None:
    """Each costs the grader's own node as much as a process."""
    recorder = TraceRecorder(Limits(participants=2))
    assert recorder.look(graph(1), participants=2)
    assert not recorder.look(graph(2, nodes=2), participants=3)
    assert marks(recorder) == [(2, f"more than 2 DDS participants: {REST}")]


def test_a_process_that_is_started_again_may_have_a_participant() -> None:
    """A launch file may start a node again more often than a scenario has participants."""
    recorder = TraceRecorder(Limits(participants=1))
    for n in range(1, 5):
        assert recorder.look(graph(n, nodes=n), participants=n)
        recorder.allow_participant()
    assert not recorder.look(graph(6), participants=6)


@pytest.mark.parametrize("size", [{"nodes": module.ENDPOINTS + 1}, {"ends": module.ENDPOINTS + 1}])
def test_a_graph_beyond_all_measure_ends_the_recording(size: dict[str, int]) -> None:
    """It is not even kept."""
    recorder = TraceRecorder(Limits())
    assert not recorder.look(graph(5, **size), participants=1)
    assert "at once" in recorder.full
    assert recorder.graph == GraphSnapshot(0, (), ())


def test_a_graph_that_never_rests_ends_the_recording() -> None:
    """Snapshots add up."""
    recorder = TraceRecorder(Limits())
    large, small = (graph(0, nodes=module.ENDPOINTS - n, ends=module.ENDPOINTS) for n in range(2))
    most = module.GRAPH_PARTS // (2 * module.ENDPOINTS)
    for n in range(most + 2):
        recorder.look(small if n % 2 else large, participants=1)
    assert "too often" in recorder.full
    assert len([o for o in recorder.observations if isinstance(o, GraphSnapshot)]) == most


def test_a_graph_that_stays_the_same_is_taken_down_once() -> None:
    """Only changes are evidence."""
    recorder = TraceRecorder(Limits())
    assert [recorder.look(graph(n), participants=1) for n in range(3)] == [True, False, False]


def test_of_faults_and_offers_only_the_first_are_kept() -> None:
    """A thread that raises for ever fills no trace."""
    recorder = TraceRecorder(Limits())
    for n in range(5000):
        recorder.add(Fault(n, "a.py", FaultKind.EXCEPTION, "x"), Offer(n, "a.py", "service", f"/s{n}", "x"))
    kinds = [type(o) for o in recorder.observations]
    assert (kinds.count(Fault), kinds.count(Offer)) == (module.FAULTS, module.OFFERS)


@given(st.lists(st.text(max_size=2000), max_size=300), st.lists(st.text(max_size=2000), max_size=100))
def test_notes_are_few_short_and_told_once(own: list[str], others: list[str]) -> None:
    """The limit that ended the recording comes first."""
    recorder = TraceRecorder(Limits())
    recorder.note(*own)
    recorder.stop(0, "enough")
    notes = recorder.notes(others)
    assert notes[0] == f"enough: {REST}"
    assert len(notes) == len(set(notes)) <= module.NOTES
    assert all(len(note) <= module.NOTE_CHARACTERS for note in notes)


@pytest.mark.parametrize(("count", "at_ns", "floods"), [(101, 0, True), (100, 0, False), (1100, 10**9, False)])
def test_a_flood_is_told_by_the_time_it_is(count: int, at_ns: int, floods: bool) -> None:
    """A burst is none, and neither is a thousand a second; topics are counted each for itself."""
    recorder = TraceRecorder(Limits())
    for _ in range(count):
        recorder.message(at_ns, taken("/a"))
        recorder.message(at_ns, taken("/b"))
    assert recorder.floods(at_ns) is floods
