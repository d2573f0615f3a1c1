"""Causes behind topics that stay silent and nodes that do not listen: wrong names, types, policies, and dead code."""

from __future__ import annotations

import ast
import re

from grader.core.exercise import Location, Outcome
from grader.core.quantities import seconds
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.graph import BidirectionalGraph
from grader.judging.checks.logs import UsesLogger
from grader.judging.checks.odometry import LogsPosition
from grader.judging.checks.rate import TopicRate
from grader.judging.checks.sensor import LogsReceived
from grader.judging.checks.together import AnswersTogether
from grader.judging.checks.topics import Publishes, Subscribes
from grader.judging.diagnosis.case import Case, Cause, Clue
from grader.judging.diagnosis.constants import constant
from grader.judging.diagnosis.endings import head_of, node_made, spins, variable_of
from grader.judging.diagnosis.wiring import MOST_MADE, Made, is_log, made, made_for, publish_calls, reached, roots, used
from grader.judging.output import student_records
from grader.judging.silence import student_endpoints
from grader.judging.source import Function, Source, argument, chain, covers, last_name
from grader.judging.values import carries_number, published
from grader.judging.wording import quote

_COMMENTED_TIMER = re.compile(r"^\s*#.*\bcreate_timer\s*\(")
#: A sleep longer than this before the node spins looks like the reason for its silence.
_LONG_SLEEP_S = 15.0


def silent_topic(case: Case) -> str:
    """Return the topic on which messages were asked for and none came; empty if that is not the matter."""
    check = case.criterion.check
    if isinstance(check, (Publishes, TopicRate)):
        asked = [check.topic]
    elif isinstance(check, ThresholdResponse):
        asked = [check.output]
    else:
        asked = [check.input, check.output] if isinstance(check, AnswersTogether) else []
    type_ = check.type if isinstance(check, Publishes) else None
    silent = (t for t in asked if not any(type_ in (None, m.type) for m in published(case.trace, t)))
    return next(silent, "")


def unheard_topic(case: Case) -> str:
    """Return the topic to which nothing fitting subscribes; empty if that is not the matter."""
    check = case.criterion.check
    if isinstance(check, ThresholdResponse):
        topic = check.input if silent_topic(case) else ""
    elif isinstance(check, AnswersTogether):
        topic = check.input if silent_topic(case) == check.output else ""
    else:
        topic = check.topic if isinstance(check, (Subscribes, LogsReceived)) else ""
    type_ = check.type if isinstance(check, Subscribes) else None
    there = [e for e in student_endpoints(case.trace, "subscription") if e.topic == topic and type_ in (None, e.type)]
    return "" if there else topic


def speaker(case: Case, topic: str) -> Source | None:
    """Return the file that is to publish a topic: the only one, or the only one that does not subscribe to it."""
    candidates = [s for s in case.sources.values() if made_for(s, "subscription", topic) is None]
    chosen = list(case.sources.values()) if len(case.sources) == 1 else candidates
    return case.source or (chosen[0] if len(chosen) == 1 else None)


def listener(case: Case, topic: str) -> Source | None:
    """Return the file that is to subscribe to a topic: the only one, or the only one that does not publish it."""
    candidates = [s for s in case.sources.values() if made_for(s, "publisher", topic) is None]
    chosen = list(case.sources.values()) if len(case.sources) == 1 else candidates
    return case.source or (chosen[0] if len(chosen) == 1 else None)


def short(type_: str) -> str:
    """Return the class name of a message type."""
    return quote(type_.rpartition("/")[2], 40)


def _wrong_topic(case: Case) -> Clue | None:
    for kind, topic in (("publisher", silent_topic(case)), ("subscription", unheard_topic(case))):
        source = (speaker if kind == "publisher" else listener)(case, topic) if topic else None
        others = [e for e in student_endpoints(case.trace, kind) if e.topic != topic]
        if (
            source is None
            or case.fault is not None
            or any(e.topic == topic for e in student_endpoints(case.trace, kind))
        ):
            continue
        own = [(e, m) for e in others if (m := made_for(source, kind, e.topic, short(e.type))) is not None]
        type_ = str(getattr(case.criterion.check, "type", ""))
        own = [(e, m) for e, m in own if type_ in ("", e.type)] or own
        if len({m.call for _, m in own}) == 1:
            return _elsewhere(source, own[0][1], own[0][0].topic, topic)
    return None


