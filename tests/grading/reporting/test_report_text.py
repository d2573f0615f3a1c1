"""The text report: golden outputs, widths, colour, hostile text, the drawn graph.

`UPDATE_GOLDEN=1 pytest tests/grading/reporting` writes the golden files anew; read the difference before committing it.
"""

from __future__ import annotations

import os
import re
import subprocess
from dataclasses import replace
from pathlib import Path
from typing import Any

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

from grader.grading.model.chart import Excerpt
from grader.grading.model.exercise import Audience, Location, Outcome
from grader.grading.model.report import (
    SUBMISSION_SUSPECTED,
    ExerciseReport,
    Report,
    ReportedFault,
    Reproduction,
    Verdict,
)
from grader.grading.reporting.escape import shown
from grader.grading.reporting.graph import draw_graph, draw_mermaid
from grader.grading.reporting.text import render_text
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.trace import GraphSnapshot, ServiceEnd

GOLDEN = Path(__file__).parent / "golden"
ANSI = re.compile(r"\x1b\[[0-9;]*m")


def render(sample: Report, width: int = 80, *, colour: bool = False, verbose: bool = False) -> str:
    return render_text(sample, width=width, colour=colour, verbose=verbose)


def squeezed(text: str) -> str:
    return "".join(text.split())


@pytest.mark.parametrize(("width", "verbose"), [(120, False), (80, False), (40, False), (80, True)])
@pytest.mark.parametrize("name", SAMPLES)
def test_the_text_is_the_golden_one(name: str, width: int, verbose: bool) -> None:
    """What a student sees changes only on purpose."""
    path = GOLDEN / f"{name}_{width}{'_verbose' if verbose else ''}.txt"
    text = render(SAMPLES[name](), width, verbose=verbose)
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


@pytest.mark.parametrize("verbose", [False, True])
@pytest.mark.parametrize("width", [20, 40, 57, 80, 200])
@pytest.mark.parametrize("name", SAMPLES)
def test_lines_keep_to_the_width_and_end_in_no_space(name: str, width: int, verbose: bool) -> None:
    """A terminal never wraps what is already wrapped."""
    lines = render(SAMPLES[name](), width, verbose=verbose).split("\n")
    assert max(map(cell_len, lines)) <= width
    assert not [line for line in lines if line != line.rstrip()]
    assert "\n\n\n" not in "\n".join(lines)


@pytest.mark.parametrize("width", [40, 80, 120])
def test_the_line_to_fix_is_shown_whole(width: int) -> None:
    """In a log of GitHub as well, where nobody can widen the window."""
    code = "self.publisher = self.create_publisher(geometry_msgs.msg.Twist, '/cmd_velocity', qos_profile=10)"
    verdict = criterion("c", "C", 1, Outcome.NOT_MET, reason="no message", location=Location("a.py", 7))
    shown_ = render(report(exercise("e", "1", "E", verdict, excerpts=(Excerpt("a.py", 7, 7, (code,)),))), width)
    assert squeezed(f"a.py:7: {code}") in squeezed(shown_)
    assert "…" not in shown_


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
    lines = render(middling(), verbose=True).splitlines()
    assert lines[0] == render(middling()).splitlines()[0] == "ada_homework: 13 of 60 points"
    assert lines[1] == "Final: 2 of 9 criteria met, 1 partly, 3 not met, 3 blocked."
    assert render(perfect(), verbose=True).splitlines()[1] == "Final: 12 of 12 criteria met."


def located(**changes: object) -> ExerciseReport:
    """Return an exercise that lost points in line 8 of a file, and others for the same cause or on their own."""
    fields: dict[str, object] = {
        "location": Location("a.py", 8),
        "brief": "/t: 10.0 Hz, expected 20 Hz",
        "hint": "do X",
    }
    rate = criterion("rate", "Rate", 10, Outcome.NOT_MET, **{**fields, **changes})
    follows = criterion("turn", "Turn", 5, Outcome.NOT_MET, hint="this has the same cause", same_cause_as="rate")
    rest = criterion("log", "Log", 4, Outcome.PARTLY, reason="printed", hint="log", location=Location("a.py", 9))
    return exercise("e", "1", "E", rate, follows, rest, excerpts=(Excerpt("a.py", 8, 7, ("import x", "  RATE = 10")),))


def test_what_to_do_about_something_undecided_is_said_once() -> None:
    """However many criteria wait for it."""
    known: dict[str, Any] = {"outcome": Outcome.UNDECIDED, "reason": "tf2_ros is not installed", "hint": "install it"}
    waiting = [criterion(str(n), f"Criterion {n}", 5, **known) for n in range(3)]
    text = render(report(exercise("one", "1", "Odometry", *waiting)))
    assert text.count("tf2_ros is not installed") == text.count("hint: install it") == 1
    assert text.count("for the same reason") == 2


