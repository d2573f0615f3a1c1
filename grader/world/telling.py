"""Words what happened in a stepped run: why a program failed, what came meanwhile, and what does not fit together."""

from __future__ import annotations

import linecache
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import NamedTuple

from grader.grading.model.wording import first_few, moment, nearest, quote, span
from grader.runtime.model.trace import (
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    unmet_policy,
)
from grader.runtime.simulation import Simulation, types_heard
from grader.world.errors import NoMessage, StepTimeout
from grader.world.started import Program

#: How many lines of logs and output a message shows, and how many characters of a line.
MOST_LINES, LINE_CHARACTERS = 8, 160
#: Services that every node has, for parameters.
OF_EVERY_NODE = ("set_parameters", "set_parameters_atomically", "get_parameters", "list_parameters")
#: Parameters and topics that every node has, which are not observed.
PARAMETERS_OF_EVERY_NODE = ("use_sim_time", "start_type_description_service")
NAMES_OF_EVERY_NODE = (
    "rosout",
    "parameter_events",
    "clock",
    *OF_EVERY_NODE,
    "describe_parameters",
    "get_parameter_types",
)
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


def silence(graph: GraphSnapshot, topic: str, now_ns: int, other: str) -> NoMessage:
    """Return an error that says why no message of a program came on a topic; neither side is taken to be wrong.

    Args:
        graph: The graph now.
        topic: Its name.
        now_ns: The time since the test began.
        other: Who else publishes on the topic: the test, or a simulation; empty for nobody.
    """
    publishers = graph.ends_of_topics("publisher")
    nodes = sorted({end.node for end in publishers if end.topic == topic})
    if nodes:
        end = ": let time pass" if now_ns == 0 else ""
        return NoMessage(f"{topic}: no message of {first_few(nodes)} yet at {moment(now_ns)}{end}")
    if other:
        return NoMessage(f"{topic}: only {other} publishes on it; these are the messages of programs")
    topics = sorted({end.topic for end in publishers})
    close = nearest(topic, topics)
    known = f"; there are {first_few(topics)}" if topics and not close else ""
    return NoMessage(f"{topic}: no program publishes on it{known}", f"did you mean {close}?" if close else "")


def no_server(graph: GraphSnapshot, service: str) -> str:
    """Return why nobody offers a service; of one that every node has, whether there is the node."""
    node, _, name = service.rpartition("/")
    if name in OF_EVERY_NODE and node not in graph.nodes:
        what, close = f"there is no node {node}", nearest(node, graph.nodes)
    else:
        offered = {end.service for end in graph.ends_of_services("service")}
        what, close = f"nobody offers {service}", nearest(service, offered)
    return what + (f"\n  hint: did you mean {close}?" if close else "")


def unheard(graph: GraphSnapshot, topics: Iterable[str]) -> Iterator[str]:
    """Yield the topics of the test that no program subscribes to, each with one that may be meant."""
    for topic, close in _unheard(graph, topics):
        yield f"{topic}: no program subscribes to it" + (f"; did you mean {close}?" if close else "")


def advice(graph: GraphSnapshot, topics: Iterable[str]) -> str:
    """Return what may be meant by a topic of the test that no program subscribes to; empty if nothing is alike."""
    return next((f"did you mean {close}?" for _, close in _unheard(graph, topics) if close), "")


def _unheard(graph: GraphSnapshot, topics: Iterable[str]) -> Iterator[tuple[str, str]]:
    heard = {end.topic for end in graph.ends_of_topics("subscription")}
    for topic in topics:
        if topic not in heard:
            yield topic, nearest(topic, heard) or ""


class Given(NamedTuple):
    """What a program was started with: names of parameters, and remappings; and the nodes that came with it."""

    program: Program
    parameters: Sequence[str]
    remappings: Mapping[str, str]
    nodes: frozenset[str]


def in_vain(given: Given, observations: Sequence[Observation]) -> Iterator[str]:
    """Yield the parameters and remappings that a program was given and that change nothing of its nodes.

    Those of a program that has failed, or has no node, are left out: what it would have declared is not known.
    """
    program = given.program
    if program.fault is not None or not given.nodes:
        return
    offers = [o for o in observations if isinstance(o, Offer) and o.process == program.name and o.kind == "parameter"]
    declared = {offer.name.partition(":")[2] for offer in offers}
    for name in given.parameters:
        plain = name.rpartition(":")[2]
        if plain not in declared and plain not in PARAMETERS_OF_EVERY_NODE:
            what = f"{program.name}: the parameter {plain} was given, but no node of it declares that"
            yield what + _meant(plain, declared)
    graphs = [o for o in observations if isinstance(o, GraphSnapshot)]
    used = {end.topic for graph in graphs for end in graph.endpoints if end.node in given.nodes}
    used |= {end.service for graph in graphs for end in graph.services if end.node in given.nodes}
    used |= {name.partition("/_action/")[0] for name in used}
    for old, new in given.remappings.items():
        hidden = old.startswith("__") or old.rpartition("/")[2] in NAMES_OF_EVERY_NODE
        if not hidden and used.isdisjoint(_resolved(new, node) for node in given.nodes):
            what = f"{program.name}: the remapping of {old} to {new} matches no topic or service of its nodes"
            known = f"; they have {first_few(sorted(used))}" if used else ""
            yield what + (_meant(_resolved(old, min(given.nodes)), used) or known)


