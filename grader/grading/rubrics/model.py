"""The shape of a rubric file as pydantic models."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from datetime import date
from functools import lru_cache
from typing import TYPE_CHECKING, Annotated, Any, Literal, Self

from pydantic import (
    ConfigDict,
    Discriminator,
    Field,
    PlainValidator,
    Tag,
    WithJsonSchema,
    create_model,
    model_validator,
)

from grader.grading.model.exercise import DUE_DATE, OPEN, ORDER, PUBLISHED, Feedback, Shows
from grader.grading.rubrics.check_parameters import choice_model, part_model, simulation_shape
from grader.grading.rubrics.drawing import (
    ParameterShape,
    SomeLongTime,
    StateShape,
    TransitionShape,
    list_of,
)
from grader.grading.rubrics.mistakes import nearest_hint
from grader.grading.rubrics.own_checks import OwnSimulation
from grader.grading.rubrics.run_options import RunShape
from grader.grading.rubrics.types import (
    CheckFile,
    Choice,
    HandedIn,
    Id,
    InterfaceFolder,
    LongDuration,
    MapFile,
    Number,
    Points,
    ProgramName,
    ProvidedFile,
    Shape,
    Text,
    Whole,
    YesNo,
    lacking,
    must,
    wrong,
)
from grader.grading.rubrics.variants import VariantsField
from grader.runtime.model.limits import Limits
from grader.runtime.model.scenario import Connection, HandedInBag, Span, Stimulus
from grader.runtime.model.wording import listed
from grader.runtime.simulation import SIMULATIONS, WallMap
from grader.runtime.stimuli import KINDS, ServiceCalls, Simulated

_EVENTS = (DUE_DATE, PUBLISHED)
_EXPECTED = f"a date such as 2026-12-01, {listed(_EVENTS)}"

#: Rubric names of limits whose fields have other names.
_LIMITS = {
    "processor_ns": "processor_time",
    "file_bytes": "file_size",
    "wall_ns": "real_time",
    "message_bytes": "message_size",
}
#: Other keys of stimuli, below the kind that each is short for.
_SHORT_FOR: Mapping[type[Stimulus], Mapping[str, type[Shape]]] = {
    ServiceCalls: {"parameter": ParameterShape, "transition": TransitionShape, "state": StateShape},
}


def _stimuli() -> Iterator[tuple[str, type[Shape]]]:
    for kind in KINDS:
        if kind is not Simulated:  # its parameters are those of a simulation
            name = "".join(word.capitalize() for word in kind.key.split("_"))
            yield kind.key, part_model(kind, f"{name}Shape", **kind.shown)
            yield from _SHORT_FOR.get(kind, {}).items()


_SIMULATIONS = {name: simulation_shape(name, kind) for name, kind in SIMULATIONS.items()}


def _stimulus_model(simulations: Mapping[str, type[Shape]]) -> type[Choice]:
    """Return the model of a stimulus, with some simulations of one's own."""
    shapes = {**_SIMULATIONS, **simulations}
    chosen = choice_model(
        "SimulationShape", "A stimulus: a participant that reacts, such as a simulated robot.", shapes
    )
    about = "Something that the grader does to the student's nodes."
    return choice_model("StimulusShape", about, {**dict(_stimuli()), Simulated.key: chosen})


if TYPE_CHECKING:  # created at run time; pydantic reads those below
    LimitsShape = Shape
    ConnectionShape = Shape
    HandedInBagShape = Shape
    ObserveShape = Shape
    StimulusShape = Choice
else:
    ConnectionShape = part_model(Connection, "ConnectionShape")
    HandedInBagShape = part_model(HandedInBag, "HandedInBagShape")
    LimitsShape = part_model(Limits, "LimitsShape", _LIMITS)
    ObserveShape = part_model(Span, "ObserveShape")
    StimulusShape = _stimulus_model({})


