"""The checks of project 3: a server that counts its calls, and a client that goes on or aborts by each response."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from itertools import groupby, pairwise
from operator import attrgetter
from typing import Annotated, ClassVar, Literal

from grader.api import (
    NS_PER_S,
    Call,
    Check,
    ClockKind,
    Drawing,
    FieldOf,
    Finding,
    HarnessError,
    Level,
    LogRecord,
    Look,
    OutputLine,
    Panel,
    Pattern,
    Point,
    ProblemKind,
    Response,
    Roles,
    Tone,
    Trace,
    calls_of,
    explain_fault,
    explain_no_client,
    met,
    not_met,
    seconds,
    student_records,
    value_at,
    within,
)
from grader.api.unstable import (
    JITTER_NS,
    Lanes,
    compared_panels,
    counted,
    drawn_case,
    fault_sentence,
    faulted,
    first_fault,
    moment,
    number,
    number_told,
    numbers,
    only_printed,
    quote,
    series,
    shape_of,
    too_few_responses,
    waiting_for,
    written,
)

# --- the server -------------------------------------------------------------------------------------------------------

#: Responses from which a beginning is judged, and numbers in the evidence, at most.
_FEW, _MOST_IN_EVIDENCE = 3, 250
_KEEP_HINT = "keep the number in an attribute of the node, self.name, and change it there at each call"


@dataclass(frozen=True, slots=True)
class _Answer:
    """A response with the number read from it and the expected one; `got` is None if no number could be read."""

    response: Response
    got: float | None
    wanted: float


@dataclass(frozen=True, slots=True)
class ServiceSequence:
    """A number in the responses of a student's server changes by one step with each call, whoever calls.

    The number is read from a numeric field, or from a text: its first number, or what `pattern` finds. Calls of one
    instant may be answered in any order, and so may those to a server that lags behind. The rest of the text is judged
    by `service_response`.

    Attributes:
        service: Service name as on the wire.
        first: Number in the first response.
        step: Difference from one response to the next; negative for a falling number.
        field: Path of the field with the number.
        floor: Smallest number (for a rising number: largest).
        reset_to: Number that replaces the next one beyond `floor`; if left out, the last number stays.
        pattern: Regular expression whose first group, or whole match, is the number in a text.
        tolerance: Largest difference.
        at_least: Number of responses needed for a judgement.
    """

    roles: ClassVar[Roles] = Roles(serves=("service",))
    service: str
    first: float
    step: float
    field: Annotated[str, FieldOf("service", "_Response")] = "message"
    floor: float | None = None
    reset_to: float | None = None
    pattern: Pattern | None = None
    tolerance: float = 1e-6
    at_least: int = 3

    @property
    def expected(self) -> str:
        text = (
            f"{self.field} of {self.service} is {number(self.first)} first and changes by {number(self.step)} each time"
        )
        again = "" if self.reset_to is None else f"; a number beyond it becomes {number(self.reset_to)}"
        return text + (f", not beyond {number(self.floor)}{again}" if self.floor is not None else "")

    def judge(self, trace: Trace) -> Finding:
        calls = calls_of(trace, self.service, "grader")
        answered = sorted((c for c in calls if c.response is not None), key=_answered_ns)
        if len(answered) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(answered), self.at_least)
        # A server that lags behind may lose requests, or process them in another order.
        orders = (self._answers(calls, lambda c: c.request.t_ns), self._answers(answered, _answered_ns))
        answers = min(orders, key=lambda order: len(self._wrong(order)))
        wrong = self._wrong(answers)
        got = [a.got for a in answers]
        evidence: dict[str, object] = {
            "service": self.service,
            "responses": len(answers),
            "numbers": got[:_MOST_IN_EVIDENCE],
            "wrong": len(wrong),
        }
        if wrong:
            return self._differs(answers, wrong[0], evidence)
        shown = ", ".join(number(a.wanted) for a in answers[:3])
        reason = f"{self.service}: {counted(len(answers), 'response')} in the right order: {shown}"
        return met(f"{reason}, ... {number(answers[-1].wanted)}", evidence)

    def drawing(self, trace: Trace) -> Drawing:
        """Return the calls, and the number in each response with the expected one."""
        calls = [c for c in calls_of(trace, self.service, "grader") if c.response is not None]
        compared = [(a.response.t_ns, a.got, a.wanted) for a in self._answers(calls, _answered_ns)]
        panels = compared_panels(f"{self.field} of the response", compared, self.tolerance, "the responses")
        return Drawing(services=(self.service,), panels=panels)

    def of_beginning(self) -> Check:
        """Return the check for a beginning, in which there are fewer responses."""
        return replace(self, at_least=min(self.at_least, _FEW))

    def _wrong(self, answers: Sequence[_Answer]) -> list[int]:
        return [k for k, a in enumerate(answers) if a.got is None or not within(a.got, a.wanted, self.tolerance)]

    def _answers(self, calls: Sequence[Call], instant: Callable[[Call], int]) -> list[_Answer]:
        """Return the responses in the order of their calls; within one instant, in the order of their numbers."""
        wanted = self._sequence()
        found: list[_Answer] = []
        for _, group in groupby(calls, key=instant):
            together = list(group)
            values = [next(wanted) for _ in together]
            responses = [c.response for c in together if c.response is not None]
            answers = [self._answer(r, values) for r in responses]
            found += sorted(answers, key=lambda a: -a.wanted if self.step < 0 else a.wanted)
        return found

    def _answer(self, response: Response, wanted: list[float]) -> _Answer:
        """Return the answer with its expected number, removed from the expected numbers of its instant."""
        got = number_told(response.value, self.field, self.pattern)
        fitting = (k for k, w in enumerate(wanted) if got is not None and within(got, w, self.tolerance))
        return _Answer(response, got, wanted.pop(next(fitting, 0)))

    def _sequence(self) -> Iterator[float]:
        """Yield the expected numbers, rounded to prevent accumulating errors."""
        value = self.first
        while True:
            yield value
            following = round(value + self.step, 9)
            rest = value if self.reset_to is None else self.reset_to
            value = rest if self._beyond(following) else following

    def _beyond(self, value: float) -> bool:
        if self.floor is None:
            return False
        return value < self.floor - 1e-9 if self.step < 0 else value > self.floor + 1e-9

    def _differs(self, answers: Sequence[_Answer], place: int, evidence: dict[str, object]) -> Finding:
        first = answers[place]
        found = self._found(first)
        before = f" after {number(answers[place - 1].wanted)}" if place else ""
        reason = f"{moment(first.response.t_ns)}, {self.service}: {found}{before} in response {place + 1}, "
        reason += f"expected {number(first.wanted)}"
        cause, hint = self._instead([a.got for a in answers], place)
        known = evidence | {"first_wrong": place + 1, "first_wrong_s": seconds(first.response.t_ns)}
        return not_met(f"{reason}; {cause}" if cause else reason, known, hint=hint, problem=ProblemKind.WRONG_VALUE)

    def _found(self, answer: _Answer) -> str:
        if answer.got is not None:
            return number(answer.got)
        told = value_at(answer.response.value, self.field)
        return f"no number in {quote(told, 60)!r}" if isinstance(told, str) else f"no field {self.field} with a number"

    def _instead(self, got: Sequence[float | None], place: int) -> tuple[str, str]:
        """Return a clause about what the numbers do instead, and a hint; both empty if unclear."""
        values = [v for v in got if v is not None]
        if len(values) < max(3, len(got)):
            return "", ""
        if len(set(values)) == 1:
            return f"it is {number(values[0])} in every response", _KEEP_HINT
        steps = [b - a for a, b in pairwise(values[: max(place + 1, 4)])]
        usual = steps[0]
        if usual == 0 or not all(within(s, usual, self.tolerance) for s in steps):
            return self._repeats(values)
        if not within(usual, self.step, self.tolerance):
            return f"it changes by {number(usual)} with each call, expected {number(self.step)}", ""
        if within(values[0], self.first - self.step, self.tolerance):
            return (
                "the steps are right, but each response has the old number",
                "change the number first, then answer",
            )
        return (f"the steps are right, but the first number is {number(values[0])}", "") if place == 0 else ("", "")

    def _repeats(self, values: Sequence[float]) -> tuple[str, str]:
        again = [a == b for a, b in pairwise(values)]
        if sum(again) >= 0.4 * len(again):
            return f"numbers are repeated ({numbers(values[:4])}, ...)", _KEEP_HINT
        return "", ""


def _answered_ns(call: Call) -> int:
    return call.request.t_ns if call.response is None else call.response.t_ns


# --- the client -------------------------------------------------------------------------------------------------------

#: Whether an output complains, and its shape: what outputs of the same wording share.
_Text = tuple[bool, str]
#: A word or a sign of a text; a number is one sign, whatever its value.
_TOKEN = re.compile(r"[+-]?\d+(?:[.,]\d+)*|\w+|[^\w\s]")
#: A word of fewer letters says nothing about whether two texts say the same.
_LETTERS = 2
_Output = LogRecord | OutputLine
#: A client that has sent no request for this long is not expected to send another.
_ASKS_AGAIN_NS = 5 * NS_PER_S


class CallKind(str, Enum):
    """The kind of a response."""

    GOOD = "good"  # a number above the threshold
    LOW = "low"  # a number at or below it
    FAILED = "failed"  # without success
    UNREADABLE = "unreadable"  # without a number
    UNANSWERED = "unanswered"  # no response came


_SAID = {
    CallKind.FAILED: "a response without success",
    CallKind.UNREADABLE: "a response without a number",
    CallKind.UNANSWERED: "a request that got no response",
}
_CASES = {
    CallKind.GOOD: ("above", Tone.GOOD),
    CallKind.LOW: ("not above", Tone.WARNING),
    CallKind.FAILED: ("no success", Tone.BAD),
    CallKind.UNREADABLE: ("no number", Tone.BAD),
    CallKind.UNANSWERED: ("no response", Tone.BAD),
}


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
    outputs: tuple[_Output, ...]
    awaiting: tuple[_Output, ...]

    @property
    def sure(self) -> tuple[_Output, ...]:
        """Output that cannot belong to another call: from the response on, before the next request."""
        return tuple(o for o in self.outputs if self.start_ns <= o.t_ns < self.until_ns)


_View = Callable[[Episode], tuple[_Output, ...]]
_loose: _View = attrgetter("outputs")
_sure: _View = attrgetter("sure")


def complaints(outputs: Iterable[_Output]) -> list[LogRecord]:
    """Return the records of severity WARN or higher."""
    return [o for o in outputs if isinstance(o, LogRecord) and o.severity in ("WARN", "ERROR", "FATAL")]


def _text_of(output: _Output) -> _Text:
    return bool(complaints((output,))), shape_of(output.text)


def _texts(outputs: Iterable[_Output]) -> frozenset[_Text]:
    return frozenset(map(_text_of, outputs))


def _tokens(text: str) -> tuple[str, ...]:
    """Return the words and signs of a text, with every number as `#`."""
    return tuple("#" if t[-1].isdigit() and not t[0].isalpha() else t.lower() for t in _TOKEN.findall(text[:1000]))


def _words_in(outputs: Iterable[_Output]) -> set[str]:
    """Return the words of some outputs, without very short ones."""
    return {t for o in outputs for t in _tokens(o.text) if len(t) > _LETTERS and t.isalpha()}


def _origin(output: _Output) -> tuple[str, int]:
    """Return what wrote an output, as far as that is known: the line of the call, or a stream."""
    return (output.file, output.line) if isinstance(output, LogRecord) else (output.stream, 0)


def _common(texts: Sequence[tuple[str, ...]]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    """Return the tokens that all texts begin with, and those that all of them end with."""
    shortest = min(map(len, texts))
    begin = next((k for k in range(shortest) if len({t[k] for t in texts}) > 1), shortest)
    ends = [t[begin:] for t in texts]
    shortest = min(map(len, ends))
    end = next((k for k in range(shortest) if len({t[-1 - k] for t in ends}) > 1), shortest)
    return texts[0][:begin], texts[0][len(texts[0]) - end :]


def _quotes(output: _Output, episode: Episode) -> bool:
    shown = "" if episode.number is None else number(episode.number)
    return bool(episode.text and episode.text in output.text) or bool(shown and shown in output.text)


def _not_taken_back(outputs: Sequence[_Output]) -> list[_Output]:
    """Return the outputs that no warning follows."""
    last = max((k for k, o in enumerate(outputs) if complaints((o,))), default=-1)
    return list(outputs[last + 1 :])


@dataclass(frozen=True, slots=True)
class _Going:
    """What a client writes only when it continues.

    Attributes:
        texts: The texts; none of them complains.
        view: The outputs of an episode among which they are sought.
        clear: Whether each output belongs to one response, and there is another kind of response to compare with.
        compared: Whether that kind is a low number; otherwise text that shows a response does not signal continuing.
        taken_back: Whether a warning that follows shows that the client does not continue after all.
    """

    texts: frozenset[_Text]
    view: _View
    clear: bool
    compared: bool
    taken_back: bool = False

    def outputs(self, episode: Episode) -> list[_Output]:
        """Return the outputs of an episode that show that the client continues."""
        seen = _not_taken_back(self.view(episode)) if self.taken_back else self.view(episode)
        found = [o for o in seen if _text_of(o) in self.texts]
        return found if self.compared else [o for o in found if not _quotes(o, episode)]


@dataclass(frozen=True, slots=True)
class _Words:
    """What a client writes after responses of each kind.

    Attributes:
        before: Shapes of the texts before the first response.
        at_first: What wrote before the first response, or while the client waited for another.
        clear: Whether no response came at the instant of its request, where output of two responses looks alike.
    """

    clock: ClockKind
    episodes: tuple[Episode, ...]
    before: frozenset[str]
    at_first: frozenset[tuple[str, int]]
    clear: bool

    def of(self, *kinds: CallKind) -> list[Episode]:
        """Return the episodes of some kinds."""
        return [e for e in self.episodes if e.kind in kinds]

    def _new(self, texts: Iterable[_Text]) -> frozenset[_Text]:
        """Return the texts that do not complain and do not come before the first response."""
        return frozenset(t for t in texts if not t[0] and t[1] not in self.before)

    def telling(self, episode: Episode) -> list[_Output] | None:
        """Return the new output after a good response that does not follow every low number; None if unclear."""
        low = self.of(CallKind.LOW)
        if not low or not self.clear:
            return None
        texts = self._new(_texts(episode.outputs)) - frozenset.intersection(*(_texts(e.sure) for e in low))
        texts = texts or self.taken_back
        return [o for o in episode.outputs if _text_of(o) in texts]

    @property
    def taken_back(self) -> frozenset[_Text]:
        """The texts after every good response that follow a low number only before a warning: a start, taken back.

        What shows the response itself is not a start.
        """
        good, low = self.of(CallKind.GOOD), self.of(CallKind.LOW)
        if not good or not low or not self.clear:
            return frozenset()
        each = self._new(frozenset.intersection(*(_texts(e.sure) for e in good)))
        shown = {_text_of(o) for e in (*good, *low) for o in e.outputs if _quotes(o, e)}
        return each - shown - {_text_of(o) for e in low for o in _not_taken_back(e.outputs)}

    @property
    def only_good(self) -> frozenset[_Text] | None:
        """The texts that follow good responses and no low number; None if this is not clear."""
        good, low = self.of(CallKind.GOOD), self.of(CallKind.LOW)
        if not good or not low or not self.clear:
            return None
        return self._contrast(good, low, _loose) or self.taken_back

    def cautions(self, episode: Episode, warned: Sequence[LogRecord]) -> bool:
        """Return whether warnings after a good number are a level of their own between going on and aborting.

        Then higher numbers come without a warning and lower ones do not, no low number has the same one, and the client
        says that it goes on all the same: in other records, or in words that it uses for higher numbers and for no low
        one.
        """
        low = self.of(CallKind.LOW)
        higher = [e for e in self.of(CallKind.GOOD) if not complaints(e.sure)]
        below = [e.number is not None and episode.number is not None and e.number > episode.number for e in higher]
        lows = {shape_of(o.text) for e in low for o in e.outputs}
        if not low or not higher or not all(below) or not self.clear or any(shape_of(r.text) in lows for r in warned):
            return False
        going = _words_in(o for e in higher for o in e.sure) - _words_in(o for e in low for o in e.outputs)
        return bool(self.telling(episode)) or bool(_words_in(warned) & going)

    def in_other_words(self, episode: Episode) -> _Output | None:
        """Return output after a useless response that tells of a start in words that no good response had.

        The same call writes after each good response, and after no low one: its texts begin and end alike, and differ
        only in between, such as in the name of a mission. Without a common word, the call names something else each
        time, and the client does what it does after each good response, and nothing else.
        """
        good, low = self.of(CallKind.GOOD), self.of(CallKind.LOW)
        elsewhere = {_origin(o) for e in low for o in e.outputs if isinstance(o, LogRecord)}
        for output in episode.sure:
            origin = _origin(output)
            told = [[o for o in e.sure if _origin(o) == origin and self._new((_text_of(o),))] for e in good]
            if not self._new((_text_of(output),)) or origin in elsewhere or len(told) < 2 or not all(told):
                continue
            texts = [_tokens(outputs[0].text) for outputs in told]
            begin, end = _common(texts)
            mine = _tokens(output.text)
            named = any(len(t) >= _LETTERS and t.isalpha() for t in (*begin, *end))
            behind = len(mine) - len(end)
            alike = behind > len(begin) and mine[: len(begin)] == begin and mine[behind:] == end
            if len(set(texts)) > 1 and (alike if named else self._named_anew(output, texts, episode)):
                return output
        return None

    def _named_anew(self, output: _Output, texts: Sequence[tuple[str, ...]], episode: Episode) -> bool:
        """Return whether a call that writes another text after each good response does so after a useless one too.

        Args:
            output: What it wrote after the useless response.
            texts: The words that it wrote after each good one.
            episode: The useless response.
        """
        origins = [_origin(o) for o in episode.sure]
        if not isinstance(output, LogRecord) or origins.count(_origin(output)) > 1 or _origin(output) in self.at_first:
            return False  # a method of the client, or a stream, that writes whatever there is to write
        told = _words_in((output,)) & {t for t in _tokens(episode.text) if len(t) > _LETTERS}
        shows = _quotes(output, episode) or bool(told)
        as_ever = all([_origin(o) for o in e.sure] == origins for e in self.of(CallKind.GOOD))
        return as_ever and not shows and len({*texts, _tokens(output.text)}) > len(texts)

    @property
    def shared(self) -> tuple[_Output, float] | None:
        """The last output after a low number whose text follows a good response too, with the number; or None."""
        good = self._new(t for e in self.of(CallKind.GOOD) for t in _texts(e.outputs))
        found = [(o, e.number) for e in self.of(CallKind.LOW) for o in e.sure if _text_of(o) in good]
        return next(((o, n) for o, n in reversed(found) if n is not None), None)

    def _contrast(self, good: Sequence[Episode], others: Sequence[Episode], view: _View) -> frozenset[_Text]:
        """Return the new texts of good responses, less those of others."""
        found = self._new(t for e in good for t in _texts(view(e)))
        less = found.difference(*(_texts(e.outputs) for e in others))
        # on the wall clock, output at the edge of an episode may belong to its neighbour
        return less or (found.difference(*(_texts(e.sure) for e in others)) if self.clock is ClockKind.WALL else less)

    def start_after_abort(self, episode: Episode) -> _Output | None:
        """Return output after a low number that follows every good response, but not the first low number."""
        good, low = self.of(CallKind.GOOD), self.of(CallKind.LOW)
        if not good or not self.clear or episode is low[0]:
            return None
        going = self._new(frozenset.intersection(*(_texts(e.sure) for e in good))) - _texts(low[0].outputs)
        return next((o for o in episode.sure if _text_of(o) in going), None)

    def going(self, kind: CallKind) -> _Going:
        """Return what the client writes only when it continues: not after low numbers, or else not after other answers.

        Args:
            kind: The kind of useless response that the texts are sought after.
        """
        good, low = self.of(CallKind.GOOD), self.of(CallKind.LOW)
        answered = [e for e in self.of(CallKind.FAILED, CallKind.UNREADABLE) if e.kind is not kind]
        others = low or answered
        if not others:
            # without another answer to compare with, text that shows the response itself does not signal continuing
            shown = {_text_of(o) for e in good for o in e.outputs if _quotes(o, e)}
            each = frozenset.intersection(*(_texts(e.outputs) for e in good))
            alone = all(e.kind in (CallKind.GOOD, kind) for e in self.episodes)
            return _Going(self._new(each) - shown if alone else frozenset(), _sure, clear=False, compared=False)
        views = (_sure, _loose)
        some = {view: self._contrast(good, others, view) for view in views}
        common = {view: some[view].intersection(*(_texts(view(e)) for e in good)) for view in views}
        found = [(choice[view], view) for choice in (common, some) for view in views if choice[view]]
        if found:
            return _Going(*found[0], self.clear, bool(low))
        if self.taken_back:
            return _Going(self.taken_back, _sure, self.clear, bool(low), taken_back=True)
        return _Going(self._own_warnings(good, others), _sure, self.clear, bool(low))

    def _own_warnings(self, good: Sequence[Episode], others: Sequence[Episode]) -> frozenset[_Text]:
        """Return the texts of warnings after good numbers whose wording follows no other response."""
        known = self.before.union(*({t[1] for t in _texts(e.outputs)} for e in others))
        return frozenset(t for e in good for t in _texts(e.sure) if t[1] not in known)


@dataclass(frozen=True, slots=True)
class _Decides:
    """A question about a client that decides by the number in each response."""

    roles: ClassVar[Roles] = Roles(calls=("service",))
    process: str
    service: str
    threshold: float
    field: Annotated[str, FieldOf("service", "_Response")] = "message"
    success: Annotated[str, FieldOf("service", "_Response", unless="none")] = "success"
    pattern: Pattern | None = None

    def episodes(self, trace: Trace) -> tuple[Episode, ...]:
        """Return the calls of the client, each with the output of the process after it."""
        calls = calls_of(trace, self.service, "student")
        stops = [*(b.request.t_ns for _, b in pairwise(calls)), trace.stop_ns]
        responses = [*(b.response for _, b in pairwise(calls)), None]
        outputs = sorted(written(trace, self.process), key=lambda o: o.t_ns)
        jitter_ns = JITTER_NS[trace.clock]
        found = []
        for place, (call, stop_ns, following) in enumerate(zip(calls, stops, responses, strict=False), 1):
            kind, told, text = self._read(call.response)
            asked_ns = call.request.t_ns
            start_ns = asked_ns if call.response is None else call.response.t_ns
            until_ns = stop_ns if place == len(calls) else stop_ns - jitter_ns
            # the next response causes what is written after it, however long the jitter is
            last_ns = (
                stop_ns + jitter_ns if following is None else max(stop_ns, min(stop_ns + jitter_ns, following.t_ns - 1))
            )
            during = tuple(o for o in outputs if start_ns - jitter_ns <= o.t_ns <= last_ns)
            before = tuple(o for o in outputs if asked_ns <= o.t_ns < start_ns)
            found.append(Episode(place, kind, told, text, asked_ns, start_ns, stop_ns, until_ns, during, before))
        return tuple(found)

    def _read(self, response: Response | None) -> tuple[CallKind, float | None, str]:
        if response is None:
            return CallKind.UNANSWERED, None, ""
        held = value_at(response.value, self.field)
        text = held if isinstance(held, str) else ""
        told = number_told(response.value, self.field, self.pattern)
        if self.success not in ("", "none") and not value_at(response.value, self.success):
            return CallKind.FAILED, told, text
        if told is None or not math.isfinite(told):
            return CallKind.UNREADABLE, None, text
        return (CallKind.GOOD if told > self.threshold else CallKind.LOW), told, text

    def _words(self, trace: Trace, episodes: tuple[Episode, ...]) -> _Words:
        """Return what the client wrote after responses of each kind."""
        lows = any(e.kind is CallKind.LOW for e in episodes)
        answered = [e for e in episodes if e.kind is not CallKind.UNANSWERED]
        before = self._shapes_before(trace, answered[0], cautious=not lows) if answered else frozenset[str]()
        until_ns = answered[0].asked_ns if answered else trace.stop_ns
        early = [o for o in written(trace, self.process) if o.t_ns < until_ns]
        at_first = frozenset(_origin(o) for outputs in (early, *(e.awaiting for e in episodes)) for o in outputs)
        return _Words(trace.clock, episodes, before, at_first, all(e.start_ns > e.asked_ns for e in answered))

    def _shapes_before(self, trace: Trace, first: Episode, *, cautious: bool) -> frozenset[str]:
        """Return the shapes of the texts before the first response; `cautious` adds its instant if it came at once."""
        until_ns = first.start_ns + (cautious and first.start_ns == first.asked_ns)
        return frozenset(shape_of(o.text) for o in written(trace, self.process) if o.t_ns < until_ns)

    def _nothing_of_its_own(self, words: _Words) -> str:
        """Return a clause: the client writes nothing that only follows numbers above the threshold."""
        text = f"its output after numbers above {number(self.threshold)} is the same as after others"
        if words.shared is None:
            return text
        output, value = words.shared
        return f"{text} ({quote(output.text, 80)!r} also follows {number(value)})"

    def _unshown(self, reason: str, evidence: dict[str, object]) -> Finding:
        """Return no credit for a client that does not show whether it goes on."""
        hint = "log that it goes on, but only in the branch for numbers above the limit"
        return not_met(reason, evidence, hint=hint, blocked_by="reacts_to_responses", problem=ProblemKind.WRONG_ANSWER)

    def _not_reached(self, trace: Trace, episodes: Sequence[Episode]) -> Finding:
        """Return no credit if the client called nobody, or ended or stopped before a response of the needed kind came.

        Raises:
            HarnessError: Neither is true, so the server sent no such response.
        """
        if not episodes:
            crashed = explain_fault(trace, f"it had not called {self.service} by then", process=self.process)
            return crashed or waiting_for("service_calls", explain_no_client(trace, self.service))
        last = episodes[-1]
        asked = f"{self.service}: {self.process} called it {counted(len(episodes), 'time')}"
        effect = f"{asked} and got no response that this criterion judges"
        if crashed := explain_fault(trace, effect, process=self.process):
            return crashed
        ended = trace.marks("exited", self.process)
        stopped = trace.stop_ns - last.start_ns > _ASKS_AGAIN_NS
        if ended or stopped or last.kind is CallKind.UNANSWERED:
            waits = last.kind is CallKind.UNANSWERED
            why = "waits for a response that is never sent" if waits else "then made no more calls"
            why = f"ended at {moment(ended[0].t_ns)}" if ended else why
            return not_met(
                f"{asked} and {why}; it got no response that this criterion judges",
                blocked_by="service_calls",
                problem=ProblemKind.ENDED if ended else ProblemKind.STOPPED,
            )
        raise HarnessError(f"{self.service}: no response that this criterion judges was sent")

    def drawing(self, trace: Trace) -> Drawing:
        """Return the numbers that came with the threshold, the kind of each response, and what the client wrote."""
        episodes = self.episodes(trace)
        if not episodes:
            return Drawing()
        limit = number(self.threshold)
        cases, lanes = [], Lanes()
        points: dict[tuple[str, Tone], list[Point]] = {}
        lanes.add("request")
        lanes.dots("request", ((e.asked_ns, f"request {e.place}") for e in episodes), Tone.SECOND)
        lanes.add("response")
        told = [e for e in episodes if e.kind is not CallKind.UNANSWERED]
        lanes.dots("response", ((e.start_ns, e.text or f"response {e.place}") for e in told), Tone.MAIN)
        exits_ns = [m.t_ns for m in trace.marks("exited", self.process)]
        for e in episodes:
            said, tone = _CASES[e.kind]
            label = f"{said} {limit}" if e.kind in (CallKind.GOOD, CallKind.LOW) else said
            stop_ns = min([e.stop_ns, *(t_ns for t_ns in exits_ns if t_ns >= e.start_ns)])
            cases.append(drawn_case(e.asked_ns, stop_ns, label, tone))
            if e.number is not None:
                points.setdefault((f"number, {label}", tone), []).append((seconds(e.start_ns), e.number))
        level = Level(self.threshold, limit, name="threshold")
        dots = tuple(series(name, some, look=Look.DOTS, tone=tone) for (name, tone), some in points.items())
        panel = Panel(f"number in {self.field}", "", dots, levels=(level,))
        said = f"{counted(len(episodes), 'request')} on {self.service}, {counted(len(told), 'response')}."
        title = f"Responses of {self.service} and output of {self.process}"
        panels = ((panel, ""), (lanes.panel(self.service), said))
        return Drawing(panels=panels, processes=(self.process,), cases=tuple(cases), title=title)


@dataclass(frozen=True, slots=True)
class ReactsToResponses(_Decides):
    """A client continues after a response with a number above a threshold, and warns if the number is at or below it.

    A warning is a record of severity WARN or higher between the response and the next request. Continuing means output
    in that time without such a record, in words that do not follow every number at or below the threshold as well, or
    only before the warning there. Numbers just above the threshold may have a warning of their own, beside words about
    continuing that higher numbers have too. A warning shows nothing if no words are kept for the numbers above, or if
    words that follow each of these come after a later low number. The wording is free. Responses without success or
    without a number are ignored. Printing instead of logging gives half the points.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: Where the reaction changes; the threshold itself is not above.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value without which a response is ignored; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if left
            out.
        side: The side that this criterion judges.
    """

    side: Literal["above", "at_or_below", "both"] = "both"

    @property
    def expected(self) -> str:
        limit = number(self.threshold)
        goes, warns = f"goes on above {limit}", f"logs a warning at or below {limit}"
        text = {"above": goes, "at_or_below": warns, "both": f"{goes} and {warns}"}[self.side]
        return f"{self.process} {text}; half the points if only printed"

    def judge(self, trace: Trace) -> Finding:
        episodes = self.episodes(trace)
        sides = {CallKind.GOOD: self.side != "at_or_below", CallKind.LOW: self.side != "above"}
        mine = [e for e in episodes if sides.get(e.kind)]
        if len({e.kind for e in mine}) < sum(sides.values()):
            return self._not_reached(trace, episodes)
        evidence = self._evidence(episodes)
        words = self._words(trace, episodes)
        wrong = [(e, flaw) for e in mine if (flaw := self._wrong(e, episodes, words))]
        if not wrong:
            return self._only_warned(mine, words, evidence) or self._right(trace, mine, words, evidence)
        if not student_records(trace, self.process) or all(e.kind is CallKind.LOW for e, _ in wrong):
            printed = self._by_printing(mine, episodes)
            if printed:
                return only_printed(f"{self.process}: {printed}", evidence)
        return self._explain(trace, wrong, evidence)

    def _wrong(self, episode: Episode, episodes: Sequence[Episode], words: _Words) -> str:
        """Say what a client does after a response that it should not do; empty if it does right."""
        if episode.kind is CallKind.LOW:
            if not complaints(episode.outputs):
                return "it logs no warning"
            started = words.start_after_abort(episode)
            return f"it writes {quote(started.text, 80)!r} at {moment(started.t_ns)}" if started is not None else ""
        before = episodes[episode.place - 2] if episode.place > 1 else None
        late = before is not None and before.kind is not CallKind.GOOD
        # a client that reads a response only when it calls again warns then about the previous one
        early = () if late else episode.awaiting
        warned = [r for r in complaints((*early, *episode.sure)) if not (late and r.t_ns <= episode.asked_ns)]
        if warned and not words.cautions(episode, warned):
            return f"it logs {quote(warned[0].text, 80)!r} at level {warned[0].severity}"
        if not episode.outputs:
            return "it writes nothing"
        return self._the_same(episode, words) if not warned and words.telling(episode) == [] else ""

    def _the_same(self, episode: Episode, words: _Words) -> str:
        """Say that everything after a number above the threshold also follows one that is not above it."""
        low = words.of(CallKind.LOW)[-1]
        alike = _texts(low.sure)
        shown = next((o for o in reversed(episode.sure) if _text_of(o) in alike), None)
        such = f", such as {quote(shown.text, 80)!r}" if shown is not None else ""
        return f"it writes nothing else than after {number(low.number or 0.0)}{such}"

    def _only_warned(self, mine: Sequence[Episode], words: _Words, evidence: dict[str, object]) -> Finding | None:
        """Return a finding if warnings do not show that a mission is aborted, because none is ever seen to start."""
        low = next((e for e in mine if e.kind is CallKind.LOW), None)
        if low is None or words.only_good is None or words.only_good:
            return None
        reason = f"{self.process}: it warns after {number(low.number or 0.0)}, but {self._nothing_of_its_own(words)}, "
        return self._unshown(reason + "so nothing shows that it aborts", evidence)

    def _right(self, trace: Trace, mine: Sequence[Episode], words: _Words, evidence: dict[str, object]) -> Finding:
        reason = f"{self.process}: right after each of {counted(len(mine), 'response')} "
        reason += f"({', '.join(number(e.number) for e in mine[:8] if e.number is not None)})"
        telling = [words.telling(e) for e in mine if e.kind is CallKind.GOOD]
        printed = any(told and all(isinstance(o, OutputLine) for o in told) for told in telling)
        if printed or not student_records(trace, self.process):
            return only_printed(f"{reason}, printed and not logged", evidence)
        return met(reason, evidence)

    def _by_printing(self, mine: Sequence[Episode], episodes: Sequence[Episode]) -> str:
        """Return that warnings are printed: lines that come only after low numbers; empty if they are not."""
        good = {shape_of(o.text) for e in episodes if e.kind is CallKind.GOOD for o in e.outputs}
        low = [e for e in mine if e.kind is CallKind.LOW]
        lines = [[o for o in e.outputs if isinstance(o, OutputLine) and shape_of(o.text) not in good] for e in low]
        if not low or not all(lines):
            return ""
        return f"at or below {number(self.threshold)} it prints {quote(lines[0][0].text, 80)!r}, expected a WARN record"

    def _evidence(self, episodes: Sequence[Episode]) -> dict[str, object]:
        rows = [
            [seconds(e.start_ns), e.kind.value, e.number, [r.severity for r in complaints(e.sure)]]
            for e in episodes[:50]
        ]
        return {"columns": ["t_s", "response", "number", "warnings"], "rows": rows}

    def _explain(self, trace: Trace, wrong: Sequence[tuple[Episode, str]], evidence: dict[str, object]) -> Finding:
        episode, flaw = wrong[0]
        rule = "it to say that it goes on" if episode.kind is CallKind.GOOD else "one"
        if episode.kind is CallKind.LOW and complaints(episode.outputs):
            rule = "it to start nothing"
        side = "above" if episode.kind is CallKind.GOOD else "at or below"
        reason = f"{moment(episode.start_ns)}, {self.process}: after {number(episode.number or 0.0)} {flaw}; expected "
        reason += f"{rule}, as after every number {side} {number(self.threshold)}"
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
class NoGoWithoutAnswer(_Decides):
    """A client does not continue after a response without success or without a number, or without any response.

    What the client writes when it continues is learned from the responses above the threshold: words that follow each
    of them, or else some of them, and come neither before the first response, nor after a number at or below the
    threshold, nor after a useless response of another kind. None of these may come between a useless response and the
    next request, nor may the call that writes them write a text that begins and ends alike, as with the name of another
    mission, or one more text of its own where it writes another one each time. If there are no such words, nothing
    shows whether the client continues. A crash at a useless response is reported and costs nothing. The server should
    respond with a delay, to separate output before and after a response, and one of its responses should be of another
    kind; without these, unclear cases are accepted.

    Attributes:
        process: File name of the client.
        service: Service name as on the wire.
        threshold: The client continues with numbers above it.
        field: Path of the number, or of the text that holds it.
        success: Path of the truth value that tells whether the number counts; `none` if there is none.
        pattern: Regular expression whose first group, or whole match, is the number in a text; its first number if left
            out.
    """

    @property
    def expected(self) -> str:
        return f"{self.process} does not go on unless {self.service} responds with success and a number"

    def judge(self, trace: Trace) -> Finding:
        episodes = self.episodes(trace)
        useless = [e for e in episodes if e.kind in _SAID]
        if not useless or not any(e.kind is CallKind.GOOD for e in episodes):
            return self._not_reached(trace, episodes)
        words = self._words(trace, episodes)
        kinds = [e.kind.value for e in useless]
        evidence: dict[str, object] = {"useless": kinds}
        for episode in useless:
            going = words.going(episode.kind)
            evidence["goes_on_with"] = sorted(shape for _, shape in going.texts)[:5]
            if not going.texts and going.clear:
                reason = f"{self.process}: {self._nothing_of_its_own(words)}, "
                reason += f"so nothing shows that it does not go on after {_SAID[episode.kind]}"
                return self._unshown(reason, evidence)
            found = [o for o in going.outputs(episode) if not self._due(o, episode, episodes, going)]
            other = words.in_other_words(episode) if not found else None
            if found or other is not None:
                return self._went_on(episode, other or found[0], evidence, same=other is None)
        reason = f"{self.process}: does not go on after any of {counted(len(useless), 'unusable response')}"
        reason += f" ({', '.join(dict.fromkeys(_SAID[e.kind] for e in useless))})"
        fault = first_fault(trace, self.process)
        if fault is not None and fault.t_ns >= useless[0].asked_ns:
            reason += f"; it ended there: {fault_sentence(fault)}, which costs nothing here"
        return met(reason, evidence)

    def _due(self, found: _Output, episode: Episode, episodes: Sequence[Episode], going: _Going) -> bool:
        """Return whether output at the instant of a request still belongs to the previous good response."""
        before = episodes[episode.place - 2] if episode.place > 1 else None
        if before is None or before.kind is not CallKind.GOOD or found.t_ns > episode.asked_ns:
            return False
        return not any(_text_of(o) in going.texts for o in before.sure)

    def _went_on(self, episode: Episode, found: _Output, evidence: dict[str, object], *, same: bool) -> Finding:
        reason = f"{moment(found.t_ns)}, {self.process}: {quote(found.text, 80)!r} after {_SAID[episode.kind]} "
        alike = "the same text as" if same else "a text such as it writes"
        reason += f"(request {episode.place}), {alike} when it goes on; expected it not to go on"
        hint = "go on only if there is a response, response.success is true and its number could be read"
        return not_met(reason, evidence | {"first_wrong_s": seconds(found.t_ns)}, hint=hint)


CHECKS = {
    "service_sequence": ServiceSequence,
    "reacts_to_responses": ReactsToResponses,
    "no_go_without_answer": NoGoWithoutAnswer,
}
