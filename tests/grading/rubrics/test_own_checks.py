"""Checks of a rubric's own: read as strictly as any other, run by whoever judges, and never taken from students."""

from __future__ import annotations

import json
import pickle
import re
import subprocess
import sys
from fractions import Fraction
from pathlib import Path
from typing import Any

import jsonschema
import pytest
from click.testing import CliRunner, Result
from own_check_samples import CHECKS_FILE, PUMP, RUBRIC, write_rubric
from places import GRADE, ROOT
from ruamel.yaml import YAML

from grader.cli import main
from grader.course.classroom.messages import GradingJob, Terms
from grader.course.classroom.receiving import write_task
from grader.course.classroom.sending import checks_of
from grader.course.classroom.store import Conditions
from grader.course.packaging import Chosen, classroom50
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.judging.proportion import in_proportion
from grader.grading.model.exercise import Criterion, Location, Outcome
from grader.grading.model.grading_options import GradingOptions
from grader.grading.model.measures import Scale
from grader.grading.model.report import Verdict
from grader.grading.rubrics.loader import RubricMistakes, read_rubric, side_files
from grader.runtime.model.author_files import run_author_file
from grader.runtime.model.errors import RubricError
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import AssessedTrace
from grader.testing import TraceBuilder, judge

FLOAT = "std_msgs/msg/Float32"


def command(*words: Path | str) -> Result:
    return CliRunner().invoke(main.app, [*map(str, words)])


def refused(path: Path, **rest: Any) -> RubricError | RubricMistakes:
    with pytest.raises(RubricError) as error:
        read_rubric(path, **rest)
    return error.value


def flow(start_s: float = 0.1) -> TraceBuilder:
    return TraceBuilder("pump.py", stop_s=2.0).messages("/flow", FLOAT, {"data": 1.5}, rate_hz=10, start_s=start_s)


def verdict(path: Path, trace: AssessedTrace) -> Verdict:
    submission = Submission("s", "s", Path("s"), "sha256:1", {"pump.py": StudentFile("pump.py", "pump.py")})
    (found,) = judge_exercise(read_rubric(path), {"alone": trace}, submission).verdicts
    return found


def test_a_check_of_ones_own_judges(tmp_path: Path) -> None:
    """Its parameters are read with their units, and its findings become verdicts."""
    path = write_rubric(tmp_path)
    (criterion,) = read_rubric(path).criteria
    check: Any = criterion.check
    assert (criterion.check_name, check.within) == ("starts_early", 500_000_000)
    assert judge(criterion.check, flow().trace()).credit == 1
    assert verdict(path, flow().trace()).score == Fraction(10)
    late = verdict(path, flow(start_s=0.7).trace())
    assert (late.outcome, late.evidence) == (Outcome.NOT_MET, {"first_s": 0.7})


@pytest.mark.parametrize(
    ("old", "new", "told"),
    [
        ("within: 500 ms", "within: 0.5", "15:44: expected a duration with its unit"),
        (", within: 500 ms", "", "15:21: expected the key `within` in `starts_early`, found none"),
        ("within:", "wihtin:", "15:36: expected `topic` or `within` in `starts_early`, found `wihtin`"),
        ("topic: /flow", "topic: flow", "15:29: expected an absolute topic name"),
        ("starts_early:", "starts_late:", "15:7: expected"),
        ("pump_checks.py", "../pump_checks.py", "4:10: expected a Python file in the rubric's folder"),
        ("pump_checks.py", "/pump_checks.py", "4:10: expected a Python file in the rubric's folder"),
        ("pump_checks.py", "other.py", "checks: other.py: expected a file beside the rubric, found nothing there"),
        ("[pump_checks.py]", "pump_checks.py", "4:9: expected a list"),
        ("[pump_checks.py]", "[1]", "4:10: expected text"),
    ],
)
def test_a_mistake_in_the_rubric_is_told_with_its_place(tmp_path: Path, old: str, new: str, told: str) -> None:
    """As for the checks that come with the grader."""
    error = refused(write_rubric(tmp_path, RUBRIC.replace(old, new)))
    assert f"{tmp_path}/pump.yaml" in error.message
    assert told in error.message


