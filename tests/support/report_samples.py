"""Sample reports, built in code, that every renderer is tried on."""

import json
from fractions import Fraction
from importlib.resources import files
from typing import Any

from grader.grading.model.exercise import Location, Outcome
from grader.grading.model.report import Environment, ExerciseReport, Report, ReportedFault, Reproduction, Verdict
from grader.grading.reporting.platforms.classroom50 import HandedIn
from grader.runtime.model.checkup import PROPERTIES, Property
from grader.runtime.model.trace import ClockKind, Endpoint, GraphSnapshot

VIRTUAL = ClockKind.VIRTUAL
ENVIRONMENT = Environment(
    grader="0.1.0",
    ros_distro="jazzy",
    rclpy="7.1.6",
    rmw="rmw_fastrtps_cpp",
    python="3.11.9",
    isolation="bubblewrap",
    containment=tuple(Property(name, holds=True, mechanism="a namespace") for name in PROPERTIES),
)
HANDED_IN = HandedIn(
    classroom="robots-101",
    assignment="rclpy",
    assignment_type="individual",
    owner="robots-101",
    username="ada",
    submission="submit/2026-01-31T10-00-00Z",
    commit="https://git.example/robots-101/rclpy-ada/commit/1",
    release="https://git.example/robots-101/rclpy-ada/releases/1",
    review="https://git.example/robots-101/rclpy-ada/pull/1",
    datetime="2026-01-31T10:00:00Z",
)
NASTY = "\x1b[2J\x1b]0;owned\x07[bold red]pwned[/] \u202edrowssap\u202c \ud800 a\nb\r\tc\u200b \x9b31m {x!r} \\"


def criterion(id_: str, title: str, points: int, outcome: Outcome = Outcome.MET, **changes: object) -> Verdict:
    """Return a verdict; `reason` and the rest as given, the score from the outcome."""
    share = {Outcome.MET: Fraction(1), Outcome.PARTLY: Fraction(1, 2)}.get(outcome, Fraction(0))
    fields: dict[str, object] = {"reason": f"{title}, as asked", **changes}
    return Verdict(id_, title, outcome, share * points, Fraction(points), **fields)  # type: ignore[arg-type]


def exercise(id_: str, number: str, title: str, *verdicts: Verdict, **changes: object) -> ExerciseReport:
    """Return a required exercise on the virtual clock."""
    fields: dict[str, object] = {"required": True, "clock": VIRTUAL, "clock_reason": "", **changes}
    return ExerciseReport(id=id_, number=number, title=title, verdicts=verdicts, **fields)  # type: ignore[arg-type]


def report(*exercises: ExerciseReport, **changes: object) -> Report:
    """Return a report with everything but its exercises filled in."""
    fields: dict[str, object] = {
        "name": "ada_homework",
        "path": "./ada_homework",
        "digest": "sha256:" + "0123456789abcdef" * 4,
        "environment": ENVIRONMENT,
        "seed": 4711,
        "duration_s": 1.8042,
        "reproduce": Reproduction(
            command=("grade", str(changes.get("path", "./ada_homework")), "--seed", "4711"),
            rubrics=tuple((e.id, "sha256:" + f"{n:x}" * 64) for n, e in enumerate(exercises)),
            recording="sha256:" + "ab" * 32,
        ),
        **changes,
    }
    return Report(exercises=exercises, **fields)  # type: ignore[arg-type]


def endpoint(kind: str, topic: str, node: str, type_: str = "std_msgs/msg/Float32", participant: int = 0) -> Endpoint:
    """Return a reliable, volatile endpoint."""
    return Endpoint(kind, topic, type_, node, participant, "reliable", "volatile", 10)


def both_ways() -> GraphSnapshot:
    """Return the graph that exercise 3 asks for, with what every node has besides."""
    sensor, controller = "/temperature_sensor", "/fan_controller"
    return GraphSnapshot(
        t_ns=0,
        nodes=(controller, sensor),
        endpoints=(
            endpoint("publisher", "/fan_speed", controller, participant=1),
            endpoint("publisher", "/rosout", controller, "rcl_interfaces/msg/Log", 1),
            endpoint("publisher", "/rosout", sensor, "rcl_interfaces/msg/Log"),
            endpoint("publisher", "/temperature", sensor),
            endpoint("subscription", "/fan_speed", sensor),
            endpoint("subscription", "/temperature", controller, participant=1),
            endpoint("publisher", "/_hidden", controller, participant=1),
        ),
    )


