"""Which submissions are found in folders and downloads, what they are called, and what is named instead of dropped."""

from __future__ import annotations

import io
import os
import re
import shutil
import stat
import sys
import tarfile
import zipfile
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

import pytest

from grader.course.classroom import downloads
from grader.course.classroom.downloads import AUTO
from grader.course.classroom.intake import HandedInEntry, Intake, check_places, take_in
from grader.grading.submissions.submission import collect_submission
from grader.runtime.model.errors import ClassError, SubmissionError
from grader.runtime.model.limits import MAX_ARCHIVE_BYTES

PY = b"print('hello')\n"


def put(folder: Path, *names: str) -> Path:
    """Write a file for each name."""
    for name in names:
        (folder / name).parent.mkdir(parents=True, exist_ok=True)
        (folder / name).write_bytes(PY)
    return folder


def zipped(path: Path, files: Mapping[str, bytes], links: Sequence[str] = ()) -> Path:
    """Write a zip of name -> content."""
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo("x")
            info.filename = name
            info.external_attr = (stat.S_IFLNK if name in links else stat.S_IFREG | 0o644) << 16
            archive.writestr(info, content, zipfile.ZIP_DEFLATED)
    return path


def packed(files: Mapping[str, bytes]) -> bytes:
    """Return a zip as bytes."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)
    return buffer.getvalue()


def found(tmp_path: Path, *sources: Path, **how: str) -> Intake:
    return take_in(sources, tmp_path / "out", **how)


def names(intake: Intake) -> list[str]:
    return [entry.name for entry in intake.entries]


def contents(entry: HandedInEntry) -> list[str]:
    """Return the files of an entry that is a folder."""
    return sorted(p.relative_to(entry.path).as_posix() for p in entry.path.rglob("*") if p.is_file())


def test_folders_and_archives_are_submissions(tmp_path: Path) -> None:
    """One a student; what is neither is named, and what systems leave there is not."""
    class_ = put(tmp_path / "class", "ada/a.py", "Bob Ross/b.py", "notes.txt", ".git/x", "__MACOSX/y", ".DS_Store")
    zipped(class_ / "cleo.tar.gz", {"c.py": PY})
    intake = found(tmp_path, class_)
    assert names(intake) == ["ada", "bob-ross", "cleo"]
    assert [entry.label for entry in intake.entries] == ["ada", "Bob Ross", "cleo"]
    assert intake.layouts == ((str(class_), "folders"),)
    assert [stray.rpartition("/")[2] for stray in intake.strays] == [
        ".git: its name begins with a dot, so it is not graded",
        "notes.txt: neither a folder nor an archive",
    ]


HIDDEN = (".ada/a.py", ".bob.zip", "venv/c.py", "dan/d.py", "eve/e.py")


def test_what_is_passed_over_for_its_name_is_named(tmp_path: Path) -> None:
    """A student may be called like that; folder or archive, nothing disappears without a word."""
    intake = found(tmp_path, put(tmp_path / "class", *HIDDEN))
    assert names(intake) == ["dan", "eve"]
    assert [stray.rpartition("/")[2].partition(":")[0] for stray in intake.strays] == [".ada", ".bob.zip", "venv"]


def test_what_is_passed_over_in_a_download_is_named(tmp_path: Path) -> None:
    """Once for each folder, also when the download was unpacked before; not what a system has put there."""
    further = (".ada/b.py", "__MACOSX/dan/._d.py", ".DS_Store", "._eve")
    files = {f"hw/{name}": PY for name in (*HIDDEN, *further)}
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", files))
    assert names(intake) == ["dan", "eve"]
    hidden = [re.search("([^/: ]+): its name", stray) for stray in intake.strays]
    assert sorted(found[1] for found in hidden if found) == [".ada", ".bob.zip", "venv"]
    assert found(tmp_path, tmp_path / "hw.zip") == intake


def test_results_in_the_folder_of_submissions_are_none_of_them(tmp_path: Path) -> None:
    """Neither at first nor when the command is given again."""
    class_ = put(tmp_path / "class", "ada/a.py", "out/students/ada/x.py")
    assert names(take_in([class_], class_ / "out")) == ["ada"]


@pytest.mark.parametrize("place", ["class", "class/ada/out", "class/ada/deeper/out"])
def test_results_are_not_written_among_submissions(tmp_path: Path, place: str) -> None:
    """Everybody's programs would be in somebody's submission, and the results themselves be graded."""
    class_ = put(tmp_path / "class", "ada/a.py", "bob/b.py")
    with pytest.raises(ClassError, match="expected a folder for results, found that it is among the submissions"):
        check_places([class_], tmp_path / place)
    check_places([class_], class_ / "out")
    check_places([class_], tmp_path)


@pytest.mark.parametrize("place", ["students", "unpacked/hw"])
def test_results_are_not_submissions(tmp_path: Path, place: str) -> None:
    """A part of the results folder is no class."""
    put(tmp_path / "out" / place, "ada/a.py")
    with pytest.raises(ClassError, match="expected submissions, found a part of the results"):
        check_places([tmp_path / "out" / place], tmp_path / "out")


def test_results_of_another_run_are_not_graded(tmp_path: Path) -> None:
    """They may lie beside the submissions."""
    class_ = put(tmp_path / "class", "ada/a.py", "old/class.yaml", "old/students/ada/report.json", "old/assets/x.js")
    intake = found(tmp_path, class_)
    assert names(intake) == ["ada"]
    assert intake.strays == (f"{class_}/old: the results of a class, so it is not graded",)


def test_a_source_counts_once(tmp_path: Path) -> None:
    """However it is named, and a download also as a copy."""
    class_ = put(tmp_path / "class", "ada/a.py", "bob/b.py")
    (tmp_path / "link").symlink_to(class_)
    archive = zipped(tmp_path / "hw.zip", {"cleo/c.py": PY, "dan/d.py": PY})
    shutil.copy(archive, tmp_path / "hw (1).zip")
    intake = found(tmp_path, class_, class_, tmp_path / "link", archive, tmp_path / "hw (1).zip")
    assert names(intake) == ["ada", "bob", "cleo", "dan"]
    assert [stray.partition(": ")[2] for stray in intake.strays] == [
        "given twice, so it is counted once",
        f"given twice, first as {class_}, so it is counted once",
        f"given twice, first as {archive}, so it is counted once",
    ]


def test_a_link_is_not_followed(tmp_path: Path) -> None:
    """It may lead to somebody else's work."""
    class_ = put(tmp_path / "class", "ada/a.py")
    (class_ / "bob").symlink_to(class_ / "ada")
    intake = found(tmp_path, class_)
    assert names(intake) == ["ada"]
    assert intake.strays[0].endswith("bob: a link, which is not followed")


