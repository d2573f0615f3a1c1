"""What a rubric says that a field may hold: a value, a range, or a text of some form."""

from __future__ import annotations

import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

from grader.core.exercise import Pattern
from grader.core.quantities import SLACK, within
from grader.judging.paths import NoSuchField, at_path
from grader.judging.values import as_number
from grader.judging.wording import number, quote

#: Longest text that is held against a pattern.
_LONGEST = 2_000
_YES_OR_NO = MappingProxyType({"yes": True, "no": False})


@dataclass(frozen=True, slots=True)
class FieldRule:
    """What one field has to hold; of several parameters all apply.

    Attributes:
        equals: The text, number or truth value expected.
        items: The elements of a list expected, in order.
        tolerance: Largest difference from a number expected.
        low: Smallest number allowed.
        high: Largest number allowed.
        pattern: Regular expression that the whole text has to match.
        example: A text of that form, shown in place of the pattern.
    """

    equals: str | float | bool | None = None
    items: tuple[str | float | bool, ...] | None = None
    tolerance: float = 1e-6
    low: float | None = None
    high: float | None = None
    pattern: Pattern | None = None
    example: str | None = None

    def allows(self, value: object) -> bool:
        """Return whether a field may hold a value; NaN is in no range and equals nothing."""
        equal = self.equals is None or self._equal(value, self.equals)
        return equal and self._listed(value) and self._in_range(value) and self._of_form(value)

    def _equal(self, value: object, wanted: str | float | bool) -> bool:  # noqa: FBT001 - the value of a field
        if isinstance(value, bool) and isinstance(wanted, str):
            return _YES_OR_NO.get(wanted.lower()) is value  # for YAML, yes is a text
        if isinstance(wanted, (bool, str)):
            return type(value) is type(wanted) and value == wanted
        got = as_number(value)
        return got is not None and within(got, wanted, self.tolerance)

    def _listed(self, value: object) -> bool:
        if self.items is None:
            return True
        if not isinstance(value, (list, tuple)) or len(value) != len(self.items):
            return False
        return all(self._equal(got, wanted) for got, wanted in zip(value, self.items, strict=True))

    def _in_range(self, value: object) -> bool:
        if self.low is None and self.high is None:
            return True
        got = as_number(value)
        if got is None or math.isnan(got):
            return False
        low = -math.inf if self.low is None else self.low
        high = math.inf if self.high is None else self.high
        return low - SLACK * max(1.0, abs(low)) <= got <= high + SLACK * max(1.0, abs(high))

    def _of_form(self, value: object) -> bool:
        if self.pattern is None:
            return True
        return isinstance(value, str) and len(value) <= _LONGEST and re.fullmatch(self.pattern, value) is not None

    @property
    def wanted(self) -> str:
        """What is expected, for text."""
        parts = []
        if self.equals is not None:
            parts.append(shown(self.equals))
        if self.items is not None:
            parts.append(shown(self.items))
        if self.low is not None and self.high is not None:
            parts.append(f"{number(self.low)} to {number(self.high)}")
        elif self.low is not None:
            parts.append(f"at least {number(self.low)}")
        elif self.high is not None:
            parts.append(f"at most {number(self.high)}")
        if self.pattern is not None:
            parts.append(f"a text such as {quote(self.example)!r}" if self.example else f"a text like {self.pattern!r}")
        return " and ".join(parts) or "any value"


#: A rule, or short for one: the value expected.
Rule = str | float | bool | FieldRule


def as_rule(rule: Rule, tolerance: float = 1e-6) -> FieldRule:
    """Return a rule for what may stand short for one."""
    return rule if isinstance(rule, FieldRule) else FieldRule(equals=rule, tolerance=tolerance)


def broken_rules(value: Mapping[str, Any], rules: Mapping[str, Rule], tolerance: float = 1e-6) -> list[str]:
    """Return the paths whose rules a value breaks, in the order of the rules; the tolerance is that of short ones."""
    return [path for path, rule in rules.items() if not _keeps(value, path, as_rule(rule, tolerance))]


def _keeps(value: Mapping[str, Any], path: str, rule: FieldRule) -> bool:
    try:
        return rule.allows(at_path(value, path))
    except NoSuchField:
        return False


def breach(value: Mapping[str, Any], path: str, rule: Rule) -> str:
    """Return what stands at a path and what was expected there, as a clause."""
    try:
        found = f"{path} is {shown(at_path(value, path))}"
    except NoSuchField:
        found = f"there is no field {path}"
    return f"{found}, expected {as_rule(rule).wanted}"


def shown(value: object) -> str:
    """Return a field's value for text."""
    if value is None:
        return "nothing"
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return f"{quote(value, 80)!r}"
    if isinstance(value, (list, tuple)):
        return f"[{', '.join(map(shown, value[:20]))}{', ...' if len(value) > 20 else ''}]"
    got = as_number(value)
    return number(got) if got is not None else quote(str(value), 80)


def told(rules: Mapping[str, Rule]) -> str:
    """Return rules for text: `success true, message a text such as ...`."""
    return ", ".join(f"{path} {as_rule(rule).wanted}" for path, rule in rules.items())
