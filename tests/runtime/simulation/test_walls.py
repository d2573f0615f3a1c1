"""The walls of a map: rays and distances are those of a slow computation that looks at every cell."""

from __future__ import annotations

import math
import random

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from grader.runtime.model.worlds import WallMap
from grader.runtime.simulation.walls import Rays, Walls, ranges_to_box, ranges_to_circle

WIDTH, HEIGHT, CELL = 30, 20, 0.1
X, Y = -1.0, -0.5


def drawn_walls(seed: int, share: float = 0.05) -> set[tuple[int, int]]:
    draw = random.Random(seed)
    return {(c, r) for c in range(WIDTH) for r in range(HEIGHT) if draw.random() < share}


def walls_of(cells: set[tuple[int, int]]) -> Walls:
    grid = np.zeros((HEIGHT, WIDTH), dtype=bool)
    for column, row in cells:
        grid[row, column] = True
    return Walls(WallMap(WIDTH, HEIGHT, CELL, X, Y, np.packbits(grid).tobytes()))


def limits(cell: tuple[int, int]) -> tuple[float, float, float, float]:
    column, row = cell
    return X + column * CELL, Y + row * CELL, X + (column + 1) * CELL, Y + (row + 1) * CELL


def slowly(x: float, y: float, angle: float, box: tuple[float, float, float, float]) -> float:
    """Return the distance to a rectangle along a ray, by its two stripes."""
    enters, leaves = 0.0, math.inf
    for at, part, low, high in ((x, math.cos(angle), box[0], box[2]), (y, math.sin(angle), box[1], box[3])):
        if abs(part) < 1e-12:
            if not low <= at <= high:
                return math.inf
        else:
            near, far = sorted(((low - at) / part, (high - at) / part))
            enters, leaves = max(enters, near), min(leaves, far)
    return enters if enters <= leaves else math.inf


@settings(max_examples=40, deadline=None)
@given(
    st.integers(0, 1000),
    st.floats(-1.6, 2.6),
    st.floats(-1.1, 2.1),
    st.floats(-4, 4),
    st.sampled_from([(-math.pi, math.tau / 90, 90), (-1.0, 0.04, 51), (0.5, 0.2, 1), (-3.0, 0.1, 61)]),
)
def test_a_ray_ends_at_the_first_wall(
    seed: int, x: float, y: float, heading: float, scan: tuple[float, float, int]
) -> None:
    """Wherever it begins, also outside of the map and in a wall; two of a hundred rays may pass a corner."""
    x, y = x + 0.0123, y + 0.0457  # not where cells meet, if hypothesis chooses round numbers
    cells = drawn_walls(seed)
    rays = Rays(heading, *scan)
    found = walls_of(cells).ranges(x, y, rays, 3.0)
    wrong = 0
    for number, distance in enumerate(found):
        angle = heading + scan[0] + number * scan[1]
        want = min((slowly(x, y, angle, limits(cell)) for cell in cells), default=math.inf)
        want = want if want <= 3.0 else math.inf
        wrong += not (distance == want or abs(distance - want) < 1e-6)
    assert wrong <= 2


@pytest.mark.parametrize("turn", [0.0, 0.05, -0.05])
def test_all_rays_meet_a_cell_at_the_seam_of_a_turn(turn: float) -> None:
    """It lies where the first ray and the last one are next to each other."""
    rays = Rays(turn, -math.pi, math.tau / 360, 360)
    found = walls_of({(2, 5)}).ranges(1.05, 0.05, rays, 5.0)
    want = [slowly(1.05, 0.05, turn - math.pi + k * math.tau / 360, limits((2, 5))) for k in range(360)]
    assert list(found) == pytest.approx(want)
    assert sum(map(math.isfinite, want)) > 2


def test_a_scanner_in_a_wall_measures_nothing() -> None:
    """In any direction."""
    assert list(walls_of({(10, 5)}).ranges(0.05, 0.05, Rays(1.0, -math.pi, 0.1, 63), 5.0)) == [0.0] * 63


@given(st.integers(0, 1000), st.floats(-1.6, 2.6), st.floats(-1.1, 2.1))
def test_the_distance_is_that_of_the_nearest_cell(seed: int, x: float, y: float) -> None:
    """From its edge, and 0 inside."""
    cells = drawn_walls(seed)
    want = min(
        (math.hypot(max(low_x - x, x - high_x, 0), max(low_y - y, y - high_y, 0)))
        for low_x, low_y, high_x, high_y in map(limits, cells)
    )
    assert walls_of(cells).distance(x, y) == pytest.approx(want, abs=1e-9)


def test_a_map_without_walls_is_endless() -> None:
    """Nothing is near, and no ray ends."""
    walls = walls_of(set())
    assert walls.distance(0.0, 0.0) == math.inf
    assert list(walls.ranges(0.0, 0.0, Rays(0.0, 0.0, 1.0, 6), 10.0)) == [math.inf] * 6
    assert list(walls.outlines()) == []


def test_the_outlines_are_the_edges_of_the_walls() -> None:
    """Neighbouring edges are one line; together they are as long as the edges of all cells."""
    lines = list(walls_of({(2, 3), (3, 3), (4, 3)}).outlines())
    assert len(lines) == 4
    assert sum(math.dist(*line) for line in lines) == pytest.approx(8 * CELL)


@given(st.floats(-2, 2), st.floats(-2, 2), st.integers(0, 100))
def test_boxes_and_circles_are_met_where_they_are(x: float, y: float, number: int) -> None:
    """As in a slow computation, from outside of them."""
    rays = Rays(0.1 * number, 0.0, 0.37, 17)
    box = (0.5, -0.3, 0.9, 0.4)
    for place, distance in enumerate(ranges_to_box(x, y, rays, box)):
        want = slowly(x, y, 0.1 * number + place * 0.37, box)
        assert distance == pytest.approx(want, abs=1e-6) or abs(want) < 1e-9 or math.isinf(want) != math.isinf(distance)
    if math.hypot(x - 0.5, y) > 0.31:
        found = ranges_to_circle(x, y, rays, (0.5, 0.0, 0.3))
        for along_x, along_y, distance in zip(rays.x, rays.y, found, strict=True):
            if math.isfinite(distance):
                met = x + distance * along_x, y + distance * along_y
                assert math.dist(met, (0.5, 0.0)) == pytest.approx(0.3, abs=1e-6)
