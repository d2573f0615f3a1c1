"""What results of a self-test count as, and how they are shown."""

from __future__ import annotations

import json
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import Any

import jsonschema
import pytest

import grader.course.mutation
from grader.course.mutation.results import Fate, SelftestResult, Trial, TrialResult, one_line_change, unified_change
from grader.course.mutation.showing import render_selftest, selftest_to_json
from grader.grading.model.exercise import Outcome

MET, PARTLY, NOT_MET, BLOCKED, UNDECIDED = Outcome
SCHEMA = json.loads((Path(grader.course.mutation.__file__).parent / "selftest.schema.json").read_text(encoding="utf-8"))


def trial_result(rate: Outcome = MET, speed: Outcome = MET) -> TrialResult:
    """Return what a program is worth under two criteria."""
    outcomes = {"rate": rate, "speed": speed}
    reasons = {id_: f"{id_} is {outcome.value}" for id_, outcome in outcomes.items() if outcome is not MET}
    points = {MET: 2, PARTLY: 1, NOT_MET: 0, BLOCKED: 0, UNDECIDED: 0}
    return TrialResult(Fraction(sum(points[o] for o in outcomes.values())), Fraction(4), outcomes, reasons)


def trial(number: int, **attributes: Any) -> Trial:
    """Return a mutant."""
    outcomes = {name: attributes.pop(name) for name in ("rate", "speed") if name in attributes}
    given = {"diff": f"-a\n+{number}", **attributes}
    return Trial(f"a.py:{number}:period:x", "a.py", "period", f"a => {number}", trial_result(**outcomes), **given)


def result(*mutants: Trial, **attributes: Any) -> SelftestResult:
    """Return what came of a rubric whose every criterion was turned once."""
    always = (trial(1, rate=NOT_MET), trial(2, speed=PARTLY))
    given: dict[str, Any] = {
        "template": trial_result(NOT_MET, BLOCKED),
        "baseline": Fraction(0),
        "variants": (),
        **attributes,
    }
    return SelftestResult(
        "r.yaml", "fan", ("rate", "speed"), given.pop("reference", trial_result()), mutants=(*always, *mutants), **given
    )


@pytest.mark.parametrize(
    ("outcomes", "fate"),
    [
        ((MET, MET), Fate.SURVIVED),
        ((PARTLY, MET), Fate.KILLED),
        ((BLOCKED, MET), Fate.KILLED),
        ((UNDECIDED, NOT_MET), Fate.KILLED),
        ((UNDECIDED, MET), Fate.UNDECIDED),
    ],
)
def test_what_becomes_of_a_mutant(outcomes: tuple[Outcome, Outcome], fate: Fate) -> None:
    """A trouble of the grader's neither kills it nor lets it survive."""
    assert trial_result(*outcomes).fate is fate


def told(number: float, share: float) -> dict[str, Any]:
    """Return what the evidence says of a number."""
    return {"rate": {"name": "difference from the rate", "unit": "Hz", "number": number, "share": share}}


def test_it_says_how_near_the_best_wrong_program_comes() -> None:
    """By each criterion with a share of the points, among the mutants that it marks down."""
    reference = replace(trial_result(), measured=told(0.1, 1.0))
    none = result(reference=reference)
    assert [(n.criterion, n.wrong, n.trial) for n in none.nearest] == [("rate", None, "")]
    assert "rate: difference from the rate 0.1 Hz for the reference; no mistake loses points by it" in shown_words(none)
    outcomes = ((NOT_MET, 5.0, 0.0), (PARTLY, 0.5, 0.9), (PARTLY, 1.0, 0.8), (MET, 0.2, 1.0))
    mutants = [
        replace(t, result=replace(t.result, measured=told(number, share)))
        for k, (outcome, number, share) in enumerate(outcomes, 3)
        for t in [trial(k, rate=outcome, speed=NOT_MET)]
    ]
    found = result(*mutants, reference=reference)
    (near,) = found.nearest
    assert (near.reference, near.wrong, near.share, near.trial) == (0.1, 0.5, 0.9, "a.py:4:period:x")
    words = "0.5 Hz for the best mistake that it marks down, which keeps 90.0% of the points: a.py:4:period:x"
    assert words in shown_words(found)
    data = json.loads(selftest_to_json([found]))
    jsonschema.validate(data, SCHEMA)
    assert data["rubrics"][0]["nearest"][0]["wrong"] == 0.5


def shown_words(of: SelftestResult) -> str:
    """Return how a result is shown, on one line."""
    return " ".join(render_selftest([of], width=300, colour=False).split())


def test_a_rubric_without_a_known_hole_passes() -> None:
    """Everything was noticed, or the author says why not."""
    assert result(trial(3, because="it is the same")).passed


