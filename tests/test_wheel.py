"""The built wheel: what travels in it, and that it works from any directory without the checkout."""

import email
import hashlib
import os
import re
import runpy
import shutil
import subprocess
import sys
import tarfile
import venv
import zipfile
from pathlib import Path

import click
import pytest
from places import ROOT

from grader.cli.main import app

pytestmark = pytest.mark.slow

HOOK = runpy.run_path(str(ROOT / "hatch_build.py"))


@pytest.fixture(scope="module")
def packages(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Build the source package and, from that, the wheel, once, with the development environment's backend."""
    folder = tmp_path_factory.mktemp("packages")
    command = [sys.executable, "-m", "build", "--no-isolation", "--outdir", str(folder), str(ROOT)]
    subprocess.run(command, check=True, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    return folder


@pytest.fixture(scope="module")
def wheel(packages: Path) -> Path:
    """Return the wheel."""
    return next(packages.glob("*.whl"))


@pytest.mark.nightly
def test_an_index_takes_the_packages(packages: Path) -> None:
    """Its own checker has no complaint, not even a warning."""
    command = [sys.executable, "-m", "twine", "check", "--strict", *map(str, packages.iterdir())]
    done = subprocess.run(command, check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout
    assert done.stdout.count("PASSED") == 2


@pytest.mark.long
def test_the_description_leads_to_the_repository(wheel: Path) -> None:
    """No link of the README is relative, each leads to this version, and the addresses are those of one repository."""
    archive = zipfile.ZipFile(wheel)
    name = next(name for name in archive.namelist() if name.endswith("/METADATA"))
    told = email.message_from_bytes(archive.read(name))
    text = told.get_payload()
    assert isinstance(text, str)
    version = told["Version"]
    addresses = dict(value.split(", ") for value in told.get_all("Project-URL", []))
    assert sorted(addresses) == ["Changelog", "Documentation", "Homepage", "Issues", "Source"]
    assert all(address.startswith(addresses["Source"]) for address in addresses.values())
    assert f"]({addresses['Source']}/blob/v{version}/student_template/README.md)" in text
    assert [target for target in re.findall(r"\]\(([^)]*)\)", text) if "://" not in target and target[0] != "#"] == []


@pytest.mark.parametrize(
    ("relative", "absolute"),
    [
        ("[a](docs/a.md#part)", "[a](https://x/y/blob/v1/docs/a.md#part)"),
        ("[![a](./b.svg)](c/)", "[![a](https://x/y/raw/v1/b.svg)](https://x/y/blob/v1/c/)"),
        ('<img alt="a" src="b.png">', '<img alt="a" src="https://x/y/raw/v1/b.png">'),
        ("[a](#part) [b](https://c/d) [e](mailto:f@g)", "[a](#part) [b](https://c/d) [e](mailto:f@g)"),
    ],
)
def test_links_and_pictures_become_absolute(relative: str, absolute: str) -> None:
    """Those of Markdown and of HTML; what is absolute stays."""
    assert HOOK["absolute"](relative, "https://x/y", "v1") == absolute


def test_rubrics_and_the_recording_travel_and_solutions_do_not(wheel: Path) -> None:
    """An instructor needs nothing but the wheel; a student finds no solution in it."""
    names = zipfile.ZipFile(wheel).namelist()
    for needed in (
        "exercise_1/rubric.yaml",
        "exercise_1/selftest.yaml",
        "exercise_2/rubric.yaml",
        "exercise_3/rubric.yaml",
        "exercise_2/checks.py",
        "exercise_2/hints.py",
        "exercise_3/checks.py",
        "exercise_3/hints.py",
        "rubric.schema.json",
        "exercise_2/odometry/metadata.yaml",
    ):
        assert f"grader/shipped/rubrics/{needed}" in names
    assert "grader/grading/reporting/report.schema.json" in names
    assert "grader/runtime/host/machine/fastdds.xml" in names
    assert "grader/py.typed" in names
    assert "grader/shipped/student_template/velocity_publisher.py" in names
    assert not [name for name in names if "reference" in name or name.startswith(("tests/", "student_template/"))]


def test_the_libraries_of_the_report_travel_as_published_with_their_licences(wheel: Path) -> None:
    """Each file in the wheel is the one that the build hook names; nothing else travels beside them."""
    folder, archive = "grader/grading/reporting/html/vendor", zipfile.ZipFile(wheel)
    wanted = {
        f"{folder}/{HOOK['name_of'](package)}/{name}": digest
        for package, files in HOOK["LIBRARIES"].items()
        for name, digest in files.items()
    }
    found = [name for name in archive.namelist() if name.startswith(folder)]
    assert {name: hashlib.sha256(archive.read(name)).hexdigest() for name in found} == wanted
    assert sum("LICENSE" in name or "NOTICE" in name for name in wanted) == 4


@pytest.mark.long
def test_each_command_has_a_man_page_that_can_be_shown(wheel: Path, tmp_path: Path) -> None:
    """It travels where installers put man pages, and the formatter has no complaint."""

    def pages(command: click.Command, name: str) -> set[str]:
        found: dict[str, click.Command | None] = {}
        if isinstance(command, click.Group):
            context = click.Context(command)
            found = {word: command.get_command(context, word) for word in command.list_commands(context)}
        shown = {word: each for word, each in found.items() if each is not None and not each.hidden}
        return {f"{name}.1"}.union(*(pages(each, f"{name}-{word}") for word, each in shown.items()))

    archive = zipfile.ZipFile(wheel)
    found = [name for name in archive.namelist() if ".data/data/share/man/man1/" in name]
    assert {Path(name).name for name in found} == pages(app, "grade")
    if shutil.which("groff") is None:
        pytest.skip("groff is not installed")
    for name in found:
        # Without colours, bold, overstriking and underlining, which newer versions write as escape sequences.
        plain = ("-P-c", "-P-b", "-P-o", "-P-u")
        command = ["groff", "-man", "-ww", "-Tutf8", "-Kutf8", *plain, archive.extract(name, tmp_path)]
        done = subprocess.run(command, check=True, capture_output=True, text=True, encoding="utf-8")
        assert done.stderr == "", name
        # Versions differ in the indentation, and newer ones shorten a long name in the header.
        assert re.search(rf"^NAME\n +{Path(name).stem} ", done.stdout, re.MULTILINE)


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


@pytest.mark.long
def test_an_installed_rubric_has_all_its_names(wheel: Path, tmp_path: Path) -> None:
    """The folder of its exercise, and the file in it: each is read, none is a copy."""
    place = tmp_path / "installed"
    pip = [sys.executable, "-m", "pip", "install", "--quiet", "--no-deps", "--no-compile", "--target"]
    subprocess.run([*pip, str(place), str(wheel)], check=True)
    rubrics = place / "grader" / "shipped" / "rubrics"
    names = [rubrics / f"exercise_3{form}" for form in ("", "/rubric.yaml")]
    code = "from grader.cli.main import main; main()"
    command = [sys.executable, "-c", code, "rubric", "check", *map(str, names)]
    environment = {**os.environ, "PYTHONPATH": str(place)}
    done = subprocess.run(command, check=False, capture_output=True, text=True, cwd=tmp_path, env=environment)
    assert (done.returncode, done.stderr) == (0, "")
    said = f"{names[1]}: two_node_communication: 3 scenarios, 7 criteria, 40 points"
    assert done.stdout.splitlines() == [said] * 2
    assert [path.name for path in rubrics.iterdir() if path.is_file()] == ["rubric.schema.json"]


@pytest.mark.nightly
@pytest.mark.ros
def test_the_installed_wheel_grades_in_a_bare_root(wheel: Path, tmp_path: Path) -> None:
    """It brings all it needs: there are Python, the environment and a submission, but no home, user or network."""
    environment, home = tmp_path / "environment", tmp_path / "home"
    venv.create(environment, with_pip=True)
    pip = [str(environment / "bin" / "python"), "-I", "-m", "pip", "install", "--quiet", "--no-compile", str(wheel)]
    subprocess.run(pip, check=True)
    (home / "ada").mkdir(parents=True)
    shutil.copy(ROOT / "reference_solutions" / "velocity_publisher.py", home / "ada")
    root = ["--ro-bind", "/usr", "/usr", "--proc", "/proc", "--dev", "/dev", "--tmpfs", "/tmp", "--bind", home, "/home"]
    links = [word for name in ("bin", "lib", "lib64", "sbin") for word in ("--symlink", f"usr/{name}", f"/{name}")]
    python = [word for place in (sys.base_prefix, environment) for word in ("--ro-bind", place, place)]
    apart = ["--unshare-pid", "--unshare-net", "--unshare-ipc", "--die-with-parent", "--clearenv", "--chdir", "/home"]
    # The grader makes sandboxes of its own in there; a user gets the right to with a namespace of users.
    rights = ["--cap-add", "ALL"] if os.geteuid() == 0 else []
    path = ["--setenv", "PATH", f"{environment}/bin:/usr/bin"]
    command = [
        "bwrap",
        *root,
        *links,
        *python,
        *apart,
        *rights,
        *path,
        "grade",
        "ada",
        "--exercise",
        "velocity_publisher",
    ]
    done = subprocess.run(list(map(str, command)), check=False, capture_output=True, text=True)
    assert done.returncode == 0, done.stdout + done.stderr
    assert done.stdout.startswith("ada: 30 of 30 points")
