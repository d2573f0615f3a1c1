"""Causes of a wrong rate: a period in the wrong unit, a delayed callback, a loop without a pause."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterable, Sequence

from grader.grading.judging.diagnosis.rules import (
    SAME_PACE,
    Case,
    Clue,
    hint_rule,
    lines_of,
    rounded_down,
    same_pace,
    silent_topic,
)
from grader.grading.judging.diagnosis.wiring import (
    Constant,
    Made,
    callback_nodes,
    called_only,
    changes,
    conditions,
    constant_value,
    head_of,
    made,
    made_for,
    names_called,
    pauses,
    publish_calls,
    reached,
    roots,
    runs,
    spin_timeout,
    timer_code,
    waits_for_ever,
)
from grader.grading.judging.facts import LogPaceFacts, RateFacts
from grader.grading.judging.source import Loop, Source, argument, chain, first_line, last_name
from grader.grading.model.exercise import ProblemKind
from grader.grading.model.wording import number
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import seconds


@dataclass(frozen=True, slots=True)
class _Paced:
    """The requested and the measured rate, with the calls that publish."""

    case: Case
    source: Source
    calls: Sequence[ast.Call]
    wanted_hz: float
    facts: RateFacts

    @property
    def found_hz(self) -> float:
        """The measured rate; NaN if there are too few messages for it."""
        return self.facts.rate_hz

    @property
    def period_s(self) -> float:
        return 1 / self.wanted_hz

    def timers(self) -> list[Made]:
        """Return the timers whose callbacks publish."""
        return [item for item in made(self.source, "timer") if set(self.calls) & set(runs(self.source, item))]


def _paced(case: Case) -> _Paced | None:
    check = case.check
    if silent_topic(case):
        return None
    calls = publish_calls(case.source, made_for(case.source, "publisher", check.topic))
    facts = case.found(RateFacts) or RateFacts(0, math.nan)
    return _Paced(case, case.source, calls, check.rate, facts)


@hint_rule(priority=9005)
def _timer_made_again(case: Case) -> Clue | None:
    """A callback creates a timer each time it runs, and none is stopped."""
    rate, pace = case.found(RateFacts), case.found(LogPaceFacts)
    often = rate is not None and (rate.rate_hz > rate.wanted_hz or case.is_about(ProblemKind.BURSTS))
    if not (often or (pace is not None and 0 < pace.average_s < pace.wanted_s)):
        return None
    source, inside = case.source, callback_nodes(case.source)
    stopped = any(source.calls("cancel", "destroy_timer", "destroy"))
    again = [m.call for m in made(source, "timer") if m.call in inside and not conditions(source, m.call)]
    if stopped or not again:
        return None
    name = source.function_name(again[0]) or "the callback"
    hint = f"{name} creates another timer each time it runs: create the timer once, in __init__"
    return Clue(hint, source.place(again[0]))


@hint_rule("topic_rate", given=_paced, priority=9010)
def _period(paced: _Paced) -> Clue | None:
    """The period of the timer explains the rate."""
    timers = paced.timers()
    if len(timers) != 1:
        return None
    worth = constant_value(paced.source, timers[0].period)
    if worth is None or same_pace(worth.value, paced.period_s):
        return None
    if worth.value == 0:
        hint = f"{timer_code(paced.source, timers[0])} has a period of 0 s: write {number(paced.period_s)}"
        return rounded_down(paced.source, timers[0], paced.period_s) or Clue(hint, paced.source.place(worth.origin))
    explains = same_pace(1 / worth.value, paced.found_hz) or (
        paced.facts.count <= 2 and same_pace(worth.value, paced.facts.first_s)
    )
    return _period_clue(paced.source, timers[0], worth, paced.wanted_hz) if explains else None


def _period_clue(source: Source, timer: Made, worth: Constant, wanted_hz: float) -> Clue:
    wanted_s = number(1 / wanted_hz)
    is_ = f"{timer_code(source, timer)} fires every {number(worth.value)} s"
    if same_pace(worth.value, wanted_hz):
        hint = f"{is_}: {number(worth.value)} is the rate, the period is 1/{number(wanted_hz)} = {wanted_s} s"
    elif same_pace(worth.value, 1000 / wanted_hz):
        hint = f"{is_}: the period is in seconds, not milliseconds: write {wanted_s}"
    else:
        rate = number(1 / worth.value)
        hint = f"{is_}, which is {rate} Hz; {number(wanted_hz)} Hz needs a period of {wanted_s} s"
    return Clue(hint, source.place(worth.origin), key=f"period:{timer.call.lineno}")


@hint_rule("topic_rate", given=_paced, priority=9020)
def _callback_held_up(paced: _Paced) -> Clue | None:
    """The callback of the timer sleeps, or never returns."""
    if not paced.found_hz < paced.wanted_hz:
        return None
    for timer in paced.timers():
        for node in runs(paced.source, timer):
            if isinstance(node, ast.While) and _pause(paced.source, node):
                name = paced.source.function_name(node) or "the callback"
                hint = f"the loop '{head_of(paced.source, node)}' keeps {name} from returning"
                return Clue(f"{hint}: let the timer call it again instead", paced.source.place(node))
        sleeps = _sleeps(paced.source, runs(paced.source, timer))
        total = sum(s.value for s in sleeps)
        if sleeps and total > paced.period_s and same_pace(1 / total, paced.found_hz):
            call = sleeps[0].origin
            hint = f"{paced.source.code(call)} blocks the callback: remove it, because the timer sets the pace"
            return Clue(hint, paced.source.place(call))
    return _held_up_now_and_then(paced)


@hint_rule("topic_rate", given=_paced, priority=9030)
def _loops_in_callback(paced: _Paced) -> Clue | None:
    """The callback of the timer publishes in a loop that never ends."""
    for timer in paced.timers():
        for node in runs(paced.source, timer):
            if not isinstance(node, ast.While) or not _endless(node) or not set(paced.calls) & set(ast.walk(node)):
                continue
            name = paced.source.function_name(node) or "the callback"
            hint = f"the loop '{head_of(paced.source, node)}' keeps {name} from returning: "
            return Clue(f"{hint}remove the loop, the timer calls {name} again", paced.source.place(node))
    return None


def _endless(loop: ast.While) -> bool:
    plain = isinstance(loop.test, ast.Constant) or chain(getattr(loop.test, "func", None)) == "rclpy.ok"
    return plain and not any(isinstance(n, (ast.Break, ast.Return, ast.Raise)) for n in ast.walk(loop))


def _held_up_now_and_then(paced: _Paced) -> Clue | None:
    """A callback sleeps on a condition, or another one does, as long as the longest pause between messages."""
    source, longest = paced.source, paced.facts.longest_s
    items = made(source, "timer", "subscription")
    if not paced.timers() or not longest >= 1.5 * paced.period_s:  # NaN if nothing was measured
        return None
    for item in items:
        for sleep in _sleeps(source, runs(source, item)):
            if not sleep.value - 0.1 * paced.period_s <= longest <= 2 * sleep.value + 2 * paced.period_s:
                continue
            test = next(source.around(sleep.origin, ast.If), None)
            under = f" under 'if {source.code(test.test, 40)}'" if test is not None else ""
            hint = f"{source.code(sleep.origin)}{under} blocks every callback of the node"
            return Clue(f"{hint}: remove it", source.place(sleep.origin))
    return None


def _sleeps(source: Source, nodes: Iterable[ast.AST]) -> list[Constant]:
    """Return the sleeps of known length, with the call as origin."""
    found = []
    for node in nodes:
        if isinstance(node, ast.Call) and chain(node.func) in ("time.sleep", "sleep"):
            worth = constant_value(source, argument(node, 0, "secs"))
            if worth is not None and worth.value > 0:
                found.append(Constant(worth.value, node))
    return sorted(found, key=lambda s: first_line(s.origin))


def _pause(source: Source, loop: ast.AST) -> list[Constant]:
    """Return the sleeps in a loop, and the timeouts of spin_once, each with the call as origin."""
    inside = list(reached(source, [loop]))
    spun = [n for n in inside if isinstance(n, ast.Call) and last_name(n.func) == "spin_once"]
    waits = [(c, constant_value(source, spin_timeout(c))) for c in spun]
    timeouts = [Constant(worth.value, call) for call, worth in waits if worth is not None and worth.value > 0]
    return sorted([*_sleeps(source, inside), *timeouts], key=lambda s: first_line(s.origin))


@hint_rule("topic_rate", problem=ProblemKind.BURSTS, given=_paced, priority=9040)
def _published_several_times(paced: _Paced) -> Clue | None:
    """Each iteration publishes more than once, or several timers publish."""
    timers = paced.timers()
    if not timers or math.isnan(paced.found_hz):
        return None
    source = paced.source
    if len(timers) > 1:
        hint = f"{len(timers)} timers publish, in {lines_of(timers[0].call, *(t.call for t in timers[1:]))}"
        return Clue(f"{hint}: one is enough", source.place(timers[-1].call))
    inside = [c for c in reached(source, roots(source, timers[0].callback)) if c in paced.calls]
    if len(inside) > 1:
        hint = f"publish is called {len(inside)} times per iteration, in {lines_of(inside[0], *inside[1:])}"
        return Clue(f"{hint}: once is enough", source.place(max(inside, key=first_line)))
    loop = next((n for c in inside for n in source.around(c, ast.For)), None)
    if loop is None:
        return None
    hint = f"the loop '{head_of(source, loop)}' publishes several messages at once"
    return Clue(f"{hint}: publish one every {number(paced.period_s)} s", source.place(loop))


@hint_rule("topic_rate", given=_paced, priority=9050)
def _stopped_itself(paced: _Paced) -> Clue | None:
    """A callback cancels its timer, destroys the node, or stops publishing on a condition."""
    if not (paced.case.is_about(ProblemKind.STOPPED) or paced.facts.count == 1):
        return None
    source = paced.source
    for timer in paced.timers():
        inside = runs(source, timer)
        advice = "stops publishing: publish until the node is stopped"
        for node in inside:
            if isinstance(node, ast.Call) and last_name(node.func) in ("destroy_node", "destroy_timer", "cancel"):
                return Clue(f"{source.code(node)} {advice}", source.place(node))
        tests = [n for c in inside if c in paced.calls for n in conditions(source, c) if changes(source, n.test)]
        if len(tests) == 1:
            return Clue(f"'if {source.code(tests[0].test, 40)}' {advice}", source.place(tests[0]))
    return None


@hint_rule("topic_rate", given=_paced, priority=9055)
def _held_up_beside_spinning(paced: _Paced) -> Clue | None:
    """A loop sleeps between two calls of spin_once, so that the timer fires as rarely as the loop turns."""
    if not paced.timers() or not paced.found_hz < (1 - SAME_PACE) * paced.wanted_hz:
        return None
    for pause in pauses(paced.source):
        if pause.spun is not None and pause.seconds is not None and pause.seconds > 0.5 * paced.period_s:
            return Clue(pause.hint(paced.source), paced.source.place(pause.call), key="spins_and_sleeps")
    return None


@hint_rule("topic_rate", given=_paced, priority=9060)
def _too_slow(paced: _Paced) -> Clue | None:
    """The period is right, but the rate is too low."""
    timers = paced.timers()
    worth = constant_value(paced.source, timers[0].period) if len(timers) == 1 else None
    if worth is None or not same_pace(worth.value, paced.period_s):
        return None
    if math.isnan(paced.found_hz) or paced.found_hz > 0.97 * paced.wanted_hz:
        return None
    start = roots(paced.source, timers[0].callback)
    hint = f"{timer_code(paced.source, timers[0])} has the right period, but a callback takes longer than that"
    return Clue(f"{hint}: do less in it", paced.source.place(start[0] if start else timers[0].call))


@hint_rule("topic_rate", given=_paced, priority=9070)
def _waits_to_spin(paced: _Paced) -> Clue | None:
    """A loop that publishes spins once without a timeout, which waits until something wakes the node."""
    rare = math.isnan(paced.found_hz) or paced.found_hz < (1 - SAME_PACE) * paced.wanted_hz
    if paced.timers() or not rare:
        return None
    source = paced.source
    for loop in source.loops():
        inside = list(reached(source, [loop]))
        call = next((n for n in inside if isinstance(n, ast.Call) and waits_for_ever(source, n)), None)
        if call is not None and set(paced.calls) & set(inside):
            hint = f"{source.code(call)} without timeout_sec waits until a message or a timer wakes the node"
            return Clue(
                f"{hint}: let create_timer({number(paced.period_s)}, ...) publish, and call spin", source.place(call)
            )
    return None


@hint_rule("topic_rate", given=_paced, priority=9080)
def _loop_pace(paced: _Paced) -> Clue | None:
    """A loop publishes, but its pause is not the requested period."""
    if paced.timers():
        return None
    source, wanted = paced.source, number(paced.wanted_hz)
    rates = list(source.calls("create_rate", "Rate"))
    worth = constant_value(source, argument(rates[0], 0, "frequency")) if len(rates) == 1 else None
    if worth is not None and worth.value > 0 and _explains(paced, 1 / worth.value):
        hint = f"{source.code(rates[0])} is {number(worth.value)} Hz"
        if same_pace(worth.value, paced.period_s):
            hint += f", a message every {wanted} s: it takes the rate, write {wanted}"
        else:
            hint += f"; {wanted} Hz is required"
        return Clue(hint, source.place(worth.origin))
    loops = [n for n in source.loops() if set(paced.calls) & set(reached(source, [n]))]
    return _pace_of(paced, loops[-1]) if loops else None


def _explains(paced: _Paced, period_s: float) -> bool:
    """Return whether a loop with this period publishes as was measured; one that is watched too briefly, as rarely."""
    if same_pace(period_s, paced.period_s):
        return False
    watched_s = seconds(paced.case.trace.stop_ns) - paced.facts.first_s
    rare = 0 < paced.facts.count <= 2 and paced.facts.count * period_s >= (1 - SAME_PACE) * watched_s
    return rare if math.isnan(paced.found_hz) else same_pace(1 / period_s, paced.found_hz)


def _pace_of(paced: _Paced, loop: Loop) -> Clue | None:
    source, wanted = paced.source, number(paced.period_s)
    pauses = _pause(source, loop)
    total = sum(p.value for p in pauses)
    if not pauses:
        return _no_pause(paced, loop)
    call = pauses[0].origin
    if _explains(paced, total):
        codes = " and ".join(dict.fromkeys(source.code(p.origin) for p in pauses))
        hint = f"{codes} give{'s' if len(pauses) == 1 else ''} {number(1 / total)} Hz"
        in_all = " in all" if len(pauses) > 1 else ""
        longest = max(pauses, key=lambda p: p.value).origin
        return Clue(f"{hint}; {number(paced.wanted_hz)} Hz needs a pause of {wanted} s{in_all}", source.place(longest))
    spun = next((p.origin for p in pauses if last_name(getattr(p.origin, "func", None)) == "spin_once"), None)
    if spun is not None and paced.found_hz > 1.03 / total and (made(source, "timer", "subscription")):
        hint = f"{source.code(spun)} returns as soon as a message arrives, so it is not a pause"
        return Clue(f"{hint}: let a timer publish, create_timer({wanted}, ...), and call spin", source.place(spun))
    if same_pace(total, paced.period_s) and 0.7 * paced.wanted_hz < paced.found_hz < paced.wanted_hz:
        hint = f"{source.code(call)} adds to the time of the rest of the loop: publish from a timer"
        return Clue(f"{hint}, create_timer({wanted}, ...)", source.place(call))
    return None


def _no_pause(paced: _Paced, loop: Loop) -> Clue | None:
    waits = {"wait", "wait_for", "get", "join", "sleep", "sleep_until", "sleep_for", "spin_once", "select"}
    waits |= {"now", "time", "monotonic", "perf_counter", "time_ns", "monotonic_ns"}
    inside = names_called(paced.source, [loop])
    if inside & waits or not paced.found_hz >= 5 * paced.wanted_hz:  # NaN if nothing was measured
        return None
    head = "while" if isinstance(loop, ast.While) else "for"
    hint = f"the {head} loop publishes without a pause: use create_timer({number(paced.period_s)}, ...)"
    return Clue(hint, paced.source.place(loop))


@hint_rule("topic_rate", given=_paced, priority=9090)
def _published_once(paced: _Paced) -> Clue | None:
    """Neither a timer nor a loop publishes."""
    if paced.facts.count != 1 or paced.timers() or not paced.calls:
        return None
    source = paced.source
    function = source.function_of(paced.calls[0])
    if function is not None and not called_only(source, function):
        return None
    loops = [n for n in source.loops() if set(paced.calls) & set(reached(source, [n]))]
    timers = list(source.calls("create_timer", "Timer"))
    if loops or timers or any(set(paced.calls) & set(runs(source, s)) for s in made(source, "subscription")):
        return None
    hint = f"{source.code(paced.calls[0])} runs only once: let a timer call it"
    return Clue(f"{hint}, create_timer({number(paced.period_s)}, ...)", source.place(paced.calls[0]))
