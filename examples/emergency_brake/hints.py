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
    hint = f"under 'if {case.source.code(test.test, 50)}' nothing is published otherwise, and a robot goes on as it "
    return Clue(f"{hint}was told last: publish a Twist of zeros too", case.source.place(test))


def kept_of_scans(case: Case) -> set[str]:
    """Return what the callback of the scanner stores, such as `self.nearest`."""
    heard = [item for item in made(case.source, "subscription") if item.type == "LaserScan"]
    inside = [node for item in heard for node in runs(case.source, item)]
    stored = {chain(node) for node in inside if isinstance(node, ast.Attribute) and isinstance(node.ctx, ast.Store)}
    return {dotted for dotted in stored if dotted.startswith("self.")}


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
