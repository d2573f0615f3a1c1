"""Causes of a class: what falls together although numbers and names differ, what does not, and what it cost."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from fractions import Fraction
from typing import Any

import pytest

from grader.reporting.class_page.causes import causes, kind_of, skeleton


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


def same_as(id_: str) -> str:
    """Return the hint of a criterion that has the same cause as another."""
    return f"this has the same cause as {id_}: mend that first"


def report(*criteria: Mapping[str, Any], id_: str = "velocity_publisher") -> Any:
    """Return a report of one exercise."""
    return {"exercises": [{"id": id_, "title": "Velocity", "score": 0, "max_score": 30, "criteria": list(criteria)}]}


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("/cmd_vel: average rate: 10.00 Hz, window: 100", "/cmd_vel: average rate: 9.98 Hz, window: 99"),
        (
            "create_timer(0.1, self.timer_callback) is called every 0.1 s, which is 10 Hz; 20 Hz is a period of 0.05 s",
            "create_timer(1.0 / 18.9, self.t) is called every 0.0529 s, which is 18.9 Hz; 20 Hz is a period of 0.05 s",
        ),
        ("msg.linear.x = -0.5 has the wrong sign", "self.twist.linear.x = -1e-1 has the wrong sign"),
        ("publishes on /turtle1/cmd_vel: asked for is /cmd_vel", "publishes on /velocity: asked for is /cmd_vel"),
        ("print('Hello') does not log", "print('velocity', self.v) does not log"),
        ("velocity_publisher.py:7: no", "src/my-pkg/velocity_publisher.py:123: no"),
        ("lines 7 and 9 do it", "lines 7, 8, 9 and 12 do it"),
        ("took nan s", "took 3.2 s"),
        ("a  sentence\nbroken", "A sentence broken"),
    ],
)
def test_numbers_and_names_do_not_tell_causes_apart(one: str, other: str) -> None:
    """Measured values, identifiers, topics, quotations and places are those of one student."""
    assert skeleton(one) == skeleton(other)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("has the wrong sign: angular.z is 0.1", "gives degrees: angular.z is in rad/s"),
        ("only x is logged, y is missing", "x and y are swapped"),
        ("is called every 20 s: 20 is the rate", "is called every 0.1 s, which is 10 Hz"),
    ],
)
def test_words_tell_causes_apart(one: str, other: str) -> None:
    """What the sentence says stays."""
    assert skeleton(one) != skeleton(other)


def test_a_long_sentence_takes_no_longer() -> None:
    """A student's text cannot make a pattern run away."""
    hostile = "".join(["'" * 5000, "1." * 5000, "a." * 5000, "(" * 5000, "/a" * 5000, "x.py:" * 5000])
    for start in range(0, len(hostile), 1000):
        assert len(skeleton(hostile[start:])) <= 1000


def test_what_the_diagnosis_named_goes_before_everything() -> None:
    """Its id is surer than any sentence."""
    named = criterion(evidence={"diagnosis": "period", "fault": {"kind": "exception", "text": "ValueError"}})
    assert (kind_of(named).source, kind_of(named).label) == ("diagnosis", "period")
    assert kind_of(named) == kind_of(criterion(reason="others", hint="others", evidence={"diagnosis": "period"}))


@pytest.mark.parametrize(
    ("one", "other", "same"),
    [
        ("AttributeError: 'A' object has no attribute 'b'", "AttributeError: 'C' object has no attribute 'd'", True),
        ("AttributeError: 'A' object has no attribute 'b'", "AttributeError: can't set attribute 'x'", False),
        ("ValueError: what Ada says", "ValueError: what Bob says", True),
        ("ValueError: x", "KeyError: 'x'", False),
        ("SIGSEGV", "SIGSEGV", True),
    ],
)
def test_faults_are_told_apart_by_their_type(one: str, other: str, same: bool) -> None:
    """Words that a student chose are no kind; those of Python are."""
    kinds = [kind_of(criterion(evidence={"fault": {"kind": "exception", "text": text}})) for text in (one, other)]
    assert (kinds[0] == kinds[1]) is same


def test_a_missing_file_is_told_by_its_name() -> None:
    """Whatever lies there instead."""
    one = criterion(reason="a.py: not in the submission", evidence={"missing": "a.py"})
    other = criterion(reason="a.py: not in the submission; found A.py instead", evidence={"missing": "a.py"})
    assert kind_of(one) == kind_of(other)
    assert kind_of(one) != kind_of(criterion(evidence={"missing": "b.py"}))


