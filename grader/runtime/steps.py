"""The commands with which a run is stepped from outside, as values that pass between a supervisor and its worker."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, get_args

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.plan import Plan
from grader.runtime.stimuli.goals import PlannedGoal


class LaunchFailedError(HarnessError):
    """A launch file raised an exception."""


@dataclass(frozen=True, slots=True)
class StartProcesses:
    """Start the processes of a plan.

    Attributes:
        plan: Names the processes.
        settle: Whether to let each run until it waits for something; otherwise they run with the next step, together.
    """

    plan: Plan
    settle: bool = True


@dataclass(frozen=True, slots=True)
class Advance:
    """Let time pass until a moment; everything that happens at it is part of the step.

    Attributes:
        to_ns: The moment, since the run began; the present one to settle what happens now.
        until_news: Whether to stop at the first moment before at which something is observed.
    """

    to_ns: int
    until_news: bool = False


@dataclass(frozen=True, slots=True)
class Publish:
    """Publish a message now, or from now on until another command names the topic.

    Attributes:
        topic: Absolute name.
        type: Type of the messages.
        messages: The serialized messages, in the order of sending; the last one is repeated. Empty to stop a stream.
        period_ns: Time between two messages; 0 to publish once.
        times_ns: When each is sent, from now on, where they have times of their own; the last one is not repeated then.
        best_effort: Reliability of the publisher.
        latched: Whether it is transient-local.
    """

    topic: str
    type: str
    messages: tuple[bytes, ...]
    period_ns: int = 0
    times_ns: tuple[int, ...] = ()
    best_effort: bool = False
    latched: bool = False


@dataclass(frozen=True, slots=True)
class Serve:
    """Offer a service; requests are answered by the supervisor's side."""

    service: str
    type: str


@dataclass(frozen=True, slots=True)
class ServeAction:
    """Offer an action; what becomes of its goals, the supervisor's side says."""

    action: str
    type: str


@dataclass(frozen=True, slots=True)
class CallService:
    """Send a request once its server is there; the answer says under which number it will be observed."""

    service: str
    type: str
    request: Mapping[str, Any]


@dataclass(frozen=True, slots=True)
class SendGoal:
    """Send a goal once the action's server is there, and ask for its result."""

    goal: PlannedGoal


@dataclass(frozen=True, slots=True)
class Simulate:
    """Let a simulation take part, whose methods run on the supervisor's side.

    Attributes:
        number: Names it in questions.
        period_ns: Time between two steps.
        publishes: Topics with their types.
        hears: Topics, each with the types that it takes.
        serves: Services with their types.
        records: Topics that are only recorded, with their types.
    """

    number: int
    period_ns: int
    publishes: Mapping[str, str]
    hears: Mapping[str, tuple[str, ...]]
    serves: Mapping[str, str]
    records: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, slots=True)
class Interrupt:
    """Send a process the stop signal, as Ctrl-C does."""

    process: str


@dataclass(frozen=True, slots=True)
class Kill:
    """End a process at once."""

    process: str


@dataclass(frozen=True, slots=True)
class ReadSteps:
    """Tell what each program has done in each of its steps, in order."""


@dataclass(frozen=True, slots=True)
class Finish:
    """End the run with all its processes."""


Command = (
    StartProcesses
    | Advance
    | Publish
    | Serve
    | ServeAction
    | CallService
    | SendGoal
    | Simulate
    | Interrupt
    | Kill
    | ReadSteps
    | Finish
)
#: Each command by its name on the wire.
COMMANDS: Mapping[str, type] = {kind.__name__: kind for kind in get_args(Command)}
