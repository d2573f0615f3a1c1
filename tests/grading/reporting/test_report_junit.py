"""JUnit XML: read back by a parser of such files; failures are the student's, errors are ours."""

from __future__ import annotations

import xml.etree.ElementTree as ET
from collections import Counter
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from junitparser import Error, Failure, JUnitXml, Skipped
from junitparser.junitparser import TestCase
from report_samples import SAMPLES, criterion, exercise, middling, report, undecided

from grader.grading.model.exercise import Location, Outcome
from grader.grading.model.report import Report
from grader.grading.reporting.junit import render_junit

KINDS = {
    Outcome.MET: (),
    Outcome.PARTLY: (Failure,),
    Outcome.NOT_MET: (Failure,),
    Outcome.UNDECIDED: (Error,),
    Outcome.BLOCKED: (Skipped,),
}


def parsed(sample: Report, folder: None = None) -> JUnitXml:
    return JUnitXml.fromstring(render_junit(sample, folder=folder).encode("utf-8"))


def cases(sample: Report, folder: None = None) -> list[TestCase]:
    return [case for suite in parsed(sample, folder) for case in suite]


@pytest.mark.parametrize("name", SAMPLES)
def test_every_criterion_is_a_case_with_its_outcome(name: str) -> None:
    """A suite for each exercise, in order."""
    sample = SAMPLES[name]()
    assert [suite.name for suite in parsed(sample)] == [part.id for part in sample.exercises]
    verdicts = [verdict for part in sample.exercises for verdict in part.verdicts]
    for case, verdict in zip(cases(sample), verdicts, strict=True):
        assert tuple(type(result) for result in case.result) == KINDS[verdict.outcome]
        assert case.name == verdict.id


@pytest.mark.parametrize("name", SAMPLES)
def test_the_counts_are_right(name: str) -> None:
    """What the head says is what the parser counts."""
    written = parsed(SAMPLES[name]())
    said = [(s.tests, s.failures, s.errors, s.skipped) for s in (written, *written)]
    written.update_statistics()  # type: ignore[no-untyped-call]
    assert said == [(s.tests, s.failures, s.errors, s.skipped) for s in (written, *written)]


def test_points_are_properties() -> None:
    """Of each case and of each suite."""
    suite = next(iter(parsed(middling())))
    assert {p.name: p.value for p in suite.properties()} == {  # type: ignore[no-untyped-call]
        "score": "13",
        "max_score": "30",
        "final": "true",
        "isolation": "bubblewrap",
    }
    root = ET.fromstring(render_junit(middling(), folder=None))
    logging = root.find(".//testcase[@name='logging']/properties")
    assert logging is not None
    assert {p.get("name"): p.get("value") for p in logging} == {
        "title": "Logs through the node's logger",
        "outcome": "partly",
        "score": "2",
        "max_score": "4",
    }


def test_a_lost_criterion_has_its_line_and_says_why() -> None:
    """The file is named as the repository names it."""
    root = ET.fromstring(render_junit(middling(), folder="hw/ada"))
    case: Any = root.find(".//testcase[@name='rate']")
    assert (case.get("file"), case.get("line")) == ("hw/ada/velocity_publisher.py", "17")
    assert case.find("failure").get("message").startswith("/cmd_vel: 10.00 Hz, expected 20 ± 1 Hz")
    assert "hint: the argument of create_timer" in case.find("failure").text
    other: Any = root.find(".//testcase[@name='angular_velocity']")
    assert other.get("file") is None


def test_an_undecided_run_fails_nobody() -> None:
    """A class's statistics do not count our faults as the students'."""
    counts = Counter(type(result).__name__ for case in cases(undecided()) for result in case.result)
    assert counts == {"Error": 2}


@given(st.text(alphabet=st.characters(), max_size=60))
def test_any_text_gives_well_formed_xml(text: str) -> None:
    """Neither illegal characters nor markup break the file, and what can be shown is read back."""
    verdict = criterion("c", text, 2, Outcome.NOT_MET, reason=text, hint=text, location=Location(text or "x", 3))
    root = ET.fromstring(render_junit(report(exercise("e", "1", text, verdict, notes=(text,)), name=text), folder=text))
    assert {element.tag for element in root.iter()} == {
        "testsuites", "testsuite", "properties", "property", "testcase", "failure", "system-out",
    }  # fmt: skip
    assert len(root.findall(".//testcase")) == 1
