"""Traces as JSON: everything comes back as it was, and nothing damaged is taken for a trace."""

import contextlib
import copy
import json
import math
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.runtime.model.errors import EvidenceError, HarnessError
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
    Offer,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Start,
    StartWay,
)
from grader.runtime.recording.codec import observation_to_json, trace_to_json
from grader.runtime.recording.packed import pack_trace, trace_from_json, unpack_trace

TIMES = st.integers(min_value=-(2**70), max_value=2**70)
# Lone surrogates too: a student's bytes may be decoded to anything.
TEXTS = st.text(st.characters(), max_size=12) | st.sampled_from(["\ud800", "\x00", "\x1b[31m", "\u2028", "🤖", "\n"])
LINES = st.integers(min_value=0, max_value=2**40)
NUMBERS = st.floats() | st.integers(min_value=-(2**63), max_value=2**64) | st.booleans()
FIELDS = st.recursive(
    NUMBERS | TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["x", "data", "pose", "w"]), inner),
    max_leaves=8,
)
VALUES = st.dictionaries(st.sampled_from(["data", "linear", "header", "x"]), FIELDS, max_size=3)
ENDPOINTS = st.builds(
    Endpoint, TEXTS, TEXTS, TEXTS, TEXTS, st.integers(-1, 99), TEXTS, TEXTS, st.integers(0, 9), TIMES, TEXTS, LINES
)
RELIABILITIES = st.sampled_from(["reliable", "best_effort"])
DURABILITIES = st.sampled_from(["volatile", "transient_local"])
SERVICE_ENDS = st.builds(ServiceEnd, TEXTS, TEXTS, TEXTS, TEXTS, RELIABILITIES, DURABILITIES)
OBSERVATIONS = {
    Message: st.builds(Message, TIMES, TEXTS, TEXTS, VALUES, st.binary(max_size=16), st.booleans()),
    Delivery: st.builds(Delivery, TIMES, TEXTS, TEXTS, VALUES, st.binary(max_size=16)),
    LogRecord: st.builds(LogRecord, TIMES, TEXTS, TEXTS, TEXTS, TEXTS, TEXTS, LINES),
    OutputLine: st.builds(OutputLine, TIMES, TEXTS, TEXTS, TEXTS),
    GraphSnapshot: st.builds(
        GraphSnapshot,
        TIMES,
        st.lists(TEXTS, max_size=3).map(tuple),
        st.lists(ENDPOINTS, max_size=3).map(tuple),
        st.lists(SERVICE_ENDS, max_size=3).map(tuple),
    ),
    Request: st.builds(Request, TIMES, TEXTS, TEXTS, LINES, TEXTS, LINES, VALUES, st.binary(max_size=16)),
    Response: st.builds(Response, TIMES, TEXTS, TEXTS, LINES, TEXTS, LINES, VALUES, st.binary(max_size=16)),
    Fault: st.builds(
        Fault,
        TIMES,
        TEXTS,
        st.sampled_from(FaultKind),
        TEXTS,
        TEXTS,
        LINES,
        st.lists(TEXTS, max_size=3).map(tuple),
        st.none() | TIMES,
        TEXTS,
        st.none() | st.tuples(LINES, LINES),
    ),
    Offer: st.builds(Offer, TIMES, TEXTS, TEXTS, TEXTS, TEXTS),
    Mark: st.builds(Mark, TIMES, TEXTS, TEXTS),
}
TRACES = st.builds(
    AssessedTrace,
    scenario=TEXTS,
    clock=st.sampled_from(ClockKind),
    stop_ns=TIMES,
    observations=st.lists(st.one_of(*OBSERVATIONS.values()), max_size=6).map(tuple),
    clock_reason=TEXTS,
    notes=st.lists(TEXTS, max_size=3).map(tuple),
    harness_problem=TEXTS,
    suspected=st.booleans(),
    most_starved_ns=TIMES,
    all_starved_ns=TIMES,
    unchecked=TEXTS,
)


def over_the_line(data: Any) -> Any:
    """Return JSON values as the other side reads them; the writer may only use strict JSON."""
    return json.loads(json.dumps(data, allow_nan=False))


