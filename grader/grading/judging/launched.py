"""Decides whether what the grader did not start from a launch file may be why a criterion is not met."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import fields, is_dataclass
from typing import Any

from grader.grading.judging.checks.fields import EqualFields, FieldInRange, FieldMonotone, RandomInRange
from grader.grading.judging.checks.rate import TopicRate
from grader.grading.judging.checks.timing import Period, Silence
from grader.grading.judging.checks.topics import Publishes
from grader.grading.judging.values import HIDDEN_TOPICS, student_endpoints
from grader.grading.model.exercise import Check
from grader.runtime.model.trace import Request, Response, Trace

#: The service of an action by which a client sends its goal.
_GOALS = "/_action/send_goal"
#: Checks of what is published on the topics that they name, and of nothing else.
_OF_PUBLISHERS = (
    EqualFields,
    FieldInRange,
    FieldMonotone,
    Period,
    Publishes,
    RandomInRange,
    Silence,
    TopicRate,
)


def excuses(check: Check, trace: Trace) -> Iterator[str]:
    """Yield sentences about what was left out of a launch file and may be why a check finds a problem.

    A program that was not started can send, answer, ask or be heard. So it explains nothing where the student's own
    nodes publish what the check is about, and get everything that they wait for. One that would use a single name
    explains nothing unless the check or the nodes need that name.
    """
    yield from trace.left_out
    names = frozenset(_names(check))
    own = isinstance(check, _OF_PUBLISHERS) and _publishes(trace, names)
    wanted = _wanted(trace)
    for text, name in trace.unstarted:
        needed = name in wanted | _served(trace) or (name in names and not own)
        if needed if name else (wanted or not own):
            yield text


def _names(value: Any) -> Iterator[str]:
    """Yield the absolute names that the parameters of a check hold."""
    if isinstance(value, str):
        if value.startswith("/"):
            yield value
    elif isinstance(value, Mapping):
        for one in (*value.keys(), *value.values()):
            yield from _names(one)
    elif isinstance(value, (list, tuple, frozenset)):
        for one in value:
            yield from _names(one)
    elif is_dataclass(value):
        for field in fields(value):
            yield from _names(getattr(value, field.name))


def _publishes(trace: Trace, names: frozenset[str]) -> bool:
    """Return whether the student's nodes have a publisher on each topic, of at least one."""
    return bool(names) and names <= {end.topic for end in student_endpoints(trace, "publisher")}


def _wanted(trace: Trace) -> set[str]:
    """Return the topics and services that the student's nodes wait for and that nobody provides."""
    heard = {end.topic for end in student_endpoints(trace, "subscription")} - HIDDEN_TOPICS
    sent = {end.topic for end in trace.endpoints("publisher")}
    called = {end.service for end in trace.service_ends("client")}
    answered = {end.service for end in trace.service_ends("service")} | {one.service for one in trace.of(Response)}
    return {topic for topic in heard - sent if not trace.deliveries(topic)} | (called - answered)


def _served(trace: Trace) -> set[str]:
    """Return the services and actions of the student's nodes that nobody has asked anything."""
    asked = {one.service for one in trace.of(Request)}
    served = {end.service for end in trace.service_ends("service")} - asked
    return served | {name.removesuffix(_GOALS) for name in served if name.endswith(_GOALS)}
