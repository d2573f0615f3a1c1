"""Markdown: read back by a parser, inert whatever a student wrote, and never longer than GitHub takes."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from html.parser import HTMLParser
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from markdown_it import MarkdownIt
from markdown_it.token import Token
from report_samples import (
    SAMPLES,
    crashed,
    criterion,
    endpoint,
    exercise,
    hostile,
    middling,
    perfect,
    report,
    undecided,
)

from grader.grading.model.exercise import Outcome
from grader.grading.model.report import ReportedFault
from grader.grading.reporting.graph import draw_mermaid
from grader.grading.reporting.markdown import DETAILS, MOST_BYTES, render_markdown
from grader.runtime.model.trace import GraphSnapshot, ServiceEnd

# What GitHub renders besides the common mark: tables and bare links.
GITHUB = MarkdownIt("commonmark", {"linkify": False}).enable("table").enable("strikethrough")
NODE = r'(?:node\d+\(\["[^"]*"\]\)|topic\d+\["[^"]*"\]|(?:service|action)\d+\{\{"[^"]*"\}\}|more\["and \d+ more"\])'
ARROW = r'(?:node|topic|service|action)\d+ (?:-->|-\. "[^"]*" \.->) (?:node|topic|service|action)\d+'


def flat(tokens: Sequence[Token]) -> Iterator[Token]:
    for token in tokens:
        yield token
        yield from flat(token.children or [])


class Text(HTMLParser):
    """The tags and the text of a rendered page."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.tags: set[str] = set()
        self.text = ""
        self.feed(html)

    def handle_starttag(self, tag: str, attrs: Sequence[tuple[str, str | None]]) -> None:
        self.tags.add(tag)

    def handle_data(self, data: str) -> None:
        self.text += data


def tables(text: str) -> list[list[list[str]]]:
    """Return every table as rows of the cells' texts."""
    rows: list[list[str]] = []
    found: list[list[list[str]]] = []
    tokens = GITHUB.parse(text)
    for at, token in enumerate(tokens):
        if token.type == "table_open":
            rows = []
            found.append(rows)
        elif token.type == "tr_open":
            rows.append([])
        elif token.type in ("th_open", "td_open"):
            rows[-1].append(Text(GITHUB.renderInline(tokens[at + 1].content)).text)
    return found


def test_the_score_comes_first_and_the_outcomes_in_a_table() -> None:
    """A reader of a step summary sees both without scrolling."""
    text = render_markdown(middling())
    assert (
        Text(GITHUB.render(text)).text.lstrip().startswith("ada_homework: 13 of 60 points\nFinal: 2 of 9 criteria met")
    )
    first, second = tables(text)
    assert first[1:3] == [
        ["✅ met", "6/6", "Publishes geometry_msgs/msg/Twist on /cmd_vel"],
        ["❌ not met", "0/10", "Publishes at 20 Hz"],
    ]
    assert second[-1] == ["⏸️ blocked", "0/8", "Waits for data: needs subscribes_odom (not met)"]


def test_reasons_hints_and_places_follow() -> None:
    """What was lost is explained below the table; what was met is not."""
    text = Text(GITHUB.render(render_markdown(middling()))).text
    assert "Publishes at 20 Hz (rate): /cmd_vel: 10.00 Hz, expected 20 ± 1 Hz" in text
    assert "hint: the argument of create_timer is the period in seconds" in text
    assert "at velocity_publisher.py:17" in text
    assert "as asked" not in text


def test_a_fault_comes_with_its_frames() -> None:
    """In a block of code, as a traceback is read."""
    blocks = [token.content for token in GITHUB.parse(render_markdown(crashed())) if token.type == "fence"]
    assert blocks[0].startswith("velocity_publisher.py:31 in <module>\n")


def test_what_is_not_final_stands_out() -> None:
    """So does a run without a sandbox."""
    text = render_markdown(undecided())
    assert text.index("[!WARNING]") < text.index("[!CAUTION]") < text.index("| Points |")


@pytest.mark.parametrize("name", SAMPLES)
def test_a_parser_finds_nothing_but_what_was_meant(name: str) -> None:
    """No HTML, link or picture; every row of every table has three cells."""
    text = render_markdown(SAMPLES[name]())
    kinds = {token.type for token in flat(GITHUB.parse(text))}
    assert not kinds & {"html_block", "html_inline", "link_open", "image", "code_block"}
    for table, part in zip(tables(text), SAMPLES[name]().exercises, strict=True):
        assert [len(row) for row in table] == [3] * (len(part.verdicts) + 1)


SIGNS = st.lists(
    st.sampled_from(
        [
            "\n",
            "|",
            "`",
            "```",
            "<b>",
            "-->",
            "]",
            "[x](y)",
            "![",
            "#",
            "* ",
            "1. ",
            "> ",
            "\\",
            "&lt;",
            "@team",
            "~~",
            "    ",
        ]
    )
).map("".join)


