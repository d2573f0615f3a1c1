"""Makes findings: credit, the effects of a fault, and what nodes did instead of what is missing."""

from __future__ import annotations

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import replace
from fractions import Fraction

from grader.grading.judging.facts import OtherEnd
from grader.grading.judging.values import HIDDEN_TOPICS, student_endpoints
from grader.grading.model.exercise import Finding, Location, Problem, ProblemKind, exact_share
from grader.grading.model.measures import Measured
from grader.grading.model.wording import first_few, moment, nearest, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, counted, seconds
from grader.runtime.model.trace import BagContents, Endpoint, Fault, FaultKind, Message, ServiceEnd, Trace, UnmetPolicy

#: Evidence key for the fault that a finding rests on; judging an exercise counts each fault once.
FAULT_KEY = "fault"
HALF = Fraction(1, 2)
_URGENCY = {
    FaultKind.SYNTAX_ERROR: 0,
    FaultKind.EXCEPTION: 1,
    FaultKind.HUNG: 2,
    FaultKind.KILLED: 3,
    FaultKind.EXITED: 4,
}
_SPIN_HINT = "a node lives as long as it spins: call rclpy.spin(node) at the end of main()"
_RUN_ON_HINT = "keep the node running: it must not end before it is stopped"
#: What helps against a message that is sent before discovery.
SEND_LATER = "publish from a timer, or wait until get_subscription_count() of the publisher is not 0"
#: What to do in place of print.
LOGGER_HINT = "write through the node's logger: self.get_logger().info(...)"
#: A node that exits within this time never waited for anything.
AT_ONCE_NS = NS_PER_S


def met(reason: str, evidence: Mapping[str, object] | None = None, *, measured: Measured = ()) -> Finding:
    """Return a finding with full credit, unless a rubric gives a share of the points for what was measured."""
    return Finding(Fraction(1), reason, evidence or {}, measured=measured)


def partly(  # noqa: PLR0913  each is a field of the finding
    reason: str,
    evidence: Mapping[str, object] | None = None,
    *,
    credit: Fraction | float = HALF,
    hint: str = "",
    problem: Problem | ProblemKind | None = None,
    brief: str = "",
    facts: object = None,
    measured: Measured = (),
) -> Finding:
    """Return a finding with half credit, or with the given share of the points, from 0 to 1."""
    share, found = exact_share(credit), _as_problem(problem)
    return Finding(share, reason, evidence or {}, hint=hint, problem=found, brief=brief, facts=facts, measured=measured)


def only_printed(reason: str, evidence: Mapping[str, object] | None = None, hint: str = LOGGER_HINT) -> Finding:
    """Return half credit for what is right, but printed instead of logged."""
    return partly(reason, evidence, hint=hint, problem=ProblemKind.PRINTED)


def not_met(  # noqa: PLR0913  each is a field of the finding
    reason: str,
    evidence: Mapping[str, object] | None = None,
    *,
    hint: str = "",
    fault: Fault | None = None,
    blocked_by: str | None = None,
    problem: Problem | ProblemKind | None = None,
    brief: str = "",
    facts: object = None,
    measured: Measured = (),
) -> Finding:
    """Return a finding without credit, unless a rubric gives a share of the points for what was measured.

    Args:
        reason: What was found, what was expected.
        evidence: Plain JSON values behind it.
        hint: One thing to do.
        fault: The fault that explains it; it becomes the location and part of the evidence.
        blocked_by: The criterion that must be met first: its id, its check, or a topic whose logs it judges.
        problem: The problem, where a check tells several apart; a fault needs none.
        brief: The reason in a few words, if it is long; for a fault, its own text unless given.
        facts: A record for hint rules.
        measured: The numbers that were measured all the same, for a rubric with `full` and `none`.
    """
    known = dict(evidence or {})
    if fault is not None:
        known[FAULT_KEY] = fault_evidence(fault)
    location = fault_location(fault) if fault is not None else None
    found = _as_problem(problem)
    brief = brief or (_own_words(fault) if fault is not None else "")
    return Finding(Fraction(0), reason, known, location, hint, blocked_by, found, brief, facts, measured)


