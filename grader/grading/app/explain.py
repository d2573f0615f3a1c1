"""Finds criteria and checks by name for `grade explain`, with the text of their rubrics and manuals."""

from __future__ import annotations

import difflib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import MISSING, Field, fields, is_dataclass
from pathlib import Path
from typing import Any, get_args, get_type_hints

from grader.grading.app.grade import read_exercises
from grader.grading.app.request import GradeRequest
from grader.grading.judging.run_check import check_name
from grader.grading.model.exercise import Criterion, Exercise, measure_of
from grader.grading.model.measures import COMBINES
from grader.grading.model.report import CheckExplanation, CheckParameter, CriterionExplanation
from grader.grading.rubrics.check_parameters import Manual, manual_of, scale_meanings
from grader.grading.rubrics.draws import First
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.loader import own_checks
from grader.grading.rubrics.simulations import offered_by
from grader.grading.rubrics.units import format_quantity
from grader.runtime.model.errors import GraderError
from grader.runtime.model.quantities import Unit, duration
from grader.runtime.model.scenario import Connection, Scenario, Stimulus
from grader.runtime.model.wording import listed
from grader.runtime.stimuli import time_phrase

#: Most names suggested for an unknown one.
OFFERED = 3


def explain_name(name: str, rubrics: tuple[Path, ...] = ()) -> list[CriterionExplanation | CheckExplanation]:
    """Explain a criterion id, `exercise/criterion`, or the name of a check; raises GraderError if there is none.

    Criteria are searched in the given rubrics, or in the built-in ones if none are given.
    """
    pairs = _pairs(rubrics)
    found = [_criterion(e, c) for e, c in pairs if name in (c.id, f"{e.id}/{c.id}")]
    if found:
        return list(found)
    checks = {**known_checks(), **{check_name(c): type(c.check) for _, c in pairs}}
    if name in checks:
        return [_check(name, checks[name], [f"{e.id}/{c.id}" for e, c in pairs if check_name(c) == name])]
    raise unknown_name(name, [*(c.id for _, c in pairs), *checks])


def everything(rubrics: tuple[Path, ...] = ()) -> list[CriterionExplanation | CheckExplanation]:
    """Explain all criteria of the given rubrics, or of the built-in ones, and all checks."""
    return [*explain_rubrics(rubrics), *explain_checks(rubrics)]


def explain_rubrics(rubrics: tuple[Path, ...] = ()) -> list[CriterionExplanation | CheckExplanation]:
    """Explain every criterion of the given rubrics, or of the built-in ones if none are given."""
    return [_criterion(e, c) for e, c in _pairs(rubrics)]


def explain_checks(rubrics: tuple[Path, ...] = ()) -> list[CriterionExplanation | CheckExplanation]:
    """Explain every check, including those that rubrics define, and list the criteria that use it."""
    pairs = _pairs(rubrics)
    used: dict[str, list[str]] = {}
    for e, c in pairs:
        used.setdefault(check_name(c), []).append(f"{e.id}/{c.id}")
    own = {name: kind for path in rubrics for name, kind in own_checks(path).items()}
    return [_check(name, kind, used.get(name, [])) for name, kind in {**known_checks(), **own}.items()]


def given_exercises(rubrics: tuple[Path, ...]) -> list[Exercise]:
    """Return the exercises of the given rubrics, or the built-in ones; each variant has its first values."""
    return read_exercises(GradeRequest("", every=True, rubrics=rubrics, draw=First()), recorded=True)


def _pairs(rubrics: tuple[Path, ...]) -> list[tuple[Exercise, Criterion]]:
    return [(e, c) for e in given_exercises(rubrics) for c in e.criteria]


def _criterion(exercise: Exercise, criterion: Criterion) -> CriterionExplanation:
    scenario = next(s for s in exercise.scenarios if s.id == criterion.scenario)
    name = check_name(criterion)
    kind: type = type(criterion.check)
    manual = manual_of(kind)
    return CriterionExplanation(
        id=criterion.id,
        title=criterion.title,
        exercise=f"{exercise.number}, {exercise.title} ({exercise.id})",
        points=criterion.points,
        chapter=criterion.chapter,
        needs=criterion.needs,
        hint=criterion.hint,
        situation=_situation(scenario),
        check=name,
        asks=manual.summary,
        details=manual.details,
        parameters=(*(_parameter(f, kind, manual, criterion.check) for f in fields(kind)), *_scale(kind, criterion)),
    )


def _scale(kind: type, criterion: Criterion | None) -> Iterator[CheckParameter]:
    """Yield the keys by which a rubric gives a share of the points, of a check that measures a number."""
    measure = measure_of(kind)
    if measure is None:
        return
    scale = None if criterion is None else criterion.scale
    limits = {key: "none" if scale is None else measure.written(getattr(scale, key)) for key in ("full", "none")}
    written = {**limits, "combine": COMBINES[0] if scale is None else scale.combine}
    for name, meaning in scale_meanings(measure).items():
        required = measure.required and criterion is None and name in limits
        yield CheckParameter(name, "" if required else written[name], meaning, required)


