"""The mechanism behind each property of a sandbox in each tier, and the remedies for a tier that does not work."""

from __future__ import annotations

import os
import shutil
from collections.abc import Mapping
from pathlib import Path

from grader.runtime.model.checkup import TierReport

NOTHING = "none"
#: Where the kernel exposes its settings.
SETTINGS_FOLDER = Path("/proc/sys")
#: What is noted, and under which property, if no message made the round of a self-test.
EXCHANGE, NO_EXCHANGE = "dds_private", "no ROS message came back"

_SYSTEM_LIMITS = {"vsock": "seccomp", "mem": "RLIMIT_AS", "pids": "RLIMIT_NPROC", "cpu": "RLIMIT_CPU"}
_NAMESPACES = {
    **_SYSTEM_LIMITS,
    "fs_read": "mount namespace",
    "fs_write": "read-only mounts and tmpfs of fixed size",
    "procs": "process namespace",
    "signals": "process namespace",
    "net_egress": "network namespace with only lo",
    "shm": "own /dev/shm, IPC namespace",
    "dds_private": "network namespace",
}
_LANDLOCK = {
    **_SYSTEM_LIMITS,
    "fs_read": "Landlock",
    "fs_write": "Landlock, seccomp and a watched scratch folder",
    "procs": "Landlock",
    "signals": "Landlock and seccomp",
    "shm": "Landlock and seccomp",
}

_BY_TIER: Mapping[str, Mapping[str, str]] = {
    "bubblewrap-root": {**_NAMESPACES, "pids": "RLIMIT_NPROC of a user of its own"},
    "bubblewrap": {**_NAMESPACES, "pids": "RLIMIT_NPROC in a user namespace"},
    "bubblewrap-flat": {
        **_LANDLOCK,
        "net_egress": _NAMESPACES["net_egress"],
        "dds_private": _NAMESPACES["dds_private"],
    },
    "landlock": {
        **_LANDLOCK,
        "net_egress": "no interface but lo",
        "dds_private": "a reserved domain on the loopback address",
    },
}


def mechanism(tier: str, name: str) -> str:
    """Return the mechanism that provides a property in a tier."""
    return _BY_TIER.get(tier, {}).get(name, NOTHING)


#: Settings that keep bubblewrap from making namespaces, the value that does, and the one that lets it.
SETTINGS = (
    ("kernel.apparmor_restrict_unprivileged_userns", "1", "0"),
    ("kernel.unprivileged_userns_clone", "0", "1"),
    ("user.max_user_namespaces", "0", "15000"),
)
INSTALLERS = {
    "apt-get": "apt-get install -y",
    "dnf": "dnf install -y",
    "pacman": "pacman -S --noconfirm",
    "zypper": "zypper install -y",
    "apk": "apk add",
}
IN_CONTAINER = "start the container without a network: docker run --network none"


def package_command(package: str) -> str:
    """Return the command that installs a system package."""
    installer = next((command for name, command in INSTALLERS.items() if shutil.which(name)), INSTALLERS["apt-get"])
    return f"{_sudo()}{installer} {package}"


def remedy_for(report: TierReport, settings: Path = SETTINGS_FOLDER) -> str:
    """Return the command or action that would make a tier work; empty if none is known."""
    if any(found.name == "net_egress" and not found.holds for found in report.properties):
        return IN_CONTAINER if has_filter() else ""
    if report.name.startswith("bubblewrap") and not report.properties:
        return setting_command(settings)
    return ""


def setting_command(settings: Path = SETTINGS_FOLDER) -> str:
    """Return the command that allows ordinary users to create namespaces; empty if they may, or in a container."""
    for name, bad, good in SETTINGS:
        path = settings.joinpath(*name.split("."))
        if path.is_file() and path.read_text(encoding="ascii").strip() == bad:
            return f"{_sudo()}sysctl -w {name}={good}"
    return ""


def has_filter() -> bool:
    """Return whether this process has a seccomp filter, as in containers."""
    status = Path("/proc/self/status").read_text(encoding="utf-8", errors="replace")
    return any(line.split() == ["Seccomp:", "2"] for line in status.splitlines())


def _sudo() -> str:
    return "" if os.geteuid() == 0 else "sudo "