@pytest.mark.parametrize("order", [("Ada", "ada"), ("ada", "Ada")])
def test_names_that_become_the_same_are_told_apart_whatever_the_order(tmp_path: Path, order: tuple[str, str]) -> None:
    """Each name follows from the submission alone."""
    class_ = put(tmp_path / "class", *(f"{name}/a.py" for name in order))
    assert {e.label: e.name for e in found(tmp_path, class_).entries} == {"Ada": "ada-2e5fcc", "ada": "ada-64df89"}


def test_several_sources_are_one_class(tmp_path: Path) -> None:
    """Submissions of the same name in two of them stay two."""
    one, other = put(tmp_path / "one", "ada/a.py", "bob/b.py"), put(tmp_path / "other", "ada/a.py")
    assert len(set(names(found(tmp_path, one, other)))) == 3


def test_downloads_of_one_name_are_not_mixed_up(tmp_path: Path) -> None:
    """Each is unpacked into a place of its own."""
    (tmp_path / "a").mkdir()
    (tmp_path / "b").mkdir()
    one = zipped(tmp_path / "a" / "hw.zip", {"ada/a.py": PY, "bob/b.py": PY})
    other = zipped(tmp_path / "b" / "hw.zip", {"ada/a.py": b"other", "cleo/b.py": PY})
    intake = found(tmp_path, one, other)
    assert len(intake.entries) == 4
    assert {(e.path / "a.py").read_bytes() for e in intake.entries if e.label == "ada"} == {PY, b"other"}