def same(left: Any, right: Any) -> bool:
    """Return whether two values are equal, NaN being equal to itself and True not to 1."""
    if isinstance(left, float) and isinstance(right, float) and math.isnan(left):
        return math.isnan(right)
    if isinstance(left, dict):
        return isinstance(right, dict) and left.keys() == right.keys() and all(same(left[k], right[k]) for k in left)
    if isinstance(left, (list, tuple)):
        return len(left) == len(right) and all(map(same, left, right))
    if hasattr(left, "__slots__"):
        return type(left) is type(right) and all(same(getattr(left, n), getattr(right, n)) for n in left.__slots__)
    return type(left) is type(right) and left == right


def test_every_kind_of_observation_is_tried() -> None:
    """A new kind has to be added here, and to the codec."""
    assert set(OBSERVATIONS) == set(get_args(Observation))


@settings(deadline=None)
@given(TRACES)
def test_a_trace_comes_back_as_it_was(trace: AssessedTrace) -> None:
    """All kinds, NaN, infinities, whole numbers beyond 64 bits, texts that no encoding holds."""
    assert same(trace_from_json(over_the_line(trace_to_json(trace))), trace)


@settings(deadline=None)
@given(TRACES)
def test_the_same_trace_is_written_in_the_same_bytes(trace: AssessedTrace) -> None:
    """Bytes can be compared instead of traces."""
    once = json.dumps(trace_to_json(trace))
    assert json.dumps(trace_to_json(trace_from_json(json.loads(once)))) == once


SOUND = trace_to_json(
    AssessedTrace(
        "alone",
        ClockKind.VIRTUAL,
        10,
        (
            Message(1, "/a", "std_msgs/msg/Float32", {"data": math.nan}, b"\0\1\0\0"),
            Delivery(1, "/b", "std_msgs/msg/Float32", {"data": 2.0}),
            LogRecord(2, "a.py", "INFO", "a", "text", "a.py", 3),
            OutputLine(2, "a.py", "stdout", "text"),
            GraphSnapshot(3, ("/a",), (Endpoint("publisher", "/a", "t", "/a", 0, "reliable", "volatile"),)),
            Fault(4, "a.py", FaultKind.EXCEPTION, "text", "a.py", 1, ("a.py:1 in main",)),
            Offer(4, "a.py", "service", "/s", "t"),
            Mark(5, "limit", "why"),
            GraphSnapshot(3, ("/a",), (), (ServiceEnd("client", "/s", "t", "/a"),)),
            Request(4, "/s", "t", 1, "grader", 1, {"data": True}),
            Response(4, "/s", "t", 1, "student", 1, {"message": math.inf}, b"\0\1\0\0"),
        ),
        starts=(Start("a.py", "src/a.py", StartWay.ENTRY_POINT, "p.a:main", ("random.py",)),),
    )
)


def test_a_trace_of_an_earlier_version_says_nothing_of_starts() -> None:
    """It is read all the same, and written as it was."""
    earlier = {name: value for name, value in SOUND.items() if name != "starts"}
    assert trace_from_json(earlier).starts == ()
    assert trace_to_json(trace_from_json(earlier)) == earlier


def test_a_fault_has_its_details() -> None:
    """Without them a recording is damaged: a missing exit code would be taken for one that is not known."""
    fault = Fault(1, "a.py", FaultKind.EXITED, "exited with code 3", exit_code=3)
    trace = AssessedTrace("alone", ClockKind.VIRTUAL, 10, (fault,))
    whole = trace_to_json(trace)
    cut = {**whole, "observations": [row[:-1] for row in whole["observations"]]}
    assert trace_from_json(whole).faults() == unpack_trace(pack_trace(trace, [False])).faults() == trace.faults()
    with pytest.raises(HarnessError, match="expected grader/trace/v1, found something else"):
        trace_from_json(cut)
    with pytest.raises(EvidenceError, match="expected grader/trace/v1, found something else"):
        unpack_trace(json.dumps(cut).encode())


#: Keys and numbers that lead to a value.
Place = tuple[str | int, ...]

WRONG: tuple[Any, ...] = (None, True, 1, 1.5, "x", [], {}, [["x"]], {"x": 1}, "\ud800")


def paths(data: Any, at: Place = ()) -> list[Place]:
    """Return the path of every value inside a JSON value."""
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    return [at, *(path for key, value in inner for path in paths(value, (*at, key)))]