def _check(name: str, kind: type, used_by: Sequence[str]) -> CheckExplanation:
    manual = manual_of(kind)
    parameters = (*(_parameter(f, kind, manual, None) for f in fields(kind)), *_scale(kind, None))
    return CheckExplanation(name, manual.summary, manual.details, parameters, tuple(used_by))


def _parameter(field: Field[object], kind: type, manual: Manual, check: object | None) -> CheckParameter:
    """Describe a parameter with its value in a check, or with its default if no check is given."""
    annotation = get_type_hints(kind, include_extras=True)[field.name]
    value = field.default if check is None else getattr(check, field.name)
    text = "" if value is MISSING else _written(value, annotation)
    return CheckParameter(field.name, text, manual.parameters.get(field.name, ""), value is MISSING)


def _written(value: Any, annotation: object) -> str:
    """Format a value the way a rubric writes it."""
    unit = _unit(annotation)
    if value is None or value == "":
        return "none"
    if unit is not None:
        return format_quantity(value, unit)
    if isinstance(value, (Mapping, tuple)):
        return _several(value)
    if is_dataclass(value):
        return _parts(value)
    if isinstance(value, float):
        return f"{value:g}"
    return str(value).lower() if isinstance(value, bool) else str(value)


def _several(values: Mapping[str, object] | tuple[object, ...]) -> str:
    if isinstance(values, tuple):
        return ", ".join(_written(inner, None) for inner in values) or "none"
    return ", ".join(f"{key}: {_written(inner, None)}" for key, inner in values.items()) or "none"


def _parts(value: Any) -> str:
    """Format the non-default parts of a parameter the way a rubric writes them."""
    hints = get_type_hints(type(value), include_extras=True)
    given = [f for f in fields(value) if getattr(value, f.name) not in (f.default, (), {}, None)]
    parts = (f"{f.name}: {_written(getattr(value, f.name), hints[f.name])}" for f in given)
    return f"{{{', '.join(parts)}}}"


def _unit(annotation: object) -> Unit | None:
    """Return the unit of an annotation, also of an optional one."""
    for part in (annotation, *get_args(annotation)):
        for mark in getattr(part, "__metadata__", ()):
            if isinstance(mark, Unit):
                return mark
    return None


def _situation(scenario: Scenario) -> str:
    """Describe in one sentence what runs, for how long, and what the grader publishes meanwhile."""
    if scenario.test is not None:
        test, programs = scenario.test, ", ".join(scenario.processes)
        return f"the test {test.name} of {test.file} runs what it needs of {programs}"
    if scenario.handed_in is not None:
        asked = scenario.handed_in
        topics = listed(asked.topics, "and") if asked.topics else "all topics"
        read = f"of which the first {duration(asked.duration_ns)} of {topics} are read"
        return f"the student hands in a recording named {asked.bag}, {read}"
    span = scenario.span
    text = f"{' and '.join(scenario.processes)} observed for {time_phrase(span.duration_ns)}"
    if span.after_first_message_on:
        text += f" from the first message on {span.after_first_message_on} on"
        text += f", which is waited for at most {duration(span.wait_at_most_ns)}"
    told = map(_stimulus, scenario.stimuli)
    return "; ".join([text, *told, *map(_connection, scenario.connections)])


def _stimulus(stimulus: Stimulus) -> str:
    """Describe what the grader does; of a simulation also what it hears."""
    hears = [f"{' or '.join(types)} on {topic}" for one in offered_by([stimulus]) for topic, types in one.hears.items()]
    return f"{stimulus.phrase()}: it hears {listed(hears, 'and')}" if hears else stimulus.phrase()


def _connection(connection: Connection) -> str:
    late = f"arrive {time_phrase(connection.delay_ns)} late" if connection.delay_ns else ""
    lost = f"{connection.lose:.0%} of them do not arrive" if connection.lose else ""
    return f"messages on {connection.topic}: {', '.join(filter(None, (late, lost)))}"


def unknown_name(
    name: str, names: Sequence[str], wrong: str = "expected the id of a criterion or the name of a check, found neither"
) -> GraderError:
    """Return the error about a name that nothing has, with the names that are near."""
    known = list(dict.fromkeys(names))
    near = difflib.get_close_matches(name, known, n=OFFERED, cutoff=0.4)
    parts = [k for k in known if name.casefold() in k and k not in near] if len(name) > 2 else []
    offered = [*near, *parts][:OFFERED]
    hint = f"the nearest are {', '.join(offered)}" if offered else f"there are {', '.join(known)}"
    return GraderError(f"explain {name}: {wrong}", hint)
