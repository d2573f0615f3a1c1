"""Service calls: requests with their responses, calls about parameters, and a client's output after each."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from enum import Enum
from itertools import pairwise

from grader.core.dataclass import dataclass
from grader.core.quantities import NS_PER_MS
from grader.core.trace import ClockKind, LogRecord, Request, Response, Trace
from grader.judging.logs.outputs import Output, number_in, shape_of, written
from grader.judging.values import JITTER_NS, number_at, text_at, value_at
from grader.judging.wording import number

#: Accepted delay on clocks where the machine's load shows.
LATENESS_NS = {ClockKind.VIRTUAL: NS_PER_MS, ClockKind.WALL: 250 * NS_PER_MS}


@dataclass(frozen=True, slots=True)
class Call:
    """A service call; without a response if none came."""

    request: Request
    response: Response | None


def calls_of(trace: Trace, service: str, asker: str) -> tuple[Call, ...]:
    """Return the calls of a service by `grader` or `student` in order, each with its response."""
    answerer = "grader" if asker == "student" else "student"
    responses: dict[int, Response] = {}
    for response in trace.responses(service, answerer):
        if response.t_ns < trace.stop_ns:
            responses.setdefault(response.number, response)
    asked = [r for r in trace.requests(service, asker) if r.t_ns < trace.stop_ns]
    return tuple(Call(r, responses.get(r.number)) for r in asked)


#: Numbers of action_msgs/msg/GoalStatus.
_STATUSES = dict(enumerate(("accepted", "executing", "canceling", "succeeded", "canceled", "aborted"), 1))


def status_of(result: Response) -> str:
    """Return the status with which a goal ended, by the response to the request for its result."""
    status = result.value.get("status")
    return _STATUSES.get(status, f"status {status}") if isinstance(status, int) else "without a status"


#: A decoded parameter.
ParameterValue = str | float | bool | list[str | float | bool] | None
#: Types of rcl_interfaces/msg/ParameterValue, whose numbers begin at 1; each has a field such as `bool_value`.
_SINGLE = ("bool", "integer", "double", "string")
_TYPES = (*_SINGLE, "byte_array", *(f"{name}_array" for name in _SINGLE))


@dataclass(frozen=True, slots=True)
class ReportedParameter:
    """A parameter as a node reported it.

    Attributes:
        type: `bool`, `integer`, `double`, `string` or one of these with `_array`; empty if the node lacks the
            parameter.
    """

    t_ns: int
    node: str
    type: str
    value: ParameterValue


@dataclass(frozen=True, slots=True)
class ParameterSetting:
    """An attempt to set a parameter.

    Attributes:
        t_ns: Time of the response, or of the request without one.
        taken: Whether the node accepted the value.
        why: The node's reason if it did not.
    """

    t_ns: int
    value: ParameterValue
    answered: bool
    taken: bool
    why: str


def calls_of_node(trace: Trace, node: str | None, service: str) -> list[Call]:
    """Return the grader's calls of a service that each node has, such as `get_parameters`, of one node or all."""
    asked = (r.service for r in trace.of(Request) if r.sender == "grader" and r.service.endswith(f"/{service}"))
    names = [name for name in dict.fromkeys(asked) if node in (None, name.rpartition("/")[0])]
    return [call for name in names for call in calls_of(trace, name, "grader")]


def asked_for(trace: Trace, name: str, node: str | None = None) -> list[Call]:
    """Return the calls that asked for a parameter."""
    return [c for c in calls_of_node(trace, node, "get_parameters") if name in _list(c.request.value, "names")]


def reported_parameter(call: Call, name: str) -> ReportedParameter | None:
    """Return a parameter as a response reported it; None without a response."""
    if call.response is None:
        return None
    node = call.request.service.rpartition("/")[0]
    values = _list(call.response.value, "values")
    place = _list(call.request.value, "names").index(name)
    found = values[place] if place < len(values) else None
    type_, value = _typed(found)
    return ReportedParameter(call.response.t_ns, node, type_, value)


