"""Draws the live ROS graph like rqt_graph, as text and as a Mermaid flowchart."""

from __future__ import annotations

from collections.abc import Iterator

from rich.cells import cell_len

from grader.core.trace import GraphSnapshot
from grader.reporting.escape import mermaid_label, shown

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

    A topic with only one side leads from or to `(nobody)`. A topic whose two sides have different types is marked,
    because no message passes.
    """
    edges = graph_edges(graph)
    lines = [line for edge in edges[:MOST_EDGES] for line in _drawn(edge, width)]
    if len(edges) > MOST_EDGES:
        lines.append(f"and {len(edges) - MOST_EDGES} more")
    calls = service_edges(graph)
    lines += [_called(*edge) for edge in calls[:MOST_EDGES]]
    joined = {name for client, _, server in calls for name in (client, server)}
    lonely = [node for node in isolated_nodes(graph) if node not in joined]
    return lines + [f"{shown(node, limit=_NAME_LIMIT)} (no topics)" for node in lonely]


def service_edges(graph: GraphSnapshot) -> list[tuple[str, str, str]]:
    """Return every client with each server that it may call or with nobody, without the parts of actions."""
    ends = [end for end in graph.services if not _hidden(end.service)]
    clients = [end for end in ends if end.kind == "client"]
    servers = [end for end in ends if end.kind == "service"]
    found = [
        (client.node, client.service, server.node)
        for client in clients
        for server in servers
        if (client.service, client.type) == (server.service, server.type)
    ]
    called, calling = {(e[1], e[2]) for e in found}, {(e[0], e[1]) for e in found}
    found += [(c.node, c.service, NOBODY) for c in clients if (c.node, c.service) not in calling]
    found += [(NOBODY, s.service, s.node) for s in servers if (s.service, s.node) not in called]
    return found


def _called(client: str, service: str, server: str) -> str:
    names = (shown(part, limit=_NAME_LIMIT) for part in (client, service, server))
    return "{} ┄┄{}┄┄▶ {}".format(*names)


def graph_edges(graph: GraphSnapshot) -> list[Edge]:
    """Return every edge once: source node, topic, target node, and what prevents messages from passing."""
    return list(dict.fromkeys(_edges(graph)))


def isolated_nodes(graph: GraphSnapshot) -> list[str]:
    """Return the nodes without edges."""
    joined = {name for source, _, target, _ in graph_edges(graph) for name in (source, target)}
    return [node for node in graph.nodes if node not in joined]


def _edges(graph: GraphSnapshot) -> Iterator[Edge]:
    visible = [e for e in graph.endpoints if not _hidden(e.topic)]
    publishers = [e for e in visible if e.kind == "publisher"]
    subscriptions = [e for e in visible if e.kind == "subscription"]
    for publisher in publishers:
        takers = [s for s in subscriptions if s.topic == publisher.topic]
        for taker in takers:
            quarrel = "" if publisher.type == taker.type else f"types differ: {publisher.type}, {taker.type}"
            yield publisher.node, publisher.topic, taker.node, quarrel
        if not takers:
            yield publisher.node, publisher.topic, NOBODY, ""
    served = {p.topic for p in publishers}
    for subscription in subscriptions:
        if subscription.topic not in served:
            yield NOBODY, subscription.topic, subscription.node, ""


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
    """Return the lines of a flowchart; an edge without messages, because the types differ, is dotted."""
    edges = graph_edges(graph)
    kept, left_out = edges[:MOST_EDGES], len(edges) - MOST_EDGES
    drawing = _Drawing()
    lines = list(dict.fromkeys(line for edge in kept for line in drawing.edge(edge)))
    lonely = [drawing.node(name) for name in isolated_nodes(graph)[:MOST_EDGES]]
    more = [f'more["and {left_out} more"]'] if left_out > 0 else []
    return (
        "\n".join(["flowchart LR", *(f"    {line}" for line in (*drawing.boxes, *lines, *more))])
        if lonely or lines
        else ""
    )


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
            arrow = f'-. "{mermaid_label(quarrel)}" .->' if quarrel else "-->"
            yield f"{topic} {arrow} {self.node(target)}"

    def _box(self, kind: str, name: str, opening: str, closing: str) -> str:
        key = (kind, name)
        if key not in self._known:
            self._known[key] = f"{kind}{len(self._known)}"
            self.boxes.append(f"{self._known[key]}{opening}{mermaid_label(name, limit=_MERMAID_NAME_LIMIT)}{closing}")
        return self._known[key]
