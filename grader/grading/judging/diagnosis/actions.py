"""Causes of goals that go astray, in a client of an action: its name, waits, answers that nobody reads, timers."""

from __future__ import annotations

import ast
import operator
from collections.abc import Callable

from grader.grading.judging.diagnosis.rules import CLIENT_CHECKS, Case, Clue, Crash, crash_rule, hint_rule
from grader.grading.judging.diagnosis.wiring import (
    conditions,
    constant_value,
    given_leaf,
    goes_to,
    has_no_caller,
    has_threads,
    made,
    names_called,
    number_in_code,
    runs,
    spin_for,
    spun_again,
    target_of,
    text_in_code,
    text_origin,
    timer_code,
    unspun_wait,
    value_of,
)
from grader.grading.judging.facts import GoalFieldFacts
from grader.grading.judging.service_calls import calls_of
from grader.grading.judging.source import (
    Source,
    argument,
    chain,
    first_line,
    last_name,
    literal_text,
    parameters,
    subtree,
)
from grader.grading.judging.values import EXACT
from grader.grading.model.exercise import ProblemKind
from grader.grading.model.wording import nearest, number, quote
from grader.runtime.model.quantities import seconds

#: What sends a goal, at once or in time.
_SENDS = ("send_goal_async", "send_goal")
_WAITS = ("wait_for_server", "server_is_ready")
#: What ends a timer.
_ENDS = {"cancel", "destroy_timer", "destroy"}
_CANCELS = {"cancel_goal_async", "cancel_goal"}
_ORDERS: dict[type[ast.cmpop], Callable[[float, float], bool]] = {
    ast.Gt: operator.gt,
    ast.GtE: operator.ge,
    ast.Lt: operator.lt,
    ast.LtE: operator.le,
    ast.Eq: operator.eq,
}


@hint_rule(*CLIENT_CHECKS, problem=ProblemKind.OTHER_NAME, priority=3510)
def _other_action(case: Case) -> Clue | None:
    """A client of an action has another name."""
    source, wanted = case.source, case.check.action
    clients = {text_in_code(source, argument(c, 2, "action_name")): c for c in source.calls("ActionClient")}
    names = [name for name in clients if name is not None]
    # of several, the others may be meant for other actions
    written = names[0] if len(clients) == 1 and names else nearest(wanted, names)
    if written is None or any(goes_to(name, wanted) for name in names):
        return None
    call = clients[written]
    origin = text_origin(source, argument(call, 2, "action_name"), call)
    hint = f"{source.code(call)} asks for {quote(written, 60)}: the task asks for {wanted}"
    return Clue(hint, source.place(origin), key=f"action:{source.file}:{call.lineno}")


@hint_rule(*CLIENT_CHECKS, problem=ProblemKind.OTHER_TYPE, priority=3515)
def _other_action_type(case: Case) -> Clue | None:
    """A client of the action has another type."""
    source, wanted = case.source, case.check.action
    calls = [
        c for c in source.calls("ActionClient") if goes_to(text_in_code(source, argument(c, 2, "action_name")), wanted)
    ]
    if len(calls) != 1:
        return None
    hint = f"{source.code(calls[0])} has another type than the server of {wanted}"
    return Clue(hint, source.place(calls[0]), key=f"action:{source.file}:{calls[0].lineno}")


@hint_rule(*CLIENT_CHECKS, problem=ProblemKind.SILENT, priority=3520)
def _no_goal_sent(case: Case) -> Clue | None:
    """There is a client, and no goal: nothing sends one, nothing calls what does, or the server is not there yet."""
    source = case.source
    client = next(source.calls("ActionClient"), None)
    sends = list(source.calls(*_SENDS))
    if client is None:
        return None
    if not sends:
        hint = f"{source.code(client)} makes a client, and nothing in the file calls its send_goal_async"
        return Clue(hint, source.place(client), key="no_goal")
    senders = [source.function_of(call) for call in sends]
    unused = [f for f in senders if f is not None and has_no_caller(source, f)]
    if len(unused) == len(sends):
        own = "self." if source.is_method(unused[0]) else ""
        hint = f"nothing calls {unused[0].name}, which sends the goal: call {own}{unused[0].name}()"
        return Clue(hint, source.place(unused[0]), key="no_goal")
    if any(last_name(n) in _WAITS for n in source.names()) or all(conditions(source, call) for call in sends):
        return None
    hint = f"the server may not be there yet, and the goal is lost then: call {target_of(source, client) or 'client'}"
    return Clue(f"{hint}.wait_for_server() before {source.code(sends[0], 50)}", source.place(sends[0]), key="no_goal")


