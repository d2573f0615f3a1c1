"""Words what happened in a stepped run: why a program failed, what came meanwhile, and what does not fit together."""

from __future__ import annotations

import linecache
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path

from grader.grading.judging.findings import explain_no_message, explain_no_server, explain_no_subscription, not_met
from grader.grading.model.exercise import Finding
from grader.grading.model.wording import listed, moment, nearest, quote, span
from grader.runtime.model.trace import (
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Trace,
    unmet_policy,
)
from grader.world.errors import NoMessage, StepTimeout
from grader.world.programs import Program

#: How many lines of logs and output a message shows, and how many characters of a line.
MOST_LINES, LINE_CHARACTERS = 8, 160
#: Services that every node has, for parameters.
OF_EVERY_NODE = ("set_parameters", "set_parameters_atomically", "get_parameters", "list_parameters")
_HAPPENED = {
    FaultKind.SYNTAX_ERROR: "could not be compiled",
    FaultKind.EXCEPTION: "raised an exception",
    FaultKind.HUNG: "was stopped",
    FaultKind.KILLED: "was ended",
    FaultKind.EXITED: "ended",
}


def failure(program: Program, fault: Fault) -> str:
    """Return what happened to a program, with a traceback in the form of Python's."""
    lines = [f"{program.name} {_HAPPENED[fault.kind]} at {moment(fault.t_ns)}"]
    if fault.frames:
        lines.append("Traceback (most recent call last):")
    for frame in fault.frames:
        place, _, function = frame.partition(" in ")
        file, _, line = place.rpartition(":")
        path = program.root / file
        lines.append(f'  File "{path}", line {line}, in {function}')
        lines += _source(path, int(line))
    if not fault.frames and fault.file:
        path = program.root / fault.file
        lines.append(f'  File "{path}", line {fault.line}')
        lines += _source(path, fault.line)
    return "\n".join([*lines, fault.text])


def _source(path: Path, line: int) -> list[str]:
    text = linecache.getline(str(path), line).strip()
    return [f"    {text}"] if text else []


def silence(trace: Trace, topic: str) -> NoMessage:
    """Return an error that says why no message came on a topic, with what to do about it if that is known."""
    found = explain_no_message(trace, topic, None)
    return NoMessage(found.reason, found.hint)


def no_server(trace: Trace, service: str, type_: str) -> str:
    """Return why nobody offers a service; of one that every node has, whether there is the node."""
    node, _, name = service.rpartition("/")
    nodes = _graph_of(trace).nodes
    if name in OF_EVERY_NODE and node not in nodes:
        close = nearest(node, nodes)
        return f"there is no node {node}" + (f"\n  hint: did you mean {close}?" if close else "")
    return _worded(explain_no_server(trace, service, type_))


def _worded(finding: Finding) -> str:
    return f"{finding.reason}\n  hint: {finding.hint}" if finding.hint else finding.reason


def unheard(trace: Trace, offers: Iterable[Endpoint]) -> Iterator[str]:
    """Yield why messages of the test do not arrive: another name, another type, or QoS that does not fit.

    Args:
        trace: The run so far.
        offers: The publishers of the test.
    """
    yield from map(_worded, _unheard(trace, offers))


def advice(trace: Trace, offers: Iterable[Endpoint]) -> str:
    """Return one thing to do about messages of the test that do not arrive; empty if all do, or nothing is known."""
    return next((found.hint for found in _unheard(trace, offers) if found.hint), "")


def _unheard(trace: Trace, offers: Iterable[Endpoint]) -> Iterator[Finding]:
    graph = _graph_of(trace)
    for offer in offers:
        same = [e for e in graph.endpoints if (e.kind, e.topic) == ("subscription", offer.topic)]
        fitting = [e for e in same if e.type == offer.type]
        if not fitting:
            yield explain_no_subscription(trace, offer.topic, offer.type)
            continue
        for end in fitting:
            if (unmet := unmet_policy(offer, end)) is not None:
                offered, wanted = unmet
                what = f"{end.node} asks for {wanted}, the test offers {offered}: no message arrives"
                yield not_met(f"{offer.topic}: {what}", hint=f"subscribe to {offer.topic} with {offered}")


def _graph_of(trace: Trace) -> GraphSnapshot:
    return (trace.graphs() or (GraphSnapshot(0, (), ()),))[-1]


