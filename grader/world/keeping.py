"""Keeps what happened in a stepped run: a recording that Foxglove opens, and a page that plays it."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import asdict, replace
from fractions import Fraction
from pathlib import Path

from grader.app.grade import environment_of
from grader.core.exercise import Outcome
from grader.core.report import ExerciseReport, Report, Verdict
from grader.core.trace import ClockKind, Delivery, Message, Observation, Trace
from grader.execution.evidence.recording_file import recording_bytes
from grader.execution.serialization import fields_of
from grader.files import write_whole
from grader.judging.figures import playback
from grader.reporting.html.render import render_html
from grader.world.world import World

RECORDING, PAGE = "recording.mcap", "run.html"


def whole_trace(world: World) -> Trace:
    """Return what was observed in a world, with the fields of its messages."""
    trace = world.trace()
    return replace(trace, observations=tuple(map(_with_fields, trace.observations)))


def _with_fields(observation: Observation) -> Observation:
    if isinstance(observation, (Message, Delivery)):
        return replace(observation, value=fields_of(observation))
    return observation


def keep(world: World, folder: Path, why: str) -> Iterator[Path]:
    """Write the recording and the page of a world into a folder, and yield their paths.

    Args:
        world: The world; it is closed.
        folder: Exists.
        why: Why the test failed, in one line; empty if it did not.
    """
    trace = whole_trace(world)
    environment = environment_of(world.session)
    facts = {"format": "grader/test/v1", "seed": str(world.seed), "environment": json.dumps(asdict(environment))}
    recording, _ = recording_bytes(trace, facts, RECORDING)
    for name, data in ((RECORDING, recording), (PAGE, page_of(world, trace, why).encode())):
        write_whole(folder / name, data)
        yield folder / name


def page_of(world: World, trace: Trace, why: str) -> str:
    """Return the page that plays a run, in one file."""
    name = trace.scenario
    outcome, earned = (Outcome.NOT_MET, Fraction(0)) if why else (Outcome.MET, Fraction(1))
    verdict = Verdict("test", name, outcome, earned, Fraction(1), why or "the test has passed")
    played = replace(playback(trace, name, [program.name for program in world.programs]), criteria=("test",))
    exercise = ExerciseReport(
        id="test",
        number="",
        title=name,
        required=False,
        clock=ClockKind.VIRTUAL,
        clock_reason="",
        verdicts=(verdict,),
        notes=trace.notes,
        graph=world.graph(),
        figures=(played,),
    )
    report = Report(
        name=name,
        path="",
        digest="",
        environment=environment_of(world.session),
        seed=world.seed,
        exercises=(exercise,),
        duration_s=0.0,
    )
    return render_html(report)
