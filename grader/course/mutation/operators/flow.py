"""Operators on the flow of a program: lines forgotten, repeated or misplaced, wrong decisions, early ends."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence

import libcst as cst
from libcst import matchers as m

from grader.course.mutation.operators.program import (
    CREATORS,
    LEVELS,
    Edit,
    Mutation,
    ParsedProgram,
    called,
    in_one_line,
    without_comma,
)


def statements_of(function: cst.FunctionDef) -> Sequence[cst.BaseStatement]:
    """Return the statements of a function's body, in order, without its docstring."""
    if not isinstance(function.body, cst.IndentedBlock):
        return ()
    body = function.body.body
    return body[1:] if function.get_docstring() is not None else body


def at_top(function: cst.FunctionDef, *texts: str) -> tuple[Edit, ...]:
    """Return the edit that inserts statements at the start of a function; none if its body is on the same line."""
    lines = statements_of(function)
    return ((lines[0], cst.FlattenSentinel([*map(cst.parse_statement, texts), lines[0]])),) if lines else ()


def parameter_names(function: cst.FunctionDef) -> list[str]:
    """Return the names of a function's parameters."""
    return [parameter.name.value for parameter in function.params.params]


def owner(function: cst.FunctionDef) -> str:
    """Return an object where a function can store state between calls: `self`, or the function itself."""
    names = parameter_names(function)
    return names[0] if names[:1] == ["self"] else function.name.value


def alone(program: ParsedProgram, node: cst.CSTNode) -> bool:
    """Whether a small statement stands on a line of its own."""
    line = program.enclosing(node, cst.SimpleStatementLine)
    return line is not None and len(line.body) == 1


#: Statements that people repeat by accident, and where this changes the behaviour.
_REPEATED = ("publish", "call_async", "call", *LEVELS)
_ENTITIES = ("create_timer", "create_subscription")


def missing_call(program: ParsedProgram) -> Iterator[Mutation]:
    """A call that is forgotten: publish, spin, init, super().__init__, create_timer, a log."""
    for node in program.all(cst.Expr):
        if isinstance(node.value, cst.Call) and alone(program, node):
            yield program.without(node)


def missing_assignment(program: ParsedProgram) -> Iterator[Mutation]:
    """A value that is never set, a counter that never counts, a publisher that is never made."""
    for node in [*program.all(cst.Assign), *program.all(cst.AugAssign), *program.all(cst.AnnAssign)]:
        if alone(program, node) and not (isinstance(node, cst.AnnAssign) and node.value is None):
            yield program.without(node)


def missing_import(program: ParsedProgram) -> Iterator[Mutation]:
    """An import that is forgotten."""
    for node in [*program.all(cst.Import), *program.all(cst.ImportFrom)]:
        if alone(program, node):
            yield program.without(node)


