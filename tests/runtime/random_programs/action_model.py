"""Says what the servers and clients of actions must do, in the model of a random program.

rclpy makes each of them one waitable. An executor goes through all waitables that are ready before anything else. A
waitable takes one message of each of its queues that had any when the executor looked, and handles them in an order of
its own. What an execute callback does is a task, which belongs to no callback group.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from model_parts import Entity, FutureModel, Leave, Queue, ReturnedError, Scope, Steps, Task, nothing
from program_description import (
    MOST_IN_ACTION,
    OF_CANCELLING,
    OF_STATUS,
    ActionClient,
    ActionServer,
    CancelGoal,
    Ending,
    Finish,
    SendGoal,
    Statement,
)

if TYPE_CHECKING:
    from program_model import NodeModel

#: The states of a goal, as in action_msgs/msg/GoalStatus.
ACCEPTED, EXECUTING, CANCELING, SUCCEEDED, CANCELED, ABORTED = range(1, 7)
#: The return codes of action_msgs/srv/CancelGoal that one can get.
NO_ERROR, TERMINATED = 0, 3
#: How many messages the queues of an action hold, but for its status.
DEPTH = 10


def small(number: int) -> int:
    """Keep a number in the range of what actions carry."""
    return max(-MOST_IN_ACTION, min(number, MOST_IN_ACTION))


@dataclass(eq=False, slots=True)
class Goal:
    """One goal, on both sides."""

    client: ClientModel
    order: int
    #: What its client does with feedback; rclpy forgets it when the result is there.
    hears: Callable[[int], Steps] | None = None
    status: int = 0
    result: FutureModel = field(default_factory=lambda: FutureModel(callbacks=[]))

    @property
    def is_active(self) -> bool:
        return self.status in (ACCEPTED, EXECUTING, CANCELING)


class WaitableModel:
    """The queues of one side of an action.

    Args:
        owner: The node.
        end: The server or client.
        depths: For each queue, in the order in which they are handled, how many messages it holds.
    """

    def __init__(self, owner: NodeModel, end: ActionServer | ActionClient, depths: dict[str, int]) -> None:
        self.owner, self.process, self.world, self.end = owner, owner.process, owner.world, end
        self.queues = {part: Queue(self, owner.process, deque(maxlen=depth)) for part, depth in depths.items()}
        for part, queue in self.queues.items():
            self.world.acting.setdefault((end.action, part), []).append(queue)
        self.found: list[str] = []
        self.entity = Entity(owner.groups[end.group], self.look, self.take)

    def look(self) -> bool:
        """Note which queues have messages, and return whether any has."""
        self.found = [part for part, queue in self.queues.items() if queue.messages]
        return bool(self.found)

    def take(self) -> Steps:
        """Take one message of each of these, and return how they are handled."""
        taken = [(part, self.queues[part].messages.popleft()) for part in self.found if self.queues[part].messages]

        def steps() -> Steps:
            for part, message in taken:
                yield from getattr(self, part)(*message)

        return steps()

    def send(self, part: str, *message: Any) -> Steps:
        """Send a message to all queues of this kind."""
        yield from self.process.send(lambda: self.deliver(part, message))

    def deliver(self, part: str, message: tuple[Any, ...]) -> None:
        for queue in self.world.acting.get((self.end.action, part), ()):
            queue.put(message)


class ServerModel(WaitableModel):
    """The server of an action."""

    end: ActionServer

    def __init__(self, owner: NodeModel, end: ActionServer) -> None:
        super().__init__(owner, end, {"requested": DEPTH, "to_cancel": DEPTH, "asked": DEPTH})
        #: The goals that were accepted; rcl keeps them for 15 minutes after their end.
        self.goals: list[Goal] = []

    def requested(self, goal: Goal, future: FutureModel) -> Steps:
        """Accept a goal, unless its number is negative."""
        accepted = goal.order >= 0
        if accepted:
            goal.status = ACCEPTED
            self.goals.append(goal)
        yield from self.answer("answered", goal, future, int(accepted))
        if not accepted:
            return
        yield from self.move(goal, ACCEPTED)
        yield from self.move(goal, EXECUTING)
        self.add_task(self.run(goal))

    def to_cancel(self, goal: Goal, future: FutureModel) -> Steps:
        """Answer a request to cancel."""
        code, count = TERMINATED, 0
        if goal.status in (ACCEPTED, EXECUTING):
            code = NO_ERROR
            yield from self.process.say(f"{self.end.name}.cancel {goal.order}")
            if self.end.cancels:
                count = 1
                yield from self.move(goal, CANCELING)
        yield from self.answer("cancelled", goal, future, OF_CANCELLING * count + code)

    def asked(self, goal: Goal, future: FutureModel) -> Steps:
        """Send the result, now or when it is there."""
        if goal.result.done:
            self.add_task(self.send_result(goal, future))
        else:
            goal.result.callbacks.append(lambda: self.send_result(goal, future))
        yield from nothing()

    def send_result(self, goal: Goal, future: FutureModel) -> Steps:
        yield from self.answer("finished", goal, future, OF_STATUS * goal.status + goal.result.value)

    def answer(self, part: str, goal: Goal, future: FutureModel, value: int) -> Steps:
        """Send a response, which wakes all clients of the action, unless the one that has asked has left."""

        def deliver() -> None:
            if not goal.client.process.has_left:
                self.deliver(part, (goal.client, future, value))

        yield from self.process.send(deliver)

    def move(self, goal: Goal, status: int) -> Steps:
        """Change the state of a goal, and publish the states of all."""
        goal.status = status
        yield from self.publish("status", [each.status for each in self.goals])

    def publish(self, part: str, content: Any, *message: Any) -> Steps:
        """Send a message that everybody may hear."""

        def deliver() -> None:
            topics = self.world.expected.topics
            topics.setdefault(f"{self.end.action}/_action/{part}", []).append((self.world.now, content))
            self.deliver(part, message)

        yield from self.process.send(deliver)

    def run(self, goal: Goal) -> Steps:
        """Run the execute callback, and see to it that the goal ends."""
        server, node = self.end, self.owner
        scope = Scope(server.name, server.name, goal.order, goal)
        node.runs[server.name] = node.runs.get(server.name, 0) + 1
        value = 0
        try:
            yield from node.run(server.body, scope)
        except Leave as leave:
            if leave.how is not Ending.RAISE:
                raise
            yield from self.process.say(f"Error raised in execute callback: {leave.ended.text.partition(': ')[2]}")
        else:
            value = small(node.value(server.answer, scope))
            if server.finish is not Finish.FORGET:
                yield from self.move(goal, self.finish_of(goal))
        if goal.is_active:
            yield from self.process.say("Goal state not set, assuming aborted.")
            yield from self.move(goal, ABORTED)
        assert node.executor is not None
        goal.result.set(node.executor, value)

    def finish_of(self, goal: Goal) -> int:
        if self.end.finish is Finish.ABORT:
            return ABORTED
        return CANCELED if self.end.finish is Finish.CANCEL and goal.status == CANCELING else SUCCEEDED

    def add_task(self, steps: Steps) -> None:
        assert self.owner.executor is not None
        self.owner.executor.add_task(Task(steps))

    def feed(self, goal: Goal, number: int) -> Steps:
        """Publish feedback."""
        number = small(number)
        yield from self.publish("feedback", number, goal, number)


class ClientModel(WaitableModel):
    """A client of an action."""

    end: ActionClient

    def __init__(self, owner: NodeModel, end: ActionClient) -> None:
        depths = {"answered": DEPTH, "cancelled": DEPTH, "finished": DEPTH, "feedback": DEPTH, "status": 1}
        super().__init__(owner, end, depths)
        #: The last goal that was accepted.
        self.last: Goal | None = None

    def answered(self, client: ClientModel, future: FutureModel, value: int) -> Steps:
        """Set the result of a future, unless the response is for another client."""
        if client is self:
            assert self.owner.executor is not None
            future.set(self.owner.executor, value)
        yield from nothing()

    cancelled = finished = answered

    def feedback(self, goal: Goal, number: int) -> Steps:
        if goal.client is self and goal.hears is not None:
            yield from goal.hears(number)

    def status(self) -> Steps:
        """Note the states of goals, which no program shows."""
        yield from nothing()

    def then(self, future: FutureModel, statements: tuple[Statement, ...], scope: Scope) -> Callable[[], Steps]:
        """Return what runs with the number in a response."""

        def steps() -> Steps:
            scope.heard = future.value
            yield from self.owner.run(statements, scope)

        return steps

    def send_goal(self, one: SendGoal, scope: Scope, order: int) -> Steps:
        """Send a goal."""
        goal, future, label = Goal(self, small(order)), FutureModel(), f"{scope.name}.{self.end.name}"

        def hears(number: int) -> Steps:
            assert one.hears is not None
            with suppress(ReturnedError):
                yield from self.owner.run(one.hears, Scope(scope.name, f"{label}.hears", number))

        def answered() -> Steps:
            yield from self.then(future, one.answered, Scope(scope.name, f"{label}.answered"))()
            if future.value:
                self.last = goal
                yield from self.ask(goal, one, Scope(scope.name, f"{label}.finished"))

        future.callbacks.append(answered)
        yield from self.send("requested", goal, future)
        goal.hears = hears if one.hears is not None else None

    def ask(self, goal: Goal, one: SendGoal, scope: Scope) -> Steps:
        """Ask for the result of a goal."""
        future = FutureModel(callbacks=[lambda: self.forget(goal)])
        future.callbacks.append(self.then(future, one.finished, scope))
        yield from self.send("asked", goal, future)

    def forget(self, goal: Goal) -> Steps:
        goal.hears = None
        yield from nothing()

    def cancel(self, one: CancelGoal, scope: Scope) -> Steps:
        """Ask to cancel the last goal."""
        if self.last is not None:
            future = FutureModel()
            inner = Scope(scope.name, f"{scope.name}.{self.end.name}.cancelled")
            future.callbacks.append(self.then(future, one.then, inner))
            yield from self.send("to_cancel", self.last, future)
