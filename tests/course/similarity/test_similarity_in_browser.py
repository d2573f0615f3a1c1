"""The page that shows two similar submissions side by side, in a real browser: what it loads, and what it runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import copies
import pytest
from class_samples import FakeScheduler, course, grade, hand_in
from tiers import more

if TYPE_CHECKING:
    from playwright.sync_api import Browser

pytestmark = [pytest.mark.browser, pytest.mark.xdist_group("browser")]

TEXT = "import rclpy\n\n\nclass Pub:\n" + "".join(
    f"    def step_{k}(self, a, b):\n        self.x_{k} = [a * {k}, b % {k + 2}]\n        return self.x_{k}[a > {k}]\n"
    for k in range(12)
)
EVIL = "<img src=x onerror=document.title='owned'>"


@pytest.fixture
def results(tmp_path: Path) -> Path:
    """Return the results of a class of two, one of them with a hostile name, who wrote the same in other names."""
    folder = hand_in(tmp_path / "in", **{EVIL: 10, "bob": 7})
    comment = "    # </code></pre><script>document.title='owned'</script>\n"
    (folder / EVIL / "a.py").write_text(TEXT + comment, encoding="utf-8")
    (folder / "bob" / "a.py").write_text(copies.renamed(TEXT), encoding="utf-8")
    grade(course(folder, tmp_path / "out", given=()), FakeScheduler())
    return tmp_path / "out"


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("width", [1280, *more([390])])
def test_two_submissions_side_by_side(browser: Browser, results: Path, width: int) -> None:
    """From the class to the pair by links; side by side where there is room; nothing runs, nothing is loaded."""
    context = browser.new_context(viewport={"width": width, "height": 900})
    page = context.new_page()
    said: list[str] = []
    asked: list[str] = []
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto((results / "index.html").as_uri())
    page.click("text=Similar submissions")
    page.on("request", lambda request: asked.append(request.url))
    page.click("text=Pair 1")
    left, right = (side.bounding_box() for side in page.locator(".side").all())
    assert left is not None
    assert right is not None
    assert (left["y"] == right["y"]) == (width > 1000)
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    assert page.locator(".side").first.locator("mark").count() > 20
    assert EVIL in page.inner_text("h1")
    assert page.title() == f"Pair 1: bob and {EVIL}"
    assert "<script>document.title='owned'</script>" in page.inner_text("main")
    assert asked == [(results / "similarity" / "pair-001.html").as_uri()]
    assert said == []
    page.click("text=All pairs")
    assert page.inner_text("h1") == "Similar submissions"
    context.close()
