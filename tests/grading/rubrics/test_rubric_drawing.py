"""Parts of a rubric drawn from the seed besides values: their syntax, and the messages about mistakes in them."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from grader.grading.rubrics.loader import read_rubric
from grader.runtime.model.errors import RubricError
from grader.runtime.model.scenario import AnyOrder, Between, CountBetween, InOrder, Scenario, SomeOf, TimeBetween

MS, S = 1_000_000, 1_000_000_000
HEAD = """\
schema: grader/rubric/v1
exercise: {id: battery, number: 7, title: A battery}
files: [server.py, client.py]
scenarios:
  - id: alone
    processes: [server.py, client.py]
"""
TAIL = """\
criteria:
  - {id: rate, title: A rate, points: 1, scenario: alone, check: {publishes: {topic: /a, type: std_msgs/msg/String}}}
"""
NUMBERS = """\
observe: {duration: 20 s}
stimuli:
  - numbers: {topic: /a, type: std_msgs/msg/Float32, period: 200 ms, %s}
"""
SERVER = """\
observe: {duration: 20 s}
stimuli:
  - server:
      service: /s
      type: std_srvs/srv/Trigger
      %s
"""
CALLS = """\
observe: {duration: 20 s}
stimuli:
  - calls: {service: /s, type: std_srvs/srv/Trigger, %s}
"""


@pytest.fixture
def scenario(tmp_path: Path) -> Callable[..., Any]:
    """Read the scenario of a rubric with some more lines in it."""

    def read(lines: str) -> Scenario | None:
        folded = "".join(f"    {line}\n" for line in lines.splitlines())
        (tmp_path / "r.yaml").write_text(HEAD + folded + TAIL, encoding="utf-8")
        return read_rubric(tmp_path / "r.yaml").scenarios[0]

    return read


def test_times_are_drawn_between_two(scenario: Callable[..., Any]) -> None:
    """Of the observation, of a process, of a stimulus, and for how long each number is held."""
    found = scenario("""\
observe: {duration: {between: [19 s, 21.5 s]}}
start: {client.py: {between: [500 ms, 1 s]}}
stimuli:
  - recorded:
      {topic: /odom, type: nav_msgs/msg/Odometry, start: {between: [0 s, 2 s]}, duration: {between: [9 s, 10 s]}}
  - numbers:
      {topic: /a, type: std_msgs/msg/Float32, period: 200 ms, values: [1], hold: {between: [1 s, 2 s]}}
  - server: {service: /s, type: std_srvs/srv/Trigger, responses: [{}], delay: {between: [10 ms, 20 ms]}}
""")
    odometry, numbers, server = found.stimuli
    assert found.span.duration_ns == TimeBetween(19 * S, 21 * S + 500 * MS)
    assert found.starts_ns == (("client.py", TimeBetween(500 * MS, S)),)
    assert (odometry.start_ns, odometry.duration_ns) == (TimeBetween(0, 2 * S), TimeBetween(9 * S, 10 * S))
    assert (numbers.start_ns, numbers.hold_ns) == (0, TimeBetween(S, 2 * S))
    assert server.delay_ns == TimeBetween(10 * MS, 20 * MS)


def test_counts_are_drawn_between_two(scenario: Callable[..., Any]) -> None:
    """Of calls, of repeats, and of answers before a server goes."""
    found = scenario("""\
observe: {duration: 20 s}
stimuli:
  - calls: {service: /s, type: std_srvs/srv/Trigger, calls: {between: [3, 5]}}
  - messages: {topic: /m, type: std_msgs/msg/Empty, values: [{}], repeats: {between: [1, 2]}}
  - server: {service: /t, type: std_srvs/srv/Trigger, responses: [{}], answers: {between: [2, 3]}}
