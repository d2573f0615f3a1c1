"""Offers what a test does for its programs: messages that it publishes, services, actions and simulations."""

from __future__ import annotations

import base64
import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

from grader.grading.model.wording import first_few, nearest
from grader.runtime.message_classes import built, plain_fields
from grader.runtime.model.errors import RecordingError
from grader.runtime.model.quantities import NS_PER_S, is_number, seconds
from grader.runtime.model.trace import Endpoint, GraphSnapshot, Observation
from grader.runtime.serialization import QoSProfile, bytes_of, message_type_name, qos_words, serialized, service_type
from grader.runtime.served_actions import TOPICS_OF_ACTIONS, ServedAction
from grader.runtime.simulation import Moment, Simulation
from grader.runtime.steps import Command, Publish, Serve, ServeAction
from grader.world import telling
from grader.world.errors import WrongType
from grader.world.names import absolute_name
from grader.world.observed import EVERYWHERE, Observed
from grader.world.simulating import SimulationsOfTest
from grader.world.timeline import Timeline


class Offers:
    """What a test publishes, serves and simulates; it answers what the worker asks about that.

    Args:
        timeline: Of the run.
        observed: What is observed in it.
        simulations: The simulations that take part.
    """

    def __init__(self, timeline: Timeline, observed: Observed, simulations: SimulationsOfTest) -> None:
        self._timeline = timeline
        self._observed = observed
        self._simulations = simulations
        self._publishers: dict[str, Endpoint] = {}
        self._functions: dict[str, tuple[Any, Callable[[Any], Any]]] = {}
        self._actions: dict[str, ServedAction] = {}
        self._fits = True  # whether nothing has changed since it was looked at whether types and QoS fit
        self._mismatches: set[str] = set()
        timeline.join(self, simulation=simulations.answer, action=self._attended, service=self._responded)

    @property
    def publishers(self) -> Mapping[str, Endpoint]:
        """The publishers of the test by topic; a topic stays when nothing is published on it any more."""
        return self._publishers

    @property
    def services(self) -> Iterable[str]:
        """The names of the services that the test offers."""
        return self._functions.keys()

    def others_on(self, topic: str) -> str:
        """Return who publishes on a topic besides programs, in words; empty for nobody."""
        if topic in self._publishers:
            return "the test"
        return "a simulation" if topic in self._simulations.topics() else ""

    def others_offering(self, name: str) -> str:
        """Return who offers a service or an action besides programs, in words; empty for nobody."""
        if name in self._functions or name in self._actions:
            return "the test"
        return "a simulation" if name in self._simulations.services() else ""

    def publish(self, command: Publish, qos: QoSProfile | None) -> None:
        """Publish messages from now on, instead of what the test has published on the topic."""
        __tracebackhide__ = True
        topic, (reliability, durability) = command.topic, qos_words(qos)
        self._publishers[topic] = Endpoint("publisher", topic, command.type, "the test", -1, reliability, durability)
        self._fits = False
        best_effort, latched = reliability == "best_effort", durability == "transient_local"
        self._timeline.perform(replace(command, best_effort=best_effort, latched=latched))

    def stop_publishing(self, topic: str) -> None:
        """End what the test publishes on a topic; raises ValueError if that is nothing."""
        __tracebackhide__ = True
        if topic not in self._publishers:
            raise ValueError(f"{topic}: expected a topic that the test publishes on, found none")
        self._timeline.perform(Publish(topic, self._publishers[topic].type, ()))

    def serve(self, name: str, interface: str, function: Callable[[Any], Any]) -> None:
        """Offer a service, or replace its function; raises ValueError if it is offered with another type."""
        __tracebackhide__ = True
        known = self._functions.get(name)
        if known is not None:
            _refuse_other_type(name, message_type_name(known[0]), interface)
        self._functions[name] = (service_type(interface), function)
        self._fits = False
        self._timeline.perform(Serve(name, interface))

    def serve_action(self, action: ServedAction) -> None:
        """Offer an action, or replace what answers its goals; raises ValueError if it is offered with another type."""
        __tracebackhide__ = True
        known = self._actions.get(action.name)
        if known is not None:
            _refuse_other_type(action.name, known.type, action.type)
            known.answer, known.preempts = action.answer, action.preempts
            return
        self._actions[action.name] = action
        self._fits = False
        self._timeline.perform(ServeAction(action.name, action.type))

    def simulate(self, simulation: Simulation | str, parameters: Mapping[str, Any]) -> Simulation:
        """Let a simulation take part; see `SimulationsOfTest.add`."""
        __tracebackhide__ = True
        self._fits = False
        return self._simulations.add(simulation, parameters)

    def note(self, command: Command | None, told: Mapping[str, Any], observations: Sequence[Observation]) -> None:
        """Look again whether types and QoS fit, once the graph has changed."""
        del command, told
        self._fits = self._fits and not any(isinstance(one, GraphSnapshot) for one in observations)

    def complain(self) -> None:
        """Raise WrongType, once, for what never arrives although both sides use the same name."""
        __tracebackhide__ = True
        if self._fits:
            return
        self._fits = True
        served = {name: message_type_name(kind) for name, (kind, _) in self._functions.items()}
        served |= {f"{name}/_action/send_goal": f"{one.type}_SendGoal" for name, one in self._actions.items()}
        of_test = telling.Sides(self._publishers.values(), {}, served)
        for found in telling.mismatches(self._observed.graph, [of_test, *self._simulations.sides()]):
            if found not in self._mismatches:
                self._mismatches.add(found)
                raise WrongType(found)

    def _responded(self, question: Mapping[str, Any]) -> Any:
        """Return the response of a served function."""
        name = question["service"]
        kind, function = self._functions[name]
        response = function(built(kind.Request, question["request"], name))
        if not isinstance(response, kind.Response):
            found = type(response).__name__
            raise TypeError(f"{name}: expected a {kind.__name__}.Response from its function, found {found}")
        return plain_fields(response)

    def _attended(self, question: Mapping[str, Any]) -> Any:
        """Return what becomes of the goals of a served action."""
        now = Moment(question["now_ns"], question["clock_ns"])
        action = self._actions[question["action"]]
        done = action.attend(now, question["part"], question["number"], question["request"])
        return done | {"does": [_portable(*one) for one in done["does"]]}


