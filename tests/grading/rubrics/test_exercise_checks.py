"""Checks of the exercises that come with the grader: any rubric may use them by name, with the hints about them."""

from __future__ import annotations

import hashlib
import pickle
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from archive import judged, recorded_of
from sample_folders import EXERCISES

from grader.grading.judging.checks import CHECKS
from grader.grading.judging.diagnosis.rules import Rule
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Exercise
from grader.grading.reporting.json_report import dumps
from grader.grading.rubrics.builtin import builtin_rubrics
from grader.grading.rubrics.exercise_checks import hints_of, known_checks
from grader.grading.rubrics.loader import read_rubric, side_files
from grader.grading.rubrics.own_checks import rubric_digest
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.recording.packed import unpack_trace
from grader.runtime.shipped import shipped

SHARED = {name: kind for name, kind in known_checks().items() if name not in CHECKS}
FAN = builtin_rubrics()["two_node_communication"]
#: A rubric of another course, with a check of exercise 3 and no file of its own.
ELSEWHERE = """\
schema: grader/rubric/v1
exercise: {id: heating, number: "7", title: Heating}
files: [fan_controller.py]
scenarios:
  - id: controller_alone
    processes: [fan_controller.py]
    observe: {duration: 28 s}
    stimuli: [{numbers: {topic: /temperature, type: std_msgs/msg/Float32, values: [20, 30], period: 1 s, hold: 5 s}}]
criteria:
  - id: off
    title: Off at the limit
    points: 7
    scenario: controller_alone
    check:
      threshold_response:
        {input: /temperature, output: /fan_speed, threshold: 25, above: 100, otherwise: 0, side: at_or_below}
"""


@pytest.fixture
def elsewhere(tmp_path: Path) -> Path:
    path = tmp_path / "heating.yaml"
    path.write_text(ELSEWHERE, encoding="utf-8")
    return path


def verdict(exercise: Exercise, sample: str = "wrong/fan_on_at_25") -> tuple[str, str, int | None]:
    """Judge a recording of exercise 3; return hint, cause and line of the first lost criterion."""
    trace = unpack_trace(
        recorded_of(EXERCISES / "exercise_3")[sample].traces["two_node_communication.controller_alone"]
    )
    file = "fan_controller.py"
    submission = Submission("s", "s", Path("s"), "sha256:1", {file: StudentFile(file, file)})
    text = (EXERCISES / "exercise_3" / sample / file).read_text(encoding="utf-8")
    report = judge_exercise(exercise, {"controller_alone": trace}, submission, {file: text})
    lost = next(v for v in report.verdicts if v.outcome.value == "not_met")
    return lost.hint, str(lost.evidence.get("diagnosis")), lost.location.line if lost.location else None


def test_no_name_is_taken_twice() -> None:
    """Neither by two exercises, nor by an exercise and the grader; and there are some."""
    tables = [read_rubric(path) for path in builtin_rubrics().values()]
    assert SHARED
    assert not SHARED.keys() & CHECKS.keys()
    ids = [rule.id for exercise in tables for rule in exercise.hints]
    assert len(ids) == len(set(ids))


@pytest.mark.breadth(2, 7)
@pytest.mark.parametrize("name", SHARED)
def test_it_lies_beside_its_rubric(name: str) -> None:
    """The rubric of the exercise names the file, as an author's does, and uses the same class."""
    users = [exercise for path in builtin_rubrics().values() for exercise in [read_rubric(path)]]
    kinds = {type(c.check) for exercise in users for c in exercise.criteria if c.check_name == name}
    assert kinds == {SHARED[name]}
    file = Path(str(sys.modules[SHARED[name].__module__].__file__))
    assert file.name == "checks.py"
    assert file.parent.parent == shipped("rubrics")


def test_a_rubric_elsewhere_uses_it_by_name(elsewhere: Path) -> None:
    """With the hint rules that come with it: they name the line."""
    exercise = read_rubric(elsewhere)
    assert type(exercise.criteria[0].check) is known_checks()["threshold_response"]
    hint = "msg.data >= 25.0 is true at exactly 25: write > instead of >="
    assert verdict(exercise) == (hint, "at_the_threshold", 14)
    assert verdict(read_rubric(FAN)) == verdict(exercise)


