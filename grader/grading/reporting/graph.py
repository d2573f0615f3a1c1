"""Draws the live ROS graph like rqt_graph, as text and as a Mermaid flowchart."""

from __future__ import annotations

from collections.abc import Iterator

from rich.cells import cell_len

from grader.grading.reporting.escape import mermaid_label, shown
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import Endpoint, GraphSnapshot, ServiceEnd, offered_as, unmet_policy

#: Topics that every node has.
_EVERYWHERE = frozenset({"/rosout", "/parameter_events"})
#: Stands for a side of a topic without nodes.
NOBODY = "(nobody)"
#: More edges than this are counted, not drawn.
MOST_EDGES = 40
_NAME_LIMIT = 100

Edge = tuple[str, str, str, str]


def draw_graph(graph: GraphSnapshot, *, width: int) -> list[str]:
    """Return the lines of the drawing; an edge takes one line, or two if it is wider than `width` columns.

    A topic, service or action with only one side leads from or to `(nobody)`. A topic whose two sides have different
    types or incompatible QoS is marked, because no message passes.
    """
    edges = graph_edges(graph)
    lines = [line for edge in edges[:MOST_EDGES] for line in _drawn(edge, width)]
    calls = call_edges(graph)
    lines += [line for call in calls[:MOST_EDGES] for line in _called(call)]
    left_out = max(0, len(edges) - MOST_EDGES) + max(0, len(calls) - MOST_EDGES)
    if left_out:
        lines.append(f"and {left_out} more")
    return lines + [f"{shown(node, limit=_NAME_LIMIT)} (no topics)" for node in isolated_nodes(graph)]


@dataclass(frozen=True, slots=True)
class PossibleCall:
    """A client, and a server that it may call; either is `(nobody)` if there is none."""

    kind: str  # `service` or `action`
    client: str
    name: str
    server: str
    quarrel: str = ""  # what keeps calls from passing


def call_edges(graph: GraphSnapshot) -> list[PossibleCall]:
    """Return every client of a service or action with each server that it may call or with nobody."""
    ends = [(*offered, end) for end in graph.services if (offered := offered_as(end.service))]
    clients = [(kind, name, end) for kind, name, end in ends if end.kind == "client"]
    servers = [(kind, name, end) for kind, name, end in ends if end.kind == "service"]
    found = [
        PossibleCall(kind, client.node, name, server.node, _policies_of(client, server))
        for kind, name, client in clients
        for _, _, server in servers
        if (client.service, client.type) == (server.service, server.type)
    ]
    called, calling = {(c.name, c.server) for c in found}, {(c.client, c.name) for c in found}
    found += [PossibleCall(kind, c.node, name, NOBODY) for kind, name, c in clients if (c.node, name) not in calling]
    found += [PossibleCall(kind, NOBODY, name, s.node) for kind, name, s in servers if (name, s.node) not in called]
    return list(dict.fromkeys(found))


def _policies_of(client: ServiceEnd, server: ServiceEnd) -> str:
    """Return what keeps calls from passing: requests go one way and responses the other, so both ends must be alike."""
    for mine, other in ((client.reliability, server.reliability), (client.durability, server.durability)):
        if mine != other:
            return f"incompatible QoS: {mine} client, {other} server"
    return ""


_ARROWS = {"service": "{} ┄┄{}┄┄▶ {}", "action": "{} ══{}══▶ {}"}


def _called(call: PossibleCall) -> list[str]:
    names = (shown(part, limit=_NAME_LIMIT) for part in (call.client, call.name, call.server))
    return [_ARROWS[call.kind].format(*names), *([f"  {call.quarrel}"] if call.quarrel else [])]


def graph_edges(graph: GraphSnapshot) -> list[Edge]:
    """Return every edge once: source node, topic, target node, and what prevents messages from passing."""
    return list(dict.fromkeys(_edges(graph)))


def isolated_nodes(graph: GraphSnapshot) -> list[str]:
    """Return the nodes without edges."""
    joined = {name for source, _, target, _ in graph_edges(graph) for name in (source, target)}
    joined |= {name for call in call_edges(graph) for name in (call.client, call.server)}
    return [node for node in graph.nodes if node not in joined]


