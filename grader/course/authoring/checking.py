"""Checks a rubric for its author: whether it is valid, its points, and likely mistakes."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import suppress
from dataclasses import fields, replace
from fractions import Fraction
from pathlib import Path
from typing import Any

from grader.grading.app.bags import recordings_of
from grader.grading.app.interfaces import known_interfaces
from grader.grading.app.test_files import collect_tests
from grader.grading.judging.checks import CHECKS
from grader.grading.judging.tested import TESTED
from grader.grading.model.exercise import Criterion, Exercise, roles_of, texts_under
from grader.grading.rubrics.check_parameters import manual_of
from grader.grading.rubrics.draws import First
from grader.grading.rubrics.loader import RubricMistakes, read_rubric
from grader.grading.rubrics.mistakes import Mistake, TreePath, YamlTree, read_yaml
from grader.grading.rubrics.simulations import Offered, offered
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import HarnessError, RecordingError, RubricError
from grader.runtime.model.quantities import duration
from grader.runtime.model.scenario import Scenario, is_launch_file, shortest
from grader.runtime.model.wording import printable
from grader.runtime.stimuli import ActionServer, RecordedStream, Simulated

#: The points of a rubric should add up to a multiple of this, for easy arithmetic.
ROUND = 5
#: Check parameters with a duration that must fit into the scenario.
_STRETCHES = ("window", "silence")
#: Checks of the graph, where a service is seen that nobody calls.
_SEEN = ("service_available",)
#: How alike two names are of which one is taken for a misspelling of the other.
_ALIKE = 0.8


def oddities(exercise: Exercise, tree: YamlTree) -> list[Mistake]:
    """Return warnings about a rubric, in the order of the file."""
    again = {id_ for further in exercise.draws.values() for id_ in further}
    exercise = replace(exercise, scenarios=tuple(s for s in exercise.scenarios if s.id not in again))
    found = list(_of_exercise(exercise, tree))
    for index, criterion in enumerate(exercise.criteria):
        path: TreePath = ("pytest",) if criterion.check_name == TESTED else ("criteria", index)
        found += _of_criterion(criterion, exercise, path, tree)
    return sorted(set(found))


def _of_exercise(exercise: Exercise, tree: YamlTree) -> Iterator[Mistake]:
    total = sum((criterion.points for criterion in exercise.criteria), Fraction(0))
    if total % ROUND:
        text = f"the points add up to {float(total):g}, which is not a multiple of {ROUND}"
        yield tree.at_key(("criteria",) if ("criteria",) in tree.keys else ("pytest",)).mistake(text)
    judged = {criterion.scenario for criterion in exercise.criteria}
    for index, scenario in enumerate(exercise.scenarios):
        if scenario.id not in judged:
            text = f"the scenario {scenario.id} is recorded, but no criterion uses it"
            yield tree.at(("scenarios", index, "id")).mistake(text)
    yield from _misspelt(exercise, tree)
    run = {process for scenario in exercise.scenarios for process in scenario.wanted}
    if any(scenario.test is not None for scenario in exercise.scenarios):
        run |= {*exercise.files}  # only a run shows what a test starts
    for index, name in enumerate(exercise.files):
        if name not in run:
            yield tree.at(("files", index)).mistake(f"{name} is in `files`, but no scenario runs it")


def _of_criterion(criterion: Criterion, exercise: Exercise, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    where = tree.at(path if criterion.check_name == TESTED else (*path, "id"))
    kind = type(criterion.check)
    if not criterion.hint:
        yield where.mistake(f"{criterion.id} has no hint: a student who does not meet it may get no advice")
    if kind not in CHECKS.values() and not manual_of(kind).summary:
        yield where.mistake(f"{criterion.id} is judged by {kind.__name__}, which has no docstring to explain it")
    scenario = next(s for s in exercise.scenarios if s.id == criterion.scenario)
    if criterion.check_name == TESTED or scenario.handed_in is not None:
        return
    yield from _of_stretches(criterion, scenario, path, tree)
    yield from _of_inputs(criterion, exercise, path, tree)


def _of_inputs(criterion: Criterion, exercise: Exercise, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    """Yield topics, services and actions that the check waits for and nobody uses in the scenario."""
    name, scenario = criterion.check_name, next(s for s in exercise.scenarios if s.id == criterion.scenario)
    given, others = _given(scenario), len(scenario.processes) > 1 or any(map(is_launch_file, scenario.processes))
    own = {topic for other in exercise.criteria for topic in _published(other)}
    roles = roles_of(type(criterion.check))
    for parameter in roles.given or (() if others else _needed(criterion)):
        asked = getattr(criterion.check, parameter)
        known = set() if roles.given else own
        if asked not in given | known and not any(end[:1] == "~" and asked.endswith(end[1:]) for end in given):
            what = "publishes on" if parameter in (*roles.given, *roles.hears) else "uses"
            text = f"no stimulus of {scenario.id} {what} {printable(asked)}{_did_you_mean(asked, given)}"
            yield tree.at((*path, "check", name, parameter)).mistake(text)


def _needed(criterion: Criterion) -> tuple[str, ...]:
    """Return the parameters whose topics, services and actions another program or the grader has to use."""
    roles = roles_of(type(criterion.check))
    asked = () if criterion.check_name in _SEEN else (*roles.hears, *roles.serves, *roles.calls, *roles.actions)
    return tuple(parameter for parameter in asked if texts_under(criterion.check, parameter))


def _published(criterion: Criterion) -> Iterator[str]:
    """Yield the topics that a criterion expects the student's nodes to publish on."""
    other = (*roles_of(type(criterion.check)).given, *_needed(criterion))
    yield from texts_under(criterion.check, *(parameter for parameter in ("topic", "output") if parameter not in other))


