"""Causes of fields that do not follow a formula of the message's number: the count, and what is computed of it."""

from __future__ import annotations

import ast
import math
import re
from collections.abc import Iterator

from grader.grading.judging.diagnosis.rules import Case, Clue, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    callback_nodes,
    constant_value,
    given_leaf,
    is_read,
    made,
    names_called,
    names_in,
    number_in_code,
    runs,
    set_at_first_only,
    sole_assignment,
    stored_elsewhere,
)
from grader.grading.judging.facts import SeriesFacts
from grader.grading.judging.series import Curve, FormulaError, curve
from grader.grading.judging.source import Function, Source, chain, first_line, last_name, subtree
from grader.grading.model.exercise import ProblemKind
from grader.grading.model.wording import number, quote

#: Functions that convert an angle.
_TO_DEGREES, _TO_RADIANS = ("degrees", "rad2deg"), ("radians", "deg2rad")
#: What counts.
_COUNTING = (ast.Add, ast.Sub)
#: What assigns the result of an operator.
_SIGNS: dict[type[ast.operator], str] = {ast.Add: "+=", ast.Sub: "-=", ast.Mult: "*=", ast.Div: "/="}


def _first_values(case: Case) -> list[object]:
    facts = case.found(SeriesFacts)
    return [] if facts is None else list(facts.first)


@hint_rule("field_function", priority=10080)
def _set_after_publishing(case: Case) -> Clue | None:
    """The field is set after the message was published."""
    source, values = case.source, _first_values(case)
    if len(values) < 2 or any(value != 0 for value in values):
        return None
    for place in given_leaf(source, case.check.field.rpartition(".")[2]):
        function = source.function_of(place)
        name = _message_of(place)
        early = [c for c in source.calls("publish") if source.function_of(c) is function and _publishes(c, name)]
        if function is not None and early and all(first_line(c) < first_line(place) for c in early):
            hint = f"{source.code(place)} comes after {source.code(early[0])}: set the field first, then publish"
            return Clue(hint, source.place(place))
    return None


def _message_of(place: ast.AST) -> str:
    targets = place.targets if isinstance(place, ast.Assign) else []
    return next((chain(t.value) for t in targets if isinstance(t, ast.Attribute)), "")


def _publishes(call: ast.Call, name: str) -> bool:
    return bool(name) and any(chain(argument) == name for argument in call.args)


@hint_rule("field_function", problem=ProblemKind.WRONG_VALUE, priority=10090)
def _in_degrees(case: Case) -> Clue | None:
    """The argument of a sine is converted between degrees and radians."""
    source = case.source
    places = given_leaf(source, case.check.field.rpartition(".")[2])
    inside = [n for p in places for n in ast.walk(p) if isinstance(n, ast.Call)]
    turned = [n for n in inside if last_name(n.func) in (*_TO_DEGREES, *_TO_RADIANS)]
    if len(turned) != 1 or "deg" in str(case.check.formula) or len(turned[0].args) != 1:
        return None
    argument = source.code(turned[0].args[0], 40)
    way = "radians to degrees" if last_name(turned[0].func) in _TO_DEGREES else "degrees to radians"
    hint = f"{source.code(turned[0])} converts {way}: write {argument}"
    return Clue(hint, source.place(turned[0]))


@hint_rule("field_function", priority=10100)
def _other_function(case: Case) -> Clue | None:
    """`cos` for `sin`, or a division that rounds down."""
    source, formula = case.source, str(case.check.formula)
    inside = [n for p in given_leaf(source, case.check.field.rpartition(".")[2]) for n in ast.walk(p)]
    turned = [n for n in inside if isinstance(n, ast.Call) and last_name(n.func) in ("sin", "cos", "tan")]
    wrong = [n for n in turned if f"{last_name(n.func)}(" not in formula]
    right = next((f for f in ("sin", "cos", "tan") if f"{f}(" in formula), "")
    if len(wrong) == 1 and right:
        hint = f"{source.code(wrong[0])} does not compute {formula}: write math.{right}"
        return Clue(hint, source.place(wrong[0]))
    whole = [n for n in inside if isinstance(n, ast.BinOp) and isinstance(n.op, ast.FloorDiv)]
    if len(whole) == 1:
        code = source.code(whole[0], 40)
        return Clue(f"{code} rounds down to an integer: write / instead of //", source.place(whole[0]))
    return None


