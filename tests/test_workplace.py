"""The student's workplace: VS Code finds every place of a report, hooks and notebook name commands that exist."""

import json
import re
import shlex
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from archive import judged, recordings
from click.testing import CliRunner
from parsed_commands import parsed
from places import ROOT
from sample_folders import expected
from tables import read_table

from grader.cli.main import app
from grader.grading.model.report import Report
from grader.grading.reporting import delivery
from grader.grading.reporting.text import render_text

TEMPLATE = ROOT / "student_template"
TASKS = json.loads((TEMPLATE / ".vscode" / "tasks.json").read_text(encoding="utf-8"))["tasks"]
COLUMNS = int(TASKS[0]["options"]["env"]["COLUMNS"])
#: Submissions that lost points, of each kind of mistake some.
WRONG = [folder for folder in expected() if folder.startswith(("wrong/", "broken/"))][::14]

Place = tuple[str, int]


def found(task: dict[str, Any], text: str) -> Iterator[tuple[Place, str]]:
    """Yield the places that VS Code marks, with their messages: one pattern for each of the lines that follow."""
    lines = text.splitlines()
    for matcher in task["problemMatcher"]:
        patterns = matcher["pattern"] if isinstance(matcher["pattern"], list) else [matcher["pattern"]]
        for at in range(len(lines) - len(patterns) + 1):
            hits = [re.search(p["regexp"], line) for p, line in zip(patterns, lines[at:], strict=False)]
            told: dict[str, str] = {}
            for pattern, hit in zip(patterns, hits, strict=True):
                if hit is not None:
                    told |= {name: hit[group] for name, group in pattern.items() if name != "regexp"}
            if all(hits):
                yield (told["file"], int(told["line"])), told["message"]


def wanted(report: Report) -> set[Place]:
    """Return the places of a report that are shown: not that of a criterion with the cause of the first."""
    lost = [v for e in report.exercises for v in e.verdicts if v.score < v.max_score and v.location is not None]
    return {(v.location.file, v.location.line) for v in lost if v.location and not v.same_cause_as and v.location.line}


@cache
def report_of(folder: str) -> Report:
    """Judge what was recorded of a submission."""
    return judged(recordings()[folder])


@pytest.mark.breadth(10, 50)
@pytest.mark.parametrize("folder", WRONG)
@pytest.mark.parametrize("task", TASKS, ids=lambda task: task["label"])
def test_every_place_of_a_report_becomes_clickable(task: dict[str, Any], folder: str) -> None:
    """Each with its cause, and nothing else does."""
    report = report_of(folder)
    places = dict(found(task, render_text(report, width=COLUMNS, colour=False)))
    assert set(places) == wanted(report)
    assert all(message.strip() for message in places.values())


@pytest.mark.long
def test_enough_places_are_tried() -> None:
    """The test above compares more than empty sets."""
    assert sum(len(wanted(report_of(folder))) for folder in WRONG) > 20


def test_programs_that_read_lines_get_whole_ones(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    """COLUMNS, as the tasks set it, is wider than what people like to read."""
    for columns, width in (("1000", "1000"), ("50", "50"), ("", "80")):
        monkeypatch.setenv("COLUMNS", columns)
        delivery.show(lambda layout: str(layout.width), for_people=True)
        assert capsys.readouterr().out.strip() == width


def test_the_task_that_watches_says_when_it_begins_and_ends() -> None:
    """A report begins with its headline, and what follows the last one is that it waits."""
    for matcher in TASKS[1]["problemMatcher"]:
        assert re.search(matcher["background"]["beginsPattern"], ".: 27.5 of 100 points")
        assert re.search(matcher["background"]["endsPattern"], "watching for the next save; Ctrl-C ends this")


def commands() -> list[str]:
    """Return every command of the grader that the workplace names."""
    hooks = read_table(ROOT / ".pre-commit-hooks.yaml")
    cells = json.loads((ROOT / "docs" / "how-to" / "notebook.ipynb").read_text(encoding="utf-8"))["cells"]
    lines = [line for cell in cells if cell["cell_type"] == "code" for line in "".join(cell["source"]).splitlines()]
    return [
        *(task["command"] for task in TASKS),
        *(f"{hook['entry']} x" for hook in hooks),
        *(line.removeprefix("!") for line in lines if line.startswith("!grade")),
    ]


@pytest.mark.parametrize("command", commands())
def test_every_command_can_be_parsed(command: str) -> None:
    """Those of the tasks, of the hooks and of the notebook."""
    program, *words = shlex.split(command)
    assert program == "grade"
    parsed(words)


def test_a_container_chooses_its_sandbox(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """By the variable that the devcontainer sets, which is checked like the option."""
    container = json.loads((TEMPLATE / ".devcontainer" / "devcontainer.json").read_text(encoding="utf-8"))
    ((name, value),) = container["remoteEnv"].items()
    monkeypatch.setenv(name, value)
    assert app.default.make_context("grade", ["x"]).params["isolation"] == value
    assert app.default.make_context("grade", ["x", "--isolation", "bubblewrap"]).params["isolation"] == "bubblewrap"
    monkeypatch.setenv(name, "nonsense")
    assert CliRunner().invoke(app, [str(tmp_path)]).exit_code == 2
