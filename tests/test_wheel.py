"""The built wheel: what travels in it, and that it works from any directory without the checkout."""

import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    """Build the wheel once, with the build backend of the development environment."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return next(folder.glob("*.whl"))


def test_rubrics_and_the_recording_travel_and_solutions_do_not(wheel):
    """An instructor needs nothing but the wheel; a student finds no solution in it."""
    names = zipfile.ZipFile(wheel).namelist()
    for needed in (
        "exercise_1.yaml",
        "exercise_2.yaml",
        "exercise_3.yaml",
        "rubric.schema.json",
        "odometry/metadata.yaml",
    ):
        assert f"grader/shipped/rubrics/{needed}" in names
    assert "grader/reporting/report.schema.json" in names
    assert "grader/student_host/fastdds.xml" in names
    assert "grader/shipped/student_template/velocity_publisher.py" in names
    assert not [name for name in names if "reference" in name or name.startswith(("tests/", "student_template/"))]


@pytest.mark.ros
def test_the_installed_wheel_grades_from_any_directory(wheel, tmp_path):
    """Nothing of the checkout is needed to grade, and nothing of it is used."""
    site = tmp_path / "site"
    install = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        str(site),
        str(wheel),
    ]
    subprocess.run(install, check=True)
    submission = tmp_path / "ada"
    submission.mkdir()
    (submission / "velocity_publisher.py").write_bytes(
        (ROOT / "reference_solutions/velocity_publisher.py").read_bytes()
    )
    program = (
        "import sys; sys.path.insert(0, sys.argv.pop(1))\n"
        "import grader.cli.main; assert grader.__file__.startswith(sys.path[0]), grader.__file__\n"
        "grader.cli.main.main()"
    )
    command = [sys.executable, "-c", program, str(site), "ada", "--exercise", "velocity_publisher"]
    done = subprocess.run(command, check=False, cwd=tmp_path, env=dict(os.environ), capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("ada: 30 of 30 points")