@hint_rule(*CLIENT_CHECKS, "logs_values", priority=3530)
def _waits_for_a_goal(case: Case) -> Clue | None:
    """A callback waits for what can only arrive once it has returned, or nobody spins while a goal is sent."""
    source = case.source
    if has_threads(source) or not any(source.calls("ActionClient")):
        return None
    inside = source.called_back()
    clients = {target_of(source, call) for call in source.calls("ActionClient")} - {""}
    for call in source.calls("send_goal"):
        if isinstance(call.func, ast.Attribute) and chain(call.func.value) in clients:
            hint = f"{source.code(call, 50)} waits for the result, and the node does not spin meanwhile"
            hint += ": call send_goal_async, and add_done_callback"
            return Clue(hint, source.place(call), key="waits_for_goal")
    if (found := unspun_wait(source)) is not None:
        loop, future = found
        hint = f"'while {source.code(loop.test, 40)}' never ends, because the node does not spin meanwhile: "
        use = f"give {future}.add_done_callback what comes next"
        use = use if loop in inside else f"use {spin_for(source, loop, future)}"
        return Clue(f"{hint}{use}", source.place(loop), key="waits_for_goal")
    if (spun := spun_again(source, inside)) is None:
        return None
    waited = argument(spun, 1, "future")
    code = source.code(waited, 40) if waited is not None else "future"
    hint = f"{source.code(spun)} runs in a callback, while the node is already spinning"
    return Clue(f"{hint}: use {code}.add_done_callback(...)", source.place(spun), key="waits_for_goal")


@hint_rule(*CLIENT_CHECKS, fault=None, priority=3540)
def _timer_never_ends(case: Case) -> Clue | None:
    """A timer that a callback starts sends a goal each time."""
    source = case.source
    if any(source.calls(*_ENDS, "reset")):
        return None
    inside = source.called_back()
    for item in made(source, "timer"):
        callback = runs(source, item)
        sends = [n for n in callback if isinstance(n, ast.Call) and last_name(n.func) in _SENDS]
        if item.call in inside and sends and not any(conditions(source, call) for call in sends):
            name = target_of(source, item.call) or "self.timer"
            hint = f"{timer_code(source, item)} goes on and sends a goal each time"
            hint += f": keep the timer, and cancel it in {last_name(item.callback) or 'its callback'}, {name}.cancel()"
            return Clue(hint, source.place(item.call), key=f"timer:{first_line(item.call)}")
    return None


@hint_rule("after_goal", priority=3550)
def _goal_timer_too_slow(case: Case) -> Clue | None:
    """The timer that sends the next goal has a longer period than the time for it."""
    source, within_s = case.source, seconds(case.check.within)
    inside = source.called_back()
    for item in made(source, "timer"):
        worth = constant_value(source, item.period)
        called = {last_name(n.func) for n in runs(source, item) if isinstance(n, ast.Call)}
        if item.call not in inside and called & _ENDS:  # it sends the first goal only
            continue
        if worth is not None and worth.value > within_s and called & {*_SENDS}:
            hint = f"{timer_code(source, item)} waits {number(worth.value)} s, and the period is in seconds: the next "
            hint += f"goal has to come within {number(within_s)} s"
            return Clue(hint, source.place(worth.origin), key=f"timer:{first_line(item.call)}")
    return None


@hint_rule(*CLIENT_CHECKS, priority=3560)
def _goes_on_when_rejected(case: Case) -> Clue | None:
    """What is done about a rejected goal is followed by what is done about an accepted one."""
    source = case.source
    if not _was_rejected(case):
        return None
    for test in source.all(ast.If):
        asked = test.test
        rejected = isinstance(asked, ast.UnaryOp) and isinstance(asked.op, ast.Not) and _is_accepted(asked.operand)
        leaves = any(isinstance(n, (ast.Return, ast.Raise, ast.Continue, ast.Break)) for n in subtree(test))
        if not rejected or leaves or test.orelse:
            continue
        function = source.function_of(test)
        later = [c for c in source.calls("get_result_async") if source.function_of(c) is function]
        if any(first_line(c) > first_line(test.body[-1]) for c in later):
            hint = f"after 'if {source.code(asked, 40)}' a rejected goal goes on to {source.code(later[-1], 50)}"
            return Clue(f"{hint}: end the block with return", source.place(test), key=f"rejected:{first_line(test)}")
    return None


