"""Causes of silent topics and services, and of missing input: wrong names, types and policies, and dead code."""

from __future__ import annotations

import ast
import re
from collections.abc import Container, Sequence

from grader.grading.judging.diagnosis.rules import (
    NO_SOURCE,
    Case,
    Clue,
    file_for,
    hint_rule,
    log_call,
    silent_topic,
    unheard_topic,
)
from grader.grading.judging.diagnosis.wiring import (
    MOST_MADE,
    Made,
    conditions,
    constant_value,
    elsewhere_because,
    has_no_caller,
    has_threads,
    head_of,
    is_flag,
    is_log,
    is_read,
    made,
    made_for,
    names_called,
    names_in,
    node_made,
    publish_calls,
    reached,
    roots,
    runs,
    shared_names,
    short,
    spins,
    switches,
    target_of,
    text_origin,
    time_since,
    timer_code,
    value_of,
    variable_of,
    waits_for_ever,
)
from grader.grading.judging.facts import LogPaceFacts, RateFacts, WrongLogFacts
from grader.grading.judging.logs.outputs import student_records
from grader.grading.judging.source import (
    Function,
    Source,
    argument,
    chain,
    covers,
    first_line,
    last_name,
    literal_text,
    subtree,
)
from grader.grading.judging.values import carries_number, student_endpoints
from grader.grading.model.exercise import Location, Outcome, ProblemKind, roles_of, texts_under
from grader.grading.model.wording import quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import first_unmet, unusual_request

_COMMENTED_TIMER = re.compile(r"^\s*#.*\bcreate_timer\s*\(")
#: What follows from a request that an ordinary publisher does not meet.
_ONLY_SAME = "it receives only from publishers that offer the same: remove it"
#: A sleep longer than this before the node spins probably explains its silence.
_LONG_SLEEP_S = 15.0


@dataclass(frozen=True, slots=True)
class _Unseen:
    """Calls that should have run and left no trace: they publish, or they log."""

    case: Case
    source: Source
    calls: list[ast.Call]


def _unseen(case: Case) -> _Unseen | None:
    topic = silent_topic(case)
    if topic:
        source = file_for(case, "publisher", topic)
        return _Unseen(case, source, publish_calls(source, made_for(source, "publisher", topic)))
    logged = case.found(WrongLogFacts)
    if (logged is not None and logged.right == 0) or (
        case.criterion.check_name == "uses_logger" and not student_records(case.trace, case.process)
    ):
        return _Unseen(case, case.source, _unseen_logs(case))
    return None


def _unseen_or_once(case: Case) -> _Unseen | None:
    """Return the calls that left no trace, or only one message."""
    rate = case.found(RateFacts)
    return _unseen(case) or (_Unseen(case, case.source, []) if rate is not None and rate.count == 1 else None)


def _unseen_logs(case: Case) -> list[ast.Call]:
    """Return the calls that log and that no record came from."""
    source = case.source
    seen = {r.line for r in student_records(case.trace, case.process) if r.file == source.file}
    logs = [n for n in source.all(ast.Call) if is_log(source, n)]
    return [n for n in logs if not any(covers(n, line) for line in seen)]


@hint_rule(priority=8010)
def _other_domain(case: Case) -> Clue | None:
    """The file chooses a ROS domain, and no other node sees what it makes."""
    seen = {e.participant for e in student_endpoints(case.trace)}
    if len(seen) >= len(case.sources) or case.trace.service_ends("service") or case.trace.service_ends("client"):
        return None
    for source in case.sources.values():
        settings: list[ast.Assign | ast.keyword] = [*source.all(ast.Assign), *source.all(ast.keyword)]
        setting = next((n for n in settings if _sets_domain(n)), None)
        if setting is not None:
            hint = f"{source.code(setting)} puts the node into another ROS domain, where no other node sees it"
            key = f"domain:{source.file}:{first_line(setting)}"
            return Clue(f"{hint}: remove it", source.place(setting), key=key)
    return None


def _sets_domain(node: ast.Assign | ast.keyword) -> bool:
    # A machine on which nobody chose a domain is in domain 0.
    if isinstance(node.value, ast.Constant) and node.value.value in (None, "", 0, "0"):
        return False
    if isinstance(node, ast.keyword):
        return node.arg == "domain_id"
    subscripts = (t for t in node.targets if isinstance(t, ast.Subscript) and last_name(t.value) == "environ")
    return any(literal_text(t.slice) == "ROS_DOMAIN_ID" for t in subscripts)


