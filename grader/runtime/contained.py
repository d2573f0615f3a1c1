"""A process that reads what students made: how it is started, and how it gives up all privileges, files and networks.

The process confines itself, before it reads anything: it costs the start of Python, and no sandbox has to work here.
"""

from __future__ import annotations

import contextlib
import ctypes
import json
import os
import resource
import sys
from collections.abc import Mapping, Sequence
from typing import Any, BinaryIO

from grader.runtime.shipped import PACKAGE

#: Real time in seconds after which the process is killed. Its limit of processor time is far lower, and it waits for
#: nothing: only a machine that is too busy takes so long.
REAL_S = 300


def run_contained(  # noqa: PLR0913  what to run, and how
    module: str,
    limits: Mapping[str, object],
    given: BinaryIO,
    out: BinaryIO,
    real_s: float = REAL_S,
    *,
    installed: bool = False,
    files: Sequence[int] = (),
) -> int:
    """Run a module that confines itself, and return its exit code.

    Args:
        module: Its dotted name; it takes the limits as JSON, as the only argument.
        limits: See `confine`.
        given: Its standard input, a file.
        out: Its standard output, a file.
        real_s: Real time, in seconds, after which it is killed.
        installed: Whether it uses installed packages. Finding them takes as long as all else that it imports.
        files: Descriptors of files that it reads besides; it has them under the same numbers.

    Raises:
        OSError: The process cannot be started.
        subprocess.TimeoutExpired: It took longer.
    """
    import subprocess  # noqa: PLC0415 - the process itself starts none

    own = filter(os.path.isabs, os.environ.get("PYTHONPATH", "").split(os.pathsep))
    path = os.pathsep.join([str(PACKAGE.parent), *own])
    environment = {"PYTHONPATH": path, "PATH": os.defpath, "LC_ALL": "C.UTF-8", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-s", *(() if installed else ("-S",)), "-m", module, json.dumps(limits)]
    return subprocess.run(
        command,
        stdin=given,
        stdout=out,
        stderr=subprocess.DEVNULL,
        env=environment,
        cwd="/",
        timeout=real_s,
        check=False,
        pass_fds=files,
    ).returncode


def confine(limits: Mapping[str, Any]) -> None:
    """Confine this process: give up everything but the open descriptors.

    Where a kernel lacks a means, the others remain.

    Args:
        limits: `memory` and `output`, in bytes, and `processor`, in seconds.
    """
    # Only the process that confines itself needs them, and whoever starts it imports this module as well.
    from grader.runtime.sandbox.seccomp import Numbers, assembled, flat_filter, supports  # noqa: PLC0415
    from grader.runtime.sandbox.start import (  # noqa: PLC0415
        drop_capabilities,
        landlock_version,
        limit,
        load_filter,
        restrict,
        ruleset,
    )

    new_processes = {
        "clone": Numbers(56, 220),
        "clone3": Numbers(435, 435),
        "fork": Numbers(57, None),
        "vfork": Numbers(58, None),
    }
    limit(resource.RLIMIT_AS, limits["memory"])
    limit(resource.RLIMIT_CPU, limits["processor"])
    limit(resource.RLIMIT_FSIZE, limits["output"])
    limit(resource.RLIMIT_CORE, 0)
    system = ctypes.CDLL(None, use_errno=True)
    with contextlib.suppress(OSError):
        drop_capabilities(system)
    if supports(os.uname().machine):
        nothing = {"read": (), "devices": (), "hidden": (), "tcp": False}
        rules = ruleset(system, nothing, "/nonexistent") if landlock_version(system) else None
        with contextlib.suppress(OSError):
            restrict(system, rules, flat_filter(signals=True))
            load_filter(system, assembled(new_processes, (), os.uname().machine))
    limit(resource.RLIMIT_NOFILE, 0)  # no file, socket or pipe can be opened any more