@pytest.mark.parametrize(
    ("old", "new", "line", "told"),
    [
        ("CHECKS = {", "CHECKS = [", 35, "SyntaxError"),
        ("from dataclasses import dataclass\n", "import no_such_module\n", 5, "No module named 'no_such_module'"),
        ("    within: DurationNs\n", "    within: 1 / 0\n", 1, "ZeroDivisionError"),
        ("    within: DurationNs\n", "    within: bytes\n", 14, "no rubric syntax for a parameter annotated"),
        ("    within: DurationNs\n", "    within: Nowhere\n", 14, "name 'Nowhere' is not defined"),
        ("frozen=True, ", "", 14, "found one that can change: write @dataclass(frozen=True)"),
        ("@dataclass(frozen=True, slots=True)\n", "", 13, "expected a frozen dataclass, found something else"),
        ("def judge(self, trace: Trace)", "def judge(self)", 14, "found none that takes a trace"),
        ("def judge", "def judged", 14, "found none that takes a trace"),
        (
            '"starts_early": StartsEarly',
            '"publishes": StartsEarly',
            35,
            "expected a new name, found `publishes`",
        ),
        ('"starts_early": StartsEarly', '"Starts-Early": StartsEarly', 35, "expected a name of lower-case letters"),
        ('"starts_early": StartsEarly', '"starts_early": 5', 35, "expected a frozen dataclass, found something else"),
        ('CHECKS = {"starts_early": StartsEarly}', "", 1, "expected a table CHECKS"),
        ('CHECKS = {"starts_early": StartsEarly}', "CHECKS = {}", 1, "found an empty one"),
        ('CHECKS = {"starts_early": StartsEarly}', "raise SystemExit(0)", 35, "SystemExit: 0"),
    ],
)
def test_a_file_that_holds_no_checks_is_told_with_its_line(
    tmp_path: Path, old: str, new: str, line: int, told: str
) -> None:
    """Whatever it is; and the command ends with 2."""
    assert old in CHECKS_FILE
    path = write_rubric(tmp_path, checks=CHECKS_FILE.replace(old, new))
    error = refused(path)
    assert told in error.message
    if line > 1:
        assert error.message.startswith(f"{tmp_path}/pump_checks.py:{line}: ")
    assert command("rubric", "check", path).exit_code == 2


def test_a_file_is_never_taken_from_where_students_write(tmp_path: Path) -> None:
    """Neither from the submission that is graded nor from a class; nothing of it is run."""
    path = write_rubric(tmp_path, checks="raise AssertionError('it was run')")
    assert "expected a file that students cannot write" in refused(path, submissions=[tmp_path]).message
    request = GradeRequest(str(tmp_path), rubrics=(path,))
    with pytest.raises(RubricError, match="expected a file that students cannot write"):
        read_exercises(request)
    with pytest.raises(RubricError, match="expected a file that students cannot write"):
        read_exercises(GradeRequest("", rubrics=(path,)), [tmp_path / "elsewhere", tmp_path])


def test_a_link_does_not_lead_out_of_the_folder(tmp_path: Path) -> None:
    """A rubric's folder holds all of it."""
    (tmp_path / "course").mkdir()
    path = write_rubric(tmp_path / "course")
    (tmp_path / "course" / "pump_checks.py").rename(tmp_path / "outside.py")
    (tmp_path / "course" / "pump_checks.py").symlink_to(tmp_path / "outside.py")
    assert "expected a file in the rubric's folder" in refused(path).message


def test_the_digest_covers_the_file(tmp_path: Path) -> None:
    """A changed check is another rubric: results are made anew, and reports say what they were made with."""
    path = write_rubric(tmp_path)
    before = read_rubric(path).digest
    assert read_rubric(path).digest == before
    write_rubric(tmp_path, checks=CHECKS_FILE + "\n# another thought\n")
    assert read_rubric(path).digest != before
    assert [(file.name, file.path) for file in side_files(path)] == [("pump_checks.py", tmp_path / "pump_checks.py")]


def test_an_exception_leaves_the_criterion_undecided(tmp_path: Path) -> None:
    """It costs no points; class, text, file and line are there for whoever fixes the check."""
    found = verdict(write_rubric(tmp_path), TraceBuilder("pump.py").trace())
    assert (found.outcome, found.score) == (Outcome.UNDECIDED, 0)
    assert found.evidence["error"] == "pump_checks.py:29: LookupError: nobody thought of silence"
    assert found.hint == "for the author of the rubric: correct pump_checks.py and grade again"


