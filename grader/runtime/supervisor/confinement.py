"""Confines a process that reads what students made: it gives up all privileges, files and networks, and has limits."""

from __future__ import annotations

import contextlib
import ctypes
import platform
import resource
from collections.abc import Mapping
from typing import Any

from grader.runtime.sandbox.seccomp import Numbers, assembled, flat_filter, supports
from grader.runtime.sandbox.start import drop_capabilities, landlock_version, limit, load_filter, restrict, ruleset

_NEW_PROCESSES = {
    "clone": Numbers(56, 220),
    "clone3": Numbers(435, 435),
    "fork": Numbers(57, None),
    "vfork": Numbers(58, None),
}


def confine(limits: Mapping[str, Any]) -> None:
    """Give up everything but the open descriptors; where a kernel lacks a means, the others remain.

    Args:
        limits: `memory` and `output`, in bytes, and `processor`, in seconds.
    """
    limit(resource.RLIMIT_AS, limits["memory"])
    limit(resource.RLIMIT_CPU, limits["processor"])
    limit(resource.RLIMIT_FSIZE, limits["output"])
    limit(resource.RLIMIT_CORE, 0)
    system = ctypes.CDLL(None, use_errno=True)
    with contextlib.suppress(OSError):
        drop_capabilities(system)
    if supports(platform.machine()):
        nothing = {"read": (), "devices": (), "hidden": (), "tcp": False}
        rules = ruleset(system, nothing, "/nonexistent") if landlock_version(system) else None
        with contextlib.suppress(OSError):
            restrict(system, rules, flat_filter(signals=True))
            load_filter(system, assembled(_NEW_PROCESSES, (), platform.machine()))
    limit(resource.RLIMIT_NOFILE, 0)  # no file, socket or pipe can be opened any more
