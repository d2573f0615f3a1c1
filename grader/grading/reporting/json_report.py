"""The report as JSON, version 1, for other programs."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from dataclasses import asdict
from fractions import Fraction
from typing import Any, NotRequired, TypedDict

from grader.grading.model.exercise import Problem
from grader.grading.model.report import SCHEMA, ExerciseReport, JsonObject, Report, ReportedFault, Verdict
from grader.grading.reporting.escape import json_value, shell_line
from grader.runtime.model.checkup import isolation_line
from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import Start

# Legal inside a JSON string, but a terminal may interpret them: C1 controls, and characters that reorder or hide text.
_OBEYED_BY_TERMINALS = re.compile("[\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\U000e0000-\U000e007f]")


class CriterionData(TypedDict):
    """A criterion of a JSON report."""

    id: str
    title: str
    outcome: str
    score: float
    max_score: float
    reason: str
    hint: str | None
    location: JsonObject | None
    evidence: Mapping[str, Any]
    blocked_by: NotRequired[str]
    same_cause_as: NotRequired[str]
    problem: NotRequired[JsonObject]


class FaultData(TypedDict):
    """A fault in a JSON report."""

    kind: str
    file: str
    line: int
    text: str
    t_s: float


class ExerciseData(TypedDict):
    """An exercise of a JSON report."""

    id: str
    number: str
    title: str
    required: bool
    score: float
    max_score: float
    clock: str
    clock_reason: str | None
    criteria: list[CriterionData]
    faults: list[FaultData]
    notes: list[str]
    starts: NotRequired[list[JsonObject]]
    unchecked: NotRequired[str]
    variant: NotRequired[JsonObject]


class ReportData(TypedDict):
    """A JSON report, as written here and as read back."""

    schema: str
    submission: JsonObject
    environment: JsonObject
    score: float
    max_score: float
    final: bool
    duration_s: float
    exercises: list[ExerciseData]
    reproduce: JsonObject
    interfaces: NotRequired[list[JsonObject]]


def report_to_json(report: Report) -> ReportData:
    """Return a report as plain JSON values, keys in the order of the format; scores and durations have six decimals."""
    environment = report.environment
    values: ReportData = json_value(
        {
            "schema": SCHEMA,
            "submission": {"name": report.name, "path": report.path, "digest": report.digest},
            "environment": {
                **asdict(environment),
                "isolation": isolation_line(environment.isolation, environment.containment),
            },
            "score": report.score,
            "max_score": report.max_score,
            "final": report.final,
            "duration_s": Fraction(report.duration_s),
            "exercises": [_exercise(exercise, report) for exercise in report.exercises],
            "reproduce": {
                "command": shell_line(report.reproduce.command),
                "seed": report.seed,
                "rubrics": dict(report.reproduce.rubrics),
                "recording": report.reproduce.recording or None,
            },
            **({"interfaces": [asdict(package) for package in report.interfaces]} if report.interfaces else {}),
        }
    )
    return values


def dumps(report: Report) -> str:
    """Return a report as indented JSON text that ends in a line break, is encodable, and is safe on a terminal."""
    return json_text(report_to_json(report))


def json_text(values: Mapping[str, object]) -> str:
    """Return plain JSON values as text in the way of `dumps`; platform formats use it too."""
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    return _OBEYED_BY_TERMINALS.sub(lambda match: json.dumps(match.group())[1:-1], text) + "\n"


def start_values(start: Start) -> Mapping[str, object]:
    """Return how a file was started, for JSON."""
    values = {name: value for name, value in asdict(start).items() if value or name not in ("arguments", "launched_by")}
    return {**values, "target": start.target or None}


def _exercise(exercise: ExerciseReport, report: Report) -> Mapping[str, object]:
    variant = exercise.variant
    return {
        "id": exercise.id,
        "number": exercise.number,
        "title": exercise.title,
        "required": exercise.required,
        "score": exercise.score,
        "max_score": exercise.max_score,
        "clock": exercise.clock,
        "clock_reason": exercise.clock_reason or None,
        "criteria": [_criterion(verdict) for verdict in exercise.verdicts],
        "faults": [_fault(fault) for fault in exercise.faults],
        "notes": _notes(exercise, report),
        **({"starts": [start_values(start) for start in exercise.starts]} if exercise.starts else {}),
        **({"unchecked": exercise.unchecked} if exercise.unchecked else {}),
        **({"variant": {"student": variant.student, "values": dict(variant.values)}} if variant else {}),
    }


def _notes(exercise: ExerciseReport, report: Report) -> list[str]:
    """Return the notes of an exercise and of the whole run; the format has no other place for the latter."""
    seed = () if report.seed is None else (f"drawn values come from seed {report.seed}",)
    return list(dict.fromkeys((*report.notes, *exercise.notes, *seed)))


def _criterion(verdict: Verdict) -> Mapping[str, object]:
    links = {"blocked_by": verdict.blocked_by, "same_cause_as": verdict.same_cause_as}
    return {
        "id": verdict.id,
        "title": verdict.title,
        "outcome": verdict.outcome,
        "score": verdict.score,
        "max_score": verdict.max_score,
        "reason": verdict.reason,
        "hint": verdict.hint or None,
        "location": None if verdict.location is None else asdict(verdict.location),
        "evidence": verdict.evidence,
        **{name: id_ for name, id_ in links.items() if id_},
        **({"problem": _problem(verdict.problem)} if verdict.problem else {}),
    }


def _problem(problem: Problem) -> Mapping[str, object]:
    return {"kind": problem.kind, "topics": problem.topics, "detail": problem.detail or None}


def _fault(fault: ReportedFault) -> Mapping[str, object]:
    return {
        "kind": fault.kind,
        "file": fault.file,
        "line": fault.line,
        "text": fault.text,
        "t_s": Fraction(seconds(fault.t_ns)),
    }
