"""The report as JSON, version 1, for other programs."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from fractions import Fraction
from importlib.resources import files
from typing import Any, TypedDict

from typing_extensions import NotRequired

from grader.core.checkup import Property, described
from grader.core.exercise import Location, Problem
from grader.core.json_values import JsonObject
from grader.core.quantities import seconds
from grader.core.report import SCHEMA, ExerciseReport, Report, ReportedFault, Verdict
from grader.reporting.escape import command_line, json_value, valid_unicode

#: Decimal places of every score and duration.
DIGITS = 6
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


def report_to_json(report: Report) -> ReportData:
    """Return a report as plain JSON values, keys in the order of the format."""
    return {
        "schema": SCHEMA,
        "submission": {
            "name": valid_unicode(report.name),
            "path": valid_unicode(report.path),
            "digest": report.digest,
        },
        "environment": {
            "grader": report.environment.grader,
            "ros_distro": report.environment.ros_distro,
            "rclpy": report.environment.rclpy,
            "rmw": report.environment.rmw,
            "python": report.environment.python,
            "isolation": described(report.environment.isolation, report.environment.containment),
            "containment": [_property(found) for found in report.environment.containment],
        },
        "score": _number(report.score),
        "max_score": _number(report.max_score),
        "final": report.final,
        "duration_s": _number(report.duration_s),
        "exercises": [_exercise(exercise, report) for exercise in report.exercises],
        "reproduce": {
            "command": command_line(report.reproduce.command),
            "seed": report.seed,
            "rubrics": dict(report.reproduce.rubrics),
            "recording": report.reproduce.recording or None,
        },
    }


def dumps(report: Report) -> str:
    """Return a report as indented JSON text that ends in a line break, is encodable, and is safe on a terminal."""
    return json_text(report_to_json(report))


def json_text(values: Mapping[str, object]) -> str:
    """Return plain JSON values as text in the way of `dumps`; platform formats use it too."""
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    return _OBEYED_BY_TERMINALS.sub(lambda match: json.dumps(match.group())[1:-1], text) + "\n"


def report_schema() -> dict[str, Any]:
    """Return the JSON Schema of reports."""
    text = files(__package__).joinpath("report.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def _property(found: Property) -> JsonObject:
    return {"name": found.name, "holds": found.holds, "mechanism": found.mechanism, "found": found.found}


def _exercise(exercise: ExerciseReport, report: Report) -> ExerciseData:
    data: ExerciseData = {
        "id": exercise.id,
        "number": exercise.number,
        "title": valid_unicode(exercise.title),
        "required": exercise.required,
        "score": _number(exercise.score),
        "max_score": _number(exercise.max_score),
        "clock": exercise.clock.value,
        "clock_reason": valid_unicode(exercise.clock_reason) or None,
        "criteria": [_criterion(verdict) for verdict in exercise.verdicts],
        "faults": [_fault(fault) for fault in exercise.faults],
        "notes": _notes(exercise, report),
    }
    if exercise.starts:
        data["starts"] = _starts(exercise)
    if (variant := exercise.variant) is not None:
        data["variant"] = {"student": valid_unicode(variant.student), "values": json_value(dict(variant.values))}
    return data


def _starts(exercise: ExerciseReport) -> list[JsonObject]:
    """Return how each file was started."""
    return [
        {
            "process": valid_unicode(start.process),
            "file": valid_unicode(start.file),
            "way": start.way.value,
            "target": valid_unicode(start.target) or None,
            "hidden": [valid_unicode(name) for name in start.hidden],
        }
        for start in exercise.starts
    ]


def _notes(exercise: ExerciseReport, report: Report) -> list[str]:
    """Return the notes of an exercise and of the whole run; the format has no other place for the latter."""
    seed = () if report.seed is None else (f"drawn values come from seed {report.seed}",)
    notes = (*report.notes, *exercise.notes, *seed)
    return list(dict.fromkeys(valid_unicode(note) for note in notes))


def _criterion(verdict: Verdict) -> CriterionData:
    data: CriterionData = {
        "id": verdict.id,
        "title": valid_unicode(verdict.title),
        "outcome": verdict.outcome.value,
        "score": _number(verdict.score),
        "max_score": _number(verdict.max_score),
        "reason": valid_unicode(verdict.reason),
        "hint": valid_unicode(verdict.hint) or None,
        "location": _location(verdict.location),
        "evidence": json_value(verdict.evidence),
    }
    if verdict.blocked_by:
        data["blocked_by"] = verdict.blocked_by
    if verdict.same_cause_as:
        data["same_cause_as"] = verdict.same_cause_as
    if verdict.problem is not None:
        data["problem"] = _problem(verdict.problem)
    return data


def _problem(problem: Problem) -> JsonObject:
    """Return what is wrong, where a check tells several problems apart."""
    topics = [valid_unicode(topic) for topic in problem.topics]
    return {"kind": problem.kind.value, "topics": topics, "detail": valid_unicode(problem.detail) or None}


def _location(location: Location | None) -> JsonObject | None:
    return None if location is None else {"file": valid_unicode(location.file), "line": location.line}


def _fault(fault: ReportedFault) -> FaultData:
    return {
        "kind": fault.kind,
        "file": valid_unicode(fault.file),
        "line": fault.line,
        "text": valid_unicode(fault.text),
        "t_s": _number(seconds(fault.t_ns)),
    }


def _number(value: Fraction | float) -> int | float:
    """Return a whole number as an int, and any other number rounded."""
    rounded = round(float(value), DIGITS)
    return int(rounded) if rounded.is_integer() else rounded
