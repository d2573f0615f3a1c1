"""Calls and goals of a test that go on while time passes: they can be looked at, waited for, and cancelled."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class Received:
    """A message that a program published."""

    t: float  # when, in seconds since the test began
    message: Any  # the message, an object of its class


@dataclass(frozen=True, slots=True)
class GoalResult:
    """How a goal of an action ended."""

    accepted: bool
    status: int  # as in action_msgs/msg/GoalStatus, 0 if it was not accepted
    result: Any  # the result, an object of its class; None if it was not accepted
    feedback: list[Received]  # the feedback to this goal


class PendingCall:
    """A request of the test to a service.

    Attributes:
        service: The name of the service.
    """

    def __init__(self, service: str, look: Callable[[], Any], wait: Callable[[float], Any]) -> None:
        self.service = service
        self._look = look
        self._wait = wait

    @property
    def done(self) -> bool:
        """Whether the response is there."""
        __tracebackhide__ = True
        return self._look() is not None

    @property
    def response(self) -> Any:
        """The response, an object of its class; None until it is there."""
        __tracebackhide__ = True
        return self._look()

    def wait(self, timeout: float = 10.0) -> Any:
        """Let time pass until the response is there, and return it.

        Args:
            timeout: Seconds to wait at most, for the server and the response together.

        Raises:
            StepTimeout: There was no response in time; the message says whether there is a server.
        """
        __tracebackhide__ = True
        return self._wait(timeout)


class GoalHandle:
    """A goal that the test has sent to an action.

    Attributes:
        action: The name of the action.
    """

    def __init__(
        self,
        action: str,
        look: Callable[[], tuple[bool | None, GoalResult | None]],
        feedback: Callable[[], list[Received]],
        wait: Callable[[float], GoalResult],
        cancel: Callable[[], None],
    ) -> None:
        self.action = action
        self._look = look
        self._feedback = feedback
        self._wait = wait
        self._cancel = cancel

    @property
    def accepted(self) -> bool | None:
        """Whether the server has accepted it; None until it has answered."""
        __tracebackhide__ = True
        return self._look()[0]

    @property
    def feedback(self) -> list[Received]:
        """The feedback to it so far."""
        __tracebackhide__ = True
        return self._feedback()

    @property
    def done(self) -> bool:
        """Whether it has been refused, or its result is there."""
        __tracebackhide__ = True
        return self._look()[1] is not None

    @property
    def outcome(self) -> GoalResult | None:
        """How it ended; None until it has."""
        __tracebackhide__ = True
        return self._look()[1]

    def cancel(self) -> None:
        """Ask the server to cancel it, now. What becomes of it, its status says."""
        __tracebackhide__ = True
        self._cancel()

    def wait(self, timeout: float = 60.0) -> GoalResult:
        """Let time pass until it has been refused or its result is there, and return how it ended.

        Args:
            timeout: Seconds to wait at most.

        Raises:
            StepTimeout: There was no result in time.
        """
        __tracebackhide__ = True
        return self._wait(timeout)