def test_the_first_thing_to_fix_stands_on_top() -> None:
    """Cause, place with the line of the source, and one thing to do, in lines two to four."""
    lines = render(report(located())).splitlines()
    assert lines[1:4] == ["Fix first: /t: 10.0 Hz, expected 20 Hz", "  a.py:8: RATE = 10", "  hint: do X"]
    assert lines[6:9] == [
        "  not met    0/10  Rate: see above",
        "  not met     0/5  Turn: same cause as above",
        "  partly      2/4  Log: printed (a.py:9)",
    ]


def test_a_fault_names_its_own_line_if_another_has_to_be_changed() -> None:
    """The line that raised is not always the one to fix."""
    fault = {"process": "a.py", "file": "a.py", "line": 20, "text": "E: no"}
    shown_at = [render(report(located(brief="E: no", evidence={"fault": {**fault, "line": n}}))) for n in (20, 8)]
    assert [text.splitlines()[1] for text in shown_at] == ["Fix first: a.py:20: E: no", "Fix first: E: no"]


def test_a_file_that_is_not_there_comes_after_one_that_is() -> None:
    """Unless another file may be meant; an exercise without any file takes one line."""
    absent = exercise("f", "2", "F", *missing("b.py"))
    text = render(report(absent, located()))
    assert "Fix first: /t: 10.0 Hz" in text
    assert "Exercise 2: no b.py yet (0 of 9 points)\n\n" in text
    assert render(report(absent)).splitlines()[1] == "Fix first: b.py: not in the submission"
    renamed = exercise("f", "2", "F", *missing("b.py", likely="c.py"))
    assert render(report(renamed, located())).splitlines()[1] == "Fix first: b.py: not in the submission"


def test_an_exercise_that_was_not_begun_is_never_the_first_to_fix() -> None:
    """A folder with the files of one exercise, all of it right, has nothing to fix first."""
    absent = exercise("f", "2", "F", *missing("b.py"))
    right = exercise("g", "1", "G", criterion("r", "R", 5, Outcome.MET, reason="fine"))
    assert "Fix first" not in render(report(right, absent))
    partner = exercise("h", "3", "H", *missing("c.py"), criterion("r", "R", 5, Outcome.MET, reason="fine"))
    assert "Fix first: c.py: not in the submission" in render(report(absent, partner))


@pytest.mark.parametrize("values", [[], [20.5], "20.5"])
def test_what_a_check_calls_missing_is_no_missing_file(values: object) -> None:
    """The evidence of checks has names of its own: values that no log shows are missing too."""
    lost = criterion("f", "F", 5, Outcome.NOT_MET, reason="20.5 is not logged", evidence={"missing": values})
    absent = exercise("g", "2", "G", *missing("b.py"))
    text = render(report(absent, exercise("f", "1", "F", lost)))
    assert "Fix first: 20.5 is not logged" in text
    assert "Exercise 1: F (0 of 5 points)" in text
    met = exercise("f", "1", "F", replace(lost, outcome=Outcome.MET, score=lost.max_score))
    assert "Exercise 1: F (5 of 5 points)" in render(report(met))


def missing(file: str, **evidence: str) -> tuple[Verdict, Verdict]:
    known = {"missing": file, "similar": [], **evidence}
    said = f"{file}: not in the submission"
    first = criterion("f", "F", 5, Outcome.NOT_MET, reason=said, evidence=known, missing_file=file)
    reason = f"not judged: needs {file}, which is missing"
    return first, criterion("g", "G", 4, Outcome.BLOCKED, reason=reason, blocked_by="f", missing_file=file)


def test_a_fault_that_a_criterion_names_is_shown_once() -> None:
    """Its calls are shown on request."""
    known = {"process": "a.py", "file": "a.py", "line": 8, "text": "E: no"}
    faults = (ReportedFault("exception", "a.py", 8, "E: no", 0, "s", ("a.py:8 in main",)),)
    sample = report(replace(located(brief="E: no", evidence={"fault": known}), faults=faults))
    assert render(sample).count("E: no") == 1
    assert "a.py:8 in main" in render(sample, verbose=True)
    assert "fault: a.py:8 raised" in render(report(replace(located(), faults=faults)))


def test_notes_for_staff_are_shown_on_request_and_never_to_students() -> None:
    """The practice key and the sandbox of a machine say nothing about a program."""
    sample = replace(middling(), notes=("of the files", "of the machine"), staff_notes=("of the machine",))
    assert "of the machine" not in render(sample)
    assert "note: of the files" in render(sample)
    assert "note: of the machine" in render(sample, verbose=True)
    students = render(replace(sample, audience=Audience.STUDENT), verbose=True)
    assert "seed       4711" in students
    assert not [word for word in ("of the machine", "sha256", "reproduce", "isolation") if word in students]