def _shows(value: object) -> str:
    words = [shows.value for shows in ORDER]
    if not isinstance(value, str) or value not in words:
        raise wrong(listed(words), nearest_hint(value, words) if isinstance(value, str) else "")
    return value


def _until(value: object) -> str:
    text = value if isinstance(value, str) else ""
    if text in _EVENTS:
        return text
    try:
        # Only this form is accepted: Python reads others too, but they do not sort.
        if date.fromisoformat(text).isoformat() != text:
            raise ValueError
    except ValueError:
        raise wrong(_EXPECTED) from None
    return text


_Words = Annotated[
    str, PlainValidator(_shows), WithJsonSchema({"type": "string", "enum": [shows.value for shows in ORDER]})
]
_Until = Annotated[
    str | None,
    PlainValidator(_until),
    WithJsonSchema(
        {
            "type": "string",
            "pattern": f"^([0-9]{{4}}-[0-9]{{2}}-[0-9]{{2}}|{'|'.join(_EVENTS)})$",
            "examples": ["2026-12-01"],
        }
    ),
]


class FeedbackShape(Shape):
    """How much a student is shown, and the last day on which that holds."""

    show: _Words
    until: _Until = Field(default=None, description="the last day of this policy; without it, the policy has no end")

    @model_validator(mode="after")
    def _has_a_meaning(self) -> Self:
        if self.show == Shows.ALL.value and self.until:
            raise wrong("no `until` where all is shown")
        if self.until in _EVENTS and self.show != Shows.NOTHING.value:
            raise wrong(f"a date as `until` of {self.show}", "platforms show a result or hide it; only `nothing` waits")
        return self


def _kind(value: object) -> Literal["mapping", "word"]:
    return "mapping" if isinstance(value, dict) else "word"


#: Value of the key `feedback`.
FeedbackField = Annotated[
    Annotated[_Words, Tag("word")] | Annotated[FeedbackShape, Tag("mapping")], Discriminator(_kind)
]


def feedback_of(written: str | FeedbackShape | None, usual: Feedback = OPEN) -> Feedback:
    """Return the policy as written, or the usual one if none is."""
    if written is None:
        return usual
    if isinstance(written, FeedbackShape):
        return Feedback(Shows(written.show), written.until or "")
    return Feedback(Shows(written))


class ExerciseShape(Shape):
    """What the exercise is called."""

    id: Id
    number: Number
    title: Text
    required: YesNo = True
    by_request: YesNo = False
    bonus: Points | None = Field(default=None, description="points above the maximum that an instructor may give")


#: Each draw costs as much as a scenario of its own.
_MOST_DRAWS = 20
Draws = Annotated[Whole, must(lambda count: 1 <= count <= _MOST_DRAWS, f"a whole number from 1 to {_MOST_DRAWS}")]


class ScenarioShape(Shape):
    """One situation that is recorded once."""

    model_config = ConfigDict(
        json_schema_extra={"anyOf": [{"required": ["processes", "observe"]}, {"required": ["handed_in"]}]}
    )

    id: Id
    processes: tuple[ProgramName, ...] = Field(default_factory=tuple, min_length=1)
    observe: ObserveShape | None = None
    handed_in: HandedInBagShape | None = Field(
        default=None, description="a recording that students hand in, in place of everything else"
    )
    stimuli: tuple[StimulusShape, ...] = ()
    connections: tuple[ConnectionShape, ...] = Field(
        default=(), description="topics on which messages of stimuli are late or lost"
    )
    draws: Draws = Field(
        default=1, description="in how many recordings it is run, each with values drawn anew, 20 at most"
    )
    start: dict[ProgramName, SomeLongTime] = Field(default={}, description="processes that start late")
    run: dict[ProgramName, RunShape] = Field(default={}, description="what processes are given when they are started")
    may_exit: Annotated[tuple[ProgramName, ...], Field(description="processes that are free to end by themselves")] = ()
    shutdown: Annotated[
        LongDuration | None, Field(description="how long they may take to end after Ctrl-C, which comes at the end")
    ] = None

    @model_validator(mode="after")
    def _is_run_or_handed_in(self) -> Self:
        for key in ("processes", "observe"):
            if self.handed_in is None and key not in self.model_fields_set:
                raise lacking(key)
        return self


