"""Reading recordings: our own, other people's, and everything that can be wrong with one."""

from __future__ import annotations

import contextlib
import importlib.util
import math
import os
import random
import shutil
import subprocess
import sys
import tempfile
from collections.abc import Callable, Iterator
from functools import cache
from itertools import pairwise
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from places import ROOT
from recorded_bags import START_NS, TYPE, drive, odometry_cdr, others, write_bag
from rosbags.rosbag2 import CompressionMode, StoragePlugin

from grader.runtime.model.errors import RecordingError
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.recording.bag import BagMinimum, read_bag
from grader.runtime.stimuli.recorded import Recording, TimedMessage, window

OWN = ROOT / "rubrics" / "exercise_2" / "odometry"
BOTH = pytest.mark.parametrize("plugin", [StoragePlugin.MCAP, StoragePlugin.SQLITE3])


def read_odometry(path: Path) -> Recording:
    """Read the odometry in a recording that has to last for 5 s."""
    return read_bag(path, "/odom", TYPE, least=BagMinimum(messages=20, span_ns=5 * NS_PER_S))


def refused(path: Path) -> str:
    """Return the message of the error that reading ends in, after checking its form."""
    with pytest.raises(RecordingError) as caught:
        read_odometry(path)
    error = caught.value
    assert "\n" not in error.message
    assert "\n" not in error.hint
    assert error.hint
    assert error.message.isprintable()
    assert error.message.startswith(str(path)) or not str(path).isprintable()
    return error.message


@contextlib.contextmanager
def as_nobody() -> Iterator[None]:
    """Drop root's right to read everything, where the tests run as root."""
    if os.geteuid() != 0:
        yield
        return
    os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(0)


@pytest.fixture
def public_folder() -> Iterator[Path]:
    """Yield a folder that every user may enter; pytest's own are closed to others."""
    with tempfile.TemporaryDirectory() as folder:
        Path(folder).chmod(0o755)
        yield Path(folder)


class TestOwnRecording:
    def test_is_long_and_comes_at_a_rate_without_round_divisor(self) -> None:
        """60 s of /odom at 26.8 Hz: every 30th message is not a 1 s log."""
        odometry = read_odometry(OWN)
        last_ns = odometry.messages[-1].t_ns
        assert odometry.topic == "/odom"
        assert 59.5 * NS_PER_S < last_ns < 60.5 * NS_PER_S
        rate_hz = (len(odometry.messages) - 1) / (last_ns / NS_PER_S)
        assert rate_hz == pytest.approx(26.8, abs=0.05)
        assert not 0.9 <= 30 / rate_hz <= 1.1

    def test_intervals_jitter_but_never_run_backwards(self) -> None:
        """Intervals spread by a few milliseconds, some messages are 10 ms late, none overtakes another."""
        times = [m.t_ns for m in read_odometry(OWN).messages]
        gaps_ms = [(b - a) / 1e6 for a, b in pairwise(times)]
        mean = sum(gaps_ms) / len(gaps_ms)
        deviation = math.sqrt(sum((g - mean) ** 2 for g in gaps_ms) / len(gaps_ms))
        assert min(gaps_ms) > 1
        assert 1 < deviation < 6
        assert max(gaps_ms) > mean + 9

    def test_x_and_y_tell_a_swap_and_a_lost_sign(self) -> None:
        """All four quadrants, and |x| and |y| differ by more than 0.15 m in at least 95 of 100 messages."""
        points = [m.value["pose"]["pose"]["position"] for m in read_odometry(OWN).messages]
        assert {(p["x"] > 0, p["y"] > 0) for p in points} == {(a, b) for a in (True, False) for b in (True, False)}
        distinct = sum(abs(p["x"] - p["y"]) > 0.15 and abs(p["x"] + p["y"]) > 0.15 for p in points)
        assert distinct / len(points) > 0.95
        assert math.hypot(points[0]["x"], points[0]["y"]) > 1

    def test_the_robot_moves_as_its_twist_says(self) -> None:
        """Integrating the recorded speed gives the length of the recorded path; orientations are unit and planar."""
        messages = read_odometry(OWN).messages
        speeds = [m.value["twist"]["twist"]["linear"]["x"] for m in messages]
        assert max(speeds) == pytest.approx(0.6, abs=0.03)
        driven = sum(s * (b.t_ns - a.t_ns) / NS_PER_S for s, a, b in zip(speeds, messages, messages[1:], strict=False))
        marks = [messages[i].value["pose"]["pose"]["position"] for i in range(0, len(messages), 10)]
        path = sum(math.dist((a["x"], a["y"]), (b["x"], b["y"])) for a, b in pairwise(marks))
        assert path == pytest.approx(driven, rel=0.03)
        for message in messages:
            q = message.value["pose"]["pose"]["orientation"]
            assert q["z"] ** 2 + q["w"] ** 2 == pytest.approx(1)

    def test_is_what_the_script_writes(self, tmp_path: Path) -> None:
        """The committed recording and a fresh one hold the same messages, and it stays small."""
        spec = importlib.util.spec_from_file_location("make_odometry", OWN.with_name("make_odometry.py"))
        assert spec is not None
        assert spec.loader is not None
        script = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(script)
        script.write(tmp_path / "fresh")
        fresh, committed = read_odometry(tmp_path / "fresh").messages, read_odometry(OWN).messages
        assert [m.t_ns for m in fresh] == [m.t_ns for m in committed]
        for a, b in zip(fresh, committed, strict=True):
            assert a.value["pose"]["pose"]["position"] == pytest.approx(b.value["pose"]["pose"]["position"], abs=1e-9)
        assert sum(f.stat().st_size for f in OWN.iterdir()) < 1_500_000