@pytest.mark.parametrize("ending", ["", "_"])
def test_moodle_with_folders(tmp_path: Path, ending: str) -> None:
    """A student's file and text belong together; the number is the participant's."""
    archive = zipped(
        tmp_path / "course-hw-12.zip",
        {
            f"Ada Lovelace_657693_assignsubmission_file{ending}/velocity_publisher.py": PY,
            f"Ada Lovelace_657693_assignsubmission_onlinetext{ending}/onlinetext.html": b"<p>hi",
            f"Bob O'Neil_657694_assignsubmission_file{ending}/hw.zip": packed({"velocity_publisher.py": PY}),
        },
    )
    intake = found(tmp_path, archive)
    assert intake.layouts[0][1] == "moodle"
    assert [dict(e.identity) for e in intake.entries] == [
        {"name": "Ada Lovelace", "id": "657693"},
        {"name": "Bob O'Neil", "id": "657694"},
    ]
    assert names(intake) == ["ada-lovelace-657693", "bob-o-neil-657694"]
    assert contents(intake.entries[0]) == ["onlinetext.html", "velocity_publisher.py"]


def test_moodle_without_folders(tmp_path: Path) -> None:
    """Files of one student get their own names back."""
    prefix = "Ada Lovelace_657693_assignsubmission_file_"
    files = {
        f"{prefix}fan_controller.py": PY,
        f"{prefix}temperature_sensor.py": PY,
        "Bob_1_assignsubmission_file_x.py": PY,
    }
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", files))
    assert [contents(entry) for entry in intake.entries] == [["fan_controller.py", "temperature_sensor.py"], ["x.py"]]


def test_canvas(tmp_path: Path) -> None:
    """Files get their own names back, also those that were handed in again, and lateness is noted."""
    files = {
        "lovelaceada_1001_77001_velocity_publisher-2.py": PY,
        "lovelaceada_1001_77002_odom_subscriber.py": PY,
        "rossbob_LATE_1002_77003_hw.zip": packed({"velocity_publisher.py": PY}),
    }
    intake = found(tmp_path, zipped(tmp_path / "submissions.zip", files))
    assert intake.layouts[0][1] == "canvas"
    ada, bob = intake.entries
    assert (dict(ada.identity), ada.late) == ({"name": "lovelaceada", "id": "1001"}, False)
    assert contents(ada) == ["odom_subscriber.py", "velocity_publisher.py"]
    assert (dict(bob.identity), bob.late, bob.path.name) == ({"name": "rossbob", "id": "1002"}, True, "hw.zip")


@pytest.mark.parametrize(
    ("handed_in", "files"),
    [
        (("x.py", "photo-1.png", "photo-2.png"), ["photo-1.png", "photo-2.png", "x.py"]),
        (("x.py", "x-1.py"), ["x-1.py", "x.py"]),
        (("x-1.py", "x-2.py"), ["x-1.py", "x-2.py"]),
        (("x-3.py", "helper-1.py"), ["helper.py", "x.py"]),
        (("x.py", "lab-1.py"), ["lab-1.py", "x.py"]),  # an exercise asks for this name
        (("x.py", "map-1.yaml"), ["map-1.yaml", "map.yaml", "x.py"]),  # the program may open either
        (("x.py", "Figure-1.png", "Figure.png"), ["Figure-1.png", "Figure.png", "x.py"]),
    ],
)
def test_numbers_that_students_give_their_files(tmp_path: Path, handed_in: tuple[str, ...], files: list[str]) -> None:
    """Canvas adds one to what is handed in again; nobody is refused because of them, and no wanted name is lost."""
    named = {f"doejane_11_{20 + number}_{name}": PY for number, name in enumerate(handed_in)}
    archive = zipped(tmp_path / "hw.zip", {**named, "rossbob_12_9_x.py": PY})
    jane, _ = take_in([archive], tmp_path / "out", wanted=("x.py", "lab-1.py")).entries
    assert (jane.problem, contents(jane)) == ("", files)


def test_files_of_one_name(tmp_path: Path) -> None:
    """Of two programs nobody knows which is meant, unless they are the same; pictures are numbered."""

    def jane(**others: bytes) -> HandedInEntry:
        files = {f"doejane_11_{number}_x.{kind[:3]}": data for number, (kind, data) in enumerate(others.items())}
        archive = zipped(tmp_path / "hw.zip", {**files, "rossbob_12_9_x.py": PY})
        return found(tmp_path, archive).entries[0]

    assert jane(py_=PY, png1=b"1", png2=b"2").problem == ""
    assert contents(jane(png1=b"1", png2=b"2", png3=b"2")) == ["x (2).png", "x (3).png", "x.png"]


