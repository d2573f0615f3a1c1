"""Real nodes of a real class: graded, killed on the way, finished by the same command."""

import csv
import io
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from places import GRADE, TESTS
from sample_folders import folder_of

pytestmark = pytest.mark.ros
#: Without spot checks, which tests of their own are about.
ONE = ("--exercise", "velocity_publisher", "--jobs", "1", "--spot-checks", "0%")
CLASS = {"ada": "correct/velocity_class", "bob": "wrong/velocity_10_hz", "cleo": "broken/syntax_error"}


@pytest.fixture
def class_(tmp_path: Path) -> Path:
    """Return a folder of three submissions and one that is none."""
    for name, source in CLASS.items():
        shutil.copytree(folder_of(source), tmp_path / "class" / name)
    (tmp_path / "class" / "dan").mkdir()
    return tmp_path / "class"


def run(*arguments: Path | str) -> subprocess.CompletedProcess[str]:
    """Run the command, and return it with what it printed."""
    return subprocess.run([GRADE, "batch", *map(str, arguments)], capture_output=True, text=True, check=False)


def points(results: Path) -> dict[str, str]:
    """Return name -> score of a gradebook."""
    rows = csv.DictReader(io.StringIO((results / "gradebook.csv").read_text(encoding="utf-8"), newline=""))
    return {row["submission"]: row["score"] for row in rows}


@pytest.mark.long
def test_a_killed_class_is_finished_by_the_same_command(class_: Path, tmp_path: Path) -> None:
    """What was done is not run again, the scores are those of an undisturbed run, and no process is left."""
    results = tmp_path / "out"
    first = subprocess.Popen(
        [GRADE, "batch", class_, "-o", results, *ONE], stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True
    )
    assert first.stderr is not None
    assert first.stderr.readline() == "to grade: 4\n"
    assert first.stderr.readline().startswith("[1/4] dan: refused")  # nothing of it can run
    done = first.stderr.readline()
    first.kill()
    first.communicate()
    assert done.startswith(("[2/4] ada: 30/30", "[2/4] bob: 20/30"))  # two are graded at a time
    # Another one may have been done before the class was killed.
    before = {path: path.stat().st_mtime_ns for path in results.glob("students/*/result.json")}
    assert {"dan", done.split()[1].rstrip(":")} <= {path.parent.name for path in before}

    second = run(class_, "-o", results, *ONE)
    counted = re.search(r"^to grade: (\d), done before: (\d)", second.stderr, re.MULTILINE)
    assert counted is not None, second.stderr
    assert sum(map(int, counted.groups())) == 4
    assert int(counted[2]) >= len(before)
    assert {path: path.stat().st_mtime_ns for path in before} == before
    assert second.returncode == 1, second.stderr  # one submission cannot be used

    undisturbed = tmp_path / "other"
    run(class_, "-o", undisturbed, *ONE)
    assert points(results) == points(undisturbed) == {"ada": "30", "bob": "20", "cleo": "0", "dan": ""}
    assert "to grade: 0, done before: 4" in run(class_, "-o", results, *ONE).stderr