def _as_problem(problem: Problem | ProblemKind | None) -> Problem | None:
    return Problem(problem) if isinstance(problem, ProblemKind) else problem


def waiting_for(needed: str, finding: Finding) -> Finding:
    """Return a finding that waits for a criterion or check, without its location."""
    return replace(finding, credit=Fraction(0), location=None, blocked_by=needed, brief="")


def fault_location(fault: Fault) -> Location | None:
    """Return the student's own line at which a fault arose, if known."""
    return Location(fault.file, fault.line) if fault.file and fault.line > 0 else None


def fault_evidence(fault: Fault) -> dict[str, object]:
    """Return a fault as plain JSON values."""
    return {
        "process": fault.process,
        "kind": fault.kind.value,
        "exception": fault.exception,
        "text": fault.text,
        "file": fault.file,
        "line": fault.line,
        "t_s": seconds(fault.t_ns),
    }


def first_fault(trace: Trace, process: str | None = None) -> Fault | None:
    """Return the earliest fault, or the most informative one of its instant. Faults after Ctrl-C are ignored."""
    # a recording that a fault cut short ends at the instant of the fault
    found = [f for f in faults_before_stop(trace, process) if f.t_ns <= trace.stop_ns]
    return min(found, key=lambda f: (f.t_ns, _URGENCY[f.kind]), default=None)


def faults_before_stop(trace: Trace, process: str | None = None) -> list[Fault]:
    """Return the faults of processes that had not yet been told to stop."""
    told = {m.detail: m.t_ns for m in reversed(trace.marks("stop_signal"))}
    return [f for f in trace.faults(process) if f.process not in told or f.t_ns < told[f.process]]


def fault_hint(fault: Fault) -> str:
    """Return a hint about a fault if the remedy is clear; empty otherwise."""
    if fault.exit_code != 0:
        return ""
    return _SPIN_HINT if fault.t_ns < AT_ONCE_NS else _RUN_ON_HINT


def faulted(fault: Fault, effect: str, evidence: Mapping[str, object] | None = None, *, last: bool = False) -> Finding:
    """Return a finding without credit for the effect of a fault.

    Args:
        fault: The fault.
        effect: The effect, or what was found; empty if the fault says everything.
        evidence: Plain JSON values behind it.
        last: Whether the fault is named after `effect` instead of before.
    """
    clauses = (effect, fault_sentence(fault)) if last else (fault_sentence(fault), effect)
    return not_met("; ".join(filter(None, clauses)), evidence, hint=fault_hint(fault), fault=fault)


def explain_fault(
    trace: Trace,
    effect: str,
    evidence: Mapping[str, object] | None = None,
    *,
    process: str | None = None,
    last: bool = False,
) -> Finding | None:
    """Return a finding without credit for the effect of the first fault, of one process or any; None without one."""
    fault = first_fault(trace, process)
    return None if fault is None else faulted(fault, effect, evidence, last=last)


def observed(trace: Trace) -> str:
    """Return for how long the nodes were observed, and the limit that ended it, if one did."""
    limits = trace.marks("limit")
    return f"{span(trace.stop_ns)}{f' ({quote(limits[0].detail)})' if limits else ''}"


def fault_sentence(fault: Fault) -> str:
    """Return a fault as `file:line: text`, or as `file exited after 5.0 s with code 0`."""
    if fault.kind is FaultKind.EXITED:
        return f"{fault.process} {_own_words(fault)}"
    place = fault_place(fault)
    return f"{place}: {_own_words(fault)}"


def fault_place(fault: Fault) -> str:
    """Return where a fault arose, as `file:line`, or the process alone."""
    return f"{fault.file}:{fault.line}" if fault.file and fault.line > 0 else fault.process


