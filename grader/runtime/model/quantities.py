"""Units of time and size, comparisons of numbers, and the kinds of values that rubrics write in their own forms."""

from numbers import Real
from typing import Annotated, TypeGuard

from grader.runtime.model.dataclass import dataclass

#: Nanoseconds in a second.
NS_PER_S = 1_000_000_000
#: Nanoseconds in a millisecond.
NS_PER_MS = 1_000_000
KIB, MIB, GIB = 1 << 10, 1 << 20, 1 << 30

#: Slack of every comparison, relative to the magnitudes compared: `abs(1.1 - 1.0) <= 0.1` is False in floating point.
SLACK = 1e-9


def seconds(t_ns: int) -> float:
    """Convert nanoseconds to seconds, for text and rates."""
    return t_ns / NS_PER_S


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a real number, also one of numpy; a boolean does not count."""
    return isinstance(value, Real) and not isinstance(value, bool)


def nanoseconds(seconds_: float) -> int:
    """Convert seconds to whole nanoseconds."""
    return round(seconds_ * NS_PER_S)


def size(bytes_: int) -> str:
    """Format a number of bytes in the largest unit that gives a whole number: `512 MiB`, `1,500 bytes`."""
    for factor, unit in ((GIB, "GiB"), (MIB, "MiB"), (KIB, "KiB")):
        if bytes_ >= factor and bytes_ % factor == 0:
            return f"{bytes_ // factor:,} {unit}"
    return f"{bytes_:,} bytes"


def duration(duration_ns: int) -> str:
    """Format a duration in seconds, without trailing zeros: `60 s`, `0.5 s`."""
    return f"{seconds(duration_ns):g} s"


def counted(count: int, noun: str) -> str:
    """Return `1 message` or `3 messages`."""
    return f"{count} {noun}" if count == 1 else f"{count} {noun}s"


def within(got: float, want: float, tolerance: float) -> bool:
    """Return whether `got` is in `want ± tolerance`, including the edges; NaN never is."""
    difference = abs(got - want)
    return difference <= tolerance or difference <= tolerance + SLACK * max(1.0, abs(want), abs(tolerance))


@dataclass(frozen=True, slots=True)
class Unit:
    """Marks an annotated number as a quantity that people write with its unit, e.g. `20 Hz` or `10 s`."""

    symbol: str


@dataclass(frozen=True, slots=True)
class Least:
    """Marks an annotated number with the minimum that a rubric may set."""

    value: int


#: A number of bytes; written in rubrics as `512 MiB`.
Bytes = Annotated[int, Unit("B")]
#: A duration as whole nanoseconds; written in rubrics as `10 s`, `200 ms` or `2 min`.
DurationNs = Annotated[int, Unit("s")]
#: A frequency; written in rubrics as `20 Hz`.
Hertz = Annotated[float, Unit("Hz")]


@dataclass(frozen=True, slots=True)
class Kind:
    """Marks an annotated value whose form in rubrics has rules of its own."""

    name: str


#: A number that may be written as `.inf`, `-.inf` or `.nan`, because fields can hold these.
FieldNumber = Annotated[float, Kind("field number")]
#: An absolute topic, service or node name.
Topic = Annotated[str, Kind("topic")]
#: A message type such as `std_msgs/msg/Float32`.
MessageType = Annotated[str, Kind("message type")]
#: A service type such as `std_srvs/srv/Trigger`.
ServiceType = Annotated[str, Kind("service type")]
#: An action type such as `example_interfaces/action/Fibonacci`.
ActionType = Annotated[str, Kind("action type")]
#: A formula of `n` and `t` such as `sin(0.1 * n)`.
Formula = Annotated[str, Kind("formula")]
#: A formula of the fields of a message, such as `a + b`.
FieldFormula = Annotated[str, Kind("formula of fields")]
#: A regular expression.
Pattern = Annotated[str, Kind("pattern")]


@dataclass(frozen=True, slots=True)
class FieldOf:
    """Marks a field path, or a mapping by field paths, of what a check's parameter names: `linear.x`, `ranges[0]`.

    Attributes:
        parameter: The parameter that names the topic, service or action.
        part: The part of a service or action that has the field: `_Request`, `_Response`, `_Result` or `_Feedback`.
        values: For a mapping whose values are field paths as well: the parameter that names where these are.
        unless: A word that stands for no field.
        formula: Whether the value is a formula of fields, or the values of the mapping are.
    """

    parameter: str
    part: str = ""
    values: str = ""
    unless: str = ""
    formula: bool = False
