"""Why a topic stayed silent: what the student's nodes did instead, the nearest thing first."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable

from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_S
from grader.core.trace import Endpoint, Fault, FaultKind, Message, Trace
from grader.judging.findings import not_met
from grader.judging.wording import counted, fault_sentence, listed, nearest, quote, span

#: Topics that every node has.
_HIDDEN_TOPICS = frozenset({"/rosout", "/parameter_events", "/clock"})
_URGENCY = {
    FaultKind.SYNTAX_ERROR: 0,
    FaultKind.EXCEPTION: 1,
    FaultKind.HUNG: 2,
    FaultKind.KILLED: 3,
    FaultKind.EXITED: 4,
}
_SPIN_HINT = "a node lives as long as it spins: call rclpy.spin(node) at the end of main()"
_RUN_ON_HINT = "keep the node running: it must not end before it is stopped"
#: An exit up to here is one of a node that never waited for anything.
AT_ONCE_NS = NS_PER_S


def first_fault(trace: Trace, process: str | None = None) -> Fault | None:
    """Return the fault that came first; of one instant the one that says most. What follows Ctrl-C is none here."""
    # a recording that a fault cut short stops at the instant of the fault
    found = [f for f in faults_before_stop(trace, process) if f.t_ns <= trace.stop_ns]
    return min(found, key=lambda f: (f.t_ns, _URGENCY[f.kind]), default=None)


def faults_before_stop(trace: Trace, process: str | None = None) -> list[Fault]:
    """Return the faults of processes that had not been told to stop by then."""
    told = {m.detail: m.t_ns for m in reversed(trace.marks("stop_signal"))}
    return [f for f in trace.faults(process) if f.process not in told or f.t_ns < told[f.process]]


def fault_hint(fault: Fault) -> str:
    """Return what to do about a fault where that is plain; empty otherwise."""
    if fault.exit_code != 0:
        return ""
    return _SPIN_HINT if fault.t_ns < AT_ONCE_NS else _RUN_ON_HINT


def student_endpoints(trace: Trace, kind: str | None = None) -> tuple[Endpoint, ...]:
    """Return the endpoints of student nodes on topics that a student makes, each once, in order of appearance."""
    kinds = (kind,) if kind else ("publisher", "subscription")
    return tuple(e for k in kinds for e in trace.endpoints(k) if on_student_topic(e))


def on_student_topic(endpoint: Endpoint) -> bool:
    """Return whether an endpoint is a student's own, and not one that every node has."""
    return endpoint.participant != -1 and endpoint.topic not in _HIDDEN_TOPICS


def heard_from_ns(trace: Trace, topic: str) -> int:
    """Return when the first subscription to a topic was there; 0 if that is not known."""
    for graph in trace.graphs():
        if any(e.kind == "subscription" and e.topic == topic and on_student_topic(e) for e in graph.endpoints):
            return graph.t_ns
    return 0


def explain_no_message(trace: Trace, topic: str, type_: str | None = None) -> Finding:
    """Return no credit and why there is no message on `topic`, of `type_` if one is asked for."""
    messages = [m for m in trace.messages() if m.t_ns < trace.stop_ns and m.topic not in _HIDDEN_TOPICS]
    return (
        _other_type(messages, topic, type_)
        or _other_topic(messages, topic, type_)
        or _faulted(trace, f"no message on {topic}")
        or _silent_publisher(trace, topic, type_)
        or _nothing(trace, topic, "publisher")
    )


def explain_no_subscription(trace: Trace, topic: str, type_: str | None = None) -> Finding:
    """Return no credit and why nothing subscribes to `topic`, with `type_` if one is asked for."""
    endpoints = student_endpoints(trace, "subscription")
    return (
        _subscribed_other_type(endpoints, topic, type_)
        or _subscribed_elsewhere(endpoints, topic, type_)
        or _faulted(trace, f"no subscription to {topic}")
        or _nothing(trace, topic, "subscription")
    )