@hint_rule(priority=8020)
def _simulated_time(case: Case) -> Clue | None:
    """The node waits for simulated time, and nothing publishes it."""
    published = any(e.topic == "/clock" for e in student_endpoints(case.trace, "publisher"))
    if published or case.trace.deliveries("/clock") or not silent_topic(case):
        return None
    for source in case.sources.values():
        setting = next((call for call in source.all(ast.Call) if _sets_simulated_time(call)), None)
        if setting is not None:
            hint = f"{source.code(setting)} makes timers wait for simulated time on /clock, which nothing publishes"
            key = f"use_sim_time:{source.file}:{setting.lineno}"
            return Clue(f"{hint}: remove it", source.place(setting), key=key)
    return None


def _sets_simulated_time(call: ast.Call) -> bool:
    values = [*call.args, *(keyword.value for keyword in call.keywords)]
    constants = [value.value for value in values if isinstance(value, ast.Constant)]
    return "use_sim_time" in constants and any(value is True for value in constants)


@hint_rule(priority=8030)
def _wrong_topic(case: Case) -> Clue | None:
    for kind, topic in (("publisher", silent_topic(case)), ("subscription", unheard_topic(case))):
        ends = student_endpoints(case.trace, kind)
        if not topic or any(e.topic == topic for e in ends):
            continue
        source = file_for(case, kind, topic)
        own = [(e, m) for e in ends if (m := made_for(source, kind, e.topic, short(e.type))) is not None]
        own = [(e, m) for e, m in own if case.type in ("", e.type)] or own
        if len({m.call for _, m in own}) == 1:
            return _elsewhere(source, own[0][1], own[0][0].topic, topic)
    return None


def _elsewhere(source: Source, item: Made, found: str, topic: str) -> Clue:
    does = "publishes on" if item.kind == "publisher" else "subscribes to"
    hint = f"{source.code(item.call)} {does} {quote(found, 60)}: the task asks for {topic}"
    because = elsewhere_because(item.topic, topic)
    origin = item.call if because else text_origin(source, argument(item.call, 1, "topic"), item.call)
    return Clue(hint + because, source.place(origin), key=f"topic:{source.file}:{item.call.lineno}")


@hint_rule("publishes", "subscribes", priority=8040)
def _wrong_type(case: Case) -> Clue | None:
    check, kind = case.check, "publisher" if case.speaks else "subscription"
    wrong = student_endpoints(case.trace, kind, check.topic)
    if not wrong or any(e.type == check.type for e in wrong):
        return None
    item = made_for(case.source, kind, check.topic, short(wrong[0].type))
    if item is None:
        return None
    module, _, name = check.type.rpartition("/")
    hint = f"{case.source.code(item.call)} uses {short(wrong[0].type)}: the task asks for {name}, "
    return Clue(f"{hint}from {module.replace('/', '.')} import {name}", case.source.place(item.call))


@hint_rule(priority=8050)
def _latched_subscription(case: Case) -> Clue | None:
    """A subscription with transient_local durability receives only from publishers that offer it."""
    deaf = _deaf_subscription(case)
    if deaf is None or deaf.policy != "durability":
        return None
    policy = next((n for n in deaf.source.all(ast.Attribute) if n.attr == "TRANSIENT_LOCAL"), None)
    hint = "a TRANSIENT_LOCAL subscription receives only from publishers that offer this too: remove the durability"
    return Clue(hint, deaf.source.place(policy if policy is not None else deaf.item.call), key=f"apart:{deaf.topic}")


@hint_rule(priority=8055)
def _demanding_subscription(case: Case) -> Clue | None:
    """A subscription that requests a deadline or a liveliness receives only from publishers that offer it."""
    deaf = _deaf_subscription(case)
    if deaf is None or deaf.policy == "durability":
        return None
    source, profile = deaf.source, value_of(deaf.source, deaf.item.qos)
    given: list[ast.AST] = [
        n for n in (ast.walk(profile) if profile else ()) if isinstance(n, ast.keyword) and n.arg == deaf.policy
    ]
    given = given or [
        n for n in source.all(ast.Assign) if len(n.targets) == 1 and chain(n.targets[0]).endswith(f".{deaf.policy}")
    ]
    if len(given) != 1:
        return None
    hint = f"with {source.code(given[0], 60)} {_ONLY_SAME}"
    return Clue(hint, source.place(given[0]), key=f"apart:{deaf.topic}")


@dataclass(frozen=True, slots=True)
class _Deaf:
    """A subscription to which no publisher offers what it requests."""

    topic: str
    policy: str  # the name of the parameter in rclpy
    source: Source
    item: Made


