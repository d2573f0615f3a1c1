"""Tries the simulations of a rubric when it is read: an author learns of a mistake before a student's file runs."""

from __future__ import annotations

import random
from collections.abc import Iterable, Iterator, Mapping
from contextlib import suppress
from dataclasses import field
from functools import lru_cache, partial
from itertools import islice
from typing import Any

from grader.grading.rubrics.model import RubricShape, ScenarioShape
from grader.grading.rubrics.types import plain_value
from grader.grading.rubrics.yaml_tree import Mistake, TreePath, YamlTree
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError
from grader.runtime.model.scenario import Between, Choose, FieldSpec, Stimulus, Written
from grader.runtime.model.wording import printable
from grader.runtime.simulation import SHORTEST_PERIOD_NS, SIMULATIONS, Moment, Output, RobotInMap, types_heard
from grader.runtime.simulation.loading import begin_of, guarded, made_simulation
from grader.runtime.stimuli import Simulated

#: How many steps and messages of a step are tried.
STEPS, OUTPUTS = 3, 20


@dataclass(frozen=True, slots=True)
class Offered:
    """What a simulation publishes, hears and serves, by name and type, and what it publishes in its first steps."""

    publishes: Mapping[str, str]
    hears: Mapping[str, tuple[str, ...]]
    serves: Mapping[str, str]
    outputs: tuple[Output, ...]
    records: Mapping[str, str] = field(default_factory=dict)  # what is only recorded

    @property
    def types(self) -> set[str]:
        """The types of all of it."""
        return {type_ for _, type_ in self.ends()}

    def ends(self) -> Iterator[tuple[str, str]]:
        """Yield the topics and services with their types: a topic once for each type that it hears there."""
        yield from self.publishes.items()
        yield from ((topic, type_) for topic, types in self.hears.items() for type_ in types)
        yield from self.serves.items()
        yield from self.records.items()


def simulated_in(rubric: RubricShape) -> Iterator[tuple[TreePath, Simulated]]:
    """Yield the simulations of a rubric, each with the place of its name."""
    for index, scenario in enumerate(rubric.scenarios):
        for number, shape in enumerate(scenario.stimuli):
            if shape.chosen[0] == Simulated.key:
                chosen = shape.chosen[1]
                yield ("scenarios", index, "stimuli", number, Simulated.key, chosen.chosen[0]), plain_value(chosen)


@lru_cache(maxsize=32)
def offered(simulated: Simulated) -> Offered:
    """Try a simulation with the first value that each parameter may have; raises HarnessError if it fails.

    Once for all draws of a scenario, which have the same simulation.
    """
    parameters = {name: _first(spec) for name, spec in simulated.parameters.items()}
    one = made_simulation(simulated.name, simulated.path, simulated.content, parameters, dict(simulated.maps))
    call = partial(guarded, simulated.name, simulated.path)
    call(lambda: one.begin(random.Random(0)))  # noqa: S311  the same at each reading
    if not (isinstance(one.period, int) and one.period >= SHORTEST_PERIOD_NS):
        raise HarnessError(
            f"the simulation `{simulated.name}` has a period of {one.period!r} ns, expected at least 1 ms"
        )
    publishes, hears, serves, records = (
        call(lambda method=method: dict(getattr(one, method)()), begin_of(one, method, simulated.path))  # type: ignore[misc]
        for method in ("publishes", "hears", "serves", "records")
    )
    hears = types_heard(hears)
    outputs: list[Output] = []
    for number in range(STEPS):
        now = Moment(number * one.period, number * one.period)
        outputs += call(lambda now=now: list(islice(one.step(now), OUTPUTS)), begin_of(one, "step", simulated.path))  # type: ignore[misc]
    call(lambda: list(one.drawing()), begin_of(one, "drawing", simulated.path))
    wrong = [output for output in outputs if not _is_output(output, {**publishes, **records})]
    if wrong:
        text = (
            f"the simulation `{simulated.name}` publishes {printable(str(wrong[0]), 80)}, expected one of its topics "
        )
        raise HarnessError(f"{text}({', '.join(publishes) or 'it has none'}) and a mapping of fields")
    return Offered(publishes, hears, serves, tuple(outputs), records)


def _first(spec: FieldSpec) -> Any:
    if isinstance(spec, Between):
        return spec.low
    if isinstance(spec, Choose):
        return spec.options[0]
    if isinstance(spec, Written):
        return spec.text.replace("{}", f"{spec.number.low:.{spec.decimals}f}")
    if isinstance(spec, Mapping):
        return {name: _first(inner) for name, inner in spec.items()}
    return tuple(map(_first, spec)) if isinstance(spec, tuple) else spec


def _is_output(output: object, topics: Mapping[str, str]) -> bool:
    return isinstance(output, tuple) and len(output) == 2 and output[0] in topics and isinstance(output[1], Mapping)


def published_by(stimulus: Stimulus) -> Iterable[str]:
    """Return the topics that a stimulus publishes on; none for a simulation that fails, which another rule tells."""
    if isinstance(stimulus, Simulated):
        return [topic for one in offered_by([stimulus]) for topic in (*one.publishes, *one.records)]
    topic = getattr(stimulus, "topic", "")
    return [topic] if topic else []


def offered_by(stimuli: Iterable[Stimulus]) -> Iterator[Offered]:
    """Yield what the simulations among stimuli offer; nothing of one that fails, which another rule tells."""
    for stimulus in stimuli:
        if isinstance(stimulus, Simulated):
            with suppress(HarnessError):
                yield offered(stimulus)


def simulation_mistakes(rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    """Yield simulations that fail, and those that publish or serve what another stimulus of the scenario does."""
    taken = {index: _names_of_others(scenario) for index, scenario in enumerate(rubric.scenarios)}
    for path, simulated in simulated_in(rubric):
        where = tree.at_key(path)
        try:
            found = offered(simulated)
        except HarnessError as error:
            yield where.mistake(f"expected a simulation that runs, found that {error.message}")
            continue
        yield from _unknown_maps(simulated, tree, path)
        names, others = {*found.publishes, *found.serves, *found.records}, taken[int(path[1])]
        for name in sorted(names & others):
            yield where.mistake(f"expected topics and services that no other stimulus has, found `{name}` again")
        others |= names


def _unknown_maps(simulated: Simulated, tree: YamlTree, path: TreePath) -> Iterator[Mistake]:
    """Yield the names of maps that the rubric does not list, of which a seed may draw another one than the first."""
    kind = SIMULATIONS.get(simulated.name)
    asked = simulated.parameters.get("map") if kind is not None and issubclass(kind, RobotInMap) else None
    options = asked.options if isinstance(asked, Choose) else [asked] if asked else []
    known = dict(simulated.maps)
    for name in options:
        if name not in known:
            text = f"expected a map that the rubric lists under `maps` ({', '.join(known) or 'it lists none'})"
            yield tree.at((*path, "map")).mistake(f"{text}, found `{printable(str(name))}`")


def _names_of_others(scenario: ScenarioShape) -> set[str]:
    """Return the topics and services of the stimuli that are not simulations."""
    stimuli = [plain_value(shape) for shape in scenario.stimuli]
    return {getattr(s, key) for s in stimuli for key in ("topic", "service") if hasattr(s, key)}