def velocity(**outcomes: Outcome) -> ExerciseReport:
    """Return exercise 1 with everything met."""
    return exercise(
        "velocity_publisher",
        "1",
        "Velocity publisher",
        criterion("publishes_twist", "Publishes geometry_msgs/msg/Twist on /cmd_vel", 6),
        criterion(
            "rate",
            "Publishes at 20 Hz",
            10,
            reason="/cmd_vel: average rate 20.000, min 0.050 s, max 0.050 s, std dev 0.00000 s, window 200",
            evidence={"rate_hz": 20.0, "count": 200, "worst": float("nan")},
        ),
        criterion("linear_velocity", "Drives forward at 0.5 m/s", 5),
        criterion("angular_velocity", "Turns at 0.1 rad/s", 5),
        criterion("logging", "Logs through the node's logger", 4),
    )


def two_nodes(*, graph: GraphSnapshot | None = None) -> ExerciseReport:
    """Return exercise 3 with everything met."""
    return exercise(
        "two_node_communication",
        "3",
        "Two nodes talk to each other",
        criterion("temperature_rate", "Publishes /temperature at 5 Hz", 6),
        criterion("temperature_range", "Temperatures are random, from 20 to 30 °C", 6),
        criterion("logs_fan_speed", "The sensor logs the fan speed it receives", 5),
        criterion("fan_on_above_25", "Fan at 100 above 25 °C", 7),
        criterion("fan_off_at_or_below_25", "Fan at 0 at 25 °C and below", 7),
        criterion("runs_together", "Both nodes work together", 5),
        criterion("bidirectional_graph", "Both nodes publish to each other", 4),
        graph=graph or both_ways(),
    )


def perfect() -> Report:
    """Return a report with full marks."""
    return report(velocity(), two_nodes())


def middling() -> Report:
    """Return a report with one outcome of each judged kind, notes, and an exercise on the wall clock."""
    return report(
        exercise(
            "velocity_publisher",
            "1",
            "Velocity publisher",
            criterion("publishes_twist", "Publishes geometry_msgs/msg/Twist on /cmd_vel", 6),
            criterion(
                "rate",
                "Publishes at 20 Hz",
                10,
                Outcome.NOT_MET,
                reason="/cmd_vel: 10.00 Hz, expected 20 ± 1 Hz over 0.0 to 10.0 s; average rate 10.000, "
                "min 0.100 s, max 0.100 s, std dev 0.00000 s, window 101",
                hint="the argument of create_timer is the period in seconds: 1 / 20 Hz = 0.05",
                location=Location("velocity_publisher.py", 17),
                evidence={"rate_hz": 10.0},
            ),
            criterion("linear_velocity", "Drives forward at 0.5 m/s", 5),
            criterion(
                "angular_velocity",
                "Turns at 0.1 rad/s",
                5,
                Outcome.NOT_MET,
                reason="t = 0.100 s, /cmd_vel: angular.z is -0.1 rad/s, expected 0.1 rad/s",
                hint="a positive angular.z turns left",
            ),
            criterion(
                "logging",
                "Logs through the node's logger",
                4,
                Outcome.PARTLY,
                reason="12 lines were printed, no record went through the logger",
                hint="use self.get_logger().info(...)",
            ),
            notes=("velocity_publisher.py: two candidates, the one nearest the top was graded",),
        ),
        exercise(
            "odom_subscriber",
            "2",
            "Odometry subscriber",
            criterion(
                "subscribes_odom",
                "Subscribes to /odom",
                6,
                Outcome.NOT_MET,
                reason="/odom: no subscription; the nearest is /odometry",
                hint="subscribe to /odom",
            ),
            criterion("logs_position", "Logs the position", 10, Outcome.BLOCKED, **_needs("subscribes_odom")),
            criterion("log_period", "Logs once a second", 6, Outcome.BLOCKED, **_needs("subscribes_odom")),
            criterion("waits_gracefully", "Waits for data", 8, Outcome.BLOCKED, **_needs("subscribes_odom")),
            clock=ClockKind.WALL,
            clock_reason="odom_subscriber.py spins in a thread that did not settle",
        ),
        notes=("a symbolic link was not followed: data",),
    )


