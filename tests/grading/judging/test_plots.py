"""The general chart: which fields it draws and how, calls and goals, cases, and what it says in words."""

from __future__ import annotations

import math
from dataclasses import dataclass
from fractions import Fraction
from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.charts import MOST_POINTS
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.checks.timing import ReactionCase
from grader.grading.judging.figures import figures_of
from grader.grading.judging.findings import met
from grader.grading.judging.plots import Plot, chart_of, value_panels
from grader.grading.judging.values import FieldRule
from grader.grading.model.chart import Band, Chart, Look, Panel, Playback, Tone
from grader.grading.model.exercise import Check, Criterion, Exercise, Finding
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.trace import Trace

OTHER = "course_msgs/msg/State"


def made(check: Check, rec: Recording) -> Chart:
    chart = chart_of(check, rec.trace())
    assert chart is not None
    return chart


def published(*values: dict[str, Any]) -> Recording:
    rec = Recording(10.0 + len(values))
    for k, value in enumerate(values):
        rec.message(float(k), "/state", value, OTHER)
    return rec


def panel(chart: Chart, title: str) -> Panel:
    return next(p for p in chart.panels if p.title == title)


def test_fields_that_change_are_drawn_and_the_others_are_told() -> None:
    """A constant says nothing in a picture while something else moves."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*({"a": k, "b": 7, "c": 0} for k in range(5))))
    (only,) = chart.panels
    assert [s.name for s in only.series] == ["a"]
    assert chart.about == "5 messages published on /state: a from 0 to 4; never changing: b = 7, c = 0."


def test_a_field_that_changes_once_among_many_equal_messages_is_drawn() -> None:
    """Equal neighbours are read as one, so that a short change is not overlooked."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*({"a": 5, "b": int(k == 777)} for k in range(1000))))
    (line,) = chart.panels[0].series
    assert line.name == "b"
    assert (777, 1) in line.points


def test_constants_are_drawn_where_nothing_changes() -> None:
    """First those that are not 0."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published({"a": 0, "b": 7}, {"a": 0, "b": 7}))
    assert [s.name for s in chart.panels[0].series] == ["b"]


def test_numbers_of_one_part_of_a_message_share_a_panel_with_its_unit() -> None:
    """Metres a second and radians a second are no common axis."""
    values = [{"linear": {"x": k, "y": -k}, "angular": {"z": k / 2}} for k in range(4)]
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*values))
    assert [(p.title, p.unit, len(p.series)) for p in chart.panels] == [("linear", "m/s", 2), ("angular", "rad/s", 1)]


def test_elements_of_a_list_are_drawn_by_index_and_long_lists_by_three() -> None:
    """The first, the middle and the last of a scan."""
    short = [{"position": [k, 2.0 * k]} for k in range(3)]
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*short))
    assert [s.name for s in chart.panels[0].series] == ["position[0]", "position[1]"]
    scan = [{"ranges": [float(k + n) for n in range(360)]} for k in range(3)]
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*scan))
    assert [s.name for s in chart.panels[0].series] == ["ranges[0]", "ranges[180]", "ranges[359]"]


def test_truth_values_are_steps_and_words_are_marks() -> None:
    """A row for true and one for false; a row for each of a few words."""
    chart = made(
        CHECKS["publishes"]("/state", OTHER), published({"on": False, "mode": "idle"}, {"on": True, "mode": "go"})
    )
    on, mode = panel(chart, "on"), panel(chart, "mode")
    assert (on.lanes, on.series[0].look, [y for _, y in on.series[0].points]) == (("true", "false"), Look.STEP, [1, 0])
    assert (mode.lanes, mode.series[0].texts) == (("'idle'", "'go'"), ("idle", "go"))
    assert "on true in 1 of 2; mode: 'idle', 'go'" in chart.about


def test_many_different_words_share_a_row() -> None:
    """Each with its text."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*({"mode": f"m{k}"} for k in range(9))))
    assert chart.panels[0].lanes == ("mode",)
    assert len(chart.panels[0].series[0].texts) == 9