@given(st.one_of(SIGNS, st.text(alphabet=st.characters(), max_size=40)))
def test_no_text_of_a_student_is_markup(text: str) -> None:
    """Wherever it stands, the page has the same tags as with a plain word there, and the text is read."""
    pages = []
    for word in ("plain", text):
        fault = ReportedFault("exception", word, 3, word, 1, word, (word, word))
        verdict = criterion("c", word, 2, Outcome.NOT_MET, reason=word, hint="h" + word)
        blocked = criterion("d", word, 2, Outcome.BLOCKED, reason=word)
        part = exercise("e", "1", word, verdict, blocked, faults=(fault,), notes=(word,), clock_reason="c" + word)
        pages.append(Text(GITHUB.render(render_markdown(report(part, name="n" + word, notes=(word,))))))
    assert pages[1].tags - {"code"} == pages[0].tags - {"code"}


def test_detail_gives_way_in_order_until_it_fits() -> None:
    """Frames first, then the graph, explanations, criteria, exercises; the score and the end stay."""
    sample = hostile()
    limit = len(render_markdown(sample).encode())
    sizes: list[int] = []
    seen: list[Any] = []
    while True:
        text = render_markdown(sample, limit=limit)
        size = len(text.encode())
        if sizes and size == sizes[-1]:
            break
        assert size <= limit
        sizes.append(size)
        seen.append(
            ("  ```text\n" in text, "```mermaid" in text, "hint:" in text, "| Points |" in text, "## Ex" in text)
        )
        assert "0 of 14 points" in text.splitlines()[0]
        assert text.rstrip().splitlines()[-2].startswith("grade ")
        limit = size - 1
    assert len(sizes) == len(DETAILS)
    assert [sum(kept) for kept in seen] == sorted((sum(kept) for kept in seen), reverse=True)
    assert seen[0] == (True,) * 5
    assert seen[1] == (False, True, True, True, True)
    assert seen[-1] == (False,) * 5


def test_a_cut_report_says_so() -> None:
    """A reader knows that there is more, and where."""
    whole = render_markdown(hostile())
    assert "Details are left out" not in whole
    assert "Details are left out" in render_markdown(hostile(), limit=len(whole.encode()) - 1)


def test_a_monstrous_report_stays_below_the_limit() -> None:
    """Hundreds of criteria with long texts do not make GitHub drop the summary."""
    verdicts = [criterion(f"c{n}", "😀" * 400, 1, Outcome.NOT_MET, reason="&" * 500) for n in range(250)]
    sample = report(exercise("e", "1", "E", *verdicts))
    assert len(render_markdown(sample, limit=1 << 40).encode()) > MOST_BYTES
    text = render_markdown(sample)
    assert len(text.encode()) <= MOST_BYTES < 1024 * 1024
    assert "0 of 250 points" in text


def diagram(graph: GraphSnapshot) -> list[str]:
    lines = draw_mermaid(graph).split("\n")
    assert lines[0] == "flowchart LR"
    assert [line for line in lines[1:] if not re.fullmatch(f" {{4}}(?:{NODE}|{ARROW})", line)] == []
    return [line.strip() for line in lines[1:]]


def test_the_graph_is_drawn_both_ways() -> None:
    """Nodes round, topics square, and the arrows go through the topics."""
    graph = perfect().exercises[1].graph
    assert graph is not None
    lines = diagram(graph)
    matches = [re.match(r'(\w+)[([]+"([^"]*)"', line) for line in lines if "--" not in line]
    boxes = {match[1]: match[2] for match in matches if match}
    arrows = [[boxes[end] for end in line.split(" --> ")] for line in lines if "--" in line]
    assert arrows == [
        ["/fan_controller", "/fan_speed"],
        ["/fan_speed", "/temperature_sensor"],
        ["/temperature_sensor", "/temperature"],
        ["/temperature", "/fan_controller"],
    ]


def test_a_topic_whose_types_differ_is_dotted() -> None:
    """No message goes through it, and the arrow says why."""
    ends = (endpoint("publisher", "/t", "/a"), endpoint("subscription", "/t", "/b", "std_msgs/msg/Int32"))
    assert any("types differ" in line for line in diagram(GraphSnapshot(0, ("/a", "/b"), ends)))


def test_services_and_actions_are_drawn() -> None:
    """In boxes of their own, from client to server."""
    kind = "std_srvs/srv/Trigger"
    ends = (ServiceEnd("client", "/go", kind, "/a"), ServiceEnd("service", "/count/_action/send_goal", kind, "/a"))
    lines = diagram(GraphSnapshot(0, ("/a",), (), ends))
    assert lines == [
        'service0{{"/go"}}',
        'node1(["/a"])',
        'action2{{"/count"}}',
        "node1 --> service0",
        "action2 --> node1",
    ]


def test_a_node_without_topics_is_drawn_alone() -> None:
    """It exists, and does nothing."""
    assert diagram(GraphSnapshot(0, ("/a",), ())) == ['node0(["/a"])']
    assert draw_mermaid(GraphSnapshot(0, (), ())) == ""


@given(st.text(alphabet=st.characters(), max_size=40), st.text(alphabet='"];-->\n#(){}%[`', max_size=20))
def test_a_name_in_the_graph_is_no_syntax(name: str, topic: str) -> None:
    """Every line is a box or an arrow, and no block of code ends early."""
    ends = (endpoint("publisher", topic, name), endpoint("subscription", topic, name, name))
    lines = diagram(GraphSnapshot(0, (name,), ends))
    assert "```" not in "\n".join(lines)
