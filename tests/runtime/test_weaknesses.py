"""Known weaknesses by version: which versions have them, which do not any more, and what is told of them."""

from __future__ import annotations

import gzip
import re
from pathlib import Path

import pytest

from grader.runtime.weaknesses import (
    BUBBLEWRAP,
    FAST_DDS,
    FIXES,
    LINUX,
    WEAKNESSES,
    Version,
    kernel_version,
    known,
    repaired_here,
    version_of,
)


def names(program: str, version: str, *, setuid: bool = False, repaired: tuple[str, ...] = ()) -> list[str]:
    facts = known({program: version_of(version)}, setuid=setuid, repaired=repaired)
    return [fact.value.split(": ")[1] for fact in facts]


@pytest.mark.parametrize(
    ("program", "version", "found"),
    [
        (FAST_DDS, "2.14.0", 5),
        (FAST_DDS, "2.14.5", 3),
        (FAST_DDS, "2.14.6", 1),
        (FAST_DDS, "2.14.7", 0),
        (FAST_DDS, "2.6.7", 5),
        (FAST_DDS, "2.6.12", 0),
        (FAST_DDS, "3.2.3", 3),
        (FAST_DDS, "3.2.5", 0),
        (FAST_DDS, "3.3.0", 2),
        (FAST_DDS, "3.6.1", 0),
        (BUBBLEWRAP, "0.8.0", 1),
        (BUBBLEWRAP, "0.11.1", 1),
        (BUBBLEWRAP, "0.12.0", 0),
        (LINUX, "6.18.21", 3),
        (LINUX, "6.18.44", 0),
        (LINUX, "6.17.9", 2),
        (LINUX, "7.0.0", 2),
        (LINUX, "7.1.0", 0),
        (LINUX, "4.9.337", 0),
        (LINUX, "5.15.204", 1),
    ],
)
def test_a_version_has_the_weaknesses_that_were_repaired_later(program: str, version: str, found: int) -> None:
    """In its own branch, or in a later one if its branch was given up."""
    assert len(names(program, version)) == found


def test_what_needs_a_setuid_program_is_told_only_of_one() -> None:
    """Distributions install bubblewrap without that bit."""
    assert names(BUBBLEWRAP, "0.11.0") == ["CVE-2026-87766"]
    assert names(BUBBLEWRAP, "0.11.0", setuid=True) == ["CVE-2026-41163", "CVE-2026-87766"]


def test_an_unknown_version_has_nothing_to_tell() -> None:
    """Neither a program that is not there nor a text without a number."""
    assert names(BUBBLEWRAP, "cannot be started") == []
    assert list(known({}, setuid=True)) == []


def test_each_is_told_with_its_version_and_its_fix() -> None:
    """In one line each, which names the version to install."""
    (fact,) = known({BUBBLEWRAP: (0, 8, 0)}, setuid=False)
    assert fact.name == "known weakness"
    assert fact.value.startswith("bubblewrap 0.8.0: CVE-2026-87766: it may create files")
    assert fact.remedy == "install the updates of your distribution, or bubblewrap 0.12.0 or newer"
    assert fact.fits, "grading stays safe: what the sandbox promises is tested, not guessed from versions"


def test_a_package_that_its_distribution_has_repaired_is_left_out(tmp_path: Path) -> None:
    """Debian and Ubuntu keep the version and name the weakness in the changelog."""
    changelog = tmp_path / "changelog.Debian.gz"
    assert repaired_here([changelog]) == frozenset()
    changelog.write_bytes(b"not compressed")
    assert repaired_here([changelog]) == frozenset()
    changelog.write_bytes(gzip.compress(b"bubblewrap (0.9.0-1ubuntu0.2) noble-security\n  * CVE-2026-87766\n"))
    assert repaired_here([changelog]) == {"CVE-2026-87766"}
    assert names(BUBBLEWRAP, "0.9.0", repaired=tuple(repaired_here([changelog]))) == []


@pytest.mark.parametrize(
    ("release", "build", "version"),
    [
        ("6.18.44-fc-v657", "#1 SMP PREEMPT_DYNAMIC", (6, 18, 44)),
        ("6.1.0-44-amd64", "#1 SMP PREEMPT_DYNAMIC Debian 6.1.164-1 (2026-03-09)", (6, 1, 164)),
        ("6.8.0-117-generic", "#117-Ubuntu SMP", ()),
        ("5.14.0-611.49.2.el9_7.x86_64", "#1 SMP", ()),
        ("7.0.0", "#1", (7, 0, 0)),
        ("5.15.167.4-microsoft-standard-WSL2", "#1 SMP", (5, 15, 167, 4)),
    ],
)
def test_the_version_of_a_kernel_is_that_of_its_source(release: str, build: str, version: Version) -> None:
    """Unknown where a distribution repairs an old version and numbers its own builds."""
    assert kernel_version(release, build) == version


def test_the_table_is_sound() -> None:
    """Each has an identifier of its own, a program with a fix, and branches after the version that brought it."""
    assert len({weakness.name for weakness in WEAKNESSES}) == len(WEAKNESSES)
    for weakness in WEAKNESSES:
        assert re.fullmatch(r"CVE-\d{4}-\d{4,}|GHSA(-\w{4}){3}", weakness.name)
        assert weakness.program in FIXES
        assert weakness.fixed or weakness.gone
        branches = [fixed[:2] for fixed in weakness.fixed]
        assert branches == sorted(set(branches))
        assert all(fixed > weakness.since for fixed in weakness.fixed)
        assert not weakness.what.endswith(".")
