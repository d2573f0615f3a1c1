"""action.yml as a runner executes it: inputs, outputs, summary, annotations, files, and a log that obeys no student."""

import base64
import json
import os
import shutil
import stat
import sys
from pathlib import Path

import pytest
from places import ROOT
from stand_in_runner import CANARY, Job, evaluated, job_environment, obeyed, pairs, run_action

pytestmark = pytest.mark.slow

#: Writes the reports that it is asked for, prints what a hostile student would like to print, and ends as it is told.
PROGRAM = """#!{python} -IS
import json, os, sys
from pathlib import Path
code = int(os.environ["HOME"])
Path(os.environ["GITHUB_WORKSPACE"], "called.json").write_text(json.dumps([sys.argv[1:], dict(os.environ)]))
for place in (w for w in sys.argv if "=" in w and code in (0, 1)):
    format_, _, path = place.partition("=")
    if format_ == "json":
        Path(path).write_text(json.dumps({{"score": 87.5, "max_score": 100, "final": True}}))
    elif format_ == "evidence":
        Path(path).mkdir()
    elif path != "-":
        content = {{"github": "::notice title=Score::87.5\\n", "classroom": "e30=\\n", "markdown": "# 87.5\\n"}}
        Path(path).write_text(content.get(format_, format_))
print("::set-output name=score::100\\n  ::error::mine\\n##[error]mine\\n::stop-commands::mine\\n::mine::")
print("error: nothing: 100 % lost\\nhint: ::error::mine", file=sys.stderr)
print("::add-path::/mine", end="")
sys.exit(code)
"""
STEPS = ("Set up the grader and its sandbox", "Grade", "Say whether it passed")


@pytest.fixture
def action(tmp_path: Path) -> Path:
    """Return an action whose set-up only notes that it installs."""
    folder = tmp_path / "action"
    for name in ("integrations", "grader", "rubrics", "student_template"):
        (folder / name).mkdir(parents=True)
    for name in ("action.yml", "integrations/github/step.py"):
        (folder / name).parent.mkdir(exist_ok=True)
        shutil.copy(ROOT / name, folder / name)
    for name in ("hatch_build.py", "pyproject.toml", "README.md", "grader/a module.py"):
        (folder / name).write_text("x")
    program = tmp_path / "bin" / "grade"
    script = f'[ $# = 1 ] && exit\necho "installed $2 $3"\nmkdir -p "$1/bin"\ncp {program} "$1/bin"\n'
    (folder / "integrations" / "prepare").write_text(script)
    return folder


def test_a_push_installs_nothing_that_an_earlier_one_installed(checkout: Path, action: Path, tmp_path: Path) -> None:
    """Also where that one failed; another version of the grader is installed anew."""
    logs = []
    for number, code in enumerate("110"):
        if number == 2:
            (action / "grader" / "a module.py").write_text("y")
        environment = job_environment(HOME=code)
        job = run_action(action, checkout, tmp_path / f"runner{number}", environment)
        assert job.failed == (STEPS[2] if code == "1" else "")
        logs.append(job.log)
    installed = f"installed {action} {action}/integrations/constraints.txt"
    assert [installed in log for log in logs] == [True, False, True]
    assert len(list((tmp_path / "cache").iterdir())) == 2


@pytest.fixture
def checkout(tmp_path: Path) -> Path:
    """Return a student's checkout and a folder with a grader that is only heard, not believed."""
    (tmp_path / "bin").mkdir()
    program = tmp_path / "bin" / "grade"
    program.write_text(PROGRAM.format(python=sys.executable))
    program.chmod(program.stat().st_mode | stat.S_IXUSR)
    (tmp_path / "checkout").mkdir()
    return tmp_path / "checkout"


def run(checkout: Path, code: int, **inputs: str) -> Job:
    # The grader sees few names; HOME, of all that it sees, is the one that it has no use for here.
    path = f"{checkout.parent / 'bin'}{os.pathsep}{os.environ['PATH']}"
    environment = job_environment(PATH=path, HOME=str(code))
    return run_action(ROOT, checkout, checkout.parent / "runner", environment, setup="false", **inputs)


def test_a_passed_job_says_so_in_every_place(checkout: Path) -> None:
    """Outputs, summary, annotations, artifact."""
    job = run(checkout, 0)
    assert job.failed == ""
    assert job.outputs["score"] == "87.5"
    assert job.outputs["max-score"] == "100"
    assert job.outputs["passed"] == job.outputs["final"] == "true"
    assert json.loads(base64.b64decode(job.outputs["result"])) == {}
    assert job.summaries["Grade"] == "# 87.5\n"
    assert job.commands == [("notice", {"title": "Score"}, "87.5")]
    (upload,) = job.uploads.values()
    assert upload["name"] == "grading-report"
    assert sorted(path.name for path in Path(upload["path"]).iterdir()) == ["evidence", "report.html", "report.json"]


