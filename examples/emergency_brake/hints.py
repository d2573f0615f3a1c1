"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast
import math
from collections.abc import Iterator

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import (
    chain,
    conditions,
    constant_value,
    last_name,
    made,
    names_in,
    number_in_code,
    publish_calls,
    runs,
    subtree,
)

#: More than a full turn is no angle in radians.
FULL_TURN = 2 * math.pi


def names(case: Case) -> set[str | None]:
    """Return the last part of every name in the program."""
    return {last_name(node) for node in case.source.names()}


def ranges_read(case: Case) -> list[ast.Attribute]:
    """Return the places that read the ranges of a scan."""
    return [node for node in case.source.all(ast.Attribute) if node.attr == "ranges"]


@hint_rule("stays_in_range")
def one_ray_ahead(case: Case) -> Clue | None:
    """Only one of the rays is looked at, usually the one straight ahead."""
    read, parents = ranges_read(case), case.source.parents
    indexed = [parents[node] for node in read if isinstance(parents.get(node), ast.Subscript)]
    single = [node for node in indexed if isinstance(node, ast.Subscript) and not isinstance(node.slice, ast.Slice)]
    if (
        case.check.topic != "/truth/collisions"
        or not single
        or any(any(case.source.around(node, (ast.For, ast.While, ast.comprehension))) for node in single)
    ):
        return None
    hint = f"{case.source.code(single[0], 50)} is one ray of many: look at all of them that the robot may run into"
    return Clue(hint, case.source.place(single[0]))


@hint_rule("stays_in_range")
def dust_is_no_wall(case: Case) -> Clue | None:
    """Ranges are used that the scanner cannot have measured."""
    read = ranges_read(case)
    if case.check.topic != "/truth/odometry" or "range_min" in names(case) or not read:
        return None
    hint = f"{case.source.code(read[0])} has dust in it: leave out what is below range_min or above range_max"
    return Clue(hint, case.source.place(read[0]))


@hint_rule("stays_in_range")
def first_ray_behind(case: Case) -> Clue | None:
    """The angles of the rays are counted from the first one, which does not look ahead."""
    read = ranges_read(case)
    if case.check.topic != "/truth/collisions" or "angle_min" in names(case) or "angle_increment" not in names(case):
        return None
    if any(isinstance(case.source.parents.get(node), ast.Subscript) for node in read):  # not ray by ray
        return None
    hint = "the first ray looks back here: the angle of ray k is angle_min + k * angle_increment"
    used = next(node for node in case.source.all(ast.Attribute) if node.attr == "angle_increment")
    return Clue(hint, case.source.place(used)) if read else None


@hint_rule("stays_in_range", "field_in_range")
def silent_while_braking(case: Case) -> Clue | None:
    """Commands are published only while the way is free."""
    calls = publish_calls(case.source)
    tests = [next(iter(conditions(case.source, call)), None) for call in calls]
    test = tests[0] if len(tests) == 1 else None
    if case.check.topic != "/truth/collisions" or test is None:
        return None
    if test.orelse and calls[0] not in {part for statement in test.orelse for part in subtree(statement)}:
        hint = f"nothing is published here, where 'if {case.source.code(test.test, 50)}' is false, and a robot goes on as"
        return Clue(f"{hint} it was told last: publish a Twist of zeros", case.source.place(test.orelse[0]))
    hint = f"under 'if {case.source.code(test.test, 50)}' nothing is published otherwise, and a robot goes on as it "
    return Clue(f"{hint}was told last: publish a Twist of zeros too", case.source.place(test))


def kept_of_scans(case: Case) -> set[str]:
    """Return what the callback of the scanner stores, such as `self.nearest` or a variable of the file."""
    heard = [item for item in made(case.source, "subscription") if item.type == "LaserScan"]
    inside = [node for item in heard for node in runs(case.source, item)]
    stored = {chain(node) for node in inside if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)}
    shared = {name for node in inside if isinstance(node, ast.Global) for name in node.names}
    return {dotted for dotted in stored if dotted.startswith("self.")} | shared


def comparisons(case: Case) -> Iterator[tuple[ast.Compare, ast.expr, ast.expr]]:
    """Yield each comparison of what the scanner saw with something else: the smaller side, then the larger one."""
    kept = kept_of_scans(case)
    for node in case.source.all(ast.Compare):
        if (
            len(node.ops) != 1
            or not names_in(node) & kept
            or not isinstance(node.ops[0], ast.Lt | ast.LtE | ast.Gt | ast.GtE)
        ):
            continue
        left, right = node.left, node.comparators[0]
        yield (node, left, right) if isinstance(node.ops[0], ast.Lt | ast.LtE) else (node, right, left)


