"""Submissions that are graded by tests: what earns and loses points, and what never becomes a mark."""

from __future__ import annotations

import json
import re
import subprocess
from collections.abc import Callable, Iterator
from pathlib import Path

import pytest
from decided import verdicts
from places import GRADE, ROOT

from grader.api import Outcome, Report, rejudge, report_to_json
from grader.grading.app.grade import grade_in
from grader.grading.app.keeping import EvidenceWriter
from grader.grading.app.request import GradeRequest
from grader.grading.reporting.formats import PageLayout, known
from grader.runtime.session import RecordingSession, open_session

pytestmark = pytest.mark.ros

NODES = Path(__file__).with_name("nodes")
RIGHT = (NODES / "obstacle_stop.py").read_text()
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: robot, number: "1", title: Robot}
files: [obstacle_stop.py, switch.py]
limits: {messages: 400, real_time: 20 s}
pytest: test_robot.py
"""
TESTS = '''
import pytest
from geometry_msgs.msg import Twist
from sensor_msgs.msg import LaserScan


@pytest.fixture
def robot(ros):
    ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=10)
    return ros.run("obstacle_stop.py", parameters={"distance": 0.5})


@pytest.mark.points(3, hint="give the timer its period in seconds")
def test_rate(ros, robot):
    """Publishes at 20 Hz."""
    ros.advance(5.0)
    rate = ros.rate("/cmd_vel")
    assert rate == pytest.approx(20, abs=0.1), f"found {rate:.1f} Hz, expected 20 Hz"


@pytest.mark.points(2)
@pytest.mark.parametrize("near", [0.1, 0.4])
def test_stops(ros, robot, near):
    """Stops before a wall."""
    ros.advance(1.0)
    assert ros.messages("/cmd_vel", Twist)[-1].linear.x == 0.2
    ros.publish("/scan", LaserScan(ranges=[near + ros.random.uniform(0.0, 0.05)] * 360), rate=10)
    ros.wait_until(lambda: ros.messages("/cmd_vel")[-1].linear.x == 0.0, timeout=1.0)
'''
Grade = Callable[..., Report]


@pytest.fixture(scope="module")
def session() -> Iterator[RecordingSession]:
    """What all submissions of these tests are recorded in, in the sandbox that grading uses."""
    with open_session("auto", workers=1) as session:
        yield session


@pytest.fixture
def grade(session: RecordingSession, tmp_path: Path) -> Grade:
    """Grade a program by tests."""

    def graded(
        program: str | None, tests: str = TESTS, *, evidence: Path | None = None, rubric: str = RUBRIC
    ) -> Report:
        course, submission = tmp_path / "course", tmp_path / "submission"
        course.mkdir(exist_ok=True)
        submission.mkdir(exist_ok=True)
        (course / "rubric.yaml").write_text(rubric)
        (course / "test_robot.py").write_text(tests)
        (submission / "notes.py").write_text("print(1)")
        (submission / "obstacle_stop.py").unlink(missing_ok=True)
        if program is not None:
            (submission / "obstacle_stop.py").write_text(program)
        request = GradeRequest(str(submission), rubrics=(course / "rubric.yaml",), seed=7)
        writer = EvidenceWriter([evidence] if evidence is not None else [], request)
        report = grade_in(session, request, lambda _: None, writer.remember, pictures=True)
        writer.write(report)
        return report

    return graded


def outcomes(report: Report) -> list[str]:
    """Return the outcomes in the order of the report."""
    return [verdict.outcome.value for verdict in report.exercises[0].verdicts]


def without_time(report: Report) -> str:
    """Return a report as text, without how long it took."""
    return json.dumps(report_to_json(report) | {"duration_s": 0})


def test_a_right_program_gets_all_points_twice(grade: Grade, tmp_path: Path) -> None:
    """Each test is a criterion, and the same file gets the same report and the same recordings again."""
    first, second = (grade(RIGHT, evidence=tmp_path / name) for name in ("first", "second"))
    assert [(v.id, v.title, v.score, v.max_score) for v in first.exercises[0].verdicts] == [
        ("test_rate", "Publishes at 20 Hz", 3, 3),
        ("test_stops_0_1", "Stops before a wall (0.1)", 2, 2),
        ("test_stops_0_4", "Stops before a wall (0.4)", 2, 2),
    ]
    assert without_time(first) == without_time(second)
    recordings = sorted((tmp_path / "first").rglob("*.mcap"))
    assert len(recordings) == 3
    for path in recordings:
        assert path.read_bytes() == (tmp_path / "second" / path.relative_to(tmp_path / "first")).read_bytes()


@pytest.mark.long
def test_a_failed_assertion_is_the_reason(grade: Grade) -> None:
    """A wrong program loses the points with the message of the assertion, and the hint of the test."""
    report = grade(RIGHT.replace("0.05", "0.1").replace("self.nearest > self.distance", "True"))
    rate, near, _ = verdicts(report).values()
    assert (rate.outcome, rate.score) == (Outcome.NOT_MET, 0)
    assert (rate.reason, rate.hint) == ("found 10.0 Hz, expected 20 Hz", "give the timer its period in seconds")
    assert near.reason.startswith("the condition did not hold within 1.0 s (t = 1.000 s to t = 2.000 s)")
    assert without_time(report) == without_time(
        grade(RIGHT.replace("0.05", "0.1").replace("self.nearest > self.distance", "True"))
    )


ON_THEIR_WAY = """
import pytest
from sensor_msgs.msg import LaserScan


