"""The cause behind a node that stays silent until it hears something that nobody sends."""

from __future__ import annotations

import ast

from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.silence import silent_topic, speaker
from grader.judging.diagnosis.wiring import Made, conditions, is_flag, made, made_for, publish_calls, reached, roots
from grader.judging.source import Source, chain
from grader.judging.wording import quote


def _waits_to_hear(case: Case) -> Clue | None:
    """Whatever publishes depends on an attribute that only a subscription sets, to a topic without messages."""
    topic = silent_topic(case)
    source = speaker(case, topic) if topic else None
    if source is None or case.fault is not None:
        return None
    calls = publish_calls(source, made_for(source, "publisher", topic))
    for item in made(source, "subscription"):
        unheard = item.topic is not None and not _heard(case, item.topic)
        tests = [_held_back(source, call, item) for call in calls] if unheard else []
        if tests and tests[0] is not None and all(tests):
            hint = f"'if {source.code(tests[0].test, 40)}' holds everything back until a message comes on "
            hint += f"{quote(item.topic or '', 60)}, and none does: publish without it"
            return Clue(hint, source.place(tests[0]), key=f"told:{item.call.lineno}")
    return None


def _heard(case: Case, written: str) -> bool:
    topic = f"/{written.strip('/')}"
    return bool(case.trace.deliveries(topic) or case.trace.messages(topic))


def _held_back(source: Source, call: ast.Call, item: Made) -> ast.If | None:
    """Return the condition on which a call waits for what the callback of a subscription stores."""
    brought = {
        chain(n)
        for n in reached(source, roots(source, item.callback))
        if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)
    }
    for test in conditions(source, call):
        asked = {chain(n) for n in ast.walk(test.test) if isinstance(n, ast.Attribute)}
        others = [s for name in asked & brought for s in source.stores(name) if not _from(source, s, item)]
        early = all((f := source.function_of(s)) is not None and f.name == "__init__" for s in others)
        if is_flag(test.test) and asked & brought and early:
            return test
    return None


def _from(source: Source, store: ast.AST, item: Made) -> bool:
    return store in set(reached(source, roots(source, item.callback)))


WAITING = (Cause("waits_to_hear", _waits_to_hear),)
