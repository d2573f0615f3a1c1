"""The differences between releases of ROS 2."""

from __future__ import annotations

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Release:
    """A release of ROS 2."""

    name: str  # as in `ROS_DISTRO`
    fast_dds: int  # major version of Fast DDS, which decides the names in its profiles
    # The Python of its distribution of Linux, which it is released for (REP 2000); None if that is not known
    python: tuple[int, int] | None = None
    # The numpy of that distribution; None if that is not known. Types of results differ between 1 and 2 (NEP 50)
    numpy: tuple[int, int] | None = None
    tried: bool = False  # whether this project is tested on it; other releases cause a warning

    @property
    def messages(self) -> str:
        """The name of its message types in `rosbags`."""
        return f"ROS2_{self.name.upper()}"


RELEASES = {
    release.name: release
    for release in (
        Release("humble", 2, (3, 10), (1, 21)),
        Release("iron", 2, (3, 10), (1, 21)),
        Release("jazzy", 2, (3, 12), (1, 26), tried=True),
        Release("kilted", 3, (3, 12), (1, 26), tried=True),
    )
}
#: The release that is available as wheels, and the default.
DEFAULT = RELEASES["jazzy"]
TRIED = tuple(release.name for release in RELEASES.values() if release.tried)


def release_of(name: str) -> Release:
    """Return a release by name; an unknown one is assumed to be new."""
    return RELEASES.get(name) or Release(name, 3)
