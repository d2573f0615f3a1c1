"""Figures: what is drawn from which check, what they say in words, and that floods stay small."""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import fields, replace
from pathlib import Path
from typing import NoReturn

import pytest
from tracing import (
    FLOAT32,
    ODOM_TIMES,
    TWIST,
    Recording,
    driving,
    held_at,
    position_logs,
    scripted,
    twist,
    velocity,
)

from grader.grading.judging.charts import MOST_POINTS, MOST_TEXTS, kept_indices
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.figures import expectation, figures_of, illustrated
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.judging.recorded_values import MOST_SAMPLES, recorded_values
from grader.grading.model.chart import Chart, Figure, GraphFigure, Look, Playback, Tone
from grader.grading.model.exercise import Criterion, Exercise
from grader.grading.rubrics.builtin import builtin_exercises
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import FaultKind, Mark, Request, Response, Trace

ONE, TWO, THREE = builtin_exercises()[:3]


def submission_of(exercise: Exercise, tmp_path: Path) -> Submission:
    files = {name: StudentFile(name, name) for name in exercise.files}
    return Submission("ada", "./ada", tmp_path, "sha256:" + "0" * 64, files)


def titled(figures: Iterable[Figure], start: str) -> Chart:
    """Return the first chart whose title begins like this; timelines are those of recordings."""
    charts = [f.timeline if isinstance(f, Playback) else f for f in figures]
    return next(f for f in charts if isinstance(f, Chart) and f.title.startswith(start))


def test_a_rate_is_drawn_with_its_bands_and_its_intervals() -> None:
    """The rate over the last second, the accepted bands, and every interval with the expected one."""
    chart = titled(figures_of(ONE, {"alone": velocity().trace()}), "Rate of")
    rate, interval = chart.panels
    assert {(b.low, b.high) for b in rate.bands} == {(19, 21), (18, 22)}
    assert all(math.isclose(y, 20) for _, y in rate.series[0].points)
    assert all(math.isclose(y, 50) for _, y in interval.series[0].points)
    assert interval.levels[0].value == 50
    assert chart.criteria == ("rate",)
    assert "200 messages on /cmd_vel within 9.9 s, at 20.000 Hz on average" in chart.about


def test_a_rate_that_changes_is_seen() -> None:
    """What an average hides shows in the picture."""
    rec = Recording(10.05, process="velocity_publisher.py")
    for k in range(100):
        rec.message(0.05 + k / 20 + (k > 50) * (k - 50) / 40, "/cmd_vel", twist(), TWIST)
    rates = [y for _, y in titled(figures_of(ONE, {"alone": rec.trace()}), "Rate of").panels[0].series[0].points]
    assert max(rates) > 19.9
    assert min(rates) < 14


def test_linear_and_angular_velocity_have_a_chart_each() -> None:
    """Each criterion shows its own fields with the values that it expects."""
    figures = figures_of(ONE, {"alone": velocity().trace()})
    charts = {c.criteria: c for c in figures if isinstance(c, Chart)}
    panels = [panel for id_ in ("linear_velocity", "angular_velocity") for panel in charts[(id_,)].panels]
    assert [(p.title, p.unit, len(p.series)) for p in panels] == [("linear", "m/s", 3), ("angular", "rad/s", 3)]
    assert {level.value for level in panels[0].levels} == {0.5, 0.0}
    assert {(c.scenario, c.until_s) for c in charts.values()} == {("alone", 10.05)}


def test_logged_positions_lie_on_the_path() -> None:
    """Right positions are good dots on the path, with what was logged."""
    trace = position_logs(lambda x, y: f"x={x:.3f} y={y:.3f}").trace("waiting_then_driving")
    chart = titled(figures_of(TWO, {"waiting_then_driving": trace}), "The path")
    path, dots = chart.panels[0].series
    assert chart.square
    assert (path.tone, path.look) == (Tone.FAINT, Look.LINE)
    assert MOST_TEXTS / 2 < len(path.points) <= MOST_TEXTS + 2
    assert (dots.tone, len(dots.points)) == (Tone.GOOD, 18)
    assert dots.texts[0].startswith("t = 6.000 s: x=")
    assert "18 of 18 logged pairs" in chart.about


