"""Lets simulations take part in a stepped run: their methods run in the test's process while time stands still."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import suppress
from itertools import islice
from random import Random
from typing import Any, NamedTuple

from grader.grading.model.wording import first_few
from grader.runtime.message_classes import built, wanted_class
from grader.runtime.model.author_files import AuthorMistake, line_of
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.wording import printable
from grader.runtime.model.worlds import Sketch
from grader.runtime.plan import derive
from grader.runtime.simulation import SIMULATIONS, Moment, Simulation, WallMap, types_heard
from grader.runtime.simulation.loading import SimulationError, begin_of, guarded, made_simulation
from grader.runtime.steps import Simulate
from grader.world import telling
from grader.world.names import absolute_name
from grader.world.timeline import Timeline

#: Of what a simulation draws, so much is on the page of a run.
_MOST_SKETCHES = 100


class NamedSimulations(NamedTuple):
    """What a rubric has of its own that a test may simulate by name."""

    files: Mapping[str, tuple[str, bytes]] = {}  # file and text of each simulation
    maps: Mapping[str, WallMap] = {}


class _Part(NamedTuple):
    """A simulation that takes part, and where its code is, if it is one of a rubric's own."""

    simulation: Simulation
    name: str
    path: str
    outputs: dict[str, str]  # the topics that it publishes on, with their types

    def asked(self, method: str, *arguments: Any) -> Any:
        """Call a method; a mistake in one of a rubric's own raises SimulationError with its place."""

        def work() -> Any:
            answer = getattr(self.simulation, method)(*arguments)
            return answer if answer is None or isinstance(answer, Mapping) else [*answer]

        if not self.path:
            return work()
        return guarded(self.name, self.path, work, begin_of(self.simulation, method, self.path))

    def checked(self, method: str, answer: Any) -> Any:
        """Return what a method publishes; raises SimulationError for anything but a message of its topics."""
        types = self.outputs if self.path and isinstance(answer, list) else {}
        try:
            for output in answer if types else ():
                topic, fields = output
                built(wanted_class(types[topic], "msg", topic), fields, topic)
        except (HarnessError, TypeError, ValueError, KeyError, AttributeError) as error:
            among = f"one of its topics ({', '.join(types)}) with the fields of a message"
            found = (
                error.message if isinstance(error, HarnessError) else f"{printable(str(output), 80)}, expected {among}"
            )
            text = f"the simulation `{self.name}` failed in {method}(): {found}"
            place = self.path, begin_of(self.simulation, method, self.path)
            raise SimulationError(AuthorMistake(*place, text)) from error
        return answer


class SimulationsOfTest:
    """The simulations that take part in a run.

    Args:
        timeline: Of the run.
        seed: What they draw follows from it.
        named: Those of a rubric's own.
    """

    def __init__(self, timeline: Timeline, seed: int, named: NamedSimulations) -> None:
        self._timeline = timeline
        self._seed = seed
        self._named = named
        self._parts: list[_Part] = []

    def add(self, simulation: Simulation | str, parameters: Mapping[str, Any]) -> Simulation:
        """Let a simulation take part from now on, and return it; raises ValueError if no simulation has the name."""
        __tracebackhide__ = True
        name, path, content = "", "", b""
        if isinstance(simulation, str):
            name, (path, content) = simulation, self._named.files.get(simulation, ("", b""))
            simulation = self._made(name, path, content, parameters)
        number, part = len(self._parts), _Part(simulation, name, path, {})
        self._parts.append(part)
        part.asked("begin", Random(derive(self._seed, "simulation", str(number))))  # noqa: S311 - it has to repeat
        publishes, serves, records = (dict(part.asked(method)) for method in ("publishes", "serves", "records"))
        hears = types_heard(part.asked("hears"))
        part.outputs.update({**publishes, **records})
        self._timeline.perform(Simulate(number, simulation.period, publishes, hears, serves, records))
        return simulation

    def _made(self, name: str, path: str, content: bytes, parameters: Mapping[str, Any]) -> Simulation:
        """Make a simulation by its name; raises ValueError for what the test asks wrongly."""
        known = dict.fromkeys([*SIMULATIONS, *self._named.files])
        if name not in known:
            raise ValueError(f"simulate: expected one of {first_few(list(known), 20)}, found {name!r}")
        try:
            return made_simulation(name, path, content, parameters, self._named.maps)
        except SimulationError as error:
            cause = error.__cause__
            if isinstance(cause, TypeError) and not line_of(cause, path, 0):  # it does not take what is given
                raise ValueError(f"simulate: {name}: {cause}") from None
            raise
        except HarnessError as error:
            raise ValueError(f"simulate: {error.message}") from None

    def answer(self, question: Mapping[str, Any]) -> Any:
        """Return what a simulation does, as the worker asks."""
        part, method = self._parts[question["number"]], question["method"]
        now = Moment(question["now_ns"], question["clock_ns"])
        answer = part.checked(method, part.asked(method, now, *question["arguments"]))
        return dict(answer) if isinstance(answer, Mapping) else answer

    def sides(self) -> Iterator[telling.Sides]:
        """Yield what each of them publishes, hears and serves."""
        return (telling.sides_of(part.simulation) for part in self._parts)

    def sketches(self) -> Iterator[Sketch]:
        """Yield what each has drawn; one whose method fails has no picture: what happened in the run counts."""
        for part in self._parts:
            with suppress(Exception):
                yield from [*islice(part.simulation.drawing(), _MOST_SKETCHES)]

    def topics(self) -> set[str]:
        """Return the topics that they publish on."""
        return {topic for part in self._parts for topic in part.simulation.publishes()}

    def services(self) -> set[str]:
        """Return the services that they offer."""
        return {absolute_name(service) for part in self._parts for service in part.simulation.serves()}
