"""Submissions are copied within limits, and the wanted files are found in them."""

from __future__ import annotations

import os
import re
import socket
import stat
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from grader.grading.submissions import staging
from grader.grading.submissions.collected import LeftOut, SubmissionLimits
from grader.grading.submissions.staging import collect_folder
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import HarnessError, SubmissionError

WANTED = ("velocity_publisher.py", "odom_subscriber.py", "temperature_sensor.py", "fan_controller.py")


@pytest.fixture
def work(tmp_path: Path) -> Path:
    folder = tmp_path / "alice"
    folder.mkdir()
    return folder


def put(folder: Path, relative: str, content: bytes | str = "x = 1\n") -> Path:
    path = folder / relative
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def staged_files(root: Path) -> list[str]:
    return sorted(p.relative_to(root).as_posix() for p in root.rglob("*") if p.is_file())


@pytest.mark.parametrize(
    "place", ["", "homework/", "a/b/c/", "src/pkg/pkg/", "ros2_ws/src/my_pkg/my_pkg/", "with space/", "-dash/"]
)
def test_a_wanted_file_is_found_wherever_it_lies(work: Path, into: Path, place: str) -> None:
    """A file at the top, in any subfolder or in a ROS package is found, byte for byte."""
    content = b"\xef\xbb\xbf# \xe9 latin\r\nx = 1\r\n"
    put(work, f"{place}velocity_publisher.py", content)
    submission = stage_submission(str(work), WANTED, into)
    found = submission.files["velocity_publisher.py"].found
    assert found == f"{place}velocity_publisher.py"
    assert (submission.root / found).read_bytes() == content
    assert submission.files["odom_subscriber.py"].found is None
    assert list(submission.files) == list(WANTED)
    assert (submission.name, submission.path, submission.root) == ("alice", str(work), into)
    assert submission.notes == ()


def test_of_several_the_one_nearest_the_top_is_taken(work: Path, into: Path) -> None:
    """Depth decides, then the alphabet, and a note names the others."""
    for place in ("z/y/", "old/", "b/", ""):
        put(work, f"{place}fan_controller.py", place)
    file = (submission := stage_submission(str(work), WANTED, into)).files["fan_controller.py"]
    assert file.found == "fan_controller.py"
    assert file.others == ("b/fan_controller.py", "old/fan_controller.py", "z/y/fan_controller.py")
    assert submission.notes == (
        "fan_controller.py is graded, because it is nearest the top; not graded: "
        "b/fan_controller.py, old/fan_controller.py and z/y/fan_controller.py",
    )


@pytest.mark.breadth(4, 14)
@pytest.mark.parametrize(
    "name",
    [
        "velocitypublisher.py",
        "Velocity_Publisher.py",
        "velocity-publisher.py",
        "velocity publisher.py",
        "velocity_publisher(1).py",
        "velocity_publisher (2).py",
        "velocity_publisher - Copy.py",
        "velocity_publisher.py.txt",
        "velocity_publisher.PY",
        "velocity_publisher.txt",
        "velocity_publisher",
        "velosity_publisher.py",
        "velocity_publsher.py",
        "velocity_publisher_node.py",
    ],
)
def test_a_misspelt_file_is_named_and_not_taken(work: Path, into: Path, name: str) -> None:
    """A name that only looks right is similar, never found."""
    put(work, "main.py")
    put(work, f"sub/{name}")
    file = stage_submission(str(work), WANTED, into).files["velocity_publisher.py"]
    assert (file.found, file.similar) == (None, (f"sub/{name}",))


@pytest.mark.parametrize(
    "name", ["setup.py", "__init__.py", "main.py", "position_publisher.py", "velocity_publisher.md", "publisher.py"]
)
def test_another_file_is_not_taken_for_a_misspelling(work: Path, into: Path, name: str) -> None:
    """Names that are far, or of another kind of file, are not offered."""
    put(work, "x.py")
    put(work, name)
    assert stage_submission(str(work), WANTED, into).files["velocity_publisher.py"].similar == ()


def test_a_file_of_another_exercise_is_no_misspelling(work: Path, into: Path) -> None:
    """`fan_controller2.py` is beside `fan_controller.py`: neither is suggested for the other."""
    put(work, "fan_controller.py")
    put(work, "fan_controller2.py")
    wanted = ("fan_controller.py", "fan_controllers.py")
    files = stage_submission(str(work), wanted, into).files
    assert files["fan_controller.py"].similar == ()
    assert files["fan_controllers.py"].similar == ("fan_controller2.py",)


