"""Checks on what a simulation publishes, such as the pose of a robot that the student's node drives."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, ClassVar

from grader.grading.judging.checks.fields import InRange
from grader.grading.judging.findings import explain_fault, faulted, first_fault, met, not_met
from grader.grading.judging.plots import Drawing, Plot, value_panels
from grader.grading.judging.values import JITTER_NS, FieldRule, delivered, number_at, value_at
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.measures import Measure, Reading
from grader.grading.model.wording import moment, number, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import DurationNs, FieldOf, Topic, counted, seconds
from grader.runtime.model.trace import Delivery, Trace

#: Rounding to single precision must not push a value out of its range.
_EDGE = 1e-6
#: The name of what is drawn of a goal.
_AWAY = "distance"


@dataclass(frozen=True, slots=True)
class _Goal:
    """A goal, the states until the next one, and the distance of each from it."""

    t_ns: int
    stop_ns: int
    states: tuple[Delivery, ...]
    distances: tuple[float, ...]


@dataclass(frozen=True, slots=True)
class ReachesGoal:
    """A simulated robot reaches each goal within a time, and stays there until the next goal or the end.

    A goal is a message of the grader; one that is sent again is the same goal. A goal that is replaced, or whose
    observation ends, before its time is over is not judged.

    Attributes:
        topic: Topic on which the simulation publishes its state.
        goals: Topic on which the grader publishes the goals.
        fields: Field path of the state -> field path of the goal; the distance is taken over all of them.
        tolerance: Largest distance, in the unit of the fields.
        within: Longest time from a goal to the arrival.
        stays: Whether it must not leave again.
    """

    roles: ClassVar[Roles] = Roles(given=("topic", "goals"))
    measures: ClassVar[Measure] = Measure("time to a goal", "s")
    topic: Topic
    goals: Topic
    fields: Annotated[Mapping[str, str], FieldOf("topic", values="goals")]
    tolerance: float
    within: DurationNs
    stays: bool = True

    @property
    def expected(self) -> str:
        stays = ", and staying there until the next goal" if self.stays else ""
        return f"{self.topic} within {number(self.tolerance)} of each goal after {span(self.within)} at most{stays}"

    def judge(self, trace: Trace) -> Finding:
        # One that was replaced or cut off before its time may still have been reached in time.
        goals = [g for g in self._goals(trace) if g.stop_ns - g.t_ns > self.within]
        if not goals:
            return _cut_short(trace, f"{self.goals}: no goal was observed for {span(self.within)}")
        jitter_ns = JITTER_NS[trace.clock]
        told = [(goal, self._flaw(goal, jitter_ns)) for goal in goals]
        wrong = [(goal, flaw) for goal, flaw in told if flaw]
        measured = [Reading(goal.t_ns, math.inf if flaw else self._took_s(goal)) for goal, flaw in told]
        nearest = [min(g.distances) for g in goals]
        evidence: dict[str, object] = {"goals": len(goals), "missed": len(wrong), "nearest": nearest[:10]}
        if not wrong:
            ends = number(max(g.distances[-1] for g in goals))
            reason = f"{self.topic}: reached {counted(len(goals), 'goal')} within {span(self.within)}"
            return met(f"{reason}, at the end at most {ends} away", evidence, measured=measured)
        reason = f"{self.topic}: {wrong[0][1]}; missed {len(wrong)} of {counted(len(goals), 'goal')}"
        fault = first_fault(trace)
        if fault is not None:
            return replace(faulted(fault, reason, evidence, last=True), measured=measured)
        known = evidence | {"first_missed_s": seconds(wrong[0][0].t_ns)}
        return not_met(reason, known, problem=ProblemKind.WRONG_VALUE, measured=measured)

    def _took_s(self, goal: _Goal) -> float:
        """Return how long the robot took to a goal that it has reached, to stay if it has to."""
        near = [(s.t_ns, d <= self.tolerance + _EDGE) for s, d in zip(goal.states, goal.distances, strict=True)]
        arrived = next(t_ns for t_ns, is_near in near if is_near)
        if self.stays:
            left = max((k for k, (_, is_near) in enumerate(near) if not is_near), default=-1)
            arrived = near[left + 1][0] if left + 1 < len(near) else arrived
        return seconds(arrived - goal.t_ns)

    def _goals(self, trace: Trace) -> list[_Goal]:
        states = delivered(trace, self.topic)
        sent: list[Delivery] = []
        for one in delivered(trace, self.goals):
            # A goal that is repeated does not give more time, as a stimulus may send it once a second.
            if not sent or one.value != sent[-1].value:
                sent.append(one)
        stops = [*(one.t_ns for one in sent[1:]), trace.stop_ns]
        found = []
        for goal, stop_ns in zip(sent, stops, strict=False):  # without goals there is no stop either
            during = tuple(s for s in states if goal.t_ns <= s.t_ns < stop_ns)
            if during:
                away = tuple(self._distance(state, goal) for state in during)
                found.append(_Goal(goal.t_ns, stop_ns, during, away))
        return found

    def _distance(self, state: Delivery, goal: Delivery) -> float:
        pairs = [(number_at(state.value, mine), number_at(goal.value, its)) for mine, its in self.fields.items()]
        if any(a is None or b is None for a, b in pairs):
            raise HarnessError(f"{self.topic} and {self.goals}: expected numbers at {', '.join(self.fields)}")
        away = math.dist([a for a, _ in pairs if a is not None], [b for _, b in pairs if b is not None])
        # NaN compares as neither near nor far, and would be the nearest of all in `min`.
        return math.inf if math.isnan(away) else away

    def _flaw(self, goal: _Goal, jitter_ns: int) -> str:
        """Describe how a goal was missed; empty if it was not."""
        pairs = list(zip(goal.states, goal.distances, strict=True))
        near = [(s, d) for s, d in pairs if d <= self.tolerance + _EDGE]
        due_ns = goal.t_ns + self.within + jitter_ns
        told = f"the goal of {moment(goal.t_ns)}"
        if not near or near[0][0].t_ns > due_ns:
            best = min(d for s, d in pairs if s.t_ns <= due_ns)
            text = f"{told} was not reached within {span(self.within)}, the closest was {number(best)} away"
            return f"{text}, expected at most {number(self.tolerance)}"
        # Only after the time is over: on the way, a robot may pass through the goal and come back.
        left = next(((s, d) for s, d in pairs if s.t_ns > due_ns and d > self.tolerance + _EDGE), None)
        if left is None or not self.stays:
            return ""
        text = f"{told} was left again: {number(left[1])} away at {moment(left[0].t_ns)}"
        return f"{text}, expected at most {number(self.tolerance)}"

    def drawing(self, trace: Trace) -> Drawing:
        """Return the state, and its distance from the goal."""
        away = [(s.t_ns, {_AWAY: d}) for g in self._goals(trace) for s, d in zip(g.states, g.distances, strict=True)]
        plot = Plot(self.topic, rules={_AWAY: FieldRule(high=self.tolerance)})
        panels = value_panels(plot, away, f"Distance from the goals on {self.goals}") if away else []
        return Drawing((Plot(self.topic, tuple(self.fields)),), panels=tuple(panels))


@dataclass(frozen=True, slots=True)
class StaysInRange(InRange):
    """A number in every message that the grader publishes on a topic lies in a range, its edges inside.

    The topic is one of a simulation's, such as the pose of a robot that the student's node drives. A list of numbers,
    such as the ranges of a laser scan, lies in the range if each of them does. NaN lies in none.

    Attributes:
        topic: Topic on which the simulation publishes.
        low: Smallest value allowed; none if left out.
        high: Largest value allowed; none if left out.
        field: Path of the number, or of the list of numbers.
        after: Messages before this time are not judged.
    """

    roles: ClassVar[Roles] = Roles(given=("topic",))
    after: DurationNs = 0

    @property
    def expected(self) -> str:
        after = f" from {span(self.after)} on" if self.after else ""
        return f"{self.field} on {self.topic} {self.rule.wanted}{after}"

    def judge(self, trace: Trace) -> Finding:
        states = self._states(trace)
        if not states:
            after = f" after {span(self.after)}" if self.after else ""
            return _cut_short(trace, f"{self.topic}: the simulation published nothing{after}")
        # An empty list has no number outside the range: a laser scan may be empty.
        if not all(self.numbers(s.value) or value_at(s.value, self.field) in ([], ()) for s in states):
            raise HarnessError(f"{self.topic}: expected a number at {self.field}, found none")
        return self.judged(states, first_fault(trace))

    def _states(self, trace: Trace) -> tuple[Delivery, ...]:
        return tuple(d for d in delivered(trace, self.topic) if d.t_ns >= self.after)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the number with its range; of a list, the smallest and the largest."""
        return self.drawn(self._states(trace))


def _cut_short(trace: Trace, what: str) -> Finding:
    """Return no credit if a fault or a flood of the nodes has ended the recording early; raises HarnessError if not."""
    # A limit before a crash: a flood is why the recording ended, and often why the node died.
    limits = trace.marks("limit")
    if limits:
        return not_met(f"{what}: {limits[0].detail}", problem=ProblemKind.TOO_FEW)
    crashed = explain_fault(trace, what, last=True)
    if crashed is None:
        raise HarnessError(what)
    return crashed
