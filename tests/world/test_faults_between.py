"""Races in packages: found, shrunk to one fault, explained and repeated; and what faults do between programs."""

import re
from pathlib import Path
from typing import Any

import pytest

from grader.world.opening import Worlds

pytestmark = pytest.mark.ros

PACKAGE = """<?xml version="1.0"?>
<package format="3"><name>rover</name><version>0.0.0</version><description>A rover</description>
<maintainer email="a@b.c">a</maintainer><license>MIT</license><export><build_type>ament_python</build_type></export>
</package>
"""
SETUP = """from setuptools import setup
setup(name="rover", version="0.0.0", packages=["rover"], data_files=[
    ("share/ament_index/resource_index/packages", ["resource/rover"]), ("share/rover", ["package.xml"])],
    entry_points={{"console_scripts": [{scripts}]}})
"""
NODE = """import rclpy
from geometry_msgs.msg import Twist
from rcl_interfaces.srv import SetParameters
from rclpy.node import Node
from rclpy.parameter import Parameter
from std_msgs.msg import String
from std_srvs.srv import Trigger


class {title}(Node):
    def __init__(self):
        super().__init__("{name}")
{body}

def main():
    rclpy.init()
    rclpy.spin({title}())
"""
#: The base obeys the last command that it heard of the instant, whoever sent it.
TWO_PUBLISHERS = {
    "navigation": """
        self.out = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.1, self.send)

    def send(self):
        command = Twist()
        command.linear.x = 0.5
        self.out.publish(command)
""",
    "stopper": """
        self.out = self.create_publisher(Twist, "/cmd_vel", 10)
        self.create_timer(0.1, lambda: self.out.publish(Twist()))
""",
    "base": """
        self.speed = 0.0
        self.out = self.create_publisher(String, "/state", 10)
        self.create_subscription(Twist, "/cmd_vel", self.on_command, 10)
        self.create_timer(0.25, lambda: self.out.publish(String(data="moves" if self.speed else "rests")))

    def on_command(self, command):
        self.speed = command.linear.x
""",
}
#: The localizer asks for the map half a second after its start, and once.
ASKED_TOO_EARLY = {
    "map_server": """
        self.create_service(Trigger, "/map", self.answer)

    def answer(self, request, response):
        response.success = True
        return response
""",
    "localizer": """
        self.client = self.create_client(Trigger, "/map")
        self.out = self.create_publisher(String, "/state", 10)
        self.timer = self.create_timer(0.5, self.ask)

    def ask(self):
        self.timer.cancel()
        if self.client.service_is_ready():
            self.client.call_async(Trigger.Request()).add_done_callback(self.done)

    def done(self, future):
        self.out.publish(String(data="localized"))
""",
}
#: The mover reads its parameter once, two tenths of a second after the configurator has set it.
READ_TOO_EARLY = {
    "configurator": """
        self.client = self.create_client(SetParameters, "/mover/set_parameters")
        self.timer = self.create_timer(0.5, self.configure)

    def configure(self):
        self.timer.cancel()
        speed = Parameter("speed", value=0.5).to_parameter_msg()
        self.client.call_async(SetParameters.Request(parameters=[speed]))
""",
    "mover": """
        self.declare_parameter("speed", 0.1)
        self.out = self.create_publisher(String, "/state", 10)
        self.timer = self.create_timer(0.7, self.begin)

    def begin(self):
        self.timer.cancel()
        self.out.publish(String(data=str(self.get_parameter("speed").value)))
""",
}
BASE_RESTS = """
import pytest

@pytest.mark.ros(seeds=12, between={"/state": {"delay": (0.0, 0.01)}})
def test_the_stopper_wins(ros):
    for name in ("navigation", "stopper", "base"):
        ros.run(f"rover/{name}")
    ros.advance(2.3)
    assert {state.data for state in ros.messages("/state")} == {"rests"}
"""
LOCALIZED = """
import pytest

FAULTS = {"rover/map_server": {"pause": (0.6, 1.0)}, "rover/localizer": {"pause": (0.0, 0.1)}, "/state": {"lose": 0.0}}

@pytest.mark.ros(seeds=12, between=FAULTS)
def test_it_is_localized(ros):
    ros.run("rover/map_server")
    ros.run("rover/localizer")
    ros.advance(2.0)
    assert [state.data for state in ros.messages("/state")] == ["localized"]
"""


