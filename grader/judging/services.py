"""Service calls paired up, and why there are none: what the student's nodes offered or asked for instead."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from grader.core.exercise import Finding
from grader.core.quantities import NS_PER_MS
from grader.core.trace import ClockKind, Request, Response, ServiceEnd, Trace
from grader.judging.findings import not_met
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import fault_sentence, listed, nearest, quote, span

#: How much later than asked something may come where the machine's load shows.
LATENESS_NS = {ClockKind.VIRTUAL: NS_PER_MS, ClockKind.WALL: 250 * NS_PER_MS}
_SERVER, _CLIENT = "service", "client"
_WORDS = {_SERVER: ("server", "offers", "offer"), _CLIENT: ("client", "asks", "ask")}


@dataclass(frozen=True, slots=True)
class Call:
    """One call of a service; without a response if none came."""

    request: Request
    response: Response | None


def calls_of(trace: Trace, service: str, asker: str) -> tuple[Call, ...]:
    """Return the calls of a service by `grader` or `student` in the order asked, each with its response."""
    answerer = "grader" if asker == "student" else "student"
    responses: dict[int, Response] = {}
    for response in trace.responses(service, answerer):
        if response.t_ns < trace.stop_ns:
            responses.setdefault(response.number, response)
    asked = [r for r in trace.requests(service, asker) if r.t_ns < trace.stop_ns]
    return tuple(Call(r, responses.get(r.number)) for r in asked)


def explain_no_server(trace: Trace, service: str, type_: str | None = None) -> Finding:
    """Return no credit and why no student's node answers on `service`, with `type_` if one is asked for."""
    return _explain(trace, _SERVER, service, type_)


def explain_no_client(trace: Trace, service: str, type_: str | None = None) -> Finding:
    """Return no credit and why no student's node asks on `service`, with `type_` if one is asked for."""
    return _explain(trace, _CLIENT, service, type_)


def _explain(trace: Trace, kind: str, service: str, type_: str | None) -> Finding:
    ends = trace.service_ends(kind)
    return (
        _other_type(ends, service, type_)
        or _elsewhere(ends, service, type_)
        or _faulted(trace, kind, service)
        or _nothing(trace, ends, service)
    )


def _other_type(ends: Iterable[ServiceEnd], service: str, type_: str | None) -> Finding | None:
    found = next((e for e in ends if e.service == service and e.type != type_), None)
    if type_ is None or found is None:
        return None
    reason = f"{service}: {quote(found.node)} has a {_word(found)} of type {quote(found.type)}, expected {type_}"
    evidence = {"service": service, "type": found.type, "node": found.node}
    return not_met(reason, evidence, hint=f"create the {_word(found)} of {service} with {type_}")


def _elsewhere(ends: Iterable[ServiceEnd], service: str, type_: str | None) -> Finding | None:
    others = [e for e in ends if e.service != service]
    same_type = [e.service for e in others if e.type == type_]
    name = nearest(service, same_type) or next(iter(same_type), None) or nearest(service, [e.service for e in others])
    found = next((e for e in others if e.service == name), None)
    if found is None:
        return None
    reason = f"{service}: no {_word(found)}; {quote(found.node)} {_WORDS[found.kind][1]} {quote(found.service)} "
    reason += f"[{quote(found.type)}]"
    evidence = {"service": found.service, "type": found.type, "node": found.node}
    return not_met(reason, evidence, hint=f"{_WORDS[found.kind][2]} {service} instead of {quote(found.service)}")


def _faulted(trace: Trace, kind: str, service: str) -> Finding | None:
    fault = first_fault(trace)
    if fault is None:
        return None
    reason = f"{fault_sentence(fault)}; no {_WORDS[kind][0]} of {service}"
    return not_met(reason, hint=fault_hint(fault), fault=fault)


def _nothing(trace: Trace, ends: Iterable[ServiceEnd], service: str) -> Finding:
    seen = list(dict.fromkeys(f"{e.service} [{e.type}]" for e in ends))
    reason = f"{service}: not in the ROS graph in {span(trace.stop_ns)}"
    reason += f"; seen: {listed(seen)}" if seen else ""
    return not_met(reason, {"service": service, "seen": seen[:20]})


def _word(end: ServiceEnd) -> str:
    return _WORDS[end.kind][0]
