"""Hints about clients of actions: programs that only seem to make a mistake are not blamed for it.

The mistakes themselves are in the tables of slips of the example of such a client.
"""

from __future__ import annotations

from typing import Any

import pytest
from goal_recordings import ACTION, Client, client

from grader.grading.judging.diagnosis import RULES
from grader.testing import builtin_check, explain

START = """
class Counter(Node):
    def __init__(self):
        super().__init__("counter")
        self.client = ActionClient(self, Fibonacci, "count")
"""
SENDS = """
        self.client.wait_for_server()
        self.send()

    def send(self):
        goal = Fibonacci.Goal()
        goal.order = 5
        self.client.send_goal_async(goal).add_done_callback(self.answered)
"""
ANSWERED = """
    def answered(self, future):
        handle = future.result()
        if not handle.accepted:
            return
        handle.get_result_async().add_done_callback(self.ended)
"""
RIGHT = START + SENDS + ANSWERED


def rejected() -> Client:
    """Return a recording of a rejected goal and a later one."""
    return client().goal(1, 1, 5, accepted=False).goal(2, 2, 6)


def without_goals(service: str, type_: str = "test_msgs/action/Fibonacci") -> Client:
    """Return a recording of a client that sends nothing."""
    recording = client()
    recording.service("client", service, f"{type_}_SendGoal")
    return recording


def clue(rule: str, check: str, recording: Client, text: str, **parameters: Any) -> str:
    """Return the line and the hint of one rule; empty if it is silent."""
    found = explain(
        next(one for one in RULES if one.id == rule),
        builtin_check(check, action=ACTION, **parameters),
        recording.trace(),
        {"counter.py": text},
    )
    return "" if found is None or found.location is None else f"{found.location.line}: {found.hint}"


#: A rule, its check with parameters, a recording, a wrong program, the beginning of its hint, and a right program.
CASES: list[tuple[str, str, dict[str, Any], Client, str, str, str]] = [
    (
        "other_action",
        "sends_goals",
        {},
        without_goals("/counts/_action/send_goal"),
        RIGHT.replace('"count"', '"counts"'),
        '5: ActionClient(self, Fibonacci, "counts") asks for counts: the task asks for /count',
        RIGHT,
    ),
    (
        "other_action_type",
        "sends_goals",
        {},
        without_goals(f"{ACTION}/_action/send_goal", "test_msgs/action/NestedMessage"),
        RIGHT.replace('Fibonacci, "count"', 'NestedMessage, "count"'),
        '5: ActionClient(self, NestedMessage, "count") has another type than the server of /count',
        "",
    ),
    (
        "no_goal_sent",
        "sends_goals",
        {},
        without_goals(f"{ACTION}/_action/send_goal"),
        RIGHT.replace("        self.client.wait_for_server()\n", ""),
        "12: the server may not be there yet, and the goal is lost then: call self.client.wait_for_server()",
        RIGHT,
    ),
    (
        "no_goal_sent",
        "sends_goals",
        {},
        without_goals(f"{ACTION}/_action/send_goal"),
        RIGHT.replace("        self.send()\n", ""),
        "9: nothing calls send, which sends the goal: call self.send()",
        RIGHT,
    ),
    (
        "goes_on_when_rejected",
        "after_goal",
        {"end": "rejected", "then": "same"},
        rejected(),
        RIGHT.replace("            return\n", "            self.send()\n"),
        "17: after 'if not handle.accepted' a rejected goal goes on to handle.get_result_async()",
        RIGHT,
    ),
    (
        "goes_on_when_rejected",
        "after_goal",
        {"end": "rejected", "then": "same"},
        rejected(),
        RIGHT.replace("            return\n", "            self.send()\n"),
        "17: after",
        RIGHT.replace(
            "            return\n        handle", "            self.send()\n        else:\n            handle"
        ),
    ),
    (
        "result_never_read",
        "sends_goals",
        {"at_least": 2},
        client().goal(1, 1, 5),
        RIGHT.replace(".add_done_callback(self.ended)", ""),
        "19: nothing learns the result: write handle.get_result_async().add_done_callback(...)",
        RIGHT.replace("handle.get_result", "result = handle.get_result").replace(".add_done_callback(self.ended)", ""),
    ),
    (
        "timer_never_ends",
        "sends_goals",
        {"at_most": 1},
        rejected(),
        RIGHT.replace("            return\n", "            self.again = self.create_timer(1.0, self.send)\n"),
        "18: create_timer(1.0, self.send) goes on and sends a goal each time",
        RIGHT.replace("            return\n", "            self.again = self.create_timer(1.0, self.send)\n").replace(
            "        goal = ", "        self.again.cancel()\n        goal = "
        ),
    ),
    (
        "goal_timer_too_slow",
        "after_goal",
        {"end": "rejected"},
        client().goal(1, 1, 5, accepted=False),
        RIGHT.replace("            return\n", "            self.create_timer(1000, self.send)\n"),
        "18: create_timer(1000, self.send) waits 1000 s, and the period is in seconds",
        RIGHT.replace("            return\n", "            self.create_timer(1.5, self.send)\n"),
    ),
    (
        "goal_field",
        "sends_goals",
        {"every": {"order": 6}},
        client().goal(1, 1, 5),
        RIGHT,
        "12: goal.order = 5: the task asks for 6 as order",
        RIGHT.replace("goal.order = 5", "goal.order = self.wanted()"),
    ),
    (
        "goal_field",
        "sends_goals",
        {"every": {"order": 6}},
        client().goal(1, 1, 0),
        RIGHT.replace("        goal.order = 5\n", ""),
        "11: order is never set: write goal.order = 6",
        RIGHT.replace("        goal.order = 5\n", '        setattr(goal, "order", 6)\n'),
    ),
    (
        "waits_for_a_goal",
        "sends_goals",
        {"at_least": 2},
        client().goal(1, 1, 5),
        RIGHT.replace("handle.get_result_async().add_done_callback(self.ended)", "self.client.send_goal(self.goal)"),
        "19: self.client.send_goal(self.goal) waits for the result, and the node does not spin meanwhile",
        RIGHT.replace("handle.get_result_async().add_done_callback(self.ended)", "self.client.send_goal(self.goal)")
        + "\nThread(target=rclpy.spin, args=(Counter(),)).start()\n",
    ),
]


