"""Labels of a chart can be read: none lies on another, however close the lines are that they name."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from report_samples import criterion, exercise, report
from tiers import more

from grader.grading.model.chart import Chart, Level, Panel, Series, Tone, VerticalLine
from grader.grading.model.exercise import Outcome
from grader.grading.reporting.html.render import render_html

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.browser, pytest.mark.xdist_group("browser")]

#: Left, top, right, bottom.
Box = Sequence[float]

#: Close levels, and moments at the end of a run that are closer than their labels are wide.
CHART = Chart(
    "labels",
    "Labels",
    "",
    ("rate",),
    "time",
    "s",
    (Panel("speed", "m/s", (Series("x", ((0.0, 0.0), (24.0, 9.0))),), levels=(Level(0.5, "a"), Level(0.52, "b"))),),
    (
        VerticalLine(6.0, "/odom begins"),
        VerticalLine(22.3, "/odom ends"),
        VerticalLine(23.0, "exception", Tone.BAD),
        VerticalLine(24.0, "end"),
    ),
    until_s=24.0,
)

BOXES = """() => [...document.querySelectorAll(".drawing svg text")]
    .filter((text) => ["a", "b", "/odom begins", "/odom ends", "exception", "end"].includes(text.textContent))
    .map((text) => [text.textContent, text.getBoundingClientRect()])
    .map(([text, box]) => [text, box.left, box.top, box.right, box.bottom])"""


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share more than a pixel in both directions."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return across > 1 and down > 1


@pytest.mark.parametrize("width", [390, *more([1100])])
def test_labels_lie_apart(browser: Browser, tmp_path: Path, width: int) -> None:
    """Every label that is shown can be read; where there is no room for all, faults come first."""
    file = tmp_path / "report.html"
    judged = exercise(
        "velocity_publisher",
        "1",
        "Velocity publisher",
        criterion("rate", "Rate", 10, Outcome.NOT_MET),
        figures=(CHART,),
    )
    file.write_text(render_html(report(judged)), encoding="utf-8")
    page = browser.new_context(viewport={"width": width, "height": 900}).new_page()
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-ready=yes]")
    labels = {text: box for text, *box in page.evaluate(BOXES)}
    page.close()
    assert {"a", "b", "/odom begins", "exception"} <= set(labels)
    assert max(box[2] for box in labels.values()) <= width
    assert [pair for pair in combinations(labels, 2) if overlap(labels[pair[0]], labels[pair[1]])] == []
