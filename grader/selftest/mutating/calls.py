"""Operators that forget a line, repeat it, or put it in the wrong place."""

from __future__ import annotations

from collections.abc import Iterator

import libcst as cst
from libcst import matchers as m

from grader.selftest.mutating.bodies import alone
from grader.selftest.mutating.program import CREATORS, LEVELS, Change, Program, argument, called, into, short

#: Statements that people repeat by accident, where that makes a difference.
_REPEATED = ("publish", "call_async", "call", *LEVELS)


def missing_call(program: Program) -> Iterator[Change]:
    """A call that is forgotten: publish, spin, init, super().__init__, create_timer, a log."""
    for node in program.all(cst.Expr):
        if isinstance(node.value, cst.Call) and alone(program, node):
            yield Change(node, f"no {short(program.code(node))}", ((node, cst.Pass()),))


def missing_assignment(program: Program) -> Iterator[Change]:
    """A value that is never set, a counter that never counts, a publisher that is never made."""
    for node in [*program.all(cst.Assign), *program.all(cst.AugAssign), *program.all(cst.AnnAssign)]:
        if alone(program, node) and not (isinstance(node, cst.AnnAssign) and node.value is None):
            yield Change(node, f"no {short(program.code(node))}", ((node, cst.Pass()),))


def missing_import(program: Program) -> Iterator[Change]:
    """An import that is forgotten."""
    for node in [*program.all(cst.Import), *program.all(cst.ImportFrom)]:
        if alone(program, node):
            yield Change(node, f"no {short(program.code(node))}", ((node, cst.Pass()),))


def missing_return(program: Program) -> Iterator[Change]:
    """A callback that does not return its response, a function that returns nothing."""
    for node in program.all(cst.Return):
        if node.value is not None:
            yield Change(node, f"no {short(program.code(node))}", ((node, cst.Pass()),))


def missing_early_return(program: Program) -> Iterator[Change]:
    """A `return`, `break` or `continue` that is forgotten: the function goes on."""
    bare = [node for node in program.all(cst.Return) if node.value is None]
    for node in [*bare, *program.all(cst.Break), *program.all(cst.Continue)]:
        yield Change(node, f"no {program.code(node)}", ((node, cst.Pass()),))


def missing_parameter(program: Program) -> Iterator[Change]:
    """A callback that does not take what it is given."""
    for function in program.callbacks:
        params = function.params.params
        if params:
            kept = function.params.with_changes(params=_without_comma(params[:-1]))
            detail = f"{function.name.value} without {params[-1].name.value}"
            yield Change(function, detail, ((function.params, kept),))


def callback_called(program: Program) -> Iterator[Change]:
    """A callback that is called where it should be named: `self.tick()` for `self.tick`."""
    for call in program.calls(*CREATORS):
        arg = argument(call, "callback")
        if arg is not None and not isinstance(arg.value, (cst.Lambda, cst.Call)):
            after = cst.Call(arg.value)
            yield Change(call, into(program.code(arg.value), program.code(after)), ((arg.value, after),))


def timer_once(program: Program) -> Iterator[Change]:
    """A callback that is called once instead of by a timer."""
    for node in program.all(cst.Call):
        callback = argument(node, "callback") if called(node) == "create_timer" else None
        if callback is not None and isinstance(callback.value, (cst.Name, cst.Attribute)):
            after = cst.Call(callback.value)
            yield Change(node, into(program.code(node), program.code(after)), ((node, after),))


def spins_once(program: Program) -> Iterator[Change]:
    """A node that spins once, not until the end."""
    for call in program.calls("spin"):
        if isinstance(call.func, cst.Attribute):
            yield Change(call, "spin -> spin_once", ((call.func.attr, cst.Name("spin_once")),))


def repeated_call(program: Program) -> Iterator[Change]:
    """A message, request or log that is sent twice."""
    for line in program.all(cst.SimpleStatementLine):
        if m.matches(line, m.SimpleStatementLine(body=[m.Expr(m.Call())])):
            call = program.all(cst.Call, line)[0]
            if called(call) in _REPEATED:
                twice = cst.FlattenSentinel([line, line.with_changes(leading_lines=())])
                yield Change(line, f"twice {short(program.code(call))}", ((line, twice),))


def repeated_entity(program: Program) -> Iterator[Change]:
    """A second timer or subscription beside the first, with the same callback."""
    for line in program.all(cst.SimpleStatementLine):
        calls = [
            call for call in program.all(cst.Call, line) if called(call) in ("create_timer", "create_subscription")
        ]
        if calls:
            twice = cst.FlattenSentinel([line, line.with_changes(leading_lines=())])
            yield Change(line, f"two of {short(program.code(calls[0]))}", ((line, twice),))


def wrong_order(program: Program) -> Iterator[Change]:
    """Two neighbouring lines in the wrong order: used before it is made, sent before it is filled."""
    for block in program.all(cst.IndentedBlock):
        for one, other in zip(block.body, block.body[1:], strict=False):
            if isinstance(one, cst.SimpleStatementLine) and _leads_to(program, one, other):
                edits = ((one, other), (other, one))
                texts = (short(program.code(line).strip(), 30) for line in (one, other))
                yield Change(one, " after ".join(texts), edits)


def _leads_to(program: Program, one: cst.SimpleStatementLine, other: cst.CSTNode) -> bool:
    """Whether a line needs the one before it: a name that is set there, a message that is filled, what starts ROS."""
    used = {program.code(node) for node in [*program.all(cst.Name, other), *program.all(cst.Attribute, other)]}
    made = {program.code(target.target) for target in program.all(cst.AssignTarget, one)}
    filled = {
        program.code(t.target.value) for t in program.all(cst.AssignTarget, one) if isinstance(t.target, cst.Attribute)
    }
    given = {program.code(arg.value) for arg in program.all(cst.Arg, other)}
    starts = any(called(call) in ("init", "__init__") for call in program.all(cst.Call, one))
    return starts or bool(made & used) or bool((filled - {"self"}) & given)


def _without_comma(params: object) -> tuple[cst.Param, ...]:
    kept = tuple(params) if isinstance(params, (tuple, list)) else ()
    return (*kept[:-1], kept[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)) if kept else ()
