"""Loads a rubric's own checks: Python files beside a rubric, which names them; they run in the judging process."""

from __future__ import annotations

import ast
import copyreg
import dataclasses
import hashlib
import inspect
import re
import sys
import traceback
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from grader.core.errors import RubricError
from grader.rubrics.check_parameters import choice_model
from grader.submissions.collected import shown

#: Largest file of checks, in bytes.
MAX_BYTES = 256 * 1024
#: Name of the table in such a file.
TABLE = "CHECKS"
_ID = re.compile(r"[a-z][a-z0-9_]*")
_ALONE = "a file of checks may import the standard library, grader and what is installed, but no file beside it"


@dataclass(frozen=True, slots=True)
class OwnFile:
    """A file that a rubric brings, with its name as written in the rubric: relative to it, with `/`."""

    name: str
    path: Path
    content: bytes


def own_files(rubric: Path, names: Sequence[str], never_in: Sequence[Path] = ()) -> tuple[OwnFile, ...]:
    """Return the check files and provided files that a rubric names, without running them.

    Raises:
        RubricError: A file is missing, too large, neither in the rubric's folder nor below, or in one of the folders
            `never_in`, which students write to.
    """
    return tuple(_own_file(rubric, name, never_in) for name in dict.fromkeys(names))


def named_files(data: object) -> tuple[str, ...]:
    """Return the check files named in a rubric's data; the rubric's shape reports anything else."""
    return _named(data, "checks")


def provided_files(data: object) -> tuple[str, ...]:
    """Return the provided files named in a rubric's data; the rubric's shape reports anything else."""
    return _named(data, "provided")


def _named(data: object, key: str) -> tuple[str, ...]:
    names = data.get(key) if isinstance(data, Mapping) else None
    return tuple(name for name in names if isinstance(name, str)) if isinstance(names, list) else ()


def load(files: Sequence[OwnFile], known: Mapping[str, type]) -> dict[str, type]:
    """Run check files, and return their checks by name, none of which is in `known`; raises RubricError."""
    found: dict[str, type] = {}
    for file in files:
        table = _table(file)
        problems = list(_problems(file, table, {**known, **found}))
        if problems:
            raise RubricError("\n".join(problems))
        found |= table
    return found


def digest_of(rubric: bytes, files: Sequence[OwnFile]) -> str:
    """Return the `sha256:` digest of a rubric and its check files; without such files, that of the rubric alone."""
    digest = hashlib.sha256(rubric)
    for file in files:
        digest.update(f"\0{file.name}\0{len(file.content)}\0".encode() + file.content)
    return f"sha256:{digest.hexdigest()}"


def _own_file(rubric: Path, name: str, never_in: Sequence[Path]) -> OwnFile:
    path = rubric.parent / name
    where = f"{shown(str(rubric), 500)}: {shown(name)}"
    try:
        real = path.resolve(strict=True)
        inside = real.is_relative_to(rubric.parent.resolve()) and real.is_file()
        content = real.read_bytes() if inside and real.stat().st_size <= MAX_BYTES else b""
        theirs = [folder for folder in never_in if folder.is_dir() and real.is_relative_to(folder.resolve())]
    except FileNotFoundError:
        raise RubricError(f"{where}: expected a file beside the rubric, found nothing there") from None
    except (OSError, ValueError) as error:
        raise RubricError(f"{where}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not inside:
        raise RubricError(f"{where}: expected a file in the rubric's folder, found one that is not")
    if theirs:
        text = f"{where}: expected a file that students cannot write, found one in {shown(str(theirs[0]))}"
        raise RubricError(text, "keep rubrics and their checks apart from submissions")
    if not content:
        raise RubricError(f"{where}: expected 1 byte to {MAX_BYTES // 1024} KiB, found none or more")
    return OwnFile(name, path, content)


def _table(file: OwnFile) -> dict[str, Any]:
    """Run a file and return its table; raises RubricError with the line that failed."""
    where = shown(str(file.path), 500)
    try:
        module = _module(str(file.path.resolve()), file.content)
    except (Exception, SystemExit) as error:  # whatever the author's file raises, the author has to fix
        text = f"{where}:{_line_of(error, file)}: expected a file that can be imported, found "
        text += f"{type(error).__name__}: {shown(_words(error), 200)}"
        raise RubricError(text, _ALONE if isinstance(error, ImportError) else "") from None
    table = getattr(module, TABLE, None)
    if not isinstance(table, dict) or not table:
        found = "none" if table is None else "an empty one" if table == {} else f"a {type(table).__name__}"
        raise RubricError(f'{where}:1: expected a table {TABLE} = {{"name": Class}}, found {found}')
    return table


def _words(error: BaseException) -> str:
    return str(error.msg) if isinstance(error, SyntaxError) else str(error)


def _line_of(error: BaseException, file: OwnFile) -> int:
    """Return the line of a file in which an error arose, or that led to it."""
    path = str(file.path.resolve())
    if isinstance(error, SyntaxError) and error.filename == path:
        return error.lineno or 1
    lines = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == path]
    return (lines[-1] if lines else None) or 1


