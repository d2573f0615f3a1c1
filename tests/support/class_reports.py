"""Reports of a made-up class: what students of this chapter get wrong, in shares as a course has them."""

from __future__ import annotations

import random
from collections.abc import Mapping
from dataclasses import replace
from fractions import Fraction
from typing import Any

from report_samples import exercise as sample
from report_samples import report

from grader.grading.model.exercise import Criterion, Exercise, Location, Outcome
from grader.grading.model.report import ExerciseReport, Report, ReportedFault, Verdict
from grader.grading.rubrics.builtin import builtin_exercises

#: Criterion -> (likelihood in percent, diagnosis, reason, hint); {a} and {b} are drawn.
MISTAKES = {
    "publishes_twist": [
        (4, "topic_name", "/cmd_vel: no message; /{n}/cmd_vel has {i} messages of type geometry_msgs/msg/Twist",
         "self.create_publisher(Twist, '/{n}/cmd_vel', 10) publishes on /{n}/cmd_vel: the task asks for /cmd_vel"),
    ],
    "rate": [
        (14, "period", "/cmd_vel: average rate: {a:.3f} Hz, min: 0.100 s, max: 0.100 s, std dev: 0.00000 s, window: "
         "{i}; expected 20 ± 1 Hz over 10.0 s",
         "create_timer({b:.3f}, self.{n}) fires every {b:.3f} s, which is {a:.3f} Hz; 20 Hz needs a period of 0.05 s"),
        (3, "period", "/cmd_vel: 1 message, at t = 20.000 s; expected 20 ± 1 Hz over 10.0 s",
         "create_timer(20, self.{n}) fires every 20 s: 20 is the rate, the period is 1/20 = 0.05 s"),
    ],
    "linear_velocity": [
        (5, "exchanged", "t = 0.050 s, /cmd_vel: linear.x is 0.1, expected 0.5; wrong in all {i} messages",
         "linear.x and angular.z are swapped: self.{n}.linear.x = 0.1 must get 0.5"),
    ],
    "angular_velocity": [
        (7, "sign", "t = 0.050 s, /cmd_vel: angular.z is -{b:.2f}, expected 0.1; wrong in all {i} messages",
         "msg.angular.z = -{b:.2f} has the wrong sign: angular.z must be 0.1"),
    ],
    "logging": [
        (12, "prints", "velocity_publisher.py: {i} lines printed, none through the logger",
         "print('{n}') does not log: write self.get_logger().info(...)"),
    ],
    "subscribes_odom": [
        (5, "topic_name", "/odom: no subscription; the nearest is /{n}",
         "self.create_subscription(Odometry, '/{n}', self.{n}, 10) subscribes to /{n}: the task asks for /odom"),
    ],
    "logs_position": [
        (9, "velocity_for_position", "odom_subscriber.py: the logged values are the linear velocity (twist), not the "
         "pose: at t = {a:.3f} s the log says 'x={b:.2f}', the position was ({a:.2f}, {b:.2f}) m",
         "self.{n}.twist.twist.linear.x is the velocity: the position is msg.pose.pose.position.x and .y"),
    ],
    "log_period": [
        (22, "every_message", "odom_subscriber.py: {i} logs, one every {b:.3f} s on average; expected one a second",
         "the log is written for every message: log from a timer of 1 s"),
    ],
    "waits_gracefully": [
        (8, "", "odom_subscriber.py:{i}: AttributeError: 'NoneType' object has no attribute '{n}'",
         "line {i} reads the message before one has come: check for None first"),
    ],
    "temperature_range": [
        (6, "constant", "/temperature: the values are not random but constant, {a:.1f} °C in all {i} messages",
         "self.{n} = {a:.1f} is drawn once: draw anew in each call"),
    ],
    "fan_on_above_25": [
        (7, "branches", "t = 4.500 s, /fan_speed: 0 for {a:.3f} °C on /temperature, expected 100",
         "the branches of msg.data < {a:.1f} are the wrong way round: 100 belongs above 25, 0 at or below it"),
    ],
    "fan_off_at_or_below_25": [
        (10, "boundary", "t = 5.000 s, /fan_speed: 100 for 25 °C on /temperature, expected 0",
         "{n}.data >= 25.0 includes 25: at exactly 25 the fan is off"),
    ],
}  # fmt: skip
FOLLOWS = {"runs_together": ("fan_on_above_25", "fan_off_at_or_below_25", "temperature_range")}
CHAPTER = ("velocity_publisher", "odom_subscriber", "two_node_communication")
EXERCISES = [exercise for id_ in CHAPTER for exercise in builtin_exercises() if exercise.id == id_]
WORDS = ("timer_callback", "tick", "publish_velocity", "on_timer", "cb", "step")


