"""Shrinks a run that fails to the draws that it needs, and says where it parts from the nearest run that passes."""

from __future__ import annotations

from collections.abc import Callable, Generator, Iterable, Sequence
from dataclasses import replace
from typing import NamedTuple, TypeAlias

from grader.grading.model.wording import moment
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.step_event import ProgramStep, StepEvent
from grader.world.faults import RunDraws

#: The most runs that shrinking takes: each takes as long as the test.
MOST_RUNS = 40
#: What faults do; the rest is what nodes do.
_OF_FAULTS = ("loses", "late", "paused", "killed")


@dataclass(frozen=True, slots=True)
class Rerun:
    """One run of a test.

    Attributes:
        drawn: What was drawn in it.
        failed: Whether it has failed in the same way as the run that is shrunk.
        steps: What each program has done, in order.
    """

    drawn: RunDraws
    failed: bool
    steps: Sequence[ProgramStep]


@dataclass(frozen=True, slots=True)
class Shrunk:
    """What shrinking has found.

    Attributes:
        failing: The run that still fails with the fewest draws.
        passing: The run that passes and is the same for the longest time; None if none passes.
        runs: How many runs it took.
    """

    failing: Rerun
    passing: Rerun | None
    runs: int


#: Asks for runs in which only this is drawn, one at a time, and returns what was found.
Shrinking: TypeAlias = Generator[RunDraws, Rerun, Shrunk]


class _Search:
    """The runs of one search for the fewest draws: each is made once at most, and no more than `MOST_RUNS` are.

    Args:
        first: A run that has gone as it is wanted, and names its draws.
    """

    def __init__(self, first: Rerun) -> None:
        self._wanted = first.failed
        self.best = first
        self.runs: dict[RunDraws, Rerun] = {}

    def holds(self, faults: Sequence[str], steps: Sequence[str]) -> Generator[RunDraws, Rerun, bool]:
        """Return whether a run in which only this is drawn still goes as it is wanted."""
        drawn = RunDraws(tuple(faults), tuple(steps), self.best.drawn.seed)
        if drawn not in self.runs:
            if len(self.runs) >= MOST_RUNS:
                return False
            self.runs[drawn] = yield drawn
        found = self.runs[drawn]
        if found.failed is self._wanted and drawn.size < self.best.drawn.size:
            self.best = found
        return found.failed is self._wanted

    def fewest(self) -> Generator[RunDraws, Rerun, None]:
        """Look for the fewest draws; it is known that a run without any goes otherwise."""
        faults: Sequence[str] = self.best.drawn.faults or ()
        steps: Sequence[str] = self.best.drawn.steps or ()
        if (yield from self.holds((), steps)):
            faults = ()
        elif (yield from self.holds(faults, ())):
            steps = ()
        if faults:
            faults = yield from _fewest(faults, lambda some: self.holds(some, steps))
        if steps:
            yield from _fewest_steps(steps, lambda some: self.holds(faults, some))


def _naming(attempt: Rerun) -> Rerun:
    """Return a run in which everything was drawn, with the steps in which that has changed anything."""
    deviating = tuple(step.name for step in attempt.steps if step.deviates)
    return replace(attempt, drawn=replace(attempt.drawn, steps=deviating))


def shrink(first: Rerun, others: Iterable[int] = ()) -> Shrinking:
    """Look for the fewest draws with which a run still fails: faults, and steps in which the order is drawn.

    A run that also fails without any draw is compared with one of another seed that passes with the fewest.

    Args:
        first: The run that has failed. Its `drawn` names its faults.
        others: Seeds to try in that case.
    """
    search = _Search(_naming(first))
    if not (yield from search.holds((), ())):
        yield from search.fewest()
        return Shrunk(search.best, _nearest(search.best, search.runs.values()), len(search.runs))
    bare, runs = search.best, len(search.runs)
    for seed in others:
        attempt = yield RunDraws(seed=seed)
        runs += 1
        if not attempt.failed:
            search = _Search(_naming(attempt))
            yield from search.fewest()
            return Shrunk(bare, search.best, runs + len(search.runs))
    return Shrunk(bare, None, runs)


