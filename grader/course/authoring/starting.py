"""Makes the skeleton of a rubric from a reference: runs it twice, proposes criteria, and keeps those that it meets."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from grader.course.authoring.questions import Seen, questions, student_parameters
from grader.course.authoring.skeleton import (
    Draft,
    DraftCriterion,
    DraftQuantity,
    DraftStimulus,
    as_id,
    in_seconds,
    rubric_text,
)
from grader.grading.app.grade import Progress
from grader.grading.app.inputs import FIRST_S, NOTHING, SentMessages, copied_simulation, period_s
from grader.grading.app.interfaces import known_interfaces
from grader.grading.app.observe import ObserveRequest, undisturbed, watch
from grader.grading.judging.findings import fault_sentence
from grader.grading.judging.values import carries_number, student_endpoints
from grader.grading.model.exercise import Exercise
from grader.grading.model.wording import quote
from grader.grading.rubrics.builtin import ODOMETRY
from grader.grading.rubrics.exercise_checks import known_checks
from grader.grading.rubrics.loader import RubricMistakes, read_rubric
from grader.grading.rubrics.simulations import offered
from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.errors import GraderError, RubricError, SubmissionError
from grader.runtime.model.quantities import NS_PER_S, seconds
from grader.runtime.model.scenario import Scenario
from grader.runtime.model.trace import FaultKind, Trace
from grader.runtime.stimuli import Simulated

_VALUES = (1, 2, 3, 4)
_CALLS = 3
NO_FILES: Mapping[str, Path] = MappingProxyType({})
_HERE = Path()
#: What is left for the author to decide about a simulation.
_VARY = "decide: which parameters are to vary? {x: {between: [-0.9, 0.9]}} draws one from the seed"


def stimuli_for(
    trace: Trace, duration_s: float, given: SentMessages = NOTHING, *, simulated: frozenset[str] = frozenset()
) -> tuple[DraftStimulus, ...]:
    """Propose stimuli for all endpoints that wait for input.

    Args:
        trace: What was observed.
        duration_s: For how long.
        given: The messages that the author named.
        simulated: Topics and services that a simulation publishes or serves.
    """
    return (*_topics(trace, duration_s, given, simulated), *_services(trace, simulated), *_parameters(trace))


def _topics(trace: Trace, duration_s: float, given: SentMessages, simulated: frozenset[str]) -> Iterator[DraftStimulus]:
    spoken = {*simulated, *(end.topic for end in student_endpoints(trace, "publisher"))}
    for topic, type_ in dict.fromkeys((e.topic, e.type) for e in student_endpoints(trace, "subscription")):
        if topic in given:
            yield _named(topic, type_, duration_s, given[topic])
        elif topic not in spoken:
            yield _messages(topic, type_, duration_s)


def _messages(topic: str, type_: str, duration_s: float) -> DraftStimulus:
    start = in_seconds(FIRST_S)
    left_s = duration_s - FIRST_S
    if type_ == ODOMETRY:  # a recording of this type ships with the grader
        played = {"topic": topic, "type": type_, "start": start, "duration": in_seconds(max(1.0, left_s - 1))}
        return DraftStimulus("recorded", played, "decide: how long is it silent before and after?")
    if carries_number(type_):
        times = {"period": DraftQuantity("200 ms"), "hold": in_seconds(max(0.5, left_s // len(_VALUES)))}
        numbers = {"topic": topic, "type": type_, "values": list(_VALUES), **times, "start": start}
        return DraftStimulus("numbers", numbers, "decide: which values tell a right program from a wrong one?")
    repeated = {"period": in_seconds(1), "repeats": max(1, int(left_s) - 1)}
    messages = {"topic": topic, "type": type_, "values": [{}], **repeated, "start": start}
    return DraftStimulus("messages", messages, "decide: which fields? {} leaves all at their defaults")


def _named(topic: str, type_: str, duration_s: float, values: Sequence[Mapping[str, object]]) -> DraftStimulus:
    """Spread the author's messages over the available time."""
    times = {"period": in_seconds(period_s(duration_s, len(values))), "start": in_seconds(FIRST_S)}
    sent = {"topic": topic, "type": type_, "values": list(values), **times}
    return DraftStimulus("messages", sent, "decide: which other messages tell a right program from a wrong one?")


