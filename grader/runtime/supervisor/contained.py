"""Starts a process that reads what students made, and confines itself before it does."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import BinaryIO

#: Real time in seconds after which the process is killed. Its limit of processor time is far lower, and it waits for
#: nothing: only a machine that is too busy takes so long.
REAL_S = 300


def run_contained(module: str, limits: Mapping[str, object], given: BinaryIO, out: BinaryIO) -> int:
    """Run a module that confines itself, and return its exit code.

    Args:
        module: Its dotted name; it takes the limits as JSON, as the only argument.
        limits: See `grader.runtime.supervisor.confinement.confine`.
        given: Its standard input, a file.
        out: Its standard output, a file.

    Raises:
        OSError: The process cannot be started.
        subprocess.TimeoutExpired: It took longer than `REAL_S`.
    """
    root = Path(__file__).parents[2]
    path = os.pathsep.join([str(root), *filter(os.path.isabs, os.environ.get("PYTHONPATH", "").split(os.pathsep))])
    environment = {"PYTHONPATH": path, "PATH": os.defpath, "LC_ALL": "C.UTF-8", "PYTHONDONTWRITEBYTECODE": "1"}
    command = [sys.executable, "-s", "-m", module, json.dumps(limits)]
    return subprocess.run(
        command,
        stdin=given,
        stdout=out,
        stderr=subprocess.DEVNULL,
        env=environment,
        cwd="/",
        timeout=REAL_S,
        check=False,
    ).returncode