def _own_words(fault: Fault) -> str:
    """Return what happened; the message of an exception is quoted if it could be mistaken for the grader's words."""
    if fault.exit_code is not None:  # a launch file that ended has none, and its text says how
        return f"exited after {span(fault.t_ns)} with code {fault.exit_code}"
    text = quote(fault.text)
    kind, colon, message = text.partition(": ")
    if fault.kind is not FaultKind.EXCEPTION or ";" not in text:
        return text
    plain = message.replace('"', "'")
    return f'{kind}: "{plain}"' if colon else text


@dataclass(frozen=True, slots=True)
class _Wording:
    """Phrases for a missing endpoint; `{name}` is the topic or service, `{type}` the expected type.

    Attributes:
        lacks: The endpoint is missing, after a fault.
        none: There is no such endpoint at all.
        instead: A node uses another name.
        typed: A node uses the right name with another type; followed by that type.
        name_hint: What to do about another name.
        type_hint: What to do about another type.
    """

    lacks: str
    none: str
    instead: str
    typed: str
    name_hint: str
    type_hint: str


def _of_service(end: str, does: str, to_do: str) -> _Wording:
    typed, type_hint = f"has a {end} of type", f"create the {end} of {{name}} with {{type}}"
    return _Wording(f"no {end} of {{name}}", f"no {end}", does, typed, f"{to_do} {{name}}", type_hint)


_WORDINGS = {
    "subscription": _Wording(
        "no subscription to {name}",
        "no subscription",
        "subscribes to",
        "subscribes with type",
        "subscribe to {name}",
        "subscribe to {name} with {type}",
    ),
    "service": _of_service("server", "offers", "offer"),
    "client": _of_service("client", "calls", "call"),
}


def explain_no_subscription(trace: Trace, topic: str, type_: str | None = None) -> Finding:
    """Return no credit with the reason why nothing subscribes to `topic`, with `type_` if given."""
    found = _explain(trace, "subscription", student_endpoints(trace, "subscription"), topic, type_)
    return found or _nothing(trace, topic, "subscription")


#: Which publishers do not offer a policy that a subscription requests.
_WITHOUT = {"durability": "a volatile publisher", "liveliness": "a publisher with automatic liveliness"}


def request_said(unmet: UnmetPolicy) -> str:
    """Return what a subscription requests and which publishers do not offer it, as a phrase."""
    return f"{unmet.requested}, which {_WITHOUT.get(unmet.policy, 'a publisher without one')} does not offer"


def explain_no_server(trace: Trace, service: str, type_: str | None = None) -> Finding:
    """Return no credit with the reason why no student's node is a server of `service`, with `type_` if given."""
    return _explain_service(trace, "service", service, type_)


def explain_no_client(trace: Trace, service: str, type_: str | None = None) -> Finding:
    """Return no credit with the reason why no student's node is a client of `service`, with `type_` if given."""
    return _explain_service(trace, "client", service, type_)


def _explain_service(trace: Trace, kind: str, service: str, type_: str | None) -> Finding:
    ends = trace.service_ends(kind)
    mine = [e for e in ends if e.service == service and type_ in (None, e.type)]
    if mine and (apart := unusual_ends(mine)) is not None:
        return apart
    found = _explain(trace, kind, ends, service, type_)
    if found is not None:
        return found
    if mine and kind == "client":
        client = f"{service} [{quote(mine[0].type)}]: the client of {quote(mine[0].node)}"
        reason = f"{client} sends no request in {observed(trace)}"
        return not_met(reason, {"service": service, "node": mine[0].node}, problem=ProblemKind.SILENT)
    seen = list(dict.fromkeys(f"{e.service} [{e.type}]" for e in ends))
    reason = f"{service}: not in the ROS graph in {observed(trace)}{f'; seen: {first_few(seen)}' if seen else ''}"
    return not_met(reason, {"service": service, "seen": seen[:20]}, problem=ProblemKind.ABSENT)


