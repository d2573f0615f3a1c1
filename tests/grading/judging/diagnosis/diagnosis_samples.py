"""What the tests of diagnosis share: right programs to spoil, recordings of spoilt ones, and the built-in rubrics."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any

from places import ROOT
from tables import read_table
from tracing import (
    FLOAT32,
    ODOMETRY,
    TRIGGER,
    TWIST,
    Recording,
    driving,
    held_at,
    position_logs,
    scripted,
    twist,
    velocity,
)

from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import ExerciseReport, Verdict
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, Delivery, FaultKind, LogRecord

HERE = Path(__file__).parent
FLOAT64 = "std_msgs/msg/Float64"
STRING = "std_msgs/msg/String"
BATTERY = "/battery/get_status"
EXAMPLES = ROOT / "examples"
#: The rubrics whose programs may be spoilt: together they ask most checks.
RUBRICS = (*builtin_rubrics().values(), *(p.parent / f"{p.parent.name}.yaml" for p in EXAMPLES.glob("*/README.md")))
RIGHT = {path.stem: path.read_text(encoding="utf-8") for path in sorted((HERE / "right").glob("*.py.txt"))}


@cache
def rows(name: str) -> list[dict[str, Any]]:
    """The rows of a golden table."""
    return list(read_table(HERE / name))


def spoilt(file: str, changes: Sequence[Sequence[str]]) -> str:
    """A right program with some texts replaced; each of them must be there."""
    text = RIGHT[file]
    for old, new in changes:
        assert old in text, (file, old)
        text = text.replace(old, new)
    return text


def line_of(text: str, code: str) -> int:
    """The first line that holds this code."""
    return next(k for k, row in enumerate(text.splitlines(), 1) if code in row)


@cache
def exercises() -> dict[Path, Exercise]:
    """Return the exercises of `RUBRICS`."""
    return {path: read_rubric(path) for path in RUBRICS}


def rubric_of(file: str) -> Path:
    return next(path for path, exercise in exercises().items() if file in exercise.files)


def exercise_of(file: str) -> Exercise:
    return exercises()[rubric_of(file)]


def report(file: str, traces: Mapping[str, AssessedTrace], texts: Mapping[str, str] | None) -> ExerciseReport:
    """Judge the exercise of a file, with the sources or, for None, without."""
    exercise = exercise_of(file)
    return judge_exercise(exercise, traces, submission_to(exercise), texts)


def submission_to(exercise: Exercise) -> Submission:
    return Submission("s", "s", Path("s"), "sha256:1", {n: StudentFile(n, n) for n in exercise.files})


def lost(given: ExerciseReport) -> list[Verdict]:
    return [v for v in given.verdicts if "diagnosis" in v.evidence]


# --- recordings -----------------------------------------------------------------------------------------------------


def crashed(file: str, fault: Mapping[str, Any]) -> Recording:
    """A node that a fault ended at once."""
    rec = Recording(10.0, process=file)
    if "exit_code" in fault:
        return rec.exited(0.1, fault["exit_code"])
    frames = tuple(f"{file}:{frame}" for frame in fault["frames"])
    python = tuple(fault["python"]) if "python" in fault else None
    return rec.fault(0.1, FaultKind[fault["kind"]], fault["text"], fault["line"], frames=frames, python=python)


def paced(rate: float) -> Recording:
    return velocity(rate=rate)


def silent(stop_s: float = 60.0) -> Recording:
    rec = Recording(stop_s, process="velocity_publisher.py")
    return rec.endpoint("publisher", "/cmd_vel", TWIST, "/velocity_publisher")


def once(t_s: float = 0.0) -> Recording:
    return silent(t_s + 10).message(t_s, "/cmd_vel", twist(), TWIST)


def bursts(count: int, period: float) -> Recording:
    rec = silent(10.05)
    for k in range(int(10 / period)):
        for _ in range(count):
            rec.message(0.05 + k * period, "/cmd_vel", twist(), TWIST)
    return rec


def stopped(after_s: float = 5.0) -> Recording:
    rec = silent(10.05)
    for k in range(int(after_s * 20)):
        rec.message(0.05 + k / 20, "/cmd_vel", twist(), TWIST)
    return rec


def elsewhere(topic: str = "/cmd_vel", type_: str = TWIST) -> Recording:
    rec = Recording(10.05, process="velocity_publisher.py")
    rec.endpoint("publisher", topic, type_, "/velocity_publisher")
    for k in range(200):
        rec.message(0.05 + k / 20, topic, twist() if type_ == TWIST else {"data": "forward"}, type_)
    return rec


def moving(linear: Sequence[float] = (0.5, 0, 0), angular: Sequence[float] = (0, 0, 0.1)) -> Recording:
    return velocity(linear=linear, angular=angular)


def printing(text: str = "sent", stream: str = "stdout") -> Recording:
    return velocity().line(0.05, text, stream, process="velocity_publisher.py")


def hearing(topic: str = "/odom", type_: str = ODOMETRY, durability: str = "volatile", **policies: Any) -> Recording:
    """A node that subscribes and publishes nothing; `policies` are further ones of its subscription."""
    rec = driving()
    rec.items = [o for o in rec.items if not hasattr(o, "endpoints")]
    rec.ends = []
    return rec.endpoint("subscription", topic, type_, "/odom_subscriber", durability=durability, **policies)


_WRITTEN: dict[str, Callable[[float, float], str]] = {
    "right": lambda x, y: f"Position: x={x:.2f}, y={y:.2f}",
    "swapped": lambda x, y: f"Position: x={y:.2f}, y={x:.2f}",
    "unsigned": lambda x, y: f"Position: x={abs(x):.2f}, y={abs(y):.2f}",
    "height": lambda x, _: f"Position: x={x:.2f}, y=0.00",
    "zero": lambda *_: "Position: x=0.00, y=0.00",
    "only_x": lambda x, _: f"Position: x={x:.2f}",
    "centimetres": lambda x, y: f"Position: x={100 * x:.2f}, y={100 * y:.2f}",
    "text": lambda *_: "got it",
}


def logging(what: str = "right", period: float = 1.0, line: int = 0, printed: bool = False) -> Recording:
    """A node that logs while the robot drives; `line` is where."""
    times = [5.0 + k * period for k in range(1, int(16 / period))]
    if what == "old":  # shown two seconds after they were current
        late = position_logs(_WRITTEN["right"], [5.0 + k for k in range(12)])
        return _at(late, line, delay_s=2.5)
    rec = position_logs(_WRITTEN[what], times, printed=printed)
    return _at(rec, line)


def logging_first(line: int = 0) -> Recording:
    first: list[str] = []

    def write(x: float, y: float) -> str:
        first.append(f"Position: x={x:.3f}, y={y:.3f}")
        return first[0]

    return _at(position_logs(write, [5.0 + k for k in range(16)]), line)


def logging_once(line: int = 0) -> Recording:
    return _at(position_logs(_WRITTEN["right"], [6.0]), line)


def complaining(line: int = 0) -> Recording:
    """A node that takes silence for a failure."""
    rec = logging("right")
    for k in range(1, 5):
        rec.log(k, "no odometry", "ERROR", line=line)
    return rec


def _at(rec: Recording, line: int, delay_s: float = 0.0) -> Recording:
    logs = [o for o in rec.items if isinstance(o, LogRecord)]
    rec.items = [o for o in rec.items if not isinstance(o, LogRecord)]
    for log in logs:
        rec.log(log.t_ns / 1e9 + delay_s, log.text, line=line)
    return rec


def sensing(what: str = "drawn", period: float = 0.2, topic: str = "/temperature") -> Recording:
    """A sensor alone, without a fan."""
    rng = random.Random(5)
    values: dict[str, Callable[[int], float]] = {
        "drawn": lambda _: rng.uniform(20, 30),
        "wide": lambda _: rng.uniform(15, 35),
        "constant": lambda _: 26.0,
        "alternating": lambda k: 22.0 + 6 * (k % 2),
    }
    rec = Recording(period + 12, process="temperature_sensor.py")
    rec.endpoint("publisher", topic, FLOAT32, "/temperature_sensor")
    for k in range(int(12 / period)):
        rec.number(period * (k + 1), topic, values[what](k))
    return rec


def fanned(what: str = "", topic: str = "/fan_speed", durability: str = "volatile", type_: str = FLOAT32) -> Recording:
    """A sensor that receives fan speeds, and its logs of them."""
    rec = scripted((100.0, 0.0, 63.0, 17.0, 100.0), "/fan_speed", stop_s=12.2)
    rec.process = "temperature_sensor.py"
    rec.endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor")
    if topic:
        rec.endpoint("subscription", topic, type_, "/temperature_sensor", durability=durability)
    rng = random.Random(5)
    for k in range(60):
        rec.number(0.2 + 0.2 * k, "/temperature", rng.uniform(20, 30))
    for k in range(5 if what else 0):
        rec.log(0.6 + 2 * k, what)
    return rec


_RULES: dict[str, Callable[[float], float | None]] = {
    "right": lambda v: 100.0 if v > 25 else 0.0,
    "from_25": lambda v: 100.0 if v >= 25 else 0.0,
    "inverted": lambda v: 100.0 if v < 25 else 0.0,
    "from_26": lambda v: 100.0 if v > 26 else 0.0,
    "truncated": lambda v: 100.0 if int(v) > 25 else 0.0,
    "one": lambda v: 1.0 if v > 25 else 0.0,
    "half": lambda v: 100.0 if v > 25 else 50.0,
    "only_on": lambda v: 100.0 if v > 25 else None,
    "off": lambda _: 0.0,
}


def answering(rule: str = "right", topic: str = "/fan_speed", hears: str = "/temperature") -> Recording:
    """A controller alone."""
    rec = scripted()
    rec.endpoint("publisher", topic, FLOAT32, "/fan_controller")
    rec.endpoint("subscription", hears, FLOAT32, "/fan_controller")
    for delivery in [o for o in rec.items if isinstance(o, Delivery) and hears == "/temperature"]:
        answer = _RULES[rule](delivery.value["data"])
        if answer is not None:
            rec.number(delivery.t_ns / 1e9, topic, answer)
    return rec


def answering_text() -> Recording:
    """A controller that answers in words."""
    rec = mute()
    rec.endpoint("publisher", "/fan_speed", "std_msgs/msg/String", "/fan_controller")
    for k in range(80):
        rec.message(0.5 + 0.2 * k, "/fan_speed", {"data": "on"}, "std_msgs/msg/String")
    return rec


def answering_late() -> Recording:
    """A controller that answers every five seconds."""
    rec = mute()
    for t_s, answer in ((5.0, 100.0), (10.0, 0.0), (15.0, 0.0)):
        rec.number(t_s, "/fan_speed", answer)
    return rec


def answering_once() -> Recording:
    """A controller that answers the first temperature only."""
    return mute().number(0.5, "/fan_speed", 0.0)


def answering_behind(messages: int) -> Recording:
    """A controller whose answers are right for what came some messages before."""
    rec = mute()
    seen = [float(held_at(0.5 + 0.2 * k) or 0) for k in range(82)]
    for k in range(len(seen)):
        rec.number(0.5 + 0.2 * k, "/fan_speed", 100.0 if seen[max(0, k - messages)] > 25 else 0.0)
    return rec


def latching(until: float = 0.0) -> Recording:
    """A controller that switches off below a limit only."""
    rec, on = mute(), False
    for delivery in [o for o in rec.items if isinstance(o, Delivery)]:
        value = delivery.value["data"]
        on = value > 25 or (on and value >= until)
        rec.number(delivery.t_ns / 1e9, "/fan_speed", 100.0 if on else 0.0)
    return rec


def mute(hears: str = "/temperature") -> Recording:
    """A controller that subscribes and never answers."""
    rec = scripted()
    rec.endpoint("publisher", "/fan_speed", FLOAT32, "/fan_controller")
    return rec.endpoint("subscription", hears, FLOAT32, "/fan_controller")


def apart(reliability: str = "reliable", type_: str = FLOAT32, **policies: Any) -> Recording:
    """Both processes, of which the controller cannot hear the sensor; `policies` are those of its subscription."""
    rec = Recording(20.2, process="temperature_sensor.py")
    rec.endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor", 1, reliability)
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/temperature", type_, "/fan_controller", 2, **policies)
    rec.endpoint("publisher", "/fan_speed", FLOAT32, "/fan_controller", 2)
    rng = random.Random(5)
    for k in range(100):
        rec.number(0.2 + 0.2 * k, "/temperature", rng.uniform(20, 30))
    return rec


def cool() -> Recording:
    """Both processes, and it never gets warm."""
    rec = Recording(20.2, process="temperature_sensor.py")
    rec.endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/temperature", FLOAT32, "/fan_controller", 2)
    rec.endpoint("publisher", "/fan_speed", FLOAT32, "/fan_controller", 2)
    rng = random.Random(5)
    for k in range(100):
        rec.number(0.2 + 0.2 * k, "/temperature", rng.uniform(20, 25)).number(0.2 + 0.2 * k, "/fan_speed", 0.0)
    return rec


_SWINGS: dict[str, Callable[[int], float]] = {
    "right": lambda n: math.sin(0.1 * n),
    "zero": lambda _: 0.0,
    "from_one": lambda n: math.sin(0.1 * (n + 1)),
    "factor_outside": lambda n: math.sin(n) * 0.1,
    "undivided": lambda n: math.sin(n / 0.1),
    "small_step": lambda n: math.sin(0.01 * n),
    "no_step": math.sin,
    "raised": lambda n: math.sin(0.1 * n) + 1.0,
    "unsigned": lambda n: abs(math.sin(0.1 * n)),
    "one_decimal": lambda n: round(math.sin(0.1 * n), 1),
}
_EVERY_TENTH: dict[str, Callable[[int], bool]] = {
    "right": lambda n: n % 10 == 0,
    "first_ten": lambda n: n // 10 == 0,
    "first": lambda n: n == 0,
}


def swinging(what: str = "right", logs: str = "right") -> Recording:
    """A joint publisher that logs every tenth message, or others."""
    rec = Recording(12.1, process="simple_publisher.py")
    rec.endpoint("publisher", "/joint_commands", FLOAT64, "/joint_commander")
    for n in range(120):
        rec.number(0.1 + 0.1 * n, "/joint_commands", _SWINGS[what](n), FLOAT64)
        if _EVERY_TENTH[logs](n):
            rec.log(0.1 + 0.1 * n, f"sent {_SWINGS[what](n):.2f} rad")
    return rec


def still() -> Recording:
    """A joint publisher that publishes nothing."""
    rec = Recording(60.0, process="simple_publisher.py")
    return rec.endpoint("publisher", "/joint_commands", FLOAT64, "/joint_commander")


def greeting(period: float = 1.0) -> Recording:
    """A node that greets the world."""
    rec = Recording(13.0, process="greeter.py").endpoint("publisher", "/greeting", STRING, "/greeter")
    for k in range(1, int(13 / period)):
        rec.message(k * period, "/greeting", {"data": "Hello world!"}, STRING)
    return rec


def asking_once() -> Recording:
    """A client that waits, asks, and does nothing more."""
    rec = Recording(40.0, process="battery_service_client.py")
    rec.service("client", BATTERY, TRIGGER, "/mission").mark(7.0, "server_starts", BATTERY)
    for second in range(1, 7):
        rec.log(second, "waiting for the battery server ...")
    answer = {"success": True, "message": "Battery: 62.5% remaining"}
    return rec.request(7.0, BATTERY, 1, "student").response(7.05, BATTERY, 1, answer, "grader")


def unanswered(**policies: Any) -> Recording:
    """A client that waits for the server and never reaches it; `policies` are those of its QoS."""
    rec = Recording(40.0, process="battery_service_client.py")
    rec.service("client", BATTERY, TRIGGER, "/mission", **policies).mark(7.0, "server_starts", BATTERY)
    for second in range(1, 40):
        rec.log(second, "waiting for the battery server ...")
    return rec


def misnamed() -> Recording:
    """Both processes, of which the controller answers on another topic."""
    rec = Recording(20.2, process="temperature_sensor.py")
    rec.endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/temperature_sensor", 1)
    rec.endpoint("subscription", "/temperature", FLOAT32, "/fan_controller", 2)
    return rec.endpoint("publisher", "/fan", FLOAT32, "/fan_controller", 2).number(0.2, "/temperature", 21.0)


RECORDINGS: dict[str, tuple[str, Callable[..., Recording]]] = {
    "paced": ("alone", paced),
    "silent": ("alone", silent),
    "once": ("alone", once),
    "bursts": ("alone", bursts),
    "stopped": ("alone", stopped),
    "elsewhere": ("alone", elsewhere),
    "moving": ("alone", moving),
    "printing": ("alone", printing),
    "hearing": ("waiting_then_driving", hearing),
    "logging": ("waiting_then_driving", logging),
    "logging_first": ("waiting_then_driving", logging_first),
    "logging_once": ("waiting_then_driving", logging_once),
    "sensing": ("sensor_alone", sensing),
    "fanned": ("sensor_alone", fanned),
    "answering": ("controller_alone", answering),
    "answering_behind": ("controller_alone", answering_behind),
    "latching": ("controller_alone", latching),
    "mute": ("controller_alone", mute),
    "apart": ("together", apart),
    "cool": ("together", cool),
    "misnamed": ("together", misnamed),
    "complaining": ("waiting_then_driving", complaining),
    "answering_text": ("controller_alone", answering_text),
    "answering_late": ("controller_alone", answering_late),
    "answering_once": ("controller_alone", answering_once),
    "swinging": ("alone", swinging),
    "still": ("alone", still),
    "asking_once": ("client_waits", asking_once),
    "unanswered": ("client_waits", unanswered),
    "greeting": ("defaults", greeting),
}

#: A line of a launch file, its error, the hint, and the rule that gives it.
LAUNCH_SLIPS = [
    (
        "from launch.substitutions import LaunchConfigurtion",
        "ImportError: cannot import name 'LaunchConfigurtion' from 'launch.substitutions' (unknown location)",
        "from launch.substitutions import LaunchConfiguration, not LaunchConfigurtion",
        "launch_import",
    ),
    (
        "from launch import Node",
        "ImportError: cannot import name 'Node' from 'launch' (unknown location)",
        "Node is in another module: from launch_ros.actions import Node",
        "launch_import",
    ),
    (
        "from launch import DeclareLaunchArgumnt",
        "ImportError: cannot import name 'DeclareLaunchArgumnt' from 'launch' (unknown location)",
        "there is no DeclareLaunchArgumnt: from launch.actions import DeclareLaunchArgument",
        "launch_import",
    ),
    (
        "from ament_index_python.packages import get_package_share_dir",
        "ImportError: cannot import name 'get_package_share_dir' from 'ament_index_python.packages' (unknown location)",
        "from ament_index_python.packages import get_package_share_directory, not get_package_share_dir",
        "launch_import",
    ),
    (
        "import launch",
        "AttributeError: module 'launch' has no attribute 'LaunchDescripton'",
        "launch.LaunchDescripton should be launch.LaunchDescription",
        "launch_attribute",
    ),
    (
        "import launch_ros",
        "AttributeError: module 'launch_ros' has no attribute 'action'",
        "launch_ros.action should be launch_ros.actions",
        "launch_attribute",
    ),
    (
        "import launch",
        "AttributeError: module 'launch' has no attribute 'TimerAction'",
        "TimerAction is in another module: from launch.actions import TimerAction",
        "launch_attribute",
    ),
    (
        "import launch.condition",
        "ModuleNotFoundError: No module named 'launch.conditon'",
        "the module is called launch.conditions, not launch.conditon",
        "launch_module",
    ),
    (
        "x = LaunchDescription()",
        "NameError: name 'LaunchDescription' is not defined",
        "the import is missing: from launch import LaunchDescription",
        "launch_name",
    ),
    (
        "x = Node(package='a', executable='b')",
        "NameError: name 'Node' is not defined",
        "the import is missing: from launch_ros.actions import Node",
        "launch_name",
    ),
    (
        "from launch.actions import GroupAction\nx = GroupActon()",
        "NameError: name 'GroupActon' is not defined",
        "GroupActon should be GroupAction",
        "launch_name",
    ),
    (
        "x = Node(package='a', executible='b')",
        "TypeError: Node.__init__() missing a required argument: 'executable'",
        "write executable=, not executible=",
        "launch_argument",
    ),
    (
        "x = Node(package='a')",
        "TypeError: Node.__init__() missing a required argument: 'executable'",
        "give Node its executable: Node(executable=...)",
        "launch_argument",
    ),
    (
        "x = DeclareLaunchArgument('a', defualt_value='b')",
        "TypeError: DeclareLaunchArgument.__init__() got an unexpected keyword argument 'defualt_value'",
        "write default_value=, not defualt_value=",
        "launch_argument",
    ),
]
