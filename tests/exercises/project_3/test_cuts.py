"""What a client cuts out of a response: it is worked out within limits, whatever the program says."""

from __future__ import annotations

import pytest

from grader.grading.judging.diagnosis.rules import Rule
from grader.grading.rubrics.builtin import builtin_exercises
from grader.testing import TraceBuilder, builtin_check, explain

SERVICE, TYPE, FILE = "/battery/get_status", "std_srvs/srv/Trigger", "battery_service_client.py"
(BATTERY,) = [exercise for exercise in builtin_exercises() if exercise.id == "battery_service"]
(RULE,) = [rule for rule in BATTERY.hints if isinstance(rule, Rule) and rule.id == "no_number_cut"]


def told(code: str) -> str:
    """Return the hint for a client that reads the number with this code, and warns whatever it is told."""
    trace = TraceBuilder(process=FILE)
    for number in range(5):
        answer = {"success": True, "message": f"Battery: {30 + number}.5% remaining"}
        trace.call(number, SERVICE, TYPE, {}, answer, by_student=True)
        trace.log(number + 0.1, "no number", "WARN")
    check = builtin_check("reacts_to_responses", process=FILE, service=SERVICE, threshold=20.0, side="above")
    clue = explain(RULE, check, trace.trace(), {FILE: code})
    return "" if clue is None else clue.hint


@pytest.mark.parametrize(
    ("code", "gets"),
    [
        ("float(r.message.split(':')[1])", "30.5% remaining"),
        ("text = r.message.split(' ')\nfloat(text[1])", "30.5%"),
        ("float(r.message.split(':')[1].split('%')[0])", ""),
        ("float(r.message[0])", ""),
        ("def number(text):\n    text = text.strip()\n    return float(text)\n", ""),
        ("a = b.strip()\nb = a.strip()\nfloat(a)", ""),
        ("float(r.message" + ".replace('e', 'eeeeeeeeee')" * 15 + ")", ""),
        ("float(r.message" + ".strip()" * 150 + ")", ""),
    ],
    ids=["the rest", "kept", "a number", "no text", "named by itself", "in a circle", "ever longer", "many cuts"],
)
def test_what_is_cut_out_is_named_if_it_is_plain_to_see(code: str, gets: str) -> None:
    """And nothing is said where that is not so, however long it would take to find out."""
    hint = told(code)
    assert (f"gets '{gets}'" in hint) if gets else hint == ""
