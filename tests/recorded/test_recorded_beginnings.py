"""What was recorded of each correct submission, as a real clock would have shown its beginning: nothing is lost."""

from __future__ import annotations

import random
from collections import Counter
from collections.abc import Iterator
from dataclasses import replace

import pytest
from archive import Recorded, exercises_by_id, recordings
from sample_folders import expected

from grader.grading.evidence import manifest as kept
from grader.grading.evidence.store import run_from
from grader.grading.judging.agreement import observation_start
from grader.grading.judging.beginnings import CUTS_NS, BeginningJudge, Comparison, cut
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.trace import (
    AssessedTrace,
    ClockKind,
    LogRecord,
    Message,
    Observation,
    OutputLine,
    Request,
    Response,
)
from grader.runtime.recording.packed import unpack_trace

#: How late what a node does is noticed at most, and how long messages are lost at the start.
LATE_NS, LOST_NS = 25 * NS_PER_MS, 300 * NS_PER_MS


def scenarios(recorded: Recorded) -> Iterator[tuple[str, BeginningJudge, AssessedTrace, str]]:
    """Yield what was recorded in virtual time: its name, its judge, the trace, and the topic that it begins with."""
    manifest = kept.parse_manifest(recorded.manifest)
    exercises = [exercises_by_id()[exercise.id] for exercise in manifest.exercises]
    traces = {
        (exercise.id, recording.scenario): unpack_trace(recorded.traces[f"{exercise.id}.{recording.scenario}"])
        for exercise in manifest.exercises
        for recording in exercise.recordings
        if recording.digest is not None
    }
    run = run_from(manifest, exercises, traces)
    for exercise in exercises:
        for scenario in exercise.scenarios:
            trace = traces.get((exercise.id, scenario.id))
            if trace is not None and trace.clock is ClockKind.VIRTUAL:
                judge = BeginningJudge(exercise, scenario.id, run.submission, run.sources)
                yield f"{exercise.id} {scenario.id}", judge, trace, scenario.span.after_first_message_on or ""


def begins_ns(trace: AssessedTrace, first_message_on: str) -> int:
    """Return when the program has something to do."""
    given = [mark.t_ns for name in ("stream_starts", "server_starts") for mark in trace.marks(name)]
    given += [request.t_ns for request in trace.of(Request) if request.sender == "grader"]
    return observation_start(trace, first_message_on) if first_message_on else min(given, default=0)


def on_a_real_clock(trace: AssessedTrace, seed: int) -> AssessedTrace:
    """Return a recording with jitter, without the messages that were sent before anybody could hear them."""
    chance = random.Random(seed)
    lost_ns = LOST_NS if seed % 2 else 0
    first_ns: dict[str, int] = {}
    late_ns: dict[int, int] = {}  # what a callback does at one instant is late together
    seen: list[Observation] = []
    for one in trace.observations:
        if isinstance(one, Message) and one.t_ns < first_ns.setdefault(one.topic, one.t_ns) + lost_ns:
            continue
        late = late_ns.setdefault(one.t_ns, round(chance.uniform(0, LATE_NS))) if by_node(one) else 0
        seen.append(replace(one, t_ns=one.t_ns + late))
    return replace(trace, clock=ClockKind.WALL, observations=tuple(sorted(seen, key=lambda one: one.t_ns)))


def by_node(one: Observation) -> bool:
    """Return whether a node did it, and not the grader."""
    sent = isinstance(one, (Request, Response)) and one.sender == "student"
    return sent or isinstance(one, (Message, LogRecord, OutputLine))


@pytest.mark.nightly
def test_no_correct_submission_loses_a_criterion_to_a_real_clock() -> None:
    """With jitter, and with and without lost messages; and nearly every criterion can be judged from a beginning."""
    lost: list[str] = []
    criteria: Counter[str] = Counter()
    for folder in (folder for folder in expected() if folder.startswith("correct/")):
        for name, judge, trace, first_message_on in scenarios(recordings()[folder]):
            length_ns = judge.length_ns(trace, begins_ns(trace, first_message_on))
            begin_ns = begins_ns(trace, first_message_on)
            for seed in range(2):
                wall = on_a_real_clock(trace, seed)
                start_ns = observation_start(trace, first_message_on), observation_start(wall, first_message_on)
                stop_ns = start_ns[1] + begin_ns - start_ns[0] + length_ns
                found = judge.compare(trace, cut(wall, stop_ns), start_ns)
                lost += [f"{folder} {name}: {found}"] if found != Comparison() else []
            parts = [(cut(trace, begin_ns + length_ns - cut_ns),) * 2 for cut_ns in CUTS_NS]
            for whole, part in judge._criteria:
                earned = judge._credit(whole, trace)
                criteria["met"] += bool(earned)
                criteria["judged"] += bool(earned and list(judge._judged(part, earned, parts)))
    assert lost == []
    assert criteria["judged"] >= 0.98 * criteria["met"], criteria
