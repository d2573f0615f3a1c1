"""The recordings of the test submissions, an archive a collection: what judging needs of each, and its report."""

from __future__ import annotations

import io
import tarfile
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from sample_folders import ARCHIVE, collections

from grader.grading.app.request import command_words, request_of
from grader.grading.evidence import manifest as kept
from grader.grading.evidence.store import run_from
from grader.grading.judging.judge_run import judge_run
from grader.grading.model.chart import Chart, Panel, Series
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import Report
from grader.grading.rubrics.builtin import builtin_exercises
from grader.runtime.recording.packed import unpack_trace
from grader.runtime.recording.recording_file import packed_trace

#: The seed of all recordings and golden texts.
SEED = 1
MANIFEST, REPORT, TRACE_ENDING = "evidence.json", "report.json", ".trace.json"


@dataclass(frozen=True, slots=True)
class Recorded:
    """What was recorded of one submission.

    Attributes:
        manifest: The manifest of its evidence, as JSON.
        report: The report, as JSON.
        traces: Packed traces by `EXERCISE.SCENARIO`.
    """

    manifest: bytes
    report: bytes
    traces: Mapping[str, bytes]


@cache
def recordings() -> dict[str, Recorded]:
    """Return what was recorded of all test submissions, by name."""
    return {name: one for collection in collections() for name, one in recorded_of(collection).items()}


@cache
def recorded_of(collection: Path) -> dict[str, Recorded]:
    """Return what was recorded of a collection, by name; empty before it ever was."""
    path = collection / ARCHIVE
    return read_archive(path) if path.exists() else {}


def read_archive(path: Path) -> dict[str, Recorded]:
    """Return what an archive holds, by folder."""
    files: dict[str, dict[str, bytes]] = {}
    with tarfile.open(path, "r:xz") as archive:
        for member in archive:
            folder, _, name = member.name.rpartition("/")
            stream = archive.extractfile(member)
            assert stream is not None
            files.setdefault(folder, {})[name] = stream.read()
    return {folder: _recorded(found) for folder, found in files.items()}


def _recorded(files: dict[str, bytes]) -> Recorded:
    traces = {n.removesuffix(TRACE_ENDING): data for n, data in files.items() if n.endswith(TRACE_ENDING)}
    return Recorded(files[MANIFEST], files[REPORT], traces)


def recorded_in(folder: Path) -> Recorded:
    """Return what evidence in a folder holds of a recording."""
    files = {MANIFEST: (folder / MANIFEST).read_bytes(), REPORT: (folder / REPORT).read_bytes()}
    for recording in folder.glob("*/*.mcap"):
        files[f"{recording.parent.name}{TRACE_ENDING}"] = packed_trace(recording.read_bytes())
    return _recorded(files)


def write_archive(recorded: Mapping[str, Recorded], path: Path) -> None:
    """Write what was recorded; the same recordings give the same bytes, and like ones are packed side by side."""
    with tarfile.open(path, "w:xz", preset=9, format=tarfile.PAX_FORMAT) as archive:
        members: list[tuple[tuple[str, ...], str, str, bytes]] = [
            (name.partition(".")[::-1], folder, f"{name}{TRACE_ENDING}", data)
            for folder, one in recorded.items()
            for name, data in one.traces.items()
        ]
        for folder, one in recorded.items():
            members += [(("", ""), folder, MANIFEST, one.manifest), (("", ""), folder, REPORT, one.report)]
        for _, folder, name, data in sorted(members):
            member = tarfile.TarInfo(f"{folder}/{name}")
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))


def exercises_by_id() -> dict[str, Exercise]:
    """Return the built-in exercises by id."""
    return {exercise.id: exercise for exercise in builtin_exercises()}


def outdated(recorded: Recorded) -> list[str]:
    """Return the scenarios that the rubrics describe otherwise than when they were recorded."""
    exercises = exercises_by_id()
    return [
        f"{exercise.id}.{recording.scenario}"
        for exercise in kept.parse_manifest(recorded.manifest).exercises
        for recording in exercise.recordings
        if recording.asked
        not in [kept.scenario_digest(s) for s in exercises[exercise.id].scenarios if s.id == recording.scenario]
    ]


def judged(recorded: Recorded, known: Mapping[str, Exercise] | None = None) -> Report:
    """Judge a recording as `grade rejudge` does, by the built-in exercises or by others, by id."""
    manifest = kept.parse_manifest(recorded.manifest)
    exercises = [(known or exercises_by_id())[exercise.id] for exercise in manifest.exercises]
    traces = {
        (exercise.id, recording.scenario): unpack_trace(recorded.traces[f"{exercise.id}.{recording.scenario}"])
        for exercise in manifest.exercises
        for recording in exercise.recordings
        if recording.digest is not None
    }
    run = run_from(manifest, exercises, traces)
    request = request_of(manifest.run.request, submission=manifest.run.path, seed=manifest.run.seed, rubrics=())
    again = replace(run.reproduce, command=command_words(request, manifest.run.seed))
    return judge_run(exercises, replace(run, reproduce=again))


def outcomes(report: Report) -> dict[str, str]:
    """Return the outcome of every criterion that is not met."""
    verdicts = [verdict for exercise in report.exercises for verdict in exercise.verdicts]
    return {v.id: v.outcome.value for v in verdicts if v.outcome.value != "met"}


def charted(report: Report) -> list[dict[str, Any]]:
    """Return what each chart shows: its words, its panels with their series, and its cases."""
    charts = [f for exercise in report.exercises for f in exercise.figures if isinstance(f, Chart)]
    return [
        {
            "title": chart.title,
            "criteria": " ".join(chart.criteria),
            "about": chart.about,
            "panels": [_panel(panel) for panel in chart.panels],
        }
        | (
            {"cases": [f"{c.start:g} to {c.stop:g} {c.tone.value}: {c.label}" for c in chart.cases]}
            if chart.cases
            else {}
        )
        for chart in charts
    ]


def _panel(panel: Panel) -> str:
    name = f"{panel.title} ({panel.unit})" if panel.unit else panel.title
    parts = [f"{s.tone.value} {s.look.value} {s.name!r} {len(s.points)} {_ends(s)}" for s in panel.series]
    parts += [f"band {b.low:g} to {b.high:g}" for b in panel.bands] + [f"level {v.value:g}" for v in panel.levels]
    return f"{name}: {'; '.join(parts)}" + (f"; rows {', '.join(panel.lanes)}" if panel.lanes else "")


def _ends(series: Series) -> str:
    (first, low), (last, high) = series.points[0], series.points[-1]
    return f"from ({first:.5g}, {low:.5g}) to ({last:.5g}, {high:.5g})"


def told(report: Report) -> dict[str, dict[str, str]]:
    """Return reason, hint and place of every criterion that lost points by a fault of its own, or was not decided."""
    return {
        verdict.id: {
            "reason": verdict.reason,
            "hint": verdict.hint,
            "at": f"{verdict.location.file}:{verdict.location.line}" if verdict.location else "",
        }
        for exercise in report.exercises
        for verdict in exercise.verdicts
        if verdict.outcome.value in ("not_met", "partly") or (verdict.outcome.value == "undecided" and verdict.hint)
    }
