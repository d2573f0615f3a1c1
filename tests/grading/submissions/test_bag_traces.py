"""Recordings that students hand in: those of other robots, every form of rosbag2, and everything that can be wrong."""

from __future__ import annotations

import json
import sqlite3
from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
import zstandard
from mcap.writer import Writer as McapWriter
from recorded_bags import START_NS, STORE, T, drive, odometry_cdr, others, write_bag
from rosbags.rosbag2 import CompressionMode, StoragePlugin
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from grader.grading.submissions import bag_traces
from grader.grading.submissions.bag_files import bags_in
from grader.grading.submissions.bag_reader import bag_answer
from grader.grading.submissions.bag_traces import UnreadableBag, bag_trace
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import MIB, NS_PER_S
from grader.runtime.model.scenario import HandedInBag, Scenario, Span
from grader.runtime.model.trace import AssessedTrace, ClockKind, Delivery, Message

ODOMETRY = "nav_msgs/msg/Odometry"
ASKED = Scenario("drive", (), Span(0), handed_in=HandedInBag("*", ("/odom",)))
MCAP, SQLITE = StoragePlugin.MCAP, StoragePlugin.SQLITE3


def asked(*topics: str, limits: Limits | None = None, **how: int) -> Scenario:
    return replace(ASKED, handed_in=HandedInBag("*", topics, **how), limits=limits or Limits())


def in_this_process(request: bytes, _: Mapping[str, int], files: Sequence[int]) -> tuple[bytes, int]:
    """Answer as the contained process does, which takes a second to start."""
    assert files
    return b"".join(bag_answer(json.loads(request))), 0


def read(root: Path, scenario: Scenario = ASKED, **how: bool) -> AssessedTrace | UnreadableBag:
    """Read the only recording in a folder, in this process unless it has to be `contained`."""
    files = [file.relative_to(root).as_posix() for file in root.rglob("*") if file.is_file()]
    (bag,) = bags_in(files)
    return bag_trace(root, bag.path, scenario, {}, *([] if how.get("contained") else [in_this_process]))


def trace_in(root: Path, scenario: Scenario = ASKED, **how: bool) -> AssessedTrace:
    found = read(root, scenario, **how)
    assert isinstance(found, AssessedTrace), found
    return found


def refused(root: Path, scenario: Scenario = ASKED, **how: bool) -> UnreadableBag:
    """Return why a recording cannot be judged, after checking that the sentence names it and what to do."""
    found = read(root, scenario, **how)
    assert isinstance(found, UnreadableBag), found
    for text in (found.problem, found.hint):
        assert text
        assert text.isprintable()
    assert any(name in found.problem for name in ("bag", "metadata.yaml")), found.problem
    return found


class TestOthersRecordings:
    @pytest.mark.sandbox
    @pytest.mark.parametrize(
        ("name", "odometry", "others_", "lasts_s"),
        [
            ("neato_square", 194, {"/cmd_vel": 365, "/tf_static": 2, "/bump": 194}, 41.3),
            ("turtlebot3_path", 776, {"/imu": 5280, "/clock": 276}, 26.8),
            ("standing_best_effort", 335, {"/scan": 116, "/tf": 337}, 16.9),
        ],
    )
    def test_are_read_by_the_contained_process(
        self, name: str, odometry: int, others_: dict[str, int], lasts_s: float
    ) -> None:
        trace = trace_in(others(name), asked("/odom", *others_), contained=True)
        assert Counter(message.topic for message in trace.messages()) == {"/odom": odometry, **others_}
        assert trace.clock is ClockKind.WALL
        assert trace.stop_ns / NS_PER_S == pytest.approx(lasts_s, abs=0.2)
        times = [message.t_ns for message in trace.messages()]
        assert (min(times), times) == (0, sorted(times))
        assert {message.type for message in trace.messages("/odom")} == {ODOMETRY}
        assert trace.messages("/odom")[0].cdr
        assert trace.bag is not None
        assert ("/odom", ODOMETRY, odometry) in trace.bag.topics

    def test_types_without_a_definition_are_told_and_keep_their_times(self) -> None:
        trace = trace_in(others("neato_square"), asked("/bump", "/odom"))
        assert {bool(message.value) for message in trace.messages("/bump")} == {False}
        (note,) = trace.notes
        assert note.endswith("the type of /bump has no definition in it, so only the times of its messages are read")


