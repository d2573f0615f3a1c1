"""Figures: pictures of what nodes did, as plain data that any renderer can draw."""

from __future__ import annotations

from dataclasses import dataclass
from enum import Enum

from grader.core.trace import GraphSnapshot

Point = tuple[float, float]


class Look(str, Enum):
    """How the points of a series are joined."""

    LINE = "line"
    STEP = "step"  # a value holds until the next one
    DOTS = "dots"


class Tone(str, Enum):
    """What a series or a moment means to its reader; a renderer gives it a colour and a shape."""

    MAIN = "main"
    SECOND = "second"
    THIRD = "third"
    FAINT = "faint"
    GOOD = "good"
    WARNING = "warning"
    BAD = "bad"


@dataclass(frozen=True, slots=True)
class Series:
    """One row of points.

    Attributes:
        name: What a reader sees in the legend.
        points: (x, y), units of the axes; NaN breaks a line.
        look: How they are joined.
        tone: What they mean.
        texts: What each point says beyond its numbers; empty, or one a point. Student-controlled.
    """

    name: str
    points: tuple[Point, ...]
    look: Look = Look.LINE
    tone: Tone = Tone.MAIN
    texts: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True)
class Band:
    """A range of the vertical axis in which values are accepted, edges inside."""

    low: float
    high: float
    label: str
    tone: Tone = Tone.GOOD


@dataclass(frozen=True, slots=True)
class Level:
    """A value of the vertical axis worth a line."""

    value: float
    label: str


@dataclass(frozen=True, slots=True)
class Moment:
    """A value of the horizontal axis worth a line through all panels."""

    x: float
    label: str
    tone: Tone = Tone.FAINT


@dataclass(frozen=True, slots=True)
class Panel:
    """One coordinate system of a chart.

    Attributes:
        title: What is drawn on the vertical axis.
        unit: Its unit; empty for none.
        series: In drawing order.
        bands: What is accepted.
        levels: Thresholds and expected values.
        lanes: If set, the vertical axis has these rows instead of numbers, from the top; y counts them from 0.
        grid: Lines of the horizontal axis: (first, distance); None leaves them to the renderer.
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
    """Panels under each other that share the horizontal axis.

    Attributes:
        id: Unique within the exercise.
        title: What a reader sees.
        about: The picture in words, for whoever cannot see it.
        criteria: Ids of the criteria that it belongs to.
        x_title: What is drawn on the horizontal axis.
        x_unit: Its unit.
        panels: From the top.
        moments: Lines through all panels.
        square: Whether one metre is as long upwards as sideways.
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
    """The live ROS graph in one situation; topics that every node has are left out."""

    title: str
    graph: GraphSnapshot


@dataclass(frozen=True, slots=True)
class GraphFigure:
    """The live ROS graph before and after; the other attributes are those of a chart."""

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
        line: The line that is meant, from 1.
        first: Number of the first line shown.
        lines: The text, student-controlled, without line ends.
    """

    file: str
    line: int
    first: int
    lines: tuple[str, ...]
