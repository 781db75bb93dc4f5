"""Lab 4: UMBmark (Borenstein and Feng, IEEE Transactions on Robotics and Automation 12, 1996): five
squares each way, from whose ends the errors of the odometry's track and of its wheels' diameters
follow.

When the odometry shows a turn of 90 degrees, the robot has turned by another angle: alpha (from the
error of the track) is an error at every corner, beta (from wheels of different diameters) along
every side. From the centres of gravity of the ends, with the side L: alpha = (x_cw + x_ccw) /
(-4 L), beta = (x_cw - x_ccw) / (-4 L).
"""

from __future__ import annotations

import math

import numpy as np
import ruedo

SIDE = 4.0  # m


def once(sim: ruedo.Simulation, sign: float) -> list[float]:
    """A square by the odometry alone. Where truth and odometry differ at its end, m."""
    robot = sim.robot("p3at")
    state = sim.step(20)

    def odometry() -> ruedo.Odometry:
        return state.latest(robot.odometry)

    for side in range(4):
        heading, begin = sign * side * math.pi / 2, odometry()
        rest = SIDE
        while rest > 0.004:
            turn = math.remainder(heading - odometry().theta, math.tau)
            speed = min(0.5, 0.05 + 0.8 * rest)
            state = sim.step(4, [robot.velocity_command(speed, 2.0 * turn)])
            rest = SIDE - math.hypot(odometry().x - begin.x, odometry().y - begin.y)
        while abs(turn := sign * (side + 1) * math.pi / 2 - odometry().theta) > 0.002:
            rate = math.copysign(min(0.8, 0.05 + 1.5 * abs(turn)), turn)
            state = sim.step(4, [robot.velocity_command(0.0, rate)])
        state = sim.step(40, [robot.velocity_command(0.0, 0.0)])
    pose, believed = state.latest(robot.pose), odometry()
    return [pose.x - believed.x, pose.y - believed.y]


def ends(sign: float, track_error: float, radius_error: float, runs: int) -> np.ndarray:
    """Of several squares, (runs, 2) m. sign: 1 counter-clockwise, -1 clockwise.

    The program drives by the odometry, so the true path deviates.
    """
    off = []
    for run in range(runs):
        with ruedo.launch(
            ruedo.World().robot("p3at"),
            lockstep=1,
            seed=run + 1,
            disable=["p3at/camera"],
            settings={
                "p3at/odometry.track_error": track_error,
                "p3at/odometry.radius_error": f"{radius_error} {-radius_error}",
                "p3at/odometry.slip_noise": 0.0005,
            },
        ) as sim:
            off.append(once(sim, sign))
    return np.array(off)


def umbmark(
    track_error: float = 0.02, radius_error: float = 0.0, runs: int = 5
) -> tuple[float, float, float]:
    """The relative errors of the track and of the wheels' radii, and
    E_max,syst (m).
    """
    with ruedo.launch(ruedo.World().robot("p3at"), disable=["p3at/camera"]) as sim:
        track = sim.robot("p3at").track
    ccw = ends(1.0, track_error, radius_error, runs).mean(axis=0)
    cw = ends(-1.0, track_error, radius_error, runs).mean(axis=0)
    # A robot that overestimates its track believes that it has turned less, and turns too far.
    alpha = (cw[0] + ccw[0]) / (-4.0 * SIDE)
    beta = (cw[0] - ccw[0]) / (-4.0 * SIDE)
    wrong_track = -alpha / (math.pi / 2)
    curve = (SIDE / 2) / math.sin(beta / 2) if beta else math.inf
    ratio = (curve + track / 2) / (curve - track / 2) if math.isfinite(curve) else 1.0
    return wrong_track, (ratio - 1.0) / 2.0, float(max(np.hypot(*ccw), np.hypot(*cw)))


def main() -> None:
    for track_error, radius_error in ((0.02, 0.0), (0.0, 0.002), (0.02, 0.002)):
        track, radius, worst = umbmark(track_error, radius_error)
        print(
            f"planted: track {track_error:+.3f}, radii {radius_error:+.4f}; measured: track {track:+.3f}, radii {radius:+.4f}; "
            f"E_max,syst {worst:.3f} m"
        )


if __name__ == "__main__":
    main()
