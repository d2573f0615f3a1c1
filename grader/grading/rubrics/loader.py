"""Reads rubric files: YAML in, an Exercise out, every mistake with its line and column."""

from __future__ import annotations

import ast
import re
import stat
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from fractions import Fraction
from pathlib import Path
from typing import NoReturn, TypeVar

from pydantic import BaseModel, ValidationError

from grader.grading.judging.authored import is_authored
from grader.grading.judging.checks import CHECKS, NOT_IN_BAGS
from grader.grading.judging.checks.topics import Transform
from grader.grading.judging.tested import TESTED, TestPasses
from grader.grading.model.exercise import Check, Criterion, Exercise, Variant, roles_of, texts_under
from grader.grading.model.rubric_files import rubric_file
from grader.grading.rubrics.author_modules import OwnHints
from grader.grading.rubrics.draws import Draw, First
from grader.grading.rubrics.exercise_checks import hints_of, known_checks
from grader.grading.rubrics.interfaces import Interfaces, interface_mistakes
from grader.grading.rubrics.maps import map_files, maps_of
from grader.grading.rubrics.mistakes import mistakes_of, nearest_hint
from grader.grading.rubrics.model import CriterionShape, RubricShape, ScenarioShape, feedback_of, rubric_model
from grader.grading.rubrics.own_checks import (
    OwnFile,
    OwnSimulation,
    bag_files,
    definition_files,
    load_checks,
    load_hints,
    load_simulations,
    named_bags,
    named_files,
    own_files,
    rubric_digest,
)
from grader.grading.rubrics.run_options import RunShape
from grader.grading.rubrics.simulations import published_by, simulation_mistakes
from grader.grading.rubrics.tests import AuthoredTest, tests_in
from grader.grading.rubrics.types import (
    BESIDE,
    CHECK_FILE,
    MAP_FILE,
    MAP_WORDS,
    PROVIDED_FILE,
    PROVIDED_WORDS,
    plain_value,
)
from grader.grading.rubrics.variants import (
    VariantOptions,
    Variants,
    has_variants,
    options_of,
    tried,
    varied_digest,
    with_values,
)
from grader.grading.rubrics.yaml_tree import (
    TOP,
    Mistake,
    Position,
    TreePath,
    YamlSyntaxError,
    YamlTree,
    end_of,
    read_yaml,
)
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import RubricError
from grader.runtime.model.limits import MAX_RUBRIC_BYTES, Limits
from grader.runtime.model.quantities import duration
from grader.runtime.model.scenario import (
    Connection,
    HandedInBag,
    RubricTest,
    RunOptions,
    Scenario,
    Span,
    Stimulus,
    Time,
    TimeBetween,
    is_launch_file,
    longest,
    shortest,
)
from grader.runtime.model.wording import listed, printable
from grader.runtime.simulation import WallMap


def broken_links(rubric: RubricShape, tree: YamlTree) -> list[Mistake]:
    """Return the mistakes between the parts of a rubric, each of which is well formed by itself."""
    scenario_ids = [scenario.id for scenario in rubric.scenarios]
    drawn = [f"{one.id}_draw_{n}" for one in rubric.scenarios for n in range(2, one.draws + 1)]
    criterion_ids = [criterion.id for criterion in rubric.criteria]
    return [
        *_repeated(rubric.files, ("files",), tree),
        *_repeated(rubric.provided, ("provided",), tree),
        *_both(rubric, tree),
        *_repeated(scenario_ids, ("scenarios",), tree, "id"),
        *(
            tree.at(("scenarios", n, "id")).mistake(f"expected another id, found `{id_}`, the name of a further draw")
            for n, id_ in enumerate(scenario_ids)
            if id_ in drawn
        ),
        *_repeated(criterion_ids, ("criteria",), tree, "id"),
        *(m for i, scenario in enumerate(rubric.scenarios) for m in _in_scenario(scenario, i, rubric, tree)),
        *(m for i, criterion in enumerate(rubric.criteria) for m in _in_criterion(criterion, i, rubric, tree)),
    ]