def first_move(ros):
    ros.publish("/scan", LaserScan(ranges=[2.0] * 360), rate=10)
    ros.run("obstacle_stop.py", parameters={"distance": 0.5})
    ros.advance(2.0)
    return next((one.t for one in ros.received("/cmd_vel") if one.message.linear.x), None)


@pytest.mark.points(1)
@pytest.mark.ros(lose={"/scan": 1.0})
def test_lost(ros):
    assert first_move(ros) is None


@pytest.mark.points(1)
@pytest.mark.ros(delay={"/scan": (1.0, 1.0)})
def test_late(ros):
    assert 1.0 <= first_move(ros) < 1.2
"""


@pytest.mark.long
def test_messages_of_a_test_may_come_late_or_not_at_all(grade: Grade) -> None:
    """As its marker says, for programs in the sandbox as for one's own."""
    assert outcomes(grade(RIGHT, ON_THEIR_WAY)) == ["met", "met"]


@pytest.mark.nightly
def test_what_does_not_fit_is_the_hint(grade: Grade) -> None:
    """Where nobody hears the test, the hint names the topic, whatever the assertion says."""
    deaf = verdicts(grade(RIGHT.replace('"/scan"', '"/scn"')))["test_stops_0_1"]
    assert (deaf.reason, deaf.hint) == ("assert 0.0 == 0.2", "subscribe to /scan instead of /scn")
    silent = verdicts(grade(RIGHT.replace('"/cmd_vel"', '"/cmd"')))["test_stops_0_1"]
    assert silent.reason.startswith("/cmd_vel: ")
    assert "/cmd" in silent.hint
    other = verdicts(grade(RIGHT.replace("Twist", "TwistStamped").replace("command.linear", "command.twist.linear")))
    expected = "/cmd_vel: expected messages of type geometry_msgs/msg/Twist, found geometry_msgs/msg/TwistStamped"
    assert other["test_stops_0_1"].reason == expected


def test_an_exception_of_a_program_loses_the_points_once(grade: Grade) -> None:
    """A crash is the reason, with its line; other tests that end with it are blocked by the first."""
    report = grade(RIGHT.replace("min(scan.ranges)", "min(scan.rangs)"))
    first, *others = report.exercises[0].verdicts
    assert first.outcome is Outcome.NOT_MET
    assert "'LaserScan' object has no attribute 'rangs'" in first.reason
    assert first.location is not None
    assert first.location.file == "obstacle_stop.py"
    assert [(other.outcome, other.blocked_by) for other in others] == [(Outcome.BLOCKED, "test_rate")] * 2


