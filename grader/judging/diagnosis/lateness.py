"""Causes behind answers that are right for an earlier value: what is compared is old, or stored too late."""

from __future__ import annotations

import ast

from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.together import AnswersTogether
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import number_at
from grader.judging.diagnosis.wiring import made_for, reached, roots
from grader.judging.source import Source, chain, first_line, last_name, subtree
from grader.judging.wording import number

#: Answers put off by no more than this are prompt enough.
_PROMPT_S = 0.3


def _compared(case: Case) -> tuple[Source, list[ast.Compare]] | None:
    """Return the controller and the comparisons that its subscription leads to, if its answers are late."""
    check = case.criterion.check
    late = case.evidence("lag_s") is not None or case.evidence("behind") is not None
    if not isinstance(check, (ThresholdResponse, AnswersTogether)) or not late or case.fault is not None:
        return None
    for source in case.sources.values():
        item = made_for(source, "subscription", check.input)
        if item is not None and made_for(source, "publisher", check.output) is not None:
            inside = reached(source, roots(source, item.callback))
            return source, [n for n in inside if isinstance(n, ast.Compare)]
    return None


def _stored_late(case: Case) -> Clue | None:
    """An attribute is compared first, and given the new value only afterwards."""
    found = _compared(case)
    if found is None:
        return None
    source, compared = found
    for test in compared:
        for node in subtree(test):
            name = chain(node) if isinstance(node, ast.Attribute) else ""
            stores = [s for s in source.stores(name) if source.function_of(s) is source.function_of(test)]
            if len(stores) == 1 and first_line(stores[0]) > first_line(test):
                stored = source.code(source.parents.get(stores[0], stores[0]), 40)
                hint = f"{source.code(test, 40)} is asked before '{stored}': it sees the value that came before"
                return Clue(hint, source.place(test), key="late_answer")
    return None


def _put_off(case: Case) -> Clue | None:
    """The answer is handed to a timer, or the callback sleeps before it answers."""
    found = _compared(case)
    if found is None:
        return None
    source = found[0]
    item = made_for(source, "subscription", str(getattr(case.criterion.check, "input", "")))
    for node in reached(source, roots(source, item.callback)) if item is not None else ():
        name = last_name(node.func) if isinstance(node, ast.Call) else ""
        if isinstance(node, ast.Call) and name in ("Timer", "create_timer", "sleep", "call_later"):
            worth = number_at(source, node.args[0] if node.args else None)
            if worth is not None and worth > _PROMPT_S:
                hint = f"{source.code(node, 50)} puts the answer off by {number(worth)} s: answer at once"
                return Clue(hint, source.place(node), key="late_answer")
    return None


def _oldest(case: Case) -> Clue | None:
    """The oldest of the values that are kept is compared."""
    found = _compared(case)
    if found is None:
        return None
    source, compared = found
    for test in compared:
        for node in subtree(test):
            if isinstance(node, ast.Subscript) and number_at(source, node.slice) == 0 and _grows(source, node.value):
                hint = f"{source.code(node, 40)} is the oldest of the values that are kept: compare the newest"
                return Clue(hint, source.place(test), key="late_answer")
    return None


def _grows(source: Source, values: ast.expr) -> bool:
    """Return whether new values are put at the end of a list or the like."""
    calls = (c for c in source.calls("append") if isinstance(c.func, ast.Attribute))
    return chain(values) != "" and any(chain(c.func) == f"{chain(values)}.append" for c in calls)


LATENESS = (
    Cause("stored_late", _stored_late),
    Cause("oldest_compared", _oldest),
    Cause("put_off", _put_off),
)
