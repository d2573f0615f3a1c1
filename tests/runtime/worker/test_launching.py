"""Packages with launch files and executables, recorded with real nodes: right ones, wrong ones, hostile ones."""

from __future__ import annotations

import json
import re
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from decided import grade_until_decided
from places import TESTS
from tiers import LONG, NIGHTLY, but, each, more

from grader.grading.app.request import GradeRequest
from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport

pytestmark = pytest.mark.ros

HERE = TESTS / "packages"
WORKSPACE = HERE / "workspace"
LAUNCH, NODES = "src/robot/launch/robot.launch.py", "src/robot/robot/nodes.py"
Edit = tuple[str, str, str]


@pytest.fixture
def graded(tmp_path: Path) -> Callable[..., ExerciseReport]:
    """Grade the workspace with some of its text replaced."""

    def grade(*edits: Edit, rubric: str = "launched.yaml", clock: str = "virtual", **options: Any) -> ExerciseReport:
        folder = tmp_path / "ws"
        shutil.copytree(WORKSPACE, folder, dirs_exist_ok=True, ignore=shutil.ignore_patterns("__pycache__"))
        for name, old, new in edits:
            file = folder / name
            text = file.read_text()
            assert old in text
            file.write_text(text.replace(old, new))
        rubrics = (HERE / "rubrics" / rubric,)
        request = GradeRequest(str(folder), rubrics=rubrics, clock=clock, **{"time_budget_s": 300.0, **options})
        return grade_until_decided(request).exercises[0]

    return grade


def line_of(name: str, text: str) -> int:
    lines = (WORKSPACE / name).read_text().splitlines()
    return next(number for number, line in enumerate(lines, 1) if text in line)


def outcomes(report: ExerciseReport) -> dict[str, str]:
    return {verdict.id: verdict.outcome.value for verdict in report.verdicts}


def test_a_launch_file_starts_its_nodes(graded: Callable[..., ExerciseReport]) -> None:
    """Parameters of a file and inline, arguments, a remapping, a namespace, an included file, a condition."""
    report = graded()
    assert set(outcomes(report).values()) == {"met"}, report
    notes = "\n".join(report.notes)
    assert f"{NODES}: run as `ros2 run` does: the entry point robot.nodes:talk with --ros-args" in notes
    listener = "src/robot/launch/listener.launch.py"
    assert f"started by {listener}:{line_of(listener, 'Node(')}" in notes
    assert {start.process for start in report.starts} == {"robot.launch.py"}


CONDITION = 'condition=IfCondition(LaunchConfiguration("listen")),\n            )'
#: The listener is started by an event handler, and the talker, which ends after 1.9 s, is started again.
EVENTS: tuple[Edit, ...] = (
    (LAUNCH, "import DeclareLaunchArgument,", "import RegisterEventHandler, DeclareLaunchArgument,"),
    (LAUNCH, "from launch.conditions", "from launch.event_handlers import OnProcessStart\nfrom launch.conditions"),
    (LAUNCH, "GroupAction(\n", "RegisterEventHandler(OnProcessStart(on_start=[GroupAction(\n"),
    (LAUNCH, CONDITION, f"{CONDITION}], handle_once=True))"),
    (LAUNCH, 'output="screen",', 'output="screen", respawn=True, respawn_delay=0.1,'),
    (NODES, "self.count = 0", "self.count = 0\n        self.create_timer(1.9, rclpy.shutdown)"),
)


def may_end(folder: Path) -> str:
    """Write the rubric for nodes that may end by themselves, and return its path."""
    text = (HERE / "rubrics" / "launched.yaml").read_text()
    free = text.replace("observe:", "may_exit: [robot.launch.py]\n    observe:")
    # fewer participants than processes: one that is started again needs another
    free = free.replace("scenarios:", "limits: {participants: 1}\nscenarios:")
    # in real time, a node that starts after another one misses its first messages
    free = free.replace("word 3", "word [0-9]+")
    (folder / "free.yaml").write_text(free.replace("0.2 Hz", "0.6 Hz").replace("0.3 Hz", "1 Hz"))
    return str(folder / "free.yaml")


