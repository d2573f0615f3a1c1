"""The page of a class of 300 in a real browser: sorting, searching, filters, links, and hostile names."""

from __future__ import annotations

import re
import shutil
from collections.abc import Iterator
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any
from urllib.parse import unquote, urlparse

import made_class
import pytest
from tiers import NIGHTLY, more

if TYPE_CHECKING:
    from playwright.sync_api import Browser, Page

pytestmark = [pytest.mark.browser, pytest.mark.xdist_group("browser")]

COUNT = 300


@pytest.fixture(scope="module")
def results(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Path]:
    """Return the folder with the results of a class."""
    folder = tmp_path_factory.mktemp("class")
    yield made_class.make_class(folder, COUNT)
    shutil.rmtree(folder, ignore_errors=True)


class Visit:
    """A page that was opened, what its console said, and what it asked for."""

    def __init__(self, browser: Browser, folder: Path, name: str = "index.html", **options: Any) -> None:
        self.context = browser.new_context(**{"viewport": {"width": 1280, "height": 900}, **options})
        self.page = self.context.new_page()
        self.said: list[str] = []
        self.asked: list[str] = []
        self.page.on("console", lambda message: self.said.append(message.text))
        self.page.on("pageerror", lambda error: self.said.append(str(error)))
        self.page.on("request", lambda request: self.asked.append(request.url))
        self.page.goto((folder / name).as_uri())
        self.page.wait_for_selector("html[data-ready=yes]")


@pytest.fixture(scope="module")
def visit(browser: Browser, results: Path) -> Iterator[Visit]:
    """Return the page, opened once for all tests."""
    made = Visit(browser, results)
    yield made
    made.context.close()


@pytest.fixture
def page(visit: Visit) -> Iterator[Page]:
    """Return the page with everybody in the order of surnames; afterwards its console is still silent."""
    visit.page.evaluate(
        "() => { document.getElementById('all').click(); const head = document.querySelector('th[data-sort=surname]');"
        " if (head.getAttribute('aria-sort') !== 'ascending') head.firstElementChild.click(); }"
    )
    yield visit.page
    assert visit.said == []


def rows(page: Page) -> list[list[str]]:
    """Return the cells of all rows that are shown, those further down included."""
    page.evaluate("() => { const more = document.getElementById('more'); while (!more.hidden) more.click(); }")
    found: list[list[str]] = page.evaluate(
        "[...document.querySelectorAll('#table tbody tr')].map((r) => [...r.cells].map((c) => c.innerText))"
    )
    return found


def number_in(text: str) -> int:
    """Return the number that a text begins with."""
    found = re.match(r"\d+", text)
    assert found
    return int(found[0])


def finals(page: Page) -> list[float]:
    """Return the final scores that are shown, in order."""
    return [float(cells[4]) for cells in rows(page) if cells[4]]


def shown(page: Page) -> int:
    """Return how many rows the page says it shows."""
    return int(page.inner_text("#shown").split()[0])


def test_the_page_loads_its_own_files_and_draws(visit: Visit, page: Page, results: Path) -> None:
    """Nothing else is asked for, the console is silent, and the bars are there."""
    assert {urlparse(url).scheme for url in visit.asked} == {"file"}
    assert all(unquote(urlparse(url).path).startswith(str(results)) for url in visit.asked)
    assert page.locator("[data-figure=scores] svg path").count() > 10
    assert page.locator("#criteria .bar rect").count() > 30
    assert shown(page) == COUNT


def called(page: Page) -> list[str]:
    """Return the names that are shown, in order."""
    return [cells[0].split("\n")[0] for cells in rows(page)]


@pytest.mark.nightly
def test_the_table_sorts_by_score_and_by_name(page: Page) -> None:
    """Down, up, and back to surnames; whoever has no score comes last; the order is told to who listens."""
    head = page.locator("th[data-sort=final]")
    head.get_by_role("button").click()
    down = finals(page)
    assert head.get_attribute("aria-sort") == "descending"
    assert down == sorted(down, reverse=True)
    assert rows(page)[-1][4] == ""
    head.get_by_role("button").click()
    assert head.get_attribute("aria-sort") == "ascending"
    assert finals(page) == down[::-1]
    assert rows(page)[-1][4] == ""
    assert page.locator("[aria-sort]").count() == 1
    assert page.input_value("#sort") == "final up"
    page.locator("th[data-sort=surname] button").focus()
    page.keyboard.press("Enter")
    names = called(page)
    assert len(names) == COUNT
    assert names.index("Fatima Abe") < names.index("Zoë Missing") < names.index("Ada Novák")
    assert page.input_value("#sort") == "surname"
    page.select_option("#sort", "name")
    first = called(page)
    assert sorted(first) == sorted(names)
    assert first.index("Ada Novák") < first.index("Fatima Abe") < first.index("Zoë Missing")
    page.select_option("#sort", "final")
    assert finals(page) == down


