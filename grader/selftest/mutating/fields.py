"""Operators that take the wrong field, or put things in the wrong place."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from itertools import pairwise

import libcst as cst

from grader.selftest.mutating.program import Change, Program, expression, into

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


def wrong_field(program: Program) -> Iterator[Change]:
    """The field beside the right one: x for y, linear for angular, orientation for position."""
    for node in program.all(cst.Attribute):
        other = _SIBLINGS.get(node.attr.value)
        if other is not None and not _is_own(node):
            yield Change(node, f"{program.code(node)} -> .{other}", ((node.attr, cst.Name(other)),))


def wrong_part(program: Program) -> Iterator[Change]:
    """The speed where the position belongs."""
    for node in program.all(cst.Attribute):
        text = program.code(node)
        for ending, other in _LONGER.items():
            if text.endswith(ending):
                after = text.removesuffix(ending) + other
                yield Change(node, into(text, after), ((node, expression(after)),))


def swapped_arguments(program: Program) -> Iterator[Change]:
    """Two neighbouring arguments in each other's place."""
    for call in program.all(cst.Call):
        for one, other in zip(call.args, call.args[1:], strict=False):
            if one.keyword is None and other.keyword is None and not one.star + other.star:
                texts = program.code(one.value), program.code(other.value)
                yield Change(call, f"{texts[0]} <-> {texts[1]}", ((one.value, other.value), (other.value, one.value)))


def swapped_values(program: Program) -> Iterator[Change]:
    """Two neighbouring values of a text in each other's place."""
    for text in program.all(cst.FormattedString):
        values = [part for part in text.parts if isinstance(part, cst.FormattedStringExpression)]
        for one, other in pairwise(values):
            a, b = one.expression, other.expression
            yield Change(text, f"{program.code(a)} <-> {program.code(b)}", ((a, b), (b, a)))


def missing_keyword(program: Program) -> Iterator[Change]:
    """A field or setting left out: `Float32()` for `Float32(data=speed)`."""
    for call in program.all(cst.Call):
        for arg in call.args:
            if arg.keyword is not None:
                kept = tuple(other for other in call.args if other is not arg)
                after = call.with_changes(args=tuple(_last(kept)))
                yield Change(call, into(program.code(call), program.code(after)), ((call, after),))


def stale_field(program: Program) -> Iterator[Change]:
    """A value that goes into a new field by another name: the field of the message stays as it was."""
    for assign in program.all(cst.Assign):
        target = assign.targets[0].target
        if isinstance(target, cst.Attribute) and not _is_own(target):
            other = cst.Name(f"{target.attr.value}_value")
            after = cst.Assign([cst.AssignTarget(other)], assign.value)
            yield Change(assign, into(program.code(target), other.value), ((assign, after),))


def _last(args: tuple[cst.Arg, ...]) -> list[cst.Arg]:
    """Return arguments without a comma behind the last one."""
    return [*args[:-1], args[-1].with_changes(comma=cst.MaybeSentinel.DEFAULT)] if args else []


def _is_own(node: cst.Attribute) -> bool:
    """Whether an attribute is the object's own, `self.x`, and no field of a message."""
    return isinstance(node.value, cst.Name) and node.value.value == "self"
