"""Feedback in a rubric: for the whole, for one criterion, and until which day."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from stand_in_checks import CHECKS

from grader.grading.model.exercise import OPEN, ORDER, Feedback, Shows, strictest
from grader.grading.rubrics.loader import read_rubric

RUBRIC = """\
schema: grader/rubric/v1
exercise: {{id: pump, number: 7, title: A pump}}
files: [pump.py]
{top}
scenarios:
  - {{id: alone, processes: [pump.py], observe: {{duration: 10 s}}}}
criteria:
  - id: flows
    title: Publishes the flow
    points: 6
    scenario: alone
    check: {{publishes: {{topic: /flow, type: std_msgs/msg/Float32}}}}
    {one}
  - id: logs
    title: Logs
    points: 1
    scenario: alone
    check: {{uses_logger: {{process: pump.py}}}}
"""


@pytest.fixture
def feedback(tmp_path: Path) -> Callable[..., Any]:
    """Return the feedback of the two criteria of a rubric."""

    def read(top: str = "", one: str = "") -> list[Feedback]:
        path = Path(tmp_path, "r.yaml")
        path.write_text(RUBRIC.format(top=top, one=one))
        return [criterion.feedback for criterion in read_rubric(path, checks=CHECKS).criteria]

    return read


def test_without_a_word_all_is_shown(feedback: Callable[..., Any]) -> None:
    """A rubric of before means what it meant."""
    assert feedback() == [OPEN, OPEN]


def test_the_rubric_speaks_for_criteria_that_say_nothing(feedback: Callable[..., Any]) -> None:
    """A criterion's own setting takes precedence, in either direction."""
    assert feedback(top="feedback: outcome_only", one="feedback: all") == [OPEN, Feedback(Shows.OUTCOME)]


@pytest.mark.parametrize("until", ["2026-12-01", "due_date", "published"])
def test_a_result_can_wait(feedback: Callable[..., Any], until: str) -> None:
    """A date need not be quoted, though YAML knows dates."""
    found = feedback(one=f"feedback: {{show: nothing, until: {until}}}")
    assert found == [Feedback(Shows.NOTHING, until), OPEN]


def test_the_date_is_the_last_day() -> None:
    """On the day itself it still holds; what only a platform knows never comes by a date."""
    policy = Feedback(Shows.NOTHING, "2026-12-01")
    assert [policy.on(day) for day in ("2026-11-30", "2026-12-01", "2026-12-02")] == [
        Shows.NOTHING,
        Shows.NOTHING,
        Shows.ALL,
    ]
    assert Feedback(Shows.NOTHING, "due_date").on("9999-12-31") is Shows.NOTHING
    assert Feedback(Shows.OUTCOME).on("9999-12-31") is Shows.OUTCOME


def test_the_closest_of_several() -> None:
    """From everything to nothing; of none, everything."""
    assert strictest(()) is Shows.ALL
    assert strictest((Shows.OUTCOME, Shows.ALL, Shows.WITHOUT_NUMBERS)) is Shows.OUTCOME
    assert ORDER[-1] is Shows.NOTHING
