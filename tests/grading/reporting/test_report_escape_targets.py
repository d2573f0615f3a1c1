"""Escaping for each target: what a student writes is text, and only text, to the program that reads the report."""

from __future__ import annotations

import csv
import io
import json
import math
import re
import xml.etree.ElementTree as ET
from collections.abc import Sequence
from enum import Enum
from fractions import Fraction
from html.parser import HTMLParser
from typing import Any

import cmarkgfm
import pytest
from cmarkgfm.cmark import Options
from hypothesis import example, given
from hypothesis import strategies as st

from grader.grading.reporting.escape import (
    ELLIPSIS,
    csv_cell,
    json_value,
    log_lines,
    markdown,
    markdown_block,
    markdown_code,
    mermaid_label,
    script_json,
    shown,
    shown_lines,
    workflow_message,
    workflow_property,
    xml_text,
)

SIGNS = st.text(alphabet="`~*_[](){}<>!|\\#+-=.:;@&$^%\"'/ \n\r\tax1w", max_size=40)
HOSTILE = """
    http://a.b www.a.b a@b.cd @user #1 GH-12 :boom: <script> </code> <!-- ![x](y) ``` `` ` | \\ ::error:: ##[debug] &lt;
    ::stop-commands::x &#10; --- ~~~ 1. $x$ [^1] == mailto:a@b.cd \x1b[2J \u202e \ud800 \x00
"""
PIECES = st.lists(st.sampled_from(["\n", " ", *HOSTILE.split()]), max_size=12).map("".join)
ANYTHING = st.text(alphabet=st.characters(), max_size=60) | SIGNS | PIECES


class Page(HTMLParser):
    """The tags and the text of a piece of HTML, as a browser sees them."""

    def __init__(self, source: str) -> None:
        super().__init__(convert_charrefs=True)
        self.tags: list[str] = []
        self.pieces: list[str] = []
        self.feed(source)
        self.close()
        self.text = "".join(self.pieces)

    def handle_starttag(self, tag: str, attrs: Sequence[Any]) -> None:
        self.tags.append(tag)

    def handle_comment(self, data: Any) -> None:
        self.tags.append("comment")

    def handle_decl(self, decl: Any) -> None:
        self.tags.append("declaration")

    def handle_pi(self, data: Any) -> None:
        self.tags.append("instruction")

    def handle_data(self, data: str) -> None:
        self.pieces.append(data)


def rendered(source: str) -> Page:
    """Return what GitHub's own Markdown makes of a text, before it is cleaned."""
    return Page(cmarkgfm.github_flavored_markdown_to_html(source, options=Options.CMARK_OPT_UNSAFE))


def plain(text: str) -> str:
    """Return text without the invisible space, and with single spaces."""
    return " ".join(text.replace("\u200b", "").split())


PLACES = {
    "{}": ["p"],
    "before {} after": ["p"],
    "# {}": ["h1"],
    "- {}\n- x": ["ul", "li", "li"],
    "> {}": ["blockquote", "p"],
    "x\n{}": ["p"],
    "|a|b|\n|-|-|\n|{}|x|": ["table", "thead", "tr", "th", "th", "tbody", "tr", "td", "td"],
}


@pytest.mark.parametrize("place", PLACES)
@given(text=ANYTHING)
@example(text="- x")
@example(text=":-")
@example(text=":-:")
@example(text="1. x")
@example(text="12) x")
@example(text="===")
@example(text="\\|")
@example(text="http://a.b www.a.b a@b.cd mailto:a@b.cd xmpp:a@b.cd ftp://a.b")
def test_markdown_shows_just_the_text(place: str, text: str) -> None:
    """In each place: the tags of the place and no other, and the text of the student letter for letter."""
    tags = PLACES[place]
    if not plain(shown(text)):  # an empty heading or item may lose its paragraph
        return
    page = rendered(place.replace("{}", markdown(text)))
    assert page.tags == tags
    expected = place.replace("{}", "\0") if "|" not in place else "a b \0 x"
    around = plain(re.sub(r"^([#>-] )|\n- ", " ", expected)).split("\0")
    assert plain(page.text) == plain(shown(text).join(around))


