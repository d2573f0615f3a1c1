"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import conditions, last_name, publish_calls


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


@hint_rule("stays_in_range")
def silent_while_braking(case: Case) -> Clue | None:
    """Commands are published only while the way is free."""
    calls = publish_calls(case.source)
    tests = [next(iter(conditions(case.source, call)), None) for call in calls]
    test = tests[0] if len(tests) == 1 else None
    if case.check.topic != "/truth/collisions" or test is None:
        return None
    hint = f"under 'if {case.source.code(test.test, 50)}' nothing is published otherwise, and a robot goes on as it "
    return Clue(f"{hint}was told last: publish a Twist of zeros too", case.source.place(test))


@hint_rule("stays_in_range")
def brake_is_kept(case: Case) -> Clue | None:
    """A flag is set when the brake is pulled, and never taken back."""
    if case.check.topic != "/truth/odometry" or "range_min" not in names(case):
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
    return None
