"""The output of a process: log records and printed lines, the numbers in them, and the values that these show."""

from __future__ import annotations

import math
import re
from bisect import bisect_right
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import field
from functools import lru_cache

from grader.core.dataclass import dataclass
from grader.core.quantities import counted
from grader.core.trace import LogRecord, OutputLine, Trace
from grader.judging.findings import AT_ONCE_NS, first_fault
from grader.judging.texts import Printed, clean, printed_numbers, template_of, with_decimal_points
from grader.judging.values import per_trace
from grader.judging.wording import number, quote

#: Warnings that rclpy writes through the node's own logger when QoS policies are incompatible.
_RCLPY_TEXT = re.compile(r"New (publisher|subscription) discovered on (topic|service) .*incompatible QoS", re.DOTALL)
#: Loggers of the layers below rclpy, which report their own failures.
_MIDDLEWARE = re.compile(r"(rmw|rcl|rcutils|rosidl|rcl_\w+|rmw_\w+|rosidl_\w+)(\.|$)")
_TRACEBACK_HEAD = re.compile(r"\s*(Traceback \(most recent call last\):|Exception in thread .*|Exception ignored .*)$")
_BETWEEN_TRACEBACKS = re.compile(r"(The above exception was|During handling of the above exception)")
_INTERPRETER = re.compile(
    r".*:\d+: \w*Warning: "  # warnings.warn
    r"|sys:\d+: \w*Warning: "
    r"|Fatal Python error: |Current thread 0x|Thread 0x[0-9a-f]+ "
    r"|usage: .*\.py|.*\.py: error: "  # argparse
    r"|\[(DEBUG|INFO|WARN|ERROR|FATAL)\] \[\d+\.\d+\] \["  # rcutils writing a record to its console
    r"|>>> \[rcutils|.*\[(RTPS|SECURITY|DDS|XMLPARSER)\w* (Error|Warning)\]"
    r"|terminate called |Segmentation fault|Aborted|Killed|.*Assertion .* failed"
)


@per_trace
def student_records(trace: Trace, process: str) -> tuple[LogRecord, ...]:
    """Return the records of a process without those of rclpy and the layers below it."""
    return tuple(r for r in trace.records(process) if r.t_ns < trace.stop_ns and not _of_ros(r))


def _of_ros(record: LogRecord) -> bool:
    if record.file:
        return False
    return bool(_RCLPY_TEXT.match(record.text[:400]) or _MIDDLEWARE.match(record.logger))


@per_trace
def printed_lines(trace: Trace, process: str) -> tuple[OutputLine, ...]:
    """Return the lines that a process printed, without tracebacks, interpreter warnings and blank lines."""
    faults = [" ".join(f.text.split()) for f in trace.faults(process)]
    lines = [o for o in trace.lines(process) if o.t_ns < trace.stop_ns and o.text.strip()]
    # the text of an exception may continue over several lines, without indentation like printed ones
    lines = [o for o in lines if o.stream != "stderr" or not any(" ".join(o.text.split()) in f for f in faults)]
    outs = [o for o in lines if o.stream != "stderr"]
    errs = _without_interpreter_noise([o for o in lines if o.stream == "stderr"])
    kept = {id(o) for o in [*_without_prompt(trace, process, outs), *errs]}
    return tuple(o for o in lines if id(o) in kept)


def is_no_node(trace: Trace, process: str) -> bool:
    """Return whether a process had no node in the graph; one that logged and ended at once may have had one unseen."""
    seen = {node for graph in trace.graphs() for node in graph.nodes}
    others = {f"/{r.logger.replace('.', '/')}" for r in trace.records() if r.process != process}
    if not trace.graphs() or seen - others:
        return False
    fault = first_fault(trace, process)
    return not (fault is not None and fault.t_ns < AT_ONCE_NS and student_records(trace, process))


def written(trace: Trace, process: str) -> tuple[LogRecord | OutputLine, ...]:
    """Return the records of a process, followed by the lines that it printed."""
    return (*student_records(trace, process), *printed_lines(trace, process))


def _without_prompt(trace: Trace, process: str, lines: list[OutputLine]) -> list[OutputLine]:
    """Return the lines without the prompt of an `input()` at which the process ended: there is no keyboard."""
    ends = [f for f in trace.faults(process) if f.said("^EOFError")]
    prompt = next((o for o in reversed(lines) if ends and o.t_ns <= ends[0].t_ns), None)
    return [o for o in lines if o is not prompt]


