"""Reads what a rubric brings in files beside it: checks, hint rules, simulations, and definitions of messages.

Checks and hint rules run in the judging process. Simulations run in the worker, which gets the text of their file with
each plan.
"""

from __future__ import annotations

import ast
import dataclasses
import hashlib
import inspect
import re
from collections.abc import Callable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

from grader.grading.model.exercise import Outcome, ProblemKind
from grader.grading.rubrics.author_modules import OwnHints, module_of, rules_in
from grader.grading.rubrics.check_parameters import choice_model, simulation_shape
from grader.grading.rubrics.mistakes import nearest_hint
from grader.grading.rubrics.types import BESIDE
from grader.runtime.interfaces.definitions import files_in
from grader.runtime.model.author_files import error_words, line_of
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import printable
from grader.runtime.simulation import SIMULATIONS, Simulation, loading

#: Largest file of checks, in bytes.
MAX_BYTES = 256 * 1024
#: Name of the table in such a file.
TABLE = "CHECKS"
_ID = re.compile(r"[a-z][a-z0-9_]*")
_ALONE = "such a file may import the standard library, grader.api and what is installed, but no file next to it"


#: Most files of interface packages that a rubric may bring.
MOST_DEFINITIONS = 400
#: Most files in a recording, and the largest one in bytes: all travel to each machine of a cluster, and minutes of
#: laser scans take a few megabytes.
MOST_BAG_FILES = 20
#: The largest file of a recording; see above.
MOST_BAG_BYTES = 64 * 1024 * 1024


@dataclass(frozen=True, slots=True)
class OwnFile:
    """A file that a rubric brings, with its name relative to the rubric, with `/`."""

    name: str
    path: Path
    content: bytes


@dataclass(frozen=True, slots=True)
class OwnSimulation:
    """A class of simulations, and the file that holds it."""

    kind: type[Simulation]
    file: OwnFile


def own_files(
    rubric: Path, names: Sequence[str], never_in: Sequence[Path] = (), *, key: str = "checks"
) -> tuple[OwnFile, ...]:
    """Return files that a rubric names, without running them.

    Args:
        rubric: The rubric.
        names: Their names as written in it.
        never_in: Folders that students write to.
        key: The key that they stand under, for messages.

    Raises:
        RubricError: A file is missing, too large, neither in the rubric's folder nor below, or in one of the folders
            `never_in`, which students write to.
    """
    where = f"{printable(str(rubric), 500)}: {key}:"
    return tuple(beside_file(rubric, name, never_in, f"{where} {printable(name)}") for name in dict.fromkeys(names))


def definition_files(rubric: Path, folders: Sequence[str], never_in: Sequence[Path] = ()) -> tuple[OwnFile, ...]:
    """Return the definitions of messages, services and actions in the folders that a rubric names, sorted by name.

    Raises:
        RubricError: A folder holds none or too many, or a file cannot be used; see `own_files`.
    """
    found: list[OwnFile] = []
    for folder in dict.fromkeys(folders):
        paths = files_in([rubric.parent / folder])
        where = f"{printable(str(rubric), 500)}: interfaces:"
        if not 0 < len(paths) <= MOST_DEFINITIONS:
            text = f"{where} {printable(folder)}: expected a folder with 1 to {MOST_DEFINITIONS} definitions, found "
            raise RubricError(f"{text}{len(paths) or 'none'}", "a package has its files in folders msg, srv and action")
        names = [path.relative_to(rubric.parent).as_posix() for path in paths]
        found += [beside_file(rubric, name, never_in, f"{where} {printable(name)}", least=0) for name in names]
    return tuple(found)


def bag_files(rubric: Path, names: Sequence[str], never_in: Sequence[Path] = ()) -> tuple[OwnFile, ...]:
    """Return the files of the recordings that a rubric names, sorted by name.

    Raises:
        RubricError: A recording is missing, or has too many files or a file that cannot be used; see `own_files`.
    """
    found: list[OwnFile] = []
    for name in dict.fromkeys(names):
        path, where = rubric.parent / name, f"{printable(str(rubric), 500)}: recorded: {printable(name)}"
        files = sorted(file for file in path.iterdir() if file.is_file()) if path.is_dir() else [path]
        if not 0 < len(files) <= MOST_BAG_FILES:
            text = f"{where}: expected a recording of 1 to {MOST_BAG_FILES} files, found {len(files) or 'none'}"
            raise RubricError(text, "name a rosbag2 folder, or a .mcap or .db3 file")
        parts = [file.relative_to(rubric.parent).as_posix() for file in files]
        found += [beside_file(rubric, part, never_in, f"{where}", least=0, most=MOST_BAG_BYTES) for part in parts]
    return tuple(found)


