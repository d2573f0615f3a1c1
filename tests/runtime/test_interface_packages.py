"""Interface packages that are not installed: who may bring them, and what nodes, grader and evidence get of them."""

from __future__ import annotations

import io
import json
import os
import shutil
import subprocess
import sys
from collections.abc import Collection, Iterator, Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from click.testing import CliRunner
from mcap.reader import make_reader
from mcap_ros2.decoder import DecoderFactory
from places import TESTS
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from grader.cli import main
from grader.course.classroom.store import Conditions
from grader.grading.app.interfaces import known_interfaces
from grader.grading.app.keeping import EvidenceWriter
from grader.grading.app.rejudge import judgement, rejudge_evidence
from grader.grading.app.request import GradeRequest
from grader.grading.app.start import grade_once
from grader.grading.evidence.store import open_evidence
from grader.grading.model.grading_options import GradingOptions
from grader.grading.model.report import Report
from grader.grading.reporting.json_report import report_to_json
from grader.grading.rubrics.interfaces import Interfaces
from grader.grading.submissions.projects import read_projects
from grader.runtime.interface_packages import (
    GRADER,
    RUBRIC,
    SUBMISSION,
    Provided,
    offered_digest,
    provide,
)
from grader.runtime.interfaces import program
from grader.runtime.interfaces.build import BuiltInterfaces
from grader.runtime.interfaces.definitions import InterfacePackage
from grader.runtime.model.errors import EnvironmentFault
from grader.runtime.model.submission import Submission
from grader.runtime.ros_installation import find_ros
from grader.runtime.session import RecordingSession, open_session
from grader.runtime.supervisor.confined_build import build_confined, told_of

REAL = TESTS / "real_checks"
RUBRIC_FILE = REAL / "brought.yaml"


def say_nothing(_: str) -> None:
    """Ignore progress."""


def graded(folder: Path, evidence: Path | None = None, **options: Any) -> Report:
    """Grade a folder by the rubric that brings packages, and keep its evidence if asked."""
    request = GradeRequest(str(folder), rubrics=(RUBRIC_FILE,), seed=7, **options)
    writer = None if evidence is None else EvidenceWriter([evidence], request)
    report = grade_once(request, say_nothing, None if writer is None else writer.remember)
    if writer is not None:
        writer.write(report)
    return report


def outcomes(report: Report) -> dict[str, str]:
    """Return the outcome of each criterion, with its reason where it is not met."""
    return {v.id: v.outcome.value for e in report.exercises for v in e.verdicts}


@pytest.fixture(scope="module")
def kept(tmp_path_factory: pytest.TempPathFactory) -> tuple[Report, Path]:
    """Return the report on the right programs, and its evidence."""
    folder = tmp_path_factory.mktemp("evidence") / "kept"
    return graded(REAL / "right", folder, clock="virtual"), folder


@pytest.mark.ros
def test_nodes_and_grader_use_packages_of_rubric_grader_and_submission(kept: tuple[Report, Path]) -> None:
    """Topics, services, an action and a transform, in types of which none is installed."""
    report, _ = kept
    told = {v.id: v.reason for v in report.exercises[0].verdicts}
    assert set(outcomes(report).values()) == {"met"}, told
    origins = {package.name: package.origin for package in report.interfaces}
    assert origins == {
        "example_interfaces": GRADER,
        "lab_msgs": RUBRIC,
        "own_msgs": SUBMISSION,
        "tf2_msgs": GRADER,
    }
    assert [one["name"] for one in report_to_json(report)["interfaces"]] == sorted(origins)


@pytest.mark.long
@pytest.mark.ros
def test_what_is_wrong_in_a_brought_type_costs_points() -> None:
    """Other types, values, rates, answers and transforms."""
    report = graded(REAL / "astray", clock="virtual")
    told = {v.id: v.reason for v in report.exercises[0].verdicts}
    assert "met" not in outcomes(report).values(), told
    assert "undecided" not in outcomes(report).values(), told