def test_the_nearest_misspelling_comes_first(work: Path, into: Path) -> None:
    """Likeness decides before depth, and at most three are named."""
    for name in (
        "fan_kontrol.py",
        "a/b/fancontroller.py",
        "fan_controler.py",
        "fan_controllerr.py",
        "fan_controlller.py",
    ):
        put(work, name)
    similar = stage_submission(str(work), WANTED, into).files["fan_controller.py"].similar
    assert similar[0] == "a/b/fancontroller.py"
    assert len(similar) == 3


@pytest.mark.parametrize(
    ("files", "candidates", "likely"),
    [
        ({"notes.py": "", "velocity_pub.py": "import rclpy\n"}, ("velocity_pub.py", "notes.py"), True),
        (
            {"a.py": "import rclpy\n", "z.py": "import rclpy\nclass VelocityPublisher(Node): ..."},
            ("z.py", "a.py"),
            True,
        ),
        ({"main.py": "import rclpy\n", "setup.py": "velocity_publisher", "README.md": ""}, ("main.py",), False),
        ({"odom_subscriber.py": "", "x.py": ""}, ("x.py",), False),
    ],
)
def test_other_files_are_named_for_a_missing_one(
    work: Path, into: Path, files: dict[str, str], candidates: tuple[str, ...], likely: bool
) -> None:
    """Likeliest first, by their name and by what they define; none that belongs to an exercise or a package."""
    for name, text in files.items():
        put(work, name, text)
    file = stage_submission(str(work), WANTED, into).files["velocity_publisher.py"]
    assert (file.found, file.candidates, file.likely) == (None, candidates, likely)


def test_of_two_packages_of_one_name_that_of_the_named_file_counts(work: Path, into: Path) -> None:
    """Its shared files are installed, and found by launch files: the first of a name counts."""
    for folder in ("a_first", "b_second", "c_other"):
        name = "other" if folder == "c_other" else "my_pkg"
        put(work, f"{folder}/package.xml", f"<package format='3'><name>{name}</name></package>")
        put(work, f"{folder}/my_pkg/talker.py")
    meant = {"talker.py": "b_second/my_pkg/talker.py"}
    found = stage_submission(str(work), ["talker.py"], into, meant)
    assert [project.folder for project in found.projects] == ["b_second", "a_first", "c_other"]
    assert found.files["talker.py"].found == meant["talker.py"]


def test_one_file_counts_as_a_folder_that_holds_only_it(work: Path, tmp_path: Path, into: Path) -> None:
    """A single file is found, and has the digest of a folder with the same content."""
    file = put(work, "odom_subscriber.py", "import rclpy\n")
    single = stage_submission(str(file), WANTED, into)
    other = tmp_path / "other"
    other.mkdir()
    folder = stage_submission(str(work), WANTED, other)
    assert single.files["odom_subscriber.py"].found == "odom_subscriber.py"
    assert single.digest == folder.digest
    assert single.name == "odom_subscriber.py"
    assert staged_files(into) == ["odom_subscriber.py"]


def test_a_misnamed_single_file_is_similar_at_most(work: Path, into: Path) -> None:
    """A file given directly is not graded under a name it does not have."""
    file = put(work, "odomsubscriber.py")
    files = stage_submission(str(file), WANTED, into).files
    assert [f.found for f in files.values()] == [None] * 4
    assert files["odom_subscriber.py"].similar == ("odomsubscriber.py",)


def test_a_named_link_is_followed(work: Path, tmp_path: Path, into: Path) -> None:
    """A link on the command line was chosen by the user: its own name counts."""
    link = tmp_path / "velocity_publisher.py"
    link.symlink_to(put(work, "something_else.py", "y = 2\n"))
    submission = stage_submission(str(link), WANTED, into)
    assert submission.files["velocity_publisher.py"].found == "velocity_publisher.py"
    assert (into / "velocity_publisher.py").read_text() == "y = 2\n"