def _without_interpreter_noise(lines: Iterable[OutputLine]) -> list[OutputLine]:
    kept: list[OutputLine] = []
    inside_traceback = after_warning = False
    for line in lines:
        indented = line.text[:1] in (" ", "\t")
        if _TRACEBACK_HEAD.match(line.text) or _BETWEEN_TRACEBACKS.match(line.text):
            inside_traceback = True
        elif inside_traceback:
            inside_traceback = indented  # the first unindented line is the exception itself
        elif _INTERPRETER.match(line.text[:400]):
            after_warning = True
        elif not (after_warning and indented):
            after_warning = False
            kept.append(line)
    return kept


Output = LogRecord | OutputLine
#: Relative difference that a short conversion constant explains, such as 3.14159 for pi.
CONVERSION = 1e-4


@lru_cache(maxsize=4096)
def numbers_in(text: str) -> tuple[Printed, ...]:
    """Return the numbers of a text; decimal commas are read both ways."""
    body = clean(text)
    other = with_decimal_points(body)
    return printed_numbers(body) + (printed_numbers(other) if other else ())


def after(text: str, printed: Printed) -> str:
    """Return what follows a number of a text, without white space between them."""
    return clean(text)[printed.stop :].lstrip()


@lru_cache(maxsize=4096)
def shape_of(text: str) -> str:
    """Return a text with masked numbers and without white space; equal for texts of the same wording."""
    body = clean(text)
    return template_of(body, printed_numbers(body))


def shows_about(printed: Printed, value: float, *, coarsest: float, relative: float = CONVERSION) -> bool:
    """Return whether a printed number shows a value precisely enough, allowing for a short conversion constant.

    Args:
        printed: The number.
        value: The value it may show.
        coarsest: Largest unit of the last digit that is precise enough, unless the number is exact.
        relative: Largest relative difference accepted.
    """
    slack = relative * abs(value) + 1e-9
    if abs(printed.value - value) <= slack:
        return True
    return printed.step <= coarsest * (1 + 1e-9) and any(printed.shows(value + d) for d in (-slack, 0.0, slack))


#: Factors that have a name, as text shows them.
_NAMED_FACTORS = {
    "1": "the value itself",
    f"{number(180 / math.pi)}": "the value in degrees",
    f"{number(math.pi / 180)}": "the value in radians",
}


def times(factor: float) -> str:
    """Return a factor for text; a factor of 1, and those between radians and degrees, by what they give."""
    return _NAMED_FACTORS.get(number(factor)) or f"{number(factor)} times the value"


def in_window(outputs: Sequence[Output], start_ns: int, stop_ns: int) -> list[Output]:
    """Return the outputs written in [start_ns, stop_ns)."""
    return [o for o in outputs if start_ns <= o.t_ns < stop_ns]


def number_in(text: str, pattern: str | None = None) -> float | None:
    """Return the number that the pattern finds in a text, or without a pattern the first number."""
    if pattern is not None:
        match = re.search(pattern, text[:2_000])
        if match is None:
            return None
        text = match[1] if match.re.groups and match[1] is not None else match[0]
    found = numbers_in(text)
    return found[0].value if found else None


#: Minimum share of texts in which a position in the text must be right; the others may be different logs of similar
#: wording.
_USUALLY = 0.45
#: The same for a position that has shown only one value, as in a separate sentence for "off".
_NEARLY_ALWAYS = 0.75
#: Up to this many numbers in one text are not suspicious.
_FEW = 6
#: The same if the position has followed several values.
_FEW_FOLLOWING = 12
#: Maximum expected number of positions that are right by chance.
_LUCK = 0.15
#: A printed number shows values within at most this many units of its last digit.
_UNITS_SHOWN = 3
_DIGITS = re.compile(r"[0-9]+")
_REPEATED = re.compile(r"(.)\1+")
_Key = tuple[str, int, str, frozenset[str], str]
_Place = tuple[_Key, int]


@dataclass(frozen=True, slots=True)
class Sought:
    """A value that must be logged in [start_ns, stop_ns), and the test for it.

    Attributes:
        start_ns: Earliest time of its log.
        stop_ns: Latest time of its log, exclusive.
        value: The value.
        scale: Size of the range of such values, in their unit.
        shows: Whether a printed number shows the value.
    """

    start_ns: int
    stop_ns: int
    value: float
    scale: float
    shows: Callable[[Printed], bool]


@dataclass(slots=True)
class _Record:
    """Results of one position in texts of one shape."""

    texts: int = 0
    right: int = 0
    near: bool = False
    active: set[int] = field(default_factory=set)
    shown: set[int] = field(default_factory=set)
    chances: dict[float, float] = field(default_factory=dict)

    @property
    def share(self) -> float:
        return self.right / self.texts


