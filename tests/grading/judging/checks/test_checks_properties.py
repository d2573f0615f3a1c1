"""What is true of every check: it never raises, its evidence is plain, and it does not care when a recording began."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from fractions import Fraction
from typing import Any

import pytest
from check_instances import INSTANCES
from hypothesis import example, given
from hypothesis import strategies as st
from nodes import (
    BATTERY,
    HONEST_FANS,
    WRONG_FANS,
    answering,
    asking,
    chapter,
    deciding,
    drawn,
    each_speed,
    graph,
    hearing,
    sensed,
    together,
)
from tracing import FLOAT32, ODOMETRY, TWIST, Recording, position_logs, twist, velocity
from wordings import RIGHT
from wordings import WRONG as WRONG_POSITIONS

from grader.grading.judging.charts import MOST_CASES
from grader.grading.judging.plots import chart_of
from grader.grading.model.exercise import Check, ask, reads_packages
from grader.grading.reporting.html.render import Columns, figure_values
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.projects import ExaminedPackage, FlawKind, InstallFlaw
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import (
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Trace,
)

TRACES = {
    "velocity": velocity().log(0.0, "started"),
    "half rate": velocity(10.0),
    "crashed": velocity(stop_s=5.05).crashed(5.05),
    "positions": position_logs(RIGHT["chapter hint"]),
    "printed positions": position_logs(RIGHT["three records"], printed=True),
    "swapped positions": position_logs(WRONG_POSITIONS["swapped"][0]),
    "sensor": sensed(drawn()),
    "sensor that listens": hearing(str),
    "controller": HONEST_FANS["each temperature"],
    "inverted controller": each_speed(WRONG_FANS["inverted"][0]),
    "together": together(),
    "graph": graph(),
    "battery server": answering(60, clients=3),
    "battery client": asking(chapter),
    "careless battery client": asking(deciding(lambda v: v > 10, 50.0)),
    "empty": Recording(),
}

NAMES = st.sampled_from(
    ["/tf", "/cmd_vel", "/battery/get_status", "/odom", "/temperature", "/fan_speed", "/x", "/rosout"]
)
TYPES = st.sampled_from([TWIST, ODOMETRY, FLOAT32, "std_msgs/msg/String", "\ud800\n"])
FILES = st.sampled_from(
    [
        "velocity_publisher.py",
        "odom_subscriber.py",
        "temperature_sensor.py",
        "fan_controller.py",
        "battery_service_client.py",
    ]
)
TIMES = st.integers(0, 30 * NS_PER_S)
NUMBERS = st.one_of(st.floats(), st.integers(), st.booleans(), st.none(), st.text(max_size=3), st.just([1.0]))
POSITIONS = st.builds(lambda x, y: {"pose": {"pose": {"position": {"x": x, "y": y}}}}, NUMBERS, NUMBERS)
VALUES = st.one_of(
    st.just({}),
    st.builds(lambda v: {"data": v}, NUMBERS),
    st.builds(lambda v: {"temperature": v}, NUMBERS),
    st.builds(lambda a, b: twist((a, 0, 0), (0, 0, b)), NUMBERS, NUMBERS),
    POSITIONS,
    st.just({"linear": 3, "pose": "\ud800"}),
    st.builds(lambda v: {"names": ["speed"], "values": [v]}, st.one_of(NUMBERS, st.just({"type": 3}))),
    st.builds(
        lambda v: {"parameters": [{"name": "speed", "value": {"type": 3, "double_value": v}}, v], "results": [v]},
        NUMBERS,
    ),
    st.builds(lambda v: {"results": [{"successful": True, "reason": v}], "accepted": True, "status": v}, NUMBERS),
    st.builds(lambda v: {"transition": {"id": v, "label": v}, "current_state": v, "transforms": [v, {}]}, NUMBERS),
    st.builds(lambda s, m: {"success": s, "message": m}, NUMBERS, st.one_of(NUMBERS, st.text(max_size=9))),
)
TEXTS = st.one_of(st.text(max_size=40), st.builds(lambda a, b: f"x={a} y={b}", st.floats(), st.floats()))
ENDPOINTS = st.builds(
    Endpoint,
    st.sampled_from(["publisher", "subscription", "?"]),
    NAMES,
    TYPES,
    st.sampled_from(["/a", "/b", "", "\u202e"]),
    st.integers(-1, 2),
    st.sampled_from(["reliable", "best_effort", ""]),
    st.sampled_from(["volatile", "transient_local", ""]),
)
MARKS = st.sampled_from(
    ["stream_starts", "stream_stops", "limit", "server_starts", "server_stops", "exited", "stop_signal", "stopped"]
)
SERVICES = st.sampled_from(
    [BATTERY, "/d/get_parameters", "/d/set_parameters", "/d/change_state", "/d/get_state"]
    + [f"/fibonacci/_action/{name}" for name in ("send_goal", "get_result")]
)
SENDERS = st.sampled_from(["grader", "student"])
SERVICE_ENDS = st.builds(
    ServiceEnd, st.sampled_from(["service", "client"]), st.sampled_from([BATTERY, "/b"]), TYPES, st.just("/a")
)
OBSERVATIONS = st.one_of(
    st.builds(Message, TIMES, NAMES, TYPES, VALUES),
    st.builds(Delivery, TIMES, NAMES, TYPES, VALUES),
    st.builds(LogRecord, TIMES, FILES, st.sampled_from(["INFO", "ERROR", ""]), st.text(max_size=5), TEXTS),
    st.builds(OutputLine, TIMES, FILES, st.sampled_from(["stdout", "stderr"]), TEXTS),
    st.builds(Fault, TIMES, FILES, st.sampled_from(list(FaultKind)), TEXTS),
    st.builds(Mark, TIMES, MARKS, st.one_of(NAMES, FILES)),
    st.builds(Request, TIMES, SERVICES, TYPES, st.integers(0, 3), SENDERS, st.integers(0, 2), VALUES),
    st.builds(Response, TIMES, SERVICES, TYPES, st.integers(0, 3), SENDERS, st.integers(0, 2), VALUES),
    st.builds(lambda t, e: GraphSnapshot(t, (), (), tuple(e)), TIMES, st.lists(SERVICE_ENDS, max_size=3)),
    st.builds(lambda t, e: GraphSnapshot(t, (), tuple(e)), TIMES, st.lists(ENDPOINTS, max_size=4)),
)


#: For checks that read the students' files.
SOURCES = {"fan_controller.py": "import rclpy\n", "velocity_publisher.py": "import rclpy\nrclpy.spin_once(None)\n"}


#: For checks that read the packages.
PACKAGES = (
    ExaminedPackage("own", "", (InstallFlaw(FlawKind.NO_SETUP, "package.xml", 3, ("setup.py\n", "\ud800")),)),
    ExaminedPackage("other", "other"),
)


def asked(check: Check, trace: Trace) -> Any:
    if reads_packages(check):
        return check.judge_packages(PACKAGES)
    try:
        return ask(check, trace, SOURCES)
    except HarnessError as error:
        return error.message


def test_every_check_is_tried_here() -> None:
    """A new check must join."""
    assert INSTANCES.keys() == known_checks().keys()
    for name, check in INSTANCES.items():
        assert type(check) is known_checks()[name]
        assert (type(check).__doc__ or "").strip()


def oddities(check: Check, trace: Trace) -> Iterator[str]:
    """Yield what is wrong with a finding."""
    finding = asked(check, trace)
    if isinstance(finding, str):
        return
    json.dumps(dict(finding.evidence))
    if not (isinstance(finding.credit, Fraction) and 0 <= finding.credit <= 1):
        yield f"credit {finding.credit!r}"
    if not finding.reason or "\n" in finding.reason + finding.hint:
        yield f"reason {finding.reason!r}, hint {finding.hint!r}"
    if finding.hint and finding.credit == 1:
        yield f"a hint with all points: {finding.hint!r}"
    if finding != asked(check, trace):
        yield "another finding the second time"


@pytest.mark.parametrize("check", INSTANCES.values(), ids=INSTANCES)
def test_findings_are_plain_and_steady(check: Check) -> None:
    """Credit between 0 and 1, one line of reason, evidence that is JSON, twice the same; of each recording."""
    traces = {name: rec.trace() for name, rec in TRACES.items()}
    assert [(name, odd) for name, trace in traces.items() for odd in oddities(check, trace)] == []
    assert any(not isinstance(asked(check, trace), str) for trace in traces.values())


@given(st.lists(OBSERVATIONS, max_size=25), st.sampled_from(list(ClockKind)), st.integers(0, 30 * NS_PER_S))
def test_no_recording_makes_a_check_raise(observations: list[Any], clock: ClockKind, stop_ns: int) -> None:
    """Whatever was observed, every check returns a finding or raises HarnessError."""
    trace = Trace("alone", clock, stop_ns, tuple(sorted(observations, key=lambda o: o.t_ns)))
    for check in INSTANCES.values():
        finding = asked(check, trace)
        assert isinstance(finding, str) or 0 <= finding.credit <= 1


@given(st.lists(OBSERVATIONS, max_size=25), st.integers(0, 30 * NS_PER_S))
@example([Message(0, "/temperature", "std_msgs/msg/Float64MultiArray", {"data": [1.0, 2.0]})], NS_PER_S)
def test_every_recording_gives_every_check_a_chart_that_a_page_can_hold_or_none(
    observations: list[Any], stop_ns: int
) -> None:
    """Whatever was observed: as JSON without NaN, of bounded size, with words for those who do not see it."""
    trace = Trace("alone", ClockKind.VIRTUAL, stop_ns, tuple(sorted(observations, key=lambda o: o.t_ns)))
    for check in INSTANCES.values():
        chart = chart_of(check, trace)
        if chart is not None:
            columns = Columns()
            json.dumps([figure_values(chart, columns), columns.lists], allow_nan=False)
            assert chart.title
            assert chart.about.endswith(".")
            assert 1 <= len(chart.panels) <= 9
            assert len(chart.cases) <= MOST_CASES
            assert chart == chart_of(check, trace)


@pytest.mark.parametrize("check", INSTANCES.values(), ids=INSTANCES)
def test_charts_are_drawn_of_what_nodes_did(check: Check) -> None:
    """Each point lies in the recording, each row exists, and each series has one text for a point or none."""
    charts = {name: chart_of(check, rec.trace()) for name, rec in TRACES.items()}
    panels = [(name, panel) for name, chart in charts.items() if chart for panel in chart.panels]
    for name, panel in panels:
        for series in panel.series:
            assert len(series.texts) in (0, len(series.points)), name
            assert not panel.lanes or all(0 <= y < len(panel.lanes) for _, y in series.points), name


def shifted(trace: Trace, by_ns: int) -> Trace:
    moved = tuple(replace(o, t_ns=o.t_ns + by_ns) for o in trace.observations)
    return replace(trace, stop_ns=trace.stop_ns + by_ns, observations=moved)


@given(st.sampled_from(sorted(TRACES)), st.sampled_from(sorted(INSTANCES)), st.integers(0, 100 * NS_PER_S))
def test_shifting_all_times_changes_no_credit(name: str, check: str, by_ns: int) -> None:
    """Everything is judged relative to what happened in the recording."""
    trace = TRACES[name].trace()
    here, there = asked(INSTANCES[check], trace), asked(INSTANCES[check], shifted(trace, by_ns))
    if isinstance(here, str) and not isinstance(there, str):
        assert check == "waits_gracefully"  # a longer silence may be long enough
    elif not isinstance(here, str):
        assert (here.credit, here.blocked_by) == (there.credit, there.blocked_by)
