"""Mistakes of a rubric's author in checks and simulations: told as that, with their place, and the report is made."""

from __future__ import annotations

import json
import subprocess
from dataclasses import replace
from fractions import Fraction
from pathlib import Path

import numpy as np
import pytest
from own_check_samples import CHECKS_FILE, PUMP, RUBRIC, write_rubric
from places import GRADE

from grader.course.classroom.gradebook import Gradebook, Row, Status
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.exercise import Finding, Location, Outcome
from grader.grading.model.report import Environment, ExerciseReport, Report, report_exit_code
from grader.grading.model.run import Run
from grader.grading.reporting import wording
from grader.grading.reporting.formats import FORMATS, PageLayout
from grader.grading.reporting.json_report import report_to_json
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.errors import UNUSABLE
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.recording.codec import trace_to_json
from grader.runtime.recording.packed import trace_from_json
from grader.testing import TraceBuilder, partly

RAISED = 'raise LookupError("nobody thought of silence")'
#: A second criterion, which the grader's own check judges, and a third that needs the first.
MORE = """\
  - {id: runs, title: Runs, points: 5, scenario: alone, check: {no_fault: {}}, hint: none}
  - {id: later, title: Later, points: 3, scenario: alone, check: {no_fault: {}}, hint: none, needs: [early]}
"""
ENVIRONMENT = Environment("1", "jazzy", "7", "rmw", "3.11", "none")


def report(folder: Path, checks: str, trace: AssessedTrace | None = None, rubric: str = RUBRIC + MORE) -> Report:
    """Judge a silent pump with a file of checks, and draw its pictures."""
    exercise = read_rubric(write_rubric(folder, rubric, checks))
    submission = Submission("s", "s", Path("s"), "sha256:1", {"pump.py": StudentFile("pump.py", "pump.py")})
    trace = trace or TraceBuilder("pump.py").trace()
    run = Run(submission, {("pump", "alone"): trace}, {"pump.py": "pass\n"}, ENVIRONMENT, 1)
    return judge_run([exercise], run)


def returning(text: str) -> str:
    """Return the file of checks with another statement for a silent pump."""
    given = "from grader.grading.model.exercise import Location, Problem\n\n"
    return CHECKS_FILE.replace(RAISED, text).replace(
        "from grader.runtime.model.trace", f"{given}from grader.runtime.model.trace"
    )


def assert_rendered(report: Report) -> None:
    """Every format shows the report; one only works on its platform."""
    for name, format_ in FORMATS.items():
        if "handed_in" not in format_.needs:
            assert format_(report, PageLayout(100, colour=False)), name


@pytest.mark.parametrize(
    ("credit", "exact"),
    [
        (0.25, Fraction(1, 4)),
        (0.1, Fraction(1, 10)),
        (0.7 + 0.2 + 0.1, Fraction(1)),
        (1 / 3, Fraction(1, 3)),
        (1.0000000000000002, Fraction(1)),
        (-1e-17, Fraction(0)),
        (1, Fraction(1)),
        (0, Fraction(0)),
        (np.float64(0.5), Fraction(1, 2)),
        (np.float32(0.5), Fraction(1, 2)),
        (np.int64(1), Fraction(1)),
        (Fraction(123456789, 987654321), Fraction(123456789, 987654321)),
    ],
)
def test_a_credit_may_be_any_number_from_0_to_1(credit: float, exact: Fraction) -> None:
    """A float becomes the simple fraction that was meant: a rounding error costs no point."""
    assert Finding(credit, "so far").credit == exact  # type: ignore[arg-type]
    assert partly("so far", credit=credit).credit == exact


@pytest.mark.parametrize("credit", [float("nan"), float("inf"), -0.01, 1.01, 2, Fraction(3, 2), np.nan])
def test_a_credit_beyond_the_range_is_refused(credit: float) -> None:
    """In the line that makes the finding."""
    with pytest.raises(ValueError, match="expected a credit from 0 to 1, found"):
        Finding(credit, "more")  # type: ignore[arg-type]


@pytest.mark.parametrize("credit", ["0.5", None, True, [1], 1j])
def test_a_credit_that_is_no_number_is_refused(credit: object) -> None:
    """A bool is none either."""
    with pytest.raises(TypeError, match="expected a credit from 0 to 1, found a "):
        Finding(credit, "more")  # type: ignore[arg-type]