def _other_type(messages: list[Message], topic: str, type_: str | None) -> Finding | None:
    types = Counter(m.type for m in messages if m.topic == topic and m.type != type_)
    if type_ is None or not types:
        return None
    found, count = types.most_common(1)[0]
    reason = f"{topic}: {counted(count, 'message')} of type {quote(found)}, expected {type_}"
    return not_met(reason, {"topic": topic, "type": found, "messages": count}, hint=f"publish {type_} on {topic}")


def _other_topic(messages: list[Message], topic: str, type_: str | None) -> Finding | None:
    counts = Counter((m.topic, m.type) for m in messages if m.topic != topic)
    same_type = [t for t, kind in counts if type_ is not None and kind == type_]
    found = nearest(topic, same_type) or next(iter(same_type), None) or nearest(topic, [t for t, _ in counts])
    if found is None:
        return None
    kind, count = next((k, n) for (t, k), n in counts.items() if t == found and (t not in same_type or k == type_))
    reason = f"{topic}: no message; {quote(found)} has {counted(count, 'message')} of type {quote(kind)}"
    reason += "" if type_ in (None, kind) else f", expected {type_}"
    hint = f"publish on {topic} instead of {quote(found)}"
    return not_met(reason, {"topic": found, "type": kind, "messages": count}, hint=hint)


def _faulted(trace: Trace, consequence: str) -> Finding | None:
    fault = first_fault(trace)
    if fault is None:
        return None
    return not_met(f"{fault_sentence(fault)}; {consequence}", hint=fault_hint(fault), fault=fault)


def _silent_publisher(trace: Trace, topic: str, type_: str | None) -> Finding | None:
    endpoints = student_endpoints(trace, "publisher")
    near = nearest(topic, [e.topic for e in endpoints])
    on_topic = [e for e in endpoints if e.topic == topic] or [e for e in endpoints if e.topic == near]
    if not on_topic:
        return None
    found = next((e for e in on_topic if e.type == type_), on_topic[0])
    reason = f"{quote(found.topic)}: no message in {span(trace.stop_ns)}, though {quote(found.node)} has a publisher"
    reason += f" of type {quote(found.type)}"
    wrong = found.topic != topic or (type_ is not None and found.type != type_)
    reason += f"; expected {type_ + ' on ' if type_ else ''}{topic}" if wrong else ""
    hint = "publish from a timer that runs from the start, and spin the node"
    return not_met(reason, {"topic": found.topic, "type": found.type, "messages": 0}, hint=hint)


def _nothing(trace: Trace, topic: str, kind: str) -> Finding:
    others = dict.fromkeys(f"{e.topic} [{e.type}]" for e in student_endpoints(trace, kind))
    reason = f"{topic}: no {kind} in {span(trace.stop_ns)}"
    reason += f"; {kind}s seen: {listed(list(others))}" if others else ""
    return not_met(reason, {"topic": topic, "seen": list(others)[:20]})


def _subscribed_other_type(endpoints: Iterable[Endpoint], topic: str, type_: str | None) -> Finding | None:
    found = next((e for e in endpoints if e.topic == topic and e.type != type_), None)
    if type_ is None or found is None:
        return None
    reason = f"{topic}: {quote(found.node)} subscribes with type {quote(found.type)}, expected {type_}"
    evidence = {"topic": topic, "type": found.type, "node": found.node}
    return not_met(reason, evidence, hint=f"subscribe to {topic} with {type_}")


def _subscribed_elsewhere(endpoints: Iterable[Endpoint], topic: str, type_: str | None) -> Finding | None:
    others = [e for e in endpoints if e.topic != topic]
    same_type = [e.topic for e in others if e.type == type_]
    name = nearest(topic, same_type) or next(iter(same_type), None) or nearest(topic, [e.topic for e in others])
    found = next((e for e in others if e.topic == name), None)
    if found is None:
        return None
    reason = f"{topic}: no subscription; {quote(found.node)} subscribes to {quote(found.topic)} [{quote(found.type)}]"
    evidence = {"topic": found.topic, "type": found.type, "node": found.node}
    return not_met(reason, evidence, hint=f"subscribe to {topic} instead of {quote(found.topic)}")