def crashed() -> Report:
    """Return a report of a node that raised in its constructor."""
    fault = ReportedFault(
        kind="exception",
        file="velocity_publisher.py",
        line=14,
        text="AttributeError: 'VelocityPublisher' object has no attribute 'publisher'",
        t_ns=50_000_000,
        scenario="alone",
        frames=(
            "velocity_publisher.py:31 in <module>",
            "velocity_publisher.py:24 in main",
            *(f"velocity_publisher.py:{line} in tick" for line in range(40, 52)),
            "velocity_publisher.py:14 in __init__",
        ),
    )
    needs = _needs("publishes_twist")
    return report(
        exercise(
            "velocity_publisher",
            "1",
            "Velocity publisher",
            criterion(
                "publishes_twist",
                "Publishes geometry_msgs/msg/Twist on /cmd_vel",
                6,
                Outcome.NOT_MET,
                reason=f"velocity_publisher.py:14: {fault.text}",
                hint="create the publisher before the timer that uses it",
                location=Location("velocity_publisher.py", 14),
            ),
            criterion("rate", "Publishes at 20 Hz", 10, Outcome.BLOCKED, **needs),
            criterion("linear_velocity", "Drives forward at 0.5 m/s", 5, Outcome.BLOCKED, **needs),
            criterion("angular_velocity", "Turns at 0.1 rad/s", 5, Outcome.BLOCKED, **needs),
            criterion("logging", "Logs through the node's logger", 4),
            faults=(fault,),
        )
    )


def undecided() -> Report:
    """Return a report that is not final, made without a sandbox."""
    lost = "the worker ended before the scenario did (signal 9)"
    environment = Environment("0.1.0", "jazzy", "7.1.6", "rmw_fastrtps_cpp", "3.11.9", "none")
    return report(
        velocity(),
        exercise(
            "odom_subscriber",
            "2",
            "Odometry subscriber",
            criterion("subscribes_odom", "Subscribes to /odom", 6, Outcome.UNDECIDED, reason=lost),
            criterion("logs_position", "Logs the position", 10, Outcome.UNDECIDED, reason=lost),
            required=False,
        ),
        environment=environment,
    )


def partial() -> Report:
    """Return a report that was made before the second exercise had been graded."""
    waiting = "not graded yet"
    return report(
        velocity(),
        exercise(
            "odom_subscriber",
            "2",
            "Odometry subscriber",
            criterion("subscribes_odom", "Subscribes to /odom", 6, Outcome.UNDECIDED, reason=waiting),
            criterion("logs_position", "Logs the position", 10, Outcome.UNDECIDED, reason=waiting),
        ),
        pending=("odom_subscriber",),
    )


def hostile() -> Report:
    """Return a report in which every text that a student can influence is an attack."""
    fault = ReportedFault("exception", NASTY, 3, f"ValueError: {NASTY}", 1, NASTY, (NASTY,) * 2)
    graph = GraphSnapshot(
        0,
        (NASTY, "/b"),
        (endpoint("publisher", f"/t{NASTY}", NASTY), endpoint("subscription", f"/t{NASTY}", "/b", "x/msg/[red]Y")),
    )
    return report(
        exercise(
            "velocity_publisher",
            "1",
            "Velocity publisher",
            criterion(
                "rate",
                "Publishes at 20 Hz",
                10,
                Outcome.NOT_MET,
                reason=f"/cmd_vel: {NASTY} {'A' * 100_000}",
                hint=NASTY,
                location=Location(NASTY, 7),
                evidence={
                    NASTY: [NASTY, float("inf"), -float("inf"), float("nan"), Fraction(1, 3), 1 << 70, None, True]
                },
            ),
            criterion("logging", "Logs", 4, Outcome.BLOCKED, reason=f"not judged: needs {NASTY}"),
            faults=(fault,) * 12,
            notes=tuple(f"{number} {NASTY}" for number in range(25)),
            graph=graph,
            clock=ClockKind.WALL,
            clock_reason=NASTY,
        ),
        name=NASTY,
        path=NASTY,
        notes=(NASTY,),
    )


def _needs(id_: str) -> dict[str, str]:
    return {"reason": f"not judged: needs {id_} (not met)", "blocked_by": id_}


SAMPLES = {
    "perfect": perfect,
    "middling": middling,
    "crashed": crashed,
    "undecided": undecided,
    "partial": partial,
    "hostile": hostile,
}


def report_schema() -> dict[str, Any]:
    """Return the JSON Schema of reports that the package holds."""
    schema: dict[str, Any] = json.loads(
        (files("grader.grading.reporting") / "report.schema.json").read_text(encoding="utf-8")
    )
    return schema