def replaced(data: Any, path: Place, value: Any) -> Any:
    """Return a copy with one value replaced."""
    if not path:
        return value
    copied = copy.deepcopy(data)
    inner = copied
    for key in path[:-1]:
        inner = inner[key]
    inner[path[-1]] = value
    return copied


@pytest.mark.parametrize("path", paths(SOUND), ids=lambda path: ".".join(map(str, path)) or "all")
def test_damage_is_refused_or_harmless(path: Place) -> None:
    """Whatever stands in a field instead, the answer is HarnessError or a trace of the right types, never a crash."""
    for wrong in WRONG:
        with contextlib.suppress(HarnessError):
            assert_types(trace_from_json(replaced(SOUND, path, wrong)))


def assert_types(trace: AssessedTrace) -> None:
    """Check that everything in a trace is of the type that its class says."""
    assert type(trace.scenario) is type(trace.clock_reason) is type(trace.harness_problem) is str
    assert type(trace.stop_ns) is int
    assert isinstance(trace.clock, ClockKind)
    assert all(type(note) is str for note in trace.notes)
    for o in trace.observations:
        assert type(o) in OBSERVATIONS
        assert type(o.t_ns) is int
        names = {name for name, kind in type(o).__annotations__.items() if kind == "str"}
        assert all(type(getattr(o, name)) is str for name in names)
        if isinstance(o, (Message, Delivery, Request, Response)):
            assert type(o.value) is dict
            assert type(o.cdr) is bytes


@pytest.mark.parametrize(
    ("path", "wrong"),
    [
        (("format",), "grader/trace/v2"),
        (("clock",), "sundial"),
        (("stop_ns",), 1.0),
        (("stop_ns",), True),
        (("notes",), "not a list"),
        (("notes",), [1]),
        (("observations",), {}),
        (("observations", 0, 0), "massage"),
        (("observations", 0), ["message", 1, "/a", "t", {}]),
        (("observations", 0), ["message", 1, "/a", "t", {}, "", ""]),
        (("observations", 0, 4), [1]),
        (("observations", 0, 4), {"data": {"float": "many"}}),
        (("observations", 0, 5), "no base64!"),
        (("observations", 0, 5), "AAA"),
        (("observations", 0, 5), "Ä" * 4),
        (("observations", 4, 2), "abc"),
        (("observations", 4, 3), ["abcdefgh"]),
        (("observations", 5, 3), "surprise"),
        (("observations", 5, 7), "abc"),
        (("observations", 5, 8), None),
        (("observations", 5, 8), [None, ""]),
        (("observations", 5, 8), [0.5, "", None]),
        (("observations", 5, 8), [None, "", [3]]),
        (("observations", 8, 4), "abc"),
        (("observations", 8, 4, 0), ["client", "/s", "t"]),
        (("observations", 9, 4), 1.0),
        (("observations", 9, 6), "1"),
        (("observations", 9, 7), [1]),
        (("observations", 10, 8), "no base64!"),
    ],
)
def test_damage_is_named(path: Place, wrong: Any) -> None:
    """A trace with a field that says something else is no trace."""
    with pytest.raises(HarnessError, match="trace: expected"):
        trace_from_json(replaced(SOUND, path, wrong))


def test_a_trace_nested_without_end_is_refused() -> None:
    """A hostile answer does not end the grader by its depth."""
    deep: dict[str, Any] = {}
    for _ in range(100_000):
        deep = {"x": deep}
    data = copy.copy(SOUND)
    data["observations"] = [["message", 1, "/a", "t", deep, ""]]
    try:
        with pytest.raises(HarnessError):
            trace_from_json(data)
    finally:
        while deep:  # Python would free it recursively
            deep = deep.pop("x")


def test_the_first_word_is_the_kind() -> None:
    """People who read a trace find their way."""
    assert [observation[0] for observation in SOUND["observations"]] == [
        "message",
        "delivery",
        "log",
        "line",
        "graph",
        "fault",
        "offer",
        "mark",
        "graph",
        "request",
        "response",
    ]
    assert observation_to_json(Mark(5, "limit", "why")) == ["mark", 5, "limit", "why"]
