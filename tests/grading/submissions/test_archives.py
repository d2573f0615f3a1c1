"""Archives are taken in like the folder they hold, or refused; nothing is ever written outside the staging folder."""

from __future__ import annotations

import bz2
import contextlib
import ctypes.util
import gzip
import io
import lzma
import os
import random
import stat
import struct
import subprocess
import sys
import tarfile
import zipfile
import zlib
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from archive_samples import BY_PY7ZR, old_rarred, rar_record, rar_redirected, rarred, sevened, tarred, zipped
from hypothesis import HealthCheck, example, given, settings
from hypothesis import strategies as st
from hypothesis.strategies._internal.core import DataObject

from grader.grading.submissions.archives import collect_archive
from grader.grading.submissions.collected import SubmissionLimits, is_gradable
from grader.grading.submissions.foreign_archives import UnpackerLimits, foreign_members, has_libarchive
from grader.grading.submissions.members import UnusableArchiveError
from grader.grading.submissions.submission import stage_submission
from grader.runtime.model.errors import SubmissionError
from grader.runtime.model.submission import Submission

WANTED = ("velocity_publisher.py", "odom_subscriber.py")
FILES = {"velocity_publisher.py": b"x = 1\n", "pkg/helper.py": b"", "pkg/data.bin": bytes(range(256)) * 40}

Packer = Callable[[Mapping[str, bytes]], bytes]
#: A zip and a tar.
HONEST: tuple[Packer, ...] = (zipped, tarred)
COMPRESS: tuple[Callable[[bytes], bytes], ...] = (gzip.compress, bz2.compress, lzma.compress)
PACKERS: dict[str, Packer] = {
    "zip": zipped,
    "stored zip": lambda files: zipped(files, zipfile.ZIP_STORED),
    "tar": tarred,
    "ustar": lambda files: tarred(files, format_=tarfile.USTAR_FORMAT),
    "gnu tar": lambda files: tarred(files, format_=tarfile.GNU_FORMAT),
    "tar.gz": lambda files: tarred(files, "gz"),
    "tar.bz2": lambda files: tarred(files, "bz2"),
    "tar.xz": lambda files: tarred(files, "xz"),
    "two gzip streams": lambda files: b"".join(
        gzip.compress(part) for data in [tarred(files)] for part in (data[:700], data[700:])
    ),
}
#: Those that a process of its own unpacks.
FOREIGN: dict[str, Packer] = {
    "7z": sevened,
    "stored 7z": lambda files: sevened(files, compression="copy"),
    "rar": rarred,
    "old rar": old_rarred,
}
needs_libarchive = pytest.mark.skipif(not has_libarchive(), reason="pip install -e '.[archives]', and libarchive13")
EVERY = [*PACKERS, *(pytest.param(kind, marks=needs_libarchive) for kind in FOREIGN)]


def staged(root: Path) -> dict[str, bytes]:
    return {p.relative_to(root).as_posix(): p.read_bytes() for p in root.rglob("*") if p.is_file()}


def hand_in(tmp_path: Path, data: bytes, name: str = "alice.zip") -> Submission:
    """Stage an archive in a folder where everything else would be noticed."""
    place, into = tmp_path / "place", tmp_path / "place" / "staging" / "into"
    into.mkdir(parents=True)
    (place / name).write_bytes(data)
    before = sorted(p for p in tmp_path.rglob("*") if into not in (p, *p.parents))
    try:
        return stage_submission(str(place / name), WANTED, into)
    finally:
        assert sorted(p for p in tmp_path.rglob("*") if into not in (p, *p.parents)) == before
        assert all(p.is_dir() or (p.is_file() and not p.is_symlink()) for p in into.rglob("*"))


def refusal(tmp_path: Path, data: bytes, name: str = "alice.zip") -> tuple[str, str]:
    """Return message and hint of the refusal, without the place, and check that nothing was written."""
    with pytest.raises(SubmissionError) as caught:
        hand_in(tmp_path, data, name)
    assert not list((tmp_path / "place/staging/into").iterdir())
    where = str(tmp_path / "place" / name)
    assert caught.value.message.startswith(where)
    assert caught.value.hint
    assert (caught.value.message + caught.value.hint).isprintable()
    return caught.value.message[len(where) :].lstrip(": "), caught.value.hint


