"""Says in one phrase what each check expects, in the numbers of its rubric."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from types import MappingProxyType
from typing import Any

from grader.core.exercise import Check
from grader.core.quantities import seconds
from grader.judging.checks.clients import ServiceCalls, WaitsForService
from grader.judging.checks.decisions import NoGoWithoutAnswer, ReactsToResponses
from grader.judging.checks.fan import ThresholdResponse
from grader.judging.checks.functions import FieldFunction
from grader.judging.checks.graph import BidirectionalGraph
from grader.judging.checks.log_rhythm import LogsEvery
from grader.judging.checks.log_values import LogsValues
from grader.judging.checks.logs import UsesLogger
from grader.judging.checks.odometry import LogPeriod, LogsPosition, WaitsGracefully
from grader.judging.checks.rate import TopicRate
from grader.judging.checks.sensor import LogsReceived, RandomInRange
from grader.judging.checks.service_sequence import ServiceSequence
from grader.judging.checks.services import ServiceAnswersAll, ServiceAvailable, ServiceResponse
from grader.judging.checks.together import AnswersTogether
from grader.judging.checks.topics import FieldValues, Publishes, Subscribes
from grader.judging.printed import times
from grader.judging.rules import told
from grader.judging.wording import number, span, unit_of


def expectation(check: Check) -> str:
    """Return what a check expects, without a full stop: the table's phrase, or the check's own; empty without one."""
    phrase = _PHRASES.get(type(check))
    if phrase is not None:
        return phrase(check)
    own = getattr(check, "expected", "")
    return own if isinstance(own, str) else ""


def _publishes(check: Publishes) -> str:
    return f"at least one {check.type} message on {check.topic}"


def _subscribes(check: Subscribes) -> str:
    return f"a subscription to {check.topic} with type {check.type} that an ordinary publisher reaches"


def _rate(check: TopicRate) -> str:
    over = "over the whole observation" if check.window is None else f"over {span(check.window)}"
    said = f"{check.topic} at {number(check.rate)} ± {number(check.tolerance)} Hz on average {over}"
    if check.partly_tolerance is not None:
        said += f"; half the points at {number(check.rate)} ± {number(check.partly_tolerance)} Hz"
    return said


def _fields(check: FieldValues) -> str:
    wanted = ", ".join(f"{path} = {number(value)}" for path, value in check.values.items())
    return f"{wanted} in every message on {check.topic}"


def _logger(check: UsesLogger) -> str:
    return f"a record of {check.process} through its logger; printing alone is half of it"


def _position(check: LogsPosition) -> str:
    return f"{check.process} logs the x and y that {check.topic} had at that moment; printing alone is half of it"


def _period(check: LogPeriod) -> str:
    share = number(100 * check.tolerance)
    return f"one log every {number(seconds(check.period))} s ± {share} % on average while {check.topic} is played"


def _waits(check: WaitsGracefully) -> str:
    silence = number(seconds(check.silence))
    return f"{check.process} lives through {silence} s without {check.topic}, without an error, and works afterwards"


def _range(check: RandomInRange) -> str:
    span_ = f"{number(check.low)} to {number(check.high)}{unit_of(check.topic)}"
    return f"every value on {check.topic} within {span_}, and drawn at random"


def _received(check: LogsReceived) -> str:
    return f"{check.process} logs every value that it receives on {check.topic}; printing alone is half of it"


def _threshold(check: ThresholdResponse) -> str:
    limit = f"{number(check.threshold)}{unit_of(check.input)}"
    side, answer = ("above", check.above) if check.side == "above" else ("at or below", check.otherwise)
    return f"{number(answer)} on {check.output} for every {check.input} {side} {limit}"


def _together(check: AnswersTogether) -> str:
    limit = f"{number(check.threshold)}{unit_of(check.input)}"
    answers = f"{number(check.above)} above {limit}, {number(check.otherwise)} otherwise"
    return f"every {check.input} of the one node answered by the other on {check.output}: {answers}"


def _graph(check: BidirectionalGraph) -> str:
    return f"one node reached by {check.forward}, the other by {check.back}, with the types agreeing"


def _function(check: FieldFunction) -> str:
    return f"{check.field} = {check.formula} in every message on {check.topic}, n being 0 in the first one"


def _rhythm(check: LogsEvery) -> str:
    return f"one log of {check.process} for every {check.every} messages on {check.topic}; printing alone is half of it"


def _logged_values(check: LogsValues) -> str:
    products = " and ".join(map(times, check.unit_factors))
    return f"{check.process} logs {products} for each message on {check.topic}; printing alone is half of it"


def _available(check: ServiceAvailable) -> str:
    return f"the service {check.service} with type {check.type}"


def _answers(check: ServiceAnswersAll) -> str:
    return f"a response to every request on {check.service} within {number(seconds(check.within))} s"


def _response(check: ServiceResponse) -> str:
    return f"in every response of {check.service}: {told(check.fields)}"


def _sequence(check: ServiceSequence) -> str:
    said = (
        f"{check.field} of {check.service} tells {number(check.first)} first, then {number(check.step)} more each time"
    )
    again = "" if check.reset_to is None else f"; {number(check.reset_to)} instead of what lies beyond"
    return said + (f", not beyond {number(check.floor)}{again}" if check.floor is not None else "")


def _calls(check: ServiceCalls) -> str:
    said = f"{check.calls} requests on {check.service}"
    if check.period is None:
        return said
    return f"{said}, {number(seconds(check.period))} ± {number(seconds(check.tolerance))} s apart"


def _waits_for(check: WaitsForService) -> str:
    return f"{check.process} waits for {check.service}, logs that it does, and asks once it is there"


def _reacts(check: ReactsToResponses) -> str:
    limit = number(check.threshold)
    goes, warns = f"goes on above {limit}", f"logs a warning at or below {limit}"
    said = {"above": goes, "at_or_below": warns, "both": f"{goes} and {warns}"}[check.side]
    return f"{check.process} {said}; printing alone is half of it"


def _keeps_still(check: NoGoWithoutAnswer) -> str:
    return f"{check.process} does not go on where {check.service} gives no answer, no success or no number"


_PHRASES: Mapping[type, Callable[[Any], str]] = MappingProxyType(
    {
        Publishes: _publishes,
        Subscribes: _subscribes,
        TopicRate: _rate,
        FieldValues: _fields,
        UsesLogger: _logger,
        LogsPosition: _position,
        LogPeriod: _period,
        WaitsGracefully: _waits,
        RandomInRange: _range,
        LogsReceived: _received,
        ThresholdResponse: _threshold,
        AnswersTogether: _together,
        BidirectionalGraph: _graph,
        FieldFunction: _function,
        LogsEvery: _rhythm,
        LogsValues: _logged_values,
        ServiceAvailable: _available,
        ServiceAnswersAll: _answers,
        ServiceResponse: _response,
        ServiceSequence: _sequence,
        ServiceCalls: _calls,
        WaitsForService: _waits_for,
        ReactsToResponses: _reacts,
        NoGoWithoutAnswer: _keeps_still,
    }
)
