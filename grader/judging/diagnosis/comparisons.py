"""Causes behind a controller that compares something else than the newest number: its text, or a mean."""

from __future__ import annotations

import ast
from collections.abc import Iterator

from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.together import AnswersTogether
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.wiring import made_for, reached, roots, text
from grader.judging.source import Source, last_name, subtree, text_of
from grader.judging.wording import number

_MEANS = ("mean", "fmean", "average", "median", "nanmean")


def _compared(case: Case) -> Iterator[tuple[Source, ast.Compare]]:
    """Yield the comparisons that the controller's subscription leads to."""
    check = case.criterion.check
    if not isinstance(check, (ThresholdResponse, AnswersTogether)) or case.fault is not None:
        return
    for source in case.sources.values():
        item = made_for(source, "subscription", check.input)
        if item is not None and made_for(source, "publisher", check.output) is not None:
            inside = reached(source, roots(source, item.callback))
            yield from ((source, n) for n in inside if isinstance(n, ast.Compare) and len(n.ops) == 1)


def _as_text(case: Case) -> Clue | None:
    """`str(msg.data) > '25'` asks which text comes first in the alphabet."""
    check = case.criterion.check
    for source, test in _compared(case):
        sides = [text(source, side) for side in (test.left, test.comparators[0])]
        said = next((side for side in sides if side is not None), None)
        ordered = isinstance(test.ops[0], (ast.Gt, ast.GtE, ast.Lt, ast.LtE))
        if said is None or not _is_number(said) or not ordered:
            continue
        limit = number(getattr(check, "threshold", 0.0))
        hint = f"{source.code(test, 50)} compares texts, letter by letter: compare the number itself with {limit}"
        return Clue(hint, source.place(test), key="as_text")
    return None


def _is_number(said: str) -> bool:
    return said.strip().replace(".", "", 1).isdigit()


def _of_many(case: Case) -> Clue | None:
    """A mean of the last values follows late, and stands still near the threshold."""
    for source, test in _compared(case):
        for node in subtree(test):
            counted = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and _sum_by_count(node)
            averaged = isinstance(node, ast.Call) and last_name(node.func) in _MEANS
            if (counted or averaged) and text_of(node) is None:
                hint = f"{source.code(node, 50)} is made of several values: compare the newest alone"
                return Clue(hint, source.place(test), key="of_many")
    return None


def _sum_by_count(node: ast.BinOp) -> bool:
    calls = [last_name(side.func) if isinstance(side, ast.Call) else "" for side in (node.left, node.right)]
    return calls[0] == "sum"


COMPARISONS = (Cause("compared_as_text", _as_text), Cause("compared_mean", _of_many))
