"""What `grade observe` and `grade rubric new` give to programs, read as strictly as a rubric: messages, simulations."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
from click.testing import CliRunner, Result

from grader.cli import main
from grader.grading.app.inputs import messages, read_launch_arguments, read_sent, read_simulations, simulated
from grader.runtime.model.errors import GraderError
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.simulation import Simulated

WORLD = """\
from dataclasses import dataclass

from grader.runtime.simulation import DifferentialDrive


@dataclass
class Hall(DifferentialDrive):
    \"\"\"A robot that measures how far the wall is.\"\"\"

    wall: float = 3.0

    def publishes(self):
        return {**super().publishes(), "/distance": "std_msgs/msg/Float32"}

    def step(self, now):
        yield from super().step(now)
        yield "/distance", {"data": self.wall - self.x}


SIMULATIONS = {"hall": Hall}
"""
NODE = """\
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
from std_msgs.msg import Float32


class Stop(Node):
    def __init__(self):
        super().__init__("stop")
        self.limit = 1.0
        self.publisher = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_subscription(Float32, "/distance", self.on_distance, 10)
        self.create_subscription(Float32, "/limit", self.on_limit, 10)

    def on_limit(self, msg):
        self.limit = msg.data

    def on_distance(self, msg):
        command = Twist()
        command.linear.x = 0.5 if msg.data > self.limit else 0.0
        self.publisher.publish(command)


rclpy.init()
rclpy.spin(Stop())
"""


@pytest.fixture
def desk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder with a simulation and a reference in a folder of its own."""
    (tmp_path / "sims").mkdir()
    (tmp_path / "sims" / "world.py").write_text(WORLD, encoding="utf-8")
    (tmp_path / "reference").mkdir()
    (tmp_path / "reference" / "stop.py").write_text(NODE, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return tmp_path


def command(*words: str) -> Result:
    return CliRunner().invoke(main.app, [*words])


def test_a_simulation_is_named_by_its_file_or_alone(desk: Path) -> None:
    """Its parameters are those of a rubric, also drawn ones."""
    (own,) = simulated(read_simulations(["sims/world.py:hall={wall: {between: [1.5, 2.5]}}"]))
    (built_in,) = simulated(read_simulations(["differential_drive"]))
    assert isinstance(own, Simulated)
    assert isinstance(built_in, Simulated)
    assert (own.name, own.path, own.content, set(own.parameters)) == ("hall", "world.py", WORLD.encode(), {"wall"})
    assert (built_in.name, built_in.path) == ("differential_drive", "")


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("sims/world.py", "expected FILE.py:NAME or a built-in one (differential_drive, robot_in_map or turtle)"),
        ("hall", "expected FILE.py:NAME or a built-in one"),
        ("sims/world.py:hall=[1]", "expected FILE.py:NAME or a built-in one"),
        ("sims/world.py:hall={", "expected FILE.py:NAME or a built-in one"),
        ("sims/none.py:hall", "expected a file with simulations, found no sims/none.py"),
        ("sims:hall", "expected a file with simulations, found no sims"),
        ("sims/world.py:hal", "or `hall` in `simulation`, found `hal`"),
        ("sims/world.py:hall={wal: 1}", "or `wall` in `hall`, found `wal`"),
        ("turtle={x: far}", "expected a number"),
        ("robot_in_map={map: room.yaml}", "robot_in_map: expected no `map`, because only a rubric brings maps"),
        ("sims/wrong.py:hall", "sims/wrong.py:1: expected a file that can be imported, found NameError"),
        ("sims/late.py:hall", "late.py:16: the simulation `hall` failed: ZeroDivisionError"),
    ],
)
def test_a_simulation_that_cannot_be_used_is_told_before_anything_runs(desk: Path, text: str, told: str) -> None:
    """With the option or the line, and exit code 2."""
    (desk / "sims" / "wrong.py").write_text("undefined\n", encoding="utf-8")
    (desk / "sims" / "late.py").write_text(WORLD.replace("yield from super().step(now)", "1 / 0"), encoding="utf-8")
    for words in (["observe"], ["rubric", "new"]):
        done = command(*words, "reference/stop.py", "--simulation", text)
        assert (done.exit_code, done.stdout) == (2, "")
        assert told in done.stderr
        assert "/tmp" not in done.stderr


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("/limt={data: 1.0}", "--send /limt: expected a topic that the programs subscribe to (/limit), found another"),
        ("/limit={dat: 1.0}", "--send: expected a field of std_msgs/msg/Float32 (`data`), found `dat`"),
        ("/limit={data: far}", "--send: expected a number for `data`, found `far`"),
    ],
)
def test_a_message_fits_what_the_programs_subscribe_to(text: str, told: str) -> None:
    """Topic, fields and values; all three are the author's to correct."""
    with pytest.raises(GraderError) as error:
        messages(read_sent([text]), {"/limit": "std_msgs/msg/Float32"}, 10.0)
    assert told in error.value.message