@pytest.mark.parametrize(
    "holed",
    [
        result(trial(3)),
        result(reference=trial_result(rate=PARTLY)),
        result(baseline=Fraction(1)),
        result(variants=(trial(4, rate=NOT_MET),)),
        replace(result(), mutants=(trial(1, rate=NOT_MET), trial(2, speed=BLOCKED))),
    ],
    ids=["survivor", "reference", "template", "variant", "never turned"],
)
def test_a_hole_is_a_hole(holed: SelftestResult) -> None:
    """A survivor, a reference or a variant that loses points, another baseline, a criterion that never turned."""
    assert not holed.passed


def test_undecided_mutants_are_set_apart() -> None:
    """They are no survivors, and turn nothing."""
    found = replace(result(), mutants=(trial(1, rate=NOT_MET), trial(2, speed=UNDECIDED)))
    assert [t.id for t in found.undecided] == ["a.py:2:period:x"]
    assert found.survivors == ()
    assert found.never_turned == ("speed",)


def test_a_part_of_the_mutants_says_nothing_about_what_never_turned() -> None:
    """The others may turn it."""
    assert replace(result(), mutants=(), whole=False).never_turned == ()


def test_a_criterion_that_nothing_turns_may_be_explained() -> None:
    """The text shows why."""
    found = replace(result(), mutants=(trial(1, rate=NOT_MET),), unturned={"speed": "it is the last"})
    assert found.passed
    assert "speed detects no mutant because it is the last" in render_selftest([found], width=80, colour=False)


def test_only_a_named_criterion_kills_as_expected() -> None:
    """Where the author names some, one of them has to be turned."""
    assert trial(1, rate=NOT_MET, expected=("rate", "speed")).as_expected
    assert not trial(1, rate=NOT_MET, speed=BLOCKED, expected=("speed",)).as_expected
    assert trial(1, rate=NOT_MET).as_expected
    assert not trial(1, expected=("rate",)).as_expected


@pytest.mark.parametrize(
    ("before", "after", "change"),
    [
        ("a\n  b\nc\n", "a\n  d\nc\n", "b => d"),
        ("a\nb\n", "a\n", "b => (nothing)"),
        ("a\n", "a\n\nb\nc\n", "(nothing) => b ¶ c"),
        ("a\nb\n", "b\na\n", "moved: b"),
    ],
)
def test_a_change_fits_on_one_line(before: str, after: str, change: str) -> None:
    """Old lines, then new ones, without indentation."""
    assert one_line_change(before, after) == change


def test_a_change_is_shown_as_a_diff() -> None:
    """With a line around it, so that its place can be seen."""
    diff = unified_change("a\nb\nc\nd\n", "a\nb\nx\nd\n")
    assert diff == "@@ -2,3 +2,3 @@\n b\n-c\n+x\n d"
    text = render_selftest([result(trial(3, diff=diff))], width=80, colour=False)
    assert "    @@ -2,3 +2,3 @@\n     b\n    -c\n    +x\n     d\n" in text
    long = "\n".join(f"+{n}" for n in range(50))
    assert "    ... and 20 more lines\n" in render_selftest([result(trial(3, diff=long))], width=80, colour=False)


def everything() -> SelftestResult:
    """Return a result with something of every kind, and hostile text."""
    hostile = Trial("a\x1b[31m.py:1:text:\u202e", "a\x1b.py", "text", "x\n::error::y", trial_result())
    return result(
        hostile,
        trial(3, because="the same"),
        trial(4, speed=NOT_MET, expected=("rate",)),
        trial(5, rate=UNDECIDED),
        variants=(trial(6, rate=NOT_MET), trial(7, rate=NOT_MET, because="asked for")),
        idle=("r.selftest.yaml:3:5: `x` explains nothing",),
    )


def test_the_text_names_every_kind() -> None:
    """Survivors with their change, explanations, other killers, what is undecided, and idle patterns."""
    text = render_selftest([everything()], width=100, colour=False)
    assert "fan (r.yaml): HAS HOLES" in text
    assert "6 tried, 3 detected, 1 survived, 1 more survived for a reason in the notes, 1 undecided" in text
    for part in ("because the same", "expected rate", "    -a\n    +5\n", "because asked for", "`x` explains nothing"):
        assert part in text
    assert "\x1b" not in text
    assert "\u202e" not in text
    assert not [line for line in text.splitlines() if line.startswith("::")]
    assert max(map(len, text.splitlines())) <= 100


def test_without_a_right_reference_the_text_says_why_nothing_was_tried() -> None:
    """And which criteria it lost."""
    text = render_selftest([replace(result(reference=trial_result(rate=PARTLY)), mutants=())], width=80, colour=False)
    assert "none tried" in text
    assert "rate: rate is partly" in text


def test_the_json_fits_its_schema() -> None:
    """Also with hostile text and with nothing at all."""
    jsonschema.Draft202012Validator.check_schema(SCHEMA)
    for found in (everything(), replace(result(), mutants=(), template=None, baseline=None)):
        data = json.loads(selftest_to_json([found]))
        jsonschema.Draft202012Validator(SCHEMA).validate(data)
    assert data["passed"] is False
    assert data["rubrics"][0]["never_turned"] == ["rate", "speed"]