@hint_rule("sends_goals", "after_goal", priority=3565)
def _never_asks_whether_accepted(case: Case) -> Clue | None:
    """The result of a goal is asked for, whether the goal was accepted or not."""
    source = case.source
    asked = next(source.calls("get_result_async"), None)
    if asked is None or not _was_rejected(case) or any(last_name(n) == "accepted" for n in source.names()):
        return None
    handle = chain(asked.func.value) if isinstance(asked.func, ast.Attribute) else "the goal handle"
    hint = f"nothing asks whether the goal was accepted: before {source.code(asked, 50)}, look at {handle}.accepted"
    return Clue(f"{hint}, and send the goal again if it is false", source.place(asked), key="accepted")


def _is_accepted(node: ast.AST) -> bool:
    return isinstance(node, ast.Attribute) and node.attr == "accepted"


def _was_rejected(case: Case) -> bool:
    answers = (c.response for c in calls_of(case.trace, f"{case.check.action}/_action/send_goal", "student"))
    return any(answer is not None and answer.value.get("accepted") is False for answer in answers)


@hint_rule("sends_goals", "after_goal", priority=3570)
def _result_never_read(case: Case) -> Clue | None:
    """Nothing asks for the result of a goal, or takes it."""
    source = case.source
    sends = list(source.calls("send_goal_async"))
    if not sends or any(source.calls("send_goal", "get_result")) or not _lacks_goals(case):
        return None
    for call in (*sends, *source.calls("get_result_async")):
        if isinstance(source.parents.get(call), ast.Expr):
            what = "whether the goal was accepted" if call in sends else "the result"
            hint = f"nothing learns {what}: write {source.code(call, 50)}.add_done_callback(...)"
            return Clue(hint, source.place(call), key=f"unread:{first_line(call)}")
    if any(last_name(n) == "get_result_async" for n in source.names()):
        return None
    reads = [n for n in source.all(ast.Attribute) if _is_accepted(n)]
    place = source.function_of(reads[0]) if reads else None
    where = f"in {place.name}" if place is not None else "once the goal is accepted"
    hint = f"nothing asks for the result of a goal: {where}, call get_result_async() of the goal handle, and"
    return Clue(f"{hint} add_done_callback(...)", source.place(place if place is not None else sends[0]), key="unread")


def _lacks_goals(case: Case) -> bool:
    """Return whether goals are missing, or did not end."""
    if case.criterion.check_name == "sends_goals":
        return case.is_about(ProblemKind.TOO_FEW)
    return case.is_about(ProblemKind.TOO_FEW) and case.check.end != "rejected"


@hint_rule("sends_goals", priority=3580)
def _goal_field(case: Case) -> Clue | None:
    """A field of the goal is not set, or is set to something else."""
    source, facts = case.source, case.found(GoalFieldFacts)
    if facts is None:
        return None
    leaf, wanted = facts.path.rpartition(".")[2], facts.wanted
    shown = f'"{quote(wanted, 40)}"' if isinstance(wanted, str) else number(wanted)
    given = [node for node in given_leaf(source, leaf) if _may_set(node, facts.path)]
    named = [dotted for dotted in source.stored if dotted.endswith(f".{leaf}")]
    if not given and not named and not any(literal_text(n) == leaf for n in source.all(ast.Constant)):
        goal = next((c for c in source.calls("Goal") if isinstance(c.func, ast.Attribute)), None)
        if goal is None:
            return None
        name = target_of(source, goal) or "goal"
        return Clue(f"{facts.path} is never set: write {name}.{facts.path} = {shown}", source.place(goal))
    if len(given) != 1:
        return None
    value = getattr(given[0], "value", None)
    text, figure = text_in_code(source, value), number_in_code(source, value)
    other = (text is not None and text != wanted) or (
        figure is not None and isinstance(wanted, float) and abs(figure - wanted) > EXACT
    )
    if not other:
        return None
    hint = f"{source.code(given[0])}: the task asks for {shown} as {facts.path}"
    return Clue(hint, source.place(given[0]))


