"""Servers and clients whose QoS no end with the default QoS matches: judged wrong, with the line that says so."""

from __future__ import annotations

from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from check_instances import INSTANCES
from tracing import TRIGGER, Recording

from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Criterion, Exercise, Outcome, ProblemKind
from grader.grading.model.report import Verdict
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission

FILE, SERVICE = "node.py", "/battery/get_status"
CREATED = {"service": "create_service(Trigger, NAME, self.tell", "client": "create_client(Trigger, NAME"}


def judged(kind: str, names: tuple[str, ...], **policies: Any) -> list[Verdict]:
    """Judge a node with one end of the service by some checks."""
    source = f"import rclpy\nNAME = '{SERVICE}'\nself.{CREATED[kind]}, qos_profile=QOS)\n"
    rec = Recording(40.0, process=FILE).service(kind, SERVICE, TRIGGER, "/node", **policies)
    criteria = tuple(Criterion(name, "", Fraction(1), "alone", INSTANCES[name]) for name in names)
    scenario = Scenario("alone", (FILE,), Span(40 * NS_PER_S))
    exercise = Exercise("asking", "1", "", False, (FILE,), (scenario,), criteria, "sha256:1")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    return list(judge_exercise(exercise, {"alone": rec.trace()}, submission, {FILE: source}).verdicts)


@pytest.mark.parametrize(
    ("policies", "said"),
    [
        ({"reliability": "best_effort"}, "best_effort reliability"),
        ({"durability": "transient_local"}, "transient_local durability"),
    ],
)
@pytest.mark.parametrize(
    ("kind", "names", "other"),
    [
        ("service", ("service_available", "service_answers_all", "service_response"), "client"),
        ("client", ("service_calls", "logs_response"), "server"),
    ],
)
def test_an_end_that_no_other_matches_is_wrong(
    kind: str, names: tuple[str, ...], other: str, policies: dict[str, str], said: str
) -> None:
    """The first criterion says why, with the line; those after it wait for it or say the same, none is undecided."""
    first, *others = judged(kind, names, **policies)
    assert first.outcome is Outcome.NOT_MET
    assert f"of /node has {said}, which a {other} with the default QoS does not match: no call arrives" in first.reason
    assert first.hint == f"qos_profile=QOS does not match a {other} with the default QoS: remove it"
    assert first.location is not None
    assert first.location.line == 3
    assert {verdict.outcome for verdict in others} <= {Outcome.BLOCKED, Outcome.NOT_MET}


def test_one_end_that_matches_is_enough() -> None:
    """With the default QoS: the server is there, and the client that sends nothing is not said to be missing."""
    (there,) = judged("service", ("service_available",))
    assert there.outcome is Outcome.MET
    (quiet,) = judged("client", ("service_calls",))
    assert quiet.reason == f"{SERVICE} [{TRIGGER}]: the client of /node sends no request in 40.0 s"
    assert quiet.problem is not None
    assert quiet.problem.kind is ProblemKind.SILENT
