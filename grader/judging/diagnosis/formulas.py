"""Causes behind values that follow another formula: what is counted, where it starts, and when it is put in."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.judging.checks.functions import FieldFunction
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.fields import given_leaf
from grader.judging.source import Source, chain, first_line


def _asked(case: Case) -> tuple[Source, FieldFunction] | None:
    check = case.criterion.check
    if not isinstance(check, FieldFunction) or case.source is None or case.fault is not None:
        return None
    return case.source, check


def _first_values(case: Case) -> list[object]:
    values = case.evidence("first_values")
    return list(values) if isinstance(values, (list, tuple)) else []


def _set_too_late(case: Case) -> Clue | None:
    """The field is given its value after the message has been published."""
    found = _asked(case)
    values = _first_values(case)
    if found is None or len(values) < 2 or any(value != 0 for value in values):
        return None
    source, check = found
    for given in given_leaf(source, check.field.rpartition(".")[2]):
        function = source.function_of(given)
        name = _message_of(given)
        early = [c for c in source.calls("publish") if source.function_of(c) is function and _publishes(c, name)]
        if function is not None and early and all(first_line(c) < first_line(given) for c in early):
            hint = f"{source.code(given)} comes after {source.code(early[0])}: set the field first, then publish"
            return Clue(hint, source.place(given))
    return None


def _message_of(given: ast.AST) -> str:
    targets = given.targets if isinstance(given, ast.Assign) else []
    return next((chain(t.value) for t in targets if isinstance(t, ast.Attribute)), "")


def _publishes(call: ast.Call, name: str) -> bool:
    return bool(name) and any(chain(argument) == name for argument in call.args)


def _stuck(case: Case) -> Clue | None:
    """What is counted never changes."""
    found = _asked(case)
    values = _first_values(case)
    if found is None or len(values) < 2 or len(set(map(repr, values))) > 1:
        return None
    source, check = found
    for counter in _counters(source, check.field.rpartition(".")[2]):
        stores = [s for s in source.stores(counter) if _name_of(source.function_of(s)) != "__init__"]
        if not stores:
            return Clue(f"{counter} never changes: write {counter} += 1 after each message")
    return None


def _wrong_start(case: Case) -> Clue | None:
    """The count starts at another number than 0, or is raised before it is used."""
    found = _asked(case)
    problem = case.verdict.problem
    if found is None or problem is None or problem.start is None:
        return None
    start = str(problem.start)
    source, check = found
    for counter in _counters(source, check.field.rpartition(".")[2]):
        for store in source.stores(counter):
            statement = source.parents.get(store)
            value = getattr(statement, "value", None)
            if isinstance(statement, ast.Assign) and isinstance(value, ast.Constant) and str(value.value) == start:
                hint = f"{source.code(statement)} starts the count at {start}: the first message is n = 0"
                return Clue(hint, source.place(statement))
            if isinstance(statement, ast.AugAssign) and start == "1" and _used_later(source, statement, counter):
                hint = f"{source.code(statement)} comes before the value is computed: count after it"
                return Clue(hint, source.place(statement))
    return None


def _used_later(source: Source, statement: ast.AST, counter: str) -> bool:
    function = source.function_of(statement)
    loads = [n for n in source.all(ast.Attribute) if isinstance(n.ctx, ast.Load) and chain(n) == counter]
    lines = [first_line(n) for n in loads if source.function_of(n) is function]
    return bool(lines) and min(lines) > first_line(statement)


def _counters(source: Source, leaf: str) -> Iterator[str]:
    """Yield the attributes of the node that a field's value is computed from, also by way of one local name."""
    for given in given_leaf(source, leaf):
        value = getattr(given, "value", None)
        if not isinstance(value, ast.expr):
            continue
        yield from _attributes(value)
        for local in [n.id for n in ast.walk(value) if isinstance(n, ast.Name)]:
            for statement in source.all(ast.Assign):
                same = source.function_of(statement) is source.function_of(given)
                if same and any(chain(target) == local for target in statement.targets):
                    yield from _attributes(statement.value)


def _attributes(value: ast.expr) -> Iterator[str]:
    for node in ast.walk(value):
        if isinstance(node, ast.Attribute) and chain(node).startswith("self.") and chain(node).count(".") == 1:
            yield chain(node)


def _name_of(function: object) -> str:
    return str(getattr(function, "name", ""))


FORMULAS = (
    Cause("set_after_publishing", _set_too_late),
    Cause("counter_never_changes", _stuck),
    Cause("count_starts_elsewhere", _wrong_start),
)