def _meant(name: str, known: Iterable[str]) -> str:
    close = nearest(name, sorted(known))
    return f"; did you mean {close}?" if close else ""


def _plain(rule: str) -> str:
    """Return the name in one side of a remapping, without the node or the kind that it is for."""
    return rule.rpartition("://")[2].rpartition(":")[2]


def _resolved(name: str, node: str) -> str:
    """Return the full name of a topic or service of a node."""
    plain = _plain(name)
    if plain.startswith("/"):
        return plain
    return f"{node}{plain[1:]}" if plain.startswith("~") else f"{node.rpartition('/')[0]}/{plain}"


class Sides(NamedTuple):
    """What the test or a simulation does: the ends of its publishers, and types of what it hears and serves by name."""

    publishers: Iterable[Endpoint]
    hears: Mapping[str, tuple[str, ...]]
    serves: Mapping[str, str]
    who: str = "the test"


def sides_of(simulation: Simulation) -> Sides:
    """Return what a simulation does; its publishers are reliable and volatile."""
    who, published = "the simulation", simulation.publishes().items()
    ends = [Endpoint("publisher", topic, kind, who, -1, "reliable", "volatile") for topic, kind in published]
    return Sides(ends, types_heard(simulation.hears()), simulation.serves(), who)


def mismatches(graph: GraphSnapshot, sides: Iterable[Sides]) -> Iterator[str]:
    """Yield what never arrives although a program uses the same name: types that differ, and QoS that never fits.

    A name that one program uses in the right way is left out.
    """
    for one in sides:
        for offer in one.publishers:
            same = graph.ends_of_topics("subscription", offer.topic)
            yield from _mismatch(same, offer.topic, (offer.type,), f"{offer.node} publishes", "subscribes to")
            fitting = [(e, unmet_policy(offer, e)) for e in same if e.type == offer.type]
            if fitting and all(unmet for _, unmet in fitting):
                end, unmet = fitting[0]
                offered, wanted = unmet or ("", "")
                yield f"{offer.topic}: {end.node} asks for {wanted}, {offer.node} offers {offered}: no message arrives"
        for topic, kinds in one.hears.items():
            same = graph.ends_of_topics("publisher", topic)
            yield from _mismatch(same, topic, kinds, f"{one.who} hears", "publishes")
        for service, kind in one.serves.items():
            clients = graph.ends_of_services("client", service)
            yield from _mismatch(clients, service, (kind,), f"{one.who} serves", "has a client of")


def _mismatch(
    ends: Sequence[Endpoint | ServiceEnd], name: str, kinds: Sequence[str], here: str, there: str
) -> Iterator[str]:
    if ends and all(end.type not in kinds for end in ends):
        yield f"{name}: {here} {' or '.join(kinds)}, {ends[0].node} {there} {ends[0].type}"


def apart(graph: GraphSnapshot) -> Iterator[str]:
    """Yield the programs' own publishers and subscriptions that do not find each other although they share a topic."""
    for reader in graph.ends_of_topics("subscription"):
        for writer in graph.ends_of_topics("publisher", reader.topic):
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
    written = {e.topic for e in graph.ends_of_topics("publisher")} | {*offered}
    silent = [e for e in graph.ends_of_topics("subscription") if e.topic not in written]
    for topic, nodes in _by_name((e.topic, e.node) for e in silent):
        yield f"{nodes} listens to {topic}, where nobody publishes"
    servers = {e.service for e in graph.ends_of_services("service")} | {*served}
    alone = [e for e in graph.ends_of_services("client") if e.service not in servers]
    for service, nodes in _by_name((e.service, e.node) for e in alone):
        yield f"{nodes} has a client of {service}, which nobody offers"


def _by_name(pairs: Iterable[tuple[str, str]]) -> Iterator[tuple[str, str]]:
    found: dict[str, list[str]] = {}
    for name, node in pairs:
        found.setdefault(name, []).append(node)
    return ((name, first_few(sorted(set(nodes)))) for name, nodes in sorted(found.items()))


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