def _deaf_subscription(case: Case) -> _Deaf | None:
    topic = next(iter(case.hears), "")
    listening = student_endpoints(case.trace, "subscription", topic)
    requests = [unusual_request(end) for end in listening]
    first = requests[0] if requests else None
    if first is None or None in requests or (case.speaks and not silent_topic(case)):
        return None
    source = file_for(case, "subscription", topic)
    item = made_for(source, "subscription", topic, short(listening[0].type))
    return None if item is None else _Deaf(topic, first.policy, source, item)


@hint_rule(priority=8060)
def _kept_apart(case: Case) -> Clue | None:
    """Two files are correct by themselves, but cannot communicate."""
    for topic in texts_under(case.check, *roles_of(type(case.check)).topics):
        ends = student_endpoints(case.trace, topic=topic)
        here = [e for e in ends if e.kind == "publisher"]
        there = [e for e in ends if e.kind == "subscription"]
        if len(here) != 1 or len(there) != 1 or topic not in case.topics:
            continue
        talker, hearer = _file_with(case, "publisher", topic), _file_with(case, "subscription", topic)
        if talker is None or hearer is None or talker[0] is hearer[0]:
            continue
        place = hearer[0].place(hearer[1].call)
        other = f"line {talker[1].call.lineno} of {talker[0].file}"
        key = f"apart:{topic}"
        if here[0].type != there[0].type:
            hint = f"this takes {short(there[0].type)}, but {other} sends {short(here[0].type)}"
            return Clue(f"{hint}: use the same type for {topic} in both files", place, key)
        if (here[0].reliability, there[0].reliability) == ("best_effort", "reliable"):
            return Clue(f"this asks for reliable messages, but {other} sends best effort: use the same QoS", place, key)
        if (here[0].durability, there[0].durability) == ("volatile", "transient_local"):
            return Clue(f"this asks for transient_local durability, which {other} does not offer", place, key)
        if (unmet := first_unmet(here[0], there[0])) is not None:
            hint = f"this requests {unmet.requested}, but {other} offers {unmet.offered}: use the same QoS"
            return Clue(hint, place, key)
    return None


def _file_with(case: Case, kind: str, topic: str) -> tuple[Source, Made] | None:
    found = [(s, m) for s in case.sources.values() if (m := made_for(s, kind, topic)) is not None]
    return found[0] if len(found) == 1 else None


@hint_rule(problem=ProblemKind.NO_EDGE, priority=8070)
def _graph_topic(case: Case) -> Clue | None:
    """A direction is missing from the graph because one file uses another name for its topic."""
    for topic in case.topics:
        for kind in ("publisher", "subscription"):
            source, ends = file_for(case, kind, topic), student_endpoints(case.trace, kind)
            if any(e.topic == topic for e in ends):
                continue
            items = made(source, kind)
            found = [e.topic for e in ends if made_for(source, kind, e.topic) in items]
            if len(items) == 1 and len(found) == 1:
                return _elsewhere(source, items[0], found[0], topic)
    return None


@hint_rule(priority=8080)
def _no_subscription(case: Case) -> Clue | None:
    """One of two directions is not implemented."""
    topic = unheard_topic(case)
    if case.is_about(ProblemKind.NO_EDGE):
        topic = next(reversed(case.topics), "")
        there = student_endpoints(case.trace, "subscription", topic)
        topic = "" if there else topic
    source = file_for(case, "subscription", topic)
    if not topic or made(source, "subscription") or "Subscriber" in {last_name(n) for n in source.names()}:
        return None
    node = next((c for c in source.all(ast.ClassDef) if any(last_name(b) == "Node" for b in c.bases)), None)
    if node is None or any(chain(n).startswith("super().create") for n in source.all(ast.Attribute)):
        return None
    hint = f"{source.file} subscribes to nothing: add self.create_subscription(..., '{topic}', self.callback, 10)"
    return Clue(hint, source.place(node), key=f"unheard:{topic}")


@hint_rule(priority=8090)
def _never_publishes(case: Case) -> Clue | None:
    topic = silent_topic(case)
    source = file_for(case, "publisher", topic)
    item = made_for(source, "publisher", topic) if topic else None
    if item is None or any(last_name(n) == "publish" for n in source.names()) or unheard_topic(case):
        return None
    return _message_not_sent(source, item) or Clue(
        f"{source.code(item.call)} creates a publisher, but nothing in the file calls its publish()",
        source.place(item.call),
    )


