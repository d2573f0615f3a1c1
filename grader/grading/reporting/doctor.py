"""Renders a checkup of this machine, as text for people and as JSON for programs."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, fields

from rich.text import Text

from grader.grading.model.report import JsonObject
from grader.grading.reporting.escape import json_value, shown
from grader.grading.reporting.page import Page
from grader.runtime.model.checkup import NO_SANDBOX, PROPERTIES, REQUIRED, Checkup, Exchange, Fact, TierReport, missing
from grader.runtime.model.limits import Limits
from grader.runtime.model.quantities import duration, size

SCHEMA = "grader/checkup/v1"
_NARROWEST = 60
_NAME_WIDTH = 18
_TIER_WIDTH = 24
_PROPERTY_WIDTH = 13
_MARK_WIDTH = 6
_GOOD, _BAD, _QUIET = "green", "bold red", "dim"


def render_checkup(checkup: Checkup, *, width: int, colour: bool) -> str:
    """Return a checkup as text of at least 60 columns; colours are ANSI sequences, the text is the same without."""
    page = Page(width=max(width, _NARROWEST), colour=colour)
    _head(page, checkup)
    _title(page, "This machine")
    for fact in checkup.facts:
        _fact(page, fact)
    if checkup.exchange is not None:
        _title(page, "One exchange of ROS messages")
        _exchange(page, checkup.exchange)
    if checkup.tiers:
        _title(page, "Sandboxes, strongest first")
        for tier in checkup.tiers:
            _tier(page, tier, used=tier.name == checkup.used)
        _title(page, "What each contains (* is required for grading)")
        _matrix(page, checkup)
    _title(page, "Limits of a student's processes, where a rubric sets no others")
    page.put(", ".join(f"{name} {value}" for name, value in _limits(checkup.limits)), prefix="  ", indent=2)
    return page.text()


def _head(page: Page, checkup: Checkup) -> None:
    if checkup.safe:
        page.put(f"grading is safe here, in the sandbox {checkup.used}", style=_GOOD)
        return
    page.put("grading is NOT SAFE here", style=_BAD)
    for problem in checkup.problems:
        page.put(shown(problem.value), prefix=f"  {problem.name}: ", indent=4)
        if problem.remedy:
            page.put(shown(problem.remedy), prefix=Text("    fix: ", style="bold"), indent=6)


def _title(page: Page, text: str) -> None:
    page.blank()
    page.put(text, style="bold")


def _fact(page: Page, fact: Fact) -> None:
    style = "" if fact.fits else _BAD
    page.put(shown(fact.value), prefix=Text(f"  {fact.name:{_NAME_WIDTH}}", style=style), indent=6)
    if fact.remedy:
        _remedy(page, fact.remedy, _NAME_WIDTH)


def _remedy(page: Page, remedy: str, column: int) -> None:
    page.put(shown(remedy), prefix=f"  {'':{column}}fix: ", indent=6)


def _exchange(page: Page, exchange: Exchange) -> None:
    outcome = Text("works" if exchange.succeeded else "FAILS", style=_GOOD if exchange.succeeded else _BAD)
    where = "without a sandbox" if exchange.tier == NO_SANDBOX else f"in {exchange.tier}"
    found = f"{exchange.arrived} of {exchange.expected} messages of a trial node {where} arrived, "
    page.put(f"{found}{exchange.took_s:.1f} s including set-up", prefix=Text("  ").append(outcome).append("  "))
    if exchange.problem:
        page.put(shown(exchange.problem), prefix="         ")


def _tier(page: Page, tier: TierReport, *, used: bool) -> None:
    head = Text(f"  {tier.tier:3}{tier.name:{_TIER_WIDTH - 5}}")
    if used:
        page.put("holds; grading uses it", prefix=head, style=_GOOD)
    elif tier.usable:
        page.put("holds", prefix=head)
    elif tier.name == NO_SANDBOX:
        page.put("no sandbox at all; only with --isolation none", prefix=head, style=_QUIET)
    else:
        page.put(f"not here: {_why(tier)}", prefix=head)
        if tier.remedy:
            _remedy(page, tier.remedy, _TIER_WIDTH - 2)


def _why(tier: TierReport) -> str:
    """Return briefly why a tier is not usable; the properties follow below."""
    open_ones = [found.name for found in missing(tier.properties)]
    if open_ones:
        return f"it does not contain {', '.join(open_ones)}"
    return shown(tier.why.removeprefix(f"isolation {tier.name}: "))


def _matrix(page: Page, checkup: Checkup) -> None:
    """Write one row per property and one column per tier, and what each property means."""
    tried = [tier for tier in checkup.tiers if tier.properties]
    columns = "".join(f"{tier.tier:{_MARK_WIDTH}}" for tier in tried)
    page.put(Text(f"  {'':{_PROPERTY_WIDTH}}{columns}a student's process ...", style=_QUIET))
    for name, meaning in PROPERTIES.items():
        row = Text(f"  {name + ('*' if name in REQUIRED else ''):{_PROPERTY_WIDTH}}")
        for tier in tried:
            row.append_text(_mark(tier, name))
        by = _mechanism(tried, checkup.used, name)
        page.put(Text(meaning).append(f" ({shown(by)})" if by else "", style=_QUIET), prefix=row, indent=6)
    for tier in tried:
        if tier.name != NO_SANDBOX:
            for found in tier.properties:
                if found.found and not found.holds:
                    page.put(shown(found.found), prefix=f"  {tier.tier}, {found.name}: ", indent=6)


def _mechanism(tiers: Sequence[TierReport], used: str, name: str) -> str:
    """Return the mechanism that provides a property in the used tier; empty if there is none."""
    found = (found for tier in tiers if tier.name == used for found in tier.properties)
    return next((one.mechanism for one in found if one.name == name and one.holds), "")


def _mark(tier: TierReport, name: str) -> Text:
    holds = any(found.name == name and found.holds for found in tier.properties)
    return Text(f"{'yes' if holds else 'NO':{_MARK_WIDTH}}", style=_GOOD if holds else _BAD)


def _limits(limits: Limits) -> Iterator[tuple[str, str]]:
    """Yield each limit in readable form, in the order of the model."""
    for field in fields(limits):
        value: int = getattr(limits, field.name)
        words, _, unit = field.name.rpartition("_")
        if unit == "bytes":
            yield words.replace("_", " "), size(value)
        elif unit == "ns":
            yield f"{words} time", duration(value)
        else:
            yield field.name.replace("_", " "), f"{value:,}"


def checkup_to_json(checkup: Checkup) -> str:
    """Return a checkup as JSON text, safe on a terminal."""
    data = {
        "schema": SCHEMA,
        "safe": checkup.safe,
        "used": checkup.used or None,
        "problems": _facts(checkup.problems),
        "facts": _facts(checkup.facts),
        "exchange": None if checkup.exchange is None else _exchange_json(checkup.exchange),
        "tiers": [_tier_json(tier) for tier in checkup.tiers],
        "limits": asdict(checkup.limits),
    }
    return json.dumps(json_value(data), indent=2, allow_nan=False) + "\n"


def _facts(facts: Sequence[Fact]) -> list[Mapping[str, object]]:
    return [{**asdict(fact), "remedy": fact.remedy or None} for fact in facts]


def _exchange_json(exchange: Exchange) -> JsonObject:
    return {
        "succeeded": exchange.succeeded,
        "isolation": exchange.tier,
        "expected": exchange.expected,
        "arrived": exchange.arrived,
        "took_s": round(exchange.took_s, 3),
        "problem": exchange.problem or None,
    }


def _tier_json(tier: TierReport) -> JsonObject:
    return {
        "name": tier.name,
        "tier": tier.tier,
        "usable": tier.usable,
        "why": tier.why or None,
        "remedy": tier.remedy or None,
        "properties": [{**asdict(found), "found": found.found or None} for found in tier.properties],
    }