def _elsewhere(source: Source, item: Made, found: str, topic: str) -> Clue:
    does = "publishes on" if item.kind == "publisher" else "listens to"
    hint = f"{source.code(item.call)} {does} {quote(found, 60)}: the topic asked for is {topic}"
    if item.topic is not None and item.topic.startswith("~"):
        hint += "; ~ stands for the name of the node"
    elif item.topic is not None and item.topic.strip("/") == topic.strip("/"):
        hint += "; the node's namespace is put before the name"
    return Clue(hint, source.place(item.call), key=f"topic:{source.file}:{item.call.lineno}")


def _wrong_type(case: Case) -> Clue | None:
    check = case.criterion.check
    if not isinstance(check, (Publishes, Subscribes)) or case.fault is not None or case.source is None:
        return None
    kind = "publisher" if isinstance(check, Publishes) else "subscription"
    wrong = [e for e in student_endpoints(case.trace, kind) if e.topic == check.topic and e.type != check.type]
    if not wrong or len(wrong) < sum(e.topic == check.topic for e in student_endpoints(case.trace, kind)):
        return None
    item = made_for(case.source, kind, check.topic, short(wrong[0].type))
    if item is None:
        return None
    module, _, name = check.type.rpartition("/")
    hint = f"{case.source.code(item.call)} uses {short(wrong[0].type)}: the type asked for is {name}, "
    return Clue(f"{hint}from {module.replace('/', '.')} import {name}", case.source.place(item.call))


def _latched_subscription(case: Case) -> Clue | None:
    """A subscription that asks for transient_local durability hears only publishers that offer it."""
    check = case.criterion.check
    topic = check.topic if isinstance(check, (Subscribes, LogsReceived)) else getattr(check, "input", "")
    listening = [e for e in student_endpoints(case.trace, "subscription") if e.topic == topic]
    source = listener(case, topic) if listening else None
    deaf = not isinstance(check, (AnswersTogether, ThresholdResponse)) or bool(silent_topic(case))
    if source is None or not deaf or any(e.durability != "transient_local" for e in listening) or case.fault:
        return None
    item = made_for(source, "subscription", topic, short(listening[0].type))
    if item is None:
        return None
    policy = next((n for n in source.all(ast.Attribute) if n.attr == "TRANSIENT_LOCAL"), None)
    hint = "the durability TRANSIENT_LOCAL hears only publishers that offer it too: leave the durability out"
    return Clue(hint, source.place(policy if policy is not None else item.call), key=f"apart:{topic}")


def _kept_apart(case: Case) -> Clue | None:
    """Two files that each are right, and cannot talk to each other."""
    check = case.criterion.check
    if isinstance(check, AnswersTogether):
        topics = [check.input, check.output]
    else:
        topics = [check.forward, check.back] if isinstance(check, BidirectionalGraph) else []
    for topic in topics:
        ends = [e for e in student_endpoints(case.trace) if e.topic == topic]
        here = [e for e in ends if e.kind == "publisher"]
        there = [e for e in ends if e.kind == "subscription"]
        if len(here) != 1 or len(there) != 1 or case.fault is not None or topic not in case.topics:
            continue
        talker, hearer = _file_with(case, "publisher", topic), _file_with(case, "subscription", topic)
        if talker is None or hearer is None or talker[0] is hearer[0]:
            continue
        place = hearer[0].place(hearer[1].call)
        other = f"line {talker[1].call.lineno} of {talker[0].file}"
        key = f"apart:{topic}"
        if here[0].type != there[0].type:
            hint = f"this takes {short(there[0].type)}, but {other} sends {short(here[0].type)}"
            return Clue(f"{hint}: use one type for {topic} in both files", place, key)
        if (here[0].reliability, there[0].reliability) == ("best_effort", "reliable"):
            return Clue(f"this asks for reliable messages, but {other} sends best effort: use one QoS", place, key)
        if (here[0].durability, there[0].durability) == ("volatile", "transient_local"):
            return Clue(f"this asks for transient_local durability, which {other} does not offer", place, key)
    return None


def _file_with(case: Case, kind: str, topic: str) -> tuple[Source, Made] | None:
    found = [(s, m) for s in case.sources.values() if (m := made_for(s, kind, topic)) is not None]
    return found[0] if len(found) == 1 else None