def test_wrong_positions_are_drawn_as_wrong() -> None:
    """Swapped x and y are drawn off the path, and the caption mentions it."""
    trace = position_logs(lambda x, y: f"x={y:.3f} y={x:.3f}").trace("waiting_then_driving")
    chart = titled(figures_of(TWO, {"waiting_then_driving": trace}), "The path")
    assert [s.tone for s in chart.panels[0].series] == [Tone.FAINT, Tone.BAD]


def test_a_position_far_away_does_not_shrink_the_path() -> None:
    """The caption describes it."""
    trace = position_logs(lambda x, y: f"x={1000 * x + 9000:.3f} y={y:.3f}").trace("waiting_then_driving")
    chart = titled(figures_of(TWO, {"waiting_then_driving": trace}), "The path")
    assert len(chart.panels[0].series) == 1
    assert "too far away to be drawn" in chart.about


def test_log_times_stand_on_the_grid_of_the_period() -> None:
    """The grid begins at the first log; intervals are compared with the accepted band."""
    trace = position_logs(lambda x, y: f"x={x:.3f} y={y:.3f}").trace("waiting_then_driving")
    chart = titled(figures_of(TWO, {"waiting_then_driving": trace}), "When positions")
    logs, intervals = chart.panels
    assert logs.grid == (6.0, 1.0)
    assert logs.lanes == ("log",)
    assert all(math.isclose(y, 1.0) for _, y in intervals.series[0].points)
    assert (intervals.bands[0].low, intervals.bands[0].high) == (0.9, 1.1)
    assert [m.label for m in chart.moments] == ["/odom begins", "/odom ends"]


def test_answers_stand_under_what_they_answer() -> None:
    """Temperature with its threshold, the fan speed and what was expected under it, once for both sides."""
    rec = scripted()
    for k in range(80):
        value = held_at(0.5 + 0.2 * k) or 0.0
        rec.number(0.51 + 0.2 * k, "/fan_speed", 100.0 if value > 25 else 0.0)
    figures = figures_of(THREE, {"controller_alone": rec.trace("controller_alone")})
    chart = titled(figures, "Messages received on /temperature")
    assert len([f for f in figures if f.title == chart.title]) == 1
    upper, lower = chart.panels
    assert chart.criteria == ("fan_on_above_25", "fan_off_at_or_below_25")
    assert (upper.title, upper.unit, upper.levels[0].value) == ("/temperature", "°C", 25)
    assert [s.name for s in lower.series] == ["expected", "/fan_speed"]


def test_the_graph_is_shown_before_and_after() -> None:
    """Each file alone, then both together; topics that every node has are left out."""
    sensor = Recording(12).endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor")
    sensor.endpoint("publisher", "/rosout", "rcl_interfaces/msg/Log", "/temperature_sensor")
    both = Recording(20).endpoint("publisher", "/temperature", FLOAT32, "/temperature_sensor")
    both.endpoint("subscription", "/temperature", FLOAT32, "/fan_controller", 2)
    traces = {"sensor_alone": sensor.trace("sensor_alone"), "together": both.trace("together")}
    graph = next(f for f in figures_of(THREE, traces) if isinstance(f, GraphFigure))
    assert [s.title for s in graph.stages] == ["sensor alone", "together"]
    assert {e.topic for s in graph.stages for e in s.graph.endpoints} == {"/temperature"}
    assert "/temperature_sensor publishes /temperature to /fan_controller" in graph.about
    assert graph.criteria == ("bidirectional_graph",)


