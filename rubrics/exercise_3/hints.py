"""Hint rules of exercise 3: why answers of a controller are wrong, late or missing."""

from __future__ import annotations

import ast
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, cast

from grader.api import (
    Case,
    Clue,
    Outcome,
    ProblemKind,
    hint_rule,
    published,
    published_numbers,
    within,
)
from grader.api.unstable import (
    EXACT,
    Source,
    Switch,
    chain,
    conditions,
    constant_value,
    draws,
    first_line,
    given_leaf,
    is_flag,
    last_name,
    literal_text,
    made,
    made_for,
    names_in,
    number,
    number_in_code,
    pauses,
    publish_calls,
    received,
    runs,
    silent_topic,
    subtree,
    switches,
    text_comparisons,
    timer_code,
)

#: The checks that are explained here.
ALONE, TOGETHER = ANSWERS = ("threshold_response", "answers_together")
#: Answers delayed by at most this count as prompt.
_PROMPT_S = 0.3
_MEANS = ("mean", "fmean", "average", "median", "nanmean")


@dataclass(frozen=True, slots=True)
class _Subscriber:
    """A file that subscribes to a controller's input and answers, and the code of its callback."""

    source: Source
    reached: list[ast.AST]

    def comparisons(self) -> list[ast.Compare]:
        return [n for n in self.reached if isinstance(n, ast.Compare)]


@dataclass(frozen=True, slots=True)
class _Controller:
    """A controller that answers, and the check that judges it."""

    case: Case
    source: Source
    check: Any  # one of the two checks of this exercise


def _subscribers(case: Case) -> Iterator[_Subscriber]:
    """Yield the files that subscribe to the input and answer."""
    for source in case.sources.values():
        item = made_for(source, "subscription", case.check.input)
        if item is not None and made_for(source, "publisher", case.check.output) is not None:
            yield _Subscriber(source, runs(source, item))


def _late(case: Case) -> _Subscriber | None:
    """Return the controller, if its answers are late."""
    return next(_subscribers(case), None) if getattr(case.facts, "late", False) else None


def _compared(case: Case) -> Iterator[tuple[Source, ast.Compare]]:
    """Yield the two-sided comparisons in the code of the controller's callback."""
    yield from ((h.source, n) for h in _subscribers(case) for n in h.comparisons() if len(n.ops) == 1)


def _controller(case: Case) -> _Controller | None:
    """Return the controller, if it answers."""
    check = case.check
    if silent_topic(case) or case.is_about(ProblemKind.NEVER_CHANGES):
        return None
    owners = [s for s in case.sources.values() if made_for(s, "publisher", check.output) is not None]
    return _Controller(case, owners[0], check) if len(owners) == 1 else None


def _rows(case: Case) -> tuple[Any, ...]:
    """Return the inputs with the answers to them, if the check tells them: each an `AnswerRow` of `checks.py`."""
    return getattr(case.facts, "rows", ())


def _wrong_inputs(case: Case) -> list[float]:
    return [r.input for r in _rows(case) if r.answer is None or not within(r.answer, r.expected, EXACT)]


@hint_rule(*ANSWERS, given=_late, priority=13010)
def _stored_late(late: _Subscriber) -> Clue | None:
    """An attribute is compared before it gets the new value."""
    source = late.source
    for test in late.comparisons():
        for node in subtree(test):
            name = chain(node) if isinstance(node, ast.Attribute) else ""
            stores = [s for s in source.stores(name) if source.function_of(s) is source.function_of(test)]
            if len(stores) == 1 and first_line(stores[0]) > first_line(test):
                stored = source.code(source.parents.get(stores[0], stores[0]), 40)
                hint = f"{source.code(test, 40)} is checked before '{stored}', so it sees the previous value"
                return Clue(hint, source.place(test), key="late_answer")
    return None


@hint_rule(*ANSWERS, given=_late, priority=13020)
def _oldest_compared(late: _Subscriber) -> Clue | None:
    """The oldest of several stored values is compared."""
    source = late.source
    for test in late.comparisons():
        for node in subtree(test):
            first = isinstance(node, ast.Subscript) and number_in_code(source, node.slice) == 0
            if isinstance(node, ast.Subscript) and first and _grows(source, node.value):
                hint = f"{source.code(node, 40)} is the oldest stored value: compare the newest"
                return Clue(hint, source.place(test), key="late_answer")
    return None


