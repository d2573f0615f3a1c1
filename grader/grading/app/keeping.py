"""Keeps the recordings of a run as evidence, once its report has been delivered."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

from grader.grading.app.request import GradeRequest, request_to_json
from grader.grading.evidence.store import check_place, keep_run
from grader.grading.model.exercise import Exercise
from grader.grading.model.report import Report
from grader.grading.model.run import Run
from grader.grading.reporting.json_report import dumps
from grader.grading.rubrics.builtin import exercise_ids


class EvidenceWriter:
    """Remembers a run while it is graded, and writes it after its report has been delivered.

    The folders are checked right away, because grading takes long; raises EvidenceError if one cannot be written to.
    """

    def __init__(self, folders: Sequence[Path], request: GradeRequest) -> None:
        for folder in folders:
            check_place(folder)
        self._folders = folders
        self._request = request
        self._recorded: tuple[Run, Sequence[Exercise]] | None = None

    def remember(self, run: Run, exercises: Sequence[Exercise]) -> None:
        """Remember a complete run and the exercises it was recorded for."""
        self._recorded = (run, exercises)

    def write(self, report: Report) -> None:
        """Write the run and its report; raises EvidenceError if that fails."""
        if self._recorded is None:
            return
        run, exercises = self._recorded
        run = replace(run, duration_s=report.duration_s)
        for folder in self._folders:
            ids = exercise_ids(self._request.exercises, exercises)
            asked = request_to_json(replace(self._request, exercises=ids), exercises)
            keep_run(folder, run, exercises, request=asked, report=dumps(report).encode())
