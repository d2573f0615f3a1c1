"""The walls of a map as cells of a grid: where rays end, what is near, and the outlines that a picture shows.

It computes with numpy, which is imported when a map is first used: most rubrics have none. All results follow from
additions, multiplications and square roots, which every processor rounds in the same way; numpy's sine does not.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from functools import lru_cache
from typing import TYPE_CHECKING, Any

from grader.runtime.model.worlds import Place, WallMap

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Numbers = NDArray[np.float64]

#: Half of the diagonal of a cell, in cells, and a little more, so that rounding leaves out no ray that meets it.
HALF_DIAGONAL = 0.7072
#: What stands for the inverse of a direction's part that is zero.
STEEP = 1e12


class Rays:
    """The rays of one scan, at equal angles.

    Args:
        heading: Direction of the scanner, in rad.
        first: Angle of the first ray to it, in rad.
        increment: From each ray to the next, in rad.
        count: Number of rays.

    Attributes:
        first: Direction of the first ray in the world, in rad.
        increment: From each ray to the next, in rad.
        count: Number of rays.
        x: The part of each direction along x.
        y: The part of each direction along y.
        slow_x: How far each ray goes while it goes 1 m along x.
        slow_y: The same along y.
    """

    def __init__(self, heading: float, first: float, increment: float, count: int) -> None:
        import numpy as np  # noqa: PLC0415 - see the top

        self.first, self.increment, self.count = heading + first, increment, count
        cosines, sines = _turned(first, increment, count)
        cosine, sine = math.cos(heading), math.sin(heading)
        self.x: Numbers = np.asarray(cosine * cosines - sine * sines)
        self.y: Numbers = np.asarray(sine * cosines + cosine * sines)
        self.slow_x, self.slow_y = _inverse(self.x), _inverse(self.y)


@lru_cache(maxsize=8)
def _turned(first: float, increment: float, count: int) -> tuple[Numbers, Numbers]:
    """Return cosines and sines of the angles of rays to their scanner."""
    import numpy as np  # noqa: PLC0415 - see the top

    angles = [first + number * increment for number in range(count)]
    return np.array([math.cos(angle) for angle in angles]), np.array([math.sin(angle) for angle in angles])


class Walls:
    """The walls of a map, ready to be measured.

    Args:
        map_: The map.
    """

    def __init__(self, map_: WallMap) -> None:
        import numpy as np  # noqa: PLC0415 - see the top

        self._np: Any = np
        self._map = map_
        bits = np.unpackbits(np.frombuffer(map_.cells, dtype=np.uint8), count=map_.width * map_.height)
        self.occupied: NDArray[np.bool_] = bits.reshape(map_.height, map_.width).astype(bool)
        edge = self.occupied & ~self._surrounded()
        rows, columns = np.nonzero(edge)
        self._edge_x, self._edge_y = columns.astype(float), rows.astype(float)

    def _surrounded(self) -> NDArray[np.bool_]:
        """Return the cells whose four neighbours are walls: nothing is nearest to one of these."""
        inner = self._np.zeros_like(self.occupied)
        wall = self.occupied
        inner[1:-1, 1:-1] = wall[:-2, 1:-1] & wall[2:, 1:-1] & wall[1:-1, :-2] & wall[1:-1, 2:]
        return inner  # type: ignore[no-any-return]

    def ranges(self, x: float, y: float, rays: Rays, most: float) -> Numbers:
        """Return where rays meet a wall, in m from where they begin; infinite beyond `most`.

        For each cell of a wall it is found which rays may meet it, and then where they do: that costs the same however
        far a ray goes.

        Args:
            x: Where they begin, in m.
            y: The same.
            rays: Their directions.
            most: The largest distance to return, in m.
        """
        np, map_ = self._np, self._map
        at_x, at_y = (x - map_.x) / map_.resolution, (y - map_.y) / map_.resolution
        limit = most / map_.resolution
        found = np.full(rays.count, math.inf)
        to_x, to_y = self._edge_x - at_x, self._edge_y - at_y
        near = np.nonzero((np.abs(to_x + 0.5) <= limit + 1.0) & (np.abs(to_y + 0.5) <= limit + 1.0))[0]
        to_x, to_y = to_x[near], to_y[near]
        cells, numbers = self._met(to_x + 0.5, to_y + 0.5, rays)
        enters, leaves = _slab(
            (to_x[cells], to_y[cells], to_x[cells] + 1.0, to_y[cells] + 1.0),
            rays.slow_x[numbers],
            rays.slow_y[numbers],
        )
        met = (enters <= leaves) & (leaves > 0)
        np.minimum.at(found, numbers[met], np.maximum(enters[met], 0.0))
        found = found * map_.resolution
        found[found > most] = math.inf
        return found  # type: ignore[no-any-return]

    def _met(self, to_x: Numbers, to_y: Numbers, rays: Rays) -> tuple[Any, Any]:
        """Return numbers of cells and of rays that may meet, as pairs; the cells are given by their middles."""
        np = self._np
        squares = to_x * to_x + to_y * to_y
        inside = squares <= HALF_DIAGONAL * HALF_DIAGONAL
        half = np.arctan2(HALF_DIAGONAL, np.sqrt(np.where(inside, 0.0, squares - HALF_DIAGONAL**2)))
        half[inside] = math.pi
        middle = np.mod(np.arctan2(to_y, to_x) - rays.first, math.tau)
        # of a whole turn, some cells lie at its end and at its beginning
        over, under = np.nonzero(middle + half >= math.tau)[0], np.nonzero(middle < half)[0]
        cells = np.concatenate([np.arange(middle.size), over, under])
        middle = np.concatenate([middle, middle[over] - math.tau, middle[under] + math.tau])
        half = half[cells]
        first = np.maximum(np.floor((middle - half) / rays.increment), 0).astype(np.int64)
        last = np.minimum(np.ceil((middle + half) / rays.increment), rays.count - 1).astype(np.int64)
        counts = np.maximum(last - first + 1, 0)
        ends = np.cumsum(counts)
        places = np.arange(int(ends[-1]) if ends.size else 0) - np.repeat(ends - counts, counts)
        return np.repeat(cells, counts), np.repeat(first, counts) + places

    def distance(self, x: float, y: float) -> float:
        """Return the distance from a point to the nearest wall, in m; 0 inside of one, infinite without any."""
        if not self._edge_x.size:
            return math.inf
        np, map_ = self._np, self._map
        at_x, at_y = (x - map_.x) / map_.resolution, (y - map_.y) / map_.resolution
        column, row = math.floor(at_x), math.floor(at_y)
        if 0 <= column < map_.width and 0 <= row < map_.height and self.occupied[row, column]:
            return 0.0
        dx = np.maximum(np.maximum(self._edge_x - at_x, at_x - self._edge_x - 1.0), 0.0)
        dy = np.maximum(np.maximum(self._edge_y - at_y, at_y - self._edge_y - 1.0), 0.0)
        return math.sqrt(float(np.min(dx * dx + dy * dy))) * map_.resolution

    def outlines(self) -> Iterator[tuple[Place, Place]]:
        """Yield the edges between walls and everything else, as straight lines from one place to another."""
        yield from self._edges(across=False)
        yield from self._edges(across=True)

    def _edges(self, *, across: bool) -> Iterator[tuple[Place, Place]]:
        np, map_ = self._np, self._map
        cells = self.occupied.T if across else self.occupied
        blank = np.zeros((1, cells.shape[1]), dtype=bool)
        differs = np.vstack([blank, cells]) != np.vstack([cells, blank])
        for line in np.nonzero(differs.any(axis=1))[0]:
            changes = np.nonzero(np.diff(np.concatenate([[False], differs[line], [False]]).astype(np.int8)))[0]
            for begin, end in zip(changes[::2], changes[1::2], strict=True):
                ends = ((line, begin), (line, end)) if across else ((begin, line), (end, line))
                first, last = (
                    (map_.x + float(column) * map_.resolution, map_.y + float(row) * map_.resolution)
                    for column, row in ends
                )
                yield first, last


def ranges_to_box(x: float, y: float, rays: Rays, box: tuple[float, float, float, float]) -> Numbers:
    """Return where rays meet a rectangle, in m from where they begin; infinite where they do not.

    Args:
        x: Where they begin, in m.
        y: The same.
        rays: Their directions.
        box: Least x, least y, largest x, largest y, in m.
    """
    import numpy as np  # noqa: PLC0415 - see the top

    least_x, least_y, most_x, most_y = box
    enters, leaves = _slab((least_x - x, least_y - y, most_x - x, most_y - y), rays.slow_x, rays.slow_y)
    return np.where((enters <= leaves) & (leaves > 0), np.maximum(enters, 0.0), math.inf)


def ranges_to_circle(x: float, y: float, rays: Rays, circle: tuple[float, float, float]) -> Numbers:
    """Return where rays meet a circle, in m from where they begin; infinite where they do not.

    Args:
        x: Where they begin, in m.
        y: The same.
        rays: Their directions.
        circle: x and y of its middle, and its radius, in m.
    """
    import numpy as np  # noqa: PLC0415 - see the top

    middle_x, middle_y, radius = circle
    to_x, to_y = middle_x - x, middle_y - y
    along = to_x * rays.x + to_y * rays.y
    beside = to_y * rays.x - to_x * rays.y
    half = np.sqrt(np.maximum(radius * radius - beside * beside, 0.0))
    met = (np.abs(beside) < radius) & (along + half > 0)
    return np.where(met, np.maximum(along - half, 0.0), math.inf)


def _inverse(part: Numbers) -> Numbers:
    """Return how far a ray goes while it goes 1 m along an axis; a large number for one that does not, never -0.0."""
    import numpy as np  # noqa: PLC0415 - see the top

    with np.errstate(divide="ignore", over="ignore"):
        return np.clip(1.0 / (part + 0.0), -STEEP, STEEP)


def _slab(box: tuple[Any, Any, Any, Any], slow_x: Numbers, slow_y: Numbers) -> tuple[Numbers, Numbers]:
    """Return where rays from the origin enter and leave the two stripes that a rectangle is the intersection of."""
    import numpy as np  # noqa: PLC0415 - see the top

    first_x, last_x = box[0] * slow_x, box[2] * slow_x
    first_y, last_y = box[1] * slow_y, box[3] * slow_y
    enters = np.maximum(np.minimum(first_x, last_x), np.minimum(first_y, last_y))
    leaves = np.minimum(np.maximum(first_x, last_x), np.maximum(first_y, last_y))
    return enters, leaves
