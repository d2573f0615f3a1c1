"""Figures that show the behaviour of nodes, as plain data for any renderer."""

from __future__ import annotations

from enum import Enum

from grader.runtime.model.dataclass import dataclass
from grader.runtime.model.trace import GraphSnapshot

#: Horizontal and vertical value of a point of a series.
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
    """A series of points."""

    name: str  # its name in the legend
    points: tuple[Point, ...]  # (x, y) in the units of the axes; NaN interrupts a line
    look: Look = Look.LINE  # how the points are connected
    tone: Tone = Tone.MAIN  # their meaning
    # A text for each point; empty if there are none. Student-controlled.
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
    label: str  # what stands beside the line
    name: str = "expected"  # its name in the legend


@dataclass(frozen=True, slots=True)
class VerticalLine:
    """A vertical line through all panels."""

    x: float
    label: str
    tone: Tone = Tone.FAINT


@dataclass(frozen=True, slots=True)
class Stretch:
    """A stretch of the horizontal axis behind all panels: one of the cases that a check distinguishes."""

    start: float
    stop: float
    label: str  # may quote a student
    tone: Tone = Tone.FAINT


@dataclass(frozen=True, slots=True)
class Panel:
    """One coordinate system of a chart."""

    title: str  # title of the vertical axis
    unit: str  # its unit; empty for none
    series: tuple[Series, ...]  # in drawing order
    bands: tuple[Band, ...] = ()  # ranges of accepted values
    levels: tuple[Level, ...] = ()  # thresholds and expected values
    # If not empty, the vertical axis has these rows instead of numbers, from the top; y is the index of a row
    lanes: tuple[str, ...] = ()
    # Grid lines of the horizontal axis: (first, distance); None if the renderer chooses
    grid: tuple[float, float] | None = None


@dataclass(frozen=True, slots=True)
class Chart:
    """Panels below each other that share the horizontal axis."""

    id: str  # unique within the exercise
    title: str  # its title
    about: str  # a description for readers who cannot see it
    criteria: tuple[str, ...]  # ids of the criteria that it illustrates
    x_title: str  # title of the horizontal axis
    x_unit: str  # its unit
    panels: tuple[Panel, ...]  # its panels, from the top
    moments: tuple[VerticalLine, ...] = ()  # lines through all panels
    cases: tuple[Stretch, ...] = ()  # stretches behind all panels
    square: bool = False  # whether both axes have the same scale
    scenario: str = ""  # the recording that it shows; empty if it shows none
    until_s: float | None = None  # when that recording ended, in seconds; None if the horizontal axis is not time


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


@dataclass(frozen=True, slots=True)
class Column:
    """The values of one field of a topic."""

    name: str  # path of the field, dotted
    values: tuple[float | str, ...]  # one for each time of its topic; a single one if it never changes


@dataclass(frozen=True, slots=True)
class TopicValues:
    """What one side published on a topic, thinned for showing."""

    topic: str
    type: str
    sender: str  # `student` or `grader`; on the page of a test `program`, `test` or a simulation
    messages: int  # how many there were before thinning
    times_s: tuple[float, ...]  # when each of the kept ones was published, in seconds
    columns: tuple[Column, ...]


@dataclass(frozen=True, slots=True)
class Playback:
    """A recording that can be played: what was published, logged and connected at each moment."""

    id: str
    title: str
    about: str
    criteria: tuple[str, ...]
    timeline: Chart  # what was logged, printed and called, and faults
    topics: tuple[TopicValues, ...]
    # The graph from each moment on, in seconds, without topics that every node has
    graphs: tuple[tuple[float, GraphSnapshot], ...]


@dataclass(frozen=True, slots=True)
class ShownStep:
    """Something that a test did in its run."""

    begin_s: float
    end_s: float
    place: str  # such as `line 12`
    text: str  # the line of source
    failed: bool  # whether the test failed there


Figure = Chart | GraphFigure | Playback


@dataclass(frozen=True, slots=True)
class Excerpt:
    """A few lines around a place in a student's file."""

    file: str  # relative to the submission
    line: int  # the line of interest, from 1
    first: int  # number of the first line shown
    lines: tuple[str, ...]  # the text, student-controlled, without line ends


@dataclass(frozen=True, slots=True)
class SourceFile:
    """A student's file as handed in."""

    file: str  # relative to the submission
    lines: tuple[str, ...]  # the text, student-controlled, without line ends
    omitted: int = 0  # how many more lines it has
