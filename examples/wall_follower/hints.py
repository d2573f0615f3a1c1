"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast
import math

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import constant_value, given_leaf, last_name, parameters

#: More than a full turn is no angle in radians.
FULL_TURN = 2 * math.pi
#: What is too near the wall for certain, and what is too far away.
NEAR, FAR = 0.4, 0.6
#: A robot that follows a wall on its left looks from ahead on the right to behind on the left, in degrees.
LEAST, MOST = -60, 150
#: A turn rate that is no accident, in rad/s.
TURNS = 0.1
#: Through so many variables, arguments and functions a turn rate is followed back.
DEEPEST = 6
#: So many commands in moments that leave no doubt, and so large a share of them, tell that the sign is wrong.
FEWEST, SHARE = 5, 0.8


def names(case: Case) -> set[str | None]:
    """Return the last part of every name in the program."""
    return {last_name(node) for node in case.source.names()}


def ranges_read(case: Case) -> list[ast.Attribute]:
    """Return the places that read the ranges of a scan."""
    return [node for node in case.source.all(ast.Attribute) if node.attr == "ranges"]


@hint_rule("field_in_range")
def faster_than_allowed(case: Case) -> Clue | None:
    """The speed is a number above the limit."""
    for given in given_leaf(case.source, "x"):
        if case.check.field != "linear.x" or "linear" not in case.source.code(given):
            continue
        parts = factors(given.value)
        for factor in parts:
            found = constant_value(case.source, factor)
            is_speed = len(parts) == 1 or any(word in last_name(factor).lower() for word in ("speed", "vel"))
            if found is not None and is_speed and abs(found.value) > case.check.high:
                hint = f"{case.source.code(factor, 30)} is {found.value:g} m/s, and at most {case.check.high:g} m/s is"
                return Clue(f"{hint} allowed: make it less", case.source.place(found.origin))
    return None


def factors(node: ast.expr) -> list[ast.expr]:
    """Return what is multiplied in an expression."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Mult):
        return [*factors(node.left), *factors(node.right)]
    return [node]


@hint_rule("stays_in_range")
def ray_by_number(case: Case) -> Clue | None:
    """A ray is chosen by its number, as if another one were the first, and looks away from the wall and the way."""
    scans = case.trace.deliveries("/scan")
    if case.check.topic not in ("/truth/clearance", "/truth/odometry") or not scans:
        return None
    scan = scans[0].value
    for node in case.source.all(ast.Subscript):
        found = constant_value(case.source, node.slice) if last_name(node.value) == "ranges" else None
        if found is None or not -len(scan["ranges"]) <= found.value < len(scan["ranges"]):
            continue
        number = int(found.value) % len(scan["ranges"])
        angle = math.degrees(scan["angle_min"] + number * scan["angle_increment"])
        if not LEAST <= angle <= MOST:
            side = "left" if angle > 0 else "right"
            hint = (
                f"{case.source.code(node, 40)} looks {abs(angle):.0f}° to the {side} here, where no wall is to follow"
            )
            return Clue(f"{hint}: choose rays by angle_min + k * angle_increment", case.source.place(node))
    return None


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
    hint = "the first ray looks back, to angle_min: the angle of ray k is angle_min + k * angle_increment"
    return Clue(hint, case.source.place(used[0]))


@hint_rule("stays_in_range")
def angle_in_degrees(case: Case) -> Clue | None:
    """An angle of the scanner, which is in radians, meets a number in degrees."""
    if case.check.topic not in ("/truth/clearance", "/truth/odometry"):
        return None
    pairs = [
        (node.left, node.right, node) for node in case.source.all(ast.BinOp) if isinstance(node.op, ast.Add | ast.Sub)
    ]
    pairs += [(node.left, side, node) for node in case.source.all(ast.Compare) for side in node.comparators]
    for left, right, node in pairs:
        for angle, other in ((left, right), (right, left)):
            named = last_name(angle)
            found = constant_value(case.source, other)
            if "angle" not in named.lower() or "deg" in named.lower() or found is None:
                continue
            if abs(found.value) > FULL_TURN:
                hint = f"{named} is in radians, and {case.source.code(other, 30)} in degrees"
                return Clue(f"{hint}: write math.radians({found.value:g})", case.source.place(node))
    return None


@hint_rule("stays_in_range", priority=8510)
def turns_the_wrong_way(case: Case) -> Clue | None:
    """The robot turns away from a wall that is too far, or towards one that is too near."""
    given = [n for n in given_leaf(case.source, "z") if "angular" in case.source.code(n)]
    if case.check.topic != "/truth/clearance" or not given:
        return None
    wanted = {scan.t_ns: sign for scan in case.trace.deliveries("/scan") if (sign := turn_wanted(scan.value))}
    turned = [(m.t_ns, float(m.value["angular"]["z"])) for m in case.trace.messages("/cmd_vel")]
    clear = [turn * wanted[t_ns] for t_ns, turn in turned if t_ns in wanted and abs(turn) > TURNS]
    wrong = [turn for turn in clear if turn < 0]
    if len(clear) < FEWEST or len(wrong) < SHARE * len(clear):
        return None
    hint = f"{len(wrong)} of {len(clear)} times this turned away from a wall that was too far, or towards one too near"
    place = case.source.place(computed(case, given[0].value) or given[0])
    return Clue(f"{hint}: positive turns to the left, so turn the sign round", place)


def computed(case: Case, value: ast.expr, depth: int = 0) -> ast.expr | None:
    """Return the sum that a turn rate comes from, also through variables, arguments and functions that limit it."""
    if isinstance(value, ast.BinOp) and isinstance(value.op, ast.Add | ast.Sub):
        return value
    inside: list[ast.expr] = []
    if isinstance(value, ast.Call):
        inside = [argument for argument in value.args if not isinstance(argument, ast.Constant)]
    elif isinstance(value, ast.UnaryOp):
        inside = [value.operand]
    elif isinstance(value, ast.BinOp):
        inside = [value.left, value.right]
    elif isinstance(value, ast.Name):
        function = case.source.function_of(value)
        stores = [node for node in case.source.stored.get(value.id, ()) if case.source.function_of(node) is function]
        statements = [case.source.parents.get(node) for node in stores]
        inside = [statement.value for statement in statements if isinstance(statement, ast.Assign)]
        own = parameters(function) if function is not None else []
        if value.id in own:
            place = own.index(value.id) - case.source.is_method(function)
            inside += [call.args[place] for call in case.source.calls(function.name) if len(call.args) > place]
    found = (computed(case, one, depth + 1) for one in inside) if depth < DEEPEST else iter(())
    return next((one for one in found if one is not None), None)


def turn_wanted(scan: dict) -> int:
    """Return 1 where the robot has to turn left, -1 where it has to turn right, 0 where that is not certain.

    The wall on the left is too far, and the robot does not head for it; or it is too near, and the robot does.
    """
    near = [
        (distance, scan["angle_min"] + number * scan["angle_increment"])
        for number, distance in enumerate(scan["ranges"])
        if isinstance(distance, float) and scan["range_min"] <= distance <= scan["range_max"]
    ]
    distance, angle = min(near, default=(0.5, 0.0))
    if distance > FAR and math.pi / 2 <= angle <= math.pi:
        return 1
    return -1 if distance < NEAR and 0 <= angle <= math.pi / 2 else 0


@hint_rule("stays_in_range", priority=8520)
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
