"""Reads the tests that a rubric names: ids, titles and points, from the text of their file.

Nothing is imported and no test is collected by pytest: a rubric is read for each submission, and also where there is
neither ROS nor pytest, such as to judge kept recordings. What decides about ids and points therefore has to be written
out in the file; `grade rubric check` asks pytest whether it collects the same tests.
"""

from __future__ import annotations

import ast
import itertools
import re
from collections.abc import Iterator, Mapping, Sequence
from fractions import Fraction
from typing import Any

from pydantic_core import PydanticCustomError

from grader.grading.rubrics.own_checks import OwnFile
from grader.grading.rubrics.types import read_points
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.wording import printable

#: Most tests in a file, with those that parametrisation makes: each is a run of its own.
MOST_TESTS = 200
_POINTS = "expected @pytest.mark.points(N) above the test, with its points, found none"
#: Markers with which a test would not be judged, or not once.
_REFUSED = {
    "skip": "a criterion is judged for every submission",
    "skipif": "a criterion is judged for every submission",
    "xfail": "a criterion is met when its test passes",
}
_KEYS = ("hint", "needs")


@dataclass(frozen=True, slots=True)
class AuthoredTest:
    """A test that is a criterion."""

    id: str  # the id of the criterion
    name: str  # what pytest calls it within the file, such as `test_stops[0.5]` or `TestStop::test_wall`
    title: str
    points: Fraction
    line: int
    hint: str = ""
    needs: tuple[str, ...] = ()  # ids of criteria


class _MistakeError(Exception):
    """A mistake at a line of the file."""

    def __init__(self, node: ast.expr | ast.stmt, text: str) -> None:
        super().__init__(text)
        self.line = node.lineno


def tests_in(file: OwnFile) -> tuple[AuthoredTest, ...]:
    """Return the tests of a file in its order; raises RubricError with every mistake, each with its line."""
    where = printable(str(file.path), 500)
    try:
        tree = ast.parse(file.content)
    except (SyntaxError, ValueError, RecursionError) as error:
        text = f"{where}:{getattr(error, 'lineno', None) or 1}: expected Python, found {type(error).__name__}"
        raise RubricError(f"{text}: {printable(str(getattr(error, 'msg', error)), 200)}") from None
    problems: list[str] = []
    found: list[AuthoredTest] = []
    for holder, function in _functions(tree, problems, where):
        try:
            found += _tests(holder, function)
        except _MistakeError as mistake:
            problems.append(f"{where}:{mistake.line}: `{printable(function.name)}`: {mistake}")
    known: dict[str, AuthoredTest] = {}
    for test in found:
        other = known.setdefault(test.id, test)
        if other is not test:
            text = f"expected tests with different ids, found `{test.id}` for {printable(other.name)}, "
            text += f"line {other.line}, too"
            problems.append(f"{where}:{test.line}: `{printable(test.name)}`: {text}")
    if not found and not problems:
        problems.append(f"{where}:1: expected tests, which are functions whose names begin with test_, found none")
    if len(found) > MOST_TESTS:
        problems.append(f"{where}:1: expected at most {MOST_TESTS} tests, found {len(found)}")
    if problems:
        raise RubricError("\n".join(problems))
    return tuple(found)


def _functions(
    tree: ast.Module, problems: list[str], where: str
) -> Iterator[tuple[ast.ClassDef | None, ast.FunctionDef]]:
    """Yield the test functions with their class; what pytest would collect in another way is a problem."""
    holders = [node for node in tree.body if isinstance(node, ast.ClassDef) and node.name.startswith("Test")]
    problems += [
        f"{where}:{holder.lineno}: `{printable(holder.name)}`: expected a class of tests without bases"
        for holder in holders
        if holder.bases
    ]
    for node in ast.walk(tree):
        marks = dict(_marks(node)) if isinstance(node, ast.FunctionDef) else {}
        if "fixture" in marks and any(keyword.arg == "params" for keyword in getattr(marks["fixture"], "keywords", ())):
            text = "expected a fixture without params, so that each test has one id: write parametrize above the tests"
            problems.append(f"{where}:{getattr(node, 'lineno', 1)}: {text}")
    for holder, body in ((None, tree.body), *((holder, holder.body) for holder in holders if not holder.bases)):
        for node in body:
            if isinstance(node, ast.AsyncFunctionDef) and node.name.startswith("test"):
                problems.append(f"{where}:{node.lineno}: `{printable(node.name)}`: expected `def`, found `async def`")
            if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
                yield holder, node


