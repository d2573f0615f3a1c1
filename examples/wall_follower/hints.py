"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import last_name


def names(case: Case) -> set[str | None]:
    """Return the last part of every name in the program."""
    return {last_name(node) for node in case.source.names()}


def ranges_read(case: Case) -> list[ast.Attribute]:
    """Return the places that read the ranges of a scan."""
    return [node for node in case.source.all(ast.Attribute) if node.attr == "ranges"]


@hint_rule("stays_in_range")
def dust_is_near(case: Case) -> Clue | None:
    """Ranges are used that the scanner cannot have measured."""
    read = ranges_read(case)
    if case.check.topic not in ("/truth/clearance", "/truth/odometry") or "range_min" in names(case) or not read:
        return None
    hint = f"{case.source.code(read[0])} has dust and NaN in it: leave out what is not from range_min to range_max"
    return Clue(hint, case.source.place(read[0]))


@hint_rule("stays_in_range")
def first_ray_looks_back(case: Case) -> Clue | None:
    """The angles of the rays are counted from the first one, which does not look ahead."""
    used = [node for node in case.source.all(ast.Attribute) if node.attr == "angle_increment"]
    if case.check.topic != "/truth/clearance" or "angle_min" in names(case) or not used:
        return None
    hint = "the first ray looks back here: the angle of ray k is angle_min + k * angle_increment"
    return Clue(hint, case.source.place(used[0]))


@hint_rule("stays_in_range")
def full_left_or_right(case: Case) -> Clue | None:
    """The turn rate is one of two, whatever the distance is."""
    choices = [node for node in case.source.all(ast.IfExp) if _is_opposite(node.body, node.orelse)]
    if case.check.topic != "/truth/clearance" or not choices:
        return None
    code = case.source.code(choices[0].body, 30)
    hint = f"it turns by {code} either way, however near it is: let the turn rate grow with the error of the distance"
    return Clue(hint, case.source.place(choices[0]))


def _is_opposite(one: ast.expr, other: ast.expr) -> bool:
    """Return whether one of two expressions is the other one with a minus."""
    pairs = ((one, other), (other, one))
    return any(isinstance(b, ast.UnaryOp) and ast.dump(a) == ast.dump(b.operand) for a, b in pairs)
