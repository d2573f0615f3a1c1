"""Reports of whole runs, made by the real judging from traces built in code, with every kind of figure in them."""

from collections.abc import Mapping
from pathlib import Path

from report_samples import report
from tracing import FLOAT32, Recording, held_at, position_logs, scripted, velocity

from grader.grading.judging.figures import illustrated
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import ExerciseReport, Report
from grader.grading.rubrics.builtin import builtin_exercises
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, FaultKind

CHAPTER = ("velocity_publisher", "odom_subscriber", "two_node_communication")
SENSOR, CONTROLLER = "/temperature_sensor", "/fan_controller"
SOURCE = """import rclpy


def main():
    rclpy.init()
    raise ValueError("a line that is longer than a telephone is wide, and longer still, and then some more of it")


main()
"""


def perfect() -> Report:
    """Return a report in which everything is met."""
    return _report(velocity().log(1, "publishing"), position_logs(lambda x, y: f"x={x:.3f} y={y:.3f}"), "/fan_speed")


def wrong() -> Report:
    """Return a report with a slow publisher, wrong positions and a controller that talks to nobody."""
    return _report(
        velocity(rate=10).log(1, "publishing", "WARN"), position_logs(lambda x, y: f"x={y:.3f} y={x:.3f}"), "/fan"
    )


def crashed(text: str = "ValueError: no") -> Report:
    """Return a report of nodes that raised; the text of the exception is given."""
    first = velocity(stop_s=4).fault(
        3,
        FaultKind.EXCEPTION,
        text,
        line=6,
        process="velocity_publisher.py",
        frames=("velocity_publisher.py:6 in main",),
    )
    second = Recording(24, process="odom_subscriber.py").log(1, text, "ERROR").crashed(5, text, line=6)
    return _report(first, second, "/fan_speed", name=text)


def _report(first: Recording, second: Recording, speed: str, name: str = "ada") -> Report:
    rubrics = [exercise for id_ in CHAPTER for exercise in builtin_exercises() if exercise.id == id_]
    recordings = {"alone": first, "waiting_then_driving": second, **_conversation(speed)}
    traces = {name_: recording.trace(name_) for name_, recording in recordings.items()}
    return report(*(_graded(exercise, traces) for exercise in rubrics), name=name)


def _graded(exercise: Exercise, traces: Mapping[str, AssessedTrace]) -> ExerciseReport:
    own = {s.id: traces[s.id] for s in exercise.scenarios}
    submission = Submission(
        "ada", "./ada", Path(), "sha256:" + "0" * 64, {f: StudentFile(f, f) for f in exercise.files}
    )
    sources = dict.fromkeys(exercise.files, SOURCE)
    judged = judge_exercise(exercise, own, submission, sources)
    return illustrated(judged, exercise, own, submission, sources)


def _conversation(speed: str) -> dict[str, Recording]:
    """Return exercise 3's scenarios; the sensor's values are fixed but look drawn."""
    sensor = Recording(12, process="temperature_sensor.py").endpoint("publisher", "/temperature", FLOAT32, SENSOR)
    sensor.endpoint("subscription", "/fan_speed", FLOAT32, SENSOR)
    both = Recording(20, process="temperature_sensor.py").endpoint("publisher", "/temperature", FLOAT32, SENSOR)
    both.endpoint("subscription", "/fan_speed", FLOAT32, SENSOR)
    both.endpoint("subscription", "/temperature", FLOAT32, CONTROLLER, 2)
    both.endpoint("publisher", speed, FLOAT32, CONTROLLER, 2)
    for k in range(60):
        sensor.number(0.2 * k, "/temperature", _drawn(k)).deliver(
            0.2 * k, "/fan_speed", {"data": 100.0 * (k // 10 % 2)}
        )
        sensor.log(0.2 * k, f"fan {100.0 * (k // 10 % 2)}")
    for k in range(99):
        both.number(0.2 * k, "/temperature", _drawn(k)).number(0.2 * k + 0.01, speed, 100.0 * (_drawn(k) > 25))
    alone = scripted().endpoint("subscription", "/temperature", FLOAT32, CONTROLLER)
    alone.endpoint("publisher", speed, FLOAT32, CONTROLLER)
    for k in range(80):
        alone.number(0.51 + 0.2 * k, speed, 100.0 * ((held_at(0.5 + 0.2 * k) or 0) > 25))
    return {"sensor_alone": sensor, "controller_alone": alone, "together": both}


def _drawn(k: int) -> float:
    return 20 + (k * k * 7919 + 104729 * k) % 1000 / 100
