"""The values of every topic over time, thinned for showing: columns of numbers and short texts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from itertools import islice

from grader.grading.judging.texts import clean
from grader.grading.judging.values import HIDDEN_TOPICS, as_number
from grader.grading.model.chart import Column, TopicValues
from grader.grading.model.wording import quote
from grader.runtime.model.quantities import seconds
from grader.runtime.model.trace import Delivery, Message, Trace

#: Maximum number of topics, of messages of a topic, and of fields of a message that are kept.
MOST_TOPICS, MOST_SAMPLES, MOST_FIELDS = 12, 300, 16
#: Longer lists, such as covariances and ranges of a scan, are left out.
_LONGEST_LIST = 6
#: Of messages with more fields than this, those that are always 0 are left out.
_MANY_FIELDS = 8
_TEXT_LENGTH = 60
#: Time and frame of a message, and the layout of an array: no values of a topic.
_LEFT_OUT = frozenset({"header", "layout"})
_PLAIN = frozenset({float, int, bool, str})

Value = float | str


def recorded_values(trace: Trace) -> tuple[TopicValues, ...]:
    """Return what was published on each topic while nodes were observed, first what the grader published."""
    sent: dict[tuple[str, str], list[Message | Delivery]] = {}
    published: list[Message | Delivery] = [*trace.of(Delivery), *trace.messages()]
    for message in published:
        if message.t_ns <= trace.stop_ns and message.topic not in HIDDEN_TOPICS:
            sender = "grader" if isinstance(message, Delivery) else "student"
            sent.setdefault((message.topic, sender), []).append(message)
    return tuple(_values(topic, sender, found) for (topic, sender), found in islice(sent.items(), MOST_TOPICS))


def _values(topic: str, sender: str, messages: Sequence[Message | Delivery]) -> TopicValues:
    stride = -(-len(messages) // (MOST_SAMPLES - 1))
    kept = [*messages[:-1:stride], messages[-1]]
    rows = [dict(islice(_fields(message.value), 4 * MOST_FIELDS)) for message in kept]
    names = dict.fromkeys(name for row in rows for name in row)
    columns = [Column(name, _shortened([row.get(name, math.nan) for row in rows])) for name in names]
    if len(columns) > _MANY_FIELDS:
        columns = [column for column in columns if column.values not in ((0.0,), ("",))]
    times = tuple(seconds(message.t_ns) for message in kept)
    return TopicValues(topic, messages[0].type, sender, len(messages), times, tuple(columns[:MOST_FIELDS]))


def _shortened(values: list[Value]) -> tuple[Value, ...]:
    """Return the values, or a single one if all are equal."""
    return (values[0],) if all(value == values[0] for value in values) else tuple(values)


def _fields(value: Mapping[str, object]) -> Iterator[tuple[str, Value]]:
    """Yield every number and text of a message by path; elements of short lists count from 0."""
    for path, part in parts_of(value, lambda length: range(length if length <= _LONGEST_LIST else 0)):
        if isinstance(part, (bool, str)):
            yield path, quote(clean(str(part)), _TEXT_LENGTH)
        elif (number := as_number(part)) is not None:
            yield path, number


def parts_of(
    value: Mapping[str, object], places: Callable[[int], Iterable[int]], prefix: str = ""
) -> Iterator[tuple[str, object]]:
    """Yield every part of a message that has no parts itself, by path, without headers.

    Args:
        value: The fields of a message.
        places: Gives the elements to yield of a list of a length.
        prefix: What the paths begin with.
    """
    for name, inner in value.items():
        path = f"{prefix}{name}"
        if path in _LEFT_OUT:
            continue
        if type(inner) in _PLAIN:  # the common case, and abstract classes are slow to ask
            yield path, inner
        elif isinstance(inner, Mapping):
            yield from parts_of(inner, places, f"{path}.")
        elif isinstance(inner, (list, tuple)):
            yield from parts_of({str(n): inner[n] for n in places(len(inner))}, places, f"{path}.")
        else:
            yield path, inner
