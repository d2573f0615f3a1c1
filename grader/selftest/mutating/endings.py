"""Operators after which a program is right at first, and wrong later."""

from __future__ import annotations

from collections.abc import Iterator

import libcst as cst

from grader.selftest.mutating.bodies import alone, at_top, owner
from grader.selftest.mutating.program import Change, Edit, Program, called, short, statement

_COUNT = "{owner}.calls_so_far = getattr({owner}, 'calls_so_far', 0) + 1"
LATER = 10


def exits_later(program: Program) -> Iterator[Change]:
    """A program that ends after a while."""
    for function in program.callbacks:
        yield _after(function, LATER, "raise SystemExit", "exits")


def crashes_on_third(program: Program) -> Iterator[Change]:
    """An error that comes with the third call of a callback."""
    for function in program.callbacks:
        yield _after(function, 2, "raise RuntimeError('the third time')", "raises")


def stops_later(program: Program) -> Iterator[Change]:
    """A callback that does nothing any more after a while."""
    for function in program.callbacks:
        yield _after(function, LATER, "return", "does nothing")


def frozen_value(program: Program) -> Iterator[Change]:
    """A value or message that is made once and used for ever."""
    for function in program.callbacks:
        for assign in program.all(cst.Assign, function):
            target, value = assign.targets[0].target, assign.value
            own = isinstance(target, (cst.Name, cst.Attribute)) and alone(program, assign)
            if own and not isinstance(value, (cst.Integer, cst.Float, cst.SimpleString)):
                yield Change(assign, f"once {short(program.code(assign))}", _kept(program, function, value))
        for call in program.all(cst.Call, function):
            if called(call) == "publish" and call.args and isinstance(call.args[0].value, cst.Call):
                value = call.args[0].value
                yield Change(call, f"once {short(program.code(value))}", _kept(program, function, value))


def first_message_only(program: Program) -> Iterator[Change]:
    """A message received that is kept for ever: only the first one counts."""
    for function in program.handed_to("create_subscription"):
        parameter = function.params.params[-1].name.value if function.params.params else ""
        if parameter and parameter != "self":
            place = f"{owner(function)}.first_heard"
            text = f"{place} = {parameter} = getattr({owner(function)}, 'first_heard', {parameter})"
            yield Change(function, f"{function.name.value} keeps the first {parameter}", at_top(function, text))


def one_behind(program: Program) -> Iterator[Change]:
    """A message that is used when the next one comes: always one behind."""
    for function in program.handed_to("create_subscription"):
        parameter = function.params.params[-1].name.value if function.params.params else ""
        if parameter and parameter != "self":
            own = owner(function)
            text = f"{own}.heard, {parameter} = {parameter}, getattr({own}, 'heard', {parameter})"
            yield Change(function, f"{function.name.value} uses the {parameter} before", at_top(function, text))


def _after(function: cst.FunctionDef, calls: int, then: str, word: str) -> Change:
    own = owner(function)
    counted = statement(_COUNT.format(owner=own))
    stop = statement(f"if {own}.calls_so_far > {calls}:\n    {then}\n")
    edits: tuple[Edit, ...] = ()
    for line, new in at_top(function, "pass"):
        first = list(new)[-1] if isinstance(new, cst.FlattenSentinel) else line
        edits = ((line, cst.FlattenSentinel([counted, stop, first])),)
    return Change(function, f"{function.name.value} {word} after {calls} calls", edits)


def _kept(program: Program, function: cst.FunctionDef, value: cst.BaseExpression) -> tuple[Edit, ...]:
    """Return the edit by which an expression has the value that it had at first."""
    own, name = owner(function), f"kept_{program.line(value)}"
    text = f"{own}.__dict__.setdefault('{name}', {program.code(value)})"
    return ((value, cst.parse_expression(text)),)