def settings(trace: Trace, name: str, node: str | None = None) -> list[ParameterSetting]:
    """Return the attempts to set a parameter, in order."""
    found = []
    for call in calls_of_node(trace, node, "set_parameters"):
        for place, parameter in enumerate(_list(call.request.value, "parameters")):
            if isinstance(parameter, Mapping) and parameter.get("name") == name:
                found.append(_set(call, place, parameter))
    return sorted(found, key=lambda s: s.t_ns)


def _set(call: Call, place: int, parameter: Mapping[str, object]) -> ParameterSetting:
    value = _typed(parameter.get("value"))[1]
    if call.response is None:
        return ParameterSetting(call.request.t_ns, value, answered=False, taken=False, why="")
    results = _list(call.response.value, "results")
    result = results[place] if place < len(results) else {}
    taken = isinstance(result, Mapping) and result.get("successful") is True
    why = str(result.get("reason", "")) if isinstance(result, Mapping) else ""
    return ParameterSetting(call.response.t_ns, value, answered=True, taken=taken, why=why)


def _typed(value: object) -> tuple[str, ParameterValue]:
    if not isinstance(value, Mapping):
        return "", None
    number = value.get("type")
    name = _TYPES[number - 1] if isinstance(number, int) and 1 <= number <= len(_TYPES) else ""
    return name, value.get(f"{name}_value")


def _list(value: Mapping[str, object], name: str) -> list[object]:
    found = value.get(name)
    return list(found) if isinstance(found, (list, tuple)) else []


_COMPLAINTS = ("WARN", "ERROR", "FATAL")


class CallKind(str, Enum):
    """The kind of a response."""

    GOOD = "good"  # a number above the threshold
    LOW = "low"  # a number at or below it
    FAILED = "failed"  # without success
    UNREADABLE = "unreadable"  # without a number
    UNANSWERED = "unanswered"  # no response came


@dataclass(frozen=True, slots=True)
class ResponseReader:
    """How to read a response.

    Attributes:
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value that tells whether the number counts; empty if there is none.
    """

    field: str
    success: str
    pattern: str | None
    threshold: float


@dataclass(frozen=True, slots=True)
class Episode:
    """A call, and the time until the next one.

    Attributes:
        text: The text that holds the number; empty if the field is a number.
        start_ns: Time of the response, or of the request without one.
        stop_ns: Time of the next request, or the end of the recording.
        until_ns: `stop_ns` less the clock's jitter.
        outputs: Output in [start_ns, stop_ns], in order; both ends are widened by the clock's jitter.
        awaiting: Output between the request and its response, in order.
    """

    place: int
    kind: CallKind
    number: float | None
    text: str
    asked_ns: int
    start_ns: int
    stop_ns: int
    until_ns: int
    outputs: tuple[Output, ...]
    awaiting: tuple[Output, ...]

    @property
    def sure(self) -> tuple[Output, ...]:
        """Output that cannot belong to another call: from the response on, before the next request."""
        return tuple(o for o in self.outputs if self.start_ns <= o.t_ns < self.until_ns)

    @property
    def shapes(self) -> frozenset[str]:
        """Shapes of the output."""
        return frozenset(shape_of(o.text) for o in self.outputs)


def episodes_of(trace: Trace, process: str, service: str, reading: ResponseReader) -> tuple[Episode, ...]:
    """Return the calls of a student's client, each with the output of the process after it."""
    calls = calls_of(trace, service, "student")
    stops = [*(b.request.t_ns for _, b in pairwise(calls)), trace.stop_ns]
    responses = [*(b.response for _, b in pairwise(calls)), None]
    outputs = sorted(written(trace, process), key=lambda o: o.t_ns)
    jitter_ns = JITTER_NS[trace.clock]
    found = []
    for place, (call, stop_ns, following) in enumerate(zip(calls, stops, responses, strict=False), 1):
        kind, number, text = _read(call.response, reading)
        asked_ns = call.request.t_ns
        start_ns = asked_ns if call.response is None else call.response.t_ns
        until_ns = stop_ns if place == len(calls) else stop_ns - jitter_ns
        # the next response causes what is written after it, however long the jitter is
        last_ns = (
            stop_ns + jitter_ns if following is None else max(stop_ns, min(stop_ns + jitter_ns, following.t_ns - 1))
        )
        during = tuple(o for o in outputs if start_ns - jitter_ns <= o.t_ns <= last_ns)
        before = tuple(o for o in outputs if asked_ns <= o.t_ns < start_ns)
        found.append(Episode(place, kind, number, text, asked_ns, start_ns, stop_ns, until_ns, during, before))
    return tuple(found)


