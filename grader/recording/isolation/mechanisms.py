"""What gives each property under each tier: the words of reports."""

from __future__ import annotations

from collections.abc import Mapping

NOTHING = "none"

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
_WALLS = {
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
        **_WALLS,
        "net_egress": _NAMESPACES["net_egress"],
        "dds_private": _NAMESPACES["dds_private"],
    },
    "landlock": {
        **_WALLS,
        "net_egress": "no interface but lo",
        "dds_private": "a reserved domain on the loopback address",
    },
}


def mechanism(tier: str, name: str) -> str:
    """Return what gives a property under a tier."""
    return _BY_TIER.get(tier, {}).get(name, NOTHING)
