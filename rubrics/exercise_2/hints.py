"""Hint rules of exercise 2: why the logged positions are wrong."""

from __future__ import annotations

import ast

from grader.api import Case, Clue, Outcome, hint_rule
from grader.api.unstable import (
    Function,
    Maker,
    Source,
    WrongLogFacts,
    argument,
    chain,
    first_line,
    is_flag,
    last_name,
    log_call,
    made,
    message_classes,
    names_in,
    number_in_code,
    parameters,
    pauses,
    reached,
    received,
    roots,
    runs,
    subtree,
)

#: Cause found by the check -> parts of the message that may have been read instead of the position.
_PARTS = {
    "twist": ("twist",),
    "orientation": ("orientation",),
    "constant": ("orientation", "covariance"),
    "no_pair": ("orientation",),
}
_MEANING = {"twist": "velocity"}


def _position_rule(*causes: str, priority: int) -> Maker[Case]:
    """Make a rule for position logs in which the check found one of these causes."""

    def found(case: Case) -> Case | None:
        return case if _cause(case) in causes else None

    return hint_rule("logs_position", outcome=Outcome.NOT_MET, given=found, priority=priority)


def _cause(case: Case) -> str:
    """Return the cause that the check found; empty if it found none."""
    facts = case.found(WrongLogFacts)
    return "" if facts is None else facts.cause


def _position(source: Source) -> str:
    """Return where the position is, with the name that the callback gives the message."""
    functions = (f for m in made(source, "subscription") for f in roots(source, m.callback))
    messages = (received(source, f) for f in functions if isinstance(f, Function))
    names = (message.name for message in messages if message is not None)
    return f"{next(filter(None, names), 'msg')}.pose.pose.position"


def _reads(source: Source, *parts: str) -> list[ast.Attribute]:
    """Return the outermost attribute reads whose dotted name contains a part."""
    found = []
    for node in source.all(ast.Attribute):
        whole = not isinstance(source.parents.get(node), ast.Attribute)
        dotted = f"{chain(node)}."
        if whole and isinstance(node.ctx, ast.Load) and any(f".{part}." in dotted for part in parts):
            found.append(node)
    return found


@_position_rule(*_PARTS, priority=12010)
def _other_part(case: Case) -> Clue | None:
    """The velocity or the orientation is logged instead of the position."""
    source, cause = case.source, _cause(case)
    reads = _reads(source, *_PARTS[cause])
    if not reads or (cause in ("constant", "no_pair") and _reads(source, "position")):
        return None
    what = next(part for part in _PARTS[cause] if f".{part}." in f"{chain(reads[0])}.")
    hint = (
        f"{source.code(reads[0], 50)} is the {_MEANING.get(what, what)}: the position is {_position(source)}.x and .y"
    )
    return Clue(hint, source.place(reads[0]))


@_position_rule("no_y", "no_x", "only_x", "only_y", "wrong", "no_pair", "orientation", priority=12005)
def _copied_axis(case: Case) -> Clue | None:
    """Copy and paste: what should hold y gets another field of the message, such as x of the position."""
    source = case.source
    for statement in source.all(ast.Assign):
        target, value = statement.targets[0], chain(statement.value)
        axis, field = _axis(chain(target)), value.rpartition(".")[2]
        owner = value.rpartition(".")[0]
        if len(statement.targets) > 1 or not axis or field not in ("x", "y", "z", "w") or not owner:
            continue
        part = next((p for p in ("orientation", "linear", "angular") if owner.endswith(f".{p}")), "")
        others = [a for a in source.all(ast.Assign) if a is not statement and _axis(chain(a.targets[0])) in ("x", "y")]
        right = [
            a for a in others if chain(a.value).endswith((".position.x", ".position.y", f"{owner}.x", f"{owner}.y"))
        ]
        if not right or (field == axis and not part):
            continue
        meant = f"{_position(source)}.{axis}" if part else f"{owner}.{axis}"
        hint = f"{source.code(target)} gets {part + '.' if part else ''}{field}: write {source.code(target)} = {meant}"
        return Clue(hint, source.place(statement))
    return None


@_position_rule("only_x", "only_y", "wrong", "no_pair", "stale", priority=12008)
def _added_up(case: Case) -> Clue | None:
    """`self.x += ...` adds each position to the sum of the earlier ones."""
    source = case.source
    inside = [n for m in made(source, "subscription") for n in runs(source, m)]
    for statement in inside:
        if isinstance(statement, ast.AugAssign) and chain(statement.value).endswith((".x", ".y")):
            target = source.code(statement.target)
            if any(
                chain(n.left) == chain(statement.target) and isinstance(n.op, ast.Div) for n in source.all(ast.BinOp)
            ):
                continue  # a mean, and it is meant to be one
            hint = f"{source.code(statement)} adds all positions up: write {target} = {source.code(statement.value)}"
            return Clue(hint, source.place(statement))
    return None


