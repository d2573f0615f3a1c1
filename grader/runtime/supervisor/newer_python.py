"""Finds out whether a program failed only because it is written for the Python of its ROS release, which is newer.

Wheels of ROS exist for older versions of Python than the one that a release is made for. A program that is right there
is right, so what it loses here is not its fault. No other Python is asked: `grader.runtime.supervisor.newer_syntax`
reads the
file, and what came to the standard library since when is listed here.
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
from grader.runtime.model.trace import Fault, FaultKind, NewerPython, Trace
from grader.runtime.programs.inert import text_of

Version: TypeAlias = tuple[int, int]
HERE: Version = sys.version_info[:2]
MODULE = "grader.runtime.supervisor.newer_syntax"
#: Limits of the process that reads a file: memory and output in bytes, processor time in seconds. A file of the largest
#: size that is looked at takes a tenth of each.
MOST_SAID = 64
LIMITS: Mapping[str, object] = {"memory": 1 << 30, "output": MOST_SAID, "processor": 30}
#: What came to the modules of the standard library that programs use, by the version that it came with. A class has
#: the name that messages of Python give it. `tests/runtime/supervisor/test_newer_python.py` compares with typeshed.
NEW_NAMES: Mapping[Version, Mapping[str, str]] = {
    (3, 11): {
        "asyncio": "Barrier BrokenBarrierError Runner TaskGroup Timeout timeout timeout_at",
        "builtins": "BaseExceptionGroup ExceptionGroup",
        "contextlib": "chdir",
        "datetime": "UTC",
        "enum": "CONFORM CONTINUOUS EJECT EnumCheck EnumType FlagBoundary KEEP NAMED_FLAGS ReprEnum STRICT StrEnum "
        "UNIQUE bin global_enum global_enum_repr global_flag_repr global_str member nonmember property "
        "show_flag_values verify",
        "hashlib": "file_digest",
        "inspect": "getmembers_static ismethodwrapper",
        "io": "text_encoding",
        "locale": "getencoding",
        "logging": "getLevelNamesMapping",
        "math": "cbrt exp2",
        "operator": "call",
        "re": "NOFLAG",
        "sys": "exception",
        "typing": "LiteralString Never NotRequired Required Self TypeVarTuple Unpack assert_never assert_type "
        "clear_overloads dataclass_transform get_overloads reveal_type",
    },
    (3, 12): {
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
    },
    (3, 13): {
        "asyncio": "EventLoop QueueShutDown",
        "builtins": "PythonFinalizationError",
        "copy": "replace",
        "enum": "EnumDict",
        "glob": "translate",
        "math": "fma",
        "os": "process_cpu_count",
        "pathlib": "UnsupportedOperation",
        "PosixPath": "from_uri full_match parser",
        "queue": "ShutDown",
        "re": "PatternError",
        "statistics": "kde kde_random",
        "types": "CapsuleType",
        "typing": "NoDefault ReadOnly TypeIs get_protocol_members is_protocol",
        "warnings": "deprecated",
    },
    (3, 14): {
        "asyncio": "FrameCallGraphEntry FutureCallGraph capture_call_graph format_call_graph future_add_to_awaited_by "
        "future_discard_from_awaited_by print_call_graph",
        "concurrent.futures": "InterpreterPoolExecutor",
        "functools": "Placeholder",
        "inspect": "CO_HAS_DOCSTRING CO_METHOD ispackage",
        "io": "Reader Writer",
        "operator": "is_none is_not_none",
        "os": "readinto reload_environ",
        "PosixPath": "copy copy_into info move move_into",
        "sys": "is_remote_debug_enabled remote_exec",
        "typing": "evaluate_forward_ref",
        "uuid": "MAX NIL uuid6 uuid7 uuid8",
    },
}
#: Modules that came to the standard library.
NEW_MODULES: Mapping[str, Version] = {
    "tomllib": (3, 11),
    "annotationlib": (3, 14),
    "compression": (3, 14),
    "concurrent.interpreters": (3, 14),
    "pathlib.types": (3, 14),
    "string.templatelib": (3, 14),
}
#: How Python says that a name is not there; the groups are its owner and the name.
_LACKS = (
    r"^ImportError: cannot import name '(?P<name>\w+)' from '(?P<of>[\w.]+)'",
    r"^AttributeError: module '(?P<of>[\w.]+)' has no attribute '(?P<name>\w+)'",
    r"^AttributeError: '(?P<of>\w+)' object has no attribute '(?P<name>\w+)'",
    r"^AttributeError: type object '(?P<of>\w+)' has no attribute '(?P<name>\w+)'",
    r"^NameError: name '(?P<name>\w+)' is not defined",
)
_NO_MODULE = r"^ModuleNotFoundError: No module named '([\w.]+)'"


def with_newer(trace: Trace, root: str, distro: str) -> Trace:
    """Return a trace with what its programs failed of, and would not with the Python of the ROS release.

    Args:
        trace: A recording.
        root: The folder of the submission.
        distro: The ROS release.
    """
    python = release_of(distro).python
    if python is None or python <= HERE:
        return trace
    try:
        found = tuple(_newer(trace, Path(root), distro, python))
    except HarnessError as error:
        return replace(trace, harness_problem=error.message)
    return replace(trace, newer=found) if found else trace


def _newer(trace: Trace, root: Path, distro: str, python: Version) -> Iterator[NewerPython]:
    hidden = {Path(name).stem for start in trace.starts for name in start.hidden}
    for fault in trace.faults():
        if fault.kind is FaultKind.SYNTAX_ERROR:
            needs, name = _of_file(root, fault.file, distro, python), ""
        else:
            name = newer_name(fault)
            needs = None if name.partition(".")[0] in hidden else came_with(name)
        if needs is not None and HERE < needs <= python:
            yield NewerPython(fault.process, fault.file, fault.line, needs, HERE, distro, python, name)


def newer_name(fault: Fault) -> str:
    """Return the module, or the owner and the name, that an exception says is not there; empty for other faults."""
    module = fault.said(_NO_MODULE)
    if module is not None:
        return module[1]
    found = next((match for pattern in _LACKS if (match := fault.said(pattern)) is not None), None)
    if found is None:
        return ""
    parts = found.groupdict()
    return f"{parts.get('of') or 'builtins'}.{parts['name']}"


def came_with(name: str) -> Version | None:
    """Return the version of Python that a module or name came with; None for any that is not new."""
    if name in NEW_MODULES:
        return NEW_MODULES[name]
    of, _, last = name.rpartition(".")
    return next((version for version, names in NEW_NAMES.items() if last in names.get(of, "").split()), None)


#: What a file holds that any newer version reads: an f- or t-string, a type statement, type parameters, exceptions
#: without brackets, and before Python 3.11 a star. For others no process is started.
_NEWER = re.compile(
    rb"(?:[ftFT][rR]?|[rR][ftFT])['\"]|\btype\b|\b(?:def|class)\b[\s\\]+\w+[\s\\]*\[|\bexcept\b[^:\n]*[,\\]"
    + (rb"|\*" if HERE < (3, 11) else rb"")
)


def _of_file(root: Path, file: str, distro: str, python: Version) -> Version | None:
    """Return the version of Python that compiles a file of a submission; None if none is known to."""
    try:
        text = text_of(root / file) if file else None
    except OSError:
        return None
    if text is None or _NEWER.search(text) is None:
        return None
    return version_for(text, f"whether Python {'.'.join(map(str, python))} of ROS 2 {distro} reads {file}")


@lru_cache(maxsize=64)
def version_for(text: bytes, question: str) -> Version | None:
    """Return the oldest version of Python that compiles a text which this one cannot; None if none is known to.

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
        return _checked(out.read(MOST_SAID))


def _checked(told: bytes) -> Version | None:
    """Return the version that the process found; None if it reached a limit, which no ordinary file makes it do."""
    found = re.fullmatch(rb"\[(\d{1,2}), (\d{1,2})\]\n", told)
    return None if found is None else (int(found[1]), int(found[2]))