@hint_rule("field_function", priority=10110)
def _counter_reset(case: Case) -> Clue | None:
    """The counter is set to its first value before each message."""
    source = case.source
    looped = {n for loop in source.loops() if "publish" in names_called(source, [loop]) for n in subtree(loop)}
    timed = {n for m in made(source, "timer") for n in runs(source, m)}
    for counter in _counters(case):
        for store in source.stored.get(counter, ()):
            statement = source.parents.get(store)
            plain = isinstance(statement, ast.Assign) and isinstance(statement.value, ast.Constant)
            if statement is None or not plain or any(source.around(statement, ast.If)):
                continue
            if store in looped or store in timed:
                advice = _set_once(source, store, counter, looped=store in looped)
                hint = f"{source.code(statement)} resets it with each message: {advice}"
                return Clue(hint, source.place(statement))
    return None


def _set_once(source: Source, store: ast.AST, counter: str, *, looped: bool) -> str:
    """Return where a counter belongs that is set with each message."""
    function = source.function_of(store)
    if looped:
        return "set it before the loop"
    if isinstance(store, ast.Attribute):
        return "set it only in __init__"
    if function is not None and source.is_method(function):
        return f"keep it in self.{counter}, which __init__ sets"
    return f"set it outside of the function, which begins with: global {counter}"


@hint_rule("field_function", priority=10120)
def _counts_sometimes(case: Case) -> Clue | None:
    """The counter grows only on a condition, or `=+ 1` assigns the same number each time."""
    source = case.source
    for counter in _counters(case):
        for store in source.stored.get(counter, ()):
            statement = source.parents.get(store)
            value = getattr(statement, "value", None)
            if statement is None or source.function_name(store) in ("", "__init__"):
                continue
            if isinstance(statement, ast.Assign) and isinstance(value, ast.UnaryOp) and isinstance(value.op, ast.UAdd):
                code = source.code(statement)
                hint = f"{code} assigns {source.code(value.operand)} each time: write {counter} += "
                return Clue(f"{hint}{source.code(value.operand)}", source.place(statement))
            test = next(source.around(statement, ast.If), None)
            grows = isinstance(statement, ast.AugAssign) and isinstance(statement.op, ast.Add)
            if grows and test is not None and _publishes_beside(source, test):
                hint = f"{source.code(statement)} runs only under 'if {source.code(test.test, 40)}': "
                return Clue(f"{hint}dedent it, so that it counts each message", source.place(statement))
    return None


def _publishes_beside(source: Source, test: ast.If) -> bool:
    """Return whether messages are published in the function of a condition, and not under it."""
    function = source.function_of(test)
    sends = [c for c in source.calls("publish") if source.function_of(c) is function]
    return bool(sends) and not any(test in list(source.around(c, ast.If)) for c in sends)


@hint_rule("field_function", problem=ProblemKind.WRONG_VALUE, priority=10130)
def _needless_pi(case: Case) -> Clue | None:
    """The value is computed with pi, which the formula does not have."""
    formula = str(case.check.formula)
    for place in given_leaf(case.source, case.check.field.rpartition(".")[2]):
        value = getattr(place, "value", None)
        named = [n for n in ast.walk(value) if last_name(n) in ("pi", "tau")] if isinstance(value, ast.expr) else []
        if named and "pi" not in formula:
            hint = f"{case.source.code(place)} uses {last_name(named[0])}, which {formula} does not: remove it"
            return Clue(hint, case.source.place(place))
    return None


@hint_rule("field_function", priority=10135)
def _counts_by_another_step(case: Case) -> Clue | None:
    """The counter grows by another number than the one that makes the formula of what is computed."""
    source, wanted, value = case.source, curve(str(case.check.formula)), _computing(case)[1]
    numbers = [float(str(n.value)) for n in ast.walk(wanted.tree) if isinstance(n, ast.Constant)]
    for counter in _counters(case):
        right = [n for n in (1.0, *numbers) if value is not None and _same(source, value, counter, wanted, n)]
        for store in source.stored.get(counter, ()):
            statement = source.parents.get(store)
            step = number_in_code(source, statement.value) if isinstance(statement, ast.AugAssign) else None
            adds = isinstance(statement, ast.AugAssign) and isinstance(statement.op, ast.Add)
            if statement is not None and adds and right and step is not None and step not in (1.0, *right):
                hint = f"{source.code(statement)} counts {number(step)} for each message: write {counter} += "
                return Clue(f"{hint}{number(right[0])}", source.place(statement))
    return None


