"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast
from collections.abc import Iterator

from grader.api import Case, Clue, hint_rule
from grader.api.unstable import first_line, names_in


def named(node: ast.AST, *names: str) -> bool:
    """Return whether a part of the program uses one of some names or attributes."""
    found = (getattr(one, "attr", getattr(one, "id", "")) for one in ast.walk(node))
    return any(name in names for name in found)


def branches(case: Case, *names: str) -> Iterator[ast.If]:
    """Yield the conditions that use one of some names, in the order of the program."""
    found = (node for node in case.source.all(ast.If) if named(node.test, *names))
    yield from sorted(found, key=first_line)


@hint_rule("sends_goals")
def goals_in_a_loop(case: Case) -> Clue | None:
    """A loop sends every goal before the first one has ended."""
    for loop in sorted(case.source.all(ast.For), key=first_line):
        if named(loop, "send_goal_async", "send", "send_goal"):
            hint = "this loop sends every goal at once: send the next one from the callback of get_result_async"
            return Clue(hint, case.source.place(loop))
    return None


@hint_rule("after_goal")
def rejected_for_good(case: Case) -> Clue | None:
    """A goal that was rejected is not sent again."""
    if case.check.end != "rejected":
        return None
    for branch in branches(case, "accepted"):
        if not named(ast.Module(branch.body, []), "create_timer", "send", "send_goal_async"):
            hint = "nothing sends the goal again after a rejection: start a timer here that does"
            return Clue(hint, case.source.place(branch))
    return None


@hint_rule("after_goal")
def stops_after_a_failure(case: Case) -> Clue | None:
    """Only a goal that succeeded is followed by the next one."""
    if case.check.end not in ("aborted", "canceled"):
        return None
    for branch in branches(case, "STATUS_SUCCEEDED"):
        if any(isinstance(node, ast.Return) for node in branch.body) or named(ast.Module(branch.body, []), "send"):
            hint = "only a goal that succeeded leads to the next place: go on whatever the status of the result is"
            return Clue(hint, case.source.place(branch))
    return None


@hint_rule("cancels_goal", "logs_values")
def feedback_not_asked_for(case: Case) -> Clue | None:
    """The client asks for no feedback."""
    calls = list(case.source.calls("send_goal_async"))
    if len(calls) != 1 or len(calls[0].args) > 1 or calls[0].keywords:
        return None
    hint = f"{case.source.code(calls[0], 50)} asks for no feedback: give it a feedback_callback"
    return Clue(hint, case.source.place(calls[0]))


@hint_rule("cancels_goal")
def cancel_forgotten(case: Case) -> Clue | None:
    """Nothing cancels a goal."""
    if any(case.source.calls("cancel_goal_async", "cancel_goal")):
        return None
    for branch in branches(case, "number_of_recoveries"):
        hint = "nothing cancels the goal: call cancel_goal_async of its goal handle here"
        return Clue(hint, case.source.place(branch))
    return None


@hint_rule("sends_goals")
def rejected_place_is_skipped(case: Case) -> Clue | None:
    """A rejected goal moves on to the next place, as a result does."""
    indices = {
        name for node in case.source.all(ast.Subscript) if named(node.value, "PLACES") for name in names_in(node)
    }
    for branch in branches(case, "accepted"):
        found = [node for part in branch.body for node in ast.walk(part) if isinstance(node, ast.AugAssign)]
        counted = [node for node in found if case.source.code(node.target) in indices]
        if case.check.goals and counted and isinstance(branch.test, ast.UnaryOp):
            hint = f"{case.source.code(counted[0])} skips a place that was rejected: send the same one again"
            return Clue(hint, case.source.place(counted[0]))
    return None


@hint_rule("sends_goals")
def begins_at_another_place(case: Case) -> Clue | None:
    """The number of the place does not begin at 0."""
    indexed = [node for node in case.source.all(ast.Subscript) if named(node.value, "PLACES")]
    if not case.check.goals or len(indexed) != 1:
        return None
    stores = case.source.stored.get(case.source.code(indexed[0].slice), ())
    first = case.source.parents.get(stores[0]) if stores else None
    begins = first.value.value if isinstance(first, ast.Assign) and isinstance(first.value, ast.Constant) else 0
    if isinstance(begins, bool) or not isinstance(begins, int) or begins == 0:
        return None
    hint = f"{case.source.code(first)}: the first place is number 0 of PLACES"
    return Clue(hint, case.source.place(first))
