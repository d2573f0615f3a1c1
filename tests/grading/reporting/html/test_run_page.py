"""The page of a failed test: its parts in order, that hostile text stays text, and that nothing is loaded."""

from __future__ import annotations

import base64
import hashlib
import json
import re

import pytest
from parsed_page import MARKUP, Page
from stepped import page_of_failed_test

from grader.grading.reporting.html.assets import bundle


@pytest.mark.parametrize("text", MARKUP)
def test_hostile_text_makes_no_element_and_no_attribute_in_a_run(text: str) -> None:
    """With an attack in every text the page has the elements and attributes that it has with harmless text."""
    harmless, attacked = Page(page_of_failed_test()), Page(page_of_failed_test(text))
    assert attacked.tags == harmless.tags
    assert [(t, n) for t, n, _ in attacked.attributes] == [(t, n) for t, n, _ in harmless.attributes]
    assert attacked.open == []


def test_a_run_has_values_steps_and_the_failing_line() -> None:
    """What failed comes first; then the run, the values and the steps, the one that failed marked and named so."""
    page = page_of_failed_test()
    headings = re.findall(r"<h([1-6])[^>]*>(?:<bdi>)?([^<]+)", page)
    assert headings[:6] == [
        ("1", "fine"),
        ("2", "Where it failed"),
        ("2", "What happened"),
        ("3", "What the nodes did"),
        ("4", "The run"),
        ("3", "Values over time"),
    ]
    assert headings[-1] == ("3", "The steps of the test")
    assert "3 earlier steps are left out" in page
    assert "1 earlier step is left out" in page_of_failed_test(omitted=1)
    (failed,) = re.findall(r"<tr class=meant>(.*?)</tr>", page, re.DOTALL)
    assert re.sub(r"<[^>]+>|\s+", " ", failed).split() == ["0.000", "4.000", "fine.py,", "line", "6", "fine", "failed"]


def test_the_charts_of_a_run_are_in_its_data() -> None:
    """Every figure of the page has its values, and nothing else is there."""
    page = page_of_failed_test()
    figures = json.loads(Page(page).raw["figures"])["figures"]
    assert set(figures) == set(re.findall(r'data-figure="([^"]+)"', page))
    assert {"run", "values-1", "values-2", "values-3", "values-4"} == set(figures)
    assert [box["name"] for box in figures["run"]["graph"]["services"]] == ["/addfine"]


def test_a_run_may_load_nothing_and_run_its_own_script_only() -> None:
    """The policy allows the one script, by its digest."""
    page = page_of_failed_test()
    (policy,) = re.findall(r'Content-Security-Policy" content="([^"]+)"', page)
    digest = base64.b64encode(hashlib.sha256(bundle().script.encode()).digest()).decode()
    assert policy.startswith(f"default-src 'none'; script-src 'sha256-{digest}';")
    assert not re.search(r"(?:src|href)=\"(?:https?:)?//", page)