def _needed_calls(case: Case) -> tuple[Source, list[ast.Call]] | None:
    """Return the calls that should have run and left no trace: they publish, or they log."""
    topic = silent_topic(case)
    source = speaker(case, topic) if topic else case.source
    if source is None or case.fault is not None:
        return None
    if topic:
        return source, publish_calls(source, made_for(source, "publisher", topic))
    position = isinstance(case.criterion.check, LogsPosition) and case.evidence("right") == 0
    if position or (isinstance(case.criterion.check, UsesLogger) and not student_records(case.trace, case.process)):
        return source, _unseen_logs(case, source)
    return None


def _unseen_logs(case: Case, source: Source) -> list[ast.Call]:
    """Return the calls that log and that no record came from."""
    seen = {r.line for r in student_records(case.trace, case.process) if r.file == source.file}
    logs = [n for n in source.all(ast.Call) if is_log(source, n)]
    return [n for n in logs if not any(covers(n, line) for line in seen)]


def _never_publishes(case: Case) -> Clue | None:
    topic = silent_topic(case)
    source = speaker(case, topic) if topic else None
    item = made_for(source, "publisher", topic) if source is not None else None
    if source is None or item is None or case.fault is not None:
        return None
    named = [n for n in source.names() if last_name(n).startswith("publish")]
    if [n for n in named if last_name(n) == "publish"] or unheard_topic(case):
        return None
    hint = f"{source.code(item.call)} makes a publisher, but nothing in the file calls its publish()"
    return Clue(hint, source.place(item.call))


def _not_spun(case: Case) -> Clue | None:
    found = _needed_calls(case)
    if found is None:
        return None
    source, _ = found
    node = node_made(source)
    waits = made(source, "timer") or made(source, "subscription")
    if node is None or spins(source) or not waits or "asyncio" in "".join(source.lines[:60]):
        return None
    hint = f"nothing spins the node: without rclpy.spin({variable_of(source, node)}) no timer and no subscription"
    return Clue(f"{hint} is ever called", source.place(node))


def _waits_for_service(case: Case) -> Clue | None:
    found = _needed_calls(case)
    call = next(found[0].calls("wait_for_service"), None) if found is not None else None
    if found is None or call is None:
        return None
    return Clue(
        "this waits for a service that nobody offers here: the node must start without it", found[0].place(call)
    )


def _unwoken_rate(case: Case) -> Clue | None:
    """`rate.sleep()` returns only when another thread spins the node."""
    few = isinstance(case.criterion.check, TopicRate) and case.evidence("window") == 1
    found = _needed_calls(case)
    source = found[0] if found is not None else case.source
    if source is None or case.fault is not None or not (few or found is not None):
        return None
    rate = next(source.calls("create_rate"), None)
    names = {last_name(n) for n in source.names()}
    sleeps = [c for c in source.calls("sleep") if not c.args and not c.keywords]
    if (
        rate is None
        or not sleeps
        or names & {"Thread", "MultiThreadedExecutor", "start_new_thread", "ThreadPoolExecutor"}
    ):
        return None
    hint = f"{source.code(sleeps[0])} waits for ever: a rate is woken only by another thread that spins the node"
    return Clue(f"{hint}: use create_timer instead", source.place(sleeps[0]), key="unwoken_rate")


def _held_up(case: Case) -> Clue | None:
    """A long sleep, or a loop that waits, before the node spins."""
    found = _needed_calls(case)
    if found is None:
        return None
    source, _ = found
    for call in source.calls("sleep"):
        worth = constant(source, argument(call, 0, "secs"))
        function = source.function_of(call)
        early = function is None or function.name in ("__init__", "main")
        if early and worth is not None and worth.value >= _LONG_SLEEP_S:
            return Clue(f"{source.code(call)} holds everything up: the node does nothing meanwhile", source.place(call))
    return _waits_in_constructor(source)


def _waits_in_constructor(source: Source) -> Clue | None:
    """Return the loop in a constructor that waits for what only a callback of the node can bring."""
    callbacks = [f for m in made(source, "subscription") for f in roots(source, m.callback)]
    brought = {chain(n) for n in reached(source, callbacks) if isinstance(n, ast.Attribute) and last_name(n)}
    for loop in source.all(ast.While):
        function = source.function_of(loop)
        inside = {last_name(n.func) for n in reached(source, [loop]) if isinstance(n, ast.Call)}
        idle = not inside & {"spin_once", "spin", "publish", "wait_for_service"}
        asked = {chain(n) for n in ast.walk(loop.test) if isinstance(n, ast.Attribute)}
        if function is not None and function.name == "__init__" and idle and asked & brought:
            hint = f"the loop '{head_of(source, loop)}' waits in the constructor for a callback"
            return Clue(f"{hint} that can only come once the node spins", source.place(loop))
    return None


