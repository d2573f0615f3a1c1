"""Keeps a run as evidence in a folder, and reads it back: the recordings are what judging takes, nothing is run."""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec

from grader.core.errors import EvidenceError
from grader.core.exercise import Exercise
from grader.core.report import Environment, Reproduction
from grader.core.scenario import Scenario
from grader.core.submission import Run, Submission
from grader.core.trace import ClockKind, Trace
from grader.execution.evidence import manifest as files
from grader.execution.evidence import manifest as kept
from grader.execution.evidence.recording_file import place_of_trace, recording_bytes, trace_at, trace_of

#: A longer recording is none that the grader wrote.
MOST_BYTES = 512 << 20
#: Digits of a digest that a message shows, with what comes before them.
_SHOWN = len("sha256:") + 12
#: Where a submission lies that nobody will run.
_NOWHERE = Path()


@dataclass(frozen=True, slots=True)
class Evidence:
    """A folder of evidence whose manifest has been read.

    Attributes:
        folder: Where it lies.
        manifest: What it says of itself.
    """

    folder: Path
    manifest: kept.Manifest

    @property
    def exercises(self) -> tuple[str, ...]:
        """Ids of the exercises that were graded, in the order of the report."""
        return tuple(exercise.id for exercise in self.manifest.exercises)


def check_place(folder: Path) -> None:
    """Make sure, before anything is run, that evidence may be kept in a folder.

    Raises:
        EvidenceError: It is no folder, or holds files under our names that are not ours.
    """
    if folder.exists() and not folder.is_dir():
        raise EvidenceError(f"{folder}: expected a folder for the evidence, found a file", "name another folder")
    files.refuse_foreign(folder, (files.MANIFEST, files.REPORT), _own(folder))


def keep(folder: Path, run: Run, exercises: Sequence[Exercise], *, request: Mapping[str, Any], report: bytes) -> None:
    """Write a run as evidence; what an earlier run left there is replaced, what others put there stays.

    Args:
        folder: Created if it is not there.
        run: What was recorded.
        exercises: What was asked.
        request: How grading was asked for, as JSON values; holds nothing that judging reads.
        report: The report as JSON.

    Raises:
        EvidenceError: A file cannot be written, or is not ours to replace.
    """
    written: dict[str, bytes] = {}
    recordings: dict[tuple[str, str], bytes] = {}
    for (exercise, scenario), trace in run.traces.items():
        name = files.recording_name(exercise, scenario)
        recording, metadata = recording_bytes(trace, _facts(run, exercise), Path(name).name)
        written[name] = recording
        written[files.metadata_name(exercise, scenario)] = metadata
        recordings[exercise, scenario] = recording
    written[files.REPORT] = report
    names = tuple(sorted({*written, files.MANIFEST}))
    old = _own(folder)
    files.refuse_foreign(folder, names, old)
    manifest = _manifest(run, exercises, recordings, request=request, names=names)
    unfinished = msgspec.structs.replace(manifest, complete=False, files=tuple(sorted({*names, *old})))
    files.write(folder, {files.MANIFEST: kept.dump(unfinished), **written})
    files.remove(folder, set(old) - set(names))
    files.write(folder, {files.MANIFEST: kept.dump(manifest)})


def open_evidence(folder: Path) -> Evidence:
    """Return the evidence that lies in a folder.

    Raises:
        EvidenceError: There is none, it is of another version, damaged, or was not finished.
    """
    path = folder / files.MANIFEST
    data = files.read(path, kept.MOST_BYTES)
    try:
        manifest = kept.parse(data)
    except EvidenceError as error:
        raise EvidenceError(f"{path}: {error.message}", "grade the submission again") from error
    if not manifest.complete:
        raise EvidenceError(f"{path}: expected complete evidence, found some that was not finished", "grade again")
    return Evidence(folder, manifest)


def run_of(evidence: Evidence, exercises: Sequence[Exercise], *, verify: bool = False) -> Run:
    """Return the run that evidence holds, as far as these exercises ask for it.

    A scenario that the rubric describes in another way now has a trace that says so and forbids judging.

    Args:
        evidence: Where it lies.
        exercises: What is asked now.
        verify: Whether every recording is written again from what is judged, and compared with what it shows.

    Raises:
        EvidenceError: A recording is missing or is not the one that was kept.
    """
    manifest = evidence.manifest
    wanted = {e.id: e for e in exercises}
    traces = {
        (exercise.id, recording.scenario): _trace(evidence, exercise, recording, wanted[exercise.id], verify=verify)
        for exercise in manifest.exercises
        if exercise.id in wanted
        for recording in exercise.recordings
        if recording.digest is not None
    }
    return run_from(manifest, exercises, traces)


def run_from(manifest: kept.Manifest, exercises: Sequence[Exercise], traces: Mapping[tuple[str, str], Trace]) -> Run:
    """Return the run that a manifest tells of.

    Args:
        manifest: What was handed in, and with what it was recorded.
        exercises: What is asked now.
        traces: What was recorded, by exercise and scenario.
    """
    return Run(
        submission=_submission(manifest),
        traces=traces,
        sources=manifest.sources,
        environment=manifest.environment,
        seed=manifest.run.seed,
        duration_s=manifest.run.duration_s,
        notes=manifest.run.notes,
        reproduce=Reproduction(
            rubrics=tuple((exercise.id, exercise.digest) for exercise in exercises), recording=manifest.run.recording
        ),
    )