@hint_rule(priority=8135)
def _result_thrown_away(case: Case) -> Clue | None:
    """`self.count + 1` as a statement, for `+=`, or `self.count == 0`, for `=`."""
    for source in case.sources.values():
        for statement in source.all(ast.Expr):
            value = statement.value
            if isinstance(value, ast.BinOp) and isinstance(value.left, (ast.Name, ast.Attribute)):
                sign, right, does = _SIGNS.get(type(value.op), ""), value.right, "changes"
            elif isinstance(value, ast.Compare) and isinstance(value.left, (ast.Name, ast.Attribute)):
                sign = "=" if len(value.ops) == 1 and isinstance(value.ops[0], ast.Eq) else ""
                right, does = value.comparators[0], "sets"
            else:
                continue
            if sign:
                instead = f"{source.code(value.left)} {sign} {source.code(right, 40)}"
                return Clue(f"{source.code(value)} {does} nothing: write {instead}", source.place(statement))
    return None


@hint_rule("field_function", "service_sequence", priority=10139)
def _changed_in_a_copy(case: Case) -> Clue | None:
    """`count = self.count + 1` changes a variable of the callback, and leaves the attribute as it is."""
    counters = set(_counters(case)) if case.criterion.check_name == "field_function" else None
    for source in case.sources.values():
        for statement in {s for n in callback_nodes(source) if (s := _changed_copy(source, n)) is not None}:
            value, target = statement.value, chain(statement.targets[0])
            kept = chain(value.left) if isinstance(value, ast.BinOp) else ""
            if counters is not None and kept not in counters:
                continue
            if is_read(source, target):
                hint = f"{kept} never changes: add {kept} = {target} below this line"
            else:
                hint = stored_elsewhere(source, statement, kept, source.code(value, 40))
            return Clue(hint, source.place(statement), key="sequence")
    return None


def _changed_copy(source: Source, node: ast.AST) -> ast.Assign | None:
    """Return an assignment of an attribute plus or minus a number to another name, if nothing changes the attribute."""
    value = node.value if isinstance(node, ast.Assign) and len(node.targets) == 1 else None
    if not isinstance(node, ast.Assign) or not isinstance(value, ast.BinOp) or not isinstance(value.op, _COUNTING):
        return None
    kept, target = chain(value.left), chain(node.targets[0])
    alone = kept.startswith("self.") and kept.count(".") == 1 and bool(target) and target != kept
    counted = number_in_code(source, value.right) is not None
    return node if alone and counted and set_at_first_only(source, kept) else None


@hint_rule("field_function", priority=10140)
def _counter_never_changes(case: Case) -> Clue | None:
    """The counter never changes."""
    values = _first_values(case)
    if len(values) < 2 or len(set(map(repr, values))) > 1:
        return None
    for counter in _counters(case):
        if set_at_first_only(case.source, counter):
            sends = list(case.source.calls("publish"))
            place = case.source.place(sends[0]) if len(sends) == 1 else None
            return Clue(f"{counter} never changes: write {counter} += 1 after each message", place)
    return None


@hint_rule("field_function", priority=10145)
def _from_the_clock(case: Case) -> Clue | None:
    """The value follows the clock, where the formula follows the number of the message."""
    source, places = case.source, given_leaf(case.source, case.check.field.rpartition(".")[2])
    if len(places) != 1 or any(source.all(ast.AugAssign)) or re.search(r"\bt\b", str(case.check.formula)):
        return None
    function = source.function_of(places[0])
    clocks = [c for c in source.calls("now", "time", "monotonic", "perf_counter") if source.function_of(c) is function]
    if not clocks:
        return None
    hint = f"{source.code(places[0], 50)} follows the clock: {case.check.formula} follows the number of the message, "
    return Clue(f"{hint}so count the messages", source.place(places[0]))


