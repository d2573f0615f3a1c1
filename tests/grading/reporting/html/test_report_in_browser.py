"""The HTML report in a real browser: every picture is drawn, nothing is loaded, and hostile text stays text."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import replace
from itertools import pairwise
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol
from urllib.parse import quote

import graded
import pytest
from stepped import page_of_failed_test
from tiers import NIGHTLY, each, more

from grader.grading.model.chart import GraphFigure, Playback, Stage
from grader.grading.reporting.html.assets import bundle
from grader.grading.reporting.html.render import render_html
from grader.runtime.model.trace import GraphSnapshot, ServiceEnd

if TYPE_CHECKING:
    from playwright.sync_api import Browser, BrowserContext, Locator, Page

pytestmark = [pytest.mark.browser, pytest.mark.xdist_group("browser")]

MADE = {"perfect": graded.perfect, "wrong": graded.wrong, "crashed": graded.crashed}
ATTACKS = (
    "<img src=//198.51.100.1/x onerror=document.title='owned'>{{constructor.constructor('owned')()}}",
    "</script><script>document.title='owned'</script><svg onload=document.title='owned'>",
)


class Open(Protocol):
    """Opens a report; gives the page, what its console said and what it asked for."""

    def __call__(self, html: str, **options: Any) -> tuple[Page, list[str], list[str]]: ...


@pytest.fixture
def visit(browser: Browser, tmp_path: Path) -> Iterator[Open]:
    """Return a function that opens a report and gives the page, what its console said and what it asked for."""
    contexts: list[BrowserContext] = []

    def opened(html: str, **options: Any) -> tuple[Page, list[str], list[str]]:
        file = tmp_path / "report.html"
        file.write_text(html, encoding="utf-8")
        context = browser.new_context(**{"viewport": {"width": 1100, "height": 900}, **options})
        contexts.append(context)
        page = context.new_page()
        said: list[str] = []
        asked: list[str] = []
        page.on("console", lambda message: said.append(message.text))
        page.on("pageerror", lambda error: said.append(str(error)))
        page.on("request", lambda request: asked.append(request.url))
        page.goto(file.as_uri())
        page.wait_for_selector("html[data-ready=yes]")
        return page, said, asked

    yield opened
    for context in contexts:
        context.close()


def unfold(page: Page) -> None:
    """Unfold everything, and wait until the charts inside are drawn."""
    page.evaluate("document.querySelectorAll('details:not(.table)').forEach((details) => { details.open = true; })")
    page.locator("[data-figure] .drawing:not(:has(svg))").first.wait_for(state="detached")


def drawings(page: Page) -> list[tuple[str, bool]]:
    """Return (figure id, whether it has a picture of some size with something in it)."""
    found: list[tuple[str, bool]] = page.evaluate(
        """() => [...document.querySelectorAll("[data-figure]")].map((figure) => {
            const pictures = [...figure.querySelectorAll(".drawing svg")];
            const drawn = (svg) => svg.getBoundingClientRect().height > 30 && svg.querySelector("path, rect");
            return [figure.id, pictures.length > 0 && pictures.every(drawn)];
        })"""
    )
    return found


@pytest.mark.parametrize(("name", "scheme"), each([("wrong", "dark"), ("perfect", "light"), ("crashed", "light")], 3))
def test_every_figure_is_drawn_without_a_complaint_or_a_request(visit: Open, name: str, scheme: str) -> None:
    """The console is silent, and the page itself is all that was ever asked for."""
    page, said, asked = visit(render_html(MADE[name]()), color_scheme=scheme)
    unfold(page)
    drawn = drawings(page)
    assert len(drawn) >= 10
    assert [id_ for id_, there in drawn if not there] == []
    assert said == []
    assert [url for url in asked if not url.endswith("/report.html")] == []


@pytest.mark.nightly
def test_shared_files_beside_the_report_draw_the_same(visit: Open, tmp_path: Path) -> None:
    """A class keeps one copy of the scripts."""
    (tmp_path / "assets").mkdir()
    for name, content in bundle().files.items():
        (tmp_path / "assets" / name).write_bytes(content)
    page, said, asked = visit(render_html(graded.perfect(), assets="assets"))
    unfold(page)
    assert all(there for _, there in drawings(page))
    assert said == []
    assert {url.rsplit("/", 1)[1] for url in asked} == {"report.html", *bundle().files}


@pytest.mark.breadth(1, 0)
@pytest.mark.parametrize("text", each(ATTACKS, len(ATTACKS)))
def test_hostile_text_stays_text_wherever_it_is_shown(visit: Open, text: str) -> None:
    """In the page, in tooltips, in tables, in the legend and inside the charts."""
    page, said, asked = visit(render_html(graded.crashed(text)))
    unfold(page)
    for summary in page.query_selector_all("figure .table > summary"):
        summary.click()
    for drawing in page.query_selector_all(".drawing"):
        drawing.focus()
        page.keyboard.press("ArrowRight")
    assert page.evaluate("document.querySelectorAll('img, iframe, object, embed, [onload], [onerror]').length") == 0
    assert page.evaluate("document.scripts.length") == 2
    assert "owned" not in page.title().replace(text, "")
    assert text in page.inner_text("h1")
    assert said == []
    assert len(asked) == 1


@pytest.mark.nightly
def test_a_pointer_over_a_chart_is_told_the_value(visit: Open) -> None:
    """The tooltip shows the time and the value of what is under it."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    chart = page.locator("#velocity_publisher-rate .drawing")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 100)
    tip = chart.locator(".tip")
    tip.wait_for(state="visible")
    assert "time" in tip.inner_text()
    assert "20 Hz" in tip.inner_text()
    assert said == []


