"""A goal for the student's action server."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import ActionType, Topic, duration
from grader.runtime.model.scenario import Content, Event, Fields, Planned, Stimulus, Time, TimeOrNever
from grader.runtime.stimuli.calls import AddClients, Ask, PlannedCall, PlannedCalls
from grader.runtime.stimuli.drawing import Draws, drawn_fields, drawn_time, planned_as
from grader.runtime.stimuli.phrases import time_phrase


@dataclass(frozen=True, slots=True)
class PlannedGoal(Planned):
    """A goal with every field drawn, and its goal id."""

    holds: ClassVar[tuple[Content, ...]] = (Content("goal", "action", "Goal"),)

    action: str
    type: str
    start_ns: int
    cancel_after_ns: int
    goal: Mapping[str, Any]
    uuid: tuple[int, ...]

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in it."""
        return f"goal of {self.action}"

    def events(self) -> Iterator[Event]:
        """Yield the clients of the action, and the request that sends the goal."""
        call = goal_call(self)
        for part in (call, *(following for _, following in call.then)):
            yield AddClients(self.start_ns, part.calls)
        yield Ask(self.start_ns, call)


def goal_call(goal: PlannedGoal) -> PlannedCall:
    """Return the request that sends a goal, with the requests that follow: for its result, and perhaps to cancel it."""
    name, identity = f"{goal.action}/_action", {"uuid": list(goal.uuid)}

    def once(service: str, interface: str, request: Mapping[str, Any]) -> PlannedCalls:
        return PlannedCalls(f"{name}/{service}", interface, goal.start_ns, 1, 1, (request,))

    then = [(0, PlannedCall(once("get_result", f"{goal.type}_GetResult", {"goal_id": identity}), 0))]
    if goal.cancel_after_ns:
        asked = once("cancel_goal", "action_msgs/srv/CancelGoal", {"goal_info": {"goal_id": identity}})
        then.append((goal.cancel_after_ns, PlannedCall(asked, 0)))
    sent = once("send_goal", f"{goal.type}_SendGoal", {"goal_id": identity, "goal": goal.goal})
    return PlannedCall(sent, 0, tuple(then))


@dataclass(frozen=True, slots=True)
class ActionGoal(Stimulus):
    """A stimulus: a goal for the student's action server, which may be cancelled later.

    In the trace it appears as calls of the action's services, `/NAME/_action/send_goal`, `get_result` and
    `cancel_goal`; feedback and status are messages on `/NAME/_action/feedback` and `/NAME/_action/status`.
    """

    key: ClassVar[str] = "goal"
    becomes = PlannedGoal
    shown: ClassVar[Mapping[str, Any]] = {"goal": {}, "cancel_after": None}

    action: Topic  # absolute name
    type: ActionType  # e.g. `test_msgs/action/Fibonacci`
    goal: Fields = field(hash=False)  # fields of the goal
    start_ns: Time = 0  # when the client appears and sends the goal; it waits for the server, as a real client does
    cancel_after_ns: TimeOrNever = 0  # time from the acceptance of the goal to the request to cancel it; 0 for never

    def planned(self, draws: Draws) -> PlannedGoal:
        """Draw every field, and the goal's id."""
        start_ns, asked = drawn_time(self.start_ns, draws.own), drawn_fields(self.goal, draws.own)
        return planned_as(PlannedGoal, self, start_ns=start_ns, goal=asked, uuid=tuple(draws.own.randbytes(16)))

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        then = f", and cancels it {duration(self.cancel_after_ns)} later" if self.cancel_after_ns else ""
        return f"a client of the grader's sends {self.action} a goal at {time_phrase(self.start_ns)}{then}"