def test_nodes_are_started_again_and_by_event_handlers(graded: Callable[..., ExerciseReport], tmp_path: Path) -> None:
    """Under the name of the launch file, and with what it gives them."""
    report = graded(*EVENTS, rubric=may_end(tmp_path))
    assert set(outcomes(report).values()) == {"met"}, [
        v.reason for v in report.verdicts if v.outcome is not Outcome.MET
    ]
    assert len(report.starts) >= 2
    without = graded(*EVENTS, (LAUNCH, "respawn=True", "respawn=False"), rubric=may_end(tmp_path))
    assert outcomes(without)["rate"] == outcomes(without)["faster"] == "not_met"


@pytest.mark.long
@pytest.mark.parametrize("clock", ["auto", "wall"])
def test_other_clocks_have_event_handlers(graded: Callable[..., ExerciseReport], tmp_path: Path, clock: str) -> None:
    """A spot check, whose processes have nothing of the grader in them, and the wall clock."""
    rubric = Path(may_end(tmp_path))
    # on a busy machine, the listener may take two seconds to start
    rubric.write_text(rubric.read_text().replace("duration: 3 s", "duration: 8 s"))
    report = graded(*EVENTS[:4], rubric=str(rubric), clock=clock, spot_checks=float(clock == "auto"))
    assert set(outcomes(report).values()) == {"met"}, report
    assert report.clock.value == ("wall" if clock == "wall" else "virtual")


@pytest.mark.nightly
def test_the_wall_clock_starts_the_same(graded: Callable[..., ExerciseReport], tmp_path: Path) -> None:
    """The same command lines, in real time, where a busy machine delays some of the few messages."""
    text = (HERE / "rubrics" / "launched.yaml").read_text()
    own = text.replace("tolerance: 0.2 Hz", "tolerance: 0.5 Hz").replace("tolerance: 0.3 Hz", "tolerance: 1 Hz")
    assert own.count("tolerance: 0.5 Hz") == own.count("tolerance: 1 Hz") == 1
    (tmp_path / "wall.yaml").write_text(own)
    assert set(outcomes(graded(clock="wall", rubric=str(tmp_path / "wall.yaml"))).values()) == {"met"}


def test_a_wrong_launch_file_loses_what_is_wrong(graded: Callable[..., ExerciseReport]) -> None:
    """Here the namespace and the parameter file."""
    report = graded(
        (LAUNCH, 'PushRosNamespace("ears"),', ""), (LAUNCH, 'os.path.join(share, "config", "talker.yaml"), ', "")
    )
    expected = {"rate": "met", "prefix": "not_met", "heard": "not_met", "names": "met", "faster": "met"}
    assert outcomes(report) == expected


def test_an_executable_that_is_not_there_is_a_fault(graded: Callable[..., ExerciseReport]) -> None:
    """With the line of the node, and what the package has."""
    report = graded((LAUNCH, 'executable="talker"', 'executable="talk"'))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    (fault,) = report.faults
    assert (fault.file, fault.line) == (LAUNCH, line_of(LAUNCH, "        Node("))
    assert "executable 'talk' not found; its executables are talker, listener" in fault.text


@pytest.mark.long
def test_what_is_left_out_costs_no_points(graded: Callable[..., ExerciseReport]) -> None:
    """What is not met is undecided, because what was left out may be why; a viewer changes nothing."""
    node = 'Node(package="turtle_sim", executable="node"),'
    viewer = 'Node(package="rviz2", executable="rviz2"),'
    report = graded(
        (LAUNCH, "        Node(\n", f"        {viewer}\n        {node}\n        Node(\n"), (NODES, ".upper()", "")
    )
    assert set(outcomes(report).values()) == {"met"}
    line = line_of(LAUNCH, "        Node(") + 1
    left_out = f"{LAUNCH}:{line}: turtle_sim/node was not started: the submission has no package turtle_sim"
    assert left_out in report.notes
    assert any("rviz2/rviz2 was not started" in note for note in report.notes)
    report = graded((LAUNCH, 'name="speaker",', ""), (LAUNCH, "        Node(\n", f"        {node}\n        Node(\n"))
    verdict = next(verdict for verdict in report.verdicts if verdict.id == "names")
    assert verdict.outcome is Outcome.UNDECIDED
    assert "turtle_sim/node was not started" in verdict.reason


