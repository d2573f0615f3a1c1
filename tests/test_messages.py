"""The list of messages finds what users read, and none of them has a phrase that sounds translated."""

import re
from collections.abc import Iterable

import pytest
from messages import ROOT, Sentence, in_code, in_page, in_remarks, in_script, sentences

#: All of them read what users can read, and the sources of the grader, which takes seconds.
pytestmark = pytest.mark.xdist_group("source")
#: What nobody says to a colleague, with what to write instead.
PHRASES = {
    r"(?<![Tt]here )\b(?:is|are) no (?!longer\b|more\b)[a-z]": "is not a ...",
    r"\btold\b": "say who tells what to whom, in the active voice",
    r"\basked no more\b": "removed",
    r"\bkeeps? still\b": "does not continue",
    r"\bcame to (?:no|silence|an end)\b": "ended before ...",
    r"\bneeds? (?:it )?not\b": "does not need",
    r"\btakes? \S+ out\b": "remove",
    r"\bquotation marks?\b": "quotes",
    r"\bfor ever\b": "forever",
    r"\b(?:topic|type|service) asked for is\b": "the task asks for ...",
    r"\bagain and again\b": "repeatedly",
    r"\bone after the other\b": "in turn",
    r"\b(?:tells?|knows?|names?) no(?:ne)?\b": "does not say, know or name",
    r"\basked for: ": "requested: ...",
    r"\bthe own\b": "its own",
    r"\b(?:what is|of what is|in what is) (?:one's|their|the other's)\b": "their own code",
    r"\bby several\b": "more than once, or by several people",
    r"\ba reason to \w+, and no more\b": "only a reason to ...",
    r"\bin (?:Python|ROS)'s words\b": "the message of Python",
    r"\bhas not come\b": "has not arrived",
}

#: Phrases that docstrings and comments may use: "a process is told to stop", "a name need not be valid".
_OF_MESSAGES_ALONE = (r"\btold\b", r"\bneeds? (?:it )?not\b", r"\btakes? \S+ out\b", r"\basked for: ")
#: What nobody says to a colleague in docstrings and comments either, with what to write instead.
REMARKS = {phrase: better for phrase, better in PHRASES.items() if phrase not in _OF_MESSAGES_ALONE} | {
    r"\bneeds? it not\b": "does not need",
    r"(?<!here )(?<!which )\b(?:is|are) none\b(?! of)": "is invalid, or is not a ...",
    r"\bnobody's\b": "belongs to no ...",
    r"\bis nobody\b": "is not ...",
    r"\breckon": "compute",
    r"\bis said of\b": "say who says what",
}
BAD_REMARKS = [
    "the text is no number",
    "raises EvidenceError if it is none",
    "the kernel adds it to nobody's",
    "None if that is nobody in the table",
    "hidden criteria could be reckoned from it",
    "nothing is said of the whole score",
    "the compiled form needs it not",
]

BAD = [
    "'x' is no format",
    "the answers are no numbers",
    "messages were told to the node",
    "was met 5/5, is asked no more",
    "keeps still after 3 useless answers",
    "it came to no silence",
    "the compiled form needs it not",
    "time.sleep(1) stops the node: take it out",
    "write it without quotation marks",
    "waits for ever",
    "the topic asked for is /cmd_vel",
    "spin uses itself again and again",
    "holds up every callback, one after the other",
    "a message without a number tells no charge",
    "there are reasons for it, and this page knows none of them",
    "asked for: auto; on the wall clock: 3",
    "60 % of the own code is in the other file",
    "60 % of what is one's own in a file",
    "files handed in by several: 3",
    "similar code is a reason to look, and no more",
    "the fault in Python's words",
    "do not read an angle that has not come yet",
]


def found_in(text: str, phrases: Iterable[tuple[str, str]] = PHRASES.items()) -> list[str]:
    """Return the phrases in a text, without the expressions in its braces."""
    words = re.sub(r"\{[^{}]*\}", "{}", text)
    return [f"{better} (found: {match[0]})" for phrase, better in phrases if (match := re.search(phrase, words))]


def test_no_message_sounds_translated() -> None:
    """Neither in the code nor in the golden texts."""
    wrong = [(each.place, each.text, found) for each in sentences() if (found := found_in(each.text))]
    assert wrong == []


@pytest.mark.long
def test_no_docstring_or_comment_sounds_translated() -> None:
    """In the grader, the exercises that come with it, and the benchmarks."""
    files = sorted(path for folder in ("grader", "rubrics", "benchmarks") for path in (ROOT / folder).rglob("*.py"))
    wrong = [
        (each.place, found)
        for path in files
        for each in in_remarks(path.read_text(encoding="utf-8"), path.relative_to(ROOT).as_posix())
        if (found := found_in(" ".join(each.text.split()), REMARKS.items()))
    ]
    assert wrong == []


@pytest.mark.parametrize("text", BAD_REMARKS)
def test_a_docstring_that_sounds_translated_is_found(text: str) -> None:
    """Each phrase is found in a sentence that once stood in a docstring or comment."""
    source = f'"""{text}."""\nx = 1  # {text}\n'
    found = [found_in(each.text, REMARKS.items()) for each in in_remarks(source, "a.py")]
    assert len(found) == 2
    assert all(found)


