"""Lab 5: a map of the arena from scans at known poses: an occupancy grid of log odds, as a picture.

python mapping.py [map.png]
"""

from __future__ import annotations

import math
import sys

import numpy as np
import ruedo
from ruedo.geometry import transformed

CELL = 0.1  # m
HALF = 8.0  # m: the map goes from -8 to 8
HIT, MISS = 0.85, -0.4  # log odds of a ray's end, and of what it went through


class Grid:
    def __init__(self) -> None:
        cells = int(2 * HALF / CELL)
        self.log_odds = np.zeros((cells, cells))  # [x, y]

    def cells(self, points: np.ndarray) -> np.ndarray:
        return np.floor((points + HALF) / CELL).astype(int)

    def add(self, origin: np.ndarray, points: np.ndarray) -> None:
        """Adds a scan: where its rays began, and where they ended, (n, 2) m in the world."""
        ways = np.linalg.norm(points - origin, axis=1)
        free = []
        for point, way in zip(points, ways):
            part = np.arange(0.0, max(way - CELL, 0.0), CELL / 2) / way
            free.append(self.cells(origin + part[:, None] * (point - origin)))
        self._change(np.unique(np.concatenate(free), axis=0), MISS)
        self._change(np.unique(self.cells(points), axis=0), HIT)

    def _change(self, cells: np.ndarray, by: float) -> None:
        inside = ((cells >= 0) & (cells < len(self.log_odds))).all(axis=1)
        x, y = cells[inside].T
        self.log_odds[x, y] = np.clip(self.log_odds[x, y] + by, -5.0, 5.0)


def explore(seconds: float = 60.0, seed: int = 1) -> Grid:
    """Drives around the arena, away from near obstacles, and maps what it sees."""
    grid = Grid()
    with ruedo.launch("arena", lockstep=1, seed=seed, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen, turning = sim.step(20), 0.0
        for decision in range(int(10 * seconds)):
            scan, pose = seen.latest(robot.lrf), seen.latest(robot.pose)
            if decision % 3 == 0:
                origin = transformed(robot.lrf.position[None], pose)[0, :2]
                grid.add(origin, scan.points(robot.lrf, pose)[:, :2])
            if scan.nearest(-0.7, 0.7) > 0.9:
                turning, command = 0.0, (0.4, 0.1 * math.sin(0.05 * decision))
            else:
                left, right = scan.nearest(0.0, 1.2), scan.nearest(-1.2, 0.0)
                turning = turning or (0.8 if left > right else -0.8)
                command = (0.0, turning)
            seen = sim.step(20, [robot.velocity_command(*command)])
    return grid


def main() -> None:
    from matplotlib import pyplot

    grid = explore()
    file = sys.argv[1] if len(sys.argv) > 1 else "map.png"
    pyplot.imsave(file, 1.0 - 1.0 / (1.0 + np.exp(-grid.log_odds.T)), cmap="gray", origin="lower")
    print(f"{(grid.log_odds > 1).sum() * CELL * CELL:.1f} m^2 are taken; {file} shows it")


if __name__ == "__main__":
    main()
