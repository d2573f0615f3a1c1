"""The client of project 3: whatever its words, it goes on, warns, and knows when it knows nothing."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from fractions import Fraction

import pytest
from nodes import (
    ANSWERS,
    BATTERY,
    CLIENT,
    FAILED,
    UNREADABLE,
    Answer,
    Said,
    asking,
    battery,
    chapter,
    deciding,
    level_of,
)
from tracing import TRIGGER, Recording

from grader.grading.judging.findings import FAULT_KEY
from grader.grading.model.exercise import Check
from grader.grading.rubrics.exercise_checks import known_checks
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.trace import ClockKind, LogRecord, Request

WAITS = known_checks()["waits_for_service"](CLIENT, BATTERY)
REACTS = known_checks()["reacts_to_responses"](CLIENT, BATTERY, 20.0)
ABOVE, BELOW = (dataclasses.replace(REACTS, side=side) for side in ("above", "at_or_below"))
STILL = known_checks()["no_go_without_answer"](CLIENT, BATTERY, 20.0)


def with_numbers(answer: Answer) -> Said:
    level = level_of(answer)
    if level is None:
        return [("WARN", "no valid answer")]
    return [("INFO", f"go ({level})") if level > 20 else ("WARN", f"battery low ({level})")]


def looks_later(answer: Answer) -> Said:
    return [(f"at_end {level}", text) for level, text in with_numbers(answer)]


def pausing(answer: Answer) -> Said:
    return [*chapter(answer), ("INFO", "sleeping for a second")]


def silent_go(answer: Answer) -> Said:
    return [s for s in chapter(answer) if "off it goes" not in s[1]]


def as_error(answer: Answer) -> Said:
    return [("ERROR" if level == "WARN" else level, text) for level, text in chapter(answer)]


def as_print(answer: Answer) -> Said:
    return [("print", text) for _, text in chapter(answer)]


RIGHT = {
    "chapter": asking(chapter),
    "no header": asking(chapter, header=""),
    "numbers in the texts": asking(with_numbers),
    "answers at once": asking(chapter, delay_s=0.0),
    "answers at once, numbers": asking(with_numbers, delay_s=0.0),
    "looks at the answer when it asks again": asking(looks_later),
    "looks later, answers at once": asking(looks_later, delay_s=0.0),
    "tells its pause": asking(pausing),
    "a low charge is an error": asking(as_error),
    "wall clock": asking(chapter, clock=ClockKind.WALL),
    "low first": asking(chapter, (battery(15.0), FAILED, battery(84.5))),
    "timer": asking(with_numbers, pause_s=0.9),
}


@pytest.mark.parametrize("rec", RIGHT.values(), ids=RIGHT)
@pytest.mark.parametrize("check", [WAITS, REACTS, ABOVE, BELOW, STILL], ids=lambda c: type(c).__name__)
def test_right_clients_meet_everything(check: Check, rec: Recording) -> None:
    """Whatever the words, and whenever the answer comes."""
    finding = check.judge(rec.trace())
    assert finding.credit == 1, finding.reason


def low_is_info(answer: Answer) -> Said:
    return [("INFO" if "low" in text else level, text) for level, text in chapter(answer)]


def says_nothing(answer: Answer) -> Said:
    return []


def always_warns(answer: Answer) -> Said:
    return [*chapter(answer), ("WARN", "battery status was asked for")]


def goes_on(kinds: Sequence[Answer]) -> Callable[[Answer], Said]:
    def write(answer: Answer) -> Said:
        return [*chapter(answer), ("INFO", "charge is fine, off it goes")] if answer in kinds else chapter(answer)

    return write


def warns_and_goes(answer: Answer) -> Said:
    level = level_of(answer)
    warned = [] if level is None or level > 20 else [("WARN", "charge is low, it stays")]
    return [*chapter(answer)[:1], *warned, *([] if level is None else [("INFO", "charge is fine, off it goes")])]


def goes_at_the_second_low(answer: Answer) -> Said:
    return [*chapter(answer), ("INFO", "charge is fine, off it goes")] if answer == battery(15.0) else chapter(answer)


def same_for_all(answer: Answer) -> Said:
    return [("INFO", "charge is asked for, off it goes")]


def looks_later_at_a_refusal(answer: Answer) -> Said:
    go = answer is not None and (answer == FAILED or (level_of(answer) or 0.0) > 20)
    return [("at_end INFO", "off it goes") if go else ("at_end WARN", "it stays")]


@pytest.mark.parametrize(
    ("write", "check", "said"),
    [
        (silent_go, ABOVE, "after 84.5 it writes nothing else than after 15, such as 'the answer: "),
        (silent_go, BELOW, "so nothing shows that it aborts"),
        (silent_go, STILL, "('the answer: Battery: 15.0% remaining' also follows 15)"),
        (
            warns_and_goes,
            ABOVE,
            "it writes nothing else than after 15, such as 'charge is fine, off it goes'; expected",
        ),
        (warns_and_goes, BELOW, "('charge is fine, off it goes' also follows 15)"),
        (goes_at_the_second_low, BELOW, "'charge is fine, off it goes' at t = "),
        (same_for_all, ABOVE, "such as 'charge is asked for, off it goes'; expected it to say that it goes on"),
        (same_for_all, STILL, "so nothing shows that it does not go on after a response without success"),
        (deciding(lambda v: f"{v}" > "20.0"), BELOW, "after 7.5 it logs no warning"),
        (looks_later_at_a_refusal, STILL, "'off it goes' after a response without success (request 4)"),
        (deciding(lambda v: v >= 20), BELOW, "after 20 it logs no warning; expected one, as after every number"),
        (deciding(lambda v: v > 10), BELOW, "after 20 it logs no warning"),
        (
            deciding(lambda v: v > 30),
            ABOVE,
            "after 20.1 it logs 'low, it stays' at level WARN; expected it to say that",
        ),
        (deciding(lambda v: v <= 20), REACTS, "after 84.5 it logs 'low, it stays' at level WARN"),
        (deciding(lambda v: False), ABOVE, "after 84.5"),
        (low_is_info, BELOW, "after 20 it logs no warning"),
        (says_nothing, ABOVE, "it writes nothing; expected"),
        (always_warns, ABOVE, "at level WARN; expected it to say that it goes on"),
        (deciding(lambda v: v > 20, 60.0), STILL, "after a response without success (request 4)"),
        (goes_on([FAILED]), STILL, "'charge is fine, off it goes' after a response without success (request 4)"),
        (goes_on([UNREADABLE]), STILL, "after a response without a number (request 5)"),
        (goes_on([None]), STILL, "after a request that got no response (request 6)"),
    ],
)
def test_wrong_decisions_are_named(write: Callable[[Answer], Said], check: Check, said: str) -> None:
    """With the moment, the text and the number."""
    header = "" if write is says_nothing else "== run {} =="
    answers = [battery(7.5) if "7.5" in said and a == battery(15.0) else a for a in ANSWERS]
    finding = check.judge(asking(write, answers, header=header).trace())
    assert finding.credit == 0
    assert said in finding.reason


def test_the_threshold_itself_is_not_above() -> None:
    """The hint names this if nothing else is wrong."""
    finding = BELOW.judge(asking(deciding(lambda v: v >= 20), (battery(84.5), battery(20.0), battery(15.0))).trace())
    assert "compare with > and not with >=" in finding.hint
    assert "warn(...)" in BELOW.judge(asking(low_is_info).trace()).hint


def test_a_client_without_a_pause_between_the_words_is_compared_leniently() -> None:
    """Where no number was low, what tells the answer or stands before the first one is no going on."""
    answers = (battery(84.5), battery(63.0), FAILED, UNREADABLE)
    for write in (chapter, with_numbers):
        for delay_s in (0.0, 0.1):
            assert STILL.judge(asking(write, answers, delay_s=delay_s).trace()).credit == 1
    assert STILL.judge(asking(goes_on([UNREADABLE]), answers).trace()).credit == 0


def test_printing_is_half() -> None:
    """Of the waiting and of the decisions; going on without an answer is wrong in print as well."""
    rec = asking(as_print, header="", waiting=(("print", "waiting"),))
    rec.items = [o for o in rec.items if getattr(o, "text", "") != "planner is up"]
    for check in (WAITS, REACTS, ABOVE, BELOW):
        finding = check.judge(rec.trace())
        assert finding.credit == Fraction(1, 2), finding.reason
        assert "self.get_logger().info" in finding.hint
    assert STILL.judge(rec.trace()).credit == 1
    warned = asking(lambda a: [("print" if level == "WARN" else level, text) for level, text in chapter(a)])
    assert BELOW.judge(warned.trace()).credit == Fraction(1, 2)
    assert ABOVE.judge(warned.trace()).credit == 1
    wrong = asking(lambda a: [("print", text) for _, text in goes_on([FAILED])(a)])
    assert STILL.judge(wrong.trace()).credit == 0


def test_a_start_that_is_printed_is_half() -> None:
    """As any other output, however many records stand beside it."""
    printed = asking(lambda a: [("print" if "off it goes" in text else level, text) for level, text in chapter(a)])
    assert ABOVE.judge(printed.trace()).credit == Fraction(1, 2)
    assert BELOW.judge(printed.trace()).credit == 1


def test_what_shows_nothing_is_blocked_by_the_start() -> None:
    """A client that never says that it goes on cannot show that it does not."""
    for write in (silent_go, warns_and_goes, same_for_all):
        assert STILL.judge(asking(write).trace()).blocked_by == "reacts_to_responses"
    for write in (silent_go, warns_and_goes):
        assert BELOW.judge(asking(write).trace()).blocked_by == "reacts_to_responses"


def test_refusals_tell_a_start_from_other_words_where_no_number_is_low() -> None:
    """What is written after a refusal too is no start; an old number is one."""
    answers = (battery(84.5), FAILED, battery(63.0), None)
    paused = asking(lambda a: [*with_numbers(a), ("INFO", "next question in a second")], answers)
    assert STILL.judge(paused.trace()).credit == 1
    old = asking(lambda a: [("INFO", "go (63.0)")] if a is None else with_numbers(a), answers)
    finding = STILL.judge(old.trace())
    assert finding.credit == 0
    assert "'go (63.0)' after a request that got no response (request 4)" in finding.reason


def named(answer: Answer) -> Said:
    level = level_of(answer)
    if level is None:
        return [("ERROR", "cannot go")]
    place = {84.5: "to the field", 63.0: "to the river"}.get(level, "anywhere")
    return [("INFO", f"off {place}")] if level > 20 else [("WARN", f"not {place}")]


def test_each_start_may_have_its_own_words() -> None:
    """And a wait that every answer is followed by is none."""
    answers = (battery(84.5), UNREADABLE, battery(63.0), battery(15.0), battery(14.0))
    rec = asking(lambda a: [*named(a), ("INFO", "the next question in a second")], answers)
    for check in (ABOVE, BELOW, STILL):
        finding = check.judge(rec.trace())
        assert finding.credit == 1, finding.reason


def cautious(answer: Answer, *, between: Said = (("WARN", "middling, off it goes"),)) -> Said:
    level = level_of(answer)
    if level is None:
        return [("ERROR", "no charge")]
    if level > 70:
        return [("INFO", "plenty, off it goes")]
    return list(between) if level > 20 else [("ERROR", "low, it stays")]


def starts_and_takes_back(answer: Answer) -> Said:
    level = level_of(answer)
    if level is None:
        return [("ERROR", "no charge")]
    return [("INFO", "it sets off"), *([] if level > 20 else [("WARN", "low, it stays")])]


@pytest.mark.parametrize(
    "write",
    [
        cautious,
        lambda a: cautious(a, between=[("WARN", "getting low"), ("INFO", "plenty, off it goes")]),
        lambda a: cautious(a, between=[("INFO", "plenty, off it goes"), ("WARN", "getting low")]),
        starts_and_takes_back,
    ],
)
@pytest.mark.parametrize("check", [REACTS, ABOVE, BELOW, STILL], ids=lambda c: type(c).__name__)
def test_a_warning_may_have_levels_and_may_take_a_start_back(check: Check, write: Callable[[Answer], Said]) -> None:
    """A client that warns just above the limit and goes on, and one that says that it starts before it warns."""
    finding = check.judge(asking(write).trace())
    assert finding.credit == 1, finding.reason


@pytest.mark.parametrize(
    "write",
    [
        lambda a: cautious(a, between=[("WARN", "middling, at home")]),  # no word of what it says when it goes on
        lambda a: cautious(a, between=[("WARN", "low, it stays")]),  # what it says at low numbers
        lambda a: cautious(battery(63.0) if a == battery(84.5) else battery(84.5) if a == battery(63.0) else a),
    ],
)
def test_a_warning_above_the_limit_without_a_start_is_wrong(write: Callable[[Answer], Said]) -> None:
    """And so is one at a number that is higher than another one without a warning."""
    assert ABOVE.judge(asking(write).trace()).credit == 0


def test_a_start_that_nothing_takes_back_is_one() -> None:
    """After a response without success, too."""

    def ignores_success(answer: Answer) -> Said:
        return [("INFO", "it sets off")] if answer == FAILED else starts_and_takes_back(answer)

    finding = STILL.judge(asking(ignores_success).trace())
    assert finding.credit == 0
    assert "'it sets off' after a response without success (request 4)" in finding.reason


def at_lines(rec: Recording, lines: dict[str, int]) -> Recording:
    """Return a recording whose logs come from the lines of the texts that they begin with."""
    for place, item in enumerate(rec.items):
        line = next((n for text, n in lines.items() if text in getattr(item, "text", "")), 0)
        if isinstance(item, LogRecord) and line:
            rec.items[place] = dataclasses.replace(item, file=CLIENT, line=line)
    return rec


@pytest.mark.parametrize(
    ("said", "line", "credit"),
    [
        ("off to the market", 30, 0),  # by the call that tells of each start
        ("off to the market", 40, 1),  # elsewhere in the file
        ("nothing off to the market", 30, 1),  # by a method that logs everything
        ("no charge, no mission", 30, 1),
    ],
)
def test_a_start_in_new_words_is_known_by_its_call(said: str, line: int, credit: int) -> None:
    """Each mission has a name, and a client that ignores the refusal names another one."""
    answers = (battery(84.5), FAILED, battery(63.0), battery(15.0))
    places = {84.5: "field", 63.0: "river"}

    def write(answer: Answer) -> Said:
        level = level_of(answer)
        if answer == FAILED or level is None:
            return [("INFO", said)]
        return [("INFO", f"off to the {places[level]}")] if level > 20 else [("WARN", "low")]

    lines = {"off to the field": 30, "off to the river": 30, said: line}
    finding = STILL.judge(at_lines(asking(write, answers), lines).trace())
    assert finding.credit == credit, finding.reason
    assert ("a text such as it writes when it goes on" in finding.reason) == (credit == 0)


#: The missions of a client that names one without a common word, and what it writes after a refusal.
MISSIONS = {84.5: "Exploring", 63.0: "Delivery run"}


@pytest.mark.parametrize(
    ("refused", "lines", "credit"),
    [
        ([("INFO", "Patrol")], {"Patrol": 30}, 0),  # ignores success
        ([("INFO", "charge 12"), ("INFO", "Patrol")], {"Patrol": 30, "charge 12": 29}, 1),  # not what it does else
        ([("INFO", "Patrol")], {"Patrol": 40}, 1),
        ([("INFO", "Patrol")], {"Patrol": 30, "hello": 30}, 1),  # a method that logs everything
        ([("INFO", "Patrol"), ("INFO", "once more")], {"Patrol": 30, "once more": 30}, 1),
        ([("INFO", "sensor failure")], {"sensor": 30}, 1),  # shows the response
        ([("WARN", "Patrol is off")], {"Patrol": 30}, 1),
        ([], {}, 1),
    ],
)
def test_a_start_without_a_common_word_is_known_by_what_the_client_does(
    refused: Said, lines: dict[str, int], credit: int
) -> None:
    """It names another mission each time, by one call and with nothing beside it; so it does after the refusal."""
    failed = (False, "sensor failure")
    answers = (battery(84.5), failed, battery(63.0), battery(15.0))

    def write(answer: Answer) -> Said:
        level = level_of(answer)
        if answer == failed or level is None:
            return refused
        return [("INFO", MISSIONS[level])] if level > 20 else [("WARN", "low")]

    rec = asking(write, answers, header="hello")
    finding = STILL.judge(at_lines(rec, {"Exploring": 30, "Delivery": 30, **lines}).trace())
    assert finding.credit == credit, finding.reason


@pytest.mark.parametrize("start", ["INFO", "WARN"])
@pytest.mark.parametrize("swapped", [False, True])
@pytest.mark.parametrize(("unknown", "credit"), [("no charge, nothing starts", 1), (None, 1), ("START", 0)])
def test_whether_a_client_starts_without_a_charge_is_a_question_of_its_own(
    start: str, swapped: bool, unknown: str | None, credit: int
) -> None:
    """A client with its branches the wrong way round, or with a wrong level, may start without a charge or not."""
    begun, aborted = (start, "mission starts"), ("WARN", "mission is off")

    def write(answer: Answer) -> Said:
        level = level_of(answer)
        if level is None:
            above = aborted if swapped else begun  # what it does above the limit, whatever that is
            return [above] if unknown == "START" else [("ERROR", unknown)] if unknown else []
        return [begun if (level > 20) is not swapped else aborted]

    finding = STILL.judge(asking(write, (battery(84.5), FAILED, battery(63.0), battery(15.0))).trace())
    assert finding.credit == credit, finding.reason


def test_a_crash_at_an_unreadable_answer_is_told_and_free() -> None:
    """The client did not go on."""
    answers = (battery(84.5), battery(15.0), UNREADABLE)
    rec = asking(lambda a: [] if a == UNREADABLE else chapter(a), answers, header="")
    crashed = STILL.judge(rec.crashed(5.55, "IndexError: list index out of range", 40).trace())
    assert crashed.credit == 1
    assert "costs nothing here" in crashed.reason
    assert "IndexError" in crashed.reason


@pytest.mark.parametrize("clock", ClockKind)
def test_what_is_written_after_a_response_does_not_belong_to_the_one_before(clock: ClockKind) -> None:
    """Also on the wall clock, whose jitter is longer than the server takes to respond."""
    rec = asking(chapter, (battery(84.5), UNREADABLE), delay_s=0.04, clock=clock, header="")
    finding = STILL.judge(rec.crashed(5.55, "ValueError: no number", 40).trace())
    assert finding.credit == 1, finding.reason


def test_an_answer_that_is_not_waited_for_is_no_going_on() -> None:
    """A complaint between a request and its good response: the result was looked at before it was there."""
    rec = asking(lambda a: [], [battery(84.5 - k) for k in range(5)], delay_s=0.1)
    for request in [o for o in rec.items if isinstance(o, Request)]:
        rec.log(request.t_ns / 1e9, "no result", "ERROR")
    finding = ABOVE.judge(rec.trace())
    assert finding.credit == 0
    assert "ERROR" in finding.reason


def test_what_was_never_asked_is_not_judged_by_guesses() -> None:
    """The client ended, crashed, hangs at a lost response, or our server never sent such an answer."""
    only_good = (battery(84.5), battery(63.0))
    ended = asking(chapter, only_good).mark(6.0, "exited", CLIENT)
    crashed = asking(chapter, only_good).crashed(6.0)
    hangs = asking(chapter, (battery(84.5), None))
    for check in (BELOW, REACTS, STILL):
        assert check.judge(ended.trace()).blocked_by == "service_calls"
        assert FAULT_KEY in check.judge(crashed.trace()).evidence
        idle = check.judge(asking(chapter, only_good).trace())
        assert (idle.blocked_by, "then made no more calls" in idle.reason) == ("service_calls", True)
        with pytest.raises(HarnessError):
            check.judge(dataclasses.replace(asking(chapter, only_good).trace(), stop_ns=7_000_000_000))
    assert BELOW.judge(hangs.trace()).blocked_by == "service_calls"
    assert ABOVE.judge(ended.trace()).credit == 1


def test_no_client_is_explained() -> None:
    """By a crash, by another name, by nothing."""
    for check in (REACTS, STILL):
        assert FAULT_KEY in check.judge(Recording(9, process=CLIENT).crashed(0.0, process=CLIENT).trace()).evidence
        other = check.judge(Recording(9, process=CLIENT).service("client", "/get_status", TRIGGER).trace())
        assert "calls /get_status" in other.reason
        assert check.judge(Recording(9).trace()).credit == 0