def test_the_timeline_has_a_row_for_each_kind_of_thing() -> None:
    """Logs by severity, printed lines, faults and limits; nothing is left to a silent node but its row."""
    rec = Recording(10, process="velocity_publisher.py").log(1, "hello").log(2, "oh", "ERROR").line(3, "printed")
    rec.crashed(4).mark(5, "limit", "more than 3 lines")
    chart = titled(figures_of(ONE, {"alone": rec.trace()}), "Logs")
    (panel,) = chart.panels
    assert panel.lanes == ("velocity_publisher.py: logged", "velocity_publisher.py: printed", "faults")
    assert [(s.name, s.tone) for s in panel.series] == [
        ("INFO", Tone.MAIN),
        ("ERROR", Tone.BAD),
        ("printed", Tone.SECOND),
        ("fault", Tone.BAD),
    ]
    assert panel.series[-1].texts == ("velocity_publisher.py:12: ValueError: no", "more than 3 lines")
    silent = titled(figures_of(ONE, {"alone": Recording(10).trace()}), "Logs")
    assert silent.panels[0].lanes == ("velocity_publisher.py: logged",)


def test_the_timeline_has_a_row_for_each_service_that_was_called() -> None:
    """Requests and responses with their content, and when servers and processes appeared and ended."""
    kind, value = "std_srvs/srv/Trigger", {"message": "85.0"}
    asked = Request(10**9, "/battery", kind, 1, "grader", 1, {})
    answered = Response(2 * 10**9, "/battery", kind, 1, "student", 1, value)
    marks = (Mark(0, "server_starts", "/other"), Mark(10**9, "process_starts", "late.py"))
    trace = replace(Recording(10).trace(), observations=(*marks, asked, answered))
    chart = titled(figures_of(ONE, {"alone": trace}), "Logs")
    assert chart.panels[0].lanes == ("velocity_publisher.py: logged", "/battery: called")
    assert [(s.name, s.points, s.texts) for s in chart.panels[0].series] == [
        ("request", ((1.0, 1.0),), ("request 1 of the grader: {}",)),
        ("response", ((2.0, 1.0),), ("response 1 of the student: {'message': '85.0'}",)),
    ]
    assert [m.label for m in chart.moments] == ["/other: server appears", "late.py starts", "end"]


def test_a_flood_becomes_a_picture_of_bounded_size() -> None:
    """A hundred thousand messages and logs are drawn with about as many points as a screen has columns."""
    rec = Recording(10, process="velocity_publisher.py")
    for k in range(20_000):
        rec.message(k / 2000, "/cmd_vel", twist((k % 7, 0, 0)), TWIST).log(k / 2000, "x" * 1000)
    figures = figures_of(ONE, {"alone": rec.trace()})
    charts = [f for f in figures if isinstance(f, Chart)] + [titled(figures, "Logs")]
    series = [s for chart in charts for panel in chart.panels for s in panel.series]
    (values,) = next(f for f in figures if isinstance(f, Playback)).topics
    assert (values.messages, len(values.times_s)) == (20_000, MOST_SAMPLES)
    assert max(len(s.points) for s in series) <= MOST_POINTS + 2
    assert max(len(s.texts) for s in series) <= MOST_TEXTS + 2
    assert max(len(text) for s in series for text in s.texts) <= 200


def test_thinning_keeps_the_extremes() -> None:
    """A single outlier among many values stays in the picture."""
    values = [0.0] * 10_000
    values[6789], values[1234] = 5.0, -5.0
    kept = kept_indices(values, 100)
    assert {0, 1234, 6789, 9999} <= set(kept)
    assert len(kept) <= 102
    assert kept_indices(values[:50], 100) == list(range(50))


@pytest.mark.parametrize("value", [float("nan"), float("inf"), -float("inf"), 1e308])
def test_strange_numbers_are_drawn_or_left_out(value: float) -> None:
    """No figure fails for what a student publishes."""
    rec = Recording(10).number(1, "/temperature", value).number(2, "/temperature", value)
    rec.number(1.5, "/fan_speed", value)
    for scenario in ("sensor_alone", "together"):
        figures_of(THREE, {scenario: rec.trace(scenario)})


