"""Bundles for platforms: complete, small enough, the same every time, and refused where they could not work."""

import csv
import importlib.metadata
import io
import json
import re
import sys
import zipfile
from pathlib import Path

import pytest
from click.testing import CliRunner
from packaging.requirements import Requirement
from places import ROOT

from grader.cli.main import app
from grader.course import packaging
from grader.course.packaging import CLASSROOM50_BYTES, Chosen, classroom50, gradescope, pins, wheel
from grader.runtime.model.errors import EnvironmentFault, KeyFileError, RubricError

pytestmark = pytest.mark.slow


def opened(content: bytes) -> zipfile.ZipFile:
    return zipfile.ZipFile(io.BytesIO(content))


def test_gradescope_s_zip_has_what_the_platform_runs() -> None:
    """Two programs at the top that can be run, and everything that they name."""
    archive = opened(gradescope(Chosen()))
    modes = {info.filename: info.external_attr >> 16 & 0o777 for info in archive.infolist()}
    assert modes["setup.sh"] == modes["run_autograder"] == modes["prepare"] == 0o755
    assert {"constraints.txt", "settings.json", wheel()[0]} <= set(modes)
    assert archive.testzip() is None


@pytest.mark.long
def test_the_same_choice_gives_the_same_bytes() -> None:
    """So that a course can tell whether anything changed."""
    assert gradescope(Chosen()) == gradescope(Chosen())


def test_classroom50_s_bundle_fits() -> None:
    """The platform fetches no more than ten megabytes."""
    files = classroom50(Chosen())
    assert "autograder.py" in files
    assert sum(map(len, files.values())) < CLASSROOM50_BYTES / 4


@pytest.mark.long
def test_a_seed_key_goes_into_the_zip_for_its_owner_alone(tmp_path: Path) -> None:
    """No student sees the zip; without a key it holds none, and one that could be guessed is refused now."""
    (tmp_path / "key").write_text("a seed key of enough bytes\r\n")
    archive = opened(gradescope(Chosen(), tmp_path / "key"))
    assert archive.getinfo("seed.key").external_attr >> 16 & 0o777 == 0o600
    assert archive.read("seed.key") == b"a seed key of enough bytes\n"
    assert "seed.key" not in opened(gradescope(Chosen())).namelist()
    (tmp_path / "key").write_text("short")
    with pytest.raises(KeyFileError, match="expected a key of 16"):
        gradescope(Chosen(), tmp_path / "key")


def test_rubrics_travel_under_names_of_ours() -> None:
    """The settings say where; a name of the course's own could be anything."""
    rubric = ROOT / "rubrics" / "exercise_2" / "rubric.yaml"
    archive = opened(gradescope(Chosen(exercises=("odom_subscriber",), rubrics=(rubric,))))
    chosen = json.loads(archive.read("settings.json"))
    assert chosen == {"exercises": ["odom_subscriber"], "rubrics": ["rubrics/1/rubric.yaml"], "isolation": "auto"}
    assert archive.read("rubrics/1/rubric.yaml") == rubric.read_bytes()


def test_an_exercise_that_no_rubric_has_is_refused_at_once() -> None:
    """Not by the first student."""
    with pytest.raises(RubricError, match="--exercise odometry: expected one of velocity_publisher"):
        gradescope(Chosen(exercises=("odometry",)))


def test_the_wheel_holds_what_an_installation_needs_and_no_solution() -> None:
    """Code, rubrics, scripts, and a record in which every file is right."""
    name, content = wheel()
    archive = opened(content)
    names = set(archive.namelist())
    assert re.fullmatch(r"rclpy_grader-[\w.]+-py3-none-any\.whl", name)
    needed = {
        "grader/cli/main.py",
        "grader/shipped/rubrics/exercise_1/rubric.yaml",
        "grader/shipped/rubrics/exercise_2/odometry/odometry.mcap",
    }
    assert needed | {"grader/shipped/integrations/prepare", "grader/grading/reporting/report.schema.json"} <= names
    assert not [n for n in names if "__pycache__" in n or "reference" in n or "template/" in n]
    record = next(n for n in names if n.endswith("RECORD"))
    rows = list(csv.reader(archive.read(record).decode().splitlines()))
    assert {row[0] for row in rows} == names
    assert all(packaging._recorded(n, archive.read(n)) == f"{n},{d},{s}\n" for n, d, s in rows if n != record)
    scripts = next(n for n in names if n.endswith("entry_points.txt"))
    assert "grade = grader.cli.main:main" in archive.read(scripts).decode()


def test_pins_hold_what_the_package_needs_and_nothing_of_its_developers() -> None:
    """Down to what is needed by what is needed; the ROS wheels above all."""
    names = [line.split("==")[0] for line in pins().splitlines()]
    assert names == sorted(set(names))
    assert {"click", "jinja2", "markupsafe", "ros-jazzy-rclpy", "ros-rmw-fastrtps-cpp", "numpy"} <= set(names)
    assert not {"pytest", "mypy", "rclpy-grader", "pip", "setuptools"} & set(names)


def test_the_pins_of_the_action_name_all_that_is_needed_now() -> None:
    """A requirement that is new has to be pinned as well: grade export constraints > integrations/constraints.txt."""
    kept = (ROOT / "integrations" / "constraints.txt").read_text().splitlines()
    pinned = {each.name for each in map(Requirement, kept) if each.marker is None or each.marker.evaluate()}
    needed = {line.split("==")[0] for line in pins().splitlines()}
    # The file was written with Python 3.11; a newer one needs less.
    assert needed == pinned if sys.version_info[:2] == (3, 11) else needed <= pinned


def test_an_installation_that_does_not_know_its_requirements_is_refused() -> None:
    """A checkout whose requirements grew since it was installed would make a wheel that cannot run."""
    with pytest.raises(EnvironmentFault, match="expected an installation that knows its requirements"):
        packaging._refuse_stale(importlib.metadata.distribution("click"))


@pytest.mark.long
def test_the_command_warns_of_an_autograder_without_a_sandbox(tmp_path: Path) -> None:
    """Whoever wants that learns what it means."""
    done = CliRunner().invoke(app, ["export", "gradescope", str(tmp_path / "a.zip"), "--isolation", "none"])
    assert "can write its own result" in done.output
    assert (tmp_path / "a.zip").exists()


@pytest.mark.long
def test_a_place_that_cannot_be_written_is_named(tmp_path: Path) -> None:
    """In one line."""
    (tmp_path / "file").write_text("")
    done = CliRunner().invoke(app, ["export", "gradescope", str(tmp_path / "file" / "a.zip")])
    assert done.exit_code == 2
    assert "file/a.zip: it cannot be written" in done.output
