"""Says what a minute of a robot with a laser scanner in a map costs, in seconds of processor time.

Usage: python benchmarks/scanner.py [CELLS]

The map is a square room of so many cells on a side (200 unless told otherwise, at 5 cm), with a pillar every 2 m. The
robot drives through it in steps of 50 ms, and measures 360 rays with noise and dust every 100 ms, as it does in a
worker. What ROS takes to build messages of it is told apart.
"""

from __future__ import annotations

import random
import sys
import time

import numpy as np

from grader.runtime.message_classes import built, message_class
from grader.runtime.model.quantities import NS_PER_S
from grader.runtime.model.worlds import WallMap
from grader.runtime.simulation import Moment, Output, RobotInMap

CELL_M, MINUTE_S = 0.05, 60
#: Between two pillars, and the side of one, in cells.
APART, PILLAR = 40, 4


def room(cells: int) -> WallMap:
    """Return a square room with pillars."""
    grid = np.zeros((cells, cells), dtype=bool)
    grid[[0, -1]] = True
    grid[:, [0, -1]] = True
    for row in range(APART // 2, cells, APART):
        for column in range(APART // 2, cells, APART):
            grid[row : row + PILLAR, column : column + PILLAR] = True
    return WallMap(cells, cells, CELL_M, 0.0, 0.0, np.packbits(grid).tobytes())


def driven(map_: WallMap) -> tuple[RobotInMap, list[Output]]:
    """Return the robot after a minute, and all that it published and recorded."""
    robot = RobotInMap(map="room.yaml", x=0.5, y=0.5, range_noise=0.01, dust=0.05)
    robot.maps = {"room.yaml": map_}
    robot.begin(random.Random(1))
    outputs: list[Output] = []
    for number in range(MINUTE_S * NS_PER_S // robot.period):
        now = Moment(number * robot.period, number * robot.period)
        turn_rate = 0.8 if robot.clearance(robot.x, robot.y) < 0.3 else 0.1
        robot.command(now, {"linear": {"x": 0.3}, "angular": {"z": turn_rate}})
        outputs += robot.step(now)
    return robot, outputs


def main() -> None:
    """Print the costs."""
    map_ = room(int(sys.argv[1]) if len(sys.argv) > 1 else 200)
    began = time.process_time()
    robot, outputs = driven(map_)
    simulated = time.process_time()
    types = {**robot.publishes(), **robot.records()}
    classes = {topic: message_class(type_) for topic, type_ in types.items()}
    loaded = time.process_time()
    for topic, fields in outputs:
        built(classes[topic], fields, topic)
    done = time.process_time()
    scans = sum(topic == robot.scan for topic, _ in outputs)
    print(f"{map_.width} by {map_.height} cells, {scans} scans of {robot.rays} rays")
    print(f"simulation: {simulated - began:.2f} s of a processor")
    print(f"messages:   {done - loaded:.2f} s of a processor for {len(outputs)}")


if __name__ == "__main__":
    main()
