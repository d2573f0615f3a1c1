"""Builds the interface packages of a submission in a process with a sandbox and limits."""

from __future__ import annotations

import json
import os
import subprocess
from collections.abc import Collection, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.core.errors import HarnessError
from grader.core.quantities import GIB, MIB
from grader.execution.ros_installation import RosInstallation
from grader.execution.sandbox.environment import PACKAGE, worker_environment
from grader.execution.sandbox.exposure import view_of, worker_view
from grader.execution.sandbox.protocol import Isolation, start_request
from grader.execution.sandbox.seccomp import student_filter
from grader.execution.sandbox.start import landlock_version
from grader.execution.sandbox.tiers import DEVICES, PLAIN_NAME, start_command
from grader.interfaces.definitions import InterfacePackage

MODULE = "grader.interfaces.program"
#: Limits of the process: processor time, real time, memory, the size of a file, and the files and bytes it may write.
PROCESSOR_S, REAL_S, MEMORY_BYTES, FILE_BYTES = 30, 120.0, GIB, 8 * MIB
MOST_FILES, MOST_BYTES = 4_000, 64 * MIB


def build_confined(  # noqa: PLR0913  where it runs, what it reads, where it writes
    isolation: Isolation,
    ros: RosInstallation,
    submission: Path,
    into: Path,
    *,
    others: Sequence[InterfacePackage],
    taken: Collection[str],
) -> dict[str, Any]:
    """Build the interface packages in a submission, and return the answer of `grader.interfaces.program`.

    Nothing of the submission is executed, but its definitions are parsed and turned into modules.

    Args:
        isolation: The tier.
        ros: ROS, with the definitions and the generators.
        submission: The staged submission.
        into: An empty folder that receives a folder of modules.
        others: Packages that the submission's may refer to.
        taken: Names of packages that a submission cannot bring.

    Raises:
        HarnessError: The process did not end well, exceeded a limit, or wrote something else than plain files.
    """
    request = {
        "submission": str(submission),
        "into": str(into),
        "others": [[p.name, [[d.kind, d.name, d.text] for d in p.definitions]] for p in others],
        "taken": sorted(taken),
        "share": [*map(str, ros.share)],
    }
    runtime = ros.runtime
    view = worker_view(runtime, into)
    view = replace(view, read=(*view.read, *ros.share, submission), own=(*view.own, PACKAGE / "interfaces"))
    limits = {"RLIMIT_CPU": PROCESSOR_S, "RLIMIT_AS": MEMORY_BYTES, "RLIMIT_FSIZE": FILE_BYTES, "RLIMIT_CORE": 0}
    confined = isolation.name != PLAIN_NAME and landlock_version()
    confinement = {
        "read": [str(path) for path in view_of((*view.read, PACKAGE.parent)).bound],  # to be listed by imports
        "hidden": [],
        "devices": DEVICES,
        "tcp": False,
        "reach": False,
    }
    restrictions = start_request(
        str(into),
        limits=limits,
        confinement=confinement if confined else None,
        filter=student_filter().hex() if confined else "",
    )
    argv = (*start_command(restrictions), str(runtime.executable), "-s", "-B", "-m", MODULE)
    command = isolation.worker_command(argv, worker_environment(runtime, into), (), view)
    try:
        done = subprocess.run(
            command.argv,
            env=dict(command.environment),
            pass_fds=command.pass_fds,
            input=json.dumps(request).encode(),
            capture_output=True,
            check=True,
            timeout=REAL_S,
            cwd="/",
            start_new_session=True,
        )
        told = json.loads(done.stdout)
    except subprocess.CalledProcessError as error:
        said = error.stderr.decode("utf-8", "replace").strip().splitlines() or [f"code {error.returncode}"]
        raise HarnessError(f"interfaces: expected them to be built, found that it ended: {said[-1][-400:]}") from error
    except (OSError, subprocess.SubprocessError, ValueError, RecursionError) as error:
        raise HarnessError(f"interfaces: expected them to be built, found {type(error).__name__}") from error
    finally:
        for descriptor in command.opened_fds:
            os.close(descriptor)
    _check(into)
    if not isinstance(told, dict):
        raise HarnessError("interfaces: expected an object, found something else")
    return told


def _check(folder: Path) -> None:
    """Raise HarnessError unless a folder holds only plain files and folders, and not too many."""
    size = 0
    for number, path in enumerate(folder.rglob("*")):
        plain = not path.is_symlink() and (path.is_file() or path.is_dir())
        size += path.lstat().st_size
        if not plain or number >= MOST_FILES or size > MOST_BYTES:
            raise HarnessError("interfaces: expected plain files of a moderate size, found others")
