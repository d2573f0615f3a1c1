"""The result of recording submissions several times, as text and as JSON."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from grader.grading.model.verification import (
    Cause,
    ConditionState,
    Difference,
    DifferenceKind,
    LeftOutScenario,
    Place,
    RecordingFact,
    Tried,
    Verification,
)
from grader.grading.reporting.verified import advice_on, both_sides, render_verification, verification_to_json
from grader.runtime.model.trace import Endpoint, GraphSnapshot, LogRecord, Message

PLACE = Place("ada", "velocity_publisher", "alone")
FIRST = LogRecord(3_200_000_000, "a.py", "INFO", "talker", "used 3", "a.py", 16)
TIMED = Difference(DifferenceKind.TIME, 41, FIRST, replace(FIRST, t_ns=3_250_000_100), "a.py", "a.py", 16)
AGAIN = Tried("again", "again, with nothing changed", ConditionState.SAME, compared=2)
LOAD = Tried("load", "beside 4 busy loops", ConditionState.DIFFERENT, compared=2, different=((PLACE, TIMED),))
USER = Tried("user", "as another user", ConditionState.NOT_TRIED, "only root can become another user")
SAME = Verification(("ada",), (7,), "bubblewrap", 2, 1_234, (AGAIN, USER))
DIFFERENT = replace(SAME, tried=(AGAIN, LOAD, USER))


def rendered(verification: Verification, width: int = 100) -> str:
    return render_verification(verification, width=width, colour=False)


def test_a_line_for_each_condition() -> None:
    """What is the same, and what this machine cannot do."""
    assert rendered(SAME) == (
        "ada: 2 scenarios, 1,234 events, in the sandbox bubblewrap, seed 7\n"
        "\n"
        "  same       again, with nothing changed\n"
        "  not tried  as another user: only root can become another user\n"
        "\n"
        "the same under 1 condition\n"
    )


def test_the_first_difference_is_shown_with_both_events() -> None:
    """Under the condition it came from, with its kind, its place, and one thing to do."""
    assert rendered(DIFFERENT) == (
        "ada: 2 scenarios, 1,234 events, in the sandbox bubblewrap, seed 7\n"
        "\n"
        "  same       again, with nothing changed\n"
        "  DIFFERENT  beside 4 busy loops: 1 of 2 scenarios\n"
        "  not tried  as another user: only root can become another user\n"
        "\n"
        "First difference, beside 4 busy loops\n"
        "  kind   time: the same event at another moment\n"
        "  where  ada, velocity_publisher, alone, event 41, a.py:16\n"
        "  first  t = 3.200 s  INFO [talker] used 3\n"
        "  other  t = 3.2500001 s  INFO [talker] used 3\n"
        "  do     report it with the output of --json: nothing differs without this condition, and it must\n"
        "         not matter\n"
        "\n"
        "different: under 1 of 2 conditions\n"
    )


def test_what_the_wall_clock_decides_is_named() -> None:
    """Then nothing is verified."""
    why = "the node starts other processes"
    nothing = replace(AGAIN, state=ConditionState.NOT_TRIED, why="there is nothing to compare", compared=0)
    text = rendered(replace(SAME, events=0, tried=(nothing,), left_out=(LeftOutScenario(PLACE, why),)))
    assert "Not comparable event by event, because the wall clock decides:\n" in text
    assert f"  ada, velocity_publisher, alone: {why}\n" in text
    assert text.endswith("\nnot verified: see above what could not be compared\n")


def test_long_lists_are_cut() -> None:
    """Of a class nobody reads a hundred differences."""
    many = tuple((replace(PLACE, scenario=f"s{n}"), TIMED) for n in range(20))
    text = rendered(replace(SAME, tried=(replace(LOAD, different=many),), submissions=("a",) * 20, seeds=(1,) * 20))
    assert "and 11 more differences" in text
    assert "and 12 more: " in text
    assert text.count("velocity_publisher") == 9


@pytest.mark.parametrize(
    ("difference", "beginning"),
    [
        (replace(TIMED, kind=DifferenceKind.GRADER), "report it with the output of --json: no program caused it"),
        (replace(TIMED, kind=DifferenceKind.CLOCK), "the work of the programs is at the limit of virtual time"),
        (replace(TIMED, cause=Cause.ADDRESS), "use a name or number of your own"),
        (replace(TIMED, cause=Cause.PROCESSOR_TIME), "leave out the processor time"),
        (replace(TIMED, cause=Cause.KERNEL), "use time.time() or the clock of the node"),
    ],
)
def test_one_thing_to_do(difference: Difference, beginning: str) -> None:
    """By the kind of the difference, and by what the text of the program suggests."""
    assert advice_on(DIFFERENT, difference).startswith(beginning)


def test_a_program_that_differs_by_itself_is_not_reported() -> None:
    """Where nothing was changed, or that was not tried, it may be the program."""
    for again in ((replace(AGAIN, state=ConditionState.DIFFERENT),), ()):
        verification = replace(DIFFERENT, tried=(*again, LOAD))
        assert advice_on(verification, TIMED).startswith("find out where what a.py:16 shows comes from")


def test_of_long_events_what_surrounds_the_difference_is_shown() -> None:
    """A long text that differs at its end alone."""
    texts = [f"{'x' * 500}{end}{'y' * 500}" for end in "ab"]
    one, two = both_sides(replace(TIMED, first=replace(FIRST, text=texts[0]), other=replace(FIRST, text=texts[1])))
    assert one.startswith("...")
    assert len(one) < 200
    assert (one.index("a"), two.index("b")) == (43, 43)


def test_hostile_texts_are_escaped() -> None:
    """Names and texts come from students."""
    hostile = "\x1b[2J\n::error::x"
    value = {"\x1b[2J": hostile}
    for event in (
        replace(FIRST, text=hostile, logger=hostile),
        Message(0, "/x", hostile, value),
        GraphSnapshot(0, (hostile,), (Endpoint("publisher", hostile, "t", hostile, 0, "reliable", "volatile"),)),
        RecordingFact("notes", hostile),
        None,
    ):
        place = Place(hostile, "velocity_publisher", "alone")
        found = Difference(DifferenceKind.CONTENT, 1, event, None, hostile, hostile, 1)
        text = rendered(replace(SAME, submissions=(hostile,), tried=(replace(LOAD, different=((place, found),)),)))
        assert "\x1b" not in text
        assert not any(line.startswith("::") for line in text.splitlines())


def test_json_has_both_events_whole() -> None:
    """With the result as a word."""
    message = Message(1, "/x", "std_msgs/msg/Float32", {"data": float("nan")}, b"\x00\x01")
    found = Difference(DifferenceKind.CONTENT, 1, message, None, cause=Cause.ADDRESS)
    data = json.loads(verification_to_json(replace(SAME, tried=(replace(LOAD, different=((PLACE, found),)), USER))))
    assert data["schema"] == "grader/verification/v1"
    assert (data["result"], data["scenarios"], data["events"]) == ("different", 2, 1_234)
    assert data["submissions"] == [{"path": "ada", "seed": 7}]
    load, user = data["conditions"]
    assert (user["state"], user["why"]) == ("not_tried", "only root can become another user")
    (difference,) = load["differences"]
    assert (difference["submission"], difference["kind"], difference["cause"]) == ("ada", "content", "address")
    assert difference["other"] is None
    assert (difference["first"]["is"], difference["first"]["cdr"]) == ("message", "0001")


@pytest.mark.parametrize(
    ("verification", "result"),
    [
        (SAME, "equal"),
        (DIFFERENT, "different"),
        (replace(SAME, tried=(USER,)), "not_verified"),
        (replace(SAME, tried=(AGAIN, replace(USER, state=ConditionState.FAILED))), "not_verified"),
        (replace(SAME, problems=("it failed",)), "not_verified"),
        (replace(DIFFERENT, problems=("it failed",)), "different"),
    ],
)
def test_results(verification: Verification, result: str) -> None:
    """A condition that was not tried takes nothing away, one that failed does."""
    assert json.loads(verification_to_json(verification))["result"] == result
