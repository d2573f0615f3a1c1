"""The report as JUnit XML: a suite for each exercise, a case for each criterion, points as properties."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from pathlib import PurePosixPath

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ExerciseReport, Report, Verdict
from grader.grading.reporting import wording
from grader.grading.reporting.escape import json_value, xml_text

# Judging a recording takes negligible time; the root has that of the run.
_NO_TIME = "0"
#: Outcome -> element: a failure is the student's, an error is ours, and a blocked criterion is skipped.
_ELEMENTS = {
    Outcome.PARTLY: "failure",
    Outcome.NOT_MET: "failure",
    Outcome.UNDECIDED: "error",
    Outcome.BLOCKED: "skipped",
}


def render_junit(report: Report, *, folder: str | None) -> str:
    """Return a report as JUnit XML.

    The folder is that of the submission in the repository, POSIX form. None if it is elsewhere: then files have the
    names they have in the submission.
    """
    root = ET.Element("testsuites", {"name": xml_text(wording.headline(report)), "time": f"{report.duration_s:.3f}"})
    _count(root, [verdict for exercise in report.exercises for verdict in exercise.verdicts])
    for exercise in report.exercises:
        root.append(_suite(exercise, report, folder or ""))
    ET.indent(root)
    return '<?xml version="1.0" encoding="utf-8"?>\n' + ET.tostring(root, encoding="unicode") + "\n"


def _suite(exercise: ExerciseReport, report: Report, folder: str) -> ET.Element:
    suite = ET.Element("testsuite", {"name": xml_text(exercise.id), "time": _NO_TIME})
    _count(suite, exercise.verdicts)
    _properties(
        suite,
        {
            "score": str(json_value(exercise.score)),
            "max_score": str(json_value(exercise.max_score)),
            "final": str(report.final).lower(),
            "isolation": report.environment.isolation,
        },
    )
    for verdict in exercise.verdicts:
        suite.append(_case(exercise, verdict, folder))
    lines = [
        wording.exercise_line(exercise),
        *wording.remarks(exercise),
        *wording.opening(report),
        *wording.ending_lines(report),
    ]
    ET.SubElement(suite, "system-out").text = xml_text("\n".join(lines), limit=200_000)
    return suite


def _case(exercise: ExerciseReport, verdict: Verdict, folder: str) -> ET.Element:
    case = ET.Element("testcase", {"classname": exercise.id, "name": xml_text(verdict.id), "time": _NO_TIME})
    if verdict.location is not None:
        case.set("file", xml_text(PurePosixPath(folder, verdict.location.file).as_posix(), limit=4096))
        case.set("line", str(verdict.location.line))
    _properties(
        case,
        {
            "title": xml_text(verdict.title),
            "outcome": verdict.outcome.value,
            "score": str(json_value(verdict.score)),
            "max_score": str(json_value(verdict.max_score)),
        },
    )
    reason, *more = wording.explanation(verdict)
    if verdict.outcome is Outcome.MET:
        ET.SubElement(case, "system-out").text = xml_text(reason)
        return case
    found = ET.SubElement(case, _ELEMENTS[verdict.outcome], {"message": xml_text(reason)})
    if verdict.outcome is not Outcome.BLOCKED:
        found.set("type", verdict.outcome.value)
    found.text = xml_text("\n".join([reason, *more]))
    return case


def _properties(parent: ET.Element, values: dict[str, str]) -> None:
    holder = ET.SubElement(parent, "properties")
    for name, value in values.items():
        ET.SubElement(holder, "property", {"name": name, "value": value})


def _count(element: ET.Element, verdicts: list[Verdict] | tuple[Verdict, ...]) -> None:
    counts = Counter(_ELEMENTS.get(verdict.outcome, "passed") for verdict in verdicts)
    element.set("tests", str(len(verdicts)))
    element.set("failures", str(counts["failure"]))
    element.set("errors", str(counts["error"]))
    element.set("skipped", str(counts["skipped"]))