@pytest.mark.breadth(12, 60)
@pytest.mark.parametrize("kind", EVERY)
@pytest.mark.parametrize("name", ["alice.zip", "alice.tar.gz", "alice", "alice.py", "alice.txt"])
def test_an_archive_is_staged_like_the_folder_it_holds(tmp_path: Path, kind: str, name: str) -> None:
    """Every format, under whatever name: the same files, the same digest, the copy readable by everybody."""
    if name == "alice.py" and "tar" in kind and "." not in kind:
        pytest.skip("a .py file that looks like a tar is a program")
    if kind in FOREIGN and name != "alice.zip":
        pytest.skip("the name is looked at before the kind")
    work, other = tmp_path / "w" / "alice", tmp_path / "w" / "into"
    other.mkdir(parents=True)
    for file, content in FILES.items():
        (work / file).parent.mkdir(parents=True, exist_ok=True)
        (work / file).write_bytes(content)
    folder = stage_submission(str(work), WANTED, other)
    archive = hand_in(tmp_path, {**PACKERS, **FOREIGN}[kind](FILES), name)
    assert staged(archive.root) == FILES
    assert archive.digest == folder.digest
    assert archive.files == folder.files
    assert (archive.name, archive.notes) == (name, ())
    assert stat.S_IMODE((archive.root / "pkg/helper.py").stat().st_mode) == 0o644


def test_what_a_folder_is_copied_without_is_passed_over(tmp_path: Path) -> None:
    """What systems and tools add changes nothing, wherever it lies and whatever it is; what is generated is noted."""
    extra = {"__MACOSX/._velocity_publisher.py": b"1", ".DS_Store": b"2", ".git/config": b"3", "a/__pycache__/x": b"4"}
    extra |= {"._x.py": b"5", "a/Thumbs.db": b"6", "venv/bin/python": b"/usr/bin/python3", ".venv/lib64": b"lib"}
    extra |= {"desktop.ini": b"7"}
    links = {"venv/bin/python": tarfile.SYMTYPE, ".venv/lib64": tarfile.SYMTYPE}
    generated = {
        "build/COLCON_IGNORE": b"",
        "build/p/velocity_publisher.py": b"",
        "env/pyvenv.cfg": b"",
        "env/x/y": b"",
    }
    plain = hand_in(tmp_path / "1", tarred(FILES))
    full = hand_in(tmp_path / "2", tarred({**extra, **generated, **FILES}, types=links))
    assert staged(full.root) == FILES
    assert full.digest == plain.digest
    assert full.notes == (
        "not copied: build (it holds COLCON_IGNORE, so a tool made it)",
        "not copied: env (it holds pyvenv.cfg, so a tool made it)",
    )


@pytest.mark.breadth(2, 6)
@pytest.mark.parametrize("outer", ["zip", "tar.gz"])
@pytest.mark.parametrize("inner", ["zip", "tar.xz", pytest.param("rar", marks=needs_libarchive)])
def test_an_archive_in_an_archive_is_opened_once(tmp_path: Path, outer: str, inner: str) -> None:
    """As learning platforms deliver it: the student's own archive, perhaps beside a text, is what is graded."""
    packed = {**PACKERS, **FOREIGN}[inner](FILES)
    direct = hand_in(tmp_path / "1", packed)
    delivered = {"Alice_42_file_/homework.ZIP": packed, "Alice_42_text_/onlinetext.html": b"<p>hi"}
    nested = hand_in(tmp_path / "2", PACKERS[outer](delivered))
    assert staged(nested.root) == FILES
    assert nested.digest == direct.digest
    assert nested.notes == ("the contents of Alice_42_file_/homework.ZIP were graded",)


def test_a_folder_that_holds_one_archive_stands_for_it(tmp_path: Path, into: Path) -> None:
    """A student's folder out of a bulk download."""
    (tmp_path / "Alice").mkdir()
    (tmp_path / "Alice/hw.zip").write_bytes(zipped(FILES))
    submission = stage_submission(str(tmp_path / "Alice"), WANTED, into)
    assert staged(into) == FILES
    assert submission.name == "Alice"


def test_an_archive_beside_programs_is_a_file_like_others(tmp_path: Path) -> None:
    """What lies open is graded."""
    submission = hand_in(tmp_path, zipped({"odom_subscriber.py": b"", "old.zip": zipped(FILES)}))
    assert set(staged(submission.root)) == {"odom_subscriber.py", "old.zip"}


def test_deeper_nesting_and_several_archives_are_refused(tmp_path: Path) -> None:
    """Once and no further; and nobody guesses which of two was meant."""
    twice = zipped({"a.zip": zipped({"b.zip": zipped(FILES)})})
    message, hint = refusal(tmp_path / "1", twice)
    assert (message, hint) == (
        "/a.zip: expected at least one .py file, found b.zip",
        "put your .py files into one zip: b.zip is inside another one",
    )
    message, _ = refusal(tmp_path / "2", zipped({"a.zip": zipped(FILES), "b.zip": zipped(FILES)}))
    assert message == "expected at least one .py file, found 2 archives"
    message, _ = refusal(tmp_path / "3", zipped({"a.zip": b"PK\x03\x04 broken"}))
    assert message == "/a.zip: expected a whole zip archive, found a damaged or incomplete one"


