"""Makes the skeleton of a rubric from a reference: runs it twice, proposes criteria, and keeps those that it meets."""

from __future__ import annotations

import math
import tempfile
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from grader.app.grade import Progress
from grader.app.interface_packages import known_interfaces
from grader.app.observe import ObserveRequest, watch
from grader.authoring.questions import Seen, parameters, questions
from grader.authoring.skeleton import (
    Draft,
    DraftCriterion,
    DraftQuantity,
    DraftStimulus,
    as_id,
    in_seconds,
    rubric_text,
)
from grader.core.dataclass import dataclass
from grader.core.errors import GraderError, RubricError, SubmissionError
from grader.core.exercise import Exercise
from grader.core.quantities import NS_PER_S, seconds
from grader.core.scenario import Scenario
from grader.core.trace import FaultKind, Trace
from grader.judging.checks import CHECKS
from grader.judging.findings import fault_sentence
from grader.judging.values import carries_number, student_endpoints
from grader.judging.wording import quote
from grader.rubrics.loader import RubricMistakes, read_rubric
from grader.rubrics.yaml_tree import YamlSyntaxError, read_yaml

ODOMETRY = "nav_msgs/msg/Odometry"
#: Time before the first stimulus, to observe how the nodes wait.
FIRST_S = 1.0
#: Topic -> fields of the messages that the author wants to send.
SentMessages = Mapping[str, Sequence[Mapping[str, object]]]
#: No message was named.
NOTHING: SentMessages = MappingProxyType({})
_VALUES = (1, 2, 3, 4)
_CALLS = 3


def stimuli_for(trace: Trace, duration_s: float, given: SentMessages = NOTHING) -> tuple[DraftStimulus, ...]:
    """Propose stimuli for all endpoints that wait for input; `given` holds the messages that the author named."""
    return (*_topics(trace, duration_s, given), *_services(trace), *_parameters(trace))


def _topics(trace: Trace, duration_s: float, given: SentMessages) -> Iterator[DraftStimulus]:
    spoken = {end.topic for end in student_endpoints(trace, "publisher")}
    for topic, type_ in dict.fromkeys((e.topic, e.type) for e in student_endpoints(trace, "subscription")):
        if topic in given:
            yield _named(topic, type_, duration_s, given[topic])
        elif topic not in spoken:
            yield _messages(topic, type_, duration_s)


