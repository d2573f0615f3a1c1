"""Calls services and sends goals for a test, and finds what programs have answered."""

from __future__ import annotations

from typing import Any

from grader.runtime.message_classes import built, plain_fields
from grader.runtime.plan import derive
from grader.runtime.serialization import type_of_part
from grader.runtime.steps import CallService, SendGoal
from grader.runtime.stimuli import PlannedGoal
from grader.world.account import RunAccount
from grader.world.asking import GoalHandle, GoalResult, PendingCall, Received
from grader.world.errors import StepTimeout, WrongType
from grader.world.observed import Observed
from grader.world.timeline import Timeline, given_ns


class Calls:
    """The requests and goals of a test.

    Args:
        timeline: Of the run.
        observed: What is observed in it.
        account: Says why there is no answer.
        seed: The ids of goals follow from it.
    """

    def __init__(self, timeline: Timeline, observed: Observed, account: RunAccount, seed: int) -> None:
        self._timeline = timeline
        self._observed = observed
        self._account = account
        self._seed = seed
        self._goals = 0

    def call(self, name: str, request: Any) -> PendingCall:
        """Send a request with the next step, when its server is there; raises WrongType for one of another type."""
        __tracebackhide__ = True
        interface, kind = type_of_part(request, "Request", name)
        self._refuse_other_server(name, interface, name)
        since_ns, seen = self._timeline.begin_ns(), len(self._observed.everything)
        told = self._timeline.perform(CallService(name, interface, plain_fields(request)))

        def look() -> Any:
            found = self._observed.response(seen, name, told["client"])
            return None if found is None else built(kind.Response, found.value, name)

        def too_late(_: int) -> StepTimeout:
            offered = any(end.type == interface for end in self._observed.graph.ends_of_services("service", name))
            unanswered = f"{name} has a server, which has not answered"
            why = unanswered if offered else self._account.no_server(name, interface)
            return self._account.timeout(f"{name} did not answer", since_ns, {"the service": [why]})

        def wait(timeout: float) -> Any:
            __tracebackhide__ = True
            return self._timeline.wait(look, timeout, too_late)

        return PendingCall(name, self._timeline.caught_up(look), wait)

    def send_goal(self, name: str, goal: Any, cancel_after: float | None = None) -> GoalHandle:
        """Send a goal with the next step, when its server is there; raises WrongType for one of another type.

        Args:
            name: Absolute name of the action.
            goal: The goal.
            cancel_after: Seconds after its acceptance at which it is cancelled; None to let it go on.
        """
        __tracebackhide__ = True
        interface, kind = type_of_part(goal, "Goal", name)
        self._refuse_other_server(f"{name}/_action/send_goal", f"{interface}_SendGoal", name)
        self._goals += 1
        uuid = tuple(bytes.fromhex(derive(self._seed, "goal", str(self._goals))[:32]))
        after_ns = 0 if cancel_after is None else max(1, given_ns("cancel_after", cancel_after))
        since_ns, seen = self._timeline.begin_ns(), len(self._observed.everything)
        planned = PlannedGoal(name, interface, since_ns, after_ns, plain_fields(goal), uuid)
        sent, asked = self._timeline.perform(SendGoal(planned))["clients"][:2]

        def feedback() -> list[Received]:
            __tracebackhide__ = True
            self._timeline.catch_up()
            got = self._observed.received(f"{name}/_action/feedback")
            return [Received(one.t, one.message.feedback) for one in got if tuple(one.message.goal_id.uuid) == uuid]

        def look() -> tuple[bool | None, GoalResult | None]:
            accepted = self._observed.response(seen, f"{name}/_action/send_goal", sent)
            if accepted is None:
                return None, None
            if not accepted.value["accepted"]:
                return False, GoalResult(accepted=False, status=0, result=None, feedback=[])
            result = self._observed.response(seen, f"{name}/_action/get_result", asked)
            if result is None:
                return True, None
            ending = built(kind.Result, result.value["result"], name)
            return True, GoalResult(accepted=True, status=result.value["status"], result=ending, feedback=feedback())

        def too_late(_: int) -> StepTimeout:
            why = "it has accepted the goal" if look()[0] else "it has not answered the goal"
            cause = why if self._observed.offers_action(name) else self._account.no_action(name)
            return self._account.timeout(f"{name} gave no result", since_ns, {"the action": [cause]})

        def wait(timeout: float) -> GoalResult:
            __tracebackhide__ = True
            return self._timeline.wait(lambda: look()[1], timeout, too_late)

        def cancel() -> None:
            __tracebackhide__ = True
            request = {"goal_info": {"goal_id": {"uuid": list(uuid)}}}
            self._timeline.perform(CallService(f"{name}/_action/cancel_goal", "action_msgs/srv/CancelGoal", request))

        return GoalHandle(name, self._timeline.caught_up(look), feedback, wait, cancel)

    def _refuse_other_server(self, service: str, interface: str, name: str) -> None:
        """Raise WrongType if all servers of a service are of another type than the test calls it with."""
        __tracebackhide__ = True
        self._timeline.catch_up()
        servers = self._observed.graph.ends_of_services("service", service)
        if servers and all(end.type != interface for end in servers):
            one, expected = servers[0], interface.removesuffix("_SendGoal")
            raise WrongType(f"{name}: {one.node} offers {one.type.removesuffix('_SendGoal')}, the test uses {expected}")
