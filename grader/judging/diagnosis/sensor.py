"""Causes behind temperatures that are out of range or not drawn."""

from __future__ import annotations

import ast

from grader.core.exercise import ProblemKind
from grader.judging.checks.sensor import RandomInRange
from grader.judging.checks.together import AnswersTogether
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import number_at
from grader.judging.diagnosis.fields import given_leaf
from grader.judging.diagnosis.wiring import made, made_for, reached, roots
from grader.judging.source import Source, chain, last_name
from grader.judging.values import published_numbers
from grader.judging.wording import number

_DRAWS: tuple[str, ...] = ("uniform", "randint", "random", "randrange", "gauss", "normalvariate", "choice", "choices")
_DRAWS += ("normal", "rand", "randn", "triangular", "integers", "sample", "betavariate", "random_sample", "randbelow")
_DRAWS += ("urandom", "getrandom", "randbytes", "token_bytes", "getrandbits", "randbits", "standard_normal")
#: How deep an expression around a draw is followed.
_DEEPEST = 12


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
    calls = draws(found[0]) if found is not None else []
    if found is None or case.evidence("outside") is None or len(calls) != 1:
        return None
    source, check = found
    call, low, high = calls[0], number(check.low), number(check.high)
    right = f"random.uniform({float(check.low)}, {float(check.high)})"
    if last_name(call.func) in ("gauss", "normalvariate", "normal") and not list(source.calls("min", "max", "clip")):
        return Clue(
            f"{source.code(call)} has no limits, some values lie far out: {right}", source.place(call), key="draw"
        )
    limits = [number_at(source, a) for a in call.args]
    if last_name(call.func) in ("uniform", "randint") and len(limits) == 2 and None not in limits:
        if limits == [check.low, check.high]:
            return None
        right = right if last_name(call.func) == "uniform" else f"{chain(call.func)}({low}, {high})"
        return Clue(f"{source.code(call)} draws outside {low} to {high}: {right}", source.place(call), key="draw")
    return _scaled_draw(source, check, call)


def _scaled_draw(source: Source, check: RandomInRange, call: ast.Call) -> Clue | None:
    """`random.random() * 10`: a draw from 0 to 1 that is stretched to other limits."""
    whole: ast.AST = call
    while isinstance(source.parents.get(whole), ast.BinOp):
        whole = source.parents[whole]
    ends = [_with(source, whole, call, drawn) for drawn in (0.0, 1.0)]
    known = [end for end in ends if end is not None]
    plain = last_name(call.func) in ("random", "rand", "random_sample") and not call.args
    if not plain or len(known) < 2 or (check.low <= min(known) and max(known) <= check.high):
        return None
    hint = f"{source.code(whole)} goes from {number(min(known))} to {number(max(known))}"
    right = f"random.uniform({float(check.low)}, {float(check.high)})"
    return Clue(f"{hint}: {right}", source.place(whole), key="draw")


def _with(source: Source, node: ast.AST, call: ast.Call, drawn: float, depth: int = 0) -> float | None:
    """Return what an expression is worth if a call gives this number."""
    if node is call:
        return drawn
    if not isinstance(node, ast.BinOp) or depth > _DEEPEST:
        return number_at(source, node)
    left = _with(source, node.left, call, drawn, depth + 1)
    right = _with(source, node.right, call, drawn, depth + 1)
    if left is None or right is None:
        return None
    if isinstance(node.op, ast.Add):
        return left + right
    if isinstance(node.op, ast.Sub):
        return left - right
    return left * right if isinstance(node.op, ast.Mult) else None


def _drawn_once(case: Case) -> Clue | None:
    """The value is drawn when the node starts and never again, or the seed is set each time."""
    found = _asked(case)
    if found is None or not case.is_about(ProblemKind.CONSTANT):
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
    if not isinstance(check, AnswersTogether) or not case.is_about(ProblemKind.NEVER_CHANGES) or case.fault:
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
    values = published_numbers(case.trace, check.topic)
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