def test_launch_arguments_are_those_of_ros2_launch() -> None:
    """A value may have any characters, and be empty."""
    files = (Path("a.py"), Path("robot.launch.py"))
    assert read_launch_arguments(["a:=1", "b:=", "c:=x:=y"], files) == (("a", "1"), ("b", ""), ("c", "x:=y"))
    assert read_launch_arguments([], (Path("a.py"),)) == ()


@pytest.mark.parametrize(
    ("texts", "file", "told"),
    [
        (["a=1"], "robot.launch.py", "--launch-argument a=1: expected NAME:=VALUE, found something else"),
        ([":=1"], "robot.launch.py", "--launch-argument :=1: expected NAME:=VALUE, found something else"),
        (["a:=1", "a:=2"], "robot.launch.py", "--launch-argument a:=2: expected each argument once, found a again"),
        (["a:=1"], "a.py", "--launch-argument: expected a launch file among the programs, found none"),
    ],
)
def test_a_launch_argument_that_cannot_be_used_is_told(texts: list[str], file: str, told: str) -> None:
    """Before anything runs."""
    with pytest.raises(GraderError) as raised:
        read_launch_arguments(texts, (Path(file),))
    assert raised.value.message == told


def test_messages_are_spread_over_the_time_that_is_left() -> None:
    """Infinity is a number as in a rubric."""
    sent = read_sent(["/limit={data: .inf}", "/limit={data: 2}", "/limit={data: 3}"])
    (stream,) = messages(sent, {"/limit": "std_msgs/msg/Float32"}, 4.0)
    assert isinstance(stream, MessageStream)
    assert (stream.start_ns, stream.period_ns, len(stream.values)) == (1_000_000_000, 700_000_000, 3)


@pytest.mark.nightly
@pytest.mark.ros
def test_a_reference_is_observed_in_its_simulation(desk: Path) -> None:
    """The robot drives to the distance that a message sets, and the reference meets the rubric that is made of it."""
    given = ["--simulation", "sims/world.py:hall={wall: 2.0}", "--send", "/limit={data: 1.5}"]
    alone = command("observe", "reference/stop.py", "--json")
    driven = command("observe", "reference/stop.py", *given, "--json")
    pace = [json.loads(done.stdout)["topics"][0] for done in (alone, driven)]
    assert [(topic["name"], topic["messages"]) for topic in pace] == [("/cmd_vel", 0), ("/cmd_vel", 200)]
    assert pace[1]["ranges"]["linear.x"] == [0.0, 0.5]

    made = command("rubric", "new", "reference/stop.py", *given, "-o", "stop.yaml")
    assert made.exit_code == 0, made.stderr
    assert "simulations: [sims/world.py]" in Path("stop.yaml").read_text(encoding="utf-8")
    assert command("rubric", "check", "stop.yaml").exit_code == 0
    assert command("reference", "--rubric", "stop.yaml").exit_code == 0

    Path("rubrics").mkdir()
    elsewhere = command("rubric", "new", "reference/stop.py", *given, "-o", "rubrics/stop.yaml")
    assert "copy sims/world.py beside the rubric, which names it" in elsewhere.stderr
    assert "simulations: [world.py]" in Path("rubrics/stop.yaml").read_text(encoding="utf-8")
