"""Participants of a scenario that react: simulated robots, for rubrics that grade closed loops.

    from grader.api import DifferentialDrive, Moment, Simulation

A rubric uses one as a stimulus: `simulation: {differential_drive: {x: {between: [-1, 1]}}}`. The author of a rubric
writes another as a class in a file that the rubric lists under `simulations`.
"""

from grader.runtime.model.worlds import Sketch, WallMap
from grader.runtime.simulation.loading import SIMULATIONS
from grader.runtime.simulation.mapped import Box, Obstacle, RobotInMap
from grader.runtime.simulation.participant import (
    SHORTEST_PERIOD_NS,
    Hears,
    Moment,
    Output,
    Simulation,
    types_heard,
)
from grader.runtime.simulation.robots import DifferentialDrive, Turtle, Unicycle

__all__ = [
    "SHORTEST_PERIOD_NS",
    "SIMULATIONS",
    "Box",
    "DifferentialDrive",
    "Hears",
    "Moment",
    "Obstacle",
    "Output",
    "RobotInMap",
    "Simulation",
    "Sketch",
    "Turtle",
    "Unicycle",
    "WallMap",
    "types_heard",
]