def _marks(node: ast.FunctionDef | ast.ClassDef) -> Iterator[tuple[str, ast.expr]]:
    """Yield the name of each marker of pytest above a function or class, nearest first, and what is written there."""
    for decorator in reversed(node.decorator_list):
        name = ast.unparse(decorator.func if isinstance(decorator, ast.Call) else decorator)
        match = re.fullmatch(r"(?:pytest\.)?(?:mark\.(\w+)|(fixture))", name)
        if match is not None:
            yield match[1] or match[2], decorator


def _tests(holder: ast.ClassDef | None, function: ast.FunctionDef) -> Iterator[AuthoredTest]:
    marks = [*_marks(function), *(_marks(holder) if holder is not None else ())]
    for name, node in marks:
        if name in _REFUSED:
            raise _MistakeError(node, f"expected no @pytest.mark.{name}: {_REFUSED[name]}")
        if name == "ros" and any(keyword.arg == "seeds" for keyword in getattr(node, "keywords", ())):
            raise _MistakeError(node, "expected no `seeds`: everything is drawn from the seed of the submission")
    own = next((node for name, node in marks if name == "points"), None)
    cases = [_cases(node) for name, node in marks if name == "parametrize"]
    begin = f"{holder.name}::{function.name}" if holder is not None else function.name
    first = (ast.get_docstring(function) or "").strip().partition("\n")[0]
    title = first.strip().rstrip(".") or _in_words(function.name)
    for parts in itertools.product(*cases):
        case = "-".join(id_ for id_, _ in parts)
        name = f"{begin}[{case}]" if parts else begin
        marked = next((node for _, node in parts if node is not None), own)
        if marked is None:
            raise _MistakeError(function, _POINTS)
        points, others = _given(marked)
        id_ = re.sub(r"[^a-z0-9_]", "_", name.removesuffix("]").lower())
        yield AuthoredTest(id_, name, f"{title} ({case})" if parts else title, points, function.lineno, **others)


def _in_words(name: str) -> str:
    words = name.removeprefix("test").strip("_").replace("_", " ")
    return words[:1].upper() + words[1:] or name


def _given(node: ast.expr) -> tuple[Fraction, Mapping[str, Any]]:
    """Return points, and hint and needs, from a marker."""
    if not isinstance(node, ast.Call) or len(node.args) != 1:
        raise _MistakeError(node, "expected the points as in @pytest.mark.points(3)")
    try:
        points = read_points(_literal(node.args[0], 'points as a number such as 3, or a text such as "1/3"'))
    except PydanticCustomError as error:
        raise _MistakeError(node, f"expected {(error.context or {})['expected']}") from None
    given: dict[str, Any] = {}
    for keyword in node.keywords:
        if keyword.arg not in _KEYS:
            raise _MistakeError(node, f"expected {' or '.join(_KEYS)} beside the points, found `{keyword.arg}`")
        value = _literal(keyword.value, f"{keyword.arg} as a text")
        several = tuple(value) if keyword.arg == "needs" and isinstance(value, (list, tuple)) else (value,)
        if not all(isinstance(one, str) and one.strip() for one in several):
            raise _MistakeError(node, f"expected {keyword.arg} as a text")
        given[keyword.arg] = several if keyword.arg == "needs" else " ".join(several[0].split())
    return points, given


