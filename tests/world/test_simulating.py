"""Simulations of a rubric that a test makes by name: whose mistake it is when one cannot be made."""

from __future__ import annotations

from typing import Any, cast

import pytest

from grader.runtime.simulation.loading import SimulationError
from grader.world.simulating import NamedSimulations, SimulationsOfTest
from grader.world.timeline import Timeline

FILE = b"""
from grader.api import Simulation


class Track(Simulation):
    def __init__(self, wall=0.5):
        super().__init__(wall)


SIMULATIONS = {"track": Track}
"""


def made(**parameters: Any) -> None:
    simulations = SimulationsOfTest(cast("Timeline", None), 0, NamedSimulations({"track": ("track.py", FILE)}))
    simulations.add("track", parameters)


def test_a_parameter_that_it_does_not_have_is_the_mistake_of_the_test() -> None:
    with pytest.raises(ValueError, match=r"^simulate: track: Track\.__init__\(\) got an unexpected keyword .*'walls'"):
        made(walls=1.0)


def test_a_call_that_fails_in_its_file_is_the_mistake_of_that_file() -> None:
    """Also when it is of another `__init__()`."""
    with pytest.raises(SimulationError) as caught:
        made(wall=1.0)
    assert (caught.value.mistake.file, caught.value.mistake.line) == ("track.py", 7)
