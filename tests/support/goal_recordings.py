"""Builds recordings of a student's client of an action."""

from __future__ import annotations

from typing import Any

from tracing import Recording

ACTION, TYPE = "/count", "test_msgs/action/Fibonacci"
STATUS = {"succeeded": 4, "canceled": 5, "aborted": 6}


def uuid(number: int) -> dict[str, Any]:
    """Return the id of a goal."""
    return {"uuid": [number] * 16}


class Client(Recording):
    """A recording of a client's goals."""

    def offered(self) -> Client:
        """Offer the action."""
        self.mark(0, "action_starts", f"{ACTION} {TYPE}").mark(0, "server_starts", f"{ACTION}/_action/send_goal")
        return self

    def goal(self, t_s: float, number: int, order: int, *, accepted: bool = True) -> Client:
        """Send a goal, which is answered at once."""
        service, value = f"{ACTION}/_action/send_goal", {"goal_id": uuid(number), "goal": {"order": order}}
        self.request(t_s, service, number, "student", value, f"{TYPE}_SendGoal")
        self.response(t_s, service, number, {"accepted": accepted}, "grader", f"{TYPE}_SendGoal")
        return self

    def result(self, t_s: float, number: int, status: str) -> Client:
        """Ask for the result, which comes then."""
        service = f"{ACTION}/_action/get_result"
        self.request(t_s - 0.1, service, number, "student", {"goal_id": uuid(number)}, f"{TYPE}_GetResult")
        self.response(t_s, service, number, {"status": STATUS[status]}, "grader", f"{TYPE}_GetResult")
        return self

    def cancel(self, t_s: float, number: int) -> Client:
        """Ask to cancel a goal."""
        value = {"goal_info": {"goal_id": uuid(number)}}
        self.request(t_s, f"{ACTION}/_action/cancel_goal", number, "student", value, "action_msgs/srv/CancelGoal")
        return self

    def feedback(self, t_s: float, number: int, *sequence: int) -> Client:
        """Tell a client something about a goal."""
        value = {"goal_id": uuid(number), "feedback": {"sequence": list(sequence)}}
        self.deliver(t_s, f"{ACTION}/_action/feedback", value, f"{TYPE}_FeedbackMessage")
        return self


def client(stop_s: float = 20.0) -> Client:
    """Return an empty recording."""
    return Client(stop_s).offered()
