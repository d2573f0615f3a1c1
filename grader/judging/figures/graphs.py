"""Draws the live ROS graph of an exercise before and after: at the start and the end, or each file alone and all."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from grader.core.chart import GraphFigure, Stage
from grader.core.exercise import Exercise
from grader.core.scenario import Scenario
from grader.core.trace import GraphSnapshot, Trace
from grader.judging.silence import on_student_topic
from grader.judging.wording import counted


def graph_figure(exercise: Exercise, traces: Mapping[str, Trace]) -> GraphFigure | None:
    """Return the graph in every situation that tells something new, or None if no node ever appeared."""
    stages = [stage for s in exercise.scenarios if s.id in traces for stage in _stages(s, exercise, traces[s.id])]
    told: dict[tuple[object, ...], Stage] = {}
    for stage in stages:
        told.setdefault((stage.graph.nodes, stage.graph.endpoints, stage.graph.services), stage)
    distinct = [stage for stage in told.values() if stage.graph.nodes]
    if not distinct:
        return None
    return GraphFigure("graph", "The live ROS graph", _about(distinct), (), tuple(distinct))


def _stages(scenario: Scenario, exercise: Exercise, trace: Trace) -> list[Stage]:
    graphs = [_own(g) for g in trace.graphs() if g.t_ns <= trace.stop_ns]
    if not graphs:
        return []
    if len(exercise.scenarios) > 1:
        return [Stage(scenario.id.replace("_", " "), max(reversed(graphs), key=_size))]
    if graphs[0] == graphs[-1]:
        return [Stage("from the start to the end", graphs[0])]
    return [Stage("at the start", graphs[0]), Stage("at the end", graphs[-1])]


def _own(graph: GraphSnapshot) -> GraphSnapshot:
    """Return the graph with what the student's nodes made themselves, at no particular time."""
    return replace(graph, t_ns=0, endpoints=tuple(e for e in graph.endpoints if on_student_topic(e)))


def _size(graph: GraphSnapshot) -> int:
    return len(graph.endpoints) + len(graph.services)


def _about(stages: list[Stage]) -> str:
    return " ".join(f"{s.title.capitalize()}: {_said(s.graph)}." for s in stages)


def _said(graph: GraphSnapshot) -> str:
    publishers = [e for e in graph.endpoints if e.kind == "publisher"]
    parts = []
    for publisher in publishers:
        takers = [e for e in graph.endpoints if e.kind == "subscription" and e.topic == publisher.topic]
        parts += [f"{publisher.node} publishes {publisher.topic} to {t.node}" for t in takers]
        parts += [] if takers else [f"{publisher.node} publishes {publisher.topic}"]
    served = {p.topic for p in publishers}
    unserved = [e for e in graph.endpoints if e.kind == "subscription" and e.topic not in served]
    parts += [f"{e.node} subscribes to {e.topic}" for e in unserved]
    visible = [e for e in graph.services if "/_" not in e.service]
    parts += [f"{e.node} {'serves' if e.kind == 'service' else 'calls'} {e.service}" for e in visible]
    return ", ".join(dict.fromkeys(parts)) or f"{counted(len(graph.nodes), 'node')} without topics"