@pytest.mark.nightly
def test_a_pointer_over_answers_is_told_what_was_expected(visit: Open) -> None:
    """What was said long ago and still holds is in the tooltip as well."""
    page, _, _ = visit(render_html(graded.perfect()))
    unfold(page)
    title = "Messages received on /temperature and messages published on /fan_speed"
    figure = page.locator("figure", has=page.get_by_role("heading", name=title))
    figure.locator(".drawing").focus()
    page.keyboard.press("ArrowRight")
    page.keyboard.press("ArrowRight")
    said = figure.locator("[data-said]").text_content() or ""
    assert {part.split(" ")[1] for part in said.split(";")} == {"0.7", "/temperature", "expected", "/fan_speed"}


@pytest.mark.nightly
def test_a_pointer_over_a_timeline_is_told_what_was_logged(visit: Open) -> None:
    """The text of the record, as it was written."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    chart = page.locator("#odom_subscriber .recording figure > .drawing")
    chart.scroll_into_view_if_needed()
    box = chart.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 55)
    chart.locator(".tip .text").wait_for(state="visible")
    assert chart.locator(".tip .text").inner_text().startswith("x=")
    assert said == []


@pytest.mark.long
def test_keys_walk_along_a_chart_and_tell_a_screen_reader(visit: Open) -> None:
    """Arrow keys go from point to point; the words go to a live region."""
    page, _, _ = visit(render_html(graded.perfect()))
    unfold(page)
    chart = page.locator("[data-figure=velocity_publisher-1]")
    chart.locator(".drawing").focus()
    page.keyboard.press("ArrowRight")
    first = chart.locator("[data-said]").text_content() or ""
    page.keyboard.press("ArrowRight")
    assert first.startswith("time ")
    assert chart.locator("[data-said]").text_content() != first


def width_of(element: Locator) -> float:
    """Return how wide an element is on the screen."""
    box = element.bounding_box()
    assert box is not None
    return box["width"]


def window_of(page: Page, figure: str) -> list[float]:
    """Return which part of a chart is shown, in percent."""
    shown: list[float] = page.evaluate(
        """(id) => {
            const element = document.querySelector(`[data-figure=${id}] .drawing`);
            const { start, end } = echarts.getInstanceByDom(element).getOption().dataZoom[0];
            return [start, end];
        }""",
        figure,
    )
    return shown


def turn_wheel(page: Page, figure: str, *, ctrl: bool) -> bool:
    """Turn the wheel over a chart; return whether the chart keeps it from the page, once it has zoomed if it does."""
    kept: bool = page.evaluate(
        """async ([id, ctrlKey]) => {
            const target = document.querySelector(`[data-figure=${id}] .drawing svg`);
            const chart = echarts.getInstanceByDom(target.closest(".drawing"));
            const zoomed = new Promise((done) => chart.on("datazoom", done));
            const late = new Promise((done) => setTimeout(done, 10000));
            const box = target.getBoundingClientRect();
            const [clientX, clientY] = [box.x + box.width / 2, box.y + 100];
            const event = new WheelEvent("wheel", {
                deltaY: -200, wheelDeltaY: 200, clientX, clientY, ctrlKey, bubbles: true, cancelable: true,
            });
            target.dispatchEvent(event);
            if (event.defaultPrevented) await Promise.race([zoomed, late]);
            return event.defaultPrevented;
        }""",
        [figure, ctrl],
    )
    return kept


@pytest.mark.long
def test_buttons_keys_and_the_wheel_zoom(visit: Open) -> None:
    """In, out, along and back to all of it."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    figure = "velocity_publisher-1"
    tools = page.locator(f"[data-figure={figure}] .tools")
    assert window_of(page, figure) == [0, 100]
    tools.get_by_label("Zoom in").click()
    assert window_of(page, figure) == [25, 75]
    tools.get_by_label("Later").click()
    assert window_of(page, figure) == [50, 100]
    tools.get_by_label("Show all").click()
    assert window_of(page, figure) == [0, 100]
    drawing = page.locator(f"[data-figure={figure}] .drawing")
    drawing.focus()
    page.keyboard.press("+")
    assert window_of(page, figure) == [25, 75]
    page.keyboard.press("0")
    assert turn_wheel(page, figure, ctrl=True)
    assert window_of(page, figure)[0] > 0
    assert said == []