@pytest.mark.long
@pytest.mark.ros
def test_other_tools_read_brought_types_in_the_evidence(kept: tuple[Report, Path]) -> None:
    """Their definitions are in the recording, with nested and installed types, and judging again gives the same."""
    report, folder = kept
    recording = (folder / "brought.lab" / "brought.lab_0.mcap").read_bytes()
    found: dict[str, object] = {}
    for schema, channel, _, message in make_reader(
        io.BytesIO(recording), decoder_factories=[DecoderFactory()]
    ).iter_decoded_messages():
        assert schema is not None
        found.setdefault(f"{channel.topic} {schema.name}", message)
    battery = found["/battery lab_msgs/msg/Battery"]
    assert (battery.name, battery.state, list(battery.cells)) == ("main", 2, [4.0, 3.5])  # type: ignore[attr-defined]
    assert battery.header.frame_id == "rack"  # type: ignore[attr-defined]
    assert list(found["/note own_msgs/msg/Note"].numbers) == [1, -2]  # type: ignore[attr-defined]
    assert "/tf tf2_msgs/msg/TFMessage" in found
    again = rejudge_evidence(open_evidence(folder), judgement((), (RUBRIC_FILE,), verify=True))
    assert report_to_json(again)["exercises"] == report_to_json(report)["exercises"]
    assert again.interfaces == report.interfaces


@pytest.mark.breadth(0, 1)
@pytest.mark.ros
@pytest.mark.long
@pytest.mark.parametrize("options", [{"clock": "wall"}, {"clock": "auto", "spot_checks": 1.0}], ids=["wall", "bare"])
def test_brought_packages_are_there_on_every_clock(options: Mapping[str, Any]) -> None:
    """With the host in the process, and as `python3 FILE` without it."""
    report = graded(REAL / "right", **options)
    told = {v.id: v.reason for v in report.exercises[0].verdicts}
    assert set(outcomes(report).values()) == {"met"}, (told, report.notes)


@pytest.fixture(scope="module")
def session() -> Iterator[RecordingSession]:
    """Return a session in which nothing is recorded."""
    with open_session("auto", 1, warm=False) as opened:
        yield opened


def provided(session: RecordingSession, folder: Path, files: Mapping[str, str], **options: Any) -> Provided:
    """Return what a submission of these files gets."""
    for name, text in files.items():
        path = folder / "own" / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)
    submission = Submission("own", str(folder), folder / "own", "", projects=read_projects(folder / "own")[0])
    return provide(session, submission, **options)


@pytest.mark.sandbox
def test_a_submission_replaces_no_package_that_others_have(session: RecordingSession, tmp_path: Path) -> None:
    """Not one of ROS, of Python or of the grader; its own are built beside them, and may refer to them."""
    files = {f"{name}/msg/Mine.msg": "int32 x\n" for name in ("std_msgs", "rclpy", "tf2_msgs")}
    files |= {"node.py": "from tf2_msgs.msg import TFMessage", "own/msg/Mine.msg": "tf2_msgs/TF2Error error\n"}
    found = provided(session, tmp_path, files)
    assert [(package.name, package.origin) for package in found.packages] == [("own", SUBMISSION), ("tf2_msgs", GRADER)]
    assert len(found.problems) == 3
    assert {path.name for folder in found.folders for path in folder.iterdir()}.isdisjoint(
        {"std_msgs", "json", "rclpy"}
    )
    alone = provided(session, tmp_path / "python", {"json/msg/Mine.msg": "int32 x\n"})
    assert alone.packages == ()
    assert "json" in alone.problems[0]
    told = subprocess.run(
        [sys.executable, "-c", "from tf2_msgs.msg import TFMessage as T; from own.msg import Mine; print(T(), Mine())"],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, found.folders))},
        capture_output=True,
        text=True,
        check=True,
    )
    assert "transforms=" in told.stdout
    assert "error=tf2_msgs.msg.TF2Error" in told.stdout