def _services(trace: Trace, simulated: frozenset[str]) -> Iterator[DraftStimulus]:
    servers = {*simulated, *(end.service for end in trace.service_ends("service"))}
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("service")):
        asked = {"service": service, "type": type_, "requests": [{}], "calls": _CALLS, "start": in_seconds(1)}
        yield DraftStimulus("calls", asked, "decide: which requests? {} leaves all fields at their defaults")
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("client")):
        if service not in servers:
            given = {"service": service, "type": type_, "responses": [{}], "start": in_seconds(1)}
            yield DraftStimulus("server", given, "decide: which responses? {} leaves all fields at their defaults")


def _parameters(trace: Trace) -> Iterator[DraftStimulus]:
    for node, name, _ in student_parameters(trace):
        asked = {"name": name, **({"node": node} if node else {}), "start": in_seconds(1)}
        yield DraftStimulus("parameter", asked, f"asks for the value of {name}; decide: should it be set too?")


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The text of a skeleton, with the number of criteria that the reference meets, and of those in comments."""

    text: str
    criteria: int
    left_out: int
    remarks: tuple[str, ...] = ()


def new_rubric(request: ObserveRequest, progress: Progress, *, id_: str = "", beside: Path = _HERE) -> Skeleton:
    """Make the skeleton of a rubric from the behaviour of a reference.

    Args:
        request: The files of the reference, how to run them, and what they are given.
        progress: Called at the start of each step.
        id_: Id of the exercise; empty to derive it from the name of the first file.
        beside: Folder of the rubric, which has to hold the files of its simulations.

    Raises:
        SubmissionError: The reference raises an exception, or does nothing that can be checked.
        GraderError: Something that the run needs cannot be used.
    """
    alone = watch(request, progress)
    _refuse_broken(alone.trace, alone.processes)
    files = {_relative(file, beside): file for one in request.simulations if (file := one.file) is not None}
    draft = replace(
        _begun(alone.trace, request, id_), simulations=tuple(files), remarks=tuple(_elsewhere(files, beside))
    )
    driven = watch(request, progress, _scenario_of(draft, files)).trace
    _refuse_broken(driven, draft.files)
    draft = replace(draft, remarks=(*draft.remarks, *_remarks(driven)))
    seen = Seen(alone.trace, driven, draft.files, _window_s(driven, draft.duration_s))
    kept, left_out = _sorted_out(draft, (row for row in questions(seen) if row.check in known_checks()), driven)
    if not kept:
        names = ", ".join(draft.files)
        raise SubmissionError(f"{names}: expected a reference that publishes, listens, serves or logs, found none")
    text = rubric_text(replace(draft, criteria=tuple(kept)), left_out)
    _read(text, files)  # find bugs of the grader here, not at the author's
    return Skeleton(text, len(kept), len(left_out), draft.remarks)


def _remarks(trace: Trace) -> Iterator[str]:
    for topic in dict.fromkeys(e.topic for e in student_endpoints(trace, "publisher")):
        if not trace.messages(topic):
            yield f"nothing was published on {topic}: send what its node waits for with --send TOPIC={{field: value}}"


def _begun(trace: Trace, request: ObserveRequest, id_: str) -> Draft:
    """Return a draft with the scenario of the reference and no criteria."""
    files = tuple(file.name for file in request.files)
    duration_s = request.duration_ns / NS_PER_S
    found = [offered(one) for one in undisturbed(request, files).stimuli if isinstance(one, Simulated)]
    names = frozenset(name for one in found for name in (*one.publishes, *one.serves))
    taking_part = [DraftStimulus("simulation", {one.name: one.parameters}, _VARY) for one in request.simulations]
    stimuli = (*taking_part, *stimuli_for(trace, duration_s, request.sent, simulated=names))
    unheard = [topic for topic in request.sent if topic not in {s.parameters.get("topic") for s in stimuli}]
    if unheard:
        raise GraderError(f"--send {unheard[0]}: expected a topic that the reference subscribes to, found none")
    spoken = [m.topic for m in trace.messages() if m.topic in {e.topic for e in student_endpoints(trace, "publisher")}]
    ended = tuple(f.process for f in trace.faults() if f.kind is FaultKind.EXITED)
    return Draft(
        id=as_id(id_ or Path(files[0]).stem),
        files=files,
        duration_s=duration_s,
        after=spoken[0] if spoken and not stimuli else "",
        may_exit=tuple(dict.fromkeys(ended)),
        stimuli=stimuli,
    )


def _relative(file: Path, folder: Path) -> str:
    """Return how a rubric in a folder names a file; one that is elsewhere has to be copied there."""
    inside = file.resolve().is_relative_to(folder.resolve())
    return file.resolve().relative_to(folder.resolve()).as_posix() if inside else file.name


def _elsewhere(files: Mapping[str, Path], folder: Path) -> Iterator[str]:
    for name, file in files.items():
        if file.resolve() != (folder / name).resolve():
            yield f"copy {quote(str(file))} beside the rubric, which names it"


def _scenario_of(draft: Draft, files: Mapping[str, Path]) -> Scenario:
    """Return the scenario of a draft, which must have at least one criterion to be read.

    Raises GraderError if a message to send has a field or a value that its type has not.
    """
    asked = DraftCriterion("any", "Any", "uses_logger", {"process": draft.files[0]}, "any")
    try:
        (scenario,) = _read(rubric_text(replace(draft, criteria=(asked,))), files).scenarios
    except RubricMistakes as error:
        first = error.mistakes[0]
        raise GraderError(f"--send: {first.text}", first.hint) from None
    return scenario


def _read(text: str, files: Mapping[str, Path] = NO_FILES) -> Exercise:
    with tempfile.TemporaryDirectory(prefix="grade-new-") as folder:
        for name, file in files.items():
            copied_simulation(file, Path(folder) / name)
        path = Path(folder) / "rubric.yaml"
        path.write_text(text, encoding="utf-8")
        return read_rubric(path, interfaces=known_interfaces())


def _window_s(trace: Trace, duration_s: float) -> float:
    """Return how long every topic was observed after its first message, in whole seconds."""
    firsts: dict[str, int] = {}
    for message in trace.messages():
        firsts.setdefault(message.topic, message.t_ns)
    watched = [seconds(trace.stop_ns - first) for first in firsts.values()]
    return max(1.0, float(math.floor(min([*watched, duration_s]) + 1e-9)))


def _sorted_out(
    draft: Draft, rows: Iterable[DraftCriterion], trace: Trace
) -> tuple[list[DraftCriterion], list[tuple[DraftCriterion, str]]]:
    """Split proposed criteria into those that the reference meets and the others, with the reason; drops duplicates."""
    kept: list[DraftCriterion] = []
    left_out: list[tuple[DraftCriterion, str]] = []
    for row in rows:
        ids = {other.id for other in kept}
        if row.id in ids or row.id.removesuffix("_range") + "_random" in ids:
            continue
        row = replace(row, needs=row.needs if row.needs in ids else "")  # noqa: PLW2901  without dropped criteria
        reason = _unmet(replace(draft, criteria=(replace(row, needs=""),)), trace)
        if reason:
            left_out.append((row, reason))
        else:
            kept.append(row)
    randomless = {row.id.removesuffix("_range") for row in kept}
    return kept, [(r, why) for r, why in left_out if r.id.removesuffix("_random") not in randomless]


def _unmet(draft: Draft, trace: Trace) -> str:
    """Return why the reference does not meet the only criterion of a draft; empty if it does."""
    try:
        (criterion,) = _read(rubric_text(replace(draft, stimuli=(), simulations=()))).criteria
        finding = criterion.check.judge(trace)
    except RubricError as error:
        return f"it cannot be used yet: {quote(error.message.partition('.yaml:')[2] or error.message)}"
    except GraderError as error:
        return f"it cannot be judged: {quote(error.message)}"
    return "" if finding.credit == 1 else f"seen: {quote(finding.reason)}"


def _refuse_broken(trace: Trace, files: Iterable[str]) -> None:
    """Raise SubmissionError if a process crashed or exited with a code other than 0."""
    for fault in trace.faults():
        if fault.exit_code != 0:
            raise SubmissionError(f"{', '.join(files)}: expected a reference that runs, found {fault_sentence(fault)}")
