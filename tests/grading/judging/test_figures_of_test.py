"""The figures of a run that a test stepped: its steps, where it failed, values of topics, calls, and the graph."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from tracing import FLOAT32, Recording

from grader.grading.judging.figures_of_test import played_test, shown_steps, value_charts
from grader.grading.model.chart import Panel, Tone
from grader.grading.model.tested_run import NotedCall, SideOfTest
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import AssessedTrace, Delivery, Endpoint, Message, ServiceEnd
from grader.runtime.model.worlds import Sketch

TEST = "/ws/test_it.py"


def call(line: int, begin_s: float, end_s: float, *, failed: bool = False, file: str = TEST) -> NotedCall:
    """Return a call of `advance`."""
    begin_ns, end_ns = round(begin_s * NS_PER_S), round(end_s * NS_PER_S)
    return NotedCall("advance", file, line, begin_ns, end_ns, failed, f"ros.advance({end_s - begin_s:g})")


SIDE = SideOfTest(
    calls=(call(5, 0, 0), call(6, 0, 2), call(7, 2, 3.5)),
    ends=((2 * NS_PER_S, ServiceEnd("client", "/add", "Add", "the test")),),
    looked_at=("/b", "/nothing"),
    failed_at=(TEST, 8),
)


def run() -> Recording:
    """Return a run in which the test and a program publish, and the test calls a service."""
    rec = Recording(3.5).endpoint("publisher", "/b", FLOAT32).log(1, "hello")
    for k in range(4):
        rec.deliver(k / 2, "/a", {"data": float(k)}).number(k / 2, "/b", 2.0 * k)
    rec.request(3, "/add", 1, value={"a": 1})
    return rec.response(3, "/add", 1, {"sum": 2})


def trace() -> AssessedTrace:
    """Return the run, with a client of the test in the graph."""
    return run().trace()


def panels(found: tuple[Panel, ...]) -> dict[str, Panel]:
    return {panel.title: panel for panel in found}


def test_the_steps_of_a_test_stand_above_what_programs_did() -> None:
    """With their lines and their times; the line at which it failed is marked through the whole chart."""
    timeline = played_test(trace(), SIDE, ["node.py"]).timeline
    rows = timeline.panels[0]
    assert rows.lanes == ("the test: steps", "node.py: logged", "/add: called")
    steps, failed, *_ = rows.series
    assert [*zip([x for x, _ in steps.points], steps.texts, strict=True)] == [
        (0, "line 5: ros.advance(0)"),
        (0, "line 6: ros.advance(2)"),
        (2, "line 7: ros.advance(1.5)"),
    ]
    assert (failed.points, failed.texts, failed.tone) == (((3.5, 0),), ("line 8 failed",), Tone.BAD)
    assert [(c.start, c.stop, c.label) for c in timeline.cases] == [(0, 2, "line 6"), (2, 3.5, "line 7")]
    assert [(m.x, m.label) for m in timeline.moments if m.tone is Tone.BAD] == [(3.5, "line 8 failed")]
    assert timeline.about.startswith("the test: 3 steps, failed in line 8; node.py: 1 log record")


def test_calls_are_told_in_the_words_of_a_test() -> None:
    """The sides are the test and a program, and not the grader and a student."""
    played = played_test(trace(), SIDE, ["node.py"])
    texts = [text for series in played.timeline.panels[0].series for text in series.texts]
    assert "request 1 of the test: {'a': 1}" in texts
    assert "response 1 of the program: {'sum': 2}" in texts
    assert {topic.sender for topic in played.topics} == {"test", "program"}
    (called,) = [chart for chart in value_charts(trace(), SIDE) if chart.title == "Calls of /add"]
    assert called.about.startswith("1 request of the test on /add, 1 response.")


def test_messages_are_rows_on_the_same_time_line() -> None:
    """A row for each topic, with what the test and what programs have sent."""
    (messages,) = played_test(trace(), SIDE, ["node.py"]).timeline.panels[1:]
    assert (messages.title, messages.lanes) == ("messages", ("/a", "/b"))
    assert [(s.name, [x for x, _ in s.points]) for s in messages.series] == [
        ("message of the test", [0, 0.5, 1, 1.5]),
        ("message of a program", [0, 0.5, 1, 1.5]),
    ]


def test_values_are_drawn_first_of_what_the_test_looked_at() -> None:
    """Each chart follows the player of the run, and shows where the test failed."""
    charts = value_charts(trace(), SIDE)
    assert [chart.title for chart in charts] == [
        "Messages published on /b",
        "Messages published by the test on /a",
        "Calls of /add",
    ]
    assert list(charts[0].panels[0].series[0].points) == [(0, 0), (0.5, 2), (1, 4), (1.5, 6)]
    assert {chart.scenario for chart in charts} == {played_test(trace(), SIDE, []).timeline.scenario}
    assert len({chart.id for chart in charts}) == 3
    assert {(m.x, m.label, m.tone) for chart in charts for m in chart.moments} == {(3.5, "line 8 failed", Tone.BAD)}


def test_what_a_simulation_publishes_is_told_as_its_own() -> None:
    """In the title of its chart, beside its dots, and in the player."""
    side = replace(SIDE, ends=((0, Endpoint("publisher", "/a", FLOAT32, "simulation", -1, "reliable", "volatile")),))
    played = played_test(trace(), side, [])
    assert "Messages published by the simulation on /a" in [chart.title for chart in value_charts(trace(), side)]
    assert [series.name for series in panels(played.timeline.panels)["messages"].series] == [
        "message of the simulation", "message of a program"
    ]  # fmt: skip
    assert {topic.topic: topic.sender for topic in played.topics} == {"/a": "simulation", "/b": "program"}


def test_topics_of_actions_are_not_told_in_words_either() -> None:
    """The action is: the words say what the picture shows."""
    rec = run().endpoint("publisher", "/go/_action/status", "S", node="/node")
    rec.service("service", "/go/_action/send_goal", "G_SendGoal", node="/node")
    about = played_test(rec.trace(), SIDE, []).about
    assert "/node serves /go" in about
    assert "_action" not in about


def test_images_and_topics_of_actions_have_no_chart_of_values() -> None:
    """Of large messages only the times are shown; goals and feedback are in the chart of their action."""
    large = [Message(k, "/image", "sensor_msgs/msg/Image", {"width": k}, b"0" * 100_000) for k in range(3)]
    hidden = Delivery(1, "/go/_action/feedback", "F", {"feedback": {"done": 1}})
    rec = run().add(*large, hidden)
    assert not [
        chart for chart in value_charts(rec.trace(), SIDE) if "image" in chart.title or "_action" in chart.title
    ]
    played = played_test(rec.trace(), SIDE, [])
    assert panels(played.timeline.panels)["messages"].lanes == ("/a", "/b", "/image")
    assert [topic.topic for topic in played.topics] == ["/a", "/b", "/image"]


def test_an_action_is_one_row_and_one_chart() -> None:
    """Its three services are one thing to whoever reads the page."""

    def uuid() -> dict[str, Any]:
        return {"goal_id": {"uuid": [1] * 16}}

    rec = Recording(3).request(1, "/go/_action/send_goal", 1, "student", {**uuid(), "goal": {"order": 3}})
    rec.response(1, "/go/_action/send_goal", 1, {"accepted": True}, "grader")
    rec.request(1, "/go/_action/get_result", 1, "student", uuid())
    rec.response(2, "/go/_action/get_result", 1, {"status": 4, "result": {}}, "grader")
    assert played_test(rec.trace(), SideOfTest(), []).timeline.panels[0].lanes == ("/go: called",)
    (chart,) = value_charts(rec.trace(), SideOfTest())
    assert chart.title == "Goals of /go"
    assert chart.about.startswith("1 goal of the program for /go")


def test_what_the_test_offers_is_in_the_graph_from_its_time_on() -> None:
    """Beside the nodes; a moment at which only the test changed something counts as well."""
    heard = Endpoint("subscription", "/b", FLOAT32, "simulation", -1, "reliable", "volatile")
    side = replace(SIDE, ends=(*SIDE.ends, (NS_PER_S, heard)))
    graphs = played_test(trace(), side, []).graphs
    assert [(t, [e.node for e in g.endpoints if e.topic == "/b"], [e.node for e in g.services]) for t, g in graphs] == [
        (0, ["/node"], []),
        (1, ["/node", "simulation"], []),
        (2, ["/node", "simulation"], ["the test"]),
    ]


def test_what_simulations_have_drawn_is_a_picture() -> None:
    """Seen from above, to scale."""
    side = replace(SIDE, sketches=(Sketch("way of the robot", (((0.0, 0.0), (1.0, 2.0)),)),))
    *_, picture = value_charts(trace(), side)
    assert (picture.title, picture.square, picture.moments) == ("Seen from above", True, ())


def test_steps_are_listed_up_to_where_the_test_failed() -> None:
    """An assertion has a line of its own; a call that raised is the line itself."""
    steps = shown_steps(SIDE, "assert x")
    assert [(s.begin_s, s.end_s, s.place, s.text, s.failed) for s in steps[-2:]] == [
        (2, 3.5, "line 7", "ros.advance(1.5)", False),
        (3.5, 3.5, "line 8", "assert x", True),
    ]
    raised = replace(SIDE, calls=(*SIDE.calls[:2], call(8, 2, 3.5, failed=True)))
    assert [(s.place, s.failed) for s in shown_steps(raised, "assert x")][1:] == [("line 6", False), ("line 8", True)]
    passed = replace(SIDE, failed_at=None, calls=(call(5, 0, 1, failed=True), *SIDE.calls))
    assert not any(step.failed for step in shown_steps(passed, ""))


def test_lines_of_several_files_are_told_with_their_file() -> None:
    """A helper beside the test may act on the world, too."""
    side = replace(SIDE, calls=(call(3, 0, 1, file="/ws/helpers.py"), *SIDE.calls))
    assert [step.place for step in shown_steps(side, "assert x")][:2] == ["helpers.py, line 3", "test_it.py, line 5"]


def test_a_run_without_steps_is_shown_as_it_is() -> None:
    """Such as that of a notebook before its first call."""
    played = played_test(run().trace(), SideOfTest(), ["node.py"])
    assert played.timeline.panels[0].lanes[0] == "node.py: logged"
    assert played.timeline.cases == ()
    assert played.about.startswith("node.py: 1 log record")
