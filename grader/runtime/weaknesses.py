"""Known weaknesses of the software that a sandbox relies on, by version: bubblewrap, Fast DDS, the kernel.

The table holds what a student's process could reach, with its source. It does not replace a scanner: a version without
an entry may have weaknesses too. Distributions repair their packages without changing the version that a program tells;
`known` looks for that where it can.
"""

from __future__ import annotations

import gzip
import re
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import TypeAlias

from grader.runtime.model.checkup import Fact
from grader.runtime.model.dataclass import dataclass

Version: TypeAlias = tuple[int, ...]

BUBBLEWRAP, FAST_DDS, LINUX = "bubblewrap", "Fast DDS", "Linux"
#: How to repair each program.
FIXES: Mapping[str, str] = {
    BUBBLEWRAP: "install the updates of your distribution, or bubblewrap {fixed} or newer",
    FAST_DDS: "install a build of ROS with Fast DDS {fixed} or newer (wheels: pip install --upgrade ros-fastrtps)",
    LINUX: "install the updates of your distribution, or Linux {fixed} or newer, and restart the machine",
}


@dataclass(frozen=True, slots=True)
class Weakness:
    """One weakness of some versions of a program."""

    program: str  # a key of `FIXES`
    name: str  # its identifier, as advisories and changelogs have it
    what: str  # what it allows, and what stands against it here; a phrase
    since: Version  # the first version that has it
    fixed: tuple[Version, ...]  # for each branch, which is the first two numbers, the first version without it
    gone: Version | None = (
        None  # the first version of all later branches without it; None if other branches are unknown
    )
    setuid: bool = False  # whether it needs the program to be setuid root

    def fix_for(self, version: Version) -> Version | None:
        """Return the version to install instead of this one; None if this one does not have the weakness."""
        branch = next((first for first in self.fixed if first[:2] == version[:2]), self.gone)
        return branch if branch is not None and self.since <= version < branch else None


#: Sources: the release notes of Fast DDS 2.14.6, 2.14.7, 2.6.12, 3.2.4 and 3.2.5; the record of each CVE at cve.org;
#: the advisories of bubblewrap GHSA-pxhw-h44j-8pfx, GHSA-j2qp-rvxj-43vj and that of its release 0.11.2.
WEAKNESSES = (
    Weakness(
        FAST_DDS,
        "CVE-2024-30258",
        "a malformed packet ends the worker, which is replaced",
        (0,),
        ((2, 6, 8), (2, 10, 4), (2, 13, 5), (2, 14, 1)),
        (2, 14, 1),
    ),
    Weakness(
        FAST_DDS,
        "CVE-2024-30259",
        "a malformed packet writes beyond a buffer of the worker, which its sandbox contains",
        (0,),
        ((2, 6, 8), (2, 10, 4), (2, 13, 5), (2, 14, 1)),
        (2, 14, 1),
    ),
    Weakness(
        FAST_DDS,
        "CVE-2025-62799",
        "a fragmented message writes beyond a buffer of the worker, which its sandbox contains",
        (0,),
        ((2, 6, 11), (2, 14, 6), (3, 2, 4), (3, 3, 1), (3, 4, 1)),
        (3, 3, 1),
    ),
    Weakness(
        FAST_DDS,
        "CVE-2025-64438",
        "a packet of 64 bytes fills the worker's memory; it is ended at its limit, and the node is judged for it",
        (0,),
        ((2, 6, 11), (2, 14, 6), (3, 2, 4), (3, 3, 1), (3, 4, 1)),
        (3, 3, 1),
    ),
    Weakness(
        FAST_DDS,
        "CVE-2026-49861",
        "a malformed value is deserialized wrongly, and seven more of this kind (CVE-2026-49862, CVE-2026-53588 ...)",
        (0,),
        ((2, 6, 12), (2, 14, 7), (3, 2, 5)),
    ),
    Weakness(
        BUBBLEWRAP,
        "CVE-2020-5291",
        "where users may not create namespaces, a user can become root with it",
        (0, 4, 0),
        ((0, 4, 1),),
        (0, 4, 1),
        setuid=True,
    ),
    Weakness(
        BUBBLEWRAP,
        "CVE-2026-41163",
        "a user can mount file systems over others with it",
        (0, 11, 0),
        ((0, 11, 2),),
        (0, 11, 2),
        setuid=True,
    ),
    Weakness(
        BUBBLEWRAP,
        "CVE-2026-87766",
        "it may create files through links in a sandbox; the grader has it create none below a student's files",
        (0,),
        (),
        (0, 12, 0),
    ),
    Weakness(
        LINUX,
        "CVE-2026-31431",
        "(Copy Fail) a user can become root through AF_ALG sockets, which the filter refuses to students",
        (4, 14),
        (
            *((5, 10, 254), (5, 15, 204), (6, 1, 170), (6, 6, 137)),
            *((6, 12, 85), (6, 18, 22), (6, 19, 12)),
        ),
        (7, 0),
    ),
    Weakness(
        LINUX,
        "CVE-2026-43284",
        "(Dirty Frag) a user can become root through IPsec in a new namespace; the filter refuses both to students",
        (4, 11),
        (
            *((5, 10, 255), (5, 15, 206), (6, 1, 172), (6, 6, 138)),
            *((6, 12, 87), (6, 18, 28), (7, 0, 5)),
        ),
        (7, 1),
    ),
    Weakness(
        LINUX,
        "CVE-2026-43500",
        "(Dirty Frag) a user can become root through AF_RXRPC sockets, which the filter refuses to students",
        (5, 3),
        ((6, 18, 29), (7, 0, 6)),
    ),
)

#: Where Debian and its relatives tell which weaknesses a package has been repaired for.
CHANGELOGS = (Path("/usr/share/doc/bubblewrap/changelog.Debian.gz"),)
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


def known(versions: Mapping[str, Version], *, setuid: bool, repaired: Iterable[str] = ()) -> Iterator[Fact]:
    """Yield each known weakness of some versions with its fix.

    Args:
        versions: By program; an empty one is unknown.
        setuid: Whether bubblewrap is setuid root.
        repaired: Identifiers of weaknesses that the packages here do not have any more.
    """
    for weakness in WEAKNESSES:
        version = versions.get(weakness.program, ())
        fixed = weakness.fix_for(version) if version else None
        if fixed is None or weakness.name in repaired or (weakness.setuid and not setuid):
            continue
        here = f"{weakness.program} {_text(version)}"
        fix = FIXES[weakness.program].format(fixed=_text(fixed))
        yield Fact("known weakness", f"{here}: {weakness.name}: {weakness.what}", remedy=fix)


def repaired_here(changelogs: Iterable[Path] = CHANGELOGS) -> frozenset[str]:
    """Return the identifiers that the changelogs of the packages here name."""
    found: set[str] = set()
    for path in changelogs:
        try:
            text = gzip.decompress(path.read_bytes()).decode("utf-8", "replace")
        except (OSError, EOFError, ValueError):
            continue
        found.update(re.findall(r"CVE-\d{4}-\d{4,}", text))
    return frozenset(found)


def _text(version: Version) -> str:
    return ".".join(map(str, version))