def _edges(graph: GraphSnapshot) -> Iterator[Edge]:
    visible = [e for e in graph.endpoints if not _hidden(e.topic)]
    publishers = [e for e in visible if e.kind == "publisher"]
    subscriptions = [e for e in visible if e.kind == "subscription"]
    for publisher in publishers:
        takers = [s for s in subscriptions if s.topic == publisher.topic]
        for taker in takers:
            yield publisher.node, publisher.topic, taker.node, _quarrel(publisher, taker)
        if not takers:
            yield publisher.node, publisher.topic, NOBODY, ""
    served = {p.topic for p in publishers}
    for subscription in subscriptions:
        if subscription.topic not in served:
            yield NOBODY, subscription.topic, subscription.node, ""


def _quarrel(publisher: Endpoint, subscription: Endpoint) -> str:
    """Return what keeps messages from passing; empty if nothing does."""
    if publisher.type != subscription.type:
        return f"types differ: {publisher.type}, {subscription.type}"
    policy = unmet_policy(publisher, subscription)
    return f"incompatible QoS: {policy[0]} offered, {policy[1]} requested" if policy else ""


def _hidden(topic: str) -> bool:
    return topic in _EVERYWHERE or "/_" in topic


def _drawn(edge: Edge, width: int) -> list[str]:
    source, topic, target, quarrel = (shown(part, limit=_NAME_LIMIT) for part in edge)
    arrow = f"──{topic}──▶ {target}"
    line = f"{source} {arrow}"
    lines = [line] if cell_len(line) <= width else [source, f"  {arrow}"]
    return [*lines, f"  {quarrel}"] if quarrel else lines


_MERMAID_NAME_LIMIT = 100


def draw_mermaid(graph: GraphSnapshot) -> str:
    """Return the lines of a flowchart; an edge without messages, because types or QoS do not fit, is dotted."""
    edges, calls = graph_edges(graph), call_edges(graph)
    left_out = max(0, len(edges) - MOST_EDGES) + max(0, len(calls) - MOST_EDGES)
    drawing = _Drawing()
    drawn = [line for edge in edges[:MOST_EDGES] for line in drawing.edge(edge)]
    drawn += [line for call in calls[:MOST_EDGES] for line in drawing.call(call)]
    lines = list(dict.fromkeys(drawn))
    lonely = [drawing.node(name) for name in isolated_nodes(graph)[:MOST_EDGES]]
    more = [f'more["and {left_out} more"]'] if left_out > 0 else []
    return (
        "\n".join(["flowchart LR", *(f"    {line}" for line in (*drawing.boxes, *lines, *more))])
        if lonely or lines
        else ""
    )


def _arrow(quarrel: str) -> str:
    return f'-. "{mermaid_label(quarrel)}" .->' if quarrel else "-->"


class _Drawing:
    """The boxes drawn so far; names appear only in labels, where they cannot be syntax."""

    def __init__(self) -> None:
        self.boxes: list[str] = []
        self._known: dict[tuple[str, str], str] = {}

    def node(self, name: str) -> str:
        """Return the id of a node."""
        return self._box("node", name, '(["', '"])')

    def edge(self, edge: Edge) -> Iterator[str]:
        """Yield the arrows from the source to the topic and on to the target."""
        source, name, target, quarrel = edge
        topic = self._box("topic", name, '["', '"]')
        if source != NOBODY:
            yield f"{self.node(source)} --> {topic}"
        if target != NOBODY:
            yield f"{topic} {_arrow(quarrel)} {self.node(target)}"

    def call(self, call: PossibleCall) -> Iterator[str]:
        """Yield the arrows from the client to the service or action and on to the server."""
        box = self._box(call.kind, call.name, '{{"', '"}}')
        if call.client != NOBODY:
            yield f"{self.node(call.client)} --> {box}"
        if call.server != NOBODY:
            yield f"{box} {_arrow(call.quarrel)} {self.node(call.server)}"

    def _box(self, kind: str, name: str, opening: str, closing: str) -> str:
        key = (kind, name)
        if key not in self._known:
            self._known[key] = f"{kind}{len(self._known)}"
            self.boxes.append(f"{self._known[key]}{opening}{mermaid_label(name, limit=_MERMAID_NAME_LIMIT)}{closing}")
        return self._known[key]
