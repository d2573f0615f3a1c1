"""Describes why a student's program ended: the kind, one line of text, and the student's own frames."""

from __future__ import annotations

import ast
import os
import re
import sys
import traceback
from collections.abc import Callable, Iterator
from types import FrameType, TracebackType

from .protocol import FRAMES, FaultReport

#: Maximum length of a fault's text.
TEXT_CHARACTERS = 500
#: How much of an exception's text is read.
_READ_CHARACTERS = 4_000
#: How many exceptions of a chain are followed.
_LONGEST_CHAIN = 20
#: Exceptions that end a program in order: what fails while it cleans up after them is the fault.
_STOPS = ("ExternalShutdownException", "ShutdownException")
_ADDRESS = re.compile(r" at 0x[0-9a-fA-F]{6,16}\b")
_NO_PATH = r"\s'\"():,;<>\[\]"
#: The absolute path of a source or binary file. Other paths are kept, since they may be topic names.
_CODE_FILE = re.compile(rf"(?<![\w.~/])(?:/[^/{_NO_PATH}]+)+\.(?:pyc?|so(?:\.\d+)*|c|cc|cpp|h|hpp|pyx)\b")


class Describer:
    """Converts exceptions and stacks to faults.

    Args:
        root: The submission's folder; frames of files in it are the student's own.
    """

    def __init__(self, root: str = "") -> None:
        self.set_root(root)

    def set_root(self, root: str) -> None:
        """Use another folder of a submission."""
        self._root = os.path.join(os.path.realpath(root), "")
        self._folders: tuple[str, ...] = (os.path.join(root, ""), self._root)

    def hide(self, prefix: str) -> None:
        """Name files below the share folders of a prefix as those of a submission: by package and path."""
        self._folders = (*self._folders, os.path.join(prefix, "share", ""))

    def exception(self, error: BaseException) -> FaultReport:
        """Convert an uncaught exception to a fault; of a chain, the first one that the program did not expect."""
        error = self._first(error)
        failed = graders_place(error, self._inside)
        if failed is not None:
            module, line = failed
            return FaultReport(GRADERS, _name_of(type(error)), module=module, at=line)
        if isinstance(error, SyntaxError) and self._is_of_file(error):
            return self.syntax_error(error)
        frames = [(f.f_code.co_filename, line, f.f_code.co_name) for f, line in traceback.walk_tb(error.__traceback__)]
        kind = _name_of(type(error))
        message = error.msg if isinstance(error, SyntaxError) else self.one_line(error)
        return self._placed(FaultReport("exception", kind, _behind(kind, message)), frames)

    def _first(self, error: BaseException) -> BaseException:
        """Return the exception that began a chain.

        What a library raises while it handles another exception, and what an `except` for one kind of exception lets
        happen, stands for itself.
        """
        first, later = error, error
        for _ in range(_LONGEST_CHAIN):
            earlier = later.__cause__ if later.__suppress_context__ else later.__context__
            if earlier is None or not isinstance(earlier, Exception) or type(earlier).__name__ in _STOPS:
                break
            handled = self._handled(earlier, later)
            if handled is not None:
                if _is_expected(*handled):
                    break
                first = earlier
            later = earlier
        return first

    def _handled(self, earlier: BaseException, later: BaseException) -> tuple[str, int, int] | None:
        """Return the student's file, and the lines at which `earlier` came and `later` arose; None for a library's."""
        passed = dict(traceback.walk_tb(earlier.__traceback__))
        shared = [(f, line) for f, line in traceback.walk_tb(later.__traceback__) if f in passed]
        if not shared or not self._inside(shared[-1][0].f_code.co_filename):
            return None
        frame, line = shared[-1]
        return frame.f_code.co_filename, passed[frame], line

    def _is_of_file(self, error: SyntaxError) -> bool:
        """Return whether a file of the submission cannot be compiled: any code may raise a SyntaxError itself."""
        try:
            path = os.path.realpath(error.filename or "")
            with open(path, "rb") as source:
                text = source.read() if self._inside(path) else b""
        except Exception:  # the name is not a path, or the file cannot be read
            return False
        try:
            compile(text, path, "exec", dont_inherit=True)
        except (SyntaxError, ValueError):
            return type(error.lineno) in (int, type(None))
        return False

    def syntax_error(self, error: SyntaxError) -> FaultReport:
        """Convert the error of a file that cannot be compiled to a fault."""
        file = os.path.realpath(error.filename or "")
        message = str(error.msg)[:TEXT_CHARACTERS]
        kind, line = type(error).__name__, error.lineno or 0
        return FaultReport("syntax_error", kind, message, file=self._relative(file), line=line)

    def stack(self, frame: FrameType | None, code: str) -> FaultReport:
        """Return a fault with the current stack of a thread."""
        frames = []
        while frame is not None:
            frames.append((frame.f_code.co_filename, frame.f_lineno, frame.f_code.co_name))
            frame = frame.f_back
        return self._placed(FaultReport(code), frames[::-1])

    def _placed(self, fault: FaultReport, frames: list[tuple[str, int, str]]) -> FaultReport:
        """Return a fault with the student's own of some frames, outermost first."""
        own = [(self._relative(file), line, name) for file, line, name in frames if self._inside(file)]
        file, line, _ = own[-1] if own else ("", 0, "")
        return fault._replace(file=file, line=line, frames=own[-FRAMES:])

    def _inside(self, file: str) -> bool:
        return os.path.realpath(file).startswith(self._root)

    def _relative(self, file: str) -> str:
        path = os.path.realpath(file)
        return path[len(self._root) :] if path.startswith(self._root) else os.path.basename(path)

    def one_line(self, error: BaseException) -> str:
        """Format an exception like the last line of a traceback, on one line of at most 500 characters.

        Text that differs between runs or machines is removed: addresses of objects, and folders.
        """
        try:
            text = "".join(traceback.format_exception_only(type(error), error))[:_READ_CHARACTERS].strip()
        except Exception:  # the student's own __str__ may raise anything
            text = type(error).__name__
        return self._without_machine(" ".join(text.split()))[:TEXT_CHARACTERS]

    def _without_machine(self, text: str) -> str:
        """Make the submission's files in a text relative to its folder, and cut other files to their names."""
        text = _ADDRESS.sub("", text)
        for folder in self._folders:
            text = text.replace(folder, "") if len(folder) > 1 else text
        text = _CODE_FILE.sub(lambda found: os.path.basename(found[0]), text)
        for folder in _machine_folders():
            if folder in text:
                text = re.sub(rf"{re.escape(folder)}(?:/[^{_NO_PATH}]*)?", lambda f: os.path.basename(f[0]), text)
        # The tiers without a view of files of their own have another folder for temporary files.
        temporary = os.environ.get("TMPDIR", "")
        return text.replace(temporary, "/tmp") if temporary.count("/") > 1 else text  # noqa: S108