class TestForms:
    @pytest.mark.parametrize("plugin", [MCAP, SQLITE])
    @pytest.mark.parametrize("compression", list(CompressionMode))
    def test_every_form_holds_the_same(
        self, tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode
    ) -> None:
        if (plugin, compression) == (SQLITE, CompressionMode.STORAGE):
            pytest.skip("SQLite has no compression of its own")
        plain = write_bag(tmp_path / "plain" / "bag", {"/odom": drive(30)})
        write_bag(tmp_path / "other" / "bag", {"/odom": drive(30)}, plugin=plugin, compression=compression)
        wanted = trace_in(plain.parent)
        found = trace_in(tmp_path / "other")
        assert [(m.t_ns, m.value, m.cdr) for m in found.messages()] == [
            (m.t_ns, m.value, m.cdr) for m in wanted.messages()
        ]
        assert found.stop_ns == wanted.stop_ns == 29 * NS_PER_S // 10 + 1
        assert [m.value["pose"]["pose"]["position"]["x"] for m in wanted.messages()][:3] == [0.0, 0.01, 0.02]

    @pytest.mark.parametrize("plugin", [MCAP, SQLITE])
    def test_a_single_file_without_metadata(self, tmp_path: Path, plugin: StoragePlugin) -> None:
        bag = write_bag(tmp_path / "bag", {"/odom": drive(30)}, plugin=plugin)
        (bag / "metadata.yaml").unlink()
        assert len(trace_in(tmp_path).messages("/odom")) == 30

    @pytest.mark.sandbox
    @pytest.mark.parametrize(
        ("plugin", "compression"), [(SQLITE, CompressionMode.FILE), (MCAP, CompressionMode.MESSAGE)]
    )
    def test_compressed_ones_are_read_where_no_file_can_be_made(
        self, tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode
    ) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(30)}, plugin=plugin, compression=compression)
        assert len(trace_in(tmp_path, contained=True).messages("/odom")) == 30

    @pytest.mark.parametrize("plugin", [MCAP, SQLITE])
    def test_messages_of_its_own_types_are_read_by_its_own_definitions(
        self, tmp_path: Path, plugin: StoragePlugin
    ) -> None:
        store = get_typestore(Stores.ROS2_JAZZY)
        store.register(get_types_from_msg("int32 left\nint32 right\n", "robo_msgs/msg/Wheels"))
        one = store.serialize_cdr(store.types["robo_msgs/msg/Wheels"](left=1, right=2), "robo_msgs/msg/Wheels")
        bag = write_bag(
            tmp_path / "bag",
            {"/wheels": [(START_NS, bytes(one))]},
            plugin=plugin,
            types={"/wheels": "robo_msgs/msg/Wheels"},
        )
        (message,) = trace_in(bag.parent, asked("/wheels")).messages()
        assert (message.type, message.value) == ("robo_msgs/msg/Wheels", {"left": 1, "right": 2})

    def test_a_definition_that_the_rubric_brings_serves_where_the_recording_has_none(self, tmp_path: Path) -> None:
        bag = write_bag(tmp_path / "bag", {"/wheels": []}, plugin=SQLITE, types={"/wheels": "robo_msgs/msg/Wheels"})
        file = next(bag.glob("*.db3"))
        with sqlite3.connect(file) as connection:
            connection.execute("DELETE FROM message_definitions")
            row = (1, START_NS, b"\0\1\0\0\1\0\0\0\2\0\0\0")
            connection.execute("INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row)
        (bag / "metadata.yaml").unlink()
        path = file.relative_to(tmp_path).as_posix()
        brought = {"robo_msgs/msg/Wheels": "int32 left\nint32 right\n"}
        trace = bag_trace(tmp_path, path, asked("/wheels"), brought, in_this_process)
        assert isinstance(trace, AssessedTrace)
        assert [message.value for message in trace.messages()] == [{"left": 1, "right": 2}]

    def test_what_checks_take_as_given_becomes_a_delivery(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(5), "/goal": drive(3)})
        trace = trace_in(tmp_path, replace(asked("/odom", "/goal"), given=("/goal",)))
        assert Counter(type(one) for one in trace.observations) == {Message: 5, Delivery: 3}