ENDS_BADLY = """
import pytest
from sensor_msgs.msg import LaserScan

@pytest.mark.points(1)
def test_commands(ros):
    ros.run("obstacle_stop.py")
    ros.publish("/scan", LaserScan(ranges=[2.0]), rate=10)
    ros.advance(2.0)
    assert ros.messages("/cmd_vel")[-1].linear.x == 0.2
"""


@pytest.mark.breadth(1, 2)
@pytest.mark.long
@pytest.mark.parametrize(
    ("program", "said"),
    [
        ("def main(:", "SyntaxError"),
        ("raise SystemExit(3)", "/cmd_vel"),
        pytest.param(
            "import rclpy\nrclpy.init()\nnode = rclpy.create_node('n')\nwhile True: pass\n",
            "processor time",
            marks=pytest.mark.long,
        ),
        (RIGHT.replace("0.05", "0.001"), "more than 400 messages"),
        (RIGHT.replace("min(scan.ranges)", "__import__('os').kill(__import__('os').getpid(), 9)"), "SIGKILL"),
    ],
)
def test_programs_that_end_badly_lose_points(grade: Grade, program: str, said: str) -> None:
    """Programs that crash, end, hang or flood lose the points, and are no mistake of the test."""
    report = grade(program, ENDS_BADLY)
    assert outcomes(report) == ["not_met"]
    assert said in report.exercises[0].verdicts[0].reason


@pytest.mark.long
def test_a_file_is_missing_only_where_a_test_runs_it(grade: Grade) -> None:
    """A submission without one of the files loses what runs it, and nothing else."""
    assert verdicts(grade(None))["test_rate"].reason == "obstacle_stop.py: not in the submission; found notes.py"
    both = TESTS + "\n\n@pytest.mark.points(1)\ndef test_switch(ros):\n    ros.run('switch.py')\n"
    report = grade(RIGHT, both)
    assert outcomes(report) == ["met", "met", "met", "not_met"]
    assert verdicts(report)["test_switch"].reason == "switch.py: not in the submission; found notes.py"


HOSTILE = "<script>alert(1)</script>\x1b[31m\r\n::error::x\n| a | `b` | ](javascript:x) \u202e =HYPERLINK(1)"
ECHO = f"""
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("echo")
text = node.create_publisher(String, "/text", 10)
node.create_timer(0.1, lambda: text.publish(String(data={HOSTILE!r})))
rclpy.spin(node)
"""
REPEATS = """
import pytest

@pytest.mark.points(1)
def test_text(ros):
    ros.run("obstacle_stop.py")
    ros.advance(1.0)
    assert ros.messages("/text")[-1].data == "hello", ros.messages("/text")[-1].data
"""


def test_text_of_a_student_in_a_message_is_harmless(grade: Grade) -> None:
    """An assertion may repeat what a program has sent: no output lets it act."""
    report = grade(ECHO, REPEATS)
    assert outcomes(report) == ["not_met"]
    assert "alert(1)" in verdicts(report)["test_text"].reason
    for name in ("text", "html", "json", "junit", "markdown"):
        shown = known(name)(report, PageLayout(80, colour=False, verbose=True))
        assert "\x1b" not in shown
        assert "\u202e" not in shown
        assert "<script>alert(1)" not in shown or name in ("text", "json")
        assert not any(line.startswith("::error::") for line in shown.splitlines())


SPY = """
import os, sys
import rclpy
from std_msgs.msg import String
rclpy.init()
node = rclpy.create_node("spy")
found = []
for folder in ("/tmp", os.environ.get("TMPDIR", "/tmp"), os.getcwd(), "/proc/1/cwd", f"/proc/{os.getppid()}/cwd"):
    for root, folders, files in os.walk(folder):
        found += [os.path.join(root, name) for name in files if name == "test_robot.py" or "rubric-tests" in root]
found += [name for name in os.environ if "GRADER" in name]
text = node.create_publisher(String, "/text", 10)
node.create_timer(0.1, lambda: text.publish(String(data=repr(found))))
rclpy.spin(node)
"""
LOOKS = REPEATS.replace('"hello"', '"[]"')