#: Texts that would do something if they became code, or that are too much.
HOSTILE = {
    "a constant that closes its text": 'string A="""+open("CANARY","w").write("x")+"""\nint32 x\n',
    "a default that closes its text": "string x \"'+str(open('CANARY','w').write('x'))+'\"\n",
    "a comment": '# """\n# open("CANARY","w")\n# """\nint32 x # """ + open("CANARY","w") + """\n',
    "a template": "# @{import os; os.mkdir('CANARY')}@\n# @(open('CANARY','w'))\nstring x \"@(open('CANARY','w'))\"\n",
    "a name": "int32 x=open('CANARY','w')\n",
    "a keyword": "int32 import\nint32 class\nint32 self\n",
    "an escape": "string x \"\\x22\\x22\\x22+open('CANARY','w')#\"\n",
    "a giant array": "float64[2000000000] x\n",
    "many giant arrays": "".join(f"float64[900000] x{n}\n" for n in range(400)),
    "itself": "Hostile x\n",
    "many lines": "int32 x\n" * 400_000,
}


@pytest.mark.sandbox
@pytest.mark.parametrize("text", HOSTILE.values(), ids=HOSTILE)
def test_a_hostile_definition_is_refused_or_stays_text(session: RecordingSession, tmp_path: Path, text: str) -> None:
    """Neither building nor importing it runs any of it, and the problem is named with its place."""
    canary = tmp_path / "canary"
    found = provided(session, tmp_path, {"bad_msgs/msg/Hostile.msg": text.replace("CANARY", str(canary))})
    if found.packages:
        done = subprocess.run(
            [sys.executable, "-c", "import bad_msgs.msg as m; print(repr(m.Hostile()))"],
            env={**os.environ, "PYTHONPATH": os.pathsep.join(map(str, found.folders))},
            capture_output=True,
            text=True,
            check=False,
            cwd=tmp_path,
        )
        assert done.returncode == 0, done.stderr
    else:
        assert "Hostile.msg" in found.problems[0]
    assert not canary.exists()


@pytest.mark.sandbox
@pytest.mark.parametrize(
    ("file", "text"),
    [
        (os.fsdecode(b"bad_msgs/msg/S\xe4y.msg"), "int32 x\n"),
        ("bad_msgs/msg/" + "Ab" * 110 + ".msg", "int32 x\n"),
        ("bad_msgs/msg/Say.msg", f"int32 {'x' * 12_000}\n"),
    ],
    ids=["Latin-1", "220 characters", "a field of 12,000"],
)
def test_a_mistake_in_a_package_is_a_note(session: RecordingSession, tmp_path: Path, file: str, text: str) -> None:
    """The submission is graded without the package."""
    found = provided(session, tmp_path, {file: text, "other/msg/Folder.msg/x.py": "", "other/package.xml/x.py": ""})
    assert (found.packages, len(found.problems)) == ((), 1)
    assert found.problems[0].startswith("bad_msgs/msg/")


class UnknownDefectError(Exception):
    """What nobody has thought of."""


@pytest.mark.parametrize("works", [True, False])
def test_what_fails_with_definitions_alone_is_their_mistake(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str], works: bool
) -> None:
    """Where a plain package cannot be built either, the grader or the machine fails, and that is no note."""

    def build_nothing(packages: Collection[InterfacePackage], cache: Path, share: Sequence[Path]) -> BuiltInterfaces:
        if packages == [program._PLAIN]:
            if not works:
                raise EnvironmentFault("no generators")
            return BuiltInterfaces(cache, ())
        raise UnknownDefectError("\udce4" * 400)

    monkeypatch.setattr(program, "build", build_nothing)
    (tmp_path / "own" / "msg").mkdir(parents=True)
    (tmp_path / "own" / "msg" / "Foo.msg").write_text("int32 x\n", encoding="utf-8")
    request = {"submission": str(tmp_path), "into": str(tmp_path), "others": [], "taken": [], "share": []}
    monkeypatch.setattr(sys, "stdin", io.StringIO(json.dumps(request)))
    if not works:
        with pytest.raises(UnknownDefectError):
            program.main()
        return
    program.main()
    told = told_of(json.loads(capsys.readouterr().out))
    assert told is not None
    assert told.packages == {}
    assert "are not used: building them ended with UnknownDefectError" in told.problems[0]
    assert len(told.problems[0]) < 400


