"""What rubrics need of interface packages that are not installed: the types to read them with, and their modules."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from grader.grading.model.exercise import Exercise
from grader.runtime.interface_packages import FOREVER_S, Provided, built_from, packages_in, provide, type_folders
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.submission import Definition, Submission
from grader.runtime.model.trace import Delivery, Message, Trace
from grader.runtime.stimuli import Simulated

if TYPE_CHECKING:
    from grader.grading.rubrics.interfaces import Interfaces
    from grader.runtime.session import RecordingSession


def rubric_folders(exercises: Iterable[Exercise]) -> list[Path]:
    """Return the folders with the interface packages that rubrics bring."""
    return [Path(folder) for exercise in exercises for folder in exercise.interfaces]


@cache
def known_interfaces(course: tuple[Path, ...] = ()) -> Interfaces | None:
    """Return the types that nodes can use: installed, of the class, and shipped; None without ROS."""
    from grader.grading.rubrics.interfaces import Interfaces  # noqa: PLC0415 - takes long, as reading rubrics does

    places = type_folders()
    if places is None:
        return None

    def looked_in(folders: Sequence[Path]) -> Sequence[Path]:
        found = built_from(folders, course)
        return [found.share] if found is not None else []

    return Interfaces(places.installed, places.shipped, looked_in).including(course)


def rubric_modules(exercise: Exercise, course: tuple[Path, ...] = ()) -> tuple[Path, ...]:
    """Return where the modules of a rubric's own interface packages are; empty if it brings none."""
    found = built_from(rubric_folders([exercise]), course) if exercise.interfaces else None
    return (found.python,) if found is not None else ()


def provided_for(
    session: RecordingSession,
    exercises: Sequence[Exercise],
    course: Sequence[Path],
    submission: Submission,
    budget_s: float = FOREVER_S,
) -> Provided:
    """Build what the runs of exercises need; see `provide`. Rubrics and simulations name types as programs do."""
    scenarios = [scenario for exercise in exercises for scenario in exercise.scenarios]
    text = repr(exercises).encode("utf-8", "replace") + types_in(scenarios)
    rubric = rubric_folders(exercises)
    return provide(session, submission, course=course, rubric=rubric, text=text, budget_s=budget_s)


def types_in(scenarios: Iterable[Scenario]) -> bytes:
    """Return a text with the types that the simulations of scenarios use."""
    simulated = [one for scenario in scenarios for one in scenario.stimuli if isinstance(one, Simulated)]
    if not simulated:
        return b""
    from grader.grading.rubrics.simulations import offered_by  # noqa: PLC0415 - as above

    return repr(sorted({name for one in offered_by(simulated) for name in one.types})).encode()


def bag_definitions(exercise: Exercise, course: tuple[Path, ...] = ()) -> dict[str, str]:
    """Return the definitions of message types that a rubric or a course brings, for recordings that lack them."""
    folders = (*rubric_folders([exercise]), *course)
    known = known_interfaces(tuple(folders)) if folders else None
    if known is None:
        return {}
    names = {package.name for package in packages_in(folders)}
    own = (type_ for type_ in known.of_kind("msg") if type_.partition("/")[0] in names)
    return {type_: found.text for type_ in own if (found := known.definition(type_)) is not None}


def definitions(traces: Iterable[Trace], provided: Provided) -> dict[str, Definition]:
    """Return the definitions of the recorded message types that are not installed, for evidence."""
    if not provided.builds:
        return {}
    from grader.grading.rubrics.interfaces import Interfaces  # noqa: PLC0415 - as above

    names = {package.name for package in provided.packages}
    types = {o.type for trace in traces for o in trace.observations if isinstance(o, (Message, Delivery))}
    wanted = sorted(type_ for type_ in types if type_.partition("/")[0] in names and "/msg/" in type_)
    known = Interfaces(provided.shares)
    return {type_: found for type_ in wanted if (found := known.definition(type_)) is not None}