def _grows(source: Source, values: ast.expr) -> bool:
    """Return whether new values are added at the end of a list or deque."""
    return chain(values) != "" and any(chain(c.func) == f"{chain(values)}.append" for c in source.calls("append"))


@hint_rule(*ANSWERS, given=_late, priority=13030)
def _put_off(late: _Subscriber) -> Clue | None:
    """The answer is left to a timer, or the callback sleeps before it answers."""
    source = late.source
    for node in late.reached:
        name = last_name(node.func) if isinstance(node, ast.Call) else ""
        if isinstance(node, ast.Call) and name in ("Timer", "create_timer", "sleep", "call_later"):
            worth = number_in_code(source, node.args[0] if node.args else None)
            if worth is not None and worth > _PROMPT_S:
                hint = f"{source.code(node, 50)} delays the answer by {number(worth)} s: answer immediately"
                return Clue(hint, source.place(node), key="late_answer")
    return None


@hint_rule(*ANSWERS, priority=13040)
def _compared_as_text(case: Case) -> Clue | None:
    """`str(msg.data) > '25'` compares alphabetically."""
    for subscriber in _subscribers(case):
        source = subscriber.source
        test = next(iter(text_comparisons(source, subscriber.reached)), None)
        if test is None:
            continue
        limit = number(case.check.threshold)
        hint = f"{source.code(test, 50)} compares strings, not numbers: compare the number itself with {limit}"
        return Clue(hint, source.place(test), key="as_text")
    return None


@hint_rule(*ANSWERS, priority=13050)
def _compared_mean(case: Case) -> Clue | None:
    """A mean of the last values lags behind, and stays near the threshold."""
    for source, test in _compared(case):
        for node in subtree(test):
            counted = isinstance(node, ast.BinOp) and isinstance(node.op, ast.Div) and _sum_by_count(node)
            averaged = isinstance(node, ast.Call) and last_name(node.func) in _MEANS
            if (counted or averaged) and literal_text(node) is None:
                hint = f"{source.code(node, 50)} combines several values: compare only the newest"
                return Clue(hint, source.place(test), key="of_many")
    return None


def _sum_by_count(node: ast.BinOp) -> bool:
    return isinstance(node.left, ast.Call) and last_name(node.left.func) == "sum"


@hint_rule(*ANSWERS, problem=ProblemKind.NO_NUMBER, given=_controller, priority=13060)
def _answer_without_number(controller: _Controller) -> Clue | None:
    """Answers have a type without a number."""
    source, check = controller.source, controller.check
    item = made_for(source, "publisher", check.output)
    if item is None:
        return None
    hint = f"{source.code(item.call)}: {item.type} carries no number, use a numeric type such as Float32"
    return Clue(hint, source.place(item.call), key=f"apart:{check.output}")


@hint_rule(ALONE, given=_controller, priority=13070)
def _at_the_threshold(controller: _Controller) -> Clue | None:
    """Only inputs exactly at the threshold are answered wrongly."""
    source, check = controller.source, controller.check
    wrong = _wrong_inputs(controller.case)
    if not wrong or any(not within(v, check.threshold, EXACT) for v in wrong):
        return None
    for switch in switches(source, check.threshold):
        code = source.code(switch.node, 40)
        if isinstance(switch.op, ast.GtE):
            hint = f"{code} is true at exactly {number(check.threshold)}: write > instead of >="
            return Clue(hint, source.place(switch.node))
        if isinstance(switch.op, ast.Lt):
            hint = f"{code} is false at exactly {number(check.threshold)}: write <= instead of <"
            return Clue(hint, source.place(switch.node))
    return None


@hint_rule(ALONE, given=_controller, priority=13080)
def _inverted(controller: _Controller) -> Clue | None:
    """The answers are exchanged."""
    source, check = controller.source, controller.check
    known = ((r.input, r.answer) for r in _rows(controller.case) if r.answer is not None)
    away = [(v, got) for v, got in known if not within(v, check.threshold, EXACT)]
    flipped = [within(got, check.otherwise if v > check.threshold else check.above, EXACT) for v, got in away]
    both = len({v > check.threshold for v, _ in away}) == 2
    found = switches(source, check.threshold)
    if not both or not all(flipped) or len(found) != 1:
        return None
    if not _says_inverted(source, found[0], check):
        return None
    code = source.code(found[0].node, 40)
    limit = number(check.threshold)
    hint = f"the branches of {code} are the wrong way round: {number(check.above)} belongs above {limit}"
    return Clue(f"{hint}, {number(check.otherwise)} at or below it", source.place(found[0].node), key="inverted")


