"""Finds the kept recordings that a run of the same submission would make again, so that they need no run."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from grader.grading.evidence.manifest import scenario_digest
from grader.grading.evidence.store import Evidence, run_of
from grader.grading.model.exercise import Exercise, recordings_in
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import AssessedTrace


@dataclass(frozen=True, slots=True)
class PlannedRun:
    """What determines the recordings of a submission besides the scenarios, on the same version of the grader."""

    submission: str  # digest of the submission
    seed: int
    recording: str  # digest of the recordings that are played; empty if there are none
    interfaces: str = ""  # digest of the interface packages of rubric and class; empty if there are none


def recorded_alike(evidence: Evidence, exercises: Sequence[Exercise], planned: PlannedRun) -> tuple[Exercise, ...]:
    """Return the exercises of which every scenario was recorded as a run would record it now.

    An exercise is used as a whole, because a spot check replaces all of its recordings together.
    """
    manifest = evidence.manifest
    recorded = (manifest.submission.digest, manifest.run.seed, manifest.interfaces.offered)
    if recorded != (planned.submission, planned.seed, planned.interfaces):
        return ()
    found = {file.wanted for file in manifest.submission.files}
    asked = {e.id: {r.scenario: r.asked for r in e.recordings} for e in manifest.exercises}
    return tuple(
        exercise
        for exercise in exercises
        if exercise.id in asked
        and found.issuperset(exercise.files)
        and all(asked[exercise.id].get(s.id) == scenario_digest(s) for s in exercise.scenarios)
        and (manifest.run.recording == planned.recording or not recordings_in(exercise))
    )


def kept_traces(evidence: Evidence, exercises: Sequence[Exercise]) -> Mapping[tuple[str, str], AssessedTrace]:
    """Read the recordings of these exercises; raises EvidenceError for a changed or damaged one."""
    wanted = {(exercise.id, scenario.id) for exercise in exercises for scenario in exercise.scenarios}
    return {key: trace for key, trace in run_of(evidence, exercises).traces.items() if key in wanted}