def drawn_report(number: int, name: str) -> Report:
    """Return the report of student `number`, always the same one; every 40th has something undecided."""
    draw = random.Random(number)
    return report(*(_exercise(exercise, draw, number) for exercise in EXERCISES), name=name, path=name, seed=number)


def _exercise(exercise: Exercise, draw: random.Random, number: int) -> ExerciseReport:
    verdicts: list[Verdict] = []
    missing = exercise.files[-1] if draw.random() < 0.06 else ""
    for criterion in exercise.criteria:
        verdicts.append(_verdict(criterion, {v.id: v for v in verdicts}, draw, missing))
    if number % 40 == 17 and exercise.number == "2":
        lost = "the machine did not keep up, three times: the reference timer slipped by 0.4 s"
        verdicts[-1] = Verdict(verdicts[-1].id, verdicts[-1].title, Outcome.UNDECIDED, Fraction(0), Fraction(8), lost)
    faults = [_fault(v) for v in verdicts if "AttributeError" in v.reason]
    return sample(exercise.id, exercise.number, exercise.title, *verdicts, faults=tuple(faults))


def _verdict(criterion: Criterion, before: Mapping[str, Verdict], draw: random.Random, missing: str) -> Verdict:
    points = Fraction(criterion.points)
    if missing and not before:
        reason, hint = f"{missing}: not in the submission", f"hand in a file named {missing}"
        return _lost(criterion, reason, hint, {"missing": missing, "similar": []})
    if missing:
        return Verdict(criterion.id, criterion.title, Outcome.BLOCKED, Fraction(0), points,
                       f"not judged: needs {missing}, which is missing",
                       blocked_by=next(iter(before)), missing_file=missing)  # fmt: skip
    needed = next((n for n in criterion.needs if before[n].outcome in (Outcome.NOT_MET, Outcome.BLOCKED)), "")
    if needed:
        return Verdict(criterion.id, criterion.title, Outcome.BLOCKED, Fraction(0), points,
                       f"not judged: needs {needed} (not met)", blocked_by=needed)  # fmt: skip
    owner = next((o for o in FOLLOWS.get(criterion.id, ()) if before[o].outcome is Outcome.NOT_MET), "")
    if owner:
        hint = f"this has the same cause as {owner}: fix that first"
        return replace(_lost(criterion, "t = 0.2 s, /fan_speed: 0 for 26 °C", hint, {}), same_cause_as=owner)
    for percent, cause, reason, hint in MISTAKES.get(criterion.id, ()):
        if draw.random() * 100 < percent:
            values = {
                "a": draw.uniform(2, 40),
                "b": draw.uniform(0.02, 0.5),
                "i": draw.randint(5, 400),
                "n": draw.choice(WORDS),
            }
            evidence = {"diagnosis": cause} if cause else {}
            partly = cause == "prints"
            return _lost(criterion, reason.format(**values), hint.format(**values), evidence, partly=partly)
    return Verdict(criterion.id, criterion.title, Outcome.MET, points, points, f"{criterion.title}, as asked")


def _lost(
    criterion: Criterion, reason: str, hint: str, evidence: Mapping[str, Any], *, partly: bool = False
) -> Verdict:
    points = Fraction(criterion.points)
    outcome, score = (Outcome.PARTLY, points / 2) if partly else (Outcome.NOT_MET, Fraction(0))
    place = Location("a.py", 7)
    return Verdict(
        criterion.id, criterion.title, outcome, score, points, reason, hint=hint, location=place, evidence=evidence
    )


def _fault(verdict: Verdict) -> ReportedFault:
    file, line, text = verdict.reason.split(":", 2)
    return ReportedFault("exception", file, int(line), text.strip(), 1_250_000_000, "waiting_then_driving", ())