def test_the_digest_is_of_names_and_contents_only(tmp_path: Path) -> None:
    """Place, top name, times and skipped folders do not matter; names, layout and content do."""

    def digest(number: int, files: Mapping[str, str]) -> str:
        folder, into = tmp_path / f"s{number}", tmp_path / f"t{number}"
        into.mkdir()
        for name, content in files.items():
            put(folder, name, content)
        return stage_submission(str(folder), WANTED, into).digest

    base = digest(0, {"a.py": "1", "b/c.py": "2"})
    assert re.fullmatch(r"sha256:[0-9a-f]{64}", base)
    assert digest(1, {"b/c.py": "2", "a.py": "1", ".git/x": "9", "__pycache__/a.pyc": "8"}) == base
    different = [{"a.py": "2", "b/c.py": "1"}, {"a.py": "1", "b/d.py": "2"}, {"a.py": "1b/c.py2"}, {"a.py": "1"}]
    digests = [digest(2 + n, files) for n, files in enumerate(different)]
    assert len({base, *digests}) == 5


def test_folders_of_tools_are_left_out(work: Path, into: Path) -> None:
    """Version control, caches, environments and build results are not the student's work."""
    put(work, "velocity_publisher.py")
    folders = (".git", "__pycache__", ".venv", "venv", "node_modules", ".hidden", "__MACOSX", "deep/er/.cache")
    for folder in folders:
        put(work, f"{folder}/velocity_publisher.py")
    put(work, "myenv/pyvenv.cfg")
    put(work, "myenv/lib/velocity_publisher.py")
    put(work, "build/COLCON_IGNORE")
    put(work, "build/velocity_publisher.py")
    put(work, "._velocity_publisher.py")
    submission = stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]
    assert submission.notes == (
        "not copied: build (it holds COLCON_IGNORE, so a tool made it)",
        "not copied: myenv (it holds pyvenv.cfg, so a tool made it)",
    )


def test_a_link_marks_a_folder_as_made_by_a_tool(work: Path, into: Path) -> None:
    """Wherever it leads: only its name counts."""
    put(work, "velocity_publisher.py")
    put(work, "build/velocity_publisher.py")
    (work / "build" / "COLCON_IGNORE").symlink_to("nowhere")
    submission = stage_submission(str(work), WANTED, into)
    assert submission.notes == ("not copied: build (it holds COLCON_IGNORE, so a tool made it)",)


def test_links_and_special_files_are_neither_followed_nor_copied(work: Path, tmp_path: Path, into: Path) -> None:
    """A link to a secret, a link to a folder, a pipe and a socket: notes, no content, no waiting."""
    put(work, "velocity_publisher.py")
    secret = put(tmp_path, "secret.py", "secret")
    (work / "odom_subscriber.py").symlink_to(secret)
    (work / "folder").symlink_to(tmp_path)
    (work / "loop").symlink_to(work)
    (work / "dangling.py").symlink_to("nowhere")
    os.mkfifo(work / "pipe.py")
    here = Path.cwd()
    os.chdir(work)  # a socket's path must be short
    try:
        with socket.socket(socket.AF_UNIX) as listener:
            listener.bind("socket.py")
    finally:
        os.chdir(here)
    submission = stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]
    assert submission.files["odom_subscriber.py"].found is None
    assert list(submission.notes) == [
        "not copied: pipe.py and socket.py (a device, pipe or socket, not a plain file)",
        "not copied: dangling.py, folder, loop and 1 more (a link, which is not followed)",
    ]


def test_the_students_folder_is_never_written_to(work: Path, into: Path) -> None:
    """Not a byte, not a time stamp, not a mode changes."""
    put(work, "src/p/p/velocity_publisher.py")
    put(work, "helper.py")

    def state() -> list[tuple[str, int, int, int]]:
        return sorted((str(p), p.stat().st_mtime_ns, p.stat().st_mode, p.stat().st_size) for p in work.rglob("*"))

    before = state()
    stage_submission(str(work), WANTED, into)
    assert state() == before


def test_a_staging_folder_inside_the_submission_is_not_staged(work: Path) -> None:
    """`grade .` in the folder of temporary files does not copy the copy."""
    put(work, "velocity_publisher.py")
    into = work / "staging"
    into.mkdir()
    stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]


def test_the_copy_is_readable_by_every_user(work: Path, into: Path) -> None:
    """A node runs as another user, whatever the caller's umask and the student's modes are."""
    put(work, "a/b/velocity_publisher.py").chmod(0o600)
    old = os.umask(0o077)
    try:
        stage_submission(str(work), WANTED, into)
    finally:
        os.umask(old)
    assert stat.S_IMODE((into / "a/b/velocity_publisher.py").stat().st_mode) == 0o644
    assert stat.S_IMODE((into / "a/b").stat().st_mode) == 0o755
    assert stat.S_IMODE((into / "a").stat().st_mode) == 0o755


