"""Times, counts and cases of stimuli in words."""

from __future__ import annotations

from grader.runtime.model.quantities import duration
from grader.runtime.model.scenario import AnyOrder, Count, CountBetween, SomeOf, Time, TimeBetween, cases


def time_phrase(time: Time) -> str:
    """Return a time in words; of a drawn one, both ends."""
    if not isinstance(time, TimeBetween):
        return duration(time)
    return f"{duration(time.low_ns)} to {duration(time.high_ns)} (drawn)"


def count_phrase(count: Count) -> str:
    """Return a count in words; of a drawn one, both ends."""
    return f"{count.low} to {count.high} (drawn)" if isinstance(count, CountBetween) else str(count)


def cases_phrase(items: tuple[object, ...], what: str) -> str:
    """Describe how many cases there are, and whether their order is drawn; `what` is their name in the plural."""
    low, high = cases(items)
    order = " in a drawn order" if is_drawn(items) else ""
    named = what.removesuffix("s") if low == high == 1 else what
    return f"{low if low == high else f'{low} to {high}'} {named}{order}"


def is_drawn(items: tuple[object, ...]) -> bool:
    """Return whether the seed decides the order or the number of cases."""
    return any(isinstance(item, (AnyOrder, SomeOf)) for item in items)
