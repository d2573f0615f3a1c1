"""Parameters of checks that are formulas, patterns, types, lists and mappings: read strictly, each with its place."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from grader.grading.judging.checks.actions import ActionResult
from grader.grading.judging.checks.fields import FieldFunction
from grader.grading.judging.checks.graph import GraphEdge, GraphEdges, TopicNames
from grader.grading.judging.checks.received import LogsValues
from grader.grading.judging.checks.services import ServiceResponse
from grader.grading.judging.checks.timing import Reaction, ReactionCase, Silence
from grader.grading.judging.checks.topics import Transform
from grader.grading.judging.values import FieldRule
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.quantities import NS_PER_MS

RUBRIC = """schema: grader/rubric/v1
exercise: {id: one, number: "9", title: One}
files: [node.py]
scenarios:
  - {id: alone, processes: [node.py], observe: {duration: 10 s}}
criteria:
  - id: asked
    title: Asked
    points: 1
    scenario: alone
    check:
      CHECK
"""


def read(tmp_path: Path, check: str) -> Any:
    path = tmp_path / "r.yaml"
    path.write_text(RUBRIC.replace("CHECK", check), encoding="utf-8")
    return read_rubric(path).criteria[0].check


@pytest.mark.parametrize(
    ("written", "wanted"),
    [
        (
            "field_function: {topic: /a, formula: sin(0.1 * n), start_tolerance: 2}",
            FieldFunction("/a", "sin(0.1 * n)", start_tolerance=2),
        ),
        (
            "logs_values: {process: node.py, topic: /a, unit_factors: [1, 57.3]}",
            LogsValues("node.py", "/a", unit_factors=(1.0, 57.3)),
        ),
        (
            "service_response: {service: /a/b, fields: {ok: true, n: 3, text: {pattern: 'a+', example: aa}}}",
            ServiceResponse("/a/b", {"ok": True, "n": 3.0, "text": FieldRule(pattern="a+", example="aa")}),
        ),
        (
            "reaction: {input: /a, output: /b, within: 200 ms, cases: [{when: {data: x}, then: {p.q: {items: [1, y]}}},"
            " {when: {}, silent: true}]}",
            Reaction(
                "/a",
                "/b",
                (
                    ReactionCase({"data": "x"}, {"p.q": FieldRule(items=(1.0, "y"))}),
                    ReactionCase({}, silent=True),
                ),
                within=200 * NS_PER_MS,
            ),
        ),
        (
            "graph_edges: {edges: [{topic: /a, source: /n}, {topic: /b}], at_once: true}",
            GraphEdges((GraphEdge("/a", "/n"), GraphEdge("/b")), at_once=True),
        ),
        (
            "action_result: {action: /count, result: {sequence: {items: [0, 1, 1]}, name: x}}",
            ActionResult("/count", result={"sequence": FieldRule(items=(0.0, 1.0, 1.0)), "name": "x"}),
        ),
        (
            "transform: {parent: a, child: b, translation: {x: 1, z: 2}, rate: 10 Hz}",
            Transform("a", "b", translation={"x": 1.0, "z": 2.0}, rate=10.0),
        ),
        ("topic_names: {publishes: [/a, /b], exactly: true}", TopicNames(("/a", "/b"), exactly=True)),
        ("silence: {topic: /a, after: stream_stops, of: /b}", Silence("/a", "stream_stops", of="/b")),
    ],
)
def test_parameters_of_every_kind_are_read(tmp_path: Path, written: str, wanted: Any) -> None:
    """Formulas, factors, rules short and long, cases, edges."""
    assert read(tmp_path, written) == wanted


@pytest.mark.parametrize(
    ("written", "said"),
    [
        ("field_function: {topic: /a, formula: sinn(n)}", "12:44: expected numbers, n, t, pi"),
        ("field_function: {topic: /a, formula: x + 1}", "12:44: expected n, t, pi or one of sin"),
        ("field_function: {topic: a, formula: n}", "12:31: expected an absolute topic name"),
        ("logs_matching: {process: node.py, pattern: '(a'}", "12:50: expected a regular expression of Python"),
        ("service_available: {service: /a, type: std_msgs/msg/String}", "12:46: expected a service type such as"),
        ("service_response: {service: /a, fields: {m: {patern: a}}}", "patern"),
        ("topic_names: {publishes: [a]}", "12:33: expected an absolute topic name"),
        ("silence: {topic: /a, after: dawn}", "12:35: "),
        ("reaction: {input: /a, output: /b, cases: [{then: {}}]}", "when"),
        ("qos: {topic: /a, kind: server}", "12:30: "),
    ],
)
def test_what_cannot_be_read_is_refused_at_its_place(tmp_path: Path, written: str, said: str) -> None:
    """Line and column, and what was expected there."""
    with pytest.raises(RubricError) as raised:
        read(tmp_path, written)
    assert said in raised.value.message
