"""Writes a run to a folder as evidence, and reads it back for judging without running anything."""

from __future__ import annotations

import json
import os
import shutil
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Any

import msgspec

from grader.grading.evidence import manifest as files
from grader.grading.evidence import manifest as kept
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import Environment, Reproduction
from grader.grading.model.run import Run
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import EvidenceError
from grader.runtime.model.limits import MAX_MANIFEST_BYTES, MAX_RECORDING_BYTES
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.submission import Submission
from grader.runtime.model.trace import AssessedTrace, ClockKind
from grader.runtime.recording.recording_file import place_of_trace, recording_bytes, trace_at, trace_of

#: How much of a digest messages show, including its prefix.
_SHOWN = len("sha256:") + 12
#: The root of a submission that will not be run.
_NOWHERE = Path()


@dataclass(frozen=True, slots=True)
class Evidence:
    """A folder of evidence whose manifest has been read."""

    folder: Path
    manifest: kept.Manifest

    @property
    def exercises(self) -> tuple[str, ...]:
        """Ids of the exercises that were graded, in the order of the report."""
        return tuple(exercise.id for exercise in self.manifest.exercises)


def check_place(folder: Path) -> None:
    """Check, before anything is run, that evidence can be written to a folder.

    Raises EvidenceError if it is not a folder, or has files of the same names that the grader did not write.
    """
    if folder.exists() and not folder.is_dir():
        raise EvidenceError(f"{folder}: expected a folder for the evidence, found a file", "name another folder")
    files.refuse_foreign(folder, (files.MANIFEST, files.REPORT), _own(folder))


def keep_run(
    folder: Path, run: Run, exercises: Sequence[Exercise], *, request: Mapping[str, Any], report: bytes
) -> None:
    """Write a run as evidence; files of an earlier run are replaced, other files are kept.

    The request for grading is not read by judging. Raises EvidenceError if a file cannot be written, or would replace
    one that the grader did not write.
    """
    written: dict[str, bytes] = {}
    recordings: dict[tuple[str, str], bytes] = {}
    for (exercise, scenario), trace in run.traces.items():
        name = files.recording_name(exercise, scenario)
        recording, metadata = recording_bytes(trace, _facts(run, exercise), Path(name).name, run.definitions)
        written[name] = recording
        written[files.metadata_name(exercise, scenario)] = metadata
        recordings[exercise, scenario] = recording
    written[files.REPORT] = report
    names = tuple(sorted({*written, files.MANIFEST}))
    old = _own(folder)
    files.refuse_foreign(folder, names, old)
    manifest = _manifest(run, exercises, recordings, request=request, names=names)
    unfinished = msgspec.structs.replace(manifest, complete=False, files=tuple(sorted({*names, *old})))
    files.write(folder, {files.MANIFEST: kept.dump_manifest(unfinished), **written})
    files.remove(folder, set(old) - set(names))
    files.write(folder, {files.MANIFEST: kept.dump_manifest(manifest)})


def carry_over(evidence: Evidence, into: Path, *, request: Mapping[str, Any], report: bytes) -> None:
    """Keep the recordings of evidence in a new folder, beside the request and report of judging them again.

    Files are linked where the disk allows it. Raises EvidenceError if one cannot be written.
    """
    made_anew = (files.MANIFEST, files.REPORT)
    names = [name for name in evidence.manifest.files if files.is_own(name) and name not in made_anew]
    try:
        for name in names:
            (into / name).parent.mkdir(parents=True, exist_ok=True)
            _link_or_copy(evidence.folder / name, into / name)
    except OSError as error:
        raise EvidenceError(f"{into}: the evidence cannot be written: {error.strerror or error}") from error
    run = msgspec.structs.replace(evidence.manifest.run, request=dict(request))
    manifest = msgspec.structs.replace(evidence.manifest, run=run)
    files.write(into, {files.REPORT: report, files.MANIFEST: kept.dump_manifest(manifest)})


def add_verification(folder: Path, result: bytes) -> None:
    """Add the result of recording the submission again to evidence, instead of an earlier one; raises EvidenceError."""
    manifest = open_evidence(folder).manifest
    files.refuse_foreign(folder, (files.VERIFICATION,), _own(folder))
    listed = msgspec.structs.replace(manifest, files=tuple(sorted({*manifest.files, files.VERIFICATION})))
    files.write(folder, {files.MANIFEST: kept.dump_manifest(listed)})
    files.write(folder, {files.VERIFICATION: result})


def _link_or_copy(old: Path, new: Path) -> None:
    try:
        new.hardlink_to(old)
    except OSError:
        shutil.copyfile(old, new, follow_symlinks=False)