def named_bags(data: object) -> tuple[str, ...]:
    """Return the recordings named by the stimuli in a rubric's data; the rubric's shape reports anything else."""
    scenarios = data.get("scenarios") if isinstance(data, Mapping) else None
    stimuli = [one.get("stimuli") for one in _mappings(scenarios)]
    played = [one.get("recorded") for several in stimuli for one in _mappings(several)]
    names = [one.get("bag") for one in _mappings(played)]
    return tuple(dict.fromkeys(name for name in names if isinstance(name, str) and re.fullmatch(BESIDE, name)))


def _mappings(value: object) -> list[Mapping[str, Any]]:
    return [one for one in value if isinstance(one, Mapping)] if isinstance(value, list) else []


def named_files(data: object, key: str) -> tuple[str, ...]:
    """Return the files or folders named under a key of a rubric's data; the rubric's shape reports anything else."""
    names = data.get(key) if isinstance(data, Mapping) else None
    names = [names] if isinstance(names, str) and key == "pytest" else names
    return tuple(name for name in names if isinstance(name, str)) if isinstance(names, list) else ()


def load_checks(files: Sequence[OwnFile], known: Mapping[str, type]) -> dict[str, type]:
    """Run check files, and return their checks by name, none of which is in `known`; raises RubricError."""
    found: dict[str, type] = {}
    for file in files:
        table = _table(file, TABLE, lambda f: vars(module_of(*_told(f))).get(TABLE))
        problems = list(_problems(file, table, {**known, **found}, _no_check))
        if problems:
            raise RubricError("\n".join(problems))
        found |= table
    return found


def load_simulations(files: Sequence[OwnFile]) -> dict[str, OwnSimulation]:
    """Run simulation files, and return their classes by name, none of which is built in; raises RubricError."""
    found: dict[str, OwnSimulation] = {}
    for file in files:
        table = _table(file, loading.TABLE, lambda f: loading.classes(f.name, f.content))
        problems = list(_problems(file, table, {**SIMULATIONS, **found}, _no_simulation))
        if problems:
            raise RubricError("\n".join(problems))
        found |= {name: OwnSimulation(kind, file) for name, kind in table.items()}
    return found


def load_hints(files: Sequence[OwnFile], known: Mapping[str, type]) -> OwnHints:
    """Run files with hint rules, and return their rules.

    Args:
        files: The files; one may hold checks too.
        known: The checks that the rubric may use, by name.

    Raises:
        RubricError: A file cannot be run, or has no rule; or a rule has the name of another one, names a check that
            does not exist, or cannot be asked.
    """
    if not files:
        return OwnHints()
    from grader.grading.judging.diagnosis import RULES  # noqa: PLC0415  most rubrics have no rules

    taken = {rule.id for rule in RULES}
    problems: list[str] = []
    for file in files:
        rules, where = _ran(file, lambda f: rules_in(*_told(f))), printable(str(file.path), 500)
        if not rules:
            text = f"{where}:1: expected hint rules, which are functions with @hint_rule(...) above them, found none"
            raise RubricError(text)
        for rule in rules:
            wrong = "expected a new name, found one that is taken" if rule.id in taken else _no_rule(rule, known)
            line = getattr(getattr(rule.function, "__code__", None), "co_firstlineno", 1)
            problems += [f"{where}:{line}: `{printable(rule.id)}`: {wrong}"] if wrong else []
            taken.add(rule.id)
    if problems:
        raise RubricError("\n".join(problems))
    return OwnHints(tuple(map(_told, files)))


def _told(file: OwnFile) -> tuple[str, bytes]:
    """Return where a file is, and its text."""
    return str(file.path.resolve()), file.content


def _no_rule(rule: Any, known: Mapping[str, type]) -> str:
    """Return why a rule cannot be asked; empty if it can."""
    unknown = next((name for name in rule.checks if isinstance(name, str) and name not in known), None)
    if unknown is not None:
        near = nearest_hint(unknown, known)
        return f"expected the name of a check, found `{printable(unknown)}`{f'; {near}' if near else ''}"
    parts = (
        ("priority", isinstance(rule.priority, int) and not isinstance(rule.priority, bool), "a whole number"),
        ("problem", isinstance(rule.problem, (ProblemKind, type(None))), "a ProblemKind"),
        ("outcome", isinstance(rule.outcome, (Outcome, type(None))), "an Outcome"),
        ("fault", isinstance(rule.fault, (bool, type(None))), "True, False or None"),
    )
    for name, right, expected in parts:
        if not right:
            return f"expected {expected} as {name}, found {printable(repr(getattr(rule, name)))}"
    try:
        inspect.signature(rule.function).bind(None)
    except (TypeError, ValueError):
        return "expected a function of one argument, the case, found another one"
    return ""