CONFIGURED = """
import pytest

FAULTS = {
    "rover/configurator": {"pause": (0.3, 1.0)}, "rover/mover": {"pause": (0.0, 0.1)}, "/state": {"delay": (0.0, 0.1)}
}

@pytest.mark.ros(seeds=12, between=FAULTS)
def test_it_has_the_speed_that_was_set(ros):
    ros.run("rover/configurator")
    ros.run("rover/mover")
    ros.advance(2.0)
    assert [state.data for state in ros.messages("/state")] == ["0.5"]
"""


def write(folder: Path, nodes: dict[str, str], test: str = "") -> Path:
    """Write a package of some nodes, with a test of it, and return the folder of the test."""
    package = folder / "src" / "rover"
    for name in ("rover", "resource", "test"):
        (package / name).mkdir(parents=True)
    scripts = ", ".join(f'"{name} = rover.{name}:main"' for name in nodes)
    texts = {"package.xml": PACKAGE, "setup.py": SETUP.format(scripts=scripts), "resource/rover": ""}
    texts |= {"rover/__init__.py": "", "test/test_rover.py": test}
    for name, body in nodes.items():
        texts[f"rover/{name}.py"] = NODE.format(title=name.title().replace("_", ""), name=name, body=body)
    for path, text in texts.items():
        (package / path).write_text(text, encoding="utf-8")
    return package / "test"


def told_of(result: pytest.RunResult) -> list[str]:
    """Return the lines below the first failure, without the files that are kept."""
    lines = result.outlines
    begin = next(number for number, line in enumerate(lines) if line.strip("-") == " ros ")
    return [line for line in lines[begin + 1 : begin + 5] if not line.startswith(("/", "="))]


@pytest.mark.long
@pytest.mark.parametrize(
    ("nodes", "test", "sentence", "needed"),
    [
        (
            TWO_PUBLISHERS,
            BASE_RESTS,
            r"race: at t = \d\.\d00 s /(stopper|navigation) published /cmd_vel to /base before /(stopper|navigation) "
            r"published /cmd_vel to /base; in the nearest run that passes it was the other way round",
            r"of \d+ draws it takes 1 to fail: the order at t = \d\.\d00 s \(\d+ runs\)",
        ),
        (
            ASKED_TOO_EARLY,
            LOCALIZED,
            r"race: /map_server was paused for [\d.]+ s, and at t = 0\.500 s /localizer looked for /map before "
            r"/map_server offered /map; in the nearest run that passes, /map_server offered /map first",
            r"of \d+ draws it takes 1 to fail: pause rover/map_server \(\d+ runs\)",
        ),
        (
            READ_TOO_EARLY,
            CONFIGURED,
            r"race: /configurator was paused for [\d.]+ s, and at t = 0\.700 s /mover published /state before "
            r"/configurator called /mover/set_parameters; in the nearest run that passes it was the other way round",
            r"of \d+ draws it takes 1 to fail: pause rover/configurator \(\d+ runs\)",
        ),
    ],
    ids=[
        "two publishers whose order matters",
        "a service asked before it is there",
        "a parameter read before it is set",
    ],
)
def test_a_race_is_found_shrunk_explained_and_repeated(
    pytester: pytest.Pytester, nodes: dict[str, str], test: str, sentence: str, needed: str
) -> None:
    """To one fault, in one sentence that names both nodes; and the seed that failed is tried first the next time."""
    folder = write(pytester.path, nodes, test)
    run = ("-p", "grader.pytest_plugin", "-x", str(folder))
    first = pytester.runpytest_subprocess(*run)
    lines = told_of(first)
    assert re.fullmatch(sentence, lines[0]), lines
    assert re.fullmatch(needed, lines[1]), lines
    seed = int(lines[2].rpartition(" ")[2])
    assert lines[2] == f"seed {seed}: repeat it with --ros-seed {seed}"
    again = pytester.runpytest_subprocess(*run)
    again.assert_outcomes(failed=1)
    assert told_of(again)[:3] == lines[:3]
    plain = pytester.runpytest_subprocess(*run, "--ros-seed", str(seed), "--ros-no-shrink")
    plain.assert_outcomes(failed=1)
    assert told_of(plain) == lines[2:3]