def missing_return(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback that does not return its response, a function that returns nothing."""
    for node in program.all(cst.Return):
        if node.value is not None:
            yield program.without(node)


def missing_early_return(program: ParsedProgram) -> Iterator[Mutation]:
    """A `return`, `break` or `continue` that is forgotten: the function goes on."""
    bare = [node for node in program.all(cst.Return) if node.value is None]
    for node in [*bare, *program.all(cst.Break), *program.all(cst.Continue)]:
        yield program.without(node)


def missing_parameter(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback without the parameter that it is called with."""
    for function in program.callbacks:
        params = function.params.params
        if params:
            kept = function.params.with_changes(params=without_comma(params[:-1]))
            detail = f"{function.name.value} without {params[-1].name.value}"
            yield Mutation(function, detail, ((function.params, kept),))


def callback_called(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback that is called instead of passed: `self.tick()` for `self.tick`."""
    for call, callback in program.arguments("callback", *CREATORS):
        if not isinstance(callback, (cst.Lambda, cst.Call)):
            yield program.replacing(callback, cst.Call(callback), at=call)


def timer_once(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback that is called once instead of by a timer."""
    for call, callback in program.arguments("callback", "create_timer"):
        if isinstance(callback, (cst.Name, cst.Attribute)):
            yield program.replacing(call, cst.Call(callback))


def spins_once(program: ParsedProgram) -> Iterator[Mutation]:
    """A node that spins once instead of until the end."""
    for call in program.calls("spin"):
        if isinstance(call.func, cst.Attribute):
            yield Mutation(call, "spin -> spin_once", ((call.func.attr, cst.Name("spin_once")),))


def repeated_call(program: ParsedProgram) -> Iterator[Mutation]:
    """A message, request or log that is sent twice."""
    for line in program.all(cst.SimpleStatementLine):
        if m.matches(line, m.SimpleStatementLine(body=[m.Expr(m.Call())])):
            call = program.all(cst.Call, line)[0]
            if called(call) in _REPEATED:
                yield Mutation(line, f"twice {in_one_line(program.code(call))}", _twice(line))


def repeated_entity(program: ParsedProgram) -> Iterator[Mutation]:
    """A second timer or subscription beside the first, with the same callback."""
    for line in program.all(cst.SimpleStatementLine):
        calls = [call for call in program.all(cst.Call, line) if called(call) in _ENTITIES]
        if calls:
            yield Mutation(line, f"two of {in_one_line(program.code(calls[0]))}", _twice(line))


def _twice(line: cst.SimpleStatementLine) -> tuple[Edit, ...]:
    return ((line, cst.FlattenSentinel([line, line.with_changes(leading_lines=())])),)


def wrong_order(program: ParsedProgram) -> Iterator[Mutation]:
    """Two neighbouring lines in the wrong order: used before it is made, sent before it is filled."""
    for block in program.all(cst.IndentedBlock):
        for one, other in zip(block.body, block.body[1:], strict=False):
            if isinstance(one, cst.SimpleStatementLine) and _leads_to(program, one, other):
                edits = ((one, other), (other, one))
                texts = (in_one_line(program.code(line).strip(), 30) for line in (one, other))
                yield Mutation(one, " after ".join(texts), edits)


def _leads_to(program: ParsedProgram, one: cst.SimpleStatementLine, other: cst.CSTNode) -> bool:
    """Whether a line depends on the one before it, which sets a name, fills a message, or starts ROS."""
    used = {program.code(node) for node in [*program.all(cst.Name, other), *program.all(cst.Attribute, other)]}
    made = {program.code(target.target) for target in program.all(cst.AssignTarget, one)}
    filled = {
        program.code(t.target.value) for t in program.all(cst.AssignTarget, one) if isinstance(t.target, cst.Attribute)
    }
    given = {program.code(arg.value) for arg in program.all(cst.Arg, other)}
    starts = any(called(call) in ("init", "__init__") for call in program.all(cst.Call, one))
    return starts or bool(made & used) or bool((filled - {"self"}) & given)


#: Calls after which a callback fails that works at first.
LATER = 10


def exits_later(program: ParsedProgram) -> Iterator[Mutation]:
    """A program that ends after a while."""
    return (_after(function, LATER, "raise SystemExit", "exits") for function in program.callbacks)


def crashes_on_third(program: ParsedProgram) -> Iterator[Mutation]:
    """An error at the third call of a callback."""
    return (_after(function, 2, "raise RuntimeError('the third time')", "raises") for function in program.callbacks)


def stops_later(program: ParsedProgram) -> Iterator[Mutation]:
    """A callback that stops working after a while."""
    return (_after(function, LATER, "return", "does nothing") for function in program.callbacks)


def frozen_value(program: ParsedProgram) -> Iterator[Mutation]:
    """A value or message that is created once and reused forever."""
    for function in program.callbacks:
        for assign in program.all(cst.Assign, function):
            target, value = assign.targets[0].target, assign.value
            own = isinstance(target, (cst.Name, cst.Attribute)) and alone(program, assign)
            if own and not isinstance(value, (cst.Integer, cst.Float, cst.SimpleString)):
                yield Mutation(assign, f"once {in_one_line(program.code(assign))}", _kept(program, function, value))
        for call in program.all(cst.Call, function):
            if called(call) == "publish" and call.args and isinstance(call.args[0].value, cst.Call):
                value = call.args[0].value
                yield Mutation(call, f"once {in_one_line(program.code(value))}", _kept(program, function, value))


def first_message_only(program: ParsedProgram) -> Iterator[Mutation]:
    """A received message that is kept forever: only the first one counts."""
    kept = "{own}.first_heard = {message} = getattr({own}, 'first_heard', {message})"
    return _hearing(program, "keeps the first {message}", kept)


def one_behind(program: ParsedProgram) -> Iterator[Mutation]:
    """A message that is used only when the next one arrives: always one behind."""
    put_off = "{own}.heard, {message} = {message}, getattr({own}, 'heard', {message})"
    return _hearing(program, "uses the {message} before", put_off)


def _hearing(program: ParsedProgram, detail: str, text: str) -> Iterator[Mutation]:
    """Yield the mutations that begin the callback of each subscription with a statement about its message."""
    for function in program.handed_to("create_subscription"):
        message = (parameter_names(function) or ["self"])[-1]
        if message != "self":
            said = f"{function.name.value} {detail.format(message=message)}"
            yield Mutation(function, said, at_top(function, text.format(own=owner(function), message=message)))


def _after(function: cst.FunctionDef, calls: int, then: str, word: str) -> Mutation:
    own = owner(function)
    counted = f"{own}.calls_so_far = getattr({own}, 'calls_so_far', 0) + 1"
    stop = f"if {own}.calls_so_far > {calls}:\n    {then}\n"
    return Mutation(function, f"{function.name.value} {word} after {calls} calls", at_top(function, counted, stop))


def _kept(program: ParsedProgram, function: cst.FunctionDef, value: cst.BaseExpression) -> tuple[Edit, ...]:
    """Return the edit that makes an expression keep its first value."""
    own, name = owner(function), f"kept_{program.line(value)}"
    text = f"{own}.__dict__.setdefault('{name}', {program.code(value)})"
    return ((value, cst.parse_expression(text)),)


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


def comparison(program: ParsedProgram) -> Iterator[Mutation]:
    """A limit on the wrong side, a reversed comparison, or equality instead of an inequality."""
    for node in program.all(cst.Comparison):
        if not _is_guard(program, node):
            for target in node.comparisons:
                for other in _BOUNDARIES.get(type(target.operator), ()):
                    yield program.replacing(node, node.deep_replace(target.operator, other()))


def swapped_branches(program: ParsedProgram) -> Iterator[Mutation]:
    """The branches of a condition swapped."""
    for node in program.all(cst.IfExp):
        yield program.swapping(node, node.body, node.orelse)
    for branch in program.all(cst.If):
        if isinstance(branch.orelse, cst.Else):
            edits = ((branch.body, branch.orelse.body), (branch.orelse.body, branch.body))
            yield Mutation(branch, f"if {program.code(branch.test)}: branches swapped", edits)


def constant_condition(program: ParsedProgram) -> Iterator[Mutation]:
    """A condition that is missing or never true: the guarded code runs always or never."""
    tests = [branch.test for branch in program.all(cst.If)]
    tests += [choice.test for choice in program.all(cst.IfExp)]
    tests += [loop.test for loop in program.all(cst.While)]
    for test in tests:
        if not _is_guard(program, test):
            for value in ("True", "False"):
                yield program.replacing(test, value)


def boolean(program: ParsedProgram) -> Iterator[Mutation]:
    """True for False, `and` for `or`, a missing `not`."""
    for name in program.all(cst.Name):
        if name.value in ("True", "False"):
            yield program.replacing(name, "False" if name.value == "True" else "True")
    for node in program.all(cst.BooleanOperation):
        operator = cst.Or() if isinstance(node.operator, cst.And) else cst.And()
        yield program.replacing(node, node.with_changes(operator=operator))
    for negated in program.all(cst.UnaryOperation):
        if isinstance(negated.operator, cst.Not):
            yield program.replacing(negated, negated.expression)


def loop_once(program: ParsedProgram) -> Iterator[Mutation]:
    """A loop that runs only once: `if` for `while`."""
    for loop in program.all(cst.While):
        if loop.orelse is None and not any((program.all(cst.Break, loop), program.all(cst.Continue, loop))):
            after = cst.If(test=loop.test, body=loop.body, whitespace_before_test=cst.SimpleWhitespace(" "))
            yield Mutation(loop, f"while -> if {program.code(loop.test)}", ((loop, after),))


def unhandled(program: ParsedProgram) -> Iterator[Mutation]:
    """An error that nobody catches."""
    for handler in program.all(cst.ExceptHandler):
        body = cst.IndentedBlock([cst.parse_statement("raise")])
        named = program.code(handler.type) if handler.type is not None else "everything"
        yield Mutation(handler, f"except {' '.join(named.split())}: raise", ((handler.body, body),))


def _is_guard(program: ParsedProgram, node: cst.CSTNode) -> bool:
    """Whether a condition is the `__main__` guard, which makes no difference to the grader."""
    return "__name__" in program.code(node)