def _repeated(names: Sequence[str], path: TreePath, tree: YamlTree, key: str = "") -> Iterator[Mistake]:
    for index, name in enumerate(names):
        if name in names[:index]:
            text = f"expected each {key or 'name'} in `{path[-1]}` once, found `{printable(name)}` again"
            yield tree.at((*path, index, key) if key else (*path, index)).mistake(text)


def _unknown(name: str, known: Iterable[str], what: str, where: Position) -> Iterator[Mistake]:
    known = list(dict.fromkeys(known))
    if name not in known:
        text = f"expected {what} ({listed([printable(one, 40) for one in known])}), found `{printable(name)}`"
        yield where.mistake(text, nearest_hint(name, known))


def _both(rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    for index, name in enumerate(rubric.provided):
        if name in rubric.files:
            text = f"expected a file that students do not hand in, found `{printable(name)}`, which is in `files`"
            yield tree.at(("provided", index)).mistake(text)


def _in_scenario(scenario: ScenarioShape, index: int, rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    path: TreePath = ("scenarios", index)
    if scenario.handed_in is not None:
        yield from _beside_bag(scenario, path, tree)
        return
    yield from _repeated(scenario.processes, (*path, "processes"), tree)
    programs = [name for name in (*rubric.files, *filter(is_launch_file, rubric.provided)) if not _is_yaml(name)]
    one_of = "one of `files`" if len(programs) == len(rubric.files) else "a program in `files` or `provided`"
    for number, process in enumerate(scenario.processes):
        yield from _unknown(process, programs, one_of, tree.at((*path, "processes", number)))
    for process, options in scenario.run.items():
        yield from _in_run(process, options, rubric, (*path, "run", process), tree)
    yield from _repeated(scenario.may_exit, (*path, "may_exit"), tree)
    known, what = scenario.processes, "one of `processes`"
    for number, process in enumerate(scenario.may_exit):
        yield from _unknown(process, known, what, tree.at((*path, "may_exit", number)))
    observed: Span = plain_value(scenario.observe)
    for process in scenario.run:
        yield from _unknown(process, known, what, tree.at_key((*path, "run", process)))
    for process, start in scenario.start.items():
        yield from _unknown(process, known, what, tree.at_key((*path, "start", process)))
        yield from _too_late(plain_value(start), observed, (*path, "start", process), tree)
    connections: tuple[Connection, ...] = plain_value(scenario.connections)
    for number, shape in enumerate(scenario.stimuli):
        stimulus = plain_value(shape)
        yield from _in_stimulus(stimulus, observed, (*path, "stimuli", number, shape.chosen[0]), tree)
        late_ns = max((longest(one.delay_ns) for one in connections if one.topic in published_by(stimulus)), default=0)
        yield from _cut_off(stimulus, observed, late_ns, (*path, "observe", "duration"), tree)
    yield from _in_connections(connections, scenario, observed, path, tree)


def _beside_bag(scenario: ScenarioShape, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    """Yield the keys of a scenario that only a run has."""
    for key in sorted(scenario.model_fields_set - {"id", "handed_in"}):
        text = f"expected nothing but `handed_in` for a recording that students hand in, found `{key}`"
        yield tree.at_key((*path, key)).mistake(text, "what programs do is judged in a scenario of its own")


def _in_connections(
    connections: Sequence[Connection], scenario: ScenarioShape, observed: Span, path: TreePath, tree: YamlTree
) -> Iterator[Mistake]:
    yield from _repeated([one.topic for one in connections], (*path, "connections"), tree, "topic")
    published = [topic for shape in scenario.stimuli for topic in published_by(plain_value(shape))]
    for number, one in enumerate(connections):
        here = (*path, "connections", number)
        yield from _unknown(one.topic, published, "a topic that a stimulus publishes on", tree.at((*here, "topic")))
        yield from _too_late(one.delay_ns, observed, (*here, "delay"), tree, "a delay shorter than")
        if not longest(one.delay_ns) and not one.lose:
            yield tree.at(here).mistake("expected a `delay`, or a share of messages to `lose`, found neither")


def _is_yaml(name: str) -> bool:
    """Return whether a file is one of parameters, by its name."""
    return name.endswith((".yaml", ".yml")) and not is_launch_file(name)


def _in_run(process: str, options: RunShape, rubric: RubricShape, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    if options.parameters_file is not None:
        known = [name for name in (*rubric.files, *rubric.provided) if _is_yaml(name)]
        what, where = "a YAML file in `files` or `provided`", tree.at((*path, "parameters_file"))
        if known:
            yield from _unknown(options.parameters_file, known, what, where)
        else:
            yield where.mistake(f"expected {what}, found none there")
    for key in options.model_fields_set:
        if is_launch_file(process) and key != "launch_arguments":
            text = f"expected only `launch_arguments` for a launch file, found `{key}`"
            yield tree.at_key((*path, key)).mistake(text, "a launch file itself says what its nodes are given")
        if not is_launch_file(process) and key == "launch_arguments":
            text = f"expected `launch_arguments` for a launch file only, found it for `{printable(process)}`"
            yield tree.at_key((*path, key)).mistake(text, "name launch files like robot.launch.py")


def _too_late(
    start: Time, observed: Span, path: TreePath, tree: YamlTree, what: str = "a start before the end of"
) -> Iterator[Mistake]:
    if longest(start) >= shortest(observed.duration_ns) and observed.after_first_message_on is None:
        yield tree.at(path).mistake(f"expected {what} `observe`")


def _in_stimulus(stimulus: Stimulus, observed: Span, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    yield from _too_late(stimulus.start_ns, observed, (*path, "start"), tree)
    for key, expected in stimulus.mistakes():
        yield tree.at((*path, key)).mistake(expected)


def _cut_off(stimulus: Stimulus, observed: Span, late_ns: int, path: TreePath, tree: YamlTree) -> Iterator[Mistake]:
    """Yield a mistake if, for some draw, the observation ends before a case comes; `late_ns` is its time on the way."""
    time, needed_ns = observed.duration_ns, stimulus.course_ns() + late_ns
    if (isinstance(time, TimeBetween) or stimulus.is_open()) and needed_ns > shortest(time):
        text = f"expected at least {duration(needed_ns)}, so that every case is played whatever is drawn, found "
        text += f"{'as little as ' if isinstance(time, TimeBetween) else ''}{duration(shortest(time))}"
        yield tree.at(path).mistake(text)


def _in_criterion(criterion: CriterionShape, index: int, rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    path: TreePath = ("criteria", index)
    scenarios = {scenario.id: scenario for scenario in rubric.scenarios}
    yield from _unknown(criterion.scenario, scenarios, "the id of a scenario", tree.at((*path, "scenario")))
    yield from _needs(criterion, index, rubric, tree)
    name, parameters = criterion.check.chosen
    if criterion.scenario in scenarios and scenarios[criterion.scenario].handed_in is not None:
        if name in NOT_IN_BAGS:
            text = f"expected a check of messages, found `{name}`: no recording holds {NOT_IN_BAGS[name]}"
            where = tree.at_key((*path, "check", name))
            yield where.mistake(text, "judge it in a scenario that runs the program")
        return
    process = parameters.model_dump(by_alias=True).get("process")
    if isinstance(process, str) and criterion.scenario in scenarios:
        known = scenarios[criterion.scenario].processes
        what = f"a process of the scenario {criterion.scenario}"
        if any(map(is_launch_file, known)):  # what it starts goes by the names of the files that are handed in
            known = (*known, *(name for name in rubric.files if not _is_yaml(name)))
        yield from _unknown(process, known, what, tree.at((*path, "check", name, "process")))


def _needs(criterion: CriterionShape, index: int, rubric: RubricShape, tree: YamlTree) -> Iterator[Mistake]:
    """Yield the needs that are not earlier criteria; this rule prevents cycles."""
    path: TreePath = ("criteria", index, "needs")
    earlier = [other.id for other in rubric.criteria[:index]]
    yield from _repeated(criterion.needs, path, tree)
    for number, need in enumerate(criterion.needs):
        where = tree.at((*path, number))
        if need == criterion.id:
            yield where.mistake(f"expected an earlier criterion, found `{need}` itself")
        elif need in (other.id for other in rubric.criteria[index:]):
            yield where.mistake(f"expected an earlier criterion, found `{need}`, which comes later", "change the order")
        elif not earlier:
            yield where.mistake(f"expected no needs in the first criterion, found `{need}`")
        else:
            yield from _unknown(need, earlier, "the id of an earlier criterion", tree.at((*path, number)))


_Model = TypeVar("_Model", bound=BaseModel)


#: The key of a ROS parameter file that holds the parameters of a node.
PARAMETERS_KEY = "ros__parameters"

#: Maximum number of mistakes listed at once.
MAX_MISTAKES = 10


class RubricMistakes(RubricError):  # noqa: N818  named after what it holds
    """A rubric has mistakes; the message lists the first ones."""

    def __init__(self, where: str, mistakes: Iterable[Mistake]) -> None:
        self.where = where
        self.mistakes = tuple(sorted(set(mistakes)))
        lines = [f"{where}:{m.line}:{m.column}: {m.text}" for m in self.mistakes[:MAX_MISTAKES]]
        if len(self.mistakes) > MAX_MISTAKES:
            lines.append(f"{where}: {len(self.mistakes) - MAX_MISTAKES} more")
        hinted = [m for m in self.mistakes[:MAX_MISTAKES] if m.hint]
        hints = [m.hint if len(self.mistakes) == 1 else f"{m.line}:{m.column}: {m.hint}" for m in hinted]
        super().__init__("\n".join(lines), "; ".join(hints))


@dataclass(frozen=True, slots=True)
class _Brought:
    """What a rubric may use, by name: checks, the grader's among them, its own simulations, texts of provided files.

    Its hint rules are in the order of their files, and its tests in that of their file.
    """

    checks: Mapping[str, type]
    own: frozenset[str]  # the names of its own checks
    simulations: Mapping[str, OwnSimulation]
    maps: Mapping[str, WallMap]
    provided: Mapping[str, str]
    hints: OwnHints
    test_file: OwnFile | None = None
    tests: tuple[AuthoredTest, ...] = ()


def read_rubric(
    path: Path,
    *,
    checks: Mapping[str, type] | None = None,
    submissions: Sequence[Path] = (),
    draw: Draw | None = None,
    interfaces: Interfaces | None = None,
) -> Exercise:
    """Read a rubric file; its own checks and hint rules, if any, are run.

    Args:
        path: The file, or another name for it (`rubric_file`); messages show it as given.
        checks: Checks that the rubric may use, besides its own; by default those that come with the grader.
        submissions: Folders that students write to: checks are never loaded from there.
        draw: Chooses the values of variants; without it, a rubric with variants is rejected.
        interfaces: The installed types, which the rubric's types and field paths must be among; not checked if None.

    Raises:
        RubricError: The file cannot be read, or has mistakes; one line each, in the order of the file.
    """
    path = rubric_file(path)
    content = _content(path)
    tree = _tree(path, content)
    files = own_files(path, _own_names(path, tree, "checks"), submissions)
    hints = own_files(path, _own_names(path, tree, "hints"), submissions, key="hints")
    simulated = own_files(path, _own_names(path, tree, "simulations"), submissions, key="simulations")
    maps = map_files(path, _own_names(path, tree, "maps"), submissions)
    others = own_files(path, _own_names(path, tree, "provided"), submissions, key="provided")
    tests = own_files(path, _own_names(path, tree, "pytest"), submissions, key="pytest")
    own = load_checks(files, CHECKS if checks is None else checks)
    usable = {**(known_checks() if checks is None else checks), **own}
    provided = {one.name: _provided(one) for one in others}
    brought = _Brought(
        usable,
        frozenset(own),
        load_simulations(simulated),
        maps_of(maps),
        provided,
        load_hints(hints, usable),
        next(iter(tests), None),
        tuple(test for file in tests for test in tests_in(file)),
    )
    definitions = definition_files(path, folders := _own_names(path, tree, "interfaces"), submissions)
    bags = bag_files(path, named_bags(tree.data), submissions)
    digest = rubric_digest(
        content, tuple(dict.fromkeys((*files, *hints, *others, *simulated, *maps, *tests, *definitions, *bags)))
    )
    if interfaces is not None and folders:
        interfaces = interfaces.including([path.parent / folder for folder in folders])
    if not has_variants(tree):
        return _exercise(path, tree, brought, digest, interfaces)
    options = options_of(_validated(path, tree, Variants))
    known = {option.name: option.value(0) for option in options}
    nobodys = _exercise(path, with_values(tree, known), brought, digest, interfaces)
    for values in tried(options, known) if draw is None or isinstance(draw, First) else ():
        _exercise(path, with_values(tree, values), brought, digest, interfaces)
    variant = _variant(path, tree, nobodys, options, draw)
    exercise = _exercise(path, with_values(tree, dict(variant.values)), brought, varied_digest(digest, variant))
    return replace(exercise, variant=variant)


def _variant(
    path: Path, tree: YamlTree, exercise: Exercise, options: Sequence[VariantOptions], draw: Draw | None
) -> Variant:
    """Return the drawn values; raises RubricError if no student is given, or a value is not known."""
    if draw is None:
        hint = "name the student and the variant key: --student ID --variant-key FILE"
        text = "expected a student, because this rubric has variants, found none"
        _refuse(path, [tree.keys[("variants",)].mistake(text, hint)])
    values = [(option.name, draw.value(exercise.id, option)) for option in options]
    unknown = [name for name, value in values if value is None]
    if unknown:
        text = "no value was stored for this variant"
        _refuse(path, [tree.keys[("variants", name)].mistake(text, "grade the submission again") for name in unknown])
    return Variant(draw.student, tuple((name, value) for name, value in values if value is not None))


def _provided(file: OwnFile) -> str:
    """Return the text of a provided file; raises RubricError if ROS could not read it."""
    where = printable(str(file.path), 500)
    try:
        text = file.content.decode()
        if is_launch_file(file.name) and not file.name.endswith(".py"):
            return text  # it is read with the nodes that it starts
        if not _is_yaml(file.name):
            ast.parse(text)
            return text
        data = read_yaml(text).data
    except UnicodeDecodeError as error:
        raise RubricError(f"{where}: expected UTF-8 text, found the byte 0x{file.content[error.start]:02x}") from None
    except YamlSyntaxError as error:
        mistake = error.mistake
        raise RubricError(f"{where}:{mistake.line}:{mistake.column}: {mistake.text}", mistake.hint) from None
    except (SyntaxError, ValueError, RecursionError) as error:
        line = getattr(error, "lineno", None) or 1
        raise RubricError(f"{where}:{line}: expected a launch file in Python, found {type(error).__name__}") from None
    if not isinstance(data, dict) or not data or not all(map(_has_parameters, data.values())):
        text = f"{where}: expected a parameter file of ROS, with `ros__parameters` below each node"
        raise RubricError(text, "write: /**: {ros__parameters: {rate: 5.0}}")
    return text


def _has_parameters(value: object) -> bool:
    """Return whether a node or a namespace of a parameter file has parameters."""
    if not isinstance(value, dict) or not value:
        return False
    return isinstance(value.get(PARAMETERS_KEY), dict) or all(map(_has_parameters, value.values()))


def _exercise(
    path: Path, tree: YamlTree, brought: _Brought, digest: str, interfaces: Interfaces | None = None
) -> Exercise:
    tested = brought.test_file is not None
    model = rubric_model(
        tuple(brought.checks.items()),
        tuple(brought.simulations.items()),
        maps=tuple(brought.maps.items()),
        tested=tested,
    )
    rubric = _validated(path, tree, model)
    mistakes = [*tree.mistakes, *broken_links(rubric, tree), *simulation_mistakes(rubric, tree)]
    mistakes += _of_tests(rubric, brought, tree)
    criteria = (*_criteria(rubric, tree, mistakes), *(_of_test(rubric, test) for test in brought.tests))
    if interfaces is not None:
        mistakes += interface_mistakes(rubric, tree, interfaces)
    if mistakes:
        _refuse(path, mistakes)
    limits = plain_value(rubric.limits)
    rules = brought.hints + hints_of({criterion.check_name for criterion in criteria} - brought.own)
    own = tuple(_scenario(path, shape, limits, brought.provided, criteria) for shape in rubric.scenarios)
    again = list(_again(own, rubric))
    return Exercise(
        id=rubric.exercise.id,
        number=rubric.exercise.number,
        title=rubric.exercise.title,
        required=rubric.exercise.required,
        files=rubric.files,
        scenarios=(*own, *_runs_of_tests(rubric, brought, limits), *(scenario for _, scenario in again)),
        criteria=criteria,
        digest=digest,
        by_request=rubric.exercise.by_request,
        bonus=rubric.exercise.bonus or Fraction(0),
        interfaces=tuple(str(path.parent / folder) for folder in rubric.interfaces),
        hints=rules if rules.files else (),
        draws={s.id: found for s in own if (found := tuple(one.id for id_, one in again if id_ == s.id))},
    )


def _of_tests(rubric: RubricShape, brought: _Brought, tree: YamlTree) -> Iterator[Mistake]:
    """Yield what of a rubric's tests does not fit the rest of it, at the key that names their file."""
    where = tree.at(("pytest",))
    taken = {scenario.id for scenario in rubric.scenarios} | {criterion.id for criterion in rubric.criteria}
    earlier = [criterion.id for criterion in rubric.criteria]
    file = "" if brought.test_file is None else brought.test_file.name
    for test in brought.tests:
        place = f"{printable(file)}:{test.line}: `{printable(test.name)}`"
        if test.id in taken:
            yield where.mistake(f"{place}: expected a new id, found `{test.id}`, which is taken")
        for need in test.needs:
            if need not in earlier:
                text = f"{place}: expected `needs` to name an earlier criterion, found `{printable(need)}`"
                yield where.mistake(text, nearest_hint(need, earlier))
        earlier.append(test.id)


def _of_test(rubric: RubricShape, test: AuthoredTest) -> Criterion:
    return Criterion(
        id=test.id,
        title=test.title,
        points=test.points,
        scenario=test.id,
        check=TestPasses(test.name),
        needs=test.needs,
        hint=test.hint,
        feedback=feedback_of(rubric.feedback),
        check_name=TESTED,
    )


def _runs_of_tests(rubric: RubricShape, brought: _Brought, limits: Limits) -> Iterator[Scenario]:
    """Yield a scenario for each test, which may run every program that is handed in."""
    if brought.test_file is None:
        return
    programs = tuple(name for name in rubric.files if not _is_yaml(name))
    text = brought.test_file.content.decode(errors="replace")  # it was parsed
    own = tuple((name, one.file.name, one.file.content) for name, one in brought.simulations.items())
    for test in brought.tests:
        run = RubricTest(brought.test_file.name, text, test.name, own, tuple(brought.maps.items()))
        # how long it takes is up to the test
        provided = tuple(sorted(brought.provided.items()))
        yield Scenario(test.id, programs, Span(0), limits=limits, provided=provided, test=run)


def side_files(path: Path) -> tuple[OwnFile, ...]:
    """Return every file that a rubric names beside it, without running any; raises RubricError like `read_rubric`."""
    path = rubric_file(path)
    tree = _tree(path, _content(path))
    keys = ("checks", "hints", "simulations", "provided", "pytest")
    files = (name for key in keys for name in _own_names(path, tree, key))
    definitions = definition_files(path, _own_names(path, tree, "interfaces"))
    maps = map_files(path, _own_names(path, tree, "maps"))
    return (*own_files(path, tuple(files)), *maps, *definitions, *bag_files(path, named_bags(tree.data)))


def own_checks(path: Path) -> Mapping[str, type]:
    """Return a rubric's own checks by name, used or not; raises RubricError like `read_rubric`."""
    path = rubric_file(path)
    return load_checks(own_files(path, _own_names(path, _tree(path, _content(path)), "checks")), CHECKS)


def _tree(path: Path, content: bytes) -> YamlTree:
    try:
        return read_yaml(content.decode("utf-8-sig"))
    except UnicodeDecodeError as error:
        _refuse(path, [_not_utf8(content, error)])
    except YamlSyntaxError as error:
        _refuse(path, [error.mistake])


_PYTHON = (CHECK_FILE, "a Python file in the rubric's folder such as my_checks.py")
#: What a rubric may bring, by key: the pattern of a name, and what is expected.
_OWN = {
    "checks": _PYTHON,
    "hints": _PYTHON,
    "simulations": _PYTHON,
    "pytest": _PYTHON,
    "provided": (PROVIDED_FILE, PROVIDED_WORDS),
    "maps": (MAP_FILE, MAP_WORDS),
    "interfaces": (BESIDE, "a folder beside the rubric such as interfaces"),
}


def _own_names(path: Path, tree: YamlTree, key: str) -> tuple[str, ...]:
    """Return the files or folders named under a key; raises RubricError for a name that leads elsewhere."""
    names, (pattern, expected) = named_files(tree.data, key), _OWN[key]
    wrong = [(n, name) for n, name in enumerate(names) if re.fullmatch(pattern, name) is None]
    if wrong:
        text = f"expected {expected}, found"
        places = [tree.at((key, n) if (key, n) in tree.values else (key,)) for n, _ in wrong]
        _refuse(
            path, [place.mistake(f"{text} `{printable(name)}`") for place, (_, name) in zip(places, wrong, strict=True)]
        )
    return names


def _content(path: Path) -> bytes:
    where = printable(str(path), 500)
    try:
        mode = path.stat().st_mode
        if stat.S_ISDIR(mode):
            raise RubricError(f"{where}: expected a rubric file, found a folder", "name the YAML file inside it")
        if not stat.S_ISREG(mode):
            raise RubricError(f"{where}: expected a rubric file, found something that is not a regular file")
        with path.open("rb") as file:
            content = file.read(MAX_RUBRIC_BYTES + 1)
    except (FileNotFoundError, NotADirectoryError):
        raise RubricError(f"{where}: expected a rubric file, found nothing there", "check the path") from None
    except OSError as error:
        raise RubricError(f"{where}: cannot be read: {error.strerror}") from None
    except ValueError:
        raise RubricError(f"{where}: expected a path, found one with a null character") from None
    if len(content) > MAX_RUBRIC_BYTES:
        raise RubricError(f"{where}: expected at most {MAX_RUBRIC_BYTES // 1024} KiB, found more")
    return content


def _not_utf8(content: bytes, error: UnicodeDecodeError) -> Mistake:
    text = f"expected UTF-8 text, found the byte 0x{content[error.start]:02x}"
    return end_of(content[: error.start].decode("utf-8", "replace")).mistake(text, "save the file as UTF-8")


def _refuse(path: Path, mistakes: Iterable[Mistake]) -> NoReturn:
    """Raise an error that lists mistakes, one per line; with several, each hint names the one it belongs to."""
    raise RubricMistakes(printable(str(path), 500), mistakes)


def _validated(path: Path, tree: YamlTree, model: type[_Model]) -> _Model:
    if tree.data is None:
        _refuse(path, [TOP.mistake("expected a rubric, found an empty file")])
    try:
        return model.model_validate(tree.data)
    except ValidationError as error:
        known = {(m.line, m.column) for m in tree.mistakes}
        others = [m for m in mistakes_of(error, tree, model) if (m.line, m.column) not in known]
        _refuse(path, [*tree.mistakes, *others])


def _criteria(rubric: RubricShape, tree: YamlTree, mistakes: list[Mistake]) -> Iterator[Criterion]:
    """Yield the criteria; if a check rejects its parameters, this becomes a mistake."""
    for index, shape in enumerate(rubric.criteria):
        name, parameters = shape.check.chosen
        if flaw := parameters.scale_flaw():
            key, expected = flaw
            path = ("criteria", index, "check", name, key)
            found = printable(str(tree.raw(path)), 40)
            mistakes.append(tree.at(path).mistake(f"expected {expected}, found {key}: {found}"))
        try:
            check: Check = plain_value(parameters)
        except ValueError as error:
            where = tree.keys[("criteria", index, "check", name)]
            mistakes.append(where.mistake(f"invalid parameters for the check `{name}`: {printable(str(error), 200)}"))
            continue
        yield Criterion(
            id=shape.id,
            title=shape.title,
            points=shape.points,
            scenario=shape.scenario,
            check=check,
            needs=shape.needs,
            hint=" ".join((shape.hint or "").split()),
            chapter=" ".join((shape.chapter or "").split()),
            feedback=feedback_of(shape.feedback, feedback_of(rubric.feedback)),
            check_name=name,
            scale=parameters.scale,
        )


def _again(scenarios: Iterable[Scenario], rubric: RubricShape) -> Iterator[tuple[str, Scenario]]:
    """Yield each scenario once more for each further draw of its values, with the id of the one that it repeats."""
    times = {shape.id: shape.draws for shape in rubric.scenarios}
    for scenario in scenarios:
        for draw in range(2, times.get(scenario.id, 1) + 1):
            yield scenario.id, replace(scenario, id=f"{scenario.id}_draw_{draw}")


def _of_bag(shape: ScenarioShape, limits: Limits, criteria: Iterable[Criterion]) -> Scenario:
    """Return a scenario of a recording that students hand in, with the topics that its checks name.

    A check of the rubric's own may read any topic: then all are read, unless the rubric names some.
    """
    asked: HandedInBag = plain_value(shape.handed_in)
    checks = [criterion.check for criterion in criteria if criterion.scenario == shape.id]
    topics = asked.topics
    if not topics and not any(map(is_authored, checks)):
        topics = tuple(dict.fromkeys(topic for check in checks for topic in _topics_named(check)))
    given = (topic for check in checks for topic in texts_under(check, *roles_of(type(check)).given))
    asked = replace(asked, topics=topics)
    return Scenario(shape.id, (), Span(0), limits=limits, handed_in=asked, given=tuple(dict.fromkeys(given)))


def _topics_named(check: Check) -> Iterator[str]:
    """Yield the topics that a built-in check reads."""
    roles = roles_of(type(check))
    yield from texts_under(check, *roles.topics, *roles.given, *roles.hears, *roles.speaks)
    if isinstance(check, Transform):
        yield from check.topics


def _scenario(
    path: Path, shape: ScenarioShape, limits: Limits, provided: Mapping[str, str], criteria: Iterable[Criterion]
) -> Scenario:
    if shape.handed_in is not None:
        return _of_bag(shape, limits, criteria)
    run: tuple[tuple[str, RunOptions], ...] = tuple(
        (name, plain_value(shape.run[name])) for name in shape.processes if name in shape.run
    )
    named = {*shape.processes, *(options.parameters_file for _, options in run)}
    # A launch file may name any of them
    used = provided if any(map(is_launch_file, shape.processes)) else {n: provided[n] for n in provided if n in named}
    return Scenario(
        id=shape.id,
        processes=shape.processes,
        span=plain_value(shape.observe),
        stimuli=tuple(plain_value(stimulus).beside(str(path.parent)) for stimulus in shape.stimuli),
        connections=plain_value(shape.connections),
        limits=limits,
        starts_ns=tuple((name, plain_value(shape.start[name])) for name in shape.processes if name in shape.start),
        may_exit=shape.may_exit,
        shutdown_ns=shape.shutdown or 0,
        run=run,
        provided=tuple(sorted(used.items())),
    )