CAMERA = """
        self.count = 0
        self.out = self.create_publisher(String, "/seen", 10)
        self.create_timer(0.1, self.send)

    def send(self):
        self.count += 1
        self.out.publish(String(data=str(self.count)))
"""
TRACKER = """
        self.out = self.create_publisher(String, "/tracked", 10)
        self.create_subscription(String, "/seen", self.out.publish, 10)
"""


def tracked(ros_session: Worlds, folder: Path, between: dict[str, Any], seed: int) -> list[tuple[float, str]]:
    """Return what a tracker publishes in two seconds of what a camera sends ten times a second."""
    with ros_session.open(folder, seed=seed, between=between) as ros:
        ros.run("rover/camera")
        ros.run("rover/tracker")
        ros.advance(2.0)
        return [(one.t, one.message.data) for one in ros.received("/tracked")]


def test_faults_between_programs(ros_session: Worlds, tmp_path: Path) -> None:
    """Each does what it says, keeps the order of messages, and is the same with the same seed."""
    folder = write(tmp_path, {"camera": CAMERA, "tracker": TRACKER})
    every = [(pytest.approx(number / 10), str(number)) for number in range(1, 21)]
    assert tracked(ros_session, folder, {}, 1) == every
    late = tracked(ros_session, folder, {"/seen": {"delay": (0.25, 0.25)}}, 1)
    assert late == [(pytest.approx(number / 10 + 0.25), str(number)) for number in range(1, 18)]
    lost = tracked(ros_session, folder, {"/seen": {"lose": 0.5}}, 1)
    assert 4 < len(lost) < 16
    assert lost == [one for one in every if one[1] in [text for _, text in lost]]
    both = tracked(ros_session, folder, {"/seen": {"lose": 0.3, "delay": (0.0, 0.3)}}, 2)
    assert [int(text) for _, text in both] == sorted({int(text) for _, text in both})
    assert both == tracked(ros_session, folder, {"/seen": {"lose": 0.3, "delay": (0.0, 0.3)}}, 2)
    paused = tracked(ros_session, folder, {"rover/tracker": {"pause": (0.5, 0.5)}}, 0)
    heard = [int(text) for _, text in paused]
    assert heard == [*range(heard[0], 21)]  # before its subscription is there, it misses what is sent
    assert heard[0] > 4 or max(sum(t == at for t, _ in paused) for at, _ in paused) >= 4
    killed = tracked(ros_session, folder, {"rover/camera": {"kill": (0.35, 0.75)}}, 3)
    assert killed == every[: len(killed)]
    assert 3 <= len(killed) <= 7


#: Each process of pytest writes down which tests it has collected, in their order.
CONFTEST = """
from pathlib import Path

def pytest_collection_finish(session):
    process = getattr(session.config, "workerinput", {}).get("workerid", "alone")
    Path(f"{process}.txt").write_text(" ".join(item.name for item in session.items))
"""
FAILS_WITH_FIVE = """
import pytest

@pytest.mark.ros(seeds=7)
def test_it(ros):
    assert ros.seed != 5
"""


def test_seeds_are_kept_with_xdist(pytester: pytest.Pytester) -> None:
    """The one that failed is stored by the process that shares the tests out, and is the first one of each of them."""
    pytester.makeconftest(CONFTEST)
    pytester.makepyfile(FAILS_WITH_FIVE)
    run = ("-p", "grader.pytest_plugin", "-p", "xdist", "--ros-no-shrink")
    pytester.runpytest_subprocess(*run, "-n", "2").assert_outcomes(passed=6, failed=1)
    for options, processes in ((("-n", "2"), ("gw0", "gw1")), (("-n", "0"), ("alone",))):
        pytester.runpytest_subprocess(*run, *options).assert_outcomes(passed=6, failed=1)
        for process in processes:
            first, *others = (pytester.path / f"{process}.txt").read_text().split()
            assert first == "test_it[seed5]"
            assert others == [f"test_it[seed{seed}]" for seed in range(7) if seed != 5]
    pytester.makepyfile(FAILS_WITH_FIVE.replace("!= 5", ">= 0"))
    pytester.runpytest_subprocess(*run, "-n", "2").assert_outcomes(passed=7)
    pytester.runpytest_subprocess(*run, "-n", "2").assert_outcomes(passed=7)
    assert (pytester.path / "gw0.txt").read_text().split()[0] == "test_it[seed0]"