def apart(graph: GraphSnapshot) -> Iterator[str]:
    """Yield the programs' own publishers and subscriptions that do not find each other although they share a topic."""
    publishers = [e for e in graph.endpoints if e.kind == "publisher"]
    for reader in (e for e in graph.endpoints if e.kind == "subscription"):
        for writer in (e for e in publishers if e.topic == reader.topic):
            if writer.type != reader.type:
                yield f"{reader.topic}: {writer.node} publishes {writer.type}, {reader.node} expects {reader.type}"
            elif (unmet := unmet_policy(writer, reader)) is not None:
                offered, wanted = unmet
                yield f"{reader.topic}: {reader.node} asks for {wanted}, {writer.node} offers {offered}"


def waiting(graph: GraphSnapshot, offered: Iterable[str], served: Iterable[str]) -> Iterator[str]:
    """Yield who waits for what: subscriptions without a publisher, and clients without a server.

    Args:
        graph: The graph now.
        offered: The topics that the test publishes on.
        served: The services that the test offers.
    """
    written = {e.topic for e in graph.endpoints if e.kind == "publisher"} | {*offered}
    silent = [e for e in graph.endpoints if e.kind == "subscription" and e.topic not in written]
    for topic, nodes in _by_name((e.topic, e.node) for e in silent):
        yield f"{nodes} listens to {topic}, where nobody publishes"
    servers = {e.service for e in graph.services if e.kind == "service"} | {*served}
    alone = [e for e in graph.services if e.kind == "client" and e.service not in servers]
    for service, nodes in _by_name((e.service, e.node) for e in alone):
        yield f"{nodes} has a client of {service}, which nobody offers"


def _by_name(pairs: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    found: dict[str, list[str]] = {}
    for name, node in pairs:
        found.setdefault(name, []).append(node)
    return ((name, listed(sorted(set(nodes)))) for name, nodes in sorted(found.items()))


def meanwhile(observations: Iterable[Observation], programs: Iterable[Program], since_ns: int) -> Iterator[str]:
    """Yield what happened since a time: messages, requests and responses, the last texts, and who has ended."""
    recent = [o for o in observations if o.t_ns >= since_ns]
    counts: dict[tuple[str, str], list[Observation]] = {}
    for one in recent:
        if isinstance(one, (Message, Delivery)):
            counts.setdefault((one.topic, "the test" if isinstance(one, Delivery) else ""), []).append(one)
    for (topic, sender), found in sorted(counts.items()):
        some = "1 message" if len(found) == 1 else f"{len(found):,} messages, the last"
        yield f"{topic}: {some} at {moment(found[-1].t_ns)}{f', from {sender}' if sender else ''}"
    exchanged = Counter((o.service, type(o)) for o in recent if isinstance(o, (Request, Response)))
    for service in sorted({service for service, _ in exchanged}):
        requests, responses = exchanged[service, Request], exchanged[service, Response]
        yield f"{service}: {_some(requests, 'request')}, {_some(responses, 'response')}"
    texts = [o for o in recent if isinstance(o, (LogRecord, OutputLine))]
    for text in texts[-MOST_LINES:]:
        severity = f"[{text.severity}] " if isinstance(text, LogRecord) else ""
        yield f"{moment(text.t_ns)}, {text.process}: {severity}{quote(text.text, LINE_CHARACTERS)}"
    for program in programs:
        if not program.running:
            yield f"{program.name} has exited with code {program.exit_code}"
    if not recent:
        yield "nothing"


def _some(count: int, what: str) -> str:
    return f"{count or 'no'} {what}{'' if count == 1 else 's'}"


def timeout(what: str, since_ns: int, now_ns: int, sections: Mapping[str, Iterable[str]], hint: str) -> StepTimeout:
    """Return the error of a timeout: what was waited for, and what is known about it.

    Args:
        what: What did not happen.
        since_ns: From when on it was waited for.
        now_ns: Until when.
        sections: Lines of text below titles; the first section is about the cause.
        hint: One thing to do; may be empty.
    """
    first = f"{what} within {span(now_ns - since_ns)} ({moment(since_ns)} to {moment(now_ns)})"
    lines = [first]
    for title, found in sections.items():
        if texts := [*found]:
            lines += [f"{title}:", *(f"  {text}" for text in texts)]
    cause = next((text.partition("\n")[0] for text in next(iter(sections.values()), ())), "")
    return StepTimeout("\n".join(lines), f"{first}: {cause}" if cause else first, hint)


def service_ends(graph: GraphSnapshot, kind: str) -> list[ServiceEnd]:
    """Return the servers (`service`) or clients (`client`) in a graph."""
    return [end for end in graph.services if end.kind == kind]