@pytest.mark.nightly
def test_the_wheel_alone_scrolls_the_page(visit: Open) -> None:
    """A chart under the pointer is no trap."""
    page, _, _ = visit(render_html(graded.perfect()))
    unfold(page)
    assert not turn_wheel(page, "velocity_publisher-1", ctrl=False)
    assert window_of(page, "velocity_publisher-1") == [0, 100]


@pytest.mark.nightly
def test_the_graph_lights_up_and_grows(visit: Open) -> None:
    """Hovering or focusing a node shows what it is connected to; the buttons enlarge the drawing."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    figure = page.locator("#two_node_communication [data-figure]", has=page.locator(".stages"))
    node = figure.locator("[data-box]").first
    node.focus()
    assert figure.locator(".edge.lit").count() > 0
    assert "publishes" in (figure.locator("[data-said]").text_content() or "")
    width = width_of(figure.locator("svg[viewBox]:not(.fold)").first)
    figure.get_by_label("Zoom in").click()
    assert width_of(figure.locator(".stage svg").first) > 1.5 * width
    assert said == []


def calling() -> GraphSnapshot:
    """Return a graph in which a node calls five services of another, which sends it goals."""
    names = [f"/service_{k}" for k in range(5)]
    ends = [ServiceEnd(kind, name, "T", node) for name in names for kind, node in (("client", "/a"), ("service", "/b"))]
    goal = "/go/_action/send_goal"
    ends += [ServiceEnd("client", goal, "G_SendGoal", "/b"), ServiceEnd("service", goal, "G_SendGoal", "/a")]
    return GraphSnapshot(0, ("/a", "/b"), (), tuple(ends))


@pytest.mark.breadth(1, 0)
def test_services_and_actions_are_in_the_graph_and_can_be_read_on_a_phone(visit: Open) -> None:
    """No box and no arrow lies outside of the picture, and its text is no smaller than 11 pixels."""
    report = graded.perfect()
    exercise = report.exercises[0]
    graph = GraphFigure(f"{exercise.id}-99", "Graph", "", (), (Stage("", calling()),))
    report = replace(report, exercises=(replace(exercise, figures=(*exercise.figures, graph)),))
    page, said, _ = visit(render_html(report), viewport={"width": 390, "height": 900})
    unfold(page)
    shown = page.locator(f"[data-figure={exercise.id}-99] .stage").evaluate(
        """(stage) => {
            const picture = stage.querySelector("svg");
            const place = stage.querySelector(".canvas").getBoundingClientRect();
            const parts = [...picture.querySelectorAll(".box, .arrow")].map((part) => part.getBoundingClientRect());
            return {
                boxes: [...picture.querySelectorAll("[data-box]")].map((box) => box.getAttribute("aria-label")),
                arrows: picture.querySelectorAll(".arrow").length,
                outside: parts.filter(({ left, right }) => left < place.left || right > place.right).length,
                scale: picture.getBoundingClientRect().width / picture.viewBox.baseVal.width,
            };
        }"""
    )
    assert set(shown["boxes"]) == {
        "node /a", "node /b", *(f"service /service_{k}, T" for k in range(5)), "action /go, G"
    }  # fmt: skip
    assert (shown["arrows"], shown["outside"]) == (12, 0)
    assert shown["scale"] * 13 >= 11
    assert said == []


@pytest.mark.nightly
def test_both_directions_are_in_the_graph(visit: Open) -> None:
    """The last situation shows temperature going one way and the fan speed the other."""
    page, _, _ = visit(render_html(graded.perfect()))
    unfold(page)
    stage = page.locator("#two_node_communication .stage").last
    names = dict(
        stage.evaluate(
            "(s) => [...s.querySelectorAll('[data-box]')].map((b) => [b.dataset.box, b.lastChild.textContent])"
        )
    )
    edges = stage.evaluate("(s) => [...s.querySelectorAll('.edge')].map((e) => [e.dataset.from, e.dataset.to])")
    assert {(names[a], names[b]) for a, b in edges} == {
        (graded.SENSOR, "/temperature"),
        ("/temperature", graded.CONTROLLER),
        (graded.CONTROLLER, "/fan_speed"),
        ("/fan_speed", graded.SENSOR),
    }


@pytest.mark.long
def test_every_chart_can_be_read_as_a_table(visit: Open) -> None:
    """All its numbers, with headings."""
    page, _, _ = visit(render_html(graded.perfect()))
    unfold(page)
    for figure in page.query_selector_all("[data-figure]"):
        summary = figure.query_selector(".table > summary")
        assert summary is not None
        summary.click()
        filled = figure.wait_for_selector(".scroll:not(:empty)")
        assert filled is not None
        assert filled.inner_text()
    rows = page.locator("[data-figure=velocity_publisher-1] tbody tr")
    assert rows.count() > 300


@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize("width", [320, *more([390], NIGHTLY)])
@pytest.mark.parametrize("name", each(MADE, len(MADE)))
def test_nothing_sticks_out_on_a_phone(visit: Open, name: str, width: int) -> None:
    """The page scrolls downwards only."""
    page, said, _ = visit(
        render_html(MADE[name]()), viewport={"width": width, "height": 700}, is_mobile=True, has_touch=True
    )
    unfold(page)
    assert page.evaluate("document.documentElement.scrollWidth") <= width
    assert all(there for _, there in drawings(page))
    assert said == []


@pytest.mark.long
def test_charts_stand_in_their_criterion_and_are_folded_with_it(visit: Open) -> None:
    """Only those of what cost points are drawn at once; the others when their criterion is unfolded."""
    page, said, _ = visit(render_html(graded.wrong()))
    assert page.locator("details.criterion.not_met[open] figure svg[aria-hidden]").count() > 0
    assert page.locator("details.criterion.met[open]").count() == 0
    folded = page.locator("#velocity_publisher-linear_velocity")
    assert folded.locator("figure").count() == 1
    assert folded.locator("figure .drawing svg").count() == 0
    folded.locator("summary").first.click()
    folded.locator("figure .drawing svg").wait_for()
    assert said == []


@pytest.mark.nightly
def test_charts_of_one_run_share_their_cursor_and_their_zoom(visit: Open) -> None:
    """What is under the pointer in one chart is told in the others, at the same moment."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    drawing = page.locator("[data-figure=velocity_publisher-1] .drawing")
    drawing.scroll_into_view_if_needed()
    box = drawing.bounding_box()
    assert box is not None
    page.mouse.move(box["x"] + box["width"] / 2, box["y"] + 100)
    tips = [page.locator(f"[data-figure=velocity_publisher-{n}] .tip b") for n in (1, 2)]
    for tip in tips:
        tip.wait_for(state="visible")
    assert len({tip.inner_text() for tip in tips}) == 1
    page.locator("[data-figure=velocity_publisher-1] .tools").get_by_label("Zoom in").click()
    assert window_of(page, "velocity_publisher-2") == [25, 75]
    assert said == []


