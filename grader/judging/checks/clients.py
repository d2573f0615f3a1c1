"""Checks on a student's service client: how often it calls, that it waits, and how it handles responses."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import field
from itertools import pairwise
from typing import Annotated, ClassVar, Literal

from grader.core.chart import Band, Level, Look, Panel, Point, Tone
from grader.core.dataclass import dataclass
from grader.core.errors import HarnessError
from grader.core.exercise import Finding, ProblemKind, Roles
from grader.core.quantities import NS_PER_S, DurationNs, FieldOf, Pattern, counted, seconds
from grader.core.trace import OutputLine, Trace
from grader.judging.charts import Lanes, drawn_case, gaps_panel, series
from grader.judging.checks.logs import complained
from grader.judging.findings import (
    explain_fault,
    explain_no_client,
    fault_hint,
    fault_sentence,
    faulted,
    first_fault,
    met,
    not_met,
    only_printed,
    waiting_for,
)
from grader.judging.logs.outputs import Output, printed_lines, shape_of, student_records
from grader.judging.plots import Drawing
from grader.judging.service_calls import (
    LATENESS_NS,
    Call,
    CallKind,
    Episode,
    Going,
    ResponseReader,
    Words,
    calls_of,
    complaints,
    episodes_of,
    text_of,
)
from grader.judging.values import RuleOrValue, breach, broken_rules, rules_text
from grader.judging.wording import moment, number, quote, span

_WAIT_HINT = "wait in a loop: while not client.wait_for_service(timeout_sec=1.0): log that it is still waited for"


@dataclass(frozen=True, slots=True)
class CallsOfClient:
    """A student's client sends the expected number of requests to the grader's server, with a period if one is given.

    A gap may be longer by the time that the server took to respond. After a call without a response, the gap may have
    any length.

    Attributes:
        service: Service name as on the wire.
        calls: Smallest number of requests.
        at_most: Largest number of requests; `calls` if left out.
        period: Time expected from one request to the next; free if left out.
        tolerance: Largest difference of each gap from the period.
        fields: What every request must hold by field path: a value, or `{equals, items, tolerance, low, high, pattern,
            example}`.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    service: str
    calls: int
    at_most: int | None = None
    period: DurationNs | None = None
    tolerance: DurationNs = NS_PER_S // 4
    fields: Annotated[Mapping[str, RuleOrValue], FieldOf("service", "_Request")] = field(default_factory=dict)

    @property
    def expected(self) -> str:
        text = f"{counted(self.calls, 'request')} on {self.service}"
        text += f" with {rules_text(self.fields)}" if self.fields else ""
        if self.period is None:
            return text
        return f"{text}, {number(seconds(self.period))} ± {number(seconds(self.tolerance))} s apart"

    def judge(self, trace: Trace) -> Finding:
        calls = calls_of(trace, self.service, "student")
        if not calls:
            return explain_no_client(trace, self.service)
        gaps = [b.request.t_ns - a.request.t_ns for a, b in pairwise(calls)]
        evidence = {
            "service": self.service,
            "requests": len(calls),
            "times_s": [seconds(c.request.t_ns) for c in calls[:100]],
        }
        if not self.calls <= len(calls) <= max(self.calls, self.at_most or 0):
            return self._miscounted(trace, calls, evidence)
        for request in (c.request for c in calls):
            for path in broken_rules(request.value, self.fields)[:1]:
                flaw = breach(request.value, path, self.fields[path])
                reason = f"{moment(request.t_ns)}, {self.service}: {flaw} in the request"
                return not_met(reason, evidence | {"field": path}, problem=ProblemKind.WRONG_VALUE)
        wrong = self._wrong_gap(trace, calls) if self.period is not None else None
        asked = f"{self.service}: {counted(len(calls), 'request')}"
        if wrong is None:
            apart = f", {number(sum(gaps) / len(gaps) / NS_PER_S)} s apart on average" if gaps else ""
            return met(asked + apart, evidence)
        place, gap = wrong
        wanted = f"{span(self.period or 0)} ± {number(seconds(self.tolerance))} s"
        reason = f"{asked}; {seconds(gap):.3f} s from number {place} to number {place + 1}, expected {wanted}"
        hint = f"wait {span(self.period or 0)} after each answer before asking again"
        return not_met(reason, evidence, hint=hint, problem=ProblemKind.WRONG_RATE)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the time from each to the next with the period."""
        times = [c.request.t_ns for c in calls_of(trace, self.service, "student")]
        if len(times) < 2:
            return Drawing(services=(self.service,))
        bands = []
        if self.period is not None:
            label = f"{number(seconds(self.period))} ± {number(seconds(self.tolerance))} s"
            bands.append(Band(seconds(self.period - self.tolerance), seconds(self.period + self.tolerance), label))
        gaps = [seconds(b - a) for a, b in pairwise(times)]
        said = f"{min(gaps):.3f} s to {max(gaps):.3f} s from request to request."
        return Drawing(services=(self.service,), panels=((gaps_panel("request", times, bands=bands), said),))

    def _wrong_gap(self, trace: Trace, calls: Sequence[Call]) -> tuple[int, int] | None:
        """Return the number of the first call whose gap to the next is wrong, and the gap."""
        slack = LATENESS_NS[trace.clock] + self.tolerance
        period = self.period or 0
        for place, (one, following) in enumerate(pairwise(calls), 1):
            gap = following.request.t_ns - one.request.t_ns
            took = 0 if one.response is None else max(0, one.response.t_ns - one.request.t_ns)
            if gap < period - slack or (one.response is not None and gap > period + slack + took):
                return place, gap
        return None

    def _miscounted(self, trace: Trace, calls: Sequence[Call], evidence: dict[str, object]) -> Finding:
        reason = f"{self.service}: {counted(len(calls), 'request')}, expected {self.calls}"
        if len(calls) > self.calls:
            hint = f"ask {self.calls} times: for i in range({self.calls})"
            return not_met(reason, evidence, hint=hint, problem=ProblemKind.TOO_MANY)
        if crashed := explain_fault(trace, reason, evidence, last=True):
            return crashed
        last = calls[-1]
        waiting = "; the last one got no response" if last.response is None else ""
        ended = trace.marks("exited")
        ended_said = f"; {ended[0].detail} ended at {moment(ended[0].t_ns)}" if ended else ""
        if not ended and not waiting and last.request.t_ns + (self.period or 0) + self.tolerance >= trace.stop_ns:
            raise HarnessError(f"{self.service}: the recording ends before {self.calls} requests could be sent")
        return not_met(reason + waiting + ended_said, evidence, problem=ProblemKind.TOO_FEW)


@dataclass(frozen=True, slots=True)
class WaitsForService:
    """A client survives the time before its server appears, logs that it waits, and calls once the server is there.

    The wording is free, but a record of severity ERROR or FATAL does not count. Printing it instead of logging gives
    half the points.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        within: Longest time from the server's appearance to the first request.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    within: DurationNs = 5 * NS_PER_S

    @property
    def expected(self) -> str:
        return f"{self.process} waits for {self.service}, logs that it does, and asks once it is there"

    def judge(self, trace: Trace) -> Finding:
        starts = trace.marks("server_starts", self.service)
        appears_ns = starts[0].t_ns if starts else trace.stop_ns + 1
        gave_up = self._gave_up(trace, appears_ns)
        if gave_up is not None:
            return gave_up
        if not starts or appears_ns == 0:
            raise HarnessError(f"{self.service}: the recording has no time before the server appears")
        asked = [c.request.t_ns for c in calls_of(trace, self.service, "student") if c.request.t_ns >= appears_ns]
        if not asked or asked[0] - appears_ns > self.within + LATENESS_NS[trace.clock]:
            return self._never_asked(trace, appears_ns, asked)
        return self._said(trace, appears_ns, asked[0])

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls with what the client wrote, and the time without a server."""
        starts = trace.marks("server_starts", self.service)
        until_ns = min(starts[0].t_ns if starts else trace.stop_ns, trace.stop_ns)
        cases = (drawn_case(0, until_ns, f"{self.service} is not there"),)
        panels = []
        if not calls_of(trace, self.service, "student"):
            lanes = Lanes()
            lanes.add("request")
            panels.append((lanes.panel(self.service), f"No request on {self.service}."))
        title = f"Calls of {self.service} and what {self.process} wrote"
        return Drawing((), (self.service,), panels=tuple(panels), processes=(self.process,), cases=cases, title=title)

    def _gave_up(self, trace: Trace, appears_ns: int) -> Finding | None:
        """Return a finding if the client ended while waiting, or logged an error; None otherwise."""
        fault = first_fault(trace, self.process)
        when = f"while {self.service} was not there"
        if fault is not None and fault.t_ns < appears_ns:
            hint = fault_hint(fault) or _WAIT_HINT
            return not_met(f"{fault_sentence(fault)}, {when}", {"fault_s": seconds(fault.t_ns)}, hint=hint, fault=fault)
        ended = next((m for m in trace.marks("exited", self.process) if m.t_ns < appears_ns), None)
        if ended is not None:
            reason = f"{self.process} ended at {moment(ended.t_ns)}, {when}"
            return not_met(reason, {"ended_s": seconds(ended.t_ns)}, hint=_WAIT_HINT, problem=ProblemKind.ENDED)
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        bad = [r for r in records if r.severity in ("ERROR", "FATAL")]
        if not bad:
            return None
        return complained(self.process, bad, f" {when}", {}, "waiting is not an error: log it with info or warn")

    def _never_asked(self, trace: Trace, appears_ns: int, asked: Sequence[int]) -> Finding:
        there = f"{self.service} appeared at {moment(appears_ns)}"
        if crashed := explain_fault(trace, f"{there}, no request was sent", process=self.process):
            return crashed
        if not trace.requests(self.service, "student") and not trace.service_ends("client", self.service):
            return waiting_for("service_calls", explain_no_client(trace, self.service))
        when = f"the first request was sent at {moment(asked[0])}" if asked else "no request was sent"
        if not asked and trace.stop_ns - appears_ns <= self.within:
            raise HarnessError(f"{self.service}: the recording ends too soon after the server appeared")
        reason = f"{there}, {when}, expected one within {span(self.within)}"
        problem = ProblemKind.TOO_LATE if asked else ProblemKind.SILENT
        return not_met(reason, {"appears_s": seconds(appears_ns)}, hint=_WAIT_HINT, problem=problem)

    def _said(self, trace: Trace, appears_ns: int, asked_ns: int) -> Finding:
        records = [r for r in student_records(trace, self.process) if r.t_ns < appears_ns]
        lines = [o for o in printed_lines(trace, self.process) if o.t_ns < appears_ns]
        evidence = {
            "appears_s": seconds(appears_ns),
            "first_request_s": seconds(asked_ns),
            "records": len(records),
            "printed_lines": len(lines),
        }
        waited = f"{self.process}: alive through {span(appears_ns)} without {self.service}, asks at {moment(asked_ns)}"
        if records:
            return met(
                f"{waited}; {counted(len(records), 'record')} meanwhile: {quote(records[-1].text, 80)}", evidence
            )
        if lines:
            return only_printed(f"{waited}; that it waits is printed, not logged", evidence)
        return not_met(
            f"{waited}, but logs nothing while it waits", evidence, hint=_WAIT_HINT, problem=ProblemKind.NOT_LOGGED
        )


#: A client that has sent no request for this long is not expected to send another.
_ASKS_AGAIN_NS = 5 * NS_PER_S
_SAID = {
    CallKind.FAILED: "a response without success",
    CallKind.UNREADABLE: "an answer without a number",
    CallKind.UNANSWERED: "a request that got no response",
}


@dataclass(frozen=True, slots=True)
class ReactsToResponses:
    """A client continues after a response with a number above a threshold, and warns if the number is at or below it.

    A warning is a record of severity WARN or higher between the response and the next request. Continuing means output
    in that time without such a record, in words that do not follow every number at or below the threshold as well. A
    warning shows nothing if no words are kept for the numbers above, or if words that follow each of these come after
    a later low number. The wording is free. Responses without success or without a number are ignored. Printing instead
    of logging gives half the points.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: Where the reaction changes; the threshold itself is not above.
        side: The side that this criterion judges.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value without which a response is ignored; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if left
            out.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    threshold: float
    side: Literal["above", "at_or_below", "both"] = "both"
    field: Annotated[str, FieldOf("service", "_Response")] = "message"
    success: Annotated[str, FieldOf("service", "_Response", unless="none")] = "success"
    pattern: Pattern | None = None

    @property
    def expected(self) -> str:
        limit = number(self.threshold)
        goes, warns = f"goes on above {limit}", f"logs a warning at or below {limit}"
        text = {"above": goes, "at_or_below": warns, "both": f"{goes} and {warns}"}[self.side]
        return f"{self.process} {text}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        episodes = _episodes(self, trace)
        if not episodes:
            return _not_asked(trace, self.process, self.service)
        sides = {CallKind.GOOD: self.side != "at_or_below", CallKind.LOW: self.side != "above"}
        mine = [e for e in episodes if sides.get(e.kind)]
        if len({e.kind for e in mine}) < sum(sides.values()):
            return _not_reached(trace, self.process, self.service, episodes)
        evidence = self._evidence(episodes)
        words = Words.of(trace, self.process, self.service, episodes)
        wrong = [(e, flaw) for e in mine if (flaw := self._wrong(e, episodes, words))]
        if not wrong:
            return self._unshown(mine, words, evidence) or self._right(trace, mine, words, evidence)
        if not student_records(trace, self.process) or all(e.kind is CallKind.LOW for e, _ in wrong):
            printed = self._by_printing(mine, episodes)
            if printed:
                return only_printed(f"{self.process}: {printed}", evidence)
        return self._explain(trace, wrong, evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the numbers that came with the threshold, the kind of each response, and what the client wrote."""
        return _episodes_drawing(self, trace)

    def _wrong(self, episode: Episode, episodes: Sequence[Episode], words: Words) -> str:
        """Describe what is wrong with the reaction to a response; empty if nothing is."""
        if episode.kind is CallKind.LOW:
            if not complaints(episode.outputs):
                return "no record of severity WARN"
            started = words.start_after_abort(episode)
            return f"{quote(started.text, 80)!r} at {moment(started.t_ns)}" if started is not None else ""
        before = episodes[episode.place - 2] if episode.place > 1 else None
        late = before is not None and before.kind is not CallKind.GOOD
        # a client that reads a response only when it calls again warns then about the previous one
        early = () if late else episode.awaiting
        warned = [r for r in complaints((*early, *episode.sure)) if not (late and r.t_ns <= episode.asked_ns)]
        if warned:
            return f"{warned[0].severity} at {moment(warned[0].t_ns)}: {quote(warned[0].text, 80)}"
        if not episode.outputs:
            return "nothing is written"
        return "only text that also follows low numbers" if words.telling(episode) == [] else ""

    def _unshown(self, mine: Sequence[Episode], words: Words, evidence: dict[str, object]) -> Finding | None:
        """Return a finding if warnings do not show that a mission is aborted, because none is ever seen to start."""
        low = next((e for e in mine if e.kind is CallKind.LOW), None)
        if low is None or words.only_good is None or words.only_good:
            return None
        reason = f"{self.process}: it warns after {number(low.number or 0.0)}, but {_nothing_of_its_own(self, words)}, "
        reason += "so nothing shows that it aborts"
        hint = "log that it goes on, in the branch for numbers above the limit only"
        return not_met(reason, evidence, hint=hint, blocked_by="reacts_to_responses", problem=ProblemKind.WRONG_ANSWER)

    def _right(self, trace: Trace, mine: Sequence[Episode], words: Words, evidence: dict[str, object]) -> Finding:
        reason = f"{self.process}: right after each of {counted(len(mine), 'response')} "
        reason += f"({', '.join(number(e.number) for e in mine[:8] if e.number is not None)})"
        telling = [words.telling(e) for e in mine if e.kind is CallKind.GOOD]
        printed = any(told and all(isinstance(o, OutputLine) for o in told) for told in telling)
        if printed or not student_records(trace, self.process):
            return only_printed(f"{reason}, printed and not logged", evidence)
        return met(reason, evidence)

    def _by_printing(self, mine: Sequence[Episode], episodes: Sequence[Episode]) -> str:
        """Return that warnings are printed: lines that come only after low numbers; empty if they are not."""
        good = {s for e in episodes if e.kind is CallKind.GOOD for s in e.shapes}
        low = [e for e in mine if e.kind is CallKind.LOW]
        told = [_lines(e.outputs, good) for e in low]
        if not low or not all(told):
            return ""
        return f"at or below {number(self.threshold)} it prints {quote(told[0][0].text, 80)!r}, expected a WARN record"

    def _evidence(self, episodes: Sequence[Episode]) -> dict[str, object]:
        rows = [
            [seconds(e.start_ns), e.kind.value, e.number, [r.severity for r in complaints(e.sure)]]
            for e in episodes[:50]
        ]
        return {"columns": ["t_s", "response", "number", "warnings"], "rows": rows}

    def _explain(self, trace: Trace, wrong: Sequence[tuple[Episode, str]], evidence: dict[str, object]) -> Finding:
        episode, flaw = wrong[0]
        rule = "go on" if episode.kind is CallKind.GOOD else "log a warning"
        if episode.kind is CallKind.LOW and complaints(episode.outputs):
            rule = "start nothing"
        side = "above" if episode.kind is CallKind.GOOD else "at or below"
        reason = f"{moment(episode.start_ns)}, {self.process}: {flaw} after {number(episode.number or 0.0)}; expected "
        reason += f"it to {rule}, as after every number {side} {number(self.threshold)}"
        fault = first_fault(trace, self.process)
        if fault is not None and episode.start_ns <= fault.t_ns <= episode.stop_ns:
            return faulted(fault, reason, evidence, last=True)
        return not_met(reason, evidence, hint=self._hint(wrong), problem=ProblemKind.WRONG_ANSWER)

    def _hint(self, wrong: Sequence[tuple[Episode, str]]) -> str:
        kinds = {e.kind for e, _ in wrong}
        if kinds == {CallKind.LOW} and all(e.number == self.threshold for e, _ in wrong):
            return (
                f"{number(self.threshold)} itself is not above {number(self.threshold)}: compare with > and not with >="
            )
        if kinds == {CallKind.LOW}:
            return f"at or below {number(self.threshold)}, write self.get_logger().warn(...) and do not go on"
        return ""


@dataclass(frozen=True, slots=True)
class NoGoWithoutAnswer:
    """A client does not continue after a response without success or without a number, or without any response.

    What the client writes when it continues is learned from the responses above the threshold: words that follow each
    of them, or else some of them, and come neither before the first response, nor after a number at or below the
    threshold, nor after a useless response of another kind. None of these may come between a useless response and the
    next request. If there are no such words, nothing shows whether the client continues. A crash at a useless response
    is reported and costs nothing. The server should respond with a delay, to separate output before and after a
    response, and one of its responses should be of another kind; without these, unclear cases are accepted.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: The client continues with numbers above it.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value that tells whether the number counts; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if left
            out.
    """

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    threshold: float
    field: Annotated[str, FieldOf("service", "_Response")] = "message"
    success: Annotated[str, FieldOf("service", "_Response", unless="none")] = "success"
    pattern: Pattern | None = None

    @property
    def expected(self) -> str:
        return f"{self.process} does not go on where {self.service} gives no answer, no success or no number"

    def judge(self, trace: Trace) -> Finding:
        episodes = _episodes(self, trace)
        if not episodes:
            return _not_asked(trace, self.process, self.service)
        useless = [e for e in episodes if e.kind in _SAID]
        if not useless or not any(e.kind is CallKind.GOOD for e in episodes):
            return _not_reached(trace, self.process, self.service, episodes)
        words = Words.of(trace, self.process, self.service, episodes)
        kinds = [e.kind.value for e in useless]
        evidence: dict[str, object] = {"useless": kinds}
        for episode in useless:
            going = words.going(episode.kind)
            evidence["goes_on_with"] = sorted(shape for _, shape in going.texts)[:5]
            if not going.texts and going.clear:
                return self._unshown(episode, words, evidence)
            found = [o for o in going.outputs(episode) if not self._due(o, episode, episodes, going)]
            if found:
                return self._went_on(episode, found[0], evidence)
        reason = f"{self.process}: does not go on after {counted(len(useless), 'useless answer')}"
        reason += f" ({', '.join(dict.fromkeys(_SAID[e.kind] for e in useless))})"
        fault = first_fault(trace, self.process)
        if fault is not None and fault.t_ns >= useless[0].asked_ns:
            reason += f"; it ended there: {fault_sentence(fault)}, which costs nothing here"
        return met(reason, evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the numbers that came with the threshold, the kind of each response, and what the client wrote."""
        return _episodes_drawing(self, trace)

    def _due(self, found: Output, episode: Episode, episodes: Sequence[Episode], going: Going) -> bool:
        """Return whether output at the instant of a request still belongs to the previous good response."""
        before = episodes[episode.place - 2] if episode.place > 1 else None
        if before is None or before.kind is not CallKind.GOOD or found.t_ns > episode.asked_ns:
            return False
        return not any(text_of(o) in going.texts for o in before.sure)

    def _unshown(self, episode: Episode, words: Words, evidence: dict[str, object]) -> Finding:
        reason = f"{self.process}: {_nothing_of_its_own(self, words)}, so nothing shows that it does not go on after "
        reason += _SAID[episode.kind]
        hint = "log that it goes on, in the branch for numbers above the limit only"
        return not_met(reason, evidence, hint=hint, blocked_by="reacts_to_responses", problem=ProblemKind.WRONG_ANSWER)

    def _went_on(self, episode: Episode, found: Output, evidence: dict[str, object]) -> Finding:
        what = _SAID[episode.kind]
        reason = f"{moment(found.t_ns)}, {self.process}: {quote(found.text, 80)!r} after {what} "
        reason += f"(request {episode.place}), the same text as when it goes on; expected it not to go on"
        hint = "go on only if there is a response, response.success is true and its number could be read"
        return not_met(reason, evidence | {"first_wrong_s": seconds(found.t_ns)}, hint=hint)


def _episodes(check: ReactsToResponses | NoGoWithoutAnswer, trace: Trace) -> tuple[Episode, ...]:
    success = "" if check.success == "none" else check.success
    reading = ResponseReader(check.field, success, check.pattern, check.threshold)
    return episodes_of(trace, check.process, check.service, reading)


_CASES = {
    CallKind.GOOD: ("above", Tone.GOOD),
    CallKind.LOW: ("not above", Tone.WARNING),
    CallKind.FAILED: ("no success", Tone.BAD),
    CallKind.UNREADABLE: ("no number", Tone.BAD),
    CallKind.UNANSWERED: ("no response", Tone.BAD),
}


def _episodes_drawing(check: ReactsToResponses | NoGoWithoutAnswer, trace: Trace) -> Drawing:
    """Return each response with its number and kind, and below it what the client wrote until its next request."""
    episodes = _episodes(check, trace)
    if not episodes:
        return Drawing()
    limit = number(check.threshold)
    cases, lanes = [], Lanes()
    points: dict[tuple[str, Tone], list[Point]] = {}
    lanes.add("request")
    lanes.dots("request", ((e.asked_ns, f"request {e.place}") for e in episodes), Tone.SECOND)
    lanes.add("response")
    told = [e for e in episodes if e.kind is not CallKind.UNANSWERED]
    lanes.dots("response", ((e.start_ns, e.text or f"response {e.place}") for e in told), Tone.MAIN)
    for e in episodes:
        said, tone = _CASES[e.kind]
        label = f"{said} {limit}" if e.kind in (CallKind.GOOD, CallKind.LOW) else said
        stop_ns = min([e.stop_ns, *(m.t_ns for m in trace.marks("exited", check.process) if m.t_ns >= e.start_ns)])
        cases.append(drawn_case(e.asked_ns, stop_ns, label, tone))
        if e.number is not None:
            points.setdefault((f"number, {label}", tone), []).append((seconds(e.start_ns), e.number))
    level = Level(check.threshold, limit, name="threshold")
    dots = tuple(series(name, some, look=Look.DOTS, tone=tone) for (name, tone), some in points.items())
    numbers_ = Panel(f"number in {check.field}", "", dots, levels=(level,))
    said = f"{counted(len(episodes), 'request')} on {check.service}, {counted(len(told), 'response')}."
    title = f"Responses of {check.service} and output of {check.process}"
    panels = ((numbers_, ""), (lanes.panel(check.service), said))
    return Drawing(panels=panels, processes=(check.process,), cases=tuple(cases), title=title)


def _nothing_of_its_own(check: ReactsToResponses | NoGoWithoutAnswer, words: Words) -> str:
    """Return a clause: a client writes nothing that only follows numbers above the threshold."""
    text = f"it writes the same after numbers above {number(check.threshold)} as after others"
    if words.shared is None:
        return text
    output, value = words.shared
    return f"{text} ({quote(output.text, 80)!r} also follows {number(value)})"


def _lines(outputs: Sequence[Output], known: set[str]) -> list[OutputLine]:
    return [o for o in outputs if isinstance(o, OutputLine) and shape_of(o.text) not in known]


def _not_asked(trace: Trace, process: str, service: str) -> Finding:
    if crashed := explain_fault(trace, f"it had not asked {service} by then", process=process):
        return crashed
    return waiting_for("service_calls", explain_no_client(trace, service))


def _not_reached(trace: Trace, process: str, service: str, episodes: Sequence[Episode]) -> Finding:
    """Return no credit if a client ended or stopped calling before a response of the needed kind came.

    Raises:
        HarnessError: Neither is true, so the server sent no such response.
    """
    last = episodes[-1]
    asked = f"{service}: {process} asked {counted(len(episodes), 'time')}"
    if crashed := explain_fault(trace, f"{asked} and got no answer of the kind that is judged here", process=process):
        return crashed
    ended = trace.marks("exited", process)
    stopped = trace.stop_ns - last.start_ns > _ASKS_AGAIN_NS
    if ended or stopped or last.kind is CallKind.UNANSWERED:
        why = "waits for a response that is never sent" if last.kind is CallKind.UNANSWERED else "then stopped asking"
        why = f"ended at {moment(ended[0].t_ns)}" if ended else why
        return not_met(
            f"{asked} and {why}; it got no answer of the kind that is judged here",
            blocked_by="service_calls",
            problem=ProblemKind.ENDED if ended else ProblemKind.STOPPED,
        )
    raise HarnessError(f"{service}: no answer of the kind that is judged here was sent")