def test_a_check_without_a_result_is_said() -> None:
    """The points stay, and nobody takes them for final ones."""
    one = exercise("e", "1", "E", criterion("c", "C", 5, Outcome.MET))
    found = report(replace(one, unchecked="the machine was too busy for a check"))
    assert not found.final
    text = " ".join(render(found).split())
    assert "This score is not final: the machine was too busy for a check. Grade again." in text
    assert "Final:" not in text
    assert "5 of 5 points" in text


def test_an_undecided_report_says_so_plainly() -> None:
    """Nobody takes a score that is not final for one that is."""
    text = " ".join(render(undecided()).split())
    assert "not final: 2 criteria are undecided through no fault of the student, 16 points are still open" in text
    assert "Final:" not in text
    one = report(exercise("e", "1", "E", criterion("c", "C", 5, Outcome.UNDECIDED)))
    assert "1 criterion is undecided through no fault of the student, 5 points" in " ".join(render(one).split())


def test_an_undecided_report_does_not_excuse_what_the_submission_may_have_caused() -> None:
    """A launch file with commands, or a failure that came back with the submission."""
    theirs = replace(criterion("c", "C", 5, Outcome.UNDECIDED), evidence={SUBMISSION_SUSPECTED: True})
    words = "perhaps because of what the submission does"
    alone = " ".join(render(report(exercise("e", "1", "E", theirs))).split())
    assert f"1 criterion is undecided, {words}; 5 points are still open" in alone
    both = exercise("e", "1", "E", theirs, criterion("d", "D", 5, Outcome.UNDECIDED))
    together = " ".join(render(report(both)).split())
    assert f"2 criteria are undecided, some of them {words}; 10 points" in together
    assert "no fault" not in alone + together


def test_a_criterion_not_met_gives_reason_hint_and_place_in_this_order() -> None:
    """What was found, what to do, where."""
    text = render(middling(), 120, verbose=True).split("Exercise 1")[1]
    reason, hint, place = (text.index(s) for s in ("10.00 Hz", "hint: the argument", "at velocity_publisher.py:17"))
    assert reason < hint < place


def test_a_place_that_the_reason_names_is_not_repeated() -> None:
    """One place, said once."""
    assert "at velocity_publisher.py:14\n" not in render(crashed(), verbose=True).split("Exercise 1")[1]


def test_a_blocked_criterion_takes_one_line() -> None:
    """One cause is told once; what hangs on it takes one line together, or one each where all is shown."""
    lines = [line for line in render(crashed(), verbose=True).splitlines() if line.startswith("  blocked")]
    assert lines[0] == "  blocked    0/10  Publishes at 20 Hz: needs publishes_twist (not met)"
    assert len(lines) == 3
    lines = [line for line in render(crashed()).splitlines() if line.startswith("  blocked")]
    assert lines == ["  blocked    0/20  3 more: judged once the criteria that they need are met"]


def test_long_call_chains_are_shortened_in_the_middle() -> None:
    """A recursion of a thousand calls shows where it began and where it broke."""
    text = render(crashed(), verbose=True)
    assert "(7 more calls)" in text
    assert "velocity_publisher.py:31 in <module>" in text
    assert "velocity_publisher.py:14 in __init__" in text


def test_many_faults_and_notes_are_counted_not_listed() -> None:
    """A flood of notes does not bury the score, and the rest can be found: -v leaves nothing out."""
    text = render(hostile())
    assert "and 2 more faults; -v shows all" in text
    assert "and 5 more notes; -v shows all" in text
    whole = render(hostile(), verbose=True)
    assert "-v shows all" not in whole
    assert [whole.count(f"note: {number} ") for number in range(25)] == [1] * 25
    assert whole.count("fault: ") == 12


def test_the_report_ends_with_the_command_that_gives_it_again() -> None:
    """Seed, versions, digests and clock stand above it; one line without them otherwise."""
    assert render(middling()).splitlines()[-1] == "graded ./ada_homework in 1.8 s, seed 4711; -v shows everything"
    lines = render(middling(), 120, verbose=True).splitlines()
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
    command = render(sample, 60, verbose=True).split("reproduce", 1)[1]
    assert command.count("\n") > 4
    done = subprocess.run(["bash", "-c", f"printf '%s\\0' {command}"], capture_output=True, text=True, check=True)
    assert done.stdout.split("\0")[:-1] == list(words)


def test_only_one_line_differs_between_two_runs() -> None:
    """The same verdicts give the same text; path and duration stand in one line."""
    again = replace(middling(), path="./elsewhere", duration_s=7.0)
    one, other = render(middling(), verbose=True), render(again, verbose=True)
    changed = [a for a, b in zip(one.splitlines(), other.splitlines(), strict=True) if a != b]
    assert changed == ["graded ./ada_homework in 1.8 s"]


