"""Hint rules of a rubric's own: read like its checks, asked in the order of priorities, tried without a node."""

from __future__ import annotations

import pickle
from pathlib import Path
from typing import Any

import pytest
from own_check_samples import CHECKS_FILE, RUBRIC, write_rubric

from grader.course.classroom.sending import checks_of
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.diagnosis import RULES, rules_of
from grader.grading.judging.diagnosis.rules import FIRST, Clue, Rule
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Location, Outcome
from grader.grading.model.report import ExerciseReport
from grader.grading.rubrics.loader import read_rubric, side_files
from grader.runtime.model.errors import RubricError
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace
from grader.testing import TraceBuilder, explain

FLOAT = "std_msgs/msg/Float32"
PUMP = 'node = rclpy.create_node("pump")\nnode.create_timer(1.0, tick)\n'
WITH_HINTS = RUBRIC.replace("checks: [pump_checks.py]", "checks: [pump_checks.py]\nhints: [pump_hints.py]")
HINTS = '''\
"""Mistakes with pumps."""

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import made, number_in_code


@hint_rule("starts_early")
def slow_pump(case: Case) -> Clue | None:
    """The period of the timer is longer than the pump may take."""
    for timer in made(case.source, "timer"):
        period = number_in_code(case.source, timer.period)
        if period is not None and period * 1e9 > case.check.within:
            return Clue(f"{case.source.code(timer.call)} waits {period:g} s", case.source.place(timer.call))
    return None
'''


def write(folder: Path, hints: str = HINTS, rubric: str = WITH_HINTS) -> Path:
    (folder / "pump_hints.py").write_text(hints, encoding="utf-8")
    return write_rubric(folder, rubric)


def late(start_s: float = 1.0) -> AssessedTrace:
    trace = TraceBuilder("pump.py", stop_s=2.0).messages("/flow", FLOAT, {"data": 1.5}, rate_hz=1, start_s=start_s)
    return trace.trace()


def report(path: Path, trace: AssessedTrace | None = None, source: str = PUMP) -> ExerciseReport:
    submission = Submission("s", "s", Path("s"), "sha256:1", {"pump.py": StudentFile("pump.py", "pump.py")})
    return judge_exercise(read_rubric(path), {"alone": trace or late()}, submission, {"pump.py": source})


def test_a_rule_names_line_and_cause(tmp_path: Path) -> None:
    """It beats the hint of the rubric, and the report names it."""
    (found,) = report(write(tmp_path)).verdicts
    assert found.hint == "node.create_timer(1.0, tick) waits 1 s"
    assert found.location == Location("pump.py", 2)
    assert found.evidence["diagnosis"] == "slow_pump"
    (other,) = report(write(tmp_path), source="").verdicts
    assert other.hint == "start at once"


def test_a_rule_for_another_check_is_not_asked(tmp_path: Path) -> None:
    """It says itself which checks it explains."""
    (found,) = report(write(tmp_path, HINTS.replace('"starts_early"', '"topic_rate"'))).verdicts
    assert found.hint == "start at once"


def test_rules_are_asked_in_the_order_of_their_priorities(tmp_path: Path) -> None:
    """Those of a rubric come before all but two, unless they say otherwise; of equal ones, those of the rubric."""
    last = RULES[-1].priority
    more = (
        f"\n\n@hint_rule(priority={last})\ndef as_late(case: Case) -> Clue | None:\n    return Clue('no')\n"
        "\n\n@hint_rule('starts_early', priority=7)\ndef earliest(case: Case) -> Clue | None:\n    return None\n"
        f"\n\n@hint_rule(priority={last + 1})\ndef latest(case: Case) -> Clue | None:\n    return Clue('no')\n"
    )
    ids = [rule.id for rule in rules_of(read_rubric(write(tmp_path, HINTS + more)))]
    early = [rule.id for rule in RULES if rule.priority < FIRST]
    known = [rule.id for rule in RULES[len(early) :]]
    assert ids == ["earliest", *early, "slow_pump", *known[:-1], "as_late", known[-1], "latest"]
    assert next(iter(read_rubric(tmp_path / "pump.yaml").hints)).priority == FIRST
    assert rules_of(read_rubric(write_rubric(tmp_path))) is RULES


def test_a_rule_travels_with_its_rubric(tmp_path: Path) -> None:
    """To another process, to a cluster, and into the digest."""
    path = write(tmp_path)
    exercise = read_rubric(path)
    (rule,) = pickle.loads(pickle.dumps(exercise)).hints
    assert (rule.id, rule.checks, rule.priority) == ("slow_pump", ("starts_early",), FIRST)
    assert {name.rsplit(b"/")[-1] for name, _ in checks_of([path])} == {b"pump_checks.py", b"pump_hints.py"}
    assert [file.name for file in side_files(path)] == ["pump_checks.py", "pump_hints.py"]
    write(tmp_path, HINTS + "\n# another thought\n")
    assert read_rubric(path).digest != exercise.digest


