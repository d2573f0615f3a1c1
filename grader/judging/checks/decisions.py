"""Checks on what a client does with the answers it gets: goes on, warns, or keeps still where it knows nothing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

from grader.core.errors import HarnessError
from grader.core.exercise import Finding, Pattern
from grader.core.quantities import NS_PER_S, seconds
from grader.core.trace import OutputLine, Trace
from grader.judging.checks.logs import LOGGER_HINT
from grader.judging.episodes import Episode, Kind, Reading, complaints, episodes_of, shapes_before
from grader.judging.findings import met, not_met, partly
from grader.judging.output import student_records
from grader.judging.printed import Output, shape_of
from grader.judging.services import explain_no_client
from grader.judging.silence import fault_hint, first_fault
from grader.judging.wording import counted, fault_sentence, moment, number, quote

#: A client that has not asked again for so long does not ask again.
_ASKS_AGAIN_NS = 5 * NS_PER_S
_SAID = {
    Kind.FAILED: "a response without success",
    Kind.UNREADABLE: "an answer without a number",
    Kind.UNANSWERED: "a request that got no response",
}


@dataclass(frozen=True, slots=True)
class ReactsToResponses:
    """A client goes on where a response holds a number above a threshold, and warns where it is at or below it.

    To warn is a record of severity WARN or higher after the response and before the next request. To go on is to write
    anything at all in that time, but no such record. Wording is free. Responses without success or without a number are
    not asked about. Doing it by printing only is half of it.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: Where the reaction changes; the threshold itself is not above.
        side: Which side this criterion is about.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value without which a response is not asked about; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if
            left out.
    """

    process: str
    service: str
    threshold: float
    side: Literal["above", "at_or_below", "both"] = "both"
    field: str = "message"
    success: str = "success"
    pattern: Pattern | None = None

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if every response on this side is reacted to rightly."""
        episodes = _episodes(self, trace)
        if not episodes:
            return _never_asked(trace, self.process, self.service)
        sides = {"above": (Kind.GOOD,), "at_or_below": (Kind.LOW,), "both": (Kind.GOOD, Kind.LOW)}[self.side]
        mine = [e for e in episodes if e.kind in sides]
        if not {e.kind for e in mine} >= set(sides):
            return _not_reached(trace, self.process, self.service, episodes)
        evidence = self._evidence(episodes)
        wrong = [(e, said) for e in mine if (said := self._wrong(e, episodes))]
        if not wrong:
            return self._right(trace, mine, evidence)
        if not student_records(trace, self.process) or all(e.kind is Kind.LOW for e, _ in wrong):
            printed = self._by_printing(mine, episodes)
            if printed:
                return partly(f"{self.process}: {printed}", evidence, hint=LOGGER_HINT)
        return self._explain(trace, wrong, evidence)

    def _wrong(self, episode: Episode, episodes: Sequence[Episode]) -> str:
        """Return what is wrong with the reaction to a response; empty if nothing is."""
        if episode.kind is Kind.LOW:
            return "" if complaints(episode.outputs) else "no record of severity WARN"
        before = episodes[episode.place - 2] if episode.place > 1 else None
        late = before is not None and before.kind is not Kind.GOOD
        # a client that looks at an answer when it asks again warns then about the one before
        early = () if late else episode.awaiting
        warned = [r for r in complaints((*early, *episode.sure)) if not (late and r.t_ns <= episode.asked_ns)]
        if warned:
            return f"{warned[0].severity} at {moment(warned[0].t_ns)}: {quote(warned[0].text, 80)}"
        return "" if episode.outputs else "nothing is written"

    def _right(self, trace: Trace, mine: Sequence[Episode], evidence: dict[str, Any]) -> Finding:
        reason = f"{self.process}: right after each of {counted(len(mine), 'response')} "
        reason += f"({', '.join(number(e.number) for e in mine[:8] if e.number is not None)})"
        if not student_records(trace, self.process):
            return partly(f"{reason}, printed and not logged", evidence, hint=LOGGER_HINT)
        return met(reason, evidence)

    def _by_printing(self, mine: Sequence[Episode], episodes: Sequence[Episode]) -> str:
        """Return that warnings are printed: lines that come after low numbers only; empty if they are not."""
        good = {s for e in episodes if e.kind is Kind.GOOD for s in e.shapes}
        low = [e for e in mine if e.kind is Kind.LOW]
        told = [_lines(e.outputs, good) for e in low]
        if not low or not all(told):
            return ""
        return f"at or below {number(self.threshold)} it prints {quote(told[0][0].text, 80)!r}, expected a WARN record"

    def _evidence(self, episodes: Sequence[Episode]) -> dict[str, Any]:
        rows = [
            [seconds(e.start_ns), e.kind.value, e.number, [r.severity for r in complaints(e.sure)]]
            for e in episodes[:50]
        ]
        return {"columns": ["t_s", "response", "number", "warnings"], "rows": rows}

    def _explain(self, trace: Trace, wrong: Sequence[tuple[Episode, str]], evidence: dict[str, Any]) -> Finding:
        episode, said = wrong[0]
        rule = "goes on" if episode.kind is Kind.GOOD else "warns"
        side = "above" if episode.kind is Kind.GOOD else "at or below"
        reason = (
            f"{moment(episode.start_ns)}, {self.process}: {said} after {number(episode.number or 0.0)}, expected that "
        )
        reason += f"it {rule}, as for every number {side} {number(self.threshold)}"
        fault = first_fault(trace, self.process)
        if fault is not None and episode.start_ns <= fault.t_ns <= episode.stop_ns:
            return not_met(f"{reason}; {fault_sentence(fault)}", evidence, hint=fault_hint(fault), fault=fault)
        return not_met(reason, evidence, hint=self._hint(wrong))

    def _hint(self, wrong: Sequence[tuple[Episode, str]]) -> str:
        kinds = {e.kind for e, _ in wrong}
        if kinds == {Kind.LOW} and all(e.number == self.threshold for e, _ in wrong):
            return (
                f"{number(self.threshold)} itself is not above {number(self.threshold)}: compare with > and not with >="
            )
        if kinds == {Kind.LOW}:
            return f"at or below {number(self.threshold)}, write self.get_logger().warn(...) and do not go on"
        return ""


