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
    """One row of points."""

    name: str  # what a reader sees in the legend
    points: tuple[Point, ...]  # (x, y), units of the axes; NaN breaks a line
    look: Look = Look.LINE  # how they are joined
    tone: Tone = Tone.MAIN  # what they mean
    texts: tuple[str, ...] = ()  # what each point says beyond its numbers; empty, or one a point. Student-controlled.


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
    """One coordinate system of a chart."""

    title: str  # what is drawn on the vertical axis
    unit: str  # its unit; empty for none
    series: tuple[Series, ...]  # in drawing order
    bands: tuple[Band, ...] = ()  # what is accepted
    levels: tuple[Level, ...] = ()  # thresholds and expected values
    # If set, the vertical axis has these rows instead of numbers, from the top; y counts them from 0
    lanes: tuple[str, ...] = ()
    # Lines of the horizontal axis: (first, distance); None leaves them to the renderer
    grid: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels under each other that share the horizontal axis."""

    id: str  # unique within the exercise
    title: str  # what a reader sees
    about: str  # the picture in words, for whoever cannot see it
    criteria: tuple[str, ...]  # ids of the criteria that it belongs to
    x_title: str  # what is drawn on the horizontal axis
    x_unit: str  # its unit
    panels: tuple[Panel, ...]  # from the top
    moments: tuple[Moment, ...] = ()  # lines through all panels
    square: bool = False  # whether one metre is as long upwards as sideways


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
    """A few lines around a place in a student's file."""

    file: str  # relative to the submission
    line: int  # the line that is meant, from 1
    first: int  # number of the first line shown
    lines: tuple[str, ...]  # the text, student-controlled, without line ends
