"""The platforms with real nodes: each autograder is run as its platform runs it."""

import base64
import json
import os
import re
import shutil
import subprocess
import sys
import zipfile
from pathlib import Path

import jsonschema
import pytest
from click.testing import CliRunner
from places import ROOT, SHARED
from stand_in_runner import CANARY, job_environment, obeyed, run_action

from grader.cli.main import app

BIN = Path(sys.executable).parent
SCHEMA = SHARED / "formats" / "classroom50-result-v1.schema.json"
#: Looks for the token wherever a process could find one, and says what it found in the only way it has: by failing.
PRYING = """
import glob, os, rclpy
COMMANDS = ("::set-output name=score::100", "##[error]mine", "::stop-commands::mine", "::add-path::/mine")
places = {places!r} + glob.glob("/proc/*/environ") + glob.glob("/proc/*/cmdline")
places += [os.path.join(folder, name) for folder, _, names in os.walk("/tmp") for name in names][:2000]
found = sum("canary" in value for value in os.environ.values())
for place in places:
    if os.path.exists(place) and not os.path.isfile(place):
        continue  # a pipe of another program would be waited for
    try:
        with open(place, "rb") as file:
            found += b"canary" + b"0123" in file.read(1 << 20)
    except OSError:
        pass
rclpy.init()
node = rclpy.create_node("velocity_publisher")
for command in COMMANDS:
    node.get_logger().info(command)
    print(command, flush=True)
raise RuntimeError("\\n".join(COMMANDS) + f"\\ncanaries: {{found}}")
"""


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Return a checkout whose git configuration holds a token, as some workflows leave it."""
    folder = tmp_path / "checkout"
    (folder / ".git").mkdir(parents=True)
    (folder / ".git" / "config").write_text(f"[http]\n\textraheader = AUTHORIZATION: basic {CANARY}\n")
    return folder


def with_grader() -> str:
    return f"{BIN}{os.pathsep}{os.environ['PATH']}"


def pry(checkout: Path, *places: Path) -> None:
    source = PRYING.format(places=[str(checkout / ".git" / "config"), *map(str, places)])
    (checkout / "velocity_publisher.py").write_text(source)


def solve(checkout: Path) -> None:
    shutil.copy(ROOT / "reference_solutions" / "velocity_publisher.py", checkout)


@pytest.mark.long
@pytest.mark.ros
def test_the_action_grades_and_a_prying_student_finds_nothing(checkout: Path, tmp_path: Path) -> None:
    """No token in the environment, in /proc, in the checkout or the runner's folder; no command in the log."""
    secret = tmp_path / "runner" / "secret"
    pry(checkout, secret, tmp_path / "runner" / "1" / "OUTPUT")
    environment = job_environment(PATH=with_grader())
    (tmp_path / "runner").mkdir()
    secret.write_text(CANARY)
    job = run_action(ROOT, checkout, tmp_path / "runner", environment, setup="false", exercises="velocity_publisher")
    (upload,) = job.uploads.values()
    report = json.loads(Path(upload["path"], "report.json").read_text())
    assert "canaries: 0" in json.dumps(report["exercises"][0]["faults"])
    assert job.outputs["score"] == str(report["score"])
    assert job.outputs["max-score"] == "30"
    legacy = json.loads(base64.b64decode(job.outputs["result"]))
    assert (legacy["max_score"], sum(test["score"] for test in legacy["tests"])) == (30, report["score"])
    assert job.outputs["passed"] == "false"
    assert {kind for kind, _, _ in job.commands} <= {"notice", "warning", "error"}
    assert [p["file"] for kind, p, _ in job.commands if kind == "error" and "file" in p] == ["velocity_publisher.py"]
    assert CANARY not in job.log + job.summaries["Grade"]
    assert job.changed == ""
    assert (Path(upload["path"]) / "evidence").is_dir()
    assert (Path(upload["path"]) / "report.html").stat().st_size > 10_000


@pytest.mark.nightly
@pytest.mark.ros
def test_without_a_sandbox_the_prying_student_finds_something(checkout: Path, tmp_path: Path) -> None:
    """The test above can fail."""
    pry(checkout)
    environment = job_environment(PATH=with_grader())
    job = run_action(
        ROOT,
        checkout,
        tmp_path / "runner",
        environment,
        setup="false",
        exercises="velocity_publisher",
        isolation="none",
    )
    (upload,) = job.uploads.values()
    faults = json.dumps(json.loads(Path(upload["path"], "report.json").read_text())["exercises"][0]["faults"])
    assert "canaries: 0" not in faults
    assert "canaries: " in faults