BAD_NAMES = {
    "/etc/passwd.py": "an absolute name",
    "C:/x.py": "an absolute name",
    "c:x.py": "an absolute name",
    "../x.py": "a name that leads out of the archive",
    "a/../../x.py": "a name that leads out of the archive",
    "a/..": "a name that leads out of the archive",
    "a/../.git/x.py": "a name that leads out of the archive",
    "__MACOSX/../../x.py": "a name that leads out of the archive",
    "new\nline.py": "a name with a control character",
    "esc\x1b[2J.py": "a name with a control character",
    "del\x7f.py": "a name with a control character",
    "line\u2028.py": "a name with a control character",
    "a//b.py": "a name with an empty part",
    "a/./b.py": "a name with an empty part",
    "a.py ": "a name with a part that ends in a space or a dot",
    "a.py.": "a name with a part that ends in a space or a dot",
    "src /a.py": "a name with a part that ends in a space or a dot",
    "src/.../a.py": "a name with a part that ends in a space or a dot",
    "con.py": "a name that Windows keeps for a device",
    "a/NUL.PY": "a name that Windows keeps for a device",
    "Lpt1.tar.gz": "a name that Windows keeps for a device",
    "aux/x.py": "a name that Windows keeps for a device",
    "COM\u00b9 .py": "a name that Windows keeps for a device",
    "n" * 256 + ".py": "a name that is too long",
    "\u00e9" * 128 + ".py": "a name that is too long",
    "/".join(["d" * 200] * 10) + "/x.py": "a name that is too long",
}


@pytest.mark.parametrize("packed", [zipped, tarred])
@pytest.mark.parametrize("name", BAD_NAMES)
def test_a_name_that_no_archive_may_hold_is_refused(tmp_path: Path, packed: Callable[..., Any], name: str) -> None:
    """One such name and nothing is taken, also beside good files, and the name is shown harmlessly."""
    message, hint = refusal(tmp_path, packed({**FILES, name: b"x = 2\n"}))
    assert message.startswith(f"expected plain relative names, found {BAD_NAMES[name]}: ")
    assert "zip" in hint


ODD_NAMES = {
    "Icon\r": "a name with a control character",
    "my\tnotes.txt": "a name with a control character",
    "report.": "a name with a part that ends in a space or a dot",
    "old /notes.md": "a name with a part that ends in a space or a dot",
    "aux.txt": "a name that Windows keeps for a device",
    "n" * 256: "a name that is too long",
}


@pytest.mark.parametrize("packed", [zipped, tarred])
@pytest.mark.parametrize("name", ODD_NAMES)
def test_an_odd_name_of_a_file_that_is_no_program_costs_only_this_file(
    tmp_path: Path, packed: Callable[..., Any], name: str
) -> None:
    """Nobody's mark depends on what a picture is called; a folder with such a file is graded as well."""
    submission = hand_in(tmp_path, packed({**FILES, name: b"x"}))
    assert staged(submission.root) == FILES
    assert [note.endswith(f" (it has {ODD_NAMES[name]})") for note in submission.notes] == [True]


@pytest.mark.parametrize("packed", [zipped, tarred])
@pytest.mark.parametrize("twin", ["Photo.png", "photo.PNG"])
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_pictures_of_one_name_refuse_nobody(tmp_path: Path, packed: Callable[..., Any], twin: str) -> None:
    """The first one is kept."""
    submission = hand_in(tmp_path, packed([*FILES.items(), ("Photo.png", b"1"), (twin, b"2")]))
    assert staged(submission.root) == {**FILES, "Photo.png": b"1"}
    assert submission.notes == (f"not copied: {twin} (something else is called Photo.png)",)


def test_a_nul_in_a_name_of_a_zip_is_refused(tmp_path: Path) -> None:
    """Where one reader stops at it, another would not."""
    data = zipped({"velocity_publisher.pyXevil": b""}).replace(b"pyXevil", b"py\0evil")
    assert refusal(tmp_path, data)[0].startswith("expected plain relative names, found a name with a control character")


def test_a_backslash_stands_between_parts_in_a_zip_and_is_refused_in_a_tar(tmp_path: Path) -> None:
    """Old Windows programs wrote it; no tar program did."""
    submission = hand_in(tmp_path / "1", zipped({"a\\b\\velocity_publisher.py": b""}))
    assert submission.files["velocity_publisher.py"].found == "a/b/velocity_publisher.py"
    assert "leads out" in refusal(tmp_path / "2", zipped({"a\\..\\..\\x.py": b""}))[0]
    assert "a name with a backslash" in refusal(tmp_path / "3", tarred({"a\\x.py": b""}))[0]