def _never_called(case: Case) -> Clue | None:
    """What publishes or logs stands in a method that nothing calls."""
    found = _needed_calls(case)
    if found is None or not found[1]:
        return None
    source, calls = found
    functions = list(dict.fromkeys(source.function_of(c) for c in calls))[:MOST_MADE]
    dead = [f for f in functions if f is not None and not used(source, f) and _may_be_unused(source, f)]
    if len(dead) < len(functions) or not dead:
        return None
    name = dead[0].name
    row = next((k for k, line in enumerate(source.lines, 1) if _COMMENTED_TIMER.match(line[:200])), 0)
    if row:
        hint = f"the timer that should call {name} is commented out"
        return Clue(hint, Location(source.file, row), key=f"dead:{name}")
    does = "publishes" if silent_topic(case) else "logs"
    owner = "self." if source.is_method(dead[0]) else ""
    hint = f"nothing calls {name}, which {does}: create a timer that does, create_timer(..., {owner}{name})"
    return Clue(hint, source.place(dead[0]), key=f"dead:{name}")


def _may_be_unused(source: Source, function: Function) -> bool:
    """Return whether a function is none that Python, ROS or a base class calls by its name."""
    owner = source.class_of(function)
    plain = owner is None or all(last_name(b) in ("Node", "object") for b in owner.bases)
    return plain and not function.name.startswith("__") and function.name != "main" and not function.decorator_list


def _late_timer(case: Case) -> Clue | None:
    """The timer's period is longer than anybody waits."""
    found = _needed_calls(case)
    if found is None:
        return None
    source, calls = found
    for item in made(source, "timer"):
        worth = constant(source, item.period)
        inside = set(reached(source, roots(source, item.callback)))
        if worth is not None and worth.value > seconds(case.trace.stop_ns) - 1 and any(c in inside for c in calls):
            hint = f"{timer_code(source, item)} waits {worth.value:g} s before the first call: the period is in seconds"
            return Clue(hint, source.place(worth.origin), key=f"period:{item.call.lineno}")
    return None


def timer_code(source: Source, item: Made) -> str:
    """Return how a timer is made, in short."""
    period = source.code(item.period, 40) if item.period is not None else "?"
    callback = source.code(item.callback, 40) if item.callback is not None else "?"
    return f"create_timer({period}, {callback})"


def _nested_spin(case: Case) -> Clue | None:
    """The node is spun where it can never come back: in its constructor, or inside a callback."""
    stopped = isinstance(case.criterion.check, TopicRate) and case.evidence("window") == 1
    found = _needed_calls(case)
    source = found[0] if found is not None else case.source
    if source is None or case.fault is not None or not (stopped or found is not None):
        return None
    for call in source.calls("spin", "spin_until_future_complete"):
        function = source.function_of(call)
        if function is None or not source.is_method(function):
            continue
        code = source.code(call)
        if function.name == "__init__":
            hint = f"{code} in the constructor does not return: what stands after it is never reached"
            return Clue(hint, source.place(call), key="nested_spin")
        callbacks = [m for kind in ("timer", "subscription") for m in made(source, kind)]
        if any(call in set(reached(source, roots(source, m.callback))) for m in callbacks):
            hint = f"{code} inside a callback waits for something that can only come after the callback has returned"
            return Clue(hint, source.place(call), key="nested_spin")
    return None


def _stopped_listening(case: Case) -> Clue | None:
    """The subscription asks for a deadline that nobody promises, or is destroyed before the data come."""
    if not isinstance(case.criterion.check, LogsPosition) or case.evidence("right") != 0 or case.source is None:
        return None
    source = case.source
    for item in made(source, "subscription"):
        name = source.code(item.qos) if isinstance(item.qos, (ast.Name, ast.Attribute)) else ""
        policies = [k for k in source.all(ast.keyword) if k.arg in ("deadline", "liveliness_lease_duration")]
        near = [k for k in policies if covers(item.call, k.lineno) or name]
        if len(near) == 1 and case.fault is None:
            hint = f"with {source.code(near[0], 50)} it hears only publishers that promise the same: leave it out"
            return Clue(hint, source.place(near[0]))
    ends = next(source.calls("destroy_subscription"), None)
    if ends is None or case.fault is not None:
        return None
    return Clue(f"after {source.code(ends)} no message can come any more: keep listening", source.place(ends))