def _literal(node: ast.expr, expected: str) -> Any:
    try:
        return ast.literal_eval(node)
    except (ValueError, TypeError, SyntaxError, RecursionError, MemoryError):
        raise _MistakeError(
            node, f"expected {expected}, written out, found {printable(ast.unparse(node), 60)}"
        ) from None


def _cases(node: ast.expr) -> Sequence[tuple[str, ast.expr | None]]:
    """Return the id of each case of a parametrisation as pytest makes it, with the marker of its own points."""
    if not isinstance(node, ast.Call) or len(node.args) < 2:
        raise _MistakeError(node, "expected names and values in @pytest.mark.parametrize")
    names = _literal(node.args[0], "the names")
    several = [one.strip() for one in names.split(",")] if isinstance(names, str) else [str(one) for one in names]
    ids = next((keyword.value for keyword in node.keywords if keyword.arg == "ids"), None)
    given = None if ids is None else _literal(ids, "ids as a list of texts")
    if given is not None and not (isinstance(given, (list, tuple)) and all(isinstance(one, str) for one in given)):
        raise _MistakeError(node, "expected ids as a list of texts")
    values = node.args[1]
    if not isinstance(values, (ast.List, ast.Tuple)):
        if given is None:
            raise _MistakeError(node, "expected a list of values that is written out, or ids for values that are not")
        found: list[tuple[str, ast.expr | None]] = [(_plain(one, node), None) for one in given]
    else:
        if given is not None and len(given) != len(values.elts):
            raise _MistakeError(node, f"expected {len(values.elts)} ids, found {len(given)}")
        found = [_case(several, value, n, given) for n, value in enumerate(values.elts)]
    repeated = [id_ for n, (id_, _) in enumerate(found) if id_ in [other for other, _ in found[:n]]]
    if repeated:
        raise _MistakeError(
            node, f"expected values with different ids, found `{printable(repeated[0])}` again: give them ids"
        )
    if not found:
        raise _MistakeError(node, "expected at least one value")
    return found


def _case(
    names: Sequence[str], value: ast.expr, number: int, given: Sequence[str] | None
) -> tuple[str, ast.expr | None]:
    points: ast.expr | None = None
    id_ = None if given is None else given[number]
    parts = [value]
    if isinstance(value, ast.Call) and ast.unparse(value.func) in ("pytest.param", "param"):
        own = {keyword.arg: keyword.value for keyword in value.keywords}
        id_ = _literal(own["id"], "an id as a text") if "id" in own else id_
        marks = own.get("marks")
        for mark in marks.elts if isinstance(marks, (ast.List, ast.Tuple)) else [marks] if marks is not None else []:
            name = ast.unparse(mark.func if isinstance(mark, ast.Call) else mark).rpartition(".")[2]
            if name in _REFUSED:
                raise _MistakeError(value, f"expected no mark {name}: {_REFUSED[name]}")
            points = mark if name == "points" else points
        parts = value.args
    elif len(names) > 1 and isinstance(value, (ast.List, ast.Tuple)):
        parts = value.elts
    if id_ is not None:
        return _plain(str(id_), value), points
    return "-".join(_id_of(name, part, number) for name, part in zip(names, parts, strict=False)), points


def _id_of(name: str, value: ast.expr, number: int) -> str:
    found = _literal(value, "a value")
    if isinstance(found, str):
        return _plain(found, value)
    return str(found) if isinstance(found, (bool, int, float, complex, type(None))) else f"{name}{number}"


def _plain(text: str, node: ast.expr) -> str:
    """Return a text that pytest writes in ids as it is; raises _MistakeError for one that it would escape."""
    if not (text.isascii() and text.isprintable() and "\\" not in text and text):
        raise _MistakeError(
            node, f"expected an id of printable ASCII characters, found {printable(text, 60)}: give it another"
        )
    return text
