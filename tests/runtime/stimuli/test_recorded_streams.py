"""Recordings of any message type: read, replaced, sent to a cluster, and played to real nodes on both clocks."""

from __future__ import annotations

import json
import math
import subprocess
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from places import GRADE
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore
from tiers import NIGHTLY, each, more
from tracing import ODOMETRY

from grader.course.authoring.checking import check_rubric
from grader.course.classroom.sending import checks_of
from grader.grading.app.bags import played_bags, read_given, read_recordings, recordings_digest
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest, command_words, request_of, request_to_json
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RecordingError, RubricError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.recording.bag import read_bag
from grader.runtime.stimuli.recorded import RecordedStream

SCAN, POSE = "sensor_msgs/msg/LaserScan", "geometry_msgs/msg/PoseStamped"
STORE = get_typestore(Stores.ROS2_JAZZY)
T = STORE.types
START_NS = 1_700_000_000 * NS_PER_S

RUBRIC = """\
schema: grader/rubric/v1
exercise: {{id: near, number: 9, title: The nearest thing}}
files: [near.py]
scenarios:
  - id: driving
    processes: [near.py]
    observe: {{duration: 8 s}}
    stimuli:
      - recorded: {{topic: {topic}, type: {type}, bag: bags/drive, start: 1 s, duration: 5 s}}
criteria:
  - id: subscribes
    title: Subscribes
    points: 5
    scenario: driving
    hint: call create_subscription
    check:
      subscribes: {{topic: {topic}, type: {type}}}
  - id: publishes
    title: Publishes what it received
    points: 5
    scenario: driving
    hint: publish what arrives
    check:
      field_in_range: {{topic: /near, field: data, low: {low}, high: {high}}}
"""

NODE = """\
import rclpy
from rclpy.node import Node
from std_msgs.msg import Float32
from {package}.msg import {name}


class Near(Node):
    def __init__(self):
        super().__init__("near")
        self.publisher = self.create_publisher(Float32, "/near", 10)
        self.create_subscription({name}, "{topic}", self.on_message, 10)

    def on_message(self, msg):
        self.publisher.publish(Float32(data={value}))


rclpy.init()
rclpy.spin(Near())
"""


def header() -> Any:
    return T["std_msgs/msg/Header"](stamp=T["builtin_interfaces/msg/Time"](sec=1, nanosec=2), frame_id="laser")


def scan(number: int) -> bytes:
    """Return a scan whose nearest thing is 2 to 3 m away; nothing is seen in one direction."""
    ranges = np.array([math.inf, 2.0 + number % 10 / 10, 7.5], dtype=np.float32)
    numbers = {name: np.float32(0.5) for name in ("angle_min", "angle_max", "angle_increment", "time_increment")}
    rest = {name: np.float32(0.5) for name in ("scan_time", "range_min", "range_max")}
    message = T[SCAN](header=header(), **numbers, **rest, ranges=ranges, intensities=np.array([], dtype=np.float32))
    return bytes(STORE.serialize_cdr(message, SCAN))