def _says_inverted(source: Source, switch: Switch, check: Any) -> bool:
    """Return whether the text, too, gives each side the answer of the other."""
    negated = isinstance(source.parents.get(switch.node), ast.UnaryOp)
    choice = next((n for n in source.around(switch.node, ast.AST) if isinstance(n, (ast.If, ast.IfExp))), None)
    if choice is None:
        return False
    body = choice.body if isinstance(choice, ast.If) else [choice.body]
    numbers = {c.value for part in body for n in subtree(part) if (c := constant_value(source, n)) is not None}
    right, wrong = check.above, check.otherwise
    if isinstance(switch.op, (ast.Lt, ast.LtE)) != negated:
        right, wrong = wrong, right
    return wrong in numbers and right not in numbers


@hint_rule(ALONE, given=_controller, priority=13090)
def _rounded(controller: _Controller) -> Clue | None:
    """The input is truncated or rounded before the comparison."""
    source, check = controller.source, controller.check
    wrong = _wrong_inputs(controller.case)
    if not wrong or any(not 0 < abs(v - check.threshold) < 1 for v in wrong):
        return None
    for switch in switches(source, check.threshold):
        calls = [n for n in subtree(switch.tested) if isinstance(n, ast.Call)]
        calls = [c for c in calls if last_name(c.func) in ("int", "round", "floor", "ceil", "trunc")]
        if calls:
            hint = f"{source.code(calls[0], 40)} changes values near {number(check.threshold)}"
            return Clue(f"{hint}: compare the value itself", source.place(switch.node), key="rounded")
    return None


@hint_rule(ALONE, given=_controller, priority=13100)
def _other_threshold(controller: _Controller) -> Clue | None:
    source, check = controller.source, controller.check
    known = switches(source)
    away = [s for s in known if not within(s.limit.value, check.threshold, EXACT) and s.limit.value > 1]
    others = [s for s in away if abs(s.limit.value - check.threshold) <= 10 or len(known) == 1]
    wrong = _wrong_inputs(controller.case)
    if len(others) != 1 or not wrong:
        return None
    lower, upper = sorted((check.threshold, others[0].limit.value))
    if any(not lower - EXACT <= v <= upper + EXACT for v in wrong):
        return None
    hint = f"{source.code(others[0].node, 40)} compares with {number(others[0].limit.value)}: the limit is "
    if switches(source, check.threshold):
        hint = f"{source.code(others[0].node, 40)} keeps the old answer between {number(lower)} and {number(upper)}: "
        hint += "the only limit is "
    return Clue(f"{hint}{number(check.threshold)}", source.place(others[0].limit.origin), key="other_threshold")


@hint_rule(*ANSWERS, given=_controller, priority=13110)
def _wrong_answer(controller: _Controller) -> Clue | None:
    """The controller sends a number that is not in the exercise."""
    source, check = controller.source, controller.check
    strange = {r.value for r in published_numbers(controller.case.trace, check.output)}
    strange -= {check.above, check.otherwise}
    if len(strange) != 1:
        return None
    value = next(iter(strange))
    rows = _rows(controller.case)
    sides = {r.expected for r in rows if r.answer is not None and within(r.answer, value, EXACT)}
    wanted = number(next(iter(sides))) if len(sides) == 1 else f"{number(check.above)} or {number(check.otherwise)}"
    places = [n for n in _answers(source) if _is_worth(source, n, value)]
    if len(places) != 1:
        return None
    whole = isinstance(places[0], (ast.Assign, ast.keyword))
    text = f"{source.code(places[0])} answers {number(value)}" if whole else f"{number(value)} is answered here"
    hint = f"{text}: it must be {wanted}"
    return Clue(hint, source.place(places[0]), key=f"answer:{number(value)}")