def test_results_are_whole(class_: Path, tmp_path: Path) -> None:
    """Report, page, evidence and what Gradescope takes; the page shares its scripts with the class."""
    results = tmp_path / "out"
    shutil.rmtree(class_ / "dan")
    done = run(class_, "-o", results, *ONE, "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["counts"]["graded"] == 3
    for name in CLASS:
        place = results / "students" / name
        assert {p.name for p in place.iterdir()} == {
            *("report.json", "report.html", "feedback.json", "feedback.html", "gradescope.json"),
            *("evidence", "result.json", "mark.json"),
        }
        page = (place / "report.html").read_text(encoding="utf-8")
        script = page.split('src="../../')[1].split('"')[0]
        assert (results / script).is_file()
    again = subprocess.run([GRADE, "rejudge", results / "students"], capture_output=True, text=True, check=False)
    assert "judged: 3" in again.stdout, again.stderr


@pytest.mark.nightly
def test_a_download_is_graded_where_a_student_hides_modules(class_: Path, tmp_path: Path) -> None:
    """The command is given in a folder with a `json.py`: it is not imported."""
    (tmp_path / "json.py").write_text("raise SystemExit('imported')\n", encoding="utf-8")
    (tmp_path / "grader.py").write_text("raise SystemExit('imported')\n", encoding="utf-8")
    archive = shutil.make_archive(str(tmp_path / "hw"), "zip", class_)
    command: list[Path | str] = [GRADE, "batch", "hw.zip", "-o", "out", *ONE]
    assert archive.endswith("hw.zip")
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 1, done.stderr
    assert points(tmp_path / "out")["ada"] == "30"
    report = json.loads((tmp_path / "out" / "students" / "ada" / "report.json").read_text(encoding="utf-8"))
    assert report["submission"]["path"] == "out/unpacked/hw.zip/ada"


#: What a hostile submission adds to its package, and the line of setup.py that it replaces.
BOMBS = {
    "list": ("setup.py", "x = [" + "0," * 3_000_000 + "]\n"),
    "loops": ("setup.py", f"for a in {list(range(1000))}:\n  for b in {list(range(1000))}:\n    pass;pass;pass\n"),
    "name": ("setup.py", f"setup(data_files=[('share/\\0', ['\\udcff']), ('share/{'x' * 300}', ['a'])])\n"),
    "toml": ("pyproject.toml", "a" + ".a" * 18_000 + " = 1\n"),
    "width": ("setup.py", "setup(name='{:>1500000000}'.format('x'))\n"),
    "xml": ("package.xml", "<package>" + "<name>x</name>" * 500_000),
}


@pytest.mark.long
def test_project_files_that_do_harm_cost_a_class_nothing(tmp_path: Path) -> None:
    """Each submission gets its score, with a note about the file; the process that grades them all stays small."""
    for name, bomb in (("honest", None), *BOMBS.items()):
        folder = tmp_path / "class" / name
        shutil.copytree(folder_of("correct/velocity_package"), folder)
        if bomb is not None:
            (folder / "src/my_robot" / bomb[0]).write_text(bomb[1])
    code = r"""
import pathlib, re, sys
from grader.cli.main import main
try:
    main()
finally:
    status = pathlib.Path("/proc/self/status").read_text()
    print("bytes", int(re.search(r"VmHWM:\s+(\d+) kB", status)[1]) << 10, file=sys.stderr)
"""
    command = [sys.executable, "-c", code, "batch", str(tmp_path / "class"), "-o", str(tmp_path / "out"), *ONE]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert points(tmp_path / "out") == dict.fromkeys(("honest", *BOMBS), "30")
    assert int(done.stderr.rpartition("bytes ")[2]) < 400 << 20
    for name in ("honest", *BOMBS):
        report = json.loads((tmp_path / "out" / "students" / name / "report.json").read_text(encoding="utf-8"))
        notes = report["exercises"][0]["notes"]
        told = [note for note in notes if "not read" in note or "left out" in note]
        assert len(told) == (name not in ("honest", "width")), (name, notes)


@pytest.mark.nightly
def test_every_submission_of_a_class_is_checked(tmp_path: Path) -> None:
    """Without asking for it: one that is right in virtual time only is found among honest ones, and only that one."""
    honest = (folder_of("correct/velocity_class") / "velocity_publisher.py").read_text(encoding="utf-8")
    cheat = TESTS / "grading" / "app" / "spot_checks" / "cheats" / "drawn_fraction.py"
    for name, text in {
        "ada": f"{honest}\n# ada\n",
        "bob": f"{honest}\n# bob\n",
        "cleo": cheat.read_text(encoding="utf-8"),
    }.items():
        (tmp_path / "class" / name).mkdir(parents=True)
        (tmp_path / "class" / name / "velocity_publisher.py").write_text(text, encoding="utf-8")
    results = tmp_path / "out"
    done = run(tmp_path / "class", "-o", results, "--exercise", "velocity_publisher", "--jobs", "1")
    assert done.returncode == 0, done.stderr
    assert points(results) == {"ada": "30", "bob": "30", "cleo": "20"}
    reports = {
        name: json.loads((results / "students" / name / "report.json").read_text(encoding="utf-8"))["exercises"][0]
        for name in ("ada", "bob", "cleo")
    }
    assert [reports[name]["clock"] for name in ("ada", "bob", "cleo")] == ["virtual", "virtual", "wall"]
    assert reports["cleo"]["clock_reason"].startswith('the node behaved differently on the wall clock: "')
    quick = tmp_path / "quick"
    run(tmp_path / "class", "-o", quick, "--exercise", "velocity_publisher", "--jobs", "1", "--spot-checks", "0%")
    assert points(quick)["cleo"] == "30"