@hint_rule("field_function", problem=ProblemKind.COUNT_START, priority=10150)
def _count_starts_elsewhere(case: Case) -> Clue | None:
    """The count starts at another number than 0, or is incremented before its use."""
    source, problem = case.source, case.verdict.problem
    start = problem.start if problem is not None else None
    for counter in _counters(case):
        for store in source.stored.get(counter, ()):
            statement = source.parents.get(store)
            first = _first_number(source, statement)
            if first is not None and number_in_code(source, first[1]) == start:
                hint = f"{source.code(first[0], 40)} starts the count at {start}: the first message is n = 0"
                return Clue(hint, source.place(first[0]))
            if isinstance(statement, ast.AugAssign) and start == 1 and _used_later(source, statement, counter):
                hint = f"{source.code(statement)} comes before the value is computed: count after it"
                return Clue(hint, source.place(statement))
    return None


def _first_number(source: Source, statement: ast.AST | None) -> tuple[ast.AST, ast.expr] | None:
    """Return what sets the first number of a count, and that number: an assignment, or the range of a loop."""
    if isinstance(statement, ast.Assign):
        return statement, statement.value
    call = statement.iter if isinstance(statement, ast.For) else None
    if not isinstance(call, ast.Call) or source.resolved(call.func) not in ("range", "itertools.count"):
        return None
    given = call.args if last_name(call.func) == "count" else call.args[:-1]
    return (call, call.args[0]) if given else None


def _used_later(source: Source, statement: ast.AST, counter: str) -> bool:
    function = source.function_of(statement)
    loads = [n for n in source.names() if isinstance(n.ctx, ast.Load) and chain(n) == counter]
    lines = [first_line(n) for n in loads if source.function_of(n) is function]
    return bool(lines) and min(lines) > first_line(statement)


def _counters(case: Case) -> list[str]:
    """Return what a field's value may count by: attributes of the node, and variables that count."""
    source, found, zero = case.source, [], []
    for place in given_leaf(source, case.check.field.rpartition(".")[2]):
        for value in _computed(source, place):
            found += list(_attributes(value))
            names = [n.id for n in ast.walk(value) if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Load)]
            found += [name for name in names if _counts(source, name, source.function_of(place))]
            zero += [name for name in names if _is_zero(source, name, source.function_of(place))]
    return found or zero


def _computed(source: Source, place: ast.AST) -> list[ast.expr]:
    """Return the expression that sets a field, and those of the local variables in it."""
    value = getattr(place, "value", None)
    if not isinstance(value, ast.expr):
        return []
    local = {n.id for n in ast.walk(value) if isinstance(n, ast.Name)}
    mine = (s for s in source.all(ast.Assign) if source.function_of(s) is source.function_of(place))
    return [value, *(s.value for s in mine if any(chain(target) in local for target in s.targets))]


def _counts(source: Source, name: str, function: Function | None) -> bool:
    """Return whether a variable of a function, or of the file, grows or runs through a range."""
    statements = _setting(source, name, function)
    values = [s.value for s in statements if isinstance(s, ast.Assign)]
    grows = any(isinstance(v, ast.BinOp) and name in names_in(v) for v in values)
    return grows or any(isinstance(s, (ast.AugAssign, ast.For)) for s in statements)


def _is_zero(source: Source, name: str, function: Function | None) -> bool:
    """Return whether a variable is set once, to 0."""
    values = [getattr(s, "value", None) for s in _setting(source, name, function)]
    return len(values) == 1 and isinstance(values[0], ast.Constant) and values[0].value == 0


def _setting(source: Source, name: str, function: Function | None) -> list[ast.AST | None]:
    """Return the statements that set a variable of a function, or of the file."""
    stores = [n for n in source.stored.get(name, ()) if source.function_of(n) in (function, None)]
    return [source.parents.get(n) for n in stores]


def _attributes(value: ast.expr) -> Iterator[str]:
    for node in ast.walk(value):
        if isinstance(node, ast.Attribute) and chain(node).startswith("self.") and chain(node).count(".") == 1:
            yield chain(node)


