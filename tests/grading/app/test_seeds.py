"""Keys and seeds: what drawn values follow from, and that nobody who is graded ever sees the key."""

import os
import subprocess
import sys
from pathlib import Path

import pytest
from places import GRADE, ROOT

from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.app.seeds import PRACTICE, PRACTICE_NOTE, SeedKey, kept_key, seed_key
from grader.grading.evidence.store import open_evidence, run_of
from grader.runtime.model.errors import KeyFileError

KEY = "a-key-that-nobody-must-ever-see-5f2e"


def test_a_seed_follows_from_key_and_digest() -> None:
    """The same files get the same run, others another one, and another class yet another one."""
    one, other = SeedKey(b"one key of 16 bytes"), SeedKey(b"two key of 16 bytes")
    assert one.seed("sha256:aa") == one.seed("sha256:aa")
    assert len({key.seed(digest) for key in (one, other, PRACTICE) for digest in ("sha256:aa", "sha256:ab")}) == 6


def test_seeds_are_numbers_that_people_can_type() -> None:
    """And that every reader of JSON holds exactly."""
    seeds = [PRACTICE.seed(f"sha256:{n}") for n in range(100)]
    assert all(0 <= seed < 2**48 for seed in seeds)
    assert max(seeds) > 2**40  # too many to try all of them


def test_a_key_is_in_no_text_made_of_it() -> None:
    """Tracebacks show values of dataclasses."""
    assert KEY not in repr(SeedKey(KEY.encode()))


def test_a_run_takes_the_key_that_it_is_given(tmp_path: Path) -> None:
    """An option comes before the variable, and the variable is gone afterwards."""
    (tmp_path / "key").write_text("another key, also long enough\n")
    environment = {"GRADER_SEED_KEY": f" {KEY}\n"}
    assert seed_key(None, environment) == SeedKey(KEY.encode())
    assert environment == {}
    assert seed_key(tmp_path / "key", {"GRADER_SEED_KEY": KEY}) == SeedKey(b"another key, also long enough")
    assert seed_key(None, {}) is None
    assert seed_key(None, {"GRADER_SEED_KEY": ""}) is None  # a CI where the secret is not set


def test_a_variable_that_is_no_key_is_refused_without_showing_it() -> None:
    """A log of CI can be read by students."""
    with pytest.raises(KeyFileError, match="GRADER_SEED_KEY: expected a key of 16 to 4096 bytes, found 5") as refusal:
        seed_key(None, {"GRADER_SEED_KEY": "short"})
    assert "short" not in refusal.value.message + refusal.value.hint


def test_a_kept_key_is_made_once_for_its_owner_alone(tmp_path: Path) -> None:
    """Whatever the umask says; a copy that others could read is closed again."""
    path = tmp_path / "key"
    before = os.umask(0)
    try:
        made = kept_key(path)
    finally:
        os.umask(before)
    assert path.stat().st_mode & 0o777 == 0o600
    assert len(made.value) >= 32
    path.chmod(0o644)
    assert kept_key(path) == made
    assert path.stat().st_mode & 0o777 == 0o600
    assert kept_key(tmp_path / "other") != made


def test_a_kept_key_that_was_damaged_is_not_replaced(tmp_path: Path) -> None:
    """All seeds would change without a word."""
    (tmp_path / "key").write_text("")
    with pytest.raises(KeyFileError, match="expected a key of 16 to 4096 bytes, found 0"):
        kept_key(tmp_path / "key")


def test_a_link_is_no_kept_key(tmp_path: Path) -> None:
    """A folder for results may come from somewhere else."""
    (tmp_path / "target").write_text(KEY)
    (tmp_path / "key").symlink_to(tmp_path / "target")
    with pytest.raises(KeyFileError, match="not a regular file"):
        kept_key(tmp_path / "key")


def grade(*arguments: Path | int | str, **environment: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [GRADE, *map(str, arguments)],
        env={**os.environ, **environment},
        check=False,
        capture_output=True,
        text=True,
    )


def test_a_seed_and_a_key_exclude_each_other(tmp_path: Path) -> None:
    """It would not be clear which one the values follow from."""
    done = grade(tmp_path, "--seed", 1, "--seed-key", tmp_path / "key")
    assert (done.returncode, "--seed and --seed-key exclude each other" in done.stderr) == (2, True)


