"""What each platform's autograder does with each end of the grader, without running a node."""

import importlib.util
import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest
from places import ROOT
from stand_in_runner import job_environment, obeyed

pytestmark = pytest.mark.slow

#: Ends as its HOME says, `doctor` as its LANG says; writes reports unless it ends with 2.
PROGRAM = """#!{python} -IS
import os, sys
from pathlib import Path
if sys.argv[1] == "doctor":
    sys.exit(int(os.environ["LANG"]))
code = int(os.environ["HOME"])
for place in (word for word in sys.argv if "=" in word and code != 2):
    format_, _, path = place.partition("=")
    if format_ == "evidence":
        Path(path).mkdir()
    elif path != "-":
        Path(path).write_text("{{}}")
print("error: it is too large", file=sys.stderr)
print("::error::mine", end="")
sys.exit(code)
"""


@pytest.fixture
def programs(tmp_path: Path) -> Path:
    """Return a folder with a grader that ends as it is told."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "grade").write_text(PROGRAM.format(python=sys.executable))
    (folder / "grade").chmod(0o755)
    return folder


def run(
    words: list[str | Path], programs: Path, *, code: int, doctor: int = 0, cwd: Path | None = None, **more: str
) -> subprocess.CompletedProcess[str]:
    path = f"{programs}{os.pathsep}{os.environ['PATH']}"
    environment = job_environment(PATH=path, HOME=str(code), LANG=str(doctor), **more)
    return subprocess.run(words, cwd=cwd, env=environment, capture_output=True, text=True, check=False)


def gradescope(tmp_path: Path, programs: Path, **how: Any) -> tuple[int, Any]:
    root = tmp_path / "autograder"
    (root / "source").mkdir(parents=True)
    (root / "submission").mkdir()
    (root / "source" / "settings.json").write_text('{"exercises": [], "rubrics": [], "isolation": "auto"}')
    program = ROOT / "integrations" / "gradescope" / "run_autograder"
    done = run([sys.executable, "-I", program], programs, AUTOGRADER_ROOT=str(root), **how)
    results = root / "results" / "results.json"
    return done.returncode, json.loads(results.read_text()) if results.exists() else None


@pytest.mark.parametrize("code", [0, 1, 3])
def test_gradescope_gets_whatever_was_judged(tmp_path: Path, programs: Path, code: int) -> None:
    """An undecided report says of itself that it is not final."""
    assert gradescope(tmp_path, programs, code=code) == (0, {})


def test_gradescope_tells_a_student_why_nothing_could_be_graded(tmp_path: Path, programs: Path) -> None:
    """The machine can grade, so the submission is at fault, and the reason is the output."""
    code, result = gradescope(tmp_path, programs, code=2)
    assert code == 0
    assert result["score"] == 0
    assert result["output"] == "Nothing could be graded.\nerror: it is too large\n"
    assert result["output_format"] == "text"


def test_a_machine_that_cannot_grade_gives_no_mark_on_gradescope(tmp_path: Path, programs: Path) -> None:
    """Without a result, the platform says that the autograder failed."""
    assert gradescope(tmp_path, programs, code=2, doctor=2) == (1, None)


def prairielearn(tmp_path: Path, programs: Path, code: int, *files: str) -> tuple[int, Any, str]:
    root = tmp_path / "grade"
    (root / "results").mkdir(parents=True)
    (root / "results" / "results.json").write_text('{"score": 1}')
    (root / "tests").mkdir()
    for name in files:
        (root / "tests" / name).touch()
    program = ROOT / "integrations" / "prairielearn" / "grade_submission"
    words: list[str | Path] = [sys.executable, "-I", program, "--exercise", "velocity_publisher"]
    done = run(words, programs, code=code, GRADE_ROOT=str(root))
    results = root / "results" / "results.json"
    return done.returncode, json.loads(results.read_text()) if results.exists() else None, done.stdout


@pytest.mark.parametrize("code", [0, 1, 3])
def test_prairielearn_gets_whatever_was_judged(tmp_path: Path, programs: Path, code: int) -> None:
    """A job that ends with anything but 0 is a failed one there, so that lost points are none."""
    assert prairielearn(tmp_path, programs, code)[:2] == (0, {})


def test_prairielearn_tells_a_student_why_nothing_could_be_graded(tmp_path: Path, programs: Path) -> None:
    """No attempt is lost."""
    code, result, _ = prairielearn(tmp_path, programs, 2)
    assert code == 0
    assert result["gradable"] is False
    assert result["format_errors"] == ["Nothing could be graded. error: it is too large\n"]


@pytest.mark.parametrize("given", [[], ["rubric.yaml"], ["rubric.yaml", "seed.key"]])
def test_prairielearn_grades_by_what_the_question_keeps(tmp_path: Path, programs: Path, given: list[str]) -> None:
    """Its rubric and its seed key, if it has them, and the words of its entry point."""
    (programs / "grade").write_text(f"#!{sys.executable} -IS\nimport sys\nprint(*sys.argv[1:])\n")
    code, result, said = prairielearn(tmp_path, programs, 0, *given)
    assert (code, result) == (1, None)  # it wrote no result, and what lay there is gone
    tests = tmp_path / "grade" / "tests"
    options = {"rubric.yaml": f"--rubric {tests / 'rubric.yaml'} ", "seed.key": f"--seed-key {tests / 'seed.key'} "}
    wanted = "".join(options[name] for name in given)
    assert said.startswith(f"--no-progress {wanted}--exercise velocity_publisher --verbose")
    assert said.endswith(f" -- {tmp_path / 'grade' / 'student'}\n")


def classroom50(tmp_path: Path, programs: Path, code: int) -> tuple[int, list[str]]:
    checkout, temporary = tmp_path / "checkout", tmp_path / "temporary"
    checkout.mkdir()
    temporary.mkdir()
    (checkout / "result.json").write_text('{"score": 1000}')
    (checkout / "release-body.md").mkdir()
    program = ROOT / "integrations" / "classroom50" / "autograder.py"
    done = run([sys.executable, "-I", program], programs, code=code, cwd=checkout, RUNNER_TEMP=str(temporary))
    assert obeyed(done.stdout) == []
    return done.returncode, sorted(path.name for path in checkout.iterdir())


@pytest.mark.parametrize("code", [0, 1])
def test_classroom50_gets_all_that_was_written(tmp_path: Path, programs: Path, code: int) -> None:
    """What lay there under these names was the student's, and is gone."""
    left = ["grading-evidence.zip", "grading-report.html", "release-body.md", "result.json"]
    assert classroom50(tmp_path, programs, code) == (0, left)