@pytest.mark.parametrize(("file", "line"), [("pump.py", "3"), ("pump.py", None), (Path("pump.py"), 3), ("p.py", True)])
def test_a_location_has_a_name_and_a_number(file: object, line: object) -> None:
    """As the credit, it is checked where it is made."""
    with pytest.raises(TypeError, match="expected a file name and the number of a line, found"):
        Location(file, line)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        (RAISED, "pump_checks.py:31: LookupError: nobody thought of silence"),
        ("return undefined_name", "pump_checks.py:31: NameError: name 'undefined_name' is not defined"),
        ("return met(*range(9))", "pump_checks.py:31: TypeError: met() takes from 1 to 2 positional arguments but 9"),
        ("return Finding(1.5, '')", "pump_checks.py:31: ValueError: Finding: expected a credit from 0 to 1, found 1"),
        (
            "return Finding('1', '')",
            "pump_checks.py:31: TypeError: Finding: expected a credit from 0 to 1, found a",
        ),
        ("return Finding(float('nan'), '')", "pump_checks.py:31: ValueError: Finding: expected a credit"),
        (
            "return Finding(1, '', location=Location('pump.py', 'x'))",
            "pump_checks.py:31: TypeError: Location: exp",
        ),
        ("return Finding(0, '', location='pump.py:3')", "pump_checks.py:27: the check starts_early gave a location"),
        (
            "return Finding(0, '', location=Location('pump.py', -4))",
            "pump_checks.py:27: the check starts_early gave t",
        ),
        ("return Finding(0, '', problem=Problem('x'))", "pump_checks.py:27: the check starts_early gave a problem"),
        ("return Finding(0, '', {1: 2})", "pump_checks.py:27: the check starts_early gave evidence"),
        ("return Finding(0, None)", "pump_checks.py:27: the check starts_early gave a reason of type NoneType"),
        ("return True", "pump_checks.py:27: the check starts_early returned a bool, expected a Finding"),
        ("raise SystemExit(0)", "pump_checks.py:31: SystemExit: 0"),
        ("raise type('Quit', (BaseException,), {})('done')", "pump_checks.py:31: Quit: done"),
        ("return self.judge(trace)", "pump_checks.py:"),
        ("iter(int, 1)[0]", "pump_checks.py:31: TypeError: 'callable_iterator' object is not subscriptable"),
    ],
)
def test_a_mistake_in_a_check_is_the_authors_and_costs_no_report(tmp_path: Path, statement: str, told: str) -> None:
    """File and line are told once, what needs the criterion is undecided too, and all others are judged."""
    found = report(tmp_path, returning(statement))
    early, runs, later = found.exercises[0].verdicts
    assert (early.outcome, early.score, runs.outcome) == (Outcome.UNDECIDED, 0, Outcome.MET)
    assert early.reason.startswith(f"the rubric has a mistake: {told}")
    assert (later.outcome, later.blocked_by) == (Outcome.UNDECIDED, "early")
    assert report_exit_code(found, None) == report_exit_code(found, Fraction(10)) == UNUSABLE
    (warning,) = wording.warnings(found)
    assert told in warning
    assert "2 criteria are undecided and 13 points are still open" in warning
    assert_rendered(found)


def test_a_simulation_that_fails_is_the_authors_mistake_too(tmp_path: Path) -> None:
    """Its trace says so, also after it was kept as evidence."""
    mistake = AuthorMistake("world.py", 40, "the simulation `hall` failed: ZeroDivisionError: float division by zero")
    trace = AssessedTrace("alone", ClockKind.VIRTUAL, 0, (), author_mistake=mistake)
    assert trace_from_json(json.loads(json.dumps(trace_to_json(trace)))) == trace
    found = report(tmp_path, CHECKS_FILE, trace)
    assert {v.reason for v in found.exercises[0].verdicts[:2]} == {f"the rubric has a mistake: {mistake}"}
    assert report_exit_code(found, None) == UNUSABLE
    assert len(wording.warnings(found)) == 1


@pytest.mark.parametrize(
    ("member", "told"),
    [
        ("    expected = property(lambda self: 1 / 0)\n", "pump_checks.py:36: ZeroDivisionError"),
        (
            "    def drawing(self, trace):\n        return 1 / 0\n",
            "pump_checks.py:37: ZeroDivisionError",
        ),
        (
            "    def drawing(self, trace):\n        from grader.grading.model import chart\n"
            "        return chart.Chart(5)\n",
            "pump_checks.py:38: TypeError: Chart.__init__() ",
        ),
    ],
)
def test_a_mistake_in_what_a_check_shows_is_a_note(tmp_path: Path, member: str, told: str) -> None:
    """The criterion is judged, the report is made, and the author is told."""
    text = returning("return met('silent')").replace("\n\nCHECKS", f"\n{member}\n\nCHECKS")
    found = report(tmp_path, text)
    assert [verdict.outcome for verdict in found.exercises[0].verdicts] == [Outcome.MET] * 3
    assert [note[: len(told) + 26] for note in found.exercises[0].notes] == [f"the rubric has a mistake: {told}"]
    assert_rendered(found)