def complaints(outputs: Sequence[Output]) -> list[LogRecord]:
    """Return the records of severity WARN or higher."""
    return [o for o in outputs if isinstance(o, LogRecord) and o.severity in _COMPLAINTS]


def _read(response: Response | None, reading: ResponseReader) -> tuple[CallKind, float | None, str]:
    if response is None:
        return CallKind.UNANSWERED, None, ""
    text = text_at(response.value, reading.field)
    number = number_in(text, reading.pattern) if text is not None else number_at(response.value, reading.field)
    if reading.success and not value_at(response.value, reading.success):
        return CallKind.FAILED, number, text or ""
    if number is None or not math.isfinite(number):
        return CallKind.UNREADABLE, None, text or ""
    return (CallKind.GOOD if number > reading.threshold else CallKind.LOW), number, text or ""


def _shapes_before(trace: Trace, process: str, service: str, *, cautious: bool) -> frozenset[str]:
    """Return the shapes of the texts before the first response; `cautious` adds its instant if it came at once."""
    first = next((c for c in calls_of(trace, service, "student") if c.response is not None), None)
    if first is None or first.response is None:
        return frozenset()
    until_ns = first.response.t_ns + (cautious and first.response.t_ns == first.request.t_ns)
    return frozenset(shape_of(o.text) for o in written(trace, process) if o.t_ns < until_ns)


#: Whether an output complains, and its shape.
Text = tuple[bool, str]


def text_of(output: Output) -> Text:
    """Return what outputs of the same wording share; a record that complains differs from one that does not."""
    return bool(complaints((output,))), shape_of(output.text)


def _texts(outputs: Iterable[Output]) -> frozenset[Text]:
    return frozenset(map(text_of, outputs))


def _loose(episode: Episode) -> tuple[Output, ...]:
    return episode.outputs


def _sure(episode: Episode) -> tuple[Output, ...]:
    return episode.sure


_View = Callable[[Episode], tuple[Output, ...]]


@dataclass(frozen=True, slots=True)
class Going:
    """What a client writes only when it continues.

    Attributes:
        texts: The texts; none of them complains.
        view: The outputs of an episode among which they are sought.
        clear: Whether each output belongs to one response, and there is another kind of response to compare with.
        compared: Whether that kind is a low number; otherwise text that shows a response does not signal continuing.
    """

    texts: frozenset[Text]
    view: _View
    clear: bool
    compared: bool

    def outputs(self, episode: Episode) -> list[Output]:
        """Return the outputs of an episode that show that the client continues."""
        found = [o for o in self.view(episode) if text_of(o) in self.texts]
        return found if self.compared else [o for o in found if not _quotes(o, episode)]


