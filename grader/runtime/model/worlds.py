"""What simulations are given and what they give, as data: the walls of a map, and the things in a picture."""

from __future__ import annotations

from grader.runtime.model.dataclass import dataclass

#: A point of the world: x and y in m.
Place = tuple[float, float]


@dataclass(frozen=True, slots=True)
class WallMap:
    """A map of a rubric: which of its cells are walls, as ROS's map_server understands them.

    Attributes:
        width: Number of cells along x.
        height: Number of cells along y.
        resolution: Side of a cell, in m.
        x: Of the corner with the least x and y, in m.
        y: Of the same corner, in m.
        cells: A bit for each cell, 1 for a wall, row after row from the least y on, the highest bit of a byte first.
    """

    width: int
    height: int
    resolution: float
    x: float
    y: float
    cells: bytes


#: What a thing in a picture may mean; reports choose its colour.
TONES = ("main", "second", "third", "faint", "good", "warning", "bad")


@dataclass(frozen=True, slots=True)
class Sketch:
    """One thing in the picture of a simulation: lines or dots in a plane.

    Attributes:
        name: Its name in the legend.
        lines: Each line as its points, x and y in m.
        dots: Whether the points are drawn, and no lines between them.
        tone: What it means: `main`, `second`, `third`, `faint`, `good`, `warning` or `bad`.
    """

    name: str
    lines: tuple[tuple[Place, ...], ...]
    dots: bool = False
    tone: str = "main"