#: The code of a fault that is the grader's own, and the folder of its modules.
GRADERS = "grader"
_HOST = os.path.join(os.path.dirname(os.path.abspath(__file__)), "")
#: Modules that find and run the student's file, or do the work of a module of the standard library: what a function
#: raises that they call is an answer to the student's code.
_FOR_STUDENTS = frozenset({"entry", "launch", "machine", "outside", "packages", "quick_imports", "replaced"})
_FOR_STUDENTS |= {"setup_files", "shadows", "threads", "times"}
#: What a limit or the end of the process raises, wherever it is at that moment.
_ANYWHERE = (MemoryError, RecursionError, OSError)


def graders_place(error: BaseException, inside: Callable[[str], bool]) -> tuple[str, int] | None:
    """Return module and line of the grader's code that an exception shows to be wrong; None if it is the student's.

    The grader's functions stand between the program and rclpy or the standard library, and raise what these raise:
    by a `raise`, by calling the original, or by using an argument. Whatever else arises in them is a mistake of theirs.

    Args:
        error: An uncaught exception.
        inside: Whether a file belongs to the submission.
    """
    if not isinstance(error, Exception) or isinstance(error, _ANYWHERE):
        return None
    if type(error).__module__.partition(".")[0] in ("rclpy", "_rclpy_pybind11"):
        return None
    found = None
    for step in _steps(error):
        file = step.tb_frame.f_code.co_filename
        if os.path.abspath(file).startswith(_HOST):
            found = step
        elif inside(file) or f"{os.sep}rclpy{os.sep}" in file:
            found = None
    if found is None or _answers(found):
        return None
    file = found.tb_frame.f_code.co_filename
    return os.path.relpath(os.path.abspath(file), _HOST), found.tb_lineno


