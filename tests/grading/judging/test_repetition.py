"""Two recordings of a plan are compared event by event; the first difference has a kind, a place and a cause."""

from __future__ import annotations

from dataclasses import fields, replace
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from grader.grading.judging.repetition import events, first_difference
from grader.grading.model.verification import Cause, Difference, DifferenceKind
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    OutputLine,
    Request,
    Start,
    StartWay,
)
from grader.runtime.model.trace import Tested as Outcome

TWIST = "geometry_msgs/msg/Twist"
SOURCE = """\
import time
from rclpy.node import Node
class Talker(Node):
    def __init__(self):
        super().__init__("talker")
        self.out = self.create_publisher(Twist, "cmd_vel", 10)
    def tick(self):
        self.out.publish(Twist())
        self.get_logger().info("sent")
"""


def sent(t_ns: int, value: float = 0.2, cdr: bytes = b"") -> Message:
    return Message(t_ns, "/cmd_vel", TWIST, {"linear": {"x": value}}, cdr)


def logged(t_ns: int, text: str, line: int = 9) -> LogRecord:
    return LogRecord(t_ns, "talker.py", "INFO", "talker", text, "talker.py", line)


def seen(t_ns: int, *nodes: str, participant: int = 0) -> GraphSnapshot:
    ends = tuple(Endpoint("publisher", "/cmd_vel", TWIST, n, participant, "reliable", "volatile") for n in nodes)
    return GraphSnapshot(t_ns, nodes, ends)


def trace(*observations: Observation, **rest: Any) -> AssessedTrace:
    return AssessedTrace("alone", ClockKind.VIRTUAL, 10**10, observations, **rest)


def between(first: AssessedTrace, other: AssessedTrace, source: str = SOURCE) -> Difference:
    found = first_difference(first, other, {"talker.py": source})
    assert found is not None
    return found


USUAL = (seen(0, "/talker"), sent(50), logged(50, "sent"), sent(100), logged(100, "sent"))


def test_the_same_is_the_same() -> None:
    """Also where a field is not a number, which differs from itself."""
    odd = (*USUAL, sent(150, float("nan")), sent(200, float("inf")))
    assert first_difference(trace(*odd), trace(*odd), {}) is None


def test_the_first_one_counts_events_of_the_programs_alone() -> None:
    """The third event, whatever the grader saw of the graph before."""
    late: list[Observation] = [*USUAL]
    late[3] = sent(101)
    found = between(trace(*USUAL), trace(seen(1, "/talker"), *late))
    assert (found.kind, found.number, found.first, found.other) == (DifferenceKind.TIME, 3, USUAL[3], late[3])


@pytest.mark.parametrize(
    ("other", "kind"),
    [
        ((sent(50), logged(51, "sent"), sent(100), logged(100, "sent")), DifferenceKind.TIME),
        ((logged(50, "sent"), sent(50), sent(100), logged(100, "sent")), DifferenceKind.ORDER),
        ((sent(50), sent(100), logged(50, "sent"), logged(100, "sent")), DifferenceKind.ORDER),
        ((sent(50), logged(50, "other"), sent(100), logged(100, "sent")), DifferenceKind.CONTENT),
        ((sent(50), logged(50, "sent"), sent(100)), DifferenceKind.CONTENT),
        ((*USUAL[1:], sent(150)), DifferenceKind.CONTENT),
        ((sent(50, 0.3), logged(50, "sent"), sent(100), logged(100, "sent")), DifferenceKind.CONTENT),
        ((logged(50, "sent"), sent(100), logged(100, "sent")), DifferenceKind.CONTENT),
    ],
)
def test_kinds(other: tuple[Observation, ...], kind: DifferenceKind) -> None:
    """A message that is missing is no other order, although the next one is the same."""
    assert between(trace(*USUAL), trace(*other)).kind is kind


def test_bytes_count_where_fields_are_the_same() -> None:
    """Two messages with the same fields may have been sent in two ways."""
    first, other = trace(sent(1, cdr=b"ab")), trace(sent(1, cdr=b"ac"))
    assert between(first, other).kind is DifferenceKind.CONTENT


def test_what_only_the_grader_saw() -> None:
    """The graph, notes and suspicions; what a program did comes first."""
    first = trace(*USUAL)
    assert between(first, trace(seen(1, "/talker"), *USUAL[1:])).kind is DifferenceKind.GRADER
    assert between(first, trace(seen(0, "/talker", participant=1), *USUAL[1:])).kind is DifferenceKind.GRADER
    assert between(first, replace(first, notes=("lost",))).kind is DifferenceKind.GRADER
    assert between(first, replace(first, reached=("os.fork",))).kind is DifferenceKind.GRADER
    both = trace(seen(1, "/talker"), sent(51), *USUAL[2:])
    assert between(first, both).kind is DifferenceKind.TIME


def test_what_belongs_to_the_whole_recording() -> None:
    """When it ended, and how the programs were started."""
    first = trace(*USUAL)
    assert between(first, replace(first, stop_ns=5)).kind is DifferenceKind.TIME
    assert (
        between(first, replace(first, starts=(Start("a.py", "a.py", StartWay.SCRIPT),))).kind is DifferenceKind.CONTENT
    )
    assert between(first, replace(first, tested=Outcome(passed=True))).kind is DifferenceKind.CONTENT


def test_the_clock() -> None:
    """A recording that the wall clock decides is not compared; that only one is so is a difference."""
    first = trace(*USUAL)
    wall = trace(sent(1), clock_reason="it starts other processes")
    found = between(first, wall)
    assert (found.kind, found.number) == (DifferenceKind.CLOCK, 0)
    assert first_difference(wall, trace(clock_reason="it is late"), {}) is None


