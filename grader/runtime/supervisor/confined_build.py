"""Builds the interface packages of a submission in a process with a sandbox and limits."""

from __future__ import annotations

import json
import os
import re
import signal
import subprocess
from collections.abc import Collection, Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from grader.runtime.interfaces.definitions import InterfacePackage
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import GIB, MIB, NS_PER_S, duration, size
from grader.runtime.ros_installation import RosInstallation
from grader.runtime.sandbox.environment import PACKAGE, worker_environment
from grader.runtime.sandbox.exposure import view_of, worker_view
from grader.runtime.sandbox.protocol import Isolation, start_request
from grader.runtime.sandbox.seccomp import student_filter
from grader.runtime.sandbox.start import landlock_version
from grader.runtime.sandbox.tiers import DEVICES, PLAIN_NAME, start_command

MODULE = "grader.runtime.interfaces.program"
#: Limits of the process: processor time, real time, memory, the size of a file, and the files and bytes it may write.
PROCESSOR_S, REAL_S, MEMORY_BYTES, FILE_BYTES = 30, 120.0, GIB, 8 * MIB
#: What may be there when it has ended: far more than the definitions of a package make.
MOST_FILES, MOST_BYTES = 4_000, 64 * MIB
#: The most sentences about definitions, and characters of one.
MOST_PROBLEMS, PROBLEM_CHARACTERS = 20, 500
#: How the process may end at a limit; bubblewrap passes a signal on as a shell does.
_AT_A_LIMIT = {code for number in (signal.SIGXCPU, signal.SIGKILL, signal.SIGXFSZ) for code in (-number, 128 + number)}
_PACKAGE, _DIGEST, _FOLDER = (
    re.compile(r"[a-z][a-z0-9_]{0,99}"),
    re.compile(r"sha256:[0-9a-f]{64}"),
    re.compile("[0-9a-f]{32}"),
)
_NOT_USED = "the interface definitions of the submission are not used"


@dataclass(frozen=True, slots=True)
class Build:
    """What became of the interface packages in a submission.

    Attributes:
        packages: Digest of each package that was built, by name.
        folder: Name of the folder with their modules; empty if nothing was built.
        problems: Sentences about what could not be built.
        lasting: Whether another build would end in the same way.
    """

    packages: Mapping[str, str]
    folder: str = ""
    problems: tuple[str, ...] = ()
    lasting: bool = True


def told_of(answer: object) -> Build | None:
    """Return the build that a process or a kept file tells of; None for anything that no build tells."""
    if not isinstance(answer, dict):
        return None
    packages, folder, problems = (answer.get(name) for name in ("packages", "folder", "problems"))
    if not isinstance(packages, dict) or not isinstance(folder, str) or not isinstance(problems, list):
        return None
    named = all(_PACKAGE.fullmatch(k) and isinstance(v, str) and _DIGEST.fullmatch(v) for k, v in packages.items())
    if (
        not named
        or (_FOLDER.fullmatch(folder) is None) == bool(packages)
        or not all(isinstance(p, str) for p in problems)
    ):
        return None
    kept = tuple(problem[:PROBLEM_CHARACTERS] for problem in problems[:MOST_PROBLEMS])
    return Build(packages, folder if packages else "", kept)


def build_confined(  # noqa: PLR0913  where it runs, what it reads, where it writes
    isolation: Isolation,
    ros: RosInstallation,
    submission: Path,
    into: Path,
    *,
    others: Sequence[InterfacePackage],
    taken: Collection[str],
    left_s: float = REAL_S,
    processor_s: int = PROCESSOR_S,
) -> Build:
    """Build the interface packages in a submission.

    Nothing of the submission is executed, but its definitions are parsed and turned into modules.

    Args:
        isolation: The tier.
        ros: ROS, with the definitions and the generators.
        submission: The staged submission.
        into: An empty folder that receives a folder of modules.
        others: Packages that the submission's may refer to.
        taken: Names of packages that a submission cannot bring.
        left_s: Real time that is left for the submission.
        processor_s: Processor time that the process may take.

    Raises:
        HarnessError: The process failed for another reason than its limits or the definitions, or the machine is too
            busy for it.
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
    view = replace(view, read=(*view.read, *ros.share, submission), own=(*view.own, PACKAGE / "runtime" / "interfaces"))
    limits = {"RLIMIT_CPU": processor_s, "RLIMIT_AS": MEMORY_BYTES, "RLIMIT_FSIZE": FILE_BYTES, "RLIMIT_CORE": 0}
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
            check=False,
            timeout=min(REAL_S, left_s),
            cwd="/",
            start_new_session=True,
        )
    except subprocess.TimeoutExpired:
        if left_s < REAL_S:
            return Build({}, problems=(f"{_NOT_USED}: building them took all of the time budget",), lasting=False)
        text = f"interfaces: the machine was too busy to build them within {duration(round(REAL_S * NS_PER_S))}"
        raise HarnessError(text, "try again later") from None
    except OSError as error:
        raise HarnessError(f"interfaces: expected them to be built, found {type(error).__name__}") from error
    finally:
        for descriptor in command.opened_fds:
            os.close(descriptor)
    if done.returncode in _AT_A_LIMIT or b"MemoryError" in done.stderr[-200:]:
        limits_ = f"{processor_s} s of processor time and {size(MEMORY_BYTES)} of memory"
        return Build({}, problems=(f"{_NOT_USED}: building them takes more than {limits_}",))
    if done.returncode:
        said = done.stderr.decode("utf-8", "replace").strip().splitlines() or [f"code {done.returncode}"]
        raise HarnessError(f"interfaces: expected them to be built, but the build ended: {said[-1][-400:]}")
    try:
        told = told_of(json.loads(done.stdout))
    except (ValueError, RecursionError):
        told = None
    if told is None:
        raise HarnessError("interfaces: expected the result of the build, found something else")
    return told if _is_moderate(into) else Build({}, problems=(f"{_NOT_USED}: they make more than {size(MOST_BYTES)}",))


def _is_moderate(folder: Path) -> bool:
    """Return whether a folder holds only plain files and folders, and not too many."""
    total = 0
    for number, path in enumerate(folder.rglob("*")):
        total += path.lstat().st_size
        plain = not path.is_symlink() and (path.is_file() or path.is_dir())
        if not plain or number >= MOST_FILES or total > MOST_BYTES:
            return False
    return True
