"""Real nodes over real DDS, from a folder to a score: the set of submissions, bad input, and what stays behind."""

import json
import os
import signal
import subprocess
import sys
from collections import Counter
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import pytest
from _pytest.mark import ParameterSet
from archive import SEED, outcomes, told
from decided import grade_until_decided, say_nothing
from places import GRADE, ROOT, SHARED
from process_table import running, students_of
from sample_folders import expected, folder_of, golden
from tiers import LONG, NIGHTLY
from waiting import wait_for

from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.model.report import Report

#: What these are told depends on where a loop stood when it was stopped.
UNSTEADY = ("broken/loops_in_callback", "broken/loops_in_constructor", "broken/events_executor", "broken/memory_grows")

pytestmark = pytest.mark.ros


def reasons(report: Report) -> dict[str, str]:
    """Return what a student reads about every criterion."""
    return {v.id: f"{v.reason} | hint: {v.hint}" for exercise in report.exercises for v in exercise.verdicts}


def run(*arguments: Path | int | str, **options: Any) -> subprocess.CompletedProcess[str]:
    return subprocess.run([GRADE, *map(str, arguments)], check=False, capture_output=True, text=True, **options)


#: Of the submissions of a kind that ask the same, the first runs by default, and all but each of so many only nightly.
EACH = 24


def live() -> Iterator[ParameterSet]:
    """Yield every folder, marked where it is left to the nightly run; the recording of each is judged in any case."""
    seen: Counter[tuple[str, ...]] = Counter()
    for folder, entry in expected().items():
        kind = (folder.partition("/")[0], *entry["graded"])
        default = not seen[kind] and kind[0] == "wrong" and len(entry["graded"]) == 1
        yield pytest.param(folder, marks=NIGHTLY if seen[kind] % EACH else () if default else LONG)
        seen[kind] += 1


def of_this_python(verdict: Mapping[str, str]) -> dict[str, str]:
    """Name the Python that runs here in a golden text, which names the one that it was written with."""
    here = "Python {}.{}".format(*sys.version_info)
    return {key: text.replace("(read by Python 3.11)", f"(read by {here})") for key, text in verdict.items()}


@pytest.mark.breadth(2, 6)
@pytest.mark.parametrize("folder", list(live()))
def test_a_submission_gets_what_it_is_worth(folder: str) -> None:
    """A correct node loses nothing however it is written; a wrong one loses what it got wrong."""
    wanted = expected()[folder]
    report = grade_until_decided(GradeRequest(str(folder_of(folder)), exercises=tuple(wanted["graded"]), seed=SEED))
    assert outcomes(report) == wanted["expected"], reasons(report)
    steady = folder not in UNSTEADY and all(exercise.clock.value == "virtual" for exercise in report.exercises)
    # The exception of this one is raised inside rclpy, in the words of the release.
    same_words = report.environment.ros_distro == "jazzy" or folder != "broken/timer_callback_called"
    if steady and same_words:
        assert told(report) == {id_: of_this_python(verdict) for id_, verdict in golden().get(folder, {}).items()}


def test_the_reference_solutions_score_full_on_the_virtual_clock() -> None:
    """All that the exercises ask can be done, and needs no wall clock."""
    report = grade_once(GradeRequest(str(ROOT / "reference_solutions"), clock="virtual"), say_nothing)
    assert outcomes(report) == {}
    assert (report.score, report.max_score, report.final) == (100, 100, True)


@pytest.mark.long
def test_the_template_runs_and_earns_nothing_yet() -> None:
    """The baseline of the skeletons: no crash, no point, nothing undecided."""
    report = grade_until_decided(GradeRequest(str(ROOT / "student_template")))
    assert (report.score, report.final) == (0, True)
    assert [fault for exercise in report.exercises for fault in exercise.faults] == []


