"""Figures as the plain values that the page's scripts draw; all text in them is made safe to show here."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from grader.model.figure import Chart, Figure, GraphFigure, Panel, Series, Stage
from grader.model.trace import Endpoint
from grader.reports.escape import shown

_TEXT_LIMIT = 200
_NAME_LIMIT = 60
#: More nodes and topics than this are no drawing any more.
_MOST_BOXES = 60


def figure_values(figure: Figure) -> dict[str, Any]:
    """Return a figure as JSON values; numbers that JSON cannot say are None."""
    return _graph(figure) if isinstance(figure, GraphFigure) else _chart(figure)


def _chart(chart: Chart) -> dict[str, Any]:
    return {
        "kind": "chart",
        "title": shown(chart.title),
        "x": {"title": chart.x_title, "unit": chart.x_unit},
        "square": chart.square,
        "panels": [_panel(panel) for panel in chart.panels],
        "moments": [
            {"x": _number(m.x), "label": shown(m.label, limit=_NAME_LIMIT), "tone": m.tone.value} for m in chart.moments
        ],
    }


def _panel(panel: Panel) -> dict[str, Any]:
    return {
        "title": shown(panel.title, limit=_NAME_LIMIT),
        "unit": panel.unit,
        "series": [_series(series) for series in panel.series],
        "bands": [
            {"low": _number(b.low), "high": _number(b.high), "label": shown(b.label), "tone": b.tone.value}
            for b in panel.bands
        ],
        "levels": [{"value": _number(level.value), "label": shown(level.label)} for level in panel.levels],
        "lanes": [shown(lane, limit=_NAME_LIMIT) for lane in panel.lanes],
        "grid": list(panel.grid) if panel.grid else None,
    }


def _series(series: Series) -> dict[str, Any]:
    return {
        "name": shown(series.name, limit=_NAME_LIMIT),
        "look": series.look.value,
        "tone": series.tone.value,
        "points": [[_number(x), _number(y)] for x, y in series.points],
        "texts": [shown(text, limit=_TEXT_LIMIT) for text in series.texts],
    }


def _graph(figure: GraphFigure) -> dict[str, Any]:
    return {
        "kind": "graph",
        "title": shown(figure.title),
        "stages": [_stage(stage) for stage in figure.stages],
    }


def _stage(stage: Stage) -> dict[str, Any]:
    """Return nodes, topics and arrows; ids tell a node from a topic of the same name."""
    endpoints = [e for e in stage.graph.endpoints if "/_" not in e.topic]
    nodes = list(dict.fromkeys((*stage.graph.nodes, *(e.node for e in endpoints))))[:_MOST_BOXES]
    topics = list(dict.fromkeys(e.topic for e in endpoints))[:_MOST_BOXES]
    drawn = [e for e in endpoints if e.node in nodes and e.topic in topics]
    return {
        "title": shown(stage.title, limit=_NAME_LIMIT),
        "nodes": [{"id": f"n{k}", "name": shown(name, limit=_NAME_LIMIT)} for k, name in enumerate(nodes)],
        "topics": [
            {"id": f"t{k}", "name": shown(name, limit=_NAME_LIMIT), **_types(name, drawn)}
            for k, name in enumerate(topics)
        ],
        "edges": [_edge(e, f"n{nodes.index(e.node)}", f"t{topics.index(e.topic)}") for e in drawn],
    }


def _types(topic: str, endpoints: Iterable[Endpoint]) -> dict[str, Any]:
    types = list(dict.fromkeys(e.type for e in endpoints if e.topic == topic))
    return {"types": [shown(t, limit=_NAME_LIMIT) for t in types[:5]], "quarrel": len(types) > 1}


def _edge(endpoint: Endpoint, node: str, topic: str) -> dict[str, Any]:
    ends = (node, topic) if endpoint.kind == "publisher" else (topic, node)
    said = f"{endpoint.node} {'publishes' if endpoint.kind == 'publisher' else 'subscribes to'} {endpoint.topic}: "
    said += f"{endpoint.type}, {endpoint.reliability}, {endpoint.durability}"
    said += f", depth {endpoint.depth}" if endpoint.depth else ""
    return {"from": ends[0], "to": ends[1], "text": shown(said, limit=_TEXT_LIMIT)}


def _number(value: float) -> float | int | None:
    """Return a number with as many digits as a picture shows."""
    if not math.isfinite(value):
        return None
    short = float(f"{value:.7g}")
    return int(short) if short.is_integer() and abs(short) < 1e15 else short