@pytest.mark.parametrize(
    ("limit", "value", "files", "found"),
    [
        ("files", 3, [f"{n}.py" for n in range(4)], "expected at most 3 files, found more"),
        ("entries", 3, [f"d{n}/x.py" for n in range(2)], "expected at most 3 entries, found more"),
        ("depth", 2, ["a/b/c/x.py"], "expected at most 2 folders inside each other, found more"),
        (
            "total_bytes",
            1 << 20,
            ["a.py", "b.py"],
            "expected at most 1 MiB in all, found more; the largest file is a.py, 0.6 MiB",
        ),
    ],
)
def test_a_limit_exceeded_is_one_clear_error(
    work: Path, into: Path, limit: str, value: int, files: Sequence[str], found: str
) -> None:
    """Too many files, entries, levels or bytes: an error with the number."""
    for name in files:
        put(work, name, b"#" * (600 << 10))
    with pytest.raises(SubmissionError) as caught:
        collect_folder(work, into=into, where="alice", limits=SubmissionLimits(**{limit: value}))
    assert caught.value.message == f"alice: {found}"
    assert caught.value.hint


def test_what_just_fits_is_taken(work: Path, into: Path) -> None:
    """2,000 files, 20 levels and 8 MiB are inside the limits."""
    put(work, "/".join("d" * 20) + "/velocity_publisher.py")
    put(work, "big.bin", b"0" * (8 << 20))
    for number in range(1_998):
        put(work, f"f/{number}")
    submission = stage_submission(str(work), WANTED, into)
    assert len(staged_files(into)) == 2_000
    assert submission.notes == ()


def test_a_file_that_is_too_large_is_skipped_with_a_note(work: Path, into: Path) -> None:
    """A recording beside the work costs nothing, not even when it only pretends its size."""
    put(work, "velocity_publisher.py")
    with put(work, "bag.mcap").open("wb") as file:
        file.truncate(1 << 40)
    put(work, "over.bin", b"0" * ((8 << 20) + 1))
    submission = stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]
    assert submission.notes == ("not copied: bag.mcap and over.bin (larger than 8 MiB)",)


def test_a_single_file_that_is_too_large_is_an_error(work: Path, into: Path) -> None:
    """There is nothing else to grade."""
    file = put(work, "velocity_publisher.py", b"#" * ((8 << 20) + 1))
    with pytest.raises(SubmissionError, match="expected at most 8 MiB, found more"):
        stage_submission(str(file), WANTED, into)


@pytest.mark.parametrize(
    ("make", "typed", "message", "hint"),
    [
        (None, "nobody", "nobody: expected a folder, a .py file or an archive, found nothing there", "check the path"),
        (None, "", "expected a folder, a .py file or an archive, found an empty path", "use ."),
        (None, "a\0b", "a\\x00b: expected a path, found one that no file can have", ""),
        (None, "x" * 300, "x: cannot be read: File name too long", ""),
        ("a.py", "a.py/", "a.py/: expected a folder, a .py file or an archive, found nothing there", "check the path"),
        ("a.zip", "a.zip", "a.zip: expected a zip or tar archive, found another kind of file", "as a zip"),
        ("a.tar.gz", "a.tar.gz", "a.tar.gz: expected a zip or tar archive, found another kind of file", "as a zip"),
        ("a.txt", "./a.txt", "./a.txt: expected a folder, a .py file or an archive, found another kind of file", ""),
        ("d/notes.txt", "d", "d: expected at least one .py file, found notes.txt", "hand in velocity_publisher.py"),
        ("d/report.pdf", "d", "d: expected at least one .py file, found report.pdf", "hand in "),
        ("d/alice.zip", "d", "d/alice.zip: expected a zip or tar archive, found another kind of file", "as a zip"),
        (
            "d/fan_controller.py.txt",
            "d",
            "d: expected at least one .py file, found fan_controller.py.txt",
            "rename fan_controller.py.txt",
        ),
        ("d/.git/x.py", "d", "d: expected at least one .py file, found none", ""),
    ],
)
def test_what_cannot_be_graded_is_one_clear_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, into: Path, make: str | None, typed: str, message: str, hint: str
) -> None:
    """Each wrong path gives one line with the path as typed, and a remedy where there is one."""
    if make:
        put(tmp_path, make)
    monkeypatch.chdir(tmp_path)
    with pytest.raises(SubmissionError) as caught:
        stage_submission(typed, WANTED, into)
    assert message in caught.value.message
    assert hint in caught.value.hint
    assert "\n" not in caught.value.message + caught.value.hint


