"""The GitLab job: its commands run in order, with a grader that is only heard, not believed."""

import os
import subprocess
from pathlib import Path

import pytest
from places import ROOT
from tables import read_table

pytestmark = pytest.mark.slow

JOB = read_table(ROOT / "integrations" / "gitlab" / "grade.yml")["grade"]
#: Sets a program up that notes its words and the files it was given, and ends with 3.
PREPARE = """mkdir -p "$1/bin"
cat > "$1/bin/grade" <<'EOF'
#!/bin/sh
printf '%s\\n' "$@" > "$CI_PROJECT_DIR/words"
ls "$1" > "$CI_PROJECT_DIR/files"
touch grading/report.xml
exit 3
EOF
chmod +x "$1/bin/grade"
echo "$2 $3" > "$CI_PROJECT_DIR/prepared"
"""


def git(folder: Path, *words: str) -> str:
    """Run git in a folder, as somebody."""
    somebody = ["-c", "user.name=A", "-c", "user.email=a@b", "-c", "init.defaultBranch=main"]
    done = subprocess.run(["git", *somebody, *words], cwd=folder, check=True, capture_output=True, text=True)
    return done.stdout.strip()


def repository(folder: Path, files: dict[str, str]) -> str:
    """Make a repository with one commit, and return that."""
    for name, text in files.items():
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_text(text)
    git(folder, "init")
    git(folder, "add", ".")
    git(folder, "commit", "-m", "all")
    return git(folder, "rev-parse", "HEAD")


@pytest.fixture
def environment(tmp_path: Path) -> dict[str, str]:
    """Return the environment of a job in a student's checkout, beside a grader's repository."""
    commit = repository(tmp_path / "grader", {"integrations/prepare": PREPARE, "integrations/constraints.txt": ""})
    checkout = tmp_path / "checkout"
    repository(checkout, {"velocity_publisher.py": "x = 1\n", ".gitignore": "left\n"})
    (checkout / "left").write_text("by an earlier job")
    (tmp_path / "bin").mkdir()
    for program in ("bwrap", "apt-get"):
        (tmp_path / "bin" / program).write_text("#!/bin/sh\n")
        (tmp_path / "bin" / program).chmod(0o755)
    given = {"GRADER_REPOSITORY": str(tmp_path / "grader"), "GRADER_COMMIT": commit, "CI_PROJECT_DIR": str(checkout)}
    path = f"{tmp_path / 'bin'}{os.pathsep}{os.environ['PATH']}"
    return {**JOB["variables"], **given, "GRADER_HOME": str(tmp_path / "home"), "PATH": path}


def run(environment: dict[str, str]) -> subprocess.CompletedProcess[str]:
    """Run the commands of the job as a runner does, in one shell that ends with the first failure."""
    script = "\n".join(["set -eo pipefail", *JOB["before_script"], *JOB["script"]])
    folder = environment["CI_PROJECT_DIR"]
    return subprocess.run(
        ["bash", "-c", script], cwd=folder, env=environment, check=False, capture_output=True, text=True
    )


def test_what_was_handed_in_is_graded_by_the_commit(environment: dict[str, str]) -> None:
    """Without what earlier jobs left; the exit code is the grader's, so that 3 is tried again."""
    done = run({**environment, "GRADER_EXERCISES": "one two"})
    checkout, home = Path(environment["CI_PROJECT_DIR"]), environment["GRADER_HOME"]
    assert done.returncode == 3, done.stderr
    assert JOB["retry"]["exit_codes"] == [3]
    assert (checkout / "prepared").read_text().split() == [home, f"{home}/integrations/constraints.txt"]
    assert (checkout / "files").read_text().split() == ["velocity_publisher.py"]
    words = (checkout / "words").read_text().split()
    assert words[:5] == [f"{home}/submission", "--exercise", "one", "--exercise", "two"]
    assert words[5:12] == ["--no-progress", "--audience", "student", "--isolation", "landlock", "--min-score", "100"]
    assert words[12:] == ["-o", "junit=grading/report.xml", "-o", "html=grading/report.html"]
    assert (checkout / JOB["artifacts"]["reports"]["junit"]).exists()


@pytest.mark.long
@pytest.mark.parametrize("name", ["GRADER_REPOSITORY", "GRADER_COMMIT"])
def test_what_was_not_filled_in_is_named(environment: dict[str, str], name: str) -> None:
    """Before anything is fetched."""
    del environment[name]
    done = run(environment)
    assert done.returncode not in (0, 3)
    assert f"{name}: set it to" in done.stderr