@pytest.mark.parametrize("text", BAD)
def test_a_phrase_that_sounds_translated_is_found(text: str) -> None:
    """Each phrase is found in a sentence that was once a message."""
    assert found_in(text)


def test_every_phrase_has_a_sentence() -> None:
    """So that a pattern that matches nothing is noticed."""
    known = dict.fromkeys(PHRASES, BAD) | dict.fromkeys(REMARKS, BAD + BAD_REMARKS)
    assert [phrase for phrase, texts in known.items() if not any(re.search(phrase, text) for text in texts)] == []


@pytest.mark.parametrize(
    "text", ["there is no field x", "the topic is no longer published", "make at least 3 calls: there are no more"]
)
def test_usual_english_is_left_alone(text: str) -> None:
    """Words of a phrase may stand in other sentences."""
    assert found_in(text) == []


def test_messages_are_found_by_kind_and_place() -> None:
    """Arguments of exceptions, hints, options; f-strings with their values; no docstrings, no names."""
    source = '''
"""A module of its own."""
raise RubricError(f"expected a number, found {shown(value)!r}", hint="write one number")
@option("--x", help="What it is for.")
def judge(self):
    """Return something else."""
    return not_met("the node has ended" if self.gone else f"{name} was late")
WORDS = {"key": "two words"}
'''
    assert list(in_code(source, "a.py")) == [
        Sentence("error", "a.py:3", "expected a number, found {shown(value)}"),
        Sentence("hint", "a.py:3", "write one number"),
        Sentence("help", "a.py:4", "What it is for."),
        Sentence("reason", "a.py:7", "the node has ended"),
        Sentence("reason", "a.py:7", "{name} was late"),
        Sentence("text", "a.py:8", "two words"),
    ]


def test_texts_of_a_page_are_found() -> None:
    """What stands between two lines, spoken attributes, and sentences in expressions; no styles, names or links."""
    template = """<title>{{ name }}: {{ count }} rows</title>
<style>body { font-family: two words }</style>
{% macro note(text) %}<p class="two words">A note on <a href="one two">{{ text }}</a>.</p>{% endmacro %}
<button aria-label="Zoom in" title="{% if on %}Switch off{% else %}Switch on{% endif %}">+</button>
{# a remark for authors #}
<dt>{{ 'Not judged' if blocked else 'Found' }}</dt><dd>{{ reason }}</dd>
{%- if more %}

<p>and {{ more }} more</p>{% else %}Nothing left{% endif %}"""
    assert list(in_page(template, "a.html")) == [
        Sentence("page", "a.html:1", "{name}: {count} rows"),
        Sentence("page", "a.html:3", "A note on {text}."),
        Sentence("page", "a.html:4", "Switch off"),
        Sentence("page", "a.html:4", "Switch on"),
        Sentence("page", "a.html:4", "Zoom in"),
        Sentence("page", "a.html:6", "Not judged"),
        Sentence("page", "a.html:9", "Nothing left"),
        Sentence("page", "a.html:9", "and {more} more"),
    ]


def test_texts_of_a_script_are_found() -> None:
    """In quotes of each kind, also within each other, and labels; no remarks, patterns, keys or classes."""
    source = """// a remark for authors, "as this"
const pattern = /"two words" in a pattern/;
button.textContent = on ? "\\u23f8 Pause" : 'Play it';
cell.title = `${rows.length} rows${some ? ` of ${all} with ${kind ? "this cause" : ""}` : ""}`;
element.className = "small"; add("th", "Cases"); box.style.width = `${width}px`;
"""
    assert list(in_script(source, "a.js")) == [
        Sentence("page", "a.js:3", "\u23f8 Pause"),
        Sentence("page", "a.js:3", "Play it"),
        Sentence("page", "a.js:4", '{rows.length} rows{some ? ` of {all} with {kind ? "this cause" : ""}` : ""}'),
        Sentence("page", "a.js:4", ' of {all} with {kind ? "this cause" : ""}'),
        Sentence("page", "a.js:4", "this cause"),
        Sentence("page", "a.js:5", "Cases"),
    ]


def test_the_phrases_of_pages_are_checked() -> None:
    """Those of a run, of a class and of similar submissions, in templates and scripts."""
    pages = {each.place.rpartition(":")[0] for each in sentences() if each.kind == "page"}
    assert {path.partition("/assets/")[0].partition("/templates/")[0] for path in pages} == {
        "grader/course/class_page",
        "grader/grading/reporting/html",
        "grader/course/similarity",
    }
    assert {path.rpartition(".")[2] for path in pages} == {"html", "js"}
    assert found_in("{name}: the fault in Python's words")


def test_the_list_holds_code_rubrics_and_golden_texts() -> None:
    """Each sentence once."""
    listed = sentences()
    places = {each.place.partition("/")[0] for each in listed}
    assert places == {"grader", "rubrics", "tests"}
    assert {"error", "hint", "reason", "note", "help", "page", "text"} <= {each.kind for each in listed}
    assert len({each.text for each in listed if each.place.startswith("grader")}) == len(
        [each for each in listed if each.place.startswith("grader")]
    )
