"""Lab 6: Monte Carlo localisation (Thrun, Burgard, Fox, Probabilistic Robotics, chapter 8): where
the robot is, from a map of the walls, its odometry and its scans, with an unknown start.
"""

from __future__ import annotations

import math

import numpy as np
import ruedo
from numpy.typing import ArrayLike

WALLS = [
    ((-4.0, -3.0), (4.0, -3.0)),
    ((4.0, -3.0), (4.0, 3.0)),
    ((4.0, 3.0), (-4.0, 3.0)),
    ((-4.0, 3.0), (-4.0, -3.0)),
    ((-1.0, -3.0), (-1.0, -0.5)),
    ((1.5, 3.0), (1.5, 1.0)),
    ((2.0, -1.5), (4.0, -1.5)),
]
BEAMS = slice(5, 181, 17)  # of the scan's 181
SIGMA = 0.4  # m, of a beam; far above its noise, since no particle is exactly where the robot is
FEW = 1000  # so many particles are enough once they are close together
START = (-2.5, 1.0, 0.4)
THICKNESS = 0.1  # m


def ranges_from(
    poses: np.ndarray, angles: np.ndarray, walls: ArrayLike = WALLS, most: float = 8.0
) -> np.ndarray:
    """What a range finder would measure at (n, 3) poses of its own (m, m, rad): (n, beams) m."""
    heading = poses[:, 2, None] + angles
    direction = np.stack([np.cos(heading), np.sin(heading)], axis=-1)
    nearest = np.full(heading.shape, most)
    for a, b in np.asarray(walls):
        begin, along = a, b - a
        # origin + r direction = begin + s along
        cross = direction[..., 0] * along[1] - direction[..., 1] * along[0]
        to = begin - poses[:, None, :2]
        with np.errstate(divide="ignore", invalid="ignore"):
            r = (to[..., 0] * along[1] - to[..., 1] * along[0]) / cross
            s = (to[..., 0] * direction[..., 1] - to[..., 1] * direction[..., 0]) / cross
        hit = (r > 0) & (s >= 0) & (s <= 1)
        nearest = np.where(hit, np.minimum(nearest, r - THICKNESS / 2), nearest)
    return nearest


class Filter:
    def __init__(
        self, particles: int, generator: np.random.Generator, walls: ArrayLike = WALLS
    ) -> None:
        self._draw, self._walls = generator, walls
        self.poses = np.column_stack(
            [
                generator.uniform(-3.9, 3.9, particles),
                generator.uniform(-2.9, 2.9, particles),
                generator.uniform(-math.pi, math.pi, particles),
            ]
        )

    def move(self, way: float, side: float, turn: float) -> None:
        """Moves the particles by the odometry's motion (m, m, rad), in the robot's frame, with
        noise."""
        count = len(self.poses)
        spread = 0.01 + 0.1 * math.hypot(way, side)
        way_of = way + self._draw.normal(0, spread, count)
        side_of = side + self._draw.normal(0, spread, count)
        cos, sin = np.cos(self.poses[:, 2]), np.sin(self.poses[:, 2])
        self.poses[:, 0] += cos * way_of - sin * side_of
        self.poses[:, 1] += sin * way_of + cos * side_of
        self.poses[:, 2] += turn + self._draw.normal(0, 0.01 + 0.1 * abs(turn), count)

    def see(self, measured: np.ndarray, angles: np.ndarray, ahead: float) -> None:
        """Weights the particles by a scan, and resamples. ahead: of the device, from the robot's
        centre, m.
        """
        device = self.poses.copy()
        device[:, 0] += ahead * np.cos(self.poses[:, 2])
        device[:, 1] += ahead * np.sin(self.poses[:, 2])
        off = ranges_from(device, angles, self._walls) - measured
        likelihood = -0.5 * np.minimum(off / SIGMA, 3.0) ** 2
        weights = np.exp(likelihood.sum(axis=1) - likelihood.sum(axis=1).max())
        weights /= weights.sum()
        if 1.0 / (weights**2).sum() < 0.5 * len(weights):  # low variance resampling
            count = FEW if self.poses[:, :2].std(axis=0).max() < 0.5 else len(weights)
            places = (np.arange(count) + self._draw.random()) / count
            chosen = np.searchsorted(np.cumsum(weights), places)
            self.poses = self.poses[chosen.clip(max=len(weights) - 1)]

    def estimate(self) -> np.ndarray:
        """x, y, heading."""
        cos, sin = np.cos(self.poses[:, 2]).mean(), np.sin(self.poses[:, 2]).mean()
        return np.array([*self.poses[:, :2].mean(axis=0), math.atan2(sin, cos)])


def localise(seconds: float = 40.0, particles: int = 10_000, seed: int = 1) -> list[float]:
    """The error of the estimate, ten times a second (m)."""
    world = ruedo.World()
    for a, b in WALLS:
        world.wall(*a, *b, thickness=THICKNESS)
    world.robot("p3at", *START)
    filter = Filter(particles, np.random.default_rng(seed))
    errors = []
    with ruedo.launch(
        world,
        lockstep=1,
        seed=seed,
        disable=["p3at/camera"],
        settings={"p3at/odometry.slip_noise": 0.005, "p3at/odometry.track_error": 0.02},
    ) as sim:
        robot = sim.robot("p3at")
        ahead = float(robot.lrf.position[0])
        seen, turning = sim.step(20), 0.0
        before = seen.latest(robot.odometry)
        for _ in range(int(10 * seconds)):
            scan = seen.latest(robot.lrf)
            now = seen.latest(robot.odometry)
            cos, sin = math.cos(before.theta), math.sin(before.theta)
            x, y = now.x - before.x, now.y - before.y
            if math.hypot(x, y) > 0.02 or abs(now.theta - before.theta) > 0.02:
                filter.move(cos * x + sin * y, cos * y - sin * x, now.theta - before.theta)
                measured = np.nan_to_num(scan.ranges[BEAMS], posinf=8.0, neginf=0.0)
                filter.see(measured, scan.angles[BEAMS], ahead)
                before = now
            pose = seen.latest(robot.pose)
            errors.append(float(np.hypot(*(filter.estimate()[:2] - (pose.x, pose.y)))))
            if scan.nearest(-0.7, 0.7) > 0.8:
                turning, command = 0.0, (0.35, 0.1)
            else:
                left, right = scan.nearest(0.0, 1.2), scan.nearest(-1.2, 0.0)
                turning = turning or (0.8 if left > right else -0.8)
                command = (0.0, turning)
            seen = sim.step(20, [robot.velocity_command(*command)])
    return errors


def main() -> None:
    errors = localise()
    for second in range(0, len(errors) // 10, 5):
        print(f"after {second:2} s the estimate is {errors[10 * second]:.2f} m off")


if __name__ == "__main__":
    main()