@pytest.mark.long
def test_students_stand_before_causes_and_most_causes_are_folded(page: Page) -> None:
    """Eight causes are open to see; a folded one is numbered on and shows its students, too."""
    ids = page.evaluate("[...document.querySelectorAll('main > section')].map((s) => s.id)")
    assert ids.index("students") < ids.index("causes")
    causes = page.locator(".causes > li")
    visible = [causes.nth(k).is_visible() for k in range(causes.count())]
    assert visible == [True] * 8 + [False] * (causes.count() - 8)
    assert causes.count() > 8
    page.locator(".more-causes > summary").click()
    last = causes.last
    last.get_by_role("button").click()
    assert shown(page) == int(last.locator(".size strong").inner_text())
    page.locator(".more-causes > summary").click()


@pytest.mark.long
def test_searching_finds_whom_one_means(page: Page) -> None:
    """Every word counts, accents and capitals do not; an empty search shows everybody."""
    page.fill("#search", "elodie ABE")
    assert [cells[0].split("\n")[0] for cells in rows(page)] == ["Élodie Abe"]
    page.fill("#search", "lab machine")
    assert shown(page) == 1
    page.fill("#search", "nobody is called so")
    assert shown(page) == 0
    page.get_by_role("button", name="Show all").click()
    assert shown(page) == COUNT


@pytest.mark.long
def test_filters_narrow_the_table_down(page: Page) -> None:
    """By a criterion that was not met, by outcome, by status, by score."""
    cell = page.locator("button[data-criterion='odom_subscriber/log_period'][data-outcome=not_met]")
    count = number_in(cell.inner_text())
    page.select_option("#criterion", "odom_subscriber/log_period")
    assert page.input_value("#outcome") == "lost"
    assert shown(page) == count == len(rows(page))
    page.select_option("#outcome", "met")
    assert shown(page) > count
    page.click("#all")
    page.select_option("#status", "undecided")
    assert {cells[1] for cells in rows(page)} == {"undecided"}
    page.select_option("#status", "")
    page.fill("#least", "60")
    page.fill("#most", "80")
    assert finals(page)
    assert all(60 <= score <= 80 for score in finals(page))


@pytest.mark.long
def test_a_number_and_a_cause_show_their_students(page: Page) -> None:
    """The table shows just as many, and the keyboard is there."""
    cell = page.locator("button[data-criterion='velocity_publisher/rate'][data-outcome=blocked]")
    count = number_in(cell.inner_text())
    cell.focus()
    page.keyboard.press("Enter")
    assert shown(page) == count
    cause = page.locator(".causes > li").first
    cause.get_by_role("button").click()
    assert shown(page) == int(cause.locator(".size strong").inner_text())
    assert page.evaluate("document.activeElement.id") == "shown"


@pytest.mark.long
def test_a_bar_shows_its_students_to_the_keyboard(page: Page) -> None:
    """Arrows walk over the bars and are told, Enter filters."""
    page.locator("[data-figure=scores] .drawing").focus()
    for _ in range(9):
        page.keyboard.press("ArrowRight")
    assert "80 to 90 %" in (page.text_content("[data-said]") or "")
    page.keyboard.press("Enter")
    assert all(80 <= score < 90 for score in finals(page))


@pytest.mark.long
def test_every_link_leads_to_a_file_of_the_class(page: Page, results: Path) -> None:
    """Also those of students with odd names; one is followed."""
    rows(page)
    links = page.evaluate("[...document.querySelectorAll('a[href]')].map((a) => a.href)")
    paths = {unquote(urlparse(link).path) for link in links}
    assert len([path for path in paths if path.endswith("/report.html")]) == COUNT - 3
    assert all(path.startswith(str(results)) for path in paths)
    assert [path for path in paths if not (results / path).is_file()] == []
    other = page.context.new_page()
    other.goto(next(link for link in links if "javascript" in link and link.endswith("report.html")))
    assert other.inner_text("h1") == made_class.HOSTILE[2]
    other.close()


@pytest.mark.long
def test_pages_of_students_follow_each_other_as_the_table_does(page: Page) -> None:
    """From the first page to the last, names and all; then back to the class."""
    rows(page)
    linked = page.evaluate("[...document.querySelectorAll('#table tbody th a')].map((a) => [a.innerText, a.href])")
    other = page.context.new_page()
    other.goto(linked[0][1])
    assert other.locator("[rel=prev]").count() == 0
    for (name, address), (before, _) in zip(linked[1:6], linked, strict=False):
        other.click("[rel=next]")
        assert other.url == address
        assert name in other.title() or name in other.inner_text("h1")
        assert before in other.inner_text("[rel=prev]")
    other.goto(linked[-1][1])
    assert other.locator("[rel=next]").count() == 0
    other.click("nav[aria-label=Class] a >> nth=0")
    assert urlparse(other.url).path.endswith("/results/index.html")
    other.close()