class TestContents:
    """What is compared between students."""

    def _contents(self, root: Path) -> tuple[tuple[str, int, str], ...]:
        bag = trace_in(root).bag
        assert bag is not None
        return bag.contents

    def test_is_the_same_if_times_and_stamps_are_others(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "one" / "bag", {"/odom": drive(30)})
        later = [(t_ns + 7_000_000_001, restamped(data)) for t_ns, data in drive(30, NS_PER_S // 9)]
        write_bag(tmp_path / "two" / "bag", {"/odom": later}, plugin=SQLITE)
        ((topic, different, _),) = self._contents(tmp_path / "one")
        assert (topic, different) == ("/odom", 30)
        assert self._contents(tmp_path / "one") == self._contents(tmp_path / "two")

    def test_is_another_if_a_value_is(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "one" / "bag", {"/odom": drive(30)})
        write_bag(tmp_path / "two" / "bag", {"/odom": [*drive(29), (START_NS + 3 * NS_PER_S, odometry_cdr(0.2900001))]})
        assert self._contents(tmp_path / "one") != self._contents(tmp_path / "two")


def restamped(data: bytes) -> bytes:
    message = STORE.deserialize_cdr(data, ODOMETRY)
    message.header.stamp = T["builtin_interfaces/msg/Time"](sec=99, nanosec=7)
    return bytes(STORE.serialize_cdr(message, ODOMETRY))


class TestLimits:
    def test_a_larger_recording_is_refused_with_both_sizes(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(3000)})
        found = refused(tmp_path, asked("/odom", size_bytes=MIB))
        assert found.problem == "bag: expected at most 1 MiB, found 2.2 MiB"

    def test_what_comes_after_the_longest_time_is_not_read(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(100)})
        trace = trace_in(tmp_path, asked("/odom", duration_ns=5 * NS_PER_S))
        assert (len(trace.messages()), trace.stop_ns) == (51, 5 * NS_PER_S + 1)
        assert trace.notes == ("bag: longer than 5 s: what follows is not read",)

    def test_too_many_messages_on_a_topic_end_it(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(100)})
        trace = trace_in(tmp_path, asked("/odom", limits=Limits(messages=40)))
        assert (len(trace.messages()), trace.stop_ns) == (40, 39 * NS_PER_S // 10 + 1)
        assert trace.notes == ("bag: more than 40 messages on /odom: what follows is not read",)

    def test_so_do_too_many_bytes(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(100)})
        trace = trace_in(tmp_path, asked("/odom", limits=Limits(traffic_bytes=len(odometry_cdr(1.0)) * 10)))
        assert len(trace.messages()) == 10

    def test_large_messages_keep_their_times(self, tmp_path: Path) -> None:
        write_bag(tmp_path / "bag", {"/odom": drive(10)})
        trace = trace_in(tmp_path, asked("/odom", limits=Limits(message_bytes=64)))
        assert [(bool(m.value), m.cdr) for m in trace.messages()] == [(False, b"")] * 10
        assert trace.notes == ("bag: messages on /odom are larger than 64 bytes, so only their times are read",)


def _storage(root: Path, plugin: StoragePlugin = MCAP, count: int = 60) -> Path:
    """Write a recording of one file without metadata, and return it."""
    bag = write_bag(root / "bag", {"/odom": drive(count)}, plugin=plugin)
    (bag / "metadata.yaml").unlink()
    return next(bag.iterdir())