def _nearest(attempt: Rerun, others: Iterable[Rerun]) -> Rerun | None:
    """Return the run that passes and is the same for the longest time; None if none passes."""
    events = _events(attempt.steps)
    found = [one for one in others if not one.failed]
    return max(found, key=lambda one: _common(events, _events(one.steps)), default=None)


def _fewest(
    items: Sequence[str], holds: Callable[[Sequence[str]], Generator[RunDraws, Rerun, bool]]
) -> Generator[RunDraws, Rerun, tuple[str, ...]]:
    """Return the items that are left when no single one of them can be left out: delta debugging, by Zeller."""
    kept = tuple(items)
    size = max(1, len(kept) // 2)
    while True:
        for begin in range(0, len(kept), size):
            fewer = kept[:begin] + kept[begin + size :]
            if (yield from holds(fewer)):
                kept = fewer
                break
        else:
            if size == 1:
                return kept
            size //= 2
            continue
        size = max(1, min(size, len(kept) // 2))


def _fewest_steps(
    steps: Sequence[str], holds: Callable[[Sequence[str]], Generator[RunDraws, Rerun, bool]]
) -> Generator[RunDraws, Rerun, None]:
    """Look for the last step that has to be drawn, and for the fewest before it.

    A run is the same up to the last step that is drawn in it, so the two runs around that step differ in one draw.
    """
    goes_without, goes_with = 0, len(steps)
    while goes_with - goes_without > 1:
        middle = (goes_without + goes_with) // 2
        if (yield from holds(steps[:middle])):
            goes_with = middle
        else:
            goes_without = middle
    last = goes_with
    if last == 1 or (yield from holds(steps[last - 1 : last])):
        return
    needed, too_late = 0, last - 1
    while too_late - needed > 1:
        middle = (needed + too_late) // 2
        if (yield from holds(steps[middle:last])):
            needed = middle
        else:
            too_late = middle
    kept = [*steps[needed:last]]
    for step in kept[1:-1]:
        fewer = [one for one in kept if one != step]
        if (yield from holds(fewer)):
            kept = fewer


# ---------------------------------------------------------------------------------------------------------- in words


class _Timed(NamedTuple):
    t_ns: int
    event: StepEvent


def _events(steps: Iterable[ProgramStep]) -> list[_Timed]:
    """Return what happened, in order."""
    return [_Timed(step.t_ns, event) for step in steps for event in step.events]


def _telling(events: Sequence[_Timed], number: int) -> _Timed | None:
    """Return the first event of a run from one on that says something, or that one; None if the run is over by then.

    What a timer sends says more than the timer, and a new end of a topic, or a client, less than what is done with it.
    """
    if number >= len(events):
        return None
    dull = [("offers", kind) for kind in ("publisher", "subscription", "client")]
    rest = [one for one in events[number:] if (one.event.does, one.event.what.partition(" ")[0]) not in dull]
    found = rest[0] if rest else events[number]
    for one in rest[1:] if found.event.does == "timer" else ():
        if one.t_ns == found.t_ns and one.event.node == found.event.node:
            return one if one.event.does in ("sends", "finds", "misses") else found
    return found


def _common(one: Sequence[_Timed], other: Sequence[_Timed]) -> int:
    """Return how many events two runs have in common, from the first one on."""
    pairs = zip(one, other, strict=False)
    return next((number for number, (a, b) in enumerate(pairs) if a != b), min(len(one), len(other)))


def explained(failing: Sequence[ProgramStep], passing: Sequence[ProgramStep]) -> str:
    """Return where two runs part, in one sentence: what came first in the one that fails; empty if they do not."""
    everything = _events(failing)
    here, there = [one for one in everything if one.event.does not in _OF_FAULTS], _events(passing)
    number = _common(here, there)
    first, other = _telling(here, number), _telling(there, number)
    faults = _faults_before(everything, number)
    if first is None and other is None:
        return ""
    because = f"{_phrase(faults[-1].event)}, and " if faults else ""
    if first is None:
        assert other is not None
        return f"{because}{_phrase(other.event)} at {moment(other.t_ns)} only in the nearest run that passes"
    at = f"at {moment(first.t_ns)} "
    if other is None:
        return f"{because}{at}{_phrase(first.event)}, which did not happen in the nearest run that passes"
    names = {first.event.node, other.event.node, *first.event.others, *other.event.others}
    one, two = (_phrase(event, to=len(names) > 1) for event in (first.event, other.event))
    if first.event == other.event:
        return f"{because}{one} at {moment(first.t_ns)}, in the nearest run that passes at {moment(other.t_ns)}"
    is_later = any(one.event == other.event for one in here[number:])
    was_later = any(one.event == first.event for one in there[number:])
    order = f"{because}{at}{one} before {two}; in the nearest run that passes" if is_later else ""
    if is_later and was_later:
        return f"{order} it was the other way round"
    return f"{order}, {two} first" if is_later else f"{because}{at}{one}; in the nearest run that passes, {two} first"


def _faults_before(everything: Sequence[_Timed], number: int) -> list[_Timed]:
    """Return what faults have done before so many other events, and right after the last one of these."""
    found, others = [], 0
    for one in everything:
        is_fault = one.event.does in _OF_FAULTS
        if others > number or (others == number and not is_fault):
            break
        others += not is_fault
        found += [one] if is_fault else []
    return found


#: What a node did, or what was done to it, by what that is and by the kind of the channel; `{who}` are the others.
_PHRASES = {
    ("reads", "topic"): "{node} read {name} of {who}",
    ("reads", "request"): "{node} read the request of {who} on {name}",
    ("reads", "response"): "{node} read the response of {who} on {name}",
    ("sends", "topic"): "{node} published {name}",
    ("sends", "request"): "{node} called {name}",
    ("sends", "response"): "{node} answered {name}",
    ("offers", "service"): "{node} offered {name}",
    ("offers", "client"): "{node} made its client of {name}",
    ("offers", "subscription"): "{node} subscribed to {name}",
    ("offers", "publisher"): "{node} made its publisher of {name}",
    ("finds", "request"): "{node} found {name}",
    ("misses", "request"): "{node} looked for {name}",
    ("loses", "topic"): "a message of {who} on {name} to {node} was lost",
    ("timer", ""): "{node} ran its timer",
    ("killed", ""): "{node} was killed",
}


def _phrase(event: StepEvent, *, to: bool = True) -> str:
    """Return what a node did, or what was done to it, as a clause; with `to`, whom a message reached."""
    kind, _, name = event.what.partition(" ")
    who = " and ".join(dict.fromkeys(event.others))
    if event.does == "paused":
        return f"{event.node} was paused for {kind} s"
    if event.does == "late":
        return f"a message of {who} on {name.partition(' ')[2]} to {event.node} was {kind} s late"
    reached = f" to {who}" if to and who and event.does == "sends" and kind == "topic" else ""
    return _PHRASES[event.does, kind].format(node=event.node, name=name, who=who) + reached


def told_of_race(first: Rerun, found: Shrunk) -> list[str]:
    """Return the lines about a race: where the runs part, and which draws that takes.

    Args:
        first: The run that was shrunk.
        found: What shrinking has found.
    """
    bare = not found.failing.drawn.size
    if found.passing is None:
        what = "it fails without any draw, in the order in which the programs were started, and with other seeds"
        return [f"no race was found: {what}"] if bare else []
    sentence = explained(found.failing.steps, found.passing.steps)
    some = "run" if found.runs == 1 else "runs"
    needed = found.passing if bare else found.failing
    all_drawn = _naming(first).drawn.size
    how = (
        f"it fails without any draw; what makes it pass, of seed {found.passing.drawn.seed}"
        if bare
        else f"of {all_drawn} draws it takes {needed.drawn.size} to fail"
    )
    return [*([f"race: {sentence}"] if sentence else []), f"{how}: {_draws_of(needed)} ({found.runs} {some})"]


def _draws_of(attempt: Rerun) -> str:
    """Return what is drawn in a run, as a list."""
    names = attempt.drawn.steps or ()
    times = dict.fromkeys(moment(step.t_ns) for step in attempt.steps if step.name in names)
    return ", ".join([*(attempt.drawn.faults or ()), *(f"the order at {at}" for at in times)])