def _refuse_other_type(name: str, known: str, wanted: str) -> None:
    if known != wanted:
        raise ValueError(f"{name}: expected {known}, as it is served already, found {wanted}")


def _portable(part: str, number: int, content: Any) -> tuple[str, int, Any]:
    """Return what an action does as JSON values: a message as its bytes."""
    if part in TOPICS_OF_ACTIONS:
        return part, number, base64.b64encode(bytes_of(content)).decode()
    return part, number, content


def publication(topic: str, message: Any, rate: float | None) -> Publish:
    """Return the command that publishes one message now, or some with a rate; raises ValueError and TypeError.

    Args:
        topic: Absolute name.
        message: The message; with a rate also a list of them.
        rate: Messages per second; None for one message.
    """
    if rate is not None:
        _refuse_no_rate(topic, rate)
    several = [*message] if isinstance(message, (list, tuple)) else [message]
    if not several or (rate is None and len(several) > 1):
        raise ValueError(f"{topic}: expected one message without a rate, found {len(several)}")
    packed = [serialized(one, topic) for one in several]
    types = {interface for interface, _ in packed}
    if len(types) > 1:
        raise TypeError(f"{topic}: expected messages of one type, found {', '.join(sorted(types))}")
    period_ns = 0 if rate is None else round(NS_PER_S / rate)
    return Publish(topic, packed[0][0], tuple(data for _, data in packed), period_ns)


def recorded_publications(bag: str | Path, path: Path, topics: Iterable[str] | None, rate: float) -> Iterator[Publish]:
    """Yield the commands that publish a recording, one for each topic; raises RecordingError for what it lacks.

    Args:
        bag: What the test calls the recording.
        path: Where it is.
        topics: The topics to play; None for all but those that every node has, and that the grader adds.
        rate: How many times as fast as they were recorded.
    """
    from grader.runtime.recording.bag import read_bag, topics_in  # noqa: PLC0415 - few tests play a recording
    from grader.runtime.recording.recording_file import OWN  # noqa: PLC0415 - the same

    _refuse_no_rate("play", rate)
    if isinstance(topics, str):
        raise TypeError(f"play: expected a list of topics, such as [{topics!r}], found {topics!r}")
    types = topics_in(path)
    recorded = [topic for topic in types if not topic.startswith(OWN) and topic not in EVERYWHERE]
    wanted = recorded if topics is None else [*map(absolute_name, topics)]
    if lacking := [topic for topic in wanted if topic not in types]:
        close = nearest(lacking[0], recorded)
        hint = f"did you mean {close}?" if close else f"it has {first_few(sorted(recorded))}"
        raise RecordingError(f"{bag}: expected the topic {lacking[0]}, found none", hint)
    streams = [read_bag(path, topic, types[topic]) for topic in wanted]
    if not any(one.messages for one in streams):
        where = f" on {first_few(wanted)}" if wanted else ""
        raise RecordingError(f"{bag}: expected messages to play, found none{where}")
    began_ns = min(one.began_ns for one in streams)
    for one in streams:
        times_ns = tuple(round((one.began_ns - began_ns + message.t_ns) / rate) for message in one.messages)
        yield Publish(one.topic, one.type, tuple(message.cdr for message in one.messages), times_ns=times_ns)


def _refuse_no_rate(what: str, rate: Any) -> None:
    if not is_number(rate) or not 0 < rate < math.inf:
        raise ValueError(f"{what}: expected a rate above 0, found {rate!r}")


def length_of(commands: Iterable[Publish]) -> float:
    """Return how many seconds it takes until the last message of recorded publications."""
    return seconds(max((command.times_ns[-1] for command in commands), default=0))
