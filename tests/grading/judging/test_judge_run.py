"""Judging an exercise: points, blocking, missing files, faults and undecided criteria."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from tracing import ODOMETRY, TWIST, Recording, driving, position_logs, velocity
from wordings import plain

from grader.grading.judging.checks import CHECKS
from grader.grading.judging.installation import lacking_package
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Check, Criterion, Exercise, Finding, Location, Outcome
from grader.grading.model.report import ExerciseReport, Verdict
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind, FaultKind, Trace
from grader.testing import TraceBuilder

FILE = "velocity_publisher.py"
ODOM = "odom_subscriber.py"
SECOND = 1_000_000_000


@dataclass(frozen=True)
class Says:
    """A check that returns a given finding."""

    credit: Fraction = Fraction(1)
    blocked_by: str | None = None
    hint: str = ""
    evidence: Mapping[str, Any] = field(default_factory=dict)
    location: Location | None = None

    def judge(self, trace: Trace) -> Finding:
        return Finding(self.credit, "found", self.evidence, self.location, self.hint, self.blocked_by)


@dataclass(frozen=True)
class Raises:
    """A check with a mistake in it."""

    def judge(self, trace: Trace) -> Finding:
        raise ZeroDivisionError("secret\nthing")


def criterion(
    id_: str, check: Check, *needs: str, points: str = "6", scenario: str = "alone", hint: str = ""
) -> Criterion:
    return Criterion(id_, id_.upper(), Fraction(points), scenario, check, needs, hint)


def exercise(*criteria: Criterion, files: tuple[str, ...] = (FILE,), scenarios: tuple[Scenario, ...] = ()) -> Exercise:
    alone = Scenario("alone", files, Span(10 * SECOND))
    return Exercise("e", "1", "E", True, files, scenarios or (alone,), criteria, "sha256:0")


def handed_in(*names: str, missing: Mapping[str, tuple[str, ...]] | None = None) -> Submission:
    files = {n: StudentFile(n, n) for n in names}
    files |= {n: StudentFile(n, None, similar) for n, similar in (missing or {}).items()}
    return Submission("s", "s", Path("s"), "sha256:1", files)


def judged(*criteria: Criterion, rec: Recording | None = None, **rest: Any) -> dict[str, Verdict]:
    trace = (rec or Recording()).trace(**rest)
    report = judge_exercise(exercise(*criteria), {"alone": trace}, handed_in(FILE))
    return {v.id: v for v in report.verdicts}


@dataclass(frozen=True)
class Looks(Says):
    """A check that is met by a trace which says nothing of what the grader thinks."""

    def judge(self, trace: Trace) -> Finding:
        """Look for it."""
        return Finding(Fraction(not isinstance(trace, AssessedTrace)), "")


def test_no_check_can_read_what_the_grader_thinks() -> None:
    """It is handed what was recorded, and always the same object, so that what it computes is kept."""
    assert judged(criterion("a", Looks()))["a"].outcome is Outcome.MET
    assessed = Recording().trace()
    assert assessed.recorded is assessed.recorded
    assert AssessedTrace.unremarkable(assessed.recorded) == assessed


def outcomes(report: ExerciseReport) -> dict[str, str]:
    return {v.id: v.outcome.value for v in report.verdicts}


@pytest.mark.parametrize(
    ("credit", "outcome", "score"),
    [
        ("1", Outcome.MET, "5/2"),
        ("1/2", Outcome.PARTLY, "5/4"),
        ("1/3", Outcome.PARTLY, "5/6"),
        ("0", Outcome.NOT_MET, "0"),
    ],
)
def test_points_are_credit_times_points(credit: str, outcome: Outcome, score: str) -> None:
    """As fractions, so that thirds add up."""
    verdict = judged(criterion("a", Says(Fraction(credit)), points="2.5"))["a"]
    assert (verdict.outcome, verdict.score, verdict.max_score) == (outcome, Fraction(score), Fraction("2.5"))
    assert verdict.title == "A"


@pytest.mark.parametrize("credit", [0, Fraction(1, 2), 1])
def test_the_rubrics_hint_is_used_where_the_check_has_none(credit: Fraction) -> None:
    """And only where something is lost."""
    given = judged(
        criterion("own", Says(Fraction(credit), hint="own"), hint="rubric"),
        criterion("rubric", Says(Fraction(credit)), hint="rubric"),
    )
    lost = credit < 1
    assert given["own"].hint == ("own" if lost else "")
    assert given["rubric"].hint == ("rubric" if lost else "")


def test_what_needs_an_unmet_criterion_is_blocked() -> None:
    """Transitively; partly met is enough; the reason names what is needed."""
    given = judged(
        criterion("bad", Says(Fraction(0))),
        criterion("half", Says(Fraction(1, 2))),
        criterion("a", Says(), "bad"),
        criterion("b", Says(), "half"),
        criterion("c", Says(), "half", "a"),
    )
    assert [v.outcome.value for v in given.values()] == ["not_met", "partly", "blocked", "met", "blocked"]
    assert given["a"].reason == "not judged: needs bad (not met)"
    assert given["c"].reason == "not judged: needs a (not judged)"
    assert [v.blocked_by for v in given.values()] == ["", "", "bad", "", "a"]
    assert given["a"].score == given["c"].score == 0


def test_a_finding_can_name_what_blocks_it() -> None:
    """A criterion ahead or behind, by its id; where that one is met, the finding stands."""
    given = judged(
        criterion("early", Says(Fraction(0), blocked_by="late")),
        criterion("late", Says(Fraction(0))),
        criterion("behind", Says(Fraction(0), blocked_by="late")),
        criterion("fine", Says()),
        criterion("stands", Says(Fraction(0), blocked_by="fine")),
        criterion("unknown", Says(Fraction(0), blocked_by="nobody")),
    )
    assert given["early"].reason == given["behind"].reason == "not judged: needs late (not met)"
    assert given["early"].outcome is given["behind"].outcome is Outcome.BLOCKED
    assert given["stands"].outcome is given["unknown"].outcome is Outcome.NOT_MET
    assert given["stands"].reason == "found"


def test_two_findings_that_wait_for_each_other_are_not_both_blocked() -> None:
    """One of them must name the cause."""
    given = judged(criterion("a", Says(Fraction(0), blocked_by="b")), criterion("b", Says(Fraction(0), blocked_by="a")))
    assert [v.outcome for v in given.values()] == [Outcome.NOT_MET, Outcome.BLOCKED]


def test_a_finding_can_name_the_kind_of_check_that_blocks_it() -> None:
    """A check does not know the ids of a rubric: the first check of that kind in the scenario is meant."""
    rate = CHECKS["topic_rate"]("/temperature", 5.0, 0.25, 10 * SECOND)
    spread = CHECKS["random_in_range"]("/temperature", 20, 30)
    given = judged(criterion("pace", rate), criterion("range", spread))
    assert given["range"].reason == "not judged: needs pace (not met)"
    assert judged(criterion("range", spread))["range"].outcome is Outcome.NOT_MET


def test_the_kind_of_check_that_blocks_may_ask_about_another_scenario_of_the_same_files() -> None:
    """A client that stops calling in one scenario also stops in the other: it is reported once."""
    rate = CHECKS["topic_rate"]("/temperature", 5.0, 0.25, 10 * SECOND)
    scenarios = tuple(Scenario(name, files, Span(SECOND)) for name, files in (("a", (FILE,)), ("b", (FILE,))))
    criteria = (criterion("pace", rate, scenario="a"), criterion("late", Says(Fraction(0), "topic_rate"), scenario="b"))
    traces = {"a": Recording().trace(), "b": Recording().trace()}
    report = judge_exercise(exercise(*criteria, scenarios=scenarios), traces, handed_in(FILE))
    assert outcomes(report) == {"pace": "not_met", "late": "blocked"}
    others = (scenarios[0], Scenario("b", (FILE, ODOM), Span(SECOND)))
    report = judge_exercise(exercise(*criteria, files=(FILE, ODOM), scenarios=others), traces, handed_in(FILE, ODOM))
    assert outcomes(report) == {"pace": "not_met", "late": "not_met"}


def test_a_failed_recording_leaves_everything_undecided() -> None:
    """Our fault costs no points and is not a zero either; what needs it is undecided too."""
    given = judged(criterion("a", Says()), criterion("b", Says(), "a"), harness_problem="the worker died")
    assert {v.outcome for v in given.values()} == {Outcome.UNDECIDED}
    assert given["a"].reason == "the worker died"
    assert not given["a"].suspected
    assert judged(criterion("a", Says()), harness_problem="the worker died", suspected=True)["a"].suspected
    report = judge_exercise(exercise(criterion("a", Says())), {}, handed_in(FILE))
    assert outcomes(report) == {"a": "undecided"}
    assert "alone was not recorded" in report.verdicts[0].reason


@pytest.mark.parametrize(
    ("rate", "starved_s", "outcome"),
    [(18.8, 0, "not_met"), (18.8, 0.2, "not_met"), (18.8, 1.2, "undecided"), (10, 1.2, "not_met"), (20, 1.2, "met")],
    ids=["idle machine", "ordinary wait", "slowed by the machine", "too slow anyway", "right anyway"],
)
def test_a_rate_that_a_busy_machine_can_have_lowered_is_undecided(rate: float, starved_s: float, outcome: str) -> None:
    """A loop that pauses after its work is slower by the time that it waits for a processor."""
    trace = replace(velocity(rate, 10.0).trace(most_starved_ns=round(starved_s * SECOND)), clock=ClockKind.WALL)
    asked = criterion("rate", CHECKS["topic_rate"]("/cmd_vel", 20.0, 1.0))
    given = judge_exercise(exercise(asked), {"alone": trace}, handed_in(FILE))
    assert outcomes(given) == {"rate": outcome}
    if outcome == "undecided":
        assert given.verdicts[0].reason == (
            "the machine was too busy: the nodes waited 1.2 s of 10.0 s for a processor, which may be the reason"
        )


@pytest.mark.parametrize(("rate", "outcome"), [(18.9, "undecided"), (17.0, "not_met"), (19.2, "met")])
def test_a_rate_that_work_on_a_busy_machine_has_lowered_is_undecided(rate: float, outcome: str) -> None:
    """Where virtual time counts the work, however little an idle machine may need less for it."""
    trace = velocity(rate, 10.0).trace(most_starved_ns=round(0.2 * SECOND))
    asked = criterion("rate", CHECKS["topic_rate"]("/cmd_vel", 20.0, 1.0))
    given = judge_exercise(exercise(asked), {"alone": trace}, handed_in(FILE))
    assert outcomes(given) == {"rate": outcome}
    if outcome == "undecided":
        assert given.verdicts[0].reason == (
            "the machine was too busy: an idle one may need 0.2 s of 10.0 s less for the nodes' work, "
            "which may be the reason"
        )


@dataclass(frozen=True)
class StartsEarly:
    """An author's own check: the first message comes within half a second."""

    def judge(self, trace: Trace) -> Finding:
        return Finding(Fraction(trace.messages("/cmd_vel")[0].t_ns <= SECOND // 2), "found")


@dataclass(frozen=True)
class AnswersSoon:
    """An author's own check: each input is answered within a quarter of a second."""

    def judge(self, trace: Trace) -> Finding:
        pairs = zip(trace.deliveries("/in"), trace.messages("/out"), strict=True)
        return Finding(Fraction(all(0 <= out.t_ns - given.t_ns <= SECOND // 4 for given, out in pairs)), "found")


@pytest.mark.parametrize(
    ("late_s", "waited_s", "outcome"),
    [(0.7, 0.0, "not_met"), (0.7, 0.1, "not_met"), (0.7, 0.5, "undecided"), (0.9, 0.3, "not_met"), (0.3, 0.5, "met")],
    ids=["idle machine", "hardly waited", "late by the machine", "late anyway", "right anyway"],
)
def test_what_a_busy_machine_can_have_delayed_is_undecided_for_every_check(
    late_s: float, waited_s: float, outcome: str
) -> None:
    """A delay passes through several threads, each of which waits: their waits together bound it."""
    waits: dict[str, Any] = {
        "most_starved_ns": SECOND // 10 if waited_s else 0,
        "all_starved_ns": round(waited_s * SECOND),
    }
    first = TraceBuilder(FILE, stop_s=2.0).messages("/cmd_vel", TWIST, {}, rate_hz=10, start_s=late_s)
    answers = TraceBuilder(FILE, stop_s=2.0)
    for at_s in (0.0, 1.0):
        answers.delivery(at_s, "/in", "std_msgs/msg/Float32", {"data": at_s})
    answers.message(0.1, "/out", "std_msgs/msg/Float32", {"data": 0.0})
    answers.message(1.0 + late_s - 0.25, "/out", "std_msgs/msg/Float32", {"data": 1.0})
    for check, made in ((StartsEarly(), first), (AnswersSoon(), answers)):
        trace = replace(made.trace(), clock=ClockKind.WALL, **waits)
        given = judge_exercise(exercise(criterion("own", check)), {"alone": trace}, handed_in(FILE))
        assert outcomes(given) == {"own": outcome}


@pytest.mark.parametrize(
    ("every", "waited_s", "outcome"),
    [(10, 0.0, "not_met"), (10, 1.2, "undecided"), (12, 1.2, "not_met")],
    ids=["idle machine", "logged late", "wrong anyway"],
)
def test_a_log_that_a_busy_machine_can_have_delayed_is_undecided(every: int, waited_s: float, outcome: str) -> None:
    """A loop that was held up between a message and its log sends the next messages at once, to catch up."""
    builder = TraceBuilder(FILE, stop_s=10.0)
    logs_s = []
    for n in range(100):
        builder.message(0.31 if n in (1, 2) else 0.1 * n, "/joint_commands", "std_msgs/msg/Float64", {"data": 0.5})
        logs_s += [0.3 if n == 0 else 0.1 * n] if n % every == 0 else []
    for t_s in logs_s:
        builder.log(t_s, "angle")
    waits: dict[str, Any] = dict.fromkeys(("most_starved_ns", "all_starved_ns"), round(waited_s * SECOND))
    trace = replace(builder.trace(), clock=ClockKind.WALL, **waits)
    asked = criterion("logs", CHECKS["logs_every"](FILE, "/joint_commands", 10))
    assert outcomes(judge_exercise(exercise(asked), {"alone": trace}, handed_in(FILE))) == {"logs": outcome}


def test_a_check_without_a_result_leaves_the_points_and_is_not_final() -> None:
    """What was recorded in virtual time counts so far."""
    trace = velocity(20.0, 10.0).trace(unchecked="the machine was too busy for a check")
    asked = criterion("rate", CHECKS["topic_rate"]("/cmd_vel", 20.0, 1.0))
    given = judge_exercise(exercise(asked), {"alone": trace}, handed_in(FILE))
    assert (outcomes(given), given.unchecked) == ({"rate": "met"}, "the machine was too busy for a check")


@pytest.mark.parametrize(
    ("clock", "rate", "late_s", "outcome"),
    [
        (ClockKind.WALL, 10.0, 0.198, "undecided"),
        (ClockKind.VIRTUAL, 10.0, 0.198, "not_met"),
        (ClockKind.WALL, 10.6, 0.0, "not_met"),
        (ClockKind.WALL, 10.6, 0.05, "not_met"),
        (ClockKind.WALL, 10.0, 0.05, "met"),
    ],
    ids=["held back", "virtual time", "too fast", "too fast and held back", "right anyway"],
)
def test_a_rate_that_a_late_discovery_can_have_raised_is_undecided(
    clock: ClockKind, rate: float, late_s: float, outcome: str
) -> None:
    """On the wall clock the first message waits for the grader's subscription, and the second one follows at once."""
    times_s = [n / rate for n in range(30)]
    held = next(n for n, t_s in enumerate(times_s) if t_s >= late_s)  # a timer leaves out what is past
    times_s = [late_s, *(t_s for t_s in times_s[held:] if t_s > late_s)]
    builder = TraceBuilder("a.py", stop_s=3.0)
    for t_s in times_s:
        builder.message(t_s, "/talk", "std_msgs/msg/Float64", {"data": 1.0})
    trace = replace(builder.trace(), clock=clock)
    asked = criterion("rate", CHECKS["topic_rate"]("/talk", 10.0, 0.3))
    given = judge_exercise(exercise(asked), {"alone": trace}, handed_in(FILE))
    assert outcomes(given) == {"rate": outcome}, given.verdicts[0].reason
    if outcome == "undecided":
        assert given.verdicts[0].reason.startswith("the machine was too busy: the first message had to wait")


def test_what_cannot_be_asked_waits_for_the_criterion_that_it_needs() -> None:
    """A server of the wrong type is never called: that is the student's mistake, not a failure of the machine."""
    given = judged(criterion("a", Says(Fraction(0))), criterion("b", Raises(), "a"))
    assert [v.outcome.value for v in given.values()] == ["not_met", "blocked"]
    assert given["b"].reason == "not judged: needs a (not met)"


def test_what_needs_an_undecided_criterion_is_undecided() -> None:
    """It is unknown whether it could have been judged."""
    given = judged(criterion("a", Raises()), criterion("b", Says(), "a"), criterion("c", Says()))
    assert [v.outcome.value for v in given.values()] == ["undecided", "undecided", "met"]
    assert given["b"].reason == "not judged: needs a (undecided)"


def test_a_check_that_raises_is_undecided() -> None:
    """The reason names the check, the evidence the error; the others are judged."""
    verdict = judged(criterion("a", Raises()))["a"]
    assert "Raises" in verdict.reason
    assert "ZeroDivisionError" not in verdict.reason
    assert verdict.evidence == {"error": "ZeroDivisionError: secret thing"}
    assert judged(criterion("a", Says(Fraction(2))))["a"].outcome is Outcome.UNDECIDED


def test_a_missing_file_costs_one_line() -> None:
    """The first criterion names the file looked for and the one found, the others are blocked by it."""
    ex = exercise(criterion("a", Says()), criterion("b", Says(), "a"), criterion("c", Says()))
    report = judge_exercise(ex, {}, handed_in(missing={FILE: ("velocitypublisher.py",)}))
    assert outcomes(report) == {"a": "not_met", "b": "blocked", "c": "blocked"}
    first, second, third = report.verdicts
    assert first.reason == "velocity_publisher.py: not in the submission; found velocitypublisher.py instead"
    assert first.hint == "rename velocitypublisher.py to velocity_publisher.py"
    assert second.reason == third.reason == "not judged: needs velocity_publisher.py, which is missing"
    assert [(v.blocked_by, v.missing_file) for v in report.verdicts] == [("", FILE), ("a", FILE), ("a", FILE)]
    assert report.score == 0


@pytest.mark.parametrize(
    ("candidates", "likely", "hint"),
    [
        (("velocity_pub.py", "a.py"), True, "if velocity_pub.py is your solution, rename it to velocity_publisher.py"),
        (("a.py",), False, "hand in a file named velocity_publisher.py"),
    ],
)
def test_a_missing_file_names_every_python_file_that_was_found(
    candidates: tuple[str, ...], likely: bool, hint: str
) -> None:
    """Only a file that resembles the wanted one is proposed as the solution."""
    found = StudentFile(FILE, None, candidates=candidates, likely=likely)
    submission = replace(handed_in(missing={FILE: ()}), files={FILE: found})
    (verdict,) = judge_exercise(exercise(criterion("a", Says())), {}, submission).verdicts
    assert verdict.reason == f"velocity_publisher.py: not in the submission; found {', '.join(candidates)}"
    assert verdict.hint == hint


def test_one_missing_file_of_two_leaves_the_other_judged() -> None:
    """The controller's scenario runs without the sensor; the common one does not."""
    files = ("sensor.py", "fan.py")
    span = Span(10 * SECOND)
    scenarios = (
        Scenario("s", files[:1], span),
        Scenario("f", files[1:], span),
        Scenario("both", files, span),
    )
    ex = exercise(
        criterion("rate", Says(), scenario="s"),
        criterion("fan", Says(), scenario="f"),
        criterion("together", Says(), scenario="both"),
        files=files,
        scenarios=scenarios,
    )
    traces = {"f": Recording().trace("f")}
    report = judge_exercise(ex, traces, handed_in("fan.py", missing={"sensor.py": ()}))
    assert outcomes(report) == {"rate": "not_met", "fan": "met", "together": "blocked"}
    report = judge_exercise(ex, {}, handed_in(missing={"sensor.py": (), "fan.py": ()}))
    assert outcomes(report) == {"rate": "not_met", "fan": "not_met", "together": "blocked"}


EXERCISE_1 = exercise(
    criterion("publishes_twist", CHECKS["publishes"]("/cmd_vel", TWIST)),
    criterion("rate", CHECKS["topic_rate"]("/cmd_vel", 20.0, 1.0, 10 * SECOND, 2.0), "publishes_twist", points="10"),
    criterion("linear", CHECKS["field_values"]("/cmd_vel", {"linear.x": 0.5}), "publishes_twist", points="5"),
    criterion("logging", CHECKS["uses_logger"](FILE), points="4"),
)


def graded_1(rec: Recording) -> ExerciseReport:
    return judge_exercise(EXERCISE_1, {"alone": rec.trace()}, handed_in(FILE))


def test_a_right_node_gets_everything() -> None:
    """From the table of checks to the sum."""
    report = graded_1(velocity().log(0.0, "started"))
    assert set(outcomes(report).values()) == {"met"}
    assert report.score == report.max_score == 25


@pytest.mark.parametrize(
    ("kind", "text", "said"),
    [
        (
            FaultKind.SYNTAX_ERROR,
            "SyntaxError: invalid syntax (Python 3.11)",
            "velocity_publisher.py:12: SyntaxError: invalid syntax (Python 3.11); the file cannot run",
        ),
        (FaultKind.EXCEPTION, "NameError: name 'Twist' is not defined", "velocity_publisher.py:12: NameError"),
        (FaultKind.HUNG, "the constructor did not return", "velocity_publisher.py:12: the constructor did not return"),
        (FaultKind.EXITED, "exited with code 3", "velocity_publisher.py exited after 0.0 s with code 3"),
    ],
)
def test_a_file_that_cannot_start_costs_one_line(kind: FaultKind, text: str, said: str) -> None:
    """One cause, one red line, with its place; the rest is blocked by it."""
    code = 3 if kind is FaultKind.EXITED else None
    report = graded_1(Recording(0.0, process=FILE).fault(0.0, kind, text, 12, exit_code=code))
    assert outcomes(report) == {
        "publishes_twist": "not_met",
        "rate": "blocked",
        "linear": "blocked",
        "logging": "blocked",
    }
    first = report.verdicts[0]
    assert said in first.reason
    assert first.location == Location(FILE, 12)
    assert report.verdicts[3].reason == "not judged: needs publishes_twist (not met)"
    assert [(f.kind, f.line, f.scenario) for f in report.faults] == [(kind.value, 12, "alone")]


@pytest.mark.parametrize(
    ("module", "hint"),
    [
        ("cv2", "pip install './rclpy-grader[opencv]'"),
        ("matplotlib", "'./rclpy-grader[plots]'"),
        ("tf2_kdl", "tf2_kdl is"),
    ],
)
def test_what_a_desktop_of_ros_has_costs_nothing_where_it_is_not_installed(module: str, hint: str) -> None:
    """The criteria are undecided, with what to install."""
    rec = Recording(0.0, process=FILE)
    rec.fault(0.0, FaultKind.EXCEPTION, f"ModuleNotFoundError: No module named '{module}'", 1)
    sources = {FILE: f"import {module}\n"}
    verdicts = judge_exercise(EXERCISE_1, {"alone": rec.trace()}, handed_in(FILE), sources).verdicts
    assert {v.outcome for v in verdicts} == {Outcome.UNDECIDED}
    assert module in verdicts[0].reason
    assert hint in verdicts[0].hint


@pytest.mark.parametrize(
    ("text", "lack"),
    [
        ("ImportError: cannot import name 'BufferClient' from 'tf2_ros' (tf2_ros/__init__.py)", "tf2_ros.BufferClient"),
        ("ModuleNotFoundError: No module named 'tf2_ros.buffer_client'", "tf2_ros.buffer_client"),
        ("AttributeError: module 'tf_transformations' has no attribute 'Arcball'", "tf_transformations.Arcball"),
        ("ModuleNotFoundError: No module named 'nav2_msgs.msg'", "nav2_msgs"),
        ("ImportError: cannot import name 'BufferServant' from 'tf2_ros' (tf2_ros/__init__.py)", ""),
        ("ModuleNotFoundError: No module named 'tf2_ros.bufer'", ""),
        ("AttributeError: module 'tf_transformations' has no attribute 'euler_to_quaternion'", ""),
    ],
)
def test_what_a_lent_package_lacks_is_told_from_a_slip(text: str, lack: str) -> None:
    """In a file of its own, and in a node of a launch file."""
    sources = {FILE: "import tf2_ros, tf_transformations, nav2_msgs\n"}
    rec = Recording(0.0, process=FILE)
    rec.fault(0.0, FaultKind.EXCEPTION, text, 1)
    trace = rec.trace()
    for processes in ((FILE,), ("robot.launch.py",)):
        found = lacking_package(trace, processes, sources)
        assert (found.name if found is not None else "") == lack
    assert lacking_package(trace, ("another.py",), sources) is None


def test_what_was_earned_before_a_crash_stays() -> None:
    """A log record before an exception in the constructor counts."""
    report = graded_1(Recording(5.0, process=FILE).log(0.0, "starting").crashed(0.0, "TypeError: no"))
    assert outcomes(report)["logging"] == "met"
    assert outcomes(report)["publishes_twist"] == "not_met"


def test_a_fault_that_ends_a_running_node_costs_one_line() -> None:
    """A crash at 5 s costs the rate; the log that never came is the same cause."""
    rec = velocity(stop_s=5.05).crashed(5.05)
    rec.stop_s = 10.05
    report = graded_1(rec)
    assert outcomes(report) == {"publishes_twist": "met", "rate": "not_met", "linear": "met", "logging": "blocked"}
    assert report.verdicts[1].location == Location(FILE, 12)


EXERCISE_2 = exercise(
    criterion("subscribes_odom", CHECKS["subscribes"]("/odom", ODOMETRY)),
    criterion("logs_position", known_checks()["logs_position"](ODOM, "/odom"), "subscribes_odom", points="10"),
    criterion("log_period", known_checks()["log_period"](ODOM, "/odom", SECOND), "subscribes_odom"),
    criterion("waits_gracefully", CHECKS["waits_gracefully"](ODOM, "/odom", 5 * SECOND), "subscribes_odom", points="8"),
    files=(ODOM,),
)


def graded_2(rec: Recording) -> dict[str, str]:
    return outcomes(judge_exercise(EXERCISE_2, {"alone": rec.trace()}, handed_in(ODOM)))


@pytest.mark.parametrize(
    ("rec", "position", "period", "waits"),
    [
        (position_logs(plain), "met", "met", "met"),
        (position_logs(plain, printed=True), "partly", "met", "met"),
        (position_logs(lambda x, y: plain(y, x)), "not_met", "met", "met"),
        (position_logs(plain, [6.0, 6.5, 7.0, 7.5, 8.0]), "met", "not_met", "met"),
        (driving(), "not_met", "blocked", "blocked"),
        (position_logs(lambda x, y: "got it"), "not_met", "blocked", "met"),
        (driving().crashed(1.0, "AttributeError: 'NoneType' ..."), "blocked", "blocked", "not_met"),
        (driving().crashed(5.0, "AttributeError: no position"), "not_met", "blocked", "blocked"),
        (position_logs(plain).log(1.0, "no data", "ERROR"), "met", "met", "not_met"),
        (position_logs(plain, [6.0, 7.0, 8.0]).exited(8.5), "met", "not_met", "blocked"),
    ],
)
def test_each_fault_of_a_subscriber_turns_its_criterion(rec: Recording, position: str, period: str, waits: str) -> None:
    """One cause gives one criterion that is not met, and blocked ones."""
    expected = {"logs_position": position, "log_period": period, "waits_gracefully": waits}
    assert graded_2(rec) == {"subscribes_odom": "met", **expected}


def test_a_subscriber_that_does_not_subscribe_is_blocked_throughout() -> None:
    """Everything else needs the subscription."""
    rec = position_logs(plain)
    rec.items = [o for o in rec.items if type(o).__name__ != "GraphSnapshot"]
    assert list(graded_2(rec).values()) == ["not_met", "blocked", "blocked", "blocked"]


def test_the_same_fault_in_two_scenarios_is_one_cause() -> None:
    """It is listed once and costs one line."""
    files = ("sensor.py", "fan.py")
    scenarios = (Scenario("s", files[:1], Span(SECOND)), Scenario("both", files, Span(SECOND)))
    ex = exercise(
        criterion("rate", CHECKS["topic_rate"]("/t", 5.0, 1.0, SECOND), scenario="s"),
        criterion("together", known_checks()["answers_together"]("/t", "/f", 25, 100, 0), scenario="both"),
        files=files,
        scenarios=scenarios,
    )
    alone = Recording(process="sensor.py").endpoint("publisher", "/t").crashed(1.0).trace("s")
    both = Recording(process="sensor.py").endpoint("publisher", "/t").crashed(1.2).trace("both")
    report = judge_exercise(ex, {"s": alone, "both": both}, handed_in(*files))
    assert outcomes(report) == {"rate": "not_met", "together": "blocked"}
    assert [(f.scenario, f.t_ns) for f in report.faults] == [("s", SECOND)]


def test_two_files_that_cannot_start_are_two_causes() -> None:
    """Each is named once."""
    files = ("sensor.py", "fan.py")
    scenarios = (Scenario("s", files[:1], Span(SECOND)), Scenario("f", files[1:], Span(SECOND)))
    ex = exercise(
        criterion("rate", CHECKS["topic_rate"]("/t", 5.0, 1.0, SECOND), scenario="s"),
        criterion("on", known_checks()["threshold_response"]("/t", "/f", 25, 100, 0, "above"), scenario="f"),
        criterion("off", known_checks()["threshold_response"]("/t", "/f", 25, 100, 0, "at_or_below"), scenario="f"),
        files=files,
        scenarios=scenarios,
    )
    bad = "SyntaxError: invalid syntax"
    traces = {
        "s": Recording(0.0).fault(0.0, FaultKind.SYNTAX_ERROR, bad, 3, "sensor.py").trace("s"),
        "f": Recording(0.0).fault(0.0, FaultKind.SYNTAX_ERROR, bad, 3, "fan.py").trace("f"),
    }
    report = judge_exercise(ex, traces, handed_in(*files))
    assert outcomes(report) == {"rate": "not_met", "on": "not_met", "off": "blocked"}


def test_the_wall_clock_of_one_scenario_is_the_reports() -> None:
    """With its reason; notes are told once."""
    rec = Recording(clock=ClockKind.WALL)
    trace = rec.trace(clock_reason="two threads", notes=("a note", "a note", "another"))
    report = judge_exercise(exercise(criterion("a", Says())), {"alone": trace}, handed_in(FILE))
    assert (report.clock, report.clock_reason) == (ClockKind.WALL, "two threads")
    assert report.notes == ("a note", "another")


def test_the_graph_is_the_fullest_of_the_common_scenario() -> None:
    """Later snapshots, when nodes are going, do not count."""
    rec = Recording().endpoint("publisher", "/t").endpoint("subscription", "/t", node="/b", participant=2, t_s=1.0)
    rec.snapshot(9.0, rec.ends[:1])
    report = judge_exercise(exercise(criterion("a", Says())), {"alone": rec.trace()}, handed_in(FILE))
    assert report.graph is not None
    assert report.graph.t_ns == SECOND
    assert judge_exercise(exercise(), {}, handed_in(FILE)).graph is None


def test_the_same_trace_gives_the_same_report() -> None:
    """Judging is a function."""
    rec = velocity(18.5).line(1.0, "x")
    assert graded_1(rec) == graded_1(rec)