def with_command(command: str) -> tuple[Edit, ...]:
    """Return the edits after which the launch file runs a command, and a criterion is not met."""
    action = f"ExecuteProcess(cmd={command}, shell=True),"
    return (
        (LAUNCH, "from launch.actions import ", "from launch.actions import ExecuteProcess, "),
        (LAUNCH, 'name="speaker",', ""),
        (LAUNCH, "        Node(\n", f"        {action}\n        Node(\n"),
    )


@pytest.mark.long
@pytest.mark.parametrize(
    "command",
    but(
        ["['true']", "['rviz2', '-d', 'a.rviz']"],
        ["['true']", "['/bin/sleep', '5']", "['rviz2', '-d', 'a.rviz']", "['gz', 'sim']", "['ros2 topic echo /talk']"],
        NIGHTLY,
    ),
)
def test_a_command_that_takes_no_part_in_the_graph_excuses_nothing(
    graded: Callable[..., ExerciseReport], command: str
) -> None:
    """It is named, and a criterion that is not met stays so."""
    report = graded(*with_command(command))
    assert outcomes(report)["names"] == "not_met"
    assert any("the command " in note and "was left out" in note for note in report.notes)


@pytest.mark.parametrize(
    "command",
    each(
        ["['ros2', 'param', 'set', '/talker', 'rate', '4.0']", "['bash', '-c', 'true']", "['echo', 'a; ros2']"],
        3,
        NIGHTLY,
    ),
)
def test_a_command_that_may_take_part_leaves_a_criterion_undecided(
    graded: Callable[..., ExerciseReport], command: str
) -> None:
    """What it would do is not known."""
    assert outcomes(graded(*with_command(command)))["names"] == "undecided"


@pytest.mark.long
@pytest.mark.parametrize(
    ("command", "expected"),
    each(
        [
            ("['ros2', 'topic', 'pub', '/else', 'std_msgs/msg/String', '{data: x}']", "not_met"),
            ("['ros2', 'topic', 'pub', '-r', '4', '/talk', 'std_msgs/msg/String', '{data: x}']", "not_met"),
            ("['ros2', 'topic', 'pub', '/ears/heard', 'std_msgs/msg/String']", "undecided"),
            ("['ros2', 'bag', 'play', 'recording']", "undecided"),
        ],
        2,
        NIGHTLY,
    ),
)
def test_a_command_for_one_topic_explains_no_other(
    graded: Callable[..., ExerciseReport], command: str, expected: str
) -> None:
    """Here nobody publishes what was heard, and the rate of the talker is wrong."""
    edits = with_command(command)[::2]
    wrong = (LAUNCH, '"rate": LaunchConfiguration("rate")', '"rate": 2.0')
    report = graded(*edits, wrong, (NODES, '(String, "heard", 10)', '(String, "said", 10)'))
    assert outcomes(report)["rate"] == ("undecided" if "bag" in command else "not_met")
    assert outcomes(report)["heard"] == expected


BREAKS = "import sys\nsys.modules['_grader_host.launch.files'].DEEPEST = None\n"


@pytest.mark.long
@pytest.mark.parametrize("clock", ["virtual", *more(["wall"], NIGHTLY)])
def test_a_mistake_of_the_evaluator_costs_no_points(graded: Callable[..., ExerciseReport], clock: str) -> None:
    """Everything is undecided, with a line for a bug report, and there is no fault."""
    report = graded((LAUNCH, "import os\n", f"import os\n{BREAKS}"), clock=clock)
    # where nothing is included, nothing fails
    assert outcomes(report) == {**dict.fromkeys(outcomes(report), "undecided"), "faster": "met"}
    assert report.faults == ()
    said = "the grader's own code failed in the process of robot.launch.py: TypeError, launch/files.py line "
    for verdict in report.verdicts:
        if verdict.outcome is not Outcome.UNDECIDED:
            continue
        assert said in verdict.reason
        assert "please report this line" in verdict.reason