def _given(scenario: Scenario) -> set[str]:
    """Return the topics, services and actions that the stimuli of a scenario use."""
    names = {getattr(one, key) for one in scenario.stimuli for key in _ENDS if hasattr(one, key)}
    offered_by_plan = (one.action for one in scenario.stimuli if isinstance(one, ActionServer))
    names |= {f"{action}/_action/{topic}" for action in offered_by_plan for topic in ("feedback", "status")}
    for one in _simulations(scenario):
        names |= {*one.publishes, *one.serves, *one.records}
    return names


_ENDS = ("topic", "service", "action")


def _simulations(scenario: Scenario) -> Iterator[Offered]:
    for one in scenario.stimuli:
        if isinstance(one, Simulated):
            with suppress(HarnessError):  # it was tried when the rubric was read
                yield offered(one)


def _misspelt(exercise: Exercise, tree: YamlTree) -> Iterator[Mistake]:
    """Yield what stimuli use and no check names, if a check names something very similar that no stimulus uses."""
    asked = (getattr(c.check, key, None) for c in exercise.criteria for key in (*_ENDS, "input", "output", "goals"))
    named = {name for name in asked if isinstance(name, str)}
    used = {name for scenario in exercise.scenarios for name in (*_given(scenario), *_heard(scenario))}
    for index, scenario in enumerate(exercise.scenarios):
        for number, stimulus in enumerate(scenario.stimuli):
            place: TreePath = ("scenarios", index, "stimuli", number)
            own = {getattr(stimulus, key) for key in _ENDS if hasattr(stimulus, key)}
            if isinstance(stimulus, Simulated):
                alone = replace(scenario, stimuli=(stimulus,))
                own = {*_given(alone), *_heard(alone)}
            for name in sorted(own - named):
                hint = _did_you_mean(name, named - used)
                if hint:
                    yield tree.at(place).mistake(f"no criterion uses {printable(name)}{hint}")


def _heard(scenario: Scenario) -> set[str]:
    return {name for one in _simulations(scenario) for name in one.hears}


def _did_you_mean(name: str, known: Iterable[str]) -> str:
    near = difflib.get_close_matches(name, sorted(known), n=1, cutoff=_ALIKE)
    return f": did you mean {printable(near[0])}?" if near else ""


def _of_stretches(criterion: Criterion, scenario: Scenario, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    observed = shortest(scenario.span.duration_ns)
    check: Any = criterion.check
    for field in fields(check):
        asked = getattr(check, field.name)
        if field.name in _STRETCHES and isinstance(asked, int) and asked > observed:
            text = f"{field.name} is {duration(asked)}, but {scenario.id} is observed for {duration(observed)} only"
            yield tree.at((*path, "check", criterion.check_name, field.name)).mistake(text)


@dataclass(frozen=True, slots=True)
class Checked:
    """A valid rubric: a summary in one line, and warnings with line and column."""

    summary: str
    warnings: tuple[str, ...]


def check_rubric(path: Path, course: tuple[Path, ...] = ()) -> Checked:
    """Check a rubric, which may use the interface packages of a course; raises RubricError with every mistake.

    Of a rubric with tests, pytest has to collect the ones that were read; raises EnvironmentFault where it is missing.
    """
    exercise = read_rubric(path, draw=First(), interfaces=known_interfaces(course))
    _read_recordings(path, exercise)
    collect_tests(path, exercise, course)
    where = printable(str(path), 500)
    odd = oddities(exercise, read_yaml(path.read_text(encoding="utf-8-sig")))
    return Checked(f"{where}: {_summary(exercise)}", tuple(f"{where}:{m.line}:{m.column}: {m.text}" for m in odd))


def _read_recordings(path: Path, exercise: Exercise) -> None:
    """Read what the scenarios play, as grading does; raises RubricError, with the place of the stimulus."""
    tree = read_yaml(path.read_text(encoding="utf-8-sig"))
    for index, scenario in enumerate(exercise.scenarios):
        for number, stimulus in enumerate(scenario.stimuli):
            if isinstance(stimulus, RecordedStream) and stimulus.bag:
                where = tree.at(("scenarios", index, "stimuli", number, "recorded", "bag"))
                try:
                    recordings_of([stimulus], tuple(map(Path, exercise.interfaces)))
                except RecordingError as error:
                    raise RubricMistakes(
                        printable(str(path), 500), [where.mistake(error.message, error.hint)]
                    ) from None


def complaints(error: RubricError) -> list[str]:
    """Return all mistakes of a rubric, one line each, each followed by its hint."""
    if not isinstance(error, RubricMistakes):
        hint = [f"hint: {error.hint}"] if error.hint else []
        return [*(f"error: {line}" for line in error.message.splitlines()), *hint]
    lines = []
    for mistake in error.mistakes:
        lines.append(f"error: {error.where}:{mistake.line}:{mistake.column}: {mistake.text}")
        lines += [f"hint: {mistake.hint}"] if mistake.hint else []
    return lines


def _summary(exercise: Exercise) -> str:
    points = sum((criterion.points for criterion in exercise.criteria), Fraction(0))
    written = len(exercise.scenarios) - sum(map(len, exercise.draws.values()))  # without those that `draws` adds
    parts = [_counted(written, "scenario"), _counted(len(exercise.criteria), "criterion", "criteria")]
    return f"{exercise.id}: {', '.join(parts)}, {float(points):g} {'point' if points == 1 else 'points'}"


def _counted(count: int, one: str, many: str = "") -> str:
    return f"{count} {one}" if count == 1 else f"{count} {many or f'{one}s'}"
