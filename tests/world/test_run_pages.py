"""What a test does itself is on the page of its run: steps with their lines, and what it offers to programs."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from std_msgs.msg import String
from std_srvs.srv import SetBool, Trigger

import grader
from grader.runtime.steps import Advance
from grader.world.calls import MOST_CALLS, CallLog
from grader.world.errors import StepTimeout
from grader.world.world import World

HERE = Path(__file__)


def line_of(text: str) -> int:
    """Return the number of the one line of this file that ends with a comment."""
    (found,) = [n for n, line in enumerate(HERE.read_text(encoding="utf-8").splitlines(), 1) if line.endswith(text)]
    return found


def kept_page(ros: World, folder: Path, failed_at: tuple[str, int] | None = None) -> tuple[str, dict[str, Any]]:
    """Return the page of a run, and the values in it."""
    page = ros.keep(folder, "why", failed_at)[1].read_text(encoding="utf-8")
    (data,) = re.findall(r'<script type="application/json" id="figures">(.*?)</script>', page, re.DOTALL)
    found: dict[str, Any] = json.loads(data)
    return page, found


def steps_of(page: str) -> list[tuple[str, str, int]]:
    """Return from when, until when and in which line each step was."""
    rows = re.findall(r"<tr[^>]*><td class=\"num\">([\d.]+)</td><td class=\"num\">([\d.]+)</td>\s*<td>line (\d+)", page)
    return [(begin, end, int(line)) for begin, end, line in rows]


@pytest.mark.ros
def test_each_call_has_its_line_and_its_times(ros: World, tmp_path: Path) -> None:
    """A call that another one makes is no step, nor is a look of a condition; what fails is marked."""
    echo = ros.run("nodes/echo.py")  # step 1
    ros.publish("/in", String(data="<i>a</i>"), rate=2)  # step 2
    ros.advance(1.0)  # step 3
    ros.wait_until(lambda: len(ros.messages("/out")) > 4, timeout=5)  # step 4
    with pytest.raises(StepTimeout):
        ros.wait_until(lambda: ros.messages("/none"), timeout=0.5)  # step 5
    echo.kill()  # step 6
    here = line_of("# here it failed")
    page, data = kept_page(ros, tmp_path, (str(HERE), here))  # here it failed
    assert steps_of(page) == [
        ("0.000", "0.000", line_of("# step 1")),
        ("0.000", "0.000", line_of("# step 2")),
        ("0.000", "1.000", line_of("# step 3")),
        ("1.000", "2.000", line_of("# step 4")),
        ("2.000", "2.500", line_of("# step 5")),
        ("2.500", "2.500", line_of("# step 6")),
        ("2.500", "2.500", here),
    ]
    assert "ros.advance(1.0)  # step 3" in page
    assert f"{HERE.name}:{here}" in page
    assert "<i>a" not in page
    titles = [figure["title"] for figure in data["figures"].values() if figure["kind"] == "chart"]
    assert titles == ["Messages published on /out", "Messages published by the test on /in"]


@pytest.mark.ros
def test_services_of_the_test_are_in_the_graph(ros: World, tmp_path: Path) -> None:
    """What it serves, and what it calls; a wait in which no time passes is no step."""
    ros.serve("/allowed", Trigger, lambda _: Trigger.Response(success=True))
    ros.run("nodes/switch.py")
    pending = ros.call_async("/enable", SetBool.Request(data=True))
    assert pending.wait().success
    ros.set_parameter("/switch", "step", 2)
    ros.advance(0.5)
    page, data = kept_page(ros, tmp_path)
    graph = data["figures"]["run"]["graph"]
    boxes = {box["id"]: box["name"] for box in (*graph["nodes"], *graph["topics"], *graph["services"])}
    assert {(boxes[e["from"]], boxes[e["to"]]) for e in graph["edges"]} == {
        ("/switch", "/count"),
        ("/switch", "/allowed"),
        ("/allowed", "the test"),
        ("the test", "/enable"),
        ("/enable", "/switch"),
    }
    assert len(steps_of(page)) == 5
    assert "Where it failed" not in page


def test_of_very_many_calls_the_last_ones_are_kept() -> None:
    """A test that steps in a loop does not fill the memory; a call inside of another one is not noted."""
    log = CallLog(lambda: 7)
    inner = log.noting("inner", lambda number: number)
    outer = log.noting("outer", inner)
    assert [outer(k) for k in range(MOST_CALLS + 5)] == [*range(MOST_CALLS + 5)]
    assert (log.count, len(log.calls)) == (MOST_CALLS + 5, MOST_CALLS)
    assert {(call.name, call.file, call.begin_ns, call.failed) for call in log.calls} == {
        ("outer", str(HERE), 7, False)
    }


def test_a_look_at_what_has_happened_is_not_a_step() -> None:
    """On the wall clock, time passes between two commands, also after the test; a wait until later is a step."""
    now_ns = 0
    log = CallLog(lambda: now_ns)
    for to_ns, now_ns in ((0, 5), (20, 30), (30, 31)):  # noqa: B007 - the log asks for it
        log.note(Advance(to_ns), {}, [])
    assert [(call.name, call.begin_ns, call.end_ns) for call in log.calls] == [("wait", 5, 30)]


def test_a_call_that_raises_is_noted_and_closed() -> None:
    """The next call is one of the test again."""
    log = CallLog(lambda: 0)
    fails = log.noting("fails", lambda: 1 // 0)
    for _ in range(2):
        with pytest.raises(ZeroDivisionError):
            fails()
    assert [(call.name, call.failed) for call in log.calls] == [("fails", True)] * 2


def test_a_folder_whose_name_begins_as_that_of_the_grader_is_none_of_its_own() -> None:
    """The line of a step is the one of the test there."""
    log = CallLog(lambda: 0)
    test = f"{Path(grader.__file__).parent}_exercises/test_it.py"
    exec(compile("\n\nstep()", test, "exec"), {"step": log.noting("step", list)})
    assert [(call.file, call.line) for call in log.calls] == [(test, 3)]