def test_a_class_tells_it_once(tmp_path: Path) -> None:
    """With the number of submissions that it concerns."""
    data = report_to_json(report(tmp_path, CHECKS_FILE))
    rows = [Row(name, name, None, Status.UNDECIDED, report=data) for name in ("ada", "bob")]
    found = Gradebook((*rows, Row("cleo", "cleo", None, Status.MISSING))).author_mistakes
    assert {mistake: [row.name for row in concerned] for mistake, concerned in found.items()} == {
        "pump_checks.py:29: LookupError: nobody thought of silence": ["ada", "bob"]
    }


WORLD = """\
from dataclasses import dataclass

from grader.runtime.simulation import Simulation


@dataclass
class Well(Simulation):
    \"\"\"A well.\"\"\"

    def publishes(self):
        return {"/level": "std_msgs/msg/Float32"}

    def step(self, now):
        yield "/level", {"data": 1.0 / (0 if now.t_s > 1 else 1)}


SIMULATIONS = {"well": Well}
"""
SCENARIOS = """\
  - id: alone
    processes: [pump.py]
    observe: {duration: 2 s}
  - id: well
    processes: [pump.py]
    observe: {duration: 2 s}
    stimuli:
      - simulation: {well: {}}
criteria:
  - {id: wet, title: Wet, points: 2, scenario: well, check: {no_fault: {}}, hint: none}
"""
FIELD = "1.0 / (0 if now.t_s > 1 else 1)}"


@pytest.mark.breadth(1, 2)
@pytest.mark.ros
@pytest.mark.parametrize(
    ("wrong", "told"),
    [
        (FIELD, "world.py:14: the simulation `well` failed: ZeroDivisionError"),
        (
            '1.0 if now.t_s < 1 else "much"}',
            "world.py:13: the simulation `well` failed in step(): /level: expected a",
        ),
        ("1.0} if now.t_s < 1 else 7", "world.py:13: the simulation `well` failed in step(): expected a map"),
        (
            '1.0, **({} if now.t_s < 1 else {"dat": 2})}',
            "world.py:13: the simulation `well` failed in step(): /lev",
        ),
    ],
)
def test_a_simulation_that_fails_later_costs_only_its_scenario(tmp_path: Path, wrong: str, told: str) -> None:
    """The command says whose mistake it is, with file and line, exit code 2, and judges everything else."""
    rubric = RUBRIC.replace(
        "  - id: alone\n    processes: [pump.py]\n    observe: {duration: 2 s}\ncriteria:\n", SCENARIOS
    ).replace("checks: [pump_checks.py]", "checks: [pump_checks.py]\nsimulations: [world.py]")
    (tmp_path / "world.py").write_text(WORLD.replace(FIELD, wrong), encoding="utf-8")
    path = write_rubric(tmp_path, rubric)
    (tmp_path / "pump").mkdir()
    (tmp_path / "pump" / "pump.py").write_text(PUMP.replace("PERIOD", "0.1"))
    done = subprocess.run(
        [GRADE, "pump", "--rubric", path.name, "--json"], cwd=path.parent, capture_output=True, text=True, check=False
    )
    assert done.returncode == UNUSABLE, done.stderr
    wet, early = json.loads(done.stdout)["exercises"][0]["criteria"]
    assert (wet["outcome"], early["outcome"]) == ("undecided", "met")
    assert wet["reason"].startswith(f"the rubric has a mistake: {told}")
    assert wet["evidence"]["author_mistake"]["file"] == "world.py"


def test_a_mistake_of_the_grader_in_its_own_check_is_not_the_authors(tmp_path: Path) -> None:
    """It is undecided, but the rubric is right."""
    found = report(tmp_path, returning("return met('silent')"))
    exercise = found.exercises[0]
    assert isinstance(exercise, ExerciseReport)
    undecided = replace(exercise.verdicts[1], outcome=Outcome.UNDECIDED, evidence={"error": "KeyError: x"})
    assert report_exit_code(replace(found, exercises=(replace(exercise, verdicts=(undecided,)),)), None) == 3