# --- a formula that is nearly the right one ---------------------------------------------------------------------------

_SIGN_OF: dict[type[ast.operator], str] = {
    ast.Add: "+",
    ast.Sub: "-",
    ast.Mult: "*",
    ast.Div: "/",
    ast.Mod: "%",
    ast.Pow: "**",
}
#: Operators that are taken for each other.
_EXCHANGED: dict[type[ast.operator], type[ast.operator]] = {
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
}
#: So many values of two formulas are compared: a sine of 0.1 * n has a negative half within them.
_COMPARED = 100
#: A longer expression has more than one slip in it.
_LONGEST_FORMULA = 30


@hint_rule("field_function", problem=ProblemKind.WRONG_VALUE, priority=10152)
def _formula_nearly(case: Case) -> Clue | None:
    """One change makes the formula of it: a factor outside of the sine, another number, a needless function."""
    source, formula = case.source, str(case.check.formula)
    wanted = curve(formula)
    statement, value = _computing(case)
    names = {chain(n) for n in ast.walk(value) if _is_variable(source, n)} if value is not None else set()
    if value is None or "t" in wanted.names or len(names) != 1 or len(list(ast.walk(value))) > _LONGEST_FORMULA:
        return None
    counter = names.pop()
    step = _step(source, counter)
    if _same(source, value, counter, wanted, step):
        return None
    for old, new in _slips(source, value, wanted):
        better = _exchanged_in(value, old, new)
        if not _same(source, better, counter, wanted, step):
            continue
        worth = constant_value(source, old)
        if isinstance(old, (ast.Name, ast.Attribute)) and worth is not None and isinstance(new, ast.Constant):
            hint = f"{source.code(old)} is {number(worth.value)}, and {formula} needs {number(float(str(new.value)))}"
            return Clue(hint, source.place(worth.origin))
        hint = f"{source.code(value, 50)} does not compute {formula}: write {quote(ast.unparse(better), 60)}"
        return Clue(hint, source.place(statement))
    return None


def _computing(case: Case) -> tuple[ast.AST, ast.expr | None]:
    """Return the only statement that computes the field, also through a local variable, and its expression."""
    source = case.source
    places = given_leaf(source, case.check.field.rpartition(".")[2])
    value = getattr(places[0], "value", None) if len(places) == 1 else None
    assigned = sole_assignment(source, value) if isinstance(value, ast.Name) else None
    if assigned is not None:
        return source.parents.get(assigned, assigned), assigned
    return (places[0] if places else ast.Pass()), value if isinstance(value, ast.expr) else None


def _step(source: Source, counter: str) -> float:
    """Return by how much a counter grows; 1 if the text does not show it."""
    statements = [source.parents.get(n) for n in source.stored.get(counter, ())]
    steps = [number_in_code(source, s.value) for s in statements if isinstance(s, ast.AugAssign)]
    return steps[0] if len(steps) == 1 and steps[0] is not None else 1.0


def _is_variable(source: Source, node: ast.AST) -> bool:
    """Return whether a node is a whole name that is neither called nor a known number."""
    outer = source.parents.get(node)
    part = isinstance(outer, ast.Attribute) or (isinstance(outer, ast.Call) and outer.func is node)
    return isinstance(node, (ast.Name, ast.Attribute)) and not part and number_in_code(source, node) is None


def _same(source: Source, value: ast.expr, counter: str, wanted: Curve, step: float = 1.0) -> bool:
    """Return whether an expression of a counter that grows by this step gives the same values as a formula of n."""
    try:
        own = curve(_as_formula(source, value, counter))
    except FormulaError:
        return False
    return all(math.isclose(own.at(n * step), wanted.at(n), rel_tol=1e-6, abs_tol=1e-9) for n in range(_COMPARED))