@pytest.mark.parametrize("place", PLACES)
@given(text=ANYTHING)
@example(text="`")
@example(text="a\\|b")
@example(text="a\\\\|`` ` `")
@example(text=" `")
def test_a_code_span_shows_just_the_text(place: str, text: str) -> None:
    """One code element, in cells of tables too, and spaces at the edges stay."""
    code = markdown_code(text, in_cell="|" in place)
    if not code:
        assert not shown(text).strip(" ")
        return
    page = rendered(place.replace("{}", code))
    tags = list(PLACES[place])
    at = {"- ": 2, "|": 8}.get(next((k for k in ("- ", "|") if place.startswith(k)), ""), len(tags))
    assert page.tags == [*tags[:at], "code", *tags[at:]]
    assert shown(text) in page.text


@pytest.mark.parametrize("text", ["@ada", "see @ada", "#12", "ada/x#12", "GH-12", ":boom:"])
def test_nothing_is_mentioned_or_referred_to(text: str) -> None:
    """GitHub looks for these in the finished text: an invisible space stands in between."""
    seen = rendered(markdown(text)).text
    assert plain(seen) == text
    assert text not in seen
    assert not re.search(r"@\w|#\d|GH-\d|:\w+:", seen)


@given(ANYTHING)
@example("```\n````\n~~~")
@example("")
@example("    x\n\tx")
def test_a_code_block_ends_where_it_should(text: str) -> None:
    """All lines are inside, and what follows is outside."""
    page = rendered(f"before\n\n{markdown_block(text)}\n\nafter")
    assert page.tags == ["p", "pre", "code", "p"]
    assert page.text == f"before\n{shown_lines(text)}\n\nafter\n"


@given(ANYTHING)
def test_shown_lines_keeps_line_breaks_and_nothing_else(text: str) -> None:
    """Line by line the same as one line shown."""
    lines = shown_lines(text).split("\n")
    assert lines == [shown(line.expandtabs(4)) for line in text.replace("\r\n", "\n").split("\n")]


@given(ANYTHING, st.integers(min_value=1, max_value=30))
def test_shown_lines_are_cut_visibly(text: str, limit: int) -> None:
    """Never longer than the limit; whole, or with an ellipsis."""
    whole, cut = shown_lines(text, limit=10_000), shown_lines(text, limit=limit)
    assert len(cut) <= limit
    assert cut == whole if len(whole) <= limit and len(text) <= limit else cut.endswith(ELLIPSIS) or cut == whole


def test_shown_lines_of_a_huge_text_cost_little() -> None:
    """A million empty lines are as harmless as one long one."""
    assert len(shown_lines("\n" * 5_000_000)) <= 20_000
    assert len(shown_lines("\x1b" * 5_000_000)) <= 20_000


def parsed_command(line: str) -> tuple[str, dict[str, str], str]:
    """Read a workflow command as the runner does: command, properties, message."""
    assert line.startswith("::")
    assert "\n" not in line
    assert "\r" not in line
    head, message = line[2:].split("::", 1)
    command, _, properties = head.partition(" ")
    pairs = dict(part.split("=", 1) for part in properties.split(",") if part)

    def unescaped(text: str, signs: str) -> str:
        for sign in signs:
            text = text.replace(f"%{ord(sign):02X}", sign)
        return text

    return command, {k: unescaped(v, "\r\n:,%") for k, v in pairs.items()}, unescaped(message, "\r\n%")


@given(ANYTHING, ANYTHING)
@example("a,line=1::x", "%0A%250A")
def test_workflow_commands_carry_text_unharmed(title: str, message: str) -> None:
    """The runner reads back one command, its properties and its message, whatever they hold."""
    line = f"::error file=x.py,title={workflow_property(title)}::{workflow_message(message)}"
    assert parsed_command(line) == ("error", {"file": "x.py", "title": shown(title)}, shown_lines(message))