def test_two_programs_of_one_name_are_refused(tmp_path: Path) -> None:
    """Also where they lie in two folders of one participant; the same program twice is one."""
    class_ = put(tmp_path / "class", "Bob_2_assignsubmission_file_/b.py")
    for name in ("Ada_1_assignsubmission_file_", "Ada_1_assignsubmission_onlinetext_"):
        put(class_, f"{name}/x.py")
    assert [(e.problem, contents(e)) for e in found(tmp_path, class_).entries] == [("", ["x.py"]), ("", ["b.py"])]
    (class_ / "Ada_1_assignsubmission_file_" / "x.py").write_bytes(b"other")
    ada, bob = found(tmp_path, class_).entries
    assert (ada.problem, bob.problem) == (
        "expected files with different names, found two different ones named x.py",
        "",
    )


@pytest.mark.parametrize("ending", ["", "_"])
def test_a_display_name_with_words_of_the_platform_moves_no_file(tmp_path: Path, ending: str) -> None:
    """The folder of a participant ends at the last of Moodle's words."""
    evil = f"NAME A_4711_assignsubmission_file_x_9_assignsubmission_file{ending}"
    class_ = put(tmp_path / "class", f"NAME A_4711_assignsubmission_file{ending}/x.py", f"{evil}/x.py")
    (class_ / evil / "x.py").write_bytes(b"evil")
    intake = found(tmp_path, class_)
    assert {entry.identity["id"]: (entry.path / "x.py").read_bytes() for entry in intake.entries} == {
        "4711": PY,
        "9": b"evil",
    }


@pytest.mark.parametrize(
    ("files", "kept"),
    [
        # Moodle without folders: participant 9 calls itself like the beginning of the name of another file
        (("A_47_assignsubmission_file_x.py", "A_47_assignsubmission_file_b_9_assignsubmission_file_x.py"), {"47": 1}),
        (("B_46_assignsubmission_file_x.py", "A_47_assignsubmission_file_b_9_assignsubmission_file_x.py"), {"46": 1}),
        # Canvas: somebody calls himself `doejane_11`, and a student hands in a file with a number in front
        (("doejane_11_21_x.py", "doejane_11_2002_77_x.py"), {"11": 1}),
        (("doejane_11_21_1_x.py", "doejane_11_22_2_notes.txt", "rossbob_12_9_x.py"), {"11": 2, "12": 1}),
    ],
)
def test_a_file_that_two_students_may_have_handed_in_is_in_no_submission_of_another(
    tmp_path: Path, files: tuple[str, ...], kept: dict[str, int]
) -> None:
    """It is named instead."""
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", dict.fromkeys(files, PY)))
    assert {entry.identity["id"]: len(contents(entry)) for entry in intake.entries} == kept
    assert len(intake.strays) == len(files) - sum(kept.values())
    assert all("can be read in two ways" in stray for stray in intake.strays)


def test_clones_of_github_classroom(tmp_path: Path) -> None:
    """The folder says what comes before the user's name, which may hold hyphens."""
    clones = put(tmp_path / "hw-1-submissions", "hw-1-ada/a.py", "hw-1-bob-ross/b.py")
    intake = found(tmp_path, clones)
    assert intake.layouts[0][1] == "github-classroom"
    assert [dict(entry.identity) for entry in intake.entries] == [{"user": "ada"}, {"user": "bob-ross"}]


def test_clones_of_classroom50(tmp_path: Path) -> None:
    """What all names have in common comes before the user's name; the table of scores is no submission."""
    clones = put(tmp_path / "ros_submissions_2026", "ros-hw-ada/a.py", "ros-hw-bob-ross/b.py", "scores.csv")
    intake = found(tmp_path, clones, layout="classroom50")
    assert [entry.identity["user"] for entry in intake.entries] == ["ada", "bob-ross"]
    assert len(intake.strays) == 1