def _as_formula(source: Source, node: ast.expr, counter: str) -> str:
    """Return an expression as a formula of n, with `?` for what cannot be part of one."""
    worth = number_in_code(source, node)
    if worth is not None:
        return f"({worth!r})" if math.isfinite(worth) else "?"
    if chain(node) == counter:
        return "n"
    if isinstance(node, ast.BinOp):
        left, right = (_as_formula(source, side, counter) for side in (node.left, node.right))
        return f"({left} {_SIGN_OF.get(type(node.op), '?')} {right})"
    if isinstance(node, ast.UnaryOp) and isinstance(node.op, (ast.USub, ast.UAdd)):
        return f"({'-' if isinstance(node.op, ast.USub) else ''}{_as_formula(source, node.operand, counter)})"
    if isinstance(node, ast.Call) and len(node.args) == 1 and not node.keywords:
        inner, name = _as_formula(source, node.args[0], counter), source.resolved(node.func)
        return inner if name == "float" else f"{name.rpartition('.')[2]}({inner})"
    return "?"


def _slips(source: Source, value: ast.expr, wanted: Curve) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield what may be wrong in an expression, with what belongs in its place."""
    inside = [n for n in ast.walk(value) if isinstance(n, ast.expr)]
    numbers = [n for n in ast.walk(wanted.tree) if isinstance(n, ast.Constant)]
    for node in inside:
        yield from _moved_factors(source, node)
    for node in inside:
        if isinstance(node, ast.BinOp):
            if type(node.op) in _EXCHANGED:
                yield node, ast.BinOp(left=node.left, op=_EXCHANGED[type(node.op)](), right=node.right)
            yield from ((node, side) for side in (node.left, node.right))
        elif isinstance(node, ast.UnaryOp):
            yield node, node.operand
        elif isinstance(node, ast.Call) and node.args:
            yield node, node.args[0]
    for node in inside:
        if number_in_code(source, node) is not None and not isinstance(node, ast.BinOp):
            yield from ((node, right) for right in numbers)
    for node in inside:
        if isinstance(node, ast.Call) and len(node.args) == 1:
            for right in numbers:
                yield node.args[0], ast.BinOp(left=node.args[0], op=ast.Mult(), right=right)


def _moved_factors(source: Source, node: ast.expr) -> Iterator[tuple[ast.expr, ast.expr]]:
    """Yield `sin(x * 0.1)` for `sin(x) * 0.1`, and the other way round."""
    if isinstance(node, ast.BinOp) and isinstance(node.op, (ast.Mult, ast.Div)):
        for call, factor in ((node.left, node.right), (node.right, node.left)):
            if not isinstance(call, ast.Call) or len(call.args) != 1 or number_in_code(source, factor) is None:
                continue
            sides = (call.args[0], factor) if call is node.left else (factor, call.args[0])
            inner = ast.BinOp(left=sides[0], op=node.op, right=sides[1])
            yield node, ast.Call(func=call.func, args=[inner], keywords=[])
    inner = node.args[0] if isinstance(node, ast.Call) and len(node.args) == 1 else None  # type: ignore[assignment]
    if isinstance(node, ast.Call) and isinstance(inner, ast.BinOp) and isinstance(inner.op, ast.Mult):
        for kept, factor in ((inner.left, inner.right), (inner.right, inner.left)):
            call = ast.Call(func=node.func, args=[kept], keywords=[])
            yield node, ast.BinOp(left=factor, op=ast.Mult(), right=call)


def _exchanged_in(node: ast.expr, old: ast.expr, new: ast.expr) -> ast.expr:
    """Return an expression with one part of it replaced."""
    if node is old:
        return new
    if isinstance(node, ast.BinOp):
        sides = (_exchanged_in(node.left, old, new), _exchanged_in(node.right, old, new))
        return ast.BinOp(left=sides[0], op=node.op, right=sides[1])
    if isinstance(node, ast.UnaryOp):
        return ast.UnaryOp(op=node.op, operand=_exchanged_in(node.operand, old, new))
    if isinstance(node, ast.Call):
        arguments = [_exchanged_in(argument, old, new) for argument in node.args]
        return ast.Call(func=node.func, args=arguments, keywords=node.keywords)
    return node


@hint_rule("field_function", problem=ProblemKind.WRONG_VALUE, priority=10155)
def _value_line(case: Case) -> Clue | None:
    """Only the line that computes the value is known, and what the check says about it."""
    statement, value = _computing(case)
    if value is None or not case.verdict.hint:
        return None
    return Clue(case.verdict.hint, case.source.place(statement))
