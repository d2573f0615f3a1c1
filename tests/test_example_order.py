"""Programs of growing quality get growing scores in each example of a robot, whatever the seed draws."""

from __future__ import annotations

from itertools import pairwise

import pytest
from places import ROOT

from grader.grading.app.grade import grade_in
from grader.grading.app.request import GradeRequest
from grader.runtime.session import open_session

#: Submissions of an example, the worst first.
ORDER = {
    "emergency_brake": [
        "template",
        "wrong/takes_dust_for_walls",
        "wrong/looks_straight_ahead",
        "wrong/never_lets_go",
        "reference",
    ],
    "goal_client": ["template", "wrong/all_at_once", "wrong/never_cancels", "wrong/dawdles", "reference"],
    "wall_follower": [
        "template",
        "wrong/left_or_right",
        "wrong/stays_in_the_corner",
        "wrong/measures_from_its_side",
        "reference",
    ],
}
#: Each seed draws places, speeds, noise and delays anew.
SEEDS = 20


@pytest.mark.nightly
@pytest.mark.ros
@pytest.mark.parametrize("name", sorted(ORDER))
def test_a_better_program_gets_more_points_whatever_is_drawn(name: str) -> None:
    """In the same order under each seed, with full points for the reference; the same seed gives the same scores."""
    folder = ROOT / "examples" / name
    with open_session("auto", 2, lambda _: None) as session:

        def scores(seed: int) -> list[float]:
            requests = (
                GradeRequest(submission=str(folder / one), rubrics=(folder / f"{name}.yaml",), seed=seed)
                for one in ORDER[name]
            )
            reports = [grade_in(session, request, lambda _: None, pictures=False) for request in requests]
            return [float(report.score / report.max_score) for report in reports]

        found = {seed: scores(seed) for seed in range(1, SEEDS + 1)}
        again = scores(1)
    assert {seed: row for seed, row in found.items() if any(a >= b for a, b in pairwise(row)) or row[-1] < 1} == {}
    assert again == found[1]