@pytest.mark.parametrize("exercise", [ONE, TWO, THREE], ids=lambda e: e.id)
def test_a_node_that_does_nothing_has_figures_too(exercise: Exercise, tmp_path: Path) -> None:
    """An empty recording, and none at all."""
    submission = submission_of(exercise, tmp_path)
    for traces in ({}, {s.id: Recording(5).trace(s.id) for s in exercise.scenarios}):
        report = judge_exercise(exercise, traces, submission, {})
        assert len(illustrated(report, exercise, traces, submission, {}).figures) == len(traces)


class Broken(TopicRate):
    """A check that cannot be drawn."""

    def drawing(self, trace: Trace) -> NoReturn:
        raise ZeroDivisionError


def test_a_picture_that_fails_costs_only_itself() -> None:
    """The other figures are there all the same."""

    def broken(criterion: Criterion) -> Criterion:
        if not isinstance(criterion.check, TopicRate):
            return criterion
        values = {field.name: getattr(criterion.check, field.name) for field in fields(criterion.check)}
        return replace(criterion, check=Broken(**values))

    exercise = replace(ONE, criteria=tuple(map(broken, ONE.criteria)))
    assert exercise != ONE
    titles = [f.title for f in figures_of(exercise, {"alone": velocity().trace()})]
    assert not any(t.startswith("Rate of") for t in titles)
    assert len(titles) == 4


def test_figure_ids_are_unique_and_of_their_exercise() -> None:
    """A page with several exercises can link to each."""
    ids = [f.id for f in figures_of(ONE, {"alone": velocity().trace()})]
    assert ids == [f"velocity_publisher-{number}" for number in range(1, 6)]


def test_every_check_says_what_it_expects() -> None:
    """With the numbers of its rubric; no criterion of ours is without a phrase."""
    said = {c.id: expectation(c, []) for e in (ONE, TWO, THREE) for c in e.criteria}
    assert all(said.values())
    assert said["rate"] == "/cmd_vel at 20 ± 1 Hz on average over the whole observation; half the points at 20 ± 2 Hz"
    assert said["fan_off_at_or_below_25"] == "0 on /fan_speed for every /temperature at or below 25 °C"
    asked = {type(c.check) for e in (ONE, TWO, THREE) for c in e.criteria}
    assert asked <= set(known_checks().values())


def test_the_source_around_a_fault_is_shown(tmp_path: Path) -> None:
    """Three lines before and after, tabs widened, the file's name as handed in."""
    rec = velocity(stop_s=4).fault(
        3, FaultKind.EXCEPTION, "ValueError: no", line=5, process="velocity_publisher.py", frames=("a",)
    )
    traces = {"alone": rec.trace()}
    submission = submission_of(ONE, tmp_path)
    source = {"velocity_publisher.py": "\n".join(["one", "two", "three", "four", "\tfive", "six", "seven", "eight"])}
    report = illustrated(judge_exercise(ONE, traces, submission, source), ONE, traces, submission, source)
    (excerpt,) = report.excerpts
    assert (excerpt.file, excerpt.line, excerpt.first) == ("velocity_publisher.py", 5, 2)
    assert excerpt.lines == ("two", "three", "four", "    five", "six", "seven", "eight")
    (whole,) = report.sources
    assert (whole.file, whole.lines, whole.omitted) == ("velocity_publisher.py", ("one", *excerpt.lines), 0)


def test_a_huge_file_is_cut(tmp_path: Path) -> None:
    """A thousand lines of four hundred characters, and how many more there are."""
    traces, submission = {"alone": velocity().trace()}, submission_of(ONE, tmp_path)
    source = {"velocity_publisher.py": "\n".join(["x" * 1000] * 5000)}
    (whole,) = illustrated(judge_exercise(ONE, traces, submission, source), ONE, traces, submission, source).sources
    assert (len(whole.lines), len(whole.lines[0]), whole.omitted) == (1000, 400, 4000)