def pose(number: int) -> bytes:
    """Return a pose with x between 4 and 5 m."""
    point = T["geometry_msgs/msg/Point"](x=4.0 + number % 10 / 10, y=0.0, z=0.0)
    turned = T["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
    message = T[POSE](header=header(), pose=T["geometry_msgs/msg/Pose"](position=point, orientation=turned))
    return bytes(STORE.serialize_cdr(message, POSE))


def write_bag(path: Path, topics: Mapping[str, tuple[str, Sequence[bytes]]], period_ns: int = NS_PER_S // 10) -> Path:
    """Write a recording: each topic with its type and messages, one every period."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        for topic, (type_, messages) in topics.items():
            connection = writer.add_connection(topic, type_, typestore=STORE)
            for number, data in enumerate(messages):
                writer.write(connection, START_NS + number * period_ns, data)
    return path


SCANS = {"/scan": (SCAN, [scan(n) for n in range(80)])}
POSES = {"/pose": (POSE, [pose(n) for n in range(80)])}


def course(folder: Path, bag: Mapping[str, tuple[str, Sequence[bytes]]] | None = None, **wanted: str) -> Path:
    """Write a rubric that plays a recording, and return its path."""
    given = {"topic": "/scan", "type": SCAN, "low": "1.9", "high": "3.1", **wanted}
    rubric = folder / "near.yaml"
    folder.mkdir(parents=True, exist_ok=True)
    rubric.write_text(RUBRIC.format(**given), encoding="utf-8")
    write_bag(folder / "bags" / "drive", SCANS if bag is None else bag)
    return rubric


def handed_in(folder: Path, topic: str, type_: str, value: str) -> Path:
    package, _, name = type_.split("/")
    folder.mkdir(exist_ok=True)
    (folder / "near.py").write_text(NODE.format(package=package, name=name, topic=topic, value=value), encoding="utf-8")
    return folder


def grade(*words: object) -> dict[str, Any]:
    """Return the report of a real run."""
    command = [GRADE, *map(str, words), "--json", "--isolation", "none"]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.stdout, done.stderr
    report: dict[str, Any] = json.loads(done.stdout)
    return report


@pytest.mark.ros
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
@pytest.mark.parametrize(
    ("topic", "type_", "bag", "value", "band"),
    each(
        [
            ("/scan", SCAN, SCANS, "min(msg.ranges)", ("1.9", "3.1")),
            ("/pose", POSE, POSES, "msg.pose.position.x", ("3.9", "5.1")),
        ],
        2,
    ),
)
def test_a_node_gets_what_was_recorded(
    tmp_path: Path,
    clock: str,
    topic: str,
    type_: str,
    bag: Mapping[str, tuple[str, Sequence[bytes]]],
    value: str,
    band: tuple[str, str],
) -> None:
    """A right node gets all points; one that sends a fixed number gets none for it."""
    rubric = course(tmp_path / "course", bag, topic=topic, type=type_, low=band[0], high=band[1])
    right = handed_in(tmp_path / "right", topic, type_, value)
    report = grade(right, "--rubric", rubric, "--clock", clock)
    assert report["score"] == 10, report
    assert report["reproduce"]["recording"].startswith("sha256:")
    wrong = handed_in(tmp_path / "wrong", topic, type_, "99.0")
    assert grade(wrong, "--rubric", rubric, "--clock", clock)["score"] == 5


@pytest.mark.nightly
@pytest.mark.ros
def test_another_recording_can_be_played(tmp_path: Path) -> None:
    """By its topic or its type; the report tells the command that plays it again."""
    rubric = course(tmp_path / "course")
    right = handed_in(tmp_path / "right", "/scan", SCAN, "min(msg.ranges)")
    far = [scan(n) for n in (9,) * 80]
    other = write_bag(tmp_path / "other", {"/front/scan": (SCAN, far)})
    for name in ("/scan", SCAN):
        report = grade(right, "--rubric", rubric, "--recording", f"{name}={other}")
        assert report["score"] == 10
        assert f"--recording {name}={other}" in str(report["reproduce"]["command"])
    own = grade(right, "--rubric", rubric)
    assert own["reproduce"]["recording"] != report["reproduce"]["recording"]


def request(rubric: Path, *bags: tuple[str, Path]) -> GradeRequest:
    return GradeRequest("ada", rubrics=(rubric,), bags=bags)


def test_its_files_belong_to_the_rubric(tmp_path: Path) -> None:
    """They change its digest, and go to the machines of a cluster with it."""
    rubric = course(tmp_path)
    before = read_rubric(rubric).digest
    sent = {Path(name.decode()).name: content for name, content in checks_of([rubric])}
    assert sorted(sent) == ["drive.mcap", "metadata.yaml"]
    assert sent["drive.mcap"] == (tmp_path / "bags" / "drive" / "drive.mcap").read_bytes()
    for file in (tmp_path / "bags" / "drive").iterdir():
        file.unlink()
    (tmp_path / "bags" / "drive").rmdir()
    course(tmp_path, {"/scan": (SCAN, [scan(0)] * 80)})
    assert read_rubric(rubric).digest != before


def test_what_is_read_and_its_digest(tmp_path: Path) -> None:
    """Every field but large matrices, also numbers that are not finite; the digest covers what is played."""
    rubric = course(tmp_path)
    asked = request(rubric)
    exercises = read_exercises(asked)
    ((stream, recording),) = read_recordings(asked, exercises).items()
    assert (stream.topic, stream.type, recording.topic, len(recording.messages)) == ("/scan", SCAN, "/scan", 80)
    assert recording.messages[3].value["ranges"] == [math.inf, pytest.approx(2.3), 7.5]
    assert recording.messages[3].value["header"]["frame_id"] == "laser"
    own = recordings_digest(read_given(asked, read_recordings(asked, exercises)))
    other = request(rubric, ("/scan", write_bag(tmp_path / "other", {"/scan": (SCAN, [scan(1)] * 80)})))
    assert own != recordings_digest(read_given(other, read_recordings(other, exercises)))


def test_a_request_comes_back(tmp_path: Path) -> None:
    """As JSON in evidence."""
    asked = request(tmp_path / "r.yaml", (ODOMETRY, Path("drive")), ("/scan", Path("scans")))
    data = json.loads(json.dumps(request_to_json(asked)))
    assert data["recordings"] == {ODOMETRY: "drive", "/scan": "scans"}
    assert request_of(data, submission="ada", seed=7, rubrics=asked.rubrics).bags == asked.bags
    assert f"--recording {ODOMETRY}=drive --recording /scan=scans" in " ".join(command_words(asked, 7))


def test_the_topic_comes_before_the_type(tmp_path: Path) -> None:
    """A recording for one topic is played there, one for the type on the others."""
    rubric = course(tmp_path)
    by_topic = write_bag(tmp_path / "topic", {"/scan": (SCAN, [scan(1)] * 60)})
    by_type = write_bag(tmp_path / "type", {"/scan": (SCAN, [scan(1)] * 70)})
    both = request(rubric, ("/scan", by_topic), (SCAN, by_type))
    (found,) = read_recordings(both, read_exercises(both)).values()
    assert len(found.messages) == 60


def refused(asked: GradeRequest) -> RecordingError:
    with pytest.raises(RecordingError) as caught:
        read_recordings(asked, read_exercises(asked))
    assert "\n" not in caught.value.message
    return caught.value


@pytest.mark.parametrize(
    ("topics", "message", "hint"),
    [
        ({}, f"expected a topic of type {SCAN}, found no topics at all", "record it with `ros2 bag record /scan`"),
        (POSES, f"expected a topic of type {SCAN}, found {POSE} on /pose", "record it with `ros2 bag record /scan`"),
        ({"/scan": (SCAN, [])}, "with at least 20 messages, found none", "record it for longer"),
        ({"/scan": (SCAN, [scan(0)] * 25)}, "with at least 5 s, found 2.40 s", "record it for longer"),
        ({"/scan": (SCAN, [b"\x00\x01\x00\x00"] * 80)}, f"expected {SCAN} in message 1 of 80 on /scan, found", "again"),
    ],
)
def test_a_recording_that_cannot_be_played(
    tmp_path: Path, topics: Mapping[str, tuple[str, Sequence[bytes]]], message: str, hint: str
) -> None:
    """One that is given instead of the rubric's says what is wrong with it, and what to do."""
    bad = write_bag(tmp_path / "bad", topics)
    error = refused(request(course(tmp_path / "course"), ("/scan", bad)))
    assert error.message.startswith(f"{bad}: expected")
    assert message in error.message
    assert hint in error.hint


def test_a_file_that_is_no_recording(tmp_path: Path) -> None:
    """Its path and its ending are named."""
    (tmp_path / "notes.txt").write_text("nothing")
    error = refused(request(course(tmp_path / "course"), ("/scan", tmp_path / "notes.txt")))
    assert error.message == f"{tmp_path}/notes.txt: expected a .mcap or .db3 file, found the ending .txt"


def test_a_recording_as_short_as_the_rubrics_own_is_long_enough(tmp_path: Path) -> None:
    """A map is published once."""
    rubric = course(tmp_path / "course", {"/scan": (SCAN, [scan(0)])})
    one = request(rubric, ("/scan", write_bag(tmp_path / "one", {"/scan": (SCAN, [scan(1)])})))
    (found,) = read_recordings(one, read_exercises(one)).values()
    assert len(found.messages) == 1


def test_a_position_must_be_known_and_a_distance_need_not(tmp_path: Path) -> None:
    """What is not finite in a point cannot be judged; a scan sees nothing in some direction."""
    lost = pose(0)[:-56] + np.array([math.nan, 0.0, 0.0, 0, 0, 0, 1]).tobytes()
    bag = write_bag(tmp_path / "lost", {"/pose": (POSE, [lost])})
    with pytest.raises(RecordingError, match="expected a position in message 1 of 1 on /pose"):
        read_bag(bag, "/pose", POSE)


def test_a_topic_that_no_rubric_plays(tmp_path: Path) -> None:
    """A misspelt topic is not ignored in silence."""
    with pytest.raises(RecordingError) as caught:
        read_exercises(request(course(tmp_path), ("/sacn", tmp_path / "bag")))
    assert "--recording /sacn=" in caught.value.message
    assert "recordings are played on /scan" in caught.value.message


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (("bags/drive", "bags/drvie"), "recorded: bags/drvie: expected a file beside the rubric, found nothing there"),
        (("bags/drive", "../drive"), "expected a recording beside the rubric such as bags/scan, found `../drive`"),
        ((f"type: {SCAN}, bag", "type: sensor_msgs/msg/LaserScam, bag"), "expected a message type of sensor_msgs"),
        ((f"type: {SCAN}, bag", "type: sensor_msgs/msg/Imu, bag"), "near.yaml:9:66: "),
    ],
)
def test_a_mistake_in_the_rubric_has_its_place(tmp_path: Path, change: tuple[str, str], message: str) -> None:
    """File, line and column, where `grade rubric check` is asked."""
    rubric = course(tmp_path)
    rubric.write_text(rubric.read_text(encoding="utf-8").replace(*change), encoding="utf-8")
    with pytest.raises(RubricError) as caught:
        check_rubric(rubric)
    assert message in caught.value.message
    assert "near.yaml" in caught.value.message