@hint_rule("logs_position", outcome=Outcome.PARTLY, priority=12065)
def _whole_metres(case: Case) -> Clue | None:
    """The decimals are rounded away, by a function or by the format."""
    source, call = case.source, log_call(case)
    if _cause(case) != "whole" or call is None:
        return None
    cut = [c for c in source.calls("round", "int", "floor", "trunc") if len(c.args) == 1]
    if cut:
        given = source.code(cut[0].args[0], 50)
        hint = f"{source.code(cut[0])} drops the decimals: write {{{given}:.2f}} in an f-string"
        return Clue(hint, source.place(cut[0]))
    return Clue("this format drops the decimals: write :.2f in place of :.0f", source.place(call))


@_position_rule("swapped", priority=12020)
def _swapped_axes(case: Case) -> Clue | None:
    source = case.source
    for statement in source.all(ast.Assign):
        target, value = chain(statement.targets[0]), chain(statement.value)
        if "." in value and {_axis(target), _axis(value)} == {"x", "y"}:
            hint = f"{source.code(statement)} mixes up x and y"
            return Clue(hint, source.place(statement))
        clue = _swapped_pair(source, statement)
        if clue is not None:
            return clue
    crossed = [k for k in source.all(ast.keyword) if {k.arg, _axis(chain(k.value))} == {"x", "y"}]
    if crossed:
        return Clue(f"{source.code(crossed[0])} mixes up x and y", source.place(crossed[0]))
    call = log_call(case)
    if call is None or _order_in(call)[:2] != ["y", "x"]:
        return None
    return Clue(f"y comes before x in {source.code(call, 60)}", source.place(call))


def _axis(name: str) -> str:
    last = name.rpartition(".")[2].strip("_").lower()
    ends = last.rpartition("_")[2]
    return ends if ends in ("x", "y") else (last[-1:] if last in ("px", "py", "posx", "posy") else "")


def _swapped_pair(source: Source, statement: ast.Assign) -> Clue | None:
    """`x, y = p.y, p.x`."""
    target, value = statement.targets[0], statement.value
    if not isinstance(target, ast.Tuple) or not isinstance(value, ast.Tuple):
        return None
    left = [_axis(chain(e)) for e in target.elts]
    right = [_axis(chain(e)) for e in value.elts]
    if left == ["x", "y"] and right == ["y", "x"]:
        return Clue(f"{source.code(statement)} mixes up x and y", source.place(statement))
    return None


def _order_in(call: ast.Call) -> list[str]:
    """Return the order in which a log uses names that end in x or y."""
    reads = [n for a in call.args for n in ast.walk(a) if isinstance(n, (ast.Attribute, ast.Name)) and _axis(chain(n))]
    whole = [n for n in reads if not isinstance(n, ast.Name) or n.id in ("x", "y")]
    places = sorted(whole, key=lambda n: (first_line(n), n.col_offset))
    return [_axis(chain(n)) for n in places]


@_position_rule("wrong", "sign", "no_sign", "abs", priority=12030)
def _no_sign(case: Case) -> Clue | None:
    """`abs()` removes the sign."""
    source, call = case.source, log_call(case)
    if call is None:
        return None
    function = source.function_of(call)
    calls = [c for c in source.all(ast.Call) if last_name(c.func) in ("abs", "fabs") and len(c.args) == 1]
    near = [c for c in calls if source.function_of(c) is function or "pos" in source.code(c)]
    if not near:
        return None
    return Clue(f"{source.code(near[0])} drops the sign: log the number as it is", source.place(near[0]))


@_position_rule("no_y", "no_x", "only_x", "only_y", priority=12040)
def _wrong_axis(case: Case) -> Clue | None:
    """Z instead of y, or only one number."""
    source, cause = case.source, _cause(case)
    missing = "y" if cause in ("no_y", "only_x") else "x"
    if cause in ("no_y", "no_x"):
        reads = [n for n in source.all(ast.Attribute) if n.attr == "z" and isinstance(n.ctx, ast.Load)]
        hint = f"{source.code(reads[0], 50)} is the height: log {missing} of the position" if reads else ""
        return Clue(hint, source.place(reads[0])) if len(reads) == 1 else None
    call = log_call(case)
    if call is None:
        return None
    return Clue(
        f"{source.code(call, 60)} does not show {missing}: log {_position(source)}.{missing} too", source.place(call)
    )


@_position_rule("first_value", priority=12050)
def _kept_first(case: Case) -> Clue | None:
    """The callback stores a position only once."""
    source = case.source
    for item in made(source, "subscription"):
        for node in runs(source, item):
            if isinstance(node, ast.If) and is_flag(node.test) and _stores(source, node):
                hint = f"under 'if {source.code(node.test, 40)}' only the first message is stored: store each one"
                return Clue(hint, source.place(node))
    return None


