"""Runs a Python file that the author of a rubric wrote, and says where a mistake in it is."""

from __future__ import annotations

import hashlib
import sys
import threading
import traceback
from types import ModuleType

from grader.runtime.model.dataclass import dataclass

#: Held while a file runs: its module can be found before it is complete, and submissions are graded in several threads.
_RUNNING = threading.RLock()


@dataclass(frozen=True, slots=True)
class AuthorMistake:
    """A mistake in a file that a rubric brings, found while a submission was graded; the rubric's author has to act."""

    file: str  # name of the file, relative to the rubric
    line: int  # the line that failed, or where the function begins that returned something wrong; 0 if unknown
    text: str  # what is wrong, in one line

    def __str__(self) -> str:
        """Place and text, as in messages."""
        return f"{self.file}:{self.line}: {self.text}" if self.line else f"{self.file}: {self.text}"


def run_author_file(prefix: str, path: str, content: bytes) -> ModuleType:
    """Return the module of a file; the same file with the same content runs once per process and prefix.

    Args:
        prefix: Begins the name of the module.
        path: The file, for tracebacks.
        content: Its text.

    Raises:
        BaseException: Whatever the file raises.
    """
    digest = hashlib.sha256(path.encode("utf-8", "surrogateescape") + b"\0" + content).hexdigest()
    name = f"{prefix}_{digest[:24]}"
    with _RUNNING:
        if name in sys.modules:
            return sys.modules[name]
        module = ModuleType(name)
        module.__file__ = path
        vars(module)["__content__"] = content
        code = compile(content, path, "exec", dont_inherit=True)
        sys.modules[name] = module  # dataclasses look up their module while they are created
        try:
            exec(code, vars(module))  # noqa: S102  the instructor chose this file, and it lies where no student writes
        except BaseException:
            del sys.modules[name]
            raise
        return module


def line_of(error: BaseException, path: str, default: int = 1) -> int:
    """Return the line of a file in which an error arose, or that led to it; the default if it is not known."""
    if isinstance(error, SyntaxError) and error.filename == path:
        return error.lineno or default
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    return (lines[-1] if lines else None) or default


def error_words(error: BaseException) -> str:
    """Return what an error says, without the place of a syntax error."""
    return str(error.msg) if isinstance(error, SyntaxError) else str(error)
