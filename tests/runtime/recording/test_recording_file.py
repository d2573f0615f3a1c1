"""One scenario's recording: a rosbag2 file that other tools read, and exactly the trace that was written."""

from __future__ import annotations

import io
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any, get_args

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from kept_runs import OBSERVATIONS, TRACES, TWIST, twist_message, velocity_trace
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from rosbags.highlevel import AnyReader
from rosbags.rosbag2 import Reader

from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Fault,
    FaultKind,
    LogRecord,
    Mark,
    Message,
    Observation,
)
from grader.runtime.recording.codec import trace_to_json
from grader.runtime.recording.packed import unpack_trace
from grader.runtime.recording.recording_file import packed_trace, recording_bytes, trace_of

FACTS = {"environment": '{"ros_distro": "jazzy"}', "format": "x", "seed": "7"}


def kept(trace: AssessedTrace) -> bytes:
    return recording_bytes(trace, FACTS, "a_0.mcap")[0]


def as_text(trace: AssessedTrace) -> str:
    """Two traces are equal where these are; NaN is equal to itself, True is not 1."""
    return json.dumps(trace_to_json(trace))


def bag(tmp_path: Path, trace: AssessedTrace) -> Path:
    folder = tmp_path / "a"
    folder.mkdir()
    recording, metadata = recording_bytes(trace, FACTS, "a_0.mcap")
    (folder / "a_0.mcap").write_bytes(recording)
    (folder / "metadata.yaml").write_bytes(metadata)
    return folder


def test_every_kind_of_observation_is_tried() -> None:
    """A new kind has to be added here, and to what recordings hold."""
    assert set(OBSERVATIONS) == set(get_args(Observation))


@settings(deadline=None)
@given(TRACES)
def test_a_trace_comes_back_as_it_was(trace: AssessedTrace) -> None:
    """Bytes of messages included, whatever a student's text or message holds."""
    assert as_text(trace_of(kept(trace))) == as_text(trace)


@settings(deadline=None)
@given(TRACES)
def test_judging_is_given_all_but_the_bytes(trace: AssessedTrace) -> None:
    """The quick way gives what the exact way gives."""
    quick = json.loads(as_text(unpack_trace(packed_trace(kept(trace)))))
    exact = json.loads(as_text(trace))
    for row in exact["observations"]:
        if row[0] in ("message", "delivery", "request", "response"):
            row[5 if row[0] == "message" else -1] = ""  # a message may have more after its bytes
    assert quick == exact


@settings(deadline=None)
@given(TRACES)
def test_other_tools_open_every_recording(trace: AssessedTrace) -> None:
    """Every message is there, in order, and can be decoded by its embedded type, whatever it is made of."""
    reader = make_reader(io.BytesIO(kept(trace)), decoder_factories=[DecoderFactory()])
    decoded = list(reader.iter_decoded_messages(log_time_order=False))
    assert len(decoded) == len(trace.observations) + 1


def test_the_same_trace_gives_the_same_bytes() -> None:
    """Recordings can be compared by their digests."""
    assert recording_bytes(velocity_trace(), FACTS, "a_0.mcap") == recording_bytes(velocity_trace(), FACTS, "a_0.mcap")


@pytest.mark.parametrize("inside", ["", "a_0.mcap"])
def test_rosbags_reads_folder_and_file(tmp_path: Path, inside: str) -> None:
    """All messages with their types, their virtual times and their values, without any other type store."""
    source = bag(tmp_path, velocity_trace()) / inside
    with AnyReader([source]) as reader:
        twists = [c for c in reader.connections if c.topic == "/cmd_vel"]
        got = [(t, reader.deserialize(raw, c.msgtype)) for c, t, raw in reader.messages(twists)]
        logs = [reader.deserialize(raw, c.msgtype).msg for c, _, raw in reader.messages() if c.topic == "/rosout"]
    assert [t for t, _ in got] == [50_000_000 * i for i in range(200)]
    assert {(m.linear.x, m.angular.z) for _, m in got} == {(0.5, 0.1)}
    assert logs == ["started"]


def test_the_metadata_says_what_the_file_holds(tmp_path: Path) -> None:
    """As a tool that only reads metadata.yaml shows it."""
    folder = bag(tmp_path, velocity_trace())
    with Reader(folder) as whole, Reader(folder / "a_0.mcap") as bare:
        said = [(c.topic, c.msgtype, c.msgcount, c.digest) for c in whole.connections]
        found = [(c.topic, c.msgtype, c.msgcount) for c in bare.connections]
        assert [row[:3] for row in said] == found
        assert ("/cmd_vel", TWIST, 200) in found
        assert all(row[3].startswith("RIHS01_") for row in said)
        assert (whole.duration, whole.message_count) == (bare.duration, bare.message_count)


def texts(trace: AssessedTrace, topic: str) -> list[Any]:
    """Return what a topic of the grader's own says."""
    reader = make_reader(io.BytesIO(kept(trace)), decoder_factories=[DecoderFactory()])
    return [json.loads(d.decoded_message.data) for d in reader.iter_decoded_messages(topics=[topic])]