def _messages(topic: str, type_: str, duration_s: float) -> DraftStimulus:
    start = in_seconds(FIRST_S)
    left_s = duration_s - FIRST_S
    if type_ == ODOMETRY:
        played = {"topic": topic, "start": start, "duration": in_seconds(max(1.0, left_s - 1))}
        return DraftStimulus("odometry", played, "decide: how long is nobody to publish before and after?")
    if carries_number(type_):
        times = {"period": DraftQuantity("200 ms"), "hold": in_seconds(max(0.5, left_s // len(_VALUES)))}
        numbers = {"topic": topic, "type": type_, "values": list(_VALUES), **times, "start": start}
        return DraftStimulus("numbers", numbers, "decide: which values tell right from wrong?")
    repeated = {"period": in_seconds(1), "repeats": max(1, int(left_s) - 1)}
    messages = {"topic": topic, "type": type_, "values": [{}], **repeated, "start": start}
    return DraftStimulus("messages", messages, "decide: which fields? {} leaves all at their defaults")


def _named(topic: str, type_: str, duration_s: float, values: Sequence[Mapping[str, object]]) -> DraftStimulus:
    """Spread the author's messages over the available time."""
    period_s = max(0.1, math.floor(10 * (duration_s - FIRST_S) / (len(values) + 1)) / 10)
    times = {"period": in_seconds(min(2.0, period_s)), "start": in_seconds(FIRST_S)}
    sent = {"topic": topic, "type": type_, "values": list(values), **times}
    return DraftStimulus("messages", sent, "decide: what else tells right from wrong?")


def _services(trace: Trace) -> Iterator[DraftStimulus]:
    servers = {end.service for end in trace.service_ends("service")}
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("service")):
        asked = {"service": service, "type": type_, "requests": [{}], "calls": _CALLS, "start": in_seconds(1)}
        yield DraftStimulus("calls", asked, "decide: which requests? {} leaves all fields at their defaults")
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("client")):
        if service not in servers:
            given = {"service": service, "type": type_, "responses": [{}], "start": in_seconds(1)}
            yield DraftStimulus("server", given, "decide: which responses? {} leaves all fields at their defaults")


def _parameters(trace: Trace) -> Iterator[DraftStimulus]:
    for node, name, _ in parameters(trace):
        asked = {"name": name, **({"node": node} if node else {}), "start": in_seconds(1)}
        yield DraftStimulus("parameter", asked, f"asks for the value of {name}; decide: is it to be set as well?")


@dataclass(frozen=True, slots=True)
class Skeleton:
    """The text of a skeleton, with the number of criteria that the reference meets, and of those in comments."""

    text: str
    criteria: int
    left_out: int
    remarks: tuple[str, ...] = ()


def new_rubric(request: ObserveRequest, progress: Progress, *, id_: str = "", sent: Sequence[str] = ()) -> Skeleton:
    """Make the skeleton of a rubric from the behaviour of a reference.

    Args:
        request: The files of the reference, and how to run them.
        progress: Called at the start of each step.
        id_: Id of the exercise; empty to derive it from the name of the first file.
        sent: Messages to send to the reference, as `TOPIC={field: value}`.

    Raises:
        SubmissionError: The reference raises an exception, or does nothing that can be checked.
        GraderError: Something that the run needs cannot be used.
    """
    given = read_sent(sent)
    alone = watch(request, progress)
    _refuse_broken(alone.trace, alone.processes)
    draft = _begun(alone.trace, request, id_, given)
    driven = watch(request, progress, _scenario_of(draft)).trace
    _refuse_broken(driven, draft.files)
    draft = replace(draft, remarks=tuple(_remarks(driven)))
    seen = Seen(alone.trace, driven, draft.files, _window_s(driven, draft.duration_s))
    kept, left_out = _sorted_out(draft, (row for row in questions(seen) if row.check in CHECKS), driven)
    if not kept:
        names = ", ".join(draft.files)
        raise SubmissionError(f"{names}: expected a reference that publishes, listens, serves or logs, found none")
    text = rubric_text(replace(draft, criteria=tuple(kept)), left_out)
    _read(text)  # find bugs of the grader here, not at the author's
    return Skeleton(text, len(kept), len(left_out), draft.remarks)


def read_sent(sent: Sequence[str]) -> SentMessages:
    """Parse the messages to send, by topic; raises GraderError for invalid ones."""
    given: dict[str, list[Mapping[str, object]]] = {}
    for text in sent:
        topic, _, fields = text.partition("=")
        try:
            data = read_yaml(fields).data
        except YamlSyntaxError:
            data = None
        if not topic.startswith("/") or not isinstance(data, dict):
            raise GraderError(f"--send {quote(text)}: expected TOPIC={{field: value}}, found something else")
        given.setdefault(topic, []).append(data)
    return given


def _remarks(trace: Trace) -> Iterator[str]:
    for topic in dict.fromkeys(e.topic for e in student_endpoints(trace, "publisher")):
        if not trace.messages(topic):
            yield f"nothing was published on {topic}: send what its node waits for with --send TOPIC={{field: value}}"


def _begun(trace: Trace, request: ObserveRequest, id_: str, given: SentMessages) -> Draft:
    """Return a draft with the scenario of the reference and no criteria."""
    files = tuple(file.name for file in request.files)
    duration_s = request.duration_ns / NS_PER_S
    stimuli = stimuli_for(trace, duration_s, given)
    unheard = [topic for topic in given if topic not in {s.parameters.get("topic") for s in stimuli}]
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


def _scenario_of(draft: Draft) -> Scenario:
    """Return the scenario of a draft, which must have at least one criterion to be read.

    Raises GraderError if a message to send has a field or a value that its type has not.
    """
    asked = DraftCriterion("any", "Any", "uses_logger", {"process": draft.files[0]}, "any")
    try:
        (scenario,) = _read(rubric_text(replace(draft, criteria=(asked,)))).scenarios
    except RubricMistakes as error:
        first = error.mistakes[0]
        raise GraderError(f"--send: {first.text}", first.hint) from None
    return scenario


def _read(text: str) -> Exercise:
    with tempfile.TemporaryDirectory(prefix="grade-new-") as folder:
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
        (criterion,) = _read(rubric_text(draft)).criteria
        finding = criterion.check.judge(trace)
    except RubricError as error:
        return f"it cannot be asked yet: {quote(error.message.partition('.yaml:')[2] or error.message)}"
    except GraderError as error:
        return f"it cannot be judged: {quote(error.message)}"
    return "" if finding.credit == 1 else f"seen: {quote(finding.reason)}"


def _refuse_broken(trace: Trace, files: Iterable[str]) -> None:
    """Raise SubmissionError if a process crashed or exited with a code other than 0."""
    for fault in trace.faults():
        if fault.exit_code != 0:
            raise SubmissionError(f"{', '.join(files)}: expected a reference that runs, found {fault_sentence(fault)}")