def first_report(evidence: Evidence) -> Mapping[str, Any] | None:
    """Return the report that was made when the submission was graded; None if it is gone or no report."""
    try:
        report = json.loads(files.read(evidence.folder / files.REPORT, kept.MOST_BYTES))
    except (EvidenceError, ValueError, RecursionError):
        return None
    return report if isinstance(report, dict) else None


def is_evidence(folder: Path) -> bool:
    """Return whether a folder says that it holds evidence."""
    return (folder / files.MANIFEST).is_file()


def found_under(folder: Path) -> Sequence[Path]:
    """Return the folders of evidence in and below a folder, sorted by path; also those that lost their manifest."""
    found = []
    for root, inner, names in os.walk(folder):
        if files.MANIFEST in names or any(files.is_recording(Path(root, name)) for name in inner):
            found.append(Path(root))
            inner.clear()
    return sorted(found)


def _trace(
    evidence: Evidence, owner: kept.KeptExercise, recording: kept.KeptRecording, exercise: Exercise, *, verify: bool
) -> Trace:
    asked = next((kept.scenario_digest(s) for s in exercise.scenarios if s.id == recording.scenario), "")
    if asked != recording.asked:
        problem = f"the rubric describes the scenario {recording.scenario} otherwise than when it was recorded"
        return Trace(recording.scenario, ClockKind.VIRTUAL, 0, (), harness_problem=f"{problem}; grade again")
    name = files.recording_name(owner.id, recording.scenario)
    path = evidence.folder / name
    data = files.read(path, MOST_BYTES)
    try:
        found = kept.sha256(data)
        if found != recording.digest:
            kept_digest = recording.digest or "none"
            raise EvidenceError(f"expected the recording {kept_digest[:_SHOWN]}, found one of {found[:_SHOWN]}")
        if not verify:
            return trace_at(data, recording.at, recording.size)
        trace = trace_of(data, wire=True)
        _compare(data, trace, evidence, owner, recording)
    except EvidenceError as error:
        raise EvidenceError(f"{path}: {error.message}", "the file was changed or damaged; grade again") from error
    return trace


def _compare(
    data: bytes, trace: Trace, evidence: Evidence, owner: kept.KeptExercise, recording: kept.KeptRecording
) -> None:
    """Raise EvidenceError if a recording shows anything else than what is judged."""
    facts = _kept_facts(evidence.manifest, owner)
    name = Path(files.recording_name(owner.id, trace.scenario)).name
    same = recording_bytes(trace, facts, name)[0] == data
    if not same or place_of_trace(data) != (recording.at, recording.size):
        raise EvidenceError("expected a recording that shows what is judged, found one that shows something else")


def _own(folder: Path) -> tuple[str, ...]:
    """Return the files in a folder that an earlier run wrote, by its manifest; none if there is no such manifest."""
    try:
        manifest = kept.parse(files.read(folder / files.MANIFEST, kept.MOST_BYTES))
    except EvidenceError:
        return ()
    return tuple(name for name in manifest.files if files.is_own(name))


def _facts(run: Run, exercise: str) -> dict[str, str]:
    """Return what every recording says of the run; nothing that only one machine or one run has."""
    rubrics = dict(run.reproduce.rubrics)
    return _as_facts(
        exercise, run.submission.digest, rubrics.get(exercise, ""), run.seed, run.reproduce.recording, run.environment
    )


def _kept_facts(manifest: kept.Manifest, owner: kept.KeptExercise) -> dict[str, str]:
    run, environment = manifest.run, manifest.environment
    return _as_facts(owner.id, manifest.submission.digest, owner.rubric, run.seed, run.recording, environment)


def _as_facts(  # noqa: PLR0913  each comes from another place
    exercise: str, submission: str, rubric: str, seed: int, recording: str, environment: Environment
) -> dict[str, str]:
    return {
        "format": kept.FORMAT,
        "exercise": exercise,
        "submission": submission,
        "rubric": rubric,
        "seed": str(seed),
        "odometry": recording,
        "environment": json.dumps(asdict(environment)),
    }


def _manifest(
    run: Run,
    exercises: Sequence[Exercise],
    recordings: Mapping[tuple[str, str], bytes],
    *,
    request: Mapping[str, Any],
    names: tuple[str, ...],
) -> kept.Manifest:
    submission = run.submission
    return kept.Manifest(
        format=kept.FORMAT,
        complete=True,
        files=names,
        submission=kept.KeptSubmission(
            submission.name,
            submission.digest,
            tuple(submission.files.values()),
            submission.notes,
        ),
        run=kept.KeptRun(submission.path, run.seed, run.duration_s, run.notes, run.reproduce.recording, dict(request)),
        environment=run.environment,
        exercises=tuple(
            kept.KeptExercise(
                e.id,
                e.digest,
                tuple(_kept(s, recordings.get((e.id, s.id))) for s in e.scenarios),
            )
            for e in exercises
        ),
        sources=dict(run.sources),
    )


def _kept(scenario: Scenario, recording: bytes | None) -> kept.KeptRecording:
    asked = kept.scenario_digest(scenario)
    if recording is None:
        return kept.KeptRecording(scenario.id, asked)
    return kept.KeptRecording(scenario.id, asked, kept.sha256(recording), *place_of_trace(recording))


def _submission(manifest: kept.Manifest) -> Submission:
    submission = manifest.submission
    return Submission(
        name=submission.name,
        path=manifest.run.path,
        root=_NOWHERE,
        digest=submission.digest,
        files={file.wanted: file for file in submission.files},
        notes=submission.notes,
    )
