"""Tells which of the programs that a sandbox relies on are older than the first version without known weaknesses.

Which weaknesses those are, and whether a distribution has repaired an old version, its own scanner knows better.
"""

from __future__ import annotations

import re
from collections.abc import Iterator, Mapping
from typing import TypeAlias

from grader.runtime.model.checkup import Fact
from grader.runtime.model.dataclass import dataclass

Version: TypeAlias = tuple[int, ...]


@dataclass(frozen=True, slots=True)
class Dependency:
    """A program whose weaknesses a student's process could reach."""

    name: str
    sound: tuple[Version, ...]  # of each branch, which is the first two numbers, the first sound version; newest last
    against: str  # what stands against the weaknesses of older ones here; a clause
    update: str  # how to get another version, `{version}`

    def wanted_for(self, version: Version) -> Version | None:
        """Return the first sound version of a version's branch, or of the newest one; None if this one is sound."""
        wanted = next((sound for sound in self.sound if sound[:2] == version[:2]), self.sound[-1])
        return wanted if version < wanted else None


#: Sources: the release notes of Fast DDS, the advisories of bubblewrap, and the records of the Linux kernel at cve.org,
#: as of October 2026.
BUBBLEWRAP = Dependency(
    "bubblewrap",
    ((0, 12, 0),),
    "the grader has it create no file below a student's files, and it needs no setuid",
    "bubblewrap {version} or newer",
)
FAST_DDS = Dependency(
    "Fast DDS",
    ((2, 6, 12), (2, 14, 7), (3, 2, 5)),
    "a malformed packet reaches the worker alone, which has a sandbox and limits of its own and is replaced",
    "a build of ROS with Fast DDS {version} or newer (wheels: pip install --upgrade ros-fastrtps)",
)
LINUX = Dependency(
    "Linux",
    (
        *((5, 10, 255), (5, 15, 206), (6, 1, 172), (6, 6, 138)),
        *((6, 12, 87), (6, 18, 29), (7, 0, 6), (7, 1)),
    ),
    "the filter refuses AF_ALG, AF_RXRPC, IPsec and new namespaces to students",
    "Linux {version} or newer, and restart the machine",
)

_NUMBERS = re.compile(r"\d+(?:\.\d+)+")
_DEBIAN = re.compile(r"Debian (\d+\.\d+\.\d+)")


def version_of(text: str) -> Version:
    """Return the first version in a text, as numbers; empty if there is none."""
    found = _NUMBERS.search(text)
    return tuple(map(int, found[0].split("."))) if found else ()


def kernel_version(release: str, build: str) -> Version:
    """Return the version of a kernel; empty if only its distribution knows which repairs it has.

    Args:
        release: As `uname -r` tells it.
        build: As `uname -v` tells it; Debian's has the version that the release leaves out.
    """
    if named := _DEBIAN.search(build):
        return version_of(named[1])
    version = version_of(release)
    # Ubuntu and Red Hat stay at 6.8.0 and 5.14.0 and number their own builds.
    return () if len(version) > 2 and version[2] == 0 and "-" in release else version


def outdated(versions: Mapping[Dependency, Version]) -> Iterator[Fact]:
    """Yield each program that is not sound, with its update; an empty version is unknown."""
    for program, version in versions.items():
        wanted = program.wanted_for(version) if version else None
        if wanted is not None:
            here, first = (".".join(map(str, one)) for one in (version, wanted))
            value = f"{program.name} {here}: versions before {first} have known weaknesses; {program.against}"
            update = f"install the updates of your distribution, or {program.update.format(version=first)}"
            yield Fact("known weakness", value, remedy=update)