def open_evidence(folder: Path) -> Evidence:
    """Open the evidence in a folder; raises EvidenceError if there is none, or it has another version or is damaged."""
    path = folder / files.MANIFEST
    data = files.read_file(path, MAX_MANIFEST_BYTES)
    try:
        manifest = kept.parse_manifest(data)
    except EvidenceError as error:
        raise EvidenceError(f"{path}: {error.message}", "grade the submission again") from error
    if not manifest.complete:
        raise EvidenceError(f"{path}: expected complete evidence, found unfinished evidence", "grade again")
    return Evidence(folder, manifest)


def run_of(evidence: Evidence, exercises: Sequence[Exercise], *, verify: bool = False) -> Run:
    """Read a run from evidence, as far as these exercises need it; raises EvidenceError for a changed recording.

    If the rubric has changed a scenario since then, its trace has a harness problem, which prevents judging. To verify
    is to write every recording again from the judged trace, and to compare it with the file.
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


def run_from(
    manifest: kept.Manifest, exercises: Sequence[Exercise], traces: Mapping[tuple[str, str], AssessedTrace]
) -> Run:
    """Build a run from a manifest and its traces, by exercise and scenario, for the exercises to judge now."""
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
        interfaces=manifest.interfaces.packages,
        offered=manifest.interfaces.offered,
        definitions=manifest.interfaces.definitions,
    )


def first_report(evidence: Evidence) -> Mapping[str, Any] | None:
    """Return the report that was made when the submission was graded; None if it is missing or invalid."""
    try:
        report = json.loads(files.read_file(evidence.folder / files.REPORT, MAX_MANIFEST_BYTES))
    except (EvidenceError, ValueError, RecursionError):
        return None
    return report if isinstance(report, dict) else None


def is_evidence(folder: Path) -> bool:
    """Return whether a folder has a manifest of evidence."""
    return (folder / files.MANIFEST).is_file()


def found_under(folder: Path) -> Sequence[Path]:
    """Return the folders of evidence in and below a folder, sorted by path, including those without their manifest."""
    found = []
    for root, inner, names in os.walk(folder):
        if files.MANIFEST in names or any(files.is_recording(Path(root, name)) for name in inner):
            found.append(Path(root))
            inner.clear()
    return sorted(found)


def _trace(
    evidence: Evidence, owner: kept.KeptExercise, recording: kept.KeptRecording, exercise: Exercise, *, verify: bool
) -> AssessedTrace:
    asked = next((kept.scenario_digest(s) for s in exercise.scenarios if s.id == recording.scenario), "")
    if asked != recording.asked:
        problem = f"the rubric has changed the scenario {recording.scenario} since it was recorded"
        return AssessedTrace(recording.scenario, ClockKind.VIRTUAL, 0, (), harness_problem=f"{problem}; grade again")
    name = files.recording_name(owner.id, recording.scenario)
    path = evidence.folder / name
    data = files.read_file(path, MAX_RECORDING_BYTES)
    try:
        found = kept.sha256(data)
        if found != recording.digest:
            kept_digest = recording.digest or "none"
            raise EvidenceError(f"expected the recording {kept_digest[:_SHOWN]}, found one of {found[:_SHOWN]}")
        if not verify:
            return trace_at(data, recording.at, recording.size)
        trace = trace_of(data)
        _compare(data, trace, evidence, owner, recording)
    except EvidenceError as error:
        raise EvidenceError(f"{path}: {error.message}", "the file was changed or damaged; grade again") from error
    return trace


def _compare(
    data: bytes, trace: AssessedTrace, evidence: Evidence, owner: kept.KeptExercise, recording: kept.KeptRecording
) -> None:
    """Raise EvidenceError if the messages of a recording differ from the trace that is judged."""
    facts = _kept_facts(evidence.manifest, owner)
    name = Path(files.recording_name(owner.id, trace.scenario)).name
    same = recording_bytes(trace, facts, name, evidence.manifest.interfaces.definitions)[0] == data
    if not same or place_of_trace(data) != (recording.at, recording.size):
        raise EvidenceError("expected a recording that shows what is judged, found one that shows something else")


def _own(folder: Path) -> tuple[str, ...]:
    """Return the files in a folder that an earlier run wrote, from its manifest; none without a manifest."""
    try:
        manifest = kept.parse_manifest(files.read_file(folder / files.MANIFEST, MAX_MANIFEST_BYTES))
    except EvidenceError:
        return ()
    return tuple(name for name in manifest.files if files.is_own(name))


def _facts(run: Run, exercise: str) -> dict[str, str]:
    """Return the information about the run for every recording, without values specific to one machine or run."""
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
        "recordings": recording,
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
            submission.packages,
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
        sources={name: str(text) for name, text in run.sources.items()},
        interfaces=kept.KeptInterfaces(run.interfaces, run.offered, dict(run.definitions)),
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
        packages=submission.packages,
    )
