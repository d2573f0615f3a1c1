"""A listener and a client that log what came to them, and in which ways they do not."""

from __future__ import annotations

import pytest
from tracing import Recording

from grader.grading.judging.checks.heard import LogsResponse, LogsTexts
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_MS
from grader.runtime.model.trace import ClockKind

TEXT, SUM = "std_msgs/msg/String", "example_interfaces/srv/AddTwoInts"
TEXTS = LogsTexts("node.py", "/topic", within=200 * NS_PER_MS)
ANSWERS = LogsResponse("node.py", "/add_two_ints", "sum")


def listener(
    said: str = "I heard: {}", delay: float = 0.0, behind: int = 0, clock: ClockKind = ClockKind.VIRTUAL
) -> Recording:
    """A text each half second, of which one begins like another; what is logged may be an earlier one."""
    rec = Recording(10.0, clock).endpoint("subscription", "/topic", TEXT)
    texts = [f"Hello World: {k}" for k in (7, 71, 12, 3)]
    for k, text in enumerate(texts):
        rec.deliver(1 + 0.5 * k, "/topic", {"data": text}, TEXT)
        if k >= behind:
            rec.log(1 + 0.5 * k + delay, said.format(texts[k - behind]))
    return rec


@pytest.mark.parametrize(
    "rec",
    [
        listener(),
        listener("{}"),
        listener("got '{}'!"),
        listener(delay=0.15),
        listener(clock=ClockKind.WALL, delay=0.22),
    ],
)
def test_any_words_may_stand_around_a_text(rec: Recording) -> None:
    """At once, or soon after."""
    finding = TEXTS.judge(rec.trace())
    assert (finding.credit, finding.reason) == (
        1,
        "node.py: all 4 messages of /topic are logged, such as 'Hello World: 7'",
    )


@pytest.mark.parametrize(
    ("rec", "said"),
    [
        (listener("I heard something"), "expected 'Hello World: 7' within 0.2 s, found I heard something"),
        (listener(delay=0.3), "4 of 4 messages of /topic not logged"),
        (listener(behind=1), "4 of 4 messages"),
        (listener("{}1"), "4 of 4 messages of /topic not logged"),  # 7 is not 71
        (Recording().endpoint("subscription", "/other", TEXT).deliver(1, "/topic", {"data": "a"}, TEXT), "/other"),
    ],
)
def test_a_text_that_is_not_logged_is_named(rec: Recording, said: str) -> None:
    """With what was logged instead."""
    finding = TEXTS.judge(rec.trace())
    assert finding.credit == 0
    assert said in finding.reason


def test_a_printed_text_is_half_of_it() -> None:
    """As for numbers."""
    rec = Recording().endpoint("subscription", "/topic", TEXT)
    for k in range(3):
        rec.deliver(1.0 + k, "/topic", {"data": f"word {k}"}, TEXT).line(1.0 + k, f"word {k}")
    assert TEXTS.judge(rec.trace()).credit == pytest.approx(0.5)


def test_nothing_to_log_is_the_graders_fault_unless_the_node_crashed() -> None:
    """A recording without messages decides nothing."""
    rec = Recording().endpoint("subscription", "/topic", TEXT)
    with pytest.raises(HarnessError, match="/topic: no message was sent"):
        TEXTS.judge(rec.trace())
    assert TEXTS.judge(rec.crashed(0.5).trace()).credit == 0


def client(text: str, value: object = 731, ends: bool = True) -> Recording:
    """Asks once at 1 s, is told a value at 1.1 s, logs a text and ends."""
    rec = Recording(5.0).service("client", "/add_two_ints", SUM)
    rec.request(1.0, "/add_two_ints", 1, "student", {"a": 17, "b": 25}, SUM)
    rec.response(1.1, "/add_two_ints", 1, {"sum": value}, "grader", SUM)
    if text:
        rec.log(1.1, text)
    return rec.exited(1.2) if ends else rec


@pytest.mark.parametrize(
    ("text", "value", "credit"),
    [
        ("17 + 25 = 731", 731, 1),
        ("731", 731, 1),
        ("17 + 25 = 42", 731, 0),
        ("", 731, 0),
        (" ".join(map(str, range(700, 760))), 731, 0),  # every number that it might be
        ("Result: [0, 1, 1, 2]", [0, 1, 1, 2], 1),
        ("array('i', [0, 1, 1, 2])", (0, 1, 1, 2), 1),
        ("0, 1, 2, 1", [0, 1, 1, 2], 0),
        ("the state is ready", "ready", 1),
        ("already", "ready", 0),
    ],
)
def test_a_response_is_logged_as_the_server_gave_it(text: str, value: object, credit: int) -> None:
    """Numbers, lists and texts; a client that computes the answer itself logs another one."""
    for ends in (True, False):
        assert ANSWERS.judge(client(text, value, ends).trace()).credit == credit


def test_a_client_that_never_asked_is_told_so() -> None:
    """There is no response to be logged."""
    finding = ANSWERS.judge(Recording(5.0).trace())
    assert finding.credit == 0
    assert finding.reason.startswith("/add_two_ints: not in the ROS graph")