@pytest.mark.parametrize("line", [0, -1, 9, 10**9])
def test_a_line_that_the_source_does_not_have_is_not_shown(line: int, tmp_path: Path) -> None:
    """A forged traceback can name any."""
    rec = velocity(stop_s=4).fault(3, FaultKind.EXCEPTION, "E: x", line=5, process="velocity_publisher.py")
    fault = replace(rec.trace().faults()[0], line=line)
    rec.items = [fault if i == rec.trace().faults()[0] else i for i in rec.items]
    traces, submission = {"alone": rec.trace()}, submission_of(ONE, tmp_path)
    source = {"velocity_publisher.py": "one\ntwo\n"}
    report = illustrated(judge_exercise(ONE, traces, submission, source), ONE, traces, submission, source)
    assert report.excerpts == ()


def test_a_recording_holds_the_values_of_every_topic() -> None:
    """Who published, when, and each field; what never changes is there once, and what is always 0 is left out."""
    trace = position_logs(lambda x, y: f"x={x:.3f} y={y:.3f}").trace("waiting_then_driving")
    (odometry,) = recorded_values(trace)
    assert (odometry.topic, odometry.type, odometry.sender) == ("/odom", "nav_msgs/msg/Odometry", "grader")
    assert odometry.messages > len(odometry.times_s) > MOST_SAMPLES / 3
    assert odometry.times_s == tuple(sorted(odometry.times_s))
    columns = {column.name: column.values for column in odometry.columns}
    assert len(columns["pose.pose.position.x"]) == len(odometry.times_s) <= MOST_SAMPLES
    assert not any(name.startswith("header") or "covariance" in name for name in columns)
    assert all(values != (0.0,) for values in columns.values())
    (twist_,) = recorded_values(velocity().trace())
    assert {c.name: c.values for c in twist_.columns}["linear.x"] == (0.5,)


def test_elements_of_short_lists_and_texts_are_values() -> None:
    """Joint positions and names are what people look for; a scan is too long."""
    value = {"name": ["a"], "position": [0.5, float("nan")], "on": True, "ranges": [1.0] * 360, "header": {"x": 1}}
    (topic,) = recorded_values(Recording(10).message(1, "/joints", value, "sensor_msgs/msg/JointState").trace())
    assert [c.name for c in topic.columns] == ["name.0", "position.0", "position.1", "on"]
    assert [c.values[0] for c in topic.columns[:2]] == ["a", 0.5]
    assert topic.columns[3].values == ("True",)


def test_a_recording_holds_every_change_of_the_graph() -> None:
    """Without the topics that every node has; what changes nothing of the student's is no change."""
    rec = Recording(10).endpoint("publisher", "/rosout", "rcl_interfaces/msg/Log", "/node")
    rec.endpoint("publisher", "/cmd_vel", TWIST, "/node")
    first = replace(rec.trace().graphs()[-1], t_ns=0)
    later = replace(first, t_ns=3 * 10**9, endpoints=())
    trace = replace(rec.trace(), observations=(first, replace(first, t_ns=10**9), later))
    (played,) = [f for f in figures_of(ONE, {"alone": trace}) if isinstance(f, Playback)]
    assert [(t, [e.topic for e in graph.endpoints]) for t, graph in played.graphs] == [(0.0, ["/cmd_vel"]), (3.0, [])]


def test_driving_alone_has_no_dots() -> None:
    """A node that logs nothing leaves the path without positions."""
    chart = titled(figures_of(TWO, {"waiting_then_driving": driving().trace("waiting_then_driving")}), "The path")
    assert len(chart.panels[0].series) == 1
    assert len(chart.panels[0].series[0].points) <= len(ODOM_TIMES)