@pytest.mark.nightly
@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize("name", sorted({kind.parent.name for kind in shipped("rubrics").glob("*/checks.py")}))
def test_a_rubric_that_names_no_files_judges_every_recording_the_same(tmp_path: Path, name: str) -> None:
    """As rubrics did before the checks lay beside the exercises: points, reasons, hints and charts are equal."""
    folder = tmp_path / name
    shutil.copytree(shipped("rubrics") / name, folder, ignore=shutil.ignore_patterns("*.py", "__pycache__"))
    text = (folder / "rubric.yaml").read_text(encoding="utf-8")
    (folder / "rubric.yaml").write_text(
        re.sub(r"^(checks|hints): .*\n", "", text, flags=re.MULTILINE), encoding="utf-8"
    )
    exercise, original = read_rubric(folder / "rubric.yaml"), read_rubric(shipped("rubrics") / name / "rubric.yaml")
    assert exercise.digest != original.digest
    differ = [
        sample
        for sample, recorded in recorded_of(EXERCISES / name).items()
        if dumps(judged(recorded, {exercise.id: exercise})).replace(exercise.digest, original.digest)
        != dumps(judged(recorded, {original.id: original}))
    ]
    assert differ == []


def test_such_a_rubric_brings_no_file(elsewhere: Path) -> None:
    """Its digest is that of its text, and a cluster or a bundle needs nothing beside it."""
    assert side_files(elsewhere) == ()
    assert read_rubric(elsewhere).digest == f"sha256:{hashlib.sha256(elsewhere.read_bytes()).hexdigest()}"


def test_the_exercise_itself_brings_its_files() -> None:
    """They are part of its digest: another check is another rubric."""
    files = side_files(FAN)
    assert [file.name for file in files][:2] == ["checks.py", "hints.py"]
    assert read_rubric(FAN).digest == rubric_digest(FAN.read_bytes(), files)


def test_a_rubric_without_such_a_check_has_no_such_rules() -> None:
    """Rules of exercise 3 are not asked about exercise 1."""
    assert list(read_rubric(builtin_rubrics()["velocity_publisher"]).hints) == []
    assert list(hints_of(["topic_rate"])) == []


def test_a_copy_is_used_in_place_of_the_original(tmp_path: Path) -> None:
    """A course may change what it copied: its own file has the last word."""
    shutil.copytree(FAN.parent, tmp_path / "mine")
    checks = tmp_path / "mine" / "checks.py"
    text = checks.read_text(encoding="utf-8")
    changed = text.replace("itself is not above", "itself stays below")
    assert changed != text
    checks.write_text(changed, encoding="utf-8")
    (tmp_path / "mine" / "hints.py").unlink()
    rubric = tmp_path / "mine" / "rubric.yaml"
    rubric.write_text(rubric.read_text(encoding="utf-8").replace("hints: [hints.py]\n", ""), encoding="utf-8")
    exercise = read_rubric(rubric)
    assert list(exercise.hints) == []
    assert verdict(exercise)[0] == "25 °C itself stays below 25 °C: compare with > and not with >="


def test_the_exercise_is_recreated_in_another_process(tmp_path: Path) -> None:
    """Its checks and rules travel as the text of their files, as those of an author."""
    exercise = read_rubric(FAN)
    assert pickle.loads(pickle.dumps(exercise)) == exercise
    (tmp_path / "exercise").write_bytes(pickle.dumps(exercise))
    code = (
        "import pickle, sys; e = pickle.load(open(sys.argv[1], 'rb'));"
        " print(*(type(c.check).__name__ for c in e.criteria), len(list(e.hints)))"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(tmp_path / "exercise")], check=True, capture_output=True, text=True
    )
    kinds = [type(criterion.check).__name__ for criterion in exercise.criteria]
    assert done.stdout.split() == [*kinds, str(len(list(exercise.hints)))]


def test_rules_of_exercises_are_asked_in_the_order_of_all_rules() -> None:
    """Their numbers stand among those of the grader, not before all."""
    rules = [rule for rule in hints_of(known_checks()) if isinstance(rule, Rule)]
    assert rules
    assert min(rule.priority for rule in rules) >= 1000
