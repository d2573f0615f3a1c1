"""Checks whether the modules that every student process loads have up-to-date byte code.

Neither workers nor student processes write byte code: a missing or stale file would be compiled at every start.

Usage: python -m grader.runtime.supervisor.byte_code, with the interpreter and environment of a worker; prints JSON.
"""

from __future__ import annotations

import importlib
import importlib.util
import json
import shlex
import subprocess
import sys
import sysconfig
import tempfile
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

from grader.runtime.compiled import compiled, state_of_package
from grader.runtime.model.checkup import Fact
from grader.runtime.ros_installation import MESSAGE_PACKAGES, PythonRuntime
from grader.runtime.sandbox.environment import PACKAGE, worker_environment

#: The modules that a node and the host import directly; their own imports are found through sys.modules.
LOADED = ("rclpy", "rclpy.action", "rclpy.executors", "time_machine", *(f"{name}.msg" for name in MESSAGE_PACKAGES))
#: Folders of this package that workers and student processes load modules from.
OWN = (
    PACKAGE / "runtime",
    *(
        PACKAGE / "runtime" / name
        for name in ("host", "model", "programs", "recording", "sandbox", "stimuli", "worker")
    ),
)
#: Layout of a .pyc: magic number, flags, then a hash of the source or its time and size; PEP 552.
HEADER_BYTES, FLAGS_AT, FIRST_AT, SECOND_AT = 16, 4, 8, 12
BY_HASH, CHECK_SOURCE = 0b01, 0b10
#: Importing ROS once takes a second or two; a machine that is busy may take a minute.
TIMEOUT_S = 120.0


def compile_own(package: Path = PACKAGE) -> None:
    """Compile the modules of this package, where possible, if one of them has changed since this was last done.

    Byte code that was deleted since is not made again: the interpreter then compiles the module, which takes longer.
    """
    compiled("byte_code", state_of_package(package), lambda: _compile(package), package / "__pycache__")


def _compile(package: Path) -> bool:
    import compileall  # noqa: PLC0415 - few runs compile anything

    return bool(compileall.compile_dir(package, quiet=2))


def byte_code(runtime: PythonRuntime) -> Fact:
    """Check whether the byte code of an installation is up to date, and name the command that compiles it."""
    _compile(PACKAGE)
    with tempfile.TemporaryDirectory(prefix="grade-doctor-") as folder:
        try:
            done = subprocess.run(
                [runtime.executable, "-s", "-B", "-m", "grader.runtime.supervisor.byte_code"],
                env=worker_environment(runtime, Path(folder)),
                cwd="/",
                capture_output=True,
                check=True,
                timeout=TIMEOUT_S,
            )
            stale = [Path(path) for path in json.loads(done.stdout)]
        except (OSError, subprocess.SubprocessError, ValueError, TypeError):
            return Fact("byte code", "cannot be checked: ROS does not start")
    if not stale:
        return Fact("byte code", "up to date")
    value = (
        f"missing or stale for {len(stale):,} file{'s' * (len(stale) != 1)}: each start of a node compiles them again"
    )
    return Fact("byte code", value, remedy=compile_command(runtime.executable, _roots(stale)))


def compile_command(executable: Path, folders: Sequence[Path]) -> str:
    """Return the command that recompiles everything in some folders."""
    return shlex.join([str(executable), "-m", "compileall", "-q", "-f", *map(str, folders)])


def is_current(source: Path, compiled: Path) -> bool:
    """Return whether an interpreter would load the byte code of a source file instead of compiling the file."""
    try:
        with compiled.open("rb") as file:
            header = file.read(HEADER_BYTES)
        if len(header) < HEADER_BYTES or header[:FLAGS_AT] != importlib.util.MAGIC_NUMBER:
            return False
        flags = int.from_bytes(header[FLAGS_AT:FIRST_AT], "little")
        if flags & BY_HASH:
            return not flags & CHECK_SOURCE or header[FIRST_AT:] == importlib.util.source_hash(source.read_bytes())
        found = source.stat()
    except OSError:
        return False
    stamps = (int(found.st_mtime), found.st_size)
    kept = (header[FIRST_AT:SECOND_AT], header[SECOND_AT:])
    return not flags and all(
        part == (stamp & 0xFFFFFFFF).to_bytes(4, "little") for part, stamp in zip(kept, stamps, strict=True)
    )


def _roots(files: Sequence[Path]) -> list[Path]:
    """Return the folders to compile: the site-packages folders, or this package, that hold the stale files."""
    known = {Path(sysconfig.get_path(name)) for name in ("purelib", "platlib", "stdlib")} | {PACKAGE}
    deepest = sorted(known, key=lambda folder: -len(folder.parts))
    return sorted({next((folder for folder in deepest if folder in file.parents), _top(file)) for file in files})


def _top(file: Path) -> Path:
    """Return the folder that contains a file's outermost package."""
    folder = file.parent
    while (folder / "__init__.py").is_file():
        folder = folder.parent
    return folder


def _loaded() -> Iterator[tuple[Path, Path]]:
    """Yield the source file and the byte-code file of each module that starting a node loads."""
    for name in LOADED:
        importlib.import_module(name)
    for module in list(sys.modules.values()):
        spec: Any = getattr(module, "__spec__", None)
        if module.__name__.partition(".")[0] == PACKAGE.name:
            continue  # includes modules that nodes do not load; the loop below covers those that they do
        if spec is not None and spec.has_location and spec.cached and str(spec.origin).endswith(".py"):
            yield Path(spec.origin), Path(spec.cached)
    for source in (path for folder in OWN for path in folder.glob("*.py")):
        yield source, Path(importlib.util.cache_from_source(str(source)))


if __name__ == "__main__":
    stale = sorted(str(source) for source, compiled in _loaded() if not is_current(source, compiled))
    sys.stdout.write(json.dumps(stale))
