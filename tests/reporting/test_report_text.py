"""The text report: golden outputs, widths, colour, hostile text, the drawn graph.

`UPDATE_GOLDEN=1 pytest tests/reporting` writes the golden files anew; read the difference before committing it.
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import replace
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from report_samples import (
    SAMPLES,
    both_ways,
    crashed,
    criterion,
    endpoint,
    exercise,
    hostile,
    middling,
    partial,
    perfect,
    report,
    two_nodes,
    undecided,
    velocity,
)
from rich.cells import cell_len

from grader.core.exercise import Location, Outcome
from grader.core.report import Report, Reproduction
from grader.core.trace import GraphSnapshot, ServiceEnd
from grader.reporting.escape import shown
from grader.reporting.graph import draw_graph
from grader.reporting.text import render_text

GOLDEN = Path(__file__).parent / "golden"
ANSI = re.compile(r"\x1b\[[0-9;]*m")


def render(sample: Report, width: int = 80, *, colour: bool = False) -> str:
    return render_text(sample, width=width, colour=colour)


def squeezed(text: str) -> str:
    return "".join(text.split())


@pytest.mark.parametrize("width", [120, 80, 40])
@pytest.mark.parametrize("name", SAMPLES)
def test_the_text_is_the_golden_one(name: str, width: int) -> None:
    """What a student sees changes only on purpose."""
    path = GOLDEN / f"{name}_{width}.txt"
    text = render(SAMPLES[name](), width)
    if os.environ.get("UPDATE_GOLDEN"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


def test_the_coloured_text_is_the_golden_one() -> None:
    """Colours too change only on purpose."""
    path = GOLDEN / "middling_80.ansi"
    text = render(middling(), colour=True)
    if os.environ.get("UPDATE_GOLDEN"):
        path.write_text(text, encoding="utf-8")
    assert text == path.read_text(encoding="utf-8")


@pytest.mark.parametrize("width", [20, 40, 57, 80, 200])
@pytest.mark.parametrize("name", SAMPLES)
def test_lines_keep_to_the_width_and_end_in_no_space(name: str, width: int) -> None:
    """A terminal never wraps what is already wrapped."""
    lines = render(SAMPLES[name](), width).split("\n")
    assert max(map(cell_len, lines)) <= width
    assert not [line for line in lines if line != line.rstrip()]
    assert "\n\n\n" not in "\n".join(lines)


def test_a_long_word_opens_no_gap_above_itself() -> None:
    """A blank line ends an exercise and nothing else."""
    verdict = criterion("c", "C", 1, Outcome.NOT_MET, reason=f"long {'A' * 200}")
    assert render(report(exercise("e", "1", "E", verdict)), 40).count("\n\n") == 2


@pytest.mark.parametrize("name", SAMPLES)
def test_colour_adds_nothing_but_colour(name: str) -> None:
    """A reader without colours misses no word."""
    coloured = render(SAMPLES[name](), colour=True)
    assert ANSI.sub("", coloured) == render(SAMPLES[name]())
    assert coloured != ANSI.sub("", coloured)


def test_the_environment_has_no_say(monkeypatch: pytest.MonkeyPatch) -> None:
    """The same report is the same text on every machine."""
    plain, coloured = render(middling()), render(middling(), colour=True)
    for name, value in {"NO_COLOR": "1", "TERM": "dumb", "COLUMNS": "33", "FORCE_COLOR": "1"}.items():
        monkeypatch.setenv(name, value)
    assert render(middling()) == plain
    assert render(middling(), colour=True) == coloured


def test_a_terminal_cannot_be_steered() -> None:
    """No escape sequence of a student survives, not even in the coloured text."""
    text = render(hostile(), colour=True)
    assert "\x1b" not in ANSI.sub("", text)
    assert not set(text) & set("\x07\x9b\u202e\u202c\u200b\r\t\ud800")
    assert "[bold red]pwned[/]" in text


@pytest.mark.parametrize("command", ["::error::x", "::add-mask::x", "##[error]x"])
def test_no_line_is_a_command_for_the_job_that_prints_it(command: str) -> None:
    """Neither a name at the beginning of the text nor a word that wrapping brought to the beginning of a line."""
    failed = criterion("c", "C", 1, Outcome.NOT_MET, reason=f"{'word ' * 20}{command} " * 5)
    out = render(replace(report(exercise("e", "1", "E", failed)), name=command))
    assert not [line for line in out.splitlines() if line.lstrip().startswith("::") or "##[" in line]


@given(st.text(alphabet=st.characters(), max_size=120), st.integers(min_value=40, max_value=120))
def test_no_text_of_a_student_is_lost_or_breaks_the_layout(text: str, width: int) -> None:
    """Wrapped as it may be, every printable character is there, in order, within the width."""
    sample = report(
        exercise(
            "e", "1", "E", criterion("c", "C", 1, Outcome.NOT_MET, reason=text, hint=f"do {text}"), notes=(f"n{text}",)
        )
    )
    out = render(sample, width)
    assert max(map(cell_len, out.split("\n"))) <= width
    assert squeezed(shown(text)) in squeezed(out)
    assert squeezed(f"hint: do {shown(text)}") in squeezed(out)


def test_the_head_says_score_and_finality_first() -> None:
    """A student in a hurry reads two lines."""
    lines = render(middling()).splitlines()
    assert lines[0] == "ada_homework: 13 of 60 points"
    assert lines[1] == "Final: 2 of 9 criteria met, 1 partly, 3 not met, 3 blocked."
    assert render(perfect()).splitlines()[1] == "Final: 12 of 12 criteria met."


def test_an_undecided_report_says_so_plainly() -> None:
    """Nobody takes a score that is not final for one that is."""
    text = " ".join(render(undecided()).split())
    assert "not final: 2 criteria are undecided through no fault of the student, 16 points are still open" in text
    assert "Final:" not in text
    one = report(exercise("e", "1", "E", criterion("c", "C", 5, Outcome.UNDECIDED)))
    assert "1 criterion is undecided through no fault of the student, 5 points" in " ".join(render(one).split())


def test_a_criterion_not_met_gives_reason_hint_and_place_in_this_order() -> None:
    """What was found, what to do, where."""
    text = render(middling(), 120)
    reason, hint, place = (text.index(s) for s in ("10.00 Hz", "hint: the argument", "at velocity_publisher.py:17"))
    assert reason < hint < place


def test_a_place_that_the_reason_names_is_not_repeated() -> None:
    """One place, said once."""
    assert "at velocity_publisher.py:14\n" not in render(crashed())


def test_a_blocked_criterion_takes_one_line() -> None:
    """One cause is told once; what hangs on it only says on what."""
    lines = [line for line in render(crashed()).splitlines() if "blocked" in line and line.startswith("  ")]
    assert lines[0] == "  blocked    0/10  Publishes at 20 Hz: needs publishes_twist (not met)"
    assert len(lines) == 3


def test_long_call_chains_are_shortened_in_the_middle() -> None:
    """A recursion of a thousand calls shows where it began and where it broke."""
    text = render(crashed())
    assert "(7 more calls)" in text
    assert "velocity_publisher.py:31 in <module>" in text
    assert "velocity_publisher.py:14 in __init__" in text


def test_many_faults_and_notes_are_counted_not_listed() -> None:
    """A flood of notes does not bury the score, and the rest can be found."""
    text = render(hostile())
    assert "and 2 more faults; all are in the JSON report" in text
    assert "and 5 more notes; all are in the JSON report" in text


def test_the_report_ends_with_the_command_that_gives_it_again() -> None:
    """Seed, versions, digests and clock stand above it."""
    lines = render(middling(), 120).splitlines()
    assert lines[-1] == "reproduce  grade ./ada_homework --seed 4711"
    assert [line.split()[0] for line in lines[-7:-1]] == [
        "seed",
        "versions",
        "isolation",
        "clock",
        "rubrics",
        "recording",
    ]
    assert "no sandbox" in render(undecided())


def test_a_long_command_can_be_copied() -> None:
    """It goes on in the next line as a shell wants it to, and no word of it is broken."""
    words = ("grade", "./ada", *(w for n in range(9) for w in ("--rubric", f"/a folder/{n}.yaml")))
    sample = replace(middling(), reproduce=Reproduction(command=words))
    command = render(sample, 60).split("reproduce", 1)[1]
    assert command.count("\n") > 4
    done = subprocess.run(["bash", "-c", f"printf '%s\\0' {command}"], capture_output=True, text=True, check=True)
    assert done.stdout.split("\0")[:-1] == list(words)


def test_only_the_head_differs_between_two_runs() -> None:
    """The same verdicts give the same text below; path and duration stand in one line above."""
    one, other = render(middling()), render(replace(middling(), path="./elsewhere", duration_s=7.0))
    changed = [a for a, b in zip(one.splitlines(), other.splitlines(), strict=True) if a != b]
    assert changed == ["graded ./ada_homework in 1.8 s"]


def test_a_partial_report_says_so_first() -> None:
    """What is still to be graded is named before any number below is read."""
    lines = render(partial(), 120).splitlines()
    assert lines[1] == "This report is partial: it was made before exercise 2 (16 points) had been graded."
    assert lines[2].startswith("So far: 5 of 7 criteria met")
    assert "Grade again" not in "".join(lines)


def test_points_are_short() -> None:
    """Thirds have two digits, whole points none."""
    text = render(report(exercise("e", "1", "E", criterion("c", "C", 5, Outcome.PARTLY), criterion("d", "D", 20))))
    assert "2.5/5" in text
    assert " 20/20" in text


def test_the_graph_is_drawn_both_ways_without_what_every_node_has() -> None:
    """Node, topic, node, as rqt_graph shows it."""
    assert draw_graph(both_ways(), width=80) == [
        "/fan_controller ──/fan_speed──▶ /temperature_sensor",
        "/temperature_sensor ──/temperature──▶ /fan_controller",
    ]


def test_a_narrow_graph_breaks_at_the_node() -> None:
    """An arrow stays whole."""
    assert draw_graph(both_ways(), width=40)[2:] == ["/temperature_sensor", "  ──/temperature──▶ /fan_controller"]


def test_services_are_drawn_from_client_to_server() -> None:
    """One line each; what nobody calls or serves is told, and parts of actions are left out."""
    kind = "std_srvs/srv/Trigger"
    ends = (
        ServiceEnd("client", "/battery", kind, "/a"),
        ServiceEnd("client", "/lost", kind, "/a"),
        ServiceEnd("client", "/mixed", "std_srvs/srv/Empty", "/a"),
        ServiceEnd("service", "/battery", kind, "/b"),
        ServiceEnd("service", "/count/_action/send_goal", kind, "/b"),
        ServiceEnd("service", "/mixed", kind, "/b"),
    )
    assert draw_graph(GraphSnapshot(0, ("/a", "/b", "/idle"), (), ends), width=80) == [
        "/a ┄┄/battery┄┄▶ /b",
        "/a ┄┄/lost┄┄▶ (nobody)",
        "/a ┄┄/mixed┄┄▶ (nobody)",
        "(nobody) ┄┄/mixed┄┄▶ /b",
        "/idle (no topics)",
    ]


def test_loose_ends_and_quarrels_are_drawn() -> None:
    """A student sees why nothing arrives."""
    graph = GraphSnapshot(
        0,
        ("/a", "/b", "/idle"),
        (
            endpoint("publisher", "/t", "/a"),
            endpoint("publisher", "/lonely", "/a"),
            endpoint("subscription", "/t", "/b", "std_msgs/msg/Float64"),
            endpoint("subscription", "/mute", "/b"),
        ),
    )
    assert draw_graph(graph, width=80) == [
        "/a ──/t──▶ /b",
        "  types differ: std_msgs/msg/Float32, std_msgs/msg/Float64",
        "/a ──/lonely──▶ (nobody)",
        "(nobody) ──/mute──▶ /b",
        "/idle (no topics)",
    ]


def test_a_flood_of_topics_is_counted() -> None:
    """A node with a thousand topics does not fill the screen."""
    many = tuple(endpoint("publisher", f"/t{number}", "/a") for number in range(1000))
    lines = draw_graph(GraphSnapshot(0, ("/a",), many), width=80)
    assert len(lines) == 41
    assert lines[-1] == "and 960 more"


def test_one_node_alone_gets_no_drawing() -> None:
    """The graph of exercise 1 would say nothing new."""
    alone = GraphSnapshot(0, ("/a",), (endpoint("publisher", "/cmd_vel", "/a"),))
    first = exercise("e", "1", "E", criterion("c", "C", 1), graph=alone)
    assert "graph" not in render(report(first))
    assert "Live ROS graph" in render(report(velocity(), two_nodes()))


def test_a_place_without_a_line_is_a_file() -> None:
    """`velocity_publisher.py:0` helps nobody."""
    verdict = criterion("c", "C", 1, Outcome.NOT_MET, location=Location("a.py", 0))
    assert "at a.py\n" in render(report(exercise("e", "1", "E", verdict)))
