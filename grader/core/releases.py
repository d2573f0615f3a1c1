"""What differs between releases of ROS 2, one row each."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True, slots=True)
class Release:
    """A release of ROS 2.

    Attributes:
        name: As in `ROS_DISTRO`.
        fast_dds: Major version of Fast DDS, which decides the names in its profiles.
        messages: What `rosbags` calls the release's message types.
        tried: Whether the tests of this project pass on it; others are named in a warning.
    """

    name: str
    fast_dds: int
    messages: str
    tried: bool = False


RELEASES = {
    release.name: release
    for release in (
        Release("humble", 2, "ROS2_HUMBLE"),
        Release("iron", 2, "ROS2_IRON"),
        Release("jazzy", 2, "ROS2_JAZZY", tried=True),
        Release("kilted", 3, "ROS2_KILTED", tried=True),
    )
}
#: The release that comes as wheels, and is assumed where nothing is said.
DEFAULT = RELEASES["jazzy"]
TRIED = tuple(release.name for release in RELEASES.values() if release.tried)


def release_of(name: str) -> Release:
    """Return a release by its name; an unknown one is taken for a new one, with the default's common messages."""
    return RELEASES.get(name) or Release(name, 3, DEFAULT.messages)