def unusual_ends(ends: Sequence[ServiceEnd]) -> Finding | None:
    """Return why no end with the default QoS can communicate with those of a service; None if it can with one."""
    if not all(end.unusual for end in ends):
        return None
    word, other = ("server", "client") if ends[0].kind == "service" else ("client", "server")
    reason = f"{ends[0].service}: the {word} of {quote(ends[0].node)} has {ends[0].unusual}, which a {other} with the "
    reason += "default QoS does not match: no call arrives"
    evidence = {"service": ends[0].service, "node": ends[0].node}
    hint = f"create the {word} without qos_profile"
    return not_met(reason, evidence, hint=hint, problem=ProblemKind.KEPT_APART)


def _explain(
    trace: Trace, kind: str, ends: Sequence[Endpoint] | Sequence[ServiceEnd], name: str, type_: str | None
) -> Finding | None:
    """Return a finding about an endpoint of another type or name, or the first fault; None without either."""
    words, key = _WORDINGS[kind], "topic" if kind == "subscription" else "service"
    named = [(e, e.topic if isinstance(e, Endpoint) else e.service) for e in ends]
    typed = next((e for e, n in named if n == name and e.type != type_), None)
    if type_ is not None and typed is not None:
        reason = f"{name}: {quote(typed.node)} {words.typed} {quote(typed.type)}, expected {type_}"
        evidence = {key: name, "type": typed.type, "node": typed.node}
        hint = words.type_hint.format(name=name, type=type_)
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.OTHER_TYPE)
    others = {n: e for e, n in reversed(named) if n != name}
    other = _most_alike(name, [n for e, n in named if n != name and e.type == type_], list(others))
    if other is None:
        return explain_fault(trace, words.lacks.format(name=name))
    end = others[other]
    reason = f"{name}: {words.none}; {quote(end.node)} {words.instead} {quote(other)} [{quote(end.type)}]"
    evidence = {key: other, "type": end.type, "node": end.node}
    hint = f"{words.name_hint.format(name=name)} instead of {quote(other)}"
    return not_met(reason, evidence, hint=hint, problem=ProblemKind.OTHER_NAME, facts=OtherEnd(other, end.type))


def _most_alike(name: str, same_type: Sequence[str], others: Sequence[str]) -> str | None:
    """Return the name that was very likely meant, preferably one of the same type."""
    return nearest(name, same_type) or next(iter(same_type), None) or nearest(name, others)


def explain_no_message(trace: Trace, topic: str, type_: str | None = None) -> Finding:
    """Return no credit with the reason why there is no message that counts on `topic`, of `type_` if given."""
    messages = [m for m in trace.messages() if m.t_ns < trace.stop_ns and m.topic not in HIDDEN_TOPICS]
    if trace.bag is not None:
        return _other_type(messages, topic, type_) or _not_in_bag(trace.bag, topic, type_)
    return (
        _too_early(messages, topic, type_)
        or _other_type(messages, topic, type_)
        or _other_topic(messages, topic, type_)
        or explain_fault(trace, f"no message on {topic}")
        or _silent_publisher(trace, topic, type_)
        or _nothing(trace, topic, "publisher")
    )


def _not_in_bag(bag: BagContents, topic: str, type_: str | None) -> Finding:
    """Return no credit for a topic of which a recording that was handed in has no message."""
    held = {name: (kind, count) for name, kind, count in bag.topics if name not in HIDDEN_TOPICS}
    where, evidence = f"{topic}: no message in {quote(bag.file)}", {"topic": topic, "seen": list(held)[:20]}
    if topic in held:
        hint = "record while the node that publishes on it runs"
        return not_met(f"{where}, though it lists the topic", evidence, hint=hint, problem=ProblemKind.SILENT)
    same = [name for name, (kind, count) in held.items() if kind == type_ and count]
    other = _most_alike(topic, same, [name for name, (_, count) in held.items() if count])
    seen = first_few([f"{name} [{kind}]" for name, (kind, _) in held.items()]) if held else "no topics"
    reason = f"{where}, which holds {seen}"
    hint = f"record it with `ros2 bag record {topic}`"
    if other is not None:
        hint = f"publish on {topic} instead of {quote(other)}, and record it"
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.OTHER_NAME)
    return not_met(reason, evidence, hint=hint, problem=ProblemKind.ABSENT)