def test_what_is_undecided_is_no_result_for_classroom50(tmp_path: Path, programs: Path) -> None:
    """It records an error then and no mark; the report is there to read."""
    code, left = classroom50(tmp_path, programs, 3)
    assert code == 1
    assert left == ["grading-evidence.zip", "grading-report.html", "release-body.md"]


def test_a_result_that_a_student_handed_in_is_never_taken(tmp_path: Path, programs: Path) -> None:
    """Also where the grader wrote none."""
    assert classroom50(tmp_path, programs, 2) == (1, [])


def test_the_time_of_a_commit_comes_from_git(tmp_path: Path) -> None:
    """Grading again has no push that would say when it was."""
    path = ROOT / "integrations" / "classroom50" / "autograder.py"
    spec = importlib.util.spec_from_file_location("autograder50", path)
    assert spec is not None
    assert spec.loader is not None
    autograder = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(autograder)
    when = "2026-06-01T16:32:01+02:00"
    identity = {f"GIT_{who}_{what}": "a@b" for who in ("AUTHOR", "COMMITTER") for what in ("NAME", "EMAIL")}
    environment = {**os.environ, **identity, "GIT_COMMITTER_DATE": when}
    for words in (["init", "-q"], ["commit", "-q", "--allow-empty", "-m", "x"]):
        subprocess.run(["git", *words], cwd=tmp_path, env=environment, check=True)
    assert autograder.committed("HEAD", tmp_path) == when
    assert autograder.committed("--output=x", tmp_path) == ""
    assert autograder.surroundings({"GITHUB_SHA": "HEAD", "GH_TOKEN": "t"}, tmp_path) == {"COMMIT_DATETIME": when}