def _module(path: str, content: bytes) -> ModuleType:
    """Return the module of a file; the same file with the same content runs once per process."""
    digest = hashlib.sha256(path.encode("utf-8", "surrogateescape") + b"\0" + content).hexdigest()
    name = f"_own_checks_{digest[:24]}"
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
    for kind in vars(module).values():
        if isinstance(kind, type) and kind.__module__ == name and dataclasses.is_dataclass(kind):
            copyreg.pickle(kind, _reduced)
    return module


def _reduced(value: Any) -> tuple[Any, ...]:
    """Return how another process recreates a value of such a class; it has to run the file first."""
    module = sys.modules[type(value).__module__]
    given = {field.name: getattr(value, field.name) for field in dataclasses.fields(value) if field.init}
    return _remade, (module.__file__, vars(module)["__content__"], type(value).__qualname__, given)


def _remade(path: str, content: bytes, name: str, given: Mapping[str, object]) -> Any:
    return getattr(_module(path, content), name)(**given)


def _problems(file: OwnFile, table: Mapping[str, object], taken: Mapping[str, type]) -> Iterator[str]:
    """Yield what prevents the entries of a table from being checks, each with its place."""
    where = shown(str(file.path), 500)
    lines = _lines(file.content)
    for name, kind in table.items():
        line = lines.get(f"key {name}", 1)
        if not isinstance(name, str) or _ID.fullmatch(name) is None:
            wrong = "expected a name of small letters, digits and _, a letter first"
            yield f"{where}:{line}: {wrong}, found `{shown(str(name))}`"
        elif name in taken:
            yield f"{where}:{line}: expected a name of its own, found `{name}`, which is taken"
        elif wrong := _no_check(kind):
            class_line = lines.get(f"class {kind.__name__}", line) if isinstance(kind, type) else line
            yield f"{where}:{class_line}: `{name}`: {wrong}"


def _no_check(kind: object) -> str:
    """Return why something is not a check; empty if it is one."""
    if not isinstance(kind, type) or not dataclasses.is_dataclass(kind):
        return "expected a frozen dataclass, found something else"
    if not vars(kind)["__dataclass_params__"].frozen:
        return "expected a frozen dataclass, found one that can change: write @dataclass(frozen=True)"
    judge: Any = getattr(kind, "judge", None)
    try:
        inspect.signature(judge).bind(None, None)  # raises TypeError if it cannot be called
    except (TypeError, ValueError):
        return "expected a method judge(self, trace), found none that takes a trace"
    try:
        choice_model("Check", "", {"own": kind})
    except Exception as error:  # an annotation may be anything, and may name something undefined
        return f"expected parameters that a rubric can hold, found {type(error).__name__}: {shown(str(error), 200)}"
    return ""


def _lines(content: bytes) -> dict[str, int]:
    """Return the line of each class, and of each key in the table."""
    found: dict[str, int] = {}
    for node in ast.walk(ast.parse(content)):
        if isinstance(node, ast.ClassDef):
            found[f"class {node.name}"] = node.lineno
        elif isinstance(node, ast.Dict):
            found |= {f"key {k.value!s}": k.lineno for k in node.keys if isinstance(k, ast.Constant)}
    return found