def test_a_pattern_of_ones_own(tmp_path: Path) -> None:
    """Names that do not match are graded all the same, and say so."""
    class_ = put(tmp_path / "class", "1234 - Ada/a.py", "readme/x.py")
    intake = found(tmp_path, class_, pattern=r"(?P<id>\d+) - (?P<name>.+)")
    assert [(dict(e.identity), e.recognised) for e in intake.entries] == [
        ({"id": "1234", "name": "Ada"}, True),
        ({}, False),
    ]


@pytest.mark.parametrize(
    ("pattern", "text"),
    [
        ("(?P<name>", "--pattern, column 1: expected a regular expression, found (?P<name>: missing )"),
        ("(?P<nmae>.*)", "found the group nmae"),
        (".*", "found no named group"),
    ],
)
def test_a_pattern_that_cannot_be_used(tmp_path: Path, pattern: str, text: str) -> None:
    """The message says what is wrong with it."""
    with pytest.raises(ClassError) as error:
        found(tmp_path, put(tmp_path / "class", "ada/a.py"), pattern=pattern)
    assert text in error.value.message


def test_a_folder_around_everything_is_opened(tmp_path: Path) -> None:
    """Many tools pack a folder and not what is in it."""
    archive = zipped(tmp_path / "hw.zip", {"hw/ada/a.py": PY, "hw/bob.zip": packed({"b.py": PY})})
    assert names(found(tmp_path, archive)) == ["ada", "bob"]


def test_a_class_of_one_is_not_opened(tmp_path: Path) -> None:
    """The only folder is a student's."""
    assert names(found(tmp_path, zipped(tmp_path / "hw.zip", {"ada/a.py": PY, "ada/pkg/b.py": PY}))) == ["ada"]


@pytest.mark.parametrize("compression", ["", "gz", "bz2", "xz"])
def test_a_tar_is_a_download(tmp_path: Path, compression: str) -> None:
    """Compressed or not, with and without a leading dot."""
    path = tmp_path / "hw.tar"
    with tarfile.open(path, f"w:{compression}") as archive:  # type: ignore[call-overload]
        for name in ("./ada/a.py", "bob/b.py"):
            info = tarfile.TarInfo(name)
            info.size = len(PY)
            archive.addfile(info, io.BytesIO(PY))
    assert names(found(tmp_path, path)) == ["ada", "bob"]


@pytest.mark.parametrize(
    ("bad", "text"),
    [
        ("ada/../../../evil.py", "a name that leads out of the archive"),
        ("ada/x\\..\\y.py", "a name that leads out of the archive"),
        ("ada/y\n.py", "a control character"),
        ("ada/link", "a link"),
        ("ada/con.py", "Windows keeps for a device"),
    ],
)
def test_what_one_student_packed_badly_spoils_nobody_else(tmp_path: Path, bad: str, text: str) -> None:
    """That submission is listed with the reason; nothing of it is written."""
    archive = zipped(
        tmp_path / "hw.zip", {"ada/a.py": PY, bad: b"/etc/passwd", "bob/b.py": PY}, links=[bad] if "link" in bad else []
    )
    ada, bob = found(tmp_path, archive).entries
    assert text in ada.problem
    assert not ada.path.exists()
    assert (bob.problem, contents(bob)) == ("", ["b.py"])
    assert not list(tmp_path.rglob("evil*"))


@pytest.mark.parametrize("odd", ["Icon\r", "report.", "aux.txt", "A.TXT"])
def test_an_odd_name_of_a_file_that_is_no_program_refuses_nobody(tmp_path: Path, odd: str) -> None:
    """It is left out, and that is told."""
    files = {"ada/a.py": PY, "ada/a.txt": b"1", f"ada/{odd}": b"2", "bob/b.py": PY}
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", files))
    assert [(e.problem, contents(e)) for e in intake.entries] == [("", ["a.py", "a.txt"]), ("", ["b.py"])]
    assert [stray.endswith("so it is left out of its submission") for stray in intake.strays] == [True]


def test_what_is_bad_in_a_folder_around_everything_spoils_nobody_else(tmp_path: Path) -> None:
    """Also where the whole class lies in one folder of the download."""
    files = {"hw/": b"", "hw/ada/../../evil.py": PY, "hw/bob/b.py": PY, "hw/cleo/c.py": PY, "hw/scores.csv": b""}
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", files))
    assert [(e.name, bool(e.problem)) for e in intake.entries] == [("ada", True), ("bob", False), ("cleo", False)]
    assert len(intake.strays) == 1
    again = found(tmp_path, tmp_path / "hw.zip")
    assert again == intake