@pytest.mark.parametrize("typed", ["", "robot.launch.xml"])
def test_a_wanted_file_alone_can_be_graded(work: Path, into: Path, typed: str) -> None:
    """A launch file in XML is all that a student may have written; other files of its kind are not work."""
    put(work, "robot.launch.xml", "<launch/>")
    wanted = ("robot.launch.xml", "talker.py")
    submission = stage_submission(str(work / typed), wanted, into)
    assert submission.files["robot.launch.xml"].found == "robot.launch.xml"
    assert submission.files["talker.py"].found is None
    with pytest.raises(SubmissionError, match="expected"):
        stage_submission(str(work / typed), WANTED, into)


def test_an_empty_folder_is_an_error(work: Path, into: Path) -> None:
    """A folder without any file has no .py file either."""
    with pytest.raises(SubmissionError, match="expected at least one \\.py file, found none"):
        stage_submission(str(work), WANTED, into)


def test_a_pipe_named_like_a_file_does_not_block(tmp_path: Path, into: Path) -> None:
    """A pipe given directly is refused at once."""
    os.mkfifo(tmp_path / "velocity_publisher.py")
    with pytest.raises(SubmissionError, match="found a device, pipe or socket"):
        stage_submission(str(tmp_path / "velocity_publisher.py"), WANTED, into)


def test_a_link_that_leads_to_itself_is_an_error(tmp_path: Path, into: Path) -> None:
    """A loop of links on the command line ends in one line."""
    (tmp_path / "a").symlink_to("b")
    (tmp_path / "b").symlink_to("a")
    with pytest.raises(SubmissionError, match="Too many levels of symbolic links"):
        stage_submission(str(tmp_path / "a"), WANTED, into)


@pytest.mark.parametrize(("typed", "name"), [(".", "alice"), ("./", "alice"), ("..", "alice"), ("../alice", "alice")])
def test_the_name_is_the_folders_also_for_dots(
    work: Path, into: Path, monkeypatch: pytest.MonkeyPatch, typed: str, name: str
) -> None:
    """`grade .` shows the folder's name and keeps the path as typed."""
    put(work, "sub/x.py")
    monkeypatch.chdir(work / "sub" if typed == ".." else work)
    submission = stage_submission(typed, WANTED, into)
    assert (submission.name, submission.path) == (name, typed)


def test_hostile_names_break_nothing(work: Path, into: Path) -> None:
    """Line breaks, escapes, undecodable bytes and the longest names are copied and shown in one line."""
    names = ["new\nline", "esc\x1b[31m", os.fsdecode(b"byte\xff"), "\u202eevil", "n" * 252, "'quote\"", "[red]", "é"]
    for number, name in enumerate(names):
        put(work, f"{name}{number % 10}/velocity_publisher.py", str(number))
        (work / f"{name}.x"[-255:]).symlink_to("nowhere")
    submission = stage_submission(str(work), WANTED, into)
    assert len(staged_files(into)) == len(names)
    assert len(submission.files["velocity_publisher.py"].others) == len(names) - 1
    for note in submission.notes:
        assert note.isprintable()
        assert len(note) < 600
    hostile = work / "top\nline"
    put(hostile, "x.py")
    with pytest.raises(SubmissionError) as caught:
        stage_submission(str(hostile / "no\x1bbody"), WANTED, into)
    assert "\n" not in caught.value.message
    assert "\x1b" not in caught.value.message


def test_a_path_too_long_to_copy_is_skipped(work: Path, into: Path) -> None:
    """Twenty folders with names of 200 bytes each: left out with a note, the rest is graded."""
    put(work, "velocity_publisher.py")
    descriptor = os.open(work, os.O_RDONLY)
    for _ in range(19):
        os.mkdir("d" * 200, dir_fd=descriptor)
        inner = os.open("d" * 200, os.O_RDONLY, dir_fd=descriptor)
        os.close(descriptor)
        descriptor = inner
    os.close(os.open("x.py", os.O_CREAT | os.O_WRONLY, dir_fd=descriptor))
    os.close(descriptor)
    submission = stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]
    assert [note.endswith("(the path is too long)") for note in submission.notes] == [True]


