"""Labels of a chart can be read: none lies on another, however far the points lie from the bands."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import combinations
from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from report_samples import criterion, exercise, report
from tracing import velocity

from grader.judging.checks.rate import TopicRate
from grader.reporting.html.render import render_html

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = pytest.mark.browser

#: Left, top, right, bottom.
Box = Sequence[float]

CHECK = TopicRate("/cmd_vel", rate=20.0, tolerance=1.0, window=10_000_000_000, partly_tolerance=2.0)

BOXES = """() => [...document.querySelectorAll(".drawing svg text")]
    .filter((text) => / Hz: (full|half the) points/.test(text.textContent))
    .map((text) => text.getBoundingClientRect())
    .map((box) => [box.left, box.top, box.right, box.bottom])"""


def overlap(one: Box, other: Box) -> bool:
    """Return whether two boxes share more than a pixel in both directions."""
    across = min(one[2], other[2]) - max(one[0], other[0])
    down = min(one[3], other[3]) - max(one[1], other[1])
    return across > 1 and down > 1


@pytest.mark.parametrize(("rate_hz", "width"), [(2, 390), (10, 1100), (1000, 390)])
def test_labels_of_bands_lie_apart(browser: Browser, tmp_path: Path, rate_hz: int, width: int) -> None:
    """Two bands of a few pixels each still have a label each that can be read."""
    file = tmp_path / "report.html"
    chart = CHECK.chart(velocity(rate=rate_hz).trace("alone"))
    judged = exercise("velocity_publisher", "1", "Velocity publisher", criterion("rate", "Rate", 10), figures=(chart,))
    file.write_text(render_html(report(judged)), encoding="utf-8")
    page = browser.new_page(viewport={"width": width, "height": 900})
    page.goto(file.as_uri())
    page.wait_for_selector("html[data-ready=yes]", timeout=20_000)
    boxes = page.evaluate(BOXES)
    page.close()
    assert len(boxes) >= 2
    assert [pair for pair in combinations(boxes, 2) if overlap(*pair)] == []
