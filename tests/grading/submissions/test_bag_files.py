"""Which recording of a submission a rubric means: by its file, its folder, or a pattern for either."""

from __future__ import annotations

import zipfile
from pathlib import Path

import pytest

from grader.grading.submissions import collected
from grader.grading.submissions.bag_files import FoundBag, bags_in, find_bag
from grader.grading.submissions.collected import SubmissionLimits
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.quantities import MIB

FILES = [
    "node.py",
    "bags/square/metadata.yaml",
    "bags/square/square_0.mcap",
    "bags/square/square_1.mcap.zstd",
    "loose/circle.db3",
    "package/config/metadata.yaml",
]


@pytest.fixture
def work(tmp_path: Path) -> Path:
    folder = tmp_path / "ada"
    folder.mkdir()
    return folder


def test_a_folder_with_metadata_is_one_recording_and_another_file_is_one_by_itself() -> None:
    assert bags_in(FILES) == (
        FoundBag("bags/square", tuple(FILES[1:4])),
        FoundBag("loose/circle.db3", ("loose/circle.db3",)),
    )


@pytest.mark.parametrize(
    ("pattern", "path"),
    [
        ("*.mcap", "bags/square"),
        ("square", "bags/square"),
        ("Square*", "bags/square"),
        ("square_1.mcap", "bags/square"),
        ("*.db3", "loose/circle.db3"),
        ("CIRCLE.db3", "loose/circle.db3"),
    ],
)
def test_a_pattern_is_that_of_a_file_or_of_a_folder(pattern: str, path: str) -> None:
    assert find_bag(pattern, FILES).found == path


def test_the_submission_itself_may_be_the_folder() -> None:
    assert find_bag("*.db3", ["metadata.yaml", "run_0.db3"]).found == "."


def test_of_several_none_is_taken_and_all_are_named() -> None:
    found = find_bag("*", FILES)
    assert found.found is None
    assert found.problem == "expected one recording, found 2: bags/square and loose/circle.db3"
    assert found.hint == "hand in the one that is to be graded, and no other"


def test_a_missing_one_is_told_with_the_pattern_and_with_those_that_are_there() -> None:
    found = find_bag("run*.mcap", FILES)
    assert (found.found, found.problem) == (None, "")
    assert found.candidates == ("bags/square", "loose/circle.db3")
    assert found.hint == (
        "hand in one recording named run*.mcap, as `ros2 bag record --storage mcap` makes it: "
        "its folder, or its .mcap file"
    )


def test_a_submission_that_is_a_recording_of_another_name_is_told_by_its_file() -> None:
    found = find_bag("*.mcap", ["metadata.yaml", "run_0.db3"])
    assert (found.found, found.candidates) == (None, ("run_0.db3",))
    assert find_bag("lap", ["run_0.mcap"]).hint == (
        "hand in one recording named lap, as `ros2 bag record` makes it: its folder, or its .mcap or .db3 file"
    )


def test_one_of_ros_1_is_told_from_none() -> None:
    found = find_bag("*", ["old.bag", "node.py"])
    assert found.problem == "old.bag is a recording of ROS 1"
    assert found.hint == "convert it with `rosbags-convert --src FILE.bag --dst FOLDER`"


def test_recordings_have_a_limit_of_their_own_where_one_is_wanted(work: Path, into: Path) -> None:
    (work / "run.mcap").write_bytes(bytes(9 * MIB))
    (work / "node.py").write_text("x = 1\n")
    staged = stage_submission(str(work), ["node.py", "*.mcap"], into)
    assert staged.files["*.mcap"].found == "run.mcap"
    assert (into / "run.mcap").stat().st_size == 9 * MIB
    assert staged.notes == ()


def test_without_a_rubric_that_wants_one_nothing_changes(work: Path, into: Path) -> None:
    (work / "run.mcap").write_bytes(bytes(9 * MIB))
    (work / "node.py").write_text("x = 1\n")
    assert stage_submission(str(work), ["node.py"], into).notes == ("not copied: run.mcap (larger than 8 MiB)",)


def test_one_that_is_too_large_to_be_copied_is_named(work: Path, into: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(collected, "_WITH_BAGS", SubmissionLimits(file_bytes=MIB, bag_bytes=MIB))
    (work / "run.mcap").write_bytes(bytes(2 * MIB))
    found = stage_submission(str(work), ["*.mcap"], into).files["*.mcap"]
    assert (found.found, found.problem) == (None, "run.mcap is too large to be read")
    assert found.hint.startswith("record only the topics that are asked for")


def test_a_recording_alone_may_be_the_submission(work: Path, into: Path) -> None:
    (work / "run.mcap").write_bytes(b"something")
    assert stage_submission(str(work / "run.mcap"), ["*.mcap"], into).files["*.mcap"].found == "run.mcap"
    with pytest.raises(SubmissionError, match="found another kind of file"):
        stage_submission(str(work / "run.mcap"), ["node.py"], into)
    (work / "metadata.yaml").touch()
    with pytest.raises(
        SubmissionError, match=r"expected a folder, a recording, a \.py file or an archive, found another"
    ):
        stage_submission(str(work / "metadata.yaml"), ["*.mcap"], into)


def test_one_in_an_archive_is_found_as_in_a_folder(work: Path, tmp_path: Path, into: Path) -> None:
    with zipfile.ZipFile(tmp_path / "ada.zip", "w", zipfile.ZIP_STORED) as archive:
        archive.writestr("bags/run.mcap", bytes(9 * MIB))
    staged = stage_submission(str(tmp_path / "ada.zip"), ["*.mcap"], into)
    assert staged.files["*.mcap"].found == "bags/run.mcap"


def test_a_submission_without_any_is_graded_and_not_refused(work: Path, into: Path) -> None:
    (work / "README.md").write_text("My robot drove.\n")
    assert stage_submission(str(work), ["*.mcap"], into).files["*.mcap"].found is None
    with pytest.raises(SubmissionError, match="expected at least one"):
        stage_submission(str(work), ["node.py"], into)
