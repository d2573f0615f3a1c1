"""A participant that reacts; `grader/runtime/worker/simulations.py` runs it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import field
from typing import Any, ClassVar

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.scenario import Event, Fields, Planned, Stimulus
from grader.runtime.model.worlds import WallMap
from grader.runtime.stimuli.drawing import Draws, drawn_fields, planned_as


@dataclass(frozen=True, slots=True)
class PlannedSimulation(Planned):
    """A simulation with every parameter drawn, and the seed of its noise."""

    name: str
    path: str
    content: bytes
    parameters: Mapping[str, Any]
    seed: int
    maps: tuple[tuple[str, WallMap], ...] = ()


@dataclass(frozen=True, slots=True)
class Step(Event):
    """Let time pass for the simulation with a number."""

    number: int


@dataclass(frozen=True, slots=True)
class Record(Event):
    """Record a message that no node hears, as if it had been published."""

    topic: str
    type: str
    message: Any


@dataclass(frozen=True, slots=True)
class Simulated(Stimulus):
    """A stimulus: a participant that reacts to what the student's nodes publish, such as a simulated robot.

    It exists from the beginning to the end of the observation.
    """

    key: ClassVar[str] = "simulation"
    becomes = PlannedSimulation

    name: str  # one of the built-in simulations, or one in the table of the file
    parameters: Fields = field(hash=False)  # its parameters; those left out keep their defaults
    path: str = ""  # the author's file with its class, for messages; empty for a built-in one
    content: bytes = b""  # the text of that file
    start_ns: int = 0
    maps: tuple[tuple[str, WallMap], ...] = ()  # the maps of the rubric, by name

    def planned(self, draws: Draws) -> PlannedSimulation:
        """Draw every parameter, and the seed of the noise."""
        parameters = drawn_fields(self.parameters, draws.own)
        return planned_as(PlannedSimulation, self, parameters=parameters, seed=draws.own.getrandbits(48))

    def phrase(self) -> str:
        """Return what the grader does, as a part of a sentence."""
        return f"the simulation {self.name} reacts to what is published"
