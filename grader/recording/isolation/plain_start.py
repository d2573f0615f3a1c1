"""Starts a program of the tier `none`: an own session, limits, a throw-away folder, and an end with its parent.

Usage: plain_start.py JSON PROGRAM [ARGUMENT ...], with an object of `folder`, the working directory; `made`, whether
the folder is to be made before the start and deleted after the end; and `limits`, by their names in `resource`. It
imports nothing of grader, since it runs before anything of it can be found.
"""

# It starts before every student process, and pathlib would be half of its imports.
# ruff: noqa: PTH102, PTH118

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import select
import shutil
import signal
import sys
from typing import Any

SET_PARENT_DEATH_SIGNAL = 1  # linux/prctl.h, PR_SET_PDEATHSIG


def main(arguments: list[str]) -> None:
    """Prepare this process and become the program."""
    request: dict[str, Any] = json.loads(arguments[0])
    ctypes.CDLL(None).prctl(SET_PARENT_DEATH_SIGNAL, signal.SIGKILL)
    if os.getsid(0) != os.getpid():
        # Fails for the leader of a group, whose group is then as good as a session of its own.
        with contextlib.suppress(PermissionError):
            os.setsid()
    if request["made"]:
        for part in ("", "home", "home/log", "work"):
            os.mkdir(os.path.join(request["folder"], part), mode=0o700)
        delete_after_end(request["folder"])
        os.chdir(os.path.join(request["folder"], "work"))
    else:
        os.chdir(request["folder"])
    for name, value in request["limits"].items():
        limit(getattr(resource, name), value)
    os.execv(arguments[1], arguments[1:])  # noqa: S606 -- becoming the program is the purpose


def limit(which: int, value: int) -> None:
    """Lower a limit; one that is lower already stays."""
    _, most = resource.getrlimit(which)
    value = value if most == resource.RLIM_INFINITY else min(value, most)
    resource.setrlimit(which, (value, value))


def delete_after_end(folder: str) -> None:
    """Leave a small process behind that deletes the folder once this one has ended, however it ends."""
    this = os.pidfd_open(os.getpid())
    middle = os.fork()
    if middle:
        os.waitpid(middle, 0)
        os.close(this)
        return
    # Nobody's child and in nobody's session: what kills the others must not keep the folder from being deleted.
    os.setsid()
    if os.fork():
        os._exit(0)
    os.chdir("/")
    os.dup2(this, 0)
    os.closerange(1, os.sysconf("SC_OPEN_MAX"))
    select.select([0], [], [])
    shutil.rmtree(folder, ignore_errors=True)
    os._exit(0)


if __name__ == "__main__":
    main(sys.argv[1:])
