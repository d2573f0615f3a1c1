"""The HTML page: what it shows first, that hostile text stays text, and that nothing is loaded from anywhere."""

from __future__ import annotations

import base64
import hashlib
import json
import re
from dataclasses import replace
from typing import Any

import pytest
from parsed_page import MARKUP, Page
from report_samples import (
    ENVIRONMENT,
    SAMPLES,
    both_ways,
    crashed,
    hostile,
    middling,
    perfect,
    report,
    undecided,
    velocity,
)

from grader.grading.model.chart import (
    Chart,
    Column,
    Excerpt,
    GraphFigure,
    Panel,
    Playback,
    Series,
    SourceFile,
    Stage,
    Stretch,
    TopicValues,
    VerticalLine,
)
from grader.grading.model.report import Report, Reproduction
from grader.grading.reporting.html.assets import bundle
from grader.grading.reporting.html.render import Columns, figure_values, render_html
from grader.runtime.model.trace import Endpoint, GraphSnapshot, ServiceEnd


def pictured(text: str = "fine") -> Report:
    """Return a report whose every text, those of its figures included, is the one given."""
    chart = Chart(
        "velocity_publisher-1",
        text,
        text,
        ("rate",),
        "time",
        "s",
        (Panel(text, "m", (Series(text, ((0.0, 1.0), (1.0, float("nan"))), texts=(text, text)),), lanes=(text,)),),
        (VerticalLine(0.5, text),),
        (Stretch(0.0, 0.5, text),),
    )
    ends = tuple(replace(e, node=text, topic=f"/{text}", type=text) for e in both_ways().endpoints[:1])
    called = (ServiceEnd("client", f"/{text}", text, text), ServiceEnd("service", f"/{text}", text, f"/{text}"))
    graph = replace(both_ways(), nodes=(text,), endpoints=ends, services=called)
    drawn = GraphFigure("velocity_publisher-2", text, text, ("rate",), (Stage(text, graph),))
    topic = TopicValues(f"/{text}", text, "student", 1, (0.5,), (Column(text, (text,)),))
    timeline = replace(chart, scenario=text, until_s=1.0)
    played = Playback("velocity_publisher-3", text, text, (), timeline, (topic,), ((0.0, graph),))
    made = next(e for e in middling().exercises if e.id == "velocity_publisher")
    place = next(v.location for v in made.verdicts if v.location)
    verdicts = tuple(replace(v, reason=text, hint=text, title=text) for v in made.verdicts)
    verdicts = (replace(verdicts[0], location=replace(place, file=text)), *verdicts[1:])
    exercise = replace(
        made,
        verdicts=verdicts,
        notes=(text,),
        figures=(chart, drawn, played),
        excerpts=(Excerpt(text, place.line, place.line, (text,)),),
        sources=(SourceFile(text, (text,) * place.line, 3),),
        expected={"rate": text},
        faults=tuple(replace(f, file=text, text=text, frames=(text,)) for f in crashed().exercises[0].faults),
    )
    return report(exercise, name=text, path=text, notes=(text,))


@pytest.mark.parametrize("name", SAMPLES)
def test_every_element_is_closed_where_it_belongs(name: str) -> None:
    """A strict reading of the page finds nothing left open."""
    assert Page(render_html(SAMPLES[name]())).open == []


@pytest.mark.parametrize("text", MARKUP)
def test_hostile_text_makes_no_element_and_no_attribute(text: str) -> None:
    """With an attack in every text the page has the elements and attributes that it has with harmless text."""
    harmless, attacked = Page(render_html(pictured())), Page(render_html(pictured(text)))
    assert attacked.tags == harmless.tags
    assert [(t, n) for t, n, _ in attacked.attributes] == [(t, n) for t, n, _ in harmless.attributes]
    assert attacked.open == []