def followed(outputs: Sequence[Output], sought: Sequence[Sought]) -> frozenset[int]:
    """Return the indices in `sought`, ordered by time, of values that are logged, not only among many other numbers."""
    places = _places(outputs, sought)
    # each number is indexed from the start and from the end, and counted once
    tried = [p for (_, index), p in places.items() if p.near and index >= 0]
    beside = [0] * len(sought)
    for place in tried:
        if place.texts < 2 or place.share >= _USUALLY:
            for here in place.active:
                beside[here] += 1
    several = len({s.value for s in sought}) > 1
    found: set[int] = set()
    for place in places.values():
        if place.shown - found and _knows(place, len(tried), max(beside[k] for k in place.active), several=several):
            found |= place.shown
    return frozenset(found)


def standing(outputs: Sequence[Output], sought: Sequence[Sought]) -> frozenset[int]:
    """Return the indices in `sought` of values that occur anywhere in the output of their time."""
    found: set[int] = set()
    for output, active in _active(outputs, sought):
        numbers = [n for _, ns in _readings(output.text) for n in ns]
        found.update(k for k in active if k not in found and any(sought[k].shows(n) for n in numbers))
    return frozenset(found)


def surroundings(outputs: Sequence[Output], one: Sought) -> str:
    """Return a clause about the other numbers in the texts that show a value."""
    texts = [o.text for o, _ in _active(outputs, [one])]
    count = sum(len(_readings(text)[0][1]) for text in texts)
    longest = max(texts, key=len, default="")
    return f"among {counted(count, 'number')} written in its time, as in {quote(longest, 60)!r}"


def _knows(place: _Record, tried: int, beside: int, *, several: bool) -> bool:
    """Return whether a position is right too often for chance."""
    values = len(place.chances)
    if place.share < (_NEARLY_ALWAYS if values == 1 and several else _USUALLY):
        return False
    among = beside if values == 1 else tried
    if among <= (_FEW if values == 1 else _FEW_FOLLOWING):
        return True
    luck = float(among)
    for chance in place.chances.values():
        luck *= chance
    return luck <= _LUCK


def _places(outputs: Sequence[Output], sought: Sequence[Sought]) -> dict[_Place, _Record]:
    places: dict[_Place, _Record] = {}
    for output, active in _active(outputs, sought):
        where = (output.file, output.line) if isinstance(output, LogRecord) else ("", 0)
        for shape, numbers in _readings(output.text):
            for index, printed in enumerate(numbers):
                shown = [k for k in active if sought[k].shows(printed)]
                near = any(abs(printed.value) <= 1.1 * sought[k].scale for k in active)
                chances = {sought[k].value: _chance(printed, sought[k]) for k in shown}
                for place in (index, index - len(numbers)):
                    record = places.setdefault(((*where, *shape), place), _Record())
                    record.texts += 1
                    record.right += bool(shown)
                    record.near |= near
                    record.active.update(active)
                    record.shown.update(shown)
                    record.chances |= chances
    return places


def _chance(number: Printed, one: Sought) -> float:
    return min(1.0, _UNITS_SHOWN * number.step / one.scale) if one.scale else 1.0


def _active(outputs: Sequence[Output], sought: Sequence[Sought]) -> Iterator[tuple[Output, list[int]]]:
    """Yield the outputs written while some value is sought, with the indices of those values."""
    starts = [s.start_ns for s in sought]
    longest = max((s.stop_ns - s.start_ns for s in sought), default=0)
    for output in outputs:
        first = bisect_right(starts, output.t_ns - longest - 1)
        active = [k for k in range(first, bisect_right(starts, output.t_ns)) if output.t_ns < sought[k].stop_ns]
        if active:
            yield output, active


@lru_cache(maxsize=4096)
def _readings(text: str) -> tuple[tuple[tuple[str, frozenset[str], str], tuple[Printed, ...]], ...]:
    """Return the numbers of a text with its shape, and a second reading with decimal commas if it may have some."""
    body = clean(text)
    other = with_decimal_points(body)
    return tuple((_wording(b, ns), ns) for b in (body, other) if b is not None for ns in (printed_numbers(b),))


def _wording(text: str, numbers: Sequence[Printed]) -> tuple[str, frozenset[str], str]:
    """Return the text around the numbers as a shape; lists and bars of any length have the same one."""
    starts = [0, *(n.stop for n in numbers)]
    stops = [*(n.start for n in numbers), len(text)]
    bare = ("".join(text[a:b].split()) for a, b in zip(starts, stops, strict=True))
    parts = [_REPEATED.sub(r"\1", _DIGITS.sub("0", part)) for part in bare]
    return parts[0], frozenset(parts[1:-1]), parts[-1]


