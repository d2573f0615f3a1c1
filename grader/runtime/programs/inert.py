"""Says whether a file holds anything to run, or why Python cannot compile it."""

from __future__ import annotations

import ast
import os
import stat
import warnings
from pathlib import Path

from grader.runtime.host.packages import parsed
from grader.runtime.model.limits import MAX_PARSED_BYTES


def read_inert(content: bytes | str) -> ast.Module | SyntaxError | None:
    """Return what a file holds, or why Python cannot compile it; None if only a process should find out.

    Only a contained process asks this about what students wrote.
    """
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as error, a warning about a string would be a syntax error
        try:
            return parsed(content) if isinstance(content, bytes) else ast.parse(content)
        except SyntaxError as error:
            return error
        except (ValueError, RecursionError, MemoryError, OverflowError):
            return None


def read_text(path: Path) -> bytes | None:
    """Return the content of a file; None if it is large, or a pipe or device, which might never end or begin."""
    if not stat.S_ISREG(path.stat().st_mode):
        return None
    with open(path, "rb", opener=_without_waiting) as file:
        found = os.fstat(file.fileno())  # it may have been replaced
        is_usual = stat.S_ISREG(found.st_mode) and found.st_size <= MAX_PARSED_BYTES
        return file.read(MAX_PARSED_BYTES) if is_usual else None


def _without_waiting(path: str, flags: int) -> int:
    return os.open(path, flags | os.O_NONBLOCK | os.O_CLOEXEC)


def is_inert(tree: ast.Module | None) -> bool:
    """Return whether a file holds only comments, texts and `pass`, so that running it does nothing."""
    return tree is not None and all(
        isinstance(line, ast.Pass) or (isinstance(line, ast.Expr) and isinstance(line.value, ast.Constant))
        for line in tree.body
    )