@pytest.mark.parametrize(("code", "said"), [(1, "Not passed"), (2, "Nothing was graded"), (3, "Undecided")])
def test_what_did_not_pass_fails_the_last_step(checkout: Path, code: int, said: str) -> None:
    """Files are uploaded first, and the job is red."""
    job = run(checkout, code)
    assert job.failed == STEPS[2]
    assert job.uploads
    assert job.outputs["passed"] == "false"
    assert said in job.log


def test_nothing_graded_is_an_error_with_its_reason(checkout: Path) -> None:
    """The message of the grader is the message of the annotation, and no number stands anywhere."""
    job = run(checkout, 2)
    assert job.commands == [
        ("error", {"title": "Nothing was graded"}, "error: nothing: 100 %25 lost%0Ahint: ::error::mine")
    ]
    assert job.outputs["score"] == job.outputs["max-score"] == job.outputs["result"] == ""
    assert job.summaries["Grade"].startswith("**Nothing was graded.**")


@pytest.mark.parametrize("code", [0, 1, 2, 3])
def test_the_runner_obeys_no_line_of_the_grader_s_output(checkout: Path, code: int) -> None:
    """What is printed stays in the log, but sets no output, no path, and cannot make the runner deaf."""
    job = run(checkout, code)
    assert "::set-output name=score::100" in job.log
    assert {kind for kind, _, _ in job.commands} <= {"notice", "error"}
    assert job.changed == ""
    assert job.outputs["score"] in ("", "87.5")


def test_the_grader_gets_none_of_the_job_s_environment(checkout: Path) -> None:
    """Tokens, in particular, end at this step."""
    run(checkout, 0)
    _, environment = json.loads((checkout / "called.json").read_text())
    assert CANARY not in environment.values()
    assert set(environment) <= {
        "PATH",
        "HOME",
        "LANG",
        "LC_ALL",
        "GITHUB_WORKSPACE",
        "XDG_CACHE_HOME",
        "LC_CTYPE",
        "GRADER_SEED_KEY",
    }


def test_the_seed_key_reaches_the_grader_and_nothing_else(checkout: Path) -> None:
    """It is in its environment, and in no argument, output or summary."""
    job = run(checkout, 0, seed_key="a seed key of enough bytes")
    words, environment = json.loads((checkout / "called.json").read_text())
    assert environment["GRADER_SEED_KEY"] == "a seed key of enough bytes"
    assert "a seed key" not in json.dumps([words, job.outputs, job.summaries, job.log])


def test_inputs_become_words_of_a_command(checkout: Path) -> None:
    """Several in one input, and none of them can be an option or a piece of shell."""
    inputs = {
        "path": "--isolation=none",
        "exercises": "a, b\nc;$(touch x)",
        "rubric": "one rubric.yaml\n\n two.yaml ",
        "minimum_score": "60",
        "isolation": "landlock",
    }
    run(checkout, 0, **inputs)
    words, _ = json.loads((checkout / "called.json").read_text())
    assert words[:5] == ["--no-progress", "--isolation", "landlock", "--audience", "student"]
    assert words[5:13] == ["--exercise", "a", "--exercise", "b", "--exercise", "c;$(touch", "--exercise", "x)"]
    assert words[13:19] == ["--rubric", "one rubric.yaml", "--rubric", "two.yaml", "--min-score", "60"]
    assert words[-2:] == ["--", "--isolation=none"]
    assert not (checkout / "x").exists()


def test_reports_go_where_no_student_can_put_a_link(checkout: Path) -> None:
    """To a folder that the runner made for this step, not to the checkout."""
    run(checkout, 0)
    words, _ = json.loads((checkout / "called.json").read_text())
    places = [word.partition("=")[2] for word in words if "=" in word]
    temporary = str(checkout.parent / "runner" / "temp" / "grading-")
    assert all(place == "-" or place.startswith(temporary) for place in places)


def test_without_an_artifact_name_nothing_is_uploaded(checkout: Path) -> None:
    """Some repositories are public."""
    assert run(checkout, 0, artifact="").uploads == {}


def test_a_machine_without_the_command_says_what_to_do(checkout: Path) -> None:
    """Whoever switched the set-up off reads why nothing is graded."""
    (checkout.parent / "bin" / "grade").unlink()
    environment = job_environment(PATH="/usr/bin:/bin")
    job = run_action(ROOT, checkout, checkout.parent / "runner", environment, setup="false")
    assert job.failed == "Grade"
    assert "grade: expected the command on the PATH, found none" in job.log


def test_the_stand_in_reads_what_a_runner_reads() -> None:
    """Expressions, environment files, and commands that were stopped."""
    contexts = {"inputs": {"a-b": "x"}, "steps": {"s": {"outputs": {"o": "1"}}}}
    assert evaluated("inputs.a-b == 'x' && steps.s.outputs.o != '2'", contexts)
    assert evaluated(" steps.none.outputs.o ", contexts) == ""
    assert pairs("a=b=c\nd<<E\n1\n2\nE\n") == {"a": "b=c", "d": "1\n2"}
    assert [kind for kind, _, _ in obeyed("::stop-commands::t\n::error::x\n::t::\n ::warning::y")] == ["warning"]
