"""Causes behind temperatures that are out of range or not drawn."""

from __future__ import annotations

import ast

from grader.judging.checks.sensor import RandomInRange
from grader.judging.checks.together import AnswersTogether
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import number_at
from grader.judging.diagnosis.fields import given_leaf
from grader.judging.diagnosis.source import Source, chain, last_name
from grader.judging.diagnosis.wiring import made, made_for, reached, roots
from grader.judging.values import published, readings
from grader.judging.wording import number

_DRAWS: tuple[str, ...] = ("uniform", "randint", "random", "randrange", "gauss", "normalvariate", "choice", "choices")
_DRAWS += ("normal", "rand", "randn", "triangular", "integers", "sample", "betavariate", "random_sample", "randbelow")


def _asked(case: Case) -> tuple[Source, RandomInRange] | None:
    check = case.criterion.check
    if not isinstance(check, RandomInRange) or case.source is None or case.fault is not None:
        return None
    return case.source, check


def draws(source: Source) -> list[ast.Call]:
    """Return the calls that draw a number."""
    return list(source.calls(*_DRAWS))


def _limits(case: Case) -> Clue | None:
    """The limits of what is drawn are not those asked for."""
    found = _asked(case)
    if found is None or case.evidence("outside") is None:
        return None
    source, check = found
    calls = draws(source)
    if len(calls) != 1:
        return None
    name, function = last_name(calls[0].func), chain(calls[0].func)
    low, high = number(check.low), number(check.high)
    if name in ("gauss", "normalvariate", "normal"):
        if list(source.calls("min", "max", "clip")):
            return None
        right = f"random.uniform({float(check.low)}, {float(check.high)})"
        return Clue(
            f"{source.code(calls[0])} has no limits, some values lie far out: {right}",
            source.place(calls[0]),
            key="draw",
        )
    limits = [number_at(source, a) for a in calls[0].args]
    if name not in ("uniform", "randint") or None in limits or limits == [check.low, check.high] or len(limits) != 2:
        return None
    right = (
        f"{function}({low}, {high})" if name == "randint" else f"{function}({float(check.low)}, {float(check.high)})"
    )
    return Clue(f"{source.code(calls[0])} draws outside {low} to {high}: {right}", source.place(calls[0]), key="draw")


def _drawn_once(case: Case) -> Clue | None:
    """The value is drawn when the node starts and never again, or the seed is set each time."""
    found = _asked(case)
    if found is None or "constant" not in case.verdict.reason:
        return None
    source = found[0]
    for timer in made(source, "timer"):
        inside = list(reached(source, roots(source, timer.callback)))
        seeds = [n for n in inside if isinstance(n, ast.Call) and last_name(n.func) == "seed"]
        if seeds:
            hint = f"{source.code(seeds[0])} in the callback starts the same draw each time: take it out"
            return Clue(hint, source.place(seeds[0]), key="draw")
        drawn = [c for c in draws(source) if c in inside]
        early = [c for c in draws(source) if c not in inside and _at_start(source, c)]
        if not drawn and len(early) == 1 and len(made(source, "timer")) == 1:
            name = last_name(timer.callback) or "the callback"
            hint = f"{source.code(early[0])} is drawn once, when the node starts: draw it in {name}"
            return Clue(hint, source.place(early[0]), key="draw")
    return None


def _at_start(source: Source, call: ast.AST) -> bool:
    function = source.function_of(call)
    return function is None or function.name in ("__init__", "main")


def _never_crosses(case: Case) -> Clue | None:
    """What is drawn lies on one side of the controller's threshold."""
    check = case.criterion.check
    if not isinstance(check, AnswersTogether) or "never changes, because" not in case.verdict.reason or case.fault:
        return None
    owners = [s for s in case.sources.values() if made_for(s, "publisher", check.input) is not None]
    calls = draws(owners[0]) if len(owners) == 1 else []
    if len(calls) != 1 or last_name(calls[0].func) not in ("uniform", "randint") or len(calls[0].args) != 2:
        return None
    limits = [number_at(owners[0], a) for a in calls[0].args]
    known = [limit for limit in limits if limit is not None]
    if len(known) < 2 or min(known) <= check.threshold < max(known):
        return None
    hint = f"{owners[0].code(calls[0])} stays on one side of {number(check.threshold)}"
    asked = next((c for c in case.siblings if isinstance(c, RandomInRange) and c.topic == check.input), None)
    hint += f": the values go from {number(asked.low)} to {number(asked.high)}" if asked is not None else ""
    return Clue(hint, owners[0].place(calls[0]), key="draw")


def _not_drawn(case: Case) -> Clue | None:
    """Nothing in the file draws anything."""
    found = _asked(case)
    if found is None or case.evidence("pattern") is None or draws(found[0]):
        return None
    source, check = found
    values = readings(published(case.trace, check.topic))
    places = [g for leaf in ("data", "temperature") for g in given_leaf(source, leaf)]
    if len(places) != 1 or not values:
        return None
    code = source.code(places[0])
    hint = f"{code} draws nothing: random.uniform({float(check.low)}, {float(check.high)}) gives a new value each time"
    return Clue(hint, source.place(places[0]))


SENSOR = (
    Cause("draw_limits", _limits),
    Cause("drawn_once", _drawn_once),
    Cause("not_drawn", _not_drawn),
    Cause("never_crosses", _never_crosses),
)
