"""Causes in how a program reads a laser scan: readings to leave out, rays that look elsewhere, sides taken for ahead.

They are asked late: an exercise with a scanner may have rules of its own about what it asks for.
"""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from typing import Any

from grader.grading.judging.diagnosis.rules import Case, Clue, hint_rule, is_told
from grader.grading.judging.diagnosis.wiring import made
from grader.grading.judging.source import Source, chain, first_line, last_name
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Delivery

_SCAN = "sensor_msgs/msg/LaserScan"
#: What finds NaN, or leaves it out.
_FINDS_NAN = {"isnan", "isfinite", "nanmin", "nanargmin", "nan_to_num"}
#: What takes one of several readings, which a NaN among them spoils.
_CHOOSES = {"min", "argmin", "amin", "sort", "sorted", "argsort"}
#: What a program calls the way ahead, and the way to the left.
_AHEAD = {"x", "dx", "px", "ahead", "forward", "front"}
_BESIDE = {"y", "dy", "py", "beside", "side", "sideways", "lateral", "left"}
#: The first ray of a scan is not ahead if it looks farther to the side than this, in rad.
_NOT_AHEAD = 0.5
_OUTSIDE = {"range_min": (ast.Lt, ast.LtE), "range_max": (ast.Gt, ast.GtE)}
_INSIDE = {"range_min": (ast.Gt, ast.GtE), "range_max": (ast.Lt, ast.LtE)}
_TURNED: dict[type[ast.cmpop], type[ast.cmpop]] = {ast.Lt: ast.Gt, ast.LtE: ast.GtE, ast.Gt: ast.Lt, ast.GtE: ast.LtE}


@dataclass(frozen=True, slots=True)
class _Seen:
    """A program that hears a scanner, and the scans that it was sent."""

    source: Source
    scans: tuple[Delivery, ...]

    @property
    def first_angle(self) -> float:
        """Where the first ray looks, in rad."""
        return float(self.scans[0].value.get("angle_min", 0.0))

    @property
    def names(self) -> set[str]:
        """The last part of every name in the program."""
        return {last_name(node) for node in self.source.names()}

    @property
    def ranges(self) -> set[str]:
        """What the program calls the ranges: the field, and variables that hold it or an array of it."""
        source = self.source
        found = {chain(n) for n in source.all(ast.Attribute) if n.attr == "ranges"}
        for statement in source.all(ast.Assign):
            value = statement.value
            if isinstance(value, ast.Call) and len(value.args) == 1 and last_name(value.func) != "len":
                value = value.args[0]
            if isinstance(value, ast.Attribute) and value.attr == "ranges":
                found |= {chain(target) for target in statement.targets}
        return found - {""}


def _seen(case: Case) -> _Seen | None:
    """Return the program of a robot that sees; None if the criterion is about something else."""
    if not is_told(case):
        return None
    scans = tuple(d for d in case.trace.of(Delivery) if d.type == _SCAN)
    for source in case.sources.values() if scans else ():
        if any(item.type == "LaserScan" for item in made(source, "subscription")):
            return _Seen(source, scans)
    return None


@hint_rule(given=_seen, priority=8320)
def _empty_slice(seen: _Seen) -> Clue | None:
    """`ranges[-n:n]` is empty, and `ranges[:n]` begins with the first ray, which looks elsewhere than ahead."""
    source = seen.source
    slices = [n for n in source.all(ast.Subscript) if chain(n.value) in seen.ranges]
    ends = [(n, n.slice.lower, n.slice.upper) for n in slices if isinstance(n.slice, ast.Slice)]
    begins = {ast.dump(high): node for node, low, high in ends if low is None and high is not None}
    for node, low, high in ends:
        back = ast.dump(low.operand) if isinstance(low, ast.UnaryOp) and isinstance(low.op, ast.USub) else ""
        if high is not None and back == ast.dump(high):
            hint = f"{source.code(node, 50)} is empty: it begins near the end and ends near the beginning"
            return Clue(f"{hint}. {_where_ahead(seen)}", source.place(node))
        if high is None and back in begins and abs(seen.first_angle) > _NOT_AHEAD:
            hint = (
                f"{source.code(begins[back], 40)} and {source.code(node, 40)} are the rays around the first one, which"
            )
            hint += f" looks to {math.degrees(seen.first_angle):.0f}°. {_where_ahead(seen)}"
            return Clue(hint, source.place(begins[back]))
    return None


def _where_ahead(seen: _Seen) -> str:
    """Return which ray looks ahead."""
    scan = seen.scans[0].value
    number = round(-seen.first_angle / (float(scan.get("angle_increment", 0.0)) or math.inf))
    return f"The ray straight ahead has the number -angle_min / angle_increment, here {number}: take those around it"


@hint_rule(given=_seen, priority=8330)
def _number_is_no_angle(seen: _Seen) -> Clue | None:
    """The number of a ray is taken for its angle, as if the first ray looked ahead."""
    source = seen.source
    if "angle_min" in seen.names or abs(seen.first_angle) <= _NOT_AHEAD:
        return None
    numbers = set(_ray_numbers(seen))
    for node in source.all(ast.Name):
        if not isinstance(node.ctx, ast.Load) or (node.id, source.function_of(node)) not in numbers:
            continue
        around = source.parents.get(node)
        turned = isinstance(around, ast.Call) and last_name(around.func) in ("radians", "deg2rad", "degrees")
        times = isinstance(around, ast.BinOp) and isinstance(around.op, (ast.Mult, ast.Add, ast.Sub, ast.Mod))
        if around is not None and (turned or times or isinstance(around, ast.Compare)):
            hint = f"ray {node.id} does not look to {source.code(around, 40)} here, because the first one looks to"
            hint += f" {math.degrees(seen.first_angle):.0f}°: its angle is angle_min + {node.id} * angle_increment"
            return Clue(hint, source.place(around))
    return None


