"""Checks on a student's client of an action: the goals that it sends, when it cancels, and what follows an end."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from grader.grading.judging.facts import GoalFieldFacts
from grader.grading.judging.findings import explain_fault, faulted, first_fault, met, not_met, observed
from grader.grading.judging.service_calls import LATENESS_NS, Call, calls_of, status_of
from grader.grading.judging.values import (
    JITTER_NS,
    RuleOrValue,
    breach,
    broken_rules,
    delivered,
    goal_id,
    message_at,
    rules_text,
)
from grader.grading.model.exercise import Finding, ProblemKind
from grader.grading.model.measures import Measure, Reading
from grader.grading.model.wording import first_few, moment, nearest, number, quote
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import NS_PER_S, DurationNs, FieldOf, counted, seconds
from grader.runtime.model.trace import Trace

#: How a goal ends, as a client learns it.
End = Literal["succeeded", "rejected", "aborted", "canceled"]


@dataclass(frozen=True, slots=True)
class SentGoal:
    """A goal that a client has sent.

    Attributes:
        call: The request that sent it, and the response.
        end: How it ended; empty while it runs.
        end_ns: When the client learnt it; the end of the recording while it runs.
        cancels_ns: When the client asked to cancel it.
    """

    call: Call
    end: str
    end_ns: int
    cancels_ns: tuple[int, ...]

    @property
    def t_ns(self) -> int:
        """When it was sent."""
        return self.call.request.t_ns

    @property
    def content(self) -> Mapping[str, Any]:
        """Its fields."""
        found = self.call.request.value.get("goal")
        return found if isinstance(found, Mapping) else {}


def sent_goals(trace: Trace, action: str) -> tuple[SentGoal, ...]:
    """Return the goals that a student's client sends the grader's server, in order."""
    calls = {part: calls_of(trace, f"{action}/_action/{part}", "student") for part in ("send_goal", "get_result")}
    cancels = calls_of(trace, f"{action}/_action/cancel_goal", "student")
    results = {goal_id(call.request.value): call for call in calls["get_result"] if call.response is not None}
    found = []
    for call in calls["send_goal"]:
        end, end_ns = "", trace.stop_ns
        result = results.get(uuid := goal_id(call.request.value))
        if call.response is not None and call.response.value.get("accepted") is False:
            end, end_ns = "rejected", call.response.t_ns
        elif result is not None and result.response is not None:
            end, end_ns = status_of(result.response), result.response.t_ns
        # Without an id, a request to cancel is about all goals that run.
        mine = (c.request for c in cancels if goal_id(c.request.value, "goal_info.goal_id") in (uuid, _EVERY))
        # One that comes when the goal has ended is about other goals, or about none.
        asked = tuple(r.t_ns for r in mine if call.request.t_ns <= r.t_ns <= end_ns)
        found.append(SentGoal(call, end, end_ns, asked))
    return tuple(found)


#: The id of no goal.
_EVERY = goal_id({"goal_id": {"uuid": [0] * 16}})


@dataclass(frozen=True, slots=True)
class SendsGoals:
    """A student's client sends the grader's action server the expected goals.

    The scenario needs the stimulus `action_server`.

    Attributes:
        action: Action name as on the wire, e.g. `/navigate_to_pose`.
        goals: What is expected of each goal in order, by field path: a value, or `{equals, items, tolerance, low, high,
            pattern, example}`.
        every: What is expected of every goal, by field path.
        at_least: Fewest goals; as many as there are in `goals` if they are more.
        at_most: Most goals; free if left out.
        one_at_a_time: Whether a goal may be sent only after the one before has ended.
    """

    action: str
    goals: tuple[Annotated[Mapping[str, RuleOrValue], FieldOf("action", "_Goal")], ...] = ()
    every: Annotated[Mapping[str, RuleOrValue], FieldOf("action", "_Goal")] = field(default_factory=dict)
    at_least: int = 1
    at_most: int | None = None
    one_at_a_time: bool = False

    @property
    def expected(self) -> str:
        most = "" if self.at_most is None else f" and at most {self.at_most}"
        contents = [rules_text(rules) for rules in (*self.goals, self.every) if rules]
        content = f", with {first_few(contents)}" if contents else ""
        turn = ", in turn" if self.one_at_a_time else ""
        return f"at least {counted(self._least, 'goal')}{most} for {self.action}{content}{turn}"

    @property
    def _least(self) -> int:
        return max(self.at_least, len(self.goals))

    def judge(self, trace: Trace) -> Finding:
        goals = sent_goals(trace, self.action)
        if not goals:
            return explain_no_goal(trace, self.action)
        evidence: dict[str, object] = {"goals": [dict(goal.content) for goal in goals[:10]], "count": len(goals)}
        flawed = self._content_flaw(goals, evidence) or self._count_flaw(goals, evidence)
        if flawed is not None:
            return _unless_crashed(trace, flawed, evidence)
        return met(f"{self.action}: {counted(len(goals), 'goal')}, as expected", evidence)

    def _content_flaw(self, goals: Sequence[SentGoal], evidence: dict[str, object]) -> Finding | None:
        for place, goal in enumerate(goals):
            rules = {**self.every, **(self.goals[place] if place < len(self.goals) else {})}
            wrong = broken_rules(goal.content, rules)
            if wrong:
                flaw = breach(goal.content, wrong[0], rules[wrong[0]])
                reason = f"{moment(goal.t_ns)}, {self.action}, goal {place + 1}: {flaw}"
                facts = _field_facts(wrong[0], rules[wrong[0]])
                return not_met(reason, evidence, problem=ProblemKind.WRONG_VALUE, facts=facts)
        for before, after in pairwise(goals) if self.one_at_a_time else ():
            if after.t_ns < before.end_ns:
                reason = f"{moment(after.t_ns)}, {self.action}: a goal is sent while the one before runs"
                return not_met(reason, evidence, hint="wait for the result first", problem=ProblemKind.TOO_EARLY)
        return None

    def _count_flaw(self, goals: Sequence[SentGoal], evidence: dict[str, object]) -> Finding | None:
        if self._least <= len(goals) and (self.at_most is None or len(goals) <= self.at_most):
            return None
        problem = ProblemKind.TOO_FEW if len(goals) < self._least else ProblemKind.TOO_MANY
        most = "" if self.at_most is None else f" and at most {self.at_most}"
        reason = f"{self.action}: {counted(len(goals), 'goal')}, expected at least {self._least}{most}"
        return not_met(reason, evidence, problem=problem)


def _field_facts(path: str, rule: RuleOrValue) -> GoalFieldFacts | None:
    """Return what a hint rule may read of a field that is not as expected; None if several values would be right."""
    if isinstance(rule, str):
        return GoalFieldFacts(path, rule)
    plain = isinstance(rule, (int, float)) and not isinstance(rule, bool)
    return GoalFieldFacts(path, float(rule)) if plain else None  # type: ignore[arg-type]


@dataclass(frozen=True, slots=True)
class CancelsGoal:
    """A student's client cancels each goal that runs, and only from a moment on: soon after it, and not before.

    The moment is the first feedback that holds `when`; without `when`, the acceptance of the goal. A goal that ends
    before the moment, or shortly after it, need not be cancelled.

    Attributes:
        action: Action name as on the wire.
        when: What the feedback holds from which on the goal has to be cancelled, by field path.
        after: Time from the moment from which on it may be cancelled.
        within: Longest time from then on.
        at_least: Number of goals that have to reach that moment.
    """

    measures: ClassVar[Measure] = Measure("time to the request to cancel", "s")
    action: str
    when: Annotated[Mapping[str, RuleOrValue], FieldOf("action", "_Feedback")] = field(default_factory=dict)
    after: DurationNs = 0
    within: DurationNs = NS_PER_S
    at_least: int = 1

    @property
    def expected(self) -> str:
        since = f"the feedback with {rules_text(self.when)}" if self.when else "the acceptance"
        later = f"{number(seconds(self.after))} s after " if self.after else ""
        return f"each goal for {self.action} cancelled within {number(seconds(self.within))} s, {later}{since}"

    def judge(self, trace: Trace) -> Finding:
        goals = sent_goals(trace, self.action)
        if not goals:
            return explain_no_goal(trace, self.action)
        moments = [(goal, self._due_ns(trace, goal)) for goal in goals]
        due = [(goal, due_ns) for goal, due_ns in moments if due_ns is not None]
        evidence: dict[str, object] = {"goals": len(goals), "due": len(due)}
        early = self._early(trace, moments)
        if early is not None:
            return not_met(early, evidence, problem=ProblemKind.TOO_EARLY)
        must = [(g, t) for g, t in due if g.cancels_ns or t + self.within < min(g.end_ns, trace.stop_ns)]
        if len(must) < self.at_least or not must:
            what = f"{self.action}: {counted(len(must), 'goal')} came to the moment to cancel"
            return _too_few(trace, what, self.at_least, evidence)
        took = [Reading(g.t_ns, seconds(g.cancels_ns[0] - t) if g.cancels_ns else math.inf) for g, t in must]
        late_ns = self.within + LATENESS_NS[trace.clock]
        for goal, due_ns in must:
            if not goal.cancels_ns or goal.cancels_ns[0] > due_ns + late_ns:
                asked = "never" if not goal.cancels_ns else f"only {seconds(goal.cancels_ns[0] - due_ns):.3f} s later"
                reason = f"{moment(due_ns)}, {self.action}: the goal had to be cancelled, and was {asked}"
                problem = ProblemKind.TOO_LATE if goal.cancels_ns else ProblemKind.NO_ANSWER
                found = not_met(f"{reason}; expected {self.expected}", evidence, problem=problem, measured=took)
                return _unless_crashed(trace, found, evidence)
        return met(f"{self.action}: {counted(len(must), 'goal')} cancelled in time", evidence, measured=took)

    def _due_ns(self, trace: Trace, goal: SentGoal) -> int | None:
        """Return from when on a goal may be cancelled; None if that moment did not come while it ran."""
        if goal.call.response is None or goal.end == "rejected":
            return None
        since_ns: int | None = goal.call.response.t_ns
        if self.when:
            uuid = goal_id(goal.call.request.value)
            told = (
                d
                for d in delivered(trace, f"{self.action}/_action/feedback")
                if goal.t_ns <= d.t_ns <= goal.end_ns and goal_id(d.value) == uuid
            )
            since_ns = next(
                (d.t_ns for d in told if not broken_rules(message_at(d.value, "feedback"), self.when)), None
            )
        due_ns = None if since_ns is None else since_ns + self.after
        return due_ns if due_ns is not None and due_ns <= goal.end_ns else None

    def _early(self, trace: Trace, moments: Sequence[tuple[SentGoal, int | None]]) -> str | None:
        """Describe a request to cancel that came before its moment; None if there is none."""
        for goal, due_ns in moments:
            for asked_ns in goal.cancels_ns[:1]:
                if due_ns is None or asked_ns < due_ns - JITTER_NS[trace.clock]:
                    what = "the goal was cancelled too early"
                    return f"{moment(asked_ns)}, {self.action}: {what}; expected {self.expected}"
        return None


#: What follows a goal, in words.
_SAID = {"same": "the same goal again", "next": "another goal", "goal": "a goal", "nothing": "no goal"}


def _was(end: str, count: int = 1) -> str:
    return end if end == "succeeded" else f"{'was' if count == 1 else 'were'} {end}"


@dataclass(frozen=True, slots=True)
class AfterGoal:
    """After each goal that ends in one way, a student's client does what is expected: it sends a goal, or none.

    A goal that ends so late that the recording is over before the time is not judged.

    Attributes:
        action: Action name as on the wire.
        end: How the goal ends: `succeeded`, `rejected`, `aborted` or `canceled`.
        then: What comes next: `same` sends the same goal again, `next` another one, `goal` any, and `nothing` none.
        within: Longest time to the right goal; for `nothing`, how long none may come.
        at_least: Number of goals that have to end so.
        first: How many of them are judged, from the first one on; all if left out.
    """

    measures: ClassVar[Measure] = Measure("time to the right goal", "s")
    action: str
    end: End
    then: Literal["same", "next", "goal", "nothing"] = "goal"
    within: DurationNs = 2 * NS_PER_S
    at_least: int = 1
    first: int | None = None

    @property
    def expected(self) -> str:
        within = f"within {number(seconds(self.within))} s"
        return f"{_SAID[self.then]} {within} after a goal for {self.action} {_was(self.end)}"

    def judge(self, trace: Trace) -> Finding:
        goals = sent_goals(trace, self.action)
        if not goals:
            return explain_no_goal(trace, self.action)
        late_ns = self.within + LATENESS_NS[trace.clock]
        ended = [(k, g) for k, g in enumerate(goals) if g.end == self.end][: self.first]
        follow = {k: next((g for g in goals[k + 1 :] if g.t_ns >= one.end_ns), None) for k, one in ended}
        judged = [(k, g) for k, g in ended if follow[k] is not None or g.end_ns + late_ns < trace.stop_ns]
        evidence: dict[str, object] = {"goals": len(goals), "ends": [g.end for g in goals[:20]], "judged": len(judged)}
        if len(judged) < self.at_least or not judged:
            what = f"{self.action}: {counted(len(judged), 'goal')} {_was(self.end, len(judged))} in time"
            return _too_few(trace, what, self.at_least, evidence)
        took = [] if self.then == "nothing" else [Reading(g.end_ns, self._took_s(g, follow[k])) for k, g in judged]
        for k, goal in judged:
            flaw = self._flaw(goal, follow[k], late_ns)
            if flaw:
                reason = f"{moment(goal.end_ns)}, {self.action}: goal {k + 1} {_was(self.end)}, then {flaw}"
                found = not_met(f"{reason}; expected {self.expected}", evidence, measured=took)
                return _unless_crashed(trace, found, evidence)
        ends = f"{counted(len(judged), 'goal')} that {_was(self.end, len(judged))}"
        return met(f"{self.action}: {_SAID[self.then]} after {ends}", evidence, measured=took)

    def _flaw(self, goal: SentGoal, after: SentGoal | None, late_ns: int) -> str:
        """Describe what is wrong with what follows a goal; empty if nothing is."""
        soon = after is not None and after.t_ns - goal.end_ns <= late_ns
        if self.then == "nothing":
            return f"a goal was sent at {moment(after.t_ns)}" if after is not None and soon else ""
        if after is None:
            return "no goal was sent"
        if not soon:
            return f"the next one was sent only after {seconds(after.t_ns - goal.end_ns):.3f} s"
        if self._fits(goal, after):
            return ""
        if self.then == "next":
            return "the same one was sent again"
        return f"another one was sent: {quote(str(dict(after.content)))}"

    def _fits(self, goal: SentGoal, after: SentGoal) -> bool:
        """Return whether the goal after another is the one expected."""
        return self.then == "goal" or (after.content == goal.content) == (self.then == "same")

    def _took_s(self, goal: SentGoal, after: SentGoal | None) -> float:
        """Return the time to the goal that is expected; infinite if it never came, or another one did."""
        return math.inf if after is None or not self._fits(goal, after) else seconds(after.t_ns - goal.end_ns)


def _too_few(trace: Trace, what: str, at_least: int, evidence: dict[str, object]) -> Finding:
    """Return that fewer goals than expected came so far, as a sentence says, or the fault that may be why."""
    reason = f"{what}, expected at least {max(1, at_least)}"
    return _unless_crashed(trace, not_met(reason, evidence, problem=ProblemKind.TOO_FEW), evidence)


def _unless_crashed(trace: Trace, found: Finding, evidence: Mapping[str, object]) -> Finding:
    """Return the finding, or that a fault is its reason."""
    fault = first_fault(trace)
    return found if fault is None else faulted(fault, found.reason, evidence, last=True)


def explain_no_goal(trace: Trace, action: str) -> Finding:
    """Return no credit with the reason why a student's client sent no goal to an action of the grader's.

    Raises:
        HarnessError: The grader offers no such action in this recording.
    """
    if crashed := explain_fault(trace, f"no goal was sent to {action}"):
        return crashed
    if not any(mark.detail == f"{action}/_action/send_goal" for mark in trace.marks("server_starts")):
        raise HarnessError(f"{action}: the grader offers no such action in the recording")
    clients = {e.service.partition("/_action/")[0]: e for e in trace.service_ends("client") if "/_action/" in e.service}
    told = observed(trace)
    if action in clients:
        type_ = clients[action].type.removesuffix("_SendGoal")
        offered = dict(mark.detail.split(" ") for mark in trace.marks("action_starts"))
        wanted = offered.get(action, type_)
        if type_ != wanted:
            reason = f"{action}: {quote(clients[action].node)} has a client of type {quote(type_)}, expected {wanted}"
            evidence = {"action": action, "type": type_, "node": clients[action].node}
            hint = f"create the ActionClient with {wanted}"
            return not_met(reason, evidence, hint=hint, problem=ProblemKind.OTHER_TYPE)
        reason = f"{action}: {quote(clients[action].node)} has a client and sends no goal in {told}"
        return not_met(reason, {"node": clients[action].node}, problem=ProblemKind.SILENT)
    other = nearest(action, clients) or next(iter(clients), None)
    if other is None:
        hint = "create an ActionClient in the node, and call send_goal_async"
        return not_met(f"{action}: no client of the action in {told}", hint=hint, problem=ProblemKind.ABSENT)
    reason = f"{action}: no client in {told}; {quote(clients[other].node)} has one of {quote(other)}"
    hint = f"name the action {action} instead of {quote(other)}"
    return not_met(reason, {"action": other}, hint=hint, problem=ProblemKind.OTHER_NAME)
