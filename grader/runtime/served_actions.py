"""Actions that the grader offers, for a rubric or a test: what steps or a function do with each goal.

Nothing here sends or waits: `attend` returns what is to be done at a moment, and when to come back.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Mapping, Sequence
from dataclasses import field
from enum import IntEnum
from types import GeneratorType
from typing import Any

from grader.runtime.message_classes import built, message_class, plain_fields, wanted_class
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_S, is_number
from grader.runtime.simulation import Moment
from grader.runtime.stimuli.action_server import PlannedActionServer


class GoalRejected(Exception):  # noqa: N818 - reads as what happened
    """Raised by what answers a goal of an action that a test offers: refuse it."""


class GoalAborted(Exception):  # noqa: N818 - the same
    """Raised by what answers a goal: abort it.

    Attributes:
        result: The result, an object of its class; None for its default values.
    """

    def __init__(self, result: Any = None) -> None:
        super().__init__()
        self.result = result


class GoalCanceled(Exception):  # noqa: N818 - the same
    """Raised in the generator that answers a goal, at its pause, when the goal is cancelled.

    Attributes:
        result: The result, as above, if the generator raises it itself.
    """

    def __init__(self, result: Any = None) -> None:
        super().__init__()
        self.result = result


#: The services of an action with their types, by the type of the action; and its topics, with whether they are latched.
PARTS_OF_ACTIONS = {
    "send_goal": "{}_SendGoal",
    "cancel_goal": "action_msgs/srv/CancelGoal",
    "get_result": "{}_GetResult",
}
STATUS_TYPE = "action_msgs/msg/GoalStatusArray"
TOPICS_OF_ACTIONS = {"feedback": ("{}_FeedbackMessage", False), "status": (STATUS_TYPE, True)}


class GoalState(IntEnum):
    """What has become of a goal, as in action_msgs/msg/GoalStatus; it is executed as soon as it is accepted."""

    UNKNOWN = 0
    EXECUTING = 2
    CANCELING = 3
    SUCCEEDED = 4
    CANCELED = 5
    ABORTED = 6


#: The codes of an answer to a request to cancel, as in action_msgs/srv/CancelGoal: of goals that are being cancelled,
#: of none that is known, of one that has ended.
CANCELING, UNKNOWN_GOAL, ENDED = 0, 2, 3
#: More steps without a pause are an endless loop in what answers a goal, which would never return.
MOST_STEPS = 100_000
#: A status names the goals whose status changed last, up to this number. A server of ROS names all that it has not
#: forgotten, which costs the square of their number with a client that sends without end; a client reads a status only
#: for what has changed.
MOST_TOLD = 20
#: What each step of a goal is: seconds to let pass, or a feedback to publish.
Steps = Generator[Any, None, Any]


@dataclass
class _Goal:
    """A goal that was accepted.

    Attributes:
        uuid: Its id.
        stamp_ns: When it was accepted, in nanoseconds since 1970.
        steps: What goes on with it.
        status: What has become of it.
        wake_ns: When it goes on, since the run began; None when it has ended.
        result: Its result, as fields, once it has ended.
        asked: The numbers of the requests for its result that are open.
        is_accepted: Whether it can no longer be refused.
    """

    uuid: tuple[int, ...]
    stamp_ns: int
    steps: Steps
    status: GoalState = GoalState.EXECUTING
    wake_ns: int | None = None
    result: Mapping[str, Any] = field(default_factory=dict)
    asked: list[int] = field(default_factory=list)
    is_accepted: bool = False


class ServedAction:
    """An action, with its goals.

    Args:
        name: Its name.
        type: Its type.
        answer: See `World.serve_action`.
        preempts: Whether a goal that is accepted aborts the one before it.
    """

    def __init__(
        self,
        name: str,
        type: str,  # noqa: A002
        answer: Callable[[Any], Any] | Sequence[Any],
        *,
        preempts: bool = False,
    ) -> None:
        self.name = name
        self.type = type
        self.answer = answer
        self.preempts = preempts
        self._kind = wanted_class(type, "action", name)
        self._goals: dict[tuple[int, ...], _Goal] = {}
        self._going: dict[tuple[int, ...], _Goal] = {}
        self._told: dict[tuple[int, ...], _Goal] = {}
        self._back_ns = -1
        self._does: list[tuple[str, int, Any]] = []

    def attend(self, now: Moment, part: str, number: int, request: Mapping[str, Any]) -> dict[str, Any]:
        """Return what is done at a moment, and when to come back.

        It is in order: for a service its name, the number of the request and the fields of the response; for a topic
        its name, 0 and the message.

        Args:
            now: The moment.
            part: What was asked: `send_goal`, `cancel_goal` or `get_result`; empty if time has passed.
            number: The number of the request.
            request: Its fields.
        """
        self._does = []
        if part == "send_goal":
            self._begin(now, number, request)
        elif part == "cancel_goal":
            self._cancel(now, number, request["goal_info"])
        elif part == "get_result":
            self._ask_for_result(number, tuple(request["goal_id"]["uuid"]))
        else:
            for goal in [one for one in self._going.values() if one.wake_ns is not None and one.wake_ns <= now.t_ns]:
                self._go_on(goal, now, lambda one=goal: next(one.steps))  # type: ignore[misc]
        return {"does": self._does, "wakes_ns": self._wakes_ns(now)}

    def _wakes_ns(self, now: Moment) -> list[int]:
        """Return when to come back; empty if that was said before, or for no goal: else each request adds a visit."""
        wakes = [one.wake_ns for one in self._going.values() if one.wake_ns is not None and one.wake_ns > now.t_ns]
        if not wakes or now.t_ns < self._back_ns <= min(wakes):
            return []
        self._back_ns = min(wakes)
        return [self._back_ns]

    def _begin(self, now: Moment, number: int, request: Mapping[str, Any]) -> None:
        wanted = built(self._kind.Goal, request["goal"], self.name)
        uuid = tuple(request["goal_id"]["uuid"])
        goal = _Goal(uuid, now.clock_ns, self._steps(wanted))
        before, self._does = self._does, []
        try:
            self._goals[uuid] = goal
            self._go_on(goal, now, lambda: next(goal.steps))
        except GoalRejected:
            del self._goals[uuid]
            self._does = [*before, ("send_goal", number, {"accepted": False})]
            return
        goal.is_accepted = True
        accepted = {"accepted": True, "stamp": _time(now.clock_ns)}
        self._does = [*before, ("send_goal", number, accepted), *self._does]
        if goal.wake_ns is not None:
            self._tell_status(goal)
        if self.preempts:
            for other in [one for one in self._going.values() if one is not goal]:
                self._go_on(other, now, lambda one=other: one.steps.throw(GoalAborted()))  # type: ignore[misc]

    def _steps(self, goal: Any) -> Steps:
        """Go through what answers a goal; return the result."""
        made = self.answer(goal) if callable(self.answer) else self.answer
        if isinstance(made, GeneratorType):
            return (yield from made)
        if not isinstance(made, (list, tuple)):
            return made
        for step in made:
            if isinstance(step, BaseException) or (isinstance(step, type) and issubclass(step, BaseException)):
                raise step
            if isinstance(step, self._kind.Result):
                return step
            yield step
        return None

    def _go_on(self, goal: _Goal, now: Moment, move: Callable[[], Any]) -> None:
        """Let a goal go on until it waits, or ends."""
        try:
            step = move()
            for _ in range(MOST_STEPS):
                if isinstance(step, self._kind.Feedback):
                    message = self._kind.Impl.FeedbackMessage(feedback=step)
                    message.goal_id.uuid = list(goal.uuid)
                    self._publish("feedback", message)
                elif pause_ns := self._pause_ns(step):
                    goal.wake_ns = now.t_ns + pause_ns
                    self._going[goal.uuid] = goal
                    return
                step = next(goal.steps)
            raise RuntimeError(f"{self.name}: expected a pause, found {MOST_STEPS:,} steps at one moment")
        except StopIteration as end:
            status = GoalState.CANCELED if goal.status is GoalState.CANCELING else GoalState.SUCCEEDED
            result = end.value
        except GoalCanceled as end:
            status, result = GoalState.CANCELED, end.result
        except GoalAborted as end:
            status, result = GoalState.ABORTED, end.result
        except GoalRejected as late:
            if goal.is_accepted:
                text = "a goal can be refused before the first pause only; after it, raise GoalAborted"
                late.args = (f"{self.name}: {text}",)
            raise
        self._end(goal, status, result)

    def _pause_ns(self, step: Any) -> int:
        """Return how long a step lasts; raises TypeError if it is not a step."""
        if not is_number(step) or not 0 <= step < math.inf:
            raise TypeError(f"{self.name}: expected seconds, or a {self.type} feedback, as a step, found {step!r}")
        return round(float(step) * NS_PER_S)

    def _end(self, goal: _Goal, status: GoalState, result: Any) -> None:
        result = self._kind.Result() if result is None else result
        if not isinstance(result, self._kind.Result):
            found = type(result).__name__
            raise TypeError(f"{self.name}: expected a result of {self.type}, found {found}")
        goal.status, goal.wake_ns, goal.result = status, None, plain_fields(result)
        self._going.pop(goal.uuid, None)
        self._tell_status(goal)
        asked, goal.asked = goal.asked, []
        for number in asked:
            self._ask_for_result(number, goal.uuid)

    def _ask_for_result(self, number: int, uuid: tuple[int, ...]) -> None:
        goal = self._goals.get(uuid)
        if goal is None:
            self._does.append(("get_result", number, {"status": int(GoalState.UNKNOWN)}))
        elif goal.wake_ns is None:
            self._does.append(("get_result", number, {"status": int(goal.status), "result": goal.result}))
        else:
            goal.asked.append(number)

    def _cancel(self, now: Moment, number: int, info: Mapping[str, Any]) -> None:
        """Cancel the goal of an id, those until a time, or all: as the service of an action says."""
        uuid = tuple(info["goal_id"]["uuid"])
        until_ns = info["stamp"]["sec"] * NS_PER_S + info["stamp"]["nanosec"]
        named = any(uuid)
        found = [
            one
            for one in self._goals.values()
            if (named and one.uuid == uuid) or (until_ns and one.stamp_ns <= until_ns) or not (named or until_ns)
        ]
        going = [one for one in found if one.wake_ns is not None]
        code = CANCELING if going or not named else ENDED if found else UNKNOWN_GOAL
        infos = [_info(one) for one in going]
        self._does.append(("cancel_goal", number, {"return_code": code, "goals_canceling": infos}))
        for goal in going:
            goal.status = GoalState.CANCELING
        if going:
            self._tell_status(*going)
        for goal in going:
            self._go_on(goal, now, lambda one=goal: one.steps.throw(GoalCanceled()))  # type: ignore[misc]

    def _tell_status(self, *changed: _Goal) -> None:
        for goal in changed:
            self._told.pop(goal.uuid, None)
            self._told[goal.uuid] = goal
        self._told = dict(list(self._told.items())[-MOST_TOLD:])
        known = [{"goal_info": _info(one), "status": int(one.status)} for one in self._told.values()]
        self._publish("status", built(message_class(STATUS_TYPE), {"status_list": known}, self.name))

    def _publish(self, topic: str, message: Any) -> None:
        self._does.append((topic, 0, message))


def planned_action(planned: PlannedActionServer) -> ServedAction:
    """Return the action of a plan, whose goals are answered in turn, as it says."""
    kind = wanted_class(planned.type, "action", planned.action)
    place = 0

    def steps(_: Any) -> Steps:
        nonlocal place
        number, place = place, place + 1
        wanted = planned.goals[min(number, len(planned.goals) - 1)]
        if not wanted.accepts:
            raise GoalRejected
        left_ns, every_ns, told = wanted.result_after_ns, wanted.feedback_every_ns, 0
        while 0 < every_ns < left_ns:
            yield every_ns / NS_PER_S
            fields = planned.feedback[min(told, len(planned.feedback) - 1)] if planned.feedback else {}
            yield built(kind.Feedback, fields, planned.action)
            left_ns, told = left_ns - every_ns, told + 1
        yield left_ns / NS_PER_S
        fields = planned.results[min(number, len(planned.results) - 1)] if planned.results else {}
        result = built(kind.Result, fields, planned.action)
        if wanted.aborts:
            raise GoalAborted(result)
        return result

    return ServedAction(planned.action, planned.type, steps, preempts=planned.preempts)


def _info(goal: _Goal) -> dict[str, Any]:
    """Return the fields of a goal's action_msgs/msg/GoalInfo."""
    return {"goal_id": {"uuid": list(goal.uuid)}, "stamp": _time(goal.stamp_ns)}


def _time(t_ns: int) -> dict[str, int]:
    return {"sec": t_ns // NS_PER_S, "nanosec": t_ns % NS_PER_S}
