"""The check on a lifecycle node: its states, its transitions, and that it keeps still while it is not active."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from grader.core.errors import HarnessError
from grader.core.exercise import Finding
from grader.core.quantities import seconds
from grader.core.trace import Request, Trace
from grader.judging.findings import met, not_met
from grader.judging.paths import NoSuchField, at_path
from grader.judging.services import Call, calls_of
from grader.judging.silence import explain_no_message, fault_hint, first_fault
from grader.judging.values import JITTER_NS, published
from grader.judging.wording import counted, fault_sentence, moment, quote

#: Numbers of lifecycle_msgs/msg/Transition -> label.
_TRANSITIONS: Mapping[int, str] = {
    1: "configure",
    2: "cleanup",
    3: "activate",
    4: "deactivate",
    5: "shutdown",
    6: "shutdown",
    7: "shutdown",
}
#: Where a transition leads.
_LEADS_TO = {
    "configure": "inactive",
    "activate": "active",
    "deactivate": "inactive",
    "cleanup": "unconfigured",
    "shutdown": "finalized",
}


@dataclass(frozen=True, slots=True)
class LifecycleStates:
    """A lifecycle node makes every transition it is asked for, tells the states expected, and publishes only if active.

    The scenario has to ask: `transition` and `state`.

    Attributes:
        states: The states that it tells, in the order in which it was asked: `unconfigured`, `inactive`, `active` or
            `finalized`; not looked at if left out.
        topic: Topic that it publishes while active, and not otherwise; not looked at if left out.
        node: Fully qualified name of the node; the one that was asked if left out.
    """

    states: tuple[str, ...] = ()
    topic: str | None = None
    node: str | None = None

    @property
    def expected(self) -> str:
        """What is expected, in one phrase."""
        states = f", telling {', '.join(self.states)}" if self.states else ""
        topic = f", publishing {self.topic} only while active" if self.topic else ""
        return f"every transition made{states}{topic}"

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if all of that holds; the reason names the first moment at which it does not."""
        changes, asked = self._calls(trace, "change_state"), self._calls(trace, "get_state")
        if not changes and not asked:
            return self._never_asked(trace)
        evidence = {
            "transitions": [[seconds(c.request.t_ns), _label(c), _succeeded(c)] for c in changes],
            "states": [[seconds(c.request.t_ns), _state(c)] for c in asked],
        }
        flaw = self._transition_flaw(changes) or self._state_flaw(asked)
        if flaw:
            return self._explain(trace, flaw, evidence)
        if self.topic is not None:
            silent = self._publishing(trace, changes, evidence)
            if silent is not None:
                return silent
        told = ", ".join(_state(c) for c in asked) or "none asked for"
        return met(f"{counted(len(changes), 'transition')} made; states: {told}", evidence)

    def _calls(self, trace: Trace, service: str) -> list[Call]:
        asked = (r.service for r in trace.of(Request) if r.sender == "grader" and r.service.endswith(f"/{service}"))
        names = [name for name in dict.fromkeys(asked) if self.node in (None, name.rpartition("/")[0])]
        return sorted((c for n in names for c in calls_of(trace, n, "grader")), key=lambda c: c.request.t_ns)

    def _transition_flaw(self, changes: Sequence[Call]) -> str:
        for call in changes:
            if call.response is None:
                return f"{moment(call.request.t_ns)}: no answer to the transition {_label(call)}"
            if not _succeeded(call):
                return f"{moment(call.response.t_ns)}: the transition {_label(call)} failed"
        return ""

    def _state_flaw(self, asked: Sequence[Call]) -> str:
        if not self.states:
            return ""
        if len(asked) < len(self.states):
            raise HarnessError(f"the state was asked for {len(asked)} times, expected {len(self.states)}")
        for call, wanted in zip(asked, self.states, strict=False):
            if _state(call) != wanted:
                return f"{moment(call.request.t_ns)}: the state is {quote(_state(call))}, expected {wanted}"
        return ""

    def _publishing(self, trace: Trace, changes: Sequence[Call], evidence: dict[str, Any]) -> Finding | None:
        """Return that it speaks out of turn or is mute when active; None if neither."""
        topic = self.topic or ""
        jitter = JITTER_NS[trace.clock]
        spans = _active(changes, trace.stop_ns)
        times = [m.t_ns for m in published(trace, topic)]
        stray = next((t for t in times if not any(a - jitter <= t <= b + jitter for a, b in spans)), None)
        if stray is not None:
            reason = f"{moment(stray)}, {topic}: a message though the node is not active"
            hint = "create the publisher with create_lifecycle_publisher, and call super().on_activate(state)"
            return not_met(reason, evidence | {"first_stray_s": seconds(stray)}, hint=hint)
        mute = next(((a, b) for a, b in spans if not any(a <= t <= b for t in times)), None)
        if mute is None:
            return None
        if not times:
            return explain_no_message(trace, topic)
        return not_met(f"{topic}: no message while active from {moment(mute[0])} to {moment(mute[1])}", evidence)

    def _explain(self, trace: Trace, flaw: str, evidence: dict[str, Any]) -> Finding:
        fault = first_fault(trace)
        if fault is None:
            hint = "return TransitionCallbackReturn.SUCCESS from the callback of the transition"
            return not_met(flaw, evidence, hint=hint if "failed" in flaw else "")
        return not_met(f"{fault_sentence(fault)}; {flaw}", evidence, hint=fault_hint(fault), fault=fault)

    def _never_asked(self, trace: Trace) -> Finding:
        fault = first_fault(trace)
        if fault is not None:
            reason = f"{fault_sentence(fault)}; no transition could be asked for"
            return not_met(reason, hint=fault_hint(fault), fault=fault)
        nodes = list(dict.fromkeys(n for graph in trace.graphs() for n in graph.nodes))
        if self.node is not None and self.node not in nodes:
            return not_met(f"{self.node}: not in the ROS graph", {"nodes": nodes[:20]}, blocked_by="node_name")
        if any(e.service.endswith("/change_state") for e in trace.service_ends("service")):
            raise HarnessError("the recording asks for no transition and no state")
        hint = "derive it from rclpy.lifecycle.Node"
        return not_met("no node of the program can be asked for a transition: none has a lifecycle", hint=hint)


def _label(call: Call) -> str:
    transition = call.request.value.get("transition")
    if not isinstance(transition, Mapping):
        return "?"
    label, number = transition.get("label"), transition.get("id")
    if isinstance(label, str) and label:
        return quote(label, 30)
    return _TRANSITIONS.get(number, "?") if isinstance(number, int) else "?"


def _succeeded(call: Call) -> bool:
    return call.response is not None and call.response.value.get("success") is True


def _state(call: Call) -> str:
    if call.response is None:
        return "not told"
    try:
        return str(at_path(call.response.value, "current_state.label"))
    except NoSuchField:
        return "not told"


def _active(changes: Sequence[Call], stop_ns: int) -> list[tuple[int, int]]:
    """Return the spans of time in which the node is active; what is asked and answered at their edges is in doubt."""
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
