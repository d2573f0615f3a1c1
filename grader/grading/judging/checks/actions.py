"""Checks on a student's action server, and on the states of a lifecycle node."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Annotated, Any, ClassVar, Literal

from grader.grading.judging.charts import Lanes, drawn_case, series
from grader.grading.judging.findings import (
    explain_fault,
    explain_no_message,
    faulted,
    first_fault,
    met,
    not_met,
    observed,
)
from grader.grading.judging.plots import Drawing
from grader.grading.judging.service_calls import LATENESS_NS, Call, calls_of, calls_of_node, status_of
from grader.grading.judging.values import (
    JITTER_NS,
    RuleOrValue,
    as_number,
    breach,
    broken_rules,
    goal_id,
    message_at,
    published,
    rules_text,
    shown_value,
    value_at,
)
from grader.grading.model.chart import Look, Panel, Tone
from grader.grading.model.exercise import Finding, ProblemKind, Roles
from grader.grading.model.wording import first_few, moment, nearest, number, quote, span
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.quantities import DurationNs, FieldOf, counted, seconds
from grader.runtime.model.trace import Message, Trace

_FINISH_HINTS = {
    "succeeded": "call goal_handle.succeed() before the result is returned",
    "canceled": "look at goal_handle.is_cancel_requested, then call goal_handle.canceled()",
    "aborted": "call goal_handle.abort() before the result is returned",
}


@dataclass(frozen=True, slots=True)
class ActionResult:
    """Every goal that was sent to a student's action server is accepted and ends with the status and result expected.

    Attributes:
        action: Action name as on the wire, e.g. `/fibonacci`.
        status: Status with which a goal must end; `rejected` for one that must not be accepted.
        result: What is expected by field path of the result: a value, or `{equals, items, tolerance, low, high,
            pattern, example}`.
        within: Longest time from the goal to its result; free if left out.
    """

    action: str
    status: Literal["succeeded", "canceled", "aborted", "rejected"] = "succeeded"
    result: Annotated[Mapping[str, RuleOrValue], FieldOf("action", "_Result")] = field(default_factory=dict)
    within: DurationNs | None = None

    @property
    def expected(self) -> str:
        result = f" with {rules_text(self.result)}" if self.result else ""
        within = "" if self.within is None else f" within {number(seconds(self.within))} s"
        return f"every goal for {self.action} {self.status}{result}{within}"

    def judge(self, trace: Trace) -> Finding:
        goals = calls_of(trace, f"{self.action}/_action/send_goal", "grader")
        if not goals:
            return explain_no_action(trace, self.action)
        results = calls_of(trace, f"{self.action}/_action/get_result", "grader")
        evidence = {"action": self.action, "goals": len(goals), "results": sum(r.response is not None for r in results)}
        for place, goal in enumerate(goals, 1):
            flaw, hint = self._flaw(trace, goal, results)
            if flaw:
                reason = f"{moment(goal.request.t_ns)}, {self.action}, goal {place}: {flaw}"
                return _unless_crashed(trace, not_met(reason, evidence, hint=hint), goal)
        reason = f"{self.action}: {counted(len(goals), 'goal')} {self.status}"
        return met(f"{reason}{', ' + rules_text(self.result) if self.result else ''}", evidence)

    def _flaw(self, trace: Trace, goal: Call, results: Sequence[Call]) -> tuple[str, str]:
        """Describe what is wrong with the end of a goal, and a hint; empty if nothing is."""
        if goal.response is None:
            return "no response to the goal", "spin the node, and return a GoalResponse from its goal callback"
        accepted = goal.response.value.get("accepted") is True
        if self.status == "rejected":
            return ("accepted, expected that it is rejected", "") if accepted else ("", "")
        if not accepted:
            return f"rejected, expected that it {_ends(self.status)}", "accept the goal: GoalResponse.ACCEPT"
        # By the id: results come in the order in which goals end, not in which they were sent.
        mine = next((r for r in results if goal_id(r.request.value) == goal_id(goal.request.value)), None)
        if mine is None or mine.response is None:
            running = self.within is not None and goal.request.t_ns + self.within >= trace.stop_ns
            # The request for the result was sent, so the server had accepted; it may still be at work.
            if mine is not None and running:
                raise HarnessError(f"{self.action}: the recording ends before the result is due")
            return f"no result in {span(trace.stop_ns - goal.request.t_ns)}", ""
        return self._result_flaw(trace, goal, mine)

    def _result_flaw(self, trace: Trace, goal: Call, mine: Call) -> tuple[str, str]:
        assert mine.response is not None
        took = mine.response.t_ns - goal.request.t_ns
        ended = status_of(mine.response)
        # The status before the content: a goal that was canceled has another result by right.
        if ended != self.status:
            return f"{ended}, expected that it {_ends(self.status)}", _FINISH_HINTS.get(self.status, "")
        result = mine.response.value.get("result")
        result = result if isinstance(result, Mapping) else {}
        wrong = broken_rules(result, self.result)
        if wrong:
            return f"in its result {breach(result, wrong[0], self.result[wrong[0]])}", ""
        if self.within is not None and took > self.within + LATENESS_NS[trace.clock]:
            return (
                f"its result took {seconds(took):.3f} s, expected within {number(seconds(self.within))} s",
                "",
            )
        return "", ""


@dataclass(frozen=True, slots=True)
class ActionFeedback:
    """While a goal runs, a student's action server publishes feedback: enough, with the right content, and growing.

    Attributes:
        action: Action name as on the wire.
        at_least: Fewest feedback messages for each goal.
        at_most: Most feedback messages for each goal; any number if left out.
        fields: Expected fields of each message by field path, as in `action_result`.
        grows: Field path of a number that rises, or of a list that gets longer, with each message.
        period: Average time expected from one message to the next; free if left out.
        tolerance: Largest difference of the average, as a share of the period.
    """

    action: str
    at_least: int = 1
    at_most: int | None = None
    fields: Annotated[Mapping[str, RuleOrValue], FieldOf("action", "_Feedback")] = field(default_factory=dict)
    grows: Annotated[str, FieldOf("action", "_Feedback")] | None = None
    period: DurationNs | None = None
    tolerance: float = 0.1

    @property
    def expected(self) -> str:
        grows = f", {self.grows} growing" if self.grows else ""
        each = f", in each {rules_text(self.fields)}" if self.fields else ""
        return f"feedback of {self.action}, at least {self.at_least} for each goal{grows}{each}"

    def judge(self, trace: Trace) -> Finding:
        goals = calls_of(trace, f"{self.action}/_action/send_goal", "grader")
        if not goals:
            return explain_no_action(trace, self.action)
        accepted = [g for g in goals if g.response is not None and g.response.value.get("accepted") is True]
        if not accepted:
            reason = f"{self.action}: none of {counted(len(goals), 'goal')} was accepted"
            return _unless_crashed(trace, not_met(reason, blocked_by="action_result"), goals[0])
        messages = published(trace, f"{self.action}/_action/feedback")
        counts = []
        for place, goal in enumerate(accepted, 1):
            mine = [m for m in messages if goal_id(m.value) == goal_id(goal.request.value)]
            counts.append(len(mine))
            # In this order: without messages there is no content, and with wrong content the pace does not matter.
            flaw = self._count_flaw(mine) or self._content_flaw(mine) or self._pace_flaw(mine)
            if flaw:
                evidence = {"goals": len(accepted), "feedback": counts}
                hint = "call goal_handle.publish_feedback(...) at each step" if not mine else ""
                finding = not_met(f"{self.action}, goal {place}: {flaw}", evidence, hint=hint)
                return _unless_crashed(trace, finding, goal)
        reason = f"{self.action}: {', '.join(map(str, counts[:10]))} messages of feedback"
        return met(reason, {"goals": len(accepted), "feedback": counts})

    def drawing(self, trace: Trace) -> Drawing:
        """Return what was sent and came, and the number or length that has to grow."""
        found = [(m, _size(m, self.grows)) for m in published(trace, f"{self.action}/_action/feedback") if self.grows]
        points = [(seconds(m.t_ns), size) for m, size in found if size is not None]
        if not points:
            return Drawing(action=self.action)
        dots = series(f"{self.grows} in the feedback", points, look=Look.DOTS)
        panel = Panel(f"{self.grows}, or its length", "", (dots,))
        return Drawing(action=self.action, panels=((panel, ""),))

    def _count_flaw(self, mine: Sequence[Message]) -> str:
        if self.at_least <= len(mine) and (self.at_most is None or len(mine) <= self.at_most):
            return ""
        most = "" if self.at_most is None else f" and at most {self.at_most}"
        return f"{counted(len(mine), 'message')} of feedback, expected at least {self.at_least}{most}"

    def _content_flaw(self, mine: Sequence[Message]) -> str:
        for message in mine:
            wrong = broken_rules(message_at(message.value, "feedback"), self.fields)
            if wrong:
                flaw = breach(message_at(message.value, "feedback"), wrong[0], self.fields[wrong[0]])
                return f"in the feedback at {moment(message.t_ns)} {flaw}"
        if self.grows is None:
            return ""
        for before, after in pairwise(mine):
            sizes = _size(before, self.grows), _size(after, self.grows)
            if sizes[0] is None or sizes[1] is None or not sizes[1] > sizes[0]:
                found = shown_value(_held(after, self.grows))
                return (
                    f"{self.grows} is {found} at {moment(after.t_ns)}, after {shown_value(_held(before, self.grows))}"
                )
        return ""

    def _pace_flaw(self, mine: Sequence[Message]) -> str:
        if self.period is None or len(mine) < 2:
            return ""
        average = (mine[-1].t_ns - mine[0].t_ns) / (len(mine) - 1)
        # The slack keeps the edge inside, which floating point would put outside now and then.
        if abs(average - self.period) <= self.tolerance * self.period * (1 + 1e-9):
            return ""
        wanted = f"{number(seconds(self.period))} s ± {number(100 * self.tolerance)} %"
        return f"one message every {average / 1e9:.3f} s on average, expected every {wanted}"


def _ends(status: str) -> str:
    return {"succeeded": "succeeds", "canceled": "is canceled", "aborted": "aborts"}.get(status, status)


def _held(message: Message, path: str) -> Any:
    return value_at(message_at(message.value, "feedback"), path)


def _size(message: Message, path: str | None) -> float | None:
    found = None if path is None else _held(message, path)
    return float(len(found)) if isinstance(found, (list, tuple, str)) else as_number(found)


def _unless_crashed(trace: Trace, finding: Finding, goal: Call) -> Finding:
    """Return the finding, or the fault after the goal was sent that explains it."""
    fault = first_fault(trace)
    # A fault before the goal did not keep the server from answering it, or there would be no such goal.
    if fault is None or fault.t_ns < goal.request.t_ns:
        return finding
    return faulted(fault, finding.reason, finding.evidence)


def explain_no_action(trace: Trace, action: str) -> Finding:
    """Return no credit with the reason why no goal could be sent to an action.

    Raises:
        HarnessError: Nothing prevented sending a goal.
    """
    if crashed := explain_fault(trace, f"no goal could be sent to {action}"):
        return crashed
    ends = [e.service for e in trace.service_ends("service")]
    seen = sorted({e.partition("/_action/")[0] for e in ends if "/_action/" in e})
    if action in seen:
        raise HarnessError(f"{action}: the recording sends no goal to it")
    near = nearest(action, seen) or (seen[0] if len(seen) == 1 else None)
    found = f"; seen: {first_few(seen)}" if seen else ""
    hint = f"name the action {action} instead of {quote(near)}" if near else ""
    reason = f"{action}: no action server in {observed(trace)}{found}"
    problem = ProblemKind.OTHER_NAME if seen else ProblemKind.ABSENT
    return not_met(reason, {"seen": seen[:20]}, hint=hint, problem=problem)


#: Numbers of lifecycle_msgs/msg/Transition -> label.
_TRANSITIONS = dict(enumerate(("configure", "cleanup", "activate", "deactivate", *("shutdown",) * 3), 1))
#: State after each transition.
_LEADS_TO = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": "finalized",
}


@dataclass(frozen=True, slots=True)
class LifecycleStates:
    """A lifecycle node makes every requested transition, reports the expected states, and publishes only while active.

    The scenario needs the stimuli `transition` and `state`.

    Attributes:
        states: The states that the node reports, in the order of the requests: `unconfigured`, `inactive`, `active` or
            `finalized`; not checked if left out.
        topic: Topic that the node publishes while active, and only then; not checked if left out.
        node: Fully qualified name of the node; the one that the stimuli address if left out.
    """

    roles: ClassVar[Roles] = Roles(speaks=("topic",))
    states: tuple[str, ...] = ()
    topic: str | None = None
    node: str | None = None

    @property
    def expected(self) -> str:
        states = f", reporting {', '.join(self.states)}" if self.states else ""
        topic = f", publishing {self.topic} only while active" if self.topic else ""
        return f"every transition made{states}{topic}"

    def judge(self, trace: Trace) -> Finding:
        changes, asked = (
            sorted(calls_of_node(trace, self.node, service), key=lambda call: call.request.t_ns)
            for service in ("change_state", "get_state")
        )
        if not changes and not asked:
            return self._never_asked(trace)
        evidence: dict[str, object] = {
            "transitions": [[seconds(c.request.t_ns), _label(c), _succeeded(c)] for c in changes],
            "states": [[seconds(c.request.t_ns), _state(c)] for c in asked],
        }
        flawed = self._transition_flaw(changes, evidence) or self._state_flaw(trace, asked, evidence)
        if flawed is not None:
            fault = first_fault(trace)
            return flawed if fault is None else faulted(fault, flawed.reason, evidence)
        if self.topic is not None:
            silent = self._publishing(trace, changes, evidence)
            if silent is not None:
                return silent
        told = ", ".join(_state(c) for c in asked) or "none requested"
        return met(f"{counted(len(changes), 'transition')} made; states: {told}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the requests for transitions and states, the messages, and the time in which the node is active."""
        changes, asked = (
            sorted(calls_of_node(trace, self.node, service), key=lambda call: call.request.t_ns)
            for service in ("change_state", "get_state")
        )
        if not changes and not asked:
            return Drawing()
        lanes = Lanes()
        lanes.add("transition")
        for name, tone, done in (("made", Tone.GOOD, True), ("not made", Tone.BAD, False)):
            lanes.dots(name, ((c.request.t_ns, _label(c)) for c in changes if _succeeded(c) is done), tone)
        lanes.add("state")
        lanes.dots("state", ((c.request.t_ns, quote(_state(c))) for c in asked), Tone.SECOND)
        if self.topic is not None:
            lanes.add(self.topic)
            lanes.dots(self.topic, ((m.t_ns, "") for m in published(trace, self.topic)), Tone.MAIN)
        said = f"Transitions: {first_few([_label(c) for c in changes], 8) or 'none'}; "
        said += f"states: {first_few([_state(c) for c in asked], 8) or 'none requested'}."
        cases = [drawn_case(a, b, "active", Tone.GOOD) for a, b in _active(changes, trace.stop_ns)]
        panels = ((lanes.panel(self.node or "the node"), said),)
        return Drawing(panels=panels, cases=tuple(cases), title="Transitions and states")

    def _transition_flaw(self, changes: Sequence[Call], evidence: dict[str, object]) -> Finding | None:
        for call in changes:
            if call.response is None:
                reason = f"{moment(call.request.t_ns)}: no response to the transition {_label(call)}"
                return not_met(reason, evidence, problem=ProblemKind.NO_ANSWER)
            if not _succeeded(call):
                reason = f"{moment(call.response.t_ns)}: the transition {_label(call)} failed"
                hint = "return TransitionCallbackReturn.SUCCESS from the callback of the transition"
                return not_met(reason, evidence, hint=hint, problem=ProblemKind.REFUSED)
        return None

    def _state_flaw(self, trace: Trace, asked: Sequence[Call], evidence: dict[str, object]) -> Finding | None:
        if not self.states:
            return None
        # Fewer requests than states: the recording ended early, or the rubric asks too rarely.
        if len(asked) < len(self.states):
            asked_said = f"the state was requested {len(asked)} times, expected {len(self.states)}"
            if crashed := explain_fault(trace, asked_said, evidence, last=True):
                return crashed
            raise HarnessError(asked_said)
        for call, wanted in zip(asked, self.states, strict=False):
            if _state(call) != wanted:
                reason = f"{moment(call.request.t_ns)}: the state is {quote(_state(call))}, expected {wanted}"
                return not_met(reason, evidence, problem=ProblemKind.WRONG_VALUE)
        return None

    def _publishing(self, trace: Trace, changes: Sequence[Call], evidence: dict[str, object]) -> Finding | None:
        """Return a finding if the node publishes while inactive, or does not while active; None otherwise."""
        topic = self.topic or ""
        jitter = JITTER_NS[trace.clock]
        spans = _active(changes, trace.stop_ns)
        times = [m.t_ns for m in published(trace, topic)]
        # On the wall clock, the response to a transition and a message may be recorded in the wrong order.
        stray = next((t for t in times if not any(a - jitter <= t <= b + jitter for a, b in spans)), None)
        if stray is not None:
            reason = f"{moment(stray)}, {topic}: a message while the node is not active"
            hint = "create the publisher with create_lifecycle_publisher, and call super().on_activate(state)"
            return not_met(
                reason, evidence | {"first_stray_s": seconds(stray)}, hint=hint, problem=ProblemKind.TOO_MANY
            )
        # In every interval: a node that publishes after its first activation only has lost its timer or publisher.
        mute = next(((a, b) for a, b in spans if not any(a <= t <= b for t in times)), None)
        if mute is None:
            return None
        if not times:
            return explain_no_message(trace, topic)
        reason = f"{topic}: no message while active from {moment(mute[0])} to {moment(mute[1])}"
        return not_met(reason, evidence, problem=ProblemKind.SILENT)

    def _never_asked(self, trace: Trace) -> Finding:
        if crashed := explain_fault(trace, "no transition could be requested"):
            return crashed
        nodes = list(dict.fromkeys(n for graph in trace.graphs() for n in graph.nodes))
        if self.node is not None and self.node not in nodes:
            reason, problem = f"{self.node}: not in the ROS graph", ProblemKind.OTHER_NAME
            return not_met(reason, {"nodes": nodes[:20]}, blocked_by="node_name", problem=problem)
        # A lifecycle node was there, so that the scenario lacks its stimuli.
        if any(e.service.endswith("/change_state") for e in trace.service_ends("service")):
            raise HarnessError("the recording requests neither a transition nor a state")
        reason = "the program has no lifecycle node, so no transition can be requested"
        return not_met(reason, hint="derive it from rclpy.lifecycle.Node", problem=ProblemKind.ABSENT)


def _label(call: Call) -> str:
    transition = call.request.value.get("transition")
    if not isinstance(transition, Mapping):
        return "?"
    label, number = transition.get("label"), transition.get("id")
    # The label decides, as in the request itself: shutdown has three numbers.
    if isinstance(label, str) and label:
        return quote(label, 30)
    return _TRANSITIONS.get(number, "?") if isinstance(number, int) else "?"


def _succeeded(call: Call) -> bool:
    return call.response is not None and call.response.value.get("success") is True


def _state(call: Call) -> str:
    told = {} if call.response is None else call.response.value
    return str(value_at(told, "current_state.label", "unknown"))


def _active(changes: Sequence[Call], stop_ns: int) -> list[tuple[int, int]]:
    """Return the intervals in which the node is active; the time of a transition itself is left out."""
    spans: list[tuple[int, int]] = []
    since: int | None = None
    for call in changes:
        if call.response is None:
            continue
        state = _LEADS_TO.get(_label(call), "")
        if state == "active" and since is None:
            since = call.request.t_ns
        elif state != "active" and since is not None:
            spans.append((since, call.response.t_ns))
            since = None
    return [*spans, (since, stop_ns)] if since is not None else spans