@pytest.mark.parametrize("odd", [float("nan"), float("inf"), -float("inf"), 1e308])
def test_numbers_that_cannot_be_drawn_interrupt_the_line(odd: float) -> None:
    """The words tell of those that are not finite."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published({"a": 1.0}, {"a": odd}, {"a": 2.0}))
    assert [math.isfinite(y) for _, y in chart.panels[0].series[0].points] == [True, False, True]
    assert ("not finite" in chart.about) == (odd != 1e308)


def test_a_message_without_numbers_is_a_mark() -> None:
    """That it came is all there is to see."""
    chart = made(CHECKS["publishes"]("/state", OTHER), published({}, {}))
    assert chart.panels[0].lanes == ("message",)
    assert chart.about == "2 messages published on /state."


def test_more_fields_than_fit_are_told() -> None:
    """Three parts, six lines in each."""
    values = [{f"p{n}": {f"f{m}": k + n + m for m in range(9)} for n in range(5)} for k in range(3)]
    chart = made(CHECKS["publishes"]("/state", OTHER), published(*values))
    assert [len(p.series) for p in chart.panels] == [6, 6, 6]
    assert "not drawn: p3.f0" in chart.about


def test_rules_are_levels_and_bands() -> None:
    """What is expected is grey; equal numbers share a line."""
    rules = {"a": FieldRule(equals=1.0), "b": FieldRule(equals=1), "c": FieldRule(low=0, high=5), "d": FieldRule(low=2)}
    (made_,) = [p for p, _ in value_panels(Plot("/x", rules=rules), [(0, {"a": 1, "b": 1, "c": 2, "d": 3})], "One")]
    assert [(v.value, v.label) for v in made_.levels] == [(1, "a, b = 1"), (2, "at least 2")]
    assert [(b.low, b.high) for b in made_.bands] == [(0, 5)]


def test_a_band_without_a_number_in_its_label_is_told_with_its_limits() -> None:
    """An author's label may be a name alone; those of the built-in checks hold their numbers."""
    bands = (Band(0.47, 0.53, "full points"), Band(0.4, 0.6, "0.5 ± 0.1: accepted"))
    ((_, said),) = value_panels(Plot("/x", bands=bands), [(0, {"a": 0.5}), (1, {"a": 0.6})], "Two messages")
    assert "full points: 0.47 to 0.53; 0.5 ± 0.1: accepted" in said


def test_what_came_stands_above_what_was_published_with_the_cases_marked() -> None:
    """Right cases and wrong ones look different, and numbers that were expected are grey."""
    check = CHECKS["reaction"](
        "/in", "/out", (ReactionCase({"data": 1}, {"data": 10}), ReactionCase({"data": 2}, {"data": 20}))
    )
    rec = Recording(6).endpoint("subscription", "/in")
    for t_s, given, answer in ((1, 1, 10), (2, 2, 99), (3, 1, 10)):
        rec.deliver(t_s, "/in", {"data": given}).number(t_s + 0.1, "/out", answer)
    chart = made(check, rec)
    assert [p.title for p in chart.panels] == ["/in", "/out"]
    assert [(c.start, c.stop, c.label, c.tone) for c in chart.cases] == [
        (1, 2, "data 1", Tone.GOOD),
        (2, 3, "data 2", Tone.BAD),
        (3, 6, "data 1", Tone.GOOD),
    ]
    expected, got = chart.panels[1].series
    assert (expected.tone, expected.points) == (Tone.FAINT, ((1, 10), (2, 20), (3, 10), (6, 10)))
    assert [y for _, y in got.points] == [10, 99, 10]
    assert "Cases: data 1 from 1.0 s to 2.0 s" in chart.about


def test_calls_are_marks_with_their_content_and_what_they_took() -> None:
    """Requests above, then the time to each response, then the numbers in the responses."""
    rec = Recording(5)
    for k in range(1, 4):
        rec.request(k, "/add", k, value={"a": k, "b": 1}).response(k + 0.2, "/add", k, {"sum": k + 1})
    chart = made(CHECKS["service_answers_all"]("/add"), rec)
    assert [p.title for p in chart.panels] == ["request", "/add", "time to the response", "response"]
    calls = panel(chart, "/add")
    assert calls.lanes == ("request", "response")
    assert calls.series[1].texts[0] == "response 1 of the student: {'sum': 2}"
    took = panel(chart, "time to the response")
    assert (took.unit, took.levels[0].value) == ("ms", 1000)
    assert [round(y) for _, y in took.series[0].points] == [200, 200, 200]


def test_a_goal_is_a_case_with_its_feedback_and_its_result() -> None:
    """From the goal to the result, by the status with which it ended."""
    uuid = {"goal_id": {"uuid": [1, 2]}}
    rec = Recording(6).request(1, "/go/_action/send_goal", 1, value={**uuid, "goal": {"order": 3}})
    rec.response(1.1, "/go/_action/send_goal", 1, {"accepted": True}).request(
        1.1, "/go/_action/get_result", 1, value=uuid
    )
    rec.message(2, "/go/_action/feedback", {**uuid, "feedback": {"done": 1}}, OTHER)
    rec.message(3, "/go/_action/feedback", {**uuid, "feedback": {"done": 2}}, OTHER)
    rec.response(4, "/go/_action/get_result", 1, {"status": 4, "result": {"order": 3}})
    chart = made(CHECKS["action_result"]("/go"), rec)
    assert [(c.start, c.stop, c.label) for c in chart.cases] == [(1, 4, "goal 1: succeeded")]
    lanes = chart.panels[0]
    assert lanes.lanes == ("goal", "feedback", "result")
    assert {s.name: s.texts[0] for s in lanes.series} == {
        "goal": "order = 3",
        "accepted": "accepted",
        "feedback": "done = 1",
        "result": "succeeded: order = 3",
    }
    assert [y for _, y in chart.panels[1].series[0].points] == [1, 2]