@pytest.mark.long
def test_a_program_does_not_see_the_tests(grade: Grade) -> None:
    """The programs run in the sandbox: neither the file of tests nor the process of pytest is within their reach."""
    assert verdicts(grade(SPY, LOOKS))["test_text"].outcome is Outcome.MET


MISTAKES = """
from pathlib import Path

import pytest
from geometry_msgs.msg import Twist


@pytest.fixture
def data():
    assert Path("data.json").exists()


@pytest.mark.points(1)
def test_wrong_value(ros):
    Twist(check_fields=True).linear = 3


@pytest.mark.points(1)
def test_typo(ros):
    ros.advanc(1.0)


@pytest.mark.points(1)
def test_fixture(ros, data):
    pass


@pytest.mark.points(1)
def test_unknown_fixture(ros, datta):
    pass


@pytest.mark.points(1)
def test_unknown_program(ros):
    ros.run("obstacle_stpo.py")


@pytest.mark.points(1)
def test_ends_pytest(ros):
    ros.run("obstacle_stop.py")
    __import__("os")._exit(0)


@pytest.mark.points(1)
def test_skips(ros):
    pytest.skip("not today")


@pytest.mark.points(1)
def test_other_world():
    from grader.api import open_world
    with open_world() as ros:
        ros.run("obstacle_stop.py")


@pytest.mark.points(1)
@pytest.mark.ros(order="random")
def test_option(ros):
    pass


@pytest.mark.points(1)
def test_imports_the_program(ros):
    import obstacle_stop


@pytest.mark.points(1)
def test_field(ros):
    ros.run("obstacle_stop.py")
    ros.advance(1.0)
    assert ros.messages("/cmd_vel")[-1].linaer.x == 0.0


@pytest.mark.points(1)
def test_keeps(ros):
    ros.keep("run")


@pytest.mark.points(1)
def test_compares(ros):
    ros.record("speed.jsonl")


@pytest.mark.points(1)
def test_right(ros):
    ros.run("obstacle_stop.py")
"""
SAID = {
    "test_wrong_value": "test_robot.py:15: AssertionError: The 'linear' field must be a sub message",
    "test_typo": "test_robot.py:20: AttributeError: 'World' object has no attribute 'advanc'",
    "test_fixture": "test_robot.py:10: in a fixture (setup): AssertionError",
    "test_unknown_fixture": "in a fixture (setup): FixtureLookupError",
    "test_unknown_program": "test_robot.py:35: SubmissionError: obstacle_stpo.py: expected a program of the rubric, "
    "found none; did you mean obstacle_stop.py?",
    "test_ends_pytest": "the process of pytest ended before test_ends_pytest was done",
    "test_skips": "test_robot.py:46: the test was skipped, so that nothing is judged",
    "test_other_world": "a test of a rubric runs programs in no world of its own",
    "test_option": "@pytest.mark.ros in a rubric: expected seed, delay, lose by name, found order",
    "test_imports_the_program": "test_robot.py:64: ModuleNotFoundError: No module named 'obstacle_stop'",
    "test_keeps": "ValueError: keep: expected a test of your own programs: grade keeps what a rubric's tests record",
    "test_compares": "ValueError: record: expected a test of your own programs: a rubric has no recordings to compare",
    "test_field": "name the type that the messages have to be of, as in ros.messages(topic, Twist)",
}


@pytest.mark.long
def test_a_mistake_of_the_test_is_no_mark(grade: Grade) -> None:
    """What the author has to correct is undecided, names its place, and leaves the other tests alone."""
    report = grade(RIGHT, MISTAKES)
    found = verdicts(report)
    assert found.pop("test_right").outcome is Outcome.MET
    assert {id_: v.outcome for id_, v in found.items()} == dict.fromkeys(SAID, Outcome.UNDECIDED)
    for id_, said in SAID.items():
        assert said in found[id_].reason, id_
        assert found[id_].reason.startswith("the rubric has a mistake: test_robot.py"), id_


