"""Stands in for a default container: its filter of system calls, its user, its network; then becomes a program.

Usage: containers.py JSON PROGRAM [ARGUMENT ...], with an object of `user`, a number or null to stay who it is. The
filter refuses what container engines refuse without CAP_SYS_ADMIN: new namespaces, mounts, entering namespaces.
"""

from __future__ import annotations

import ctypes
import fcntl
import json
import os
import platform
import socket
import struct
import sys

from grader.runtime.sandbox.seccomp import NEW_NAMESPACES, NUMBERS, ArgumentRule, assembled
from grader.runtime.sandbox.start import DROP_FROM_BOUNDING_SET, call, checked, load_filter

REFUSED = ("unshare", "setns", "mount", "umount2", "pivot_root", "move_mount", "open_tree", "fsopen", "clone3", "clone")
#: What the common engines leave to root, as a mask.
CAPABILITIES = 0xA80425FB
NO_NEW_PRIVILEGES = 38
SIOCSIFFLAGS, UP_AND_RUNNING = 0x8914, 0x41


def raise_loopback() -> None:
    """Switch lo on, which a new network has switched off."""
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as asked:
        name = struct.pack("16sh14x", b"lo", UP_AND_RUNNING)
        fcntl.ioctl(asked, SIOCSIFFLAGS, name)


def main() -> None:
    """Put the filter on, drop what a container's root has not, become the user and the program."""
    request = json.loads(sys.argv[1])
    system = ctypes.CDLL(None, use_errno=True)
    raise_loopback()
    for capability in range(64):
        if not CAPABILITIES >> capability & 1:
            call(system.prctl, DROP_FROM_BOUNDING_SET, capability, 0, 0, 0)
    rules = (ArgumentRule("clone", 0, never_bits=NEW_NAMESPACES),)
    if request["user"] is not None:
        os.setgroups([])
        os.setresgid(request["user"], request["user"], request["user"])
        os.setresuid(request["user"], request["user"], request["user"])
    checked(call(system.prctl, NO_NEW_PRIVILEGES, 1, 0, 0, 0), "no new privileges")
    table = {name: NUMBERS[name] for name in REFUSED}
    load_filter(system, assembled(table, rules, platform.machine()))
    os.execv(sys.argv[2], sys.argv[2:])


if __name__ == "__main__":
    main()