def _no_number_heard(case: Case) -> Clue | None:
    """A subscription whose type carries no number."""
    check = case.criterion.check
    if not isinstance(check, LogsReceived) or case.source is None or case.fault is not None:
        return None
    types = {e.type for e in student_endpoints(case.trace, "subscription") if e.topic == check.topic}
    item = made_for(case.source, "subscription", check.topic)
    if item is None or len(types) != 1 or carries_number(next(iter(types))):
        return None
    hint = f"{short(next(iter(types)))} carries no number: use a numeric type such as Float32 in both files"
    return Clue(hint, case.source.place(item.call), key=f"apart:{check.topic}")


def _only_when_told(case: Case) -> Clue | None:
    """Everything is published from the callback of a topic that nobody publishes."""
    found = _needed_calls(case)
    if found is None or not found[1]:
        return None
    source, calls = found
    for item in made(source, "subscription"):
        inside = set(reached(source, roots(source, item.callback)))
        if item.topic is None or not all(c in inside for c in calls):
            continue
        timed = [n for t in made(source, "timer") for n in reached(source, roots(source, t.callback))]
        heard = case.trace.deliveries(f"/{item.topic.strip('/')}")
        own = case.trace.messages(f"/{item.topic.strip('/')}")
        if not heard and not own and not any(c in timed for c in calls) and case.verdict.outcome is Outcome.NOT_MET:
            hint = f"this runs only when a message comes on {quote(item.topic, 60)}, and none does: use a timer"
            return Clue(hint, source.place(item.call), key=f"told:{item.call.lineno}")
    return None


def _no_subscription(case: Case) -> Clue | None:
    """One direction of two is not written at all."""
    check = case.criterion.check
    topic = unheard_topic(case)
    if isinstance(check, BidirectionalGraph):
        topic = next((t for t in (check.back, check.forward) if t in case.topics), "")
        there = [e for e in student_endpoints(case.trace, "subscription") if e.topic == topic]
        topic = "" if there else topic
    source = listener(case, topic) if topic else None
    if source is None or case.fault is not None or not source.nodes:
        return None
    if made(source, "subscription") or "Subscriber" in {last_name(n) for n in source.names()}:
        return None
    node = next((c for c in source.all(ast.ClassDef) if any(last_name(b) == "Node" for b in c.bases)), None)
    if node is None or any(chain(n).startswith("super().create") for n in source.all(ast.Attribute)):
        return None
    hint = f"{source.file} subscribes to nothing: add self.create_subscription(..., '{topic}', self.callback, 10)"
    return Clue(hint, source.place(node), key=f"unheard:{topic}")


def _graph_topic(case: Case) -> Clue | None:
    """A direction is missing from the graph because its topic has another name in one file."""
    check = case.criterion.check
    if not isinstance(check, BidirectionalGraph) or case.fault is not None:
        return None
    for topic in (check.forward, check.back):
        for kind, finder in (("publisher", speaker), ("subscription", listener)):
            source = finder(case, topic)
            ends = student_endpoints(case.trace, kind)
            if source is None or topic not in case.topics or any(e.topic == topic for e in ends):
                continue
            items = made(source, kind)
            found = [e.topic for e in ends if items and _same_made(made_for(source, kind, e.topic), items[0])]
            if len(items) == 1 and len(found) == 1:
                return _elsewhere(source, items[0], found[0], topic)
    return None


def _same_made(one: Made | None, other: Made) -> bool:
    return one is not None and one.call is other.call


SILENCE = (
    Cause("wrong_topic", _wrong_topic),
    Cause("wrong_type", _wrong_type),
    Cause("latched_subscription", _latched_subscription),
    Cause("kept_apart", _kept_apart),
    Cause("graph_topic", _graph_topic),
    Cause("no_subscription", _no_subscription),
    Cause("never_publishes", _never_publishes),
    Cause("not_spun", _not_spun),
    Cause("no_number_heard", _no_number_heard),
    Cause("nested_spin", _nested_spin),
    Cause("stopped_listening", _stopped_listening),
    Cause("waits_for_service", _waits_for_service),
    Cause("unwoken_rate", _unwoken_rate),
    Cause("held_up", _held_up),
    Cause("never_called", _never_called),
    Cause("late_timer", _late_timer),
    Cause("only_when_told", _only_when_told),
)