@pytest.fixture
def autograder(tmp_path: Path) -> Path:
    """Return a folder as Gradescope lays it out, with the exported autograder in it."""
    root = tmp_path / "autograder"
    (root / "submission").mkdir(parents=True)
    archive = tmp_path / "autograder.zip"
    words = ["export", "gradescope", str(archive), "--exercise", "velocity_publisher", "--isolation", "auto"]
    done = CliRunner().invoke(app, words)
    assert done.exit_code == 0, done.output
    with zipfile.ZipFile(archive) as files:
        files.extractall(root / "source")
        for each in files.infolist():  # as unzip does, which a bare machine lacks
            (root / "source" / each.filename).chmod(each.external_attr >> 16)
    shutil.copy(root / "source" / "run_autograder", root)
    return root


def run_autograder(root: Path) -> subprocess.CompletedProcess[str]:
    environment = job_environment(PATH=with_grader(), AUTOGRADER_ROOT=str(root))
    return subprocess.run([root / "run_autograder"], env=environment, capture_output=True, text=True, check=False)


@pytest.mark.nightly
@pytest.mark.ros
def test_gradescope_s_zip_leaves_results(autograder: Path) -> None:
    """Unpacked and run as the platform does; the exercise is the one that was chosen."""
    solve(autograder / "submission")
    done = run_autograder(autograder)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((autograder / "results" / "results.json").read_text())
    assert result["score"] == 30
    assert sum(test["max_score"] for test in result["tests"]) == 30
    assert result["stdout_visibility"] == "hidden"


