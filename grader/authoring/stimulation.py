"""What a reference is given to do: stimuli for the topics it listens to, its servers and its clients."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from types import MappingProxyType
from typing import Any

from grader.authoring.drafts import DraftStimulus, Quantity
from grader.authoring.parameters import parameters
from grader.judging.silence import student_endpoints
from grader.judging.values import carries_number
from grader.model.trace import Trace

ODOMETRY = "nav_msgs/msg/Odometry"
#: Time before the first stimulus, so that waiting can be seen too.
FIRST_S = 1.0
#: No message was named.
NOTHING: Mapping[str, Sequence[Mapping[str, Any]]] = MappingProxyType({})
_VALUES = (1, 2, 3, 4)
_CALLS = 3


def stimuli_for(
    trace: Trace, duration_s: float, given: Mapping[str, Sequence[Mapping[str, Any]]] = NOTHING
) -> tuple[DraftStimulus, ...]:
    """Return a stimulus for whatever of the nodes waits for somebody else.

    Args:
        trace: The nodes as they were by themselves.
        duration_s: How long the scenario will last.
        given: Topic -> the fields of the messages to send there, where the author named some.
    """
    return (*_topics(trace, duration_s, given), *_services(trace), *_parameters(trace))


def _topics(
    trace: Trace, duration_s: float, given: Mapping[str, Sequence[Mapping[str, Any]]]
) -> Iterator[DraftStimulus]:
    spoken = {end.topic for end in student_endpoints(trace, "publisher")}
    for topic, type_ in dict.fromkeys((e.topic, e.type) for e in student_endpoints(trace, "subscription")):
        if topic in given:
            yield _named(topic, type_, duration_s, given[topic])
        elif topic not in spoken:
            yield _messages(topic, type_, duration_s)


def _messages(topic: str, type_: str, duration_s: float) -> DraftStimulus:
    start = Quantity(f"{FIRST_S:g} s")
    left_s = duration_s - FIRST_S
    if type_ == ODOMETRY:
        played = {"topic": topic, "start": start, "duration": Quantity(f"{max(1.0, left_s - 1):g} s")}
        return DraftStimulus("odometry", played, "decide: how long is nobody to publish before and after?")
    if carries_number(type_):
        hold = Quantity(f"{max(0.5, left_s // len(_VALUES)):g} s")
        numbers = {"topic": topic, "type": type_, "values": list(_VALUES), "period": Quantity("200 ms"), "hold": hold}
        return DraftStimulus("numbers", {**numbers, "start": start}, "decide: which values tell right from wrong?")
    repeats = max(1, int(left_s) - 1)
    given = {"topic": topic, "type": type_, "values": [{}], "period": Quantity("1 s"), "repeats": repeats}
    return DraftStimulus("messages", {**given, "start": start}, "decide: which fields? {} leaves all at their defaults")


def _named(topic: str, type_: str, duration_s: float, values: Sequence[Mapping[str, Any]]) -> DraftStimulus:
    """Return the messages that the author named, spread over the time there is."""
    period_s = max(0.1, math.floor(10 * (duration_s - FIRST_S) / (len(values) + 1)) / 10)
    period, start = Quantity(f"{min(2.0, period_s):g} s"), Quantity(f"{FIRST_S:g} s")
    sent = {"topic": topic, "type": type_, "values": list(values), "period": period, "start": start}
    return DraftStimulus("messages", sent, "decide: what else tells right from wrong?")


def _services(trace: Trace) -> Iterator[DraftStimulus]:
    servers = {end.service for end in trace.service_ends("service")}
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("service")):
        asked = {"service": service, "type": type_, "requests": [{}], "calls": _CALLS, "start": Quantity("1 s")}
        yield DraftStimulus("calls", asked, "decide: which requests? {} leaves all fields at their defaults")
    for service, type_ in dict.fromkeys((e.service, e.type) for e in trace.service_ends("client")):
        if service not in servers:
            given = {"service": service, "type": type_, "responses": [{}], "start": Quantity("1 s")}
            yield DraftStimulus("server", given, "decide: which responses? {} leaves all fields at their defaults")


def _parameters(trace: Trace) -> Iterator[DraftStimulus]:
    for node, name, _ in parameters(trace):
        asked = {"name": name, **({"node": node} if node else {}), "start": Quantity("1 s")}
        yield DraftStimulus("parameter", asked, f"asks for the value of {name}; decide: is it to be set as well?")
