"""The simulations of one run: steps them, hands them what the students' nodes publish, and takes what they publish."""

from __future__ import annotations

import math
import random
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import replace
from functools import partial
from itertools import islice
from typing import Any, TypeVar

from grader.runtime.message_classes import built, wanted_class
from grader.runtime.model.author_files import AuthorMistake
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.scenario import Event
from grader.runtime.model.worlds import TONES, Sketch
from grader.runtime.plan import Plan
from grader.runtime.simulation.loading import SimulationError, begin_of, guarded, made_simulation
from grader.runtime.simulation.participant import SHORTEST_PERIOD_NS, Moment, Output, Simulation, types_heard
from grader.runtime.stimuli.messages import Advertise, PlannedMessages, PublishFields
from grader.runtime.stimuli.server import AddServer, PlannedServer
from grader.runtime.stimuli.simulation import PlannedSimulation, Record, Step
from grader.runtime.worker.core import Taken

Result = TypeVar("Result")

#: The most messages that a simulation may publish in one call: an author's loop without an end stops here.
OUTPUTS = 100
#: The most things in a picture, and points of one.
SKETCHES, POINTS = 50, 20_000
#: How many times as many messages as a student's node a simulation may publish: it may react to several topics.
BEYOND = 5


class Simulations:
    """The simulations of a plan.

    Args:
        plan: Names them, with their parameters.

    Raises:
        SimulationError: A simulation of the rubric's author cannot be made, or names a type that is unknown here.
        HarnessError: The same of a built-in one.
    """

    def __init__(self, plan: Plan) -> None:
        self._all = [_Running(planned, BEYOND * plan.limits.messages) for planned in plan.of(PlannedSimulation)]
        self._last_ns = 0

    @property
    def exist(self) -> bool:
        """Whether there is any."""
        return bool(self._all)

    def heard(self) -> Iterator[tuple[str, str]]:
        """Yield the topics that simulations listen to, with each of the types that one takes."""
        yield from ((topic, type_) for one in self._all for topic, types in one.hears.items() for type_ in types)

    def events(self) -> list[Event]:
        """Return the events that create what the simulations offer, and their first steps."""
        return [e for number, one in enumerate(self._all) for e in (*one.appearances(0), Step(0, number))]

    def add(self, name: str, simulation: Simulation, most: int, now_ns: int) -> list[Event]:
        """Let a simulation take part from now on; return the events that create what it offers, and its first step.

        Args:
            name: Its name in messages.
            simulation: It has begun.
            most: How many messages it may publish.
            now_ns: The time of the run.
        """
        self._all.append(one := _Running(PlannedSimulation(name, "", b"", {}, 0), most, simulation))
        return [*one.appearances(now_ns), Step(now_ns, len(self._all) - 1)]

    def step(self, step: Step, now: Moment) -> tuple[Event, ...]:
        """Let time pass for one simulation; return what it publishes, and its next step."""
        one = self._all[step.number]
        return (
            *one.publish("step", one.simulation.step, self._after(now)),
            replace(step, t_ns=step.t_ns + one.period_ns),
        )

    def hear(self, taken: Taken, now: Moment) -> list[Event]:
        """Hand a message of a student's node to the simulations that listen to its topic; return what they publish."""
        listening = [one for one in self._all if taken.value and taken.type in one.hears.get(taken.topic, ())]
        return [event for one in listening for event in one.hear(taken, self._after(now))]

    def answer(self, service: str, request: Mapping[str, Any], now: Moment) -> Mapping[str, Any] | None:
        """Return the response to a request of a student's client; None if no simulation offers the service."""
        one = next((one for one in self._all if service in one.serves), None)
        return None if one is None else one.answer(service, request, self._after(now))

    def drawn(self) -> tuple[Sketch, ...]:
        """Return the picture of each simulation, as it is now."""
        return tuple(sketch for one in self._all for sketch in one.drawn())

    def _after(self, now: Moment) -> Moment:
        """Return a moment that does not lie before an earlier one: a late step on the wall clock has its due time."""
        self._last_ns = max(self._last_ns, now.t_ns)
        return replace(now, t_ns=self._last_ns)