def test_a_type_of_the_courses_own(tmp_path: Path) -> None:
    """Its definition comes from the rubric's interfaces; without one, the error says what to bring."""
    wheels = "int32 left\nint32 right\nstd_msgs/Header header\n"
    store = get_typestore(Stores.ROS2_JAZZY)
    store.register(get_types_from_msg(wheels, "robo_msgs/msg/Wheels"))
    kind = store.types["robo_msgs/msg/Wheels"]
    data = bytes(store.serialize_cdr(kind(left=3, right=-4, header=header()), "robo_msgs/msg/Wheels"))
    bag = tmp_path / "bag"
    with Writer(bag, version=9, storage_plugin=StoragePlugin.SQLITE3) as writer:
        connection = writer.add_connection("/wheels", "robo_msgs/msg/Wheels", typestore=store)
        writer.write(connection, START_NS, data)
    with pytest.raises(RecordingError, match="expected messages of a known type, found robo_msgs/msg/Wheels") as caught:
        read_bag(bag, "/wheels", "robo_msgs/msg/Wheels")
    assert "--interfaces FOLDER" in caught.value.hint
    found = read_bag(bag, "/wheels", "robo_msgs/msg/Wheels", define=lambda _: wheels)
    assert (found.messages[0].value["left"], found.messages[0].value["right"]) == (3, -4)


def test_without_a_rubric(tmp_path: Path) -> None:
    """`grade observe` finds the type of a topic, and the topic of a type."""
    bag = write_bag(tmp_path / "bag", {**SCANS, **POSES})
    assert played_bags([("/scan", bag)], 1, 2) == (RecordedStream("/scan", SCAN, str(bag), 1, 2),)
    assert played_bags([(POSE, bag)], 1, 2) == (RecordedStream("/pose", POSE, str(bag), 1, 2),)
    with pytest.raises(RecordingError, match=r"expected one topic to play, found /pose \(.*\) and /scan"):
        played_bags([("/other", bag)], 1, 2)