@pytest.mark.long
def test_hostile_names_stay_text(visit: Visit, page: Page) -> None:
    """No element, no handler and no script comes of a name; direction marks are shown as what they are."""
    rows(page)
    assert page.title().startswith("homework")
    assert (
        page.evaluate("document.querySelectorAll('img, iframe, object, embed, [onclick], [onerror], [onload]').length")
        == 0
    )
    assert page.evaluate("document.scripts.length") == 3
    text = page.inner_text("#table")
    for name in (
        "<img src=x onerror=document.title='owned'>",
        "evil\\u202edrowssap\\u202c",
        "two\\nlines",
        "{{ 7*7 }}",
        "مريم",
    ):
        assert name in text
    assert not [url for url in visit.asked if "owned" in url]


@pytest.mark.breadth(0, 1)
@pytest.mark.long
@pytest.mark.parametrize("most", [833, 98765])
def test_the_numbers_of_a_large_class_fit_into_the_chart(browser: Browser, results: Path, most: int) -> None:
    """Those beside its axis as well."""
    source = (results / "index.html").read_text(encoding="utf-8")
    source, changed = re.subn(r'(\["100 %",[0-9.]+,[0-9.]+),\d+,\d+\]', rf"\1,{most},{most}]", source)
    (results / "large.html").write_text(source, encoding="utf-8")
    large = Visit(browser, results, "large.html")
    drawing = large.page.locator("[data-figure=scores] .drawing svg")
    outer = drawing.bounding_box()
    texts = drawing.locator("text")
    boxes = [box for number in range(texts.count()) if (box := texts.nth(number).bounding_box()) is not None]
    said = texts.all_text_contents()
    large.context.close()
    assert changed == 1
    assert str(most) in said
    assert outer is not None
    assert min(box["x"] for box in boxes) >= outer["x"]


@pytest.mark.long
@pytest.mark.parametrize("scheme", ["light", *more(["dark"])])
def test_nothing_sticks_out_on_a_phone(browser: Browser, results: Path, scheme: str) -> None:
    """The page scrolls downwards only, and so does the table of students: the final score is first in each row."""
    size = {"width": 390, "height": 800}
    phone = Visit(browser, results, viewport=size, color_scheme=scheme, is_mobile=True, has_touch=True)
    width = phone.page.evaluate("document.documentElement.scrollWidth")
    overflow = phone.page.evaluate(
        "(() => { const t = document.querySelector('.tall'); return t.scrollWidth - t.clientWidth; })()"
    )
    row = phone.page.locator("#table tbody tr").first
    final, name = row.locator(".final").bounding_box(), row.locator("th a").bounding_box()
    phone.context.close()
    assert width <= 390
    assert overflow <= 0
    assert final is not None
    assert name is not None
    assert 0 < final["x"] < final["x"] + final["width"] <= name["x"]
    assert phone.said == []


@pytest.mark.long
def test_a_print_has_everybody(page: Page) -> None:
    """Rows that the screen shows later are on paper."""
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert page.locator("#table tbody tr").count() == COUNT
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.locator("#table tbody tr").count() < COUNT


@pytest.mark.long
def test_headings_and_controls_have_names(page: Page) -> None:
    """One h1, no level left out, every control named."""
    levels = page.evaluate("[...document.querySelectorAll('h1, h2, h3')].map((h) => Number(h.tagName[1]))")
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    unnamed = page.evaluate(
        "[...document.querySelectorAll('button, input, select, [tabindex=\"0\"]')].filter((e) => !e.hidden"
        " && !e.getAttribute('aria-label') && !e.getAttribute('aria-labelledby') && !e.textContent.trim()"
        " && !(e.labels && e.labels.length)).length"
    )
    assert unnamed == 0


@pytest.mark.long
def test_without_scripts_everybody_is_there(browser: Browser, results: Path) -> None:
    """The table, the causes and the lists need none."""
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto((results / "index.html").as_uri())
    count, text = page.locator("#table tbody tr").count(), page.inner_text("main")
    context.close()
    assert count == COUNT
    assert "need JavaScript" in text


@pytest.mark.nightly
@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize("scheme", ["light", *more(["dark"], NIGHTLY)])
@pytest.mark.parametrize("width", [*more([1280]), 390])
def test_axe_finds_nothing(browser: Browser, results: Path, scheme: str, width: int) -> None:
    """On the page of the class with everything unfolded, and on the page of a student with links to others."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install -e '.[dev]'")
    # The page allows no scripts but its own: the checker needs a way round.
    seen = Visit(browser, results, viewport={"width": width, "height": 900}, color_scheme=scheme, bypass_csp=True)
    seen.page.evaluate("document.querySelectorAll('details').forEach((details) => { details.open = true; })")
    found = axe.Axe().run(seen.page).response["violations"]
    seen.page.goto(seen.page.locator("#table tbody th a").nth(3).evaluate("(a) => a.href"))
    found += axe.Axe().run(seen.page).response["violations"]
    seen.context.close()
    assert [(each["id"], [node["target"] for node in each["nodes"]]) for each in found] == []
