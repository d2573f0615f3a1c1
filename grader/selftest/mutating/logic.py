"""Operators that decide wrongly."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import libcst as cst

from grader.selftest.mutating.program import Change, Program, expression, into

_BOUNDARIES: Mapping[type[cst.BaseCompOp], tuple[type[cst.BaseCompOp], ...]] = {
    cst.GreaterThan: (cst.GreaterThanEqual, cst.LessThan, cst.Equal),
    cst.GreaterThanEqual: (cst.GreaterThan, cst.LessThan, cst.Equal),
    cst.LessThan: (cst.LessThanEqual, cst.GreaterThan, cst.Equal),
    cst.LessThanEqual: (cst.LessThan, cst.GreaterThan, cst.Equal),
    cst.Equal: (cst.NotEqual,),
    cst.NotEqual: (cst.Equal,),
    cst.Is: (cst.IsNot,),
    cst.IsNot: (cst.Is,),
}


def comparison(program: Program) -> Iterator[Change]:
    """A limit that belongs to the wrong side, a comparison the wrong way round, or with the one value only."""
    for node in program.all(cst.Comparison):
        for target in node.comparisons:
            if _is_guard(program, node):
                continue
            for other in _BOUNDARIES.get(type(target.operator), ()):
                after = node.deep_replace(target.operator, other())
                yield Change(node, into(program.code(node), program.code(after)), ((node, after),))


def swapped_branches(program: Program) -> Iterator[Change]:
    """What belongs to yes and what belongs to no in each other's place."""
    for node in program.all(cst.IfExp):
        yield Change(
            node,
            f"{program.code(node.body)} <-> {program.code(node.orelse)}",
            ((node.body, node.orelse), (node.orelse, node.body)),
        )
    for branch in program.all(cst.If):
        if isinstance(branch.orelse, cst.Else):
            yield Change(
                branch,
                f"if {program.code(branch.test)}: branches swapped",
                ((branch.body, branch.orelse.body), (branch.orelse.body, branch.body)),
            )


def constant_condition(program: Program) -> Iterator[Change]:
    """A condition that is forgotten, or never true: what it guards happens always, or not at all."""
    tests = [branch.test for branch in program.all(cst.If)]
    tests += [choice.test for choice in program.all(cst.IfExp)]
    tests += [loop.test for loop in program.all(cst.While)]
    for test in tests:
        if not _is_guard(program, test):
            for value in ("True", "False"):
                yield Change(test, into(program.code(test), value), ((test, expression(value)),))


def boolean(program: Program) -> Iterator[Change]:
    """Yes for no, `and` for `or`, a `not` too few."""
    for name in program.all(cst.Name):
        if name.value in ("True", "False"):
            other = "False" if name.value == "True" else "True"
            yield Change(name, into(name.value, other), ((name, cst.Name(other)),))
    for node in program.all(cst.BooleanOperation):
        operator = cst.Or() if isinstance(node.operator, cst.And) else cst.And()
        after = node.with_changes(operator=operator)
        yield Change(node, into(program.code(node), program.code(after)), ((node, after),))
    for negated in program.all(cst.UnaryOperation):
        if isinstance(negated.operator, cst.Not):
            inner = negated.expression
            yield Change(negated, into(program.code(negated), program.code(inner)), ((negated, inner),))


def loop_once(program: Program) -> Iterator[Change]:
    """What should be repeated is tried once: `if` for `while`."""
    for loop in program.all(cst.While):
        if loop.orelse is None and not _breaks(program, loop):
            after = cst.If(test=loop.test, body=loop.body, whitespace_before_test=cst.SimpleWhitespace(" "))
            yield Change(loop, f"while -> if {program.code(loop.test)}", ((loop, after),))


def unhandled(program: Program) -> Iterator[Change]:
    """An error that nobody catches."""
    for handler in program.all(cst.ExceptHandler):
        body = cst.IndentedBlock([cst.parse_statement("raise")])
        named = program.code(handler.type) if handler.type is not None else "everything"
        yield Change(handler, f"except {' '.join(named.split())}: raise", ((handler.body, body),))


def _breaks(program: Program, loop: cst.While) -> bool:
    return bool(program.all(cst.Break, loop) or program.all(cst.Continue, loop))


def _is_guard(program: Program, node: cst.CSTNode) -> bool:
    """Whether a test asks if the file is run as a program: the grader runs it either way."""
    return "__name__" in program.code(node)
