"""The stages of grading that need no ROS: which exercises, which recording, which seed."""

import os
import subprocess
from pathlib import Path
from typing import Any

import pytest
from tracing import ODOMETRY

from grader.grading.app import start
from grader.grading.app.bags import read_given, read_recordings
from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once, may_run, opened_early
from grader.grading.model.exercise import Location, Outcome
from grader.grading.rubrics.builtin import builtin_rubrics, exercise_ids
from grader.runtime.model.errors import RecordingError, RubricError, SubmissionError
from grader.runtime.ros_installation import find_ros


def test_all_exercises_are_graded_unless_some_are_named() -> None:
    """The order is that of the rubrics, not that of the command."""
    assert [e.number for e in read_exercises(GradeRequest("x"))] == ["1", "2", "3"]
    named = GradeRequest("x", exercises=("two_node_communication", "velocity_publisher"))
    assert [e.id for e in read_exercises(named)] == ["velocity_publisher", "two_node_communication"]


def test_an_unknown_exercise_names_the_nearest() -> None:
    """A slip of the finger is answered with the name that was meant, anything else with all there are."""
    with pytest.raises(RubricError, match="--exercise velocity_publishr: expected one of velocity_publisher") as error:
        read_exercises(GradeRequest("x", exercises=("velocity_publishr",)))
    assert error.value.hint == "did you mean velocity_publisher"
    with pytest.raises(RubricError) as error:
        read_exercises(GradeRequest("x", exercises=("9",)))
    assert error.value.hint == "grade --exercise 1 grades the first exercise"
    assert all(id_ in error.value.message for id_ in builtin_rubrics())


@pytest.mark.parametrize(
    ("name", "id_"),
    [
        ("1", "velocity_publisher"),
        ("Exercise 2", "odom_subscriber"),
        ("velocity_publisher.py", "velocity_publisher"),
        ("src/fan_controller.py", "two_node_communication"),
        ("project 2", "joint_subscriber"),
        ("project_3", "battery_service"),
    ],
)
def test_an_exercise_may_be_named_as_its_task_sheet_or_its_file(name: str, id_: str) -> None:
    """A number, a project or a file; reports name the id."""
    exercises = read_exercises(GradeRequest("x", exercises=(name, id_)))
    assert [e.id for e in exercises] == [id_]
    assert exercise_ids((name, id_), exercises) == (id_,)


def test_what_holds_no_file_to_run_is_graded_without_a_process(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """But for the one that reads it: names show it before anything is started, or texts before anything is run."""
    started: Any = subprocess.Popen.__init__

    def refuse(*given: object, **options: object) -> None:
        if "grader.grading.submissions.submission_reader" not in str(given[1:]):
            pytest.fail("a process was started")
        started(*given, **options)

    find_ros()  # once for each process, perhaps by asking another one
    monkeypatch.setattr(subprocess.Popen, "__init__", refuse)
    monkeypatch.setattr(os, "posix_spawn", refuse)
    (tmp_path / "velocity_pub.py").write_text("import rclpy")
    for place in (tmp_path, tmp_path / "velocity_pub.py"):
        report = grade_once(GradeRequest(str(place), isolation="none"), lambda _: None)
        assert {v.outcome for e in report.exercises for v in e.verdicts} == {Outcome.NOT_MET, Outcome.BLOCKED}
    (tmp_path / "velocity_publisher.py").write_text("import rclpy\n\ndef main()\n    rclpy.init()\n")
    monkeypatch.setattr(start, "may_run", lambda *_: False)  # a worker would be started early, and not be used
    report = grade_once(GradeRequest(str(tmp_path), isolation="none"), lambda _: None)
    first = report.exercises[0].verdicts[0]
    assert "SyntaxError" in first.reason
    assert first.location == Location("velocity_publisher.py", 3)
    (tmp_path / "velocity_publisher.py").write_text("# still to be written\n")
    report = grade_once(GradeRequest(str(tmp_path), isolation="none"), lambda _: None)
    assert report.exercises[0].verdicts[0].reason == "velocity_publisher.py exited after 0.0 s with code 0"


@pytest.mark.parametrize("id_", builtin_rubrics())
def test_a_worker_is_started_for_every_file_of_an_exercise(id_: str, tmp_path: Path) -> None:
    """As a file, in a folder, and whatever an archive or a rubric of one's own asks for."""
    for name in read_exercises(GradeRequest("x", exercises=(id_,)))[0].files:
        (tmp_path / "in").mkdir(exist_ok=True)
        (tmp_path / "in" / name).write_text("import rclpy")
        assert may_run(str(tmp_path / "in" / name))
        assert may_run(str(tmp_path))
        (tmp_path / "in" / name).unlink()
    assert not may_run(str(tmp_path))
    assert may_run(str(tmp_path / "in.zip"))
    assert may_run(str(tmp_path), [Path("own.yaml")])


def test_the_recording_is_read_only_where_it_is_played(tmp_path: Path) -> None:
    """Exercise 1 plays none; a recording that was named must be usable all the same."""
    first = GradeRequest("x", exercises=("velocity_publisher",))
    assert read_recordings(first, read_exercises(first)) == {}
    second = GradeRequest("x", exercises=("odom_subscriber",))
    (recording,) = read_recordings(second, read_exercises(second)).values()
    assert recording.topic == "/odom"
    named = GradeRequest("x", exercises=("velocity_publisher",), bags=((ODOMETRY, tmp_path / "none.mcap"),))
    with pytest.raises(RecordingError):
        read_given(named, read_recordings(named, read_exercises(named)))


@pytest.mark.parametrize("name", ["a" * 5000, "a" * 5000 + ".py", "a\0b", "a\0b.py", ""])
def test_a_name_that_no_file_can_have_starts_nothing_and_is_named(name: str) -> None:
    """The system's own error for such a name is not the answer."""
    with opened_early(name, (), "none", lambda _: None) as session:
        assert session is None
    with pytest.raises(SubmissionError):
        grade_once(GradeRequest(name, isolation="none"), lambda _: None)