@pytest.mark.parametrize(
    ("returned", "told"),
    [
        ("None", "pump_checks.py:25: the check starts_early returned a NoneType, expected a Finding"),
        ("sys.exit(0)", "pump_checks.py:29: SystemExit: 0"),
    ],
)
def test_what_is_no_finding_is_undecided(tmp_path: Path, returned: str, told: str) -> None:
    """A check that gives up the process, or nothing, ends no report."""
    text = CHECKS_FILE.replace('raise LookupError("nobody thought of silence")', f"import sys; return {returned}")
    found = verdict(write_rubric(tmp_path, checks=text), TraceBuilder("pump.py").trace())
    assert found.outcome is Outcome.UNDECIDED
    assert told in found.reason


def test_a_check_travels_to_other_processes(tmp_path: Path) -> None:
    """A process that never read the rubric can take the check out of a pickle."""
    (criterion,) = read_rubric(write_rubric(tmp_path)).criteria
    (tmp_path / "pickled").write_bytes(pickle.dumps(criterion))
    program = "import pickle, pathlib; c = pickle.loads(pathlib.Path('pickled').read_bytes()); print(c.check, c.points)"
    done = subprocess.run([sys.executable, "-c", program], cwd=tmp_path, check=True, capture_output=True, text=True)
    assert done.stdout == "StartsEarly(topic='/flow', within=500000000) 10\n"


def test_it_is_explained_and_listed(tmp_path: Path) -> None:
    """In the words of its docstring, like any other."""
    path = write_rubric(tmp_path)
    for shown in (command("rubric", "explain", path), command("explain", "starts_early", "--rubric", path)):
        assert "The first message on a topic comes within a time." in shown.stdout
        assert "Longest time to wait." in shown.stdout
    assert "within: 500 ms" in command("explain", "early", "--rubric", path).stdout
    assert "starts_early  " in command("rubric", "explain", path, "--checks").stdout
    assert command("rubric", "check", path).output == f"{path}: pump: 1 scenario, 1 criterion, 10 points\n"


def test_the_schema_knows_it(tmp_path: Path) -> None:
    """Editors complete it in the rubric that names its file."""
    path = write_rubric(tmp_path)
    data = YAML(typ="safe", pure=True).load(RUBRIC)
    jsonschema.validate(data, json.loads(command("rubric", "schema", path).stdout))
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(data, json.loads(command("rubric", "schema").stdout))


def test_a_check_without_a_docstring_is_odd(tmp_path: Path) -> None:
    """`grade rubric check` warns that nothing explains it."""
    begin, end = CHECKS_FILE.index('    """The first'), CHECKS_FILE.index("    topic: str")
    path = write_rubric(tmp_path, checks=CHECKS_FILE[:begin] + CHECKS_FILE[end:])
    assert "has no docstring to explain it" not in command("rubric", "check", write_rubric(tmp_path)).stderr
    write_rubric(tmp_path, checks=CHECKS_FILE[:begin] + CHECKS_FILE[end:])
    assert "StartsEarly, which has no docstring to explain it" in command("rubric", "check", path).stderr


def test_a_bundle_for_a_platform_holds_it(tmp_path: Path) -> None:
    """Beside its rubric, so that the rubric can be read from there."""
    files = classroom50(Chosen(rubrics=(write_rubric(tmp_path),)))
    for name in ("rubric.yaml", "pump_checks.py"):
        path = tmp_path / "there" / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(files[f"rubrics/1/{name}"])
    assert read_rubric(tmp_path / "there" / "rubric.yaml").digest == read_rubric(tmp_path / "pump.yaml").digest


