"""Keeps what happened in a stepped run: a recording that Foxglove opens, and a page that plays it."""

from __future__ import annotations

import json
import linecache
from collections.abc import Mapping
from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

from grader.grading.app.grade import environment_of
from grader.grading.judging.figures import excerpt_around
from grader.grading.judging.figures_of_test import played_test, shown_steps, value_charts
from grader.grading.model.chart import Excerpt
from grader.grading.model.exercise import Location
from grader.grading.model.tested_run import SideOfTest
from grader.grading.reporting.escape import json_value
from grader.grading.reporting.html.render import render_run
from grader.runtime.files import write_whole
from grader.runtime.model.trace import AssessedTrace, Delivery, Fault, LogRecord, Message, Observation, OutputLine
from grader.runtime.recording.recording_file import recording_bytes
from grader.runtime.serialization import carried_fields
from grader.runtime.session import RecordingSession

RECORDING, PAGE, FAILURE = "recording.mcap", "run.html", "failure.json"
#: What `failure.json` is written in; `failure.schema.json` beside this module describes it.
FORMAT = "grader/failed-test/v1"


def keep(  # noqa: PLR0913 - what a page shows
    session: RecordingSession, trace: AssessedTrace, seed: int | None, folder: Path, why: str, test: SideOfTest
) -> list[Path]:
    """Write the recording and the page of a run into a folder, and return their paths.

    Args:
        session: What it ran in.
        trace: What was observed.
        seed: What was drawn follows from it; None if nothing was.
        folder: Exists.
        why: Why the test failed, in one line; empty if it did not.
        test: What the test itself did.
    """
    trace = _whole(trace)
    facts = {
        "format": "grader/test/v1",
        "seed": "" if seed is None else str(seed),
        "environment": json.dumps(asdict(environment_of(session))),
    }
    recording, _ = recording_bytes(trace, facts, RECORDING)
    page = page_of(session, trace, seed, why, test)
    for name, data in ((RECORDING, recording), (PAGE, page.encode())):
        write_whole(folder / name, data)
    return [folder / RECORDING, folder / PAGE]


def keep_failure(folder: Path, facts: Mapping[str, Any]) -> Path:
    """Write what is known of a failed test as JSON into a folder, and return its path."""
    data = json_value({"schema": FORMAT, **facts})
    write_whole(folder / FAILURE, json.dumps(data, indent=2, allow_nan=False).encode() + b"\n")
    return folder / FAILURE


def page_of(session: RecordingSession, trace: AssessedTrace, seed: int | None, why: str, test: SideOfTest) -> str:
    """Return the page that plays a run, in one file; the arguments are those of `keep`."""
    environment = environment_of(session)
    facts = {} if seed is None else {"seed": str(seed)}
    facts |= {"ROS": f"rclpy {environment.rclpy} ({environment.ros_distro})", "Python": environment.python}
    processes = {o.process: None for o in trace.observations if isinstance(o, (LogRecord, OutputLine, Fault))}
    test, whole = _with_text(test), _whole(trace)
    run = played_test(whole, test, [*processes])
    failing = "" if test.failed_at is None else linecache.getline(*test.failed_at).strip()
    charts, steps = value_charts(whole, test), shown_steps(test, failing)
    return render_run(trace.scenario, why, run, facts, charts, steps, test.omitted, _excerpts(test))


def _with_text(test: SideOfTest) -> SideOfTest:
    """Return what a test did with the lines of its calls."""
    calls = (replace(call, text=linecache.getline(call.file, call.line).strip()) for call in test.calls)
    return replace(test, calls=tuple(calls))


def _excerpts(test: SideOfTest) -> list[Excerpt]:
    """Return the source around the line at which the test failed, and around those at which programs did."""
    places = [*([test.failed_at] if test.failed_at else []), *test.faults_at]
    found = (
        excerpt_around(Location(Path(file).name, line), [text.rstrip("\n") for text in linecache.getlines(file)])
        for file, line in dict.fromkeys(places)
    )
    return [excerpt for excerpt in found if excerpt is not None]


def _whole(trace: AssessedTrace) -> AssessedTrace:
    """Return a trace with the fields of its messages."""
    return replace(trace, observations=tuple(map(_with_fields, trace.observations)))


def _with_fields(observation: Observation) -> Observation:
    if isinstance(observation, (Message, Delivery)):
        return replace(observation, value=carried_fields(observation))
    return observation