def _answers(source: Source) -> list[ast.AST]:
    """Return the places that choose an answer: assignments, arguments and branches of conditional expressions."""
    places: list[ast.AST] = list(given_leaf(source, "data"))
    places += [a for a in source.all(ast.Assign) if a not in places and len(a.targets) == 1]
    places += [arm for e in source.all(ast.IfExp) for arm in (e.body, e.orelse)]
    return places


def _is_worth(source: Source, node: ast.AST, value: float) -> bool:
    expression = node.value if isinstance(node, (ast.Assign, ast.keyword)) else node
    if not isinstance(expression, ast.expr):
        return False
    # only the number itself, not a name for it: otherwise one mistake would be found at two places
    worth = constant_value(source, expression) if not isinstance(expression, (ast.Name, ast.Attribute)) else None
    return worth is not None and within(worth.value, value, EXACT)


@hint_rule(*ANSWERS, given=_controller, priority=13120)
def _compared_not_set(controller: _Controller) -> Clue | None:
    """`fan.data == 100.0` compares and sets nothing."""
    source = controller.source
    for statement in source.all(ast.Expr):
        test = statement.value
        if isinstance(test, ast.Compare) and chain(test.left).endswith(".data") and isinstance(test.ops[0], ast.Eq):
            code = source.code(test)
            right = f"{source.code(test.left)} = {source.code(test.comparators[0], 40)}"
            return Clue(f"{code} sets nothing: write {right}", source.place(statement))
    return None


@hint_rule(*ANSWERS, given=_controller, priority=13130)
def _sent_before_set(controller: _Controller) -> Clue | None:
    """The message is published before its number is set."""
    source, check = controller.source, controller.check
    calls = publish_calls(source, made_for(source, "publisher", check.output))
    if len(calls) != 1 or len(calls[0].args) != 1 or not chain(calls[0].args[0]):
        return None
    name, function = chain(calls[0].args[0]), source.function_of(calls[0])
    sets = [a for a in source.all(ast.Assign) if chain(a.targets[0]) == f"{name}.data"]
    here = [a for a in sets if source.function_of(a) is function]
    made_here = any(chain(a.targets[0]) == name and source.function_of(a) is function for a in source.all(ast.Assign))
    if not here or not made_here or any(first_line(a) < first_line(calls[0]) for a in here):
        return None
    hint = f"{source.code(calls[0])} comes before {source.code(here[0])}: set the number first, then publish"
    return Clue(hint, source.place(calls[0]))


@hint_rule(*ANSWERS, given=_controller, priority=13140)
def _sends_what_came(controller: _Controller) -> Clue | None:
    """The message that came is published instead of the answer."""
    source, check = controller.source, controller.check
    for call in publish_calls(source, made_for(source, "publisher", check.output)):
        message = received(source, source.function_of(call))
        if message is None or len(call.args) != 1 or chain(call.args[0]) != message.name or not message.name:
            continue
        if any(chain(t) == f"{message.name}.data" for a in source.all(ast.Assign) for t in a.targets):
            continue
        own = [s for s in source.all(ast.Assign) if isinstance(s.value, ast.Call) and chain(s.targets[0])]
        answers = [chain(s.targets[0]) for s in own if source.function_of(s) is source.function_of(call)]
        right = f": publish {answers[0]}" if len(answers) == 1 else ": publish the answer"
        return Clue(f"{source.code(call)} sends back the input{right}", source.place(call))
    return None


@hint_rule(*ANSWERS, given=_controller, priority=13150)
def _one_branch(controller: _Controller) -> Clue | None:
    """An answer is sent only on one side of the threshold."""
    source, check = controller.source, controller.check
    given = {r.value for r in published_numbers(controller.case.trace, check.output)}
    item = made_for(source, "publisher", check.output)
    if given not in ({check.above}, {check.otherwise}):
        return None
    for call in publish_calls(source, item):
        tests = list(source.around(call, ast.If))
        if len(tests) == 1 and not tests[0].orelse and _tests_threshold(source, tests[0].test, check.threshold):
            missing = next(v for v in (check.above, check.otherwise) if v not in given)
            hint = f"{source.code(call)} runs only under 'if {source.code(tests[0].test, 40)}'"
            return Clue(f"{hint}: publish {number(missing)} otherwise", source.place(tests[0]), key="one_branch")
    return None