LACKING = {
    "from ament_index_python import has_resource\n    has_resource('packages', 'image_view')": "package image_view",
    "import launch.events\n    str(launch.events.matches_action(1))": "launch.events.matches_action",
    "os.popen('xacro a.urdf').read()": 'the command "xacro a.urdf"',
    "open(__file__, 'a').close()": "writing the file robot.launch.py",
}


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(("line", "said"), each(LACKING.items(), 3), ids=LACKING.values())
def test_what_ros_has_and_the_grader_lacks_costs_no_points(
    graded: Callable[..., ExerciseReport], line: str, said: str
) -> None:
    """It is undecided, with its name, however little is left of the launch file."""
    share = '    share = get_package_share_directory("robot")\n'
    report = graded((LAUNCH, share, f"    {line}\n{share}"), (LAUNCH, 'name="speaker",', ""))
    assert report.faults == ()
    assert outcomes(report)["names"] == "undecided"
    assert any(said in note for note in report.notes), report.notes


@pytest.mark.long
def test_what_ros_lacks_too_is_the_mistake_of_the_launch_file(graded: Callable[..., ExerciseReport]) -> None:
    """Although no node needs it."""
    share = '    share = get_package_share_directory("robot")\n'
    report = graded((LAUNCH, share, f"    from launch.actions import EmitEvnt\n{share}"))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    (fault,) = report.faults
    assert fault.text.startswith("ImportError: cannot import name 'EmitEvnt' from 'launch.actions'")


@pytest.mark.long
def test_a_launch_file_of_viewers_alone_has_no_fault(graded: Callable[..., ExerciseReport]) -> None:
    """It shows what others do, and lacks nodes of its own."""
    viewer = 'return LaunchDescription([Node(package="rviz2", executable="rviz2")])\n    share = ""\n'
    report = graded((LAUNCH, '    share = get_package_share_directory("robot")\n', f"    {viewer}"))
    assert report.faults == ()
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    assert any("rviz2/rviz2 was not started" in note for note in report.notes)


@pytest.mark.long
def test_a_misspelt_package_is_a_fault(graded: Callable[..., ExerciseReport]) -> None:
    """`ros2 launch` refuses it, although a program of that name is there."""
    report = graded((LAUNCH, 'package="robot"', 'package="robto"'))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    (fault,) = report.faults
    assert (fault.file, fault.line) == (LAUNCH, line_of(LAUNCH, "        Node("))
    assert fault.text == 'PackageNotFoundError: package "robto" not found; the submission has robot'


@pytest.mark.long
def test_a_program_that_cmake_builds_costs_no_points(graded: Callable[..., ExerciseReport], tmp_path: Path) -> None:
    """The Python nodes beside it start."""
    drive = tmp_path / "ws" / "src" / "drive_cpp"
    drive.mkdir(parents=True)
    (drive / "package.xml").write_text("<package><name>drive_cpp</name></package>")
    (drive / "CMakeLists.txt").write_text("add_executable(listener src/listener.cpp)\n")
    node = 'Node(package="drive_cpp", executable="listener"),'
    report = graded((LAUNCH, "        Node(\n", f"        {node}\n        Node(\n"))
    assert set(outcomes(report).values()) == {"met"}
    line = line_of(LAUNCH, "        Node(")
    said = f"{LAUNCH}:{line}: drive_cpp/listener was not started: it is not a Python program"
    assert said in report.notes