_DEGREES = 180 / math.pi
#: Minimum share of messages whose numbers a factor must explain for it to be reported.
_SURE = 0.8
#: Values smaller than this share of the largest are not used to find a factor.
_SMALL = 0.05
_FEWEST = 3
#: Factors that appear in place of the one from radians to degrees.
_FOR_DEGREES: tuple[tuple[float, str], ...] = (
    (200 / math.pi, "gradians, of which a full turn has 400: degrees are radians times 180 / pi"),
    (1 / _DEGREES, "the inverse conversion: degrees are radians times 180 / pi"),
    (60.0, "the conversion with 3 for pi: use math.pi or math.degrees"),
    (180.0 * math.pi, "multiplied by pi and not divided: degrees are radians times 180 / pi"),
    (_DEGREES**2, "converted twice: degrees are radians times 180 / pi"),
    (180.0, "not divided by pi: degrees are radians times 180 / pi"),
    (1 / math.pi, "not multiplied by 180: degrees are radians times 180 / pi"),
    (360 / math.pi, "twice as much: degrees are radians times 180 / pi"),
    (90 / math.pi, "half as much: degrees are radians times 180 / pi"),
)


@dataclass(frozen=True, slots=True)
class LoggedNumbers:
    """The value in a message, and the numbers logged for it."""

    value: float
    numbers: tuple[Printed, ...]


def wrong_conversion(logged: Sequence[LoggedNumbers], factor: float, others: Sequence[float]) -> tuple[str, str]:
    """Return a clause about what is logged instead of `factor` times a value, and a hint; both empty if unclear."""
    largest = max((abs(h.value) for h in logged), default=0.0)
    telling = [h for h in logged if h.numbers and abs(h.value) > _SMALL * largest]
    if len(telling) < _FEWEST:
        return "", ""
    left = [LoggedNumbers(h.value, tuple(n for n in h.numbers if not _explained(n, h, others))) for h in telling]
    if _share(left, lambda h, n: n.step >= 1 and n.shows(factor * h.value)) >= _SURE:
        return "it is logged as a whole number", "keep some decimals, as in f'{angle:.3f}'"
    lost = [h for h in left if factor * h.value < 0]
    if len(lost) >= _FEWEST and _share(lost, lambda h, n: _shows_value(n, -factor * h.value)) >= _SURE:
        every = _share(left, lambda h, n: _shows_value(n, -factor * h.value)) >= _SURE
        return ("it has the other sign", "keep the sign") if every else ("its sign is lost", "keep the sign")
    return _factor(left, factor)


def _factor(left: Sequence[LoggedNumbers], factor: float) -> tuple[str, str]:
    first = max(left, key=lambda h: abs(h.value))
    for candidate in (n.value / first.value for n in first.numbers if math.isfinite(n.value) and n.value != 0):
        known = _known(candidate, factor)
        exact = known[0] if known else candidate
        # the value itself may stand beside a wrong conversion of it
        itself = math.isclose(exact, 1, rel_tol=0.01)
        if _scaled(left, exact) >= _SURE and not (
            itself and any(not _explained(n, h, (1,)) for h in left for n in h.numbers)
        ):
            text = f"instead there is {times(1 if itself else exact)}"
            return (f"{text}, {known[1]}" if known else text), ""
    return "", ""


def _scaled(left: Sequence[LoggedNumbers], factor: float) -> float:
    return _share(left, lambda h, n: _shows_value(n, factor * h.value, 0.01))


def _known(candidate: float, factor: float) -> tuple[float, str] | None:
    if not math.isclose(factor, _DEGREES, rel_tol=1e-3):
        return None
    return next(((f, text) for f, text in _FOR_DEGREES if math.isclose(candidate, f, rel_tol=0.01)), None)


def _shows_value(printed: Printed, value: float, relative: float = CONVERSION) -> bool:
    return shows_about(printed, value, coarsest=abs(value) / 3, relative=relative)


def _explained(printed: Printed, logged: LoggedNumbers, factors: Sequence[float]) -> bool:
    return any(_shows_value(printed, f * logged.value) for f in factors)


def _share(logged: Sequence[LoggedNumbers], fits: Callable[[LoggedNumbers, Printed], bool]) -> float:
    return sum(any(fits(h, n) for n in h.numbers) for h in logged) / len(logged)