class CriterionShape(Shape):
    """One row of a rubric; the model for a table of checks narrows `check`."""

    id: Id
    title: Text
    points: Points
    scenario: Id
    check: Choice
    needs: tuple[Id, ...] = ()
    hint: Text | None = None
    chapter: Text | None = None
    feedback: FeedbackField | None = None


class RubricShape(Shape):
    """A whole rubric file."""

    format: Literal["grader/rubric/v1"] = Field(alias="schema")
    exercise: ExerciseShape
    files: tuple[HandedIn, ...] = Field(default_factory=tuple, min_length=1)
    provided: tuple[ProvidedFile, ...] = Field(
        default=(), description="launch files and parameter files of the rubric's own, beside it"
    )
    checks: tuple[CheckFile, ...] = Field(default=(), description="files with your own checks, beside the rubric")
    hints: tuple[CheckFile, ...] = Field(
        default=(), description="Python files with your own rules for hints, beside the rubric"
    )
    simulations: tuple[CheckFile, ...] = Field(
        default=(), description="Python files with your own simulations, beside the rubric"
    )
    maps: tuple[MapFile, ...] = Field(
        default=(), description="maps for simulations as ROS's map_server reads them, beside the rubric"
    )
    interfaces: tuple[InterfaceFolder, ...] = Field(
        default=(), description="folders beside the rubric with interface packages: msg, srv and action definitions"
    )
    pytest: CheckFile | None = Field(
        default=None, description="a file with tests for pytest, beside the rubric; each test is a criterion"
    )
    limits: LimitsShape = Field(default_factory=LimitsShape)
    feedback: FeedbackField | None = None
    variants: VariantsField = Field(default_factory=dict)
    scenarios: tuple[ScenarioShape, ...] = Field(min_length=1)
    criteria: tuple[CriterionShape, ...] = Field(min_length=1)

    @model_validator(mode="after")
    def _asks_for_files(self) -> Self:
        if not self.files and (self.pytest or any(scenario.handed_in is None for scenario in self.scenarios)):
            raise lacking("files")
        return self


@lru_cache(maxsize=8)
def rubric_model(
    checks: tuple[tuple[str, type], ...],
    simulations: tuple[tuple[str, OwnSimulation], ...] = (),
    *,
    maps: tuple[tuple[str, WallMap], ...] = (),
    tested: bool = False,
) -> type[RubricShape]:
    """Return the model of a rubric file with these checks, simulations and maps, as messages list them.

    One that names tests (`tested`) needs no other criteria.
    """
    check = choice_model("Check", "The question asked of the trace, by the check's name.", dict(checks))
    criterion = create_model("Criterion", __base__=CriterionShape, __doc__="One row of a rubric.", check=(check, ...))
    parts: dict[str, Any] = {"criteria": (list_of(criterion), () if tested else Field(min_length=1))}
    if tested:
        parts["scenarios"] = (tuple[ScenarioShape, ...], ())
    if simulations or maps:
        own = {name: simulation_shape(name, kind, maps=maps) for name, kind in SIMULATIONS.items()} if maps else {}
        own |= {n: simulation_shape(n, one.kind, one.file.name, one.file.content, maps) for n, one in simulations}
        stimuli = (list_of(_stimulus_model(own)), ())
        scenario = create_model("ScenarioShape", __base__=ScenarioShape, __doc__=ScenarioShape.__doc__, stimuli=stimuli)
        parts["scenarios"] = (list_of(scenario), () if tested else Field(min_length=1))
    return create_model("Rubric", __base__=RubricShape, __doc__="A rubric of rclpy-grader.", **parts)