ENDLESS = """
import time
import pytest

@pytest.mark.points(1)
def test_steps(ros):
    ros.run("obstacle_stop.py")
    while ros.rate("/cmd_vel") < 25:
        ros.advance(0.01)
        time.sleep(0.1)

@pytest.mark.points(1)
def test_right(ros):
    ros.run("obstacle_stop.py")
"""


@pytest.mark.long
def test_an_endless_test_is_no_mark(grade: Grade) -> None:
    """A test that does not end is undecided, and those after it are run."""
    report = grade(RIGHT, ENDLESS, rubric=RUBRIC.replace("20 s", "10 s"))
    steps, right = report.exercises[0].verdicts
    assert steps.outcome is Outcome.UNDECIDED
    assert "test_robot.py: test_steps: the test did not end within" in steps.reason
    assert right.outcome is Outcome.MET


@pytest.mark.long
def test_a_file_that_cannot_be_imported_is_no_mark(grade: Grade) -> None:
    """A mistake outside of the tests leaves all of them undecided, with its line."""
    report = grade(RIGHT, "import nothing_at_all\n" + TESTS)
    assert outcomes(report) == ["undecided"] * 3
    expected = "the rubric has a mistake: test_robot.py:1: ModuleNotFoundError: No module named 'nothing_at_all'"
    assert verdicts(report)["test_rate"].reason == expected


@pytest.mark.long
def test_a_recording_keeps_the_verdict(grade: Grade, tmp_path: Path) -> None:
    """Evidence holds what the tests have found; judging again keeps it, and says that nothing was judged."""
    evidence = tmp_path / "evidence"
    report = grade(RIGHT.replace("0.05", "0.1"), evidence=evidence)
    again = rejudge(evidence, rubrics=[tmp_path / "course/rubric.yaml"])
    assert verdicts(again) == verdicts(report)
    assert outcomes(again) == ["not_met", "met", "met"]
    assert again.notes[-1] == (
        "3 criteria are tests in test_robot.py, which cannot be judged again from a recording: the outcome is that of "
        "the recorded run; to run the tests again, use grade"
    )
    (tmp_path / "course/test_robot.py").write_text(TESTS.replace("20, abs", "10, abs"))
    changed = rejudge(evidence, rubrics=[tmp_path / "course/rubric.yaml"])
    assert outcomes(changed) == ["undecided"] * 3
    assert (
        "has changed the scenario test_rate since it was recorded; grade again"
        in changed.exercises[0].verdicts[0].reason
    )


PAGE = ROOT / "docs/how-to/tests-as-criteria.md"


@pytest.mark.long
def test_the_page_about_tests_shows_what_works(grade: Grade) -> None:
    """The rubric and the tests of the how-to grade the program of the tutorial."""
    rubric, tests = re.findall(r"^```(?:yaml|python)\n(.*?)^```", PAGE.read_text(), re.MULTILINE | re.DOTALL)
    own = rubric.replace("test_wall.py", "test_robot.py")
    right = grade(RIGHT, tests, rubric=own)
    assert [(v.id, v.score) for v in right.exercises[0].verdicts] == [
        ("test_rate", 4),
        ("test_stops_0_5", 3),
        ("test_stops_1_5", 3),
    ]
    wrong = grade(RIGHT.replace("self.nearest > self.distance", "False"), tests, rubric=own)
    assert verdicts(wrong)["test_stops_0_5"].reason == "the robot stands although nothing is near"


