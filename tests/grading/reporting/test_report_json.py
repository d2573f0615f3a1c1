"""The JSON report: the format, hostile text, numbers."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from fractions import Fraction
from typing import Any

import jsonschema
import pytest
from hypothesis import given
from hypothesis import strategies as st
from jsonschema.validators import Draft202012Validator
from report_samples import (
    NASTY,
    SAMPLES,
    criterion,
    exercise,
    hostile,
    middling,
    perfect,
    report,
    report_schema,
    undecided,
)

from grader.grading.model.exercise import Outcome, Problem, ProblemKind
from grader.grading.reporting.json_report import dumps, report_to_json
from grader.runtime.model.trace import Start, StartWay


def validator() -> Draft202012Validator:
    schema = report_schema()
    jsonschema.Draft202012Validator.check_schema(schema)
    return jsonschema.Draft202012Validator(schema)


@pytest.mark.parametrize("name", SAMPLES)
def test_every_sample_follows_the_shipped_schema(name: str) -> None:
    """What is printed is what the schema promises, after a round trip through text."""
    validator().validate(json.loads(dumps(SAMPLES[name]())))


def test_the_report_ends_with_what_gives_it_again() -> None:
    """The command with its seed, and a digest of everything that was read besides the submission."""
    whole = report_to_json(middling())
    assert whole["reproduce"] == {
        "command": "grade ./ada_homework --seed 4711",
        "seed": 4711,
        "rubrics": {"velocity_publisher": "sha256:" + "0" * 64, "odom_subscriber": "sha256:" + "1" * 64},
        "recording": "sha256:" + "ab" * 32,
    }


@pytest.mark.parametrize(
    "where", [(), ("submission",), ("environment",), ("exercises", 0), ("exercises", 0, "criteria", 1), ("reproduce",)]
)
def test_the_schema_allows_nothing_more_and_nothing_less(where: tuple[int | str, ...]) -> None:
    """A key too many and a key too few are both refused, at every level but the evidence."""
    changes: list[Callable[[Any], object]] = [
        lambda part: part.update(extra=1),
        lambda part: part.pop(next(iter(part))),
    ]
    for change in changes:
        whole = report_to_json(middling())
        part: Any = whole
        for step in where:
            part = part[step]
        change(part)
        assert not validator().is_valid(whole)


def test_the_keys_have_a_fixed_order() -> None:
    """Two programs that compare texts see the same report alike."""
    whole = report_to_json(middling())
    assert list(whole) == [
        "schema",
        "submission",
        "environment",
        "score",
        "max_score",
        "final",
        "duration_s",
        "exercises",
        "reproduce",
    ]
    assert list(whole["submission"]) == ["name", "path", "digest"]
    assert list(whole["environment"]) == [
        "grader",
        "ros_distro",
        "rclpy",
        "rmw",
        "python",
        "isolation",
        "containment",
    ]
    first = whole["exercises"][0]
    assert list(first) == [
        "id",
        "number",
        "title",
        "required",
        "score",
        "max_score",
        "clock",
        "clock_reason",
        "criteria",
        "faults",
        "notes",
    ]
    assert list(first["criteria"][0]) == [
        "id",
        "title",
        "outcome",
        "score",
        "max_score",
        "reason",
        "hint",
        "location",
        "evidence",
    ]


def test_values_land_where_they_belong() -> None:
    """Outcomes, scores, hints, places and the clock are those of the report."""
    whole = report_to_json(middling())
    assert (whole["score"], whole["max_score"], whole["final"]) == (13, 60, True)
    first, second = whole["exercises"]
    rate = first["criteria"][1]
    assert rate["outcome"] == "not_met"
    assert rate["location"] == {"file": "velocity_publisher.py", "line": 17}
    assert rate["evidence"] == {"rate_hz": 10.0}
    assert first["criteria"][0]["hint"] is None
    assert first["criteria"][0]["location"] is None
    assert (first["clock"], first["clock_reason"]) == ("virtual", None)
    assert second["clock"] == "wall"
    assert "did not settle" in (second["clock_reason"] or "")


def test_how_files_were_started_is_told_where_it_is_known() -> None:
    """As the schema says, with hostile names whole; reports on earlier evidence leave it out."""
    starts = (
        Start("a.py", "a.py", StartWay.SCRIPT, hidden=("random.py",)),
        Start("b.py", "p/b.py", StartWay.ENTRY_POINT, "p.b:main"),
        Start(NASTY, NASTY, StartWay.MODULE, NASTY, (NASTY,)),
    )
    whole = report_to_json(report(exercise("e", "1", "E", criterion("c", "C", 1), starts=starts)))
    validator().validate(json.loads(json.dumps(whole)))
    told = whole["exercises"][0]["starts"]
    assert told[:2] == [
        {"process": "a.py", "file": "a.py", "way": "script", "target": None, "hidden": ["random.py"]},
        {"process": "b.py", "file": "p/b.py", "way": "entry_point", "target": "p.b:main", "hidden": []},
    ]
    dumps(report(exercise("e", "1", "E", criterion("c", "C", 1), starts=starts))).encode()
    assert "starts" not in report_to_json(middling())["exercises"][0]


def test_the_problem_is_told_where_a_check_names_one() -> None:
    """Its kind and topics, without the numbers that diagnosis needs."""
    problem = Problem(ProblemKind.STOPPED, ("/temperature",), start=7357)
    verdicts = [criterion("a", "A", 2, Outcome.NOT_MET, problem=problem), criterion("b", "B", 2, Outcome.NOT_MET)]
    data = report_to_json(report(exercise("e", "1", "E", *verdicts)))
    validator().validate(data)
    first, second = data["exercises"][0]["criteria"]
    assert first["problem"] == {"kind": "stopped", "topics": ["/temperature"], "detail": None}
    assert "problem" not in second


def test_faults_carry_seconds() -> None:
    """The time of a fault is in seconds since its scenario began."""
    (fault,) = report_to_json(SAMPLES["crashed"]())["exercises"][0]["faults"]
    assert fault == {
        "kind": "exception",
        "file": "velocity_publisher.py",
        "line": 14,
        "text": "AttributeError: 'VelocityPublisher' object has no attribute 'publisher'",
        "t_s": 0.05,
    }


def test_every_exercise_names_the_seed_and_the_notes_of_the_intake() -> None:
    """A program that reads one exercise only still learns how to repeat the run, and each note once."""
    for part in report_to_json(middling())["exercises"]:
        assert part["notes"][0] == "a symbolic link was not followed: data"
        assert part["notes"][-1] == "drawn values come from seed 4711"
    twice = report(exercise("e", "1", "E", criterion("c", "C", 1), notes=("same",)), notes=("same",))
    assert report_to_json(twice)["exercises"][0]["notes"] == ["same", "drawn values come from seed 4711"]


@pytest.mark.parametrize(
    ("points", "expected", "kind"),
    [(Fraction(5), 5, int), (Fraction(5, 2), 2.5, float), (Fraction(1, 3), 0.333333, float), (Fraction(0), 0, int)],
)
def test_whole_scores_are_ints_and_others_are_rounded(points: Fraction, expected: float, kind: type[Any]) -> None:
    """5 is 5 and not 5.0; a third has six digits."""
    verdict = criterion("c", "C", 9, Outcome.PARTLY)
    changed = exercise("e", "1", "E", type(verdict)("c", "C", Outcome.PARTLY, points, Fraction(9), "why"))
    score = report_to_json(report(changed))["exercises"][0]["criteria"][0]["score"]
    assert score == expected
    assert type(score) is kind


def test_evidence_that_json_cannot_say_becomes_text() -> None:
    """NaN, infinities, huge integers and unknown values do not break a strict reader."""
    evidence = {
        "nan": math.nan,
        "inf": [math.inf, -math.inf],
        "huge": 1 << 70,
        "third": Fraction(1, 3),
        "outcome": Outcome.MET,
        "tuple": (1, True, None),
        "bytes": b"\xff",
    }
    whole = report(exercise("e", "1", "E", criterion("c", "C", 1, evidence=evidence)))
    read = json.loads(dumps(whole), parse_constant=pytest.fail)
    assert read["exercises"][0]["criteria"][0]["evidence"] == {
        "nan": "nan",
        "inf": ["inf", "-inf"],
        "huge": "an integer of 71 bits",
        "third": 0.333333,
        "outcome": "met",
        "tuple": [1, True, None],
        "bytes": "b'\\xff'",
    }


def test_hostile_text_arrives_whole_but_can_be_encoded() -> None:
    """Only lone surrogates are replaced; everything else a student wrote is in the report."""
    text = dumps(hostile())
    text.encode("utf-8")
    read = json.loads(text)
    assert read["submission"]["name"] == NASTY.replace("\ud800", "\ufffd")
    assert len(read["exercises"][0]["criteria"][0]["reason"]) > 100_000


def test_printed_json_cannot_steer_a_terminal() -> None:
    """No control and no direction override stands raw in the text."""
    assert not set(dumps(hostile())) & {"\x1b", "\x07", "\x9b", "\u202e", "\u202c", "\u200b", "\r", "\t"}


def test_people_can_read_the_json() -> None:
    """Degrees and the like stay as they are."""
    assert "30 °C" in dumps(perfect())


def test_an_undecided_report_is_not_final() -> None:
    """A program need not look through the criteria."""
    assert report_to_json(undecided())["final"] is False


def test_only_the_duration_differs_between_two_runs() -> None:
    """The same verdicts give the same bytes."""
    assert dumps(middling()) == dumps(middling())


@given(st.text(alphabet=st.characters(), max_size=60))
def test_any_text_survives_the_round_trip(text: str) -> None:
    """Whatever can be encoded is read back as it was."""
    whole = report(exercise("e", "1", "E", criterion("c", "C", 1, reason=text, evidence={text: text})), name=text)
    encodable = "".join("\ufffd" if "\ud800" <= c <= "\udfff" else c for c in text)
    read = json.loads(dumps(whole).encode("utf-8"))
    assert read["submission"]["name"] == encodable
    assert read["exercises"][0]["criteria"][0]["evidence"] == {encodable: encodable}