def _may_set(node: ast.AST, path: str) -> bool:
    """Return whether an assignment or argument may set a field of a goal, and not one of another message."""
    if not isinstance(node, ast.Assign):
        return True
    dotted = [chain(target).removeprefix("self.").split(".") for target in node.targets]
    return any(f".{path}".endswith(f".{'.'.join(parts[1:])}") for parts in dotted)


@hint_rule("cancels_goal", priority=3590)
def _cancels_at_another_number(case: Case) -> Clue | None:
    """The condition to cancel does not hold for the number from which on the goal has to be cancelled."""
    source = case.source
    tests = [test for test in source.all(ast.If) if names_called(source, test.body) & _CANCELS]
    needed = [node for test in tests for node in _comparisons(source, test.test)]
    for path, wanted in case.check.when.items():
        leaf = path.rpartition(".")[2]
        if not isinstance(wanted, (int, float)) or isinstance(wanted, bool):
            continue
        for node in needed:
            limit = constant_value(source, node.comparators[0])
            holds = _ORDERS.get(type(node.ops[0]))
            if len(node.ops) > 1 or limit is None or holds is None or _leaf_of(source, node.left) != leaf:
                continue
            if not holds(float(wanted), limit.value):
                hint = f"'{source.code(node, 60)}' is not true yet for {leaf} {number(float(wanted))}"
                strict = isinstance(node.ops[0], ast.Gt) and abs(limit.value - float(wanted)) <= EXACT
                hint += ": write >= in place of >" if strict else ", from which on the goal has to be cancelled"
                return Clue(hint, source.place(node), key=f"cancel:{first_line(node)}")
    return None


def _comparisons(source: Source, test: ast.expr) -> list[ast.Compare]:
    """Return the comparisons that all have to be true for a condition."""
    found = value_of(source, test)
    if isinstance(found, ast.BoolOp) and isinstance(found.op, ast.And):
        return [node for value in found.values for node in _comparisons(source, value)]
    return [found] if isinstance(found, ast.Compare) else []


def _leaf_of(source: Source, node: ast.expr) -> str:
    """Return the field that an expression reads, also through a variable."""
    return last_name(value_of(source, node)) or last_name(node)


@crash_rule(r"^AttributeError: '\w+_FeedbackMessage' object has no attribute '(\w+)'", priority=3600)
def _feedback_inside(crash: Crash) -> Clue | None:
    """The callback receives a message around the feedback."""
    field = crash.found[1]
    read = next((n for n in crash.source.on_line(crash.line, ast.Attribute) if n.attr == field), None)
    function = crash.source.function_at(crash.line)
    if read is None or function is None:
        return None
    received = [name for name in parameters(function) if name != "self"]
    name = received[0] if len(received) == 1 else crash.source.code(read.value, 40)
    return Clue(f"the feedback is a field of what the callback receives: write {name}.feedback.{field}")


@crash_rule(
    r"^AttributeError: 'ActionClient' object has no attribute '(cancel_goal|get_result)(_async)?'", priority=3610
)
def _of_the_goal_handle(crash: Crash) -> Clue | None:
    """What a goal handle does is asked of the client."""
    name = f"{crash.found[1]}{crash.found[2] or ''}"
    return Clue(f"{name} is a method of the goal handle, which send_goal_async gives: call it on that")


@crash_rule(r"^AttributeError: '(\w+)_Result' object has no attribute 'status'", priority=3620)
def _status_beside_result(crash: Crash) -> Clue | None:
    """The status of a goal stands beside its result."""
    read = next((n for n in crash.source.on_line(crash.line, ast.Attribute) if n.attr == "status"), None)
    inner = read.value if read is not None else None
    if isinstance(inner, ast.Attribute) and inner.attr == "result":
        return Clue(f"the status is beside the result: write {crash.source.code(inner.value, 40)}.status")
    return Clue("the status is beside the result, in what the future of get_result_async gives")


@hint_rule("after_goal", "cancels_goal", priority=3630)
def _sleeps_before_a_goal(case: Case) -> Clue | None:
    """A callback sleeps for longer than there is time to react."""
    source = case.source
    if has_threads(source):
        return None
    inside = source.called_back()
    for call in source.calling("time.sleep"):
        worth = number_in_code(source, argument(call, 0, "secs"))
        if call in inside and worth is not None and worth > seconds(case.check.within):
            hint = f"{source.code(call, 40)} holds up every callback for {number(worth)} s, and there are"
            return Clue(f"{hint} {number(seconds(case.check.within))} s to react: use a timer", source.place(call))
    return None