@pytest.mark.parametrize(
    ("rule", "check", "parameters", "recording", "wrong", "told", "right"),
    CASES,
    ids=[f"{case[0]}-{number}" for number, case in enumerate(CASES)],
)
def test_a_mistake_is_told_apart_from_what_resembles_it(
    rule: str, check: str, parameters: dict[str, Any], recording: Client, wrong: str, told: str, right: str
) -> None:
    """The first program makes the mistake; another one, of which the same was recorded, does not."""
    assert clue(rule, check, recording, wrong, **parameters).startswith(told)
    assert clue(rule, check, recording, right, **parameters) == ""


def test_a_condition_to_cancel_is_tried_with_the_number_of_the_task() -> None:
    """One that holds for it is not blamed."""
    told = {}
    for condition in ("number > MOST", "number >= MOST", "MOST <= number", "number > 2", "number == 4"):
        heard = f"    def heard(self, number):\n        if {condition}:\n            self.handle.cancel_goal_async()\n"
        recording = client().goal(1, 1, 5).feedback(3, 1, 3)
        check = {"when": {"number": 3}}
        recording.deliver(4, f"{ACTION}/_action/feedback", {"goal_id": {"uuid": [1] * 16}, "feedback": {"number": 3}})
        text = f"MOST = 3\n{RIGHT}\n{heard}"
        told[condition] = clue("cancels_at_another_number", "cancels_goal", recording, text, **check)
    assert [condition for condition, hint in told.items() if hint] == ["number > MOST", "number == 4"]
    assert told["number > MOST"].endswith("is not true yet for number 3: write >= in place of >")