@given(ANYTHING)
@example("  ::error::x\n##[add-mask]e\n###[debug]x\n\t:::")
def test_no_line_of_a_log_is_a_command(text: str) -> None:
    """Neither in the runner's present form nor in the old one, which it takes anywhere in a line."""
    lines = log_lines(text)
    assert not [line for line in lines.split("\n") if line.lstrip().startswith("::") or "##[" in line]
    assert lines.replace("\\", "") == shown_lines(text).replace("\\", "")


@given(ANYTHING)
def test_xml_holds_the_text(text: str) -> None:
    """A parser of XML 1.0 gives back what was put in, as an attribute and as content."""
    element = ET.Element("a", b=xml_text(text))
    element.text = xml_text(text)
    read = ET.fromstring(ET.tostring(element, encoding="utf-8"))
    assert (read.text or "") == read.get("b") == shown_lines(text)


JSON = st.recursive(
    ANYTHING | st.integers() | st.floats() | st.none() | st.booleans(),
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(ANYTHING, inner, max_size=4),
    max_leaves=12,
)


@given(JSON)
@example("</script><!--\u2028")
@example({"a": [math.nan, -math.inf, 10**400]})
def test_json_in_a_page_cannot_end_its_script(value: Any) -> None:
    """It can be encoded, parsed strictly, and holds nothing of HTML."""
    text = script_json(value)
    text.encode("utf-8")
    assert not re.search("[<>&\u2028\u2029]", text)
    assert json.loads(text, parse_constant=pytest.fail) == json_value(value)


def test_json_values() -> None:
    """What JSON cannot say becomes something that it can."""

    class Colour(Enum):
        RED = "red"

    value = {Colour: (Fraction(1, 3), Fraction(4, 2), Colour.RED), "x\ud800": [math.inf, None, True, 2**64, 2**63]}
    assert list(json_value(value).values()) == [
        [0.333333, 2, "red"],
        ["inf", None, True, "an integer of 65 bits", 2**63],
    ]
    assert list(json_value(value))[1] == "x\ufffd"


@pytest.mark.parametrize(
    "text", ["=1+1", "+1", "-2+3", "@SUM(A1)", " =1", "\t=1", "\u3000=1", "\uff1d1", "\uff0b1", "=cmd|' /C calc'!A0"]
)
def test_a_formula_becomes_text(text: str) -> None:
    """Spreadsheets compute what begins like this, unless an apostrophe stands before it."""
    assert csv_cell(text) == f"'{shown(text)}"


@pytest.mark.parametrize(
    ("text", "cell"),
    [
        ("a;=1+1;b", "a;'=1+1;b"),
        ("a; +1", "a;' +1"),
        ('a;"=1+1"', 'a;\'"=1+1"'),
        ("=1;=2;;@x", "'=1;'=2;;'@x"),
        ("a; b;c=1", "a; b;c=1"),
    ],
)
def test_a_formula_behind_a_semicolon_becomes_text(text: str, cell: str) -> None:
    """Where a semicolon separates lists, it begins a cell of its own, in quotes or not."""
    assert csv_cell(text) == cell


@given(ANYTHING)
@example("\r=1")
@example("\n=1")
@example("a;=1")
@example('a;"=1')
def test_a_cell_of_csv_is_one_cell(text: str) -> None:
    """A reader finds the same cell again; it begins like no formula and holds no line break."""
    file = io.StringIO()
    csv.writer(file).writerow([csv_cell(text), "next"])
    (row,) = csv.reader(io.StringIO(file.getvalue()))
    assert row[1] == "next"
    assert row[0].replace("'", "") == shown(text).replace("'", "")
    for separator in ",;":
        for cell in next(csv.reader(io.StringIO(file.getvalue()), delimiter=separator)):
            assert not re.match(r'[\s"]*[=+\-@\uff1d\uff0b\uff0d\uff20]', cell)


@given(ANYTHING)
def test_a_label_of_mermaid_stays_a_label(text: str) -> None:
    """No quote, bracket or line break is left, and the numbers stand for the text."""
    label = mermaid_label(text)
    assert not re.search(r'["`<>&\[\](){}|;:\\%\n]', re.sub(r"#\d+;", "", label))
    assert re.sub(r"#(\d+);", lambda match: chr(int(match[1])), label) == shown(text)