def _message_not_sent(source: Source, publisher: Made) -> Clue | None:
    """Return the last line that sets a message of a publisher's type, where there is only one."""
    makers = [c for c in source.calls(publisher.type) if target_of(source, c)] if publisher.type else []
    owner = target_of(source, publisher.call)
    function = source.function_of(makers[0]) if len(makers) == 1 else None
    if function is None or not owner or function.name == "__init__":
        return None
    around = (function, *source.around(function, ast.FunctionDef), None)
    seen = source.is_method(function) if "." in owner else source.function_of(publisher.call) in around
    if not seen:
        return None
    name = target_of(source, makers[0])
    send = f"{owner}.publish({name})"
    given = next(
        (r for r in source.all(ast.Return) if source.function_of(r) is function and chain(r.value) == name), None
    )
    if given is not None:
        hint = f"{source.code(given)} publishes nothing, as nobody receives it: write {send}"
        return Clue(hint, source.place(given))
    made_at = source.parents[makers[0]]
    inside = [n for n in subtree(function) if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
    sets = [n for n in inside if chain(n).startswith(f"{name}.") and first_line(n) > first_line(made_at)]
    last = max([made_at, *sets], key=first_line)
    level = next((t for t in reversed([*source.around(last, ast.If)]) if made_at not in set(subtree(t))), None)
    where = "below this line" if level is None else f"after the block of 'if {source.code(level.test, 30)}'"
    return Clue(f"{name} is never published: add {send} {where}", source.place(last))


@hint_rule(given=_unseen, priority=8100)
def _destroyed_first(unseen: _Unseen) -> Clue | None:
    """The node is destroyed before it spins."""
    source = unseen.source
    for call in source.calls("destroy_node", "destroy_publisher", "destroy_timer"):
        spun = [n for n in spins(source) if source.function_of(n) is source.function_of(call)]
        later = [n for n in spun if first_line(n) > first_line(call)]
        if later and len(later) == len(spun) and not any(source.around(call, ast.If)):
            hint = (
                f"{source.code(call)} comes before {last_name(later[0])} in line {first_line(later[0])}: move it down"
            )
            return Clue(hint, source.place(call))
    return None


@hint_rule(given=_unseen, priority=8110)
def _never_reached(unseen: _Unseen) -> Clue | None:
    """The code stands after a return, or is left by the one before."""
    source = unseen.source
    leaving: list[ast.stmt] = [*source.all(ast.Return), *source.all(ast.Continue), *source.all(ast.Break)]
    for stop in sorted(leaving, key=first_line):
        rest = _after(source, stop)
        if unseen.calls and rest and all(any(covers(s, first_line(c)) for s in rest) for c in unseen.calls):
            hint = f"{source.code(stop, 40)} ends {source.function_name(stop)} here, so that "
            return Clue(f"{hint}line {first_line(unseen.calls[0])} never runs: remove it", source.place(stop))
    return None


def _after(source: Source, statement: ast.stmt) -> list[ast.stmt]:
    """Return the statements behind one in its block."""
    parent = source.parents.get(statement)
    for block in ("body", "orelse", "finalbody"):
        statements = getattr(parent, block, None)
        if isinstance(statements, list) and statement in statements:
            return statements[statements.index(statement) + 1 :]
    return []


@hint_rule(given=_unseen, priority=8120)
def _lambda_names(unseen: _Unseen) -> Clue | None:
    """`lambda: self.tick` names the method and does not call it."""
    source = unseen.source
    for item in made(source, "timer", "subscription"):
        body = item.callback.body if isinstance(item.callback, ast.Lambda) else None
        if isinstance(body, (ast.Name, ast.Attribute)) and source.functions(last_name(body)):
            code = source.code(body, 40)
            return Clue(f"the lambda names {code} and does not call it: pass {code} itself", source.place(item.call))
    return None


@hint_rule(given=_unseen, priority=8130)
def _never_true(unseen: _Unseen) -> Clue | None:
    """The condition around the code can never hold: a publisher is no None."""
    source = unseen.source
    owned = {target_of(source, m.call) for m in made(source, "publisher", "subscription", "timer")} - {""}
    for call in unseen.calls:
        for test in source.around(call, ast.If):
            asked = test.test
            none = isinstance(asked, ast.Compare) and isinstance(asked.ops[0], ast.Is) and chain(asked.left) in owned
            turned = isinstance(asked, ast.UnaryOp) and isinstance(asked.op, ast.Not) and chain(asked.operand) in owned
            if none or turned:
                code = source.code(asked, 40)
                return Clue(f"'if {code}' is never true, because it is set: remove the condition", source.place(test))
    return None


@hint_rule(given=_unseen, priority=8140)
def _kept_in_local(unseen: _Unseen) -> Clue | None:
    """What is logged or published waits for a value that the callback keeps in a local variable."""
    source = unseen.source
    for call in unseen.calls:
        for test in conditions(source, call):
            if not is_flag(test.test):
                continue
            for name in names_in(test.test):
                clue = _kept_elsewhere(source, name)
                if clue is not None:
                    return clue
    return None


def _kept_elsewhere(source: Source, waited: str) -> Clue | None:
    """Return a clue if a variable that is waited for is only ever set to None, and a callback sets a local one."""
    stores = source.stored.get(waited, ())
    values = [getattr(source.parents.get(n), "value", None) for n in stores]
    early = [isinstance(v, ast.Constant) and not v.value for v in values]
    callbacks = [f for m in made(source, "subscription") for f in roots(source, m.callback)]
    inside = [n for f in callbacks for n in subtree(f)]
    locals_ = [n for n in inside if isinstance(n, ast.Name) and isinstance(n.ctx, ast.Store)]
    bare = waited.removeprefix("self.")
    if len(callbacks) != 1 or "." in bare:
        return None
    function = callbacks[0]
    name = getattr(function, "name", "the callback")
    if waited == bare:  # a variable of the file
        mine = [n for n in locals_ if n.id == waited]
        declared = any(waited in g.names for g in source.all(ast.Global) if g in inside)
        if not mine or declared or not any(source.function_of(n) is None for n in stores):
            return None
        hint = f"{name} assigns {waited}, so Python treats it as local"
        names = shared_names(source, function, waited) if isinstance(function, Function) else waited
        return Clue(f"{hint}: begin {name} with: global {names}", source.place(mine[0]))
    if not stores or not all(early):
        return None
    chosen = [n for n in locals_ if n.id == bare] or locals_
    if chosen:
        kept = min(chosen, key=first_line)
        return Clue(f"{kept.id} is local to {name}: assign to {waited}", source.place(kept))
    fields = [n for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)]
    unread = [n for n in fields if chain(n).startswith("self.") and not is_read(source, chain(n))]
    hint = f"nothing sets {waited}: assign the message to it in {name}"
    hint = f"{chain(unread[0])} is not read: assign to {waited}" if len(unread) == 1 else hint
    return Clue(hint, source.place(unread[0] if len(unread) == 1 else function))


