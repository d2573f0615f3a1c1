"""Runs to keep as evidence, with nothing recorded: traces written by hand, and every trace there can be."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any

from hypothesis import strategies as st
from places import ROOT

from grader.grading.evidence.store import keep_run
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import Environment, Report, Reproduction
from grader.grading.model.run import Run
from grader.grading.reporting.json_report import dumps
from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.checkup import Property
from grader.runtime.model.submission import StudentFile, Submission
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    Delivery,
    Endpoint,
    Fault,
    FaultKind,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
    ServiceEnd,
    Start,
    StartWay,
)
from grader.runtime.recording.recording_file import encode

RUBRICS = ROOT / "rubrics"
TWIST = "geometry_msgs/msg/Twist"
PERIOD_NS = 50_000_000

_TIMES = st.integers(-(2**70), 2**70) | st.integers(0, 10**10)
_TEXTS = st.text(st.characters(), max_size=8) | st.sampled_from(["\ud800", "\0", "\x1b[31m", "\u2028", "*", "/cmd_vel"])
_TYPES = st.sampled_from(["std_msgs/msg/Float32", "std_msgs/msg/String", TWIST, "no/msg/Type", ""])
_NUMBERS = st.floats() | st.integers(-(2**63), 2**64) | st.booleans()
_FIELDS = st.recursive(
    _NUMBERS | _TEXTS,
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.sampled_from(["x", "data", "linear"]), inner),
    max_leaves=6,
)
_VALUES = st.dictionaries(st.sampled_from(["data", "linear", "float"]), _FIELDS, max_size=2).filter(
    # one field of that name and nothing else is how the codec writes what JSON cannot
    lambda value: value.keys() != {"float"}
)
_CDR = st.binary(max_size=12) | st.floats(width=32).map(lambda x: encode("std_msgs/msg/Float32", {"data": x}))
_ENDS = st.builds(
    Endpoint,
    *(_TEXTS, _TEXTS, _TEXTS, _TEXTS, st.integers(-1, 9), _TEXTS, _TEXTS, st.integers(0, 9)),
    lease_ns=st.integers(0, 2),
)


def _several(items: st.SearchStrategy[Any]) -> st.SearchStrategy[tuple[Any, ...]]:
    return st.lists(items, max_size=3).map(tuple)


#: Every kind of observation.
OBSERVATIONS: Mapping[type, st.SearchStrategy[Any]] = {
    Message: st.builds(Message, _TIMES, _TEXTS, _TYPES, _VALUES, _CDR, st.booleans()),
    Delivery: st.builds(Delivery, _TIMES, _TEXTS, _TYPES, _VALUES, _CDR),
    LogRecord: st.builds(LogRecord, _TIMES, _TEXTS, _TEXTS, _TEXTS, _TEXTS, _TEXTS, st.integers(0, 2**40)),
    OutputLine: st.builds(OutputLine, _TIMES, _TEXTS, _TEXTS, _TEXTS),
    Request: st.builds(Request, _TIMES, _TEXTS, _TYPES, st.integers(), _TEXTS, st.integers(), _VALUES, _CDR),
    Response: st.builds(Response, _TIMES, _TEXTS, _TYPES, st.integers(), _TEXTS, st.integers(), _VALUES, _CDR),
    GraphSnapshot: st.builds(
        GraphSnapshot,
        _TIMES,
        _several(_TEXTS),
        _several(_ENDS),
        _several(st.builds(ServiceEnd, _TEXTS, _TEXTS, _TEXTS, _TEXTS, st.sampled_from(["reliable", "best_effort"]))),
    ),
    Fault: st.builds(
        Fault,
        _TIMES,
        _TEXTS,
        st.sampled_from(FaultKind),
        _TEXTS,
        _TEXTS,
        st.integers(0, 2**40),
        _several(_TEXTS),
        st.none() | st.integers(-(2**70), 2**70),
        _TEXTS,
        st.none() | st.tuples(st.integers(0, 9), st.integers(0, 99)),
    ),
    Offer: st.builds(Offer, _TIMES, _TEXTS, _TEXTS, _TEXTS, _TEXTS),
    Mark: st.builds(Mark, _TIMES, _TEXTS, _TEXTS),
}
TRACES = st.builds(
    AssessedTrace,
    scenario=_TEXTS,
    clock=st.sampled_from(ClockKind),
    stop_ns=_TIMES,
    observations=st.lists(st.one_of(*OBSERVATIONS.values()), max_size=6).map(tuple),
    clock_reason=_TEXTS,
    notes=_several(_TEXTS),
    harness_problem=_TEXTS,
    suspected=st.booleans(),
    most_starved_ns=_TIMES,
    all_starved_ns=_TIMES,
    unchecked=_TEXTS,
    starts=_several(st.builds(Start, _TEXTS, _TEXTS, st.sampled_from(StartWay), _TEXTS, _several(_TEXTS))),
)


@cache
def velocity_exercise() -> Exercise:
    return read_rubric(RUBRICS / "exercise_1" / "rubric.yaml")


def twist_message(t_ns: int, forward: float = 0.5) -> Message:
    value = {"linear": {"x": forward, "y": 0.0, "z": 0.0}, "angular": {"x": 0.0, "y": 0.0, "z": 0.1}}
    return Message(t_ns, "/cmd_vel", TWIST, value, encode(TWIST, value))


def velocity_trace(forward: float = 0.5, rate_hz: int = 20) -> AssessedTrace:
    """A node that does what it should, or nearly."""
    end = Endpoint("publisher", "/cmd_vel", TWIST, "/node", 0, "reliable", "volatile", 10)
    observations: list[Observation] = [
        GraphSnapshot(0, ("/node",), (end,)),
        LogRecord(0, "velocity_publisher.py", "INFO", "node", "started", "velocity_publisher.py", 9),
        OutputLine(0, "velocity_publisher.py", "stdout", "hello"),
    ]
    observations += [twist_message(10**9 // rate_hz * i, forward) for i in range(10 * rate_hz)]
    return AssessedTrace("alone", ClockKind.VIRTUAL, 10**10, tuple(observations), notes=("a note",))


def velocity_run(trace: AssessedTrace | None = None, *, name: str = "ada", source: str = "import rclpy\n") -> Run:
    file = StudentFile("velocity_publisher.py", "velocity_publisher.py" if trace else None)
    return Run(
        submission=Submission(name, f"class/{name}", Path("nowhere"), "sha256:" + "a" * 64, {file.wanted: file}),
        traces={("velocity_publisher", "alone"): trace} if trace else {},
        sources={"velocity_publisher.py": source} if trace else {},
        environment=Environment(
            "0.1", "jazzy", "7.1", "rmw", "3.11", "bubblewrap", (Property("pids", True, "rlimit"),)
        ),
        seed=7,
        duration_s=1.2345678901234567,
        notes=("a note of the run",),
        reproduce=Reproduction(rubrics=(("velocity_publisher", velocity_exercise().digest),)),
    )


def kept_run(folder: Path, run: Run, exercise: Exercise | None = None) -> Report:
    """Keep a run, as grading does, and return its report."""
    exercises = [exercise or velocity_exercise()]
    report = judge_run(
        exercises, replace(run, reproduce=Reproduction(rubrics=((exercises[0].id, exercises[0].digest),)))
    )
    keep_run(folder, run, exercises, request={}, report=dumps(report).encode())
    return report
