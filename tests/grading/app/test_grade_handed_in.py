"""Recordings that students hand in, from the submission to the report: what is met, missing, told and kept."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import pytest
from places import ROOT
from recorded_bags import START_NS, drive, write_bag
from rosbags.rosbag2 import StoragePlugin

from grader.course.authoring.checking import check_rubric
from grader.grading.app.grade import grade_in
from grader.grading.app.keeping import EvidenceWriter
from grader.grading.app.rejudge import judgement, rejudge_evidence
from grader.grading.app.request import GradeRequest
from grader.grading.evidence.store import open_evidence
from grader.grading.model.exercise import Exercise, Outcome
from grader.grading.model.report import Report
from grader.grading.model.run import Run
from grader.grading.reporting.json_report import dumps
from grader.grading.reporting.markdown import render_markdown
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.session import RecordingSession

pytestmark = [pytest.mark.sandbox, pytest.mark.xdist_group("handed in")]
RUBRIC = """\
schema: grader/rubric/v1
exercise: {id: square, number: 1, title: A square}
FILES
scenarios:
  - id: drive
    handed_in: {bag: "*.mcap"SIZE}
SCENARIOS
criteria:
  - id: odometry
    title: Publishes odometry
    points: 5
    scenario: drive
    check: {publishes: {topic: /odom, type: nav_msgs/msg/Odometry}}
  - id: rate
    title: At 10 Hz
    points: 5
    scenario: drive
    check: {topic_rate: {topic: /odom, rate: 10 Hz, tolerance: 0.5 Hz}}
    needs: [odometry]
  - id: stands
    title: Twist
    points: 5
    scenario: drive
    check: {publishes: {topic: /cmd_vel, type: geometry_msgs/msg/Twist}}
