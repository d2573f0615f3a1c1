"""The report as JSON, version 1, for other programs."""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from enum import Enum
from fractions import Fraction
from importlib.resources import files
from typing import Any

from grader.core.checkup import Property, described
from grader.core.exercise import Location, Problem, Variant
from grader.core.quantities import seconds
from grader.core.report import SCHEMA, ExerciseReport, Report, ReportedFault, Verdict
from grader.reporting.escape import command_line, valid_unicode

#: Decimal places of every score and duration.
DIGITS = 6
# Integers beyond 64 bits are not measurements, and most JSON readers cannot hold them.
_MOST_BITS = 64
# Legal inside a JSON string, but a terminal may interpret them: C1 controls, and characters that reorder or hide text.
_OBEYED_BY_TERMINALS = re.compile("[\x7f-\x9f\u061c\u200b-\u200f\u2028-\u202e\u2060-\u206f\ufeff\U000e0000-\U000e007f]")


def report_to_json(report: Report) -> dict[str, Any]:
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


def json_text(values: Mapping[str, Any]) -> str:
    """Return plain JSON values as text in the way of `dumps`; platform formats use it too."""
    text = json.dumps(values, indent=2, ensure_ascii=False, allow_nan=False)
    return _OBEYED_BY_TERMINALS.sub(lambda match: json.dumps(match.group())[1:-1], text) + "\n"


def report_schema() -> dict[str, Any]:
    """Return the JSON Schema of reports."""
    text = files(__package__).joinpath("report.schema.json").read_text(encoding="utf-8")
    schema: dict[str, Any] = json.loads(text)
    return schema


def _property(found: Property) -> dict[str, Any]:
    return {"name": found.name, "holds": found.holds, "mechanism": found.mechanism, "found": found.found}


def _exercise(exercise: ExerciseReport, report: Report) -> dict[str, Any]:
    return {
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
        **_starts(exercise),
        **_variant(exercise.variant),
    }


def _starts(exercise: ExerciseReport) -> dict[str, Any]:
    """Return how each file was started, where that is known."""
    starts = [
        {
            "process": valid_unicode(start.process),
            "file": valid_unicode(start.file),
            "way": start.way.value,
            "target": valid_unicode(start.target) or None,
            "hidden": [valid_unicode(name) for name in start.hidden],
        }
        for start in exercise.starts
    ]
    return {"starts": starts} if starts else {}


def _variant(variant: Variant | None) -> dict[str, Any]:
    """Return the values of this student's variant, if the rubric has variants."""
    if variant is None:
        return {}
    return {"variant": {"student": valid_unicode(variant.student), "values": _plain(dict(variant.values))}}


def _notes(exercise: ExerciseReport, report: Report) -> list[str]:
    """Return the notes of an exercise and of the whole run; the format has no other place for the latter."""
    seed = () if report.seed is None else (f"drawn values come from seed {report.seed}",)
    notes = (*report.notes, *exercise.notes, *seed)
    return list(dict.fromkeys(valid_unicode(note) for note in notes))


def _criterion(verdict: Verdict) -> dict[str, Any]:
    links = {"blocked_by": verdict.blocked_by, "same_cause_as": verdict.same_cause_as}
    return {
        "id": verdict.id,
        "title": valid_unicode(verdict.title),
        "outcome": verdict.outcome.value,
        "score": _number(verdict.score),
        "max_score": _number(verdict.max_score),
        "reason": valid_unicode(verdict.reason),
        "hint": valid_unicode(verdict.hint) or None,
        "location": _location(verdict.location),
        "evidence": _plain(verdict.evidence),
        **{name: id_ for name, id_ in links.items() if id_},
        **_problem(verdict.problem),
    }


def _problem(problem: Problem | None) -> dict[str, Any]:
    """Return what is wrong, where a check tells several problems apart."""
    if problem is None:
        return {}
    topics = [valid_unicode(topic) for topic in problem.topics]
    return {"problem": {"kind": problem.kind.value, "topics": topics, "detail": valid_unicode(problem.detail) or None}}


def _location(location: Location | None) -> dict[str, Any] | None:
    return None if location is None else {"file": valid_unicode(location.file), "line": location.line}


def _fault(fault: ReportedFault) -> dict[str, Any]:
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


def _plain(value: object) -> Any:
    """Return evidence as JSON values; what JSON cannot represent becomes text."""
    if isinstance(value, Mapping):
        return {valid_unicode(str(key)): _plain(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_plain(item) for item in value]
    if isinstance(value, Enum):
        return _plain(value.value)
    if value is None or isinstance(value, bool):
        return value
    return _plain_number(value) if isinstance(value, (int, float, Fraction)) else valid_unicode(str(value))


def _plain_number(value: float | Fraction) -> int | float | str:
    if isinstance(value, Fraction):
        return _number(value)
    if isinstance(value, float):
        return value if math.isfinite(value) else str(value)
    return value if value.bit_length() <= _MOST_BITS else f"an integer of {value.bit_length()} bits"