def _steps(error: BaseException) -> Iterator[TracebackType]:
    step = error.__traceback__
    while step is not None:
        yield step
        step = step.tb_next


def _answers(step: TracebackType) -> bool:
    """Return whether a function of the grader that fails there does what the replaced function would do."""
    code = step.tb_frame.f_code
    module = os.path.relpath(os.path.abspath(code.co_filename), _HOST).partition(".")[0].partition(os.sep)[0]
    nodes = _failing(step)
    if any(isinstance(node, (ast.Raise, ast.With)) for node in nodes):
        return True
    if any(isinstance(node, ast.Call) for node in nodes) and module in _FOR_STUDENTS:
        return True
    arguments = {*code.co_varnames[: code.co_argcount + code.co_kwonlyargcount]} - {"self"}
    originals = {*code.co_freevars, *arguments}
    if any(isinstance(n, ast.Call) and isinstance(n.func, ast.Name) and n.func.id in originals for n in nodes):
        return True
    # A function in a function replaces one of a library, and so does a method of the wait set.
    replaces = "<locals>" in code.co_qualname or module == "wait_set"
    used = {n.id for node in nodes if not isinstance(node, ast.Call) for n in ast.walk(node) if isinstance(n, ast.Name)}
    return replaces and bool(used & arguments)


def _failing(step: TracebackType) -> list[ast.stmt | ast.expr]:
    """Return the parts of the source that a step of a traceback was at; several if Python does not tell which."""
    code = step.tb_frame.f_code
    try:
        with open(code.co_filename, "rb") as source:
            nodes = [node for node in ast.walk(ast.parse(source.read())) if isinstance(node, (ast.stmt, ast.expr))]
    except (OSError, SyntaxError, ValueError):
        return []
    if hasattr(code, "co_positions"):  # Python 3.11
        where = list(code.co_positions())[step.tb_lasti // 2]
        exact = [n for n in nodes if (n.lineno, n.end_lineno, n.col_offset, n.end_col_offset) == where]
        if exact:
            return exact
    return [n for n in nodes if n.lineno == step.tb_lineno and not isinstance(n, (ast.FunctionDef, ast.ClassDef))]


def _is_expected(file: str, earlier: int, later: int) -> bool:
    """Return whether an `except` for one kind of exception leads from one line to another that raises no exception."""
    try:
        with open(file, "rb") as source:
            nodes = list(ast.walk(ast.parse(source.read())))
    except Exception:  # the file is gone, or is not Python
        return False
    if any(isinstance(n, ast.Raise) and _covers(n, later) for n in nodes):
        return False
    tried = [n for n in nodes if isinstance(n, ast.Try) and any(_covers(s, earlier) for s in n.body)]
    kinds = [handler.type for n in tried for handler in n.handlers if _covers(handler, later)]
    return any(kind is not None and getattr(kind, "id", "") not in ("Exception", "BaseException") for kind in kinds)


def _covers(node: ast.stmt | ast.ExceptHandler, line: int) -> bool:
    return node.lineno <= line <= (node.end_lineno or node.lineno)


def _name_of(kind: type[BaseException]) -> str:
    """Return the name of an exception class as tracebacks show it."""
    module = getattr(kind, "__module__", None)
    known = not isinstance(module, str) or module in ("__main__", "builtins")
    return kind.__qualname__ if known else f"{module}.{kind.__qualname__}"


def _behind(kind: str, line: str) -> str:
    """Return the text of an exception without the name of its class."""
    return "" if line == kind else line.removeprefix(f"{kind}: ")


def _machine_folders() -> list[str]:
    """Return the folders of Python, ROS and the grader, the longest path first."""
    own = os.path.dirname(os.path.abspath(__file__))
    folders = {own, sys.prefix, sys.base_prefix, sys.exec_prefix, os.getcwd(), *filter(os.path.isabs, sys.path)}
    # a short path such as /usr may also be a student's own text
    return sorted((f for f in folders if f.count("/") > 1), key=lambda f: (-len(f), f))
