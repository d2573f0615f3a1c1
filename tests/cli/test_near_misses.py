"""Command lines that are nearly right: what was probably meant is said, and exit code 2 stays."""

from __future__ import annotations

from pathlib import Path

import pytest
from click.testing import CliRunner
from places import ROOT

from grader.cli import main
from grader.grading.app.grade import belonging, names_a_program, read_exercises, wanted_files
from grader.grading.app.request import GradeRequest
from grader.grading.submissions.submission import stage_submission

FILES = (
    "velocity_publisher.py",
    "homework/odom_subscriber.py",
    "x.ipynb",
    "fan_controller.txt",
    "odom_subscriber.py.txt",
)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder of a student, which is the current one."""
    for name in FILES:
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("import rclpy\n")
    monkeypatch.chdir(tmp_path)
    return tmp_path


MEANT = [
    ("1", "did you mean --exercise 1"),
    ("project 1", 'did you mean --exercise "project 1"'),
    ("exercise 3", "did you mean --exercise 3"),
    ("exercise_2", "did you mean --exercise exercise_2"),
    ("odom_subscriber", "did you mean --exercise odom_subscriber"),
    (". 1", "did you mean --exercise 1"),
    ("homework project 2", 'did you mean --exercise "project 2"'),
    ("velocity_publisher", "did you mean velocity_publisher.py"),
    ("Velocity_Publisher.py", "did you mean velocity_publisher.py"),
    ("velocty_publisher.py", "did you mean velocity_publisher.py"),
    ("homewrok", "did you mean homework"),
    ("homework/odom_subscriber", "did you mean homework/odom_subscriber.py"),
    ("velocity_publisher.py homework/odom_subscriber.py", "name the folder that holds the files"),
    ("docter", "did you mean grade doctor"),
    ("help", "did you mean grade --help"),
    ("x.ipynb", "x.ipynb is a notebook: export it as a Python script"),
    ("fan_controller.txt", "rename fan_controller.txt so that it ends in .py"),
    ("odom_subscriber.py.txt", "rename odom_subscriber.py.txt so that it ends in .py"),
    ("nothing_of_the_kind", "check the path, and the folder you are in"),
    (". --html", "did you mean -o html=report.html"),
    (". --junit", "did you mean -o junit=report.xml"),
    (". --report", "did you mean -o html=report.html"),
]


@pytest.mark.parametrize(("words", "hint"), MEANT, ids=[words for words, _ in MEANT])
def test_a_hint_says_what_was_probably_meant(here: Path, words: str, hint: str) -> None:
    """As the second line of the error, ready to be typed."""
    result = CliRunner().invoke(main.app, words.split(), prog_name="grade")
    error, said = result.stderr.splitlines()
    assert error.startswith("error: ")
    assert said.startswith(f"hint: {hint}")
    assert (result.exit_code, result.stdout) == (2, "")


OUTPUTS = [
    ("report.html", "html=report.html"),
    ("report.md", "markdown=report.md"),
    ("report.pdf", "html=report.html"),
    ("html", "html=report.html"),
    ("html:page.html", "html=page.html"),
    ("=html=page.html", "html=page.html"),
]


@pytest.mark.parametrize(("value", "meant"), OUTPUTS)
def test_an_output_without_a_format_is_completed(here: Path, value: str, meant: str) -> None:
    """The suffix tells the format."""
    result = CliRunner().invoke(main.app, [".", "-o", value], prog_name="grade")
    assert f"expected FORMAT=PATH, found '{value}'; did you mean {meant}" in result.stderr
    assert result.exit_code == 2


BELONGS = [
    ("velocity_publisher.py", ["velocity_publisher"]),
    ("fan_controller.py", ["two_node_communication"]),
    ("simple_publisher.py", ["joint_publisher"]),
    ("Velocity_Publisher.py", ["velocity_publisher"]),
    ("odomsubscriber.py", ["odom_subscriber"]),
    ("something_else.py", []),
]


@pytest.mark.parametrize(("name", "ids"), BELONGS)
def test_one_file_is_graded_by_the_exercises_that_it_belongs_to(tmp_path: Path, name: str, ids: list[str]) -> None:
    """By its name, or by a name that is like it; also by a project, which a folder is not graded by."""
    file, staged = tmp_path / name, tmp_path / "staged"
    file.write_text("print('hello')\n")
    staged.mkdir()
    request = GradeRequest(submission=str(file))
    assert names_a_program(request)
    every = read_exercises(GradeRequest(submission=str(file), every=True))
    submission = stage_submission(str(file), wanted_files(every), staged)
    assert [exercise.id for exercise in belonging(every, submission)] == ids


def test_a_folder_or_chosen_exercises_are_left_as_they_are(tmp_path: Path) -> None:
    """Only one file that is named alone limits what is graded."""
    (tmp_path / "a.py").write_text("")
    assert not names_a_program(GradeRequest(submission=str(tmp_path)))
    assert not names_a_program(GradeRequest(submission=str(tmp_path / "a.py"), exercises=("velocity_publisher",)))
    assert not names_a_program(GradeRequest(submission=str(tmp_path / "b.py")))


@pytest.mark.ros
def test_a_right_file_alone_gets_all_of_its_points() -> None:
    """30 of 30, and exit code 0."""
    file = ROOT / "reference_solutions" / "velocity_publisher.py"
    result = CliRunner().invoke(main.app, [str(file), "--no-progress"], prog_name="grade")
    assert result.stdout.startswith("velocity_publisher.py: 30 of 30 points\n")
    assert "Fix first" not in result.stdout
    assert result.exit_code == 0


@pytest.mark.parametrize(
    ("value", "options", "told"), [("none", (), True), ("auto", (), False), ("none", ("--isolation", "none"), False)]
)
def test_a_sandbox_that_is_not_read_for_a_class_is_named(
    tmp_path: Path, value: str, options: tuple[str, ...], told: bool
) -> None:
    """A class is not graded without a sandbox because of a variable that was set for something else."""
    (tmp_path / "class").mkdir()
    words = ["batch", str(tmp_path / "class"), "-o", str(tmp_path / "out"), *options]
    result = CliRunner().invoke(main.app, words, env={"GRADER_ISOLATION": value})
    assert result.exit_code == 2  # nobody handed in anything
    said = "note: GRADER_ISOLATION is not read for a class: give --isolation none instead"
    assert (said in result.output) == told
