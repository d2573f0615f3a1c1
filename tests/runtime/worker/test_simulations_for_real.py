"""Simulations beside real nodes: the same on every run, on either clock, and no fault of theirs becomes a mark."""

from __future__ import annotations

from pathlib import Path

import pytest
from decided import grade_until_decided, verdicts
from tiers import each

from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.model.chart import Chart, Playback
from grader.grading.model.exercise import Outcome

pytestmark = pytest.mark.ros

RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: follow, number: "1", title: Follow}
files: [follow.py]
simulations: [world.py]
limits: {messages: 500}
scenarios:
  - id: alone
    processes: [follow.py]
    observe: {duration: 3 s}
    stimuli:
      - simulation: {cart: {at: {between: [0.51, 0.99]}, noise: 0.01}}
criteria:
  - id: stays
    title: Comes back to the middle
    points: 1
    scenario: alone
    check: {stays_in_range: {topic: /place, field: data, low: -0.1, high: 0.1, after: 2500 ms}}
  - {id: lives, title: Lives, points: 1, scenario: alone, check: {no_fault: {}}}
"""
WORLD = """\
import random
from dataclasses import dataclass, field

from grader.runtime.simulation import Simulation


@dataclass
class Cart(Simulation):
    at: float = 0.0
    noise: float = 0.0
    speed: float = field(default=0.0, init=False)

    def publishes(self):
        return {"/place": "std_msgs/msg/Float64", "/echo": "std_msgs/msg/Float64"}

    def hears(self):
        return {"/speed": "std_msgs/msg/Float64"}

    def serves(self):
        return {"/where": "std_srvs/srv/Trigger"}

    def begin(self, draw):
        self.draw = draw

    def step(self, now):
        self.at += 0.05 * self.speed
        yield "/place", {"data": self.at + self.draw.gauss(0.0, self.noise)}

    def on_message(self, now, topic, message):
        self.speed = message["data"]
        message["data"] = 99.0
        return [("/echo", {"data": self.speed})]

    def on_request(self, now, service, request):
        return {"success": True, "message": f"at {self.at:.1f}"}


SIMULATIONS = {"cart": Cart}
"""
FOLLOW = """\
import rclpy
from rclpy.executors import ExternalShutdownException
from rclpy.node import Node
from std_msgs.msg import Float64
from std_srvs.srv import Trigger

rclpy.init()
node = Node("follow")
speeds = node.create_publisher(Float64, "/speed", 10)
client = node.create_client(Trigger, "/where")
node.create_subscription(Float64, "/place", lambda place: speeds.publish(Float64(data=-3.0 * place.data)), 10)
node.create_subscription(Float64, "/echo", lambda echo: node.get_logger().info(f"echo {echo.data:.3f}"), 10)


def ask():
    timer.cancel()
    answer = client.call_async(Trigger.Request())
    answer.add_done_callback(lambda done: node.get_logger().info(f"the cart is {done.result().message}"))


timer = node.create_timer(1.0, ask)
try:
    rclpy.spin(node)
except (KeyboardInterrupt, ExternalShutdownException):
    pass
"""
FLOOD = FOLLOW.replace("speeds.publish(Float64(data=-3.0 * place.data))", "flood(place)").replace(
    'node.create_subscription(Float64, "/place"',
    "def flood(place):\n    while True:\n        speeds.publish(Float64(data=1.0))\n\n\n"
    'node.create_subscription(Float64, "/place"',
    1,
)


def request(folder: Path, *, follow: str = FOLLOW, world: str = WORLD, clock: str = "virtual") -> GradeRequest:
    (folder / "student").mkdir(exist_ok=True)
    (folder / "student" / "follow.py").write_text(follow, encoding="utf-8")
    (folder / "world.py").write_text(world, encoding="utf-8")
    (folder / "follow.yaml").write_text(RUBRIC, encoding="utf-8")
    return GradeRequest(str(folder / "student"), rubrics=(folder / "follow.yaml",), clock=clock, seed=5)


def test_a_loop_is_closed_and_is_the_same_in_each_run(tmp_path: Path) -> None:
    """Noise, echoes at once and a service: to the last digit, whatever the machine does meanwhile."""
    found = []
    for _ in range(2):
        report = grade_once(request(tmp_path), lambda _: None, pictures=False)
        found.append({name: (v.outcome, v.reason, v.evidence) for name, v in verdicts(report).items()})
    assert found[0] == found[1]
    assert {outcome for outcome, _, _ in found[0].values()} == {Outcome.MET}, found[0]


TURTLE = """\
schema: grader/rubric/v1
exercise: {id: follow, number: "1", title: Turtle}
files: [follow.py]
scenarios:
  - id: alone
    processes: [follow.py]
    observe: {duration: 3 s}
    stimuli:
      - simulation: {turtle: {x: 2.0}}
criteria:
  - id: moved
    title: Was moved, and drove on
    points: 1
    scenario: alone
    check: {stays_in_range: {topic: /turtle1/pose, field: x, low: 9.5, high: 10.1, after: 2500 ms}}
"""
DRIVER = """\
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
from turtlesim.msg import Pose
from turtlesim.srv import TeleportAbsolute

rclpy.init()
node = Node("driver")
commands = node.create_publisher(Twist, "/turtle1/cmd_vel", 10)
client = node.create_client(TeleportAbsolute, "/turtle1/teleport_absolute")


def drive(pose):
    command = Twist()
    command.linear.x = 1.0 if 9.0 <= pose.x < 10.0 else 0.0
    commands.publish(command)


