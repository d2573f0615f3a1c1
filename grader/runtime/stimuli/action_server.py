"""An action server that the student's client sends goals."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import field
from typing import Annotated, Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.quantities import NS_PER_MS, ActionType, Kind, Topic, counted
from grader.runtime.model.scenario import Content, Event, FieldsItem, Planned, Stimulus, Time, longest, shortest
from grader.runtime.stimuli.drawing import Draws, Fields, drawn_fields, drawn_time, in_drawn_order, planned_as
from grader.runtime.stimuli.phrases import time_phrase

#: The shortest time between two messages of feedback.
SHORTEST_FEEDBACK_NS = 10 * NS_PER_MS


@dataclass(frozen=True, slots=True)
class PlannedGoalAnswer:
    """What is done with a goal, with every value drawn."""

    accepts: bool
    feedback_every_ns: int
    result_after_ns: int
    aborts: bool


@dataclass(frozen=True, slots=True)
class PlannedActionServer(Planned):
    """An action server with every value drawn."""

    holds: ClassVar[tuple[Content, ...]] = (
        Content("feedback", "action", "Feedback"),
        Content("results", "action", "Result"),
    )

    action: str
    type: str
    start_ns: int
    goals: tuple[PlannedGoalAnswer, ...]
    feedback: tuple[Fields, ...]
    results: tuple[Fields, ...]
    preempts: bool

    @property
    def place(self) -> str:
        """What it is in a message about a mistake in it."""
        return f"action server of {self.action}"

    def events(self) -> Iterator[Event]:
        """Yield when it appears; the rest follows from what the client asks."""
        yield AddAction(self.start_ns, self)


@dataclass(frozen=True, slots=True)
class AddAction(Event):
    """Offer an action."""

    creates: ClassVar[bool] = True

    server: PlannedActionServer


@dataclass(frozen=True, slots=True)
class Attend(Event):
    """Attend to an action that is offered: to a request to a part of it, or because its time has come."""

    action: str
    part: str = ""
    number: int = 0
    request: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class GoalAnswer:
    """What an action server does with a goal."""

    accepts: bool = True
    feedback_every: Time = 0
    result_after: Time = 0
    aborts: bool = False


@dataclass(frozen=True, slots=True)
class ActionServer(Stimulus):
    """A stimulus: an action server for the student's client.

    A goal that the client cancels ends as canceled. In the trace it appears as calls of the action's services,
    `/NAME/_action/send_goal`, `get_result` and `cancel_goal`, and feedback as the grader's messages on
    `/NAME/_action/feedback`.
    """

    key: ClassVar[str] = "action_server"
    becomes = PlannedActionServer
    shown: ClassVar[Mapping[str, Any]] = {"goals": None, "feedback": None, "results": None}

    action: Topic  # absolute name
    type: ActionType  # e.g. `nav2_msgs/action/NavigateToPose`
    start_ns: Time = 0  # when it appears
    goals: Annotated[
        tuple[GoalAnswer, ...],
        "what it does with each goal in order, the last also with further ones; it accepts and succeeds if left out",
    ] = (GoalAnswer(),)
    feedback: Annotated[
        tuple[FieldsItem, ...],
        Kind("messages, or none"),
        "fields of each feedback of a goal in order; the last one is repeated",
    ] = field(default=(), hash=False)
    results: Annotated[
        tuple[FieldsItem, ...],
        Kind("messages, or none"),
        "fields of the result of each goal in order; the last one is repeated",
    ] = field(default=(), hash=False)
    preempts: Annotated[bool, "whether a goal that is accepted aborts the one before it, as Nav2 does"] = False

    def planned(self, draws: Draws) -> PlannedActionServer:
        """Draw every time and every field."""
        return planned_as(
            PlannedActionServer,
            self,
            start_ns=drawn_time(self.start_ns, draws.own),
            goals=tuple(
                PlannedGoalAnswer(
                    one.accepts,
                    drawn_time(one.feedback_every, draws.own),
                    drawn_time(one.result_after, draws.own),
                    one.aborts,
                )
                for one in self.goals
            ),
            feedback=tuple(drawn_fields(one, draws.own) for one in in_drawn_order(self.feedback, draws.own)),
            results=tuple(drawn_fields(one, draws.own) for one in in_drawn_order(self.results, draws.own)),
        )

    def mistakes(self) -> Iterator[tuple[str, str]]:
        """Yield what is wrong with the answers to goals."""
        if not self.goals:
            yield "goals", "expected a list with at least one entry, found an empty one"
        for one in self.goals:
            if longest(one.feedback_every) > 0 and shortest(one.feedback_every) < SHORTEST_FEEDBACK_NS:
                yield "goals", "expected at least 10 ms from one feedback to the next, found less"
            if not one.accepts and one != GoalAnswer(accepts=False):
                yield "goals", "expected nothing else of a goal that is not accepted, found more"

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        refused = sum(not one.accepts for one in self.goals)
        aborted = sum(one.aborts for one in self.goals)
        parts = [f"refuses {counted(refused, 'goal')}"] if refused else []
        parts += [f"aborts {counted(aborted, 'goal')}"] if aborted else []
        then = f", which {' and '.join(parts)}" if parts else ""
        return f"the grader offers the action {self.action} from {time_phrase(self.start_ns)} on{then}"