def test_what_is_no_message_is_told_as_json() -> None:
    """Faults, limits, output and the graph are seen in any viewer."""
    fault = Fault(5, "a.py", FaultKind.EXCEPTION, "ValueError: no", "a.py", 3, ("a.py:3 in main",))
    trace = AssessedTrace("s", ClockKind.WALL, 10, (fault, Mark(6, "limit", "too much")), notes=("n",))
    (told,) = texts(trace, "/grader/faults")
    assert (told["kind"], told["file"], told["line"], told["frames"]) == ("exception", "a.py", 3, ["a.py:3 in main"])
    assert texts(trace, "/grader/marks") == [{"name": "limit", "detail": "too much"}]
    (run,) = texts(trace, "/grader/run")
    assert (run["scenario"], run["clock"], run["notes"], run["seed"]) == ("s", "wall", ["n"], "7")
    (graph,) = texts(velocity_trace(), "/grader/graph")
    assert graph["endpoints"][0]["topic"] == "/cmd_vel"
    (line,) = texts(velocity_trace(), "/grader/output")
    assert line == {"process": "velocity_publisher.py", "stream": "stdout", "text": "hello"}


@pytest.mark.parametrize(
    "message",
    [
        Message(1, "/cmd_vel", TWIST, {}, b"\0\1\0\0short"),
        Message(1, "/x", "turtlesim/msg/Pose", {"x": 1.0}, b"\0\1\0\0" + bytes(20)),
        Message(1, "/big", "std_msgs/msg/String", {}, b""),
        Message(1, "/rosout", "std_msgs/msg/Float32", {"data": 1.0}, b"\0\1\0\0\0\0\0\0"),
        Message(1, "/grader/faults", "std_msgs/msg/Float32", {"data": 1.0}, b"\0\1\0\0\0\0\0\0"),
        Message(1, "/a\nb", "std_msgs/msg/Float32", {"data": 1.0}, b"\0\1\0\0\0\0\0\0"),
    ],
    ids=["malformed", "unknown type", "not kept", "log topic", "forged fault", "line break"],
)
def test_what_other_tools_cannot_read_is_told_apart(message: Message) -> None:
    """Malformed bytes, unknown types and forged topics stay out of the topics of the grader."""
    trace = AssessedTrace("s", ClockKind.VIRTUAL, 10, (message,))
    told = texts(trace, "/grader/undecoded")
    shown = [(row["topic"], row["type"], row["publisher"]) for row in told]
    assert shown == [(message.topic, message.type, "student")]
    assert as_text(trace_of(kept(trace))) == as_text(trace)


def test_a_number_that_the_grader_published_can_be_read() -> None:
    """It is kept as fields; the recording shows it as a message."""
    trace = AssessedTrace(
        "s", ClockKind.VIRTUAL, 10, (Delivery(1, "/temperature", "std_msgs/msg/Int32", {"data": 26}),)
    )
    reader = make_reader(io.BytesIO(kept(trace)), decoder_factories=[DecoderFactory()])
    (found,) = list(reader.iter_decoded_messages(topics=["/temperature"]))
    assert (found.decoded_message.data, found.channel.metadata["publisher"]) == (26, "grader")


def test_log_records_keep_what_ros_knows_of_them() -> None:
    """Severity, logger, text, file, line and time."""
    record = LogRecord(1_500_000_000, "a.py", "WARN", "node", "text\0 \ud800", "pkg/a.py", 12)
    reader = make_reader(
        io.BytesIO(kept(AssessedTrace("s", ClockKind.VIRTUAL, 10, (record,)))), decoder_factories=[DecoderFactory()]
    )
    (found,) = list(reader.iter_decoded_messages(topics=["/rosout"]))
    log = found.decoded_message
    assert (log.level, log.name, log.file, log.line, log.stamp.sec, log.stamp.nanosec) == (
        30,
        "node",
        "pkg/a.py",
        12,
        1,
        500_000_000,
    )
    assert log.msg == "text\ufffd ?"


WHOLE = kept(AssessedTrace("s", ClockKind.VIRTUAL, 10, tuple(twist_message(i) for i in range(3))))


@settings(deadline=None)
@given(st.integers(0, len(WHOLE) - 1), st.binary(max_size=4), st.booleans())
def test_damage_is_refused_or_harmless(at: int, other: bytes, cut: bool) -> None:
    """Whatever stands in a file, the answer is EvidenceError or a trace, never a crash."""
    damaged = WHOLE[:at] if cut else WHOLE[:at] + other + WHOLE[at + len(other) :]
    for read in (trace_of, lambda recording: unpack_trace(packed_trace(recording))):
        assert isinstance(trace_or_problem(damaged, read), (AssessedTrace, EvidenceError))


def trace_or_problem(recording: bytes, read: Callable[[bytes], AssessedTrace]) -> AssessedTrace | EvidenceError:
    try:
        return read(recording)
    except EvidenceError as error:
        return error