node.create_subscription(Pose, "/turtle1/pose", drive, 10)
client.wait_for_service()
client.call_async(TeleportAbsolute.Request(x=9.0, y=3.0))
rclpy.spin(node)
"""


@pytest.mark.long
def test_a_turtle_has_the_messages_of_turtlesim(tmp_path: Path) -> None:
    """They come with the grader, also for the student's node."""
    made = request(tmp_path, follow=DRIVER)
    (tmp_path / "follow.yaml").write_text(TURTLE, encoding="utf-8")
    found = verdicts(grade_once(made, lambda _: None, pictures=False))
    assert {name: v.outcome for name, v in found.items()} == {"moved": Outcome.MET}, found


@pytest.mark.long
def test_a_loop_is_closed_on_the_wall_clock(tmp_path: Path) -> None:
    """With other times, and to the same end."""
    report = grade_until_decided(request(tmp_path, clock="wall"))
    assert {v.outcome for v in verdicts(report).values()} == {Outcome.MET}, verdicts(report)


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(
    ("old", "new", "told"),
    each(
        [
            ("        self.speed = message", "        self.speed = 1 / 0 or message", "ZeroDivisionError"),
            ('"/echo", {"data": self.speed}', '"/echo", {"date": self.speed}', "expected a field of std_msgs/Float64"),
            ('"/echo", {"data": self.speed}', '"/ecko", {"data": self.speed}', "expected a topic that it publishes on"),
            ("        return [(", "        while True: pass\n        return [(", "the call took more than"),
        ],
        4,
    ),
)
def test_an_error_in_a_simulation_leaves_all_undecided(tmp_path: Path, old: str, new: str, told: str) -> None:
    """It arises only once the student's node has said something, so that reading the rubric could not find it."""
    report = grade_once(request(tmp_path, world=WORLD.replace(old, new)), lambda _: None, pictures=False)
    assert not report.final
    for verdict in verdicts(report).values():
        assert verdict.outcome is Outcome.UNDECIDED
        assert told in verdict.reason


@pytest.mark.long
def test_a_node_that_floods_a_simulation_is_at_fault_itself(tmp_path: Path) -> None:
    """The recording ends at its limit, and is judged."""
    report = grade_once(request(tmp_path, follow=FLOOD), lambda _: None, pictures=False)
    found = verdicts(report)["stays"]
    assert report.final
    assert found.outcome is Outcome.NOT_MET
    assert "messages" in found.reason


ROOM = """\
schema: grader/rubric/v1
exercise: {id: follow, number: "1", title: Follow}
files: [follow.py]
maps: [room.yaml]
scenarios:
  - id: alone
    processes: [follow.py]
    observe: {duration: 4 s}
    stimuli:
      - simulation: {robot_in_map: {map: room.yaml, x: {between: [-0.5, 0.5]}, dust: 0.1, dropped: 0.1}}
criteria:
  - id: hits
    title: Drives against the wall
    points: 1
    scenario: alone
    check: {stays_in_range: {topic: /truth/collisions, field: data, low: 1, after: 3 s}}
  - {id: lives, title: Lives, points: 1, scenario: alone, check: {no_fault: {}}}
"""
IN_ROOM = """\
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node
from sensor_msgs.msg import LaserScan

rclpy.init()
node = Node("follow")
commands = node.create_publisher(Twist, "/cmd_vel", 10)


def on_scan(scan):
    names = [name for name, _ in node.get_topic_names_and_types()]
    node.get_logger().info(f"{len(scan.ranges)} ranges, truth: {any('truth' in name for name in names)}")
    command = Twist()
    command.linear.x = 1.0
    commands.publish(command)


node.create_subscription(LaserScan, "/scan", on_scan, 10)
rclpy.spin(node)
"""


def test_a_robot_in_a_map_is_recorded_with_what_no_node_hears(tmp_path: Path) -> None:
    """The same twice, with its picture, which the page of the report shows with the same scale on both axes."""
    (tmp_path / "student").mkdir()
    (tmp_path / "student" / "follow.py").write_text(IN_ROOM, encoding="utf-8")
    (tmp_path / "follow.yaml").write_text(ROOM, encoding="utf-8")
    (tmp_path / "room.yaml").write_text("image: room.pgm\nresolution: 0.1\norigin: [-2, -2, 0]\n", encoding="utf-8")
    walls = "0 " * 40 + ("0 " + "1 " * 38 + "0 ") * 38 + "0 " * 40
    (tmp_path / "room.pgm").write_text(f"P2 40 40 1 {walls}", encoding="utf-8")
    asked = GradeRequest(str(tmp_path / "student"), rubrics=(tmp_path / "follow.yaml",), clock="virtual", seed=5)
    first, second = (grade_once(asked, lambda _: None, pictures=True) for _ in range(2))
    assert {id_: verdict.outcome for id_, verdict in verdicts(first).items()} == dict.fromkeys(
        ("hits", "lives"), Outcome.MET
    )
    assert first.exercises[0].verdicts == second.exercises[0].verdicts
    assert first.exercises[0].figures == second.exercises[0].figures
    picture = next(f for f in first.exercises[0].figures if isinstance(f, Chart) and f.title == "Seen from above")
    assert picture.square
    assert [row.name for row in picture.panels[0].series] == ["walls", "way of the robot", "start", "collisions"]
    run = next(f for f in first.exercises[0].figures if isinstance(f, Playback))
    logged = {text for row in run.timeline.panels[0].series for text in row.texts}
    assert logged == {"360 ranges, truth: False"}