def test_measured_times_of_the_grader_do_not_count() -> None:
    """They decide about another recording, which shows whether they matter."""
    first = trace(*USUAL)
    assert first_difference(first, replace(first, may_drift=True, most_starved_ns=5, incomplete=True), {}) is None


def test_every_part_of_a_recording_is_compared_or_left_out_on_purpose() -> None:
    """A new field of a trace has to be put here, and into the comparison if it should repeat."""
    compared = {"observations", "clock_reason", "stop_ns", "starts", "written", "left_out", "newer", "notes", "reached"}
    compared |= {"unstarted", "tested", "drawn"}
    same_by_plan = {"scenario", "clock", "bag"}
    failures = {"harness_problem", "suspected", "author_mistake", "unchecked"}  # then nothing is compared
    measured = {"may_drift", "most_starved_ns", "all_starved_ns", "incomplete", "other_numpy"}
    names = {field.name for field in fields(AssessedTrace) if field.init}
    assert names == compared | same_by_plan | failures | measured


def test_the_place_of_a_difference() -> None:
    """The line of a log record and of a fault; for a message the only call that publishes on its topic."""
    found = between(trace(sent(1)), trace(sent(2)))
    assert (found.process, found.file, found.line) == ("talker.py", "talker.py", 8)
    twice = SOURCE + "        self.out.publish(Twist())\n"
    assert between(trace(sent(1)), trace(sent(2)), twice).line == 6
    assert between(trace(logged(1, "a", 4)), trace(logged(1, "b", 4))).line == 4
    fault = Fault(1, "talker.py", FaultKind.EXCEPTION, "ValueError: x", "helper.py", 3)
    found = between(trace(fault), trace(replace(fault, t_ns=2)))
    assert (found.process, found.file, found.line) == ("talker.py", "helper.py", 3)
    assert between(trace(Mark(1, "stop_signal")), trace(Mark(2, "stop_signal"))).line == 0


def test_no_place_where_two_programs_have_the_topic() -> None:
    """Nothing is guessed."""
    found = first_difference(trace(sent(1)), trace(sent(2)), {"a.py": SOURCE, "b.py": SOURCE})
    assert found is not None
    assert (found.process, found.file, found.line) == ("", "", 0)


@pytest.mark.parametrize(
    ("line", "cause"),
    [
        ("id(object())", Cause.ADDRESS),
        ("hash(self)", Cause.ADDRESS),
        ("self.id(3)", Cause.UNKNOWN),
        ("time.process_time()", Cause.PROCESSOR_TIME),
        ("resource.getrusage(0)", Cause.PROCESSOR_TIME),
        ("open('/proc/uptime')", Cause.KERNEL),
        ("os.path.getmtime(__file__)", Cause.KERNEL),
        ("ctypes.CDLL(None)", Cause.KERNEL),
        ("time.time()", Cause.UNKNOWN),
    ],
)
def test_causes_by_the_text_of_the_program(line: str, cause: Cause) -> None:
    """Only a suggestion for the reader."""
    assert between(trace(sent(1)), trace(sent(2)), f"{SOURCE}        {line}\n").cause is cause


def test_a_text_that_differs_in_an_address_alone() -> None:
    """As Python shows an object without a text of its own."""
    one = OutputLine(1, "talker.py", "stdout", "<Node object at 0x7f1b2c3d4e5f>")
    two = replace(one, text="<Node object at 0x7f0000000000>")
    assert between(trace(one), trace(two)).cause is Cause.ADDRESS
    assert between(trace(logged(1, "0x7f1b2c3d a")), trace(logged(1, "0x7f000000 b"))).cause is Cause.UNKNOWN


def test_what_the_grader_did_is_compared_as_well() -> None:
    """Its stimuli are the same in each recording."""
    first = (Delivery(1, "/odom", TWIST, {}, b"a"), Request(2, "/go", "std_srvs/srv/Trigger", 1, "grader", 1, {}))
    assert first_difference(trace(*first), trace(*first), {}) is None
    assert between(trace(*first), trace(first[0], replace(first[1], t_ns=3))).kind is DifferenceKind.TIME
    assert between(trace(*first), trace(replace(first[0], cdr=b"b"), first[1])).kind is DifferenceKind.CONTENT


OBSERVED = st.lists(
    st.one_of(
        st.builds(sent, st.integers(0, 3), st.floats(0, 1)),
        st.builds(logged, st.integers(0, 3), st.sampled_from(["a", "b"])),
        st.builds(seen, st.integers(0, 3), st.sampled_from(["/a", "/b"])),
    ),
    max_size=6,
).map(lambda found: sorted(found, key=lambda one: one.t_ns))


@given(OBSERVED, OBSERVED)
def test_a_difference_is_found_exactly_if_there_is_one(one: list[Observation], two: list[Observation]) -> None:
    """It is the first event that differs, or one of the graph where all events are the same; and the same both ways."""
    first, other = trace(*one), trace(*two)
    found, back = first_difference(first, other, {}), first_difference(other, first, {})
    same_events = events(first) == events(other)
    assert (found is None) == (same_events and first.graphs() == other.graphs())
    assert (back is None) == (found is None)
    if found is not None and back is not None:
        assert (found.kind, found.first, found.other) == (back.kind, back.other, back.first)
        assert (found.kind is DifferenceKind.GRADER) == same_events
        before = found.number - 1
        if not same_events:
            assert events(first)[:before] == events(other)[:before]
