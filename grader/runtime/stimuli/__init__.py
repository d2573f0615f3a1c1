"""What the grader does to the student's nodes: one module a kind, from what rubrics say to what happens in a run."""

from __future__ import annotations

from collections.abc import Mapping

from grader.runtime.model.scenario import Planned, Stimulus
from grader.runtime.stimuli.action_server import ActionServer
from grader.runtime.stimuli.calls import ServiceCalls
from grader.runtime.stimuli.goals import ActionGoal, PlannedGoal
from grader.runtime.stimuli.messages import MessageStream
from grader.runtime.stimuli.numbers import NumberStream
from grader.runtime.stimuli.phrases import time_phrase
from grader.runtime.stimuli.recorded import RecordedStream, Recording
from grader.runtime.stimuli.server import ServiceServer
from grader.runtime.stimuli.simulation import Simulated

__all__ = [
    "KINDS",
    "PLANNED",
    "ActionServer",
    "PlannedGoal",
    "RecordedStream",
    "Recording",
    "ServiceCalls",
    "Simulated",
    "time_phrase",
]

#: Every kind. Values are drawn in this order, and of two events at one instant, that of the kind listed first comes
#: first: in another order, a seed that somebody noted would give other values.
KINDS: tuple[type[Stimulus], ...] = (
    NumberStream,
    RecordedStream,
    MessageStream,
    ServiceServer,
    ServiceCalls,
    ActionGoal,
    Simulated,
    ActionServer,
)
#: What they become, by the names under which plans are sent to workers.
PLANNED: Mapping[str, type[Planned]] = {kind.becomes.__name__: kind.becomes for kind in KINDS}