def _tests_threshold(source: Source, test: ast.expr, threshold: float) -> bool:
    inside = set(subtree(test))
    return any(s.node in inside for s in switches(source, threshold))


@hint_rule(*ANSWERS, given=_controller, priority=13160)
def _answered_once(controller: _Controller) -> Clue | None:
    """A flag lets one answer through."""
    source, check = controller.source, controller.check
    if len(published(controller.case.trace, check.output)) > 2:
        return None
    for call in publish_calls(source, made_for(source, "publisher", check.output)):
        for test in conditions(source, call):
            names = {chain(n) for n in subtree(test.test) if isinstance(n, ast.Attribute)}
            function = source.function_of(call)
            stores = [s for name in names for s in source.stores(name) if source.function_of(s) is function]
            if stores and function is not None and is_flag(test.test):
                hint = f"'if {source.code(test.test, 40)}' allows only one answer: answer each message on {check.input}"
                return Clue(hint, source.place(test), key="answered_once")
    return None


@hint_rule(*ANSWERS, given=_controller, priority=13170)
def _sent_in_one_branch(controller: _Controller) -> Clue | None:
    """`publish` stands inside `else`, or a return comes before it."""
    source, check = controller.source, controller.check
    given = {r.value for r in published_numbers(controller.case.trace, check.output)}
    calls = publish_calls(source, made_for(source, "publisher", check.output))
    if given not in ({check.above}, {check.otherwise}) or len(calls) != 1:
        return None
    call, code = calls[0], source.code(calls[0])
    test = next(source.around(call, ast.If), None)
    if test is not None and test.orelse and _tests_threshold(source, test.test, check.threshold):
        inside = any(call in set(subtree(s)) for s in test.orelse)
        where = "inside else" if inside else f"inside 'if {source.code(test.test, 40)}'"
        hint = f"{code} is {where}, so that only one of the answers is sent: dedent it"
        return Clue(hint, source.place(call), key="one_branch")
    answer = chain(call.args[0]) if len(call.args) == 1 else ""
    early = [t for t in conditions(source, call) if call not in set(subtree(t))]
    if len(early) != 1 or not answer or not any(f"{n}.".startswith(f"{answer}.") for n in names_in(early[0].test)):
        return None
    hint = f"the return under 'if {source.code(early[0].test, 40)}' comes before {code}: each input needs an answer"
    return Clue(hint, source.place(early[0]), key="one_branch")


@hint_rule(ALONE, given=_controller, priority=13180)
def _no_other_side(controller: _Controller) -> Clue | None:
    """The message is kept, and its number is set on one side of the threshold only."""
    source, check = controller.source, controller.check
    places = [a for a in given_leaf(source, "data") if isinstance(a, ast.Assign)]
    if len(places) != 1:
        return None
    worth, test = constant_value(source, places[0].value), next(source.around(places[0], ast.If), None)
    sent = publish_calls(source, made_for(source, "publisher", check.output))
    if test is not None and any(test in list(source.around(c, ast.If)) for c in sent):
        return None
    if worth is None or test is None or test.orelse or not _tests_threshold(source, test.test, check.threshold):
        return None
    missing = next((v for v in (check.above, check.otherwise) if not within(v, worth.value, EXACT)), None)
    if missing is None or not any(within(v, worth.value, EXACT) for v in (check.above, check.otherwise)):
        return None
    target = source.code(places[0].targets[0])
    hint = f"{target} keeps {number(worth.value)} once it is set: add else: {target} = {float(missing)}"
    return Clue(hint, source.place(test), key="latched")


def _asks_none(test: ast.expr, name: str) -> bool:
    if isinstance(test, ast.Compare) and chain(test.left) == name:
        return any(isinstance(c, ast.Constant) and c.value is None for c in test.comparators)
    return isinstance(test, ast.UnaryOp) and isinstance(test.op, ast.Not) and chain(test.operand) == name


