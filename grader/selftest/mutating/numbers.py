"""Operators that get numbers wrong."""

from __future__ import annotations

from collections.abc import Iterator

import libcst as cst

from grader.selftest.mutating.program import Change, Program, argument, called, expression, into, number, number_of

_OPERATORS: dict[type[cst.BaseBinaryOp], type[cst.BaseBinaryOp]] = {
    cst.Add: cst.Subtract,
    cst.Subtract: cst.Add,
    cst.Multiply: cst.Divide,
    cst.Divide: cst.Multiply,
}


def constant(program: Program) -> Iterator[Change]:
    """A number that is off: by a tenth, by one where it is whole."""
    for node, value in _numbers(program):
        off = value + 1 if isinstance(value, int) else value * 1.1 or 0.1
        yield Change(node, into(program.code(node), program.code(number(off))), ((node, number(off)),))


def constant_less(program: Program) -> Iterator[Change]:
    """A number that is off the other way."""
    for node, value in _numbers(program):
        off = value - 1 if isinstance(value, int) else value * 0.9 or -0.1
        yield Change(node, into(program.code(node), program.code(number(off))), ((node, number(off)),))


def sign(program: Program) -> Iterator[Change]:
    """A lost minus, or one too many."""
    for node, value in _numbers(program):
        above = next(program.above(node), None)
        if isinstance(above, cst.UnaryOperation) and isinstance(above.operator, cst.Minus):
            yield Change(node, into(program.code(above), program.code(node)), ((above, node),))
        elif value:
            yield Change(node, into(program.code(node), f"-{program.code(node)}"), ((node, number(-value)),))


def whole_number(program: Program) -> Iterator[Change]:
    """A whole number where a message wants a float: `0` for `0.0`."""
    for node, value in _numbers(program):
        if isinstance(value, float) and value.is_integer():
            yield Change(node, into(program.code(node), str(int(value))), ((node, number(int(value))),))


def arithmetic(program: Program) -> Iterator[Change]:
    """The wrong operation: plus for minus, times for divided by."""
    for node in program.all(cst.BinaryOperation):
        other = _OPERATORS.get(type(node.operator))
        if other is not None and not _of_texts(node):
            after = node.with_changes(operator=other())
            yield Change(node, into(program.code(node), program.code(after)), ((node, after),))


def missing_operand(program: Program) -> Iterator[Change]:
    """A forgotten factor, shift or conversion: one side of an operation is missing."""
    for node in program.all(cst.BinaryOperation):
        if not _of_texts(node):
            for side in (node.left, node.right):
                yield Change(node, into(program.code(node), program.code(side)), ((node, side),))


def missing_conversion(program: Program) -> Iterator[Change]:
    """A forgotten conversion or function: `degrees(x)` becomes `x`; or its opposite."""
    for call in program.calls("degrees", "radians", "sin", "cos", "round", "abs", "float", "int", "str", "max", "min"):
        if call.args:
            inner = call.args[0].value
            yield Change(call, into(program.code(call), program.code(inner)), ((call, inner),))
    opposites = {"degrees": "radians", "radians": "degrees", "sin": "cos", "cos": "sin", "max": "min", "min": "max"}
    for call in program.calls(*opposites):
        name = call.func.attr if isinstance(call.func, cst.Attribute) else call.func
        after = opposites[called(call)]
        yield Change(call, into(called(call), after), ((name, cst.Name(after)),))


def cut_to_whole(program: Program) -> Iterator[Change]:
    """Numbers cut to whole ones before they are compared or sent."""
    for comparison in program.all(cst.Comparison):
        text = program.code(comparison.left)
        if isinstance(
            comparison.comparisons[0].operator, (cst.GreaterThan, cst.LessThan, cst.GreaterThanEqual, cst.LessThanEqual)
        ):
            yield Change(comparison, into(text, f"int({text})"), ((comparison.left, expression(f"int({text})")),))
    for keyword in _sent(program):
        text = program.code(keyword)
        yield Change(keyword, into(text, f"float(int({text}))"), ((keyword, expression(f"float(int({text}))")),))


def counter_step(program: Program) -> Iterator[Change]:
    """A counter that counts in other steps, or backwards."""
    for node in program.all(cst.AugAssign):
        if isinstance(node.operator, (cst.AddAssign, cst.SubtractAssign)):
            text = program.code(node.value)
            doubled = expression(f"2 * ({text})")
            yield Change(node, f"step {into(text, f'2 * {text}')}", ((node.value, doubled),))
            other = cst.SubtractAssign() if isinstance(node.operator, cst.AddAssign) else cst.AddAssign()
            yield Change(node, f"step {into(text, f'-{text}')}", ((node.operator, other),))


def _numbers(program: Program) -> Iterator[tuple[cst.CSTNode, float | int]]:
    """Yield the numbers of a program, without queue depths: no student's mark depends on these."""
    depths = {
        arg.value
        for call in program.calls("create_publisher", "create_subscription")
        if (arg := argument(call, "qos_profile"))
    }
    depths |= {arg.value for call in program.calls("QoSProfile") for arg in call.args}
    for node in [*program.all(cst.Integer), *program.all(cst.Float)]:
        value = number_of(node)
        if value is not None and node not in depths and not any(above in depths for above in program.above(node)):
            yield node, value


def _of_texts(node: cst.BinaryOperation) -> bool:
    """Whether an operation formats or joins texts."""
    texts = (cst.SimpleString, cst.FormattedString, cst.ConcatenatedString)
    return isinstance(node.left, texts) or isinstance(node.right, texts)


def _sent(program: Program) -> list[cst.BaseExpression]:
    """Return what fields of messages are set to, as far as it may be any number: no literal and no text."""
    values = [
        arg.value
        for call in program.all(cst.Call)
        for arg in call.args
        if arg.keyword is not None and _is_message(called(call))
    ]
    for assign in program.all(cst.Assign):
        target = assign.targets[0].target
        if isinstance(target, cst.Attribute) and not (
            isinstance(target.value, cst.Name) and target.value.value == "self"
        ):
            values.append(assign.value)
    return [
        value
        for value in values
        if isinstance(program.constant(value), (cst.Name, cst.Attribute, cst.Call, cst.BinaryOperation))
    ]


def _is_message(name: str) -> bool:
    return name[:1].isupper()