def _cut(root: Path) -> None:
    file = _storage(root)
    file.write_bytes(file.read_bytes()[:9000])


def _cut_pages(root: Path) -> None:
    file = _storage(root, SQLITE)
    file.write_bytes(file.read_bytes()[:-100])


def _no_last_pages(root: Path) -> None:
    file = _storage(root, SQLITE)
    file.write_bytes(file.read_bytes()[:-4096])


def _empty(root: Path) -> None:
    (root / "bag.mcap").touch()


def _other_kind(root: Path) -> None:
    (root / "bag.mcap").write_text("import rclpy\n" * 100)


def _other_storage(root: Path) -> None:
    (root / "bag.db3").write_bytes(_storage(root / "other").read_bytes())
    for file in (root / "other" / "bag").iterdir():
        file.unlink()


def _database(root: Path) -> None:
    with sqlite3.connect(root / "bag.db3") as connection:
        connection.execute("CREATE TABLE marks (name TEXT)")


def _ros_1(root: Path) -> None:
    (root / "bag.mcap").write_bytes(b"#ROSBAG V2.0\n" + bytes(200))


def _flipped(root: Path) -> None:
    file = _storage(root)
    content = bytearray(file.read_bytes())
    content[60:90] = b"\xff" * 30
    file.write_bytes(content)


def _other_bytes(root: Path) -> None:
    write_bag(root / "bag", {"/odom": [*drive(3), (START_NS + NS_PER_S, b"\0\1\0\0abc")]})


def _lacks_a_file(root: Path) -> None:
    bag = write_bag(root / "bag", {"/odom": drive(30)})
    text = (bag / "metadata.yaml").read_text().replace("bag.mcap", "bag_1.mcap")
    (bag / "metadata.yaml").write_text(text)


def _no_metadata(root: Path) -> None:
    (write_bag(root / "bag", {"/odom": drive(30)}) / "metadata.yaml").write_text("[1, 2")


def _other_metadata(root: Path) -> None:
    (write_bag(root / "bag", {"/odom": drive(30)}) / "metadata.yaml").write_text("odom: 1\n")


def _alone_and_compressed(root: Path) -> None:
    bag = write_bag(root / "bag", {"/odom": drive(30)}, compression=CompressionMode.FILE)
    (bag / "metadata.yaml").unlink()


def _negative_times(root: Path) -> None:
    with sqlite3.connect(_storage(root, SQLITE)) as connection:
        connection.execute("UPDATE messages SET timestamp = -timestamp")


def _times_as_texts(root: Path) -> None:
    with sqlite3.connect(_storage(root, SQLITE)) as connection:
        connection.execute("UPDATE messages SET timestamp = 'noon'")


def _no_cdr(root: Path) -> None:
    with (root / "bag.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2", "test")
        schema = writer.register_schema(ODOMETRY, "ros2msg", b"int32 x\n")
        channel = writer.register_channel("/odom", "json", schema)
        writer.add_message(channel, 1, b"{}", 1)
        writer.finish()  # type: ignore[no-untyped-call]


def _strange_definition(root: Path) -> None:
    with (root / "bag.mcap").open("wb") as file:
        writer = McapWriter(file)
        writer.start("ros2", "test")
        schema = writer.register_schema(ODOMETRY, "ros2msg", b"int32 x y z ]]]\n__import__('os')\n")
        channel = writer.register_channel("/odom", "cdr", schema)
        writer.add_message(channel, 1, odometry_cdr(1.0), 1)
        writer.finish()  # type: ignore[no-untyped-call]


