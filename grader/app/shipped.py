"""Reads the shipped rubrics and recording, and keeps what they hold in a compiled form beside the byte code."""

from __future__ import annotations

import contextlib
import hashlib
import pickle
import secrets
import sys
from collections.abc import Callable, Iterable
from functools import cache
from pathlib import Path
from typing import TypeVar

from grader.core.exercise import Exercise
from grader.execution.bag import Odometry, read_odometry
from grader.rubrics.builtin import builtin_headers, builtin_odometry
from grader.rubrics.loader import read_rubric

_Value = TypeVar("_Value")
#: The package, and where Python keeps its byte code: who may write there decides what the grader executes anyway.
PACKAGE = Path(__file__).resolve().parent.parent
COMPILED = PACKAGE / "__pycache__"


@cache
def builtin_exercises() -> tuple[Exercise, ...]:
    """Return the built-in exercises, ordered by number; raises RubricError without any."""
    paths = [header.path for header in builtin_headers()]
    return compiled("rubrics", [*paths, *PACKAGE.rglob("*.py")], lambda: tuple(map(read_rubric, paths)))


@cache
def builtin_recording() -> Odometry:
    """Return the built-in /odom recording."""
    folder = builtin_odometry()
    code = (PACKAGE / name for name in ("execution/bag.py", "core/scenario.py"))
    return compiled("odometry", [*folder.iterdir(), *code], lambda: read_odometry(folder))


def compiled(name: str, sources: Iterable[Path], read: Callable[[], _Value]) -> _Value:
    """Return what `read` returns, from its compiled form if that is newer than every source.

    A compiled form that cannot be read is ignored, and one that cannot be written is not kept.

    Args:
        name: Name of the compiled form.
        sources: The files that the value depends on, by path, size and time of change.
        read: Reads the sources.
    """
    file = COMPILED / f"{name}.{sys.implementation.cache_tag}.pickle"
    digest = hashlib.sha256()
    for source in sorted(sources):
        found = source.stat()
        digest.update(f"{source} {found.st_size} {found.st_mtime_ns}\n".encode())
    key = digest.digest()
    with contextlib.suppress(Exception):  # whatever an incomplete file raises
        content = file.read_bytes()
        if content.startswith(key):
            value: _Value = pickle.loads(content[len(key) :])  # noqa: S301 - as trusted as the byte code beside it
            return value
    value = read()
    draft = file.with_name(f"{file.name}.{secrets.token_hex(8)}")
    with contextlib.suppress(OSError):
        try:
            draft.write_bytes(key + pickle.dumps(value, pickle.HIGHEST_PROTOCOL))
            draft.replace(file)
        finally:
            draft.unlink(missing_ok=True)
    return value
