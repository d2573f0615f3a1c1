"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import chain, conditions, last_name, publish_calls


def ranges_read(case: Case) -> list[ast.Attribute]:
    """Return the places that read the ranges of a scan."""
    return [node for node in case.source.all(ast.Attribute) if node.attr == "ranges"]


@hint_rule("stays_in_range")
def one_ray(case: Case) -> Clue | None:
    """Only one of the rays is looked at, usually the one straight ahead."""
    read, parents = ranges_read(case), case.source.parents
    indexed = [parents[node] for node in read if isinstance(parents.get(node), ast.Subscript)]
    counted = [node for node in read if last_name(getattr(parents.get(node), "func", None)) == "len"]
    single = [node for node in indexed if isinstance(node, ast.Subscript) and not isinstance(node.slice, ast.Slice)]
    in_loop = any(any(case.source.around(node, (ast.For, ast.While, ast.comprehension))) for node in single)
    if case.check.topic != "/scan" or not single or in_loop or len(single) + len(counted) < len(read):
        return None
    code = case.source.code(single[0], 50)
    return Clue(f"{code} is one ray of many: look at all ranges", case.source.place(single[0]))


@hint_rule("stays_in_range")
def every_reading(case: Case) -> Clue | None:
    """Ranges are used that the scanner cannot have measured."""
    limits = {last_name(node) for node in case.source.names()} & {"range_min", "range_max"}
    read = ranges_read(case)
    if case.check.topic != "/odom" or limits or not read:
        return None
    hint = f"{case.source.code(read[0])} has dust in it: leave out what is below range_min or above range_max"
    return Clue(hint, case.source.place(read[0]))


@hint_rule("stays_in_range")
def only_while_free(case: Case) -> Clue | None:
    """Commands are published only while the way is free."""
    calls = publish_calls(case.source)
    tests = [next(iter(conditions(case.source, call)), None) for call in calls]
    test = tests[0] if len(tests) == 1 else None
    if case.check.topic != "/scan" or test is None or not chain(calls[0].func):
        return None
    hint = f"under 'if {case.source.code(test.test, 50)}' nothing is published otherwise, and a robot goes on as it "
    return Clue(f"{hint}was told last: publish a Twist of zeros too", case.source.place(test))
