"""A report for tests of the command line, also in processes of their own."""

from fractions import Fraction

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import Environment, ExerciseReport, Report, Verdict
from grader.runtime.model.trace import ClockKind


def a_report(*outcomes: Outcome, score: None = None) -> Report:
    """Return a report of one exercise with a criterion of 10 points for each outcome."""
    earned = {Outcome.MET: 10, Outcome.PARTLY: 5}
    verdicts = tuple(
        Verdict(f"c{n}", f"Criterion {n} ±", o, Fraction(earned.get(o, 0)), Fraction(10), "why")
        for n, o in enumerate(outcomes or (Outcome.MET,))
    )
    part = ExerciseReport("velocity_publisher", "1", "Velocity", True, ClockKind.VIRTUAL, "", verdicts)
    environment = Environment("0.1.0", "jazzy", "7.1.6", "rmw_fastrtps_cpp", "3.11.9", "none")
    return Report("ada", "./ada", "sha256:" + "0" * 64, environment, 7, (part,), 1.5)
