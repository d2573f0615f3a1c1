"""Versions with known weaknesses, and what is told of them."""

from __future__ import annotations

import pytest

from grader.runtime.outdated import (
    BUBBLEWRAP,
    FAST_DDS,
    LINUX,
    Dependency,
    Version,
    kernel_version,
    outdated,
    version_of,
)


@pytest.mark.parametrize(
    ("program", "version", "wanted"),
    [
        (FAST_DDS, "2.14.0", (2, 14, 7)),
        (FAST_DDS, "2.14.7", None),
        (FAST_DDS, "2.6.7", (2, 6, 12)),
        (FAST_DDS, "2.10.4", (3, 2, 5)),
        (FAST_DDS, "3.6.1", None),
        (BUBBLEWRAP, "0.8.0", (0, 12, 0)),
        (BUBBLEWRAP, "0.12.0", None),
        (LINUX, "6.18.21", (6, 18, 29)),
        (LINUX, "6.18.44", None),
        (LINUX, "6.17.9", (7, 1)),
        (LINUX, "7.1.0", None),
        (LINUX, "8.0.1", None),
    ],
)
def test_a_version_is_sound_from_one_of_its_branch_on(
    program: Dependency, version: str, wanted: Version | None
) -> None:
    """Or from the newest one on, if its branch was given up."""
    assert program.wanted_for(version_of(version)) == wanted


def test_an_unknown_version_has_nothing_to_tell() -> None:
    """Neither a program that is not there nor a text without a number."""
    assert list(outdated({BUBBLEWRAP: version_of("cannot be started"), LINUX: ()})) == []


def test_each_is_told_with_its_version_and_its_update() -> None:
    """In one line, which names the version to install."""
    (fact,) = outdated({BUBBLEWRAP: (0, 8, 0)})
    assert fact.value.startswith("bubblewrap 0.8.0: versions before 0.12.0 have known weaknesses; the grader has it")
    assert fact.remedy == "install the updates of your distribution, or bubblewrap 0.12.0 or newer"
    assert fact.fits, "grading stays safe: what the sandbox promises is tested, not guessed from versions"


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


@pytest.mark.parametrize("program", [BUBBLEWRAP, FAST_DDS, LINUX])
def test_branches_are_told_once_and_in_order(program: Dependency) -> None:
    """The last one counts for what has no branch of its own."""
    branches = [sound[:2] for sound in program.sound]
    assert branches == sorted(set(branches))