@pytest.mark.long
def test_the_wall_clock_gives_the_same_verdict() -> None:
    """A correct publisher is correct on either clock; the report says which one it was."""
    request = GradeRequest(str(ROOT / "reference_solutions"), exercises=("velocity_publisher",), clock="wall")
    report = grade_once(request, say_nothing)
    assert report.exercises[0].clock.value == "wall"
    lost = {i: o for i, o in outcomes(report).items() if o != "undecided"}  # a busy machine decides nothing
    assert lost == {}


@pytest.mark.nightly
def test_the_same_files_give_the_same_report() -> None:
    """Byte for byte, but for the duration; the seed follows from the files."""
    texts = []
    for _ in range(2):
        report = json.loads(run(ROOT / "benchmarks" / "wrong", "--json").stdout)
        report.pop("duration_s")
        texts.append(json.dumps(report))
    assert texts[0] == texts[1]


@pytest.mark.nightly
def test_another_seed_plays_another_part_of_the_recording() -> None:
    """What a student could hard-code is drawn."""
    seeds = [
        json.loads(run(ROOT / "reference_solutions", "--exercise", "odom_subscriber", "--json", "--seed", seed).stdout)
        for seed in (1, 2)
    ]
    assert [report["score"] for report in seeds] == [30, 30]
    evidence = [report["exercises"][0]["criteria"][1]["evidence"] for report in seeds]
    assert evidence[0] != evidence[1]


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("bag", ["neato_square", "turtlebot3_path/path.mcap", "standing_best_effort"])
def test_recordings_of_other_robots_can_be_played(bag: str) -> None:
    """A correct subscriber is correct on anybody's odometry, whatever its pace and its QoS."""
    path = SHARED / "bags" / bag
    if not path.exists():
        pytest.skip(f"{path} is not on this machine")
    done = run(ROOT / "reference_solutions", "--exercise", "odom_subscriber", "--recording", f"/odom={path}")
    assert done.returncode == 0, done.stdout + done.stderr


def test_interrupting_the_grader_leaves_nothing_behind(tmp_path: Path) -> None:
    """Ctrl-C: exit code 130, one line, no process and no folder."""
    submission = tmp_path / "endless"
    submission.mkdir()
    (submission / "velocity_publisher.py").write_text("while True: pass\n")
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [GRADE, str(submission), "--exercise", "velocity_publisher"]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    wait_for(lambda: students_of(process))
    started = students_of(process)
    process.send_signal(signal.SIGINT)
    _, told = process.communicate(timeout=600)
    assert (process.returncode, told) == (130, "interrupted: no report was made\n")
    wait_for(lambda: not started & running())
    assert [path.name for path in tmp_path.iterdir()] == ["endless"]


def test_killing_the_grader_ends_what_it_started(tmp_path: Path) -> None:
    """SIGKILL gives no time to tidy up: the folder stays, but nothing runs on."""
    submission = tmp_path / "endless"
    submission.mkdir()
    (submission / "velocity_publisher.py").write_text("while True: pass\n")
    environment = {**os.environ, "TMPDIR": str(tmp_path)}
    command = [GRADE, str(submission), "--exercise", "velocity_publisher"]
    process = subprocess.Popen(command, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    wait_for(lambda: students_of(process))
    started = students_of(process)
    process.kill()
    process.wait()
    wait_for(lambda: not started & running())


@pytest.mark.long
def test_a_submission_is_never_written_to(tmp_path: Path) -> None:
    """Not even compiled files appear beside the student's."""
    submission = tmp_path / "ada"
    submission.mkdir()
    source = (ROOT / "reference_solutions" / "velocity_publisher.py").read_bytes()
    (submission / "velocity_publisher.py").write_bytes(source)
    before = (submission.stat().st_mtime_ns, sorted(submission.iterdir()))
    assert run(submission, "--exercise", "velocity_publisher").returncode == 0
    assert (submission.stat().st_mtime_ns, sorted(submission.iterdir())) == before