@dataclass(frozen=True, slots=True)
class Words:
    """What a client writes after responses of each kind.

    Attributes:
        before: Shapes of the texts before the first response.
        clear: Whether no response came at the instant of its request, where output of two responses looks alike.
    """

    clock: ClockKind
    episodes: tuple[Episode, ...]
    before: frozenset[str]
    clear: bool

    @classmethod
    def of(cls, trace: Trace, process: str, service: str, episodes: tuple[Episode, ...]) -> Words:
        """Return the words of a process in a trace."""
        lows = any(e.kind is CallKind.LOW for e in episodes)
        before = _shapes_before(trace, process, service, cautious=not lows)
        clear = all(e.start_ns > e.asked_ns for e in episodes if e.kind is not CallKind.UNANSWERED)
        return cls(trace.clock, episodes, before, clear)

    def _of(self, *kinds: CallKind) -> list[Episode]:
        return [e for e in self.episodes if e.kind in kinds]

    def _new(self, texts: Iterable[Text]) -> frozenset[Text]:
        """Return the texts that do not complain and do not come before the first response."""
        return frozenset(t for t in texts if not t[0] and t[1] not in self.before)

    def telling(self, episode: Episode) -> list[Output] | None:
        """Return the new output after a good response that does not follow every low number; None if unclear."""
        low = self._of(CallKind.LOW)
        if not low or not self.clear:
            return None
        texts = self._new(_texts(episode.outputs)) - frozenset.intersection(*(_texts(e.sure) for e in low))
        return [o for o in episode.outputs if text_of(o) in texts]

    @property
    def only_good(self) -> frozenset[Text] | None:
        """The texts that follow good responses and no low number; None if this is not clear."""
        good, low = self._of(CallKind.GOOD), self._of(CallKind.LOW)
        if not good or not low or not self.clear:
            return None
        return self._contrast(good, low, _loose)

    @property
    def shared(self) -> tuple[Output, float] | None:
        """The last output after a low number whose text follows a good response too, with the number; or None."""
        good = self._new(t for e in self._of(CallKind.GOOD) for t in _texts(e.outputs))
        found = [(o, e.number) for e in self._of(CallKind.LOW) for o in e.sure if text_of(o) in good]
        return next(((o, n) for o, n in reversed(found) if n is not None), None)

    def _contrast(self, good: Sequence[Episode], others: Sequence[Episode], view: _View) -> frozenset[Text]:
        """Return the new texts of good responses, less those of others."""
        found = self._new(t for e in good for t in _texts(view(e)))
        less = found.difference(*(_texts(e.outputs) for e in others))
        # on the wall clock, output at the edge of an episode may belong to its neighbour
        return less or (found.difference(*(_texts(e.sure) for e in others)) if self.clock is ClockKind.WALL else less)

    def start_after_abort(self, episode: Episode) -> Output | None:
        """Return output after a low number that follows every good response, but not the first low number."""
        good, low = self._of(CallKind.GOOD), self._of(CallKind.LOW)
        if not good or not self.clear or episode is low[0]:
            return None
        going = self._new(frozenset.intersection(*(_texts(e.sure) for e in good))) - _texts(low[0].outputs)
        return next((o for o in episode.sure if text_of(o) in going), None)

    def going(self, kind: CallKind) -> Going:
        """Return what the client writes only when it continues: not after low numbers, or else not after other answers.

        Args:
            kind: The kind of useless response that the texts are sought after.
        """
        good, low = self._of(CallKind.GOOD), self._of(CallKind.LOW)
        answered = [e for e in self._of(CallKind.FAILED, CallKind.UNREADABLE) if e.kind is not kind]
        others = low or answered
        if not others:
            # without another answer to compare with, text that shows the response itself does not signal continuing
            shown = {text_of(o) for e in good for o in e.outputs if _quotes(o, e)}
            each = frozenset.intersection(*(_texts(e.outputs) for e in good))
            alone = all(e.kind in (CallKind.GOOD, kind) for e in self.episodes)
            return Going(self._new(each) - shown if alone else frozenset(), _sure, clear=False, compared=False)
        views: tuple[_View, ...] = (_sure, _loose)
        some = {view: self._contrast(good, others, view) for view in views}
        common = {view: some[view].intersection(*(_texts(view(e)) for e in good)) for view in views}
        found = [(choice[view], view) for choice in (common, some) for view in views if choice[view]]
        texts, view = found[0] if found else (frozenset[Text](), _sure)
        return Going(texts, view, self.clear, bool(low))


def _quotes(output: Output, episode: Episode) -> bool:
    shown = "" if episode.number is None else number(episode.number)
    return bool(episode.text and episode.text in output.text) or bool(shown and shown in output.text)
