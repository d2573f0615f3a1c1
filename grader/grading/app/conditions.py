"""The conditions of a recording that must not matter, and which of them this machine and user can make."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import field
from pathlib import Path

from grader.grading.model.conditions import (
    AGAIN,
    CONDITIONS,
    EXECUTED,
    FOLDER,
    HASHES,
    LOAD,
    ORDER,
    PROCESSORS,
    SANDBOXES,
    TOGETHER,
    USER,
    USUAL,
    ZONE,
)
from grader.runtime import machine
from grader.runtime.model.checkup import missing
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EnvironmentFault

#: Busy loops for each processor under `load`: a node then gets a third of one.
LOOPS = 2
#: A time zone with an odd offset, and a language of another encoding.
ELSEWHERE: Mapping[str, str] = {"TZ": "Asia/Kathmandu", "LANG": "de_DE.ISO-8859-1", "LC_ALL": "C"}
#: The hash seeds of the grader's own processes: that of the first recording, and another one.
HASH_SEEDS = ("1", "2")
#: The name of the folder that is the temporary one under `folder`.
OTHER_FOLDER = "another temporary folder"
#: How long to try whether another user can start the grader, in seconds.
TRIAL_S = 60.0


@dataclass(frozen=True, slots=True)
class VerifyCondition:
    """One condition, and how it is made."""

    name: str  # as `--condition` takes it
    words: str  # what is different under it, as a phrase
    not_tried: str = ""  # why this machine or user cannot make it, as a phrase; empty if it can
    reverses: bool = False  # one scenario at a time, the last one first
    executes: bool = False  # each student's process is executed
    isolation: str = ""  # another sandbox; empty for that of the first recording
    processors: tuple[int, ...] = ()  # the processors to run on; empty for all
    loops: int = 0  # busy loops beside it
    variables: Mapping[str, str] = field(default_factory=dict)  # of the grader's own environment
    other_folder: bool = False  # whether its temporary folder is another one
    user: int | None = None  # the user to run as; None for the same one


@dataclass(frozen=True, slots=True)
class Surroundings:
    """What decides which conditions can be made: the machine, and the user who runs the grader."""

    processors: tuple[int, ...]  # that may be used
    is_root: bool
    python: str  # the interpreter that another user has to start
    can_fork: Callable[[str], bool]  # whether a sandbox can fork nodes; raises EnvironmentFault if it is not there


def surroundings() -> Surroundings:
    """Return those of this process."""
    processors = tuple(sorted(os.sched_getaffinity(0)))
    return Surroundings(processors, os.geteuid() == 0, sys.executable, machine.can_fork)


#: The first recording, which the others are compared with.
FIRST = VerifyCondition("first", "as grading records", variables={"PYTHONHASHSEED": HASH_SEEDS[0]})


def made_conditions(names: Sequence[str], isolation: str, here: Surroundings) -> list[VerifyCondition]:
    """Return the named conditions, in the order in which they are tried; all usual ones if none is named.

    Those that this machine or user cannot make say why. Testing the sandboxes may take some seconds.

    Args:
        names: Some of `CONDITIONS`.
        isolation: The sandbox of the first recording.
        here: What they are made in.
    """
    wanted = [name for name in CONDITIONS if name in (names or USUAL) and name != isolation]
    return [
        _sandbox(name, here, asked=name in names) if name in SANDBOXES else _MAKERS[name](isolation, here)
        for name in wanted
    ]


def _load(isolation: str, here: Surroundings) -> VerifyCondition:
    del isolation
    loops = LOOPS * len(here.processors)
    return VerifyCondition(LOAD, f"beside {loops} busy loops", loops=loops)


def _processors(isolation: str, here: Surroundings) -> VerifyCondition:
    del isolation
    lacks = "" if len(here.processors) > 1 else "there is one processor only"
    return VerifyCondition(PROCESSORS, "on one processor", lacks, processors=here.processors[:1])


def _executed(isolation: str, here: Surroundings) -> VerifyCondition:
    forks = here.can_fork(isolation)
    lacks = "" if forks else f"in the sandbox {isolation}, each is executed anyway"
    return VerifyCondition(EXECUTED, "each program executed, not forked", lacks, executes=True)


def _user(isolation: str, here: Surroundings) -> VerifyCondition:
    del isolation
    words = "as another user"
    if not here.is_root:
        return VerifyCondition(USER, words, "only root can become another user")
    user = machine.other_user()
    return VerifyCondition(USER, words, _unreachable(user, here.python), isolation="auto", user=user)


def _unreachable(user: int, python: str) -> str:
    """Return why another user cannot start the grader, as a phrase; empty if it can."""
    try:
        import_all = "import grader.grading.app.recorded_again"
        done = subprocess.run(
            [python, "-c", import_all],
            user=user,
            group=user,
            extra_groups=[],
            cwd="/",
            capture_output=True,
            check=False,
            timeout=TRIAL_S,
        )
    except (OSError, subprocess.SubprocessError):
        return f"user {user} cannot execute {python}"
    return "" if done.returncode == 0 else f"user {user} cannot read what {python} needs"


def _sandbox(name: str, here: Surroundings, *, asked: bool) -> VerifyCondition:
    """Return the condition of another sandbox; unless asked for, only one that holds completely is tried."""
    words = f"in the sandbox {name}"
    try:
        here.can_fork(name)
        report = machine.sandbox(name)
    except EnvironmentFault as fault:
        return VerifyCondition(name, words, fault.message.partition(": ")[2], isolation=name)
    open_ones = [found.name for found in missing(report.properties)]
    if report.usable or (asked and report.properties):
        return VerifyCondition(name, words, isolation=name)
    lacks = f"it does not contain {', '.join(open_ones)} here" if open_ones else report.why
    return VerifyCondition(name, words, lacks, isolation=name)


def _together(isolation: str, here: Surroundings) -> VerifyCondition:
    forks = here.can_fork(isolation)
    return VerifyCondition(
        TOGETHER,
        "in another order, on one processor, elsewhere, with other hashes" + ", executed" * forks,
        reverses=True,
        executes=forks,
        processors=_processors(isolation, here).processors,
        variables={**ELSEWHERE, "PYTHONHASHSEED": HASH_SEEDS[1]},
        other_folder=True,
    )


def _always(condition: VerifyCondition) -> Callable[[str, Surroundings], VerifyCondition]:
    """Return what makes a condition that every machine and user can make."""
    return lambda _isolation, _here: condition


#: Makes a condition from the sandbox of the first recording.
_MAKERS: Mapping[str, Callable[[str, Surroundings], VerifyCondition]] = {
    AGAIN: _always(VerifyCondition(AGAIN, "again, with nothing changed")),
    ORDER: _always(VerifyCondition(ORDER, "one scenario at a time, the last one first", reverses=True)),
    PROCESSORS: _processors,
    LOAD: _load,
    EXECUTED: _executed,
    FOLDER: _always(VerifyCondition(FOLDER, "with another temporary folder", other_folder=True)),
    ZONE: _always(VerifyCondition(ZONE, "in another time zone and language", variables=ELSEWHERE)),
    HASHES: _always(
        VerifyCondition(HASHES, "with other hashes in the grader", variables={"PYTHONHASHSEED": HASH_SEEDS[1]})
    ),
    USER: _user,
    TOGETHER: _together,
}


def own_home(user: int, folder: Path) -> Mapping[str, str]:
    """Make a home for a user in a folder, and return the variables that name it."""
    home = folder / "home"
    home.mkdir(mode=0o700)
    os.chown(home, user, user)
    return {"HOME": str(home), "XDG_CACHE_HOME": str(home), "XDG_RUNTIME_DIR": str(home), "TMPDIR": "/tmp"}  # noqa: S108
