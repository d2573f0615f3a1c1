"""The hint rules for what does not pass between a node and the grader: they are asked before all others.

Other rules take it as heard. Those about a robot that hears its node, and does not move as the node meant, come last.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator
from itertools import pairwise

from grader.grading.judging.diagnosis.rules import (
    Case,
    Clue,
    asked_topics,
    file_for,
    heard_topics,
    hint_rule,
    is_told,
    silent_topic,
    unheard_topic,
)
from grader.grading.judging.diagnosis.wiring import (
    Made,
    given_leaf,
    goes_to,
    has_threads,
    made,
    made_for,
    number_in_code,
    pauses,
    publish_calls,
    runs,
    short,
    text_origin,
)
from grader.grading.judging.simulations import NotHeard, heard_by_simulations, not_heard
from grader.grading.judging.source import Source, argument, chain, first_line
from grader.grading.judging.values import number_at, student_endpoints
from grader.grading.model.wording import nearest, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import Delivery


@hint_rule(priority=10)
def _unheard_by_simulation(case: Case) -> Clue | None:
    """A publisher has another type or topic than the simulation hears."""
    found = next((one for one in not_heard(case.trace) if _may_explain(one, case)), None)
    if found is None:
        return None
    end = found.end
    source = file_for(case, "publisher", end.topic)
    made = made_for(source, "publisher", end.topic, end.type)
    place = source.place(made.call) if made is not None else None
    wanted = f"publish {' or '.join(found.types)}" if end.topic == found.topic else f"publish on {found.topic}"
    return Clue(f"{found.sentence}: {wanted}", place, key=f"unheard:{found.topic}")


def _may_explain(found: NotHeard, case: Case) -> bool:
    """Return whether a criterion is about the commands, or about what the simulation makes of them."""
    if case.logs:
        return False
    topics, heard = asked_topics(case), heard_topics(case)
    if topics & {found.topic, found.end.topic}:
        return True
    return any(case.trace.deliveries(topic) for topic in topics & heard)


@hint_rule(priority=20)
def _hears_nobody(case: Case) -> Clue | None:
    """A node subscribes to a topic on which nobody publishes, and not to one of the grader's with the same type."""
    silent = silent_topic(case)
    if case.logs or unheard_topic(case) or not (silent or is_told(case)):
        return None
    for deaf in _deaf(case):
        calls = publish_calls(deaf.source)
        if not silent or (calls and {*calls} <= {*runs(deaf.source, deaf.item)}):
            origin = text_origin(deaf.source, argument(deaf.item.call, 1, "topic"), deaf.item.call)
            hint = f"{deaf.source.code(deaf.item.call)} hears nobody"
            hint = f"{hint}: {short(deaf.item.type)} is published on {deaf.topic}, subscribe to that"
            return Clue(hint, deaf.source.place(origin), key=f"topic:{deaf.source.file}:{deaf.item.call.lineno}")
    return None


@dataclass(frozen=True, slots=True)
class _DeafItem:
    """A subscription that hears nobody, and the topic of the grader's that was probably meant."""

    source: Source
    item: Made
    topic: str


def _deaf(case: Case) -> Iterator[_DeafItem]:
    trace = case.trace
    offered = {d.topic: d.type for d in trace.of(Delivery)}
    ends = student_endpoints(trace, "subscription")
    published = {*offered, *(e.topic for e in student_endpoints(trace, "publisher") if trace.messages(e.topic))}
    unheard = {topic: type_ for topic, type_ in offered.items() if all(e.topic != topic for e in ends)}
    for end in ends:
        if end.topic in published:
            continue
        meant = [topic for topic, type_ in unheard.items() if type_ == end.type and not topic.startswith(_TRUTH)]
        topic = meant[0] if len(meant) == 1 else nearest(end.topic, meant)
        source = file_for(case, "subscription", end.topic)
        item = made_for(source, "subscription", end.topic, short(end.type))
        if topic and item is not None and goes_to(item.topic, end.topic):
            yield _DeafItem(source, item, topic)


#: Where a simulation that comes with the grader tells checks what no node should know.
_TRUTH = "/truth/"


#: The field by which a robot on wheels drives or turns, and those beside it.
_BESIDE = {"angular.z": ("angular.x", "angular.y"), "linear.x": ("linear.y", "linear.z")}
_TWISTS = {"geometry_msgs/msg/Twist": "", "geometry_msgs/msg/TwistStamped": "twist."}


@hint_rule(priority=8300)
def _beside_the_wheels(case: Case) -> Clue | None:
    """The commands turn around another axis, or go to another side, and never set the field that a robot obeys."""
    if not is_told(case):
        return None
    for topic in heard_by_simulations(case.trace):
        messages = [m for m in case.trace.messages(topic) if m.type in _TWISTS]
        for right, others in _BESIDE.items():
            used = {f for f in (right, *others) if any(number_at(m.value, _TWISTS[m.type] + f) for m in messages)}
            if right in used or len(used) != 1:
                continue
            (wrong,) = used
            source = file_for(case, "publisher", topic)
            given = [n for n in given_leaf(source, wrong[-1]) if _is_field(n, wrong)]
            if given:
                does = "turns" if right == "angular.z" else "drives"
                hint = f"{source.code(given[0], 50)}: a robot on wheels {does} by {right}, which is always 0"
                return Clue(f"{hint}: set {right}", source.place(given[0]), key=f"beside:{right}")
    return None


def _is_field(node: ast.AST, path: str) -> bool:
    return isinstance(node, ast.Assign) and any(chain(target).endswith(f".{path}") for target in node.targets)


@hint_rule(priority=8310)
def _robot_waits(case: Case) -> Clue | None:
    """A callback sleeps for longer than it takes until the next message, while the robot goes on."""
    if not (is_told(case) or silent_topic(case)):
        return None
    for source in case.sources.values():
        if has_threads(source):
            continue
        for pause in pauses(source):
            periods = [_period_s(case, m) for m in made(source, "subscription") if pause.call in runs(source, m)]
            periods += [number_in_code(source, m.period) or 0.0 for m in made(source, "timer")]
            if pause.seconds is not None and any(0 < period < pause.seconds for period in periods):
                code = source.code(pause.call, 50)
                hint = f"{code} holds up every callback for {number(pause.seconds)} s, and the robot keeps its last "
                hint += "speed meanwhile: remove it"
                return Clue(hint, source.place(pause.call), key=f"sleeps:{first_line(pause.call)}")
    return None


def _period_s(case: Case, item: Made) -> float:
    """Return the usual time between the grader's messages on the topic of a subscription; 0 if there are too few."""
    times = [d.t_ns for d in case.trace.deliveries(f"/{quote(item.topic or '').strip('/')}")]
    gaps = sorted(b - a for a, b in pairwise(times))
    return seconds(gaps[len(gaps) // 2]) if gaps else 0.0