def test_of_several_clients_the_one_with_a_similar_name_is_told() -> None:
    """The others may be meant for other actions; with no similar name, none is told."""
    other = '        self.other = ActionClient(self, Dock, "dock")\n        self.client = '
    recording = without_goals("/counts/_action/send_goal")
    for wrong, told in (("counts", "6: ActionClient(self, Fibonacci, "), ("fibonacci", "")):
        text = RIGHT.replace("        self.client = ", other).replace('"count"', f'"{wrong}"')
        assert clue("other_action", "sends_goals", recording, text)[: len(told) or None] == told


SLEEPS = RIGHT.replace(
    "            return\n", "            time.sleep(5.0)\n            self.send()\n            return\n"
)
#: A rule, its check with parameters, a recording, and a program that fails for another reason.
SIBLINGS: dict[str, tuple[str, str, dict[str, Any], Client, str]] = {
    "a goal waits for a condition": (
        "no_goal_sent",
        "sends_goals",
        {},
        without_goals(f"{ACTION}/_action/send_goal"),
        RIGHT.replace(
            "        self.client.wait_for_server()\n        self.send()\n",
            "        self.create_timer(1.0, self.send)\n",
        ).replace("        goal = ", "        if not self.wanted:\n            return\n        goal = "),
    ),
    "a timer sends the first goal only": (
        "goal_timer_too_slow",
        "after_goal",
        {"end": "rejected"},
        client().goal(1, 1, 5, accepted=False),
        RIGHT.replace("        self.send()\n", "        self.first = self.create_timer(5.0, self.send)\n").replace(
            "        goal = ", "        self.first.cancel()\n        goal = "
        ),
    ),
    "another message has such a field": (
        "goal_field",
        "sends_goals",
        {"every": {"order": 6}},
        client().goal(1, 1, 5),
        RIGHT.replace("goal.order = 5", "goal.order, self.last = self.wanted()\n        tune.score.order = 2"),
    ),
    "other callbacks run beside a sleep": (
        "sleeps_before_a_goal",
        "after_goal",
        {"end": "rejected"},
        client().goal(1, 1, 5, accepted=False),
        f"import time\n{SLEEPS}\nexecutor = MultiThreadedExecutor()\n",
    ),
}


@pytest.mark.parametrize("name", SIBLINGS)
def test_what_only_resembles_a_mistake_is_not_blamed(name: str) -> None:
    """The program is wrong elsewhere, and the hint would lead away from it."""
    rule, check, parameters, recording, text = SIBLINGS[name]
    assert clue(rule, check, recording, text, **parameters) == ""


def test_a_sleep_that_holds_up_the_next_goal_is_told() -> None:
    """Where nothing runs beside it."""
    recording = client().goal(1, 1, 5, accepted=False)
    told = clue("sleeps_before_a_goal", "after_goal", recording, f"import time\n{SLEEPS}", end="rejected")
    assert "time.sleep(5.0) holds up every callback for 5 s" in told


#: What a callback does that cancels right, or at another number, which the second word tells.
CANCELS = {
    "if number < 3:\n            return\n        self.handle.cancel_goal_async()": "",
    "if not number < 3:\n            self.handle.cancel_goal_async()": "",
    "if number > 4:\n            self.tell()\n        if number >= 3:\n            self.handle.cancel_goal_async()": "",
    "if number == 0:\n            self.tell()\n        elif number >= 3:\n            self.give_up()": "",
    "if number > 3 and self.handle:\n            self.give_up()": "number > 3",
    "late = number > 3\n        if late:\n            self.give_up()": "number > 3",
}


@pytest.mark.parametrize("does", CANCELS)
def test_only_a_condition_to_cancel_is_tried(does: str) -> None:
    """Not one that leads to something else, or that returns."""
    heard = f"    def heard(self, number):\n        {does}\n"
    gives_up = "\n    def give_up(self):\n        self.handle.cancel_goal_async()\n"
    recording = client().goal(1, 1, 5)
    recording.deliver(4, f"{ACTION}/_action/feedback", {"goal_id": {"uuid": [1] * 16}, "feedback": {"number": 3}})
    text = f"{RIGHT}\n{heard}{gives_up}"
    found = clue("cancels_at_another_number", "cancels_goal", recording, text, when={"number": 3})
    assert (CANCELS[does] in found) if CANCELS[does] else found == ""