@pytest.mark.long
def test_a_class_is_graded_by_tests(tmp_path: Path) -> None:
    """`grade batch` runs the tests on every submission."""
    (tmp_path / "rubric.yaml").write_text(RUBRIC)
    (tmp_path / "test_robot.py").write_text(TESTS)
    for name, program in (("ada", RIGHT), ("bob", RIGHT.replace("0.05", "0.1"))):
        (tmp_path / "class" / name).mkdir(parents=True)
        (tmp_path / "class" / name / "obstacle_stop.py").write_text(program)
    command = ["grade", "batch", "class", "--rubric", "rubric.yaml", "-o", "results"]
    command[0] = GRADE
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode in (0, 1), done.stdout + done.stderr
    results = json.loads((tmp_path / "results/batch.json").read_text())["students"]
    assert [one["score"] for one in results] == [7, 4]


DRIVE = """
import rclpy
from geometry_msgs.msg import Twist
from rclpy.node import Node

rclpy.init()
node = Node("drive")
commands = node.create_publisher(Twist, "/cmd_vel", 10)
go = Twist()
go.linear.x = 0.5
node.create_timer(0.1, lambda: commands.publish(go))
rclpy.spin(node)
"""
WORLD = """\
from dataclasses import dataclass

from grader.api import DifferentialDrive


@dataclass
class Track(DifferentialDrive):
    wall: float = 2.0
    breaks: float = 99.0

    def records(self):
        return {"/left": "std_msgs/msg/Float64"}

    def step(self, now):
        yield from super().step(now)
        if now.t_s > self.breaks:
            yield "/left", {"dat": 1 / 1}
        yield "/left", {"data": self.wall - self.x}

    def place(self, x, y):
        self.x, self.y = min(x, self.wall), y


SIMULATIONS = {"track": Track}
"""
ON_TRACK = """
import pytest


@pytest.mark.points(1)
def test_drives(ros):
    track = ros.simulate("track", wall=1.5)
    ros.run("obstacle_stop.py")
    ros.advance(6.0)
    assert track.x == 1.5


@pytest.mark.points(1)
def test_keeps_clear(ros):
    robot = ros.simulate("robot_in_map", map="room.yaml")
    ros.run("obstacle_stop.py")
    ros.advance(6.0)
    assert not robot.clearance(robot.x, robot.y) < 0.3, "it drives into the wall"
"""


@pytest.mark.breadth(2, 4)
@pytest.mark.parametrize(
    ("tests", "told"),
    [
        (ON_TRACK, ""),
        (
            ON_TRACK.replace("wall=1.5", "breaks=1.0"),
            "track.py:14: the simulation `track` failed in step(): /left: expected a field of std_msgs/Float64 (data)",
        ),
        (ON_TRACK.replace("wall=1.5", "walls=1.5"), "test_robot.py:7: ValueError: simulate: track: "),
        (
            ON_TRACK.replace('"track"', '"trak"'),
            "test_robot.py:7: ValueError: simulate: expected one of differential_drive, robot_in_map, turtle, track,",
        ),
    ],
    ids=["right", "breaks", "parameter", "name"],
)
def test_a_test_lets_the_simulations_of_its_rubric_take_part(
    grade: Grade, tmp_path: Path, tests: str, told: str
) -> None:
    """By their names, with the maps of the rubric; a mistake in one is its author's, with file and line."""
    course = tmp_path / "course"
    course.mkdir()
    (course / "track.py").write_text(WORLD)
    (course / "room.yaml").write_text("image: room.pgm\nresolution: 0.1\norigin: [-2, -2, 0]\n")
    (course / "room.pgm").write_text("P2 40 40 1\n" + "1 " * 39 + "0 " + ("0 " + "1 " * 38 + "0 ") * 39)
    text = RUBRIC.replace("400", "20000") + "simulations: [track.py]\nmaps: [room.yaml]\n"
    report = grade(DRIVE, tests, rubric=text)
    drives, clear = verdicts(report).values()
    assert (clear.outcome, clear.reason) == (Outcome.NOT_MET, "it drives into the wall")
    said = f"{drives.reason} {' '.join(report.exercises[0].notes)}"
    assert drives.outcome is (Outcome.UNDECIDED if told else Outcome.MET), said
    assert told in said
