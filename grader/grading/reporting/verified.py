"""Renders what recording submissions several times has found, as text for people and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from itertools import zip_longest

from rich.text import Text

from grader.grading.model.report import JsonObject
from grader.grading.model.verification import (
    Cause,
    ConditionState,
    Difference,
    DifferenceKind,
    LeftOutScenario,
    Place,
    RecordingFact,
    Tried,
    Verification,
)
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.page import Page
from grader.runtime.model.quantities import NS_PER_S, counted
from grader.runtime.model.trace import (
    Delivery,
    Fault,
    GraphSnapshot,
    LogRecord,
    Mark,
    Message,
    Observation,
    Offer,
    OutputLine,
    Request,
    Response,
)

SCHEMA = "grader/verification/v1"
_WORDS: Mapping[ConditionState, str] = {
    ConditionState.SAME: "same",
    ConditionState.DIFFERENT: "DIFFERENT",
    ConditionState.NOT_TRIED: "not tried",
    ConditionState.FAILED: "FAILED",
}
_STYLES: Mapping[ConditionState, str] = {
    ConditionState.SAME: "green",
    ConditionState.DIFFERENT: "bold red",
    ConditionState.NOT_TRIED: "dim",
    ConditionState.FAILED: "yellow",
}
_KINDS: Mapping[DifferenceKind, str] = {
    DifferenceKind.TIME: "time: the same event at another moment",
    DifferenceKind.ORDER: "order: the same events, one before the other",
    DifferenceKind.CONTENT: "content: another event",
    DifferenceKind.CLOCK: "clock: virtual time works for the programs in one recording only",
    DifferenceKind.GRADER: "only what the grader saw: the programs did the same",
}
_COLUMN = max(map(len, _WORDS.values())) + 2
#: Longest text of an event, in characters; of a longer one, what surrounds the first difference is shown.
_LONGEST, _BEFORE = 160, 40
#: Most names, left-out scenarios and further differences that the text lists.
_MOST = 8


def render_verification(verification: Verification, *, width: int, colour: bool) -> str:
    """Return the result as text; colours are ANSI sequences, the text is the same without."""
    page = Page(width=width, colour=colour)
    page.put(_head(verification))
    page.blank()
    for one in verification.tried:
        page.put(_line(one), prefix=Text(f"  {_WORDS[one.state]:{_COLUMN}}", style=_STYLES[one.state]))
    for problem in verification.problems:
        page.put(
            shown(problem),
            prefix=Text(f"  {_WORDS[ConditionState.FAILED]:{_COLUMN}}", style=_STYLES[ConditionState.FAILED]),
        )
    if verification.left_out:
        page.blank()
        page.put("Not comparable event by event, because the wall clock decides:")
        for left_out in verification.left_out[:_MOST]:
            page.put(shown(left_out.why), prefix=f"  {_place(left_out.place)}: ")
        _more(page, len(verification.left_out), "scenario")
    _first_difference(page, verification)
    page.blank()
    page.put(_conclusion(verification), style=_STYLES[verification.state])
    return page.text()


def _head(verification: Verification) -> str:
    names = ", ".join(map(shown, verification.submissions[:_MOST]))
    more = len(verification.submissions) - _MOST
    if more > 0:
        names += f" and {more} more"
    seed = f", seed {verification.seeds[0]}" if len(verification.seeds) == 1 else ""
    recorded = f"{counted(verification.scenarios, 'scenario')}, {verification.events:,} events"
    return f"{names}: {recorded}, in the sandbox {verification.isolation}{seed}"


def _line(one: Tried) -> str:
    if one.state is ConditionState.DIFFERENT:
        return f"{one.words}: {len(one.different)} of {counted(one.compared, 'scenario')}"
    return f"{one.words}: {shown(one.why)}" if one.why else one.words


def _more(page: Page, count: int, noun: str) -> None:
    if count > _MOST:
        page.put(f"  and {counted(count - _MOST, f'more {noun}')}")


def _first_difference(page: Page, verification: Verification) -> None:
    found = [(one, place, difference) for one in verification.tried for place, difference in one.different]
    if not found:
        return
    one, place, difference = found[0]
    page.blank()
    page.put(f"First difference, {one.words}", style="bold")
    page.put(_KINDS[difference.kind], prefix="  kind   ")
    page.put(_where(place, difference), prefix="  where  ")
    sides = both_sides(difference)
    page.put(sides[0], prefix="  first  ")
    page.put(sides[1], prefix="  other  ")
    page.put(advice_on(verification, difference), prefix="  do     ")
    others = [f"{each.words}: {_where(where, which)}" for each, where, which in found[1:]]
    if others:
        page.blank()
        page.put("Also:")
        for text in others[:_MOST]:
            page.put(text, prefix="  ")
        _more(page, len(others), "difference")


def _place(place: Place) -> str:
    return f"{shown(place.submission)}, {place.exercise}, {place.scenario}"


def _where(place: Place, difference: Difference) -> str:
    event = f", event {difference.number:,}" if difference.number else ""
    at = shown(difference.process)
    if difference.line:
        at = f"{shown(difference.file)}:{difference.line}"
    return f"{_place(place)}{event}{f', {at}' if at else ''}"


def both_sides(difference: Difference) -> tuple[str, str]:
    """Return both sides of a difference in a line each; of long ones, what surrounds the first difference."""
    one, two = _words(difference.first), _words(difference.other)
    differs = next((n for n, (a, b) in enumerate(zip_longest(one, two)) if a != b), 0)
    start = max(0, differs - _BEFORE) if max(len(one), len(two)) > _LONGEST else 0
    return _cut(one, start), _cut(two, start)


def _cut(text: str, start: int) -> str:
    piece = text[start : start + _LONGEST]
    return f"{'...' if start else ''}{piece}{'...' if start + _LONGEST < len(text) else ''}"


def _words(event: Observation | RecordingFact | None) -> str:
    if event is None:
        return "nothing more"
    if isinstance(event, RecordingFact):
        return shown(event.text, limit=10 * _LONGEST)
    return f"{_time(event.t_ns)}  {shown(_content(event), limit=10 * _LONGEST)}"


def _time(t_ns: int) -> str:
    """Return a time in seconds, with as many digits as it has, but at least three."""
    whole, rest = divmod(t_ns, NS_PER_S)
    digits = f"{rest:09}".rstrip("0")
    return f"t = {whole}.{digits:0<3} s"


def _content(event: Observation) -> str:  # noqa: PLR0911  one for each kind of event
    if isinstance(event, (Message, Delivery)):
        by_grader = " by the grader" if isinstance(event, Delivery) else ""
        return f"{event.topic} {event.type}{by_grader} {_fields(event.value)}"
    if isinstance(event, (Request, Response)):
        which = f"{type(event).__name__.lower()} {event.number} of {event.service} by {event.sender}"
        return f"{which} {_fields(event.value)}"
    if isinstance(event, LogRecord):
        return f"{event.severity} [{event.logger}] {event.text}"
    if isinstance(event, OutputLine):
        return f"{event.stream}: {event.text}"
    if isinstance(event, Fault):
        return f"{event.kind.value}: {event.text}"
    if isinstance(event, Offer):
        return f"{event.kind} {event.name} {event.detail}"
    if isinstance(event, Mark):
        return f"{event.name} {event.detail}".rstrip()
    ends = (f"{end.kind} of {end.topic} in {end.node}" for end in event.endpoints)
    services = (f"{end.kind} of {end.service} in {end.node}" for end in event.services)
    return f"graph: {', '.join((*event.nodes, *ends, *services)) or 'empty'}"


def _fields(value: Mapping[str, object]) -> str:
    return json.dumps(json_value(dict(value)), ensure_ascii=False)


def advice_on(verification: Verification, difference: Difference) -> str:
    """Return one thing to do about a difference."""
    if difference.kind is DifferenceKind.GRADER:
        return "report it with the output of --json: no program caused it"
    if difference.kind is DifferenceKind.CLOCK:
        return "the work of the programs is at the limit of virtual time: make it shorter, or grade with --clock wall"
    if difference.cause is not Cause.UNKNOWN:
        return _CAUSES[difference.cause]
    changed_nothing = any(one.name == "again" and one.state is ConditionState.SAME for one in verification.tried)
    if changed_nothing:
        return "report it with the output of --json: nothing differs without this condition, and it must not matter"
    what = f"what {shown(difference.file)}:{difference.line} shows" if difference.line else "the values that differ"
    return f"find out where {what} comes from: the order of a set of objects, an address, or a real time"


_CAUSES: Mapping[Cause, str] = {
    Cause.ADDRESS: "use a name or number of your own: id(), hash() and 0x... show where an object lies in memory, "
    "which changes in each run; sort what comes from a set of such objects",
    Cause.PROCESSOR_TIME: "leave out the processor time: it differs in each run",
    Cause.KERNEL: "use time.time() or the clock of the node: file times and what the kernel says show real time",
}


def _conclusion(verification: Verification) -> str:
    tried = [one for one in verification.tried if one.state in (ConditionState.SAME, ConditionState.DIFFERENT)]
    if verification.state is ConditionState.DIFFERENT:
        differing = [one for one in tried if one.state is ConditionState.DIFFERENT]
        return f"different: under {len(differing)} of {counted(len(tried), 'condition')}"
    if verification.state is ConditionState.SAME:
        return f"the same under {counted(len(tried), 'condition')}"
    return "not verified: see above what could not be compared"


def verification_to_json(verification: Verification) -> str:
    """Return the result as JSON text."""
    data = {
        "schema": SCHEMA,
        "result": _results(verification),
        "submissions": [
            {"path": path, "seed": seed}
            for path, seed in zip(verification.submissions, verification.seeds, strict=True)
        ],
        "isolation": verification.isolation,
        "scenarios": verification.scenarios,
        "events": verification.events,
        "conditions": [_tried(one) for one in verification.tried],
        "not_comparable": [_left_out(one) for one in verification.left_out],
        "problems": list(verification.problems),
    }
    return json.dumps(json_value(data), indent=2, allow_nan=False) + "\n"


def _results(verification: Verification) -> str:
    return {ConditionState.SAME: "equal", ConditionState.DIFFERENT: "different"}.get(verification.state, "not_verified")


def _tried(one: Tried) -> JsonObject:
    return {
        "name": one.name,
        "what": one.words,
        "state": one.state.value,
        "why": one.why or None,
        "compared": one.compared,
        "differences": [{**asdict(place), **_difference(found)} for place, found in one.different],
    }


def _difference(found: Difference) -> JsonObject:
    return {
        "kind": found.kind.value,
        "event": found.number or None,
        "process": found.process or None,
        "file": found.file or None,
        "line": found.line or None,
        "cause": found.cause.value or None,
        "first": _event(found.first),
        "other": _event(found.other),
    }


def _event(event: Observation | RecordingFact | None) -> JsonObject | None:
    if event is None:
        return None
    data = asdict(event)
    if "cdr" in data:
        data["cdr"] = data["cdr"].hex()
    return {"is": "graph" if isinstance(event, GraphSnapshot) else type(event).__name__.lower(), **data}


def _left_out(one: LeftOutScenario) -> JsonObject:
    return {**asdict(one.place), "why": one.why}