#: What makes a recording unreadable, and a part of what is said of it.
BROKEN: list[tuple[Callable[[Path], None], str]] = [
    (_cut, "expected a complete rosbag2 recording, found a damaged one"),
    (_cut_pages, "cut after"),
    (_no_last_pages, "found a damaged one"),
    (_empty, "expected a recording, found an empty file"),
    (_other_kind, "found a damaged one (File magic is invalid.)"),
    (_other_storage, "found a damaged one"),
    (_database, "found a damaged one"),
    (_ros_1, "expected a rosbag2 recording, found a ROS 1 bag"),
    (_flipped, "found a damaged one"),
    (_other_bytes, "expected nav_msgs/msg/Odometry in message 4 on /odom, found other bytes"),
    (_lacks_a_file, "names bag_1.mcap, which was not handed in"),
    (_no_metadata, "expected what rosbag2 writes, found something else"),
    (_other_metadata, "expected what rosbag2 writes, found something else"),
    (_alone_and_compressed, "expected the folder of a compressed recording, found the file alone"),
    (_negative_times, "expected a message with its time, found something else"),
    (_times_as_texts, "found a damaged one"),
    (_no_cdr, "expected messages in CDR, as rosbag2 writes them, found json on /odom"),
    (_strange_definition, "expected a definition of nav_msgs/msg/Odometry, found something else"),
]