@hint_rule(given=_unseen, priority=8150)
def _not_spun(unseen: _Unseen) -> Clue | None:
    source = unseen.source
    node = node_made(source)
    waits = made(source, "timer") or made(source, "subscription")
    if node is None or spins(source) or not waits or "asyncio" in "".join(source.lines[:60]):
        return None
    name = variable_of(source, node)
    hint = f"nothing spins the node: without rclpy.spin({name}) no timer or subscription callback is ever called"
    while_ok = (loop for loop in source.all(ast.While) if any(last_name(n) == "ok" for n in ast.walk(loop.test)))
    if (loop := next(while_ok, None)) is not None:
        hint = "nothing spins the node, so no callback is ever called while this loop runs: "
        if all(_only_waits(statement) for statement in loop.body):
            return Clue(f"{hint}write rclpy.spin({name}) in place of the loop", source.place(loop))
        return Clue(f"{hint}call rclpy.spin_once({name}, timeout_sec=0.1) in it", source.place(loop))
    return Clue(hint, source.place(node))


def _only_waits(statement: ast.stmt) -> bool:
    """Return whether a statement does nothing but let time pass."""
    if isinstance(statement, ast.Expr) and isinstance(statement.value, ast.Call):
        return last_name(statement.value.func) == "sleep"
    return isinstance(statement, (ast.Pass, ast.Continue))


@hint_rule("logs_received", priority=8160)
def _no_number_heard(case: Case) -> Clue | None:
    """A subscription has a type without a number."""
    check = case.check
    types = {e.type for e in student_endpoints(case.trace, "subscription", check.topic)}
    item = made_for(case.source, "subscription", check.topic)
    if item is None or len(types) != 1 or carries_number(next(iter(types))):
        return None
    hint = f"{short(next(iter(types)))} carries no number: use a numeric type such as Float32 in both files"
    return Clue(hint, case.source.place(item.call), key=f"apart:{check.topic}")