@hint_rule("stays_in_range")
def angle_in_degrees(case: Case) -> Clue | None:
    """An angle of the scanner, which is in radians, is compared with a number in degrees."""
    if case.criterion.id not in ("passes_on", "passes_walls", "hits_nothing", "ignores_dust"):
        return None
    for node in case.source.all(ast.Compare):
        angles = [name for name in names_in(node) if "angle" in name.lower() and "deg" not in name.lower()]
        for side in (node.left, *node.comparators):
            found = constant_value(case.source, side)
            if (
                angles
                and found is not None
                and abs(found.value) > FULL_TURN
                and "degrees" not in case.source.code(node)
            ):
                hint = f"{angles[0]} is in radians, and {case.source.code(side, 30)} in degrees: write math.radians"
                return Clue(f"{hint}({found.value:g})", case.source.place(found.origin))
    return None


@hint_rule("stays_in_range")
def drives_while_near(case: Case) -> Clue | None:
    """The driver's command is passed on while something is near, and not while the way is free."""
    if case.criterion.id != "passes_on":
        return None
    kept = kept_of_scans(case)
    for node, smaller, _ in comparisons(case):
        test = case.source.parents.get(node)
        if not isinstance(test, ast.If) or not names_in(smaller) & kept:
            continue
        moves = [part for statement in test.body for part in subtree(statement) if isinstance(part, ast.Assign)]
        given = [
            part
            for part in moves
            if last_name(part.targets[0]) == "x" and number_in_code(case.source, part.value) is None
        ]
        if given:
            hint = f"under 'if {case.source.code(node, 50)}' the robot drives while something is near"
            return Clue(f"{hint}, and only then: turn the comparison round", case.source.place(test))
    return None


@hint_rule("stays_in_range")
def not_in_metres(case: Case) -> Clue | None:
    """The distance to brake at is longer than the scanner can see: it is in another unit."""
    scans = case.trace.deliveries("/scan")
    if case.criterion.id != "passes_on" or not scans:
        return None
    far = float(scans[0].value["range_max"])
    for node, _, _ in comparisons(case):
        for part in subtree(node):
            found = constant_value(case.source, part) if isinstance(part, ast.expr) else None
            if found is not None and found.value > far:
                hint = f"{case.source.code(part, 30)} is {found.value:g} m, and the scanner sees {far:g} m at most"
                return Clue(f"{hint}: ranges are in metres", case.source.place(found.origin))
    return None


@hint_rule("stays_in_range")
def brake_is_kept(case: Case) -> Clue | None:
    """A flag is set when the brake is pulled, and never taken back."""
    if case.criterion.id != "lets_go":
        return None
    set_ = [node for node in case.source.all(ast.Assign) if isinstance(node.value, ast.Constant)]
    flags = [node for node in set_ if node.value.value is True and isinstance(node.targets[0], ast.Attribute)]
    for flag in flags:
        name = flag.targets[0].attr
        back = [node for node in set_ if last_name(node.targets[0]) == name and node.value.value is False]
        if all(
            any(around.name == "__init__" for around in case.source.around(node, (ast.FunctionDef,))) for node in back
        ):
            hint = f"{case.source.code(flag.targets[0])} is never False again: decide again for every command"
            return Clue(hint, case.source.place(flag))
    for kept in case.source.all(ast.Assign):
        name = chain(kept.targets[0])
        if isinstance(kept.value, ast.BoolOp) and isinstance(kept.value.op, ast.Or) and name in names_in(kept.value):
            hint = f"once {name} is True, this line keeps it so: decide again for every command, without '{name} or'"
            return Clue(hint, case.source.place(kept))
    return None


@hint_rule("stays_in_range", "field_in_range")
def passes_on_everything(case: Case) -> Clue | None:
    """The driver's command itself is published, whatever the scanner sees."""
    drivers = [item for item in made(case.source, "subscription") if item.type == "Twist"]
    inside = {node for item in drivers for node in runs(case.source, item)}
    heard = {node.arg for node in inside if isinstance(node, ast.arg)} - {"self"}
    sent = [call for call in publish_calls(case.source) if call in inside and call.args]
    changed = [node for node in inside if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)]
    if case.criterion.id not in ("blind", "hits_nothing") or len(sent) != 1 or chain(sent[0].args[0]) not in heard:
        return None
    if any(conditions(case.source, sent[0])) or any(chain(c).startswith(f"{chain(sent[0].args[0])}.") for c in changed):
        return None
    hint = f"{case.source.code(sent[0])} passes on what the driver wants, whatever is in the way: publish a command"
    return Clue(f"{hint} of your own", case.source.place(sent[0]))


