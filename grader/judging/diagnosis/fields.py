"""Causes behind wrong numbers in a message: the assignment that puts them there, or that is missing."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping
from dataclasses import dataclass

from grader.core.trace import Message
from grader.judging.checks.topics import FieldValues
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import Constant, constant
from grader.judging.diagnosis.wiring import made_for
from grader.judging.source import Source, chain, first_line, last_name
from grader.judging.values import field, leaves, published
from grader.judging.wording import moment, number


@dataclass(frozen=True, slots=True)
class _Given:
    """One place that gives a field a value: the whole of it, the value, and the number where the text tells it."""

    node: ast.AST
    value: ast.expr
    worth: Constant | None


@dataclass(frozen=True, slots=True)
class _Wrong:
    """The first message that differs, and its wrong fields with what is in them."""

    source: Source
    message: Message
    wanted: Mapping[str, float]
    found: Mapping[str, float]


def _wrong(case: Case) -> _Wrong | None:
    check = case.criterion.check
    if not isinstance(check, FieldValues) or case.source is None or case.fault is not None:
        return None
    for message in published(case.trace, check.topic):
        got = {path: field(message.value, path) for path in check.values}
        wrong = {p: g for p, g in got.items() if g is not None and not _is(g, check.values[p])}
        if wrong:
            return _Wrong(case.source, message, check.values, wrong)
    return None


def _is(got: float, want: float) -> bool:
    return math.isclose(got, want, rel_tol=1e-6, abs_tol=1e-6)


def given(source: Source, path: str) -> list[_Given]:
    """Return the places that give a field such as `linear.x` a value, assignments and keyword arguments."""
    group, _, leaf = path.partition(".")
    pairs = (p for s in source.all(ast.Assign) for p in _assigned(s))
    found = [_Given(s, v, constant(source, v)) for s, t, v in pairs if chain(t).endswith(f".{path}")]
    for call in source.all(ast.Call):
        around = source.parents.get(call)
        outer = around.arg if isinstance(around, ast.keyword) else ""
        whole = isinstance(around, ast.Assign) and any(chain(t).endswith(f".{group}") for t in around.targets)
        own = [k for k in call.keywords if k.arg == leaf and (outer == group or whole)]
        found += [_Given(k, k.value, constant(source, k.value)) for k in own]
    return sorted(found, key=lambda g: first_line(g.node))


def _assigned(statement: ast.Assign) -> Iterator[tuple[ast.Assign, ast.expr, ast.expr]]:
    """Yield statement, target and value of an assignment; those of `a, b = 1, 2` one by one."""
    for target in statement.targets:
        value = statement.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            yield from ((statement, t, v) for t, v in zip(target.elts, value.elts, strict=True))
        else:
            yield statement, target, value


def given_leaf(source: Source, leaf: str) -> list[ast.AST]:
    """Return the assignments and keyword arguments that give a plain field such as `data` a value."""
    found: list[ast.AST] = []
    for statement in source.all(ast.Assign):
        attributes = [t for t in statement.targets if isinstance(t, ast.Attribute) and t.attr == leaf]
        if any(not chain(t).startswith("self.") or chain(t).count(".") > 1 for t in attributes):
            found.append(statement)
    keywords = (k for c in source.all(ast.Call) for k in c.keywords)
    return found + [k for k in keywords if k.arg == leaf]


def _place_of(got: _Given) -> ast.AST:
    """Return the node to point at: where the number is written down, if it has a name of its own."""
    named = got.worth is not None and isinstance(got.value, (ast.Name, ast.Attribute))
    return got.worth.origin if named and got.worth is not None else got.node


def _misplaced(case: Case) -> Clue | None:
    """The right numbers stand in the wrong fields."""
    wrong = _wrong(case)
    if wrong is None:
        return None
    numbers = leaves(wrong.message.value)
    for path, value in wrong.found.items():
        want = wrong.wanted[path]
        there = [
            p for p, v in numbers.items() if p != path and _is(v, want) and not _is(wrong.wanted.get(p, 0.0), want)
        ]
        if _is(want, 0.0) or len(there) != 1:
            continue
        places = [g for g in given(wrong.source, there[0]) if g.worth is None or _is(g.worth.value, want)]
        mine = [g for g in given(wrong.source, path) if g.worth is None or _is(g.worth.value, value)]
        # a number that is both here and elsewhere was exchanged; else it went astray
        chosen = mine if mine and not _is(value, 0.0) else places
        if len(chosen) != 1:
            continue
        if chosen is mine and numbers.get(there[0]) is not None and _exchanged(case, path, there[0], value):
            hint = f"{path} and {there[0]} are exchanged: {wrong.source.code(chosen[0].node)} must get {number(want)}"
            return Clue(hint, wrong.source.place(chosen[0].node), key="exchanged")
        if chosen is not places:
            return None
        hint = f"{wrong.source.code(chosen[0].node)} puts {number(want)} into {there[0]}: it belongs in {path}"
        return Clue(hint, wrong.source.place(chosen[0].node), key=f"astray:{first_line(chosen[0].node)}")
    return None


def _exchanged(case: Case, path: str, other: str, value: float) -> bool:
    """Return whether the value found in one field is the one that the exercise wants in the other."""
    return any(
        other in check.values and _is(check.values[other], value)
        for check in case.siblings
        if isinstance(check, FieldValues) and path not in check.values
    ) or (
        isinstance(case.criterion.check, FieldValues) and _is(case.criterion.check.values.get(other, math.nan), value)
    )


def _strayed(case: Case) -> Clue | None:
    """A field that must be zero holds what the exercise wants in another."""
    wrong = _wrong(case)
    if wrong is None:
        return None
    numbers = leaves(wrong.message.value)
    others = {p: v for check in case.siblings if isinstance(check, FieldValues) for p, v in check.values.items()}
    for path, value in wrong.found.items():
        homes = [p for p, v in others.items() if _is(v, value) and p in numbers and not _is(numbers[p], v)]
        places = [g for g in given(wrong.source, path) if g.worth is not None and _is(g.worth.value, value)]
        if _is(wrong.wanted[path], 0.0) and len(homes) == 1 and len(places) == 1:
            hint = f"{wrong.source.code(places[0].node)} puts {number(value)} into {path}: it belongs in {homes[0]}"
            return Clue(hint, wrong.source.place(places[0].node), key=f"astray:{first_line(places[0].node)}")
    return None


def _sometimes(case: Case) -> Clue | None:
    """The field gets the right number, but not for every message."""
    wrong = _wrong(case)
    if wrong is None:
        return None
    source = wrong.source
    for path, want in wrong.wanted.items():
        places = given(source, path)
        if (
            path not in wrong.found
            or len(places) != 1
            or places[0].worth is None
            or not _is(places[0].worth.value, want)
        ):
            continue
        code = source.code(places[0].node)
        test = next((n for n in source.around(places[0].node) if isinstance(n, ast.If)), None)
        sends = list(source.calls("publish"))
        beyond = any(test not in set(source.around(c)) for c in sends)
        if test is not None and source.function_of(test) is not None and beyond:
            hint = f"{code} runs only under 'if {source.code(test.test, 40)}': every message needs it"
            return Clue(hint, source.place(places[0].node), key=f"sometimes:{first_line(test)}")
        function = source.function_of(places[0].node)
        here = [c for c in sends if function is not None and source.function_of(c) is function]
        if here and all(first_line(c) < first_line(places[0].node) for c in here):
            hint = f"{code} comes after {source.code(here[0])}: set the fields before the message is sent"
            return Clue(hint, source.place(places[0].node), key=f"late:{first_line(here[0])}")
    return None


def _never_given(case: Case) -> Clue | None:
    """A field that the exercise asks for is not set at all."""
    wrong = _wrong(case)
    check = case.criterion.check
    if wrong is None or not isinstance(check, FieldValues):
        return None
    for path, value in wrong.found.items():
        want = wrong.wanted[path]
        if _is(want, 0.0) or value != 0.0 or given(wrong.source, path) or _touched(wrong.source, path):
            continue
        item = made_for(wrong.source, "publisher", check.topic)
        makers = list(wrong.source.calls(item.type)) if item is not None and item.type else []
        if len(makers) == 1:
            name = _message_name(wrong.source, makers[0])
            hint = f"{path} is never set and stays 0.0: add {name}.{path} = {number(want)}"
            return Clue(hint, wrong.source.place(makers[0]))
    return None


def _touched(source: Source, path: str) -> bool:
    """Return whether the text may set a field in a way that is not followed here."""
    group, _, leaf = path.partition(".")
    wholes = any(isinstance(n.ctx, ast.Store) and n.attr == group for n in source.all(ast.Attribute))
    aliases = any(last_name(s.value) == group for s in source.all(ast.Assign))
    keywords = any(k.arg in (group, leaf) for k in source.all(ast.keyword))
    return wholes or aliases or keywords or bool(list(source.calls("setattr", "deepcopy", "copy")))


def _message_name(source: Source, call: ast.Call) -> str:
    statement = source.parents.get(call)
    targets = statement.targets if isinstance(statement, ast.Assign) else []
    return (chain(targets[0]) if len(targets) == 1 else "") or "msg"


def _wrong_number(case: Case) -> Clue | None:
    """The one assignment of the field gives another number."""
    wrong = _wrong(case)
    if wrong is None:
        return None
    # the field that should hold something first, then the ones that should be zero
    for path in sorted(wrong.found, key=lambda p: _is(wrong.wanted[p], 0.0)):
        places = given(wrong.source, path)
        value, want = wrong.found[path], wrong.wanted[path]
        known = [g for g in places if g.worth is not None and _is(g.worth.value, value)]
        if len(known) == 1:
            return _number_clue(wrong.source, known[0], path, value, want)
        if len(places) == 1 and places[0].worth is None:
            hint = f"{wrong.source.code(places[0].node)} gives {number(value)} at {moment(wrong.message.t_ns)}"
            hint += f": {path} must be {number(want)} in every message"
            return Clue(hint, wrong.source.place(places[0].node))
    return None


def _number_clue(source: Source, got: _Given, path: str, value: float, want: float) -> Clue:
    place = _place_of(got)
    code = source.code(got.node)
    around = source.parents.get(place)
    if place is not got.node and isinstance(around, (ast.Assign, ast.AnnAssign)):
        code = source.code(around)
    if _is(value, -want):
        hint = f"{code} has the wrong sign: {path} is {number(want)}"
    elif "degrees" in source.code(got.value, 200):
        hint = f"{code} gives degrees: {path} is in rad/s, write {number(want)}"
    else:
        hint = f"{code} makes {path} {number(value)}: it must be {number(want)}"
    return Clue(hint, source.place(place))


FIELDS = (
    Cause("misplaced_field", _misplaced),
    Cause("strayed_value", _strayed),
    Cause("not_every_message", _sometimes),
    Cause("field_never_set", _never_given),
    Cause("wrong_number", _wrong_number),
)