@hint_rule(given=_unseen_or_once, priority=8170)
def _nested_spin(unseen: _Unseen) -> Clue | None:
    """The node spins in its constructor, or inside a callback, and never returns."""
    source = unseen.source
    for call in source.calls("spin", "spin_until_future_complete"):
        function = source.function_of(call)
        if function is None or not source.is_method(function):
            continue
        code = source.code(call)
        if function.name == "__init__":
            elsewhere = any(last_name(n) == last_name(call.func) and n is not call.func for n in spins(source))
            advice = "remove it" if elsewhere else "call it in main, once the node is made"
            hint = f"{code} in the constructor does not return, so nothing after it runs: {advice}"
            return Clue(hint, source.place(call), key="nested_spin")
        if any(call in runs(source, m) for m in made(source, "timer", "subscription")):
            hint = f"{code} inside a callback waits for something that can only arrive after the callback returns"
            return Clue(hint, source.place(call), key="nested_spin")
    return None


@hint_rule(priority=8180)
def _stopped_listening(case: Case) -> Clue | None:
    """The subscription requests a deadline that no publisher offers, or is destroyed before the data arrives."""
    facts = case.found(WrongLogFacts)
    if facts is None or facts.right != 0 or facts.cause not in ("nothing", "constant"):
        return None
    source = case.source
    for item in made(source, "subscription"):
        profile = value_of(source, item.qos)
        given = [n for n in ast.walk(profile) if isinstance(n, ast.keyword)] if profile is not None else []
        near = [k for k in given if k.arg in ("deadline", "liveliness_lease_duration")]
        if len(near) == 1:
            return Clue(f"with {source.code(near[0], 50)} {_ONLY_SAME}", source.place(near[0]))
    ends = next(source.calls("destroy_subscription"), None)
    if ends is None:
        return None
    return Clue(f"after {source.code(ends)} no message can arrive any more: keep the subscription", source.place(ends))


@hint_rule(given=_unseen_or_once, priority=8185)
def _taken_from_executor(unseen: _Unseen) -> Clue | None:
    """`rclpy.spin_once(node)` takes the node from the executor that it was added to."""
    return taken_from_executor(unseen.source)


def taken_from_executor(source: Source) -> Clue | None:
    """Return a clue if rclpy takes a node from the executor that spins, which then does nothing."""
    added = {chain(c.args[0]): c for c in source.calls("add_node") if c.args}
    for call in source.calls("spin_once", "spin_until_future_complete"):
        node = chain(call.args[0]) if call.args and chain(call.func).startswith(("rclpy.", "spin")) else ""
        owner = added.get(node)
        executor = chain(owner.func).rpartition(".")[0] if owner is not None else ""
        if not executor or argument(call, 1, "executor") is not None or first_line(call) < first_line(owner or call):
            continue
        if any(chain(c.func) == f"{executor}.spin" for c in source.calls("spin")):
            hint = f"{source.code(call)} takes {node} from {executor}, which then has nothing to spin: write "
            return Clue(f"{hint}{executor}.{last_name(call.func)}(...)", source.place(call))
    return None


@hint_rule(given=_unseen, priority=8190)
def _waits_for_service(unseen: _Unseen) -> Clue | None:
    call = next(unseen.source.calls("wait_for_service"), None)
    hint = "this waits for a service that nobody offers here: the node must start without it"
    return None if call is None else Clue(hint, unseen.source.place(call))


@hint_rule(given=_unseen_or_once, priority=8200)
def _unwoken_rate(unseen: _Unseen) -> Clue | None:
    """`rate.sleep()` returns only if another thread spins the node."""
    source = unseen.source
    rate = next(source.calls("create_rate"), None)
    sleeps = [c for c in source.calls("sleep") if not c.args and not c.keywords]
    if rate is None or not sleeps or has_threads(source):
        return None
    hint = f"{source.code(sleeps[0])} waits forever, as only another thread that spins the node wakes a rate"
    return Clue(f"{hint}: use create_timer instead", source.place(sleeps[0]), key="unwoken_rate")


@hint_rule(given=_unseen, priority=8210)
def _spins_first(unseen: _Unseen) -> Clue | None:
    """A loop spins once without a timeout before it publishes or logs, and nothing wakes the node."""
    source = unseen.source
    for loop in source.loops():
        inside = list(reached(source, [loop]))
        call = next((n for n in inside if isinstance(n, ast.Call) and waits_for_ever(source, n)), None)
        if call is not None and set(unseen.calls) & set(inside) and not made(source, "timer"):
            hint = f"{source.code(call)} without timeout_sec waits until a message or a timer wakes the node"
            does = "publishes" if silent_topic(unseen.case) else "logs"
            return Clue(f"{hint}: call spin, and let a timer call what {does}", source.place(call))
    return None