@pytest.mark.long
def test_any_name_that_ends_in_launch_py_is_a_launch_file(
    graded: Callable[..., ExerciseReport], tmp_path: Path
) -> None:
    """As for `ros2 launch`, also where it has the name of the package that it imports."""
    rubric = (HERE / "rubrics" / "launched.yaml").read_text().replace("robot.launch.py", "launch.py")
    (tmp_path / "own.yaml").write_text(rubric)
    shutil.copytree(WORKSPACE, tmp_path / "ws", ignore=shutil.ignore_patterns("__pycache__"))
    (tmp_path / "ws" / LAUNCH).rename((tmp_path / "ws" / LAUNCH).with_name("launch.py"))
    for name, text in {name: (tmp_path / "ws" / name).read_text() for name in ("src/robot/setup.py",)}.items():
        (tmp_path / "ws" / name).write_text(text.replace("robot.launch.py", "launch.py"))
    request = GradeRequest(str(tmp_path / "ws"), rubrics=(tmp_path / "own.yaml",), clock="virtual")
    assert set(outcomes(grade_until_decided(request).exercises[0]).values()) == {"met"}


HOSTILE = {
    "exits": ("import sys; sys.exit(0)", "SystemExit"),
    "exits_hard": ("import os; os._exit(0)", "ended while it was evaluated"),
    "raises": ("raise ValueError('no')", "ValueError: no"),
    "kills": ("import os, signal; os.kill(os.getpid(), signal.SIGKILL)", "ended while it was evaluated"),
    "forks": (
        "import os\n    for _ in range(5000):\n        try:\n            os.fork()\n        except OSError:\n"
        "            os._exit(3)",
        "ended while it was evaluated",
    ),
    "no_description": ("return None", "TypeError"),
    "no_node": ("return LaunchDescription([])", "describes no node"),
}


def row(name: str, values: tuple[str, str]) -> Any:
    """Return one harm: one is done by default, and three more with `--long`."""
    often = ("raises", "forks", "no_description")
    return pytest.param(*values, marks=[] if name == "exits_hard" else LONG if name in often else NIGHTLY)


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(("harm", "said"), [row(name, values) for name, values in HOSTILE.items()], ids=HOSTILE)
def test_a_launch_file_that_does_harm_is_a_fault(graded: Callable[..., ExerciseReport], harm: str, said: str) -> None:
    """It ends in its sandbox, and costs what it describes nothing of."""
    report = graded((LAUNCH, '    share = get_package_share_directory("robot")\n', f"    {harm}\n    share = ''\n"))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}, report
    assert any(said in fault.text for fault in report.faults), report.faults


@pytest.mark.long
def test_a_forged_description_starts_nothing_but_the_submission(graded: Callable[..., ExerciseReport]) -> None:
    """Whatever a launch file writes to its connection only names programs, and every field of it is checked."""
    forged = '{"kind": "launched", "nodes": [{"package": "", "executable": "../../../bin/sh", "line": []}, 5, null]}'
    harm = (
        f"import os\n    for n in range(3, 50):\n        try:\n            os.write(n, {forged!r}.encode() + b'\\n')\n"
    )
    harm += '        except OSError:\n            pass\n    print(\'{"kind": "exited"}\')'
    report = graded((LAUNCH, '    share = get_package_share_directory("robot")\n', f"    {harm}\n    share = ''\n"))
    assert set(outcomes(report).values()) <= {"not_met", "undecided"}
    assert not report.starts


OUTSIDE = [
    "/usr/lib/python3.11/antigravity.py",
    "../../../usr/lib/python3.11/this.py",
    "a/../../x.py",
    "/",
    "..",
    "x" * 300,
]


@pytest.mark.parametrize("executable", each(OUTSIDE, len(OUTSIDE), NIGHTLY))
@pytest.mark.parametrize("package", ["robot", *more(["elsewhere"])])
def test_a_launch_file_starts_nothing_outside_of_the_submission(
    graded: Callable[..., ExerciseReport], package: str, executable: str
) -> None:
    """Neither by an absolute path nor by one that leads upwards; the worker does not fail either."""
    node = f"Node(package={package!r}, executable={executable!r}),"
    report = graded((LAUNCH, "        Node(\n", f"        {node}\n        Node(\n"))
    assert not any("antigravity" in start.file or "this.py" in start.file for start in report.starts)
    if package == "robot":
        assert set(outcomes(report).values()) <= {"not_met", "blocked"}
        assert "not found; its executables are talker, listener" in report.faults[0].text
    else:
        assert set(outcomes(report).values()) == {"met"}
        assert any("was not started: the submission has no package elsewhere" in note for note in report.notes)