def test_names_in_utf8_without_the_flag_are_read(tmp_path: Path) -> None:
    """As macOS writes them."""
    data = zipped({"h\u00e9/velocity_publisher.py": b""})
    plain = bytearray(data)
    for start in (data.index(b"PK\x03\x04") + 6, data.index(b"PK\x01\x02") + 8):
        plain[start + 1] &= ~0x08
    assert hand_in(tmp_path, bytes(plain)).files["velocity_publisher.py"].found == "h\u00e9/velocity_publisher.py"


@pytest.mark.parametrize("packed", [zipped, tarred])
@pytest.mark.parametrize(
    ("names", "found"),
    [
        (["x.py", "x.py"], "found x.py twice"),
        (["x.py", "X.PY"], "found x.py and X.PY"),
        (["a/x.py", "A/y.py"], "found a and A"),
        (["a", "a/x.py"], "found a twice"),
        (["a", "A/x.py"], "found a and A"),
        (["\u00e9.py", "e\u0301.py"], "found \u00e9.py and e\u0301.py"),
        (["stra\u00dfe.py", "STRASSE.py"], "found stra\u00dfe.py and STRASSE.py"),
        (["./x.py", "x.py"], "found x.py twice"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_names_of_which_only_one_could_be_kept_are_refused(
    tmp_path: Path, packed: Callable[..., Any], names: Sequence[str], found: str
) -> None:
    """Twice the same, another case, another way of composing letters, a file that is a folder too."""
    message, _ = refusal(tmp_path, packed([(name, b"") for name in names]))
    assert message == f"expected different names, {found}"


@pytest.mark.parametrize(
    ("kind", "found"),
    [
        (tarfile.SYMTYPE, "a link"),
        (tarfile.LNKTYPE, "a link"),
        (tarfile.CHRTYPE, "a device, pipe or other special file"),
        (tarfile.BLKTYPE, "a device, pipe or other special file"),
        (tarfile.FIFOTYPE, "a device, pipe or other special file"),
    ],
)
def test_what_is_no_file_in_a_tar_is_refused(tmp_path: Path, kind: bytes, found: str) -> None:
    """Links, devices and pipes have no place in a submission, whatever they point to."""
    data = tarred(
        [*FILES.items(), ("odom_subscriber.py", b"velocity_publisher.py")], types={"odom_subscriber.py": kind}
    )
    assert refusal(tmp_path, data)[0] == f"expected plain files, found {found}: odom_subscriber.py"


@pytest.mark.parametrize(
    ("mode", "found"),
    [(stat.S_IFLNK, "a link"), (stat.S_IFIFO, "a device, pipe or socket"), (stat.S_IFCHR, "a device, pipe or socket")],
)
def test_what_is_no_file_in_a_zip_is_refused(tmp_path: Path, mode: int, found: str) -> None:
    """A zip made on Unix holds links as well."""
    data = zipped({**FILES, "x": b"/etc/passwd"}, modes={"x": mode | 0o777})
    assert refusal(tmp_path, data)[0] == f"expected plain files, found {found}: x"


@pytest.mark.parametrize("packed", [zipped, tarred, pytest.param(rarred, marks=needs_libarchive)])
@pytest.mark.parametrize(
    ("limit", "value", "files", "found"),
    [
        ("files", 3, [f"{n}.py" for n in range(4)], "expected at most 3 files, found more"),
        ("entries", 3, [f".git/{n}" for n in range(4)], "expected at most 3 entries, found more"),
        ("depth", 2, ["a/b/c/x.py"], "expected at most 2 folders inside each other, found more"),
        ("total_bytes", 1 << 20, ["a.py", "b.py"], "expected at most 1 MiB in all, found more"),
        ("archive_bytes", 0, ["a.py"], "expected at most 0 MiB, found more"),
    ],
)
def test_a_limit_exceeded_is_refused(
    packed: Callable[..., Any], limit: str, value: int, files: Sequence[str], found: str
) -> None:
    """Members, files, levels, bytes in all and of the archive itself."""
    if limit == "entries" and packed is tarred:
        files = [f".git/{n}" for n in range(10)]
    data = packed({name: os.urandom(600 << 10) for name in files})
    with pytest.raises(SubmissionError) as caught:
        collect_archive(data, where="alice.zip", limits=SubmissionLimits(**{limit: value}))
    assert caught.value.message == f"alice.zip: {found}"
    assert caught.value.hint


def test_a_file_that_is_too_large_is_left_out_with_a_note(tmp_path: Path) -> None:
    """As of a folder: a recording beside the work costs nothing."""
    for number, packed in enumerate([*HONEST, *([rarred] if has_libarchive() else [])]):
        submission = hand_in(tmp_path / str(number), packed({**FILES, "bag.mcap": os.urandom((8 << 20) + 1)}))
        assert staged(submission.root) == FILES
        assert submission.notes == ("not copied: bag.mcap (larger than 8 MiB)",)


@pytest.mark.long
@pytest.mark.slow
def test_bombs_are_refused_after_little_work(tmp_path: Path) -> None:
    """Much from little, in one member, in many and in streams; what is counted are real bytes."""
    zeros = bytes(7 << 20)
    assert "200 times" in refusal(tmp_path / "1", zipped({"a.py": zeros}))[0]
    assert "200 times" in refusal(tmp_path / "2", zipped({f"{n}.py": zeros for n in range(10)}))[0]
    for number, compress in enumerate(COMPRESS):
        assert "200 times" in refusal(tmp_path / f"3{number}", compress(bytes(64 << 20)))[0]
    assert "64 MiB unpacked" in refusal(tmp_path / "4", lzma.compress(os.urandom(500 << 10) * 135, preset=1))[0]
    assert "compressed parts" in refusal(tmp_path / "6", gzip.compress(b"") * 5_000)[0]


def test_members_that_share_their_bytes_are_refused(tmp_path: Path) -> None:
    """A thousand names for one content could be unpacked for hours, however little comes out."""
    buffer = io.BytesIO()
    with zipfile.ZipFile(buffer, "w") as archive:
        archive.writestr("velocity_publisher.py", os.urandom(1 << 20))
        archive.filelist += archive.filelist * 99
    assert "damaged or incomplete" in refusal(tmp_path, buffer.getvalue())[0]


def test_a_declared_size_is_not_believed(tmp_path: Path) -> None:
    """A member that declares one byte and holds a mebibyte, or the other way round, is damaged."""
    for number, size in enumerate((1, 7 << 20)):
        data = bytearray(zipped({"velocity_publisher.py": b"#" * (1 << 20)}))
        for mark, at in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
            start = data.index(mark) + at
            data[start : start + 4] = struct.pack("<I", size)
        assert "damaged or incomplete" in refusal(tmp_path / str(number), bytes(data))[0]


def test_an_xz_that_asks_for_gigabytes_of_memory_is_refused(tmp_path: Path) -> None:
    """The archive sets the size of the window; only a limited one is allocated."""
    filters = [{"id": lzma.FILTER_LZMA2, "preset": 0, "dict_size": 16 << 20}]
    data = bytearray(lzma.compress(tarred(FILES), filters=filters))
    # Byte 17 of the first block's header is the size of the window; 39 means 3 GiB. The header's checksum follows it.
    header = 12
    length = (data[header] + 1) * 4
    assert data[header + 2] == 0x21
    data[header + 4] = 39
    data[header + length - 4 : header + length] = struct.pack("<I", zlib.crc32(data[header : header + length - 4]))
    assert "damaged or incomplete" in refusal(tmp_path, bytes(data))[0]


@pytest.mark.breadth(3, 13)
@pytest.mark.parametrize("kind", EVERY)
def test_an_archive_cut_off_anywhere_is_refused(tmp_path: Path, kind: str) -> None:
    """At any byte: never a part of the files."""
    data = {**PACKERS, **FOREIGN}[kind](FILES)
    # The second block of zeros at the end of a tar, and the padding behind it, say nothing.
    ends = len(data) if "tar" not in kind or "." in kind else len(data.rstrip(b"\0")) + 512
    for number, size in enumerate(sorted({1, 5, 30, 200, ends // 3, ends // 2, ends - 30, ends - 1})):
        message, _ = refusal(tmp_path / str(number), data[:size])
        assert "found a damaged" in message or "another kind of file" in message


@pytest.mark.parametrize(
    ("data", "name", "found"),
    [
        (b"", "a.zip", "expected a zip or tar archive, found another kind of file"),
        (b"x = 1\n", "a.zip", "expected a zip or tar archive, found another kind of file"),
        (b"x = 1\n", "a.tar.gz", "expected a zip or tar archive, found another kind of file"),
        (
            gzip.compress(b"x = 1\n", mtime=0),
            "velocity_publisher.py.gz",
            "expected a tar archive inside the gzip, found another",
        ),
        (b"\x28\xb5\x2f\xfd....", "a.tar.zst", "expected a zip or tar archive, found zstd, which cannot be read"),
        (b"PK\x07\x08PK\x03\x04", "a.zip", "expected a zip or tar archive, found split zip, which cannot be read"),
        (zipped({}), "a.zip", "expected at least one .py file, found none"),
        (zipped({"x.txt": b""}), "a.zip", "expected at least one .py file, found x.txt"),
        (
            zipped(FILES, zipfile.ZIP_LZMA),
            "a.zip",
            "expected a zip with the usual compression (deflate), found method 14",
        ),
        (
            zipped(FILES, zipfile.ZIP_BZIP2),
            "a.zip",
            "expected a zip with the usual compression (deflate), found method 12",
        ),
    ],
)
def test_what_is_no_usable_archive_is_told(tmp_path: Path, data: bytes, name: str, found: str) -> None:
    """The content decides, not the name; each error names what to submit instead."""
    if found.startswith("expected at least one .py file"):
        with pytest.raises(SubmissionError, match=found):
            hand_in(tmp_path, data, name)
        return
    message, hint = refusal(tmp_path, data, name)
    assert message.startswith(found)
    assert "zip" in hint


@needs_libarchive
def test_a_7z_of_another_program_is_read(tmp_path: Path) -> None:
    """As students make them; libarchive wrote those of the other tests."""
    assert staged(hand_in(tmp_path, BY_PY7ZR["plain"], "a.7z").root) == {"velocity_publisher.py": b"x = 1\n"}


@pytest.mark.breadth(6, 27)
@needs_libarchive
@pytest.mark.parametrize(
    ("data", "found"),
    [
        (BY_PY7ZR["link"], "expected plain files, found a link: a.py"),
        (BY_PY7ZR["locked"], "expected an archive without a password, found an encrypted one"),
        (BY_PY7ZR["hidden"], "expected an archive without a password, found an encrypted one"),
        (rarred(FILES, links={"a.py": "/etc/passwd"}), "expected plain files, found a link: a.py"),
        (rar_redirected(2, size=6), "expected plain files, found a link: b.py"),
        (rar_redirected(4, size=6), "expected plain files, found a link: b.py"),
        *(
            (rar_redirected(kind, size=size, before=before), "expected plain files, found a reference to another file")
            for kind in (3, 5, 6)  # a junction, a copy of a file, one of a future version
            for size in (0, 6)
            for before in (b"", rar_record(3, b"\0"))
        ),
        (rarred({**FILES, "/etc/x.py": b""}), "expected plain relative names, found an absolute name: /etc/x.py"),
        (rarred({**FILES, "../x.py": b""}), "expected plain relative names, found a name that leads out of"),
        (rarred({**FILES, "a\\..\\..\\x.py": b""}), "expected plain relative names, found a name that leads out of"),
        (rarred({**FILES, "esc\x1b[2J.py": b""}), "expected plain relative names, found a name with a control"),
        (rarred([("a.py", b"1"), ("a.py", b"2")]), "expected different names, found"),
        (b"7z\xbc\xaf\x27\x1c....", "expected a whole 7z archive, found a damaged"),
        (rarred(FILES)[:40], "expected a whole rar archive, found a damaged"),
        (old_rarred(FILES)[:40], "expected a whole rar archive, found a damaged"),
        (sevened(FILES, compression="copy").replace(b"x = 1\n", b"x = 2\n"), "expected a whole 7z archive, found a"),
    ],
)
def test_what_is_unusable_in_a_rar_or_7z_is_told(tmp_path: Path, data: bytes, found: str) -> None:
    """As of a zip: links, names, passwords, damage; and nothing of the archive is taken."""
    assert refusal(tmp_path, data, "a.rar")[0].startswith(found)


@pytest.mark.long
@needs_libarchive
@pytest.mark.slow
def test_bombs_and_noise_in_a_rar_or_7z_are_refused(tmp_path: Path) -> None:
    """Much from little is counted while it is unpacked; bytes changed anywhere never break the intake."""
    assert "200 times" in refusal(tmp_path / "1", sevened({"a.py": bytes(7 << 20)}))[0]
    assert "200 times" in refusal(tmp_path / "2", sevened({f"{n}.py": bytes(7 << 20) for n in range(5)}))[0]
    draw = random.Random(1)
    for kind, packed in FOREIGN.items():
        for number in range(6):
            data = bytearray(packed(FILES))
            for _ in range(3):
                data[draw.randrange(8, len(data))] = draw.randrange(256)
            with contextlib.suppress(SubmissionError):
                hand_in(tmp_path / f"{kind} {number}", bytes(data))


@needs_libarchive
def test_the_limits_of_the_process_that_unpacks_refuse_the_archive() -> None:
    """Too little memory to unpack, or too little time: the student's archive, not the grader's fault."""
    large = rarred({"a.py": os.urandom(6 << 20)})
    limits = UnpackerLimits(entries=10, file_bytes=8 << 20, total_bytes=8 << 20, words="8 MiB")
    assert [member.size for member in foreign_members(large, "rar", limits)] == [6 << 20]
    for too_little in (replace(limits, memory_bytes=16 << 20), replace(limits, real_s=0.001)):
        with pytest.raises(UnusableArchiveError, match="found a damaged, incomplete or unusual one"):
            foreign_members(large, "rar", too_little)


@pytest.mark.sandbox
def test_a_process_that_reads_what_students_made_can_do_nothing_else() -> None:
    """No file, socket, process, signal or memory beyond its limit, though a library were taken over."""
    code = """
import os, resource, socket
from grader.runtime.contained import confine
confine({"memory": 768 << 20, "processor": 60, "output": 1 << 20})
tries = {
    "read": lambda: open("/etc/hostname"), "write": lambda: open("/tmp/x", "w"), "net": socket.socket,
    "fork": os.fork, "signal": lambda: os.kill(os.getppid(), 0), "memory": lambda: bytearray(1 << 30),
    "limit": lambda: resource.setrlimit(resource.RLIMIT_NOFILE, (64, 64)), "run": lambda: os.execv("/bin/true", ["x"]),
}
for name, act in tries.items():
    try:
        act()
    except (OSError, MemoryError, ValueError):
        continue
    print(name)
"""
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, ""), done.stderr


@pytest.mark.parametrize("start", [b"7z\xbc\xaf\x27\x1c....", b"Rar!\x1a\x07\x01\x00"])
def test_without_libarchive_a_rar_or_7z_is_refused_with_the_way_out(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, start: bytes
) -> None:
    """For the student a zip, for who grades what to install."""
    monkeypatch.setattr(ctypes.util, "find_library", lambda name: None)
    message, hint = refusal(tmp_path, start)
    assert message.startswith("expected a zip or tar archive, found ")
    assert message.endswith(", which cannot be read")
    assert "as a zip" in hint
    assert "rclpy-grader[archives]" in hint


def test_an_encrypted_zip_is_told(tmp_path: Path) -> None:
    """The flag is enough: there is no password prompt."""
    data = bytearray(zipped(FILES))
    at = -1
    while (at := data.find(b"PK\x01\x02", at + 1)) >= 0:
        data[at + 8] |= 1
    assert refusal(tmp_path, bytes(data))[0] == "expected an archive without a password, found an encrypted one"


def tar_header(**changes: bytes | int) -> bytes:
    info = tarfile.TarInfo("velocity_publisher.py")
    for name, value in changes.items():
        setattr(info, name, value)
    return info.tobuf(tarfile.GNU_FORMAT)


def pax(records: Sequence[bytes]) -> bytes:
    body = b"".join(records)
    padded = body + bytes(-len(body) % 512)
    return tar_header(type=tarfile.XHDTYPE, size=len(body)) + padded + tar_header(size=4) + b"x=1\n" + bytes(508 + 1024)


@pytest.mark.parametrize(
    "data",
    [
        pax([b"11 size=512\n"]),  # another size than the header says
        pax([b"12 size=-999\n"]),
        pax([b"5 a=\n", b"9999 path=x\n"]),
        pax([b"1 "] * 3_000),  # records that overlap each other
        pax([b"0 a=b\n"]),
        pax([b"22 GNU.sparse.major=1\n", b"22 GNU.sparse.minor=0\n"]),
        pax([b"61 path=" + b"1" * 52 + b"\n"]),
        tar_header(type=tarfile.XHDTYPE, size=1 << 20) + bytes((1 << 20) + 1024),
        tar_header(type=tarfile.GNUTYPE_LONGNAME, size=1 << 20) + b"n" * (1 << 20) + tar_header() + bytes(1024),
        tar_header(type=tarfile.GNUTYPE_SPARSE) + bytes(1024),
        tar_header(size=-512) + bytes(1024),
        tar_header(size=1 << 40) + bytes(1024),
        tar_header() + b"\xff" * 512,
        tar_header(),
    ],
)
def test_a_tar_that_two_readers_could_read_differently_is_refused(tmp_path: Path, data: bytes) -> None:
    """Headers that move, stretch or hide a member, or that cost more than they are worth."""
    message, _ = refusal(tmp_path, data)
    assert "damaged or incomplete" in message or "a feature that is not supported" in message


def test_a_tar_of_the_folder_itself_is_read(tmp_path: Path) -> None:
    """`tar -c .` puts `./` before every name."""
    data = tarred([("./", b""), ("./velocity_publisher.py", b"x = 1\n")], types={"./": tarfile.DIRTYPE})
    assert staged(hand_in(tmp_path, data).root) == {"velocity_publisher.py": b"x = 1\n"}


PART = st.sampled_from(
    ["a", "B", "b", "..", ".", "", "con", "x.py", "velocity_publisher.py", ".git", "\n", "C:"]
) | st.text(st.characters(exclude_characters="/", exclude_categories=["Cs"]), min_size=1, max_size=5)
NAME = st.lists(PART, min_size=1, max_size=4).map("/".join)
MEMBERS = st.lists(st.tuples(NAME, st.binary(max_size=20), st.sampled_from(["file", "file", "file", "link", "pipe"])))
TAR_TYPES = {"file": tarfile.REGTYPE, "link": tarfile.SYMTYPE, "pipe": tarfile.FIFOTYPE}
ZIP_MODES = {"file": stat.S_IFREG, "link": stat.S_IFLNK, "pipe": stat.S_IFIFO}


def any_archive(members: Sequence[tuple[str, bytes, str]], *, as_zip: bool) -> bytes:
    buffer = io.BytesIO()
    if as_zip:
        with zipfile.ZipFile(buffer, "w") as archive:
            for name, content, kind in members:
                info = zipfile.ZipInfo("x")
                info.filename, info.external_attr = name, ZIP_MODES[kind] << 16
                archive.writestr(info, content)
    else:
        with tarfile.open(fileobj=buffer, mode="w:") as tar:
            for name, content, kind in members:
                entry = tarfile.TarInfo(name)
                entry.type, entry.linkname = TAR_TYPES[kind], "/etc/passwd"
                entry.size = len(content) if kind == "file" else 0
                tar.addfile(entry, io.BytesIO(content))
    return buffer.getvalue()


@given(members=MEMBERS, as_zip=st.booleans())
@example(members=[("x.py", b"1", "file"), ("a/B", b"2", "file")], as_zip=True)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_any_archive_is_staged_exactly_or_refused(
    tmp_path_factory: pytest.TempPathFactory, members: Sequence[tuple[str, bytes, str]], as_zip: bool
) -> None:
    """Either each of its files that counts lies in the staging folder, and nothing else anywhere, or nothing does.

    What is not a program and has a name that cannot be kept everywhere is missing with a note.
    """
    tmp_path = tmp_path_factory.mktemp("any")
    try:
        submission = hand_in(tmp_path, any_archive(members, as_zip=as_zip))
    except SubmissionError:
        assert not list((tmp_path / "place/staging/into").iterdir())
        return
    files = {"/".join(p for p in n.split("/") if p != "."): c for n, c, kind in reversed(members) if kind == "file"}
    counted = {n: c for n, c in files.items() if not any(p.startswith(".") for p in n.split("/")[:-1])}
    counted = {n: c for n, c in counted.items() if not n.split("/")[-1].startswith("._") and not n.endswith("/")}
    names = {n.replace("\\", "/") if as_zip else n: c for n, c in counted.items()}
    kept, names = staged(submission.root), {n: c for n, c in names.items() if n != ".DS_Store"}
    assert kept.items() <= names.items()
    lost = names.keys() - kept.keys()
    assert not any(is_gradable(name) for name in lost)
    assert bool(lost) <= bool(submission.notes)


@given(start=st.sampled_from(sorted(PACKERS)), seed=st.data())
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], deadline=None)
def test_a_damaged_archive_never_breaks_the_intake(
    tmp_path_factory: pytest.TempPathFactory, start: str, seed: DataObject
) -> None:
    """Bytes changed anywhere: some files or a refusal, but no other error, and nothing elsewhere."""
    data = bytearray(PACKERS[start](FILES))
    for _ in range(seed.draw(st.integers(1, 6))):
        data[seed.draw(st.integers(0, len(data) - 1))] = seed.draw(st.integers(0, 255))
    with contextlib.suppress(SubmissionError):
        hand_in(tmp_path_factory.mktemp("damaged"), bytes(data))


@pytest.mark.parametrize("change", ["folder", "empty"])
def test_content_that_no_reader_delivers_is_refused(tmp_path: Path, change: str) -> None:
    """A folder with content, and a file that the directory calls empty though it has some, would lose it."""
    content = bytes(range(64))
    data = zipped({"a.py": b"x = 1\n", "b/" if change == "folder" else "b.py": content}, zipfile.ZIP_STORED)
    if change == "empty":
        at = data.rindex(b"PK\x01\x02")  # checksum and size in the directory; the packed size stays
        data = data[: at + 16] + bytes(4) + data[at + 20 : at + 24] + bytes(4) + data[at + 28 :]
    assert refusal(tmp_path, data, "a.zip")[0].startswith("expected a whole zip archive")