@hint_rule("stays_in_range")
def free_before_the_first_scan(case: Case) -> Clue | None:
    """What the scanner will tell begins with a value at which the robot drives."""
    if case.criterion.id != "blind":
        return None
    scanned = {node for item in made(case.source, "subscription") for node in runs(case.source, item)}
    for name in sorted(kept_of_scans(case)):
        first = [case.source.parents.get(node) for node in case.source.stored[name] if node not in scanned]
        begins = [node for node in first if isinstance(node, ast.Assign) and begins_free(case, node.value)]
        if begins and len(first) == 1:
            hint = f"{case.source.code(begins[0], 40)} before the first scan, as if the way were free"
            return Clue(f"{hint}: begin with a value at which the robot stands", case.source.place(begins[0]))
    return None


def begins_free(case: Case, value: ast.expr) -> bool:
    """Return whether a first value stands for a long way, or for one in which there is nothing."""
    far = constant_value(case.source, value)
    endless = chain(value) in ("math.inf", "np.inf", "numpy.inf", "sys.maxsize")
    text = value.args[0] if isinstance(value, ast.Call) and last_name(value.func) == "float" and value.args else None
    endless = endless or (isinstance(text, ast.Constant) and str(text.value).lower().lstrip("+") in ("inf", "infinity"))
    return endless or (far is not None and far.value > 0) or (isinstance(value, ast.Constant) and value.value is False)


@hint_rule("stays_in_range")
def one_side_of_the_angle(case: Case) -> Clue | None:
    """An angle is compared with one limit, which leaves out one side only."""
    if case.criterion.id not in ("passes_on", "passes_walls", "hits_nothing", "ignores_dust", "lets_go"):
        return None
    found = []
    for node in case.source.all(ast.Compare):
        sides = [node.left, *node.comparators]
        angles = [side for side in sides if isinstance(side, ast.Name | ast.Attribute) and is_angle(last_name(side))]
        limits = [constant_value(case.source, side) for side in sides if side not in angles]
        if angles and limits and all(limit is not None and limit.value for limit in limits):
            found += [(node, last_name(angles[0]), limit.value) for limit in limits]
    for node, angle, limit in found:
        others = [other for _, named, other in found if named == angle]
        if abs(limit) < math.pi and all(other * limit > 0 for other in others):
            code = case.source.code(node, 40)
            side = "left" if limit > 0 else "right"
            hint = f"{code} has one limit, on the {side}, and angles are negative on the right"
            return Clue(f"{hint}: compare abs({angle})", case.source.place(node))
    return None


def is_angle(name: str) -> bool:
    """Return whether a variable is called like an angle in radians."""
    return name.lower() in ("a", "phi", "theta", "alpha", "bearing") or "angle" in name.lower()


@hint_rule("stays_in_range", priority=8500)
def brakes_too_late(case: Case) -> Clue | None:
    """The robot was told to stop before it hit something, too late for its speed."""
    if case.check.topic != "/truth/collisions":
        return None
    hits = [d.t_ns for d in case.trace.deliveries("/truth/collisions") if d.value["data"]]
    told = [m for m in case.trace.messages("/cmd_vel") if hits and m.t_ns < hits[0]]
    stops = [m for m in told if not m.value["linear"]["x"]]
    driven = [m for m in told if m.value["linear"]["x"] > 0]
    clear = [d for d in case.trace.deliveries("/truth/clearance") if stops and d.t_ns <= stops[-1].t_ns]
    compared = [node for node, _, _ in comparisons(case)]
    if not (stops and driven and clear and compared) or stops[-1].t_ns < driven[-1].t_ns:
        return None
    first = next(m for m in stops if m.t_ns > driven[-1].t_ns)
    way = next(d.value["data"] for d in reversed(clear) if d.t_ns <= first.t_ns)
    speed = driven[-1].value["linear"]["x"]
    hint = f"this brakes {way:.2f} m from what is in the way, at {speed:.2f} m/s: add the way that the robot takes to"
    return Clue(f"{hint} stop, speed * speed / (2 * 0.8)", case.source.place(compared[0]))