@hint_rule(given=_unseen, priority=8220)
def _held_up(unseen: _Unseen) -> Clue | None:
    """A long sleep, or a waiting loop, comes before the node spins."""
    source = unseen.source
    for call in source.calls("sleep"):
        worth = constant_value(source, argument(call, 0, "secs"))
        early = source.function_name(call) in ("", "__init__", "main")
        if early and worth is not None and worth.value >= _LONG_SLEEP_S:
            return Clue(f"{source.code(call)} blocks everything: the node does nothing meanwhile", source.place(call))
    return _waits_in_constructor(source)


def _waits_in_constructor(source: Source) -> Clue | None:
    """Return the loop in a constructor that waits for a value that only a callback can set."""
    callbacks = [f for m in made(source, "subscription") for f in roots(source, m.callback)]
    brought = {chain(n) for n in reached(source, callbacks) if isinstance(n, ast.Attribute) and last_name(n)}
    for loop in source.all(ast.While):
        inside = names_called(source, [loop])
        idle = not inside & {"spin_once", "spin", "publish", "wait_for_service"}
        asked = {chain(n) for n in ast.walk(loop.test) if isinstance(n, ast.Attribute)}
        if source.function_name(loop) == "__init__" and idle and asked & brought:
            hint = f"the loop '{head_of(source, loop)}' waits in the constructor for a callback"
            return Clue(f"{hint} that can only run once the node spins", source.place(loop))
    return None


@hint_rule(given=_unseen, priority=8230)
def _never_called(unseen: _Unseen) -> Clue | None:
    """The code that publishes or logs is in a method that nothing calls."""
    source = unseen.source
    functions = list(dict.fromkeys(source.function_of(c) for c in unseen.calls))[:MOST_MADE]
    dead = [f for f in functions if f is not None and has_no_caller(source, f)]
    if len(dead) < len(functions) or not dead:
        return None
    name = dead[0].name
    row = next((k for k, line in enumerate(source.lines, 1) if _COMMENTED_TIMER.match(line[:200])), 0)
    if row:
        hint = f"the timer that should call {name} is commented out"
        return Clue(hint, Location(source.file, row), key=f"dead:{name}")
    does = "publishes" if silent_topic(unseen.case) else "logs"
    owner = "self." if source.is_method(dead[0]) else ""
    hint = f"nothing calls {name}, which {does}: create a timer that does, create_timer(..., {owner}{name})"
    return Clue(hint, source.place(dead[0]), key=f"dead:{name}")


@hint_rule(given=_unseen, priority=8240)
def _late_timer(unseen: _Unseen) -> Clue | None:
    """The timer's period is longer than the observation, which no limit cut short."""
    if unseen.case.trace.marks("limit"):
        return None
    source, latest_s = unseen.source, seconds(unseen.case.trace.stop_ns) - 1
    for item in made(source, "timer"):
        worth = constant_value(source, item.period)
        inside = set(runs(source, item))
        if worth is not None and worth.value > latest_s and any(c in inside for c in unseen.calls):
            hint = f"{timer_code(source, item)} waits {worth.value:g} s before the first call: the period is in seconds"
            return Clue(hint, source.place(worth.origin), key=f"period:{item.call.lineno}")
    return None


@hint_rule(outcome=Outcome.NOT_MET, given=_unseen, priority=8250)
def _only_when_told(unseen: _Unseen) -> Clue | None:
    """Everything is published in the callback of a topic without a publisher."""
    source, calls = unseen.source, unseen.calls
    for item in made(source, "subscription"):
        inside = set(runs(source, item))
        if item.topic is None or not calls or not all(c in inside for c in calls):
            continue
        timed = [n for t in made(source, "timer") for n in runs(source, t)]
        if not _heard(unseen.case, item.topic) and not any(c in timed for c in calls):
            hint = f"this runs only when a message arrives on {quote(item.topic, 60)}, and none does: use a timer"
            return Clue(hint, source.place(item.call), key=f"told:{item.call.lineno}")
    return None