def _ray_numbers(seen: _Seen) -> Iterator[tuple[str, Any]]:
    """Yield each variable that runs through the numbers of the rays, with the function that it is in."""
    source = seen.source
    loops = [(node.target, node.iter) for node in source.all(ast.For)]
    inside: list[ast.ListComp | ast.GeneratorExp] = [*source.all(ast.ListComp), *source.all(ast.GeneratorExp)]
    loops += [(part.target, part.iter) for one in inside for part in one.generators]
    for target, over in loops:
        call = over if isinstance(over, ast.Call) else None
        read = {chain(n) for n in ast.walk(over) if isinstance(n, (ast.Name, ast.Attribute))} & seen.ranges
        if call is None or not read:
            continue
        counted = last_name(call.func) == "enumerate" and isinstance(target, ast.Tuple)
        first = target.elts[0] if counted and isinstance(target, ast.Tuple) else target
        if isinstance(first, ast.Name) and (counted or last_name(call.func) == "range"):
            yield first.id, source.function_of(over)


@hint_rule(given=_seen, priority=8340)
def _nan_is_kept(seen: _Seen) -> Clue | None:
    """What is too near or too far is left out, which NaN is not, and one of the rest is chosen."""
    source = seen.source
    lost = any(r != r for scan in seen.scans for r in scan.value.get("ranges", ()))  # noqa: PLR0124  only NaN is
    if not lost or seen.names & _FINDS_NAN or not seen.names & _CHOOSES:
        return None
    sides = [(node, leaf, op) for node in source.all(ast.Compare) for leaf, op in _limits(node)]
    outside = [node for node, leaf, op in sides if issubclass(op, _OUTSIDE[leaf])]
    if not outside or any(issubclass(op, _INSIDE[leaf]) for _, leaf, op in sides):
        return None
    hint = f"NaN is neither too near nor too far, so {source.code(outside[0], 40)} does not find it: keep only what is"
    return Clue(f"{hint} from range_min to range_max", source.place(outside[0]))


def _limits(node: ast.Compare) -> Iterator[tuple[str, type[ast.cmpop]]]:
    """Yield how a comparison orders something and a limit of the scanner, as if the limit were on the right."""
    sides = [node.left, *node.comparators]
    for left, right, op in zip(sides, sides[1:], node.ops, strict=False):
        for leaf in _OUTSIDE:
            if last_name(right) == leaf:
                yield leaf, type(op)
            elif last_name(left) == leaf:
                yield leaf, _TURNED.get(type(op), type(op))


@hint_rule(given=_seen, priority=8350)
def _sine_for_cosine(seen: _Seen) -> Clue | None:
    """What is ahead is computed with the sine of the angle, and what is beside with the cosine."""
    source = seen.source
    ahead = [n for n in _computed(source, _AHEAD) if _functions(n.value) == {"sin"}]
    beside = [n for n in _computed(source, _BESIDE) if _functions(n.value) == {"cos"}]
    if not ahead or not beside:
        return None
    hint = f"an angle of 0 is ahead, where its sine is 0: {chain(ahead[0].targets[0])} takes the cosine, and "
    return Clue(f"{hint}{chain(beside[0].targets[0])} the sine", source.place(ahead[0]))


def _computed(source: Source, names: set[str]) -> list[ast.Assign]:
    """Return the assignments to a variable with one of some names."""
    return [n for n in source.all(ast.Assign) if last_name(n.targets[0]).lower().strip("_") in names]


def _functions(value: ast.expr) -> set[str]:
    """Return which of sine and cosine an expression calls."""
    return {last_name(n.func) for n in ast.walk(value) if isinstance(n, ast.Call)} & {"sin", "cos"}


@hint_rule(priority=8360)
def _arguments_of_atan2(case: Case) -> Clue | None:
    """`atan2(x, y)`: y comes first."""
    if not is_told(case):
        return None
    for source in case.sources.values():
        for call in source.calls("atan2", "arctan2"):
            if len(call.args) != 2 or not (_is_called(call.args[0], "x") and _is_called(call.args[1], "y")):
                continue
            function, codes = source.code(call.func), [source.code(arg, 30) for arg in call.args]
            hint = f"{function} takes y first, then x: write {function}({codes[1]}, {codes[0]})"
            return Clue(hint, source.place(call), key=f"atan2:{first_line(call)}")
    return None


def _is_called(node: ast.expr, axis: str) -> bool:
    """Return whether all that an expression computes with is called after one axis: `x`, `dx`, `goal.x - self.x`."""
    leaves = [n for n in ast.walk(node) if isinstance(n, (ast.Name, ast.Attribute, ast.Constant))]
    inner = {id(n.value) for n in leaves if isinstance(n, ast.Attribute)}
    found = [last_name(n).lower() for n in leaves if id(n) not in inner and not isinstance(n, ast.Constant)]
    return bool(found) and all(name in (axis, f"d{axis}", f"p{axis}") or name.endswith(f"_{axis}") for name in found)
