"""Typical mistakes of this exercise: which line has them, and what to do about it."""

import ast
from collections.abc import Iterator

from grader.api import Case, Clue, Outcome, hint_rule
from grader.api.unstable import first_line, last_name, reached


def executing(case: Case) -> Iterator[ast.AST]:
    """Yield the functions that ActionServer calls for a goal."""
    for call in case.source.calls("ActionServer"):
        named = [*call.args, *(keyword.value for keyword in call.keywords if keyword.arg == "execute_callback")]
        for name in {last_name(node) for node in named} - {""}:
            yield from (f for f in case.source.functions(name) if name != "on_goal")


@hint_rule("action_result")
def never_succeeds(case: Case) -> Clue | None:
    """A goal that returns a result without succeed() is aborted."""
    if case.check.status != "succeeded" or any(case.source.calls("succeed")):
        return None
    for function in executing(case):
        returns = [node for node in ast.walk(function) if isinstance(node, ast.Return)]
        if returns:
            hint = "nothing calls goal_handle.succeed() before this return, so that every goal is aborted"
            return Clue(hint, case.source.place(max(returns, key=first_line)))
    return None


@hint_rule("action_result")
def deaf_loop(case: Case) -> Clue | None:
    """The loop that computes does not look whether somebody cancels."""
    if case.check.status != "canceled":
        return None
    for function in executing(case):
        for loop in ast.walk(function):
            if not isinstance(loop, ast.While | ast.For):
                continue
            asked = {last_name(node) for node in reached(case.source, [loop])}
            if "is_cancel_requested" not in asked:
                hint = "this loop runs to its end whoever cancels: leave it once goal_handle.is_cancel_requested"
                return Clue(f"{hint} is true", case.source.place(loop))
    return None


@hint_rule("fibonacci_results", outcome=Outcome.NOT_MET)
def last_number_cut_off(case: Case) -> Clue | None:
    """`sequence[:order]` leaves out number `order`."""
    if case.facts is None or case.facts.lacking != 1:
        return None
    for node in case.source.all(ast.Subscript):
        upper = node.slice.upper if isinstance(node.slice, ast.Slice) else None
        if last_name(upper) == "order" and not isinstance(upper, ast.BinOp):
            hint = f"{case.source.code(node)} leaves out the last number: an order of 5 has six, up to order + 1"
            return Clue(hint, case.source.place(node))
    return None


@hint_rule("logs_matching")
def no_feedback_callback(case: Case) -> Clue | None:
    """The client asks for no feedback."""
    calls = list(case.source.calls("send_goal_async"))
    given = [k.arg for call in calls for k in call.keywords] + [None for call in calls for _ in call.args[1:]]
    if case.criterion.id != "logs_feedback" or len(calls) != 1 or given.count(None) or "feedback_callback" in given:
        return None
    hint = f"{case.source.code(calls[0], 50)} asks for no feedback: give it a feedback_callback"
    return Clue(hint, case.source.place(calls[0]))
