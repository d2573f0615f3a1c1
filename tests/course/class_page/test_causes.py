"""Causes of a class: what falls together although numbers and names differ, what does not, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from pathlib import Path
from typing import Any

import pytest
from report_samples import report as whole
from tracing import TWIST, Recording, twist

from grader.course.class_page.causes import CauseKind, causes, kind_of
from grader.grading.judging.checks.logs import UsesLogger
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.judge_run import judge_exercise
from grader.grading.model.exercise import Check, Criterion, Exercise
from grader.grading.reporting.json_report import report_to_json
from grader.runtime.model.quantities import Hertz
from grader.runtime.model.scenario import Scenario, Span
from grader.runtime.model.submission import StudentFile, Submission

FILE = "node.py"


def criterion(
    id_: str = "rate",
    outcome: str = "not_met",
    points: int = 10,
    score: float = 0,
    **changes: Mapping[str, Any] | Sequence[Any] | str | None,
) -> dict[str, Any]:
    """Return a criterion as a report has it."""
    values = {"id": id_, "title": id_.title(), "outcome": outcome, "score": score, "max_score": points}
    return {**values, "reason": "slow", "hint": None, "location": None, "evidence": {}, **changes}


def report(*criteria: Mapping[str, Any], id_: str = "velocity_publisher") -> Any:
    """Return a report of one exercise."""
    return {"exercises": [{"id": id_, "title": "Velocity", "score": 0, "max_score": 30, "criteria": list(criteria)}]}


def kind_from(check: Check, recording: Recording) -> CauseKind:
    """Return the kind of cause of a criterion that a check judges, by way of the JSON report."""
    asked = Criterion("asked", "Asked", Fraction(6), "alone", check)
    exercise = Exercise("e", "1", "E", True, (FILE,), (Scenario("alone", (FILE,), Span(10)),), (asked,), "sha256:0")
    submission = Submission("s", "s", Path("s"), "sha256:1", {FILE: StudentFile(FILE, FILE)})
    judged = judge_exercise(exercise, {"alone": recording.trace()}, submission)
    return kind_of(report_to_json(whole(judged))["exercises"][0]["criteria"][0])


def publisher(topic: str = "/cmd_vel", count: int = 100, period_s: float = 0.1) -> Recording:
    """Return a recording of a node that publishes from the start."""
    made = Recording().endpoint("publisher", topic, TWIST)
    for n in range(count):
        made.message(n * period_s, topic, twist(), TWIST)
    return made


RATE = TopicRate("/cmd_vel", Hertz(20), Hertz(1))


@pytest.mark.parametrize(
    ("check", "one", "other"),
    [
        (RATE, publisher(period_s=0.1), publisher(period_s=0.0999)),
        (RATE, publisher("/velocity/cmd_vel"), publisher("/turtle1/cmd_vel", 80)),
        (RATE, publisher(count=1), Recording().message(3.25, "/cmd_vel", twist(), TWIST)),
        (RATE, publisher().crashed(2, "ValueError: 12"), publisher().crashed(3, "ValueError: what Ada says", 40)),
        (UsesLogger(FILE), Recording().line(1, "velocity 0.5"), Recording().line(2, "Hello").line(3, "7")),
    ],
)
def test_numbers_and_names_do_not_tell_causes_apart(check: Check, one: Recording, other: Recording) -> None:
    """Measured values, topics, quotations and places are those of one student."""
    assert kind_from(check, one) == kind_from(check, other)


def test_problems_tell_causes_apart() -> None:
    """A check that finds several problems names the one that it found."""
    recordings = [
        publisher(),
        publisher("/turtle1/cmd_vel"),
        publisher(count=1),
        publisher(count=0),
        publisher(count=0).crashed(2),
        publisher(count=0).crashed(2, "KeyError: 'x'"),
        publisher(count=0).exited(2),
        Recording(),
    ]
    kinds = [kind_from(RATE, recording) for recording in recordings]
    assert [kind.label for kind in kinds] == [
        "wrong rate",
        "other name",
        "too few",
        "silent",
        "exception: ValueError",
        "exception: KeyError",
        "exited",
        "absent",
    ]


def test_a_reason_plays_no_part() -> None:
    """Whatever it says, the values of the report decide."""
    slow = {"kind": "wrong_rate", "topics": []}
    assert kind_of(criterion(reason="/a: 10 Hz", problem=slow)) == kind_of(criterion(reason="else", problem=slow))
    assert kind_of(criterion(reason="/a: 10 Hz")) == kind_of(criterion(reason="something else"))


def test_a_problem_of_another_topic_is_another_one() -> None:
    """Where a criterion is about several; and so is one with another detail."""
    problems: list[dict[str, Any]] = [
        {"kind": "stopped", "topics": ["/a_b"], "detail": None},
        {"kind": "stopped", "topics": ["/c"], "detail": None},
        {"kind": "wrong_value", "topics": [], "detail": "swapped"},
    ]
    labels = [kind_of(criterion(problem=problem)).label for problem in problems]
    assert labels == ["stopped: /a_b", "stopped: /c", "wrong value: swapped"]


def test_what_the_diagnosis_named_goes_before_everything() -> None:
    """Its id is surer than any sentence."""
    named = criterion(evidence={"diagnosis": "period", "fault": {"kind": "exception", "text": "ValueError"}})
    assert (kind_of(named).source, kind_of(named).label) == ("diagnosis", "period")
    assert kind_of(named) == kind_of(criterion(reason="others", hint="others", evidence={"diagnosis": "period"}))


def test_a_missing_file_is_told_by_its_name() -> None:
    """Whatever lies there instead."""
    one = criterion(reason="a.py: not in the submission", evidence={"missing": "a.py"})
    other = criterion(reason="a.py: not in the submission; found A.py instead", evidence={"missing": "a.py"})
    assert kind_of(one) == kind_of(other)
    assert kind_of(one) != kind_of(criterion(evidence={"missing": "b.py"}))


def test_values_may_be_anything() -> None:
    """A report of somebody else's making, or an older one, is grouped too."""
    evidence: list[Any] = [None, [], "x", {"diagnosis": 3, "missing": [], "fault": "f"}]
    assert {kind_of(criterion(evidence=one)).label for one in evidence} == {"cause unknown"}
    problems: list[Any] = [None, "x", {"kind": 3, "topics": 4}, {"kind": "late", "topics": [None]}, {"topics": []}]
    assert all(isinstance(kind_of(criterion(problem=one)).label, str) for one in problems)
    fault = {"kind": "exception", "text": "ValueError: 3"}
    assert kind_of(criterion(evidence={"fault": fault})).label == "exception"