class TestBroken:
    @pytest.mark.parametrize(("breaks", "said"), BROKEN, ids=[breaks.__name__.lstrip("_") for breaks, _ in BROKEN])
    def test_is_told_with_the_file_and_what_to_do(
        self, tmp_path: Path, breaks: Callable[[Path], None], said: str
    ) -> None:
        breaks(tmp_path)
        assert said in refused(tmp_path).problem

    @pytest.mark.sandbox
    def test_damage_is_told_by_the_contained_process_too(self, tmp_path: Path) -> None:
        _cut(tmp_path)
        assert "found a damaged one" in refused(tmp_path, contained=True).problem

    @pytest.mark.sandbox
    @pytest.mark.slow
    def test_one_that_unpacks_to_gigabytes_is_refused(self, tmp_path: Path) -> None:
        bag = write_bag(tmp_path / "bag", {"/odom": drive(3)}, plugin=SQLITE, compression=CompressionMode.MESSAGE)
        packed = zstandard.ZstdCompressor().compressobj()
        bomb = b"".join([*(packed.compress(bytes(MIB)) for _ in range(4096)), packed.flush()])
        assert len(bomb) < MIB
        with sqlite3.connect(next(bag.glob("*.db3"))) as connection:
            connection.execute("UPDATE messages SET data = ?", (bomb,))
        found = refused(tmp_path, contained=True)
        assert found.problem == "bag: reading it takes too much memory"
        assert found.hint.startswith("record only the topics")

    @pytest.mark.sandbox
    def test_so_is_a_file_that_does(self, tmp_path: Path) -> None:
        bag = write_bag(tmp_path / "bag", {"/odom": drive(3)}, compression=CompressionMode.FILE)
        file = next(bag.glob("*.zstd"))
        file.write_bytes(zstandard.compress(bytes(8 * MIB)))
        found = refused(tmp_path, asked("/odom", size_bytes=4 * MIB), contained=True)
        assert (
            found.problem
            == f"{file.name.replace('bag', 'bag')}: expected at most 4 MiB when it is unpacked, found more"
        )

    @pytest.mark.sandbox
    def test_one_that_takes_long_ends_at_the_limit_of_processor_time(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        bag = write_bag(tmp_path / "bag", {"/odom": drive(3)})
        (bag / "metadata.yaml").write_text(f"rosbag2_bagfile_information: [{'1, ' * 80_000}]")
        monkeypatch.setattr(bag_traces, "PROCESSOR_S", 4)
        assert refused(tmp_path, contained=True).problem == "bag: reading it takes too long"

    def test_an_answer_of_a_process_that_was_taken_over_says_nothing_of_the_grader(self, tmp_path: Path) -> None:
        _storage(tmp_path)

        def tell(request: bytes, limits: Mapping[str, int], files: Sequence[int]) -> tuple[bytes, int]:
            said = json.loads(in_this_process(request, limits, files)[0])
            said["trace"] |= {"harness_problem": "the machine was busy", "suspected": True}
            said["trace"]["observations"] += [["mark", 1, "limit", ""]]
            return json.dumps(said).encode(), 0

        trace = bag_trace(tmp_path, f"bag/{_name(tmp_path)}", ASKED, {}, tell)
        assert isinstance(trace, AssessedTrace)
        assert (trace.harness_problem, trace.suspected, trace.marks("limit")) == ("", False, ())

    @pytest.mark.parametrize(
        ("row", "value"), [(2, "/odom\x1b[31m"), (2, ""), (3, "x" * 256), (1, -1), (1, 2**62), (4, {"float": "nan"})]
    )
    def test_an_observation_that_no_reader_makes_is_no_answer(self, tmp_path: Path, row: int, value: object) -> None:
        """Checks rely on names that are printable, times that count up, and messages with fields."""
        _storage(tmp_path)

        def tell(request: bytes, limits: Mapping[str, int], files: Sequence[int]) -> tuple[bytes, int]:
            said = json.loads(in_this_process(request, limits, files)[0])
            said["trace"]["observations"][30][row] = value
            return json.dumps(said).encode(), 0

        found = bag_trace(tmp_path, f"bag/{_name(tmp_path)}", ASKED, {}, tell)
        assert isinstance(found, UnreadableBag)
        assert found.problem == f"bag/{_name(tmp_path)}: expected a recording, found something else"
        assert found.hint.startswith("copy or record it again")

    @pytest.mark.sandbox
    def test_messages_that_take_the_grader_gigabytes_are_not_taken_over(
        self, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
    ) -> None:
        """A recording of some kilobytes may hold millions of messages in messages."""
        count = 9_990
        definition = f"E[] e\n{'=' * 80}\nMSG: nav_msgs/E\nF[] f\n{'=' * 80}\nMSG: nav_msgs/F\nuint8 a\n"
        with (tmp_path / "bag.mcap").open("wb") as file:
            writer = McapWriter(file)
            writer.start("ros2", "test")
            schema = writer.register_schema(ODOMETRY, "ros2msg", definition.encode())
            channel = writer.register_channel("/odom", "cdr", schema)
            for number in range(15):
                data = b"\0\1\0\0" + count.to_bytes(4, "little") + bytes(4 * count)
                writer.add_message(channel, number, data, number)
            writer.finish()  # type: ignore[no-untyped-call]
        assert (tmp_path / "bag.mcap").stat().st_size < MIB
        monkeypatch.setattr(bag_traces, "MOST_NESTED", 100_000)
        found = refused(tmp_path, asked("/odom", limits=Limits(traffic_bytes=MIB)), contained=True)
        assert found.problem == "bag.mcap: reading it takes too much memory"

    @pytest.mark.parametrize("answer", [b"", b"[]", b"{", b'{"trace": {}}', b'{"trace": {}, "cut": 1}', b"null", b"7"])
    def test_no_answer_is_no_failure_of_the_grader(self, tmp_path: Path, answer: bytes) -> None:
        _storage(tmp_path)
        found = bag_trace(tmp_path, f"bag/{_name(tmp_path)}", ASKED, {}, lambda *_: (answer, -9))
        assert isinstance(found, UnreadableBag)
        assert "too long or too much memory" in found.problem


def _name(root: Path) -> str:
    return next((root / "bag").iterdir()).name


@pytest.mark.sandbox
def test_the_process_can_read_no_other_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name in the metadata that leads elsewhere finds nothing: only what was handed in is there."""
    write_bag(tmp_path / "bag", {"/odom": drive(3)})
    outside = tmp_path / "secret.mcap"
    _storage(tmp_path / "other").rename(outside)
    metadata = tmp_path / "bag" / "metadata.yaml"
    metadata.write_text(metadata.read_text().replace("bag.mcap", str(outside)))
    found = bag_trace(tmp_path, "bag", ASKED)
    assert isinstance(found, UnreadableBag)
    assert "secret.mcap, which was not handed in" in found.problem