def test_without_a_diagnosis_the_first_part_of_the_reason_counts() -> None:
    """What comes after it differs from student to student."""
    one = criterion(reason="/cmd_vel: 10.00 Hz; velocity_publisher.py exited after 5.0 s")
    assert kind_of(one) == kind_of(criterion(reason="/cmd_vel: 9.98 Hz; window: 4"))


def test_evidence_may_be_anything() -> None:
    """A report of somebody else's making is clustered too."""
    kinds: list[Any] = [None, [], "x", {"diagnosis": 3, "missing": [], "fault": "f"}]
    for evidence in kinds:
        assert kind_of(criterion(evidence=evidence)).source == "reason"


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
    """Hints with different content are shown separately, within one cause."""
    forms = [("every 20 s: 20 is the rate", 2), ("every 0.1 s, which is 10 Hz", 3)]
    reports = [report(criterion(hint=hint, evidence={"diagnosis": "period"})) for hint, n in forms for _ in range(n)]
    (cause,) = causes(list(enumerate(reports)))
    assert [(f.hint, f.count) for f in cause.forms] == [(forms[1][0], 3), (forms[0][0], 2)]


def test_what_is_blocked_counts_with_what_blocks_it() -> None:
    """Also through another one that is blocked itself."""
    root = criterion("publishes", points=6, evidence={"diagnosis": "no_spin"})
    waits = criterion("rate", "blocked", reason="not judged: needs publishes (not met)")
    last = criterion("logging", "blocked", points=4, reason="not judged: needs rate (not judged)")
    (cause,) = causes([(0, report(root, waits, last))])
    assert (cause.criterion, cause.students, cause.points) == ("publishes", (0,), 20)


def test_a_link_of_its_own_goes_before_the_words() -> None:
    """Reports of earlier versions have the words alone."""
    root, other = criterion("publishes", points=6), criterion("linear", points=5)
    waits = criterion("rate", "blocked", reason="not judged: needs linear (not met)", blocked_by="publishes")
    last = criterion("angular", hint=same_as("linear"), same_cause_as="publishes")
    assert {c.criterion: c.points for c in causes([(0, report(root, other, waits, last))])} == {
        "publishes": 26,
        "linear": 5,
    }


def test_what_waits_for_a_missing_file_counts_with_it() -> None:
    """The criterion that names the file is found by it."""
    root = criterion("publishes", points=6, evidence={"missing": "a.py", "similar": []})
    waits = criterion("rate", "blocked", reason="not judged: needs a.py, which is missing")
    (cause,) = causes([(0, report(root, waits))])
    assert (cause.criterion, cause.kind.source, cause.points) == ("publishes", "missing", 16)


def test_the_same_cause_in_two_criteria_is_one() -> None:
    """The diagnosis uses exactly the words that are looked for."""
    root = criterion("linear", evidence={"diagnosis": "exchanged"})
    other = criterion("angular", hint=same_as("linear"), evidence={"diagnosis": "exchanged"})
    (cause,) = causes([(0, report(root, other))])
    assert (cause.criterion, cause.points) == ("linear", 20)


@pytest.mark.parametrize(
    "hint", ["this has the same cause as nobody: mend that first", "this has the same cause as rate: mend that first"]
)
def test_a_cause_that_leads_nowhere_stands_for_itself(hint: str) -> None:
    """A criterion of another rubric, or the criterion itself."""
    (cause,) = causes([(0, report(criterion(hint=hint)))])
    assert cause.criterion == "rate"


def test_two_that_name_each_other_come_to_an_end() -> None:
    """Evidence of somebody else's making may go round in circles."""
    one = criterion("a", hint=same_as("b"))
    other = criterion("b", hint=same_as("a"))
    assert sum(c.points for c in causes([(0, report(one, other))])) == 20


def test_partly_counts_with_what_is_lost() -> None:
    """Half the points."""
    (cause,) = causes([(0, report(criterion(outcome="partly", score=2.5)))])
    assert cause.points == Fraction(15, 2)


def test_nothing_is_lost_where_nothing_was_decided_against_a_student() -> None:
    """Neither by what is met or undecided, nor by what waits for something undecided."""
    waits = criterion("b", "blocked", reason="not judged: needs rate (undecided)")
    assert (
        causes([(0, report(criterion(outcome="undecided"), waits)), (1, report(criterion(outcome="met", score=10)))])
        == ()
    )


def test_the_order_of_students_alone_decides_who_is_the_example() -> None:
    """The same class gives the same page, whatever the hash seed."""
    reports = [(k, report(criterion(reason=f"r{k}", hint="h", evidence={"diagnosis": "d"}))) for k in range(20)]
    assert causes(reports)[0].forms[0].reason == "r0"
    assert causes(reports) == causes(reports)