@pytest.mark.breadth(1, 2)
@pytest.mark.parametrize("size", [9 << 20, MAX_ARCHIVE_BYTES + 1])
def test_a_large_file_is_left_out_in_each_way_of_handing_in(tmp_path: Path, size: int) -> None:
    """With the note that it gets in a folder which is graded by itself."""
    bag = bytes(size)
    folder = put(tmp_path / "folder" / "ada", "x.py")
    (folder / "bag.db3").write_bytes(bag)
    zipped(put(tmp_path / "zips", "bob/x.py") / "ada.zip", {"x.py": PY, "bag.db3": bag})
    sources = [
        tmp_path / "folder",
        tmp_path / "zips",
        zipped(tmp_path / "plain.zip", {"ada/x.py": PY, "ada/bag.db3": bag, "bob/x.py": PY}),
        zipped(tmp_path / "inner.zip", {"ada.zip": (tmp_path / "zips/ada.zip").read_bytes(), "bob/x.py": PY}),
        zipped(
            tmp_path / "moodle.zip",
            {
                "ada_1_assignsubmission_file_/x.py": PY,
                "ada_1_assignsubmission_file_/bag.db3": bag,
                "Bob_2_assignsubmission_file_/x.py": PY,
            },
        ),
        zipped(
            tmp_path / "flat.zip",
            {
                "ada_1_assignsubmission_file_x.py": PY,
                "ada_1_assignsubmission_file_bag.db3": bag,
                "Bob_2_assignsubmission_file_x.py": PY,
            },
        ),
        zipped(tmp_path / "canvas.zip", {"ada_1_2_x.py": PY, "ada_1_3_bag.db3": bag, "rossbob_2_4_x.py": PY}),
    ]
    for source in sources:
        ada = next(entry for entry in found(tmp_path, source).entries if entry.name.startswith("ada"))
        assert ada.problem == ""
        (tmp_path / "scratch").mkdir(exist_ok=True)
        collected = collect_submission(str(ada.path), ("x.py",), tmp_path / "scratch")
        assert ([name for name, _ in collected.files], collected.notes) == (
            ["x.py"],
            ("not copied: bag.db3 (larger than 8 MiB)",),
        ), source
    used = sum(path.stat().st_blocks * 512 for path in (tmp_path / "out").rglob("*.db3"))
    assert used < size  # nothing but a size is kept of what nobody reads


@pytest.mark.long
def test_an_archive_that_is_too_large_is_refused_as_by_itself(tmp_path: Path) -> None:
    """The limit of an archive is larger than that of a file in it."""
    noise = os.urandom(MAX_ARCHIVE_BYTES + 1)
    archive = zipped(tmp_path / "hw.zip", {"ada.zip": noise, "bob/x.py": PY})
    ada, bob = found(tmp_path, archive).entries
    with pytest.raises(SubmissionError, match=r"ada\.zip: expected at most 64 MiB, found more"):
        collect_submission(str(ada.path), ("x.py",), tmp_path)
    assert bob.problem == ""


def test_a_pipe_in_a_folder_that_is_put_together_refuses_that_student(tmp_path: Path) -> None:
    """It is not waited for, and the others go on."""
    class_ = put(tmp_path / "class", "Bob_2_assignsubmission_file/b.py")
    for kind in ("file", "onlinetext"):
        put(class_, f"Ada_1_assignsubmission_{kind}/{kind}.py")
    os.mkfifo(class_ / "Ada_1_assignsubmission_file" / "pipe")
    ada, bob = found(tmp_path, class_).entries
    assert (bool(ada.problem), bob.problem) == (True, "")


@pytest.mark.parametrize("bad", ["/etc/evil.py", "../evil.py", "C:/evil.py"])
def test_a_member_of_nobody_is_named(tmp_path: Path, bad: str) -> None:
    """It is not written anywhere."""
    intake = found(tmp_path, zipped(tmp_path / "hw.zip", {bad: PY, "bob/b.py": PY, "cleo/c.py": PY}))
    assert names(intake) == ["bob", "cleo"]
    assert len(intake.strays) == 1
    assert "evil.py" in intake.strays[0]
    assert not list(tmp_path.rglob("evil*"))