@pytest.mark.parametrize("text", MARKUP)
def test_the_data_of_the_charts_survives_hostile_text(text: str) -> None:
    """It is JSON that holds the text, and the script element ends where it should."""
    data = json.loads(Page(render_html(pictured(text))).raw["figures"])
    figures, columns = data["figures"], data["columns"]
    shown = text.replace("\u2028", "\\u2028").replace("\u2029", "\\u2029")
    assert columns[figures["velocity_publisher-1"]["panels"][0]["series"][0]["texts"]] == [shown, shown]
    assert figures["velocity_publisher-1"]["cases"][0]["label"] == shown
    assert figures["velocity_publisher-2"]["stages"][0]["nodes"][0]["name"] == shown
    assert figures["velocity_publisher-2"]["stages"][0]["services"][0]["name"] == f"/{shown}"
    assert figures["velocity_publisher-3"]["topics"][0]["fields"] == [{"name": shown, "values": [shown]}]


def serving() -> GraphSnapshot:
    """Return a graph in which one service is called and answered, one nobody serves, and an action has both ends."""
    goal = "/go/_action/send_goal"
    return GraphSnapshot(
        0,
        ("/a", "/b"),
        (
            Endpoint("publisher", "/t", "T", "/a", 1, "best_effort", "volatile"),
            Endpoint("subscription", "/t", "T", "/b", 2, "reliable", "volatile"),
        ),
        (
            ServiceEnd("client", "/add", "Add", "/a"),
            ServiceEnd("service", "/add", "Add", "/b", reliability="best_effort"),
            ServiceEnd("client", "/lost", "Find", "/a"),
            ServiceEnd("client", goal, "Go_SendGoal", "/a"),
            ServiceEnd("service", goal, "Go_SendGoal", "/b"),
            ServiceEnd("service", "/go/_action/cancel_goal", "CancelGoal", "/b"),
        ),
    )


def test_the_picture_of_the_graph_has_services_and_actions_with_their_ends() -> None:
    """From the client to the server; what keeps both apart is said, and an action is one box."""
    figure = GraphFigure("graph", "", "", (), (Stage("", serving()),))
    values: Any = figure_values(figure, Columns())
    (stage,) = values["stages"]
    boxes = {box["id"]: box for box in (*stage["nodes"], *stage["topics"], *stage["services"])}
    assert [(box["kind"], box["name"], box["types"]) for box in stage["services"]] == [
        ("service", "/add", ["Add"]),
        ("service", "/lost", ["Find"]),
        ("action", "/go", ["Go"]),
    ]
    assert [(boxes[e["from"]]["name"], boxes[e["to"]]["name"], e["text"]) for e in stage["edges"][2:]] == [
        ("/a", "/add", "/a calls /add: Add"),
        ("/add", "/b", "/b serves /add: Add, best_effort reliability"),
        ("/a", "/lost", "/a calls /lost: Find"),
        ("/a", "/go", "/a sends goals to /go: Go"),
        ("/go", "/b", "/b takes goals of /go: Go"),
    ]
    assert {box["name"]: box["quarrel"] for box in (*stage["topics"], *stage["services"]) if box["quarrel"]} == {
        "/t": "incompatible QoS: best_effort reliability offered, reliable requested",
        "/add": "incompatible QoS: reliable client, best_effort server",
    }


def test_a_service_of_a_run_is_there_from_its_moment_on() -> None:
    """Although a topic of the same name was there before."""
    later = ServiceEnd("service", "/t", "Find", "/b")
    played = next(f for f in pictured().exercises[0].figures if isinstance(f, Playback))
    graphs = ((0.0, replace(serving(), services=())), (2.0, replace(serving(), services=(later,))))
    values: Any = figure_values(replace(played, graphs=graphs), Columns())
    graph = values["graph"]
    assert {(box["kind"], box["name"]): box["alive"] for box in (*graph["topics"], *graph["services"])} == {
        ("topic", "/t"): [0, 1],
        ("service", "/t"): [1],
    }
    assert graph["edges"][-1]["alive"] == [1]


