"""Runs inside a sandbox and says which of its walls hold: prints a JSON object of property to true or false.

Usage: python -c SOURCE JSON, with an object of `hidden`, files that must not be readable; `readable`, files that must
be; and `submission`. The source travels on the command line, since nothing of grader can be seen from inside.
"""

# Every run of the grader waits for it, and pathlib would be half of its imports.
# ruff: noqa: PTH108, PTH112, PTH118, PTH120, PTH123, PTH208

from __future__ import annotations

import json
import os
import socket
import sys
from typing import Any

AF_VSOCK = 40
CAPABILITIES = ("CapEff", "CapPrm", "CapInh", "CapBnd", "CapAmb")


def main(request: dict[str, Any]) -> None:
    """Try what must fail and what must work."""
    holds = {
        "hides files": not any(readable(path) for path in request["hidden"]),
        "shows what ROS needs": all(readable(path) for path in request["readable"]),
        "has only lo as its network": [name for _, name in socket.if_nameindex()] == ["lo"],
        "reaches itself over lo": echo(),
        "forbids writing": not any(writable(folder) for folder in folders(request["submission"])),
        "allows scratch files": writable("/tmp") and writable("/dev/shm"),  # noqa: S108
        "hides processes": {name for name in os.listdir("/proc") if name.isdigit()} <= {"1", str(os.getpid())},
        # bubblewrap adds PWD to what it starts, and here the outer one starts the inner one.
        "hides the environment outside": content("/proc/1/environ") in (b"", b"PWD=/\0"),
        "has no privileges": os.getuid() != 0 and {status(name) for name in CAPABILITIES} == {"0" * 16},
        "filters system calls": status("Seccomp") == "2" and status("NoNewPrivs") == "1" and not opens_vsock(),
    }
    print(json.dumps(holds))  # noqa: T201 -- the answer


def readable(path: str) -> bool:
    """Return whether a file or folder can be read."""
    try:
        if os.path.isdir(path):
            os.listdir(path)
        else:
            with open(path, "rb"):
                pass
    except OSError:
        return False
    return True


def writable(folder: str) -> bool:
    """Return whether a file can be made in a folder."""
    path = os.path.join(folder, ".probe")
    try:
        with open(path, "xb"):
            pass
        os.unlink(path)
    except OSError:
        return False
    return True


def folders(submission: str) -> list[str]:
    """Return folders that nobody may write to."""
    own = [os.path.dirname(path) for path in (os.__file__, sys.executable)]
    return ["/", "/dev", "/etc", "/usr/lib", "/proc", submission, os.path.dirname(submission), *own]


def content(path: str) -> bytes:
    """Return what a file holds, nothing if it cannot be read."""
    try:
        with open(path, "rb") as file:
            return file.read()
    except OSError:
        return b""


def status(name: str) -> str:
    """Return an entry of /proc/self/status."""
    lines = content("/proc/self/status").decode().splitlines()
    return next((line.split()[-1] for line in lines if line.startswith(name + ":")), "")


def echo() -> bool:
    """Return whether a datagram over the loopback address arrives."""
    try:
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as there:
            there.bind(("127.0.0.1", 0))
            there.settimeout(1.0)
            there.sendto(b"echo", there.getsockname())
            return there.recv(16) == b"echo"
    except OSError:
        return False


def opens_vsock() -> bool:
    """Return whether a socket to the machine's hypervisor can be opened; no network namespace holds it back."""
    try:
        socket.socket(AF_VSOCK, socket.SOCK_STREAM).close()
    except OSError:
        return False
    return True


if __name__ == "__main__":
    main(json.loads(sys.argv[1]))
