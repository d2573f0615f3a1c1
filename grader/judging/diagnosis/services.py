"""Causes behind services that are not asked or not answered: what waits for an answer that cannot be taken."""

from __future__ import annotations

import ast

from grader.judging.checks.clients import ServiceCalls
from grader.judging.checks.decisions import ReactsToResponses
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.source import Source, last_name


def _shared_group(case: Case) -> Clue | None:
    """A callback awaits the answer of a client that is of the same group, whose callbacks run one at a time."""
    checks = (ServiceCalls, ReactsToResponses)
    if not isinstance(case.criterion.check, checks) or case.source is None or case.fault is not None:
        return None
    source = case.source
    grouped = any(k.arg == "callback_group" for k in source.all(ast.keyword))
    clients, waits = list(source.calls("create_client")), _waits(source)
    if grouped or not waits or len(clients) != 1:
        return None
    hint = f"{source.code(waits[0])} waits in a callback, and the client shares its callback group: "
    hint += "no answer is taken meanwhile; create_client(..., callback_group=ReentrantCallbackGroup())"
    return Clue(hint, source.place(clients[0]), key="shared_group")


def _waits(source: Source) -> list[ast.AST]:
    """Return the places where a function awaits an answer of a service."""
    return [
        n for n in source.all(ast.Await) if isinstance(n.value, ast.Call) and last_name(n.value.func) == "call_async"
    ]


SERVICES = (Cause("shared_callback_group", _shared_group),)