FORGED = "NOTE OF THE INSTRUCTOR: this student has 30 of 30 points"
WORDS = [
    {"what": FORGED},
    {"code": FORGED, "name": FORGED, "text": FORGED},
    *({"code": code, "name": FORGED, "text": FORGED} for code in ("action", "command", "package", "substitution")),
]


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("words", each(WORDS, 5, NIGHTLY), ids=lambda words: words.get("code", "none"))
def test_a_launch_file_says_nothing_in_the_graders_voice(
    graded: Callable[..., ExerciseReport], words: dict[str, str]
) -> None:
    """What it names is shown in quotation marks, if at all."""
    forged = json.dumps({"kind": "launched", "nodes": [{"package": FORGED, "executable": FORGED}], "left_out": [words]})
    harm = (
        f"import os\n    for n in range(3, 50):\n        try:\n            os.write(n, {forged!r}.encode() + b'\\n')\n"
    )
    harm += "        except OSError:\n            pass\n    import time; time.sleep(30)"
    report = graded((LAUNCH, '    share = get_package_share_directory("robot")\n', f"    {harm}\n    share = ''\n"))
    texts = [*report.notes, *(v.reason for v in report.verdicts), *(fault.text for fault in report.faults)]
    assert any("was left out" in text for text in texts)
    for text in texts:
        assert FORGED not in re.sub(r'"[^"]*"', "", text), text


@pytest.mark.long
def test_the_evaluation_of_a_launch_file_is_part_of_the_time_budget(graded: Callable[..., ExerciseReport]) -> None:
    """A launch file that sleeps has used it up; one that takes its time leaves less of it."""
    sleep = (
        LAUNCH,
        '    share = get_package_share_directory("robot")\n',
        "    import time; time.sleep(50); share = ''\n",
    )
    report = graded(sleep, time_budget_s=3.0)
    assert set(outcomes(report).values()) <= {"not_met", "blocked", "undecided"}
    if "undecided" not in outcomes(report).values():  # the machine may be too busy to tell
        words = "stopped: the recordings of this submission took more than 3 s of real time"
        assert {fault.text for fault in report.faults} == {words}


@pytest.mark.long
def test_arguments_without_end_are_a_fault_of_the_launch_file(graded: Callable[..., ExerciseReport]) -> None:
    """No process could be started with them."""
    node = "Node(package='robot', executable='talker', arguments=['x' * 900] * 100),"
    report = graded((LAUNCH, "        Node(\n", f"        {node}\n        Node(\n"))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    assert report.faults[0].text == "stopped: its arguments and parameter files have more than 64 KiB"


@pytest.mark.nightly
def test_an_endless_launch_file_is_ended(graded: Callable[..., ExerciseReport]) -> None:
    """By its processor time."""
    report = graded((LAUNCH, '    share = get_package_share_directory("robot")\n', "    while True: pass\n"))
    assert set(outcomes(report).values()) <= {"not_met", "blocked"}
    assert "did not return within 10 s of processor time" in report.faults[0].text


@pytest.mark.long
def test_executables_are_found_by_their_names(graded: Callable[..., ExerciseReport]) -> None:
    """Two of one module, each by its own entry point."""
    assert set(outcomes(graded(rubric="installed.yaml")).values()) == {"met"}


@pytest.mark.long
def test_a_launch_file_of_the_rubric_starts_what_was_handed_in() -> None:
    """Two loose files, each by its name; what they log is told apart."""
    request = GradeRequest(str(HERE / "loose"), rubrics=(HERE / "rubrics" / "provided.yaml",), clock="virtual")
    report = grade_until_decided(request).exercises[0]
    assert outcomes(report) == {"rate": "met", "heard": "met", "frame": "met"}, report
    assert {start.process for start in report.starts} == {"talker.py", "hearer.py"}