class _Running:
    """One simulation, with what it publishes, hears and offers."""

    def __init__(self, planned: PlannedSimulation, most: int, begun: Simulation | None = None) -> None:
        self._planned = planned
        self._left = most
        self.simulation = begun or made_simulation(
            planned.name, planned.path, planned.content, planned.parameters, dict(planned.maps)
        )
        self.period_ns = max(SHORTEST_PERIOD_NS, self.simulation.period)
        self.hears = self._call(lambda: types_heard(self.simulation.hears()), "hears")
        self.serves = self._call(lambda: dict(self.simulation.serves()), "serves")
        self._streams = {
            topic: PlannedMessages(topic, type_, 0, 0, self.period_ns, 0, best_effort=False, latched=False, values=())
            for topic, type_ in self._call(lambda: dict(self.simulation.publishes()), "publishes").items()
        }
        self._classes: dict[str, Any] = {}
        self._records = self._call(lambda: dict(self.simulation.records()), "records")
        for method, types in (
            ("publishes", {s.topic: s.type for s in self._streams.values()}),
            ("records", self._records),
        ):
            with self._blamed(method):
                self._classes |= {topic: wanted_class(type_, "msg", topic) for topic, type_ in types.items()}
        with self._blamed("serves"):
            for service, type_ in self.serves.items():
                wanted_class(type_, "srv", service)
        if begun is None:
            # reproducible, and nobody can know it who does not know the seed
            self._call(partial(self.simulation.begin, random.Random(planned.seed)), "begin")  # noqa: S311

    def appearances(self, now_ns: int) -> Iterator[Event]:
        for stream in self._streams.values():
            yield Advertise(now_ns, stream.topic, stream)
        for service, type_ in self.serves.items():
            server = PlannedServer(service, type_, now_ns, 0, 0, cycle=False, answers=0, responses=())
            yield AddServer(now_ns, server)

    def drawn(self) -> tuple[Sketch, ...]:
        sketches = self._call(lambda: list(islice(self.simulation.drawing(), SKETCHES)), "drawing")
        with self._blamed("drawing"):
            return tuple(map(_checked_sketch, sketches))

    def publish(self, method: str, work: Callable[[Moment], Iterable[Output]], now: Moment) -> list[Event]:
        outputs = self._call(lambda: list(islice(work(now), OUTPUTS + 1)), method)
        with self._blamed(method):
            if len(outputs) > OUTPUTS:
                raise HarnessError(f"expected at most {OUTPUTS} messages at once, found more")
            return [self._published(output, now) for output in outputs]

    def hear(self, taken: Taken, now: Moment) -> list[Event]:
        heard = deepcopy(taken.value)  # the trace holds the original
        return self.publish("on_message", lambda at: self.simulation.on_message(at, taken.topic, heard), now)

    def answer(self, service: str, request: Mapping[str, Any], now: Moment) -> Mapping[str, Any]:
        fields = self._call(lambda: dict(self.simulation.on_request(now, service, request)), "on_request")
        with self._blamed("on_request"):
            built(wanted_class(self.serves[service], "srv", service).Response, fields, service)
        return fields

    def _published(self, output: Output, now: Moment) -> PublishFields | Record:
        try:
            topic, fields = output
            stream = None if topic in self._records else self._streams[topic]
        except (TypeError, ValueError, KeyError):
            text = f"a topic that it publishes on ({', '.join(self._streams) or 'none'}) with the fields of a message"
            raise HarnessError(f"expected {text}, found {str(output)[:80]!r}") from None
        self._left -= 1
        if self._left < 0:
            raise HarnessError("expected fewer messages in one recording")
        if not isinstance(fields, Mapping):
            raise HarnessError(f"expected a mapping of fields for {topic}, found {str(fields)[:80]!r}")
        message = built(self._classes[topic], fields, topic)  # now, while it is known which method gave them
        if stream is None:
            return Record(now.t_ns, topic, self._records[topic], message)
        return PublishFields(now.t_ns, topic, stream, fields, message)

    @contextmanager
    def _blamed(self, method: str) -> Iterator[None]:
        """Raise what is wrong with the values of a method as a mistake of the author, at the line where it begins."""
        name, path = self._planned.name, self._planned.path
        try:
            yield
        except HarnessError as error:
            if not path:
                raise HarnessError(f"simulation {name}: {error.message}") from error
            line = begin_of(self.simulation, method, path)
            text = f"the simulation `{name}` failed in {method}(): {error.message}"
            raise SimulationError(AuthorMistake(path, line, text)) from error

    def _call(self, work: Callable[[], Result], method: str) -> Result:
        path = self._planned.path
        return guarded(self._planned.name, path, work, begin_of(self.simulation, method, path))


def _checked_sketch(sketch: object) -> Sketch:
    """Return a thing of a picture with plain numbers; raises HarnessError for what no picture can hold."""
    if not isinstance(sketch, Sketch):
        raise HarnessError(f"expected a Sketch, found {str(sketch)[:80]!r}")
    try:
        lines = tuple(tuple((float(x), float(y)) for x, y in line) for line in sketch.lines)
    except (TypeError, ValueError, OverflowError):
        raise HarnessError(
            f"expected lines of points (x, y) in the sketch {sketch.name!r}, found something else"
        ) from None
    if not (isinstance(sketch.name, str) and sketch.tone in TONES):
        raise HarnessError(f"expected a name and one of the tones {', '.join(TONES)}, found {str(sketch.tone)[:80]!r}")
    if sum(map(len, lines)) > POINTS or not all(math.isfinite(n) for line in lines for point in line for n in point):
        raise HarnessError(f"expected at most {POINTS:,} finite points in the sketch {sketch.name!r}, found others")
    return Sketch(sketch.name[:100], lines, bool(sketch.dots), sketch.tone)