def test_one_file_may_hold_checks_and_rules(tmp_path: Path) -> None:
    """Then a rule can name the class of a check, and its facts."""
    both = CHECKS_FILE.replace(
        "from grader.grading.model.exercise",
        "from grader.api import Clue, hint_rule\nfrom grader.grading.model.exercise",
    )
    both += "\n\n@hint_rule(StartsEarly)\ndef slow(case):\n    return Clue(str(case.check.within))\n"
    (found,) = report(write_rubric(tmp_path, WITH_HINTS.replace("pump_hints.py", "pump_checks.py"), both)).verdicts
    assert found.hint == "500000000"
    assert len(side_files(tmp_path / "pump.yaml")) == 1


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        (
            '"starts_early"',
            '"starts_erly"',
            "7: `slow_pump`: expected the name of a check, found `starts_erly`; did you",
        ),
        ('@hint_rule("starts_early")\n', "", "1: expected hint rules, which are functions with @hint_rule(...)"),
        (
            '@hint_rule("starts_early")',
            "@hint_rule",
            "7: expected a file that can be imported, found TypeError: expected",
        ),
        ('"starts_early"', "priority='x'", "7: `slow_pump`: expected a whole number as priority, found 'x'"),
        ('"starts_early"', "problem='silent'", "7: `slow_pump`: expected a ProblemKind as problem, found 'silent'"),
        ('"starts_early"', "outcome=1", "7: `slow_pump`: expected an Outcome as outcome, found 1"),
        ('"starts_early"', "fault='no'", "7: `slow_pump`: expected True, False or None as fault, found 'no'"),
        ("(case: Case)", "()", "7: `slow_pump`: expected a function of one argument, the case, found another one"),
        ("def slow_pump", "def never_called", "7: `never_called`: expected a new name, found one that is taken"),
        (
            "from grader.api",
            "from grader.nothing",
            "3: expected a file that can be imported, found ModuleNotFoundError",
        ),
        ("made, number_in_code", "made, nothing_such", "4: expected a file that can be imported, found ImportError"),
        ("    for timer", "    for timer for", "10: expected a file that can be imported, found SyntaxError"),
    ],
)
def test_a_mistake_in_a_file_of_rules_is_told_with_its_place(tmp_path: Path, old: str, new: str, told: str) -> None:
    """Before anything is graded."""
    with pytest.raises(RubricError) as error:
        read_rubric(write(tmp_path, HINTS.replace(old, new, 1)))
    assert f"{tmp_path}/pump_hints.py:{told}" in error.value.message


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("pump_hints.py", "../pump_hints.py", "5:9: expected a Python file in the rubric's folder"),
        ("pump_hints.py", "other.py", "hints: other.py: expected a file beside the rubric, found nothing there"),
        ("[pump_hints.py]", "pump_hints.py", "5:8: expected a list"),
    ],
)
def test_a_mistake_in_the_rubric_is_told_with_its_place(tmp_path: Path, old: str, new: str, told: str) -> None:
    """As for files of checks."""
    with pytest.raises(RubricError) as error:
        read_rubric(write(tmp_path, rubric=WITH_HINTS.replace(old, new)))
    assert told in error.value.message


def test_rules_are_never_taken_from_students(tmp_path: Path) -> None:
    """They run where marks are made."""
    with pytest.raises(RubricError, match="expected a file that students cannot write"):
        read_rubric(write(tmp_path), submissions=[tmp_path])


@pytest.mark.parametrize(
    ("body", "told"),
    [
        ("return 1 / 0", "pump_hints.py:10: the rule slow_pump: ZeroDivisionError: division by zero"),
        ("return 'x'", "pump_hints.py: the rule slow_pump: TypeError: expected a Clue or None, found a str"),
        ("return Clue(1)", "pump_hints.py: the rule slow_pump: TypeError: expected a clue with a string as hint"),
        ("return Clue('x', 3)", "pump_hints.py: the rule slow_pump: TypeError: expected a clue with a Location"),
        ("return Clue('')", "pump_hints.py: the rule slow_pump: TypeError: expected a clue with a hint"),
        ("return Clue('x', same_as='y')", "TypeError: expected the id of an earlier criterion that was not met"),
    ],
)
def test_a_rule_that_fails_costs_only_its_hint(tmp_path: Path, body: str, told: str) -> None:
    """The points stay, and a note tells the author where the mistake is."""
    hints = HINTS.partition("    for timer")[0] + f"    {body}\n"
    found = report(write(tmp_path, hints))
    assert (found.verdicts[0].outcome, found.verdicts[0].hint) == (Outcome.NOT_MET, "start at once")
    (note,) = (note for note in found.notes if "mistake" in note)
    assert note.startswith("the rubric has a mistake: pump_hints.py")
    assert told in note


def rule_of(path: Path) -> tuple[Rule, Any]:
    exercise: Any = read_rubric(path)
    return next(iter(exercise.hints)), exercise.criteria[0].check


def test_a_rule_is_tried_without_a_node(tmp_path: Path) -> None:
    """On a trace that is built by hand, and the text of a file."""
    rule, check = rule_of(write(tmp_path))
    clue = explain(rule, check, late(), {"pump.py": PUMP})
    assert clue == Clue("node.create_timer(1.0, tick) waits 1 s", Location("pump.py", 2))
    assert explain(rule, check, late(0.1), {"pump.py": PUMP}) is None
    assert explain(rule, CHECKS["topic_rate"]("/flow", 20.0, 1.0), late(), {"pump.py": PUMP}) is None


def test_trying_a_rule_refuses_what_cannot_be_reported(tmp_path: Path) -> None:
    """As grading does."""
    rule, check = rule_of(write(tmp_path, HINTS.partition("    for timer")[0] + "    return Clue('')\n"))
    with pytest.raises(ValueError, match="the rule slow_pump: expected a clue with a hint, found an empty one"):
        explain(rule, check, late(), {"pump.py": PUMP})