class TestOtherPeoplesRecordings:
    @pytest.mark.parametrize(
        ("name", "count", "span_s", "first"),
        [
            ("neato_square", 194, 41.10, None),
            ("neato_square/drive_square_0.db3", 194, 41.10, None),
            ("turtlebot3_path", 776, 26.78, (0.0, 0.0)),
            ("turtlebot3_path/path.mcap", 776, 26.78, (0.0, 0.0)),
            ("standing_best_effort", 335, 16.70, (0.557, -1.430)),
            ("standing_best_effort/point_0.db3", 335, 16.70, (0.557, -1.430)),
        ],
    )
    def test_are_read(self, name: str, count: int, span_s: float, first: tuple[float, float] | None) -> None:
        """Both storages, with and without metadata, with custom types beside the odometry."""
        odometry = read_odometry(others(name))
        assert odometry.topic == "/odom"
        assert len(odometry.messages) == count
        assert odometry.messages[-1].t_ns / NS_PER_S == pytest.approx(span_s, abs=0.01)
        position = odometry.messages[0].value["pose"]["pose"]["position"]
        if first is not None:
            assert (position["x"], position["y"]) == pytest.approx(first, abs=0.01)


class TestShapes:
    @BOTH
    @pytest.mark.parametrize("compression", [CompressionMode.NONE, CompressionMode.MESSAGE, CompressionMode.FILE])
    def test_storages_and_compressions(
        self, tmp_path: Path, plugin: StoragePlugin, compression: CompressionMode
    ) -> None:
        """sqlite3 and mcap, plain or zstd-compressed, give the same messages."""
        path = write_bag(tmp_path / "bag", {"/odom": drive()}, plugin=plugin, compression=compression)
        messages = read_odometry(path).messages
        assert [m.t_ns for m in messages] == [n * NS_PER_S // 10 for n in range(60)]
        assert [m.cdr for m in messages] == [data for _, data in drive()]

    def test_chunks_compressed_inside_an_mcap_file(self, tmp_path: Path) -> None:
        """What `ros2 bag record` writes by its fast preset is read as a bare file too."""
        path = write_bag(tmp_path / "bag", {"/odom": drive()}, compression=CompressionMode.STORAGE)
        assert len(read_odometry(path / "bag.mcap").messages) == 60

    @BOTH
    def test_without_metadata(self, tmp_path: Path, plugin: StoragePlugin) -> None:
        """A folder that lost its metadata.yaml, and the file in it, are recordings."""
        path = write_bag(tmp_path / "bag", {"/odom": drive()}, plugin=plugin)
        (path / "metadata.yaml").unlink()
        (path / "notes.txt").write_text("the second run")
        file = next(p for p in path.iterdir() if p.suffix != ".txt")
        assert read_odometry(path) == read_odometry(file)

    def test_metadata_file_means_its_folder(self, tmp_path: Path) -> None:
        """Whoever names metadata.yaml means the recording around it."""
        path = write_bag(tmp_path / "bag", {"/odom": drive()})
        assert read_odometry(path / "metadata.yaml") == read_odometry(path)

    @BOTH
    def test_names_that_look_like_address_parameters(self, tmp_path: Path, plugin: StoragePlugin) -> None:
        """A folder called `lab #2 100%25?x=1` is a folder like any other."""
        folder = tmp_path / "lab #2 100%25?x=1"
        write_bag(tmp_path / "plain" / "bag", {"/odom": drive()}, plugin=plugin).parent.rename(folder)
        path = folder / "bag"
        assert len(read_odometry(path).messages) == 60
        assert len(read_odometry(next(p for p in path.iterdir() if p.suffix != ".yaml")).messages) == 60

    def test_unknown_types_beside_it(self, tmp_path: Path) -> None:
        """A custom type that nobody here knows is ignored."""
        wheels = [(START_NS + n, b"\x00\x01\x00\x00" + bytes(8)) for n in range(5)]
        path = write_bag(
            tmp_path / "bag", {"/wheels": wheels, "/odom": drive()}, types={"/wheels": "robo_msgs/msg/Wheels"}
        )
        assert len(read_odometry(path).messages) == 60

    @pytest.mark.parametrize(
        ("counts", "topic"),
        [
            ({"/robot/odom": 30}, "/robot/odom"),
            ({"/truth": 90, "/odom": 30}, "/odom"),
            ({"/a/odom": 30, "/b/odom": 60, "/c/odom": 40}, "/b/odom"),
            ({"/odom": 0, "/filtered": 70}, "/filtered"),
            ({"/z": 60, "/y": 60}, "/y"),
        ],
    )
    def test_which_topic_is_played(self, tmp_path: Path, counts: dict[str, int], topic: str) -> None:
        """/odom if it says anything, else the topic with most messages; its name is told."""
        period_ns = NS_PER_S // 4
        path = write_bag(tmp_path / "bag", {name: drive(count, period_ns) for name, count in counts.items()})
        odometry = read_odometry(path)
        assert odometry.topic == topic
        assert len(odometry.messages) == counts[topic]

    def test_values_are_those_of_the_message(self, tmp_path: Path) -> None:
        """Under the names of the message definition; the two matrices, of which nobody asks, are left out."""
        message = read_odometry(write_bag(tmp_path / "bag", {"/odom": drive()})).messages[7]
        assert message.value == {
            "header": {"stamp": {"sec": 1, "nanosec": 2}, "frame_id": "odom"},
            "child_frame_id": "base_link",
            "pose": {
                "pose": {
                    "position": {"x": 0.07, "y": 2.0, "z": 0.25},
                    "orientation": {"x": 0.0, "y": 0.0, "z": 0.6, "w": 0.8},
                }
            },
            "twist": {
                "twist": {"linear": {"x": 0.5, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": -0.125}}
            },
        }

    def test_big_endian_messages_are_rewritten(self, tmp_path: Path) -> None:
        """A recording from a big-endian robot is played in the order of bytes that our writer speaks."""
        big = [(t_ns, odometry_cdr(n / 100, little_endian=False)) for n, (t_ns, _) in enumerate(drive())]
        messages = read_odometry(write_bag(tmp_path / "bag", {"/odom": big})).messages
        assert [m.cdr for m in messages] == [data for _, data in drive()]

    def test_equal_times_are_told_apart(self, tmp_path: Path) -> None:
        """Messages received at one instant stay in order, a nanosecond apart."""
        messages = [(START_NS, odometry_cdr(n / 10)) for n in range(3)] + drive()[1:]
        read = read_odometry(write_bag(tmp_path / "bag", {"/odom": messages})).messages
        assert [m.t_ns for m in read[:4]] == [0, 1, 2, NS_PER_S // 10]
        assert [m.value["pose"]["pose"]["position"]["x"] for m in read[:3]] == [0.0, 0.1, 0.2]

    @BOTH
    def test_nothing_is_written_beside_it(self, public_folder: Path, plugin: StoragePlugin) -> None:
        """A folder without write permission works, and is untouched afterwards."""
        path = write_bag(public_folder / "bag", {"/odom": drive()}, plugin=plugin)
        before = {p.name: (p.stat().st_mtime_ns, p.stat().st_size) for p in path.iterdir()}
        for file in path.iterdir():
            file.chmod(0o444)
        path.chmod(0o555)
        with as_nobody():
            assert len(read_odometry(path).messages) == 60
            read_odometry(next(p for p in path.iterdir() if p.suffix != ".yaml"))
        assert {p.name: (p.stat().st_mtime_ns, p.stat().st_size) for p in path.iterdir()} == before
        path.chmod(0o755)


def no_odometry(path: Path) -> Path:
    return write_bag(path, {"/w": [(START_NS, bytes(12))]}, types={"/w": "robo_msgs/msg/Wheels"})


def two_files(path: Path) -> Path:
    for name in ("a", "b"):
        shutil.copy(write_bag(path.parent / name, {"/odom": drive()}) / f"{name}.mcap", path.parent)
    path.mkdir()
    for file in path.parent.glob("*.mcap"):
        file.rename(path / file.name)
    return path


def with_position(x: float) -> Callable[[Path], Path]:
    return lambda path: write_bag(path, {"/odom": [*drive(), (START_NS + 9 * NS_PER_S, odometry_cdr(x))]})


def with_bytes(data: bytes) -> Callable[[Path], Path]:
    return lambda path: write_bag(path, {"/odom": [*drive(), (START_NS + 9 * NS_PER_S, data)]})


def file_with(data: bytes, name: str = "drive.mcap") -> Callable[[Path], Path]:
    def make(path: Path) -> Path:
        path.mkdir()
        (path / name).write_bytes(data)
        return path / name

    return make


def folder_with(data: bytes, name: str) -> Callable[[Path], Path]:
    return lambda path: file_with(data, name)(path).parent


def without_storage(path: Path) -> Path:
    write_bag(path, {"/odom": drive()})
    (path / f"{path.name}.mcap").unlink()
    return path


def compressed_messages_alone(path: Path) -> Path:
    write_bag(path, {"/odom": drive()}, compression=CompressionMode.MESSAGE)
    return path / f"{path.name}.mcap"


def compressed_file_alone(path: Path) -> Path:
    write_bag(path, {"/odom": drive()}, compression=CompressionMode.FILE)
    (path / "metadata.yaml").unlink()
    return path


def a_pipe(path: Path) -> Path:
    os.mkfifo(path)
    return path


@cache
def whole(plugin: StoragePlugin) -> bytes:
    """Return the bytes of an undamaged storage file."""
    with tempfile.TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / "bag", {"/odom": drive()}, plugin=plugin)
        return next(p for p in path.iterdir() if p.suffix != ".yaml").read_bytes()


class TestRefused:
    @pytest.mark.parametrize(
        ("make", "found"),
        [
            pytest.param(lambda path: path, "no such file or folder", id="missing"),
            pytest.param(lambda path: path / "\x1b[31m\nx" / "y", "no such file or folder", id="hostile name"),
            pytest.param(lambda path: file_with(b"x")(path) / "inside", "no such file or folder", id="under a file"),
            pytest.param(lambda path: path.with_name("n" * 300), "cannot be opened", id="name too long"),
            pytest.param(a_pipe, "neither a file nor a folder", id="pipe"),
            pytest.param(no_odometry, f"topic of type {TYPE}, found robo_msgs/msg/Wheels", id="no odometry"),
            pytest.param(lambda path: write_bag(path, {}), "found no topics at all", id="no topics"),
            pytest.param(lambda path: write_bag(path, {"/odom": []}), "20 messages, found none", id="no messages"),
            pytest.param(lambda path: write_bag(path, {"/odom": drive(19)}), "20 messages, found 19", id="few"),
            pytest.param(lambda path: write_bag(path, {"/odom": drive(50)}), "5 s, found 4.90 s", id="short"),
            pytest.param(with_position(math.nan), "message 61 of 61 on /odom, found a number", id="nan"),
            pytest.param(with_position(-math.inf), "message 61 of 61 on /odom, found a number", id="inf"),
            pytest.param(with_bytes(odometry_cdr(1.0)[:-40]), "message 61 of 61 on /odom, found", id="cut message"),
            pytest.param(with_bytes(b""), "message 61 of 61 on /odom, found other bytes", id="empty message"),
            pytest.param(with_bytes(odometry_cdr(1.0) + bytes(99)), "found other bytes", id="overlong message"),
            pytest.param(with_bytes(b"\x00\x07\x00\x00" + bytes(716)), "found other bytes", id="other encoding"),
            pytest.param(two_files, "found a.mcap, b.mcap", id="two files"),
            pytest.param(without_storage, "are missing", id="storage file gone"),
            pytest.param(compressed_messages_alone, "found compressed ones", id="compressed messages alone"),
            pytest.param(compressed_file_alone, "without their metadata.yaml", id="compressed file alone"),
            pytest.param(file_with(b"#ROSBAG V2.0\n", "drive.bag"), "a ROS 1 bag", id="ros 1"),
            pytest.param(file_with(b"#ROSBAG V2.0\n"), "a ROS 1 bag", id="ros 1 renamed"),
            pytest.param(folder_with(b"#ROSBAG V2.0\n", "drive.bag"), "a ROS 1 bag", id="ros 1 folder"),
            pytest.param(folder_with(b"hello", "readme.txt"), "found no .mcap or .db3 file", id="other folder"),
            pytest.param(file_with(b"hello", "odom.csv"), "found the ending .csv", id="other ending"),
            pytest.param(file_with(b"hello", "odom"), "found no ending", id="no ending"),
            pytest.param(file_with(b""), "found an empty file", id="empty mcap"),
            pytest.param(file_with(b"", "drive.db3"), "found an empty file", id="empty sqlite"),
            pytest.param(file_with(b"garbage" * 400), "found a damaged one", id="garbage mcap"),
            pytest.param(file_with(b"garbage" * 400, "drive.db3"), "found a damaged one", id="garbage sqlite"),
            pytest.param(folder_with(b"", "metadata.yaml"), "found a damaged one", id="empty metadata"),
            pytest.param(folder_with(b"a: [1", "metadata.yaml"), "found a damaged one", id="broken metadata"),
            pytest.param(folder_with(b"\xff\xfe\x00", "metadata.yaml"), "found a damaged one", id="binary metadata"),
        ],
    )
    def test_with_one_clear_line(self, tmp_path: Path, make: Callable[[Path], Path], found: str) -> None:
        """Every unusable recording ends in one line that names the path, what was found, and a remedy."""
        assert found in refused(make(tmp_path / "bag"))

    @BOTH
    @pytest.mark.parametrize("share", [0.01, 0.1, 0.35, 0.5, 0.8, 0.95, 0.999])
    def test_truncated(self, tmp_path: Path, plugin: StoragePlugin, share: float) -> None:
        """A file that was cut off anywhere is damaged, with its folder or alone."""
        path = write_bag(tmp_path / "bag", {"/odom": drive(200)}, plugin=plugin)
        file = next(p for p in path.iterdir() if p.suffix != ".yaml")
        os.truncate(file, int(file.stat().st_size * share))
        assert "found a damaged one" in refused(path)
        assert "found a damaged one" in refused(file)

    @pytest.mark.parametrize("name", ["turtlebot3_path/path.mcap", "neato_square/drive_square_0.db3"])
    @pytest.mark.parametrize("share", [0.2, 0.7, 0.99])
    def test_truncated_real(self, tmp_path: Path, name: str, share: float) -> None:
        """Real recordings cut off are damaged too."""
        source = others(name)
        data = source.read_bytes()
        (tmp_path / source.name).write_bytes(data[: int(len(data) * share)])
        assert "found a damaged one" in refused(tmp_path / source.name)

    @BOTH
    @given(rng=st.randoms(use_true_random=False), flips=st.sampled_from((1, 5, 50, 500)))
    def test_flipped_bytes_never_escape(self, plugin: StoragePlugin, rng: random.Random, flips: int) -> None:
        """Whatever bytes are overwritten, reading ends in messages or in a RecordingError."""
        data = bytearray(whole(plugin))
        for _ in range(flips):
            data[rng.randrange(len(data))] = rng.randrange(256)
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / ("drive.mcap" if plugin is StoragePlugin.MCAP else "drive.db3")
            file.write_bytes(data)
            with contextlib.suppress(RecordingError):
                assert all(a.t_ns < b.t_ns for a, b in pairwise(read_odometry(file).messages))

    @pytest.mark.parametrize("closed", ["", "metadata.yaml", "bag.mcap"])
    def test_without_permission(self, public_folder: Path, closed: str) -> None:
        """A folder or file that may not be read says so."""
        path = write_bag(public_folder / "bag", {"/odom": drive()})
        (path / closed).chmod(0o000)
        with as_nobody():
            message = refused(path)
        (path / closed).chmod(0o755)
        assert f"found no permission for {closed or path.name}" in message


def steady(count: int, period_ns: int) -> Recording:
    return Recording("/odom", TYPE, tuple(TimedMessage(n * period_ns, b"", {"n": n}) for n in range(count)))


class TestWindow:
    @given(
        count=st.integers(2, 80),
        period_ns=st.integers(1, 10**9),
        duration_ns=st.integers(0, 10**11),
        seed=st.integers(),
    )
    def test_is_a_part_long_enough(self, count: int, period_ns: int, duration_ns: int, seed: int) -> None:
        """A window is a run of neighbours from time 0 on, no shorter than asked unless the recording is."""
        odometry = steady(count, period_ns)
        part = window(odometry, duration_ns=duration_ns, seed=seed)
        assert part[0].t_ns == 0
        assert part[-1].t_ns >= min(duration_ns, odometry.messages[-1].t_ns)
        assert part[-1].t_ns < duration_ns + period_ns or part[-1].t_ns == 0
        numbers = [m.value["n"] for m in part]
        assert numbers == list(range(numbers[0], numbers[0] + len(part)))
        assert part == window(odometry, duration_ns=duration_ns, seed=seed)

    def test_starts_are_spread_by_the_seed(self) -> None:
        """Seeds reach all of the recording, and no start is much likelier than another."""
        odometry = steady(100, NS_PER_S)
        starts = [window(odometry, duration_ns=89 * NS_PER_S, seed=s)[0].value["n"] for s in range(2200)]
        counts = [starts.count(n) for n in range(11)]
        assert sum(counts) == 2200
        assert min(counts) > 140

    def test_a_short_recording_is_played_whole(self) -> None:
        """Asking for more than there is gives everything."""
        odometry = steady(30, NS_PER_S)
        assert window(odometry, duration_ns=60 * NS_PER_S, seed=5) == odometry.messages


def test_rosbags_is_imported_only_when_something_is_read() -> None:
    """Runs that play no odometry do not pay for the library."""
    code = "import sys, grader.runtime.recording.bag; sys.exit('rosbags' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", code], check=False).returncode == 0