@pytest.mark.parametrize("name", SAMPLES)
def test_no_control_character_or_surrogate_is_in_a_page(name: str) -> None:
    """Nor one that reorders text."""
    page = Page(render_html(SAMPLES[name]()))
    assert not re.search("[\x00-\x08\x0b-\x1f\x7f-\x9f\u202a-\u202e\u2066-\u2069\ud800-\udfff]", page.text)


@pytest.mark.parametrize("assets", [None, "../assets"])
def test_nothing_is_loaded_from_elsewhere(assets: str | None) -> None:
    """Every address in the page is one inside it, or one of the shared files beside it."""
    page = Page(render_html(pictured(), assets=assets))
    loading = {"src", "href", "action", "data", "poster", "srcset", "formaction", "ping", "background"}
    addresses = {value for _, name, value in page.attributes if name in loading}
    beside = {f"../assets/{name}" for name in bundle().files} if assets else set()
    assert {a for a in addresses if not a.startswith("#")} == beside
    assert "@import" not in bundle().style
    assert "url(" not in bundle().style


def test_kept_recordings_are_named_for_foxglove() -> None:
    """With the path from the page to the file; a page without evidence names none."""
    page = Page(render_html(pictured("<b>"), recordings="../the evidence"))
    path = "../the%20evidence/velocity_publisher.%3Cb%3E/velocity_publisher.%3Cb%3E_0.mcap"
    assert ("a", "href", path) in page.attributes
    assert "Open this recording in Foxglove" in page.text
    assert "Foxglove" not in Page(render_html(pictured())).text


def test_the_policy_lets_only_our_script_run() -> None:
    """A browser refuses every other script, and every connection."""
    text = render_html(pictured("<script>alert(1)</script>"))
    page = Page(text)
    policy = next(v for t, n, v in page.attributes if t == "meta" and n == "content" and "default-src" in v)
    digest = base64.b64encode(hashlib.sha256(page.raw["script"].encode()).digest()).decode()
    assert "default-src 'none'" in policy
    assert f"script-src 'sha256-{digest}'" in policy
    assert "connect-src" not in policy
    assert "img-src" not in policy


def test_links_inside_the_page_lead_somewhere() -> None:
    """Every fragment names an element."""
    page = Page(render_html(pictured()))
    ids = [value for _, name, value in page.attributes if name == "id"]
    assert len(ids) == len(set(ids))
    wanted = {v[1:] for _, n, v in page.attributes if n == "href" and v.startswith("#")}
    wanted |= {v for _, n, v in page.attributes if n in ("aria-labelledby", "aria-describedby")}
    assert wanted <= set(ids)


def test_the_score_comes_first_and_the_way_to_repeat_it_last() -> None:
    """People look for the mark, and whoever doubts it for the command."""
    command = Reproduction(
        ("grade", "./ada homework", "--seed", "4711"), (("velocity_publisher", "sha256:" + "a" * 64),)
    )
    text = Page(render_html(replace(middling(), reproduce=command))).text
    score, rate, again = text.index("points"), text.index("Publishes at 20 Hz"), text.index("grade './ada homework'")
    assert score < rate < again
    assert text.index(f"of {middling().max_score} points") < text.index("criteria met") < text.index("Exercise 1")


def test_a_criterion_says_what_was_expected_and_found_and_what_to_do() -> None:
    """With the line of the source that is meant."""
    made = middling().exercises[0]
    excerpt = Excerpt("velocity_publisher.py", 17, 16, ("before", "self.create_timer(0.1, self.tick)", "after"))
    shown = replace(made, expected={"rate": "20 ± 1 Hz"}, excerpts=(excerpt,))
    text = Page(render_html(report(shown))).text
    for piece in (
        "Expected 20 ± 1 Hz",
        "Found /cmd_vel: 10.00 Hz",
        "Hint the argument of create_timer",
        "17 self.create_timer",
    ):
        assert piece in text
    assert "self.create_timer(0.1, self.tick) (this line)" in text


