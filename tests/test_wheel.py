"""The built wheel: what travels in it, and that it works from any directory without the checkout."""

import hashlib
import os
import re
import runpy
import subprocess
import sys
import tarfile
import zipfile
from pathlib import Path

import pytest

pytestmark = pytest.mark.slow

ROOT = Path(__file__).resolve().parent.parent
HOOK = runpy.run_path(str(ROOT / "hatch_build.py"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the wheel once, with the build backend of the development environment."""
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return next(folder.glob("*.whl"))


def test_rubrics_and_the_recording_travel_and_solutions_do_not(wheel: Path) -> None:
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


def test_the_libraries_of_the_report_travel_as_published_with_their_licences(wheel: Path) -> None:
    """Each file in the wheel is the one that the build hook names; nothing else travels beside them."""
    folder, archive = "grader/reporting/html/vendor", zipfile.ZipFile(wheel)
    wanted = {
        f"{folder}/{HOOK['name_of'](package)}/{name}": digest
        for package, files in HOOK["LIBRARIES"].items()
        for name, digest in files.items()
    }
    found = [name for name in archive.namelist() if name.startswith(folder)]
    assert {name: hashlib.sha256(archive.read(name)).hexdigest() for name in found} == wanted
    assert sum("LICENSE" in name or "NOTICE" in name for name in wanted) == 4


@pytest.fixture
def npm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Put a program in the place of npm, which gives archives with other content."""
    for package, files in HOOK["LIBRARIES"].items():
        archive = re.sub("[/@]", "-", package.lstrip("@"))
        with tarfile.open(tmp_path / f"{archive}.tgz", "w:gz") as packed:
            for name in files:
                packed.add(__file__, f"package/{name}")
    program = tmp_path / "npm"
    program.write_text(f"#!/bin/sh\ncp {tmp_path}/*.tgz .\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path), prepend=os.pathsep)
    return program


def test_a_library_of_other_content_is_refused(npm: Path, tmp_path: Path) -> None:
    """What the registry gives is checked against the digests in the hook, and what was there stays."""
    kept = tmp_path / "vendor" / "kept.js"
    kept.parent.mkdir()
    kept.write_text("kept")
    with pytest.raises(RuntimeError, match=r"echarts@\S+: dist/\S+: expected SHA-256 [0-9a-f]{64}, found [0-9a-f]{64}"):
        HOOK["fetch"](kept.parent)
    assert kept.read_text() == "kept"


def test_a_failure_of_npm_is_told_in_its_own_words(npm: Path, tmp_path: Path) -> None:
    """Without a network the build says what was to be fetched, and what npm said."""
    npm.write_text("#!/bin/sh\necho no network >&2\nexit 1\n")
    with pytest.raises(RuntimeError, match=r"npm pack: expected echarts@[\s\S]*found:\nno network"):
        HOOK["fetch"](tmp_path / "vendor")


@pytest.mark.ros
def test_the_installed_wheel_grades_from_any_directory(wheel: Path, tmp_path: Path) -> None:
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