def refuse(monkeypatch: pytest.MonkeyPatch, target: str) -> None:
    """Make one name unreadable, as the system does for everybody but root."""
    real = os.open

    def opened(path: Path | str, *arguments: int, **keywords: int) -> int | None:
        if Path(os.fspath(path)).name == target:
            raise PermissionError(13, "Permission denied")
        return real(path, *arguments, **keywords)

    monkeypatch.setattr(os, "open", opened)


def test_an_unreadable_file_or_folder_is_skipped_with_a_note(
    work: Path, into: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One locked file does not cost the others."""
    put(work, "velocity_publisher.py")
    put(work, "locked.py")
    refuse(monkeypatch, "locked.py")
    submission = stage_submission(str(work), WANTED, into)
    assert staged_files(into) == ["velocity_publisher.py"]
    assert submission.notes == ("not copied: locked.py (it cannot be read: Permission denied)",)


def test_an_unreadable_folder_inside_is_skipped_with_a_note(
    work: Path, into: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """One locked folder does not cost the others."""
    put(work, "velocity_publisher.py")
    put(work, "locked/x.py")
    refuse(monkeypatch, "locked")
    submission = stage_submission(str(work), WANTED, into)
    assert submission.notes == ("not copied: locked (the folder cannot be read: Permission denied)",)


def test_an_unreadable_submission_is_an_error(work: Path, into: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The folder that was named has to be readable."""
    put(work, "velocity_publisher.py")
    refuse(monkeypatch, "alice")
    with pytest.raises(SubmissionError, match="the folder cannot be read: Permission denied"):
        stage_submission(str(work), WANTED, into)


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root")
def test_real_permissions_are_reported(work: Any, into: Any) -> None:
    """The same with a real mode, where modes bind."""
    put(work, "velocity_publisher.py")
    put(work, "locked.py").chmod(0)
    assert "Permission denied" in stage_submission(str(work), WANTED, into).notes[0]


def test_a_full_disk_is_not_the_students_fault(work: Path, into: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A copy that cannot be written is our problem."""
    put(work, "velocity_publisher.py")

    def full(self: Path, content: bytes) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(HarnessError, match="cannot be copied: No space left on device"):
        stage_submission(str(work), WANTED, into)


@given(st.text(st.characters(exclude_characters="/\0", exclude_categories=()), min_size=1, max_size=60))
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_any_name_can_be_asked_for(tmp_path_factory: pytest.TempPathFactory, name: str) -> None:
    """A file of any name beside the wanted one is copied or left out, and never stops the intake."""
    work, into = tmp_path_factory.mktemp("work"), tmp_path_factory.mktemp("into")
    put(work, "velocity_publisher.py")
    try:
        (work / name).write_bytes(b"1")
    except (OSError, UnicodeEncodeError):
        return
    submission = stage_submission(str(work), WANTED, into)
    assert submission.files["velocity_publisher.py"].found is not None


def test_a_folder_exchanged_for_a_link_meanwhile_is_not_followed(work: Path, tmp_path: Path) -> None:
    """Between listing and reading, nothing can be slipped in from elsewhere."""
    put(work, "sub/odom_subscriber.py", "mine")
    secret = put(tmp_path, "secret/odom_subscriber.py", "secret").parent
    top, left = os.open(work, os.O_RDONLY), LeftOut()
    try:
        assert staging._content(top, "sub/odom_subscriber.py", left, 100) == b"mine"
        (work / "sub").rename(tmp_path / "moved")
        (work / "sub").symlink_to(secret)
        assert staging._content(top, "sub/odom_subscriber.py", left, 100) is None
    finally:
        os.close(top)
    assert left.notes() == ("not copied: sub/odom_subscriber.py (it cannot be read: Not a directory)",)


def test_what_file_managers_leave_is_passed_over(work: Path, into: Path) -> None:
    """Their files are not part of the submission, and do not change the digest."""
    put(work, "velocity_publisher.py")
    for name in (".DS_Store", "sub/Thumbs.db", "desktop.ini", "._velocity_publisher.py"):
        put(work, name)
    assert stage_submission(str(work), WANTED, into).notes == ()
    assert staged_files(into) == ["velocity_publisher.py"]
