"""A lifecycle node: transitions, states, and silence while it is not active."""

from __future__ import annotations

from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.actions import LifecycleStates
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.errors import HarnessError

CHANGE, GET = "lifecycle_msgs/srv/ChangeState", "lifecycle_msgs/srv/GetState"
STATES = ("unconfigured", "inactive", "active", "inactive", "finalized")
CHECK = LifecycleStates(STATES, "/chatter")
STEPS = ("configure", "activate", "deactivate", "shutdown")


def living(
    states: tuple[str, ...] = STATES,
    refused: str = "",
    silent: str = "",
    messages: tuple[float, ...] = (4.1, 4.6, 5.1, 5.6),
    by_number: bool = False,
) -> Recording:
    """Asked for its state, then for a transition, at 1 s, 3 s and so on: configured at 2 s, active from 4 s to 6 s."""
    rec = Recording(12.0).service("service", "/talker/change_state", CHANGE, "/talker")
    numbers = {"configure": 1, "activate": 3, "deactivate": 4, "shutdown": 6}
    for k, state in enumerate(states):
        rec.request(1.0 + 2 * k, "/talker/get_state", k + 1, type_=GET)
        answer = {"current_state": {"id": 1, "label": state}}
        rec.response(1.0 + 2 * k, "/talker/get_state", k + 1, answer, type_=GET)
    for k, step in enumerate(STEPS):
        asked = {"id": numbers[step], "label": ""} if by_number else {"id": 0, "label": step}
        rec.request(2.0 + 2 * k, "/talker/change_state", k + 1, value={"transition": asked}, type_=CHANGE)
        if step != silent:
            rec.response(2.0 + 2 * k, "/talker/change_state", k + 1, {"success": step != refused}, type_=CHANGE)
    for t in messages:
        rec.message(t, "/chatter", {"data": "hello"}, "std_msgs/msg/String")
    return rec


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (living(), 1, "4 transitions made; states: unconfigured, inactive, active, inactive, finalized"),
        (living(by_number=True), 1, "4 transitions made"),
        (living(messages=(4.0, 5.0, 6.0)), 1, ""),
        (living(messages=(3.9, 5.0)), 0, "t = 3.900 s, /chatter: a message while the node is not active"),
        (living(messages=(5.0, 6.1)), 0, "t = 6.100 s"),
        (living(messages=()), 0, "/chatter: no publisher"),
        (living(refused="activate"), 0, "t = 4.000 s: the transition activate failed"),
        (living(silent="configure"), 0, "no response to the transition configure"),
        (living(("unconfigured", "unconfigured", *STATES[2:])), 0, "the state is unconfigured, expected inactive"),
    ],
)
def test_transitions_states_and_silence(rec: Recording, credit: int, said: str) -> None:
    """Messages at the instant of a transition are accepted."""
    finding = CHECK.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_states_and_topic_may_be_left_out() -> None:
    """Then only the transitions count."""
    assert LifecycleStates().judge(living(messages=(1.0,)).trace()).credit == 1
    assert LifecycleStates(node="/talker").judge(living().trace()).credit == 1
    assert LifecycleStates().judge(living(refused="shutdown").trace()).credit == 0


def test_a_node_that_is_mute_when_active_is_named() -> None:
    """A message in another active span does not help."""
    rec = living(messages=(4.5,))
    more: dict[str, Any] = {"transition": {"id": 3, "label": "activate"}}
    rec.items = [o for o in rec.items if o.t_ns < 8_000_000_000]
    rec.request(9.0, "/talker/change_state", 9, value=more, type_=CHANGE)
    rec.response(9.0, "/talker/change_state", 9, {"success": True}, type_=CHANGE)
    finding = LifecycleStates(topic="/chatter").judge(rec.trace())
    assert "no message while active from t = 9.000 s to t = 12.000 s" in finding.reason


def test_a_node_without_a_lifecycle_and_a_crash_are_explained() -> None:
    """A recording that asks too little is ours."""
    assert (
        "the program has no lifecycle node" in CHECK.judge(Recording().endpoint("publisher", "/chatter").trace()).reason
    )
    assert FAULT_KEY in CHECK.judge(Recording().crashed(0.0).trace()).evidence
    gone = CHECK.judge(living(STATES[:2]).crashed(4.2).trace())  # what is gone cannot be asked
    assert FAULT_KEY in gone.evidence
    with pytest.raises(HarnessError, match="requested 2 times, expected 5"):
        CHECK.judge(living(STATES[:2]).trace())
    assert FAULT_KEY in CHECK.judge(living(silent="activate").crashed(4.0).trace()).evidence
    assert LifecycleStates(node="/other").judge(living().trace()).blocked_by == "node_name"
    with pytest.raises(HarnessError):
        CHECK.judge(Recording().service("service", "/talker/change_state", CHANGE).trace())
    with pytest.raises(HarnessError):
        CHECK.judge(living(STATES[:3]).trace())
