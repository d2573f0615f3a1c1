"""Writes recordings to disk as evidence, with the report that was made from them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from grader.app.request import GradeRequest
from grader.core.exercise import Drawn, Exercise
from grader.core.report import Report
from grader.core.submission import Run
from grader.execution.evidence.store import check_place, keep
from grader.reporting.json_report import dumps
from grader.rubrics.variants import Recorded


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
        if self._recorded is None or not self._folders:
            return
        run, exercises = self._recorded
        for folder in self._folders:
            asked = request_to_json(self._request, exercises)
            keep(folder, run, exercises, request=asked, report=dumps(report).encode())


def request_to_json(request: GradeRequest, exercises: Sequence[Exercise] = ()) -> dict[str, Any]:
    """Convert to JSON what reproduces a report besides path, seed and rubrics, and add the variant values."""
    return {
        "exercises": list(request.exercises),
        "odom_bag": None if request.odom_bag is None else str(request.odom_bag),
        "clock": request.clock,
        "isolation": request.isolation,
        "student": request.student,
        "variant_key": None if request.variant_key is None else str(request.variant_key),
        "variants": {e.id: dict(e.variant.values) for e in exercises if e.variant is not None},
    }


def request_of(data: dict[str, Any], *, submission: str, seed: int, rubrics: tuple[Path, ...]) -> GradeRequest:
    """Return the request that would record a kept run again and judge it by these rubrics."""
    bag, key, student = data.get("odom_bag"), data.get("variant_key"), str(data.get("student", ""))
    return GradeRequest(
        submission=submission,
        exercises=tuple(str(id_) for id_ in data.get("exercises", ())),
        rubrics=rubrics,
        seed=seed,
        odom_bag=Path(str(bag)) if bag is not None else None,
        clock=str(data.get("clock", "auto")),
        isolation=str(data.get("isolation", "auto")),
        student=student,
        variant_key=None if key is None else Path(str(key)),
        draw=Recorded(Drawn(student, data.get("variants", {}))),
    )