def test_the_commonest_cause_comes_first_with_an_example() -> None:
    """The students, each once, the points, and the words of the first of them."""
    slow = [
        criterion(reason=f"{hz} Hz", hint=f"every {1 / hz} s", evidence={"diagnosis": "period"}) for hz in (10, 9.98)
    ]
    turned = criterion("angular_velocity", points=5, reason="-0.1", evidence={"diagnosis": "sign"})
    found = causes([(3, report(turned)), (5, report(slow[0])), (8, report(slow[1], turned)), (9, report(slow[1]))])
    assert [(c.criterion, c.students, c.points) for c in found] == [
        ("rate", (5, 8, 9), 30),
        ("angular_velocity", (3, 8), 10),
    ]
    assert [(f.student, f.reason, f.hint, f.count) for f in found[0].forms] == [(5, "10 Hz", "every 0.1 s", 3)]


def test_what_costs_more_comes_first_among_equals() -> None:
    """As many students, more points."""
    cheap, dear = criterion("a", points=1), criterion("b", points=6)
    assert [c.criterion for c in causes([(0, report(cheap, dear))])] == ["b", "a"]


def test_one_cause_shows_in_several_forms() -> None:
    """What the check found is shown separately, within one cause."""
    forms = [("every 20 s: 20 is the rate", "too_few", 2), ("every 0.1 s, which is 10 Hz", "wrong_rate", 3)]
    reports = [
        report(criterion(hint=hint, evidence={"diagnosis": "period"}, problem={"kind": kind, "topics": []}))
        for hint, kind, n in forms
        for _ in range(n)
    ]
    (cause,) = causes(list(enumerate(reports)))
    assert [(f.hint, f.count) for f in cause.forms] == [(forms[1][0], 3), (forms[0][0], 2)]


def test_what_is_blocked_counts_with_what_blocks_it() -> None:
    """Also through another one that is blocked itself."""
    root = criterion("publishes", points=6, evidence={"diagnosis": "no_spin"})
    waits = criterion("rate", "blocked", blocked_by="publishes")
    last = criterion("logging", "blocked", points=4, blocked_by="rate")
    (cause,) = causes([(0, report(root, waits, last))])
    assert (cause.criterion, cause.students, cause.points) == ("publishes", (0,), 20)


def test_only_links_join_criteria() -> None:
    """A sentence that names another criterion joins nothing."""
    root, other = criterion("publishes", points=6), criterion("linear", points=5)
    waits = criterion("rate", "blocked", reason="not judged: needs linear (not met)", blocked_by="publishes")
    last = criterion("angular", hint="this has the same cause as linear: mend that first", same_cause_as="publishes")
    assert {c.criterion: c.points for c in causes([(0, report(root, other, waits, last))])} == {
        "publishes": 26,
        "linear": 5,
    }


@pytest.mark.parametrize("link", ["nobody", "rate"])
def test_a_link_that_leads_nowhere_is_ignored(link: str) -> None:
    """A criterion of another rubric, or the criterion itself."""
    (cause,) = causes([(0, report(criterion(same_cause_as=link)))])
    assert cause.criterion == "rate"


def test_two_that_name_each_other_come_to_an_end() -> None:
    """Evidence of somebody else's making may go round in circles."""
    one = criterion("a", same_cause_as="b")
    other = criterion("b", same_cause_as="a")
    assert sum(c.points for c in causes([(0, report(one, other))])) == 20


def test_partly_counts_with_what_is_lost() -> None:
    """Half the points."""
    (cause,) = causes([(0, report(criterion(outcome="partly", score=2.5)))])
    assert cause.points == Fraction(15, 2)


def test_nothing_is_lost_where_nothing_was_decided_against_a_student() -> None:
    """Neither by what is met or undecided, nor by what waits for something undecided."""
    waits = criterion("b", "blocked", blocked_by="rate")
    assert (
        causes([(0, report(criterion(outcome="undecided"), waits)), (1, report(criterion(outcome="met", score=10)))])
        == ()
    )


def test_the_order_of_students_alone_decides_who_is_the_example() -> None:
    """The same class gives the same page, whatever the hash seed."""
    reports = [(k, report(criterion(reason=f"r{k}", hint="h", evidence={"diagnosis": "d"}))) for k in range(20)]
    assert causes(reports)[0].forms[0].reason == "r0"
    assert causes(reports) == causes(reports)