def test_the_whole_source_is_there_with_what_its_lines_cost() -> None:
    """Folded; a line that a criterion names is marked, linked from the criterion and links to it."""
    made = middling().exercises[0]
    verdict = next(v for v in made.verdicts if v.location)
    assert verdict.location is not None
    lines = tuple(f"line {n}" for n in range(1, 41))
    page = Page(render_html(report(replace(made, sources=(SourceFile(verdict.location.file, lines, 2),)))))
    assert "line 40" in page.text
    assert "and 2 more lines" in page.text
    mark = f"{made.id}-file1-{verdict.location.line}"
    assert ("span", "id", mark) in page.attributes
    assert ("a", "href", f"#{mark}") in page.attributes
    assert ("a", "href", f"#{made.id}-{verdict.id}") in page.attributes
    assert ("details", "class", "file") in page.attributes


def test_what_cost_points_is_unfolded_and_the_rest_is_folded() -> None:
    """Not met, partly and undecided are open at first."""
    page = Page(render_html(middling()))
    folds = [v for t, n, v in page.attributes if t == "details" and n == "class" and v.startswith("criterion")]
    opened = sum(t == "details" and n == "open" for t, n, _ in page.attributes)
    assert opened == sum(v in ("criterion not_met", "criterion partly") for v in folds) == 4


def test_a_report_without_a_sandbox_says_so_at_the_top_and_at_the_end() -> None:
    """It is the first thing after the score, in words."""
    text = Page(render_html(undecided())).text
    assert text.index("No sandbox.") < text.index("Exercise 1")
    assert "isolation" in text[text.index("How to reproduce this report") :]
    assert "No sandbox." not in Page(render_html(replace(undecided(), environment=ENVIRONMENT))).text


def test_the_same_report_gives_the_same_bytes() -> None:
    """No date, host name or random word; of two runs only the one line of the run differs."""
    assert render_html(hostile()) == render_html(hostile())
    one, other = (render_html(replace(perfect(), duration_s=d)).splitlines() for d in (1.0, 2.5))
    assert sum(a != b for a, b in zip(one, other, strict=True)) == 1


def test_a_report_without_exercises_or_points_is_a_page() -> None:
    """Nothing divides by zero."""
    assert Page(render_html(report())).open == []
    assert isinstance(report(replace(velocity(), verdicts=())), Report)
    assert Page(render_html(report(replace(velocity(), verdicts=())))).open == []


def test_shared_files_keep_a_class_small() -> None:
    """A page that links to them is small; their names change with their content."""
    page = render_html(pictured(), assets="assets")
    assert len(page) < 60_000
    for name, content in bundle().files.items():
        assert f"assets/{name}" in page
        assert hashlib.sha256(content).hexdigest()[:12] in name


def test_a_page_that_stands_alone_is_small_enough_for_a_letter() -> None:
    """With as many figures as three exercises have, each as full as it may be, it stays under 1.5 MB."""

    def full(n: int) -> Chart:
        points = tuple((k / 100 + n, (k % 17) / (3 + n)) for k in range(1200))
        text = Series("log", points[:400], texts=(f"{n}" + "x" * 159,) * 400)
        panels = (Panel("rate", "Hz", (Series("rate", points),)), Panel("interval", "ms", (text,)))
        return Chart(f"e-{n}", "title", "about", (), "time", "s", panels)

    figures = tuple(full(n) for n in range(6))
    assert len(render_html(report(replace(velocity(), figures=figures)))) < 1_500_000


def test_no_script_ends_early_or_changes_on_the_way() -> None:
    """What would end a script element, or be read differently by a browser, is not in the bundle."""
    assert not re.search(r"</script|<!--|<script|\r|\x00", bundle().script, re.IGNORECASE)
    assert "</style" not in bundle().style.lower()


def test_the_licences_travel_with_the_libraries() -> None:
    """Each report carries them."""
    for owner in ("Apache Software Foundation", "Mike Bostock", "Chris Pettitt"):
        assert owner in bundle().script
