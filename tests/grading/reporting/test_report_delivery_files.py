"""Output files: whole or not at all."""

from __future__ import annotations

import os
import stat
from pathlib import Path

import pytest

from grader.grading.reporting.delivery import check_writable
from grader.runtime.files import write_whole


def test_a_new_file_has_the_usual_mode(tmp_path: Path) -> None:
    """A report is as readable for others as any file that the user makes."""
    before = os.umask(0o027)
    try:
        write_whole(tmp_path / "r.json", b"new")
    finally:
        os.umask(before)
    assert (tmp_path / "r.json").read_bytes() == b"new"
    assert stat.S_IMODE((tmp_path / "r.json").stat().st_mode) == 0o640


def test_an_existing_file_keeps_its_mode_and_its_readers(tmp_path: Path) -> None:
    """Whoever has the old report open reads the old report to its end."""
    path = tmp_path / "r.json"
    path.write_bytes(b"old")
    path.chmod(0o600)
    with path.open("rb") as reader:
        write_whole(path, b"new")
        assert reader.read() == b"old"
    assert path.read_bytes() == b"new"
    assert stat.S_IMODE(path.stat().st_mode) == 0o600


def test_a_failed_write_leaves_the_old_file_and_nothing_else(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A full disk does not destroy yesterday's report."""
    path = tmp_path / "r.json"
    path.write_bytes(b"old")

    def full(descriptor: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", full)
    with pytest.raises(OSError, match="No space left"):
        write_whole(path, b"new")
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_write_leaves_nothing_either(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Ctrl-C in the middle of writing leaves no litter."""

    def interrupt(descriptor: int) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(os, "fsync", interrupt)
    with pytest.raises(KeyboardInterrupt):
        write_whole(tmp_path / "r.json", b"new")
    assert list(tmp_path.iterdir()) == []


def test_a_link_stays_a_link(tmp_path: Path) -> None:
    """The file behind a link is replaced, not the link."""
    (tmp_path / "deep").mkdir()
    link = tmp_path / "link"
    link.symlink_to("deep/r.json")
    write_whole(link, b"new")
    assert link.is_symlink()
    assert (tmp_path / "deep" / "r.json").read_bytes() == b"new"


def test_a_device_is_written_to_and_not_replaced() -> None:
    """`-o json=/dev/null` must not turn the device into a file."""
    check_writable(Path("/dev/null"))
    write_whole(Path("/dev/null"), b"new")
    assert Path("/dev/null").is_char_device()


def test_the_check_changes_nothing(tmp_path: Path) -> None:
    """Asking whether a report could be written leaves no file."""
    old = tmp_path / "old"
    old.write_bytes(b"old")
    check_writable(old)
    check_writable(tmp_path / "new")
    assert list(tmp_path.iterdir()) == [old]
    assert old.read_bytes() == b"old"


def test_what_cannot_be_written_is_refused(tmp_path: Path) -> None:
    """A folder, a missing folder and a file in the place of a folder."""
    (tmp_path / "file").touch()
    with pytest.raises(IsADirectoryError):
        check_writable(tmp_path)
    with pytest.raises(FileNotFoundError):
        check_writable(tmp_path / "missing" / "r.json")
    with pytest.raises(NotADirectoryError):
        check_writable(tmp_path / "file" / "r.json")


@pytest.mark.skipif(os.geteuid() == 0, reason="permissions do not bind root")
def test_a_read_only_folder_is_refused(tmp_path: Path) -> None:
    """It is refused before anything is graded."""
    tmp_path.chmod(0o500)
    with pytest.raises(PermissionError):
        check_writable(tmp_path / "r.json")