def _too_early(messages: list[Message], topic: str, type_: str | None) -> Finding | None:
    """Return the reason why messages do not count that were sent before discovery; None if there are none."""
    early = [m for m in messages if m.topic == topic and m.before_discovery and type_ in (None, m.type)]
    if not early:
        return None
    some = "the only message was" if len(early) == 1 else f"all {len(early)} messages were"
    reason = f"{moment(early[0].t_ns)}, {topic}: {some} sent as soon as the publisher was created"
    evidence = {"topic": topic, "type": early[0].type, "messages": 0, "before_discovery": len(early)}
    reason += ", before any subscription could discover it"
    return not_met(reason, evidence, hint=SEND_LATER, problem=ProblemKind.TOO_EARLY)


def _other_type(messages: list[Message], topic: str, type_: str | None) -> Finding | None:
    types = Counter(m.type for m in messages if m.topic == topic and m.type != type_)
    if type_ is None or not types:
        return None
    found, count = types.most_common(1)[0]
    reason = f"{topic}: {counted(count, 'message')} of type {quote(found)}, expected {type_}"
    evidence = {"topic": topic, "type": found, "messages": count}
    return not_met(reason, evidence, hint=f"publish {type_} on {topic}", problem=ProblemKind.OTHER_TYPE)


def _other_topic(messages: list[Message], topic: str, type_: str | None) -> Finding | None:
    counts = Counter((m.topic, m.type) for m in messages if m.topic != topic)
    same_type = [t for t, kind in counts if type_ is not None and kind == type_]
    found = _most_alike(topic, same_type, [t for t, _ in counts])
    if found is None:
        return None
    kind, count = next((k, n) for (t, k), n in counts.items() if t == found and (t not in same_type or k == type_))
    reason = f"{topic}: no message; {quote(found)} has {counted(count, 'message')} of type {quote(kind)}"
    reason += "" if type_ in (None, kind) else f", expected {type_}"
    hint = f"publish on {topic} instead of {quote(found)}"
    return not_met(reason, {"topic": found, "type": kind, "messages": count}, hint=hint, problem=ProblemKind.OTHER_NAME)


def _silent_publisher(trace: Trace, topic: str, type_: str | None) -> Finding | None:
    endpoints = student_endpoints(trace, "publisher")
    near = nearest(topic, [e.topic for e in endpoints])
    on_topic = [e for e in endpoints if e.topic == topic] or [e for e in endpoints if e.topic == near]
    if not on_topic:
        return None
    found = next((e for e in on_topic if e.type == type_), on_topic[0])
    reason = f"{quote(found.topic)}: no message in {observed(trace)}, though {quote(found.node)} has a publisher"
    reason += f" of type {quote(found.type)}"
    wrong = found.topic != topic or (type_ is not None and found.type != type_)
    reason += f"; expected {type_ + ' on ' if type_ else ''}{topic}" if wrong else ""
    # a node that hears something spins, and may publish what it hears: then the rubric knows better what to do
    hears = any(trace.deliveries(end.topic) for end in student_endpoints(trace, "subscription"))
    hint = limit_hint(trace) or ("" if hears else "publish from a timer that runs from the start, and spin the node")
    return not_met(
        reason, {"topic": found.topic, "type": found.type, "messages": 0}, hint=hint, problem=ProblemKind.SILENT
    )


def _nothing(trace: Trace, topic: str, kind: str) -> Finding:
    others = dict.fromkeys(f"{e.topic} [{e.type}]" for e in student_endpoints(trace, kind))
    reason = f"{topic}: no {kind} in {observed(trace)}"
    reason += f"; {kind}s seen: {first_few(list(others))}" if others else ""
    evidence = {"topic": topic, "seen": list(others)[:20]}
    return not_met(reason, evidence, hint=limit_hint(trace), problem=ProblemKind.ABSENT)


def limit_hint(trace: Trace) -> str:
    """Return the hint for what is missing in a recording that a limit ended; empty if none did."""
    return "stay below the limit: what comes after it is not recorded" if trace.marks("limit") else ""
