"""Causes of wrong numbers in messages: fields, formulas and random values."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator, Mapping, Sequence
from typing import Any

from grader.grading.judging.diagnosis.rules import Case, Clue, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    Constant,
    constant_value,
    given_leaf,
    made,
    made_for,
    number_in_code,
    own_uniform,
    roots,
    runs,
    target_of,
    uniform_call,
    variable_of,
)
from grader.grading.judging.facts import DrawFacts
from grader.grading.judging.source import Function, Source, chain, first_line, last_name, words
from grader.grading.judging.values import (
    as_number,
    number_path,
    numbers_by_path,
    published,
    published_numbers,
    value_at,
)
from grader.grading.model.exercise import ProblemKind
from grader.grading.model.wording import moment, number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Message

_DRAWS = words(
    "uniform randint random randrange gauss normalvariate choice choices normal rand randn triangular integers sample "
    "betavariate random_sample randbelow urandom getrandom randbytes token_bytes getrandbits randbits standard_normal"
)
#: Functions that convert an angle to radians.
_TO_RADIANS = ("radians", "deg2rad")
#: How many levels of an expression around a random draw are followed.
_DEEPEST = 12


@dataclass(frozen=True, slots=True)
class _Given:
    """A statement that sets a field: the statement, the value, and the number if the text shows it."""

    node: ast.AST
    value: ast.expr
    worth: Constant | None


@dataclass(frozen=True, slots=True)
class _Wrong:
    """The first wrong message, with its wrong fields and their contents."""

    case: Case
    source: Source
    message: Message
    wanted: Mapping[str, float]
    found: Mapping[str, float]


def _wrong(case: Case) -> _Wrong | None:
    check = case.check
    for message in published(case.trace, check.topic):
        got = {path: as_number(value_at(message.value, path)) for path in check.values}
        wrong = {p: g for p, g in got.items() if g is not None and not _is(g, check.values[p])}
        if wrong:
            return _Wrong(case, case.source, message, check.values, wrong)
    return None


def _is(got: float, want: float) -> bool:
    return math.isclose(got, want, rel_tol=1e-6, abs_tol=1e-6)


def _given_values(source: Source, path: str) -> list[_Given]:
    """Return the statements that set a field such as `linear.x`, by assignment or keyword argument."""
    group, _, leaf = path.partition(".")
    pairs = (p for s in source.all(ast.Assign) for p in _assigned(s))
    found = [_Given(s, v, constant_value(source, v)) for s, t, v in pairs if chain(t).endswith(f".{path}")]
    for call in source.all(ast.Call):
        around = source.parents.get(call)
        outer = around.arg if isinstance(around, ast.keyword) else ""
        whole = isinstance(around, ast.Assign) and any(chain(t).endswith(f".{group}") for t in around.targets)
        own = [k for k in call.keywords if k.arg == leaf and (outer == group or whole)]
        found += [_Given(k, k.value, constant_value(source, k.value)) for k in own]
    return sorted(found, key=lambda g: first_line(g.node))


def _assigned(statement: ast.Assign) -> Iterator[tuple[ast.Assign, ast.expr, ast.expr]]:
    """Yield statement, target and value of an assignment; those of `a, b = 1, 2` separately."""
    for target in statement.targets:
        value = statement.value
        if isinstance(target, ast.Tuple) and isinstance(value, ast.Tuple) and len(target.elts) == len(value.elts):
            yield from ((statement, t, v) for t, v in zip(target.elts, value.elts, strict=True))
        else:
            yield statement, target, value


def _place_of(got: _Given) -> ast.AST:
    """Return the node to point at: the definition of the number, if it has a name."""
    named = got.worth is not None and isinstance(got.value, (ast.Name, ast.Attribute))
    return got.worth.origin if named and got.worth is not None else got.node


def draws(source: Source) -> list[ast.Call]:
    """Return the calls that draw a random number."""
    return list(source.calls(*_DRAWS))


@hint_rule("field_values", given=_wrong, priority=10010)
def _set_elsewhere(wrong: _Wrong) -> Clue | None:
    """The field gets the right number, in an object that is not published or is replaced before."""
    source = wrong.source
    sends = [c for c in source.calls("publish") if len(c.args) == 1]
    for path, value in wrong.found.items():
        want = wrong.wanted[path]
        places = _given_values(source, path)
        right = [g for g in places if g.worth is not None and _is(g.worth.value, want)]
        if len(right) != 1 or len(sends) != 1 or not isinstance(right[0].node, ast.Assign):
            continue
        given, sent = right[0].node, chain(sends[0].args[0])
        owner = next((n for t in given.targets if (n := chain(t).removesuffix(f".{path}")) != chain(t)), "")
        clue = _overwritten(source, given, places, path, value) or _replaced(source, given, owner, sent, sends[0])
        if clue is not None:
            return clue
    return None


def _overwritten(source: Source, given: ast.Assign, places: Sequence[_Given], path: str, value: float) -> Clue | None:
    """Return a clue if a later assignment in the same block gives the wrong number to the same field."""
    block = source.parents.get(given)
    later = [g for g in places if source.parents.get(g.node) is block and first_line(g.node) > first_line(given)]
    same = [g for g in later if isinstance(g.node, ast.Assign) and _targets(g.node) == _targets(given)]
    if len(same) != 1 or same[0].worth is None or not _is(same[0].worth.value, value):
        return None
    hint = f"{source.code(same[0].node)} overwrites {source.code(given)} in line {first_line(given)}: remove it"
    return Clue(hint, source.place(same[0].node), key=f"overwritten:{path}")


def _targets(statement: ast.Assign) -> list[str]:
    return [chain(t) for t in statement.targets]


def _replaced(source: Source, given: ast.Assign, owner: str, sent: str, send: ast.Call) -> Clue | None:
    """Return a clue if what is published is made anew after the fields were set, or instead of it."""
    function = source.function_of(send)
    makers = [s for s in source.all(ast.Assign) if _targets(s) == [sent] and isinstance(s.value, ast.Call)]
    here = [s for s in makers if source.function_of(s) is function and first_line(s) < first_line(send)]
    if not owner or not sent or len(here) != 1 or here[0].value.args or here[0].value.keywords:  # type: ignore[attr-defined]
        return None
    code, line = source.code(here[0]), first_line(given)
    if owner == sent and source.function_of(given) is function and line < first_line(here[0]):
        hint = f"{code} discards what was set before it, in line {line}: remove it, or set the fields after it"
        return Clue(hint, source.place(here[0]), key=f"replaced:{first_line(here[0])}")
    if owner != sent and not _used(source, owner, here[0], send):
        hint = f"{source.code(send)} sends the new, empty {sent}; the fields are set in {owner}: publish {owner}"
        return Clue(hint, source.place(send), key=f"replaced:{first_line(here[0])}")
    return None


def _used(source: Source, owner: str, begin: ast.AST, end: ast.AST) -> bool:
    """Return whether a name is used between two statements."""
    rows = range(first_line(begin), first_line(end) + 1)
    return any(chain(n) == owner and first_line(n) in rows for n in source.names())


@hint_rule("field_values", given=_wrong, priority=10020)
def _misplaced_field(wrong: _Wrong) -> Clue | None:
    """The right numbers are in the wrong fields."""
    numbers = numbers_by_path(wrong.message.value)
    for path, value in wrong.found.items():
        want = wrong.wanted[path]
        alike = [p for p, v in numbers.items() if p != path and _is(v, want)]
        there = [p for p in alike if not _is(wrong.wanted.get(p, 0.0), want)]
        if _is(want, 0.0) or len(there) != 1:
            continue
        places = [g for g in _given_values(wrong.source, there[0]) if g.worth is None or _is(g.worth.value, want)]
        mine = [g for g in _given_values(wrong.source, path) if g.worth is None or _is(g.worth.value, value)]
        # a number in both places was exchanged; otherwise it was misplaced
        chosen = mine if mine and not _is(value, 0.0) else places
        if len(chosen) != 1:
            continue
        if chosen is mine and numbers.get(there[0]) is not None and _exchanged(wrong.case, path, there[0], value):
            hint = f"{path} and {there[0]} are swapped: {wrong.source.code(chosen[0].node)} must get {number(want)}"
            return Clue(hint, wrong.source.place(chosen[0].node), key="exchanged")
        if chosen is not places:
            return None
        hint = f"{wrong.source.code(chosen[0].node)} puts {number(want)} into {there[0]}: it belongs in {path}"
        return Clue(hint, wrong.source.place(chosen[0].node), key=f"astray:{first_line(chosen[0].node)}")
    return None


def _exchanged(case: Case, path: str, other: str, value: float) -> bool:
    """Return whether the value in one field is the one expected in the other."""
    return any(
        other in check.values and _is(check.values[other], value)
        for check in case.asked("field_values")
        if path not in check.values
    ) or _is(case.check.values.get(other, math.nan), value)


@hint_rule("field_values", given=_wrong, priority=10030)
def _strayed_value(wrong: _Wrong) -> Clue | None:
    """A field holds the value expected in another field, which does not have it."""
    numbers = numbers_by_path(wrong.message.value)
    others = {p: v for check in wrong.case.asked("field_values") for p, v in check.values.items()}
    for path, value in wrong.found.items():
        homes = [p for p, v in others.items() if _is(v, value) and p in numbers and not _is(numbers[p], v)]
        places = [g for g in _given_values(wrong.source, path) if g.worth is not None and _is(g.worth.value, value)]
        if len(homes) == 1 and len(places) == 1:
            want = wrong.wanted[path]
            hint = f"{wrong.source.code(places[0].node)} puts {number(value)} into {path}: it belongs in {homes[0]}"
            hint += "" if _is(want, 0.0) else f", and {path} must be {number(want)}"
            return Clue(hint, wrong.source.place(places[0].node), key=f"astray:{first_line(places[0].node)}")
    return None


@hint_rule("field_values", given=_wrong, priority=10040)
def _not_every_message(wrong: _Wrong) -> Clue | None:
    """The field gets the right number, but not in every message."""
    source = wrong.source
    for path, want in wrong.wanted.items():
        places = _given_values(source, path)
        if (
            path not in wrong.found
            or len(places) != 1
            or places[0].worth is None
            or not _is(places[0].worth.value, want)
        ):
            continue
        code = source.code(places[0].node)
        test = next(source.around(places[0].node, ast.If), None)
        sends = list(source.calls("publish"))
        beyond = any(test not in list(source.around(c, ast.If)) for c in sends)
        if test is not None and source.function_of(test) is not None and beyond:
            hint = f"{code} runs only under 'if {source.code(test.test, 40)}': every message needs it"
            return Clue(hint, source.place(places[0].node), key=f"sometimes:{first_line(test)}")
        function = source.function_of(places[0].node)
        here = [c for c in sends if function is not None and source.function_of(c) is function]
        if here and all(first_line(c) < first_line(places[0].node) for c in here):
            hint = f"{code} comes after {source.code(here[0])}: set the fields before the message is sent"
            return Clue(hint, source.place(places[0].node), key=f"late:{first_line(here[0])}")
    return None


@hint_rule("field_values", given=_wrong, priority=10050)
def _not_assigned(wrong: _Wrong) -> Clue | None:
    """`msg.linear.x == 0.5` compares, and `msg.linear.x: 0.5` is a note on the type: neither sets the field."""
    source = wrong.source
    for path in wrong.found:
        compared = [n.value for n in source.all(ast.Expr) if isinstance(n.value, ast.Compare)]
        noted = [n for n in source.all(ast.AnnAssign) if n.value is None]
        pairs: list[tuple[ast.expr, ast.AST, ast.expr]] = [(c.left, c, c.comparators[0]) for c in compared]
        pairs += [(n.target, n, n.annotation) for n in noted]
        for target, node, value in pairs:
            if chain(target).endswith(f".{path}"):
                code = source.code(node)
                hint = f"{code} sets nothing: write {source.code(target)} = {source.code(value, 40)}"
                return Clue(hint, source.place(node))
    return None


@hint_rule("field_values", given=_wrong, priority=10055)
def _added_to_field(wrong: _Wrong) -> Clue | None:
    """`msg.linear.x += 0.5` on a message that is kept adds up from one message to the next."""
    source = wrong.source
    for path in wrong.found:
        for statement in source.all(ast.AugAssign):
            if chain(statement.target).endswith(f".{path}"):
                target = source.code(statement.target)
                hint = f"{source.code(statement)} changes the value with each message: write {target} = "
                return Clue(f"{hint}{number(wrong.wanted[path])}", source.place(statement))
    return None


@hint_rule("field_values", given=_wrong, priority=10060)
def _field_never_set(wrong: _Wrong) -> Clue | None:
    """A required field is never set."""
    for path, value in wrong.found.items():
        want = wrong.wanted[path]
        if _is(want, 0.0) or value != 0.0 or _given_values(wrong.source, path) or _touched(wrong.source, path):
            continue
        item = made_for(wrong.source, "publisher", wrong.case.check.topic)
        makers = list(wrong.source.calls(item.type)) if item is not None and item.type else []
        if len(makers) == 1:
            name = variable_of(wrong.source, makers[0], "msg")
            hint = f"{path} is never set and stays 0.0: add {name}.{path} = {number(want)}"
            return Clue(hint, wrong.source.place(makers[0]))
    return None


def _touched(source: Source, path: str) -> bool:
    """Return whether the text may set a field in a way that is not analysed here."""
    group, _, leaf = path.partition(".")
    wholes = any(isinstance(n.ctx, ast.Store) and n.attr == group for n in source.all(ast.Attribute))
    aliases = any(last_name(s.value) == group for s in source.all(ast.Assign))
    keywords = any(k.arg in (group, leaf) for k in source.all(ast.keyword))
    return wholes or aliases or keywords or bool(list(source.calls("setattr", "deepcopy", "copy")))


@hint_rule("field_values", given=_wrong, priority=10070)
def _wrong_number(wrong: _Wrong) -> Clue | None:
    """The only assignment of the field gives another number."""
    # first the field that should hold a value, then those that should be zero
    for path in sorted(wrong.found, key=lambda p: _is(wrong.wanted[p], 0.0)):
        places = _given_values(wrong.source, path)
        value, want = wrong.found[path], wrong.wanted[path]
        known = [g for g in places if g.worth is not None and _is(g.worth.value, value)]
        if len(known) == 1:
            return _number_clue(wrong.source, known[0], path, value, want)
        if len(places) == 1 and places[0].worth is None:
            hint = f"{wrong.source.code(places[0].node)} gives {number(value)} at {moment(wrong.message.t_ns)}"
            hint += f": {path} must be {number(want)} in every message"
            return Clue(hint, wrong.source.place(places[0].node))
    return None


def _converted_already(source: Source, value: ast.expr, want: float) -> str | None:
    """Return the code of the right number that is converted to radians; None if there is none."""
    calls = (n for n in ast.walk(value) if isinstance(n, ast.Call) and len(n.args) == 1)
    given = (c.args[0] for c in calls if last_name(c.func) in _TO_RADIANS)
    return next((source.code(a, 30) for a in given if _is(number_in_code(source, a) or math.nan, want)), None)


def _number_clue(source: Source, got: _Given, path: str, value: float, want: float) -> Clue:
    place = _place_of(got)
    code = source.code(got.node)
    around = source.parents.get(place)
    if place is not got.node and isinstance(around, (ast.Assign, ast.AnnAssign)):
        code = source.code(around)
    if _is(value, -want):
        hint = f"{code} has the wrong sign: {path} must be {number(want)}"
    elif math.isclose(value * math.pi, want, rel_tol=1e-3):
        hint = f"{code} lacks pi: from degrees to radians is math.radians(...), or * math.pi / 180"
    elif "degrees" in source.code(got.value, 200):
        hint = f"{code} gives degrees: {path} is in rad/s, write {number(want)}"
    elif (given := _converted_already(source, got.value, want)) is not None:
        hint = f"{code} converts {given}, which is in radians already: write {number(want)}"
    else:
        hint = f"{code} makes {path} {number(value)}: it must be {number(want)}"
    return Clue(hint, source.place(place))


@hint_rule("random_in_range", problem=ProblemKind.NO_NUMBER, priority=10160)
def _drawn_as_text(case: Case) -> Clue | None:
    """The type of the messages has no number."""
    item = made_for(case.source, "publisher", case.check.topic)
    if item is None:
        return None
    hint = f"{item.type} carries no number: use a numeric type such as Float32 in both files"
    return Clue(hint, case.source.place(item.call), key=f"apart:{case.check.topic}")


@hint_rule("random_in_range", priority=10170)
def _draw_limits(case: Case) -> Clue | None:
    """The limits of the random draw are wrong."""
    source, check = case.source, case.check
    calls = draws(source)
    facts = case.found(DrawFacts)
    if facts is None or not (facts.outside or facts.narrow) or len(calls) != 1:
        return None
    call, low, high = calls[0], number(check.low), number(check.high)
    right = uniform_call(source, str(float(check.low)), str(float(check.high)), call)
    if last_name(call.func) in ("gauss", "normalvariate", "normal") and not list(source.calls("min", "max", "clip")):
        hint = f"{source.code(call)} has no limits, so some values lie far outside: use {right}"
        return Clue(hint, source.place(call), key="draw")
    limits = [number_in_code(source, a) for a in call.args]
    if last_name(call.func) in ("uniform", "randint") and len(limits) == 2 and None not in limits:
        if limits == [check.low, check.high]:
            return None
        right = right if last_name(call.func) == "uniform" else f"{chain(call.func)}({low}, {high})"
        where = f"outside {low} to {high}" if facts.outside else f"only a part of {low} to {high}"
        return Clue(f"{source.code(call)} draws {where}: use {right}", source.place(call), key="draw")
    return _scaled_draw(source, check, call, facts)


def _scaled_draw(source: Source, check: Any, call: ast.Call, facts: DrawFacts) -> Clue | None:
    """`random.random() * 10`: a draw from 0 to 1, scaled to other limits."""
    whole: ast.AST = call
    while isinstance(source.parents.get(whole), ast.BinOp):
        whole = source.parents[whole]
    ends = [_with(source, whole, call, drawn) for drawn in (0.0, 1.0)]
    known = [end for end in ends if end is not None]
    plain = last_name(call.func) in ("random", "rand", "random_sample") and not call.args
    if not plain or len(known) < 2 or {min(known), max(known)} == {check.low, check.high}:
        return None
    if check.low <= min(known) and max(known) <= check.high and not facts.narrow:
        return None
    low, high = float(check.low), float(check.high)
    right = own_uniform(source, str(low), str(high), call) or f"{low} + {source.code(call, 40)} * {high - low}"
    hint = f"{source.code(whole)} goes from {number(min(known))} to {number(max(known))}"
    return Clue(f"{hint}: write {right}", source.place(whole), key="draw")


def _with(source: Source, node: ast.AST, call: ast.Call, drawn: float, depth: int = 0) -> float | None:
    """Return the value of an expression if a call returns this number."""
    if node is call:
        return drawn
    if not isinstance(node, ast.BinOp) or depth > _DEEPEST:
        return number_in_code(source, node)
    left = _with(source, node.left, call, drawn, depth + 1)
    right = _with(source, node.right, call, drawn, depth + 1)
    if left is None or right is None:
        return None
    if isinstance(node.op, ast.Add):
        return left + right
    if isinstance(node.op, ast.Sub):
        return left - right
    return left * right if isinstance(node.op, ast.Mult) else None


@hint_rule("random_in_range", priority=10180)
def _drawn_and_lost(case: Case) -> Clue | None:
    """The drawn number is put into a variable that is not used."""
    source, calls = case.source, draws(case.source)
    if len(calls) != 1 or list(given_leaf(source, "data")):
        return None
    name = target_of(source, calls[0])
    sends = list(source.calls("publish"))
    sent = chain(sends[0].args[0]) if len(sends) == 1 and len(sends[0].args) == 1 else ""
    if not name or "." in name or not sent or name == sent:
        return None
    hint = f"{name} is never put into the message: write {sent}.data = {source.code(calls[0], 50)}"
    return Clue(hint, source.place(calls[0]))


@hint_rule("random_in_range", priority=10190)
def _shifted_draw(case: Case) -> Clue | None:
    """Something is added to a draw between the right limits."""
    source, check, calls = case.source, case.check, draws(case.source)
    facts = case.found(DrawFacts)
    if facts is None or not facts.outside or len(calls) != 1:
        return None
    if last_name(calls[0].func) not in ("uniform", "randint"):
        return None
    around = source.parents.get(calls[0])
    limits = [number_in_code(source, a) for a in calls[0].args]
    if not isinstance(around, ast.BinOp) or limits != [check.low, check.high]:
        return None
    ends = [end for limit in (check.low, check.high) if (end := _with(source, around, calls[0], limit)) is not None]
    # single precision rounds by less than this
    if len(ends) < len(limits) or not min(ends) - 1e-3 <= facts.least or not facts.most <= max(ends) + 1e-3:
        return None
    hint = f"{source.code(around, 60)} moves the values out of {number(check.low)} to {number(check.high)}: write "
    return Clue(f"{hint}{source.code(calls[0], 50)} alone", source.place(around))


@hint_rule("random_in_range", problem=ProblemKind.CONSTANT, priority=10200)
def _drawn_once(case: Case) -> Clue | None:
    """The value is drawn only once at the start, or the seed is set each time."""
    source = case.source
    for timer in made(source, "timer"):
        inside = runs(source, timer)
        seeds = [n for n in inside if isinstance(n, ast.Call) and last_name(n.func) == "seed"]
        if seeds:
            hint = f"{source.code(seeds[0])} in the callback restarts the same sequence each time: remove it"
            return Clue(hint, source.place(seeds[0]), key="draw")
        for function in roots(source, timer.callback):
            defaults = [n for d in _defaults(function) for n in ast.walk(d) if n in draws(source)]
            if defaults:
                hint = (
                    f"the default {source.code(defaults[0], 40)} is drawn once, when Python reads this line: draw it "
                )
                return Clue(f"{hint}in the body of the function", source.place(defaults[0]), key="draw")
        drawn = [c for c in draws(source) if c in inside]
        outside = (c for c in draws(source) if c not in inside)
        early = [c for c in outside if source.function_name(c) in ("", "__init__", "main")]
        if not drawn and len(early) == 1 and len(made(source, "timer")) == 1:
            name = last_name(timer.callback) or "the callback"
            hint = f"{source.code(early[0])} is drawn once, when the node starts: draw it in {name}"
            return Clue(hint, source.place(early[0]), key="draw")
    return None


def _defaults(function: ast.AST) -> list[ast.expr]:
    """Return the defaults of a function's parameters."""
    if not isinstance(function, (Function, ast.Lambda)):
        return []
    return [d for d in (*function.args.defaults, *function.args.kw_defaults) if d is not None]


@hint_rule("random_in_range", priority=10210)
def _not_drawn(case: Case) -> Clue | None:
    """The file draws no random numbers."""
    source, check = case.source, case.check
    facts = case.found(DrawFacts)
    if facts is None or not facts.pattern or draws(source):
        return None
    values = published_numbers(case.trace, check.topic)
    if not values:
        return None
    path = check.field or number_path(published(case.trace, check.topic)[0].value)
    places = given_leaf(source, path.rpartition(".")[2])
    if len(places) != 1:
        return None
    code = source.code(places[0])
    right = uniform_call(source, str(float(check.low)), str(float(check.high)))
    return Clue(f"{code} is not random: for a new value each time, write {right}", source.place(places[0]))