@_position_rule("constant", "wrong", priority=12060)
def _rounded_away(case: Case) -> Clue | None:
    """`round(x, -1)` leaves tens of metres."""
    source = case.source
    for call in source.calls("round"):
        places = number_in_code(source, argument(call, 1, "ndigits"))
        if places is not None and places < 0:
            hint = f"{source.code(call)} rounds to tens of metres: keep a decimal or two"
            return Clue(hint, source.place(call))
    return None


@_position_rule("constant", "nothing", "no_pair", priority=12070)
def _thrown_away(case: Case) -> Clue | None:
    """The function that logs puts a new message in the place of the stored one."""
    source, call = case.source, log_call(case)
    function = source.function_of(call) if call is not None else None
    callbacks = [f for m in made(source, "subscription") for f in roots(source, m.callback)]
    for statement in source.all(ast.Assign):
        name = chain(statement.targets[0])
        fresh = isinstance(statement.value, ast.Call) and last_name(statement.value.func) in message_classes(source)
        kept = any(source.function_of(n) in callbacks for n in source.stores(name))
        if function is not None and source.function_of(statement) is function and fresh and kept:
            hint = f"{source.code(statement)} discards the received message: remove it"
            return Clue(hint, source.place(statement))
    return None


@_position_rule("constant", priority=12080)
def _never_stored(case: Case) -> Clue | None:
    """The callback assigns local variables, but others are logged."""
    source = case.source
    for item in made(source, "subscription"):
        for function in roots(source, item.callback):
            names = [n for n in reached(source, [function]) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
            lost = [n for n in names if source.stores(f"self.{n.id}")]
            if lost:
                first = min(lost, key=first_line)
                hint = f"{first.id} is local to the callback: assign to self.{first.id}"
                return Clue(hint, source.place(first))
    return None


@_position_rule("wrong", priority=12090)
def _scaled_position(case: Case) -> Clue | None:
    """The position is multiplied, as for another unit."""
    source, call = case.source, log_call(case)
    if call is None:
        return None
    for node in subtree(call):
        if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
            factor = number_in_code(source, node.right)
            if factor in (10, 100, 1000):
                return Clue(f"{source.code(node)} is not in metres: log the number as it is", source.place(node))
    return None


@_position_rule("stale", "wrong", priority=12100)
def _old_messages(case: Case) -> Clue | None:
    """A callback that sleeps lags behind the messages, and so does a loop that handles one at a time and sleeps."""
    source = case.source
    facts = case.found(WrongLogFacts)
    oldest = _oldest_taken(source) if _cause(case) == "stale" else None
    if oldest is not None:
        return oldest
    if facts is not None and facts.cause == "wrong" and not facts.right:
        return None
    pause = next((p for p in pauses(source) if p.spun is None), None)
    if pause is not None:
        hint = f"{source.code(pause.call)} in the callback makes messages wait in the queue: remove it"
        return Clue(hint, source.place(pause.call), key="old_messages")
    return _one_at_a_time(source)


def _one_at_a_time(source: Source) -> Clue | None:
    """Return a clue if a loop handles one message each time, and sleeps."""
    for call in source.calls("spin_once"):
        loop = next((n for n in source.around(call, ast.AST) if isinstance(n, (ast.While, ast.For))), None)
        inside = list(reached(source, [loop])) if loop is not None else []
        sleeps = [n for n in inside if isinstance(n, ast.Call) and source.resolved(n.func) in ("time.sleep", "sleep")]
        if sleeps:
            hint = f"{source.code(call)} takes one message, and {source.code(sleeps[0])} makes others wait: "
            return Clue(f"{hint}spin continuously and log from a timer", source.place(sleeps[0]), key="old_messages")
    return None


def _oldest_taken(source: Source) -> Clue | None:
    """Messages are added at one end and taken from the other, slower than they arrive."""
    for call in source.calls("pop", "popleft"):
        first = last_name(call.func) == "popleft" or (len(call.args) == 1 and number_in_code(source, call.args[0]) == 0)
        if first and isinstance(call.func, ast.Attribute) and any(source.calls("append")):
            hint = f"{source.code(call, 50)} takes the oldest stored message, and more arrive than are taken"
            return Clue(f"{hint}: keep only the newest", source.place(call))
    return None


@_position_rule("wrong", "no_pair", "constant", "few", "stale", "sign", priority=12110)
def _log_line(case: Case) -> Clue | None:
    """Only the line that logs is known."""
    call = log_call(case)
    return Clue(case.verdict.hint, case.source.place(call)) if call is not None and case.verdict.hint else None


def _stores(source: Source, node: ast.If) -> bool:
    """Return whether a condition without `else` guards storing what it tests from the message."""
    function = source.function_of(node)
    message = set(parameters(function)) - {"self"} if function is not None else set()
    asked = names_in(node.test)
    assigned = [n for s in node.body for n in ast.walk(s) if isinstance(n, ast.Assign)]
    kept = [s for s in assigned if message & {last_name(n) for n in ast.walk(s.value)}]
    return not node.orelse and any(chain(t) in asked for s in kept for t in s.targets)
