"""The live ROS graph as a Mermaid flowchart, as rqt_graph would draw it: nodes round, topics square."""

from __future__ import annotations

from collections.abc import Iterator

from grader.model.trace import GraphSnapshot
from grader.reports.escape import mermaid_label
from grader.reports.graph import MOST_EDGES, NOBODY, Edge, graph_edges, lonely_nodes

_NAME_LIMIT = 100


def draw_mermaid(graph: GraphSnapshot) -> str:
    """Return the lines of a flowchart; an edge that carries no message because the types differ is dotted."""
    edges = graph_edges(graph)
    kept, left_out = edges[:MOST_EDGES], len(edges) - MOST_EDGES
    drawing = _Drawing()
    lines = list(dict.fromkeys(line for edge in kept for line in drawing.edge(edge)))
    lonely = [drawing.node(name) for name in lonely_nodes(graph)[:MOST_EDGES]]
    more = [f'more["and {left_out} more"]'] if left_out > 0 else []
    return (
        "\n".join(["flowchart LR", *(f"    {line}" for line in (*drawing.boxes, *lines, *more))])
        if lonely or lines
        else ""
    )


class _Drawing:
    """The boxes drawn so far; names stand only in their labels, never where they could be syntax."""

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
            self.boxes.append(f"{self._known[key]}{opening}{mermaid_label(name, limit=_NAME_LIMIT)}{closing}")
        return self._known[key]