@pytest.mark.nightly
def test_every_series_of_a_chart_has_a_look_of_its_own(visit: Open) -> None:
    """No two entries of a legend look the same, and what is expected is grey."""
    page, _, _ = visit(render_html(graded.wrong()))
    unfold(page)
    legends = page.evaluate(
        "[...document.querySelectorAll('figure .legend')].map((legend) => [...legend.children].map((entry) => {"
        " const path = entry.querySelector('path'); return [path.getAttribute('d') + path.style.cssText,"
        " entry.textContent]; }))"
    )
    assert sum(map(len, legends)) > 20
    assert [entries for entries in legends if len({look for look, _ in entries}) < len(entries)] == []
    expected = [look for entries in legends for look, name in entries if "points" in name or name == "expected"]
    assert len(expected) > 3
    assert all("--c-faint" in look for look in expected)


def moment_of(page: Page, exercise: str) -> dict[str, Any]:
    """Return what the player of an exercise's first recording shows."""
    shown: dict[str, Any] = page.evaluate(
        """(id) => {
            const player = document.querySelector(`#${id} .recording figure`);
            const robot = player.querySelector(".robot");
            const at = (name) => player.querySelector(`.moment .${name}`);
            return {
                time: Number(player.querySelector("input").value),
                button: player.querySelector("button").textContent,
                log: [...at("log").querySelectorAll("li:not([hidden])")].map((line) => line.innerText),
                values: at("values").innerText,
                absent: [...at("live").querySelectorAll(".absent[data-box]")].length,
                robot: robot && !robot.hidden && [robot.style.left, robot.style.top, robot.style.transform],
                heads: [...document.querySelectorAll(`#${id} .playhead`)].filter((head) => !head.hidden).length,
            };
        }""",
        exercise,
    )
    return shown