def asked_by_a_client() -> Recording:
    """Return a recording of a client: a goal that is cancelled, a rejected one, and one that has not ended."""

    def uuid(number: int) -> dict[str, Any]:
        return {"goal_id": {"uuid": [number] * 16}}

    rec = Recording(9)
    for t_s, number, accepted in ((1, 1, True), (5, 2, False), (6, 3, True)):
        rec.request(t_s, "/go/_action/send_goal", number, "student", {**uuid(number), "goal": {"order": number}})
        rec.response(t_s + 0.1, "/go/_action/send_goal", number, {"accepted": accepted}, "grader")
    rec.request(1.1, "/go/_action/get_result", 1, "student", uuid(1))
    rec.deliver(2, "/go/_action/feedback", {**uuid(1), "feedback": {"done": 1}}, OTHER)
    rec.deliver(3, "/go/_action/feedback", {**uuid(1), "feedback": {"done": 2}}, OTHER)
    rec.request(3.5, "/go/_action/cancel_goal", 1, "student", {"goal_info": uuid(1)})
    return rec.response(4, "/go/_action/get_result", 1, {"status": 5, "result": {"order": 0}}, "grader")


@pytest.mark.parametrize(
    "check",
    [
        CHECKS["sends_goals"]("/go"),
        CHECKS["cancels_goal"]("/go", {"done": 2}),
        CHECKS["after_goal"]("/go", "canceled", "nothing"),
    ],
    ids=lambda check: type(check).__name__,
)
def test_the_goals_of_a_client_are_drawn_like_those_of_the_grader(check: Check) -> None:
    """Sent by the student, answered by the grader: content, answers, feedback, the request to cancel, and results."""
    chart = made(check, asked_by_a_client())
    cases = [(c.start, c.stop, c.label) for c in chart.cases]
    assert cases == [(1, 4, "goal 1: canceled"), (6, 9, "goal 3: no result")]
    lanes = chart.panels[0]
    assert lanes.lanes == ("goal", "feedback", "cancel", "result")
    assert {s.name: [*zip([x for x, _ in s.points], s.texts, strict=True)] for s in lanes.series} == {
        "goal": [(1, "order = 1"), (5, "order = 2"), (6, "order = 3")],
        "accepted": [(1.1, "accepted"), (6.1, "accepted")],
        "rejected": [(5.1, "rejected")],
        "feedback": [(2, "done = 1"), (3, "done = 2")],
        "cancel": [(3.5, "asked to cancel")],
        "result": [(4, "canceled: order = 0")],
    }
    said = "3 goals of the student for /go, 2 messages of feedback, 1 request to cancel, 1 result."
    assert chart.about.startswith(said)


@dataclass(frozen=True, slots=True)
class Own:
    """A check of an author, which names what it looks at."""

    topic: str
    field: str
    process: str

    def judge(self, trace: Trace) -> Finding:
        return met("fine")


def test_a_check_of_an_author_is_drawn_by_what_its_parameters_name() -> None:
    """The field of the topic, and what the process wrote."""
    rec = published({"a": 1, "b": 2}, {"a": 3, "b": 4}).log(1, "hello", "WARN")
    chart = made(Own("/state", "b", "node.py"), rec)
    assert chart.title == "Messages published on /state and output of node.py"
    assert [s.name for s in chart.panels[0].series] == ["b"]
    assert chart.panels[1].lanes == ("node.py: logged", "node.py: WARN")


def test_a_flood_is_thinned_alike_for_all_lines() -> None:
    """The lines of a panel share their times, and together they are bounded."""
    rec = published(*({"v": {"a": k % 7, "b": -k, "c": k % 3}} for k in range(9_000)))
    lines = made(CHECKS["publishes"]("/state", OTHER), rec).panels[0].series
    assert len({tuple(x for x, _ in line.points) for line in lines}) == 1
    assert sum(len(line.points) for line in lines) <= 3 * MOST_POINTS


def judged(*checks: Check) -> Exercise:
    scenario = Scenario("alone", ("node.py",), Span(10 * 10**9))
    criteria = tuple(Criterion(f"c{k}", f"c{k}", Fraction(1), "alone", check) for k, check in enumerate(checks))
    return Exercise("one", "1", "One", True, ("node.py",), (scenario,), criteria, "sha256:0")


def test_a_chart_that_another_one_holds_is_not_drawn_again() -> None:
    """What a topic carries is in the chart of its range, which belongs to the criterion about the range."""
    rec = Recording(10)
    for k in range(5):
        rec.number(k, "/temperature", 20 + k)
    checks = CHECKS["publishes"]("/temperature", OTHER), CHECKS["random_in_range"]("/temperature", 20, 30)
    chart, run = figures_of(judged(*checks), {"alone": rec.trace()})
    assert chart.criteria == ("c1", "c0")
    assert isinstance(run, Playback)
    assert run.criteria == ()


def test_a_criterion_without_a_chart_names_the_run_unless_it_reads_the_source() -> None:
    """Logs and faults are in the recording that can be played; a rule about the text is in none."""
    checks = CHECKS["no_fault"](), CHECKS["source_uses"]("node.py", calls=("rclpy.spin",))
    (run,) = figures_of(judged(*checks), {"alone": Recording(10).trace()})
    assert run.criteria == ("c0",)