def test_one_student_cannot_fill_the_disk(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """What is too large is refused by itself, counted while it is unpacked; the message names where that was."""
    monkeypatch.setattr(downloads, "MAX_PART_BYTES", 2 << 20)
    files = {f"ada/{number}.bin": bytes(1 << 20) for number in range(3)}
    ada, bob = found(tmp_path, zipped(tmp_path / "hw.zip", {**files, "bob/b.py": PY})).entries
    assert ada.problem == "expected at most 2 MiB in all, found more with ada/2.bin"
    assert bob.problem == ""


def test_a_download_is_unpacked_once_and_again_when_it_changed(tmp_path: Path) -> None:
    """The same bytes are the same folder; another download replaces it as a whole."""
    archive = zipped(tmp_path / "hw.zip", {"ada/a.py": PY, "bob/b.py": PY})
    first = found(tmp_path, archive).entries[0].path
    (first / "mark").touch()
    assert (found(tmp_path, archive).entries[0].path / "mark").exists()
    zipped(archive, {"ada/a.py": b"new", "bob/b.py": PY})
    again = found(tmp_path, archive).entries[0].path
    assert (again, contents(found(tmp_path, archive).entries[0])) == (first, ["a.py"])
    assert (again / "a.py").read_bytes() == b"new"


def test_refusals_are_remembered(tmp_path: Path) -> None:
    """Also where the download is not unpacked again."""
    archive = zipped(tmp_path / "hw.zip", {"ada/con.py": PY, "bob/b.py": PY})
    first = found(tmp_path, archive)
    assert [e.problem for e in found(tmp_path, archive).entries] == [e.problem for e in first.entries]
    assert first.entries[0].problem


@pytest.mark.parametrize("make", [lambda p: p.mkdir(), lambda p: p.write_bytes(b"PK\x03\x04 no zip"), lambda p: None])
def test_a_source_without_submissions_cannot_be_used(tmp_path: Path, make: Callable[..., Any]) -> None:
    """An empty folder, a damaged download, a path that is not there."""
    source = tmp_path / "source"
    make(source)
    with pytest.raises(ClassError, match="source"):
        found(tmp_path, source, layout=AUTO)


@pytest.mark.skipif(sys.platform != "linux", reason="names that are no text exist on Linux only")
def test_a_name_that_is_no_text_is_safe(tmp_path: Path) -> None:
    """Undecodable bytes, controls and what reorders text do not reach the name of a result."""
    class_ = put(tmp_path / "class", "bob/b.py")
    for raw in (b"ad\xffa", b"\xe2\x80\xaeevil", b"x\ny", b"a" * 200):
        put(class_, Path(class_ / raw.decode("utf-8", "surrogateescape")).name + "/a.py")
    found_names = names(found(tmp_path, class_))
    assert len(set(found_names)) == 5
    assert all(name.isprintable() and len(name.encode()) <= 90 and "/" not in name for name in found_names)


def test_recordings_are_unpacked_where_a_rubric_asks_for_one(tmp_path: Path) -> None:
    """Also from a download that an earlier run has unpacked without them."""
    archive = tmp_path / "all.zip"
    with zipfile.ZipFile(archive, "w", zipfile.ZIP_STORED) as packed:
        for name in ("ada", "bob"):
            packed.writestr(f"{name}/run.mcap", b"x" * (9 << 20))
    for wanted, whole in ((("a.py",), False), (("*.mcap",), True)):
        entries = take_in([archive], tmp_path / "out", wanted=wanted).entries
        assert [(e.path / "run.mcap").read_bytes()[:1] == b"x" for e in entries] == [whole, whole]


def test_so_are_recordings_among_the_files_of_a_student(tmp_path: Path) -> None:
    """A platform that stores single files gives them the student's name."""
    class_ = tmp_path / "submissions"
    class_.mkdir()
    (class_ / "adalovelace_7_11_node.py").write_text("x = 1\n")
    (class_ / "adalovelace_7_12_run.mcap").write_bytes(b"x" * (9 << 20))
    (entry,) = take_in([class_], tmp_path / "out", layout="canvas", wanted=("node.py", "*.mcap")).entries
    assert (entry.path / "run.mcap").stat().st_size == 9 << 20
