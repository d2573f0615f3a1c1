"""Operators on values: wrong numbers, fields, and qualities of service."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import libcst as cst

from grader.course.mutation.operators.program import (
    Mutation,
    ParsedProgram,
    called,
    into,
    literal_number,
    number_literal,
    without_comma,
)

_SIBLINGS: Mapping[str, str] = {
    "x": "y",
    "y": "x",
    "z": "x",
    "linear": "angular",
    "angular": "linear",
    "position": "orientation",
    "orientation": "position",
}
_LONGER: Mapping[str, str] = {
    "pose.pose.position": "twist.twist.linear",
    "pose.pose.orientation": "twist.twist.angular",
}


def wrong_field(program: ParsedProgram) -> Iterator[Mutation]:
    """The wrong one of two similar fields: x for y, linear for angular, orientation for position."""
    for node in program.all(cst.Attribute):
        other = _SIBLINGS.get(node.attr.value)
        if other is not None and not _is_own(node):
            yield Mutation(node, f"{program.code(node)} -> .{other}", ((node.attr, cst.Name(other)),))


def wrong_part(program: ParsedProgram) -> Iterator[Mutation]:
    """The twist of a message instead of its pose."""
    for node in program.all(cst.Attribute):
        text = program.code(node)
        for ending, other in _LONGER.items():
            if text.endswith(ending):
                yield program.replacing(node, text.removesuffix(ending) + other)


def swapped_arguments(program: ParsedProgram) -> Iterator[Mutation]:
    """Two neighbouring arguments swapped."""
    for call in program.all(cst.Call):
        for one, other in pairwise(call.args):
            if one.keyword is None and other.keyword is None and not one.star + other.star:
                yield program.swapping(call, one.value, other.value)


def swapped_values(program: ParsedProgram) -> Iterator[Mutation]:
    """Two neighbouring values in a text swapped."""
    for text in program.all(cst.FormattedString):
        values = [part for part in text.parts if isinstance(part, cst.FormattedStringExpression)]
        for one, other in pairwise(values):
            yield program.swapping(text, one.expression, other.expression)


def missing_keyword(program: ParsedProgram) -> Iterator[Mutation]:
    """A missing field or setting: `Float32()` for `Float32(data=speed)`."""
    for call in program.all(cst.Call):
        for arg in call.args:
            if arg.keyword is not None:
                kept = [other for other in call.args if other is not arg]
                yield program.replacing(call, call.with_changes(args=without_comma(kept)))


def stale_field(program: ParsedProgram) -> Iterator[Mutation]:
    """A value assigned to a misspelt field: the field of the message stays unchanged."""
    for assign in program.all(cst.Assign):
        target = assign.targets[0].target
        if isinstance(target, cst.Attribute) and not _is_own(target):
            other = cst.Name(f"{target.attr.value}_value")
            after = cst.Assign([cst.AssignTarget(other)], assign.value)
            yield Mutation(assign, into(program.code(target), other.value), ((assign, after),))


def _is_own(node: cst.Attribute) -> bool:
    """Whether an attribute belongs to the object, as in `self.x`, and is not a message field."""
    return isinstance(node.value, cst.Name) and node.value.value == "self"


_OPERATORS: dict[type[cst.BaseBinaryOp], type[cst.BaseBinaryOp]] = {
    cst.Add: cst.Subtract,
    cst.Subtract: cst.Add,
    cst.Multiply: cst.Divide,
    cst.Divide: cst.Multiply,
}


def constant(program: ParsedProgram) -> Iterator[Mutation]:
    """A number that is off: by a tenth, or by one if it is an integer."""
    return _off(program, 1)


def constant_less(program: ParsedProgram) -> Iterator[Mutation]:
    """A number that is off in the other direction."""
    return _off(program, -1)


def _off(program: ParsedProgram, side: int) -> Iterator[Mutation]:
    for node, value in _numbers(program):
        off = value + side if isinstance(value, int) else value * (1 + 0.1 * side) or 0.1 * side
        yield program.replacing(node, number_literal(off))


def sign(program: ParsedProgram) -> Iterator[Mutation]:
    """A missing or superfluous minus sign."""
    for node, value in _numbers(program):
        above = next(program.above(node), None)
        if isinstance(above, cst.UnaryOperation) and isinstance(above.operator, cst.Minus):
            yield program.replacing(above, node, at=node)
        elif value:
            yield Mutation(node, into(program.code(node), f"-{program.code(node)}"), ((node, number_literal(-value)),))


def whole_number(program: ParsedProgram) -> Iterator[Mutation]:
    """An integer where a message needs a float: `0` for `0.0`."""
    for node, value in _numbers(program):
        if isinstance(value, float) and value.is_integer():
            yield program.replacing(node, str(int(value)))


def arithmetic(program: ParsedProgram) -> Iterator[Mutation]:
    """The wrong operation: plus for minus, times for divided by."""
    for node in program.all(cst.BinaryOperation):
        other = _OPERATORS.get(type(node.operator))
        if other is not None and not _of_texts(node):
            yield program.replacing(node, node.with_changes(operator=other()))


def missing_operand(program: ParsedProgram) -> Iterator[Mutation]:
    """A forgotten factor, shift or conversion: one side of an operation is missing."""
    for node in program.all(cst.BinaryOperation):
        if not _of_texts(node):
            yield program.replacing(node, node.left)
            yield program.replacing(node, node.right)


def missing_conversion(program: ParsedProgram) -> Iterator[Mutation]:
    """A forgotten conversion or function: `degrees(x)` becomes `x`; or the inverse function."""
    for call in program.calls("degrees", "radians", "sin", "cos", "round", "abs", "float", "int", "str", "max", "min"):
        if call.args:
            yield program.replacing(call, call.args[0].value)
    opposites = {"degrees": "radians", "radians": "degrees", "sin": "cos", "cos": "sin", "max": "min", "min": "max"}
    for call in program.calls(*opposites):
        name = call.func.attr if isinstance(call.func, cst.Attribute) else call.func
        after = opposites[called(call)]
        yield Mutation(call, into(called(call), after), ((name, cst.Name(after)),))


_INEQUALITIES = (cst.GreaterThan, cst.LessThan, cst.GreaterThanEqual, cst.LessThanEqual)


def cut_to_whole(program: ParsedProgram) -> Iterator[Mutation]:
    """Numbers truncated to integers before they are compared or sent."""
    for comparison in program.all(cst.Comparison):
        if isinstance(comparison.comparisons[0].operator, _INEQUALITIES):
            yield program.replacing(comparison.left, f"int({program.code(comparison.left)})", at=comparison)
    for value in _sent(program):
        yield program.replacing(value, f"float(int({program.code(value)}))")


def counter_step(program: ParsedProgram) -> Iterator[Mutation]:
    """A counter with the wrong step, or counting backwards."""
    for node in program.all(cst.AugAssign):
        if isinstance(node.operator, (cst.AddAssign, cst.SubtractAssign)):
            text = program.code(node.value)
            doubled = cst.parse_expression(f"2 * ({text})")
            yield Mutation(node, f"step {into(text, f'2 * {text}')}", ((node.value, doubled),))
            other = cst.SubtractAssign() if isinstance(node.operator, cst.AddAssign) else cst.AddAssign()
            yield Mutation(node, f"step {into(text, f'-{text}')}", ((node.operator, other),))


def _numbers(program: ParsedProgram) -> Iterator[tuple[cst.CSTNode, float | int]]:
    """Yield the numbers of a program, without queue depths, which affect no mark."""
    depths = {profile for _, profile in program.arguments("qos_profile", "create_publisher", "create_subscription")}
    depths |= {arg.value for call in program.calls("QoSProfile") for arg in call.args}
    for node in [*program.all(cst.Integer), *program.all(cst.Float)]:
        value = literal_number(node)
        if value is not None and node not in depths and not any(above in depths for above in program.above(node)):
            yield node, value


def _of_texts(node: cst.BinaryOperation) -> bool:
    """Whether an operation formats or joins texts."""
    texts = (cst.SimpleString, cst.FormattedString, cst.ConcatenatedString)
    return isinstance(node.left, texts) or isinstance(node.right, texts)


def _sent(program: ParsedProgram) -> list[cst.BaseExpression]:
    """Return the values assigned to message fields that may be numbers, without literals and strings."""
    values = [
        arg.value
        for call in program.all(cst.Call)
        for arg in call.args
        if arg.keyword is not None and called(call)[:1].isupper()
    ]
    for assign in program.all(cst.Assign):
        target = assign.targets[0].target
        if isinstance(target, cst.Attribute) and not _is_own(target):
            values.append(assign.value)
    return [
        value
        for value in values
        if isinstance(program.constant(value), (cst.Name, cst.Attribute, cst.Call, cst.BinaryOperation))
    ]


def best_effort(program: ParsedProgram) -> Iterator[Mutation]:
    """A publisher or subscription with the sensor data profile, which may lose messages."""
    return _with_profile(program, "best effort", "qos_profile_sensor_data", "qos_profile_sensor_data")


def transient_local(program: ParsedProgram) -> Iterator[Mutation]:
    """A publisher or subscription with transient local durability."""
    profile = "QoSProfile(depth=10, durability=DurabilityPolicy.TRANSIENT_LOCAL)"
    return _with_profile(program, "transient local", profile, "DurabilityPolicy, QoSProfile")


def _with_profile(program: ParsedProgram, word: str, profile: str, imported: str) -> Iterator[Mutation]:
    for call, given in program.arguments("qos_profile", "create_publisher", "create_subscription"):
        edits = ((given, cst.parse_expression(profile)), *program.importing(f"from rclpy.qos import {imported}"))
        yield Mutation(call, f"{called(call).removeprefix('create_')} {word}", edits)
