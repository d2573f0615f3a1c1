"""The check on a number that changes in fixed steps from one response of a server to the next."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from itertools import groupby, pairwise
from typing import Any

from grader.core.exercise import Finding, Pattern
from grader.core.quantities import seconds, within
from grader.core.trace import Response, Trace
from grader.judging.checks.services import too_few_responses
from grader.judging.findings import met, not_met
from grader.judging.paths import number_at, text_at
from grader.judging.printed import number_in
from grader.judging.services import Call, calls_of
from grader.judging.wording import counted, moment, number, numbers, quote

_MOST_IN_EVIDENCE = 250
_KEEP_HINT = "keep the number in an attribute of the node, self.name, and change it there at each call"


@dataclass(frozen=True, slots=True)
class _Answer:
    """One response with the number read from it and the one expected; `got` is None where none could be read."""

    response: Response
    got: float | None
    wanted: float


@dataclass(frozen=True, slots=True)
class ServiceSequence:
    """A number in the responses of a student's server goes on by one step with each call, whoever calls.

    The number is read from a numeric field, or from a text: its first number, or what `pattern` finds. Calls of one
    instant may be answered in any order, and a server that lags behind may answer in an order of its own. How the text
    is written otherwise is the question of `service_response`.

    Attributes:
        service: Service name as on the wire.
        first: Number in the first response.
        step: Difference from one response to the next; negative for a number that falls.
        field: Path of the field that holds the number.
        floor: Number that is not gone below (for a rising number: above).
        reset_to: Number that comes instead of the next one beyond `floor`; without it the last one stays.
        pattern: Regular expression whose first group, or whole match, is the number in a text.
        tolerance: Largest difference.
        at_least: How many responses there must be to tell.
    """

    service: str
    first: float
    step: float
    field: str = "message"
    floor: float | None = None
    reset_to: float | None = None
    pattern: Pattern | None = None
    tolerance: float = 1e-6
    at_least: int = 3

    def judge(self, trace: Trace) -> Finding:
        """Return full credit if every number is the expected one; the reason names the first that is not."""
        calls = calls_of(trace, self.service, "grader")
        answered = sorted((c for c in calls if c.response is not None), key=answered_ns)
        if len(answered) < max(1, self.at_least):
            return too_few_responses(trace, self.service, len(answered), self.at_least)
        # A server that lags behind may lose requests, or take them in an order of its own.
        orders = (self._answers(calls, asked_ns), self._answers(answered, answered_ns))
        answers = min(orders, key=lambda order: len(self._wrong(order)))
        wrong = self._wrong(answers)
        got = [a.got for a in answers]
        evidence: dict[str, Any] = {
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

    def _wrong(self, answers: Sequence[_Answer]) -> list[int]:
        return [k for k, a in enumerate(answers) if a.got is None or not within(a.got, a.wanted, self.tolerance)]

    def _answers(self, calls: Sequence[Call], instant: Callable[[Call], int]) -> list[_Answer]:
        """Return the responses in the order of their calls, those of one instant in the order of their numbers."""
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
        """Return the answer with the number that it should hold, which is taken out of those of its instant."""
        got = self._read(response)
        fitting = (k for k, w in enumerate(wanted) if got is not None and within(got, w, self.tolerance))
        return _Answer(response, got, wanted.pop(next(fitting, 0)))

    def _sequence(self) -> Iterator[float]:
        """Yield the numbers expected, rounded so that no error adds up."""
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

    def _read(self, response: Response) -> float | None:
        direct = number_at(response.value, self.field)
        if direct is not None:
            return direct
        text = text_at(response.value, self.field)
        return None if text is None else number_in(text, self.pattern)

    def _differs(self, answers: Sequence[_Answer], place: int, evidence: dict[str, Any]) -> Finding:
        first = answers[place]
        found = self._found(first)
        before = f" after {number(answers[place - 1].wanted)}" if place else ""
        reason = f"{moment(first.response.t_ns)}, {self.service}: {found}{before} in response {place + 1}, "
        reason += f"expected {number(first.wanted)}"
        said, hint = self._instead([a.got for a in answers], place)
        known = evidence | {"first_wrong": place + 1, "first_wrong_s": seconds(first.response.t_ns)}
        return not_met(f"{reason}; {said}" if said else reason, known, hint=hint)

    def _found(self, answer: _Answer) -> str:
        if answer.got is not None:
            return number(answer.got)
        text = text_at(answer.response.value, self.field)
        return f"no field {self.field} with a number" if text is None else f"no number in {quote(text, 60)!r}"

    def _instead(self, got: Sequence[float | None], place: int) -> tuple[str, str]:
        """Return what the numbers do instead, and a hint; both empty if that is not plain."""
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
            return "the steps are right, but the number before the step is told", "change the number first, then answer"
        return (f"the steps are right, but the first number is {number(values[0])}", "") if place == 0 else ("", "")

    def _repeats(self, values: Sequence[float]) -> tuple[str, str]:
        again = [a == b for a, b in pairwise(values)]
        if sum(again) >= 0.4 * len(again):
            return f"numbers come more than once ({numbers(values[:4])}, ...)", _KEEP_HINT
        return "", ""


def asked_ns(call: Call) -> int:
    """Return when a call was sent."""
    return call.request.t_ns


def answered_ns(call: Call) -> int:
    """Return when a call was answered; when it was sent, if it never was."""
    return call.request.t_ns if call.response is None else call.response.t_ns
