"""What one part of a rubric says about another: names that must exist, come first, or be unique."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import Any

from grader.model.quantities import duration
from grader.model.scenario import Stimulus, TimeBetween, is_open, longest, longest_course_ns, shortest
from grader.reading.quoting import listed, shown
from grader.reading.rubric_drawing import DrawnLongTimeShape, DrawnTimeShape, time_of
from grader.reading.rubric_mistakes import nearest
from grader.reading.rubric_model import CriterionShape, RubricShape, ScenarioShape
from grader.reading.rubric_stimuli import stimulus_of
from grader.reading.yaml_tree import TOP, Mistake, TreePath, YamlTree


def broken_links(rubric: RubricShape, tree: YamlTree) -> list[Mistake]:
    """Return the mistakes of a rubric whose every part is well formed by itself.

    Args:
        rubric: The rubric.
        tree: The document it came from, for places.
    """
    scenario_ids = [scenario.id for scenario in rubric.scenarios]
    criterion_ids = [criterion.id for criterion in rubric.criteria]
    return [
        *_repeated(rubric.files, ("files",), tree),
        *_repeated(scenario_ids, ("scenarios",), tree, "id"),
        *_repeated(criterion_ids, ("criteria",), tree, "id"),
        *(m for i, scenario in enumerate(rubric.scenarios) for m in _in_scenario(scenario, i, rubric.files, tree)),
        *(m for i, criterion in enumerate(rubric.criteria) for m in _in_criterion(criterion, i, rubric, tree)),
    ]


def _repeated(names: Sequence[str], path: TreePath, tree: YamlTree, key: str = "") -> Iterator[Mistake]:
    for index, name in enumerate(names):
        if name in names[:index]:
            where = tree.values.get((*path, index, key) if key else (*path, index), TOP)
            what = f"each {key or 'name'} in `{path[-1]}` once"
            yield where.mistake(f"expected {what}, found `{shown(name)}` again")


def _unknown(name: str, known: Iterable[str], what: str, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    known = list(dict.fromkeys(known))
    if name not in known:
        text = f"expected {what} ({listed([shown(one, 40) for one in known])}), found `{shown(name)}`"
        yield tree.values.get(path, TOP).mistake(text, nearest(name, known))


def _in_scenario(scenario: ScenarioShape, index: int, files: Sequence[str], tree: YamlTree) -> Iterator[Mistake]:
    path: TreePath = ("scenarios", index)
    yield from _repeated(scenario.processes, (*path, "processes"), tree)
    for number, process in enumerate(scenario.processes):
        yield from _unknown(process, files, "one of `files`", (*path, "processes", number), tree)
    yield from _repeated(scenario.may_exit, (*path, "may_exit"), tree)
    for number, process in enumerate(scenario.may_exit):
        yield from _unknown(process, scenario.processes, "one of `processes`", (*path, "may_exit", number), tree)
    for process, start_ns in scenario.start.items():
        yield from _key_unknown(process, scenario.processes, (*path, "start", process), tree)
        yield from _too_late(start_ns, scenario, (*path, "start", process), tree)
    for number, stimulus in enumerate(scenario.stimuli):
        kind, parameters = stimulus.chosen
        yield from _in_stimulus(kind, parameters, scenario, (*path, "stimuli", number, kind), tree)
        yield from _cut_off(stimulus_of(stimulus), scenario, (*path, "observe", "duration"), tree)


def _key_unknown(name: str, known: Sequence[str], path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    if name not in known:
        text = f"expected one of `processes` ({listed([shown(one, 40) for one in known])}), found `{shown(name)}`"
        yield tree.keys.get(path, TOP).mistake(text, nearest(name, known))


def _too_late(
    start: int | DrawnTimeShape | DrawnLongTimeShape, scenario: ScenarioShape, path: TreePath, tree: YamlTree
) -> Iterator[Mistake]:
    if (
        longest(time_of(start)) >= shortest(time_of(scenario.observe.duration))
        and scenario.observe.after_first_message_on is None
    ):
        yield tree.values.get(path, TOP).mistake("expected a start before the end of `observe`")


def _in_stimulus(
    kind: str, parameters: Any, scenario: ScenarioShape, path: TreePath, tree: YamlTree
) -> Iterator[Mistake]:
    yield from _too_late(parameters.start, scenario, (*path, "start"), tree)
    if kind == "numbers" and shortest(time_of(parameters.hold)) < parameters.period:
        text = "expected each number to be held for at least one period, found a shorter `hold`"
        yield tree.values.get((*path, "hold"), TOP).mistake(text)
    stop_ns = getattr(parameters, "stop", None)
    if stop_ns is not None and stop_ns <= longest(time_of(parameters.start)):
        yield tree.values.get((*path, "stop"), TOP).mistake("expected a stop after the start")


def _cut_off(stimulus: Stimulus, scenario: ScenarioShape, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    """Yield the mistake that some draw leaves out a case, because the observation ends before it."""
    observed = time_of(scenario.observe.duration)
    needed_ns = longest_course_ns(stimulus)
    if (isinstance(observed, TimeBetween) or is_open(stimulus)) and needed_ns > shortest(observed):
        text = f"expected at least {duration(needed_ns)}, so that every case comes whatever is drawn, found "
        text += f"{'as little as ' if isinstance(observed, TimeBetween) else ''}{duration(shortest(observed))}"
        yield tree.values.get(path, TOP).mistake(text)


def _in_criterion(criterion: CriterionShape, index: int, rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    path: TreePath = ("criteria", index)
    scenarios = {scenario.id: scenario for scenario in rubric.scenarios}
    yield from _unknown(criterion.scenario, scenarios, "the id of a scenario", (*path, "scenario"), tree)
    yield from _needs(criterion, index, rubric, tree)
    name, parameters = criterion.check.chosen
    process = parameters.model_dump(by_alias=True).get("process")
    if isinstance(process, str) and criterion.scenario in scenarios:
        known = scenarios[criterion.scenario].processes
        what = f"a process of the scenario {criterion.scenario}"
        yield from _unknown(process, known, what, (*path, "check", name, "process"), tree)


def _needs(criterion: CriterionShape, index: int, rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    """Yield the needs that name no earlier criterion; so there are no cycles."""
    path: TreePath = ("criteria", index, "needs")
    earlier = [other.id for other in rubric.criteria[:index]]
    yield from _repeated(criterion.needs, path, tree)
    for number, need in enumerate(criterion.needs):
        where = tree.values.get((*path, number), TOP)
        if need == criterion.id:
            yield where.mistake(f"expected an earlier criterion, found `{need}` itself")
        elif need in (other.id for other in rubric.criteria[index:]):
            yield where.mistake(f"expected an earlier criterion, found `{need}`, which comes later", "change the order")
        elif not earlier:
            yield where.mistake(f"expected no needs in the first criterion, found `{need}`")
        else:
            yield from _unknown(need, earlier, "the id of an earlier criterion", (*path, number), tree)