def rubric_digest(rubric: bytes, files: Sequence[OwnFile]) -> str:
    """Return the `sha256:` digest of a rubric and the files it brings; without such files, that of the rubric alone."""
    digest = hashlib.sha256(rubric)
    for file in files:
        digest.update(f"\0{file.name}\0{len(file.content)}\0".encode() + file.content)
    return f"sha256:{digest.hexdigest()}"


def beside_file(  # noqa: PLR0913  what to read, and its limits
    rubric: Path, name: str, never_in: Sequence[Path], where: str, least: int = 1, most: int = MAX_BYTES
) -> OwnFile:
    """Return one file; see `own_files`.

    Args:
        rubric: The rubric.
        name: Its name relative to the rubric.
        never_in: Folders that students write to.
        where: What names it, with which messages begin.
        least: The least bytes that it may have.
        most: The most bytes.
    """
    path = rubric.parent / name
    try:
        real = path.resolve(strict=True)
        inside = real.is_relative_to(rubric.parent.resolve()) and real.is_file()
        content = real.read_bytes() if inside and real.stat().st_size <= most else b""
        theirs = [folder for folder in never_in if folder.is_dir() and real.is_relative_to(folder.resolve())]
    except FileNotFoundError:
        raise RubricError(f"{where}: expected a file beside the rubric, found nothing there") from None
    except (OSError, ValueError) as error:
        raise RubricError(f"{where}: cannot be read: {getattr(error, 'strerror', None) or error}") from None
    if not inside:
        raise RubricError(f"{where}: expected a file in the rubric's folder, found one that is not")
    if theirs:
        text = f"{where}: expected a file that students cannot write, found one in {printable(str(theirs[0]))}"
        raise RubricError(text, "keep rubrics and what they bring apart from submissions")
    if not least <= len(content) or (not content and real.stat().st_size):
        raise RubricError(f"{where}: expected {least} byte to {most // 1024} KiB, found none or more")
    return OwnFile(name, path, content)


def _ran(file: OwnFile, run_: Callable[[OwnFile], Any]) -> Any:
    """Run a file and return what it gives; raises RubricError with the line that failed."""
    try:
        return run_(file)
    except (Exception, SystemExit) as error:  # whatever the author's file raises, the author has to fix
        line = max(line_of(error, str(file.path.resolve())), line_of(error, file.name))
        text = f"{printable(str(file.path), 500)}:{line}: expected a file that can be imported, found "
        text += f"{type(error).__name__}: {printable(error_words(error), 200)}"
        raise RubricError(text, _ALONE if isinstance(error, ImportError) else "") from None


def _table(file: OwnFile, name: str, ran: Callable[[OwnFile], object]) -> dict[str, Any]:
    """Run a file and return its table; raises RubricError with the line that failed."""
    where, table = printable(str(file.path), 500), _ran(file, ran)
    if not isinstance(table, dict) or not table:
        found = "none" if table is None else "an empty one" if table == {} else f"a {type(table).__name__}"
        raise RubricError(f'{where}:1: expected a table {name} = {{"name": Class}}, found {found}')
    return table


def _problems(
    file: OwnFile, table: Mapping[str, object], taken: Mapping[str, object], unfit: Callable[[object], str]
) -> Iterator[str]:
    """Yield what makes the entries of a table unfit, each with its place."""
    where = printable(str(file.path), 500)
    lines = _lines(file.content)
    for name, kind in table.items():
        line = lines.get(f"key {name}", 1)
        if not isinstance(name, str) or _ID.fullmatch(name) is None:
            wrong = "expected a name of lower-case letters, digits and _, starting with a letter"
            yield f"{where}:{line}: {wrong}, found `{printable(str(name))}`"
        elif name in taken:
            yield f"{where}:{line}: expected a new name, found `{name}`, which is taken"
        elif wrong := unfit(kind):
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
    return _no_parameters(lambda: choice_model("Check", "", {"own": kind}))


def _no_simulation(kind: object) -> str:
    """Return why something is not a simulation; empty if it is one."""
    if not isinstance(kind, type) or not issubclass(kind, Simulation):
        return "expected a class derived from grader.api.Simulation, found something else"
    if "__dataclass_fields__" not in vars(kind):
        return "expected a dataclass, found another class: write @dataclass above it"
    return _no_parameters(lambda: simulation_shape("own", kind))


def _no_parameters(make: Callable[[], object]) -> str:
    try:
        make()
    except Exception as error:  # an annotation may be anything, and may name something undefined
        return f"expected parameters that a rubric can hold, found {type(error).__name__}: {printable(str(error), 200)}"
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