"""


def rubric(folder: Path, *, size: str = "", files: str = "", scenarios: str = "", criteria: str = "") -> Path:
    path = folder / "square.yaml"
    text = RUBRIC.replace("FILES\n", files).replace("SIZE", size).replace("SCENARIOS\n", scenarios) + criteria
    path.write_text(text, encoding="utf-8")
    return path


def handed_in(folder: Path) -> Path:
    place = folder / "ada"
    place.mkdir(exist_ok=True)
    return place


def grade(
    session: RecordingSession,
    submission: Path,
    rubric_: Path,
    on_recorded: Callable[[Run, Sequence[Exercise]], None] | None = None,
) -> Report:
    request = GradeRequest(str(submission), rubrics=(rubric_,), seed=1)
    return grade_in(session, request, lambda _: None, on_recorded, pictures=True)


def outcomes(report: Report) -> dict[str, Outcome]:
    return {verdict.id: verdict.outcome for verdict in report.exercises[0].verdicts}


def test_a_recording_is_judged_and_told_as_recorded_by_the_student(
    one_worker: RecordingSession, tmp_path: Path
) -> None:
    write_bag(handed_in(tmp_path) / "bags" / "run", {"/odom": drive(60)})
    report = grade(one_worker, tmp_path / "ada", rubric(tmp_path))
    assert outcomes(report) == {"odometry": Outcome.MET, "rate": Outcome.MET, "stands": Outcome.NOT_MET}
    last = report.exercises[0].verdicts[-1]
    assert last.reason == "/cmd_vel: no message in bags/run, which holds /odom [nav_msgs/msg/Odometry]"
    assert last.hint == "record it with `ros2 bag record /cmd_vel`"
    note = "bags/run: recorded by the student, not observed: odometry, rate and stands rest on it"
    assert report.exercises[0].notes == (note,)
    assert note in " ".join(render_markdown(report).replace("\\", "").split())
    assert report.exercises[0].clock_reason == ""
    assert report.final


def test_the_rubric_of_the_page_grades(one_worker: RecordingSession, tmp_path: Path) -> None:
    """The example that authors begin with."""
    page = (ROOT / "docs" / "how-to" / "recordings.md").read_text(encoding="utf-8")
    path = tmp_path / "lab.yaml"
    path.write_text(page.split("```yaml\n")[1].split("```")[0])
    assert check_rubric(path).warnings == ()
    write_bag(handed_in(tmp_path) / "bags" / "run", {"/odom": drive(60)})
    report = grade(one_worker, tmp_path / "ada", path)
    assert report.score == report.max_score == 10
    (note,) = report.exercises[0].notes
    assert f"note: {note}" in page


def test_another_type_and_another_topic_are_told(one_worker: RecordingSession, tmp_path: Path) -> None:
    twist = [(START_NS + n * NS_PER_S // 10, b"\0\1\0\0" + bytes(48)) for n in range(20)]
    types = {"/odom": "geometry_msgs/msg/Twist", "/robot/cmd_vel": "geometry_msgs/msg/Twist"}
    write_bag(handed_in(tmp_path) / "run", {"/odom": twist, "/robot/cmd_vel": twist}, types=types)
    odometry, rate, stands = grade(one_worker, tmp_path / "ada", rubric(tmp_path)).exercises[0].verdicts
    expected = "expected nav_msgs/msg/Odometry"
    assert odometry.reason == f"/odom: 20 messages of type geometry_msgs/msg/Twist, {expected}"
    assert rate.outcome is Outcome.BLOCKED
    assert stands.hint == "publish on /cmd_vel instead of /robot/cmd_vel, and record it"


_HAND_IN = (
    "hand in one recording named *.mcap, as `ros2 bag record --storage mcap` makes it: its folder, or its .mcap file"
)


@pytest.mark.parametrize(
    ("files", "reason", "hint"),
    [
        ((), "*.mcap: not in the submission", _HAND_IN),
        (("a.mcap", "b.mcap"), "*.mcap: expected one recording, found 2: a.mcap and b.mcap", "hand in the one that"),
        (("a.db3",), "*.mcap: not in the submission; found a.db3", _HAND_IN),
        (
            ("a.mcap",),
            "*.mcap: a.mcap: expected a complete rosbag2 recording, found a damaged one",
            "copy or record it",
        ),
    ],
)
def test_what_is_missing_or_broken_costs_one_criterion_its_points_and_blocks_the_others(
    one_worker: RecordingSession, tmp_path: Path, files: Sequence[str], reason: str, hint: str
) -> None:
    place = handed_in(tmp_path)
    (place / "README.md").write_text("It drove.\n")
    for name in files:
        (place / name).write_bytes(b"something else")
    report = grade(one_worker, place, rubric(tmp_path))
    first, *others = report.exercises[0].verdicts
    assert first.outcome is Outcome.NOT_MET
    assert first.reason.startswith(reason)
    assert first.hint.startswith(hint)
    assert {verdict.outcome for verdict in others} == {Outcome.BLOCKED}
    assert report.final


def test_a_larger_one_than_the_rubric_allows_is_told_with_both_sizes(
    one_worker: RecordingSession, tmp_path: Path
) -> None:
    write_bag(handed_in(tmp_path) / "run", {"/odom": drive(60)})
    report = grade(one_worker, tmp_path / "ada", rubric(tmp_path, size=", size: 10 KiB"))
    reason = report.exercises[0].verdicts[0].reason
    assert reason.startswith("*.mcap: run: expected at most 10 KiB, found 5")
    assert reason.endswith(" KiB")


@pytest.mark.ros
def test_a_rubric_may_run_programs_as_well(one_worker: RecordingSession, tmp_path: Path) -> None:
    """A missing recording leaves the other scenario alone, and the other way round."""
    both = rubric(
        tmp_path,
        files="files: [node.py]\n",
        scenarios="  - id: alone\n    processes: [node.py]\n    observe: {duration: 1 s}\n",
        criteria="  - {id: ends, title: Runs, points: 5, scenario: alone, check: {no_fault: {process: node.py}}}\n",
    )
    place = handed_in(tmp_path)
    (place / "node.py").write_text("import rclpy\nrclpy.init()\nrclpy.spin(rclpy.create_node('node'))\n")
    without = grade(one_worker, place, both)
    assert outcomes(without)["ends"] is Outcome.MET
    assert outcomes(without)["odometry"] is Outcome.NOT_MET
    write_bag(place / "run", {"/odom": drive(60)})
    (place / "node.py").unlink()
    whole = grade(one_worker, place, both)
    assert outcomes(whole)["odometry"] is Outcome.MET
    assert whole.exercises[0].verdicts[-1].reason == "node.py: not in the submission"


def test_evidence_keeps_it_and_is_judged_again_the_same(one_worker: RecordingSession, tmp_path: Path) -> None:
    write_bag(handed_in(tmp_path) / "run", {"/odom": drive(60)}, plugin=StoragePlugin.MCAP)
    path = rubric(tmp_path)
    request = GradeRequest(str(tmp_path / "ada"), rubrics=(path,), seed=1)
    writer = EvidenceWriter([tmp_path / "kept"], request)
    report = grade(one_worker, tmp_path / "ada", path, writer.remember)
    writer.write(report)
    evidence = open_evidence(tmp_path / "kept")
    again = rejudge_evidence(evidence, judgement((), (path,), verify=True))
    assert outcomes(again) == outcomes(report)
    assert again.exercises[0].notes == report.exercises[0].notes
    assert dumps(replace(again, duration_s=0.0, reproduce=report.reproduce)) == dumps(replace(report, duration_s=0.0))
