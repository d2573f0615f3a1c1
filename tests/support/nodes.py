"""Recordings of the nodes of the exercises, right and wrong, as the tests of checks share them."""

from __future__ import annotations

import itertools
import random
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

from tracing import FAN_VALUES, FLOAT32, TRIGGER, Recording, held_at, scripted

from grader.runtime.model.trace import ClockKind

# --- a controller of a fan ---

Rule = Callable[[float], float]


def right_speed(value: float) -> float:
    return 100.0 if value > 25 else 0.0


def each_speed(rule: Rule, values: tuple[float, ...] = FAN_VALUES, delay: float = 0.0) -> Recording:
    """Answers each temperature."""
    rec = scripted(values)
    for k in range(10 * len(values)):
        rec.number(0.5 + 0.2 * k + delay, "/fan_speed", rule(values[k // 10]))
    return rec


def on_change(rule: Rule, first: float | None = None, values: tuple[float, ...] = FAN_VALUES) -> Recording:
    """Publishes on change only; `first` is the state that it starts in without saying so."""
    rec = scripted(values)
    state = first
    for k in range(len(values)):
        if rule(values[k]) != state:
            state = rule(values[k])
            rec.number(0.5 + 2 * k, "/fan_speed", state)
    return rec


def timed(
    rule: Rule, period: float, phase: float = 0.0, lag: float = 0.0, values: tuple[float, ...] = FAN_VALUES
) -> Recording:
    """Publishes on a timer, from what it had `lag` seconds before: at one instant the timer may come first."""
    rec = scripted(values)
    for t in itertools.takewhile(lambda t: t < 17, (phase + k * period for k in range(400))):
        value = held_at(t - lag, values)
        if value is not None:
            rec.number(t, "/fan_speed", rule(value))
    return rec


HONEST_FANS = {
    "each temperature": each_speed(right_speed),
    "each, 50 ms later": each_speed(right_speed, delay=0.05),
    "on change": on_change(right_speed),
    "on change, says its state at the start": on_change(right_speed, 0.0).number(0.0, "/fan_speed", 0.0),
    "timer 0.1 s": timed(right_speed, 0.1),
    "timer 0.1 s, one behind": timed(right_speed, 0.1, lag=0.001),
    "timer 0.2 s, in step and behind": timed(right_speed, 0.2, phase=0.1, lag=0.2),
    "timer 0.5 s, in step and behind": timed(right_speed, 0.5, lag=0.001),
    "timer 0.5 s, nearly a period behind": timed(right_speed, 0.5, phase=0.4, lag=0.45),
    "timer 1 s": timed(right_speed, 1.0),
    "timer 1 s, in step and behind": timed(right_speed, 1.0, phase=0.5, lag=0.001),
    "old and new at one instant": timed(right_speed, 0.2, 0.5, 0.001).add(*each_speed(right_speed).trace().messages()),
    "a state of its own at the first instant": scripted()
    .number(0.5, "/fan_speed", 100.0)
    .add(*each_speed(right_speed).trace().messages()),
    "says off before any temperature": each_speed(right_speed).number(0.1, "/fan_speed", 0.0),
}


WRONG_FANS: dict[str, tuple[Rule, tuple[int, int]]] = {
    ">= at 25": (lambda v: 100.0 if v >= 25 else 0.0, (1, 0)),
    "> 26": (lambda v: 100.0 if v > 26 else 0.0, (0, 1)),
    "whole numbers": (lambda v: 100.0 if int(v) > 25 else 0.0, (0, 1)),
    "rounded up": (lambda v: 100.0 if round(v + 0.5) > 25 else 0.0, (1, 0)),
    "inverted": (lambda v: 0.0 if v > 25 else 100.0, (0, 0)),
    "always on": (lambda v: 100.0, (1, 0)),
    "always off": (lambda v: 0.0, (0, 1)),
    "1 for 100": (lambda v: 1.0 if v > 25 else 0.0, (0, 1)),
    "hysteresis-like": (lambda v: 100.0 if v > 27 else 0.0, (0, 1)),
    "nan": (lambda v: float("nan"), (0, 0)),
}


# --- a sensor and a controller ---


def sensor(seed: int = 3, stop_s: float = 20.2, until: float = 99.0) -> tuple[Recording, list[tuple[float, float]]]:
    rng = random.Random(seed)
    rec = Recording(stop_s, process="temperature_sensor.py")
    sent = [(0.2 + 0.2 * k, rng.uniform(20, 30)) for k in range(100)]
    sent = [(t, v) for t, v in sent if t < min(stop_s - 1e-9, until)]
    for t, v in sent:
        rec.number(t, "/temperature", v)
    return rec, sent


def together(
    rule: Callable[[float], float] = right_speed, seed: int = 3, until: float = 99.0, delay: float = 0.0
) -> Recording:
    rec, sent = sensor(seed)
    for t, v in sent:
        if t < until:
            rec.number(t + delay, "/fan_speed", rule(v))
    return rec


def graph(*left_out: int, back_type: str = FLOAT32, controller: int = 2, wall: float = 1.0) -> Recording:
    rec = Recording()
    ends = [
        ("publisher", "/temperature", FLOAT32, "/temperature_sensor", 1),
        ("subscription", "/fan_speed", back_type, "/temperature_sensor", 1),
        ("subscription", "/temperature", FLOAT32, "/fan_controller", controller),
        ("publisher", "/fan_speed", FLOAT32, "/fan_controller", controller),
    ]
    for k, end in enumerate(ends):
        if k not in left_out:
            rec.endpoint(*end, t_s=k * wall)
    return rec


# --- a sensor ---

SPEEDS = (100.0, 0.0, 63.271, 17.448, 100.0)


def sensed(values: list[float], **kw: str) -> Recording:
    rec = Recording(12.2, process="temperature_sensor.py")
    for k, value in enumerate(values):
        rec.number(0.2 + k * 0.2, "/temperature", value, **kw)
    return rec


def drawn(count: int = 60) -> list[float]:
    rng = random.Random(7)
    return [rng.uniform(20, 30) for _ in range(count)]


def hearing(write: Callable[[float], str], times: list[float] | None = None, printed: bool = False) -> Recording:
    """A sensor that writes the newest fan speed."""
    rec = scripted(SPEEDS, "/fan_speed", 12.2)
    rec.process = "temperature_sensor.py"
    rec.endpoint("subscription", "/fan_speed", FLOAT32, "/temperature_sensor")
    for t in times if times is not None else [0.5 + 0.2 * k for k in range(50)]:
        value = held_at(t, SPEEDS)
        if value is not None:
            (rec.line if printed else rec.log)(t, write(value))
    return rec


# --- a battery server ---

BATTERY = "/battery/get_status"


def levels(start: float = 85.0, step: float = 0.5, reset: float = 100.0) -> Iterator[float]:
    level = start
    while True:
        level -= step
        if level < 0:
            level = reset
        yield level


def status(level: float) -> dict[str, Any]:
    return {"success": True, "message": f"Battery: {level:.1f}% remaining"}


def asked(
    values: Iterable[Mapping[str, Any] | None], clients: int = 1, period_s: float = 0.05, late_s: float = 0.0
) -> Recording:
    """A server that is asked from t = 1 s on, by several clients at the same instants; None is no response."""
    rec = Recording(30.0, process="battery_service_server.py").service("service", BATTERY, TRIGGER, "/battery_monitor")
    for k, value in enumerate(values):
        t = 1.0 + period_s * (k // clients)
        rec.request(t, BATTERY, k + 1, client=k % clients + 1)
        if value is not None:
            rec.response(t + late_s, BATTERY, k + 1, value, client=k % clients + 1)
    return rec


def answering(count: int = 210, write: Any = status, source: Iterator[float] | None = None, **kw: Any) -> Recording:
    chosen = source or levels()
    return asked([write(next(chosen)) for _ in range(count)], **kw)


# --- a client of it ---

CLIENT = "battery_service_client.py"
#: What a client writes: (level, text); `print` is a printed line, `at_end LEVEL` comes once the pause is over.
Said = Sequence[tuple[str, str]]
Answer = tuple[bool, str] | None


def battery(level: float) -> Answer:
    return True, f"Battery: {level:.1f}% remaining"


FAILED: Answer = (False, "Battery: 60.0% remaining")
UNREADABLE: Answer = (True, "sensor fault")
ANSWERS = (battery(84.5), battery(20.1), battery(20.0), FAILED, UNREADABLE, None, battery(15.0), battery(63.0))


def level_of(answer: Answer) -> float | None:
    if answer is None or not answer[0] or "%" not in answer[1]:
        return None
    return float(answer[1].split(":")[1].split("%")[0])


def asking(
    write: Callable[[Answer], Said],
    answers: Sequence[Answer] = ANSWERS,
    header: str = "== run {} ==",
    pause_s: float = 1.0,
    delay_s: float = 0.1,
    waiting: Said = (("INFO", "nobody there yet"),),
    appears_s: float = 3.0,
    clock: ClockKind = ClockKind.VIRTUAL,
) -> Recording:
    """A client that waits until its server appears, and asks again a pause after each answer."""
    rec = Recording(30.0, clock, CLIENT).service("client", BATTERY, TRIGGER, "/mission_planner")
    rec.mark(appears_s, "server_starts", BATTERY)
    for k in range(1, 3):
        say(rec, float(k), waiting)
    t = appears_s + 0.25
    say(rec, t, [("INFO", "planner is up")])
    for place, answer in enumerate(answers, 1):
        say(rec, t, [("INFO", header.format(place))] if header else [])
        rec.request(t, BATTERY, place, sender="student")
        at = t + (delay_s if answer is not None else 2.0)
        if answer is not None:
            rec.response(at, BATTERY, place, {"success": answer[0], "message": answer[1]}, sender="grader")
        texts = write(answer)
        say(rec, at, [x for x in texts if not x[0].startswith("at_end")])
        t = at + pause_s
        say(rec, t, [(level[7:], text) for level, text in texts if level.startswith("at_end")])
    return rec


def say(rec: Recording, t_s: float, texts: Said) -> None:
    for level, text in texts:
        if level == "print":
            rec.line(t_s, text)
        else:
            rec.log(t_s, text, level)


def chapter(answer: Answer) -> Said:
    said = [("INFO", f"the answer: {answer[1]}")] if answer else [("ERROR", "no answer came")]
    level = level_of(answer)
    if level is None:
        return said
    return [
        *said,
        ("INFO", "charge is fine, off it goes") if level > 20 else ("WARN", "charge is low, it stays"),
    ]


def deciding(go: Callable[[float], bool], unknown: float | None = None) -> Callable[[Answer], Said]:
    """A client by another rule, with the number that it takes for an answer that it cannot use."""

    def write(answer: Answer) -> Said:
        level = level_of(answer)
        level = unknown if level is None else level
        if level is None:
            return chapter(answer)
        said = [("INFO", f"the answer: {answer[1]}")] if answer else [("ERROR", "no answer came")]
        return [*said, ("INFO", "charge is fine, off it goes") if go(level) else ("WARN", "low, it stays")]

    return write