""")
    calls, messages, server = found.stimuli
    drawn = (calls.calls, messages.repeats, server.answers)
    assert drawn == (CountBetween(3, 5), CountBetween(1, 2), CountBetween(2, 3))


def test_cases_come_in_a_drawn_order(scenario: Callable[..., Any]) -> None:
    """Some of them together, and some of them a drawn number of times."""
    written = "{any_order: [1, {in_order: [{between: [2, 3]}, 4]}, {some_of: [5, 6], count: {between: [0, 2]}}]}"
    (numbers,) = scenario(NUMBERS % f"values: [{written}, 7], hold: 1 s").stimuli
    some = SomeOf((5.0, 6.0), CountBetween(0, 2))
    assert numbers.values == (AnyOrder((1.0, InOrder((Between(2, 3), 4.0)), some)), 7.0)


def test_messages_come_in_a_drawn_order_too(scenario: Callable[..., Any]) -> None:
    """And requests, and responses; a field may be called as it likes."""
    written = "responses: [{any_order: [{success: true}, {message: x}]}, {success: false}]"
    (server,) = scenario(SERVER % written).stimuli
    assert server.responses == (AnyOrder(({"success": True}, {"message": "x"})), {"success": False})


CUT = "so that every case is played whatever is drawn, found"


@pytest.mark.parametrize(
    ("lines", "message", "hint"),
    [
        (NUMBERS % "values: [1], hold: {between: |[2 s, 1 s]}", "expected two of them, the lower one first", ""),
        (NUMBERS % "values: [1], hold: {|betwen: [1 s, 2 s]}", "expected `between` in `hold`", "`between`?"),
        (NUMBERS % "values: [1], hold: {between: [|1, 2 s]}", "expected a duration with its unit", "`1 s`"),
        (NUMBERS % "values: [|{anyorder: [1, 2]}], hold: 1 s", "expected a case, `any_order`", "`any_order`?"),
        (NUMBERS % "values: [|{some_of: [1, 2]}], hold: 1 s", "expected the key `count`", ""),
        (NUMBERS % "values: [{any_order: |[]}], hold: 1 s", "expected a list with at least one entry", ""),
        (NUMBERS % "values: [{some_of: [1], count: {between: |[2, 2]}}], hold: 1 s", "expected two whole numbers", ""),
        (NUMBERS % "values: [{some_of: [|x], count: 1}], hold: 1 s", "expected a number, found `x`", ""),
        (CALLS % "calls: |{between: [0, 2]}", "expected two whole numbers from 1 to 1,000", ""),
        (CALLS % "start: |{between: [1 s, 20 s]}", "expected a start before the end of `observe`", ""),
        (SERVER % "responses: [|{any_ordr: [{success: true}]}]", "expected a case, `any_order`", "`any_order`?"),
        (SERVER % "responses: [{message: {choose: [x], |txt: {}}}]", "expected `between`, `choose`, `text`", "`text`?"),
        (
            (NUMBERS % "values: [{any_order: [1, 2, 3]}], hold: {between: [5 s, 7 s]}, start: 1 s").replace(
                "20", "|20"
            ),
            f"expected at least 22 s, {CUT} 20 s",
            "",
        ),
        ((CALLS % "calls: {between: [9, 30]}").replace("20", "|20"), f"expected at least 30 s, {CUT} 20 s", ""),
        (
            (CALLS % "calls: 19").replace("20 s", "|{between: [18 s, 21 s]}"),
            f"expected at least 19 s, {CUT} as little as 18 s",
            "",
        ),
    ],
)
def test_a_mistake_is_named_with_its_place(scenario: Callable[..., Any], lines: str, message: str, hint: str) -> None:
    """Line and column of what is wrong, here behind the bar, and what was likely meant."""
    before = lines.partition("|")[0].split("\n")
    place = f"{HEAD.count(chr(10)) + len(before)}:{5 + len(before[-1])}"
    with pytest.raises(RubricError) as refused:
        scenario(lines.replace("|", ""))
    assert f"{place}: {message}" in refused.value.message
    assert hint in refused.value.hint


def test_a_rubric_in_which_nothing_is_open_may_cut_its_stimuli_off(scenario: Callable[..., Any]) -> None:
    """As before: what its author wrote down is what happens."""
    assert scenario(NUMBERS % "values: [1, 2, 3], hold: 9 s").span.duration_ns == 20 * S