@hint_rule(*ANSWERS, given=_controller, priority=13190)
def _latched(controller: _Controller) -> Clue | None:
    """A variable is set on one side of the threshold, and never reset."""
    source, check = controller.source, controller.check
    item = made_for(source, "subscription", check.input)
    inside: Iterable[ast.AST] = runs(source, item) if item is not None else []
    for node in inside:
        if not isinstance(node, ast.If) or node.orelse:
            continue
        stores = [n for s in node.body for n in subtree(s) if isinstance(n, ast.Attribute)]
        kept = [n for n in stores if isinstance(n.ctx, ast.Store) and chain(n) == f"self.{n.attr}"]
        for store in kept:
            stored = source.stores(chain(store))
            others = [n for n in stored if n is not store and source.function_name(n) != "__init__"]
            read = any(chain(n) == chain(store) and isinstance(n.ctx, ast.Load) for n in source.all(ast.Attribute))
            once = _asks_none(node.test, chain(store)) or _tests_threshold(source, node.test, check.threshold)
            if not others and read and once:
                hint = f"{chain(store)} is set under 'if {source.code(node.test, 40)}' and never reset"
                return Clue(f"{hint}: decide again for each value", source.place(node), key="latched")
    return None


@hint_rule(*ANSWERS, given=_controller, priority=13200)
def _slow_timer(controller: _Controller) -> Clue | None:
    """A timer answers too rarely."""
    source, check = controller.source, controller.check
    calls = publish_calls(source, made_for(source, "publisher", check.output))
    for item in made(source, "timer"):
        worth = constant_value(source, item.period)
        inside = set(runs(source, item))
        if worth is not None and worth.value > 1.25 and all(c in inside for c in calls):
            slow = f"{timer_code(source, item)} answers every {number(worth.value)} s only"
            hint = f"{slow}: answer each message on {check.input}"
            return Clue(hint, source.place(worth.origin), key="slow_timer")
    return None


@hint_rule(*ANSWERS, outcome=Outcome.NOT_MET, priority=13210)
def _callback_sleeps(case: Case) -> Clue | None:
    """A callback sleeps, or the loop that spins, and what comes meanwhile is answered late."""
    for late in _subscribers(case):
        for pause in pauses(late.source):
            if (pause.seconds or 0) > _PROMPT_S:
                hint = pause.hint(late.source, "the answers")
                if pause.spun is None:
                    code = late.source.code(pause.call, 50)
                    hint = f"{code} blocks the callback, so later messages are answered late; remove it"
                return Clue(hint, late.source.place(pause.call), key="late_answer")
    return None


@hint_rule(TOGETHER, problem=ProblemKind.NEVER_CHANGES, priority=10220)
def _never_crosses(case: Case) -> Clue | None:
    """All drawn values are on one side of the controller's threshold."""
    check = case.check
    owners = [s for s in case.sources.values() if made_for(s, "publisher", check.input) is not None]
    calls = draws(owners[0]) if len(owners) == 1 else []
    if len(calls) != 1 or last_name(calls[0].func) not in ("uniform", "randint") or len(calls[0].args) != 2:
        return None
    limits = [number_in_code(owners[0], a) for a in calls[0].args]
    known = [limit for limit in limits if limit is not None]
    if len(known) < 2 or min(known) <= check.threshold < max(known):
        return None
    hint = f"{owners[0].code(calls[0])} stays on one side of {number(check.threshold)}"
    asked = next((c for c in case.asked("random_in_range") if c.topic == check.input), None)
    hint += f": the values go from {number(asked.low)} to {number(asked.high)}" if asked is not None else ""
    return Clue(hint, owners[0].place(calls[0]), key="draw")


@hint_rule(TOGETHER, priority=13990)
def _follows(case: Case) -> Clue | None:
    """A criterion about one of the two nodes was lost already, and explains this one."""
    check = case.check
    problem = case.verdict.problem
    if problem is None:
        return None
    quiet = problem.kind in (ProblemKind.STOPPED, ProblemKind.NO_MESSAGE)
    fixed = problem.kind is ProblemKind.NEVER_CHANGES
    stopped = problem.kind is ProblemKind.STOPPED and check.input in problem.topics
    answered = problem.kind is ProblemKind.WRONG_ANSWER or (quiet and check.output in problem.topics)
    for id_, criterion in case.lost.items():
        kind, other = criterion.check_name, cast("Any", criterion.check)
        controller = kind == ALONE and other.output == check.output
        sensor = kind == "random_in_range" and other.topic == check.input
        pace = kind == "topic_rate" and other.topic == check.input
        if (controller and answered) or (sensor and fixed) or (pace and stopped):
            return Clue(same_as=id_)
    return None
