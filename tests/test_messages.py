"""The list of messages finds what users read, and none of them has a phrase that sounds translated."""

import re

import pytest
from messages import Sentence, in_code, sentences

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
}

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
]


def found_in(text: str) -> list[str]:
    """Return the phrases in a text, without the expressions in its braces."""
    words = re.sub(r"\{[^{}]*\}", "{}", text)
    return [
        f"{better} (found: {match[0]})" for phrase, better in PHRASES.items() if (match := re.search(phrase, words))
    ]


def test_no_message_sounds_translated() -> None:
    """Neither in the code nor in the golden texts."""
    wrong = [(each.place, each.text, found) for each in sentences() if (found := found_in(each.text))]
    assert wrong == []


@pytest.mark.parametrize("text", BAD)
def test_a_phrase_that_sounds_translated_is_found(text: str) -> None:
    """Each phrase is found in a sentence that was once a message."""
    assert found_in(text)


def test_every_phrase_has_a_sentence() -> None:
    """So that a pattern that matches nothing is noticed."""
    assert [phrase for phrase in PHRASES if not any(re.search(phrase, text) for text in BAD)] == []


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


def test_the_list_holds_code_rubrics_and_golden_texts() -> None:
    """Each sentence once."""
    listed = sentences()
    places = {each.place.partition("/")[0] for each in listed}
    assert places == {"grader", "rubrics", "tests"}
    assert {"error", "hint", "reason", "note", "help", "text"} <= {each.kind for each in listed}
    assert len({each.text for each in listed if each.place.startswith("grader")}) == len(
        [each for each in listed if each.place.startswith("grader")]
    )
