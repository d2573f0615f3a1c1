"""Finds out whether a program failed only because it is written for the Python of its ROS release, which is newer.

Wheels of ROS exist for Python 3.11 too, and the releases that have any are made for Python 3.12. A program that is
right there is right, so what it loses here is not its fault. No other Python is asked:
`grader.runtime.supervisor.newer_syntax` reads the file, and what came to the standard library is listed here.
"""

from __future__ import annotations

import importlib.util
import re
import subprocess
import sys
import tempfile
from collections.abc import Iterator, Mapping
from dataclasses import replace
from functools import lru_cache
from pathlib import Path
from typing import TypeAlias

from grader.runtime.contained import run_contained
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.releases import release_of
from grader.runtime.model.trace import AssessedTrace, Fault, FaultKind, NewerPython
from grader.runtime.programs.inert import read_text

Version: TypeAlias = tuple[int, int]
HERE: Version = sys.version_info[:2]
#: The newest Python that a release is made for, and all that a program can need beyond the one here.
NEWER: Version = (3, 12)
MODULE = "grader.runtime.supervisor.newer_syntax"
#: Limits of the process that reads a file: memory and output in bytes, processor time in seconds. A file of the largest
#: size that is looked at takes a tenth of each.
MOST_SAID = 64
LIMITS: Mapping[str, object] = {"memory": 1 << 30, "output": MOST_SAID, "processor": 30}
#: What came with it to the modules of the standard library that programs use. A class has the name that messages of
#: Python give it. `tests/runtime/supervisor/test_newer_python.py` compares with typeshed.
NEW_NAMES: Mapping[str, str] = {
    "asyncio": "create_eager_task_factory eager_task_factory",
    "calendar": "APRIL AUGUST DECEMBER Day FEBRUARY JANUARY JULY JUNE MARCH MAY Month NOVEMBER OCTOBER SEPTEMBER",
    "csv": "QUOTE_NOTNULL QUOTE_STRINGS",
    "enum": "pickle_by_enum_name pickle_by_global_name",  # and late releases of 3.11
    "inspect": "AGEN_CLOSED AGEN_CREATED AGEN_RUNNING AGEN_SUSPENDED BufferFlags getasyncgenlocals "
    "getasyncgenstate markcoroutinefunction",
    "int": "is_integer",
    "itertools": "batched",
    "logging": "getHandlerByName getHandlerNames",
    "math": "sumprod",
    "PosixPath": "is_junction walk with_segments",
    "random": "binomialvariate",
    "sys": "activate_stack_trampoline deactivate_stack_trampoline getunicodeinternedsize "
    "is_stack_trampoline_active last_exc monitoring",
    "threading": "setprofile_all_threads settrace_all_threads",
    "types": "get_original_bases",
    "typing": "TypeAliasType override",
    "uuid": "main",
}
#: How Python says that a name is not there; the groups are its owner and the name.
_LACKS = (
    r"^ImportError: cannot import name '(?P<name>\w+)' from '(?P<of>[\w.]+)'",
    r"^AttributeError: module '(?P<of>[\w.]+)' has no attribute '(?P<name>\w+)'",
    r"^AttributeError: '(?P<of>\w+)' object has no attribute '(?P<name>\w+)'",
    r"^AttributeError: type object '(?P<of>\w+)' has no attribute '(?P<name>\w+)'",
)


def with_newer(trace: AssessedTrace, root: str, distro: str) -> AssessedTrace:
    """Return a trace with what its programs failed of, and would not with the Python of the ROS release.

    Args:
        trace: A recording.
        root: The folder of the submission.
        distro: The ROS release.
    """
    python = release_of(distro).python
    if HERE >= NEWER or python != NEWER:
        return trace
    try:
        found = tuple(_newer(trace, Path(root), distro))
    except HarnessError as error:
        return replace(trace, harness_problem=error.message)
    return replace(trace, newer=found) if found else trace


def _newer(trace: AssessedTrace, root: Path, distro: str) -> Iterator[NewerPython]:
    hidden = {Path(name).stem for start in trace.starts for name in start.hidden}
    for fault in trace.faults():
        if fault.kind is FaultKind.SYNTAX_ERROR:
            found, name = _of_file(root, fault.file, distro), ""
        else:
            name = newer_name(fault)
            found = bool(name) and name.partition(".")[0] not in hidden
        if found:
            yield NewerPython(fault.process, fault.file, fault.line, NEWER, HERE, distro, NEWER, name)


def newer_name(fault: Fault) -> str:
    """Return the name, after its owner, that an exception says is not there and a newer Python has; empty for none."""
    found = next((match for pattern in _LACKS if (match := fault.said(pattern)) is not None), None)
    if found is None:
        return ""
    of, name = found["of"], found["name"]
    return f"{of}.{name}" if name in NEW_NAMES.get(of, "").split() else ""


#: What a file holds that only Python 3.12 reads: an f-string, a type statement or type parameters. For others no
#: process is started.
_NEWER = re.compile(rb"(?:[fF][rR]?|[rR][fF])['\"]|\btype\b|\b(?:def|class)\b[\s\\]+\w+[\s\\]*\[")


def _of_file(root: Path, file: str, distro: str) -> bool:
    """Return whether Python 3.12 reads a file of a submission."""
    try:
        text = read_text(root / file) if file else None
    except OSError:
        return False
    if text is None or _NEWER.search(text) is None:
        return False
    return is_newer(text, f"whether Python {'.'.join(map(str, NEWER))} of ROS 2 {distro} reads {file}")


@lru_cache(maxsize=64)
def is_newer(text: bytes, question: str) -> bool:
    """Return whether Python 3.12 reads a text which this one cannot.

    Args:
        text: A file.
        question: What is not known if this cannot be found out, for the message.

    Raises:
        HarnessError: The machine is too busy, or libcst is not installed.
    """
    if importlib.util.find_spec("libcst") is None:
        from grader.runtime.model import extras  # noqa: PLC0415 - takes long, and is seldom needed

        raise HarnessError(f"{question} is not known: libcst is not installed", extras.install_command("libcst"))
    with tempfile.TemporaryFile() as given, tempfile.TemporaryFile() as out:
        given.write(text)
        given.seek(0)
        try:
            run_contained(MODULE, LIMITS, given, out, installed=True)
        except subprocess.TimeoutExpired:
            raise HarnessError(f"{question} is not known: the machine was too busy to read it", "try again") from None
        except OSError as error:
            raise HarnessError(f"{question} is not known: {error.strerror}", "free some memory") from None
        out.seek(0)
        return out.read(MOST_SAID) == b"true\n"  # no ordinary file makes the process reach a limit
