"""Tells answers that come late from answers that are wrong: each is right for an input that came before."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Callable, Sequence

from grader.core.quantities import NS_PER_MS, NS_PER_S
from grader.judging.values import Reading

#: Lags are tried in these steps, up to the longest.
_STEP_NS = 100 * NS_PER_MS
_LONGEST_NS = 8 * NS_PER_S
#: So many inputs an answer may lie behind.
_FURTHEST_BEHIND = 25
#: Share of the answers that must fit for it to be named.
_SURE = 0.97
#: Fewer answers than this fit something by chance.
_FEWEST = 10

Right = Callable[[float, float], bool]


def lag_ns(inputs: Sequence[Reading], answers: Sequence[Reading], right: Right) -> int | None:
    """Return by how much the answers lag behind the inputs that they are right for, if they all do.

    Args:
        inputs: The numbers in order, each with the time from which on it was there.
        answers: The answers in order.
        right: Whether an answer (first) is right for an input (second).

    Returns:
        A whole number of tenths of a second above 0, or None if there is no lag or none explains the answers.
    """
    found: int | None = None
    for lag in range(0, _LONGEST_NS + 1, _STEP_NS):
        fits = _fits(inputs, answers, right, lag)
        if fits and lag == 0:
            return None
        if fits:
            found = lag
        elif found is not None:
            break
    return found


def _fits(inputs: Sequence[Reading], answers: Sequence[Reading], right: Right, lag: int) -> bool:
    times = [r.t_ns for r in inputs]
    asked = [
        (a.value, inputs[bisect_right(times, a.t_ns - lag) - 1].value) for a in answers if a.t_ns - lag >= times[0]
    ]
    changes = len({got for got, _ in asked}) > 1
    return len(asked) >= _FEWEST and changes and all(right(got, value) for got, value in asked)


def steps_behind(inputs: Sequence[Reading], answers: Sequence[Reading], right: Right) -> int:
    """Return how many inputs before the newest the one lies that nearly every answer is right for; 0 if none does.

    Args:
        inputs: The numbers in order; they change from one to the next.
        answers: The answers in order, about one to each input.
        right: Whether an answer (first) is right for an input (second).
    """
    times = [r.t_ns for r in inputs]
    newest = [(a.value, bisect_right(times, a.t_ns) - 1) for a in answers]
    for behind in range(_FURTHEST_BEHIND + 1):
        asked = [(got, inputs[place - behind].value) for got, place in newest if place >= behind]
        if len(asked) < _FEWEST or len({got for got, _ in asked}) < 2:
            return 0
        if sum(right(got, value) for got, value in asked) >= _SURE * len(asked):
            return behind
    return 0
