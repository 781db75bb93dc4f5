"""Lab 3: avoids what its sonars see, as Braitenberg's vehicles do: what is near on one side slows
the wheels of the other.
"""

from __future__ import annotations

import numpy as np
import ruedo

SEES = 1.2  # m


def avoid(seconds: float = 60.0, seed: int = 1) -> tuple[float, float]:
    """The distance driven (m), and the least clearance that the range finder measured (m)."""
    way, clearance, before = 0.0, np.inf, None
    with ruedo.launch("arena", lockstep=1, seed=seed, disable=["p3at/camera"]) as sim:
        robot = sim.robot("p3at")
        sonar = robot.device("sonar_front")
        headings = sonar.elements[:, 5]
        seen = sim.step(20)
        turning = 0.0
        for _ in range(int(10 * seconds)):
            reading = seen.latest(sonar)
            if reading is not None:
                near = np.clip(1.0 - reading.ranges / SEES, 0.0, 1.0)
                left, right = near[headings > 0.05].max(), near[headings < -0.05].max()
                ahead = near[abs(headings) < 0.8].max()
                if ahead > 0.3:
                    turning = turning or (0.8 if left < right else -0.8)
                    speed, turn = 0.0 if ahead > 0.5 else 0.1, turning
                else:
                    turning = 0.0
                    speed, turn = 0.35 * (1.0 - max(left, right)), 0.8 * (right - left)
            seen = sim.step(20, [robot.velocity_command(float(speed), float(turn))])
            place = seen.latest(robot.pose).position[:2]
            way += 0.0 if before is None else float(np.hypot(*(place - before)))
            before = place
            clearance = min(clearance, seen.latest(robot.lrf).nearest())
    return way, clearance


def main() -> None:
    way, clearance = avoid()
    print(f"{way:.1f} m, and nothing nearer than {clearance:.2f} m to the range finder")


if __name__ == "__main__":
    main()
