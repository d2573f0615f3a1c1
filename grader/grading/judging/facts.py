"""Typed records that checks hand to hint rules; reports show the evidence of a finding, and none of these."""

from __future__ import annotations

import math

from grader.runtime.model.dataclass import dataclass


@dataclass(frozen=True, slots=True)
class RateFacts:
    """The pace of the messages that were measured; NaN if there are too few for it."""

    count: int  # messages measured
    first_s: float  # time of the first, since the scenario began
    rate_hz: float = math.nan
    longest_s: float = math.nan  # longest time from one message to the next
    wanted_hz: float = math.nan  # what the check expects; NaN if it expects no rate


@dataclass(frozen=True, slots=True)
class SeriesFacts:
    """The first values of a field."""

    first: tuple[float, ...]  # in the order of the messages, ten at most


@dataclass(frozen=True, slots=True)
class DrawFacts:
    """What is wrong with numbers that should be random."""

    least: float  # smallest value
    most: float  # largest value
    outside: int = 0  # values out of range
    narrow: bool = False  # whether they leave out an end of the range
    pattern: str = ""  # what they follow instead of chance, such as `constant`; empty if they are random


@dataclass(frozen=True, slots=True)
class LogFacts:
    """What a process logs of the values that it received."""

    expected: int  # values that it should have logged
    missing: int  # those that it did not


@dataclass(frozen=True, slots=True)
class WrongLogFacts:
    """What logs show in place of the fields that they should show."""

    # A word of the check's own, such as `swapped`. The general rules know three: `nothing` if there is no log at all,
    # `few` if the logs are right and too few, `constant` if they never change
    cause: str
    right: int  # logs that show the fields
    fields: tuple[str, ...] = ()  # their paths in the message
    absent: bool = False  # whether no log holds as many numbers as there are fields


@dataclass(frozen=True, slots=True)
class LogPaceFacts:
    """How often a process logs."""

    count: int  # logs
    average_s: float  # average time from one log to the next; 0 if there are fewer than two
    wanted_s: float  # the average that is expected


@dataclass(frozen=True, slots=True)
class OtherEnd:
    """What a node has in place of the subscription, server or client that is missing."""

    name: str  # its topic or service
    type: str  # its type


@dataclass(frozen=True, slots=True)
class GoalFieldFacts:
    """The first field of a goal that is not as expected, where one value is expected."""

    path: str
    wanted: str | float
