"""Figures that show the behaviour of nodes, as plain data for any renderer."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from grader.core.trace import GraphSnapshot

Point = tuple[float, float]


class Look(str, Enum):
    """How the points of a series are connected."""

    LINE = "line"
    STEP = "step"  # a value holds until the next one
    DOTS = "dots"


class Tone(str, Enum):
    """The meaning of a series or a moment; renderers choose colours and shapes for it."""

    MAIN = "main"
    SECOND = "second"
    THIRD = "third"
    FAINT = "faint"
    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Series:
    """A series of points.

    Attributes:
        name: Its name in the legend.
        points: (x, y) in the units of the axes; NaN interrupts a line.
        look: How the points are connected.
        tone: Their meaning.
        texts: A text for each point; empty if there are none. Student-controlled.
    """

    name: str
    points: tuple[Point, ...]
    look: Look = Look.LINE
    tone: Tone = Tone.MAIN
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Band:
    """A range of the vertical axis in which values are accepted, including its limits."""

    low: float
    high: float
    label: str
    tone: Tone = Tone.GOOD


@dataclass(frozen=True, slots=True)
class Level:
    """A horizontal line at a value."""

    value: float
    label: str


@dataclass(frozen=True, slots=True)
class Moment:
    """A vertical line through all panels."""

    x: float
    label: str
    tone: Tone = Tone.FAINT


@dataclass(frozen=True, slots=True)
class Panel:
    """One coordinate system of a chart.

    Attributes:
        title: Title of the vertical axis.
        unit: Its unit; empty for none.
        series: In drawing order.
        bands: Ranges of accepted values.
        levels: Thresholds and expected values.
        lanes: If not empty, the vertical axis has these rows instead of numbers, from the top; y is the index of a row.
        grid: Grid lines of the horizontal axis: (first, distance); None if the renderer chooses.
    """

    title: str
    unit: str
    series: tuple[Series, ...]
    bands: tuple[Band, ...] = ()
    levels: tuple[Level, ...] = ()
    lanes: tuple[str, ...] = ()
    grid: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels below each other that share the horizontal axis.

    Attributes:
        id: Unique within the exercise.
        title: Its title.
        about: A description for readers who cannot see it.
        criteria: Ids of the criteria that it illustrates.
        x_title: Title of the horizontal axis.
        x_unit: Its unit.
        panels: Its panels, from the top.
        moments: Lines through all panels.
        square: Whether both axes have the same scale.
    """

    id: str
    title: str
    about: str
    criteria: tuple[str, ...]
    x_title: str
    x_unit: str
    panels: tuple[Panel, ...]
    moments: tuple[Moment, ...] = ()
    square: bool = False


@dataclass(frozen=True, slots=True)
class Stage:
    """The ROS graph at one time, without topics that every node has."""

    title: str
    graph: GraphSnapshot


@dataclass(frozen=True, slots=True)
class GraphFigure:
    """The ROS graph at several times; its other attributes are those of a chart."""

    id: str
    title: str
    about: str
    criteria: tuple[str, ...]
    stages: tuple[Stage, ...]


Figure = Chart | GraphFigure


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A few lines around a place in a student's file.

    Attributes:
        file: Relative to the submission.
        line: The line of interest, from 1.
        first: Number of the first line shown.
        lines: The text, student-controlled, without line ends.
    """

    file: str
    line: int
    first: int
    lines: tuple[str, ...]