def test_a_partial_report_says_so_first() -> None:
    """What is still to be graded is named before any number below is read."""
    lines = render(partial(), 120, verbose=True).splitlines()
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
    """One line each; what nobody calls or serves is told, and an action is one line although it has five services."""
    kind = "std_srvs/srv/Trigger"
    ends = (
        ServiceEnd("client", "/battery", kind, "/a"),
        ServiceEnd("client", "/lost", kind, "/a"),
        ServiceEnd("client", "/mixed", "std_srvs/srv/Empty", "/a"),
        ServiceEnd("service", "/battery", kind, "/b"),
        *(ServiceEnd("service", f"/count/_action/{part}", kind, "/b") for part in ("cancel_goal", "send_goal")),
        ServiceEnd("client", "/count/_action/send_goal", kind, "/a"),
        ServiceEnd("client", "/follow/_action/send_goal", kind, "/a"),
        ServiceEnd("service", "/mixed", kind, "/b"),
    )
    assert draw_graph(GraphSnapshot(0, ("/a", "/b", "/idle"), (), ends), width=80) == [
        "/a ┄┄/battery┄┄▶ /b",
        "/a ══/count══▶ /b",
        "/a ┄┄/lost┄┄▶ (nobody)",
        "/a ┄┄/mixed┄┄▶ (nobody)",
        "/a ══/follow══▶ (nobody)",
        "(nobody) ┄┄/mixed┄┄▶ /b",
        "/idle (no topics)",
    ]


def test_a_service_whose_ends_differ_is_drawn_as_broken() -> None:
    """Requests and responses both have to pass, so either end may be the one that asks for more."""
    kind = "std_srvs/srv/Trigger"
    ends = (
        ServiceEnd("client", "/a", kind, "/one", "best_effort"),
        ServiceEnd("service", "/a", kind, "/two"),
        ServiceEnd("client", "/b", kind, "/one"),
        ServiceEnd("service", "/b", kind, "/two", "reliable", "transient_local"),
        ServiceEnd("client", "/c", kind, "/one", "best_effort"),
        ServiceEnd("service", "/c", kind, "/two", "best_effort"),
    )
    graph = GraphSnapshot(0, ("/one", "/two"), (), ends)
    assert draw_graph(graph, width=80) == [
        "/one ┄┄/a┄┄▶ /two",
        "  incompatible QoS: best_effort client, reliable server",
        "/one ┄┄/b┄┄▶ /two",
        "  incompatible QoS: volatile client, transient_local server",
        "/one ┄┄/c┄┄▶ /two",
    ]
    assert [line.partition("-.")[2][:3] for line in draw_mermaid(graph).splitlines() if "-." in line] == [' "i', ' "i']


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


@pytest.mark.parametrize(
    ("offered", "requested", "said"),
    [
        ({"reliability": "best_effort"}, {}, "best_effort reliability offered, reliable requested"),
        ({}, {"durability": "transient_local"}, "volatile durability offered, transient_local requested"),
        ({}, {"deadline_ns": NS_PER_S}, "no deadline offered, 1 s requested"),
        ({"deadline_ns": 2 * NS_PER_S}, {"deadline_ns": NS_PER_S}, "a deadline of 2 s offered, 1 s requested"),
        ({}, {"liveliness": "manual_by_topic"}, "automatic liveliness offered, manual_by_topic requested"),
        ({"deadline_ns": NS_PER_S, "durability": "transient_local"}, {"deadline_ns": NS_PER_S}, ""),
        ({"liveliness": "manual_by_topic"}, {"reliability": "best_effort"}, ""),
    ],
)
def test_incompatible_qos_is_drawn(offered: dict[str, Any], requested: dict[str, Any], said: str) -> None:
    """No message passes, although topic and type agree."""
    ends = (
        replace(endpoint("publisher", "/t", "/a"), **offered),
        replace(endpoint("subscription", "/t", "/b"), **requested),
    )
    lines = draw_graph(GraphSnapshot(0, ("/a", "/b"), ends), width=80)
    assert lines == ["/a ──/t──▶ /b", *([f"  incompatible QoS: {said}"] if said else [])]


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
    assert "graph" not in render(report(first), verbose=True)
    assert "Live ROS graph" in render(report(velocity(), two_nodes()), verbose=True)


def test_a_place_without_a_line_is_a_file() -> None:
    """`velocity_publisher.py:0` helps nobody."""
    verdict = criterion("c", "C", 1, Outcome.NOT_MET, location=Location("a.py", 0))
    assert "at a.py\n" in render(report(exercise("e", "1", "E", verdict)))