@dataclass(frozen=True, slots=True)
class NoGoWithoutAnswer:
    """A client does not go on after an answer without success or without a number, or when no answer comes.

    What it writes when it goes on is learned from the responses above the threshold: texts of a shape that comes after
    every one of them, and neither before the first response nor after a number at or below the threshold. None of these
    may come in the time from a useless answer to the next request. A crash at such an answer is told and costs nothing.
    The server should answer with a delay, so that what comes before an answer can be told from what comes after it, and
    one of its numbers should be at or below the threshold; without these, what is not plain is let pass.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: Numbers above it are what the client goes on with.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value that says whether the number counts; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if
            left out.
    """

    process: str
    service: str
    threshold: float
    field: str = "message"
    success: str = "success"
    pattern: Pattern | None = None

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if nothing of what is written when going on comes after a useless answer."""
        episodes = _episodes(self, trace)
        if not episodes:
            return _never_asked(trace, self.process, self.service)
        useless = [e for e in episodes if e.kind in _SAID]
        if not useless or not any(e.kind is Kind.GOOD for e in episodes):
            return _not_reached(trace, self.process, self.service, episodes)
        going = self._going(trace, episodes)
        evidence = {"useless": [e.kind.value for e in useless], "goes_on_with": sorted(going)[:5]}
        for episode in useless:
            found = [o for o in episode.sure if shape_of(o.text) in going]
            if found and not self._due(episode, episodes, found[0], going):
                return self._went_on(episode, found[0], evidence)
        reason = f"{self.process}: keeps still after {counted(len(useless), 'useless answer')}"
        reason += f" ({', '.join(dict.fromkeys(_SAID[e.kind] for e in useless))})"
        fault = first_fault(trace, self.process)
        if fault is not None and fault.t_ns >= useless[0].asked_ns:
            reason += f"; it ended there: {fault_sentence(fault)}, which costs nothing here"
        return met(reason, evidence)

    def _going(self, trace: Trace, episodes: Sequence[Episode]) -> frozenset[str]:
        """Return the shapes of what is written only when the client goes on."""
        good = [e for e in episodes if e.kind is Kind.GOOD]
        low = [e for e in episodes if e.kind is Kind.LOW]
        shapes = frozenset.intersection(*(e.shapes for e in good))
        shapes -= shapes_before(trace, self.process, self.service, cautious=not low)
        if low:
            return shapes.difference(*(e.shapes for e in low))
        # without another case to compare with, what tells the answer itself says nothing about going on
        return shapes - {shape_of(o.text) for e in good for o in e.outputs if _quotes(o, e)}

    def _due(self, episode: Episode, episodes: Sequence[Episode], found: Output, going: frozenset[str]) -> bool:
        """Return whether what is written at the instant of asking still belongs to the good answer before."""
        before = episodes[episode.place - 2] if episode.place > 1 else None
        if before is None or before.kind is not Kind.GOOD or found.t_ns > episode.asked_ns:
            return False
        return not any(shape_of(o.text) in going for o in before.sure)

    def _went_on(self, episode: Episode, found: Output, evidence: dict[str, Any]) -> Finding:
        what = _SAID[episode.kind]
        reason = f"{moment(found.t_ns)}, {self.process}: {quote(found.text, 80)!r} after {what} "
        reason += f"(request {episode.place}), as when it goes on; expected that it does not"
        hint = "go on only if there is a response, response.success is true and its number could be read"
        return not_met(reason, evidence | {"first_wrong_s": seconds(found.t_ns)}, hint=hint)


def _episodes(check: ReactsToResponses | NoGoWithoutAnswer, trace: Trace) -> tuple[Episode, ...]:
    success = "" if check.success == "none" else check.success
    reading = Reading(check.field, success, check.pattern, check.threshold)
    return episodes_of(trace, check.process, check.service, reading)


def _lines(outputs: Sequence[Output], known: set[str]) -> list[OutputLine]:
    return [o for o in outputs if isinstance(o, OutputLine) and shape_of(o.text) not in known]


def _quotes(output: Output, episode: Episode) -> bool:
    shown = "" if episode.number is None else number(episode.number)
    return bool(episode.text and episode.text in output.text) or bool(shown and shown in output.text)


def _never_asked(trace: Trace, process: str, service: str) -> Finding:
    fault = first_fault(trace, process)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; it had not asked {service} by then"
        return not_met(reason, hint=fault_hint(fault), fault=fault)
    found = explain_no_client(trace, service)
    return not_met(found.reason, found.evidence, hint=found.hint, blocked_by="service_calls")


def _not_reached(trace: Trace, process: str, service: str, episodes: Sequence[Episode]) -> Finding:
    """Return no credit where a client ended or asked no more before an answer of the kind in question came.

    Raises:
        HarnessError: It did neither, so no such answer was sent.
    """
    last = episodes[-1]
    asked = f"{service}: {process} asked {counted(len(episodes), 'time')}"
    fault = first_fault(trace, process)
    if fault is not None:
        reason = f"{fault_sentence(fault)}; {asked} and did not get to the answer in question"
        return not_met(reason, hint=fault_hint(fault), fault=fault)
    ended = trace.marks("exited", process)
    stopped = trace.stop_ns - last.start_ns > _ASKS_AGAIN_NS
    if ended or stopped or last.kind is Kind.UNANSWERED:
        why = "waits for a response that never comes" if last.kind is Kind.UNANSWERED else "then asked no more"
        why = f"ended at {moment(ended[0].t_ns)}" if ended else why
        return not_met(f"{asked} and {why}; the answer in question never came", blocked_by="service_calls")
    raise HarnessError(f"{service}: no answer of the kind in question was sent")