@pytest.mark.long
@pytest.mark.ros
def test_prairielearn_s_question_is_graded(tmp_path: Path) -> None:
    """By the words of its own entry point, with the share of the points as the score."""
    folder = ROOT / "integrations" / "prairielearn"
    question = json.loads((folder / "question" / "info.json").read_text())
    program, *words = question["externalGradingOptions"]["entrypoint"]
    container = (ROOT / "integrations" / "container" / "Containerfile").read_text()
    assert f"integrations/prairielearn/grade_submission {program}\n" in container
    (tmp_path / "student").mkdir()
    solve(tmp_path / "student")
    environment = job_environment(PATH=with_grader(), GRADE_ROOT=str(tmp_path))
    script: list[str | Path] = [sys.executable, "-I", folder / "grade_submission"]
    done = subprocess.run([*script, *words], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((tmp_path / "results" / "results.json").read_text())
    assert (result["gradable"], result["score"]) == (True, 1)
    assert (folder / "question" / "question.html").read_text().count('file-names="velocity_publisher.py"') == 1


#: What VPL looks for in the output of an evaluation: the last line of the first kind, and the ends of a comment.
VPL_MARK, VPL_COMMENT = (
    re.compile(r"^Grade :=>>(.*)$", re.MULTILINE),
    re.compile(r"^[ \t]*(?:<\|--|--\|>)[ \t]*$", re.MULTILINE),
)


def run_vpl(folder: Path, grade: str, **more: str) -> str:
    """Evaluate a submission in two steps as VPL does, and return the output of the second."""
    shutil.copy(ROOT / "integrations" / "vpl" / "vpl_evaluate.sh", folder)
    (folder / "vpl_environment.sh").write_text("export VPL_GRADEMIN=0\nexport VPL_GRADEMAX=10\n")
    environment = job_environment(PATH=grade, **more)
    for program in ("vpl_evaluate.sh", "vpl_execution"):
        done = subprocess.run(
            ["bash", program], cwd=folder, env=environment, capture_output=True, text=True, check=True
        )
    return done.stdout


@pytest.mark.long
@pytest.mark.ros
def test_no_student_gives_a_mark_on_vpl(tmp_path: Path) -> None:
    """Whatever is printed, logged or raised, and however files are called: the only mark is the grader's."""
    forged = "\nGrade :=>>10\r\nGrade :=>>10\x0bGrade :=>>10\u2028Grade :=>>10\n--|>\nGrade :=>>10\n<|--\n"
    (tmp_path / "velocity_publisher.py").write_text(
        f"import rclpy\nrclpy.init()\nnode = rclpy.create_node('n')\nprint({forged!r}, flush=True)\n"
        f"node.get_logger().info({forged!r})\nraise RuntimeError({forged!r})\n",
    )
    (tmp_path / "Grade :=>>10\n.py").write_text("import rclpy\n")
    said = run_vpl(tmp_path, with_grader())
    assert "RuntimeError" in said
    assert VPL_MARK.findall(said) == ["1.33"]  # it did log something: 4 of 30 points
    assert VPL_COMMENT.findall(said) == ["<|--", "--|>"]


def test_vpl_gets_no_mark_where_nothing_was_decided(tmp_path: Path) -> None:
    """The comment says why."""
    program = tmp_path / "bin" / "grade"
    program.parent.mkdir()
    program.write_text("#!/bin/sh\necho 'Grade :=>>10' >&2\nexit 2\n")
    program.chmod(0o755)
    said = run_vpl(tmp_path, f"{program.parent}{os.pathsep}{os.environ['PATH']}")
    assert said == "<|--\n>Grade :=>>10\n--|>\n"


@pytest.mark.long
@pytest.mark.ros
def test_classroom50_gets_its_files(checkout: Path, tmp_path: Path) -> None:
    """The result follows the platform's schema, a student's file of that name is replaced, no command is obeyed."""
    pry(checkout)
    elsewhere = tmp_path / "elsewhere"
    elsewhere.write_text("untouched")
    (checkout / "result.json").symlink_to(elsewhere)
    done = run_classroom50(checkout, bundle(tmp_path), COMMIT_DATETIME="2026-06-01T16:32:01+02:00")
    assert done.returncode == 0, done.stdout + done.stderr
    result = json.loads((checkout / "result.json").read_text())
    assert elsewhere.read_text() == "untouched"
    assert result["datetime"] == "2026-06-01T14:32:01Z"
    assert (result["max-score"], result["owner"]) == (30, "ada")
    assert "canaries: 0" in json.dumps(result)
    assert obeyed(done.stdout) == []
    assert CANARY not in done.stdout + (checkout / "release-body.md").read_text()
    assert (checkout / "grading-report.html").exists()
    assert zipfile.ZipFile(checkout / "grading-evidence.zip").testzip() is None
    if SCHEMA.exists():
        jsonschema.validate(result, json.loads(SCHEMA.read_text(encoding="utf-8")))


def bundle(tmp_path: Path) -> Path:
    """Return the exported folder; without its wheel, the autograder uses the grader of this machine."""
    folder = tmp_path / "bundle"
    done = CliRunner().invoke(app, ["export", "classroom50", str(folder), "--exercise", "velocity_publisher"])
    assert done.exit_code == 0, done.output
    next(folder.glob("*.whl")).unlink()
    return folder


def run_classroom50(checkout: Path, folder: Path, **more: str) -> subprocess.CompletedProcess[str]:
    names = {"CLASSROOM": "ros", "ASSIGNMENT": "one", "ASSIGNMENT_TYPE": "individual", "OWNER": "ada"}
    names |= {"USERNAME": "ada", "SUBMISSION_TAG": "submit/2026-06-01T14-32-05Z-a1b2c3d"}
    names |= dict.fromkeys(("COMMIT_URL", "RELEASE_URL", "REVIEW_URL"), "https://github.com/school/one/x")
    environment = job_environment(PATH=with_grader(), RUNNER_TEMP=str(folder.parent), **names, **more)
    words: list[str | Path] = [sys.executable, folder / "autograder.py"]
    return subprocess.run(words, cwd=checkout, env=environment, capture_output=True, text=True, check=False)


@pytest.mark.ros
@pytest.mark.nightly
def test_the_action_sets_itself_up_from_nothing(checkout: Path, tmp_path: Path) -> None:
    """With the system's Python, the pinned versions, and a submission that passes; then again from the cache."""
    solve(checkout)
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("VIRTUAL_ENV", "PYTHON"))}
    path = os.pathsep.join(part for part in environment["PATH"].split(os.pathsep) if Path(part) != BIN)
    for _ in range(2):
        shutil.rmtree(tmp_path / "runner", ignore_errors=True)
        job = run_action(
            ROOT, checkout, tmp_path / "runner", {**environment, "PATH": path}, exercises="velocity_publisher"
        )
        assert job.failed == "", job.log
        assert job.outputs["passed"] == "true"
        assert "Passed." in job.log
    # What was installed can be packed in its turn.
    own = tmp_path / "runner" / "temp" / "rclpy-grader" / "bin" / "grade"
    words: list[str | Path] = [own, "export", "classroom50", tmp_path / "bundle"]
    subprocess.run(words, env={**environment, "PATH": path}, cwd=tmp_path, check=True)
    names = {file.name for file in (tmp_path / "bundle").iterdir()}
    assert {"autograder.py", "prepare", "constraints.txt", "settings.json"} < names
