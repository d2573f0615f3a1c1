"""Parameters: declared, with their defaults, and of effect once they are set."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import pytest
from tracing import Recording

from grader.grading.judging.checks.programs import ParameterDeclared, ParameterTakesEffect
from grader.grading.judging.findings import FAULT_KEY
from grader.runtime.model.errors import HarnessError

GET, SET = "rcl_interfaces/srv/GetParameters", "rcl_interfaces/srv/SetParameters"
DECLARED = ParameterDeclared("speed", value=0.5)
FIELD = ParameterTakesEffect("speed", "/cmd_vel", field="linear.x", tolerance=1e-6)
RATE = ParameterTakesEffect("rate", "/cmd_vel", "rate")


def value_of(value: Any) -> dict[str, Any]:
    kinds = ((bool, "bool_value", 1), (int, "integer_value", 2), (float, "double_value", 3), (str, "string_value", 4))
    for kind, name, number in kinds:
        if isinstance(value, kind):
            return {"type": number, "bool_value": False, "integer_value": 0, "double_value": 0.0, name: value}
    if isinstance(value, list):
        return {"type": 8, "double_array_value": value}
    return {"type": 0}


def asked(value: Any, node: str = "/driver", answered: bool = True, absent: bool = False) -> Recording:
    rec = Recording(10.0).endpoint("publisher", "/cmd_vel", node=node)
    rec.request(1.0, f"{node}/get_parameters", 1, value={"names": ["speed"]}, type_=GET)
    if answered:
        values = [] if absent else [value_of(value)]
        rec.response(1.0, f"{node}/get_parameters", 1, {"values": values}, type_=GET)
    return rec


@pytest.mark.parametrize(
    ("check", "rec", "credit", "said"),
    [
        (DECLARED, asked(0.5), 1, "/driver: the parameter speed is 0.5 [double]"),
        (ParameterDeclared("speed"), asked("fast"), 1, "is 'fast' [string]"),
        (ParameterDeclared("speed", value=1), asked(1.0), 1, ""),
        (ParameterDeclared("speed", value=1, type="integer"), asked(1.0), 0, "expected type integer"),
        (ParameterDeclared("speed", value=1, type="integer"), asked(1), 1, ""),
        (ParameterDeclared("speed", value=True), asked(True), 1, "is true [bool]"),
        (ParameterDeclared("speed", value=True), asked(1), 0, "is 1 [integer], expected true"),
        (ParameterDeclared("speed", value="a"), asked("b"), 0, "expected 'a'"),
        (DECLARED, asked(0.6), 0, "is 0.6 [double], expected 0.5"),
        (DECLARED, asked(float("nan")), 0, "is nan"),
        (DECLARED, asked(None), 0, "has no parameter speed"),
        (DECLARED, asked(0.5, absent=True), 0, "has no parameter speed"),
        (ParameterDeclared("speed", node="/other"), asked(0.5), 0, "/other: not in the ROS graph"),
        (ParameterDeclared("speed", node="/driver", value=0.5), asked(0.5), 1, ""),
        (DECLARED, asked(0.5, answered=False), 0, "no response to the request for the parameter speed"),
        (ParameterDeclared("speed"), asked([1.0, 2.0]), 1, "is [1, 2] [double_array]"),
    ],
)
def test_a_parameter_with_its_default(check: ParameterDeclared, rec: Recording, credit: int, said: str) -> None:
    """Whole and fractional numbers are alike unless the type is asked for."""
    finding = check.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_parameter_that_nobody_asked_for_is_ours() -> None:
    """Unless the node had ended."""
    with pytest.raises(HarnessError):
        DECLARED.judge(Recording(10.0).endpoint("publisher", "/cmd_vel").trace())
    assert FAULT_KEY in DECLARED.judge(Recording(10.0).crashed(0.5).trace()).evidence
    assert "declare_parameter('speed'" in DECLARED.judge(asked(None).trace()).hint


def setting(
    publish: Callable[[float, Any], Any],
    values: tuple[Any, ...] = (0.8, 0.25),
    name: str = "speed",
    taken: bool = True,
    rate: Callable[[Any], float] = lambda v: 10.0,
) -> Recording:
    """Values set at 2 s, 6 s and so on; `publish` gives the field from the time and the newest value."""
    rec = Recording(2.0 + 4 * len(values))
    for k, value in enumerate(values, 1):
        asked_for = {"parameters": [{"name": name, "value": value_of(value)}]}
        rec.request(4.0 * k - 2, "/driver/set_parameters", k, value=asked_for, type_=SET)
        answer = {"results": [{"successful": taken, "reason": "" if taken else "undeclared"}]}
        rec.response(4.0 * k - 2, "/driver/set_parameters", k, answer, type_=SET)
    t = 0.1
    while t < rec.stop_s:
        newest = values[min(int((t - 2) // 4), len(values) - 1)] if t >= 2 else None
        rec.message(t, "/cmd_vel", {"linear": {"x": publish(t, newest)}})
        t += 1 / rate(newest)
    return rec


def follow(t: float, value: Any) -> Any:
    return 0.5 if value is None else value


@pytest.mark.parametrize(
    ("rec", "credit", "said"),
    [
        (setting(follow), 1, "follows speed (0.8, 0.25) within 1.0 s"),
        (setting(follow, ("a", "b")), 1, ""),
        (setting(follow, (True, False)), 1, ""),
        (setting(lambda t, v: 0.5), 0, "t = 2.000 s, speed = 0.8: linear.x is 0.5 at t = 3"),
        (setting(lambda t, v: 0.5 if v is None else 0.8), 0, "t = 6.000 s, speed = 0.25: linear.x is 0.8"),
        (setting(lambda t, v: 0.5 if t >= 2 and (t - 2) % 4 < 0.9 else follow(t, v)), 1, ""),
        (setting(follow, taken=False), 0, "speed = 0.8: refused: undeclared"),
        (setting(lambda t, v: "x"), 0, "linear.x is 'x'"),
    ],
)
def test_a_field_follows_a_parameter(rec: Recording, credit: int, said: str) -> None:
    """From the time allowed on, for every value set."""
    finding = FIELD.judge(rec.trace())
    assert finding.credit == credit, finding.reason
    assert said in finding.reason


def test_a_rate_follows_a_parameter() -> None:
    """In hertz, or in seconds between two messages."""
    right = setting(follow, (20.0, 5.0), "rate", rate=lambda v: v or 10.0)
    assert RATE.judge(right.trace()).credit == 1
    fixed = setting(follow, (20.0, 5.0), "rate")
    assert "10.000 Hz on /cmd_vel afterwards, expected 20 Hz" in RATE.judge(fixed.trace()).reason
    assert "get_parameter('rate')" in RATE.judge(fixed.trace()).hint
    periods = ParameterTakesEffect("rate", "/cmd_vel", "period")
    assert periods.judge(setting(follow, (0.05, 0.2), "rate", rate=lambda v: 1 / (v or 0.1)).trace()).credit == 1
    assert periods.judge(fixed.trace()).credit == 0


def test_crashes_and_silence_are_explained() -> None:
    """As everywhere."""
    crashed = setting(follow)
    crashed.items = [o for o in crashed.items if o.t_ns < 3e9]
    assert FAULT_KEY in FIELD.judge(crashed.crashed(3.0).trace()).evidence
    quiet = setting(follow)
    quiet.items = [o for o in quiet.items if type(o).__name__ != "Message"]
    assert "/cmd_vel: no publisher" in FIELD.judge(quiet.trace()).reason
    with pytest.raises(HarnessError):
        FIELD.judge(Recording(10.0).trace())
    early = setting(follow)
    early.stop_s = 6.5
    with pytest.raises(HarnessError):
        FIELD.judge(early.trace())


def test_a_text_may_hold_the_value_among_other_words() -> None:
    """As `Hello {}!` does; the value alone, or another one, is a mistake."""
    check = ParameterTakesEffect("name", "/greeting", text="Hello {}!")

    def greeter(write: str) -> Recording:
        rec = setting(lambda _t, _v: {}, ("Ada", "robot 7"), "name")
        rec.items = [o for o in rec.items if type(o).__name__ != "Message"]
        sets = [o for o in rec.items if type(o).__name__ == "Request"]
        for k in range(1, 90):
            t_s = 0.1 * k
            name = ["world", "Ada", "robot 7"][sum(o.t_ns < t_s * 1e9 for o in sets)]
            rec.message(t_s, "/greeting", {"data": write.format(name)}, "std_msgs/msg/String")
        return rec

    assert check.judge(greeter("Hello {}!").trace()).credit == 1
    assert "data is 'Hello world!'" in check.judge(greeter("Hello world!").trace()).reason
    assert "data is 'Ada'" in check.judge(greeter("{}").trace()).reason
    for text in ("Hello!", "{} {}"):
        with pytest.raises(ValueError, match="text"):
            ParameterTakesEffect("name", "/greeting", text=text)
    with pytest.raises(ValueError, match="text"):
        ParameterTakesEffect("name", "/greeting", "rate", text="{}")


def pace(*parts: tuple[float, float, float], stop_s: float = 10.0) -> Recording:
    """A period is set to 0.5 s at 1 s; messages come from one time to another with a gap."""
    rec = Recording(stop_s).endpoint("publisher", "/out", "std_msgs/msg/String", node="/driver")
    parameter = {"parameters": [{"name": "period", "value": value_of(0.5)}]}
    rec.request(1.0, "/driver/set_parameters", 1, value=parameter, type_=SET)
    rec.response(1.0, "/driver/set_parameters", 1, {"results": [{"successful": True, "reason": ""}]}, type_=SET)
    for start_s, end_s, gap_s in parts:
        for k in range(int((end_s - start_s) / gap_s)):
            rec.message(start_s + gap_s * k, "/out", {"data": ""}, "std_msgs/msg/String")
    return rec


@pytest.mark.parametrize(
    ("rec", "said"),
    [
        (pace((0, 10, 0.5)), ""),
        (pace((0, 5, 0.5)), "no message on /out after t = 4.500 s, expected 2 Hz"),
        (pace((0, 4, 0.5), (7, 10, 0.5)), "1.200 Hz on /out afterwards, expected 2 Hz"),
        (pace((0, 1, 0.5), (1, 1.5, 0.001), stop_s=1.5), "500 messages on /out within 0.500 s, expected 2 Hz"),
    ],
)
def test_a_pace_lasts_until_the_next_value(rec: Recording, said: str) -> None:
    """A node that ends does not follow, and one that fills the recording at once is no riddle."""
    finding = ParameterTakesEffect("period", "/out", "period").judge(rec.trace())
    assert finding.credit == (0 if said else 1)
    assert said in finding.reason