@hint_rule(priority=8252)
def _time_moves_always(case: Case) -> Clue | None:
    """The time of the last log is stored with each message, so that it is never long ago."""
    pace, wrong = case.found(LogPaceFacts), case.found(WrongLogFacts)
    rare = pace is not None and (pace.count <= 2 or pace.average_s > pace.wanted_s)
    few = wrong is not None and (wrong.right == 0 or wrong.cause == "few")
    call, source = log_call(case), case.source
    if call is None or not (rare or few):
        return None
    heard = [m for m in made(source, "subscription") if m.topic is not None and _heard(case, m.topic)]
    inside = {n for m in heard for n in runs(source, m)}
    waits = {switch.node for switch in switches(source) if switch.limit.value > 0}
    for test in (t for t in source.around(call, ast.If) if t in inside and waits & set(ast.walk(t.test))):
        passed = time_since(source, test.test)
        stores = source.stores(chain(passed.right)) if passed is not None else []
        statements = [s for n in stores if (s := source.parents.get(n)) is not None]
        beside = [s for s in statements if source.parents.get(s) is source.parents.get(test)]
        if beside:
            code, asked = source.code(beside[0]), source.code(test.test, 40)
            hint = f"{code} runs for each message, so '{asked}' is hardly ever true: indent it under the if"
            return Clue(hint, source.place(beside[0]), key="log_pace")
    return None


@hint_rule(outcome=Outcome.NOT_MET, given=_unseen, priority=8255)
def _guarded(unseen: _Unseen) -> Clue | None:
    """A callback hears messages, and a condition keeps it from publishing or logging each time."""
    source, calls = unseen.source, unseen.calls
    for item in made(source, "subscription"):
        inside = set(runs(source, item))
        heard = len(unseen.case.trace.deliveries(f"/{(item.topic or '').strip('/')}"))
        if not heard or not calls or not all(c in inside for c in calls):
            continue
        callers = _callers(source, calls, inside)
        outer = _shared_conditions(source, callers) if callers else []
        tests = outer or _shared_conditions(source, calls)
        if not tests:
            continue
        test, calls = min(tests, key=first_line), (callers if outer else calls)
        does = "publishes" if silent_topic(unseen.case) else "logs"
        name = last_name(item.callback) or "the callback"
        ended = "left it each time before it" if calls[0] not in set(subtree(test)) else "was never true, so it never"
        hint = f"{name} ran for each of {heard} messages, but 'if {source.code(test.test, 40)}' {ended} {does}"
        return Clue(f"{hint}: check the condition", source.place(test), key=f"guard:{first_line(test)}")
    return None


def _shared_conditions(source: Source, calls: Sequence[ast.Call]) -> list[ast.If]:
    return [t for t in conditions(source, calls[0]) if all(t in conditions(source, c) for c in calls)]


def _callers(source: Source, calls: Sequence[ast.Call], inside: Container[ast.AST]) -> list[ast.Call]:
    """Return the calls in a callback of the one method that holds other calls; empty if they are in the callback."""
    names = {source.function_name(c) for c in calls}
    return [c for name in names for c in source.calls(name) if c in inside] if len(names) == 1 else []


@hint_rule(priority=8260)
def _waits_to_hear(case: Case) -> Clue | None:
    """Publishing depends on an attribute that only the callback of a silent topic sets."""
    topic = silent_topic(case)
    source = file_for(case, "publisher", topic) if topic else NO_SOURCE
    calls = publish_calls(source, made_for(source, "publisher", topic))
    for item in made(source, "subscription"):
        unheard = item.topic is not None and not _heard(case, item.topic)
        tests = [_held_back(source, call, item) for call in calls] if unheard else []
        if tests and tests[0] is not None and all(tests):
            hint = f"'if {source.code(tests[0].test, 40)}' blocks publishing until a message arrives on "
            hint += f"{quote(item.topic or '', 60)}, and none does: publish without it"
            return Clue(hint, source.place(tests[0]), key=f"told:{item.call.lineno}")
    return None


def _heard(case: Case, written: str) -> bool:
    topic = f"/{written.strip('/')}"
    return bool(case.trace.deliveries(topic) or case.trace.messages(topic))


def _held_back(source: Source, call: ast.Call, item: Made) -> ast.If | None:
    """Return the condition by which a call waits for a value from the callback of a subscription."""
    inside = runs(source, item)
    brought = {chain(n) for n in inside if isinstance(n, ast.Attribute) and isinstance(n.ctx, ast.Store)}
    for test in conditions(source, call):
        asked = {chain(n) for n in ast.walk(test.test) if isinstance(n, ast.Attribute)}
        others = [s for name in asked & brought for s in source.stores(name) if s not in inside]
        early = all(source.function_name(s) == "__init__" for s in others)
        if is_flag(test.test) and asked & brought and early:
            return test
    return None