def scrub(page: Page, exercise: str, time_s: float) -> dict[str, Any]:
    """Move the slider of an exercise's first recording."""
    slider = page.locator(f"#{exercise} .recording input").first
    slider.evaluate("(e, t) => { e.value = t; e.dispatchEvent(new Event('input')); }", time_s)
    return moment_of(page, exercise)


@pytest.mark.nightly
def test_a_slider_shows_each_moment_of_the_run(visit: Open) -> None:
    """Robot, values, log and graph as they were then; charts of the run show where that is."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    before, early, late = (scrub(page, "odom_subscriber", t) for t in (2.0, 8.0, 20.0))
    assert before["robot"] is False
    assert before["log"] == []
    assert "nothing yet" in before["values"]
    assert early["robot"] != late["robot"]
    assert 0 < len(early["log"]) < len(late["log"])
    assert early["log"] == late["log"][: len(early["log"])]
    assert "pose.pose.position.x" in late["values"]
    assert early["values"] != late["values"]
    assert late["heads"] == 3
    assert said == []


@pytest.mark.nightly
def test_a_run_plays_until_it_is_paused_and_from_the_start_after_its_end(visit: Open) -> None:
    """With the pointer, and with the space bar on the slider; arrow keys move it."""
    page, said, _ = visit(render_html(graded.perfect()))
    unfold(page)
    run = page.locator("#odom_subscriber .recording")
    assert moment_of(page, "odom_subscriber")["time"] == pytest.approx(24, abs=0.1)
    run.get_by_label("Speed").select_option("5")
    run.get_by_role("button", name="Play").click()
    run.locator(".log li:not([hidden])").first.wait_for()
    run.get_by_role("button", name="Pause").click()
    paused = moment_of(page, "odom_subscriber")
    assert 0 < paused["time"] < 24
    assert len(paused["log"]) > 0
    slider = run.get_by_label("Time in the run")
    slider.focus()
    page.keyboard.press("ArrowRight")
    assert moment_of(page, "odom_subscriber")["time"] > paused["time"]
    assert "seconds" in (slider.get_attribute("aria-valuetext") or "")
    page.keyboard.press(" ")
    run.get_by_role("button", name="Play").wait_for()
    assert moment_of(page, "odom_subscriber")["time"] == pytest.approx(24, abs=0.1)
    assert said == []


@pytest.mark.nightly
def test_the_graph_of_a_moment_lacks_what_came_later(visit: Open) -> None:
    """A publisher that appears after four seconds is faint until then."""
    report = graded.perfect()
    exercise = report.exercises[0]
    played = next(f for f in exercise.figures if isinstance(f, Playback))
    (_, graph), *_ = played.graphs
    grown = replace(played, graphs=((0.0, replace(graph, endpoints=())), (4.0, graph)))
    figures = tuple(grown if f is played else f for f in exercise.figures)
    page, said, _ = visit(render_html(replace(report, exercises=(replace(exercise, figures=figures),))))
    unfold(page)
    assert [scrub(page, exercise.id, t)["absent"] for t in (3.9, 4.1)] == [1, 0]
    assert said == []


PAGES = re.compile(rb"/Type\s*/Page[^s]")


@pytest.mark.long
def test_a_print_is_short_and_shows_every_criterion(visit: Open) -> None:
    """Paper has the words of every criterion and the charts of the unfolded ones; afterwards all is as before."""
    page, said, _ = visit(render_html(graded.wrong()), color_scheme="dark")
    folded = page.locator("details.criterion:not([open])").count()
    page.evaluate("window.dispatchEvent(new Event('beforeprint'))")
    assert folded > 0
    assert page.locator("details.criterion:not([open])").count() == 0
    charts = "[...document.querySelectorAll('.drawing')].map((drawing) => echarts.getInstanceByDom(drawing))"
    assert page.evaluate(f"{charts}.find(Boolean).getOption().dataZoom.length") == 1
    page.evaluate("window.dispatchEvent(new Event('afterprint'))")
    assert page.locator("details.criterion:not([open])").count() == folded
    assert 2 <= len(PAGES.findall(page.pdf(prefer_css_page_size=True))) <= 4
    assert said == []


@pytest.mark.long
def test_a_link_to_a_folded_criterion_unfolds_it(visit: Open) -> None:
    """A colleague can be sent to the very place."""
    page, _, _ = visit(render_html(graded.perfect()))
    page.evaluate("location.hash = '#velocity_publisher-rate'")
    page.wait_for_selector("#velocity_publisher-rate[open]")


@pytest.mark.long
def test_a_place_leads_to_its_line_in_the_whole_file(visit: Open) -> None:
    """The file is folded until somebody wants to see it."""
    page, said, _ = visit(render_html(graded.crashed()))
    line = page.locator("#velocity_publisher .file .meant").first
    assert not line.is_visible()
    page.locator("#velocity_publisher details.file summary").click()
    assert line.is_visible()
    assert line.inner_text().startswith("6")
    assert said == []


@pytest.mark.long
def test_a_page_on_a_web_server_opens_its_recordings_in_foxglove(browser: Browser) -> None:
    """By their address; a page on a disk only names the file."""
    context = browser.new_context()
    html = render_html(graded.perfect(), recordings="evidence")
    context.route("https://class.example/**", lambda route: route.fulfill(body=html, content_type="text/html"))
    page = context.new_page()
    page.goto("https://class.example/ada/report.html")
    page.wait_for_selector("html[data-ready=yes]")
    links = page.evaluate("[...document.querySelectorAll('[data-foxglove]')].map((link) => link.href)")
    context.close()
    name = "odom_subscriber.waiting_then_driving"
    address = f"https://class.example/ada/evidence/{name}/{name}_0.mcap"
    assert f"https://app.foxglove.dev/~/view?ds=remote-file&ds.url={quote(address, safe='')}" in links


@pytest.mark.breadth(0, 1)
@pytest.mark.parametrize(("scheme", "width"), each([("dark", 390), ("light", 1280)], 2))
def test_axe_finds_nothing(visit: Open, scheme: str, width: int) -> None:
    """As the page opens, and with everything unfolded; axe-core knows the WCAG and good practice."""
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install -e '.[dev]'")
    html = render_html(graded.wrong(), recordings="evidence")
    page, said, _ = visit(html, color_scheme=scheme, viewport={"width": width, "height": 900})
    found = axe.Axe().run(page).response["violations"]
    unfold(page)
    found += axe.Axe().run(page).response["violations"]
    assert [(one["id"], node["html"]) for one in found for node in one["nodes"]] == []
    assert said == []


@pytest.mark.breadth(1, 1)
@pytest.mark.parametrize(("scheme", "width"), each([("dark", 390), ("light", 1280)], 2))
def test_the_page_of_a_failed_test_is_drawn_fits_and_has_no_fault(visit: Open, scheme: str, width: int) -> None:
    """Every figure has a picture, nothing sticks out, the console is silent, and axe-core finds nothing."""
    page, said, asked = visit(page_of_failed_test(), color_scheme=scheme, viewport={"width": width, "height": 900})
    unfold(page)
    drawn = drawings(page)
    assert len(drawn) == 5
    assert [id_ for id_, there in drawn if not there] == []
    assert page.evaluate("document.documentElement.scrollWidth <= window.innerWidth")
    boxes = page.locator(".live [data-box]").evaluate_all("(all) => all.map((box) => box.getAttribute('aria-label'))")
    assert {"node the test", "service /addfine, fine", "topic /a, std_msgs/msg/Float32"} <= set(boxes)
    page.locator(".player input").evaluate("(e) => { e.value = 2; e.dispatchEvent(new Event('input')); }")
    assert page.locator(".playhead:not([hidden])").count() == 5
    assert "the test" in page.locator(".log li:not([hidden])").first.inner_text()
    assert (said, len(asked)) == ([], 1)
    axe = pytest.importorskip("axe_playwright_python.sync_playwright", reason="pip install -e '.[dev]'")
    found = axe.Axe().run(page).response["violations"]
    assert [(one["id"], node["html"]) for one in found for node in one["nodes"]] == []


@pytest.mark.breadth(1, 0)
@pytest.mark.parametrize("text", each(ATTACKS, len(ATTACKS)))
def test_hostile_text_stays_text_on_the_page_of_a_failed_test(visit: Open, text: str) -> None:
    """In its steps, source, tooltips, tables, values and log."""
    page, said, asked = visit(page_of_failed_test(text))
    unfold(page)
    for summary in page.query_selector_all("figure .table > summary"):
        summary.click()
    for drawing in page.query_selector_all(".drawing"):
        drawing.focus()
        page.keyboard.press("ArrowRight")
    assert page.evaluate("document.querySelectorAll('img, iframe, object, embed, [onload], [onerror]').length") == 0
    assert page.evaluate("document.scripts.length") == 2
    assert text in page.inner_text("h1")
    assert "owned" not in page.title().replace(text, "")
    assert (said, len(asked)) == ([], 1)


@pytest.mark.nightly
def test_headings_landmarks_and_names_are_there(visit: Open) -> None:
    """For whoever listens to the page: one h1, no level left out, every control and picture named."""
    page, _, _ = visit(render_html(graded.wrong()))
    levels = page.evaluate("[...document.querySelectorAll('h1, h2, h3, h4, h5')].map((h) => Number(h.tagName[1]))")
    assert levels.count(1) == 1
    assert all(after - before <= 1 for before, after in pairwise(levels))
    for landmark in ("header", "main", "nav", "footer"):
        assert page.locator(landmark).count() == 1
    unnamed = page.evaluate(
        "[...document.querySelectorAll('button, [tabindex=\"0\"]')].filter((e) => !e.getAttribute('aria-label')"
        " && !e.getAttribute('aria-labelledby') && !e.textContent.trim()).length"
    )
    assert unnamed == 0


@pytest.mark.long
def test_without_scripts_the_report_is_there_in_words(visit: Open, browser: Browser, tmp_path: Path) -> None:
    """Mail programs and wary people switch them off."""
    file = tmp_path / "plain.html"
    file.write_text(render_html(graded.wrong()), encoding="utf-8")
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(file.as_uri())
    text = page.inner_text("body")
    context.close()
    assert "Publishes at 20 Hz" in text
    assert "messages on /cmd_vel within" in text
    assert "need JavaScript" in text
