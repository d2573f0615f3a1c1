"""Workflow commands: read back as a runner reads them, within its limits, and nothing else is one."""

from __future__ import annotations

import re
from collections import Counter
from collections.abc import Iterator, Mapping
from dataclasses import replace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import NASTY, SAMPLES, criterion, exercise, middling, report, undecided

from grader.grading.model.exercise import Location, Outcome
from grader.grading.model.report import Report
from grader.grading.reporting.platforms.github import MOST_OF_A_KIND, render_github

DATA = {"%0D": "\r", "%0A": "\n", "%25": "%"}
PROPERTY = {**DATA, "%3A": ":", "%2C": ","}


def commands(text: str) -> Iterator[tuple[str, dict[str, str], str]]:
    """Yield (kind, properties, message) of each line that a runner takes for a command, in its present or old form."""
    for line in re.split(r"\r\n|\r|\n", text):
        trimmed = line.lstrip()
        if trimmed.startswith("::") and (end := trimmed.find("::", 2)) >= 0:
            name, _, rest = trimmed[2:end].partition(" ")
            pairs = (pair.split("=", 1) for pair in rest.strip().split(",") if "=" in pair)
            properties = {key.strip(): unescaped(value, PROPERTY) for key, value in pairs}
            yield name, properties, unescaped(trimmed[end + 2 :], DATA)
        elif (start := line.find("##[")) >= 0 and "]" in line[start:]:
            yield line[start + 3 : line.index("]", start)], {}, line[line.index("]", start) + 1 :]


def unescaped(text: str, table: Mapping[str, str]) -> str:
    # In the runner's order: the percent sign comes last.
    for escape in sorted(table, key="%25".__eq__):
        text = text.replace(escape, table[escape])
    return text


def rendered(sample: Report, folder: str | None = "homework/ada") -> list[tuple[str, dict[str, str], str]]:
    return list(commands(render_github(sample, folder=folder)))


def test_the_parser_of_this_test_sees_what_a_runner_sees() -> None:
    """Leading space, the old form in the middle of a line, and values with signs in them."""
    assert list(commands("  ::error file=a%2Cb,line=3::x%0Ay%253A")) == [
        ("error", {"file": "a,b", "line": "3"}, "x\ny%3A")
    ]
    assert list(commands("text ##[warning]z")) == [("warning", {}, "z")]
    assert list(commands(": :error::x")) == []


def test_a_lost_criterion_is_an_error_at_its_line() -> None:
    """File and line are those of the repository, so that GitHub shows it beside the code."""
    kind, properties, message = next(c for c in rendered(middling()) if c[0] == "error")
    assert kind == "error"
    assert properties == {
        "file": "homework/ada/velocity_publisher.py",
        "line": "17",
        "title": "Exercise 1, Publishes at 20 Hz: not met, 0/10",
    }
    assert message.splitlines()[1].startswith("hint: the argument of create_timer")


def test_half_lost_is_a_warning_and_the_score_a_notice() -> None:
    """What is blocked is not annotated: its cause is."""
    assert Counter(kind for kind, _, _ in rendered(middling())) == {"notice": 1, "error": 3, "warning": 1}
    assert rendered(middling())[0][1] == {"title": "Score: 13 of 60 points"}


def test_a_submission_outside_the_repository_names_no_file() -> None:
    """GitHub would look for it in the wrong place."""
    assert not [c for c in rendered(middling(), folder=None) if "file" in c[1]]
    assert {c[1]["file"] for c in rendered(middling(), folder="") if "file" in c[1]} == {"velocity_publisher.py"}


def test_what_is_not_final_or_without_a_sandbox_is_a_warning() -> None:
    """Both are said where nobody overlooks them."""
    titles = [properties["title"] for kind, properties, _ in rendered(undecided()) if kind == "warning"]
    assert titles[:2] == ["The score is not final", "No isolation"]


@pytest.mark.parametrize("outcome", [Outcome.NOT_MET, Outcome.PARTLY])
def test_no_kind_has_more_than_ten_and_none_is_forgotten(outcome: Outcome) -> None:
    """GitHub would drop the eleventh; the tenth names those that did not fit."""
    many = [criterion(f"c{n}", f"Criterion {n}", 1, outcome) for n in range(40)]
    found = rendered(report(exercise("e", "1", "E", *many)))
    counts = Counter(kind for kind, _, _ in found)
    assert max(counts.values()) == MOST_OF_A_KIND
    assert sum(counts.values()) <= 50
    rest = [message for _, properties, message in found if properties["title"] == "And 31 more"]
    assert len(rest[0].splitlines()) == 31


@pytest.mark.parametrize("name", SAMPLES)
def test_only_annotations_are_commands(name: str) -> None:
    """Nothing sets an output, masks a word or stops the runner from listening."""
    assert {kind for kind, _, _ in rendered(SAMPLES[name]())} <= {"notice", "warning", "error"}


ATTACKS = st.one_of(
    st.text(alphabet=st.characters(), max_size=40),
    st.lists(
        st.sampled_from(
            ["\n", "\r", "::", "error", " ", "%0A", "%", ",", "=", "##[", "]", "set-output", "\x85", "\u2028"]
        )
    ).map("".join),
)


@given(ATTACKS)
def test_no_text_of_a_student_is_a_command_or_a_property(text: str) -> None:
    """It arrives as what it is: in a title or a message."""
    verdict = criterion("c", text, 2, Outcome.NOT_MET, reason=text, hint=text, location=Location(text or "x", 3))
    sample = replace(report(exercise("e", "1", text, verdict, notes=(text,)), name=text, path=text), notes=(text,))
    plain = replace(report(exercise("e", "1", "t", criterion("c", "t", 2, Outcome.NOT_MET, location=Location("x", 3)))))
    found, expected = rendered(sample), rendered(plain)
    assert [(kind, set(properties)) for kind, properties, _ in found] == [(k, set(p)) for k, p, _ in expected]
    assert found[1][1]["line"] == "3"


def test_the_runner_reads_back_what_was_written() -> None:
    """Signs that mean something to it come through."""
    verdict = criterion(
        "c", "100 % a,b: c=d", 2, Outcome.NOT_MET, reason="a%0Ab: 50 %, ::x", location=Location("a,b:c.py", 3)
    )
    _, properties, message = rendered(report(exercise("e", "1", "E", verdict)), folder="")[1]
    assert properties["file"] == "a,b:c.py"
    assert properties["title"] == "Exercise 1, 100 % a,b: c=d: not met, 0/2"
    assert message.splitlines()[0] == "a%0Ab: 50 %, ::x"
    assert NASTY not in message
