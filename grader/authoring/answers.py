"""What a node answered to what: the cases of a reaction as they were seen."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from grader.judging.values import leaves
from grader.model.quantities import NS_PER_S
from grader.model.trace import Delivery, Message, Trace

#: Times in a message are of the run.
OF_THE_RUN = ("stamp.sec", "stamp.nanosec")
#: Something comes after anything.
ANY: list[dict[str, Any]] = [{"when": {}, "then": {}}]
#: More different inputs than this are no cases, and more fields than this are no answer that a person wrote down.
_MOST_CASES, _MOST_FIELDS = 8, 8


def cases_seen(trace: Trace, given: str, answered: str) -> list[dict[str, Any]]:
    """Return a case for each different input: what it held, and what came of it within a second.

    Args:
        trace: What was seen.
        given: Topic of the inputs.
        answered: Topic of the answers.
    """
    inputs = trace.deliveries(given)
    answers = _answers(trace, inputs, answered)
    different: dict[str, tuple[Delivery, Message | None]] = {}
    for sent, answer in zip(inputs, answers, strict=True):
        different.setdefault(str(sent.value), (sent, answer))
    if not 0 < len(different) <= _MOST_CASES:
        return ANY
    paths = _telling([answer for answer in answers if answer is not None])
    return [_case(sent, answer, paths) for sent, answer in different.values()]


def texts(value: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    """Yield every text of a message by its path."""
    for name, inner in value.items():
        if isinstance(inner, Mapping):
            yield from texts(inner, f"{prefix}{name}.")
        elif isinstance(inner, str):
            yield f"{prefix}{name}", inner


def _answers(trace: Trace, inputs: tuple[Delivery, ...], answered: str) -> list[Message | None]:
    """Return the last answer to each input, within a second and before the next one; None where there was none."""
    stops = [*(sent.t_ns for sent in inputs), trace.stop_ns][1:]
    found: list[Message | None] = []
    for sent, stop_ns in zip(inputs, stops, strict=True):
        until_ns = min(stop_ns, sent.t_ns + NS_PER_S)
        found.append(next((m for m in reversed(trace.messages(answered)) if sent.t_ns <= m.t_ns < until_ns), None))
    return found


def _scalars(value: Mapping[str, Any]) -> dict[str, float | str]:
    return {**dict(texts(value)), **{k: v for k, v in leaves(value).items() if not k.endswith(OF_THE_RUN) and v == v}}  # noqa: PLR0124  NaN


def _telling(answers: list[Message]) -> list[str]:
    """Return the paths that are not at their default in every answer."""
    rows = [_scalars(answer.value) for answer in answers]
    return [path for path in (rows[0] if rows else ()) if any(row.get(path) for row in rows)][:_MOST_FIELDS]


def _case(sent: Delivery, answer: Message | None, paths: list[str]) -> dict[str, Any]:
    when = {path: value for path, value in _scalars(sent.value).items() if value}
    if answer is None:
        return {"when": when, "silent": True}
    held = _scalars(answer.value)
    return {"when": when, "then": {path: held[path] for path in paths if path in held}}