SPY = """
import os
from pathlib import Path

import rclpy

rclpy.init()
node = rclpy.create_node("velocity_publisher")
for name in ("environ", "cmdline"):
    for path in Path("/proc").glob(f"[0-9]*/{name}"):
        try:
            node.get_logger().info(f"{path} {path.read_bytes()!r}")
        except OSError as error:
            node.get_logger().info(f"{path} {error}")
node.get_logger().info(f"{dict(os.environ)}")
rclpy.spin(node)
"""


@pytest.mark.ros
@pytest.mark.parametrize(
    "given", [pytest.param("variable", marks=pytest.mark.long), pytest.param("file", marks=pytest.mark.nightly)]
)
def test_nothing_of_the_key_leaves_the_grader(tmp_path: Path, given: str) -> None:
    """Not to reports, evidence or messages, nor to a student's process, which looks for it."""
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "velocity_publisher.py").write_text(SPY)
    (tmp_path / "key").write_text(KEY)
    how = {"GRADER_SEED_KEY": KEY} if given == "variable" else {}
    words: list[Path | str] = [tmp_path / "in", "--exercise", "velocity_publisher", "--json"]
    words += ["-o", f"evidence={tmp_path / 'out' / 'evidence'}", "-o", f"html={tmp_path / 'out' / 'page.html'}"]
    (tmp_path / "out").mkdir()
    key: list[Path | str] = ["--seed-key", tmp_path / "key"] if given == "file" else []
    done = grade(*words, *key, **how)
    assert done.returncode == 1, done.stderr
    evidence = open_evidence(tmp_path / "out" / "evidence")
    recorded = repr(run_of(evidence, read_exercises(GradeRequest("", exercises=("velocity_publisher",)))))
    assert "RMW_IMPLEMENTATION" in recorded  # the spy did look
    kept = [path.read_bytes() for path in (tmp_path / "out").rglob("*") if path.is_file()]
    for text in (done.stdout.encode(), done.stderr.encode(), recorded.encode(), *kept):
        assert KEY.encode() not in text
    assert PRACTICE_NOTE not in done.stdout


@pytest.mark.long
@pytest.mark.ros
def test_a_run_without_a_key_says_that_its_values_can_be_known() -> None:
    """A student's own run; with a seed of its own there is nothing to say."""
    words: list[Path | str] = [ROOT / "reference_solutions", "--exercise", "velocity_publisher", "--json"]
    assert PRACTICE_NOTE in grade(*words, GRADER_SEED_KEY="").stdout
    assert PRACTICE_NOTE not in grade(*words, "--seed", 7).stdout


#: Prints the plan and the digest of each scenario of some rubrics, with the submission that is beside the rubric.
PLANNING = """
import sys
from pathlib import Path
from grader.grading.app.bags import read_recordings
from grader.grading.app.request import GradeRequest
from grader.runtime.model.submission import StudentFile, Submission
from grader.grading.evidence.manifest import scenario_digest
from grader.runtime.plan import Surroundings, plan_scenario
from grader.grading.rubrics.loader import read_rubric
for path in map(Path, sys.argv[1:]):
    exercise = read_rubric(path)
    files = {name: StudentFile(name, name) for name in exercise.files}
    submission = Submission("x", "x", path.parent / "reference", "sha256:0", files)
    for scenario in exercise.scenarios:
        played = read_recordings(GradeRequest("x"), [exercise])
        plan = plan_scenario(exercise.id, scenario, submission, Surroundings(7, "virtual", played))
        print(scenario_digest(scenario), plan)
"""


@pytest.mark.nightly
def test_what_is_drawn_does_not_depend_on_the_hashes_of_the_grader() -> None:
    """Python draws them anew for each process, and a set of names has another order then."""
    examples = [path for path in ROOT.glob("examples/*/*.yaml") if path.stem == path.parent.name]
    rubrics = sorted([*ROOT.glob("rubrics/*/rubric.yaml"), *examples])
    assert len(rubrics) == 14
    command = [sys.executable, "-c", PLANNING, *map(str, rubrics)]
    told = [
        subprocess.run(command, env={**os.environ, "PYTHONHASHSEED": seed}, capture_output=True, text=True, check=True)
        for seed in ("1", "2", "3")
    ]
    assert told[0].stdout == told[1].stdout == told[2].stdout
    assert "PlannedSimulation" in told[0].stdout
