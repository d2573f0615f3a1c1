"""What is true of every format: golden outputs, one header for the run, the way to repeat it, isolation, hostile text.

`UPDATE_GOLDEN=1 pytest tests/grading/reporting` writes the golden files anew; read the difference before committing it.
"""

from __future__ import annotations

import base64
import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import pytest
from report_samples import HANDED_IN, SAMPLES, hostile, middling, partial, perfect, undecided

from grader.grading.model.exercise import Audience
from grader.grading.model.report import Report
from grader.grading.reporting.formats import FORMATS, PageLayout
from grader.grading.reporting.html.render import render_html
from grader.grading.reporting.json_report import dumps
from grader.grading.reporting.junit import render_junit
from grader.grading.reporting.markdown import render_markdown
from grader.grading.reporting.platforms.classroom import render_classroom
from grader.grading.reporting.platforms.classroom50 import render_classroom50
from grader.grading.reporting.platforms.github import render_github
from grader.grading.reporting.platforms.gradescope import render_gradescope
from grader.grading.reporting.platforms.prairielearn import render_prairielearn
from grader.grading.reporting.text import render_text

GOLDEN = Path(__file__).parent / "golden"
RENDERERS: dict[str, Callable[[Report], str]] = {
    "text": lambda report: render_text(report, width=100, colour=False, verbose=True),
    "json": dumps,
    "html": lambda report: render_html(report, assets="."),
    "markdown": render_markdown,
    "junit": lambda report: render_junit(report, folder="homework"),
    "github": lambda report: render_github(report, folder="homework"),
    "gradescope": render_gradescope,
    "prairielearn": render_prairielearn,
    "classroom50": lambda report: render_classroom50(report, HANDED_IN),
    "classroom": lambda report: base64.b64decode(render_classroom(report)).decode(),
}
ENDINGS = {"markdown": "md", "junit": "junit.xml", "github": "github.txt"}
#: How many lines name the run: its path, or how long it took.
RUN_LINES = {"text": 1, "html": 1, "json": 2, "markdown": 1, "junit": 1, "gradescope": 2, "prairielearn": 1}


@pytest.mark.parametrize("name", ENDINGS)
@pytest.mark.parametrize("sample", ["crashed", "middling", "perfect", "undecided", "hostile"])
def test_the_output_is_the_golden_one(name: str, sample: str) -> None:
    """What people and platforms see changes only on purpose."""
    path = GOLDEN / f"{sample}.{ENDINGS[name]}"
    text = RENDERERS[name](SAMPLES[sample]())
    if os.environ.get("UPDATE_GOLDEN"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", RENDERERS)
def test_the_same_trace_gives_the_same_bytes(name: str) -> None:
    """No date, host name or random word is in any format."""
    assert RENDERERS[name](hostile()) == RENDERERS[name](hostile())


@pytest.mark.parametrize("name", RENDERERS)
def test_only_the_header_differs_between_two_runs(name: str) -> None:
    """Path and duration stand in one place; formats that need neither are the same from the first byte to the last."""
    one = RENDERERS[name](middling()).splitlines()
    other = RENDERERS[name](replace(middling(), path="./elsewhere", duration_s=7.0)).splitlines()
    changed = [number for number, (a, b) in enumerate(zip(one, other, strict=True)) if a != b]
    assert len(changed) == RUN_LINES.get(name, 0)


@pytest.mark.parametrize("name", RENDERERS)
@pytest.mark.parametrize("sample", SAMPLES)
def test_every_report_says_what_gives_it_again(name: str, sample: str) -> None:
    """The command, the seed, the rubric and the versions."""
    text = RENDERERS[name](SAMPLES[sample]())
    for word in ("--seed 4711", "sha256:000000000000", "7.1.6", "0.1.0", "jazzy"):
        assert word in text


@pytest.mark.parametrize("name", sorted(set(RENDERERS) - {"json"}))
def test_students_get_nothing_that_only_staff_can_use(name: str) -> None:
    """Neither digests, nor commands on a machine of somebody else, nor notes on its sandbox."""
    sample = replace(middling(), notes=("of their files", "of the machine"), staff_notes=("of the machine",))
    text = RENDERERS[name](replace(sample, audience=Audience.STUDENT))
    for word in ("--seed", "sha256:000000000000", "7.1.6", "of the machine"):
        assert word not in text
    assert "4711" in text
    assert "of their files" in text


@pytest.mark.parametrize("name", RENDERERS)
def test_a_run_without_a_sandbox_says_so(name: str) -> None:
    """No platform passes it over in silence."""
    assert "no sandbox" in RENDERERS[name](undecided()) or '"isolation": "none"' in RENDERERS[name](undecided())
    assert "no sandbox" not in RENDERERS[name](perfect())


@pytest.mark.parametrize("name", sorted(set(RENDERERS) - {"json"}))
def test_a_partial_report_says_so_in_every_format_for_people(name: str) -> None:
    """Nobody takes it for the whole."""
    assert "This report is partial" in RENDERERS[name](partial())
    assert "partial" not in RENDERERS[name](undecided())


@pytest.mark.parametrize("name", RENDERERS)
@pytest.mark.parametrize("sample", SAMPLES)
def test_nothing_steers_a_terminal_and_all_can_be_encoded(name: str, sample: str) -> None:
    """No control character, direction override or lone surrogate comes through."""
    text = RENDERERS[name](SAMPLES[sample]())
    text.encode("utf-8")
    assert not set(text) & set("\x1b\x07\x9b\u202e\u202c\u200b\r\t\ud800")


@pytest.mark.parametrize("name", sorted(set(FORMATS) & set(RENDERERS) - {"classroom50"}))
def test_the_table_of_formats_names_the_right_renderer(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """What the command line writes is what the tests look at."""
    monkeypatch.delenv("GITHUB_WORKSPACE", raising=False)
    sample = replace(middling(), path="/nowhere/at/all.zip")
    expected = {
        "github": lambda report: render_github(report, folder=None),
        "junit": lambda report: render_junit(report, folder=None),
        "classroom": render_classroom,
        "html": render_html,
    }.get(name, RENDERERS[name])
    assert FORMATS[name](sample, PageLayout(100, colour=False, verbose=True)) == expected(sample)
