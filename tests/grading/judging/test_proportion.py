"""Credit in proportion: by one recording, over several draws, in reasons, evidence and charts."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from fractions import Fraction
from pathlib import Path
from typing import Any, ClassVar

import pytest
from tracing import ODOMETRY, Recording

from grader.grading.judging.beginnings import BeginningJudge
from grader.grading.judging.checks.timing import ReactionCase
from grader.grading.judging.figures import figures_of, on_recordings
from grader.grading.judging.findings import met, not_met
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.judging.values import FieldRule
from grader.grading.model.chart import Chart
from grader.grading.model.exercise import Check, Criterion, Exercise, Finding, Outcome, measure_of
from grader.grading.model.measures import MEASURED_KEY, Measure, Scale
from grader.grading.model.report import ExerciseReport
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, Trace

FILE = "node.py"
CHECKS = known_checks()
REACTION = CHECKS["reaction"]("/temperature", "/fan_speed", (ReactionCase({"data": FieldRule(low=0)}, {"data": 100}),))
SUBMISSION = Submission("x", "x", Path(), "", {FILE: StudentFile(FILE, FILE)})


@dataclass(frozen=True)
class Error:
    """The numbers on /error; of an author."""

    measures: ClassVar[Measure] = Measure("error", "m")

    def judge(self, trace: Trace) -> Finding:
        numbers = [m.value["data"] for m in trace.messages("/error")]
        if not numbers:
            return not_met("/error: no message", hint="publish it")
        return met("", measured=[float(n) for n in numbers])


def exercise(check: Check, scale: Scale | None, draws: int = 1) -> Exercise:
    """Return an exercise with one criterion, worth 10 points."""
    scenarios = tuple(
        Scenario("run" if n == 1 else f"run_draw_{n}", (FILE,), Span(10 * NS_PER_S)) for n in range(1, draws + 1)
    )
    criterion = Criterion("error", "Error", Fraction(10), "run", check, check_name="own", scale=scale)
    again = {"run": tuple(s.id for s in scenarios[1:])} if draws > 1 else {}
    return Exercise("one", "1", "One", True, (FILE,), scenarios, (criterion,), "sha256:0", draws=again)


def errors(*values: float) -> AssessedTrace:
    """Record some numbers."""
    recording = Recording(10)
    for number, value in enumerate(values):
        recording.number(number, "/error", value)
    return recording.trace()


def judged(
    scale: Scale | None, *traces: AssessedTrace, check: Check | None = None
) -> tuple[ExerciseReport, Mapping[str, AssessedTrace]]:
    """Judge one recording of each draw."""
    asked = exercise(check or Error(), scale, len(traces))
    recorded = {s.id: trace for s, trace in zip(asked.scenarios, traces, strict=True)}
    return judge_exercise(asked, recorded, SUBMISSION), recorded


def test_the_report_states_the_number_the_limits_and_the_points() -> None:
    """Half way between the limits, half of the points."""
    report, _ = judged(Scale(0.05, 0.25), errors(0.15, 0.1))
    (verdict,) = report.verdicts
    assert (verdict.score, verdict.outcome) == (5, Outcome.PARTLY)
    assert verdict.reason == "error 0.15 m (the largest of 2); full points for 0.05 m, none for 0.25 m"
    assert verdict.evidence[MEASURED_KEY] == {
        "name": "error",
        "unit": "m",
        "number": 0.15,
        "full": 0.05,
        "none": 0.25,
        "combine": "worst",
        "share": 0.5,
        "count": 2,
        "numbers": [0.15, 0.1],
    }


def test_without_a_number_the_finding_stays() -> None:
    """With its hint."""
    (verdict,) = judged(Scale(0.05, 0.25), errors())[0].verdicts
    assert (verdict.score, verdict.reason, verdict.hint) == (0, "/error: no message", "publish it")


def test_without_limits_the_number_counts_for_nothing() -> None:
    """The finding is worth what the check says."""
    (verdict,) = judged(None, errors(9))[0].verdicts
    assert (verdict.score, verdict.evidence) == (10, {})


@pytest.mark.parametrize(
    ("combine", "score", "number"),
    [("worst", 0, "0.3 m or more"), ("mean", Fraction(5), "0.2 m"), ("median", 5, "0.2 m")],
)
def test_draws_are_combined(combine: Any, score: int, number: str) -> None:
    """The report names the worst of them, and shows its chart."""
    report, traces = judged(Scale(0.1, 0.3, combine), errors(0.1), errors(0.4), errors(0.2))
    (verdict,) = report.verdicts
    assert (verdict.score, verdict.recording) == (score, "run_draw_2")
    words = "the largest" if combine == "worst" else f"the {combine}"
    assert verdict.reason == (
        f"error {number}, {words} of 3 draws (0.1 m, 0.3 m or more, 0.2 m); full points for 0.1 m, none for 0.3 m; "
        "draw 2 of 3: error 0.3 m or more; full points for 0.1 m, none for 0.3 m"
    )
    asked = on_recordings(exercise(Error(), Scale(0.1, 0.3, combine), 3), report.verdicts)
    charts = [f for f in figures_of(asked, traces) if isinstance(f, Chart)]
    assert {chart.scenario for chart in charts if chart.criteria} == {"run_draw_2"}


def test_a_draw_in_which_it_crashed_counts_as_none() -> None:
    """The others still earn their part of a mean."""
    crashed = Recording(10).crashed(1, process=FILE).trace()
    (verdict,) = judged(Scale(0.1, 0.3, "mean"), errors(0.1), crashed)[0].verdicts
    assert verdict.score == 5
    (verdict,) = judged(Scale(0.1, 0.3), errors(0.1), crashed)[0].verdicts
    assert verdict.score == 0


def test_a_criterion_without_limits_is_worth_its_worst_draw() -> None:
    """And says which one that is."""
    report, _ = judged(None, errors(1), errors(), errors(2))
    (verdict,) = report.verdicts
    assert (verdict.score, verdict.reason, verdict.recording) == (0, "draw 2 of 3: /error: no message", "run_draw_2")
    (verdict,) = judged(None, errors(1), errors(2))[0].verdicts
    assert (verdict.score, verdict.reason) == (10, "")


def test_a_draw_that_was_not_recorded_leaves_it_undecided() -> None:
    """It may have been the worst."""
    asked = exercise(Error(), Scale(0.1, 0.3), 2)
    report = judge_exercise(asked, {"run": errors(0.1)}, SUBMISSION)
    assert report.verdicts[0].outcome is Outcome.UNDECIDED


def test_an_author_who_measures_nothing_is_told() -> None:
    """A check that gives points without a number where the rubric has limits."""

    @dataclass(frozen=True)
    class Forgets:
        measures: ClassVar[Measure] = Measure("error", "m")

        def judge(self, trace: Trace) -> Finding:
            return met("fine")

    (verdict,) = judged(Scale(0.1, 0.3), errors(0.1), check=Forgets())[0].verdicts
    assert "gave points and nothing `measured`, which the rubric's `full` and `none` need" in verdict.author_mistake


def test_the_chart_shows_the_numbers_and_the_limits() -> None:
    """In a panel of its own."""
    report, traces = judged(Scale(0.05, 0.25), errors(0.15, 0.1))
    asked = exercise(Error(), Scale(0.05, 0.25))
    (chart,) = (f for f in figures_of(asked, traces) if isinstance(f, Chart) and f.criteria)
    panel = chart.panels[-1]
    assert (panel.title, panel.unit) == ("error", "m")
    assert [(level.value, level.label) for level in panel.levels] == [
        (0.05, "full points"),
        (0.25, "no points"),
        (0.15, "0.15 m"),
    ]
    assert report.verdicts[0].outcome is Outcome.PARTLY


def test_a_spot_check_compares_the_finding_and_not_the_number() -> None:
    """A beginning has another number, and a wall clock too, which is no difference of the program."""
    asked = exercise(Error(), Scale(0.05, 0.25), 2)
    for scenario in ("run", "run_draw_2"):
        judge = BeginningJudge(asked, scenario, SUBMISSION, {})
        assert judge.compare(errors(0.1, 0.1), errors(0.1, 0.2), (0, 0)).lost == ()
        assert [one.virtual for one in judge.compare(errors(0.1, 0.1), Recording(10).trace(), (0, 0)).lost] == ["met"]


def test_which_checks_measure() -> None:
    """Each says what, and which side is better."""
    found = {name: measure for name, check in CHECKS.items() if (measure := measure_of(check)) is not None}
    assert {name: (m.name, m.unit, m.better) for name, m in found.items()} == {
        "topic_rate": ("difference from the rate", "Hz", "less"),
        "reaction": ("time to the right message", "s", "less"),
        "period": ("time between two messages", "s", "less"),
        "latency": ("time to the next message", "s", "less"),
        "silence": ("number of messages", "", "less"),
        "field_in_range": ("distance from the range", "", "less"),
        "cancels_goal": ("time to the request to cancel", "s", "less"),
        "after_goal": ("time to the right goal", "s", "less"),
        "reaches_goal": ("time to a goal", "s", "less"),
        "stays_in_range": ("distance from the range", "", "less"),
    }


def numbers(check: Check, recording: Recording) -> list[float]:
    """Return what a check measures in a recording."""
    return [reading.value for reading in check.judge(recording.trace()).readings]


def test_a_rate_is_measured_by_its_difference() -> None:
    """On either side."""
    recording = Recording(10)
    for number in range(100):
        recording.number(number / 10, "/a", 0.0)
    for rate in (8.0, 12.0):
        assert numbers(CHECKS["topic_rate"]("/a", rate, 1.0), recording) == pytest.approx([2.0])


def test_times_and_counts_are_measured() -> None:
    """One for each gap, input and window, and infinity for an input without an output."""
    recording = Recording(10)
    for t_s in (1, 3, 4.5):
        recording.number(t_s, "/a", 0.0)
    for t_s in (0.5, 2.5, 5.0):
        recording.deliver(t_s, "/in", {"data": 0.0}, "std_msgs/msg/Float32")
    assert numbers(CHECKS["period"]("/a"), recording) == [2, 1.5]
    assert numbers(CHECKS["latency"]("/in", "/a", NS_PER_S), recording) == [0.5, 0.5, math.inf]
    assert numbers(CHECKS["silence"]("/a"), recording) == [3]
    assert numbers(CHECKS["field_in_range"]("/a", 1.0, 2.0), recording) == [1, 1, 1]


@pytest.mark.parametrize(("stays", "times"), [(False, [1.0, math.inf]), (True, [3.0, math.inf])])
def test_a_goal_is_measured_from_its_message_to_the_arrival(stays: bool, times: list[float]) -> None:
    """To the last one, where the robot has to stay; the second goal is never reached."""
    recording = Recording(20)
    for t_s, goal in ((0.0, 1.0), (10.0, 9.0)):
        recording.deliver(t_s, "/goal", {"x": goal, "y": 0.0, "z": 0.0}, "geometry_msgs/msg/Point")
    for tenth in range(200):
        x = 1.0 if 10 <= tenth < 20 or tenth >= 30 else 0.0
        recording.deliver(tenth / 10, "/odom", {"pose": {"pose": {"position": {"x": x, "y": 0.0, "z": 0.0}}}}, ODOMETRY)
    fields = {"pose.pose.position.x": "x"}
    assert numbers(CHECKS["reaches_goal"]("/odom", "/goal", fields, 0.1, 5 * NS_PER_S, stays), recording) == times


def test_a_reaction_is_measured_to_the_right_message() -> None:
    """Infinite where a wrong one is all that comes."""
    recording = Recording(10)
    for t_s, given in ((1, 5.0), (3, 7.0)):
        recording.deliver(t_s, "/temperature", {"data": given}, "std_msgs/msg/Float32")
    recording.number(1.25, "/fan_speed", 100.0)
    recording.number(3.25, "/fan_speed", 50.0)
    assert numbers(REACTION, recording) == [0.25, math.inf]


def test_a_scale_changes_no_other_criterion() -> None:
    """The exercise is judged as before without it."""
    asked = exercise(CHECKS["period"]("/error"), None)
    plain = judge_exercise(asked, {"run": errors(1, 2, 3)}, SUBMISSION).verdicts
    other = replace(asked, criteria=tuple(replace(c, scale=Scale(1, 2)) for c in asked.criteria))
    scaled = judge_exercise(other, {"run": errors(1, 2, 3)}, SUBMISSION).verdicts
    assert plain[0].evidence.items() <= scaled[0].evidence.items()
