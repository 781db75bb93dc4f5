"""Lab 2: follows the wall on its right at a distance, by the range finder: a PD controller of
distance and angle.
"""

from __future__ import annotations

import math

import numpy as np
import ruedo

SPEED = 0.3  # m/s


def wall_at(scan: ruedo.Scan) -> tuple[float, float]:
    """Distance of the wall on the right (m), and its direction relative to the robot's (rad): a
    line through the hits of the rays to the right.
    """
    right = (scan.angles > -1.6) & (scan.angles < -0.8) & np.isfinite(scan.ranges)
    x, y = (
        scan.ranges[right] * np.cos(scan.angles[right]),
        scan.ranges[right] * np.sin(scan.angles[right]),
    )
    if len(x) < 5:
        return math.inf, 0.0
    slope, offset = np.polyfit(x, y, 1)
    return abs(offset) / math.hypot(1.0, slope), math.atan(slope)


def follow(distance: float = 0.8, seconds: float = 40.0) -> list[float]:
    """The measured distances from the wall, ten a second."""
    world = ruedo.World()
    for a, b in (
        ((-4, -3), (4, -3)),
        ((4, -3), (4, 3)),
        ((4, 3), (-4, 3)),
        ((-4, 3), (-4, -3)),
    ):
        world.wall(*a, *b)
    world.robot("p3at", -3.0, -1.5)
    kept = []
    with ruedo.launch(world, lockstep=1, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        seen = sim.step(20)
        for _ in range(int(10 * seconds)):
            scan = seen.latest(robot.lrf)
            apart, along = wall_at(scan)
            if scan.nearest(-0.4, 0.4) < distance + 0.6:  # a corner: to the left
                speed, turn = 0.1, 0.8
            else:
                speed = SPEED
                turn = float(np.clip(1.2 * (distance - min(apart, 2.0)) + 1.5 * along, -0.8, 0.8))
                kept.append(apart)
            seen = sim.step(20, [robot.velocity_command(speed, turn)])
    return kept


def main() -> None:
    kept = np.array(follow())
    print(
        f"the wall was {np.median(kept):.2f} m away, in the middle half of the time within "
        f"{np.percentile(kept, 25):.2f} to {np.percentile(kept, 75):.2f} m"
    )


if __name__ == "__main__":
    main()
