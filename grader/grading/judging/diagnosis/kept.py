"""Causes in what a node keeps from one callback to the next: a flag, a state or a last value that never changes again.

They are asked late, and only about robots in simulations and clients of actions.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.grading.judging.diagnosis.rules import CLIENT_CHECKS, Case, Clue, hint_rule, is_told
from grader.grading.judging.diagnosis.wiring import attributes_read, names_attributes_by_text, names_called, names_in
from grader.grading.judging.source import Source, chain, last_name

#: How programs call what they keep of the last time.
_LAST = ("last", "prev", "old")


def _sources(case: Case) -> Iterator[Source]:
    """Yield the files of a robot or of a client of an action, without those that set attributes by their names."""
    if is_told(case) or case.criterion.check_name in CLIENT_CHECKS:
        yield from (s for s in case.sources.values() if not names_attributes_by_text(s))


def _kept(source: Source) -> Iterator[tuple[str, list[ast.Assign], list[ast.Assign]]]:
    """Yield the attributes that `__init__` sets and something reads, with what sets them there, and elsewhere."""
    read = attributes_read(source)
    for dotted in source.stored:
        if not dotted.startswith("self.") or dotted.count(".") > 1 or dotted not in read:
            continue
        statements = [source.parents.get(n) for n in source.stores(dotted)]
        plain = [s for s in statements if isinstance(s, ast.Assign) and len(s.targets) == 1]
        first = [s for s in plain if source.function_name(s) == "__init__"]
        if len(plain) == len(statements) and first:
            yield dotted, first, [s for s in plain if s not in first]


@hint_rule(priority=8400)
def _never_leaves_a_state(case: Case) -> Clue | None:
    """A state is compared with its first value, and only set to others later, in a robot that has no end."""
    for source in _sources(case):
        for dotted, first, later in _kept(source):
            begins = {ast.dump(s.value) for s in first}
            if len(begins) != 1 or not later or any(not _is_plain(s.value) for s in (*first, *later)):
                continue
            asked = [n for n in source.all(ast.Compare) if chain(n.left) == dotted and len(n.ops) == 1]
            back = [n for n in asked if isinstance(n.ops[0], ast.Eq) and ast.dump(n.comparators[0]) in begins]
            if not back or begins & {ast.dump(s.value) for s in later} or not is_told(case):
                continue
            hint = (
                f"{dotted} is never {source.code(first[0].value, 30)} again after this: set it back once that is over"
            )
            return Clue(hint, source.place(later[-1]), key=f"kept:{dotted}")
    return None


def _is_plain(value: ast.expr) -> bool:
    """Return whether a value is a number, a text, or a name in capitals or of an enumeration."""
    return isinstance(value, ast.Constant) or last_name(value).isupper()


@hint_rule(priority=8410)
def _flag_stays(case: Case) -> Clue | None:
    """The flag that a goal is cancelled is never taken back, or a flag is only set where it is true."""
    for source in _sources(case):
        for dotted, first, later in _kept(source):
            if (
                all(_is_bool(s.value, wanted=False) for s in first)
                and later
                and all(_is_bool(s.value, wanted=True) for s in later)
            ):
                if all(_cancels_once(source, dotted, s) for s in later):
                    hint = (
                        f"{dotted} is never False again, so only the first goal is cancelled: set it to False where the"
                    )
                    return Clue(f"{hint} next goal is sent", source.place(later[0]), key=f"kept:{dotted}")
            elif len(later) == 1 and _is_condition(source, later[0]):
                hint = (
                    f"this sets {dotted} only where {source.code(later[0].value, 30)} is true, so it never turns False"
                )
                return Clue(f"{hint} again: set it each time", source.place(later[0]), key=f"kept:{dotted}")
    return None


def _is_bool(value: ast.expr, *, wanted: bool) -> bool:
    return isinstance(value, ast.Constant) and value.value is wanted


def _cancels_once(source: Source, dotted: str, statement: ast.Assign) -> bool:
    """Return whether an assignment stands beside the cancelling of a goal, under a condition that asks for the flag."""
    tests = [test for test in source.around(statement, ast.If) if dotted in names_in(test.test)]
    return any(names_called(source, test.body) & {"cancel_goal_async", "cancel_goal"} for test in tests)


def _is_condition(source: Source, statement: ast.Assign) -> bool:
    """Return whether a name is assigned where it is true itself, and in no other case but before the first time."""
    test = next(source.around(statement, ast.If), None)
    if not isinstance(statement.value, ast.Name) or test is None or statement not in test.body or test.orelse:
        return False
    asked = test.test
    parts = asked.values if isinstance(asked, ast.BoolOp) and isinstance(asked.op, ast.Or) else [asked]
    rest = [p for p in parts if not (isinstance(p, ast.Name) and p.id == statement.value.id)]
    target = chain(statement.targets[0])
    return len(rest) < len(parts) and all(isinstance(p, ast.Compare) and chain(p.left) == target for p in rest)


@hint_rule(priority=8420)
def _last_value_stays(case: Case) -> Clue | None:
    """What is called the last value keeps its first one."""
    for source in _sources(case):
        for dotted, first, later in _kept(source):
            name = dotted.removeprefix("self.").lstrip("_").lower()
            if later or len(first) != 1 or not name.startswith(_LAST):
                continue
            used = [
                n
                for n in source.all(ast.Attribute)
                if chain(n) == dotted and isinstance(n.ctx, ast.Load) and source.function_name(n) != "__init__"
            ]
            if used:
                hint = (
                    f"{dotted} stays {source.code(first[0].value, 20)}, because nothing sets it after __init__: set it"
                )
                return Clue(f"{hint} to the new value below", source.place(used[0]), key=f"kept:{dotted}")
    return None