def test_it_travels_to_a_cluster(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """As bytes, with its path from where the class is graded; there the rubric is the same."""
    for folder in ("here/course", "there"):
        (tmp_path / folder).mkdir(parents=True)
    before = read_rubric(write_rubric(tmp_path / "here" / "course")).digest
    monkeypatch.chdir(tmp_path / "here")
    rubric = Path("course/pump.yaml")
    checks = tuple(checks_of([rubric]))
    assert checks == ((b"course/pump_checks.py", CHECKS_FILE.encode()),)
    conditions = Conditions("0", (), "", GradingOptions(rubrics=(Path("course/pump.yaml"),)))
    terms = Terms(conditions, ((b"course/pump.yaml", RUBRIC.encode()), *checks), standalone=False, deadline_s=1.0)
    task = write_task(terms, GradingJob("ada", b"ada", b"class/ada", b""), tmp_path / "there")
    (found,) = (tmp_path / "there").rglob("pump.yaml")
    assert (task.conditions.options.rubrics, read_rubric(found).digest) == ((rubric,), before)


def test_the_examples_on_the_page_about_own_checks_work() -> None:
    """Points in proportion, and a check that names a line of the student's file."""
    page = (ROOT / "docs" / "how-to" / "own-check.md").read_text(encoding="utf-8")
    blocks = re.findall(r"```python\n(.*?)```", page, re.DOTALL)
    (proportional,) = (block for block in blocks if block.startswith("@dataclass(frozen=True)\nclass AwayFromDock"))
    (sources,) = (block for block in blocks if block.startswith("    def judge_sources"))
    names = "from collections.abc import Mapping\nfrom dataclasses import replace\n"
    names += "from typing import ClassVar\nfrom grader.api import Location, Measure, Reading\n"
    own = run_author_file("_example", "own-check.md", f"{blocks[0]}\n{names}\n\n{proportional}\n{sources}".encode())
    check = vars(own)["AwayFromDock"]("/goal")
    scale = Scale(1.0, 3.0, "mean")
    criterion = Criterion("away", "", Fraction(1), "alone", check, scale=scale)

    def at(*distances: float) -> AssessedTrace:
        trace = TraceBuilder("planner.py")
        for second, x in enumerate(distances):
            fields = {"pose": {"position": {"x": x, "y": 0.0, "z": 0.0}}}
            trace.message(second, "/goal", "geometry_msgs/msg/PoseStamped", fields)
        return trace.trace()

    shares = [in_proportion(criterion, judge(check, at(x, x))).credit for x in (0.5, 1.0, 1.5, 2.7, 3.0)]
    assert shares == [1, 1, Fraction(3, 4), Fraction(3, 20), 0]
    assert judge(check, at()).blocked_by == "publishes"
    found = judge(check, at(), {"planner.py": "import rclpy\nplace = PLACES[0]\n"})
    assert (found.location, found.credit) == (Location("planner.py", 2), 0)
    (written,) = (block for block in re.findall(r"```yaml\n(.*?)```", page, re.DOTALL) if "full:" in block)
    parameters = YAML(typ="safe").load(written)["check"]["away_from_dock"]
    assert parameters == {"topic": "/nav2/goal", "full": 1.0, "none": 3.0, "combine": "mean"}


@pytest.mark.long
@pytest.mark.ros
def test_real_nodes_are_judged_by_it(tmp_path: Path) -> None:
    """By grade, by the processes of a class, and again from evidence, whose judgement notices a changed check."""
    (tmp_path / "course").mkdir()
    path = write_rubric(tmp_path / "course")
    for name, period in (("early", "0.1"), ("late", "0.8")):
        (tmp_path / "class" / name).mkdir(parents=True)
        (tmp_path / "class" / name / "pump.py").write_text(PUMP.replace("PERIOD", period))

    def scores(*words: str | Path) -> Any:
        done = subprocess.run([GRADE, *map(str, words)], cwd=tmp_path, check=False, capture_output=True, text=True)
        assert done.returncode in (0, 1), done.stderr
        return json.loads(done.stdout)["score"] if done.stdout.startswith("{") else done.stdout

    kept = f"evidence={tmp_path / 'evidence'}"
    assert scores("class/early", "--rubric", path, "--json", "-o", kept) == 10
    scores("batch", "class", "--rubric", path, "-o", "results")
    reports = [json.loads((tmp_path / f"results/students/{n}/report.json").read_text()) for n in ("early", "late")]
    assert [report["score"] for report in reports] == [10, 0]
    assert scores("rejudge", "evidence", "--rubric", path, "--json") == 10
    write_rubric(tmp_path / "course", checks=CHECKS_FILE.replace("> self.within", "< self.within"))
    assert scores("rejudge", "evidence", "--rubric", path, "--json") == 0