@pytest.mark.long
@pytest.mark.sandbox
def test_a_build_that_ends_at_a_limit_is_a_note_that_is_remembered(
    session: RecordingSession, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The submission is graded without its packages, and the next time at no cost."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    fields = "".join(f"float64 x{n}\n" for n in range(499))
    files = {f"big_msgs/msg/M{n}.msg": fields for n in range(250)}
    first = provided(session, tmp_path, files, build_own=partial(build_confined, processor_s=1))
    assert first.packages == ()
    assert len(first.problems) == 1
    assert "processor time" in first.problems[0]
    assert first.spent_s > 0
    again = provided(session, tmp_path, files, build_own=None)
    assert (again.problems, again.spent_s) == (first.problems, 0)
    (kept,) = (tmp_path / "cache" / "rclpy-grader" / "interfaces").glob("submitted-*")
    assert [path.name for path in kept.iterdir()] == ["told.json"]


@pytest.mark.sandbox
def test_a_build_takes_no_longer_than_the_time_budget(
    session: RecordingSession, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """What it took is told; with another budget it may end otherwise, so that is not remembered."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    files = {"own_msgs/msg/Mine.msg": "int32 x\n"}
    found = provided(session, tmp_path, files, budget_s=0.01)
    assert found.problems == (
        "the interface definitions of the submission are not used: building them took all of the time budget",
    )
    assert found.spent_s >= 0.01
    assert [package.name for package in provided(session, tmp_path, files).packages] == ["own_msgs"]


@pytest.mark.parametrize(
    "answer",
    [
        None,
        {"packages": {"a": "x"}, "folder": "0" * 32, "problems": []},
        {"packages": {"../a": f"sha256:{'0' * 64}"}, "folder": "0" * 32, "problems": []},
        {"packages": {"a": f"sha256:{'0' * 64}"}, "folder": "../../elsewhere", "problems": []},
        {"packages": {"a": f"sha256:{'0' * 64}"}, "folder": "", "problems": []},
        {"packages": {}, "folder": "", "problems": [5]},
    ],
)
def test_what_a_build_tells_is_checked(answer: object) -> None:
    """Its process has read what students made, and names folders."""
    assert told_of(answer) is None


@pytest.mark.sandbox
def test_links_and_paths_of_a_submission_lead_nowhere(session: RecordingSession, tmp_path: Path) -> None:
    """A name in package.xml is no path, and a link to a file outside is no definition."""
    (tmp_path / "secret.msg").write_text("string secret\n")
    (tmp_path / "own" / "evil_msgs" / "msg").mkdir(parents=True)
    (tmp_path / "own" / "evil_msgs" / "msg" / "Link.msg").symlink_to(tmp_path / "secret.msg")
    outside = "<package><name>../../outside</name></package>"
    found = provided(session, tmp_path, {"evil_msgs/package.xml": outside, "evil_msgs/msg/Real.msg": "int32 x\n"})
    assert found.packages == ()
    assert found.problems
    assert not any(path.name == "outside" for path in tmp_path.rglob("*"))


def test_a_rubrics_mistakes_about_its_own_types_are_named(tmp_path: Path) -> None:
    """As those about installed ones: place, what was expected, and what was probably meant."""
    shutil.copytree(REAL / "interfaces", tmp_path / "interfaces")
    text = RUBRIC_FILE.read_text().replace("lab_msgs/msg/Battery", "lab_msgs/msg/Batery").replace('"cells[1]"', "cels")
    (tmp_path / "r.yaml").write_text(text)
    done = CliRunner().invoke(main.app, ["rubric", "check", str(tmp_path / "r.yaml")])
    assert done.exit_code == 2
    assert "expected a message type of lab_msgs, found `lab_msgs/msg/Batery`" in done.output
    assert "did you mean `lab_msgs/msg/Battery`?" in done.output


def test_a_bad_definition_ends_the_command_with_its_place(tmp_path: Path) -> None:
    """File, line and what to write; a rubric that brings it cannot be used, and neither can a course's folder."""
    shutil.copytree(REAL / "interfaces", tmp_path / "interfaces")
    (tmp_path / "interfaces" / "lab_msgs" / "srv" / "SetLimit.srv").write_text("int32 a\nflot32 limit\n---\n")
    shutil.copy(RUBRIC_FILE, tmp_path)
    for command in (
        ["interfaces", "build", str(tmp_path / "interfaces")],
        ["rubric", "check", str(tmp_path / "brought.yaml")],
    ):
        done = CliRunner().invoke(main.app, command)
        assert done.exit_code == 2, done.output
        assert "srv/SetLimit.srv, line 2" in done.output
        assert "float32" in done.output


def test_packages_are_listed_with_their_types_and_where_they_are_kept() -> None:
    """Those of the grader, and those in a folder; JSON for programs."""
    done = CliRunner().invoke(main.app, ["interfaces", "list", str(REAL / "interfaces"), "--json"])
    assert done.exit_code == 0, done.output
    found = {one["name"]: one for one in json.loads(done.output)["packages"]}
    assert set(found) == {"lab_msgs", "example_interfaces", "tf2_msgs", "turtlesim"}
    assert found["lab_msgs"]["types"] == ["lab_msgs/msg/Battery", "lab_msgs/srv/SetLimit"]
    assert Path(found["lab_msgs"]["folder"], "lab_msgs", "msg").is_dir()
    shown = CliRunner().invoke(main.app, ["interfaces", "list"])
    assert "Fibonacci" in shown.output


def test_definitions_for_evidence_are_those_of_other_tools() -> None:
    """For every installed message type that rosbags knows as well: the same hash, and text that it reads alike."""
    store, installed = get_typestore(Stores.ROS2_JAZZY), Interfaces(find_ros().share)
    compared = 0
    for name in installed.of_kind("msg"):
        found = installed.definition(name)
        assert found is not None
        read = get_types_from_msg(found.text, name)
        # rosbags takes a char for a type of its own, and an empty message for one without the byte that is sent
        odd = "'char'" in str(store.fielddefs.get(name)) or "structure_needs_at_least_one_member" in found.text
        if name in store.fielddefs and not odd and not name.startswith("rmw_dds_common"):
            assert found.digest == store.hash_rihs01(name)
            assert read[name][1] == store.fielddefs[name][1]
            compared += 1
    assert compared > 100


def test_other_definitions_are_other_conditions(tmp_path: Path) -> None:
    """Of a rubric and of a course: what was recorded with them is not used again, and results are not current."""
    shutil.copytree(REAL / "interfaces", tmp_path / "interfaces")
    before = offered_digest([tmp_path / "interfaces"], ())
    (tmp_path / "interfaces" / "lab_msgs" / "msg" / "Battery.msg").write_text("float64 voltage\n")
    after = offered_digest([tmp_path / "interfaces"], ())
    none = Conditions("1", (), "", GradingOptions(seed=7))
    keys = [replace(none, interfaces=digest).recorded("sha256:0") for digest in ("", before, after)]
    assert len(set(keys)) == 3
    assert offered_digest((), ()) == ""


def test_types_of_the_grader_can_be_named_in_any_rubric() -> None:
    """Without a key in it."""
    known = known_interfaces()
    assert known is not None
    assert known.fields("example_interfaces/action/Fibonacci_Goal") is not None
    assert known.fields("turtlesim/msg/Pose") is not None
